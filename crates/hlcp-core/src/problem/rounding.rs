//! How far rounding reaches into a residual, and residuals without it. All of it panics unless `q`
//! and `x` have length `n`.

use super::{Hlcp, halves};
use crate::{
    numbers::{BLOCK, Meter, Norms, Part, Rhs, Scalar},
    operators::{Direction, LinearOperator},
    rows::{ExactRows, ExactSum, Question, recovered},
};

/// Bits of an index that probes of an operator without rows tell apart, so that of any two terms
/// of a row nearby some probe adds the moduli.
const BITS: usize = 6;

/// Above this no product underflows, and neither does the error of its rounding.
const LOST: f64 = 1e-280;

/// Roundings that are assumed of a row of an operator without rows, in units of ε times the root of
/// the sum of its squared terms.
const ASSUMED: f64 = 2.0;

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Hlcp<T, A, B> {
    /// Returns an estimate of the rounding in the norms of `A z − B r + q` at the `z` and `r` that
    /// [`solution_from_x`](Self::solution_from_x) makes of `x`, from products with random signs.
    ///
    /// It serves operators that do not know their rows
    /// ([`try_visit_row`](LinearOperator::try_visit_row)); others have
    /// [`exact_residual`](Self::exact_residual). NaN or infinite where the terms overflow. It takes
    /// seven products with each operator and `2n` numbers of `scratch`.
    #[doc(hidden)]
    pub fn estimated_rounding(&self, q: &Rhs<'_, T>, x: &[T], scratch: &mut Vec<T>) -> Norms {
        self.assert_orders([("q", q.entries().len()), ("x", x.len())]);
        let n = x.len();
        let (part, product) = halves(scratch, n);
        let mut terms = q.norms();
        for of_a in [true, false] {
            let mut largest = Norms { l2: 0.0, linf: 0.0 };
            for probe in 0..=BITS {
                for (k, (part, &x)) in part.iter_mut().zip(x).enumerate() {
                    let entry = if of_a { self.z_entry(x) } else { self.r_entry(k, x) };
                    let index = self.index(k);
                    let turned = probe > 0 && (index >> (probe - 1)) & 1 == 1;
                    *part = if turned == is_negative(index) { entry } else { -entry };
                }
                self.product(!of_a, part, product);
                let norms = self.norms(product);
                // A NaN must survive.
                let larger = |old: f64, new: f64| if new <= old { old } else { new };
                largest = Norms {
                    l2: larger(largest.l2, norms.l2),
                    linf: larger(largest.linf, norms.linf),
                };
            }
            terms = Norms { l2: terms.l2 + largest.l2, linf: terms.linf + largest.linf };
        }
        let unit = ASSUMED * T::epsilon().wide();
        Norms { l2: unit * terms.l2, linf: unit * terms.linf }
    }

    /// Returns the norms of `(|x| + x)/γ` and `Ω(|x| − x)/γ`, which `A` and `B` multiply: of the
    /// `z` and `r` that [`solution_from_x`](Self::solution_from_x) makes of `x`, after an exchange
    /// of `r` and `z`.
    #[doc(hidden)]
    pub fn factor_norms(&self, x: &[T]) -> [Norms; 2] {
        self.assert_orders([("x", x.len())]);
        let (omega, gamma) = (self.omega().coefficients(), self.gamma());
        [true, false].map(|of_z| {
            Meter::measured(1.0, self.whole_order(), |meter| {
                let sum = self.total(&|tally, at| {
                    let mut entries = [T::zero(); BLOCK];
                    let pairs = entries.iter_mut().zip(&x[at.clone()]);
                    if of_z {
                        pairs.for_each(|(z, &x)| *z = recovered(T::one(), x, gamma));
                    } else {
                        pairs.zip(at.clone()).for_each(|((r, &x), k)| {
                            *r = recovered(omega.entry(k), -x, gamma);
                        });
                    }
                    tally.add(meter, &entries[..at.len()]);
                });
                meter.norms_of(sum, T::one())
            })
        })
    }

    /// Returns upper bounds on the exact norms of `A z − B r + q` at the `z` and `r` that
    /// [`solution_from_x`](Self::solution_from_x) makes of `x`, or `None` if an operator does not
    /// know its rows.
    ///
    /// Evaluated in twice the digits of double precision, so that the bounds exceed the exact
    /// norms by about one part in 10¹⁵ only (T. Ogita, S. M. Rump and S. Oishi, *Accurate sum and
    /// dot product*, SIAM J. Sci. Comput. 26, 2005). Zero only where the exact residual is zero,
    /// NaN where a product overflows. It takes about one and a half sweeps of five-point operators,
    /// which threads share, and otherwise a walk over all rows with about fifteen operations per
    /// entry; [`backward_error`](Self::backward_error) and [`has_sign`](Self::has_sign) do too.
    #[doc(hidden)]
    pub fn exact_residual(&self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        let n = self.whole_order() as f64;
        let meter = q.meter(T::one());
        let sum = self.sum_rows(Question::Bound, q, x, meter)?;
        let Norms { l2, linf } = meter.norms_of(sum, T::one());
        // The sum of n squares and its root are rounded, too.
        let exact = Norms { l2: l2 * (1.0 + (n + 4.0) * f64::EPSILON), linf };
        let lost = if linf >= LOST { 0.0 } else { self.lost_products(x) * f64::from_bits(1) };
        // A root that is no whole number would be rounded among the least numbers.
        let l2 = exact.l2 + n.sqrt().ceil() * lost;
        Some(Norms { l2: if l2 > 0.0 { l2.next_up() } else { l2 }, linf: exact.linf + lost })
    }

    /// Returns whether the rows that [`exact_residual`](Self::exact_residual) reads are all that
    /// there is of the operators: of five-point ones, and of those that have their rows in arrays.
    /// The product of another operator may contradict its rows.
    #[doc(hidden)]
    pub fn has_known_rows(&self) -> bool {
        self.sweep().is_ok() || self.on_known_rows(|_| ()).is_some()
    }

    /// Returns the most products of a row that may underflow, or whose error may: each is off by
    /// less than the least positive number.
    fn lost_products(&self, x: &[T]) -> f64 {
        let is_lost = |entry: T, value: T| {
            let (entry, value) = (entry.wide(), value.wide());
            entry != 0.0 && value != 0.0 && (entry * value).abs() < LOST
        };
        let of_row = |i: usize| {
            let mut lost = 0.0;
            let known = self.terms(i, x, |entry, value| {
                lost += f64::from(u8::from(is_lost(entry, value)));
            });
            if known { lost } else { 2.0 * x.len() as f64 }
        };
        if !self.any(x.iter().any(|&x| x != T::zero())) {
            return 0.0;
        }
        if self.strip().is_some() {
            // All products of five points, some of which are with other ranks' numbers.
            return 10.0;
        }
        (0..x.len()).map(of_row).fold(0.0, f64::max)
    }

    /// Returns how much the entries of `A`, `B` and `q` must change, relative to themselves, for
    /// the `z` and `r` that [`solution_from_x`](Self::solution_from_x) makes of `x` to solve the
    /// problem exactly; `None` if an operator does not know its rows.
    ///
    /// This is `maxᵢ |A z − B r + q|ᵢ / (|A| z + |B| r + |q|)ᵢ`: no smaller change does, and this
    /// one does (W. Oettli and W. Prager, *Compatibility of approximate solution of linear
    /// equations with given error bounds for coefficients and right-hand sides*, Numer. Math. 6,
    /// 1964; `z` and `r` are complementary whatever the entries). About ε where rounding is all
    /// that is left. Infinite where an entry overflows; what underflows is taken for 0.
    #[doc(hidden)]
    pub fn backward_error(&self, q: &Rhs<'_, T>, x: &[T]) -> Option<f64> {
        let meter = Meter::for_size(1.0, self.whole_order());
        Some(self.sum_rows(Question::Relative, q, x, meter)?.largest)
    }

    /// Returns whether all entries of F(x) are proved positive, or negative, `z` and `r` being
    /// those that [`solution_from_x`](Self::solution_from_x) makes of `x`; `None` if an operator
    /// does not know its rows.
    ///
    /// Such an `x` bounds a solution from above or below where no entry of `A` and `B` off the
    /// diagonal is positive (`docs/theory.md` §4, *Z-pairs*). An entry within 10⁻³⁰⁰ of 0
    /// has no sign.
    #[doc(hidden)]
    pub fn has_sign(&self, q: &Rhs<'_, T>, x: &[T], positive: bool) -> Option<bool> {
        let meter = Meter::for_size(1.0, self.whole_order());
        let question = if positive { Question::NotPositive } else { Question::NotNegative };
        Some(self.sum_rows(question, q, x, meter)?.largest == 0.0)
    }

    /// Returns the lengths, in the 2-norm, of a typical row of `A` and of `B`: the root mean square
    /// of a product with random signs. Of the operators as they are, also after an exchange.
    #[doc(hidden)]
    pub fn row_lengths(&self, scratch: &mut Vec<T>) -> [f64; 2] {
        let n = self.order();
        let (signs, product) = halves(scratch, n);
        for (k, sign) in signs.iter_mut().enumerate() {
            *sign = if is_negative(self.index(k)) { -T::one() } else { T::one() };
        }
        [false, true].map(|of_b| {
            self.product(of_b, signs, product);
            self.norms(product).l2 / (self.whole_order() as f64).sqrt()
        })
    }

    /// Sums the squares of the answers to a question to each row. `None` if the rows are not known.
    ///
    /// Three ways to the rows, each at least twice as fast as the next: on 128 × 128 points 0.10 ms
    /// by the kernel, 0.49 ms over arrays and 1.01 ms by visits.
    fn sum_rows(&self, question: Question, q: &Rhs<'_, T>, x: &[T], meter: Meter) -> Option<Part> {
        self.assert_orders([("q", q.entries().len()), ("x", x.len())]);
        if let Ok(sweep) = self.sweep() {
            return Some(sweep.exact(question, q, x, meter));
        }
        // An entry that overflows does not show in the residual where its column is zero.
        let overflows = |(j, &x)| !(self.z_entry(x) + self.r_entry(j, x)).is_finite();
        if self.any(x.iter().enumerate().any(overflows)) {
            return Some(Part { sum: f64::INFINITY, largest: f64::INFINITY });
        }
        let (omega, gamma) = (self.omega().coefficients(), self.gamma());
        let sign = self.q_factor() / gamma;
        let q = q.entries();
        let known = self.on_known_rows(|rows| {
            ExactRows { question, rows, sign, q, x, omega, gamma, meter }.sum()
        });
        if known.is_some() {
            return known;
        }
        let mut part = Part::default();
        let known = (0..x.len()).all(|i| {
            let mut sum = ExactSum::new((sign * q[i]).wide());
            let known = self.terms(i, x, |entry, value| sum.add(entry.wide(), value.wide()));
            part.see(meter, question.of_row(sum.around()));
            known
        });
        known.then_some(part)
    }

    /// Calls `visit` with the entries of row `i` of `A` and of `−B`, and with what they multiply;
    /// returns whether the rows are known.
    fn terms(&self, i: usize, x: &[T], mut visit: impl FnMut(T, T)) -> bool {
        self.a().try_visit_row(i, &mut |j, a| visit(a, self.z_entry(x[j])))
            && self.b().try_visit_row(i, &mut |j, b| visit(-b, self.r_entry(j, x[j])))
    }

    /// Returns the index in the whole grid of this rank's unknown `k`.
    #[doc(hidden)]
    pub fn index(&self, k: usize) -> usize {
        self.strip().map_or(k, |strip| strip.index(k))
    }

    /// Returns the entry of `z` that [`solution_from_x`](Self::solution_from_x) makes of `x`; of
    /// `r` after an exchange.
    fn z_entry(&self, x: T) -> T {
        recovered(T::one(), x, self.gamma())
    }

    /// Returns the entry of `r` that [`solution_from_x`](Self::solution_from_x) makes of `x`; of
    /// `z` after an exchange.
    fn r_entry(&self, j: usize, x: T) -> T {
        recovered(self.omega().entry(j), -x, self.gamma())
    }
}

/// Returns whether an index has the random sign −: a bit of its hash, by the last steps of
/// SplitMix64 (G. L. Steele, D. Lea and C. H. Flood, *Fast splittable pseudorandom number
/// generators*, OOPSLA 2014).
fn is_negative(index: usize) -> bool {
    let mut bits = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits >> 63 == 1
}
