use hlcp_core::{Hlcp, LinearOperator, Norms, Rhs, Scalar};

use crate::{AutoTurn, Clock, Status, Work};

/// A modulus-based method on a fixed problem, which a [`Solver`](crate::Solver) iterates.
///
/// The steps are public, so a loop can be driven by hand:
///
/// ```
/// use hlcp_methods::{Aor, Clock, FivePoint, Hlcp, Method, Mms, Rhs};
///
/// let a = FivePoint::new(3, 3, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(3, 3, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let mut mgs = Mms::new(Hlcp::from_pair(a, b)?, Aor::gauss_seidel())?;
///
/// let q = [1.0, -2.0, 3.0, -4.0, 5.0, -6.0, 7.0, -8.0, 9.0];
/// let q = Rhs::new(&q)?;
/// let (mut x, mut y) = (vec![1.0; 9], vec![0.0; 9]);
/// while mgs.step(&q, &x, &mut y, &mut Clock::endless()).l2 > 1e-10 {
///     std::mem::swap(&mut x, &mut y);
/// }
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a method",
    note = "a problem needs a method, as in `Auto::new(problem)?`",
    note = "a step needs one too, as in `Mms::new(problem, Aor::gauss_seidel())?`",
    note = "`Mms::new(..)` and its like return a `Result`: add `?`"
)]
pub trait Method<T: Scalar> {
    /// The type of the operator `A`.
    type A: LinearOperator<T>;
    /// The type of the operator `B`.
    type B: LinearOperator<T>;

    /// The problem.
    fn problem(&self) -> &Hlcp<T, Self::A, Self::B>;

    /// Overwrites `y` with the next iterate after `x`, or with what
    /// [`complete`](Self::complete) makes it of, and returns the norms of `A z − B r + q` at `x`,
    /// the step's *input*.
    ///
    /// What `y` held before is never read. `y` depends on the arguments and on the steps since
    /// [`restart`](Self::restart) only. A step that takes longer than a sweep asks `clock`; when
    /// that is up the step returns the norms and may leave anything in `y`.
    ///
    /// # Panics
    ///
    /// Unless all vectors have the problem's order.
    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms;

    /// Completes in `y` the iteration that [`step`](Self::step) began there; `spare` is a vector of
    /// the same length to work in, and may change places with `y`.
    ///
    /// A method with two half-steps takes the second one here. Between the two a solver knows the
    /// norms at `x`, and only now gives up the vector that `x` may have to be kept in.
    fn complete(&mut self, _q: &Rhs<'_, T>, _y: &mut Vec<T>, _spare: &mut Vec<T>) {}

    /// Forgets earlier iterates; a [`Solver`](crate::Solver) calls it as it begins a solve. Only a
    /// method whose steps depend on those before has anything to forget.
    fn restart(&mut self) {}

    /// Returns whether a step depends on those before it. For such a method a repeated iterate does
    /// not imply a cycle, so a [`Solver`](crate::Solver) does not report
    /// [`Cycling`](crate::Status::Cycling).
    fn has_memory(&self) -> bool {
        false
    }

    /// Goes on in another way from the best iterate, of a method that has one left, and returns
    /// whether it does; a [`Solver`](crate::Solver) asks before it reports [`Status::Stagnated`] or
    /// [`Status::Diverged`].
    fn turn(&mut self, _end: Status) -> bool {
        false
    }

    /// Returns the method at work, of one that chooses among several: the one to go on with from an
    /// answer that it has found.
    fn at_work(&mut self) -> Option<&mut dyn Method<T, A = Self::A, B = Self::B>> {
        None
    }

    /// Returns the turns of methods since [`restart`](Self::restart), of one that chooses among
    /// several; the last is that of the method at work.
    fn turns(&self) -> &[AutoTurn] {
        &[]
    }

    /// Returns the work since [`restart`](Self::restart), of a method that counts it; of one that
    /// does not, a [`Solver`](crate::Solver) counts a sweep per iteration.
    fn work(&self) -> Option<Work> {
        None
    }

    /// Returns whether the method works on a problem that ranks share
    /// ([`Hlcp::shared_by`]); a [`Solver`](crate::Solver) refuses one that does not.
    ///
    /// Such a method takes norms, inner products and decisions through the problem, and makes the
    /// same calls on all ranks.
    fn works_on_ranks(&self) -> bool {
        false
    }

    /// Returns the norms of `A z − B r + q` at `x`, of a method whose steps cost much more; a
    /// [`Solver`](crate::Solver) then takes no step from the iterate that is its answer.
    fn residual(&mut self, _q: &Rhs<'_, T>, _x: &[T]) -> Option<Norms> {
        None
    }
}

/// Overwrites `y` with one whole iteration from `x`, and returns the norms at `x`; `spare` is
/// scratch.
pub(crate) fn iterate<T: Scalar, M: Method<T>>(
    method: &mut M,
    q: &Rhs<'_, T>,
    x: &[T],
    y: &mut Vec<T>,
    spare: &mut Vec<T>,
    clock: &mut Clock<'_>,
) -> Norms {
    let norms = method.step(q, x, y, clock);
    if !clock.is_up() {
        method.complete(q, y, spare);
    }
    norms
}

/// Overwrites `f` with F(x), and returns the norms of `A z − B r + q`.
pub(crate) fn measure<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    problem: &Hlcp<T, A, B>,
    q: &Rhs<'_, T>,
    x: &[T],
    f: &mut [T],
    scratch: &mut Vec<T>,
) -> Norms {
    problem.defect(q.entries(), x, f, scratch);
    problem.norms(f).divided_by(problem.gamma())
}

// For these two alone: a blanket over `DerefMut` would forbid it to types with their own.
macro_rules! forward {
    ($($pointer:ty),*) => {$(
        impl<T: Scalar, M: Method<T> + ?Sized> Method<T> for $pointer {
            type A = M::A;
            type B = M::B;

            fn problem(&self) -> &Hlcp<T, Self::A, Self::B> {
                (**self).problem()
            }

            fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
                (**self).step(q, x, y, clock)
            }

            fn complete(&mut self, q: &Rhs<'_, T>, y: &mut Vec<T>, spare: &mut Vec<T>) {
                (**self).complete(q, y, spare);
            }

            fn restart(&mut self) {
                (**self).restart();
            }

            fn has_memory(&self) -> bool {
                (**self).has_memory()
            }

            fn turn(&mut self, end: Status) -> bool {
                (**self).turn(end)
            }

            fn at_work(&mut self) -> Option<&mut dyn Method<T, A = Self::A, B = Self::B>> {
                (**self).at_work()
            }

            fn turns(&self) -> &[AutoTurn] {
                (**self).turns()
            }

            fn work(&self) -> Option<Work> {
                (**self).work()
            }

            fn works_on_ranks(&self) -> bool {
                (**self).works_on_ranks()
            }

            fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
                (**self).residual(q, x)
            }
        }
    )*};
}

forward!(&mut M, Box<M>);
