//! What is printed: a table with a head, or one JSON object.

use std::io;

use hlcp_core::{Hlcp, Rows, Scalar, number};
use hlcp_methods::{Clock, Forecast, Named, Outcome, Status};
use hlcp_verify::{
    Branch, Certificate, Convergence, Disproof, Refusal, Uniqueness, convergence_within,
    uniqueness_within,
};
use serde_json::{Value, json};

use super::{
    Run,
    arguments::{Arguments, Precision},
};
use crate::{print, say, scenes::Problem};

/// An answer with what is known of it.
pub(crate) struct Answer<'s> {
    pub(crate) method: &'s Named,
    pub(crate) precision: Precision,
    pub(crate) outcome: &'s Outcome,
    /// The largest distance from a known solution.
    pub(crate) error: Option<f64>,
    pub(crate) figures: Vec<(&'static str, f64)>,
    pub(crate) certificate: Option<Proved>,
}

pub(crate) fn object<T: Scalar>(
    run: &Run<'_>,
    given: &Problem<T>,
    Answer { method, precision, outcome, error, figures, certificate }: &Answer<'_>,
) -> Value {
    let Run { arguments, name: scene, .. } = run;
    let Outcome { status, iterations, sweeps, elapsed, residual, .. } = outcome;
    let forecast = |Forecast { seconds, bytes, left, .. }| {
        let left = left.as_secs_f64();
        json!({ "seconds": seconds, "bytes": bytes, "left": left })
    };
    let [alpha, beta] = method.first().map_or([None; 2], |pair| pair.map(Some));
    let mut object = json!({
        "scene": scene,
        "n": run.order(given),
        "method": method.to_string(),
        "alpha": alpha,
        "beta": beta,
        "tau": arguments.omega.is_none().then_some(arguments.tau),
        "omega": arguments.omega,
        "gamma": arguments.gamma,
        "precision": precision.name(),
        "threads": arguments.threads,
        "outcome": status.name(),
        "converged": outcome.converged(),
        "iterations": iterations,
        "sweeps": sweeps,
        "linear_iterations": outcome.linear_iterations,
        "residual_l2": residual.l2,
        "residual_linf": residual.linf,
        "backward_error": outcome.backward_error,
        "forgone": outcome.forgone.map(forecast),
        "error_linf": error,
        "objective": null,
        "seconds": elapsed.as_secs_f64(),
    });
    for (key, value) in figures {
        object[key] = (*value).into();
    }
    if let Some(proved) = certificate {
        object["certified_error_bound"] =
            json!(proved.certificate.as_ref().ok().map(Certificate::error));
        object["certificate"] = certificate_object(given, proved);
    }
    object
}

pub(crate) fn head(Run { arguments, name, .. }: &Run<'_>, order: usize) -> io::Result<()> {
    let Arguments { given, tau, omega, gamma, .. } = arguments;
    let scaled = match omega {
        Some(omega) => format!("omega = {}", number(*omega)),
        None => format!("tau = {}", number(*tau)),
    };
    let gamma = number(*gamma);
    let shifts = if arguments.files.a.is_none() && name.starts_with("example") {
        let [mu, nu] = ["mu", "nu"].map(|shift| number(given.numbers.get(shift)));
        format!(" mu = {mu}, nu = {nu},")
    } else {
        String::new()
    };
    print::line(format_args!("{name}: n = {order},{shifts} {scaled}, gamma = {gamma}"))?;
    print::line(
        "method    precision outcome         iterations  sweeps residual l2       l-inf    l2 / q  \
         true error  seconds",
    )
}

/// Prints a row of the table, with what is to be said of it below; `convergence` is what theorems
/// say of the method.
pub(crate) fn words<T>(
    given: &Problem<T>,
    Answer { method, precision, outcome, error, figures, certificate }: &Answer<'_>,
    convergence: Option<String>,
) -> io::Result<()> {
    let Outcome { status, iterations, sweeps, elapsed, residual, relative, .. } = outcome;
    let seconds = elapsed.as_secs_f64();
    print::line(format_args!(
        "{method:<9} {:<9} {status:<15} {iterations:>10} {sweeps:>7} {:>11.2e} {:>11.2e} {:>9.1e} {:>11} {seconds:>8.3}",
        precision.name(),
        residual.l2,
        residual.linf,
        relative.l2,
        error.map_or("unknown".into(), |error| format!("{error:.2e}"))
    ))?;
    if let Some(forgone) = outcome.forgone.filter(|_| !outcome.converged()) {
        say(format!("note: {forgone}"));
    }
    if let Some(advice) = advice(&method.to_string(), outcome) {
        say(format!("note: {method} did not converge; {advice}"));
    }
    let unsettled =
        if outcome.converged() { "" } else { " (not converged: no figure of the scene)" };
    for (key, value) in figures {
        print::line(format_args!("          {key} {value:.6e}{unsettled}"))?;
    }
    convergence.map_or(Ok(()), |found| print::line(format_args!("  {found}")))?;
    certificate.as_ref().map_or(Ok(()), |proved| words_of_certificate(given, proved))
}

/// What theorems say of a method's convergence.
pub(crate) fn convergence<T, A, B>(
    method: &Named,
    problem: &Hlcp<T, A, B>,
    clock: &mut Clock<'_>,
) -> Result<String, hlcp_core::Error>
where
    T: Scalar,
    A: Rows<T>,
    B: Rows<T>,
{
    let not = "convergence: not proved, because";
    let steps = method.steps(problem)?;
    Ok(match steps.map(|steps| convergence_within(problem, &steps, clock)) {
        Some(Convergence::NotProved(_)) if clock.is_up() => {
            format!("{not} the time limit was reached")
        }
        Some(found) => found.to_string(),
        None => format!("{not} the check does not cover the method"),
    })
}

/// What may help a solve by this method that did not converge.
pub(crate) fn advice(method: &str, outcome: &Outcome) -> Option<String> {
    let other = |names: &[&'static str]| {
        let others: Vec<_> = names.iter().copied().filter(|name| *name != method).collect();
        others.join(" or ")
    };
    Some(match outcome.status {
        Status::Diverged(_) | Status::Cycling { .. } => format!(
            "try {}, a smaller --alpha or another --tau; the problem may have no solution",
            other(&["AUTO", "AMG"])
        ),
        Status::Stagnated if outcome.backward_error.is_some() => {
            "rounding is the reason: the answer is exact for entries of A, B and q that differ in \
             their last digits; a looser --rtol accepts it"
                .into()
        }
        Status::Stagnated => format!(
            "rounding alone does not explain it, if the operators know their rows: the problem may \
             have no solution, or the method be one for other problems; try {}",
            other(&["AUTO", "AMG"])
        ),
        Status::IterationLimit | Status::TimeLimit => format!(
            "try {}, or more by --max-iterations and --max-seconds; the problem may have no \
             solution",
            other(&["AUTO", "ANDERSON", "AMG"])
        ),
        _ => return None,
    })
}

/// The largest order for which a proof is searched for that the solution is the only one.
const SEARCHED: usize = 100_000;

/// What is proved of an answer: how far it is from a solution, or why that is not known; and
/// whether there is only one.
pub(crate) struct Proved {
    pub(crate) certificate: Result<Certificate, Refusal>,
    /// Whether there is one solution for every q, unless the problem is large.
    uniqueness: Option<Uniqueness>,
}

impl Proved {
    pub(crate) fn new<T: Scalar>(
        Problem { a, b, q, .. }: &Problem<T>,
        certificate: Result<Certificate, Refusal>,
        clock: &mut Clock<'_>,
    ) -> Result<Self, hlcp_core::Error> {
        let uniqueness =
            if q.len() <= SEARCHED { Some(uniqueness_within(a, b, clock)?) } else { None };
        Ok(Self { certificate, uniqueness })
    }
}

fn words_of_certificate<T>(problem: &Problem<T>, found: &Proved) -> io::Result<()> {
    if problem.march.0 > 1 {
        print::line("  proofs of the last time step alone, for what the ones before it led to:")?;
    }
    let unique = match &found.uniqueness {
        Some(found) => found.to_string(),
        None => format!("not looked at beyond {SEARCHED} unknowns"),
    };
    let certificate = match &found.certificate {
        Ok(certificate) => certificate,
        Err(why) => {
            let text = format!("solution unique: {unique}; certified error: none, because");
            return print::line(format_args!("  {text} {why}"));
        }
    };
    print::line(format_args!("  solution unique: {unique}; {certificate}"))?;
    let [z, r, open] = [Branch::Z, Branch::R, Branch::Open].map(|side| certificate.count(side));
    let meaning = problem.meaning.map_or(String::new(), |word| format!(" ({word})"));
    print::line(format_args!(
        "  sides proved: z > 0 at {z} points, r > 0{meaning} at {r}; open: {open}"
    ))?;
    for (key, interval) in (problem.proofs)(certificate) {
        let [lower, upper] = print::ends(interval);
        print::line(format_args!("  {key}: proved between {lower} and {upper}"))?;
    }
    Ok(())
}

fn certificate_object<T>(problem: &Problem<T>, found: &Proved) -> Value {
    // Neither true nor false where nothing is proved.
    let (unique, disproof) = match &found.uniqueness {
        Some(Uniqueness::Proved(_)) => (Some(true), Value::Null),
        Some(Uniqueness::Refuted(Disproof { m_matrix, v, other, u })) => {
            (Some(false), json!({ "m_matrix": m_matrix, "v": v, "other": other, "u": u }))
        }
        _ => (None, Value::Null),
    };
    match &found.certificate {
        Ok(certificate) => json!({
            "unique": unique,
            "disproof": disproof,
            "alone": certificate.is_alone,
            "z_positive": certificate.count(Branch::Z),
            "r_positive": certificate.count(Branch::R),
            "open": certificate.count(Branch::Open),
            "figures": (problem.proofs)(certificate)
                .into_iter()
                .map(|(key, interval)| (key.to_owned(), json!(interval)))
                .collect::<serde_json::Map<_, _>>(),
        }),
        Err(why) => json!({ "refused": why.to_string(), "unique": unique, "disproof": disproof }),
    }
}
