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
    pub(super) values: Vec<T>,
    /// How far right of the diagonal entries are, at most.
    reach: usize,
}

impl<T: Scalar> Matrix<T> {
    /// The `n` rows that `fill(i, row)` writes to an empty list each, with no column twice, and
    /// room for `entries` beside the diagonal. None when the clock is up, as of all that follows.
    pub(super) fn by_rows(
        [n, entries]: [usize; 2],
        clock: &mut Clock<'_>,
        mut fill: impl FnMut(usize, &mut Vec<(u32, T)>),
    ) -> Option<Self> {
        let mut starts = Vec::with_capacity(n + 1);
        starts.push(0);
        let mut matrix = Self {
            diagonal: Vec::with_capacity(n),
            inverse: Vec::with_capacity(n),
            starts,
            middles: Vec::with_capacity(n),
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
            reach: 0,
        };
        let mut row = vec![];
        for i in 0..n {
            if clock.is_up_at(i) {
                return None;
            }
            row.clear();
            fill(i, &mut row);
            matrix.push(&row);
        }
        Some(matrix)
    }

    /// The rows of an operator.
    pub(super) fn of(operator: &impl Rows<T>, clock: &mut Clock<'_>) -> Option<Self> {
        let n = operator.order();
        Self::by_rows([n, 4 * n], clock, |i, row| {
            operator.visit_row(i, &mut |j, a| row.push((j as u32, a)));
        })
    }

    /// Appends the next row.
    fn push(&mut self, row: &[(u32, T)]) {
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

    /// Returns `known` less what is left of the diagonal in row `i` times `y`.
    #[inline(always)]
    fn less_lower(&self, known: T, i: usize, y: &[T]) -> T {
        self.range(self.starts[i]..self.middles[i]).fold(known, |rest, (j, a)| rest - a * y[j])
    }

    /// As [`less_lower`](Self::less_lower), right of the diagonal.
    #[inline(always)]
    fn less_upper(&self, known: T, i: usize, y: &[T]) -> T {
        self.range(self.middles[i]..self.starts[i + 1]).fold(known, |rest, (j, a)| rest - a * y[j])
    }

    /// Overwrites `y` with a forward Gauss–Seidel sweep from 0, and shows the residual of each row,
    /// as soon as the sweep is beyond its columns.
    pub(super) fn sweep_from_zero(&self, rhs: &[T], y: &mut [T], mut show: impl FnMut(usize, T)) {
        for k in 0..self.order() + self.reach {
            if k < self.order() {
                // Each waits for the one before, so nothing but its own product follows that.
                y[k] = self.less_lower(rhs[k], k, y) * self.inverse[k];
            }
            if let Some(i) = k.checked_sub(self.reach) {
                // A row with a pivot held once it was solved.
                let left = match self.inverse[i] == T::zero() {
                    true => self.less_lower(rhs[i], i, y),
                    false => T::zero(),
                };
                show(i, self.less_upper(left, i, y));
            }
        }
    }

    /// Adds `correction` to `y` and sweeps it forward; overwrites `product` with the matrix times
    /// the new `y`.
    pub(super) fn sweep(
        &self,
        rhs: &[T],
        y: &mut [T],
        product: &mut [T],
        correction: impl Fn(usize) -> T,
    ) {
        let (n, reach) = (self.order(), self.reach);
        (0..n.min(reach)).for_each(|j| y[j] += correction(j));
        for k in 0..n + reach {
            if k + reach < n {
                y[k + reach] += correction(k + reach);
            }
            if k < n {
                let known = self.less_upper(rhs[k], k, y);
                let rest = self.less_lower(known, k, y);
                // A row with a pivot holds once it is solved.
                product[k] = if self.inverse[k] == T::zero() {
                    known - rest + self.diagonal[k] * y[k]
                } else {
                    y[k] = rest * self.inverse[k];
                    known
                };
            }
            if let Some(i) = k.checked_sub(reach) {
                product[i] -= self.less_upper(T::zero(), i, y);
            }
        }
    }

    /// Relaxes the equation `row i of this matrix times v = 0`.
    pub(super) fn relax_homogeneous(&self, i: usize, v: &mut [T]) {
        v[i] = self.less_upper(self.less_lower(T::zero(), i, v), i, v) * self.inverse[i];
    }

    /// Multiplies row `i` by `scale[i]`, for all `i`.
    pub(super) fn scale_rows(&mut self, scale: &[T]) {
        for (i, &scale) in scale.iter().enumerate() {
            let row = self.row(i);
            self.values[row].iter_mut().for_each(|a| *a *= scale);
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

    /// The places of the entries of row `i` beside the diagonal.
    pub(super) fn row(&self, i: usize) -> Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// As [`row`](Self::row), each with its column.
    pub(super) fn places(&self, i: usize) -> impl Iterator<Item = (usize, usize)> {
        self.row(i).map(|at| (at, self.columns[at] as usize))
    }

    /// Returns, at the place of each entry beside the diagonal, the one of `values` at the place
    /// across the diagonal, 0 where the matrix has no entry there. Rows must be in order.
    pub(super) fn across(&self, values: &[T], clock: &mut Clock<'_>) -> Option<Vec<T>> {
        let mut across = Vec::with_capacity(values.len());
        // As i grows, so does the place in row j where column i is, or would be.
        let mut next = self.starts.clone();
        for i in 0..self.order() {
            if clock.is_up_at(i) {
                return None;
            }
            for (_, j) in self.places(i) {
                let (next, end) = (&mut next[j], self.starts[j + 1]);
                while *next < end && (self.columns[*next as usize] as usize) < i {
                    *next += 1;
                }
                let found = *next < end && self.columns[*next as usize] as usize == i;
                across.push(if found { values[*next as usize] } else { T::zero() });
            }
        }
        Some(across)
    }

    /// Halves the part of each coupling that it has in common with the one across the diagonal, at
    /// equal sums of rows and columns. Rows must be in order. None when the clock is up.
    pub(super) fn halve_conduction(mut self, clock: &mut Clock<'_>) -> Option<Self> {
        let across = self.across(&self.values, clock)?;
        for i in 0..self.order() {
            for at in self.row(i) {
                let (a, across) = (self.values[at], across[at]);
                let common = if a.abs() < across.abs() { a } else { across };
                if (a > T::zero()) == (across > T::zero()) {
                    self.values[at] -= T::of(0.5) * common;
                    self.diagonal[i] += T::of(0.5) * common;
                }
            }
            self.inverse[i] = pivot(self.diagonal[i]);
        }
        Some(self)
    }

    /// Returns the transpose, whose rows are in order.
    pub(super) fn transpose(&self, clock: &mut Clock<'_>) -> Option<Self> {
        let n = self.order();
        let (mut starts, mut lower) = (vec![0; n + 1], vec![0; n]);
        for i in 0..n {
            for (j, _) in self.off(i) {
                starts[j + 1] += 1;
                lower[j] += u32::from(i < j);
            }
        }
        (0..n).for_each(|j| starts[j + 1] += starts[j]);
        let middles = starts.iter().zip(lower).map(|(start, lower)| start + lower).collect();
        let mut next = starts.clone();
        let (mut columns, mut reach) = (vec![0; self.columns.len()], 0);
        let mut values = vec![T::zero(); self.columns.len()];
        for i in 0..n {
            if clock.is_up_at(i) {
                return None;
            }
            for (j, a) in self.off(i) {
                let at = next[j] as usize;
                (columns[at], values[at]) = (i as u32, a);
                next[j] += 1;
                reach = reach.max(i.saturating_sub(j));
            }
        }
        let (diagonal, inverse) = (self.diagonal.clone(), self.inverse.clone());
        Some(Self { diagonal, inverse, starts, middles, columns, values, reach })
    }

    /// The sums of the entries over pairs of `count` aggregates, `PᵀAP`; what is in no aggregate is
    /// left out.
    pub(super) fn aggregated(
        &self,
        aggregate: &[u32],
        count: usize,
        clock: &mut Clock<'_>,
    ) -> Option<Self> {
        let members = Members::new(aggregate, count);
        let mut place = vec![usize::MAX; count];
        Self::by_rows([count, self.columns.len() / 2], clock, |a, row| {
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
        })
    }
}

/// The members of aggregates, in order.
#[derive(Debug)]
pub(super) struct Members {
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Members {
    /// Sorts what is in one of `count` aggregates by them.
    pub(super) fn new(aggregate: &[u32], count: usize) -> Self {
        let joined = || aggregate.iter().enumerate().filter(|(_, to)| **to != NONE);
        let mut starts = vec![0; count + 1];
        joined().for_each(|(_, &to)| starts[to as usize + 1] += 1);
        (0..count).for_each(|to| starts[to + 1] += starts[to]);
        let (mut next, mut members) = (starts.clone(), vec![0; starts[count] as usize]);
        for (i, &to) in joined() {
            let next = &mut next[to as usize];
            members[*next as usize] = i as u32;
            *next += 1;
        }
        Self { starts, members }
    }

    /// Returns the members of an aggregate.
    pub(super) fn of(&self, aggregate: usize) -> &[u32] {
        &self.members[self.starts[aggregate] as usize..self.starts[aggregate + 1] as usize]
    }
}

impl<T: Scalar> LinearOperator<T> for Matrix<T> {
    fn order(&self) -> usize {
        self.diagonal.len()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        for (i, y) in y.iter_mut().enumerate() {
            let less = self.less_upper(self.less_lower(T::zero(), i, x), i, x);
            *y = self.diagonal[i] * x[i] - less;
        }
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

/// The rounds in which rows and columns are brought to about one size. One leaves few traces of
/// factors between 10⁻³ and 10³.
const ROUNDS: usize = 3;

/// Returns a power of two that brings `size` to about 1, or 1 if there is none.
fn unit<T: Scalar>(size: T) -> T {
    let unit = T::of((-size.wide().log2()).round().exp2());
    if unit.is_normal() { unit } else { T::one() }
}

/// Brings the rows and columns of a full matrix of order `n` to about one size, and overwrites
/// `of_rows` and `of_columns` with what they are multiplied by; returns the size of a pivot that is
/// lost in the rounding of the matrix. `sums` is scratch.
pub(crate) fn bring_to_one_size<T: Scalar>(
    matrix: &mut [T],
    n: usize,
    [of_rows, of_columns, sums]: &mut [Vec<T>; 3],
) -> T {
    for vector in [&mut *of_rows, of_columns, sums] {
        vector.clear();
        vector.resize(n, T::one());
    }
    let n = n.max(1);
    for _ in 0..ROUNDS {
        sums.fill(T::zero());
        for (line, of_row) in matrix.chunks_exact(n).zip(&mut *of_rows) {
            let sizes = line.iter().zip(&*of_columns).map(|(a, &by)| a.abs() * by);
            *of_row = unit(sizes.fold(T::zero(), |sum, size| sum + size));
            sums.iter_mut().zip(line).for_each(|(sum, a)| *sum += a.abs() * *of_row);
        }
        of_columns.iter_mut().zip(&*sums).for_each(|(by, &sum)| *by = unit(sum));
    }
    let mut size = T::zero();
    for (line, &of_row) in matrix.chunks_exact_mut(n).zip(&*of_rows) {
        for (a, &by) in line.iter_mut().zip(&*of_columns) {
            *a *= of_row * by;
            size = size.max(a.abs());
        }
    }
    size * T::epsilon()
}

/// A dense LU factorisation with partial pivoting, of a matrix whose rows and columns are brought
/// to about one size.
#[derive(Debug, Clone)]
pub(crate) struct Lu<T> {
    n: usize,
    factors: Vec<T>,
    rows: Vec<usize>,
    /// What rows and columns are multiplied by, and scratch.
    units: [Vec<T>; 3],
}

impl<T: Scalar> Lu<T> {
    /// No factors.
    pub(crate) fn new() -> Self {
        Self { n: 0, factors: vec![], rows: vec![], units: [(); 3].map(|()| vec![]) }
    }

    /// The factors of a matrix.
    pub(super) fn of(matrix: &Matrix<T>) -> Self {
        let mut lu = Self::new();
        lu.factorise(matrix.order(), |i, each| matrix.visit_row(i, each));
        lu
    }

    /// Factorises the matrix of order `n` whose entries `row(i, each)` calls `each` with, for each
    /// `i`; what comes for one place is summed.
    pub(crate) fn factorise(
        &mut self,
        n: usize,
        mut row: impl FnMut(usize, &mut dyn FnMut(usize, T)),
    ) {
        self.n = n;
        let Self { factors, rows, units, .. } = self;
        factors.clear();
        factors.resize(n * n, T::zero());
        rows.clear();
        rows.extend(0..n);
        // Of order 0 where all unknowns are apart.
        for (i, line) in factors.chunks_exact_mut(n.max(1)).enumerate() {
            row(i, &mut |j, a| line[j] += a);
        }
        let least = bring_to_one_size(factors, n, units);
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

    /// Returns whether a pivot is missing.
    pub(crate) fn is_singular(&self) -> bool {
        (0..self.n).any(|k| self.factors[k * self.n + k] == T::zero())
    }

    /// Overwrites `y` with the solution for `rhs`.
    pub(crate) fn solve(&self, rhs: &[T], y: &mut [T]) {
        let Self { n, units: [of_rows, of_columns, _], .. } = self;
        let n = *n;
        for i in 0..n {
            let row = &self.factors[i * n..i * n + i];
            let known = rhs[self.rows[i]] * of_rows[self.rows[i]];
            y[i] = row.iter().zip(&*y).fold(known, |sum, (&l, &y)| sum - l * y);
        }
        for i in (0..n).rev() {
            let row = &self.factors[i * n..(i + 1) * n];
            let known =
                row[i + 1..].iter().zip(&y[i + 1..]).fold(y[i], |sum, (&u, &y)| sum - u * y);
            y[i] = known * row[i];
        }
        y.iter_mut().zip(of_columns).for_each(|(y, &by)| *y *= by);
    }
}
