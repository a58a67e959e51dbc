use hlcp_core::{Aor, Error, Hlcp, Norms, Rhs, Rows, Scalar};

use crate::{AdaptiveSor, Clock, Cycle, Method, Mms, Multigrid, Newton, TridiagonalPart, Work};

/// The method for people who do not want to choose one.
///
/// * It begins, where `A` and `B` are tridiagonal, with [`Newton`] by direct inner solves, which falls back on Gauss–Seidel;
///   elsewhere with [`AdaptiveSor`], which finds α as it goes.
/// * If both operators are five-point ones on one grid and that is slow (24 steps of Newton's method were not enough, or 24
///   sweeps show that 200 more would not be), it goes on with [`Multigrid`], by F-cycles where there is but one row of points
///   and W-cycles elsewhere, which in their turn give way to sweeps where no coarse grid helps.
///
/// All of it works on one iterate: nothing is computed twice, and a choice that fails is left within the same solve.
///
/// # Cost
///
/// One walk over the rows of `A` and `B` to begin with, then that of the method at work; the storage of Newton's method and of
/// multigrid where they may be called.
///
/// # Convergence
///
/// That of the method at work.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
/// use hlcp_methods::{Auto, Limits, Options, Solver};
///
/// let a = FivePoint::new(100, 100, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, Identity { order: 10_000 }, Omega::Uniform(4.0))?;
/// let q: Vec<f64> = (0..10_000).map(|k| if k % 100 < 60 { -1e-3 } else { 2e-3 }).collect();
///
/// let mut solver = Solver::new(Auto::new(problem)?);
/// let outcome = solver.solve(&q, Options::from_x(&vec![1.0; 10_000]))?;
/// assert!(outcome.converged() && solver.method().uses() == "multigrid");
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Auto<T: Scalar, A, B> {
    first: First<T, A, B>,
    multigrid: Option<Box<Multigrid<T, A, B>>>,
    // Steps of the first method so far, and the residuals after the twelfth and the twenty-fourth.
    taken: usize,
    seen: [f64; 2],
}

/// What it begins with.
#[derive(Debug, Clone)]
enum First<T: Scalar, A, B> {
    Newton(Box<Direct<T, A, B>>),
    Sor(AdaptiveSor<T, A, B>),
}

/// Newton's method with elimination in tridiagonal operators, on Gauss–Seidel, which runs away least.
type Direct<T, A, B> = Newton<T, Mms<T, A, B, Aor<T>>, TridiagonalPart<T>>;

/// The steps that the first method is watched for, SOR from the middle on.
const WATCHED: usize = 24;
/// The least that a sweep is to take off the logarithm of the residual: ten digits in 230 sweeps.
const SLOW: f64 = 0.1;

impl<T: Scalar, A: Rows<T> + Clone, B: Rows<T> + Clone> Auto<T, A, B> {
    /// The method on `problem`; operators are cloned, so give large ones by reference.
    ///
    /// # Errors
    ///
    /// What the [`Aor`](hlcp_core::Aor)'s [`check`](hlcp_core::Step::check) refuses.
    pub fn new(problem: Hlcp<T, A, B>) -> Result<Self, Error> {
        let (first, cycle) = if TridiagonalPart::is_all(&problem) {
            let base = Mms::new(problem.clone(), Aor::gauss_seidel())?;
            (First::Newton(Box::new(Newton::new(base, TridiagonalPart::new()))), Cycle::F)
        } else {
            (First::Sor(AdaptiveSor::new(problem.clone())?), Cycle::W)
        };
        let multigrid = Multigrid::new(problem, cycle).ok().map(Box::new);
        Ok(Self { first, multigrid, taken: 0, seen: [f64::NAN; 2] })
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Auto<T, A, B> {
    /// What is at work: `"newton"`, `"multigrid"`, `"amsor"` or `"msor"`.
    pub fn uses(&self) -> &'static str {
        match &self.first {
            _ if self.multigrid.is_some() && self.is_slow() => "multigrid",
            First::Newton(_) => "newton",
            First::Sor(sor) if sor.is_accelerated() => "amsor",
            First::Sor(_) => "msor",
        }
    }

    /// Whether the first method has been watched long enough and found wanting.
    fn is_slow(&self) -> bool {
        let rate = (self.seen[0] / self.seen[1]).ln() / (WATCHED / 2) as f64;
        let wanting = match &self.first {
            First::Newton(_) => true,
            First::Sor(_) => rate.is_nan() || rate < SLOW,
        };
        self.taken > WATCHED && wanting
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Method<T> for Auto<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        match &self.first {
            First::Newton(newton) => newton.problem(),
            First::Sor(sor) => sor.problem(),
        }
    }

    fn work(&self) -> Option<Work> {
        let first = match &self.first {
            First::Newton(newton) => newton.work(),
            First::Sor(_) => Some(Work::sweeps(self.taken)),
        };
        let multigrid = self.multigrid.as_ref().and_then(|multigrid| multigrid.work());
        Some(first.unwrap_or_default() + multigrid.unwrap_or_default())
    }

    fn restart(&mut self) {
        match &mut self.first {
            First::Newton(newton) => newton.restart(),
            First::Sor(sor) => sor.restart(),
        }
        if let Some(multigrid) = &mut self.multigrid {
            multigrid.restart();
        }
        (self.taken, self.seen) = (0, [f64::NAN; 2]);
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        let slow = self.is_slow();
        if let Some(multigrid) = self.multigrid.as_mut().filter(|_| slow) {
            return multigrid.step(q, x, y, clock);
        }
        let norms = match &mut self.first {
            First::Newton(newton) => newton.step(q, x, y, clock),
            First::Sor(sor) => sor.step(q, x, y, clock),
        };
        // The residual is that of the iterate before this step.
        if self.taken == WATCHED / 2 || self.taken == WATCHED {
            self.seen[self.taken / WATCHED] = norms.l2;
        }
        self.taken += 1;
        norms
    }
}
