use std::borrow::Cow;

use crate::{
    Coefficients, Diagonal, Error, FivePointView, LinearOperator, Rows, Scalar, all_finite,
    stencil::points, view::visit_neighbours,
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
    // Invariant: nx, ny ≥ 1, arrays have nx·ny entries, and all coefficients are finite.
    nx: usize,
    ny: usize,
    coefficients: [Direction<'a, T>; 5],
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
        Ok(Self { nx, ny, coefficients })
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
        Ok(Self { nx, ny, coefficients })
    }

    fn view(&self) -> FivePointView<'_, T> {
        FivePointView::new(self.nx, self.ny, self.coefficients.each_ref().map(Direction::view))
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
        visit_neighbours(self.nx, self.order(), k, coefficient, visit);
    }
}
