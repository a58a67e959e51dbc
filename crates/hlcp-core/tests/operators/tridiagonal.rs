//! A tridiagonal operator is the matrix of its rows.

use hlcp_core::{Diagonal, Error, LinearOperator, Rows, Tridiagonal};
use nalgebra::{DMatrix, DVector};
use proptest::{collection::vec, prelude::*};

/// The matrix of the rows, whatever lies outside left out.
fn assembled(rows: &[[f64; 3]]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.len(), |i, j| match j as isize - i as isize {
        k @ -1..=1 => rows[i][(k + 1) as usize],
        _ => 0.0,
    })
}

fn entry() -> impl Strategy<Value = f64> {
    prop_oneof![3 => -4.0..4.0, 1 => Just(0.0)]
}

proptest! {
    #[test]
    fn products_and_walks_are_those_of_the_matrix(
        rows in vec(prop::array::uniform3(entry()), 1..12),
        x in vec(-4.0..4.0, 12),
    ) {
        let n = rows.len();
        let matrix = assembled(&rows);
        let operator = Tridiagonal::new(n, |i| rows[i]).unwrap();
        let mut walked = DMatrix::zeros(n, n);
        for i in 0..n {
            let mut last = None;
            operator.visit_row(i, &mut |j, a| {
                assert!(last < Some(j) && a != 0.0);
                last = Some(j);
                walked[(i, j)] = a;
            });
            prop_assert_eq!(operator.diagonal_entry(i), matrix[(i, i)]);
        }
        prop_assert_eq!(&walked, &matrix);

        let x = DVector::from_column_slice(&x[..n]);
        let mut y = vec![f64::NAN; n]; // apply overwrites and never reads
        operator.apply(x.as_slice(), &mut y);
        let rounding = 3.0 * f64::EPSILON * (matrix.abs() * x.abs()).amax();
        prop_assert!((DVector::from_vec(y) - matrix * x).amax() <= rounding);
    }
}

#[test]
fn bad_rows_are_refused_with_their_index() {
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
