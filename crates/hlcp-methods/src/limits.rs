use std::{fmt, time::Duration};

use hlcp_core::{Error, Norms, Rhs, Scalar};

/// The norm that a stopping test reads.
///
/// ```
/// use hlcp_methods::{Norm, Norms};
///
/// // A million entries of 1e-10: the largest is within 1e-10, the 2-norm is a thousand times that.
/// let norms = Norms::of(&vec![1e-10; 1_000_000]);
/// assert_eq!(Norm::LInf.of(norms), 1e-10);
/// assert!((Norm::L2.of(norms) - 1e-7).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Norm {
    /// The 2-norm.
    #[default]
    L2,
    /// The largest absolute value.
    LInf,
}

impl Norm {
    /// Returns this norm of the two.
    pub fn of(self, norms: Norms) -> f64 {
        match self {
            Self::L2 => norms.l2,
            Self::LInf => norms.linf,
        }
    }
}

/// How large a residual `‖A z − B r + q‖` may be in an answer.
///
/// ```
/// use hlcp_methods::{Aor, Hlcp, Identity, Limits, Mms, Omega, Solver, Tolerance};
///
/// // Half of the error goes in each sweep, from z − r = 3e-9 on.
/// let one = Identity { order: 1 };
/// let problem = Hlcp::new(one, one, Omega::Uniform(1.0))?;
/// let mut solver = Solver::new(Mms::new(problem, Aor::sor(0.5)?)?);
/// let mut sweeps = |tolerance| -> Result<usize, hlcp_methods::Error> {
///     let limits = Limits { tolerance, ..Limits::default() };
///     Ok(solver.solve(&[-3e-9], limits)?.iterations)
/// };
/// assert_eq!(sweeps(Tolerance::Relative(1e-10))?, 34);
/// assert_eq!(sweeps(Tolerance::Absolute(1e-16))?, 25);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// This multiple of ‖q‖, below 1. It is not relative to the first residual, so that a good
    /// start does not tighten the test.
    Relative(f64),
    /// This number, in the units of `q`; never more than a thousandth of ‖q‖.
    Absolute(f64),
}

/// When an iteration stops.
///
/// It has converged when the exact residual `‖A z − B r + q‖` of the answer, evaluated in twice the
/// digits of double precision, is within the [`tolerance`](Self::tolerance). Where an operator does
/// not know its rows, the measured residual and an estimate of its rounding are.
///
/// A precision too coarse for the tolerance (`f32`) converges as well when the residual is at most
/// `rounding·ε·(‖q‖ + a‖z‖ + b‖r‖)`, where `a` and `b` are the lengths of a typical row of `A` and
/// `B` (the 2-norm, taken from one product with a vector of random signs), *and* the exact residual
/// is at most a thousandth of ‖q‖. That is the size of the terms that a residual sums times
/// their rounding: an entry of the residual is a sum of about ten terms, each rounded to half an ε,
/// so its floor is near `√10 ε/2` of their size.
///
/// The default is a tolerance of 10⁻¹⁰ relative to ‖q‖ in the 2-norm, 30,000 iterations and no
/// limit on time.
///
/// ```
/// use std::time::Duration;
/// use hlcp_methods::{Limits, Norm, Tolerance};
///
/// let limits = Limits {
///     norm: Norm::LInf,
///     time: Some(Duration::from_secs(60)),
///     ..Limits::relative(1e-8)
/// };
/// assert_eq!((limits.tolerance, limits.iterations), (Tolerance::Relative(1e-8), 30_000));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// The residual that is good enough.
    pub tolerance: Tolerance,
    /// The residual that is good enough in units of the rounding errors in it; `None` is 4 in
    /// `f32` and 0, which asks for the tolerance, in `f64`.
    ///
    /// Costs one product with `A` and one with `B` per solve, unless zero.
    pub rounding: Option<f64>,
    /// The norm of both.
    pub norm: Norm,
    /// The largest number of iterations.
    pub iterations: usize,
    /// The longest time, looked at at least once per sweep, and before a factorisation, which is
    /// not begun where it is predicted to last longer. Walks over rows and products that have begun
    /// end, and some more tell the residual of the answer; making the method is not in it.
    pub time: Option<Duration>,
}

impl Default for Limits {
    fn default() -> Self {
        Self::relative(1e-10)
    }
}

/// No residual above this part of ‖q‖ is accepted as that of an answer, unless a relative tolerance
/// asks for it.
pub(crate) const FRACTION: f64 = 1e-3;

impl Limits {
    /// The default limits with a tolerance relative to ‖q‖.
    pub fn relative(tolerance: f64) -> Self {
        Self {
            tolerance: Tolerance::Relative(tolerance),
            rounding: None,
            norm: Norm::default(),
            iterations: 30_000,
            time: None,
        }
    }

    /// The default limits with an absolute tolerance.
    pub fn absolute(tolerance: f64) -> Self {
        Self { tolerance: Tolerance::Absolute(tolerance), ..Self::relative(0.0) }
    }

    /// Returns the residual that is good enough for this `q`, apart from rounding.
    pub(crate) fn asked<T: Scalar>(&self, q: &Rhs<'_, T>) -> Result<f64, Error> {
        let norm = self.norm.of(q.norms());
        not_negative("rounding tolerance", self.rounding.unwrap_or(0.0))?;
        match self.tolerance {
            Tolerance::Relative(value) if value >= 1.0 => {
                let name = "relative tolerance";
                Err(Error::Parameter { name, value, range: "below 1" })
            }
            Tolerance::Relative(value) => {
                let asked = not_negative("relative tolerance", value)? * norm;
                not_negative("relative tolerance times the norm of q", asked)
            }
            Tolerance::Absolute(value) => {
                Ok(not_negative("absolute tolerance", value)?.min(FRACTION * norm))
            }
        }
    }

    /// Returns `rounding·ε` of the precision `T`.
    pub(crate) fn roundings<T: Scalar>(&self) -> f64 {
        let epsilon = T::epsilon().wide();
        self.rounding.unwrap_or(if epsilon > 1e-12 { 4.0 } else { 0.0 }) * epsilon
    }
}

/// Refuses a tolerance that is negative or not finite.
fn not_negative(name: &'static str, value: f64) -> Result<f64, Error> {
    let wrong = Error::Parameter { name, value, range: "finite and not negative" };
    if value >= 0.0 && value.is_finite() { Ok(value) } else { Err(wrong) }
}

/// What an elimination costs: bounds, whichever pivots are taken.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cost {
    /// The work in sweeps, and that before the first one.
    pub(crate) worth: usize,
    pub(crate) before: usize,
    /// The time; nothing where the order is small.
    pub(crate) seconds: f64,
    pub(crate) bytes: f64,
}

/// What an elimination takes, as its analysis predicts it.
///
/// ```
/// use std::time::Duration;
/// use hlcp_methods::{FivePoint, Hlcp, Limits, Pivoting, Solver, Status};
///
/// let problem = Hlcp::lcp(FivePoint::new(150, 150, [-1.0, -1.0, 4.0, -1.0, -1.0])?)?;
/// let mut solver = Solver::new(Pivoting::new(problem)?);
/// let limits = Limits { time: Some(Duration::from_millis(1)), ..Limits::default() };
/// let outcome = solver.solve(&[-1.0; 22_500], limits)?;
/// assert_eq!((outcome.status, outcome.iterations), (Status::TimeLimit, 0));
/// println!("{outcome}"); // with the time and the memory, if the limit left any time
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Forecast {
    /// The seconds, at the speed of the analysis.
    pub seconds: f64,
    /// The bytes of the factors, whichever pivots are taken.
    pub bytes: f64,
    /// The time that was left.
    pub left: Duration,
}

impl fmt::Display for Forecast {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, bytes, left } = self;
        let (megabytes, left) = (bytes / 1e6, left.as_secs_f64());
        write!(
            f,
            "an elimination was not begun, as it takes about {seconds:.1e} s and {megabytes:.1} \
             MB, and the time limit left {left:.1e} s"
        )
    }
}
