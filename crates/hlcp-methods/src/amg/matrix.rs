//! Assembled rows with 32-bit columns, split at the diagonal so that half a sweep walks half a
//! matrix.

use std::ops::Range;

use hlcp_core::{Diagonal, LinearOperator, Rows, Scalar};

use crate::Clock;

/// No aggregate: an unknown that the sweeps alone settle.
pub(super) const NONE: u32 = u32::MAX;

/// A square matrix by rows, each with what is left of the diagonal first.
#[derive(Debug, Clone)]
pub(super) struct Matrix<T> {
    pub(super) diagonal: Vec<T>,
    /// The reciprocals of the diagonal; 0 where it is no pivot, and an unknown stays as it is.
    inverse: Vec<T>,
    starts: Vec<u32>,
    middles: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<T>,
    /// How far right of the diagonal entries are, at most.
    reach: usize,
}

impl<T: Scalar> Matrix<T> {
    pub(super) fn with_capacity(n: usize, entries: usize) -> Self {
        let mut starts = Vec::with_capacity(n + 1);
        starts.push(0);
        Self {
            diagonal: Vec::with_capacity(n),
            inverse: Vec::with_capacity(n),
            starts,
            middles: Vec::with_capacity(n),
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
            reach: 0,
        }
    }

    /// The rows of an operator. None when the clock is up, as of all that follows.
    pub(super) fn of(operator: &impl Rows<T>, clock: &mut Clock<'_>) -> Option<Self> {
        let n = operator.order();
        let mut matrix = Self::with_capacity(n, 4 * n);
        let mut row: Vec<(u32, T)> = vec![];
        for i in 0..n {
            if clock.is_up_at(i) {
                return None;
            }
            row.clear();
            operator.visit_row(i, &mut |j, a| row.push((j as u32, a)));
            matrix.push(&row);
        }
        Some(matrix)
    }

    /// Appends the next row, no column of which comes twice.
    pub(super) fn push(&mut self, row: &[(u32, T)]) {
        let i = self.order() as u32;
        let mut diagonal = T::zero();
        for &(j, a) in row.iter().filter(|entry| entry.0 <= i) {
            if j == i {
                diagonal = a;
            } else {
                self.columns.push(j);
                self.values.push(a);
            }
        }
        self.middles.push(self.columns.len() as u32);
        for &(j, a) in row.iter().filter(|entry| entry.0 > i) {
            self.columns.push(j);
            self.values.push(a);
            self.reach = self.reach.max((j - i) as usize);
        }
        self.starts.push(self.columns.len() as u32);
        self.diagonal.push(diagonal);
        self.inverse.push(pivot(diagonal));
    }

    pub(super) fn order(&self) -> usize {
        self.diagonal.len()
    }

    /// The entries that are stored, the diagonal's included.
    pub(super) fn entries(&self) -> usize {
        self.columns.len() + self.order()
    }

    #[inline(always)]
    fn range(&self, range: Range<u32>) -> impl Iterator<Item = (usize, T)> + '_ {
        let range = range.start as usize..range.end as usize;
        let columns = self.columns[range.clone()].iter();
        columns.zip(&self.values[range]).map(|(&j, &a)| (j as usize, a))
    }

    /// The entries of row `i` beside the diagonal.
    pub(super) fn off(&self, i: usize) -> impl Iterator<Item = (usize, T)> + '_ {
        self.range(self.starts[i]..self.starts[i + 1])
    }

    /// As [`off`](Self::off), to be overwritten.
    pub(super) fn off_mut(&mut self, i: usize) -> impl Iterator<Item = (usize, &mut T)> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        let columns = self.columns[range.clone()].iter();
        columns.zip(&mut self.values[range]).map(|(&j, a)| (j as usize, a))
    }

    #[inline(always)]
    fn lower(&self, i: usize, y: &[T]) -> T {
        self.range(self.starts[i]..self.middles[i]).fold(T::zero(), |sum, (j, a)| sum + a * y[j])
    }

    #[inline(always)]
    fn upper(&self, i: usize, y: &[T]) -> T {
        self.range(self.middles[i]..self.starts[i + 1])
            .fold(T::zero(), |sum, (j, a)| sum + a * y[j])
    }

    /// Overwrites `y` with a forward Gauss–Seidel sweep from 0, and shows the residual of each row,
    /// as soon as the sweep is beyond its columns; overwrites `rest` with the part of it on and
    /// left of the diagonal: 0 but for rounding and for rows without a pivot.
    pub(super) fn sweep_from_zero(
        &self,
        rhs: &[T],
        y: &mut [T],
        rest: &mut [T],
        mut show: impl FnMut(usize, T),
    ) {
        for k in 0..self.order() + self.reach {
            if k < self.order() {
                let known = rhs[k] - self.lower(k, y);
                y[k] = known * self.inverse[k];
                rest[k] = known - self.diagonal[k] * y[k];
            }
            if let Some(i) = k.checked_sub(self.reach) {
                show(i, rest[i] - self.upper(i, y));
            }
        }
    }

    /// Sweeps `y` forward, and overwrites `product` with the matrix times the new `y`.
    pub(super) fn sweep(&self, rhs: &[T], y: &mut [T], product: &mut [T]) {
        for k in 0..self.order() + self.reach {
            if k < self.order() {
                let lower = self.lower(k, y);
                let known = rhs[k] - self.upper(k, y) - lower;
                if self.inverse[k] != T::zero() {
                    y[k] = known * self.inverse[k];
                }
                product[k] = lower + self.diagonal[k] * y[k];
            }
            if let Some(i) = k.checked_sub(self.reach) {
                product[i] += self.upper(i, y);
            }
        }
    }

    /// Overwrites `product` with the matrix times `y`.
    pub(super) fn product(&self, y: &[T], product: &mut [T]) {
        for (i, product) in product.iter_mut().enumerate() {
            *product = self.lower(i, y) + self.diagonal[i] * y[i] + self.upper(i, y);
        }
    }

    /// Relaxes the equation `row i of this matrix times v = 0`.
    pub(super) fn relax_homogeneous(&self, i: usize, v: &mut [T]) {
        v[i] = -(self.lower(i, v) + self.upper(i, v)) * self.inverse[i];
    }

    /// Multiplies row `i` by `scale[i]`, for all `i`.
    pub(super) fn scale_rows(&mut self, scale: &[T]) {
        for (i, &scale) in scale.iter().enumerate() {
            self.off_mut(i).for_each(|(_, a)| *a *= scale);
            self.diagonal[i] *= scale;
            self.inverse[i] = pivot(self.diagonal[i]);
        }
    }

    /// Multiplies column `j` by `scale[j]`, for all `j`.
    pub(super) fn scale_columns(&mut self, scale: &[T]) {
        for (&j, a) in self.columns.iter().zip(&mut self.values) {
            *a *= scale[j as usize];
        }
        for (i, &scale) in scale.iter().enumerate() {
            self.diagonal[i] *= scale;
            self.inverse[i] = pivot(self.diagonal[i]);
        }
    }

    /// Returns the columns' entries beside the diagonal: the rows of the transpose.
    pub(super) fn transpose(&self, clock: &mut Clock<'_>) -> Option<Groups<(u32, T)>> {
        let entries = |i: usize| self.off(i).map(move |(j, a)| (j, (i as u32, a)));
        Groups::new(self.order(), (0..self.order()).map(entries), clock)
    }

    /// The sums of the entries over pairs of `count` aggregates, `PᵀAP`; what is in no aggregate is
    /// left out.
    pub(super) fn aggregated(
        &self,
        aggregate: &[u32],
        count: usize,
        clock: &mut Clock<'_>,
    ) -> Option<Self> {
        let members = members(aggregate, count);
        let mut coarse = Self::with_capacity(count, self.columns.len() / 2);
        let mut place = vec![usize::MAX; count];
        let mut row: Vec<(u32, T)> = Vec::new();
        for a in 0..count {
            if clock.is_up_at(a) {
                return None;
            }
            row.clear();
            let mut add = |to: u32, value: T| {
                // A place of an earlier row holds another column now, or lies beyond.
                let at = &mut place[to as usize];
                match row.get_mut(*at).filter(|entry| entry.0 == to) {
                    Some(entry) => entry.1 += value,
                    None => {
                        *at = row.len();
                        row.push((to, value));
                    }
                }
            };
            for i in members.of(a).iter().map(|&i| i as usize) {
                add(a as u32, self.diagonal[i]);
                for (j, value) in self.off(i).filter(|&(j, _)| aggregate[j] != NONE) {
                    add(aggregate[j], value);
                }
            }
            row.sort_unstable_by_key(|entry| entry.0);
            coarse.push(&row);
        }
        Some(coarse)
    }
}

/// Things in groups, those of a group in the order in which they came.
#[derive(Debug)]
pub(super) struct Groups<V> {
    starts: Vec<usize>,
    things: Vec<V>,
}

impl<V: Copy> Groups<V> {
    /// Sorts rows of things, each with its group, into `count` groups. None when the clock is up.
    pub(super) fn new<R: Iterator<Item = (usize, V)>>(
        count: usize,
        rows: impl Iterator<Item = R> + Clone,
        clock: &mut Clock<'_>,
    ) -> Option<Self> {
        let mut starts = vec![0; count + 1];
        rows.clone().flatten().for_each(|(group, _)| starts[group + 1] += 1);
        (0..count).for_each(|group| starts[group + 1] += starts[group]);
        let first = rows.clone().flatten().next();
        let mut things = first.map_or(vec![], |(_, thing)| vec![thing; starts[count]]);
        let mut next = starts.clone();
        for (i, row) in rows.enumerate() {
            if clock.is_up_at(i) {
                return None;
            }
            for (group, thing) in row {
                things[next[group]] = thing;
                next[group] += 1;
            }
        }
        Some(Self { starts, things })
    }

    /// Returns the things of a group.
    pub(super) fn of(&self, group: usize) -> &[V] {
        &self.things[self.starts[group]..self.starts[group + 1]]
    }
}

/// Returns the members of `count` aggregates.
pub(super) fn members(aggregate: &[u32], count: usize) -> Groups<u32> {
    let row = |(i, &a): (usize, &u32)| (a != NONE).then_some((a as usize, i as u32)).into_iter();
    let rows = aggregate.iter().enumerate().map(row);
    Groups::new(count, rows, &mut Clock::endless()).expect("a clock that is never up")
}

impl<T: Scalar> LinearOperator<T> for Matrix<T> {
    fn order(&self) -> usize {
        self.diagonal.len()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.product(x, y);
    }
}

impl<T: Scalar> Diagonal<T> for Matrix<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.diagonal[i]
    }
}

impl<T: Scalar> Rows<T> for Matrix<T> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        self.range(self.starts[i]..self.middles[i]).for_each(|(j, a)| visit(j, a));
        visit(i, self.diagonal[i]);
        self.range(self.middles[i]..self.starts[i + 1]).for_each(|(j, a)| visit(j, a));
    }
}

/// Returns the reciprocal of a diagonal entry, or 0 where there is none.
fn pivot<T: Scalar>(diagonal: T) -> T {
    let inverse = diagonal.recip();
    if inverse.is_finite() && diagonal.is_finite() { inverse } else { T::zero() }
}

/// A dense LU factorisation with partial pivoting.
#[derive(Debug, Clone)]
pub(crate) struct Lu<T> {
    n: usize,
    factors: Vec<T>,
    rows: Vec<usize>,
}

impl<T: Scalar> Lu<T> {
    /// Room for a matrix of order `n`.
    pub(crate) fn zeros(n: usize) -> Self {
        Self { n, factors: vec![T::zero(); n * n], rows: (0..n).collect() }
    }

    /// The factors of a matrix.
    pub(super) fn of(matrix: &Matrix<T>) -> Self {
        let mut lu = Self::zeros(matrix.order());
        lu.factorise(|i, each| {
            each(i, matrix.diagonal[i]);
            matrix.off(i).for_each(|(j, a)| each(j, a));
        });
        lu
    }

    /// Factorises the matrix whose entries `row(i, each)` calls `each` with, for each `i`; what
    /// comes for one place is summed.
    pub(crate) fn factorise(&mut self, mut row: impl FnMut(usize, &mut dyn FnMut(usize, T))) {
        let Self { n, factors, rows } = self;
        let n = *n;
        factors.fill(T::zero());
        // Of order 0 where all unknowns are apart.
        let lines = factors.chunks_exact_mut(n.max(1));
        for (i, (own, line)) in rows.iter_mut().zip(lines).enumerate() {
            *own = i;
            row(i, &mut |j, a| line[j] += a);
        }
        // A pivot that is lost in the rounding of the matrix is none.
        let size = factors.iter().fold(T::zero(), |max, a| max.max(a.abs()));
        let least = size * T::epsilon();
        for k in 0..n {
            let at = |i: &usize| factors[i * n + k].abs();
            let best = (k..n).fold(k, |best, i| if at(&i) > at(&best) { i } else { best });
            if best != k {
                rows.swap(k, best);
                for j in 0..n {
                    factors.swap(k * n + j, best * n + j);
                }
            }
            let diagonal = factors[k * n + k];
            // Stored as its reciprocal; 0 leaves the unknown at 0.
            let inverse = if diagonal.abs() > least { pivot(diagonal) } else { T::zero() };
            factors[k * n + k] = inverse;
            let (above, below) = factors.split_at_mut((k + 1) * n);
            let above = &above[k * n..];
            for row in below.chunks_exact_mut(n) {
                let factor = row[k] * inverse;
                row[k] = factor;
                if factor != T::zero() {
                    for j in k + 1..n {
                        row[j] -= factor * above[j];
                    }
                }
            }
        }
    }

    /// Overwrites `y` with the solution for `rhs`.
    pub(crate) fn solve(&self, rhs: &[T], y: &mut [T]) {
        let n = self.n;
        for i in 0..n {
            let row = &self.factors[i * n..i * n + i];
            let known = rhs[self.rows[i]];
            y[i] = row.iter().zip(&*y).fold(known, |sum, (&l, &y)| sum - l * y);
        }
        for i in (0..n).rev() {
            let row = &self.factors[i * n..(i + 1) * n];
            let known =
                row[i + 1..].iter().zip(&y[i + 1..]).fold(y[i], |sum, (&u, &y)| sum - u * y);
            y[i] = known * row[i];
        }
    }
}
