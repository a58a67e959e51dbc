//! What was measured as CSV and as Markdown tables, and the slopes fitted to it.

use std::{error::Error, fmt::Write as _, path::Path};

use hlcp_methods::Status;
use hlcp_verify::decimal;

use super::{
    all,
    problem::{METHODS, Run},
};
use crate::{
    chart::{provenance, save, write_csv},
    scenes::Ladder,
};

/// One method on one scene of one size.
pub(crate) struct Row {
    pub(crate) title: &'static str,
    pub(crate) m: usize,
    pub(crate) n: usize,
    pub(crate) method: &'static str,
    /// Nothing where a solve was expected to take too long.
    pub(crate) run: Option<Run>,
}

impl Row {
    fn status(&self) -> String {
        self.run.as_ref().map_or("too long".to_owned(), |run| run.status.to_string())
    }

    pub(crate) fn converged(&self) -> Option<&Run> {
        self.run.as_ref().filter(|run| run.converged())
    }
}

/// The rows of one method on one scene, from small to large.
pub(crate) fn series<'r>(
    rows: &'r [Row],
    title: &str,
    method: &str,
) -> impl Iterator<Item = &'r Row> {
    rows.iter().filter(move |row| row.title == title && row.method == method)
}

/// The exponent of n in `cost`, by least squares over the upper half of the sizes that converged,
/// three at the least.
pub(crate) fn slope<'r>(
    rows: impl Iterator<Item = &'r Row>,
    cost: impl Fn(&Run) -> f64,
) -> Option<f64> {
    let logs: Vec<[f64; 2]> = rows
        .filter_map(|row| Some([(row.n as f64).ln(), cost(row.converged()?).max(1e-9).ln()]))
        .collect();
    let upper = logs.len().div_ceil(2).max(3);
    let logs = &logs[logs.len().checked_sub(upper)?..];
    let mean = |k: usize| logs.iter().map(|log| log[k]).sum::<f64>() / logs.len() as f64;
    let means = [mean(0), mean(1)];
    let product = |k: usize| -> f64 {
        logs.iter().map(|log| (log[0] - means[0]) * (log[k] - means[k])).sum()
    };
    Some(product(1) / product(0))
}

/// Writes everything as `path`.csv.
pub(crate) fn write_all(path: &Path, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let header = "scene,m,n,method,status,iterations,sweeps,seconds min,seconds median,seconds max,true error,certified bound";
    let line = |row: &Row| {
        let Row { title, m, n, method, run } = row;
        let begin = format!("\"{title}\",{m},{n},{method},{}", row.status());
        let Some(run) = run else { return format!("{begin},,,,,,,") };
        let bound = run.bound.map_or(String::new(), |bound| format!("{bound:e}"));
        let [low, high] = [run.seconds[0], run.seconds[run.seconds.len() - 1]];
        format!(
            "{begin},{},{},{low:.6},{:.6},{high:.6},{:e},{bound}",
            run.iterations,
            run.sweeps,
            run.seconds(),
            run.error
        )
    };
    write_csv(path, header, &rows.iter().map(line).collect::<Vec<_>>())
}

/// Three tables a scene: seconds, iterations and sweeps, errors.
pub(crate) fn write_tables(
    folder: &Path,
    rows: &[Row],
    sizes: &[usize],
    rules: &str,
    command: &str,
) -> Result<(), Box<dyn Error>> {
    let mut text = format!(
        "# Every method on every scene\n\nWritten by `{command}` ({}); [../results.md](../results.md#cost-against-n) reads it.\n{rules}\n",
        provenance("").trim_start_matches([' ', '·'])
    );
    for (_, &Ladder { title, size, .. }) in all() {
        write!(text, "\n## {title}\n\n{size}.\n")?;
        let seconds = |run: &Run| duration(run.seconds());
        let slope_of = |cost: fn(&Run) -> f64| {
            move |method: &str| {
                slope(series(rows, title, method), cost)
                    .map_or(String::new(), |slope| format!("{slope:.2}"))
            }
        };
        let by_seconds = slope_of(Run::seconds);
        table(&mut text, (rows, title, sizes), "seconds", seconds, Some(&by_seconds))?;
        let counts = |run: &Run| format!("{} ({})", run.iterations, run.sweeps);
        let by_sweeps = slope_of(|run| run.sweeps as f64);
        let what = "iterations (sweeps)";
        table(&mut text, (rows, title, sizes), what, counts, Some(&by_sweeps))?;
        let errors = |run: &Run| match run.bound {
            Some(bound) => format!("{:.0e} ≤ {}", run.error, decimal(bound, 0, true)),
            None => format!("{:.0e}", run.error),
        };
        table(&mut text, (rows, title, sizes), "true error ≤ certified", errors, None)?;
    }
    save(&folder.join("comparison.md"), &text)
}

/// A line a method, a column a size, and the slope last.
fn table(
    text: &mut String,
    (rows, title, sizes): (&[Row], &str, &[usize]),
    what: &str,
    cell: impl Fn(&Run) -> String,
    slope: Option<&dyn Fn(&str) -> String>,
) -> Result<(), std::fmt::Error> {
    let heads: Vec<String> = sizes.iter().map(|m| format!("m = {m}")).collect();
    write!(text, "\n| {what} | {} |", heads.join(" | "))?;
    write!(text, "{}\n|---|", if slope.is_some() { " slope |" } else { "" })?;
    writeln!(text, "{}", "---|".repeat(sizes.len() + usize::from(slope.is_some())))?;
    for method in METHODS {
        if series(rows, title, method).next().is_none() {
            continue;
        }
        write!(text, "| {method} |")?;
        for &m in sizes {
            let row = series(rows, title, method).find(|row| row.m == m);
            let words = match row.and_then(|row| row.run.as_ref()) {
                Some(run) if run.converged() => cell(run),
                Some(run) if run.status != Status::TimeLimit => run.status.to_string(),
                _ => "–".to_owned(),
            };
            write!(text, " {words} |")?;
        }
        writeln!(text, "{}", slope.map_or(String::new(), |slope| format!(" {} |", slope(method))))?;
    }
    Ok(())
}

/// Three digits and no exponent.
fn duration(seconds: f64) -> String {
    let decimals = (2 - seconds.log10().floor() as i32).clamp(0, 6) as usize;
    format!("{seconds:.decimals$}")
}
