//! Turns that end before their method does.

use std::{f64::consts::TAU, time::Instant};

use hlcp_core::{FivePoint, Identity, Omega, RowMajor, Tridiagonal};
use hlcp_verify::Film;

use super::*;
use crate::{DynRows, Limits, Solver};

/// Returns the method on operators behind `dyn`, for which all are compiled once.
fn auto<'a>(
    a: DynRows<'a, f64>,
    b: DynRows<'a, f64>,
) -> Auto<f64, DynRows<'a, f64>, DynRows<'a, f64>> {
    Auto::new(Hlcp::from_pair(a, b).unwrap()).unwrap()
}

/// Returns the sweeps of algebraic multigrid on a long strip whose gap is rough, where its first
/// turn takes about `window`, after as many `turns` of its own, the last of which ends the solve.
fn sweeps(window: usize, turns: usize) -> usize {
    let strip = Film::new([140, 170], [1.0, 0.1], 1.0, 1.0).with_gap(|x, y| {
        let height = |k: usize| {
            let [u, v, phase] = [7, 11, 13].map(|by| (by * k * k % 59) as f64);
            0.2 * (u * x + v * y + phase).sin()
        };
        (1.5 - x + (1..13).map(height).sum::<f64>()).max(0.1)
    });
    let (a, b, q) = strip.pose().unwrap();
    let mut auto = auto(&a, &b);
    let own = auto.place(AutoChoice::AmgNewton).unwrap();
    auto.candidates[own].window = window;
    let q = Rhs::new(&q).unwrap();
    let [mut x, mut y] = [(); 2].map(|()| vec![0.0; q.entries().len()]);
    for _ in 0..1000 {
        let norms = auto.step(&q, &x, &mut y, &mut Clock::endless());
        // Only a first window has a middle.
        assert!(auto.middle.is_none() || auto.candidates[auto.at].is_new(), "{:?}", auto.history);
        if norms.l2 <= 1e-10 * q.norms().l2 {
            let own_turns = auto.history.iter().filter(|turn| turn.choice == auto.uses());
            assert!(auto.at == own && own_turns.count() == turns, "{:?}", auto.history);
            return auto.candidates[own].work().sweeps;
        }
        std::mem::swap(&mut x, &mut y);
    }
    panic!("no solution: {:?}", auto.history)
}

#[test]
fn newtons_method_goes_on_where_it_was_left() {
    let alone = sweeps(usize::MAX, 1);
    let in_turns = sweeps(alone / 4, 2);
    assert!(in_turns <= alone + alone / 4, "{in_turns} sweeps, {alone} in one turn");
}

/// A matrix whose skew part outweighs the rest, one row too large for a full elimination.
#[cfg(feature = "direct")]
fn almost_skew() -> RowMajor<'static, f64> {
    let n = 501;
    let entry = |i: usize, j: usize| match i.cmp(&j) {
        std::cmp::Ordering::Equal => 0.1,
        std::cmp::Ordering::Less => ((7 * i + 3 * j) as f64).sin(),
        std::cmp::Ordering::Greater => -((7 * j + 3 * i) as f64).sin(),
    };
    RowMajor::new(n, (0..n * n).map(|k| entry(k / n, k % n)).collect::<Vec<_>>()).unwrap()
}

/// A string that lies nowhere, though two thirds are pressed down, and the same with `z` and `r`
/// exchanged.
#[test]
fn a_line_is_solved_at_once_where_all_unknowns_are_on_one_side() {
    let n = 3000;
    let string = FivePoint::new(n, 1, [0.0, -1.0, 2.0, -1.0, 0.0]).unwrap();
    let ground = FivePoint::new(n, 1, [0.0, 0.0, 1.0, 0.0, 0.0]).unwrap();
    for (a, b, sign) in [(string, ground, -1.0), (ground, string, 1.0)] {
        let q: Vec<f64> =
            (0..n).map(|i| if i / (n / 3) == 1 { 3.0 * sign } else { -sign }).collect();
        let mut solver = Solver::new(auto(&a, &b));
        let outcome = solver.solve(&q, Limits::relative(1e-6)).unwrap();
        // A look at the start and two solves, each with a step.
        assert!(outcome.converged() && outcome.sweeps <= 15, "{outcome}");
        let others = if sign < 0.0 { solver.r() } else { solver.z() };
        assert!(others.iter().all(|&each| each == 0.0));
        // Nor is it left for what rounding does to its residual.
        let outcome = solver.solve(&q, Limits::relative(1e-16)).unwrap();
        let has_grown = |turn: &AutoTurn| turn.end == Some(AutoEnd::Growing);
        assert!(!outcome.converged() && !solver.method().turns().iter().any(has_grown));
    }
}

/// Reynolds' equation along a line, from 0: signs that the columns with pressure everywhere get
/// wrong are right after a few steps more, and the same with `z` and `r` exchanged. Steps from the
/// start move the edges of the film by a point each, thousands of times.
#[test]
fn a_film_on_a_line_is_solved_from_all_columns() {
    let n = 3000;
    for (lobes, depth) in [(1, 0.3), (1, 0.9), (2, 0.6), (3, 0.8)] {
        let gap = |i: f64| 1.0 + depth * (TAU * f64::from(lobes) * i / n as f64 + 0.5).cos();
        let conducts = move |i: f64| gap(i).powi(3) * n as f64;
        let a = Tridiagonal::new(n, move |i| {
            let [west, east] = [-0.5, 0.5].map(|side| conducts(i as f64 + side));
            [-west, west + east, -east]
        });
        let b =
            Tridiagonal::new(n, move |i| [-6.0 * gap(i as f64 - 1.0), 6.0 * gap(i as f64), 0.0]);
        let (a, b) = (a.unwrap(), b.unwrap());
        let q: Vec<f64> = (0..n).map(|i| 6.0 * (gap(i as f64) - gap(i as f64 - 1.0))).collect();
        let exchanged: Vec<f64> = q.iter().map(|q| -q).collect();
        let (a, b): (DynRows<f64>, DynRows<f64>) = (&a, &b);
        for (a, b, q) in [(a, b, q), (b, a, exchanged)] {
            let outcome = Solver::new(auto(a, b)).solve(&q, Limits::relative(1e-9)).unwrap();
            assert!(outcome.converged() && outcome.sweeps <= 80, "{lobes} {depth} {outcome}");
        }
    }
}

/// A second solve is to take the turns of the first, which has analysed an elimination.
#[test]
#[cfg(feature = "direct")]
fn a_restart_forgets_what_an_elimination_costs() {
    // Factors of planes fill, as their analysis tells.
    let a = FivePoint::new(30, 20, [-1.0, -2.0, 5.0, 1.0, -1.0]).unwrap();
    let one = Identity { order: 600 };
    let mut auto = auto(&a, &one);
    let prospects = |auto: &Auto<_, _, _>| -> Vec<_> {
        auto.candidates.iter().map(|each| (each.promise, each.window)).collect()
    };
    let before = prospects(&auto);
    let at = auto.place(AutoChoice::Pivoting).unwrap();
    for _ in 0..2 {
        auto.set_up(at).unwrap();
        assert!(auto.appraise(at) && !auto.appraise(at), "{:?}", prospects(&auto));
        assert_ne!(prospects(&auto), before);
        auto.restart();
        assert_eq!(prospects(&auto), before);
    }
}

/// Rows of springs that are joined at one end, and elsewhere by a spring to every so many points.
#[test]
#[cfg(feature = "direct")]
fn elimination_begins_where_factors_hold_hardly_more_than_the_matrix() {
    use AutoChoice::{Anderson, Pivoting};
    let (m, one) = (40, Identity { order: 1600 });
    let q: Vec<f64> = (0..m * m).map(|i| (0.1 * i as f64).sin() - 0.3).collect();
    let cases = [(m, 1e-3, Pivoting), (3, 1e-3, Pivoting), (1, 1e-3, Anderson), (m, 1e3, Anderson)];
    for (every, ground, choice) in cases {
        let is_joined = |i: usize, j: usize| {
            let [[x, y], [u, v]] = [i, j].map(|i| [i % m, i / m]);
            y == v && x.abs_diff(u) == 1
                || x == u && y.abs_diff(v) == 1 && (x == 0 || (x + 5 * y.min(v)) % every == 0)
        };
        let row = |i: usize| {
            let around = i.saturating_sub(m)..(i + m + 1).min(m * m);
            let row: Vec<usize> = around.filter(|&j| i == j || is_joined(i, j)).collect();
            let on = row.len() as f64 - 1.0 + ground;
            row.into_iter().map(move |j| (j, if i == j { on } else { -1.0 }))
        };
        let a = crate::testing::csr((0..m * m).map(row));
        let mut solver = Solver::new(auto(&a, &one));
        let mut first = None;
        for _ in 0..2 {
            let outcome = solver.solve(&q, Limits::default()).unwrap();
            let turns = solver.method().turns();
            // Two pairs of sweeps precede it.
            let begins = &turns[usize::from(turns[0].sweeps == 4)];
            assert!(outcome.converged() && begins.choice == choice, "{every} {turns:?} {outcome}");
            let first = first.get_or_insert((solver.x().to_vec(), outcome.sweeps));
            assert_eq!((solver.x(), outcome.sweeps), (&first.0[..], first.1));
        }
    }
}

/// What contacts press on each other along a line, by a full matrix.
#[test]
#[cfg(feature = "direct")]
fn a_full_matrix_takes_no_more_than_its_elimination() {
    let n = 600;
    let entry = |i: usize, j: usize| {
        let far = (i.abs_diff(j) as f64 + 0.3) / n as f64;
        -far.ln() / n as f64 + if i == j { 1e-4 } else { 0.0 }
    };
    let a: Vec<f64> = (0..n * n).map(|k| entry(k / n, k % n)).collect();
    let a = RowMajor::new(n, a).unwrap();
    let q: Vec<f64> = (0..n).map(|i| (i as f64 / n as f64 - 0.5).powi(2) - 0.02).collect();
    let (a, one): (DynRows<f64>, DynRows<f64>) = (&a, &Identity { order: n });
    let outcome = Solver::new(auto(a, one)).solve(&q, Limits::default()).unwrap();
    let alone = Solver::new(Pivoting::new(Hlcp::from_pair(a, one).unwrap()).unwrap())
        .solve(&q, Limits::default())
        .unwrap();
    assert!(outcome.converged() && outcome.sweeps <= alone.sweeps, "{outcome} {alone}");
}

/// Nothing but elimination solves it, for which no time is left.
#[test]
#[cfg(feature = "direct")]
fn an_elimination_that_is_not_begun_leaves_the_time_to_others() {
    let (n, a) = (501, almost_skew());
    let (a, one): (DynRows<f64>, DynRows<f64>) = (&a, &Identity { order: n });
    let problem = Hlcp::new(a, one, Omega::Uniform(0.1)).unwrap();
    let mut auto = Auto::new(problem).unwrap();
    let q: Vec<f64> = (0..n).map(|i| (2.0 * i as f64 + 1.0).cos() - 0.3).collect();
    let q = Rhs::new(&q).unwrap();
    let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
    let is_forgone = |turn: &AutoTurn| (turn.choice, turn.sweeps) == (AutoChoice::Pivoting, 0);
    for _ in 0..2000 {
        let mut clock = Clock::endless();
        clock.until = Some(Instant::now());
        let _ = auto.step(&q, &x, &mut y, &mut clock);
        std::mem::swap(&mut x, &mut y);
        if clock.forgone.is_some() {
            assert!(!clock.is_up() && auto.uses() != AutoChoice::Pivoting);
            assert!(auto.turns().iter().any(is_forgone), "{:?}", auto.turns());
            return;
        }
    }
    panic!("no elimination was thought of: {:?}", auto.turns());
}

/// Newton's method rests far from what rounding leaves, and others take as long as they need.
#[test]
fn lines_without_pivots_are_solved_by_elimination() {
    for (a, q) in [([0.0, 2.0, 1.0, 2.0], [1.0, 0.0]), ([1.0, 1.0, 2.0, 0.0], [-3.0, 2.0])] {
        let a = RowMajor::new(2, a.to_vec()).unwrap();
        let mut solver = Solver::new(auto(&a, &Identity { order: 2 }));
        let outcome = solver.solve(&q, Limits::default()).unwrap();
        assert!(outcome.converged() && outcome.iterations <= 200, "{outcome}");
    }
}
