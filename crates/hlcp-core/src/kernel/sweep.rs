use std::ops::Range;

use pulp::Arch;

use super::{
    coefficients::{ConstantRows, Row, Source, VaryingRows},
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
        let (f, meter) = ((self.q_factor, q.entries()), q.meter(self.gamma));
        let sum = self.relax(accelerated, relaxation, f, Some(meter), x, y);
        meter.norms_of(sum.sum(self.strip()), self.gamma)
    }

    /// Overwrites `y` with the next iterate, where `f` is what takes the place of γq in F, as a
    /// factor and the vector that it multiplies. Sums the squares of F(x) if there is a meter; see
    /// [`Old::meter`] for what a sweep does without.
    pub(super) fn relax(
        &self,
        accelerated: bool,
        relaxation: [Relaxation<T>; 2],
        f: Multiple<'_, T>,
        meter: Option<Meter>,
        x: &[T],
        y: &mut [T],
    ) -> Totals {
        RELAX.of::<Relax<T>>()(self, accelerated, relaxation, f, meter, x, y)
    }

    pub(super) fn relax_on<const ACCELERATED: bool>(
        &self,
        arch: Arch,
        relaxation: [Relaxation<T>; 2],
        (q_factor, q): Multiple<'_, T>,
        meter: Option<Meter>,
        x: &[T],
        y: &mut [T],
    ) -> Totals {
        let Self { grid, parallel, .. } = *self;
        let (strip, stretches, beside) = (self.strip(), self.stretches(), self.beside(x));
        let (beside, new) = (columns(&beside), [&[][..]; 2]);
        let old = Old { grid, q, x, q_factor, meter, parallel, strip, stretches, beside, new };
        match self.constant::<ACCELERATED>(relaxation) {
            Some(source) => old.sweep::<_, ACCELERATED>(arch, &source, y),
            None => old.sweep::<_, ACCELERATED>(arch, &self.varying(relaxation), y),
        }
    }

    /// Returns the row that all are, if they are.
    pub(super) fn constant<const ACCELERATED: bool>(
        &self,
        relaxation: [Relaxation<T>; 2],
    ) -> Option<ConstantRows<T>> {
        let [a, b_omega] = self.constants()?;
        Some(ConstantRows(Row::new::<ACCELERATED>(relaxation, a, b_omega)))
    }

    pub(super) fn varying(&self, relaxation: [Relaxation<T>; 2]) -> VaryingRows<'a, T> {
        let (a, b) = (self.a.coefficients(), self.b.coefficients());
        let Self { grid, omega, omega_beside, .. } = *self;
        VaryingRows { grid, relaxation, a, b, omega, omega_beside }
    }
}

impl<T: Scalar> Old<'_, T> {
    /// Relaxes all of `y`, and sums the squares of F(x).
    fn sweep<S: Source<T>, const ACCELERATED: bool>(
        &self,
        arch: Arch,
        source: &S,
        y: &mut [T],
    ) -> Totals {
        let Grid { nx, backward, red_black, .. } = self.grid;
        if red_black {
            self.red_black::<_, ACCELERATED>(arch, source, y)
        } else if backward {
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

type Relax<T> = fn(
    &Sweep<'_, T>,
    bool,
    [Relaxation<T>; 2],
    Multiple<'_, T>,
    Option<Meter>,
    &[T],
    &mut [T],
) -> Totals;

static RELAX: Compiled<Relax<f32>, Relax<f64>> = Compiled(relax, relax);

fn relax<T: Scalar>(
    sweep: &Sweep<'_, T>,
    accelerated: bool,
    relaxation: [Relaxation<T>; 2],
    f: Multiple<'_, T>,
    meter: Option<Meter>,
    x: &[T],
    y: &mut [T],
) -> Totals {
    if accelerated {
        sweep.relax_on::<true>(Arch::new(), relaxation, f, meter, x, y)
    } else {
        sweep.relax_on::<false>(Arch::new(), relaxation, f, meter, x, y)
    }
}

type Residual<T> = fn(&Sweep<'_, T>, &Rhs<'_, T>, &[T], &[T], Meter) -> Norms;

static RESIDUAL: Compiled<Residual<f32>, Residual<f64>> = Compiled(
    |sweep, q, z, r, meter| sweep.measure(q, z, r, meter),
    |sweep, q, z, r, meter| sweep.measure(q, z, r, meter),
);
