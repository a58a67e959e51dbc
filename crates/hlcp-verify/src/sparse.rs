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
    /// multigrid until `enough` says so of the residual, in units of ‖b‖₂, or the clock is up.
    pub(crate) fn solve(
        &self,
        b: &[f64],
        enough: impl Fn(&[f64]) -> bool,
        clock: &mut Clock<'_>,
    ) -> Vec<f64> {
        /// The largest order that is factorised: a plane grid of this order takes half a
        /// second, but one in space half a minute and four gigabytes.
        const DIRECT: usize = 100_000;
        const STEPS: usize = 60;
        let impossible = || vec![f64::NAN; b.len()];
        if b.len() <= DIRECT {
            let lu = SparseLu::of(b.len(), |i, each| self.row(i).for_each(|(j, s)| each(j, s)));
            let mut x = impossible();
            if let Ok(lu) = lu {
                lu.solve(b, &mut x);
            }
            return x;
        }
        // As a pair with itself, so that no column is that of another operator.
        let Ok(problem) = Hlcp::new(self, self, Omega::Uniform(1.0)) else { return impossible() };
        let Ok(mut amg) = Amg::new(&problem) else { return impossible() };
        let ones = vec![1.0; b.len()];
        let jacobian = Jacobian::new(&problem, &ones);
        let cycle = |rhs: &[f64], y: &mut [f64], clock: &mut Clock<'_>| {
            amg.cycle(&jacobian, rhs, y, clock);
        };
        self.gcr(cycle, b, STEPS, enough, clock)
    }

    /// Solves `S x = b` by generalised conjugate residuals until `enough` says so of the residual,
    /// which it is given in units of ‖b‖₂.
    ///
    /// `approximate(rhs, y)` overwrites `y` with an approximate solution of `S y = rhs`, up to a
    /// factor that is common to all. Ends after `limit` steps, where ten gain nothing, or when the
    /// clock is up.
    fn gcr(
        &self,
        mut approximate: impl FnMut(&[f64], &mut [f64], &mut Clock<'_>),
        b: &[f64],
        limit: usize,
        enough: impl Fn(&[f64]) -> bool,
        clock: &mut Clock<'_>,
    ) -> Vec<f64> {
        const KEPT: usize = 10;
        let largest = b.iter().fold(0.0_f64, |most, b| most.max(b.abs()));
        let mut r: Vec<f64> = b.iter().map(|b| b / largest).collect();
        let unit = dot(&r, &r).sqrt();
        let mut x = vec![0.0; b.len()];
        if largest == 0.0 || !unit.is_finite() {
            return x;
        }
        r.iter_mut().for_each(|r| *r /= unit);
        let mut kept: Vec<[Vec<f64>; 2]> = vec![];
        let (mut best, mut idle) = (1.0, 0);
        for step in 0..limit {
            if enough(&r) || idle == 10 || clock.is_up() {
                break;
            }
            let at = step % KEPT;
            if kept.len() == at {
                kept.push([vec![0.0; b.len()], vec![0.0; b.len()]]);
            }
            let [mut p, mut image] = std::mem::take(&mut kept[at]);
            approximate(&r, &mut p, clock);
            if clock.is_up() {
                break;
            }
            self.apply(&p, &mut image);
            for [older, of_older] in kept.iter().filter(|pair| !pair[0].is_empty()) {
                let share = dot(&image, of_older);
                add(&mut image, -share, of_older);
                add(&mut p, -share, older);
            }
            let norm = dot(&image, &image).sqrt();
            if !(norm > 0.0 && norm.is_finite()) {
                break;
            }
            p.iter_mut().for_each(|p| *p /= norm);
            image.iter_mut().for_each(|image| *image /= norm);
            let length = dot(&r, &image);
            add(&mut x, length, &p);
            add(&mut r, -length, &image);
            kept[at] = [p, image];
            let size = dot(&r, &r).sqrt();
            idle = if size < 0.9 * best { 0 } else { idle + 1 };
            best = size.min(best);
        }
        x.iter_mut().for_each(|x| *x *= unit * largest);
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

pub(crate) fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// `y += a x`.
fn add(y: &mut [f64], a: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += a * x);
}
