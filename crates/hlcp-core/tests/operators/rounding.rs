//! The rounding in a residual, and residuals without it, against exact rational arithmetic.

use std::ops::RangeInclusive;

use crate::common::Walked;
use hlcp_core::{Coefficients, FivePoint, Hlcp, LinearOperator, Norms, Omega, Rhs, Rows, Scalar};
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};
use proptest::prelude::*;

/// Which of itself an operator shows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shown {
    FivePoint,
    Rows,
    Products,
}

/// An operator that is known by its products alone.
struct Products<O>(O);

impl<T: Scalar, O: LinearOperator<T>> LinearOperator<T> for Products<O> {
    fn order(&self) -> usize {
        self.0.order()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.0.apply(x, y);
    }
}

type Grid<'g, T> = FivePoint<Coefficients<'g, T>>;

impl Shown {
    fn of<'g, T: Scalar>(self, grid: &'g Grid<'g, T>) -> Box<dyn LinearOperator<T> + 'g> {
        match self {
            Self::FivePoint => Box::new(grid),
            Self::Rows => Box::new(Walked::new(grid)),
            Self::Products => Box::new(Products(grid)),
        }
    }
}

fn exact<T: Scalar>(value: T) -> BigRational {
    BigRational::from_float(value.to_f64().unwrap()).unwrap()
}

/// The exact norms of `A z − B r + q` (as close as a double comes, and the largest entry), and of
/// the sums of the moduli of its terms; and the largest quotient of an entry and that sum.
fn norms<T: Scalar>([a, b]: [&Grid<'_, T>; 2], q: &[T], z: &[T], r: &[T]) -> ([Norms; 2], f64) {
    let mut quotient = BigRational::zero();
    let mut squares = [(); 2].map(|()| BigRational::zero());
    let mut largest = squares.clone();
    for (i, &q) in q.iter().enumerate() {
        let mut row = [exact(q), exact(q).abs()];
        let mut add = |term: BigRational| {
            row[1] += term.abs();
            row[0] += term;
        };
        a.visit_row(i, &mut |j, a| add(exact(a) * exact(z[j])));
        b.visit_row(i, &mut |j, b| add(-exact(b) * exact(r[j])));
        if !row[1].is_zero() {
            quotient = quotient.max(row[0].abs() / &row[1]);
        }
        for ((row, squares), largest) in row.into_iter().zip(&mut squares).zip(&mut largest) {
            *squares += &row * &row;
            *largest = row.abs().max(largest.clone());
        }
    }
    let norms = [0, 1].map(|k| Norms {
        l2: squares[k].to_f64().unwrap().sqrt(),
        linf: largest[k].to_f64().unwrap(),
    });
    (norms, quotient.to_f64().unwrap())
}

/// Numbers of either sign whose sizes spread over these powers of two.
fn numbers(count: usize, powers: RangeInclusive<i32>) -> impl Strategy<Value = Vec<f64>> {
    let number = (1.0..2.0_f64, powers, any::<bool>())
        .prop_map(|(v, power, minus)| if minus { -v } else { v } * f64::powi(2.0, power));
    proptest::collection::vec(number, count)
}

fn holds<T: Scalar>(
    shape: [usize; 2],
    entries: &[Vec<f64>],
    constant: bool,
    shown: Shown,
) -> Result<(), TestCaseError> {
    let to = |v: &f64| T::from(*v).unwrap();
    let ([nx, ny], n) = (shape, shape[0] * shape[1]);
    let list = |k: usize| entries[k].iter().take(n).map(to).collect::<Vec<T>>();
    let lists = (0..10).map(list).collect::<Vec<_>>();
    let grid = |from: usize| {
        let coefficients = [0, 1, 2, 3, 4].map(|d| match &lists[from + d] {
            c if constant => Coefficients::Uniform(c[0]),
            c => Coefficients::Each(c),
        });
        Grid::new(nx, ny, coefficients).unwrap()
    };
    let (a, b, q) = (grid(0), grid(5), list(10));
    let omega = Omega::Each(list(11).into_iter().map(T::abs).collect());
    let mut x = list(12);
    let problem = Hlcp::new(shown.of(&a), shown.of(&b), omega).unwrap();
    let (mut z, mut r, mut scratch) = (vec![T::zero(); n], vec![T::zero(); n], vec![]);
    for round in 0..3 {
        problem.solution_from_x(&x, &mut z, &mut r);
        let q = Rhs::new(&q).unwrap();
        let ([truth, terms], quotient) = norms([&a, &b], q.entries(), &z, &r);
        let Some(bound) = problem.exact_residual(&q, &x) else {
            prop_assert_eq!(shown, Shown::Products);
            let computed = problem.residual(&q, &z, &r, &mut scratch);
            let rounding = problem.estimated_rounding(&q, &x, &mut scratch);
            for (computed, truth, rounding) in
                [(computed.l2, truth.l2, rounding.l2), (computed.linf, truth.linf, rounding.linf)]
            {
                // Only an estimate is known; it is generous by about the square root of n.
                let (off, bound) = ((computed - truth).abs(), 20.0 * rounding);
                prop_assert!(off <= bound, "{off:e} {bound:e} in round {round}");
            }
            continue;
        };
        prop_assert!(shown != Shown::Products);
        for (bound, truth) in [(bound.l2, truth.l2), (bound.linf, truth.linf)] {
            // The oracle's root is rounded as well.
            prop_assert!(bound >= truth * (1.0 - 4.0 * f64::EPSILON));
            let excess = truth * 64.0 * f64::EPSILON + terms.l2 * 512.0 * f64::EPSILON.powi(2);
            prop_assert!(bound <= truth + excess, "{bound:e} {truth:e}");
        }
        let error = problem.backward_error(&q, &x).unwrap();
        // A quotient of two rounded sums of fewer than 16 moduli, and what is left of the slack.
        let excess = quotient * 64.0 * f64::EPSILON + 512.0 * f64::EPSILON.powi(2);
        prop_assert!((error - quotient).abs() <= excess, "{error:e} {quotient:e}");
        // Once more where the terms of A and B are far below q, or far above it no longer.
        x.iter_mut().for_each(|x| *x /= T::from(1 << 20).unwrap());
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn bounds_on_rounding_hold_and_exact_residuals_are_exact(
        shape in [1..5_usize, 1..5_usize],
        entries in proptest::collection::vec(numbers(16, -30..=30), 13),
        constant in any::<bool>(),
        shown in prop::sample::select(vec![Shown::FivePoint, Shown::Rows, Shown::Products]),
    ) {
        holds::<f64>(shape, &entries, constant, shown)?;
        holds::<f32>(shape, &entries, constant, shown)?;
    }
}

/// The residual of an exact answer is zero, not a bound on rounding: nothing was rounded.
#[test]
fn an_exact_answer_has_no_residual() {
    let a = Grid::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0].map(Coefficients::Uniform)).unwrap();
    for shown in [Shown::FivePoint, Shown::Rows] {
        let problem = Hlcp::new(shown.of(&a), shown.of(&a), Omega::Uniform(1.0)).unwrap();
        // z = (½, 0, 3/2) and r = (0, 3, 0): A z = (2, −2, 6), A r = (−3, 12, −3).
        let (q, x) = ([-5.0, 14.0, -9.0], [0.25, -1.5, 0.75]);
        let exact = problem.exact_residual(&Rhs::new(&q).unwrap(), &x);
        assert_eq!(exact, Some(Norms { l2: 0.0, linf: 0.0 }));
    }
}

/// A product that underflows is no zero: 1e-200 · 2e-200 is lost to double precision.
#[test]
fn what_underflows_is_counted() {
    let a = Grid::new(1, 1, [0.0, 0.0, 1e-200, 0.0, 0.0].map(Coefficients::Uniform)).unwrap();
    for shown in [Shown::FivePoint, Shown::Rows] {
        let problem = Hlcp::new(shown.of(&a), shown.of(&a), Omega::Uniform(1.0)).unwrap();
        let exact = problem.exact_residual(&Rhs::new(&[0.0]).unwrap(), &[1e-200]).unwrap();
        assert!(exact.linf > 0.0 && exact.l2 > 0.0, "{exact:?}");
    }
}
