//! Newton's method on the active set with algebraic multigrid inside.

use hlcp_core::{Error, Hlcp, Norms, Rhs, Rows, Scalar};

use super::{Amg, nested};
use crate::{Jacobian, Method, krylov::to_scalar, method::iterate};

/// A residual of at most this part of the smallest one of the phase is progress.
const PROGRESS: f64 = 0.9;

/// Steps without progress that end a phase.
const PATIENCE: usize = 6;

/// The most iterations of one inner solve.
const INNER: usize = 300;

/// The inner tolerance while signs change, and once they do not.
const FORCING: [f64; 2] = [1e-2, 1e-5];

/// Pairs of sweeps before a step where the last one did not halve the defect.
const SWEEPS: usize = 4;

/// Steps of Newton's method on the active set, each of which sweeps first and stops at the edge of its piece.
#[derive(Debug, Clone)]
pub(super) struct Steps<T> {
    pub(super) amg: Amg<T>,
    f: Vec<T>,
    s: Vec<T>,
    scratch: Vec<T>,
    /// The smallest defect that a step set out from, and whether the last step halved it.
    best: f64,
    halved: bool,
    /// Whether the last step changed signs.
    pub(super) flips: usize,
    pub(super) linear_iterations: usize,
    pub(super) sweeps: usize,
    /// The work of the start on coarser problems, in sweeps.
    pub(super) nested: f64,
}

impl<T: Scalar> Steps<T> {
    pub(super) fn new<A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Result<Self, Error> {
        let n = problem.order();
        Ok(Self {
            amg: Amg::new(problem)?,
            f: vec![T::zero(); n],
            s: vec![T::zero(); n],
            scratch: vec![T::zero(); 2 * n],
            best: f64::INFINITY,
            halved: true,
            flips: n,
            linear_iterations: 0,
            sweeps: 0,
            nested: 0.0,
        })
    }

    pub(super) fn restart(&mut self) {
        (self.best, self.halved, self.flips) = (f64::INFINITY, true, self.f.len());
    }

    /// The norms of F at `x`.
    pub(super) fn measure<A: Rows<T>, B: Rows<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        q: &[T],
        x: &[T],
    ) -> Norms {
        self.sweeps += 1;
        problem.defect(q, x, &mut self.f, &mut self.scratch);
        Norms::of(&self.f)
    }

    /// Takes a step from `x`; whether the linear system could be solved to some extent.
    pub(super) fn step<A: Rows<T>, B: Rows<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        q: &[T],
        x: &mut [T],
    ) -> bool {
        let pairs = if self.halved { 1 } else { SWEEPS };
        for _ in 0..pairs {
            (0..x.len()).for_each(|i| relax(problem, q, x, i));
            (0..x.len()).rev().for_each(|i| relax(problem, q, x, i));
        }
        self.sweeps += 2 * pairs;
        let size = self.measure(problem, q, x).l2;
        self.halved = size <= 0.5 * self.best;
        self.best = self.best.min(size);
        let forcing = if self.flips == 0 { FORCING[1] } else { FORCING[0] * self.best / size };
        let forcing = forcing.max(T::epsilon().to_f64().unwrap_or(0.0));
        let jacobian = Jacobian::new(problem, x);
        let inner = self.amg.solve_to(&jacobian, &self.f, &mut self.s, (forcing, INNER));
        self.linear_iterations += inner.iterations;
        self.flips = 0;
        let mut finite = true;
        for (x, &s) in x.iter_mut().zip(&self.s) {
            let next = *x - s;
            finite &= next.is_finite();
            // An unknown that changes its sign stops at the edge: how far it goes beyond is another piece's to say.
            if (*x >= T::zero()) == (next >= T::zero()) {
                *x = next;
            } else {
                *x = T::zero();
                self.flips += 1;
            }
        }
        if std::env::var("AMG_TRACE").is_ok() {
            eprintln!(
                "  n {} f {size:.3e} forcing {forcing:.1e} inner {} res {:.1e} flips {} levels {:?} oc {:.2}",
                x.len(), inner.iterations, inner.residual, self.flips, self.amg.orders(), self.amg.complexity().unwrap_or(0.0)
            );
        }
        inner.residual < 1.0 && finite
    }
}

/// Solves the scalar equation of row `i` exactly.
fn relax<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>, q: &[T], x: &mut [T], i: usize) {
    let (mut t, mut pivots) = (problem.q_factor() * q[i], [T::zero(); 2]);
    problem.a().visit_row(i, &mut |j, a| {
        if j == i {
            pivots[0] = a + a;
        } else {
            t += a * (x[j].abs() + x[j]);
        }
    });
    problem.b().visit_row(i, &mut |j, b| {
        let b = problem.omega().at(j) * b;
        if j == i {
            pivots[1] = b + b;
        } else {
            t -= b * (x[j].abs() - x[j]);
        }
    });
    x[i] = -t / if t <= T::zero() { pivots[0] } else { pivots[1] };
}

#[derive(Debug, Clone)]
pub struct AmgNewton<T, M> {
    base: M,
    steps: Steps<T>,
    best: Vec<T>,
    between: Vec<T>,
    base_iterations: usize,
    looks: usize,
    phase: Option<Phase>,
    resting: usize,
    rest: usize,
    begun: bool,
    pub nests: bool,
}

#[derive(Debug, Clone, Copy)]
struct Phase {
    best: f64,
    quiet: usize,
    /// The fewest signs that a step of the phase changed.
    fewest: usize,
}

impl<T: Scalar, M: Method<T>> AmgNewton<T, M>
where
    M::A: Rows<T>,
    M::B: Rows<T>,
{
    /// Newton's method on the problem of `base`, which it falls back on.
    pub fn new(base: M) -> Result<Self, Error> {
        let steps = Steps::new(base.problem())?;
        let n = base.problem().order();
        Ok(Self {
            base,
            steps,
            best: vec![T::zero(); n],
            between: vec![T::zero(); n],
            base_iterations: 0,
            looks: 0,
            phase: None,
            resting: 0,
            rest: 2,
            begun: false,
            nests: true,
        })
    }

    pub fn amg(&self) -> &Amg<T> {
        &self.steps.amg
    }

    fn fall_back(&mut self, q: &Rhs<'_, T>, y: &mut [T]) {
        (self.phase, self.resting) = (None, self.rest - 1);
        self.rest = self.rest.saturating_mul(2);
        self.base_iterations += 1;
        let _ = iterate(&mut self.base, q, &self.best, y, &mut self.between);
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

    fn sweeps(&self, _: usize) -> usize {
        let steps = self.steps.nested + self.steps.amg.walks();
        self.base.sweeps(self.base_iterations) + self.steps.sweeps + steps.ceil() as usize
    }

    fn restart(&mut self) {
        self.base.restart();
        self.steps.restart();
        (self.steps.linear_iterations, self.steps.sweeps, self.base_iterations) = (0, 0, 0);
        (self.looks, self.begun) = (0, false);
        (self.phase, self.resting, self.rest) = (None, 0, 2);
    }

    fn remembers(&self) -> bool {
        true
    }

    fn linear_iterations(&self) -> Option<usize> {
        Some(self.steps.linear_iterations)
    }

    fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        let gamma = self.base.problem().gamma();
        Some(self.steps.measure(self.base.problem(), q.entries(), x).over(gamma))
    }

    fn step(&mut self, _: usize, q: &Rhs<'_, T>, x: &[T], y: &mut [T]) -> Norms {
        if self.resting > 0 {
            self.resting -= 1;
            self.base_iterations += 1;
            return iterate(&mut self.base, q, x, y, &mut self.between);
        }
        let norms = self.steps.measure(self.base.problem(), q.entries(), x);
        let begins = !std::mem::replace(&mut self.begun, true);
        y.copy_from_slice(x);
        if begins && self.nests {
            let zero = Norms::of(q.entries()).l2 * self.base.problem().gamma().to_f64().unwrap_or(1.0);
            if norms.l2 > 0.1 * zero {
                let _ = nested::start(self.base.problem(), q.entries(), y, &mut self.steps);
            }
        }
        let mut phase = self.phase.unwrap_or_else(|| {
            self.best.copy_from_slice(x);
            Phase { best: norms.l2, quiet: 0, fewest: usize::MAX }
        });
        if norms.l2 <= PROGRESS * phase.best {
            (phase.best, phase.quiet) = (norms.l2, 0);
            self.best.copy_from_slice(x);
        } else if self.phase.is_some() {
            phase.quiet += 1;
        }
        if phase.quiet < PATIENCE && self.steps.step(self.base.problem(), q.entries(), y) {
            if self.steps.flips < phase.fewest {
                (phase.fewest, phase.quiet) = (self.steps.flips, 0);
            }
            self.phase = Some(phase);
        } else {
            self.fall_back(q, y);
        }
        let _ = to_scalar::<T>(0.0);
        norms.over(self.base.problem().gamma())
    }
}
