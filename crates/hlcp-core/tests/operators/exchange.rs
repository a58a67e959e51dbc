//! Remark 3: HLCP(A, B, q) and HLCP(B, A, −q) have the same solutions with z and r exchanged.

use crate::common::{Matrix, assembled, exchanged, from, planted, posed, tmgs};
use hlcp_core::{Aor, FivePoint, Hlcp, Omega, Rhs};
use hlcp_methods::{Clock, Limits, Method, Mms, Norm, Options, Solver};
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

    /// z and r of the problem as posed come back, and are measured in it; exchanging twice is no
    /// exchange.
    #[test]
    fn the_solution_is_that_of_the_problem_as_posed(p in planted(1..20, 0.15)) {
        let limits = Limits { norm: Norm::LInf, ..Limits::absolute(1e-10) };
        let exchanged = posed(&p.dense).exchanged().unwrap();
        let twice = exchanged.clone().exchanged().unwrap();
        let start = vec![0.4; p.z.len()];
        let mut one = Solver::new(tmgs(exchanged));
        let mut two = Solver::new(tmgs(twice));
        let outcomes = [
            one.solve(p.dense.q.as_slice(), Options::from_x(&start).limits(limits)).unwrap(),
            two.solve(p.dense.q.as_slice(), Options::from_x(&start).limits(limits)).unwrap(),
        ];
        for (outcome, z, r) in [(outcomes[0], one.z(), one.r()), (outcomes[1], two.z(), two.r())] {
            prop_assert!(outcome.converged());
            let (z, r) = (DVector::from_column_slice(z), DVector::from_column_slice(r));
            let residual = &p.dense.a * &z - &p.dense.b * &r + &p.dense.q;
            prop_assert!((residual.amax() - outcome.residual.linf).abs() <= 1e-12 * p.dense.q.amax());
            // The margin of `planted.rs` among the tests of the methods, for the problem as posed.
            prop_assert!((&z - &p.z).amax() <= 1e-10 / 0.025);
            prop_assert!((&r - &p.r).amax() <= 2.5 * 1e-10 / 0.025);
        }
    }

    /// What the fused sweeps make of an exchanged pair of stencils, the walk over the same rows
    /// makes too.
    #[test]
    fn stencils_are_exchanged_as_matrices_are(
        a in prop::array::uniform5(-1.0..-0.1),
        b in prop::array::uniform5(-1.0..-0.1),
        omega in 0.9..1.1,
        alpha in 0.5..1.3,
    ) {
        let stencil = |mut c: [f64; 5]| {
            c[2] = 5.0 - c[2];
            FivePoint::new(5, 4, c).unwrap()
        };
        let (a, b) = (stencil(a), stencil(b));
        let dense = |operator: &FivePoint<f64>| Matrix(assembled(operator));
        let aor = Aor::new(alpha, 0.7).unwrap();
        let omega = Omega::Uniform(omega);
        let stencils = Hlcp::new(a, b, omega.clone()).unwrap().with_gamma(1.4).unwrap();
        let matrices = Hlcp::new(dense(&a), dense(&b), omega).unwrap().with_gamma(1.4).unwrap();
        let q: Vec<f64> = (0..20).map(|i| f64::sin(1.7 * i as f64) + 0.1).collect();
        let mut one = Solver::new(Mms::new(stencils.exchanged().unwrap(), aor.accelerated()).unwrap());
        let mut two = Solver::new(Mms::new(matrices.exchanged().unwrap(), aor.accelerated()).unwrap());
        let outcomes = [
            one.solve(&q, from(&[0.3; 20])).unwrap(),
            two.solve(&q, from(&[0.3; 20])).unwrap(),
        ];
        prop_assert!(outcomes[0].converged() && outcomes[1].converged());
        prop_assert!(outcomes[0].iterations.abs_diff(outcomes[1].iterations) <= 1);
        let (z, r) = (DVector::from_column_slice(one.z()), DVector::from_column_slice(one.r()));
        let residual = dense(&a).0 * &z - dense(&b).0 * &r + DVector::from_vec(q);
        prop_assert!(residual.norm() <= 1e-10 + 1e-14);
        // min(aᵢᵢ, ωbᵢᵢ) ≥ 0.9·5.1 exceeds the four couplings, at most 1.1 each, by 0.19: each z is
        // off by its residual over that, and each r by ω times as much.
        let apart = 2.0 * 1e-10 / 0.19;
        prop_assert!((z - DVector::from_column_slice(two.z())).amax() <= apart);
        prop_assert!((r - DVector::from_column_slice(two.r())).amax() <= 1.1 * apart);
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
