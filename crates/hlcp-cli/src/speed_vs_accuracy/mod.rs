//! `hlcp speed-vs-accuracy`: the error that each method reaches, against the time and the
//! half-steps it takes.
//!
//! Every method runs over a ladder of tolerances; what is drawn is the largest error of a component
//! of (z, r) against the known solution, not the residual. Charts and the data of each as CSV go to
//! `docs/charts`: the methods, those beyond the paper, the precisions, certified bounds against
//! errors, and performance profiles over many problems. The feature `faer` adds the modulus Newton
//! and Fischer–Burmeister–Newton–Schur, both with a library's sparse LU. Ends with an error if a
//! series has no point or a certified bound is below the error it bounds.

mod added;
mod problem;
mod profile;
mod projected;
mod series;

use std::{error::Error, path::PathBuf};

use clap::Args;
use hlcp::files::printable;
use hlcp_verify::certify;
use indicatif::ProgressBar;
use problem::{Posed, Problem};
use series::{BEYOND, METHODS, PRECISIONS};
use series::{Run, Series};

use crate::{
    Charts,
    chart::{self, Panel, Point, provenance, write, write_csv},
    print,
    progress::counting,
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

/// The columns of the data.
const COLUMNS: &str =
    "problem,series,tolerance,true error,seconds min,seconds median,seconds max,half-steps,reached";

/// The tolerances, as exponents of ten.
const LADDER: [i32; 9] = [1, 2, 4, 6, 8, 10, 12, 13, 14];

/// The seconds of a run that is not repeated.
const LONG: f64 = 1.0;

/// What is drawn for an error of zero.
const NOTHING: f64 = 1e-17;

/// The runs of one series to one tolerance on one problem.
#[derive(Clone)]
struct Measured {
    name: String,
    tolerance: f64,
    error: f64,
    /// In increasing order.
    seconds: Vec<f64>,
    sweeps: Option<usize>,
    reached: bool,
}

/// The names of the series of a chart, in their order.
fn names(order: &[Series]) -> Vec<&str> {
    order.iter().map(|(name, _)| *name).collect()
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let Arguments { charts: Charts { quick, out }, add } = arguments;
    let quick = *quick;
    for of_chart in [METHODS, BEYOND, PRECISIONS] {
        chart::assert_styled(of_chart.iter().map(|(name, _)| *name));
    }
    let [m, disc, cells, film] = if quick { [32, 24, 24, 24] } else { [512, 128, 100, 63] };
    let repeats = if quick { 1 } else { 3 };
    let paper = |symmetric, generic| Posed::example(symmetric, m, [4.0, 4.0], generic);
    let scenes = [
        paper(true, false),
        paper(true, true),
        paper(false, false),
        paper(false, true),
        Posed::plain("slider", cells),
        Posed::plain("disc-lcp", disc),
        Posed::plain("disc-hlcp", disc),
        Posed::film(film),
    ];
    let titles: Vec<&str> = scenes.iter().map(|scene| scene.title.as_str()).collect();
    let added = added::read(add, &titles)?;
    let mut own: Vec<&str> = added.iter().map(|(_, run)| run.name.as_str()).collect();
    own.dedup();
    let features = if cfg!(feature = "faer") { "--features faer " } else { "" };
    let flags = if quick { " --quick" } else { "" };
    let command = format!("cargo run --release {features}-- speed-vs-accuracy{flags}");
    let caption = format!(
        "stopping at ‖A z − B r + q‖₂ ≤ 10⁻¹ … 10⁻¹⁴ ‖q‖₂; medians of {repeats}, above a second single runs; bars from the fastest to the slowest; \
         open: tolerance not reached;\nan error of 0 is drawn at 10⁻¹⁷{} · {}",
        if cfg!(feature = "faer") { "" } else { "; without the methods of --features faer" },
        provenance(&command)
    );
    // What is on both charts is measured once.
    let drawn_before = |name: &str| METHODS.iter().any(|(known, _)| *known == name);
    let more = BEYOND.iter().filter(|(name, _)| !drawn_before(name));
    let all: Vec<&Series> = METHODS.iter().chain(more).collect();
    let precise: Vec<&Series> = PRECISIONS.iter().collect();
    let bar = counting(scenes.len() * (all.len() + precise.len()) * repeats);

    let [mut methods, mut beyond, mut precisions] = [(); 3].map(|()| vec![]);
    let mut certified = vec![];
    for scene in &scenes {
        let title = &scene.title;
        bar.set_message(title.clone());
        let problem = scene.pose()?;
        let measured = measure(&problem, &all, repeats, &bar)?;
        let own = added.iter().filter(|(of, _)| of == title).map(|(_, run)| run);
        let with_own = |order: &[Series]| {
            let runs = measured.iter().filter(|run| names(order).contains(&run.name.as_str()));
            (title.clone(), runs.chain(own.clone()).cloned().collect::<Vec<_>>())
        };
        methods.push(with_own(METHODS));
        beyond.push(with_own(BEYOND));
        precisions.push((title.clone(), measure(&problem, &precise, repeats, &bar)?));
        certified.push((title.clone(), bounds(&problem)?));
    }
    let with_own = |order| [names(order), own.clone()].concat();
    let [by_seconds, by_sweeps] = [false, true];
    let charts = [
        ("methods-seconds", with_own(METHODS), &methods, by_seconds),
        ("methods-sweeps", with_own(METHODS), &methods, by_sweeps),
        ("beyond-seconds", with_own(BEYOND), &beyond, by_seconds),
        ("beyond-sweeps", with_own(BEYOND), &beyond, by_sweeps),
        ("precisions-seconds", names(PRECISIONS), &precisions, by_seconds),
    ];
    for (name, order, measured, by_sweeps) in charts {
        let panels = measured
            .iter()
            .map(|(title, runs)| work_precision(title, &order, runs, by_sweeps))
            .collect();
        write(&out.join(name), 2, panels, &caption)?;
    }
    check_series(METHODS, &methods)?;
    check_series(BEYOND, &beyond)?;
    check_series(PRECISIONS, &precisions)?;
    let tables = [("methods", &methods), ("beyond", &beyond), ("precisions", &precisions)];
    for (name, measured) in tables {
        let rows = measured.iter().flat_map(|(scene, runs)| {
            runs.iter().map(move |run| {
                let [low, median, high] = run.spread();
                let sweeps = run.sweeps.map_or(String::new(), |sweeps| sweeps.to_string());
                format!(
                    "\"{scene}\",\"{}\",{:e},{:e},{low:.6},{median:.6},{high:.6},{sweeps},{}",
                    run.name, run.tolerance, run.error, run.reached
                )
            })
        });
        write_csv(&out.join(name), COLUMNS, &rows.collect::<Vec<_>>())?;
    }
    draw_bounds(out, &certified, &provenance(&command))?;
    profile::draw(out, "profile", METHODS, quick, &bar, &provenance(&command))?;
    profile::draw(out, "profile-beyond", BEYOND, quick, &bar, &provenance(&command))?;
    bar.finish_and_clear();
    if !cfg!(feature = "faer") {
        print::line(
            "left out: the modulus Newton and FBNS by sparse LU, which need --features faer",
        )?;
    }
    print::line(format_args!("wrote the charts to {}", printable(out.display())))?;
    Ok(())
}

/// Runs every series down the ladder until it misses a tolerance, the series taking turns.
fn measure(
    problem: &Problem,
    order: &[&Series],
    repeats: usize,
    bar: &ProgressBar,
) -> Result<Vec<Measured>, Box<dyn Error>> {
    let mut measured: Vec<Measured> = vec![];
    for _ in 0..repeats {
        for (name, solve) in order {
            let mut last: Option<Run> = None;
            for tolerance in LADDER.map(|exponent| 10_f64.powi(-exponent)) {
                let same =
                    |known: &&mut Measured| known.name == *name && known.tolerance == tolerance;
                let known = measured.iter_mut().find(same);
                if let Some(known) = &known
                    && known.seconds[0] > LONG
                {
                    if known.reached {
                        continue;
                    }
                    break;
                }
                let run = match last.take() {
                    Some(run) if run.holds <= tolerance => Some(run),
                    _ => solve.run(problem, tolerance)?,
                };
                let Some(run) = run else {
                    break;
                };
                let Run { seconds, sweeps, reached, .. } = run;
                match known {
                    Some(known) => known.seconds.push(seconds),
                    None => {
                        let error = problem.error(&run.z, &run.r);
                        let (name, seconds) = ((*name).to_owned(), vec![seconds]);
                        measured.push(Measured {
                            name,
                            tolerance,
                            error,
                            seconds,
                            sweeps,
                            reached,
                        });
                    }
                }
                if !reached {
                    break;
                }
                last = Some(run);
            }
            bar.inc(1);
        }
    }
    measured.iter_mut().for_each(|runs| runs.seconds.sort_by(f64::total_cmp));
    Ok(measured)
}

impl Measured {
    /// The fastest, the median and the slowest.
    fn spread(&self) -> [f64; 3] {
        let last = self.seconds.len() - 1;
        [0, last / 2, last].map(|k| self.seconds[k])
    }
}

/// One panel; tolerances that were not reached are open markers at the right edge.
fn work_precision(title: &str, order: &[&str], runs: &[Measured], by_sweeps: bool) -> Panel {
    let work = |run: &Measured| match run.sweeps {
        Some(sweeps) if by_sweeps => Some(sweeps.max(1) as f64),
        None if by_sweeps => None,
        _ => Some(run.spread()[1]),
    };
    let most = runs.iter().filter(|run| run.reached).filter_map(work).fold(0.0, f64::max);
    let edge = 10_f64.powf(most.log10().ceil());
    let point = |run: &Measured| {
        let [fastest, _, slowest] = run.spread();
        let spread = (!by_sweeps && run.reached).then_some([fastest, slowest]);
        let x = if run.reached { work(run)? } else { 0.9 * edge };
        Some(Point { x, y: run.error.max(NOTHING), spread, reached: run.reached })
    };
    let series: Vec<chart::Series> = order
        .iter()
        .enumerate()
        .map(|(place, &name)| {
            let points = runs.iter().filter(|run| run.name == name).filter_map(point).collect();
            chart::Series::new(name, place, points)
        })
        .filter(|series: &chart::Series| !series.points.is_empty())
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

/// Refuses a series that was drawn nowhere.
fn check_series(
    order: &[Series],
    measured: &[(String, Vec<Measured>)],
) -> Result<(), Box<dyn Error>> {
    for (name, _) in order {
        if !measured.iter().flat_map(|(_, runs)| runs).any(|run| run.name == *name && run.reached) {
            return Err(format!("the series {name} has no point").into());
        }
    }
    Ok(())
}

/// The error of each answer of AMGS down the ladder, and the certified bound on it.
fn bounds(problem: &Problem) -> Result<Vec<[f64; 2]>, Box<dyn Error>> {
    let (_, solve) = METHODS.iter().find(|(name, _)| *name == "AMSOR, best").ok_or("AMSOR")?;
    let mut pairs = vec![];
    for exponent in LADDER {
        let Some(run) = solve.run(problem, 10_f64.powi(-exponent))? else {
            break;
        };
        let posed = &problem.wide;
        let certificate = certify(&posed.a, &posed.b, &posed.q, &run.z, &run.r)?
            .map_err(|why| format!("no certificate for {}: {why}", problem.posed.title))?;
        let (error, bound) = (problem.error(&run.z, &run.r), certificate.error());
        // The planted solution may itself be off by as much as was proved of it.
        if error > bound + problem.doubt {
            let name = &problem.posed.title;
            return Err(format!("{name}: the error {error:e} is above its bound {bound:e}").into());
        }
        pairs.push([error, bound]);
        if !run.reached {
            break;
        }
    }
    Ok(pairs)
}

fn draw_bounds(
    out: &std::path::Path,
    certified: &[(String, Vec<[f64; 2]>)],
    provenance: &str,
) -> Result<(), Box<dyn Error>> {
    let series: Vec<chart::Series> = certified
        .iter()
        .enumerate()
        .map(|(style, (name, pairs))| {
            let point = |&[error, bound]: &[f64; 2]| {
                let [x, y] = [error, bound].map(|v| v.max(NOTHING));
                Point { x, y, spread: None, reached: true }
            };
            chart::Series::by_number(name, style, pairs.iter().map(point).collect())
        })
        .collect();
    let axes = ["largest error of (z, r)", "certified bound on it"];
    let panel = Panel::log_log("Certified bounds of AMSOR's answers", axes, &series).outline(
        "bound = error",
        "grey",
        "3 3",
        &[(-17.0, -17.0), (1.0, 1.0)],
    );
    write(&out.join("certified"), 1, vec![panel], &provenance.replacen(" · ", "\n", 1))?;
    let rows = certified.iter().flat_map(|(name, pairs)| {
        pairs.iter().map(move |[error, bound]| format!("\"{name}\",{error:e},{bound:e}"))
    });
    write_csv(&out.join("certified"), "problem,true error,bound", &rows.collect::<Vec<_>>())
}
