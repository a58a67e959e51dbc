use std::num::NonZeroUsize;

use super::{Step, splitting::positive_pivot};
use crate::{
    kernel::Sweep,
    numbers::{Error, Norms, Rhs, Scalar, positive},
    operators::{Direction, LinearOperator, Rows, check_row},
    problem::Hlcp,
    rows::{Colours, Order, Relaxation, Relaxed, Visited},
};

/// The accelerated overrelaxation splitting of the pair, with Jacobi, Gauss–Seidel and SOR as its
/// cases.
///
/// With `A = D_A − L_A − U_A` and `B = D_B − L_B − U_B` the forward splitting is
///
/// ```text
/// M = (D_A − β_A L_A)/α_A + (D_B − β_B L_B) Ω/α_B ,
/// ```
///
/// and the backward one has `U` in the place of `L`: (4) of the paper with one (α, β), (5) with one
/// each for A and B. Entry by entry, a forward step is the correction
///
/// ```text
/// mᵢᵢ (yᵢ − xᵢ) = − Fᵢ(x) − Σ_{j<i} mᵢⱼ (yⱼ − xⱼ) .
/// ```
///
/// | constructor | α | β |
/// |---|---|---|
/// | [`jacobi`](Self::jacobi) | 1 | 0 |
/// | [`gauss_seidel`](Self::gauss_seidel) | 1 | 1 |
/// | [`sor`](Self::sor) | α | α |
/// | [`new`](Self::new) | α | β |
///
/// # Cost
///
/// A step is one walk over the rows of `A` and of `B`, and yields the norms of its input for
/// nothing, without scratch. When both operators answer
/// [`as_five_point`](crate::LinearOperator::as_five_point) on one grid, the walk is one vectorised
/// pass over memory; its iterates differ from the walk's by rounding alone.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega, Rhs, Step};
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let b = FivePoint::new(2, 1, [0.0, 0.0, 1.0, 0.0, 0.0])?;
/// let problem = Hlcp::new(a, b, Omega::Uniform(4.0))?;
///
/// let (q, mut y) = ([-8.0, 3.0], [0.0; 2]);
/// Aor::gauss_seidel().step(&problem, &Rhs::new(&q)?, &[0.0, 0.0], &mut y, &mut vec![]);
/// assert_eq!(y, [1.0, (1.0 - 3.0) / 8.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aor<T> {
    // (α, β) for A and for B. Invariant: α is positive, and α, 1/α, β and β/α are finite.
    pairs: [[T; 2]; 2],
    accelerated: bool,
    order: Order,
}

/// Refuses an (α, β) of which no splitting can be made.
fn check<T: Scalar>([alpha, beta]: [T; 2]) -> Result<(), Error> {
    positive("alpha", alpha.wide())?;
    let quotients = [("beta", beta), ("1/alpha", alpha.recip()), ("beta/alpha", beta / alpha)];
    for (name, value) in quotients {
        if !value.is_finite() {
            return Err(Error::Parameter { name, value: value.wide(), range: "finite" });
        }
    }
    Ok(())
}

impl<T: Scalar> Aor<T> {
    /// Returns forward AOR with the same (α, β) for `A` and `B`.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] unless α is positive, and α, β, 1/α and β/α are finite.
    pub fn new(alpha: T, beta: T) -> Result<Self, Error> {
        Self::with_pairs([alpha, beta], [alpha, beta])
    }

    /// Returns forward AOR with one (α, β) for `A` and one for `B`, as in equation (5).
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), for either pair.
    ///
    /// ```
    /// let aor = hlcp_core::Aor::with_pairs([1.2, 0.9], [1.1, 1.1])?;
    /// assert_eq!(aor.pairs(), [[1.2, 0.9], [1.1, 1.1]]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn with_pairs(a: [T; 2], b: [T; 2]) -> Result<Self, Error> {
        check(a)?;
        check(b)?;
        Ok(Self::forward_with([a, b]))
    }

    fn forward_with(pairs: [[T; 2]; 2]) -> Self {
        let order = Order { backward: false, red_black: None };
        Self { pairs, accelerated: false, order }
    }

    /// Returns forward SOR.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] unless α is positive and finite. Beyond 2 the iteration diverges on all
    /// but a few problems.
    ///
    /// ```
    /// use hlcp_core::Aor;
    /// assert_eq!(Aor::sor(1.5)?, Aor::new(1.5, 1.5)?);
    /// assert_eq!(Aor::sor(1.0)?, Aor::gauss_seidel());
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn sor(alpha: T) -> Result<Self, Error> {
        Self::new(alpha, alpha)
    }

    /// Returns forward Gauss–Seidel.
    pub fn gauss_seidel() -> Self {
        Self::forward_with([[T::one(); 2]; 2])
    }

    /// Returns Jacobi, which knows no direction.
    pub fn jacobi() -> Self {
        Self::forward_with([[T::one(), T::zero()]; 2])
    }

    /// Returns the same parameters in the backward direction: `U` in the place of `L`.
    ///
    /// ```
    /// let second = hlcp_core::Aor::<f64>::gauss_seidel().backward();
    /// assert_eq!(second.backward(), second);
    /// ```
    pub fn backward(self) -> Self {
        Self { order: Order { backward: true, ..self.order }, ..self }
    }

    /// Returns the same parameters with the points of a grid in red–black order: a splitting of its
    /// own.
    ///
    /// Unknown `i` is point `i mod nx` of row `i / nx`, with `nx` points to a row; it is red where
    /// the sum of the two is even, and black elsewhere. Red comes before black, and by index within
    /// a colour: with the permutation `P` that sorts so, `M = Pᵀ M′P` where `M′` is the splitting
    /// of `P A Pᵀ` and `P B Pᵀ`, and theorems for every pair of a class hold. On five-point
    /// operators the sweep is one pass, with no chain from point to point.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for rows without points.
    ///
    /// ```
    /// use hlcp_core::{Aor, FivePoint, Hlcp, Rhs, Step};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(3, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?)?;
    /// let (q, mut y) = ([-6.0, 0.0, -12.0], [0.0; 3]);
    /// let red_black = Aor::gauss_seidel().red_black(3)?;
    /// red_black.step(&problem, &Rhs::new(&q)?, &[0.0; 3], &mut y, &mut vec![]);
    /// assert_eq!(y, [1.0, 0.5, 2.0]); // red: −qᵢ/6; black: (y₀ + y₂)/6
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn red_black(self, nx: usize) -> Result<Self, Error> {
        let name = "the number of points in a row of the grid";
        let wrong = Error::Parameter { name, value: 0.0, range: "positive" };
        let red_black = Some(NonZeroUsize::new(nx).ok_or(wrong)?);
        Ok(Self { order: Order { red_black, ..self.order }, ..self })
    }

    /// Returns the same parameters in the forward direction.
    pub fn forward(self) -> Self {
        Self { order: Order { backward: false, ..self.order }, ..self }
    }

    /// Returns the step of the accelerated method, AMMS (section 4 of the paper), with the same
    /// splitting.
    ///
    /// `Mms` with it is AMMS. With `M_A₂ = D_A − U_A`, `M_B₂ = D_B − U_B` an iteration solves
    ///
    /// ```text
    /// (M_B₁Ω + M_A₁) x⁺ + (N_B₂Ω − N_A₂)|x⁺| = (N_B₁Ω + N_A₁) x + (M_B₂Ω − M_A₂)|x| − γ q .
    /// ```
    ///
    /// Since `N_A₂ = L_A` and `N_B₂ = L_B` are strictly lower triangular, this is the plain step
    /// with |yⱼ| in the place of |xⱼ| wherever the sweep has passed,
    ///
    /// ```text
    /// mᵢᵢ (yᵢ − xᵢ) = − Fᵢ(x) − Σ_{j<i} [ mᵢⱼ (yⱼ − xⱼ) + (aᵢⱼ − bᵢⱼ ωⱼ)(|yⱼ| − |xⱼ|) ] .
    /// ```
    ///
    /// Backward, `U` takes the place of `L` throughout. The cost is that of the plain step.
    ///
    /// ```
    /// use hlcp_core::{Aor, FivePoint, Hlcp, Rhs, Step};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
    /// let (q, mut y) = ([-8.0, 2.0], [0.0; 2]);
    /// let amgs = Aor::gauss_seidel().accelerated();
    /// amgs.step(&problem, &Rhs::new(&q)?, &[0.0; 2], &mut y, &mut vec![]);
    /// assert_eq!(y, [1.0, 0.0]); // 8y₁ = −2 + y₀ + |y₀|, where the plain step has |x₀| = 0
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn accelerated(self) -> Self {
        Self { accelerated: true, ..self }
    }

    /// Returns (α, β) for `A` and for `B`.
    pub fn pairs(&self) -> [[T; 2]; 2] {
        self.pairs
    }

    /// Returns whether the step is that of AMMS.
    pub fn is_accelerated(&self) -> bool {
        self.accelerated
    }

    /// Returns whether a sweep relaxes row `j` before row `i`: whether entry (i, j) is in the
    /// triangle `L` of the splitting, in the step's direction and order.
    ///
    /// ```
    /// use hlcp_core::Aor;
    ///
    /// let aor = Aor::<f64>::gauss_seidel();
    /// assert!(aor.precedes(1, 2) && aor.backward().precedes(2, 1));
    /// // On a grid with three points to a row, 1 is black and 2 is red.
    /// assert!(aor.red_black(3)?.precedes(2, 1));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn precedes(&self, j: usize, i: usize) -> bool {
        self.order.precedes(j, i)
    }

    /// Returns the fused sweep, where the operators and the order have one.
    fn fused<'p, A, B>(&self, problem: &'p Hlcp<T, A, B>) -> Option<Sweep<'p, T>>
    where
        A: LinearOperator<T>,
        B: LinearOperator<T>,
    {
        let sweep = problem.sweep().ok()?;
        // Across the seam of a grid that closes, points of one colour may be neighbours.
        let open = problem.round() == [false; 2];
        let Order { backward, red_black } = self.order;
        let fits = red_black.is_none_or(|nx| nx.get() == sweep.grid()[0] && open);
        fits.then(|| sweep.directed(backward, red_black.is_some()))
    }

    /// Takes the step by walking the rows, colour by colour if they have colours.
    pub(super) fn walk<A: Rows<T>, B: Rows<T>>(
        &self,
        problem: &Hlcp<T, A, B>,
        colours: Option<&Colours>,
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        let relaxed = Relaxed {
            q: q.entries(),
            x,
            omega: problem.omega().coefficients(),
            gamma: problem.gamma(),
            parallel: problem.is_parallel(),
            q_factor: problem.q_factor(),
            relaxations: self.relaxations(),
            accelerated: self.accelerated,
            meter: q.meter(problem.gamma()),
        };
        let order = self.order;
        let known =
            problem.on_known_rows(|rows| relaxed.sweep_known(order, colours, rows, y, scratch));
        known.unwrap_or_else(|| {
            let (a, b) = (Visited::new(problem.a()), Visited::new(problem.b()));
            relaxed.sweep(order, colours, a, b, y, scratch)
        })
    }

    fn relaxations(&self) -> [Relaxation<T>; 2] {
        self.pairs.map(Relaxation::new)
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Step<T, A, B> for Aor<T> {
    fn check(&self, problem: &Hlcp<T, A, B>) -> Result<(), Error> {
        if self.fused(problem).is_none() {
            problem.on_one_rank("a sweep over rows that are not five-point ones on one grid")?;
        }
        let [of_a, of_b] = self.relaxations();
        let check = |i| {
            positive_pivot(problem, i, of_a.diagonal, of_b.diagonal)?;
            check_row("row of A", problem.a(), i)?;
            check_row("row of B", problem.b(), i)
        };
        let n = problem.order();
        match problem.sweep().ok().filter(|sweep| sweep.constants().is_some()) {
            // The first rows with a western and with a southern neighbour have all there is, and
            // where the grid closes any row has.
            Some(sweep) => {
                [0, 1, sweep.grid()[0]].into_iter().filter(|&i| i < n).try_for_each(check)
            }
            None => (0..n).try_for_each(check),
        }
    }

    fn step(
        &self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        problem.assert_orders([("q", q.entries().len()), ("x", x.len()), ("y", y.len())]);
        problem.assert_whole(q);
        if let Some(fused) = self.fused(problem) {
            return fused.run(self.accelerated, self.relaxations(), q, x, y);
        }
        self.walk(problem, None, q, x, y, scratch)
    }
}
