//! `hlcp films`: textured films of growing size, by Newton's method with algebraic multigrid.
//!
//! Sliders with square dimples, and the dimpled pad of T. Woloszynski, P. Podsiadlo and G. W.
//! Stachowiak (Tribology Letters 58, 2015): outer and inner iterations, seconds and bytes. With the
//! feature `faer` their own method, Fischer–Burmeister–Newton–Schur, runs beside ours up to 511².

use std::{error::Error, fmt::Write as _, fs, path::PathBuf, time::Instant};

use clap::Args;
use hlcp_core::{Aor, Hlcp, Omega};
use hlcp_methods::{AmgNewton, Limits, Solver, Tmms};
use hlcp_verify::{Film, Side};

#[cfg(feature = "faer")]
use crate::direct;
use crate::{
    chart::{provenance, save},
    print,
    progress::counting,
};

const EXAMPLES: &str = "\
Examples:
  hlcp films --quick
  hlcp films --threads 2 --out target/films";

/// Measure the solve of textured films of growing size
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Small films
    #[arg(long)]
    quick: bool,
    /// How many threads share the work
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// The folder for the table
    #[arg(long, default_value = "target/films")]
    out: PathBuf,
}

/// The relative residual that all solve to.
const TOLERANCE: f64 = 1e-10;

/// The most cells that the peer is run on.
#[cfg(feature = "faer")]
const PEER: usize = 512 * 512;

/// A square slider of 10 mm, 11 µm at the inlet and 10 µm at the outlet, with `k` square dimples
/// along `x` and as many for the same length along `y`, of `depth` times the gap at the outlet.
pub(crate) fn slider([nx, ny]: [usize; 2], k: usize, depth: f64) -> Film {
    let rows = (k * ny) as f64 / nx as f64;
    let cell = 1e-2 / nx as f64;
    let mut film = Film::new([nx, ny], [1e-2, cell * ny as f64], 1.0, 0.01);
    let is_inside = |at: f64| (at - at.floor() - 0.5).abs() < 0.25;
    for (at, gap) in film.gap.iter_mut().enumerate() {
        let x = ((at % nx) as f64 + 0.5) / nx as f64;
        let y = ((at / nx) as f64 + 0.5) / ny as f64;
        let is_dimple = is_inside(k as f64 * x) && is_inside(rows * y);
        *gap = 1e-5 * (1.1 - 0.1 * x + if is_dimple { depth } else { 0.0 });
    }
    film
}

/// The dimpled pad: 80 × 80 mm, parallel, 15 µm, with `k × k` dimples of 12 µm on the middle 20 of
/// each 30 × 30 cells, at half that depth in the ring of cells around.
pub(crate) fn pad(k: usize) -> Film {
    let m = 30 * k;
    let depth = |at: usize| match at % 30 {
        5..25 => 2_u8,
        4 | 25 => 1,
        _ => 0,
    };
    Film {
        gap: (0..m * m)
            .map(|at| 15e-6 + 6e-6 * f64::from(depth(at % m).min(depth(at / m))))
            .collect(),
        sides: [Side::Pressure(1e5); 4],
        cavitation: 3e4,
        ..Film::new([m, m], [0.08, 0.08], 5.0, 0.03)
    }
}

/// What became of a film.
struct Row {
    title: String,
    n: usize,
    outer: usize,
    inner: usize,
    walks: usize,
    seconds: f64,
    bytes: Option<u64>,
    /// What flows in without a way out, over what flows in.
    imbalance: f64,
    load: f64,
    converged: bool,
    peer: Option<Peer>,
}

/// What became of it by Fischer–Burmeister–Newton–Schur.
struct Peer {
    outer: usize,
    seconds: f64,
    bytes: Option<u64>,
    load: f64,
    reached: bool,
}

/// The seconds that this thread has had a processor, where the system says it.
fn processor() -> Option<f64> {
    let line = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    line.split_whitespace().next()?.parse::<f64>().ok().map(|nanoseconds| 1e-9 * nanoseconds)
}

/// What `run` returns, its seconds, those of the processor unless threads share the work, and the
/// most bytes that the process held meanwhile, where the system says it.
fn measured<R>(shares: bool, run: impl FnOnce() -> R) -> (R, f64, Option<u64>) {
    // Linux forgets the peak when told so.
    let knows = fs::write("/proc/self/clear_refs", "5").is_ok();
    let begin = (Instant::now(), processor());
    let result = run();
    let seconds = match (begin.1, processor()) {
        (Some(begin), Some(end)) if !shares => end - begin,
        _ => begin.0.elapsed().as_secs_f64(),
    };
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = peak.and_then(|words| words.split_whitespace().next()?.parse::<u64>().ok());
    (result, seconds, kilobytes.filter(|_| knows).map(|kilobytes| 1024 * kilobytes))
}

fn solve(title: String, film: &Film, threads: u16) -> Result<Row, Box<dyn Error>> {
    let (a, b, q) = film.pose()?;
    let ambient = match film.sides[0] {
        Side::Pressure(pressure) => pressure,
        _ => 0.0,
    };
    let by_amg = || -> Result<_, hlcp_core::Error> {
        let mut problem = Hlcp::new(&a, &b, Omega::diagonal_ratio(1.0, &a, &b)?)?;
        if threads > 1 {
            problem = problem.in_parallel();
        }
        let mut solver = Solver::new(AmgNewton::new(Tmms::mirrored(
            problem,
            Aor::gauss_seidel().accelerated(),
        )?)?);
        let limits = Limits { rounding: Some(4.0), ..Limits::relative(TOLERANCE) };
        let outcome = solver.solve(&q, limits)?;
        Ok((outcome, film.figures(solver.z(), solver.r(), ambient)))
    };
    let (solved, seconds, bytes) = measured(threads > 1, by_amg);
    let (outcome, figures) = solved?;
    let drawn: f64 = figures.sides.iter().map(|flow| (-flow).max(0.0)).sum();
    Ok(Row {
        title,
        n: q.len(),
        outer: outcome.iterations,
        inner: outcome.linear_iterations.unwrap_or(0),
        walks: outcome.sweeps,
        seconds,
        bytes,
        imbalance: figures.imbalance.abs() / drawn,
        load: figures.load,
        converged: outcome.converged(),
        peer: peer(film, ambient)?,
    })
}

#[cfg(not(feature = "faer"))]
fn peer(_: &Film, _: f64) -> Result<Option<Peer>, Box<dyn Error>> {
    Ok(None)
}

#[cfg(feature = "faer")]
fn peer(film: &Film, ambient: f64) -> Result<Option<Peer>, Box<dyn Error>> {
    if film.gap.len() > PEER {
        return Ok(None);
    }
    let (a, b, q) = film.pose()?;
    let goal = TOLERANCE * hlcp_core::Norms::of(&q).l2;
    let longest = std::time::Duration::from_secs(600);
    let form = direct::Form::FischerBurmeister;
    let (run, seconds, bytes) =
        measured(false, || direct::solve(form, [&a, &b], &q, goal, longest));
    let direct::Run { iterations: outer, reached, z, r, .. } = run?;
    let load = film.figures(&z, &r, ambient).load;
    Ok(Some(Peer { outer, seconds, bytes, load, reached }))
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let Arguments { quick, threads, out } = arguments;
    let sliders: &[([usize; 2], usize)] = if *quick {
        &[([31, 31], 2), ([63, 63], 4)]
    } else {
        &[
            ([127; 2], 4),
            ([256, 192], 8),
            ([255; 2], 8),
            ([511; 2], 8),
            ([511; 2], 16),
            ([1023; 2], 32),
        ]
    };
    let pads: &[usize] = if *quick { &[2, 3] } else { &[10, 20, 40, 80] };
    let bar = counting(sliders.len() + pads.len());
    let (mut rows, mut of_pads) = (vec![], vec![]);
    for &([nx, ny], k) in sliders {
        rows.push(solve(
            format!("slider, {nx} × {ny}, K = {k}"),
            &slider([nx, ny], k, 2.0),
            *threads,
        )?);
        bar.inc(1);
    }
    for &k in pads {
        of_pads.push(solve(format!("pad, K = {k}"), &pad(k), *threads)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let slope = |of: &[Row], cost: fn(&Row) -> f64| match of {
        [first, .., last] => {
            (cost(last) / cost(first)).ln() / (last.n as f64 / first.n as f64).ln()
        }
        _ => f64::NAN,
    };
    let exponents = [&rows, &of_pads]
        .map(|of| [slope(of, |row| row.seconds), slope(of, |row| row.walks as f64 * row.n as f64)]);
    rows.extend(of_pads);
    let mut flag = String::from(if *quick { " --quick" } else { "" });
    if *threads > 1 {
        write!(flag, " --threads {threads}")?;
    }
    let features = if cfg!(feature = "faer") { " --features faer" } else { "" };
    let command = format!("cargo run --release{features} -- films{flag}");
    let mut text = table(&rows, &provenance(&command))?;
    let [[sliders, by_walks], [pads, walks]] = exponents;
    writeln!(
        text,
        "\nBetween the first and the last, seconds grow as n^{sliders:.2} and walks over all rows as n^{by_walks:.2} \
         for sliders, n^{pads:.2} and n^{walks:.2} for pads."
    )?;
    if !cfg!(feature = "faer") {
        writeln!(text, "Fischer–Burmeister–Newton–Schur was left out: it needs --features faer.")?;
    }
    print::line(&text)?;
    save(&out.join("films.md"), &text)?;
    match rows.iter().find(|row| !row.converged) {
        Some(row) => Err(format!("{} did not converge", row.title).into()),
        None => Ok(()),
    }
}

fn table(rows: &[Row], provenance: &str) -> Result<String, std::fmt::Error> {
    let mut text = format!(
        "# Textured films\n\n{provenance}\n\nTo 10⁻¹⁰ ‖q‖₂.\n\n\
         | film | cells | outer | inner | walks | seconds | MB | imbalance | FBNS: outer | seconds | MB | times ours | load apart |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n"
    );
    let megabytes =
        |bytes: Option<u64>| bytes.map_or(String::from("–"), |bytes| (bytes >> 20).to_string());
    for row in rows {
        let Row { title, n, outer, inner, walks, seconds, bytes, imbalance, load, .. } = row;
        write!(
            text,
            "| {title} | {n} | {outer} | {inner} | {walks} | {seconds:.3} | {} | {imbalance:.1e} |",
            megabytes(*bytes)
        )?;
        match &row.peer {
            Some(peer) => {
                let Peer { outer, seconds: slow, bytes, reached, .. } = peer;
                let missed = if *reached { "" } else { ", not reached" };
                let [times, apart] = [slow / seconds, (peer.load / load - 1.0).abs()];
                let bytes = megabytes(*bytes);
                writeln!(
                    text,
                    " {outer}{missed} | {slow:.2} | {bytes} | {times:.1} | {apart:.1e} |"
                )?;
            }
            None => writeln!(text, " – | – | – | – | – |")?,
        }
    }
    Ok(text)
}
