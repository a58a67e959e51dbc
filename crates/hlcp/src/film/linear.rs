//! The linear systems that a film's solution leaves.

use hlcp_methods::{Amg, Clock, Jacobian, SparseLu};

use super::{
    FilmError,
    solve::{Operators, modulus, problem},
};

/// What is enough of any answer, because rounding ends a solve sooner where the gap jumps.
const ENOUGH: f64 = 1e-8;

/// How `z` and `r` answer a change of `A z − B r + q`, full and broken cells staying what they are:
/// `[A_F | −B_C] (δz, δr) = −change`.
pub(super) struct Linear {
    operators: Operators,
    x: Vec<f64>,
    tolerance: f64,
    solver: Eliminated,
}

enum Eliminated {
    Direct(SparseLu),
    /// Takes ten times as long, but no more memory for more than a million cells.
    Multigrid(Amg<f64>),
}

impl Linear {
    /// That of these operators, with cells that are broken where `r` is positive; solved to the
    /// tolerance if not by an elimination.
    pub(super) fn of(operators: Operators, r: &[f64], tolerance: f64) -> Result<Self, FilmError> {
        let x = modulus(r);
        let problem = problem(&operators)?;
        let jacobian = Jacobian::new(&problem, &x);
        let row = |k: usize, each: &mut dyn FnMut(usize, f64)| jacobian.visit_row(k, each);
        let solver = match SparseLu::of(r.len(), row) {
            Ok(lu) => Eliminated::Direct(lu),
            Err(_) => Eliminated::Multigrid(Amg::new(&problem)?),
        };
        Ok(Self { operators, x, tolerance, solver })
    }

    /// Whether the same cells are broken.
    pub(super) fn is_at(&self, r: &[f64]) -> bool {
        self.x.iter().zip(r).all(|(x, r)| (*x < 0.0) == (*r > 0.0))
    }

    /// Returns the changes of `z` and `r` that a change of `A z − B r + q` brings about.
    pub(super) fn answer(&mut self, change: &[f64]) -> Result<[Vec<f64>; 2], FilmError> {
        let problem = problem(&self.operators)?;
        let jacobian = Jacobian::new(&problem, &self.x);
        let (mut s, mut reached) = (vec![0.0; change.len()], 0.0);
        match &mut self.solver {
            Eliminated::Direct(lu) => lu.solve(change, &mut s),
            Eliminated::Multigrid(amg) => {
                let goal = (self.tolerance, 400);
                reached = amg.solve_to(&jacobian, change, &mut s, goal, &mut Clock::endless());
            }
        }
        let is_finite = s.iter().all(|s| s.is_finite());
        if reached > self.tolerance.max(ENOUGH) || reached.is_nan() || !is_finite {
            return Err(FilmError::Derivatives(reached));
        }
        // J has the columns 2A where a cell is full, and 2ΩB elsewhere.
        let part = |of_z: bool| {
            let entry = |(j, s): (usize, &f64)| match (jacobian.is_active(j), of_z) {
                (true, true) => -2.0 * s,
                (false, false) => 2.0 * problem.omega().entry(j) * s,
                _ => 0.0,
            };
            s.iter().enumerate().map(entry).collect()
        };
        Ok([part(true), part(false)])
    }
}
