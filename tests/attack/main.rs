//! An attack on every method: small random problems of which many have no solution or several, held
//! against exact arithmetic. No answer may be wrong, whatever the status says.
//!
//! The gate makes some 20,000 runs. A million, with a table of counts:
//!
//! ```text
//! HLCP_ATTACK_RUNS=1000000 cargo test --release --test attack -- every_method --nocapture
//! ```
//!
//! Problem `k` grows from the seed `s + k` alone, where `s` is `HLCP_ATTACK_SEED` or [`SEED`]. A
//! failure names the problem's own seed, so `HLCP_ATTACK_SEED=<seed> HLCP_ATTACK_RUNS=1` runs that
//! problem and no other, and prints the problem as an expression for a test in this file:
//! [`faults`] takes it.

#[path = "../common/mod.rs"]
mod common;
mod count;
mod oracle;
mod problems;
mod runs;

use common::asked;
use count::{Tally, attack};
use hlcp_core::{Aor, Hlcp, Omega};
use hlcp_methods::{Mms, Options, Solver};
use oracle::solutions;
use problems::{Case, identity};
use rayon::prelude::*;
use runs::{Fault, Precision, lists, runs};

/// The seed of the first problem, unless the environment has another.
const SEED: u64 = 20_250_807;

/// The runs of the gate.
const RUNS: usize = 20_000;

/// The problems that are attacked side by side.
const BATCH: usize = 64;

#[test]
fn every_method_tells_the_truth() {
    let (first, wanted) = (asked("HLCP_ATTACK_SEED", SEED), asked("HLCP_ATTACK_RUNS", RUNS));
    let mut tally = Tally::default();
    let (mut seed, batch) = (first, wanted.min(BATCH) as u64);
    while tally.runs() < wanted {
        let seeds = (0..batch).into_par_iter().map(|k| seed.wrapping_add(k));
        let attacked: Vec<_> = seeds.map(attack).collect();
        attacked.into_iter().for_each(|each| tally.count(each));
        seed = seed.wrapping_add(batch);
    }
    println!("{tally}");
    assert!(tally.examples.is_empty(), "from seed {first}:\n{}", tally.examples.join("\n"));
    // Of enough problems a third is of the kind that misleads, a third is not, and none is for
    // nothing.
    let Tally { problems, unsolvable, several, by_method, .. } = tally;
    if problems >= 100 {
        assert!(by_method.values().all(|counts| 5 * counts.converged >= counts.runs));
        assert!(3 * (unsolvable + several) >= problems && 3 * (problems - unsolvable) >= problems);
    }
}

/// The faults of one method on one case.
fn faults(case: &Case, name: &str, precision: Precision) -> Vec<(Fault, String)> {
    let solvable = !solutions(&case.a, &case.b, &case.q).is_empty();
    let runs = runs(case, precision, name, solvable);
    assert_eq!(runs.len(), case.starts.len(), "{name} takes the problem");
    runs.into_iter().flat_map(|run| run.faults).collect()
}

/// Az − r = e has no solution with r ≥ 0, since the rows of A sum to zero: iterates run away along
/// (1, 1), and what rounding excuses grows with them.
#[test]
fn a_diverging_iterate_is_no_solution_in_single_precision() {
    let case = Case::typed("1 -1; -1 1", "1 0; 0 1", "-1 -1");
    assert_eq!(faults(&case, "ANDERSON", Precision::Single), []);
}

/// (2, 3, 5)A = 0 and (2, 3, 5)·q = −4 < 0: where a nearly singular J throws x to 10¹⁵, A z has no
/// digits left.
#[test]
fn a_residual_of_rounding_alone_is_not_taken_for_zero() {
    let case = Case::typed("4 -2 -2; -1 3 -2; -1 -1 2", "1 0 0; 0 1 0; 0 0 1", "-1 1 -1");
    assert_eq!(faults(&case, "NEWTON", Precision::Double), []);
}

/// An iterate that seems to converge and does not, when measured again, is not the best one for
/// that.
#[test]
fn a_failed_check_leaves_the_best_iterate_alone() {
    let case = Case {
        iterations: 1400,
        ..Case::typed(
            "1 -3 3 2; -2 4 1 3; 2 -1 4 0; -3 -3 -3 2",
            "3 1 -3 -3; 3 3 0 1; -1 -3 4 3; -3 -3 3 3",
            "-1 0 -3 3",
        )
    };
    assert_eq!(faults(&case, "TMGSSOR1", Precision::Single), []);
}

/// The second column of B is zero, so r₁ shows in no residual, and ω carries it beyond the largest
/// number.
#[test]
fn r_is_finite_where_a_zero_column_hides_it() {
    let a = lists(&identity(2));
    let b = lists(&vec![vec![1, 0], vec![1, 0]]);
    let problem = Hlcp::new(a, b, Omega::Uniform(1e300)).unwrap();
    let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
    let outcome = solver.solve(&[1e-11, 1e-11], Options::from_x(&[0.0, -1e10])).unwrap();
    let finite = solver.z().iter().chain(solver.r()).all(|v: &f64| v.is_finite());
    assert!(finite || !outcome.converged(), "{outcome}: r = {:?}", solver.r());
}
