use std::time::Instant;

use hlcp_core::{Error, Norms, Rhs, Scalar, all_finite};

use crate::{
    Method, Outcome, Status,
    watch::{Alarm, Watch},
};

/// The norm a stopping test reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Norm {
    /// The 2-norm.
    L2,
    /// The largest absolute value.
    LInf,
}

impl Norm {
    /// This one of two norms.
    pub fn of(self, norms: Norms) -> f64 {
        match self {
            Self::L2 => norms.l2,
            Self::LInf => norms.linf,
        }
    }
}

/// When an iteration may stop.
///
/// It has converged when `‖A z − B r + q‖ ≤ max(absolute, relative·‖q‖)`.
///
/// The default is the paper's: 2-norm, absolute 10⁻¹⁰, 30,000 iterations. A precision too coarse for an
/// absolute 10⁻¹⁰ (`f32`) also accepts `4 ε ‖q‖`: an entry of the residual is a sum of some ten terms
/// of the size of `q`, each rounded to half an ε, so its floor is near `√10 ε/2`.
///
/// ```
/// use hlcp_methods::{Limits, Norm};
///
/// let limits = Limits { relative: 1e-8, norm: Norm::LInf, ..Limits::<f64>::default() };
/// assert_eq!((limits.absolute, limits.iterations), (1e-10, 30_000));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<T> {
    /// The residual that is good enough.
    pub absolute: T,
    /// The residual over ‖q‖ that is good enough.
    pub relative: T,
    /// The norm of both.
    pub norm: Norm,
    /// The largest number of iterations.
    pub iterations: usize,
}

impl<T: Scalar> Default for Limits<T> {
    fn default() -> Self {
        let from = |v| T::from(v).unwrap_or_else(T::epsilon);
        let coarse = T::epsilon() > from(1e-12);
        Self {
            absolute: from(1e-10),
            relative: if coarse { from(4.0) * T::epsilon() } else { T::zero() },
            norm: Norm::L2,
            iterations: 30_000,
        }
    }
}

impl<T: Scalar> Limits<T> {
    fn tolerance(&self, q: &Rhs<'_, T>) -> Result<f64, Error> {
        let [absolute, relative] =
            [("absolute tolerance", self.absolute), ("relative tolerance", self.relative)].map(
                |(name, value)| match value.to_f64() {
                    Some(value) if value >= 0.0 && value.is_finite() => Ok(value),
                    value => Err(Error::Parameter {
                        name,
                        value: value.unwrap_or(f64::NAN),
                        range: "finite and not negative",
                    }),
                },
            );
        Ok(absolute?.max(relative? * self.norm.of(q.norms())))
    }
}

/// Iterates a [`Method`] and owns the vectors it takes.
///
/// # Storage
///
/// Three vectors of length `n` beside the method's own, allocated by [`new`](Self::new), and `2n` numbers
/// of scratch by the first solve, none by later ones. A fourth vector only where the iterates are
/// suspected to repeat.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega};
/// use hlcp_methods::{Limits, Mms, Solver};
///
/// let a = FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let b = FivePoint::new(3, 1, [0.0, 0.0, 1.0, 0.0, 0.0])?;
/// let problem = Hlcp::new(a, b, Omega::Uniform(4.0))?;
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
        }
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
        let n = self.method.problem().order();
        for (what, found) in [("q", q.len()), ("x0", x0.len())] {
            if found != n {
                return Err(Error::Order { what, found, expected: n });
            }
        }
        let q = Rhs::new(q)?;
        all_finite("x0", x0)?;
        let tolerance = limits.tolerance(&q)?;
        let start = Instant::now();
        if q.norms().linf == 0.0 {
            self.x.fill(T::zero());
        } else {
            self.x.copy_from_slice(x0);
        }
        let (status, iterations, answer) = self.iterate(&q, tolerance, limits);
        Ok(Outcome {
            status,
            iterations,
            answer,
            sweeps: iterations * self.method.steps(),
            residual: self.recover(&q),
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// Iterates until `limits` or the iterates say stop, and leaves the answer in `x`.
    fn iterate(
        &mut self,
        q: &Rhs<'_, T>,
        tolerance: f64,
        limits: &Limits<T>,
    ) -> (Status, usize, usize) {
        let within = |norms| {
            let residual = limits.norm.of(norms);
            residual.is_finite() && residual <= tolerance
        };
        self.watch.begin(limits.norm.of(q.norms()));
        for k in 0.. {
            let norms = self.method.step(0, q, &self.x, &mut self.z);
            let residual = limits.norm.of(norms);
            let mut best = self.watch.is_best(k, residual);
            if within(norms) {
                // The answer's own residual decides; the step's was its forerunner.
                if within(self.recover(q)) {
                    return (Status::Converged, k, k);
                }
                // The check used the vectors of the best iterate and of the next one.
                self.r.copy_from_slice(&self.x);
                let _ = self.method.step(0, q, &self.x, &mut self.z);
                best = true;
            }
            let status = match self.watch.alarm(k, residual, &self.x, &self.z) {
                Some(Alarm::Diverging) => Status::Diverged,
                Some(Alarm::Resting) => Status::Stagnated,
                Some(Alarm::Repeating { period }) => Status::Cycling { period },
                None if k == limits.iterations => Status::IterationLimit,
                None => {
                    self.advance(q, best);
                    continue;
                }
            };
            if !best {
                std::mem::swap(&mut self.x, &mut self.r);
            }
            return (status, k, self.watch.best_at());
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

    /// Recovers `z` and `r` from `x`, and measures them.
    fn recover(&mut self, q: &Rhs<'_, T>) -> Norms {
        let problem = self.method.problem();
        problem.recover(&self.x, &mut self.z, &mut self.r);
        problem.residual(q, &self.z, &self.r, &mut self.scratch)
    }
}
