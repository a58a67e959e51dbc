//! Semismooth Newton on the assembled matrix, an outside anchor: faer's sparse LU does the work.

use std::{error::Error, time::Instant};

use faer::{
    Mat,
    linalg::solvers::Solve,
    sparse::{SparseColMat, Triplet},
};
use hlcp_core::Rows;

use super::{problem::Problem, series::Run};

/// `xₖ₊₁` solves `J xₖ₊₁ = −q` with the columns `2Aⱼ` of J where `xⱼ > 0` and `2ωⱼBⱼ` elsewhere, Ω
/// = D_A D_B⁻¹, until `‖A z − B r + q‖₂ ≤ tolerance·‖q‖₂`. Assembling and factorising are part of
/// the time.
pub(crate) fn solve(problem: &Problem, tolerance: f64) -> Result<Option<Run>, Box<dyn Error>> {
    let (a, b, q) = (&problem.wide.a, &problem.wide.b, &problem.wide.q);
    let n = q.len();
    let begin = Instant::now();
    let omega: Vec<f64> = (0..n).map(|i| a.diagonal_entry(i) / b.diagonal_entry(i)).collect();
    let goal = tolerance * q.iter().map(|q| q * q).sum::<f64>().sqrt();
    let mut x = vec![1.0_f64; n];
    let (mut z, mut r) = (vec![0.0; n], vec![0.0; n]);
    for iteration in 0.. {
        for i in 0..n {
            (z[i], r[i]) = (x[i].abs() + x[i], omega[i] * (x[i].abs() - x[i]));
        }
        let reached = residual(a, b, q, &z, &r) <= goal;
        if reached || iteration == 60 {
            let seconds = begin.elapsed().as_secs_f64();
            return Ok(Some(Run { seconds, sweeps: None, reached, z, r }));
        }
        let mut entries = vec![];
        for i in 0..n {
            a.visit_row(i, &mut |j, a| {
                if x[j] > 0.0 {
                    entries.push(Triplet::new(i, j, 2.0 * a));
                }
            });
            b.visit_row(i, &mut |j, b| {
                if x[j] <= 0.0 {
                    entries.push(Triplet::new(i, j, 2.0 * omega[j] * b));
                }
            });
        }
        let lu = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &entries)
            .map_err(|error| format!("{error:?}"))?
            .sp_lu()
            .map_err(|error| format!("{error:?}"))?;
        let mut next = Mat::from_fn(n, 1, |i, _| -q[i]);
        lu.solve_in_place(next.as_mut());
        x = (0..n).map(|i| next[(i, 0)]).collect();
    }
    unreachable!("the limit ends the loop")
}

fn residual(a: &dyn Rows<f64>, b: &dyn Rows<f64>, q: &[f64], z: &[f64], r: &[f64]) -> f64 {
    let (mut az, mut br) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    a.apply(z, &mut az);
    b.apply(r, &mut br);
    let squares = az.iter().zip(&br).zip(q).map(|((az, br), q)| (az - br + q).powi(2));
    squares.sum::<f64>().sqrt()
}
