//! Semismooth Newton: its Jacobian, preconditioners and steps against dense algebra, and how it
//! ends.

use std::{
    ops::ControlFlow,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
};

use crate::common::{
    Altered, Failing, Walked, from, over, planted, posed, problem, solve_from_ones, tmgs,
};
use hlcp_core::{
    Aor, DiagonalMatrix, Hlcp, Identity, Omega, Rhs, Rows, Scalar, SplittingStep, Step, Tridiagonal,
};
use hlcp_methods::{
    Clock, Jacobian, Limits, Method, Mms, Newton, Norm, Options, Outcome, Preconditioner, Solver,
    Ssor, Status, TridiagonalPart,
};
use hlcp_verify::{Disc, Example, Planted, Slider, oracle::Dense};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};
use proptest::{collection::vec, prelude::*};

/// (A + BΩ) + (A − BΩ) diag(sign x), by that formula.
fn dense_jacobian(dense: &Dense, x: &DVector<f64>) -> DMatrix<f64> {
    let b_omega = &dense.b * DMatrix::from_diagonal(&dense.omega);
    let signs = DMatrix::from_diagonal(&x.map(f64::signum));
    (&dense.a + &b_omega) + (&dense.a - &b_omega) * signs
}

/// Multiplies by the inverse that it is given.
struct Inverse(DMatrix<f64>);

impl<A, B> Preconditioner<f64, A, B> for Inverse {
    fn solve(&mut self, _: &Jacobian<'_, f64, A, B>, rhs: &[f64], y: &mut [f64]) {
        y.copy_from_slice((&self.0 * DVector::from_column_slice(rhs)).as_slice());
    }
}

fn mgs(dense: &Dense) -> Mms<f64, DMatrix<f64>, DMatrix<f64>, Aor<f64>> {
    Mms::new(posed(dense), Aor::gauss_seidel()).unwrap()
}

proptest! {
    #[test]
    fn the_jacobian_is_the_formulas(p in planted(1..16, 3.0), s in vec(-2.0..2.0, 16)) {
        let n = p.z.len();
        let (problem, x) = (posed(&p.dense), p.x());
        let expected = dense_jacobian(&p.dense, &x);
        let jacobian = Jacobian::new(&problem, x.as_slice());
        let mut rows = DMatrix::zeros(n, n);
        (0..n).for_each(|i| jacobian.visit_row(i, |j, entry| rows[(i, j)] += entry));
        prop_assert!((&rows - &expected).amax() <= 4.0 * f64::EPSILON * expected.amax());
        let s = DVector::from_column_slice(&s[..n]);
        let mut y = vec![f64::NAN; n];
        jacobian.apply(s.as_slice(), &mut y, &mut vec![f64::NAN; 3]);
        // Sums of 2n terms.
        let rounding = 4.0 * n as f64 * f64::EPSILON * expected.amax() * s.amax() * n as f64;
        prop_assert!((DVector::from_vec(y) - &expected * s).amax() <= rounding);
    }

    /// (D − L) D⁻¹ (D − U) y = rhs for J = D − L − U.
    #[test]
    fn ssor_is_its_definition(p in planted(1..16, 0.8), rhs in vec(-2.0..2.0, 16)) {
        let n = p.z.len();
        let (problem, x) = (posed(&p.dense), p.x());
        let j = dense_jacobian(&p.dense, &x);
        let d = DMatrix::from_diagonal(&j.diagonal());
        let lower = j.lower_triangle() * d.clone().try_inverse().unwrap();
        let product = lower * j.upper_triangle();
        let jacobian = Jacobian::new(&problem, x.as_slice());
        let mut y = vec![f64::NAN; n];
        Ssor.solve(&jacobian, &rhs[..n], &mut y);
        let rest = product * DVector::from_vec(y) - DVector::from_column_slice(&rhs[..n]);
        // Triangles whose rows are off the diagonal by at most 0.8 of it at worst over n unknowns.
        prop_assert!(rest.amax() <= 1e-12);
    }

    #[test]
    fn the_tridiagonal_part_is_solved_with(p in planted(1..16, 0.8), rhs in vec(-2.0..2.0, 16)) {
        let n = p.z.len();
        let (problem, x) = (posed(&p.dense), p.x());
        let j = dense_jacobian(&p.dense, &x);
        let part = DMatrix::from_fn(n, n, |i, k| if i.abs_diff(k) <= 1 { j[(i, k)] } else { 0.0 });
        let rhs = DVector::from_column_slice(&rhs[..n]);
        let expected = part.lu().solve(&rhs).unwrap();
        let jacobian = Jacobian::new(&problem, x.as_slice());
        let (mut y, mut tridiagonal) = (vec![f64::NAN; n], TridiagonalPart::new());
        tridiagonal.solve(&jacobian, rhs.as_slice(), &mut y);
        prop_assert!((DVector::from_vec(y) - expected).amax() <= 1e-12);
    }

    /// The first step settles by two iterations of the base, and then solves with the J found
    /// there, to a tenth, as the second step does.
    #[test]
    fn a_step_is_newtons(p in planted(2..16, 0.6), x0 in vec(-3.0..3.0, 16)) {
        let n = p.z.len();
        let q = Rhs::new(p.dense.q.as_slice()).unwrap();
        let (mut x, mut between) = (x0[..n].to_vec(), vec![0.0; n]);
        let mut clock = Clock::endless();
        let (mut newton, mut base) = (Newton::new(mgs(&p.dense), Ssor), mgs(&p.dense));
        let mut y = vec![f64::NAN; n];
        let norms = newton.step(&q, &x, &mut y, &mut clock);
        prop_assert_eq!(norms, base.step(&q, &x, &mut between, &mut clock));
        let _ = base.step(&q, &between, &mut x, &mut clock);

        for _ in 0..2 {
            let (at, next) = (DVector::from_column_slice(&x), DVector::from_column_slice(&y));
            let j = dense_jacobian(&p.dense, &at);
            let f = &j * &at + p.dense.gamma * &p.dense.q;
            let rest = &f - &j * (&at - &next);
            prop_assert!(rest.norm() <= 0.1 * f.norm() + 1e-12, "{} {}", rest.norm(), f.norm());
            x.copy_from_slice(&y);
            let _ = newton.step(&q, &x, &mut y, &mut clock);
        }
    }

    /// From a start on the solution's piece, one step with an exact inner solve ends at the
    /// solution.
    #[test]
    fn one_step_ends_once_the_active_set_is_right(p in planted(1..16, 0.15), shift in vec(0.95..1.05, 16)) {
        // Entries in modulus between 4 and 8 in z and r, so between 1.6 and 20 in units of γ/2 in
        // x: a start off by 5 %, 1 at most, has the right signs, and two contracting sweeps keep it
        // as near.
        let signed: Vec<f64> =
            (&p.z - &p.r).iter().map(|s| s.signum() * (4.0 + 0.5 * s.abs())).collect();
        let Dense { a, b, omega, gamma, .. } = p.dense;
        let p = Planted::new(a, b, &signed, omega, gamma);
        let inverse = dense_jacobian(&p.dense, &p.x()).try_inverse().unwrap();
        let start: Vec<f64> = p.x().iter().zip(&shift).map(|(x, shift)| x * shift).collect();
        let mut newton = Solver::new(Newton::new(mgs(&p.dense), Inverse(inverse)));
        let limits = Limits { norm: Norm::LInf, ..Limits::absolute(1e-10) };
        let outcome = newton.solve(p.dense.q.as_slice(), Options::from_x(&start).limits(limits)).unwrap();
        prop_assert!(outcome.converged() && outcome.iterations <= 1, "{}", outcome);
        prop_assert!(outcome.linear_iterations.unwrap() <= 1);
        // The margin of tests/planted.rs.
        let z = DVector::from_column_slice(newton.z());
        prop_assert!((z - &p.z).amax() <= 1e-10 / 0.025);
    }

}

/// A P-matrix, positive definite too, on which Newton's method visits {1}, {2}, {3}, {1}, … for
/// ever.
fn carousel() -> Dense {
    Dense {
        a: dmatrix![1.0, 0.0, 1.5; 1.5, 1.0, 0.0; 0.0, 1.5, 1.0],
        b: DMatrix::identity(3, 3),
        q: dvector![1.0, 1.0, 1.0],
        omega: dvector![1.1, 1.1, 1.1],
        gamma: 1.7,
    }
}

/// A part of the step with M = A + Ω, which contracts for the carousel since its A is positive
/// definite.
fn damped(
    dense: &Dense,
    part: f64,
) -> Mms<f64, DMatrix<f64>, DMatrix<f64>, impl Step<f64, DMatrix<f64>, DMatrix<f64>>> {
    let step = part * (&dense.a + DMatrix::from_diagonal(&dense.omega)).try_inverse().unwrap();
    let damped = move |rhs: &[f64], y: &mut [f64]| {
        y.copy_from_slice((&step * DVector::from_column_slice(rhs)).as_slice());
    };
    Mms::with_splitting(posed(dense), damped).unwrap()
}

#[test]
fn a_cycle_of_active_sets_is_broken() {
    let dense = carousel();
    let start = dvector![0.9, -0.7, -0.8];
    let mut x = start.clone();
    let mut sets = vec![];
    for _ in 0..12 {
        sets.push((0..3).filter(|&j| x[j] >= 0.0).collect::<Vec<_>>());
        let rhs = -dense.gamma * &dense.q;
        x = dense_jacobian(&dense, &x).lu().solve(&rhs).unwrap();
    }
    assert_eq!(sets[..4], [vec![0], vec![1], vec![2], vec![0]]);
    assert_eq!(sets[9..], sets[..3]);

    let base = || damped(&dense, 0.1);
    let mut newton = Solver::new(Newton::new(base(), Ssor)).with_history(1000);
    let (q, mut iterates) = (dense.q.as_slice(), vec![]);
    let options = from(start.as_slice()).observer(|progress| {
        iterates.push(progress.x.to_vec());
        ControlFlow::Continue(())
    });
    let outcome = newton.solve(q, options).unwrap();
    assert!(outcome.converged() && outcome.iterations < 100, "{outcome}");
    assert!(newton.z().iter().all(|&z| z <= 1e-9));
    // It did go round, by symmetry at equal residuals, until six steps had brought no progress.
    let residuals: Vec<f64> = newton.history().iter().map(|norms| norms.l2).collect();
    assert!(residuals[2..=7].iter().all(|residual| (residual / residuals[1] - 1.0).abs() < 1e-9));
    // Then the base went on from the best iterate.
    let mut expected = vec![0.0; 3];
    let rhs = Rhs::new(q).unwrap();
    let _ = base().step(&rhs, &iterates[1], &mut expected, &mut Clock::endless());
    assert_eq!(iterates[8], expected);
}

/// The slower the base, the more often the same sets come by, at the same bits too: that is no
/// reason to give up.
#[test]
fn repeated_active_sets_do_not_end_the_solve() {
    for (gamma, omega) in [(1.7, 1.1), (1.7, 1.0), (1.0, 1.0)] {
        for damping in [0.1, 0.03, 0.01, 0.003, 0.001] {
            let dense = Dense { gamma, omega: DVector::from_element(3, omega), ..carousel() };
            let mut newton = Solver::new(Newton::new(damped(&dense, damping), Ssor));
            for start in [[0.9, -0.7, -0.8], [1.0, -1.0, -1.0], [2.0, 1.0, -1.0]] {
                let outcome = newton.solve(dense.q.as_slice(), from(&start)).unwrap();
                assert!(outcome.converged(), "{gamma} {omega} {damping} {start:?}: {outcome}");
                assert!(newton.z().iter().all(|&z| z <= 1e-9));
            }
        }
    }
}

/// Where the base has several turns, each twice as long as the last, a second solve repeats the
/// first; and sweeps are what was done: a defect, a residual or a step of the base is a product,
/// and an iteration of the inner solver is two products and two solves with the preconditioner, if
/// not the half of it.
#[test]
fn a_solve_forgets_the_last_one_and_counts_its_work() {
    let dense = carousel();
    let step = 0.03 * (&dense.a + DMatrix::from_diagonal(&dense.omega)).try_inverse().unwrap();
    let (turns, solves) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let damped = |rhs: &[f64], y: &mut [f64]| {
        turns.fetch_add(1, Relaxed);
        y.copy_from_slice((&step * DVector::from_column_slice(rhs)).as_slice());
    };
    let none = SplittingStep(|rhs: &[f64], y: &mut [f64]| {
        solves.fetch_add(1, Relaxed);
        y.copy_from_slice(rhs);
    });
    let a = Walked::new(dense.a.clone());
    let omega = Omega::Uniform(dense.omega[0]);
    let problem = Hlcp::new(&a, Identity { order: 3 }, omega).unwrap();
    let base = Mms::with_splitting(problem.with_gamma(dense.gamma).unwrap(), damped).unwrap();
    // Its steps grow shorter with their number.
    let fading = Altered::new(base, |k, x, y, norms, _| {
        let shorter = 1.0 / (1.0 + 0.01 * k as f64);
        y.iter_mut().zip(x).for_each(|(y, x)| *y = x + shorter * (*y - x));
        norms
    });
    let mut newton = Solver::new(Newton::new(fading, none));
    let mut solve = || {
        for count in [&a.products, &solves, &turns] {
            count.store(0, Relaxed);
        }
        let start = [0.9, -0.7, -0.8];
        let outcome = newton.solve(dense.q.as_slice(), from(&start)).unwrap();
        assert!(outcome.converged() && outcome.iterations > 20, "{outcome}");
        let linear = outcome.linear_iterations.unwrap();
        let (products, solves) = (a.products.load(Relaxed), solves.load(Relaxed));
        let halves = 2 * linear - solves;
        // Two products look at the answer and measure it.
        assert_eq!(outcome.sweeps, products - 2 + solves + 2 * halves);
        // Two steps of the base begin each of five phases, and 2, 4, 8 and 16 lie between them.
        assert_eq!(turns.load(Relaxed), 5 * 2 + 30);
        (outcome.iterations, outcome.sweeps, linear, newton.x().to_vec())
    };
    assert_eq!(solve(), solve());
}

/// A = e eᵀ is singular on the piece of the start, and the system there has no solution.
#[test]
fn a_singular_jacobian_is_left_behind() {
    let a = DMatrix::<f64>::from_element(2, 2, 1.0);
    let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(1.3)).unwrap();
    let base = Mms::new(problem, Aor::gauss_seidel()).unwrap();
    let mut newton = Solver::new(Newton::new(base, Ssor));
    let outcome = newton.solve(&[-1.0, -2.0], from(&[0.4, 0.6])).unwrap();
    assert!(outcome.converged(), "{outcome}");
    assert!((newton.z()[0] + newton.z()[1] - 2.0).abs() <= 1e-9);
    assert!((newton.r()[0] - 1.0).abs() <= 1e-9 && newton.r()[1] <= 1e-9);
}

/// z + r + 1 = 0 has no solution. Newton's method makes the unknown active and inactive in turn,
/// which is no progress, so the base has its turns: two steps at the beginning of each of three
/// phases, and 2 and 4 between them.
#[test]
fn two_active_sets_in_turn_are_no_progress() {
    let turns = AtomicUsize::new(0);
    let still = |_: &[f64], y: &mut [f64]| {
        turns.fetch_add(1, Relaxed);
        y.fill(0.0);
    };
    let minus = DiagonalMatrix::new(vec![-1.0]).unwrap();
    let problem = Hlcp::new(Identity { order: 1 }, minus, Omega::Uniform(1.3)).unwrap();
    let base = Mms::with_splitting(problem, still).unwrap();
    let limits = Limits { iterations: 100, ..Limits::absolute(1e-10) };
    let mut newton = Solver::new(Newton::new(base, TridiagonalPart::new()));
    let outcome = newton.solve(&[1.0], Options::from_x(&[0.4]).limits(limits)).unwrap();
    assert!(!outcome.converged() && turns.load(Relaxed) >= 3 * 2 + 2 + 4, "{outcome}");
}

/// Products alone, with a user's splitting for preconditioner; and what becomes of NaN at any
/// moment.
#[test]
fn an_operator_of_products_and_one_that_turns_nan() {
    for sound in (0..12).chain([usize::MAX]) {
        let problem =
            Hlcp::new(Failing::after(sound), Identity { order: 3 }, Omega::Uniform(3.5)).unwrap();
        let base = Mms::with_splitting(problem, over(9.0)).unwrap();
        let mut newton = Solver::new(Newton::new(base, SplittingStep(over(9.0))));
        let outcome = newton.solve(&[-1.5, 2.0, 0.5], from(&[0.3; 3])).unwrap();
        if sound == usize::MAX {
            assert!(outcome.converged() && outcome.iterations <= 3, "{outcome}");
        } else {
            assert!(!outcome.converged() || outcome.residual.l2 <= 1e-10);
            let diverged = matches!(outcome.status, Status::Diverged(_));
            assert!(outcome.converged() || diverged, "{sound}: {outcome}");
        }
    }
}

/// A diagonal pair, where SSOR is exact: one inner iteration per step.
#[test]
fn an_exact_inner_solve_ends_in_two_steps() {
    let a = DiagonalMatrix::new(vec![2.0, 3.0, 0.7]).unwrap();
    let b = DiagonalMatrix::new(vec![1.5, 0.4, 2.2]).unwrap();
    let problem = Hlcp::new(a, b, Omega::Each(vec![0.9, 4.0, 1.7])).unwrap();
    // A base that goes nowhere settles nothing.
    let still = |_: &[f64], y: &mut [f64]| y.fill(0.0);
    let base = Mms::with_splitting(problem, still).unwrap();
    let mut newton = Solver::new(Newton::new(base, Ssor));
    let outcome = newton.solve(&[-3.0, 1.0, -2.0], from(&[-1.0, 2.0, 1.0])).unwrap();
    assert!(outcome.converged() && outcome.iterations == 2, "{outcome}");
    assert_eq!(outcome.linear_iterations, Some(2));
}

fn solve<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: Hlcp<T, A, B>,
    preconditioner: impl Preconditioner<T, A, B>,
    q: &[T],
    limits: &Limits,
) -> (Outcome, usize, Vec<T>) {
    let mut newton = Solver::new(Newton::new(tmgs(problem), preconditioner));
    let outcome = solve_from_ones(&mut newton, q, *limits);
    (outcome, outcome.linear_iterations.unwrap(), newton.z().to_vec())
}

#[test]
fn two_or_three_steps_on_the_papers_examples() {
    for symmetric in [true, false] {
        for (mu, nu) in [(4.0, 4.0), (1.0, 1.0), (0.0, 0.0), (0.0, 4.0)] {
            for tau in [0.8, 1.0, 1.2] {
                let scene = Example { symmetric, m: 64, mu, nu }.pose::<f64>().unwrap();
                let problem = problem(tau, scene.a, scene.b);
                let (outcome, _, z) = solve(problem, Ssor, &scene.q, &Limits::absolute(1e-10));
                assert!(outcome.converged() && outcome.iterations <= 3, "{outcome}");
                // The condition number is below 64² at μ = ν = 0, and smaller elsewhere.
                assert!(z.iter().zip(&scene.z).all(|(z, known)| (z - known).abs() <= 1e-6));
            }
        }
    }
}

#[test]
fn six_steps_on_the_slider() {
    for cells in [50, 128, 512] {
        let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
        let problem = problem(1.0, a, b);
        let limits = Limits::relative(1e-10);
        let (outcome, inner, z) = solve(problem, TridiagonalPart::new(), &q, &limits);
        assert!(outcome.converged() && outcome.iterations <= 6, "{cells}: {outcome}");
        // The direct solve is the preconditioner: an inner iteration a step.
        assert_eq!(inner, outcome.iterations);
        let step = Slider::LENGTH / cells as f64;
        assert!((Slider { cells }.rupture(&z) - Slider::RUPTURE).abs() <= step);
    }
}

/// q of the elastic–plastic torsion of a strip, for −u″ on `n` points: u″ = −5 where u is below the
/// distance d to the edge, z = d − u. It is plastic, z = 0, but for the middle two fifths, where
/// u = 2/5 − (5/2)(x − 1/2)²; so z = 1/10 at x = 1/2.
pub(crate) fn torsion(n: usize) -> Vec<f64> {
    let h = 1.0 / (n + 1) as f64;
    let distance = |j: usize| j.min(n + 1 - j) as f64 * h;
    let fold = |j: usize| 2.0 * distance(j) - distance(j - 1) - distance(j + 1);
    (1..=n).map(|j| 5.0 * h * h - fold(j)).collect()
}

/// The plastic parts grow from the edges by one point per step, and ‖F‖ does not fall for long.
#[test]
fn a_front_that_moves_one_point_per_step_is_followed() {
    for n in [128, 512, 2048] {
        let h = 1.0 / (n + 1) as f64;
        let a = Tridiagonal::new(n, |_| [-1.0, 2.0, -1.0]).unwrap();
        let q = torsion(n);
        let problem = Hlcp::new(a, Identity { order: n }, Omega::Uniform(2.0)).unwrap();
        let limits = Limits::relative(1e-10);
        // With z and r exchanged the active set shrinks where it grew.
        let exchanged = problem.clone().exchanged().unwrap();
        for (outcome, inner, z) in [
            solve(problem, TridiagonalPart::new(), &q, &limits),
            solve(exchanged, TridiagonalPart::new(), &q, &limits),
        ] {
            // A fifth of the points at each end, an inner iteration each.
            assert!(outcome.converged() && outcome.iterations <= n / 5 + 2, "{n}: {outcome}");
            assert_eq!(inner, outcome.iterations);
            // The fold of d is half a cell from the nearest node, and z there off by its slope.
            assert!((z[n / 2] - 0.1).abs() < h, "{n}: {}", z[n / 2]);
        }
    }
}

proptest! {
    /// Where A is an M-matrix and (II) holds, full steps need no safeguard: from any start they end
    /// in n + 2, and the base has the two turns alone that begin the first phase.
    #[test]
    fn no_safeguard_acts_where_full_steps_rise(
        n in 1..40_usize,
        sizes in vec([0.0..4.0, 0.0..4.0, 0.1..1.0, 0.5..2.0, -2.0..2.0, -2.0..2.0], 40),
        shares in vec([0.0..1.0, 0.0..1.0, 1.0..3.0], 40),
    ) {
        // A d > 0 for d at random, and A ≤ B entry by entry, with Ω = I.
        let d = |i: usize| if i < n { sizes[i][3] } else { 0.0 };
        let a = |i: usize| {
            let [west, east, slack, own, ..] = sizes[i];
            let sum = if i > 0 { west * d(i - 1) } else { 0.0 } + east * d(i + 1);
            [-west, (sum + slack) / own, -east]
        };
        let b = |i: usize| {
            let ([west, centre, east], [to_west, to_east, more]) = (a(i), shares[i]);
            [to_west * west, more * centre, to_east * east]
        };
        let turns = AtomicUsize::new(0);
        let jacobi = |rhs: &[f64], y: &mut [f64]| {
            turns.fetch_add(1, Relaxed);
            (0..n).for_each(|i| y[i] = rhs[i] / (a(i)[1] + b(i)[1]));
        };
        let (of_a, of_b) = (Tridiagonal::new(n, a).unwrap(), Tridiagonal::new(n, b).unwrap());
        let problem = Hlcp::new(of_a, of_b, Omega::Uniform(1.0)).unwrap();
        let base = Mms::with_splitting(problem, jacobi).unwrap();
        let mut newton = Solver::new(Newton::new(base, TridiagonalPart::new()));
        let [q, x]: [Vec<f64>; 2] = [4, 5].map(|k| sizes[..n].iter().map(|s| s[k]).collect());
        let limits = Limits::relative(1e-10);
        let outcome = newton.solve(&q, Options::from_x(&x).limits(limits)).unwrap();
        prop_assert!(outcome.converged() && outcome.iterations <= n + 2, "{}", outcome);
        prop_assert!(turns.load(Relaxed) <= 2);
    }
}

/// Outer steps and inner iterations on the disc.
#[test]
fn tens_of_steps_on_the_disc() {
    let counts =
        [(true, 64, 13, 89), (true, 128, 14, 155), (false, 64, 8, 75), (false, 128, 22, 178)];
    for (lcp, m, outer, inner) in counts {
        let scene = Disc { lcp, m }.pose::<f64>().unwrap();
        let problem = problem(1.0, scene.a, scene.b);
        let (outcome, linear, z) = solve(problem, Ssor, &scene.q, &Limits::absolute(1e-10));
        assert!(outcome.converged());
        assert!(outcome.iterations.abs_diff(outer) <= 1, "{lcp} {m}: {outcome}");
        assert!(linear.abs_diff(inner) <= inner / 10, "{lcp} {m}: {linear}");
        // The residual times the inverse of a matrix of columns of A and B, of norm O(m²/8).
        let off = outcome.residual.linf * (m * m) as f64 + 1e-12;
        assert!(z.iter().zip(&scene.z).all(|(z, known)| (z - known).abs() <= off));
    }
}
