//! Aggregates: pairs by the largest coupling, twice a level.

use hlcp_core::Scalar;

use super::matrix::{Matrix, NONE};
use crate::krylov::to_scalar;

/// A coupling of less than this part of an unknown's largest one is weak.
const WEAK: f64 = 0.25;

/// The most members of a pair that leftovers join.
const MEMBERS: u8 = 4;

/// Which of `.1` aggregates each unknown joins, numbered by their first members.
///
/// Unknowns of which `apart` is true join none.
pub(super) fn pairs<T: Scalar>(
    matrices: &[(&Matrix<T>, T)],
    apart: impl Fn(usize) -> bool,
) -> (Vec<u32>, usize) {
    let n = matrices[0].0.order();
    let columns: Vec<_> = matrices.iter().map(|(matrix, _)| matrix.transpose()).collect();
    let mut aggregate = vec![NONE; n];
    let mut members: Vec<u8> = Vec::with_capacity(n / 2 + 1);
    let mut coupling = vec![T::zero(); n];
    let mut near: Vec<u32> = Vec::new();
    let (weak, alike) = (to_scalar::<T>(WEAK), to_scalar::<T>(0.999));
    for i in 0..n {
        if aggregate[i] != NONE || apart(i) {
            continue;
        }
        // Twice the symmetrised couplings; of rows and columns alike, so that no direction of flow is preferred.
        for (&(matrix, factor), columns) in matrices.iter().zip(&columns) {
            let column = columns.column(i).iter().map(|&(j, a)| (j as usize, a));
            for (j, a) in matrix.off(i).chain(column) {
                if coupling[j] == T::zero() {
                    near.push(j as u32);
                }
                coupling[j] -= factor * a;
            }
        }
        let mut largest = T::zero();
        for &j in &near {
            if !apart(j as usize) {
                largest = largest.max(coupling[j as usize]);
            }
        }
        // The strongest free neighbour, or the strongest aggregate with room. Of couplings that rounding alone tells
        // apart the last, so that the aggregates of a grid line up.
        let (mut partner, mut host) = ((NONE, T::zero()), (NONE, T::zero()));
        for &j in &near {
            let (to, strength) = (aggregate[j as usize], coupling[j as usize]);
            coupling[j as usize] = T::zero();
            if strength <= T::zero() || strength < weak * largest || apart(j as usize) {
                continue;
            }
            if to == NONE {
                if strength >= alike * partner.1 && (strength > partner.1 || j > partner.0 || partner.0 == NONE) {
                    partner = (j, strength.max(partner.1));
                }
            } else if members[to as usize] < MEMBERS && strength > host.1 {
                host = (to, strength);
            }
        }
        near.clear();
        if partner.0 == NONE && host.0 != NONE {
            aggregate[i] = host.0;
            members[host.0 as usize] += 1;
            continue;
        }
        let next = members.len() as u32;
        aggregate[i] = next;
        members.push(1);
        if partner.0 != NONE {
            aggregate[partner.0 as usize] = next;
            members[next as usize] = 2;
        }
    }
    (aggregate, members.len())
}

/// The aggregates of two passes of pairing, their number, and the sums over pairs of them.
pub(super) fn coarsen<T: Scalar>(
    matrix: &Matrix<T>,
    apart: impl Fn(usize) -> bool,
) -> (Vec<u32>, Matrix<T>) {
    let (mut aggregate, half) = pairs(&[(matrix, T::one())], apart);
    let middle = matrix.aggregated(&aggregate, half);
    let (second, quarter) = pairs(&[(&middle, T::one())], |_| false);
    for a in aggregate.iter_mut().filter(|a| **a != NONE) {
        *a = second[*a as usize];
    }
    let coarse = middle.aggregated(&second, quarter);
    (aggregate, coarse)
}
