//! The series of the charts: one line each.

#[cfg(feature = "faer")]
use std::time::Instant;
use std::{error::Error, time::Duration};

use Precision::{Double, Mixed, Single};
use Tuning::{Aor, GaussSeidel, Own, Sor};
#[cfg(feature = "faer")]
use hlcp_core::Norms;
use hlcp_core::Scalar;
use hlcp_methods::{
    Limits, Named, Newton, Options, Outcome, Parameters, Solver, Ssor, Tmms, TridiagonalPart,
    solve_mixed,
};

use super::{problem::Problem, projected};
#[cfg(feature = "faer")]
use crate::direct::{self, Form};
use crate::scenes::{self, Boxed, where_it_applies};

/// What became of one solve.
pub(crate) struct Run {
    pub(crate) seconds: f64,
    /// Half-steps, where the series has such a thing.
    pub(crate) sweeps: Option<usize>,
    /// Whether the residual reached the tolerance.
    pub(crate) reached: bool,
    /// The least tolerance for which this would have been the same run; infinite if not known.
    pub(crate) holds: f64,
    pub(crate) z: Vec<f64>,
    pub(crate) r: Vec<f64>,
}

/// A method on a chart.
pub(crate) type Series = (&'static str, Solve);

/// Solves a problem until `‖A z − B r + q‖₂ ≤ tolerance·‖q‖₂`.
#[derive(Clone)]
pub(crate) enum Solve {
    /// A method by its name.
    Named(&'static str, Tuning, Precision),
    /// Newton's method with the given preconditioner, which the name would choose.
    Newton { lines: bool },
    /// Newton's method of others.
    #[cfg(feature = "faer")]
    Direct(Form),
    /// Something else; nothing where it does not apply.
    Anchor(Anchor),
}

type Anchor = fn(&Problem, f64) -> Result<Option<Run>, Box<dyn Error>>;

/// The parameters of a named method.
#[derive(Clone)]
pub(crate) enum Tuning {
    GaussSeidel,
    /// The best known ones with β = α, of a family of the paper.
    Sor(usize),
    /// The best known ones, of a family of the paper.
    Aor(usize),
    /// None, and τ = 1.
    Own,
}

#[derive(Clone)]
pub(crate) enum Precision {
    Double,
    Single,
    Mixed,
}

/// The methods in double precision, with the outside anchors last.
pub(crate) const METHODS: &[Series] = &[
    ("MGS", Solve::Named("MAOR", GaussSeidel, Double)),
    ("MSOR, best", Solve::Named("MAOR", Sor(0), Double)),
    ("MAOR, best", Solve::Named("MAOR", Aor(0), Double)),
    ("AMGS", Solve::Named("AMAOR", GaussSeidel, Double)),
    ("AMSOR, best", Solve::Named("AMAOR", Sor(1), Double)),
    ("AMAOR, best", Solve::Named("AMAOR", Aor(1), Double)),
    ("TMGS", Solve::Named("TMAOR", GaussSeidel, Double)),
    ("TMSOR, best", Solve::Named("TMAOR", Sor(2), Double)),
    ("TMAOR, best", Solve::Named("TMAOR", Aor(2), Double)),
    ("projected SOR", Solve::Anchor(projected::solve)),
    #[cfg(feature = "faer")]
    ("Newton, sparse LU", Solve::Direct(Form::Modulus)),
    #[cfg(feature = "faer")]
    ("FBNS, sparse LU", Solve::Direct(Form::FischerBurmeister)),
];

/// Methods beyond the paper, with the paper's plainest and fastest for comparison, and the anchors.
pub(crate) const BEYOND: &[Series] = &[
    ("TMGS", Solve::Named("TMAOR", GaussSeidel, Double)),
    ("AMSOR, best", Solve::Named("AMAOR", Sor(1), Double)),
    ("Anderson (10), TMGS", Solve::Named("ANDERSON", Own, Double)),
    ("Newton, lines", Solve::Newton { lines: true }),
    ("Newton, SSOR", Solve::Newton { lines: false }),
    ("Newton, AMG", Solve::Named("AMG", Own, Double)),
    ("multigrid, W", Solve::Named("MGW", Own, Double)),
    ("full multigrid", Solve::Named("FMG", Own, Double)),
    ("auto", Solve::Named("AUTO", Own, Double)),
    ("projected SOR", Solve::Anchor(projected::solve)),
    #[cfg(feature = "faer")]
    ("Newton, sparse LU", Solve::Direct(Form::Modulus)),
    #[cfg(feature = "faer")]
    ("FBNS, sparse LU", Solve::Direct(Form::FischerBurmeister)),
];

/// Two methods in double, single and mixed precision.
pub(crate) const PRECISIONS: &[Series] = &[
    ("TMGS, f64", Solve::Named("TMAOR", GaussSeidel, Double)),
    ("TMGS, f32", Solve::Named("TMAOR", GaussSeidel, Single)),
    ("TMGS, mixed", Solve::Named("TMAOR", GaussSeidel, Mixed)),
    ("AMSOR, f64", Solve::Named("AMAOR", Sor(1), Double)),
    ("AMSOR, f32", Solve::Named("AMAOR", Sor(1), Single)),
    ("AMSOR, mixed", Solve::Named("AMAOR", Sor(1), Mixed)),
];

/// `(α, β, τ)` of Gauss–Seidel.
const GAUSS_SEIDEL: [f64; 3] = [1.0, 1.0, 1.0];

/// The best known `(α, β, τ)` of MMS, AMMS and TMMS, each with SOR and with AOR: those of
/// docs/results.md.
fn best(problem: &Problem) -> [[[f64; 3]; 2]; 3] {
    // The best α of AMSOR on the discs grows with the grid as that of SOR does on a linear system.
    let sor = 2.0 - 6.4 / problem.m();
    match problem.posed.scene.name {
        "example1" => [
            [[1.1, 1.1, 1.0], [1.0, 1.4, 0.8]],
            [[1.1, 1.1, 1.0], [1.0, 1.4, 0.8]],
            [[1.1, 1.1, 1.0], [1.0, 1.2, 0.8]],
        ],
        "example2" => [
            [[1.0, 1.0, 0.8], [1.0, 1.2, 0.8]],
            [[1.0, 1.0, 1.0], [1.0, 1.2, 1.0]],
            [[1.1, 1.1, 1.0], [1.0, 1.2, 0.8]],
        ],
        "slider" => [
            [[1.3, 1.3, 0.8], [1.5, 1.3, 0.8]],
            [[1.5, 1.5, 0.6], [1.3, 1.5, 0.6]],
            [[1.3, 1.3, 0.8], [1.1, 1.5, 0.4]],
        ],
        "film" => [[[1.2, 1.2, 1.0]; 2], [[1.4, 1.4, 0.5]; 2], [[1.3, 1.3, 0.8]; 2]],
        "disc-lcp" => [
            [[1.1, 1.1, 0.6], [1.1, 1.5, 0.4]],
            [[sor, sor, 1.0], [1.6, 1.6, 0.8]],
            [[1.3, 1.3, 1.0], [1.0, 1.4, 0.4]],
        ],
        _ => [
            [[1.6, 1.6, 1.0], [1.4, 1.8, 0.6]],
            [[sor, sor, 1.0], [1.6, 1.6, 0.8]],
            [[1.5, 1.5, 1.0], [1.3, 1.7, 0.6]],
        ],
    }
}

/// More sweeps, and more time, than any series needs that gets there at all.
const SWEEPS: usize = 60_000;
const LONGEST: Duration = Duration::from_secs(10);

impl Solve {
    /// What became of one solve; nothing where the method does not take such operators.
    pub(crate) fn run(
        &self,
        problem: &Problem,
        tolerance: f64,
    ) -> Result<Option<Run>, Box<dyn Error>> {
        let (name, tuning, precision) = match self {
            Self::Anchor(solve) => return solve(problem, tolerance),
            #[cfg(feature = "faer")]
            Self::Direct(form) => return factorised(*form, &problem.wide, tolerance).map(Some),
            Self::Newton { lines } => return newton(&problem.wide, *lines, tolerance),
            Self::Named(name, tuning, precision) => (*name, tuning, precision),
        };
        let (parameters, tau) = match tuning {
            Own => (Parameters::default(), 1.0),
            GaussSeidel => open(GAUSS_SEIDEL),
            Sor(family) => open(best(problem)[*family][0]),
            Aor(family) => open(best(problem)[*family][1]),
        };
        let limits = limits(!name.starts_with("MA") && !name.starts_with("AM"), tolerance);
        let method = Named::parse(name, parameters)?;
        let Some(mut wide) = where_it_applies(problem.wide.solved_by(&method, tau))? else {
            return Ok(None);
        };
        Ok(Some(match precision {
            Double => solved(&problem.wide, &mut wide, limits)?,
            Single => {
                solved(&problem.narrow, &mut problem.narrow.solved_by(&method, tau)?, limits)?
            }
            Mixed => {
                let mut narrow = problem.narrow.solved_by(&method, tau)?;
                let (q, start) = (&problem.wide.q, problem.wide.start());
                let outcome = solve_mixed(&mut narrow, &mut wide, q, &start, &limits)?;
                Run::new(outcome, wide.z(), wide.r())
            }
        }))
    }
}

/// Assembling and factorising are part of the time.
#[cfg(feature = "faer")]
fn factorised(
    form: Form,
    problem: &scenes::Problem<f64>,
    tolerance: f64,
) -> Result<Run, Box<dyn Error>> {
    let scale = Norms::of(&problem.q).l2;
    let (goal, begin) = (tolerance * scale, Instant::now());
    let run = direct::solve(form, [&problem.a, &problem.b], &problem.q, goal, LONGEST)?;
    let direct::Run { reached, residual, z, r, .. } = run;
    let (seconds, holds) = (begin.elapsed().as_secs_f64(), residual / scale);
    Ok(Run { seconds, sweeps: None, reached, holds, z, r })
}

/// The parameters and τ of a splitting.
fn open([alpha, beta, tau]: [f64; 3]) -> (Parameters<'static>, f64) {
    (Parameters { alpha: Some(alpha), beta: Some(beta), ..Parameters::default() }, tau)
}

fn newton(
    problem: &scenes::Problem<f64>,
    lines: bool,
    tolerance: f64,
) -> Result<Option<Run>, Box<dyn Error>> {
    let gauss_seidel = hlcp_core::Aor::gauss_seidel();
    let base = Tmms::mirrored(problem.hlcp(1.0)?, gauss_seidel.accelerated())?;
    let method: Boxed<'_, f64> = if lines {
        Box::new(Newton::new(base, TridiagonalPart::new()))
    } else {
        Box::new(Newton::new(base, Ssor))
    };
    solved(problem, &mut Solver::new(method), limits(true, tolerance)).map(Some)
}

/// Half as many iterations where one is two sweeps, or counts as so many.
fn limits(two: bool, tolerance: f64) -> Limits {
    let iterations = if two { SWEEPS / 2 } else { SWEEPS };
    let time = Some(LONGEST);
    Limits { rounding: Some(0.0), iterations, time, ..Limits::relative(tolerance) }
}

fn solved<T: Scalar>(
    problem: &scenes::Problem<T>,
    solver: &mut Solver<T, Boxed<'_, T>>,
    limits: Limits,
) -> Result<Run, Box<dyn Error>> {
    let start = problem.start();
    let outcome = solver.solve(&problem.q, Options::from_x(&start).limits(limits))?;
    Ok(Run::new(outcome, solver.z(), solver.r()))
}

impl Run {
    fn new<T: Scalar>(outcome: Outcome, z: &[T], r: &[T]) -> Self {
        let wide = |v: &[T]| v.iter().map(|v| v.to_f64().unwrap_or(f64::NAN)).collect();
        let Outcome { elapsed, sweeps, .. } = outcome;
        let (seconds, sweeps) = (elapsed.as_secs_f64(), Some(sweeps));
        let (reached, holds) = (outcome.converged(), f64::INFINITY);
        Self { seconds, sweeps, reached, holds, z: wide(z), r: wide(r) }
    }
}
