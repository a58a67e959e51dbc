use std::borrow::Cow;

use crate::{
    Coefficients, Diagonal, Error, FivePointView, LinearOperator, Rows, Scalar, all_finite,
    stencil::points,
    view::{can_close, places, visit_neighbours},
};

/// A five-point operator on an `nx × ny` grid whose coefficients vary from point to point.
///
/// Points are numbered, and the operator acts, as [`FivePoint`](crate::FivePoint) does, with
/// coefficients of its own in each row. Those that lead outside the grid have no meaning, but must
/// be finite.
///
/// # Cost
///
/// A direction that is the same everywhere is stored as one number, any other as `nx·ny`; borrowed
/// arrays are not copied. One product reads the stored coefficients, reads `x` and writes `y` once.
///
/// ```
/// use hlcp_core::{LinearOperator, VaryingFivePoint};
///
/// // −(c u′)′ on a line, with c = 1, 2, 3, 4 between the points.
/// let c = |i: usize| (i + 1) as f64;
/// let a = VaryingFivePoint::from_fn(3, 1, |i, _| [0.0, -c(i), c(i) + c(i + 1), -c(i + 1), 0.0])?;
/// let mut y = [0.0; 3];
/// a.apply(&[1.0, 1.0, 2.0], &mut y);
/// assert_eq!(y, [1.0, -3.0, 11.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct VaryingFivePoint<'a, T: Scalar> {
    // Invariant: nx, ny ≥ 1, at least 3 where a direction closes, arrays have nx·ny entries, and
    // all coefficients are finite.
    nx: usize,
    ny: usize,
    coefficients: [Direction<'a, T>; 5],
    round: [bool; 2],
}

#[derive(Debug, Clone, PartialEq)]
enum Direction<'a, T: Scalar> {
    Constant(T),
    Each(Cow<'a, [T]>),
}

impl<T: Scalar> Direction<'_, T> {
    fn view(&self) -> Coefficients<'_, T> {
        match self {
            Self::Constant(value) => Coefficients::Constant(*value),
            Self::Each(values) => Coefficients::Each(values),
        }
    }
}

/// How errors name the directions.
const NAMES: [&str; 5] = ["south", "west", "centre", "east", "north"];

impl<'a, T: Scalar> VaryingFivePoint<'a, T> {
    /// The operator with coefficients `[south, west, centre, east, north]`, borrowed where they
    /// vary.
    ///
    /// # Errors
    ///
    /// [`Error::Grid`] for a grid without points, or with more than an array can hold;
    /// [`Error::Order`] for a list that has not one entry for each point; [`Error::NotFinite`] for
    /// the first coefficient that is NaN or infinite.
    ///
    /// ```
    /// use hlcp_core::{
    ///     Coefficients::{Constant, Each},
    ///     Diagonal, VaryingFivePoint,
    /// };
    ///
    /// let centre = [4.0, 5.0, 6.0, 7.0];
    /// let coefficients =
    ///     [Constant(-1.0), Constant(-1.0), Each(&centre), Constant(-1.0), Constant(-1.0)];
    /// assert_eq!(VaryingFivePoint::new(2, 2, coefficients)?.diagonal_entry(3), 7.0);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn new(
        nx: usize,
        ny: usize,
        coefficients: [Coefficients<'a, T>; 5],
    ) -> Result<Self, Error> {
        let n = points::<T>(nx, ny)?;
        for (what, coefficients) in NAMES.into_iter().zip(&coefficients) {
            match coefficients {
                Coefficients::Constant(value) => all_finite(what, &[*value])?,
                Coefficients::Each(values) if values.len() != n => {
                    return Err(Error::Order { what, found: values.len(), expected: n });
                }
                Coefficients::Each(values) => all_finite(what, values)?,
            }
        }
        let coefficients = coefficients.map(|c| match c {
            Coefficients::Constant(value) => Direction::Constant(value),
            Coefficients::Each(values) => Direction::Each(Cow::Borrowed(values)),
        });
        Ok(Self { nx, ny, coefficients, round: [false; 2] })
    }

    /// The operator whose row at point `(i, j)`, column `i` and row `j`, is
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
        for (what, list) in NAMES.into_iter().zip(&lists) {
            all_finite(what, list)?;
        }
        let coefficients = lists.map(|list| {
            if list.iter().all(|&value| value == list[0]) {
                Direction::Constant(list[0])
            } else {
                Direction::Each(Cow::Owned(list))
            }
        });
        Ok(Self { nx, ny, coefficients, round: [false; 2] })
    }

    /// The same operator on a grid that closes round in the directions `[x, y]` that say so, as
    /// [`FivePoint::periodic`](crate::FivePoint::periodic) does; the coefficients that led outside
    /// then lead across.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for fewer than three points in a direction that closes.
    ///
    /// ```
    /// use hlcp_core::{LinearOperator, VaryingFivePoint};
    ///
    /// let ring = VaryingFivePoint::from_fn(4, 1, |i, _| [0.0, -1.0, 2.0 + i as f64, -1.0, 0.0])?;
    /// let mut y = [0.0; 4];
    /// ring.periodic([true, false])?.apply(&[1.0, 0.0, 0.0, 0.0], &mut y);
    /// assert_eq!(y, [2.0, -1.0, 0.0, -1.0]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn periodic(self, round: [bool; 2]) -> Result<Self, Error> {
        can_close([self.nx, self.ny], round)?;
        Ok(Self { round, ..self })
    }

    /// The operator with the rows of another one, such as an assembled matrix, on an `nx × ny`
    /// grid.
    ///
    /// # Errors
    ///
    /// [`Error::Grid`] for a grid without points, or with more than an array can hold;
    /// [`Error::Order`] for a grid of another order than the operator's; [`Error::OffGrid`] for the
    /// first row with an entry that is not zero and leads to no neighbour on the grid;
    /// [`Error::NotFinite`] for an entry that is NaN or infinite.
    ///
    /// # Cost
    ///
    /// Two walks over the rows; nothing is stored for a direction that is the same everywhere.
    ///
    /// ```
    /// use hlcp_core::{Csr, Error, FivePoint, LinearOperator, VaryingFivePoint};
    ///
    /// let row = [-1.0, -1.0, 4.0, -1.0, -1.0];
    /// let assembled = Csr::from_rows(&FivePoint::new(4, 3, row)?);
    /// let grid = VaryingFivePoint::from_rows(4, 3, &assembled)?;
    /// assert_eq!(grid.as_five_point().expect("a grid").constants(), Some(row));
    /// let error = VaryingFivePoint::from_rows(3, 4, &assembled).unwrap_err();
    /// assert_eq!(error, Error::OffGrid { row: 0, column: 4, nx: 3, ny: 4 });
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn from_rows(
        nx: usize,
        ny: usize,
        operator: &(impl Rows<T> + ?Sized),
    ) -> Result<Self, Error> {
        let n = points::<T>(nx, ny)?;
        if operator.order() != n {
            let what = "the grid";
            return Err(Error::Order { what, found: n, expected: operator.order() });
        }
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
            let constant = Direction::Constant(first.unwrap_or(T::zero()));
            if same { constant } else { Direction::Each(Cow::Owned(Vec::with_capacity(n))) }
        });
        for k in 0..n {
            let row = row_on_grid(nx, ny, k, operator)?;
            for (direction, coefficient) in coefficients.iter_mut().zip(row) {
                if let Direction::Each(Cow::Owned(list)) = direction {
                    list.push(coefficient.unwrap_or(T::zero()));
                }
            }
        }
        Ok(Self { nx, ny, coefficients, round: [false; 2] })
    }

    fn view(&self) -> FivePointView<'_, T> {
        FivePointView::new(self.nx, self.ny, self.coefficients.each_ref().map(Direction::view))
            .periodic(self.round)
    }
}

impl<T: Scalar> LinearOperator<T> for VaryingFivePoint<'_, T> {
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

impl<T: Scalar> Diagonal<T> for VaryingFivePoint<'_, T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.coefficients[2].view().at(i)
    }
}

impl<T: Scalar> Rows<T> for VaryingFivePoint<'_, T> {
    #[inline]
    fn visit_row(&self, k: usize, visit: &mut dyn FnMut(usize, T)) {
        let coefficient = |direction: usize| self.coefficients[direction].view().at(k);
        visit_neighbours([self.nx, self.ny], self.round, k, coefficient, visit);
    }
}

/// Row `k` of an operator as a five-point one on an `nx × ny` grid has it, with no coefficient
/// where a direction leads outside.
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
            Some(direction) => row[direction] = Some(value),
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
/// [`VaryingFivePoint::from_rows`].
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
) -> Option<[VaryingFivePoint<'static, T>; 2]> {
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
    let on_grid =
        [VaryingFivePoint::from_rows(nx, n / nx, a), VaryingFivePoint::from_rows(nx, n / nx, b)];
    let [Ok(a), Ok(b)] = on_grid else { return None };
    Some([a, b])
}
