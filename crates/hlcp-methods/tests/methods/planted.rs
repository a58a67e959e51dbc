//! The methods reach the planted solution, which enumeration finds to be the only one.

use crate::common::{largest_difference, planted, posed, tmgs};
use hlcp_core::{Aor, Jacobi, Scalar, SplittingStep};
use hlcp_methods::{
    Anderson, Jacobian, Limits, Method, Mms, Newton, Norm, Options, Preconditioner, Solver, Ssor,
    Tmms, TridiagonalPart,
};
use hlcp_verify::Planted;
use nalgebra::{DMatrix, DVector};
use proptest::{collection::vec, prelude::*};

/// Rows of both matrices sum to at most this off the diagonal. The diagonals of A and BΩ are at
/// least 0.4 and Ω at most 2.5, so min(aᵢᵢ, ωᵢbᵢᵢ) exceeds the sum of max(|aᵢⱼ|, ωⱼ|bᵢⱼ|) by at
/// least `MARGIN`: the solution is unique, and an x is off by at most ‖F(x)‖∞/(2 MARGIN).
const WEIGHT: f64 = 0.15;
const MARGIN: f64 = 0.4 - 2.5 * WEIGHT;

type Boxed = Box<dyn Method<f64, A = DMatrix<f64>, B = DMatrix<f64>>>;

/// Solves a problem of [`planted`] with this `WEIGHT`, as posed or exchanged: it must end at the
/// planted solution, with the residual in the problem as posed.
fn reaches(method: Boxed, p: &Planted, start: &[f64]) -> Result<(), TestCaseError> {
    let limits = Limits { norm: Norm::LInf, ..Limits::absolute(1e-10) };
    let mut solver = Solver::new(method);
    let outcome =
        solver.solve(p.dense.q.as_slice(), Options::from_x(start).limits(limits)).unwrap();
    prop_assert!(outcome.converged(), "{}", outcome);
    let [z, r] = [solver.z(), solver.r()].map(DVector::from_column_slice);
    let residual = &p.dense.a * &z - &p.dense.b * &r + &p.dense.q;
    let apart = (residual.amax() - outcome.residual.linf).abs();
    prop_assert!(apart <= 1e-12 * p.dense.q.amax(), "{}", apart);
    // ‖F‖∞ = γ·residual, and z and r are 2/γ and 2ω/γ times as sensitive as x.
    let off = outcome.residual.linf.max(f64::EPSILON * p.dense.q.amax()) / MARGIN;
    prop_assert!(largest_difference(solver.z(), p.z.as_slice()) <= off);
    prop_assert!(largest_difference(solver.r(), p.r.as_slice()) <= 2.5 * off);
    Ok(())
}

/// Ends in `y = NaN`.
struct Broken;

impl<T: Scalar, A, B> Preconditioner<T, A, B> for Broken {
    fn solve(&mut self, _: &Jacobian<'_, T, A, B>, _: &[T], y: &mut [T]) {
        y.fill(T::nan());
    }
}

proptest! {
    #[test]
    fn enumeration_finds_the_planted_solution_alone(p in planted(1..8, WEIGHT)) {
        let solutions = p.dense.solutions();
        prop_assert!(!solutions.is_empty());
        for (z, r) in solutions {
            prop_assert!((z - &p.z).amax() <= 1e-11 * p.dense.q.amax().max(1.0) / MARGIN);
            prop_assert!((r - &p.r).amax() <= 1e-11 * p.dense.q.amax().max(1.0) / MARGIN);
        }
    }

    /// From any start, for the problem as posed and exchanged (Remark 3), and by Newton's method
    /// with any preconditioner.
    #[test]
    fn every_method_reaches_the_planted_solution(
        p in planted(1..24, WEIGHT),
        alpha in 0.4..1.0,
        lag in 0.0..1.0,
        window in 1..12_usize,
        x0 in vec(-9.0..9.0, 24),
    ) {
        let (gs, aor) = (Aor::gauss_seidel(), Aor::new(alpha, lag * alpha).unwrap());
        let exchanged = posed(&p.dense).exchanged().unwrap();
        for posed in [posed(&p.dense), exchanged.clone().exchanged().unwrap(), exchanged] {
            let problem = || posed.clone();
            let none = |rhs: &[f64], y: &mut [f64]| y.copy_from_slice(rhs);
            let methods: [Boxed; 12] = [
                Box::new(Mms::new(problem(), Jacobi).unwrap()),
                Box::new(Mms::new(problem(), gs).unwrap()),
                Box::new(Mms::new(problem(), aor.backward()).unwrap()),
                Box::new(Mms::new(problem(), gs.accelerated()).unwrap()),
                Box::new(Mms::new(problem(), aor.accelerated()).unwrap()),
                Box::new(Tmms::mirrored(problem(), aor).unwrap()),
                Box::new(Tmms::new(problem(), gs, Jacobi).unwrap()),
                Box::new(Anderson::new(tmgs(problem()), window).unwrap()),
                Box::new(Newton::new(tmgs(problem()), Ssor)),
                Box::new(Newton::new(tmgs(problem()), TridiagonalPart::new())),
                Box::new(Newton::new(tmgs(problem()), SplittingStep(none))),
                Box::new(Newton::new(tmgs(problem()), Broken)),
            ];
            for method in methods {
                reaches(method, &p, &x0[..p.z.len()])?;
            }
        }
    }
}
