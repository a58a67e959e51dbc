//! What several test programs share.
#![allow(dead_code, reason = "each test program uses its own part")]

use hlcp_core::{Aor, Diagonal, Hlcp, LinearOperator, Omega, Rows, Scalar};
use hlcp_methods::{Limits, Options, Solver, Tmms};
use hlcp_verify::{Planted, oracle::Dense};
use nalgebra::{DMatrix, DVector};
use proptest::{collection::vec, prelude::*};

/// A dense matrix as a user's operator.
#[derive(Debug, Clone)]
pub(crate) struct Matrix(pub(crate) DMatrix<f64>);

impl LinearOperator<f64> for Matrix {
    fn order(&self) -> usize {
        self.0.nrows()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice((&self.0 * DVector::from_column_slice(x)).as_slice());
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl Diagonal<f64> for Matrix {
    fn diagonal_entry(&self, i: usize) -> f64 {
        self.0[(i, i)]
    }
}

impl Rows<f64> for Matrix {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
        self.0.row(i).iter().enumerate().for_each(|(j, &a)| visit(j, a));
    }
}

/// The dense problem as the library sees it.
pub(crate) fn posed(dense: &Dense) -> Hlcp<f64, Matrix, Matrix> {
    let omega = Omega::Each(dense.omega.iter().copied().collect());
    Hlcp::new(Matrix(dense.a.clone()), Matrix(dense.b.clone()), omega)
        .and_then(|problem| problem.with_gamma(dense.gamma))
        .expect("generators make valid problems")
}

/// The matrix of an operator, from its rows.
pub(crate) fn assembled(operator: &impl Rows<f64>) -> DMatrix<f64> {
    let n = operator.order();
    let mut matrix = DMatrix::zeros(n, n);
    for i in 0..n {
        operator.visit_row(i, &mut |j, a| matrix[(i, j)] = a);
    }
    matrix
}

/// `z` and `r` by TMGS (τ = 1, x⁰ = e), which must converge to the default tolerance.
pub(crate) fn by_tmgs<T: Scalar, A: Rows<T>, B: Rows<T>>(a: A, b: B, q: &[T]) -> [Vec<T>; 2] {
    let omega = Omega::diagonal_ratio(T::one(), &a, &b).unwrap();
    let method = Tmms::mirrored(Hlcp::new(a, b, omega).unwrap(), Aor::gauss_seidel()).unwrap();
    let mut solver = Solver::new(method);
    let limits = Limits { iterations: 200_000, ..Limits::absolute(1e-10) };
    let outcome =
        solver.solve(q, Options::from_x(&vec![T::one(); q.len()]).limits(limits)).unwrap();
    assert!(outcome.converged(), "{outcome}");
    [solver.z().to_vec(), solver.r().to_vec()]
}

/// A full non-symmetric matrix: a diagonal in 1..4, off-diagonal rows that sum to at most `weight` in modulus.
fn matrix(n: usize, weight: f64) -> impl Strategy<Value = DMatrix<f64>> {
    let reach = weight / n as f64;
    (vec(-reach..reach, n * n), vec(1.0..4.0, n)).prop_map(move |(off, diagonal)| {
        DMatrix::from_fn(n, n, |i, j| if i == j { diagonal[i] } else { off[i * n + j] })
    })
}

/// A problem of the given orders with a planted solution, everything varying, nothing symmetric.
pub(crate) fn planted(
    orders: std::ops::Range<usize>,
    weight: f64,
) -> impl Strategy<Value = Planted> {
    (orders, 0.5..4.0).prop_flat_map(move |(n, gamma)| {
        (matrix(n, weight), matrix(n, weight), vec(-8.0..8.0, n), vec(0.4..2.5, n)).prop_map(
            move |(a, b, signed, omega)| {
                Planted::new(a, b, &signed, DVector::from_vec(omega), gamma)
            },
        )
    })
}
