use std::fmt::{Debug, Display, LowerExp};

use num_traits::{Float, NumAssign};

use crate::loops::{self, Loops};

/// A real scalar the methods run on: `f32` or `f64`.
///
/// A bound with a short name, and the way from and to double precision. The conversions are not
/// called `from_f64` and `to_f64`, since `num_traits` has functions of these names that return an
/// `Option`, and a call would be ambiguous.
///
/// ```
/// use hlcp_core::Scalar;
///
/// fn modulus<T: Scalar>(x: T) -> (T, T) {
///     (x.abs() + x, x.abs() - x)
/// }
/// assert_eq!(modulus(-1.5_f32), (0.0, 3.0));
/// ```
pub trait Scalar: Float + NumAssign + Debug + Display + LowerExp + Send + Sync + 'static {
    /// Returns the nearest scalar to a number in double precision: infinite beyond the range, NaN
    /// for NaN.
    ///
    /// ```
    /// use hlcp_core::Scalar;
    /// assert_eq!((f32::of(0.1), f32::of(1e300)), (0.1_f32, f32::INFINITY));
    /// ```
    #[inline]
    fn of(value: f64) -> Self {
        Self::from(value).unwrap_or_else(Self::nan)
    }

    /// Returns the same number in double precision, exactly for `f32` and `f64`.
    ///
    /// ```
    /// use hlcp_core::Scalar;
    /// assert_eq!(0.5_f32.wide(), 0.5_f64);
    /// ```
    #[inline]
    fn wide(self) -> f64 {
        self.to_f64().unwrap_or(f64::NAN)
    }

    /// Returns the loops of this precision.
    #[doc(hidden)]
    fn loops() -> &'static Loops<Self>;
}

impl Scalar for f32 {
    fn loops() -> &'static Loops<Self> {
        &loops::F32
    }
}

impl Scalar for f64 {
    fn loops() -> &'static Loops<Self> {
        &loops::F64
    }
}
