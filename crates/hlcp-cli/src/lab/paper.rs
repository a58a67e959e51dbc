//! `hlcp paper`: the numerical section of Zheng and Vong's paper, run again: Tables 1 to 6 and
//! what the text says of them.
//!
//! Prints every table with iterations (IT), sweeps and seconds: the median of repeated solves, and
//! half the distance of their quartiles. A cell that hits 30,000 iterations is "–". With `--out`
//! the tables are also written as text, Markdown and CSV. Nothing printed here is quoted from the
//! paper; `docs/results/paper.md` compares.

use std::{iter::once, path::PathBuf};

use clap::Args;
use hlcp::files::printable;
use hlcp_core::{Hlcp, Omega};
use hlcp_methods::{Limits, Named, Status};
use hlcp_verify::{Example, Slider, alpha_bound, fixed};

use super::{
    claims,
    run::{Repeats, Run, measure, solve},
    table::Table,
};
use crate::{Fallible, chart::save, print, progress::counting, scenes::Scene};

const EXAMPLES: &str = "\
Examples:
  hlcp paper --quick
  hlcp paper --out docs/results";

/// Run the tables of the paper again
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// m = 128 and N = 50 alone, each solved once or --repeats times
    #[arg(long)]
    quick: bool,
    /// The least number of solves behind a time; short ones are repeated for a tenth of a second
    #[arg(long, default_value = "5", default_value_if("quick", "true", "1"))]
    #[arg(value_parser = clap::value_parser!(u16).range(1..))]
    repeats: u16,
    /// The folder for tables.txt, tables.md and a CSV file for each table
    #[arg(long)]
    out: Option<PathBuf>,
}

const TAUS: [f64; 3] = [0.8, 1.0, 1.2];
/// Table 1's left half: what follows M, AM or TM.
pub(super) const SPLITTINGS: [&str; 6] = ["SOR1", "SOR2", "SOR3", "AOR1", "AOR2", "AOR3"];
/// The methods of Example 3, in the order of the text.
const SLIDER_METHODS: [&str; 14] = [
    "MJ", "AMJ", "TMJ", "TMJSOR1", "TMJSOR2", "TMJSOR3", "TMJSOR4", "MGS", "AMGS", "TMGSJ",
    "TMGSSOR1", "TMGS", "TMGSSOR2", "TMGSSOR3",
];

/// One of Examples 1 and 2 as a table of the paper has it.
#[derive(Clone, Copy)]
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
}

/// One method on one problem.
pub(super) struct Cell {
    pub(super) table: u8,
    /// m of Tables 3 to 5, N of Table 6.
    size: usize,
    pub(super) tau: f64,
    pub(super) method: String,
    pub(super) run: Run,
}

impl Cell {
    /// IT, sweeps, seconds and half the distance of their quartiles.
    fn words(&self) -> String {
        let run = &self.run;
        let counts = match run.outcome.status {
            Status::Converged => format!("{}|{}", run.outcome.iterations, run.outcome.sweeps),
            Status::IterationLimit => "–|–".to_owned(),
            other => format!("{other}|–"),
        };
        let half = (run.quartile(3) - run.quartile(1)) / 2.0;
        format!("{counts}|{:.5}|{half:.5}", run.median())
    }
}

pub(crate) fn run(arguments: &Arguments) -> Fallible<()> {
    let (ms, ns, sum): (&[usize], &[usize], f64) = if arguments.quick {
        (&[128], &[50], 0.0)
    } else {
        (&[128, 256, 512], &[50, 100, 128], 0.1)
    };
    let (paired, of_slider) = (paired(), SLIDER_METHODS.map(String::from).to_vec());
    let mut problems = vec![];
    for grid in &GRIDS {
        let scene = Scene::of(if grid.symmetric { "example1" } else { "example2" });
        for &m in ms {
            let numbers = vec![("m", m as f64), ("mu", grid.shift), ("nu", grid.shift)];
            problems.push((grid.table, m, scene, numbers, &paired));
        }
    }
    for &n in ns {
        problems.push((6, n, Scene::of("slider"), vec![("m", n as f64)], &of_slider));
    }
    let count = problems.iter().map(|(.., methods)| TAUS.len() * methods.len()).sum();
    let bar = counting(count);
    let repeats = Repeats { sum, ..Repeats::least(arguments.repeats.into()) };
    let mut cells = vec![];
    for (table, size, scene, numbers, methods) in problems {
        let (problem, limits) = (scene.pose(&numbers)?, scene.limits());
        for tau in TAUS {
            let runs = measure(repeats, methods, |name| {
                bar.set_message(format!("Table {table}, {size}, τ = {tau}, {name}"));
                let method = name.parse::<Named>()?;
                Ok(Some(Run {
                    answer: [vec![], vec![]],
                    ..solve(&problem, &method, tau, &limits)?
                }))
            })?;
            bar.inc(methods.len() as u64);
            cells.extend(methods.iter().zip(runs).filter_map(|(method, run)| {
                Some(Cell { table, size, tau, method: method.clone(), run: run? })
            }));
        }
    }
    bar.finish_and_clear();

    let mut tables = vec![table_1()?, table_2(ms)?];
    tables.extend(GRIDS.iter().map(|grid| table_of(grid, &cells)));
    tables.push(table_6(&cells));
    tables.push(mesh_convergence(if arguments.quick { &[50, 100] } else { &[50, 100, 200, 400] })?);
    tables.push((
        "claims",
        "What the text says of Tables 3 to 6, counted".into(),
        claims::table(&cells),
    ));
    let all = |format: &dyn Fn(&str, &Table) -> String| {
        tables.iter().map(|(_, title, table)| format(title, table)).collect::<Vec<_>>().join("\n")
    };
    let text = all(&|title, table| format!("{title}\n\n{}", table.text()));
    if let Some(folder) = &arguments.out {
        save(&folder.join("tables.txt"), &text)?;
        let introduction = "# Tables\n\nWritten by `cargo run --release -- paper --out docs/results`; \
                            [../results.md](../results.md#the-papers-tables) reads them.\n\n";
        let markdown = all(&|title, table| format!("## {title}\n\n{}", table.markdown()));
        save(&folder.join("tables.md"), &(introduction.to_owned() + &markdown))?;
        tables.iter().try_for_each(|(name, _, table)| table.write_csv(&folder.join(name)))?;
    }
    print::line(&text)?;
    if let Some(folder) = &arguments.out {
        print::line(format_args!("written to {}", printable(folder.display())))?;
    }
    Ok(())
}

/// A table with the name of its file and its title.
type Titled = (&'static str, String, Table);

/// The three families, as the paper's names begin.
const FAMILIES: [&str; 3] = ["M", "AM", "TM"];

/// The methods of Table 1's left half, three by three.
fn paired() -> Vec<String> {
    SPLITTINGS.iter().flat_map(|s| FAMILIES.map(|f| format!("{f}{s}"))).collect()
}

/// The abbreviations, and the parameters they stand for.
fn table_1() -> Fallible<Titled> {
    let mut table = Table::new("method | α₁ | β₁ | α₂ | β₂");
    for name in paired().into_iter().chain(SLIDER_METHODS.map(String::from)) {
        let method = name.parse::<Named>()?;
        let words = |pair: Option<[f64; 2]>| {
            pair.map_or("|".to_owned(), |[alpha, beta]| format!("{alpha}|{beta}"))
        };
        table.row(&format!("{name}|{}|{}", words(method.first()), words(method.second())));
    }
    let title = "Table 1: the methods and their parameters; two pairs are those of the first and the second step";
    Ok(("table1", title.into(), table))
}

/// Table 2: proved brackets of the upper bound of α in (16), 1/ρ[(D_A + D_BΩ)⁻¹(D_BΩ + |C_A|)], for
/// the paper's two τ.
fn table_2(ms: &[usize]) -> Fallible<Titled> {
    let mut table = Table::new(&format!("m|τ|{}", GRIDS.map(|grid| grid.name()).join("|")));
    for &m in ms {
        for tau in [1.2, 1.0] {
            let bound = |grid: &Grid| -> Fallible<String> {
                let example =
                    Example { symmetric: grid.symmetric, m, mu: grid.shift, nu: grid.shift };
                let scene = example.pose::<f64>()?;
                let omega = Omega::diagonal_ratio(tau, &scene.a, &scene.b)?;
                let [lower, upper] = alpha_bound(&Hlcp::new(scene.a, scene.b, omega)?).reciprocal();
                // Further digits depend on the processor.
                Ok(format!("{} … {}", fixed(lower, 6, false), fixed(upper, 6, true)))
            };
            let bounds = GRIDS.iter().map(bound).collect::<Result<Vec<_>, _>>()?;
            table.row(&format!("{m}|{tau:.1}|{}", bounds.join("|")));
        }
    }
    Ok(("table2", "Table 2: upper bounds of α in (16), between proved limits".into(), table))
}

/// The columns of a [`Cell`].
fn columns(of: &str) -> String {
    ["IT", "sweeps", "s", "±"].map(|column| format!("{of} {column}")).join("|")
}

/// A row of cells after its first words.
fn row<'c>(words: String, cells: impl Iterator<Item = &'c Cell>) -> String {
    once(words).chain(cells.map(Cell::words)).collect::<Vec<_>>().join("|")
}

fn table_of(grid: &Grid, cells: &[Cell]) -> Titled {
    let heads = ["MAOR", "AMAOR", "TMAOR"].map(columns).join("|");
    let mut table = Table::new(&format!("m|τ|(α, β)|{heads}"));
    let of_table = cells.iter().filter(|cell| cell.table == grid.table).collect::<Vec<_>>();
    // MAOR, AMAOR and TMAOR of one row were run one after the other.
    for three in of_table.chunks_exact(3) {
        let Cell { size, tau, method, .. } = three[0];
        let pair = method.parse::<Named>().map(|method| method.first());
        let pair = pair
            .ok()
            .flatten()
            .map_or(String::new(), |[alpha, beta]| format!("({alpha:.1}, {beta:.1})"));
        table.row(&row(format!("{size}|{tau:.1}|{pair}"), three.iter().copied()));
    }
    let name = ["table3", "table4", "table5"][usize::from(grid.table - 3)];
    let (number, what) = (grid.table, grid.name());
    let title = format!("Table {number}: {what}, start e, stop at ‖A z − B r + q‖₂ ≤ 1e-10");
    (name, title, table)
}

fn table_6(cells: &[Cell]) -> Titled {
    let heads = TAUS.map(|tau| columns(&format!("τ={tau}"))).join("|");
    let mut table = Table::new(&format!("N|method|{heads}"));
    let of_table = cells.iter().filter(|cell| cell.table == 6).collect::<Vec<_>>();
    for of_size in of_table.chunks_exact(TAUS.len() * SLIDER_METHODS.len()) {
        for (k, method) in SLIDER_METHODS.iter().enumerate() {
            let by_tau = of_size.iter().skip(k).step_by(SLIDER_METHODS.len()).copied();
            table.row(&row(format!("{}|{method}", of_size[0].size), by_tau));
        }
    }
    let title = "Table 6: Example 3, the slider with N cells, start e, stop at ‖A z − B r + q‖₂ ≤ 1e-10 ‖q‖₂";
    ("table6", title.into(), table)
}

/// The slider's peak pressure and rupture point against the continuous problem's.
fn mesh_convergence(sizes: &[usize]) -> Fallible<Titled> {
    let mut table =
        Table::new("N | IT | p_max [MPa] | error [MPa] | error·N | rupture [mm] | error/Δx");
    for &cells in sizes {
        let scene = Scene::of("slider");
        let limits = Limits { iterations: 1_000_000, ..scene.limits() };
        let mgs = "MGS".parse()?;
        let Run { outcome, answer: [z, _], .. } =
            solve(&scene.pose(&[("m", cells as f64)])?, &mgs, 1.0, &limits)?;
        if !outcome.converged() {
            return Err(format!("MGS on the slider of {cells} cells: {}", outcome.status).into());
        }
        let slider = Slider { cells };
        let (peak, rupture) = (slider.peak(&z), slider.rupture(&z));
        let (error, dx) = ((peak - Slider::PEAK) / 1e6, Slider::LENGTH / cells as f64);
        table.row(&format!(
            "{cells}|{}|{:.4}|{error:.4}|{:.2}|{:.3}|{:.3}",
            outcome.iterations,
            peak / 1e6,
            error * cells as f64,
            rupture * 1e3,
            (rupture - Slider::RUPTURE) / dx
        ));
    }
    let title = "Example 3 on finer grids, by MGS: errors against the semi-analytic solution";
    Ok(("slider", title.into(), table))
}
