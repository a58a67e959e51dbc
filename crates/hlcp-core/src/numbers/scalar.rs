use std::{
    any::Any,
    fmt::{Debug, Display, LowerExp},
};

use num_traits::{Float, NumAssign};
use pulp::Arch;

/// A real scalar the methods run on: `f32` or `f64`.
///
/// A bound with a short name, and the way from and to double precision, by other names than
/// `num_traits` has for conversions that return an `Option`.
///
/// ```
/// use hlcp_core::Scalar;
///
/// fn modulus<T: Scalar>(x: T) -> (T, T) {
///     (x.abs() + x, x.abs() - x)
/// }
/// assert_eq!(modulus(-1.5_f32), (0.0, 3.0));
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a scalar",
    note = "scalars are `f32` and `f64`; write 4.0 in place of 4"
)]
pub trait Scalar:
    Float + NumAssign + Debug + Display + LowerExp + Send + Sync + sealed::Precision + 'static
{
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
}

impl Scalar for f32 {}

impl Scalar for f64 {}

mod sealed {
    /// A precision that every [`Compiled`](super::Compiled) function has.
    pub trait Precision {}

    impl Precision for f32 {}
    impl Precision for f64 {}
}

/// A function or a number of a type that is generic in its scalar, for `f32` and for `f64`.
///
/// The loops over grids and rows are most of a program's code, since each is compiled for several
/// widths of vector. A generic function is compiled in every crate that calls it, one in a static
/// once, where the static is.
#[derive(Debug)]
#[doc(hidden)]
pub struct Compiled<S, D>(pub S, pub D);

impl<S: 'static, D: 'static> Compiled<S, D> {
    /// Returns the one of the two that has the type `F`.
    pub fn of<F: 'static>(&'static self) -> &'static F {
        let both: [&'static dyn Any; 2] = [&self.0, &self.1];
        let own = both.into_iter().find_map(|one| one.downcast_ref());
        own.expect("one of f32 or f64")
    }
}

/// Runs `work`, a closure that is always inlined, as it is compiled for an instruction set.
///
/// The bound is what makes it so: a closure that `dispatch` is given at once is taken for an `Fn`,
/// which a function in between calls, compiled for the least set.
///
/// `work` is a loop over a stretch of a row, and nothing around it, since it is compiled three
/// times: with whole sweeps in it this crate takes 2.7 times as long to compile, and they are no
/// faster.
#[inline(always)]
pub(crate) fn vectorised<R>(arch: Arch, work: impl FnOnce() -> R) -> R {
    arch.dispatch(work)
}
