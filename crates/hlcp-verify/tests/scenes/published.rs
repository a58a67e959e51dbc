//! Scenes with published answers have them, and are what their equations say.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::{
    common::{assembled, by_tmgs, largest_difference, problem, scattered, solve_from_ones, tmgs},
    dam::LAYERED,
    proved, solved,
};
use approx::assert_abs_diff_eq;
use hlcp_core::{Aor, Diagonal, Error, LinearOperator};
use hlcp_methods::{Limits, Solver, Tmms};
use hlcp_verify::{
    AmericanPut, Bearing2d, Columns, Dam, Disc, Example, JournalBearing, Membrane, Obstacle, Slider,
};
use nalgebra::{DMatrix, DVector};

/// The stiffness matrix and the load of linear elements on right triangles, assembled triangle by
/// triangle, `w` and the load by the vertex rule.
fn elements(scene: JournalBearing) -> (DMatrix<f64>, DVector<f64>) {
    let JournalBearing { nx, ny, ecc, b } = scene;
    let (hx, hy) = (TAU / (nx + 1) as f64, 2.0 * b / (ny + 1) as f64);
    let mut stiffness = DMatrix::zeros(nx * ny, nx * ny);
    let mut load = DVector::zeros(nx * ny);
    let inner = |[i, j]: [usize; 2]| {
        ((1..=nx).contains(&i) && (1..=ny).contains(&j)).then(|| (j - 1) * nx + i - 1)
    };
    for (i, j) in (0..=nx).flat_map(|i| (0..=ny).map(move |j| (i, j))) {
        // The right angle first, then the neighbours along ξ and across.
        let lower = [[i, j], [i + 1, j], [i, j + 1]];
        let upper = [[i + 1, j + 1], [i, j + 1], [i + 1, j]];
        for triangle in [lower, upper] {
            let w = |[i, _]: [usize; 2]| (1.0 + ecc * f64::cos(i as f64 * hx)).powi(3);
            let mean = triangle.map(w).iter().sum::<f64>() / 3.0;
            let gradients = [[-1.0 / hx, -1.0 / hy], [1.0 / hx, 0.0], [0.0, 1.0 / hy]];
            for (u, p) in triangle.into_iter().zip(gradients) {
                let Some(row) = inner(u) else { continue };
                load[row] += hx * hy / 6.0 * ecc * f64::sin(u[0] as f64 * hx);
                for (v, s) in triangle.into_iter().zip(gradients) {
                    if let Some(column) = inner(v) {
                        stiffness[(row, column)] +=
                            hx * hy / 2.0 * mean * (p[0] * s[0] + p[1] * s[1]);
                    }
                }
            }
        }
    }
    (stiffness, load)
}

#[test]
fn the_journal_bearing_is_its_elements() {
    let scene = JournalBearing { nx: 7, ny: 5, ecc: 0.7, b: 1.3 };
    let (a, b, q) = scene.pose::<f64>().unwrap();
    let (stiffness, load) = elements(scene);
    let (scale, q) = (stiffness.amax(), DVector::from_vec(q));
    assert!((assembled(&a) - &stiffness).amax() <= 8.0 * f64::EPSILON * scale);
    assert!((&q + &load).amax() <= 8.0 * f64::EPSILON * load.amax());
    assert_eq!(assembled::<f64>(&b), DMatrix::identity(35, 35));
    let z = DVector::from_vec(scattered(35, 12.9898));
    let objective = 0.5 * z.dot(&(&stiffness * &z)) - load.dot(&z);
    // 35 points with five terms each, none larger than the scale.
    let rounding = 175.0 * f64::EPSILON * scale;
    assert_abs_diff_eq!(scene.objective(z.as_slice()), objective, epsilon = rounding);
}

#[test]
fn the_journal_bearing_has_petscs_objective() {
    let scene = JournalBearing { nx: 8, ny: 12, ecc: 0.1, b: 10.0 };
    let (a, b, q) = scene.pose::<f64>().unwrap();
    let [z, _] = by_tmgs(&a, b, &q);
    assert_eq!(format!("{:.6}", scene.objective(&z)), "-0.183437");
    proved(&a, &b, &[Aor::gauss_seidel()]);

    let (a, b, q) = scene.pose::<f32>().unwrap();
    let [z, _] = by_tmgs(a, b, &q);
    // Second order in the error of z, first order in the rounding of A and q.
    assert_abs_diff_eq!(scene.objective(&z), -0.183437, epsilon = 1e-5);
}

#[test]
fn the_obstacle_problem_is_its_stencil() {
    let m = 7;
    let scene = Obstacle { m };
    let (a, b, q) = scene.pose::<f64>().unwrap();
    assert_eq!(assembled::<f64>(&b), DMatrix::identity(25, 25));
    let z = scattered(25, 12.9898);
    let place = |i: usize| i as f64 * 4.0 / 6.0 - 2.0;
    let membrane = DMatrix::from_fn(m, m, |i, j| {
        let (x, y) = (place(i), place(j));
        if [0, m - 1].contains(&i) || [0, m - 1].contains(&j) {
            Obstacle::exact(x, y)
        } else {
            Obstacle::dome(x, y) + z[(j - 1) * 5 + i - 1]
        }
    });
    let mut force = vec![0.0; 25];
    a.apply(&z, &mut force);
    for (k, force) in force.iter().enumerate() {
        let (i, j) = (k % 5 + 1, k / 5 + 1);
        let around = membrane[(i - 1, j)] + membrane[(i + 1, j)];
        let around = around + membrane[(i, j - 1)] + membrane[(i, j + 1)];
        let expected = 4.0 * membrane[(i, j)] - around;
        let rounding = 32.0 * f64::EPSILON * membrane.amax();
        assert_abs_diff_eq!(force + q[k], expected, epsilon = rounding);
    }
}

/// Value and slope of the exact solution are the dome's where it takes off, and it is 0 at
/// radius 2.
#[test]
fn the_exact_membrane_takes_off_smoothly() {
    let (at, step) = (Obstacle::CONTACT, 1e-6);
    // Half the jump of the second derivatives is below 10.
    let [exact, dome] = [Obstacle::exact, Obstacle::dome].map(|height| height(at + step, 0.0));
    assert_abs_diff_eq!(exact, dome, epsilon = 10.0 * step * step);
    assert_abs_diff_eq!(Obstacle::exact(0.0, -2.0), 0.0, epsilon = 1e-14);
}

#[test]
fn the_obstacle_problem_has_petscs_errors() {
    for (m, printed) in [(9, ["3.076e-3", "1.334e-2"]), (17, ["2.707e-3", "1.428e-2"])] {
        let scene = Obstacle { m };
        let (a, b, q) = scene.pose::<f64>().unwrap();
        let [z, _] = by_tmgs(a, b, &q);
        assert_eq!(scene.errors(&z).map(|error| format!("{error:.3e}")), printed);
        proved(&a, &b, &[Aor::gauss_seidel()]);
        let (a, b, q) = scene.pose::<f32>().unwrap();
        let [z, _] = by_tmgs(a, b, &q);
        // z is off by some hundred roundings, amplified by A⁻¹ ≤ m²/8.
        let [mean, _] = scene.errors(&z);
        assert_abs_diff_eq!(mean, printed[0].parse().unwrap(), epsilon = 2e-4);
    }
}

/// Bessel's J₀ by its power series, whose terms are at most 2e7 for x ≤ 20.
fn bessel(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..80 {
        term *= -x * x / 4.0 / f64::from(k * k);
        sum += term;
    }
    sum
}

/// The obstacle and the load on it, by place.
fn obstacle(spiral: bool, x: f64, y: f64) -> [f64; 2] {
    if !spiral {
        return [(bessel(20.0 * x) + 1.0) * (bessel(20.0 * y) + 1.0), 100.0];
    }
    let (rho, theta) = ((x * x + y * y).sqrt(), f64::atan2(y, x));
    let coil = f64::sin(TAU / rho + FRAC_PI_2 - theta);
    [coil + rho * (rho + 1.0) / (rho - 2.0) - 3.0 * rho + 3.6, 0.0]
}

/// In heights `u`: −Δu = load off the obstacle, and u on its side of it.
#[test]
fn a_membrane_is_free_or_on_its_obstacle() {
    for spiral in [true, false] {
        let m = 14; // no node is the spiral's centre
        let scene = Membrane { spiral, m };
        let (a, b, q) = scene.pose::<f64>().unwrap();
        let n = m * m;
        let dense = DMatrix::from_fn(n, n, |k, l| {
            let far = (k % m).abs_diff(l % m) + (k / m).abs_diff(l / m);
            [4.0, -1.0].get(far).copied().unwrap_or(0.0)
        });
        assert_eq!(assembled(&a), dense);
        assert_eq!(assembled::<f64>(&b), DMatrix::identity(n, n));
        proved(&a, &b, &[Aor::gauss_seidel()]);

        let [z, r] = solved((a, b, q), "AMGS", 1e-12);
        let r = DVector::from_vec(r);
        let u = DVector::from_vec(scene.membrane(&z));
        let [low, side] = if spiral { [-1.0, 2.0] } else { [0.0, 1.0] };
        let h = side / (m + 1) as f64;
        let at = |k: usize| {
            let place = |i: usize| low + (i + 1) as f64 * h;
            obstacle(spiral, place(k % m), place(k / m))
        };
        let sign = if spiral { 1.0 } else { -1.0 };
        // The series loses eight digits, and the solve is to 1e-12 ‖q‖.
        for k in 0..n {
            assert!((sign * (u[k] - at(k)[0]) - z[k]).abs() < 1e-7);
        }
        let load = DVector::from_fn(n, |k, _| at(k)[1] * h * h);
        assert!((&dense * u - load - sign * &r).amax() < 1e-9);
        assert!(z.contains(&0.0) && r.iter().any(|&r| r == 0.0), "some contact and some not");
    }
}

/// Over-relaxation on the disc has the iteration counts that independent implementations found.
#[test]
fn tmsor_takes_thousands_of_iterations_on_the_disc() {
    for (lcp, m, alpha, count) in
        [(true, 63, 1.0, 4709), (false, 63, 1.0, 3394), (false, 64, 1.5, 1637)]
    {
        let scene = Disc { lcp, m }.pose::<f64>().unwrap();
        let problem = problem(1.0, scene.a, scene.b);
        let mut solver = Solver::new(Tmms::mirrored(problem, Aor::sor(alpha).unwrap()).unwrap());
        let outcome = solve_from_ones(&mut solver, &scene.q, Limits::absolute(1e-10));
        assert!(outcome.converged());
        assert!(outcome.iterations.abs_diff(count) <= 1, "{}", outcome.iterations);
        // The error is the residual times the inverse of a matrix of columns of A and B, of norm
        // O(m²/8).
        let off = outcome.residual.linf * (m * m) as f64 + 1e-12;
        assert!(largest_difference(solver.z(), &scene.z) <= off);
        assert!(largest_difference(solver.r(), &scene.r) <= 8.0 * off);
    }
}

/// What is not a number in a solution is not one in what is read off it.
#[test]
fn nan_shows_in_every_figure() {
    for at in [0, 24, 48] {
        let mut z = vec![0.1; 49];
        z[at] = f64::NAN;
        let slider = Slider { cells: 50 };
        assert!(slider.peak(&z).is_nan() && slider.rupture(&z).is_nan());
        assert!(Obstacle { m: 9 }.errors(&z).iter().all(|error| error.is_nan()));
        assert!(JournalBearing { nx: 7, ny: 7, ecc: 0.1, b: 10.0 }.objective(&z).is_nan());
        let bearing = Bearing2d { nx: 7, ny: 7, ecc: 0.6, aspect: 0.8, groove: 0.3 };
        assert!(bearing.load(&z).iter().all(|force| force.is_nan()));
        assert!(bearing.sommerfeld(&z).is_nan() && bearing.attitude(&z).is_nan());
    }
}

/// The generic solution has the pattern of the plain one, no two equal entries nearby, and solves
/// the problem.
#[test]
fn generic_solutions_are_planted() {
    for symmetric in [true, false] {
        let example = Example { symmetric, m: 6, mu: 0.7, nu: 1.9 };
        let (plain, generic) =
            (example.pose::<f64>().unwrap(), example.pose_generic::<f64>().unwrap());
        let (a, b) = (assembled(&generic.a), assembled(&generic.b));
        assert_eq!((&a, &b), (&assembled(&plain.a), &assembled(&plain.b)));
        for k in 0..36 {
            let [of_plain, of_generic] =
                [&plain, &generic].map(|of| [of.z[k] > 0.0, of.r[k] > 0.0]);
            assert_eq!(of_plain, of_generic);
            let value = generic.z[k] + generic.r[k];
            assert!((0.5..1.5).contains(&value));
            assert!(k == 0 || (value - generic.z[k - 1] - generic.r[k - 1]).abs() > 0.3);
        }
        let (z, r) = (DVector::from_vec(generic.z.clone()), DVector::from_vec(generic.r.clone()));
        let q = DVector::from_vec(generic.q.clone());
        // Ten terms an entry, none larger than 1.5 · 6.
        assert!((&a * &z - &b * &r + &q).amax() <= 10.0 * f64::EPSILON * 9.0);

        let problem = problem(1.0, generic.a, generic.b);
        let mut solver = Solver::new(tmgs(problem));
        let limits = Limits::absolute(1e-12);
        assert!(solve_from_ones(&mut solver, &generic.q, limits).converged());
        assert!(largest_difference(solver.z(), &generic.z) <= 1e-11);
        assert!(largest_difference(solver.r(), &generic.r) <= 1e-11);
    }
}

/// What a rank poses of a scene is its columns of the whole.
#[test]
fn columns_are_those_of_the_whole() {
    type Points = Vec<[f64; 3]>;
    fn points((a, b, q): (impl Diagonal<f64>, impl Diagonal<f64>, Vec<f64>)) -> Points {
        (0..q.len()).map(|k| [a.diagonal_entry(k), b.diagonal_entry(k), q[k]]).collect()
    }
    fn holds<S: Columns>(scene: S, ny: usize, points: impl Fn(S::Posed<f64>) -> Points) {
        let of = |columns| points(scene.pose_columns(columns).unwrap());
        let (whole, part) = (of(0..6), of(2..5));
        assert!(part.len() == 3 * ny && whole.len() == 6 * ny);
        for (part, whole) in part.chunks(3).zip(whole.chunks(6)) {
            assert_eq!(part, &whole[2..5]);
        }
    }
    let (nx, ny) = (6, 4);
    holds(Bearing2d { nx, ny, ecc: 0.5, aspect: 0.8, groove: 0.3 }, ny, points);
    holds(JournalBearing { nx, ny, ecc: 0.1, b: 10.0 }, ny, points);
    holds(Dam { nx, ny, ..LAYERED }, ny, points);
    holds(Membrane { spiral: true, m: 6 }, 6, points);
    holds(Membrane { spiral: false, m: 6 }, 6, points);
    holds(Obstacle { m: 8 }, 6, points);
    holds(Disc { lcp: false, m: 6 }, 6, |posed| points((posed.a, posed.b, posed.q)));
    let example = Example { symmetric: false, m: 6, mu: 4.0, nu: 4.0 };
    holds(example, 6, |posed| points((posed.a, posed.b, posed.q)));
}

#[test]
fn bad_parameters_are_refused_with_their_value() {
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let journal = |ecc, b| JournalBearing { nx: 3, ny: 4, ecc, b }.pose::<f64>().map(drop);
    let bearing = |ecc, aspect, groove| {
        Bearing2d { nx: 3, ny: 4, ecc, aspect, groove }.pose::<f64>().map(drop)
    };
    let plain = AmericanPut { rate: 0.06, volatility: 0.2, maturity: 1.0, m: 16, steps: 40 };
    let put = |put: AmericanPut| put.pose::<f64>().map(drop);
    let dam = |dam: Dam| dam.pose::<f64>().map(drop);
    let mut all = vec![
        ("ecc", 1.0, bearing(1.0, 1.0, 0.3)),
        ("ecc", -0.5, bearing(-0.5, 1.0, 0.3)),
        ("aspect", 0.0, bearing(0.5, 0.0, 0.3)),
        ("aspect", inf, bearing(0.5, inf, 0.3)),
        ("groove", -inf, bearing(0.5, 1.0, -inf)),
        ("rate", 0.0, put(AmericanPut { rate: 0.0, ..plain })),
        ("rate", inf, put(AmericanPut { rate: inf, ..plain })),
        ("volatility", -0.2, put(AmericanPut { volatility: -0.2, ..plain })),
        ("maturity", 0.0, put(AmericanPut { maturity: 0.0, ..plain })),
        ("steps", 1.0, put(AmericanPut { steps: 1, ..plain })),
        ("m", 0.0, put(AmericanPut { m: 0, ..plain })),
        // The drift of a rate of 600 % outruns a diffusion of 20 % on this grid.
        ("m", 16.0, put(AmericanPut { rate: 6.0, ..plain })),
        ("m", 16.0, put(AmericanPut { volatility: 1e160, ..plain })),
        ("m", 16.0, put(AmericanPut { volatility: 1e-160, ..plain })),
        ("length", 0.0, dam(Dam { length: 0.0, ..LAYERED })),
        ("layer", nan, dam(Dam { layer: nan, ..LAYERED })),
        ("tail", 1.1, dam(Dam { tail: 1.1, ..LAYERED })),
    ];
    all.extend([-0.1, 1.0, nan, inf].map(|ecc| ("ecc", ecc, journal(ecc, 2.0))));
    all.extend([0.0, -2.0, nan, inf].map(|b| ("b", b, journal(0.1, b))));
    all.extend([0, 1, 2].map(|m| ("m", m as f64, Obstacle { m }.pose::<f64>().map(drop))));
    all.extend(
        [true, false].map(|spiral| ("m", 0.0, Membrane { spiral, m: 0 }.pose::<f64>().map(drop))),
    );
    for (parameter, number, found) in all {
        let Err(error @ Error::Parameter { name, value, .. }) = found else {
            panic!("{parameter} = {number}: {found:?}")
        };
        assert_eq!((name, value.to_bits()), (parameter, number.to_bits()));
        assert!(error.to_string().contains(parameter), "{error}");
    }
    for (nx, ny) in [(0, 4), (4, 0), (usize::MAX / 2, 3)] {
        let scene = JournalBearing { nx, ny, ecc: 0.1, b: 2.0 };
        assert_eq!(scene.pose::<f64>().unwrap_err(), Error::Grid { nx, ny });
        assert!(matches!(dam(Dam { nx, ny, ..LAYERED }), Err(Error::Grid { .. })));
        let bearing = Bearing2d { nx, ny, ecc: 0.5, aspect: 1.0, groove: 0.3 };
        assert_eq!(bearing.pose::<f64>().unwrap_err(), Error::Grid { nx, ny });
    }
    assert!(matches!(bearing(0.5, 1e-200, 0.3), Err(Error::NotFinite { .. })));
    assert_eq!(Obstacle { m: 3 }.pose::<f64>().unwrap().2.len(), 1);
}
