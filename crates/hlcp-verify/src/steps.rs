//! The inequality that every proof of convergence comes down to, for one or several AOR steps.

use hlcp_core::{Aor, Hlcp, Rows, Scalar};

use crate::{
    comparison::{merge, visit},
    perron::Comparison,
    rounding::{Doubled, Interval, div_up, mul_down, mul_up},
};

/// How fast a method approaches the solution: one iteration multiplies a distance to it by at most
/// the factor.
///
/// With the weights `v`, the distance is `Σ vᵢ|Fᵢ(x)|` where the column theorem is the
/// [`Proof`](crate::Proof), and else `maxᵢ |xᵢ − xᵢ*|/vᵢ`.
///
/// ```
/// let contraction = hlcp_verify::Contraction { factor: 0.5, weights: vec![1.0, 1.0] };
/// assert_eq!(contraction.iterations(1e-3), Some(10)); // 1/1024
/// assert_eq!(contraction.iterations(0.0), None);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Contraction {
    /// Not less than the factor of one iteration, and below 1.
    pub factor: f64,
    /// The weights, which are positive.
    pub weights: Vec<f64>,
}

impl Contraction {
    /// A number of exact iterations after which the distance is at most `reduction` times what it
    /// was.
    ///
    /// Rounding of the count is accounted for. `None` for more than 2⁵² iterations, and unless
    /// `reduction` is positive.
    pub fn iterations(&self, reduction: f64) -> Option<u64> {
        let enough = |k: u64| power_up(self.factor, k) <= reduction;
        let (mut low, mut high) = (0, 1_u64 << 52);
        if !(reduction > 0.0 && enough(high)) {
            return None;
        }
        while low < high {
            let middle = (low + high) / 2;
            if enough(middle) { high = middle } else { low = middle + 1 }
        }
        Some(high)
    }
}

/// Not less than `base^k`.
fn power_up(base: f64, k: u64) -> f64 {
    let (mut power, mut square, mut k) = (1.0, base, k);
    while k > 0 {
        if k & 1 == 1 {
            power = mul_up(power, square);
        }
        square = mul_up(square, square);
        k >>= 1;
    }
    power
}

/// `D − G = ⟨M⟩ − |N| − |BΩ − A|` of each step.
pub(crate) struct Steps<'a, T, A, B> {
    pub(crate) problem: &'a Hlcp<T, A, B>,
    pub(crate) steps: &'a [Aor<T>],
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Steps<'_, T, A, B> {
    /// Returns not more than `|mᵢᵢ|` in step `k`, and calls `each` with the columns of row `i` and
    /// two sums, not less than the moduli of the entries there: of those that multiply `x⁺` or
    /// `|x⁺|`, and of those that multiply `x` or `|x|`.
    fn entries(&self, k: usize, i: usize, mut each: impl FnMut(usize, [f64; 2])) -> f64 {
        let step = &self.steps[k];
        let pairs = step.pairs().map(|pair| pair.map(T::wide));
        let mut row = vec![];
        merge((self.problem.a(), self.problem.b()), i, &mut row);
        let mut pivot = 0.0;
        for (column, [a, b]) in row {
            let omega = self.problem.omega().entry(column).wide();
            let b = Interval::exactly(b);
            // A missing entry is zero, without the rounding of a product.
            let b_omega = if b.lower == 0.0 { b } else { b.times(omega) };
            let modulus = b_omega.minus(Interval::exactly(a)).magnitude();
            let with_modulus = |part: Interval| (part.magnitude() + modulus).next_up();
            let passed = step.precedes(column, i);
            // M has 1/α of the diagonal and β/α of the triangle that is swept, N the rest.
            let (m, n) = if column == i || passed {
                let part = |[of_a, of_b]: [Interval; 2]| of_a.times(a).plus(of_b.product(b_omega));
                let of_m = pairs
                    .map(|[alpha, beta]| Interval::ratio(if passed { beta } else { 1.0 }, alpha));
                (part(of_m), part(of_m.map(|of| of.minus(Interval::exactly(1.0)))))
            } else {
                (Interval::exactly(0.0), b_omega.plus(Interval::exactly(a)))
            };
            if column == i {
                pivot = m.mignitude();
            }
            let sums = match (passed, step.is_accelerated()) {
                (false, _) => [0.0, with_modulus(n)],
                (true, false) => [m.magnitude(), with_modulus(n)],
                (true, true) => [with_modulus(m), n.magnitude()],
            };
            each(column, sums);
        }
        pivot
    }

    /// The factor of one iteration for the weights `d`; `None` unless it is proved to be below 1.
    pub(crate) fn contraction(&self, d: Vec<f64>) -> Option<Contraction> {
        let mut factor = 1.0;
        for k in 0..self.steps.len() {
            let mut largest = 0.0_f64;
            for (i, &weight) in d.iter().enumerate() {
                let (mut new, mut old) = (Doubled::default(), Doubled::default());
                let pivot = self.entries(k, i, |j, [of_new, of_old]| {
                    new.add(-of_new, d[j]);
                    old.add(of_old, d[j]);
                });
                new.add(pivot, weight);
                let ratio = div_up(old.interval().upper, new.interval().lower);
                let proved = new.interval().lower > 0.0 && (0.0..1.0).contains(&ratio);
                if !proved {
                    return None;
                }
                largest = largest.max(ratio);
            }
            factor = mul_up(factor, largest);
        }
        (factor < 1.0).then_some(Contraction { factor, weights: d })
    }

    /// Returns whether every step is one of the column theorem: SOR in AMMS or Jacobi's in MMS,
    /// with one α or with one each for `A` and `B`.
    pub(crate) fn solve_scalars(&self) -> bool {
        let solves = |step: &Aor<T>| {
            let beta_for = |alpha| if step.is_accelerated() { alpha } else { T::zero() };
            step.pairs().iter().all(|&[alpha, beta]| beta == beta_for(alpha))
        };
        !self.steps.is_empty() && self.steps.iter().all(solves)
    }

    /// The factor of one iteration of such steps for `Σ vᵢ|Fᵢ|`; `None` unless it is proved to be
    /// below 1.
    pub(crate) fn contraction_of_sums(&self, v: Vec<f64>) -> Option<Contraction> {
        // The diagonals, and the sums of vᵢ|cᵢⱼ| off them.
        let mut columns = vec![[(0.0, Doubled::default()); 2]; v.len()];
        for (i, &weight) in v.iter().enumerate() {
            let mut add = |k: usize, j: usize, entry: f64| {
                let (diagonal, sum) = &mut columns[j][k];
                if i == j { *diagonal = entry } else { sum.add(weight, entry.abs()) }
            };
            visit(self.problem.a(), i, |j, a| add(0, j, a));
            visit(self.problem.b(), i, |j, b| add(1, j, b));
        }
        let mut factor = 1.0;
        for step in self.steps {
            let halves = step.pairs().map(|[alpha, _]| Interval::ratio(0.5, alpha.wide()));
            let mut largest = 0.0_f64;
            for (j, (column, &weight)) in columns.iter().zip(&v).enumerate() {
                let omegas = [1.0, self.problem.omega().entry(j).wide()];
                let [a, b] = [0, 1].map(|k| Interval::exactly(column[k].0).times(omegas[k]));
                let pivot = a.product(halves[0]).plus(b.product(halves[1]));
                for (k, diagonal) in [a, b].into_iter().enumerate() {
                    let own = mul_up(weight, pivot.minus(diagonal).magnitude());
                    let others = mul_up(column[k].1.interval().upper, omegas[k]);
                    let ratio = div_up((own + others).next_up(), mul_down(weight, pivot.lower));
                    if !(weight > 0.0 && (0.0..1.0).contains(&ratio)) {
                        return None;
                    }
                    largest = largest.max(ratio);
                }
            }
            factor = mul_up(factor, largest);
        }
        Some(Contraction { factor, weights: v })
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Comparison for Steps<'_, T, A, B> {
    fn order(&self) -> usize {
        self.problem.order()
    }

    fn row(&self, k: usize, i: usize, g: &mut Vec<(usize, f64)>) -> f64 {
        g.clear();
        self.entries(k, i, |j, [new, old]| g.push((j, (new + old).next_up())))
    }
}
