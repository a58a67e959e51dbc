//! `hlcp families`: `AUTO` on problems that nobody chose, beside every other method.
//!
//! Problems are drawn by seed from the families of `hlcp-verify`. Each is solved by `AUTO`, and by
//! the other methods in one and a half times as long as the best so far; where `AUTO` fails they
//! get ten seconds. Times are with the set-up, the shortest of up to four. The distributions go to
//! `families.md`, every run to `families.csv`.

use std::{path::PathBuf, time::Duration};

use clap::Args;
use hlcp_core::Scalar;
use hlcp_methods::{Limits, Outcome};
use hlcp_verify::families::{self, Drawn};

use super::{
    methods::{Chart, methods},
    run::{Repeats, Run, measure, solve},
    table::Table,
};
use crate::{
    Fallible,
    chart::{provenance, save},
    print,
    progress::counting,
    scenes::Problem,
};

const EXAMPLES: &str = "\
Examples:
  hlcp families --quick
  hlcp families rings-7 sparse-12";

/// Compare AUTO with every other method on problems drawn at random
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Problems by name, as rings-7; otherwise all families are drawn from
    #[arg(conflicts_with_all = ["problems", "seed", "quick"])]
    names: Vec<String>,
    /// How many problems to draw
    #[arg(long, default_value_t = 500, default_value_if("quick", "true", "15"))]
    problems: u64,
    /// The seed of the first problem of each family; the next ones follow
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One problem of each of the 15 smaller families
    #[arg(long, conflicts_with_all = ["problems", "seed"])]
    quick: bool,
    /// The folder for the table and the list of runs
    #[arg(long, default_value = "target/families")]
    out: PathBuf,
}

/// The seconds that `AUTO` has, and those that the others have where it fails.
const PATIENCE: [f64; 2] = [20.0, 10.0];

/// Below so many seconds the work counts: what else the machine does would decide.
const SHORT: f64 = 0.005;

/// Solves of less than so many seconds are repeated, twice, and the shortest counts.
const BRIEF: f64 = 0.05;

/// A relative residual that no rounding need excuse.
const ROUNDED: f64 = 1e-9;

struct Row {
    drawn: Drawn,
    n: usize,
    auto: Run,
    /// The methods that converged, in the time that they had.
    others: Vec<(&'static str, Run)>,
}

impl Row {
    fn new<T: Scalar>(drawn: Drawn) -> Fallible<Self> {
        let ([a, b], q) = drawn.pose::<T>();
        let problem = Problem { start: T::zero(), ..Problem::new(a, b, q) };
        let limits = |seconds| {
            let time = Some(Duration::from_secs_f64(seconds));
            // What no precision can reach is not asked for.
            Limits { time, rounding: Some(4.0), ..Limits::default() }
        };
        let kept = |run: Run| Run { answer: [vec![], vec![]], ..run };
        let of = |name: &str, seconds: f64| -> Fallible<Result<Run, hlcp_core::Error>> {
            Ok(solve(&problem, &name.parse()?, 1.0, &limits(seconds)).map(kept))
        };
        let by_auto = || -> Fallible<Option<Run>> { Ok(Some(of("AUTO", PATIENCE[0])??)) };
        let repeats = Repeats { longest: BRIEF, ..Repeats::least(3) };
        let alone = measure(repeats, &["AUTO"], |_| by_auto())?;
        let mut auto = alone.into_iter().flatten().next().expect("AUTO refuses nothing");
        // Others may be at the processor meanwhile.
        let time = |best: f64| 0.02 + 1.5 * best;
        let mut best = if auto.converged() { auto.quartile(0) } else { PATIENCE[1] };
        // Where B is singular, rounding excuses an answer of any size, and the smallest is wanted.
        let relative = |run: &Run| run.outcome.relative.l2;
        let excused = if auto.converged() { 10.0 * relative(&auto) } else { f64::INFINITY };
        let by = |name: &str, seconds: f64| -> Fallible<Option<Run>> {
            let is_as_good = |run: &Run| relative(run) <= excused.max(ROUNDED);
            Ok(of(name, seconds)?.ok().filter(|run| run.converged() && is_as_good(run)))
        };
        let rivals: Vec<_> = methods(Chart::Families).iter().map(|row| row.name).collect();
        let mut others = vec![];
        for name in rivals {
            let run = measure(repeats, &[name], |name| by(name, time(best)))?.pop().flatten();
            best = run.as_ref().map_or(best, |run| best.min(run.quartile(0)));
            others.extend(run.map(|run| (name, run)));
        }
        others.sort_by(|one, other| one.1.quartile(0).total_cmp(&other.1.quartile(0)));
        // AUTO and the fastest once more, in turns.
        if let (true, Some((name, first))) = (auto.converged(), others.first_mut()) {
            let again = measure(repeats, &["AUTO", *name], |name| {
                if *name == "AUTO" { by_auto() } else { by(name, time(best)) }
            })?;
            for (run, again) in [&mut auto, first].into_iter().zip(again) {
                run.seconds.extend(again.map_or(vec![], |again| again.seconds));
                run.seconds.sort_by(f64::total_cmp);
            }
        }
        Ok(Self { n: problem.q.len(), drawn, auto, others })
    }

    fn family(&self) -> &str {
        self.drawn.name.rsplit_once('-').map_or("", |(family, _)| family)
    }

    /// The ratio of AUTO to the best of the others, 1 where it is the best itself: of seconds, or
    /// of sweeps where these are few; nothing where it fails.
    fn ratio(&self) -> Option<f64> {
        if self.auto.quartile(0) < SHORT {
            self.ratio_of_sweeps()
        } else {
            self.over(|run| run.quartile(0))
        }
    }

    fn ratio_of_sweeps(&self) -> Option<f64> {
        self.over(|run| run.outcome.sweeps.max(1) as f64)
    }

    fn over(&self, cost: impl Fn(&Run) -> f64) -> Option<f64> {
        let own = cost(&self.auto);
        let best = self.others.iter().fold(own, |best, (_, run)| best.min(cost(run)));
        self.auto.converged().then(|| own / best)
    }

    fn line(&self) -> String {
        let Self { drawn: Drawn { name, about, .. }, n, auto, others } = self;
        let Outcome { status, iterations, sweeps, linear_iterations, .. } = auto.outcome;
        let cost = |(name, run): &(&str, Run), between: &str| {
            let (seconds, sweeps) = (run.quartile(0), run.outcome.sweeps);
            format!("{name}{between}{seconds:.6}{between}{sweeps}")
        };
        let turns = auto.turns.iter().map(|turn| format!("{} {}", turn.choice, turn.sweeps));
        let turns: Vec<_> = turns.collect();
        let all: Vec<_> = others.iter().map(|other| cost(other, " ")).collect();
        let fewest = others.iter().map(|(_, run)| run.outcome.sweeps).min();
        format!(
            "{name}|{about}|{n}|{status}|{}|{iterations}|{}|{sweeps}|{:.6}|{}|{}|{}|{}",
            turns.join("; "),
            linear_iterations.unwrap_or(0),
            auto.quartile(0),
            others.first().map_or("||".to_owned(), |best| cost(best, "|")),
            fewest.map_or(String::new(), |sweeps| sweeps.to_string()),
            self.ratio().map_or(String::new(), |ratio| format!("{ratio:.3}")),
            all.join("; "),
        )
    }
}

pub(crate) fn run(arguments: &Arguments) -> Fallible<()> {
    let Arguments { names, problems, seed, quick, out } = arguments;
    let mut drawn = vec![];
    for name in names {
        let parts = name.rsplit_once('-').and_then(|(of, seed)| Some((of, seed.parse().ok()?)));
        let known = parts.and_then(|(family, seed)| families::draw(family, seed));
        drawn.push(known.ok_or_else(|| {
            let families = [families::NAMES.join(", "), families::LARGE.join(", ")].join(", ");
            format!("'{name}' is no family with a number, as rings-7; the families are {families}")
        })?);
    }
    if names.is_empty() {
        let all: Vec<_> = families::NAMES.into_iter().chain(families::LARGE).collect();
        let count = all.len() as u64;
        let of = |k: u64| families::draw(all[(k % count) as usize], seed + k / count);
        drawn = (0..*problems).filter_map(of).collect();
    }
    let bar = counting(drawn.len());
    let mut rows: Vec<Row> = vec![];
    for drawn in drawn {
        bar.set_message(drawn.name.clone());
        rows.push(if drawn.single { Row::new::<f32>(drawn)? } else { Row::new::<f64>(drawn)? });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut table = Table::new(
        "problem|numbers|n|status|turns|iterations|inner|sweeps|seconds|\
         best other|its seconds|its sweeps|fewest sweeps|ratio|others",
    );
    rows.iter().for_each(|row| table.row(&row.line()));
    table.write_csv(&out.join("families"))?;
    let suffix = match (&names[..], quick) {
        ([], true) => " --quick".to_owned(),
        ([], false) => format!(" --problems {problems} --seed {seed}"),
        (names, _) => format!(" {}", names.join(" ")),
    };
    let command = format!("cargo run --release -- families{suffix}");
    let text = report(&rows, &provenance(&command));
    print::line(&text)?;
    save(&out.join("families.md"), &text)
}

/// Returns the distributions, and the problems that AUTO does not solve or not as fast.
fn report(rows: &[Row], provenance: &str) -> String {
    let mut table = Table::new(
        "family | problems | solved | others solve | nobody solves | median, 90 %, worst | of sweeps",
    );
    let mut add = |name: &str, of: &[&Row]| {
        let places = |ratio: fn(&Row) -> Option<f64>| {
            let mut ratios: Vec<f64> = of.iter().filter_map(|row| ratio(row)).collect();
            ratios.sort_by(f64::total_cmp);
            let at = |share: f64| {
                let place = (share * ratios.len() as f64).ceil() as usize;
                ratios.get(place.saturating_sub(1)).map_or("–".to_owned(), |r| format!("{r:.2}"))
            };
            [0.5, 0.9, 1.0].map(at).join(", ")
        };
        let lost = of.iter().filter(|row| row.ratio().is_none());
        let (others, nobody): (Vec<&&Row>, Vec<&&Row>) =
            lost.partition(|row| !row.others.is_empty());
        let [problems, others, nobody] = [of.len(), others.len(), nobody.len()];
        let solved = problems - others - nobody;
        let [all, of_sweeps] = [places(Row::ratio), places(Row::ratio_of_sweeps)];
        table.row(&format!("{name}|{problems}|{solved}|{others}|{nobody}|{all}|{of_sweeps}"));
    };
    for family in families::NAMES.into_iter().chain(families::LARGE) {
        let of: Vec<_> = rows.iter().filter(|row| row.family() == family).collect();
        if !of.is_empty() {
            add(family, &of);
        }
    }
    add("**all**", &rows.iter().collect::<Vec<_>>());
    let mut slow =
        Table::new("problem | n | AUTO | seconds, sweeps | best other | seconds, sweeps");
    for row in rows.iter().filter(|row| row.ratio().is_none_or(|ratio| ratio > 2.0)) {
        let cost = |run: &Run| format!("{:.4}, {}", run.quartile(0), run.outcome.sweeps);
        let (name, best) =
            row.others.first().map_or(("–", "–".to_owned()), |(name, run)| (name, cost(run)));
        let Row { drawn: Drawn { name: problem, about, .. }, n, auto, .. } = row;
        let uses = auto.turns.last().map_or(String::new(), |turn| turn.choice.to_string());
        let (status, own) = (auto.outcome.status, cost(auto));
        slow.row(&format!("{problem}: {about}|{n}|{status}, {uses}|{own}|{name}|{best}"));
    }
    let (table, slow) = (table.markdown(), slow.markdown());
    format!("# AUTO on random families\n\n{provenance}\n\n{table}\n{slow}")
}
