//! The scenes' published figures beside ours, and how many iterations the paper's methods take.
//!
//! ```text
//! cargo run --release --example scenes
//! ```
//!
//! MGS, AMGS and TMGS with τ = 1 from x⁰ = e to an absolute 2-norm of 1e-10 (for the slider 1e-10 ‖q‖), at most 30,000
//! iterations. Ends with an error if a figure misses what is published.

mod print;

use std::error::Error;

use hlcp_core::{Hlcp, LinearOperator, Norms, Omega, Rows};
use hlcp_methods::{Limits, Named, Options, Outcome, Parameters, Solver, Status};
use hlcp_verify::{AmericanPut, Bearing2d, Disc, Example, JournalBearing, Obstacle, Slider};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

const METHODS: [&str; 3] = ["MGS", "AMGS", "TMGS"];

fn main() -> Result<()> {
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

/// `z` and the outcome by a method of this name.
fn solved<A, B>(method: &str, a: A, b: B, q: &[f64], relative: f64) -> Result<(Vec<f64>, Outcome)>
where
    A: Rows<f64>,
    B: Rows<f64>,
{
    let omega = Omega::diagonal_ratio(1.0, &a, &b)?;
    let method = Named::parse(method, Parameters::default())?.on(Hlcp::new(a, b, omega)?)?;
    let mut solver = Solver::new(method);
    let limits = Limits::absolute(f64::max(1e-10, relative * Norms::of(q).l2));
    let outcome = solver.solve(q, Options::from_x(&vec![1.0; q.len()]).limits(limits))?;
    Ok((solver.z().to_vec(), outcome))
}

/// Prints a published figure and ours; an error unless they agree.
fn compare(what: &str, published: &str, ours: &str, agree: bool) -> Result<()> {
    print::line(format_args!("{what:<36} {published:<10} {ours}"))?;
    if agree { Ok(()) } else { Err(format!("{what}: {ours} is not {published}").into()) }
}

fn journal_bearing() -> Result<()> {
    let scene = JournalBearing { nx: 8, ny: 12, ecc: 0.1, b: 10.0 };
    let (a, b, q) = scene.pose()?;
    let ours = format!("{:.6}", scene.objective(&solved("TMGS", a, b, &q, 0.0)?.0));
    compare("journal bearing 8 × 12, objective", "-0.183437", &ours, ours == "-0.183437")
}

fn obstacle() -> Result<()> {
    for (m, published) in [(9, ["3.076e-3", "1.334e-2"]), (17, ["2.707e-3", "1.428e-2"])] {
        let scene = Obstacle { m };
        let (a, b, q) = scene.pose()?;
        let errors = scene.errors(&solved("TMGS", a, b, &q, 0.0)?.0);
        for (k, name) in ["mean", "largest"].into_iter().enumerate() {
            let ours = format!("{:.3e}", errors[k]);
            let what = format!("obstacle {m} × {m}, {name} error");
            compare(&what, published[k], &ours, ours == published[k])?;
        }
    }
    Ok(())
}

fn bearing2d() -> Result<()> {
    let table =
        [(0.1, 1.33), (0.2, 0.631), (0.4, 0.264), (0.6, 0.121), (0.8, 0.0446), (0.9, 0.0188)];
    for (ecc, published) in table {
        let scene = Bearing2d { nx: 127, ny: 31, ecc, aspect: 1.0, groove: 0.0 };
        let (a, b, q) = scene.pose()?;
        let ours = scene.sommerfeld(&solved("TMGS", a, b, &q, 0.0)?.0);
        let what = format!("bearing2d ε = {ecc}, Sommerfeld number");
        let agree = (ours / published - 1.0).abs() < 0.015;
        compare(&what, &published.to_string(), &format!("{ours:.4}"), agree)?;
    }
    Ok(())
}

/// The price for spot 36 and strike 40, and the iterations: from the last answer or from x⁰ = e.
fn put_price(method: &str, put: AmericanPut, warm: bool) -> Result<(f64, usize)> {
    let (a, b) = put.pose()?;
    let start = vec![1.0; a.order()];
    let (mut x, mut q) = (start.clone(), start);
    let omega = Omega::diagonal_ratio(1.0, &a, &b)?;
    let method = Named::parse(method, Parameters::default())?.on(Hlcp::new(a, b, omega)?)?;
    let (mut solver, mut iterations) = (Solver::new(method), 0);
    for k in 0..put.lcps() {
        put.q(k, solver.z(), &mut q);
        let outcome = solver.solve(&q, Options::from_x(&x).limits(Limits::absolute(1e-10)))?;
        if !outcome.converged() {
            return Err(format!("American put, LCP {k}: {outcome}").into());
        }
        iterations += outcome.iterations;
        if warm {
            x.copy_from_slice(solver.x());
        }
    }
    Ok((40.0 * put.price(solver.z(), 36.0 / 40.0), iterations))
}

fn put(m: usize, steps: usize) -> AmericanPut {
    AmericanPut { rate: 0.06, volatility: 0.2, maturity: 1.0, m, steps }
}

fn american_put() -> Result<()> {
    let mut prices = vec![];
    for m in [16, 32, 64] {
        prices.push(put_price("TMGS", put(m, m * m / 4), true)?.0);
        let what = format!("American put, m = {m}, {} steps", m * m / 4);
        compare(&what, "4.48667344", &format!("{:.6}", prices[prices.len() - 1]), true)?;
    }
    let limit = prices[2] + (prices[2] - prices[1]) / 3.0;
    let agree = (limit - 4.48667344).abs() < 5e-5;
    compare("American put, extrapolated", "4.48667344", &format!("{limit:.6}"), agree)
}

/// One line of counts; in parentheses the residual where the iterations ran out.
fn count<A, B>(what: &str, a: A, b: B, q: &[f64], relative: f64) -> Result<()>
where
    A: Rows<f64> + Clone,
    B: Rows<f64> + Clone,
{
    let mut line = format!("{what:<36} {:>5}", q.len());
    for method in METHODS {
        let (_, outcome) = solved(method, a.clone(), b.clone(), q, relative)?;
        let cell = match outcome.status {
            Status::Converged => outcome.iterations.to_string(),
            Status::Diverged(_) => "diverges".to_owned(),
            _ => format!("({:.0e})", outcome.residual.l2),
        };
        line += &format!(" {cell:>8}");
    }
    Ok(print::line(line)?)
}

fn counts() -> Result<()> {
    for m in [32, 64] {
        let scene = Example { symmetric: true, m, mu: 4.0, nu: 4.0 }.pose_generic()?;
        count(&format!("example1 generic, m = {m}"), scene.a, scene.b, &scene.q, 0.0)?;
    }
    for lcp in [true, false] {
        for m in [31, 63] {
            let scene = Disc { lcp, m }.pose()?;
            let name = if lcp { "disc-lcp" } else { "disc-hlcp" };
            count(&format!("{name}, m = {m}"), scene.a, scene.b, &scene.q, 0.0)?;
        }
    }
    for cells in [50, 100] {
        let (a, b, q) = Slider { cells }.pose()?;
        count(&format!("slider, {cells} cells"), a, b, &q, 1e-10)?;
    }
    for m in [31, 63] {
        let (a, b, q) = JournalBearing { nx: m, ny: m, ecc: 0.1, b: 10.0 }.pose()?;
        count(&format!("journal bearing, {m} × {m}"), a, b, &q, 0.0)?;
    }
    for m in [33, 65] {
        let (a, b, q) = Obstacle { m }.pose()?;
        count(&format!("obstacle, {m} × {m}"), a, b, &q, 0.0)?;
    }
    let grids = [(31, 15), (63, 31), (127, 63)];
    let films = [("widest", 1.0, 0.0), ("218°", 1.0, 3.8), ("widest", 0.25, 0.0)];
    for (place, aspect, groove) in films {
        for (nx, ny) in grids {
            let (a, b, q) = Bearing2d { nx, ny, ecc: 0.6, aspect, groove }.pose()?;
            let what = format!("bearing2d {place}, L/D {aspect}, {nx} × {ny}");
            count(&what, a, b, &q, 0.0)?;
        }
    }
    for nx in [47, 95] {
        let scene = Bearing2d { nx, ny: 1, ecc: 0.6, aspect: 1e6, groove: 3.8 };
        let (a, b, q) = scene.pose()?;
        count(&format!("bearing2d 218°, L/D ∞, {nx} × 1"), a, b, &q, 0.0)?;
    }
    for (warm, name) in [(true, "warm"), (false, "cold")] {
        for m in [32, 64] {
            let order = put(m, m).pose::<f64>()?.0.order();
            let mut line = format!("{:<36} {order:>5}", format!("put, m = steps = {m}, {name}"));
            for method in METHODS {
                line += &format!(" {:>8}", put_price(method, put(m, m), warm)?.1);
            }
            print::line(line)?;
        }
    }
    Ok(())
}
