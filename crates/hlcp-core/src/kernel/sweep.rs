use std::ops::Range;

use pulp::Arch;

use super::{
    coefficients::{ConstantRows, Source, VaryingRows},
    grid::{COLUMNS, Grid, Multiple, Old, ROWS, columns},
    tile::{Edge, Worker},
};
use crate::{
    numbers::{BLOCK, Compiled, Meter, Norms, Rhs, Scalar, Stretches, Tally, Totals, vectorised},
    operators::{Coefficients, Direction, FivePointView, Omega},
    parallel::{Breaker, Claims, OrderedSum, Shared, Strip, Turns, team, totals},
    rows::Relaxation,
};

/// A sweep of an AOR splitting over a pair of five-point operators on one grid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sweep<'a, T> {
    pub(super) grid: Grid,
    pub(super) a: FivePointView<'a, T>,
    pub(super) b: FivePointView<'a, T>,
    pub(super) omega: Coefficients<'a, T>,
    /// Ω west and east of the grid, where other ranks have it go on.
    pub(super) omega_beside: [&'a [T]; 2],
    pub(super) gamma: T,
    pub(super) q_factor: T,
    pub(crate) parallel: bool,
    pub(super) shared: Option<&'a Shared<T>>,
}

impl<'a, T: Scalar> Sweep<'a, T> {
    /// Returns the forward sweep over `A` and `B`, seen on a grid of `[nx, ny]` points that closes
    /// in the directions `round`; `q_factor` is what multiplies `q` in F.
    pub(crate) fn new(
        ([nx, ny], round): ([usize; 2], [bool; 2]),
        [a, b]: [FivePointView<'a, T>; 2],
        omega: &'a Omega<T>,
        [gamma, q_factor]: [T; 2],
        parallel: bool,
        shared: Option<&'a Shared<T>>,
    ) -> Self {
        let omega = omega.coefficients();
        let omega_beside = shared.map_or([&[][..]; 2], |shared| columns(&shared.omega));
        let grid = Grid { nx, ny, backward: false, red_black: false, round };
        Self { grid, a, b, omega, omega_beside, gamma, q_factor, parallel, shared }
    }

    /// Returns the same sweep in the given direction, in lexicographic or in red–black order.
    pub(crate) fn directed(self, backward: bool, red_black: bool) -> Self {
        Self { grid: Grid { backward, red_black, ..self.grid }, ..self }
    }

    /// Returns the same sweep with the ratio of the diagonals for Ω.
    pub(crate) fn scaled(self, scaling: &'a Omega<T>) -> Self {
        let omega_beside = self.shared.map_or([&[][..]; 2], |shared| columns(&shared.scaling));
        Self { omega: scaling.coefficients(), omega_beside, ..self }
    }

    /// Returns the rows of `A` and of `BΩ`, if all are the same but for the grid's edge.
    pub(crate) fn constants(&self) -> Option<[[T; 5]; 2]> {
        let (a, b) = (self.a.constants()?, self.b.constants()?);
        let Coefficients::Uniform(omega) = self.omega else { return None };
        let everywhere = self.shared.is_none_or(|shared| shared.constant);
        everywhere.then(|| [a, b.map(|b| b * omega)])
    }

    /// Returns the ranks that share the grid.
    pub(crate) fn strip(&self) -> Option<&'a Strip> {
        self.shared.map(|shared| &shared.strip)
    }

    /// Returns the stretches of the grid's columns.
    pub(crate) fn stretches(&self) -> Stretches {
        self.strip().map_or(Stretches::of(self.grid()), Strip::stretches)
    }

    /// Returns the columns of a vector west and east of the grid, where other ranks have it go on.
    pub(crate) fn beside(&self, v: &[T]) -> [Vec<T>; 2] {
        self.strip().map_or([vec![], vec![]], |strip| strip.beside(1, |k| v[k]))
    }

    /// Returns the operators `A` and `B`.
    pub(crate) fn views(&self) -> [FivePointView<'a, T>; 2] {
        [self.a, self.b]
    }

    /// Returns the number of points in a row and of rows.
    pub(crate) fn grid(&self) -> [usize; 2] {
        [self.grid.nx, self.grid.ny]
    }

    /// Returns the norms of `A z − B r + q`, or after an exchange, whose operators these are, of
    /// `A r − B z − q`.
    pub(crate) fn residual(&self, q: &Rhs<'_, T>, z: &[T], r: &[T], meter: Meter) -> Norms {
        RESIDUAL.of::<Residual<T>>()(self, q, z, r, meter)
    }

    fn measure(&self, q: &Rhs<'_, T>, z: &[T], r: &[T], meter: Meter) -> Norms {
        let (arch, sign) = (Arch::new(), self.q_factor / self.gamma);
        let (z, r) = if sign < T::zero() { (r, z) } else { (z, r) };
        let (nx, z_beside, r_beside) = (self.grid.nx, self.beside(z), self.beside(r));
        let add = |tally: &mut Tally<T>, at: Range<usize>| {
            let [mut az, mut br] = [[T::zero(); BLOCK]; 2];
            let (az, br) = (&mut az[..at.len()], &mut br[..at.len()]);
            let (j, start) = (at.start / nx, at.start % nx);
            let is_end = [start == 0, start + at.len() == nx];
            let ends = |beside: &[Vec<T>; 2]| {
                [0, 1].map(|side| beside[side].get(j).copied().filter(|_| is_end[side]))
            };
            let (z_ends, r_ends) = (ends(&z_beside), ends(&r_beside));
            vectorised(
                arch,
                #[inline(always)]
                || {
                    self.a.product(nx, j, start, z, z_ends, az);
                    self.b.product(nx, j, start, r, r_ends, br);
                    for ((az, &br), &q) in az.iter_mut().zip(&*br).zip(&q.entries()[at]) {
                        *az = *az - br + sign * q;
                    }
                },
            );
            tally.add(meter, az);
        };
        let sum = totals(self.stretches(), self.parallel, &add).sum(self.strip());
        meter.norms_of(sum, T::one())
    }

    /// Overwrites `y` with the next iterate and returns the norms of F(x)/γ.
    pub(crate) fn run(
        &self,
        accelerated: bool,
        relaxation: [Relaxation<T>; 2],
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
    ) -> Norms {
        RUN.of::<Run<T>>()(self, accelerated, relaxation, q, x, y)
    }

    fn run_here(
        &self,
        accelerated: bool,
        relaxation: [Relaxation<T>; 2],
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
    ) -> Norms {
        if accelerated {
            self.run_on::<true>(Arch::new(), relaxation, q, x, y)
        } else {
            self.run_on::<false>(Arch::new(), relaxation, q, x, y)
        }
    }

    pub(super) fn run_on<const ACCELERATED: bool>(
        &self,
        arch: Arch,
        relaxation: [Relaxation<T>; 2],
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
    ) -> Norms {
        let beside = self.beside(x);
        let old = self.old((self.q_factor, q.entries()), x, &beside, q.meter(self.gamma));
        match self.constant::<ACCELERATED, false>(relaxation) {
            Some(source) => old.sweep::<_, ACCELERATED>(arch, &source, y),
            None => old.sweep::<_, ACCELERATED>(arch, &self.varying::<false>(relaxation), y),
        }
    }

    /// Returns what a sweep of `x` reads, given its columns beside the grid.
    pub(super) fn old<'o>(
        &'o self,
        (q_factor, q): Multiple<'o, T>,
        x: &'o [T],
        beside: &'o [Vec<T>; 2],
        meter: Meter,
    ) -> Old<'o, T> {
        let Self { grid, gamma, parallel, .. } = *self;
        let (strip, stretches, beside) = (self.strip(), self.stretches(), columns(beside));
        let new = [&[][..]; 2];
        Old { grid, q, x, gamma, q_factor, meter, parallel, strip, stretches, beside, new }
    }

    /// Returns the row that all are, if they are.
    pub(super) fn constant<const ACCELERATED: bool, const LEAN: bool>(
        &self,
        relaxation: [Relaxation<T>; 2],
    ) -> Option<ConstantRows<T, LEAN>> {
        let [a, b_omega] = self.constants()?;
        Some(ConstantRows::new::<ACCELERATED>(relaxation, a, b_omega))
    }

    pub(super) fn varying<const LEAN: bool>(
        &self,
        relaxation: [Relaxation<T>; 2],
    ) -> VaryingRows<'a, T, LEAN> {
        let (a, b) = (self.a.coefficients(), self.b.coefficients());
        let Self { grid, omega, omega_beside, .. } = *self;
        VaryingRows { grid, relaxation, a, b, omega, omega_beside }
    }
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
    pub(super) fn lexicographic<S: Source<T>, const ACCELERATED: bool>(
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
        let turns: Vec<_> = (0..stretches).map(|_| Turns::new([[T::zero(); COLUMNS]; 2])).collect();
        let (bands, sum) = (Claims::new(bands.enumerate()), OrderedSum::new());
        team::spread(threads, &|| {
            let Grid { nx, ny, .. } = self.grid;
            let _breaker = Breaker(&turns);
            let mut worker = Worker::new(arch, self, source);
            let mut rows: [&[T]; 2] = [&[]; 2];
            while let Some((number, band)) = bands.next() {
                let (done, height) = (number * ROWS, band.len() / nx);
                let first = if BACKWARD { ny - done - height } else { done };
                let edge = Edge { number, rows, turns: &turns };
                worker.relax::<BACKWARD, ACCELERATED>(first, band, edge);
                if let Some((_, tallies)) = &mut worker.measured {
                    sum.add(number, tallies.take(0..nx));
                }
                let [south, north] = [&band[..nx], &band[(height - 1) * nx..]];
                let [first, last] = if BACKWARD { [north, south] } else { [south, north] };
                rows = [last, if number == 0 { first } else { rows[1] }];
            }
        });
        sum.total()
    }
}

type Run<T> = fn(&Sweep<'_, T>, bool, [Relaxation<T>; 2], &Rhs<'_, T>, &[T], &mut [T]) -> Norms;

static RUN: Compiled<Run<f32>, Run<f64>> = Compiled(
    |sweep, accelerated, relaxation, q, x, y| sweep.run_here(accelerated, relaxation, q, x, y),
    |sweep, accelerated, relaxation, q, x, y| sweep.run_here(accelerated, relaxation, q, x, y),
);

type Residual<T> = fn(&Sweep<'_, T>, &Rhs<'_, T>, &[T], &[T], Meter) -> Norms;

static RESIDUAL: Compiled<Residual<f32>, Residual<f64>> = Compiled(
    |sweep, q, z, r, meter| sweep.measure(q, z, r, meter),
    |sweep, q, z, r, meter| sweep.measure(q, z, r, meter),
);
