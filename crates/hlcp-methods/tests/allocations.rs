//! A solve takes no more vectors than documented. That later solves, and so their steps, allocate
//! nothing is one of the contracts.

#[path = "../../../tests/common/mod.rs"]
mod common;
#[path = "../../../tests/common/counting.rs"]
mod counting;

use common::{from, problem, tmgs};
use counting::{CALLS, LIVE, PEAK};
use hlcp_core::{FivePoint, Hlcp};
use hlcp_methods::{Anderson, Cycle, Method, Multigrid, Named, Newton, Solver, Ssor};
use hlcp_verify::{Disc, Example};

/// How many vectors of the problem's order a solver by the method takes, with those of its method,
/// in a solve, which must converge.
fn vectors<M: Method<f64>>(method: impl FnOnce() -> M, q: &[f64]) -> f64 {
    let (start, before) = (vec![1.0; q.len()], LIVE.get());
    PEAK.set(before);
    let mut solver = Solver::new(method());
    let outcome = solver.solve(q, from(&start)).unwrap();
    assert!(outcome.converged(), "{outcome}");
    (PEAK.get() - before) as f64 / (8 * q.len()) as f64
}

type Stencils = Hlcp<f64, FivePoint<f64>, FivePoint<f64>>;

fn example(m: usize) -> (Stencils, Vec<f64>) {
    let scene = Example { symmetric: true, m, mu: 4.0, nu: 3.0 }.pose().unwrap();
    (problem(0.9, scene.a, scene.b), scene.q)
}

/// The names of every family and of both readings of two steps.
const NAMES: [&str; 6] = ["MJ", "MGS", "AMGS", "TMGS", "TMAOR3", "TMGSSOR2"];

/// Beside the five vectors of a solve, of which two are the caller's: 2m + 3 for Anderson with a
/// window of m, and 11 for Newton.
#[test]
fn accelerations_take_the_vectors_they_say() {
    let (problem, q) = example(96);
    let tmgs = || tmgs(problem.clone());
    let anderson = |window| vectors(|| Anderson::new(tmgs(), window).unwrap(), &q);
    for (taken, own) in [
        (anderson(3), 9.0),
        (anderson(10), 23.0),
        (vectors(|| Newton::new(tmgs(), Ssor), &q), 11.0),
    ] {
        // And a few numbers that do not grow with n.
        assert!((taken - 3.0 - own).abs() <= 0.05, "{taken}");
    }
}

/// The construction of an accelerated solver takes all that its first solve needs.
#[test]
fn the_first_accelerated_solve_allocates_nothing() {
    let (problem, q) = example(96);
    let start = vec![1.0; q.len()];
    let check = |method: Box<dyn Method<f64, A = _, B = _>>| {
        let mut solver = Solver::new(method);
        let calls = CALLS.get();
        assert!(solver.solve(&q, from(&start)).unwrap().converged());
        assert_eq!(CALLS.get(), calls);
    };
    check(Box::new(Anderson::new(tmgs(problem.clone()), 3).unwrap()));
    check(Box::new(Anderson::new(tmgs(problem.clone()), 10).unwrap()));
    check(Box::new(Newton::new(tmgs(problem.clone()), Ssor)));
}

/// With `q` and the start, which are the caller's, a solve of a stencil pair takes five vectors.
#[test]
fn a_solve_of_stencils_takes_five_vectors() {
    let (problem, q) = example(96);
    for name in NAMES {
        let named: Named = name.parse().unwrap();
        let taken = vectors(|| named.on(problem.clone()).unwrap(), &q);
        assert!(taken + 2.0 <= 5.01, "{name}: {taken}");
    }
}

/// Beside the solver's vectors, of which the caller's two are not counted, multigrid takes 5n/3
/// numbers, and n more for cycles on trial: V-cycles stall here.
#[test]
fn multigrid_takes_five_thirds_of_a_vector() {
    for (cycle, vectors_said) in [(Cycle::W, 3.0 + 5.0 / 3.0), (Cycle::V, 4.0 + 5.0 / 3.0)] {
        let m = 255;
        let scene = Disc { lcp: true, m }.pose::<f64>().unwrap();
        let problem = problem(1.0, scene.a, scene.b);
        let taken = vectors(|| Multigrid::new(problem, cycle).unwrap(), &scene.q);
        // Six and a half numbers for each column and each row of each grid.
        assert!(taken <= vectors_said + 30.0 / m as f64, "{m}: {taken}");
    }
}
