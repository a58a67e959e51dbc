//! Every operator is the matrix it says it is: its product, its diagonal and its rows.

use std::sync::Arc;

use crate::common::assembled;
use hlcp_core::{
    Csr, Diagonal, DiagonalMatrix, Error, FivePoint, Hlcp, Identity, LinearOperator, Omega,
    RowMajor, Rows, Scaled, Shifted, Sum, Tridiagonal, check_operator,
};
use hlcp_verify::Example;
use nalgebra::{DMatrix, DVector};
use nalgebra_sparse::{CscMatrix, CsrMatrix};
use proptest::{collection::vec, prelude::*};

/// Checks product, diagonal, rows and view of an operator against a dense matrix: the product to
/// rounding, all else exactly.
fn is_matrix(operator: &(impl Rows<f64> + ?Sized), matrix: &DMatrix<f64>, x: &DVector<f64>) {
    let n = matrix.nrows();
    assert_eq!(operator.order(), n);
    assert_eq!(check_operator(operator), Ok(()));
    assert_eq!(&assembled(&operator), matrix);
    (0..n).for_each(|i| assert_eq!(operator.diagonal_entry(i), matrix[(i, i)]));
    if let Some(view) = operator.as_five_point() {
        // What it shows to fast sweeps is what its rows say.
        let [nx, ny] = view.grid().unwrap_or([n, 1]);
        let shown = FivePoint::new(nx, ny, view.coefficients()).unwrap();
        assert_eq!(&assembled(&shown.periodic(view.round()).unwrap()), matrix);
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

/// blktridiag(south·I; tridiag(west; centre; east); north·I), an x-line of `nx` points fastest.
fn kronecker(nx: usize, ny: usize, [south, west, centre, east, north]: [f64; 5]) -> DMatrix<f64> {
    let line = |n, below, on, above| tridiagonal(&vec![[below, on, above]; n]);
    let identity = DMatrix::identity;
    identity(ny, ny).kronecker(&line(nx, west, centre, east))
        + line(ny, south, 0.0, north).kronecker(&identity(nx, nx))
}

/// The matrix of tridiagonal rows, without the entries that lie outside.
fn tridiagonal(rows: &[[f64; 3]]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.len(), |i, j| match j as isize - i as isize {
        k @ -1..=1 => rows[i][(k + 1) as usize],
        _ => 0.0,
    })
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
        let (a, b) = (CsrMatrix::from(&matrix), CsrMatrix::from(&other));
        let identity = DMatrix::identity(n, n);
        let entries = other.row(0).transpose();
        let diagonal = DiagonalMatrix::new(entries.iter().copied().collect()).unwrap();

        is_matrix(&Identity { order: n }, &identity, &x);
        is_matrix(&diagonal, &DMatrix::from_diagonal(&entries), &x);
        is_matrix(&a, &matrix, &x);
        is_matrix(&Csr::from_rows(&a), &matrix, &x);
        is_matrix(&Scaled { by, of: &a }, &(by * &matrix), &x);
        is_matrix(&Shifted { by, of: &a }, &(by * &identity + &matrix), &x);
        is_matrix(&Sum(&a, &b), &(&matrix + &other), &x);
        is_matrix(&Sum(&b, &diagonal), &(&other + DMatrix::from_diagonal(&entries)), &x);
        is_matrix(&Sum(Identity { order: n }, &b), &(&identity + &other), &x);
        let nested = Sum(Shifted { by, of: &a }, Scaled { by: -0.5, of: other.clone() });
        is_matrix(&nested, &(by * &identity + &matrix - 0.5 * &other), &x);

        let grid = FivePoint::new(n, 3, [by, -0.3, 2.5, -0.7, 0.4]).unwrap();
        let dense = kronecker(n, 3, [by, -0.3, 2.5, -0.7, 0.4]);
        let wide = DVector::from_fn(3 * n, |i, _| x[i % n] - 0.1 * i as f64);
        is_matrix(&grid, &dense, &wide);
        is_matrix(&Scaled { by, of: &grid }, &(by * &dense), &wide);
        let shifted = Shifted { by, of: Scaled { by: -1.5, of: grid } };
        is_matrix(&shifted, &(by * DMatrix::identity(3 * n, 3 * n) - 1.5 * &dense), &wide);
        is_matrix(&Shifted { by, of: Identity { order: n } }, &((by + 1.0) * &identity), &x);
        let varying = FivePoint::from_fn(n, 3, |i, j| {
            [by, -0.3, 2.5 + i as f64, -0.7 * j as f64, 0.4]
        }).unwrap();
        let dense = assembled(&varying);
        is_matrix(&varying, &dense, &wide);
        is_matrix(&Shifted { by, of: varying }, &(by * DMatrix::identity(3 * n, 3 * n) + &dense), &wide);

        is_matrix(&matrix, &matrix, &x);
        let by_rows: Vec<f64> = matrix.transpose().iter().copied().collect();
        is_matrix(&RowMajor::new(n, by_rows).unwrap(), &matrix, &x);
        let by_columns = CscMatrix::from(&a);
        is_matrix(&Csr::from(&by_columns), &matrix, &x);
        let mut products = [vec![f64::NAN; n], vec![f64::NAN; n]];
        by_columns.apply(x.as_slice(), &mut products[0]);
        matrix.apply(x.as_slice(), &mut products[1]);
        assert_eq!(products[0], products[1]); // in the same order, but for zeros
        (0..n).for_each(|i| assert_eq!(by_columns.diagonal_entry(i), matrix[(i, i)]));

        let boxed: Box<dyn Rows<f64>> = Box::new(a.clone());
        is_matrix(&boxed, &matrix, &x);
        let shared: Arc<dyn Rows<f64> + '_> = Arc::new(Sum(&a, &b));
        is_matrix(&shared, &(&matrix + &other), &x);
        is_matrix(&&*shared, &(&matrix + &other), &x);
    }

    /// Closed round, the shifts of a line become cyclic.
    #[test]
    fn a_periodic_stencil_is_its_cyclic_kronecker_form(
        nx in 3_usize..7,
        ny in 3_usize..7,
        entries in vec(-4.0..4.0, 5 * 36),
        round: [bool; 2],
        x in vec(-4.0..4.0, 64),
    ) {
        // What takes from each point of a line the next one, and backward the one before.
        let next = |n: usize, round: bool| {
            DMatrix::from_fn(n, n, |i, j| f64::from(j == i + 1 || round && (i, j) == (n - 1, 0)))
        };
        let (east, north) = (next(nx, round[0]), next(ny, round[1]));
        let identity = DMatrix::identity;
        let shifts = [
            north.transpose().kronecker(&identity(nx, nx)),
            identity(ny, ny).kronecker(&east.transpose()),
            identity(nx * ny, nx * ny),
            identity(ny, ny).kronecker(&east),
            north.kronecker(&identity(nx, nx)),
        ];
        let x = DVector::from_column_slice(&x[..nx * ny]);
        let row: [f64; 5] = std::array::from_fn(|direction| entries[direction]);
        let constant = shifts.iter().zip(row).map(|(shift, c)| shift * c).sum::<DMatrix<f64>>();
        let stencil = FivePoint::new(nx, ny, row).unwrap().periodic(round).unwrap();
        is_matrix(&stencil, &constant, &x);

        let each = |direction: usize| DVector::from_fn(nx * ny, |k, _| entries[5 * k + direction]);
        let dense = (0..5).map(|d| DMatrix::from_diagonal(&each(d)) * &shifts[d]).sum::<DMatrix<f64>>();
        let varying = FivePoint::from_fn(nx, ny, |i, j| {
            std::array::from_fn(|direction| entries[5 * (j * nx + i) + direction])
        });
        is_matrix(&varying.unwrap().periodic(round).unwrap(), &dense, &x);
    }

    #[test]
    fn a_tridiagonal_operator_is_the_matrix_of_its_rows(
        rows in vec(prop::array::uniform3(prop_oneof![3 => -4.0..4.0, 1 => Just(0.0)]), 1..12),
        x in vec(-4.0..4.0, 12),
    ) {
        let operator = Tridiagonal::new(rows.len(), |i| rows[i]).unwrap();
        let x = DVector::from_column_slice(&x[..rows.len()]);
        is_matrix(&operator, &tridiagonal(&rows), &x);
        (0..rows.len()).for_each(|i| operator.visit_row(i, &mut |_, a| assert_ne!(a, 0.0)));
    }
}

#[test]
fn the_examples_are_the_papers() {
    let (m, mu, nu) = (5, 0.3, 1.7);
    let identity = |n: usize| DMatrix::<f64>::identity(n, n);
    for (symmetric, below, above) in [(true, -1.0, -1.0), (false, -1.5, -0.5)] {
        let scene = Example { symmetric, m, mu, nu }.pose::<f64>().unwrap();
        let b = kronecker(m, m, [0.0, below, 4.0, above, 0.0]);
        let a = kronecker(m, m, [below, below, 4.0, above, above]);
        assert_eq!(assembled(&scene.a), a.clone() + mu * identity(m * m));
        assert_eq!(assembled(&scene.b), b.clone() + nu * identity(m * m));

        let z = DVector::from_fn(m * m, |i, _| (i % 2) as f64);
        let r = z.map(|z| 1.0 - z);
        assert_eq!((&scene.z[..], &scene.r[..]), (z.as_slice(), r.as_slice()));
        let defect = assembled(&scene.a) * z - assembled(&scene.b) * r + DVector::from_vec(scene.q);
        assert!(defect.amax() <= 10.0 * f64::EPSILON * 8.0);
    }
}

#[test]
fn tridiagonal_rows_that_are_not_finite_are_refused_with_their_index() {
    let empty = Tridiagonal::new(0, |_| [-1.5_f32, 4.0, -0.5]).unwrap_err();
    assert!(matches!(empty, Error::Empty { .. }));
    for place in 0..3 {
        let row = |i| {
            let mut row = [-1.5, 4.0, -0.5];
            row[place] = if i == 3 { f64::NEG_INFINITY } else { row[place] };
            row
        };
        let error = Tridiagonal::new(6, row).unwrap_err();
        let expected = f64::NEG_INFINITY;
        assert_eq!(error, Error::NotFinite { what: "tridiagonal row", index: 3, value: expected });
    }
    // Outside the matrix anything may stand.
    let corners =
        |i| [if i == 0 { f64::NAN } else { 1.5 }, 4.0, if i == 2 { f64::NAN } else { -0.5 }];
    let mut y = [0.0; 3];
    Tridiagonal::new(3, corners).unwrap().apply(&[1.0, 2.0, 4.0], &mut y);
    assert_eq!(y, [3.0, 7.5, 19.0]);
}

#[test]
fn what_is_not_square_is_refused_however_it_is_wrapped() {
    let square = Identity { order: 2 };
    let posed = |a: &dyn LinearOperator<f64>| Hlcp::new(a, square, Omega::Uniform(1.0)).err();
    let other_place = |b: &dyn LinearOperator<f64>| Hlcp::new(square, b, Omega::Uniform(1.0)).err();
    let wide = CsrMatrix::<f64>::zeros(2, 3);
    let not_square = |what| Some(Error::NotSquare { what, rows: 2, columns: 3 });
    assert_eq!(posed(&wide), not_square("A"));
    assert_eq!(other_place(&wide), not_square("B"));
    assert_eq!(posed(&Scaled { by: 2.0, of: &wide }), not_square("A"));
    assert_eq!(posed(&Shifted { by: 2.0, of: Box::new(&wide) }), not_square("A"));
    assert_eq!(posed(&Sum(square, Arc::new(&wide))), not_square("A"));
    let sum = Sum(square, Identity { order: 3 });
    assert_eq!(posed(&sum), Some(Error::Summands { what: "A", orders: [2, 3] }));
    let ratio = Omega::diagonal_ratio(1.0, &square, &wide);
    assert_eq!(ratio.err(), not_square("B"));
    assert!(DiagonalMatrix::new(vec![2.0, f64::NAN]).is_err());
}

#[test]
fn a_grid_too_narrow_to_close_is_refused() {
    let grid = FivePoint::new(2, 5, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    assert!(grid.periodic([false, true]).is_ok());
    let error = grid.periodic([true, false]).unwrap_err().to_string();
    assert_eq!(error, "the number of points in a row that closes is 2, but it must be 3 or more");
    let varying = FivePoint::from_fn(5, 2, |_, _| [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    assert!(varying.clone().periodic([true, false]).is_ok());
    let error = varying.periodic([true, true]).unwrap_err().to_string();
    assert_eq!(error, "the number of rows that close is 2, but it must be 3 or more");
}

#[test]
fn entries_that_are_no_square_matrix_are_refused() {
    let error = RowMajor::new(2, &[1.0, 2.0, 3.0]).unwrap_err();
    assert_eq!(error.to_string(), "the matrix: order 2 takes 2² entries, but 3 are given");
    let error = RowMajor::new(1, &[f64::NAN]).unwrap_err();
    assert!(matches!(error, Error::NotFinite { index: 0, .. }));
    assert!(Hlcp::lcp(DMatrix::<f64>::zeros(2, 3)).is_err());
    assert!(CscMatrix::<f64>::zeros(2, 3).check("A").is_err());
}

/// A sum that is rounded is one matrix for all that asks for its rows: what is visited with and
/// without [`Rows`], and assembled.
#[test]
fn rounded_sums_are_one_matrix() {
    let a = Csr::new(vec![0_usize, 2, 4], vec![0_usize, 1, 0, 1], vec![2.0_f32, -1.0, -1.0, 2.0]);
    let (a, by) = (a.unwrap(), 2.0_f32.powi(-26)); // 2 + by is 2
    let small = Scaled { by, of: Identity { order: 2 } };
    let grid = FivePoint::new(2, 1, [0.0, -1.0, 2.0, -1.0, 0.0]).unwrap();
    let (shifted, sum) = (Shifted { by, of: &a }, Sum(&a, small));
    let nested = Sum(Shifted { by, of: small }, Shifted { by: 2.0, of: Sum(small, &a) });
    let operators: [&dyn Rows<f32>; 5] =
        [&shifted, &sum, &Sum(small, &a), &nested, &Shifted { by, of: grid }];
    for operator in operators {
        for i in 0..2 {
            let mut tried = [0.0_f64; 2];
            assert!(operator.try_visit_row(i, &mut |j, a| tried[j] += f64::from(a)));
            let mut visited = [0.0_f64; 2];
            operator.visit_row(i, &mut |j, a| visited[j] += f64::from(a));
            assert_eq!(tried, visited);
        }
    }
}
