//! Every method on every scene over a ladder of grids: iterations, sweeps, seconds, true error and certified bound.
//!
//! ```text
//! cargo run --release --example comparison
//! cargo run --release --example comparison -- --quick    # small ones, to target/
//! ```
//!
//! Draws cost against n on logarithmic axes and writes everything as CSV to `docs/charts`, and as tables with fitted
//! slopes to `docs/results/comparison.md`; `docs/comparison.md` reads them. Takes some minutes. Ends with an error if a
//! method that reports convergence is further from the solution than is certified, or if a method has no point on a
//! scene that it applies to.

#[path = "../chart/mod.rs"]
mod chart;
mod methods;
#[path = "../print/mod.rs"]
mod print;
mod scenes;
mod table;

use std::{error::Error, path::PathBuf, time::Duration};

use chart::{Panel, Point, Series, provenance, write};
use clap::Parser;
use hlcp_core::{Rows, files::printable};
use hlcp_methods::Status;
use indicatif::{ProgressBar, ProgressStyle};
use methods::{METHODS, Run, solve};
use scenes::{FAMILIES, Problem, Scene, Visit};
use table::{Row, series, write_all, write_tables};

/// Compare the methods.
#[derive(Debug, Parser)]
struct Arguments {
    /// Small problems, and one solve each
    #[arg(long)]
    quick: bool,
    /// The folder for the charts and their data
    #[arg(long, default_value = "docs/charts", default_value_if("quick", "true", "target/charts"))]
    out: PathBuf,
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

/// What is measured how.
struct Comparison {
    repeats: usize,
    rows: Vec<Row>,
    bar: ProgressBar,
}

fn main() -> Result<(), Box<dyn Error>> {
    let Arguments { quick, out, tables } = Arguments::parse();
    let sizes: &[usize] = if quick { &[7, 15, 31] } else { &[31, 63, 127, 255, 511, 1023] };
    let repeats = if quick { 1 } else { 3 };
    let scenes = || FAMILIES.iter().flat_map(|(_, scenes)| *scenes);
    let cells = scenes().count() * sizes.len() * METHODS.len();
    // Hidden unless stderr is a terminal.
    let bar = ProgressBar::new(cells as u64)
        .with_style(ProgressStyle::with_template("{wide_bar} {pos}/{len} {msg} {elapsed}")?);
    let mut comparison = Comparison { repeats, rows: vec![], bar };
    for scene in scenes() {
        for &m in sizes {
            scene.pose(m, &mut comparison)?;
        }
    }
    comparison.bar.finish_and_clear();
    let rows = &comparison.rows;

    let flags = if quick { " -- --quick" } else { "" };
    let command = format!("cargo run --release --example comparison{flags}");
    let rules = format!(
        "From x⁰ = e to ‖A z − B r + q‖₂ ≤ 10⁻¹⁰ (slider: 10⁻¹⁰ ‖q‖₂), in double precision on one thread; seconds with allocation and coarse operators, \
         median of {repeats} solves or more. –: longer than {} s.",
        LONGEST.as_secs()
    );
    for (family, scenes) in FAMILIES {
        let panels = scenes.iter().flat_map(|&scene| {
            [panel(rows, scene, "seconds", Run::seconds), panel(rows, scene, "sweeps", sweeps)]
        });
        let caption = rules.replacen("; ", ";\n", 1) + "\n" + &provenance(&command);
        write(&out.join(format!("comparison-{family}")), 2, panels.collect(), &caption)?;
    }
    write_all(&out.join("comparison"), rows)?;
    let legend = "Slope: the exponent of n, by least squares over the upper half of the sizes, three at the least. The error is the largest of a component of (z, r), against the\n\
        planted solution or one at the floor of rounding; ≤ what `hlcp_verify::certify_with` proves of it, up to n = 70,000.";
    write_tables(&tables, rows, sizes, &format!("{rules}\n{legend}"), &command)?;
    check(rows)?;
    print::line(format_args!(
        "wrote {} rows to {} and {}",
        rows.len(),
        printable(out.display()),
        printable(tables.display())
    ))?;
    Ok(())
}

impl Visit for Comparison {
    /// Solves by every method that is not expected to take too long.
    fn visit<A: Rows<f64>, B: Rows<f64>>(
        &mut self,
        scene: Scene,
        m: usize,
        problem: &Problem<A, B>,
    ) -> Result<(), Box<dyn Error>> {
        let n = problem.a.order();
        let doubt = problem.certificate.as_ref().map_or(f64::NAN, |known| known.error());
        for method in METHODS {
            self.bar.set_message(format!("{}, m = {m}, {method}", scene.name()));
            let mut row = Row { scene, m, n, method, run: None };
            if expected(&self.rows, scene, method) <= LONGEST.as_secs_f64() {
                row.run = solve(method, problem, self.repeats, LONGEST)?;
                if row.run.is_none() {
                    self.bar.inc(1);
                    continue;
                }
            }
            if let Some(Run { error, bound: Some(bound), .. }) = row.converged() {
                // The judge may itself be off by as much as was proved of it.
                if *error > bound + doubt {
                    let at = format!("{} on {}, m = {m}", method, scene.name());
                    return Err(format!("{at}: the error {error:e} exceeds {bound:e}").into());
                }
            }
            self.rows.push(row);
            self.bar.inc(1);
        }
        Ok(())
    }
}

/// The seconds that the next size should take, to go by the last two.
fn expected(rows: &[Row], scene: Scene, method: &str) -> f64 {
    let before: Vec<f64> = series(rows, scene, method)
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
fn panel(rows: &[Row], scene: Scene, what: &str, cost: impl Fn(&Run) -> f64) -> Panel {
    let all: Vec<Series> = METHODS
        .iter()
        .enumerate()
        .map(|(style, &method)| {
            let point = |row: &Row| {
                let y = cost(row.converged()?);
                Some(Point { x: row.n as f64, y, spread: None, reached: true })
            };
            let points = series(rows, scene, method).filter_map(point).collect();
            Series { name: method.to_owned(), style, points }
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
    Panel::log_log(scene.name(), ["n", what], &all)
        .outline("∝ n", "grey", "3 3", &line(1.0))
        .outline("∝ n²", "grey", "9 4", &line(2.0))
}

/// Refuses a method that has no point on a scene it applies to.
fn check(rows: &[Row]) -> Result<(), Box<dyn Error>> {
    for &scene in FAMILIES.iter().flat_map(|(_, scenes)| *scenes) {
        for method in METHODS {
            let mut of_method = series(rows, scene, method).peekable();
            if of_method.peek().is_some() && of_method.all(|row| row.converged().is_none()) {
                return Err(format!("{method} has no point on {}", scene.name()).into());
            }
        }
    }
    Ok(())
}
