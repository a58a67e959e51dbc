//! The convergence theorems on the paper's examples: Table 2, closed forms, and the proved regions
//! of (α, τ).

use crate::common::problem;
use hlcp_core::{Aor, FivePoint, Hlcp};
use hlcp_verify::{
    Convergence, Example, Proof, alpha_bound, convergence, relaxed_alpha_bound, relaxed_theorem,
    theorem_2,
};

fn example(
    symmetric: bool,
    m: usize,
    [mu, nu]: [f64; 2],
    tau: f64,
) -> Hlcp<f64, FivePoint<f64>, FivePoint<f64>> {
    let scene = Example { symmetric, m, mu, nu }.pose::<f64>().unwrap();
    problem(tau, scene.a, scene.b)
}

/// Table 2, which truncates, at m = 128, as its digits are the same for 256 and 512: the brackets
/// lie inside the printed digits, and prove the bound above 1 at μ = ν = 0.
#[test]
fn table_2_of_the_paper() {
    let printed = [
        (true, 4.0, 1.2, 1.29),
        (true, 4.0, 1.0, 1.33),
        (true, 0.0, 1.2, 1.00),
        (true, 0.0, 1.0, 1.00),
        (false, 4.0, 1.2, 1.34),
        (false, 4.0, 1.0, 1.39),
    ];
    for (symmetric, mu, tau, digits) in printed {
        let [lower, upper] = alpha_bound(&example(symmetric, 128, [mu; 2], tau)).reciprocal();
        assert!(lower > digits && upper < digits + 0.01, "{symmetric} {mu} {tau}: {lower}");
        assert!(lower > 1.0 && upper - lower <= 1e-5 * (lower - 1.0));
    }
}

/// The regions of (α, τ) that the relaxed theorem and Theorem 2 prove, printed for m = 128 with
/// `--nocapture`.
///
/// The stencils have sines, scaled for Example 2, for eigenvectors, so both bounds on α have closed
/// forms, which are tested at m = 48; so have the ends of the range of τ in which α = 1 is proved,
/// which are tested at m = 24.
#[test]
fn the_proved_regions_of_alpha_and_tau() {
    let m = 128;
    println!("example, mu, nu: bounds on alpha at tau = 0.8, 1, 1.2 (relaxed; (16)); tau; areas");
    for (symmetric, [mu, nu]) in [true, false]
        .into_iter()
        .flat_map(|s| [4.0, 1.0, 0.0].map(|v| (s, [v; 2])).into_iter().chain([(s, [0.0, 4.0])]))
    {
        let shape: f64 = if symmetric { 1.0 } else { 0.75 };
        let side = |m: usize| 2.0 * shape.sqrt() * (std::f64::consts::PI / (m as f64 + 1.0)).cos();
        let [on_a, on_b]: [f64; 2] = [4.0 + mu, 4.0 + nu];
        let relaxed = |m: usize, tau: f64| {
            let off = side(m) * (1.0 + f64::max(1.0, tau * on_a / on_b));
            on_a * (1.0 + tau) / (on_a * tau.max(1.0) + off)
        };
        let of_16 = |m: usize, tau: f64| on_a * (1.0 + tau) / (on_a * tau + 2.0 * side(m));
        for tau in [0.8, 1.0, 1.2] {
            let problem = example(symmetric, 48, [mu, nu], tau);
            for (bracket, bound) in [
                (relaxed_alpha_bound(&problem), relaxed(48, tau)),
                (alpha_bound(&problem), of_16(48, tau)),
            ] {
                let [lower, upper] = bracket.reciprocal();
                assert!(lower <= bound * (1.0 + 1e-14) && bound * (1.0 - 1e-14) <= upper);
                assert!(upper - lower <= 2e-6 * (bound - 1.0).abs(), "{lower} {bound} {upper}");
            }
        }
        // C has a positive eigenvector, to min(1, τ)a − s(1 + max(1, τa/b)).
        let ends = |s: f64| [2.0 * s / on_a, (on_a / s - 1.0) * on_b / on_a];
        let ([low, high], few) = (ends(side(24)), 24);
        let last = on_b / on_a; // of (II)
        for (tau, proved, paper) in [
            (low * (1.0 - 1e-4), false, false),
            (low * (1.0 + 1e-4), true, false),
            (high * (1.0 - 1e-4), true, false),
            (high * (1.0 + 1e-4), false, false),
            (1.0 - 1e-9, true, false),
            (1.0, true, true),
            (last, true, true),
            (last + 1e-9, true, false),
        ] {
            let problem = example(symmetric, few, [mu, nu], tau);
            let steps = [Aor::gauss_seidel(), Aor::gauss_seidel().backward()];
            assert_eq!(relaxed_theorem(&problem, &steps).is_yes(), proved, "{mu} {nu} {tau}");
            assert_eq!(theorem_2(&problem, &steps).applies(), paper, "{mu} {nu} {tau}");
        }
        let [low, high] = ends(side(m));
        let area = |from: f64, to: f64, bound: &dyn Fn(f64) -> f64| {
            let h = (to - from) / 10_000.0;
            (0..10_000).map(|k| h * bound(from + (k as f64 + 0.5) * h)).sum::<f64>()
        };
        println!(
            "{} {mu} {nu}: {:.5?}; {:.5?}; {low:.4} to {high:.4}, 1 to {last}; {:.4}, {:.4}",
            if symmetric { 1 } else { 2 },
            [0.8, 1.0, 1.2].map(|tau| relaxed(m, tau)),
            [0.8, 1.0, 1.2].map(|tau| of_16(m, tau)),
            area(low, high, &|tau| relaxed(m, tau)),
            area(1.0, last, &|tau| of_16(m, tau))
        );
    }
}

/// β > α is outside both theorems and inside the general witness.
#[test]
fn a_witness_covers_beta_above_alpha() {
    let problem = example(true, 16, [4.0; 2], 1.0);
    let steps = [Aor::new(0.9, 1.1).unwrap(), Aor::new(0.8, 1.0).unwrap().backward()];
    assert!(!relaxed_theorem(&problem, &steps).is_yes());
    assert!(matches!(convergence(&problem, &steps), Convergence::Proved(Proof::Witness, _)));
}
