//! Matrices that are assembled already: `nalgebra_sparse::CsrMatrix` is an operator as it is.
//!
//! ```text
//! cargo run --release --example assembled
//! ```
//!
//! Poses a random sparse pair with 10,000 unknowns, solves it and prints the outcome.

use std::error::Error;

use hlcp_methods::solve;
use nalgebra_sparse::{CooMatrix, CsrMatrix};

fn main() -> Result<(), Box<dyn Error>> {
    let n = 10_000;
    // Four entries off the diagonal of each row, at scattered places, and a dominant diagonal.
    let matrix = |seed: usize| {
        let mut coo = CooMatrix::new(n, n);
        for i in 0..n {
            for k in 1..5 {
                let j = (i * (seed + 7 * k) + 31 * k * k) % n;
                if j != i {
                    coo.push(i, j, -0.5 - 0.1 * k as f64);
                }
            }
            coo.push(i, i, 4.0);
        }
        CsrMatrix::from(&coo)
    };
    let (a, b) = (matrix(3), matrix(11));
    let q: Vec<f64> = (0..n).map(|i| (0.1 * i as f64).sin()).collect();

    let answer = solve(&a, &b, &q)?.ok()?;
    println!("{}", answer.outcome);
    let active = answer.z.iter().filter(|&&z| z > 0.0).count();
    println!("z > 0 in {active} of {n} unknowns");
    Ok(())
}
