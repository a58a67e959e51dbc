//! An operator that contradicts itself is found out, and named where it makes a sweep end.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::common::Walked;
use hlcp_core::{
    Aor, Coefficients, Csr, Diagonal, Error, FivePoint, FivePointView, Hlcp, Identity,
    LinearOperator, Omega, Rhs, Rows, Step, Sum, check_operator,
};

#[derive(Debug, Clone, Copy, PartialEq)]
enum Lie {
    None,
    Product,
    Unwritten,
    Diagonal,
    Outside,
    Unsorted,
    Twice,
    NotFinite,
    Tried,
    Copied,
    View,
    ViewOrder,
    Arrays,
}

/// A 4 × 3 grid's operator, but for one lie in row 5.
struct Liar(FivePoint<f64>, Csr<'static, f64>, Lie);

fn liar(lie: Lie) -> Liar {
    let grid = FivePoint::new(4, 3, [-1.0, -0.5, 4.0, -0.25, -2.0]).unwrap();
    let other = FivePoint::new(4, 3, [-1.0, -0.5, 4.0, -0.25, -1.0]).unwrap();
    let matrix = if lie == Lie::Arrays { Csr::from_rows(&other) } else { Csr::from_rows(&grid) };
    Liar(grid, matrix, lie)
}

impl LinearOperator<f64> for Liar {
    fn order(&self) -> usize {
        12
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        let before = y[5];
        self.0.apply(x, y);
        match self.2 {
            Lie::Product => y[5] += 1e-3 * x[5],
            Lie::Unwritten => y[5] = before,
            _ => {}
        }
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, f64>> {
        let constant = |row: [f64; 5]| row.map(Coefficients::Uniform);
        match self.2 {
            Lie::View => Some(FivePointView::new(4, 3, constant([-1.0, -0.5, 4.0, -0.25, -1.0]))),
            Lie::ViewOrder => Some(FivePointView::new(4, 4, constant([0.0; 5]))),
            _ => None,
        }
    }

    fn as_csr(&self) -> Option<Csr<'_, f64>> {
        self.1.as_csr()
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) -> bool {
        self.0.visit_row(i, &mut |j, a| visit(j, if self.2 == Lie::Tried { 1.5 * a } else { a }));
        true
    }
}

impl Diagonal<f64> for Liar {
    fn diagonal_entry(&self, i: usize) -> f64 {
        if (self.2, i) == (Lie::Diagonal, 5) { 3.0 } else { 4.0 }
    }
}

impl Rows<f64> for Liar {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
        self.0.visit_row(i, visit);
        match self.2 {
            Lie::Outside if i == 5 => visit(12, 1.0),
            Lie::Unsorted if i == 5 => visit(0, 1.0),
            Lie::Twice if i == 5 => visit(9, 1.0),
            Lie::NotFinite if i == 5 => visit(11, f64::NAN),
            _ => {}
        }
    }

    fn copy_row(&self, i: usize, row: &mut [(usize, f64)]) -> usize {
        let count = self.0.copy_row(i, row);
        if self.2 == Lie::Copied { count - 1 } else { count }
    }
}

#[test]
fn every_lie_is_found_out() {
    for (lie, named) in [
        (Lie::Product, "the product is"),
        (Lie::Unwritten, "the product is NaN"),
        (Lie::Diagonal, "the diagonal is 3 in row 5"),
        (Lie::Outside, "row[5] has an entry in column 12"),
        (Lie::Unsorted, "the column in row[5] is 0"),
        (Lie::Twice, "the column in row[5] is 9"),
        (Lie::NotFinite, "row[5] is NaN"),
        (Lie::Tried, "try_visit_row"),
        (Lie::Copied, "the copied row"),
        (Lie::View, "as_five_point"),
        (Lie::ViewOrder, "as_five_point has order 16"),
        (Lie::Arrays, "as_csr"),
    ] {
        let error = check_operator(&liar(lie)).unwrap_err().to_string();
        assert!(error.contains(named), "{lie:?}: {error}");
    }
    assert_eq!(check_operator(&liar(Lie::None)), Ok(()));
}

#[test]
fn grids_of_another_order_are_refused() {
    let refused = |what| Error::Order { what, found: 16, expected: 12 };
    let (liar, honest, omega) = (|| liar(Lie::ViewOrder), || liar(Lie::None), Omega::Uniform(2.0));
    let found = Hlcp::new(liar(), honest(), omega.clone()).err();
    assert_eq!(found, Some(refused("the grid of A")));
    assert_eq!(Hlcp::new(honest(), liar(), omega).err(), Some(refused("the grid of B")));
}

/// In double precision no operator of ours contradicts itself: see `products.rs`.
#[test]
fn single_precision_is_no_contradiction_and_two_orders_are() {
    let grid = FivePoint::new(4, 3, [-1.0_f32, -0.5, 4.0, -0.25, -2.0]).unwrap();
    assert_eq!(check_operator(&grid), Ok(()));
    let sum = Sum(grid, Identity { order: 3 });
    assert!(matches!(check_operator(&sum), Err(Error::Summands { .. })));
    let none = check_operator::<f64>(&Identity { order: 0 });
    assert_eq!(none, Err(Error::Empty { what: "the operator" }));
}

#[test]
fn a_sweep_that_is_led_outside_names_the_check() {
    let a = Walked::new(liar(Lie::Outside));
    let problem = Hlcp::new(a, Identity { order: 12 }, Omega::Uniform(4.0)).unwrap();
    let (step, ones) = (Aor::gauss_seidel(), [1.0; 12]);
    let sweep = || {
        let q = Rhs::new(&ones).unwrap();
        step.step(&problem, &q, &ones, &mut [0.0; 12], &mut vec![])
    };
    let error = step.check(&problem).unwrap_err().to_string();
    assert!(error.contains("row of A[5] has an entry in column 12"), "{error}");
    let panic = catch_unwind(AssertUnwindSafe(sweep)).unwrap_err();
    let message = panic.downcast_ref::<String>().unwrap();
    assert!(message.contains("row[5]") && message.contains("check_operator"), "{message}");
}
