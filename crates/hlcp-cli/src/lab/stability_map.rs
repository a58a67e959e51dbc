//! `hlcp stability-map`: where each method converges over the plane of α and τ, and how fast.
//!
//! A chart is a scene, a panel of it a method: MMS, AMMS and TMMS with AOR splittings and β = α in
//! double precision. The colour is the number of sweeps, or the way the solve failed; the outline
//! is what a witness proves. The numbers, also of β = α − 0.2 and of single precision, go to CSV
//! files beside the charts. One more chart has the α that Young's theory predicts beside the best.
//! A problem of `--scene` has one map, and nothing else is measured.
//! Ends with an error if a method fails inside what is proved.

use std::{collections::BTreeMap, path::Path};

use clap::Args;
use hlcp::files::printable;
use hlcp_core::{Aor, Scalar};
use hlcp_methods::{Outcome, Status};
use hlcp_verify::{Convergence, convergence, theorem_2};
use indicatif::ProgressBar;
use kuva::plot::MarkerShape;

use super::{Charts, methods::tuned, optimal_alpha, own::Own, run::to, table::Table};
use crate::{
    Fallible,
    chart::{COLOURS, Panel, shade, write},
    print,
    progress::counting,
    scenes::Problem,
};

const EXAMPLES: &str = "\
Examples:
  hlcp stability-map --scene bearing2d --nx 31 --ny 15 --out target/charts
  hlcp stability-map --a A.mtx --b B.mtx --q q.mtx --out target/charts";

/// Draw where each method converges over the plane of α and τ, and how fast
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(flatten)]
    charts: Charts,
    #[command(flatten)]
    own: Own,
}

/// How a solve ended, and the contraction of its residual by a sweep.
#[derive(Clone, Copy)]
struct Cell {
    alpha: f64,
    tau: f64,
    status: Status,
    sweeps: usize,
    contraction: f64,
}

/// What is drawn of a cell: how the solve ended, and its sweeps.
struct Drawn {
    status: String,
    sweeps: f64,
    proved: bool,
}

/// What is known of a cell without a solve.
#[derive(Clone, Copy, PartialEq)]
struct Known {
    theorem_2: bool,
    witness: bool,
}

/// The plane: `α` and `τ` at the multiples of a step, so that τ = 1, the whole of Theorem 2's
/// region on most scenes, is a row.
struct Plane {
    axis: Vec<f64>,
    step: f64,
}

/// Many times what the best cells need.
const SWEEPS: usize = 3000;

/// The methods, and how the panels call them.
const METHODS: [(&str, &str); 3] =
    [("MAOR", "MMS (MAOR)"), ("AMAOR", "AMMS (AMAOR)"), ("TMAOR", "TMMS (TMAOR)")];

const COLUMNS: &str =
    "method|precision|alpha|beta|tau|outcome|sweeps|contraction|theorem 2|proved by witness";

pub(crate) fn run(Arguments { charts, own }: &Arguments) -> Fallible<()> {
    let Charts { quick, out, .. } = charts;
    let plane = if *quick { Plane::new(2) } else { Plane::new(10) };
    let is_own = own.is_asked();
    let (maps, name) = match is_own {
        true => (vec![(own.file(), own.clone())], format!("stability-map{}", own.options())),
        false => (maps(*quick), "stability-map".to_owned()),
    };
    let path = |file: &str| out.join(format!("stability-{file}"));
    let measured = charts.measured(&name, || {
        let bar = counting(maps.len() * METHODS.len() * 4);
        for (file, own) in &maps {
            measure(own, &plane, &bar)?.write_csv(&path(file))?;
        }
        bar.finish_and_clear();
        if is_own { Ok(()) } else { optimal_alpha::measure(out, *quick) }
    })?;
    for (file, own) in &maps {
        draw(&own.title(), &plane, &path(file), &measured)?;
    }
    if !is_own {
        optimal_alpha::draw(out, &measured)?;
    }
    print::line(format_args!("wrote the maps to {}", printable(out.display())))?;
    Ok(())
}

fn measure(own: &Own, plane: &Plane, bar: &ProgressBar) -> Fallible<Table> {
    let (wide, narrow) = (own.wide()?, own.narrow()?);
    let mut table = Table::new(COLUMNS);
    for lag in [0.0, 0.2] {
        for (method, _) in METHODS {
            let known = plane.cells(lag, |parameters| known(&wide, method, parameters))?;
            let in_f64 = plane.cells(lag, |parameters| solve(&wide, method, parameters))?;
            bar.inc(1);
            let in_f32 = plane.cells(lag, |parameters| solve(&narrow, method, parameters))?;
            bar.inc(1);
            let title = format!("{}: {method}, β = α − {lag}", own.title());
            let words = inside(&in_f64, &known).map_err(|why| format!("{title}: {why}"))?;
            bar.suspend(|| print::line(format_args!("{title}: {words}")))?;
            for (precision, cells) in [("f64", &in_f64), ("f32", &in_f32)] {
                for (cell, Known { theorem_2, witness }) in cells.iter().zip(&known) {
                    let Cell { alpha, tau, status, sweeps, contraction } = cell;
                    let beta = alpha - lag;
                    table.row(&format!(
                        "{method}|{precision}|{alpha}|{beta:.2}|{tau}|{status}|{sweeps}|{contraction:.6}|{theorem_2}|{witness}"
                    ));
                }
            }
        }
    }
    Ok(table)
}

impl Plane {
    /// Multiples of `1/parts` up to 2, from 0.2 on.
    fn new(parts: u8) -> Self {
        let parts = f64::from(parts);
        let axis = (1..).map(|k| f64::from(k) / parts);
        Self {
            axis: axis.skip_while(|&v| v < 0.2).take_while(|&v| v <= 2.0).collect(),
            step: 1.0 / parts,
        }
    }

    /// `α` and `τ` of each cell, `α` running fastest.
    fn places(&self) -> impl Iterator<Item = (f64, f64)> {
        self.axis.iter().flat_map(|&tau| self.axis.iter().map(move |&alpha| (alpha, tau)))
    }

    /// A value for each cell by α, β, which is so much less, and τ.
    fn cells<V>(&self, lag: f64, value: impl Fn([f64; 3]) -> Fallible<V>) -> Fallible<Vec<V>> {
        self.places().map(|(alpha, tau)| value([alpha, alpha - lag, tau])).collect()
    }

    fn range(&self) -> (f64, f64) {
        let (first, last) = (self.axis[0], self.axis[self.axis.len() - 1]);
        (first - 0.5 * self.step, last + 0.5 * self.step)
    }

    /// The boundary of a set of cells that is an interval of `α` in each of a few adjacent rows.
    fn boundary(&self, inside: impl Fn(usize) -> bool) -> Vec<(f64, f64)> {
        let (width, half) = (self.axis.len(), 0.5 * self.step);
        let (mut right, mut left) = (vec![], vec![]);
        for (row, &tau) in self.axis.iter().enumerate() {
            let mut columns = (0..width).filter(|column| inside(row * width + column));
            let Some(first) = columns.next() else { continue };
            let last = columns.next_back().unwrap_or(first);
            for edge in [tau - half, tau + half] {
                right.push((self.axis[last] + half, edge));
                left.push((self.axis[first] - half, edge));
            }
        }
        let start = right.first().copied();
        right.into_iter().chain(left.into_iter().rev()).chain(start).collect()
    }
}

/// The problems of the maps, with a part of the names of their files.
fn maps(quick: bool) -> Vec<(String, Own)> {
    let [m, cells] = if quick { [8.0, 12.0] } else { [32.0; 2] };
    let mut maps = vec![];
    for (file, number, scene, shift) in [
        ("example1", 1, "example1", 4.0),
        ("example1-unshifted", 1, "example1", 0.0),
        ("example2", 2, "example2", 4.0),
    ] {
        let title = format!("Example {number}, m = {m}, μ = ν = {shift}");
        let numbers = [("m", m), ("mu", shift), ("nu", shift)];
        maps.push((file.to_owned(), Own::scene(scene, &numbers, title)));
    }
    for (scene, title, m) in [
        ("disc-lcp", format!("disc-lcp, m = {m}"), m),
        ("disc-hlcp", format!("disc-hlcp, m = {m}"), m),
        ("slider", format!("slider, {cells} cells"), cells),
    ] {
        maps.push((scene.to_owned(), Own::scene(scene, &[("m", m)], title)));
    }
    maps
}

fn solve<T: Scalar>(
    problem: &Problem<T>,
    method: &str,
    [alpha, beta, tau]: [f64; 3],
) -> Fallible<Cell> {
    let per_iteration = if method.starts_with('T') { 2 } else { 1 };
    let solver = problem.solved_by(&tuned(method, [alpha, beta])?, tau)?;
    let mut solver = solver.with_history(SWEEPS + 1);
    let relative = if T::epsilon().wide() > 1e-12 { 1e-5 } else { 1e-12 };
    let limits = to(relative, SWEEPS / per_iteration, None);
    let (outcome, _) = problem.march(&mut solver, (&problem.start(), true), &limits, None)?;
    // The second half of the history, where the start is forgotten.
    let history = solver.history();
    let (half, last) = (history.len() / 2, history.len() - 1);
    let sweeps = ((last - half) * per_iteration).max(1) as f64;
    let contraction = (history[last].l2 / history[half].l2).powf(1.0 / sweeps);
    let Outcome { status, sweeps, .. } = outcome;
    Ok(Cell { alpha, tau, status, sweeps, contraction })
}

/// What the theorems say of the method.
fn known(problem: &Problem<f64>, method: &str, [alpha, beta, tau]: [f64; 3]) -> Fallible<Known> {
    let problem = problem.hlcp(tau)?;
    let steps = tuned(method, [alpha, beta])?.steps(&problem)?.ok_or("a method of the paper")?;
    let witness = matches!(convergence(&problem, &steps), Convergence::Proved(..));
    // The theorem is the same for one step and for two, and its region is drawn for AMMS as well.
    let plain = [Aor::new(alpha, beta)?];
    Ok(Known { witness, theorem_2: witness && theorem_2(&problem, &plain).applies() })
}

/// Counts how the solves end where convergence is proved.
///
/// # Errors
///
/// Where a solve diverges or cycles. One that runs out of sweeps, or stagnates by rounding, is no
/// contradiction.
fn inside(cells: &[Cell], known: &[Known]) -> Fallible<String> {
    let inside: Vec<_> = cells.iter().zip(known).filter(|(_, known)| known.witness).collect();
    let words = ends(inside.iter().map(|(cell, _)| cell.status.to_string()));
    let fails = |cell: &Cell| matches!(cell.status, Status::Diverged(_) | Status::Cycling { .. });
    match inside.iter().find(|(cell, _)| fails(cell)) {
        Some((Cell { alpha, tau, status, .. }, _)) => {
            Err(format!("{words}; it is {status} at α = {alpha}, τ = {tau}").into())
        }
        None => Ok(words),
    }
}

/// Counts the ways in which solves end, those that converge first.
fn ends(solves: impl Iterator<Item = String>) -> String {
    let mut counts = BTreeMap::new();
    solves.for_each(|end| *counts.entry(end).or_insert(0) += 1);
    let converged = counts.remove("converged").unwrap_or(0);
    let n = converged + counts.values().sum::<usize>();
    let others: String = counts.iter().map(|(end, count)| format!(", {count} {end}")).collect();
    format!("of {n} cells with a proof {converged} converge{others}")
}

/// The ways to fail, as in the data and as on the chart, with their colours and marks.
const FAILURES: [(&str, &str, &str, MarkerShape); 4] = [
    ("diverged", "diverges", COLOURS[1], MarkerShape::Cross),
    ("cycling", "cycles", COLOURS[3], MarkerShape::Circle),
    ("stagnated", "stagnates", COLOURS[2], MarkerShape::Triangle),
    ("iteration limit", "> 3000 sweeps", "#b8b8b8", MarkerShape::Plus),
];

/// Numbers of sweeps that part the colours.
const STEPS: [f64; 9] = [10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 3000.0];

fn draw(title: &str, plane: &Plane, path: &Path, measured: &str) -> Fallible<()> {
    let mut panels: Vec<Vec<Drawn>> = METHODS.map(|_| vec![]).into();
    for (_, row) in Table::rows_of(&path.with_extension("csv"), COLUMNS)? {
        let [method, precision, alpha, beta, _, status, sweeps, _, _, proved] = row;
        let panel = METHODS.iter().position(|(name, _)| *name == method);
        let is_drawn = precision == "f64" && alpha.parse::<f64>()? == beta.parse::<f64>()?;
        if let Some(panel) = panel.filter(|_| is_drawn) {
            let (sweeps, proved) = (sweeps.parse()?, proved.parse()?);
            panels[panel].push(Drawn { status, sweeps, proved });
        }
    }
    let cells = plane.axis.len() * plane.axis.len();
    if panels.iter().any(|panel| panel.len() != cells) {
        let path = printable(path.display());
        return Err(format!("{path}.csv is not of {cells} cells a method; measure it anew").into());
    }
    // The colours begin where the fastest cell is and end where the slowest is.
    let sweeps = || {
        let converged = panels.iter().flatten().filter(|cell| cell.status == "converged");
        converged.map(|cell| cell.sweeps)
    };
    let [least, most] = [sweeps().fold(f64::MAX, f64::min), sweeps().fold(0.0, f64::max)];
    let first = STEPS.iter().position(|&step| least <= step).unwrap_or(STEPS.len() - 1);
    let last = STEPS.iter().position(|&step| most <= step).unwrap_or(STEPS.len() - 1);
    let steps = &STEPS[first..=last.max(first)];
    let label = |(k, step): (usize, &f64)| {
        let unit = if k == 0 { " sweeps" } else { "" };
        let share = k as f64 / (steps.len() - 1).max(1) as f64;
        (format!("≤ {step}{unit}"), shade(share))
    };
    let mut classes: Vec<_> = steps.iter().enumerate().map(label).collect();
    let is_seen = |status: &str| panels.iter().flatten().any(|cell| cell.status == status);
    let failures: Vec<_> = FAILURES.into_iter().filter(|(status, ..)| is_seen(status)).collect();
    classes
        .extend(failures.iter().map(|(_, name, colour, _)| (name.to_string(), colour.to_string())));
    let class = |cell: &Drawn| {
        let failure = failures.iter().position(|(status, ..)| *status == cell.status);
        let place = match failure {
            Some(k) => steps.len() + k,
            None => steps.iter().position(|&step| cell.sweeps <= step).unwrap_or(steps.len() - 1),
        };
        place as f64
    };
    let axes = |k| ["relaxation α", if k == 0 { "scaling τ of Ω = τ D_A / D_B" } else { "" }];
    let range = plane.range();
    let panel = |(k, cells): (usize, Vec<Drawn>)| {
        let rows = cells.chunks(plane.axis.len()).map(|row| row.iter().map(class).collect());
        let ranges = [range, range];
        let mut panel = Panel::classes(METHODS[k].1, axes(k), ranges, rows.collect(), &classes);
        for (status, name, _, marker) in &failures {
            let failed =
                cells.iter().zip(plane.places()).filter(|(cell, _)| cell.status == *status);
            let at: Vec<_> = failed.map(|(_, place)| place).collect();
            panel = panel.marks(name, ("white", *marker, 2.5), &at);
        }
        let proved = plane.boundary(|k| cells[k].proved);
        panel.border("convergence proved", "5 3", &proved)
    };
    let proved = |(cells, (method, _)): (&Vec<Drawn>, _)| {
        let inside = cells.iter().filter(|cell| cell.proved);
        format!("{method}: {}", ends(inside.map(|cell| cell.status.clone())))
    };
    let words: Vec<_> = panels.iter().zip(METHODS).map(proved).collect();
    let panels = panels.into_iter().enumerate().map(panel).collect();
    let caption = format!(
        "{title}: to ‖A z − B r + q‖₂ ≤ 10⁻¹² ‖q‖₂ from x⁰ = e, β = α, in double precision. {}.\n{measured}",
        words.join("; ")
    );
    write(path, 3, 300.0, panels, &caption)
}
