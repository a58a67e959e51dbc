//! Sparse LU factors, by faer.

use std::time::Instant;

use faer::{
    Mat, Par,
    dyn_stack::{MemBuffer, MemStack, StackReq},
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::{
            SupernodalThreshold,
            lu::{LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu},
            qr,
        },
    },
};
use hlcp_core::{Error, Hlcp, Rows, Scalar, assert_lengths};

use crate::limits::Cost;

/// The most numbers in the factors, which take 4 GB then. That bounds the multiplications, too: a
/// factorisation that leaves N numbers takes N^1.5/2 at most, or about two minutes.
pub(crate) const NUMBERS: f64 = 2.5e8;

/// Multiplications of a factorisation in the time of one entry of a sweep, and the sweeps that its
/// analysis and what else grows with the order take. Of 92 problems of 39 kinds, of 10³ to 10⁵
/// rows, half take 0.7 to 1.5 times what these say, and nine tenths 0.4 to 3 times.
const PER_ENTRY: f64 = 20.0;
pub(crate) const ANALYSIS: usize = 60;

/// Columns are factorised in blocks where a number of the factors costs more than twelve
/// multiplications, 0.3 times what faer does it at. 13 problems of 1500 to 29,000 rows took 0.5 to
/// 1.1 times the time.
pub(crate) const BLOCKS: SupernodalThreshold = SupernodalThreshold(0.3);

/// The most entries of a column that is not split, but for other long ones. 16 to 256 take 0.9 to 2
/// times the time for planes, lines and diagonals with 1 to 30 full columns.
const LONG: usize = 64;

/// Sparse LU factors of a matrix that is given by rows, in double precision.
///
/// It is the direct solver of [`Pivoting`](crate::Pivoting), for linear systems that a solution
/// leaves to be solved, such as those of its derivatives.
///
/// # Cost
///
/// The factors may hold many more numbers than the matrix: 100 MB for a plane grid with 90,000
/// points, which takes 0.35 s on a core of 2020. They are refused before they are computed where
/// they might take more than 4 GB, whichever pivots are taken. A full row or column, such as an
/// integral's or a multiplier's, costs about a hundred numbers for each row.
///
/// # Source
///
/// The order of the columns: T. A. Davis, J. R. Gilbert, S. I. Larimore and E. G. Ng, *A column
/// approximate minimum degree ordering algorithm*, ACM TOMS 30 (2004). The bounds: J. R. Gilbert,
/// X. S. Li, E. G. Ng and B. W. Peyton, *Computing row and column counts for sparse QR and LU
/// factorization*, BIT 41 (2001). Long columns: R. J. Vanderbei, *Splitting dense columns in sparse
/// linear systems*, Linear Algebra Appl. 152 (1991), here along the order of the other ones.
///
/// ```
/// use hlcp_methods::{FivePoint, LinearOperator, Rows, SparseLu};
///
/// let a = FivePoint::new(30, 20, [-1.0, -1.0, 4.0, -1.0, -1.0_f64])?;
/// let lu = SparseLu::of(a.order(), |i, each| a.visit_row(i, each))?;
/// let [mut y, mut product] = [(); 2].map(|()| vec![0.0; a.order()]);
/// lu.solve(&vec![1.0; a.order()], &mut y);
/// a.apply(&y, &mut product);
/// assert!(product.iter().all(|entry| (entry - 1.0).abs() < 1e-12));
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
// Rows are columns of what is factorised, which is the transpose. The order is found anew for each
// pattern, as columns of `B` may hold little; pivots are chosen in columns.
#[derive(Debug, Clone)]
pub struct SparseLu {
    matrix: Transposed,
    /// The rows in the order in which long columns are split.
    order: Vec<usize>,
    units: Vec<f64>,
    /// The most numbers in the factors.
    most: f64,
    /// The analysis of the pattern, if it has been made, and the factors, if there are any.
    symbolic: Option<SymbolicLu<usize>>,
    numeric: Option<NumericLu<usize, f64>>,
}

/// A matrix by rows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Transposed {
    pub(crate) starts: Vec<usize>,
    pub(crate) columns: Vec<usize>,
    pub(crate) values: Vec<f64>,
}

impl Transposed {
    /// The matrix of order `n` whose entries `row(i, each)` calls `each` with; what comes for one
    /// column is summed.
    pub(crate) fn of(n: usize, mut row: impl FnMut(usize, &mut dyn FnMut(usize, f64))) -> Self {
        let mut matrix = Self { starts: vec![0], ..Self::default() };
        let mut line: Vec<(usize, f64)> = vec![];
        for i in 0..n {
            line.clear();
            row(i, &mut |j, a| line.push((j, a)));
            line.sort_unstable_by_key(|entry| entry.0);
            line.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
            matrix.columns.extend(line.iter().map(|entry| entry.0));
            matrix.values.extend(line.iter().map(|entry| entry.1));
            matrix.starts.push(matrix.columns.len());
        }
        matrix
    }

    /// Returns whether the patterns of both are the same.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.starts == other.starts && self.columns == other.columns
    }

    /// The entries of row `i`, with their columns.
    pub(crate) fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        (self.starts[i]..self.starts[i + 1]).map(|at| (self.columns[at], self.values[at]))
    }

    /// Brings the largest entry of each column between 1 and 2; returns the powers of two.
    fn scale_columns(&mut self) -> Vec<f64> {
        let mut units = vec![0.0_f64; self.starts.len() - 1];
        for (&j, a) in self.columns.iter().zip(&self.values) {
            units[j] = units[j].max(a.abs());
        }
        let power =
            |largest: f64| if largest.is_normal() { (-largest.log2().floor()).exp2() } else { 1.0 };
        units.iter_mut().for_each(|unit| *unit = power(*unit));
        for (&j, a) in self.columns.iter().zip(&mut self.values) {
            *a *= units[j];
        }
        units
    }

    /// Returns which columns are long, and the most rows of a part of these. With `k` full columns
    /// `k` links lead from the rows of a part to those before and to those after, so that as many
    /// rows hide what these cost.
    fn long(&self) -> (Vec<bool>, usize) {
        let mut counts = vec![0; self.starts.len() - 1];
        self.columns.iter().for_each(|&j| counts[j] += 1);
        let entries: usize = counts.iter().filter(|&&count| count > LONG).sum();
        let most = LONG + 2 * entries / counts.len().max(1);
        (counts.into_iter().map(|count| count > most).collect(), most)
    }

    /// Returns the rows in an order of elimination that leaves long columns out; nothing where no
    /// column is long.
    fn order(&self) -> Result<Vec<usize>, Error> {
        let (long, _) = self.long();
        if !long.contains(&true) {
            return Ok(vec![]);
        }
        let others = Self::of(long.len(), |i, each| {
            self.row(i).filter(|&(j, _)| !long[j]).for_each(|(j, a)| each(j, a));
        });
        Ok(others.analyse(NUMBERS)?.0.col_perm().arrays().0.to_vec())
    }

    /// Returns the matrix with long columns split, along rows in that order: each part has an
    /// unknown for itself, and a row that says it is the one before.
    fn split(mut self, order: &[usize]) -> Self {
        let (long, most) = self.long();
        let n = long.len();
        let (mut parts, mut links): (Vec<_>, _) = ((0..n).map(|j| (j, 0)).collect(), vec![]);
        for &i in order {
            for j in &mut self.columns[self.starts[i]..self.starts[i + 1]] {
                if long[*j] {
                    let (part, rows) = &mut parts[*j];
                    if *rows == most {
                        let next = n + links.len();
                        links.push([*part, next]);
                        (*part, *rows) = (next, 0);
                    }
                    *rows += 1;
                    *j = *part;
                }
            }
        }
        if links.is_empty() {
            return self;
        }
        Self::of(n + links.len(), |i, each| {
            if i < n {
                self.row(i).for_each(|(j, a)| each(j, a));
            } else {
                let [before, part] = links[i - n];
                each(before, 1.0);
                each(part, -1.0);
            }
        })
    }

    pub(crate) fn pattern(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let n = self.starts.len() - 1;
        SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.columns)
    }

    /// Returns the analysis of the pattern, the numbers in the factors and the multiplications:
    /// bounds, whatever pivots are chosen.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`] where there are more numbers than are allowed.
    fn analyse(&self, most: f64) -> Result<(SymbolicLu<usize>, [f64; 2]), Error> {
        let no_room = || too_large(f64::INFINITY);
        let pattern = self.pattern();
        let n = pattern.ncols();
        let blocks =
            LuSymbolicParams { supernodal_flop_ratio_threshold: BLOCKS, ..Default::default() };
        let symbolic = factorize_symbolic_lu(pattern, blocks).map_err(|_| no_room())?;
        let by_rows = pattern.to_row_major().map_err(|_| no_room())?;
        let [mut tree, mut order, mut upper, mut first, mut lower] = [(); 5].map(|()| vec![0; n]);
        let needs = [
            qr::col_etree_scratch::<usize>(n, n),
            qr::postorder_scratch::<usize>(n),
            qr::column_counts_aat_scratch::<usize>(n, n),
        ];
        let mut room = MemBuffer::new(StackReq::any_of(&needs));
        let stack = MemStack::new(&mut room);
        let columns = Some(symbolic.col_perm());
        let of_tree = qr::col_etree(pattern, columns, &mut tree, stack);
        qr::postorder(&mut order, of_tree, stack);
        let rows = by_rows.transpose();
        qr::column_counts_ata(&mut upper, &mut first, rows, columns, of_tree, &order, stack);
        // A row takes part from its first column on, up to the root, and leaves one pivot at each.
        first.iter().filter(|&&first| first < n).for_each(|&first| lower[first] += 1);
        let mut bounds = [0.0; 2];
        for j in 0..n {
            let (below, right) = (lower[j] as f64, upper[j] as f64);
            bounds = [bounds[0] + below + right, bounds[1] + below * right];
            if tree[j] < n {
                lower[tree[j]] += lower[j].saturating_sub(1);
            }
        }
        if bounds[0] <= most { Ok((symbolic, bounds)) } else { Err(too_large(bounds[0])) }
    }
}

impl SparseLu {
    /// Returns the factors of the matrix of order `n` whose entries `row(i, each)` calls `each`
    /// with, column and entry; entries of one column are summed.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`] where they might take more than 4 GB.
    ///
    /// # Panics
    ///
    /// If a column is not below `n`.
    pub fn of<T: Scalar>(
        n: usize,
        mut row: impl FnMut(usize, &mut dyn FnMut(usize, T)),
    ) -> Result<Self, Error> {
        let matrix = Transposed::of(n, |i, each| row(i, &mut |j, a| each(j, a.wide())));
        let order = matrix.order()?;
        let mut lu = Self {
            matrix: Transposed::default(),
            order,
            units: vec![],
            most: NUMBERS,
            symbolic: None,
            numeric: None,
        };
        lu.numeric = lu.factors(matrix)?;
        Ok(lu)
    }

    /// Room for the factors of any J(x) of a problem, and what they cost.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`] where the factors of a matrix with all entries of `A` and `B` might take
    /// more than 4 GB.
    pub(crate) fn for_problem<T: Scalar, A: Rows<T>, B: Rows<T>>(
        problem: &Hlcp<T, A, B>,
    ) -> Result<(Self, Cost), Error> {
        let matrix = Transposed::of(problem.order(), |i, each| {
            problem.a().visit_row(i, &mut |j, _| each(j, 0.0));
            problem.b().visit_row(i, &mut |j, _| each(j, 0.0));
        });
        let order = matrix.order()?;
        let matrix = matrix.split(&order);
        let begun = Instant::now();
        let (symbolic, bounds) = matrix.analyse(NUMBERS)?;
        let cost = cost(begun, [0, ANALYSIS], bounds[1], matrix.columns.len(), 16.0 * bounds[0]);
        let (symbolic, units) = (Some(symbolic), vec![]);
        Ok((Self { matrix, order, units, most: NUMBERS, symbolic, numeric: None }, cost))
    }

    /// Leaves factors out that might hold more numbers than these.
    pub(crate) fn within(&mut self, most: f64) {
        (self.most, self.symbolic) = (most, None);
    }

    /// Factorises the matrix whose entries `row(i, each)` calls `each` with, for each `i`, if that
    /// is possible, but for pivots of zero.
    pub(crate) fn factorise<T: Scalar>(
        &mut self,
        n: usize,
        mut row: impl FnMut(usize, &mut dyn FnMut(usize, T)),
    ) {
        let matrix = Transposed::of(n, |i, each| row(i, &mut |j, a| each(j, a.wide())));
        self.numeric = self.factors(matrix).ok().flatten();
    }

    /// The factors, in the memory of those before, unless memory or a pivot is missing.
    fn factors(&mut self, mut matrix: Transposed) -> Result<Option<NumericLu<usize, f64>>, Error> {
        self.units = matrix.scale_columns();
        let matrix = matrix.split(&self.order);
        if !matrix.is_like(&self.matrix) {
            self.symbolic = None;
        }
        // Factors of another order leave no room for these.
        let is_of_order = matrix.starts.len() == self.matrix.starts.len();
        let mut numeric = self.numeric.take().filter(|_| is_of_order).unwrap_or_default();
        self.matrix = matrix;
        let symbolic = match &mut self.symbolic {
            Some(symbolic) => symbolic,
            symbolic => symbolic.insert(self.matrix.analyse(self.most)?.0),
        };
        let need = symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let Ok(mut room) = MemBuffer::try_new(need) else { return Ok(None) };
        let matrix = SparseColMatRef::new(self.matrix.pattern(), &self.matrix.values);
        let (stack, settings) = (MemStack::new(&mut room), Default::default());
        let done = symbolic.factorize_numeric_lu(&mut numeric, matrix, Par::Seq, stack, settings);
        Ok(done.is_ok().then_some(numeric))
    }

    /// Overwrites `y` with the solution for `rhs`; with NaN where there are no factors, for the
    /// matrix was singular or not finite.
    ///
    /// # Panics
    ///
    /// If `rhs` or `y` does not have the length `n`.
    pub fn solve<T: Scalar>(&self, rhs: &[T], y: &mut [T]) {
        let (Some(symbolic), Some(numeric)) = (&self.symbolic, &self.numeric) else {
            y.fill(T::nan());
            return;
        };
        assert_lengths(self.units.len(), [("rhs", rhs.len()), ("y", y.len())]);
        let mut x = Mat::zeros(symbolic.ncols(), 1);
        rhs.iter().enumerate().for_each(|(i, rhs)| x[(i, 0)] = rhs.wide());
        let mut room =
            MemBuffer::new(symbolic.solve_transpose_in_place_scratch::<f64>(1, Par::Seq));
        let lu = LuRef::new_unchecked(symbolic, numeric);
        let stack = MemStack::new(&mut room);
        lu.solve_transpose_in_place_with_conj(faer::Conj::No, x.as_mut(), Par::Seq, stack);
        y.iter_mut().enumerate().for_each(|(i, y)| *y = T::of(self.units[i] * x[(i, 0)]));
    }
}

/// The cost of an elimination whose analysis began then: its multiplications beside walks over so
/// many entries, and the sweeps that else come before the first one and with each.
pub(crate) fn cost(
    begun: Instant,
    [before, each]: [usize; 2],
    multiplications: f64,
    entries: usize,
    bytes: f64,
) -> Cost {
    // The analysis is the first work of an elimination, or most of that of each.
    let sweep = begun.elapsed().as_secs_f64() / before.max(each) as f64;
    let worth = each + (multiplications / (PER_ENTRY * entries as f64)) as usize;
    Cost { worth, before, seconds: sweep * worth as f64, bytes }
}

/// The error of factors with too many numbers.
fn too_large(needed: f64) -> Error {
    Error::TooLarge { what: "sparse LU factors", needed, most: NUMBERS, unit: "numbers" }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use hlcp_core::{FivePoint, Identity, Omega};
    use proptest::{collection::vec, prelude::*};

    use super::*;

    /// Eliminates a pattern column by column with pivots that `choose` picks; returns the numbers
    /// in both factors and the multiplications, a pivot counted in each factor.
    fn eliminate(mut full: Vec<Vec<bool>>, mut choose: impl FnMut(&[usize]) -> usize) -> [f64; 2] {
        let (n, mut counts) = (full.len(), [0.0; 2]);
        for k in 0..n {
            let rows: Vec<usize> = (k..n).filter(|&i| full[i][k]).collect();
            full.swap(k, rows[choose(&rows)]);
            let right = (k..n).filter(|&j| full[k][j]).count();
            for i in k + 1..n {
                if full[i][k] {
                    (k..n).for_each(|j| full[i][j] |= full[k][j]);
                }
            }
            counts[0] += (rows.len() + right) as f64;
            counts[1] += (rows.len() * right) as f64;
        }
        counts
    }

    proptest! {
        /// Whatever pivots are chosen, and though nothing cancels.
        #[test]
        fn the_analysis_bounds_every_elimination(
            n in 1..15_usize,
            entries in vec((0..15_usize, 0..15_usize), 0..60),
            picks in vec(any::<prop::sample::Index>(), 15),
        ) {
            let off = |i: usize| entries.iter().filter(move |&&(row, j)| row == i && j < n);
            let matrix = Transposed::of(n, |i, each| {
                each(i, 1.0);
                off(i).for_each(|&(_, j)| each(j, 1.0));
            });
            let (symbolic, bounds) = matrix.analyse(NUMBERS).unwrap();
            // What is factorised is the transpose, its columns in the order of the analysis.
            let (columns, _) = symbolic.col_perm().arrays();
            let mut full = vec![vec![false; n]; n];
            for (at, &i) in columns.iter().enumerate() {
                let row = matrix.starts[i]..matrix.starts[i + 1];
                matrix.columns[row].iter().for_each(|&j| full[j][at] = true);
            }
            let mut picks = picks.iter();
            let counts = eliminate(full, |rows| picks.next().unwrap().index(rows.len()));
            prop_assert!(counts[0] <= bounds[0] && counts[1] <= bounds[1], "{counts:?} {bounds:?}");
        }
    }

    #[test]
    fn factors_solve_what_was_factorised() {
        let n = 200;
        let row = |i: usize, each: &mut dyn FnMut(usize, f64)| {
            // Not symmetric, with small pivots, and column 7 long, and twice in each row.
            let entries =
                [(i, 1e-3), ((i + 1) % n, 2.0), ((3 * i + 5) % n, -1.0), (7, 0.25), (7, 0.25)];
            entries.iter().for_each(|&(j, a)| each(j, a));
        };
        let grid = FivePoint::new(n, 1, [0.0, -1.0, 2.0, -1.0, 0.0]).unwrap();
        let problem = Hlcp::new(grid, Identity { order: n }, Omega::Uniform(1.0)).unwrap();
        let (_, cost) = SparseLu::for_problem(&problem).unwrap();
        assert!((ANALYSIS..ANALYSIS + 20).contains(&cost.worth), "{cost:?}");
        let mut lu = SparseLu::of(n, row).unwrap();
        let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut rhs = vec![0.0; n];
        (0..n).for_each(|i| row(i, &mut |j, a| rhs[i] += a * x[j]));
        let mut y = vec![0.0; n];
        lu.solve(&rhs, &mut y);
        assert_abs_diff_eq!(&y[..], &x[..], epsilon = 1e-9);
        // The same pattern again, and others between, leave no trace.
        let mut again = vec![0.0; n];
        SparseLu::of(n, row).unwrap().solve(&rhs, &mut again);
        assert_eq!(again, y);
        lu.factorise(n, |i, each| row(i, &mut |j, a| each(j, 2.0 * a)));
        for _ in 0..2 {
            lu.factorise(n, row);
            lu.solve(&rhs, &mut again);
            assert_eq!(again, y);
            // One with a long column, and one without.
            for long in [1.0, 0.0] {
                lu.factorise(n, |i, each: &mut dyn FnMut(usize, f64)| {
                    each(i, 4.0);
                    if i != 7 && long != 0.0 {
                        each(7, long);
                    }
                });
                lu.solve(&rhs, &mut again);
                let others = |i: usize| if i == 7 { 0.0 } else { long * rhs[7] / 4.0 };
                assert!((0..n).all(|i| again[i] == (rhs[i] - others(i)) / 4.0));
            }
        }
        // A row of zeros has no pivot: what comes is not finite, or there are no factors.
        lu.factorise(n, |i, each: &mut dyn FnMut(usize, f64)| {
            each(i, if i == 9 { 0.0 } else { 1.0 })
        });
        lu.solve(&rhs, &mut y);
        assert!(!y.iter().all(|y| y.is_finite()));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Lines and rings with a few full rows and columns, renumbered and with any units: a part
        /// of a column costs its rows and what leads to its neighbours, for each of the rows.
        #[test]
        fn full_columns_cost_what_their_parts_do(
            (places, parts) in (1000..3000_usize).prop_flat_map(|n| {
                (Just(Vec::from_iter(0..n)).prop_shuffle(), vec(0.0..1.0_f64, n))
            }),
            k in 1..6_usize,
            units in vec(-3..4_i32, 10),
        ) {
            let n = places.len();
            let unit = |i: usize| 10.0_f64.powi(units[i % 10]);
            let mut rows = vec![vec![]; n];
            let mut add = |i: usize, j: usize, a: f64| {
                rows[places[i]].push((places[j], unit(i) * unit(j + 3) * a));
            };
            for (i, part) in parts.into_iter().enumerate() {
                add(i, i, 3.0 + part);
                add(i, (i + 1) % n, -1.0);
                add(i, (i + n - 1) % n, part - 1.0);
                for full in (0..k).map(|full| full * (n / k)) {
                    add(i, full, part);
                    add(full, i, part - 0.5);
                }
            }
            let row = |i: usize, each: &mut dyn FnMut(usize, f64)| {
                rows[i].iter().for_each(|&(j, a)| each(j, a));
            };
            let rhs: Vec<f64> = (0..n).map(|i| unit(i) * (i as f64).sin()).collect();
            let mut y = vec![0.0; n];
            let lu = SparseLu::of(n, row).unwrap();
            lu.solve(&rhs, &mut y);
            for (row, rhs) in rows.iter().zip(rhs) {
                let terms = row.iter().map(|&(j, a)| a * y[j]);
                let size: f64 = terms.clone().map(f64::abs).sum();
                prop_assert!((terms.sum::<f64>() - rhs).abs() <= 1e-9 * size);
            }
            // Of a part with p rows a row leaves p/2 numbers in each factor in the mean, and those
            // of 2k links, k rows and what the line goes on with; a link those of 4k others.
            let numbers = lu.matrix.analyse(NUMBERS).unwrap().1[0];
            let most = LONG + 2 * k;
            let links = k * n.div_ceil(most);
            prop_assert!(numbers <= (n * (most + 6 * k + 6) + links * 8 * k) as f64, "{numbers}");
        }
    }

    #[test]
    fn too_large_factors_are_refused_with_numbers() {
        assert_eq!(
            too_large(3e8).to_string(),
            "sparse LU factors might take 3.0e8 numbers, but at most 2.5e8 are allowed; take a \
             method that stores no factors, such as AUTO or AMG"
        );
    }
}
