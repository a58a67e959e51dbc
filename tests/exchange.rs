//! Remark 3: HLCP(A, B, q) and HLCP(B, A, −q) have the same solutions with z and r exchanged.

mod common;

use common::{planted, posed};
use hlcp_core::{Aor, Rhs};
use hlcp_methods::{Limits, Method, Mms, Norm, Solver, Tmms};
use hlcp_verify::oracle::{Dense, aor_splitting};
use nalgebra::DVector;
use proptest::prelude::*;

proptest! {
    /// A step of the exchanged problem is Method 1 on HLCP(B, A, −q) with Ω⁻¹, built here by hand.
    #[test]
    fn a_step_is_the_papers_on_the_exchanged_data(p in planted(1..20, 1.5), alpha in 0.5..1.5) {
        let exchanged = Dense {
            a: p.dense.b.clone(),
            b: p.dense.a.clone(),
            q: -&p.dense.q,
            omega: p.dense.omega.map(f64::recip),
            gamma: p.dense.gamma,
        };
        let split = |matrix| aor_splitting(matrix, [alpha, 0.7], false);
        let textbook = exchanged.mms(split(&exchanged.a), split(&exchanged.b));
        let x = p.x().map(f64::sin);
        let expected = textbook.step(&x);

        let aor = Aor::new(alpha, 0.7).unwrap();
        let mut mms = Mms::new(posed(&p.dense).exchanged().unwrap(), aor).unwrap();
        let q = Rhs::new(p.dense.q.as_slice()).unwrap();
        let mut y = vec![f64::NAN; x.len()];
        let _ = mms.step(0, &q, x.as_slice(), &mut y);
        let scale = expected.amax().max(p.dense.q.amax()).max(1.0);
        prop_assert!((DVector::from_vec(y) - expected).amax() <= 1e-12 * scale);
    }

    /// z and r of the problem as posed come back, and are measured in it; exchanging twice is no exchange.
    #[test]
    fn the_solution_is_that_of_the_problem_as_posed(p in planted(1..20, 0.15)) {
        let limits = Limits { norm: Norm::LInf, ..Limits::default() };
        let exchanged = posed(&p.dense).exchanged().unwrap();
        let twice = exchanged.clone().exchanged().unwrap();
        let start = vec![0.4; p.z.len()];
        let mut one = Solver::new(Tmms::mirrored(exchanged, Aor::gauss_seidel()).unwrap());
        let mut two = Solver::new(Tmms::mirrored(twice, Aor::gauss_seidel()).unwrap());
        let outcomes = [
            one.solve(p.dense.q.as_slice(), &start, &limits).unwrap(),
            two.solve(p.dense.q.as_slice(), &start, &limits).unwrap(),
        ];
        for (outcome, z, r) in [(outcomes[0], one.z(), one.r()), (outcomes[1], two.z(), two.r())] {
            prop_assert!(outcome.converged());
            let (z, r) = (DVector::from_column_slice(z), DVector::from_column_slice(r));
            let residual = &p.dense.a * &z - &p.dense.b * &r + &p.dense.q;
            prop_assert!((residual.amax() - outcome.residual.linf).abs() <= 1e-12 * p.dense.q.amax());
            // The margin of tests/planted.rs, for the problem as posed.
            prop_assert!((&z - &p.z).amax() <= 1e-10 / 0.025);
            prop_assert!((&r - &p.r).amax() <= 2.5 * 1e-10 / 0.025);
        }
    }

    /// x from (z, r) and (z, r) from x undo each other, exchanged or not.
    #[test]
    fn a_solution_becomes_a_start(p in planted(1..20, 0.15)) {
        for problem in [posed(&p.dense), posed(&p.dense).exchanged().unwrap()] {
            let n = p.z.len();
            let [mut x, mut z, mut r] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            problem.modulus(p.z.as_slice(), p.r.as_slice(), &mut x);
            problem.recover(&x, &mut z, &mut r);
            for i in 0..n {
                prop_assert!((z[i] - p.z[i]).abs() <= 4.0 * f64::EPSILON * p.z[i]);
                prop_assert!((r[i] - p.r[i]).abs() <= 4.0 * f64::EPSILON * p.r[i]);
            }
            let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
            let outcome = solver.solve(p.dense.q.as_slice(), &x, &Limits::default()).unwrap();
            prop_assert_eq!(outcome.iterations, 0);
        }
    }
}
