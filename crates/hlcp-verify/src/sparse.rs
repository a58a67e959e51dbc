//! A matrix by rows, and approximate solves with it.
//!
//! Nothing that is proved rests on a solve: its answers are candidates, and a product that is
//! rounded outward checks them.

use hlcp_core::{Diagonal, Hlcp, LinearOperator, Omega, Rows};
use hlcp_methods::{Amg, Clock, Jacobian, SparseLu};

/// A square matrix by rows, their entries by increasing column.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sparse {
    ends: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Sparse {
    /// Appends a row, no column of which comes twice.
    pub(crate) fn push(&mut self, row: impl IntoIterator<Item = (usize, f64)>) {
        let start = self.entries.len();
        self.entries.extend(row.into_iter().map(|(j, value)| (j as u32, value)));
        let row = &mut self.entries[start..];
        if !row.is_sorted_by_key(|entry| entry.0) {
            row.sort_unstable_by_key(|entry| entry.0);
        }
        self.ends.push(self.entries.len());
    }

    #[inline]
    pub(crate) fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        self.entries[start..self.ends[i]].iter().map(|&(j, value)| (j as usize, value))
    }

    /// An approximate solution of `S x = b`, as good as it gets; NaN where that is impossible.
    ///
    /// By a sparse LU factorisation, or, for orders where that might take minutes, by algebraic
    /// multigrid until ‖b − S x‖₂ is at most this part of ‖b‖₂, or the clock is up.
    pub(crate) fn solve(&self, b: &[f64], part: f64, clock: &mut Clock<'_>) -> Vec<f64> {
        /// The largest order that is factorised: a plane grid of this order takes half a
        /// second, but one in space half a minute and four gigabytes.
        const DIRECT: usize = 100_000;
        const STEPS: usize = 60;
        let mut x = vec![f64::NAN; b.len()];
        if b.len() <= DIRECT {
            let lu = SparseLu::of(b.len(), |i, each| self.row(i).for_each(|(j, s)| each(j, s)));
            if let Ok(lu) = lu {
                lu.solve(b, &mut x);
            }
            return x;
        }
        // As a pair with itself, so that no column is that of another operator; J is 2 S.
        let Ok(problem) = Hlcp::new(self, self, Omega::Uniform(1.0)) else { return x };
        let Ok(mut amg) = Amg::new(&problem) else { return x };
        let ones = vec![1.0; b.len()];
        amg.solve_to(&Jacobian::new(&problem, &ones), b, &mut x, (part, STEPS), clock);
        x.iter_mut().for_each(|x| *x *= 2.0);
        x
    }
}

impl LinearOperator<f64> for Sparse {
    fn order(&self) -> usize {
        self.ends.len()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        for (i, y) in y.iter_mut().enumerate() {
            *y = self.row(i).fold(0.0, |sum, (j, value)| sum + value * x[j]);
        }
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl Diagonal<f64> for Sparse {
    fn diagonal_entry(&self, i: usize) -> f64 {
        self.row(i).find(|entry| entry.0 == i).map_or(0.0, |entry| entry.1)
    }
}

impl Rows<f64> for Sparse {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
        self.row(i).for_each(|(j, value)| visit(j, value));
    }
}
