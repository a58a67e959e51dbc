//! Remark 3: HLCP(A, B, q) and HLCP(B, A, −q) have the same solutions with z and r exchanged.

use crate::common::{from, planted, posed};
use hlcp_core::Aor;
use hlcp_methods::{Mms, Solver};
use proptest::prelude::*;

proptest! {
    /// x from (z, r) and (z, r) from x undo each other, exchanged or not.
    #[test]
    fn a_solution_becomes_a_start(p in planted(1..20, 0.15)) {
        for problem in [posed(&p.dense), posed(&p.dense).exchanged().unwrap()] {
            let n = p.z.len();
            let [mut x, mut z, mut r] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            problem.x_from_solution(p.z.as_slice(), p.r.as_slice(), &mut x);
            problem.solution_from_x(&x, &mut z, &mut r);
            for i in 0..n {
                prop_assert!((z[i] - p.z[i]).abs() <= 4.0 * f64::EPSILON * p.z[i]);
                prop_assert!((r[i] - p.r[i]).abs() <= 4.0 * f64::EPSILON * p.r[i]);
            }
            let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
            let outcome = solver.solve(p.dense.q.as_slice(), from(&x)).unwrap();
            prop_assert_eq!(outcome.iterations, 0);
        }
    }
}
