//! Five-point operators take a path of their own; it must lead where the walk over the rows leads.

use crate::{
    common::Walked,
    rows::{aors, omegas, taken},
};
use hlcp_core::{Aor, DiagonalMatrix, FivePoint, Hlcp, Norms, Omega, Rhs, Rows, Step, Varying};
use proptest::{collection::vec, prelude::*};

/// Everything a step depends on, except the operators' types.
#[derive(Debug, Clone)]
struct Case {
    nx: usize,
    ny: usize,
    a: Vec<[f64; 5]>,
    b: Vec<[f64; 5]>,
    omega: Omega<f64>,
    gamma: f64,
    q: Vec<f64>,
    x: Vec<f64>,
    aor: Aor<f64>,
    /// Whether z and r change roles (Remark 3).
    exchanged: bool,
    round: [bool; 2],
}

/// A row whose neighbours weigh less than its centre; zeros are frequent.
fn row() -> impl Strategy<Value = [f64; 5]> {
    let off = || prop_oneof![3 => -1.0..1.0, 1 => Just(0.0)];
    (off(), off(), 3.0..6.0, off(), off()).prop_map(|(s, w, c, e, n)| [s, w, c, e, n])
}

/// Grids around the sizes of the sweep's blocks.
fn sides() -> impl Strategy<Value = (usize, usize)> {
    let side = || prop_oneof![Just(1_usize), 2..20_usize, 60..75_usize];
    prop_oneof![8 => (side(), side()), 1 => (505..530_usize, 8..12_usize)]
}

fn cases() -> impl Strategy<Value = Case> {
    sides().prop_flat_map(|(nx, ny)| {
        let n = nx * ny;
        let rows = move || prop_oneof![row().prop_map(move |row| std::vec![row; n]), vec(row(), n)];
        let numbers = move || vec(-3.0..3.0, n);
        let more = (aors(Just(nx)), any::<[bool; 3]>());
        ((rows(), rows(), omegas(n), 0.5..4.0, numbers(), numbers()), more).prop_map(
            move |((a, b, omega, gamma, q, x), (aor, [exchanged, round_x, round_y]))| {
                let round = [round_x && nx >= 3, round_y && ny >= 3];
                Case { nx, ny, a, b, omega, gamma, q, x, aor, exchanged, round }
            },
        )
    })
}

impl Case {
    fn operator(&self, rows: &[[f64; 5]]) -> FivePoint<Varying<f64>> {
        let grid = FivePoint::from_fn(self.nx, self.ny, |i, j| rows[j * self.nx + i]);
        grid.unwrap().periodic(self.round).unwrap()
    }

    fn step<A: Rows<f64>, B: Rows<f64>>(&self, a: A, b: B) -> (Vec<f64>, Norms) {
        let problem = Hlcp::new(a, b, self.omega.clone()).unwrap().with_gamma(self.gamma).unwrap();
        if self.exchanged {
            taken(&self.aor, &problem.exchanged().unwrap(), &self.q, &self.x)
        } else {
            taken(&self.aor, &problem, &self.q, &self.x)
        }
    }

    /// How far two computations of the step may be apart in each entry, and in the 2-norm of `F/γ`.
    ///
    /// Each of the at most 64 operations behind an entry rounds by half an ε of at most `size`, the
    /// sum of the moduli of all terms, carried through 1/m; both computations do. An error of a
    /// passed value enters with its factor in the recurrence.
    fn rounding(&self, y: &[f64]) -> (Vec<f64>, f64) {
        let (n, [of_a, of_b]) = (self.x.len(), self.aor.pairs());
        let (a, b) = (self.operator(&self.a), self.operator(&self.b));
        let mut bound = vec![0.0; n];
        let mut squares = 0.0;
        let mut order: Vec<usize> = (0..n).collect();
        // That of the sweep.
        order.sort_by(|&i, &j| self.aor.precedes(j, i).cmp(&self.aor.precedes(i, j)));
        for k in order {
            let pivot = self.a[k][2] / of_a[0] + self.b[k][2] * self.omega.entry(k) / of_b[0];
            let (mut of_defect, mut size, mut inherited) = (self.gamma * self.q[k].abs(), 0.0, 0.0);
            let mut see = |[alpha, beta]: [f64; 2], at: usize, entry: f64| {
                of_defect += 2.0 * entry * self.x[at].abs();
                if self.aor.precedes(at, k) {
                    let modulus = if self.aor.is_accelerated() { 1.0 } else { 0.0 };
                    let factor = ((beta / alpha).abs() + modulus) * entry;
                    size += factor * (self.x[at].abs() + y[at].abs());
                    inherited += factor * bound[at];
                }
            };
            a.visit_row(k, &mut |at, a| see(of_a, at, a.abs()));
            b.visit_row(k, &mut |at, b| see(of_b, at, b.abs() * self.omega.entry(at)));
            size += of_defect + pivot * (self.x[k].abs() + y[k].abs());
            bound[k] = (64.0 * f64::EPSILON * size + inherited) / pivot;
            squares += of_defect * of_defect;
        }
        (bound, (64 + n) as f64 * f64::EPSILON * squares.sqrt() / self.gamma)
    }
}

fn agree(
    case: &Case,
    fused: (Vec<f64>, Norms),
    walked: (Vec<f64>, Norms),
) -> Result<(), TestCaseError> {
    let inverse = |case: &Case| (0..case.x.len()).map(|i| case.omega.entry(i).recip()).collect();
    let (bound, norm_bound) = if case.exchanged {
        let (a, b, omega) = (case.b.clone(), case.a.clone(), Omega::Each(inverse(case)));
        Case { a, b, omega, ..case.clone() }.rounding(&walked.0)
    } else {
        case.rounding(&walked.0)
    };
    for (k, (fused, walked)) in fused.0.iter().zip(&walked.0).enumerate() {
        let distance = (fused - walked).abs();
        prop_assert!(distance <= bound[k], "entry {k}: {distance:e} > {:e}", bound[k]);
    }
    prop_assert!((fused.1.l2 - walked.1.l2).abs() <= norm_bound);
    prop_assert!((fused.1.linf - walked.1.linf).abs() <= norm_bound);
    Ok(())
}

proptest! {
    /// MMS and AMMS, both directions, all parameters, any grid, constant and varying coefficients,
    /// as posed and exchanged.
    #[test]
    fn the_fused_sweep_is_the_walk(case in cases()) {
        let (a, b) = (case.operator(&case.a), case.operator(&case.b));
        let walked = case.step(Walked::new(&a), Walked::new(&b));
        agree(&case, case.step(a, b), walked)?;
    }

    /// The linear complementarity problem, B diagonal, keeps the fast path.
    #[test]
    fn diagonal_operators_fit_any_grid(case in cases()) {
        let a = case.operator(&case.a);
        let b = || DiagonalMatrix::new(case.b.iter().map(|row| row[2]).collect()).unwrap();
        let walked = case.step(Walked::new(&a), Walked::new(b()));
        let diagonal = case.b.iter().map(|row| [0.0, 0.0, row[2], 0.0, 0.0]).collect();
        agree(&Case { b: diagonal, ..case.clone() }, case.step(&a, b()), walked)?;
    }

    /// The residual in one pass is the one by products.
    #[test]
    fn residuals_agree(case in cases()) {
        let (a, b) = (case.operator(&case.a), case.operator(&case.b));
        let (z, r): (Vec<f64>, Vec<f64>) = case.x.iter().map(|x| (x.abs() + x, x.abs() - x)).unzip();
        let q = Rhs::new(&case.q).unwrap();
        let mut scratch = vec![];
        let fused = Hlcp::new(&a, &b, Omega::Uniform(1.0)).unwrap();
        let fused = fused.residual(&q, &z, &r, &mut scratch);
        prop_assert!(scratch.is_empty(), "no scratch");
        let walked = Hlcp::new(Walked::new(&a), Walked::new(&b), Omega::Uniform(1.0)).unwrap();
        let walked = walked.residual(&q, &z, &r, &mut scratch);
        // Entry by entry the same operations: only the squares are summed in another order.
        prop_assert_eq!(fused.linf, walked.linf);
        prop_assert!((fused.l2 - walked.l2).abs() <= q.entries().len() as f64 * f64::EPSILON * walked.l2);
    }
}

/// Two grids of one order are two numberings: the pair must not be swept as if on one.
#[test]
fn operators_on_different_grids_are_walked() {
    let rows = |nx, ny| FivePoint::new(nx, ny, [-1.0, -0.5, 5.0, 0.25, 0.75]).unwrap();
    let (a, b) = (rows(6, 4), rows(4, 6));
    let q: Vec<f64> = (0..24).map(|i| f64::sin(i as f64)).collect();
    let x: Vec<f64> = (0..24).map(|i| f64::cos(i as f64)).collect();
    let aor = Aor::new(1.2, 0.9).unwrap();
    let shown = Hlcp::new(a, b, Omega::Uniform(1.5)).unwrap();
    let walked = Hlcp::new(Walked::new(a), Walked::new(b), Omega::Uniform(1.5)).unwrap();
    assert_eq!(taken(&aor, &shown, &q, &x), taken(&aor, &walked, &q, &x));
}

/// What is not finite shows in both norms.
#[test]
fn nan_and_overflow_show_in_the_norms() {
    let a = FivePoint::new(9, 9, [-1.0, -1.0, 5.0, -1.0, -1.0]).unwrap();
    let problem = Hlcp::new(a, a, Omega::Uniform(1.0)).unwrap();
    let (q, mut y) = (vec![1.0; 81], vec![0.0; 81]);
    let q = Rhs::new(&q).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for at in [0, 40, 80] {
            let mut x = vec![0.5; 81];
            x[at] = bad;
            let norms = Aor::gauss_seidel().step(&problem, &q, &x, &mut y, &mut vec![]);
            assert!(!norms.l2.is_finite() && !norms.linf.is_finite(), "{bad} at {at}: {norms:?}");
        }
    }
}
