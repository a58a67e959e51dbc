//! Between a grid and the next coarser one.

use std::ops::Range;

use pulp::Arch;

use super::{
    coefficients::Source,
    grid::{Bands, COLUMNS},
    smoother::Defects,
};
use crate::{
    numbers::{Compiled, Scalar, vectorised},
    parallel::{Claims, Strip, team},
};

/// Coarse columns that are done in one go.
const WIDTH: usize = COLUMNS / 2;
/// Rows of a grid that a thread claims at once.
const HEIGHT: usize = 16;
/// Columns of the defect that full weighting takes of other ranks at most.
pub(super) const WEIGHTED: usize = 2;

/// The nodes of one axis on two grids over one interval, whose ends are the grids' nodes 0 and
/// `m + 1`.
///
/// Fine node `p` lies between the coarse nodes `p/2 − 1` and `p/2`, those beyond the ends among
/// them: of odd `m` every other node is a coarse one, and of even `m` the coarse spacing is a
/// little more than twice the fine one. Of an axis that closes round, with an even number of nodes,
/// every other one is a coarse one.
///
/// Of an axis that ranks share, the coarse nodes are counted from the first own one on, and the
/// fine ones from the first of the two before it: `lead` of these are another rank's.
#[derive(Debug, Clone)]
struct Axis<T> {
    fine: usize,
    coarse: usize,
    lead: usize,
    /// The fine nodes that there are: `lead`, the own ones, and at most two more.
    known: usize,
    round: bool,
    /// For each coarse node the fine one nearest to it.
    nearest: Vec<usize>,
    /// For each fine node the weight of the later of the two coarse ones beside it, and then ones
    /// up to an even number and two more; empty where both grids have the same nodes.
    weights: Vec<T>,
    /// For each fine node the first of the four coarse ones nearest to it, and their weights in the
    /// polynomial through them, and how many of the four there are.
    cubic: Vec<(isize, [T; 4])>,
    taps: usize,
    /// The fine spacing over the coarse one.
    ratio: T,
}

impl<T: Scalar> Axis<T> {
    fn new(fine: usize, round: bool) -> Self {
        let coarse = match (fine - 1) / 2 {
            // Three points at least, as of any direction that closes.
            _ if round && fine.is_multiple_of(2) && fine >= 6 => fine / 2,
            _ if round => fine,
            0 => fine,
            half if fine % 2 == 1 => half,
            _ => fine / 2 - 1,
        };
        // Of the one spacing beyond the last node an axis that closes has none.
        let end = usize::from(!round);
        let (fine_cells, coarse_cells) = (fine + end, coarse + end);
        let number = |v: usize| T::of(v as f64);
        // Fine node p is (p + 1)/fine_cells along.
        let nearest = |i: usize| (i * fine_cells + coarse_cells / 2) / coarse_cells - 1;
        let weight = |p: usize| {
            let along = (p + 1) * coarse_cells - p / 2 * fine_cells;
            number(along) / number(fine_cells)
        };
        let padded = 2 * coarse + 4;
        let weights = (0..padded).map(|p| match p {
            p if p < fine => weight(p),
            p if round => weight(p - fine),
            _ => T::one(),
        });
        let mut axis = Self {
            fine,
            coarse,
            lead: 0,
            known: fine,
            round,
            nearest: (1..=coarse).map(nearest).collect(),
            weights: if coarse < fine { weights.collect() } else { vec![] },
            cubic: vec![],
            taps: if round { 4 } else { coarse.min(4) },
            ratio: number(coarse_cells) / number(fine_cells),
        };
        axis.cubic = (0..fine).map(|p| axis.lagrange(p)).collect();
        axis
    }

    /// Returns the part of an axis that halves with these of its nodes.
    fn part(&self, fine: Range<usize>, coarse: Range<usize>) -> Self {
        let (first, west) = (2 * coarse.start, coarse.start as isize);
        let lead = fine.start - first;
        let cubic = self.cubic[fine.clone()].iter();
        Self {
            fine: fine.len(),
            coarse: coarse.len(),
            lead,
            known: (self.fine - first).min(lead + fine.len() + WEIGHTED),
            nearest: self.nearest[coarse.clone()].iter().map(|node| node - fine.start).collect(),
            weights: self.weights[first..2 * coarse.end + 4].to_vec(),
            cubic: cubic.map(|&(first, weights)| (first - west, weights)).collect(),
            ..*self
        }
    }

    fn halves(&self) -> bool {
        self.coarse < self.fine
    }

    /// Returns the four coarse nodes nearest to fine node `p`, by the first of them, or all where
    /// there are fewer, and their weights in the polynomial through them.
    fn lagrange(&self, p: usize) -> (isize, [T; 4]) {
        if self.round {
            let parts = match p % 2 {
                _ if !self.halves() => return (p as isize, [1.0, 0.0, 0.0, 0.0].map(T::of)),
                0 => [-1.0, 9.0, 9.0, -1.0].map(|part| T::of(part / 16.0)),
                _ => [0.0, 0.0, 1.0, 0.0].map(T::of),
            };
            return (((p / 2 + self.coarse - 2) % self.coarse) as isize, parts);
        }
        let (fine_cells, coarse_cells) = (self.fine + 1, self.coarse + 1);
        let count = self.coarse.min(4);
        let number = |v: usize| T::of(v as f64);
        let below = (p + 1) * coarse_cells / fine_cells;
        let rest = (p + 1) * coarse_cells % fine_cells;
        let first = below.saturating_sub(2).min(self.coarse - count);
        let at = number(below) + number(rest) / number(fine_cells);
        let mut weights = [T::zero(); 4];
        for (k, weight) in weights.iter_mut().enumerate().take(count) {
            let place = |k: usize| number(first + k + 1);
            let others = (0..count).filter(|&other| other != k);
            *weight = others.fold(T::one(), |weight, other| {
                weight * (at - place(other)) / (place(k) - place(other))
            });
        }
        (first as isize, weights)
    }

    /// Returns the coarse rows beside fine row `p`, and the weight of the later one.
    fn beside(&self, p: usize) -> ([Option<usize>; 2], T) {
        if !self.halves() {
            return ([None, Some(p)], T::one());
        }
        let k = p / 2;
        let before = if k > 0 { Some(k - 1) } else { self.round.then_some(self.coarse - 1) };
        ([before, (k < self.coarse).then_some(k)], self.weights[p])
    }

    /// Returns the coarse columns of a stretch beginning at `start`, and the fine ones that lie
    /// between them and the next one.
    fn stretch(&self, start: usize) -> [Range<usize>; 2] {
        let end = self.coarse.min(start + WIDTH);
        let fine = |at: usize| if self.halves() { (2 * at).max(self.lead) - self.lead } else { at };
        [start..end, fine(start)..if end == self.coarse { self.fine } else { fine(end) }]
    }
}

/// A grid and the next coarser one over the same domain, and how numbers go from one to the other.
///
/// Both hold the inner points of a rectangle whose boundary lies one spacing outside. From `m`
/// points per side the coarse grid has `(m − 1)/2` for odd `m`, every other fine one, and `m/2 − 1`
/// for even `m`, at a spacing a little more than twice the fine one; a side of one or two points
/// stays. A direction that closes round has half as many points where their number is even and 6 or
/// more, and stays otherwise.
///
/// # Cost
///
/// Eight numbers for each column and each row of the fine grid. What works on vectors walks them
/// once, on the threads of the current pool if it is told `parallel` and the grid has 16384 points
/// or more, with the same bits for any number of them.
///
/// # Panics
///
/// Everything panics for a grid without points, and unless the vectors have the grids' orders.
#[doc(hidden)]
#[derive(Debug, Clone)]
pub struct Transfer<T> {
    axes: [Axis<T>; 2],
    /// The coarse grid's, where ranks share it.
    strip: Option<Strip>,
}

impl<T: Scalar> Transfer<T> {
    /// Returns the transfer from a fine grid of `[nx, ny]` points that closes along the `[x, y]`
    /// that say so.
    pub fn new([nx, ny]: [usize; 2], round: [bool; 2]) -> Self {
        Self { axes: [Axis::new(nx, round[0]), Axis::new(ny, round[1])], strip: None }
    }

    /// Returns the transfer from a fine grid that ranks share; all vectors are those of this rank's
    /// columns.
    ///
    /// A coarse column belongs to the rank that has the nearest fine one, and what works on vectors
    /// fetches the columns that it needs of others: all ranks make the same calls.
    pub fn shared_by(strip: &Strip) -> Self {
        let Self { axes: [x_axis, y_axis], .. } = Self::new(strip.whole(), [false; 2]);
        if !x_axis.halves() {
            // One column or two, of one rank.
            return Self { axes: [x_axis, y_axis], strip: Some(strip.clone()) };
        }
        let coarse = strip.coarser([x_axis.coarse, y_axis.coarse], &x_axis.nearest);
        let own = x_axis.part(strip.columns(), coarse.columns());
        Self { axes: [own, y_axis], strip: Some(coarse) }
    }

    /// This rank's strip of the coarse grid, if ranks share it.
    pub fn strip(&self) -> Option<&Strip> {
        self.strip.as_ref()
    }

    /// Returns the fine grid's `[nx, ny]`.
    pub fn fine(&self) -> [usize; 2] {
        self.axes.each_ref().map(|axis| axis.fine)
    }

    /// Returns the coarse grid's `[nx, ny]`.
    pub fn coarse(&self) -> [usize; 2] {
        self.axes.each_ref().map(|axis| axis.coarse)
    }

    /// Returns the fine spacing over the coarse one, along a row and along a column: `(h/H)`.
    pub fn ratio(&self) -> [T; 2] {
        self.axes.each_ref().map(|axis| axis.ratio)
    }

    /// Returns for each coarse column the nearest fine one, and for each coarse row.
    pub fn nearest(&self) -> [&[usize]; 2] {
        self.axes.each_ref().map(|axis| &axis.nearest[..])
    }

    /// Calls `each` with every coarse point and the value of `fine` at the fine point nearest to
    /// it.
    #[inline]
    pub fn inject(&self, fine: &[T], mut each: impl FnMut(usize, T)) {
        let [x_axis, y_axis] = &self.axes;
        for (row, &j) in y_axis.nearest.iter().enumerate() {
            let fine = &fine[j * x_axis.fine..(j + 1) * x_axis.fine];
            for (i, &nearest) in x_axis.nearest.iter().enumerate() {
                each(row * x_axis.coarse + i, fine[nearest]);
            }
        }
    }

    /// Adds to `fine` the bilinear interpolation of `coarse`, with zeros around the grid.
    pub fn interpolate(&self, coarse: &[T], fine: &mut [T], parallel: bool) {
        self.assert_orders(fine.len(), coarse.len());
        INTERPOLATE.of::<Interpolate<T>>()(self, Degree::Linear, coarse, fine, parallel);
    }

    /// Overwrites `fine` with an interpolation of `coarse` through the nearest four columns and
    /// rows, which asks for nothing beyond the grid.
    pub fn interpolate_smooth(&self, coarse: &[T], fine: &mut [T], parallel: bool) {
        self.assert_orders(fine.len(), coarse.len());
        INTERPOLATE.of::<Interpolate<T>>()(self, Degree::Cubic, coarse, fine, parallel);
    }

    fn run(&self, degree: Degree, coarse: &[T], fine: &mut [T], parallel: bool) {
        let (arch, threads) = (Arch::new(), team::threads(parallel, fine.len()));
        let strip = self.strip.as_ref();
        let beside =
            &strip.map_or([vec![], vec![]], |strip| strip.beside(degree as usize, |k| coarse[k]));
        let nx = self.axes[0].fine;
        let bands = Claims::new(fine.chunks_mut(nx * HEIGHT).enumerate());
        team::spread(threads, &|| {
            let mut line = [T::zero(); WIDTH + 2];
            while let Some((number, band)) = bands.next() {
                for (j, fine) in (number * HEIGHT..).zip(band.chunks_exact_mut(nx)) {
                    vectorised(
                        arch,
                        #[inline(always)]
                        || match degree {
                            Degree::Linear => self.linear(coarse, beside, j, &mut line, fine),
                            Degree::Cubic => self.cubic(coarse, beside, j, fine),
                        },
                    );
                }
            }
        });
    }

    /// Adds to row `j` of the fine grid what lies between the coarse rows beside it, of which other
    /// ranks have the columns `beside`.
    #[inline(always)]
    fn linear(
        &self,
        coarse: &[T],
        beside: &[Vec<T>; 2],
        j: usize,
        line: &mut [T; WIDTH + 2],
        fine: &mut [T],
    ) {
        let [x_axis, y_axis] = &self.axes;
        let width = x_axis.coarse;
        let (rows, weight) = y_axis.beside(j);
        // Once without coarse columns, too, which a rank with the last fine one may have.
        for start in (0..width.max(1)).step_by(WIDTH) {
            let [columns, points] = x_axis.stretch(start);
            // With the columns to either side, zero beyond the grid.
            line[..columns.len() + 2].fill(T::zero());
            let (from, until) = (columns.start.max(1) - 1, width.min(columns.end + 1));
            let inner = &mut line[from + 1 - columns.start..until + 1 - columns.start];
            let mut ends = [T::zero(); 2];
            for (row, weight) in rows.into_iter().zip([T::one() - weight, weight]) {
                let Some(k) = row.filter(|_| weight > T::zero()) else { continue };
                let row = &coarse[k * width..(k + 1) * width];
                for (v, &coarse) in inner.iter_mut().zip(&row[from..until]) {
                    *v += weight * coarse;
                }
                if x_axis.round {
                    ends[0] += weight * row[width - 1];
                }
                for (end, beside) in ends.iter_mut().zip(beside) {
                    beside.get(k).into_iter().for_each(|&beside| *end += weight * beside);
                }
            }
            if start == 0 {
                line[0] = ends[0];
            }
            if columns.end == width {
                line[columns.len() + 1] = ends[1];
            }
            x_axis.interpolate([start, points.start], line, &mut fine[points]);
        }
    }

    /// Overwrites row `j` of the fine grid, of which other ranks have the coarse columns `beside`.
    #[inline(always)]
    fn cubic(&self, coarse: &[T], beside: &[Vec<T>; 2], j: usize, fine: &mut [T]) {
        let [x_axis, y_axis] = &self.axes;
        let (row, of_rows) = y_axis.cubic[j];
        let (width, rows) = (x_axis.coarse, y_axis.coarse);
        let [west, east] = beside.each_ref().map(|beside| beside.len() / rows);
        for (i, fine) in fine.iter_mut().enumerate() {
            let (column, of_columns) = x_axis.cubic[i];
            let mut sum = T::zero();
            for (k, &weight) in of_rows.iter().enumerate().take(y_axis.taps) {
                let k = (row as usize + k) % rows;
                let coarse = &coarse[k * width..][..width];
                let value = |at: isize| match usize::try_from(at) {
                    Ok(at) if at < width => coarse[at],
                    Ok(at) if x_axis.round => coarse[at - width],
                    Ok(at) => beside[1][k * east + at - width],
                    Err(_) => beside[0][(k + 1) * west - at.unsigned_abs()],
                };
                let parts = (column..).zip(of_columns).take(x_axis.taps);
                let parts = parts.map(|(at, weight)| weight * value(at));
                sum += weight * parts.fold(T::zero(), |line, part| line + part);
            }
            *fine = sum;
        }
    }

    pub(super) fn assert_orders(&self, fine: usize, coarse: usize) {
        let orders = [self.fine(), self.coarse()].map(|[nx, ny]| nx * ny);
        assert_eq!([fine, coarse], orders, "vectors of the grids' orders");
    }

    /// Returns the full weighting's portions of coarse rows: one of the coarse vector's bands.
    pub(super) fn bands<'v>(&self, coarse: &'v mut [T]) -> Bands<'v, T> {
        // A rank may have the last fine column and no coarse one.
        Claims::new(coarse.chunks_mut((self.axes[0].coarse * HEIGHT).max(1)).enumerate())
    }

    /// Overwrites band `number` of a coarse vector with the full weighting of a defect, of which
    /// other ranks have the columns `beside`: the transpose of the bilinear interpolation over the
    /// ratio of the cells' areas.
    pub(super) fn restrict<S: Source<T>>(
        &self,
        number: usize,
        band: &mut [T],
        defects: &mut Defects<'_, T, S>,
        beside: &[Vec<T>; 2],
    ) {
        let [x_axis, y_axis] = &self.axes;
        let width = x_axis.coarse;
        let first = number * HEIGHT;
        let height = band.len() / width;
        let scale = x_axis.ratio * y_axis.ratio;
        let lines = if y_axis.halves() {
            let end = 2 * (first + height) + 2;
            2 * first..if y_axis.round { end } else { y_axis.fine.min(end) }
        } else {
            first..first + height
        };
        let mut d = [T::zero(); COLUMNS];
        // What has come together for one coarse row and for the next.
        let (mut sum, mut next) = (&mut [T::zero(); COLUMNS], &mut [T::zero(); COLUMNS]);
        // One coarse column less than fits, whose last fine neighbours are the next one's first.
        for start in (0..width).step_by(WIDTH - 2) {
            let columns = start..width.min(start + WIDTH - 2);
            let fine = if x_axis.halves() {
                2 * columns.start..x_axis.known.min(2 * columns.end + 2)
            } else {
                columns.clone()
            };
            // Of these other ranks have `west` and `east`.
            let lead = x_axis.lead;
            let own = fine.start.max(lead)..fine.end.min(lead + x_axis.fine);
            let (west, east) = (own.start - fine.start, fine.end - own.end);
            let own = own.start - lead..own.end - lead;
            // Across the end of rows that close.
            let beyond =
                if x_axis.halves() && x_axis.round && columns.end == width { 2 } else { 0 };
            let (inside, n) = (fine.len(), fine.len() + beyond);
            // One more than there are, since they are taken by pairs.
            sum[..=n].fill(T::zero());
            next[..=n].fill(T::zero());
            for j in lines.clone() {
                let j = j % y_axis.fine;
                defects.row(j, own.clone(), &mut d[west..inside - east]);
                if west > 0 {
                    d[..west].copy_from_slice(&beside[0][(j + 1) * WEIGHTED - west..][..west]);
                }
                if east > 0 {
                    let width = beside[1].len() / y_axis.fine;
                    d[inside - east..inside].copy_from_slice(&beside[1][j * width..][..east]);
                }
                if beyond > 0 {
                    defects.row(j, 0..beyond, &mut d[inside..n]);
                }
                let ([before, after], weight) = y_axis.beside(j);
                share_out(defects.arch, weight, &d[..n], [&mut sum[..n], &mut next[..n]]);
                let (complete, whole) = if y_axis.halves() {
                    (before.filter(|_| j % 2 == 1 || j + 1 == y_axis.fine), &*sum)
                } else {
                    (after, &*next)
                };
                if let Some(k) = complete.filter(|k| (first..first + height).contains(k)) {
                    let out = &mut band[(k - first) * width..][columns.clone()];
                    vectorised(
                        defects.arch,
                        #[inline(always)]
                        || x_axis.weigh(columns.start, scale, whole, out),
                    );
                }
                if complete.is_some() || j % 2 == 1 {
                    std::mem::swap(&mut sum, &mut next);
                    next[..n].fill(T::zero());
                    if !y_axis.halves() {
                        sum[..n].fill(T::zero());
                    }
                }
            }
        }
    }
}

/// Adds a row of the defect to the two coarse rows beside it, given its weight in the later one.
fn share_out<T: Scalar>(arch: Arch, weight: T, d: &[T], [sum, next]: [&mut [T]; 2]) {
    let earlier = T::one() - weight;
    vectorised(
        arch,
        #[inline(always)]
        || {
            if earlier == T::zero() {
                next.iter_mut().zip(d).for_each(|(next, &d)| *next += d);
            } else {
                for ((sum, next), &d) in sum.iter_mut().zip(next).zip(d) {
                    *sum += earlier * d;
                    *next += weight * d;
                }
            }
        },
    );
}

impl<T: Scalar> Axis<T> {
    /// Overwrites a stretch of coarse columns from `start` with the weighted sums of the fine ones,
    /// of which `fine` holds those from the first that belongs to the stretch.
    #[inline(always)]
    fn weigh(&self, start: usize, scale: T, fine: &[T], coarse: &mut [T]) {
        if !self.halves() {
            for (coarse, &fine) in coarse.iter_mut().zip(fine) {
                *coarse = scale * fine;
            }
            return;
        }
        let n = coarse.len();
        let (fine, _) = fine[..2 * n + 2].as_chunks::<2>();
        let (weights, _) = self.weights[2 * start..][..2 * n + 2].as_chunks::<2>();
        for i in 0..n {
            let ([a, b], [c, d]) = (fine[i], fine[i + 1]);
            let ([wa, wb], [wc, wd]) = (weights[i], weights[i + 1]);
            let after = (T::one() - wc) * c + (T::one() - wd) * d;
            coarse[i] = scale * (wa * a + wb * b + after);
        }
    }

    /// Adds to a stretch of fine columns the interpolation of a padded stretch of coarse ones,
    /// given where both begin.
    #[inline(always)]
    fn interpolate(&self, [start, points]: [usize; 2], padded: &[T], fine: &mut [T]) {
        if !self.halves() {
            for (fine, &coarse) in fine.iter_mut().zip(&padded[1..]) {
                *fine += coarse;
            }
            return;
        }
        // By pairs that lie between the same coarse columns; the first of a strip may be half one.
        let (first, ahead) = (points + self.lead, points + self.lead - 2 * start);
        let (half, fine) = fine.split_at_mut(ahead % 2);
        let (weight, weights) = self.weights[first..][..ahead % 2 + fine.len()].split_at(ahead % 2);
        for (fine, &weight) in half.iter_mut().zip(weight) {
            *fine += (T::one() - weight) * padded[ahead / 2] + weight * padded[ahead / 2 + 1];
        }
        let padded = &padded[ahead.div_ceil(2)..];
        let (pairs, rest) = fine.as_chunks_mut::<2>();
        let (weights, last) = weights.as_chunks::<2>();
        let n = pairs.len();
        let (padded, weights) = (&padded[..n + 1 + rest.len()], &weights[..n]);
        for i in 0..n {
            let (left, right) = (padded[i], padded[i + 1]);
            for (fine, &weight) in pairs[i].iter_mut().zip(&weights[i]) {
                *fine += (T::one() - weight) * left + weight * right;
            }
        }
        for (fine, &weight) in rest.iter_mut().zip(last) {
            *fine += (T::one() - weight) * padded[n] + weight * padded[n + 1];
        }
    }
}

/// How an interpolation goes, and how many columns of the coarse grid it takes of other ranks, at
/// the end of the grid too.
#[derive(Clone, Copy)]
enum Degree {
    /// Adds the bilinear one.
    Linear = 1,
    /// Overwrites by cubics.
    Cubic = 4,
}

type Interpolate<T> = fn(&Transfer<T>, Degree, &[T], &mut [T], bool);

static INTERPOLATE: Compiled<Interpolate<f32>, Interpolate<f64>> =
    Compiled(Transfer::run, Transfer::run);
