//! The program `hlcp`: solves scenes and problems from files, computes lubricating films, and draws
//! the charts and tables of the repository.
//!
//! # Exit status
//!
//! * 0 for success;
//! * 1 for bad input, and for a reproduction that finds its own result wrong;
//! * 2 for a solve that did not converge.
//!
//! # Not supported
//!
//! * Operators and splittings of your own: write a program with `hlcp-methods`.
//! * Matrix Market matrices that are not `coordinate`, `real` or `integer`, and `general` or
//!   `symmetric`; other formats of matrices.
//! * Films on other domains than a rectangle or a ring, with heat or with elastic walls.

mod chart;
mod film;
mod lab;
mod memory;
mod print;
mod progress;
mod scenes;
mod solve;

use std::{
    io::{self, Write},
    process::ExitCode,
};

use clap::{Parser, Subcommand, error::ErrorKind};
use hlcp::files::printable;

/// A value, or an error that is told in one line.
type Fallible<V> = Result<V, Box<dyn std::error::Error>>;

const EXAMPLES: &str = "\
Examples:
  hlcp solve --scene bearing2d --method AUTO
  hlcp solve --help";

/// Horizontal linear complementarity problems: A z − B r + q = 0 with z, r ≥ 0 and zᵀr = 0
#[derive(Parser)]
#[command(name = "hlcp", version, after_help = EXAMPLES)]
struct CommandLine {
    /// With --version: the system, the features and the instruction sets too, as a report needs
    /// them
    #[arg(long, requires = "version")]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Solve(Box<solve::Arguments>),
    Film(Box<film::Arguments>),
    Paper(lab::paper::Arguments),
    SpeedVsAccuracy(lab::speed_vs_accuracy::Arguments),
    StabilityMap(lab::stability_map::Arguments),
    Comparison(lab::comparison::Arguments),
    Families(lab::families::Arguments),
    Films(lab::films::Arguments),
    Gallery(lab::gallery::Arguments),
    Charts(lab::charts::Arguments),
    Scenes(lab::scenes::Arguments),
    Modulus(lab::modulus::Arguments),
}

fn main() -> ExitCode {
    let done = match CommandLine::try_parse() {
        Ok(CommandLine { command, .. }) => run(command),
        Err(error) => return refuse(&error),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(2),
        Err(error) => match error.downcast::<clap::Error>() {
            Ok(error) => refuse(&error),
            Err(error) => {
                say(format!("error: {error}"));
                ExitCode::from(1)
            }
        },
    }
}

/// Refuses to run once more on each process of `mpirun`, with the same files to write, what does
/// not share its work.
fn refuse_copies(command: &Command) -> Fallible<()> {
    // Of Open MPI, and of MPICH and those made from it.
    let sizes = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"].map(std::env::var);
    let count = sizes.into_iter().flatten().find_map(|size| size.parse().ok()).unwrap_or(1_usize);
    let shares = cfg!(feature = "mpi");
    let what = match command {
        Command::Solve(_) if shares => return Ok(()),
        Command::Solve(_) => "hlcp without the feature mpi",
        Command::Film(_) => "hlcp film",
        _ => "this command",
    };
    if count > 1 {
        let reason = format!("{what} works on one process, but mpirun has started {count}");
        return Err(format!("{reason}; leave mpirun out").into());
    }
    Ok(())
}

/// Runs the command; whether all that was to converge did.
fn run(command: Command) -> Fallible<bool> {
    refuse_copies(&command)?;
    match command {
        Command::Solve(arguments) => return solve::run(&arguments),
        Command::Film(arguments) => return film::run(*arguments),
        Command::Paper(arguments) => lab::paper::run(&arguments)?,
        Command::SpeedVsAccuracy(arguments) => lab::speed_vs_accuracy::run(&arguments)?,
        Command::StabilityMap(arguments) => lab::stability_map::run(&arguments)?,
        Command::Comparison(arguments) => lab::comparison::run(&arguments)?,
        Command::Families(arguments) => lab::families::run(&arguments)?,
        Command::Films(arguments) => lab::films::run(&arguments)?,
        Command::Gallery(arguments) => lab::gallery::run(&arguments)?,
        Command::Charts(arguments) => lab::charts::run(&arguments)?,
        Command::Scenes(arguments) => lab::scenes::run(&arguments)?,
        Command::Modulus(arguments) => lab::modulus::run(&arguments)?,
    }
    Ok(true)
}

/// Prints the help or the version, or says in one line what is wrong with the command line.
fn refuse(error: &clap::Error) -> ExitCode {
    // Without a command the help is the answer.
    let is_help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if is_help || !error.use_stderr() {
        let is_verbose = error.kind() == ErrorKind::DisplayVersion
            && std::env::args_os().any(|argument| argument == "--verbose");
        let printed =
            if is_verbose { write!(io::stdout(), "{error}{}", about()) } else { error.print() };
        return match printed {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                say(format!("error: {error}"));
                ExitCode::from(1)
            }
            _ if is_help => ExitCode::from(1),
            _ => ExitCode::SUCCESS,
        };
    }
    let text = error.to_string();
    let reason =
        text.lines().take_while(|line| !line.starts_with("Usage") && !line.starts_with("For"));
    let words = reason.map(str::trim).filter(|line| !line.is_empty());
    // Of all that a profile does not take, the first is what was given.
    let is_of_plane =
        error.kind() == ErrorKind::ArgumentConflict && text.contains("'[PROFILE]' cannot be used");
    let most = if is_of_plane { 2 } else { usize::MAX };
    let way_out = "; in two dimensions the gap is given by --map, --journal or --pad";
    let way_out = if text.contains("'[PROFILE]'") { way_out } else { "" };
    say(words.take(most).collect::<Vec<_>>().join(" ") + way_out);
    ExitCode::from(1)
}

/// Returns what a report of a fault needs to know, beside the version.
fn about() -> String {
    use std::env::consts::{ARCH, OS};
    #[cfg(target_arch = "x86_64")]
    let sets = [
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let sets = [("neon", cfg!(target_feature = "neon"))];
    let found = |list: &[(&'static str, bool)]| {
        let names: Vec<_> = list.iter().filter(|(_, is)| *is).map(|(name, _)| *name).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(" ") }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    format!(
        "target: {ARCH}-{OS}, {build}\nfeatures: {}\ninstruction sets: {}\nthreads: {threads}\n",
        found(&[("mpi", cfg!(feature = "mpi"))]),
        found(&sets),
    )
}

/// Runs on so many threads.
fn on_threads<V: Send>(threads: u16, run: impl FnOnce() -> Fallible<V> + Send) -> Fallible<V> {
    if threads == 1 {
        return run();
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build()?;
    Ok(pool.install(|| run().map_err(|error| error.to_string()))?)
}

/// Says in one line on stderr what may hold the names of files.
fn say(line: impl std::fmt::Display) {
    let _ = writeln!(io::stderr(), "{}", printable(line));
}
