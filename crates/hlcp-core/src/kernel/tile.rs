use std::ops::Range;

use pulp::Arch;

use super::{
    coefficients::{Pair, Source, part},
    grid::{COLUMNS, Grid, Old, PAD, ROWS, zeros},
};
use crate::{
    numbers::{Scalar, Tallies, vectorised},
    parallel::Turns,
};

/// The row that a sweep has done last before band `number`, and its first row.
#[derive(Clone, Copy)]
pub(super) struct Edge<'a, T> {
    pub(super) number: usize,
    /// Those of the only worker, empty before there are any.
    pub(super) rows: [&'a [T]; 2],
    /// Of several workers, the values in each stretch of columns, which band after band overwrites.
    pub(super) turns: &'a [Turns<[[T; COLUMNS]; 2]>],
}

/// The state of one worker while it relaxes a band of rows.
///
/// What vectors are loaded from comes first, at a line of the cache: elsewhere sweeps over
/// coefficients that vary take 1.02 to 1.06 times as long.
#[repr(C, align(64))]
pub(super) struct Worker<'a, T, S: Source<T>> {
    loaded: S::Loaded,
    kept: [S::Kept; ROWS],
    around: Around<'a, T>,
    arch: Arch,
    old: &'a Old<'a, T>,
    source: &'a S,
    /// The factors of the first point of each row at its last, where rows close.
    along: [Pair<T>; ROWS],
    /// The new values beside each row of the band, where the sweep enters it.
    before: [T; ROWS],
    /// F(x) in a stretch, and the sums of its squares, if the sweep measures.
    pub(super) measured: Option<([T; COLUMNS + PAD], Tallies<T>)>,
}

/// The old iterate around a stretch of a row.
pub(super) struct Around<'a, T> {
    pub(super) grid: Grid,
    x: &'a [T],
    /// `x` west and east of the grid, where other ranks have it go on.
    beside: [&'a [T]; 2],
    /// A stretch at an end of `x`, with room for a value on either side.
    padded: [T; COLUMNS + PAD],
}

impl<'a, T: Scalar> Around<'a, T> {
    #[inline(always)]
    pub(super) fn new(grid: Grid, x: &'a [T], beside: [&'a [T]; 2]) -> Self {
        Self { grid, x, beside, padded: [T::zero(); COLUMNS + PAD] }
    }

    /// Returns the values beyond the ends of row `j`, as far as the stretch reaches these.
    #[inline(always)]
    pub(super) fn ends(&self, j: usize, columns: &Range<usize>) -> [Option<T>; 2] {
        self.grid.ends(self.x, self.beside, j, columns)
    }

    /// Returns the southern, western, own, eastern and northern values of a stretch of row `j`;
    /// beside a row's ends any number may stand.
    #[inline(always)]
    pub(super) fn stretch(&mut self, j: usize, columns: Range<usize>) -> [&[T]; 5] {
        let Self { grid: Grid { nx, ny, round: [_, round], .. }, x, .. } = *self;
        let Range { start, end } = columns;
        let row = |j: usize| &x[j * nx + start..j * nx + end];
        let beyond = |j: usize| if round { row(j) } else { &zeros()[..end - start] };
        let south = if j > 0 { row(j - 1) } else { beyond(ny - 1) };
        let north = if j + 1 < ny { row(j + 1) } else { beyond(0) };
        // West of a row's first point the vector holds the last one of the row before: the edges
        // are put right afterwards. Only at the vector's own ends there is nothing to read.
        let (from, until, n) = (j * nx + start, j * nx + end, end - start);
        if from == 0 || until == x.len() {
            self.padded[1..=n].copy_from_slice(&x[from..until]);
        }
        let west = if from > 0 { &x[from - 1..until - 1] } else { &self.padded[..n] };
        let east = if until < x.len() { &x[from + 1..until + 1] } else { &self.padded[2..n + 2] };
        [south, west, &x[from..until], east, north]
    }
}

impl<'a, T: Scalar, S: Source<T>> Worker<'a, T, S> {
    pub(super) fn new(arch: Arch, old: &'a Old<'a, T>, source: &'a S) -> Self {
        let (loaded, kept) = (source.loaded(), std::array::from_fn(|_| source.kept()));
        let around = Around::new(old.grid, old.x, old.beside);
        let (along, before) = ([[T::zero(); 2]; ROWS], [T::zero(); ROWS]);
        let measured =
            (!S::LEAN).then(|| ([T::zero(); COLUMNS + PAD], Tallies::new(old.stretches)));
        Self { arch, old, source, loaded, kept, around, along, before, measured }
    }

    /// Relaxes the rows of `band`, at most [`ROWS`], the first of which is row `first` of the grid.
    ///
    /// `edge` is the neighbouring row that the sweep has done last.
    pub(super) fn relax<const BACKWARD: bool, const ACCELERATED: bool>(
        &mut self,
        first: usize,
        band: &mut [T],
        edge: Edge<'_, T>,
    ) {
        let nx = self.old.grid.nx;
        let height = band.len() / nx;
        for tile in pieces::<BACKWARD>(0..nx, S::WIDTH) {
            // Northwards and eastwards in either direction: backward sweeps of large grids take
            // 0.83 of the time that a walk the other way takes.
            for row in 0..height {
                let k = if BACKWARD { height - 1 - row } else { row };
                let y = &mut band[row * nx..(row + 1) * nx];
                for columns in pieces::<false>(tile.clone(), S::CHUNK) {
                    self.prepare::<BACKWARD, ACCELERATED>(first + row, k, columns, y);
                }
            }
            for columns in pieces::<BACKWARD>(tile, S::CHUNK) {
                self.recur::<BACKWARD, ACCELERATED>(band, edge, columns);
            }
        }
    }

    /// Does the first phase of a stretch of row `j`: F(x) for the norms, and `t` into `y`.
    fn prepare<const BACKWARD: bool, const ACCELERATED: bool>(
        &mut self,
        j: usize,
        k: usize,
        columns: Range<usize>,
        y: &mut [T],
    ) {
        let Old { grid, q, q_factor, meter, .. } = *self.old;
        let Range { start, end } = columns.clone();
        let (from, until) = (j * grid.nx + start, j * grid.nx + end);
        let ends = self.around.ends(j, &columns);
        let [south, west, here, east, north] = self.around.stretch(j, columns.clone());
        self.source.load(j, columns, &mut self.loaded);
        let (arch, source) = (self.arch, self.source);
        let (loaded, kept) = (&self.loaded, &mut self.kept[k]);
        let (q, t) = (&q[from..until], &mut y[start..end]);
        if let Some((defect, tallies)) = &mut self.measured {
            let (around, defect) = ([south, west, here, east, north], &mut defect[..end - start]);
            vectorised(
                arch,
                #[inline(always)]
                || {
                    first_phase::<_, _, BACKWARD, ACCELERATED>(
                        source, loaded, kept, around, ends, q, q_factor, defect, t,
                    );
                    tallies.add(meter, start, defect);
                },
            );
        } else {
            let coming = if BACKWARD { [south, west] } else { [north, east] };
            let beyond = if BACKWARD { ends[0] } else { ends[1] };
            vectorised(
                arch,
                #[inline(always)]
                || {
                    lean_phase::<_, _, BACKWARD>(
                        source, loaded, kept, coming, beyond, q, q_factor, t,
                    );
                },
            );
        }
        if grid.round != [false; 2] {
            self.close::<BACKWARD, ACCELERATED>(j, k, start..end, y);
        }
    }

    /// Moves what neighbours across a grid that closes contribute to `t`: the sweep's first point
    /// of a row, and its first row, have passed none there, and the last ones have.
    fn close<const BACKWARD: bool, const ACCELERATED: bool>(
        &mut self,
        j: usize,
        k: usize,
        columns: Range<usize>,
        y: &mut [T],
    ) {
        let (source, loaded, old) = (self.source, &self.loaded, self.old);
        let Grid { nx, ny, round, .. } = old.grid;
        let x = |j: usize, i: usize| old.x[j * nx + i];
        let passed = |i: usize, backward| {
            source.row::<ACCELERATED>(loaded, i - columns.start).passed(backward)
        };
        let [first, last] = if BACKWARD { [nx - 1, 0] } else { [0, nx - 1] };
        if round[0] && columns.contains(&first) {
            let [_, along] = passed(first, BACKWARD);
            y[first] -= part::<_, ACCELERATED>(along, x(j, last));
        }
        if round[0] && columns.contains(&last) {
            let [_, along] = passed(last, !BACKWARD);
            y[last] += part::<_, ACCELERATED>(along, x(j, first));
            self.along[k] = along;
        }
        let [first, last] = if BACKWARD { [ny - 1, 0] } else { [0, ny - 1] };
        if round[1] && j == first {
            for i in columns.clone() {
                let [across, _] = passed(i, BACKWARD);
                y[i] -= part::<_, ACCELERATED>(across, x(last, i));
            }
        }
        if round[1] && j == last {
            for i in columns.clone() {
                let [across, _] = passed(i, !BACKWARD);
                y[i] += part::<_, ACCELERATED>(across, x(first, i));
            }
        }
    }

    /// Runs the recurrence over a stretch of the band.
    fn recur<const BACKWARD: bool, const ACCELERATED: bool>(
        &mut self,
        band: &mut [T],
        edge: Edge<'_, T>,
        columns: Range<usize>,
    ) {
        let Grid { nx, ny, round, .. } = self.old.grid;
        let length = columns.len();
        let height = band.len() / nx;
        // The band's row that comes k-th in the sweep, and the stretch of a row.
        let row = |k: usize| if BACKWARD { height - 1 - k } else { k };
        let at = |row: usize| row * nx + columns.start..row * nx + columns.end;
        let mut turn = None;
        let Edge { number, rows, turns } = edge;
        let closes = round[1] && (number + 1) * ROWS >= ny;
        let (passed, opening) = if turns.is_empty() {
            let [passed, first] = rows.map(|row| row.get(columns.clone()));
            (passed.unwrap_or(&zeros()[..length]), first)
        } else {
            let turn = turn.insert(turns[columns.start / S::CHUNK].wait(number));
            let [passed, first] = &*turn.value;
            (&passed[..length], Some(&first[..length]))
        };
        let side = if BACKWARD { columns.end } else { columns.start.wrapping_sub(1) };
        // Messages go one way during a sweep: a rank enters a band when the one before has left it.
        let (from, to) = if BACKWARD { (1, 0) } else { (0, 1) };
        let ends = [columns.start == 0, columns.end == nx];
        if let Some(strip) = self.old.strip.filter(|_| ends[from]) {
            strip.take(from, &mut self.before);
        }
        let beside = self.before;
        let before = |k: usize, line: &[T]| line.get(side).copied().unwrap_or(beside[row(k)]);
        let alone = closes && height == ny;
        // Takes off the last row what it has from the sweep's first one.
        let (source, loaded) = (self.source, &mut self.loaded);
        let final_row = if BACKWARD { 0 } else { ny - 1 };
        let mut subtract = |first: &[T], row: &mut [T]| {
            source.load(final_row, columns.clone(), loaded);
            for (i, (y, &first)) in row.iter_mut().zip(first).enumerate() {
                let [across, _] = source.row::<ACCELERATED>(loaded, i).passed(!BACKWARD);
                *y -= part::<_, ACCELERATED>(across, first);
            }
        };
        if let Some(first) = opening.filter(|_| closes && !alone) {
            subtract(first, &mut band[at(row(height - 1))]);
        }
        // The sweep's first point of a row, and its last one.
        let [first, final_] = if BACKWARD { [nx - 1, 0] } else { [0, nx - 1] };
        let closing = (round[0] && columns.contains(&final_)).then_some(&self.along);
        let link: Link<'_, T, S, BACKWARD, ACCELERATED> =
            Link { source: *self.source, kept: &self.kept };
        if height == ROWS && length >= ROWS && !alone {
            let mut rows = band.chunks_exact_mut(nx);
            let mut rows: [&mut [T]; ROWS] =
                std::array::from_fn(|_| rows.next().expect("a full band"));
            if BACKWARD {
                rows.reverse();
            }
            let start = std::array::from_fn(|k| before(k, rows[k]));
            let opened = std::array::from_fn(|k| rows[k][first]);
            let whole = length == nx;
            let closed = closing.map(|pairs| Ends { pairs, opened, whole });
            let rows = rows.map(|row| &mut row[columns.clone()]);
            link.skewed(self.arch, passed, start, rows, closed);
        } else {
            for k in 0..height {
                if alone && k + 1 == height {
                    let mut opened = *zeros();
                    opened[..length].copy_from_slice(&band[at(row(0))]);
                    subtract(&opened[..length], &mut band[at(row(k))]);
                }
                let (south, rest) = band.split_at_mut(row(k) * nx);
                let (line, north) = rest.split_at_mut(nx);
                let across = match k {
                    0 => passed,
                    _ if BACKWARD => &north[columns.clone()],
                    _ => &south[at(k - 1)],
                };
                let start = before(k, line);
                let stretch = &mut line[columns.clone()];
                link.chain(k, 0..length, across, start, stretch);
                if let Some(pairs) = closing {
                    line[final_] -= part::<_, ACCELERATED>(pairs[k], line[first]);
                }
            }
        }
        if let Some(strip) = self.old.strip.filter(|_| ends[to]) {
            let column = if to == 0 { 0 } else { nx - 1 };
            let mut last = [T::zero(); ROWS];
            last.iter_mut().zip(band.iter().skip(column).step_by(nx)).for_each(|(l, &v)| *l = v);
            strip.pass(to, &last);
        }
        if let Some(mut turn) = turn {
            let [passed, first] = &mut *turn.value;
            passed[..length].copy_from_slice(&band[at(row(height - 1))]);
            if round[1] && number == 0 {
                first[..length].copy_from_slice(&band[at(row(0))]);
            }
            turn.pass();
        }
    }
}

/// The first points of rows that close, as the last ones need them.
struct Ends<'a, T> {
    pairs: &'a [Pair<T>; ROWS],
    /// The first points' values, unless the stretch holds the whole row.
    opened: [T; ROWS],
    whole: bool,
}

/// Pieces of `width` columns, the last one narrower, in the order of the sweep.
#[inline(always)]
pub(super) fn pieces<const BACKWARD: bool>(
    columns: Range<usize>,
    width: usize,
) -> impl Iterator<Item = Range<usize>> {
    let count = columns.len().div_ceil(width);
    (0..count).map(move |k| {
        let start = columns.start + width * if BACKWARD { count - 1 - k } else { k };
        start..columns.end.min(start.saturating_add(width))
    })
}

/// Does the first phase of a stretch of a row, given its five neighbours and the values beyond the
/// ends of the row.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "slices as arguments are known not to overlap")]
fn first_phase<T: Scalar, S: Source<T>, const BACKWARD: bool, const ACCELERATED: bool>(
    source: &S,
    loaded: &S::Loaded,
    kept: &mut S::Kept,
    [south, west, here, east, north]: [&[T]; 5],
    [to_west, to_east]: [Option<T>; 2],
    q: &[T],
    q_factor: T,
    defect: &mut [T],
    t: &mut [T],
) {
    let n = t.len().min(S::CHUNK);
    let (south, west, here, east, north) =
        (&south[..n], &west[..n], &here[..n], &east[..n], &north[..n]);
    let (q, defect) = (&q[..n], &mut defect[..n]);
    for i in 0..n {
        let row = source.row::<ACCELERATED>(loaded, i);
        let x = [south[i], west[i], here[i], east[i], north[i]];
        (defect[i], t[i]) = row.relaxed::<BACKWARD, ACCELERATED>(x, q_factor * q[i]);
        source.keep::<ACCELERATED>(kept, i, row.passed(BACKWARD));
    }
    let mut edge = |i: usize| {
        let west = to_west.filter(|_| i == 0).unwrap_or(west[i]);
        let east = to_east.filter(|_| i + 1 == n).unwrap_or(east[i]);
        let row = source.row::<ACCELERATED>(loaded, i);
        let x = [south[i], west, here[i], east, north[i]];
        (defect[i], t[i]) = row.relaxed::<BACKWARD, ACCELERATED>(x, q_factor * q[i]);
    };
    if to_west.is_some() {
        edge(0);
    }
    if to_east.is_some() {
        edge(n - 1);
    }
}

/// Does the first phase of a stretch of a sweep that measures nothing, given the two neighbours
/// that are not passed and the value beyond the end of the row.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "slices as arguments are known not to overlap")]
fn lean_phase<T: Scalar, S: Source<T>, const BACKWARD: bool>(
    source: &S,
    loaded: &S::Loaded,
    kept: &mut S::Kept,
    [across, along]: [&[T]; 2],
    beyond: Option<T>,
    q: &[T],
    q_factor: T,
    t: &mut [T],
) {
    let n = t.len().min(S::CHUNK);
    let (across, along, q) = (&across[..n], &along[..n], &q[..n]);
    for i in 0..n {
        let row = source.row::<true>(loaded, i);
        t[i] = row.solved::<BACKWARD>([across[i], along[i]], q_factor * q[i]);
        source.keep::<true>(kept, i, row.passed(BACKWARD));
    }
    if let Some(beyond) = beyond {
        let i = if BACKWARD { 0 } else { n - 1 };
        let row = source.row::<true>(loaded, i);
        t[i] = row.solved::<BACKWARD>([across[i], beyond], q_factor * q[i]);
    }
}

/// The recurrence, with what it takes of the passed neighbours.
struct Link<'a, T, S: Source<T>, const BACKWARD: bool, const ACCELERATED: bool> {
    source: S,
    kept: &'a [S::Kept; ROWS],
}

impl<T: Scalar, S: Source<T>, const BACKWARD: bool, const ACCELERATED: bool>
    Link<'_, T, S, BACKWARD, ACCELERATED>
{
    /// Returns the value at point `i` of row `k`.
    #[inline(always)]
    fn value(&self, k: usize, i: usize, t: T, across: T, along: T) -> T {
        let passed = self.source.passed::<BACKWARD>(&self.kept[k], i);
        (t - part::<_, ACCELERATED>(passed[0], across)) - part::<_, ACCELERATED>(passed[1], along)
    }

    /// Points of row `k` in sweep order, beginning behind the value `y`; the last value.
    #[inline(always)]
    fn chain(&self, k: usize, points: Range<usize>, across: &[T], mut y: T, row: &mut [T]) -> T {
        let n = row.len();
        for i in points {
            let i = if BACKWARD { n - 1 - i } else { i };
            y = self.value(k, i, row[i], across[i], y);
            row[i] = y;
        }
        y
    }

    /// Relaxes rows side by side, row `k` one column behind row `k − 1`.
    fn skewed(
        &self,
        arch: Arch,
        passed: &[T],
        start: [T; ROWS],
        mut rows: [&mut [T]; ROWS],
        ends: Option<Ends<'_, T>>,
    ) {
        let n = passed.len();
        let mut y = start;
        for (k, y) in y.iter_mut().enumerate() {
            let (done, row) = rows.split_at_mut(k);
            let across = done.last().map_or(passed, |row| row);
            *y = self.chain(k, 0..ROWS - 1 - k, across, *y, row[0]);
        }
        let m = n + 1 - ROWS;
        let wide = m - m % 64;
        let done = m - m % 8;
        vectorised(
            arch,
            #[inline(always)]
            || {
                self.blocks::<64>(0..wide, passed, &mut y, &mut rows);
                self.blocks::<8>(wide..done, passed, &mut y, &mut rows);
            },
        );
        for (k, &y) in y.iter().enumerate() {
            let (before, row) = rows.split_at_mut(k);
            let across = before.last().map_or(passed, |row| row);
            let points = ROWS - 1 - k + done..n;
            self.chain(k, points, across, y, row[0]);
            if let Some(Ends { pairs, opened, whole }) = &ends {
                let [first, last] = if BACKWARD { [n - 1, 0] } else { [0, n - 1] };
                let value = if *whole { row[0][first] } else { opened[k] };
                row[0][last] -= part::<_, ACCELERATED>(pairs[k], value);
            }
        }
    }

    /// Takes, of rows side by side, the `steps` that relax point `s + ROWS − 1 − k` of row `k`.
    ///
    /// By blocks of `W` steps, which need no check of an index.
    #[inline(always)]
    fn blocks<const W: usize>(
        &self,
        steps: Range<usize>,
        passed: &[T],
        y: &mut [T; ROWS],
        rows: &mut [&mut [T]; ROWS],
    ) {
        let n = passed.len();
        let mut last = *y;
        for s in steps.step_by(W) {
            let at = |k: usize| {
                let point = s + ROWS - 1 - k;
                if BACKWARD { n - point - W } else { point }
            };
            let mut k = 0;
            let rows = rows.each_mut().map(|row| {
                k += 1;
                row[at(k - 1)..].first_chunk_mut::<W>().expect("a block within the row")
            });
            let first = passed[at(0)..].first_chunk::<W>().expect("a block within the row");
            for i in 0..W {
                let i = if BACKWARD { W - 1 - i } else { i };
                // From the last row up, so that `last[k − 1]` still is the value across from row
                // k's point.
                for k in (0..ROWS).rev() {
                    let across = if k == 0 { first[i] } else { last[k - 1] };
                    let t = rows[k][i];
                    last[k] = self.value(k, at(k) + i, t, across, last[k]);
                    rows[k][i] = last[k];
                }
            }
        }
        *y = last;
    }
}
