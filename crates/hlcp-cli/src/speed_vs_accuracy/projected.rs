//! Projected SOR, an outside anchor: Cryer's method for the LCP, of the family that reference 22
//! of the paper extends, and what users of films have made of it.

use std::{error::Error, time::Instant};

use hlcp_core::Rows;

use super::{problem::Problem, series::Run};

/// `zᵢ ← max(0, zᵢ − α(A z − B r + q)ᵢ/aᵢᵢ)` with `rᵢ = 0`, over the grid; where that leaves
/// `zᵢ = 0`, `rᵢ` is what solves the row, if that is positive. Until the residual, as measured row
/// by row on the way, is at most `tolerance·‖q‖₂`; on `disc-lcp` and on films alone.
///
/// With `B = I`, where `r` follows from `z`, that is projected SOR. With transport in `B` it is the
/// relaxation of R. Ausas, M. Jai and G. Buscaglia (J. Tribology 131, 2009), pressure relaxed and
/// film content not.
pub(crate) fn solve(problem: &Problem, tolerance: f64) -> Result<Option<Run>, Box<dyn Error>> {
    let alpha = match problem.posed.scene.name {
        "disc-lcp" => 2.0 - 6.4 / problem.m(),
        "film" => 1.5,
        _ => return Ok(None),
    };
    let q = &problem.wide.q;
    let n = q.len();
    let begin = Instant::now();
    let [a, b] = [&problem.wide.a, &problem.wide.b].map(|operator| {
        let mut entries = Assembled { diagonal: vec![0.0; n], starts: vec![0], off: vec![] };
        for i in 0..n {
            operator.visit_row(i, &mut |j, entry| {
                if j == i {
                    entries.diagonal[i] = entry;
                } else {
                    entries.off.push((j as u32, entry));
                }
            });
            entries.starts.push(entries.off.len());
        }
        entries
    });
    let (mut z, mut r) = (vec![2.0_f64; n], vec![0.0_f64; n]);
    let goal = tolerance * q.iter().map(|q| q * q).sum::<f64>().sqrt();
    let (mut sweeps, mut residual) = (0, f64::INFINITY);
    while residual > goal && sweeps < 60_000 {
        let mut squares = 0.0;
        for i in 0..n {
            let t = q[i] + a.off(i, &z) - b.off(i, &r);
            let left = t + a.diagonal[i] * z[i] - b.diagonal[i] * r[i];
            squares += left * left;
            z[i] = ((1.0 - alpha) * z[i] - alpha * t / a.diagonal[i]).max(0.0);
            r[i] = if z[i] > 0.0 { 0.0 } else { (t / b.diagonal[i]).max(0.0) };
        }
        residual = squares.sqrt();
        sweeps += 1;
    }
    let seconds = begin.elapsed().as_secs_f64();
    let holds = tolerance * residual / goal;
    Ok(Some(Run { seconds, sweeps: Some(sweeps), reached: residual <= goal, holds, z, r }))
}

/// An operator by rows.
struct Assembled {
    diagonal: Vec<f64>,
    starts: Vec<usize>,
    off: Vec<(u32, f64)>,
}

impl Assembled {
    /// What row `i` makes of a vector beside the diagonal.
    fn off(&self, i: usize, v: &[f64]) -> f64 {
        let row = &self.off[self.starts[i]..self.starts[i + 1]];
        row.iter().map(|&(j, entry)| entry * v[j as usize]).sum()
    }
}
