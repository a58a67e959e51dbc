//! The spectral radius of a non-negative matrix between two checked numbers, and the vector that
//! proves it.

use hlcp_methods::Clock;

use crate::{
    rounding::{Doubled, div_down, div_up, mul_up},
    sparse::Sparse,
};

/// Returns whether all are positive and finite.
pub(crate) fn positive(v: &[f64]) -> bool {
    v.iter().all(|&v| v > 0.0 && v.is_finite())
}

/// One or several matrices `Z_k = D_k − G_k` by rows, with diagonal `D_k` and `G_k ≥ 0`.
///
/// `D` is not more and `G` not less than the exact entry, so `Z_k` is a bound from below and what
/// holds for it holds for the exact one: `Z_k d > 0` does. `G` may have diagonal entries. What is
/// said of a spectral radius is that of the first.
pub(crate) trait Comparison {
    fn order(&self) -> usize;

    /// Replaces `g` by row `i` of `G_k`, and returns the entry of `D_k`.
    fn row(&self, k: usize, i: usize, g: &mut Vec<(usize, f64)>) -> f64;
}

/// A relative error that no entry of the comparison matrices with lower brackets exceeds,
/// underflow apart.
const ENTRIES: f64 = 16.0 * f64::EPSILON;

/// Twice what underflow adds to such an entry or takes from it, or more.
const SMALL: f64 = 16.0 * f64::from_bits(1);

/// A Collatz–Wielandt bracket: `lower ≤ ρ(D⁻¹G) ≤ upper`.
///
/// For any `x > 0`, `minᵢ (Gx)ᵢ/(Dx)ᵢ ≤ ρ(D⁻¹G) ≤ maxᵢ (Gx)ᵢ/(Dx)ᵢ`. Both ends are rounded outward,
/// so they hold for real numbers, however `x` was found.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp};
/// use hlcp_verify::alpha_bound;
///
/// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
/// let bracket = alpha_bound(&problem); // of the rows (4, 1) and (1, 4), over 8: 5/8
/// assert!(
///     bracket.lower <= 0.625 && 0.625 <= bracket.upper && bracket.upper - bracket.lower < 1e-6
/// );
/// let [lower, upper] = bracket.reciprocal();
/// assert!(lower <= 1.6 && 1.6 <= upper);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Bracket {
    /// Not more than the spectral radius.
    pub lower: f64,
    /// Not less than the spectral radius.
    pub upper: f64,
    /// The trial vector of the upper end, positive; below 1, `upper` makes it a witness:
    /// `(D − G)x > 0`.
    pub vector: Vec<f64>,
}

impl Bracket {
    /// The two ends of 1/ρ.
    pub fn reciprocal(&self) -> [f64; 2] {
        [div_down(1.0, self.upper).max(0.0), div_up(1.0, self.lower)]
    }
}

/// Row `i`'s quotient `(Gx)ᵢ/(Dx)ᵢ`, from below and from above.
fn quotient(z: &impl Comparison, i: usize, x: &[f64], g: &mut Vec<(usize, f64)>) -> [f64; 2] {
    let d = z.row(0, i, g);
    let (mut sum, mut total) = (Doubled::default(), 0.0);
    g.iter().for_each(|&(j, g)| {
        sum.add(g, x[j]);
        total += x[j];
    });
    let (gx, dx) = (sum.interval(), d * x[i]);
    let upper = if dx > 0.0 { div_up(gx.upper, dx.next_down()) } else { f64::INFINITY };
    let over = (dx.next_up() + mul_up(SMALL, x[i])).next_up();
    let lower = (gx.lower - mul_up(SMALL, total)).next_down();
    let lower = div_down(lower, over) * (1.0 - 4.0 * ENTRIES);
    // The largest number stands for all beyond it.
    let lower = if d < f64::MAX && lower > 0.0 { lower } else { 0.0 };
    [lower, if upper.is_nan() { f64::INFINITY } else { upper }]
}

/// The bracket of a positive vector, from one product; from 0 to ∞ when the clock is up.
fn bracket(z: &impl Comparison, vector: Vec<f64>, clock: &mut Clock<'_>) -> Bracket {
    let mut g = vec![];
    let (mut lower, mut upper) = (f64::INFINITY, 0.0_f64);
    for i in 0..vector.len() {
        if clock.is_up_at(i) {
            return Bracket { lower: 0.0, upper: f64::INFINITY, vector };
        }
        let row = quotient(z, i, &vector, &mut g);
        (lower, upper) = (lower.min(row[0]), upper.max(row[1]));
    }
    Bracket { lower, upper, vector }
}

/// Narrows the bracket by Noda's iteration `(ρ̄D − G) x⁺ = Dx`, where `ρ̄` is the upper end, from
/// `x = e`.
///
/// The matrix is a nonsingular M-matrix as long as `ρ̄` is too large, so `x` stays positive; `ρ̄`
/// falls quadratically. The start is the balanced vector where that is better. Ends when the
/// bracket is `enough` or no longer falls, or when the clock is up.
pub(crate) fn noda(
    z: &impl Comparison,
    enough: impl Fn(&Bracket) -> bool,
    clock: &mut Clock<'_>,
) -> Bracket {
    let mut best = bracket(z, vec![1.0; z.order()], clock);
    if !enough(&best)
        && let Some(vector) = balanced(z, clock)
    {
        let other = bracket(z, vector, clock);
        if other.upper < best.upper {
            best = other;
        }
    }
    let mut idle = 0;
    for _ in 0..40 {
        if enough(&best) || !best.upper.is_finite() || idle == 3 || clock.is_up() {
            break;
        }
        let Some(vector) = improved(z, &best, clock) else { break };
        let next = bracket(z, vector, clock);
        if next.upper.is_infinite() {
            break;
        }
        idle += usize::from(next.upper >= best.upper);
        let lower = best.lower.max(next.lower);
        best = if next.upper <= best.upper { next } else { best };
        best.lower = lower;
    }
    best
}

/// The `x` for which `gᵢⱼxⱼ/xᵢ = gⱼᵢxᵢ/xⱼ` along a spanning forest: the symmetrising scaling where
/// there is one.
///
/// A convection spreads the Perron vector over hundreds of orders of magnitude, which the iteration
/// would be long to find. `None` where doubles do not reach that far, or when the clock is up.
fn balanced(z: &impl Comparison, clock: &mut Clock<'_>) -> Option<Vec<f64>> {
    let (mut row, mut other, mut met) = (vec![], vec![], 0);
    let mut logarithm = vec![f64::NAN; z.order()];
    let mut stack = vec![];
    for root in 0..z.order() {
        if logarithm[root].is_nan() {
            logarithm[root] = 0.0;
            stack.push(root);
        }
        while let Some(i) = stack.pop() {
            if clock.is_up_at(met) {
                return None;
            }
            met += 1;
            z.row(0, i, &mut row);
            for &(j, forth) in &row {
                if logarithm[j].is_nan() {
                    z.row(0, j, &mut other);
                    let back = other.iter().find(|entry| entry.0 == i).map_or(0.0, |entry| entry.1);
                    if forth > 0.0 && back > 0.0 {
                        logarithm[j] = logarithm[i] + 0.5 * (back.log2() - forth.log2());
                        // Each node is pushed once: NaN would mark it as not met yet.
                        if !logarithm[j].is_finite() {
                            return None;
                        }
                        stack.push(j);
                    }
                }
            }
        }
    }
    let largest = logarithm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = logarithm.iter().copied().fold(f64::INFINITY, f64::min);
    let middle = 0.5 * (largest + smallest);
    (largest - smallest < 1900.0)
        .then(|| logarithm.into_iter().map(|l| (l - middle).exp2()).collect())
}

/// A better trial vector, if there is one and the time to find it.
fn improved(z: &impl Comparison, best: &Bracket, clock: &mut Clock<'_>) -> Option<Vec<f64>> {
    let shift = best.upper * (1.0 + 8.0 * f64::EPSILON);
    let matrix = scaled(z, |_| 0, &best.vector, shift, clock)?;
    let factor = matrix.solve(1.0, 1e-5, clock);
    let largest = factor.iter().copied().fold(0.0, f64::max);
    let vector: Vec<f64> = best.vector.iter().zip(factor).map(|(x, c)| x * (c / largest)).collect();
    positive(&vector).then_some(vector)
}

/// `D⁻¹X⁻¹(sD − G)X` for `X = diag(x)`; `None` when the clock is up. Row `i` is that of the matrix
/// `of(i)`.
///
/// In these variables a good `x` is the vector of ones, which is what the aggregates of a multigrid
/// represent, rows have one size, and a row sum is non-negative as soon as `s` is an
/// upper end for `x`.
pub(crate) fn scaled(
    z: &impl Comparison,
    of: impl Fn(usize) -> usize,
    x: &[f64],
    shift: f64,
    clock: &mut Clock<'_>,
) -> Option<Sparse> {
    let (mut matrix, mut g) = (Sparse::default(), vec![]);
    for i in 0..z.order() {
        if clock.is_up_at(i) {
            return None;
        }
        let d = z.row(of(i), i, &mut g);
        let loops: f64 = g.iter().filter(|g| g.0 == i).map(|g| g.1).sum();
        let off = g.iter().filter(|g| g.0 != i).map(|&(j, g)| (j, -(g / d * (x[j] / x[i]))));
        // A pivot that vanishes by rounding would divide.
        matrix.push([(i, (shift - loops / d).max(f64::EPSILON))].into_iter().chain(off));
    }
    Some(matrix)
}
