//! The scenes: what they are, their published answers, and what is proved of them.

mod american_put;
mod bearing2d;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod dam;
#[path = "../theory/exact.rs"]
mod exact;
mod film;
mod proved_film;
mod published;

use hlcp_core::{Aor, Rows};
use hlcp_methods::{Limits, Named, Options, Solver};
use hlcp_verify::{Convergence, Proof, classes::is_m, convergence, uniqueness};
use nalgebra::{DMatrix, DVector};

/// `A`, `B` and `q` of a balance, face by face: what passes a face leaves one cell and enters the
/// next, and a cell that is not there is the boundary.
struct Balance {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    q: DVector<f64>,
}

type Face = [Option<usize>; 2];

impl Balance {
    fn new(n: usize) -> Self {
        Self { a: DMatrix::zeros(n, n), b: DMatrix::zeros(n, n), q: DVector::zeros(n) }
    }

    /// Lets what falls between `z` of the cells drive a flow, with 0 for `z` of the boundary.
    fn drive(&mut self, [from, to]: Face, conductance: f64) {
        for (here, there) in [(from, to), (to, from)] {
            let Some(here) = here else { continue };
            self.a[(here, here)] += conductance;
            there.into_iter().for_each(|there| self.a[(here, there)] -= conductance);
        }
    }

    /// Lets `1 − r` times a flow be carried from a cell to the next; the boundary is full.
    fn carry(&mut self, [from, to]: Face, flow: f64) {
        for (cell, leaves) in [(from, flow), (to, -flow)] {
            let Some(cell) = cell else { continue };
            self.q[cell] += leaves;
            from.into_iter().for_each(|from| self.b[(cell, from)] += leaves);
        }
    }
}

/// Holds that A and B are M-matrices, that every q has one solution and that the steps converge to
/// it, and returns what proves the last.
fn proved(a: &impl Rows<f64>, b: &impl Rows<f64>, steps: &[Aor<f64>]) -> Proof {
    assert!(is_m(a).is_yes() && is_m(b).is_yes());
    assert!(uniqueness(a, b).unwrap().is_proved());
    match convergence(&common::problem(1.0, a, b), steps) {
        Convergence::Proved(proof, _) => proof,
        found => panic!("{found}"),
    }
}

/// `z` and `r` by a method, to this part of ‖q‖.
fn solved(
    (a, b, q): (impl Rows<f64>, impl Rows<f64>, Vec<f64>),
    method: &str,
    tolerance: f64,
) -> [Vec<f64>; 2] {
    let named: Named = method.parse().unwrap();
    let mut solver = Solver::new(named.on_dyn(common::problem(1.0, &a, &b)).unwrap());
    let outcome = solver.solve(&q, Options::default().limits(Limits::relative(tolerance))).unwrap();
    assert!(outcome.converged(), "{method}: {outcome}");
    [solver.z().to_vec(), solver.r().to_vec()]
}
