//! Dolan and Moré's performance profile: on which share of the problems a method is within a factor
//! of the best one.

use std::path::Path;

use indicatif::ProgressBar;

use super::{
    methods::Row,
    own::Own,
    run::{self, Repeats, Run},
    speed_vs_accuracy::{example, half_steps, limits, plain, pose},
    table::Table,
};
use crate::{
    Fallible,
    chart::{Panel, Series, write},
};

const TOLERANCE: f64 = 1e-8;
/// The largest factor drawn, as a power of two.
const DOUBLINGS: f64 = 10.0;

/// Both examples with four pairs of shifts and two solutions, four sliders and four discs: 24
/// problems.
fn problems(quick: bool) -> Vec<Own> {
    let (m, cells, discs) =
        if quick { (16, [8, 10, 12, 16], [8, 12]) } else { (128, [25, 50, 75, 100], [48, 96]) };
    let mut problems = vec![];
    for symmetric in [true, false] {
        for shifts in [[0.0, 0.0], [1.0, 1.0], [4.0, 4.0], [0.0, 4.0]] {
            problems.extend([true, false].map(|generic| example(symmetric, m, shifts, generic)));
        }
    }
    problems.extend(cells.map(|cells| plain("slider", cells)));
    for m in discs {
        problems.extend(["disc-lcp", "disc-hlcp"].map(|name| plain(name, m)));
    }
    problems
}

const COLUMNS: &str = "problem|series|seconds|half-steps";

pub(super) fn repeats(quick: bool) -> usize {
    if quick { 1 } else { 3 }
}

/// Measures the seconds and half-steps of each method on each problem, infinite where it fails.
pub(crate) fn measure(
    out: &Path,
    methods: &[&Row],
    quick: bool,
    bar: &ProgressBar,
) -> Fallible<()> {
    let problems = problems(quick);
    bar.inc_length((problems.len() * methods.len()) as u64);
    let mut table = Table::new(COLUMNS);
    for problem in &problems {
        let (title, scene) = (problem.title(), pose(problem)?);
        let (limits, repeats) = (limits(TOLERANCE), Repeats::least(repeats(quick)));
        let runs = run::measure(repeats, methods, |row| row.solve(&scene, &limits))?;
        for (row, run) in methods.iter().zip(runs) {
            let [mut seconds, mut sweeps] = [f64::INFINITY; 2];
            if let Some(run) = run.filter(Run::converged) {
                seconds = run.quartile(0);
                sweeps = half_steps(&run).map_or(sweeps, |sweeps| sweeps.max(1) as f64);
            }
            table.row(&format!("{title}|{}|{seconds}|{sweeps}", row.label));
        }
        bar.inc(methods.len() as u64);
    }
    table.write_csv(&out.join("profile"))
}

pub(crate) fn draw(out: &Path, methods: &[&Row], quick: bool, measured: &str) -> Fallible<()> {
    let path = out.join("profile");
    let rows = Table::rows_of(&path.with_extension("csv"), COLUMNS)?;
    let mut costs = vec![];
    for (_, [problem, series, seconds, sweeps]) in rows {
        let cost: [f64; 2] = [seconds.parse()?, sweeps.parse()?];
        costs.push((problem, series, cost));
    }
    let problems = problems(quick);
    let panel = |title: &str, measure: usize| {
        let of_method = |row: &Row, problem: &Own| {
            let of_problem = costs.iter().filter(|(of, ..)| *of == problem.title());
            let best = of_problem.clone().map(|(.., cost)| cost[measure]);
            let mut own = of_problem.filter(|(_, name, _)| name == row.label);
            let own = own.next().map_or(f64::INFINITY, |(.., cost)| cost[measure]);
            (own / best.fold(f64::INFINITY, f64::min)).log2()
        };
        let series = methods.iter().map(|row| {
            let doublings = problems.iter().map(|problem| of_method(row, problem));
            let mut doublings: Vec<f64> = doublings.filter(|&d| d <= DOUBLINGS).collect();
            doublings.sort_by(f64::total_cmp);
            let share = |solved: usize| solved as f64 / problems.len() as f64;
            let points = doublings.into_iter().zip((1..).map(share)).collect();
            Series { name: row.label.to_owned(), style: row.style, points }
        });
        let series: Vec<_> = series.filter(|series| !series.points.is_empty()).collect();
        let axes = ["log₂ of the factor over the best method", "share of problems solved"];
        Panel::steps(title, axes, [(0.0, DOUBLINGS), (0.0, 1.0)], &series)
    };
    let caption = format!(
        "{} problems to ‖A z − B r + q‖₂ ≤ 10⁻⁸ ‖q‖₂, the least of {} solves.\n{measured}",
        problems.len(),
        repeats(quick)
    );
    let panels = vec![panel("by seconds", 0), panel("by half-steps", 1)];
    write(&path, 2, 320.0, panels, &caption)
}
