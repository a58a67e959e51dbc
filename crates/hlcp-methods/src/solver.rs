use std::{
    hash::{DefaultHasher, Hash, Hasher},
    mem,
    time::{Duration, Instant},
};

use hlcp_core::{Error, Hlcp, LinearOperator, Norms, Rhs, Scalar, Strip};

use crate::{
    Clock, Forecast, Limits, Method, Options, Outcome, Progress, Status, Work,
    monitor::{Monitor, ROUNDING},
    options::{Observer, Start},
    tolerance::{QUIET, Test},
};

/// How often an observer is asked within one long step.
const BEAT: Duration = Duration::from_millis(20);

/// The norms of a residual that was not measured.
const UNKNOWN: Norms = Norms { l2: f64::NAN, linf: f64::NAN };

/// Iterates a [`Method`] and owns the vectors it takes.
///
/// # Storage
///
/// Three vectors of length `n` beside the method's own, allocated by [`new`](Self::new), and `2n`
/// numbers of scratch by the first solve, none by later ones unless an operator's product
/// allocates; no scratch in `f64` where both operators are five-point ones on one grid. A fourth
/// vector only where the iterates are suspected to repeat.
///
/// ```
/// use hlcp_methods::{Aor, FivePoint, Hlcp, Mms, Options, Solver};
///
/// let problem = Hlcp::lcp(FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
/// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
///
/// let outcome = solver.solve(&[-2.0, 5.0, -6.0], Options::default())?;
/// assert!(outcome.converged());
/// assert!(f64::abs(solver.z()[2] - 1.5) < 1e-9);
/// assert!(f64::abs(solver.r()[1] - 3.0) < 1e-9);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Solver<T, M> {
    method: M,
    x: Vec<T>,
    /// During a solve the next iterate, afterwards z.
    next: Vec<T>,
    /// During a solve the best iterate where that is not x, afterwards r.
    best: Vec<T>,
    scratch: Vec<T>,
    monitor: Monitor<T>,
    history: Vec<Norms>,
    history_limit: usize,
}

impl<T: Scalar, M: Method<T>> Solver<T, M> {
    /// Returns a solver for `method`, with its vectors.
    pub fn new(method: M) -> Self {
        let zeros = vec![T::zero(); method.problem().order()];
        Self {
            method,
            x: zeros.clone(),
            next: zeros.clone(),
            best: zeros,
            scratch: Vec::new(),
            monitor: Monitor::new(),
            history: Vec::new(),
            history_limit: 0,
        }
    }

    /// Keeps the residuals of the first `iterates` iterates of each solve, in storage allocated
    /// here, or as it is needed where memory does not hold so many.
    ///
    /// ```
    /// use hlcp_methods::{Aor, FivePoint, Hlcp, Mms, Options, Solver};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
    /// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?).with_history(100);
    /// let outcome = solver.solve(&[-2.0, 5.0, -6.0], Options::default())?;
    /// assert_eq!(solver.history().len(), outcome.iterations + 1);
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn with_history(self, iterates: usize) -> Self {
        let mut history = Vec::new();
        let _ = history.try_reserve_exact(iterates);
        Self { history, history_limit: iterates, ..self }
    }

    /// The residuals of the last solve's iterates, from the start on, as far as there was storage
    /// for them.
    pub fn history(&self) -> &[Norms] {
        &self.history
    }

    /// The method.
    pub fn method(&self) -> &M {
        &self.method
    }

    /// The method, to go on with beside the solver.
    pub fn method_mut(&mut self) -> &mut M {
        &mut self.method
    }

    /// `z` of the last solve.
    pub fn z(&self) -> &[T] {
        &self.next
    }

    /// `r` of the last solve.
    pub fn r(&self) -> &[T] {
        &self.best
    }

    /// The modulus variable `x` of the last solve: `z = (|x| + x)/γ`, `r = Ω(|x| − x)/γ`.
    pub fn x(&self) -> &[T] {
        &self.x
    }

    /// Solves HLCP(A, B, q) as `options` say; [`Limits`] will do where no more is to be said.
    ///
    /// For `q = 0` the answer is `x = 0`, whatever the start.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] when `q` or the start does not fit the problem, [`Error::NotFinite`] for
    /// their first entry that is NaN or infinite, [`Error::Parameter`] for a tolerance that is
    /// negative or not finite, or relative and not below 1. An iteration that does not converge
    /// is no error: read the [`Outcome`].
    ///
    /// ```
    /// use hlcp_methods::{Aor, FivePoint, Hlcp, Mms, Options, Solver};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(20, 1, [0.0, -1.0, 2.1, -1.0, 0.0])?)?;
    /// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
    /// let load = |time: f64| (0..20).map(|i| (0.3 * i as f64 + time).sin()).collect::<Vec<_>>();
    /// let cold = solver.solve(&load(0.0), Options::default())?;
    /// for step in 1..5 {
    ///     let warm = solver.solve(&load(1e-6 * step as f64), Options::resume())?;
    ///     assert!(warm.converged() && warm.iterations < cold.iterations);
    /// }
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn solve<'o>(
        &mut self,
        q: &[T],
        options: impl Into<Options<'o, T>>,
    ) -> Result<Outcome, Error> {
        let Options { start, limits, observer } = options.into();
        let problem = self.method.problem();
        if !self.method.works_on_ranks() {
            problem.on_one_rank("this method")?;
        }
        let watched = agreed(problem, &start, &limits, observer.is_some())?;
        let q = problem.rhs(q)?;
        let check = |what, entries: &[T]| problem.check_vector(what, entries);
        match start {
            Start::Zero => self.x.fill(T::zero()),
            Start::Last => check("x0", &self.x)?,
            Start::X(x) => {
                check("x0", x)?;
                self.x.copy_from_slice(x);
            }
            Start::Solution([z, r]) => {
                check("z0", z)?;
                check("r0", r)?;
                problem.x_from_solution(z, r, &mut self.x);
                check("x0", &self.x)?;
            }
        }
        let begun = Instant::now();
        let mut test = Test::new(&limits, problem, &q, &mut self.scratch)?;
        if q.norms().linf == 0.0 {
            self.x.fill(T::zero());
        }
        let observer = observer.map(|observer| observer.0);
        let ranks = if watched { problem.strip().cloned() } else { None };
        let (goal, ended, forgone) = (test.asked, None, None);
        let mut pace = Pace { limits: &limits, goal, begun, observer, ended, forgone, ranks };
        let ended = self.iterate(&q, &mut test, &mut pace);
        let is_close = !matches!(ended.status, Status::Converged | Status::Diverged(_));
        let backward_error =
            if is_close { self.method.problem().backward_error(&q, &self.x) } else { None };
        let (q, elapsed) = (q.norms(), begun.elapsed());
        let over = |residual: f64, q: f64| if residual == 0.0 { 0.0 } else { residual / q };
        let Norms { l2, linf } = ended.residual;
        let relative = Norms { l2: over(l2, q.l2), linf: over(linf, q.linf) };
        let backward_error = backward_error.filter(|&error| is_rounding::<T>(error));
        Ok(Outcome { elapsed, relative, backward_error, forgone: pace.forgone, ..ended })
    }

    /// Iterates until the limits, the observer or the iterates say stop, and leaves the answer in
    /// `x`, `z` and `r`; the outcome is still without its time.
    fn iterate(&mut self, q: &Rhs<'_, T>, test: &mut Test, pace: &mut Pace<'_, '_, T>) -> Outcome {
        self.method.restart();
        self.monitor.begin(pace.limits.norm.of(q.norms()), self.method.has_memory());
        self.history.clear();
        let mut answer = 0;
        for k in 0_usize.. {
            // The work that led here: the look at the last iterate is a step that leads nowhere.
            let Work { sweeps, linear_iterations } = self.method.work().unwrap_or(Work::sweeps(k));
            let ended = |status, answer, residual| {
                let outcome = Outcome::new(status, k, Duration::ZERO, residual);
                Outcome { answer, sweeps, linear_iterations, ..outcome }
            };
            let Look { norms, accepted, lost } = self.look(k, q, test, pace);
            // A step that was cut short leaves nothing that means anything in `next`.
            let cut = pace.ended.is_some();
            self.note(k, norms, pace);
            if let Some(residual) = accepted {
                return ended(Status::Converged, k, residual);
            }
            let best = self.monitor.is_best(k, pace.limits.norm.of(norms), lost);
            if best {
                answer = k;
            }
            let Some(status) = self.ends(k, q, norms, cut, test, pace) else {
                self.advance(q, best);
                continue;
            };
            if !best {
                std::mem::swap(&mut self.x, &mut self.best);
            }
            let leads_nowhere = matches!(status, Status::Stagnated | Status::Diverged(_));
            let may_go_on = !cut && k < pace.limits.iterations && leads_nowhere;
            let (status, residual) = self.settle(q, test, status);
            if may_go_on && status != Status::Converged && self.method.turn(status) {
                // From the best iterate: `z` and `r` have taken the room of the next one and its
                // own.
                self.best.copy_from_slice(&self.x);
                if status == Status::Stagnated {
                    self.monitor.wait_from(k);
                    test.wait();
                }
                continue;
            }
            return ended(status, answer, residual);
        }
        unreachable!("the iteration limit ends the loop")
    }

    /// Measures iterate `k`, which is in `x`, takes the step from it to `next`, and judges whether
    /// `x` is the answer: then `z` and `r` have taken the room of `next` and `best`.
    fn look(
        &mut self,
        k: usize,
        q: &Rhs<'_, T>,
        test: &mut Test,
        pace: &mut Pace<'_, '_, T>,
    ) -> Look {
        // Between powers of four an older size of the terms serves, until something nearly passes.
        if k == 0 || k >= 16 && k.is_power_of_two() && k.trailing_zeros().is_multiple_of(2) {
            test.renew(self.method.problem(), q, &self.x);
        }
        // A method whose steps are long may know the residual beforehand.
        let known = self.method.residual(q, &self.x);
        let (mut norms, stepped) = match known.filter(|&norms| self.is_near(k, q, norms, test)) {
            Some(norms) => (norms, false),
            None => (self.step(k, q, known.unwrap_or(UNKNOWN), pace), true),
        };
        if !self.is_near(k, q, norms, test) {
            return Look { norms, accepted: None, lost: false };
        }
        let problem = self.method.problem();
        let mut lost = false;
        match test.judge(problem, q, &self.x, norms, &mut self.scratch) {
            Ok(bound) => {
                let measured = self.recover(q, Some(bound));
                let Self { method, x, scratch, .. } = self;
                let accepted = test.confirm(method.problem(), q, x, [measured, bound], scratch);
                if accepted.is_some() {
                    return Look { norms, accepted, lost };
                }
                // The product of an operator is not that of its rows: what was measured before was
                // no residual, so x is as good as any.
                (norms, lost) = (measured, true);
                self.best.copy_from_slice(&self.x);
            }
            Err(bound) => {
                // What was measured was no residual, either, if it is not rounding that hides it.
                let measured = std::mem::replace(&mut norms, bound);
                lost = test.is_far(measured, bound)
                    && !test.explains(problem, q, &self.x, [measured, bound], &mut self.scratch);
                if lost {
                    self.best.copy_from_slice(&self.x);
                } else {
                    test.refused(k, measured, bound);
                }
            }
        }
        if lost || !stepped {
            let _ = self.step(k, q, norms, pace);
        }
        Look { norms, accepted: None, lost }
    }

    /// Returns whether the residual of `x` seems good enough, for the size of the terms at `x` if
    /// that might matter.
    fn is_near(&self, k: usize, q: &Rhs<'_, T>, norms: Norms, test: &mut Test) -> bool {
        if test.is_doubtful(k, norms) {
            test.renew(self.method.problem(), q, &self.x);
        }
        test.is_near(k, norms)
    }

    /// Returns how the iteration ends at iterate `k`, if it does.
    fn ends(
        &mut self,
        k: usize,
        q: &Rhs<'_, T>,
        norms: Norms,
        cut: bool,
        test: &Test,
        pace: &Pace<'_, '_, T>,
    ) -> Option<Status> {
        let residual = pace.limits.norm.of(norms);
        let alarm = if cut {
            None
        } else {
            self.monitor.stop(self.method.problem(), k, residual, &self.x, &self.next)
        };
        match alarm {
            Some(_) => alarm,
            None if test.is_hidden() || self.is_at_rounding(k, q) => Some(Status::Stagnated),
            None if pace.ended == Some(Status::Stopped) => Some(Status::Stopped),
            None if k >= pace.limits.iterations => Some(Status::IterationLimit),
            None => pace.ended,
        }
    }

    /// Recovers `z` and `r` of a solve that ends without having converged; returns the status,
    /// which is `Converged` after all if they meet the tolerance, and their residual.
    fn settle(&mut self, q: &Rhs<'_, T>, test: &mut Test, status: Status) -> (Status, Norms) {
        let measured = self.recover(q, None);
        let problem = self.method.problem();
        match test.judge(problem, q, &self.x, measured, &mut self.scratch) {
            Ok(_) => (Status::Converged, measured),
            Err(best) => {
                // On ill-conditioned rows rounding may hide most of a residual.
                let exact = problem.exact_residual(q, &self.x);
                (status, exact.filter(|&exact| test.is_far(best, exact)).unwrap_or(best))
            }
        }
    }

    /// Takes the step from `x` to `next`, while the limits and the observer let it.
    fn step(
        &mut self,
        iteration: usize,
        q: &Rhs<'_, T>,
        residual: Norms,
        pace: &mut Pace<'_, '_, T>,
    ) -> Norms {
        let Self { method, x, next, .. } = self;
        let goal = pace.goal;
        let until = pace.limits.time.and_then(|time| pace.begun.checked_add(time));
        let mut beat = Instant::now();
        let mut ask = || {
            if beat.elapsed() >= BEAT {
                pace.show(iteration, residual, x);
                beat = Instant::now();
            }
            pace.is_up()
        };
        let mut clock = Clock::new(&mut ask);
        (clock.goal, clock.until) = (goal, until);
        let norms = method.step(q, x, next, &mut clock);
        if let Some(forgone) = clock.forgone {
            let is_up = clock.is_up();
            pace.forgone = Some(forgone);
            pace.ended = pace.ended.or(is_up.then_some(Status::TimeLimit));
        }
        norms
    }

    /// Shows the iterate `x` to the observer, and keeps its residual.
    fn note(&mut self, iteration: usize, norms: Norms, pace: &mut Pace<'_, '_, T>) {
        if self.history.len() < self.history_limit {
            self.history.push(norms);
        }
        pace.show(iteration, norms, &self.x);
        pace.is_up();
    }

    /// Returns whether the iterates have brought nothing for long, and rounding explains all of the
    /// residual.
    fn is_at_rounding(&self, k: usize, q: &Rhs<'_, T>) -> bool {
        let quiet = self.monitor.quiet(k);
        quiet > 0
            && quiet.is_multiple_of(QUIET)
            && self.method.problem().backward_error(q, &self.x).is_some_and(is_rounding::<T>)
    }

    /// Completes the iteration that leads to `next`, keeping `x` in `best` when it is that.
    fn advance(&mut self, q: &Rhs<'_, T>, best: bool) {
        if best {
            std::mem::swap(&mut self.x, &mut self.best);
        }
        self.method.complete(q, &mut self.next, &mut self.x);
        std::mem::swap(&mut self.x, &mut self.next);
    }

    /// Recovers `z` and `r` from `x`, into `next` and `best`, and returns the norms of their
    /// residual: the `exact` ones where these are of the same rows, and infinite ones if an entry
    /// is, which does not show in the residual where a column is zero.
    fn recover(&mut self, q: &Rhs<'_, T>, exact: Option<Norms>) -> Norms {
        let problem = self.method.problem();
        problem.solution_from_x(&self.x, &mut self.next, &mut self.best);
        if let Some(exact) = exact.filter(|_| problem.has_known_rows()) {
            return exact;
        }
        let mut entries = [&self.next, &self.best].into_iter().flatten();
        if problem.any(entries.any(|entry| entry.is_infinite())) {
            return Norms { l2: f64::INFINITY, linf: f64::INFINITY };
        }
        problem.residual(q, &self.next, &self.best, &mut self.scratch)
    }
}

/// Refuses ranks that would not go the same way; returns whether one of them may end the solve
/// early.
fn agreed<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    problem: &Hlcp<T, A, B>,
    start: &Start<'_, T>,
    limits: &Limits,
    observed: bool,
) -> Result<bool, Error> {
    if problem.strip().is_some() {
        let mut hasher = DefaultHasher::new();
        // By words, in which NaN, which is refused later, is the same as NaN.
        (mem::discriminant(start), format!("{limits:?}")).hash(&mut hasher);
        // As many bits as a number holds.
        let own = [(hasher.finish() >> 11) as f64];
        if problem.any(problem.largest(own) != own) {
            return Err(Error::Differ { what: "the start or the limits" });
        }
    }
    Ok(problem.any(observed || limits.time.is_some()))
}

/// The result of examining an iterate.
struct Look {
    /// The norms of its residual: upper bounds on the exact ones if it was refused.
    norms: Norms,
    /// The residual to report, if the iterate is the answer.
    accepted: Option<Norms>,
    /// True if the best iterate before it was lost.
    lost: bool,
}

/// Returns whether rounding in `T` explains a backward error.
fn is_rounding<T: Scalar>(backward_error: f64) -> bool {
    backward_error <= ROUNDING * T::epsilon().wide()
}

/// The limits and the observer of one solve, and whether one of them has ended it.
struct Pace<'p, 'o, T> {
    limits: &'p Limits,
    /// The residual that is asked for, apart from rounding.
    goal: f64,
    begun: Instant,
    observer: Option<Box<Observer<'o, T>>>,
    ended: Option<Status>,
    /// What was not begun, as the time would not do.
    forgone: Option<Forecast>,
    /// The ranks that end together, where one may end a solve early.
    ranks: Option<Strip>,
}

impl<T> Pace<'_, '_, T> {
    /// Shows an iterate to the observer.
    fn show(&mut self, iteration: usize, residual: Norms, x: &[T]) {
        let elapsed = self.begun.elapsed();
        if let Some(observer) = &mut self.observer
            && observer(&Progress { iteration, residual, elapsed, x }).is_break()
        {
            self.ended = Some(Status::Stopped);
        }
    }

    /// Returns whether the time is up, or the observer has said stop.
    fn is_up(&mut self) -> bool {
        if self.limits.time.is_some_and(|time| self.begun.elapsed() >= time) {
            self.ended = self.ended.or(Some(Status::TimeLimit));
        }
        if let Some(ranks) = &self.ranks {
            let own = match self.ended {
                None => 0.0,
                Some(Status::TimeLimit) => 1.0,
                Some(_) => 2.0,
            };
            let [most] = ranks.largest([own]);
            self.ended = [None, Some(Status::TimeLimit), Some(Status::Stopped)][most as usize];
        }
        self.ended.is_some()
    }
}
