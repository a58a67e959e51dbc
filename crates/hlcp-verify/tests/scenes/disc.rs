//! Over-relaxation on the disc: iteration counts as independent implementations found them.

use hlcp_core::Aor;
use hlcp_methods::{Limits, Solver, Tmms};
use hlcp_verify::Disc;

use crate::common::{largest_difference, problem, solve_from_ones};

#[test]
fn tmsor_takes_thousands_of_iterations_on_the_disc() {
    for (lcp, m, alpha, count) in
        [(true, 63, 1.0, 4709), (false, 63, 1.0, 3394), (false, 64, 1.5, 1637)]
    {
        let scene = Disc { lcp, m }.pose::<f64>().unwrap();
        let problem = problem(1.0, scene.a, scene.b);
        let mut solver = Solver::new(Tmms::mirrored(problem, Aor::sor(alpha).unwrap()).unwrap());
        let outcome = solve_from_ones(&mut solver, &scene.q, Limits::absolute(1e-10));
        assert!(outcome.converged());
        assert!(outcome.iterations.abs_diff(count) <= 1, "{}", outcome.iterations);
        // The error is the residual times the inverse of a matrix of columns of A and B, of norm
        // O(m²/8).
        let off = outcome.residual.linf * (m * m) as f64 + 1e-12;
        assert!(largest_difference(solver.z(), &scene.z) <= off);
        assert!(largest_difference(solver.r(), &scene.r) <= 8.0 * off);
    }
}
