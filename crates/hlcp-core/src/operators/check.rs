use super::{LinearOperator, Rows};
use crate::numbers::{Error, Scalar, check_orders};

/// Checks that what an operator tells of itself agrees: rows, product, diagonal and views.
///
/// For operators of your own, once, while you write them. Checked are
///
/// * that [`visit_row`](Rows::visit_row) visits columns below the order, each at most once and by
///   increasing index, with finite entries, and [`copy_row`](Rows::copy_row) copies the same;
/// * that [`diagonal_entry`](crate::Diagonal::diagonal_entry) is the row's;
/// * that [`apply`](crate::LinearOperator::apply), which must not read what it overwrites, is the
///   product with the rows, for one vector without pattern, to half the digits of `T`; likewise
///   [`try_visit_row`](crate::LinearOperator::try_visit_row),
///   [`as_five_point`](crate::LinearOperator::as_five_point) and
///   [`as_csr`](crate::LinearOperator::as_csr), as far as they answer.
///
/// # Errors
///
/// What the operator's own [`check`](crate::LinearOperator::check) refuses; [`Error::Empty`] for
/// order 0; [`Error::Outside`], [`Error::Index`] and [`Error::NotFinite`] for the first row that is
/// wrong in itself; [`Error::Contradiction`] for the first row that something else contradicts;
/// [`Error::Order`] for a view of another order.
///
/// # Cost
///
/// Three walks over the rows, one product, three vectors.
///
/// ```
/// use hlcp_core::{FivePoint, Identity, Sum, check_operator};
///
/// let grid = FivePoint::new(4, 3, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// assert_eq!(check_operator(&grid), Ok(()));
/// assert!(check_operator(&Sum(grid, Identity { order: 5 })).is_err());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn check_operator<T: Scalar>(operator: &(impl Rows<T> + ?Sized)) -> Result<(), Error> {
    operator.check("the operator")?;
    let n = operator.order();
    if n == 0 {
        return Err(Error::Empty { what: "the operator" });
    }
    let x: Vec<T> = (0..n).map(noise).collect();
    // The product with the rows, and the sums of the moduli of its terms.
    let mut sums = vec![[T::zero(); 2]; n];
    let mut row = Vec::new();
    for (i, sum) in sums.iter_mut().enumerate() {
        row.clear();
        operator.visit_row(i, &mut |j, a| row.push((j, a)));
        check_row("row", operator, i)?;
        if let Some(pair) = row.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
            let (what, value) = ("the column in row", pair[1].0 as i64);
            return Err(Error::Index { what, index: i, value, must: "above the one before it" });
        }
        let centre = row.iter().find(|entry| entry.0 == i).map_or(T::zero(), |entry| entry.1);
        agrees("the diagonal", i, operator.diagonal_entry(i), [centre, centre.abs()])?;
        *sum =
            row.iter().fold(*sum, |[sum, size], &(j, a)| [sum + a * x[j], size + (a * x[j]).abs()]);
        let mut copied = vec![(0, T::zero()); row.len()];
        let count = operator.copy_row(i, &mut copied);
        if count != row.len() || copied != row {
            let [found, expected] = [count, row.len()].map(|count| count as f64);
            return Err(Error::Contradiction { what: "the copied row", row: i, found, expected });
        }
    }
    let mut y = vec![T::nan(); n];
    let mut is_product = |what, product: &mut dyn FnMut(&mut [T])| {
        y.fill(T::nan());
        product(&mut y);
        let mut found = y.iter().zip(&sums).enumerate();
        found.try_for_each(|(i, (&y, &sum))| agrees(what, i, y, sum))
    };
    is_product("the product", &mut |y| operator.apply(&x, y))?;
    if operator.try_visit_row(0, &mut |_, _| ()) {
        is_product("the row of try_visit_row", &mut |y| {
            for (i, y) in y.iter_mut().enumerate() {
                *y = T::zero();
                operator
                    .try_visit_row(i, &mut |j, a| *y += a * x.get(j).copied().unwrap_or(T::nan()));
            }
        })?;
    }
    if let Some(view) = operator.as_five_point() {
        let [nx, ny] = view.grid().unwrap_or([n, 1]);
        check_orders(n, &[("the grid of as_five_point", nx.saturating_mul(ny))])?;
        is_product("the product of as_five_point", &mut |y| view.apply([nx, ny], &x, y))?;
    }
    if let Some(matrix) = operator.as_csr() {
        check_orders(n, &[("the matrix of as_csr", matrix.order())])?;
        is_product("the product of as_csr", &mut |y| matrix.apply(&x, y))?;
    }
    Ok(())
}

/// Refuses row `i` of an operator with an entry that is not finite, or in no column; `what` names
/// the row, as in "row of A".
///
/// Methods that walk rows call it for each, before they do.
///
/// # Errors
///
/// [`Error::NotFinite`] and [`Error::Outside`], for the first such entry.
///
/// # Panics
///
/// May panic unless `i` is below the order.
#[doc(hidden)]
pub fn check_row<T: Scalar>(
    what: &'static str,
    operator: &(impl Rows<T> + ?Sized),
    i: usize,
) -> Result<(), Error> {
    let (n, mut checked) = (operator.order(), Ok(()));
    operator.visit_row(i, &mut |j, a| {
        if checked.is_ok() && j >= n {
            checked = Err(Error::Outside { what, row: i, column: j, order: n });
        } else if checked.is_ok() && !a.is_finite() {
            checked = Err(Error::NotFinite { what, index: i, value: a.wide() });
        }
    });
    checked
}

/// Refuses a value of row `i` that is not the sum of the row, to half the digits of its terms.
fn agrees<T: Scalar>(
    what: &'static str,
    row: usize,
    found: T,
    [sum, size]: [T; 2],
) -> Result<(), Error> {
    if (found - sum).abs() <= T::epsilon().sqrt() * size {
        return Ok(());
    }
    Err(Error::Contradiction { what, row, found: found.wide(), expected: sum.wide() })
}

/// Returns a number without pattern, of modulus 1 to 2.
fn noise<T: Scalar>(j: usize) -> T {
    // Fibonacci hashing: multiples of 2⁶⁴ over the golden ratio.
    let bits = (j as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let size = 1.0 + (bits << 1 >> 12) as f64 / (1_u64 << 52) as f64;
    T::of(if bits >> 63 == 0 { size } else { -size })
}

/// Ends a walk over a row that leads outside.
#[cold]
pub(crate) fn outside(row: usize, column: usize, order: usize) -> ! {
    panic!("{}", Error::Outside { what: "row", row, column, order });
}
