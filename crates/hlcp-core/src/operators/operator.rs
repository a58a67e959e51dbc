use super::{Csr, FivePointView};
use crate::numbers::{Error, Scalar};

/// A square linear map on `Tⁿ`, known through its action `x ↦ A x` alone.
///
/// A solver asks for no more than this unless its bound says so. `&O`, `Box<O>` and `Arc<O>` are
/// operators whenever `O` is, also for `O = dyn LinearOperator<T>`.
///
/// ```
/// use hlcp_core::{FivePoint, LinearOperator};
///
/// // The second difference with zero boundary values.
/// let mut y = [f64::NAN; 3];
/// FivePoint::new(3, 1, [0.0, -1.0, 2.0, -1.0, 0.0])?.apply(&[1.0, 2.0, 4.0], &mut y);
/// assert_eq!(y, [0.0, -1.0, 6.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a linear operator",
    note = "implement `LinearOperator`, the order and the product; share operators by `Arc`, not `Rc`",
    note = "matrices of nalgebra need the feature `nalgebra-sparse`"
)]
pub trait LinearOperator<T: Scalar>: Send + Sync {
    /// Returns the order `n` of the map.
    fn order(&self) -> usize;

    /// Overwrites `y` with `A x`; what `y` held before is never read.
    ///
    /// # Panics
    ///
    /// May panic unless both slices have length [`order`](Self::order).
    fn apply(&self, x: &[T], y: &mut [T]);

    /// Refuses an operator that [`Hlcp::new`](crate::Hlcp::new) can pose no problem with, as one
    /// that is no map from `Tⁿ` to itself; `what` is its name in the error. The default refuses
    /// nothing.
    ///
    /// # Errors
    ///
    /// [`Error::NotSquare`] and [`Error::Summands`]; [`Error::Operator`], in the words of an
    /// operator of your own.
    ///
    /// ```
    /// use hlcp_core::{Error, Hlcp, Identity, LinearOperator, Omega};
    ///
    /// /// The second difference with step `h`, as a product alone.
    /// #[derive(Debug)]
    /// struct SecondDifference(f64);
    ///
    /// impl LinearOperator<f64> for SecondDifference {
    ///     fn check(&self, what: &'static str) -> Result<(), Error> {
    ///         let why = format!("the step is {}, but it must be positive", self.0).into();
    ///         if self.0 > 0.0 { Ok(()) } else { Err(Error::Operator { what, why }) }
    ///     }
    ///     // … the order and the product …
    /// #   fn order(&self) -> usize { 3 }
    /// #   fn apply(&self, _: &[f64], _: &mut [f64]) {}
    /// }
    ///
    /// let posed = Hlcp::new(SecondDifference(-0.1), Identity { order: 3 }, Omega::Uniform(1.0));
    /// assert_eq!(posed.unwrap_err().to_string(), "A: the step is -0.1, but it must be positive");
    /// ```
    fn check(&self, _what: &'static str) -> Result<(), Error> {
        Ok(())
    }

    /// Returns this operator as a five-point one, if it is one.
    ///
    /// It opens the fused sweeps and residuals, whose iterates are those of a walk over the rows up
    /// to rounding, their threads, and geometric multigrid. The default answers `None`.
    /// [`FivePointView`] says what a view promises, [`check_operator`](crate::check_operator)
    /// checks it.
    ///
    /// ```
    /// use hlcp_core::{
    ///     Diagonal, Entries::Uniform, FivePointView, LinearOperator, Rows, check_operator,
    /// };
    ///
    /// /// A string of n beads on springs: (2 + k)xᵢ − xᵢ₋₁ − xᵢ₊₁.
    /// struct Beads {
    ///     n: usize,
    ///     k: f64,
    /// }
    ///
    /// impl LinearOperator<f64> for Beads {
    ///     fn order(&self) -> usize {
    ///         self.n
    ///     }
    ///     fn apply(&self, x: &[f64], y: &mut [f64]) {
    ///         for i in 0..self.n {
    ///             let at = |j: usize| x.get(j).copied().unwrap_or(0.0);
    ///             y[i] = (2.0 + self.k) * x[i] - at(i.wrapping_sub(1)) - at(i + 1);
    ///         }
    ///     }
    ///     fn as_five_point(&self) -> Option<FivePointView<'_, f64>> {
    ///         let row = [0.0, -1.0, 2.0 + self.k, -1.0, 0.0];
    ///         Some(FivePointView::new(self.n, 1, row.map(Uniform)))
    ///     }
    /// }
    ///
    /// impl Diagonal<f64> for Beads {
    ///     fn diagonal_entry(&self, _: usize) -> f64 {
    ///         2.0 + self.k
    ///     }
    /// }
    ///
    /// impl Rows<f64> for Beads {
    ///     fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
    ///         for j in i.saturating_sub(1)..self.n.min(i + 2) {
    ///             visit(j, if j == i { 2.0 + self.k } else { -1.0 });
    ///         }
    ///     }
    /// }
    ///
    /// // The product, the rows and the view agree.
    /// assert_eq!(check_operator(&Beads { n: 50, k: 0.1 }), Ok(()));
    /// ```
    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        None
    }

    /// Returns this operator as an assembled matrix, if it has one at hand.
    ///
    /// Rows in arrays are walked in place, without a call for each entry. An operator that answers
    /// promises that its rows are these.
    fn as_csr(&self) -> Option<Csr<'_, T>> {
        None
    }

    /// Calls `visit(j, aᵢⱼ)` for the entries of row `i` and returns true, or returns false if the
    /// operator does not know its rows.
    ///
    /// The entries of one column may come in parts, in any order. A type that implements [`Rows`]
    /// calls [`visit_row`](Rows::visit_row) here. With it a solver evaluates residuals exactly
    /// where rounding decides, which it can only estimate otherwise. The default visits what
    /// [`as_csr`](Self::as_csr) or [`as_five_point`](Self::as_five_point) shows, and answers false
    /// where neither does.
    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        if let Some(matrix) = self.as_csr() {
            matrix.visit_row(i, visit);
        } else if let Some(view) = self.as_five_point() {
            view.visit_row(self.order(), i, visit);
        } else {
            return false;
        }
        true
    }
}

/// An operator that knows its diagonal: what [`Jacobi`](crate::Jacobi) and Ω = τ D_A D_B⁻¹ ask for.
///
/// Entry by entry, so that an operator with a constant diagonal stores one number.
///
/// ```
/// use hlcp_core::{Diagonal, FivePoint, Identity, Omega};
///
/// let a = FivePoint::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// assert_eq!(a.diagonal_entry(5), 4.0);
/// assert_eq!(Omega::diagonal_ratio(0.5, &a, &Identity { order: 6 })?, Omega::Uniform(2.0));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an operator that knows its diagonal",
    note = "implement `Diagonal`, one diagonal entry; share operators by `Arc`, not `Rc`",
    note = "without it there is `Mms::with_splitting`, with an `Omega` of your own",
    note = "matrices of nalgebra need the feature `nalgebra-sparse`"
)]
pub trait Diagonal<T: Scalar>: LinearOperator<T> {
    /// Returns the entry `aᵢᵢ`, for `i` below the order.
    fn diagonal_entry(&self, i: usize) -> T;
}

/// An operator whose rows can be walked: what [`Aor`](crate::Aor) and the accelerated method ask
/// for.
///
/// ```
/// use hlcp_core::{FivePoint, Rows};
///
/// // Of a 3 × 2 grid the corner, which has no neighbours in the south and the west.
/// let laplacian = FivePoint::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let mut row = vec![];
/// laplacian.visit_row(0, &mut |j, a| row.push((j, a)));
/// assert_eq!(row, [(0, 4.0), (1, -1.0), (3, -1.0)]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an operator that knows its rows",
    note = "implement `Diagonal` and `Rows`, one row entry by entry; share operators by `Arc`, not `Rc`",
    note = "without rows there is `Mms::with_splitting`, which takes products alone",
    note = "matrices of nalgebra need the feature `nalgebra-sparse`; one by columns is `Csr::from(&matrix)`"
)]
pub trait Rows<T: Scalar>: Diagonal<T> {
    /// Calls `visit(j, aᵢⱼ)` for the entries of row `i`, by increasing `j`, each `j` at most once.
    ///
    /// Entries that are not visited are zero. The diagonal entry is visited unless it is zero, and
    /// every `j` is below the order.
    ///
    /// # Panics
    ///
    /// May panic unless `i` is below the order.
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T));

    /// Copies the entries of row `i` to `row`, as many as it has room for, and returns how many the
    /// row has.
    ///
    /// Sweeps copy rows of at most 16 entries, so that behind `Box<dyn Rows<T>>` a row takes one
    /// call and not one for each entry; an operator that holds another passes it on.
    ///
    /// # Panics
    ///
    /// May panic unless `i` is below the order.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Rows};
    ///
    /// let laplacian = FivePoint::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// let mut row = [(0, 0.0); 2];
    /// assert_eq!(laplacian.copy_row(0, &mut row), 3);
    /// assert_eq!(row, [(0, 4.0), (1, -1.0)]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    #[inline]
    fn copy_row(&self, i: usize, row: &mut [(usize, T)]) -> usize {
        let mut count = 0;
        self.visit_row(i, &mut |j, a| {
            if let Some(entry) = row.get_mut(count) {
                *entry = (j, a);
            }
            count += 1;
        });
        count
    }
}
