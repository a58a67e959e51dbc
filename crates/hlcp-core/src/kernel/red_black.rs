//! A sweep in red–black order: first the points with even i + j, then those with odd; backward, the
//! other way round.
//!
//! A point's neighbours are all of the other colour. So the first colour is a Jacobi step, and the
//! second takes from its `t` what all four neighbours have become. Both happen in one pass: a row's
//! second colour is finished as soon as the first phase of the row after it is done. Bands of rows
//! know nothing of each other: a band does the first phase of the rows beside it again, for the
//! values of the first colour alone.

use std::ops::Range;

use pulp::Arch;

use super::{
    coefficients::Source,
    grid::{COLUMNS, Grid, Old, columns, zeros},
    tile::pieces,
};
use crate::{
    numbers::{Scalar, Tallies, Totals, vectorised},
    parallel::{Claims, OrderedSum, team},
};

/// The rows of a band. The first phase of two more is done again.
const HEIGHT: usize = 32;

impl<T: Scalar> Old<'_, T> {
    /// Relaxes all of `y` in red–black order, and sums the squares of F(x).
    pub(super) fn red_black<S: Source<T>, const ACCELERATED: bool>(
        &self,
        arch: Arch,
        source: &S,
        y: &mut [T],
    ) -> Totals {
        let new = self.strip.map_or([vec![], vec![]], |strip| {
            strip.exchange(1, first_colours::<_, _, ACCELERATED>(arch, self, source))
        });
        let (old, nx) = (&Old { new: columns(&new), ..*self }, self.grid.nx);
        let bands = y.chunks_mut(nx * HEIGHT);
        let threads = team::threads(self.parallel, self.x.len()).min(bands.len());
        let (bands, sum) = (Claims::new(bands.enumerate()), OrderedSum::new());
        team::spread(threads, &|| {
            let mut worker = Worker::new(arch, old, source);
            // Beside the worker, not in it: within, a sweep takes a tenth longer.
            let mut tallies = Tallies::new(old.stretches);
            while let Some((number, band)) = bands.next() {
                worker.relax::<ACCELERATED>(number * HEIGHT, band, &mut tallies);
                sum.add(number, tallies.take(0..nx));
            }
        });
        sum.total()
    }
}

struct Worker<'a, T, S: Source<T>> {
    arch: Arch,
    old: &'a Old<'a, T>,
    source: &'a S,
    loaded: S::Loaded,
    padded: [T; COLUMNS + 2],
    defect: [T; COLUMNS],
}

/// Returns the first colour of the new iterate in the first and in the last column; the numbers at
/// points of the second colour mean nothing.
fn first_colours<T: Scalar, S: Source<T>, const ACCELERATED: bool>(
    arch: Arch,
    old: &Old<'_, T>,
    source: &S,
) -> [Vec<f64>; 2] {
    let Grid { nx, ny, .. } = old.grid;
    let mut worker = Worker::new(arch, old, source);
    [0, nx - 1].map(|i| {
        let mut first = |j| {
            let mut t = [T::zero()];
            worker.prepare::<ACCELERATED>(j, i..i + 1, &mut t, None);
            t[0].wide()
        };
        (0..ny).map(&mut first).collect()
    })
}

impl<'a, T: Scalar, S: Source<T>> Worker<'a, T, S> {
    fn new(arch: Arch, old: &'a Old<'a, T>, source: &'a S) -> Self {
        let (loaded, padded) = (source.loaded(), [T::zero(); COLUMNS + 2]);
        Self { arch, old, source, loaded, padded, defect: *zeros() }
    }

    /// Relaxes the rows of `band`, the first of which is row `first` of the grid.
    fn relax<const ACCELERATED: bool>(
        &mut self,
        first: usize,
        band: &mut [T],
        tallies: &mut Tallies<T>,
    ) {
        let Grid { nx, ny, .. } = self.old.grid;
        let height = band.len() / nx;
        let mut beside = [*zeros(); 2];
        // One row behind, so that the row after it has its first colour.
        for k in 0..=height {
            if k < height {
                for columns in pieces::<false>(0..nx, S::CHUNK) {
                    let t = &mut band[k * nx..][columns.clone()];
                    self.prepare::<ACCELERATED>(first + k, columns, t, Some(tallies));
                }
            }
            if k == 0 {
                continue;
            }
            for columns in pieces::<false>(0..nx, S::CHUNK) {
                let [before, after] = beside.each_mut().map(|t| &mut t[..columns.len()]);
                if k == 1 && first > 0 {
                    self.prepare::<ACCELERATED>(first - 1, columns.clone(), before, None);
                }
                if k == height && first + height < ny {
                    self.prepare::<ACCELERATED>(first + height, columns.clone(), after, None);
                }
                self.finish::<ACCELERATED>(first, k - 1, columns, band, [before, after]);
            }
        }
    }

    /// Does the first phase of a stretch of row `j`: F(x), and `t`, which is what the first colour
    /// becomes; sums the squares of F(x) where there are `tallies`.
    fn prepare<const ACCELERATED: bool>(
        &mut self,
        j: usize,
        columns: Range<usize>,
        t: &mut [T],
        tallies: Option<&mut Tallies<T>>,
    ) {
        let Old { grid, x, q, q_factor, meter, .. } = *self.old;
        let Range { start, end } = columns.clone();
        let n = t.len().min(S::CHUNK);
        let row = |j: usize| &x[j * grid.nx..(j + 1) * grid.nx];
        let south = if j > 0 { &row(j - 1)[start..end] } else { &zeros()[..n] };
        let north = if j + 1 < grid.ny { &row(j + 1)[start..end] } else { &zeros()[..n] };
        let ends = grid.ends(x, self.old.beside, j, &columns);
        pad(row(j), columns.clone(), ends, &mut self.padded);
        let second = second_colour(grid, start, j);
        self.source.load(j, columns, &mut self.loaded);
        let (source, loaded, q) = (self.source, &self.loaded, &q[j * grid.nx..][start..end]);
        let (around, defect) = ([south, &self.padded, north], &mut self.defect);
        vectorised(
            self.arch,
            #[inline(always)]
            || {
                first_phase::<_, _, ACCELERATED>(
                    source, loaded, second, around, q, q_factor, defect, t,
                );
                if let Some(tallies) = tallies {
                    tallies.add(meter, start, &defect[..n]);
                }
            },
        );
    }

    /// Does the second phase of a stretch of row `k` of `band`: the second colour.
    fn finish<const ACCELERATED: bool>(
        &mut self,
        first: usize,
        k: usize,
        columns: Range<usize>,
        band: &mut [T],
        [before_band, after_band]: [&mut [T]; 2],
    ) {
        let grid = self.old.grid;
        let (before, rest) = band.split_at_mut(k * grid.nx);
        let (row, after) = rest.split_at_mut(grid.nx);
        let south = match before.len().checked_sub(grid.nx) {
            Some(last) => &before[last..][columns.clone()],
            None => &*before_band,
        };
        let north = if after.is_empty() { &*after_band } else { &after[columns.clone()] };
        let ends = grid.ends(self.old.x, self.old.new, first + k, &columns);
        pad(row, columns.clone(), ends, &mut self.padded);
        let second = second_colour(grid, columns.start, first + k);
        self.source.load(first + k, columns.clone(), &mut self.loaded);
        let (source, loaded, y) = (self.source, &self.loaded, &mut row[columns]);
        let around = [south, &self.padded, north];
        vectorised(
            self.arch,
            #[inline(always)]
            || second_phase::<_, _, ACCELERATED>(source, loaded, second, around, y),
        );
    }
}

/// Returns 1 if point `start` of row `j` is of the second colour, and 0 if not.
#[inline(always)]
fn second_colour(grid: Grid, start: usize, j: usize) -> usize {
    (start + j + usize::from(grid.backward)) % 2
}

/// Overwrites `padded` with columns of a row and their neighbours to either side: those given
/// where the row ends.
#[inline(always)]
fn pad<T: Scalar>(
    row: &[T],
    columns: Range<usize>,
    [west, east]: [Option<T>; 2],
    padded: &mut [T; COLUMNS + 2],
) {
    let Range { start, end } = columns;
    padded[0] = west.unwrap_or_else(|| row[start - 1]);
    padded[1..=end - start].copy_from_slice(&row[start..end]);
    padded[end - start + 1] = east.unwrap_or_else(|| row[end]);
}

/// Does the first phase of a stretch, given the rows around it, the middle one padded.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "slices as arguments are known not to overlap")]
fn first_phase<T: Scalar, S: Source<T>, const ACCELERATED: bool>(
    source: &S,
    loaded: &S::Loaded,
    second: usize,
    [south, middle, north]: [&[T]; 3],
    q: &[T],
    q_factor: T,
    defect: &mut [T],
    t: &mut [T],
) {
    let n = t.len().min(S::CHUNK);
    let (south, north, q, defect) = (&south[..n], &north[..n], &q[..n], &mut defect[..n]);
    let middle = &middle[..n + 2];
    for i in 0..n {
        let row = source.row::<ACCELERATED>(loaded, i);
        let x = [south[i], middle[i], middle[i + 1], middle[i + 2], north[i]];
        let (f, first, beside) = row.coloured::<ACCELERATED>(x, q_factor * q[i]);
        defect[i] = f;
        t[i] = if (i + second) % 2 == 1 { first + beside } else { first };
    }
}

/// Does the second phase of a stretch, given the rows around it, the middle one padded.
#[inline(always)]
fn second_phase<T: Scalar, S: Source<T>, const ACCELERATED: bool>(
    source: &S,
    loaded: &S::Loaded,
    second: usize,
    [south, middle, north]: [&[T]; 3],
    y: &mut [T],
) {
    let n = y.len().min(S::CHUNK);
    let (south, middle, north) = (&south[..n], &middle[..n + 2], &north[..n]);
    for i in 0..n {
        let row = source.row::<ACCELERATED>(loaded, i);
        let t = middle[i + 1];
        let beside = row.beside::<ACCELERATED>([south[i], middle[i], middle[i + 2], north[i]]);
        y[i] = if (i + second) % 2 == 1 { t - beside } else { t };
    }
}
