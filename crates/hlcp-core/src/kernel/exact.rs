//! Residuals of five-point operators in twice the digits of double precision.

use std::ops::Range;

use pulp::Arch;

use super::{Sweep, grid::Grid};
use crate::{
    numbers::{BLOCK, Compiled, Meter, Part, Rhs, Scalar, Tally, vectorised},
    operators::Coefficients,
    parallel::totals,
    rows::{ExactSum, Question},
};

impl<T: Scalar> Sweep<'_, T> {
    /// Sums the squares of the answers to a question to each row of the residual at `x`.
    pub(crate) fn exact(&self, question: Question, q: &Rhs<'_, T>, x: &[T], meter: Meter) -> Part {
        EXACT.of::<Exact<T>>()(self, question, q, x, meter)
    }

    fn exact_sum(&self, question: Question, q: &Rhs<'_, T>, x: &[T], meter: Meter) -> Part {
        let (arch, beside) = (Arch::new(), &self.beside(x));
        let add = |tally: &mut Tally<f64>, at: Range<usize>| {
            let mut entries = [0.0; BLOCK];
            let entries = &mut entries[..at.len()];
            vectorised(
                arch,
                #[inline(always)]
                || self.answer(question, q.entries(), x, beside, at, entries),
            );
            tally.add(meter, entries);
        };
        totals(self.stretches(), self.parallel, &add).sum(self.strip())
    }

    /// Overwrites `entries` with the answers of a block of points, `at` consecutive indices of one
    /// row of the grid, given `x` west and east of it, where other ranks have it go on.
    ///
    /// One of `zⱼ` and `rⱼ` is zero, so of the two terms of a neighbour, `a z` and `−b r`, there is
    /// one: the difference `w = z − r` times `a` where it is positive, times `b` elsewhere.
    #[inline(always)]
    fn answer(
        &self,
        question: Question,
        q: &[T],
        x: &[T],
        beside: &[Vec<T>; 2],
        at: Range<usize>,
        entries: &mut [f64],
    ) {
        let Sweep { grid, omega, omega_beside, gamma, q_factor, .. } = *self;
        let Grid { nx, ny, round: [round_x, round_y], .. } = grid;
        let (j, start, length) = (at.start / nx, at.start % nx, at.len());
        // w of the rows south of the block, here and north of it, with a column more on each side.
        let mut rows = [[0.0; BLOCK + 2]; 3];
        let south = if j > 0 { Some(j - 1) } else { round_y.then_some(ny - 1) };
        let north = if j + 1 < ny { Some(j + 1) } else { round_y.then_some(0) };
        for (row, to) in [south, Some(j), north].into_iter().zip(&mut rows) {
            if let Some(row) = row {
                let from = row * nx + start;
                difference(&x[from..from + length], omega, from, gamma, &mut to[1..=length]);
            }
        }
        let one = |x: T, omega: T| {
            let mut to = [0.0];
            difference(&[x], Coefficients::Uniform(omega), 0, gamma, &mut to);
            to[0]
        };
        let here = |k: usize| one(x[k], omega.entry(k));
        let beyond = |side: usize| {
            let pair = beside[side].get(j).zip(omega_beside[side].get(j));
            pair.map_or(0.0, |(&x, &omega)| one(x, omega))
        };
        rows[1][0] = match start {
            0 if round_x => here((j + 1) * nx - 1),
            0 => beyond(0),
            _ => here(at.start - 1),
        };
        rows[1][length + 1] = match start + length == nx {
            true if round_x => here(j * nx),
            true => beyond(1),
            false => here(at.end),
        };
        let [south, here, north] = &rows;
        // In the order of the coefficients: south, west, centre, east, north.
        let w = [&south[1..], here, &here[1..], &here[2..], &north[1..]].map(|w| &w[..length]);
        let (q, sign) = (&q[at.clone()], q_factor / gamma);
        if let [Some(a), Some(b)] = self.views().map(|view| view.constants()) {
            let [a, b] = [a, b].map(|row| row.map(T::wide));
            measure_block(question, w, sign, q, |d, _| [a[d], b[d]], entries);
        } else {
            let mut loaded = [[[0.0; BLOCK]; 5]; 2];
            let lists = self.views().map(|view| view.coefficients());
            for (list, to) in lists.iter().flatten().zip(loaded.iter_mut().flatten()) {
                match list {
                    Coefficients::Uniform(c) => to.fill(c.wide()),
                    Coefficients::Each(c) => {
                        to.iter_mut().zip(&c[at.clone()]).for_each(|(to, c)| *to = c.wide());
                    }
                }
            }
            let [a, b] =
                loaded.each_ref().map(|lists| lists.each_ref().map(|list| &list[..length]));
            measure_block(question, w, sign, q, |d, i| [a[d][i], b[d][i]], entries);
        }
    }
}

/// Overwrites `to` with `z − r` at the `x` of a row, whose first has the index `from`: the
/// `z = (|x| + x)/γ` is `2x/γ` for positive `x`, and `r = Ω(|x| − x)/γ` is `−Ω 2x/γ` for others,
/// with the same terms.
#[inline(always)]
fn difference<T: Scalar>(
    x: &[T],
    omega: Coefficients<'_, T>,
    from: usize,
    gamma: T,
    to: &mut [f64],
) {
    let scaled = |x: T, omega: T| (if x > T::zero() { T::one() } else { omega }) * (x + x);
    let to = to.iter_mut().zip(x);
    match omega {
        Coefficients::Uniform(omega) if gamma == T::one() => {
            to.for_each(|(to, &x)| *to = scaled(x, omega).wide());
        }
        Coefficients::Uniform(omega) => {
            to.for_each(|(to, &x)| *to = (scaled(x, omega) / gamma).wide());
        }
        Coefficients::Each(omega) => {
            for ((to, &x), &omega) in to.zip(&omega[from..]) {
                *to = (scaled(x, omega) / gamma).wide();
            }
        }
    }
}

/// Measures the rows of a block of points, given `w` at the five neighbours and the coefficients of
/// `A` and `B` in direction `d` at point `i`.
#[inline(always)]
fn measure_block<T: Scalar>(
    question: Question,
    w: [&[f64]; 5],
    sign: T,
    q: &[T],
    coefficients: impl Fn(usize, usize) -> [f64; 2],
    entries: &mut [f64],
) {
    // Few enough to stay in the nearest cache while they are looked at.
    const WIDTH: usize = 32;
    let mut sums = [[0.0; WIDTH]; 3];
    for (k, (entries, q)) in entries.chunks_mut(WIDTH).zip(q.chunks(WIDTH)).enumerate() {
        let (first, n) = (k * WIDTH, entries.len());
        let w = w.map(|w| &w[first..first + n]);
        let [values, slacks, terms] = sums.each_mut().map(|list| &mut list[..n]);
        for (i, &q) in q.iter().enumerate() {
            let mut sum = ExactSum::new((sign * q).wide());
            for d in 0..5 {
                let (w, [a, b]) = (w[d][i], coefficients(d, first + i));
                sum.add(if w > 0.0 { a } else { b }, w);
            }
            [values[i], slacks[i], terms[i]] = sum.around();
        }
        question.measure([values, slacks, terms], entries);
    }
}

type Exact<T> = fn(&Sweep<'_, T>, Question, &Rhs<'_, T>, &[T], Meter) -> Part;

static EXACT: Compiled<Exact<f32>, Exact<f64>> = Compiled(
    |sweep, question, q, x, meter| sweep.exact_sum(question, q, x, meter),
    |sweep, question, q, x, meter| sweep.exact_sum(question, q, x, meter),
);
