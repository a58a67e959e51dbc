//! How the benchmarks measure: rivals run in turns, and each figure is the median of the ratios of
//! the turns.
#![allow(dead_code, reason = "each benchmark uses its own part")]

use std::{hint::black_box, time::Instant};

use hlcp_core::{Error, FivePoint, Varying};
use hlcp_methods::{Limits, Method, Options, Solver};
use rayon::ThreadPool;

pub(crate) const TURNS: usize = 11;

/// What a sweep returns is used.
pub(crate) fn done<R>(result: R) {
    black_box(result);
}

/// Seconds of one run over an m × m grid, from as many as take some milliseconds.
pub(crate) fn seconds(m: usize, mut run: impl FnMut()) -> f64 {
    let repeats = (2_000_000 / (m * m)).max(1);
    let start = Instant::now();
    (0..repeats).for_each(|_| run());
    start.elapsed().as_secs_f64() / repeats as f64
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The median over turns of the first time over the second, and the median of the first.
pub(crate) fn against(
    mut ours: impl FnMut() -> f64,
    mut theirs: impl FnMut() -> f64,
) -> (f64, f64) {
    let turns: Vec<[f64; 2]> = (0..TURNS).map(|_| [ours(), theirs()]).collect();
    let ratio = median(turns.iter().map(|[ours, theirs]| ours / theirs).collect());
    (ratio, median(turns.iter().map(|[ours, _]| *ours).collect()))
}

/// Solves from x⁰ = e to 10⁻¹⁰ on one thread and, by the second solver, on those of `pool`, with
/// the same bits: the ratio of the seconds, and those of one thread.
pub(crate) fn solved_on<M: Method<f64> + Send>(
    pool: &ThreadPool,
    [mut alone, mut together]: [Solver<f64, M>; 2],
    q: &[f64],
) -> (f64, f64) {
    let start = vec![1.0; q.len()];
    let seconds = |solver: &mut Solver<f64, M>| {
        let options = Options::from_x(&start).limits(Limits::absolute(1e-10));
        solver.solve(q, options).expect("valid input").elapsed.as_secs_f64()
    };
    let times = against(|| seconds(&mut alone), || pool.install(|| seconds(&mut together)));
    assert!(alone.x() == together.x(), "the same bits");
    times
}

/// Prints a row: the ratio of two rivals, and nanoseconds for each of `n` unknowns.
pub(crate) fn row(what: &str, rival: &str, target: &str, n: usize, (ratio, time): (f64, f64)) {
    println!("| {what} | {rival} | {ratio:.2} | {target} | {:.3} |", time / n as f64 * 1e9);
}

/// A five-point operator on m × m points whose coefficients are around those of Example 1.
pub(crate) fn varying(m: usize, seed: f64) -> Result<FivePoint<Varying<f64>>, Error> {
    FivePoint::from_fn(m, m, |i, j| {
        let v = 0.1 * (seed + (j * m + i) as f64).sin();
        [v - 1.0, v - 0.9, 8.0 + v, v - 0.8, v - 1.1]
    })
}

/// The processor, the compiler and the day.
pub(crate) fn machine() -> String {
    let shell = |program: &str, arguments: &[&str]| {
        let output = std::process::Command::new(program).args(arguments).output().ok()?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("unknown");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!(
        "{} ({cores} cores), {}, {}",
        model.trim_start_matches([' ', '\t', ':']),
        shell("rustc", &["--version"]).unwrap_or_default(),
        shell("date", &["-u", "+%Y-%m-%d"]).unwrap_or_default()
    )
}
