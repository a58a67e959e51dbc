//! Iteration counts on Examples 1 and 2 at m = 128 and on the disc, as independent implementations found them.

use hlcp_core::{Aor, Hlcp, Omega};
use hlcp_methods::{Divergence, Limits, Named, Options, Outcome, Parameters, Solver, Status, Tmms};
use hlcp_verify::{Disc, Example};

/// MAOR, AMAOR and TMAOR for one τ and (α, β): on Example 1 with μ = ν = 4, on Example 1 with μ = ν = 0, and
/// on Example 2 with μ = ν = 4.
type Row = (f64, [f64; 2], [[usize; 3]; 3]);

/// Start e, γ = 1, absolute 2-norm 10⁻¹⁰.
const COUNTS: [Row; 6] = [
    (0.8, [1.2, 1.2], [[39, 33, 19], [72, 44, 35], [33, 25, 20]]),
    (0.8, [1.0, 1.0], [[22, 22, 11], [75, 68, 38], [17, 17, 10]]),
    (0.8, [1.3, 1.1], [[63, 47, 30], [202, 68, 91], [49, 36, 31]]),
    (1.0, [1.2, 1.2], [[29, 26, 14], [58, 49, 30], [29, 20, 14]]),
    (1.0, [1.0, 1.0], [[24, 22, 12], [83, 74, 42], [20, 16, 12]]),
    (1.0, [1.1, 0.9], [[24, 22, 12], [79, 70, 40], [19, 17, 12]]),
];

#[test]
fn counts_are_the_anchors_within_one() {
    let scenes = [(true, 4.0), (true, 0.0), (false, 4.0)];
    for (tau, [alpha, beta], counts) in COUNTS {
        let parameters =
            Parameters { alpha: Some(alpha), beta: Some(beta), ..Parameters::default() };
        for ((symmetric, shift), counts) in scenes.into_iter().zip(counts) {
            for (name, count) in ["MAOR", "AMAOR", "TMAOR"].into_iter().zip(counts) {
                let scene =
                    Example { symmetric, m: 128, mu: shift, nu: shift }.pose::<f64>().unwrap();
                let omega = Omega::diagonal_ratio(tau, &scene.a, &scene.b).unwrap();
                let problem = Hlcp::new(scene.a, scene.b, omega).unwrap();
                let method = Named::parse(name, parameters).unwrap().on(problem).unwrap();
                let mut solver = Solver::new(method);
                let start = vec![1.0; scene.q.len()];
                let outcome = solver
                    .solve(&scene.q, Options::from_x(&start).limits(Limits::absolute(1e-10)))
                    .unwrap();
                assert!(outcome.converged());
                assert!(
                    outcome.iterations.abs_diff(count) <= 1,
                    "{name} tau {tau} ({alpha}, {beta}) symmetric {symmetric} shift {shift}: {} for {count}",
                    outcome.iterations
                );
            }
        }
    }
}

fn tmsor_on_disc(lcp: bool, m: usize, alpha: f64) -> Outcome {
    let scene = Disc { lcp, m }.pose::<f64>().unwrap();
    let omega = Omega::diagonal_ratio(1.0, &scene.a, &scene.b).unwrap();
    let problem = Hlcp::new(scene.a, scene.b, omega).unwrap();
    let mut solver = Solver::new(Tmms::mirrored(problem, Aor::sor(alpha).unwrap()).unwrap());
    let outcome = solver
        .solve(&scene.q, Options::from_x(&vec![1.0; scene.q.len()]).limits(Limits::absolute(1e-10)))
        .unwrap();
    if outcome.converged() {
        // The error is the residual times the inverse of a matrix of columns of A and B, of norm O(m²/8).
        let off = outcome.residual.linf * (m * m) as f64 + 1e-12;
        assert!(solver.z().iter().zip(&scene.z).all(|(z, known)| (z - known).abs() <= off));
        assert!(solver.r().iter().zip(&scene.r).all(|(r, known)| (r - known).abs() <= 8.0 * off));
    }
    outcome
}

#[test]
fn the_disc_is_crawled_over() {
    for (lcp, m, alpha, count) in
        [(true, 63, 1.0, 4709), (false, 63, 1.0, 3394), (false, 64, 1.5, 1637)]
    {
        let outcome = tmsor_on_disc(lcp, m, alpha);
        assert!(outcome.converged());
        assert!(outcome.iterations.abs_diff(count) <= 1, "{}", outcome.iterations);
    }
}

#[test]
fn over_relaxation_diverges_on_the_disc() {
    for (lcp, alpha) in [(true, 1.5), (true, 1.8), (false, 1.8)] {
        let outcome = tmsor_on_disc(lcp, 64, alpha);
        assert_eq!(outcome.status, Status::Diverged(Divergence::Growth), "{outcome}");
        assert!(outcome.iterations <= 1000 && outcome.residual.l2.is_finite());
    }
}
