//! Solves a scene by methods of the paper, matrix-free.
//!
//! ```text
//! cargo run --release --example solve
//! cargo run --release --example solve -- --scene example2 --m 128 --method TMAOR --alpha 1.1 --beta 0.9
//! ```
//!
//! Without arguments: Example 1 (μ = ν = 4) on a 512 × 512 grid by MGS, AMGS and TMGS in both precisions.
//! The exit status is 0 when every solve converged, 2 when one did not, 1 for bad input.

use std::{error::Error, process::ExitCode};

use clap::{Parser, ValueEnum, error::ErrorKind};
use hlcp_core::{Hlcp, Omega, Scalar};
use hlcp_methods::{Limits, Named, Norm, Outcome, Parameters, Solver};
use hlcp_verify::Example;
use serde_json::json;

/// Solve a horizontal linear complementarity problem, A z − B r + q = 0 with z, r ≥ 0 and zᵀr = 0.
#[derive(Debug, Parser)]
#[command(name = "solve")]
struct Arguments {
    /// The problem
    #[arg(long, value_enum, default_value_t = Scene::Example1)]
    scene: Scene,
    /// Grid points a side; the order is m²
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u16).range(1..=32768))]
    m: u16,
    /// The multiple of the identity in A
    #[arg(long, default_value_t = 4.0, allow_hyphen_values = true)]
    mu: f64,
    /// The multiple of the identity in B
    #[arg(long, default_value_t = 4.0, allow_hyphen_values = true)]
    nu: f64,
    /// MJ MGS MSOR MAOR, AMJ … AMAOR, TMJ … TMAOR, or an indexed name of the paper's Table 1
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
    /// Ω = τ D_A D_B⁻¹
    #[arg(long, default_value_t = 1.0, allow_hyphen_values = true)]
    tau: f64,
    /// The scale γ of the modulus variable
    #[arg(long, default_value_t = 1.0, allow_hyphen_values = true)]
    gamma: f64,
    /// Absolute tolerance for ‖A z − B r + q‖ [default: 1e-10 in f64, 4 ε ‖q‖ in f32]
    #[arg(long, allow_hyphen_values = true)]
    tol: Option<f64>,
    /// The largest number of iterations
    #[arg(long, default_value_t = 30_000)]
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
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Scene {
    Example1,
    Example2,
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
        Err(error)
            if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) =>
        {
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
    let names = match &arguments.method {
        Some(name) => vec![name.to_ascii_uppercase()],
        None => ["MGS", "AMGS", "TMGS"].map(String::from).to_vec(),
    };
    let methods =
        names.iter().map(|name| Named::parse(name, parameters)).collect::<Result<Vec<_>, _>>()?;
    let precisions = match (arguments.precision, &arguments.method) {
        (Some(precision), _) => vec![precision],
        (None, Some(_)) => vec![Precision::F64],
        (None, None) => vec![Precision::F64, Precision::F32],
    };
    let mut rows = 0;
    let mut all_converged = true;
    for precision in precisions {
        for (name, &method) in names.iter().zip(&methods) {
            let solved = match precision {
                Precision::F64 => solve::<f64>(arguments, method)?,
                Precision::F32 => solve::<f32>(arguments, method)?,
            };
            if arguments.json {
                println!("{}", report(arguments, name, method, precision, &solved));
            } else {
                if rows == 0 {
                    print_head(arguments, solved.order);
                }
                print_row(name, precision, &solved);
            }
            rows += 1;
            all_converged &= solved.outcome.converged();
        }
    }
    Ok(all_converged)
}

/// What one solve came to.
struct Solved {
    order: usize,
    outcome: Outcome,
    /// ‖(z, r) − (z*, r*)‖∞
    error: f64,
}

fn solve<T: Scalar>(arguments: &Arguments, method: Named) -> Result<Solved, Box<dyn Error>> {
    let scene = Example {
        symmetric: matches!(arguments.scene, Scene::Example1),
        m: arguments.m.into(),
        mu: arguments.mu,
        nu: arguments.nu,
    }
    .pose::<T>()?;
    let to = |value: f64| T::from(value).ok_or("a number does not fit the precision");
    let mut limits = Limits { iterations: arguments.max_iterations, ..Limits::default() };
    limits.norm = match arguments.norm {
        NormName::L2 => Norm::L2,
        NormName::Linf => Norm::LInf,
    };
    if let Some(tolerance) = arguments.tol {
        (limits.absolute, limits.relative) = (to(tolerance)?, T::zero());
    }
    let omega = Omega::diagonal_ratio(to(arguments.tau)?, &scene.a, &scene.b)?;
    let problem = Hlcp::new(scene.a, scene.b, omega)?.with_gamma(to(arguments.gamma)?)?;
    let mut solver = Solver::new(method.on(problem)?);
    let outcome = solver.solve(&scene.q, &vec![T::one(); scene.q.len()], &limits)?;

    let pairs = [(solver.z(), &scene.z), (solver.r(), &scene.r)];
    let differences = pairs.iter().flat_map(|(found, known)| {
        found.iter().zip(*known).map(|(&found, &known)| (found - known).abs())
    });
    let error = differences.fold(T::zero(), T::max).to_f64().unwrap_or(f64::NAN);
    Ok(Solved { order: scene.q.len(), outcome, error })
}

fn print_head(arguments: &Arguments, order: usize) {
    println!(
        "{}: n = {order}, mu = {}, nu = {}, tau = {}, gamma = {}",
        scene_name(arguments.scene),
        arguments.mu,
        arguments.nu,
        arguments.tau,
        arguments.gamma
    );
    println!(
        "{:<9} {:<9} {:<15} {:>10} {:>7} {:>11} {:>11} {:>11} {:>8}",
        "method",
        "precision",
        "outcome",
        "iterations",
        "sweeps",
        "residual l2",
        "  l-inf",
        "true error",
        "seconds"
    );
}

fn print_row(name: &str, precision: Precision, solved: &Solved) {
    let Outcome { status, iterations, sweeps, seconds, residual, .. } = solved.outcome;
    println!(
        "{name:<9} {:<9} {status:<15} {iterations:>10} {sweeps:>7} {:>11.2e} {:>11.2e} {:>11.2e} {seconds:>8.3}",
        precision.name(),
        residual.l2,
        residual.linf,
        solved.error
    );
}

fn report(
    arguments: &Arguments,
    name: &str,
    method: Named,
    precision: Precision,
    solved: &Solved,
) -> serde_json::Value {
    let Outcome { status, iterations, sweeps, seconds, residual, .. } = solved.outcome;
    let [alpha, beta] = method.first();
    json!({
        "scene": scene_name(arguments.scene),
        "n": solved.order,
        "method": name,
        "alpha": alpha,
        "beta": beta,
        "tau": arguments.tau,
        "gamma": arguments.gamma,
        "precision": precision.name(),
        "threads": 1,
        "outcome": status.to_string().replace(' ', "_"),
        "iterations": iterations,
        "sweeps": sweeps,
        "residual_l2": residual.l2,
        "residual_linf": residual.linf,
        "error_linf": solved.error,
        "seconds": seconds,
    })
}

fn scene_name(scene: Scene) -> &'static str {
    match scene {
        Scene::Example1 => "example1",
        Scene::Example2 => "example2",
    }
}
