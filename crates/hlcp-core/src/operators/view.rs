use super::Coefficients;
use crate::numbers::{Error, Scalar, assert_lengths};

/// How errors and panics name the directions.
pub(super) const NAMES: [&str; 5] = ["south", "west", "centre", "east", "north"];

impl<T: Scalar> Coefficients<'_, T> {
    /// Adds `a x` to `y`, for a stretch of points that begins at point `from`.
    fn add_product(&self, from: usize, x: &[T], y: &mut [T]) {
        match *self {
            Self::Uniform(a) if a == T::zero() => {}
            Self::Uniform(a) => {
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
/// assert_eq!((view.grid(), view.coefficients()[2].entry(3)), (None, 5.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FivePointView<'a, T> {
    grid: Option<[usize; 2]>,
    coefficients: [Coefficients<'a, T>; 5],
    // Which directions close round: none of a diagonal operator.
    round: [bool; 2],
}

impl<'a, T: Scalar> FivePointView<'a, T> {
    /// Returns the view `[south, west, centre, east, north]` on an `nx × ny` grid.
    ///
    /// # Panics
    ///
    /// Unless each list of coefficients has `nx·ny` entries.
    pub fn new(nx: usize, ny: usize, coefficients: [Coefficients<'a, T>; 5]) -> Self {
        for (name, c) in NAMES.into_iter().zip(&coefficients) {
            if let Coefficients::Each(values) = c {
                assert_lengths(nx * ny, [(name, values.len())]);
            }
        }
        Self { grid: Some([nx, ny]), coefficients, round: [false; 2] }
    }

    /// Returns the view of a diagonal operator, which fits every grid of its order.
    pub fn diagonal(centre: Coefficients<'a, T>) -> Self {
        let zero = Coefficients::Uniform(T::zero());
        let coefficients = [zero, zero, centre, zero, zero];
        Self { grid: None, coefficients, round: [false; 2] }
    }

    /// Returns the same view on a grid that closes round in the directions `[x, y]` that say so, as
    /// [`FivePoint::periodic`](crate::FivePoint::periodic) does: the coefficients that led outside
    /// lead across. Returns a diagonal operator as it is, which has no grid.
    ///
    /// # Panics
    ///
    /// Unless a direction that closes has three points or more.
    ///
    /// ```
    /// use hlcp_core::{Entries::Uniform, FivePointView};
    ///
    /// let ring = FivePointView::new(4, 1, [0.0, -1.0, 2.0, -1.0, 0.0].map(Uniform));
    /// assert_eq!(ring.periodic([true, false]).round(), [true, false]);
    /// let diagonal = FivePointView::diagonal(Uniform(2.0));
    /// assert_eq!(diagonal.periodic([true; 2]).round(), [false; 2]);
    /// ```
    pub fn periodic(self, round: [bool; 2]) -> Self {
        let Some(grid) = self.grid else { return self };
        can_close(grid, round).expect("three points or more in a direction that closes");
        Self { round, ..self }
    }

    /// Returns whether the grid closes round along `[x, y]`.
    pub fn round(&self) -> [bool; 2] {
        self.round
    }

    /// Returns the view of other coefficients on the same grid.
    pub(crate) fn with(self, coefficients: [Coefficients<'a, T>; 5]) -> Self {
        Self { coefficients, ..self }
    }

    /// Returns the grid's `[nx, ny]`; `None` for a diagonal operator, which fits any.
    pub fn grid(&self) -> Option<[usize; 2]> {
        self.grid
    }

    /// Returns the coefficients `[south, west, centre, east, north]`.
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
        let all = self.coefficients.iter().all(|c| matches!(c, Coefficients::Uniform(_)));
        all.then(|| self.coefficients.map(|c| c.entry(0)))
    }

    /// Visits row `k` of the operator, which has this order.
    pub(crate) fn visit_row(&self, order: usize, k: usize, visit: &mut dyn FnMut(usize, T)) {
        let grid = self.grid.unwrap_or([order, 1]);
        visit_neighbours(grid, self.round, k, |d| self.coefficients[d].entry(k), visit);
    }

    /// Overwrites `y` with the product with `x`, on an `nx × ny` grid.
    pub(crate) fn apply(&self, [nx, ny]: [usize; 2], x: &[T], y: &mut [T]) {
        assert_lengths(nx * ny, [("x", x.len()), ("y", y.len())]);
        for (j, y) in y.chunks_exact_mut(nx).enumerate() {
            self.product(nx, j, 0, x, [None; 2], y);
        }
    }

    /// Overwrites `y` with a stretch of row `j` of the product with `x`, beginning at column
    /// `start`, on a grid of `nx` columns, given the values of `x` west and east of the stretch
    /// where the grid goes on beyond what `x` holds of it.
    ///
    /// Each entry takes at most five products, added one after another without fused operations.
    pub(crate) fn product(
        &self,
        nx: usize,
        j: usize,
        start: usize,
        x: &[T],
        beside: [Option<T>; 2],
        y: &mut [T],
    ) {
        y.fill(T::zero());
        let [south, west, centre, east, north] = self.coefficients;
        let [round_x, round_y] = self.round;
        let (n, length, from, row) = (x.len(), y.len(), j * nx + start, &x[j * nx..(j + 1) * nx]);
        let (until, [western, eastern]) = (from + length, [start == 0, start + length == nx]);
        // Adds the share of neighbours that points of the stretch have from place `at` on.
        let mut add = |direction: Coefficients<'_, T>, at: usize, neighbours: &[T]| {
            direction.add_product(from + at, neighbours, &mut y[at..at + neighbours.len()]);
        };
        add(centre, 0, &x[from..until]);
        // What lies beyond in its turn, so that the bits are those of the whole grid.
        let [to_west, to_east] = beside.each_ref().map(Option::as_slice);
        let (first, last) = (usize::from(western), usize::from(eastern));
        add(west, first, &x[from + first - 1..until - 1]);
        add(west, 0, to_west);
        add(east, 0, &x[from + 1..until + 1 - last]);
        add(east, length - 1, to_east);
        if j > 0 {
            add(south, 0, &x[from - nx..until - nx]);
        } else if round_y {
            add(south, 0, &x[n - nx + start..][..length]);
        }
        if until + nx <= n {
            add(north, 0, &x[from + nx..until + nx]);
        } else if round_y {
            add(north, 0, &x[start..][..length]);
        }
        if western && round_x {
            add(west, 0, &row[nx - 1..]);
        }
        if eastern && round_x {
            add(east, length - 1, &row[..1]);
        }
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
    mut visit: impl FnMut(usize, T),
) {
    let ([nx, ny], (i, j)) = (grid, (k % grid[0], k / grid[0]));
    let mut entry = |inside: bool, direction: usize, place: usize| {
        let a = coefficient(direction);
        if inside && a != T::zero() {
            visit(place, a);
        }
    };
    let across = round[0] && (i == 0 || i + 1 == nx) || round[1] && (j == 0 || j + 1 == ny);
    if across {
        let places = places(grid, round, k);
        let mut order = [0, 1, 2, 3, 4];
        order.sort_unstable_by_key(|&direction| places[direction]);
        for direction in order {
            entry(places[direction].is_some(), direction, places[direction].unwrap_or(k));
        }
        return;
    }
    entry(j > 0, 0, k.wrapping_sub(nx));
    entry(i > 0, 1, k.wrapping_sub(1));
    entry(true, 2, k);
    entry(i + 1 < nx, 3, k + 1);
    entry(j + 1 < ny, 4, k + nx);
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
