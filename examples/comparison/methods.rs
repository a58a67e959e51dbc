//! The methods, and one solve by one of them.

use std::{
    error::Error,
    time::{Duration, Instant},
};

use hlcp_core::{Aor, Hlcp, Norms, Omega, Rows};
use hlcp_methods::{
    Amms, Anderson, Auto, Cycle, FullMultigrid, Limits, Method, Mms, Multigrid, Newton, Options,
    Solver, Ssor, Status, Tmms, TridiagonalPart,
};
use hlcp_verify::certify_with;

use crate::scenes::{Problem, Setting};

/// Their names: the paper's with Gauss–Seidel, then what goes beyond it.
pub(crate) const METHODS: [&str; 10] =
    ["MGS", "AMGS", "TMGS", "AMSOR", "ANDERSON", "NEWTON", "MGW", "MGF", "FMG", "AUTO"];

/// What became of the solves by one method on one problem.
pub(crate) struct Run {
    pub(crate) status: Status,
    pub(crate) iterations: usize,
    pub(crate) sweeps: usize,
    /// In increasing order.
    pub(crate) seconds: Vec<f64>,
    /// The largest error of a component of (z, r).
    pub(crate) error: f64,
    /// What is proved of it.
    pub(crate) bound: Option<f64>,
}

impl Run {
    pub(crate) fn converged(&self) -> bool {
        self.status == Status::Converged
    }

    /// The median.
    pub(crate) fn seconds(&self) -> f64 {
        self.seconds[self.seconds.len() / 2]
    }
}

type Boxed<'p, A, B> = Box<dyn Method<f64, A = &'p A, B = &'p B> + 'p>;

/// The method on the pair of operators, or an error where it does not take such.
pub(crate) fn method<'p, A: Rows<f64>, B: Rows<f64>>(
    name: &str,
    (a, b): (&'p A, &'p B),
    setting: Setting,
) -> Result<Boxed<'p, A, B>, hlcp_core::Error> {
    let [alpha, tau] = if name == "AMSOR" { setting.amsor } else { [1.0; 2] };
    let problem = Hlcp::new(a, b, Omega::diagonal_ratio(tau, a, b)?)?;
    let tmgs = |problem| Tmms::mirrored(problem, Aor::gauss_seidel());
    Ok(match name {
        "MGS" => Box::new(Mms::new(problem, Aor::gauss_seidel())?),
        "AMGS" | "AMSOR" => Box::new(Amms::new(problem, Aor::sor(alpha)?)?),
        "TMGS" => Box::new(tmgs(problem)?),
        "ANDERSON" => Box::new(Anderson::new(tmgs(problem)?, 10)?),
        "NEWTON" if setting.tridiagonal => {
            Box::new(Newton::new(tmgs(problem)?, TridiagonalPart::new()))
        }
        "NEWTON" => Box::new(Newton::new(tmgs(problem)?, Ssor)),
        "MGW" => Box::new(Multigrid::new(problem, Cycle::W)?),
        "MGF" => Box::new(Multigrid::new(problem, Cycle::F)?),
        "FMG" => Box::new(FullMultigrid::new(Multigrid::new(problem, Cycle::F)?)),
        _ => Box::new(Auto::new(problem)?),
    })
}

/// Solves the problem again and again, at least `repeats` times and, if that is more than once, for a twentieth of a
/// second, each solve for no longer than `longest`; nothing where the method does not take such operators.
pub(crate) fn solve<A: Rows<f64>, B: Rows<f64>>(
    name: &str,
    problem: &Problem<A, B>,
    repeats: usize,
    longest: Duration,
) -> Result<Option<Run>, Box<dyn Error>> {
    let n = problem.a.order();
    let mut seconds: Vec<f64> = vec![];
    loop {
        let begin = Instant::now();
        let mut solver = match method(name, (&problem.a, &problem.b), problem.setting) {
            Err(hlcp_core::Error::NotFivePoint { .. }) => return Ok(None),
            method => Solver::new(method?),
        };
        let mut x = vec![1.0; n];
        let (mut status, mut iterations, mut sweeps) = (Status::Converged, 0, 0);
        for q in &problem.qs {
            let limits = Limits {
                iterations: usize::MAX,
                time: Some(longest.saturating_sub(begin.elapsed())),
                ..Limits::absolute(f64::max(1e-10, problem.setting.relative * Norms::of(q).l2))
            };
            let outcome = solver.solve(q, Options::from_x(&x).limits(limits))?;
            status = outcome.status;
            iterations += outcome.iterations;
            sweeps += outcome.sweeps;
            if !outcome.converged() {
                break;
            }
            x.copy_from_slice(solver.x());
        }
        seconds.push(begin.elapsed().as_secs_f64());
        let converged = status == Status::Converged;
        let short = repeats > 1 && seconds.iter().sum::<f64>() < 0.05;
        if converged && (seconds.len() < repeats || short) {
            continue;
        }
        seconds.sort_by(f64::total_cmp);
        let (z, r) = (solver.z(), solver.r());
        let bound = match &problem.certificate {
            Some(known) if converged => {
                let Problem { a, b, qs, .. } = problem;
                let witness = known.witness.clone();
                let found = certify_with(a, b, &qs[qs.len() - 1], z, r, witness)?;
                Some(found.ok_or("a witness of one answer is none of another")?.error())
            }
            _ => None,
        };
        let error = problem.error(z, r);
        return Ok(Some(Run { status, iterations, sweeps, seconds, error, bound }));
    }
}
