use hlcp_core::{Hlcp, LinearOperator, Rows, Scalar, assert_lengths};

/// The Jacobian `J(x) = (A + BΩ) + (A − BΩ) diag(sign x)` of F where no entry of `x` is zero.
///
/// Its columns are `2A_j` where `xⱼ ≥ 0` and `2ωⱼB_j` where `xⱼ < 0`, so it depends on signs alone;
/// at `xⱼ = 0` it is one of the two derivatives that meet there. `F(x) = J(x) x + γq`.
///
/// ```
/// use hlcp_methods::{FivePoint, Hlcp, Identity, Jacobian, Omega};
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?;
/// let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(5.0))?;
/// let mut y = [0.0; 2];
/// Jacobian::new(&problem, &[0.1, -7.0]).apply(&[1.0, 1.0], &mut y, &mut vec![]);
/// assert_eq!(y, [6.0, -2.0 + 10.0]);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Jacobian<'p, T, A, B> {
    problem: &'p Hlcp<T, A, B>,
    x: &'p [T],
}

impl<'p, T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Jacobian<'p, T, A, B> {
    /// J(x).
    ///
    /// # Panics
    ///
    /// Unless `x` has the problem's order, and when ranks share the problem: a product needs what
    /// the others have.
    pub fn new(problem: &'p Hlcp<T, A, B>, x: &'p [T]) -> Self {
        assert!(problem.strip().is_none(), "a Jacobian of a problem that ranks share");
        assert_lengths(problem.order(), [("x", x.len())]);
        Self { problem, x }
    }

    /// Overwrites `y` with `J(x) s`.
    ///
    /// `scratch` is resized to `2n` when it is shorter and keeps nothing that matters between
    /// calls.
    ///
    /// # Cost
    ///
    /// One product with `A`, one with `B`.
    ///
    /// # Panics
    ///
    /// Unless `s` and `y` have the problem's order.
    pub fn apply(&self, s: &[T], y: &mut [T], scratch: &mut Vec<T>) {
        let n = self.x.len();
        assert_lengths(n, [("s", s.len()), ("y", y.len())]);
        if scratch.len() < 2 * n {
            scratch.resize(2 * n, T::zero());
        }
        let (part, product) = scratch[..2 * n].split_at_mut(n);
        for (j, (part, &s)) in part.iter_mut().zip(s).enumerate() {
            *part = if self.is_active(j) { s + s } else { T::zero() };
        }
        self.problem.a().apply(part, y);
        for (j, (part, &s)) in part.iter_mut().zip(s).enumerate() {
            let omega = self.problem.omega().entry(j);
            *part = if self.is_active(j) { T::zero() } else { omega * (s + s) };
        }
        self.problem.b().apply(part, product);
        for (y, &product) in y.iter_mut().zip(&*product) {
            *y += product;
        }
    }
}

impl<'p, T: Scalar, A, B> Jacobian<'p, T, A, B> {
    /// The problem.
    pub fn problem(&self) -> &'p Hlcp<T, A, B> {
        self.problem
    }

    /// Returns whether column `j` is one of `A`.
    ///
    /// # Panics
    ///
    /// Unless `j` is below the order.
    #[inline]
    pub fn is_active(&self, j: usize) -> bool {
        self.x[j] >= T::zero()
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Jacobian<'_, T, A, B> {
    /// Calls `visit` with the columns and values of the entries of row `i`, those of `A` first; no
    /// column comes twice.
    ///
    /// # Panics
    ///
    /// May panic unless `i` is below the order.
    ///
    /// ```
    /// use hlcp_methods::{FivePoint, Hlcp, Identity, Jacobian, Omega};
    ///
    /// let a = FivePoint::new(2, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(5.0))?;
    /// let mut row = vec![];
    /// Jacobian::new(&problem, &[0.1, -7.0]).visit_row(1, |j, entry| row.push((j, entry)));
    /// // of A the first column, of BΩ the second
    /// assert_eq!(row, [(0, 2.0 * -1.0), (1, 2.0 * 5.0)]);
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    #[inline]
    pub fn visit_row(&self, i: usize, mut visit: impl FnMut(usize, T)) {
        self.problem.a().visit_row(i, &mut |j, a| {
            if self.is_active(j) {
                visit(j, a + a);
            }
        });
        self.problem.b().visit_row(i, &mut |j, b| {
            if !self.is_active(j) {
                visit(j, self.problem.omega().entry(j) * (b + b));
            }
        });
    }
}
