//! `hlcp solve`: a scene, or a problem from files, by any method.

mod arguments;
mod report;

use std::{
    error::Error,
    io::{self, Write},
    ops::ControlFlow,
    path::Path,
    time::Duration,
};

pub(crate) use arguments::Arguments;
use arguments::{NormName, Precision};
use hlcp_core::{
    Identity, LinearOperator, Rows, Scalar, VaryingFivePoint, files, market, recognise_grid,
};
use hlcp_methods::{Limits, NameError, Named, Norm, Options, Outcome, Progress, Solver, Tolerance};
use hlcp_verify::{Certificate, convergence};
use serde_json::json;

use crate::{
    print,
    progress::Way,
    scenes::{Boxed, Numbers, Problem, goal},
};

/// Solves what was asked for, on as many threads as were asked for, and prints it; whether all of
/// it converged.
pub(crate) fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    if arguments.threads == 1 {
        return solve(arguments);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.into()).build()?;
    Ok(pool.install(|| solve(arguments).map_err(|error| error.to_string()))?)
}

/// The problem that is solved, how often, and what became of it so far.
struct Run<'r> {
    arguments: &'r Arguments,
    name: &'r str,
    /// The methods by their names.
    methods: Vec<(String, Named)>,
    rows: usize,
    all_converged: bool,
}

fn solve(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    arguments.check()?;
    let parse = |name: &str| -> Result<(String, Named), String> {
        let named = Named::parse(name, arguments.parameters()).map_err(in_options)?;
        Ok((name.to_ascii_uppercase(), named))
    };
    let methods = match &arguments.method {
        Some(name) => vec![parse(name)?],
        None => ["MGS", "AMGS", "TMGS"].into_iter().map(parse).collect::<Result<_, _>>()?,
    };
    let scene = arguments.given.scene;
    let name = if arguments.a.is_some() { "file" } else { scene.name };
    let mut run = Run { arguments, name, methods, rows: 0, all_converged: true };
    for precision in arguments.precisions() {
        match precision {
            Precision::F64 => run.solve(precision, &run.problem(scene.wide)?)?,
            Precision::F32 => run.solve(precision, &run.problem(scene.narrow)?)?,
        }
    }
    Ok(run.all_converged)
}

/// The error in the words of the command line.
fn in_options(error: NameError) -> String {
    match error {
        NameError::Missing { name, parameter, advice } => {
            format!("{name} needs --{parameter}: {advice}")
        }
        NameError::Fixed { name, parameter, value, instead } => {
            format!("{name} takes no --{parameter} (given: {value}); use {instead}")
        }
        other => other.to_string(),
    }
}

impl Run<'_> {
    /// Reads the files, or poses the scene.
    fn problem<T: Scalar>(
        &self,
        pose: fn(&Numbers) -> Result<Problem<T>, hlcp_core::Error>,
    ) -> Result<Problem<T>, Box<dyn Error>> {
        let Arguments { a, b, q, given, .. } = self.arguments;
        let (Some(a), Some(q)) = (a, q) else { return Ok(pose(&given.numbers)?) };
        let (path, a) = (a, market::read_matrix::<T>(a)?);
        let q = market::read_vector(q, a.order())?;
        match b {
            None => self.on_grid([path, path], a, Identity { order: q.len() }, q),
            Some(of_b) => self.on_grid([path, of_b], a, market::read_matrix::<T>(of_b)?, q),
        }
    }

    /// The problem of operators from files, as five-point ones if they are said to be or are found
    /// to be.
    fn on_grid<T: Scalar>(
        &self,
        paths: [&Path; 2],
        a: impl Rows<T> + 'static,
        b: impl Rows<T> + 'static,
        q: Vec<T>,
    ) -> Result<Problem<T>, Box<dyn Error>> {
        if let Some([nx, ny]) = self.arguments.grid {
            let named = |path: &Path| {
                let path = files::printable(path.display());
                move |error| format!("--grid {nx}x{ny} does not fit {path}: {error}")
            };
            let a = VaryingFivePoint::from_rows(nx, ny, &a).map_err(named(paths[0]))?;
            let b = VaryingFivePoint::from_rows(nx, ny, &b).map_err(named(paths[1]))?;
            return Ok(Problem::new(a, b, q));
        }
        Ok(match recognise_grid(&a, &b) {
            Some([a, b]) => Problem::new(a, b, q),
            None => Problem::new(a, b, q),
        })
    }

    fn solve<T: Scalar>(
        &mut self,
        precision: Precision,
        given: &Problem<T>,
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
            (None, None) if arguments.a.is_some() => (Tolerance::Relative(1e-10), None),
            (None, None) => (arguments.given.scene.limits().tolerance, None),
        };
        let (iterations, time) = (arguments.max_iterations, arguments.max_seconds);
        let time = time.map(Duration::try_from_secs_f64).transpose();
        let time = time.map_err(|_| "--max-seconds must be a number of seconds, 0 or more")?;
        let limits = Limits { tolerance, rounding, norm, iterations, time };
        let mut problem = given.hlcp(to(arguments.tau)?)?.with_gamma(to(arguments.gamma)?)?;
        if arguments.threads > 1 {
            if !problem.has_shared_sweeps() {
                let _ = writeln!(
                    io::stderr(),
                    "note: --threads does not speed up the sweeps of this problem, which are \
                     shared on grids of 16384 points or more"
                );
            }
            problem = problem.in_parallel();
        }
        for method in &self.methods {
            let (name, named) = method;
            let mut solver = Solver::new(named.on(problem.clone())?);
            let mut q = given.q.to_vec();
            let mut solves = Vec::new();
            for _ in 0..arguments.repeats {
                solves.push(march(name, &mut solver, given, &mut q, &x0, &limits)?);
            }
            solves.sort_by_key(|outcome| outcome.elapsed);
            let outcome = &solves[solves.len() / 2];
            let error = given
                .known
                .as_ref()
                .map(|[z, r]| report::distance(solver.z(), z).max(report::distance(solver.r(), r)));
            let figures = (given.figures)(solver.z(), solver.r());
            let certificate = if arguments.certify {
                Some(report::certify(given, &q, solver.z(), solver.r())?)
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
                let mut object = report::object(self, given, method, precision, outcome, error);
                for (key, value) in figures {
                    object[key] = value.into();
                }
                if let Some(certificate) = &certificate {
                    object["certified_error_bound"] =
                        json!(certificate.as_ref().ok().map(Certificate::error));
                    object["certificate"] = report::certificate_object(given, certificate);
                }
                print::line(&object)?;
            } else {
                if self.rows == 0 {
                    report::head(self, given.q.len())?;
                }
                report::row(name, precision, outcome, error)?;
                for (key, value) in &figures {
                    print::line(format_args!("          {key} {value:.6e}"))?;
                }
                if let Some(certificate) = &certificate {
                    print::line(match named.steps(&problem)? {
                        Some(steps) => format!("  {}", convergence(&problem, &steps)),
                        None => {
                            "  convergence: not proved, because the check does not cover the method"
                                .into()
                        }
                    })?;
                    report::certificate(given, certificate, &figures)?;
                }
            }
            self.rows += 1;
            self.all_converged &= outcome.converged();
        }
        Ok(())
    }
}

/// Solves the problems of a scene one after another, each from the answer before, until one does
/// not converge, and leaves the last right-hand side in `q`; the outcome is that of all of them,
/// with the residual of the last.
fn march<'p, T: Scalar>(
    name: &str,
    solver: &mut Solver<T, Boxed<'p, T>>,
    given: &'p Problem<T>,
    q: &mut [T],
    x0: &[T],
    limits: &Limits,
) -> Result<Outcome, Box<dyn Error>> {
    let mut way = Way::new(name, goal(limits, &given.q), limits);
    let mut show = |progress: &Progress<'_, T>| {
        way.show(progress);
        ControlFlow::Continue(())
    };
    q.copy_from_slice(&given.q);
    let options = Options::from_x(x0).limits(*limits).observer(&mut show);
    let mut outcome = solver.solve(q, options)?;
    let (count, next) = &given.march;
    for k in 1..*count {
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
    Ok(outcome)
}
