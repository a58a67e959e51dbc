//! The stencils are the paper's matrices, which are assembled here by Kronecker products.

use hlcp_core::{FivePoint, LinearOperator, Rows};
use hlcp_verify::Example;
use nalgebra::{DMatrix, DVector};
use proptest::{collection::vec, prelude::*};

/// tridiag(below; on; above) of order `n`.
fn tridiagonal(n: usize, [below, on, above]: [f64; 3]) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |i, j| match j as isize - i as isize {
        -1 => below,
        0 => on,
        1 => above,
        _ => 0.0,
    })
}

/// blktridiag(south·I; tridiag(west; centre; east); north·I), an x-line of `nx` points fastest.
fn assembled(nx: usize, ny: usize, [south, west, centre, east, north]: [f64; 5]) -> DMatrix<f64> {
    let identity = DMatrix::identity;
    identity(ny, ny).kronecker(&tridiagonal(nx, [west, centre, east]))
        + tridiagonal(ny, [south, 0.0, north]).kronecker(&identity(nx, nx))
}

fn walked(operator: &impl Rows<f64>) -> DMatrix<f64> {
    let n = operator.order();
    let mut matrix = DMatrix::zeros(n, n);
    for i in 0..n {
        let mut last = None;
        operator.visit_row(i, &mut |j, a| {
            assert!(last < Some(j), "row {i} visits {j} after {last:?}");
            last = Some(j);
            matrix[(i, j)] = a;
        });
        assert_eq!(operator.diagonal_entry(i), matrix[(i, i)]);
    }
    matrix
}

proptest! {
    #[test]
    fn a_stencil_is_its_kronecker_form(
        nx in 1_usize..9,
        ny in 1_usize..9,
        coefficients in prop::array::uniform5(-4.0..4.0),
        x in vec(-4.0..4.0, 64),
    ) {
        let stencil = FivePoint::new(nx, ny, coefficients).unwrap();
        let matrix = assembled(nx, ny, coefficients);
        prop_assert_eq!(walked(&stencil), matrix.clone());

        let x = DVector::from_column_slice(&x[..nx * ny]);
        let mut y = vec![f64::NAN; nx * ny]; // apply overwrites and never reads
        stencil.apply(x.as_slice(), &mut y);
        let rounding = 5.0 * f64::EPSILON * (matrix.abs() * x.abs()).amax();
        prop_assert!((DVector::from_vec(y) - matrix * x).amax() <= rounding);
    }
}

#[test]
fn the_examples_are_the_papers() {
    let (m, mu, nu) = (5, 0.3, 1.7);
    let identity = |n: usize| DMatrix::<f64>::identity(n, n);
    for (symmetric, below, above) in [(true, -1.0, -1.0), (false, -1.5, -0.5)] {
        let scene = Example { symmetric, m, mu, nu }.pose::<f64>().unwrap();
        let s = tridiagonal(m, [below, 4.0, above]);
        let b = identity(m).kronecker(&s);
        let a = &b + tridiagonal(m, [below, 0.0, above]).kronecker(&identity(m));
        assert_eq!(walked(&scene.a), a.clone() + mu * identity(m * m));
        assert_eq!(walked(&scene.b), b.clone() + nu * identity(m * m));

        let z = DVector::from_fn(m * m, |i, _| (i % 2) as f64);
        let r = z.map(|z| 1.0 - z);
        assert_eq!((&scene.z[..], &scene.r[..]), (z.as_slice(), r.as_slice()));
        let defect = walked(&scene.a) * z - walked(&scene.b) * r + DVector::from_vec(scene.q);
        assert!(defect.amax() <= 10.0 * f64::EPSILON * 8.0);
    }
}
