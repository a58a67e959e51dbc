//! Every way a solve can end, each on a problem that must end that way.

use std::{ops::ControlFlow, time::Duration};

use crate::common::{Altered, Failing, from, named, over, solve_from_ones, tmgs};
use crate::failures::solve as ends;
use hlcp_core::{
    Aor, DiagonalMatrix, FivePoint, Hlcp, Identity, Jacobi, Norms, Omega, Scalar, Tridiagonal,
};
use hlcp_methods::{
    Divergence, GROWTH, Limits, Method, Mms, Norm, Options, PATIENCE, Solver, Status, Tmms,
    Tolerance,
};
use proptest::{array::uniform5, collection::vec, prelude::*};

/// A generic non-symmetric pair of stencils with a varying Ω.
fn pair<T: Scalar>() -> Hlcp<T, FivePoint<T>, FivePoint<T>> {
    let to = |v: f64| T::from(v).unwrap();
    let a = FivePoint::new(7, 5, [-1.1, -0.9, 6.3, -1.3, -0.7].map(to)).unwrap();
    let b = FivePoint::new(7, 5, [-0.2, -0.8, 4.1, -0.6, -0.3].map(to)).unwrap();
    let omega = (0..35).map(|i| to(1.2 + 0.3 * f64::sin(i as f64))).collect();
    Hlcp::new(a, b, Omega::Each(omega)).unwrap().with_gamma(to(1.7)).unwrap()
}

/// Entries of both signs, of which none is zero.
fn wave<T: Scalar>(scale: f64) -> Vec<T> {
    (0..35).map(|i| T::from(scale * (f64::sin(1.3 * f64::from(i)) + 0.2)).unwrap()).collect()
}

/// Where the best iterate lies neither at the start nor at the end.
#[test]
fn the_best_iterate_comes_back_from_the_middle_of_a_solve() {
    // Row 0 contracts fast, row 1 grows slowly from almost nothing.
    let scale = |rhs: &[f64], y: &mut [f64]| (y[0], y[1]) = (rhs[0] / 2.2, rhs[1] / 0.8);
    let a = DiagonalMatrix::new(vec![1.1, 0.9]).unwrap();
    let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Each(vec![1.1, 0.9])).unwrap();
    let methods: [Box<dyn Method<f64, A = _, B = _>>; 2] = [
        Box::new(Mms::with_splitting(problem.clone(), scale).unwrap()),
        Box::new(Tmms::with_splittings(problem, scale, scale).unwrap()),
    ];
    for method in methods {
        let start = [9.0, 0.5 / 0.9 + 1e-9];
        let (outcome, _) = ends(method, &[-1.0, -1.0], &start, Limits::absolute(1e-10));
        assert!(matches!(outcome.status, Status::Diverged(_)));
        assert!(0 < outcome.answer && outcome.answer < outcome.iterations);
    }
}

#[test]
fn divergence_by_nan_says_where_and_when() {
    let problem = Hlcp::new(Failing::after(2), Identity { order: 3 }, Omega::Uniform(2.5)).unwrap();
    let mut solver = Solver::new(Mms::with_splitting(problem, over(9.0)).unwrap());
    let outcome = solver.solve(&[-1.5, 2.0, 0.5], from(&[0.3; 3])).unwrap();
    // Products 0 and 1 are sound, so iterates 0, 1 and 2 are; the residual of the last is not.
    assert_eq!(outcome.status, Status::Diverged(Divergence::Residual));
    assert_eq!((outcome.iterations, outcome.answer), (2, 1));
    assert!(!outcome.converged() && outcome.residual.l2.is_nan()); // measured, by an operator gone bad

    let breaks = |_: &[f64], y: &mut [f64]| y.copy_from_slice(&[0.0, 0.0, f64::INFINITY]);
    let a = DiagonalMatrix::new(vec![2.5; 3]).unwrap();
    let problem = Hlcp::new(a, Identity { order: 3 }, Omega::Uniform(2.5)).unwrap();
    let mut solver = Solver::new(Mms::with_splitting(problem, breaks).unwrap());
    let outcome = solver.solve(&[-1.5, 2.0, 0.5], from(&[0.3; 3])).unwrap();
    assert_eq!(outcome.status, Status::Diverged(Divergence::Entry { index: 2 }));
    assert_eq!((outcome.iterations, outcome.answer), (1, 0));
    assert!(outcome.residual.l2.is_finite());
}

/// What no precision can reach, by sweeps and by accelerations, whose iterates may also come round.
fn rests_at_the_floor<T: Scalar>() {
    let limits = Limits { rounding: Some(0.0), ..Limits::absolute(0.0) };
    for name in ["TMGS", "MGS", "ANDERSON", "NEWTON"] {
        let mut solver = Solver::new(named(name, [1.0; 2]).on(pair::<T>()).unwrap());
        let outcome = solver.solve(&wave(1.0), Options::from_x(&wave(0.3)).limits(limits)).unwrap();
        let cycles = !name.ends_with("GS") && matches!(outcome.status, Status::Cycling { .. });
        assert!(outcome.status == Status::Stagnated || cycles, "{outcome}");
        assert!(outcome.iterations < 100 + 2 * PATIENCE);
        // Some ten terms a row, each no larger than 12 and rounded to ε/2, over 35 rows.
        let epsilon = T::epsilon().to_f64().unwrap();
        assert!(outcome.residual.l2 <= 10.0 * 12.0 * 0.5 * epsilon * 35_f64.sqrt());
    }
}

#[test]
fn the_rounding_floor_is_stagnation() {
    rests_at_the_floor::<f64>();
    rests_at_the_floor::<f32>();
}

/// Jacobi's iteration for the LCP with a lower bidiagonal matrix, and Ω = its diagonal.
fn bidiagonal(
    order: usize,
    on: f64,
    below: impl Fn(usize) -> f64 + Send + Sync,
) -> Solver<f64, impl Method<f64>> {
    let a = Tridiagonal::new(order, move |i| [below(i), on, 0.0]).unwrap();
    let problem = Hlcp::new(a, Identity { order }, Omega::Uniform(on)).unwrap();
    Solver::new(Mms::new(problem, Aor::jacobi()).unwrap()).with_history(100)
}

/// Jacobi along the flow moves an error one row a sweep and leaves its size alone: the residual
/// repeats exactly, the iterates do not, and that is no cycle.
#[test]
fn a_residual_that_repeats_is_not_yet_a_cycle() {
    let n = 40;
    let mut solver = bidiagonal(n, 2.0, |_| -2.0);
    let mut q = vec![0.0; n];
    q[0] = -4.0;
    let mut x0 = vec![1.0; n];
    x0[0] = 3.0;
    let outcome = solver.solve(&q, from(&x0)).unwrap();
    assert!(outcome.converged(), "{outcome}");
    let residuals = solver.history();
    assert!(residuals[2..12].iter().all(|norms| norms.l2 == residuals[1].l2));
}

#[test]
fn limits_and_the_observer_stop_a_solve() {
    let mut solver = Solver::new(Mms::new(pair(), Aor::gauss_seidel()).unwrap()).with_history(500);
    let (q, x0) = (wave(1.0), wave(0.3));
    let full = solver.solve(&q, from(&x0)).unwrap();
    assert!(full.converged());

    assert_eq!(solver.history().len(), full.iterations + 1);
    let mut copy = solver.clone(); // with its history's limit
    let _ = copy.solve(&q, from(&x0)).unwrap();
    assert_eq!(copy.history(), solver.history());

    let limits = Limits { iterations: 3, ..Limits::absolute(1e-10) };
    let (outcome, _) = ends(Mms::new(pair(), Aor::gauss_seidel()).unwrap(), &q, &x0, limits);
    assert_eq!((outcome.status, outcome.iterations), (Status::IterationLimit, 3));

    let limits = Limits { time: Some(Duration::ZERO), ..Limits::absolute(1e-10) };
    let outcome = solver.solve(&q, Options::from_x(&x0).limits(limits)).unwrap();
    assert_eq!((outcome.status, outcome.iterations), (Status::TimeLimit, 0));

    let mut seen = vec![];
    let options = from(&x0).observer(|progress| {
        seen.push((progress.iteration, progress.residual, progress.x[3]));
        if progress.iteration == 5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let outcome = solver.solve(&q, options).unwrap();
    assert_eq!((outcome.status, outcome.iterations), (Status::Stopped, 5));
    assert_eq!(seen.iter().map(|s| s.0).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
    assert_eq!(seen.iter().map(|s| s.1).collect::<Vec<_>>(), solver.history());
    assert_eq!((seen[0].2, seen[outcome.answer].2), (x0[3], solver.x()[3]));
}

/// A method whose steps see a multiple of the residual.
fn flatterer<M: Method<f64>>(of: M, by: f64) -> impl Method<f64, A = M::A, B = M::B> {
    Altered::new(of, move |_, _, _, Norms { l2, linf }, _| Norms { l2: l2 * by, linf: linf * by })
}

#[test]
fn convergence_is_decided_by_the_recomputed_residual() {
    let (q, x0) = (wave(1.0), wave(0.3));
    for name in ["MGS", "TMGS"] {
        let method = || named(name, [1.0; 2]).on(pair()).unwrap();
        let mut honest = Solver::new(method());
        let expected = honest.solve(&q, from(&x0)).unwrap();
        let mut solver = Solver::new(flatterer(method(), 1e-3));
        let outcome = solver.solve(&q, from(&x0)).unwrap();
        assert!(outcome.converged() && outcome.residual.l2 <= 1e-10);
        // The same iterates, in spite of the checks that failed between.
        assert_eq!(outcome.iterations, expected.iterations);
        assert_eq!(solver.x(), honest.x());
        // And where it may not go on, the last and best of them comes back.
        let limits = Limits { iterations: expected.iterations - 1, ..Limits::absolute(1e-10) };
        let outcome = solver.solve(&q, Options::from_x(&x0).limits(limits)).unwrap();
        assert_eq!((outcome.status, outcome.answer), (Status::IterationLimit, limits.iterations));
        let _ = honest.solve(&q, Options::from_x(&x0).limits(limits)).unwrap();
        assert_eq!(solver.x(), honest.x());
    }
}

#[test]
fn an_answer_within_the_tolerance_has_converged_though_its_step_reports_more() {
    let (q, x0) = (wave(1.0), wave(0.3));
    let method = || Mms::new(pair(), Aor::gauss_seidel()).unwrap();
    let expected = Solver::new(method()).solve(&q, from(&x0)).unwrap();
    let limits = Limits { iterations: expected.iterations, ..Limits::absolute(1e-10) };
    let outcome = Solver::new(flatterer(method(), 1e3))
        .solve(&q, Options::from_x(&x0).limits(limits))
        .unwrap();
    assert!(outcome.converged(), "{outcome}");
}

/// γ stretches x and nothing else, to the bit for powers of two, however large.
#[test]
fn gamma_changes_no_norm_and_no_count() {
    let solve = |power: i32| {
        let gamma = 2_f64.powi(power);
        let problem = pair::<f64>().with_gamma(gamma).unwrap();
        let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
        solver.solve(&wave(1.0), from(&wave(0.3 * gamma))).unwrap()
    };
    let expected = solve(0);
    for power in [-800, -300, 300, 800] {
        let outcome = solve(power);
        assert_eq!((outcome.status, outcome.iterations), (expected.status, expected.iterations));
        assert_eq!(outcome.residual, expected.residual);
    }
}

#[test]
fn a_small_residual_beside_a_large_q_is_not_taken_for_zero() {
    let steps = |rhs: &[f64], y: &mut [f64]| (y[0], y[1]) = (rhs[0] / 2.0, rhs[1] / 20.0);
    let problem = Hlcp::lcp(Identity { order: 2 }).unwrap();
    let mut solver = Solver::new(Mms::with_splitting(problem, steps).unwrap());
    let limits = Limits { iterations: 1, ..Limits::absolute(0.0) };
    let outcome =
        solver.solve(&[-1.0, -1e-170], Options::from_x(&[0.0, 0.0]).limits(limits)).unwrap();
    assert!(!outcome.converged() && outcome.residual.l2 >= outcome.residual.linf);
    assert!(outcome.residual.linf > 0.0);
}

/// A relative tolerance is in the norm of the test; an absolute one is at most a thousandth of ‖q‖.
#[test]
fn tolerances_are_relative_or_absolute() {
    let (q, x0) = (wave::<f64>(1.0), wave::<f64>(0.3));
    let norms = Norms::of(&q);
    let mut solver = Solver::new(Mms::new(pair(), Aor::gauss_seidel()).unwrap());
    solver = solver.with_history(usize::MAX); // which no memory holds
    for (norm, of_q) in [(Norm::L2, norms.l2), (Norm::LInf, norms.linf)] {
        assert!(of_q > 1.0);
        for (tolerance, asked) in [
            (Tolerance::Relative(1e-5), 1e-5 * of_q),
            (Tolerance::Relative(1e-3), 1e-3 * of_q),
            (Tolerance::Relative(0.5), 0.5 * of_q),
            (Tolerance::Absolute(1e-9), 1e-9),
            (Tolerance::Absolute(1e-3), 1e-3),
            (Tolerance::Absolute(0.5), 1e-3 * of_q),
        ] {
            let limits = Limits { tolerance, norm, ..Limits::default() };
            let outcome = solver.solve(&q, Options::from_x(&x0).limits(limits)).unwrap();
            let residuals: Vec<f64> = solver.history().iter().map(|&n| norm.of(n)).collect();
            let first = residuals.iter().position(|&residual| residual <= asked);
            assert_eq!(first, Some(outcome.iterations));
        }
    }
}

/// Single precision reaches its default tolerance also where z is smooth and A z much smaller than
/// |A| z.
#[test]
fn single_precision_reaches_what_it_can() {
    for m in [16_usize, 64, 128] {
        let a = FivePoint::new(m, m, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
        let problem = Hlcp::new(a, Identity { order: m * m }, Omega::Uniform(4.0_f32)).unwrap();
        let mut solver = Solver::new(tmgs(problem));
        let at = |k: usize| f64::from((k % m + 1) as u32) / (m + 1) as f64 * 6.0;
        let q: Vec<f32> =
            (0..m * m).map(|k| (at(k).sin() * at(k / m).cos() - 0.3) as f32).collect();
        let outcome = solve_from_ones(&mut solver, &q, Limits::absolute(1e-10));
        assert!(outcome.converged(), "{m}: {outcome}");
        // And no more than rounding is forgiven: the same stencil's rows have length √20, and |A| z
        // ≤ 8 z.
        let size = Norms::of(solver.z()).l2 * 20_f64.sqrt() * 1.2
            + Norms::of(solver.r()).l2
            + Norms::of(&q).l2;
        assert!(outcome.residual.l2 <= 4.0 * f64::from(f32::EPSILON) * size);
    }
}

/// Beside an entry of 10¹⁶ that has settled, the others' movement is no rounding.
#[test]
fn a_long_transient_is_no_stagnation() {
    let n = 161;
    let mut solver = bidiagonal(n, 1.0, |i| if i > 1 { -1.02 } else { 0.0 });
    let mut q = vec![0.0; n];
    (q[0], q[1]) = (-1e16, -1.0);
    let outcome = solver.solve(&q, from(&vec![0.0; n])).unwrap();
    assert!(outcome.converged(), "{outcome}");
}

/// An error of 10⁻¹¹ beside iterates of size ½ moves along 1500 rows: small, but no rounding.
#[test]
fn a_small_movement_is_no_stagnation() {
    let n = 1500;
    let mut solver = bidiagonal(n, 1.0, |_| -1.0);
    let (mut q, mut x0) = (vec![0.0; n], vec![0.5; n]);
    (q[0], x0[0]) = (-1.0, 0.5 + 1e-11);
    let limits = Limits::absolute(1e-13);
    let outcome = solver.solve(&q, Options::from_x(&x0).limits(limits)).unwrap();
    assert!(outcome.converged() && outcome.iterations > PATIENCE, "{outcome}");
}

/// Growth is judged beside ‖q‖ too: a start that is nearly solved may grow 10¹⁷-fold and be small
/// still.
#[test]
fn growth_from_almost_nothing_is_no_divergence() {
    let n = 13;
    let mut solver = bidiagonal(n, 1.5, |_| -60.0);
    let mut q = vec![60.0 - 1.5; n]; // z = 1
    q[0] = -1.5;
    let mut x0 = vec![0.5; n];
    x0[0] += 1e-8;
    let limits = Limits::relative(1e-11);
    let outcome = solver.solve(&q, Options::from_x(&x0).limits(limits)).unwrap();
    assert!(outcome.converged(), "{outcome}");
    let largest = solver.history().iter().fold(0.0, |max: f64, norms| max.max(norms.l2));
    assert!(largest > GROWTH * solver.history()[0].l2);
}

/// A cycle is found also after a residual has repeated without one.
#[test]
fn a_cycle_behind_a_false_suspicion() {
    let n = 41;
    let below = |i| if i + 1 < n { -2.0 } else { 0.0 };
    let matrix = Tridiagonal::new(n, |i| [below(i), 2.0, 0.0]).unwrap();
    let problem = Hlcp::new(matrix, Identity { order: n }, Omega::Uniform(2.0)).unwrap();
    // Jacobi for the flow, and twice its step for the last row, which then alternates.
    let steps = move |rhs: &[f64], y: &mut [f64]| {
        for (i, (y, rhs)) in y.iter_mut().zip(rhs).enumerate() {
            *y = rhs / if i + 1 < n { 4.0 } else { 2.0 };
        }
    };
    let mut solver = Solver::new(Mms::with_splitting(problem, steps).unwrap());
    let (mut q, mut x0) = (vec![0.0; n], vec![1.0; n]);
    (q[0], q[n - 1], x0[0], x0[n - 1]) = (-4.0, -3.0, 3.0, 0.25);
    let outcome = solver.solve(&q, from(&x0)).unwrap();
    assert_eq!(outcome.status, Status::Cycling { period: 2 }, "{outcome}");
}

/// Scaling the data and the start by a power of two scales the iterates and nothing else;
/// `answers.rs` has powers of ten.
fn scales<T: Scalar>(powers: [i32; 2]) {
    let relative = 64.0 * T::epsilon().to_f64().unwrap();
    let limits = Limits { rounding: Some(0.0), ..Limits::relative(relative) };
    for norm in [Norm::L2, Norm::LInf] {
        let limits = Limits { norm, ..limits };
        let solve = |scale: f64| {
            let mut solver =
                Solver::new(Tmms::mirrored(pair(), Aor::sor(T::one()).unwrap()).unwrap());
            let outcome = solver
                .solve(&wave::<T>(scale), Options::from_x(&wave::<T>(0.3 * scale)).limits(limits))
                .unwrap();
            (outcome, solver.z().to_vec())
        };
        let (unit, z) = solve(1.0);
        assert!(unit.converged());
        for power in powers {
            let factor = 2_f64.powi(power);
            let (outcome, scaled) = solve(factor);
            assert!(outcome.converged());
            assert_eq!(outcome.iterations, unit.iterations);
            assert_eq!(outcome.residual.l2, unit.residual.l2 * factor);
            let factor = T::from(factor).unwrap();
            assert!(z.iter().zip(scaled).all(|(&z, scaled)| z * factor == scaled));
        }
    }
}

/// However small q is beside the start, or large, the start is no divergence and the answer no
/// false success.
#[test]
fn the_scale_of_the_start_does_not_matter() {
    let limits = Limits::relative(1e-12);
    for scale in [1e-200, 1e-100, 1.0, 1e100, 1e200] {
        let problems: [Box<dyn Method<f64, A = _, B = _>>; 2] = [
            Box::new(Tmms::mirrored(pair(), Aor::sor(1.0).unwrap()).unwrap()),
            Box::new(Mms::new(pair(), Jacobi).unwrap()),
        ];
        for method in problems {
            let mut solver = Solver::new(method);
            let outcome =
                solver.solve(&wave(scale), Options::from_x(&wave(1.0)).limits(limits)).unwrap();
            assert!(outcome.converged(), "{scale:e}: {outcome}");
            let size = solver.z().iter().chain(solver.r()).fold(0.0, |max: f64, &v| max.max(v));
            assert!((0.01..10.0).contains(&(size / scale)), "{scale:e}: {size:e}");
        }
    }
}

#[test]
fn the_scale_of_the_data_does_not_matter() {
    scales::<f64>([498, -498]);
    scales::<f32>([60, -60]);
}

/// Whatever the bits, a solve answers: with an error, or with an outcome that holds.
fn answers<T: Scalar>(
    nx: usize,
    ny: usize,
    [a, b]: [[T; 5]; 2],
    numbers: [T; 5],
    [q, x0, omega]: [&[T]; 3],
) {
    let [alpha, beta, gamma, absolute, relative] = numbers;
    let [absolute, relative] = [absolute, relative].map(|v| v.to_f64().unwrap());
    let run = |tolerance| -> Result<(), hlcp_core::Error> {
        let limits = Limits { tolerance, rounding: Some(0.0), iterations: 40, ..Limits::default() };
        let (a, b) = (FivePoint::new(nx, ny, a)?, FivePoint::new(nx, ny, b)?);
        let omega = match omega.first() {
            Some(&omega) if nx == 1 => Omega::Uniform(omega),
            _ => Omega::Each(omega.to_vec()),
        };
        let problem = Hlcp::new(a, b, omega)?.with_gamma(gamma)?;
        let mut solver = Solver::new(Tmms::mirrored(problem, Aor::new(alpha, beta)?)?);
        let outcome = solver.solve(q, Options::from_x(x0).limits(limits))?;
        if outcome.converged() {
            // ‖q‖₂ ≤ √n max|qᵢ|, which neither overflows nor vanishes before the product does.
            let largest = q.iter().fold(0.0, |max: f64, q| max.max(q.to_f64().unwrap().abs()));
            let norm = largest * (q.len() as f64).sqrt() * (1.0 + 1e-12);
            let bound = match tolerance {
                Tolerance::Relative(relative) => relative * norm,
                Tolerance::Absolute(absolute) => absolute.min(1e-3 * norm),
            };
            assert!(outcome.residual.l2 <= bound, "{} > {bound}", outcome.residual.l2);
            assert!(outcome.residual.l2.is_finite());
        }
        Ok(())
    };
    let _ = run(Tolerance::Absolute(absolute));
    assert!(run(Tolerance::Relative(relative)).is_err() || relative < 1.0);
}

/// Numbers of every kind: special ones, ordinary ones, and any bits at all.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        2 => -4.0..4.0,
        4 => 0.1..4.0,
        1 => any::<u64>().prop_map(f64::from_bits),
        1 => prop::sample::select(vec![
            0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e-160, 1e160,
        ]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn no_data_panics(
        nx in 0_usize..5,
        ny in 0_usize..5,
        a in uniform5(number()),
        b in uniform5(number()),
        numbers in uniform5(number()),
        q in vec(number(), 0..26),
        x0 in vec(number(), 0..26),
        omega in vec(number(), 0..26),
        fit in any::<bool>(),
    ) {
        let fitted = |v: &[f64]| -> Vec<f64> {
            if fit { (0..nx * ny).map(|i| v.get(i).copied().unwrap_or(1.5)).collect() } else { v.to_vec() }
        };
        let [q, x0, omega] = [&q, &x0, &omega].map(|v| fitted(v));
        answers(nx, ny, [a, b], numbers, [&q, &x0, &omega]);
        let narrow = |v: &[f64]| v.iter().map(|&v| v as f32).collect::<Vec<_>>();
        answers(
            nx,
            ny,
            [a, b].map(|c| c.map(|v| v as f32)),
            numbers.map(|v| v as f32),
            [&narrow(&q), &narrow(&x0), &narrow(&omega)],
        );
    }
}
