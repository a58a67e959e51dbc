//! Work that several threads share: how many there are, and sums over the points of a grid.

use std::ops::Range;

use super::{Claims, OrderedSum, Strip};
use crate::numbers::{BLOCK, Part, Scalar, Stretches, Tallies, Tally, Totals};

/// The fewest unknowns that are worth waking a second thread for; tests of this crate share any
/// number.
pub(crate) const WORTH: usize = if cfg!(test) { 1 } else { 1 << 14 };

/// Returns how many threads share the work on `n` unknowns: those of the current pool, if they are
/// asked for.
pub(crate) fn threads(parallel: bool, n: usize) -> usize {
    #[cfg(feature = "rayon")]
    if parallel && n >= WORTH {
        return rayon::current_num_threads();
    }
    let _ = (parallel, n);
    1
}

/// Runs `work` once on each of `threads` threads of the current pool, as far as they are free.
pub(crate) fn spread(threads: usize, work: &(dyn Fn() + Sync)) {
    #[cfg(feature = "rayon")]
    if threads > 1 {
        let half = threads / 2;
        rayon::join(|| spread(threads - half, work), || spread(half, work));
        return;
    }
    let _ = threads;
    work();
}

impl Totals {
    /// Returns the sum over the whole grid, which ranks may share.
    pub(crate) fn sum(&self, strip: Option<&Strip>) -> Part {
        if let Some(strip) = strip {
            return strip.sum(self);
        }
        let mut sum = Part::default();
        self.parts().for_each(|part| sum.add(part));
        sum
    }
}

/// Rows that are summed before their sum is added to that of the rows before.
const ROWS: usize = 8;

/// Sums over the points of a grid: `add` takes the indices of a block of a row.
pub(crate) fn totals<T: Scalar>(
    stretches: Stretches,
    parallel: bool,
    add: &(dyn Fn(&mut Tally<T>, Range<usize>) + Sync),
) -> Totals {
    let Stretches { nx, ny, width } = stretches;
    // Threads share bands of rows; the stretches where there is one band alone.
    let portions = if ny <= ROWS { stretches.count() } else { 1 };
    let claims = Claims::new(0..ny.div_ceil(ROWS) * portions);
    let sum = OrderedSum::new();
    spread(threads(parallel, nx * ny), &|| {
        let mut tallies = Tallies::new(stretches);
        while let Some(number) = claims.next() {
            let (first, portion) = (number / portions * ROWS, number % portions);
            let columns =
                if portions == 1 { 0..nx } else { portion * width..nx.min((portion + 1) * width) };
            for j in first..ny.min(first + ROWS) {
                for start in columns.clone().step_by(BLOCK) {
                    let block = j * nx + start..j * nx + columns.end.min(start + BLOCK);
                    add(tallies.at(start), block);
                }
            }
            sum.add(number, tallies.take(columns));
        }
    });
    sum.total()
}
