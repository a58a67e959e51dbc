//! Remark 3: HLCP(A, B, q) and HLCP(B, A, −q) have the same solutions with z and r exchanged.

use crate::common::{exchanged, from, planted, posed};
use hlcp_core::{Aor, Rhs};
use hlcp_methods::{Clock, Method, Mms, Solver};
use hlcp_verify::oracle::aor_splitting;
use nalgebra::DVector;
use proptest::prelude::*;

proptest! {
    /// A step of the exchanged problem is Method 1 on HLCP(B, A, −q) with Ω⁻¹, built here by hand.
    #[test]
    fn a_step_is_the_papers_on_the_exchanged_data(p in planted(1..20, 1.5), alpha in 0.5..1.5) {
        let exchanged = exchanged(&p.dense);
        let split = |matrix| aor_splitting(matrix, [alpha, 0.7], false);
        let textbook = exchanged.mms(split(&exchanged.a), split(&exchanged.b));
        let x = p.x().map(f64::sin);
        let expected = textbook.step(&x);

        let aor = Aor::new(alpha, 0.7).unwrap();
        let mut mms = Mms::new(posed(&p.dense).exchanged().unwrap(), aor).unwrap();
        let q = Rhs::new(p.dense.q.as_slice()).unwrap();
        let mut y = vec![f64::NAN; x.len()];
        let _ = mms.step(&q, x.as_slice(), &mut y, &mut Clock::endless());
        let scale = expected.amax().max(p.dense.q.amax()).max(1.0);
        prop_assert!((DVector::from_vec(y) - expected).amax() <= 1e-12 * scale);
    }

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
