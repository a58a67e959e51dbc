use hlcp_core::{Hlcp, LinearOperator, Norms, Rhs, Scalar};

use super::Multigrid;
use crate::{Clock, Method, Work};

/// Full multigrid: a solve begins with nested iteration, whatever the start, and goes on by cycles.
///
/// `q` is restricted to all grids; the coarsest grid's solution, interpolated by cubics, is the
/// start on the next finer one, where a cycle improves it, and so on. The problem's own grid gets
/// four more sweeps and a second cycle.
///
/// # Cost
///
/// The first iteration walks the rows some 30 times (W-cycles) or 27 (F-cycles), the others as
/// [`Multigrid`]'s; no more storage than that.
///
/// # Convergence
///
/// As [`Multigrid`]'s. On a problem that comes from a differential equation the first iteration's
/// answer is as near to the discrete solution as that is to the continuous one
/// (`docs/results/beyond.md` has figures).
///
/// ```
/// use hlcp_methods::{
///     Cycle, FivePoint, FullMultigrid, Hlcp, Identity, Limits, Multigrid, Omega, Options,
///     Solver,
/// };
///
/// let m = 63;
/// let a = FivePoint::new(m, m, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, Identity { order: m * m }, Omega::Uniform(4.0))?;
/// let mut solver = Solver::new(FullMultigrid::new(Multigrid::new(problem, Cycle::F)?));
///
/// let q: Vec<f64> = (0..m * m).map(|k| if k % m < 20 { -2e-3 } else { 1e-3 }).collect();
/// let one = Limits { iterations: 1, ..Limits::default() };
/// let after_one = solver.solve(&q, one)?;
/// assert!(!after_one.converged() && after_one.residual.l2 < 1e-2);
/// assert!(solver.solve(&q, Options::from_x(&vec![1.0; m * m]))?.converged());
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct FullMultigrid<T: Scalar, A, B> {
    multigrid: Multigrid<T, A, B>,
    begun: bool,
}

impl<T: Scalar, A, B> FullMultigrid<T, A, B> {
    /// Full multigrid by the cycles of `multigrid`.
    pub fn new(multigrid: Multigrid<T, A, B>) -> Self {
        Self { multigrid, begun: false }
    }
}

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Method<T> for FullMultigrid<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        self.multigrid.problem()
    }

    fn work(&self) -> Option<Work> {
        self.multigrid.work()
    }

    fn restart(&mut self) {
        self.multigrid.restart();
        self.begun = false;
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn works_on_ranks(&self) -> bool {
        true
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        if std::mem::replace(&mut self.begun, true) {
            return self.multigrid.step(q, x, y, clock);
        }
        let norms = self.multigrid.norms(q, x);
        self.multigrid.nested(q, y, clock);
        norms
    }
}
