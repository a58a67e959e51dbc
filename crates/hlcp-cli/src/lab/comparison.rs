//! `hlcp comparison`: methods on every scene but `film` over a ladder of grids: iterations, sweeps,
//! seconds, true error and certified bound.
//!
//! Draws seconds against n on logarithmic axes, on one scene as `cost` and on all as `comparison`,
//! from the CSV file beside the charts, and writes tables with fitted slopes to
//! `docs/results/comparison.md`; `docs/results.md` reads them. Takes some minutes. Ends with an
//! error if a method that reports convergence is further from the solution than is certified, or if
//! a method has no point on a scene that it applies to.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use clap::Args;
use hlcp::files::printable;
use hlcp_methods::{Limits, Outcome, Status, TridiagonalPart};
use hlcp_verify::decimal;

use super::{
    Charts,
    methods::{Chart, methods, tuned},
    run::{Judged, Repeats, Run, measure, solve},
    table::Table,
};
use crate::{
    Fallible,
    chart::{Panel, Series, machine, save, write},
    print,
    progress::counting,
    scenes::{Ladder, SCENES, Scene, where_it_applies},
};

const EXAMPLES: &str = "\
Examples:
  hlcp comparison --quick
  hlcp comparison --out target/charts --tables target/results";

/// Compare methods on every scene but film over a ladder of grids
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(flatten)]
    charts: Charts,
    /// The folder for the tables
    #[arg(long, default_value = "docs/results")]
    #[arg(default_value_if("quick", "true", "target/results"))]
    tables: PathBuf,
}

/// The longest solve that is waited for.
const LONGEST: Duration = Duration::from_secs(6);

/// The scene of the first chart.
const FIRST: &str = "disc-hlcp";

fn all() -> impl Iterator<Item = (&'static Scene, &'static Ladder)> {
    let scenes = SCENES.iter();
    scenes.flat_map(|scene| scene.ladders.iter().map(move |ladder| (scene, ladder)))
}

/// One method on one scene of one size.
struct Row {
    title: &'static str,
    m: usize,
    n: usize,
    method: &'static str,
    /// Nothing where a solve was expected to take too long.
    run: Option<Run>,
    /// The largest error of a component of (z, r).
    error: f64,
    /// What is proved of it: of the answer, and of what it is compared with.
    bound: Option<f64>,
}

impl Row {
    fn converged(&self) -> Option<&Run> {
        self.run.as_ref().filter(|run| run.converged())
    }
}

/// The words of a run in a table.
type Cell = fn(&Row, &Run) -> String;

/// The largest order that answers are certified for.
const CERTIFIED: usize = 70_000;

pub(crate) fn run(arguments: &Arguments) -> Fallible<()> {
    let Arguments { charts, tables } = arguments;
    let Charts { quick, out, .. } = charts;
    let repeats = if *quick { 1 } else { 3 };
    let rules = format!(
        "From x⁰ = e to ‖A z − B r + q‖₂ ≤ 10⁻¹⁰ (slider and dam: 10⁻¹⁰ ‖q‖₂), in double precision on one thread; seconds with allocation and coarse operators, \
         median of {repeats} solves or more."
    );
    let measured =
        charts.measured("comparison", || measure_all(*quick, repeats, &rules, out, tables))?;
    draw(out, &rules, &measured)?;
    print::line(format_args!("wrote the charts to {}", printable(out.display())))?;
    Ok(())
}

/// Measures every method on every ladder, and writes the data and the tables.
fn measure_all(
    quick: bool,
    repeats: usize,
    rules: &str,
    out: &Path,
    tables: &Path,
) -> Fallible<()> {
    let sizes: &[usize] = if quick { &[7, 15, 31] } else { &[31, 63, 127, 255, 511, 1023] };
    let names: Vec<_> = methods(Chart::Comparison).iter().map(|row| row.name).collect();
    let bar = counting(all().count() * sizes.len() * names.len());
    let mut rows: Vec<Row> = vec![];
    for (scene, ladder) in all() {
        for &m in sizes {
            bar.set_message(format!("{}, m = {m}", ladder.title));
            let of_size = measured(&rows, scene, ladder, m, &names, repeats)?;
            rows.extend(of_size);
            bar.inc(names.len() as u64);
        }
    }
    bar.finish_and_clear();
    data(&rows).write_csv(&out.join("comparison"))?;
    let flags = if quick { " --quick" } else { "" };
    let command = format!("cargo run --release -- comparison{flags}");
    let mut text = format!(
        "# Methods on every scene but film\n\nWritten by `{command}` ({}); [../results.md](../results.md#cost-against-n) reads it.\n{rules} –: longer than {} s.\n\
         Slope: the exponent of n, by least squares over the upper half of the sizes, three at the least. The error is the largest of a component of (z, r), against the\n\
         planted solution or one at the floor of rounding; ≤ what `hlcp_verify::certify` proves of it, up to n = 70,000.\n",
        machine(),
        LONGEST.as_secs()
    );
    for (_, &Ladder { title, size, .. }) in all() {
        text += &format!("\n## {title}\n\n{size}.\n");
        let table = |what, cell: Cell, cost| by_size(&rows, (title, sizes), what, cell, cost);
        text += &table("seconds", |_, run| duration(run.median()), Some(Run::median));
        let counts: Cell = |_, run| format!("{} ({})", run.outcome.iterations, run.outcome.sweeps);
        text += &table("iterations (sweeps)", counts, Some(|run| run.outcome.sweeps as f64));
        let errors: Cell = |row, _| match row.bound {
            Some(bound) => format!("{:.0e} ≤ {}", row.error, decimal(bound, 0, true)),
            None => format!("{:.0e}", row.error),
        };
        text += &table("true error ≤ certified", errors, None);
    }
    save(&tables.join("comparison.md"), &text)?;
    for (_, Ladder { title, .. }) in all() {
        for method in &names {
            let mut of_method = series(&rows, title, method).peekable();
            if of_method.peek().is_some() && of_method.all(|row| row.converged().is_none()) {
                return Err(format!("{method} has no point on {title}").into());
            }
        }
    }
    print::line(format_args!("wrote {} rows to {}", rows.len(), printable(tables.display())))?;
    Ok(())
}

fn draw(out: &Path, rules: &str, measured: &str) -> Fallible<()> {
    let path = out.join("comparison");
    let rows = Table::rows_of(&path.with_extension("csv"), COLUMNS)?;
    let lines = |title: &str, chart| -> Fallible<Vec<Series>> {
        let mut lines = vec![];
        for method in methods(chart) {
            let mut points = vec![];
            for (_, row) in &rows {
                let [scene, _, n, name, status, _, _, _, median, _, _, _] = row;
                if scene == title && name == method.name && status == "converged" {
                    points.push((n.parse()?, median.parse()?));
                }
            }
            if !points.is_empty() {
                let name = method.name.to_owned();
                lines.push(Series { name, style: method.style, points });
            }
        }
        Ok(lines)
    };
    let first = lines(FIRST, Chart::Growth)?;
    let axes = ["unknowns n", "seconds of a solve"];
    let note = |series: &Series| {
        let logs: Vec<_> = series.points.iter().map(|(x, y)| [x.ln(), y.ln()]).collect();
        slope(&logs).map_or(String::new(), |slope| format!(" ∝ n^{slope:.2}"))
    };
    let panel = Panel::log_log(FIRST, axes, &first).with_names_at_ends(&first, note);
    let caption = format!("{rules} Exponents over the upper half of the sizes.\n{measured}");
    write(&out.join("cost"), 1, 400.0, vec![panel], &caption)?;
    let mut panels = vec![];
    for (k, (_, Ladder { title, .. })) in all().enumerate() {
        let y = if k % 4 == 0 { "seconds" } else { "" };
        panels.push(Panel::log_log(title, ["n", y], &lines(title, Chart::Comparison)?));
    }
    write(&path, 4, 220.0, panels, &format!("{rules}\n{measured}"))
}

/// Measures the methods on one size of a scene, apart from those that are expected to take too long
/// and those that do not take such operators.
fn measured(
    rows: &[Row],
    scene: &Scene,
    ladder: &'static Ladder,
    m: usize,
    names: &[&'static str],
    repeats: usize,
) -> Fallible<Vec<Row>> {
    let (title, longest) = (ladder.title, LONGEST.as_secs_f64());
    let is_late = |name: &str| expected(rows, title, name) > longest;
    let problem = scene.pose(&(ladder.numbers)(m as f64))?;
    let n = problem.q.len();
    let reference = match scene.name {
        _ if TridiagonalPart::is_all(&problem.hlcp(1.0)?) => "NEWTON",
        // Where no coarse correction pays.
        "spiral" | "dam" => "AMG",
        _ => "MGW",
    };
    let judged = Judged::new(problem, reference, &scene.limits(), n <= CERTIFIED)?;
    let limits = Limits { iterations: usize::MAX, time: Some(LONGEST), ..scene.limits() };
    let sum = if repeats > 1 { 0.05 } else { 0.0 };
    let runs = measure(Repeats { sum, longest, least: repeats }, names, |name| {
        if is_late(name) {
            return Ok(None);
        }
        let [alpha, tau] = if *name == "AMSOR" { (ladder.amsor)(m as f64) } else { [1.0; 2] };
        let method = tuned(name, [alpha; 2])?;
        Ok(where_it_applies(solve(&judged.problem, &method, tau, &limits))?)
    })?;
    let mut of_size = vec![];
    for (&method, run) in names.iter().zip(runs) {
        if run.is_none() && !is_late(method) {
            continue;
        }
        let error = run.as_ref().map_or(f64::NAN, |run| judged.error(&run.answer));
        let bound = match (&run, judged.doubt) {
            (Some(run), Some(doubt)) if run.converged() => Some(judged.bound(&run.answer)? + doubt),
            _ => None,
        };
        if let Some(bound) = bound.filter(|&bound| error > bound) {
            let at = format!("{method} on {title}, m = {m}");
            return Err(format!("{at}: the error {error:e} exceeds {bound:e}").into());
        }
        of_size.push(Row { title, m, n, method, run, error, bound });
    }
    Ok(of_size)
}

/// Returns the seconds that the next size should take, to go by the last two.
fn expected(rows: &[Row], title: &str, method: &str) -> f64 {
    let before: Vec<f64> = series(rows, title, method)
        .map(|row| match &row.run {
            Some(run) if run.outcome.status != Status::TimeLimit => run.median(),
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

/// Returns the rows of one method on one scene, from small to large.
fn series<'r>(rows: &'r [Row], title: &str, method: &str) -> impl Iterator<Item = &'r Row> {
    rows.iter().filter(move |row| row.title == title && row.method == method)
}

const COLUMNS: &str = "scene|m|n|method|status|iterations|sweeps|seconds min|seconds median|\
                       seconds max|true error|certified bound";

fn data(rows: &[Row]) -> Table {
    let mut table = Table::new(COLUMNS);
    for Row { title, m, n, method, run, error, bound } in rows {
        let begin = format!("{title}|{m}|{n}|{method}");
        let Some(run) = run else {
            table.row(&format!("{begin}|too long|||||||"));
            continue;
        };
        let [low, median, high] = [0, 2, 4].map(|k| run.quartile(k));
        let Outcome { status, iterations, sweeps, .. } = run.outcome;
        let bound = bound.map_or(String::new(), |bound| format!("{bound:e}"));
        table.row(&format!(
            "{begin}|{status}|{iterations}|{sweeps}|{low:.6}|{median:.6}|{high:.6}|{error:e}|{bound}"
        ));
    }
    table
}

/// Returns the slope of pairs of logarithms, by least squares over their upper half, three at the
/// least.
fn slope(logs: &[[f64; 2]]) -> Option<f64> {
    let upper = logs.len().div_ceil(2).max(3);
    let logs = &logs[logs.len().checked_sub(upper)?..];
    let mean = |k: usize| logs.iter().map(|log| log[k]).sum::<f64>() / logs.len() as f64;
    let means = [mean(0), mean(1)];
    let product = |k: usize| -> f64 {
        logs.iter().map(|log| (log[0] - means[0]) * (log[k] - means[k])).sum()
    };
    Some(product(1) / product(0))
}

/// Returns a table with a row a method, a column a size, and the slope of a cost last.
fn by_size(
    rows: &[Row],
    (title, sizes): (&str, &[usize]),
    what: &str,
    cell: Cell,
    cost: Option<fn(&Run) -> f64>,
) -> String {
    let sizes_of: String = sizes.iter().map(|m| format!("|m = {m}")).collect();
    let mut table = Table::new(&format!("{what}{sizes_of}{}", cost.map_or("", |_| "|slope")));
    for method in methods(Chart::Comparison) {
        let of_method = || series(rows, title, method.name);
        if of_method().next().is_none() {
            continue;
        }
        let mut line = method.name.to_owned();
        for &m in sizes {
            let row = of_method().find(|row| row.m == m);
            let words = match row.and_then(|row| Some((row, row.run.as_ref()?))) {
                Some((row, run)) if run.converged() => cell(row, run),
                Some((_, run)) if run.outcome.status != Status::TimeLimit => {
                    run.outcome.status.to_string()
                }
                _ => "–".to_owned(),
            };
            line += &format!("|{words}");
        }
        if let Some(cost) = cost {
            let log =
                |row: &Row| Some([(row.n as f64).ln(), cost(row.converged()?).max(1e-9).ln()]);
            let slope = slope(&of_method().filter_map(log).collect::<Vec<_>>());
            line += &slope.map_or("|".to_owned(), |slope| format!("|{slope:.2}"));
        }
        table.row(&line);
    }
    format!("\n{}", table.markdown())
}

/// Returns three digits and no exponent.
fn duration(seconds: f64) -> String {
    let decimals = (2 - seconds.log10().floor() as i32).clamp(0, 6) as usize;
    format!("{seconds:.decimals$}")
}
