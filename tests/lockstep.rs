//! The library's iterates are the paper's, in lockstep with the dense textbook iterations.

mod common;

use common::{permuted, planted, posed, red_black, textbook};
use hlcp_core::{Aor, Jacobi, Rhs, Step};
use hlcp_methods::{Clock, Method, Mms, Tmms};
use hlcp_verify::{Planted, oracle::Iteration};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const ITERATIONS: usize = 12;

/// Jacobi, Gauss–Seidel, SOR, AOR, and AOR with own parameters for A and B, in both directions.
fn parameters() -> impl Strategy<Value = Aor<f64>> {
    let alpha = || 0.5..1.6;
    let beta = || -0.3..1.8;
    let pair = prop_oneof![
        Just([[1.0, 0.0]; 2]),
        Just([[1.0, 1.0]; 2]),
        alpha().prop_map(|alpha| [[alpha, alpha]; 2]),
        (alpha(), beta()).prop_map(|(alpha, beta)| [[alpha, beta]; 2]),
        (alpha(), beta(), alpha(), beta()).prop_map(|(a, b, c, d)| [[a, b], [c, d]]),
    ];
    (pair, any::<bool>()).prop_map(|([a, b], backward)| {
        let aor = Aor::with_pairs(a, b).expect("generators make valid parameters");
        let aor = if backward { aor.backward() } else { aor };
        for (step, is_fast) in [(aor, false), (aor.accelerated(), true)] {
            // By these the textbook knows a step.
            let known = (step.pairs(), step.precedes(1, 0), step.is_accelerated());
            assert_eq!(known, ([a, b], backward, is_fast));
        }
        aor
    })
}

/// A problem with a start.
fn begun() -> impl Strategy<Value = (Planted, DVector<f64>)> {
    (planted(1..41, 1.5), -3.0..3.0).prop_map(|(p, start)| {
        let start = p.x().map(|x| x.sin() + start);
        (p, start)
    })
}

/// A bound on the distance of two computations of one iterate, carried from step to step.
///
/// The exact map moves an old distance by at most `contraction()`; rounding adds at most
/// `⟨M⟩⁻¹` times `(2n + 16)` roundings of terms that together are no larger than `size`.
struct Drift(f64);

impl Drift {
    fn step(&mut self, textbook: &Iteration, x: &DVector<f64>, next: &DVector<f64>) {
        let n = x.len();
        let ones = DVector::from_element(n, 1.0);
        let unit = Iteration { from_x: DMatrix::identity(n, n), ..textbook.clone() };
        let unit = Iteration { from_modulus: DMatrix::zeros(n, n), ..unit };
        let inverse = (unit.contraction() * &ones).amax();
        let size = ((textbook.from_x.abs() + textbook.from_modulus.abs() + textbook.linear.abs())
            * x.abs()
            * 2.0
            + (textbook.linear.abs() + textbook.modulus.abs()) * (next.abs() + x.abs())
            + textbook.constant.abs())
        .amax();
        let rounding = (2 * n + 16) as f64 * f64::EPSILON * inverse * size;
        self.0 = (textbook.contraction() * ones).amax() * self.0 + rounding;
    }
}

fn natural(of: &DVector<f64>) -> Vec<usize> {
    (0..of.len()).collect()
}

/// Runs a method beside its textbook steps for the unknowns in an order, each from its iterates.
fn lockstep(
    order: &[usize],
    method: &mut impl Method<f64>,
    textbook: &[Iteration],
    q: &DVector<f64>,
    start: &DVector<f64>,
) -> Result<(), TestCaseError> {
    let q = Rhs::new(q.as_slice()).expect("q is finite");
    let (mut x, mut y) = (start.as_slice().to_vec(), vec![f64::NAN; start.len()]);
    let (mut exact, mut drift) = (start.select_rows(order), Drift(0.0));
    for _ in 0..ITERATIONS {
        let _ = method.step(&q, &x, &mut y, &mut Clock::endless());
        let half = y.clone();
        // What is in the spare vector is never read.
        x.fill(f64::NAN);
        method.complete(&q, &mut y, &mut x);
        prop_assert!(textbook.len() == 2 || half == y, "one step, which is complete");
        for (textbook, iterate) in textbook.iter().zip([half, y.clone()]) {
            let next = textbook.step(&exact);
            drift.step(textbook, &exact, &next);
            let distance = (DVector::from_vec(iterate).select_rows(order) - &next).amax();
            prop_assert!(distance <= drift.0, "{distance:e} > {:e}", drift.0);
            exact = next;
        }
        std::mem::swap(&mut x, &mut y);
    }
    let sweeps = method.work().map_or(ITERATIONS, |work| work.sweeps);
    prop_assert_eq!(sweeps, ITERATIONS * textbook.len());
    Ok(())
}

proptest! {
    /// By rows, and Jacobi by the diagonal; and AMMS is the accelerated method of section 4.
    #[test]
    fn mms_is_method_1((p, start) in begun(), aor in parameters()) {
        for step in [aor, aor.accelerated()] {
            let book = [textbook(&p.dense, &step)];
            let mut mms = Mms::new(posed(&p.dense), step).unwrap();
            lockstep(&natural(&start), &mut mms, &book, &p.dense.q, &start)?;
        }
        let book = [p.dense.mms([1.0, 0.0], [1.0, 0.0], false)];
        let mut mms = Mms::new(posed(&p.dense), Jacobi).unwrap();
        lockstep(&natural(&start), &mut mms, &book, &p.dense.q, &start)?;
    }

    #[test]
    fn tmms_is_method_2(
        (p, start) in begun(),
        first in parameters(),
        second in parameters(),
    ) {
        let book = [first, second].map(|step| textbook(&p.dense, &step));
        let mut tmms = Tmms::new(posed(&p.dense), first, second).unwrap();
        lockstep(&natural(&start), &mut tmms, &book, &p.dense.q, &start)?;
    }

    /// In red–black order the methods are the textbook's on permuted matrices, whatever couples the
    /// points.
    #[test]
    fn red_black_order_is_a_permutation(
        (p, start) in begun(),
        nx in 1..9_usize,
        aor in parameters(),
    ) {
        let order = red_black(p.dense.q.len(), nx);
        let sorted = permuted(&p.dense, &order);
        for step in [aor, aor.accelerated()] {
            let mut method = Mms::new(posed(&p.dense), step.red_black(nx).unwrap()).unwrap();
            lockstep(&order, &mut method, &[textbook(&sorted, &step)], &p.dense.q, &start)?;
        }
    }

    /// The norms a step returns are those of A z − B r + q at its input, by the paper's
    /// definitions.
    #[test]
    fn a_step_measures_its_input((p, x) in begun(), aor in parameters()) {
        let z = (x.abs() + &x) / p.dense.gamma;
        let r = (x.abs() - &x).component_mul(&p.dense.omega) / p.dense.gamma;
        let residual = &p.dense.a * &z - &p.dense.b * &r + &p.dense.q;
        let size = &p.dense.a.abs() * &z + &p.dense.b.abs() * &r + p.dense.q.abs();
        let rounding = (2 * x.len() + 16) as f64 * f64::EPSILON * size.norm();

        let (problem, q) = (posed(&p.dense), Rhs::new(p.dense.q.as_slice()).unwrap());
        let (mut y, mut scratch) = (vec![f64::NAN; x.len()], vec![]);
        let accelerated = aor.accelerated();
        let steps: [&dyn Step<f64, DMatrix<f64>, DMatrix<f64>>; 3] = [&aor, &accelerated, &Jacobi];
        let mut all = steps.map(|s| s.step(&problem, &q, x.as_slice(), &mut y, &mut scratch)).to_vec();
        all.push(problem.residual(&q, z.as_slice(), r.as_slice(), &mut scratch));
        for norms in all {
            prop_assert!((norms.l2 - residual.norm()).abs() <= rounding);
            prop_assert!((norms.linf - residual.amax()).abs() <= rounding);
        }
    }

    /// Mirrored means forward first, whatever direction it was given.
    #[test]
    fn mirrored_means_forward_and_then_backward(p in planted(1..41, 1.5), alpha in 0.5..1.6) {
        let aor = Aor::new(alpha, 0.7).unwrap();
        let (x, q) = (p.x().map(f64::cos), Rhs::new(p.dense.q.as_slice()).unwrap());
        let steps = [
            Tmms::new(posed(&p.dense), aor, aor.backward()),
            Tmms::mirrored(posed(&p.dense), aor),
            Tmms::mirrored(posed(&p.dense), aor.backward()),
        ].map(|method| {
            let (mut method, mut y) = (method.unwrap(), vec![0.0; x.len()]);
            let _ = method.step(&q, x.as_slice(), &mut y, &mut Clock::endless());
            let first = y.clone();
            method.complete(&q, &mut y, &mut vec![0.0; x.len()]);
            (first, y)
        });
        prop_assert!(steps[0] == steps[1] && steps[0] == steps[2]);
    }
}
