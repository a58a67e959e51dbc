//! Aggregates: pairs by the largest coupling, twice per level.

use hlcp_core::{LinearOperator, Scalar};

use super::matrix::{Matrix, NONE};
use crate::Clock;

/// A coupling of less than this part of an unknown's largest one is weak.
const WEAK: f64 = 0.25;

/// Couplings of at least this part of another one are as strong: rounding alone may tell them
/// apart.
const ALIKE: f64 = 0.999;

/// Which aggregate each unknown joins, numbered by their first members, and the largest coupling by
/// which one joined each aggregate.
///
/// The coupling of `i` and `j` is `−aᵢⱼ − aⱼᵢ` in the weighted sum of the matrices, rows and
/// columns alike, so that no direction of a flow is preferred. Unknowns of which `apart` is true
/// join none. Unknowns that are aggregates themselves `held` by some coupling do not join by one
/// that is weak beside it: sweeps, which move the members of a stiff block one by one, do not move
/// the block, and the coarser level could not move it without its neighbours. Leftovers join the
/// aggregate of their strongest neighbour while that has fewer than `most` members: with a hub,
/// all that lean on it. None when the clock is up.
pub(super) fn pairs<T: Scalar>(
    matrices: &[(&Matrix<T>, T)],
    held: &[T],
    most: u32,
    apart: impl Fn(usize) -> bool,
    clock: &mut Clock<'_>,
) -> Option<(Vec<u32>, Vec<T>)> {
    let n = matrices.first().map_or(0, |(matrix, _)| matrix.order());
    let columns = matrices.iter().map(|(matrix, _)| matrix.transpose(clock));
    let columns = columns.collect::<Option<Vec<_>>>()?;
    let mut aggregate = vec![NONE; n];
    let mut members: Vec<u32> = Vec::with_capacity(n / 2 + 1);
    let mut bonds: Vec<T> = Vec::with_capacity(n / 2 + 1);
    let held = |i: usize| held.get(i).copied().unwrap_or(T::zero());
    let mut coupling = vec![T::zero(); n];
    let mut near: Vec<u32> = Vec::new();
    let [weak, alike] = [WEAK, ALIKE].map(T::of);
    for i in 0..n {
        if clock.is_up_at(i) {
            return None;
        }
        if aggregate[i] != NONE || apart(i) {
            continue;
        }
        for (&(matrix, factor), columns) in matrices.iter().zip(&columns) {
            for (j, a) in matrix.off(i).chain(columns.off(i)).filter(|&(j, _)| !apart(j)) {
                if coupling[j] == T::zero() {
                    near.push(j as u32);
                }
                coupling[j] -= factor * a;
            }
        }
        let largest = near.iter().fold(held(i), |max, &j| max.max(coupling[j as usize]));
        // The strongest free neighbour, of several the one with the largest number, so that the
        // aggregates of a grid line up; and the strongest aggregate with room.
        let (mut partner, mut host) = ((NONE, T::zero()), (NONE, T::zero()));
        for j in near.drain(..) {
            let strength = std::mem::replace(&mut coupling[j as usize], T::zero());
            let to = aggregate[j as usize];
            if strength <= T::zero() || strength < weak * largest.max(held(j as usize)) {
                continue;
            }
            if to != NONE {
                if members[to as usize] < most && strength > host.1 {
                    host = (to, strength);
                }
            } else if strength * alike > partner.1
                || strength >= alike * partner.1 && (partner.0 == NONE || j > partner.0)
            {
                partner = (j, strength);
            }
        }
        let joined = if partner.0 == NONE && host.0 != NONE {
            host.0
        } else {
            members.push(0);
            bonds.push(T::zero());
            members.len() as u32 - 1
        };
        let bond = &mut bonds[joined as usize];
        *bond = if joined == host.0 { bond.max(host.1) } else { partner.1 };
        for i in [i as u32, partner.0].into_iter().filter(|&i| i != NONE) {
            aggregate[i as usize] = joined;
            members[joined as usize] += 1;
        }
    }
    Some((aggregate, bonds))
}

/// The aggregates of two passes of pairing, and the sums over pairs of them with conduction halved,
/// as [`Amg`](super::Amg) says why; none when the clock is up.
pub(super) fn coarsen<T: Scalar>(
    matrix: &Matrix<T>,
    apart: impl Fn(usize) -> bool,
    clock: &mut Clock<'_>,
) -> Option<(Vec<u32>, Matrix<T>)> {
    let (mut aggregate, bonds) = pairs(&[(matrix, T::one())], &[], u32::MAX, apart, clock)?;
    let middle = matrix.aggregated(&aggregate, bonds.len(), clock)?;
    let (second, quarter) = pairs(&[(&middle, T::one())], &bonds, u32::MAX, |_| false, clock)?;
    for a in aggregate.iter_mut().filter(|a| **a != NONE) {
        *a = second[*a as usize];
    }
    let coarse = middle.aggregated(&second, quarter.len(), clock)?;
    Some((aggregate, coarse.halve_conduction(clock)?))
}
