//! Newton's method with algebraic multigrid inside.

use hlcp_core::{Error, Hlcp, LinearOperator, Norms, Rhs, Rows, Scalar};

use super::{Amg, nested};
use crate::{
    Clock, Jacobian, Method, Work,
    method::iterate,
    monitor::moves_by_rounding,
    multigrid::{Scaling, exact_sweep},
    safeguard::{PATIENCE, ROUGH, Safeguard, forcing},
};

/// The most iterations of one inner solve, and the sweeps that one is worth with its share of
/// set-ups.
const INNER: usize = 300;
const WORTH: usize = 7;

/// Pairs of sweeps before a step where the last one did not halve the smallest defect; otherwise
/// one.
const PAIRS: usize = 4;

/// Steps of Newton's method, without a safeguard.
#[derive(Debug, Clone)]
pub(super) struct Steps<T> {
    amg: Amg<T>,
    /// Of five-point operators with positive diagonals, by which sweeps are fused.
    scaling: Option<Scaling<T>>,
    f: Vec<T>,
    s: Vec<T>,
    scratch: Vec<T>,
    /// The last defect that was measured, with the multigrid's weights of rows.
    size: f64,
    /// The smallest defect that a step set out from, and whether the last step set out from half of
    /// the one before.
    best: f64,
    halved: bool,
    /// The signs that the last step changed.
    flips: usize,
    /// True if steps are Newton's own: no sweeps before them, and no stop at the edge of a piece.
    plain: bool,
    linear_iterations: usize,
    sweeps: usize,
    /// True if the last linear system was solved, and what a sweep took off the logarithm of its
    /// residual if not.
    solved: bool,
    rate: f64,
}

impl<T: Scalar> Steps<T> {
    pub(super) fn new<A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Result<Self, Error> {
        let zeros = || vec![T::zero(); problem.order()];
        Ok(Self {
            amg: Amg::new(problem)?,
            scaling: Scaling::of(problem),
            f: zeros(),
            s: zeros(),
            scratch: Vec::new(),
            size: f64::INFINITY,
            best: f64::INFINITY,
            halved: true,
            flips: usize::MAX,
            plain: false,
            linear_iterations: 0,
            sweeps: 0,
            solved: false,
            rate: f64::INFINITY,
        })
    }

    fn restart(&mut self) {
        self.amg.forget();
        (self.best, self.halved, self.flips) = (f64::INFINITY, true, usize::MAX);
        (self.plain, self.solved, self.rate) = (false, false, f64::INFINITY);
        (self.linear_iterations, self.sweeps) = (0, 0);
    }

    /// The work so far, in walks over the rows.
    pub(super) fn walks(&self) -> f64 {
        self.sweeps as f64 + self.amg.walks()
    }

    /// Overwrites `f` with F(x), and returns the norms of `A z − B r + q`.
    pub(super) fn measure<A, B>(&mut self, problem: &Hlcp<T, A, B>, q: &[T], x: &[T]) -> Norms
    where
        A: LinearOperator<T>,
        B: LinearOperator<T>,
    {
        self.sweeps += 1;
        problem.defect(q, x, &mut self.f, &mut self.scratch);
        let norms = problem.norms(&self.f);
        self.size = norms.l2;
        if let Some(weights) = &self.amg.units.rows {
            let square = |(&f, &weight): (&T, &T)| (f * weight).wide().powi(2);
            self.size = self.f.iter().zip(weights).map(square).sum::<f64>().sqrt();
        }
        norms.divided_by(problem.gamma())
    }

    /// Takes a step from `x`; whether it got anywhere before the clock was up.
    pub(super) fn step<A: Rows<T>, B: Rows<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        q: &[T],
        x: &mut [T],
        clock: &mut Clock<'_>,
    ) -> bool {
        let pairs = match (self.plain, self.halved) {
            (true, _) => 0,
            (_, true) => 1,
            _ => PAIRS,
        };
        for k in 0..2 * pairs {
            if clock.is_up() {
                return false;
            }
            exact_sweep(problem, self.scaling.as_ref(), q, x, &mut self.s, k % 2 == 1);
        }
        self.sweeps += 2 * pairs;
        let residual = self.measure(problem, q, x).l2;
        self.halved = self.size <= 0.5 * self.best;
        self.best = self.best.min(self.size);
        let forcing = forcing::<T>(residual, clock.goal, self.flips > 0);
        let goal = (forcing, clock.iterations(WORTH, INNER));
        let jacobian = Jacobian::new(problem, x);
        let begun = self.walks();
        let inner = self.amg.solve_within(&jacobian, &self.f, &mut self.s, goal, clock);
        self.linear_iterations += inner.iterations;
        self.solved = inner.residual <= goal.0;
        let fall = inner.residual.recip().ln().max(f64::EPSILON);
        self.rate = if self.solved { f64::INFINITY } else { fall / (self.walks() - begun) };
        self.flips = 0;
        for (x, &s) in x.iter_mut().zip(&self.s) {
            let next = *x - s;
            // J says nothing of what is beyond the edge of its piece.
            let stays = (*x >= T::zero()) == (next >= T::zero());
            self.flips += usize::from(!stays);
            *x = if stays || self.plain { next } else { T::zero() };
        }
        // NaN is not below 1 either; an entry that is not finite has made the residual NaN.
        inner.residual < 1.0 && x.iter().all(|x| x.is_finite())
    }
}

/// Semismooth Newton on F with algebraic multigrid inside: for jumps, wind and rows without a grid.
///
/// As [`Newton`](crate::Newton) does, one iteration solves the piece of F that `x` lies on, `J(x) s
/// = F(x)`, to some extent, but
///
/// * one forward and one backward sweep of exact scalar solves go before it, four pairs where the
///   last step did not halve the defect;
/// * the linear system is solved by flexible GCR with [`Amg`]'s K-cycle, to a tenth, and to what
///   ends the solve on a piece that the last step has not left;
/// * an unknown that `x − s` would carry across zero stops there. So a step does not throw a front
///   back and forth.
///
/// # The start
///
/// The first iteration takes an `x` whose residual is at most a tenth of ‖q‖ as it is. Otherwise it
/// starts from the solution of a coarser problem, and that one from the next: rows are paired
/// twice, as in [`Amg`] but by the couplings of `A` and `B` together, `q` and all couplings are
/// summed over pairs, so that oil is conserved, and couplings that conduct both ways are first put
/// in series with half of those within their aggregates. On a grid these are cells of two by two;
/// no grid need be known.
///
/// # Safeguard
///
/// That of [`Newton`](crate::Newton), but a phase ends after 6, 12, 24, … steps in a row, in the
/// first, second, third phase, that have not brought ‖F‖ to nine tenths of its smallest value in
/// the phase; or when a step leads nowhere, or a linear solve fails. Then the base method takes
/// over at the best iterate of the phase, for 2, 4, 8, … iterations. Every second phase takes
/// Newton's own steps: without sweeps, and across zero.
///
/// # Cost
///
/// An iteration takes a defect, a pair of sweeps or four, another defect and the linear solve;
/// [`work`](Method::work) counts all of it, set-ups and start included, in walks over the rows.
/// Storage: `3n` numbers, `n` more on a grid unless Ω = D_A D_B⁻¹, `2n` of scratch, [`Amg`]'s and
/// the base's; the start takes as much again for a while.
///
/// # Convergence
///
/// Where the base converges for every `q` by a theorem of `docs/theory.md`, as accelerated
/// Gauss–Seidel does on films, some iterate is within any tolerance, from any start, by the proof
/// for [`Newton`](crate::Newton). Sweeps within a phase and the start of the first do not matter to
/// it.
///
/// # Source
///
/// The outer iteration is Newton's for the Fischer–Burmeister form of T. Woloszynski, P. Podsiadlo
/// and G. W. Stachowiak, *Efficient solution to the cavitation problem in hydrodynamic
/// lubrication*, Tribology Letters 58 (2015), with another function and inexact; sweeps before a
/// linear correction that stops at the edge of its piece are those of R. Kornhuber, *Monotone
/// multigrid methods for elliptic variational inequalities I*, Numerische Mathematik 69 (1994). For
/// the multigrid see [`Amg`].
///
/// ```
/// use hlcp_methods::{AmgNewton, Aor, FivePoint, Hlcp, Limits, Solver, Tmms};
///
/// // A conducts, a hundredfold in stripes, and B carries along x.
/// let (m, c) = (64, |i: usize| if i / 8 % 2 == 0 { 1.0 } else { 100.0 });
/// let a = FivePoint::from_fn(m, m, |i, _| [-c(i), -1.0, 2.0 + 2.0 * c(i), -1.0, -c(i)])?;
/// let b = FivePoint::new(m, m, [0.0, -1.0, 1.0, 0.0, 0.0])?;
/// let q: Vec<f64> = (0..m * m).map(|k| if k % m < 40 { -0.01 } else { 0.02 }).collect();
///
/// let base = Tmms::mirrored(Hlcp::from_pair(&a, &b)?, Aor::gauss_seidel().accelerated())?;
/// let mut solver = Solver::new(AmgNewton::new(base)?);
/// let outcome = solver.solve(&q, Limits::default())?;
/// assert!(outcome.converged() && outcome.linear_iterations <= Some(100), "{outcome}");
/// assert!(solver.method().amg().set_ups() <= outcome.iterations + 1);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct AmgNewton<T, M> {
    base: M,
    steps: Steps<T>,
    safeguard: Safeguard<T>,
    pub(super) base_iterations: usize,
    /// The walks of the start on coarser problems.
    started: f64,
    /// The part of ‖q‖ above which the residual must be for the first step to be that start.
    due: Option<f64>,
}

impl<T: Scalar, M: Method<T>> AmgNewton<T, M>
where
    M::A: Rows<T>,
    M::B: Rows<T>,
{
    /// Newton's method on the problem of `base`, which it falls back on.
    ///
    /// # Errors
    ///
    /// As [`Amg::new`]; [`Error::OneRank`] for a problem that ranks share.
    pub fn new(base: M) -> Result<Self, Error> {
        base.problem().on_one_rank("algebraic multigrid")?;
        let steps = Steps::new(base.problem())?;
        Ok(Self {
            safeguard: Safeguard::new(steps.f.len()),
            base,
            steps,
            base_iterations: 0,
            started: 0.0,
            due: Some(ROUGH),
        })
    }

    /// The multigrid at work.
    pub fn amg(&self) -> &Amg<T> {
        &self.steps.amg
    }

    /// What a sweep took off the logarithm of the last linear residual, unless that system was
    /// solved: Newton's method cannot do better.
    pub(crate) fn rate(&self) -> f64 {
        self.steps.rate
    }

    /// Takes up the solve from another iterate; with a `cold` one, the result of other methods'
    /// work from far away, whose residual is small but not its error, a first step starts on
    /// coarser problems.
    pub(crate) fn take_up(&mut self, cold: bool) {
        self.safeguard.take_up();
        if cold {
            self.due = self.due.map(|_| 0.0);
        }
    }
}

impl<T: Scalar, M: Method<T>> Method<T> for AmgNewton<T, M>
where
    M::A: Rows<T>,
    M::B: Rows<T>,
{
    type A = M::A;
    type B = M::B;

    fn problem(&self) -> &Hlcp<T, M::A, M::B> {
        self.base.problem()
    }

    fn work(&self) -> Option<Work> {
        let sweeps = (self.started + self.steps.walks()).ceil() as usize;
        let own = Work { sweeps, linear_iterations: Some(self.steps.linear_iterations) };
        Some(own + self.base.work().unwrap_or(Work::sweeps(self.base_iterations)))
    }

    fn restart(&mut self) {
        self.base.restart();
        self.steps.restart();
        self.safeguard.restart();
        (self.base_iterations, self.started, self.due) = (0, 0.0, Some(ROUGH));
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        Some(self.steps.measure(self.base.problem(), q.entries(), x))
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        if self.safeguard.rests() {
            self.base_iterations += 1;
            return iterate(&mut self.base, q, x, y, &mut self.steps.f, clock);
        }
        let problem = self.base.problem();
        // The residual is measured in the units of rows that are found here.
        let is_oriented = self.steps.amg.orient(problem, clock).is_some();
        let norms = self.steps.measure(problem, q.entries(), x);
        y.copy_from_slice(x);
        if !is_oriented {
            return norms;
        }
        // A linear system has to show what it is worth, but not on coarser problems, nor where the
        // one before was solved.
        let least = std::mem::take(&mut clock.least);
        if self.due.take().is_some_and(|part| norms.l2 > part * q.norms().l2) {
            // What coarser problems refuse, a diagonal that is not positive, leaves x as it is.
            let walks = nested::start(problem, q.entries(), &self.steps.amg.units, y, clock);
            self.started = walks.unwrap_or(0.0);
        }
        if !self.steps.solved {
            clock.least = least;
        }
        // 6, 12, 24, …: a front that moves by a point a step is to get through some day.
        let patience = PATIENCE.saturating_mul(self.safeguard.age());
        let is_patient = self.safeguard.see(self.steps.size, x, true) < patience;
        let steps = is_patient && self.steps.step(problem, q.entries(), y, clock);
        // A step that leads nowhere would be repeated for ever.
        let is_good = steps && !moves_by_rounding(self.base.problem(), x, y);
        if !is_good && !clock.is_up() {
            // What the base makes of the best iterate of the phase, and the base goes on.
            self.safeguard.end();
            self.steps.plain = !self.steps.plain;
            self.base_iterations += 1;
            let _ = iterate(&mut self.base, q, &self.safeguard.best, y, &mut self.steps.f, clock);
        }
        norms
    }
}
