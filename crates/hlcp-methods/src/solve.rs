use std::fmt;

use hlcp_core::{Compiled, Error, Hlcp, Rows, Scalar, check_orders};

use crate::{Auto, NotConverged, Options, Outcome, Solver};

/// The answer of [`solve`], which prints as its outcome.
///
/// ```
/// use hlcp_methods::{Identity, solve};
///
/// let one = Identity { order: 1 };
/// let answer = solve(&one, &one, &[-3.0])?;
/// assert!(answer.converged() && answer.to_string().starts_with("converged after"));
/// assert_eq!(answer.ok()?.z, [3.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[must_use = "an iteration may end without converging"]
#[non_exhaustive]
pub struct Solution<T> {
    /// The unknown `z`, of the problem's order.
    pub z: Vec<T>,
    /// The complementary unknown `r`, of the problem's order.
    pub r: Vec<T>,
    /// How the iteration ended, and the residual of `z` and `r`.
    pub outcome: Outcome,
}

impl<T> Solution<T> {
    /// Returns whether the answer meets the tolerance.
    pub fn converged(&self) -> bool {
        self.outcome.converged()
    }

    /// Returns the solution if it converged.
    ///
    /// # Errors
    ///
    /// [`NotConverged`] with the outcome if not.
    pub fn ok(self) -> Result<Self, NotConverged> {
        self.outcome.ok().map(|()| self)
    }
}

impl<T> fmt::Display for Solution<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.outcome.fmt(f)
    }
}

/// Solves HLCP(A, B, q): finds `z, r ≥ 0` with `zᵀ r = 0` and `A z − B r + q = 0`.
///
/// By [`Auto`] with Ω = D_A D_B⁻¹, within the default [`Limits`](crate::Limits) and from `x = 0`.
/// For other limits, a start or an observer there is [`solve_with`]; to solve for many `q` or to
/// choose a method, keep a [`Solver`]. With [`Identity`](hlcp_core::Identity) for `b` the problem
/// is the LCP.
///
/// # Errors
///
/// What [`LinearOperator::check`](hlcp_core::LinearOperator::check) of `a` or `b` refuses, as a
/// matrix that is not square; [`Error::Order`] when `b` or `q` does not fit `a`;
/// [`Error::NotPositive`] for the first diagonal entry of `b` that is negative where that of `a` is
/// not; [`Error::NotFinite`] for the first entry that is NaN or infinite. An iteration that does
/// not converge is no error: read `outcome`.
///
/// # Cost
///
/// That of [`Auto`]; the operators are not copied. The code is compiled once for all operators, so
/// a program that calls this builds in a second, where one with its own [`Solver`] of [`Auto`]
/// takes ten. In return a row of an operator that is neither a grid nor a matrix takes a call
/// through `dyn`: such solves take 1.1 to 1.6 times as long.
///
/// ```
/// use hlcp_methods::{FivePoint, solve};
///
/// let a = FivePoint::new(30, 30, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let b = FivePoint::new(30, 30, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let q: Vec<f64> = (0..900).map(|k| if k % 30 < 10 { -0.1 } else { 0.2 }).collect();
///
/// let answer = solve(&a, &b, &q)?.ok()?;
/// assert!(answer.z[0] > 0.0 && answer.r[29] > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve<T, A, B>(a: &A, b: &B, q: &[T]) -> Result<Solution<T>, Error>
where
    T: Scalar,
    A: Rows<T> + ?Sized,
    B: Rows<T> + ?Sized,
{
    solve_with(a, b, q, Options::default())
}

/// Solves HLCP(A, B, q) as [`solve`] does, with a start, limits and an observer of your choice.
///
/// A limit on the time is one on the iterations: two walks over the rows precede them.
///
/// # Errors
///
/// Those of [`solve`] and of [`Solver::solve`].
///
/// ```
/// use std::time::Duration;
/// use hlcp_methods::{FivePoint, Identity, Limits, solve_with};
///
/// let a = FivePoint::new(30, 30, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let q: Vec<f64> = (0..900).map(|k| if k % 30 < 10 { -0.1 } else { 0.2 }).collect();
/// let limits = Limits { time: Some(Duration::from_secs(60)), ..Limits::relative(1e-6) };
/// let answer = solve_with(&a, &Identity { order: 900 }, &q, limits)?.ok()?;
/// assert!(answer.outcome.relative.l2 <= 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_with<'o, T, A, B>(
    a: &A,
    b: &B,
    q: &[T],
    options: impl Into<Options<'o, T>>,
) -> Result<Solution<T>, Error>
where
    T: Scalar,
    A: Rows<T> + ?Sized,
    B: Rows<T> + ?Sized,
{
    SOLVE.of::<Solve<T>>()(&a, &b, q, options.into())
}

type Solve<T> = fn(&dyn Rows<T>, &dyn Rows<T>, &[T], Options<'_, T>) -> Result<Solution<T>, Error>;

/// Compiled once for all operators: `Auto` with its methods is most of what a program that solves
/// one problem would compile.
static SOLVE: Compiled<Solve<f32>, Solve<f64>> = Compiled(by_auto, by_auto);

fn by_auto<T: Scalar>(
    a: &dyn Rows<T>,
    b: &dyn Rows<T>,
    q: &[T],
    options: Options<'_, T>,
) -> Result<Solution<T>, Error> {
    // Before anything walks the rows, of which there may be more than anybody meant.
    a.check("A")?;
    b.check("B")?;
    check_orders(a.order(), &[("q", q.len())])?;
    let mut solver = Solver::new(Auto::new(Hlcp::from_pair(a, b)?)?);
    let outcome = solver.solve(q, options)?;
    Ok(Solution { z: solver.z().to_vec(), r: solver.r().to_vec(), outcome })
}
