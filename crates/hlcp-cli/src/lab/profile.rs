//! Dolan and Moré's performance profile: on which share of the problems a method is within a factor
//! of the best one.

use std::path::Path;

use indicatif::ProgressBar;

use super::{
    methods::Row,
    run::{Fallible, Repeats, Run, measure},
    speed_vs_accuracy::{Given, half_steps, limits},
    table::Table,
};
use crate::chart::{Panel, Point, Series, write};

const TOLERANCE: f64 = 1e-8;
/// The largest factor drawn, as a power of two.
const DOUBLINGS: f64 = 10.0;

/// Both examples with four pairs of shifts and two solutions, four sliders and four discs: 24
/// problems.
fn problems(quick: bool) -> Vec<Given> {
    let (m, cells, discs) =
        if quick { (16, [8, 10, 12, 16], [8, 12]) } else { (128, [25, 50, 75, 100], [48, 96]) };
    let mut problems = vec![];
    for symmetric in [true, false] {
        for shifts in [[0.0, 0.0], [1.0, 1.0], [4.0, 4.0], [0.0, 4.0]] {
            problems
                .extend([true, false].map(|generic| Given::example(symmetric, m, shifts, generic)));
        }
    }
    problems.extend(cells.map(|cells| Given::plain("slider", cells)));
    for m in discs {
        problems.extend(["disc-lcp", "disc-hlcp"].map(|name| Given::plain(name, m)));
    }
    problems
}

/// Draws the profile by seconds and by half-steps.
pub(crate) fn draw(
    out: &Path,
    file: &str,
    methods: &[&Row],
    quick: bool,
    bar: &ProgressBar,
    provenance: &str,
) -> Fallible<()> {
    let problems = problems(quick);
    let repeats = if quick { 1 } else { 3 };
    bar.inc_length((problems.len() * methods.len()) as u64);
    // [by seconds, by half-steps] of each method on each problem; infinite where it fails.
    let mut costs = vec![];
    let mut table = Table::new("problem | series | seconds | half-steps");
    for problem in &problems {
        let scene = problem.pose()?;
        let limits = limits(TOLERANCE);
        let runs = measure(Repeats::least(repeats), methods, |row| row.solve(&scene, &limits))?;
        let cost = |(row, run): (&&Row, Option<_>)| {
            let [mut seconds, mut sweeps] = [f64::INFINITY; 2];
            if let Some(run) = run.filter(Run::converged) {
                seconds = run.quartile(0);
                sweeps = half_steps(&run).map_or(sweeps, |sweeps| sweeps.max(1) as f64);
            }
            table.row(&format!("{}|{}|{seconds}|{sweeps}", problem.title, row.label));
            [seconds, sweeps]
        };
        costs.push(methods.iter().zip(runs).map(cost).collect::<Vec<_>>());
        bar.inc(methods.len() as u64);
    }
    let panel = |title: &str, measure: usize| {
        let best = |of_problem: &Vec<[f64; 2]>| {
            of_problem.iter().map(|cost| cost[measure]).fold(f64::INFINITY, f64::min)
        };
        let series = methods.iter().enumerate().map(|(k, row)| {
            let ratios = costs.iter().map(|of_problem| of_problem[k][measure] / best(of_problem));
            let mut doublings: Vec<f64> =
                ratios.map(f64::log2).filter(|&d| d <= DOUBLINGS).collect();
            doublings.sort_by(f64::total_cmp);
            let share = |solved: usize| solved as f64 / costs.len() as f64;
            let points = doublings.iter().zip(1..).map(|(&x, solved)| Point::at(x, share(solved)));
            Series { name: row.label.to_owned(), style: row.style, points: points.collect() }
        });
        let series: Vec<_> = series.filter(|series| !series.points.is_empty()).collect();
        let axes = ["log₂ of the factor over the best method", "share of problems solved"];
        Panel::steps(title, axes, [(0.0, DOUBLINGS), (0.0, 1.0)], &series)
    };
    let caption = format!(
        "{} problems to ‖A z − B r + q‖₂ ≤ 10⁻⁸ ‖q‖₂, the fastest of {repeats} runs\n{provenance}",
        problems.len()
    );
    let panels = vec![panel("by seconds", 0), panel("by half-steps", 1)];
    write(&out.join(file), 2, panels, &caption)?;
    table.write_csv(&out.join(file))
}
