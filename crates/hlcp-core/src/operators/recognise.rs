use super::{FivePoint, Rows, Varying, stencil::points, view::places};
use crate::numbers::{Error, Scalar, check_orders};

impl<T: Scalar> FivePoint<Varying<T>> {
    /// Returns the operator with the rows of another one, such as an assembled matrix, on a grid
    /// of `nx × ny` points.
    ///
    /// # Errors
    ///
    /// What the operator's own [`check`](crate::LinearOperator::check) refuses, as a matrix that is
    /// not square; [`Error::Grid`] for a grid without points, or with more than an array can hold;
    /// [`Error::Order`] for a grid of another order than the operator's; [`Error::OffGrid`] for the
    /// first row with an entry that is not zero and leads to no neighbour on the grid;
    /// [`Error::NotFinite`] for an entry that is NaN or infinite.
    ///
    /// # Cost
    ///
    /// Two walks over the rows; nothing is stored for a direction that is the same everywhere.
    ///
    /// ```
    /// use hlcp_core::{Csr, Error, FivePoint, LinearOperator};
    ///
    /// let row = [-1.0, -1.0, 4.0, -1.0, -1.0];
    /// let assembled = Csr::from_rows(&FivePoint::new(4, 3, row)?);
    /// let grid = FivePoint::from_rows(4, 3, &assembled)?;
    /// assert_eq!(grid.as_five_point().expect("a grid").constants(), Some(row));
    /// let error = FivePoint::from_rows(3, 4, &assembled).unwrap_err();
    /// assert_eq!(error, Error::OffGrid { row: 0, column: 4, nx: 3, ny: 4 });
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn from_rows(
        nx: usize,
        ny: usize,
        operator: &(impl Rows<T> + ?Sized),
    ) -> Result<Self, Error> {
        operator.check("the operator")?;
        let n = points::<T>(nx, ny)?;
        check_orders(operator.order(), &[("the grid", n)])?;
        // The first coefficient of each direction inside the grid, and whether all are the same.
        let mut known = [(None, true); 5];
        for k in 0..n {
            let row = row_on_grid(nx, ny, k, operator)?;
            for ((first, same), coefficient) in known.iter_mut().zip(row) {
                let Some(coefficient) = coefficient else { continue };
                *same &= *first.get_or_insert(coefficient) == coefficient;
            }
        }
        let mut coefficients = known.map(|(first, same)| {
            let constant = Varying::Uniform(first.unwrap_or(T::zero()));
            if same { constant } else { Varying::Each(Vec::with_capacity(n)) }
        });
        for k in 0..n {
            let row = row_on_grid(nx, ny, k, operator)?;
            for (direction, coefficient) in coefficients.iter_mut().zip(row) {
                if let Varying::Each(list) = direction {
                    list.push(coefficient.unwrap_or(T::zero()));
                }
            }
        }
        Self::new(nx, ny, coefficients)
    }
}

/// Returns row `k` of an operator as a five-point one on an `nx × ny` grid has it, with no
/// coefficient where a direction leads outside.
fn row_on_grid<T: Scalar>(
    nx: usize,
    ny: usize,
    k: usize,
    operator: &(impl Rows<T> + ?Sized),
) -> Result<[Option<T>; 5], Error> {
    let places = places([nx, ny], [false; 2], k);
    let mut row = places.map(|place| place.map(|_| T::zero()));
    let mut wrong = Ok(());
    operator.visit_row(k, &mut |column, value| {
        if !value.is_finite() {
            wrong = Err(Error::NotFinite { what: "row", index: k, value: value.wide() });
        }
        match places.iter().position(|&place| place == Some(column)) {
            Some(direction) => row[direction] = row[direction].map(|sum| sum + value),
            None if value != T::zero() => wrong = Err(Error::OffGrid { row: k, column, nx, ny }),
            None => {}
        }
    });
    wrong.map(|()| row)
}

/// Recognises a pair of operators as five-point ones on one grid of two dimensions, by their rows.
///
/// Posed with them in the place of, say, assembled matrices, a problem gets the fused sweeps and
/// multigrid. None if an entry leads to no neighbour, none to another row of the grid, or the
/// orders differ.
///
/// # Cost
///
/// A walk over the rows up to the first that fits no grid, and for a pair that does fit, that of
/// [`FivePoint::from_rows`].
///
/// ```
/// use hlcp_core::{Csr, FivePoint, Hlcp, Identity, Omega, recognise_grid};
///
/// let a = Csr::from_rows(&FivePoint::new(4, 3, [-1.0, -1.0, 4.0, -1.0, -1.0])?);
/// let [a, b] = recognise_grid(&a, &Identity { order: 12 }).expect("a grid of 4 x 3 points");
/// assert_eq!(Hlcp::new(a, b, Omega::Uniform(4.0))?.grid(), Ok([4, 3]));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn recognise_grid<T: Scalar>(
    a: &(impl Rows<T> + ?Sized),
    b: &(impl Rows<T> + ?Sized),
) -> Option<[FivePoint<Varying<T>>; 2]> {
    let n = a.order();
    if b.order() != n {
        return None;
    }
    let (mut width, mut one) = (None, true);
    for i in 0..n {
        let mut see = |j: usize, value: T| {
            let distance = j.abs_diff(i);
            if distance > 1 && value != T::zero() {
                one &= *width.get_or_insert(distance) == distance;
            }
        };
        a.visit_row(i, &mut see);
        b.visit_row(i, &mut see);
        if !one {
            return None;
        }
    }
    let nx = width.filter(|&nx| n.is_multiple_of(nx))?;
    let on_grid = [FivePoint::from_rows(nx, n / nx, a), FivePoint::from_rows(nx, n / nx, b)];
    let [Ok(a), Ok(b)] = on_grid else { return None };
    Some([a, b])
}
