//! The solve of a problem by a method, the one loop that measures such solves, and the judge of
//! their answers.

use std::time::{Duration, Instant};

use hlcp_core::Scalar;
use hlcp_methods::{AutoTurn, Limits, Method, Named, Options, Outcome, Solver};
use hlcp_verify::{Certificate, Refusal, certify};

use crate::{
    Fallible,
    scenes::{Problem, distance, goal},
};

/// The solves of a problem by a method.
#[derive(Clone)]
pub(crate) struct Run {
    /// The first outcome.
    pub(crate) outcome: Outcome,
    /// `z` and `r`, where they are wanted.
    pub(crate) answer: [Vec<f64>; 2],
    /// The seconds of each solve with the set-up of the method, in increasing order.
    pub(crate) seconds: Vec<f64>,
    /// The turns of methods that `AUTO` called.
    pub(crate) turns: Vec<AutoTurn>,
}

impl Run {
    pub(crate) fn new<T: Scalar, M: Method<T>>(
        begin: Instant,
        outcome: Outcome,
        solver: &Solver<T, M>,
    ) -> Self {
        let seconds = vec![begin.elapsed().as_secs_f64()];
        let wide = |v: &[T]| v.iter().map(|v| v.wide()).collect();
        let turns = solver.method().turns().to_vec();
        Self { outcome, answer: [wide(solver.z()), wide(solver.r())], seconds, turns }
    }

    pub(crate) fn converged(&self) -> bool {
        self.outcome.converged()
    }

    /// Returns the fastest solve for 0, the quartiles for 1, 2 and 3, and the slowest for 4.
    pub(crate) fn quartile(&self, k: usize) -> f64 {
        self.seconds[k * (self.seconds.len() - 1) / 4]
    }

    pub(crate) fn median(&self) -> f64 {
        self.quartile(2)
    }
}

/// When a solve has been repeated often enough.
#[derive(Clone, Copy)]
pub(crate) struct Repeats {
    /// The least number of solves.
    pub(crate) least: usize,
    /// The least sum of their seconds.
    pub(crate) sum: f64,
    /// The seconds of a solve that is not repeated.
    pub(crate) longest: f64,
}

impl Repeats {
    pub(crate) fn least(least: usize) -> Self {
        Self { least, sum: 0.0, longest: f64::INFINITY }
    }

    fn wants_more(&self, Run { seconds, .. }: &Run) -> bool {
        let is_long = seconds.iter().any(|&seconds| seconds > self.longest);
        !is_long && (seconds.len() < self.least || seconds.iter().sum::<f64>() < self.sum)
    }
}

/// Solves by rivals in turns until each has been repeated often enough; nothing for a rival that
/// `solve` has nothing for.
pub(crate) fn measure<R>(
    repeats: Repeats,
    rivals: &[R],
    mut solve: impl FnMut(&R) -> Fallible<Option<Run>>,
) -> Fallible<Vec<Option<Run>>> {
    let mut runs = rivals.iter().map(&mut solve).collect::<Fallible<Vec<_>>>()?;
    let mut is_over = false;
    while !is_over {
        is_over = true;
        for (rival, run) in rivals.iter().zip(&mut runs) {
            if let Some(run) = run.as_mut().filter(|run| repeats.wants_more(run)) {
                let again = solve(rival)?;
                run.seconds.push(again.map_or(f64::INFINITY, |again| again.seconds[0]));
                is_over = false;
            }
        }
    }
    for run in runs.iter_mut().flatten() {
        run.seconds.sort_by(f64::total_cmp);
    }
    Ok(runs)
}

/// Solves the problems of a scene one after another by a method with τ.
pub(crate) fn solve<T: Scalar>(
    problem: &Problem<T>,
    method: &Named,
    tau: f64,
    limits: &Limits,
) -> Result<Run, hlcp_core::Error> {
    let posed = problem.hlcp(T::of(tau))?;
    run(problem, limits, || method.on_dyn(posed))
}

/// Solves the problems of a scene one after another by the method that `make` makes.
pub(crate) fn run<T: Scalar, M: Method<T>>(
    problem: &Problem<T>,
    limits: &Limits,
    make: impl FnOnce() -> Result<M, hlcp_core::Error>,
) -> Result<Run, hlcp_core::Error> {
    let begin = Instant::now();
    let mut solver = Solver::new(make()?);
    let (outcome, _) = problem.march(&mut solver, (&problem.start(), true), limits, None)?;
    Ok(Run::new(begin, outcome, &solver))
}

/// The limits of a solve to a tolerance relative to ‖q‖, and not to what rounding allows.
pub(crate) fn to(tolerance: f64, iterations: usize, longest: Option<Duration>) -> Limits {
    Limits { rounding: Some(0.0), iterations, time: longest, ..Limits::relative(tolerance) }
}

/// The problems of a scene with the solution of the last.
pub(crate) struct Judged {
    /// Each `q` is made from the reference's `z` of the one before: the same for all methods.
    pub(crate) problem: Problem<f64>,
    /// z* and r* of the last problem: planted, or solved to the floor of rounding.
    truth: [Vec<f64>; 2],
    last: Vec<f64>,
    /// What is proved of the error of `truth`, which solves a rounded `q` only nearly, unless the
    /// problem is large.
    pub(crate) doubt: Option<f64>,
}

impl Judged {
    /// Finds the solution of problems that have none planted by a method that takes them to the
    /// floor of rounding: to half of what `wanted` asks for, or better. Proves a bound on its error
    /// where that is asked for and possible.
    pub(crate) fn new(
        mut problem: Problem<f64>,
        method: &str,
        wanted: &Limits,
        is_certified: bool,
    ) -> Fallible<Self> {
        /// Takes any of the scenes to its floor.
        const ITERATIONS: usize = 60;
        let mut last = problem.q.clone();
        let truth = match problem.known.take() {
            Some(known) => known,
            None => {
                let mut solver = problem.solver(method)?;
                // To a tolerance of 0, which need not be met.
                let limits = Limits { iterations: ITERATIONS, ..Limits::absolute(0.0) };
                let (mut qs, first) = (vec![], problem.start());
                for k in 0..problem.march.0 {
                    if k > 0 {
                        (problem.march.1)(k, solver.z(), &mut last);
                    }
                    let start = if k == 0 { Options::from_x(&first) } else { Options::resume() };
                    let outcome = solver.solve(&last, start.limits(limits))?;
                    if outcome.residual.l2 > 0.5 * goal(wanted, &last) {
                        return Err(format!("no reference: {outcome}").into());
                    }
                    qs.push(last.clone());
                }
                let truth = [solver.z().to_vec(), solver.r().to_vec()];
                drop(solver);
                problem.march.1 = Box::new(move |k, _, q| q.copy_from_slice(&qs[k]));
                truth
            }
        };
        let mut judged = Self { problem, truth, last, doubt: None };
        if is_certified {
            judged.doubt = judged.certified(&judged.truth)?.ok().map(|proved| proved.error());
        }
        Ok(judged)
    }

    /// Returns the largest error of a component of an answer.
    pub(crate) fn error(&self, [z, r]: &[Vec<f64>; 2]) -> f64 {
        distance([z, r], &self.truth)
    }

    /// Returns the bound that is proved of that error.
    pub(crate) fn bound(&self, answer: &[Vec<f64>; 2]) -> Fallible<f64> {
        Ok(self.certified(answer)?.map_err(|refusal| refusal.to_string())?.error())
    }

    fn certified(
        &self,
        [z, r]: &[Vec<f64>; 2],
    ) -> Result<Result<Certificate, Refusal>, hlcp_core::Error> {
        certify(&self.problem.a, &self.problem.b, &self.last, z, r)
    }
}
