//! How methods fail: each a named scene, with the outcome, a bound on when it comes, and the best
//! iterate handed back. `outcomes.rs` has the ends of a solve that no scene has.

use crate::common::{by, named, posed, problem, tmgs};
use hlcp_core::{Aor, Error, FivePoint, Identity, Norms, Rows};
use hlcp_methods::{
    Divergence, GROWTH, Limits, Method, Options, Outcome, PATIENCE, Solver, Status, Tmms,
};
use hlcp_verify::{Disc, Planted, Slider, certify};
use nalgebra::{dmatrix, dvector};

/// Solves, and checks what holds of every outcome: the iterate with the smallest residual comes
/// back, the report is about it, and nothing in it is NaN.
pub(crate) fn solve<M: Method<f64>>(
    method: M,
    q: &[f64],
    x0: &[f64],
    limits: Limits,
) -> (Outcome, Solver<f64, M>) {
    let mut solver = Solver::new(method).with_history(limits.iterations + 1);
    let outcome = solver.solve(q, Options::from_x(x0).limits(limits)).unwrap();
    let residuals: Vec<f64> = solver.history().iter().map(|norms| norms.l2).collect();
    assert_eq!(residuals.len(), outcome.iterations + 1);
    let smallest = residuals.iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(residuals[outcome.answer], smallest, "{outcome}");
    // The step's norm and the answer's own differ by the rounding of terms no larger than the
    // start's residual and q, or where these underflow by that of the least numbers.
    let terms = residuals[0].max(Norms::of(q).l2);
    let residual = outcome.residual;
    let same = residual.l2 == smallest
        || (residual.l2 - smallest).abs()
            <= 1e-6 * smallest + 64.0 * f64::EPSILON * terms.max(f64::MIN_POSITIVE);
    assert!(same && residual.linf <= residual.l2, "{outcome}");
    assert!(!residual.l2.is_nan());
    for v in [solver.x(), solver.z(), solver.r()] {
        assert!(v.iter().all(|v| v.is_finite()));
    }
    (outcome, solver)
}

fn tmsor<A: Rows<f64>, B: Rows<f64>>(a: A, b: B, alpha: f64) -> impl Method<f64, A = A, B = B> {
    Tmms::mirrored(problem(1.0, a, b), Aor::sor(alpha).unwrap()).unwrap()
}

/// TMSOR 1.5 and 1.8 on the discs: growth by a factor of 1.2 an iteration, which is not called
/// divergence before 10¹⁶.
#[test]
fn over_relaxed_tmsor_on_the_disc() {
    for (lcp, alpha, soonest, latest) in
        [(true, 1.5, 150, 250), (true, 1.8, 50, 100), (false, 1.8, 50, 1000)]
    {
        let m = 64;
        let scene = Disc { lcp, m }.pose::<f64>().unwrap();
        let method = tmsor(scene.a, scene.b, alpha);
        let (outcome, solver) = solve(method, &scene.q, &vec![1.0; m * m], Limits::absolute(1e-10));
        assert_eq!(outcome.status, Status::Diverged(Divergence::Growth));
        assert!(
            (soonest..latest).contains(&outcome.iterations) && outcome.answer < 20,
            "{outcome}"
        );
        let [.., before, last] = solver.history() else { unreachable!() };
        let scale = solver.history()[0].l2.max(Norms::of(&scene.q).l2);
        assert!(before.l2 <= 1e16 * scale && 1e16 * scale < last.l2 && GROWTH == 1e16);
    }
}

/// A P-matrix outside H₊: the LCP has one solution for every q, and TMGS goes round it with
/// period 2.
#[test]
fn a_p_matrix_outside_h_plus() {
    let a = dmatrix![1.0, 2.0; -2.0, 1.0];
    let method = tmsor(a, Identity { order: 2 }, 1.0);
    let (outcome, _) = solve(method, &[-1.5, 0.7], &[1.0; 2], Limits::absolute(1e-10));
    assert_eq!(outcome.status, Status::Cycling { period: 2 });
    assert!(outcome.to_string().starts_with("cycling with period 2 after "), "{outcome}");
    assert!(outcome.iterations < 40 && outcome.residual.l2 > 1.0);
}

/// H₊-matrices that violate the sizes of (II): two solutions, each found from its own start, and no
/// certificate.
#[test]
fn an_h_plus_pair_without_ii() {
    let (a, b) = (dmatrix![1.6, 1.2; 2.65, 2.2], dmatrix![2.0, 0.54; 4.1, 1.83]);
    let p = Planted::new(a, b, &[-7.02, -4.34], dvector![1.95, 1.55], 1.0);
    let (q, solutions) = (p.dense.q.as_slice(), p.dense.solutions());
    assert_eq!(solutions.len(), 2);
    let method = || tmgs(posed(&p.dense));
    for start in [[3.0, 3.0], [-3.0, -3.0], [2.0, -2.0]] {
        let (outcome, solver) = solve(method(), q, &start, Limits::absolute(1e-10));
        assert!(outcome.converged() && outcome.iterations < 100, "{outcome}");
        assert!((solver.r()[0] - 7.02).abs() < 1e-8 && (solver.r()[1] - 4.34).abs() < 1e-8);
        let certificate = certify(&p.dense.a, &p.dense.b, q, solver.z(), solver.r());
        // It is the only solution within the bounds, and there is another.
        assert!(certificate.unwrap().is_ok_and(|found| found.is_alone));
    }
    for (z, r) in &solutions {
        let mut x = [0.0; 2];
        posed(&p.dense).x_from_solution(z.as_slice(), r.as_slice(), &mut x);
        let (outcome, _) = solve(method(), q, &x, Limits::absolute(1e-10));
        assert!(outcome.converged() && outcome.iterations == 0, "{outcome}");
    }
}

/// H₊-matrices that violate (8): TMGS comes to cycles, of period 3 and of period 1, where its two
/// steps undo each other.
#[test]
fn an_h_plus_pair_without_condition_8() {
    let (a, b) = (dmatrix![1.3, 1.15; 1.15, 1.3], dmatrix![0.46, 0.025; 0.65, 0.115]);
    let p = Planted::new(a, b, &[3.8, 1.1], dvector![0.7, 2.25], 1.0);
    for (start, period) in [([0.1, 0.2], 3), ([3.0, 3.0], 1)] {
        let method = tmgs(posed(&p.dense));
        let (outcome, _) = solve(method, p.dense.q.as_slice(), &start, Limits::absolute(1e-10));
        assert_eq!(outcome.status, Status::Cycling { period });
        assert!(outcome.iterations < 150 && outcome.residual.l2 > 0.1, "{outcome}");
    }
}

/// A singular pair: with q in the range many solutions, of which one is found; with q outside none,
/// and the iterates wander off at a constant pace, which is neither divergence nor rest.
#[test]
fn a_singular_pair() {
    let singular = dmatrix![1.0, -1.0; -1.0, 1.0];
    let method = || tmsor(singular.clone(), singular.clone(), 0.7);
    let (outcome, _) = solve(method(), &[1.5, -1.5], &[1.0, 0.3], Limits::absolute(1e-10));
    assert!(outcome.converged() && outcome.iterations < 20, "{outcome}");

    // The rows sum to zero, q does not.
    let limits = Limits { iterations: 3000, ..Limits::absolute(1e-10) };
    let (outcome, _) = solve(method(), &[1.0, 1.5], &[1.0; 2], limits);
    assert_eq!((outcome.status, outcome.iterations), (Status::IterationLimit, 3000));
    assert!(outcome.residual.l2 >= 2.5 / 2_f64.sqrt() * (1.0 - 1e-12)); // what no z and r go below
}

/// Both matrices H₊, three solutions: TMGS rests at two of them and goes round the third.
#[test]
fn a_pair_with_three_solutions() {
    let method = || {
        let (a, b) = (dmatrix![1.0, -2.0; 0.0, 1.0], dmatrix![1.0, 0.0; -2.0, 1.0]);
        tmsor(a, b, 1.0)
    };
    let q = [1.0, -1.0];
    for (start, z, r) in [
        ([0.5, 0.5], [1.0, 1.0], [0.0, 0.0]),
        ([-0.5, -0.5], [0.0, 0.0], [1.0, 1.0]),
        ([-1.0 / 6.0, 1.0 / 6.0], [0.0, 1.0 / 3.0], [1.0 / 3.0, 0.0]),
    ] {
        let (outcome, solver) = solve(method(), &q, &start, Limits::absolute(1e-10));
        assert!(outcome.converged() && outcome.iterations == 0, "{outcome}");
        assert_eq!((solver.z(), solver.r()), (&z[..], &r[..]));
    }
    for start in [[1.0, 1.0], [-1.0, -1.0], [-0.2, 0.3]] {
        let (outcome, _) = solve(method(), &q, &start, Limits::absolute(1e-10));
        assert_eq!(outcome.status, Status::Cycling { period: 2 });
        assert!(outcome.iterations < 20, "{outcome}");
    }
}

fn slider(cells: usize, name: &str, limits: Limits) -> Outcome {
    let (a, b, q) = Slider { cells }.pose().unwrap();
    let method = named(name, [1.0; 2]).on_dyn(problem(1.0, &a, &b)).unwrap();
    solve(method, &q, &vec![1.0; cells - 1], limits).0
}

/// TMJSOR4 takes as many iterations as there are cells, squared: past the limit from here on, and
/// still on its way.
#[test]
fn tmjsor4_on_the_slider_runs_out_of_iterations() {
    for (cells, least) in [(224, 1e-9), (256, 1e-6)] {
        let outcome = slider(cells, "TMJSOR4", Limits::relative(1e-10));
        assert_eq!((outcome.status, outcome.iterations), (Status::IterationLimit, 30_000));
        assert!(outcome.residual.l2 > least && outcome.answer > 29_000, "{outcome}");
    }
}

/// An absolute tolerance below what the terms of the residual, of the size of 10³, can cancel to.
#[test]
fn the_slider_below_its_floor() {
    let limits = Limits::absolute(1e-16);
    let outcome = slider(32, "MGS", limits);
    assert_eq!(outcome.status, Status::Stagnated);
    assert!(outcome.iterations < 1000 + 2 * PATIENCE && outcome.residual.l2 < 1e-12, "{outcome}");
}

fn generic() -> impl Method<f64> {
    let a = dmatrix![4.0, -3.0; -2.5, 3.5];
    tmsor(a.clone(), a, 1.0)
}

/// Near the largest number: one order below all is well, and where the residual itself overflows it
/// is said at once.
#[test]
fn overflow() {
    let (outcome, _) = solve(generic(), &[-1e307, 0.9e307], &[0.0; 2], Limits::relative(1e-10));
    assert!(outcome.converged() && outcome.iterations < 60, "{outcome}");
    let q = [-1.7e308, 1.6e308];
    let (outcome, _) = solve(generic(), &q, &[0.0; 2], Limits::absolute(1e-10));
    assert_eq!(outcome.status, Status::Diverged(Divergence::Residual));
    assert_eq!((outcome.iterations, outcome.residual.l2), (0, f64::INFINITY));
    // A part of an infinite norm is no tolerance.
    let refused = Solver::new(generic()).solve(&q, Limits::relative(1e-10)).unwrap_err();
    assert!(matches!(refused, Error::Parameter { value: f64::INFINITY, .. }), "{refused}");
}

/// Near the smallest number: subnormal data converge as far as they have digits, and rest where
/// they have none left.
#[test]
fn underflow() {
    for (scale, converges) in [(1e-300, true), (1e-310, true), (1e-320, false), (5e-324, false)] {
        let q = [-7.0 * scale, 3.0 * scale];
        let (outcome, _) = solve(generic(), &q, &[0.0; 2], Limits::relative(1e-10));
        let expected = if converges { Status::Converged } else { Status::Stagnated };
        assert_eq!(outcome.status, expected, "{scale:e}");
        assert!(outcome.iterations < 60 && outcome.residual.l2 <= 1e-3 * 7.0 * scale + 5e-323);
    }
}

/// Springs whose stiffness varies by 10⁸: the answer meets no tolerance, and solves a problem that
/// differs in the last digits. A pair without a solution has no such excuse.
#[test]
fn rounding_is_named_as_the_reason() {
    let n = 2000;
    let string = |phase: f64| {
        let stiffness = |i: usize| 10_f64.powf(4.0 * (phase * i as f64).sin());
        let row = |i, _| {
            let [left, right] = [stiffness(i), stiffness(i + 1)];
            [0.0, -left, left + right, -right, 0.0]
        };
        FivePoint::from_fn(n, 1, row).unwrap()
    };
    let q: Vec<f64> = (0..n).map(|i| (0.37 * i as f64).cos() - 0.3).collect();
    let auto = |a: &dyn Rows<f64>, q: &[f64]| {
        let b = Identity { order: q.len() };
        by("AUTO", a, &b).unwrap().solve(q, Limits::relative(1e-13)).unwrap()
    };
    for phase in [1.2, 1.35, 1.5, 1.7, 2.0] {
        let outcome = auto(&string(phase), &q);
        let error = outcome.backward_error.expect("rounding");
        assert!(!outcome.converged() && outcome.relative.l2 > 1e-10, "{outcome}");
        let names = outcome.to_string().contains("rounding");
        assert!(error <= 64.0 * f64::EPSILON && names, "{phase}: {outcome}");
    }

    // z₁ − 2 z₂ ≥ 1 and z₂ − 2 z₁ ≥ 1 would add up to z₁ + z₂ ≤ −2.
    let a = FivePoint::new(2, 1, [0.0, -2.0, 1.0, -2.0, 0.0]).unwrap();
    let outcome = auto(&a, &[-1.0, -1.0]);
    assert!(!outcome.converged() && outcome.backward_error.is_none(), "{outcome}");
}
