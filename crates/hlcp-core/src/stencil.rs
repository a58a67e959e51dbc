use crate::{
    Coefficients, Diagonal, Error, FivePointView, LinearOperator, Rows, Scalar,
    view::visit_neighbours,
};

/// A five-point stencil with constant coefficients on an `nx × ny` grid, zero outside it.
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
    // Invariant: nx, ny ≥ 1 and the coefficients are finite.
    nx: usize,
    ny: usize,
    coefficients: [T; 5],
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
        Ok(Self { nx, ny, coefficients })
    }

    fn view(&self) -> FivePointView<'static, T> {
        FivePointView::new(self.nx, self.ny, self.coefficients.map(Coefficients::Constant))
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
        visit_neighbours(self.nx, self.order(), k, coefficient, visit);
    }
}
