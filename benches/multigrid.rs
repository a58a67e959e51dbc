//! Multigrid's passes and whole solves against the fused half-step, and grids that close round.
//!
//! ```text
//! cargo bench --bench multigrid
//! ```
//!
//! One thread unless said.

mod common;

use std::{cell::RefCell, error::Error};

use common::{against, done, machine, row, seconds, solved_on, varying};
use hlcp_core::{Aor, FivePoint, Hlcp, Omega, Rhs, Rows, Smoother, Step, Transfer};
use hlcp_methods::{Cycle, FullMultigrid, Multigrid, Solver};
use hlcp_verify::Disc;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The passes of a cycle against a half-step with norms of MMS.
fn passes<A: Rows<f64>, B: Rows<f64>>(
    m: usize,
    kind: &str,
    a: A,
    b: B,
    pool: &ThreadPool,
) -> Result<(), Box<dyn Error>> {
    let problem = Hlcp::new(a, b, Omega::Uniform(1.0))?;
    let omega = Smoother::scaling(&problem)?;
    let (n, transfer) = (m * m, Transfer::new([m; 2], [false; 2]));
    let wave = |rate: f64| (0..n).map(|i| (i as f64 * rate).sin()).collect::<Vec<f64>>();
    let (q, x, y) = (wave(1.0), wave(1.7), RefCell::new(vec![0.0; n]));
    let (aor, rhs) = (Aor::gauss_seidel(), Rhs::new(&q)?);
    let mut half =
        || seconds(m, || done(aor.step(&problem, &rhs, &x, &mut y.borrow_mut(), &mut vec![])));
    let [alone, together] =
        [false, true].map(|shared| Smoother::new(&problem, Some(&omega), shared));
    let (alone, together) = (alone?, together?);
    let f = (1.0, &q[..]);
    for (name, backward) in [("forward", false), ("backward", true)] {
        let mut sweep = || seconds(m, || alone.relax(backward, f, &x, &mut y.borrow_mut()));
        let what = format!("smoothing {name}, {kind}m = {m}");
        row(&what, "half-step", "≤ 1.5", n, against(&mut sweep, &mut half));
        let in_pool = || {
            let y = &mut *y.borrow_mut();
            pool.install(|| seconds(m, || together.relax(backward, f, &x, y)))
        };
        let (ratio, time) = against(&mut sweep, in_pool);
        row(&format!("one thread, {what}"), "2 threads", "≥ 1.6", n, (ratio, time / ratio));
    }
    let mut coarse = vec![0.0; transfer.coarse().iter().product()];
    let restrict = || seconds(m, || alone.restrict(f, &x, &transfer, &mut coarse));
    let what = format!("defect and restriction, {kind}m = {m}");
    row(&what, "half-step", "", n, against(restrict, &mut half));
    let interpolate = || seconds(m, || transfer.interpolate(&coarse, &mut y.borrow_mut(), false));
    row(&format!("interpolation, m = {m}"), "half-step", "", n, against(interpolate, &mut half));
    Ok(())
}

/// disc-lcp by full multigrid: the seconds on one thread over those on two.
fn solves(m: usize, pool: &ThreadPool) -> Result<(), Box<dyn Error>> {
    let scene = Disc { lcp: true, m }.pose::<f64>()?;
    let problem = Hlcp::new(scene.a, scene.b, Omega::Uniform(4.0))?;
    let solver = |problem| -> Result<_, Box<dyn Error>> {
        Ok(Solver::new(FullMultigrid::new(Multigrid::new(problem, Cycle::W)?)))
    };
    let solvers = [solver(problem.clone())?, solver(problem.in_parallel())?];
    let what = format!("disc-lcp by FMG, one thread, m = {m}");
    row(&what, "2 threads", "≥ 1.6", m * m, solved_on(pool, solvers, &scene.q));
    Ok(())
}

/// A half-step on a grid that closes in both directions against one on an open grid.
fn closed(m: usize, a: FivePoint<f64>, b: FivePoint<f64>) -> Result<(), Box<dyn Error>> {
    let n = m * m;
    let open = Hlcp::new(a, b, Omega::Uniform(1.1))?;
    let round = |of: FivePoint<f64>| of.periodic([true, true]);
    let torus = Hlcp::new(round(a)?, round(b)?, Omega::Uniform(1.1))?;
    let q: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
    let (aor, rhs, y) = (Aor::gauss_seidel(), Rhs::new(&q)?, RefCell::new(vec![0.0; n]));
    let sweep = |problem: &Hlcp<f64, FivePoint<f64>, FivePoint<f64>>| {
        seconds(m, || done(aor.step(problem, &rhs, &q, &mut y.borrow_mut(), &mut vec![])))
    };
    let figures = against(|| sweep(&torus), || sweep(&open));
    row(&format!("half-step on a torus, m = {m}"), "open grid", "", n, figures);
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let pool = ThreadPoolBuilder::new().num_threads(2).build()?;
    println!("{}\n", machine());
    println!("| what | against | ratio | target | ns per point |\n|---|---|---|---|---|");
    for m in [255, 511, 1023, 4095] {
        let a = FivePoint::new(m, m, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
        let b = FivePoint::new(m, m, [0.0, -1.0, 8.0, -1.0, 0.0])?;
        passes(m, "", a, b, &pool)?;
        closed(m, a, b)?;
    }
    for m in [255, 1023] {
        passes(m, "varying, ", varying(m, 1.0)?, varying(m, 2.0)?, &pool)?;
    }
    [511, 1023].into_iter().try_for_each(|m| solves(m, &pool))
}
