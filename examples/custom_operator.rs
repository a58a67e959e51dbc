//! A loaded string above a floor: an operator of one's own, on each rung of the ladder.
//!
//! ```text
//! cargo run --release --example custom_operator
//! ```
//!
//! A string under unit load hangs between two supports, a height 1/32 above a floor. Its height z
//! and the floor's reaction r satisfy −z″ + 1 = r, z ≥ 0, r ≥ 0, z r = 0: an LCP. The string lies
//! on the floor from x = 1/4 to 3/4, and is a parabola up to there, which second differences follow
//! exactly. The program ends with an error if a solve does not find that.

use std::error::Error;

use hlcp_core::{
    Aor, Diagonal, Hlcp, Identity, Jacobi, LinearOperator, Omega, Rows, check_operator,
};
use hlcp_methods::{Limits, Method, Mms, Solver, Tmms};

/// −z″ on the inner points of a uniform grid over [0, 1], as (2zᵢ − zᵢ₋₁ − zᵢ₊₁)/h².
#[derive(Clone, Copy)]
struct SecondDifference {
    points: usize,
}

impl SecondDifference {
    /// 1/h².
    fn stiffness(self) -> f64 {
        ((self.points + 1) as f64).powi(2)
    }
}

// The first rung, a product, is enough for a splitting of one's own …
impl LinearOperator<f64> for SecondDifference {
    fn order(&self) -> usize {
        self.points
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        for i in 0..x.len() {
            let west = if i > 0 { x[i - 1] } else { 0.0 };
            let east = if i + 1 < x.len() { x[i + 1] } else { 0.0 };
            y[i] = self.stiffness() * (2.0 * x[i] - west - east);
        }
    }
}

// … the second, a diagonal, for Jacobi …
impl Diagonal<f64> for SecondDifference {
    fn diagonal_entry(&self, _: usize) -> f64 {
        2.0 * self.stiffness()
    }
}

// … and the third, rows, for Gauss–Seidel, SOR, AOR and AMMS.
impl Rows<f64> for SecondDifference {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
        if i > 0 {
            visit(i - 1, -self.stiffness());
        }
        visit(i, 2.0 * self.stiffness());
        if i + 1 < self.points {
            visit(i + 1, -self.stiffness());
        }
    }
}

const FLOOR: f64 = 1.0 / 32.0;

fn solve(name: &str, method: impl Method<f64>) -> Result<(), Box<dyn Error>> {
    let n = method.problem().order();
    let h = 1.0 / (n + 1) as f64;
    // The load, and what the supports add to the first and the last row.
    let mut q = vec![1.0; n];
    q[0] -= FLOOR / (h * h);
    q[n - 1] -= FLOOR / (h * h);

    let mut solver = Solver::new(method);
    let outcome = solver.solve(&q, Limits::absolute(1e-10))?;
    outcome.ok()?;
    let height = |i: usize| {
        let x = (i + 1) as f64 * h;
        (0.25 - x.min(1.0 - x)).max(0.0).powi(2) / 2.0
    };
    let error =
        solver.z().iter().enumerate().map(|(i, z)| (z - height(i)).abs()).fold(0.0, f64::max);
    let contact = solver.r().iter().filter(|r| **r > 0.0).count();
    println!("{name:<10} {outcome}; error {error:.1e}, {contact} of {n} points on the floor");
    if error < 1e-10 { Ok(()) } else { Err("a wrong answer".into()) }
}

fn main() -> Result<(), Box<dyn Error>> {
    let string = SecondDifference { points: 63 };
    // Once, while one writes an operator: do its product, its diagonal and its rows agree?
    check_operator(&string)?;
    // B = I makes it an LCP; Ω is one number, of the size of A's diagonal over B's.
    let omega = Omega::Uniform(string.diagonal_entry(0));
    let problem = Hlcp::new(string, Identity { order: string.points }, omega)?;

    let scaling = move |rhs: &[f64], y: &mut [f64]| {
        y.iter_mut().zip(rhs).for_each(|(y, rhs)| *y = rhs / (4.0 * string.stiffness()));
    };
    solve("products", Mms::with_splitting(problem.clone(), scaling)?)?;
    solve("diagonal", Mms::new(problem.clone(), Jacobi)?)?;
    solve("rows", Tmms::mirrored(problem, Aor::gauss_seidel())?)
}
