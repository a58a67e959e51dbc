use hlcp_core::{Hlcp, Norms, Rhs, Scalar};

use crate::{
    Clock, Jacobian, Method, Preconditioner, Work,
    krylov::BiCgStab,
    method::{iterate, measure},
    pivoting::FEWER,
    safeguard::{PATIENCE, Safeguard, forcing},
};

/// The most iterations of one inner solve, and the sweeps that one is worth.
const INNER: usize = 1000;
const WORTH: usize = 4;

/// Semismooth Newton on F, with matrix-free inner solves and a base method to fall back on.
///
/// F is piecewise linear, and one iteration solves the piece that `x` lies on,
///
/// ```text
/// J(x) s = F(x) ,    x⁺ = x − s ,
/// ```
///
/// with the [`Jacobian`] by BiCGStab, preconditioned by a [`Preconditioner`], to a tenth of ‖F‖; on
/// a piece that the last step has not left to what ends the solve, as it may be the solution's.
///
/// # Safeguard
///
/// Newton's method alone may repeat active sets for ever, or meet a singular J. So it runs in
/// phases. A phase begins with two iterations of the base method, which settle most signs. It ends
/// after six steps that have not brought ‖F‖ to nine tenths of the smallest value that a step of
/// the phase has led to, as a repeated active set cannot, or when an inner solve fails; then the
/// base takes over at the best iterate of the phase, for 2, 4, 8, … iterations after the first,
/// second, third, … phase. A step under which the active set only shrinks or only grows, as it did
/// in the step before, is not one of the six. So a contact whose edge moves by one point per step
/// is followed to the end, and at most n steps in a row can be of that kind.
///
/// # Cost
///
/// An outer step takes one defect and one inner solve; an inner iteration two products with `A` and
/// with `B` and two calls of the preconditioner. [`work`](Method::work) counts them, and takes a
/// defect, two products and a call of the preconditioner for one sweep each. `11n` numbers beside
/// the base's and the preconditioner's, all allocated by [`new`](Self::new).
///
/// # Convergence
///
/// Where the base converges for every `q` by a theorem of `docs/theory.md`, some iterate is within
/// any tolerance, from any start. By the column theorem accelerated Gauss–Seidel does at τ = 1, on
/// films too. In a phase that does not end ‖F‖ falls by tenths for ever; one that ends hands over
/// an iterate whose error is at most a constant times that at its start, and the base's iterations
/// between phases, of which there are ever more, multiply it by a number that tends to zero. Where
/// `A` is an M-matrix, `B` a Z-matrix, and (II) holds for some `Ω ≥ D_A D_B⁻¹`, as for contacts,
/// full steps with exact inner solves increase to the solution and end in `n + 2`, without any
/// safeguard. From every `x` near the solution one
/// step with an exact inner solve ends there, also where some `zᵢ = rᵢ = 0`; with inexact ones a
/// step that changes no sign takes ‖F‖ to a tenth, and the next one ends the solve.
///
/// # Source
///
/// L. Qi and J. Sun, *A nonsmooth version of Newton's method*, Math. Programming 58 (1993); A.
/// Fischer and C. Kanzow, *On finite termination of an iterative method for linear complementarity
/// problems*, Math. Programming 74 (1996).
///
/// ```
/// use hlcp_methods::{
///     Aor, FivePoint, Hlcp, Identity, Limits, Method, Newton, Omega, Options, Solver, Ssor,
///     Tmms,
/// };
///
/// let a = FivePoint::new(16, 16, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, Identity { order: 256 }, Omega::Uniform(4.0))?;
/// let base = Tmms::mirrored(problem, Aor::gauss_seidel().accelerated())?;
/// let mut newton = Solver::new(Newton::new(base, Ssor));
///
/// let q: Vec<f64> = (0..256).map(|i| (0.05 * i as f64).sin() - 0.2).collect();
/// let outcome = newton.solve(&q, Options::from_x(&[1.0; 256]))?;
/// assert!(outcome.converged() && outcome.iterations < 10);
/// assert!(outcome.linear_iterations < Some(100));
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Newton<T, M, P> {
    base: M,
    preconditioner: P,
    krylov: BiCgStab<T>,
    // Where the step is taken, and F there.
    at: Vec<T>,
    f: Vec<T>,
    linear_iterations: usize,
    base_iterations: usize,
    defects: usize,
    /// Residuals that were asked for since the last step.
    looks: usize,
    safeguard: Safeguard<T>,
    /// True if the last step of the phase made unknowns active, and inactive; and whether it went
    /// on in the one way of that before.
    ways: [bool; 2],
    nested: bool,
}

impl<T: Scalar, M: Method<T>, P: Preconditioner<T, M::A, M::B>> Newton<T, M, P> {
    /// Newton's method on the problem of `base`, which it falls back on.
    pub fn new(base: M, preconditioner: P) -> Self {
        let n = base.problem().order();
        let [at, f] = std::array::from_fn(|_| vec![T::zero(); n]);
        Self {
            base,
            preconditioner,
            krylov: BiCgStab::new(n),
            at,
            f,
            linear_iterations: 0,
            base_iterations: 0,
            defects: 0,
            looks: 0,
            safeguard: Safeguard::new(n),
            ways: [false; 2],
            nested: false,
        }
    }

    /// Takes up the solve from another iterate, with a new phase.
    pub(crate) fn take_up(&mut self) {
        self.safeguard.take_up();
    }

    /// Overwrites `y` with the answer of the columns of `A`, or of those of `B`, and of further
    /// steps while they take off what rounding has left; returns whether its signs are theirs. If
    /// it `goes_on`, steps also follow while one of two leaves fewer than three quarters of the
    /// wrong signs, and the answer of any columns will do.
    pub(crate) fn solve_on_side(
        &mut self,
        of_a: bool,
        goes_on: bool,
        q: &Rhs<'_, T>,
        y: &mut [T],
        clock: &mut Clock<'_>,
    ) -> bool {
        // F is −γq here, but for what underflows.
        self.at.fill(if of_a { T::zero() } else { -T::min_positive_value() });
        let (mut last, mut is_slow) = (f64::INFINITY, false);
        let mut fewest = if goes_on { usize::MAX } else { 0 };
        loop {
            self.defects += 1;
            let size = self.measure(q).l2;
            if fewest == 0 && (size <= clock.goal || 2.0 * size > last) {
                y.copy_from_slice(&self.at);
                return true;
            }
            let forcing = forcing::<T>(size, clock.goal, false);
            let Some(flips) = self.correct(forcing, y, clock) else { return false };
            let count = flips[0] + flips[1];
            let are_fewer = count as f64 <= FEWER * fewest as f64;
            if are_fewer {
                fewest = count;
            } else if is_slow || fewest == 0 {
                return goes_on;
            }
            (last, is_slow) = (size, !are_fewer);
            self.at.copy_from_slice(y);
        }
    }

    /// Measures F at `at`, where the next step is taken.
    fn measure(&mut self, q: &Rhs<'_, T>) -> Norms {
        measure(self.base.problem(), q, &self.at, &mut self.f, &mut self.krylov.scratch)
    }

    /// Takes the step from `at` to `y`, if the linear system can be solved to some extent; how
    /// many unknowns that makes active, and inactive.
    fn correct(&mut self, forcing: f64, y: &mut [T], clock: &mut Clock<'_>) -> Option<[usize; 2]> {
        let goal = (forcing, clock.iterations(WORTH, INNER));
        let jacobian = Jacobian::new(self.base.problem(), &self.at);
        let preconditioner = &mut self.preconditioner;
        let inner = self.krylov.solve(&jacobian, preconditioner, &self.f, y, goal, clock);
        self.linear_iterations += inner.iterations;
        if clock.is_up() {
            return None;
        }
        let mut flips = [0; 2];
        for (y, &at) in y.iter_mut().zip(&self.at) {
            *y = at - *y;
            let [before, after] = [at, *y].map(|x| x >= T::zero());
            flips[0] += usize::from(after & !before);
            flips[1] += usize::from(before & !after);
        }
        // A residual that is NaN is not below 1 either.
        (inner.residual < 1.0 && y.iter().all(|y| y.is_finite())).then_some(flips)
    }
}

impl<T: Scalar, M: Method<T>, P: Preconditioner<T, M::A, M::B>> Method<T> for Newton<T, M, P> {
    type A = M::A;
    type B = M::B;

    fn problem(&self) -> &Hlcp<T, M::A, M::B> {
        self.base.problem()
    }

    fn work(&self) -> Option<Work> {
        let sweeps = self.defects + WORTH * self.linear_iterations;
        let own = Work { sweeps, linear_iterations: Some(self.linear_iterations) };
        Some(own + self.base.work().unwrap_or(Work::sweeps(self.base_iterations)))
    }

    fn restart(&mut self) {
        self.base.restart();
        (self.linear_iterations, self.base_iterations) = (0, 0);
        (self.defects, self.looks) = (0, 0);
        self.safeguard.restart();
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        self.at.copy_from_slice(x);
        self.looks += 1;
        Some(self.measure(q))
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        // A look at an iterate counts where a step follows, and so does the defect where the step
        // is taken.
        self.defects += std::mem::take(&mut self.looks);
        if self.safeguard.rests() {
            self.base_iterations += 1;
            return iterate(&mut self.base, q, x, y, &mut self.f, clock);
        }
        self.defects += 1;
        let (norms, size, changes);
        if self.safeguard.begins() {
            self.base_iterations += 2;
            norms = iterate(&mut self.base, q, x, y, &mut self.f, clock);
            if clock.is_up() {
                return norms;
            }
            let _ = iterate(&mut self.base, q, y, &mut self.at, &mut self.f, clock);
            if clock.is_up() {
                return norms;
            }
            (size, changes) = (self.measure(q).l2, true);
            (self.ways, self.nested) = ([false; 2], false);
        } else {
            self.at.copy_from_slice(x);
            norms = self.measure(q);
            (size, changes) = (norms.l2, self.ways != [false; 2]);
        }
        let forcing = forcing::<T>(size, clock.goal, changes);
        let quiet = self.safeguard.see(norms.l2, x, !self.nested);
        let flips = if quiet < PATIENCE { self.correct(forcing, y, clock) } else { None };
        if let Some(flips) = flips {
            let ways = flips.map(|count| count > 0);
            self.nested = ways == self.ways && ways[0] != ways[1];
            self.ways = ways;
        } else if !clock.is_up() {
            // What the base makes of the best iterate of the phase, and the base goes on.
            self.safeguard.end();
            self.base_iterations += 1;
            let _ = iterate(&mut self.base, q, &self.safeguard.best, y, &mut self.f, clock);
        }
        norms
    }
}
