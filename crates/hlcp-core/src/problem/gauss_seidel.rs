//! Sweeps that solve one scalar equation after the other, by rows.

use super::Hlcp;
use crate::{
    numbers::Scalar,
    operators::{Rows, Source},
    rows::Visited,
};

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Hlcp<T, A, B> {
    /// Overwrites `x` by a sweep of the nonlinear Gauss–Seidel method, forward or backward: each
    /// row of `F(x) = (A + BΩ)x + (A − BΩ)|x| + γq` in turn is solved for its own unknown, on one
    /// thread. Where the pivot is zero the unknown stays.
    ///
    /// # Panics
    ///
    /// Unless `q` and `x` have length `n`; where ranks share the problem.
    #[doc(hidden)]
    pub fn solve_rows(&self, q: &[T], x: &mut [T], backward: bool) {
        self.assert_orders([("q", q.len()), ("x", x.len())]);
        assert!(self.strip().is_none(), "rows are solved one after another on one rank");
        let (mut a, mut b) = (Visited::new(&self.a), Visited::new(&self.b));
        for k in 0..x.len() {
            let i = if backward { x.len() - 1 - k } else { k };
            // t + 2aᵢᵢxᵢ = 0 where t ≤ 0, t + 2bᵢᵢωᵢxᵢ = 0 elsewhere.
            let t = self.q_factor() * q[i];
            let (t, of_a) = a.fold(i, (t, T::zero()), |(t, own), j, a| {
                if j == i { (t, a) } else { (t + a * (x[j].abs() + x[j]), own) }
            });
            let (t, of_b) = b.fold(i, (t, T::zero()), |(t, own), j, b| {
                let b = self.omega.entry(j) * b;
                if j == i { (t, b) } else { (t - b * (x[j].abs() - x[j]), own) }
            });
            let pivot = if t <= T::zero() { of_a } else { of_b };
            if pivot != T::zero() {
                x[i] = -t / (pivot + pivot);
            }
        }
    }
}
