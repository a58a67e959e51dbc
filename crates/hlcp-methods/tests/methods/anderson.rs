//! Anderson acceleration: its mixing against dense least squares, its safeguard, and its counts on
//! every scene.

use crate::common::{Altered, Failing, from, over, planted, posed, problem, solve_from_ones, tmgs};
use hlcp_core::{Aor, Error, Hlcp, Identity, Omega, Rhs, Rows};
use hlcp_methods::{
    Anderson, Clock, Divergence, Limits, Method, Mms, Named, Newton, Solver, Ssor, Status, Tmms,
};
use hlcp_verify::{Disc, Example, Slider};
use nalgebra::{DMatrix, DVector};
use proptest::{collection::vec, prelude::*};

proptest! {
    /// x⁺ = G(x) − ΔG c with c the least-squares solution of Δf c ≈ f, by singular values, over the
    /// last m differences.
    #[test]
    fn mixing_solves_the_least_squares_problem(
        p in planted(4..12, 0.6),
        window in 1..4_usize,
        x0 in vec(-3.0..3.0, 12),
    ) {
        let n = p.z.len();
        let q = Rhs::new(p.dense.q.as_slice()).unwrap();
        let method = || tmgs(posed(&p.dense));
        let (mut anderson, mut base) = (Anderson::new(method(), window).unwrap(), method());
        let (mut x, mut spare, mut y) = (x0[..n].to_vec(), vec![0.0; n], vec![f64::NAN; n]);
        let (mut images, mut moves): (Vec<DVector<f64>>, Vec<DVector<f64>>) = (vec![], vec![]);
        let mut last = f64::INFINITY;
        for _ in 0..6 {
            let norms = anderson.step(&q, &x, &mut y, &mut Clock::endless());
            let mut g = vec![0.0; n];
            prop_assert_eq!(norms, base.step(&q, &x, &mut g, &mut Clock::endless()));
            base.complete(&q, &mut g, &mut spare);
            if norms.l2 > 2.0 * last {
                images.clear();
                moves.clear();
            }
            last = norms.l2;
            let g = DVector::from_vec(g);
            moves.push(&g - DVector::from_column_slice(&x));
            images.push(g.clone());
            let m = window.min(images.len() - 1);
            if m == 0 {
                prop_assert_eq!(&y, g.as_slice());
            } else {
                let columns = |v: &[DVector<f64>]| {
                    let newest = v[v.len() - 1 - m..].windows(2).map(|pair| &pair[1] - &pair[0]);
                    DMatrix::from_columns(&newest.collect::<Vec<_>>())
                };
                let (df, f) = (columns(&moves), moves.last().unwrap());
                let svd = df.clone().svd(true, true);
                let condition = svd.singular_values.max() / svd.singular_values.min();
                // The products square the condition number; beyond 10³ of it the window may be cut.
                if condition > 1e3 || f.norm() < 1e-10 {
                    return Ok(());
                }
                let c = svd.solve(f, 0.0).unwrap();
                let expected = &g - columns(&images) * &c;
                let scale = g.amax() + columns(&images).amax() * c.amax();
                let off = (DVector::from_column_slice(&y) - expected).amax();
                prop_assert!(off <= 1e3 * f64::EPSILON * condition * condition * scale, "{}", off);
            }
            x.copy_from_slice(&y);
        }
    }

    /// On one linear piece a full window spans the space: as GMRES does, it ends after n + 1
    /// iterations or so.
    #[test]
    fn a_full_window_ends_on_a_linear_piece(p in planted(1..5, 0.15), shift in vec(0.98..1.02, 5)) {
        let n = p.z.len();
        prop_assume!(p.x().iter().all(|x| x.abs() >= 0.3 * p.x().amax()));
        let start: Vec<f64> = p.x().iter().zip(&shift).map(|(x, shift)| x * shift).collect();
        let jacobi = Mms::new(posed(&p.dense), Aor::jacobi()).unwrap();
        let mut anderson = Solver::new(Anderson::new(jacobi, n).unwrap());
        let outcome = anderson.solve(p.dense.q.as_slice(), from(&start)).unwrap();
        // Two more for directions that are cut as nearly dependent.
        prop_assert!(outcome.converged() && outcome.iterations <= n + 3, "{} {}", n, outcome);
    }
}

#[test]
fn a_window_of_zero_or_beyond_memory_is_refused() {
    let problem = Hlcp::lcp(Identity { order: 2 }).unwrap();
    let base = Mms::new(problem, Aor::<f64>::jacobi()).unwrap();
    for window in [0, usize::MAX, 1 << 40, 1 << 29] {
        let refusal = Anderson::new(base.clone(), window).unwrap_err();
        assert!(matches!(refusal, Error::Parameter { name: "window", .. }));
    }
}

/// The residual at the start is 12, so that the third iterate's may be 100 · 12/3 = 400, which is
/// 200 from the solution.
#[test]
fn a_mixture_that_multiplies_the_residual_is_dropped() {
    for (short, lost) in [(1e-6, true), (1.0 / 220.0, true), (1.0 / 180.0, false)] {
        let problem = Hlcp::lcp(Identity { order: 1 }).unwrap();
        // Halves the distance to the solution; but the first two images are such that their mixture
        // is 1/short away: f falls from 1 to 1 − short, so the secant runs 1/short ahead.
        let base = Mms::new(problem, Aor::sor(0.5).unwrap()).unwrap();
        let trap = Altered::new(base, |k, x, y, norms, _| {
            match k {
                1 => y[0] = x[0] + 1.0,
                2 => y[0] = x[0] + 1.0 - short,
                _ => {}
            }
            norms
        });
        let mut anderson = Anderson::new(trap, 1).unwrap();
        let q = [-20.0];
        let q = Rhs::new(&q).unwrap();
        let (mut x, mut y) = (vec![4.0], vec![f64::NAN]);
        let mut visited = vec![];
        for _ in 0..4 {
            visited.push(x[0]);
            let _ = anderson.step(&q, &x, &mut y, &mut Clock::endless());
            std::mem::swap(&mut x, &mut y);
        }
        assert_eq!(visited[..2], [4.0, 5.0]);
        // The mixture, and what it was made of.
        assert!((visited[2] - 1.0 / short - 4.0).abs() < 1e-9 / short, "{visited:?}");
        assert_eq!(visited[3] == 6.0 - short, lost);
    }
}

/// Where the base diverges and nothing helps, the outcome says so.
#[test]
fn divergence_is_reported() {
    let scene = Disc { lcp: true, m: 40 }.pose::<f64>().unwrap();
    let problem = Hlcp::new(scene.a, scene.b, Omega::Uniform(4.0)).unwrap();
    let base = Tmms::mirrored(problem, Aor::sor(1.8).unwrap()).unwrap();
    let mut anderson = Solver::new(Anderson::new(base, 10).unwrap());
    let limits = Limits { iterations: 3000, ..Limits::absolute(1e-10) };
    let outcome = solve_from_ones(&mut anderson, &scene.q, limits);
    assert!(!outcome.converged() && outcome.residual.l2.is_finite(), "{outcome}");
}

#[test]
fn nan_ends_in_divergence() {
    let problem = Hlcp::new(Failing::after(9), Identity { order: 3 }, Omega::Uniform(2.5)).unwrap();
    let base = Mms::with_splitting(problem, over(19.0)).unwrap();
    let mut anderson = Solver::new(Anderson::new(base, 2).unwrap());
    let outcome = anderson.solve(&[-1.5, 2.0, 0.5], from(&[0.3; 3])).unwrap();
    assert_eq!(outcome.status, Status::Diverged(Divergence::Residual));
    assert!(outcome.iterations >= 5);
}

/// The solver may ask for a step from the same iterate again; the second changes no iterate.
#[test]
fn a_step_repeated_at_one_iterate_changes_nothing() {
    let scene = Disc { lcp: false, m: 12 }.pose::<f64>().unwrap();
    let tmgs = tmgs(Hlcp::new(scene.a, scene.b, Omega::Uniform(1.0)).unwrap());
    let q = Rhs::new(&scene.q).unwrap();
    let run = |twice: bool| {
        let mut anderson = Anderson::new(tmgs.clone(), 4).unwrap();
        let (mut x, mut y) = (vec![1.0; 144], vec![0.0; 144]);
        for _ in 0..15 {
            let _ = anderson.step(&q, &x, &mut y, &mut Clock::endless());
            if twice {
                let _ = anderson.step(&q, &x, &mut y, &mut Clock::endless());
            }
            std::mem::swap(&mut x, &mut y);
        }
        x
    };
    assert_eq!(run(false), run(true));
}

const METHODS: [&str; 16] = [
    "MJ", "MGS", "AMJ", "AMGS", "TMJ", "TMGS", "MSOR1", "AMSOR1", "TMSOR1", "MAOR1", "AMAOR1",
    "TMAOR1", "TMAOR2", "TMJSOR2", "TMGSJ", "TMGSSOR2",
];

/// No acceleration takes more iterations than its base.
fn never_more(a: &dyn Rows<f64>, b: &dyn Rows<f64>, q: &[f64], tau: f64, limits: Limits) {
    let problem = problem(tau, a, b);
    for name in METHODS {
        let named: Named = name.parse().unwrap();
        let method = || named.on_dyn(problem.clone()).unwrap();
        let plain = solve_from_ones(&mut Solver::new(method()), q, limits);
        for window in [2, 5, 10] {
            if !plain.converged() {
                continue;
            }
            let mut anderson = Solver::new(Anderson::new(method(), window).unwrap());
            let fast = solve_from_ones(&mut anderson, q, limits);
            assert!(
                fast.converged() && fast.iterations <= plain.iterations,
                "{name}({window}) tau {tau}: {fast} against {plain}"
            );
        }
    }
}

#[test]
fn never_more_iterations_on_examples_slider_and_disc() {
    let absolute = Limits::absolute(1e-10);
    for symmetric in [true, false] {
        for (mu, nu) in [(4.0, 4.0), (1.0, 1.0), (0.0, 0.0), (0.0, 4.0)] {
            for tau in [0.8, 1.0, 1.2] {
                let scene = Example { symmetric, m: 40, mu, nu }.pose::<f64>().unwrap();
                never_more(&scene.a, &scene.b, &scene.q, tau, absolute);
            }
        }
    }
    for cells in [50, 100] {
        let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
        never_more(&a, &b, &q, 1.0, Limits::relative(1e-10));
    }
    for lcp in [true, false] {
        let scene = Disc { lcp, m: 40 }.pose::<f64>().unwrap();
        never_more(&scene.a, &scene.b, &scene.q, 1.0, absolute);
    }
}

/// The linear solves within the base are the method's.
#[test]
fn inner_iterations_are_those_of_the_base() {
    let scene = Disc { lcp: true, m: 12 }.pose::<f64>().unwrap();
    let problem = Hlcp::new(scene.a, scene.b, Omega::Uniform(1.0)).unwrap();
    let mut newton = Newton::new(tmgs(problem), Ssor);
    let mut anderson = Anderson::new(newton.clone(), 2).unwrap();
    let q = Rhs::new(&scene.q).unwrap();
    let (x, mut y) = (vec![1.0; 144], vec![0.0; 144]);
    let norms = newton.step(&q, &x, &mut y, &mut Clock::endless());
    assert_eq!(anderson.step(&q, &x, &mut y, &mut Clock::endless()), norms);
    let work = newton.work().unwrap();
    assert!(work.linear_iterations > Some(1));
    assert_eq!(anderson.work(), Some(work));
}

/// TMGS alone takes 4853, 18508, 3497 and 12933.
#[test]
fn hundreds_of_iterations_on_the_disc() {
    for (lcp, m, most) in [(true, 64, 198), (true, 128, 553), (false, 64, 170), (false, 128, 453)] {
        let scene = Disc { lcp, m }.pose::<f64>().unwrap();
        let tmgs = tmgs(problem(1.0, scene.a, scene.b));
        let mut anderson = Solver::new(Anderson::new(tmgs, 10).unwrap());
        let outcome = solve_from_ones(&mut anderson, &scene.q, Limits::absolute(1e-10));
        assert!(outcome.converged() && outcome.iterations <= most, "{lcp} {m}: {outcome}");
        assert_eq!(outcome.sweeps, 2 * outcome.iterations);
    }
}
