//! `hlcp speed-vs-accuracy`: the time that each method takes for an error.
//!
//! Every method runs over a ladder of tolerances; what is drawn is its time against the largest
//! error of a component of (z, r) to the known solution, not the residual. The charts are drawn
//! from the CSV files beside them: seven methods on four problems, `speed-vs-accuracy`; all
//! methods, and two in three precisions, on all problems; certified bounds against errors; a
//! performance profile over many problems. A problem of one's own, a scene or files, has one chart
//! of the methods that leave no parameter open. Ends with an error if a series has no point or a
//! certified bound is below the error it bounds.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use clap::Args;
use hlcp::{
    files::printable,
    ladder::{COLUMNS, Rung, TOLERANCES},
};
use hlcp_core::LinearOperator;
use hlcp_methods::Limits;
use indicatif::ProgressBar;

use super::{
    Charts, added,
    methods::{Chart, Row, Scene, is_listed, methods},
    own::Own,
    profile,
    run::{Judged, Repeats, Run, measure, to},
    table::Table,
};
use crate::{
    Fallible,
    chart::{Panel, Series, power_of_ten, save, write},
    print,
    progress::counting,
};

const EXAMPLES: &str = "\
Examples:
  hlcp speed-vs-accuracy --scene dam --nx 31 --ny 32 --out target/charts
  hlcp speed-vs-accuracy --a A.mtx --b B.mtx --q q.mtx --add mine.csv --out target/charts

A file of --add has the columns of speed-vs-accuracy.csv, which this command writes, one row for
each tolerance of a method on a problem:
  problem,series,tolerance,true error,seconds min,seconds median,seconds max,half-steps,reached
A problem with a comma in its name is in quotes; the half-steps may be left out; reached is true or
false. The series is drawn on all charts of the methods. The library's hlcp::ladder makes such
rows.";

/// Draw the time that each method takes for an error
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(flatten)]
    charts: Charts,
    #[command(flatten)]
    own: Own,
    /// Draw the measurements of this file too; may be given more than once
    #[arg(long, value_name = "FILE.csv")]
    add: Vec<PathBuf>,
}

/// What is drawn for an error of zero.
const NOTHING: f64 = 1e-16;

/// More sweeps, and more time, than any series needs that gets there at all.
pub(super) fn limits(tolerance: f64) -> Limits {
    to(tolerance, 60_000, Some(Duration::from_secs(10)))
}

/// Returns the half-steps of a run, if its iterations have some.
pub(super) fn half_steps(run: &Run) -> Option<usize> {
    let sweeps = run.outcome.sweeps;
    (sweeps > 0 || run.outcome.iterations == 0).then_some(sweeps)
}

/// The problems that all methods run on.
fn problems(quick: bool) -> Vec<Own> {
    let [m, disc, cells, film] = if quick { [16, 12, 12, 12] } else { [512, 128, 100, 63] };
    let paper = |symmetric, generic| example(symmetric, m, [4.0, 4.0], generic);
    vec![
        paper(true, false),
        paper(true, true),
        paper(false, false),
        paper(false, true),
        plain("slider", cells),
        plain("disc-lcp", disc),
        plain("disc-hlcp", disc),
        textured(film),
    ]
}

/// Those of them on the chart for a first look.
const AT_A_GLANCE: [usize; 4] = [1, 4, 6, 7];

/// How often a solve is repeated, unless it takes more than a second.
fn repeats(quick: bool) -> Repeats {
    Repeats { longest: 1.0, ..Repeats::least(profile::repeats(quick)) }
}

pub(crate) fn run(arguments: &Arguments) -> Fallible<()> {
    let Arguments { charts, own, add } = arguments;
    let Charts { quick, out, .. } = charts;
    let quick = *quick;
    let is_own = own.is_asked();
    let (problems, name, key) = match is_own {
        true => (
            vec![own.clone()],
            format!("speed-vs-accuracy-{}", own.file()),
            format!("speed-vs-accuracy{}", own.options()),
        ),
        false => (problems(quick), "speed-vs-accuracy".to_owned(), "speed-vs-accuracy".to_owned()),
    };
    let titles: Vec<String> = problems.iter().map(Own::title).collect();
    let mut added = vec![];
    for path in add {
        added.extend(added::read(path, &titles)?);
    }
    let path = out.join(name);
    let csv = path.with_extension("csv");
    let measured = charts.measured(&key, || match is_own {
        true => measure_own(&problems[0], quick, &csv),
        false => measure_all(&problems, quick, out),
    })?;
    let mut rows = added::read(&csv, &titles)?;
    if !added.is_empty() {
        let is_new = |(of, run): &(String, Rung)| {
            added.iter().any(|(title, new)| title == of && new.series == run.series)
        };
        rows.retain(|row| !is_new(row));
        rows.extend(added);
        write_rungs(&rows, &csv)?;
    }
    let words = format!(
        "Each method stops at ‖A z − B r + q‖₂ ≤ 10⁻¹ … 10⁻¹⁴ ‖q‖₂; its line ends with the last that it reaches; {}. \
         An error of 0 is drawn at 10⁻¹⁶.\n{measured}",
        if quick {
            "the time of one solve"
        } else {
            "the median time of 3 solves, above a second of one"
        }
    );
    if is_own {
        let panel = glance(&titles[0], &rows, Chart::Own, true);
        write(&path, 1, 400.0, vec![panel], &words)?;
    } else {
        draw_all(out, &titles, &rows, quick, [&words, &measured])?;
    }
    print::line(format_args!("wrote the charts to {}", printable(out.display())))?;
    Ok(())
}

/// Draws all charts but that of a problem of one's own.
fn draw_all(
    out: &Path,
    titles: &[String],
    rows: &[(String, Rung)],
    quick: bool,
    [words, measured]: [&str; 2],
) -> Fallible<()> {
    let precise = added::read(&out.join("precisions.csv"), titles)?;
    let lead = "Newton and FBNS factorise by a sparse LU. ".to_owned();
    let panels = AT_A_GLANCE.map(|k| glance(&titles[k], rows, Chart::Glance, k == AT_A_GLANCE[0]));
    write(&out.join("speed-vs-accuracy"), 4, 300.0, panels.into(), &(lead + words))?;
    for (name, rows, chart) in [
        ("methods", rows, Chart::Paper),
        ("beyond", rows, Chart::Beyond),
        ("precisions", &precise, Chart::Precisions),
    ] {
        let panel = |(k, title): (usize, &String)| {
            let (series, above) = apart(lines(title, rows, chart));
            let mut panel = panel(title, k % 4 == 0, &series);
            if !above.is_empty() {
                // Only named: an axis up to them would make one line of all others.
                let name = |line: &Series| format!("{} {}", short(&line.name), least(line));
                let names: Vec<_> = above.iter().map(name).collect();
                panel.places = vec![(8.1, format!("↑ {}", names.join(", ")))];
            }
            let single = rows.iter().filter(|(of, run)| of == title && run.series.ends_with("f32"));
            let floor = single.map(|(_, run)| run.error).fold(f64::INFINITY, f64::min);
            if floor.is_infinite() {
                return panel;
            }
            let x = -floor.max(NOTHING).log10();
            panel.outline("least error in f32", "grey", "3 3", &[(x, -9.0), (x, 9.0)])
        };
        let panels = titles.iter().enumerate().map(panel).collect();
        write(&out.join(name), 4, 250.0, panels, words)?;
    }
    draw_bounds(out, titles, measured)?;
    profile::draw(out, &methods(Chart::Beyond), quick, measured)
}

/// Measures the methods that leave no parameter open on a problem of one's own.
fn measure_own(own: &Own, quick: bool, path: &Path) -> Fallible<()> {
    let methods = methods(Chart::Own);
    let bar = counting(methods.len());
    let runs = ladders(&pose(own)?, &methods, repeats(quick), &bar)?;
    let rows: Vec<_> = runs.into_iter().map(|run| (own.title(), run)).collect();
    write_rungs(&rows, path)
}

fn measure_all(problems: &[Own], quick: bool, out: &Path) -> Fallible<()> {
    let [paper, beyond, precise] = [Chart::Paper, Chart::Beyond, Chart::Precisions].map(methods);
    // What is on both charts is measured once.
    let is_new = |row: &&&Row| paper.iter().all(|known| known.label != row.label);
    let all = [&paper[..], &beyond.iter().filter(is_new).copied().collect::<Vec<_>>()].concat();
    let bar = counting(problems.len() * (all.len() + precise.len()));
    let mut measured: [Vec<_>; 2] = Default::default();
    let mut certified = Table::new(BOUNDS);
    for problem in problems {
        let title = &problem.title();
        bar.set_message(title.clone());
        let scene = pose(problem)?;
        for (methods, measured) in [&all, &precise].into_iter().zip(&mut measured) {
            let runs = ladders(&scene, methods, repeats(quick), &bar)?;
            measured.extend(runs.into_iter().map(|run| (title.clone(), run)));
        }
        for [error, bound] in bounds(title, &scene)? {
            certified.push(vec![title.clone(), format!("{error:e}"), format!("{bound:e}")]);
        }
    }
    for Row { label, .. } in all.iter().chain(&precise) {
        let mut runs = measured.iter().flatten();
        if !runs.any(|(_, run)| run.series == *label && run.reached) {
            return Err(format!("{label} has no point").into());
        }
    }
    write_rungs(&measured[0], &out.join("speed-vs-accuracy"))?;
    write_rungs(&measured[1], &out.join("precisions"))?;
    certified.write_csv(&out.join("certified"))?;
    profile::measure(out, &beyond, quick, &bar)
}

/// Writes measurements with their problems as `path`.csv.
fn write_rungs(rows: &[(String, Rung)], path: &Path) -> Fallible<()> {
    let rows: String = rows.iter().map(|(title, run)| run.row(title) + "\n").collect();
    save(&path.with_extension("csv"), &format!("{}\n{rows}", COLUMNS.join(",")))
}

/// Runs every method down the ladder until it misses a tolerance, the methods taking turns.
fn ladders(
    scene: &Scene,
    methods: &[&'static Row],
    repeats: Repeats,
    bar: &ProgressBar,
) -> Fallible<Vec<Rung>> {
    let (mut left, mut measured) = (methods.to_vec(), vec![]);
    for tolerance in TOLERANCES {
        let runs = measure(repeats, &left, |row| row.solve(scene, &limits(tolerance)))?;
        let runs: Vec<_> =
            left.iter().zip(runs).filter_map(|(row, run)| Some((*row, run?))).collect();
        measured.extend(runs.iter().map(|(row, run)| Rung {
            series: row.label.to_owned(),
            tolerance,
            error: scene.wide.error(&run.answer),
            seconds: [0, 2, 4].map(|k| run.quartile(k)),
            half_steps: half_steps(run),
            reached: run.converged(),
        }));
        left = runs.iter().filter(|(_, run)| run.converged()).map(|(row, _)| *row).collect();
    }
    measured.retain(|run| run.error.is_finite());
    let place = |run: &Rung| methods.iter().position(|row| row.label == run.series);
    measured.sort_by_key(place);
    bar.inc(methods.len() as u64);
    Ok(measured)
}

/// Returns the lines of a chart on a problem, median seconds against the inverse of the error: of
/// its methods, and of all series that are not in the list.
fn lines(title: &str, rows: &[(String, Rung)], chart: Chart) -> Vec<Series> {
    let mut known: Vec<_> = methods(chart).iter().map(|row| (row.label, row.style)).collect();
    for name in rows.iter().map(|(_, run)| run.series.as_str()) {
        if !is_listed(name) && known.iter().all(|(other, _)| *other != name) {
            // Others have a style that no method has.
            let k = known.len();
            known.push((name, [k, k, 7 + k % 2]));
        }
    }
    let line = |(name, style): (&str, _)| {
        let runs = rows.iter().filter(|(of, run)| of == title && run.series == name && run.reached);
        let point = |(_, run): &(String, Rung)| (run.error.max(NOTHING).recip(), run.seconds[1]);
        Series { name: name.to_owned(), style, points: runs.map(point).collect() }
    };
    known.into_iter().map(line).filter(|series| !series.points.is_empty()).collect()
}

/// Draws seconds against the error, which gets smaller to the right.
fn panel(title: &str, is_first: bool, series: &[Series]) -> Panel {
    // The numbers of a problem stand below its name, which may have commas in brackets.
    let name = title.find("), ").map_or_else(|| title.find(','), |k| Some(k + 1));
    let (name, numbers) = title.split_at(name.unwrap_or(title.len()));
    let title = format!("{name}\n{}", numbers.trim_start_matches([',', ' ']));
    let axes = ["largest error", if is_first { "time" } else { "" }];
    let panel = Panel::log_log(&title, axes, series);
    panel.over(-0.2, 16.4, [|v| power_of_ten(0.0 - v), duration])
}

/// Writes 10^v seconds, a power of ten.
fn duration(v: f64) -> String {
    let (unit, shift) = match v {
        ..-4.5 => ("µs", 6.0),
        ..-1.5 => ("ms", 3.0),
        _ => ("s", 0.0),
    };
    format!("{} {unit}", 10_f64.powf((v + shift).round()))
}

/// Returns a name without what the caption says of the method.
fn short(name: &str) -> String {
    let name = name.split([',', '(']).next().unwrap_or_default().trim();
    name.replace("projected", "proj.")
}

/// Writes the least time of a line.
fn least(series: &Series) -> String {
    let seconds = lowest(series);
    match seconds {
        0.5.. => format!("{seconds:.0} s"),
        5e-4.. => format!("{:.0} ms", 1e3 * seconds),
        _ => format!("{:.0} µs", 1e6 * seconds),
    }
}

fn lowest(series: &Series) -> f64 {
    series.points.iter().map(|point| point.1).fold(f64::MAX, f64::min)
}

/// Parts the lines from those that begin a decade above where all faster ones end, and would only
/// stretch the axis.
fn apart(series: Vec<Series>) -> (Vec<Series>, Vec<Series>) {
    let highest = |line: &Series| line.points.iter().map(|point| point.1).fold(0.0, f64::max);
    let mut ranges: Vec<_> = series.iter().map(|line| [lowest(line), highest(line)]).collect();
    ranges.sort_by(|one, other| one[0].total_cmp(&other[0]));
    let mut top = f64::INFINITY;
    for (k, [low, high]) in ranges.into_iter().enumerate() {
        if low >= 10.0 * top {
            break;
        }
        top = if k == 0 { high } else { top.max(high) };
    }
    series.into_iter().partition(|line| lowest(line) <= top)
}

/// Draws some methods, each with its name at the end of its line, and which is the fastest.
fn glance(title: &str, rows: &[(String, Rung)], chart: Chart, is_first: bool) -> Panel {
    let mut series = lines(title, rows, chart);
    for series in series.iter_mut().filter(|series| is_listed(&series.name)) {
        // Two of a problem of one's own differ in what follows the comma.
        if chart == Chart::Glance {
            series.name = short(&series.name);
        }
    }
    let (series, above) = apart(series);
    let mut points: Vec<_> = series.iter().flat_map(|series| &series.points).collect();
    points.sort_by(|one, other| one.1.total_cmp(&other.1));
    let mut front: Vec<(f64, f64)> = vec![];
    // Below 1e-13 rounding decides.
    for (x, y) in points.into_iter().map(|(x, y)| (x.log10().min(13.0), y.log10())) {
        match front.last() {
            Some(&(best, _)) if x <= best => (),
            Some(&(best, _)) => front.extend([(best, y), (x, y)]),
            None => front.push((x, y)),
        }
    }
    let panel = panel(title, is_first, &series).with_names_at_ends(&series, |_| String::new());
    let mut panel = panel.band("fastest so far", "#d0d0d0", &front);
    for series in &above {
        panel.name(series, format!("{} ↑ {}", series.name, least(series)), None);
    }
    panel
}

/// Returns the error of each answer of AMSOR down the ladder, and what is proved of it: of the
/// answer and of the solution that it is compared with.
fn bounds(title: &str, scene: &Scene) -> Fallible<Vec<[f64; 2]>> {
    let amsor =
        methods(Chart::Beyond).into_iter().find(|row| row.name == "AMSOR").ok_or("AMSOR")?;
    let doubt = scene.wide.doubt.ok_or_else(|| format!("no certificate for {title}"))?;
    let mut pairs = vec![];
    for tolerance in TOLERANCES {
        let Some(run) = amsor.solve(scene, &limits(tolerance))? else {
            break;
        };
        let error = scene.wide.error(&run.answer);
        let bound = scene.wide.bound(&run.answer).map_err(|why| format!("{title}: {why}"))?;
        // The planted solution may itself be off by as much as was proved of it.
        if error > bound + doubt {
            return Err(format!("{title}: the error {error:e} is above its bound {bound:e}").into());
        }
        pairs.push([error, bound + doubt]);
        if !run.converged() {
            break;
        }
    }
    Ok(pairs)
}

const BOUNDS: &str = "problem|true error|bound";

fn draw_bounds(out: &Path, titles: &[String], measured: &str) -> Fallible<()> {
    let path = out.join("certified");
    let rows = Table::rows_of(&path.with_extension("csv"), BOUNDS)?;
    let mut series = vec![];
    for (k, title) in titles.iter().enumerate() {
        let mut points = vec![];
        for (_, [_, error, bound]) in rows.iter().filter(|(_, row)| row[0] == *title) {
            let [x, bound] = [error.parse::<f64>()?, bound.parse()?].map(|v| v.max(NOTHING));
            points.push((x, bound / x));
        }
        series.push(Series { name: title.clone(), style: [k; 3], points });
    }
    let axes = ["largest error of (z, r)", "certified bound over the error"];
    let panel = Panel::log_log("Certified bounds of AMSOR's answers", axes, &series);
    let words = "The bounds hold the errors of the answer and of the planted solution, which solves a rounded q.";
    write(&path, 1, 400.0, vec![panel], &format!("{words}\n{measured}"))
}

/// Returns Example 1 or 2, with its solution of zeros and ones or with a generic one.
pub(super) fn example(symmetric: bool, m: usize, [mu, nu]: [f64; 2], is_generic: bool) -> Own {
    let (number, scene) = if symmetric { (1, "example1") } else { (2, "example2") };
    let solution = if is_generic { "generic" } else { "0/1" };
    let title = format!("Example {number} ({mu}, {nu}), m = {m}, {solution}");
    let mut own = Own::scene(scene, &[("m", m as f64), ("mu", mu), ("nu", nu)], title);
    own.is_generic = is_generic;
    own
}

/// Returns a scene that is defined by `m` alone.
pub(super) fn plain(scene: &str, m: usize) -> Own {
    let letter = if scene == "slider" { "N" } else { "m" };
    Own::scene(scene, &[("m", m as f64)], format!("{scene}, {letter} = {m}"))
}

/// Returns a film of m × m cells, with a dimple for each 32 × 32, but 2 × 2 at least.
fn textured(m: usize) -> Own {
    let (side, k) = (m as f64, (m / 31).max(2));
    let title = format!("film, {m} × {m}, {k} × {k} dimples");
    Own::scene("film", &[("nx", side), ("ny", side), ("dimples", k as f64)], title)
}

pub(super) fn pose(own: &Own) -> Fallible<Scene> {
    let (mut wide, mut narrow) = (own.wide()?, own.narrow()?);
    if let Some(known) = wide.known.as_mut().filter(|_| own.is_generic) {
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
    let wide = Judged::new(wide, "AMG", &own.limits(), true)?;
    Ok(Scene { name: own.name(), m: own.size(), wide, narrow })
}
