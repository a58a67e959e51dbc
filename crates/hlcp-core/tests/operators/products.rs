//! Every operator is the matrix it says it is: its product, its diagonal and its rows.

use std::sync::Arc;

use crate::common::Matrix;
use hlcp_core::{
    DiagonalMatrix, FivePoint, Identity, LinearOperator, Rows, Scaled, Shifted, Sum,
    VaryingFivePoint,
};
use nalgebra::{DMatrix, DVector};
use nalgebra_sparse::{CooMatrix, CsrMatrix};
use proptest::{collection::vec, prelude::*};

/// Checks all three rungs of an operator against a dense matrix, to the rounding of `terms` additions.
fn is_matrix(operator: &(impl Rows<f64> + ?Sized), matrix: &DMatrix<f64>, x: &DVector<f64>) {
    let n = matrix.nrows();
    assert_eq!(operator.order(), n);
    let rounding = (n + 4) as f64 * f64::EPSILON * (matrix.abs().max() + 4.0);
    for i in 0..n {
        let (mut row, mut last) = (vec![0.0; n], None);
        operator.visit_row(i, &mut |j, a| {
            assert!(last < Some(j), "row {i} visits {j} after {last:?}");
            (row[j], last) = (a, Some(j));
        });
        for j in 0..n {
            assert!((row[j] - matrix[(i, j)]).abs() <= rounding, "({i}, {j})");
        }
        assert!((operator.diagonal_entry(i) - matrix[(i, i)]).abs() <= rounding);
    }
    if let Some(view) = operator.as_five_point() {
        // What it shows to fast sweeps is what its rows say.
        let [nx, ny] = view.grid().unwrap_or([n, 1]);
        let coefficients = view.coefficients();
        let mut shown = DMatrix::zeros(n, n);
        for k in 0..n {
            let (i, j) = (k % nx, k / nx);
            let neighbours = [j > 0, i > 0, true, i + 1 < nx, j + 1 < ny];
            for ((inside, c), step) in neighbours.into_iter().zip(coefficients).zip([
                -(nx as isize),
                -1,
                0,
                1,
                nx as isize,
            ]) {
                if inside {
                    shown[(k, k.wrapping_add_signed(step))] += c.at(k);
                }
            }
        }
        assert!((shown - matrix).amax() <= rounding);
    }
    let mut y = vec![f64::NAN; n]; // apply overwrites and never reads
    operator.apply(x.as_slice(), &mut y);
    let size = (matrix.abs() * x.abs()).amax() + 4.0 * x.amax();
    assert!((DVector::from_vec(y) - matrix * x).amax() <= (n + 4) as f64 * f64::EPSILON * size);
}

/// A matrix with holes, also on its diagonal.
fn holey() -> impl Strategy<Value = DMatrix<f64>> {
    let entry = prop_oneof![2 => Just(0.0), 3 => -4.0..4.0];
    (1_usize..9).prop_flat_map(move |n| {
        vec(entry.clone(), n * n).prop_map(move |v| DMatrix::from_vec(n, n, v))
    })
}

fn csr(matrix: &DMatrix<f64>) -> CsrMatrix<f64> {
    let mut coo = CooMatrix::new(matrix.nrows(), matrix.ncols());
    for i in 0..matrix.nrows() {
        for j in 0..matrix.ncols() {
            if matrix[(i, j)] != 0.0 {
                coo.push(i, j, matrix[(i, j)]);
            }
        }
    }
    CsrMatrix::from(&coo)
}

proptest! {
    #[test]
    fn operators_are_their_matrices(
        matrix in holey(),
        other in holey(),
        by in -3.0..3.0,
        x in vec(-4.0..4.0, 9),
    ) {
        let n = matrix.nrows();
        let x = DVector::from_column_slice(&x[..n]);
        let other = other.resize(n, n, 0.7);
        let (a, b) = (csr(&matrix), csr(&other));
        let identity = DMatrix::identity(n, n);
        let entries = other.row(0).transpose();
        let diagonal = DiagonalMatrix::new(entries.iter().copied().collect()).unwrap();

        is_matrix(&Identity { order: n }, &identity, &x);
        is_matrix(&diagonal, &DMatrix::from_diagonal(&entries), &x);
        is_matrix(&a, &matrix, &x);
        is_matrix(&Scaled { factor: by, of: &a }, &(by * &matrix), &x);
        is_matrix(&Shifted { by, of: &a }, &(by * &identity + &matrix), &x);
        is_matrix(&Sum(&a, &b), &(&matrix + &other), &x);
        is_matrix(&Sum(&b, &diagonal), &(&other + DMatrix::from_diagonal(&entries)), &x);
        is_matrix(&Sum(Identity { order: n }, &b), &(&identity + &other), &x);
        let nested = Sum(Shifted { by, of: &a }, Scaled { factor: -0.5, of: Matrix(other.clone()) });
        is_matrix(&nested, &(by * &identity + &matrix - 0.5 * &other), &x);

        let grid = FivePoint::new(n, 3, [by, -0.3, 2.5, -0.7, 0.4]).unwrap();
        let mut dense = DMatrix::zeros(3 * n, 3 * n);
        (0..3 * n).for_each(|i| grid.visit_row(i, &mut |j, a| dense[(i, j)] = a));
        let wide = DVector::from_fn(3 * n, |i, _| x[i % n] - 0.1 * i as f64);
        is_matrix(&grid, &dense, &wide);
        is_matrix(&Scaled { factor: by, of: &grid }, &(by * &dense), &wide);
        let shifted = Shifted { by, of: Scaled { factor: -1.5, of: grid } };
        is_matrix(&shifted, &(by * DMatrix::identity(3 * n, 3 * n) - 1.5 * &dense), &wide);
        is_matrix(&Shifted { by, of: Identity { order: n } }, &((by + 1.0) * &identity), &x);
        let varying = VaryingFivePoint::from_fn(n, 3, |i, j| {
            [by, -0.3, 2.5 + i as f64, -0.7 * j as f64, 0.4]
        }).unwrap();
        let mut dense = DMatrix::zeros(3 * n, 3 * n);
        (0..3 * n).for_each(|i| varying.visit_row(i, &mut |j, a| dense[(i, j)] = a));
        is_matrix(&varying, &dense, &wide);
        is_matrix(&Shifted { by, of: varying }, &(by * DMatrix::identity(3 * n, 3 * n) + &dense), &wide);

        let boxed: Box<dyn Rows<f64>> = Box::new(a.clone());
        is_matrix(&boxed, &matrix, &x);
        let shared: Arc<dyn Rows<f64> + '_> = Arc::new(Sum(&a, &b));
        is_matrix(&shared, &(&matrix + &other), &x);
        is_matrix(&&*shared, &(&matrix + &other), &x);
    }
}

#[test]
fn what_is_not_square_has_no_order() {
    let wide = CsrMatrix::<f64>::zeros(2, 3);
    assert_eq!(wide.order(), 0);
    assert_eq!(LinearOperator::<f64>::order(&Sum(Identity { order: 2 }, Identity { order: 3 })), 0);
    assert!(DiagonalMatrix::new(vec![2.0, f64::NAN]).is_err());
}
