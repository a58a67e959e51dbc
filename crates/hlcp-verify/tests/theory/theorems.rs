//! Theorems 1 and 2 with each hypothesis violated alone, where they fail; `sizes.rs` has the
//! properties.

use crate::common::{noise, posed};
use crate::distance_left;
use hlcp_core::{Aor, FivePoint, Hlcp, Omega, Scalar};
use hlcp_verify::{
    Convergence, Planted, Proof,
    classes::{Answer, Failure},
    convergence, theorem_1, theorem_2,
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

/// α far above the bound of (16), all else in order: the iteration runs away.
#[test]
fn far_above_the_bound_sor_diverges() {
    let a = dmatrix![4.0, -1.0; -1.0, 4.0];
    let p = Planted::new(a.clone(), a, &[1.0, -2.0], dvector![1.0, 1.0], 1.0);
    let steps = [Aor::new(2.5, 2.5).unwrap()];
    let hypotheses = theorem_2(&posed(&p.dense), &steps);
    assert!(hypotheses.signs_and_sizes.is_yes() && hypotheses.omega.is_yes());
    assert!(matches!(hypotheses.alpha, Answer::No(Failure::Radius(_))));
    assert!(distance_left(&p, &steps) > 1.0);
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
    assert!(distance_left(&p, &steps) > 0.05);
}

/// Steps that neither Theorem 2 nor Corollary 1 is about are proved by the relaxed theorem.
#[test]
fn theorem_2_is_said_of_its_own_steps_alone() {
    let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0]).unwrap();
    let problem = Hlcp::new(a, a, Omega::Uniform(1.0)).unwrap();
    let (gs, red_black) = (Aor::gauss_seidel(), Aor::gauss_seidel().red_black(4).unwrap());
    for (steps, theorem) in [
        (vec![gs], true),
        (vec![gs.backward()], true),
        (vec![gs, gs.backward()], true),
        (vec![red_black, red_black.backward()], true),
        (vec![gs, gs], false),
        (vec![gs, gs.backward(), gs], false),
        (vec![gs.backward(), red_black], false),
        (vec![gs.accelerated()], false),
    ] {
        assert_eq!(theorem_2(&problem, &steps).applies(), theorem, "{steps:?}");
        let Convergence::Proved(proof, _) = convergence(&problem, &steps) else { panic!() };
        let expected = if theorem { Proof::Theorem2 } else { Proof::Relaxed };
        assert_eq!(proof, expected, "{steps:?}");
    }
}

/// Grids with random diagonals at the paper's own τ = 1, where Ω = D_A D_B⁻¹ must not come out half
/// a unit in the last place too small in any row.
#[test]
fn theorem_2_holds_at_tau_1_whatever_the_diagonals() {
    fn holds<T: Scalar>(seed: usize) {
        let random = |k: usize, low: f64, high: f64| {
            low + (high - low) * 0.5 * (1.0 + noise(1000 * k + seed))
        };
        let a = FivePoint::from_fn(8, 8, |i, j| {
            [-1.0, -1.0, random(8 * j + i, 4.5, 9.0), -1.0, -1.0].map(T::of)
        });
        let b = FivePoint::from_fn(8, 8, |i, j| {
            // |bᵢⱼ|ωⱼ is at most 0.9 |aᵢⱼ| = 0.9, as ω is at most 9.
            let off = -random(64 + 8 * j + i, 0.0, 0.1);
            [0.0, off, random(128 + 8 * j + i, 1.0, 2.0), off, 0.0].map(T::of)
        });
        let (a, b) = (a.unwrap(), b.unwrap());
        let problem = Hlcp::from_pair(a, b).unwrap();
        let theorem = theorem_2(&problem, &[Aor::gauss_seidel()]);
        assert!(theorem.applies(), "seed {seed}: {theorem:?}");
    }
    for seed in 0..1000 {
        holds::<f64>(seed);
        holds::<f32>(seed);
    }
}
