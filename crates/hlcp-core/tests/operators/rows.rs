//! Assembled rows are walked in place; it must lead where the walk over an operator's own rows
//! does.

use std::{borrow::Cow, collections::BTreeSet};

use hlcp_core::{
    Aor, Csr, DiagonalMatrix, Error, FivePoint, Hlcp, Identity, Index, LinearOperator, Multicolour,
    Norms, Omega, Rhs, Rows, Step, recognise_grid,
};
use nalgebra::DMatrix;
use nalgebra_sparse::CsrMatrix;
use proptest::{collection::vec, prelude::*};

use crate::{
    common::{Lists, Walked, assembled},
    transfers::on_any_threads,
};

/// The entries that are not zero.
fn csr<I: Index + TryFrom<usize, Error: std::fmt::Debug>>(
    matrix: &DMatrix<f64>,
) -> Csr<'static, f64> {
    let indices = |list: Vec<usize>| list.into_iter().map(|k| I::try_from(k).unwrap()).collect();
    let (offsets, columns, values) = CsrMatrix::from(matrix).disassemble();
    Csr::new::<I>(Cow::Owned(indices(offsets)), Cow::Owned(indices(columns)), values).unwrap()
}

/// What a step makes of `x`, and the norms that it measures.
pub(crate) fn taken<A, B>(
    step: &impl Step<f64, A, B>,
    problem: &Hlcp<f64, A, B>,
    q: &[f64],
    x: &[f64],
) -> (Vec<f64>, Norms) {
    let (q, mut y) = (Rhs::new(q).unwrap(), vec![f64::NAN; x.len()]);
    let norms = step.step(problem, &q, x, &mut y, &mut vec![]);
    (y, norms)
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

/// Any step: MMS or AMMS, forward or backward, in the order of the rows or of a grid with so many
/// points to a row.
pub(crate) fn aors(nx: impl Strategy<Value = usize>) -> impl Strategy<Value = Aor<f64>> {
    let pair = || [0.5..1.6, -0.3..1.8];
    (pair(), pair(), any::<[bool; 3]>(), nx).prop_map(|(a, b, flags, nx)| {
        let [backward, accelerated, red_black] = flags;
        let aor = Aor::with_pairs(a, b).unwrap();
        let aor = if backward { aor.backward() } else { aor };
        let aor = if red_black { aor.red_black(nx).unwrap() } else { aor };
        if accelerated { aor.accelerated() } else { aor }
    })
}

pub(crate) fn omegas(n: usize) -> impl Strategy<Value = Omega<f64>> {
    let entry = 0.4..2.5;
    prop_oneof![entry.clone().prop_map(Omega::Uniform), vec(entry, n).prop_map(Omega::Each)]
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
        let numbers = || vec(-3.0..3.0, n);
        (matrix(n), matrix(n), omegas(n), numbers(), numbers(), aors(1..n + 1))
            .prop_map(|(a, b, omega, q, x, aor)| Case { a, b, omega, q, x, aor })
    })
}

impl Case {
    fn problem<A: Rows<f64>, B: Rows<f64>>(&self, a: A, b: B) -> Hlcp<f64, A, B> {
        Hlcp::new(a, b, self.omega.clone()).unwrap().with_gamma(1.25).unwrap()
    }

    fn step(&self, a: &dyn Rows<f64>, b: &dyn Rows<f64>) -> (Vec<f64>, Norms) {
        taken(&self.aor, &self.problem(a, b), &self.q, &self.x)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// The same operations in the same order: the same bits, for every type of index, in place, at
    /// a call for each entry, and behind `dyn`, where a row is copied if it is short.
    #[test]
    fn a_sweep_over_assembled_rows_is_the_walk(case in cases()) {
        let (a, b) = (csr::<u32>(&case.a), csr::<u32>(&case.b));
        let found = case.step(&a, &b);
        prop_assert_eq!(&found, &case.step(&csr::<usize>(&case.a), &csr::<i64>(&case.b)));
        prop_assert_eq!(&found, &case.step(&csr::<i32>(&case.a), &csr::<u32>(&case.b)));
        prop_assert_eq!(&found, &case.step(&Walked::new(&a), &b));
        let walked = case.problem(Walked::new(&a), Walked::new(&b));
        prop_assert_eq!(found, taken(&case.aor, &walked, &case.q, &case.x));
    }

    /// B diagonal, as in a linear complementarity problem.
    #[test]
    fn assembled_rows_go_with_a_diagonal(case in cases()) {
        let n = case.x.len();
        let (a, b) = (csr::<u32>(&case.a), DiagonalMatrix::new(case.q.clone()).unwrap());
        prop_assert_eq!(case.step(&a, &b), case.step(&Walked::new(&a), &Walked::new(&b)));
        let identity = Identity { order: n };
        prop_assert_eq!(case.step(&a, &identity), case.step(&Walked::new(&a), &Walked::new(identity)));
    }

    /// The residual and its exact value over assembled rows are those by calls.
    #[test]
    fn residuals_over_assembled_rows_agree(case in cases(), exchanged: bool) {
        let (a, b) = (csr::<i32>(&case.a), csr::<usize>(&case.b));
        let known = Hlcp::new(&a, &b, case.omega.clone()).unwrap();
        let silent = Hlcp::new(Walked::new(&a), Walked::new(&b), case.omega.clone()).unwrap();
        let (q, n) = (Rhs::new(&case.q).unwrap(), case.x.len());
        let (mut z, mut r, mut scratch) = (vec![0.0; n], vec![0.0; n], vec![]);
        let known = if exchanged { known.exchanged().unwrap() } else { known };
        let silent = if exchanged { silent.exchanged().unwrap() } else { silent };
        known.solution_from_x(&case.x, &mut z, &mut r);
        prop_assert_eq!(known.exact_residual(&q, &case.x), silent.exact_residual(&q, &case.x));
        let found = known.residual(&q, &z, &r, &mut scratch);
        let walked = silent.residual(&q, &z, &r, &mut scratch);
        // The squares are summed in another order.
        prop_assert_eq!(found.linf, walked.linf);
        prop_assert!((found.l2 - walked.l2).abs() <= n as f64 * f64::EPSILON * walked.l2);
    }

    /// A multicolour sweep is the formula of the splitting in the order of the colours, with the
    /// same operations, and rows of one colour are not coupled.
    #[test]
    fn a_multicolour_sweep_is_the_formula_in_the_order_of_the_colours(
        case in cases(),
        silent: bool,
    ) {
        let n = case.x.len();
        let (aor, backward) = (case.aor, case.aor.backward() == case.aor);
        let (a, b) = (csr::<u32>(&case.a), csr::<u32>(&case.b));
        let problem = case.problem(&a, &b);
        let coloured = Multicolour::new(aor, &problem);
        let (y, norms) = if silent {
            let walked = case.problem(Walked::new(&a), Walked::new(&b));
            taken(&coloured, &walked, &case.q, &case.x)
        } else {
            taken(&coloured, &problem, &case.q, &case.x)
        };

        // Colours by the definition: the least that no earlier neighbour has.
        let coupled = |i: usize, j: usize| {
            [&case.a, &case.b].iter().any(|m| m[(i, j)] != 0.0 || m[(j, i)] != 0.0)
        };
        let mut colours: Vec<usize> = vec![];
        for i in 0..n {
            let free = |&c: &usize| !(0..i).any(|j| coupled(i, j) && colours[j] == c);
            let least = (0..).find(free).unwrap();
            colours.push(least);
        }
        prop_assert_eq!(coloured.colours(), colours.iter().max().unwrap() + 1);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&i| (colours[i], i));
        if backward {
            order.reverse();
        }
        let [of_a, of_b] = aor.pairs();
        let (mut expected, mut largest) = (vec![f64::NAN; n], 0.0_f64);
        for (at, &i) in order.iter().enumerate() {
            let (mut f, mut moved, mut pivot) = (1.25 * case.q[i], 0.0, 0.0);
            for (matrix, [alpha, beta], sign) in [(&case.a, of_a, 1.0), (&case.b, of_b, -1.0)] {
                for j in (0..n).filter(|&j| matrix[(i, j)] != 0.0) {
                    let omega = if sign < 0.0 { case.omega.entry(j) } else { 1.0 };
                    let (entry, x) = (matrix[(i, j)] * omega, case.x[j]);
                    f += sign * (entry * (x.abs() + sign * x));
                    if order[..at].contains(&j) {
                        moved += beta / alpha * entry * (expected[j] - x);
                        if aor.is_accelerated() {
                            moved += sign * (entry * (expected[j].abs() - x.abs()));
                        }
                    }
                    pivot += if j == i { entry * alpha.recip() } else { 0.0 };
                }
            }
            expected[i] = case.x[i] - (f + moved) * pivot.recip();
            largest = largest.max(f.abs());
        }
        prop_assert_eq!(y, expected);
        prop_assert_eq!(norms.linf, largest / 1.25);
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
            FivePoint::from_fn(nx, ny, |i, j| {
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

/// A pair of order 20000 that is no grid, with rows of up to twelve entries.
fn large() -> [Csr<'static, f64>; 2] {
    [7_usize, 11].map(|seed| {
        let row = |i: usize| {
            let places = (0..6).map(|k| (i * seed + k * k * 3571 + k * i % 97) % 20_000);
            let entry = |j| if j == i { 9.0 } else { ((i * 31 + j * 17) % 13) as f64 / 13.0 - 0.5 };
            let columns: BTreeSet<usize> = places.chain([i]).collect();
            columns.into_iter().map(|j| (j, entry(j))).collect()
        };
        Csr::from_rows(&Lists((0..20_000).map(row).collect()))
    })
}

#[test]
fn multicolour_sweeps_and_residuals_have_the_same_bits_on_any_number_of_threads() {
    let [a, b] = large();
    let problem = Hlcp::new(&a, &b, Omega::Uniform(1.1)).unwrap();
    let together = problem.clone().in_parallel();
    let numbers = |rate: f64| (0..20_000).map(|i| f64::sin(rate * i as f64)).collect::<Vec<_>>();
    let (q, x) = (numbers(1.3), numbers(0.7));
    let q = Rhs::new(&q).unwrap();
    for aor in [Aor::sor(1.1).unwrap(), Aor::gauss_seidel().backward().accelerated()] {
        let coloured = Multicolour::new(aor, &problem);
        on_any_threads(|parallel| {
            let problem = if parallel { &together } else { &problem };
            let mut y = vec![f64::NAN; 20_000];
            let norms = coloured.step(problem, &q, &x, &mut y, &mut vec![]);
            let residual = problem.residual(&q, &x, &y, &mut vec![]);
            (norms, residual, y)
        });
    }
}

#[test]
fn what_is_no_grid_is_not_recognised() {
    let grid = FivePoint::new(5, 4, [-1.0, -2.0, 9.0, -3.0, -4.0]).unwrap();
    let identity = Identity { order: 20 };
    assert!(recognise_grid(&grid, &identity).is_some());
    // One entry at the edge of the grid leads to the next row of points, or far away.
    for (row, column) in [(4, 5), (0, 19), (7, 13)] {
        let mut matrix = assembled(&grid);
        matrix[(row, column)] = 0.5;
        assert!(recognise_grid(&matrix, &identity).is_none());
        let error = FivePoint::from_rows(5, 4, &matrix).unwrap_err();
        assert_eq!(error, Error::OffGrid { row, column, nx: 5, ny: 4 });
    }
    // A line is no grid of two dimensions, and two orders are no grid.
    let line = FivePoint::new(20, 1, [0.0, -2.0, 9.0, -3.0, 0.0]).unwrap();
    assert!(recognise_grid(&line, &identity).is_none());
    assert!(recognise_grid(&grid, &Identity { order: 21 }).is_none());
    let error = FivePoint::from_rows(5, 5, &grid).unwrap_err();
    assert_eq!(error, Error::Order { what: "the grid", found: 25, expected: 20 });
    let bad = DMatrix::from_diagonal_element(4, 4, f64::NAN);
    assert!(matches!(FivePoint::from_rows(2, 2, &bad), Err(Error::NotFinite { .. })));
    for [rows, columns] in [[3, 2], [2, 3]] {
        let oblong = DMatrix::from_element(rows, columns, 1.0);
        let expected = Error::NotSquare { what: "the operator", rows, columns };
        assert_eq!(FivePoint::from_rows(rows, 1, &oblong), Err(expected.clone()));
        let panic = std::panic::catch_unwind(|| Csr::from_rows(&oblong)).unwrap_err();
        assert_eq!(panic.downcast_ref(), Some(&expected.to_string()));
    }
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
        (&[0, 1, 2], &[0, 1], 3, "2 columns need as many values, but 3 are given"),
        (&[0], &[], 0, "order 0"),
        (&[], &[], 0, "order 0"),
    ] {
        let found = refused(offsets, columns, values);
        assert!(found.contains(message), "{found}");
    }
    let nan = Csr::new(vec![0_u32, 1], vec![0], Cow::Borrowed(&[f64::NAN][..])).unwrap_err();
    assert!(matches!(nan, Error::NotFinite { what: "values", index: 0, .. }));
}
