//! The rounding in a residual, and residuals without it, against exact rational arithmetic.

use std::ops::RangeInclusive;

use hlcp_core::{
    Coefficients, Diagonal, FivePointView, Hlcp, LinearOperator, Norms, Omega, Rhs, Rows, Scalar,
};
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};
use proptest::prelude::*;

/// A five-point operator on a grid, shown as such or by its rows only, or not even those.
#[derive(Debug, Clone)]
struct Grid<T> {
    nx: usize,
    coefficients: [Vec<T>; 5],
    shown: Shown,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shown {
    FivePoint,
    Rows,
    Products,
}

impl<T: Scalar> Grid<T> {
    fn entries(&self, i: usize) -> Vec<(usize, T)> {
        let (nx, n) = (self.nx, self.coefficients[0].len());
        let neighbours = [
            (i >= nx).then(|| i - nx),
            (!i.is_multiple_of(nx)).then(|| i - 1),
            Some(i),
            (!(i + 1).is_multiple_of(nx)).then_some(i + 1),
            (i + nx < n).then_some(i + nx),
        ];
        let entry = |(d, j): (usize, Option<usize>)| Some((j?, self.coefficients[d][i]));
        neighbours.into_iter().enumerate().filter_map(entry).collect()
    }
}

impl<T: Scalar> LinearOperator<T> for Grid<T> {
    fn order(&self) -> usize {
        self.coefficients[0].len()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        for (i, y) in y.iter_mut().enumerate() {
            *y = self.entries(i).into_iter().fold(T::zero(), |sum, (j, a)| sum + a * x[j]);
        }
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        let each = |d: usize| {
            let c = &self.coefficients[d];
            let constant = c.iter().all(|v| *v == c[0]);
            if constant { Coefficients::Constant(c[0]) } else { Coefficients::Each(c) }
        };
        let view = || {
            let [south, west, centre, east, north] = [0, 1, 2, 3, 4].map(each);
            let ny = self.order() / self.nx;
            FivePointView::new(self.nx, ny, [south, west, centre, east, north])
        };
        (self.shown == Shown::FivePoint).then(view)
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        if self.shown == Shown::Products {
            return false;
        }
        self.visit_row(i, visit);
        true
    }
}

impl<T: Scalar> Diagonal<T> for Grid<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.coefficients[2][i]
    }
}

impl<T: Scalar> Rows<T> for Grid<T> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        self.entries(i).into_iter().for_each(|(j, a)| visit(j, a));
    }
}

fn exact<T: Scalar>(value: T) -> BigRational {
    BigRational::from_float(value.to_f64().unwrap()).unwrap()
}

/// The exact norms of `A z − B r + q` (as close as a double comes, and the largest entry).
fn norms<T: Scalar>([a, b]: [&Grid<T>; 2], q: &[T], z: &[T], r: &[T]) -> Norms {
    let (mut squares, mut largest) = (BigRational::zero(), BigRational::zero());
    for (i, &q) in q.iter().enumerate() {
        let mut row = exact(q);
        for (j, a) in a.entries(i) {
            row += exact(a) * exact(z[j]);
        }
        for (j, b) in b.entries(i) {
            row -= exact(b) * exact(r[j]);
        }
        squares += &row * &row;
        largest = largest.max(row.abs());
    }
    Norms { l2: squares.to_f64().unwrap().sqrt(), linf: largest.to_f64().unwrap() }
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
    let (nx, n) = (shape[0], shape[0] * shape[1]);
    let list = |k: usize| entries[k].iter().take(n).map(to).collect::<Vec<T>>();
    let grid = |from: usize| {
        let coefficients = [0, 1, 2, 3, 4].map(|d| {
            let c = list(from + d);
            if constant { vec![c[0]; n] } else { c }
        });
        Grid { nx, coefficients, shown }
    };
    let (a, b, q) = (grid(0), grid(5), list(10));
    let omega = Omega::Each(list(11).into_iter().map(T::abs).collect());
    let mut x = list(12);
    let problem = Hlcp::new(a.clone(), b.clone(), omega).unwrap();
    let (mut z, mut r, mut scratch) = (vec![T::zero(); n], vec![T::zero(); n], vec![]);
    for round in 0..3 {
        problem.recover(&x, &mut z, &mut r);
        let (q, truth) = (Rhs::new(&q).unwrap(), norms([&a, &b], &q, &z, &r));
        let computed = problem.residual(&q, &z, &r, &mut scratch);
        let rounding = problem.rounding(&q, &x, &mut scratch);
        for (computed, truth, rounding) in
            [(computed.l2, truth.l2, rounding.l2), (computed.linf, truth.linf, rounding.linf)]
        {
            let off = (computed - truth).abs();
            // Of products only an estimate is known; it is generous by about the square root of n.
            let bound = if shown == Shown::Products { 20.0 * rounding } else { rounding };
            prop_assert!(off <= bound, "{off:e} {bound:e} in round {round}");
        }
        match problem.exact_residual(&q, &x) {
            None => prop_assert_eq!(shown, Shown::Products),
            Some(bound) => {
                let terms = rounding.l2 / T::epsilon().to_f64().unwrap();
                for (bound, truth) in [(bound.l2, truth.l2), (bound.linf, truth.linf)] {
                    // The oracle's root is rounded as well.
                    prop_assert!(bound >= truth * (1.0 - 4.0 * f64::EPSILON));
                    let excess = truth * 64.0 * f64::EPSILON + terms * 512.0 * f64::EPSILON.powi(2);
                    prop_assert!(bound <= truth + excess, "{bound:e} {truth:e}");
                }
            }
        }
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

/// `f64` drops 0.75 beside 1e16; the exact residual does not.
#[test]
fn cancellation_costs_an_exact_residual_nothing() {
    let coefficients = [0.0, -1.0, 1.0, -1.0, 0.0].map(|c| vec![c; 2]);
    for shown in [Shown::FivePoint, Shown::Rows] {
        let a = Grid { nx: 2, coefficients: coefficients.clone(), shown };
        let problem = Hlcp::new(a.clone(), a, Omega::Uniform(1.0)).unwrap();
        let q = [0.75, -0.25];
        let exact = problem.exact_residual(&Rhs::new(&q).unwrap(), &[1e17, 1e17]).unwrap();
        assert!((exact.linf - 0.75).abs() < 1e-10, "{exact:?}");
    }
}
