//! `hlcp stability-map`: how fast, and whether, each method converges over the plane of α and τ.
//!
//! For each scene and each of MMS, AMMS and TMMS with β = α and β = α − 0.2, in double and in
//! single precision, the colour is the asymptotic contraction of the residual, as sweeps for a
//! digit; marks tell how a solve failed. The solid outline is Theorem 2's region, the dashed one
//! what a witness proves. One more chart has the α that Young's theory predicts beside the best.
//! Charts and their numbers as CSV go to `docs/charts`. Ends with an error if a method fails inside
//! what is proved.

use clap::Args;
use hlcp::files::printable;
use hlcp_core::{Aor, Scalar};
use hlcp_methods::{Outcome, Status};
use hlcp_verify::{Convergence, convergence, theorem_2};
use kuva::plot::MarkerShape;

use super::{
    Charts,
    methods::tuned,
    optimal_alpha,
    run::{Fallible, march, to},
    table::Table,
};
use crate::{
    chart::{Panel, provenance, write},
    print,
    progress::counting,
    scenes::{Problem, Scene},
};

const EXAMPLES: &str = "\
Examples:
  hlcp stability-map --quick
  hlcp stability-map --out target/charts";

/// Draw where each method converges over the plane of α and τ, and how fast
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(flatten)]
    charts: Charts,
}

/// A scene in two precisions.
struct Posed {
    file: &'static str,
    title: String,
    wide: Problem<f64>,
    narrow: Problem<f32>,
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

const METHODS: [&str; 3] = ["MAOR", "AMAOR", "TMAOR"];

pub(crate) fn run(Arguments { charts }: &Arguments) -> Fallible<()> {
    let Charts { quick, out } = charts;
    let plane = if *quick { Plane::new(4) } else { Plane::new(10) };
    let suffix = if *quick { " --quick" } else { "" };
    let provenance = provenance(&format!("cargo run --release -- stability-map{suffix}"));
    let scenes = scenes(*quick)?;
    let bar = counting(scenes.len() * METHODS.len() * 4);
    for scene in &scenes {
        let mut panels = vec![];
        let mut table = Table::new(
            "method|precision|alpha|beta|tau|outcome|sweeps|contraction|theorem 2|proved by witness",
        );
        for (lag, beta) in [(0.0, "α"), (0.2, "α − 0.2")] {
            for method in METHODS {
                let known = plane
                    .cells(|alpha, tau| known(&scene.wide, method, [alpha, alpha - lag, tau]))?;
                let wide = plane
                    .cells(|alpha, tau| solve(&scene.wide, method, [alpha, alpha - lag, tau]))?;
                bar.inc(1);
                let narrow = plane
                    .cells(|alpha, tau| solve(&scene.narrow, method, [alpha, alpha - lag, tau]))?;
                bar.inc(1);
                contradictions(&scene.title, &wide, &known)?;
                for (precision, cells) in [("f64", &wide), ("f32", &narrow)] {
                    let title = format!("{method}, β = {beta}, {precision}");
                    panels.push(panel(&title, &plane, cells, &known));
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
        let caption = format!(
            "{}: to ‖A z − B r + q‖₂ ≤ 10⁻¹² ‖q‖₂ (f32: 10⁻⁵) within {SWEEPS} sweeps from x⁰ = e\n{provenance}",
            scene.title
        );
        let path = out.join(format!("stability-{}", scene.file));
        write(&path, 2, panels, &caption)?;
        table.write_csv(&path)?;
    }
    bar.finish_and_clear();
    optimal_alpha::draw(out, *quick, &provenance)?;
    print::line(format_args!("wrote the maps to {}", printable(out.display())))?;
    Ok(())
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

    /// A value for each cell, `α` running fastest.
    fn cells<V>(&self, mut value: impl FnMut(f64, f64) -> Fallible<V>) -> Fallible<Vec<V>> {
        let pairs =
            self.axis.iter().flat_map(|&tau| self.axis.iter().map(move |&alpha| (alpha, tau)));
        pairs.map(|(alpha, tau)| value(alpha, tau)).collect()
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

fn scenes(quick: bool) -> Result<Vec<Posed>, hlcp_core::Error> {
    let [m, cells] = if quick { [8, 12] } else { [32, 32] };
    let posed = |file, title, name, given: &[(&'static str, f64)]| {
        let scene = Scene::of(name);
        let numbers = scene.numbers(given);
        let (wide, narrow) = ((scene.wide)(&numbers)?, (scene.narrow)(&numbers)?);
        Ok(Posed { file, title, wide, narrow })
    };
    let mut scenes = vec![];
    for (file, number, name, shift) in [
        ("example1", 1, "example1", 4.0),
        ("example1-unshifted", 1, "example1", 0.0),
        ("example2", 2, "example2", 4.0),
    ] {
        let title = format!("Example {number}, m = {m}, μ = {shift}, ν = {shift}");
        scenes.push(posed(file, title, name, &[("m", m.into()), ("mu", shift), ("nu", shift)])?);
    }
    for name in ["disc-lcp", "disc-hlcp"] {
        scenes.push(posed(name, format!("{name}, m = {m}"), name, &[("m", m.into())])?);
    }
    let title = format!("slider, N = {cells}");
    scenes.push(posed("slider", title, "slider", &[("m", cells.into())])?);
    Ok(scenes)
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
    let outcome = march(problem, &mut solver, &limits, true)?;
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

/// Refuses a proof that a solve contradicts.
fn contradictions(title: &str, cells: &[Cell], known: &[Known]) -> Fallible<()> {
    for (cell, known) in cells.iter().zip(known) {
        let failed = matches!(cell.status, Status::Diverged(_) | Status::Cycling { .. });
        if known.witness && failed {
            let Cell { alpha, tau, status, .. } = cell;
            return Err(format!(
                "{title}: {status} at α = {alpha}, τ = {tau}, where convergence is proved"
            )
            .into());
        }
    }
    Ok(())
}

/// A map with marks for failures and outlines of what is known.
fn panel(title: &str, plane: &Plane, cells: &[Cell], known: &[Known]) -> Panel {
    let runs_on = |cell: &Cell| matches!(cell.status, Status::Converged | Status::IterationLimit);
    // Sweeps for a digit: 1/(−log₁₀ of the contraction), without bound where there is none.
    let colour = |cell: &Cell| match cell.contraction {
        _ if !runs_on(cell) => f64::NAN,
        rate if rate < 1.0 => (-rate.log10()).recip().log10(),
        _ => f64::INFINITY,
    };
    let rows: Vec<Vec<f64>> =
        cells.chunks(plane.axis.len()).map(|row| row.iter().map(colour).collect()).collect();
    let range = plane.range();
    let mut panel = Panel::field(
        title,
        ["α", "τ"],
        [range, range],
        &rows,
        ("log₁₀ of the sweeps for a digit, grey where there is none", 0.0, 3.0),
    );
    for (name, colour, marker) in FAILURES {
        let failed = cells.iter().filter(|cell| cell.status.to_string() == name);
        let at: Vec<(f64, f64)> = failed.map(|cell| (cell.alpha, cell.tau)).collect();
        panel = panel.marks(name, colour, marker, &at);
    }
    let witness = plane.boundary(|k| known[k].witness);
    let theorem_2 = plane.boundary(|k| known[k].theorem_2);
    // Black on white dashes show on light and on dark.
    panel
        .outline("", "white", "", &witness)
        .outline("proved by witness", "black", "4 4", &witness)
        .outline("Theorem 2", "black", "", &theorem_2)
}

/// The marks of the ways to fail: name, colour, shape.
const FAILURES: [(&str, &str, MarkerShape); 4] = [
    ("diverged", "#D55E00", MarkerShape::Cross),
    ("cycling", "#000000", MarkerShape::Circle),
    ("stagnated", "#0072B2", MarkerShape::Triangle),
    ("iteration limit", "#E69F00", MarkerShape::Plus),
];
