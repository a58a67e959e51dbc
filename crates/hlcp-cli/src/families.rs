//! `hlcp families`: `AUTO` on problems that nobody chose, beside every other method.
//!
//! Problems are drawn by seed from the families of `hlcp-verify`. Each is solved by `AUTO`, and by
//! the other methods in about three times as long; where `AUTO` fails they get ten seconds. Times
//! are with the set-up, the shortest of up to four. The distributions go to `families.md`, every
//! run to `families.csv`.

use std::{
    error::Error,
    fmt::Write as _,
    path::PathBuf,
    time::{Duration, Instant},
};

use clap::Args;
use hlcp_core::Scalar;
use hlcp_methods::{Auto, AutoTurn, Limits, Named, Outcome, Parameters, Solver};
use hlcp_verify::families::{self, Drawn};

use crate::{
    chart::{provenance, save, write_csv},
    print,
    progress::counting,
    scenes::Problem,
};

const EXAMPLES: &str = "\
Examples:
  hlcp families --quick
  hlcp families rings-7 sparse-12";

/// Compare AUTO with every other method on problems drawn at random
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Problems by name, as rings-7; otherwise all families are drawn from
    #[arg(conflicts_with_all = ["problems", "seed", "quick"])]
    names: Vec<String>,
    /// How many problems to draw
    #[arg(long, default_value_t = 510, default_value_if("quick", "true", "15"))]
    problems: u64,
    /// The seed of the first problem of each family; the next ones follow
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One problem of each family
    #[arg(long, conflicts_with_all = ["problems", "seed"])]
    quick: bool,
    /// The folder for the table and the list of runs
    #[arg(long, default_value = "target/families")]
    out: PathBuf,
}

const METHODS: [&str; 9] =
    ["ADAPTIVE", "NEWTON", "AMG", "MGW", "MGF", "FMG", "ANDERSON", "TMGS", "MGS"];

/// The seconds that `AUTO` has, and those that the others have where it fails.
const PATIENCE: [f64; 2] = [20.0, 10.0];

/// Below so many seconds the work counts: what else the machine does would decide.
const SHORT: f64 = 0.005;

/// Runs of less than so many seconds are repeated, twice at most, and the shortest counts.
const BRIEF: f64 = 0.05;

/// A solve, and the seconds of it with its set-up.
struct Run {
    outcome: Outcome,
    seconds: f64,
}

/// The result of `run`, if it has one, and the fewest seconds that it took.
fn timed<R>(run: impl Fn() -> Option<R>) -> Option<(R, f64)> {
    let once = || {
        let begin = Instant::now();
        Some((run()?, begin.elapsed().as_secs_f64()))
    };
    let (result, mut seconds) = once()?;
    for _ in 0..2 {
        if seconds < BRIEF {
            seconds = once().map_or(seconds, |again| again.1.min(seconds));
        }
    }
    Some((result, seconds))
}

/// What came of a problem.
struct Row {
    drawn: Drawn,
    n: usize,
    auto: Run,
    turns: Vec<AutoTurn>,
    /// The methods that converged, in the time that they had.
    others: Vec<(&'static str, Run)>,
}

impl Row {
    fn new<T: Scalar>(drawn: Drawn) -> Result<Self, Box<dyn Error>> {
        let ([a, b], q) = drawn.pose::<T>();
        let given = Problem::new(a, b, q);
        let (problem, q) = (given.hlcp(T::one())?, &given.q);
        let limits = |seconds| {
            let time = Some(Duration::from_secs_f64(seconds));
            // What no precision can reach is not asked for.
            Limits { time, rounding: Some(4.0), ..Limits::default() }
        };
        let by_auto = || {
            let mut solver = Solver::new(Auto::new(problem.clone()).ok()?);
            let outcome = solver.solve(q, limits(PATIENCE[0])).ok()?;
            Some((outcome, solver.method().history().to_vec()))
        };
        let solved = timed(by_auto).ok_or_else(|| format!("AUTO refuses {}", drawn.name))?;
        let ((outcome, turns), mut seconds) = solved;
        // Others may be at the processor meanwhile.
        let time = if outcome.converged() { 0.02 + 3.0 * seconds } else { PATIENCE[1] };
        let by = |name: &str| {
            let (outcome, seconds) = timed(|| {
                let method = Named::parse(name, Parameters::default()).ok()?;
                let mut solver = Solver::new(method.on(problem.clone()).ok()?);
                solver.solve(q, limits(time)).ok().filter(Outcome::converged)
            })?;
            Some(Run { outcome, seconds })
        };
        let runs = METHODS.into_iter().map(|name| Some((name, by(name)?)));
        let mut others: Vec<_> = runs.flatten().collect();
        others.sort_by(|one, other| one.1.seconds.total_cmp(&other.1.seconds));
        // AUTO and the fastest once more, in turns.
        if let (true, Some((name, best))) = (outcome.converged(), others.first_mut()) {
            seconds = timed(by_auto).map_or(seconds, |again| again.1.min(seconds));
            best.seconds = by(name).map_or(best.seconds, |again| again.seconds.min(best.seconds));
        }
        let auto = Run { outcome, seconds };
        Ok(Self { n: q.len(), drawn, auto, turns, others })
    }

    fn family(&self) -> &str {
        self.drawn.name.rsplit_once('-').map_or("", |(family, _)| family)
    }

    /// The ratio of AUTO to the best of the others, 1 where it is the best itself: of seconds, or
    /// of sweeps where these are few; nothing where it fails.
    fn ratio(&self) -> Option<f64> {
        if self.auto.seconds < SHORT {
            self.ratio_of_sweeps()
        } else {
            self.over(|run| run.seconds)
        }
    }

    fn ratio_of_sweeps(&self) -> Option<f64> {
        self.over(|run| run.outcome.sweeps.max(1) as f64)
    }

    fn over(&self, cost: impl Fn(&Run) -> f64) -> Option<f64> {
        let own = cost(&self.auto);
        let best = self.others.iter().fold(own, |best, (_, run)| best.min(cost(run)));
        self.auto.outcome.converged().then(|| own / best)
    }

    fn line(&self) -> String {
        let Self { drawn: Drawn { name, about, .. }, n, auto, turns, others } = self;
        let Outcome { status, iterations, sweeps, linear_iterations, .. } = auto.outcome;
        let best = others.first().map_or(String::new(), |(name, run)| {
            format!("{name},{:.6},{}", run.seconds, run.outcome.sweeps)
        });
        let turns: Vec<_> =
            turns.iter().map(|turn| format!("{} {}", turn.choice, turn.sweeps)).collect();
        let all: Vec<_> = others
            .iter()
            .map(|(name, run)| format!("{name} {:.6} {}", run.seconds, run.outcome.sweeps))
            .collect();
        let fewest = others.iter().map(|(_, run)| run.outcome.sweeps).min();
        format!(
            "{name},\"{about}\",{n},{status},\"{}\",{iterations},{},{sweeps},{:.6},{},{},{},\"{}\"",
            turns.join("; "),
            linear_iterations.unwrap_or(0),
            auto.seconds,
            if best.is_empty() { ",,".to_owned() } else { best },
            fewest.map_or(String::new(), |sweeps| sweeps.to_string()),
            self.ratio().map_or(String::new(), |ratio| format!("{ratio:.3}")),
            all.join("; "),
        )
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let Arguments { names, problems, seed, quick, out } = arguments;
    let mut drawn = vec![];
    for name in names {
        let parts = name.rsplit_once('-').and_then(|(of, seed)| Some((of, seed.parse().ok()?)));
        let known = parts.and_then(|(family, seed)| families::draw(family, seed));
        drawn.push(known.ok_or_else(|| {
            let families = families::NAMES.join(", ");
            format!("'{name}' is no family with a number, as rings-7; the families are {families}")
        })?);
    }
    if names.is_empty() {
        let count = families::NAMES.len() as u64;
        let of = |k: u64| families::draw(families::NAMES[(k % count) as usize], seed + k / count);
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
    let header = "problem,numbers,n,status,turns,iterations,inner,sweeps,seconds,\
                  best other,its seconds,its sweeps,fewest sweeps,ratio,others";
    write_csv(&out.join("families"), header, &rows.iter().map(Row::line).collect::<Vec<_>>())?;
    let suffix = match (&names[..], quick) {
        ([], true) => " --quick".to_owned(),
        ([], false) => format!(" --problems {problems} --seed {seed}"),
        (names, _) => format!(" {}", names.join(" ")),
    };
    let command = format!("cargo run --release -- families{suffix}");
    let text = report(&rows, &provenance(&command))?;
    print::line(&text)?;
    save(&out.join("families.md"), &text)
}

/// A table of the distributions, and the problems that AUTO does not solve or not as fast.
fn report(rows: &[Row], provenance: &str) -> Result<String, std::fmt::Error> {
    let mut text = format!(
        "# AUTO on random families\n\n{provenance}\n\n\
         | family | problems | solved | others solve | nobody solves | median, 90 %, worst | of sweeps |\n\
         |---|---|---|---|---|---|---|\n"
    );
    let mut table = |name: &str, of: &[&Row]| {
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
        let solved = of.len() - others.len() - nobody.len();
        let counts = [of.len(), solved, others.len(), nobody.len()].map(|n| n.to_string());
        let [all, of_sweeps] = [places(Row::ratio), places(Row::ratio_of_sweeps)];
        writeln!(text, "| {name} | {} | {all} | {of_sweeps} |", counts.join(" | "))
    };
    for family in families::NAMES {
        let of: Vec<_> = rows.iter().filter(|row| row.family() == family).collect();
        if !of.is_empty() {
            table(family, &of)?;
        }
    }
    table("**all**", &rows.iter().collect::<Vec<_>>())?;
    let slow = |row: &&Row| row.ratio().is_none_or(|ratio| ratio > 2.0);
    writeln!(text, "\n| problem | n | AUTO | seconds, sweeps | best other | seconds, sweeps |")?;
    writeln!(text, "|---|---|---|---|---|---|")?;
    for row in rows.iter().filter(slow) {
        let cost = |run: &Run| format!("{:.4}, {}", run.seconds, run.outcome.sweeps);
        let (name, best) =
            row.others.first().map_or(("–", "–".to_owned()), |(name, run)| (name, cost(run)));
        let Row { drawn: Drawn { name: problem, about, .. }, n, auto, turns, .. } = row;
        let uses = turns.last().map_or(String::new(), |turn| turn.choice.to_string());
        let status = auto.outcome.status;
        writeln!(
            text,
            "| {problem}: {about} | {n} | {status}, {uses} | {} | {name} | {best} |",
            cost(auto)
        )?;
    }
    Ok(text)
}
