//! Theorem 2 beyond its hypotheses, where it fails; `sizes.rs` has the property.

use crate::common::posed;
use crate::{stays_away, textbook};
use hlcp_core::Aor;
use hlcp_verify::{
    Planted,
    classes::{Answer, Failure},
    theorem_2,
};
use nalgebra::{dmatrix, dvector};

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
