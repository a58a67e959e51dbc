use std::iter;

use super::Relaxed;
use crate::{
    numbers::{BLOCK, Norms, Part, Scalar, Tally},
    operators::{Rows, Source},
    parallel::{Claims, OrderedSum, team},
};

/// Rows that one thread relaxes in one go.
const PORTION: usize = 512;

/// The colours of rows: those of one colour are not coupled.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Colours {
    /// The colour of each row.
    colours: Vec<u32>,
    /// The rows by colour, and by index within a colour.
    rows: Vec<usize>,
    /// Where each colour begins in `rows`, and the end.
    starts: Vec<usize>,
}

impl Colours {
    /// Gives each row the least colour that no earlier row has which it is coupled to, in one of
    /// two operators of order `n`.
    pub(crate) fn new<T: Scalar>(n: usize, a: &impl Rows<T>, b: &impl Rows<T>) -> Self {
        // For each row its later neighbours: those that it names, or that name it.
        let mut pairs = vec![];
        for i in 0..n {
            let mut couple = |j: usize, entry: T| {
                if j != i && entry != T::zero() {
                    pairs.push((i.max(j), i.min(j)));
                }
            };
            a.visit_row(i, &mut couple);
            b.visit_row(i, &mut couple);
        }
        pairs.sort_unstable();
        let (mut colours, mut taken): (Vec<u32>, Vec<usize>) = (vec![], vec![]);
        let mut pairs = pairs.into_iter().peekable();
        for i in 0..n {
            while let Some((_, earlier)) = pairs.next_if(|&(later, _)| later == i) {
                taken[colours[earlier] as usize] = i + 1;
            }
            let free = taken.iter().position(|&by| by != i + 1).unwrap_or(taken.len());
            if free == taken.len() {
                taken.push(0);
            }
            colours.push(free as u32);
        }
        let mut rows: Vec<usize> = (0..n).collect();
        rows.sort_by_key(|&i| colours[i]);
        let starts = (0..=taken.len() as u32)
            .map(|colour| rows.partition_point(|&i| colours[i] < colour))
            .collect();
        Self { colours, rows, starts }
    }

    /// Returns the number of rows.
    pub(crate) fn order(&self) -> usize {
        self.colours.len()
    }

    /// Returns the number of colours.
    pub(crate) fn count(&self) -> usize {
        self.starts.len() - 1
    }
}

impl<T: Scalar> Relaxed<'_, T> {
    /// Overwrites `y` with the next iterate, relaxing the rows colour by colour, and returns the
    /// norms of F(x)/γ.
    pub(super) fn colour_by_colour<const ACCELERATED: bool>(
        &self,
        colours: &Colours,
        backward: bool,
        a: impl Source<T> + Sync,
        b: impl Source<T> + Sync,
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        let threads = team::threads(self.parallel, y.len());
        if scratch.len() < y.len() {
            scratch.resize(y.len(), T::zero());
        }
        let (count, mut total) = (colours.count(), Part::default());
        for step in 0..count {
            let colour = if backward { count - 1 - step } else { step };
            let rows = &colours.rows[colours.starts[colour]..colours.starts[colour + 1]];
            let values = &mut scratch[..rows.len()];
            let portions = rows.chunks(PORTION).zip(values.chunks_mut(PORTION)).enumerate();
            let (portions, sum, old) = (Claims::new(portions), OrderedSum::new(), &*y);
            let passed = |j: usize| {
                let other = colours.colours[j] as usize;
                if backward { other > colour } else { other < colour }
            };
            team::spread(threads, &|| {
                let (mut a, mut b) = (a.clone(), b.clone());
                while let Some((number, (rows, values))) = portions.next() {
                    let mut f = [T::zero(); PORTION];
                    for ((&i, value), f) in rows.iter().zip(values).zip(&mut f) {
                        (*f, *value) = self.row::<ACCELERATED>(i, &mut a, &mut b, old, passed);
                    }
                    let mut tally = Tally::zero();
                    f[..rows.len()].chunks(BLOCK).for_each(|block| tally.add(self.meter, block));
                    sum.add(number, iter::once((0, tally.part())));
                }
            });
            total.add(sum.total().sum(None));
            for (&i, &value) in rows.iter().zip(&scratch[..rows.len()]) {
                y[i] = value;
            }
        }
        self.meter.norms_of(total, self.gamma)
    }
}
