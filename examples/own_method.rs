//! A method of one's own: Gauss–Seidel sweeps with momentum, beside the plain ones.
//!
//! ```text
//! cargo run --release --example own_method
//! ```
//!
//! A `Method` is two functions: its problem, and a step from x to y that returns the residual at x.
//! The solver adds limits, observers, the best iterate and the outcome.

use std::error::Error;

use hlcp_methods::{
    Aor, Clock, FivePoint, Hlcp, Identity, Limits, Method, Mms, Norms, Rhs, Solver,
};

type Problem = Hlcp<f64, FivePoint<f64>, Identity>;

/// x⁺ = GS(x) + θ (x − x⁻), with the iterate x⁻ before x.
struct Momentum {
    sweep: Mms<f64, FivePoint<f64>, Identity, Aor<f64>>,
    theta: f64,
    before: Vec<f64>,
}

impl Method<f64> for Momentum {
    type A = FivePoint<f64>;
    type B = Identity;

    fn problem(&self) -> &Problem {
        self.sweep.problem()
    }

    fn step(
        &mut self,
        q: &Rhs<'_, f64>,
        x: &[f64],
        y: &mut Vec<f64>,
        clock: &mut Clock<'_>,
    ) -> Norms {
        let norms = self.sweep.step(q, x, y, clock);
        // The first step has no iterate before x.
        if !self.before.is_empty() {
            for ((y, &x), &before) in y.iter_mut().zip(x).zip(&self.before) {
                *y += self.theta * (x - before);
            }
        }
        self.before.clear();
        self.before.extend_from_slice(x);
        norms
    }

    fn restart(&mut self) {
        self.sweep.restart();
        self.before.clear();
    }

    fn has_memory(&self) -> bool {
        true
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let m = 128;
    let a = FivePoint::new(m, m, [-1.0, -1.0, 4.1, -1.0, -1.0])?;
    let q: Vec<f64> = (0..m * m).map(|k| 0.3 - (0.05 * (k % m) as f64).sin()).collect();
    let limits = Limits::relative(1e-8);
    let mut counts = vec![];
    for theta in [0.0, 0.2, 0.4, 0.6] {
        let sweep = Mms::new(Hlcp::lcp(a)?, Aor::gauss_seidel())?;
        let mut solver = Solver::new(Momentum { sweep, theta, before: vec![] });
        let outcome = solver.solve(&q, limits)?;
        outcome.ok()?;
        println!("θ = {theta}: {outcome}");
        counts.push(outcome.iterations);
    }
    if counts[2] < counts[0] { Ok(()) } else { Err("momentum does not pay here".into()) }
}
