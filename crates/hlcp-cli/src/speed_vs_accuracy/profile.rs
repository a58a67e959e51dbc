//! Dolan and Moré's performance profile: on which share of the problems a method is within a factor
//! of the best one.

use std::{error::Error, path::Path};

use indicatif::ProgressBar;

use super::{problem::Posed, series::Series};
use crate::chart::{self, Panel, Point, write, write_csv};

const TOLERANCE: f64 = 1e-8;
/// The largest factor drawn, as a power of two.
const DOUBLINGS: f64 = 10.0;

/// Both examples with four pairs of shifts and two solutions, four sliders and four discs: 24
/// problems.
fn scenes(quick: bool) -> Vec<Posed> {
    let (m, cells, discs) =
        if quick { (16, [8, 10, 12, 16], [8, 12]) } else { (128, [25, 50, 75, 100], [48, 96]) };
    let mut scenes = vec![];
    for symmetric in [true, false] {
        for shifts in [[0.0, 0.0], [1.0, 1.0], [4.0, 4.0], [0.0, 4.0]] {
            scenes
                .extend([true, false].map(|generic| Posed::example(symmetric, m, shifts, generic)));
        }
    }
    scenes.extend(cells.map(|cells| Posed::plain("slider", cells)));
    for m in discs {
        scenes.extend(["disc-lcp", "disc-hlcp"].map(|name| Posed::plain(name, m)));
    }
    scenes
}

/// Draws the profile by seconds and by half-steps.
pub(crate) fn draw(
    out: &Path,
    file: &str,
    methods: &[Series],
    quick: bool,
    bar: &ProgressBar,
    provenance: &str,
) -> Result<(), Box<dyn Error>> {
    let scenes = scenes(quick);
    let repeats = if quick { 1 } else { 3 };
    bar.inc_length((scenes.len() * methods.len()) as u64);
    // [by seconds, by half-steps] of each method on each problem; infinite where it fails.
    let mut costs = vec![];
    let mut rows = vec![];
    for scene in &scenes {
        let problem = scene.pose()?;
        let mut of_scene = vec![];
        for (name, solve) in methods {
            let mut cost = [f64::INFINITY; 2];
            for _ in 0..repeats {
                if let Some(run) = solve.run(&problem, TOLERANCE)?.filter(|run| run.reached) {
                    let sweeps = run.sweeps.map_or(f64::INFINITY, |sweeps| sweeps.max(1) as f64);
                    cost = [cost[0].min(run.seconds), sweeps];
                }
            }
            rows.push(format!("\"{}\",\"{name}\",{},{}", scene.title, cost[0], cost[1]));
            of_scene.push(cost);
            bar.inc(1);
        }
        costs.push(of_scene);
    }
    let panel = |title: &str, measure: usize| {
        let best = |of_scene: &Vec<[f64; 2]>| {
            of_scene.iter().map(|cost| cost[measure]).fold(f64::INFINITY, f64::min)
        };
        let series: Vec<chart::Series> = methods
            .iter()
            .enumerate()
            .map(|(k, (name, _))| {
                let ratios = costs.iter().map(|of_scene| of_scene[k][measure] / best(of_scene));
                let mut doublings: Vec<f64> =
                    ratios.map(f64::log2).filter(|&d| d <= DOUBLINGS).collect();
                doublings.sort_by(f64::total_cmp);
                let share = |solved: usize| solved as f64 / costs.len() as f64;
                let step = |(solved, &x): (usize, &f64)| Point {
                    x,
                    y: share(solved + 1),
                    spread: None,
                    reached: true,
                };
                let points = doublings.iter().enumerate().map(step).collect();
                chart::Series::new(name, 0, points)
            })
            .filter(|series: &chart::Series| !series.points.is_empty())
            .collect();
        let axes = ["log₂ of the factor over the best method", "share of problems solved"];
        Panel::steps(title, axes, [(0.0, DOUBLINGS), (0.0, 1.0)], &series)
    };
    let caption = format!(
        "{} problems to ‖A z − B r + q‖₂ ≤ 10⁻⁸ ‖q‖₂, the fastest of {repeats} runs\n{provenance}",
        scenes.len()
    );
    let panels = vec![panel("by seconds", 0), panel("by half-steps", 1)];
    write(&out.join(file), 2, panels, &caption)?;
    write_csv(&out.join(file), "problem,series,seconds,half-steps", &rows)
}
