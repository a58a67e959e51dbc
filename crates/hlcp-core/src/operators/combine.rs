//! Operators made of numbers or of other operators.

use super::{Coefficients, Diagonal, FivePointView, LinearOperator, Rows};
use crate::numbers::{Error, Scalar, all_finite, assert_lengths};

/// The identity: with it for `B`, the problem is the linear complementarity problem.
///
/// ```
/// use hlcp_core::{Identity, LinearOperator};
///
/// let mut y = [f64::NAN; 2];
/// Identity { order: 2 }.apply(&[3.0, -4.0], &mut y);
/// assert_eq!(y, [3.0, -4.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// The order.
    pub order: usize,
}

impl<T: Scalar> LinearOperator<T> for Identity {
    fn order(&self) -> usize {
        self.order
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        assert_lengths(self.order, [("x", x.len()), ("y", y.len())]);
        y.copy_from_slice(x);
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        Some(FivePointView::diagonal(Coefficients::Uniform(T::one())))
    }
}

impl<T: Scalar> Diagonal<T> for Identity {
    fn diagonal_entry(&self, _: usize) -> T {
        T::one()
    }
}

impl<T: Scalar> Rows<T> for Identity {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        visit(i, T::one());
    }
}

/// The diagonal matrix of the entries it holds.
///
/// ```
/// use hlcp_core::{DiagonalMatrix, LinearOperator};
///
/// let mut y = [f64::NAN; 2];
/// DiagonalMatrix::new(vec![2.0, 0.5])?.apply(&[3.0, -4.0], &mut y);
/// assert_eq!(y, [6.0, -2.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DiagonalMatrix<T> {
    // Invariant: finite.
    entries: Vec<T>,
}

impl<T: Scalar> DiagonalMatrix<T> {
    /// Returns diag(entries).
    ///
    /// # Errors
    ///
    /// [`Error::NotFinite`] for the first entry that is NaN or infinite.
    pub fn new(entries: Vec<T>) -> Result<Self, Error> {
        all_finite("diagonal", &entries)?;
        Ok(Self { entries })
    }
}

impl<T: Scalar> LinearOperator<T> for DiagonalMatrix<T> {
    fn order(&self) -> usize {
        self.entries.len()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        assert_lengths(self.entries.len(), [("x", x.len()), ("y", y.len())]);
        for ((y, &x), &d) in y.iter_mut().zip(x).zip(&self.entries) {
            *y = d * x;
        }
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        Some(FivePointView::diagonal(Coefficients::Each(&self.entries)))
    }
}

impl<T: Scalar> Diagonal<T> for DiagonalMatrix<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.entries[i]
    }
}

impl<T: Scalar> Rows<T> for DiagonalMatrix<T> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        visit(i, self.entries[i]);
    }
}

/// A multiple of an operator, on every rung that the operator stands on. Its entries are the
/// products, rounded.
///
/// ```
/// use hlcp_core::{Diagonal, Identity, Scaled};
/// assert_eq!(Scaled { by: 2.5, of: Identity { order: 3 } }.diagonal_entry(1), 2.5);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaled<T, O> {
    /// The factor.
    pub by: T,
    /// The operator that is multiplied.
    pub of: O,
}

impl<T: Scalar, O: LinearOperator<T>> LinearOperator<T> for Scaled<T, O> {
    fn order(&self) -> usize {
        self.of.order()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.of.apply(x, y);
        y.iter_mut().for_each(|y| *y *= self.by);
    }

    fn check(&self, what: &'static str) -> Result<(), Error> {
        self.of.check(what)
    }

    /// Returns a view where the operator's coefficients are constant.
    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        let view = self.of.as_five_point()?;
        let scaled = view.constants()?.map(|value| Coefficients::Uniform(value * self.by));
        Some(view.with(scaled))
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.of.try_visit_row(i, &mut |j, a| visit(j, self.by * a))
    }
}

impl<T: Scalar, O: Diagonal<T>> Diagonal<T> for Scaled<T, O> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.by * self.of.diagonal_entry(i)
    }
}

impl<T: Scalar, O: Rows<T>> Rows<T> for Scaled<T, O> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        self.of.visit_row(i, &mut |j, a| visit(j, self.by * a));
    }
}

/// The operator plus a multiple of the identity, on every rung that the operator stands on. Its
/// diagonal is that of the sum, rounded: of it speak residuals, certificates and proofs.
///
/// ```
/// use hlcp_core::{Diagonal, Identity, Shifted};
/// assert_eq!(Shifted { by: 2.5, of: Identity { order: 3 } }.diagonal_entry(1), 3.5);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shifted<T, O> {
    /// The multiple of the identity.
    pub by: T,
    /// The operator it is added to.
    pub of: O,
}

impl<T: Scalar, O: LinearOperator<T>> LinearOperator<T> for Shifted<T, O> {
    fn order(&self) -> usize {
        self.of.order()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.of.apply(x, y);
        for (y, &x) in y.iter_mut().zip(x) {
            *y += self.by * x;
        }
    }

    fn check(&self, what: &'static str) -> Result<(), Error> {
        self.of.check(what)
    }

    /// Returns a view where the operator's diagonal is constant.
    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        let view = self.of.as_five_point()?;
        let [south, west, centre, east, north] = view.coefficients();
        let Coefficients::Uniform(centre) = centre else { return None };
        let centre = Coefficients::Uniform(centre + self.by);
        Some(view.with([south, west, centre, east, north]))
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        let mut diagonal = T::zero();
        let known = self.of.try_visit_row(i, &mut |j, a| {
            if j == i { diagonal += a } else { visit(j, a) }
        });
        if known {
            visit(i, diagonal + self.by);
        }
        known
    }
}

impl<T: Scalar, O: Diagonal<T>> Diagonal<T> for Shifted<T, O> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.of.diagonal_entry(i) + self.by
    }
}

impl<T: Scalar, O: Rows<T>> Rows<T> for Shifted<T, O> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        let mut pending = Some(self.by);
        self.of.visit_row(i, &mut |j, a| {
            if let Some(by) = pending.take_if(|_| j > i) {
                visit(i, by);
            }
            visit(j, pending.take_if(|_| j == i).map_or(a, |by| a + by));
        });
        if let Some(by) = pending {
            visit(i, by);
        }
    }
}

/// The sum of two operators, on every rung that both stand on. Its entries are the sums, rounded:
/// of these speak residuals, certificates and proofs.
///
/// # Cost
///
/// A product takes one of each and a vector of length `n` that is allocated and dropped. A row is
/// visited once for the first operator and, for the second, once for each entry of the first's.
///
/// ```
/// use hlcp_core::{DiagonalMatrix, Identity, LinearOperator, Sum};
///
/// let sum = Sum(Identity { order: 2 }, DiagonalMatrix::new(vec![1.0, 3.0])?);
/// let mut y = [f64::NAN; 2];
/// sum.apply(&[5.0, 7.0], &mut y);
/// assert_eq!(y, [10.0, 28.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sum<L, R>(pub L, pub R);

impl<T: Scalar, L: LinearOperator<T>, R: LinearOperator<T>> LinearOperator<T> for Sum<L, R> {
    /// Returns the order of both; where they differ, that of the first, and [`check`](Self::check)
    /// refuses the sum.
    fn order(&self) -> usize {
        self.0.order()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        let mut second = vec![T::zero(); y.len()];
        self.0.apply(x, y);
        self.1.apply(x, &mut second);
        for (y, second) in y.iter_mut().zip(second) {
            *y += second;
        }
    }

    fn check(&self, what: &'static str) -> Result<(), Error> {
        self.0.check(what)?;
        self.1.check(what)?;
        let orders = [self.0.order(), self.1.order()];
        if orders[0] == orders[1] { Ok(()) } else { Err(Error::Summands { what, orders }) }
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        let rows = [whole_row(&self.0, i), whole_row(&self.1, i)];
        let [Some(mut row), Some(second)] = rows else { return false };
        row.extend(second);
        join(&mut row);
        row.into_iter().for_each(|(j, a)| visit(j, a));
        true
    }
}

/// Returns the entries of a row that may come in parts, by increasing column, each column once.
fn whole_row<T: Scalar>(operator: &impl LinearOperator<T>, i: usize) -> Option<Vec<(usize, T)>> {
    let mut row = vec![];
    let known = operator.try_visit_row(i, &mut |j, a| row.push((j, a)));
    join(&mut row);
    known.then_some(row)
}

/// Sorts entries by their columns and adds those of one column, in their order.
fn join<T: Scalar>(row: &mut Vec<(usize, T)>) {
    row.sort_by_key(|&(j, _)| j);
    row.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
}

impl<T: Scalar, L: Diagonal<T>, R: Diagonal<T>> Diagonal<T> for Sum<L, R> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.0.diagonal_entry(i) + self.1.diagonal_entry(i)
    }
}

impl<T: Scalar, L: Rows<T>, R: Rows<T>> Rows<T> for Sum<L, R> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        // The columns below `from` are done.
        let mut from = 0;
        self.0.visit_row(i, &mut |j, mut a| {
            self.1.visit_row(i, &mut |k, b| {
                if k == j {
                    a += b;
                } else if (from..j).contains(&k) {
                    visit(k, b);
                }
            });
            visit(j, a);
            from = j + 1;
        });
        self.1.visit_row(i, &mut |k, b| {
            if k >= from {
                visit(k, b);
            }
        });
    }
}
