//! The paper's Example 1 on a 512 × 512 grid, in one call and by the paper's two-step method.
//!
//! ```text
//! cargo run --release --example first_solve
//! ```
//!
//! Prints how both ended and how far z is from the known solution; ends with an error unless both
//! converged.

use std::error::Error;

use hlcp_methods::{Aor, FivePoint, Hlcp, Limits, LinearOperator, Solver, Tmms, solve};

const M: usize = 512;

fn main() -> Result<(), Box<dyn Error>> {
    // [south, west, centre, east, north]: five numbers each, whatever the grid.
    let a = FivePoint::new(M, M, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
    let b = FivePoint::new(M, M, [0.0, -1.0, 8.0, -1.0, 0.0])?;

    // z* = 0, 1, 0, 1, … and r* = 1, 0, 1, 0, … make q = B r* − A z*.
    let n = M * M;
    let z: Vec<f64> = (0..n).map(|k| (k % 2) as f64).collect();
    let r: Vec<f64> = z.iter().map(|z| 1.0 - z).collect();
    let (mut q, mut az) = (vec![0.0; n], vec![0.0; n]);
    b.apply(&r, &mut q);
    a.apply(&z, &mut az);
    q.iter_mut().zip(&az).for_each(|(q, az)| *q -= az);

    let answer = solve(&a, &b, &q)?.ok()?;
    println!("solve: {}, error {:.1e}", answer.outcome, distance(&answer.z, &z));

    let mut solver = Solver::new(Tmms::mirrored(Hlcp::from_pair(a, b)?, Aor::gauss_seidel())?);
    let outcome = solver.solve(&q, Limits::absolute(1e-10))?;
    println!("TMGS: {outcome}, error {:.1e}", distance(solver.z(), &z));
    Ok(outcome.ok()?)
}

/// ‖u − v‖∞.
fn distance(u: &[f64], v: &[f64]) -> f64 {
    u.iter().zip(v).map(|(u, v)| (u - v).abs()).fold(0.0, f64::max)
}
