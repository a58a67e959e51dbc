use std::{ops::Range, sync::Arc};

use crate::{
    Error, FivePointView, Ranks, Scalar,
    norms::{Part, Stretches, Totals},
};

/// The columns of a grid that one rank works on.
///
/// A strip is made of whole stretches of columns, of which a grid has at most 64: one for each 256
/// columns, wider ones beyond 16384. Sums are taken by stretches, so they do not depend on how many
/// ranks there are. A rank's vectors hold the points of its columns, row by row.
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
        if ranks.size() > Stretches::of([nx, ny]).count() {
            return Err(Error::Parameter {
                name: "the number of ranks",
                value: ranks.size() as f64,
                range: "at most one for every 256 columns of the grid, and at most 64",
            });
        }
        Ok(Self { ranks, whole: [nx, ny] })
    }

    /// The number of this rank.
    pub fn rank(&self) -> usize {
        self.ranks.rank()
    }

    /// The number of ranks.
    pub fn size(&self) -> usize {
        self.ranks.size()
    }

    /// The whole grid's `[nx, ny]`.
    pub fn whole(&self) -> [usize; 2] {
        self.whole
    }

    /// This rank's columns.
    pub fn columns(&self) -> Range<usize> {
        self.columns_of(self.rank())
    }

    /// The grid of this rank's columns.
    pub fn grid(&self) -> [usize; 2] {
        [self.columns().len(), self.whole[1]]
    }

    /// The index in the whole grid of this rank's point `k`.
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
        assert_eq!(own.len(), self.columns().len() * ny, "an entry for each point");
        if self.rank() > 0 {
            own.chunks(self.columns().len()).for_each(|row| self.ranks.send(0, &wide(row)));
            return None;
        }
        let mut whole = vec![T::zero(); nx * ny];
        for (j, whole) in whole.chunks_mut(nx).enumerate() {
            for rank in 0..self.size() {
                let columns = self.columns_of(rank);
                if rank == 0 {
                    let row = &own[j * columns.len()..][..columns.len()];
                    whole[columns].copy_from_slice(row);
                } else {
                    let mut row = vec![0.0; columns.len()];
                    self.ranks.receive(rank, &mut row);
                    narrow(&row, &mut whole[columns]);
                }
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
    /// in the whole grid. All ranks call it.
    ///
    /// What can fail on one rank, like an operator made of its part of a file, goes through here
    /// before the ranks go on.
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
            _ => Error::Rank { rank, error: told.leak() },
        })
    }

    /// The columns of a rank: whole stretches, as many for each as can be.
    fn columns_of(&self, rank: usize) -> Range<usize> {
        let [nx, _] = self.whole;
        let stretches = Stretches::of(self.whole);
        let end = |rank: usize| nx.min(rank * stretches.count() / self.size() * stretches.width);
        end(rank)..if rank + 1 == self.size() { nx } else { end(rank + 1) }
    }

    /// The stretches of this rank, which are as wide as those of the whole grid.
    pub(crate) fn stretches(&self) -> Stretches {
        let [nx, ny] = self.grid();
        Stretches { nx, ny, ..Stretches::of(self.whole) }
    }

    /// The parts of all ranks one after another, on each of them; that of rank `k` has `length(k)`
    /// numbers.
    pub(crate) fn joined(&self, own: &[f64], length: impl Fn(usize) -> usize) -> Vec<f64> {
        let size = self.size();
        let mut all = vec![0.0; (0..size).map(&length).sum()];
        if self.rank() > 0 {
            self.ranks.send(0, own);
            self.ranks.receive(0, &mut all);
            return all;
        }
        let mut from = own.len();
        all[..from].copy_from_slice(own);
        for rank in 1..size {
            let until = from + length(rank);
            self.ranks.receive(rank, &mut all[from..until]);
            from = until;
        }
        (1..size).for_each(|rank| self.ranks.send(rank, &all));
        all
    }

    /// The sum over the whole grid, from this rank's part of it.
    pub(crate) fn sum(&self, totals: &Totals) -> Part {
        let numbers = |rank| 2 * self.columns_of(rank).len().div_ceil(self.stretches().width);
        let own: Vec<f64> = totals.parts().flat_map(|part| [part.sum, part.largest]).collect();
        let all = self.joined(&own[..numbers(self.rank())], numbers);
        let mut sum = Part::default();
        all.chunks(2).for_each(|part| sum.add(Part { sum: part[0], largest: part[1] }));
        sum
    }

    /// The columns of a vector west and east of this rank's; empty beyond the grid.
    pub(crate) fn beside<T: Scalar>(&self, own: &[T]) -> [Vec<T>; 2] {
        let nx = self.columns().len();
        let column = |i| own.iter().skip(i).step_by(nx).map(|v| v.wide()).collect();
        self.exchange([column(0), column(nx - 1)])
    }

    /// Overwrites `y` with the product of a five-point operator on this rank's grid with `x`.
    pub(crate) fn product<T: Scalar>(&self, view: FivePointView<'_, T>, x: &[T], y: &mut [T]) {
        let ([nx, _], beside) = (self.grid(), self.beside(x));
        for (j, y) in y.chunks_exact_mut(nx).enumerate() {
            let beside = beside.each_ref().map(|column| column.get(j).copied());
            view.product_beside(nx, j, 0, x, beside, y);
        }
    }

    /// Gives the first and the last column to the ranks west and east, and returns theirs.
    pub(crate) fn exchange<T: Scalar>(&self, own: [Vec<f64>; 2]) -> [Vec<T>; 2] {
        let mut theirs = [vec![], vec![]];
        // Of two ranks the western one sends first. Ranks with an even number begin in the east,
        // the others in the west: nobody waits for somebody who waits.
        let even = self.rank().is_multiple_of(2);
        for side in if even { [1, 0] } else { [0, 1] } {
            let Some(other) = self.neighbour(side) else { continue };
            let mut received = vec![0.0; own[side].len()];
            if side == 1 {
                self.ranks.send(other, &own[side]);
            }
            self.ranks.receive(other, &mut received);
            if side == 0 {
                self.ranks.send(other, &own[side]);
            }
            theirs[side] = vec![T::zero(); received.len()];
            narrow(&received, &mut theirs[side]);
        }
        theirs
    }

    /// The rank west (0) or east (1) of this one.
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
            narrow(&numbers, values);
        }
    }
}

/// What a problem knows of the ranks that share it.
#[derive(Debug, Clone)]
pub(crate) struct Shared<T> {
    pub(crate) strip: Strip,
    /// Ω west and east of this rank's columns.
    pub(crate) omega: [Vec<T>; 2],
    /// Whether all rows of the whole grid are the same, but for its edge.
    pub(crate) constant: bool,
}

fn wide<T: Scalar>(values: &[T]) -> Vec<f64> {
    values.iter().map(|value| value.wide()).collect()
}

fn narrow<T: Scalar>(numbers: &[f64], values: &mut [T]) {
    values.iter_mut().zip(numbers).for_each(|(value, &number)| *value = T::of(number));
}
