//! Over-relaxation on the disc: iteration counts as independent implementations found them.

use hlcp_core::Aor;
use hlcp_methods::{Divergence, Limits, Outcome, Solver, Status, Tmms};
use hlcp_verify::Disc;

use crate::common::{largest_difference, problem, solve_from_ones};

fn tmsor_on_disc(lcp: bool, m: usize, alpha: f64) -> Outcome {
    let scene = Disc { lcp, m }.pose::<f64>().unwrap();
    let problem = problem(1.0, scene.a, scene.b);
    let mut solver = Solver::new(Tmms::mirrored(problem, Aor::sor(alpha).unwrap()).unwrap());
    let outcome = solve_from_ones(&mut solver, &scene.q, Limits::absolute(1e-10));
    if outcome.converged() {
        // The error is the residual times the inverse of a matrix of columns of A and B, of norm
        // O(m²/8).
        let off = outcome.residual.linf * (m * m) as f64 + 1e-12;
        assert!(largest_difference(solver.z(), &scene.z) <= off);
        assert!(largest_difference(solver.r(), &scene.r) <= 8.0 * off);
    }
    outcome
}

#[test]
fn tmsor_takes_thousands_of_iterations_on_the_disc() {
    for (lcp, m, alpha, count) in
        [(true, 63, 1.0, 4709), (false, 63, 1.0, 3394), (false, 64, 1.5, 1637)]
    {
        let outcome = tmsor_on_disc(lcp, m, alpha);
        assert!(outcome.converged());
        assert!(outcome.iterations.abs_diff(count) <= 1, "{}", outcome.iterations);
    }
}

#[test]
fn strong_over_relaxation_diverges_on_the_disc() {
    for (lcp, alpha) in [(true, 1.5), (true, 1.8), (false, 1.8)] {
        let outcome = tmsor_on_disc(lcp, 64, alpha);
        assert_eq!(outcome.status, Status::Diverged(Divergence::Growth), "{outcome}");
        assert!(outcome.iterations <= 1000 && outcome.residual.l2.is_finite());
    }
}
