//! The method that chooses its own parameters, and the solve in two precisions.

use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega, Rhs, Rows, Scalar, Tridiagonal};
use hlcp_methods::{
    AdaptiveSor, Auto, AutoChoice, Clock, Cycle, Limits, Method, Multigrid, Named, Options,
    Parameters, Solver, Status, Tmms, solve_mixed,
};
use hlcp_verify::{Disc, Example, Slider};

/// The sweeps of `Auto` with Ω = D_A D_B⁻¹, and the fewest of Table 1's methods with τ = 0.8, 1 and 1.2.
fn compare(a: &dyn Rows<f64>, b: &dyn Rows<f64>, q: &[f64]) -> [usize; 2] {
    let posed = |tau| Hlcp::new(a, b, Omega::diagonal_ratio(tau, &a, &b).unwrap()).unwrap();
    let x0 = vec![1.0; q.len()];
    let mut solver = Solver::new(Auto::new(posed(1.0)).unwrap());
    let outcome = solver.solve(q, Options::from_x(&x0).limits(Limits::relative(1e-10))).unwrap();
    assert!(outcome.converged(), "{outcome}");
    let splittings = ["GS", "SOR1", "SOR3", "AOR1", "AOR2", "AOR3"];
    let paired = ["M", "AM", "TM"].into_iter().flat_map(|family| {
        splittings.into_iter().map(move |splitting| format!("{family}{splitting}"))
    });
    let two = ["TMGSJ", "TMGSSOR1", "TMGSSOR2", "TMGSSOR3"].map(str::to_owned);
    let mut fewest = usize::MAX;
    for name in paired.chain(two) {
        for tau in [0.8, 1.0, 1.2] {
            let method =
                Named::parse(&name, Parameters::default()).unwrap().on(posed(tau)).unwrap();
            let limits = Limits { iterations: fewest.min(5000), ..Limits::relative(1e-10) };
            let outcome =
                Solver::new(method).solve(q, Options::from_x(&x0).limits(limits)).unwrap();
            if outcome.converged() {
                fewest = fewest.min(outcome.sweeps);
            }
        }
    }
    [outcome.sweeps, fewest]
}

/// On Examples 1 and 2 and on the slider no more than 1.5 times the sweeps of the best of the table.
#[test]
fn nearly_as_good_as_the_best_of_the_table() {
    for (mu, nu) in [(4.0, 4.0), (1.0, 1.0), (0.0, 4.0), (0.0, 0.0)] {
        for symmetric in [true, false] {
            let p = Example { symmetric, m: 32, mu, nu }.pose().unwrap();
            let [auto, fewest] = compare(&p.a, &p.b, &p.q);
            assert!(2 * auto <= 3 * fewest, "{symmetric} {mu} {nu}: {auto} against {fewest}");
        }
    }
    for cells in [24, 32, 64] {
        let (a, b, q) = Slider { cells }.pose().unwrap();
        let [auto, fewest] = compare(&a, &b, &q);
        assert!(2 * auto <= 3 * fewest, "slider: {auto} against {fewest}");
    }
}

/// Sweeps grow like m, not like m²: between m = 24 and m = 96 by far less than sixteen times.
#[test]
fn over_relaxation_is_found_on_the_discs() {
    for lcp in [true, false] {
        let sweeps = [24, 96].map(|m| {
            let p = Disc { lcp, m }.pose::<f64>().unwrap();
            let omega = Omega::diagonal_ratio(1.0, &p.a, &p.b).unwrap();
            let mut solver =
                Solver::new(AdaptiveSor::new(Hlcp::new(p.a, p.b, omega).unwrap()).unwrap());
            let outcome = solver
                .solve(&p.q, Options::from_x(&vec![1.0; m * m]).limits(Limits::relative(1e-10)))
                .unwrap();
            assert!(outcome.converged(), "{outcome}");
            assert!(solver.method().is_accelerated() && solver.method().alpha() > 1.6);
            // A solve begins anew.
            let again = solver
                .solve(&p.q, Options::from_x(&vec![1.0; m * m]).limits(Limits::relative(1e-10)))
                .unwrap();
            assert_eq!(again.sweeps, outcome.sweeps);
            outcome.sweeps
        });
        assert!(sweeps[1] < 8 * sweeps[0], "{sweeps:?}");
    }
}

/// AMSOR past the α that it tries first fails on the slider, and every α from 1.4 on for MMS: it is left within the solve.
#[test]
fn a_choice_that_fails_is_left() {
    for cells in [24, 32, 50, 100] {
        for tau in [0.8, 1.0, 1.2] {
            let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
            let omega = Omega::diagonal_ratio(tau, &a, &b).unwrap();
            let mut solver =
                Solver::new(AdaptiveSor::new(Hlcp::new(a, b, omega).unwrap()).unwrap());
            let outcome = solver
                .solve(&q, Options::from_x(&vec![1.0; cells - 1]).limits(Limits::relative(1e-10)))
                .unwrap();
            assert!(outcome.converged(), "{cells}, {tau}: {outcome}");
        }
    }
}

/// The slider ends in a few steps of Newton's method, the discs and a strip in a few cycles, the Examples by sweeps alone.
#[test]
fn each_scene_gets_its_method() {
    for cells in [24, 50, 128] {
        let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
        let omega = Omega::diagonal_ratio(1.0, &a, &b).unwrap();
        let mut solver = Solver::new(Auto::new(Hlcp::new(a, b, omega).unwrap()).unwrap());
        let outcome = solver
            .solve(&q, Options::from_x(&vec![1.0; cells - 1]).limits(Limits::relative(1e-10)))
            .unwrap();
        assert!(outcome.converged() && outcome.iterations <= 8, "{outcome}");
        assert_eq!(solver.method().uses(), AutoChoice::Newton);
        let again = solver
            .solve(&q, Options::from_x(&vec![1.0; cells - 1]).limits(Limits::relative(1e-10)))
            .unwrap();
        assert_eq!((again.sweeps, again.residual), (outcome.sweeps, outcome.residual));
    }
    for lcp in [true, false] {
        for m in [40, 96] {
            let p = Disc { lcp, m }.pose::<f64>().unwrap();
            let omega = Omega::diagonal_ratio(1.0, &p.a, &p.b).unwrap();
            let mut solver = Solver::new(Auto::new(Hlcp::new(p.a, p.b, omega).unwrap()).unwrap());
            let outcome = solver
                .solve(&p.q, Options::from_x(&vec![1.0; m * m]).limits(Limits::relative(1e-10)))
                .unwrap();
            assert!(outcome.converged() && outcome.iterations <= 25 + 18, "{outcome}");
            assert_eq!(solver.method().uses(), AutoChoice::Multigrid);
            // 11 or 12 walks over the rows a W-cycle, and a solve begins anew.
            let [walks, cycles] = [outcome.sweeps - 25, outcome.iterations - 25];
            assert!(walks == 11 * cycles || walks == 12 * cycles, "{outcome}");
            let again = solver
                .solve(&p.q, Options::from_x(&vec![1.0; m * m]).limits(Limits::relative(1e-10)))
                .unwrap();
            assert_eq!((again.sweeps, again.residual), (outcome.sweeps, outcome.residual));
        }
    }
    // Torsion of a strip, where Newton's method takes n/5 steps: tests/newton.rs.
    for n in [511, 4095] {
        let h = 1.0 / (n + 1) as f64;
        let distance = |j: usize| j.min(n + 1 - j) as f64 * h;
        let fold = |j: usize| 2.0 * distance(j) - distance(j - 1) - distance(j + 1);
        let q: Vec<f64> = (1..=n).map(|j| 5.0 * h * h - fold(j)).collect();
        let a = FivePoint::new(n, 1, [0.0, -1.0, 2.0, -1.0, 0.0]).unwrap();
        let problem = Hlcp::new(a, Identity { order: n }, Omega::Uniform(2.0)).unwrap();
        let mut solver = Solver::new(Auto::new(problem).unwrap());
        let outcome = solver
            .solve(&q, Options::from_x(&vec![1.0; n]).limits(Limits::relative(1e-10)))
            .unwrap();
        assert!(outcome.converged() && outcome.iterations <= 25 + 25, "{n}: {outcome}");
        assert_eq!(solver.method().uses(), AutoChoice::Multigrid);
        // Two steps of the base, then a defect and an inner iteration, four sweeps, in each of 25 steps.
        let problem = Hlcp::new(a, Identity { order: n }, Omega::Uniform(2.0)).unwrap();
        let mut cycle = Multigrid::new(problem, Cycle::F).unwrap();
        let rhs = Rhs::new(&q).unwrap();
        let _ = cycle.step(&rhs, solver.x(), &mut vec![0.0; n], &mut Clock::endless());
        let cycles = (outcome.iterations - 25) * cycle.work().unwrap().sweeps;
        assert_eq!(outcome.sweeps, 2 + 25 * 5 + cycles);
        assert_eq!(outcome.linear_iterations, Some(25));
        assert!((solver.z()[n / 2] - 0.1).abs() < h);
        let again = solver
            .solve(&q, Options::from_x(&vec![1.0; n]).limits(Limits::relative(1e-10)))
            .unwrap();
        assert_eq!((again.sweeps, again.residual), (outcome.sweeps, outcome.residual));
    }
    // The same without a grid to be known.
    let a = Tridiagonal::new(511, |_| [-1.0, 2.0, -1.0]).unwrap();
    let problem = Hlcp::new(a, Identity { order: 511 }, Omega::Uniform(2.0)).unwrap();
    let mut solver = Solver::new(Auto::new(problem).unwrap());
    let q: Vec<f64> = (0..511).map(|i| if (50..460).contains(&i) { 1e-5 } else { -1e-4 }).collect();
    let outcome =
        solver.solve(&q, Options::from_x(&[1.0; 511]).limits(Limits::relative(1e-10))).unwrap();
    assert!(outcome.converged() && outcome.iterations > 24, "{outcome}");
    assert_eq!(solver.method().uses(), AutoChoice::Newton);
    let p = Example { symmetric: true, m: 64, mu: 0.0, nu: 0.0 }.pose::<f64>().unwrap();
    let omega = Omega::diagonal_ratio(1.0, &p.a, &p.b).unwrap();
    let mut solver = Solver::new(Auto::new(Hlcp::new(&p.a, &p.b, omega).unwrap()).unwrap());
    let outcome = solver
        .solve(&p.q, Options::from_x(&vec![1.0; 64 * 64]).limits(Limits::relative(1e-10)))
        .unwrap();
    assert!(outcome.converged() && outcome.sweeps == outcome.iterations, "{outcome}");
    assert_eq!(solver.method().uses(), AutoChoice::Sor);
}

fn tmgs<T: Scalar>(example: Example) -> (Solver<T, impl Method<T>>, Vec<T>) {
    let p = example.pose::<T>().unwrap();
    let omega = Omega::diagonal_ratio(T::one(), &p.a, &p.b).unwrap();
    let method = Tmms::mirrored(Hlcp::new(p.a, p.b, omega).unwrap(), Aor::gauss_seidel());
    (Solver::new(method.unwrap()), p.q)
}

/// Two precisions reach what double precision does, and no iteration more than a rounding or two may cost.
#[test]
fn mixed_precision_reaches_double_precision() {
    let example = Example { symmetric: false, m: 24, mu: 1.0, nu: 2.0 };
    let ((mut double, q), (mut single, _)) = (tmgs::<f64>(example), tmgs::<f32>(example));
    let x0 = vec![1.0; q.len()];
    let alone = double.solve(&q, Options::from_x(&x0).limits(Limits::relative(1e-13))).unwrap();
    let mixed = solve_mixed(&mut single, &mut double, &q, &x0, &Limits::relative(1e-13)).unwrap();
    assert!(mixed.converged() && mixed.residual.l2 <= 1e-13 * hlcp_core::Norms::of(&q).l2);
    assert!(mixed.iterations <= alone.iterations + 2, "{mixed}, {alone}");
    assert_eq!(mixed.sweeps, 2 * mixed.iterations);
    // Half of them at least in single precision.
    let widened: Vec<f64> = single.x().iter().map(|&x| x.into()).collect();
    let rest = double.solve(&q, Options::from_x(&widened).limits(Limits::relative(1e-13))).unwrap();
    assert!(2 * rest.iterations <= alone.iterations + 2, "{rest}");

    // Data that single precision cannot hold, large and small, are double precision's alone.
    for scale in [1e200, 1e-200] {
        let q: Vec<f64> = q.iter().map(|q| q * scale).collect();
        let x0 = vec![scale; q.len()];
        let scaled =
            solve_mixed(&mut single, &mut double, &q, &x0, &Limits::relative(1e-13)).unwrap();
        assert!(scaled.converged() && scaled.iterations.abs_diff(alone.iterations) <= 1);
    }
    let few = Limits { iterations: 3, ..Limits::relative(1e-13) };
    let outcome = solve_mixed(&mut single, &mut double, &q, &x0, &few).unwrap();
    assert_eq!((outcome.status, outcome.iterations), (Status::IterationLimit, 3));
}
