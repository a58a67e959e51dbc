use std::fmt;

use super::{Diagonal, LinearOperator, Rows};
use crate::numbers::{Error, Scalar, assert_lengths};

/// A tridiagonal operator whose rows are a function of their index.
///
/// Row `i` is `[aᵢ,ᵢ₋₁, aᵢᵢ, aᵢ,ᵢ₊₁]`. The function decides what is stored: three numbers, three
/// vectors, the parameters of a formula. Zeros are not visited.
///
/// # Cost
///
/// A product and a walk call the function once a row, a diagonal entry once.
///
/// ```
/// use hlcp_core::{LinearOperator, Tridiagonal};
///
/// let mut y = [f64::NAN; 3];
/// Tridiagonal::new(3, |_| [-1.0, 4.0, -2.0])?.apply(&[1.0, 2.0, 3.0], &mut y);
/// assert_eq!(y, [0.0, 1.0, 10.0]);
///
/// let (below, on) = (vec![-1.0, -5.0], vec![2.0, 3.0, 4.0]);
/// let upwind = move |i: usize| [if i > 0 { below[i - 1] } else { 0.0 }, on[i], 0.0];
/// Tridiagonal::new(3, upwind)?.apply(&[1.0, 2.0, 3.0], &mut y);
/// assert_eq!(y, [2.0, 5.0, 2.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Clone, Copy)]
pub struct Tridiagonal<F> {
    // Invariant: order ≥ 1.
    order: usize,
    row: F,
}

impl<F> fmt::Debug for Tridiagonal<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tridiagonal").field("order", &self.order).finish_non_exhaustive()
    }
}

impl<F> Tridiagonal<F> {
    /// Returns the operator of the given order with rows `row(0)`, `row(1)`, ….
    ///
    /// The first entry of the first row and the last one of the last row fall outside and are
    /// ignored. `row` must return the same entries at every call.
    ///
    /// # Errors
    ///
    /// [`Error::Empty`] for order 0; [`Error::NotFinite`] with the index of the first row that has
    /// an entry that is NaN or infinite.
    pub fn new<T: Scalar>(order: usize, row: F) -> Result<Self, Error>
    where
        F: Fn(usize) -> [T; 3] + Send + Sync,
    {
        if order == 0 {
            return Err(Error::Empty { what: "the tridiagonal operator" });
        }
        let operator = Self { order, row };
        for index in 0..order {
            let entries = operator.inside(index);
            if let Some(&bad) = entries.iter().find(|entry| !entry.is_finite()) {
                return Err(Error::NotFinite { what: "tridiagonal row", index, value: bad.wide() });
            }
        }
        Ok(operator)
    }

    /// Returns row `i` with zeros outside the matrix.
    #[inline]
    fn inside<T: Scalar>(&self, i: usize) -> [T; 3]
    where
        F: Fn(usize) -> [T; 3],
    {
        let [below, on, above] = (self.row)(i);
        let first = if i > 0 { below } else { T::zero() };
        [first, on, if i + 1 < self.order { above } else { T::zero() }]
    }
}

impl<T: Scalar, F: Fn(usize) -> [T; 3] + Send + Sync> LinearOperator<T> for Tridiagonal<F> {
    fn order(&self) -> usize {
        self.order
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        let n = self.order;
        assert_lengths(n, [("x", x.len()), ("y", y.len())]);
        for (i, y) in y.iter_mut().enumerate() {
            let [below, on, above] = (self.row)(i);
            *y = on * x[i];
            if i > 0 {
                *y += below * x[i - 1];
            }
            if i + 1 < n {
                *y += above * x[i + 1];
            }
        }
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl<T: Scalar, F: Fn(usize) -> [T; 3] + Send + Sync> Diagonal<T> for Tridiagonal<F> {
    fn diagonal_entry(&self, i: usize) -> T {
        (self.row)(i)[1]
    }
}

impl<T: Scalar, F: Fn(usize) -> [T; 3] + Send + Sync> Rows<T> for Tridiagonal<F> {
    #[inline]
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        for (k, entry) in self.inside(i).into_iter().enumerate() {
            if entry != T::zero() {
                visit(i + k - 1, entry);
            }
        }
    }
}
