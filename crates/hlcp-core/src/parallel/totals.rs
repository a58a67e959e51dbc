use std::ops::Range;

use pulp::Arch;

use super::{
    Strip,
    team::{self, Claims, OrderedSum},
};
use crate::numbers::{BLOCK, Part, Scalar, Stretches, Tallies, Tally, Totals};

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
    add: impl Fn(&mut Tally<T>, Range<usize>) + Sync,
) -> Totals {
    let Stretches { nx, ny, width } = stretches;
    // Threads share bands of rows; the stretches where there is one band alone.
    let portions = if ny <= ROWS { stretches.count() } else { 1 };
    let claims = Claims::new(0..ny.div_ceil(ROWS) * portions);
    let sum = OrderedSum::new();
    team::spread(team::threads(parallel, nx * ny), &|| {
        Arch::new().dispatch(|| {
            let mut tallies = Tallies::new(stretches);
            while let Some(number) = claims.next() {
                let (first, portion) = (number / portions * ROWS, number % portions);
                let columns = if portions == 1 {
                    0..nx
                } else {
                    portion * width..nx.min((portion + 1) * width)
                };
                for j in first..ny.min(first + ROWS) {
                    for start in columns.clone().step_by(BLOCK) {
                        let block = j * nx + start..j * nx + columns.end.min(start + BLOCK);
                        add(tallies.at(start), block);
                    }
                }
                sum.add(number, tallies.take(columns));
            }
        });
    });
    sum.total()
}
