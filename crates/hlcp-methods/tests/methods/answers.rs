//! Decisions of a solve that must not depend on units, on how long a step takes, or on what a
//! residual looks like in rounding.

use std::ops::ControlFlow;

use crate::common::{Altered, Dynamic, Walked, by, named};
use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega, Rhs, Scaled};
use hlcp_methods::{
    Clock, Cycle, FullMultigrid, Limits, Method, Mms, Multigrid, Options, Outcome, Solver, Status,
};

const M: usize = 24;

type Grid = Scaled<f64, FivePoint<f64>>;
type Diagonals = Scaled<f64, Identity>;

/// A contact on a square, in the units that a factor of A and B and one of q make.
fn posed(pair: f64, load: f64) -> (Grid, Diagonals, Vec<f64>) {
    let a = FivePoint::new(M, M, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    let q = (0..M * M).map(|k| {
        let at = |i: usize| i as f64 / M as f64 - 0.4;
        let (x, y) = (at(k % M), at(k / M));
        pair * load * (0.05 - x * x - 2.0 * y * y)
    });
    let b = Scaled { by: pair, of: Identity { order: M * M } };
    (Scaled { by: pair, of: a }, b, q.collect())
}

/// q in units of 1e±12, and A, B and q: powers of ten, so that no bit stays but every decision
/// does.
#[test]
fn units_change_no_decision() {
    let outcomes = |pair: f64, load: f64| {
        let (a, b, q) = posed(pair, load);
        let names = ["MGS", "TMGS", "ADAPTIVE", "ANDERSON", "NEWTON", "MGW", "FMG", "AUTO"];
        names.map(|name| by(name, &a, &b).unwrap().solve(&q, Limits::default()).unwrap())
    };
    let plain = outcomes(1.0, 1.0);
    assert!(plain.iter().all(Outcome::converged));
    for (pair, load) in [(1.0, 1e-12), (1.0, 1e12), (1e-12, 1.0), (1e12, 1.0), (1e-9, 1e-9)] {
        for (plain, scaled) in plain.iter().zip(outcomes(pair, load)) {
            assert_eq!(scaled.status, Status::Converged, "{pair:e} {load:e}: {scaled}");
            // Rounding differs, and may move the end by an iteration in tens.
            let moved = plain.iterations.abs_diff(scaled.iterations);
            assert!(moved <= 1 + plain.iterations / 10, "{pair:e} {load:e}: {plain}, {scaled}");
            assert!(scaled.relative.l2 <= 1e-10);
        }
    }
}

/// Powers of two whose squares overflow or vanish; `outcomes.rs` has sweeps.
#[test]
fn scaling_q_scales_the_iterates_of_newtons_methods() {
    let counts = |power: i32| {
        let ((a, b, mut q), scale) = (posed(1.0, 1.0), 2_f64.powi(power));
        q.iter_mut().for_each(|q| *q *= scale);
        ["NEWTON", "AMG"].map(|name| {
            let start = [0.3 * scale; M * M];
            let options = Options::from_x(&start).limits(Limits::relative(1e-12));
            let outcome = by(name, &a, &b).unwrap().solve(&q, options).unwrap();
            assert!(outcome.converged(), "{outcome}");
            (outcome.iterations, outcome.linear_iterations)
        })
    };
    for power in [-700, 700] {
        assert_eq!(counts(power), counts(0));
    }
}

/// Multigrid asks before each of its long sweeps, on its way down and in nested iteration.
#[test]
fn cycles_end_with_the_time() {
    let m = 256;
    let a = FivePoint::new(m, m, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    let problem = Hlcp::new(a, Identity { order: m * m }, Omega::Uniform(4.0)).unwrap();
    let mut plain = Multigrid::new(problem, Cycle::W).unwrap();
    let mut full = FullMultigrid::new(plain.clone());
    let q = vec![-1.0; m * m];
    let methods: [&mut dyn Method<f64, A = _, B = _>; 2] = [&mut plain, &mut full];
    for method in methods {
        let mut asked = 0;
        let mut ask = || {
            asked += 1;
            asked > 3
        };
        let mut y = vec![0.0; m * m];
        let q = Rhs::new(&q).unwrap();
        let norms = method.step(&q, &vec![1.0; m * m], &mut y, &mut Clock::new(&mut ask));
        assert!(norms.l2.is_finite());
        assert_eq!(asked, 4, "asked until the time is up, and no more");
    }
}

/// Between two looks at the clock, and after the last, no step walks over the rows more often than
/// a sweep, or a pair, and what measures it.
#[test]
fn steps_look_at_the_clock_between_sweeps() {
    const WALKS: usize = 3;
    let m = 180;
    let a = Walked::new(FivePoint::new(m, m, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap());
    let b = Identity { order: m * m };
    let q: Vec<f64> = (0..m * m).map(|k| (0.01 * k as f64).sin() - 0.3).collect();
    let q = Rhs::new(&q).unwrap();
    for name in ["NEWTON", "ANDERSON", "AMG"] {
        let problem = Dynamic::new(&a, &b, Omega::Uniform(4.0)).unwrap();
        let mut method = named(name, [1.0; 2]).on_dyn(problem).unwrap();
        let mut cut = |late: usize| {
            method.restart();
            let (x, mut y) = (vec![1.0; m * m], vec![0.0; m * m]);
            let (_, asked, most) = a.cut(late, |clock| method.step(&q, &x, &mut y, clock));
            (asked, most)
        };
        let (whole, most) = cut(usize::MAX);
        assert!(most <= WALKS, "{name}: {most} walks of {whole} looks");
        for late in (0..6).chain((1..12).map(|k| whole * k / 12)).filter(|late| *late < whole) {
            let (asked, most) = cut(late);
            assert!(asked == late + 1 && most <= WALKS, "{name}, {late}: {asked}, {most} walks");
        }
    }
}

/// An observer that says stop in the middle of a long step is heard then, and what the step left
/// of the next iterate is not looked at.
#[test]
fn an_observer_stops_a_long_step() {
    let problem = Hlcp::lcp(Identity { order: 2 }).unwrap();
    let base = Mms::new(problem, Aor::gauss_seidel()).unwrap();
    // It lasts until its clock is up, and leaves nothing but NaN.
    let mut solver = Solver::new(Altered::new(base, |_, _, y, norms, clock| {
        while !clock.is_up() {}
        y.fill(f64::NAN);
        norms
    }));
    let mut seen = 0;
    let mut stop = |progress: &hlcp_methods::Progress<'_, f64>| {
        assert_eq!((progress.iteration, progress.x), (0, &[0.25, 0.25][..]));
        seen += 1;
        if seen == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let options = Options::from_x(&[0.25, 0.25]).observer(&mut stop);
    let outcome = solver.solve(&[-3.0, 3.0], options).unwrap();
    assert_eq!((outcome.status, outcome.iterations, outcome.answer), (Status::Stopped, 0, 0));
    assert_eq!(solver.z(), [0.5, 0.5]);
    assert!(outcome.residual.l2.is_finite());
}

/// A start so far away that its residual over ‖q‖ is beyond the largest number.
#[test]
fn walked_and_fused_sweeps_judge_a_far_start_alike() {
    for (entry, q, x0) in [(1e8, -1e-300, 1.0), (1.0, -1e-200, 1e110)] {
        let a = FivePoint::new(1, 1, [0.0, 0.0, entry, 0.0, 0.0]).unwrap();
        let omega = || Omega::Uniform(entry);
        let fused = Hlcp::new(a, Identity { order: 1 }, omega()).unwrap();
        let walked = Hlcp::new(Walked::new(a), Identity { order: 1 }, omega()).unwrap();
        let gs = Aor::gauss_seidel();
        let [fused, walked] = [
            Solver::new(Mms::new(fused, gs).unwrap()).solve(&[q], Options::from_x(&[x0])).unwrap(),
            Solver::new(Mms::new(walked, gs).unwrap()).solve(&[q], Options::from_x(&[x0])).unwrap(),
        ];
        assert_eq!(fused.status, Status::Converged, "{fused}");
        assert_eq!((walked.status, walked.iterations), (fused.status, fused.iterations));
    }
}

/// An answer that is exact in floating point meets every tolerance, zero included: z = (½, 0, 3/2).
#[test]
fn an_exact_answer_converges_to_a_tolerance_of_zero() {
    let a = FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0]).unwrap();
    for limits in [Limits::relative(0.0), Limits::absolute(0.0), Limits::relative(1e-30)] {
        let problem = Hlcp::new(a, Identity { order: 3 }, Omega::Uniform(4.0)).unwrap();
        let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
        let outcome = solver.solve(&[-2.0, 5.0, -6.0], limits).unwrap();
        assert!(outcome.converged() && outcome.residual.linf == 0.0, "{outcome}");
        assert_eq!((solver.z(), solver.r()), (&[0.5, 0.0, 1.5][..], &[0.0, 3.0, 0.0][..]));
    }
}
