//! `hlcp films`: textured films of growing size, by Newton's method with algebraic multigrid.
//!
//! Sliders with square dimples, and the dimpled pad of T. Woloszynski, P. Podsiadlo and G. W.
//! Stachowiak (Tribology Letters 58, 2015): outer and inner iterations, seconds and bytes. Up to
//! 511² their own method, Fischer–Burmeister–Newton–Schur, solves the same films.

use std::{fs, path::PathBuf, time::Duration};

use clap::Args;
use hlcp_methods::{Limits, Named, Outcome};
use hlcp_verify::{Film, Side};

use super::{
    peers,
    run::{self, Run},
    table::Table,
};
use crate::{
    Fallible,
    chart::{provenance, save},
    on_threads, print,
    progress::counting,
    scenes::{Problem, textured},
};

const EXAMPLES: &str = "\
Examples:
  hlcp films --quick
  hlcp films --threads 2 --out target/films";

/// Measure the solve of textured films of growing size
#[derive(Args)]
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
const PEER: usize = 512 * 512;

/// The dimpled pad: 80 × 80 mm, parallel, 15 µm, with `k × k` dimples of 12 µm on the middle 20 of
/// each 30 × 30 cells, at half that depth in the ring of cells around.
fn pad(k: usize) -> Film {
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

/// What became of a film, and the most bytes that the process held meanwhile.
struct Row {
    title: String,
    n: usize,
    run: Run,
    bytes: Option<u64>,
    /// What flows in without a way out, over what flows in.
    imbalance: f64,
    load: f64,
    /// The run, the bytes and the load by Fischer–Burmeister–Newton–Schur.
    peer: Option<(Run, Option<u64>, f64)>,
}

/// The seconds that this thread has had a processor, where the system says it.
fn processor() -> Option<f64> {
    let line = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    line.split_whitespace().next()?.parse::<f64>().ok().map(|nanoseconds| 1e-9 * nanoseconds)
}

/// Returns what `run` returns, with the seconds of the processor unless threads share the work, and
/// the most bytes that the process held meanwhile, where the system says it.
fn measured(shares: bool, run: impl FnOnce() -> Fallible<Run>) -> Fallible<(Run, Option<u64>)> {
    // Linux forgets the peak when told so.
    let knows = fs::write("/proc/self/clear_refs", "5").is_ok();
    let begin = processor();
    let mut run = run()?;
    if let (Some(begin), Some(end), false) = (begin, processor(), shares) {
        run.seconds = vec![end - begin];
    }
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = peak.and_then(|words| words.split_whitespace().next()?.parse::<u64>().ok());
    Ok((run, kilobytes.filter(|_| knows).map(|kilobytes| 1024 * kilobytes)))
}

impl Row {
    fn new(title: String, film: &Film, threads: u16) -> Fallible<Self> {
        let (a, b, q) = film.pose()?;
        let problem = Problem { start: 0.0, ..Problem::new(a, b, q) };
        let ambient = match film.sides[0] {
            Side::Pressure(pressure) => pressure,
            _ => 0.0,
        };
        let limits = Limits { rounding: Some(4.0), ..Limits::relative(TOLERANCE) };
        let amg: Named = "AMG".parse()?;
        let (run, bytes) = measured(threads > 1, || {
            let make = || {
                let mut posed = problem.hlcp(1.0)?;
                if threads > 1 {
                    posed = posed.in_parallel();
                }
                amg.on_dyn(posed)
            };
            Ok(run::run(&problem, &limits, make)?)
        })?;
        let figures = |run: &Run| film.figures(&run.answer[0], &run.answer[1], ambient);
        let found = figures(&run);
        let drawn: f64 = found.sides.iter().map(|flow| (-flow).max(0.0)).sum();
        let (n, mut peer) = (problem.q.len(), None);
        if n <= PEER {
            let limits = Limits { time: Some(Duration::from_secs(600)), ..limits };
            let (run, bytes) = measured(false, || peers::fbns(&problem, &limits))?;
            let load = figures(&run).load;
            peer = Some((run, bytes, load));
        }
        let (imbalance, load) = (found.imbalance.abs() / drawn, found.load);
        Ok(Self { title, n, run, bytes, imbalance, load, peer })
    }
}

pub(crate) fn run(arguments: &Arguments) -> Fallible<()> {
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
    let of_sliders = sliders.iter().map(|&(cells @ [nx, ny], k)| {
        (format!("slider, {nx} × {ny}, K = {k}"), textured(cells, k, 2.0))
    });
    let of_pads = pads.iter().map(|&k| (format!("pad, K = {k}"), pad(k)));
    let mut rows = vec![];
    for (title, film) in of_sliders.chain(of_pads) {
        rows.push(on_threads(*threads, || Row::new(title, &film, *threads))?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let slope = |of: &[Row], cost: fn(&Row) -> f64| match of {
        [first, .., last] => {
            (cost(last) / cost(first)).ln() / (last.n as f64 / first.n as f64).ln()
        }
        _ => f64::NAN,
    };
    let walks = |row: &Row| row.run.outcome.sweeps as f64 * row.n as f64;
    let (of_sliders, of_pads) = rows.split_at(sliders.len());
    let [[sliders, by_walks], [pads, walks]] =
        [of_sliders, of_pads].map(|of| [slope(of, |row| row.run.median()), slope(of, walks)]);
    let mut flags = String::from(if *quick { " --quick" } else { "" });
    if *threads > 1 {
        flags += &format!(" --threads {threads}");
    }
    let provenance = provenance(&format!("cargo run --release -- films{flags}"));
    let table = table(&rows).markdown();
    let text = format!(
        "# Textured films\n\n{provenance}\n\nTo 10⁻¹⁰ ‖q‖₂.\n\n{table}\n\
         Between the first and the last, seconds grow as n^{sliders:.2} and walks over all rows as n^{by_walks:.2} \
         for sliders, n^{pads:.2} and n^{walks:.2} for pads.\n"
    );
    print::line(&text)?;
    save(&out.join("films.md"), &text)?;
    match rows.iter().find(|row| !row.run.converged()) {
        Some(row) => Err(format!("{} did not converge", row.title).into()),
        None => Ok(()),
    }
}

fn table(rows: &[Row]) -> Table {
    let mut table = Table::new(
        "film | cells | outer | inner | walks | seconds | MB | imbalance | FBNS: outer | seconds | MB | times ours | load apart",
    );
    let megabytes =
        |bytes: Option<u64>| bytes.map_or(String::from("–"), |bytes| (bytes >> 20).to_string());
    for row in rows {
        let Row { title, n, run, bytes, imbalance, load, peer } = row;
        let Outcome { iterations, sweeps, linear_iterations, .. } = run.outcome;
        let (inner, seconds) = (linear_iterations.unwrap_or(0), run.median());
        let peer =
            peer.as_ref().map_or("–|–|–|–|–".to_owned(), |(run, bytes, load_by_peer)| {
                let (outer, slow) = (run.outcome.iterations, run.median());
                let missed = if run.converged() { "" } else { ", not reached" };
                let [times, apart] = [slow / seconds, (load_by_peer / load - 1.0).abs()];
                format!("{outer}{missed}|{slow:.2}|{}|{times:.1}|{apart:.1e}", megabytes(*bytes))
            });
        table.row(&format!(
            "{title}|{n}|{iterations}|{inner}|{sweeps}|{seconds:.3}|{}|{imbalance:.1e}|{peer}",
            megabytes(*bytes)
        ));
    }
    table
}
