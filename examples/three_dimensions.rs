//! An operator of one's own in three dimensions: a membrane in space above an obstacle.
//!
//! ```text
//! cargo run --release --example three_dimensions
//! ```
//!
//! Solves the LCP of a seven-point stencil with 27,000 unknowns, by `solve`, and prints the
//! outcome.

use std::error::Error;

use hlcp_methods::{Diagonal, Identity, LinearOperator, Rows, check_operator, solve};

/// 6 z − (the six neighbours) on m × m × m points.
struct SevenPoint {
    m: usize,
}

impl LinearOperator<f64> for SevenPoint {
    fn order(&self) -> usize {
        self.m.pow(3)
    }
    fn apply(&self, x: &[f64], y: &mut [f64]) {
        for (k, y) in y.iter_mut().enumerate() {
            *y = 0.0;
            self.visit_row(k, &mut |j, a| *y += a * x[j]);
        }
    }
    // Says that the rows are known, so that a solver can bound the rounding in a residual.
    fn try_visit_row(&self, k: usize, visit: &mut dyn FnMut(usize, f64)) -> bool {
        self.visit_row(k, visit);
        true
    }
}

impl Diagonal<f64> for SevenPoint {
    fn diagonal_entry(&self, _: usize) -> f64 {
        6.0
    }
}

impl Rows<f64> for SevenPoint {
    fn visit_row(&self, k: usize, visit: &mut dyn FnMut(usize, f64)) {
        let steps = [1, self.m, self.m * self.m];
        let place = |step: usize| k / step % self.m;
        for step in steps.into_iter().rev().filter(|&step| place(step) > 0) {
            visit(k - step, -1.0);
        }
        visit(k, 6.0);
        for step in steps.into_iter().filter(|&step| place(step) < self.m - 1) {
            visit(k + step, -1.0);
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let a = SevenPoint { m: 30 };
    check_operator(&a)?;
    let n = a.order();
    let q: Vec<f64> = (0..n).map(|k| (0.01 * k as f64).sin()).collect();
    let answer = solve(&a, &Identity { order: n }, &q)?.ok()?;
    println!("{}", answer.outcome);
    let contact = answer.r.iter().filter(|r| **r > 0.0).count();
    println!("r > 0 in {contact} of {n} points");
    Ok(())
}
