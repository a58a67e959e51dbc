use std::collections::BTreeMap;

use hlcp_core::{Csr, FivePoint, Identity, LinearOperator, Omega, Varying};
use nalgebra::{DMatrix, DVector, dmatrix};

use super::{
    coarsen::coarsen,
    matrix::{Lu, NONE},
    *,
};
use crate::testing::{self, csr};

mod newton;

/// Numbers between −1 and 1 without a pattern.
fn noise(k: usize) -> f64 {
    (12.9898 * k as f64 + 0.3).sin() * 0.7 + (78.233 * k as f64).cos() * 0.3
}

/// Runs `work` with a clock that is up when it has been asked more than `late` times; returns what
/// it makes, and how often it asked.
fn asked<R>(late: usize, work: impl FnOnce(&mut Clock<'_>) -> R) -> (R, usize) {
    let mut asked = 0;
    let mut ask = || {
        asked += 1;
        asked > late
    };
    let made = work(&mut Clock::new(&mut ask));
    (made, asked)
}

/// A sparse matrix without symmetry, and the same dense.
fn sparse(n: usize) -> (Matrix<f64>, DMatrix<f64>) {
    let mut dense = DMatrix::zeros(n, n);
    for i in 0..n {
        for e in 1..4 {
            dense[(i, (i * e * e + 7 * e) % n)] = noise(31 * i + e);
        }
        dense[(i, i)] = 4.0 + noise(i);
    }
    (rows_of(&dense), dense)
}

fn rows_of(dense: &DMatrix<f64>) -> Matrix<f64> {
    let n = dense.nrows();
    let rows = Matrix::by_rows([n, 4 * n], &mut Clock::endless(), |i, row| {
        let entries = (0..n as u32).map(|j| (j, dense[(i, j as usize)]));
        row.extend(entries.filter(|e| e.1 != 0.0));
    });
    rows.unwrap()
}

#[test]
fn aggregated_entries_are_the_galerkin_product() {
    let (matrix, dense) = sparse(40);
    let aggregate: Vec<u32> =
        (0..40).map(|i| if i % 9 == 4 { NONE } else { (i * 7 % 11) as u32 }).collect();
    let p = DMatrix::from_fn(40, 11, |i, a| f64::from(u8::from(aggregate[i] == a as u32)));
    let expected = p.transpose() * dense * &p;
    let coarse = matrix.aggregated(&aggregate, 11, &mut Clock::endless()).unwrap();
    // Sums of 16 entries of at most 5, in another order.
    assert!((testing::dense(&coarse) - expected).amax() <= 16.0 * 16.0 * 5.0 * f64::EPSILON);
}

/// Row 17 has no pivot, so its unknown stays as it is.
#[test]
fn sweeps_solve_with_the_lower_triangle_and_return_products() {
    let (_, mut dense) = sparse(40);
    dense[(17, 17)] = 0.0;
    let matrix = rows_of(&dense);
    let rhs = DVector::from_fn(40, |i, _| noise(i + 5));
    let swept = |mut y: DVector<f64>| {
        for i in (0..40).filter(|&i| i != 17) {
            y[i] += (rhs[i] - dense.row(i).dot(&y.transpose())) / dense[(i, i)];
        }
        y
    };
    let (mut y, mut product) = (vec![f64::NAN; 40], vec![f64::NAN; 40]);
    let mut residuals = vec![f64::NAN; 40];
    matrix.sweep_from_zero(rhs.as_slice(), &mut y, |i, residual| residuals[i] = residual);
    let expected = swept(DVector::zeros(40));
    // Pivots of at least 3 against three entries of at most 1: errors grow by no more than a small
    // factor.
    let close = |found: &[f64], expected: &DVector<f64>| {
        (DVector::from_column_slice(found) - expected).amax() < 1e3 * f64::EPSILON
    };
    assert!(close(&y, &expected));
    assert!(close(&residuals, &(&rhs - &dense * &expected)));
    matrix.sweep(rhs.as_slice(), &mut y, &mut product, noise);
    let expected = swept(expected + DVector::from_fn(40, |i, _| noise(i)));
    assert!(close(&y, &expected) && close(&product, &(dense * expected)));
}

#[test]
fn the_transpose_and_what_is_across_the_diagonal_are_those_of_the_matrix() {
    let (matrix, dense) = sparse(40);
    let clock = &mut Clock::endless();
    let transpose = matrix.transpose(clock).unwrap();
    assert_eq!(testing::dense(&transpose), dense.transpose());
    let across = matrix.across(&matrix.values, clock).unwrap();
    for i in 0..40 {
        matrix.places(i).for_each(|(at, j)| assert_eq!(across[at], dense[(j, i)], "{i} {j}"));
    }
    // What is left of the diagonal is known to be.
    let rhs = DVector::from_fn(40, |i, _| noise(i));
    let mut y = vec![0.0; 40];
    transpose.sweep_from_zero(rhs.as_slice(), &mut y, |_, _| ());
    let lower = dense.transpose().lower_triangle();
    let expected = lower.solve_lower_triangular(&rhs).unwrap();
    assert!((DVector::from_vec(y) - expected).amax() < 1e3 * f64::EPSILON);
}

/// The matrix of `m × n` cells, conducting `c` through each face between two of them, from which
/// the wind carries `w` east, and that leak `slack` each.
fn windy(m: usize, n: usize, [c, w, slack]: [f64; 3]) -> DMatrix<f64> {
    let mut dense = DMatrix::from_diagonal_element(m * n, m * n, slack);
    let mut flow = |from: usize, to: usize, g: f64| {
        dense[(from, from)] += g;
        dense[(to, from)] -= g;
    };
    for k in 0..m * n {
        if k % m + 1 < m {
            flow(k, k + 1, c + w);
            flow(k + 1, k, c);
        }
        if k / m + 1 < n {
            flow(k, k + m, c);
            flow(k + m, k, c);
        }
    }
    dense
}

/// Conduction through a face does not depend on how fine the grid is, transport grows as its
/// length. All numbers are sums of eighths, so nothing is rounded.
#[test]
fn a_coarse_level_of_a_grid_is_the_grid_half_as_fine() {
    for [c, w, slack] in [[1.0, 0.0, 0.5], [1.0, 1.5, 0.125], [4.0, 7.0, 0.0], [-0.5, 0.0, 8.0]] {
        let fine = rows_of(&windy(12, 8, [c, w, slack]));
        let clock = &mut Clock::endless();
        let (_, coarse) = match c > 0.0 {
            true => coarsen::coarsen(&fine, |_| false, clock).unwrap(),
            // Couplings that push are not joined; the aggregates are given.
            false => {
                let aggregate: Vec<u32> =
                    (0..96).map(|k| (k % 12 / 2 + k / 24 * 6) as u32).collect();
                let coarse = fine.aggregated(&aggregate, 24, clock).unwrap();
                (aggregate, coarse.halve_conduction(clock).unwrap())
            }
        };
        let expected = windy(6, 4, [c, 2.0 * w, 4.0 * slack]);
        assert_eq!(testing::dense(&coarse), expected, "{c} {w} {slack}");
    }
}

/// Two levels against their definition: a sweep, the coarse system, a sweep. The factors of coarse
/// columns cancel.
#[test]
fn a_cycle_is_a_sweep_a_coarse_solution_and_a_sweep() {
    let [a, _] = film::<f64>(16, 1.0);
    let matrix = Matrix::of(&a, &mut Clock::endless()).unwrap();
    let (aggregate, coarse) =
        coarsen::coarsen(&matrix, |i| i == 77, &mut Clock::endless()).unwrap();
    assert!(coarse.order() <= 100 && aggregate[77] == NONE);
    let p = DMatrix::from_fn(256, coarse.order(), |i, to| {
        f64::from(u8::from(aggregate[i] == to as u32))
    });
    let dense = testing::dense(&matrix);
    let lower = dense.lower_triangle();
    let rhs = DVector::from_fn(256, |i, _| noise(i));
    let mut expected = lower.solve_lower_triangular(&rhs).unwrap();
    let mut galerkin = p.transpose() * &dense * &p;
    for (i, j) in (0..galerkin.nrows()).flat_map(|i| (0..i).map(move |j| (i, j))) {
        // All couplings of a film are negative.
        let half = 0.5 * galerkin[(i, j)].max(galerkin[(j, i)]);
        for (i, j) in [(i, j), (j, i)] {
            galerkin[(i, j)] -= half;
            galerkin[(i, i)] += half;
        }
    }
    let galerkin = galerkin.lu();
    expected += &p * galerkin.solve(&(p.transpose() * (&rhs - &dense * &expected))).unwrap();
    expected += lower.solve_lower_triangular(&(&rhs - &dense * &expected)).unwrap();
    let apart: Vec<bool> = (0..256).map(|i| i == 77).collect();
    let mut hierarchy = Hierarchy::new(matrix, &apart, &mut Clock::endless()).unwrap();
    for cycle in [Cycle::W, Cycle::K] {
        let (mut y, mut product) = (vec![f64::NAN; 256], vec![f64::NAN; 256]);
        hierarchy.cycle(cycle, rhs.as_slice(), &mut y, &mut product, &mut Clock::endless());
        // Conditions are of the order of the number of points.
        let off = (DVector::from_vec(y) - &expected).amax() / expected.amax();
        assert!(off < 256.0 * 100.0 * f64::EPSILON, "{off}");
        let off = (DVector::from_vec(product) - &dense * &expected).amax() / expected.amax();
        assert!(off < 256.0 * 100.0 * 100.0 * f64::EPSILON, "{off}");
    }
}

/// Before both sweeps on a level that is long; and in set-up before each level, and at every
/// 16,384th row as unknowns are paired and the matrix transposed for that.
#[test]
fn a_cycle_asks_before_each_long_sweep() {
    let [a, _] = film::<f64>(140, 1.0);
    let matrix = Matrix::of(&a, &mut Clock::endless()).unwrap();
    let apart = vec![false; 19600];
    let (hierarchy, of_set_up) = asked(usize::MAX, |clock| Hierarchy::new(matrix, &apart, clock));
    let mut hierarchy = hierarchy.unwrap();
    let long: Vec<bool> = hierarchy.orders().map(|order| order >= 1 << 14).collect();
    assert!(long[0] && !long[1], "{long:?}");
    assert_eq!(of_set_up, long.len() + 2);
    let (rhs, mut y, mut product) = (vec![1.0; 19600], vec![0.0; 19600], vec![0.0; 19600]);
    let cycle =
        |clock: &mut Clock<'_>| hierarchy.cycle(Cycle::W, &rhs, &mut y, &mut product, clock);
    assert_eq!(asked(usize::MAX, cycle).1, 2);
}

/// Stars on a string, with up to a hundred rays each: in pairs, each pairing would take some rays
/// from all that are left, and levels would be hardly shorter than those before them.
#[test]
fn the_rays_of_stars_join_their_hubs() {
    let (mut couplings, mut hubs, mut before, mut n) = (vec![], vec![], 0, 0);
    for star in 0..40 {
        let rays = (-30.0 * ((star as f64 + 0.5) / 40.0).ln()) as usize;
        // The hub comes before its rays, after them, or among them.
        let hub = n + star % 3 * rays / 2;
        let ends = (n..=n + rays).filter(|&end| end != hub).map(|end| (end, 2.0));
        couplings.extend(
            ends.chain([(before, 1.0)])
                .flat_map(|(end, bond)| [(hub, end, bond), (end, hub, bond)]),
        );
        hubs.push((hub, n..=n + rays));
        (before, n) = (hub, n + 1 + rays);
    }
    let matrix = Matrix::of(&listed::<f64>(n, &couplings, 1e-3), &mut Clock::endless()).unwrap();
    let (aggregate, coarse) = coarsen(&matrix, |_| false, &mut Clock::endless()).unwrap();
    for (hub, star) in hubs {
        assert!(star.clone().all(|i| aggregate[i] == aggregate[hub]), "{star:?}");
    }
    assert!(coarse.order() <= 40, "{}", coarse.order());
}

/// Points that hang together by chance: each level has a quarter of the rows of the one before, and
/// hardly fewer entries. None takes more than two visits' worth of the first.
#[test]
fn a_cycle_does_not_visit_levels_that_are_hardly_shorter_over_and_over() {
    let n = 60_000;
    let other = |i: usize, k: usize| (noise(3 * i + k).abs() * 1e9) as usize % n;
    let couplings: Vec<_> = (0..n)
        .flat_map(|i| (0..3).map(move |k| (i, other(i, k), 1.5 + noise(5 * i + k))))
        .flat_map(|(i, j, bond)| [(i, j, bond), (j, i, bond)])
        .collect();
    let matrix = Matrix::of(&listed::<f64>(n, &couplings, 1e-3), &mut Clock::endless()).unwrap();
    let mut hierarchy = Hierarchy::new(matrix, &vec![false; n], &mut Clock::endless()).unwrap();
    let levels = hierarchy.orders().count();
    assert!(hierarchy.complexity() > 2.5, "{levels} levels of {}", hierarchy.complexity());
    for cycle in [Cycle::W, Cycle::K] {
        let (mut y, mut product) = (vec![0.0; n], vec![0.0; n]);
        let walks = hierarchy.walks();
        hierarchy.cycle(cycle, &vec![1.0; n], &mut y, &mut product, &mut Clock::endless());
        let walks = hierarchy.walks() - walks;
        // A visit is two walks and a half.
        assert!(walks <= 5.0 * levels as f64, "{walks} over {levels} levels");
    }
}

#[test]
fn elimination_solves_what_it_can() {
    let (matrix, dense) = sparse(40);
    let rhs = DVector::from_fn(40, |i, _| noise(i));
    let mut y = [f64::NAN; 40];
    Lu::of(&matrix).solve(rhs.as_slice(), &mut y);
    let condition = dense.singular_values().max() / dense.singular_values().min();
    let expected = dense.lu().solve(&rhs).unwrap();
    let off = (DVector::from_column_slice(&y) - &expected).norm() / expected.norm();
    assert!(off < 40.0 * condition * f64::EPSILON, "{off}");
    // With rows and columns in units of up to 2^±20 the same comes out in these.
    let units = |shift: usize| move |i: usize| f64::powi(2.0, (17 * i + shift) as i32 % 41 - 20);
    let (of_row, of_column) = (units(3), units(50));
    let mut lu = Lu::new();
    let scaled = |i: usize, j: usize, a: f64| of_row(i) * a * of_column(j);
    lu.factorise(40, |i, each| matrix.visit_row(i, &mut |j, a| each(j, scaled(i, j, a))));
    let of_rows: Vec<f64> = rhs.iter().enumerate().map(|(i, rhs)| of_row(i) * rhs).collect();
    let mut of_units = [f64::NAN; 40];
    lu.solve(&of_rows, &mut of_units);
    let same = |(i, (y, of_units)): (usize, (&f64, &f64))| {
        (y - of_column(i) * of_units).abs() < 40.0 * condition * f64::EPSILON * expected.norm()
    };
    assert!(y.iter().zip(&of_units).enumerate().all(same), "{of_units:?}");
    // Of a singular one, with a row of zeros beside, what the other rows say.
    let singular = rows_of(&dmatrix![1.0, -1.0, 0.0; -1.0, 1.0, 0.0; 0.0, 0.0, 0.0]);
    let mut y = [f64::NAN; 3];
    Lu::of(&singular).solve(&[2.0, -2.0, 0.0], &mut y);
    assert_eq!(y, [2.0, 0.0, 0.0]);
}

/// A film on `m × m` cells: conductances h³ that jump at the rims of pockets, and wind along x, or
/// against the numbering.
fn film<T: Scalar>(m: usize, wind: f64) -> [FivePoint<Varying<T>>; 2] {
    let h = |i: usize, j: usize| {
        let pocket = i * 6 / m % 2 == 1 && j * 6 / m % 2 == 1;
        1.2 - 0.2 * i as f64 / m as f64 + if pocket { 2.0 } else { 0.0 }
    };
    let face = |one: f64, other: f64| 2.0 / (one.powi(-3) + other.powi(-3));
    let a = FivePoint::from_fn(m, m, |i, j| {
        let here = h(i, j);
        let [s, w] = [face(here, h(i, j.max(1) - 1)), face(here, h(i.max(1) - 1, j))];
        let [e, n] = [face(here, h(i + 1, j)), face(here, h(i, j + 1))];
        [-s, -w, s + w + e + n, -e, -n].map(T::of)
    });
    let b = FivePoint::from_fn(m, m, |i, j| {
        let [west, east] = [h(i.max(1) - 1, j), h(i + 1, j)].map(|h| -h * wind.abs());
        let [west, east] = if wind > 0.0 { [west, 0.0] } else { [0.0, east] };
        [0.0, west, h(i, j) * wind.abs(), east, 0.0].map(T::of)
    });
    [a, b].map(Result::unwrap)
}

/// The matrix with these couplings and columns that sum to `slack`.
fn listed<T: Scalar>(n: usize, couplings: &[(usize, usize, f64)], slack: f64) -> Csr<'static, T> {
    let mut rows: Vec<_> = (0..n).map(|j| BTreeMap::from([(j, slack)])).collect();
    for &(i, j, g) in couplings.iter().filter(|c| c.0 != c.1) {
        *rows[i].entry(j).or_default() -= g;
        *rows[j].entry(j).or_default() += g;
    }
    csr(rows)
}

/// Points on a lattice with m to a side, `strides` apart, of conductances in series to neighbours.
fn lattice<T: Scalar>(
    m: usize,
    strides: &[usize],
    c: impl Fn(usize) -> f64,
    slack: f64,
) -> Csr<'static, T> {
    let n = m.pow(strides.len() as u32);
    let pairs = (0..n).flat_map(|k| {
        let inside = strides.iter().filter(move |&&stride| k / stride % m + 1 < m);
        inside.map(move |&stride| (k, k + stride))
    });
    let both = pairs.flat_map(|(k, l)| {
        let g = 2.0 / (1.0 / c(k) + 1.0 / c(l));
        [(k, l, g), (l, k, g)]
    });
    listed(n, &both.collect::<Vec<_>>(), slack)
}

/// A box of m³ points whose conductances jump by a thousand.
fn boxes<T: Scalar>(m: usize) -> Csr<'static, T> {
    let octant = |k: usize| k % m * 2 / m + k / m % m * 2 / m + k / m / m * 2 / m;
    let c = |k: usize| if octant(k).is_multiple_of(2) { 1.0 } else { 1e3 };
    lattice(m, &[1, m, m * m], c, 0.1)
}

/// Stiff blocks of two by two points in soft ground, one half of all, at random: each block moves
/// as one, which sweeps over its points do not see, and some level must have it alone.
#[test]
fn stiff_blocks_in_soft_ground_cost_no_more_iterations() {
    let m = 48;
    let c = |k: usize| if noise(k % m / 2 + 97 * (k / m / 2)) > 0.0 { 1e6 } else { 1.0 };
    let problem = Hlcp::lcp(lattice(m, &[1, m], c, 1e-3)).unwrap();
    let x = vec![1.0; m * m];
    let rhs: Vec<f64> = (0..m * m).map(noise).collect();
    let mut y = vec![0.0; m * m];
    let mut amg = Amg::new(&problem).unwrap();
    let (jacobian, clock) = (Jacobian::new(&problem, &x), &mut Clock::endless());
    let left = amg.solve_to(&jacobian, &rhs, &mut y, (1e-6, 20), clock);
    assert!(left <= 1e-6 && amg.set_ups() == 1, "{left:e}, {} set-ups", amg.set_ups());
}

/// Columns of B conduct too where they are active, far from the columns of A as well: neither
/// operator's are a void, which sweeps alone would have to settle.
#[test]
fn two_operators_that_conduct_take_few_iterations_in_both_roles() {
    let m = 96;
    let along = |i: usize| 0.1 + 3.0 * i as f64 / m as f64;
    let a = FivePoint::new(m, m, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    let b = FivePoint::from_fn(m, m, |i, j| {
        let [s, w, e, n] = [along(j), along(i), along(i + 1), along(j + 1)];
        [-s, -w, s + w + e + n, -e, -n]
    });
    take_few_iterations_in_both_roles(m, &a, &b.unwrap());
}

/// Solves to 10⁻⁶ in 20 iterations where columns of A are chosen in a third of an m × m grid, and
/// with A and B exchanged.
fn take_few_iterations_in_both_roles(m: usize, a: &dyn Rows<f64>, b: &dyn Rows<f64>) {
    let rhs: Vec<f64> = (0..m * m).map(|k| 1.0 + 0.1 * noise(k)).collect();
    for (a, b) in [(a, b), (b, a)] {
        let problem = Hlcp::from_pair(a, b).unwrap();
        let x: Vec<f64> = (0..m * m).map(|k| if k % m < m / 3 { 1.0 } else { -1.0 }).collect();
        let mut amg = Amg::new(&problem).unwrap();
        let (jacobian, mut y) = (Jacobian::new(&problem, &x), vec![0.0; m * m]);
        let left = amg.solve_to(&jacobian, &rhs, &mut y, (1e-6, 20), &mut Clock::endless());
        assert!(left <= 1e-6, "{left:e}");
    }
}

/// Nothing but a trace of mass holds the level of a conductor with jumps that its edges isolate. It
/// is a constant of z or r, but not of x in the units that Ω gives it on columns of B.
#[test]
fn a_conductor_without_edges_takes_few_iterations_in_both_roles() {
    let m = 96;
    let half = |i: usize, j: usize| if (i / 12 + j / 12).is_multiple_of(2) { 300.0 } else { 1.0 };
    let bond = |i: usize, j: usize, k: usize, l: usize| {
        if k < m && l < m { 2.0 / (1.0 / half(i, j) + 1.0 / half(k, l)) } else { 0.0 }
    };
    let conducts = FivePoint::from_fn(m, m, |i, j| {
        let [s, w] = [bond(i, j, i, j.wrapping_sub(1)), bond(i, j, i.wrapping_sub(1), j)];
        let [e, n] = [bond(i, j, i + 1, j), bond(i, j, i, j + 1)];
        [-s, -w, s + w + e + n + 1e-5, -e, -n]
    });
    take_few_iterations_in_both_roles(m, &conducts.unwrap(), &Identity { order: m * m });
}

/// What is returned is the residual of `y`, for any number of iterations: fewer than the directions
/// that are kept, as many, and more. A hierarchy serves until a sign changes.
#[test]
fn a_linear_solve_leaves_what_it_says() {
    let m = 40;
    let [a, b] = film::<f64>(m, 30.0);
    let problem = Hlcp::new(&a, &b, Omega::Uniform(1.3)).unwrap();
    let mut x: Vec<f64> = (0..m * m).map(|k| (k as f64 / 170.0).sin()).collect();
    let rhs: Vec<f64> = (0..m * m).map(noise).collect();
    let size = dot(&rhs, &rhs).sqrt();
    let [mut y, mut product] = [(); 2].map(|()| vec![0.0; m * m]);
    let mut amg = Amg::new(&problem).unwrap();
    for changed in 0..4 {
        x[(7 * changed + 2) * m + 11] *= -1.0;
        let mut before = 1.0;
        for limit in [1, 2, 5, KEPT - 1, KEPT, KEPT + 1, 2 * KEPT + 5] {
            let (jacobian, clock) = (Jacobian::new(&problem, &x), &mut Clock::endless());
            let left = amg.solve_to(&jacobian, &rhs, &mut y, (1e-15, limit), clock);
            jacobian.apply(&y, &mut product, &mut vec![]);
            product.iter_mut().zip(&rhs).for_each(|(product, rhs)| *product -= rhs);
            let found = dot(&product, &product).sqrt() / size;
            // Entries of J and y are of the order of 100.
            assert!((left - found).abs() < 1e-10, "{limit}: {left:e}, {found:e}");
            assert!(left <= before, "{limit}: {left:e} after {before:e}");
            before = left;
        }
        assert!(before < 1e-12 && amg.set_ups() == changed + 1, "{before:e}");
    }
}

#[test]
fn the_preconditioner_is_linear_and_the_k_cycle_is_not() {
    let [a, b] = film::<f64>(40, 1.0);
    let problem = Hlcp::new(&a, &b, Omega::Uniform(1.3)).unwrap();
    let x: Vec<f64> = (0..1600).map(|k| (k as f64 / 170.0).sin()).collect();
    let jacobian = Jacobian::new(&problem, &x);
    let mut amg = Amg::new(&problem).unwrap();
    amg.set_up(&jacobian);
    let u: Vec<f64> = (0..1600).map(|k| noise(k + 2)).collect();
    let v: Vec<f64> = (0..1600).map(|k| (k as f64 / 40.0).cos()).collect();
    let sum: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u - 3.0 * v).collect();
    let mut bend = |cycle: Option<Cycle>| {
        let [pu, pv, ps] = [&u, &v, &sum].map(|rhs| {
            let mut y = vec![f64::NAN; 1600];
            match cycle {
                None => amg.solve(&jacobian, rhs, &mut y),
                Some(cycle) => {
                    let hierarchy = amg.hierarchy.as_mut().unwrap();
                    let (product, clock) = (&mut vec![0.0; 1600], &mut Clock::endless());
                    hierarchy.cycle(cycle, rhs, &mut y, product, clock);
                }
            }
            y
        });
        let off = (0..1600).map(|k| (ps[k] - pu[k] + 3.0 * pv[k]).abs()).fold(0.0, f64::max);
        off / ps.iter().fold(0.0, |max: f64, v| max.max(v.abs()))
    };
    // Rounding, and what lengths that depend on the right-hand side do.
    let [straight, bent] = [bend(None), bend(Some(Cycle::K))];
    assert!(straight < 1e-11 && bent > 1e-8, "{straight} {bent}");
    assert_eq!(amg.set_ups(), 1);
}
