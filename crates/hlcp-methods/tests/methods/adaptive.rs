//! Adaptive SOR against Young's theory, section "The optimal α" of docs/theory.md.

use crate::common::{problem, solve_from_ones};
use hlcp_core::{Aor, Diagonal, FivePoint, LinearOperator};
use hlcp_methods::{AdaptiveSor, Limits, Method, Mms, Outcome, Solver};
use hlcp_verify::{Disc, Slider};

type Scene = hlcp_verify::Posed<f64, FivePoint<f64>, FivePoint<f64>>;

fn solve<M: Method<f64>>(method: M, q: &[f64], limits: Limits) -> (Outcome, Solver<f64, M>) {
    let mut solver = Solver::new(method).with_history(10_000);
    let outcome = solve_from_ones(&mut solver, q, limits);
    (outcome, solver)
}

fn amsor(scene: &Scene, alpha: f64, limits: Limits) -> (Outcome, Solver<f64, impl Method<f64>>) {
    let sor = Aor::sor(alpha).unwrap().accelerated();
    solve(Mms::new(problem(1.0, &scene.a, &scene.b), sor).unwrap(), &scene.q, limits)
}

fn adaptive(scene: &Scene) -> (Outcome, f64) {
    let method = AdaptiveSor::new(problem(1.0, &scene.a, &scene.b)).unwrap();
    let (outcome, solver) = solve(method, &scene.q, Limits::relative(1e-10));
    assert!(outcome.converged(), "{outcome}");
    (outcome, solver.method().alpha())
}

/// The spectral radius of Jacobi's iteration on J(x*), whose columns are those of A where z* > 0
/// and of BΩ elsewhere: a matrix without negative entries, by powers of its mean with the identity.
fn jacobi(scene: &Scene) -> f64 {
    let n = scene.q.len();
    let [of_a, of_b] = [&scene.a, &scene.b].map(|operator| operator.diagonal_entry(0));
    let (mut v, mut az, mut br) = (vec![1.0; n], vec![0.0; n], vec![0.0; n]);
    let mut radius = 0.0;
    for _ in 0..4 * n {
        let of = |kept: bool, scale: f64| -> Vec<f64> {
            let entry = |(v, &z): (&f64, &f64)| if (z > 0.0) == kept { v * scale } else { 0.0 };
            v.iter().zip(&scene.z).map(entry).collect()
        };
        scene.a.apply(&of(true, 1.0 / of_a), &mut az);
        scene.b.apply(&of(false, 1.0 / of_b), &mut br);
        let next: Vec<f64> = (0..n).map(|i| v[i] - 0.5 * (az[i] + br[i])).collect();
        radius = next.iter().fold(0.0, |max, &v| f64::max(max, v));
        v = next.iter().map(|v| v / radius).collect();
    }
    2.0 * radius - 1.0
}

fn young(mu: f64) -> f64 {
    2.0 / (1.0 + (1.0 - mu * mu).sqrt())
}

/// Below the best α the larger root of (λ + α − 1)² = α² μ² λ, beyond it α − 1.
fn rate(mu: f64, alpha: f64) -> f64 {
    let root = 0.5 * (alpha * mu + ((alpha * mu).powi(2) - 4.0 * (alpha - 1.0)).max(0.0).sqrt());
    root.powi(2).max(alpha - 1.0)
}

/// Over the last sweeps to 10⁻¹² the residual falls as predicted, with what is left of other errors
/// and of the start: a factor of 4 over the sweeps for four digits.
#[test]
fn sor_has_youngs_rates_near_the_answer() {
    for lcp in [true, false] {
        let scene = Disc { lcp, m: 15 }.pose().unwrap();
        let mu = jacobi(&scene);
        for alpha in [1.0, 1.3, 0.9 * young(mu), young(mu) + 0.1] {
            let (outcome, solver) = amsor(&scene, alpha, Limits::relative(1e-12));
            assert!(outcome.converged(), "{outcome}");
            let history: Vec<f64> = solver.history().iter().map(|norms| norms.l2).collect();
            let last = history[history.len() - 1];
            let sweeps =
                history.iter().rev().take_while(|&&residual| residual < 1e4 * last).count();
            let measured = (last / history[history.len() - 1 - sweeps]).ln() / sweeps as f64;
            let off = (measured - rate(mu, alpha).ln()).abs();
            assert!(off < f64::ln(4.0) / sweeps as f64, "{lcp} {alpha}: {measured}, {mu}");
        }
    }
}

/// The search ends where the rate is within a power of ¾ of the best one, 2 − α at most 1.04 times
/// the best, and a step that was too long has at most halved it. The closed form is that of a disc
/// whose radius is off by a mesh width at most.
#[test]
fn the_alpha_found_is_youngs() {
    for (lcp, m) in [(true, 15), (true, 31), (true, 63), (false, 15), (false, 31), (false, 63)] {
        let scene = Disc { lcp, m }.pose().unwrap();
        let best = young(jacobi(&scene));
        let (outcome, alpha) = adaptive(&scene);
        let ratio = (2.0 - alpha) / (2.0 - best);
        assert!((0.5..1.04).contains(&ratio), "{lcp} {m}: {alpha} and not {best}");
        let (by_hand, _) = amsor(&scene, best, Limits::relative(1e-10));
        assert!(outcome.sweeps < 2 * by_hand.sweeps, "{lcp} {m}: {outcome} and {by_hand}");
        if lcp {
            let h = 1.0 / (m + 1) as f64;
            // The first zero of the Bessel function J₀, over the radius and √2.
            let closed = 2.0 / (1.0 + h * 2.404826 / 0.4 / f64::sqrt(2.0));
            let off = (2.0 - closed) / (2.0 - best) - 1.0;
            assert!(off.abs() < h / 0.4, "{m}: {closed} and not {best}");
        }
    }
}

/// On the slider AMSOR fails from some α on, and for τ ≠ 1 it is no SOR: the search leaves that α.
#[test]
fn an_alpha_that_fails_on_films_is_left() {
    for cells in [24, 32, 50] {
        for tau in [0.8, 1.0, 1.2] {
            let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
            let method = AdaptiveSor::new(problem(tau, a, b)).unwrap();
            let (outcome, _) = solve(method, &q, Limits::relative(1e-10));
            assert!(outcome.converged(), "{cells} {tau}: {outcome}");
        }
    }
}
