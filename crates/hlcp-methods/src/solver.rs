use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use hlcp_core::{Error, LinearOperator, Norms, Rhs, Scalar, all_finite};

use crate::{
    Limits, Method, Norm, Outcome, Status,
    watch::{Alarm, Watch},
};

/// Iterates a [`Method`] and owns the vectors it takes.
///
/// # Storage
///
/// Three vectors of length `n` beside the method's own, allocated by [`new`](Self::new), and `2n` numbers
/// of scratch by the first solve, none by later ones unless an operator's product allocates; no scratch
/// where both operators are five-point ones on one grid. A fourth vector only where the iterates are
/// suspected to repeat.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega};
/// use hlcp_methods::{Limits, Mms, Solver};
///
/// let a = FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let problem = Hlcp::new(a, Identity { order: 3 }, Omega::Uniform(4.0))?;
/// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
///
/// let outcome = solver.solve(&[-2.0, 5.0, -6.0], &[1.0; 3], &Limits::default())?;
/// assert!(outcome.converged());
/// assert!(f64::abs(solver.z()[2] - 1.5) < 1e-10);
/// assert!(f64::abs(solver.r()[1] - 3.0) < 1e-10);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Solver<T, M> {
    method: M,
    // During a solve: the iterate, the next one, and the best one where that is neither.
    x: Vec<T>,
    z: Vec<T>,
    r: Vec<T>,
    scratch: Vec<T>,
    watch: Watch<T>,
    history: Vec<Norms>,
    history_limit: usize,
}

/// What an observer sees of a running solve.
///
/// ```
/// use std::ops::ControlFlow;
/// use hlcp_core::{Aor, Hlcp, Identity, Omega};
/// use hlcp_methods::{Limits, Mms, Progress, Solver};
///
/// let problem = Hlcp::new(Identity { order: 1 }, Identity { order: 1 }, Omega::Uniform(1.0))?;
/// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
/// let mut seen = vec![];
/// let note = |progress: &Progress<'_, f64>| {
///     seen.push((progress.iteration, progress.x[0], progress.residual.linf));
///     ControlFlow::Continue(())
/// };
/// let _ = solver.solve_observed(&[-3.0], &[0.0], &Limits::default(), note)?;
/// assert_eq!(seen, [(0, 0.0, 3.0), (1, 1.5, 0.0)]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Progress<'s, T> {
    /// How many iterations led to the iterate; 0 for the start.
    pub iteration: usize,
    /// The norms of `A z − B r + q` at the iterate, as the next step saw them.
    pub residual: Norms,
    /// The time since the solve began.
    pub elapsed: Duration,
    /// The iterate.
    pub x: &'s [T],
}

/// What a residual is held against.
struct Test<'l, T> {
    limits: &'l Limits<T>,
    /// The absolute tolerance and the one relative to ‖q‖.
    tolerance: f64,
    /// The lengths of a typical row of A and of B.
    rows: [f64; 2],
    /// The size of the terms that the residual sums.
    size: f64,
}

impl<T: Scalar> Test<'_, T> {
    fn within(&self, norms: Norms) -> bool {
        let residual = self.limits.norm.of(norms);
        residual.is_finite() && residual <= self.tolerance.max(self.limits.roundings() * self.size)
    }
}

impl<T: Scalar, M: Method<T>> Solver<T, M> {
    /// A solver for `method`, with its vectors.
    pub fn new(method: M) -> Self {
        let zeros = vec![T::zero(); method.problem().order()];
        Self {
            method,
            x: zeros.clone(),
            z: zeros.clone(),
            r: zeros,
            scratch: Vec::new(),
            watch: Watch::new(),
            history: Vec::new(),
            history_limit: 0,
        }
    }

    /// Keeps the residuals of the first `iterates` iterates of each solve, in storage allocated here.
    ///
    /// ```
    /// use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega};
    /// use hlcp_methods::{Limits, Mms, Solver};
    ///
    /// let a = FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 3 }, Omega::Uniform(4.0))?;
    /// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?).with_history(100);
    /// let outcome = solver.solve(&[-2.0, 5.0, -6.0], &[1.0; 3], &Limits::default())?;
    /// assert_eq!(solver.history().len(), outcome.iterations + 1);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn with_history(self, iterates: usize) -> Self {
        Self { history: Vec::with_capacity(iterates), history_limit: iterates, ..self }
    }

    /// The residuals of the last solve's iterates, from the start on, as far as there was storage for them.
    pub fn history(&self) -> &[Norms] {
        &self.history
    }

    /// The method.
    pub fn method(&self) -> &M {
        &self.method
    }

    /// `z` of the last solve.
    pub fn z(&self) -> &[T] {
        &self.z
    }

    /// `r` of the last solve.
    pub fn r(&self) -> &[T] {
        &self.r
    }

    /// The modulus variable `x` of the last solve: `z = (|x| + x)/γ`, `r = Ω(|x| − x)/γ`.
    pub fn x(&self) -> &[T] {
        &self.x
    }

    /// Solves HLCP(A, B, q) from the start `x0`.
    ///
    /// For `q = 0` the answer is `x = 0`, whatever the start.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] when `q` or `x0` does not fit the problem, [`Error::NotFinite`] for their first entry
    /// that is NaN or infinite, [`Error::Parameter`] for a tolerance that is negative or not finite. An
    /// iteration that does not converge is no error: read the [`Outcome`].
    pub fn solve(&mut self, q: &[T], x0: &[T], limits: &Limits<T>) -> Result<Outcome, Error> {
        self.solve_observed(q, x0, limits, |_| ControlFlow::Continue(()))
    }

    /// Solves HLCP(A, B, q) from the [`x`](Self::x) of the last solve, or from 0 where there was none: the next of a sequence
    /// of problems that change little, or the same one where a limit ended it.
    ///
    /// # Errors
    ///
    /// As [`solve`](Self::solve).
    ///
    /// ```
    /// use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega};
    /// use hlcp_methods::{Limits, Mms, Solver};
    ///
    /// let a = FivePoint::new(20, 1, [0.0, -1.0, 2.1, -1.0, 0.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 20 }, Omega::Uniform(2.1))?;
    /// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
    /// let load = |time: f64| (0..20).map(|i| (0.3 * i as f64 + time).sin()).collect::<Vec<_>>();
    /// let cold = solver.solve(&load(0.0), &[1.0; 20], &Limits::default())?;
    /// for step in 1..5 {
    ///     let warm = solver.resume(&load(1e-6 * step as f64), &Limits::default())?;
    ///     assert!(warm.converged() && warm.iterations < cold.iterations);
    /// }
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn resume(&mut self, q: &[T], limits: &Limits<T>) -> Result<Outcome, Error> {
        self.start(q, None, limits, |_| ControlFlow::Continue(()))
    }

    /// As [`solve`](Self::solve), showing every iterate to `observer`, which may stop the solve.
    ///
    /// An iterate that meets the tolerance has converged even where the observer says stop.
    ///
    /// # Errors
    ///
    /// As [`solve`](Self::solve).
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega};
    /// use hlcp_methods::{Limits, Mms, Solver, Status};
    ///
    /// let a = FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 3 }, Omega::Uniform(4.0))?;
    /// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
    /// let outcome = solver.solve_observed(&[-2.0, 5.0, -6.0], &[1.0; 3], &Limits::default(), |progress| {
    ///     if progress.x[1] < 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    /// })?;
    /// assert_eq!(outcome.status, Status::Stopped);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn solve_observed(
        &mut self,
        q: &[T],
        x0: &[T],
        limits: &Limits<T>,
        observer: impl FnMut(&Progress<'_, T>) -> ControlFlow<()>,
    ) -> Result<Outcome, Error> {
        self.start(q, Some(x0), limits, observer)
    }

    /// Solves from `x0`, or from `x` as it is.
    fn start(
        &mut self,
        q: &[T],
        x0: Option<&[T]>,
        limits: &Limits<T>,
        observer: impl FnMut(&Progress<'_, T>) -> ControlFlow<()>,
    ) -> Result<Outcome, Error> {
        let n = self.method.problem().order();
        for (what, found) in [("q", q.len()), ("x0", x0.map_or(n, <[T]>::len))] {
            if found != n {
                return Err(Error::Order { what, found, expected: n });
            }
        }
        let q = Rhs::new(q)?;
        all_finite("x0", x0.unwrap_or(&self.x))?;
        let tolerance = limits.tolerance(&q)?;
        let start = Instant::now();
        if q.norms().linf == 0.0 {
            self.x.fill(T::zero());
        } else if let Some(x0) = x0 {
            self.x.copy_from_slice(x0);
        }
        let mut test = Test { limits, tolerance, rows: [0.0; 2], size: 0.0 };
        if limits.rounding > T::zero() {
            test.rows = self.rows();
        }
        let (status, iterations, answer, residual) = self.iterate(&q, &mut test, start, observer);
        let (sweeps, elapsed) = (self.method.sweeps(iterations), start.elapsed());
        Ok(Outcome { status, iterations, answer, sweeps, elapsed, residual })
    }

    /// The lengths of a typical row of `A` and of `B`, from one product each with random signs.
    fn rows(&mut self) -> [f64; 2] {
        let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
        for sign in &mut self.r {
            // Knuth's linear congruential generator; its top bit.
            bits = bits
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            *sign = if bits >> 63 == 0 { T::one() } else { -T::one() };
        }
        let (problem, n) = (self.method.problem(), self.r.len() as f64);
        problem.a().apply(&self.r, &mut self.z);
        let a = Norms::of(&self.z).l2 / n.sqrt();
        problem.b().apply(&self.r, &mut self.z);
        [a, Norms::of(&self.z).l2 / n.sqrt()]
    }

    /// Iterates until `limits`, the observer or the iterates say stop, and leaves the answer in `x`, `z` and `r`.
    ///
    /// Returns the status, the number of iterations, the answer's own, and the answer's residual.
    fn iterate(
        &mut self,
        q: &Rhs<'_, T>,
        test: &mut Test<'_, T>,
        start: Instant,
        mut observer: impl FnMut(&Progress<'_, T>) -> ControlFlow<()>,
    ) -> (Status, usize, usize, Norms) {
        let limits = test.limits;
        self.method.restart();
        self.watch.begin(limits.norm.of(q.norms()), self.method.remembers());
        self.history.clear();
        let mut answer = 0;
        for k in 0_usize.. {
            // Between powers of four an older size serves, until something passes.
            if k == 0 || k.is_power_of_two() && k.trailing_zeros().is_multiple_of(2) {
                test.size = self.size(q, test);
            }
            let seen = self.method.residual(q, &self.x).filter(|&norms| test.within(norms));
            let norms = seen.unwrap_or_else(|| self.method.step(0, q, &self.x, &mut self.z));
            let residual = limits.norm.of(norms);
            let mut best = self.watch.is_best(k, residual);
            if self.history.len() < self.history_limit {
                self.history.push(norms);
            }
            let elapsed = start.elapsed();
            let stopped =
                observer(&Progress { iteration: k, residual: norms, elapsed, x: &self.x });
            if test.within(norms) {
                // The answer's own residual and size decide; the step's were their forerunners.
                test.size = self.size(q, test);
                let residual = self.recover(q);
                if test.within(residual) {
                    return (Status::Converged, k, k, residual);
                }
                // The check used the vectors of the best iterate and of the next one.
                self.r.copy_from_slice(&self.x);
                let _ = self.method.step(0, q, &self.x, &mut self.z);
                best = true;
            }
            if best {
                answer = k;
            }
            let status = match self.watch.alarm(k, residual, &self.x, &self.z) {
                Some(Alarm::Diverging(divergence)) => Status::Diverged(divergence),
                Some(Alarm::Resting) => Status::Stagnated,
                Some(Alarm::Repeating { period }) => Status::Cycling { period },
                None if stopped.is_break() => Status::Stopped,
                None if k >= limits.iterations => Status::IterationLimit,
                None if limits.time.is_some_and(|time| elapsed >= time) => Status::TimeLimit,
                None => {
                    self.advance(q, best);
                    continue;
                }
            };
            if !best {
                std::mem::swap(&mut self.x, &mut self.r);
            }
            test.size = self.size(q, test);
            let residual = self.recover(q);
            let status = if test.within(residual) { Status::Converged } else { status };
            return (status, k, answer, residual);
        }
        unreachable!("the iteration limit ends the loop")
    }

    /// Completes the iteration whose first step led from `x` to `z`, keeping `x` in `r` when it is the best.
    fn advance(&mut self, q: &Rhs<'_, T>, best: bool) {
        if best {
            std::mem::swap(&mut self.x, &mut self.r);
        }
        for k in 1..self.method.steps() {
            let _ = self.method.step(k, q, &self.z, &mut self.x);
            std::mem::swap(&mut self.z, &mut self.x);
        }
        std::mem::swap(&mut self.x, &mut self.z);
    }

    /// `‖q‖ + a‖z‖ + b‖r‖` at `x`; 0, which accepts nothing, where it is not finite or not asked for.
    fn size(&self, q: &Rhs<'_, T>, test: &Test<'_, T>) -> f64 {
        if test.limits.rounding == T::zero() {
            return 0.0;
        }
        let problem = self.method.problem();
        let to_f64 = |v: T| v.to_f64().unwrap_or(f64::NAN);
        // Lanes side by side, which a processor sums at once.
        let (mut z, mut r) = ([[0.0; 8]; 2], [[0.0; 8]; 2]);
        for (i, x) in self.x.chunks(8).enumerate() {
            for (l, &x) in x.iter().enumerate() {
                let (x, omega) = (to_f64(x), to_f64(problem.omega().at(8 * i + l)));
                for (sums, v) in [(&mut z, x.max(0.0)), (&mut r, omega * (-x).max(0.0))] {
                    sums[0][l] += v * v;
                    sums[1][l] = f64::max(sums[1][l], v);
                }
            }
        }
        let [z, r] = [z, r].map(|[squares, largest]| match test.limits.norm {
            Norm::L2 => squares.iter().sum::<f64>().sqrt(),
            Norm::LInf => largest.into_iter().fold(0.0, f64::max),
        });
        let terms = 2.0 * (test.rows[0] * z + test.rows[1] * r) / to_f64(problem.gamma());
        let size = test.limits.norm.of(q.norms()) + terms;
        if size.is_finite() { size } else { 0.0 }
    }

    /// Recovers `z` and `r` from `x`, and measures them.
    fn recover(&mut self, q: &Rhs<'_, T>) -> Norms {
        let problem = self.method.problem();
        problem.recover(&self.x, &mut self.z, &mut self.r);
        problem.residual(q, &self.z, &self.r, &mut self.scratch)
    }
}
