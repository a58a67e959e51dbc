//! A numbering along the flow, in which a forward sweep solves transport.

use std::{cmp::Reverse, collections::BinaryHeap};

use hlcp_core::{LinearOperator, Scalar};

use super::matrix::Matrix;
use crate::Clock;

/// The transport in a matrix.
#[derive(Debug)]
pub(super) struct Flow {
    /// `[j, i]` where row `i` hears more of `j` than row `j` of `i`, by `j`.
    arrows: Vec<[u32; 2]>,
    /// The part of the couplings that has no counterpart; 1 of a diagonal matrix.
    pub(super) share: f64,
}

impl Flow {
    /// None when the clock is up.
    pub(super) fn of<T: Scalar>(matrix: &Matrix<T>, clock: &mut Clock<'_>) -> Option<Self> {
        let back = matrix.across(&matrix.values, clock)?;
        let (mut arrows, mut sum, mut all) = (vec![], 0.0, 0.0);
        for i in 0..matrix.order() {
            for (at, j) in matrix.places(i) {
                let a = matrix.values[at].abs();
                all += a.wide();
                let net = a - back[at].abs();
                if net > T::zero() {
                    arrows.push([j as u32, i as u32]);
                    sum += net.wide();
                }
            }
        }
        arrows.sort_unstable();
        Some(Self { arrows, share: if all > 0.0 { sum / all } else { 1.0 } })
    }

    /// The `n` unknowns in an order in which, as far as there is one, arrows lead from the earlier
    /// to the later; `None` where the natural one is that, or there are no arrows, or when the
    /// clock is up.
    ///
    /// Of those that may come next the one with the smallest number does (Kahn's algorithm with a
    /// heap), also where a circle leaves none: so a grid keeps its lines.
    pub(super) fn order(&self, n: usize, clock: &mut Clock<'_>) -> Option<Vec<u32>> {
        if self.arrows.iter().all(|[from, to]| from < to) {
            return None;
        }
        let mut waits = vec![0_u32; n];
        self.arrows.iter().for_each(|&[_, to]| waits[to as usize] += 1);
        let mut free: BinaryHeap<_> =
            (0..n as u32).filter(|&i| waits[i as usize] == 0).map(Reverse).collect();
        let (mut order, mut done, mut first) = (Vec::with_capacity(n), vec![false; n], 0);
        while order.len() < n {
            let i = free.pop().map_or(first, |Reverse(i)| i);
            first += u32::from(i == first);
            if std::mem::replace(&mut done[i as usize], true) {
                continue;
            }
            if clock.is_up_at(order.len()) {
                return None;
            }
            order.push(i);
            let from = self.arrows.partition_point(|arrow| arrow[0] < i);
            for &[_, to] in self.arrows[from..].iter().take_while(|arrow| arrow[0] == i) {
                waits[to as usize] -= 1;
                if waits[to as usize] == 0 {
                    free.push(Reverse(to));
                }
            }
        }
        Some(order)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize, entries: &[(usize, usize)]) -> Matrix<f64> {
        let rows = Matrix::by_rows([n, entries.len()], &mut Clock::endless(), |i, row| {
            row.extend(entries.iter().filter(|e| e.0 == i).map(|e| (e.1 as u32, -1.0)));
            row.push((i as u32, 4.0));
        });
        rows.unwrap()
    }

    #[test]
    fn the_order_follows_the_flow_and_cuts_circles() {
        let of = |matrix| Flow::of(&matrix, &mut Clock::endless()).unwrap();
        let order = |flow: &Flow, n| flow.order(n, &mut Clock::endless());
        // Transport 3 → 1 → 0 → 2, beside a coupling of 2 and 3 with a counterpart.
        let flow = of(matrix(4, &[(1, 3), (0, 1), (2, 0), (2, 3), (3, 2)]));
        assert_eq!((order(&flow, 4), flow.share), (Some(vec![3, 1, 0, 2]), 0.6));
        // A circle 0 → 2 → 1 → 0 begins at its smallest number.
        assert_eq!(order(&of(matrix(3, &[(2, 0), (1, 2), (0, 1)])), 3), Some(vec![0, 2, 1]));
        // Along the numbers, and no flow at all.
        assert_eq!(order(&of(matrix(3, &[(1, 0), (2, 1)])), 3), None);
        assert_eq!(order(&of(matrix(2, &[(0, 1), (1, 0)])), 2), None);
        assert_eq!(of(matrix(2, &[])).share, 1.0);
    }
}
