//! The counts of an attack, and their table.

use std::{collections::BTreeMap, fmt};

use crate::{
    common::names,
    oracle::solutions,
    problems::{Case, grown},
    runs::{Fault, Precision, Run, runs},
};

/// The counts of one method in one precision.
#[derive(Debug, Clone, Default)]
pub(crate) struct Counts {
    pub(crate) runs: usize,
    pub(crate) converged: usize,
    faults: BTreeMap<Fault, usize>,
    worst: f64,
}

/// What an attack has seen.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tally {
    pub(crate) problems: usize,
    pub(crate) unsolvable: usize,
    pub(crate) several: usize,
    pub(crate) by_method: BTreeMap<(String, Precision), Counts>,
    /// The first of each kind, for each method and precision.
    pub(crate) examples: Vec<String>,
}

/// The runs of all methods on one problem, which has so many basic solutions.
pub(crate) struct Attacked {
    seed: u64,
    case: Case,
    found: usize,
    runs: Vec<(String, Precision, Vec<Run>)>,
}

/// Runs all methods on the problem of a seed.
pub(crate) fn attack(seed: u64) -> Attacked {
    let case = grown(seed);
    let found = solutions(&case.a, &case.b, &case.q).len();
    let both = [Precision::Single, Precision::Double];
    let all = names().flat_map(|name| both.map(|precision| (name.clone(), precision)));
    let runs_of = |(name, precision): (String, Precision)| {
        let runs = runs(&case, precision, &name, found > 0);
        (name, precision, runs)
    };
    Attacked { seed, runs: all.map(runs_of).collect(), case, found }
}

impl Tally {
    pub(crate) fn runs(&self) -> usize {
        self.by_method.values().map(|counts| counts.runs).sum()
    }

    pub(crate) fn count(&mut self, Attacked { seed, case, found, runs }: Attacked) {
        self.problems += 1;
        self.unsolvable += usize::from(found == 0);
        self.several += usize::from(found > 1);
        for (name, precision, runs) in runs {
            let counts = self.by_method.entry((name.clone(), precision)).or_default();
            for (run, start) in runs.into_iter().zip(&case.starts) {
                counts.runs += 1;
                counts.converged += usize::from(run.converged);
                counts.worst = counts.worst.max(run.over_asked);
                for (fault, detail) in run.faults {
                    let count = counts.faults.entry(fault).or_default();
                    *count += 1;
                    if *count == 1 {
                        let case = Case { starts: vec![start.clone()], ..case.clone() };
                        // As an expression for a test.
                        let case = format!("{case:?}").replace('[', "vec![");
                        self.examples.push(format!(
                            "{fault:?}, {name:?}, {precision:?}, seed {seed}: {detail}\n    {case}"
                        ));
                    }
                }
            }
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { problems, unsolvable, several, by_method, .. } = self;
        let solvable = problems - unsolvable;
        writeln!(
            f,
            "{problems} problems: {unsolvable} unsolvable, {solvable} solvable ({several} with several basic solutions)"
        )?;
        let header = ["runs", "converged", "false", "inexact", "lost best", "unsound", "panics"];
        write!(f, "{:24}", "method")?;
        header.iter().try_for_each(|name| write!(f, "{name:>11}"))?;
        writeln!(f, "  worst/asked")?;
        let mut line = |name: &str, counts: &Counts| {
            write!(f, "{name:24}{:11}{:11}", counts.runs, counts.converged)?;
            use Fault::{FalseConverged, Inexact, LostBest, Panicked, Unsound};
            for fault in [FalseConverged, Inexact, LostBest, Unsound, Panicked] {
                write!(f, "{:11}", counts.faults.get(&fault).unwrap_or(&0))?;
            }
            writeln!(f, "  {:11.2e}", counts.worst)
        };
        let mut all = Counts::default();
        for ((name, precision), counts) in by_method {
            line(&format!("{name}, {precision:?}"), counts)?;
            all.runs += counts.runs;
            all.converged += counts.converged;
            all.worst = all.worst.max(counts.worst);
            for (&fault, count) in &counts.faults {
                *all.faults.entry(fault).or_default() += count;
            }
        }
        line("all", &all)
    }
}
