//! The column theorem, in exact rational arithmetic.

use hlcp_core::{Aor, Hlcp, Omega};
use hlcp_verify::{Convergence, Proof, convergence};
use nalgebra::{DMatrix, dmatrix};
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use proptest::{collection::vec, prelude::*};

use crate::{exact::exact, for_all, rational};

/// A pair with signs at random, near the edge of what `v` proves and beyond it.
#[derive(Debug, Clone)]
struct Case {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    v: Vec<f64>,
    omega: Vec<f64>,
    /// SOR in AMMS, or Jacobi's in MMS.
    steps: Vec<Aor<f64>>,
    order: Vec<usize>,
    x: Vec<f64>,
    q: Vec<f64>,
}

fn cases() -> impl Strategy<Value = Case> {
    (1..6_usize, 0..3_u8).prop_flat_map(|(n, kind)| {
        let matrices = (vec(-3..4_i32, 2 * n * n), vec(-1..4_i32, 2 * n), vec(1..4_i32, n));
        let step = (4..13_i32, 4..13_i32, any::<[bool; 4]>(), 1..4_usize);
        let order = Just((0..n).collect::<Vec<_>>()).prop_shuffle();
        let point = (vec(-9..10_i32, n), vec(-9..10_i32, n), vec(3..9_i32, n), order);
        (matrices, vec(step, 1..3), point).prop_map(
            move |((off, slack, v), steps, (x, q, omega, order))| {
                let v: Vec<f64> = v.into_iter().map(f64::from).collect();
                let [a, b] = [0, 1].map(|s| {
                    let mut matrix = DMatrix::from_fn(n, n, |i, j| {
                        let entry = f64::from(off[(s * n + i) * n + j]);
                        // Upper and lower triangles of their own, as diffusion and transport have.
                        if i == j || kind == 1 && (i < j) == (s == 0) { 0.0 } else { entry }
                    });
                    for j in 0..n {
                        let sum: f64 = (0..n).map(|i| v[i] * matrix[(i, j)].abs()).sum();
                        let diagonal = (sum / v[j]).ceil() + f64::from(slack[s * n + j]);
                        matrix[(j, j)] = diagonal.max(1.0);
                    }
                    matrix
                });
                let ratio = |j: usize| a[(j, j)] / b[(j, j)];
                let omega = (0..n).map(|j| match kind {
                    2 => f64::from(omega[j]) / 4.0 * ratio(j),
                    _ => ratio(j),
                });
                let eighths = |k: i32| f64::from(k) / 8.0;
                let step = |(of_a, of_b, flags, nx): (i32, i32, [bool; 4], usize)| {
                    let [fast, back, apart, coloured] = flags;
                    let alphas = [eighths(of_a), eighths(if apart { of_b } else { of_a })];
                    let pair = |alpha: f64| [alpha, if fast { alpha } else { 0.0 }];
                    let step = Aor::with_pairs(pair(alphas[0]), pair(alphas[1])).unwrap();
                    let step = if fast { step.accelerated() } else { step };
                    let step = if back { step.backward() } else { step };
                    if coloured { step.red_black(nx).unwrap() } else { step }
                };
                let steps: Vec<_> = steps.into_iter().map(step).collect();
                let [x, q] = [x, q].map(|of| of.into_iter().map(f64::from).collect());
                Case { omega: omega.collect(), steps, a, b, v, order, x, q }
            },
        )
    })
}

/// A problem, exactly: A, BΩ and q.
#[derive(Debug, Clone)]
pub(crate) struct Exact {
    pub(crate) a: Vec<Vec<BigRational>>,
    pub(crate) w: Vec<Vec<BigRational>>,
    pub(crate) q: Vec<BigRational>,
}

impl Exact {
    fn of([a, b]: [&DMatrix<f64>; 2], omega: &[f64], q: &[f64]) -> Self {
        let n = q.len();
        let of = |matrix: &DMatrix<f64>, omega: &[f64]| {
            let row = |i| (0..n).map(|j| exact(matrix[(i, j)]) * exact(omega[j])).collect();
            (0..n).map(row).collect()
        };
        Self { a: of(a, &vec![1.0; n]), w: of(b, omega), q: rationals(q) }
    }

    /// (A + BΩ)x + (A − BΩ)|x| + q in row `i`.
    pub(crate) fn f(&self, i: usize, x: &[BigRational]) -> BigRational {
        let term = |j: usize| {
            let [a, w] = [&self.a[i][j], &self.w[i][j]];
            (a + w) * &x[j] + (a - w) * x[j].abs()
        };
        (0..x.len()).map(term).fold(self.q[i].clone(), |sum, term| sum + term)
    }

    fn sum(&self, v: &[BigRational], x: &[BigRational]) -> BigRational {
        (0..x.len()).map(|i| &v[i] * self.f(i, x).abs()).sum()
    }

    fn pivot(&self, step: &Aor<f64>, i: usize) -> BigRational {
        let [[of_a, _], [of_b, _]] = step.pairs().map(|pair| pair.map(exact));
        &self.a[i][i] / of_a + &self.w[i][i] / of_b
    }

    /// The step as the paper writes it: `M x⁺ = N x + (BΩ − A)|x| − q`, where `M = D/α` by Jacobi;
    /// and `M x⁺ + (L_BΩ − L_A)|x⁺| = N x + (D_BΩ − D_A − U_BΩ + U_A)|x| − q` with `M = D/α − L` by
    /// SOR.
    fn step(&self, step: &Aor<f64>, x: &[BigRational]) -> Vec<BigRational> {
        let n = x.len();
        let mut rows: Vec<usize> = (0..n).collect();
        rows.sort_by_key(|&i| (0..n).filter(|&j| step.precedes(j, i)).count());
        let mut y = x.to_vec();
        for i in rows {
            let mut right = -&self.q[i];
            for j in 0..n {
                let [a, w] = [&self.a[i][j], &self.w[i][j]];
                let new = step.is_accelerated() && step.precedes(j, i);
                if new {
                    // L has the entries −a and −w, and N has none there.
                    right -= (a + w) * &y[j] + (a - w) * y[j].abs();
                } else {
                    let m = if i == j { self.pivot(step, i) } else { BigRational::zero() };
                    right += (m - a - w) * &x[j] + (w - a) * x[j].abs();
                }
            }
            y[i] = right / self.pivot(step, i);
        }
        y
    }

    /// The least `f` of column `j` with `vⱼ|mⱼ − 2cⱼⱼ| + 2Σ vᵢ|cᵢⱼ| ≤ f vⱼmⱼ`, for A and for BΩ.
    fn factors(&self, v: &[BigRational], m: &BigRational, j: usize) -> [BigRational; 2] {
        [&self.a, &self.w].map(|c| {
            let two = rational(2);
            let others = (0..v.len()).filter(|&i| i != j).map(|i| &v[i] * c[i][j].abs());
            let others: BigRational = others.sum();
            ((m - &two * &c[j][j]).abs() * &v[j] + two * others) / (m * &v[j])
        })
    }

    /// The largest of all columns.
    fn factor(&self, v: &[BigRational], step: &Aor<f64>) -> BigRational {
        let of = |j| self.factors(v, &self.pivot(step, j), j);
        (0..v.len()).flat_map(of).max().expect("a column")
    }
}

fn rationals(numbers: &[f64]) -> Vec<BigRational> {
    numbers.iter().map(|&number| exact(number)).collect()
}

/// The paper's AMSOR and Jacobi multiply `Σ vᵢ|Fᵢ|` by at most the factor of the theorem, wherever
/// this is below 1; and by no more than what `convergence` says, with its own weights.
#[test]
fn steps_contract_the_sum() {
    let (mut below, mut proved) = (0, 0);
    let asked = for_all(2_000, &cases(), |case| {
        let of = Exact::of([&case.a, &case.b], &case.omega, &case.q);
        let (v, mut x) = (rationals(&case.v), rationals(&case.x));
        let first = x.clone();
        let mut all_below = true;
        for step in &case.steps {
            let (factor, before) = (of.factor(&v, step), of.sum(&v, &x));
            x = of.step(step, &x);
            let holds = of.sum(&v, &x) <= &factor * before;
            assert!(holds || factor >= BigRational::one(), "{case:?}");
            all_below &= factor < BigRational::one();
        }
        below += usize::from(all_below);
        let omega = Omega::Each(case.omega.clone());
        let problem = Hlcp::new(case.a.clone(), case.b.clone(), omega).unwrap();
        match convergence(&problem, &case.steps) {
            Convergence::Proved(Proof::Columns, found) => {
                proved += 1;
                let (v, stated) = (rationals(&found.weights), exact(found.factor));
                assert!(v.iter().all(Signed::is_positive) && stated < BigRational::one());
                let factor: BigRational =
                    case.steps.iter().map(|step| of.factor(&v, step)).product();
                // Rounded outward, and not by much.
                assert!(factor <= stated && stated <= factor + exact(1e-12), "{case:?}");
                assert!(of.sum(&v, &x) <= stated * of.sum(&v, &first), "{case:?}");
            }
            // A right witness is looked for first.
            Convergence::Proved(..) | Convergence::NotProved(_) => {}
        }
    });
    println!("{asked} cases: the factor is below 1 in {below}, proved by columns alone {proved}");
    assert!(20 * below > asked && 50 * proved > asked, "{below} and {proved} of {asked}");
}

/// Exact solves multiply it by at most 1 − κ for every Ω, once each row has had its turn, in any
/// order and with rows that come again.
#[test]
fn exact_solves_contract_the_sum_in_any_order() {
    let mut below = 0;
    let asked = for_all(2_000, &cases(), |case| {
        let of = Exact::of([&case.a, &case.b], &case.omega, &case.q);
        let (v, mut x) = (rationals(&case.v), rationals(&case.x));
        let kappas = |j: usize| {
            // The factor of an exact solve has m = 2c.
            let [of_a, of_w] = [&of.a, &of.w].map(|c| rational(2) * &c[j][j]);
            let [a, _] = of.factors(&v, &of_a, j);
            let [_, w] = of.factors(&v, &of_w, j);
            a.max(w)
        };
        let factor = (0..v.len()).map(kappas).max().expect("a column");
        if factor >= BigRational::one() {
            return;
        }
        below += 1;
        let (before, again) = (of.sum(&v, &x), case.order[0]);
        for &i in case.order.iter().chain([&again]) {
            // F grows with xᵢ, so it has one zero there.
            x[i] = BigRational::zero();
            let t = of.f(i, &x);
            let c = if t.is_positive() { &of.w } else { &of.a };
            x[i] = -t / (rational(2) * &c[i][i]);
            assert!(of.f(i, &x).is_zero());
        }
        assert!(of.sum(&v, &x) <= factor * before, "{case:?}");
    });
    assert!(10 * below > asked, "{below} of {asked}");
}

/// The factor is attained, so without its hypotheses, `v` a left witness and α < 2/(2 − κ), the sum
/// may grow: where F is a unit vector of the column that is solved last.
#[test]
fn the_factor_is_attained_and_the_sum_may_grow_without_the_hypotheses() {
    let [mut no_witness, mut large_alpha] = [0; 2];
    for_all(2_000, &cases(), |case| {
        let mut of = Exact::of([&case.a, &case.b], &case.omega, &case.q);
        let (v, n) = (rationals(&case.v), case.v.len());
        let step = &case.steps[0];
        let last = (0..n).max_by_key(|&j| (0..n).filter(|&i| step.precedes(i, j)).count()).unwrap();
        let factors = of.factors(&v, &of.pivot(step, last), last);
        for (k, factor) in factors.iter().enumerate() {
            // So far from 0 that the step stays on its side.
            let mut x = rationals(&case.x);
            x[last] = rational(if k == 0 { 1000 } else { -1000 });
            for i in 0..n {
                let f = of.f(i, &x);
                of.q[i] -= f;
            }
            of.q[last] += BigRational::one();
            let after = of.sum(&v, &of.step(step, &x));
            assert_eq!(after, factor * &v[last], "{case:?}");
            if *factor > BigRational::one() {
                let c = [&of.a, &of.w][k];
                let others: BigRational =
                    (0..n).filter(|&i| i != last).map(|i| &v[i] * c[i][last].abs()).sum();
                let is_witness = others < &v[last] * &c[last][last];
                *(if is_witness { &mut large_alpha } else { &mut no_witness }) += 1;
            }
        }
    });
    assert!(no_witness > 0 && large_alpha > 0, "{no_witness} {large_alpha}");
}

/// One witness for A and another for B are not enough: this problem has two solutions, and an
/// iteration that converged from every start would leave one of them.
#[test]
fn a_witness_for_each_is_not_enough() {
    // ⟨A⟩ᵀ(1, 6) and ⟨B⟩ᵀ(6, 1) are positive.
    let a = dmatrix![1.0, -4.0; -0.125, 1.0];
    let (b, step) = (a.transpose(), Aor::gauss_seidel().accelerated());
    let of = Exact::of([&a, &b], &[1.0; 2], &[5.0, -5.0]);
    // z = (0, 1), r = (1, 0), and z = (30, 8.75), r = 0.
    for x in [[-0.5, 0.5], [15.0, 4.375]] {
        let x = rationals(&x);
        assert_eq!(of.step(&step, &x), x);
    }
    let problem = Hlcp::new(a, b, Omega::Uniform(1.0)).unwrap();
    assert!(matches!(convergence(&problem, &[step]), Convergence::NotProved(_)));
}

/// Only SOR in AMMS and Jacobi's in MMS solve scalar equations: no other step is proved so.
#[test]
fn other_steps_are_not_of_the_theorem() {
    let (a, b, _) = hlcp_verify::Slider { cells: 30 }.pose::<f64>().unwrap();
    let problem = Hlcp::from_pair(&a, &b).unwrap();
    let proved = |step: Aor<f64>| {
        let found = convergence(&problem, &[step, step.backward()]);
        matches!(found, Convergence::Proved(Proof::Columns, _))
    };
    let aor = |alpha, beta| Aor::new(alpha, beta).unwrap();
    assert!(proved(aor(1.0, 1.0).accelerated()) && proved(aor(1.0, 0.0)) && proved(aor(0.6, 0.0)));
    assert!(!proved(aor(1.0, 1.0)) && !proved(aor(1.0, 0.9).accelerated()));
    assert!(!proved(aor(1.0, 0.0).accelerated()) && !proved(aor(1.0, 0.1)));
    // κ is small here: α = 1.1 is beyond 2/(2 − κ).
    assert!(!proved(aor(1.1, 1.1).accelerated()));
}
