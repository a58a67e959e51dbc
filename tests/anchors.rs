//! Iteration counts on Examples 1 and 2 at m = 128, as two independent implementations found them.

use hlcp_core::{Hlcp, Omega};
use hlcp_methods::{Limits, Named, Parameters, Solver};
use hlcp_verify::Example;

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
                let outcome = solver.solve(&scene.q, &start, &Limits::default()).unwrap();
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
