//! `hlcp charts`: every chart and table of the documents, by the commands that make some of them.
//!
//! Says which command runs and how long it took; `charts/took.csv` keeps that for the next time.
//! Some of the commands run alone, by their names. Only the cost per point is drawn from data that
//! this command does not make, but `cargo bench --bench sweeps`.

use std::{path::PathBuf, time::Instant};

use clap::{Args, CommandFactory, Parser, builder::PossibleValuesParser};
use hlcp::files::printable;

use super::table::Table;
use crate::{
    CommandLine, Fallible,
    chart::{Panel, Series, write},
    print,
};

const EXAMPLES: &str = "\
Examples:
  hlcp charts --quick
  hlcp charts stability-map comparison";

/// Measure and draw all charts and tables of the documents, by the other commands
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The commands to run [default: all]
    #[arg(value_name = "COMMAND", value_parser = PossibleValuesParser::new(STEPS.map(|(name, _)| name)))]
    commands: Vec<String>,
    /// Small problems
    #[arg(long)]
    quick: bool,
    /// Draw the charts anew from the data in their folder, without measuring
    #[arg(long)]
    draw: bool,
    /// The folder for charts and results
    #[arg(long, default_value = "docs", default_value_if("quick", "true", "target/docs"))]
    out: PathBuf,
}

/// Options of a command with what is in the folder.
type Paths = &'static [(&'static str, &'static str)];

const STEPS: [(&str, Paths); 10] = [
    ("film", &[("--out", "charts/film")]),
    ("gallery", &[("--out", "charts")]),
    ("stability-map", &[("--out", "charts")]),
    ("speed-vs-accuracy", &[("--out", "charts")]),
    ("comparison", &[("--out", "charts"), ("--tables", "results")]),
    ("paper", &[("--out", "results")]),
    ("scenes", &[("--out", "results")]),
    ("modulus", &[("--out", "results")]),
    ("films", &[("--out", "results/films")]),
    ("families", &[("--out", "results/families")]),
];

/// Whether a command has a flag: `quick` for small problems, `draw` to draw without measuring.
fn has(name: &str, flag: &str) -> bool {
    let program = CommandLine::command();
    let command = program.find_subcommand(name);
    command.is_some_and(|command| command.get_arguments().any(|arg| arg.get_id() == flag))
}

pub(crate) fn run(Arguments { commands, quick, draw, out }: &Arguments) -> Fallible<()> {
    let took = out.join("charts/took.csv");
    let known = Table::kept(&took, TOOK)?;
    let is_asked = |name: &str| commands.is_empty() || commands.iter().any(|asked| asked == name);
    let is_step = |(name, _): &(&str, Paths)| is_asked(name) && (!draw || has(name, "draw"));
    let steps: Vec<_> = STEPS.into_iter().filter(is_step).collect();
    let begun = Instant::now();
    for (k, (name, files)) in steps.iter().copied().enumerate() {
        let mut words = vec!["hlcp".to_owned(), name.to_owned()];
        for (option, path) in files {
            words.extend([(*option).to_owned(), out.join(path).display().to_string()]);
        }
        words.extend((*quick && has(name, "quick")).then(|| "--quick".to_owned()));
        words.extend(draw.then(|| "--draw".to_owned()));
        let before = known.get(name).filter(|_| !draw);
        let before =
            before.map_or(String::new(), |seconds| format!(", which took {seconds} s before"));
        let command = words.join(" ");
        print::line(format_args!("{} of {}: {command}{before}", k + 1, steps.len()))?;
        let of_step = Instant::now();
        let CommandLine { command, .. } = CommandLine::try_parse_from(words)?;
        crate::run(command)?;
        let seconds = of_step.elapsed().as_secs();
        print::line(format_args!("{name} took {seconds} s"))?;
        if !draw {
            Table::keep(&took, TOOK, name, seconds.to_string())?;
        }
    }
    let points = out.join("charts/cost-per-point");
    if commands.is_empty() && points.with_extension("csv").exists() {
        cost_per_point(&points)?;
    }
    let (seconds, out) = (begun.elapsed().as_secs(), printable(out.display()));
    print::line(format_args!("charts and tables are in {out} after {seconds} s"))?;
    Ok(())
}

const TOOK: &str = "command|seconds";

/// Draws the cost of a half-step per point, which `cargo bench --bench sweeps` measures.
fn cost_per_point(path: &std::path::Path) -> Fallible<()> {
    let columns = "m|kind|ns per point|machine and day";
    let (mut series, mut machine): (Vec<Series>, _) = (vec![], String::new());
    for (_, [m, kind, cost, on]) in Table::rows_of(&path.with_extension("csv"), columns)? {
        let point = (m.parse()?, cost.parse()?);
        machine = on;
        match series.iter_mut().find(|series| series.name == kind) {
            Some(series) => series.points.push(point),
            None => {
                series.push(Series { name: kind, style: [series.len(); 3], points: vec![point] });
            }
        }
    }
    let axes = ["m (the grid has m × m points)", "ns per point"];
    let panel = Panel::log_log("Cost of a half-step with norms", axes, &series)
        .with_names_at_ends(&series, |_| String::new());
    let caption = format!("cargo bench --bench sweeps · {machine}");
    write(path, 1, 320.0, vec![panel], &caption)
}
