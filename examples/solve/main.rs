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
mod report;

use std::{error::Error, ops::ControlFlow, process::ExitCode};

use arguments::{Arguments, NormName, Precision, SHIFT, Scene};
use choice::Choice;
use clap::{Parser, error::ErrorKind};
use hlcp_core::{Hlcp, Identity, LinearOperator, Omega, Rows, Scalar, market};
use hlcp_methods::{Limits, Method, Norm, Outcome, Solver};
use hlcp_verify::{Certificate, Disc, Example, Posed, Slider, certify, convergence};
use indicatif::ProgressBar;
use serde_json::json;

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp) => {
            print!("{error}");
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            eprintln!("{}", one_line(&error));
            return ExitCode::from(1);
        }
    };
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(2),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(1)
        }
    }
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

/// What a scene reads off its solution, under the names it has in a report.
type Figures<'g, T> = &'g dyn Fn(&[T], &[T]) -> Vec<(&'static str, f64)>;

/// A problem in one precision.
struct Given<'g, T, A, B> {
    name: &'static str,
    a: &'g A,
    b: &'g B,
    q: &'g [T],
    /// z* and r*.
    known: Option<[&'g [T]; 2]>,
    /// The tolerance relative to ‖q‖ where none is given.
    relative: f64,
    figures: Figures<'g, T>,
}

/// Solves what was asked for and prints it; whether all of it converged.
fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    arguments.check()?;
    let parse = |name: &str| Choice::parse(name, arguments.parameters());
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
    /// Poses the scene, or reads the files, and solves by every method.
    fn load<T: Scalar>(&mut self, precision: Precision) -> Result<(), Box<dyn Error>> {
        let arguments = self.arguments;
        let m = arguments.m.into();
        if let (Some(a), Some(q)) = (&arguments.a, &arguments.q) {
            let a = &market::read_matrix::<T>(a)?;
            let q = &market::read_vector(q, a.order())?;
            return match &arguments.b {
                Some(b) => {
                    self.solve(precision, &Given::new("file", a, &market::read_matrix(b)?, q))
                }
                None => {
                    let identity = Identity { order: a.order() };
                    self.solve(precision, &Given::new("file", a, &identity, q))
                }
            };
        }
        let (name, posed) = match arguments.scene {
            Scene::Slider => {
                let slider = Slider { cells: m };
                let (a, b, q) = &slider.pose::<T>()?;
                let given = Given {
                    relative: 1e-10,
                    figures: &|z, _| film(&slider, z).to_vec(),
                    ..Given::new("slider", a, b, q)
                };
                return self.solve(precision, &given);
            }
            Scene::DiscLcp => ("disc-lcp", Disc { lcp: true, m }.pose::<T>()?),
            Scene::DiscHlcp => ("disc-hlcp", Disc { lcp: false, m }.pose::<T>()?),
            Scene::Example1 | Scene::Example2 => {
                let symmetric = arguments.scene == Scene::Example1;
                let [mu, nu] = [arguments.mu, arguments.nu].map(|shift| shift.unwrap_or(SHIFT));
                let name = if symmetric { "example1" } else { "example2" };
                (name, Example { symmetric, m, mu, nu }.pose::<T>()?)
            }
        };
        let Posed { a, b, q, z, r } = &posed;
        self.solve(precision, &Given { known: Some([z, r]), ..Given::new(name, a, b, q) })
    }

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
        let mut limits = Limits { iterations: arguments.max_iterations, ..Limits::<T>::default() };
        limits.norm = match arguments.norm {
            NormName::L2 => Norm::L2,
            NormName::Linf => Norm::LInf,
        };
        limits.relative = limits.relative.max(to(given.relative)?);
        if let Some(tolerance) = arguments.tol {
            (limits.absolute, limits.rounding) = (to(tolerance)?, T::zero());
        }
        let omega = Omega::diagonal_ratio(to(arguments.tau)?, given.a, given.b)?;
        let problem = Hlcp::new(given.a, given.b, omega)?.with_gamma(to(arguments.gamma)?)?;
        for choice in &self.choices {
            let mut solver = Solver::new(choice.on(problem.clone())?);
            let outcome = self.median(&choice.name, &mut solver, given.q, &x0, &limits)?;
            let error = given
                .known
                .map(|[z, r]| report::distance(solver.z(), z).max(report::distance(solver.r(), r)));
            let figures = (given.figures)(solver.z(), solver.r());
            let certificate = if arguments.certify {
                certify(given.a, given.b, given.q, solver.z(), solver.r())?
            } else {
                None
            };
            if arguments.json {
                let mut object =
                    report::object(arguments, given, choice, precision, &outcome, error);
                for (key, value) in figures {
                    object[key] = value.into();
                }
                if arguments.certify {
                    object["certified_error_bound"] =
                        json!(certificate.as_ref().map(Certificate::error));
                }
                report::line(&object)?;
            } else {
                if self.rows == 0 {
                    report::head(arguments, given.name, given.q.len())?;
                }
                report::row(&choice.name, precision, &outcome, error)?;
                for (key, value) in figures {
                    report::line(&format_args!("          {key} {value:.6e}"))?;
                }
                if arguments.certify {
                    report::line(&format_args!("  {}", convergence(&problem, &choice.steps())))?;
                    report::line(&match certificate {
                        Some(certificate) => format!("  {certificate}"),
                        None => "  solution unique: not proved; certified error: none".into(),
                    })?;
                }
            }
            self.rows += 1;
            self.all_converged &= outcome.converged();
            let outputs = [(&arguments.out_z, solver.z()), (&arguments.out_r, solver.r())];
            let outputs: Vec<_> = outputs
                .iter()
                .filter_map(|(path, vector)| Some((path.as_deref()?, *vector)))
                .collect();
            market::write_vectors(&outputs)?;
        }
        Ok(())
    }

    /// The outcome of a solve, in the median of the times that the repeats take.
    fn median<T: Scalar, M: Method<T>>(
        &self,
        name: &str,
        solver: &mut Solver<T, M>,
        q: &[T],
        x0: &[T],
        limits: &Limits<T>,
    ) -> Result<Outcome, Box<dyn Error>> {
        let bar = ProgressBar::new_spinner();
        let mut outcomes = Vec::new();
        for _ in 0..self.arguments.repeats {
            outcomes.push(solver.solve_observed(q, x0, limits, |progress| {
                if progress.iteration % 64 == 0 {
                    bar.set_message(format!(
                        "{name}: iteration {}, residual {:.1e}",
                        progress.iteration, progress.residual.l2
                    ));
                    bar.tick();
                }
                ControlFlow::Continue(())
            })?);
        }
        bar.finish_and_clear();
        outcomes.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        Ok(outcomes.swap_remove(outcomes.len() / 2))
    }
}

impl<'g, T, A, B> Given<'g, T, A, B> {
    /// A problem of which no more is known.
    fn new(name: &'static str, a: &'g A, b: &'g B, q: &'g [T]) -> Self {
        Self { name, a, b, q, known: None, relative: 0.0, figures: &|_, _| Vec::new() }
    }
}

/// What is read off the slider's film, in SI units, and its errors against the continuous problem.
fn film<T: Scalar>(slider: &Slider, z: &[T]) -> [(&'static str, f64); 4] {
    let (peak, rupture) = (slider.peak(z), slider.rupture(z));
    [
        ("peak_pa", peak),
        ("peak_error_pa", peak - Slider::PEAK),
        ("rupture_m", rupture),
        ("rupture_error_m", rupture - Slider::RUPTURE),
    ]
}
