use hlcp_core::{Error, Hlcp, Norms, Rhs, Rows, Scalar};

use crate::{
    Clock, Method, Pivoting, Status, Work,
    limits::FRACTION,
    method::measure,
    pivoting::{self, a_couples_more},
    safeguard::ROUGH,
};
use candidate::{Candidate, Shape, Worker};

mod candidate;
mod history;

pub use history::{AutoChoice, AutoEnd, AutoTurn};

/// The method for people who do not want to choose one: several take turns, by the progress that
/// they are measured to make.
///
/// * Where `A` and `B` are tridiagonal it begins with [`Newton`] by direct inner solves, from afar
///   with all columns of the operator that couples less, if their answer has their signs, and else
///   with all of the other: from there fronts have less far to go than from the start. Steps follow
///   without a look at residuals while one of two leaves fewer than three quarters of wrong signs.
/// * Elsewhere it begins, on a grid of five-point operators, with [`AdaptiveSor`], which finds α as
///   it goes; without one, with [`Anderson`]. Where an elimination is worth no more than 20 sweeps,
///   as of small full matrices, trees, and networks of pipes or roads, [`Pivoting`] goes on once an
///   iteration has not left a hundredth of the residual.
/// * The others of these wait, and [`Multigrid`] by F-cycles, if there are coarser grids, and
///   [`AmgNewton`].
///
/// Unknowns are taken in the order that they have; [`Renumbered`](crate::Renumbered) gives them
/// another one, as [`Named`](crate::Named) does where they are numbered at random.
///
/// Each is set up when its first turn comes, and left out if it cannot be. [`uses`](Self::uses)
/// says which is at work, and [`turns`](Method::turns) why those before were left.
///
/// # Turns
///
/// Progress is what a sweep, or work that is [worth](Method::work) one, takes off the logarithm of
/// the smallest residual so far. It is measured over a window of work, of a method's first one over
/// the second half, and then the method with the best prospect goes on: a method's prospect is its
/// last progress, or its *promise* if that is more. Promise and window are, to begin with,
///
/// | method | promise | window, in sweeps |
/// |---|---|---|
/// | multigrid | 0.1; 0.13 on planes with 4000 points and more where one of `A` and `B` is diagonal; 1.2 on planes with constant coefficients | 24, or two cycles |
/// | Newton's method with algebraic multigrid | 0.12 on a plane, 0.04 on a line, 0.075 elsewhere; 0.0025 where positive couplings, off planes, are 0.35 times the negative ones or more | 1000 |
/// | adaptive SOR | 0.16 on a plane, 0.02 elsewhere | 16 on a plane, 24 elsewhere |
/// | Anderson | 0.02 | 24 |
/// | Newton's method on a line | 0.01 | 400, or 80 steps of elimination |
/// | pivoting | ten digits in twenty eliminations | 84 eliminations |
///
/// where a plane is a grid whose operators are not tridiagonal, as they are on a line. The progress
/// of adaptive SOR on a plane counts fourfold, for its sweeps are fused and take a quarter of the
/// time; where coefficients are constant its progress counts twelvefold, and that of multigrid
/// does; where multigrid promises 0.13 its progress counts one and a half times. After each window
/// of a method its promise is halved and its window doubled. A method that takes off as much in
/// another such window as the tolerance asks for goes on whatever the others' prospects. So SOR
/// that takes ten digits in 770 sweeps is left alone, or in 230 where coefficients are constant,
/// cycles go on while each halves the residual or nearly does, or takes a tenth off it where
/// coefficients are constant, and a method that has failed is tried again, for longer, when nothing
/// else does better. Inner linear solves keep to what is left of the window. A linear solve of
/// algebraic multigrid has to show its worth, unless the one before came to its end: `Auto` ends
/// it, and the window with it, if a sweep takes less off its residual than another method's
/// prospect. Where the solver would end with [`Stagnated`](crate::Status::Stagnated), the method at
/// work is given up for the rest of the solve and the next one goes on, until none is left.
/// Decisions depend on residuals and counts alone, never on time, but that no elimination is begun
/// that would outlast a limit on it.
///
/// Each method has an iterate of its own, because a residual tells little of an error: on a rough
/// film all but a hundred signs may be settled and the residual still be larger than what sweeps
/// leave; on a film that goes round it may be small far from every solution. The first turn of a
/// method begins from the iterate that is kept, whose residual is at most ten times the smallest so
/// far, or from the next one; later ones go on from its own. A residual that grows to 10⁶ times the
/// larger of ‖q‖ and the first one ends the window and drops the iterate, one of pivoting to 10¹⁵
/// times, as its first columns may be all but singular; adaptive SOR goes on from the one that is
/// kept, with a smaller α. What the solver would report as [`Diverged`](crate::Status::Diverged)
/// counts as growth.
///
/// Where no grid is known, or one that closes on itself, and before a second method takes its turn,
/// pairs of sweeps from a large `r` and `z = 0` are tried, and from the reverse, while each leaves
/// a hundredth of the residual. That solves a film that nobody feeds, which has infinitely many
/// answers without pressure (`docs/theory.md`, "One side alone"). An iterate that does not meet the
/// tolerance then is dropped.
///
/// [`AmgNewton`] starts its first turn on coarser problems, unless the solve set out from an
/// iterate with a residual of a tenth of ‖q‖. What sweeps leave of a residual is small, but their
/// error is not, and from there Newton's method may take many times as long.
///
/// A method that has come to rest short of the tolerance has no more turns. Where that is one of
/// Newton's, within a thousandth of the first residual or ‖q‖, rounding is the likely reason, and
/// the others have twice the work until then and 300 sweeps to halve the residual, and again after
/// each time they do; else the solve stagnates. After pivoting that leaves no sign wrong they have
/// 300 sweeps alone.
///
/// Where ranks share the problem, adaptive SOR, multigrid and Anderson take turns: the others work
/// on one rank. Until it would take up one of these, `Auto` comes to the bits of one process.
///
/// # The direct way
///
/// [`Pivoting`] is the way out where nothing else converges: with the feature `direct` for sparse
/// matrices of any order, without it up to order 500. Until its first turn an elimination counts as
/// 60 sweeps, the price of its analysis, or as 21 and more, by the order, where half of all entries
/// are there; then it is what the analysis says, and out of the question beyond 4 GB, or where one
/// would outlast the time limit.
///
/// # Cost
///
/// Two walks over the rows of `A` and `B` to begin with, three without a grid; then that of the
/// method at work. On a line some direct solves from afar, and elsewhere, where a row has five
/// entries or fewer, an analysis of Cholesky's factors, after the second step. Storage: `3n`
/// numbers, `2n` of scratch, and of each method that has had a turn `n` and its own; `4n` for a
/// while where sweeps from one side are tried.
///
/// # Convergence
///
/// Let one of the methods halve the residual with every `W` sweeps' worth of work, from wherever it
/// is set going, and let `c` be the least of 0.11, `W` times its first promise, and an eighth of
/// that promise times its first window. Then the logarithm of the smallest residual falls by
/// `c/(36W)` a sweep or more in the mean, apart from `2k/c` times `W` sweeps for each method, where
/// `k` is its first promise times its first window, and from the last window. `docs/theory.md`
/// ("Turns that are measured") has the proof. It needs promise times window to stay what it is, so
/// that no promise falls below the progress of a good method before the window of that is long
/// enough to show it.
///
/// [`AdaptiveSor`]: crate::AdaptiveSor
/// [`AmgNewton`]: crate::AmgNewton
/// [`Anderson`]: crate::Anderson
/// [`Multigrid`]: crate::Multigrid
/// [`Newton`]: crate::Newton
///
/// ```
/// use hlcp_methods::{Auto, AutoChoice, AutoEnd, FivePoint, Hlcp, Method, Options, Solver};
///
/// let problem = Hlcp::lcp(FivePoint::new(100, 100, [-1.0, -1.0, 4.0, -1.0, -1.0])?)?;
/// let q: Vec<f64> = (0..10_000).map(|k| if k % 100 < 60 { -1e-3 } else { 2e-3 }).collect();
///
/// let mut solver = Solver::new(Auto::new(problem)?);
/// let outcome = solver.solve(&q, Options::from_x(&vec![1.0; 10_000]))?;
/// assert!(outcome.converged() && solver.method().uses() == AutoChoice::Multigrid);
/// let first = solver.method().turns()[0];
/// assert_eq!((first.choice, first.end), (AutoChoice::Sor, Some(AutoEnd::Slow)));
/// assert_eq!(first.sweeps, 17);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Auto<T: Scalar, A, B> {
    problem: Hlcp<T, A, B>,
    shape: Shape,
    candidates: Vec<Candidate<T, A, B>>,
    /// Which of them is at work.
    at: usize,
    /// The work at the beginning of the window, and in the middle of a method's first one, with the
    /// smallest residual then.
    begun: (usize, f64),
    middle: Option<(usize, f64)>,
    /// The smallest residual so far.
    best: f64,
    /// An iterate and its residual, of at most ten times the smallest.
    kept: Vec<T>,
    kept_residual: f64,
    /// Once the method at work has begun its turn on its own iterate, the smallest residual of the
    /// others.
    others: Option<f64>,
    /// The larger of ‖q‖ and the first residual, and whether that was the latter by far.
    scale: f64,
    cold: bool,
    /// The work that is none of the methods', in sweeps.
    aside: usize,
    /// True until a start from one side was tried, where no grid is known or it is a line.
    has_sides: bool,
    /// True until the factors of matrices with few entries were looked at.
    may_be_net: bool,
    /// Where one of Newton's methods has come to rest, the work after which the others give up, and
    /// the residual that lets them go on.
    last: Option<(usize, f64)>,
    /// True once the method at work has taken a step of its turn.
    stepped: bool,
    scratch: Vec<T>,
    history: Vec<AutoTurn>,
}

/// A residual of this part of that of the iterate that is kept is worth keeping its own.
const GAIN: f64 = 0.1;

/// Pairs of sweeps go on while each leaves this part of the residual, from one side and before
/// elimination.
const LEFT: f64 = 0.01;

/// A start from one side has so many times the largest entry that a pair of sweeps from 0 leaves on
/// that side: further sweeps carry it on and take from it, and it is to stay positive.
const LARGE: f64 = 4.0;

/// A residual of this many times the larger of ‖q‖ and the first residual has grown. The
/// [`Solver`](crate::Solver) bears 10¹⁶ times as much, and a sweep may add some powers of ten.
const GROWN: f64 = 1e6;

/// Where one of Newton's methods has come to rest, the solve ends after so many times the work
/// until then, or until the residual was halved last, and so many sweeps.
const LAST: usize = 3;
const LEAST: usize = 100;

impl<T: Scalar, A: Rows<T> + Clone, B: Rows<T> + Clone> Auto<T, A, B> {
    /// The method on `problem`; operators are cloned, so give large ones by reference.
    ///
    /// # Errors
    ///
    /// Those of elimination, or if there is none of the method that it would begin with, if no
    /// method can be set up.
    pub fn new(problem: Hlcp<T, A, B>) -> Result<Self, Error> {
        let shape = Shape::of(&problem);
        let mut auto = Self {
            candidates: shape.choices().map(|choice| Candidate::new(choice, shape)).collect(),
            at: 0,
            begun: (0, f64::INFINITY),
            middle: None,
            best: f64::INFINITY,
            kept: vec![T::zero(); problem.order()],
            kept_residual: f64::INFINITY,
            others: None,
            scale: 0.0,
            cold: false,
            aside: 0,
            has_sides: false,
            may_be_net: shape.is_alone && !shape.is_line && !shape.has_grid,
            last: None,
            stepped: false,
            scratch: vec![],
            history: Vec::with_capacity(8),
            shape,
            problem,
        };
        auto.restart();
        // Elimination needs no pivots on the diagonal, but the others do.
        let mut refused = None;
        while let Err(error) = auto.set_up(auto.at) {
            let is_last = auto.uses() == AutoChoice::Pivoting;
            refused = Some(refused.filter(|_| !is_last).unwrap_or(error));
            auto.candidates.remove(auto.at);
            if auto.candidates.is_empty() {
                break;
            }
            auto.restart();
        }
        refused.filter(|_| auto.candidates.is_empty()).map_or(Ok(auto), Err)
    }

    /// The method at work.
    pub fn uses(&self) -> AutoChoice {
        self.candidates[self.at].choice
    }

    /// The place of a method among those that may take turns.
    fn place(&self, choice: AutoChoice) -> Option<usize> {
        self.candidates.iter().position(|each| each.choice == choice)
    }

    /// Sets up a method, if it has not been.
    fn set_up(&mut self, at: usize) -> Result<(), Error> {
        let candidate = &mut self.candidates[at];
        if candidate.worker.is_none() {
            let problem = self.problem.clone();
            candidate.worker = Some(Worker::new(candidate.choice, problem)?);
        }
        Ok(())
    }

    /// Overwrites `y` with what pairs of sweeps from a large `r` and `z = 0`, or from the reverse,
    /// lead to while each leaves a hundredth of the residual, if they get to `goal`; returns
    /// whether they do.
    fn solve_from_one_side(
        &mut self,
        q: &Rhs<'_, T>,
        y: &mut [T],
        residual: f64,
        goal: f64,
    ) -> bool {
        let Self { problem, aside, scratch, .. } = self;
        let [mut z, mut r, mut x, mut f] = [(); 4].map(|()| vec![T::zero(); y.len()]);
        let mut sweep = |x: &mut [T]| {
            [false, true].into_iter().for_each(|back| problem.solve_rows(q.entries(), x, back));
            *aside += 3;
        };
        // What q alone leads to tells how large.
        sweep(&mut x);
        problem.solution_from_x(&x, &mut z, &mut r);
        let large = |v: &[T]| T::of(LARGE) * v.iter().fold(T::zero(), |max, &v| max.max(v));
        for side in [[T::zero(), large(&r)], [large(&z), T::zero()]] {
            z.fill(side[0]);
            r.fill(side[1]);
            problem.x_from_solution(&z, &r, &mut x);
            let (mut last, mut left) = (f64::INFINITY, residual);
            while left <= LEFT * last {
                sweep(&mut x);
                last = left;
                left = measure(problem, q, &x, &mut f, scratch).l2;
                if left <= goal {
                    y.copy_from_slice(&x);
                    return true;
                }
            }
        }
        false
    }

    /// Overwrites `y`, on a line where `x` is far from a solution, with the answer of all columns
    /// of `A`, or of all of `B`, if its signs are theirs, or else with that of the columns to which
    /// all of the operator that couples more lead soon; returns the residual of `x` then.
    fn open_line(
        &mut self,
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
        clock: &mut Clock<'_>,
    ) -> Option<Norms> {
        self.has_sides = false;
        self.aside += 1;
        let norms = measure(&self.problem, q, x, y, &mut self.scratch);
        let is_cold = norms.l2 > ROUGH * q.norms().l2;
        if !is_cold {
            return None;
        }
        let of_a = a_couples_more(&self.problem);
        let first = &mut self.candidates[self.at];
        let Some(Worker::Newton(newton)) = &mut first.worker else { return None };
        let leads = newton.solve_on_side(!of_a, false, q, y, clock)
            || newton.solve_on_side(of_a, true, q, y, clock);
        leads.then(|| {
            first.iterations += 1;
            norms
        })
    }

    /// Lets elimination go on where it is worth no more than some sweeps, as of a small matrix or
    /// where factors are hardly more than the matrices; returns whether it does. The iterate `y` of
    /// the method at work is put aside.
    fn takes_up_elimination(&mut self, y: &[T]) -> bool {
        let Some(at) = self.place(AutoChoice::Pivoting) else { return false };
        let may_be_net = std::mem::take(&mut self.may_be_net);
        let net = may_be_net.then(|| Pivoting::without_fill(&self.problem)).flatten();
        if let Some(pivoting) = net {
            self.shape.worth = pivoting.worth();
            self.candidates[at] = Candidate::new(AutoChoice::Pivoting, self.shape);
            self.candidates[at].worker = Some(Worker::Pivoting(Box::new(pivoting)));
        }
        let is_cheap = self.shape.worth <= pivoting::CHEAP && !self.shape.is_line;
        let moves_on = is_cheap && at != self.at && self.set_up(at).is_ok();
        if moves_on {
            self.leave(self.at, y);
            self.move_to(at, AutoEnd::Slow);
            self.count_from(self.sweeps());
        }
        moves_on
    }

    /// Begins the turn of another method.
    fn move_to(&mut self, at: usize, end: AutoEnd) {
        if let Some(turn) = self.history.last_mut() {
            turn.end = Some(end);
        }
        self.begin(at, None);
        self.at = at;
    }

    fn begin(&mut self, at: usize, end: Option<AutoEnd>) {
        let choice = self.candidates[at].choice;
        self.stepped = false;
        self.history.push(AutoTurn { choice, sweeps: 0, residual: self.smallest(), end });
    }

    /// Judges the progress from here on alone, after so many sweeps of the solve.
    fn count_from(&mut self, sweeps: usize) {
        (self.begun, self.middle) = ((sweeps, self.best), None);
    }

    fn sweeps(&self) -> usize {
        self.work().map_or(0, |work| work.sweeps)
    }

    /// The work after which to give up from here, and the residual that is worth a new respite.
    fn respite(&self) -> (usize, f64) {
        (LAST * (self.sweeps() + LEAST), 0.5 * self.smallest())
    }

    /// Returns whether nothing is left to try.
    fn is_over(&self) -> bool {
        self.last.is_some_and(|(last, _)| self.sweeps() > last)
    }

    /// The smallest residual of the solve.
    fn smallest(&self) -> f64 {
        self.others.map_or(self.best, |others| others.min(self.best))
    }

    /// Takes in a residual of the turn.
    fn see(&mut self, residual: f64) {
        self.best = self.best.min(residual);
        let sweeps = self.sweeps();
        if self.last.is_some_and(|(_, goal)| self.smallest() <= goal) {
            self.last = Some(self.respite());
        }
        let smallest = self.smallest();
        if let Some((turn, before)) = self.history.split_last_mut() {
            turn.residual = smallest;
            turn.sweeps = sweeps - before.iter().map(|turn| turn.sweeps).sum::<usize>();
        }
    }

    /// Takes in what an elimination costs, once it has been analysed and before the first of the
    /// solve; returns whether that is news.
    fn appraise(&mut self, at: usize) -> bool {
        let each = &mut self.candidates[at];
        let Some(Worker::Pivoting(pivoting)) = &each.worker else { return false };
        let shape = Shape { worth: pivoting.worth(), ..self.shape };
        let (promise, window) = each.choice.promise(shape);
        if each.iterations > 0 || window == each.window {
            return false;
        }
        (each.promise, each.window) = (promise, window);
        true
    }

    /// Keeps `x` if its residual is less than this part of that of the iterate that is kept.
    fn keep(&mut self, x: &[T], residual: f64, part: f64) {
        if residual < part * self.kept_residual {
            self.kept.copy_from_slice(x);
            self.kept_residual = residual;
        }
    }

    /// Puts the iterate of a method that has begun its turn aside, or drops it for the others' if
    /// there is none.
    fn leave(&mut self, at: usize, y: &[T]) {
        if let Some(others) = self.others.take() {
            let own = &mut self.candidates[at].own;
            own.0.clear();
            own.0.extend_from_slice(y);
            own.1 = self.best;
            self.best = others.min(self.best);
        }
    }

    /// The best prospect of the others.
    fn rival(&self) -> f64 {
        let others = self.candidates.iter().enumerate().filter(|&(at, _)| at != self.at);
        others.map(|(_, each)| each.prospect()).fold(0.0, f64::max)
    }

    /// Takes a smaller α where adaptive SOR has grown, which may do. Returns whether it is that.
    fn takes_back(&mut self) -> bool {
        let Some(Worker::Sor(sor)) = &mut self.candidates[self.at].worker else { return false };
        sor.take_back();
        true
    }

    /// Gives up the method at work for the rest of the solve, which so ends after as many as there
    /// are ways; returns whether another one goes on.
    fn retire(&mut self) -> bool {
        self.leave(self.at, &[]);
        self.candidates[self.at].give_up();
        self.count_from(self.sweeps());
        self.choose(AutoEnd::Slow)
    }

    /// Lets the method with the best prospect go on, of equal ones the one at work; returns whether
    /// that is another one.
    fn choose(&mut self, end: AutoEnd) -> bool {
        loop {
            let prospect = |at: usize| self.candidates[at].prospect();
            let better =
                |best: usize, at: usize| if prospect(at) > prospect(best) { at } else { best };
            let next = (0..self.candidates.len()).fold(self.at, better);
            if next == self.at {
                return false;
            }
            if self.set_up(next).is_ok() {
                if self.appraise(next) {
                    continue;
                }
                self.move_to(next, end);
                let Candidate { worker, own, .. } = &mut self.candidates[next];
                match worker {
                    Some(Worker::AmgNewton(newton)) if own.0.is_empty() => {
                        newton.take_up(self.cold)
                    }
                    Some(Worker::Newton(newton)) => newton.take_up(),
                    _ => {}
                }
                return true;
            }
            self.candidates[next].give_up();
            let turn = self.history.pop();
            self.begin(next, Some(AutoEnd::Refused));
            self.history.extend(turn);
        }
    }
}

impl<T: Scalar, A: Rows<T> + Clone, B: Rows<T> + Clone> Method<T> for Auto<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn turns(&self) -> &[AutoTurn] {
        &self.history
    }

    fn work(&self) -> Option<Work> {
        // Those that a solve before has set up have done nothing in this one.
        let used = self.candidates.iter().filter(|each| each.iterations > 0);
        Some(Work::sweeps(self.aside) + used.map(|each| each.work()).sum())
    }

    fn restart(&mut self) {
        for candidate in &mut self.candidates {
            let (mut worker, mut own) =
                (candidate.worker.take(), std::mem::take(&mut candidate.own.0));
            worker.iter_mut().for_each(|worker| worker.method().restart());
            own.clear();
            let fresh = Candidate::new(candidate.choice, self.shape);
            *candidate = Candidate { worker, own: (own, f64::INFINITY), ..fresh };
        }
        (self.at, self.aside) = (0, 0);
        let is_open = self.shape.is_plane() && self.problem.round() == [false; 2];
        self.has_sides = self.shape.is_alone && !is_open;
        (self.begun, self.middle, self.last) = ((0, f64::INFINITY), None, None);
        (self.best, self.kept_residual) = (f64::INFINITY, f64::INFINITY);
        self.others = None;
        self.history.clear();
        self.begin(self.at, None);
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn works_on_ranks(&self) -> bool {
        true
    }

    fn turn(&mut self, end: Status) -> bool {
        // Where nothing is left to try, the best iterate is to come to rest.
        if self.is_over() && end == Status::Stagnated {
            return false;
        }
        if !self.stepped {
            // It is the method before that has come to rest.
            return true;
        }
        if let Status::Diverged(_) = end {
            if !self.takes_back() {
                let at = self.at;
                self.candidates[at].judge(f64::NEG_INFINITY, self.shape);
                self.choose(AutoEnd::Growing);
                self.leave(at, &[]);
                self.count_from(self.sweeps());
            }
            return true;
        }
        if self.at_work().is_some_and(|worker| worker.turn(end)) {
            return true;
        }
        // Near the solution it is rounding, most likely; what else may help is tried, but not to
        // the limits.
        match &self.candidates[self.at].worker {
            Some(Worker::Pivoting(pivoting)) if pivoting.has_right_signs() => {
                self.last = Some((self.sweeps() + LAST * LEAST, 0.5 * self.smallest()));
            }
            Some(Worker::AmgNewton(_) | Worker::Newton(_))
                if self.last.is_none() && self.smallest() <= FRACTION * self.scale =>
            {
                self.last = Some(self.respite());
            }
            _ => {}
        }
        self.retire()
    }

    fn at_work(&mut self) -> Option<&mut dyn Method<T, A = A, B = B>> {
        self.candidates[self.at].worker.as_mut().map(Worker::method)
    }

    fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        // Elsewhere a step is worth little more than a look.
        let norms = match &mut self.candidates[self.at].worker {
            Some(Worker::AmgNewton(newton)) => newton.residual(q, x),
            Some(Worker::Pivoting(pivoting)) => pivoting.residual(q, x),
            _ => None,
        }?;
        self.see(norms.l2);
        Some(norms)
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        if self.is_over() {
            // An iterate that stays tells the solver.
            y.copy_from_slice(x);
            return measure(&self.problem, q, x, &mut self.kept, &mut self.scratch);
        }
        // The work that has led to x.
        let led = self.sweeps();
        if self.others.is_none() && !self.candidates[self.at].own.0.is_empty() {
            // This step leads to the method's own iterate.
            let norms = measure(&self.problem, q, x, y, &mut self.scratch);
            self.see(norms.l2);
            self.keep(x, norms.l2, 1.0);
            let own = &self.candidates[self.at].own;
            y.copy_from_slice(&own.0);
            self.others = Some(std::mem::replace(&mut self.best, own.1));
            self.begun.1 = self.best;
            return norms;
        }
        // It begins one from that of the others.
        let _ = self.others.get_or_insert(self.best);
        let is_line = self.has_sides && self.shape.is_line;
        let opened = if is_line { self.open_line(q, x, y, clock) } else { None };
        let window = self.candidates[self.at].window;
        let rival = self.rival();
        let norms = opened.unwrap_or_else(|| {
            let candidate = &mut self.candidates[self.at];
            candidate.iterations += 1;
            self.stepped = true;
            clock.granted = window.saturating_sub(led - self.begun.0);
            clock.least = rival;
            let worker = candidate.worker.as_mut().expect("it was set up as its turn came");
            worker.method().step(q, x, y, clock)
        });
        if clock.forgone.is_some() {
            if self.retire() {
                clock.resume();
            }
            // Columns that were chosen before may have led anywhere.
            if norms.l2.is_nan() || norms.l2 > self.kept_residual {
                y.copy_from_slice(&self.kept);
            }
            return norms;
        }
        let (residual, sweeps) = (norms.l2, self.sweeps());
        if self.history.len() == 1 && led == 0 {
            self.scale = residual.max(q.norms().l2);
            self.cold = residual > ROUGH * q.norms().l2;
            self.begun.1 = residual;
        }
        let is_fast = residual <= LEFT * self.best;
        self.keep(x, residual, GAIN);
        self.see(residual);
        if opened.is_some() {
            return norms;
        }
        // Columns that are chosen anew may lead anywhere at first, but not where the solver ends.
        let is_pivoted = self.uses() == AutoChoice::Pivoting;
        let bound = self.scale * if is_pivoted { pivoting::FAR } else { GROWN };
        let grown = residual.is_nan() || residual > bound;
        let spent = led - self.begun.0;
        if grown && spent < window && self.takes_back() {
            y.copy_from_slice(&self.kept);
            return norms;
        }
        let is_first = self.history.len() == 1;
        if is_first && !is_fast && !grown && !clock.is_up() && self.takes_up_elimination(y) {
            return norms;
        }
        let ends = spent >= window || self.candidates[self.at].most() < rival;
        let rate = match self.middle {
            _ if grown => f64::NEG_INFINITY,
            _ if ends => {
                let (middle, best) = self.middle.unwrap_or(self.begun);
                (best / self.best).ln() / (led - middle).max(1) as f64
            }
            None if self.candidates[self.at].is_new() && 2 * spent >= window => {
                self.middle = Some((led, self.best));
                return norms;
            }
            _ => return norms,
        };
        if clock.is_up() {
            return norms;
        }
        let at = self.at;
        self.candidates[at].judge(rate, self.shape);
        if self.has_sides && self.rival() > self.candidates[at].prospect() {
            self.has_sides = false;
            if self.solve_from_one_side(q, y, residual, clock.goal) {
                self.count_from(self.sweeps());
                return norms;
            }
        }
        let nears = rate > 0.0 && (self.best / clock.goal).ln() <= rate * window as f64;
        let end = if grown { AutoEnd::Growing } else { AutoEnd::Slow };
        let moved_on = !nears && self.choose(end);
        if moved_on || grown {
            self.leave(at, if grown { &[] } else { y });
        }
        self.count_from(if moved_on { sweeps } else { led });
        // The residual of y is not known, but that of x is.
        if grown || moved_on && residual > self.kept_residual {
            y.copy_from_slice(&self.kept);
        } else {
            self.keep(x, residual, 1.0);
        }
        norms
    }
}

#[cfg(test)]
mod tests;
