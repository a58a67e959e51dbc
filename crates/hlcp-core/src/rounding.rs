//! How far rounding reaches into a residual, and residuals without it.

use std::ops::Range;

use crate::{
    Coefficients, Hlcp, LinearOperator, Norms, Rhs, Scalar,
    kernel::Sweep,
    norms::{Meter, Part, Tallies, Totals},
    problem::halves,
    rows::Source,
    view::beyond,
};

/// Bits of an index that probes of an operator without rows tell apart, so that of any two terms
/// of a row nearby some probe adds the moduli.
const BITS: usize = 6;

/// Roundings that are assumed of a row of an operator without rows, in units of ε times the root of
/// the sum of its squared terms.
const ASSUMED: f64 = 2.0;

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Hlcp<T, A, B> {
    /// Returns bounds on the rounding in the norms of `A z − B r + q` at the `z` and `r` that
    /// [`solution_from_x`](Self::solution_from_x) makes of `x`, however the residual is evaluated
    /// in `T`.
    ///
    /// An entry of the residual sums `k` terms. Evaluated in any order it is within
    /// `(k + 8) ε (|q| + |A|z + |B|r)` of its exact value, recovery included (Higham, *Accuracy and
    /// Stability of Numerical Algorithms*, §3.1, with ε twice the unit roundoff). Where an
    /// operator does not know its rows
    /// ([`try_visit_row`](LinearOperator::try_visit_row)) the result is an estimate from products
    /// with random signs. Infinite or NaN where the terms overflow.
    ///
    /// # Cost
    ///
    /// For constant five-point operators one pass over `x`, otherwise a walk over all rows;
    /// seven products with each operator if it has no rows, with `2n` numbers of `scratch`.
    ///
    /// # Panics
    ///
    /// Unless `q` and `x` have length `n`.
    ///
    /// ```
    /// use hlcp_core::{Hlcp, Identity, Omega, Rhs};
    ///
    /// let identity = Identity { order: 1 };
    /// let problem = Hlcp::new(identity, identity, Omega::Uniform(1.0))?;
    /// // At z = 2e16 the residual 2e16 − r + 1 is known to within a few units, no better.
    /// let rounding = problem.rounding(&Rhs::new(&[1.0])?, &[1e16], &mut vec![]);
    /// assert!((4.0..100.0).contains(&rounding.linf));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn rounding(&self, q: &Rhs<'_, T>, x: &[T], scratch: &mut Vec<T>) -> Norms {
        self.assert_orders([q.entries().len(), x.len()]);
        let epsilon = T::epsilon().wide();
        let tiny = T::min_positive_value().wide() * epsilon;
        // What underflows counts as well, but a sum of zeros is exact.
        let unit = |terms: f64| if terms == 0.0 { 0.0 } else { epsilon * terms + tiny };
        // An entry that overflows does not show in the terms where its column is zero.
        let overflows = |(j, &x)| !(self.z_entry(x) + self.r_entry(j, x)).is_finite();
        if self.any(x.iter().enumerate().any(overflows)) {
            return Norms { l2: f64::INFINITY, linf: f64::INFINITY };
        }
        if let Some(rows) = self.sweep().and_then(|sweep| sweep.row_sums()) {
            let ([z, r], q) = (self.factor_norms(x), q.norms());
            let bound = |of: fn(Norms) -> f64| {
                (10.0 + 8.0) * unit(of(q) + rows[0] * of(z) + rows[1] * of(r))
            };
            return Norms { l2: bound(|norms| norms.l2), linf: bound(|norms| norms.linf) };
        }
        let meter = q.meter(T::one());
        let bound = |sums: &Sums, count: f64| (count + 8.0) * unit(sums.terms);
        match self.sum_rows(q, x, meter, bound) {
            Some(sum) => meter.norms_of(sum, T::one()),
            None => self.estimated_rounding(q, x, scratch),
        }
    }

    /// Returns the norms of `(|x| + x)/γ` and `Ω(|x| − x)/γ`, which `A` and `B` multiply: of the
    /// `z` and `r` that [`solution_from_x`](Self::solution_from_x) makes of `x`, after an exchange
    /// of `r` and `z`.
    ///
    /// # Panics
    ///
    /// Unless `x` has length `n`.
    ///
    /// ```
    /// use hlcp_core::{Hlcp, Identity, Omega};
    ///
    /// let identity = Identity { order: 2 };
    /// let problem = Hlcp::new(identity, identity, Omega::Uniform(1.5))?;
    /// let [z, r] = problem.factor_norms(&[1.0, -2.0]);
    /// assert_eq!((z.l2, r.l2), (2.0, 6.0));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn factor_norms(&self, x: &[T]) -> [Norms; 2] {
        self.assert_orders([x.len()]);
        let norms = |entry: &(dyn Fn(usize) -> T + Sync)| {
            self.measured_entries(|at, entries| {
                at.zip(entries).for_each(|(k, to)| *to = entry(k));
            })
        };
        [norms(&|k| self.z_entry(x[k])), norms(&|k| self.r_entry(k, x[k]))]
    }

    /// Returns upper bounds on the exact norms of `A z − B r + q` at the `z` and `r` that
    /// [`solution_from_x`](Self::solution_from_x) makes of `x`, or `None` if an operator does not
    /// know its rows.
    ///
    /// Evaluated in twice the digits of double precision, so that the bounds exceed the exact
    /// norms by about one part in 10¹⁵ only (T. Ogita, S. M. Rump and S. Oishi, *Accurate sum and
    /// dot product*, SIAM J. Sci. Comput. 26, 2005). NaN where a product overflows.
    ///
    /// # Cost
    ///
    /// A walk over all rows with about thirty operations per entry; no storage.
    ///
    /// # Panics
    ///
    /// Unless `q` and `x` have length `n`.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Identity, Omega, Rhs};
    ///
    /// // At z = (1e16, 1e16) both rows are 1e16 − 1e16 + 0.75; double precision drops 0.75 where
    /// // it is added to 1e16.
    /// let a = FivePoint::new(2, 1, [0.0, -1.0, 1.0, -1.0, 0.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(1.0))?;
    /// let exact = problem.exact_residual(&Rhs::new(&[0.75, 0.75])?, &[5e15, 5e15]);
    /// assert!((exact.expect("rows").linf - 0.75).abs() < 1e-12);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn exact_residual(&self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        let meter = q.meter(T::one());
        let sum = self.sum_rows(q, x, meter, |sums: &ExactSums, count| sums.bound(count))?;
        let n = self.whole_order() as f64;
        // The sum of n squares and its root are rounded, too.
        let Norms { l2, linf } = meter.norms_of(sum, T::one());
        Some(Norms { l2: l2 * (1.0 + (n + 4.0) * f64::EPSILON), linf })
    }

    /// Returns whether no row of the exact residual at `x` exceeds the rounding of its terms in
    /// `T`, so that no iteration in `T` can be expected to reduce it; `None` if an operator does
    /// not know its rows.
    ///
    /// # Cost
    ///
    /// As [`exact_residual`](Self::exact_residual).
    ///
    /// # Panics
    ///
    /// Unless `q` and `x` have length `n`.
    ///
    /// ```
    /// use hlcp_core::{DiagonalMatrix, Hlcp, Identity, Omega, Rhs};
    ///
    /// let third = DiagonalMatrix::new(vec![3.0])?;
    /// let problem = Hlcp::new(third, Identity { order: 1 }, Omega::Uniform(1.0))?;
    /// let q = Rhs::new(&[-1.0])?;
    /// // z is the double next to 1/3
    /// assert_eq!(problem.is_at_rounding(&q, &[1.0 / 6.0]), Some(true));
    /// assert_eq!(problem.is_at_rounding(&q, &[0.17]), Some(false));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn is_at_rounding(&self, q: &Rhs<'_, T>, x: &[T]) -> Option<bool> {
        let epsilon = T::epsilon().wide();
        let is_above = |sums: &ExactSums, count: f64| {
            let within = sums.bound(count) <= (count + 8.0) * epsilon * sums.terms;
            if within { 0.0 } else { 1.0 }
        };
        Some(
            self.sum_rows(q, x, Meter::for_size(1.0, self.whole_order()), is_above)?.largest == 0.0,
        )
    }

    /// Returns the lengths, in the 2-norm, of a typical row of `A` and of `B`: the root mean square
    /// of a product with random signs. Of the operators as they are, also after an exchange.
    ///
    /// # Cost
    ///
    /// One product with `A`, one with `B`; `2n` numbers of `scratch`.
    ///
    /// ```
    /// use hlcp_core::{DiagonalMatrix, Hlcp, Identity, Omega};
    ///
    /// let a = DiagonalMatrix::new(vec![3.0, 4.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(1.0))?;
    /// let [a, b] = problem.row_lengths(&mut vec![]);
    /// assert!((a * a - 12.5).abs() < 1e-12 && (b - 1.0).abs() < 1e-15);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn row_lengths(&self, scratch: &mut Vec<T>) -> [f64; 2] {
        let n = self.order();
        let (signs, product) = halves(scratch, n);
        self.signs(|k, sign| signs[k] = sign);
        [false, true].map(|of_b| {
            self.product(of_b, signs, product);
            self.norms(product).l2 / (self.whole_order() as f64).sqrt()
        })
    }

    /// Gives each of this rank's indices a random sign, the same each time and on any number of
    /// ranks: the top bit of a generator that has come to the index in the whole grid.
    fn signs(&self, mut give: impl FnMut(usize, T)) {
        let (length, [skipped, all]) = match self.strip() {
            Some(strip) => (strip.columns().len(), [strip.columns().start, strip.whole()[0]]),
            None => (self.order(), [0, self.order()]),
        };
        let mut bits = Steps::of(skipped).take(0x9e37_79b9_7f4a_7c15);
        let skip = Steps::of(all - length);
        for row in (0..self.order()).step_by(length) {
            for k in row..row + length {
                bits = Steps::ONE.take(bits);
                give(k, if bits >> 63 == 0 { T::one() } else { -T::one() });
            }
            bits = skip.take(bits);
        }
    }

    /// Measures a vector whose entries are made `of` the sum over each row and the number of its
    /// products; `None` if the rows are not known.
    fn sum_rows<S: RowSum>(
        &self,
        q: &Rhs<'_, T>,
        x: &[T],
        meter: Meter,
        of: impl Fn(&S, f64) -> f64,
    ) -> Option<Part> {
        self.assert_orders([q.entries().len(), x.len()]);
        if let Some(sweep) = self.sweep() {
            return Some(S::over_grids()(&sweep, q, x, meter, &|sums| of(sums, 10.0)));
        }
        let mut sum = Part::default();
        let mut take = |sums: &S, count| sum.see(meter, of(sums, count));
        let sign = self.q_factor() / self.gamma();
        let first = |i: usize| (S::new((sign * q.entries()[i]).wide()), 0.0);
        if let Some([a, b]) = self.known() {
            let (mut a, mut b) = (a.rows(), b.rows());
            for i in 0..x.len() {
                let added = |(mut sums, count): (S, f64), entry: T, value: T| {
                    sums.add(entry.wide(), value.wide());
                    (sums, count + 1.0)
                };
                let sums = a.fold(i, first(i), |sums, j, a| added(sums, a, self.z_entry(x[j])));
                let (sums, count) =
                    b.fold(i, sums, |sums, j, b| added(sums, -b, self.r_entry(j, x[j])));
                take(&sums, count);
            }
            return Some(sum);
        }
        let known = (0..x.len()).all(|i| {
            let (mut sums, mut count) = first(i);
            let known = self.terms(i, x, |entry, value| {
                sums.add(entry.wide(), value.wide());
                count += 1.0;
            });
            take(&sums, count);
            known
        });
        known.then_some(sum)
    }

    /// Calls `visit` with the entries of row `i` of `A` and of `−B`, and with what they multiply;
    /// returns whether the rows are known.
    fn terms(&self, i: usize, x: &[T], mut visit: impl FnMut(T, T)) -> bool {
        self.a().try_visit_row(i, &mut |j, a| visit(a, self.z_entry(x[j])))
            && self.b().try_visit_row(i, &mut |j, b| visit(-b, self.r_entry(j, x[j])))
    }

    /// The entry of `z` that [`solution_from_x`](Self::solution_from_x) makes of `x`; of `r` after
    /// an exchange.
    fn z_entry(&self, x: T) -> T {
        recovered(T::one(), x, self.gamma())
    }

    /// The entry of `r` that [`solution_from_x`](Self::solution_from_x) makes of `x`; of `z` after
    /// an exchange.
    fn r_entry(&self, j: usize, x: T) -> T {
        recovered(self.omega().entry(j), -x, self.gamma())
    }

    /// The rounding as the terms' root mean squares have it, which random signs show.
    fn estimated_rounding(&self, q: &Rhs<'_, T>, x: &[T], scratch: &mut Vec<T>) -> Norms {
        let n = x.len();
        let (part, product) = halves(scratch, n);
        let mut terms = q.norms();
        for of_a in [true, false] {
            let mut largest = Norms { l2: 0.0, linf: 0.0 };
            for probe in 0..=BITS {
                self.signs(|k, sign: T| {
                    let entry = if of_a { self.z_entry(x[k]) } else { self.r_entry(k, x[k]) };
                    let index = self.strip().map_or(k, |strip| strip.index(k));
                    let turned = probe > 0 && (index >> (probe - 1)) & 1 == 1;
                    part[k] = if turned { -sign * entry } else { sign * entry };
                });
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
}

/// `bits ↦ m bits + c`, a number of steps of Knuth's linear congruential generator.
#[derive(Clone, Copy)]
struct Steps(u64, u64);

impl Steps {
    const ONE: Self = Self(6_364_136_223_846_793_005, 1_442_695_040_888_963_407);

    /// So many steps, by squaring.
    fn of(count: usize) -> Self {
        let (mut all, mut square) = (Self(1, 0), Self::ONE);
        for bit in 0..usize::BITS {
            if count >> bit & 1 == 1 {
                all = Self(square.0.wrapping_mul(all.0), square.take(all.1));
            }
            square = Self(square.0.wrapping_mul(square.0), square.take(square.1));
        }
        all
    }

    fn take(self, bits: u64) -> u64 {
        self.0.wrapping_mul(bits).wrapping_add(self.1)
    }
}

/// An entry of `z` from that of `x`, or of `r` from Ω's and that of `−x`.
fn recovered<T: Scalar>(omega: T, x: T, gamma: T) -> T {
    omega * (x.abs() + x) / gamma
}

/// Measures a vector whose entries are made of the sums over the rows of a grid.
pub(crate) type OverGrids<T, S> =
    fn(&Sweep<'_, T>, &Rhs<'_, T>, &[T], Meter, &dyn Fn(&S) -> f64) -> Part;

/// A sum of products as a walk over one row makes it.
pub(crate) trait RowSum: Copy {
    /// The measure of such sums on grids.
    fn over_grids<T: Scalar>() -> OverGrids<T, Self>;
    /// The sum of one number.
    fn new(first: f64) -> Self;
    /// Adds `a·b`.
    fn add(&mut self, a: f64, b: f64);
}

/// The moduli of the terms of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sums {
    terms: f64,
}

impl RowSum for Sums {
    fn over_grids<T: Scalar>() -> OverGrids<T, Self> {
        T::loops().terms
    }

    fn new(first: f64) -> Self {
        Self { terms: first.abs() }
    }

    #[inline(always)]
    fn add(&mut self, a: f64, b: f64) {
        self.terms += (a * b).abs();
    }
}

/// The terms of a row in twice the digits of double precision, and their moduli.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExactSums {
    high: f64,
    low: f64,
    terms: f64,
}

impl ExactSums {
    /// An upper bound on the modulus of the exact sum of `count` products and the first number.
    fn bound(&self, count: f64) -> f64 {
        let unit = (count + 5.0) * f64::EPSILON;
        let tiny = if self.terms == 0.0 { 0.0 } else { f64::MIN_POSITIVE * f64::EPSILON };
        let value = (self.high + self.low).abs();
        value * (1.0 + 2.0 * f64::EPSILON) + unit * unit * self.terms + 4.0 * count * tiny
    }
}

impl RowSum for ExactSums {
    fn over_grids<T: Scalar>() -> OverGrids<T, Self> {
        T::loops().exact_terms
    }

    fn new(first: f64) -> Self {
        Self { high: first, low: 0.0, terms: first.abs() }
    }

    /// Adds the product and its error, both without rounding, to the sum and its error.
    #[inline(always)]
    fn add(&mut self, a: f64, b: f64) {
        let (product, of_product) = exact_product(a, b);
        let (sum, of_sum) = exact_sum(self.high, product);
        self.high = sum;
        self.low += of_product + of_sum;
        self.terms += product.abs();
    }
}

/// Returns the rounded sum and its error (D. E. Knuth's TwoSum).
#[inline(always)]
fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// Returns the rounded product and its error (T. J. Dekker's TwoProduct); NaN beyond 2⁹⁹⁶.
#[inline(always)]
fn exact_product(a: f64, b: f64) -> (f64, f64) {
    let halves = |v: f64| {
        // 2²⁷ + 1 splits 53 digits into two halves of 26.
        let shifted = 134_217_729.0 * v;
        let high = shifted - (shifted - v);
        (high, v - high)
    };
    let (product, (a_high, a_low), (b_high, b_low)) = (a * b, halves(a), halves(b));
    let error = a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low);
    (product, error)
}

/// Points of a row of the grid that are summed side by side.
const STRETCH: usize = 64;

impl<T: Scalar> Sweep<'_, T> {
    /// Measures a vector whose entries are made `of` the sum over each row.
    pub(crate) fn sum_terms<S: RowSum>(
        &self,
        q: &Rhs<'_, T>,
        x: &[T],
        meter: Meter,
        of: &dyn Fn(&S) -> f64,
    ) -> Part {
        let ([nx, ny], [gamma, q_factor]) = (self.grid(), self.factors());
        let sign = q_factor / gamma;
        let z_entry = |x: T| recovered(T::one(), x, gamma);
        let r_entry = |omega: T, x: T| recovered(omega, -x, gamma);
        let ([a, b], stretches) = (self.views(), self.stretches());
        let beside = self.beside(x);
        let (omega, omega_beside) = self.omega();
        let (mut sums, mut entries) = ([S::new(0.0); STRETCH], [0.0; STRETCH]);
        let (mut tallies, mut totals) = (Tallies::new(stretches), Totals::zero());
        for (j, start) in (0..ny).flat_map(|j| (0..nx).step_by(STRETCH).map(move |i| (j, i))) {
            let (from, length) = (j * nx + start, STRETCH.min(nx - start));
            for (sum, &q) in sums.iter_mut().zip(&q.entries()[from..from + length]) {
                *sum = S::new((sign * q).wide());
            }
            let ends = [start == 0, start + length == nx];
            let x_beside = [0, 1].map(|k| beside[k].get(j).copied().filter(|_| ends[k]));
            let z_beside = x_beside.map(|x| Some(z_entry(x?)));
            let r_beside = [0, 1].map(|k| Some(r_entry(*omega_beside[k].get(j)?, x_beside[k]?)));
            let directions = a.directions(nx, j, start, length, x.len());
            for (d, (c, points, neighbours)) in directions.into_iter().enumerate() {
                let z = x[neighbours].iter().map(|&x| z_entry(x));
                add_products(&mut sums[points.start - from..], c, points, T::one(), z);
                if let Some((at, z)) = beyond(d, length, z_beside) {
                    let point = from + at..from + at + 1;
                    add_products(&mut sums[at..], c, point, T::one(), [z].into_iter());
                }
            }
            let directions = b.directions(nx, j, start, length, x.len());
            for (d, (c, points, neighbours)) in directions.into_iter().enumerate() {
                let r = neighbours.map(|k| r_entry(omega.at(k), x[k]));
                add_products(&mut sums[points.start - from..], c, points, -T::one(), r);
                if let Some((at, r)) = beyond(d, length, r_beside) {
                    let point = from + at..from + at + 1;
                    add_products(&mut sums[at..], c, point, -T::one(), [r].into_iter());
                }
            }
            sums.iter().zip(&mut entries).for_each(|(sum, entry)| *entry = of(sum));
            tallies.add(meter, start, &entries[..length]);
            if start + length == nx {
                tallies.take(0..nx).for_each(|(stretch, part)| totals.add(stretch, part));
            }
        }
        totals.sum(self.strip())
    }

    /// The sums of the moduli of a row's coefficients, of `A` and of `B`, if both are constant.
    fn row_sums(&self) -> Option<[f64; 2]> {
        let sum = |row: [T; 5]| row.into_iter().map(|c| c.abs().wide()).sum::<f64>();
        if !self.is_constant() {
            return None;
        }
        let [a, b] = self.views().map(|view| view.constants().map(sum));
        Some([a?, b?])
    }
}

/// Adds `sign·c·value` to the sums, for each of the points.
#[inline(always)]
fn add_products<T: Scalar, S: RowSum>(
    sums: &mut [S],
    c: Coefficients<'_, T>,
    points: Range<usize>,
    sign: T,
    values: impl Iterator<Item = T>,
) {
    let sums = sums.iter_mut().zip(values);
    match c {
        Coefficients::Constant(c) if c == T::zero() => {}
        Coefficients::Constant(c) => {
            sums.for_each(|(sum, value)| sum.add((sign * c).wide(), value.wide()));
        }
        Coefficients::Each(c) => {
            for ((sum, value), &c) in sums.zip(&c[points]) {
                sum.add((sign * c).wide(), value.wide());
            }
        }
    }
}
