//! The stopping test: what was asked, and whether an iterate is shown to meet it.

use hlcp_core::{Error, Hlcp, LinearOperator, Norms, Rhs, Scalar};

use crate::{Limits, Norm, limits::FRACTION};

/// Iterates that seem to meet the tolerance while rounding hides their residual, before the solve
/// ends as stagnated; and iterations without a smaller residual after which, again and again, it is
/// compared with the rounding of its terms.
pub(crate) const QUIET: usize = 25;

/// A residual is near rounding if it is at most this many times the bound on it.
const NEAR: f64 = 100.0;

/// The test that a residual must pass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Test {
    norm: Norm,
    /// The residual that is asked for, apart from rounding.
    pub(crate) asked: f64,
    /// The largest residual that rounding may excuse.
    cap: f64,
    /// The factor of `size`, and `‖q‖ + a‖z‖ + b‖r‖` at some recent iterate.
    roundings: f64,
    size: f64,
    /// The lengths of a typical row of A and of B.
    rows: [f64; 2],
    /// Iterates whose residual was hidden by rounding.
    hidden: usize,
    /// The iteration from which on another iterate may be judged, and the distance to the next.
    due: usize,
    gap: usize,
    /// The smallest residual that was refused.
    refused: f64,
    /// The iteration before which `size` is not measured for a residual that is near it.
    next: usize,
}

impl Test {
    pub(crate) fn new<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
        limits: &Limits,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        scratch: &mut Vec<T>,
    ) -> Result<Self, Error> {
        let (norm, asked, roundings) = (limits.norm, limits.asked(q)?, limits.roundings::<T>());
        let rows = if roundings > 0.0 { problem.row_lengths(scratch) } else { [0.0; 2] };
        let size = norm.of(q.norms());
        Ok(Self {
            norm,
            asked,
            cap: FRACTION * size,
            roundings,
            size,
            rows,
            hidden: 0,
            due: 0,
            gap: 1,
            refused: f64::INFINITY,
            next: 0,
        })
    }

    /// Measures the size of the residual's terms at `x`, if rounding may excuse a residual.
    pub(crate) fn renew<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
    ) {
        if self.roundings == 0.0 {
            return;
        }
        let [z, r] = problem.factor_norms(x).map(|norms| self.norm.of(norms));
        let size = self.norm.of(q.norms()) + self.rows[0] * z + self.rows[1] * r;
        self.size = if size.is_finite() { size } else { 0.0 };
    }

    /// Returns whether the size of the terms, if it has grown since it was measured, might excuse a
    /// residual; true ever more seldom, so that slow iterations do not pay for it: 384 solves of
    /// random films measure the size 881 times, and 20,581 times where every iterate may ask.
    pub(crate) fn is_doubtful(&mut self, iteration: usize, norms: Norms) -> bool {
        let near = self.norm.of(norms) <= NEAR * self.roundings * self.size;
        let is_doubtful = near && iteration >= self.next && !self.seems_within(norms);
        if is_doubtful {
            self.next = iteration + iteration / 4 + 1;
        }
        is_doubtful
    }

    /// Returns whether a residual seems good enough, so that a judgement is worth its cost.
    pub(crate) fn is_near(&self, iteration: usize, norms: Norms) -> bool {
        let is_due = iteration >= self.due || self.norm.of(norms) <= 0.5 * self.refused;
        is_due && self.seems_within(norms)
    }

    fn seems_within(&self, norms: Norms) -> bool {
        let excused = (self.roundings * self.size).min(self.cap);
        self.norm.of(norms) <= self.asked.max(excused)
    }

    /// Judges the iterate `x`, whose residual was measured as `norms`: `Ok` with upper bounds on
    /// the exact norms that show it to be good enough, or `Err` with the best that is known of
    /// them.
    pub(crate) fn judge<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        norms: Norms,
        scratch: &mut Vec<T>,
    ) -> Result<Norms, Norms> {
        self.renew(problem, q, x);
        if !self.seems_within(norms) {
            return Err(norms);
        }
        let bound = problem.exact_residual(q, x).unwrap_or_else(|| {
            let rounding = problem.estimated_rounding(q, x, scratch);
            // The sum of n squares is rounded, too.
            let sum = 1.0 + x.len() as f64 * f64::EPSILON;
            Norms { l2: norms.l2 * sum + rounding.l2, linf: norms.linf + rounding.linf }
        });
        if self.admits(norms, bound) { Ok(bound) } else { Err(bound) }
    }

    /// Returns whether a measured residual and a bound on the exact one are good enough.
    fn admits(&self, norms: Norms, bound: Norms) -> bool {
        let [residual, bound] = [norms, bound].map(|norms| self.norm.of(norms));
        let excused = self.roundings > 0.0 && residual <= self.roundings * self.size;
        bound <= self.asked || excused && bound <= self.cap
    }

    /// Returns the residual to report of an answer that was judged good enough by `bound`, and
    /// `measured` by the operators' products: that unless it is larger by rounding. `None` if more
    /// than rounding is between the two, because a product is not that of the operator's rows.
    pub(crate) fn confirm<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
        &self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        [measured, bound]: [Norms; 2],
        scratch: &mut Vec<T>,
    ) -> Option<Norms> {
        if self.admits(measured, measured) {
            return Some(measured);
        }
        self.explains(problem, q, x, [bound, measured], scratch).then_some(bound)
    }

    /// Returns whether rounding at `x` may be between a smaller and a larger residual.
    pub(crate) fn explains<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
        &self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        residuals: [Norms; 2],
        scratch: &mut Vec<T>,
    ) -> bool {
        let rounding = self.norm.of(problem.estimated_rounding(q, x, scratch));
        let [smaller, larger] = residuals.map(|norms| self.norm.of(norms));
        larger <= smaller + 2.0 * rounding
    }

    /// Returns whether a bound is far above what was measured.
    pub(crate) fn is_far(&self, measured: Norms, bound: Norms) -> bool {
        self.norm.of(bound) > 2.0 * self.norm.of(measured)
    }

    /// Notes that an iterate with a `measured` residual was refused for `bound`, and puts off the
    /// next judgement, each time for longer, unless rounding hides the residual; one of half the
    /// residual is judged all the same.
    pub(crate) fn refused(&mut self, iteration: usize, measured: Norms, bound: Norms) {
        self.refused = self.refused.min(self.norm.of(measured));
        let is_above = self.norm.of(bound) > self.cap.max(self.asked);
        if is_above && self.is_far(measured, bound) {
            self.hidden += 1;
        } else {
            self.due = iteration.saturating_add(self.gap);
            self.gap = self.gap.saturating_mul(2);
        }
    }

    /// Counts anew how many iterates have a hidden residual.
    pub(crate) fn wait(&mut self) {
        self.hidden = 0;
    }

    /// Returns whether rounding has hidden the residual of so many iterates that no answer is to be
    /// expected.
    pub(crate) fn is_hidden(&self) -> bool {
        self.hidden >= QUIET
    }
}
