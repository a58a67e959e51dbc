use std::fmt;

use hlcp_core::Norms;

/// How an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// The residual of the answer, recomputed from the problem, is within the tolerance.
    Converged,
    /// The iterates ran away; [`Outcome::iterations`] says when it was seen.
    ///
    /// Cause: the method does not contract for this pair, Ω and parameters, or an operator produces NaN.
    /// Remedy: a smaller α, another τ, or a method with a theorem for the pair.
    Diverged(Divergence),
    /// The iterates moved by no more than rounding for [`PATIENCE`](crate::PATIENCE) iterations without a
    /// smaller residual, or came to rest.
    ///
    /// Cause: the tolerance is below what the precision can reach; or, with a residual far above it, steps too
    /// small to move x, as an Ω of the wrong size makes them. Remedy: a looser or a relative tolerance, or a
    /// wider precision; or another τ.
    Stagnated,
    /// The iterates repeat, bit for bit, with this period and a movement above rounding.
    ///
    /// Cause: the method does not contract here, or the problem has no solution. Remedy: another α or τ.
    Cycling {
        /// The number of iterations after which an iterate returned.
        period: usize,
    },
    /// The iterations ran out.
    ///
    /// Cause: slow convergence, or none. Remedy: a history shows which; more iterations, or a faster method.
    IterationLimit,
    /// The time ran out.
    ///
    /// Cause and remedy as for the iteration limit.
    TimeLimit,
    /// The observer stopped the solve.
    Stopped,
}

/// How the iterates of a diverging iteration ran away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Divergence {
    /// The residual grew [`GROWTH`](crate::GROWTH)-fold over the larger of its first value and ‖q‖.
    Growth,
    /// An entry of the iterate is NaN or infinite.
    Entry {
        /// The index of the first such entry.
        index: usize,
    },
    /// The residual of an iterate with finite entries is NaN or infinite.
    Residual,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Converged => "converged",
            Self::Diverged(_) => "diverged",
            Self::Stagnated => "stagnated",
            Self::Cycling { .. } => "cycling",
            Self::IterationLimit => "iteration limit",
            Self::TimeLimit => "time limit",
            Self::Stopped => "stopped",
        })
    }
}

/// What became of a solve.
///
/// The answer itself stays with the [`Solver`](crate::Solver): the last iterate on success, the one with
/// the smallest residual otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
#[must_use = "an iteration may end without converging"]
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
    /// Wall-clock time of the iteration and of recovering the answer.
    pub seconds: f64,
    /// The norms of `A z − B r + q` for the answer, recomputed from the problem.
    pub residual: Norms,
}

impl Outcome {
    /// Whether the answer meets the tolerance.
    pub fn converged(&self) -> bool {
        self.status == Status::Converged
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { status, iterations, sweeps, seconds, residual, .. } = self;
        write!(
            f,
            "{status} after {iterations} iterations ({sweeps} sweeps, {seconds:.3} s), residual {:.2e}",
            residual.l2
        )
    }
}
