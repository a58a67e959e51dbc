//! What the paper says of its numbers in words, counted on ours.

use hlcp_methods::Status;

use super::{Run, table::Table};

/// One row a claim: in iterations, in sweeps and in time.
pub(crate) fn table(runs: &[Run]) -> Table {
    let head = ["claim of the paper", "in iterations", "in sweeps", "in seconds"];
    let mut table = Table::new("claims", "What the text says of Tables 3 to 6, counted", head);
    let mut row = |claim: &str, verdict: [String; 3]| {
        table.row(std::iter::once(claim.to_owned()).chain(verdict));
    };
    let grids = |run: &Run| run.table <= 5;

    let (all, done) = (
        runs.iter().filter(|run| grids(run)).count(),
        runs.iter().filter(|run| grids(run) && run.converged()).count(),
    );
    row(
        "Examples 1, 2: all methods converge",
        [format!("{done} of {all}"), String::new(), String::new()],
    );
    row(
        "Examples 1, 2: MAOR takes nearly twice the iterations of TMAOR (ratio: least, median, largest)",
        ratios(&pairs(runs, "M", "TM", grids)),
    );
    row("Examples 1, 2: TMAOR beats MAOR", wins(&pairs(runs, "TM", "M", grids)));
    row(
        "the same where τ = 0.8, outside Theorem 2",
        wins(&pairs(runs, "TM", "M", |run| grids(run) && run.tau == 0.8)),
    );
    row("Examples 1, 2: TMAOR beats AMAOR in most cases", wins(&pairs(runs, "TM", "AM", grids)));
    row(
        "… except TMAOR1, τ = 0.8, Example 1 with μ = ν = 0",
        wins(&pairs(runs, "TM", "AM", |run| {
            run.table == 4 && run.tau == 0.8 && run.method.ends_with("AOR1")
        })),
    );
    row(
        "… and except TMAOR2, τ = 0.8 and 1.2, Example 2",
        wins(&pairs(runs, "TM", "AM", |run| {
            run.table == 5 && run.tau != 1.0 && run.method.ends_with("AOR2")
        })),
    );

    let slider = |run: &Run| run.table == 6;
    for method in ["MJ", "AMJ"] {
        let of_method = runs.iter().filter(|run| slider(run) && run.method == method);
        let lost =
            |how: fn(&Status) -> bool| of_method.clone().filter(|run| how(&run.status)).count();
        let verdict = format!(
            "{} of {}, {} diverge",
            lost(|status| matches!(status, Status::IterationLimit)),
            of_method.clone().count(),
            lost(|status| matches!(status, Status::Diverged(_)))
        );
        row(
            &format!("Example 3: some cases of {method} exceed 30,000 iterations"),
            [verdict, String::new(), String::new()],
        );
    }
    let duel = |better: &str, worse: &str| wins(&pairs_of(runs, better, worse, slider));
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

/// Every run of one family that `of` admits, beside the run of another family that differs in
/// nothing else.
fn pairs<'r>(
    runs: &'r [Run],
    family: &str,
    other: &str,
    of: impl Fn(&Run) -> bool,
) -> Vec<[&'r Run; 2]> {
    super::SPLITTINGS
        .iter()
        .flat_map(|s| pairs_of(runs, &format!("{family}{s}"), &format!("{other}{s}"), &of))
        .collect()
}

/// The same for two methods by name.
fn pairs_of<'r>(
    runs: &'r [Run],
    method: &str,
    other: &str,
    of: impl Fn(&Run) -> bool,
) -> Vec<[&'r Run; 2]> {
    let named =
        |name: &str| runs.iter().filter(|run| run.method == name && of(run)).collect::<Vec<_>>();
    // Both lists are in the order of table, size and τ.
    named(method).into_iter().zip(named(other)).map(|(one, other)| [one, other]).collect()
}

/// How often the first of a pair beats the second; one that does not converge beats nothing.
///
/// Time is decided where the quartiles of the repeated solves do not overlap, and else said to be
/// open.
fn wins(pairs: &[[&Run; 2]]) -> [String; 3] {
    // Two that both fail cannot be compared.
    let comparable = pairs.iter().filter(|[one, other]| one.converged() || other.converged());
    let total = comparable.clone().count();
    let count = |beats: &dyn Fn(&Run, &Run) -> bool| {
        comparable
            .clone()
            .filter(|[one, other]| one.converged() && (!other.converged() || beats(one, other)))
            .count()
    };
    let ties = comparable
        .clone()
        .filter(|[one, other]| {
            let apart = one.seconds.beats(&other.seconds) || other.seconds.beats(&one.seconds);
            one.converged() && other.converged() && !apart
        })
        .count();
    let open = if ties > 0 { format!(", {ties} open") } else { String::new() };
    [
        format!("{} of {total}", count(&|one, other| one.iterations < other.iterations)),
        format!("{} of {total}", count(&|one, other| one.sweeps < other.sweeps)),
        format!("{} of {total}{open}", count(&|one, other| one.seconds.beats(&other.seconds))),
    ]
}

/// The least, the median and the largest ratio of the first of a pair to the second.
fn ratios(pairs: &[[&Run; 2]]) -> [String; 3] {
    let of = |cost: fn(&Run) -> f64| {
        let mut ratios: Vec<f64> =
            pairs.iter().map(|[one, other]| cost(one) / cost(other)).collect();
        ratios.sort_by(f64::total_cmp);
        let last = ratios.len() - 1;
        format!("{:.2}, {:.2}, {:.2}", ratios[0], ratios[last / 2], ratios[last])
    };
    [of(|run| run.iterations as f64), of(|run| run.sweeps as f64), of(|run| run.seconds.median)]
}
