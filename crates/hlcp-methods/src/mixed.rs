use std::ops::ControlFlow;

use hlcp_core::{Error, Rhs, check_orders};

use crate::{
    Limits, Method, Options, Outcome, Progress, Solver, Status,
    options::{Start, Watched},
};

/// Iterates in single precision as far as that reaches, and in double precision from there.
///
/// `single` and `double` are meant to hold one method on one problem in two precisions. The answer
/// is `double`'s, within the limits in double precision: what the first part contributes is a
/// start, so nothing that is known of `double` (convergence from every start, the residual of the
/// answer) is lost. Where the data do not fit into single precision, or the first part diverges,
/// `double` starts as `options` say; [`Options::resume`] means its last answer.
///
/// The outcome's iterations, sweeps and time are those of both parts; an observer sees both, each
/// counted from 0.
///
/// # Cost
///
/// Some six of the digits are gained at the price of single precision, the rest at that of double
/// precision. Storage beside the two solvers: `q` and the start in single precision, `2n` numbers,
/// and the start in double precision.
///
/// # Errors
///
/// Those of [`Solver::solve`]; [`Error::Order`] for solvers of two orders.
///
/// ```
/// use hlcp_methods::{Aor, FivePoint, Hlcp, Limits, Omega, Solver, Tmms, solve_mixed};
///
/// let (a, b) = ([-1.0, -1.0, 8.0, -1.0, -1.0], [0.0, -1.0, 8.0, -1.0, 0.0]);
/// let wide = Hlcp::new(FivePoint::new(8, 8, a)?, FivePoint::new(8, 8, b)?, Omega::Uniform(1.0))?;
/// let [a, b] = [a, b].map(|stencil| FivePoint::new(8, 8, stencil.map(|v| v as f32)));
/// let narrow = Hlcp::new(a?, b?, Omega::Uniform(1.0_f32))?;
///
/// let mut double = Solver::new(Tmms::mirrored(wide, Aor::gauss_seidel())?);
/// let mut single = Solver::new(Tmms::mirrored(narrow, Aor::gauss_seidel())?);
/// let q: Vec<f64> = (0..64).map(|i| (i as f64).sin()).collect();
/// let outcome = solve_mixed(&mut single, &mut double, &q, Limits::default())?;
/// assert!(outcome.converged() && outcome.relative.l2 <= 1e-10);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
pub fn solve_mixed<'o, S: Method<f32>, D: Method<f64>>(
    single: &mut Solver<f32, S>,
    double: &mut Solver<f64, D>,
    q: &[f64],
    options: impl Into<Options<'o, f64>>,
) -> Result<Outcome, Error> {
    check_orders(double.x().len(), &[("the problem in single precision", single.x().len())])?;
    let begin = std::time::Instant::now();
    let Options { start, limits, mut observer } = options.into();
    let narrow = |v: &[f64]| v.iter().map(|&v| v as f32).collect::<Vec<_>>();
    let narrow_q = narrow(q);
    let [one, two] = match start {
        Start::Zero => [vec![], vec![]],
        Start::Last => [narrow(double.x()), vec![]],
        Start::X(x) => [narrow(x), vec![]],
        Start::Solution([z, r]) => [narrow(z), narrow(r)],
    };
    let narrow_start = match start {
        Start::Zero => Start::Zero,
        Start::Last | Start::X(_) => Start::X(&one),
        Start::Solution(_) => Start::Solution([&one, &two]),
    };
    // What vanishes in single precision is as far out of its reach as what overflows.
    let fits = Rhs::new(&narrow_q).is_ok_and(|q| q.norms().linf > 0.0);
    let first = if fits {
        let observer = observer.as_mut().map(|Watched(observer)| {
            let mut wide = vec![];
            Watched(Box::new(
                move |&Progress { iteration, residual, elapsed, x }: &Progress<'_, f32>| {
                    wide.clear();
                    wide.extend(x.iter().map(|&x| f64::from(x)));
                    observer(&Progress { iteration, residual, elapsed, x: &wide })
                },
            ))
        });
        let limits = Limits { rounding: None, ..limits };
        single.solve(&narrow_q, Options { start: narrow_start, limits, observer }).ok()
    } else {
        None
    };
    let Some(first) = first else { return double.solve(q, Options { start, limits, observer }) };
    let x: Vec<f64> = single.x().iter().map(|&x| x.into()).collect();
    let start = if matches!(first.status, Status::Diverged(_)) { start } else { Start::X(&x) };
    let limits = Limits {
        iterations: limits.iterations - first.iterations,
        time: limits.time.map(|time| time.saturating_sub(begin.elapsed())),
        ..limits
    };
    // Who has said stop is not asked again.
    if first.status == Status::Stopped {
        observer = Some(Watched(Box::new(|_| ControlFlow::Break(()))));
    }
    let second = double.solve(q, Options { start, limits, observer })?;
    Ok(Outcome { elapsed: begin.elapsed(), ..first.then(second) })
}
