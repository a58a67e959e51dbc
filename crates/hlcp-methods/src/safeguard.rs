//! The phases of a Newton method, and the iterations of its base between them.

use hlcp_core::Scalar;

/// Steps without progress that end the first phase, or each.
pub(crate) const PATIENCE: usize = 6;

/// A residual of at most this part of the smallest one that steps have led to is progress, as is a
/// defect of at most this part of the one before a cycle.
pub(crate) const PROGRESS: f64 = 0.9;

/// What is solved roughly, a linear system while steps change signs or a coarser problem, is solved
/// to this part of its residual at 0. A start whose residual is that small is better than what a
/// coarser problem has to say.
pub(crate) const ROUGH: f64 = 0.1;

/// The part of the residual that ends the solve to which a linear system is solved at most.
const ENOUGH: f64 = 0.3;

/// Returns the relative residual to which a linear system is solved, given the solver's residual
/// there, the one that ends the solve, and whether the last step changed signs.
///
/// A step that changes none is within the piece of F on which it began, where the next one ends the
/// solve, if its linear system is solved that far.
pub(crate) fn forcing<T: Scalar>(residual: f64, goal: f64, changes: bool) -> f64 {
    let enough = ENOUGH * goal / residual;
    let forcing = if changes { ROUGH } else { T::epsilon().wide() };
    forcing.max(enough).min(ENOUGH)
}

/// The record of a phase.
#[derive(Debug, Clone, Copy)]
struct Phase {
    /// The residual of the best iterate.
    best: f64,
    /// The smallest residual that a step has led to. The first step from a start with a small
    /// residual may raise it a thousandfold on the way to the solution.
    reached: f64,
    /// The steps since.
    quiet: usize,
}

/// When a Newton method goes on, and when its base takes over from the best iterate of a phase:
/// for 2, 4, 8, … iterations after the first, second, third, … phase.
#[derive(Debug, Clone)]
pub(crate) struct Safeguard<T> {
    /// An iterate whose residual is at most 10/9 of the smallest of the phase.
    pub(crate) best: Vec<T>,
    /// The record of the phase, unless the base has its turn or a phase is about to begin.
    phase: Option<Phase>,
    /// The iterations that the base has left, and how many it gets after the next phase.
    resting: usize,
    rest: usize,
}

impl<T: Scalar> Safeguard<T> {
    pub(crate) fn new(n: usize) -> Self {
        Self { best: vec![T::zero(); n], phase: None, resting: 0, rest: 2 }
    }

    pub(crate) fn restart(&mut self) {
        (self.phase, self.resting, self.rest) = (None, 0, 2);
    }

    /// Begins a phase with the next step, wherever it sets out from.
    pub(crate) fn take_up(&mut self) {
        (self.phase, self.resting) = (None, 0);
    }

    /// Returns whether the next iteration is one of the base's.
    pub(crate) fn rests(&mut self) -> bool {
        let rests = self.resting > 0;
        self.resting -= usize::from(rests);
        rests
    }

    /// Returns whether the next step is the first of a phase.
    pub(crate) fn begins(&self) -> bool {
        self.phase.is_none()
    }

    /// How many times as patient phases are as the first.
    pub(crate) fn age(&self) -> usize {
        self.rest / 2
    }

    /// Takes in the residual of `x`, the first of a phase or one that a step led to; a step that
    /// made no progress `counts` against the phase or not. Returns how many have, since one that
    /// made progress.
    pub(crate) fn see(&mut self, residual: f64, x: &[T], counts: bool) -> usize {
        let Some(phase) = &mut self.phase else {
            self.best.copy_from_slice(x);
            self.phase = Some(Phase { best: residual, reached: f64::INFINITY, quiet: 0 });
            return 0;
        };
        if residual <= PROGRESS * phase.best {
            self.best.copy_from_slice(x);
            phase.best = residual;
        }
        if residual <= PROGRESS * phase.reached {
            (phase.reached, phase.quiet) = (residual, 0);
        } else {
            phase.quiet += usize::from(counts);
        }
        phase.quiet
    }

    /// Ends the phase; an iteration of the base from the best iterate is due at once.
    pub(crate) fn end(&mut self) {
        (self.phase, self.resting) = (None, self.rest - 1);
        self.rest = self.rest.saturating_mul(2);
    }
}
