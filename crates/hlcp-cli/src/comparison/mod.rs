//! `hlcp comparison`: every method on every scene over a ladder of grids: iterations, sweeps,
//! seconds, true error and certified bound.
//!
//! Draws cost against n on logarithmic axes and writes everything as CSV to `docs/charts`, and as
//! tables with fitted slopes to `docs/results/comparison.md`; `docs/results.md` reads them.
//! Takes some minutes. Ends with an error if a method that reports convergence is further from the
//! solution than is certified, or if a method has no point on a scene that it applies to.

mod problem;
mod table;

use std::{error::Error, path::PathBuf, time::Duration};

use clap::Args;
use hlcp::files::printable;
use hlcp_methods::Status;
use problem::METHODS;
use problem::{Reference, Run};
use table::{Row, series, write_all, write_tables};

use crate::{
    Charts,
    chart::{Panel, Point, Series, assert_styled, provenance, write},
    print,
    progress::counting,
    scenes::{Ladder, SCENES, Scene},
};

const EXAMPLES: &str = "\
Examples:
  hlcp comparison --quick
  hlcp comparison --out target/charts --tables target/results";

/// Compare every method on every scene over a ladder of grids
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(flatten)]
    charts: Charts,
    /// The folder for the tables
    #[arg(
        long,
        default_value = "docs/results",
        default_value_if("quick", "true", "target/results")
    )]
    tables: PathBuf,
}

/// The longest solve that is waited for.
const LONGEST: Duration = Duration::from_secs(6);

/// The charts.
const FAMILIES: [&str; 3] = ["discs", "examples", "applications"];

/// The scenes of a chart.
fn ladders(family: &str) -> impl Iterator<Item = (&'static Scene, &'static Ladder)> {
    let scenes = SCENES.iter().filter(move |scene| scene.family == family);
    scenes.flat_map(|scene| scene.ladders.iter().map(move |ladder| (scene, ladder)))
}

/// The scenes of all charts.
fn all() -> impl Iterator<Item = (&'static Scene, &'static Ladder)> {
    FAMILIES.into_iter().flat_map(ladders)
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let Arguments { charts: Charts { quick, out }, tables } = arguments;
    let sizes: &[usize] = if *quick { &[7, 15, 31] } else { &[31, 63, 127, 255, 511, 1023] };
    let repeats = if *quick { 1 } else { 3 };
    assert_styled(METHODS);
    let bar = counting(all().count() * sizes.len() * METHODS.len());
    let mut rows = vec![];
    for (scene, ladder) in all() {
        for &m in sizes {
            let problem = Reference::new(scene, ladder, m)?;
            for method in METHODS {
                bar.set_message(format!("{}, m = {m}, {method}", ladder.title));
                rows.extend(measured(&rows, &problem, m, method, repeats)?);
                bar.inc(1);
            }
        }
    }
    bar.finish_and_clear();

    let flags = if *quick { " --quick" } else { "" };
    let command = format!("cargo run --release -- comparison{flags}");
    let rules = format!(
        "From x⁰ = e to ‖A z − B r + q‖₂ ≤ 10⁻¹⁰ (slider: 10⁻¹⁰ ‖q‖₂), in double precision on one thread; seconds with allocation and coarse operators, \
         median of {repeats} solves or more. –: longer than {} s.",
        LONGEST.as_secs()
    );
    for family in FAMILIES {
        let panels = ladders(family).flat_map(|(_, Ladder { title, .. })| {
            [panel(&rows, title, "seconds", Run::seconds), panel(&rows, title, "sweeps", sweeps)]
        });
        let caption = rules.replacen("; ", ";\n", 1) + "\n" + &provenance(&command);
        write(&out.join(format!("comparison-{family}")), 2, panels.collect(), &caption)?;
    }
    write_all(&out.join("comparison"), &rows)?;
    let legend = "Slope: the exponent of n, by least squares over the upper half of the sizes, three at the least. The error is the largest of a component of (z, r), against the\n\
        planted solution or one at the floor of rounding; ≤ what `hlcp_verify::certify` proves of it, up to n = 70,000.";
    write_tables(tables, &rows, sizes, &format!("{rules}\n{legend}"), &command)?;
    check(&rows)?;
    print::line(format_args!(
        "wrote {} rows to {} and {}",
        rows.len(),
        printable(out.display()),
        printable(tables.display())
    ))?;
    Ok(())
}

/// One method on one problem, unless it is expected to take too long; nothing where the method does
/// not take such operators.
fn measured(
    rows: &[Row],
    problem: &Reference,
    m: usize,
    method: &'static str,
    repeats: usize,
) -> Result<Option<Row>, Box<dyn Error>> {
    let (title, n) = (problem.ladder.title, problem.given.q.len());
    let mut row = Row { title, m, n, method, run: None };
    if expected(rows, title, method) <= LONGEST.as_secs_f64() {
        row.run = problem.solve(method, repeats, LONGEST)?;
        if row.run.is_none() {
            return Ok(None);
        }
    }
    if let Some(Run { error, bound: Some(bound), .. }) = row.converged()
        && error > bound
    {
        let at = format!("{method} on {title}, m = {m}");
        return Err(format!("{at}: the error {error:e} exceeds {bound:e}").into());
    }
    Ok(Some(row))
}

/// The seconds that the next size should take, to go by the last two.
fn expected(rows: &[Row], title: &str, method: &str) -> f64 {
    let before: Vec<f64> = series(rows, title, method)
        .map(|row| match &row.run {
            Some(run) if run.status != Status::TimeLimit => run.seconds(),
            _ => f64::INFINITY,
        })
        .collect();
    match before[..] {
        [.., before, last] if last.is_finite() => last * (last / before).max(1.0),
        [last] => last,
        [] => 0.0,
        _ => f64::INFINITY,
    }
}

fn sweeps(run: &Run) -> f64 {
    run.sweeps.max(1) as f64
}

/// Cost against n, with lines of slope 1 and 2 to hold it against.
fn panel(rows: &[Row], title: &str, what: &str, cost: impl Fn(&Run) -> f64) -> Panel {
    let all: Vec<Series> = METHODS
        .iter()
        .map(|&method| {
            let point = |row: &Row| {
                let y = cost(row.converged()?);
                Some(Point { x: row.n as f64, y, spread: None, reached: true })
            };
            Series::new(method, 0, series(rows, title, method).filter_map(point).collect())
        })
        .filter(|series: &Series| !series.points.is_empty())
        .collect();
    let points = || all.iter().flat_map(|series| &series.points);
    let least = |of: fn(&Point) -> f64| points().map(of).fold(f64::MAX, f64::min).log10().floor();
    let most = |of: fn(&Point) -> f64| points().map(of).fold(f64::MIN, f64::max).log10().ceil();
    let [x, y] = [least(|p| p.x), least(|p| p.y)];
    let [right, top] = [most(|p| p.x), most(|p| p.y)];
    let line = |slope: f64| {
        let width = (right - x).min((top - y) / slope);
        [(x, y), (x + width, y + slope * width)]
    };
    Panel::log_log(title, ["n", what], &all).outline("∝ n", "grey", "3 3", &line(1.0)).outline(
        "∝ n²",
        "grey",
        "9 4",
        &line(2.0),
    )
}

/// Refuses a method that has no point on a scene it applies to.
fn check(rows: &[Row]) -> Result<(), Box<dyn Error>> {
    for (_, Ladder { title, .. }) in all() {
        for method in METHODS {
            let mut of_method = series(rows, title, method).peekable();
            if of_method.peek().is_some() && of_method.all(|row| row.converged().is_none()) {
                return Err(format!("{method} has no point on {title}").into());
            }
        }
    }
    Ok(())
}
