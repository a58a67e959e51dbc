//! Walks over rows without a call for each entry.

use crate::{
    numbers::Scalar,
    operators::{Csr, LinearOperator, Rows, RowsOf, Source},
};

/// The entries of the longest row that is copied, and so walked at one call.
const COPIED: usize = 16;

/// The rows of an operator of any type, from calls of its methods.
///
/// A row is copied first, so that what its operator calls for each entry is little enough to be
/// compiled into the operator's code, or takes one call through `dyn` in the place of one for each
/// entry. A row too long for that is walked as it comes.
#[derive(Debug)]
pub(crate) struct Visited<'o, T, O> {
    operator: &'o O,
    row: [(usize, T); COPIED],
}

impl<'o, T: Scalar, O: Rows<T>> Visited<'o, T, O> {
    pub(crate) fn new(operator: &'o O) -> Self {
        Self { operator, row: [(0, T::zero()); COPIED] }
    }
}

impl<T: Copy, O> Clone for Visited<'_, T, O> {
    fn clone(&self) -> Self {
        Self { operator: self.operator, row: self.row }
    }
}

impl<T: Scalar, O: Rows<T>> Source<T> for Visited<'_, T, O> {
    #[inline(always)]
    fn fold<S: Copy>(&mut self, i: usize, mut sums: S, mut add: impl FnMut(S, usize, T) -> S) -> S {
        let count = self.operator.copy_row(i, &mut self.row);
        if let Some(row) = self.row.get(..count) {
            return row.iter().fold(sums, |sums, &(j, a)| add(sums, j, a));
        }
        self.operator.visit_row(i, &mut |j, a| sums = add(sums, j, a));
        sums
    }
}

impl<'a, T: Scalar> RowsOf<'a, T> {
    /// Returns the rows of an operator that is diagonal or has them assembled, as this matrix.
    pub(crate) fn known(
        operator: &'a (impl LinearOperator<T> + ?Sized),
        matrix: Option<&'a Csr<'_, T>>,
    ) -> Option<Self> {
        if let Some(matrix) = matrix {
            return Some(matrix.rows());
        }
        let view = operator.as_five_point()?;
        view.grid().is_none().then(|| Self::Diagonal(view.coefficients()[2]))
    }
}
