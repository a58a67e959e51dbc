//! What is compared: one line a series.

use std::error::Error;

use hlcp_core::{Aor, Hlcp, Omega, Scalar};
use hlcp_methods::{
    Anderson, Auto, Cycle, FullMultigrid, Limits, Method, Multigrid, Named, Newton, Options,
    Outcome, Parameters, Solver, Ssor, Tmms, TridiagonalPart, solve_mixed,
};
use hlcp_verify::{Disc, Example};

#[cfg(feature = "faer")]
use crate::newton;
use crate::{
    problem::{Posed, Problem, Scene},
    projected,
};

/// What became of one solve.
pub(crate) struct Run {
    pub(crate) seconds: f64,
    /// Half-steps, where the series has such a thing.
    pub(crate) sweeps: Option<usize>,
    /// Whether the residual reached the tolerance.
    pub(crate) reached: bool,
    pub(crate) z: Vec<f64>,
    pub(crate) r: Vec<f64>,
}

/// Solves a problem until `‖A z − B r + q‖₂ ≤ tolerance·‖q‖₂`; nothing where the series does not apply.
pub(crate) type Solve = fn(&Problem, f64) -> Result<Option<Run>, Box<dyn Error>>;

/// The methods in double precision, with the outside anchors last.
pub(crate) const METHODS: &[(&str, Solve)] = &[
    ("MGS", |p, tolerance| paper(p, "MAOR", GAUSS_SEIDEL, tolerance)),
    ("MSOR, best", |p, tolerance| paper(p, "MAOR", best(p)[0][0], tolerance)),
    ("MAOR, best", |p, tolerance| paper(p, "MAOR", best(p)[0][1], tolerance)),
    ("AMGS", |p, tolerance| paper(p, "AMAOR", GAUSS_SEIDEL, tolerance)),
    ("AMSOR, best", |p, tolerance| paper(p, "AMAOR", best(p)[1][0], tolerance)),
    ("AMAOR, best", |p, tolerance| paper(p, "AMAOR", best(p)[1][1], tolerance)),
    ("TMGS", |p, tolerance| paper(p, "TMAOR", GAUSS_SEIDEL, tolerance)),
    ("TMSOR, best", |p, tolerance| paper(p, "TMAOR", best(p)[2][0], tolerance)),
    ("TMAOR, best", |p, tolerance| paper(p, "TMAOR", best(p)[2][1], tolerance)),
    ("projected SOR", projected::solve),
    #[cfg(feature = "faer")]
    ("Newton, sparse LU", newton::solve),
];

/// What goes beyond the paper, with the paper's plainest and fastest for comparison, and the anchors.
pub(crate) const BEYOND: &[(&str, Solve)] = &[
    ("TMGS", |p, tolerance| paper(p, "TMAOR", GAUSS_SEIDEL, tolerance)),
    ("AMSOR, best", |p, tolerance| paper(p, "AMAOR", best(p)[1][0], tolerance)),
    ("Anderson (10), TMGS", |p, tolerance| {
        beyond(p, tolerance, |p| Ok(Box::new(Anderson::new(tmgs(p)?, 10)?)))
    }),
    ("Newton, lines", |p, tolerance| {
        beyond(p, tolerance, |p| Ok(Box::new(Newton::new(tmgs(p)?, TridiagonalPart::new()))))
    }),
    ("Newton, SSOR", |p, tolerance| {
        beyond(p, tolerance, |p| Ok(Box::new(Newton::new(tmgs(p)?, Ssor))))
    }),
    ("multigrid, W", |p, tolerance| {
        beyond(p, tolerance, |p| Ok(Box::new(Multigrid::new(p, Cycle::W)?)))
    }),
    ("full multigrid", |p, tolerance| {
        beyond(p, tolerance, |p| Ok(Box::new(FullMultigrid::new(Multigrid::new(p, Cycle::F)?))))
    }),
    ("auto", |p, tolerance| beyond(p, tolerance, |p| Ok(Box::new(Auto::new(p)?)))),
    ("projected SOR", projected::solve),
    #[cfg(feature = "faer")]
    ("Newton, sparse LU", newton::solve),
];

/// Two methods in double, single and mixed precision.
pub(crate) const PRECISIONS: &[(&str, Solve)] = &[
    ("TMGS, f64", |p, tolerance| paper(p, "TMAOR", GAUSS_SEIDEL, tolerance)),
    ("TMGS, f32", |p, tolerance| single(p, "TMAOR", GAUSS_SEIDEL, tolerance)),
    ("TMGS, mixed", |p, tolerance| mixed(p, "TMAOR", GAUSS_SEIDEL, tolerance)),
    ("AMSOR, f64", |p, tolerance| paper(p, "AMAOR", best(p)[1][0], tolerance)),
    ("AMSOR, f32", |p, tolerance| single(p, "AMAOR", best(p)[1][0], tolerance)),
    ("AMSOR, mixed", |p, tolerance| mixed(p, "AMAOR", best(p)[1][0], tolerance)),
];

/// `(α, β, τ)` of Gauss–Seidel.
const GAUSS_SEIDEL: [f64; 3] = [1.0, 1.0, 1.0];

/// The best known `(α, β, τ)` of MMS, AMMS and TMMS, each with SOR and with AOR: those of docs/stability.md.
fn best(problem: &Problem) -> [[[f64; 3]; 2]; 3] {
    match problem.scene {
        Scene::Paper { example: Example { symmetric: true, .. }, .. } => [
            [[1.1, 1.1, 1.0], [1.0, 1.4, 0.8]],
            [[1.1, 1.1, 1.0], [1.0, 1.4, 0.8]],
            [[1.1, 1.1, 1.0], [1.0, 1.2, 0.8]],
        ],
        Scene::Paper { .. } => [
            [[1.0, 1.0, 0.8], [1.0, 1.2, 0.8]],
            [[1.0, 1.0, 1.0], [1.0, 1.2, 1.0]],
            [[1.1, 1.1, 1.0], [1.0, 1.2, 0.8]],
        ],
        Scene::Slider(_) => [
            [[1.3, 1.3, 0.8], [1.5, 1.3, 0.8]],
            [[1.5, 1.5, 0.6], [1.3, 1.5, 0.6]],
            [[1.3, 1.3, 0.8], [1.1, 1.5, 0.4]],
        ],
        // The best α of AMSOR grows with the grid as that of SOR does on a linear system.
        Scene::Disc(Disc { lcp: true, m }) => [
            [[1.1, 1.1, 0.6], [1.1, 1.5, 0.4]],
            [[2.0 - 6.4 / m as f64, 2.0 - 6.4 / m as f64, 1.0], [1.6, 1.6, 0.8]],
            [[1.3, 1.3, 1.0], [1.0, 1.4, 0.4]],
        ],
        Scene::Disc(Disc { lcp: false, m }) => [
            [[1.6, 1.6, 1.0], [1.4, 1.8, 0.6]],
            [[2.0 - 6.4 / m as f64, 2.0 - 6.4 / m as f64, 1.0], [1.6, 1.6, 0.8]],
            [[1.5, 1.5, 1.0], [1.3, 1.7, 0.6]],
        ],
    }
}

/// More sweeps than any series needs that gets there at all.
const SWEEPS: usize = 60_000;

type Boxed<'p, T> =
    Box<dyn Method<T, A = &'p dyn hlcp_core::Rows<T>, B = &'p dyn hlcp_core::Rows<T>> + 'p>;

fn method<'p, T: Scalar>(
    posed: &'p Posed<T>,
    name: &str,
    [alpha, beta, tau]: [f64; 3],
) -> Result<Solver<T, Boxed<'p, T>>, Box<dyn Error>> {
    let parameters = Parameters { alpha: Some(alpha), beta: Some(beta), ..Parameters::default() };
    let tau = T::from(tau).unwrap_or_else(T::nan);
    let omega = Omega::diagonal_ratio(tau, &posed.a, &posed.b)?;
    let (a, b): (&dyn hlcp_core::Rows<T>, &dyn hlcp_core::Rows<T>) = (&*posed.a, &*posed.b);
    Ok(Solver::new(Named::parse(name, parameters)?.on(Hlcp::new(a, b, omega)?)?))
}

type Posed64<'p> = Hlcp<f64, &'p dyn hlcp_core::Rows<f64>, &'p dyn hlcp_core::Rows<f64>>;

fn tmgs(
    problem: Posed64<'_>,
) -> Result<impl Method<f64, A = Operator<'_>, B = Operator<'_>>, hlcp_core::Error> {
    Tmms::mirrored(problem, Aor::gauss_seidel())
}

type Operator<'p> = &'p dyn hlcp_core::Rows<f64>;

/// A method beyond the paper with τ = 1, where it takes such operators.
fn beyond(
    problem: &Problem,
    tolerance: f64,
    method: impl Fn(Posed64<'_>) -> Result<Boxed<'_, f64>, hlcp_core::Error>,
) -> Result<Option<Run>, Box<dyn Error>> {
    let posed = &problem.wide;
    let omega = Omega::diagonal_ratio(1.0, &posed.a, &posed.b)?;
    let method = match method(Hlcp::new(&*posed.a, &*posed.b, omega)?) {
        Err(hlcp_core::Error::NotFivePoint { .. }) => return Ok(None),
        method => method?,
    };
    let mut solver = Solver::new(method);
    let x0 = vec![1.0; posed.q.len()];
    let outcome = solver.solve(&posed.q, Options::from_x(&x0).limits(limits("T", tolerance)))?;
    Ok(Some(run(outcome, solver.z(), solver.r())))
}

fn limits(name: &str, tolerance: f64) -> Limits {
    let iterations = SWEEPS / if name.starts_with('T') { 2 } else { 1 };
    Limits { rounding: Some(0.0), iterations, ..Limits::relative(tolerance) }
}

fn run<T: Scalar>(outcome: Outcome, z: &[T], r: &[T]) -> Run {
    let wide = |v: &[T]| v.iter().map(|v| v.to_f64().unwrap_or(f64::NAN)).collect();
    let Outcome { elapsed, sweeps, .. } = outcome;
    let seconds = elapsed.as_secs_f64();
    Run { seconds, sweeps: Some(sweeps), reached: outcome.converged(), z: wide(z), r: wide(r) }
}

fn paper(
    problem: &Problem,
    name: &str,
    parameters: [f64; 3],
    tolerance: f64,
) -> Result<Option<Run>, Box<dyn Error>> {
    in_precision(&problem.wide, name, parameters, tolerance)
}

fn single(
    problem: &Problem,
    name: &str,
    parameters: [f64; 3],
    tolerance: f64,
) -> Result<Option<Run>, Box<dyn Error>> {
    in_precision(&problem.narrow, name, parameters, tolerance)
}

fn in_precision<T: Scalar>(
    posed: &Posed<T>,
    name: &str,
    parameters: [f64; 3],
    tolerance: f64,
) -> Result<Option<Run>, Box<dyn Error>> {
    let mut solver = method(posed, name, parameters)?;
    let x0 = vec![T::one(); posed.q.len()];
    let outcome = solver.solve(&posed.q, Options::from_x(&x0).limits(limits(name, tolerance)))?;
    Ok(Some(run(outcome, solver.z(), solver.r())))
}

fn mixed(
    problem: &Problem,
    name: &str,
    parameters: [f64; 3],
    tolerance: f64,
) -> Result<Option<Run>, Box<dyn Error>> {
    let mut double = method(&problem.wide, name, parameters)?;
    let mut narrow = method(&problem.narrow, name, parameters)?;
    let (q, x0) = (&problem.wide.q, vec![1.0; problem.wide.q.len()]);
    let outcome = solve_mixed(&mut narrow, &mut double, q, &x0, &limits(name, tolerance))?;
    Ok(Some(run(outcome, double.z(), double.r())))
}
