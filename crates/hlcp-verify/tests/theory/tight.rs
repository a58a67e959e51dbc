//! How far the certificate is above the true error on every scene but the American put, some of
//! whose prices are below any error, and what it costs.

use std::time::Instant;

use hlcp_core::{Error, Hlcp, Norms, Rows, Scalar};
use hlcp_methods::{Clock, Limits, Named, Options, Solver};
use hlcp_verify::{
    Bearing2d, Branch, Dam, Disc, Example, Film, JournalBearing, Membrane, Obstacle, Posed, Slider,
    certify_by,
};
use num_rational::BigRational;
use num_traits::{One, ToPrimitive, Zero};

use crate::{
    common::{Lists, asked, largest_difference},
    exact::exact,
};

/// Where the truth comes from.
enum Truth {
    /// A planted solution.
    Planted([Vec<f64>; 2]),
    /// The same method to the floor of rounding.
    Floor,
    /// Elimination with 250 binary places on the sides of the answer.
    Tridiagonal,
}

fn wide<T: Scalar>(v: &[T]) -> Vec<f64> {
    v.iter().map(|v| v.wide()).collect()
}

fn lists<T: Scalar>(operator: &impl Rows<T>) -> Lists<f64> {
    let row = |row: Vec<(usize, T)>| row.into_iter().map(|(j, v)| (j, v.wide())).collect();
    Lists(Lists::of(operator).0.into_iter().map(row).collect())
}

/// `z` and `r` of a tridiagonal pair whose sides are known.
fn eliminated<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    on_r: impl Fn(usize) -> bool,
) -> [Vec<f64>; 2] {
    let places = exact(250_f64.exp2());
    let cut = |v: BigRational| (v * &places).round() / &places;
    let n = q.len();
    let (mut above, mut value) = (vec![], vec![]);
    for (i, q) in q.iter().enumerate() {
        let mut row = [0.0; 3];
        a.visit_row(i, &mut |j, v| row[j + 1 - i] += if on_r(j) { 0.0 } else { v.wide() });
        b.visit_row(i, &mut |j, v| row[j + 1 - i] -= if on_r(j) { v.wide() } else { 0.0 });
        let [west, here, east] = row.map(exact);
        let before = |v: &[BigRational]| v.last().cloned().unwrap_or_else(BigRational::zero);
        let pivot = cut(BigRational::one() / (here - &west * before(&above)));
        value.push(cut((-exact(q.wide()) - west * before(&value)) * &pivot));
        above.push(cut(east * pivot));
    }
    for i in (0..n.saturating_sub(1)).rev() {
        value[i] = cut(&value[i] - &above[i] * &value[i + 1]);
    }
    let part = |r| {
        let entry =
            |(i, v): (usize, &BigRational)| v.to_f64().filter(|_| on_r(i) == r).unwrap_or(0.0);
        value.iter().enumerate().map(entry).collect()
    };
    [part(false), part(true)]
}

/// Solves, certifies and prints a row: the errors of `z` and `r`, and how many times as large the
/// bounds are; the kind of the bound.
fn row<T: Scalar>(
    name: &str,
    (a, b, q): Triple<T, impl Rows<T>, impl Rows<T>>,
    truth: Truth,
    limits: Limits,
) -> Result<(), Error> {
    // As trait objects, so that the methods are compiled once for each precision.
    let (a, b): (&dyn Rows<T>, &dyn Rows<T>) = (&a, &b);
    let auto: Named = "AUTO".parse().unwrap();
    let mut solver = Solver::new(auto.on_dyn(Hlcp::from_pair(a, b)?)?);
    let (start, n) = (vec![T::one(); q.len()], q.len());
    let mut outcome = solver.solve(&q, Options::from_x(&start).limits(limits))?;
    let found = [solver.z(), solver.r()].map(<[T]>::to_vec);
    // In turn, the shortest of each; once where it takes long.
    let mut seconds = [f64::INFINITY; 2];
    let mut certificate = None;
    for _ in 0..if n < 100_000 { 3 } else { 2 } {
        outcome = solver.solve(&q, Options::from_x(&start).limits(limits))?;
        let begin = Instant::now();
        let clock = &mut Clock::endless();
        certificate = Some(certify_by(solver.method_mut(), &q, &found[0], &found[1], clock)?);
        let certify = begin.elapsed().as_secs_f64();
        seconds = [seconds[0].min(outcome.elapsed.as_secs_f64()), seconds[1].min(certify)];
    }
    let certificate = certificate
        .expect("at least one")
        .unwrap_or_else(|refusal| panic!("{name}, {n}: {refusal}"));
    let known = match truth {
        Truth::Planted(known) => known,
        Truth::Tridiagonal => eliminated(&a, &b, &q, |j| found[1][j] > T::zero()),
        Truth::Floor if T::epsilon().wide() < 1e-10 => {
            let floor = Limits { iterations: 300, ..Limits::relative(1e-16) };
            let _ = solver.solve(&q, Options::resume().limits(floor))?;
            [wide(solver.z()), wide(solver.r())]
        }
        Truth::Floor => {
            // The same problem in double precision.
            let (a, b, q) = (lists(&a), lists(&b), wide(&q));
            let (a, b): (&dyn Rows<f64>, &dyn Rows<f64>) = (&a, &b);
            let mut solver = Solver::new(auto.on_dyn(Hlcp::from_pair(a, b)?)?);
            let start = vec![1.0; n];
            let _ = solver.solve(&q, Options::from_x(&start).limits(Limits::relative(1e-12)))?;
            [solver.z().to_vec(), solver.r().to_vec()]
        }
    };
    let [z, r] = [(&found[0], &known[0], &certificate.z), (&found[1], &known[1], &certificate.r)]
        .map(|(found, known, bound)| {
            let error = largest_difference(&wide(found), known);
            let bound = Norms::of(bound).linf;
            // A reference at the floor of rounding is itself off, and may show an error above its
            // bound. Of large problems rounding may widen a box.
            let most = if n < 5_000 { 1.4 } else { 5.0 };
            let is_tight = bound > 0.9 * error && bound <= most * error;
            assert!(is_tight, "{name}: {bound:e} for {error:e}");
            [error, bound / error]
        });
    let [on_z, on_r, open] =
        [Branch::Z, Branch::R, Branch::Open].map(|side| certificate.count(side));
    let precision = if T::epsilon().wide() < 1e-10 { "" } else { ", f32" };
    let [solve, certify] = seconds;
    println!(
        "| {name}{precision} | {n} | {} | {:.1e} | {:.2} | {:.1e} | {:.2} | {on_z} | {on_r} | {open} | {:.1} |",
        outcome.status,
        z[0],
        z[1],
        r[0],
        r[1],
        certify / solve
    );
    assert!(open == 0, "{name}: {open} sides are open");
    Ok(())
}

type Triple<T, A, B> = (A, B, Vec<T>);

fn planted<T: Scalar, A, B>(posed: Posed<T, A, B>) -> (Triple<T, A, B>, Truth) {
    let Posed { a, b, q, z, r } = posed;
    ((a, b, q), Truth::Planted([wide(&z), wide(&r)]))
}

/// Bounds at most 1.4 times the error, for `z` and for `r`, and every side proved, on grids of up
/// to `HLCP_TIGHT` points (4,000 if it is not set).
#[test]
fn bounds_are_tight() -> Result<(), Error> {
    let (absolute, relative) = (Limits::absolute(1e-10), Limits::relative(1e-10));
    for m in [63, 255, 1023] {
        let n = m * m;
        if n > asked("HLCP_TIGHT", 4_000) {
            continue;
        }
        for shift in [4.0, 1.0, 0.0] {
            for symmetric in [true, false] {
                let example = Example { symmetric, m, mu: shift, nu: shift };
                let (pair, known) = planted(example.pose_generic::<f64>()?);
                let name = format!("example{} ({shift}, {shift})", 2 - u8::from(symmetric));
                row(&name, pair, known, absolute)?;
            }
        }
        for (lcp, name) in [(true, "disc-lcp"), (false, "disc-hlcp")] {
            let (pair, known) = planted(Disc { lcp, m }.pose::<f64>()?);
            row(name, pair, known, absolute)?;
        }
        let narrow = Disc { lcp: true, m }.pose::<f32>()?;
        row("disc-lcp", (narrow.a, narrow.b, narrow.q), Truth::Floor, Limits::default())?;
        for (spiral, name) in [(true, "spiral"), (false, "bessel")] {
            row(name, Membrane { spiral, m }.pose::<f64>()?, Truth::Floor, absolute)?;
        }
        let dam = Dam { nx: m, ny: m, length: 2.0 / 3.0, tail: 0.5, layer: 1.0 };
        row("dam", dam.pose::<f64>()?, Truth::Floor, relative)?;
        let film = Film::new([m, m / 2], [0.1, 0.04], 3.0, 0.04);
        let film = film.with_gap(|x, _| 2e-5 + 1e-5 * (60.0 * x).cos());
        row("film", film.pose()?, Truth::Floor, relative)?;
        row("obstacle", Obstacle { m: m + 2 }.pose::<f64>()?, Truth::Floor, absolute)?;
        for ecc in [0.1, 0.6, 0.95] {
            let scene = JournalBearing { nx: m, ny: m, ecc, b: 10.0 };
            let name = format!("journal-bearing ε {ecc}");
            row(&name, scene.pose::<f64>()?, Truth::Floor, absolute)?;
            for groove in [0.0, 218.0_f64] {
                let groove = groove.to_radians();
                let scene = Bearing2d { nx: m, ny: m / 2, ecc, aspect: 1.0, groove };
                let name = format!("bearing2d ε {ecc} {:.0}°", groove.to_degrees());
                row(&name, scene.pose::<f64>()?, Truth::Floor, absolute)?;
            }
        }
        let scene = Bearing2d { nx: m, ny: m / 2, ecc: 0.6, aspect: 1.0, groove: 0.0 };
        let (a, b, q) = scene.pose::<f64>()?;
        row("bearing2d ε 0.6 0°, rows", (lists(&a), lists(&b), q), Truth::Floor, absolute)?;
        row("bearing2d ε 0.6 0°", scene.pose::<f32>()?, Truth::Floor, Limits::default())?;
        // Elimination in rational numbers takes minutes for 65,025 points.
        if n < 100_000 {
            let slider = Slider { cells: n + 1 };
            row("slider", slider.pose::<f64>()?, Truth::Tridiagonal, relative)?;
        }
    }
    Ok(())
}
