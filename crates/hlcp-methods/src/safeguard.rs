//! The phases of a Newton method, and the iterations of its base between them.

use hlcp_core::Scalar;

/// A residual of at most this part of the smallest one of the phase is progress.
const PROGRESS: f64 = 0.9;

/// When a Newton method goes on, and when its base takes over from the best iterate of a phase:
/// for 2, 4, 8, … iterations after the first, second, third, … phase.
#[derive(Debug, Clone)]
pub(crate) struct Safeguard<T> {
    /// The iterate of the smallest residual of the phase.
    pub(crate) best: Vec<T>,
    /// That residual and the steps since, unless the base has its turn or a phase is about to
    /// begin.
    phase: Option<(f64, usize)>,
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

    /// Whether the next iteration is one of the base's.
    pub(crate) fn rests(&mut self) -> bool {
        let rests = self.resting > 0;
        self.resting -= usize::from(rests);
        rests
    }

    /// Whether the next step is the first of a phase.
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
        let (best, quiet) = match self.phase {
            Some((best, quiet)) if residual > PROGRESS * best || residual.is_nan() => {
                (best, quiet + usize::from(counts))
            }
            _ => {
                self.best.copy_from_slice(x);
                (residual, 0)
            }
        };
        self.phase = Some((best, quiet));
        quiet
    }

    /// Takes in progress of another kind.
    pub(crate) fn forgive(&mut self) {
        self.phase = self.phase.map(|(best, _)| (best, 0));
    }

    /// Ends the phase; an iteration of the base from the best iterate is due at once.
    pub(crate) fn end(&mut self) {
        (self.phase, self.resting) = (None, self.rest - 1);
        self.rest = self.rest.saturating_mul(2);
    }
}
