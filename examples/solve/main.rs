//! Solves a scene, or a problem given as files, by methods of the paper.
//!
//! ```text
//! cargo run --release --example solve
//! cargo run --release --example solve -- --scene example2 --m 128 --method TMAOR --alpha 1.1 --beta 0.9
//! cargo run --release --example solve -- --scene slider --m 128 --method TMGSSOR3
//! cargo run --release --example solve -- --a A.mtx --b B.mtx --q q.mtx --method TMGS --out-z z.mtx --out-r r.mtx
//! ```
//!
//! Without arguments: Example 1 (μ = ν = 4) on a 512 × 512 grid by MGS, AMGS and TMGS in both precisions.
//! Scenes are matrix-free; files are Matrix Market files, and without `--b` the problem is the LCP.
//! The exit status is 0 when every solve converged, 2 when one did not, 1 for bad input.

mod arguments;
mod choice;
#[path = "../print/mod.rs"]
mod print;
mod report;
mod scenes;

use std::{
    error::Error,
    io::{self, Write},
    ops::ControlFlow,
    process::ExitCode,
    time::Duration,
};

use arguments::{Arguments, NormName, Precision};
use choice::Choice;
use clap::error::ErrorKind;
use hlcp_core::{Hlcp, Omega, Rows, Scalar, files::printable, market};
use hlcp_methods::{Limits, Method, Norm, Options, Outcome, Progress, Solver, Tolerance};
use hlcp_verify::{Certificate, certify, convergence};
use indicatif::ProgressBar;
use scenes::Given;
use serde_json::json;

fn main() -> ExitCode {
    let arguments = match Arguments::given() {
        Ok(arguments) => arguments,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp) => {
            // Its reader has gone, or there is none to tell.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        Err(error) => return refuse(&one_line(&error)),
    };
    match in_pool(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(2),
        Err(error) => refuse(&format!("error: {error}")),
    }
}

/// Says in one line what is wrong, which may hold the names of files.
fn refuse(reason: &str) -> ExitCode {
    let _ = writeln!(io::stderr(), "{}", printable(reason));
    ExitCode::from(1)
}

/// Runs on as many threads as were asked for.
fn in_pool(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    if arguments.threads == 1 {
        return run(arguments);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.into()).build()?;
    Ok(pool.install(|| run(arguments).map_err(|error| error.to_string()))?)
}

/// What a refused command line comes down to.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let reason =
        text.lines().take_while(|line| !line.starts_with("Usage") && !line.starts_with("For"));
    reason.map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// What is to be solved how often, and what became of it so far.
struct Run<'r> {
    arguments: &'r Arguments,
    choices: Vec<Choice>,
    rows: usize,
    all_converged: bool,
}

/// Solves what was asked for and prints it; whether all of it converged.
fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    arguments.check()?;
    let parse = |name: &str| Choice::parse(name, arguments);
    let choices = match &arguments.method {
        Some(name) => vec![parse(name)?],
        None => ["MGS", "AMGS", "TMGS"].into_iter().map(parse).collect::<Result<_, _>>()?,
    };
    let mut run = Run { arguments, choices, rows: 0, all_converged: true };
    for precision in arguments.precisions() {
        match precision {
            Precision::F64 => run.load::<f64>(precision)?,
            Precision::F32 => run.load::<f32>(precision)?,
        }
    }
    Ok(run.all_converged)
}

impl Run<'_> {
    fn solve<T: Scalar, A: Rows<T>, B: Rows<T>>(
        &mut self,
        precision: Precision,
        given: &Given<'_, T, A, B>,
    ) -> Result<(), Box<dyn Error>> {
        let arguments = self.arguments;
        let to = |value: f64| T::from(value).ok_or("a number does not fit the precision");
        let x0 = match &arguments.x0 {
            Some(path) => market::read_vector(path, given.q.len())?,
            None => vec![T::one(); given.q.len()],
        };
        let norm = match arguments.norm {
            NormName::L2 => Norm::L2,
            NormName::Linf => Norm::LInf,
        };
        let (tolerance, rounding) = match (arguments.tol, arguments.rtol) {
            (Some(tolerance), _) => (Tolerance::Absolute(tolerance), Some(0.0)),
            (None, Some(tolerance)) => (Tolerance::Relative(tolerance), Some(0.0)),
            (None, None) => (given.tolerance, None),
        };
        let (iterations, time) = (arguments.max_iterations, arguments.max_seconds);
        let time = time.map(Duration::try_from_secs_f64).transpose();
        let time = time.map_err(|_| "--max-seconds must be a number of seconds, 0 or more")?;
        let limits = Limits { tolerance, rounding, norm, iterations, time };
        let omega = Omega::diagonal_ratio(to(arguments.tau)?, given.a, given.b)?;
        let mut problem = Hlcp::new(given.a, given.b, omega)?.with_gamma(to(arguments.gamma)?)?;
        if arguments.threads > 1 {
            problem = problem.in_parallel();
        }
        for choice in &self.choices {
            let mut solver = Solver::new(choice.on(problem.clone())?);
            let mut q = given.q.to_vec();
            let mut solves = Vec::new();
            for _ in 0..arguments.repeats {
                solves.push(march(&choice.name, &mut solver, given, &mut q, &x0, &limits)?);
            }
            solves.sort_by_key(|outcome| outcome.elapsed);
            let outcome = &solves[solves.len() / 2];
            let error = given
                .known
                .map(|[z, r]| report::distance(solver.z(), z).max(report::distance(solver.r(), r)));
            let figures = (given.figures)(solver.z(), solver.r());
            let certificate = if arguments.certify {
                certify(given.a, given.b, &q, solver.z(), solver.r())?
            } else {
                None
            };
            // Before anything is printed, because a reader that goes away ends the program.
            let outputs = [(&arguments.out_z, solver.z()), (&arguments.out_r, solver.r())];
            let outputs: Vec<_> = outputs
                .iter()
                .filter_map(|(path, vector)| Some((path.as_deref()?, *vector)))
                .collect();
            market::write_vectors(&outputs)?;
            if arguments.json {
                let mut object =
                    report::object(arguments, given, choice, precision, outcome, error);
                for (key, value) in figures {
                    object[key] = value.into();
                }
                if arguments.certify {
                    object["certified_error_bound"] =
                        json!(certificate.as_ref().map(Certificate::error));
                }
                print::line(&object)?;
            } else {
                if self.rows == 0 {
                    report::head(arguments, given.name, given.q.len())?;
                }
                report::row(&choice.name, precision, outcome, error)?;
                for (key, value) in figures {
                    print::line(format_args!("          {key} {value:.6e}"))?;
                }
                if arguments.certify {
                    print::line(match choice.steps() {
                        Some(steps) => format!("  {}", convergence(&problem, &steps)),
                        None => {
                            "  convergence: not proved, because the check does not cover the method"
                                .into()
                        }
                    })?;
                    print::line(match certificate {
                        Some(certificate) => format!("  {certificate}"),
                        None => "  solution unique: not proved; certified error: none".into(),
                    })?;
                }
            }
            self.rows += 1;
            self.all_converged &= outcome.converged();
        }
        Ok(())
    }
}

/// Solves the problems of a scene one after another, each from the answer before, until one does not converge, and leaves
/// the last right-hand side in `q`; the outcome is that of all of them, with the residual of the last.
fn march<T: Scalar, M: Method<T>, A, B>(
    name: &str,
    solver: &mut Solver<T, M>,
    given: &Given<'_, T, A, B>,
    q: &mut [T],
    x0: &[T],
    limits: &Limits,
) -> Result<Outcome, Box<dyn Error>> {
    let bar = ProgressBar::new_spinner();
    let mut show = |progress: &Progress<'_, T>| {
        if progress.iteration.is_multiple_of(64) {
            bar.set_message(format!(
                "{name}: iteration {}, residual {:.1e}",
                progress.iteration, progress.residual.l2
            ));
            bar.tick();
        }
        ControlFlow::Continue(())
    };
    q.copy_from_slice(given.q);
    let options = Options::from_x(x0).limits(*limits).observer(&mut show);
    let mut outcome = solver.solve(q, options)?;
    let (count, next) = given.march;
    for k in 1..count {
        if !outcome.converged() {
            break;
        }
        next(k, solver.z(), q);
        let options = Options::resume().limits(*limits).observer(&mut show);
        let step = solver.solve(q, options)?;
        let linear = outcome.linear_iterations.zip(step.linear_iterations);
        outcome = Outcome {
            iterations: outcome.iterations + step.iterations,
            sweeps: outcome.sweeps + step.sweeps,
            linear_iterations: linear.map(|(sum, more)| sum + more),
            elapsed: outcome.elapsed + step.elapsed,
            ..step
        };
    }
    bar.finish_and_clear();
    Ok(outcome)
}
