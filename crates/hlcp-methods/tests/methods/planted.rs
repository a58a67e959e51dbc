//! The methods reach the planted solution, which enumeration finds to be the only one.

use crate::common::{largest_difference, planted, posed};
use hlcp_core::{Aor, Jacobi};
use hlcp_methods::{Limits, Method, Mms, Norm, Options, Solver, Tmms};
use hlcp_verify::Planted;
use proptest::prelude::*;

/// Rows of both matrices sum to at most this off the diagonal. The diagonals of A and BΩ are at
/// least 0.4 and Ω at most 2.5, so min(aᵢᵢ, ωᵢbᵢᵢ) exceeds the sum of max(|aᵢⱼ|, ωⱼ|bᵢⱼ|) by at
/// least `MARGIN`: the solution is unique, and an x is off by at most ‖F(x)‖∞/(2 MARGIN).
pub(crate) const WEIGHT: f64 = 0.15;
const MARGIN: f64 = 0.4 - 2.5 * WEIGHT;

/// Solves a problem of [`planted`] with this `WEIGHT`, as posed or exchanged: it must end at the
/// planted solution. Returns the sweeps and the iteration of the answer.
pub(crate) fn reaches(
    method: impl Method<f64>,
    p: &Planted,
    start: &[f64],
) -> Result<[usize; 2], TestCaseError> {
    let limits = Limits { norm: Norm::LInf, ..Limits::absolute(1e-10) };
    let mut solver = Solver::new(method);
    let outcome =
        solver.solve(p.dense.q.as_slice(), Options::from_x(start).limits(limits)).unwrap();
    prop_assert!(outcome.converged(), "{}", outcome);
    // ‖F‖∞ = γ·residual, and z and r are 2/γ and 2ω/γ times as sensitive as x.
    let off = outcome.residual.linf.max(f64::EPSILON * p.dense.q.amax()) / MARGIN;
    prop_assert!(largest_difference(solver.z(), p.z.as_slice()) <= off);
    prop_assert!(largest_difference(solver.r(), p.r.as_slice()) <= 2.5 * off);
    Ok([outcome.sweeps, outcome.answer])
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

        let (problem, start) = (|| posed(&p.dense), vec![-0.7; p.z.len()]);
        let (gs, aor) = (Aor::gauss_seidel(), Aor::new(alpha, lag * alpha).unwrap());
        reaches(Mms::new(problem(), Jacobi).unwrap(), &p, &start)?;
        reaches(Mms::new(problem(), gs).unwrap(), &p, &start)?;
        reaches(Mms::new(problem(), aor.backward()).unwrap(), &p, &start)?;
        reaches(Mms::new(problem(), gs.accelerated()).unwrap(), &p, &start)?;
        reaches(Mms::new(problem(), aor.accelerated()).unwrap(), &p, &start)?;
        reaches(Tmms::mirrored(problem(), aor).unwrap(), &p, &start)?;
        reaches(Tmms::new(problem(), gs, Jacobi).unwrap(), &p, &start)?;
    }
}
