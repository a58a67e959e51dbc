//! An operator of one's own in three dimensions, on each rung of the ladder: a membrane in space
//! above an obstacle.
//!
//! ```text
//! cargo run --release --example custom_operator
//! ```
//!
//! Solves the LCP of a seven-point stencil with 4,096 unknowns: by a method for products alone, by
//! one that takes the diagonal, by one that takes rows, and by `solve`. Prints the outcomes, and
//! ends with an error if the answers differ.

use std::error::Error;

use hlcp_core::{
    Aor, Diagonal, Hlcp, Identity, Jacobi, LinearOperator, Omega, Rows, check_operator,
};
use hlcp_methods::{Limits, Method, Mms, Solver, Tmms, solve};

/// 6 z − (the six neighbours) on m × m × m points.
#[derive(Clone, Copy)]
struct SevenPoint {
    m: usize,
}

// The first rung, a product, is enough for a splitting of one's own …
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

// … the second, a diagonal, for Jacobi …
impl Diagonal<f64> for SevenPoint {
    fn diagonal_entry(&self, _: usize) -> f64 {
        6.0
    }
}

// … and the third, rows, for Gauss–Seidel, SOR, AOR and AMMS, and for all that `solve` tries.
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
    let a = SevenPoint { m: 16 };
    // Once, while one writes an operator: do its product, its diagonal and its rows agree?
    check_operator(&a)?;
    let n = a.order();
    let q: Vec<f64> = (0..n).map(|k| (0.01 * k as f64).sin()).collect();
    let answer = solve(&a, &Identity { order: n }, &q)?.ok()?;
    let contact = answer.r.iter().filter(|&&r| r > 0.0).count();
    println!("solve      {}; r > 0 in {contact} of {n} points", answer.outcome);

    let by = |name: &str, method: &mut dyn Method<f64, A = SevenPoint, B = Identity>| {
        let mut solver = Solver::new(method);
        let outcome = solver.solve(&q, Limits::relative(1e-10))?;
        let apart = solver.z().iter().zip(&answer.z).map(|(one, other)| (one - other).abs());
        let apart = apart.fold(0.0, f64::max);
        println!("{name:<10} {outcome}; {apart:.1e} apart");
        outcome.ok()?;
        if apart < 1e-6 { Ok::<_, Box<dyn Error>>(()) } else { Err("a wrong answer".into()) }
    };
    // Ω is one number, of the size of A's diagonal over B's.
    let omega = Omega::Uniform(a.diagonal_entry(0));
    let problem = Hlcp::new(a, Identity { order: n }, omega)?;
    let scaling = |rhs: &[f64], y: &mut [f64]| {
        y.iter_mut().zip(rhs).for_each(|(y, rhs)| *y = rhs / 12.0);
    };
    by("products", &mut Mms::with_splitting(problem.clone(), scaling)?)?;
    by("diagonal", &mut Mms::new(problem.clone(), Jacobi)?)?;
    by("rows", &mut Tmms::mirrored(problem, Aor::gauss_seidel())?)
}
