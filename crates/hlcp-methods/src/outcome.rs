use std::{fmt, time::Duration};

use hlcp_core::Norms;

use crate::Forecast;

/// How an iteration ended.
///
/// ```
/// use hlcp_methods::{Aor, Divergence, Error, Hlcp, Identity, Mms, Options, Solver, Status};
///
/// // One unknown, z − r = 3: a sweep of SOR multiplies the error of x by 1 − α.
/// let ends = |alpha| -> Result<Status, Error> {
///     let problem = Hlcp::lcp(Identity { order: 1 })?;
///     let mut solver = Solver::new(Mms::new(problem, Aor::sor(alpha)?)?);
///     Ok(solver.solve(&[-3.0], Options::from_x(&[1.0]))?.status)
/// };
/// assert_eq!(ends(1.5)?, Status::Converged);
/// assert_eq!(ends(2.0)?, Status::Cycling { period: 2 });
/// assert_eq!(ends(3.0)?, Status::Diverged(Divergence::Growth));
/// # Ok::<(), Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Status {
    /// The exact residual of the answer, recomputed from the problem, is within the tolerance.
    ///
    /// An operator is believed what it shows of itself by `as_five_point`, `as_csr` and
    /// `try_visit_row`; [`check_operator`](crate::check_operator) finds out where its product says
    /// something else.
    Converged,
    /// The iteration diverged. [`Outcome::iterations`] is the iteration at which it was detected.
    ///
    /// Cause: the method does not contract for this pair, Ω and parameters, or an operator produces
    /// NaN. Remedy: a smaller α, another τ, or a method with a theorem for the pair.
    Diverged(Divergence),
    /// The iterates came to rest, or moved by no more than rounding for 1000 iterations without a
    /// smaller residual, or rounding hid their residual: the iterates grew so large, or the
    /// residual so small, that it consists of rounding.
    ///
    /// Cause: the tolerance is below what the precision can reach, and
    /// [`backward_error`](Outcome::backward_error) tells that rounding is the reason; or the
    /// problem has no solution and the iterates run away; or, with a residual far above the
    /// tolerance, steps too small to move x, as an Ω of the wrong size makes them, or an operator
    /// of your own whose rows are not those of its product. Remedy: a looser tolerance, or a wider
    /// precision; another τ; a look at the operator.
    Stagnated,
    /// The iterates repeat, bit for bit, with this period and a movement above rounding.
    ///
    /// Cause: the method does not contract here, or the problem has no solution. Remedy: another α
    /// or τ.
    Cycling {
        /// The number of iterations after which an iterate returned.
        period: usize,
    },
    /// The iterations ran out.
    ///
    /// Cause: slow convergence, or none. Remedy: a history shows which; more iterations, or a
    /// faster method.
    IterationLimit,
    /// The time ran out.
    ///
    /// Cause and remedy as for the iteration limit.
    TimeLimit,
    /// The observer stopped the solve.
    Stopped,
}

/// The way in which an iteration diverged.
///
/// ```
/// use hlcp_methods::{Divergence, Hlcp, Identity, Limits, Mms, Solver, Status};
///
/// // A splitting of one's own whose second pivot is zero.
/// let splitting = |rhs: &[f64], y: &mut [f64]| (y[0], y[1]) = (rhs[0] / 2.0, rhs[1] / 0.0);
/// let problem = Hlcp::lcp(Identity { order: 2 })?;
/// let mut solver = Solver::new(Mms::with_splitting(problem, splitting)?);
/// let outcome = solver.solve(&[-3.0, -3.0], Limits::default())?;
/// assert_eq!(outcome.status, Status::Diverged(Divergence::Entry { index: 1 }));
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Divergence {
    /// The residual grew 10¹⁶-fold over the larger of its first value and ‖q‖.
    Growth,
    /// An entry of the iterate is NaN or infinite.
    Entry {
        /// The index of the first such entry.
        index: usize,
    },
    /// The residual of an iterate with finite entries is NaN or infinite.
    Residual,
}

impl Status {
    /// Returns the status in one word, as files and other languages want it.
    ///
    /// ```
    /// use hlcp_methods::Status;
    ///
    /// assert_eq!(Status::IterationLimit.name(), "iteration_limit");
    /// assert_eq!(Status::IterationLimit.to_string(), "iteration limit");
    /// ```
    pub fn name(&self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Diverged(_) => "diverged",
            Self::Stagnated => "stagnated",
            Self::Cycling { .. } => "cycling",
            Self::IterationLimit => "iteration_limit",
            Self::TimeLimit => "time_limit",
            Self::Stopped => "stopped",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.name().replace('_', " "))
    }
}

/// The outcome of a solve.
///
/// The answer itself stays with the [`Solver`](crate::Solver): the last iterate on success, the one
/// with the smallest residual otherwise.
///
/// ```
/// use hlcp_methods::{Aor, Hlcp, Identity, Limits, Mms, Options, Solver, Status};
///
/// // z − r = 3 with α = 3: the error of x doubles in every sweep, and the start is the best.
/// let mut solver = Solver::new(Mms::new(Hlcp::lcp(Identity { order: 1 })?, Aor::sor(3.0)?)?);
/// let limits = Limits { iterations: 4, ..Limits::default() };
/// let outcome = solver.solve(&[-3.0], Options::from_x(&[1.0]).limits(limits))?;
/// assert_eq!((outcome.status, outcome.answer), (Status::IterationLimit, 0));
/// assert_eq!((solver.z(), outcome.residual.linf), (&[2.0][..], 1.0));
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[must_use = "an iteration may end without converging"]
#[non_exhaustive]
pub struct Outcome {
    /// How the iteration ended.
    pub status: Status,
    /// The number of iterations that ran.
    pub iterations: usize,
    /// The iteration whose iterate is the answer.
    pub answer: usize,
    /// The sweeps those iterations are worth; a two-step iteration is two.
    ///
    /// The stopping test's look at the last iterate is the first step of an iteration that is not
    /// counted.
    pub sweeps: usize,
    /// The iterations of inner linear solves, of a method that has them.
    pub linear_iterations: Option<usize>,
    /// Wall-clock time of the iteration and of recovering the answer.
    pub elapsed: Duration,
    /// The norms of `A z − B r + q` for the answer, recomputed from the problem. Where rounding
    /// decides, upper bounds on the exact ones.
    pub residual: Norms,
    /// Each of these over the same norm of `q`; 0 for a residual of 0.
    pub relative: Norms,
    /// Where rounding is the reason that an answer does not meet the tolerance: how much the
    /// entries of `A`, `B` and `q` must change, relative to themselves, for the answer to be exact
    /// (W. Oettli and W. Prager, Numer. Math. 6, 1964), at most 64 ε of the precision. A solution
    /// may still be far away, if it depends that much on the entries. `None` for every other
    /// answer, and where an operator does not know its rows.
    pub backward_error: Option<f64>,
    /// The elimination that was not begun, as it would have outlasted the time limit.
    pub forgone: Option<Forecast>,
}

impl Outcome {
    /// Returns the outcome of an iteration of your own, to set beside those of a solver: with a
    /// sweep per iteration, and unknown relative norms.
    pub fn new(status: Status, iterations: usize, elapsed: Duration, residual: Norms) -> Self {
        Self {
            status,
            iterations,
            answer: iterations,
            sweeps: iterations,
            linear_iterations: None,
            elapsed,
            residual,
            relative: Norms { l2: f64::NAN, linf: f64::NAN },
            backward_error: None,
            forgone: None,
        }
    }

    /// Returns whether the answer meets the tolerance.
    pub fn converged(&self) -> bool {
        self.status == Status::Converged
    }

    /// Turns an answer that does not meet the tolerance into an error.
    ///
    /// # Errors
    ///
    /// [`NotConverged`] with the outcome.
    pub fn ok(self) -> Result<(), NotConverged> {
        if self.converged() { Ok(()) } else { Err(NotConverged(Box::new(self))) }
    }

    /// Returns the outcome of this solve and of the `next` one, which began where this one ended:
    /// the status and the residual of `next`, and iterations, sweeps, linear iterations and time of
    /// both.
    ///
    /// ```
    /// use hlcp_methods::{Aor, Hlcp, Identity, Limits, Mms, Newton, Options, Solver, Ssor};
    ///
    /// let base = Mms::new(Hlcp::lcp(Identity { order: 1 })?, Aor::sor(0.5)?)?;
    /// let mut sweeps = Solver::new(base.clone());
    /// let rough = sweeps.solve(&[-3.0], Limits::relative(1e-3))?;
    /// let mut newton = Solver::new(Newton::new(base, Ssor));
    /// let fine = newton.solve(&[-3.0], Options::from_x(sweeps.x()))?;
    ///
    /// let both = rough.then(fine);
    /// assert_eq!(both.iterations, rough.iterations + fine.iterations);
    /// assert_eq!((both.status, both.linear_iterations), (fine.status, fine.linear_iterations));
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn then(self, next: Self) -> Self {
        let [one, two] = [self, next]
            .map(|Self { sweeps, linear_iterations, .. }| Work { sweeps, linear_iterations });
        let Work { sweeps, linear_iterations } = one + two;
        Self {
            iterations: self.iterations + next.iterations,
            answer: self.iterations + next.answer,
            sweeps,
            linear_iterations,
            elapsed: self.elapsed + next.elapsed,
            ..next
        }
    }
}

/// The outcome of a solve that did not converge, as an error.
///
/// ```
/// use hlcp_methods::{Aor, Hlcp, Identity, Limits, Mms, Solver};
///
/// let mut solver = Solver::new(Mms::new(Hlcp::lcp(Identity { order: 1 })?, Aor::sor(0.5)?)?);
/// let limits = Limits { iterations: 1, ..Limits::default() };
/// let error = solver.solve(&[-3.0], limits)?.ok().unwrap_err();
/// assert!(error.to_string().starts_with("iteration limit after 1 iteration (1 sweep, "));
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct NotConverged(pub Box<Outcome>);

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { status, iterations, sweeps, elapsed, residual, relative, .. } = self;
        write!(f, "{status}")?;
        match status {
            Status::Cycling { period } => write!(f, " with period {period}")?,
            Status::Diverged(Divergence::Entry { index }) => write!(f, " at entry {index}")?,
            _ => {}
        }
        let seconds = elapsed.as_secs_f64();
        let count = |n: usize, one: &str| format!("{n} {one}{}", if n == 1 { "" } else { "s" });
        let (iterations, sweeps) = (count(*iterations, "iteration"), count(*sweeps, "sweep"));
        write!(
            f,
            " after {iterations} ({sweeps}, {seconds:.3} s), residual {:.2e} ({:.1e} of q)",
            residual.l2, relative.l2
        )?;
        if let Some(error) = self.backward_error {
            write!(
                f,
                "; the rest is rounding: the answer is exact for entries of A, B and q that differ \
                 by at most {error:.1e} of themselves"
            )?;
        }
        match self.forgone {
            Some(forgone) if !self.converged() => write!(f, "; {forgone}"),
            _ => Ok(()),
        }
    }
}

/// The work of some iterations.
///
/// ```
/// use hlcp_methods::Work;
///
/// let (base, newton) = (Work::sweeps(2), Work { sweeps: 40, linear_iterations: Some(9) });
/// assert_eq!(base + newton, Work { sweeps: 42, linear_iterations: Some(9) });
/// assert_eq!([base, newton, base].into_iter().sum::<Work>().sweeps, 44);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// The sweeps over the unknowns that it is worth.
    pub sweeps: usize,
    /// The iterations of inner linear solves, of a method that has them.
    pub linear_iterations: Option<usize>,
}

impl Work {
    /// The work of this many sweeps.
    pub fn sweeps(sweeps: usize) -> Self {
        Self { sweeps, linear_iterations: None }
    }
}

impl std::ops::Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let [one, two] = [self.linear_iterations, other.linear_iterations];
        Self {
            sweeps: self.sweeps + other.sweeps,
            linear_iterations: one.map_or(two, |one| Some(one + two.unwrap_or(0))),
        }
    }
}

impl std::iter::Sum for Work {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), std::ops::Add::add)
    }
}
