use std::{iter::Enumerate, ops::Range, slice::ChunksMut};

use crate::{
    numbers::{Compiled, Meter, Scalar, Stretches},
    parallel::{Claims, Strip},
};

/// Rows that are relaxed side by side.
pub(super) const ROWS: usize = 8;
/// The most columns of a row that are done in one go.
pub(super) const COLUMNS: usize = 512;
/// Between arrays of a worker, so that those of a power of two do not compete for the same lines of
/// the cache.
pub(super) const PAD: usize = 8;

/// The columns of a row beyond the edge of a grid.
static ZEROS: Compiled<[f32; COLUMNS], [f64; COLUMNS]> = Compiled([0.0; COLUMNS], [0.0; COLUMNS]);

/// Returns zeros for a stretch of columns.
#[inline(always)]
pub(super) fn zeros<T: Scalar>() -> &'static [T; COLUMNS] {
    ZEROS.of()
}

/// The grid, and the direction and the order of the sweep; a grid that closes is swept in
/// lexicographic order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) nx: usize,
    pub(super) ny: usize,
    pub(super) backward: bool,
    pub(super) red_black: bool,
    /// True where it closes: along a row, along a column.
    pub(super) round: [bool; 2],
}

impl Grid {
    /// Returns the values beyond the western and the eastern end of row `j`, where some columns
    /// reach these: those `beside` the grid, those across one that closes, or 0.
    #[inline(always)]
    pub(super) fn ends<T: Scalar>(
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

/// The part of the old iterate that a sweep reads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Old<'a, T> {
    pub(super) grid: Grid,
    pub(super) q: &'a [T],
    pub(super) x: &'a [T],
    pub(super) gamma: T,
    pub(super) q_factor: T,
    pub(super) meter: Meter,
    pub(super) parallel: bool,
    pub(super) strip: Option<&'a Strip>,
    pub(super) stretches: Stretches,
    /// `x` west and east of the grid, where other ranks have it go on.
    pub(super) beside: [&'a [T]; 2],
    /// The first colour of the new iterate there.
    pub(super) new: [&'a [T]; 2],
}

/// Borrows the columns beside a grid.
pub(super) fn columns<T>(beside: &[Vec<T>; 2]) -> [&[T]; 2] {
    beside.each_ref().map(Vec::as_slice)
}

/// A vector, as a factor and what it multiplies.
pub(super) type Multiple<'a, T> = (T, &'a [T]);

/// Bands of rows of a vector, for threads to claim.
pub(super) type Bands<'v, T> = Claims<Enumerate<ChunksMut<'v, T>>>;
