//! Multigrid: cycles that do not grow with the grid, honest ends, and what the documentation
//! promises.

use crate::common::{
    from, largest_difference, noise, not_finite, parts, planted_q, problem, solve_from_ones, tmgs,
};
use approx::assert_relative_eq;
use hlcp_core::{
    Entries::{Each, Uniform},
    Error, FivePoint, Hlcp, Identity, Norms, Omega, Rhs, Rows, Scalar, Tridiagonal, Varying,
};
use hlcp_methods::{Clock, Cycle, FullMultigrid, Limits, Method, Multigrid, Options, Solver};
use hlcp_verify::{Disc, Example, Obstacle, Posed};
use proptest::prelude::*;

/// The scene's problem with Ω = D_A D_B⁻¹.
fn posed<T: Scalar, A: Rows<T> + Clone, B: Rows<T> + Clone>(
    scene: &Posed<T, A, B>,
) -> Hlcp<T, A, B> {
    problem(1.0, scene.a.clone(), scene.b.clone())
}

fn disc_cycles<T: Scalar>(lcp: bool, m: usize, cycle: Cycle) -> usize {
    let scene = Disc { lcp, m }.pose::<T>().unwrap();
    let mut solver = Solver::new(Multigrid::new(posed(&scene), cycle).unwrap());
    let outcome = solve_from_ones(&mut solver, &scene.q, Limits::absolute(1e-10));
    assert!(outcome.converged(), "{m}, lcp {lcp}, {cycle:?}: {outcome}");
    assert_eq!(solver.method().coarse_grids_help(), Some(true));
    // The inverse of A has the norm (m + 1)²/2π², and so have the mixtures of columns of A and B up
    // to a small factor. In single precision the residual's rounding is 4 ε (‖q‖ + …), near 6e-7.
    let inverse = ((m + 1) * (m + 1)) as f64;
    let residual = if T::epsilon().to_f64() > Some(1e-10) { 6e-7 } else { 1e-10 };
    assert!(largest_difference(solver.z(), &scene.z) <= inverse * residual);
    outcome.iterations
}

#[test]
fn cycles_do_not_grow_with_the_grid() {
    for lcp in [true, false] {
        for m in [63, 127, 255, 511, 512] {
            for cycle in [Cycle::W, Cycle::F] {
                let cycles = disc_cycles::<f64>(lcp, m, cycle);
                assert!(cycles <= 13, "{m}, lcp {lcp}: {cycles}");
            }
        }
        assert!(disc_cycles::<f32>(lcp, 127, Cycle::W) <= 13);
        // Sizes of all kinds; 69, 109 and 189 were the worst below 200.
        for m in [40, 47, 50, 69, 85, 96, 109, 120, 141, 189, 200, 250, 301] {
            let cycles = disc_cycles::<f64>(lcp, m, Cycle::W);
            assert!(cycles <= 16, "{m}, lcp {lcp}: {cycles}");
        }
    }
}

/// F-cycles come to a halt on the membrane over a dome at these sizes, on the way from one even
/// number of points to the next: three of them, at most, before W-cycles take over.
#[test]
fn f_cycles_that_do_not_halve_the_defect_give_way_to_w_cycles() {
    for m in [382, 383, 384] {
        let (a, b, q) = Obstacle { m }.pose::<f64>().unwrap();
        let [f, w] = [Cycle::F, Cycle::W].map(|cycle| {
            let mut solver = Solver::new(Multigrid::new(problem(1.0, a, b), cycle).unwrap());
            let outcome = solve_from_ones(&mut solver, &q, Limits::relative(1e-10));
            assert!(outcome.converged(), "{m}, {cycle:?}: {outcome}");
            outcome.iterations
        });
        assert!(f <= w + 4, "{m}: {f} F-cycles, {w} W-cycles");
    }
}

/// Contact on a disc in a rectangle, posed around its solution with any pair of operators.
fn planted_disc<A: Rows<f64>, B: Rows<f64>>(
    [nx, ny]: [usize; 2],
    a: A,
    b: B,
    force: f64,
) -> Posed<f64, A, B> {
    let d = |k: usize| {
        let [x, y] =
            [((k % nx) + 1) as f64 / (nx + 1) as f64, ((k / nx) + 1) as f64 / (ny + 1) as f64];
        0.16 - (x - 0.5).powi(2) - (y - 0.5).powi(2)
    };
    let z: Vec<f64> = (0..nx * ny).map(|k| 20.0 * d(k).max(0.0).powi(2)).collect();
    let r: Vec<f64> = (0..nx * ny).map(|k| force * (-d(k)).max(0.0)).collect();
    let q = planted_q(&a, &b, [&z, &r]);
    Posed { a, b, q, z, r }
}

/// Sides that differ, spacings that differ, Ω that varies, γ, and the roles of z and r exchanged.
#[test]
fn rectangles_scalings_and_the_exchange_are_solved_alike() {
    let [nx, ny] = [96, 41];
    let a = FivePoint::new(nx, ny, [-0.3, -1.2, 3.0, -1.2, -0.3]).unwrap();
    let b = FivePoint::new(nx, ny, [-0.1, -0.9, 3.5, -0.8, -0.2]).unwrap();
    let scene = planted_disc([nx, ny], a, b, 0.7);
    let omega = Omega::Each((0..nx * ny).map(|k| 0.9 + 0.2 * ((k / 7) as f64).sin()).collect());
    let posed = Hlcp::new(a, b, omega).unwrap().with_gamma(1.7).unwrap();
    for posed in [posed.clone(), posed.exchanged().unwrap()] {
        let mut solver = Solver::new(Multigrid::new(posed, Cycle::W).unwrap());
        let outcome = solve_from_ones(&mut solver, &scene.q, Limits::absolute(1e-10));
        assert!(outcome.converged() && outcome.iterations <= 20, "{outcome}");
        assert!(largest_difference(solver.z(), &scene.z) <= 1e-7);
        assert!(largest_difference(solver.r(), &scene.r) <= 1e-7);
    }
}

/// A cylinder either way, a torus, and a ring with an odd number of points, which stays as it is.
#[test]
fn cycles_do_not_grow_on_grids_that_close() {
    let cases = [
        ([64, 63], [true, false], 16),
        ([256, 127], [true, false], 16),
        ([127, 256], [false, true], 16),
        ([192, 128], [true, true], 16),
        ([63, 127], [true, false], 200),
    ];
    for ([nx, ny], round, most) in cases {
        let centre = if round == [true; 2] { 4.0 + 1e-3 } else { 4.0 };
        let a = FivePoint::new(nx, ny, [-1.0, -1.0, centre, -1.0, -1.0]).unwrap();
        let b = FivePoint::new(nx, ny, [0.0, -1.0, 4.0, -1.0, 0.0]).unwrap();
        let [a, b] = [a, b].map(|operator| operator.periodic(round).unwrap());
        let scene = planted_disc([nx, ny], a, b, 0.7);
        let mut solver = Solver::new(Multigrid::new(posed(&scene), Cycle::F).unwrap());
        let outcome = solve_from_ones(&mut solver, &scene.q, Limits::absolute(1e-10));
        assert!(
            outcome.converged() && outcome.iterations <= most,
            "{nx} {ny} {round:?}: {outcome}"
        );
        assert!(largest_difference(solver.z(), &scene.z) <= 1e-5);
    }
}

/// −∇·(c∇·) with c = 1 in one half and c = 100 in the other, by harmonic means on the edges.
fn jump(nx: usize, ny: usize) -> FivePoint<Varying<f64>> {
    let c = |i: isize| if 2 * i < nx as isize { 1.0 } else { 100.0 };
    let mean = |u: f64, v: f64| 2.0 * u * v / (u + v);
    FivePoint::from_fn(nx, ny, |i, _| {
        let i = i as isize;
        let (west, east) = (mean(c(i - 1), c(i)), mean(c(i), c(i + 1)));
        [-c(i), -west, west + east + 2.0 * c(i), -east, -c(i)]
    })
    .unwrap()
}

#[test]
fn a_jump_in_the_coefficients_costs_few_cycles_more() {
    for (m, lcp) in [(63, true), (80, true), (127, false)] {
        let a = jump(m, m);
        let scene = if lcp {
            let b = FivePoint::from_fn(m, m, |_, _| [0.0, 0.0, 1.0, 0.0, 0.0]).unwrap();
            planted_disc([m, m], a, b, 10.0 / (m * m) as f64)
        } else {
            let b = FivePoint::from_fn(m, m, |i, _| {
                [0.0, -1.0, 4.0 + (i as f64 / 9.0).sin(), -1.0, 0.0]
            });
            planted_disc([m, m], a, b.unwrap(), 1.0)
        };
        let mut solver = Solver::new(Multigrid::new(posed(&scene), Cycle::W).unwrap());
        let outcome = solve_from_ones(&mut solver, &scene.q, Limits::absolute(1e-10));
        assert!(outcome.converged() && outcome.iterations <= 20, "{m}: {outcome}");
        assert!(largest_difference(solver.z(), &scene.z) <= 1e-6);
    }
}

#[test]
fn nested_iteration_ends_below_the_discretisation_error() {
    for m in [17, 65, 100, 129, 257] {
        let obstacle = Obstacle { m };
        let (a, b, q) = obstacle.pose::<f64>().unwrap();
        let multigrid = Multigrid::new(problem(1.0, a, b), Cycle::F).unwrap();
        let (start, mut x) = (vec![1.0; q.len()], vec![f64::NAN; q.len()]);
        let mut full = FullMultigrid::new(multigrid.clone());
        full.step(&Rhs::new(&q).unwrap(), &start, &mut x, &mut Clock::endless());
        let nested: Vec<f64> = x.iter().map(|x| x.abs() + x).collect();
        let mut solver = Solver::new(multigrid);
        let outcome = solver.solve(&q, from(&x)).unwrap();
        assert!(outcome.converged(), "{m}: {outcome}");
        let discretisation = obstacle.errors(solver.z());
        let distances = nested.iter().zip(solver.z()).map(|(u, v)| (u - v).abs());
        let mean = distances.sum::<f64>() / (m * m) as f64;
        let algebraic = [mean, largest_difference(&nested, solver.z())];
        assert!(3.0 * algebraic[0] < discretisation[0], "{m}: {algebraic:?} {discretisation:?}");
        assert!(algebraic[1] < discretisation[1], "{m}: {algebraic:?} {discretisation:?}");
    }
}

/// Where signs alternate from point to point, coarse grids are no help: it is noticed, and sweeps
/// take over.
#[test]
fn alternating_signs_are_left_to_sweeps() {
    for symmetric in [true, false] {
        for (mu, m) in [(4.0, 127), (4.0, 128), (0.0, 128)] {
            let scene = Example { symmetric, m, mu, nu: mu }.pose::<f64>().unwrap();
            let mut multigrid = Solver::new(Multigrid::new(posed(&scene), Cycle::W).unwrap());
            let cycles = solve_from_ones(&mut multigrid, &scene.q, Limits::absolute(1e-10));
            assert!(cycles.converged(), "{cycles}");
            assert_eq!(multigrid.method().coarse_grids_help(), Some(false));
            let tmgs = tmgs(posed(&scene));
            let sweeps = solve_from_ones(&mut Solver::new(tmgs), &scene.q, Limits::absolute(1e-10));
            assert!(cycles.sweeps <= 2 * sweeps.sweeps, "{symmetric} {mu}: {cycles}, {sweeps}");
            assert!(largest_difference(multigrid.z(), &scene.z) <= 1e-8);
        }
    }
}

/// V-cycles diverge on this obstacle, near its solution: the safeguard goes on without them.
#[test]
fn a_diverging_cycle_is_handed_to_sweeps() {
    let (a, b, q) = Obstacle { m: 64 }.pose::<f64>().unwrap();
    let mut solver = Solver::new(Multigrid::new(problem(1.0, a, b), Cycle::V).unwrap());
    let outcome = solve_from_ones(&mut solver, &q, Limits::absolute(1e-10));
    assert!(outcome.converged(), "{outcome}");
}

/// The pure Neumann problem: A is singular, and with Σq < 0 there is no solution, since Σr = Σq.
#[test]
fn a_problem_without_solution_is_not_solved() {
    let [nx, ny] = [31, 20];
    let a = FivePoint::from_fn(nx, ny, |i, j| {
        let [south, west, east, north] = [j > 0, i > 0, i + 1 < nx, j + 1 < ny].map(f64::from);
        [-south, -west, south + west + east + north, -east, -north]
    });
    let problem = Hlcp::new(a.unwrap(), Identity { order: nx * ny }, Omega::Uniform(3.0)).unwrap();
    let q: Vec<f64> = (0..nx * ny).map(|k| (k as f64).sin() - 0.2).collect();
    let mut solver = Solver::new(Multigrid::new(problem, Cycle::W).unwrap());
    let limits = Limits { iterations: 200, ..Limits::absolute(1e-10) };
    let outcome = solve_from_ones(&mut solver, &q, limits);
    assert!(!outcome.converged(), "{outcome}");
    assert!(outcome.residual.l2 > 0.2 * (nx * ny) as f64 / (nx * ny) as f64);
}

/// Strictly dominant pairs of coefficients without pattern, on which no coarse grid means anything.
fn dominant(nx: usize, ny: usize, centre: f64, seed: usize) -> FivePoint<Varying<f64>> {
    FivePoint::from_fn(nx, ny, |i, j| {
        let off = |d: usize| noise(seed + 5 * (j * nx + i) + d);
        [off(0), off(1), centre + off(2), off(3), off(4)]
    })
    .unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// min(aᵢᵢ, ωᵢbᵢᵢ) exceeds the sum of max(|aᵢⱼ|, ωⱼ|bᵢⱼ|): the sweeps contract from any start,
    /// whatever cycles do.
    #[test]
    fn dominant_pairs_are_solved_from_any_start(
        nx in 1_usize..24, ny in 1_usize..24, seed in 0_usize..1000, size in -3..4_i32,
        cycle in prop::sample::select(vec![Cycle::V, Cycle::F, Cycle::W]),
    ) {
        let (n, size) = (nx * ny, 10_f64.powi(size));
        let (a, b) = (dominant(nx, ny, 7.0, seed), dominant(nx, ny, 8.0, seed + 7));
        let signed: Vec<f64> = (0..n).map(|k| size * noise(seed + 3 * k)).collect();
        let [z, r] = parts(&signed);
        let q = planted_q(&a, &b, [&z, &r]);
        let omega = Omega::Each((0..n).map(|k| 1.1 + 0.1 * noise(seed + k)).collect());
        let problem = Hlcp::new(a, b, omega).unwrap().with_gamma(0.6).unwrap();
        let mut solver = Solver::new(Multigrid::new(problem, cycle).unwrap());
        let start: Vec<f64> = (0..n).map(|k| 1e3 * noise(k + seed)).collect();
        let limits = Limits::absolute(1e-12 * size * (n as f64).sqrt());
        let outcome = solver.solve(&q, Options::from_x(&start).limits(limits)).unwrap();
        prop_assert!(outcome.converged(), "{outcome}");
        // The margin is at least 6 − 4·1.2.
        let off = 1.2 / 1.2 * outcome.residual.linf + 1e-14 * size;
        prop_assert!(largest_difference(solver.z(), &z) <= off);
        prop_assert!(largest_difference(solver.r(), &r) <= 1.2 * off);
    }

    /// A solution is a fixed point of cycles and of sweeps, up to rounding; and the norms are the
    /// input's own.
    #[test]
    fn solutions_are_fixed_points(
        nx in 1_usize..40, ny in 1_usize..40, seed in 0_usize..1000,
        cycle in prop::sample::select(vec![Cycle::V, Cycle::F, Cycle::W]),
    ) {
        let n = nx * ny;
        let a = FivePoint::new(nx, ny, [-1.1, -0.9, 4.6, -1.2, -0.8]).unwrap();
        let b = FivePoint::new(nx, ny, [-0.2, -0.7, 3.1, -0.6, -0.3]).unwrap();
        let [z, r] = parts(&(0..n).map(|k| noise(seed + k / 5)).collect::<Vec<_>>());
        let q = planted_q(&a, &b, [&z, &r]);
        let problem = Hlcp::new(a, b, Omega::Uniform(1.4)).unwrap().with_gamma(1.7).unwrap();
        let mut multigrid = Multigrid::new(problem.clone(), cycle).unwrap();
        let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
        problem.x_from_solution(&z, &r, &mut x);
        let rhs = Rhs::new(&q).unwrap();
        for _ in 0..12 {
            let norms = multigrid.step(&rhs, &x, &mut y, &mut Clock::endless());
            // A defect is a sum of a dozen terms of the size of 2·4.6·γ, and a cycle's inverse is
            // at most 1/0.3 or so.
            prop_assert!(largest_difference(&x, &y) <= 1e-13 && norms.linf <= 1e-14);
            std::mem::swap(&mut x, &mut y);
        }
        // Elsewhere the norms are those of A z − B r + q.
        let far: Vec<f64> = (0..n).map(|k| 3.0 * noise(seed + 11 * k)).collect();
        let norms = multigrid.step(&rhs, &far, &mut y, &mut Clock::endless());
        let (mut z, mut r) = (vec![0.0; n], vec![0.0; n]);
        problem.solution_from_x(&far, &mut z, &mut r);
        let Norms { l2, linf } = problem.residual(&rhs, &z, &r, &mut vec![]);
        prop_assert!((norms.l2 / l2 - 1.0).abs() < 1e-13 && (norms.linf / linf - 1.0).abs() < 1e-13);
    }
}

/// What is wrong is refused with its numbers.
#[test]
fn bad_operators_are_refused() {
    let a = FivePoint::new(4, 3, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    let other = FivePoint::new(3, 4, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    let refused = Multigrid::new(Hlcp::new(a, other, Omega::Uniform(1.0)).unwrap(), Cycle::W);
    assert!(matches!(refused, Err(Error::NotFivePoint { what: "B" })));
    let shut = Tridiagonal::new(12, |_| [-1.0, 4.0, -1.0]).unwrap();
    let refused = Multigrid::new(Hlcp::new(shut, a, Omega::Uniform(1.0)).unwrap(), Cycle::W);
    assert!(matches!(refused, Err(Error::NotFivePoint { what: "A" })));
    let centre: Vec<f64> = (0..12).map(|k| if k == 7 { 0.0 } else { 4.0 }).collect();
    let off = Uniform(-1.0);
    let hole = FivePoint::new(4, 3, [off, off, Each(&centre), off, off]).unwrap();
    let refused = Multigrid::new(Hlcp::new(a, hole, Omega::Uniform(1.0)).unwrap(), Cycle::W);
    assert!(matches!(refused, Err(Error::NotPositive { index: 7, .. })));
    let spoilt = Hlcp::new(not_finite(), Identity { order: 4 }, Omega::Uniform(4.0)).unwrap();
    assert!(matches!(Multigrid::new(spoilt, Cycle::W), Err(Error::NotFinite { .. })));
}

/// Nested iteration begins each solve, whatever the start and whatever was solved before; its norms
/// are the input's.
#[test]
fn full_multigrid_begins_every_solve_by_itself() {
    let [nx, ny] = [60, 41];
    let a = FivePoint::new(nx, ny, [-0.3, -1.2, 3.0, -1.2, -0.3]).unwrap();
    let b = FivePoint::new(nx, ny, [-0.1, -0.9, 3.5, -0.8, -0.2]).unwrap();
    let scene = planted_disc([nx, ny], a, b, 0.7);
    let posed = Hlcp::new(a, b, Omega::Uniform(0.9)).unwrap().with_gamma(1.7).unwrap();
    for posed in [posed.clone(), Hlcp::new(a, b, Omega::Uniform(1.2)).unwrap()] {
        let multigrid = Multigrid::new(posed.clone(), Cycle::F).unwrap();
        let rhs = Rhs::new(&scene.q).unwrap();
        let (start, mut nested) = (vec![0.6; nx * ny], vec![f64::NAN; nx * ny]);
        let mut one = multigrid.clone();
        let _ = one.step(&rhs, &start, &mut nested, &mut Clock::endless());
        let cycle = one.work().unwrap().sweeps;
        let full = FullMultigrid::new(multigrid);
        full.clone().step(&rhs, &start, &mut nested, &mut Clock::endless());

        let mut solver = Solver::new(full).with_history(2);
        let mut first_iterate = vec![];
        let mut run = |start: &[f64], q: &[f64]| {
            let options = from(start).observer(|progress| {
                if progress.iteration == 1 {
                    first_iterate = progress.x.to_vec();
                }
                std::ops::ControlFlow::Continue(())
            });
            let outcome = solver.solve(q, options).unwrap();
            assert!(outcome.converged(), "{outcome}");
            assert_eq!(first_iterate == nested, q == scene.q);
            // Two cycles and two sweeps more than the others, 25 walks at most; a W-cycle, for
            // which F-cycles may be given up, is one more.
            let [most, least] =
                [0, 1].map(|w| outcome.sweeps - (outcome.iterations - 1) * (cycle + w));
            assert!(most > 2 * cycle && least <= 25, "{outcome}");
            (outcome.iterations, outcome.residual, solver.history()[0], solver.x().to_vec())
        };
        let first = run(&start, &scene.q);
        let other: Vec<f64> = scene.q.iter().map(|q| 0.5 * q).collect();
        let _ = run(&start, &other);
        assert_eq!(run(&start, &scene.q), first);
        let elsewhere = run(&vec![-30.0; nx * ny], &scene.q);
        assert_eq!((elsewhere.0, elsewhere.1, elsewhere.3), (first.0, first.1, first.3));

        let (mut z, mut r) = (vec![0.0; nx * ny], vec![0.0; nx * ny]);
        posed.solution_from_x(&start, &mut z, &mut r);
        let expected = posed.residual(&rhs, &z, &r, &mut vec![]);
        assert_relative_eq!(first.2.l2, expected.l2, epsilon = 0.0, max_relative = 1e-13);
        assert_relative_eq!(first.2.linf, expected.linf, epsilon = 0.0, max_relative = 1e-13);
    }
}
