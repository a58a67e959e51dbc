use nalgebra_sparse::{CscMatrix, CsrMatrix, SparseEntry, na::DMatrix};

use super::{Csr, Diagonal, LinearOperator, Rows};
use crate::numbers::{Error, Scalar, assert_lengths};

/// An assembled matrix is one more operator, on every rung.
///
/// A matrix that is not square is refused by its [`check`](LinearOperator::check).
///
/// ```
/// use hlcp_core::{Diagonal, LinearOperator};
/// use nalgebra_sparse::{CooMatrix, CsrMatrix};
///
/// let coo =
///     CooMatrix::try_from_triplets(2, 2, vec![0, 1, 1], vec![0, 0, 1], vec![4.0, -1.0, 3.0])?;
/// let matrix = CsrMatrix::from(&coo);
/// let mut y = [f64::NAN; 2];
/// matrix.apply(&[1.0, 2.0], &mut y);
/// assert_eq!((y, matrix.diagonal_entry(1)), ([4.0, 5.0], 3.0));
/// # Ok::<(), nalgebra_sparse::SparseFormatError>(())
/// ```
impl<T: Scalar> LinearOperator<T> for CsrMatrix<T> {
    fn order(&self) -> usize {
        self.nrows()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        borrowed(self).apply(x, y);
    }

    fn check(&self, what: &'static str) -> Result<(), Error> {
        is_square(what, self.nrows(), self.ncols())
    }

    fn as_csr(&self) -> Option<Csr<'_, T>> {
        Some(borrowed(self))
    }
}

impl<T: Scalar> Diagonal<T> for CsrMatrix<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.get_entry(i, i).map_or(T::zero(), SparseEntry::into_value)
    }
}

impl<T: Scalar> Rows<T> for CsrMatrix<T> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        borrowed(self).visit_row(i, visit);
    }
}

fn borrowed<T: Scalar>(matrix: &CsrMatrix<T>) -> Csr<'_, T> {
    let (offsets, columns, values) = matrix.csr_data();
    Csr::of(offsets, columns, values)
}

/// Refuses a matrix that is not square.
fn is_square(what: &'static str, rows: usize, columns: usize) -> Result<(), Error> {
    if rows == columns { Ok(()) } else { Err(Error::NotSquare { what, rows, columns }) }
}

/// A matrix by columns knows its products and its diagonal; for its rows, which sweeps and
/// certificates need, [`Csr::from`] makes the same matrix by rows, once.
///
/// ```
/// use hlcp_core::{Csr, Diagonal, Rows};
/// use nalgebra_sparse::{CooMatrix, CscMatrix};
///
/// let (rows, columns, values) = (vec![0, 1, 1], vec![0, 0, 1], vec![4.0, -1.0, 3.0]);
/// let coo = CooMatrix::try_from_triplets(2, 2, rows, columns, values)?;
/// let by_columns = CscMatrix::from(&coo);
/// let by_rows = Csr::from(&by_columns);
/// let mut row = vec![];
/// by_rows.visit_row(1, &mut |j, a| row.push((j, a)));
/// assert_eq!((row, by_columns.diagonal_entry(1)), (vec![(0, -1.0), (1, 3.0)], 3.0));
/// # Ok::<(), nalgebra_sparse::SparseFormatError>(())
/// ```
impl<T: Scalar> LinearOperator<T> for CscMatrix<T> {
    fn order(&self) -> usize {
        self.ncols()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        assert_lengths(self.ncols(), [("x", x.len()), ("y", y.len())]);
        y.fill(T::zero());
        for (column, &x) in self.col_iter().zip(x) {
            for (&i, &a) in column.row_indices().iter().zip(column.values()) {
                y[i] += a * x;
            }
        }
    }

    fn check(&self, what: &'static str) -> Result<(), Error> {
        is_square(what, self.nrows(), self.ncols())
    }
}

impl<T: Scalar> Diagonal<T> for CscMatrix<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.get_entry(i, i).map_or(T::zero(), SparseEntry::into_value)
    }
}

/// The same matrix by rows.
///
/// # Panics
///
/// When the matrix is not square.
impl<T: Scalar> From<&CscMatrix<T>> for Csr<'static, T> {
    fn from(matrix: &CscMatrix<T>) -> Self {
        assert_eq!(matrix.nrows(), matrix.ncols(), "a square matrix");
        Self::from_rows(&CsrMatrix::from(matrix))
    }
}

/// A dense matrix is an operator on every rung.
///
/// Its entries lie by columns, so that a row is read with strides; [`RowMajor`](crate::RowMajor)
/// has them one after another.
///
/// ```
/// use hlcp_core::Diagonal;
/// assert_eq!(nalgebra::dmatrix![4.0, -1.0; -2.0, 3.0].diagonal_entry(1), 3.0);
/// ```
impl<T: Scalar> LinearOperator<T> for DMatrix<T> {
    fn order(&self) -> usize {
        self.ncols()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        let n = self.ncols();
        assert_lengths(n, [("x", x.len()), ("y", y.len())]);
        y.fill(T::zero());
        for (j, &x) in x.iter().enumerate() {
            let column = &self.as_slice()[j * n..(j + 1) * n];
            y.iter_mut().zip(column).for_each(|(y, &a)| *y += a * x);
        }
    }

    fn check(&self, what: &'static str) -> Result<(), Error> {
        is_square(what, self.nrows(), self.ncols())
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl<T: Scalar> Diagonal<T> for DMatrix<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.as_slice()[i + i * self.nrows()]
    }
}

impl<T: Scalar> Rows<T> for DMatrix<T> {
    #[inline]
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        let row = self.as_slice()[i..].iter().step_by(self.nrows());
        row.enumerate().for_each(|(j, &a)| visit(j, a));
    }
}
