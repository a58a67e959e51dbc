//! `hlcp scenes`: the scenes' published figures beside ours, and how many iterations the paper's
//! methods take.
//!
//! MGS, AMGS and TMGS with τ = 1 from x⁰ = e to each scene's tolerance, at most 30,000 iterations.
//! Ends with an error if a figure misses what is published.

use clap::Args;
use hlcp_methods::{Limits, Parameters, Status};

use super::{
    methods::tuned,
    run::{Fallible, Run, march, solve},
};
use crate::{
    print,
    scenes::{Problem, Scene},
};

/// Print the scenes' published figures beside ours, and iteration counts
#[derive(Debug, Args)]
pub(crate) struct Arguments;

type Given<'g> = &'g [(&'static str, f64)];

const METHODS: [&str; 3] = ["MGS", "AMGS", "TMGS"];

pub(crate) fn run() -> Fallible<()> {
    print::line(format_args!("{:<36} {:<10} ours", "", "published"))?;
    journal_bearing()?;
    obstacle()?;
    bearing2d()?;
    american_put()?;
    print::line(format_args!(
        "\n{:<36} {:>5} {:>8} {:>8} {:>8}",
        "iterations", "n", "MGS", "AMGS", "TMGS"
    ))?;
    counts()
}

/// Returns the figures of a scene by TMGS.
fn figures(scene: &str, given: Given<'_>) -> Fallible<Vec<(&'static str, f64)>> {
    let scene = Scene::of(scene);
    let problem = scene.pose(given)?;
    let Run { answer: [z, r], .. } =
        solve(&problem, &tuned("TMGS", [1.0; 2])?, 1.0, &scene.limits())?;
    Ok((problem.figures)(&z, &r))
}

/// Prints a published figure and ours; an error unless they agree.
fn compare(what: &str, published: &str, ours: &str, agree: bool) -> Fallible<()> {
    print::line(format_args!("{what:<36} {published:<10} {ours}"))?;
    if agree { Ok(()) } else { Err(format!("{what}: {ours} is not {published}").into()) }
}

fn journal_bearing() -> Fallible<()> {
    let figures = figures("journal-bearing", &[("nx", 8.0), ("ny", 12.0)])?;
    let ours = format!("{:.6}", figures[0].1);
    compare("journal bearing 8 × 12, objective", "-0.183437", &ours, ours == "-0.183437")
}

fn obstacle() -> Fallible<()> {
    for (m, published) in [(9, ["3.076e-3", "1.334e-2"]), (17, ["2.707e-3", "1.428e-2"])] {
        let errors = figures("obstacle", &[("m", m.into())])?;
        for (k, name) in ["mean", "largest"].into_iter().enumerate() {
            let ours = format!("{:.3e}", errors[k].1);
            let what = format!("obstacle {m} × {m}, {name} error");
            compare(&what, published[k], &ours, ours == published[k])?;
        }
    }
    Ok(())
}

fn bearing2d() -> Fallible<()> {
    let table =
        [(0.1, 1.33), (0.2, 0.631), (0.4, 0.264), (0.6, 0.121), (0.8, 0.0446), (0.9, 0.0188)];
    for (ecc, published) in table {
        let ours = figures("bearing2d", &[("ny", 31.0), ("ecc", ecc)])?[0].1;
        let what = format!("bearing2d ε = {ecc}, Sommerfeld number");
        let agree = (ours / published - 1.0).abs() < 0.015;
        compare(&what, &published.to_string(), &format!("{ours:.4}"), agree)?;
    }
    Ok(())
}

/// Returns the price for spot 36 and strike 40, and the iterations: from the last answer or from
/// x⁰ = e.
fn put_price(method: &str, problem: &Problem<f64>, warm: bool) -> Fallible<(f64, usize)> {
    let mut solver = problem.solver(method, Parameters::default(), 1.0)?;
    let outcome = march(problem, &mut solver, &Limits::absolute(1e-10), warm)?;
    if !outcome.converged() {
        return Err(format!("American put: {outcome}").into());
    }
    Ok((40.0 * (problem.figures)(solver.z(), solver.r())[0].1, outcome.iterations))
}

fn put(m: u32, steps: u32) -> Fallible<Problem<f64>> {
    Ok(Scene::of("american-put").pose(&[("m", m.into()), ("steps", steps.into())])?)
}

fn american_put() -> Fallible<()> {
    let mut prices = vec![];
    for m in [16, 32, 64] {
        prices.push(put_price("TMGS", &put(m, m * m / 4)?, true)?.0);
        let what = format!("American put, m = {m}, {} steps", m * m / 4);
        compare(&what, "4.48667344", &format!("{:.6}", prices[prices.len() - 1]), true)?;
    }
    let limit = prices[2] + (prices[2] - prices[1]) / 3.0;
    let agree = (limit - 4.48667344).abs() < 5e-5;
    compare("American put, extrapolated", "4.48667344", &format!("{limit:.6}"), agree)
}

/// One line of counts; in parentheses the residual where the iterations ran out.
fn count(what: &str, scene: &str, given: Given<'_>) -> Fallible<()> {
    let scene = Scene::of(scene);
    let problem = scene.pose(given)?;
    let mut line = format!("{what:<36} {:>5}", problem.q.len());
    for method in METHODS {
        let outcome = solve(&problem, &tuned(method, [1.0; 2])?, 1.0, &scene.limits())?.outcome;
        let cell = match outcome.status {
            Status::Converged => outcome.iterations.to_string(),
            Status::Diverged(_) => "diverges".to_owned(),
            _ => format!("({:.0e})", outcome.residual.l2),
        };
        line += &format!(" {cell:>8}");
    }
    Ok(print::line(line)?)
}

fn counts() -> Fallible<()> {
    for m in [32.0, 64.0] {
        let given = [("m", m), ("solution", 1.0)];
        count(&format!("example1 generic, m = {m}"), "example1", &given)?;
    }
    for name in ["disc-lcp", "disc-hlcp"] {
        for m in [31.0, 63.0] {
            count(&format!("{name}, m = {m}"), name, &[("m", m)])?;
        }
    }
    for cells in [50.0, 100.0] {
        count(&format!("slider, {cells} cells"), "slider", &[("m", cells)])?;
    }
    for m in [31.0, 63.0] {
        let what = format!("journal bearing, {m} × {m}");
        count(&what, "journal-bearing", &[("nx", m), ("ny", m)])?;
    }
    for m in [33.0, 65.0] {
        count(&format!("obstacle, {m} × {m}"), "obstacle", &[("m", m)])?;
    }
    let groove = 3.8_f64.to_degrees();
    for (place, aspect, groove) in
        [("widest", 1.0, 0.0), ("218°", 1.0, groove), ("widest", 0.25, 0.0)]
    {
        for (nx, ny) in [(31.0, 15.0), (63.0, 31.0), (127.0, 63.0)] {
            let given = [("nx", nx), ("ny", ny), ("aspect", aspect), ("groove", groove)];
            let what = format!("bearing2d {place}, L/D {aspect}, {nx} × {ny}");
            count(&what, "bearing2d", &given)?;
        }
    }
    for nx in [47.0, 95.0] {
        let given = [("nx", nx), ("ny", 1.0), ("aspect", 1e6), ("groove", groove)];
        count(&format!("bearing2d 218°, L/D ∞, {nx} × 1"), "bearing2d", &given)?;
    }
    for (warm, name) in [(true, "warm"), (false, "cold")] {
        for m in [32, 64] {
            let problem = put(m, m)?;
            let what = format!("put, m = steps = {m}, {name}");
            let mut line = format!("{what:<36} {:>5}", problem.q.len());
            for method in METHODS {
                line += &format!(" {:>8}", put_price(method, &problem, warm)?.1);
            }
            print::line(line)?;
        }
    }
    Ok(())
}
