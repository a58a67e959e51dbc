use std::{ops::Range, sync::Arc};

use super::Ranks;
use crate::numbers::{Error, Part, Scalar, Stretches, Totals, assert_lengths};

/// The columns of a grid that one rank works on.
///
/// A strip is made of whole stretches of columns, of which a grid has at most 64: one for each 256
/// columns, wider ones beyond 16384. Sums by stretches do not depend on the number of ranks. A
/// rank's vectors hold the points of its columns, row by row.
///
/// ```
/// use hlcp_core::{Strip, ranks_as_threads};
///
/// let columns = ranks_as_threads(2, |ranks| {
///     let strip = Strip::new(ranks, [600, 4])?;
///     let k = strip.vector(|i, j| i + 600 * j); // the index of each point of the whole grid
///     assert_eq!(k[strip.grid()[0]], strip.index(strip.grid()[0]));
///     Ok::<_, hlcp_core::Error>(strip.columns())
/// });
/// assert_eq!(columns, [Ok(0..256), Ok(256..600)]);
/// ```
#[derive(Debug, Clone)]
pub struct Strip {
    ranks: Arc<dyn Ranks>,
    whole: [usize; 2],
    /// The first column of each rank, and the number of columns.
    cuts: Arc<[usize]>,
}

impl Strip {
    /// This rank's strip of a grid of `[nx, ny]` points. No rank waits for another.
    ///
    /// # Errors
    ///
    /// [`Error::Grid`] for a grid without points; [`Error::Parameter`] for more ranks than the grid
    /// has stretches.
    pub fn new(ranks: Arc<dyn Ranks>, [nx, ny]: [usize; 2]) -> Result<Self, Error> {
        if nx.checked_mul(ny).is_none_or(|n| n == 0) {
            return Err(Error::Grid { nx, ny });
        }
        let (stretches, size) = (Stretches::of([nx, ny]), ranks.size());
        if size > stretches.count() {
            return Err(Error::Parameter {
                name: "the number of ranks",
                value: size as f64,
                range: "at most one for every 256 columns of the grid, and at most 64",
            });
        }
        // Whole stretches, as many for each rank as can be.
        let end = |rank: usize| nx.min(rank * stretches.count() / size * stretches.width);
        let cuts = (0..size).map(end).chain([nx]).collect();
        Ok(Self { ranks, whole: [nx, ny], cuts })
    }

    /// Returns the strips of a coarser grid, where each rank has the columns whose `nearest` on
    /// this grid are its own.
    pub(crate) fn coarser(&self, whole: [usize; 2], nearest: &[usize]) -> Self {
        let first = |&cut: &usize| nearest.partition_point(|&column| column < cut);
        let cuts = self.cuts.iter().map(first).collect();
        Self { ranks: self.ranks.clone(), whole, cuts }
    }

    /// Returns the number of this rank.
    pub fn rank(&self) -> usize {
        self.ranks.rank()
    }

    /// Returns the number of ranks.
    pub fn size(&self) -> usize {
        self.ranks.size()
    }

    /// Returns the whole grid's `[nx, ny]`.
    pub fn whole(&self) -> [usize; 2] {
        self.whole
    }

    /// This rank's columns.
    pub fn columns(&self) -> Range<usize> {
        self.columns_of(self.rank())
    }

    /// Returns the grid of this rank's columns.
    pub fn grid(&self) -> [usize; 2] {
        [self.columns().len(), self.whole[1]]
    }

    /// Returns the index in the whole grid of this rank's point `k`.
    #[doc(hidden)]
    pub fn index(&self, k: usize) -> usize {
        let Range { start, end } = self.columns();
        let nx = end - start;
        k / nx * self.whole[0] + start + k % nx
    }

    /// Returns this rank's part of a vector, whose `entry(i, j)` is that in column `i` and row `j`
    /// of the whole grid.
    pub fn vector<V>(&self, mut entry: impl FnMut(usize, usize) -> V) -> Vec<V> {
        let columns = self.columns();
        (0..self.whole[1])
            .flat_map(|j| columns.clone().map(move |i| (i, j)))
            .map(|(i, j)| entry(i, j))
            .collect()
    }

    /// Returns the whole vector of which each rank gives its part: on rank 0, elsewhere `None`. All
    /// ranks call it.
    ///
    /// # Panics
    ///
    /// Unless `own` has an entry for each point of this rank.
    ///
    /// ```
    /// use hlcp_core::{Strip, ranks_as_threads};
    ///
    /// let whole = ranks_as_threads(2, |ranks| {
    ///     let strip = Strip::new(ranks, [600, 2]).expect("a grid");
    ///     strip.gather(&strip.vector(|i, j| (i + 600 * j) as f64))
    /// });
    /// assert_eq!(whole, [Some((0..1200).map(f64::from).collect()), None]);
    /// ```
    pub fn gather<T: Scalar>(&self, own: &[T]) -> Option<Vec<T>> {
        let [nx, ny] = self.whole;
        assert_lengths(self.columns().len() * ny, [("own", own.len())]);
        if self.rank() > 0 {
            own.chunks(self.columns().len()).for_each(|row| self.ranks.send(0, &wide(row)));
            return None;
        }
        let mut whole = vec![T::zero(); nx * ny];
        for (whole, own) in whole.chunks_mut(nx).zip(own.chunks(self.columns().len())) {
            whole[self.columns()].copy_from_slice(own);
            for rank in 1..self.size() {
                let columns = self.columns_of(rank);
                let mut row = vec![0.0; columns.len()];
                self.ranks.receive(rank, &mut row);
                narrow(&row, &mut whole[columns]);
            }
        }
        Some(whole)
    }

    /// Returns, of each place, the largest number that a rank has there; NaN is no number. All
    /// ranks call it.
    ///
    /// ```
    /// use hlcp_core::{Strip, ranks_as_threads};
    ///
    /// let most = ranks_as_threads(3, |ranks| {
    ///     let strip = Strip::new(ranks, [800, 1]).expect("a grid");
    ///     strip.largest([strip.rank() as f64, -(strip.rank() as f64)])
    /// });
    /// assert_eq!(most, [[2.0, 0.0]; 3]);
    /// ```
    pub fn largest<const K: usize>(&self, own: [f64; K]) -> [f64; K] {
        let mut most = own;
        for numbers in self.joined(&own, |_| K).chunks(K) {
            most.iter_mut().zip(numbers).for_each(|(most, &number)| *most = most.max(number));
        }
        most
    }

    /// Makes one result of those of all ranks: an error on one is the error of all, with its index
    /// in the whole grid. What can fail on one rank goes through here before the ranks go on. All
    /// ranks call it.
    ///
    /// # Errors
    ///
    /// Of [`Error::NotFinite`] and [`Error::NotPositive`] that with the smallest index, otherwise
    /// that of the first rank, which others that fail otherwise or not at all return as
    /// [`Error::Rank`].
    ///
    /// ```
    /// use hlcp_core::{Strip, all_finite, ranks_as_threads};
    ///
    /// let errors = ranks_as_threads(2, |ranks| {
    ///     let strip = Strip::new(ranks, [600, 1])?;
    ///     let q = strip.vector(|i, _| if i == 300 { f64::NAN } else { 1.0 });
    ///     strip.agree(all_finite("q", &q))
    /// });
    /// for error in errors {
    ///     let error = error.unwrap_err().to_string();
    ///     assert_eq!(error, "q[300] is NaN, which is not a finite number");
    /// }
    /// ```
    pub fn agree<V>(&self, own: Result<V, Error>) -> Result<V, Error> {
        let numbered = |index| self.index(index) as f64;
        let (kind, index, value, text) = match &own {
            Ok(_) => (0.0, 0.0, 0.0, String::new()),
            Err(Error::NotFinite { what, index, value }) => {
                (1.0, numbered(*index), *value, (*what).to_owned())
            }
            Err(Error::NotPositive { what, index, value }) => {
                (2.0, numbered(*index), *value, (*what).to_owned())
            }
            Err(other) => (3.0, -1.0, 0.0, other.to_string()),
        };
        let all = self.joined(&[kind, index, value, text.len() as f64], |_| 4);
        let failed = all.chunks(4).enumerate().filter(|(_, numbers)| numbers[0] > 0.0);
        let Some((rank, first)) = failed.min_by(|(_, a), (_, b)| a[1].total_cmp(&b[1])) else {
            return own;
        };
        let bytes: Vec<f64> = text.bytes().map(f64::from).collect();
        let bytes = if rank == self.rank() { &bytes[..] } else { &[] };
        let told = self.joined(bytes, |k| if k == rank { first[3] as usize } else { 0 });
        let told = String::from_utf8_lossy(&told.iter().map(|&b| b as u8).collect::<Vec<_>>())
            .into_owned();
        let (index, value) = (first[1] as usize, first[2]);
        Err(match (first[0] as usize, own) {
            // An error keeps its texts for ever; there are few.
            (1, _) => Error::NotFinite { what: told.leak(), index, value },
            (2, _) => Error::NotPositive { what: told.leak(), index, value },
            (_, Err(own)) if told == text => own,
            _ => Error::Rank { rank, error: told },
        })
    }

    /// Returns the columns of a rank.
    fn columns_of(&self, rank: usize) -> Range<usize> {
        self.cuts[rank]..self.cuts[rank + 1]
    }

    /// Returns the fewest columns that a rank has.
    #[doc(hidden)]
    pub fn narrowest(&self) -> usize {
        self.cuts.windows(2).map(|cuts| cuts[1] - cuts[0]).min().unwrap_or(0)
    }

    /// Returns the stretches of this rank, which are as wide as those of the whole grid.
    pub(crate) fn stretches(&self) -> Stretches {
        let [nx, ny] = self.grid();
        Stretches { nx, ny, ..Stretches::of(self.whole) }
    }

    /// Returns the parts of all ranks one after another, on each of them; that of rank `k` has
    /// `length(k)` numbers. They go up a binomial tree to rank 0 and down again.
    pub(crate) fn joined(&self, own: &[f64], length: impl Fn(usize) -> usize) -> Vec<f64> {
        let (size, rank) = (self.size(), self.rank());
        let starts: Vec<usize> = (0..=size).map(|end| (0..end).map(&length).sum()).collect();
        let parts = |from: usize, until: usize| starts[from]..starts[size.min(until)];
        let mut all = vec![0.0; starts[size]];
        all[parts(rank, rank + 1)].copy_from_slice(own);
        let mut step = 1;
        while step < size && rank & step == 0 {
            if rank + step < size {
                self.ranks.receive(rank + step, &mut all[parts(rank + step, rank + 2 * step)]);
            }
            step *= 2;
        }
        if rank > 0 {
            self.ranks.send(rank - step, &all[parts(rank, rank + step)]);
            self.ranks.receive(rank - step, &mut all);
        }
        while step > 1 {
            step /= 2;
            if rank + step < size {
                self.ranks.send(rank + step, &all);
            }
        }
        all
    }

    /// Overwrites vectors that begin with this rank's parts with the whole ones, or panics unless
    /// they have an entry for each point of the whole grid. All ranks call it.
    #[doc(hidden)]
    pub fn complete<T: Scalar, const K: usize>(&self, mut vectors: [&mut [T]; K]) {
        let [nx, ny] = self.whole;
        let order = |rank| self.columns_of(rank).len() * ny;
        let own: Vec<f64> = vectors.iter().flat_map(|v| wide(&v[..order(self.rank())])).collect();
        let all = self.joined(&own, |rank| K * order(rank));
        let mut ranks = all.as_slice();
        for columns in (0..self.size()).map(|rank| self.columns_of(rank)) {
            for whole in &mut vectors {
                assert_eq!(whole.len(), nx * ny, "an entry for each point of the whole grid");
                for row in whole.chunks_mut(nx) {
                    let (part, rest) = ranks.split_at(columns.len());
                    narrow(part, &mut row[columns.clone()]);
                    ranks = rest;
                }
            }
        }
    }

    /// Returns the sum over the whole grid, from this rank's part of it.
    pub(crate) fn sum(&self, totals: &Totals) -> Part {
        let numbers = |rank| 2 * self.columns_of(rank).len().div_ceil(self.stretches().width);
        let own: Vec<f64> = totals.parts().flat_map(|part| [part.sum, part.largest]).collect();
        let all = self.joined(&own[..numbers(self.rank())], numbers);
        let mut sum = Part::default();
        all.chunks(2).for_each(|part| sum.add(Part { sum: part[0], largest: part[1] }));
        sum
    }

    /// Returns the `width` columns of a vector west of this rank's and those east of them, row by
    /// row; fewer of a rank that has fewer, and nothing beyond the grid. `entry(k)` is that at this
    /// rank's point `k`. Neighbours call it together.
    #[doc(hidden)]
    pub fn beside<T: Scalar>(&self, width: usize, entry: impl Fn(usize) -> T) -> [Vec<T>; 2] {
        let [nx, ny] = self.grid();
        let columns = |columns: Range<usize>| {
            let points = (0..ny).flat_map(|j| columns.clone().map(move |i| j * nx + i));
            points.map(|k| entry(k).wide()).collect()
        };
        self.exchange(width, [columns(0..width.min(nx)), columns(nx.saturating_sub(width)..nx)])
    }

    /// Gives the first and the last `width` columns to the ranks west and east, and returns theirs;
    /// fewer of a rank that has fewer.
    pub(crate) fn exchange<T: Scalar>(&self, width: usize, own: [Vec<f64>; 2]) -> [Vec<T>; 2] {
        let mut theirs = [vec![], vec![]];
        // Of two ranks the western one sends first. Ranks with an even number begin in the east,
        // the others in the west: nobody waits for somebody who waits.
        let even = self.rank().is_multiple_of(2);
        for side in if even { [1, 0] } else { [0, 1] } {
            let Some(other) = self.neighbour(side) else { continue };
            let mut received = vec![0.0; width.min(self.columns_of(other).len()) * self.whole[1]];
            if side == 1 {
                self.ranks.send(other, &own[side]);
            }
            self.ranks.receive(other, &mut received);
            if side == 0 {
                self.ranks.send(other, &own[side]);
            }
            theirs[side] = received.into_iter().map(T::of).collect();
        }
        theirs
    }

    /// Returns the rank west (0) or east (1) of this one.
    fn neighbour(&self, side: usize) -> Option<usize> {
        let rank = if side == 0 { self.rank().checked_sub(1) } else { Some(self.rank() + 1) };
        rank.filter(|&rank| rank < self.size())
    }

    /// Sends a few values to the rank west (0) or east (1), if there is one.
    #[inline(never)]
    pub(crate) fn pass<T: Scalar, const K: usize>(&self, side: usize, values: &[T; K]) {
        if let Some(other) = self.neighbour(side) {
            self.ranks.send(other, &values.map(Scalar::wide));
        }
    }

    /// Receives a few values from the rank west (0) or east (1), if there is one.
    #[inline(never)]
    pub(crate) fn take<T: Scalar, const K: usize>(&self, side: usize, values: &mut [T; K]) {
        if let Some(other) = self.neighbour(side) {
            let mut numbers = [0.0; K];
            self.ranks.receive(other, &mut numbers);
            *values = numbers.map(T::of);
        }
    }
}

/// The ranks that share a problem, and the numbers that it needs of them.
#[derive(Debug, Clone)]
pub(crate) struct Shared<T> {
    pub(crate) strip: Strip,
    /// Ω west and east of this rank's columns.
    pub(crate) omega: [Vec<T>; 2],
    /// The ratio of the diagonals of five-point operators there.
    pub(crate) scaling: [Vec<T>; 2],
    /// True if `A` has the same row everywhere in the whole grid, but for its edge, and `B`.
    pub(crate) constant: bool,
}

fn wide<T: Scalar>(values: &[T]) -> Vec<f64> {
    values.iter().map(|value| value.wide()).collect()
}

fn narrow<T: Scalar>(numbers: &[f64], values: &mut [T]) {
    values.iter_mut().zip(numbers).for_each(|(value, &number)| *value = T::of(number));
}
