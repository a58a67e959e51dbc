//! The convergence theorems: as properties at the edge of their hypotheses, and on the paper's examples.

use crate::common::{Matrix, posed};
use hlcp_core::{FivePoint, Hlcp, LinearOperator, Omega};
use hlcp_verify::{
    AorStep, Convergence, Example, Planted, Proof, alpha_bound, certify,
    classes::{Answer, Failure, is_h, is_h_plus, is_m, is_strictly_dominant, is_z},
    convergence,
    oracle::{Dense, Iteration, aor_splitting},
    relaxed_alpha_bound, relaxed_theorem, theorem_1, theorem_2,
};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};
use proptest::{collection::vec, prelude::*};

fn comparison(a: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(
        a.nrows(),
        a.ncols(),
        |i, j| {
            if i == j { a[(i, j)].abs() } else { -a[(i, j)].abs() }
        },
    )
}

/// ρ of a non-negative matrix by its eigenvalues.
fn radius(p: &DMatrix<f64>) -> f64 {
    p.complex_eigenvalues().iter().map(|v| v.norm()).fold(0.0, f64::max)
}

/// The step as the paper writes it.
fn textbook(dense: &Dense, step: &AorStep) -> Iteration {
    if step.accelerated {
        dense.amms(step.a, step.b, step.backward)
    } else {
        let of = |matrix, parameters| aor_splitting(matrix, parameters, step.backward);
        dense.mms(of(&dense.a, step.a), of(&dense.b, step.b))
    }
}

/// A pair under Theorem 2's hypotheses, with ρ[D_A⁻¹|C_A|] = `edge`: sparse, with both signs, badly scaled.
fn theorem_2_pair(edge: f64) -> impl Strategy<Value = Planted> {
    (2..9_usize, 0.5..4.0).prop_flat_map(move |(n, gamma)| {
        let entries = (vec(-1.0..1.0, n * n), vec(0.0..1.0, n * n), vec(-3.0..3.0, 4 * n));
        entries.prop_map(move |(off, share, free): (Vec<f64>, Vec<f64>, Vec<f64>)| {
            let diagonal: Vec<f64> = free[..n].iter().map(|f: &f64| f.exp2()).collect();
            let of_b: Vec<f64> = free[n..2 * n].iter().map(|f| f.exp2()).collect();
            let mut a = DMatrix::from_fn(n, n, |i, j| {
                let ring = j == (i + 1) % n; // keeps the matrix irreducible
                if i == j || off[i * n + j].abs() < 0.5 && !ring { 0.0 } else { off[i * n + j] }
            });
            let d = DMatrix::from_diagonal(&DVector::from_vec(diagonal.clone()));
            let scale = edge / radius(&(d.clone().try_inverse().unwrap() * a.abs()));
            a *= scale;
            let omega = DVector::from_fn(n, |i, _| {
                diagonal[i] / of_b[i] * (1.0 + 1e-9 + free[2 * n + i].max(0.0))
            });
            // Some entries of B at their largest, some zero, some between.
            let mut b = DMatrix::from_fn(n, n, |i, j| {
                let part = (2.0 * share[i * n + j] - 0.5).clamp(0.0, 1.0 - 1e-12);
                part * a[(i, j)] / omega[j]
            });
            for i in 0..n {
                a[(i, i)] = diagonal[i];
                b[(i, i)] = of_b[i];
            }
            Planted::new(a, b, &free[3 * n..], omega, gamma)
        })
    })
}

/// Any pair with positive diagonals, dominant or not.
fn any_pair(weight: f64) -> impl Strategy<Value = Planted> {
    crate::common::planted(2..9, weight)
}

fn steps() -> impl Strategy<Value = Vec<AorStep>> {
    let step = (0.3..1.6, 0.0..1.4, any::<bool>(), any::<bool>()).prop_map(
        |(alpha, share, back, fast)| {
            let step = AorStep::new(alpha, alpha * share);
            let step = if back { step.backward() } else { step };
            if fast { step.accelerated() } else { step }
        },
    );
    vec(step, 1..3)
}

proptest! {
    /// Theorem 2 and Corollary 1 at the edge of (16): one percent below the bound they apply, one above not.
    #[test]
    fn theorem_2_ends_where_16_does(p in theorem_2_pair(0.97), share in 0.1..1.0, two in any::<bool>()) {
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
            let step = AorStep::new(alpha, alpha * share);
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

    /// Theorem 1 with Ω between |C_A|d and D_A d: (8), not the larger Ω, carries it.
    #[test]
    fn theorem_1_needs_only_condition_8(p in theorem_2_pair(0.9), low in 0.93..0.99, alpha in 0.5..1.0) {
        let mut p = p;
        let old = p.dense.omega.clone();
        for i in 0..old.len() {
            p.dense.omega[i] = low * p.dense.a[(i, i)] / p.dense.b[(i, i)];
        }
        let problem = posed(&p.dense);
        let steps = [AorStep::new(alpha, 0.6 * alpha), AorStep::new(alpha, alpha).backward()];
        let hypotheses = theorem_1(&problem, &steps);
        prop_assert!(hypotheses.applies());
        prop_assert!(!theorem_2(&problem, &steps).omega.is_yes());
        let Convergence::Proved(_, contraction) = convergence(&problem, &steps) else {
            return Err(TestCaseError::fail("not proved"));
        };
        contracts(&Planted { dense: p.dense.clone(), ..p.clone() }, &steps, &contraction.d, contraction.factor)?;
    }

    /// Whatever is proved holds: the factor, ρ(P₂P₁) < 1, and the elementwise inequality (15); AMMS included.
    #[test]
    fn what_is_proved_contracts(p in any_pair(3.0), steps in steps()) {
        if let Convergence::Proved(_, contraction) = convergence(&posed(&p.dense), &steps) {
            contracts(&p, &steps, &contraction.d, contraction.factor)?;
        }
    }

    /// The relaxed theorem says yes exactly when C − max(0, 1 − 1/α)D is an M-matrix, by its eigenvalues.
    #[test]
    fn the_relaxed_theorem_is_its_matrix(p in any_pair(3.0), alpha in 0.4..1.6, share in 0.0..1.0) {
        let Dense { a, b, omega, .. } = &p.dense;
        let n = omega.len();
        let bw = b * DMatrix::from_diagonal(omega);
        let d = DMatrix::from_fn(n, n, |i, j| if i == j { a[(i, i)] + bw[(i, i)] } else { 0.0 });
        let g = DMatrix::from_fn(n, n, |i, j| a[(i, j)].abs().max(bw[(i, j)].abs()));
        let product = f64::max(1.0, alpha) * radius(&(d.clone().try_inverse().unwrap() * g));
        prop_assume!((product - 1.0).abs() > 1e-9);
        let step = AorStep::new(alpha, alpha * share);
        let proved = relaxed_theorem(&posed(&p.dense), &[step, step.backward().accelerated()]);
        prop_assert_eq!(proved.is_yes(), product < 1.0);
        // ⟨M⟩ − |N| − |BΩ − A| = 2[C − max(0, 1 − 1/α)D], entry by entry, from the textbook's matrices.
        let c = DMatrix::from_fn(n, n, |i, j| if i == j { a[(i, i)].min(bw[(i, i)]) } else { -a[(i, j)].abs().max(bw[(i, j)].abs()) });
        let right = (c - &d * f64::max(0.0, 1.0 - 1.0 / alpha)) * 2.0;
        for step in [step, step.backward(), step.accelerated()] {
            let t = textbook(&p.dense, &step);
            let left = comparison(&t.linear) - t.modulus.abs() - t.from_x.abs() - t.from_modulus.abs();
            prop_assert!((&left - &right).amax() <= 64.0 * f64::EPSILON * d.amax() * (1.0 + 1.0 / alpha));
        }
    }

    /// Classes against dense linear algebra, and Lemma 1: |A⁻¹| ≤ ⟨A⟩⁻¹.
    #[test]
    fn classes_are_what_their_definitions_say(p in any_pair(4.0), signs in any::<bool>()) {
        let a = if signs { comparison(&p.dense.a) } else { p.dense.a.clone() };
        let n = a.nrows();
        let inverse = comparison(&a).try_inverse();
        prop_assume!(inverse.as_ref().is_none_or(|i| i.amax() < 1e8));
        let h = inverse.as_ref().is_some_and(|i| i.min() >= 0.0);
        let operator = Matrix(a.clone());
        let z = (0..n * n).all(|k| k / n == k % n || a[(k / n, k % n)] <= 0.0);
        prop_assert_eq!(is_z(&operator).is_yes(), z);
        let answer = is_h_plus(&operator);
        prop_assert_eq!(answer.is_yes(), h);
        prop_assert_eq!(is_m(&operator).is_yes(), h && is_z(&operator).is_yes());
        let rows = (comparison(&a) * DVector::from_element(n, 1.0)).min();
        prop_assume!(rows.abs() > 1e-12);
        prop_assert_eq!(is_strictly_dominant(&operator).is_yes(), rows > 0.0);
        if let (Answer::Yes(d), Some(inverse)) = (answer, inverse) {
            prop_assert!((comparison(&a) * DVector::from_vec(d)).min() > 0.0);
            let slack = 1e-9 * inverse.amax();
            prop_assert!((inverse - a.try_inverse().unwrap().abs()).min() >= -slack);
        }
    }

    /// Lemma 2: ‖B⁻¹C‖∞ ≤ max (|C|e)ᵢ/(⟨B⟩e)ᵢ for strictly dominant B.
    #[test]
    fn lemma_2(p in any_pair(0.9)) {
        let e = DVector::from_element(p.z.len(), 1.0);
        let quotient = (p.dense.b.abs() * &e).component_div(&(comparison(&p.dense.a) * &e)).max();
        let product = p.dense.a.clone().try_inverse().unwrap() * &p.dense.b;
        prop_assert!((product.abs() * e).amax() <= quotient * (1.0 + 1e-10));
    }

    /// Remark 3: HLCP(B, A, −q) with Ω⁻¹ has the solution exchanged, and the relaxed theorem does not change.
    #[test]
    fn the_exchange_keeps_solutions_and_hypotheses(p in any_pair(2.0)) {
        let exchanged = Dense {
            a: p.dense.b.clone(),
            b: p.dense.a.clone(),
            q: -&p.dense.q,
            omega: p.dense.omega.map(|omega| 1.0 / omega),
            gamma: p.dense.gamma,
        };
        prop_assert!((&exchanged.a * &p.r - &exchanged.b * &p.z + &exchanged.q).amax() <= 1e-12 * p.dense.q.amax().max(1.0));
        let bounds = [posed(&p.dense), posed(&exchanged)].map(|problem| relaxed_alpha_bound(&problem));
        let distance = (bounds[0].upper - bounds[1].upper).abs();
        prop_assert!(distance <= 1e-5 * (1.0 - bounds[0].upper).abs().max(1e-9));
    }
}

/// Runs the textbook steps from afar: (15), the factor in ‖·‖_d, ρ(P₂P₁) ≤ factor, convergence in time.
fn contracts(p: &Planted, steps: &[AorStep], d: &[f64], factor: f64) -> Result<(), TestCaseError> {
    let star = p.dense.gamma / 2.0 * (&p.z - p.r.component_div(&p.dense.omega));
    let all: Vec<Iteration> = steps.iter().map(|step| textbook(&p.dense, step)).collect();
    let n = star.len();
    let product = all.iter().fold(DMatrix::identity(n, n), |product, t| t.contraction() * product);
    prop_assert!(radius(&product) <= factor * (1.0 + 1e-9));
    let norm = |x: &DVector<f64>| x.iter().zip(d).map(|(x, d)| x.abs() / d).fold(0.0, f64::max);
    let mut x = star.map(|x| 7.0 * x.cos() - 40.0 * x.sin());
    let size = x.amax() + star.amax();
    let floor = 1e-9 * size * (d.iter().fold(0.0_f64, |m, d| m.max(1.0 / d)));
    for _ in 0..12 {
        let before = &x - &star;
        for t in &all {
            let old = &x - &star;
            x = t.step(&x);
            let excess = (&x - &star).abs() - t.contraction() * old.abs();
            prop_assert!(excess.max() <= 1e-9 * size);
        }
        prop_assert!(norm(&(&x - &star)) <= factor * norm(&before) + floor);
    }
    Ok(())
}

/// ρ(P₂P₁) at order 100, between Collatz–Wielandt quotients of a power iteration that the proof's d starts.
#[test]
fn the_radius_of_the_iteration_matrix_at_order_100() {
    for (symmetric, shift, tau, alpha) in [
        (true, 4.0, 1.0, 1.25),
        (true, 0.0, 1.0, 1.0),
        (false, 1.0, 1.2, 1.1),
        (false, 0.0, 0.9, 0.8),
    ] {
        let scene = Example { symmetric, m: 10, mu: shift, nu: shift }.pose::<f64>().unwrap();
        let formed = |operator: &dyn Fn(&[f64], &mut [f64])| {
            let mut columns = DMatrix::zeros(100, 100);
            for j in 0..100 {
                let unit: Vec<f64> = (0..100).map(|i| f64::from(i == j)).collect();
                operator(&unit, columns.column_mut(j).as_mut_slice());
            }
            columns
        };
        let dense = Dense {
            a: formed(&|x, y| scene.a.apply(x, y)),
            b: formed(&|x, y| scene.b.apply(x, y)),
            q: DVector::from_column_slice(&scene.q),
            omega: DVector::from_element(100, tau),
            gamma: 1.0,
        };
        for steps in [
            vec![AorStep::new(alpha, 0.9 * alpha), AorStep::new(alpha, 0.9 * alpha).backward()],
            vec![AorStep::new(alpha, alpha).accelerated()],
        ] {
            let Convergence::Proved(_, contraction) = convergence(&posed(&dense), &steps) else {
                panic!("inside the region")
            };
            let product = steps.iter().fold(DMatrix::identity(100, 100), |product, step| {
                textbook(&dense, step).contraction() * product
            });
            let mut x = DVector::from_vec(contraction.d);
            let mut quotients = (&product * &x).component_div(&x);
            assert!(contraction.factor < 1.0);
            assert!(quotients.max() <= contraction.factor * (1.0 + 1e-12));
            for _ in 0..200 {
                x = &product * x.normalize();
                let next = (&product * &x).component_div(&x);
                assert!(next.max() <= quotients.max() * (1.0 + 1e-12));
                quotients = next;
            }
            assert!(quotients.max() - quotients.min() < 1e-3 && quotients.max() < 1.0);
        }
    }
}

/// Both matrices are H₊, and there are three solutions: H₊ alone gives no W-property, and nothing is proved.
#[test]
fn two_h_plus_matrices_with_three_solutions() {
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
    let steps = [AorStep::new(1.0, 1.0)];
    assert_eq!(
        theorem_1(&problem, &steps).signs_and_sizes,
        Answer::No(Failure::Entry { row: 1, column: 0 })
    );
    assert!(matches!(convergence(&problem, &steps), Convergence::NotProved(_)));
}

/// Without H₊: ρ(|C_A|) = 2 and Gauss–Seidel runs away from a problem with a solution.
#[test]
fn without_h_plus_gauss_seidel_may_diverge() {
    let a = dmatrix![1.0, 2.0; 2.0, 1.0];
    let p = Planted::new(a, dmatrix![1.0, 0.0; 0.0, 1.0], &[1.0, 2.0], dvector![1.0, 1.0], 1.0);
    let problem = posed(&p.dense);
    assert!(matches!(is_h(problem.a()), Answer::No(Failure::Radius(lower)) if lower > 1.9));
    assert!(matches!(convergence(&problem, &[AorStep::new(1.0, 1.0)]), Convergence::NotProved(_)));
    let gauss_seidel = textbook(&p.dense, &AorStep::new(1.0, 1.0));
    let mut x = p.x().map(|x| x + 0.01);
    (0..60).for_each(|_| x = gauss_seidel.step(&x));
    assert!((x - p.x()).amax() > 0.5);
}

/// α far above the bound of (16), all else in order: the iteration runs away.
#[test]
fn far_above_the_bound_sor_diverges() {
    let a = dmatrix![4.0, -1.0; -1.0, 4.0];
    let p = Planted::new(a.clone(), a, &[1.0, -2.0], dvector![1.0, 1.0], 1.0);
    let steps = [AorStep::new(2.5, 2.5)];
    let hypotheses = theorem_2(&posed(&p.dense), &steps);
    assert!(hypotheses.signs_and_sizes.is_yes() && hypotheses.omega.is_yes());
    assert!(matches!(hypotheses.alpha, Answer::No(Failure::Radius(_))));
    let sor = textbook(&p.dense, &steps[0]);
    let mut x = p.x().map(|x| x + 1e-3);
    (0..80).for_each(|_| x = sor.step(&x));
    assert!((x - p.x()).amax() > 1.0);
}

/// Negative diagonals: the general witness asks for no sign.
#[test]
fn a_witness_needs_no_sign_of_the_diagonal() {
    let minus = dmatrix![-1.0];
    let p = Planted::new(minus.clone(), minus, &[3.0], dvector![1.0], 1.0);
    let Convergence::Proved(by, contraction) =
        convergence(&posed(&p.dense), &[AorStep::new(1.0, 0.5)])
    else {
        panic!("the step is exact")
    };
    assert_eq!(by, Proof::Witness);
    assert!(contraction.factor < 1e-12);
}

/// NaN, zero diagonals and order 1: no yes without a reason, and no panic.
#[test]
fn nothing_is_proved_of_broken_matrices() {
    let steps = [AorStep::new(1.0, 1.0)];
    let good = dmatrix![4.0, -1.0; 0.5, 3.0];
    for bad in [
        dmatrix![4.0, f64::NAN; 0.5, 3.0],
        dmatrix![4.0, -1.0; 0.5, f64::NAN],
        dmatrix![4.0, f64::INFINITY; 0.5, 3.0],
        dmatrix![0.0, -1.0; 0.5, 3.0],
        dmatrix![4.0, -1.0; 0.5, -3.0],
    ] {
        assert!(!is_h_plus(&Matrix(bad.clone())).is_yes());
        assert!(!is_m(&Matrix(bad.clone())).is_yes());
        for [a, b] in [[&bad, &good], [&good, &bad]].map(|pair| pair.map(|m| Matrix(m.clone()))) {
            let (zero, q) = ([0.0; 2], [1.0, -1.0]);
            assert_eq!(certify(&a, &b, &q, &zero, &zero).unwrap(), None);
            let problem = Hlcp::new(a, b, Omega::Each(vec![0.9, 1.1])).unwrap();
            assert!(!theorem_1(&problem, &steps).applies());
            assert!(!theorem_2(&problem, &steps).applies());
            assert!(!relaxed_theorem(&problem, &steps).is_yes());
            assert!(matches!(convergence(&problem, &steps), Convergence::NotProved(_)));
        }
    }
    let problem =
        Hlcp::new(Matrix(good.clone()), Matrix(good), Omega::Each(vec![1.0, 1.0])).unwrap();
    for step in [AorStep::new(f64::NAN, 1.0), AorStep::new(1.0, f64::NAN), AorStep::new(0.0, 0.0)] {
        assert!(!theorem_1(&problem, &[step]).applies());
        assert!(!theorem_2(&problem, &[step]).applies());
        assert!(matches!(convergence(&problem, &[step]), Convergence::NotProved(_)));
    }
    assert!(matches!(convergence(&problem, &[]), Convergence::NotProved(_)));

    let one = Hlcp::new(Matrix(dmatrix![2.0]), Matrix(dmatrix![3.0]), Omega::Uniform(0.7)).unwrap();
    let Convergence::Proved(_, contraction) = convergence(&one, &steps) else { panic!("order 1") };
    // |BΩ − A|/(A + BΩ) = 0.1/4.1
    assert!((contraction.factor - 0.1 / 4.1).abs() < 1e-14);
    let certificate = certify(one.a(), one.b(), &[-4.0], &[2.5], &[0.0]).unwrap().unwrap();
    assert!(certificate.z[0] >= 0.5 && certificate.z[0] < 0.5 + 1e-14);
}

/// What is proved of a problem is proved of its exchange, which is another problem with the same answers.
#[test]
fn an_exchanged_problem_is_proved_alike() {
    let a = FivePoint::new(7, 4, [-1.0, 0.5, 6.0, -1.5, -0.5]).unwrap();
    let b = FivePoint::new(7, 4, [0.0, -1.0, 5.0, 0.25, 0.0]).unwrap();
    let steps = [AorStep::new(1.1, 0.7), AorStep::new(1.1, 0.7).backward()];
    let factor = |proved: Convergence| match proved {
        Convergence::Proved(Proof::Relaxed, contraction) => contraction.factor,
        other => panic!("{other}"),
    };
    let problem = Hlcp::new(a, b, Omega::Uniform(1.1)).unwrap();
    let before = factor(convergence(&problem, &steps));
    let after = factor(convergence(&problem.exchanged().unwrap(), &steps));
    assert!((before - after).abs() < 1e-9, "{before} {after}");
}

/// Each hypothesis by itself, at its edge.
#[test]
fn hypotheses_are_reported_one_by_one() {
    let a = dmatrix![4.0, -1.0; -0.5, 3.0];
    let with = |b: DMatrix<f64>, omega: f64| {
        Hlcp::new(Matrix(a.clone()), Matrix(b), Omega::Uniform(omega)).unwrap()
    };
    let problem = with(a.clone(), 1.0);
    let gauss_seidel = [AorStep::new(1.0, 1.0)];
    assert!(theorem_1(&problem, &gauss_seidel).applies());
    assert!(theorem_2(&problem, &gauss_seidel).applies());
    let entry = |row, column| Answer::No(Failure::Entry { row, column });
    // The sign of b₁₀ alone.
    let sign = theorem_1(&with(dmatrix![4.0, -1.0; 0.25, 3.0], 1.0), &gauss_seidel);
    assert_eq!(sign.signs_and_sizes, entry(1, 0));
    assert!(sign.omega.is_yes() && sign.compatible.is_yes());
    let above = theorem_1(&problem, &[AorStep::new(1.001, 1.0)]);
    assert_eq!(above.compatible, entry(0, 0));
    let of_b = AorStep { b: [1.0, 1.5], ..gauss_seidel[0] };
    assert_eq!(theorem_1(&problem, &[of_b]).compatible, entry(1, 0));
    let amgs = theorem_2(&problem, &[gauss_seidel[0].accelerated()]);
    assert!(matches!(amgs.parameters, Answer::No(Failure::Parameter(_))));
    // Zeros that are visited are entries of a Z-matrix; equality is not strict.
    assert!(is_z(&Matrix(dmatrix![1.0, 0.0; -1.0, 1.0])).is_yes());
    assert_eq!(is_strictly_dominant(&Matrix(dmatrix![2.0, -1.0; 1.0, 1.0])), entry(1, 1));
    // (8): ωb₀₀ = 0.8 < 1 = |a₀₁|, and ωb₁₁ = 0.6 > |a₁₀|, but 0.8·0.6 < 1·0.5.
    let small = theorem_1(&with(a.clone(), 0.2), &gauss_seidel);
    assert!(matches!(small.omega, Answer::No(Failure::Radius(_))) && small.a_is_h_plus.is_yes());
    let jacobi = theorem_2(&problem, &[AorStep::new(1.0, 0.0)]);
    assert!(
        matches!(jacobi.parameters, Answer::No(Failure::Parameter(_))) && jacobi.alpha.is_yes()
    );
    let two = AorStep { b: [1.0, 0.5], ..gauss_seidel[0] };
    assert!(matches!(relaxed_theorem(&problem, &[two]), Answer::No(Failure::Parameter(_))));
}
