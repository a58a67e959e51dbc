//! What is proved by either theorem or by a witness, and how each hypothesis is reported.

use crate::common::{exchanged, permuted, posed, red_black};
use crate::{any_pair, comparison, contracts, distance_left, powers_vanish, textbook};
use hlcp_core::{Aor, Hlcp, Omega};
use hlcp_verify::{
    Convergence, Planted, Proof,
    classes::{Answer, Failure, is_h, is_z},
    convergence,
    oracle::Dense,
    relaxed_alpha_bound, relaxed_theorem, theorem_1, theorem_2,
};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};
use proptest::{collection::vec, prelude::*};

fn steps() -> impl Strategy<Value = Vec<Aor<f64>>> {
    let step = (0.3..1.6, 0.0..1.4, any::<bool>(), any::<bool>()).prop_map(
        |(alpha, share, back, fast)| {
            let step = Aor::new(alpha, alpha * share).unwrap();
            let step = if back { step.backward() } else { step };
            if fast { step.accelerated() } else { step }
        },
    );
    vec(step, 1..3)
}

proptest! {
    /// Whatever is proved holds: the factor, ρ(P₂P₁) < 1, and the elementwise inequality (15); AMMS
    /// included.
    #[test]
    fn what_is_proved_contracts(p in any_pair(3.0), steps in steps()) {
        if let Convergence::Proved(_, contraction) = convergence(&posed(&p.dense), &steps) {
            contracts(&p, &steps, &contraction.weights, contraction.factor)?;
        }
    }

    /// Red–black order is proved as the lexicographic one of sorted rows and columns.
    #[test]
    fn red_black_order_is_proved_as_a_permutation(
        p in any_pair(3.0),
        nx in 1..4_usize,
        steps in steps(),
    ) {
        let order = red_black(p.z.len(), nx);
        let coloured: Vec<_> = steps.iter().map(|step| step.red_black(nx).unwrap()).collect();
        if let Convergence::Proved(_, found) = convergence(&posed(&p.dense), &coloured) {
            let sorted = Planted {
                dense: permuted(&p.dense, &order),
                z: p.z.select_rows(&order),
                r: p.r.select_rows(&order),
            };
            let d: Vec<f64> = order.iter().map(|&i| found.weights[i]).collect();
            contracts(&sorted, &steps, &d, found.factor)?;
            // The factor is the product of max (|N| + |BΩ − A|)d/⟨M⟩d, rounded upwards.
            let d = DVector::from_vec(d);
            let largest = |step: &Aor<f64>| {
                let t = textbook(&sorted.dense, step);
                let new = comparison(&t.linear) * &d - t.modulus.abs() * &d;
                ((t.from_x.abs() + t.from_modulus.abs()) * &d).component_div(&new).max()
            };
            let factor: f64 = steps.iter().map(largest).product();
            prop_assert!((found.factor - factor).abs() <= 1e-9, "{} {factor}", found.factor);
        }
    }

    /// The relaxed theorem says yes exactly when C − max(0, 1 − 1/α)D is an M-matrix, by
    /// powers of the quotient of its parts.
    #[test]
    fn the_relaxed_theorem_is_its_matrix(p in any_pair(3.0), alpha in 0.4..1.6, share in 0.0..1.0) {
        let Dense { a, b, omega, .. } = &p.dense;
        let n = omega.len();
        let bw = b * DMatrix::from_diagonal(omega);
        let d = DMatrix::from_fn(n, n, |i, j| if i == j { a[(i, i)] + bw[(i, i)] } else { 0.0 });
        let g = DMatrix::from_fn(n, n, |i, j| a[(i, j)].abs().max(bw[(i, j)].abs()));
        let product = d.clone().try_inverse().unwrap() * g * f64::max(1.0, alpha);
        let vanish = powers_vanish(&(&product * (1.0 + 1e-9)));
        prop_assume!(vanish == powers_vanish(&(&product * (1.0 - 1e-9))));
        let step = Aor::new(alpha, alpha * share).unwrap();
        let proved = relaxed_theorem(&posed(&p.dense), &[step, step.backward().accelerated()]);
        prop_assert_eq!(proved.is_yes(), vanish);
        // ⟨M⟩ − |N| − |BΩ − A| = 2[C − max(0, 1 − 1/α)D], entry by entry, from the textbook's
        // matrices.
        let c = DMatrix::from_fn(n, n, |i, j| if i == j { a[(i, i)].min(bw[(i, i)]) } else { -a[(i, j)].abs().max(bw[(i, j)].abs()) });
        let right = (c - &d * f64::max(0.0, 1.0 - 1.0 / alpha)) * 2.0;
        for step in [step, step.backward(), step.accelerated()] {
            let t = textbook(&p.dense, &step);
            let left = comparison(&t.linear) - t.modulus.abs() - t.from_x.abs() - t.from_modulus.abs();
            prop_assert!((&left - &right).amax() <= 64.0 * f64::EPSILON * d.amax() * (1.0 + 1.0 / alpha));
        }
    }

    /// Remark 3: HLCP(B, A, −q) with Ω⁻¹ has the solution exchanged, and the relaxed theorem does
    /// not change, nor does it of the problem that says it is exchanged.
    #[test]
    fn the_exchange_keeps_solutions_and_hypotheses(p in any_pair(2.0)) {
        let exchanged = exchanged(&p.dense);
        prop_assert!((&exchanged.a * &p.r - &exchanged.b * &p.z + &exchanged.q).amax() <= 1e-12 * p.dense.q.amax().max(1.0));
        let problems = [posed(&exchanged), posed(&p.dense).exchanged().unwrap(), posed(&p.dense)];
        let [by_hand, by_word, bound] = problems.map(|problem| relaxed_alpha_bound(&problem).upper);
        let tolerance = 1e-5 * (1.0 - bound).abs().max(1e-9);
        prop_assert!((by_hand - bound).abs() <= tolerance && (by_word - bound).abs() <= tolerance);
    }
}

/// Without H₊: ρ(|C_A|) = 2 and Gauss–Seidel runs away from a problem with a solution.
#[test]
fn without_h_plus_gauss_seidel_may_diverge() {
    let a = dmatrix![1.0, 2.0; 2.0, 1.0];
    let p = Planted::new(a, dmatrix![1.0, 0.0; 0.0, 1.0], &[1.0, 2.0], dvector![1.0, 1.0], 1.0);
    let problem = posed(&p.dense);
    assert!(matches!(is_h(problem.a()), Answer::No(Failure::Radius(lower)) if lower > 1.9));
    let steps = [Aor::gauss_seidel()];
    assert!(matches!(convergence(&problem, &steps), Convergence::NotProved(_)));
    assert!(distance_left(&p, &steps) > 0.5);
}

/// Negative diagonals: the general witness asks for no sign.
#[test]
fn a_witness_needs_no_sign_of_the_diagonal() {
    let minus = dmatrix![-1.0];
    let p = Planted::new(minus.clone(), minus, &[3.0], dvector![1.0], 1.0);
    let Convergence::Proved(by, contraction) =
        convergence(&posed(&p.dense), &[Aor::new(1.0, 0.5).unwrap()])
    else {
        panic!("the step is exact")
    };
    assert_eq!(by, Proof::Witness);
    assert!(contraction.factor < 1e-12);
}

/// Each hypothesis by itself, at its edge.
#[test]
fn each_hypothesis_is_reported_by_itself() {
    let a = dmatrix![4.0, -1.0; -0.5, 3.0];
    let with =
        |b: DMatrix<f64>, omega: f64| Hlcp::new(a.clone(), b, Omega::Uniform(omega)).unwrap();
    let problem = with(a.clone(), 1.0);
    let gauss_seidel = [Aor::gauss_seidel()];
    assert!(theorem_1(&problem, &gauss_seidel).applies());
    assert!(theorem_2(&problem, &gauss_seidel).applies());
    let entry = |row, column| Answer::No(Failure::Entry { row, column });
    // The sign of b₁₀ alone.
    let sign = theorem_1(&with(dmatrix![4.0, -1.0; 0.25, 3.0], 1.0), &gauss_seidel);
    assert_eq!(sign.signs_and_sizes, entry(1, 0));
    assert!(sign.omega.is_yes() && sign.compatible.is_yes());
    let above = theorem_1(&problem, &[Aor::new(1.001, 1.0).unwrap()]);
    assert_eq!(above.compatible, entry(0, 0));
    let of_b = Aor::with_pairs([1.0, 1.0], [1.0, 1.5]).unwrap();
    assert_eq!(theorem_1(&problem, &[of_b]).compatible, entry(1, 0));
    let amgs = theorem_2(&problem, &[gauss_seidel[0].accelerated()]);
    assert!(matches!(amgs.parameters, Answer::No(Failure::Parameter(_))));
    // Zeros that are visited are entries of a Z-matrix.
    assert!(is_z(&dmatrix![1.0, 0.0; -1.0, 1.0]).is_yes());
    // (8): ωb₀₀ = 0.8 < 1 = |a₀₁|, and ωb₁₁ = 0.6 > |a₁₀|, but 0.8·0.6 < 1·0.5.
    let small = theorem_1(&with(a.clone(), 0.2), &gauss_seidel);
    assert!(matches!(small.omega, Answer::No(Failure::Radius(_))) && small.a_is_h_plus.is_yes());
    let jacobi = theorem_2(&problem, &[Aor::new(1.0, 0.0).unwrap()]);
    assert!(
        matches!(jacobi.parameters, Answer::No(Failure::Parameter(_))) && jacobi.alpha.is_yes()
    );
    let two = Aor::with_pairs([1.0, 1.0], [1.0, 0.5]).unwrap();
    assert!(matches!(relaxed_theorem(&problem, &[two]), Answer::No(Failure::Parameter(_))));
    let of_two = convergence(&problem, &[two]);
    assert!(matches!(of_two, Convergence::Proved(Proof::Theorem1, _)), "{of_two}");
}
