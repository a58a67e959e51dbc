//! The certificate on the slider and the disc scenes.

use crate::common::{problem, solve_from_ones, tmgs};
use hlcp_core::{Aor, LinearOperator};
use hlcp_methods::{Limits, Solver, solve};
use hlcp_verify::{
    Convergence, Disc, Proof, Slider, Uniqueness, Witness, certify, convergence, uniqueness,
};

/// Uniqueness is proved, by the sum witness, and so is convergence by Jacobi's method and by
/// accelerated Gauss–Seidel; by Gauss–Seidel it is not.
#[test]
fn the_slider_is_unique_and_amgs_converges_to_it() {
    for cells in [50, 128, 512] {
        let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
        let problem = problem(1.0, a, b);
        let gauss_seidel = Aor::gauss_seidel();
        assert!(matches!(convergence(&problem, &[gauss_seidel]), Convergence::NotProved(_)));
        for step in [gauss_seidel.accelerated(), Aor::jacobi()] {
            let found = convergence(&problem, &[step]);
            assert!(matches!(found, Convergence::Proved(Proof::Columns, _)), "{found}");
        }
        let found = uniqueness(&a, &b).unwrap();
        assert!(matches!(found, Uniqueness::Proved(Witness::Left { .. })));
        // From any guess Newton's method finds the box; 0 is as far from the answer as its peak.
        let zero = vec![0.0; a.order()];
        let certificate = certify(&a, &b, &q, &zero, &zero).unwrap().expect("a box");
        let answer = solve(&a, &b, &q).unwrap();
        let peak = |x: &[f64]| x.iter().copied().fold(0.0, f64::max);
        let (bound, error) = (peak(&certificate.z), peak(&answer.z));
        assert!((0.999 * error..1.3 * error).contains(&bound), "{bound:e} of {error:e}");
    }
}

/// What is certified is not below the true error, converged or stopped early.
#[test]
fn disc_scenes_are_certified() {
    for (lcp, m) in [(true, 31), (false, 31)] {
        let scene = Disc { lcp, m }.pose::<f64>().unwrap();
        let problem = problem(1.0, scene.a, scene.b);
        let mut solver = Solver::new(tmgs(problem));
        for iterations in [20, 30_000] {
            let limits = Limits { iterations, ..Limits::absolute(1e-10) };
            let outcome = solve_from_ones(&mut solver, &scene.q, limits);
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
