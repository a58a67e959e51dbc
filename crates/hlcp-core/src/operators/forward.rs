//! Operators behind `&`, `Box` and `Arc` are operators, on every rung of the ladder.
//!
//! For these three alone, because a blanket over `Deref` would forbid implementing the ladder for
//! foreign types.

use std::sync::Arc;

use super::{Csr, Diagonal, FivePointView, LinearOperator, Rows};
use crate::numbers::{Error, Scalar};

macro_rules! forward {
    ($($pointer:ty),*) => {$(
        impl<T: Scalar, O: LinearOperator<T> + ?Sized> LinearOperator<T> for $pointer {
            fn order(&self) -> usize {
                (**self).order()
            }

            fn apply(&self, x: &[T], y: &mut [T]) {
                (**self).apply(x, y);
            }

            fn check(&self, what: &'static str) -> Result<(), Error> {
                (**self).check(what)
            }

            fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
                (**self).as_five_point()
            }

            fn as_csr(&self) -> Option<Csr<'_, T>> {
                (**self).as_csr()
            }

            fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
                (**self).try_visit_row(i, visit)
            }
        }

        impl<T: Scalar, O: Diagonal<T> + ?Sized> Diagonal<T> for $pointer {
            fn diagonal_entry(&self, i: usize) -> T {
                (**self).diagonal_entry(i)
            }
        }

        impl<T: Scalar, O: Rows<T> + ?Sized> Rows<T> for $pointer {
            fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
                (**self).visit_row(i, visit);
            }

            fn copy_row(&self, i: usize, row: &mut [(usize, T)]) -> usize {
                (**self).copy_row(i, row)
            }
        }
    )*};
}

forward!(&O, Box<O>, Arc<O>);
