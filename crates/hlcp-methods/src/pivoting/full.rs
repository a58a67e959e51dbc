//! The factors of a full matrix.

#[cfg(feature = "direct")]
use faer::{
    Conj, MatMut, MatRef, Par,
    dyn_stack::{MemBuffer, MemStack},
    linalg::lu::partial_pivoting::{factor, solve},
    perm::PermRef,
};
use hlcp_core::Scalar;

#[cfg(feature = "direct")]
use super::factors::SMALL;
use crate::amg::Lu;
#[cfg(feature = "direct")]
use crate::amg::bring_to_one_size;

/// The order from which blocks pay.
#[cfg(feature = "direct")]
pub(super) const FEW: usize = 64;

/// LU factors of a full matrix, most of whose columns may have one entry: where `A` or `B` is
/// diagonal, those that are chosen from it. They leave the rows of their entries to the end, and
/// `m` rows and columns to be factorised.
#[derive(Debug, Clone)]
pub(super) struct Full<T> {
    /// The rows and the columns: the `m` first, then those of single entries.
    rows: Vec<usize>,
    columns: Vec<usize>,
    /// Of each column the place there, and its only entry if it has one.
    places: Vec<(usize, T)>,
    /// Of each row the column of a single entry.
    singles: Vec<usize>,
    /// The other entries of the rows of these, by rows.
    beside: Vec<T>,
    lu: Lu<T>,
    /// The factors instead, of a large matrix.
    #[cfg(feature = "direct")]
    blocked: Option<Blocked>,
    scratch: [Vec<T>; 2],
}

impl<T: Scalar> Full<T> {
    /// No factors; room for them is taken as they come, and kept.
    pub(super) fn new() -> Self {
        let [rows, columns, singles] = [(); 3].map(|()| vec![]);
        Self {
            rows,
            columns,
            places: vec![],
            singles,
            beside: vec![],
            lu: Lu::new(),
            #[cfg(feature = "direct")]
            blocked: None,
            scratch: [vec![], vec![]],
        }
    }

    /// Factorises the matrix of order `n` whose entries `row(i, each)` calls `each` with, for each
    /// `i`; what comes for one place is summed.
    pub(super) fn factorise(&mut self, n: usize, row: impl Fn(usize, &mut dyn FnMut(usize, T))) {
        let Self { rows, columns, places, singles, beside, .. } = self;
        // The row of the only entry: n where there is none, and more where there are several.
        places.clear();
        places.resize(n, (n, T::zero()));
        for i in 0..n {
            row(i, &mut |j, a| {
                if a != T::zero() {
                    let (at, sum) = places[j];
                    places[j] = (if at == n || at == i { i } else { n + 1 }, sum + a);
                }
            });
        }
        singles.clear();
        singles.resize(n, n);
        for (j, &(i, a)) in places.iter().enumerate() {
            if i < n && a != T::zero() && singles[i] == n {
                singles[i] = j;
            }
        }
        let is_single = |j: usize| places[j].0 < n && singles[places[j].0] == j;
        rows.clear();
        rows.extend((0..n).filter(|&i| singles[i] == n));
        let m = rows.len();
        rows.extend((0..n).filter(|&i| singles[i] < n));
        columns.clear();
        columns.extend((0..n).filter(|&j| !is_single(j)));
        columns.extend(rows[m..].iter().map(|&i| singles[i]));
        columns.iter().enumerate().for_each(|(at, &j)| places[j].0 = at);
        let line = |at: usize, each: &mut dyn FnMut(usize, T)| {
            row(rows[at], &mut |j, a| {
                if places[j].0 < m {
                    each(places[j].0, a);
                }
            });
        };
        beside.clear();
        beside.resize(m * (n - m), T::zero());
        for (beside, at) in beside.chunks_exact_mut(m.max(1)).zip(m..) {
            line(at, &mut |j, a| beside[j] += a);
        }
        #[cfg(feature = "direct")]
        {
            // A pivot that is missing costs others their digits.
            let blocked = (m > FEW).then(|| Blocked::of(m, line));
            self.blocked = blocked.filter(|lu| m > SMALL || !lu.is_singular);
            if self.blocked.is_some() {
                return;
            }
        }
        self.lu.factorise(m, line);
    }

    /// Returns whether a pivot is missing.
    pub(super) fn is_singular(&self) -> bool {
        #[cfg(feature = "direct")]
        if let Some(lu) = &self.blocked {
            return lu.is_singular;
        }
        self.lu.is_singular()
    }

    /// Overwrites `y` with the solution for `rhs`.
    pub(super) fn solve(&mut self, rhs: &[T], y: &mut [T]) {
        let Self { rows, columns, places, beside, lu, scratch: [known, x], .. } = self;
        let m = rows.iter().take_while(|&&i| self.singles[i] == rows.len()).count();
        known.clear();
        known.extend(rows.iter().map(|&i| rhs[i]));
        x.clear();
        x.resize(m, T::zero());
        #[cfg(feature = "direct")]
        match &self.blocked {
            Some(blocked) => blocked.solve(&known[..m], x),
            None => lu.solve(&known[..m], x),
        }
        #[cfg(not(feature = "direct"))]
        lu.solve(&known[..m], x);
        for (k, (&j, &known)) in columns[m..].iter().zip(&known[m..]).enumerate() {
            let beside = &beside[k * m..(k + 1) * m];
            let known = beside.iter().zip(&*x).fold(known, |sum, (&a, &x)| sum - a * x);
            y[j] = known / places[j].1;
        }
        columns.iter().zip(x).for_each(|(&j, x)| y[j] = *x);
    }
}

/// LU factors in blocks, by faer, in double precision.
#[cfg(feature = "direct")]
#[derive(Debug, Clone)]
struct Blocked {
    /// Those of the transpose, by columns, and the order of its rows, to and from.
    factors: Vec<f64>,
    order: [Vec<usize>; 2],
    /// What rows and columns are multiplied by.
    units: [Vec<f64>; 3],
    is_singular: bool,
}

#[cfg(feature = "direct")]
impl Blocked {
    /// The factors of the matrix of order `m` whose entries `row(i, each)` calls `each` with.
    fn of<T: Scalar>(m: usize, row: impl Fn(usize, &mut dyn FnMut(usize, T))) -> Self {
        let mut factors = vec![0.0; m * m];
        for (i, line) in factors.chunks_exact_mut(m).enumerate() {
            row(i, &mut |j, a| line[j] += a.wide());
        }
        let mut units = [(); 3].map(|()| vec![]);
        let least = bring_to_one_size(&mut factors, m, &mut units);
        let mut order = [(); 2].map(|()| vec![0; m]);
        let [to, from] = &mut order;
        let settings = Default::default();
        let need = factor::lu_in_place_scratch::<usize, f64>(m, m, Par::Seq, settings);
        let mut room = MemBuffer::new(need);
        let matrix = MatMut::from_column_major_slice_mut(&mut factors, m, m);
        factor::lu_in_place(matrix, to, from, Par::Seq, MemStack::new(&mut room), settings);
        // NaN is no pivot, either.
        let is_singular = !factors.iter().step_by(m + 1).all(|pivot| pivot.abs() > least);
        Self { factors, order, units, is_singular }
    }

    fn solve<T: Scalar>(&self, rhs: &[T], y: &mut [T]) {
        let Self { factors, order: [to, from], units: [of_rows, of_columns, _], .. } = self;
        let m = to.len();
        let scaled = rhs.iter().zip(of_rows).map(|(rhs, by)| rhs.wide() * by);
        let mut x = Vec::from_iter(scaled);
        let factors = MatRef::from_column_major_slice(factors, m, m);
        let order = PermRef::new_checked(to, from, m);
        let need = solve::solve_transpose_in_place_scratch::<usize, f64>(m, 1, Par::Seq);
        let mut room = MemBuffer::new(need);
        let (stack, rhs) =
            (MemStack::new(&mut room), MatMut::from_column_major_slice_mut(&mut x, m, 1));
        solve::solve_transpose_in_place_with_conj(
            factors,
            factors,
            order,
            Conj::No,
            rhs,
            Par::Seq,
            stack,
        );
        y.iter_mut().zip(x).zip(of_columns).for_each(|((y, x), by)| *y = T::of(x * by));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn count(which: &[bool]) -> usize {
        which.iter().filter(|&&which| which).count()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Of some size with any part of single columns, in any units of rows and columns.
        #[test]
        fn full_factors_solve_what_was_factorised(
            n in prop_oneof![1..90_usize, Just(150), Just(620)],
            singles in 0.0..1.0_f64,
            seed in any::<u64>(),
        ) {
            let mut state = seed | 1;
            let mut draw = || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            };
            let units: Vec<f64> = (0..2 * n).map(|_| 10_f64.powf(8.0 * draw())).collect();
            let (of_rows, of_columns) = units.split_at(n);
            let is_single: Vec<bool> = (0..n).map(|_| draw() + 0.5 < singles).collect();
            let x: Vec<f64> = of_columns.iter().map(|unit| draw() / unit).collect();
            let mut full = vec![vec![0.0; n]; n];
            for (j, &unit) in of_columns.iter().enumerate() {
                for i in (0..n).filter(|&i| i == j || !is_single[j]) {
                    let on = if i == j { n as f64 } else { 0.0 };
                    full[(i + 1) % n][j] = of_rows[(i + 1) % n] * unit * (draw() + on);
                }
            }
            let row = |i: usize, each: &mut dyn FnMut(usize, f64)| {
                for (j, &a) in full[i].iter().enumerate() {
                    // In two parts, as those of A and B, but for columns with one entry.
                    let part = if is_single[j] { 1.0 } else { 0.25 };
                    each(j, part * a);
                    if !is_single[j] {
                        each(j, 0.75 * a);
                    }
                }
            };
            let times = |row: &[f64]| row.iter().zip(&x).map(|(a, x)| a * x).sum::<f64>();
            let rhs: Vec<f64> = full.iter().map(|row| times(row)).collect();
            let (mut factors, mut y) = (Full::new(), vec![f64::NAN; n]);
            for _ in 0..2 {
                factors.factorise(n, row);
                factors.solve(&rhs, &mut y);
                prop_assert!(!factors.is_singular());
                // In these units each column outweighs what its rows have else, twice.
                let most = 16.0 * (n * n) as f64 * f64::EPSILON;
                for ((y, x), unit) in y.iter().zip(&x).zip(of_columns) {
                    prop_assert!((y - x).abs() * unit <= most, "{y} {x}");
                }
                let m = factors.singles.iter().filter(|&&j| j == n).count();
                prop_assert_eq!(m, if n == 1 { 0 } else { n - count(&is_single) });
            }
        }

        /// A column is zero.
        #[test]
        fn what_lacks_a_pivot_is_singular(
            n in prop_oneof![3..90_usize, Just(520)],
            zero in any::<prop::sample::Index>(),
        ) {
            let zero = zero.index(n);
            let row = |i: usize, each: &mut dyn FnMut(usize, f64)| {
                let entry = |j: usize| ((7 * i * i + 3 * i * j + j) as f64).sin();
                (0..n).filter(|&j| j != zero).for_each(|j| each(j, entry(j)));
            };
            let mut factors = Full::new();
            factors.factorise(n, row);
            prop_assert!(factors.is_singular());
        }
    }
}
