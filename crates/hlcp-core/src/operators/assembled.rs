//! Rows in arrays, walked in place.

use std::borrow::Cow;

use super::Coefficients;
use crate::numbers::Scalar;

/// Offsets and columns.
#[derive(Debug, Clone, PartialEq)]
#[allow(unreachable_pub, reason = "the sealed trait names it")]
pub enum Pattern<'a> {
    U32(Cow<'a, [u32]>, Cow<'a, [u32]>),
    I32(Cow<'a, [i32]>, Cow<'a, [i32]>),
    I64(Cow<'a, [i64]>, Cow<'a, [i64]>),
    Usize(Cow<'a, [usize]>, Cow<'a, [usize]>),
}

/// An integer that indexes a [`Csr`](crate::Csr): `u32`, `i32`, `i64` or `usize`.
///
/// ```
/// use hlcp_core::Csr;
/// let short = Csr::new(&[0_u32, 1], &[0], &[4.0])?;
/// let long = Csr::new(&[0_i64, 1], &[0], &[4.0])?;
/// assert_eq!(short.nnz(), long.nnz());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub trait Index: sealed::Index {}

mod sealed {
    use std::borrow::Cow;

    use num_traits::{AsPrimitive, PrimInt};

    use super::Pattern;

    /// An integer; what is negative becomes a place beyond any array.
    pub trait Index: PrimInt + AsPrimitive<usize> + Send + Sync {
        fn pattern<'a>(offsets: Cow<'a, [Self]>, columns: Cow<'a, [Self]>) -> Pattern<'a>;
    }

    impl Index for u32 {
        fn pattern<'a>(offsets: Cow<'a, [Self]>, columns: Cow<'a, [Self]>) -> Pattern<'a> {
            Pattern::U32(offsets, columns)
        }
    }

    impl Index for i32 {
        fn pattern<'a>(offsets: Cow<'a, [Self]>, columns: Cow<'a, [Self]>) -> Pattern<'a> {
            Pattern::I32(offsets, columns)
        }
    }

    impl Index for i64 {
        fn pattern<'a>(offsets: Cow<'a, [Self]>, columns: Cow<'a, [Self]>) -> Pattern<'a> {
            Pattern::I64(offsets, columns)
        }
    }

    impl Index for usize {
        fn pattern<'a>(offsets: Cow<'a, [Self]>, columns: Cow<'a, [Self]>) -> Pattern<'a> {
            Pattern::Usize(offsets, columns)
        }
    }
}

impl<I: sealed::Index> Index for I {}

/// Where a sweep has the rows of an operator from.
///
/// Sums are handed from entry to entry by value, which keeps them in registers.
pub(crate) trait Source<T>: Clone {
    /// Returns `add(… add(sums, j, aᵢⱼ) …)` for the entries of row `i`, by increasing `j`.
    fn fold<S: Copy>(&mut self, i: usize, sums: S, add: impl FnMut(S, usize, T) -> S) -> S;
}

/// The arrays of a matrix in compressed sparse rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slices<'a, I, T> {
    pub(crate) offsets: &'a [I],
    pub(crate) columns: &'a [I],
    pub(crate) values: &'a [T],
}

impl<T: Scalar, I: Index> Slices<'_, I, T> {
    #[inline(always)]
    fn fold<S: Copy>(&self, i: usize, sums: S, mut add: impl FnMut(S, usize, T) -> S) -> S {
        let row = self.offsets[i].as_()..self.offsets[i + 1].as_();
        let entries = self.columns[row.clone()].iter().zip(&self.values[row]);
        entries.fold(sums, |sums, (j, &a)| add(sums, j.as_(), a))
    }
}

/// The rows of an assembled or a diagonal matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) enum RowsOf<'a, T> {
    U32(Slices<'a, u32, T>),
    I32(Slices<'a, i32, T>),
    I64(Slices<'a, i64, T>),
    Usize(Slices<'a, usize, T>),
    Diagonal(Coefficients<'a, T>),
}

impl<T: Scalar> Source<T> for RowsOf<'_, T> {
    #[inline(always)]
    fn fold<S: Copy>(&mut self, i: usize, sums: S, mut add: impl FnMut(S, usize, T) -> S) -> S {
        match self {
            Self::U32(rows) => rows.fold(i, sums, add),
            Self::I32(rows) => rows.fold(i, sums, add),
            Self::I64(rows) => rows.fold(i, sums, add),
            Self::Usize(rows) => rows.fold(i, sums, add),
            Self::Diagonal(entries) => add(sums, i, entries.entry(i)),
        }
    }
}
