//! A matrix by rows, and approximate solves with it.
//!
//! Nothing that is proved rests on a solve: its answers are candidates, and a product that is
//! rounded outward checks them.

use faer::{
    Mat,
    linalg::solvers::Solve,
    sparse::{SparseColMatRef, SymbolicSparseColMatRef},
};
use hlcp_core::{Diagonal, Hlcp, LinearOperator, Omega, Rows};
use hlcp_methods::{Amg, Clock, Jacobian, Preconditioner, TridiagonalPart};

/// A square matrix by rows, their entries by increasing column.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sparse {
    ends: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Sparse {
    pub(crate) fn with_capacity(rows: usize, entries: usize) -> Self {
        Self { ends: Vec::with_capacity(rows), entries: Vec::with_capacity(entries) }
    }

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

    /// Whether no entry beside the diagonal is positive.
    pub(crate) fn is_z(&self) -> bool {
        (0..self.ends.len()).all(|i| self.row(i).all(|(j, value)| i == j || value <= 0.0))
    }

    /// The matrix with the negative moduli of its entries beside the diagonal.
    pub(crate) fn comparison(&self) -> Self {
        let mut matrix = Self::with_capacity(self.ends.len(), self.entries.len());
        for i in 0..self.ends.len() {
            matrix
                .push(self.row(i).map(|(j, value)| (j, if i == j { value } else { -value.abs() })));
        }
        matrix
    }

    /// An approximate solution of `S x = b`, as good as it gets; NaN where that is impossible.
    pub(crate) fn solve(
        &self,
        b: &[f64],
        enough: impl Fn(&[f64]) -> bool,
        clock: &mut Clock<'_>,
    ) -> Vec<f64> {
        // As a pair with itself, so that no column is that of another operator.
        match Hlcp::new(self, self, Omega::Uniform(1.0)) {
            Ok(problem) => {
                Inverse::new(&problem).solve(self, &vec![false; b.len()], b, enough, clock)
            }
            Err(_) => vec![f64::NAN; b.len()],
        }
    }

    /// The solution of `S x = b` by a sparse LU factorisation; `None` where that is impossible.
    pub(crate) fn solve_directly(&self, b: &[f64]) -> Option<Vec<f64>> {
        let n = b.len();
        let starts: Vec<usize> = std::iter::once(0).chain(self.ends.iter().copied()).collect();
        let (columns, values): (Vec<usize>, Vec<f64>) =
            self.entries.iter().map(|&(j, value)| (j as usize, value)).unzip();
        if !values.iter().all(|value| value.is_finite()) {
            return None;
        }
        // Rows are the columns of the transpose.
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &columns);
        let lu = SparseColMatRef::new(pattern, &values).sp_lu().ok()?;
        let mut x = Mat::from_fn(n, 1, |i, _| b[i]);
        lu.solve_transpose_in_place(x.as_mut());
        Some((0..n).map(|i| x[(i, 0)]).collect())
    }

    /// Overwrites `y` with a forward and a backward Gauss–Seidel sweep from 0.
    fn sweeps(&self, rhs: &[f64], y: &mut [f64]) {
        let relax = |y: &mut [f64], i: usize| {
            let (mut rest, mut pivot) = (rhs[i], 0.0);
            for (j, value) in self.row(i) {
                if i == j { pivot = value } else { rest -= value * y[j] }
            }
            y[i] = rest / pivot;
        };
        y.fill(0.0);
        (0..y.len()).for_each(|i| relax(y, i));
        (0..y.len()).rev().for_each(|i| relax(y, i));
    }

    /// Solves `S x = b` by generalised conjugate residuals until `enough` says so of the residual,
    /// which it is given in units of ‖b‖₂; whether it did.
    ///
    /// `approximate(rhs, y)` overwrites `y` with an approximate solution of `S y = rhs`, up to a
    /// factor that is common to all. Ends after `limit` steps, where ten gain nothing, or when the
    /// clock is up.
    pub(crate) fn gcr(
        &self,
        mut approximate: impl FnMut(&[f64], &mut [f64], &mut Clock<'_>),
        b: &[f64],
        limit: usize,
        enough: impl Fn(&[f64]) -> bool,
        clock: &mut Clock<'_>,
    ) -> (Vec<f64>, bool) {
        const KEPT: usize = 10;
        let largest = b.iter().fold(0.0_f64, |most, b| most.max(b.abs()));
        let mut r: Vec<f64> = b.iter().map(|b| b / largest).collect();
        let unit = dot(&r, &r).sqrt();
        let mut x = vec![0.0; b.len()];
        if largest == 0.0 || !unit.is_finite() {
            return (x, largest == 0.0);
        }
        r.iter_mut().for_each(|r| *r /= unit);
        let mut kept: Vec<[Vec<f64>; 2]> = vec![];
        let (mut best, mut idle, mut done) = (1.0, 0, false);
        for step in 0..limit {
            done = enough(&r);
            if done || idle == 10 || clock.is_up() {
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
        (x, done)
    }
}

/// Solves with the columns of `A` and `B` that belong to one choice of sides, and with those of
/// others that differ little: by elimination where they are tridiagonal, by sweeps where these
/// converge, or else by multigrid.
pub(crate) struct Inverse<'p, A, B> {
    problem: &'p Hlcp<f64, A, B>,
    way: Way,
    /// The sides of the multigrid.
    on_r: Vec<bool>,
}

enum Way {
    Elimination(TridiagonalPart<f64>),
    Sweeps,
    Multigrid(Box<Amg<f64>>),
}

impl<'p, A: Rows<f64>, B: Rows<f64>> Inverse<'p, A, B> {
    pub(crate) fn new(problem: &'p Hlcp<f64, A, B>) -> Self {
        let tridiagonal = TridiagonalPart::is_all(problem);
        let way = if tridiagonal { Way::Elimination(TridiagonalPart::new()) } else { Way::Sweeps };
        Self { problem, way, on_r: vec![] }
    }

    /// An approximate solution of `matrix x = rhs`, whose columns are those of `B` where `on_r`;
    /// as good as it gets until the clock is up.
    pub(crate) fn solve(
        &mut self,
        matrix: &Sparse,
        on_r: &[bool],
        rhs: &[f64],
        enough: impl Fn(&[f64]) -> bool,
        clock: &mut Clock<'_>,
    ) -> Vec<f64> {
        /// What a step of sweeps may leave of the residual, or multigrid is worth building.
        const SLOW: f64 = 0.7;
        const STEPS: usize = 60;
        let elimination = matches!(self.way, Way::Elimination(_));
        if elimination || self.on_r.is_empty() {
            self.on_r = on_r.to_vec();
        }
        loop {
            let x: Vec<f64> = self.on_r.iter().map(|r| if *r { -1.0 } else { 1.0 }).collect();
            let (jacobian, mut sizes) = (Jacobian::new(self.problem, &x), vec![]);
            let approximate = |rhs: &[f64], y: &mut [f64], clock: &mut Clock<'_>| {
                sizes.push(dot(rhs, rhs).sqrt());
                if matches!(self.way, Way::Sweeps)
                    && let [.., before, last] = sizes[..]
                    && last > SLOW * before
                    && let Ok(amg) = Amg::new(self.problem)
                {
                    self.way = Way::Multigrid(Box::new(amg));
                }
                match &mut self.way {
                    Way::Sweeps => return matrix.sweeps(rhs, y),
                    Way::Elimination(lines) => lines.solve(&jacobian, rhs, y),
                    Way::Multigrid(amg) => amg.cycle(&jacobian, rhs, y, clock),
                }
                // Their columns are those of BΩ.
                for (j, y) in y.iter_mut().enumerate().filter(|(j, _)| on_r[*j]) {
                    *y *= self.problem.omega().entry(j);
                }
            };
            let (solution, done) = matrix.gcr(approximate, rhs, STEPS, &enough, clock);
            if done || self.on_r == on_r || clock.is_up() {
                return solution;
            }
            self.on_r.copy_from_slice(on_r);
        }
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
