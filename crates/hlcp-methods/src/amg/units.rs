//! The units of rows and unknowns, where somebody has chosen others than the matrix had.

use hlcp_core::{LinearOperator, Omega, Scalar};

use super::matrix::Matrix;
use crate::Clock;

/// Rows are weighted where more than the latter part of the columns lose more than the former of
/// their diagonal, and unknowns get other units where as many rows do.
const LOSS: [f64; 2] = [0.01, 0.1];

/// Factors of the rows with which what leaves an unknown arrives elsewhere, `wᵀA ≈ 0`, and units of
/// the unknowns in which a constant stays, `A v ≈ 0`: of the one of `A` and `B` that couples more.
///
/// Where the matrix was symmetric, `aᵢⱼ sⱼ = aⱼᵢ sᵢ` tells, along a tree of its couplings, what the
/// unit of a row is over that of its unknown. It is what a symmetric Gauss–Seidel pass starts from,
/// or the diagonal if that leaves less to be settled.
#[derive(Debug, Clone)]
pub(super) struct Units<T> {
    /// Unless all are 1.
    pub(super) rows: Option<Vec<T>>,
    /// Of x, z and r, unless all are 1.
    pub(super) unknowns: Option<[Vec<T>; 3]>,
}

impl<T: Scalar> Units<T> {
    /// Those of nobody's choice.
    pub(super) fn plain() -> Self {
        Self { rows: None, unknowns: None }
    }

    /// Finds them, and multiplies `a` and `b`, and the columns of the latter by Ω, too, where
    /// unknowns have some. None when the clock is up.
    pub(super) fn of(
        a: &mut Matrix<T>,
        b: &mut Matrix<T>,
        omega: &Omega<T>,
        clock: &mut Clock<'_>,
    ) -> Option<Self> {
        let of_b = b.entries() > a.entries();
        let couples = if of_b { &*b } else { &*a };
        let (d, n) = (&couples.diagonal, couples.order());
        let [by_rows, by_unknowns] = losses(couples);
        let by_omega = of_b && !matches!(omega, Omega::Uniform(_));
        if !by_rows && !by_unknowns && !by_omega {
            return Some(Self::plain());
        }
        let ratios = if by_rows || by_unknowns { symmetric(couples, clock)? } else { vec![] };
        let mut units = Self::plain();
        if by_rows {
            let by_diagonal = d.iter().map(|d| d.recip()).collect();
            let of = |(&s, &d): (&T, &T)| if by_unknowns { (s * d).sqrt() } else { s };
            let by_tree = ratios.iter().zip(d).map(|pair| of(pair).recip()).collect();
            let columns = couples.transpose(clock)?;
            units.rows = Some(levelled(d, |j| columns.off(j), [by_tree, by_diagonal], clock)?);
        }
        let weighted = |d: &[T]| -> Vec<T> {
            (0..n).map(|i| (factor(units.rows.as_deref(), i) * d[i]).recip()).collect()
        };
        if by_unknowns {
            let by_diagonal = weighted(d);
            let by_tree = if by_rows { by_diagonal.clone() } else { ratios };
            let own = levelled(d, |i| couples.off(i), [by_tree, by_diagonal], clock)?;
            let omega = |i: usize| omega.entry(i);
            units.unknowns = Some(if of_b {
                let of_x = (0..n).map(|i| own[i] / omega(i)).collect();
                [of_x, weighted(&a.diagonal), own]
            } else {
                [own.clone(), own, weighted(&b.diagonal)]
            });
        } else if by_omega {
            // The columns of B as they are, and those of A in the same unit of x.
            let of_x: Vec<T> = (0..n).map(|i| omega.entry(i).recip()).collect();
            units.unknowns = Some([of_x.clone(), of_x, vec![T::one(); n]]);
        }
        for matrix in [&mut *a, &mut *b] {
            units.rows.iter().for_each(|rows| matrix.scale_rows(rows));
        }
        if let Some([of_x, ..]) = &units.unknowns {
            a.scale_columns(of_x);
            let of_x: Vec<T> = (0..n).map(|i| of_x[i] * omega.entry(i)).collect();
            b.scale_columns(&of_x);
        }
        Some(units)
    }

    /// The factor of row `i`.
    pub(super) fn row(&self, i: usize) -> T {
        factor(self.rows.as_deref(), i)
    }

    /// The unit of `xᵢ`.
    pub(super) fn x(&self, i: usize) -> T {
        factor(self.unknowns.as_ref().map(|[of_x, ..]| &of_x[..]), i)
    }
}

fn factor<T: Scalar>(of: Option<&[T]>, i: usize) -> T {
    of.map_or(T::one(), |of| of[i])
}

/// Returns whether more than a tenth of the columns, and of the rows, add up to less than nothing
/// by a hundredth and more of their diagonal.
fn losses<T: Scalar>(matrix: &Matrix<T>) -> [bool; 2] {
    let mut sums = [matrix.diagonal.clone(), matrix.diagonal.clone()];
    for i in 0..matrix.order() {
        for (j, a) in matrix.off(i) {
            sums[0][j] += a;
            sums[1][i] += a;
        }
    }
    sums.map(|sums| {
        let pairs = sums.iter().zip(&matrix.diagonal);
        let short = pairs.filter(|&(&sum, &d)| sum < T::of(-LOSS[0]) * d).count();
        short as f64 > LOSS[1] * sums.len() as f64
    })
}

/// Returns `s` with `aᵢⱼ sⱼ = aⱼᵢ sᵢ` along a tree of couplings both ways, the diagonal's entry at
/// one unknown of those that hang together. Nothing when the clock is up.
fn symmetric<T: Scalar>(matrix: &Matrix<T>, clock: &mut Clock<'_>) -> Option<Vec<T>> {
    let n = matrix.order();
    let (mut s, back) = (vec![T::zero(); n], matrix.across(&matrix.values, clock)?);
    let (mut done, mut reached) = (0, vec![]);
    for root in 0..n {
        if s[root] == T::zero() {
            s[root] = matrix.diagonal[root];
            reached.push(root);
        }
        while let Some(i) = reached.pop() {
            if clock.is_up_at(done) {
                return None;
            }
            done += 1;
            for (at, j) in matrix.places(i) {
                let of_j = s[i] * back[at] / matrix.values[at];
                if s[j] == T::zero() && of_j.is_normal() && of_j > T::zero() {
                    s[j] = of_j;
                    reached.push(j);
                }
            }
        }
    }
    Some(s)
}

/// Returns what a symmetric Gauss–Seidel pass makes of the better of two starts, by the lines of a
/// matrix with this diagonal: its columns or its rows. None when the clock is up.
fn levelled<T: Scalar, L: Iterator<Item = (usize, T)>>(
    diagonal: &[T],
    line: impl Fn(usize) -> L,
    starts: [Vec<T>; 2],
    clock: &mut Clock<'_>,
) -> Option<Vec<T>> {
    let n = diagonal.len();
    let settled = |factors: &[T], j: usize| {
        let arrives = line(j).fold(T::zero(), |sum, (i, a)| sum - a * factors[i]);
        let factor = arrives / diagonal[j];
        // A line without a counterpart, or with positive entries, keeps what it has.
        if factor > T::zero() && factor.is_finite() { factor } else { factors[j] }
    };
    // What is left to be settled, by the part of a factor, at most all of it.
    let [one, other] = starts.each_ref().map(|factors| {
        let part = |j: usize| (settled(factors, j) / factors[j] - T::one()).abs().min(T::one());
        (0..n).fold(T::zero(), |sum, j| sum + part(j))
    });
    let [mut factors, by_other] = starts;
    if other < one {
        factors = by_other;
    }
    for (k, j) in (0..n).chain((0..n).rev()).enumerate() {
        if clock.is_up_at(k) {
            return None;
        }
        factors[j] = settled(&factors, j);
    }
    Some(factors)
}

#[cfg(test)]
mod tests {
    use proptest::{collection::vec, prelude::*};

    use super::*;

    /// The largest over the smallest product of two lists of factors.
    fn spread(one: &[f64], other: &[f64]) -> f64 {
        let products = || one.iter().zip(other).map(|(one, other)| one * other);
        products().fold(0.0, f64::max) / products().fold(f64::INFINITY, f64::min)
    }

    proptest! {
        /// Conductors between unknowns that all hang together, and next to nothing to earth: rows
        /// add up to `earth` times what passes in each of the two ways, so that a pass over n rows
        /// keeps factors to within `n earth`.
        #[test]
        fn a_symmetric_matrix_gets_back_the_units_that_it_had(
            bonds in (8..30_usize).prop_flat_map(|n| vec((0..n, -3.0..3.0_f64), n - 1)),
            (r, c) in (vec(-6.0..6.0_f64, 30), vec(-3.0..3.0_f64, 30)),
            (by_rows, by_unknowns) in any::<(bool, bool)>(),
        ) {
            let (earth, n) = (1e-9, bonds.len() + 1);
            let mut dense = vec![vec![0.0; n]; n];
            for (k, (to, bond)) in bonds.iter().enumerate() {
                let (i, j, bond) = (k + 1, to % (k + 1), 10_f64.powf(*bond));
                for (i, j) in [(i, j), (j, i)] {
                    dense[i][j] -= bond;
                    dense[i][i] += bond * (1.0 + earth);
                }
            }
            let of = |powers: &[f64], used: bool| -> Vec<f64> {
                powers[..n].iter().map(|p| if used { 10_f64.powf(*p) } else { 1.0 }).collect()
            };
            let (r, c) = (of(&r, by_rows), of(&c, by_unknowns));
            let clock = &mut Clock::endless();
            let mut matrices = [true, false].map(|couples| {
                let rows = Matrix::by_rows([n, n], clock, |i, row| {
                    let columns = (0..n).filter(|&j| j == i || couples && dense[i][j] != 0.0);
                    let entry = |j: usize| if couples { dense[i][j] * c[j] } else { 1.0 };
                    row.extend(columns.map(|j| (j as u32, r[i] * entry(j))));
                });
                rows.unwrap()
            });
            let [a, b] = &mut matrices;
            let units = Units::of(a, b, &Omega::Uniform(1.0), clock).unwrap();
            let close = 1.0 + 20.0 * n as f64 * earth + 1e-12 * n as f64;
            // What was not multiplied is left alone, and what is not noticed is no tenth of it.
            prop_assert!(by_rows || units.rows.is_none());
            prop_assert!(by_unknowns || units.unknowns.is_none());
            match (units.rows, units.unknowns) {
                (Some(rows), None) if !by_unknowns => prop_assert!(spread(&rows, &r) <= close),
                (None, Some([x, z, _])) if !by_rows => {
                    prop_assert!(x == z && spread(&x, &c) <= close);
                }
                // Of both, the tree tells one from the other, and passes only level what is left.
                (Some(rows), Some([x, ..])) => {
                    let level: Vec<f64> = (0..n).map(|i| 1.0 / dense[i][i].sqrt()).collect();
                    prop_assert!(spread(&rows, &r) <= spread(&level, &vec![1.0; n]) * close);
                    prop_assert!(x.iter().all(|x| x.is_normal() && *x > 0.0));
                }
                _ => {}
            }
        }
    }
}
