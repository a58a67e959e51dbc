use super::{Entries, Rows};
use crate::numbers::{Error, Scalar, check_orders, positive};

/// The positive diagonal matrix Ω of the modulus equation.
///
/// ```
/// use hlcp_core::Omega;
///
/// let omega = Omega::Each(vec![2.0, 0.5]);
/// assert_eq!((omega.entry(1), Omega::Uniform(3.0).entry(1)), (0.5, 3.0));
/// assert_eq!((vec![2.0, 0.5].into(), 3.0.into()), (omega, Omega::Uniform(3.0)));
/// ```
pub type Omega<T> = Entries<T, Vec<T>>;

impl<T: Scalar> From<T> for Omega<T> {
    fn from(entry: T) -> Self {
        Self::Uniform(entry)
    }
}

impl<T: Scalar> From<Vec<T>> for Omega<T> {
    fn from(entries: Vec<T>) -> Self {
        Self::Each(entries)
    }
}

impl<T: Scalar> Omega<T> {
    /// Returns Ω = τ D_A D_B⁻¹, the choice of the paper's section 4.
    ///
    /// One number when the ratio is the same in every row, so a pair of constant stencils stores no
    /// vector. For τ ≥ 1 no entry is below the ratio of the diagonals as a real number, which
    /// Theorem 2 of the paper asks for: one rounded down gives way to the next number up. Where a
    /// diagonal has a zero, as those of the conditions of Karush, Kuhn and Tucker do, the largest
    /// entries of both rows take the place of theirs on the diagonal; if one of these is zero, too,
    /// the ratio is 1. Where that of `A` is negative, the sizes of both serve.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for τ; what [`check`](crate::LinearOperator::check) of `a` or `b`
    /// refuses; [`Error::Order`] when `a` and `b` differ in order, [`Error::Empty`] when they have
    /// none; [`Error::NotPositive`] for the first diagonal entry of `a` or `b` that is not finite,
    /// the first of `b` that is negative where that of `a` is not, or the first ratio that is not
    /// positive and finite.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Identity, Omega, RowMajor};
    ///
    /// let a = FivePoint::new(4, 4, [-1.0, -1.0, 6.0, -1.0, -1.0])?;
    /// let b = FivePoint::new(4, 4, [0.0, -1.0, 4.0, -1.0, 0.0])?;
    /// assert_eq!(Omega::diagonal_ratio(0.8, &a, &b)?, Omega::Uniform(0.8 * 1.5));
    ///
    /// // Minimise x²: 2x − 3λ = r₁ with 3x ≥ 1.
    /// let a = RowMajor::new(2, vec![2.0, -3.0, 3.0, 0.0])?;
    /// let omega = Omega::diagonal_ratio(1.0, &a, &Identity { order: 2 })?;
    /// assert_eq!(omega, Omega::Each(vec![2.0, 3.0]));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn diagonal_ratio(
        tau: T,
        a: &(impl Rows<T> + ?Sized),
        b: &(impl Rows<T> + ?Sized),
    ) -> Result<Self, Error> {
        let (a, b) = (&a, &b);
        positive("tau", tau.wide())?;
        a.check("A")?;
        b.check("B")?;
        let n = a.order();
        check_orders(n, &[("B", b.order())])?;
        let diagonals = |i| [a.diagonal_entry(i), b.diagonal_entry(i)];
        let ratio = |i| -> Result<T, Error> {
            let [of_a, of_b] = diagonals(i);
            for (what, entry) in [("diagonal of A", of_a), ("diagonal of B", of_b)] {
                let is_turned = of_a < T::zero() && entry.is_finite();
                if entry != T::zero() && !is_turned {
                    positive_entry(what, i, entry)?;
                }
            }
            let [of_a, of_b] = [of_a.abs(), of_b.abs()];
            if of_a == T::zero() || of_b == T::zero() {
                let [a, b] = [largest(a, i), largest(b, i)];
                let is_any = a > T::zero() && b > T::zero();
                return positive_entry("omega", i, if is_any { tau * (a / b) } else { tau });
            }
            let mut omega = tau * (of_a / of_b);
            // In a unit in which the difference does not underflow.
            let [a, b] = [of_a.wide(), of_b.wide()];
            let unit = if a < 1e-280 { f64::powi(2.0, 400) } else { 1.0 };
            let is_short = |omega: T| (unit * omega.wide()).mul_add(b, -unit * a) < 0.0;
            while tau >= T::one() && is_short(omega) {
                // The next number up: between 0.6 and 1.3 units in the last place are added.
                let least = T::min_positive_value() * T::epsilon();
                omega += (omega * T::of(0.625) * T::epsilon()).max(least);
            }
            positive_entry("omega", i, omega)
        };
        if n == 0 {
            return Err(Error::Empty { what: "A" });
        }
        let (first, of_first) = (ratio(0)?, diagonals(0));
        for i in 1..n {
            let is_same = diagonals(i) == of_first && !of_first.contains(&T::zero());
            if !is_same && ratio(i)? != first {
                return (0..n).map(ratio).collect::<Result<_, _>>().map(Self::Each);
            }
        }
        Ok(Self::Uniform(first))
    }

    /// Refuses an Ω that does not fit order `n`, or has an entry that is not positive and finite.
    pub(crate) fn check(&self, n: usize) -> Result<(), Error> {
        match self {
            Self::Uniform(omega) => positive("omega", omega.wide()),
            Self::Each(omega) => {
                check_orders(n, &[("omega", omega.len())])?;
                let mut entries = omega.iter().enumerate();
                entries.try_for_each(|(i, &entry)| positive_entry("omega", i, entry).map(drop))
            }
        }
    }
}

/// Returns the largest size of an entry in row `i`.
fn largest<T: Scalar>(operator: &impl Rows<T>, i: usize) -> T {
    let mut largest = T::zero();
    operator.visit_row(i, &mut |_, a| largest = largest.max(a.abs()));
    largest
}

/// Returns the entry, unless it is zero, negative or not finite.
pub(crate) fn positive_entry<T: Scalar>(
    what: &'static str,
    index: usize,
    value: T,
) -> Result<T, Error> {
    let wrong = Error::NotPositive { what, index, value: value.wide() };
    if value > T::zero() && value.is_finite() { Ok(value) } else { Err(wrong) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operators::FivePoint;

    /// The least number whose product with b is not below a, also where the quotient is next to a
    /// power of two.
    #[test]
    fn no_ratio_is_below_that_of_the_diagonals() {
        let ratio = |a: f64, b: f64| {
            let of = |d: f64| FivePoint::new(1, 1, [0.0, 0.0, d, 0.0, 0.0]).unwrap();
            Omega::diagonal_ratio(1.0, &of(a), &of(b)).unwrap().entry(0)
        };
        let mut raised = 0;
        for k in 1..4000 {
            let a = if k % 2 == 0 { f64::from(k) } else { (f64::from(k) * 2.0).next_down() };
            let b = f64::from(k % 63 + 1).next_up();
            let omega = ratio(a, b);
            let short = |omega: f64| omega.mul_add(b, -a) < 0.0; // exactly
            assert!(!short(omega) && short(omega.next_down()), "{a} {b}");
            raised += usize::from(omega > a / b);
        }
        assert!(raised > 1000);
        // The ratio, and the difference of the products, may be below the normal numbers.
        for (a, b) in [(1.0, 1.3e308), (1e-315, 3e-8)] {
            let unit = f64::powi(2.0, 400);
            assert!((unit * ratio(a, b)).mul_add(b, -unit * a) >= 0.0, "{a} {b}");
        }
    }
}
