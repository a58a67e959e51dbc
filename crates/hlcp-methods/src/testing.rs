//! What unit tests share.

use hlcp_core::{Csr, LinearOperator, Scalar};
use nalgebra::DMatrix;

/// The matrix of an operator, column by column, through products with unit vectors.
pub(crate) fn dense(operator: &impl LinearOperator<f64>) -> DMatrix<f64> {
    let n = operator.order();
    let mut matrix = DMatrix::zeros(n, n);
    for (j, mut column) in matrix.column_iter_mut().enumerate() {
        let unit: Vec<f64> = (0..n).map(|i| f64::from(i == j)).collect();
        operator.apply(&unit, column.as_mut_slice());
    }
    matrix
}

/// The matrix of the entries of rows, in order of their columns, that are not zero.
pub(crate) fn csr<T: Scalar, R: IntoIterator<Item = (usize, f64)>>(
    rows: impl IntoIterator<Item = R>,
) -> Csr<'static, T> {
    let (mut offsets, mut columns, mut values) = (vec![0], vec![], vec![]);
    for row in rows {
        for (j, a) in row.into_iter().filter(|entry| entry.1 != 0.0) {
            columns.push(j);
            values.push(T::of(a));
        }
        offsets.push(columns.len());
    }
    Csr::new(offsets, columns, values).unwrap()
}
