//! Hypotheses that cannot be dropped: pairs that violate one of them alone, and what goes wrong.

use crate::common::posed;
use hlcp_verify::{
    AorStep, Planted,
    classes::{Answer, Failure},
    oracle::aor_splitting,
    theorem_1, theorem_2,
};
use nalgebra::{dmatrix, dvector};

/// Whether 200 iterations of the textbook steps end away from the solution of `p`, having started 0.3 from it.
fn stays_away(p: &Planted, steps: &[AorStep]) -> bool {
    let mut x = p.x().map(|x| x + 0.3);
    for _ in 0..200 {
        for step in steps {
            let of = |matrix| aor_splitting(matrix, step.a, step.backward);
            x = p.dense.mms(of(&p.dense.a), of(&p.dense.b)).step(&x);
        }
    }
    (x - p.x()).amax() > 0.05
}

/// Theorem 1 without the sizes of (II): |b₂₁|ω₁ = 8.0 > |a₂₁|. Two solutions.
#[test]
fn without_the_sizes_of_ii() {
    let (a, b) = (dmatrix![1.6, 1.2; 2.65, 2.2], dmatrix![2.0, 0.54; 4.1, 1.83]);
    let p = Planted::new(a, b, &[-7.02, -4.34], dvector![1.95, 1.55], 1.0);
    let theorem = theorem_1(&posed(&p.dense), &[AorStep::new(0.55, 0.41)]);
    assert!(theorem.a_is_h_plus.is_yes() && theorem.b_is_h_plus.is_yes());
    assert!(theorem.compatible.is_yes() && theorem.omega.is_yes());
    assert_eq!(theorem.signs_and_sizes, Answer::No(Failure::Entry { row: 1, column: 0 }));
    assert!(p.dense.solutions().len() > 1);
}

/// Theorem 1 without (8): Ω too small. Two solutions.
#[test]
fn without_condition_8() {
    let (a, b) = (dmatrix![1.3, 1.15; 1.15, 1.3], dmatrix![0.46, 0.025; 0.65, 0.115]);
    let p = Planted::new(a, b, &[3.8, 1.1], dvector![0.7, 2.25], 1.0);
    let theorem = theorem_1(&posed(&p.dense), &[AorStep::new(0.85, 0.3)]);
    assert!(theorem.a_is_h_plus.is_yes() && theorem.b_is_h_plus.is_yes());
    assert!(theorem.compatible.is_yes() && theorem.signs_and_sizes.is_yes());
    assert!(matches!(theorem.omega, Answer::No(_)));
    assert!(p.dense.solutions().len() > 1);
}

/// Theorem 1 without (I): β = 8.2 above α = 0.9. MAOR does not converge.
#[test]
fn without_compatible_splittings() {
    let (a, b) = (dmatrix![3.8, 1.75; -1.95, 3.5], dmatrix![4.8, 0.58; -0.85, 2.3]);
    let p = Planted::new(a, b, &[4.6, 0.2], dvector![1.95, 1.8], 1.0);
    let steps = [AorStep::new(0.9, 8.2)];
    let theorem = theorem_1(&posed(&p.dense), &steps);
    assert!(theorem.a_is_h_plus.is_yes() && theorem.b_is_h_plus.is_yes());
    assert!(theorem.signs_and_sizes.is_yes() && theorem.omega.is_yes());
    assert_eq!(theorem.compatible, Answer::No(Failure::Entry { row: 1, column: 0 }));
    assert!(stays_away(&p, &steps));
}

/// Theorem 2 without 0 < β: β = −3.6. TMAOR does not converge.
#[test]
fn without_a_positive_beta() {
    let (a, b) = (dmatrix![1.85, 1.9; 1.5, 2.95], dmatrix![1.27, 0.68; 0.19, 1.33]);
    let p = Planted::new(a, b, &[0.3, 0.3], dvector![2.3, 2.5], 1.0);
    let steps = [AorStep::new(0.95, -3.6), AorStep::new(0.95, -3.6).backward()];
    let theorem = theorem_2(&posed(&p.dense), &steps);
    assert!(theorem.a_is_h_plus.is_yes() && theorem.b_is_h_plus.is_yes());
    assert!(theorem.signs_and_sizes.is_yes() && theorem.omega.is_yes() && theorem.alpha.is_yes());
    assert!(matches!(theorem.parameters, Answer::No(Failure::Parameter(_))));
    assert!(stays_away(&p, &steps));
}
