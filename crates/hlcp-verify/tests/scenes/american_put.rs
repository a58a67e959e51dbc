//! The American put is its time steps, and has the published price.

use crate::{
    common::{assembled, from, problem, scattered},
    proved,
};
use approx::assert_abs_diff_eq;
use hlcp_core::{Aor, LinearOperator, Scalar};
use hlcp_methods::{Mms, Solver};
use hlcp_verify::{AmericanPut, Proof};
use nalgebra::{DMatrix, DVector};

/// QuantLib's example of an American option, in units of its strike, on a coarse grid.
const PUT: AmericanPut =
    AmericanPut { rate: 0.06, volatility: 0.2, maturity: 1.0, m: 16, steps: 40 };

/// The `z` of every LCP in turn, and the iterations they took; from the last answer, or each from
/// the same start.
fn marched<T: Scalar>(put: AmericanPut, warm: bool) -> (Vec<Vec<T>>, usize) {
    let (a, b) = put.pose::<T>().unwrap();
    let start = vec![T::one(); a.order()];
    let (mut x, mut q) = (start.clone(), start);
    let mut solver = Solver::new(Mms::new(problem(1.0, a, b), Aor::gauss_seidel()).unwrap());
    let (mut values, mut iterations) = (vec![], 0);
    for k in 0..put.lcps() {
        put.q(k, solver.z(), &mut q);
        let outcome = solver.solve(&q, from(&x)).unwrap();
        assert!(outcome.converged(), "{k}: {outcome}");
        iterations += outcome.iterations;
        if warm {
            x.copy_from_slice(solver.x());
        }
        values.push(solver.z().to_vec());
    }
    (values, iterations)
}

fn price(put: AmericanPut, spot: f64) -> f64 {
    let (values, _) = marched::<f64>(put, true);
    put.price(values.last().expect("a step or more"), spot)
}

/// `A z⁺ − r + q = 0` is the step's inequality for `u = g + z`, with `L` assembled from its
/// differences.
#[test]
fn each_lcp_is_its_time_step() {
    let put = AmericanPut { rate: 0.07, volatility: 0.5, maturity: 0.8, m: 3, steps: 5 };
    let (a, b) = put.pose::<f64>().unwrap();
    let n = a.order();
    assert_eq!(assembled::<f64>(&b), DMatrix::identity(n, n));
    let (k, s) = (2.0 * 0.07 / 0.25_f64, 0.5 * 0.8_f64.sqrt());
    let h = s / 3.0;
    let step = s * s / 2.0 / 5.0;
    // The grid reaches to where the perpetual put is exercised; the strike is a point.
    let below = (f64::ln((k + 1.0) / k) / h).ceil();
    let g = |i: usize| (1.0 - f64::exp((i as f64 - below) * h)).max(0.0);
    let l = DMatrix::from_fn(n, n + 2, |i, j| match j as isize - i as isize - 1 {
        -1 => -1.0 / (h * h) + (k - 1.0) / (2.0 * h),
        0 => 2.0 / (h * h) + k,
        1 => -1.0 / (h * h) - (k - 1.0) / (2.0 * h),
        _ => 0.0,
    });
    assert!(put.lcps() == 7 && n as f64 > below + 6.0 * 3.0);
    let (old, new) = (scattered(n, 12.9898), scattered(n, 78.233));
    let u = |z: &[f64]| {
        let inside = |i: usize| if (1..=n).contains(&i) { z[i - 1] } else { 0.0 };
        DVector::from_fn(n + 2, |i, _| g(i) + inside(i))
    };
    let inner = |u: &DVector<f64>| u.rows(1, n).into_owned();
    let (before, after) = (u(&old), u(&new));
    let (mut q, mut az) = (vec![f64::NAN; n], vec![0.0; n]);
    a.apply(&new, &mut az);
    for lcp in 0..7 {
        put.q(lcp, &old, &mut q);
        let implicit = inner(&after) - inner(&before) + &l * &after * (step / 2.0);
        let explicit = if lcp < 4 { DVector::zeros(n) } else { &l * &before * (step / 2.0) };
        let r = DVector::from_vec(az.clone()) + DVector::from_vec(q.clone());
        let rounding = 32.0 * f64::EPSILON * (1.0 + step * l.amax()) * 2.0;
        assert!((r - implicit - explicit).amax() <= rounding);
    }
}

/// The errors fall by four when the mesh is halved and the steps are quartered; extrapolated, the
/// price is that of QuantLib's example of an American option (spot 36, strike 40, 6 %, 20 %, one
/// year).
#[test]
fn the_price_is_quantlibs() {
    let grid = |m: usize| AmericanPut { m, steps: m * m / 4, ..PUT };
    let [coarse, middle, fine] = [8, 16, 32].map(|m| 40.0 * price(grid(m), 36.0 / 40.0));
    let order = ((middle - coarse) / (fine - middle)).log2();
    assert!((1.5..2.5).contains(&order), "{order}: {coarse} {middle} {fine}");
    let limit = fine + (fine - middle) / 3.0;
    assert_abs_diff_eq!(limit, 4.48667344, epsilon = 1e-4);
}

/// The mean of binomial trees of two successive lengths, the price's error of which is some 1e-5.
fn tree(put: AmericanPut, spot: f64) -> f64 {
    let one = |n: usize| {
        let dt = put.maturity / n as f64;
        let up = (put.volatility * dt.sqrt()).exp();
        let (growth, discount) = ((put.rate * dt).exp(), (-put.rate * dt).exp());
        let p = (growth - 1.0 / up) / (up - 1.0 / up);
        let exercise =
            |level: usize, ups: usize| 1.0 - spot * up.powi(2 * ups as i32 - level as i32);
        let mut value: Vec<f64> = (0..=n).map(|j| exercise(n, j).max(0.0)).collect();
        for level in (0..n).rev() {
            for j in 0..=level {
                let wait = discount * (p * value[j + 1] + (1.0 - p) * value[j]);
                value[j] = wait.max(exercise(level, j));
            }
        }
        value[0]
    };
    (one(1000) + one(1001)) / 2.0
}

#[test]
fn prices_are_those_of_binomial_trees() {
    let puts = [(0.03, 0.45, 0.6, 1.1), (0.09, 0.25, 2.0, 0.95), (0.05, 0.3, 0.25, 1.0)];
    for (rate, volatility, maturity, spot) in puts {
        let put = AmericanPut { rate, volatility, maturity, m: 32, steps: 256 };
        let (grid, tree) = (price(put, spot), tree(put, spot));
        assert_abs_diff_eq!(grid, tree, epsilon = 5e-5);
    }
}

/// Time makes the put dearer and its exercise price lower, down to the perpetual put's; deep in the
/// money it is exercised.
#[test]
fn waiting_gains_with_time() {
    let put = AmericanPut { rate: 0.08, volatility: 0.3, maturity: 3.0, m: 20, steps: 60 };
    let (values, _) = marched::<f64>(put, true);
    let perpetual = 0.08 / (0.08 + 0.5 * 0.09);
    let mut exercise = 1.0;
    for (older, newer) in values.iter().zip(&values[1..]) {
        // As far as two solutions with a residual of 1e-10 are told apart; ‖A⁻¹‖∞ ≤ 1.
        assert!(older.iter().zip(newer).all(|(older, newer)| *newer >= older - 2e-10));
        assert!(put.exercise(newer) <= exercise);
        exercise = put.exercise(newer);
        assert!(exercise >= perpetual * 0.99);
    }
    assert!(exercise < 0.8);
    let last = values.last().expect("60 steps");
    assert_eq!(put.price(last, 0.5), 0.5);
    assert_eq!(put.price(last, 1e9), 0.0);
    assert!(put.price(last, 1.0) > 0.1);
}

#[test]
fn warm_starts_pay() {
    let ((warm, few), (cold, many)) = (marched::<f64>(PUT, true), marched::<f64>(PUT, false));
    assert!(few < many, "{few} {many}");
    let off = warm.iter().flatten().zip(cold.iter().flatten()).map(|(w, c)| (w - c).abs());
    // Each step adds 1e-10 and passes on what it gets.
    assert!(off.fold(0.0, f64::max) <= 42.0 * 2e-10);
}

#[test]
fn single_precision_agrees() {
    let (wide, narrow) = (marched::<f64>(PUT, true).0, marched::<f32>(PUT, true).0);
    let [wide, narrow] = [PUT.price(&wide[41], 0.9), PUT.price(&narrow[41], 0.9)];
    // 42 steps, some four roundings of a residual of unit size each.
    let rounding = 42.0 * 4.0 * f64::from(f32::EPSILON);
    assert_abs_diff_eq!(wide, narrow, epsilon = rounding);
}

#[test]
fn convergence_is_proved() {
    let (a, b) = PUT.pose::<f64>().unwrap();
    let proof = proved(&a, &b, &[Aor::gauss_seidel()]);
    assert!(matches!(proof, Proof::Theorem1 | Proof::Theorem2), "{proof:?}");
}
