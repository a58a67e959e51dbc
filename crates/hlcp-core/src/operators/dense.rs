use std::borrow::Cow;

use super::{Diagonal, LinearOperator, Rows};
use crate::numbers::{Error, Scalar, all_finite, assert_lengths};

/// A dense matrix, row by row: the caller's slice, or a vector of its own.
///
/// # Cost
///
/// A product, and a sweep, read all `n²` entries.
///
/// ```
/// use hlcp_core::{Diagonal, LinearOperator, RowMajor};
///
/// let matrix = RowMajor::new(2, &[4.0, -1.0, -2.0, 3.0])?;
/// let mut y = [f64::NAN; 2];
/// matrix.apply(&[1.0, 2.0], &mut y);
/// assert_eq!((y, matrix.diagonal_entry(1)), ([2.0, 4.0], 3.0));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RowMajor<'a, T: Scalar> {
    // Invariant: order² finite entries.
    order: usize,
    entries: Cow<'a, [T]>,
}

impl<'a, T: Scalar> RowMajor<'a, T> {
    /// Returns the matrix of this order whose row `i` is `entries[i·order..(i + 1)·order]`.
    ///
    /// # Errors
    ///
    /// [`Error::Operator`] unless there are order² entries; [`Error::NotFinite`] for the first that
    /// is NaN or infinite.
    pub fn new(order: usize, entries: impl Into<Cow<'a, [T]>>) -> Result<Self, Error> {
        let entries = entries.into();
        if order.checked_mul(order) != Some(entries.len()) {
            let why =
                format!("order {order} takes {order}² entries, but {} are given", entries.len());
            return Err(Error::Operator { what: "the matrix", why: why.into() });
        }
        all_finite("entries", &entries)?;
        Ok(Self { order, entries })
    }

    fn row(&self, i: usize) -> &[T] {
        &self.entries[i * self.order..(i + 1) * self.order]
    }
}

impl<T: Scalar> LinearOperator<T> for RowMajor<'_, T> {
    fn order(&self) -> usize {
        self.order
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        assert_lengths(self.order, [("x", x.len()), ("y", y.len())]);
        for (i, y) in y.iter_mut().enumerate() {
            *y = self.row(i).iter().zip(x).fold(T::zero(), |sum, (&a, &x)| sum + a * x);
        }
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl<T: Scalar> Diagonal<T> for RowMajor<'_, T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.row(i)[i]
    }
}

impl<T: Scalar> Rows<T> for RowMajor<'_, T> {
    #[inline]
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        self.row(i).iter().enumerate().for_each(|(j, &a)| visit(j, a));
    }
}
