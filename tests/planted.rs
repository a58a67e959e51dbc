//! The methods reach the planted solution, which enumeration finds to be the only one.

mod common;

use common::{planted, posed};
use hlcp_core::{Aor, Jacobi};
use hlcp_methods::{Amms, Limits, Method, Mms, Norm, Options, Solver, Tmms};
use hlcp_verify::Planted;
use proptest::prelude::*;

/// Rows of both matrices sum to at most this off the diagonal. The diagonals of A and BΩ are at least 0.4 and
/// Ω at most 2.5, so min(aᵢᵢ, ωᵢbᵢᵢ) exceeds the sum of max(|aᵢⱼ|, ωⱼ|bᵢⱼ|) by at least `MARGIN`: the solution
/// is unique, and an x is off by at most ‖F(x)‖∞/(2 MARGIN).
const WEIGHT: f64 = 0.15;
const MARGIN: f64 = 0.4 - 2.5 * WEIGHT;

fn reaches(method: impl Method<f64>, p: &Planted) -> Result<(), TestCaseError> {
    let limits = Limits { norm: Norm::LInf, ..Limits::absolute(1e-10) };
    let mut solver = Solver::new(method);
    let start = vec![-0.7; p.z.len()];
    let outcome =
        solver.solve(p.dense.q.as_slice(), Options::from_x(&start).limits(limits)).unwrap();
    prop_assert!(outcome.converged(), "{:?}", outcome);
    // ‖F‖∞ = γ·residual, and z and r are 2/γ and 2ω/γ times as sensitive as x.
    let off = outcome.residual.linf.max(f64::EPSILON * p.dense.q.amax()) / MARGIN;
    for i in 0..p.z.len() {
        prop_assert!((solver.z()[i] - p.z[i]).abs() <= off);
        prop_assert!((solver.r()[i] - p.r[i]).abs() <= 2.5 * off);
    }
    Ok(())
}

proptest! {
    #[test]
    fn every_method_reaches_the_only_solution(
        p in planted(1..8, WEIGHT),
        alpha in 0.4..1.0,
        lag in 0.0..1.0,
    ) {
        for (z, r) in p.dense.solutions() {
            prop_assert!((z - &p.z).amax() <= 1e-11 * p.dense.q.amax().max(1.0) / MARGIN);
            prop_assert!((r - &p.r).amax() <= 1e-11 * p.dense.q.amax().max(1.0) / MARGIN);
        }
        prop_assert!(!p.dense.solutions().is_empty());

        let problem = || posed(&p.dense);
        let (gs, aor) = (Aor::gauss_seidel(), Aor::new(alpha, lag * alpha).unwrap());
        reaches(Mms::new(problem(), Jacobi).unwrap(), &p)?;
        reaches(Mms::new(problem(), gs).unwrap(), &p)?;
        reaches(Mms::new(problem(), aor.backward()).unwrap(), &p)?;
        reaches(Amms::new(problem(), gs).unwrap(), &p)?;
        reaches(Amms::new(problem(), aor).unwrap(), &p)?;
        reaches(Tmms::mirrored(problem(), aor).unwrap(), &p)?;
        reaches(Tmms::new(problem(), gs, Jacobi).unwrap(), &p)?;
    }
}
