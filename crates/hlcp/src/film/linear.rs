//! The linear systems that a film's solution leaves.

use hlcp_methods::{Amg, Clock, Jacobian, SparseLu};
use hlcp_verify::{Film, Side};
use nalgebra::DVectorView;

use super::{
    FilmError,
    solve::{Operators, modulus, problem},
};

/// What is enough of any answer, because rounding ends a solve sooner where the gap jumps.
const ENOUGH: f64 = 1e-8;

/// The most multiplications of an elimination by bands: above, that of a sparse matrix is faster.
const BANDS: usize = 100_000_000;

/// How `z` and `r` answer a change of `A z − B r + q`, full and broken cells staying what they are:
/// `[A_F | −B_C] (δz, δr) = −change`.
pub(super) struct Linear {
    operators: Operators,
    x: Vec<f64>,
    tolerance: f64,
    solver: Eliminated,
}

enum Eliminated {
    Bands(Bands),
    Sparse(SparseLu),
    /// Takes ten times as long, but no more memory for more than a million cells.
    Multigrid(Amg<f64>),
}

impl Linear {
    /// That of a film, or of other operators on its grid, with cells that are broken where `r` is
    /// positive; solved to the tolerance if not by an elimination.
    pub(super) fn of(
        film: &Film,
        operators: Operators,
        r: &[f64],
        tolerance: f64,
    ) -> Result<Self, FilmError> {
        let x = modulus(r);
        let problem = problem(&operators)?;
        let jacobian = Jacobian::new(&problem, &x);
        let row = |k: usize, each: &mut dyn FnMut(usize, f64)| jacobian.visit_row(k, each);
        let solver = match (Bands::of(film, row), SparseLu::of) {
            (Some(bands), _) => Eliminated::Bands(bands),
            (None, factors) => match factors(r.len(), row) {
                Ok(lu) => Eliminated::Sparse(lu),
                Err(_) => Eliminated::Multigrid(Amg::new(&problem)?),
            },
        };
        Ok(Self { operators, x, tolerance, solver })
    }

    /// Whether the same cells are broken.
    pub(super) fn is_at(&self, r: &[f64]) -> bool {
        self.x.iter().zip(r).all(|(x, r)| (*x < 0.0) == (*r > 0.0))
    }

    /// Returns the changes of `z` and `r` that a change of `A z − B r + q` brings about.
    pub(super) fn answer(&mut self, change: &[f64]) -> Result<[Vec<f64>; 2], FilmError> {
        let problem = problem(&self.operators)?;
        let jacobian = Jacobian::new(&problem, &self.x);
        let (mut s, mut reached) = (vec![0.0; change.len()], 0.0);
        match &mut self.solver {
            Eliminated::Bands(bands) => bands.solve(change, &mut s),
            Eliminated::Sparse(lu) => lu.solve(change, &mut s),
            Eliminated::Multigrid(amg) => {
                let goal = (self.tolerance, 400);
                reached = amg.solve_to(&jacobian, change, &mut s, goal, &mut Clock::endless());
            }
        }
        let is_finite = s.iter().all(|s| s.is_finite());
        if reached > self.tolerance.max(ENOUGH) || reached.is_nan() || !is_finite {
            return Err(FilmError::Derivatives(reached));
        }
        // J has the columns 2A where a cell is full, and 2ΩB elsewhere.
        let mut parts = [(); 2].map(|()| vec![0.0; s.len()]);
        for (j, s) in s.iter().enumerate() {
            if jacobian.is_active(j) {
                parts[0][j] = -2.0 * s;
            } else {
                parts[1][j] = 2.0 * problem.omega().entry(j) * s;
            }
        }
        Ok(parts)
    }
}

/// The factors of a matrix on a film's grid, by bands.
///
/// Its columns are those of M-matrices that sum to zero or more: such a matrix is eliminated in any
/// order without a choice of pivots.
struct Bands {
    /// Where the unknown of each cell stands.
    places: Vec<usize>,
    width: usize,
    /// Rows from `width` before the diagonal to as many after it.
    rows: Vec<f64>,
}

impl Bands {
    /// The factors; `None` where others are found faster.
    fn of(film: &Film, row: impl Fn(usize, &mut dyn FnMut(usize, f64))) -> Option<Self> {
        let counts = [film.nx, film.ny];
        // Line by line across an axis. A ring has its lines in turn from either end of a cut.
        let is_ring = |axis: usize| film.sides[2 * axis] == Side::Periodic;
        let width = |axis: usize| counts[1 - axis] * if is_ring(axis) { 2 } else { 1 };
        let axis = usize::from(width(1) < width(0));
        let (n, width, lines) = (film.gap.len(), width(axis), counts[axis]);
        if width.saturating_mul(width).saturating_mul(n) > BANDS {
            return None;
        }
        let place = |k: usize| {
            let at = [k % film.nx, k / film.nx];
            let line = match (is_ring(axis), 2 * at[axis] < lines) {
                (false, _) => at[axis],
                (true, true) => 2 * at[axis],
                (true, false) => 2 * (lines - 1 - at[axis]) + 1,
            };
            line * counts[1 - axis] + at[1 - axis]
        };
        let places: Vec<usize> = (0..n).map(place).collect();
        let whole = 2 * width + 1;
        let mut rows = vec![0.0; n * whole];
        for (k, &at) in places.iter().enumerate() {
            row(k, &mut |j, entry| rows[at * whole + places[j] + width - at] += entry);
        }
        for k in 0..n {
            let (done, rest) = rows.split_at_mut((k + 1) * whole);
            let (pivot, right) = done[k * whole + width..].split_first()?;
            for (i, below) in rest.chunks_mut(whole).take(width).enumerate() {
                let (first, below) = below[width - 1 - i..2 * width - i].split_first_mut()?;
                if *first != 0.0 {
                    *first /= pivot;
                    below.iter_mut().zip(right).for_each(|(below, right)| *below -= *first * right);
                }
            }
        }
        Some(Self { places, width, rows })
    }

    /// Overwrites `y` with the solution, which is not finite if the matrix is singular.
    fn solve(&self, rhs: &[f64], y: &mut [f64]) {
        let (n, width) = (rhs.len(), self.width);
        let mut x = vec![0.0; n];
        self.places.iter().zip(rhs).for_each(|(&at, rhs)| x[at] = *rhs);
        let dot = |a: &[f64], x: &[f64]| {
            DVectorView::from_slice(a, a.len()).dot(&DVectorView::from_slice(x, a.len()))
        };
        let row = |at: usize| &self.rows[at * (2 * width + 1)..][..2 * width + 1];
        for at in 0..n {
            let many = width.min(at);
            x[at] -= dot(&row(at)[width - many..width], &x[at - many..at]);
        }
        for at in (0..n).rev() {
            let many = width.min(n - 1 - at);
            let right = dot(&row(at)[width + 1..][..many], &x[at + 1..][..many]);
            x[at] = (x[at] - right) / row(at)[width];
        }
        self.places.iter().zip(y).for_each(|(&at, y)| *y = x[at]);
    }
}
