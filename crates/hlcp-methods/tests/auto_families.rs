//! The automatic choice on problems that no single method solves best.

#[path = "../../../tests/common/mod.rs"]
mod common;

use approx::assert_abs_diff_eq;
use common::{Dynamic, Lists, by, named, renamed, shuffled};
use hlcp_core::{FivePoint, Identity, Omega, Rows, Scalar, Varying};
use hlcp_methods::{
    AutoChoice, AutoEnd, AutoTurn, DynRows, Limits, Method, Options, Outcome, Solver,
};
use hlcp_verify::{Film, JournalBearing, Side, families};
use proptest::{prelude::*, strategy::ValueTree, test_runner::TestRunner};
use std::f64::consts::TAU;

type Posed = (FivePoint<Varying<f64>>, FivePoint<Varying<f64>>, Vec<f64>);

/// A film over `k × k` square dimples of a depth on an inclined plane.
fn dimples(cells: [usize; 2], k: f64, depth: f64) -> Posed {
    let film = Film::new(cells, [1.0; 2], 1.0, 1.0).with_gap(|x, y| {
        let within = |at: f64| (0.25..0.75).contains(&(k * at).fract());
        2.0 - x + if within(x) && within(y) { depth } else { 0.0 }
    });
    film.pose().unwrap()
}

/// The sweeps of the best single method.
fn fewest(a: DynRows<'_, f64>, b: DynRows<'_, f64>, q: &[f64]) -> usize {
    let limits = Limits { iterations: 1000, rounding: Some(4.0), ..Limits::default() };
    let sweeps = |name| {
        let outcome = by(name, a, b).ok()?.solve(q, limits).unwrap();
        outcome.converged().then_some(outcome.sweeps)
    };
    let all = ["MGW", "ADAPTIVE", "AMG", "NEWTON"].into_iter().filter_map(sweeps);
    all.min().unwrap_or(usize::MAX / 8)
}

fn solve<T: Scalar>(a: DynRows<'_, T>, b: DynRows<'_, T>, q: &[T]) -> (Outcome, Vec<AutoTurn>) {
    let mut solver = by("AUTO", a, b).unwrap();
    // What no precision can reach is not asked for.
    let limits = Limits { rounding: Some(4.0), ..Limits::default() };
    let outcome = solver.solve(q, limits).unwrap();
    let turns = solver.method().turns().to_vec();
    assert!(outcome.converged(), "{outcome} {turns:?}");
    // A solve begins anew.
    let again = solver.solve(q, limits).unwrap();
    assert_eq!((again.iterations, again.sweeps), (outcome.iterations, outcome.sweeps));
    assert_eq!(solver.method().turns(), turns);
    (outcome, turns)
}

/// No more than four times the work of the best single method, and the windows of those that fail:
/// some 80 sweeps at first.
fn competes(what: &str, a: DynRows<'_, f64>, b: DynRows<'_, f64>, q: &[f64]) -> Vec<AutoTurn> {
    let (outcome, history) = solve(a, b, q);
    let fewest = fewest(a, b, q);
    assert!(outcome.sweeps <= 4 * fewest + 100, "{what}: {outcome}, {fewest} sweeps, {history:?}");
    // Every turn but the last was left, and residuals fall.
    let (last, left) = history.split_last().unwrap();
    assert!(last.end.is_none() && left.iter().all(|turn| turn.end.is_some()), "{history:?}");
    assert!(history.is_sorted_by(|one, next| one.residual >= next.residual), "{history:?}");
    // The step from the answer may be counted in the turn, but is not in the outcome.
    let sweeps: usize = history.iter().map(|turn| turn.sweeps).sum();
    assert!((outcome.sweeps..=outcome.sweeps + 100).contains(&sweeps), "{outcome} {history:?}");
    history
}

#[test]
fn films_with_dimples_go_to_algebraic_multigrid() {
    for (cells, k, depth) in [([63, 63], 4.0, 2.0), ([63, 63], 4.0, 1.0), ([64, 48], 5.0, 2.0)] {
        let (a, b, q) = dimples(cells, k, depth);
        let history = competes(&format!("{cells:?}"), &a, &b, &q);
        assert_eq!(history.last().unwrap().choice, AutoChoice::AmgNewton, "{history:?}");
    }
}

/// Its last window shows less than algebraic multigrid promises, but another one is enough.
#[test]
fn a_method_that_is_nearly_through_is_not_left() {
    let bearing = JournalBearing { nx: 127, ny: 127, ecc: 0.1, b: 10.0 };
    let (a, b, q) = bearing.pose::<f64>().unwrap();
    let mut solver = by("AUTO", &a, &b).unwrap();
    let x0 = vec![1.0; q.len()];
    let outcome = solver.solve(&q, Options::from_x(&x0).limits(Limits::absolute(1e-10))).unwrap();
    let choices: Vec<_> = solver.method().turns().iter().map(|turn| turn.choice).collect();
    assert!(outcome.converged(), "{outcome}");
    assert_eq!(choices, [AutoChoice::Sor, AutoChoice::Multigrid]);
}

/// Contacts on grids that their rows do not show, and steps of time of them: Anderson's iteration
/// makes progress, but algebraic multigrid has its turn before that has become slow.
#[test]
fn what_conducts_without_a_grid_goes_to_algebraic_multigrid() {
    let m = 70;
    let load = |k: usize| ((k % m) as f64 * 0.11).sin() * ((k / m) as f64 * 0.07).cos() - 0.2;
    let (b, q) = (Identity { order: m * m }, (0..m * m).map(load).collect::<Vec<f64>>());
    let steps = [(0.0, 1.0), (0.0, 0.3), (0.0, 0.03), (0.01, 1.0), (0.02, 0.1), (0.1, 0.02)];
    let grids = steps.map(|(earth, along)| {
        let row = [-1.0, -along, earth + 2.0 + 2.0 * along, -along, -1.0];
        Lists::of(&FivePoint::new(m, m, row).unwrap())
    });
    // Across the grid at an angle, a fifth as much again couples with the other sign.
    let mut tilted = grids[0].clone();
    for (k, row) in tilted.0.iter_mut().enumerate() {
        for (to, a) in [(m + 1, -0.45), (m - 1, 0.45)] {
            let is_near = |j: &usize| *j < m * m && (j % m).abs_diff(k % m) == 1;
            row.extend([k + to, k.wrapping_sub(to)].into_iter().filter(is_near).map(|j| (j, a)));
        }
    }
    let mut last = None;
    for (k, a) in grids.iter().chain([&tilted]).enumerate() {
        let (outcome, history) = solve(a, &b, &q);
        let amg = by("AMG", a, &b).unwrap().solve(&q, Limits::default()).unwrap();
        assert!(outcome.sweeps <= 2 * amg.sweeps, "{k}: {outcome} {history:?}");
        last = history.last().map(|turn| turn.choice);
    }
    assert_eq!(last, Some(AutoChoice::AmgNewton));
}

/// Multipliers, each of which three unknowns of a membrane answer, anywhere: the first linear solve
/// of algebraic multigrid shows that it is of no use, and its first turn ends with that.
#[test]
fn linear_solves_that_stall_end_the_turn_of_algebraic_multigrid() {
    let (m, multipliers) = (60, 500);
    let n = m * m;
    let mut a = Lists::of(&FivePoint::new(m, m, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap());
    for l in 0..multipliers {
        let of: Vec<_> = (1..4).map(|k| ((7919 * k * (l + 1)) % n, (k * l) as f64)).collect();
        let coupled = of.iter().map(|&(j, phase)| (j, -phase.sin()));
        a.0.push(coupled.chain([(n + l, 0.03)]).collect());
        of.iter().for_each(|&(j, phase)| a.0[j].push((n + l, phase.sin())));
    }
    let (b, order) = (Identity { order: n + multipliers }, n + multipliers);
    let q: Vec<f64> = (0..order).map(|i| (0.7 * i as f64).sin()).collect();
    let (_, history) = solve(&a, &b, &q);
    let turn = history.iter().find(|turn| turn.choice == AutoChoice::AmgNewton);
    assert!(turn.is_some_and(|turn| turn.sweeps <= 500), "{history:?}");
}

/// A ring that nobody feeds, on a grid and by rows, and with z and r exchanged: from the side that
/// has the answers alone a few sweeps solve it, before a second method has had a turn.
#[test]
fn what_one_side_alone_solves_is_left_to_sweeps() {
    let alone = |a: DynRows<'_, f64>, b: DynRows<'_, f64>, q: &[f64], most: usize| {
        let (outcome, history) = solve(a, b, q);
        let stays = history.iter().all(|turn| turn.choice == history[0].choice);
        assert!(stays && outcome.sweeps <= most, "{outcome} {history:?}");
    };
    for seed in 1..=6 {
        let ([a, b], q) = families::draw("unfed", seed).unwrap().pose::<f64>();
        let opposite: Vec<f64> = q.iter().map(|q| -q).collect();
        alone(&a, &b, &q, 100);
        alone(&b, &a, &opposite, 100);
    }
    let gap = |x: f64, _: f64| 1.0 + 0.8 * (TAU * x).cos();
    // Adaptive SOR solves the small one itself; four of its fused sweeps take as long as one.
    for (cells, most) in [([60, 40], 400), ([120, 80], 100)] {
        let mut film = Film::new(cells, [1.0, 0.3], 1.0, 1.0).with_gap(gap);
        film.sides = [Side::Periodic, Side::Periodic, Side::Pressure(0.0), Side::Pressure(0.0)];
        let (a, b, q) = film.pose().unwrap();
        alone(&a, &b, &q, most);
    }
}

/// A journal bearing all around whose ends hardly feed it: Newton's methods diverge, and the
/// iterate that they leave is far from every solution. Anderson's iteration from the start is not.
#[test]
fn a_ring_that_is_hardly_fed_is_solved() {
    for (cells, size, [ecc, tilt], ends) in [
        ([23, 46], [0.0659, 0.0122], [0.43, 0.8], [Side::Pressure(2.33), Side::Starved(0.166)]),
        ([24, 15], [0.0659, 0.0122], [0.6, 0.4], [Side::Pressure(20.0), Side::Starved(0.05)]),
    ] {
        let gap = |x: f64, y: f64| 1.0 + ecc * (TAU * (x / size[0] + tilt * y / size[1])).cos();
        let mut film = Film::new(cells, size, 10.0, 0.03).with_gap(|x, y| 1e-5 * gap(x, y));
        film.sides = [Side::Periodic, Side::Periodic, ends[0], ends[1]];
        let (a, b, q) = film.pose().unwrap();
        let assembled = [Lists::of(&a), Lists::of(&b)];
        let pairs: [[&dyn Rows<f64>; 2]; 2] = [[&a, &b], assembled.each_ref().map(|of| of as _)];
        for [a, b] in pairs {
            let mut solver = by("AUTO", a, b).unwrap();
            let outcome = solver.solve(&q, Limits::relative(1e-12)).unwrap();
            let history = solver.method().turns();
            assert!(outcome.converged(), "{outcome} {history:?}");
            assert!(history.is_sorted_by(|one, next| one.residual >= next.residual), "{history:?}");
        }
    }
}

/// Sweeps with α = 1 diverge on most of the first ten skew matrices that are drawn. `AdaptiveSor`
/// alone overflows on some before its α is small enough; in `AUTO` it goes back to an iterate that
/// is kept, and solves some of those.
#[test]
fn sweeps_that_diverge_go_on_with_a_smaller_alpha() {
    let mut solved = 0;
    for seed in 1..=10 {
        let ([a, b], q) = families::draw("skew", seed).unwrap().pose::<f64>();
        let (_, history) = solve(&a, &b, &q);
        let sor = |turn: &&AutoTurn| turn.choice == AutoChoice::Sor;
        let mut ends = history.iter().filter(sor).map(|turn| turn.end);
        assert!(ends.all(|end| end != Some(AutoEnd::Growing)), "{seed}: {history:?}");
        let mut alone = by("ADAPTIVE", &a, &b).unwrap();
        let diverges = !alone.solve(&q, Limits::default()).unwrap().converged();
        solved += usize::from(diverges && history.last().as_ref().is_some_and(sor));
    }
    assert!(solved > 0);
}

/// The first two of each family that `hlcp families` draws from; in single precision AUTO has no
/// more than its convergence to show.
#[test]
fn every_family_is_solved_at_a_fair_price() {
    for (family, seed) in families::NAMES.into_iter().flat_map(|name| [(name, 1), (name, 2)]) {
        let drawn = families::draw(family, seed).unwrap();
        if drawn.single {
            let ([a, b], q) = drawn.pose::<f32>();
            let outcome = by("AUTO", &a, &b).unwrap().solve(&q, Limits::default()).unwrap();
            assert!(outcome.converged(), "{}: {outcome}", drawn.name);
        } else {
            let ([a, b], q) = drawn.pose::<f64>();
            competes(&drawn.name, &a, &b, &q);
        }
    }
}

/// The first two problems of a family with at most 4000 unknowns, in double precision.
fn small(family: &str) -> impl Iterator<Item = ([Box<dyn Rows<f64>>; 2], Vec<f64>)> {
    let drawn = (1..).filter_map(move |seed| families::draw(family, seed));
    drawn.map(|drawn| drawn.pose()).filter(|(_, q)| q.len() <= 4000).take(2)
}

/// Rows multiplied by 10^±6, unknowns by 10^±3, z and r exchanged, or all renumbered: the first two
/// with at most 4000 unknowns of each family that draws sparse matrices converge, with 1.5 times
/// the work that they take as they are at most in the geometric mean.
#[test]
fn units_names_and_numbers_cost_little() {
    let mut runner = TestRunner::deterministic();
    let mut powers = |n: usize, size: f64| {
        let powers = prop::collection::vec((-size..size).prop_map(|power| 10_f64.powf(power)), n);
        powers.new_tree(&mut runner).unwrap().current()
    };
    let times = |of: &Lists<f64>, rows: &[f64], columns: &[f64]| {
        let row = |(row, r): (&Vec<(usize, f64)>, &f64)| {
            row.iter().map(|&(j, a)| (j, r * a * columns[j])).collect()
        };
        Lists(of.0.iter().zip(rows).map(row).collect())
    };
    let work = |a: &Lists<f64>, b: &Lists<f64>, q: &[f64]| solve(a, b, q).0.sweeps as f64;
    let renumbered = |a: &Lists<f64>, b: &Lists<f64>, q: &[f64]| {
        let order = shuffled(q.len());
        let [a, b] = [a, b].map(|of| renamed(of, &order));
        let q: Vec<f64> = order.iter().map(|&i| q[i]).collect();
        solve(&a, &b, &q).0.sweeps as f64
    };
    let sparse = families::NAMES.into_iter().filter(|name| !["dense", "single"].contains(name));
    let mut logarithms = [(); 4].map(|()| vec![]);
    for ([a, b], q) in sparse.flat_map(small) {
        let (n, a, b) = (q.len(), Lists::of(&a), Lists::of(&b));
        let (ones, r, s, t) = (vec![1.0; n], powers(n, 6.0), powers(n, 3.0), powers(n, 3.0));
        let weighted: Vec<f64> = q.iter().zip(&r).map(|(q, r)| q * r).collect();
        let opposite: Vec<f64> = q.iter().map(|q| -q).collect();
        let plain = work(&a, &b, &q);
        let disguised = [
            work(&times(&a, &r, &ones), &times(&b, &r, &ones), &weighted),
            work(&times(&a, &ones, &s), &times(&b, &ones, &t), &q),
            work(&b, &a, &opposite),
            renumbered(&a, &b, &q),
        ];
        for (all, work) in logarithms.iter_mut().zip(disguised) {
            all.push((work / plain).ln());
        }
    }
    for all in logarithms {
        assert!(all.iter().sum::<f64>() <= all.len() as f64 * 1.5_f64.ln(), "{all:?}");
    }
}

/// The first two with at most 4000 unknowns of each family that no sweep, no aggregate and no grid
/// is meant for. Without sparse elimination nobody solves some of them.
#[test]
#[cfg(feature = "direct")]
fn what_nothing_else_solves_is_eliminated() {
    for ([a, b], q) in families::LARGE.into_iter().flat_map(small) {
        let _ = solve(&a, &b, &q); // which must converge
    }
}

/// The terms of the residual grow with the iterate, and with them what rounding explains of it.
#[test]
fn rounding_is_recognised_while_the_iterate_grows() {
    let limits = Limits { rounding: Some(4.0), ..Limits::default() };
    for seed in [5029, 5032] {
        let ([a, b], q) = families::draw("single", seed).unwrap().pose::<f32>();
        let [auto, amg] =
            ["AUTO", "AMG"].map(|name| by(name, &a, &b).unwrap().solve(&q, limits).unwrap());
        assert!(auto.converged() && auto.sweeps <= 2 * amg.sweeps, "{auto} {amg}");
    }
}

/// A row of `A` that is zero has no pivot for algebraic multigrid; sweeps divide by that of `B`.
#[test]
fn a_method_that_is_refused_is_left_out() {
    let (a, b, mut q) = dimples([31, 31], 4.0, 2.0);
    let n = q.len() + 1;
    q.push(2.0);
    let Omega::Each(mut omega) = Omega::diagonal_ratio(1.0, &a, &b).unwrap() else {
        panic!("a film's diagonals vary")
    };
    omega.push(1.0);
    let [mut a, mut b] = [a, b].map(|of| Lists::of(&of));
    a.0.push(vec![]);
    b.0.push(vec![(n - 1, 1.0)]);
    let problem = Dynamic::new(&a, &b, Omega::Each(omega)).unwrap();
    let mut solver = Solver::new(named("AUTO", [1.0; 2]).on_dyn(problem).unwrap());
    let outcome = solver.solve(&q, Limits::default()).unwrap();
    let history = solver.method().turns();
    assert!(outcome.converged(), "{outcome} {history:?}");
    let refused = history.iter().find(|turn| turn.end == Some(AutoEnd::Refused)).unwrap();
    assert_eq!((refused.choice, refused.sweeps), (AutoChoice::AmgNewton, 0));
    assert!(history.last().unwrap().choice != AutoChoice::AmgNewton);
    assert_abs_diff_eq!(solver.r()[n - 1], 2.0, epsilon = 1e-6);
}

/// From an answer there is nothing to do, and from near one there is less; four fused sweeps of SOR
/// on a plane take as long as one of the others.
#[test]
fn a_solve_from_near_the_answer_is_short() {
    let (a, b, q) = dimples([63, 63], 4.0, 2.0);
    let mut solver = by("AUTO", &a, &b).unwrap();
    let work = |turns: &[AutoTurn]| -> usize {
        let of = |turn: &AutoTurn| turn.sweeps * if turn.choice == AutoChoice::Sor { 1 } else { 4 };
        turns.iter().map(of).sum()
    };
    assert!(solver.solve(&q, Limits::default()).unwrap().converged());
    let cold = work(solver.method().turns());
    assert_eq!(solver.solve(&q, Options::resume()).unwrap().iterations, 0);
    let near: Vec<f64> = q.iter().map(|q| q * (1.0 + 1e-6)).collect();
    let warm = solver.solve(&near, Options::resume()).unwrap();
    assert!(warm.converged(), "{warm}");
    let warm = work(solver.method().turns());
    assert!(warm < cold, "{warm}, {cold}");
}
