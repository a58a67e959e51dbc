//! Rows that are known at set-up, walked without a call for each entry.

use std::iter;

use crate::{
    Coefficients, Csr, LinearOperator, Norms, Rows, Scalar,
    check::outside,
    csr::Index,
    kernel::Relaxation,
    norms::{BLOCK, Meter, Part, Tally},
    team::{self, Claims, Sum},
};

/// Where a sweep has the rows of an operator from.
///
/// Sums are handed from entry to entry by value, which keeps them in registers.
pub(crate) trait Source<T>: Clone {
    /// Returns `add(… add(sums, j, aᵢⱼ) …)` for the entries of row `i`, by increasing `j`.
    fn fold<S: Copy>(&mut self, i: usize, sums: S, add: impl FnMut(S, usize, T) -> S) -> S;
}

/// Rows whose residual one thread computes in one go.
const PORTION: usize = 1024;

/// The entries of the longest row that is copied, and so walked at one call.
const COPIED: usize = 16;

/// The rows of an operator of any type, from calls of its own.
///
/// A row is copied first, so that what its operator calls for each entry is little enough to be
/// compiled into the operator's code, or takes one call through `dyn` in the place of one for each
/// entry. A row too long for that is walked as it comes.
#[derive(Debug)]
pub(crate) struct Visited<'o, T, O> {
    operator: &'o O,
    row: [(usize, T); COPIED],
}

impl<'o, T: Scalar, O: Rows<T>> Visited<'o, T, O> {
    pub(crate) fn new(operator: &'o O) -> Self {
        Self { operator, row: [(0, T::zero()); COPIED] }
    }
}

impl<T: Copy, O> Clone for Visited<'_, T, O> {
    fn clone(&self) -> Self {
        Self { operator: self.operator, row: self.row }
    }
}

impl<T: Scalar, O: Rows<T>> Source<T> for Visited<'_, T, O> {
    #[inline(always)]
    fn fold<S: Copy>(&mut self, i: usize, mut sums: S, mut add: impl FnMut(S, usize, T) -> S) -> S {
        let count = self.operator.copy_row(i, &mut self.row);
        if let Some(row) = self.row.get(..count) {
            return row.iter().fold(sums, |sums, &(j, a)| add(sums, j, a));
        }
        self.operator.visit_row(i, &mut |j, a| sums = add(sums, j, a));
        sums
    }
}

/// The arrays of a matrix in compressed sparse rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slices<'a, I, T> {
    pub(crate) offsets: &'a [I],
    pub(crate) columns: &'a [I],
    pub(crate) values: &'a [T],
}

impl<T: Scalar, I: Index> Slices<'_, I, T> {
    #[inline(always)]
    fn row(&self, i: usize) -> (&[I], &[T]) {
        let (from, until) = (self.offsets[i].as_(), self.offsets[i + 1].as_());
        (&self.columns[from..until], &self.values[from..until])
    }

    #[inline(always)]
    fn fold<S: Copy>(&self, i: usize, sums: S, mut add: impl FnMut(S, usize, T) -> S) -> S {
        let (columns, values) = self.row(i);
        columns.iter().zip(values).fold(sums, |sums, (j, &a)| add(sums, j.as_(), a))
    }

    fn apply(&self, first: usize, x: &[T], y: &mut [T]) {
        for (i, y) in (first..).zip(y) {
            *y = self.fold(i, T::zero(), |sum, j, a| sum + a * x[j]);
        }
    }

    fn diagonal_entry(&self, i: usize) -> T {
        let (columns, values) = self.row(i);
        columns.binary_search_by_key(&i, |j| j.as_()).map_or(T::zero(), |at| values[at])
    }
}

/// The rows of an assembled or a diagonal matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) enum RowsOf<'a, T> {
    U32(Slices<'a, u32, T>),
    I32(Slices<'a, i32, T>),
    I64(Slices<'a, i64, T>),
    Usize(Slices<'a, usize, T>),
    Diagonal(Coefficients<'a, T>),
}

impl<T: Scalar> RowsOf<'_, T> {
    /// Overwrites `y` with the rows of the product with `x` that begin at row `first`.
    pub(crate) fn apply(&self, first: usize, x: &[T], y: &mut [T]) {
        match self {
            Self::U32(rows) => rows.apply(first, x, y),
            Self::I32(rows) => rows.apply(first, x, y),
            Self::I64(rows) => rows.apply(first, x, y),
            Self::Usize(rows) => rows.apply(first, x, y),
            Self::Diagonal(entries) => {
                for (i, y) in (first..).zip(y) {
                    *y = entries.at(i) * x[i];
                }
            }
        }
    }

    pub(crate) fn diagonal_entry(&self, i: usize) -> T {
        match self {
            Self::U32(rows) => rows.diagonal_entry(i),
            Self::I32(rows) => rows.diagonal_entry(i),
            Self::I64(rows) => rows.diagonal_entry(i),
            Self::Usize(rows) => rows.diagonal_entry(i),
            Self::Diagonal(entries) => entries.at(i),
        }
    }
}

impl<T: Scalar> Source<T> for RowsOf<'_, T> {
    #[inline(always)]
    fn fold<S: Copy>(&mut self, i: usize, sums: S, mut add: impl FnMut(S, usize, T) -> S) -> S {
        match self {
            Self::U32(rows) => rows.fold(i, sums, add),
            Self::I32(rows) => rows.fold(i, sums, add),
            Self::I64(rows) => rows.fold(i, sums, add),
            Self::Usize(rows) => rows.fold(i, sums, add),
            Self::Diagonal(entries) => add(sums, i, entries.at(i)),
        }
    }
}

/// An operator whose rows are known at set-up.
pub(crate) enum Known<'a, T: Scalar> {
    Csr(Csr<'a, T>),
    Diagonal(Coefficients<'a, T>),
}

impl<'a, T: Scalar> Known<'a, T> {
    /// The rows of an operator that has them assembled or is diagonal.
    pub(crate) fn new(operator: &'a (impl LinearOperator<T> + ?Sized)) -> Option<Self> {
        if let Some(matrix) = operator.as_csr() {
            return Some(Self::Csr(matrix));
        }
        let view = operator.as_five_point()?;
        view.grid().is_none().then(|| Self::Diagonal(view.coefficients()[2]))
    }

    pub(crate) fn rows(&self) -> RowsOf<'_, T> {
        match self {
            Self::Csr(matrix) => matrix.rows(),
            Self::Diagonal(entries) => RowsOf::Diagonal(*entries),
        }
    }
}

/// What a relaxation of rows reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Relaxed<'w, T> {
    pub(crate) q: &'w [T],
    pub(crate) x: &'w [T],
    pub(crate) omega: Coefficients<'w, T>,
    pub(crate) gamma: T,
    pub(crate) parallel: bool,
    pub(crate) q_factor: T,
    pub(crate) relaxations: [Relaxation<T>; 2],
}

impl<T: Scalar> Relaxed<'_, T> {
    /// The sweep over `rows` in their order, where `passed(j, i)` says whether row `j` comes before
    /// row `i`, and the norms of F(x).
    #[inline(always)]
    pub(crate) fn walk<const ACCELERATED: bool>(
        &self,
        meter: Meter,
        mut a: impl Source<T>,
        mut b: impl Source<T>,
        y: &mut [T],
        rows: impl Iterator<Item = usize>,
        passed: impl Fn(usize, usize) -> bool,
    ) -> Norms {
        // Of one length, so that an index is compared with it once.
        let y = &mut y[..self.x.len()];
        let mut sum = Part::default();
        for i in rows {
            let (f, value) = self.row::<ACCELERATED>(i, &mut a, &mut b, y, |j| passed(j, i));
            sum.see(meter, f);
            y[i] = value;
        }
        meter.norms_of(sum, self.gamma)
    }

    /// The entry of F(x) and the new value of row `i`, where `passed(j)` says whether `y[j]` is
    /// new.
    #[inline(always)]
    pub(crate) fn row<const ACCELERATED: bool>(
        &self,
        i: usize,
        a: &mut impl Source<T>,
        b: &mut impl Source<T>,
        y: &[T],
        passed: impl Fn(usize) -> bool,
    ) -> (T, T) {
        let (x, omega, [of_a, of_b]) = (self.x, self.omega, self.relaxations);
        let n = x.len();
        // F, what the passed rows have moved, and an entry of the diagonal.
        let sums = (self.q_factor * self.q[i], T::zero(), T::zero());
        let (f, moved, a_centre) = a.fold(i, sums, |(f, mut moved, centre), j, a| {
            let &x = x.get(j).unwrap_or_else(|| outside(i, j, n));
            let f = f + a * (x.abs() + x);
            if passed(j) {
                moved += of_a.triangle * a * (y[j] - x);
                if ACCELERATED {
                    moved += a * (y[j].abs() - x.abs());
                }
            }
            (f, moved, if j == i { a } else { centre })
        });
        let sums = (f, moved, T::zero());
        let (f, moved, b_centre) = b.fold(i, sums, |(f, mut moved, centre), j, b| {
            let &x = x.get(j).unwrap_or_else(|| outside(i, j, n));
            let b_omega = b * omega.at(j);
            let f = f - b_omega * (x.abs() - x);
            if passed(j) {
                moved += of_b.triangle * b_omega * (y[j] - x);
                if ACCELERATED {
                    moved -= b_omega * (y[j].abs() - x.abs());
                }
            }
            (f, moved, if j == i { b_omega } else { centre })
        });
        // The reciprocal depends on no other row, so it stays off the chain from row to row.
        let pivot = a_centre * of_a.diagonal + b_centre * of_b.diagonal;
        (f, x[i] - (f + moved) * pivot.recip())
    }
}

/// The residual `A z − B r ± q` of operators whose rows are known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowResidual<'a, T> {
    pub(crate) rows: [RowsOf<'a, T>; 2],
    pub(crate) sign: T,
    pub(crate) q: &'a [T],
    pub(crate) z: &'a [T],
    pub(crate) r: &'a [T],
    pub(crate) parallel: bool,
}

impl<T: Scalar> RowResidual<'_, T> {
    /// Its norms, in one pass.
    pub(crate) fn measure(&self, meter: Meter) -> Norms {
        let Self { rows: [a, b], sign, q, z, r, parallel } = *self;
        let portions = Claims::new(q.chunks(PORTION).enumerate());
        let sum = Sum::new();
        team::spread(team::threads(parallel, z.len()), &|| {
            let (mut a, mut b, mut residual) = (a, b, [T::zero(); PORTION]);
            while let Some((number, q)) = portions.next() {
                let residual = &mut residual[..q.len()];
                for ((i, &q), residual) in (number * PORTION..).zip(q).zip(&mut *residual) {
                    let az = a.fold(i, T::zero(), |sum, j, a| sum + a * z[j]);
                    let br = b.fold(i, T::zero(), |sum, j, b| sum + b * r[j]);
                    *residual = az - br + sign * q;
                }
                let mut tally = Tally::zero();
                residual.chunks(BLOCK).for_each(|block| tally.add(meter, block));
                sum.add(number, iter::once((0, tally.part())));
            }
        });
        meter.norms_of(sum.total().sum(None), T::one())
    }
}
