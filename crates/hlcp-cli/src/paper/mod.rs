//! `hlcp paper`: the numerical section of Zheng and Vong's paper, run again: Tables 1 to 6 and
//! what the text says of them.
//!
//! Prints every table with iterations (IT), sweeps and seconds: the median of repeated solves, and
//! half the distance of their quartiles. A cell that hits 30,000 iterations is "–". With `--out`
//! the tables are also written as text, Markdown and CSV. Nothing printed here is quoted from the
//! paper; `docs/results/paper.md` compares.

mod bounds;
mod claims;
mod table;

use std::{error::Error, path::PathBuf};

use clap::Args;
use hlcp::files::printable;
use hlcp_methods::{Limits, Named, Options, Parameters, Status};
use hlcp_verify::{Example, Slider};
use indicatif::ProgressBar;
use table::Table;

use crate::{
    print,
    progress::counting,
    scenes::{Problem, Scene},
};

const EXAMPLES: &str = "\
Examples:
  hlcp paper --quick
  hlcp paper --out docs/results";

/// Run the tables of the paper again
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// m = 128 and N = 50 alone
    #[arg(long)]
    quick: bool,
    /// The least number of solves behind a time; short ones are repeated for a tenth of a second
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    repeats: u16,
    /// The folder for tables.txt, tables.md and a CSV file for each table
    #[arg(long)]
    out: Option<PathBuf>,
}

const TAUS: [f64; 3] = [0.8, 1.0, 1.2];
/// Table 1's left half: what follows M, AM or TM.
const SPLITTINGS: [&str; 6] = ["SOR1", "SOR2", "SOR3", "AOR1", "AOR2", "AOR3"];
/// The methods of Example 3, in the order of the text.
const SLIDER_METHODS: [&str; 14] = [
    "MJ", "AMJ", "TMJ", "TMJSOR1", "TMJSOR2", "TMJSOR3", "TMJSOR4", "MGS", "AMGS", "TMGSJ",
    "TMGSSOR1", "TMGS", "TMGSSOR2", "TMGSSOR3",
];

/// One of Examples 1 and 2 as a table of the paper has it.
#[derive(Debug, Clone, Copy)]
struct Grid {
    table: u8,
    symmetric: bool,
    /// μ = ν.
    shift: f64,
}

const GRIDS: [Grid; 3] = [
    Grid { table: 3, symmetric: true, shift: 4.0 },
    Grid { table: 4, symmetric: true, shift: 0.0 },
    Grid { table: 5, symmetric: false, shift: 4.0 },
];

impl Grid {
    fn name(&self) -> String {
        let example = if self.symmetric { 1 } else { 2 };
        format!("Example {example} (μ = ν = {})", self.shift)
    }

    fn example(&self, m: usize) -> Example {
        Example { symmetric: self.symmetric, m, mu: self.shift, nu: self.shift }
    }
}

/// One method on one problem.
#[derive(Debug, Clone)]
struct Run {
    table: u8,
    /// m of Tables 3 to 5, N of Table 6.
    size: usize,
    tau: f64,
    method: String,
    status: Status,
    iterations: usize,
    sweeps: usize,
    seconds: Spread,
}

impl Run {
    fn converged(&self) -> bool {
        self.status == Status::Converged
    }

    /// IT, sweeps, seconds and half their range.
    fn cells(&self) -> [String; 4] {
        let counts = match self.status {
            Status::Converged => [self.iterations.to_string(), self.sweeps.to_string()],
            Status::IterationLimit => ["–", "–"].map(String::from),
            other => [other.to_string(), "–".into()],
        };
        let Spread { lower, median, upper } = self.seconds;
        let [iterations, sweeps] = counts;
        [iterations, sweeps, format!("{median:.5}"), format!("{:.5}", (upper - lower) / 2.0)]
    }
}

/// The quartiles of the wall-clock seconds of repeated solves.
#[derive(Debug, Clone, Copy)]
struct Spread {
    lower: f64,
    median: f64,
    upper: f64,
}

impl Spread {
    fn of(mut seconds: Vec<f64>) -> Self {
        seconds.sort_by(f64::total_cmp);
        let at = |quarter: usize| seconds[quarter * (seconds.len() - 1) / 4];
        Self { lower: at(1), median: at(2), upper: at(3) }
    }

    /// Whether even the slow quarter of these is faster than the fast quarter of those.
    fn beats(&self, other: &Self) -> bool {
        self.upper < other.lower
    }
}

/// The solves behind the tables.
struct Measurement {
    repeats: u16,
    bar: ProgressBar,
    runs: Vec<Run>,
}

impl Measurement {
    /// Solves from `e` as often as is asked for.
    fn measure(
        &mut self,
        (table, size, tau): (u8, usize, f64),
        method: &str,
        problem: &Problem<f64>,
        limits: &Limits,
    ) -> Result<(), Box<dyn Error>> {
        self.bar.set_message(format!("Table {table}, {size}, τ = {tau}, {method}"));
        let mut solver = problem.solver(method, Parameters::default(), tau)?;
        let start = problem.start();
        let mut seconds = vec![];
        let outcome = loop {
            let options = Options::from_x(&start).limits(*limits);
            let outcome = solver.solve(&problem.q, options)?;
            seconds.push(outcome.elapsed.as_secs_f64());
            if seconds.len() >= self.repeats.into() && seconds.iter().sum::<f64>() >= 0.1 {
                break outcome;
            }
        };
        self.bar.inc(1);
        self.runs.push(Run {
            table,
            size,
            tau,
            method: method.to_owned(),
            status: outcome.status,
            iterations: outcome.iterations,
            sweeps: outcome.sweeps,
            seconds: Spread::of(seconds),
        });
        Ok(())
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let (ms, ns): (&[usize], &[usize]) =
        if arguments.quick { (&[128], &[50]) } else { (&[128, 256, 512], &[50, 100, 128]) };
    let cells = ms.len() * 3 * TAUS.len() * SPLITTINGS.len() * GRIDS.len()
        + ns.len() * TAUS.len() * SLIDER_METHODS.len();
    let bar = counting(cells);
    let mut measurement = Measurement { repeats: arguments.repeats, bar, runs: vec![] };
    for grid in GRIDS {
        let scene = Scene::of(if grid.symmetric { "example1" } else { "example2" });
        for &m in ms {
            let problem = scene.pose(&[("m", m as f64), ("mu", grid.shift), ("nu", grid.shift)])?;
            for tau in TAUS {
                for method in paired() {
                    let row = (grid.table, m, tau);
                    measurement.measure(row, &method, &problem, &scene.limits())?;
                }
            }
        }
    }
    let slider = Scene::of("slider");
    for &n in ns {
        let problem = slider.pose(&[("m", n as f64)])?;
        for tau in TAUS {
            for method in SLIDER_METHODS {
                measurement.measure((6, n, tau), method, &problem, &slider.limits())?;
            }
        }
    }
    let Measurement { bar, runs, .. } = measurement;
    bar.finish_and_clear();

    let mut tables = vec![table_1()?, bounds::table_2(ms)?];
    tables.extend(GRIDS.iter().map(|grid| table_of(grid, &runs)));
    tables.push(table_6(&runs));
    tables.push(mesh_convergence(if arguments.quick { &[50, 100] } else { &[50, 100, 200, 400] })?);
    tables.push(claims::table(&runs));
    if let Some(folder) = &arguments.out {
        table::write(folder, &tables)?;
    }
    for table in &tables {
        print::line(table.text())?;
    }
    if let Some(folder) = &arguments.out {
        print::line(format_args!("written to {}", printable(folder.display())))?;
    }
    Ok(())
}

/// The three families, as the paper's names begin.
const FAMILIES: [&str; 3] = ["M", "AM", "TM"];

/// The methods of Table 1's left half, three by three.
fn paired() -> impl Iterator<Item = String> {
    SPLITTINGS.iter().flat_map(|s| FAMILIES.map(|f| format!("{f}{s}")))
}

/// The abbreviations, and the parameters they stand for.
fn table_1() -> Result<Table, Box<dyn Error>> {
    let mut table = Table::new(
        "table1",
        "Table 1: the methods and their parameters; two pairs are those of the first and the second step",
        ["method", "α₁", "β₁", "α₂", "β₂"],
    );
    for name in paired().chain(SLIDER_METHODS.map(String::from)) {
        let method = Named::parse(&name, Parameters::default())?;
        let words = |pair: Option<[f64; 2]>| {
            pair.map_or([const { String::new() }; 2], |pair| pair.map(|v| v.to_string()))
        };
        let pairs = [words(method.first()), words(method.second())];
        table.row(std::iter::once(name).chain(pairs.into_iter().flatten()));
    }
    Ok(table)
}

/// Tables 3 to 5.
fn table_of(grid: &Grid, runs: &[Run]) -> Table {
    let title =
        format!("Table {}: {}, start e, stop at ‖A z − B r + q‖₂ ≤ 1e-10", grid.table, grid.name());
    let head = ["m", "τ", "(α, β)"].map(String::from).into_iter().chain(
        ["MAOR", "AMAOR", "TMAOR"]
            .iter()
            .flat_map(|f| ["IT", "sweeps", "s", "±"].map(|column| format!("{f} {column}"))),
    );
    let mut table = Table::new(&format!("table{}", grid.table), &title, head);
    let of_table = runs.iter().filter(|run| run.table == grid.table).collect::<Vec<_>>();
    // MAOR, AMAOR and TMAOR of one row were run one after the other.
    for three in of_table.chunks_exact(3) {
        let first = three[0];
        let pair = Named::parse(&first.method, Parameters::default()).map(|m| m.first());
        let pair = pair
            .ok()
            .flatten()
            .map_or(String::new(), |[alpha, beta]| format!("({alpha:.1}, {beta:.1})"));
        let head = [first.size.to_string(), format!("{:.1}", first.tau), pair];
        table.row(head.into_iter().chain(three.iter().flat_map(|run| run.cells())));
    }
    table
}

/// Table 6.
fn table_6(runs: &[Run]) -> Table {
    let head = ["N", "method"].map(String::from).into_iter().chain(
        TAUS.iter()
            .flat_map(|tau| ["IT", "sweeps", "s", "±"].map(|column| format!("τ={tau} {column}"))),
    );
    let title = "Table 6: Example 3, the slider with N cells, start e, stop at ‖A z − B r + q‖₂ ≤ 1e-10 ‖q‖₂";
    let mut table = Table::new("table6", title, head);
    let of_table = runs.iter().filter(|run| run.table == 6).collect::<Vec<_>>();
    for of_size in of_table.chunks_exact(TAUS.len() * SLIDER_METHODS.len()) {
        for (k, method) in SLIDER_METHODS.iter().enumerate() {
            let by_tau = of_size.iter().skip(k).step_by(SLIDER_METHODS.len());
            let head = [of_size[0].size.to_string(), (*method).to_owned()];
            table.row(head.into_iter().chain(by_tau.flat_map(|run| run.cells())));
        }
    }
    table
}

/// The slider's peak pressure and rupture point against the continuous problem's.
fn mesh_convergence(sizes: &[usize]) -> Result<Table, Box<dyn Error>> {
    let mut table = Table::new(
        "slider",
        "Example 3 on finer grids, by MGS: errors against the semi-analytic solution",
        ["N", "IT", "p_max [MPa]", "error [MPa]", "error·N", "rupture [mm]", "error/Δx"],
    );
    for &cells in sizes {
        let scene = Scene::of("slider");
        let problem = scene.pose(&[("m", cells as f64)])?;
        let mut mgs = problem.solver("MGS", Parameters::default(), 1.0)?;
        let limits = Limits { iterations: 1_000_000, ..scene.limits() };
        let start = problem.start();
        let outcome = mgs.solve(&problem.q, Options::from_x(&start).limits(limits))?;
        if !outcome.converged() {
            return Err(format!("MGS on the slider of {cells} cells: {}", outcome.status).into());
        }
        let slider = Slider { cells };
        let (peak, rupture) = (slider.peak(mgs.z()), slider.rupture(mgs.z()));
        let (error, dx) = ((peak - Slider::PEAK) / 1e6, Slider::LENGTH / cells as f64);
        table.row([
            cells.to_string(),
            outcome.iterations.to_string(),
            format!("{:.4}", peak / 1e6),
            format!("{error:.4}"),
            format!("{:.2}", error * cells as f64),
            format!("{:.3}", rupture * 1e3),
            format!("{:.3}", (rupture - Slider::RUPTURE) / dx),
        ]);
    }
    Ok(table)
}
