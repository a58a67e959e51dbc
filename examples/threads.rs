//! Several threads and a progress bar, on a million unknowns.
//!
//! ```text
//! cargo run --release --example threads
//! ```
//!
//! The threads are those of the rayon pool that surrounds the call; the bits are those of one
//! thread. `in_parallel` is there with the feature `rayon`, which `hlcp` has by default and
//! `hlcp-methods` has not.

use std::{error::Error, ops::ControlFlow};

use hlcp_methods::{Aor, FivePoint, Hlcp, Options, Solver, Tmms};
use indicatif::{ProgressBar, ProgressStyle};

fn main() -> Result<(), Box<dyn Error>> {
    let m = 1024;
    let a = FivePoint::new(m, m, [-1.0, -1.0, 4.2, -1.0, -1.0])?;
    let q: Vec<f64> = (0..m * m).map(|k| (1e-3 * (k % m) as f64).sin() - 0.4).collect();
    let problem = Hlcp::lcp(a)?.in_parallel();
    let mut solver = Solver::new(Tmms::mirrored(problem, Aor::sor(1.2)?)?);

    // Ten digits to go; the bar draws itself on a terminal only.
    let bar =
        ProgressBar::new(100).with_style(ProgressStyle::with_template("{bar:40} {msg} {eta}")?);
    let first = q.iter().map(|q| q * q).sum::<f64>().sqrt();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    let outcome = pool.install(|| {
        let options = Options::default().observer(|progress| {
            let digits = (first / progress.residual.l2).log10();
            bar.set_position((10.0 * digits.clamp(0.0, 10.0)) as u64);
            bar.set_message(format!("residual {:.1e}", progress.residual.l2));
            ControlFlow::Continue(())
        });
        solver.solve(&q, options)
    })?;
    bar.finish_and_clear();
    println!("{outcome}");
    Ok(outcome.ok()?)
}
