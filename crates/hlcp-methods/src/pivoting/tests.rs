//! Circles of active sets, columns that are singular, free unknowns, and the time that is left.

#[cfg(feature = "direct")]
use std::{collections::BTreeMap, time::Duration};

#[cfg(feature = "direct")]
use hlcp_core::{Csr, LinearOperator};
use hlcp_core::{Identity, Omega, RowMajor, Tridiagonal};
use nalgebra::{DMatrix, DVector, dmatrix};
use proptest::{collection::vec, prelude::*, strategy::ValueTree, test_runner::TestRunner};

use super::*;
use crate::{DynRows, Limits, Options, Solver, Status, testing::csr};

/// Returns the method on operators behind `dyn`, for which it is compiled once.
fn pivoting<'a>(
    posed: Result<Hlcp<f64, DynRows<'a, f64>, DynRows<'a, f64>>, Error>,
) -> Solver<f64, Pivoting<f64, DynRows<'a, f64>, DynRows<'a, f64>>> {
    Solver::new(Pivoting::new(posed.unwrap()).unwrap())
}

/// Newton's method visits the active sets {1}, {2}, {3}, {1}, … of this P-matrix for ever. The
/// other unknowns are settled, and so large that the start's residual is a small part of q.
#[test]
fn a_circle_of_active_sets_is_left() {
    for n in [4, 400] {
        let entry = |i: usize, j: usize| match (i, j) {
            _ if i == j => 1.0,
            (0, 2) | (1, 0) | (2, 1) => 1.5,
            _ => 0.0,
        };
        let circle: Vec<f64> = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        let circle = RowMajor::new(n, circle).unwrap();
        let one = Identity { order: n };
        let mut solver = pivoting(Hlcp::new(&circle, &one, Omega::Uniform(1.0)));
        let (mut q, mut start) = (vec![-100.0; n], vec![50.0_f64; n]);
        q[..3].fill(-1.0);
        start[..3].copy_from_slice(&[0.5, -0.5, -0.5]);
        let outcome = solver.solve(&q, Options::from_x(&start)).unwrap();
        assert!(outcome.converged() && outcome.iterations <= 9, "{outcome}");
        // z = 0.4 where it went round.
        assert!(solver.z()[..3].iter().all(|z| (z - 0.4).abs() < 1e-15), "{:?}", solver.z());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    /// The columns of A and of some signs are singular but for a diagonal of next to nothing. What
    /// they lead to has no digits, and is not taken.
    #[test]
    fn what_is_skew_but_for_next_to_nothing_does_not_diverge(
        upper in vec((0_usize..60, 0_usize..60, -1.0..1.0), 180),
        planted in sides(60),
        digits in 6..14_i32,
    ) {
        let n = planted.len();
        let mut a = DMatrix::from_diagonal_element(n, n, 10.0_f64.powi(-digits));
        for (i, j, entry) in upper.into_iter().filter(|(i, j, _)| i != j) {
            a[(i, j)] += entry;
            a[(j, i)] -= entry;
        }
        let q = load(&a, &DMatrix::identity(n, n), &planted);
        let one = Identity { order: n };
        let mut solver = pivoting(Hlcp::from_pair(&a, &one));
        let limits = Limits { iterations: 200, ..Limits::default() };
        let outcome = solver.solve(q.as_slice(), limits).unwrap();
        prop_assert!(!matches!(outcome.status, Status::Diverged(_)), "{outcome}");
    }

    /// Skew parts that outweigh the rest send Newton's method round, and the way through the
    /// interior ends that within some tens of steps and changes of signs, whatever rows, z and r
    /// are multiplied by, and whichever of the two is z.
    #[test]
    fn steps_inside_depend_on_no_units(
        skew in vec(-1.0..1.0_f64, 60 * 60),
        q in vec(-1.0..1.0_f64, 60),
        powers in [(); 3].map(|()| vec(-3..=3_i32, 60)),
        (swap, digits) in (any::<bool>(), 1.0..4.0_f64),
    ) {
        let (n, share) = (q.len(), 10_f64.powf(-digits));
        let [of_row, of_z, of_r] = powers.map(|powers| -> Vec<f64> {
            powers.into_iter().map(|power| 10_f64.powi(power)).collect()
        });
        let entry = |i: usize, j: usize| skew[i * n + j] - skew[j * n + i];
        let a = |i: usize, j: usize| {
            of_row[i] * of_z[j] * if i == j { share } else { entry(i, j) }
        };
        let b = |i: usize, j: usize| if i == j { of_row[i] * of_r[j] } else { 0.0 };
        let [a, b]: [RowMajor<f64>; 2] = [&a as &dyn Fn(usize, usize) -> f64, &b].map(|of| {
            RowMajor::new(n, (0..n * n).map(|k| of(k / n, k % n)).collect::<Vec<_>>()).unwrap()
        });
        let load = |sign: f64| (0..n).map(|i| sign * of_row[i] * q[i]).collect::<Vec<_>>();
        let iterations = |a: DynRows<f64>, b: DynRows<f64>, q: &[f64]| {
            let mut solver = pivoting(Hlcp::from_pair(a, b));
            let outcome = solver.solve(q, Limits::default()).unwrap();
            (outcome.converged(), outcome.iterations)
        };
        let found =
            if swap { iterations(&b, &a, &load(-1.0)) } else { iterations(&a, &b, &load(1.0)) };
        prop_assert!(found.0 && found.1 <= 60, "{found:?}");
    }
}

/// So many numbers, of which four fifths are zero.
fn sparse(count: usize) -> impl Strategy<Value = Vec<f64>> {
    vec(prop_oneof![4 => Just(0.0), 1 => -1.0..1.0_f64], count)
}

/// Sides and sizes of a solution.
fn sides(count: usize) -> impl Strategy<Value = Vec<(bool, f64)>> {
    vec((any::<bool>(), 0.1..1.0_f64), count)
}

/// `q` of the solution that is planted.
fn load(a: &DMatrix<f64>, b: &DMatrix<f64>, planted: &[(bool, f64)]) -> DVector<f64> {
    let of = |side: bool| {
        let of = |&(is_z, size): &(bool, f64)| if is_z == side { size } else { 0.0 };
        DVector::from_iterator(planted.len(), planted.iter().map(of))
    };
    b * of(false) - a * of(true)
}

/// Asserts that elimination solves all but a fifteenth of the problems that are drawn: of 720, six
/// were lost to rounding, and of 1000 with networks one.
fn nearly_all_are_solved<S: Strategy>(
    count: usize,
    drawn: S,
    pose: impl Fn(S::Value) -> (DMatrix<f64>, DMatrix<f64>, DVector<f64>),
) {
    let mut runner = TestRunner::default();
    let is_solved = |_: &usize| {
        let (a, b, q) = pose(drawn.new_tree(&mut runner).unwrap().current());
        let sparse =
            |a: &DMatrix<f64>| csr(a.row_iter().map(|row| row.into_iter().copied().enumerate()));
        let [a, b] = [&a, &b].map(sparse);
        let mut solver = pivoting(Hlcp::from_pair(&a, &b));
        let outcome = solver.solve(q.as_slice(), Limits::default()).unwrap();
        outcome.converged() && outcome.iterations <= 200
    };
    let solved = (0..count).filter(is_solved).count();
    assert!(15 * (count - solved) <= count, "{solved} of {count}");
}

/// Minimises xᵀHx/2 + cᵀx with x ≥ 0, of H = FFᵀ with few columns or none (a linear program),
/// under constraints whose slack or multiplier is planted; the first ones are equations, with free
/// multipliers. Diagonals have zeros, those of the equations both.
#[test]
fn programs_with_constraints_are_solved() {
    let (n, size) = (40, 70);
    let shape = (0..20_usize, 0..5_usize, vec(-3..=3_i32, size));
    let drawn = (shape, sparse(n * 20), sparse((size - n) * n), sides(size));
    nearly_all_are_solved(
        120,
        drawn,
        |((columns, equations, powers), factor, constraints, planted)| {
            let factor = DMatrix::from_column_slice(n, columns, &factor[..n * columns]);
            let constraints = DMatrix::from_column_slice(size - n, n, &constraints);
            let mut a = DMatrix::zeros(size, size);
            a.view_mut((0, 0), (n, n)).copy_from(&(&factor * factor.transpose()));
            a.view_mut((0, n), (n, size - n)).copy_from(&-constraints.transpose());
            a.view_mut((n, 0), (size - n, n)).copy_from(&constraints);
            let mut b = DMatrix::identity(size, size);
            for j in n..n + equations {
                b.set_column(j, &a.column(j));
            }
            let unit = DVector::from_iterator(size, powers.iter().map(|&power| 10_f64.powi(power)));
            let q = load(&a, &b, &planted).component_mul(&unit);
            let unit = DMatrix::from_diagonal(&unit);
            (&unit * a, unit * b, q)
        },
    );
}

/// GGᵀ with few columns, and a skew part: solutions are many, all columns singular.
#[test]
fn one_of_many_solutions_is_found() {
    let n = 60;
    let drawn = (1..20_usize, sparse(n * 20), 0..2_u8, sparse(n * n), sides(n));
    nearly_all_are_solved(120, drawn, |(columns, factor, skew, part, planted)| {
        let factor = DMatrix::from_column_slice(n, columns, &factor[..n * columns]);
        let part = f64::from(skew) * DMatrix::from_column_slice(n, n, &part);
        let a = &factor * factor.transpose() + &part - part.transpose();
        let b = DMatrix::identity(n, n);
        let q = load(&a, &b, &planted);
        (a, b, q)
    });
}

/// Flows through a network whose costs are squares, of some arcs none, with an equation for each
/// node: one says nothing new, and the first node has no arcs. Where arcs are few, no flow can
/// cross some cuts, and potentials have no bound. Beyond the order at which full factors are
/// taken, whose rounding may help.
#[test]
#[cfg(feature = "direct")]
fn equations_may_depend_on_each_other() {
    let ends = vec((1..200_usize, 1..199_usize), 310..400);
    let costs = vec(prop_oneof![1 => Just(0.0), 2 => 0.1..2.0_f64], 400);
    nearly_all_are_solved(30, (ends, costs, sides(600)), |(ends, costs, planted)| {
        let (arcs, n) = (ends.len(), ends.len() + 200);
        let mut a = DMatrix::zeros(n, n);
        for (k, ((from, by), cost)) in ends.into_iter().zip(costs).enumerate() {
            a[(k, k)] = cost;
            for (node, way) in [(from, 1.0), ((from + by - 1) % 199 + 1, -1.0)] {
                (a[(arcs + node, k)], a[(k, arcs + node)]) = (way, -way);
            }
        }
        let mut b = DMatrix::identity(n, n);
        for j in arcs..n {
            b.set_column(j, &a.column(j));
        }
        let q = load(&a, &b, &planted[..n]);
        (a, b, q)
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10))]

    /// A grid of pipes with check valves, whose nodes leak a little: flows z and closing heads
    /// r, and heads of any sign, by columns that are the same in A and B but for a factor. It takes
    /// some forty steps; some fifty with signs to be found for the heads, too.
    #[test]
    #[cfg(feature = "direct")]
    fn free_unknowns_are_solved_for_beside_the_others(
        pipes in vec((any::<bool>(), -1.0..1.0_f64), 1104),
        (of_z, of_r, omega) in
            (vec(-3..4_i32, 1680), vec(-3..4_i32, 1680), vec(0.2..5.0_f64, 1680)),
        (along, across, phase) in (2.0..8.0_f64, 2.0..8.0_f64, 0.0..6.0_f64),
    ) {
        let (m, leak) = (24, 1e-4);
        let (first, n) = (pipes.len(), pipes.len() + m * m);
        let right = (0..m * m).filter(|k| k % m + 1 < m).map(|k| [k, k + 1]);
        let ends = right.chain((0..m * m - m).map(|k| [k, k + m]));
        let mut rows = vec![BTreeMap::new(); n];
        for (k, ([from, to], &(turned, resistance))) in ends.zip(&pipes).enumerate() {
            let sign = if turned { -1.0 } else { 1.0 };
            rows[k].extend([(k, 10_f64.powf(resistance)), (first + from, -sign)]);
            rows[k].insert(first + to, sign);
            rows[first + from].insert(k, sign);
            rows[first + to].insert(k, -sign);
        }
        for (i, row) in rows.iter_mut().enumerate().skip(first) {
            row.insert(i, leak);
        }
        let scaled = |entry: &dyn Fn(usize, usize, f64) -> f64| {
            let row = |(i, row): (usize, &BTreeMap<usize, f64>)| {
                row.iter().map(|(&j, &a)| (j, entry(i, j, a))).collect::<Vec<_>>()
            };
            csr::<f64, _>(rows.iter().enumerate().map(row))
        };
        let a = scaled(&|_, j, a| a * 10_f64.powi(of_z[j]));
        let b = scaled(&|i, j, a| {
            10_f64.powi(of_r[j]) * if j >= first { a } else { f64::from(u8::from(i == j)) }
        });
        let load = |k: usize| {
            let (x, y) = ((k % m) as f64 / m as f64, (k / m) as f64 / m as f64);
            (along * x + phase).sin() * (across * y).cos()
        };
        let q: Vec<f64> = (0..n).map(|i| i.checked_sub(first).map_or(0.0, load)).collect();
        let [a, b]: [DynRows<f64>; 2] = [&a, &b];
        let problem = Hlcp::new(a, b, Omega::Each(omega.clone())).unwrap();
        for (j, factor) in free(&problem).into_iter().enumerate() {
            let expected = 10_f64.powi(of_z[j] - of_r[j]) / omega[j];
            let off = if j < first { factor } else { (factor / expected - 1.0).abs() };
            prop_assert!(off <= if j < first { 0.0 } else { 1e-14 }, "{j} {factor} {expected}");
        }
        let mut solver = Solver::new(Pivoting::new(problem).unwrap());
        let outcome = solver.solve(&q, Limits::default()).unwrap();
        // A hundred inside, and as many that change signs.
        prop_assert!(outcome.converged() && outcome.iterations <= 200, "{outcome}");
    }
}

/// −r = 1; x₁ + x₂ ≥ 1 and ≤ −0.5; the least −x.
#[test]
fn programs_without_a_solution_come_to_an_end() {
    let infeasible = dmatrix![
        1.0, 0.0, -1.0, 1.0; 0.0, 1.0, -1.0, 1.0; 1.0, 1.0, 0.0, 0.0; -1.0, -1.0, 0.0, 0.0
    ];
    for (a, q) in [
        (dmatrix![0.0], vec![-1.0]),
        (infeasible, vec![0.0, 0.0, -1.0, -0.5]),
        (dmatrix![0.0, -1.0; 1.0, 0.0], vec![-1.0, 1.0]),
    ] {
        let one = Identity { order: q.len() };
        let mut solver = pivoting(Hlcp::from_pair(&a, &one));
        let outcome = solver.solve(&q, Limits::default()).unwrap();
        // 400 times fifty steps of paths are in it.
        assert!(outcome.status == Status::Stagnated && outcome.iterations < 480, "{outcome}");
    }
}

/// Both columns of a singular B, whose residual is a thirtieth of q, have no factors; those of
/// A lead to z = (0, 0.05), r = (0.95, 0).
#[test]
fn singular_columns_of_the_start_are_left_for_the_others() {
    let a = RowMajor::new(2, vec![2.0, -1.0, -1.0, 2.0]).unwrap();
    let b = RowMajor::new(2, vec![1.0, -1.0, -1.0, 1.0]).unwrap();
    let mut solver = pivoting(Hlcp::new(&a, &b, Omega::Uniform(1.0)));
    let start = Options::from_solution(&[0.0, 0.0], &[2.0_f64, 1.0]);
    let outcome = solver.solve(&[1.0, -1.05], start).unwrap();
    assert!(outcome.converged() && outcome.iterations <= 4, "{outcome}");
    assert!((solver.z()[1] - 0.05).abs() + (solver.r()[0] - 0.95).abs() < 1e-14);
}

/// The matrix is symmetric, but a bond outweighs its ends: no factors without pivots.
#[test]
#[cfg(feature = "direct")]
fn a_symmetric_matrix_that_is_not_definite_is_solved() {
    let n = 900;
    let diagonal = |i: usize| 1.0 + 0.1 * (i % 7) as f64;
    let a = Tridiagonal::new(n, |i| [3.0, diagonal(i), 3.0]).unwrap();
    let z = |i: usize| 1.0 + (i % 5) as f64;
    let beside =
        |i: usize| i.checked_sub(1).map_or(0.0, z) + if i + 1 < n { z(i + 1) } else { 0.0 };
    let q: Vec<f64> = (0..n).map(|i| -diagonal(i) * z(i) - 3.0 * beside(i)).collect();
    let one = Identity { order: n };
    let mut solver = pivoting(Hlcp::new(&a, &one, Omega::Uniform(1.0)));
    let outcome = solver.solve(&q, Limits::default()).unwrap();
    assert!(outcome.converged() && outcome.iterations <= 3, "{outcome}");
    assert!((0..n).all(|i| (solver.z()[i] - z(i)).abs() < 1e-9));
}

/// Five entries to a row, anywhere in 8000, leave a full matrix of thousands.
#[test]
#[cfg(feature = "direct")]
fn an_elimination_that_would_outlast_the_limit_is_not_begun() {
    let n = 8000;
    let row = |i: usize| {
        let beside = [31 * i + 7, 173 * i + 11, 1009 * i + 5, i * i / 3].map(|j| (j % n, -0.5));
        BTreeMap::from_iter(beside.into_iter().chain([(i, 4.0)]))
    };
    let a = csr::<f64, _>((0..n).map(row));
    let one = Identity { order: n };
    let mut solver = pivoting(Hlcp::new(&a, &one, Omega::Uniform(1.0)));
    let limits = Limits { time: Some(Duration::from_secs(1)), ..Limits::default() };
    let outcome = solver.solve(&[-1.0; 8000], limits).unwrap();
    assert_eq!((outcome.status, outcome.sweeps), (Status::TimeLimit, 0));
    let forgone = outcome.forgone.unwrap();
    assert!(forgone.seconds > forgone.left.as_secs_f64() && forgone.bytes > 1e6, "{forgone:?}");
    assert!(outcome.to_string().contains("an elimination was not begun"), "{outcome}");
    let short = crate::Forecast { seconds: 3.1e-3, bytes: 4e5, left: Duration::from_millis(2) };
    let told = "takes about 3.1e-3 s and 0.4 MB, and the time limit left 2.0e-3 s";
    assert!(short.to_string().ends_with(told), "{short}");
}

/// The signs of a strip under load are right after a few eliminations, from any start.
#[test]
fn a_strip_takes_a_few_eliminations() {
    let a = Tridiagonal::new(60, |_| [-1.0, 2.5, -1.0]).unwrap();
    let b = Tridiagonal::new(60, |_| [-1.0, 1.5, 0.0]).unwrap();
    let q: Vec<f64> = (0..60).map(|i| (0.2 * i as f64).sin()).collect();
    let mut solver = pivoting(Hlcp::new(&a, &b, Omega::Uniform(2.0)));
    for start in [1.0, -1.0] {
        let from = [start; 60];
        let outcome = solver.solve(&q, Options::from_x(&from)).unwrap();
        assert!(outcome.converged() && outcome.iterations <= 8, "{outcome}");
    }
}

/// The best of two ways to run a plant, min(K v − f, v − (v of the other way) − c) = 0 with v free,
/// with diffusion of two sizes and a drift on one way, as (A, B) and q: all columns of A, which
/// couples as much as B, are singular.
#[cfg(feature = "direct")]
fn switching(
    m: usize,
    (spread, along, cost): ([f64; 2], f64, f64),
) -> ([Csr<'static, f64>; 2], Vec<f64>) {
    let n = 2 * m;
    let matrices = [true, false].map(|is_a| {
        let mut rows = vec![BTreeMap::new(); 2 * n];
        for i in 0..n {
            let step = spread[i / m] * (m * m) as f64;
            let carried = if i < m { 0.0 } else { m as f64 };
            rows[i].insert(i, 2.0 * step + carried + 0.1);
            if i % m > 0 {
                rows[i].insert(i - 1, -step - carried);
                rows[i - 1].insert(i, -step);
            }
            rows[n + i].extend([(i, 1.0), ((i + m) % n, -1.0)]);
            if is_a {
                rows[i].insert(n + i, -1.0);
            } else {
                rows[n + i].insert(n + i, 1.0);
            }
        }
        csr(rows)
    });
    let wave = |i: usize| f64::cos(along * i as f64 / m as f64);
    (matrices, (0..2 * n).map(|i| if i < n { wave(i) } else { cost }).collect())
}

/// A net of cables that bear no pressure, (K u + Dᵀ E z, D u − z + r) = (f, g) with the elongations
/// z − r and any u, whose k-th is counted down where `down` is true of it.
#[cfg(feature = "direct")]
fn net(m: usize, (stiffness, soft, down): (&[f64], f64, &[bool])) -> [Csr<'static, f64>; 2] {
    let points = m * m;
    let right = (0..points).filter(|k| k % m + 1 < m).map(|k| [k, k + 1]);
    let up = (0..points - m).map(|k| [k, k + m]);
    let across = (0..points - m).filter(|k| k % m + 1 < m).map(|k| [k, k + m + 1]);
    let cables: Vec<_> = right.chain(up).chain(across).collect();
    let sign = |k: usize| if down[k % down.len()] { -1.0 } else { 1.0 };
    [true, false].map(|is_a| {
        let mut rows = vec![BTreeMap::new(); points + cables.len()];
        (0..points).for_each(|k| rows[k].extend([(k, soft)]));
        for (c, &[from, to]) in cables.iter().enumerate() {
            let stiff = 10_f64.powf(stiffness[c % stiffness.len()]);
            for (end, side) in [(from, -1.0), (to, 1.0)] {
                if is_a {
                    rows[end].insert(points + c, side * sign(end) * stiff);
                }
                rows[points + c].insert(end, -side * sign(end));
            }
            rows[points + c].insert(points + c, 1.0);
        }
        csr(rows)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5))]

    #[test]
    #[cfg(feature = "direct")]
    fn columns_of_the_other_operator_serve_where_those_of_one_are_singular(
        m in 500_usize..800,
        sizes in (-2.5..-1.5_f64, -2.5..-1.5_f64),
        along in 3.0..30.0_f64,
    ) {
        let spread = [sizes.0, sizes.1].map(|size| 10_f64.powf(size));
        let ([a, b], q) = switching(m, (spread, along, 1e-4));
        let exchanged: Vec<f64> = q.iter().map(|q| -q).collect();
        for (a, b, q) in [(&a, &b, &q), (&b, &a, &exchanged)] {
            let outcome = pivoting(Hlcp::from_pair(a, b)).solve(q, Limits::default()).unwrap();
            // Of 500 all but four took 50 or fewer, those up to 172; without the other columns it
            // is thousands, if it ends.
            prop_assert!(outcome.converged() && outcome.iterations <= 500, "{outcome}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]

    /// The signs of what is free decide nothing: every number of a step is the same but for them,
    /// and for rounding, which decides of nets that are stiffer and softer.
    #[test]
    #[cfg(feature = "direct")]
    fn free_unknowns_may_be_counted_the_other_way_round(
        m in 5_usize..20,
        stiffness in vec(3.0..5.0_f64, 97),
        soft in -4..-1_i32,
        down in vec(any::<bool>(), 89),
        load in vec(-1.0..1.0_f64, 83),
    ) {
        let counts = [&vec![false], &down].map(|down| {
            let [a, b] = net(m, (&stiffness, 10_f64.powi(soft), down));
            let turned = |k: usize| if k < m * m && down[k % down.len()] { -1.0 } else { 1.0 };
            let size = |k: usize| if k < m * m { 1e6 } else { 1e-6 };
            let q: Vec<f64> =
                (0..a.order()).map(|k| turned(k) * size(k) * load[k % load.len()]).collect();
            let outcome = pivoting(Hlcp::from_pair(&a, &b)).solve(&q, Limits::default()).unwrap();
            (outcome.converged(), outcome.iterations)
        });
        prop_assert!(counts[0] == counts[1] && counts[0].0, "{counts:?}");
    }
}

/// The cheapest transport from m places to m others, of costs c that each takes in turn, as a
/// linear program: (−Gᵀλ − r + c, G x − s) with x ≥ 0; if `is_equal`, G x = s and any λ.
#[cfg(feature = "direct")]
fn transport(
    (costs, sizes): (&[f64], &[f64]),
    is_equal: bool,
) -> ([Csr<'static, f64>; 2], Vec<f64>) {
    let m = sizes.len();
    let n = m * m + 2 * m;
    let mut rows = [(); 2].map(|()| vec![BTreeMap::new(); n]);
    for k in 0..m * m {
        // What leaves is at most the supply, and what arrives at least the demand.
        let leaves = if is_equal { 1.0 } else { -1.0 };
        for (end, sign) in [(m * m + k / m, leaves), (m * m + m + k % m, 1.0)] {
            rows[0][end].insert(k, sign);
            rows[0][k].insert(end, -sign);
            if is_equal {
                rows[1][k].insert(end, -sign);
            }
        }
        rows[1][k].insert(k, 1.0);
    }
    if !is_equal {
        (m * m..n).for_each(|k| {
            rows[1][k].insert(k, 1.0);
        });
    }
    let q = (0..n).map(|k| match k.checked_sub(m * m) {
        None => costs[k % costs.len()],
        Some(end) if end < m && !is_equal => sizes[end],
        Some(end) => -sizes[end % m],
    });
    let q = q.collect();
    (rows.map(csr), q)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// What all places send is what all take: nothing lies inside, and the last pivots of the
    /// interior are rounding.
    #[test]
    #[cfg(feature = "direct")]
    fn programs_without_an_inside_are_solved(
        costs in vec((1..10_i32).prop_map(f64::from), 997),
        sizes in vec((1..10_i32).prop_map(f64::from), 35..45),
    ) {
        let ([a, b], q) = transport((&costs, &sizes), false);
        let outcome = pivoting(Hlcp::from_pair(&a, &b)).solve(&q, Limits::default()).unwrap();
        prop_assert!(outcome.converged() && outcome.iterations <= 100, "{outcome}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// An iterate stays as it is while columns lead nowhere, but ways are left then, and what
    /// elimination solves alone it solves in turns.
    #[test]
    #[cfg(feature = "direct")]
    fn auto_goes_all_ways_of_elimination(costs in vec(0.0..1.0_f64, 4)) {
        let ([a, b], q) = transport((&costs, &[1.0; 2]), true);
        let problem = Hlcp::<f64, DynRows<'_, f64>, DynRows<'_, f64>>::from_pair(&a, &b).unwrap();
        let auto = Solver::new(crate::Auto::new(problem).unwrap()).solve(&q, Limits::default());
        let alone = pivoting(Hlcp::from_pair(&a, &b)).solve(&q, Limits::default()).unwrap();
        let auto = auto.unwrap();
        prop_assert!(auto.converged() || !alone.converged(), "{auto} but {alone}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]

    /// The cheapest generation in a ring of nodes with chords, with least and largest flows in its
    /// lines, by phases that are free and of any unit, though no units give all rows one sum.
    #[test]
    fn free_unknowns_may_have_any_unit(
        nodes in 30_usize..60,
        costs in vec(5.0..50.0_f64, 59),
        demand in vec(20.0..150.0_f64, 53),
        conducts in vec(1e3..1e4_f64, 47),
        limit in 20.0..100.0_f64,
        unit in -3..4_i32,
    ) {
        let near = (0..nodes).map(|k| [k, (k + 1) % nodes]);
        let far = (0..nodes / 3).map(|k| [k, (k + nodes / 2) % nodes]);
        let lines: Vec<[usize; 2]> = near.chain(far).collect();
        let [phases, caps] = [nodes, 2 * nodes - 1];
        let [balance, least, most] = [caps + nodes, caps + 2 * nodes, caps + 2 * nodes + lines.len()];
        let n = most + lines.len();
        let mut a = DMatrix::zeros(n, n);
        let mut q = vec![0.0; n];
        for k in 0..nodes {
            (q[k], a[(k, k)]) = (costs[k % costs.len()], 0.02);
            (a[(caps + k, k)], q[caps + k]) = (-1.0, 200.0);
            (a[(balance + k, k)], q[balance + k]) = (1.0, -demand[k % demand.len()]);
        }
        for (line, ends) in lines.iter().enumerate() {
            let part = conducts[line % conducts.len()] * 10_f64.powi(unit);
            // The first node's phase is zero.
            for (&end, sign) in ends.iter().zip([1.0, -1.0]).filter(|end| *end.0 > 0) {
                let phase = phases + end - 1;
                a[(least + line, phase)] = sign * part;
                a[(most + line, phase)] = -sign * part;
                a[(balance + ends[0], phase)] -= sign * part;
                a[(balance + ends[1], phase)] += sign * part;
            }
            (q[least + line], q[most + line]) = (limit, limit);
        }
        let constraints = a.rows(caps, n - caps).columns(0, caps).transpose();
        a.view_mut((0, caps), constraints.shape()).copy_from(&-&constraints);
        let mut b = DMatrix::identity(n, n);
        for free in (phases..caps).chain(balance..least) {
            b.set_column(free, &a.column(free));
        }
        let limits = Limits { rounding: Some(16.0), ..Limits::default() };
        let outcome = pivoting(Hlcp::from_pair(&a, &b)).solve(&q, limits).unwrap();
        prop_assert!(outcome.converged() && outcome.iterations <= 100, "{outcome}");
    }
}
