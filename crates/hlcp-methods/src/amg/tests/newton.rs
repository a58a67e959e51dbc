//! Newton's method with the multigrid.

use super::*;
use crate::{Limits, Method, Mms, Newton, Options, Solver, Ssor};
use hlcp_core::{Aor, Rhs};

/// A planted solution: patches where z is positive, and others where r is.
fn planted<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    width: usize,
) -> (Vec<T>, Vec<T>, Vec<T>) {
    let n = a.order();
    let sign = |k: usize| {
        let [x, y] = [k % width, k / width].map(|i| i as f64 / width as f64);
        (4.0 * x + 1.0).sin() + (3.0 * y + x).cos() * 0.8 + 0.1
    };
    let z: Vec<T> = (0..n).map(|k| T::of(sign(k).max(0.0))).collect();
    let r: Vec<T> = (0..n).map(|k| T::of((-sign(k)).max(0.0))).collect();
    let (mut az, mut q) = (vec![T::zero(); n], vec![T::zero(); n]);
    a.apply(&z, &mut az);
    b.apply(&r, &mut q);
    q.iter_mut().zip(&az).for_each(|(q, &az)| *q -= az);
    (z, r, q)
}

/// From this start to a residual of 1e-10.
fn from_one<T>(start: &[T]) -> Options<'_, T> {
    Options::from_x(start).limits(Limits::absolute(1e-10))
}

/// The method on an ordinary base.
type Plain<'p, T, A, B> = AmgNewton<T, Mms<T, &'p A, &'p B, Aor<T>>>;

fn solver<'p, T: Scalar, A: Rows<T>, B: Rows<T>>(
    a: &'p A,
    b: &'p B,
) -> Solver<T, Plain<'p, T, A, B>> {
    let base = Mms::new(Hlcp::from_pair(a, b).unwrap(), Aor::gauss_seidel()).unwrap();
    Solver::new(AmgNewton::new(base).unwrap())
}

/// Solves a planted problem, and returns how far z and r are off.
fn solve_planted<T: Scalar>(what: &str, a: &impl Rows<T>, b: &impl Rows<T>, width: usize) -> f64 {
    let (z, r, q) = planted(a, b, width);
    let (mut solver, start) = (solver(a, b), vec![T::one(); z.len()]);
    let options = Options::from_x(&start).limits(Limits::relative(1e-13));
    let outcome = solver.solve(&q, options).unwrap();
    assert!(outcome.converged(), "{what}: {outcome}");
    let inner = outcome.linear_iterations.unwrap();
    assert!(outcome.iterations <= 25 && inner <= 250, "{what}: {outcome}, {inner}");
    let off = |found: &[T], planted: &[T]| {
        let largest = |max: f64, v: f64| max.max(v);
        found.iter().zip(planted).map(|(&f, &p)| (f - p).abs().to_f64().unwrap()).fold(0.0, largest)
    };
    off(solver.z(), &z).max(off(solver.r(), &r))
}

fn solves_planted<T: Scalar>() -> f64 {
    let mut worst = 0.0_f64;
    for wind in [1.0, -0.7] {
        let [a, b] = film::<T>(60, wind);
        worst = worst.max(solve_planted("film", &a, &b, 60));
        // The roles exchanged: B conducts and A carries.
        worst = worst.max(solve_planted("film exchanged", &b, &a, 60));
    }
    let a = boxes::<T>(14);
    worst.max(solve_planted("box", &a, &Identity { order: 14 * 14 * 14 }, 14))
}

/// Errors are residuals times an inverse: of 1e-13 ‖q‖ < 1e-8 and norms below 100 here, whatever
/// the family.
#[test]
fn planted_solutions_are_found_in_double_precision() {
    let worst = solves_planted::<f64>();
    assert!(worst < 1e-6, "{worst}");
}

/// As above, with residuals of some thousand roundings of 6e-8.
#[test]
fn planted_solutions_are_found_in_single_precision() {
    let worst = solves_planted::<f32>();
    assert!(worst < 0.3, "{worst}");
}

#[test]
fn newton_takes_fewer_linear_iterations_with_it_than_with_sweeps() {
    let [a, b] = film::<f64>(60, 1.0);
    let (_, _, q) = planted(&a, &b, 60);
    let problem = Hlcp::from_pair(&a, &b).unwrap();
    let base = || Mms::new(problem.clone(), Aor::gauss_seidel()).unwrap();
    let mut with = Solver::new(Newton::new(base(), Amg::new(&problem).unwrap()));
    let mut without = Solver::new(Newton::new(base(), Ssor));
    let start = vec![1.0; 3600];
    let with = with.solve(&q, from_one(&start)).unwrap();
    let without = without.solve(&q, from_one(&start)).unwrap();
    assert!(with.converged() && without.converged());
    let [with, without] = [with, without].map(|outcome| outcome.linear_iterations);
    assert!(2 * with.unwrap() < without.unwrap(), "{with:?} {without:?}");
}

#[test]
fn another_omega_or_gamma_changes_nothing_but_rounding() {
    let [a, b] = film::<f64>(50, 1.0);
    let (_, _, q) = planted(&a, &b, 50);
    let outcomes = [(1.0, 1.0), (1e3, 1.0), (1e-3, 7.0)].map(|(tau, gamma)| {
        let omega = Omega::diagonal_ratio(tau, &a, &b).unwrap();
        let problem = Hlcp::new(&a, &b, omega).unwrap().with_gamma(gamma).unwrap();
        let base = Mms::new(problem, Aor::gauss_seidel()).unwrap();
        let mut solver = Solver::new(AmgNewton::new(base).unwrap());
        let outcome = solver.solve(&q, Limits::absolute(1e-10)).unwrap();
        assert!(outcome.converged());
        (outcome.iterations, outcome.linear_iterations)
    });
    assert_eq!(outcomes, [outcomes[0]; 3]);
}

#[test]
fn what_has_no_pivots_or_is_not_finite_is_refused() {
    let refused = |a: DMatrix<f64>| {
        let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(1.0)).unwrap();
        Amg::new(&problem).unwrap_err().to_string()
    };
    let zero = refused(dmatrix![1.0, 0.0; 1.0, 0.0]);
    assert_eq!(
        zero,
        "diagonal of A[1] is 0, but it must be positive and finite; AUTO and PIVOTING need no such \
         pivots"
    );
    assert!(refused(dmatrix![0.0, 0.0; 0.0, 1.0]).starts_with("diagonal of A[0] is 0"));
    let nan = refused(dmatrix![1.0, 0.0; f64::NAN, 2.0]);
    assert_eq!(nan, "row of A[1] is NaN, which is not a finite number");
}

/// A conductor without an end has no inverse: with z everywhere, J is singular on every level.
#[test]
fn singular_rows_end_without_an_answer() {
    let couplings: Vec<_> =
        (0..400).flat_map(|k| [(k, (k + 1) % 400, 1.0), ((k + 1) % 400, k, 1.0)]).collect();
    let a = listed::<f64>(400, &couplings, 0.0);
    let b = Identity { order: 400 };
    let mut solver = solver(&a, &b);
    // What flows in has no way out, and r only takes in.
    let limits = Limits { iterations: 30, ..Limits::absolute(1e-10) };
    let outcome = solver.solve(&[-1.0; 400], Options::from_x(&[1.0; 400]).limits(limits)).unwrap();
    assert!(!outcome.converged(), "{outcome}");
    // With as much drawn as fed there are answers, up to a constant.
    let q: Vec<f64> = (0..400).map(|k| (std::f64::consts::TAU * k as f64 / 400.0).sin()).collect();
    // z is of the size of (400/2π)², and rounding leaves 3e-11 of q.
    let options = Options::from_x(&[1.0; 400]).limits(Limits::relative(1e-9));
    let outcome = solver.solve(&q, options).unwrap();
    assert!(outcome.converged(), "{outcome}");
}

/// Every J here is diagonal: no unknown is joined to another, and a thousand are too many for
/// elimination.
#[test]
fn rows_that_do_not_hang_together_are_no_obstacle() {
    let a = listed::<f64>(1000, &[], 2.0);
    let b = Identity { order: 1000 };
    let q: Vec<f64> = (0..1000).map(noise).collect();
    let mut solver = solver(&a, &b);
    let outcome = solver.solve(&q, from_one(&[1.0; 1000])).unwrap();
    assert!(outcome.converged() && outcome.iterations <= 1, "{outcome}");
}

/// z₁ − z₂ ≥ 1 and z₂ − z₁ ≥ 1 have no solution: phases end one after the other, and the base has
/// its turns.
#[test]
fn the_base_has_its_turns_where_no_step_helps() {
    let a = dmatrix![1.0, -1.0; -1.0, 1.0];
    let b = Identity { order: 2 };
    let mut solver = solver(&a, &b);
    let limits = Limits { iterations: 60, ..Limits::absolute(1e-10) };
    let options = Options::from_x(&[1.0, 1.0]).limits(limits);
    let outcome = solver.solve(&[-1.0, -1.0], options).unwrap();
    assert!(!outcome.converged(), "{outcome}");
    assert!(solver.method().base_iterations >= 2 + 4, "{}", solver.method().base_iterations);
}

/// What all rows sum to stays as it is where no constant conducts: the first system is solved, the
/// second is not.
#[test]
fn a_system_that_is_not_solved_shows_its_rate_also_after_others() {
    let m = 30;
    let a = FivePoint::from_fn(m, m, |i, j| {
        let [s, w, e, n] = [j > 0, i > 0, i + 1 < m, j + 1 < m].map(f64::from);
        [-s, -w, s + w + e + n, -e, -n]
    });
    let problem = Hlcp::lcp(a.unwrap()).unwrap();
    let mut amg = AmgNewton::new(Mms::new(problem, Aor::gauss_seidel()).unwrap()).unwrap();
    let (x, mut y) = (vec![1.0; m * m], vec![0.0; m * m]);
    let mut step = |shift: f64| {
        let q: Vec<f64> = (0..m * m).map(|k| shift + [0.01, -0.01][k / m % 2]).collect();
        let mut clock = Clock::endless();
        clock.granted = 0;
        let _ = amg.step(&Rhs::new(&q).unwrap(), &x, &mut y, &mut clock);
        amg.rate()
    };
    assert_eq!(step(0.0), f64::INFINITY);
    let rate = step(-0.1);
    assert!(rate > 0.0 && rate < 0.1, "{rate}");
}

/// Counts from the start on a coarser problem to the end of the last linear solve of a step.
#[test]
fn a_step_ends_with_the_time() {
    let m = 130;
    let [a, b] = film::<f64>(m, 1.0);
    let (_, _, q) = planted(&a, &b, m);
    let q = Rhs::new(&q).unwrap();
    let problem = Hlcp::from_pair(&a, &b).unwrap();
    let mut amg = AmgNewton::new(Mms::new(problem, Aor::gauss_seidel()).unwrap()).unwrap();
    let (x, mut y) = (vec![1.0; m * m], vec![0.0; m * m]);
    // The first set-up finds the order along the flow, and asks on its way.
    for late in 0..60 {
        let cut = asked(late, |clock| amg.clone().step(&q, &x, &mut y, clock));
        assert_eq!(cut.1, late + 1);
    }
    let _ = amg.step(&q, &x, &mut y, &mut Clock::endless());
    let mut step = |late| {
        amg.restart();
        let (norms, asked) = asked(late, |clock| amg.step(&q, &x, &mut y, clock));
        (norms, asked, amg.work().unwrap().sweeps)
    };
    let all = step(usize::MAX);
    let (expected, whole, walks) = all;
    // Every walk over a matrix that is long is asked for, and most are at their 16,384th row.
    assert!(whole > 2 * walks, "{whole} of {walks}");
    for late in (0..whole).step_by(7) {
        let (norms, asked, _) = step(late);
        assert_eq!((norms, asked), (expected, late + 1), "asked until the time is up, and no more");
    }
    // What was cut short leaves no trace.
    assert_eq!(step(usize::MAX), all);
}
