//! The runs of a method on a problem, and what is wrong with them.

use std::{
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use hlcp_core::{FivePoint, Hlcp, Omega, Rows, Scalar};
use hlcp_methods::{BoxedMethod, Limits, Options, Progress, Solver};
use num_traits::ToPrimitive;

use crate::{
    common::{Lists, named},
    oracle::{exact, residual_squared},
    problems::{Case, Matrix},
};

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Precision {
    Single,
    Double,
}

pub(crate) fn lists<T: Scalar>(matrix: &Matrix) -> Lists<T> {
    let row = |row: &Vec<i64>| {
        let entries = row.iter().enumerate().filter(|(_, entry)| **entry != 0);
        entries.map(|(j, entry)| (j, T::of(*entry as f64))).collect()
    };
    Lists(matrix.iter().map(row).collect())
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fault {
    /// Converged, where no solution is.
    FalseConverged,
    /// Converged, with an exact residual above what was asked.
    Inexact,
    /// Not converged, and an iterate before the answer had a smaller residual.
    LostBest,
    /// An entry of z or r that is not finite or negative, or two that are both positive.
    Unsound,
    Panicked,
}

/// One run in numbers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Run {
    pub(crate) converged: bool,
    /// The exact residual over what was asked, of a run that converged.
    pub(crate) over_asked: f64,
    pub(crate) faults: Vec<(Fault, String)>,
}

type Operator<T> = Arc<dyn Rows<T>>;
type Posed<T> = Hlcp<T, Operator<T>, Operator<T>>;

/// The runs of a method on a case, from all its starts; none where the method refuses the problem.
pub(crate) fn runs(case: &Case, precision: Precision, name: &str, solvable: bool) -> Vec<Run> {
    match precision {
        // The tolerance in single precision depends on rounding.
        Precision::Single => runs_in::<f32>(case, 1e-3, name, solvable),
        Precision::Double => runs_in::<f64>(case, 1e-10, name, solvable),
    }
}

/// Asks that the exact residual of what converged is at most the part `asked` of ‖q‖.
fn runs_in<T: Scalar>(case: &Case, asked: f64, name: &str, solvable: bool) -> Vec<Run> {
    let operator = |matrix: &Matrix| -> Operator<T> {
        match case.grid {
            Some(nx) => {
                let grid = FivePoint::from_rows(nx, matrix.len() / nx, &lists(matrix));
                Arc::new(grid.expect("a finite matrix on its grid"))
            }
            None => Arc::new(lists(matrix)),
        }
    };
    let (a, b) = (operator(&case.a), operator(&case.b));
    let vector = |v: &[i64]| v.iter().map(|&v| T::of(v as f64)).collect::<Vec<T>>();
    let omega = match &case.omega {
        None => Omega::diagonal_ratio(T::one(), &a, &b).expect("positive diagonals"),
        Some(omega) => Omega::Each(vector(omega)),
    };
    let problem = Hlcp::new(a, b, omega)
        .and_then(|problem| problem.with_gamma(T::of(case.gamma as f64)))
        .and_then(|problem| if case.exchanged { problem.exchanged() } else { Ok(problem) })
        .expect("a sound pair");
    let Ok(method) = named(name, [1.2, 0.9]).on(problem.clone()) else { return vec![] };
    let mut solver = Solver::new(method);
    let mut runs = vec![];
    for start in &case.starts {
        let attempt = || run(case, &problem, &mut solver, &vector(start), asked, solvable);
        match catch_unwind(AssertUnwindSafe(attempt)) {
            Ok(run) => runs.push(run),
            Err(_) => {
                let faults = vec![(Fault::Panicked, "as it says on stderr".to_owned())];
                runs.push(Run { faults, ..Run::default() });
                break; // A solver that panicked is not used again.
            }
        }
    }
    runs
}

/// One run, with its faults.
fn run<T: Scalar>(
    case: &Case,
    problem: &Posed<T>,
    solver: &mut Solver<T, BoxedMethod<'static, T, Operator<T>, Operator<T>>>,
    start: &[T],
    asked: f64,
    solvable: bool,
) -> Run {
    let q: Vec<T> = case.q().into_iter().map(T::of).collect();
    let limits = Limits { iterations: case.iterations, ..Limits::default() };
    let (mut smallest, mut best) = (f64::INFINITY, vec![]);
    let mut note = |progress: &Progress<'_, T>| {
        if progress.residual.l2 < smallest {
            smallest = progress.residual.l2;
            best.clear();
            best.extend_from_slice(progress.x);
        }
        ControlFlow::Continue(())
    };
    let outcome = solver
        .solve(&q, Options::from_x(start).limits(limits).observer(&mut note))
        .expect("finite input");
    let mut run = Run { converged: outcome.converged(), ..Run::default() };
    let mut fault =
        |fault, detail: String| run.faults.push((fault, format!("{outcome}: {detail}")));

    let doubles = |v: &[T]| v.iter().map(|v| v.wide()).collect::<Vec<_>>();
    let [z, r] = [solver.z(), solver.r()].map(doubles);
    for i in 0..q.len() {
        let sound = |v: f64| v.is_finite() && v >= 0.0;
        if !sound(z[i]) || !sound(r[i]) || z[i] > 0.0 && r[i] > 0.0 {
            fault(Fault::Unsound, format!("z[{i}] = {:e}, r[{i}] = {:e}", z[i], r[i]));
        }
    }
    if outcome.converged() {
        if !solvable {
            fault(Fault::FalseConverged, format!("z = {z:?}, r = {r:?} solve nothing"));
        }
        if z.iter().chain(&r).all(|v| v.is_finite()) {
            let q = case.q();
            let bound = asked * q.iter().map(|q| q * q).sum::<f64>().sqrt();
            let squares = residual_squared(case, &q, &z, &r);
            let residual = squares.to_f64().expect("a number").sqrt();
            if squares > exact(bound) * exact(bound) {
                let detail = format!("exact residual {residual:.2e}, asked {bound:.2e}");
                fault(Fault::Inexact, detail);
            }
            run.over_asked = if residual == 0.0 { 0.0 } else { residual / bound };
        }
    } else {
        let bound = smallest + rounding(case, problem, &best);
        if outcome.residual.l2.is_nan() || outcome.residual.l2 > bound {
            let detail = format!("residual {:e}, and {smallest:e} was seen", outcome.residual.l2);
            fault(Fault::LostBest, detail);
        }
    }
    run
}

/// How much two computed norms of the residual at `x` may differ.
///
/// A row sums at most 2n + 1 terms, of A, of BΩ and q, be it from z and r or from x and |x|. Each
/// is rounded three times at most before it is summed, and the sum is divided by γ: 2n + 5
/// roundings of ε/2, of terms that add up to Sᵢ = Σⱼ 2(|aᵢⱼ| + |bᵢⱼ|ωⱼ)|xⱼ|/γ + |qᵢ| at most. Both
/// norms are that near the exact one, so they differ by (2n + 5)ε‖S‖ and, where numbers underflow,
/// as many of the smallest. One rounding is to spare for what is of second order in ε.
fn rounding<T: Scalar>(case: &Case, problem: &Posed<T>, x: &[T]) -> f64 {
    let gamma = problem.gamma().wide();
    let mut squares = 0.0;
    for (i, q) in case.q().into_iter().enumerate() {
        let mut size = q.abs();
        let size_of = |entry: T, j: usize| 2.0 * entry.abs().wide() * x[j].abs().wide() / gamma;
        problem.a().visit_row(i, &mut |j, a| size += size_of(a, j));
        let omega = |j| problem.omega().entry(j).wide();
        problem.b().visit_row(i, &mut |j, b| size += omega(j) * size_of(b, j));
        squares += size * size;
    }
    let count = (2 * x.len() + 6) as f64;
    count * (T::epsilon().wide() * squares.sqrt() + T::min_positive_value().wide())
}
