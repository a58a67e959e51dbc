//! The α that Young's theory predicts for AMSOR beside the best of a scan and the one that
//! `ADAPTIVE` finds: a chart of `hlcp stability-map`, `optimal-alpha`.

use std::path::Path;

use hlcp_core::Diagonal;
use hlcp_methods::{AdaptiveSor, Jacobian, Limits, Outcome, Solver};

use super::{methods::tuned, run::solve, table::Table};
use crate::{
    Fallible,
    chart::{Panel, Series, write},
    scenes::{Problem, Scene},
};

/// Scans half and twice the predicted `2 − α`, and so many steps between.
const STEPS: i32 = 12;

const COLUMNS: &str = "scene|m|predicted alpha|its sweeps|best alpha|its sweeps|adaptive alpha|\
                       its sweeps";

const SCENES: [(&str, &[(&str, f64)]); 4] = [
    ("disc-lcp", &[]),
    ("disc-hlcp", &[]),
    ("obstacle", &[]),
    ("example1", &[("mu", 0.0), ("nu", 0.0)]),
];

pub(crate) fn measure(out: &Path, quick: bool) -> Fallible<()> {
    let sizes: &[u32] = if quick { &[7, 15] } else { &[15, 23, 31, 47, 63, 95, 128] };
    let mut table = Table::new(COLUMNS);
    for (name, given) in SCENES {
        for &m in sizes {
            let problem = Scene::of(name).pose(&[given, &[("m", m.into())]].concat())?;
            let (found, at_found, x) = adaptive(&problem)?;
            let mu = jacobi(&problem, &x)?;
            let predicted = 2.0 / (1.0 + (1.0 - mu * mu).sqrt());
            let at_predicted = amsor(&problem, predicted)?.sweeps;
            let mut best = (predicted, at_predicted);
            for step in 0..=STEPS {
                let factor = f64::powf(4.0, f64::from(step) / f64::from(STEPS) - 0.5);
                let alpha = 2.0 - factor * (2.0 - predicted);
                let outcome = amsor(&problem, alpha)?;
                if outcome.converged() && outcome.sweeps < best.1 {
                    best = (alpha, outcome.sweeps);
                }
            }
            table.row(&format!(
                "{name}|{m}|{predicted:.4}|{at_predicted}|{:.4}|{}|{found:.4}|{at_found}",
                best.0, best.1
            ));
        }
    }
    table.write_csv(&out.join("optimal-alpha"))
}

pub(crate) fn draw(out: &Path, measured: &str) -> Fallible<()> {
    let path = out.join("optimal-alpha");
    let rows = Table::rows_of::<8>(&path.with_extension("csv"), COLUMNS)?;
    let mut panels = vec![];
    for (k, (scene, _)) in SCENES.into_iter().enumerate() {
        let mut series = vec![];
        for (name, column) in [("Young, from J(x*)", 2), ("best of a scan", 4), ("ADAPTIVE", 6)] {
            let mut points = vec![];
            for (_, row) in rows.iter().filter(|(_, row)| row[0] == scene) {
                points.push((row[1].parse()?, 2.0 - row[column].parse::<f64>()?));
            }
            series.push(Series { name: name.to_owned(), style: [series.len(); 3], points });
        }
        let y = if k == 0 { "2 − α" } else { "" };
        panels.push(Panel::log_log(scene, ["points per side", y], &series));
    }
    let caption = format!(
        "AMSOR with τ = 1, from x⁰ = e to ‖A z − B r + q‖₂ ≤ 10⁻¹⁰ ‖q‖₂; example1 with μ = ν = 0.\n{measured}"
    );
    write(&path, 4, 240.0, panels, &caption)
}

fn limits() -> Limits {
    Limits::relative(1e-10)
}

fn amsor(problem: &Problem<f64>, alpha: f64) -> Fallible<Outcome> {
    Ok(solve(problem, &tuned("AMSOR", [alpha; 2])?, 1.0, &limits())?.outcome)
}

/// Returns the α and the sweeps of `ADAPTIVE`, and its answer.
fn adaptive(problem: &Problem<f64>) -> Fallible<(f64, usize, Vec<f64>)> {
    let mut solver = Solver::new(AdaptiveSor::new(problem.hlcp(1.0)?)?);
    let (outcome, _) = problem.march(&mut solver, (&problem.start(), true), &limits(), None)?;
    outcome.ok().map_err(|error| format!("ADAPTIVE: {error}"))?;
    Ok((solver.method().alpha(), outcome.sweeps, solver.x().to_vec()))
}

/// The spectral radius of Jacobi's iteration on J(x), a matrix without negative entries, by powers
/// of its mean with the identity. On m × m points the ratio of the eigenvalues of this mean is
/// about 1 − 7/m² on contact sets, so 4m² powers leave less than 10⁻¹⁰.
fn jacobi(problem: &Problem<f64>, x: &[f64]) -> Fallible<f64> {
    let (n, posed) = (x.len(), problem.hlcp(1.0)?);
    let jacobian = Jacobian::new(&posed, x);
    let (mut v, mut s, mut y, mut scratch) = (vec![1.0; n], vec![0.0; n], vec![0.0; n], vec![]);
    let mut largest = 0.0;
    for _ in 0..4 * n {
        // For τ = 1 the diagonals of J(x) and of 2A are the same.
        (0..n).for_each(|j| s[j] = v[j] / problem.a.diagonal_entry(j));
        jacobian.apply(&s, &mut y, &mut scratch);
        v.iter_mut().zip(&y).for_each(|(v, y)| *v -= 0.25 * y);
        largest = v.iter().fold(0.0, |largest, &v| f64::max(largest, v));
        v.iter_mut().for_each(|v| *v /= largest);
    }
    Ok(2.0 * largest - 1.0)
}
