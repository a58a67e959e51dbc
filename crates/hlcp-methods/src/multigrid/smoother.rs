//! One grid's equation `K(x) + f = 0` with `K(x) = (A + BΩ)x + (A − BΩ)|x|`: its defect and its
//! Gauss–Seidel sweep.

use std::ops::Range;

use hlcp_core::{Coefficients, Error, Hlcp, LinearOperator, Omega, Scalar};

/// Rows that are relaxed side by side.
pub(super) const ROWS: usize = 4;

/// The factors of `xⱼ` in K: `2aᵢⱼ` where it is positive and `2bᵢⱼωⱼ` where it is not.
type Factor<T> = [T; 2];

#[inline(always)]
fn part<T: Scalar>(factor: Factor<T>, x: T) -> T {
    x * if x > T::zero() { factor[0] } else { factor[1] }
}

/// The factors of a row of K.
#[derive(Debug, Clone, Copy)]
struct Row<T> {
    /// South, west, centre, east, north.
    factors: [Factor<T>; 5],
    /// The reciprocals of the centre's.
    inverse: Factor<T>,
}

/// Where rows come from.
trait Rows<T>: Copy {
    fn row(&self, k: usize) -> Row<T>;
}

impl<T: Scalar> Rows<T> for Row<T> {
    #[inline(always)]
    fn row(&self, _: usize) -> Self {
        *self
    }
}

/// K on one grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair<'a, T> {
    grid: [usize; 2],
    a: [Coefficients<'a, T>; 5],
    b: [Coefficients<'a, T>; 5],
    omega: Coefficients<'a, T>,
}

/// The vector `f = factor · entries`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a, T> {
    pub(super) factor: T,
    pub(super) entries: &'a [T],
}

impl<T: Scalar> Rows<T> for Pair<'_, T> {
    #[inline(always)]
    fn row(&self, k: usize) -> Row<T> {
        let (nx, last) = (self.grid[0], self.grid[0] * self.grid[1] - 1);
        // Beyond the grid's edge any number serves.
        let around =
            [k.saturating_sub(nx), k.saturating_sub(1), k, last.min(k + 1), last.min(k + nx)];
        let factors: [Factor<T>; 5] = std::array::from_fn(|d| {
            let (a, b) = (self.a[d].at(k), self.b[d].at(k) * self.omega.at(around[d]));
            [a + a, b + b]
        });
        Row { factors, inverse: factors[2].map(T::recip) }
    }
}

impl<'a, T: Scalar> Pair<'a, T> {
    /// K of a problem whose operators are five-point ones on this grid; `None` if they are not.
    pub(super) fn new<A: LinearOperator<T>, B: LinearOperator<T>>(
        problem: &'a Hlcp<T, A, B>,
        grid: [usize; 2],
    ) -> Option<Self> {
        let (a, b) = (problem.a().as_five_point()?, problem.b().as_five_point()?);
        if [a.grid(), b.grid()].into_iter().flatten().any(|own| own != grid) {
            return None;
        }
        let omega = match problem.omega() {
            Omega::Uniform(omega) => Coefficients::Constant(*omega),
            Omega::Each(omega) => Coefficients::Each(omega),
        };
        Some(Self { grid, a: a.coefficients(), b: b.coefficients(), omega })
    }

    /// Refuses a row whose scalar equation has not one solution for every right-hand side.
    pub(super) fn positive(&self) -> Result<(), Error> {
        for k in 0..self.grid[0] * self.grid[1] {
            let [a, b] = self.row(k).factors[2];
            for (what, factor) in [("diagonal of 2A", a), ("diagonal of 2BΩ", b)] {
                let positive = factor > T::zero() && factor.is_finite();
                if !positive || !factor.recip().is_finite() {
                    let value = factor.wide();
                    return Err(Error::NotPositive { what, index: k, value });
                }
            }
        }
        Ok(())
    }

    /// The row that all rows are, if they are.
    fn constant(&self) -> Option<Row<T>> {
        let mut all = self.a.iter().chain(&self.b).chain([&self.omega]);
        all.all(|c| matches!(c, Coefficients::Constant(_))).then(|| self.row(0))
    }

    /// Overwrites `d` with `K(x) + f`; `zeros` is a row of them.
    pub(super) fn defect(&self, f: Source<'_, T>, x: &[T], d: &mut [T], zeros: &[T]) {
        match self.constant() {
            Some(row) => defect(self.grid, row, f, x, d, zeros),
            None => defect(self.grid, *self, f, x, d, zeros),
        }
    }

    /// One Gauss–Seidel sweep over `K(x) + f = 0`, in place; `t` is space for [`ROWS`] rows.
    ///
    /// Row `i` reads `2aᵢᵢ max(xᵢ, 0) + 2bᵢᵢωᵢ min(xᵢ, 0) = t` with the other unknowns as they are,
    /// and `xᵢ` becomes its only solution: `t/(2aᵢᵢ)` for a positive `t`, `t/(2bᵢᵢωᵢ)` for one that
    /// is not.
    pub(super) fn relax(
        &self,
        backward: bool,
        f: Source<'_, T>,
        x: &mut [T],
        t: &mut [T],
        zeros: &[T],
    ) {
        match (self.constant(), backward) {
            (Some(row), false) => relax::<T, _, false>(self.grid, row, f, x, t, zeros),
            (Some(row), true) => relax::<T, _, true>(self.grid, row, f, x, t, zeros),
            (None, false) => relax::<T, _, false>(self.grid, *self, f, x, t, zeros),
            (None, true) => relax::<T, _, true>(self.grid, *self, f, x, t, zeros),
        }
    }
}

fn defect<T: Scalar, R: Rows<T>>(
    [nx, ny]: [usize; 2],
    rows: R,
    f: Source<'_, T>,
    x: &[T],
    d: &mut [T],
    zeros: &[T],
) {
    let (zero, zeros) = (T::zero(), &zeros[..nx]);
    for j in 0..ny {
        let (from, until) = (j * nx, (j + 1) * nx);
        let south = if j > 0 { &x[from - nx..from] } else { zeros };
        let north = if j + 1 < ny { &x[until..until + nx] } else { zeros };
        let (here, entries) = (&x[from..until], &f.entries[from..until]);
        let value = |i: usize, west: T, east: T| {
            let around = [south[i], west, here[i], east, north[i]];
            let factors = rows.row(from + i).factors;
            let parts = factors.into_iter().zip(around).map(|(factor, x)| part(factor, x));
            parts.fold(f.factor * entries[i], |sum, part| sum + part)
        };
        let d = &mut d[from..until];
        d[0] = value(0, zero, here.get(1).copied().unwrap_or(zero));
        for i in 1..nx.max(2) - 1 {
            d[i] = value(i, here[i - 1], here[i + 1]);
        }
        if nx > 1 {
            d[nx - 1] = value(nx - 1, here[nx - 2], zero);
        }
    }
}

/// A sweep, by bands of [`ROWS`] rows in two phases: into `t` goes all that is known before the
/// band changes, in a loop that vectorises; then follows the recurrence, in which each value needs
/// the one before it on the row and the one across from it on the row before.
fn relax<T: Scalar, R: Rows<T>, const BACKWARD: bool>(
    [nx, ny]: [usize; 2],
    rows: R,
    f: Source<'_, T>,
    x: &mut [T],
    t: &mut [T],
    zeros: &[T],
) {
    let zeros = &zeros[..nx];
    for done in (0..ny).step_by(ROWS) {
        let height = ROWS.min(ny - done);
        let first = if BACKWARD { ny - done - height } else { done };
        let (before, rest) = x.split_at_mut(first * nx);
        let (band, after) = rest.split_at_mut(height * nx);
        let south = before.len().checked_sub(nx).map_or(zeros, |last| &before[last..]);
        let north = after.get(..nx).unwrap_or(zeros);
        let (passed, coming) = if BACKWARD { (north, south) } else { (south, north) };
        // Row k of the band in the order of the sweep.
        let row = |k: usize| if BACKWARD { height - 1 - k } else { k };
        for k in 0..height {
            let line = |k: usize| &band[row(k) * nx..][..nx];
            let across = if k + 1 < height { line(k + 1) } else { coming };
            let from = (first + row(k)) * nx;
            let source = Source { entries: &f.entries[from..from + nx], ..f };
            prepare::<T, R, BACKWARD>(rows, from, source, line(k), across, &mut t[k * nx..][..nx]);
        }
        let from = |k: usize| (first + row(k)) * nx;
        if height == ROWS && nx >= ROWS {
            let mut lines = band.chunks_exact_mut(nx);
            let mut lines: [&mut [T]; ROWS] =
                std::array::from_fn(|_| lines.next().expect("a full band"));
            if BACKWARD {
                lines.reverse();
            }
            let t = std::array::from_fn(|k| &t[k * nx..][..nx]);
            skewed::<T, R, BACKWARD>(rows, std::array::from_fn(from), t, passed, lines);
        } else {
            for k in 0..height {
                let mut y = T::zero();
                for i in 0..nx {
                    let i = if BACKWARD { nx - 1 - i } else { i };
                    let across = if k > 0 { band[row(k - 1) * nx + i] } else { passed[i] };
                    y = solved::<T, R, BACKWARD>(rows, from(k) + i, t[k * nx + i], across, y);
                    band[row(k) * nx + i] = y;
                }
            }
        }
    }
}

/// The first phase of a row, whose first point is `from`: minus `f` and what the points take of
/// those not passed.
#[inline(always)]
fn prepare<T: Scalar, R: Rows<T>, const BACKWARD: bool>(
    rows: R,
    from: usize,
    f: Source<'_, T>,
    here: &[T],
    across: &[T],
    t: &mut [T],
) {
    let n = t.len();
    let (entries, here, across) = (&f.entries[..n], &here[..n], &across[..n]);
    let value = |i: usize, along: T| {
        let [south, west, _, east, north] = rows.row(from + i).factors;
        let factors = if BACKWARD { [south, west] } else { [north, east] };
        -(f.factor * entries[i] + part(factors[0], across[i]) + part(factors[1], along))
    };
    if BACKWARD {
        t[0] = value(0, T::zero());
        for i in 1..n {
            t[i] = value(i, here[i - 1]);
        }
    } else {
        for i in 0..n - 1 {
            t[i] = value(i, here[i + 1]);
        }
        t[n - 1] = value(n - 1, T::zero());
    }
}

/// The second phase of point `k`.
#[inline(always)]
fn solved<T: Scalar, R: Rows<T>, const BACKWARD: bool>(
    rows: R,
    k: usize,
    t: T,
    across: T,
    along: T,
) -> T {
    let Row { factors: [south, west, _, east, north], inverse } = rows.row(k);
    let factors = if BACKWARD { [north, east] } else { [south, west] };
    part(inverse, (t - part(factors[0], across)) - part(factors[1], along))
}

/// The second phase of a band: row `k` one column behind row `k − 1`, so that [`ROWS`] recurrences
/// run side by side. Every value is computed from the same numbers as row by row.
#[inline(always)]
fn skewed<T: Scalar, R: Rows<T>, const BACKWARD: bool>(
    rows: R,
    from: [usize; ROWS],
    t: [&[T]; ROWS],
    passed: &[T],
    mut y: [&mut [T]; ROWS],
) {
    /// Steps that share the check of their indices.
    const STEPS: usize = 8;
    let n = passed.len();
    // In step s row k is at its point s − k.
    let at = |i: usize, count: usize| if BACKWARD { n - count - i } else { i };
    let mut last = [T::zero(); ROWS];
    let point_by_point = |s: Range<usize>, last: &mut [T; ROWS], y: &mut [&mut [T]; ROWS]| {
        for s in s {
            for k in (0..ROWS).rev().filter(|&k| (k..n + k).contains(&s)) {
                let i = at(s - k, 1);
                let across = if k == 0 { passed[i] } else { last[k - 1] };
                last[k] = solved::<T, R, BACKWARD>(rows, from[k] + i, t[k][i], across, last[k]);
                y[k][i] = last[k];
            }
        }
    };
    let blocks = (n + 1 - ROWS) / STEPS;
    point_by_point(0..ROWS - 1, &mut last, &mut y);
    for block in 0..blocks {
        let start: [usize; ROWS] = std::array::from_fn(|k| at(ROWS - 1 + block * STEPS - k, STEPS));
        let passed = passed[start[0]..].first_chunk::<STEPS>().expect("a block within the row");
        let t: [&[T; STEPS]; ROWS] = std::array::from_fn(|k| {
            t[k][start[k]..].first_chunk().expect("a block within the row")
        });
        for i in 0..STEPS {
            let i = if BACKWARD { STEPS - 1 - i } else { i };
            // From the last row up, so that `last[k − 1]` still is the value across.
            for k in (0..ROWS).rev() {
                let across = if k == 0 { passed[i] } else { last[k - 1] };
                let point = start[k] + i;
                let k_point = from[k] + point;
                last[k] = solved::<T, R, BACKWARD>(rows, k_point, t[k][i], across, last[k]);
                y[k][point] = last[k];
            }
        }
    }
    point_by_point(ROWS - 1 + blocks * STEPS..n + ROWS - 1, &mut last, &mut y);
}
