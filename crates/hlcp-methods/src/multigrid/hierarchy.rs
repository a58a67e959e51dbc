//! The operators on coarser grids.

use std::ops::Range;

use hlcp_core::{Coefficients, Error, FivePoint, FivePointView, Scalar, Strip, Transfer, Varying};

/// A grid and the next coarser one over the same domain; where ranks share the problem, this rank's
/// columns of them.
#[derive(Clone, Copy)]
pub(super) struct Grids<'a, T> {
    /// The fine grid's `[nx, ny]`.
    pub(super) fine: [usize; 2],
    /// True if both grids close round along `[x, y]`.
    pub(super) round: [bool; 2],
    pub(super) transfer: &'a Transfer<T>,
    /// The fine grid's, if ranks share it.
    pub(super) strip: Option<&'a Strip>,
}

/// Discretises an operator again from its five-point coefficients.
///
/// Two neighbours' coefficients for each other are split into a symmetric half, diffusion, which
/// scales with `(h/H)²`, and the other half, convection, which scales with `h/H`; where a coarse
/// edge's convection then outweighs its diffusion, diffusion is raised to it (upwinding). A coarse
/// edge takes the mean of the fine edges that it consists of: with bilinear interpolation a
/// harmonic mean makes corrections too large. What a row sums to is its zero-order part, which is
/// kept. All is taken from the fine points nearest to the coarse ones, never from a coefficient
/// that leads outside the grid. Constant coefficients stay constant, and are stored as five
/// numbers.
///
/// Ranks that share the problem do it together, and send each other what they need.
pub(super) fn rediscretised<T: Scalar>(
    fine: FivePointView<'_, T>,
    grids: &Grids<'_, T>,
) -> Result<FivePoint<Varying<T>>, Error> {
    let c @ [south, west, _, east, north] = fine.coefficients();
    let ([nx, ny], width) = (grids.transfer.coarse(), grids.fine[0]);
    // By columns of the whole grid, of which a coarse edge may reach three into the next rank's.
    let whole = grids.strip.map(|strip| Transfer::new(strip.whole(), grids.round));
    let transfer = whole.as_ref().unwrap_or(grids.transfer);
    let first = |strip: Option<&Strip>| strip.map_or(0, |strip| strip.columns().start);
    let [first_fine, first_coarse] = [grids.strip, grids.transfer.strip()].map(first);
    let beside = |c: Coefficients<'_, T>| {
        grids.strip.map_or([vec![], vec![]], |strip| strip.beside(3, |k| c.entry(k)))
    };
    let beside = [beside(west), beside(east)];
    let along = |d: usize, p: usize, q: usize| {
        let [before, after] = &beside[d];
        let own = p.wrapping_sub(first_fine);
        match first_fine.checked_sub(p + 1) {
            Some(back) => before[(q + 1) * before.len() / grids.fine[1] - 1 - back],
            None if own < width => [west, east][d].entry(q * width + own),
            None => after[q * after.len() / grids.fine[1] + own - width],
        }
    };
    let axis = |d: usize| Axis {
        count: transfer.fine()[d],
        nearest: transfer.nearest()[d],
        ratio: grids.transfer.ratio()[d],
        round: grids.round[d],
    };
    let row = |i, j| {
        let [columns, rows] = grids.transfer.nearest();
        let (p, q) = (columns[i], rows[j]);
        let zero_order = c.iter().fold(T::zero(), |sum, c| sum + c.entry(q * width + p));
        let along = [0, 1].map(|d| move |p: usize| along(d, p, q));
        let [west, east] = couplings(along, axis(0), first_coarse + i);
        let across = [south, north].map(|c| move |q: usize| c.entry(q * width + p));
        let [south, north] = couplings(across, axis(1), j);
        [south, west, zero_order - (south + west + east + north), east, north]
    };
    if grids.strip.is_none() && fine.constants().is_some() {
        let coarse = FivePoint::new(nx, ny, row(0, 0).map(Varying::Uniform))?;
        return coarse.periodic(grids.round);
    }
    FivePoint::from_fn(nx, ny, row)?.periodic(grids.round)
}

/// The fine nodes of an axis, those nearest to coarse ones, the spacings' ratio, and whether it
/// closes.
struct Axis<'a, T> {
    count: usize,
    nearest: &'a [usize],
    ratio: T,
    round: bool,
}

/// The coefficients of coarse node `i`'s neighbours before and after it on an axis, given those of
/// the fine nodes.
fn couplings<T: Scalar>(
    [back, ahead]: [impl Fn(usize) -> T; 2],
    Axis { count, nearest, ratio, round }: Axis<'_, T>,
    i: usize,
) -> [T; 2] {
    let here = nearest[i];
    if nearest.len() == count {
        return [back(here), ahead(here)];
    }
    // The edges to the coarse neighbours, without those to the interval's ends, by the points they
    // lead back from; counted so that what leads across stays positive.
    let [before, after] = match round {
        true => [2, 2],
        false => {
            let last = nearest.get(i + 1).copied().unwrap_or(count - 1);
            [here - if i > 0 { nearest[i - 1] } else { 0 }, last - here]
        }
    };
    let edge = |p: usize| [back(p % count), ahead((p - 1) % count)];
    let here = here + count;
    let coarse = |points: Range<usize>| coarse_edge(points.map(edge), ratio);
    [coarse(here - before + 1..here + 1)[0], coarse(here + 1..here + after + 1)[1]]
}

/// The coefficients of a coarse edge's two ends for each other, the later's first, given the same
/// of the fine edges that it consists of.
fn coarse_edge<T: Scalar>(mut edges: impl Iterator<Item = [T; 2]>, ratio: T) -> [T; 2] {
    let Some(first) = edges.next() else { return [T::zero(); 2] };
    // The mean by its distance from the first, so that equal coefficients stay what they are.
    let (mut count, mut sum) = (T::one(), [T::zero(); 2]);
    for edge in edges {
        count += T::one();
        sum = [sum[0] + (edge[0] - first[0]), sum[1] + (edge[1] - first[1])];
    }
    let [later, earlier] = [first[0] + sum[0] / count, first[1] + sum[1] / count];
    let two = T::one() + T::one();
    let diffusion = -(later + earlier) / two * ratio * ratio;
    let convection = (earlier - later) / two * ratio;
    let diffusion = if diffusion > T::zero() { diffusion.max(convection.abs()) } else { diffusion };
    [-diffusion - convection, convection - diffusion]
}
