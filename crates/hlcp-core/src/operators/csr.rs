use std::borrow::Cow;

use super::{
    Diagonal, Index, LinearOperator, Rows, RowsOf, Source,
    assembled::{Pattern, Slices},
    check::outside,
};
use crate::numbers::{Error, Scalar, all_finite, assert_lengths};

/// An assembled matrix in compressed sparse rows, the caller's arrays or its own.
///
/// Row `i` has the columns `columns[offsets[i]..offsets[i + 1]]`, which increase, and their values.
/// The indices are of any type that implements [`Index`], so that arrays of SciPy and
/// `nalgebra_sparse` need not be copied. A matrix made here has 32 bits an index, as long as they
/// are enough.
///
/// # Cost
///
/// Borrowed arrays are not copied. Where both operators of a problem have such rows
/// ([`as_csr`](LinearOperator::as_csr)) or are diagonal, [`Aor`](crate::Aor) walks them in place.
///
/// ```
/// use hlcp_core::{Csr, Diagonal, LinearOperator};
///
/// let (offsets, columns, values) = ([0, 2, 4], [0, 1, 0, 1], [4.0, -1.0, -1.0, 3.0]);
/// let matrix = Csr::new(&offsets, &columns, &values)?; // or vectors, to be kept
/// let mut y = [f64::NAN; 2];
/// matrix.apply(&[1.0, 2.0], &mut y);
/// assert_eq!((y, matrix.diagonal_entry(1)), ([2.0, 5.0], 3.0));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Csr<'a, T: Scalar> {
    // Invariant: that of `check`, with finite values.
    order: usize,
    pattern: Pattern<'a>,
    values: Cow<'a, [T]>,
}

impl<'a, T: Scalar> Csr<'a, T> {
    /// Returns the matrix of the caller's arrays: slices, which are borrowed, or vectors, which are
    /// kept.
    ///
    /// # Errors
    ///
    /// [`Error::Empty`] for fewer than two offsets; [`Error::Index`] for the first place where
    /// offsets do not begin with 0, decrease or do not end with the number of columns and of
    /// values, and for the first column that is not below the order, or not above the one before it
    /// in its row; [`Error::NotFinite`] for the first value that is NaN or infinite.
    ///
    /// ```
    /// use hlcp_core::Csr;
    ///
    /// let error = Csr::new(&[0, 2, 3], &[1, 0, 1], &[-1.0, 4.0, 3.0]).unwrap_err();
    /// assert_eq!(
    ///     error.to_string(),
    ///     "columns[1] is 0, but it must be above the one before it in its row; sort each row and \
    ///      sum what comes twice"
    /// );
    /// ```
    pub fn new<I: Index>(
        offsets: impl Into<Cow<'a, [I]>>,
        columns: impl Into<Cow<'a, [I]>>,
        values: impl Into<Cow<'a, [T]>>,
    ) -> Result<Self, Error> {
        let (offsets, columns, values) = (offsets.into(), columns.into(), values.into());
        check(&offsets, &columns, values.len())?;
        all_finite("values", &values)?;
        Ok(Self { order: offsets.len() - 1, pattern: I::pattern(offsets, columns), values })
    }

    /// Returns the matrix of arrays that are known to be in order.
    pub(crate) fn of<I: Index>(offsets: &'a [I], columns: &'a [I], values: &'a [T]) -> Self {
        let pattern = I::pattern(Cow::Borrowed(offsets), Cow::Borrowed(columns));
        Self { order: offsets.len() - 1, pattern, values: Cow::Borrowed(values) }
    }

    /// Returns the number of entries.
    pub fn nnz(&self) -> usize {
        self.values.len()
    }

    /// Returns the offsets, the columns and the values.
    ///
    /// # Cost
    ///
    /// The indices are copied.
    ///
    /// ```
    /// use hlcp_core::{Csr, Identity};
    /// let matrix = Csr::from_rows(&Identity { order: 2 });
    /// assert_eq!(matrix.arrays(), (vec![0, 1, 2], vec![0, 1], &[1.0, 1.0][..]));
    /// ```
    pub fn arrays(&self) -> (Vec<usize>, Vec<usize>, &[T]) {
        let (mut offsets, mut columns) = (vec![0], vec![]);
        for i in 0..self.order {
            self.visit_row(i, &mut |j, _| columns.push(j));
            offsets.push(columns.len());
        }
        (offsets, columns, &self.values)
    }

    pub(crate) fn rows(&self) -> RowsOf<'_, T> {
        let values = &*self.values;
        match &self.pattern {
            Pattern::U32(offsets, columns) => RowsOf::U32(Slices { offsets, columns, values }),
            Pattern::I32(offsets, columns) => RowsOf::I32(Slices { offsets, columns, values }),
            Pattern::I64(offsets, columns) => RowsOf::I64(Slices { offsets, columns, values }),
            Pattern::Usize(offsets, columns) => RowsOf::Usize(Slices { offsets, columns, values }),
        }
    }

    /// Returns the matrix of any operator's rows, in arrays of its own.
    ///
    /// # Panics
    ///
    /// For what the operator's own [`check`](LinearOperator::check) refuses, as a matrix that is
    /// not square, and for a row with an entry in no column.
    ///
    /// # Cost
    ///
    /// A walk over all rows; 4 bytes and a value for each entry.
    ///
    /// ```
    /// use hlcp_core::{Csr, FivePoint};
    /// let grid = FivePoint::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// assert_eq!(Csr::from_rows(&grid).nnz(), 20);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn from_rows(operator: &(impl Rows<T> + ?Sized)) -> Self {
        if let Err(error) = operator.check("the operator") {
            panic!("{error}");
        }
        let order = operator.order();
        let (mut offsets, mut columns, mut values) = (vec![0], vec![], vec![]);
        for i in 0..order {
            operator.visit_row(i, &mut |j, a| {
                if j >= order {
                    outside(i, j, order);
                }
                columns.push(j);
                values.push(a);
            });
            offsets.push(columns.len());
        }
        let pattern = if u32::try_from(offsets.len().max(values.len())).is_ok() {
            let narrow = |list: Vec<usize>| list.into_iter().map(|index| index as u32).collect();
            Pattern::U32(Cow::Owned(narrow(offsets)), Cow::Owned(narrow(columns)))
        } else {
            Pattern::Usize(Cow::Owned(offsets), Cow::Owned(columns))
        };
        Self { order, pattern, values: Cow::Owned(values) }
    }

    /// Returns the same matrix, borrowed.
    fn borrowed(&self) -> Csr<'_, T> {
        let values = &*self.values;
        match &self.pattern {
            Pattern::U32(offsets, columns) => Csr::of(offsets, columns, values),
            Pattern::I32(offsets, columns) => Csr::of(offsets, columns, values),
            Pattern::I64(offsets, columns) => Csr::of(offsets, columns, values),
            Pattern::Usize(offsets, columns) => Csr::of(offsets, columns, values),
        }
    }
}

/// Refuses arrays that are not those of a square matrix with sorted rows.
fn check<I: Index>(offsets: &[I], columns: &[I], values: usize) -> Result<(), Error> {
    let refused = |what, index: usize, value: I, must| {
        Err(Error::Index { what, index, value: value.to_i64().unwrap_or(i64::MAX), must })
    };
    let [first, .., last] = offsets else { return Err(Error::Empty { what: "the matrix" }) };
    let order = offsets.len() - 1;
    if *first != I::zero() {
        return refused("offsets", 0, *first, "0");
    }
    if last.as_() != columns.len() {
        return refused("offsets", order, *last, "the number of columns, where the last row ends");
    }
    if values != columns.len() {
        let why = format!("{} columns need as many values, but {values} are given", columns.len());
        return Err(Error::Operator { what: "the matrix", why: why.into() });
    }
    for (i, row) in offsets.windows(2).enumerate() {
        if row[1] < row[0] || row[1] > *last {
            return refused("offsets", i + 1, row[1], "from the offset before it to the last one");
        }
        let mut before = None;
        for (k, &column) in (row[0].as_()..).zip(&columns[row[0].as_()..row[1].as_()]) {
            if column.as_() >= order {
                return refused("columns", k, column, "from 0 to the order less 1");
            }
            if before >= Some(column) {
                let must = "above the one before it in its row; sort each row and sum what comes \
                            twice";
                return refused("columns", k, column, must);
            }
            before = Some(column);
        }
    }
    Ok(())
}

impl<T: Scalar> LinearOperator<T> for Csr<'_, T> {
    fn order(&self) -> usize {
        self.order
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        assert_lengths(self.order, [("x", x.len()), ("y", y.len())]);
        let mut rows = self.rows();
        for (i, y) in y.iter_mut().enumerate() {
            *y = rows.fold(i, T::zero(), |sum, j, a| sum + a * x[j]);
        }
    }

    fn as_csr(&self) -> Option<Csr<'_, T>> {
        Some(self.borrowed())
    }
}

impl<T: Scalar> Diagonal<T> for Csr<'_, T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.rows().fold(i, T::zero(), |entry, j, a| if j == i { a } else { entry })
    }
}

impl<T: Scalar> Rows<T> for Csr<'_, T> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        self.rows().fold(i, (), |(), j, a| visit(j, a));
    }

    // By visits a sweep over rows that are copied takes 1.3 times as long, and 1.5 on a grid.
    fn copy_row(&self, i: usize, row: &mut [(usize, T)]) -> usize {
        self.rows().fold(i, 0, |count, j, a| {
            row.get_mut(count).into_iter().for_each(|entry| *entry = (j, a));
            count + 1
        })
    }
}
