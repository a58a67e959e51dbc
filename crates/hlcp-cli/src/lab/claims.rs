//! What the paper says of its numbers in words, counted on ours.

use hlcp_methods::Status;

use super::{
    paper::{Cell, SPLITTINGS},
    run::Run,
    table::Table,
};

/// Which cells a claim is about.
type Of = fn(&Cell) -> bool;

const GRIDS: Of = |cell| cell.table <= 5;
const SLIDER: Of = |cell| cell.table == 6;

/// The claims that one family of the paper's beats another on Examples 1 and 2.
const OF_FAMILIES: [(&str, [&str; 2], Of); 5] = [
    ("Examples 1, 2: TMAOR beats MAOR", ["TM", "M"], GRIDS),
    ("the same where τ = 0.8, outside Theorem 2", ["TM", "M"], |cell| {
        cell.table <= 5 && cell.tau == 0.8
    }),
    ("Examples 1, 2: TMAOR beats AMAOR in most cases", ["TM", "AM"], GRIDS),
    ("… except TMAOR1, τ = 0.8, Example 1 with μ = ν = 0", ["TM", "AM"], |cell| {
        cell.table == 4 && cell.tau == 0.8 && cell.method.ends_with("AOR1")
    }),
    ("… and except TMAOR2, τ = 0.8 and 1.2, Example 2", ["TM", "AM"], |cell| {
        cell.table == 5 && cell.tau != 1.0 && cell.method.ends_with("AOR2")
    }),
];

/// The claims that one method beats another on Example 3, in its words.
const OF_METHODS: [(&str, [&str; 2]); 12] = [
    ("MJ beats AMJ", ["MJ", "AMJ"]),
    ("MGS beats AMGS", ["MGS", "AMGS"]),
    ("TMJ beats MJ", ["TMJ", "MJ"]),
    ("TMJSOR1 beats MJ", ["TMJSOR1", "MJ"]),
    ("TMJSOR2 beats MJ", ["TMJSOR2", "MJ"]),
    ("TMJSOR3 beats MJ", ["TMJSOR3", "MJ"]),
    ("TMJSOR4 beats MJ", ["TMJSOR4", "MJ"]),
    ("TMGSJ takes more time than MGS, so MGS beats it", ["MGS", "TMGSJ"]),
    ("TMGSSOR1 takes more time than MGS, so MGS beats it", ["MGS", "TMGSSOR1"]),
    ("TMGS takes more time than MGS, so MGS beats it", ["MGS", "TMGS"]),
    ("TMGSSOR2 beats MGS", ["TMGSSOR2", "MGS"]),
    ("TMGSSOR3 beats MGS", ["TMGSSOR3", "MGS"]),
];

/// One row a claim: in iterations, in sweeps and in time.
pub(crate) fn table(cells: &[Cell]) -> Table {
    let mut table = Table::new("claim of the paper | in iterations | in sweeps | in seconds");
    let mut row = |claim: &str, verdict: String| table.row(&format!("{claim}|{verdict}"));
    let of_grids = cells.iter().filter(|cell| GRIDS(cell));
    let done = of_grids.clone().filter(|cell| cell.run.converged()).count();
    row("Examples 1, 2: all methods converge", format!("{done} of {}||", of_grids.count()));
    row(
        "Examples 1, 2: MAOR takes nearly twice the iterations of TMAOR (ratio: least, median, largest)",
        ratios(&pairs(cells, ["M", "TM"], &SPLITTINGS, GRIDS)),
    );
    for (claim, families, of) in OF_FAMILIES {
        row(claim, wins(&pairs(cells, families, &SPLITTINGS, of)));
    }
    for method in ["MJ", "AMJ"] {
        let of_method = cells.iter().filter(|cell| SLIDER(cell) && cell.method == method);
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
    for (claim, methods) in OF_METHODS {
        row(&format!("Example 3: {claim}"), wins(&pairs(cells, methods, &[""], SLIDER)));
    }
    table
}

/// Two runs that differ in the method alone.
type Pair<'c> = [&'c Run; 2];

/// Returns the runs of two families with the same splittings.
fn pairs<'c>(cells: &'c [Cell], families: [&str; 2], splittings: &[&str], of: Of) -> Vec<Pair<'c>> {
    let of_splitting = |splitting: &&str| {
        let [one, other] = families.map(|family| {
            let name = format!("{family}{splitting}");
            cells.iter().filter(move |cell| cell.method == name && of(cell)).map(|cell| &cell.run)
        });
        // Both are in the order of table, size and τ.
        one.zip(other).map(|(one, other)| [one, other])
    };
    splittings.iter().flat_map(of_splitting).collect()
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
