//! What the paper says of its numbers in words, counted on ours.

use hlcp_methods::Status;

use super::{
    paper::{Cell, SPLITTINGS},
    run::Run,
    table::Table,
};

/// One row a claim: in iterations, in sweeps and in time.
pub(crate) fn table(cells: &[Cell]) -> Table {
    let mut table = Table::new("claim of the paper | in iterations | in sweeps | in seconds");
    let mut row = |claim: &str, verdict: String| table.row(&format!("{claim}|{verdict}"));
    let grids = |cell: &Cell| cell.table <= 5;

    let of_grids = cells.iter().filter(|cell| grids(cell));
    let done = of_grids.clone().filter(|cell| cell.run.converged()).count();
    row("Examples 1, 2: all methods converge", format!("{done} of {}||", of_grids.count()));
    row(
        "Examples 1, 2: MAOR takes nearly twice the iterations of TMAOR (ratio: least, median, largest)",
        ratios(&pairs(cells, "M", "TM", grids)),
    );
    row("Examples 1, 2: TMAOR beats MAOR", wins(&pairs(cells, "TM", "M", grids)));
    row(
        "the same where τ = 0.8, outside Theorem 2",
        wins(&pairs(cells, "TM", "M", |cell| grids(cell) && cell.tau == 0.8)),
    );
    row("Examples 1, 2: TMAOR beats AMAOR in most cases", wins(&pairs(cells, "TM", "AM", grids)));
    row(
        "… except TMAOR1, τ = 0.8, Example 1 with μ = ν = 0",
        wins(&pairs(cells, "TM", "AM", |cell| {
            cell.table == 4 && cell.tau == 0.8 && cell.method.ends_with("AOR1")
        })),
    );
    row(
        "… and except TMAOR2, τ = 0.8 and 1.2, Example 2",
        wins(&pairs(cells, "TM", "AM", |cell| {
            cell.table == 5 && cell.tau != 1.0 && cell.method.ends_with("AOR2")
        })),
    );

    let slider = |cell: &Cell| cell.table == 6;
    for method in ["MJ", "AMJ"] {
        let of_method = cells.iter().filter(|cell| slider(cell) && cell.method == method);
        let lost = |how: fn(Status) -> bool| {
            of_method.clone().filter(|cell| how(cell.run.outcome.status)).count()
        };
        let verdict = format!(
            "{} of {}, {} diverge||",
            lost(|status| matches!(status, Status::IterationLimit)),
            of_method.clone().count(),
            lost(|status| matches!(status, Status::Diverged(_)))
        );
        row(&format!("Example 3: some cases of {method} exceed 30,000 iterations"), verdict);
    }
    let duel = |better: &str, worse: &str| wins(&pairs_of(cells, better, worse, slider));
    for (better, worse) in [("MJ", "AMJ"), ("MGS", "AMGS")] {
        row(&format!("Example 3: {better} beats {worse}"), duel(better, worse));
    }
    for better in ["TMJ", "TMJSOR1", "TMJSOR2", "TMJSOR3", "TMJSOR4"] {
        row(&format!("Example 3: {better} beats MJ"), duel(better, "MJ"));
    }
    for worse in ["TMGSJ", "TMGSSOR1", "TMGS"] {
        row(
            &format!("Example 3: {worse} takes more time than MGS, so MGS beats it"),
            duel("MGS", worse),
        );
    }
    for better in ["TMGSSOR2", "TMGSSOR3"] {
        row(&format!("Example 3: {better} beats MGS"), duel(better, "MGS"));
    }
    table
}

/// Two runs that differ in the method alone.
type Pair<'c> = [&'c Run; 2];

/// Returns every run of one family that `of` admits, with that of another family.
fn pairs<'c>(
    cells: &'c [Cell],
    family: &str,
    other: &str,
    of: impl Fn(&Cell) -> bool,
) -> Vec<Pair<'c>> {
    SPLITTINGS
        .iter()
        .flat_map(|s| pairs_of(cells, &format!("{family}{s}"), &format!("{other}{s}"), &of))
        .collect()
}

/// Does the same for two methods by name.
fn pairs_of<'c>(
    cells: &'c [Cell],
    method: &str,
    other: &str,
    of: impl Fn(&Cell) -> bool,
) -> Vec<Pair<'c>> {
    let named = |name: &str| {
        let found = cells.iter().filter(|cell| cell.method == name && of(cell));
        found.map(|cell| &cell.run).collect::<Vec<_>>()
    };
    // Both lists are in the order of table, size and τ.
    named(method).into_iter().zip(named(other)).map(|(one, other)| [one, other]).collect()
}

/// Counts how often the first of a pair beats the second; one that does not converge beats nothing.
///
/// Time is decided where the quartiles of the repeated solves do not overlap, and else said to be
/// open.
fn wins(pairs: &[Pair<'_>]) -> String {
    // Two that both fail cannot be compared.
    let comparable = pairs.iter().filter(|[one, other]| one.converged() || other.converged());
    let total = comparable.clone().count();
    let count = |beats: fn(Pair<'_>) -> bool| {
        let wins = comparable.clone().filter(|&&[one, other]| {
            one.converged() && (!other.converged() || beats([one, other]))
        });
        wins.count()
    };
    let faster: fn(Pair<'_>) -> bool = |[one, other]| one.quartile(3) < other.quartile(1);
    let ties = comparable.clone().filter(|&&[one, other]| {
        one.converged() && other.converged() && !faster([one, other]) && !faster([other, one])
    });
    let open = match ties.count() {
        0 => String::new(),
        ties => format!(", {ties} open"),
    };
    let in_iterations = count(|[one, other]| one.outcome.iterations < other.outcome.iterations);
    let in_sweeps = count(|[one, other]| one.outcome.sweeps < other.outcome.sweeps);
    format!("{in_iterations} of {total}|{in_sweeps} of {total}|{} of {total}{open}", count(faster))
}

/// The least, the median and the largest ratio of the first of a pair to the second.
fn ratios(pairs: &[Pair<'_>]) -> String {
    let of = |cost: fn(&Run) -> f64| {
        let mut ratios: Vec<f64> =
            pairs.iter().map(|[one, other]| cost(one) / cost(other)).collect();
        ratios.sort_by(f64::total_cmp);
        let last = ratios.len() - 1;
        format!("{:.2}, {:.2}, {:.2}", ratios[0], ratios[last / 2], ratios[last])
    };
    let [iterations, sweeps]: [fn(&Run) -> f64; 2] =
        [|run| run.outcome.iterations as f64, |run| run.outcome.sweeps as f64];
    [of(iterations), of(sweeps), of(Run::median)].join("|")
}
