//! Theorem 2 and Corollary 1: as a property up to the bound (16) on α, and beyond it.

use crate::common::posed;
use crate::{contracts, radius, stays_away, textbook, theorem_2_pair};
use hlcp_core::Aor;
use hlcp_verify::{
    Convergence, Planted, Proof, alpha_bound,
    classes::{Answer, Failure},
    convergence, relaxed_alpha_bound, theorem_2,
};
use nalgebra::{DMatrix, dmatrix, dvector};
use proptest::prelude::*;

proptest! {
    /// Theorem 2 and Corollary 1 at the edge of (16): one percent below the bound they apply, one
    /// above not.
    #[test]
    fn theorem_2_applies_up_to_the_bound_16(p in theorem_2_pair(0.97), share in 0.1..1.0, two in any::<bool>()) {
        let problem = posed(&p.dense);
        let n = p.z.len();
        let d = DMatrix::from_fn(n, n, |i, j| if i == j { p.dense.a[(i, i)] + p.dense.b[(i, i)] * p.dense.omega[i] } else { 0.0 });
        let g = DMatrix::from_fn(n, n, |i, j| if i == j { p.dense.b[(i, i)] * p.dense.omega[i] } else { p.dense.a[(i, j)].abs() });
        let bound = 1.0 / radius(&(d.try_inverse().unwrap() * g));
        prop_assert!(bound > 1.0);
        let bracket = alpha_bound(&problem);
        let [lower, upper] = bracket.reciprocal();
        prop_assert!(lower <= bound * (1.0 + 1e-12) && bound * (1.0 - 1e-12) <= upper);
        prop_assert!(upper - lower <= 1e-5 * (bound - 1.0));
        let relaxed = relaxed_alpha_bound(&problem).reciprocal();
        prop_assert!((relaxed[0] - lower).abs() <= 1e-5 * (bound - 1.0)); // it is (16) here

        let at = |alpha: f64| {
            let step = Aor::new(alpha, alpha * share).unwrap();
            if two { vec![step, step.backward()] } else { vec![step] }
        };
        prop_assert!(theorem_2(&problem, &at(0.99 * bound)).applies());
        prop_assert!(!theorem_2(&problem, &at(1.01 * bound)).alpha.is_yes());
        let Convergence::Proved(by, contraction) = convergence(&problem, &at(0.99 * bound)) else {
            return Err(TestCaseError::fail("not proved"));
        };
        prop_assert_eq!(by, Proof::Theorem2);
        contracts(&p, &at(0.99 * bound), &contraction.d, contraction.factor)?;
    }

}

/// α far above the bound of (16), all else in order: the iteration runs away.
#[test]
fn far_above_the_bound_sor_diverges() {
    let a = dmatrix![4.0, -1.0; -1.0, 4.0];
    let p = Planted::new(a.clone(), a, &[1.0, -2.0], dvector![1.0, 1.0], 1.0);
    let steps = [Aor::new(2.5, 2.5).unwrap()];
    let hypotheses = theorem_2(&posed(&p.dense), &steps);
    assert!(hypotheses.signs_and_sizes.is_yes() && hypotheses.omega.is_yes());
    assert!(matches!(hypotheses.alpha, Answer::No(Failure::Radius(_))));
    let sor = textbook(&p.dense, &steps[0]);
    let mut x = p.x().map(|x| x + 1e-3);
    (0..80).for_each(|_| x = sor.step(&x));
    assert!((x - p.x()).amax() > 1.0);
}

/// Theorem 2 without 0 < β: β = −3.6. TMAOR does not converge.
#[test]
fn without_a_positive_beta_tmaor_stays_away() {
    let (a, b) = (dmatrix![1.85, 1.9; 1.5, 2.95], dmatrix![1.27, 0.68; 0.19, 1.33]);
    let p = Planted::new(a, b, &[0.3, 0.3], dvector![2.3, 2.5], 1.0);
    let steps = [Aor::new(0.95, -3.6).unwrap(), Aor::new(0.95, -3.6).unwrap().backward()];
    let theorem = theorem_2(&posed(&p.dense), &steps);
    assert!(theorem.a_is_h_plus.is_yes() && theorem.b_is_h_plus.is_yes());
    assert!(theorem.signs_and_sizes.is_yes() && theorem.omega.is_yes() && theorem.alpha.is_yes());
    assert!(matches!(theorem.parameters, Answer::No(Failure::Parameter(_))));
    assert!(stays_away(&p, &steps));
}
