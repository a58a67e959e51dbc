//! What is printed: a table with a head, or one JSON object.

use std::io;

use hlcp_core::{Norms, Scalar};
use hlcp_methods::Outcome;
use serde_json::{Value, json};

use crate::{
    arguments::{Arguments, Precision, SHIFT, Scene},
    choice::Choice,
    print,
    scenes::Given,
};

/// The JSON object of one solve.
pub(crate) fn object<T, A, B>(
    arguments: &Arguments,
    given: &Given<'_, T, A, B>,
    choice: &Choice,
    precision: Precision,
    outcome: &Outcome,
    error: Option<f64>,
) -> Value {
    let Outcome { status, iterations, sweeps, elapsed, residual, .. } = outcome;
    let [alpha, beta] = choice.relaxation();
    json!({
        "scene": given.name,
        "n": given.q.len(),
        "method": choice.name,
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
        "residual_over_q": outcome.relative.l2,
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
pub(crate) fn head(arguments: &Arguments, name: &str, order: usize) -> io::Result<()> {
    let Arguments { mu, nu, tau, gamma, .. } = arguments;
    let shifts = match arguments.scene {
        Scene::Example1 | Scene::Example2 if arguments.a.is_none() => {
            format!(" mu = {}, nu = {},", mu.unwrap_or(SHIFT), nu.unwrap_or(SHIFT))
        }
        _ => String::new(),
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
