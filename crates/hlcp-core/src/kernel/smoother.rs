//! One grid of multigrid: sweeps that solve each scalar equation, and defects.

use std::ops::Range;

use pulp::Arch;

use super::{
    Sweep, Transfer,
    coefficients::Source,
    grid::{Bands, COLUMNS, Grid, Multiple, ROWS, columns, zeros},
    tile::{Around, pieces},
    transfer::WEIGHTED,
};
use crate::{
    numbers::{
        Compiled, Meter, Norms, Rhs, Scalar, Stretches, Tallies, assert_lengths, vectorised,
    },
    parallel::{Claims, OrderedSum, team},
    rows::Relaxation,
};

/// The equation `K(x) + f = 0` with `K(x) = (A + BΩ)x + (A − BΩ)|x|` and Ω = D_A D_B⁻¹, for
/// five-point operators on one grid.
///
/// With this Ω the diagonal of K is linear, and so a sweep of the accelerated method AMGS
/// ([`Aor::accelerated`](crate::Aor::accelerated)) solves each scalar equation exactly. The sweeps
/// here are that method without the norms of its input: half the arithmetic. They share the fused
/// kernel of [`Aor`](crate::Aor), its dispatch and its threads.
///
/// # Cost
///
/// Everything walks the grid once and allocates nothing but what threads take, with the same bits
/// for any number of them.
///
/// # Panics
///
/// Everything panics unless the vectors have the grid's order.
#[doc(hidden)]
#[derive(Debug, Clone, Copy)]
pub struct Smoother<'a, T> {
    /// A problem's sweep, with Ω = D_A D_B⁻¹.
    pub(crate) sweep: Sweep<'a, T>,
}

impl<T: Scalar> Smoother<'_, T> {
    /// Overwrites `y` with what a sweep makes of `x`, where `f` is a factor and the vector that it
    /// multiplies.
    pub fn relax(&self, backward: bool, f: Multiple<'_, T>, x: &[T], y: &mut [T]) {
        self.assert_orders([("f", f.1.len()), ("x", x.len()), ("y", y.len())]);
        SMOOTH.of::<Smooth<T>>()(&self.sweep.directed(backward, false), f, x, y);
    }

    /// Takes a sweep with the problem's γ and `q` for `f` that also returns the norms of
    /// `A z − B r + q` at its input; its result is that of [`relax`](Self::relax) up to rounding.
    pub fn relax_measured(&self, backward: bool, q: &Rhs<'_, T>, x: &[T], y: &mut [T]) -> Norms {
        self.assert_orders([("q", q.entries().len()), ("x", x.len()), ("y", y.len())]);
        self.sweep.directed(backward, false).run(true, gauss_seidel(), q, x, y)
    }

    /// Returns the norms of `A z − B r + q` at `x`.
    pub fn norms(&self, q: &Rhs<'_, T>, x: &[T]) -> Norms {
        self.assert_orders([("q", q.entries().len()), ("x", x.len())]);
        let Sweep { grid, gamma, q_factor, .. } = self.sweep;
        let (stretches, meter) = (self.sweep.stretches(), q.meter(gamma));
        let (bands, sum) = (Claims::new(0..grid.ny.div_ceil(ROWS)), OrderedSum::new());
        let pass = Pass::Measure { bands, stretches, meter, sum: &sum };
        self.walk(Some((q_factor, q.entries())), x, &self.sweep.beside(x), &pass);
        meter.norms_of(sum.total().sum(self.sweep.strip()), gamma)
    }

    /// Takes `K(x)` off `f`.
    pub fn subtract(&self, x: &[T], f: &mut [T]) {
        self.assert_orders([("x", x.len()), ("f", f.len())]);
        let bands = Claims::new(f.chunks_mut(self.sweep.grid.nx * ROWS).enumerate());
        self.walk(None, x, &self.sweep.beside(x), &Pass::Subtract(bands));
    }

    /// Overwrites `coarse` with the full weighting of the defect `K(x) + f`: the transpose of
    /// [`Transfer::interpolate`] over the ratio of the cells' areas.
    pub fn restrict(&self, f: Multiple<'_, T>, x: &[T], transfer: &Transfer<T>, coarse: &mut [T]) {
        self.assert_orders([("f", f.1.len()), ("x", x.len())]);
        transfer.assert_orders(x.len(), coarse.len());
        let beside = self.sweep.beside(x);
        let defects_beside = self.sweep.strip().map_or([vec![], vec![]], |strip| {
            let [nx, ny] = self.sweep.grid();
            let width = nx.min(WEIGHTED);
            let mut ends = vec![T::zero(); 2 * width * ny];
            let rows = Claims::new(ends.chunks_mut(2 * width).enumerate());
            self.walk(Some(f), x, &beside, &Pass::RowEnds(rows));
            let column = |side: usize| {
                let rows = ends.chunks(width).skip(side).step_by(2);
                rows.flatten().map(|d| d.wide()).collect()
            };
            strip.exchange(WEIGHTED, [column(0), column(1)])
        });
        let pass =
            Pass::Restrict { bands: transfer.bands(coarse), transfer, beside: &defects_beside };
        self.walk(Some(f), x, &beside, &pass);
    }

    /// Hands a pass over the defect to threads, given the columns of `x` beside the grid.
    fn walk(&self, f: Option<Multiple<'_, T>>, x: &[T], beside: &[Vec<T>; 2], pass: &Pass<'_, T>) {
        WALK.of::<Walk<T>>()(self, f, x, beside, pass);
    }

    fn walk_here(
        &self,
        f: Option<Multiple<'_, T>>,
        x: &[T],
        beside: &[Vec<T>; 2],
        pass: &Pass<'_, T>,
    ) {
        match self.sweep.constant::<true, true>(gauss_seidel()) {
            Some(source) => self.walk_by(&source, f, x, beside, pass),
            None => self.walk_by(&self.sweep.varying::<true>(gauss_seidel()), f, x, beside, pass),
        }
    }

    fn walk_by<S: Source<T>>(
        &self,
        source: &S,
        f: Option<Multiple<'_, T>>,
        x: &[T],
        beside: &[Vec<T>; 2],
        pass: &Pass<'_, T>,
    ) {
        let Sweep { grid, parallel, .. } = self.sweep;
        let beside = columns(beside);
        team::spread(team::threads(parallel, x.len()), &|| {
            let (around, loaded) = (Around::new(grid, x, beside), source.loaded());
            pass.work(&mut Defects { arch: Arch::new(), nx: grid.nx, source, loaded, around, f });
        });
    }

    fn assert_orders<const K: usize>(&self, vectors: [(&str, usize); K]) {
        let [nx, ny] = self.sweep.grid();
        assert_lengths(nx * ny, vectors);
    }
}

pub(super) fn gauss_seidel<T: Scalar>() -> [Relaxation<T>; 2] {
    [Relaxation::new([T::one(); 2]); 2]
}

impl<T: Scalar> Sweep<'_, T> {
    /// Overwrites `y` with the smoother's sweep of `x`.
    pub(super) fn smooth_on(&self, arch: Arch, f: Multiple<'_, T>, x: &[T], y: &mut [T]) {
        let beside = self.beside(x);
        let old = self.old(f, x, &beside, Meter::for_size(1.0, x.len())); // it measures nothing
        match self.constant::<true, true>(gauss_seidel()) {
            Some(source) => old.lexicographic::<_, true>(arch, &source, y),
            None => old.lexicographic::<_, true>(arch, &self.varying::<true>(gauss_seidel()), y),
        };
    }
}

/// The defect of one thread, row by row.
pub(super) struct Defects<'a, T, S: Source<T>> {
    pub(super) arch: Arch,
    nx: usize,
    source: &'a S,
    loaded: S::Loaded,
    around: Around<'a, T>,
    f: Option<Multiple<'a, T>>,
}

impl<T: Scalar, S: Source<T>> Defects<'_, T, S> {
    /// Overwrites `d` with a stretch of row `j`, of at most [`COLUMNS`] columns.
    pub(super) fn row(&mut self, j: usize, columns: Range<usize>, d: &mut [T]) {
        for stretch in pieces::<false>(columns.clone(), S::CHUNK) {
            let n = stretch.len();
            let d = &mut d[stretch.start - columns.start..][..n];
            let (factor, f) = match self.f {
                Some((factor, f)) => (factor, &f[j * self.nx + stretch.start..][..n]),
                None => (T::zero(), &zeros()[..n]),
            };
            self.source.load(j, stretch.clone(), &mut self.loaded);
            let ends = self.around.ends(j, &stretch);
            let around = self.around.stretch(j, stretch);
            let (source, loaded) = (self.source, &self.loaded);
            vectorised(
                self.arch,
                #[inline(always)]
                || defect_phase(source, loaded, around, ends, f, factor, d),
            );
        }
    }
}

/// Computes the defect of a stretch of a row, given its five neighbours and the values beyond the
/// ends of the row.
#[inline(always)]
fn defect_phase<T: Scalar, S: Source<T>>(
    source: &S,
    loaded: &S::Loaded,
    [south, west, here, east, north]: [&[T]; 5],
    [to_west, to_east]: [Option<T>; 2],
    f: &[T],
    factor: T,
    d: &mut [T],
) {
    let n = d.len().min(S::CHUNK);
    let (south, west, here, east, north) =
        (&south[..n], &west[..n], &here[..n], &east[..n], &north[..n]);
    let (f, d) = (&f[..n], &mut d[..n]);
    for i in 0..n {
        let x = [south[i], west[i], here[i], east[i], north[i]];
        d[i] = source.row::<true>(loaded, i).defect(x, factor * f[i]);
    }
    let mut edge = |i: usize| {
        let west = to_west.filter(|_| i == 0).unwrap_or(west[i]);
        let east = to_east.filter(|_| i + 1 == n).unwrap_or(east[i]);
        let x = [south[i], west, here[i], east, north[i]];
        d[i] = source.row::<true>(loaded, i).defect(x, factor * f[i]);
    };
    if to_west.is_some() {
        edge(0);
    }
    if to_east.is_some() {
        edge(n - 1);
    }
}

/// Work on the rows of a defect, which threads share by bands.
enum Pass<'a, T> {
    /// Sums the squares of all.
    Measure { bands: Claims<Range<usize>>, stretches: Stretches, meter: Meter, sum: &'a OrderedSum },
    /// Takes K(x) off the bands of rows of a vector.
    Subtract(Bands<'a, T>),
    /// Restricts the defect, of which other ranks have the columns `beside`, to bands of coarse
    /// rows.
    Restrict { bands: Bands<'a, T>, transfer: &'a Transfer<T>, beside: &'a [Vec<T>; 2] },
    /// Overwrites rows of a short vector with the first and as many last entries of the defect's.
    RowEnds(Bands<'a, T>),
}

impl<T: Scalar> Pass<'_, T> {
    fn work<S: Source<T>>(&self, defects: &mut Defects<'_, T, S>) {
        let Grid { nx, ny, .. } = defects.around.grid;
        match self {
            Self::Measure { bands, stretches, meter, sum } => {
                let (mut d, mut tallies) = ([T::zero(); COLUMNS], Tallies::new(*stretches));
                while let Some(number) = bands.next() {
                    for j in number * ROWS..ny.min((number + 1) * ROWS) {
                        for start in (0..nx).step_by(COLUMNS) {
                            let d = &mut d[..COLUMNS.min(nx - start)];
                            defects.row(j, start..start + d.len(), d);
                            vectorised(
                                defects.arch,
                                #[inline(always)]
                                || tallies.add(*meter, start, d),
                            );
                        }
                    }
                    sum.add(number, tallies.take(0..nx));
                }
            }
            Self::Subtract(bands) => {
                let mut d = [T::zero(); COLUMNS];
                while let Some((number, band)) = bands.next() {
                    for (j, f) in (number * ROWS..).zip(band.chunks_exact_mut(nx)) {
                        for (k, f) in f.chunks_mut(COLUMNS).enumerate() {
                            let d = &mut d[..f.len()];
                            defects.row(j, k * COLUMNS..k * COLUMNS + f.len(), d);
                            f.iter_mut().zip(d).for_each(|(f, &mut d)| *f -= d);
                        }
                    }
                }
            }
            Self::Restrict { bands, transfer, beside } => {
                while let Some((number, band)) = bands.next() {
                    transfer.restrict(number, band, defects, beside);
                }
            }
            Self::RowEnds(rows) => {
                while let Some((j, ends)) = rows.next() {
                    let (first, last) = ends.split_at_mut(ends.len() / 2);
                    defects.row(j, 0..first.len(), first);
                    defects.row(j, nx - last.len()..nx, last);
                }
            }
        }
    }
}

type Smooth<T> = fn(&Sweep<'_, T>, Multiple<'_, T>, &[T], &mut [T]);
type Walk<T> = fn(&Smoother<'_, T>, Option<Multiple<'_, T>>, &[T], &[Vec<T>; 2], &Pass<'_, T>);

static SMOOTH: Compiled<Smooth<f32>, Smooth<f64>> = Compiled(
    |sweep, f, x, y| sweep.smooth_on(Arch::new(), f, x, y),
    |sweep, f, x, y| sweep.smooth_on(Arch::new(), f, x, y),
);
static WALK: Compiled<Walk<f32>, Walk<f64>> = Compiled(
    |smoother, f, x, beside, pass| smoother.walk_here(f, x, beside, pass),
    |smoother, f, x, beside, pass| smoother.walk_here(f, x, beside, pass),
);
