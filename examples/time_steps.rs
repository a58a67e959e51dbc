//! A sequence of problems that change little, each started from the last answer.
//!
//! ```text
//! cargo run --release --example time_steps
//! ```
//!
//! A membrane over a moving obstacle: A is the same in every step, q moves. Prints the iterations
//! of each step from the last answer and from nothing.

use std::error::Error;

use hlcp_methods::{AdaptiveSor, FivePoint, Hlcp, Limits, Options, Solver};

const M: usize = 100;

/// The load at one time.
fn load(time: f64) -> Vec<f64> {
    let point = |k: usize| {
        let [x, y] = [k % M, k / M].map(|i| (i as f64 + 1.0) / (M as f64 + 1.0));
        let bump = (x - 0.4 - 0.2 * time).powi(2) + (y - 0.5).powi(2) - 0.04;
        bump * 1e-2
    };
    (0..M * M).map(point).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let a = FivePoint::new(M, M, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    let mut warm = Solver::new(AdaptiveSor::new(Hlcp::lcp(a)?)?);
    let mut cold = Solver::new(AdaptiveSor::new(Hlcp::lcp(a)?)?);
    let limits = Limits::relative(1e-6);
    let mut totals = [0, 0];
    for step in 0..20 {
        let q = load(0.01 * step as f64);
        let from_last = warm.solve(&q, Options::resume().limits(limits))?;
        let from_nothing = cold.solve(&q, limits)?;
        from_last.ok().and(from_nothing.ok())?;
        println!("step {step:2}: {} and {}", from_last.iterations, from_nothing.iterations);
        totals[0] += from_last.iterations;
        totals[1] += from_nothing.iterations;
    }
    println!("in all {} from the last answer, {} from nothing", totals[0], totals[1]);
    if totals[0] < totals[1] { Ok(()) } else { Err("the last answer is no help".into()) }
}
