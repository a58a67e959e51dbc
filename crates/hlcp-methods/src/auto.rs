use hlcp_core::{Aor, Error, Hlcp, Norms, Rhs, Rows, Scalar};

use crate::{AdaptiveSor, Cycle, Method, Mms, Multigrid, Newton, TridiagonalPart};

/// The method for people who do not want to choose one.
///
/// * Where `A` and `B` are tridiagonal: [`Newton`] with a direct inner solve, which falls back on Gauss–Seidel.
/// * Otherwise [`AdaptiveSor`], which finds α as it goes; and if both operators are five-point ones on one grid and the first 24
///   sweeps show that 200 more would not do, W-cycles of [`Multigrid`], which in their turn give way to sweeps
///   where no coarse grid helps.
///
/// All of it works on one iterate: nothing is computed twice, and a choice that fails is left within the same solve.
///
/// # Cost
///
/// One walk over the rows of `A` and `B` to begin with, then that of the method at work; the storage of Newton's method or of
/// multigrid where they may be called.
///
/// # Convergence
///
/// That of the method at work.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
/// use hlcp_methods::{Auto, Limits, Solver};
///
/// let a = FivePoint::new(100, 100, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, Identity { order: 10_000 }, Omega::Uniform(4.0))?;
/// let q: Vec<f64> = (0..10_000).map(|k| if k % 100 < 60 { -1e-3 } else { 2e-3 }).collect();
///
/// let mut solver = Solver::new(Auto::new(problem)?);
/// let outcome = solver.solve(&q, &vec![1.0; 10_000], &Limits::default())?;
/// assert!(outcome.converged() && solver.method().uses() == "multigrid");
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Auto<T: Scalar, A, B> {
    sor: AdaptiveSor<T, A, B>,
    other: Option<Other<T, A, B>>,
    // Sweeps of SOR so far, and the residuals after the twelfth and the twenty-fourth.
    swept: usize,
    seen: [f64; 2],
}

/// What is there beside SOR.
#[derive(Debug, Clone)]
enum Other<T: Scalar, A, B> {
    Newton(Box<Direct<T, A, B>>),
    Multigrid(Box<Multigrid<T, A, B>>),
}

/// Newton's method with elimination in tridiagonal operators, on Gauss–Seidel, which runs away least.
type Direct<T, A, B> = Newton<T, Mms<T, A, B, Aor<T>>, TridiagonalPart<T>>;

/// The sweeps that SOR is watched for, from the middle on.
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
        let sor = AdaptiveSor::new(problem.clone())?;
        let other = if TridiagonalPart::is_all(&problem) {
            let base = Mms::new(problem, Aor::gauss_seidel())?;
            Some(Other::Newton(Box::new(Newton::new(base, TridiagonalPart::new()))))
        } else {
            let multigrid = Multigrid::new(problem, Cycle::W).ok();
            multigrid.map(|multigrid| Other::Multigrid(Box::new(multigrid)))
        };
        Ok(Self { sor, other, swept: 0, seen: [f64::NAN; 2] })
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Auto<T, A, B> {
    /// What is at work: `"newton"`, `"multigrid"`, or `"amsor"` or `"msor"` with the α of [`alpha`](Self::alpha).
    pub fn uses(&self) -> &'static str {
        match &self.other {
            Some(Other::Newton(_)) => "newton",
            Some(Other::Multigrid(_)) if self.is_slow() => "multigrid",
            _ if self.sor.is_accelerated() => "amsor",
            _ => "msor",
        }
    }

    /// The α in use where SOR is at work.
    pub fn alpha(&self) -> f64 {
        self.sor.alpha()
    }

    /// Whether SOR has been watched long enough and found wanting.
    fn is_slow(&self) -> bool {
        let rate = (self.seen[0] / self.seen[1]).ln() / (WATCHED / 2) as f64;
        self.swept > WATCHED && (rate.is_nan() || rate < SLOW)
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Method<T> for Auto<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        self.sor.problem()
    }

    fn sweeps(&self, iterations: usize) -> usize {
        match &self.other {
            Some(Other::Newton(newton)) => newton.sweeps(iterations),
            Some(Other::Multigrid(multigrid)) => {
                let swept = iterations.min(self.swept);
                swept + multigrid.sweeps(iterations - swept)
            }
            None => iterations,
        }
    }

    fn restart(&mut self) {
        self.sor.restart();
        (self.swept, self.seen) = (0, [f64::NAN; 2]);
        match &mut self.other {
            Some(Other::Newton(newton)) => newton.restart(),
            Some(Other::Multigrid(multigrid)) => multigrid.restart(),
            None => {}
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn linear_iterations(&self) -> Option<usize> {
        match &self.other {
            Some(Other::Newton(newton)) => newton.linear_iterations(),
            _ => None,
        }
    }

    fn step(&mut self, k: usize, q: &Rhs<'_, T>, x: &[T], y: &mut [T]) -> Norms {
        let slow = self.is_slow();
        match &mut self.other {
            Some(Other::Newton(newton)) => newton.step(k, q, x, y),
            Some(Other::Multigrid(multigrid)) if slow => multigrid.step(k, q, x, y),
            _ => {
                let norms = self.sor.step(k, q, x, y);
                // The residual is that of the iterate before this sweep.
                if self.swept == WATCHED / 2 || self.swept == WATCHED {
                    self.seen[self.swept / WATCHED] = norms.l2;
                }
                self.swept += 1;
                norms
            }
        }
    }
}
