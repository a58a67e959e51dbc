//! The method that chooses its own parameters, and the solve in two precisions.

use std::{f64::consts::TAU, ops::ControlFlow};

use crate::common::{Dynamic, problem, solve_from_ones, tmgs};
use crate::newton::torsion;
use hlcp_core::{
    Aor, Error, FivePoint, Hlcp, Identity, Omega, Rhs, RowMajor, Rows, Scalar, Tridiagonal,
};
use hlcp_methods::{
    AdaptiveSor, Auto, AutoChoice, Clock, Cycle, DynRows, Limits, Method, Mms, Multigrid, Named,
    Newton, Options, Outcome, Solver, Ssor, Status, solve_mixed,
};
use hlcp_verify::{Disc, Example, Slider};

/// Solves twice from ones to 10⁻¹⁰ of ‖q‖: it must converge, and as well the second time.
fn solved<M: Method<f64>>(method: M, q: &[f64]) -> (Outcome, Solver<f64, M>) {
    let mut solver = Solver::new(method);
    let outcome = solve_from_ones(&mut solver, q, Limits::relative(1e-10));
    assert!(outcome.converged(), "{outcome}");
    let again = solve_from_ones(&mut solver, q, Limits::relative(1e-10));
    assert_eq!((again.sweeps, again.residual), (outcome.sweeps, outcome.residual));
    (outcome, solver)
}

/// `Auto` with Ω = D_A D_B⁻¹, on operators behind `dyn`: the tests compile it once.
fn auto<'p>(
    a: DynRows<'p, f64>,
    b: DynRows<'p, f64>,
) -> Auto<f64, DynRows<'p, f64>, DynRows<'p, f64>> {
    Auto::new(problem(1.0, a, b)).unwrap()
}

/// The sweeps of `Auto` with Ω = D_A D_B⁻¹, and the fewest of Table 1's methods with τ = 0.8, 1 and
/// 1.2.
fn compare(a: &dyn Rows<f64>, b: &dyn Rows<f64>, q: &[f64]) -> [usize; 2] {
    let (outcome, _) = solved(auto(a, b), q);
    let splittings = ["GS", "SOR1", "SOR3", "AOR1", "AOR2", "AOR3"];
    let paired = ["M", "AM", "TM"].into_iter().flat_map(|family| {
        splittings.into_iter().map(move |splitting| format!("{family}{splitting}"))
    });
    let two = ["TMGSJ", "TMGSSOR1", "TMGSSOR2", "TMGSSOR3"].map(str::to_owned);
    let mut fewest = usize::MAX;
    for name in paired.chain(two) {
        for tau in [0.8, 1.0, 1.2] {
            let named: Named = name.parse().unwrap();
            let mut solver = Solver::new(named.on_dyn(problem(tau, a, b)).unwrap());
            let limits = Limits { iterations: fewest.min(5000), ..Limits::relative(1e-10) };
            let outcome = solve_from_ones(&mut solver, q, limits);
            if outcome.converged() {
                fewest = fewest.min(outcome.sweeps);
            }
        }
    }
    [outcome.sweeps, fewest]
}

/// On Examples 1 and 2 and on the slider no more than 1.5 times the sweeps of the best of the
/// table.
#[test]
fn nearly_as_good_as_the_best_of_the_table() {
    for (mu, nu) in [(4.0, 4.0), (1.0, 1.0), (0.0, 4.0), (0.0, 0.0)] {
        for symmetric in [true, false] {
            let p = Example { symmetric, m: 32, mu, nu }.pose().unwrap();
            let [auto, fewest] = compare(&p.a, &p.b, &p.q);
            assert!(2 * auto <= 3 * fewest, "{symmetric} {mu} {nu}: {auto} against {fewest}");
        }
    }
    for cells in [24, 32, 64] {
        let (a, b, q) = Slider { cells }.pose().unwrap();
        let [auto, fewest] = compare(&a, &b, &q);
        assert!(2 * auto <= 3 * fewest, "slider: {auto} against {fewest}");
    }
}

/// Loads sin(ωk), with and without a second operator: α is found on an iterate that no cycle of
/// multigrid has touched, and nobody needs algebraic multigrid.
#[test]
fn loads_that_change_sign_are_left_to_sor() {
    let (m, n) = (110, 150);
    let a = FivePoint::new(m, n, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    let lines = FivePoint::new(m, n, [0.0, -1.0, 4.0, -1.0, 0.0]).unwrap();
    let one = FivePoint::new(m, n, [0.0, 0.0, 1.0, 0.0, 0.0]).unwrap();
    let (mut by_auto, mut by_sor) = (0, 0);
    for (k, b) in (0..24).flat_map(|k| [(k, &lines), (k, &one)]) {
        let turn = 2e-3 * 1000_f64.powf(f64::from(k) / 23.0);
        let q: Vec<f64> = (0..m * n).map(|k| (turn * k as f64).sin()).collect();
        let mut solver = Solver::new(auto(&a, b));
        let outcome = solver.solve(&q, Limits::default()).unwrap();
        let turns = solver.method().turns();
        let choices: Vec<_> = turns.iter().map(|turn| turn.choice).collect();
        assert!(outcome.converged(), "{turn} {outcome}");
        assert!(!choices.contains(&AutoChoice::AmgNewton), "{turn} {turns:?}");
        let sor = AdaptiveSor::new(problem(1.0, &a, b)).unwrap();
        let alone = Solver::new(sor).solve(&q, Limits::default()).unwrap();
        assert!(outcome.sweeps <= 2 * alone.sweeps, "{turn} {outcome}, by SOR alone {alone}");
        by_auto += outcome.sweeps;
        by_sor += alone.sweeps;
    }
    assert!(2 * by_auto <= 3 * by_sor, "{by_auto} sweeps, {by_sor} by SOR alone");
}

/// Wind in circles: with 4000 points and more cycles of multigrid come before algebraic multigrid
/// where `r` is alone in its rows, or `z`.
#[test]
fn cycles_come_first_on_many_points_where_one_operator_is_diagonal() {
    use AutoChoice::{AmgNewton, Multigrid, Sor};
    for (m, choice) in [(60, AmgNewton), (66, Multigrid)] {
        let at = |k: usize| TAU * k as f64 / m as f64;
        let wind = |i: usize, j: usize, way: f64| way * 2.0 * at(i).sin() * at(j).cos();
        let a = FivePoint::from_fn(m, m, |i, j| {
            let [east, north] = [wind(i, j, 1.0), wind(j, i, -1.0)];
            let [south, west] = [1.0 + north.max(0.0), 1.0 + east.max(0.0)];
            let [east, north] = [1.0 + (-east).max(0.0), 1.0 + (-north).max(0.0)];
            [-south, -west, south + west + east + north, -east, -north]
        });
        let (a, one) = (a.unwrap(), Identity { order: m * m });
        let load = |k: usize| (3.0 * at(k % m)).sin() * (2.0 * at(k / m)).cos() - 0.1;
        let q: Vec<f64> = (0..m * m).map(|k| 0.01 * load(k)).collect();
        let exchanged: Vec<f64> = q.iter().map(|q| -q).collect();
        let operators: [(DynRows<'_, f64>, DynRows<'_, f64>, _); 2] =
            [(&a, &one, &q), (&one, &a, &exchanged)];
        for (a, b, q) in operators {
            let mut solver = Solver::new(auto(a, b));
            let outcome = solver.solve(q, Limits::default()).unwrap();
            let turns = solver.method().turns();
            let choices: Vec<_> = turns.iter().map(|turn| turn.choice).collect();
            assert!(outcome.converged() && choices == [Sor, choice], "{m} {turns:?} {outcome}");
        }
    }
}

/// Where rounding keeps Newton's methods from the tolerance, the solve ends with them, and not with
/// the limit of iterations.
#[test]
fn below_rounding_it_stagnates() {
    let c = |i: usize, j: usize| if (i / 6 + j / 6).is_multiple_of(2) { 1.0 } else { 1e6 };
    let face = |one: f64, other: f64| 2.0 * one * other / (one + other);
    let n = 24;
    let a = FivePoint::from_fn(n, n, |i, j| {
        let here = c(i, j);
        let neighbours = [(0, -1), (-1, 0), (1, 0), (0, 1)].map(|(di, dj)| {
            let beside = (i.checked_add_signed(di), j.checked_add_signed(dj));
            match beside {
                (Some(i), Some(j)) if i < n && j < n => face(here, c(i, j)),
                _ => 2.0 * here,
            }
        });
        let [south, west, east, north] = neighbours;
        [-south, -west, neighbours.iter().sum(), -east, -north]
    });
    let q: Vec<f64> = (0..n * n).map(|k| (1.7 * k as f64).sin() - 0.2).collect();
    let (a, b) = (a.unwrap(), Identity { order: n * n });
    let mut solver = Solver::new(auto(&a, &b));
    let limits = Limits { rounding: Some(0.0), ..Limits::relative(1e-15) };
    let outcome = solver.solve(&q, limits).unwrap();
    assert_eq!(outcome.status, Status::Stagnated, "{outcome}");
    assert!(outcome.relative.l2 < 1e-6 && outcome.iterations < 20_000, "{outcome}");
}

/// A beam over an obstacle, A = tridiag(−1, 2, −1)²: elimination leaves no sign wrong, and a
/// residual that is rounding. Then the others have 300 sweeps.
#[test]
fn what_elimination_leaves_is_rounding() {
    let n = 400;
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 if i == 0 || i + 1 == n => 5.0,
        0 => 6.0,
        1 => -4.0,
        2 => 1.0,
        _ => 0.0,
    };
    let a = RowMajor::new(n, (0..n * n).map(|k| entry(k / n, k % n)).collect::<Vec<f64>>());
    let q: Vec<f64> = (0..n).map(|i| (0.02 * i as f64).sin() - 0.4).collect();
    let (a, b) = (a.unwrap(), Identity { order: n });
    let mut solver = Solver::new(auto(&a, &b));
    let limits = Limits { rounding: Some(0.0), ..Limits::default() };
    let outcome = solver.solve(&q, limits).unwrap();
    assert_eq!(outcome.status, Status::Stagnated, "{outcome}");
    let turns = solver.method().turns();
    let after = turns.iter().rev().take_while(|turn| turn.choice != AutoChoice::Pivoting);
    let after: usize = after.map(|turn| turn.sweeps).sum();
    assert!(after < turns.iter().map(|turn| turn.sweeps).sum() && after < 500, "{turns:?}");
}

/// From 0 the first step of Newton's method raises the residual a thousandfold, and is the way.
#[test]
fn films_are_found_from_zero() {
    let (a, b, q) = Slider { cells: 4000 }.pose::<f64>().unwrap();
    let mut solver = Solver::new(auto(&a, &b));
    let outcome = solver.solve(&q, Options::default()).unwrap();
    assert!(outcome.converged() && outcome.sweeps < 1000, "{outcome}");
    assert_eq!(solver.method().uses(), AutoChoice::Newton);
}

#[test]
fn the_slider_gets_newtons_method() {
    for cells in [24, 50, 128] {
        let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
        let (outcome, solver) = solved(auto(&a, &b), &q);
        assert!(outcome.iterations <= 8, "{outcome}");
        assert_eq!(solver.method().uses(), AutoChoice::Newton);
    }
}

/// The first sweeps divide by a diagonal that is all but zero, thrice each way: what they lead to
/// is left alone, and pivoting goes on from the start.
#[test]
fn sweeps_before_pivoting_may_run_away() {
    for d in [1e-4, 1e-8] {
        let a = RowMajor::new(3, vec![d, 4.0, -3.0, -4.0, d, 5.0, 3.0, -5.0, d]).unwrap();
        let b = Identity { order: 3 };
        let problem = Dynamic::new(&a, &b, Omega::Uniform(1.0)).unwrap();
        let mut solver = Solver::new(Auto::new(problem).unwrap());
        // Entries of z are some 1/d, of which rounding leaves 1e-8 and less.
        let limits = Limits::relative(1e-6);
        let outcome = solver.solve(&[-1.0, 2.0, -0.5], Options::default().limits(limits)).unwrap();
        assert!(outcome.converged(), "{outcome}");
        assert_eq!(solver.method().uses(), AutoChoice::Pivoting);
    }
}

#[test]
fn the_discs_get_multigrid() {
    for (lcp, m) in [(true, 96), (true, 160), (false, 96), (false, 160)] {
        let p = Disc { lcp, m }.pose::<f64>().unwrap();
        let (outcome, solver) = solved(auto(&p.a, &p.b), &p.q);
        assert_eq!(solver.method().uses(), AutoChoice::Multigrid);
        // One window of SOR, or two, a walk over the rows for each iteration.
        let first = solver.method().turns()[0].sweeps;
        assert!(first <= 49 && outcome.iterations <= first + 18, "{outcome}");
        // A W-cycle is 11 or 12 walks.
        let [walks, cycles] = [outcome.sweeps - first, outcome.iterations - first];
        assert!(walks == 11 * cycles || walks == 12 * cycles, "{outcome}");
    }
}

/// Torsion of a strip, where Newton's method takes n/5 steps (see `newton.rs`), fewer from all
/// columns, and has 80.
#[test]
fn a_strip_gets_multigrid() {
    for n in [4095, 8191] {
        let a = FivePoint::new(n, 1, [0.0, -1.0, 2.0, -1.0, 0.0]).unwrap();
        let b = Identity { order: n };
        let problem = Dynamic::new(&a, &b, Omega::Uniform(2.0)).unwrap();
        let q = torsion(n);
        let (outcome, solver) = solved(Auto::new(problem.clone()).unwrap(), &q);
        assert!(outcome.iterations <= 80 + 25, "{n}: {outcome}");
        assert_eq!(solver.method().uses(), AutoChoice::Multigrid);
        // A look, up to twenty steps from all columns of either operator, and two of the base; then
        // a defect and an inner iteration, of four sweeps, in each step until there were 400.
        let first = solver.method().turns()[0];
        assert!(first.choice == AutoChoice::Newton && first.sweeps <= 400 + 5, "{n}: {first}");
        let steps = (first.sweeps - 3) / 5 - 20;
        let mut cycle = Multigrid::new(problem, Cycle::F).unwrap();
        let rhs = Rhs::new(&q).unwrap();
        let _ = cycle.step(&rhs, solver.x(), &mut vec![0.0; n], &mut Clock::endless());
        let cycles = (outcome.iterations - steps) * cycle.work().unwrap().sweeps;
        assert!(outcome.sweeps <= first.sweeps + cycles, "{n}: {outcome}");
        assert!(outcome.linear_iterations <= Some(250), "{n}: {outcome}");
        assert!((solver.z()[n / 2] - 0.1).abs() < 1.0 / (n + 1) as f64);
    }
}

#[test]
fn without_a_known_grid_algebraic_multigrid_follows() {
    let n = 8191;
    let a = Tridiagonal::new(n, |_| [-1.0, 2.0, -1.0]).unwrap();
    let b = Identity { order: n };
    let problem = Dynamic::new(&a, &b, Omega::Uniform(2.0)).unwrap();
    let (outcome, solver) = solved(Auto::new(problem).unwrap(), &torsion(n));
    let history = solver.method().turns();
    assert_eq!(history[1].choice, AutoChoice::AmgNewton, "{outcome} {history:?}");
}

#[test]
fn the_examples_get_sweeps_alone() {
    let p = Example { symmetric: true, m: 64, mu: 0.0, nu: 0.0 }.pose::<f64>().unwrap();
    let (outcome, solver) = solved(auto(&p.a, &p.b), &p.q);
    // Fused sweeps measure as they go.
    assert_eq!(outcome.sweeps, outcome.iterations, "{outcome}");
    assert_eq!(solver.method().uses(), AutoChoice::Sor);
}

fn by_tmgs<T: Scalar>(example: Example) -> (Solver<T, impl Method<T>>, Vec<T>) {
    let p = example.pose::<T>().unwrap();
    (Solver::new(tmgs(problem(1.0, p.a, p.b))), p.q)
}

fn within(limits: Limits, x0: &[f64]) -> Options<'_, f64> {
    Options::from_x(x0).limits(limits)
}

/// Two precisions reach what double precision does, and no iteration more than a rounding or two
/// may cost.
#[test]
fn mixed_precision_reaches_double_precision() {
    let example = Example { symmetric: false, m: 24, mu: 1.0, nu: 2.0 };
    let ((mut double, q), (mut single, _)) = (by_tmgs::<f64>(example), by_tmgs::<f32>(example));
    let x0 = vec![1.0; q.len()];
    let limits = Limits::relative(1e-13);
    let alone = double.solve(&q, within(limits, &x0)).unwrap();
    let mixed = solve_mixed(&mut single, &mut double, &q, within(limits, &x0)).unwrap();
    assert!(mixed.converged() && mixed.residual.l2 <= 1e-13 * hlcp_core::Norms::of(&q).l2);
    assert!(mixed.iterations <= alone.iterations + 2, "{mixed}, {alone}");
    assert_eq!(mixed.sweeps, 2 * mixed.iterations);
    // Half of them at least in single precision.
    let widened: Vec<f64> = single.x().iter().map(|&x| x.into()).collect();
    let rest = double.solve(&q, within(limits, &widened)).unwrap();
    assert!(2 * rest.iterations <= alone.iterations + 2, "{rest}");

    // Data that single precision cannot hold, large and small, are double precision's alone.
    for scale in [1e200, 1e-200] {
        let q: Vec<f64> = q.iter().map(|q| q * scale).collect();
        let x0 = vec![scale; q.len()];
        let scaled = solve_mixed(&mut single, &mut double, &q, within(limits, &x0)).unwrap();
        assert!(scaled.converged() && scaled.iterations.abs_diff(alone.iterations) <= 1);
    }
    // A first part that diverges counts, and leaves the start as it is.
    let coupled = FivePoint::new(q.len(), 1, [0.0, -9.0, 1.0, -9.0, 0.0_f32]).unwrap();
    let mut diverging = Solver::new(Mms::new(Hlcp::lcp(coupled).unwrap(), Aor::jacobi()).unwrap());
    let narrow: Vec<f32> = q.iter().map(|&q| q as f32).collect();
    let lost = diverging.solve(&narrow, Options::from_x(&vec![1.0; q.len()])).unwrap();
    assert!(matches!(lost.status, Status::Diverged(_)), "{lost}");
    let outcome = solve_mixed(&mut diverging, &mut double, &q, within(limits, &x0)).unwrap();
    assert!(outcome.converged(), "{outcome}");
    assert_eq!(outcome.iterations, lost.iterations + alone.iterations);

    let few = Limits { iterations: 3, ..limits };
    let outcome = solve_mixed(&mut single, &mut double, &q, within(few, &x0)).unwrap();
    assert_eq!((outcome.status, outcome.iterations), (Status::IterationLimit, 3));

    // An observer stops it in the first part, and the best iterate is handed over.
    let mut seen = vec![];
    let options = Options::from_solution(&x0, &x0).observer(|now| {
        seen.push(now.iteration);
        if now.iteration == 4 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let outcome = solve_mixed(&mut single, &mut double, &q, options).unwrap();
    assert_eq!((outcome.status, outcome.iterations, seen), (Status::Stopped, 4, (0..5).collect()));
    assert!(single.x().iter().zip(double.x()).all(|(&s, &d)| f64::from(s) == d));

    let narrow = Mms::new(Hlcp::lcp(Identity { order: 2 }).unwrap(), Aor::gauss_seidel()).unwrap();
    let refused = solve_mixed(&mut Solver::new(narrow), &mut double, &q, Limits::default());
    let (found, expected) = (2, q.len());
    let what = "the problem in single precision";
    assert_eq!(refused, Err(Error::Order { what, found, expected }));
}

/// A walk over all rows would not end.
#[test]
fn a_load_of_another_order_is_refused_at_once() {
    let endless = Identity { order: usize::MAX };
    let refused = hlcp_methods::solve(&endless, &endless, &[1.0]).map(|solution| solution.z);
    let expected = Error::Order { what: "q", found: 1, expected: usize::MAX };
    assert_eq!(refused, Err(expected));
}

/// What both parts took is counted, and what neither has is not made up.
#[test]
fn mixed_precision_counts_the_linear_iterations_of_both_parts() {
    fn by_newton<T: Scalar>(example: Example) -> (Solver<T, impl Method<T>>, Vec<T>) {
        let p = example.pose::<T>().unwrap();
        (Solver::new(Newton::new(tmgs(problem(1.0, p.a, p.b)), Ssor)), p.q)
    }
    let example = Example { symmetric: false, m: 24, mu: 0.0, nu: 0.0 };
    let ((mut double, q), (mut single, narrow)) = (by_newton(example), by_newton::<f32>(example));
    let (x0, limits) = (vec![1.0; q.len()], Limits::relative(1e-13));
    let both = solve_mixed(&mut single, &mut double, &q, within(limits, &x0)).unwrap();
    let limits = Limits { rounding: None, ..limits };
    let first = single.solve(&narrow, Options::from_x(&vec![1.0; q.len()]).limits(limits)).unwrap();
    let widened: Vec<f64> = single.x().iter().map(|&x| x.into()).collect();
    let second = double.solve(&q, Options::from_x(&widened).limits(limits)).unwrap();
    assert!(first.linear_iterations > Some(0));
    let sum = first.linear_iterations.unwrap() + second.linear_iterations.unwrap();
    assert_eq!(both.linear_iterations, Some(sum));
    let (mut plain, _) = by_tmgs::<f64>(example);
    let sweeps = plain.solve(&q, Options::from_x(&x0)).unwrap();
    assert_eq!(sweeps.linear_iterations, None);
    assert_eq!(sweeps.then(second).linear_iterations, second.linear_iterations);
    assert_eq!(second.then(sweeps).linear_iterations, second.linear_iterations);
    let one = Outcome::new(sweeps.status, 1, sweeps.elapsed, sweeps.residual);
    assert!(one.to_string().starts_with("converged after 1 iteration (1 sweep, "), "{one}");
}
