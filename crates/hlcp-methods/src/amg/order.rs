//! A numbering along the flow, in which a forward sweep solves transport.

use std::{cmp::Reverse, collections::BinaryHeap};

use hlcp_core::{Hlcp, Rows, Scalar};

use super::matrix::Matrix;

/// The unknowns in an order in which, as far as there is one, each comes after those that its row hears more of than they of
/// it; empty where the natural one is such an order.
///
/// The order is that of `B`, or of `A` where `B` is symmetric. Of those that may come next the one with the smallest number does
/// (Kahn's algorithm with a heap), also where a circle leaves none: so a grid keeps its lines.
pub(super) fn along_flow<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Vec<u32> {
    let of_b = upstream(&Matrix::of(problem.b()));
    let order = of_b.or_else(|| upstream(&Matrix::of(problem.a())));
    order.filter(|order| !order.is_sorted()).unwrap_or_default()
}

/// The order along the flow of one matrix; `None` where its couplings are all symmetric.
fn upstream<T: Scalar>(matrix: &Matrix<T>) -> Option<Vec<u32>> {
    let n = matrix.order();
    let columns = matrix.transpose();
    let mut net = vec![T::zero(); n];
    // The arrows j → i, by j, and how many lead to each i.
    let (mut arrows, mut waits) = (vec![], vec![0_u32; n]);
    for i in 0..n {
        let (row, column) = (matrix.off(i), columns.column(i));
        row.for_each(|(j, a)| net[j] += a.abs());
        column.iter().for_each(|&(j, a)| net[j as usize] -= a.abs());
        let clear = matrix.off(i).map(|(j, _)| j).chain(column.iter().map(|c| c.0 as usize));
        for j in clear {
            if std::mem::replace(&mut net[j], T::zero()) > T::zero() {
                arrows.push((j as u32, i as u32));
                waits[i] += 1;
            }
        }
    }
    if arrows.is_empty() {
        return None;
    }
    arrows.sort_unstable();
    let mut done = vec![false; n];
    let mut free: BinaryHeap<Reverse<u32>> =
        (0..n as u32).filter(|&i| waits[i as usize] == 0).map(Reverse).collect();
    let (mut order, mut first) = (Vec::with_capacity(n), 0);
    while order.len() < n {
        let next = free.pop().map(|Reverse(i)| i);
        let next = next.filter(|&i| !done[i as usize]);
        let Some(i) = next.or_else(|| {
            if !free.is_empty() {
                return None;
            }
            while done[first as usize] {
                first += 1;
            }
            Some(first)
        }) else {
            continue;
        };
        done[i as usize] = true;
        order.push(i);
        let from = arrows.partition_point(|arrow| arrow.0 < i);
        for &(_, to) in arrows[from..].iter().take_while(|arrow| arrow.0 == i) {
            let waits = &mut waits[to as usize];
            *waits = waits.saturating_sub(1);
            if *waits == 0 && !done[to as usize] {
                free.push(Reverse(to));
            }
        }
    }
    Some(order)
}
