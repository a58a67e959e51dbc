//! The certificate on the slider and the disc scenes.

use hlcp_core::{Aor, Hlcp, LinearOperator, Omega};
use hlcp_methods::{Limits, Options, Solver, Tmms};
use hlcp_verify::{AorStep, Convergence, Disc, Slider, Witness, certify, convergence};

/// Convergence is not proved; uniqueness is, by the sum witness.
#[test]
fn the_slider_is_unique_and_its_convergence_not_proved() {
    for cells in [50, 128, 512] {
        let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
        let omega = Omega::diagonal_ratio(1.0, &a, &b).unwrap();
        let problem = Hlcp::new(a, b, omega).unwrap();
        for step in [AorStep::new(1.0, 1.0), AorStep::new(1.0, 0.0)] {
            assert!(matches!(convergence(&problem, &[step]), Convergence::NotProved(_)));
        }
        // Any guess will do; at z = r = 0 the defect is q.
        let zero = vec![0.0; a.order()];
        let certificate = certify(&a, &b, &q, &zero, &zero).unwrap().expect("a left witness");
        assert!(matches!(certificate.witness, Witness::Left { .. }));
        // The answer is no closer to 0 than its peak.
        assert!(certificate.error() >= 0.028 && certificate.error().is_finite());
    }
}

/// What is certified is not below the true error, converged or stopped early.
#[test]
fn disc_scenes_are_certified() {
    for (lcp, m) in [(true, 31), (false, 31)] {
        let scene = Disc { lcp, m }.pose::<f64>().unwrap();
        let omega = Omega::diagonal_ratio(1.0, &scene.a, &scene.b).unwrap();
        let problem = Hlcp::new(scene.a, scene.b, omega).unwrap();
        let mut solver = Solver::new(Tmms::mirrored(problem, Aor::gauss_seidel()).unwrap());
        for iterations in [20, 30_000] {
            let limits = Limits { iterations, ..Limits::absolute(1e-10) };
            let outcome =
                solver.solve(&scene.q, Options::from_x(&vec![1.0; m * m]).limits(limits)).unwrap();
            assert_eq!(outcome.converged(), iterations > 20);
            let found = certify(&scene.a, &scene.b, &scene.q, solver.z(), solver.r()).unwrap();
            let bounds = found.expect("an M-matrix");
            let pairs = [(solver.z(), &scene.z, &bounds.z), (solver.r(), &scene.r, &bounds.r)];
            for (found, known, bound) in pairs {
                // The scene's q is rounded to some 3e-15, which C⁻¹ ≤ (m + 1)²/8 and Ω ≤ 4 enlarge.
                let floor = 2e-12;
                assert!((0..m * m).all(|k| (found[k] - known[k]).abs() <= bound[k] + floor));
            }
        }
    }
}
