//! The methods that take turns, and their prospects.

use hlcp_core::{Aor, Error, Hlcp, Rows, Scalar};

use super::AutoChoice;
use crate::{
    AdaptiveSor, AmgNewton, Anderson, Cycle, Method, Multigrid, Newton, Pivoting, Tmms,
    TridiagonalPart, Work,
    pivoting::{entries, least_worth},
};

/// The fused sweeps in the time of which others take what counts as one: of adaptive SOR on a
/// plane, and of that and multigrid where coefficients are constant.
const FUSED: [f64; 2] = [4.0, 12.0];

/// The points of a plane from which multigrid precedes algebraic multigrid, if one of `A` and `B`
/// is diagonal, and how many times its progress counts there: swirls take 0.55 of the time, jumps
/// and graded meshes 1.1; with fewer points all take 1.08.
const MANY: usize = 4000;
const CYCLES: f64 = 1.5;

/// The facts of a problem that are known beforehand.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// True if one process has all of it.
    pub(super) is_alone: bool,
    /// True if the operators are tridiagonal.
    pub(super) is_line: bool,
    /// True if there is a grid.
    pub(super) has_grid: bool,
    /// The sweeps that an elimination is worth at least; `usize::MAX` if there is none.
    pub(super) worth: usize,
    /// True if all coefficients of a grid are constant.
    pub(super) is_constant: bool,
    /// True if multigrid precedes algebraic multigrid.
    pub(super) cycles_first: bool,
    /// True if entries beside the diagonal are positive.
    pub(super) is_mixed: bool,
}

impl Shape {
    /// Gathers those of a problem.
    pub(super) fn of<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Self {
        let is_alone = problem.strip().is_none();
        let is_line = !problem.any(!TridiagonalPart::is_all(problem));
        let grid = problem.grid();
        let (has_grid, points) = (grid.is_ok(), grid.map_or(0, |[nx, ny]| nx * ny));
        let entries = [entries(problem.a()), entries(problem.b())];
        let couples = problem.largest(entries.map(|count| f64::from(count > problem.order())));
        let is_constant = [problem.a().as_five_point(), problem.b().as_five_point()]
            .iter()
            .all(|view| view.as_ref().is_some_and(|view| view.constants().is_some()));
        Self {
            is_alone,
            is_line,
            has_grid,
            worth: if is_alone { least_worth(problem) } else { usize::MAX },
            is_constant: !problem.any(!is_constant),
            cycles_first: !is_line && points >= MANY && couples.contains(&0.0),
            is_mixed: (is_line || !has_grid) && is_mixed(problem),
        }
    }

    /// True for a grid of more than one line.
    pub(super) fn is_plane(self) -> bool {
        self.has_grid && !self.is_line
    }

    /// The methods that may take turns, and the first of them first.
    pub(super) fn choices(self) -> impl Iterator<Item = AutoChoice> {
        use AutoChoice::{AmgNewton, Anderson, Multigrid, Newton, Pivoting, Sor};
        let order: &[AutoChoice] = match (self.is_line, self.has_grid) {
            // Elimination is exact, and cycles find long fronts.
            (true, _) => &[Newton, Multigrid, Sor, AmgNewton, Anderson, Pivoting],
            (_, true) => &[Sor, Multigrid, AmgNewton, Anderson, Pivoting],
            // Where rows are walked one by one, to mix some vectors costs little beside a sweep.
            _ => &[Anderson, AmgNewton, Sor, Pivoting],
        };
        order.iter().copied().filter(move |choice| match choice {
            Multigrid => self.has_grid,
            Pivoting => self.worth < usize::MAX,
            AmgNewton | Newton => self.is_alone,
            Sor | Anderson => true,
        })
    }
}

/// The part of the negative entries beside a diagonal that positive ones may be where rows conduct.
/// Meshes have up to a third for obtuse angles, the square of a Laplacian on a plane has 0.375.
const MIXED: f64 = 0.35;

/// Returns whether the positive entries beside the diagonal of `A`, or of `B`, are more than that
/// part of the negative ones, in the mean of the rows that have any.
fn is_mixed<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> bool {
    fn of<T: Scalar>(operator: &impl Rows<T>) -> bool {
        let mut parts = [0.0; 2];
        for i in 0..operator.order() {
            let mut sums = [0.0; 2];
            operator.visit_row(i, &mut |j, a| {
                if j != i {
                    sums[usize::from(a > T::zero())] += a.abs().wide();
                }
            });
            let all = (sums[0] + sums[1]).max(f64::MIN_POSITIVE);
            parts.iter_mut().zip(sums).for_each(|(part, sum)| *part += sum / all);
        }
        parts[1] > MIXED * parts[0]
    }
    of(problem.a()) || of(problem.b())
}

impl AutoChoice {
    /// The promise, per sweep, and the length of the first window, in sweeps.
    ///
    /// SOR at multigrid's promise takes ten digits in 230 sweeps, or 900 fused ones; algebraic
    /// multigrid takes 80 to 390 sweeps' worth of work for them on eight tenths of 260 problems
    /// drawn at random, 165 in the median.
    pub(super) fn promise(self, shape: Shape) -> (f64, usize) {
        let Shape { is_line, is_constant, worth, is_mixed, .. } = shape;
        let is_plane = shape.is_plane();
        match self {
            Self::Sor if is_plane => (0.16, 16),
            Self::Sor => (0.02, 24),
            Self::Multigrid if is_plane && is_constant => (1.2, 24),
            Self::Multigrid if shape.cycles_first => (0.13, 24),
            Self::Multigrid => (0.1, 24),
            // Aggregates are for matrices that conduct; elimination is tried before, if it is
            // cheap.
            Self::AmgNewton if is_mixed => (0.0025, 1000),
            Self::AmgNewton if is_line => (0.04, 1000),
            Self::AmgNewton => (if is_plane { 0.12 } else { 0.075 }, 1000),
            // On the way from the start a step may settle a few signs alone, by an elimination.
            // Strings of springs take 30 to 90; puts and obstacles of thousands of points, which
            // others solve faster, take 1.2 times the time for 80 that they take for 50.
            Self::Newton => (0.01, 400),
            Self::Anderson => (0.02, 24),
            // Ten digits in twenty eliminations, as a rule; but a front may take eighty.
            Self::Pivoting => (1.15 / worth as f64, 84 * worth),
        }
    }
}

/// A method with its prospects.
#[derive(Debug, Clone)]
pub(super) struct Candidate<T: Scalar, A, B> {
    pub(super) choice: AutoChoice,
    pub(super) worker: Option<Worker<T, A, B>>,
    /// The iterations of the worker since the restart.
    pub(super) iterations: usize,
    pub(super) promise: f64,
    pub(super) window: usize,
    /// The last progress.
    pub(super) rate: f64,
    /// An iterate that it alone works on, and the smallest residual there, once there is one.
    pub(super) own: (Vec<T>, f64),
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Candidate<T, A, B> {
    /// A method that has not had a turn.
    pub(super) fn new(choice: AutoChoice, shape: Shape) -> Self {
        let (promise, window) = choice.promise(shape);
        let (rate, own) = (f64::NEG_INFINITY, (vec![], f64::INFINITY));
        Self { choice, worker: None, iterations: 0, promise, window, rate, own }
    }

    /// The work of the worker since the restart.
    pub(super) fn work(&self) -> Work {
        let counted = match &self.worker {
            Some(Worker::Multigrid(multigrid)) => multigrid.work(),
            Some(Worker::AmgNewton(newton)) => newton.work(),
            Some(Worker::Newton(newton)) => newton.work(),
            Some(Worker::Pivoting(pivoting)) => pivoting.work(),
            Some(Worker::Anderson(anderson)) => anderson.work(),
            Some(Worker::Sor(_)) | None => None,
        };
        counted.unwrap_or(Work::sweeps(self.iterations))
    }

    /// The last progress, or the promise if that is more.
    pub(super) fn prospect(&self) -> f64 {
        self.rate.max(self.promise)
    }

    /// Returns whether no window has shown progress yet.
    pub(super) fn is_new(&self) -> bool {
        self.rate == f64::NEG_INFINITY
    }

    /// The most progress that a sweep can make, as far as linear systems have shown it.
    pub(super) fn most(&self) -> f64 {
        match &self.worker {
            Some(Worker::AmgNewton(newton)) => newton.rate(),
            _ => f64::INFINITY,
        }
    }

    /// Takes it out of the solve.
    pub(super) fn give_up(&mut self) {
        (self.promise, self.rate) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    }

    /// Takes in what a window has shown.
    pub(super) fn judge(&mut self, rate: f64, shape: Shape) {
        let fused = match self.choice {
            AutoChoice::Sor if shape.is_plane() => FUSED[usize::from(shape.is_constant)],
            AutoChoice::Multigrid if shape.is_plane() && shape.is_constant => FUSED[1],
            AutoChoice::Multigrid if shape.cycles_first => CYCLES,
            _ => 1.0,
        };
        // A window that ends early may hold little but another method's last step.
        self.rate = (fused * rate).min(self.most());
        // Promise times window stays the same, as AUTO's guarantee needs.
        self.promise /= 2.0;
        self.window = self.window.saturating_mul(2);
    }
}

/// The base of Newton's methods and of Anderson's: accelerated Gauss–Seidel, forward
/// and backward, which converges on films too.
type Base<T, A, B> = Tmms<T, A, B, Aor<T>, Aor<T>>;

/// Newton's method by elimination, on lines.
type PlainNewton<T, A, B> = Newton<T, Base<T, A, B>, TridiagonalPart<T>>;

#[derive(Debug, Clone)]
pub(super) enum Worker<T: Scalar, A, B> {
    Sor(AdaptiveSor<T, A, B>),
    Multigrid(Box<Multigrid<T, A, B>>),
    AmgNewton(Box<AmgNewton<T, Base<T, A, B>>>),
    Newton(Box<PlainNewton<T, A, B>>),
    Anderson(Box<Anderson<T, Base<T, A, B>>>),
    Pivoting(Box<Pivoting<T, A, B>>),
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Worker<T, A, B> {
    pub(super) fn new(choice: AutoChoice, problem: Hlcp<T, A, B>) -> Result<Self, Error> {
        let base = |problem| Tmms::mirrored(problem, Aor::gauss_seidel().accelerated());
        Ok(match choice {
            AutoChoice::Sor => Self::Sor(AdaptiveSor::new(problem)?),
            AutoChoice::Multigrid => {
                let multigrid = Multigrid::new(problem, Cycle::F)?;
                if multigrid.grids().nth(1).is_none() {
                    return Err(Error::NotFivePoint { what: "a coarser grid" });
                }
                Self::Multigrid(Box::new(multigrid))
            }
            AutoChoice::AmgNewton => Self::AmgNewton(Box::new(AmgNewton::new(base(problem)?)?)),
            AutoChoice::Newton => {
                Self::Newton(Box::new(Newton::new(base(problem)?, TridiagonalPart::new())))
            }
            AutoChoice::Anderson => Self::Anderson(Box::new(Anderson::new(base(problem)?, 10)?)),
            AutoChoice::Pivoting => Self::Pivoting(Box::new(Pivoting::new(problem)?)),
        })
    }

    pub(super) fn method(&mut self) -> &mut dyn Method<T, A = A, B = B> {
        match self {
            Self::Sor(sor) => sor,
            Self::Multigrid(multigrid) => multigrid,
            Self::AmgNewton(newton) => newton,
            Self::Newton(newton) => newton,
            Self::Anderson(anderson) => anderson,
            Self::Pivoting(pivoting) => pivoting,
        }
    }
}
