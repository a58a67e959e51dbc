//! Approximate solves with matrices that are assembled.
//!
//! Nothing that is proved rests on a solve: its answers are candidates, and a product that is
//! rounded outward checks them.

use hlcp_core::{Csr, Hlcp, Omega, Rows};
use hlcp_methods::{Amg, Clock, Jacobian, SparseLu};

/// A square matrix that is assembled row by row.
#[derive(Default)]
pub(crate) struct Sparse {
    ends: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Sparse {
    /// Appends a row, no column of which comes twice.
    pub(crate) fn push(&mut self, row: impl IntoIterator<Item = (usize, f64)>) {
        let mut row: Vec<_> = row.into_iter().collect();
        row.sort_unstable_by_key(|entry| entry.0);
        self.columns.extend(row.iter().map(|entry| entry.0));
        self.values.extend(row.iter().map(|entry| entry.1));
        self.ends.push(self.columns.len());
    }

    /// Returns the matrix, unless it is not square or has an entry that is not finite.
    pub(crate) fn matrix(self) -> Option<Csr<'static, f64>> {
        Csr::new([vec![0], self.ends].concat(), self.columns, self.values).ok()
    }

    /// An approximate solution of `S x = b`, all entries of `b` being `level`, as good as it gets;
    /// NaN where that is impossible.
    ///
    /// By a sparse LU factorisation, or, for orders where that might take minutes, by algebraic
    /// multigrid until ‖b − S x‖₂ is at most this part of ‖b‖₂, or the clock is up.
    pub(crate) fn solve(self, level: f64, part: f64, clock: &mut Clock<'_>) -> Vec<f64> {
        /// The largest order that is factorised: a plane grid of this order takes half a
        /// second, but one in space half a minute and four gigabytes.
        const DIRECT: usize = 100_000;
        const STEPS: usize = 60;
        let (n, b) = (self.ends.len(), vec![level; self.ends.len()]);
        let mut x = vec![f64::NAN; n];
        let Some(matrix) = self.matrix() else { return x };
        if n <= DIRECT {
            if let Ok(lu) = SparseLu::of(n, |i, each| matrix.visit_row(i, each)) {
                lu.solve(&b, &mut x);
            }
            return x;
        }
        // As a pair with itself, so that no column is that of another operator; J is 2 S.
        let Ok(problem) = Hlcp::new(&matrix, &matrix, Omega::Uniform(1.0)) else { return x };
        let Ok(mut amg) = Amg::new(&problem) else { return x };
        let ones = vec![1.0; n];
        amg.solve_to(&Jacobian::new(&problem, &ones), &b, &mut x, (part, STEPS), clock);
        x.iter_mut().for_each(|x| *x *= 2.0);
        x
    }
}
