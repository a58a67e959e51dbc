//! What is printed: a table with a head, or one JSON object.

use std::io;

use hlcp_core::{Norms, Scalar};
use hlcp_methods::{Named, Outcome};
use serde_json::{Value, json};

use super::{
    Run,
    arguments::{Arguments, Precision},
};
use crate::{print, scenes::Problem};

/// The JSON object of one solve.
pub(crate) fn object<T>(
    Run { arguments, name: scene, .. }: &Run<'_>,
    problem: &Problem<T>,
    (method, named): &(String, Named),
    precision: Precision,
    outcome: &Outcome,
    error: Option<f64>,
) -> Value {
    let Outcome { status, iterations, sweeps, elapsed, residual, .. } = outcome;
    let [alpha, beta] = named.first().map_or([None; 2], |pair| pair.map(Some));
    json!({
        "scene": scene,
        "n": problem.q.len(),
        "method": method,
        "alpha": alpha,
        "beta": beta,
        "tau": arguments.tau,
        "gamma": arguments.gamma,
        "precision": precision.name(),
        "threads": arguments.threads,
        "outcome": status.to_string().replace(' ', "_"),
        "iterations": iterations,
        "sweeps": sweeps,
        "linear_iterations": outcome.linear_iterations,
        "residual_l2": residual.l2,
        "residual_linf": residual.linf,
        "error_linf": error,
        "objective": null,
        "seconds": elapsed.as_secs_f64(),
    })
}

/// ‖u − v‖∞.
pub(crate) fn distance<T: Scalar>(u: &[T], v: &[T]) -> f64 {
    let differences: Vec<T> = u.iter().zip(v).map(|(&u, &v)| u - v).collect();
    Norms::of(&differences).linf
}

/// Prints the head of the table.
pub(crate) fn head(Run { arguments, name, .. }: &Run<'_>, order: usize) -> io::Result<()> {
    let Arguments { given, tau, gamma, .. } = arguments;
    let shifts = if arguments.a.is_none() && name.starts_with("example") {
        let [mu, nu] = ["mu", "nu"].map(|shift| given.numbers.get(shift));
        format!(" mu = {mu}, nu = {nu},")
    } else {
        String::new()
    };
    print::line(format_args!("{name}: n = {order},{shifts} tau = {tau}, gamma = {gamma}"))?;
    print::line(format_args!(
        "{:<9} {:<9} {:<15} {:>10} {:>7} {:>11} {:>11} {:>9} {:>11} {:>8}",
        "method",
        "precision",
        "outcome",
        "iterations",
        "sweeps",
        "residual l2",
        "l-inf",
        "l2 / q",
        "true error",
        "seconds"
    ))
}

/// Prints a row of the table.
pub(crate) fn row(
    name: &str,
    precision: Precision,
    outcome: &Outcome,
    error: Option<f64>,
) -> io::Result<()> {
    let Outcome { status, iterations, sweeps, elapsed, residual, relative, .. } = outcome;
    let seconds = elapsed.as_secs_f64();
    print::line(format_args!(
        "{name:<9} {:<9} {status:<15} {iterations:>10} {sweeps:>7} {:>11.2e} {:>11.2e} {:>9.1e} {:>11} {seconds:>8.3}",
        precision.name(),
        residual.l2,
        residual.linf,
        relative.l2,
        error.map_or("unknown".into(), |error| format!("{error:.2e}"))
    ))
}
