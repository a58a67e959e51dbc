//! A proved bound on the error of an answer, whatever computed it.
//!
//! ```text
//! cargo run --release --example certificate
//! ```
//!
//! Solves Example 2 of the paper to a few digits and to many, and certifies both answers.

use std::error::Error;

use hlcp_methods::{Aor, Hlcp, Limits, Mms, Solver};
use hlcp_verify::{Example, certify, decimal};

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Example { symmetric: false, m: 64, mu: 4.0, nu: 4.0 }.pose::<f64>()?;
    let problem = Hlcp::from_pair(&scene.a, &scene.b)?;
    let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
    for tolerance in [1e-3, 1e-10] {
        let outcome = solver.solve(&scene.q, Limits::relative(tolerance))?;
        let (z, r) = (solver.z(), solver.r());
        let bound = certify(&scene.a, &scene.b, &scene.q, z, r)??.error();
        let error =
            |u: &[f64], v: &[f64]| u.iter().zip(v).map(|(u, v)| (u - v).abs()).fold(0.0, f64::max);
        let truth = error(z, &scene.z).max(error(r, &scene.r));
        let printed = decimal(bound, 1, true);
        println!("{outcome}\n  proved error ≤ {printed}, true error {truth:.1e}");
        if bound < truth {
            return Err("a proof that is false".into());
        }
    }
    Ok(())
}
