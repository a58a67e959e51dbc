//! Projected SOR, an outside anchor: Cryer's method for the LCP, of the family that reference 22
//! of the paper extends.

use std::{error::Error, time::Instant};

use hlcp_core::LinearOperator;

use super::{problem::Problem, series::Run};

/// `zᵢ ← max(0, zᵢ − α(A z + q)ᵢ/aᵢᵢ)` over the grid, to `‖min(z, A z + q)‖₂ ≤ tolerance·‖q‖₂`; on
/// LCP scenes alone.
pub(crate) fn solve(problem: &Problem, tolerance: f64) -> Result<Option<Run>, Box<dyn Error>> {
    if problem.posed.scene.name != "disc-lcp" {
        return Ok(None);
    }
    let m = problem.m() as usize;
    let q = &problem.wide.q;
    let begin = Instant::now();
    // A frame of zeros, so that no point asks where it is.
    let width = m + 2;
    let mut z = vec![0.0; width * width];
    let squares = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
    let goal = tolerance * squares(q).sqrt();
    let alpha = 2.0 - 6.4 / m as f64;
    let (mut sweeps, mut residual) = (0, f64::INFINITY);
    while residual > goal && sweeps < 60_000 {
        let mut sum = 0.0;
        for j in 0..m {
            let row = (j + 1) * width + 1;
            for i in 0..m {
                let k = row + i;
                let around = z[k - 1] + z[k + 1] + z[k - width] + z[k + width];
                let r = 4.0 * z[k] - around + q[j * m + i];
                let natural = z[k].min(r);
                sum += natural * natural;
                z[k] = (z[k] - alpha * 0.25 * r).max(0.0);
            }
        }
        residual = sum.sqrt();
        sweeps += 1;
    }
    let inner = |v: &[f64]| -> Vec<f64> {
        v.chunks(width).skip(1).take(m).flat_map(|row| row[1..=m].to_vec()).collect()
    };
    let z = inner(&z);
    let mut r = vec![0.0; z.len()];
    problem.wide.a.apply(&z, &mut r);
    // r = A z + q where z rests on its bound; elsewhere what is left of it is the error.
    for ((r, &q), &z) in r.iter_mut().zip(q).zip(&z) {
        *r = if z > 0.0 { 0.0 } else { (*r + q).max(0.0) };
    }
    let seconds = begin.elapsed().as_secs_f64();
    Ok(Some(Run { seconds, sweeps: Some(sweeps), reached: residual <= goal, z, r }))
}
