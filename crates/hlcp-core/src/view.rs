use std::ops::Range;

use crate::{Error, Scalar};

/// The coefficients of one direction of a five-point operator.
///
/// ```
/// use hlcp_core::Coefficients;
///
/// let conductances = [1.0, 2.0, 4.0];
/// let varying = Coefficients::Each(&conductances);
/// assert_eq!((varying.at(2), Coefficients::Constant(-1.0).at(2)), (4.0, -1.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coefficients<'a, T> {
    /// The same at every point.
    Constant(T),
    /// One for each point, by the point's index.
    Each(&'a [T]),
}

impl<T: Scalar> Coefficients<'_, T> {
    /// The coefficient at point `k`.
    ///
    /// # Panics
    ///
    /// When `k` is not below the length of an [`Each`](Self::Each).
    #[inline]
    pub fn at(&self, k: usize) -> T {
        match self {
            Self::Constant(value) => *value,
            Self::Each(values) => values[k],
        }
    }

    /// `y += a x` for a stretch of points that begins at point `from`.
    fn add_product(&self, from: usize, x: &[T], y: &mut [T]) {
        match *self {
            Self::Constant(a) if a == T::zero() => {}
            Self::Constant(a) => {
                for (y, &x) in y.iter_mut().zip(x) {
                    *y += a * x;
                }
            }
            Self::Each(a) => {
                for ((y, &x), &a) in y.iter_mut().zip(x).zip(&a[from..from + x.len()]) {
                    *y += a * x;
                }
            }
        }
    }
}

/// The grid and the five coefficients of a five-point operator.
///
/// An operator that answers [`as_five_point`](crate::LinearOperator::as_five_point) with one
/// promises that its rows are those of a five-point operator on this grid, with finite
/// coefficients, numbered as [`FivePoint`](crate::FivePoint) numbers them. Coefficients that lead
/// outside the grid have no meaning.
///
/// ```
/// use hlcp_core::{Coefficients, FivePointView};
///
/// let diagonal = [2.0, 3.0, 4.0, 5.0];
/// let view = FivePointView::diagonal(Coefficients::Each(&diagonal));
/// assert_eq!((view.grid(), view.coefficients()[2].at(3)), (None, 5.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FivePointView<'a, T> {
    grid: Option<[usize; 2]>,
    coefficients: [Coefficients<'a, T>; 5],
}

impl<'a, T: Scalar> FivePointView<'a, T> {
    /// The view `[south, west, centre, east, north]` on an `nx × ny` grid.
    ///
    /// # Panics
    ///
    /// Unless each list of coefficients has `nx·ny` entries.
    pub fn new(nx: usize, ny: usize, coefficients: [Coefficients<'a, T>; 5]) -> Self {
        for c in &coefficients {
            if let Coefficients::Each(values) = c {
                assert_eq!(values.len(), nx * ny, "a coefficient for each point");
            }
        }
        Self { grid: Some([nx, ny]), coefficients }
    }

    /// The view of a diagonal operator, which fits every grid of its order.
    pub fn diagonal(centre: Coefficients<'a, T>) -> Self {
        let zero = Coefficients::Constant(T::zero());
        Self { grid: None, coefficients: [zero, zero, centre, zero, zero] }
    }

    /// The view of other coefficients on the same grid.
    pub(crate) fn with(self, coefficients: [Coefficients<'a, T>; 5]) -> Self {
        Self { coefficients, ..self }
    }

    /// The grid's `[nx, ny]`; `None` for a diagonal operator, which fits any.
    pub fn grid(&self) -> Option<[usize; 2]> {
        self.grid
    }

    /// The coefficients `[south, west, centre, east, north]`.
    pub fn coefficients(&self) -> [Coefficients<'a, T>; 5] {
        self.coefficients
    }

    /// Returns the coefficients `[south, west, centre, east, north]` if all are constant.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, LinearOperator};
    ///
    /// let row = [-1.0, -1.0, 4.0, -1.0, -1.0];
    /// let laplacian = FivePoint::new(3, 2, row)?;
    /// assert_eq!(laplacian.as_five_point().expect("a view").constants(), Some(row));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn constants(&self) -> Option<[T; 5]> {
        let all = self.coefficients.iter().all(|c| matches!(c, Coefficients::Constant(_)));
        all.then(|| self.coefficients.map(|c| c.at(0)))
    }

    /// Overwrites `y` with the product with `x`, on an `nx × ny` grid.
    pub(crate) fn apply(&self, [nx, ny]: [usize; 2], x: &[T], y: &mut [T]) {
        assert_eq!([x.len(), y.len()], [nx * ny; 2], "vectors of the grid's order");
        for (j, y) in y.chunks_exact_mut(nx).enumerate() {
            self.product(nx, j, 0, x, y);
        }
    }

    /// Adds to `y` what a grid that closes round adds to the product with `x`.
    pub(crate) fn add_round(
        &self,
        [nx, ny]: [usize; 2],
        [round_x, round_y]: [bool; 2],
        x: &[T],
        y: &mut [T],
    ) {
        let [south, west, _, east, north] = self.coefficients;
        if round_x {
            for (first, last) in (0..nx * ny).step_by(nx).map(|k| (k, k + nx - 1)) {
                y[first] += west.at(first) * x[last];
                y[last] += east.at(last) * x[first];
            }
        }
        if round_y {
            for (first, last) in (0..nx).map(|k| (k, k + nx * (ny - 1))) {
                y[first] += south.at(first) * x[last];
                y[last] += north.at(last) * x[first];
            }
        }
    }

    /// Overwrites `y` with a stretch of row `j` of the product with `x`, beginning at column
    /// `start`, on a grid of `nx` columns.
    pub(crate) fn product(&self, nx: usize, j: usize, start: usize, x: &[T], y: &mut [T]) {
        self.product_beside(nx, j, start, x, [None; 2], y);
    }

    /// The same, given the values of `x` west and east of the stretch where the grid goes on beyond
    /// what `x` holds of it.
    pub(crate) fn product_beside(
        &self,
        nx: usize,
        j: usize,
        start: usize,
        x: &[T],
        beside: [Option<T>; 2],
        y: &mut [T],
    ) {
        y.fill(T::zero());
        self.add_product_beside(nx, j, start, x, beside, y);
    }

    /// Adds to `y` a stretch of row `j` of the product with `x`, beginning at column `start`, on a
    /// grid of `nx` columns.
    ///
    /// Each entry takes at most five products, added one after another without fused operations,
    /// which is what an analysis of the rounding error needs to know.
    ///
    /// # Panics
    ///
    /// Unless the stretch is in the row, and `x` and the lists of coefficients reach beyond it.
    ///
    /// ```
    /// use hlcp_core::{Coefficients, FivePointView};
    ///
    /// let laplacian =
    ///     FivePointView::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0].map(Coefficients::Constant));
    /// let mut y = [100.0; 3];
    /// laplacian.add_product(3, 1, 0, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &mut y);
    /// assert_eq!(y, [110.0, 108.0, 116.0]);
    /// ```
    pub fn add_product(&self, nx: usize, j: usize, start: usize, x: &[T], y: &mut [T]) {
        self.add_product_beside(nx, j, start, x, [None; 2], y);
    }

    fn add_product_beside(
        &self,
        nx: usize,
        j: usize,
        start: usize,
        x: &[T],
        beside: [Option<T>; 2],
        y: &mut [T],
    ) {
        let (from, length) = (j * nx + start, y.len());
        let directions = self.directions(nx, j, start, length, x.len());
        for (d, (coefficients, points, neighbours)) in directions.into_iter().enumerate() {
            let part = &mut y[points.start - from..points.end - from];
            coefficients.add_product(points.start, &x[neighbours], part);
            // In its turn, so that the bits are those of the whole grid.
            if let Some((at, value)) = beyond(d, length, beside) {
                coefficients.add_product(from + at, &[value], &mut y[at..=at]);
            }
        }
    }

    /// Returns, direction by direction, the coefficients, the points of a stretch of `length`
    /// points of row `j` that have a neighbour there, and these neighbours, in a grid of `n` points
    /// and `nx` columns; the centre first.
    #[inline(always)]
    pub(crate) fn directions(
        &self,
        nx: usize,
        j: usize,
        start: usize,
        length: usize,
        n: usize,
    ) -> [(Coefficients<'a, T>, Range<usize>, Range<usize>); 5] {
        let [south, west, centre, east, north] = self.coefficients;
        let (from, until) = (j * nx + start, j * nx + start + length);
        let (first, last) = (usize::from(start == 0), usize::from(start + length == nx));
        let (here, nowhere) = (from..until, (from..from, 0..0));
        let below = if j > 0 { (here.clone(), from - nx..until - nx) } else { nowhere.clone() };
        let above = if until + nx <= n { (here.clone(), from + nx..until + nx) } else { nowhere };
        [
            (centre, here.clone(), here),
            (west, from + first..until, from + first - 1..until - 1),
            (east, from..until - last, from + 1..until + 1 - last),
            (south, below.0, below.1),
            (north, above.0, above.1),
        ]
    }
}

/// Returns, of the direction `d` in the order of [`FivePointView::directions`], the place in a
/// stretch of the point whose neighbour lies beyond it, and the neighbour's value.
#[inline(always)]
pub(crate) fn beyond<T: Copy>(
    d: usize,
    length: usize,
    [west, east]: [Option<T>; 2],
) -> Option<(usize, T)> {
    match d {
        1 => west.map(|value| (0, value)),
        2 => east.map(|value| (length - 1, value)),
        _ => None,
    }
}

/// Returns the neighbours of point `k` in the order of the directions, on an `nx × ny` grid that
/// closes round in the directions `[x, y]` that say so.
#[inline]
pub(crate) fn places(
    [nx, ny]: [usize; 2],
    [round_x, round_y]: [bool; 2],
    k: usize,
) -> [Option<usize>; 5] {
    let (i, j) = (k % nx, k / nx);
    let place = |inside: bool, at: usize, round: bool, opposite: usize| {
        if inside { Some(at) } else { round.then_some(opposite) }
    };
    [
        place(j > 0, k.wrapping_sub(nx), round_y, k + nx * (ny - 1)),
        place(i > 0, k.wrapping_sub(1), round_x, k + nx - 1),
        Some(k),
        place(i + 1 < nx, k + 1, round_x, (k + 1).wrapping_sub(nx)),
        place(j + 1 < ny, k + nx, round_y, k.wrapping_sub(nx * (ny - 1))),
    ]
}

/// Visits row `k` of a five-point operator, given the row's coefficient in each direction: what
/// leads outside the grid and what is zero is passed over.
#[inline]
pub(crate) fn visit_neighbours<T: Scalar>(
    grid: [usize; 2],
    round: [bool; 2],
    k: usize,
    coefficient: impl Fn(usize) -> T,
    visit: &mut dyn FnMut(usize, T),
) {
    let places = places(grid, round, k);
    let mut entry = |direction: usize| {
        let a = coefficient(direction);
        if let Some(place) = places[direction]
            && a != T::zero()
        {
            visit(place, a);
        }
    };
    let ([nx, ny], (i, j)) = (grid, (k % grid[0], k / grid[0]));
    let across = round[0] && (i == 0 || i + 1 == nx) || round[1] && (j == 0 || j + 1 == ny);
    if across {
        let mut order = [0, 1, 2, 3, 4];
        order.sort_unstable_by_key(|&direction| places[direction]);
        order.into_iter().for_each(&mut entry);
    } else {
        (0..5).for_each(entry);
    }
}

/// Refuses to close a direction with fewer than three points, where a point would be a neighbour
/// twice.
pub(crate) fn can_close(grid: [usize; 2], round: [bool; 2]) -> Result<(), Error> {
    let names = ["the number of points in a row that closes", "the number of rows that close"];
    for ((points, round), name) in grid.into_iter().zip(round).zip(names) {
        if round && points < 3 {
            return Err(Error::Parameter { name, value: points as f64, range: "3 or more" });
        }
    }
    Ok(())
}
