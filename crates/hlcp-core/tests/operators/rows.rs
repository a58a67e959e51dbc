//! Assembled rows are walked in place; it must lead where the walk over an operator's own rows does.

use std::borrow::Cow;

use hlcp_core::{
    Aor, Csr, Diagonal, DiagonalMatrix, Error, FivePoint, Hlcp, Identity, Index, LinearOperator,
    Norms, Omega, Rhs, Rows, Step, VaryingFivePoint, recognise_grid,
};
use nalgebra::DMatrix;
use proptest::{collection::vec, prelude::*};

use crate::common::Matrix;

/// The arrays of the entries that are not zero.
fn arrays<I: Index + TryFrom<usize, Error: std::fmt::Debug>>(
    matrix: &DMatrix<f64>,
) -> (Vec<I>, Vec<I>, Vec<f64>) {
    let index = |k: usize| I::try_from(k).unwrap();
    let (mut offsets, mut columns, mut values) = (vec![index(0)], vec![], vec![]);
    for row in matrix.row_iter() {
        for (j, &a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
            columns.push(index(j));
            values.push(a);
        }
        offsets.push(index(columns.len()));
    }
    (offsets, columns, values)
}

fn csr<I: Index + TryFrom<usize, Error: std::fmt::Debug>>(
    matrix: &DMatrix<f64>,
) -> Csr<'static, f64> {
    let (offsets, columns, values) = arrays::<I>(matrix);
    Csr::new(offsets, columns, values).unwrap()
}

/// A pair with holes off its diagonals, some rows longer than a copied one, and vectors.
#[derive(Debug, Clone)]
struct Case {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    omega: Omega<f64>,
    q: Vec<f64>,
    x: Vec<f64>,
    aor: Aor<f64>,
}

fn cases() -> impl Strategy<Value = Case> {
    let matrix = |n: usize| {
        vec(prop_oneof![2 => Just(0.0), 1 => -1.0..1.0], n * n).prop_map(move |entries| {
            let mut matrix = DMatrix::from_vec(n, n, entries);
            matrix.fill_diagonal(0.5 + n as f64);
            matrix
        })
    };
    (1_usize..45).prop_flat_map(move |n| {
        let omega = prop_oneof![
            (0.4..2.5).prop_map(Omega::Uniform),
            vec(0.4..2.5, n).prop_map(Omega::Each)
        ];
        let numbers = || vec(-3.0..3.0, n);
        let aor = ((0.5..1.6, -0.3..1.8), (0.5..1.6, -0.3..1.8), any::<[bool; 3]>(), 1..n + 1);
        let aor = aor.prop_map(|(a, b, [backward, accelerated, red_black], nx)| {
            let aor = Aor::with_pairs([a.0, a.1], [b.0, b.1]).unwrap();
            let aor = if backward { aor.backward() } else { aor };
            let aor = if red_black { aor.red_black(nx).unwrap() } else { aor };
            if accelerated { aor.accelerated() } else { aor }
        });
        (matrix(n), matrix(n), omega, numbers(), numbers(), aor)
            .prop_map(|(a, b, omega, q, x, aor)| Case { a, b, omega, q, x, aor })
    })
}

impl Case {
    fn step(&self, a: &dyn Rows<f64>, b: &dyn Rows<f64>) -> (Vec<f64>, Norms) {
        let problem = Hlcp::new(a, b, self.omega.clone()).unwrap().with_gamma(1.25).unwrap();
        let (q, mut y) = (Rhs::new(&self.q).unwrap(), vec![f64::NAN; self.x.len()]);
        let norms = self.aor.step(&problem, &q, &self.x, &mut y, &mut vec![]);
        (y, norms)
    }
}

/// An operator that does not tell that its rows are assembled.
struct Silent<O>(O);

impl<O: LinearOperator<f64>> LinearOperator<f64> for Silent<O> {
    fn order(&self) -> usize {
        self.0.order()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.0.apply(x, y);
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) -> bool {
        self.0.try_visit_row(i, visit)
    }
}

impl<O: Diagonal<f64>> Diagonal<f64> for Silent<O> {
    fn diagonal_entry(&self, i: usize) -> f64 {
        self.0.diagonal_entry(i)
    }
}

impl<O: Rows<f64>> Rows<f64> for Silent<O> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
        self.0.visit_row(i, visit);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// The same operations in the same order: the same bits, for every type of index, in place, at
    /// a call for each entry, and behind `dyn`, where a row is copied if it is short.
    #[test]
    fn a_sweep_over_assembled_rows_is_the_walk(case in cases()) {
        let (a, b) = (csr::<u32>(&case.a), csr::<u32>(&case.b));
        let (y, norms) = case.step(&a, &b);
        let (wide_a, wide_b) = (csr::<usize>(&case.a), csr::<i64>(&case.b));
        let (narrow_a, narrow_b) = (csr::<i32>(&case.a), csr::<u32>(&case.b));
        prop_assert_eq!(&(y.clone(), norms), &case.step(&wide_a, &wide_b));
        prop_assert_eq!(&(y.clone(), norms), &case.step(&narrow_a, &narrow_b));
        prop_assert_eq!(&(y.clone(), norms), &case.step(&Silent(&a), &b));
        let problem = Hlcp::new(Silent(&a), Silent(&b), case.omega.clone()).unwrap();
        let problem = problem.with_gamma(1.25).unwrap();
        let (q, mut walked) = (Rhs::new(&case.q).unwrap(), vec![f64::NAN; case.x.len()]);
        prop_assert_eq!(norms, case.aor.step(&problem, &q, &case.x, &mut walked, &mut vec![]));
        prop_assert_eq!(y, walked);
    }

    /// B diagonal, as in a linear complementarity problem.
    #[test]
    fn assembled_rows_go_with_a_diagonal(case in cases()) {
        let n = case.x.len();
        let (a, b) = (csr::<u32>(&case.a), DiagonalMatrix::new(case.q.clone()).unwrap());
        prop_assert_eq!(case.step(&a, &b), case.step(&Silent(&a), &Silent(&b)));
        let identity = Identity { order: n };
        prop_assert_eq!(case.step(&a, &identity), case.step(&Silent(&a), &Silent(identity)));
    }

    /// The residual, its rounding and its exact value over assembled rows are those by calls.
    #[test]
    fn residuals_over_assembled_rows_agree(case in cases(), exchanged: bool) {
        let (a, b) = (csr::<i32>(&case.a), csr::<usize>(&case.b));
        let known = Hlcp::new(&a, &b, case.omega.clone()).unwrap();
        let silent = Hlcp::new(Silent(&a), Silent(&b), case.omega.clone()).unwrap();
        let (q, n) = (Rhs::new(&case.q).unwrap(), case.x.len());
        let (mut z, mut r, mut scratch) = (vec![0.0; n], vec![0.0; n], vec![]);
        let found = if exchanged {
            let (known, silent) = (known.exchanged().unwrap(), silent.exchanged().unwrap());
            known.solution_from_x(&case.x, &mut z, &mut r);
            let residuals = [known.residual(&q, &z, &r, &mut scratch), silent.residual(&q, &z, &r, &mut scratch)];
            prop_assert_eq!(known.exact_residual(&q, &case.x), silent.exact_residual(&q, &case.x));
            residuals
        } else {
            known.solution_from_x(&case.x, &mut z, &mut r);
            prop_assert_eq!(known.exact_residual(&q, &case.x), silent.exact_residual(&q, &case.x));
            let [one, other] = [known.rounding(&q, &case.x, &mut scratch), silent.rounding(&q, &case.x, &mut scratch)];
            prop_assert_eq!(one, other);
            [known.residual(&q, &z, &r, &mut scratch), silent.residual(&q, &z, &r, &mut scratch)]
        };
        // The squares are summed in another order.
        prop_assert_eq!(found[0].linf, found[1].linf);
        prop_assert!((found[0].l2 - found[1].l2).abs() <= n as f64 * f64::EPSILON * found[1].l2);
    }

    /// Assembled, a five-point pair is found again, coefficient by coefficient.
    #[test]
    fn a_five_point_pair_is_recognised(
        nx in 2_usize..7,
        ny in 2_usize..7,
        entries in vec(0.1..1.0, 10 * 36),
        constant: bool,
    ) {
        let operator = |from: usize| {
            VaryingFivePoint::from_fn(nx, ny, |i, j| {
                let k = if constant { 0 } else { j * nx + i };
                std::array::from_fn(|direction| entries[from + 5 * k + direction])
            }).unwrap()
        };
        let (a, b) = (operator(0), operator(180));
        let (of_a, of_b) = (Csr::from_rows(&a), Csr::from_rows(&b));
        let found = recognise_grid(&of_a, &of_b).unwrap();
        for (found, sought) in found.iter().zip([&of_a, &of_b]) {
            let view = found.as_five_point().unwrap();
            prop_assert_eq!(view.grid(), Some([nx, ny]));
            prop_assert_eq!(view.constants().is_some(), constant);
            prop_assert_eq!(&Csr::from_rows(found), sought);
        }
    }
}

#[test]
fn what_is_no_grid_is_not_recognised() {
    let grid = FivePoint::new(5, 4, [-1.0, -2.0, 9.0, -3.0, -4.0]).unwrap();
    let identity = Identity { order: 20 };
    assert!(recognise_grid(&grid, &identity).is_some());
    // One entry at the edge of the grid leads to the next row of points, or far away.
    for (row, column) in [(4, 5), (0, 19), (7, 13)] {
        let mut matrix = DMatrix::zeros(20, 20);
        (0..20).for_each(|i| grid.visit_row(i, &mut |j, a| matrix[(i, j)] = a));
        matrix[(row, column)] = 0.5;
        assert!(recognise_grid(&Matrix(matrix.clone()), &identity).is_none());
        let error = VaryingFivePoint::from_rows(5, 4, &Matrix(matrix)).unwrap_err();
        assert_eq!(error, Error::OffGrid { row, column, nx: 5, ny: 4 });
    }
    // A line is no grid of two dimensions, and two orders are no grid.
    let line = FivePoint::new(20, 1, [0.0, -2.0, 9.0, -3.0, 0.0]).unwrap();
    assert!(recognise_grid(&line, &identity).is_none());
    assert!(recognise_grid(&grid, &Identity { order: 21 }).is_none());
    let error = VaryingFivePoint::from_rows(5, 5, &grid).unwrap_err();
    assert_eq!(error, Error::Order { what: "the grid", found: 25, expected: 20 });
    let bad = Matrix(DMatrix::from_diagonal_element(4, 4, f64::NAN));
    assert!(matches!(VaryingFivePoint::from_rows(2, 2, &bad), Err(Error::NotFinite { .. })));
}

#[test]
fn arrays_that_are_no_matrix_are_refused_with_the_place() {
    fn refused(offsets: &[i32], columns: &[i32], values: usize) -> String {
        Csr::new(offsets, columns, vec![1.0; values]).unwrap_err().to_string()
    }
    for (offsets, columns, values, message) in [
        (&[0, 1, 3][..], &[0, 1, 1][..], 3, "columns[2] is 1"),
        (&[0, 2, 3], &[1, 0, 1], 3, "columns[1] is 0"),
        (&[0, 1, 2], &[0, 2], 2, "columns[1] is 2"),
        (&[0, 1, 2], &[0, -1], 2, "columns[1] is -1"),
        (&[1, 1, 2], &[0, 1], 2, "offsets[0] is 1"),
        (&[0, 2, 1, 3], &[0, 1, 2], 3, "offsets[2] is 1"),
        (&[0, 9, 2], &[0, 1], 2, "offsets[1] is 9"),
        (&[0, -1, 2], &[0, 1], 2, "offsets[1] is -1"),
        (&[0, 1, 3], &[0, 1], 2, "offsets[2] is 3"),
        (&[0, 1, 2], &[0, 1], 3, "values[3] is 3"),
        (&[0], &[], 0, "order 0"),
        (&[], &[], 0, "order 0"),
    ] {
        let found = refused(offsets, columns, values);
        assert!(found.contains(message), "{found}");
    }
    let nan = Csr::new(vec![0_u32, 1], vec![0], Cow::Borrowed(&[f64::NAN][..])).unwrap_err();
    assert!(matches!(nan, Error::NotFinite { what: "values", index: 0, .. }));
}
