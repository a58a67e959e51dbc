use std::time::Duration;

use hlcp_core::{Error, Norms, Rhs, Scalar};

/// The norm a stopping test reads.
///
/// ```
/// use hlcp_core::Norms;
/// use hlcp_methods::Norm;
///
/// // A million entries of 1e-10: the largest is within 1e-10, the 2-norm is a thousand times that.
/// let norms = Norms::of(&vec![1e-10; 1_000_000]);
/// assert_eq!(Norm::LInf.of(norms), 1e-10);
/// assert!((Norm::L2.of(norms) - 1e-7).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Norm {
    /// The 2-norm.
    L2,
    /// The largest absolute value.
    LInf,
}

impl Norm {
    /// This one of two norms.
    pub fn of(self, norms: Norms) -> f64 {
        match self {
            Self::L2 => norms.l2,
            Self::LInf => norms.linf,
        }
    }
}

/// When an iteration may stop.
///
/// It has converged when `‖A z − B r + q‖` is at most the largest of
///
/// * `absolute`,
/// * `relative·‖q‖`, never relative to the first residual: the start has no say in how good an answer is,
/// * `rounding·ε·(‖q‖ + a‖z‖ + b‖r‖)`, where `a` and `b` are the lengths of a typical row of `A` and `B`
///   (the 2-norm; taken from one product with a vector of random signs). That is the size of the terms that
///   a residual sums, times their rounding: what a precision can tell from zero.
///
/// The default is the paper's: 2-norm, absolute 10⁻¹⁰, 30,000 iterations. A precision too coarse for an
/// absolute 10⁻¹⁰ (`f32`) has `rounding = 4` beside it: an entry of the residual is a sum of some ten terms,
/// each rounded to half an ε, so its floor is near `√10 ε/2` of their size.
///
/// ```
/// use std::time::Duration;
/// use hlcp_methods::{Limits, Norm};
///
/// let limits = Limits {
///     relative: 1e-8,
///     norm: Norm::LInf,
///     time: Some(Duration::from_secs(60)),
///     ..Limits::<f64>::default()
/// };
/// assert_eq!((limits.absolute, limits.iterations), (1e-10, 30_000));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<T> {
    /// The residual that is good enough.
    pub absolute: T,
    /// The residual over ‖q‖ that is good enough.
    pub relative: T,
    /// The residual that is good enough, in units of the rounding errors in it.
    ///
    /// Costs one product with `A` and one with `B` a solve, unless zero.
    pub rounding: T,
    /// The norm of all three.
    pub norm: Norm,
    /// The largest number of iterations.
    pub iterations: usize,
    /// The longest time, looked at once an iteration.
    pub time: Option<Duration>,
}

impl<T: Scalar> Default for Limits<T> {
    fn default() -> Self {
        let from = |v| T::from(v).unwrap_or_else(T::epsilon);
        let coarse = T::epsilon() > from(1e-12);
        Self {
            absolute: from(1e-10),
            relative: T::zero(),
            rounding: if coarse { from(4.0) } else { T::zero() },
            norm: Norm::L2,
            iterations: 30_000,
            time: None,
        }
    }
}

impl<T: Scalar> Limits<T> {
    /// The residual that is good enough for this `q`, apart from rounding.
    pub(crate) fn tolerance(&self, q: &Rhs<'_, T>) -> Result<f64, Error> {
        let absolute = number("absolute tolerance", self.absolute)?;
        let relative = number("relative tolerance", self.relative)?;
        number("rounding tolerance", self.rounding)?;
        if relative == 0.0 {
            return Ok(absolute);
        }
        let norm = self.norm.of(q.norms());
        Ok(absolute.max(number("relative tolerance times the norm of q", relative * norm)?))
    }

    /// `rounding·ε` in double precision.
    pub(crate) fn roundings(&self) -> f64 {
        (self.rounding * T::epsilon()).to_f64().unwrap_or(0.0)
    }
}

/// Refuses what is negative or not finite.
fn number<T: Scalar>(name: &'static str, value: T) -> Result<f64, Error> {
    match value.to_f64() {
        Some(value) if value >= 0.0 && value.is_finite() => Ok(value),
        value => Err(Error::Parameter {
            name,
            value: value.unwrap_or(f64::NAN),
            range: "finite and not negative",
        }),
    }
}
