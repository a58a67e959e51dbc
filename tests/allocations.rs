//! Steps after the first allocate nothing, and a solve takes no more vectors than documented; that later solves allocate
//! nothing is one of the contracts.

#[path = "common/counting.rs"]
mod counting;

use counting::{CALLS, LIVE, PEAK};
use hlcp_core::{Aor, Hlcp, Omega, Rhs};
use hlcp_methods::{
    Anderson, Clock, Cycle, Limits, Method, Multigrid, Named, Newton, Options, Parameters, Solver,
    Ssor, Tmms,
};
use hlcp_verify::{Disc, Example};

/// How many allocations `work` makes.
fn allocations(work: impl FnOnce()) -> usize {
    let before = CALLS.get();
    work();
    CALLS.get() - before
}

/// The names of every family and of both readings of two steps.
const NAMES: [&str; 6] = ["MJ", "MGS", "AMGS", "TMGS", "TMAOR3", "TMGSSOR2"];

/// Beside the five vectors of a solve: 2m + 3 for Anderson with a window of m, 11 for Newton, and all of them at once.
#[test]
fn accelerations_take_the_vectors_they_say() {
    let scene = Example { symmetric: true, m: 96, mu: 4.0, nu: 3.0 }.pose::<f64>().unwrap();
    let omega = Omega::diagonal_ratio(0.9, &scene.a, &scene.b).unwrap();
    let problem = Hlcp::new(scene.a, scene.b, omega).unwrap();
    let start = vec![1.0; scene.q.len()];
    type Boxed<A, B> = Box<dyn Method<f64, A = A, B = B>>;
    let check = |own: f64, make: &dyn Fn() -> Boxed<_, _>| {
        let before = LIVE.get();
        PEAK.set(before);
        let mut solver = Solver::new(make());
        let first = allocations(|| {
            let outcome = solver
                .solve(&scene.q, Options::from_x(&start).limits(Limits::absolute(1e-10)))
                .unwrap();
            assert!(outcome.converged());
        });
        assert_eq!(first, 0);
        let vectors = (PEAK.get() - before) as f64 / (8 * scene.q.len()) as f64;
        // And a few numbers that do not grow with n.
        assert!((vectors - 3.0 - own).abs() <= 0.05, "{vectors}");
    };
    let tmgs = || Tmms::mirrored(problem.clone(), Aor::gauss_seidel()).unwrap();
    check(9.0, &|| Box::new(Anderson::new(tmgs(), 3).unwrap()));
    check(23.0, &|| Box::new(Anderson::new(tmgs(), 10).unwrap()));
    check(11.0, &|| Box::new(Newton::new(tmgs(), Ssor)));
}

#[test]
fn a_step_by_hand_allocates_nothing_after_the_first() {
    let scene = Example { symmetric: true, m: 24, mu: 4.0, nu: 3.0 }.pose::<f32>().unwrap();
    let omega = Omega::diagonal_ratio(0.9, &scene.a, &scene.b).unwrap();
    let problem = Hlcp::new(scene.a, scene.b, omega).unwrap();
    let q = Rhs::new(&scene.q).unwrap();
    let (x, mut y) = (vec![1.0; scene.q.len()], vec![0.0; scene.q.len()]);
    let mut spare = y.clone();
    for name in NAMES {
        let mut method =
            Named::parse(name, Parameters::default()).unwrap().on(problem.clone()).unwrap();
        let mut iterate = || {
            let _ = method.step(&q, &x, &mut y, &mut Clock::endless());
            method.complete(&q, &mut y, &mut spare);
        };
        iterate();
        assert_eq!(allocations(iterate), 0);
    }
}

/// With `q` and the start, which are the caller's, a solve of a stencil pair takes five vectors.
#[test]
fn a_solve_of_stencils_takes_five_vectors() {
    let scene = Example { symmetric: true, m: 96, mu: 4.0, nu: 3.0 }.pose::<f64>().unwrap();
    let omega = Omega::diagonal_ratio(0.9, &scene.a, &scene.b).unwrap();
    let problem = Hlcp::new(scene.a, scene.b, omega).unwrap();
    let start = vec![1.0; scene.q.len()];
    for name in NAMES {
        let named = Named::parse(name, Parameters::default()).unwrap();
        let before = LIVE.get();
        PEAK.set(before);
        let mut solver = Solver::new(named.on(problem.clone()).unwrap());
        assert!(
            solver
                .solve(&scene.q, Options::from_x(&start).limits(Limits::absolute(1e-10)))
                .unwrap()
                .converged()
        );
        let vectors = (PEAK.get() - before) as f64 / (8 * scene.q.len()) as f64;
        assert!(vectors + 2.0 <= 5.01, "{name}: {vectors}");
    }
}

/// Multigrid: its 5n/3 beside the solver's five vectors, the caller's two among them; then n for cycles on trial.
#[test]
fn multigrid_takes_five_thirds_of_a_vector_and_then_nothing() {
    let solve = |m: usize, cycle: Cycle, vectors: f64| {
        let scene = Disc { lcp: true, m }.pose::<f64>().unwrap();
        let omega = Omega::diagonal_ratio(1.0, &scene.a, &scene.b).unwrap();
        let problem = Hlcp::new(scene.a, scene.b, omega).unwrap();
        let n = scene.q.len();
        let (start, before) = (vec![1.0; n], LIVE.get());
        PEAK.set(before);
        let mut solver = Solver::new(Multigrid::new(problem, cycle).unwrap());
        assert!(
            solver
                .solve(&scene.q, Options::from_x(&start).limits(Limits::absolute(1e-10)))
                .unwrap()
                .converged()
        );
        // Some hundred numbers a row for the axes, the rows that are relaxed side by side, and the zeros.
        let taken = (PEAK.get() - before) as f64 / (8 * n) as f64;
        assert!(taken <= vectors + 20.0 / m as f64, "{m}: {taken}");
        let count = allocations(|| {
            let again = solver
                .solve(&scene.q, Options::from_x(&start).limits(Limits::absolute(1e-10)))
                .unwrap();
            assert!(again.converged());
        });
        assert_eq!(count, 0);
    };
    solve(255, Cycle::W, 3.0 + 5.0 / 3.0);
    // V-cycles here stall, and are put on trial.
    solve(255, Cycle::V, 4.0 + 5.0 / 3.0);
}
