//! Arithmetic whose error is known: what turns a check in floating point into a statement about
//! reals.
//!
//! Every basic operation of IEEE 754 returns a neighbour of the exact result that is nearest to it,
//! also where it underflows, so the exact result lies between the two floating-point numbers beside
//! the computed one. Where it overflows, the infinities and NaN that follow fail every comparison
//! they meet.

use std::cmp::Ordering;

/// Not less than `a b`.
pub(crate) fn mul_up(a: f64, b: f64) -> f64 {
    (a * b).next_up()
}

/// Not more than `a b`.
pub(crate) fn mul_down(a: f64, b: f64) -> f64 {
    (a * b).next_down()
}

/// Not less than `a / b`.
pub(crate) fn div_up(a: f64, b: f64) -> f64 {
    (a / b).next_up()
}

/// Not more than `a / b`.
pub(crate) fn div_down(a: f64, b: f64) -> f64 {
    (a / b).next_down()
}

/// The larger, and NaN if either is; `max` would drop it.
pub(crate) fn larger(x: f64, y: f64) -> f64 {
    if x.is_nan() || x > y { x } else { y }
}

/// A closed interval that holds a real number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Interval {
    pub(crate) fn exactly(value: f64) -> Self {
        Self { lower: value, upper: value }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            lower: (self.lower + other.lower).next_down(),
            upper: (self.upper + other.upper).next_up(),
        }
    }

    pub(crate) fn minus(self, other: Self) -> Self {
        self.plus(Self { lower: -other.upper, upper: -other.lower })
    }

    pub(crate) fn times(self, factor: f64) -> Self {
        let ends = [self.lower * factor, self.upper * factor];
        if ends.iter().any(|end| end.is_nan()) {
            return Self { lower: f64::NAN, upper: f64::NAN };
        }
        Self { lower: ends[0].min(ends[1]).next_down(), upper: ends[0].max(ends[1]).next_up() }
    }

    pub(crate) fn product(self, other: Self) -> Self {
        let [low, high] = [self.times(other.lower), self.times(other.upper)];
        // min and max would drop a NaN.
        if low.lower.is_nan() || high.lower.is_nan() {
            return Self::exactly(f64::NAN);
        }
        Self { lower: low.lower.min(high.lower), upper: low.upper.max(high.upper) }
    }

    /// The quotient of two numbers.
    pub(crate) fn ratio(a: f64, b: f64) -> Self {
        Self { lower: div_down(a, b), upper: div_up(a, b) }
    }

    /// The reciprocal of a positive number; NaN if zero is not excluded.
    pub(crate) fn reciprocal(self) -> Self {
        if self.lower > 0.0 {
            return Self { lower: div_down(1.0, self.upper), upper: div_up(1.0, self.lower) };
        }
        Self::exactly(f64::NAN)
    }

    /// Not less than the modulus.
    pub(crate) fn magnitude(self) -> f64 {
        if self.lower.is_nan() || self.upper.is_nan() {
            return f64::INFINITY; // max would drop the NaN
        }
        self.lower.abs().max(self.upper.abs())
    }

    /// Not more than the modulus.
    pub(crate) fn mignitude(self) -> f64 {
        if self.lower > 0.0 {
            self.lower
        } else if self.upper < 0.0 {
            -self.upper
        } else {
            0.0
        }
    }
}

/// A sum of products in twice the precision, with a bound on its rounding error.
///
/// Errors of products (by a fused multiply–add) and of additions are themselves numbers and are
/// summed beside. For k products T. Ogita, S. Rump and S. Oishi (*Accurate sum and dot product*,
/// SIAM J. Sci. Comput. 26 (2005), Dot2) prove `|v − Σ aᵢxᵢ| ≤ u|Σ aᵢxᵢ| + γ_k² Σ|aᵢxᵢ|`, to which
/// underflow adds 5kη; `u = 2⁻⁵³`, η = 2⁻¹⁰⁷⁴ and `γ_k = ku/(1 − ku)`. With the computed sum `t` of
/// the moduli, γ_k² Σ|aᵢxᵢ| ≤ 1.6 k²u² t for `ku ≤ 1/8`, where `(2ku)² t` is taken, and `2u|v|` for
/// the first term.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Doubled {
    high: f64,
    low: f64,
    moduli: f64,
    terms: f64,
}

impl Doubled {
    #[inline(always)]
    pub(crate) fn add(&mut self, a: f64, x: f64) {
        let product = a * x;
        let lost = a.mul_add(x, -product);
        let sum = self.high + product;
        // Knuth's: what the addition lost, exactly.
        let back = sum - self.high;
        self.low += ((self.high - (sum - back)) + (product - back)) + lost;
        self.high = sum;
        self.moduli += product.abs();
        self.terms += 1.0;
    }

    /// The sum, rounded.
    #[inline(always)]
    pub(crate) fn value(&self) -> f64 {
        self.high + self.low
    }

    #[inline(always)]
    pub(crate) fn interval(&self) -> Interval {
        let value = self.value();
        let tiny = 16.0 * self.terms * f64::from_bits(1);
        let part = self.terms * f64::EPSILON;
        let error = (f64::EPSILON * value.abs() + part * part * self.moduli).next_up() + tiny;
        Interval { lower: (value - error).next_down(), upper: (value + error).next_up() }
    }
}

/// The sign of `Σ aᵢxᵢ`, exactly; `None` where a product underflows or overflows.
///
/// A [`Doubled`] sum decides if it is far from 0. Otherwise the sum is kept as numbers of growing
/// size that do not overlap, which an addition without error joins with each product and with its
/// error; the last has the sign of all (J. R. Shewchuk, *Adaptive precision floating-point
/// arithmetic*, Discrete Comput. Geom. 18 (1997)).
pub(crate) fn sign(terms: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Ordering> {
    let mut sum = Doubled::default();
    terms.clone().for_each(|(a, x)| sum.add(a, x));
    let Interval { lower, upper } = sum.interval();
    if lower > 0.0 || upper < 0.0 {
        return lower.partial_cmp(&0.0);
    }
    let mut parts: Vec<f64> = vec![];
    for (a, x) in terms {
        let product = a * x;
        if product == 0.0 && (a == 0.0 || x == 0.0) {
            continue;
        }
        if !(1e-250..1e290).contains(&product.abs()) {
            return None;
        }
        for mut next in [a.mul_add(x, -product), product] {
            parts.retain_mut(|part| {
                let sum = next + *part;
                let back = sum - next;
                *part = (next - (sum - back)) + (*part - back);
                next = sum;
                *part != 0.0
            });
            if next != 0.0 {
                parts.push(next);
            }
        }
    }
    parts.last().unwrap_or(&0.0).partial_cmp(&0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sign of sums that cancel to nothing or to a last place, beside rational arithmetic.
    #[test]
    fn signs_are_exact() {
        use num_rational::BigRational;
        use num_traits::Zero;
        let exact = |x: f64| BigRational::from_float(x).unwrap();
        let mut seen = [0; 3];
        for k in 1..300 {
            let of = |i: i32| (f64::from(i) / 7.0).exp() * f64::from(i * k % 11 - 5);
            let mut terms: Vec<_> = (0..k % 40).map(|i| (of(i), 0.1 * of(i + 3))).collect();
            // Each product is taken away again, and then a little is left or is not.
            terms.extend(terms.clone().iter().rev().map(|&(a, x)| (-x, a)));
            terms.push((1e-30, f64::from(k % 3 - 1)));
            let truth: BigRational = terms.iter().map(|&(a, x)| exact(a) * exact(x)).sum();
            let order = truth.cmp(&BigRational::zero());
            assert_eq!(sign(terms.iter().copied()), Some(order), "{terms:?}");
            seen[(order as i8 + 1) as usize] += 1;
        }
        assert!(seen.iter().all(|&seen| seen > 50), "{seen:?}");
        // 3·fl(1/3) is below 1 and rounds to 1.
        let third = [(3.0, 1.0 / 3.0), (-1.0, 1.0)];
        assert_eq!(sign(third.into_iter()), Some(Ordering::Less));
        assert_eq!(sign([(0.5, 3.0), (-1.5, 1.0)].into_iter()), Some(Ordering::Equal));
        assert_eq!(sign([(0.0, 2.0)].into_iter()), Some(Ordering::Equal));
        assert_eq!(sign([(1e-200, 1e-200), (1e-200, -1e-200)].into_iter()), None);
        assert_eq!(sign([(f64::NAN, 0.0)].into_iter()), None);
    }

    /// Sums that cancel down to the last place of a double and below, exactly and by `Doubled`.
    #[test]
    fn twice_the_precision_keeps_its_error() {
        use num_rational::BigRational;
        let exact = |x: f64| BigRational::from_float(x).unwrap();
        let mut random = crate::families::Random(1);
        let mut next = || random.real(-1.0, 1.0);
        for scale in [1.0, 1e150, 1e-150, 1e-161] {
            for terms in 1..60 {
                let (mut sum, mut truth, mut size) = (Doubled::default(), exact(0.0), 0.0);
                for _ in 0..terms {
                    let (a, x) = (next() * scale, next() * scale);
                    // Nearly the negative of what there is so far, every third time.
                    let (a, x) = if next() > 0.3 { (-sum.value() / scale, scale) } else { (a, x) };
                    sum.add(a, x);
                    truth += exact(a) * exact(x);
                    size += (a * x).abs();
                }
                let Interval { lower, upper } = sum.interval();
                assert!(exact(lower) <= truth && truth <= exact(upper), "{scale:e} {terms}");
                let narrow = 1e-27 * size + 1e-15 * sum.value().abs() + 1e-300;
                assert!(upper - lower <= narrow, "{scale:e} {terms}: {}", upper - lower);
            }
        }
    }
}
