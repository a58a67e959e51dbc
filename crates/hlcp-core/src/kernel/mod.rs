//! One relaxation sweep over a pair of five-point operators, in one pass over memory.
//!
//! A forward sweep of the splitting reads, point by point,
//!
//! ```text
//! mᵢᵢ (yᵢ − xᵢ) = − Fᵢ(x) − Σ_{j passed} mᵢⱼ (yⱼ − xⱼ) ,
//! ```
//!
//! and only `yⱼ` of the western and the southern neighbour are new. So a row is done in two phases,
//!
//! ```text
//! tᵢ = xᵢ − Fᵢ(x)/mᵢᵢ + s(x_S) + w(x_W)     everything that depends on the old x: a vector loop,
//! yᵢ = tᵢ − s(y_S) − w(y_W)                 the recurrence: a chain along the row,
//! ```
//!
//! with `s(v) = mᵢⱼ v/mᵢᵢ`, and for the accelerated method `s(v) = (mᵢⱼ v + (aᵢⱼ − bᵢⱼωⱼ)|v|)/mᵢᵢ`. The first
//! phase meets every `Fᵢ(x)`, which is all that the norms of the input take. The chain is as long as the row and
//! each link waits for the one before; [`ROWS`] chains therefore run side by side, row `k` one column behind row
//! `k − 1`, whose last value is then the southern neighbour. Nothing is reordered: every `yᵢ` is computed from the
//! same numbers by the same operations as in a loop over the points.
//!
//! The grid is worked through in tiles of [`ROWS`] rows and [`COLUMNS`] columns, each copied to the stack with
//! zeros around the grid. A backward sweep is the forward one on the mirrored grid: the copies run backwards, and
//! nothing else knows.
//!
//! No `mul_add` and no reassociation: the same bits on every processor and for every number of threads.

mod coefficients;
mod tile;

use pulp::{Arch, Simd, WithSimd};

use self::{
    coefficients::{Constant, Source, Varying},
    tile::Worker,
};
use crate::{
    Coefficients, FivePointView, Hlcp, LinearOperator, Norms, Omega, Rhs, Scalar,
    norms::{Meter, Tally},
};

pub(crate) use self::coefficients::Relaxation;

/// Rows that are relaxed side by side.
const ROWS: usize = 8;
/// The most columns of a row that are done in one go.
const COLUMNS: usize = 512;
/// Between arrays of a worker, so that those of a power of two do not compete for the same lines of the cache.
const PAD: usize = 8;

/// A sweep of an AOR splitting over a pair of five-point operators on one grid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sweep<'a, T> {
    grid: Grid,
    a: FivePointView<'a, T>,
    b: FivePointView<'a, T>,
    omega: Coefficients<'a, T>,
    gamma: T,
    q_factor: T,
}

impl<'a, T: Scalar> Sweep<'a, T> {
    /// The sweep over a problem whose operators are five-point ones on one grid.
    pub(crate) fn new<A: LinearOperator<T>, B: LinearOperator<T>>(
        problem: &'a Hlcp<T, A, B>,
    ) -> Option<Self> {
        let (a, b) = (problem.a().as_five_point()?, problem.b().as_five_point()?);
        let [nx, ny] = match (a.grid(), b.grid()) {
            (Some(a), Some(b)) if a != b => return None,
            (Some(grid), _) | (None, Some(grid)) => grid,
            (None, None) => [problem.order(), 1],
        };
        assert_eq!(nx * ny, problem.order(), "a grid of the problem's order");
        let omega = match problem.omega() {
            Omega::Uniform(omega) => Coefficients::Constant(*omega),
            Omega::Each(omega) => Coefficients::Each(omega),
        };
        let grid = Grid { nx, ny, backward: false };
        Some(Self { grid, a, b, omega, gamma: problem.gamma(), q_factor: problem.q_factor() })
    }

    /// The same sweep in the given direction.
    pub(crate) fn backward(self, backward: bool) -> Self {
        Self { grid: Grid { backward, ..self.grid }, ..self }
    }

    /// The norms of `A z − B r + q`, or after an exchange, whose operators these are, of `A r − B z − q`.
    pub(crate) fn residual(&self, q: &Rhs<'_, T>, z: &[T], r: &[T]) -> Norms {
        let sign = self.q_factor / self.gamma;
        let (z, r) = if sign < T::zero() { (r, z) } else { (z, r) };
        let Grid { nx, ny, .. } = self.grid;
        let (mut az, mut br) = ([T::zero(); COLUMNS], [T::zero(); COLUMNS]);
        let (meter, mut sum) = (q.meter(T::one()), Tally::zero());
        for j in 0..ny {
            for start in (0..nx).step_by(COLUMNS) {
                let length = COLUMNS.min(nx - start);
                let (az, br) = (&mut az[..length], &mut br[..length]);
                self.a.product(nx, j, start, z, az);
                self.b.product(nx, j, start, r, br);
                let q = &q.entries()[j * nx + start..][..length];
                for ((az, &br), &q) in az.iter_mut().zip(&*br).zip(q) {
                    *az = *az - br + sign * q;
                }
                meter.add_to(&mut sum, az);
            }
        }
        meter.norms_of(&sum, T::one())
    }

    /// Overwrites `y` with the next iterate and returns the norms of F(x)/γ.
    pub(crate) fn run<const ACCELERATED: bool>(
        &self,
        relaxation: [Relaxation<T>; 2],
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
    ) -> Norms {
        self.run_on::<ACCELERATED>(Arch::new(), relaxation, q, x, y)
    }

    fn run_on<const ACCELERATED: bool>(
        &self,
        arch: Arch,
        relaxation: [Relaxation<T>; 2],
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
    ) -> Norms {
        let Self { grid, omega, gamma, q_factor, .. } = *self;
        let (a, b) = (self.a.coefficients(), self.b.coefficients());
        let old = Old { grid, q: q.entries(), x, gamma, q_factor, meter: q.meter(gamma) };
        if let (Some(a), Some(b), Coefficients::Constant(omega)) = (constant(a), constant(b), omega)
        {
            let b_omega = b.map(|b| b * omega);
            let source = if grid.backward {
                Constant::new::<true, ACCELERATED>(relaxation, a, b_omega)
            } else {
                Constant::new::<false, ACCELERATED>(relaxation, a, b_omega)
            };
            old.sweep::<_, ACCELERATED>(arch, &source, y)
        } else {
            let source = Varying { grid, relaxation, a, b, omega };
            old.sweep::<_, ACCELERATED>(arch, &source, y)
        }
    }
}

/// The coefficients, if all are constant.
fn constant<T: Scalar>(coefficients: [Coefficients<'_, T>; 5]) -> Option<[T; 5]> {
    let all = coefficients.iter().all(|c| matches!(c, Coefficients::Constant(_)));
    all.then(|| coefficients.map(|c| c.at(0)))
}

/// What a sweep reads of the old iterate.
#[derive(Debug, Clone, Copy)]
struct Old<'a, T> {
    grid: Grid,
    q: &'a [T],
    x: &'a [T],
    gamma: T,
    q_factor: T,
    meter: Meter,
}

impl<T: Scalar> Old<'_, T> {
    fn sweep<S: Source<T>, const ACCELERATED: bool>(
        &self,
        arch: Arch,
        source: &S,
        y: &mut [T],
    ) -> Norms {
        let mut sum = Tally::zero();
        if self.grid.backward {
            arch.dispatch(Whole::<_, _, true, ACCELERATED> { old: self, source, y, sum: &mut sum });
        } else {
            arch.dispatch(Whole::<_, _, false, ACCELERATED> {
                old: self,
                source,
                y,
                sum: &mut sum,
            });
        }
        self.meter.norms_of(&sum, self.gamma)
    }
}

/// A sweep over the whole grid by one thread.
struct Whole<'a, T, S, const BACKWARD: bool, const ACCELERATED: bool> {
    old: &'a Old<'a, T>,
    source: &'a S,
    y: &'a mut [T],
    sum: &'a mut Tally<T>,
}

impl<T: Scalar, S: Source<T>, const BACKWARD: bool, const ACCELERATED: bool> WithSimd
    for Whole<'_, T, S, BACKWARD, ACCELERATED>
{
    type Output = ();

    #[inline(always)]
    fn with_simd<V: Simd>(self, _: V) {
        let Self { old, source, y, sum } = self;
        let Grid { nx, ny, .. } = old.grid;
        let mut worker = Worker::new(old, source);
        for done in (0..ny).step_by(ROWS) {
            let height = ROWS.min(ny - done);
            if BACKWARD {
                let (rest, passed) = y.split_at_mut((ny - done) * nx);
                let (_, band) = rest.split_at_mut((ny - done - height) * nx);
                let passed = &passed[..nx.min(passed.len())];
                let first = ny - done - height;
                sum.add(&worker.relax::<BACKWARD, ACCELERATED>(first, band, passed));
            } else {
                let (passed, rest) = y.split_at_mut(done * nx);
                let passed = &passed[passed.len().saturating_sub(nx)..];
                let band = &mut rest[..height * nx];
                sum.add(&worker.relax::<BACKWARD, ACCELERATED>(done, band, passed));
            }
        }
    }
}

/// The grid and the direction of the sweep.
#[derive(Debug, Clone, Copy)]
struct Grid {
    nx: usize,
    ny: usize,
    backward: bool,
}

#[cfg(test)]
mod tests;
