use std::time::Duration;

use hlcp_core::{Error, Norms, Rhs, Scalar};

/// The norm a stopping test reads.
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
/// It has converged when `‖A z − B r + q‖ ≤ max(absolute, relative·‖q‖)`. Relative is to ‖q‖, never to the
/// first residual, so the start has no say in how good an answer is.
///
/// The default is the paper's: 2-norm, absolute 10⁻¹⁰, 30,000 iterations. A precision too coarse for an
/// absolute 10⁻¹⁰ (`f32`) also accepts `4 ε ‖q‖`: an entry of the residual is a sum of some ten terms
/// of the size of `q`, each rounded to half an ε, so its floor is near `√10 ε/2`.
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
    /// The norm of both.
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
            relative: if coarse { from(4.0) * T::epsilon() } else { T::zero() },
            norm: Norm::L2,
            iterations: 30_000,
            time: None,
        }
    }
}

impl<T: Scalar> Limits<T> {
    /// The residual that is good enough for this `q`.
    pub(crate) fn tolerance(&self, q: &Rhs<'_, T>) -> Result<f64, Error> {
        let [absolute, relative] =
            [("absolute tolerance", self.absolute), ("relative tolerance", self.relative)].map(
                |(name, value)| match value.to_f64() {
                    Some(value) if value >= 0.0 && value.is_finite() => Ok(value),
                    value => Err(Error::Parameter {
                        name,
                        value: value.unwrap_or(f64::NAN),
                        range: "finite and not negative",
                    }),
                },
            );
        Ok(absolute?.max(relative? * self.norm.of(q.norms())))
    }
}
