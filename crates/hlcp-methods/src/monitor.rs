//! Detects divergence, stagnation and cycles.

use hlcp_core::{Hlcp, LinearOperator, Scalar};

use crate::{Divergence, Status};

/// A residual this many times the larger of ‖q‖ and its first value is divergence.
///
/// Generous on purpose: an over-relaxed iteration may grow for hundreds of steps before it
/// contracts.
#[doc(hidden)]
pub const GROWTH: f64 = 1e16;

/// How many iterations without a smaller residual it takes before the movement of the iterates is
/// looked at.
#[doc(hidden)]
pub const PATIENCE: usize = 1000;

/// The movement `‖x⁺ − x‖∞`, in units of `ε ‖x‖∞`, that rounding alone explains.
///
/// An entry of F is a sum of a dozen terms of the size of ‖x‖, each rounded, over a pivot of that
/// size. The same of a backward error, in units of ε.
pub(crate) const ROUNDING: f64 = 64.0;

/// The history of one iteration, in a few numbers.
#[derive(Debug, Clone)]
pub(crate) struct Monitor<T> {
    scale: f64,
    /// True if an iterate that comes back need not come back for ever.
    remembers: bool,
    best: f64,
    best_at: usize,
    mark: Mark,
    anchor: Vec<T>,
    anchored_at: Option<usize>,
    moved: bool,
}

/// A residual to compare later ones with, renewed at growing distances as in Brent's cycle finding.
#[derive(Debug, Clone, Copy)]
struct Mark {
    residual: f64,
    at: usize,
    span: usize,
    returns: usize,
}

impl Mark {
    const NONE: Self = Self { residual: f64::NAN, at: 0, span: 1, returns: 0 };

    /// Returns whether the residual came back for the third time.
    fn third_return(&mut self, k: usize, residual: f64) -> bool {
        if residual == self.residual {
            self.returns += 1;
        } else if k - self.at >= self.span {
            self.renew(k, residual);
        }
        self.returns >= 3
    }

    fn renew(&mut self, k: usize, residual: f64) {
        *self = Self { residual, at: k, span: 2 * self.span, returns: 0 };
    }
}

impl<T: Scalar> Monitor<T> {
    pub(crate) fn new() -> Self {
        Self {
            scale: 0.0,
            remembers: false,
            best: f64::INFINITY,
            best_at: 0,
            mark: Mark::NONE,
            anchor: Vec::new(),
            anchored_at: None,
            moved: false,
        }
    }

    /// Forgets the last iteration, but not its storage.
    pub(crate) fn begin(&mut self, scale: f64, remembers: bool) {
        let anchor = std::mem::take(&mut self.anchor);
        *self = Self { scale, remembers, anchor, ..Self::new() };
    }

    /// Notes the residual of iterate `k`; returns whether it is the smallest so far, or counts as
    /// that because the best iterate is `lost`.
    pub(crate) fn is_best(&mut self, k: usize, residual: f64, lost: bool) -> bool {
        let best = k == 0 || lost || residual < self.best;
        if k == 0 {
            self.scale = self.scale.max(residual);
        }
        if best {
            (self.best, self.best_at) = (residual, k);
        }
        best
    }

    /// Looks for rest and cycles anew from iterate `k` on.
    pub(crate) fn wait_from(&mut self, k: usize) {
        self.best_at = k;
        (self.mark, self.anchored_at, self.moved) = (Mark::NONE, None, false);
    }

    /// The number of iterations since the smallest residual.
    pub(crate) fn quiet(&self, k: usize) -> usize {
        k - self.best_at
    }

    /// Looks at iterate `k`, its residual and the step that leads on from it; returns why the
    /// iteration should go no further.
    ///
    /// The ranks that share the `problem` compare their parts.
    pub(crate) fn stop<A: LinearOperator<T>, B: LinearOperator<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        k: usize,
        residual: f64,
        x: &[T],
        next: &[T],
    ) -> Option<Status> {
        if !residual.is_finite() {
            let entry = x.iter().position(|x| !x.is_finite());
            let place = entry.map_or(f64::NEG_INFINITY, |k| -(problem.index(k) as f64));
            let [first] = problem.largest([place]);
            return Some(Status::Diverged(if first.is_finite() {
                Divergence::Entry { index: -first as usize }
            } else {
                Divergence::Residual
            }));
        }
        if residual > GROWTH * self.scale {
            return Some(Status::Diverged(Divergence::Growth));
        }
        let quiet = self.quiet(k);
        if let Some(at) = self.anchored_at {
            if k == at + 1 {
                self.moved = !moves_by_rounding(problem, &self.anchor, x);
            }
            // Also within an iteration: two steps may undo each other.
            let resting = || !self.moved && moves_by_rounding(problem, x, next);
            let back = !problem.any(x != self.anchor);
            if back && resting() {
                return Some(Status::Stagnated);
            }
            if back && !self.remembers {
                return Some(Status::Cycling { period: k - at });
            }
            if quiet > PATIENCE && k == at + 1 && resting() {
                return Some(Status::Stagnated);
            }
            if k - at > self.mark.span {
                self.anchored_at = None;
                self.mark.renew(k, residual);
            }
        } else if self.mark.third_return(k, residual) || quiet > 0 && quiet.is_multiple_of(PATIENCE)
        {
            self.anchor.clear();
            self.anchor.extend_from_slice(x);
            self.anchored_at = Some(k);
        }
        None
    }
}

/// Returns whether rounding alone explains the step from `x` to `next`.
pub(crate) fn moves_by_rounding<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    problem: &Hlcp<T, A, B>,
    x: &[T],
    next: &[T],
) -> bool {
    let largest = |max: T, v: T| max.max(v.abs());
    let moved = x.iter().zip(next).map(|(&x, &next)| next - x).fold(T::zero(), largest);
    let size = x.iter().copied().fold(T::zero(), largest);
    let [moved, size] = problem.largest([moved.wide(), size.wide()]);
    T::of(moved) <= T::of(ROUNDING) * T::epsilon() * T::of(size)
}
