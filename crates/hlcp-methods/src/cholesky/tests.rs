use approx::assert_abs_diff_eq;
use hlcp_core::Omega;
use nalgebra::{DMatrix, DVector};
use proptest::{collection::vec, prelude::*};

use super::*;

proptest! {
    /// Springs of both signs on ground that is stiffer, two such systems that push each other
    /// crosswise, rows and both unknowns multiplied by anything, some unknowns free, the
    /// diagonal either operator, against the columns as the weights 1 + d and 1 − d add them.
    #[test]
    fn factors_solve_with_any_columns(
        bonds in (1..20_usize).prop_flat_map(|n| vec((0..n, 0..n, -1.0..1.0_f64), 2 * n)),
        ground in vec(0.1..2.0_f64, 20),
        (diagonal, omega) in (vec(0.2..5.0_f64, 20), vec(0.2..5.0_f64, 20)),
        [factors, of_c, of_other] in [-8..8_i32, -2..3, -2..3].map(|range| vec(range, 20)),
        d in vec(prop_oneof![
            Just(1.0), Just(-1.0), Just(f64::EPSILON - 1.0), Just(1.0 - f64::EPSILON), -1.0..1.0_f64
        ], 20),
        rhs in vec(-1.0..1.0_f64, 20),
        (of_b, is_kept) in any::<(bool, bool)>(),
        kinds in vec(any::<bool>(), 20),
        free in vec(prop::option::weighted(0.2, 0.3..3.0_f64), 20),
    ) {
        let n = bonds.len() / 2;
        let mut spring = DMatrix::from_diagonal(&DVector::from_column_slice(&ground[..n]));
        for &(i, j, bond) in bonds.iter().filter(|(i, j, _)| i != j) {
            let (back, holds) =
                if kinds[i] == kinds[j] { (bond, bond.abs()) } else { (-bond, 0.0) };
            (spring[(i, j)], spring[(j, i)]) = (spring[(i, j)] - bond, spring[(j, i)] - back);
            (spring[(i, i)], spring[(j, j)]) =
                (spring[(i, i)] + holds, spring[(j, j)] + holds);
        }
        // D times a symmetric matrix is C.
        let mut other = DMatrix::from_diagonal(&DVector::from_column_slice(&diagonal[..n]));
        let mut couples = &other * &spring;
        for (i, &factor) in factors[..n].iter().enumerate() {
            couples.row_mut(i).scale_mut(10_f64.powi(factor));
            other.row_mut(i).scale_mut(10_f64.powi(factor));
            couples.column_mut(i).scale_mut(10_f64.powi(of_c[i]));
            other.column_mut(i).scale_mut(10_f64.powi(of_other[i]));
        }
        let mut factors_of_a = vec![0.0; n];
        for (j, free) in free[..n].iter().enumerate() {
            if let &Some(factor) = free {
                other.set_column(j, &(factor * couples.column(j)));
                factors_of_a[j] = if of_b { factor } else { factor.recip() } / omega[j];
            }
        }
        let [a, b] = if of_b { [other, couples] } else { [couples, other] };
        let each = Omega::Each(omega[..n].to_vec());
        let problem = Hlcp::new(&a, &b, each).unwrap();
        let (mut cholesky, cost) = Cholesky::for_problem(&problem, &factors_of_a).unwrap();
        prop_assert!(cost.bytes <= 8.0 * (n * (n + 1)) as f64);
        cholesky.serves &= is_kept;
        let sum = DMatrix::from_fn(n, n, |i, j| {
            (1.0 + d[j]) * a[(i, j)] + (1.0 - d[j]) * omega[j] * b[(i, j)]
        });
        let rhs: Vec<f64> = (0..n).map(|i| rhs[i] * 10_f64.powi(factors[i])).collect();
        let mut y = vec![f64::NAN; n];
        let weights = |side: f64| -> Vec<[f64; 2]> {
            d[..n].iter().map(|d| [1.0 + side * d, 1.0 - side * d]).collect()
        };
        cholesky.factorise(&problem, &weights(1.0));
        cholesky.solve(&rhs, &mut y);
        // What was factorised between, of this pattern or another one, leaves no trace.
        for side in [1.0, -1.0] {
            let mut again = vec![f64::NAN; n];
            cholesky.factorise(&problem, &weights(side));
            cholesky.factorise(&problem, &weights(1.0));
            cholesky.solve(&rhs, &mut again);
            prop_assert_eq!(&again, &y);
        }
        // Backward stable: the residual is rounding beside the terms of its row, in the units
        // of rows and columns, times the growth of a condition of some hundred.
        let mut size = DVector::from_vec(y.clone()).abs();
        let unit = |i: usize| 10_f64.powi(factors[i]);
        for (j, size) in size.iter_mut().enumerate() {
            *size *= (0..n).map(|i| sum[(i, j)].abs() / unit(i)).fold(0.0, f64::max);
        }
        for (i, f) in (&sum * DVector::from_vec(y)).iter().enumerate() {
            let size = n as f64 * size.amax() * unit(i) + rhs[i].abs();
            prop_assert!((f - rhs[i]).abs() <= 1e4 * f64::EPSILON * size, "{i} {f} {}", rhs[i]);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Flows that cost their squares through a network, and free potentials, which have no
    /// entry on the diagonal: between the edges of the interior there always are factors.
    #[test]
    fn potentials_without_a_diagonal_have_pivots(
        ends in (2..40_usize).prop_flat_map(|n| vec((0..n, 0..n), n..4 * n)),
        (costs, weights) in (vec(0.1..2.0_f64, 160), vec(0.01..1.99_f64, 160)),
        (rhs, serves) in (vec(-1.0..1.0_f64, 300), any::<bool>()),
    ) {
        // A tree, and what closes circles; the potential of its root is 0.
        let nodes = ends.iter().map(|&(i, j)| i.max(j).max(1)).max().unwrap() + 1;
        let tree = (1..nodes).map(|j| (ends[j % ends.len()].0 % j, j));
        let arcs: Vec<_> = tree.chain(ends.iter().copied().filter(|(i, j)| i != j)).collect();
        let (flows, n) = (arcs.len(), arcs.len() + nodes - 1);
        let mut a = DMatrix::<f64>::zeros(n, n);
        for (k, &(i, j)) in arcs.iter().enumerate() {
            a[(k, k)] = costs[k % costs.len()];
            for (node, way) in [(i, 1.0), (j, -1.0)] {
                if node > 0 {
                    (a[(flows + node - 1, k)], a[(k, flows + node - 1)]) = (way, -way);
                }
            }
        }
        let mut b = a.clone();
        b.view_mut((0, 0), (flows, flows)).fill_with_identity();
        b.view_mut((flows, 0), (nodes - 1, flows)).fill(0.0);
        let free: Vec<f64> = (0..n).map(|j| if j < flows { 0.0 } else { 1.0 }).collect();
        let problem = Hlcp::new(&a, &b, Omega::Uniform(1.0)).unwrap();
        let (mut cholesky, _) = Cholesky::for_problem(&problem, &free).unwrap();
        cholesky.serves &= serves;
        let weight = |j: usize| if j < flows { weights[j % weights.len()] } else { 2.0 };
        let weights: Vec<_> = (0..n).map(|j| [weight(j), 2.0 - weight(j)]).collect();
        cholesky.factorise(&problem, &weights);
        prop_assert!(cholesky.has_factors());
        let mut y = vec![0.0; n];
        cholesky.solve(&rhs[..n], &mut y);
        for i in 0..n {
            let entry = |j: usize| weights[j][0] * a[(i, j)] + weights[j][1] * b[(i, j)];
            let terms = (0..n).map(|j| entry(j) * y[j]);
            let size: f64 = terms.clone().map(f64::abs).sum();
            prop_assert!((terms.sum::<f64>() - rhs[i]).abs() <= 1e-9 * (1.0 + size));
        }
    }
}

/// Twice as much goes on as comes back: the last row would be divided by 2ⁿ⁻¹.
#[test]
fn divisors_that_are_too_far_apart_are_refused() {
    for n in [50, 54] {
        let a = hlcp_core::Tridiagonal::new(n, |_| [-1.0, 4.0, -2.0]).unwrap();
        let one = hlcp_core::Identity { order: n };
        let problem = Hlcp::new(a, one, Omega::Uniform(1.0)).unwrap();
        assert_eq!(Cholesky::for_problem(&problem, &vec![0.0; n]).is_some(), n == 50);
    }
}

#[test]
fn what_is_not_symmetric_or_not_definite_has_no_factors() {
    let problem = |a: DMatrix<f64>, b| Hlcp::new(a, b, Omega::Uniform(1.0)).unwrap();
    let one = DMatrix::<f64>::identity(3, 3);
    let matrix = |entries: [f64; 9]| DMatrix::from_row_slice(3, 3, &entries);
    let of = |problem: &Hlcp<f64, _, _>| Cholesky::for_problem(problem, &[0.0; 3]);
    // Around the triangle, the way back is less than the way there.
    let skew = matrix([2.0, -1.0, -0.5, -0.9, 2.0, -1.0, -0.5, -1.0, 2.0]);
    assert!(of(&problem(skew.clone(), one.clone())).is_none());
    let pattern = matrix([2.0, -1.0, 0.0, 0.0, 2.0, -1.0, -1.0, 0.0, 2.0]);
    assert!(of(&problem(pattern, one.clone())).is_none());
    // One of three pairs has two signs.
    let turned = matrix([2.0, -1.0, -1.0, 1.0, 2.0, -1.0, -1.0, -1.0, 2.0]);
    assert!(of(&problem(turned, one.clone())).is_none());
    assert!(of(&problem(skew.clone(), skew)).is_none());
    let saddle = problem(matrix([1.0, 3.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0, 1.0]), one);
    let (mut cholesky, _) = of(&saddle).unwrap();
    let mut y = [0.0_f64; 3];
    cholesky.factorise(&saddle, &[[2.0, 0.0], [2.0, 0.0], [0.0, 2.0]]);
    cholesky.solve(&[1.0; 3], &mut y);
    assert!(y.iter().all(|y| y.is_nan()));
    // Nor has what each column has a share of the other one in: no rounding turns its pivot.
    cholesky.factorise(&saddle, &[[1.9, 0.1]; 3]);
    assert!(!cholesky.has_factors());
    // Without one of the two that make it indefinite, A₂₂ z₂ = 1, r₁ = 3 z₂ − 1, in halves.
    cholesky.factorise(&saddle, &[[0.0, 2.0], [2.0, 0.0], [0.0, 2.0]]);
    cholesky.solve(&[1.0; 3], &mut y);
    assert_abs_diff_eq!(&y[..], &[-1.0, 0.5, 0.5][..], epsilon = 1e-15);
}
