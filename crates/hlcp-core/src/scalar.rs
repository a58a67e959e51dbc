use std::fmt::{Debug, Display, LowerExp};

use num_traits::{Float, NumAssign};

/// A real scalar the methods run on: `f32`, `f64`, or another that meets the bounds.
///
/// A bound with a short name and no methods of its own.
///
/// ```
/// use hlcp_core::Scalar;
///
/// fn modulus<T: Scalar>(x: T) -> (T, T) {
///     (x.abs() + x, x.abs() - x)
/// }
/// assert_eq!(modulus(-1.5_f32), (0.0, 3.0));
/// ```
pub trait Scalar: Float + NumAssign + Debug + Display + LowerExp + Send + Sync + 'static {}

impl<T> Scalar for T where T: Float + NumAssign + Debug + Display + LowerExp + Send + Sync + 'static {}

/// The same number in double precision, for messages and norms.
pub(crate) fn to_f64<T: Scalar>(value: T) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
}
