use std::num::NonZeroUsize;

use super::Colours;
use crate::{
    numbers::{Compiled, Meter, Norms, Part, Scalar},
    operators::{Coefficients, RowsOf, Source, outside},
};

/// The two parameters of one matrix, as they enter `M`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Relaxation<T> {
    /// 1/α.
    pub(crate) diagonal: T,
    /// β/α.
    pub(crate) triangle: T,
}

impl<T: Scalar> Relaxation<T> {
    pub(crate) fn new([alpha, beta]: [T; 2]) -> Self {
        Self { diagonal: alpha.recip(), triangle: beta / alpha }
    }
}

/// The order and the direction of a sweep over rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Order {
    pub(crate) backward: bool,
    /// The length of a row of the grid, for the red–black order.
    pub(crate) red_black: Option<NonZeroUsize>,
}

impl Order {
    /// Returns whether row `j` is relaxed before row `i`.
    pub(crate) fn precedes(&self, j: usize, i: usize) -> bool {
        let place = |i: usize| (self.red_black.is_some_and(|nx| is_black(i, nx.get())), i);
        if self.backward { place(j) > place(i) } else { place(j) < place(i) }
    }
}

/// Returns whether point `i` of a grid with `nx` points to a row is black.
fn is_black(i: usize, nx: usize) -> bool {
    !(i / nx + i % nx).is_multiple_of(2)
}

/// The old iterate and the parameters of a sweep over rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Relaxed<'w, T> {
    pub(crate) q: &'w [T],
    pub(crate) x: &'w [T],
    pub(crate) omega: Coefficients<'w, T>,
    pub(crate) gamma: T,
    pub(crate) parallel: bool,
    pub(crate) q_factor: T,
    pub(crate) relaxations: [Relaxation<T>; 2],
    pub(crate) accelerated: bool,
    pub(crate) meter: Meter,
}

impl<T: Scalar> Relaxed<'_, T> {
    /// Overwrites `y` with the next iterate, relaxing rows in an order, colour by colour if they
    /// have colours, and returns the norms of F(x)/γ.
    pub(crate) fn sweep(
        &self,
        order: Order,
        colours: Option<&Colours>,
        a: impl Source<T> + Sync,
        b: impl Source<T> + Sync,
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        match (colours, self.accelerated, order.backward) {
            (None, true, _) => self.sweep_by::<true>(order, a, b, y),
            (None, false, _) => self.sweep_by::<false>(order, a, b, y),
            (Some(colours), true, backward) => {
                self.colour_by_colour::<true>(colours, backward, a, b, y, scratch)
            }
            (Some(colours), false, backward) => {
                self.colour_by_colour::<false>(colours, backward, a, b, y, scratch)
            }
        }
    }

    /// Sweeps over known rows, as [`sweep`](Self::sweep) does, by code that is compiled here.
    pub(crate) fn sweep_known(
        &self,
        order: Order,
        colours: Option<&Colours>,
        rows: [RowsOf<'_, T>; 2],
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        SWEEP.of::<Sweep<T>>()(self, order, colours, rows, y, scratch)
    }

    fn sweep_by<const ACCELERATED: bool>(
        &self,
        order: Order,
        a: impl Source<T>,
        b: impl Source<T>,
        y: &mut [T],
    ) -> Norms {
        let (n, passed) = (y.len(), |j, i| order.precedes(j, i));
        match (order.red_black, order.backward) {
            (None, false) => self.walk::<ACCELERATED>(a, b, y, 0..n, |j, i| j < i),
            (None, true) => self.walk::<ACCELERATED>(a, b, y, (0..n).rev(), |j, i| j > i),
            (Some(nx), backward) => {
                let black = |&i: &usize| is_black(i, nx.get());
                let rows = (0..n).filter(|i| !black(i)).chain((0..n).filter(black));
                if backward {
                    self.walk::<ACCELERATED>(a, b, y, rows.rev(), passed)
                } else {
                    self.walk::<ACCELERATED>(a, b, y, rows, passed)
                }
            }
        }
    }

    /// Relaxes `rows` in their order, where `passed(j, i)` says whether row `j` comes before row
    /// `i`, and returns the norms of F(x)/γ.
    #[inline(always)]
    fn walk<const ACCELERATED: bool>(
        &self,
        mut a: impl Source<T>,
        mut b: impl Source<T>,
        y: &mut [T],
        rows: impl Iterator<Item = usize>,
        passed: impl Fn(usize, usize) -> bool,
    ) -> Norms {
        // Of one length, so that an index is compared with it once.
        let y = &mut y[..self.x.len()];
        let mut sum = Part::default();
        for i in rows {
            let (f, value) = self.row::<ACCELERATED>(i, &mut a, &mut b, y, |j| passed(j, i));
            sum.see(self.meter, f);
            y[i] = value;
        }
        self.meter.norms_of(sum, self.gamma)
    }

    /// Returns the entry of F(x) and the new value of row `i`, where `passed(j)` says whether
    /// `y[j]` is new.
    #[inline(always)]
    pub(super) fn row<const ACCELERATED: bool>(
        &self,
        i: usize,
        a: &mut impl Source<T>,
        b: &mut impl Source<T>,
        y: &[T],
        passed: impl Fn(usize) -> bool,
    ) -> (T, T) {
        let (x, omega, [of_a, of_b]) = (self.x, self.omega, self.relaxations);
        let n = x.len();
        // F, what the passed rows have moved, and an entry of the diagonal.
        let sums = (self.q_factor * self.q[i], T::zero(), T::zero());
        let (f, moved, a_centre) = a.fold(i, sums, |(f, mut moved, centre), j, a| {
            let &x = x.get(j).unwrap_or_else(|| outside(i, j, n));
            let f = f + a * (x.abs() + x);
            if passed(j) {
                moved += of_a.triangle * a * (y[j] - x);
                if ACCELERATED {
                    moved += a * (y[j].abs() - x.abs());
                }
            }
            (f, moved, if j == i { a } else { centre })
        });
        let sums = (f, moved, T::zero());
        let (f, moved, b_centre) = b.fold(i, sums, |(f, mut moved, centre), j, b| {
            let &x = x.get(j).unwrap_or_else(|| outside(i, j, n));
            let b_omega = b * omega.entry(j);
            let f = f - b_omega * (x.abs() - x);
            if passed(j) {
                moved += of_b.triangle * b_omega * (y[j] - x);
                if ACCELERATED {
                    moved -= b_omega * (y[j].abs() - x.abs());
                }
            }
            (f, moved, if j == i { b_omega } else { centre })
        });
        // The reciprocal depends on no other row, so it stays off the chain from row to row.
        let pivot = a_centre * of_a.diagonal + b_centre * of_b.diagonal;
        (f, x[i] - (f + moved) * pivot.recip())
    }
}

type Sweep<T> = fn(
    &Relaxed<'_, T>,
    Order,
    Option<&Colours>,
    [RowsOf<'_, T>; 2],
    &mut [T],
    &mut Vec<T>,
) -> Norms;

static SWEEP: Compiled<Sweep<f32>, Sweep<f64>> = Compiled(
    |relaxed, order, colours, [a, b], y, scratch| relaxed.sweep(order, colours, a, b, y, scratch),
    |relaxed, order, colours, [a, b], y, scratch| relaxed.sweep(order, colours, a, b, y, scratch),
);
