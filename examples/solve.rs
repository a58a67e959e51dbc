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

use std::{
    error::Error,
    io::{self, Write},
    ops::ControlFlow,
    path::PathBuf,
    process::ExitCode,
};

use clap::{Parser, ValueEnum, error::ErrorKind};
use hlcp_core::{Hlcp, Identity, LinearOperator, Norms, Omega, Rows, Scalar, market};
use hlcp_methods::{Limits, Named, Norm, Outcome, Parameters, Solver};
use hlcp_verify::{AorStep, Certificate, Example, Slider, certify, convergence};
use indicatif::ProgressBar;
use serde_json::json;

/// Solve a horizontal linear complementarity problem, A z − B r + q = 0 with z, r ≥ 0 and zᵀr = 0.
#[derive(Debug, Parser)]
#[command(name = "solve")]
struct Arguments {
    /// The problem
    #[arg(long, value_enum, default_value_t = Scene::Example1)]
    scene: Scene,
    /// Grid points per side, the order being m²; for the slider its cells, the order being m − 1
    #[arg(long, default_value_t = 512, allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..=32768))]
    m: u16,
    /// The multiple of the identity in A of Examples 1 and 2 [default: 4]
    #[arg(long, allow_hyphen_values = true)]
    mu: Option<f64>,
    /// The multiple of the identity in B of Examples 1 and 2 [default: 4]
    #[arg(long, allow_hyphen_values = true)]
    nu: Option<f64>,
    /// A matrix A from a Matrix Market file, instead of a scene
    #[arg(long, requires = "q", conflicts_with_all = ["scene", "m", "mu", "nu"])]
    a: Option<PathBuf>,
    /// The matrix B [default: the identity, which makes the problem an LCP]
    #[arg(long, requires = "a")]
    b: Option<PathBuf>,
    /// The vector q: a Matrix Market file, or one number a line
    #[arg(long, requires = "a")]
    q: Option<PathBuf>,
    /// The start x⁰ [default: all ones]
    #[arg(long)]
    x0: Option<PathBuf>,
    /// Write z to this file, also of a solve that did not converge; needs --method
    #[arg(long, requires = "method")]
    out_z: Option<PathBuf>,
    /// Write r to this file, also of a solve that did not converge; needs --method
    #[arg(long, requires = "method")]
    out_r: Option<PathBuf>,
    /// MJ MGS MSOR MAOR, AMJ … AMAOR, TMJ … TMAOR, or of the paper's Table 1 MSOR1–3 MAOR1–3, AM… and TM… alike,
    /// TMJSOR1–4 TMGSJ TMGSSOR1–3
    #[arg(long)]
    method: Option<String>,
    /// Relaxation α, of the first step where there are two
    #[arg(long, allow_hyphen_values = true)]
    alpha: Option<f64>,
    /// Acceleration β, of the first step where there are two
    #[arg(long, allow_hyphen_values = true)]
    beta: Option<f64>,
    /// α of the second step
    #[arg(long, allow_hyphen_values = true)]
    alpha2: Option<f64>,
    /// β of the second step
    #[arg(long, allow_hyphen_values = true)]
    beta2: Option<f64>,
    /// The factor τ of Ω = τ D_A D_B⁻¹, which scales r in the modulus variable
    #[arg(long, default_value_t = 1.0, allow_hyphen_values = true)]
    tau: f64,
    /// The scale γ of the modulus variable
    #[arg(long, default_value_t = 1.0, allow_hyphen_values = true)]
    gamma: f64,
    /// Absolute tolerance for ‖A z − B r + q‖ [default: 1e-10, and in f32 what rounding allows]
    /// least 1e-10 ‖q‖]
    #[arg(long, allow_hyphen_values = true)]
    tol: Option<f64>,
    /// The largest number of iterations
    #[arg(long, default_value_t = 30_000, allow_hyphen_values = true)]
    max_iterations: usize,
    /// The norm of the stopping test
    #[arg(long, value_enum, default_value_t = NormName::L2)]
    norm: NormName,
    /// The precision [default: f64 with --method, both without]
    #[arg(long, value_enum)]
    precision: Option<Precision>,
    /// Print one JSON object instead of a table; needs --method
    #[arg(long, requires = "method")]
    json: bool,
    /// Prove what can be proved: convergence, uniqueness, and a bound on the error
    #[arg(long)]
    certify: bool,
}

/// μ and ν where none are given.
const SHIFT: f64 = 4.0;

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Scene {
    /// The paper's Example 1
    Example1,
    /// The paper's Example 2
    Example2,
    /// A slider with cavitation in the place of the paper's Example 3
    Slider,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum NormName {
    L2,
    Linf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Precision {
    F64,
    F32,
}

impl Arguments {
    /// Refuses outputs that cannot be written before anything is solved.
    fn check_outputs(&self) -> Result<(), Box<dyn Error>> {
        if self.out_z.is_some() && self.out_z == self.out_r {
            return Err("--out-z and --out-r name the same file".into());
        }
        for path in self.out_z.iter().chain(&self.out_r) {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            if path.is_dir() || folder.is_some_and(|folder| !folder.is_dir()) {
                return Err(format!("{} cannot be written", path.display()).into());
            }
        }
        Ok(())
    }
}

impl Precision {
    fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
        }
    }
}

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
    methods: Vec<(String, Named)>,
    rows: usize,
    all_converged: bool,
}

/// A problem in one precision.
struct Given<'g, T, A, B> {
    name: &'static str,
    a: &'g A,
    b: &'g B,
    q: &'g [T],
    x0: &'g [T],
    /// z* and r*.
    known: Option<[&'g [T]; 2]>,
    slider: Option<Slider>,
}

/// Solves what was asked for and prints it; whether all of it converged.
fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    let parameters = Parameters {
        alpha: arguments.alpha,
        beta: arguments.beta,
        alpha2: arguments.alpha2,
        beta2: arguments.beta2,
    };
    if arguments.method.is_none() && parameters != Parameters::default() {
        return Err("--alpha, --beta, --alpha2 and --beta2 need --method".into());
    }
    arguments.check_outputs()?;
    let names = match &arguments.method {
        Some(name) => vec![name.to_ascii_uppercase()],
        None => ["MGS", "AMGS", "TMGS"].map(String::from).to_vec(),
    };
    let methods = names
        .into_iter()
        .map(|name| Named::parse(&name, parameters).map(|method| (name, method)))
        .collect::<Result<_, _>>()?;
    let precisions = match (arguments.precision, &arguments.method) {
        (Some(precision), _) => vec![precision],
        (None, Some(_)) => vec![Precision::F64],
        (None, None) => vec![Precision::F64, Precision::F32],
    };
    if precisions.iter().any(|precision| matches!(precision, Precision::F32)) {
        let given = [
            ("tau", Some(arguments.tau)),
            ("gamma", Some(arguments.gamma)),
            ("tol", arguments.tol),
        ];
        for (name, value) in given {
            if let Some(value) = value.filter(|v| v.is_finite() && !(*v as f32).is_finite()) {
                return Err(
                    format!("--{name} {value:e} does not fit f32; use --precision f64").into()
                );
            }
        }
    }
    let mut run = Run { arguments, methods, rows: 0, all_converged: true };
    for precision in precisions {
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
        let start = |order| match &arguments.x0 {
            Some(path) => market::read_vector(path, order),
            None => Ok(vec![T::one(); order]),
        };
        if let (Some(a), Some(q)) = (&arguments.a, &arguments.q) {
            let a = &market::read_matrix::<T>(a)?;
            let q = &market::read_vector(q, a.order())?;
            let x0 = &start(a.order())?;
            let (known, slider) = (None, None);
            return match &arguments.b {
                Some(b) => {
                    let b = &market::read_matrix::<T>(b)?;
                    self.solve(precision, &Given { name: "file", a, b, q, x0, known, slider })
                }
                None => {
                    let b = &Identity { order: a.order() };
                    self.solve(precision, &Given { name: "file", a, b, q, x0, known, slider })
                }
            };
        }
        if let Scene::Slider = arguments.scene {
            if arguments.mu.or(arguments.nu).is_some() {
                return Err("--mu and --nu are those of Examples 1 and 2".into());
            }
            let slider = Slider { cells: arguments.m.into() };
            let (a, b, q) = &slider.pose::<T>()?;
            let (x0, slider) = (&start(q.len())?, Some(slider));
            return self
                .solve(precision, &Given { name: "slider", a, b, q, x0, known: None, slider });
        }
        let symmetric = matches!(arguments.scene, Scene::Example1);
        let scene = Example {
            symmetric,
            m: arguments.m.into(),
            mu: arguments.mu.unwrap_or(SHIFT),
            nu: arguments.nu.unwrap_or(SHIFT),
        }
        .pose::<T>()?;
        let given = Given {
            name: if symmetric { "example1" } else { "example2" },
            a: &scene.a,
            b: &scene.b,
            q: &scene.q,
            x0: &start(scene.q.len())?,
            known: Some([&scene.z, &scene.r]),
            slider: None,
        };
        self.solve(precision, &given)
    }

    fn solve<T: Scalar, A: Rows<T>, B: Rows<T>>(
        &mut self,
        precision: Precision,
        given: &Given<'_, T, A, B>,
    ) -> Result<(), Box<dyn Error>> {
        let arguments = self.arguments;
        let to = |value: f64| T::from(value).ok_or("a number does not fit the precision");
        let mut limits = Limits { iterations: arguments.max_iterations, ..Limits::<T>::default() };
        limits.norm = match arguments.norm {
            NormName::L2 => Norm::L2,
            NormName::Linf => Norm::LInf,
        };
        if given.slider.is_some() {
            limits.relative = limits.relative.max(to(1e-10)?);
        }
        if let Some(tolerance) = arguments.tol {
            (limits.absolute, limits.rounding) = (to(tolerance)?, T::zero());
        }
        let omega = Omega::diagonal_ratio(to(arguments.tau)?, given.a, given.b)?;
        let problem = Hlcp::new(given.a, given.b, omega)?.with_gamma(to(arguments.gamma)?)?;
        for (name, method) in &self.methods {
            let mut solver = Solver::new(method.on(problem.clone())?);
            let bar = ProgressBar::new_spinner();
            let outcome = solver.solve_observed(given.q, given.x0, &limits, |progress| {
                if progress.iteration % 64 == 0 {
                    bar.set_message(format!(
                        "{name}: iteration {}, residual {:.1e}",
                        progress.iteration, progress.residual.l2
                    ));
                    bar.tick();
                }
                ControlFlow::Continue(())
            })?;
            bar.finish_and_clear();
            let error =
                given.known.map(|[z, r]| distance(solver.z(), z).max(distance(solver.r(), r)));
            let certificate = if arguments.certify {
                certify(given.a, given.b, given.q, solver.z(), solver.r())?
            } else {
                None
            };
            if arguments.json {
                let mut report = self.report(given, name, method, precision, &outcome, error);
                for (key, value) in given.slider.iter().flat_map(|s| film(s, solver.z())) {
                    report[key] = value.into();
                }
                if arguments.certify {
                    report["certified_error_bound"] =
                        json!(certificate.as_ref().map(Certificate::error));
                }
                print_line(&report)?;
            } else {
                if self.rows == 0 {
                    print_head(arguments, given.name, given.q.len())?;
                }
                print_row(name, precision, &outcome, error)?;
                for (key, value) in given.slider.iter().flat_map(|s| film(s, solver.z())) {
                    print_line(&format_args!("          {key} {value:.6e}"))?;
                }
                if arguments.certify {
                    print_line(&format!("  {}", convergence(&problem, &steps(method))))?;
                    print_line(&match certificate {
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

    fn report<T, A, B>(
        &self,
        given: &Given<'_, T, A, B>,
        name: &str,
        method: &Named,
        precision: Precision,
        outcome: &Outcome,
        error: Option<f64>,
    ) -> serde_json::Value {
        let Outcome { status, iterations, sweeps, seconds, residual, .. } = outcome;
        let [alpha, beta] = method.first();
        json!({
            "scene": given.name,
            "n": given.q.len(),
            "method": name,
            "alpha": alpha,
            "beta": beta,
            "tau": self.arguments.tau,
            "gamma": self.arguments.gamma,
            "precision": precision.name(),
            "threads": 1,
            "outcome": status.to_string().replace(' ', "_"),
            "iterations": iterations,
            "sweeps": sweeps,
            "residual_l2": residual.l2,
            "residual_linf": residual.linf,
            "error_linf": error,
            "seconds": seconds,
        })
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

/// The steps of one iteration, as the theorems take them.
fn steps(method: &Named) -> Vec<AorStep> {
    let [alpha, beta] = method.first();
    let first = AorStep::new(alpha, beta);
    if method.is_accelerated() {
        return vec![first.accelerated()];
    }
    let second = method.second().map(|[alpha, beta]| AorStep::new(alpha, beta).backward());
    std::iter::once(first).chain(second).collect()
}

/// ‖u − v‖∞.
fn distance<T: Scalar>(u: &[T], v: &[T]) -> f64 {
    let differences: Vec<T> = u.iter().zip(v).map(|(&u, &v)| u - v).collect();
    Norms::of(&differences).linf
}

/// Prints a line; a reader that has gone away ends the program quietly.
fn print_line(line: &impl std::fmt::Display) -> io::Result<()> {
    match writeln!(io::stdout(), "{line}") {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => std::process::exit(0),
        done => done,
    }
}

fn print_head(arguments: &Arguments, name: &str, order: usize) -> io::Result<()> {
    let Arguments { mu, nu, tau, gamma, .. } = arguments;
    let shifts = match name {
        "file" | "slider" => String::new(),
        _ => format!(" mu = {}, nu = {},", mu.unwrap_or(SHIFT), nu.unwrap_or(SHIFT)),
    };
    print_line(&format_args!("{name}: n = {order},{shifts} tau = {tau}, gamma = {gamma}"))?;
    print_line(&format_args!(
        "{:<9} {:<9} {:<15} {:>10} {:>7} {:>11} {:>11} {:>11} {:>8}",
        "method",
        "precision",
        "outcome",
        "iterations",
        "sweeps",
        "residual l2",
        "l-inf",
        "true error",
        "seconds"
    ))
}

fn print_row(
    name: &str,
    precision: Precision,
    outcome: &Outcome,
    error: Option<f64>,
) -> io::Result<()> {
    let Outcome { status, iterations, sweeps, seconds, residual, .. } = outcome;
    print_line(&format_args!(
        "{name:<9} {:<9} {status:<15} {iterations:>10} {sweeps:>7} {:>11.2e} {:>11.2e} {:>11} {seconds:>8.3}",
        precision.name(),
        residual.l2,
        residual.linf,
        error.map_or("unknown".into(), |error| format!("{error:.2e}"))
    ))
}
