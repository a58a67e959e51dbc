//! `hlcp speed-vs-accuracy`: the error that each method reaches, against the time and the
//! half-steps it takes.
//!
//! Every method runs over a ladder of tolerances; what is drawn is the largest error of a component
//! of (z, r) against the known solution, not the residual. Charts and the data of each as CSV go to
//! `docs/charts`: the methods, those beyond the paper, the precisions, certified bounds against
//! errors, and performance profiles over many problems. Ends with an error if a series has no point
//! or a certified bound is below the error it bounds.

use std::{path::PathBuf, time::Duration};

use clap::Args;
use hlcp::files::printable;
use hlcp_core::LinearOperator;
use hlcp_methods::Limits;
use indicatif::ProgressBar;

use super::{
    Charts,
    added::{self, COLUMNS, Measured},
    methods::{Chart, Row, Scene, methods},
    profile,
    run::{Fallible, Judged, Repeats, Run, measure, to},
    table::Table,
};
use crate::{
    chart::{Panel, Point, Series, provenance, write},
    print,
    progress::counting,
    scenes,
};

const EXAMPLES: &str = "\
Examples:
  hlcp speed-vs-accuracy --quick
  hlcp speed-vs-accuracy --add mine.csv

A file of --add has the columns of methods.csv, which this command writes, one row for each
tolerance of a method on a problem:
  problem,series,tolerance,true error,seconds min,seconds median,seconds max,half-steps,reached
A problem with a comma in its name is in quotes; the half-steps may be left out; reached is true or
false. The series is drawn on the charts of the methods and of those beyond the paper.";

/// Draw the error that each method reaches against its time and half-steps
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(flatten)]
    charts: Charts,
    /// Draw the measurements of this file too; may be given more than once
    #[arg(long, value_name = "FILE.csv")]
    add: Vec<PathBuf>,
}

/// The tolerances, as exponents of ten.
const LADDER: [i32; 9] = [1, 2, 4, 6, 8, 10, 12, 13, 14];

/// The seconds of a run that is not repeated.
const LONG: f64 = 1.0;

/// What is drawn for an error of zero.
const NOTHING: f64 = 1e-17;

/// The measurements on the problems by their titles.
type OfProblems = Vec<(String, Vec<Measured>)>;

/// More sweeps, and more time, than any series needs that gets there at all.
pub(super) fn limits(tolerance: f64) -> Limits {
    to(tolerance, 60_000, Some(Duration::from_secs(10)))
}

/// Returns the half-steps of a run, if its iterations have some.
pub(super) fn half_steps(run: &Run) -> Option<usize> {
    let sweeps = run.outcome.sweeps;
    (sweeps > 0 || run.outcome.iterations == 0).then_some(sweeps)
}

pub(crate) fn run(arguments: &Arguments) -> Fallible<()> {
    let Arguments { charts: Charts { quick, out }, add } = arguments;
    let quick = *quick;
    let [m, disc, cells, film] = if quick { [32, 24, 24, 24] } else { [512, 128, 100, 63] };
    let repeats = if quick { 1 } else { 3 };
    let paper = |symmetric, generic| Given::example(symmetric, m, [4.0, 4.0], generic);
    let problems = [
        paper(true, false),
        paper(true, true),
        paper(false, false),
        paper(false, true),
        Given::plain("slider", cells),
        Given::plain("disc-lcp", disc),
        Given::plain("disc-hlcp", disc),
        Given::film(film),
    ];
    let titles: Vec<&str> = problems.iter().map(|problem| problem.title.as_str()).collect();
    let added = added::read(add, &titles)?;
    let mut own: Vec<&str> = added.iter().map(|(_, run)| run.name.as_str()).collect();
    own.dedup();
    let flags = if quick { " --quick" } else { "" };
    let provenance = provenance(&format!("cargo run --release -- speed-vs-accuracy{flags}"));
    let caption = format!(
        "stopping at ‖A z − B r + q‖₂ ≤ 10⁻¹ … 10⁻¹⁴ ‖q‖₂; medians of {repeats}, above a second single runs; bars from the fastest to the slowest; \
         open: tolerance not reached;\nan error of 0 is drawn at 10⁻¹⁷ · {provenance}"
    );
    let [paper, beyond, precise] = [Chart::Paper, Chart::Beyond, Chart::Precisions].map(methods);
    // What is on both charts is measured once.
    let is_new = |row: &&&Row| paper.iter().all(|known| known.label != row.label);
    let all = [&paper[..], &beyond.iter().filter(is_new).copied().collect::<Vec<_>>()].concat();
    let bar = counting(problems.len() * (all.len() + precise.len()));

    let mut measured: [OfProblems; 3] = Default::default();
    let mut certified = vec![];
    for problem in &problems {
        let title = &problem.title;
        bar.set_message(title.clone());
        let scene = problem.pose()?;
        let runs = ladders(&scene, &all, repeats, &bar)?;
        let own = added.iter().filter(|(of, _)| of == title).map(|(_, run)| run);
        for (chart, measured) in [&paper, &beyond].into_iter().zip(&mut measured) {
            let on_chart = |run: &&Measured| chart.iter().any(|row| row.label == run.name);
            let runs = runs.iter().filter(on_chart).chain(own.clone()).cloned().collect();
            measured.push((title.clone(), runs));
        }
        measured[2].push((title.clone(), ladders(&scene, &precise, repeats, &bar)?));
        certified.push((title.clone(), bounds(title, &scene)?));
    }
    for ((name, chart), measured) in
        [("methods", &paper), ("beyond", &beyond), ("precisions", &precise)]
            .into_iter()
            .zip(&measured)
    {
        let own = if name == "precisions" { &[] } else { &own[..] };
        let panels = |by_sweeps| {
            let panel = |(title, runs): &(String, Vec<Measured>)| {
                work_precision(title, chart, own, runs, by_sweeps)
            };
            measured.iter().map(panel).collect()
        };
        write(&out.join(format!("{name}-seconds")), 2, panels(false), &caption)?;
        if name != "precisions" {
            write(&out.join(format!("{name}-sweeps")), 2, panels(true), &caption)?;
        }
        for Row { label, .. } in chart {
            let mut runs = measured.iter().flat_map(|(_, runs)| runs);
            if !runs.any(|run| run.name == *label && run.reached) {
                return Err(format!("{label} has no point").into());
            }
        }
        let mut table = Table::new(&COLUMNS.replace(',', "|"));
        for (title, run) in
            measured.iter().flat_map(|(title, runs)| runs.iter().map(move |run| (title, run)))
        {
            let Measured { name, tolerance, error, seconds: [low, median, high], sweeps, reached } =
                run;
            let [tolerance, error] = [tolerance, error].map(|value| format!("{value:e}"));
            let [low, median, high] = [low, median, high].map(|value| format!("{value:.6}"));
            let sweeps = sweeps.map_or(String::new(), |sweeps| sweeps.to_string());
            let cells = [title, name, &tolerance, &error, &low, &median, &high, &sweeps];
            table.push(cells.into_iter().cloned().chain([reached.to_string()]).collect());
        }
        table.write_csv(&out.join(name))?;
    }
    draw_bounds(out, &certified, &provenance)?;
    profile::draw(out, "profile", &paper, quick, &bar, &provenance)?;
    profile::draw(out, "profile-beyond", &beyond, quick, &bar, &provenance)?;
    bar.finish_and_clear();
    print::line(format_args!("wrote the charts to {}", printable(out.display())))?;
    Ok(())
}

/// Runs every method down the ladder until it misses a tolerance, the methods taking turns.
fn ladders(
    scene: &Scene,
    methods: &[&'static Row],
    repeats: usize,
    bar: &ProgressBar,
) -> Fallible<Vec<Measured>> {
    let repeats = Repeats { longest: LONG, ..Repeats::least(repeats) };
    let (mut left, mut measured) = (methods.to_vec(), vec![]);
    for tolerance in LADDER.map(|exponent| 10_f64.powi(-exponent)) {
        let runs = measure(repeats, &left, |row| row.solve(scene, &limits(tolerance)))?;
        let runs: Vec<_> =
            left.iter().zip(runs).filter_map(|(row, run)| Some((*row, run?))).collect();
        measured.extend(runs.iter().map(|(row, run)| Measured {
            name: row.label.to_owned(),
            tolerance,
            error: scene.wide.error(&run.answer),
            seconds: [0, 2, 4].map(|k| run.quartile(k)),
            sweeps: half_steps(run),
            reached: run.converged(),
        }));
        left = runs.iter().filter(|(_, run)| run.converged()).map(|(row, _)| *row).collect();
    }
    let place = |run: &Measured| methods.iter().position(|row| row.label == run.name);
    measured.sort_by_key(place);
    bar.inc(methods.len() as u64);
    Ok(measured)
}

/// One panel; tolerances that were not reached are open markers at the right edge.
fn work_precision(
    title: &str,
    methods: &[&Row],
    own: &[&str],
    runs: &[Measured],
    by_sweeps: bool,
) -> Panel {
    let work = |run: &Measured| match run.sweeps {
        Some(sweeps) if by_sweeps => Some(sweeps.max(1) as f64),
        None if by_sweeps => None,
        _ => Some(run.seconds[1]),
    };
    let most = runs.iter().filter(|run| run.reached).filter_map(work).fold(0.0, f64::max);
    let edge = 10_f64.powf(most.log10().ceil());
    let point = |run: &Measured| {
        let [fastest, _, slowest] = run.seconds;
        let spread = (!by_sweeps && run.reached).then_some([fastest, slowest]);
        let x = if run.reached { work(run)? } else { 0.9 * edge };
        Some(Point { x, y: run.error.max(NOTHING), spread, reached: run.reached })
    };
    // Others have a style that no method has.
    let place = methods.len();
    let own = own.iter().zip(place..).map(|(name, k)| (*name, [k, k, 7 + k % 2]));
    let series: Vec<Series> = methods
        .iter()
        .map(|row| (row.label, row.style))
        .chain(own)
        .map(|(name, style)| {
            let points = runs.iter().filter(|run| run.name == name).filter_map(point).collect();
            Series { name: name.to_owned(), style, points }
        })
        .filter(|series| !series.points.is_empty())
        .collect();
    let x = if by_sweeps { "half-steps" } else { "seconds" };
    let panel = Panel::log_log(title, [x, "largest error of (z, r)"], &series);
    let single = runs.iter().filter(|run| run.name.ends_with("f32") && run.error.is_finite());
    let floor = single.map(|run| run.error).fold(f64::INFINITY, f64::min).max(NOTHING).log10();
    if floor.is_infinite() || by_sweeps {
        return panel;
    }
    let least = runs.iter().filter_map(work).fold(f64::INFINITY, f64::min).log10().floor();
    panel.outline("least error in f32", "grey", "3 3", &[(least, floor), (edge.log10(), floor)])
}

/// Returns the error of each answer of AMSOR down the ladder, and the certified bound on it.
fn bounds(title: &str, scene: &Scene) -> Fallible<Vec<[f64; 2]>> {
    let amsor =
        methods(Chart::Beyond).into_iter().find(|row| row.name == "AMSOR").ok_or("AMSOR")?;
    let doubt = scene.wide.doubt.ok_or_else(|| format!("no certificate for {title}"))?;
    let mut pairs = vec![];
    for exponent in LADDER {
        let Some(run) = amsor.solve(scene, &limits(10_f64.powi(-exponent)))? else {
            break;
        };
        let error = scene.wide.error(&run.answer);
        let bound = scene.wide.bound(&run.answer).map_err(|why| format!("{title}: {why}"))?;
        // The planted solution may itself be off by as much as was proved of it.
        if error > bound + doubt {
            return Err(format!("{title}: the error {error:e} is above its bound {bound:e}").into());
        }
        pairs.push([error, bound]);
        if !run.converged() {
            break;
        }
    }
    Ok(pairs)
}

fn draw_bounds(
    out: &std::path::Path,
    certified: &[(String, Vec<[f64; 2]>)],
    provenance: &str,
) -> Fallible<()> {
    let (mut series, mut table) = (vec![], Table::new("problem | true error | bound"));
    for (k, (name, pairs)) in certified.iter().enumerate() {
        let point = |pair: &[f64; 2]| {
            let [x, y] = pair.map(|v| v.max(NOTHING));
            Point::at(x, y)
        };
        let points = pairs.iter().map(point).collect();
        series.push(Series { name: name.clone(), style: [k; 3], points });
        pairs.iter().for_each(|[error, bound]| table.row(&format!("{name}|{error:e}|{bound:e}")));
    }
    let axes = ["largest error of (z, r)", "certified bound on it"];
    let panel = Panel::log_log("Certified bounds of AMSOR's answers", axes, &series).outline(
        "bound = error",
        "grey",
        "3 3",
        &[(-17.0, -17.0), (1.0, 1.0)],
    );
    write(&out.join("certified"), 1, vec![panel], &provenance.replacen(" · ", "\n", 1))?;
    table.write_csv(&out.join("certified"))
}

/// A scene with its numbers.
pub(super) struct Given {
    pub(super) title: String,
    scene: &'static scenes::Scene,
    numbers: Vec<(&'static str, f64)>,
    /// Whether the planted solution is a generic one of the same pattern.
    generic: bool,
}

impl Given {
    /// Returns Example 1 or 2, with its solution of zeros and ones or with a generic one.
    pub(super) fn example(symmetric: bool, m: usize, [mu, nu]: [f64; 2], generic: bool) -> Self {
        let (number, scene) = if symmetric { (1, "example1") } else { (2, "example2") };
        let solution = if generic { "generic" } else { "0/1" };
        let title = format!("Example {number} ({mu}, {nu}), m = {m}, {solution}");
        let numbers = vec![("m", m as f64), ("mu", mu), ("nu", nu)];
        Self { title, scene: scenes::Scene::of(scene), numbers, generic }
    }

    /// Returns a scene that is defined by `m` alone.
    pub(super) fn plain(scene: &str, m: usize) -> Self {
        let letter = if scene == "slider" { "N" } else { "m" };
        let (title, numbers) = (format!("{scene}, {letter} = {m}"), vec![("m", m as f64)]);
        Self { title, scene: scenes::Scene::of(scene), numbers, generic: false }
    }

    /// Returns a film of m × m cells, with a dimple for each 32 × 32, but 2 × 2 at least.
    fn film(m: usize) -> Self {
        let (side, k) = (m as f64, (m / 31).max(2));
        let title = format!("film, {m} × {m} cells, {k} × {k} dimples");
        let numbers = vec![("nx", side), ("ny", side), ("dimples", k as f64)];
        Self { title, scene: scenes::Scene::of("film"), numbers, generic: false }
    }

    /// Poses the problem in both precisions.
    pub(super) fn pose(&self) -> Fallible<Scene> {
        let numbers = self.scene.numbers(&self.numbers);
        let (mut wide, mut narrow) = ((self.scene.wide)(&numbers)?, (self.scene.narrow)(&numbers)?);
        if let Some(known) = wide.known.as_mut().filter(|_| self.generic) {
            // Thirty bits below 2: q is exact in double precision, and the planted pair solves what
            // is posed there.
            let mut az = vec![0.0; wide.q.len()];
            let size = |k: usize| (1 + k.wrapping_mul(0x9e37_79b9) % (1 << 30)) as f64;
            for (k, v) in known.iter_mut().flat_map(|vector| vector.iter_mut().enumerate()) {
                *v *= size(k) / (1 << 29) as f64;
            }
            wide.a.apply(&known[0], &mut az);
            wide.b.apply(&known[1], &mut wide.q);
            wide.q.iter_mut().zip(az).for_each(|(q, az)| *q -= az);
        }
        narrow.q = wide.q.iter().map(|&q| q as f32).collect();
        let wide = Judged::new(wide, "AMG", &self.scene.limits(), true)?;
        Ok(Scene { name: self.scene.name, m: self.numbers[0].1, wide, narrow })
    }
}
