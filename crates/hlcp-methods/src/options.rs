use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use hlcp_core::Norms;

use crate::{Forecast, Limits, limits::Cost};

/// How a [`Solver`](crate::Solver) sets out, when it stops and who watches.
///
/// The default starts from `x = 0`, that is `z = r = 0`, within the default [`Limits`].
///
/// ```
/// use std::ops::ControlFlow;
/// use hlcp_methods::{Aor, FivePoint, Hlcp, Limits, Mms, Options, Solver, Status};
///
/// let problem = Hlcp::lcp(FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
/// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
/// let q = [-2.0, 5.0, -6.0];
/// let outcome = solver.solve(&q, Options::default())?;
/// // The next of a sequence of problems that change little, from the last answer.
/// assert!(solver.solve(&[-2.0, 5.0, -6.1], Options::resume())?.iterations < outcome.iterations);
///
/// // From a known z and r, within other limits, watched by a closure that may stop the solve.
/// let options = Options::from_solution(&[0.5, 0.0, 1.0], &[0.0, 1.0, 0.0])
///     .limits(Limits::relative(1e-12))
///     .observer(|progress| match progress.x[0] {
///         0.2.. => ControlFlow::Break(()),
///         _ => ControlFlow::Continue(()),
///     });
/// assert_eq!(solver.solve(&q, options)?.status, Status::Stopped);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug)]
pub struct Options<'o, T> {
    pub(crate) start: Start<'o, T>,
    pub(crate) limits: Limits,
    pub(crate) observer: Option<Watched<'o, T>>,
}

/// The iterate that a solve begins with.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Start<'o, T> {
    Zero,
    Last,
    X(&'o [T]),
    Solution([&'o [T]; 2]),
}

/// A closure that sees every iterate and may stop the solve.
pub(crate) type Observer<'o, T> = dyn FnMut(&Progress<'_, T>) -> ControlFlow<()> + 'o;

/// An observer that can be printed as part of [`Options`].
pub(crate) struct Watched<'o, T>(pub(crate) Box<Observer<'o, T>>);

impl<T> std::fmt::Debug for Watched<'_, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("observer")
    }
}

impl<T> Default for Options<'_, T> {
    fn default() -> Self {
        Self { start: Start::Zero, limits: Limits::default(), observer: None }
    }
}

impl<T> From<Limits> for Options<'_, T> {
    fn from(limits: Limits) -> Self {
        Self::default().limits(limits)
    }
}

impl<'o, T> Options<'o, T> {
    /// Starts from the [`x`](crate::Solver::x) of the last solve, or from 0 if there was none.
    pub fn resume() -> Self {
        Self { start: Start::Last, ..Self::default() }
    }

    /// Starts from the modulus variable `x`, of the problem's order.
    pub fn from_x(x: &'o [T]) -> Self {
        Self { start: Start::X(x), ..Self::default() }
    }

    /// Starts from `z` and `r`, each of the problem's order: a solution of a similar problem.
    pub fn from_solution(z: &'o [T], r: &'o [T]) -> Self {
        Self { start: Start::Solution([z, r]), ..Self::default() }
    }

    /// Replaces the limits.
    pub fn limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// Shows every iterate to `observer`, which may stop the solve.
    ///
    /// Within a long step (an inner solve, nested iteration) the observer sees the iterate that the
    /// step sets out from again and again, about fifty times per second. An iterate that meets the
    /// tolerance has converged even where the observer says stop.
    ///
    /// Where ranks share the problem, each may have an observer of its own, which sees the rank's
    /// part of the iterate; one that says stop stops all.
    pub fn observer(self, observer: impl FnMut(&Progress<'_, T>) -> ControlFlow<()> + 'o) -> Self {
        Self { observer: Some(Watched(Box::new(observer))), ..self }
    }
}

/// The state of a running solve, as an observer sees it.
///
/// ```
/// use std::ops::ControlFlow;
/// use hlcp_methods::{Aor, Hlcp, Identity, Mms, Omega, Options, Progress, Solver};
///
/// let problem = Hlcp::new(Identity { order: 1 }, Identity { order: 1 }, Omega::Uniform(1.0))?;
/// let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel())?);
/// let mut seen = vec![];
/// let options = Options::default().observer(|progress: &Progress<'_, f64>| {
///     seen.push((progress.iteration, progress.x[0], progress.residual.linf));
///     ControlFlow::Continue(())
/// });
/// assert!(solver.solve(&[-3.0], options)?.converged());
/// assert_eq!(seen, [(0, 0.0, 3.0), (1, 1.5, 0.0)]);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Progress<'s, T> {
    /// The number of iterations that led to the iterate; 0 for the start.
    pub iteration: usize,
    /// The norms of `A z − B r + q` at the iterate, as the next step measured them; NaN within
    /// a long step that has not handed them on.
    pub residual: Norms,
    /// The time since the solve began.
    pub elapsed: Duration,
    /// The iterate.
    pub x: &'s [T],
}

/// Asked by a [`Method`](crate::Method) in the course of a long step whether to go on.
///
/// ```
/// use hlcp_methods::Clock;
///
/// let mut asked = 0;
/// let mut is_up = || {
///     asked += 1;
///     asked > 2
/// };
/// let mut clock = Clock::new(&mut is_up);
/// assert_eq!([(); 4].map(|()| clock.is_up()), [false, false, true, true]);
/// assert!(!Clock::endless().is_up());
/// ```
pub struct Clock<'c> {
    ask: Option<&'c mut dyn FnMut() -> bool>,
    up: bool,
    /// The residual at which the solve ends, where it is known: less is of no use.
    pub(crate) goal: f64,
    /// The work that the step may take, in sweeps, as far as its inner solves can keep to it.
    pub(crate) granted: usize,
    /// What a sweep must take off the logarithm of an inner residual for the step to be worth it.
    pub(crate) least: f64,
    /// When the time of the solve is over, where that is limited.
    pub(crate) until: Option<Instant>,
    /// What the step did not begin, as it would take longer than that.
    pub(crate) forgone: Option<Forecast>,
}

impl<'c> Clock<'c> {
    /// A clock that is up as soon as `ask` returns true.
    pub fn new(ask: &'c mut dyn FnMut() -> bool) -> Self {
        Self { ask: Some(ask), ..Self::endless() }
    }

    /// A clock that is never up.
    pub fn endless() -> Self {
        let (goal, granted, least) = (0.0, usize::MAX, 0.0);
        Self { ask: None, up: false, goal, granted, least, until: None, forgone: None }
    }

    /// The iterations that an inner solve may take, of which one is worth `worth` sweeps: what the
    /// step was granted, but `most` at most, and a tenth of that at least.
    pub(crate) fn iterations(&self, worth: usize, most: usize) -> usize {
        (self.granted / worth).clamp(most / 10, most)
    }

    /// Returns whether an elimination of such a cost would end in time; if not, the clock is up,
    /// and the outcome says so.
    pub(crate) fn has_time_for(&mut self, cost: Cost) -> bool {
        let left = self.until.map(|until| until.saturating_duration_since(Instant::now()));
        let late = left.filter(|left| cost.seconds > left.as_secs_f64());
        self.forgone = late.map(|left| Forecast { seconds: cost.seconds, bytes: cost.bytes, left });
        self.up |= self.forgone.is_some();
        self.forgone.is_none()
    }

    /// Goes on in another way than the one that was forgone.
    pub(crate) fn resume(&mut self) {
        self.up = false;
    }

    /// Returns whether the step should end as soon as it can; once true, always true.
    ///
    /// To be asked about once per sweep: it may take the time and call an observer.
    pub fn is_up(&mut self) -> bool {
        if !self.up {
            self.up = self.ask.as_mut().is_some_and(|ask| ask());
        }
        self.up
    }

    /// As [`is_up`](Self::is_up) of a loop that asks at each row, which at most one in 16,384 does.
    ///
    /// ```
    /// use hlcp_methods::Clock;
    ///
    /// let mut asked = 0;
    /// let mut is_up = || {
    ///     asked += 1;
    ///     asked > 2
    /// };
    /// let mut clock = Clock::new(&mut is_up);
    /// assert_eq!((0..1_000_000).position(|row| clock.is_up_at(row)), Some(3 * 16_384 - 1));
    /// ```
    #[inline]
    pub fn is_up_at(&mut self, row: usize) -> bool {
        if row % STRETCH == STRETCH - 1 { self.is_up() } else { self.up }
    }

    /// As [`is_up`](Self::is_up) before a walk over so many rows; few of them are walked over
    /// without asking.
    pub(crate) fn is_up_before(&mut self, rows: usize) -> bool {
        rows >= STRETCH && self.is_up()
    }
}

/// The rows that a loop walks over between two looks at the clock.
pub(crate) const STRETCH: usize = 1 << 14;

impl std::fmt::Debug for Clock<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Clock").field("up", &self.up).finish_non_exhaustive()
    }
}
