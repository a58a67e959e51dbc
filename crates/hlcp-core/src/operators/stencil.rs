use super::{
    Coefficients, Diagonal, Entries, FivePointView, LinearOperator, Rows, Varying,
    view::{NAMES, can_close, visit_neighbours},
};
use crate::numbers::{Error, Scalar, all_finite, check_orders};

/// A five-point stencil on an `nx × ny` grid, zero outside it or [`periodic`](Self::periodic), with
/// coefficients that are constant or vary from point to point.
///
/// Point `(i, j)` of column `i < nx` and row `j < ny` has the index `j·nx + i`, so
///
/// ```text
/// (A x)ᵢⱼ = south·xᵢ,ⱼ₋₁ + west·xᵢ₋₁,ⱼ + centre·xᵢⱼ + east·xᵢ₊₁,ⱼ + north·xᵢ,ⱼ₊₁ .
/// ```
///
/// With constant coefficients this is blktridiag(south·I; tridiag(west; centre; east); north·I) in
/// the paper's notation. Coefficients that vary are those of the row, of point `(i, j)`; those that
/// lead outside the grid have no meaning, but must be finite.
///
/// `C` is how the coefficients of one direction are given, a [`Direction`]: `FivePoint<f64>` has a
/// number for each, `FivePoint<Coefficients<'_, f64>>` borrows a list where they vary, and
/// [`FivePoint<Varying<f64>>`](Varying) owns it.
///
/// # Cost
///
/// A direction that is the same everywhere is one number, any other `nx·ny`; borrowed lists are not
/// copied. One product reads these lists, reads `x` and writes `y` once.
///
/// ```
/// use hlcp_core::{FivePoint, LinearOperator};
///
/// let laplacian = FivePoint::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let mut y = [0.0; 6];
/// laplacian.apply(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &mut y);
/// assert_eq!(y, [-2.0, -1.0, 4.0, 10.0, 8.0, 16.0]);
///
/// // −(c u′)′ on a line, with c = 1, 2, 3, 4 between the points.
/// let c = |i: usize| (i + 1) as f64;
/// let a = FivePoint::from_fn(3, 1, |i, _| [0.0, -c(i), c(i) + c(i + 1), -c(i + 1), 0.0])?;
/// let mut y = [0.0; 3];
/// a.apply(&[1.0, 1.0, 2.0], &mut y);
/// assert_eq!(y, [1.0, -3.0, 11.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FivePoint<C> {
    // Invariant: nx, ny ≥ 1, at least 3 where a direction closes, lists have nx·ny entries, and
    // all coefficients are finite.
    nx: usize,
    ny: usize,
    coefficients: [C; 5],
    round: [bool; 2],
}

/// The coefficients of a [`FivePoint`] operator in one direction: a number for all points, or one
/// for each.
///
/// ```
/// use hlcp_core::{Coefficients, Direction, Varying};
///
/// assert_eq!((-1.0).coefficients(), Coefficients::Uniform(-1.0));
/// assert_eq!(Varying::Each(vec![1.0, 2.0]).coefficients(), Coefficients::Each(&[1.0, 2.0]));
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not the coefficient of a stencil",
    note = "one is an `f32` or `f64` (write 4.0 in place of 4), or a `Varying` list of them"
)]
pub trait Direction: Send + Sync {
    /// The type of the numbers.
    type Scalar: Scalar;

    /// Returns the coefficients, by the point's index where they vary.
    fn coefficients(&self) -> Coefficients<'_, Self::Scalar>;
}

impl<T: Scalar> Direction for T {
    type Scalar = T;

    #[inline]
    fn coefficients(&self) -> Coefficients<'_, T> {
        Coefficients::Uniform(*self)
    }
}

impl<T: Scalar, L: AsRef<[T]> + Send + Sync> Direction for Entries<T, L> {
    type Scalar = T;

    #[inline]
    fn coefficients(&self) -> Coefficients<'_, T> {
        match self {
            Self::Uniform(value) => Entries::Uniform(*value),
            Self::Each(values) => Entries::Each(values.as_ref()),
        }
    }
}

impl<C: Direction> FivePoint<C> {
    /// Returns the operator with the coefficients `[south, west, centre, east, north]` on a grid of
    /// `nx × ny` points.
    ///
    /// # Errors
    ///
    /// [`Error::Grid`] for a grid without points, or with more than an array can hold;
    /// [`Error::Order`] for a list that has not one entry for each point; [`Error::NotFinite`] for
    /// the first coefficient that is NaN or infinite.
    ///
    /// ```
    /// use hlcp_core::{
    ///     Diagonal,
    ///     Entries::{Each, Uniform},
    ///     FivePoint,
    /// };
    ///
    /// let (side, centre) = (Uniform(-1.0), [4.0, 5.0, 6.0, 7.0]);
    /// let a = FivePoint::new(2, 2, [side, side, Each(&centre), side, side])?;
    /// assert_eq!(a.diagonal_entry(3), 7.0);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn new(nx: usize, ny: usize, coefficients: [C; 5]) -> Result<Self, Error> {
        let n = points::<C::Scalar>(nx, ny)?;
        for (what, direction) in NAMES.into_iter().zip(&coefficients) {
            match direction.coefficients() {
                Coefficients::Uniform(value) => all_finite(what, &[value])?,
                Coefficients::Each(values) => {
                    check_orders(n, &[(what, values.len())])?;
                    all_finite(what, values)?;
                }
            }
        }
        Ok(Self { nx, ny, coefficients, round: [false; 2] })
    }

    /// Returns the same operator on a grid that closes round in the directions `[x, y]` that say
    /// so, as on a cylinder or a torus: coefficients that led outside lead across, to the other end
    /// of the row or column. Sweeps in lexicographic order are fused as on an open grid; those in
    /// red–black order walk the rows.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for fewer than three points in a direction that closes.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, LinearOperator};
    ///
    /// let ring = FivePoint::new(4, 1, [0.0, -1.0, 2.0, -1.0, 0.0])?.periodic([true, false])?;
    /// let mut y = [0.0; 4];
    /// ring.apply(&[1.0, 0.0, 0.0, 0.0], &mut y);
    /// assert_eq!(y, [2.0, -1.0, 0.0, -1.0]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn periodic(self, round: [bool; 2]) -> Result<Self, Error> {
        can_close([self.nx, self.ny], round)?;
        Ok(Self { round, ..self })
    }

    fn view(&self) -> FivePointView<'_, C::Scalar> {
        let coefficients = self.coefficients.each_ref().map(C::coefficients);
        FivePointView::new(self.nx, self.ny, coefficients).periodic(self.round)
    }
}

impl<T: Scalar> FivePoint<Varying<T>> {
    /// Returns the operator whose row at point `(i, j)`, column `i` and row `j`, is
    /// `[south, west, centre, east, north]` as `row(i, j)` gives it.
    ///
    /// # Errors
    ///
    /// [`Error::Grid`] for a grid without points, or with more than an array can hold;
    /// [`Error::NotFinite`] for a coefficient that is NaN or infinite.
    pub fn from_fn(
        nx: usize,
        ny: usize,
        mut row: impl FnMut(usize, usize) -> [T; 5],
    ) -> Result<Self, Error> {
        let n = points::<T>(nx, ny)?;
        let mut lists = [(); 5].map(|()| Vec::with_capacity(n));
        for k in 0..n {
            for (list, value) in lists.iter_mut().zip(row(k % nx, k / nx)) {
                list.push(value);
            }
        }
        Self::new(nx, ny, lists.map(Varying::of_list))
    }
}

/// Returns the number of points of a grid, for each of which an array can hold a number.
pub(crate) fn points<T>(nx: usize, ny: usize) -> Result<usize, Error> {
    let most = isize::MAX as usize / size_of::<T>();
    let fits = |points: &usize| (1..=most).contains(points);
    nx.checked_mul(ny).filter(fits).ok_or(Error::Grid { nx, ny })
}

impl<T: Scalar, C: Direction<Scalar = T>> LinearOperator<T> for FivePoint<C> {
    fn order(&self) -> usize {
        self.nx * self.ny
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.view().apply([self.nx, self.ny], x, y);
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        Some(self.view())
    }
}

impl<T: Scalar, C: Direction<Scalar = T>> Diagonal<T> for FivePoint<C> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.coefficients[2].coefficients().entry(i)
    }
}

impl<T: Scalar, C: Direction<Scalar = T>> Rows<T> for FivePoint<C> {
    #[inline]
    fn visit_row(&self, k: usize, visit: &mut dyn FnMut(usize, T)) {
        let coefficient = |direction: usize| self.coefficients[direction].coefficients().entry(k);
        visit_neighbours([self.nx, self.ny], self.round, k, coefficient, visit);
    }

    #[inline]
    fn copy_row(&self, k: usize, row: &mut [(usize, T)]) -> usize {
        let coefficient = |direction: usize| self.coefficients[direction].coefficients().entry(k);
        let mut count = 0;
        let copy = |j, a| {
            row.get_mut(count).into_iter().for_each(|entry| *entry = (j, a));
            count += 1;
        };
        visit_neighbours([self.nx, self.ny], self.round, k, coefficient, copy);
        count
    }
}
