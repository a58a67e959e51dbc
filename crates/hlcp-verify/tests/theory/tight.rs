//! How far the certificate is above the true error on every scene, and what it costs.

use std::time::Instant;

use hlcp_core::{Error, Hlcp, Omega, Rows, Scalar};
use hlcp_methods::{Auto, Limits, Options, Solver};
use hlcp_verify::{
    Bearing2d, Disc, Example, JournalBearing, Obstacle, Posed, Side, Slider, certify,
};

/// The largest unknowns that the environment asks for, or else `usual`.
fn unknowns(usual: usize) -> usize {
    std::env::var("HLCP_TIGHT").ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| if value > most || value.is_nan() { value } else { most })
}

/// Solves, certifies, and prints a row; returns bound over error of `z` and of `r`.
fn row<T: Scalar>(
    name: &str,
    (a, b, q): (impl Rows<T>, impl Rows<T>, Vec<T>),
    known: Option<[Vec<f64>; 2]>,
    limits: Limits,
) -> Result<[f64; 2], Error> {
    let omega = Omega::diagonal_ratio(T::one(), &a, &b)?;
    let mut solver = Solver::new(Auto::new(Hlcp::new(&a, &b, omega)?)?);
    let start = vec![T::one(); q.len()];
    let begin = Instant::now();
    let outcome = solver.solve(&q, Options::from_x(&start).limits(limits))?;
    let (solve, begin) = (begin.elapsed().as_secs_f64(), Instant::now());
    let (z, r) = (solver.z().to_vec(), solver.r().to_vec());
    let certificate = certify(&a, &b, &q, &z, &r)?;
    let certify = begin.elapsed().as_secs_f64();
    let n = q.len();
    let certificate = match certificate {
        Ok(certificate) => certificate,
        Err(refusal) => {
            println!(
                "| {name} | {n} | {} | {refusal} | | | | | {certify:.2}/{solve:.2} |",
                outcome.status
            );
            return Ok([f64::NAN; 2]);
        }
    };
    let known = match known {
        Some(known) => known,
        None => {
            let floor = Limits { rounding: None, iterations: 2000, ..Limits::relative(0.0) };
            let _ = solver.solve(&q, Options::resume().limits(floor))?;
            [solver.z(), solver.r()].map(|v| v.iter().map(|v| v.wide()).collect())
        }
    };
    let ratio = [(&z, &known[0], &certificate.z), (&r, &known[1], &certificate.r)].map(
        |(found, known, bound)| {
            let error =
                largest(found.iter().zip(known).map(|(found, known)| (found.wide() - known).abs()));
            (error, largest(bound.iter().copied()) / error)
        },
    );
    let [z, r, open] = [Side::Z, Side::R, Side::Open].map(|side| certificate.count(side));
    println!(
        "| {name} | {n} | {} | {} | {:.1e} | {:.2} | {:.1e} | {:.2} | {z} {r} {open} | {certify:.3}/{solve:.3} = {:.2} |",
        outcome.status,
        certificate.bound,
        ratio[0].0,
        ratio[0].1,
        ratio[1].0,
        ratio[1].1,
        certify / solve
    );
    Ok(ratio.map(|r| r.1))
}

/// A problem and its solution, if that is planted.
type Known<T, A, B> = ((A, B, Vec<T>), Option<[Vec<f64>; 2]>);

fn planted<T: Scalar, A, B>(posed: Posed<T, A, B>) -> Known<T, A, B> {
    let Posed { a, b, q, z, r } = posed;
    ((a, b, q), Some([z, r].map(|v| v.iter().map(|v| v.wide()).collect())))
}

#[test]
fn bounds_are_tight_on_every_scene() -> Result<(), Error> {
    let most = unknowns(4_000);
    let absolute = Limits::absolute(1e-10);
    for m in [63, 255, 1023] {
        let n = m * m;
        if n > most {
            continue;
        }
        for shift in [4.0, 1.0, 0.0] {
            for symmetric in [true, false] {
                let (pair, known) =
                    planted(Example { symmetric, m, mu: shift, nu: shift }.pose_generic::<f64>()?);
                row(
                    &format!("example{} ({shift}, {shift})", 2 - u8::from(symmetric)),
                    pair,
                    known,
                    absolute,
                )?;
            }
        }
        for lcp in [true, false] {
            let (pair, known) = planted(Disc { lcp, m }.pose::<f64>()?);
            row(if lcp { "disc-lcp" } else { "disc-hlcp" }, pair, known, absolute)?;
        }
        row("obstacle", Obstacle { m: m + 2 }.pose::<f64>()?, None, absolute)?;
        for ecc in [0.1, 0.5, 0.9, 0.95] {
            row(
                &format!("journal-bearing {ecc}"),
                JournalBearing { nx: m, ny: m, ecc, b: 10.0 }.pose::<f64>()?,
                None,
                absolute,
            )?;
            for groove in [0.0, 218.0_f64] {
                let scene =
                    Bearing2d { nx: m, ny: m / 2, ecc, aspect: 1.0, groove: groove.to_radians() };
                row(&format!("bearing2d {ecc} {groove}°"), scene.pose::<f64>()?, None, absolute)?;
            }
        }
        row("slider", Slider { cells: n + 1 }.pose::<f64>()?, None, Limits::relative(1e-10))?;
    }
    Ok(())
}
