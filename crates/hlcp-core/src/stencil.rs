use crate::{
    Coefficients, Diagonal, Error, FivePointView, LinearOperator, Rows, Scalar,
    view::{can_close, visit_neighbours},
};

/// A five-point stencil with constant coefficients on an `nx × ny` grid, zero outside it or
/// [`periodic`](Self::periodic).
///
/// Point `(i, j)` of column `i < nx` and row `j < ny` has the index `j·nx + i`, so
///
/// ```text
/// (A x)ᵢⱼ = south·xᵢ,ⱼ₋₁ + west·xᵢ₋₁,ⱼ + centre·xᵢⱼ + east·xᵢ₊₁,ⱼ + north·xᵢ,ⱼ₊₁ .
/// ```
///
/// In the paper's notation this is blktridiag(south·I; tridiag(west; centre; east); north·I): no
/// matrix is formed, seven numbers are stored.
///
/// # Cost
///
/// One product reads `x` and writes `y` once.
///
/// ```
/// use hlcp_core::{FivePoint, LinearOperator};
///
/// let laplacian = FivePoint::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let mut y = [0.0; 6];
/// laplacian.apply(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &mut y);
/// assert_eq!(y, [-2.0, -1.0, 4.0, 10.0, 8.0, 16.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FivePoint<T> {
    // Invariant: nx, ny ≥ 1, at least 3 where a direction closes, and the coefficients are finite.
    nx: usize,
    ny: usize,
    coefficients: [T; 5],
    round: [bool; 2],
}

impl<T: Scalar> FivePoint<T> {
    /// The stencil `[south, west, centre, east, north]` on an `nx × ny` grid.
    ///
    /// The order of the coefficients is that of the row's entries.
    ///
    /// # Errors
    ///
    /// [`Error::Grid`] for a grid without points, or with more than an array can hold;
    /// [`Error::NotFinite`] for the first coefficient that is NaN or infinite.
    pub fn new(nx: usize, ny: usize, coefficients: [T; 5]) -> Result<Self, Error> {
        points::<T>(nx, ny)?;
        crate::all_finite("coefficients [south, west, centre, east, north]", &coefficients)?;
        Ok(Self { nx, ny, coefficients, round: [false; 2] })
    }

    /// The same stencil on a grid that closes round in the directions `[x, y]` that say so: there
    /// the western neighbour of a row's first point is its last, the southern one of the first
    /// row's points that of the last row, and the other way round.
    ///
    /// A cylinder, a full journal bearing, a torus. Sweeps in lexicographic order are fused as on
    /// an open grid; those in red–black order walk the rows.
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

    fn view(&self) -> FivePointView<'static, T> {
        FivePointView::new(self.nx, self.ny, self.coefficients.map(Coefficients::Constant))
            .periodic(self.round)
    }
}

/// Returns the number of points of a grid, for each of which an array can hold a number.
pub(crate) fn points<T>(nx: usize, ny: usize) -> Result<usize, Error> {
    let most = isize::MAX as usize / size_of::<T>();
    let fits = |points: &usize| (1..=most).contains(points);
    nx.checked_mul(ny).filter(fits).ok_or(Error::Grid { nx, ny })
}

impl<T: Scalar> LinearOperator<T> for FivePoint<T> {
    fn order(&self) -> usize {
        self.nx * self.ny
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.view().apply([self.nx, self.ny], x, y);
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        Some(self.view())
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl<T: Scalar> Diagonal<T> for FivePoint<T> {
    fn diagonal_entry(&self, _: usize) -> T {
        self.coefficients[2]
    }
}

impl<T: Scalar> Rows<T> for FivePoint<T> {
    #[inline]
    fn visit_row(&self, k: usize, visit: &mut dyn FnMut(usize, T)) {
        let coefficient = |direction: usize| self.coefficients[direction];
        visit_neighbours([self.nx, self.ny], self.round, k, coefficient, visit);
    }
}
