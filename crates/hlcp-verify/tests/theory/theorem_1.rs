//! Theorem 1 with each hypothesis violated alone, where it fails; `sizes.rs` has the property.

use crate::common::posed;
use crate::distance_left;
use hlcp_core::Aor;
use hlcp_verify::{
    Convergence, Planted,
    classes::{Answer, Failure, is_h_plus},
    convergence,
    oracle::Dense,
    theorem_1,
};
use nalgebra::{dmatrix, dvector};

/// Theorem 1 without the sizes of (II): |b₂₁|ω₁ = 8.0 > |a₂₁|. Two solutions.
#[test]
fn without_the_sizes_of_ii_there_are_two_solutions() {
    let (a, b) = (dmatrix![1.6, 1.2; 2.65, 2.2], dmatrix![2.0, 0.54; 4.1, 1.83]);
    let p = Planted::new(a, b, &[-7.02, -4.34], dvector![1.95, 1.55], 1.0);
    let theorem = theorem_1(&posed(&p.dense), &[Aor::new(0.55, 0.41).unwrap()]);
    assert!(theorem.a_is_h_plus.is_yes() && theorem.b_is_h_plus.is_yes());
    assert!(theorem.compatible.is_yes() && theorem.omega.is_yes());
    assert_eq!(theorem.signs_and_sizes, Answer::No(Failure::Entry { row: 1, column: 0 }));
    assert!(p.dense.solutions().len() > 1);
}

/// Theorem 1 without (8): Ω too small. Two solutions.
#[test]
fn without_condition_8_there_are_two_solutions() {
    let (a, b) = (dmatrix![1.3, 1.15; 1.15, 1.3], dmatrix![0.46, 0.025; 0.65, 0.115]);
    let p = Planted::new(a, b, &[3.8, 1.1], dvector![0.7, 2.25], 1.0);
    let theorem = theorem_1(&posed(&p.dense), &[Aor::new(0.85, 0.3).unwrap()]);
    assert!(theorem.a_is_h_plus.is_yes() && theorem.b_is_h_plus.is_yes());
    assert!(theorem.compatible.is_yes() && theorem.signs_and_sizes.is_yes());
    assert!(matches!(theorem.omega, Answer::No(_)));
    assert!(p.dense.solutions().len() > 1);
}

/// Theorem 1 without (I): β = 8.2 above α = 0.9. MAOR does not converge.
#[test]
fn without_compatible_splittings_maor_stays_away() {
    let (a, b) = (dmatrix![3.8, 1.75; -1.95, 3.5], dmatrix![4.8, 0.58; -0.85, 2.3]);
    let p = Planted::new(a, b, &[4.6, 0.2], dvector![1.95, 1.8], 1.0);
    let steps = [Aor::new(0.9, 8.2).unwrap()];
    let theorem = theorem_1(&posed(&p.dense), &steps);
    assert!(theorem.a_is_h_plus.is_yes() && theorem.b_is_h_plus.is_yes());
    assert!(theorem.signs_and_sizes.is_yes() && theorem.omega.is_yes());
    assert_eq!(theorem.compatible, Answer::No(Failure::Entry { row: 1, column: 0 }));
    assert!(distance_left(&p, &steps) > 0.05);
}

/// Both matrices are H₊, and there are three solutions: H₊ alone gives no W-property, and nothing
/// is proved.
#[test]
fn two_h_plus_matrices_may_have_three_solutions() {
    let dense = Dense {
        a: dmatrix![1.0, -2.0; 0.0, 1.0],
        b: dmatrix![1.0, 0.0; -2.0, 1.0],
        q: dvector![1.0, -1.0],
        omega: dvector![1.0, 1.0],
        gamma: 1.0,
    };
    let problem = posed(&dense);
    assert!(is_h_plus(problem.a()).is_yes() && is_h_plus(problem.b()).is_yes());
    assert_eq!(dense.solutions().len(), 3);
    let steps = [Aor::gauss_seidel()];
    let signs_and_sizes = theorem_1(&problem, &steps).signs_and_sizes;
    assert_eq!(signs_and_sizes, Answer::No(Failure::Entry { row: 1, column: 0 }));
    assert!(matches!(convergence(&problem, &steps), Convergence::NotProved(_)));
}
