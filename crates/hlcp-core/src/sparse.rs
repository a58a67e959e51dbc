use nalgebra_sparse::CsrMatrix;

use crate::{Csr, Diagonal, Error, LinearOperator, Rows, Scalar};

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
        assert_eq!([x.len(), y.len()], [self.nrows(); 2], "vectors of the operator's order");
        borrowed(self).apply(x, y);
    }

    fn check(&self, what: &'static str) -> Result<(), Error> {
        let (rows, columns) = (self.nrows(), self.ncols());
        if rows == columns { Ok(()) } else { Err(Error::NotSquare { what, rows, columns }) }
    }

    fn as_csr(&self) -> Option<Csr<'_, T>> {
        Some(borrowed(self))
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl<T: Scalar> Diagonal<T> for CsrMatrix<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        let row = self.row(i);
        row.col_indices().binary_search(&i).map_or(T::zero(), |at| row.values()[at])
    }
}

impl<T: Scalar> Rows<T> for CsrMatrix<T> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        let row = self.row(i);
        for (&j, &a) in row.col_indices().iter().zip(row.values()) {
            visit(j, a);
        }
    }
}

fn borrowed<T: Scalar>(matrix: &CsrMatrix<T>) -> Csr<'_, T> {
    let (offsets, columns, values) = matrix.csr_data();
    Csr::of(offsets, columns, values)
}
