use hlcp_core::{Error, Hlcp, Omega, Rows, Scalar};

use crate::{Auto, Options, Outcome, Solver};

/// The answer of [`solve`].
#[derive(Debug, Clone, PartialEq)]
pub struct Solution<T> {
    /// The unknown `z`, of the problem's order.
    pub z: Vec<T>,
    /// The complementary unknown `r`, of the problem's order.
    pub r: Vec<T>,
    /// How the iteration ended, and the residual of `z` and `r`.
    pub outcome: Outcome,
}

/// Solves HLCP(A, B, q): finds `z, r ≥ 0` with `zᵀ r = 0` and `A z − B r + q = 0`.
///
/// By [`Auto`] with Ω = D_A D_B⁻¹, within the default [`Limits`](crate::Limits) and from `x = 0`.
/// To solve for many `q`, to choose a method, a start or other limits, keep a [`Solver`]. With
/// [`Identity`](hlcp_core::Identity) for `b` the problem is the LCP; see [`Hlcp::lcp`].
///
/// # Errors
///
/// [`Error::Order`] when `b` or `q` does not fit `a`; [`Error::NotPositive`] for the first diagonal
/// entry that is not positive; [`Error::NotFinite`] for the first entry that is NaN or infinite. An
/// iteration that does not converge is no error: read `outcome`.
///
/// # Cost
///
/// That of [`Auto`]; the operators are not copied.
///
/// ```
/// use hlcp_methods::{FivePoint, solve};
///
/// let a = FivePoint::new(30, 30, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let b = FivePoint::new(30, 30, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let q: Vec<f64> = (0..900).map(|k| if k % 30 < 10 { -0.1 } else { 0.2 }).collect();
///
/// let answer = solve(&a, &b, &q)?;
/// assert!(answer.outcome.converged(), "{}", answer.outcome);
/// assert!(answer.z[0] > 0.0 && answer.r[29] > 0.0);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
pub fn solve<T, A, B>(a: &A, b: &B, q: &[T]) -> Result<Solution<T>, Error>
where
    T: Scalar,
    A: Rows<T>,
    B: Rows<T>,
{
    let problem = Hlcp::new(a, b, Omega::diagonal_ratio(T::one(), a, b)?)?;
    let mut solver = Solver::new(Auto::new(problem)?);
    let outcome = solver.solve(q, Options::default())?;
    Ok(Solution { z: solver.z().to_vec(), r: solver.r().to_vec(), outcome })
}
