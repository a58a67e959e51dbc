//! Sums of products with twice the digits of double precision.

use pulp::Arch;

use crate::{
    numbers::{Compiled, Meter, Part, Scalar, vectorised},
    operators::{Coefficients, RowsOf, Source},
};

/// A question to the exact residual of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Question {
    /// What bounds its modulus?
    Bound,
    /// How large is it beside the sum of its terms' moduli?
    Relative,
    /// Is it not proved positive?
    NotPositive,
    /// Is it not proved negative?
    NotNegative,
}

impl Question {
    /// Overwrites `to` with the bounds of some rows, or with 1 for yes and 0 for no, given what
    /// [`ExactSum::around`] returns of them.
    #[inline(always)]
    pub(crate) fn measure(self, [values, slacks, terms]: [&[f64]; 3], to: &mut [f64]) {
        let rows = to.iter_mut().zip(values).zip(slacks).zip(terms);
        let no = |passes: bool| if passes { 0.0 } else { 1.0 };
        match self {
            Self::Bound => rows.for_each(|(((to, v), s), _)| *to = v.abs() + s),
            Self::Relative => rows.for_each(|(((to, v), s), terms)| {
                // What overflows is infinite, since the least of ∞ and NaN is ∞.
                let quotient = f64::INFINITY.min((v.abs() + s) / terms);
                *to = match *terms {
                    0.0 => 0.0,
                    f64::INFINITY => f64::INFINITY,
                    _ => quotient,
                }
            }),
            Self::NotPositive => rows.for_each(|(((to, v), s), _)| *to = no(v - s > SIGNED)),
            Self::NotNegative => rows.for_each(|(((to, v), s), _)| *to = no(-v - s > SIGNED)),
        }
    }

    /// Returns the measure of one row.
    #[inline(always)]
    pub(crate) fn of_row(self, [value, slack, terms]: [f64; 3]) -> f64 {
        let mut to = [0.0];
        self.measure([&[value], &[slack], &[terms]], &mut to);
        to[0]
    }
}

/// A sum that is nearer to 0 has no sign: all that underflow takes from it is far less.
const SIGNED: f64 = 1e-300;

/// Returns an entry of `z` from that of `x`, or of `r` from Ω's and that of `−x`.
pub(crate) fn recovered<T: Scalar>(omega: T, x: T, gamma: T) -> T {
    omega * (x.abs() + x) / gamma
}

/// A sum of products in twice the digits of double precision, and the moduli of its terms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExactSum {
    /// The sum in double precision.
    high: f64,
    /// The sum of the errors of all roundings in it.
    low: f64,
    /// The sum of the moduli of these errors, those of a product and its addition taken together.
    errors: f64,
    terms: f64,
    count: f64,
}

impl ExactSum {
    /// Returns the sum of one number.
    #[inline(always)]
    pub(crate) fn new(first: f64) -> Self {
        Self { high: first, low: 0.0, errors: 0.0, terms: first.abs(), count: 1.0 }
    }

    /// Adds `a·b`.
    #[inline(always)]
    pub(crate) fn add(&mut self, a: f64, b: f64) {
        // p + e = ab exactly, by a fused operation.
        let product = a * b;
        let of_product = a.mul_add(b, -product);
        // s + t = h + p exactly (D. E. Knuth's TwoSum).
        let sum = self.high + product;
        let moved = sum - self.high;
        let of_sum = (self.high - (sum - moved)) + (product - moved);
        self.high = sum;
        let lost = of_product + of_sum;
        self.low += lost;
        self.errors += lost.abs();
        self.terms += product.abs();
        self.count += 1.0;
    }

    /// Returns the sum, rounded, how far the exact one is from it at most, and the sum of its
    /// terms' moduli. Only the errors are rounded: when the two of a term are added, at most by
    /// half an ε of the result, and when they are summed.
    #[inline(always)]
    pub(crate) fn around(&self) -> [f64; 3] {
        let value = self.high + self.low;
        let slack = (2.0 * self.count + 4.0) * f64::EPSILON * self.errors;
        [value, 2.0 * f64::EPSILON * value.abs() + slack, self.terms]
    }
}

/// A question to the exact residual of operators whose rows are known.
pub(crate) struct ExactRows<'a, T> {
    pub(crate) question: Question,
    pub(crate) rows: [RowsOf<'a, T>; 2],
    pub(crate) sign: T,
    pub(crate) q: &'a [T],
    pub(crate) x: &'a [T],
    pub(crate) omega: Coefficients<'a, T>,
    pub(crate) gamma: T,
    pub(crate) meter: Meter,
}

impl<T: Scalar> ExactRows<'_, T> {
    /// Sums the squares of the answers of all rows.
    pub(crate) fn sum(self) -> Part {
        SUM.of::<Sum<T>>()(self)
    }

    #[inline(always)]
    fn sum_here(self) -> Part {
        let Self { question, rows: [mut a, mut b], sign, q, x, omega, gamma, meter } = self;
        let with = |mut sum: ExactSum, entry: T, value: T| {
            sum.add(entry.wide(), value.wide());
            sum
        };
        let mut part = Part::default();
        for (i, &q) in q.iter().enumerate() {
            let sum = ExactSum::new((sign * q).wide());
            let sum = a.fold(i, sum, |sum, j, a| with(sum, a, recovered(T::one(), x[j], gamma)));
            let sum =
                b.fold(i, sum, |sum, j, b| with(sum, -b, recovered(omega.entry(j), -x[j], gamma)));
            part.see(meter, question.of_row(sum.around()));
        }
        part
    }
}

type Sum<T> = fn(ExactRows<'_, T>) -> Part;

static SUM: Compiled<Sum<f32>, Sum<f64>> = Compiled(sum, sum);

fn sum<T: Scalar>(rows: ExactRows<'_, T>) -> Part {
    vectorised(
        Arch::new(),
        #[inline(always)]
        || rows.sum_here(),
    )
}
