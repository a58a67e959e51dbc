use hlcp_core::{Hlcp, LinearOperator, Norms, Rhs, Scalar};

/// A modulus-based method on a fixed problem: what [`Solver`](crate::Solver) iterates.
///
/// One iteration is [`steps`](Self::steps) steps, numbered from 0. The steps are public, so a loop can be
/// driven by hand:
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega, Rhs};
/// use hlcp_methods::{Method, Mms};
///
/// let a = FivePoint::new(3, 3, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(3, 3, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let omega = Omega::diagonal_ratio(1.0, &a, &b)?;
/// let mut mgs = Mms::new(Hlcp::new(a, b, omega)?, Aor::gauss_seidel())?;
///
/// let q = [1.0, -2.0, 3.0, -4.0, 5.0, -6.0, 7.0, -8.0, 9.0];
/// let q = Rhs::new(&q)?;
/// let (mut x, mut y) = (vec![1.0; 9], vec![0.0; 9]);
/// while mgs.step(0, &q, &x, &mut y).l2 > 1e-10 {
///     std::mem::swap(&mut x, &mut y);
/// }
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub trait Method<T: Scalar> {
    /// The type of the operator `A`.
    type A: LinearOperator<T>;
    /// The type of the operator `B`.
    type B: LinearOperator<T>;

    /// The problem.
    fn problem(&self) -> &Hlcp<T, Self::A, Self::B>;

    /// How many steps make one iteration.
    fn steps(&self) -> usize {
        1
    }

    /// How many sweeps over the unknowns the `iterations` since [`restart`](Self::restart) were worth; one a step where a
    /// step is a sweep.
    fn sweeps(&self, iterations: usize) -> usize {
        iterations * self.steps()
    }

    /// Forgets earlier iterates; a [`Solver`](crate::Solver) calls it as it begins a solve. Only a method whose steps
    /// depend on those before has anything to forget.
    fn restart(&mut self) {}

    /// Whether a step depends on those before it. An iterate that comes back then need not come back for ever, and a
    /// [`Solver`](crate::Solver) does not call that [cycling](crate::Status::Cycling).
    fn remembers(&self) -> bool {
        false
    }

    /// The iterations of inner linear solves since [`restart`](Self::restart), of a method that has them.
    fn linear_iterations(&self) -> Option<usize> {
        None
    }

    /// The norms of `A z − B r + q` at `x`, of a method whose steps cost much more; a [`Solver`](crate::Solver) then takes
    /// no step from the iterate that is its answer.
    fn residual(&mut self, _q: &Rhs<'_, T>, _x: &[T]) -> Option<Norms> {
        None
    }

    /// Takes step number `k` of an iteration, from `x` to `y`, and returns the norms of `A z − B r + q` at `x`, the
    /// step's *input*.
    ///
    /// What `y` held before is never read. `y` depends on the arguments and on the steps since
    /// [`restart`](Self::restart) alone.
    ///
    /// # Panics
    ///
    /// Unless `k` is below [`steps`](Self::steps) and all slices have the problem's order.
    fn step(&mut self, k: usize, q: &Rhs<'_, T>, x: &[T], y: &mut [T]) -> Norms;
}

/// Overwrites `y` with one whole iteration from `x`, and returns the norms at `x`; `between` is scratch.
pub(crate) fn iterate<T: Scalar, M: Method<T>>(
    method: &mut M,
    q: &Rhs<'_, T>,
    x: &[T],
    y: &mut [T],
    between: &mut [T],
) -> Norms {
    let last = method.steps() - 1;
    // The last step must end in y.
    let (mut to, mut other) = if last.is_multiple_of(2) { (y, between) } else { (between, y) };
    let norms = method.step(0, q, x, to);
    for k in 1..=last {
        std::mem::swap(&mut to, &mut other);
        let _ = method.step(k, q, other, to);
    }
    norms
}

impl<T: Scalar, M: Method<T> + ?Sized> Method<T> for Box<M> {
    type A = M::A;
    type B = M::B;

    fn problem(&self) -> &Hlcp<T, Self::A, Self::B> {
        (**self).problem()
    }

    fn steps(&self) -> usize {
        (**self).steps()
    }

    fn sweeps(&self, iterations: usize) -> usize {
        (**self).sweeps(iterations)
    }

    fn restart(&mut self) {
        (**self).restart();
    }

    fn remembers(&self) -> bool {
        (**self).remembers()
    }

    fn linear_iterations(&self) -> Option<usize> {
        (**self).linear_iterations()
    }

    fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        (**self).residual(q, x)
    }

    fn step(&mut self, k: usize, q: &Rhs<'_, T>, x: &[T], y: &mut [T]) -> Norms {
        (**self).step(k, q, x, y)
    }
}
