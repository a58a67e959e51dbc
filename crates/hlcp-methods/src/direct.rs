//! Sparse LU factors of J(x), by faer.

use faer::{
    Mat, Par,
    dyn_stack::{MemBuffer, MemStack, StackReq},
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::{
            lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu},
            qr,
        },
    },
};
use hlcp_core::{Error, Hlcp, Rows, Scalar};

/// The most numbers in the factors, which take 4 GB then, and the most multiplications of one
/// factorisation, which take about a minute.
const NUMBERS: f64 = 2.5e8;
const MULTIPLICATIONS: f64 = 1e12;

/// Multiplications of a factorisation in the time of one entry of a sweep, and the sweeps that its
/// analysis takes. Grids of 40,000 and 90,000 points, a plate, a cube and random matrices of orders
/// 800 and 6050 take 0.6 to 1.1 times what these say.
const PER_ENTRY: f64 = 20.0;
pub(crate) const ANALYSIS: usize = 200;

/// The factors of J(x) and room for the next ones.
///
/// Rows of J are columns of what is factorised, which is its transpose. The order that fills few
/// places is found anew for each J (COLAMD, Davis, Gilbert, Larimore and Ng, ACM TOMS 30 (2004)),
/// as columns of `B` may hold little; pivots are chosen in columns.
#[derive(Debug, Clone)]
pub(crate) struct SparseLu {
    matrix: Transposed,
    factors: Option<(SymbolicLu<usize>, NumericLu<usize, f64>)>,
}

/// A matrix by rows.
#[derive(Debug, Clone, Default)]
struct Transposed {
    starts: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Transposed {
    /// Overwrites the matrix with that of order `n` whose entries `row(i, each)` calls `each` with;
    /// what comes for one column is summed.
    fn fill(&mut self, n: usize, mut row: impl FnMut(usize, &mut dyn FnMut(usize, f64))) {
        self.starts.clear();
        self.columns.clear();
        self.values.clear();
        self.starts.push(0);
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
            self.columns.extend(line.iter().map(|entry| entry.0));
            self.values.extend(line.iter().map(|entry| entry.1));
            self.starts.push(self.columns.len());
        }
    }

    fn pattern(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let n = self.starts.len() - 1;
        SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.columns)
    }

    /// Returns the analysis of the pattern, the numbers in the factors and the multiplications:
    /// bounds, whatever pivots are chosen.
    fn analyse(&self) -> Option<(SymbolicLu<usize>, [f64; 2])> {
        let pattern = self.pattern();
        let n = pattern.ncols();
        let symbolic = factorize_symbolic_lu(pattern, Default::default()).ok()?;
        let transpose = self.transposed();
        let [mut tree, mut order, mut upper, mut first, mut lower] = [(); 5].map(|()| vec![0; n]);
        let mut room = MemBuffer::new(StackReq::new::<usize>(8 * n + 64));
        let stack = MemStack::new(&mut room);
        let columns = Some(symbolic.col_perm());
        let of_tree = qr::col_etree(pattern, columns, &mut tree, stack);
        qr::postorder(&mut order, of_tree, stack);
        let rows = transpose.pattern();
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
        Some((symbolic, bounds))
    }

    fn transposed(&self) -> Self {
        let n = self.starts.len() - 1;
        let mut starts = vec![0; n + 1];
        self.columns.iter().for_each(|&j| starts[j + 1] += 1);
        (0..n).for_each(|j| starts[j + 1] += starts[j]);
        let (mut next, mut columns) = (starts.clone(), vec![0; self.columns.len()]);
        for i in 0..n {
            for &j in &self.columns[self.starts[i]..self.starts[i + 1]] {
                columns[next[j]] = i;
                next[j] += 1;
            }
        }
        Self { starts, columns, values: vec![] }
    }
}

impl SparseLu {
    /// Room for the factors of any J(x) of a problem, and what they are worth in sweeps.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`] where the factors of a matrix with all entries of `A` and `B` might take
    /// more than 4 GB, or more than 10¹² multiplications.
    pub(crate) fn new<T: Scalar, A: Rows<T>, B: Rows<T>>(
        problem: &Hlcp<T, A, B>,
    ) -> Result<(Self, usize), Error> {
        let mut matrix = Transposed::default();
        matrix.fill(problem.order(), |i, each| {
            problem.a().visit_row(i, &mut |j, _| each(j, 0.0));
            problem.b().visit_row(i, &mut |j, _| each(j, 0.0));
        });
        let bounds = matrix.analyse().map_or([f64::INFINITY; 2], |analysis| analysis.1);
        allowed(bounds)?;
        let worth = bounds[1] / (PER_ENTRY * matrix.columns.len() as f64);
        Ok((Self { matrix, factors: None }, ANALYSIS + worth as usize))
    }

    /// Factorises the matrix whose entries `row(i, each)` calls `each` with, for each `i`, if that
    /// is possible, but for pivots of zero.
    pub(crate) fn factorise<T: Scalar>(
        &mut self,
        mut row: impl FnMut(usize, &mut dyn FnMut(usize, T)),
    ) {
        // Those before give up their memory first.
        self.factors = None;
        let order = self.matrix.starts.len() - 1;
        self.matrix.fill(order, |i, each| row(i, &mut |j, a| each(j, a.wide())));
        self.factors = self.factors();
    }

    fn factors(&self) -> Option<(SymbolicLu<usize>, NumericLu<usize, f64>)> {
        let (symbolic, bounds) = self.matrix.analyse()?;
        allowed(bounds).ok()?;
        let need = symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let (mut room, mut numeric) = (MemBuffer::try_new(need).ok()?, NumericLu::new());
        let matrix = SparseColMatRef::new(self.matrix.pattern(), &self.matrix.values);
        let (stack, settings) = (MemStack::new(&mut room), Default::default());
        let done = symbolic.factorize_numeric_lu(&mut numeric, matrix, Par::Seq, stack, settings);
        done.is_ok().then_some((symbolic, numeric))
    }

    /// Overwrites `y` with the solution for `rhs`; with NaN where there are no factors.
    pub(crate) fn solve<T: Scalar>(&self, rhs: &[T], y: &mut [T]) {
        let Some((symbolic, numeric)) = &self.factors else {
            y.fill(T::nan());
            return;
        };
        let mut x = Mat::from_fn(rhs.len(), 1, |i, _| rhs[i].wide());
        let mut room =
            MemBuffer::new(symbolic.solve_transpose_in_place_scratch::<f64>(1, Par::Seq));
        let lu = LuRef::new_unchecked(symbolic, numeric);
        let stack = MemStack::new(&mut room);
        lu.solve_transpose_in_place_with_conj(faer::Conj::No, x.as_mut(), Par::Seq, stack);
        y.iter_mut().enumerate().for_each(|(i, y)| *y = T::of(x[(i, 0)]));
    }
}

/// Refuses factors with too many numbers or multiplications.
fn allowed([numbers, multiplications]: [f64; 2]) -> Result<(), Error> {
    let what = "sparse LU factors";
    let each =
        [(numbers, NUMBERS, "numbers"), (multiplications, MULTIPLICATIONS, "multiplications")];
    match each.into_iter().find(|(needed, most, _)| needed.is_nan() || needed > most) {
        Some((needed, most, unit)) => Err(Error::TooLarge { what, needed, most, unit }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use hlcp_core::{FivePoint, Identity, Omega};
    use proptest::prelude::*;

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
            entries in prop::collection::vec((0..15_usize, 0..15_usize), 0..60),
            picks in prop::collection::vec(any::<prop::sample::Index>(), 15),
        ) {
            let mut matrix = Transposed::default();
            let off = |i: usize| entries.iter().filter(move |&&(row, j)| row == i && j < n);
            matrix.fill(n, |i, each| {
                each(i, 1.0);
                off(i).for_each(|&(_, j)| each(j, 1.0));
            });
            let (symbolic, bounds) = matrix.analyse().unwrap();
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
        let n = 60;
        let row = |i: usize, each: &mut dyn FnMut(usize, f64)| {
            // Not symmetric, with small pivots, and column 7 twice.
            let entries =
                [(i, 1e-3), ((i + 1) % n, 2.0), ((3 * i + 5) % n, -1.0), (7, 0.25), (7, 0.25)];
            entries.iter().for_each(|&(j, a)| each(j, a));
        };
        let grid = FivePoint::new(n, 1, [0.0, -1.0, 2.0, -1.0, 0.0]).unwrap();
        let problem = Hlcp::new(grid, Identity { order: n }, Omega::Uniform(1.0)).unwrap();
        let (mut lu, worth) = SparseLu::new(&problem).unwrap();
        assert!((ANALYSIS..ANALYSIS + 20).contains(&worth), "{worth}");
        lu.factorise(row);
        let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut rhs = vec![0.0; n];
        (0..n).for_each(|i| row(i, &mut |j, a| rhs[i] += a * x[j]));
        let mut y = vec![0.0; n];
        lu.solve(&rhs, &mut y);
        assert_abs_diff_eq!(&y[..], &x[..], epsilon = 1e-9);
        // A row of zeros has no pivot: what comes is not finite, or there are no factors.
        lu.factorise(|i, each: &mut dyn FnMut(usize, f64)| each(i, if i == 9 { 0.0 } else { 1.0 }));
        lu.solve(&rhs, &mut y);
        assert!(!y.iter().all(|y| y.is_finite()));
    }

    #[test]
    fn too_large_factors_are_refused_with_numbers() {
        let error = allowed([3e8, 1.0]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "sparse LU factors might take 3.0e8 numbers, but at most 2.5e8 are allowed; take a \
             method that stores no factors, such as AUTO or AMG"
        );
        assert!(allowed([1.0, 2e12]).is_err() && allowed([f64::NAN, 1.0]).is_err());
        assert_eq!(allowed([NUMBERS, MULTIPLICATIONS]), Ok(()));
    }
}
