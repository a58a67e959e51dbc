//! `hlcp scenes`: the scenes' published figures beside ours, and how many iterations the paper's
//! methods take.
//!
//! MGS, AMGS and TMGS with τ = 1 from x⁰ = e to each scene's tolerance, at most 30,000 iterations.
//! Ends with an error if a figure misses what is published.

use std::path::PathBuf;

use clap::Args;
use hlcp_methods::{Outcome, Status};

use crate::{Fallible, chart::save, print, scenes::Scene};

/// Print the scenes' published figures beside ours, and iteration counts
#[derive(Args)]
pub(crate) struct Arguments {
    /// The coarsest grid of each scene alone
    #[arg(long)]
    quick: bool,
    /// A folder where what is printed goes into scenes.txt too
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

type Given<'g> = &'g [(&'static str, f64)];

const METHODS: [&str; 3] = ["MGS", "AMGS", "TMGS"];

pub(crate) fn run(arguments: &Arguments) -> Fallible<()> {
    let printed = &mut Printed(String::new());
    printed.line(format_args!("{:<36} {:<10} ours", "", "published"))?;
    published(printed)?;
    let [what, n] = ["iterations", "n"];
    let [mgs, amgs, tmgs] = METHODS;
    printed.line(format_args!("\n{what:<36} {n:>5} {mgs:>8} {amgs:>8} {tmgs:>8}"))?;
    counts(printed, arguments.quick)?;
    match &arguments.out {
        Some(folder) => save(&folder.join("scenes.txt"), &printed.0),
        None => Ok(()),
    }
}

struct Printed(String);

impl Printed {
    fn line(&mut self, words: std::fmt::Arguments<'_>) -> std::io::Result<()> {
        print::line(words)?;
        self.0 += &format!("{words}\n");
        Ok(())
    }
}

/// What became of a scene, the figures of its answer, and its order.
type Solved = (Outcome, Vec<(&'static str, f64)>, usize);

/// Solves the problems of a scene one after another, each from the last answer if `warm`, or else
/// from x⁰ = e.
fn solved(method: &str, scene: &str, given: Given<'_>, warm: bool) -> Fallible<Solved> {
    let scene = Scene::of(scene);
    let problem = scene.pose(given)?;
    let mut solver = problem.solver(method)?;
    let start = (&problem.start()[..], warm);
    let (outcome, _) = problem.march(&mut solver, start, &scene.limits(), None)?;
    Ok((outcome, (problem.figures)(solver.z(), solver.r()), problem.q.len()))
}

/// Returns a figure of a scene by TMGS, by its place.
fn figure(scene: &str, given: Given<'_>, place: usize) -> Fallible<f64> {
    let (outcome, figures, _) = solved("TMGS", scene, given, true)?;
    outcome.ok().map_err(|error| format!("{scene}: {error}"))?;
    Ok(figures[place].1)
}

/// Prints published figures and ours; an error unless they agree.
fn published(printed: &mut Printed) -> Fallible<()> {
    let mut compare = |what: &str, published: &str, ours: &str, agree: bool| -> Fallible<()> {
        printed.line(format_args!("{what:<36} {published:<10} {ours}"))?;
        if agree { Ok(()) } else { Err(format!("{what}: {ours} is not {published}").into()) }
    };
    let ours = figure("journal-bearing", &[("nx", 8.0), ("ny", 12.0)], 0)?;
    let ours = format!("{ours:.6}");
    compare("journal bearing 8 × 12, objective", "-0.183437", &ours, ours == "-0.183437")?;
    for (m, published) in [(9, ["3.076e-3", "1.334e-2"]), (17, ["2.707e-3", "1.428e-2"])] {
        for (k, name) in ["mean", "largest"].into_iter().enumerate() {
            let ours = format!("{:.3e}", figure("obstacle", &[("m", m.into())], k)?);
            let what = format!("obstacle {m} × {m}, {name} error");
            compare(&what, published[k], &ours, ours == published[k])?;
        }
    }
    for (ecc, published) in
        [(0.1, 1.33), (0.2, 0.631), (0.4, 0.264), (0.6, 0.121), (0.8, 0.0446), (0.9, 0.0188)]
    {
        let ours = figure("bearing2d", &[("ny", 31.0), ("ecc", ecc)], 0)?;
        let what = format!("bearing2d ε = {ecc}, Sommerfeld number");
        let agree = (ours / published - 1.0).abs() < 0.015;
        compare(&what, &published.to_string(), &format!("{ours:.4}"), agree)?;
    }
    // The free boundary is a cell wide.
    for (tail, length, published) in
        [(0.5, 1.0, ["0.375", "0.8367"]), (1.0 / 6.0, 2.0 / 3.0, ["0.729167", "0.8513"])]
    {
        let given = [("nx", 127.0), ("ny", 120.0), ("tail", tail), ("length", length)];
        let (outcome, figures, _) = solved("AUTO", "dam", &given, true)?;
        outcome.ok()?;
        let ours = format!("{:.6}", figures[0].1);
        let agree = figures[1].1.abs() < 1e-8;
        compare(&format!("dam 1 × {length:.3}, discharge"), published[0], &ours, agree)?;
        let agree = (figures[2].1 - published[1].parse::<f64>()?).abs() < 1.0 / 120.0;
        let ours = format!("{:.4}", figures[2].1);
        compare("    height of the water in the middle", published[1], &ours, agree)?;
    }
    // For spot 36 and strike 40. The grids converge to the published price: the limit is judged.
    let mut prices = vec![];
    for m in [16, 32, 64] {
        let steps = m * m / 4;
        let given = [("m", m.into()), ("steps", steps.into())];
        prices.push(40.0 * figure("american-put", &given, 0)?);
        let ours = format!("{:.6}", prices[prices.len() - 1]);
        compare(&format!("American put, m = {m}, {steps} steps"), "4.48667344", &ours, true)?;
    }
    let limit = prices[2] + (prices[2] - prices[1]) / 3.0;
    let agree = (limit - 4.48667344).abs() < 5e-5;
    compare("American put, extrapolated", "4.48667344", &format!("{limit:.6}"), agree)
}

/// A scene on some grids: what is printed, where # is m and @ what the scene has for ny; its name,
/// its numbers for m, and the grids.
type Counted = (&'static str, &'static str, fn(f64) -> Vec<(&'static str, f64)>, &'static [f64]);

#[rustfmt::skip] // a table
const COUNTED: [Counted; 15] = [
    ("example1 generic, m = #", "example1", |m| vec![("m", m), ("solution", 1.0)], &[32.0, 64.0]),
    ("disc-lcp, m = #", "disc-lcp", |m| vec![("m", m)], &[31.0, 63.0]),
    ("disc-hlcp, m = #", "disc-hlcp", |m| vec![("m", m)], &[31.0, 63.0]),
    ("slider, # cells", "slider", |m| vec![("m", m)], &[50.0, 100.0]),
    ("journal bearing, # × @", "journal-bearing", |m| vec![("nx", m), ("ny", m)], &[31.0, 63.0]),
    ("obstacle, # × #", "obstacle", |m| vec![("m", m)], &[33.0, 65.0]),
    ("spiral, # × #", "spiral", |m| vec![("m", m)], &[31.0, 63.0]),
    ("bessel, # × #", "bessel", |m| vec![("m", m)], &[31.0, 63.0]),
    ("dam, # × @", "dam", |m| vec![("nx", m), ("ny", m + 1.0)], &[31.0, 63.0]),
    ("bearing2d widest, L/D 1, # × @", "bearing2d", |m| bearing(m, 1.0, 0.0), &[31.0, 63.0, 127.0]),
    ("bearing2d 218°, L/D 1, # × @", "bearing2d", |m| bearing(m, 1.0, 3.8), &[31.0, 63.0, 127.0]),
    ("bearing2d widest, L/D 0.25, # × @", "bearing2d", |m| bearing(m, 0.25, 0.0), &[31.0, 63.0, 127.0]),
    ("bearing2d 218°, L/D ∞, # × 1", "bearing2d",
        |m| [bearing(m, 1e6, 3.8), vec![("ny", 1.0)]].concat(), &[47.0, 95.0]),
    ("put, m = steps = #, warm", "american-put", |m| vec![("m", m), ("steps", m)], &[32.0, 64.0]),
    ("put, m = steps = #, cold", "american-put", |m| vec![("m", m), ("steps", m)], &[32.0, 64.0]),
];

fn bearing(nx: f64, aspect: f64, groove: f64) -> Vec<(&'static str, f64)> {
    let ny = ((nx - 1.0) / 2.0).floor();
    vec![("nx", nx), ("ny", ny), ("aspect", aspect), ("groove", groove.to_degrees())]
}

/// Prints lines of counts; in parentheses the residual where the iterations ran out.
fn counts(printed: &mut Printed, quick: bool) -> Fallible<()> {
    for (words, scene, numbers, sizes) in COUNTED {
        for &m in if quick { &sizes[..1] } else { sizes } {
            let given = numbers(m);
            let ny = given.iter().find(|(name, _)| *name == "ny").map_or(m, |(_, ny)| *ny);
            let what = words.replace('#', &m.to_string()).replace('@', &ny.to_string());
            let (mut cells, mut order) = (String::new(), 0);
            for method in METHODS {
                let (outcome, _, n) = solved(method, scene, &given, !words.ends_with("cold"))?;
                let cell = match outcome.status {
                    Status::Converged => outcome.iterations.to_string(),
                    Status::Diverged(_) => "diverges".to_owned(),
                    _ => format!("({:.0e})", outcome.residual.l2),
                };
                cells += &format!(" {cell:>8}");
                order = n;
            }
            printed.line(format_args!("{what:<36} {order:>5}{cells}"))?;
        }
    }
    Ok(())
}
