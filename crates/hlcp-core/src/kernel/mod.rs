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
//! with `s(v) = mᵢⱼ v/mᵢᵢ`, and for the accelerated method `s(v) = (mᵢⱼ v + (aᵢⱼ − bᵢⱼωⱼ)|v|)/mᵢᵢ`.
//! The first phase meets every `Fᵢ(x)`, which is all that the norms of the input take. The chain is
//! as long as the row and each link waits for the one before; [`ROWS`] chains therefore run side by
//! side, row `k` one column behind row `k − 1`, whose last value is then the southern neighbour.
//! Nothing is reordered: every `yᵢ` is computed from the same numbers by the same operations as in
//! a loop over the points.
//!
//! The grid is worked through in bands of [`ROWS`] rows. Several threads claim them in order and
//! form a pipeline: the first phase of a band waits for nothing, and its recurrence enters a
//! stretch of columns when that of the band before has left it, taking over the last row's values.
//! Each band's sums of squares are added in the order of the bands. In red–black order, see
//! [`red_black`], bands wait for nothing.
//!
//! Where the grid closes, the point at either end of a row is the other one's neighbour. What the
//! first point of a sweep takes from the last is old, and what the last takes from the first is
//! new: the first phase puts the old values into the place of those beyond the edge and moves both
//! shares to the side of M or N that they belong to, and the recurrence ends a row, and the last
//! row, with the new one.
//!
//! No `mul_add` and no reassociation: the same bits on every processor and for every number of
//! threads.

mod coefficients;
mod red_black;
mod smoother;
mod tile;
mod transfer;

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use self::{
    coefficients::{ConstantRows, Source, VaryingRows},
    tile::{Edge, Worker},
};
use crate::{
    Coefficients, FivePointView, Norms, Omega, Rhs, Scalar, Strip,
    norms::{Meter, Stretches, Tallies, Totals},
    strip::Shared,
    team::{self, Breaker, Claims, Sum, Turns},
};

pub(crate) use self::coefficients::Relaxation;
pub(crate) use self::{smoother::Multiple, transfer::Order};
pub use self::{smoother::Smoother, transfer::Transfer};

/// Rows that are relaxed side by side.
const ROWS: usize = 8;
/// The most columns of a row that are done in one go.
const COLUMNS: usize = 512;
/// Between arrays of a worker, so that those of a power of two do not compete for the same lines of
/// the cache.
const PAD: usize = 8;

/// A sweep of an AOR splitting over a pair of five-point operators on one grid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sweep<'a, T> {
    grid: Grid,
    a: FivePointView<'a, T>,
    b: FivePointView<'a, T>,
    omega: Coefficients<'a, T>,
    /// Ω west and east of the grid, where other ranks have it go on.
    omega_beside: [&'a [T]; 2],
    gamma: T,
    q_factor: T,
    parallel: bool,
    shared: Option<&'a Shared<T>>,
}

impl<'a, T: Scalar> Sweep<'a, T> {
    /// The forward sweep over `A` and `B`, seen on a grid of `[nx, ny]` points that closes in the
    /// directions `round`; `q_factor` is what multiplies `q` in F.
    pub(crate) fn new(
        ([nx, ny], round): ([usize; 2], [bool; 2]),
        [a, b]: [FivePointView<'a, T>; 2],
        omega: &'a Omega<T>,
        [gamma, q_factor]: [T; 2],
        parallel: bool,
        shared: Option<&'a Shared<T>>,
    ) -> Self {
        let omega = omega.view();
        let omega_beside = shared.map_or([&[][..]; 2], |shared| columns(&shared.omega));
        let grid = Grid { nx, ny, backward: false, red_black: false, round };
        Self { grid, a, b, omega, omega_beside, gamma, q_factor, parallel, shared }
    }

    /// The same sweep in the given direction, in lexicographic or in red–black order.
    pub(crate) fn directed(self, backward: bool, red_black: bool) -> Self {
        Self { grid: Grid { backward, red_black, ..self.grid }, ..self }
    }

    /// The same sweep with the ratio of the diagonals for Ω.
    fn scaled(self, scaling: &'a Omega<T>) -> Self {
        let omega_beside = self.shared.map_or([&[][..]; 2], |shared| columns(&shared.scaling));
        Self { omega: scaling.view(), omega_beside, ..self }
    }

    /// Whether all rows are the same but for the grid's edge.
    pub(crate) fn is_constant(&self) -> bool {
        matches!(self.omega, Coefficients::Constant(_))
            && self.views().into_iter().all(|view| view.constants().is_some())
            && self.shared.is_none_or(|shared| shared.constant)
    }

    /// The ranks that share the grid.
    pub(crate) fn strip(&self) -> Option<&'a Strip> {
        self.shared.map(|shared| &shared.strip)
    }

    /// The stretches of the grid's columns.
    pub(crate) fn stretches(&self) -> Stretches {
        self.strip().map_or(Stretches::of(self.grid()), Strip::stretches)
    }

    /// The columns of a vector west and east of the grid, where other ranks have it go on.
    pub(crate) fn beside(&self, v: &[T]) -> [Vec<T>; 2] {
        self.strip().map_or([vec![], vec![]], |strip| strip.beside(1, |k| v[k]))
    }

    /// Ω on the grid, and there.
    pub(crate) fn omega(&self) -> (Coefficients<'a, T>, [&'a [T]; 2]) {
        (self.omega, self.omega_beside)
    }

    /// γ, and what multiplies `q` in F.
    pub(crate) fn factors(&self) -> [T; 2] {
        [self.gamma, self.q_factor]
    }

    /// The operators `A` and `B`.
    pub(crate) fn views(&self) -> [FivePointView<'a, T>; 2] {
        [self.a, self.b]
    }

    /// The number of points in a row and of rows.
    pub(crate) fn grid(&self) -> [usize; 2] {
        [self.grid.nx, self.grid.ny]
    }

    /// Which directions of the grid close round.
    pub(crate) fn round(&self) -> [bool; 2] {
        self.grid.round
    }

    /// Whether threads share the work.
    pub(crate) fn parallel(&self) -> bool {
        self.parallel
    }

    /// The norms of `A z − B r + q`, or after an exchange, whose operators these are, of
    /// `A r − B z − q`.
    pub(crate) fn residual(&self, q: &Rhs<'_, T>, z: &[T], r: &[T], meter: Meter) -> Norms {
        (T::loops().residual)(self, q, z, r, meter)
    }

    pub(crate) fn measure(&self, q: &Rhs<'_, T>, z: &[T], r: &[T], meter: Meter) -> Norms {
        let sign = self.q_factor / self.gamma;
        let (z, r) = if sign < T::zero() { (r, z) } else { (z, r) };
        let Grid { nx, ny, .. } = self.grid;
        let (stretches, z_beside, r_beside) = (self.stretches(), self.beside(z), self.beside(r));
        let bands = Claims::new((0..ny).step_by(ROWS).enumerate());
        let sum = Sum::new();
        team::spread(team::threads(self.parallel, nx * ny), &|| {
            let (mut az, mut br) = ([T::zero(); COLUMNS], [T::zero(); COLUMNS]);
            let mut tallies = Tallies::new(stretches);
            while let Some((number, first)) = bands.next() {
                for j in first..ny.min(first + ROWS) {
                    for start in (0..nx).step_by(COLUMNS) {
                        let length = COLUMNS.min(nx - start);
                        let (az, br) = (&mut az[..length], &mut br[..length]);
                        let at = [start == 0, start + length == nx];
                        let ends = |beside: &[Vec<T>; 2]| {
                            [0, 1].map(|side| beside[side].get(j).copied().filter(|_| at[side]))
                        };
                        self.a.product_beside(nx, j, start, z, ends(&z_beside), az);
                        self.b.product_beside(nx, j, start, r, ends(&r_beside), br);
                        let q = &q.entries()[j * nx + start..][..length];
                        for ((az, &br), &q) in az.iter_mut().zip(&*br).zip(q) {
                            *az = *az - br + sign * q;
                        }
                        tallies.add(meter, start, az);
                    }
                }
                sum.add(number, tallies.take(0..nx));
            }
        });
        meter.norms_of(sum.total().sum(self.strip()), T::one())
    }

    /// Overwrites `y` with the next iterate and returns the norms of F(x)/γ.
    pub(crate) fn run<const ACCELERATED: bool>(
        &self,
        relaxation: [Relaxation<T>; 2],
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
    ) -> Norms {
        T::loops().sweep[usize::from(ACCELERATED)](self, relaxation, q, x, y)
    }

    pub(crate) fn run_on<const ACCELERATED: bool>(
        &self,
        arch: Arch,
        relaxation: [Relaxation<T>; 2],
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
    ) -> Norms {
        let Self { grid, gamma, q_factor, parallel, .. } = *self;
        let (q, meter) = (q.entries(), q.meter(gamma));
        let (strip, stretches, beside) = (self.strip(), self.stretches(), self.beside(x));
        let beside = columns(&beside);
        let old = Old {
            grid,
            q,
            x,
            gamma,
            q_factor,
            meter,
            parallel,
            strip,
            stretches,
            beside,
            new: [&[]; 2],
        };
        match self.constant::<ACCELERATED, false>(relaxation) {
            Some(source) => old.sweep::<_, ACCELERATED>(arch, &source, y),
            None => old.sweep::<_, ACCELERATED>(arch, &self.varying::<false>(relaxation), y),
        }
    }

    /// The row that all are, if they are.
    fn constant<const ACCELERATED: bool, const LEAN: bool>(
        &self,
        relaxation: [Relaxation<T>; 2],
    ) -> Option<ConstantRows<T, LEAN>> {
        if self.shared.is_some_and(|shared| !shared.constant) {
            return None;
        }
        let (a, b) = (self.a.constants()?, self.b.constants()?);
        let Coefficients::Constant(omega) = self.omega else { return None };
        Some(ConstantRows::new::<ACCELERATED>(relaxation, a, b.map(|b| b * omega)))
    }

    fn varying<const LEAN: bool>(
        &self,
        relaxation: [Relaxation<T>; 2],
    ) -> VaryingRows<'a, T, LEAN> {
        let (a, b) = (self.a.coefficients(), self.b.coefficients());
        let Self { grid, omega, omega_beside, .. } = *self;
        VaryingRows { grid, relaxation, a, b, omega, omega_beside }
    }
}

fn columns<T>(beside: &[Vec<T>; 2]) -> [&[T]; 2] {
    beside.each_ref().map(Vec::as_slice)
}

/// The part of the old iterate that a sweep reads.
#[derive(Debug, Clone, Copy)]
struct Old<'a, T> {
    grid: Grid,
    q: &'a [T],
    x: &'a [T],
    gamma: T,
    q_factor: T,
    meter: Meter,
    parallel: bool,
    strip: Option<&'a Strip>,
    stretches: Stretches,
    /// `x` west and east of the grid, where other ranks have it go on.
    beside: [&'a [T]; 2],
    /// The first colour of the new iterate there.
    new: [&'a [T]; 2],
}

impl<T: Scalar> Old<'_, T> {
    fn sweep<S: Source<T>, const ACCELERATED: bool>(
        &self,
        arch: Arch,
        source: &S,
        y: &mut [T],
    ) -> Norms {
        let sum = if self.grid.red_black {
            self.red_black::<_, ACCELERATED>(arch, source, y)
        } else {
            self.lexicographic::<_, ACCELERATED>(arch, source, y)
        };
        self.meter.norms_of(sum.sum(self.strip), self.gamma)
    }

    /// Relaxes all of `y` in lexicographic order, and sums the squares of F(x).
    fn lexicographic<S: Source<T>, const ACCELERATED: bool>(
        &self,
        arch: Arch,
        source: &S,
        y: &mut [T],
    ) -> Totals {
        let Grid { nx, backward, .. } = self.grid;
        if backward {
            self.pass::<_, _, true, ACCELERATED>(arch, source, y.rchunks_mut(nx * ROWS))
        } else {
            self.pass::<_, _, false, ACCELERATED>(arch, source, y.chunks_mut(nx * ROWS))
        }
    }

    /// Relaxes the bands of `y`, which come in sweep order, and sums the squares of F(x).
    fn pass<'y, S, I, const BACKWARD: bool, const ACCELERATED: bool>(
        &self,
        arch: Arch,
        source: &S,
        bands: I,
    ) -> Totals
    where
        S: Source<T>,
        I: ExactSizeIterator<Item = &'y mut [T]> + Send,
    {
        let threads = team::threads(self.parallel, self.x.len()).min(bands.len());
        let stretches = if threads > 1 { self.grid.nx.div_ceil(S::CHUNK) } else { 0 };
        let edges: Vec<_> = (0..stretches).map(|_| Turns::new([[T::zero(); COLUMNS]; 2])).collect();
        let (bands, sum) = (Claims::new(bands.enumerate()), Sum::new());
        team::spread(threads, &|| {
            arch.dispatch(Bands::<_, _, _, BACKWARD, ACCELERATED> {
                old: self,
                source,
                bands: &bands,
                edges: &edges,
                sum: &sum,
            });
        });
        sum.total()
    }

    /// Relaxes all of `y` in red–black order, and sums the squares of F(x).
    fn red_black<S: Source<T>, const ACCELERATED: bool>(
        &self,
        arch: Arch,
        source: &S,
        y: &mut [T],
    ) -> Totals {
        let new = self.strip.map_or([vec![], vec![]], |strip| {
            strip.exchange(1, red_black::first_colours::<_, _, ACCELERATED>(self, source))
        });
        let old = &Old { new: columns(&new), ..*self };
        let bands = y.chunks_mut(self.grid.nx * red_black::HEIGHT);
        let threads = team::threads(self.parallel, self.x.len()).min(bands.len());
        let (bands, sum) = (Claims::new(bands.enumerate()), Sum::new());
        team::spread(threads, &|| {
            arch.dispatch(red_black::Bands::<_, _, _, ACCELERATED> {
                old,
                source,
                bands: &bands,
                sum: &sum,
            });
        });
        sum.total()
    }
}

/// One thread's share of a sweep in lexicographic order.
struct Bands<'a, T, S, I, const BACKWARD: bool, const ACCELERATED: bool> {
    old: &'a Old<'a, T>,
    source: &'a S,
    bands: &'a Claims<I>,
    edges: &'a [Turns<[[T; COLUMNS]; 2]>],
    sum: &'a Sum,
}

impl<'y, T, S, I, const BACKWARD: bool, const ACCELERATED: bool> WithSimd
    for Bands<'_, T, S, I, BACKWARD, ACCELERATED>
where
    T: Scalar,
    S: Source<T>,
    I: Iterator<Item = (usize, &'y mut [T])>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<V: Simd>(self, _: V) {
        let Self { old, source, bands, edges, sum } = self;
        let Grid { nx, ny, .. } = old.grid;
        let _breaker = Breaker(edges);
        let mut worker = Worker::new(old, source);
        let mut rows: [&[T]; 2] = [&[]; 2];
        while let Some((number, band)) = bands.next() {
            let (done, height) = (number * ROWS, band.len() / nx);
            let first = if BACKWARD { ny - done - height } else { done };
            let edge = if edges.is_empty() {
                Edge::Own { rows, number }
            } else {
                Edge::Passed { edges, number }
            };
            worker.relax::<BACKWARD, ACCELERATED>(first, band, edge);
            if !S::LEAN {
                sum.add(number, worker.tallies.take(0..nx));
            }
            let [south, north] = [&band[..nx], &band[(height - 1) * nx..]];
            let [first, last] = if BACKWARD { [north, south] } else { [south, north] };
            rows = [last, if number == 0 { first } else { rows[1] }];
        }
    }
}

/// The grid, and the direction and the order of the sweep; a grid that closes is swept in
/// lexicographic order.
#[derive(Debug, Clone, Copy)]
struct Grid {
    nx: usize,
    ny: usize,
    backward: bool,
    red_black: bool,
    /// Whether it closes along a row and along a column.
    round: [bool; 2],
}

impl Grid {
    /// The values beyond the western and the eastern end of row `j`, where some columns reach
    /// these: those `beside` the grid, those across one that closes, or 0.
    #[inline(always)]
    fn ends<T: Scalar>(
        &self,
        x: &[T],
        beside: [&[T]; 2],
        j: usize,
        columns: &Range<usize>,
    ) -> [Option<T>; 2] {
        let Self { nx, round: [round, _], .. } = *self;
        let value = |side: usize| match beside[side].get(j) {
            Some(&beside) => beside,
            None if round => x[j * nx + [nx - 1, 0][side]],
            None => T::zero(),
        };
        let at = [columns.start == 0, columns.end == nx];
        [0, 1].map(|side| at[side].then(|| value(side)))
    }
}

#[cfg(test)]
mod tests;
