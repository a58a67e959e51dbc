use hlcp_core::{Error, Rhs};

use crate::{Limits, Method, Options, Outcome, Solver, Status};

/// Iterates in single precision as far as that reaches, and in double precision from there.
///
/// `single` and `double` are meant to hold one method on one problem in two precisions. The answer
/// is `double`'s, to `limits` in double precision: what the first part contributes is a start, so
/// nothing that is known of `double` (convergence from every start, the residual of the answer) is
/// lost. Where the data do not fit into single precision, or the first part diverges, `double`
/// starts from `x0`.
///
/// The outcome's iterations, sweeps and time are those of both parts.
///
/// # Cost
///
/// Some six of the digits are gained at the price of single precision, the rest at that of double
/// precision. Storage beside the two solvers: `q` and the start in single precision, `2n` numbers,
/// and the start in double precision.
///
/// # Errors
///
/// Those of [`Solver::solve`].
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega};
/// use hlcp_methods::{Limits, Solver, Tmms, solve_mixed};
///
/// let (a, b) = ([-1.0, -1.0, 8.0, -1.0, -1.0], [0.0, -1.0, 8.0, -1.0, 0.0]);
/// let wide = Hlcp::new(FivePoint::new(8, 8, a)?, FivePoint::new(8, 8, b)?, Omega::Uniform(1.0))?;
/// let [a, b] = [a, b].map(|stencil| FivePoint::new(8, 8, stencil.map(|v| v as f32)));
/// let narrow = Hlcp::new(a?, b?, Omega::Uniform(1.0_f32))?;
///
/// let mut double = Solver::new(Tmms::mirrored(wide, Aor::gauss_seidel())?);
/// let mut single = Solver::new(Tmms::mirrored(narrow, Aor::gauss_seidel())?);
/// let q: Vec<f64> = (0..64).map(|i| (i as f64).sin()).collect();
/// let outcome = solve_mixed(&mut single, &mut double, &q, &[1.0; 64], &Limits::default())?;
/// assert!(outcome.converged() && outcome.relative.l2 <= 1e-10);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn solve_mixed<S: Method<f32>, D: Method<f64>>(
    single: &mut Solver<f32, S>,
    double: &mut Solver<f64, D>,
    q: &[f64],
    x0: &[f64],
    limits: &Limits,
) -> Result<Outcome, Error> {
    let begin = std::time::Instant::now();
    let narrow = |v: &[f64]| v.iter().map(|&v| v as f32).collect::<Vec<_>>();
    let (narrow_q, narrow_x0) = (narrow(q), narrow(x0));
    // What vanishes in single precision is as far out of its reach as what overflows.
    let fits = Rhs::new(&narrow_q).is_ok_and(|q| q.norms().linf > 0.0);
    let options = Options::from_x(&narrow_x0).limits(Limits { rounding: None, ..*limits });
    let first = if fits { single.solve(&narrow_q, options).ok() } else { None };
    let ran_away = |first: &Outcome| matches!(first.status, Status::Diverged(_));
    let Some(first) = first.filter(|first| !ran_away(first)) else {
        return double.solve(q, Options::from_x(x0).limits(*limits));
    };
    let start: Vec<f64> = single.x().iter().map(|&x| x.into()).collect();
    let remaining = Limits {
        iterations: limits.iterations - first.iterations,
        time: limits.time.map(|time| time.saturating_sub(begin.elapsed())),
        ..*limits
    };
    let second = double.solve(q, Options::from_x(&start).limits(remaining))?;
    Ok(Outcome { elapsed: begin.elapsed(), ..first.then(second) })
}
