//! Multigrid for the modulus equation: `docs/methods.md` has the derivation.

mod cycle;
mod full;
mod hierarchy;
mod pace;
mod smoother;
mod transfer;

use hlcp_core::{Error, Hlcp, LinearOperator, Norms, Omega, Rhs, Scalar};

pub use self::{
    cycle::Cycle,
    full::FullMultigrid,
    hierarchy::{Coarsen, Grids, Rediscretise},
};
use self::{
    cycle::{Equation, Level, Work},
    pace::{Pace, Turn},
    smoother::{Pair, Source},
    transfer::Axis,
};
use crate::{Clock, Method, Work as Count};

/// Multigrid by the full approximation scheme, for a pair of five-point operators: the number of
/// iterations does not grow with the grid.
///
/// An iteration is a cycle on `F(x) = (A + BΩ)x + (A − BΩ)|x| + γq = 0`. It smooths by Gauss–Seidel
/// sweeps that solve each scalar equation exactly, one forward and one backward; solves the same
/// kind of equation on a grid of half as many points per side, `K_H(x_H) = K_H(I x) − R F(x)` with
/// `K(x) = F(x) − γq`; adds the interpolated `P(x_H − I x)`; and smooths again. `I` takes the
/// nearest point, `P` is bilinear, `R` is the transpose of `P` up to a factor. Ω keeps its numbers.
/// The coarse grid's equation is itself an HLCP's and is solved by cycles in turn.
///
/// # Safeguard
///
/// Coarse grids cannot help where the signs of the solution change from point to point, and a cycle
/// may stall or diverge. The first iteration therefore measures what a cycle gains over sweeps for
/// the same work, and the better goes on: an iteration is a cycle, or as many sweeps as a cycle is
/// worth. A cycle that takes less than a tenth off the defect hands over to sweeps; sweeps that do
/// not halve it put cycles on trial now and then, and the iterate before a trial that failed is
/// taken up again. In the place of their first trial F-cycles give way to W-cycles, with which the
/// safeguard begins anew: where coarse grids do not fit into finer ones, as those of an even number
/// of points, a single visit to them may not do. A coarse correction that is not finite is never
/// added.
/// [`coarse_grids_help`](Self::coarse_grids_help) says which of the two is at work. Whether an
/// answer is one is for the [`Solver`](crate::Solver) to tell, from the problem itself.
///
/// # Cost
///
/// An iteration walks some 12 times over the rows with W-cycles, 11 with F-cycles, 8 with V-cycles,
/// whatever the size; one that measures, half as often again. Storage: `5n/3` numbers (a defect,
/// and `x` and `f` on the coarser grids); `n` more once cycles are on trial; up to `10n/3` for
/// coarse coefficients where the problem's own vary.
///
/// # Convergence
///
/// No theorem covers the cycle on this equation. The sweeps alone converge from any start for a
/// pair of matrices with the `C` of `docs/theory.md` an M-matrix, and for the LCP with a symmetric
/// positive definite `A`, where they are projected Gauss–Seidel. Measured:
/// `docs/results/beyond.md`.
///
/// # Source
///
/// A. Brandt, *Multi-level adaptive solutions to boundary-value problems*, Mathematics of
/// Computation 31 (1977), for the full approximation scheme; A. Brandt and C. W. Cryer, *Multigrid
/// algorithms for the solution of linear complementarity problems arising from free boundary
/// problems*, SIAM J. Sci. Stat. Comput. 4 (1983), for exact projected relaxation in it. The
/// horizontal problem in modulus form is our own extension.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
/// use hlcp_methods::{Cycle, Limits, Multigrid, Options, Solver};
///
/// // A membrane on 63 × 63 points, pressed against a flat obstacle in the middle and lifted at the
/// // sides.
/// let m = 63;
/// let a = FivePoint::new(m, m, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, Identity { order: m * m }, Omega::Uniform(4.0))?;
/// let mut multigrid = Solver::new(Multigrid::new(problem, Cycle::W)?);
///
/// let q: Vec<f64> = (0..m * m).map(|k| if k % m < 20 { -2e-3 } else { 1e-3 }).collect();
/// let outcome = multigrid.solve(&q, Options::from_x(&vec![1.0; m * m]))?;
/// assert!(outcome.converged() && outcome.iterations <= 13);
/// assert_eq!(multigrid.method().coarse_grids_help(), Some(true));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Multigrid<T: Scalar, A, B> {
    problem: Hlcp<T, A, B>,
    grid: [usize; 2],
    cycle: Cycle,
    /// Whether F-cycles have given way to W-cycles.
    escalated: bool,
    /// The sweeps that a cycle of the given kind is worth, and a W-cycle.
    sweeps: [usize; 2],
    levels: Vec<Level<T>>,
    work: Work<T>,
    /// The sweeps since the restart.
    taken: usize,
    pace: Pace,
    kept: Vec<T>,
}

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Multigrid<T, A, B> {
    /// Multigrid on `problem`, with its operators discretised again on coarser grids by
    /// [`Rediscretise`].
    ///
    /// # Errors
    ///
    /// As [`with_levels`](Self::with_levels).
    pub fn new(problem: Hlcp<T, A, B>, cycle: Cycle) -> Result<Self, Error> {
        Self::with_levels(problem, cycle, &Rediscretise)
    }

    /// Multigrid on `problem`, with the coarser grids' operators from `coarsen`.
    ///
    /// The coarsest grid is the last that can be coarsened and on which both diagonals are
    /// positive.
    ///
    /// # Errors
    ///
    /// [`Error::NotFivePoint`] as by [`Hlcp::grid`]; [`Error::NotPositive`] for the problem's first
    /// diagonal entry that is not positive, which a sweep divides by; and what `coarsen` refuses.
    pub fn with_levels(
        problem: Hlcp<T, A, B>,
        cycle: Cycle,
        coarsen: &impl Coarsen<T>,
    ) -> Result<Self, Error> {
        let grid = problem.grid()?;
        Pair::new(&problem, grid).ok_or(Error::NotFivePoint { what: "B" })?.positive()?;
        let mut levels = vec![];
        let mut next = coarser(&problem, grid, coarsen)?;
        while let Some(level) = next {
            next = coarser(&level.problem, level.grid(), coarsen)?;
            levels.push(level);
        }
        let points = |grid: [usize; 2]| grid[0] * grid[1];
        let sizes = [grid].into_iter().chain(levels.iter().map(Level::grid)).map(points);
        let sizes: Vec<_> = sizes.collect();
        let sweeps = [cycle, Cycle::W].map(|kind| kind.walks(&sizes).div_ceil(points(grid)));
        let (taken, pace, kept, work) = (0, Pace::new(), vec![], Work::new(grid));
        let escalated = false;
        Ok(Self { problem, grid, cycle, escalated, sweeps, levels, work, taken, pace, kept })
    }

    /// The `[nx, ny]` of the grids, from the problem's own to the coarsest.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
    /// use hlcp_methods::{Cycle, Multigrid};
    ///
    /// let a = FivePoint::new(10, 7, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 70 }, Omega::Uniform(4.0))?;
    /// let multigrid = Multigrid::new(problem, Cycle::W)?;
    /// assert_eq!(multigrid.grids().collect::<Vec<_>>(), [[10, 7], [4, 3], [1, 1]]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn grids(&self) -> impl Iterator<Item = [usize; 2]> {
        [self.grid].into_iter().chain(self.levels.iter().map(Level::grid))
    }

    /// Whether iterations are cycles, since they gain more than sweeps do; `None` before the first
    /// iteration.
    pub fn coarse_grids_help(&self) -> Option<bool> {
        self.pace.cycles()
    }

    /// Overwrites `x` with a start by nested iteration (full multigrid).
    ///
    /// `q` is restricted to all grids; the coarsest grid's solution, interpolated by cubics, is the
    /// start on the next finer one, where a cycle improves it, and so on. The problem's own grid
    /// gets two more sweeps and a second cycle.
    ///
    /// # Cost
    ///
    /// With F-cycles 25 walks over the rows, with W-cycles 28, with V-cycles 18.
    ///
    /// # Panics
    ///
    /// Unless `q` and `x` have the problem's order.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Identity, Norms, Omega, Rhs};
    /// use hlcp_methods::{Clock, Cycle, Method, Multigrid};
    ///
    /// let a = FivePoint::new(31, 31, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 961 }, Omega::Uniform(4.0))?;
    /// let mut multigrid = Multigrid::new(problem, Cycle::W)?;
    /// let (q, mut x) = ([-1e-3; 961], [f64::NAN; 961]);
    /// multigrid.nested(&Rhs::new(&q)?, &mut x, &mut Clock::endless());
    /// let residual =
    ///     multigrid.step(&Rhs::new(&q)?, &x, &mut vec![0.0; 961], &mut Clock::endless());
    /// assert!(residual.l2 < 1e-3);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn nested(&mut self, q: &Rhs<'_, T>, x: &mut [T], clock: &mut Clock<'_>) {
        self.assert_orders([q.entries().len(), x.len()]);
        // A cycle, two sweeps, and a cycle on grids that halve.
        self.taken += 2 * self.sweeps[0] + 2;
        let cycle = self.cycle;
        let mut equation = self.equation(q);
        equation.nested(cycle, x, clock);
        equation.smooth(x, clock);
        equation.cycle(cycle, x, clock);
    }

    /// The norms of `A z − B r + q` at `x`.
    fn norms(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Norms {
        let gamma = self.problem.gamma();
        Norms::of(self.equation(q).defect(x)).divided_by(gamma)
    }

    fn equation<'e>(&'e mut self, q: &Rhs<'e, T>) -> Equation<'e, T> {
        Equation {
            pair: Pair::new(&self.problem, self.grid).expect("five-point operators, as before"),
            f: Source { factor: self.problem.q_factor(), entries: q.entries() },
            coarser: &mut self.levels,
            work: &mut self.work,
        }
    }

    fn assert_orders<const K: usize>(&self, lengths: [usize; K]) {
        assert_eq!(lengths, [self.problem.order(); K], "vectors of the problem's order");
    }
}

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Method<T> for Multigrid<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn work(&self) -> Option<Count> {
        Some(Count::sweeps(self.taken))
    }

    fn restart(&mut self) {
        (self.pace, self.escalated) = (Pace::new(), false);
        self.taken = 0;
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        self.assert_orders([q.entries().len(), x.len(), y.len()]);
        let gamma = self.problem.gamma();
        let norms = Norms::of(self.equation(q).defect(x));
        let mut pace = self.pace;
        let mut turn = pace.turn(norms.l2);
        if turn == Turn::Keep && self.cycle == Cycle::F && !self.escalated {
            (self.escalated, pace) = (true, Pace::new());
            turn = pace.turn(norms.l2);
        }
        let kind = if self.escalated { Cycle::W } else { self.cycle };
        let sweeps = self.sweeps[usize::from(self.escalated)];
        self.taken += sweeps;
        let pairs = sweeps.div_ceil(2);
        let mut kept = std::mem::take(&mut self.kept);
        let mut equation = self.equation(q);
        let sweep = |equation: &mut Equation<'_, T>, x: &[T], y: &mut [T], clock: &mut Clock| {
            y.copy_from_slice(x);
            (0..pairs).for_each(|_| equation.smooth(y, clock));
        };
        if turn == Turn::Keep {
            kept.clear();
            kept.extend_from_slice(x);
        }
        match turn {
            Turn::Sweep => sweep(&mut equation, x, y, clock),
            Turn::Return => sweep(&mut equation, &kept, y, clock),
            Turn::Cycle | Turn::Keep => {
                y.copy_from_slice(x);
                equation.cycle(kind, y, clock);
            }
            Turn::Compare => {
                y.copy_from_slice(x);
                let [before, swept, cycled] = compare(&mut equation, kind, y, clock);
                pace.compared(cycled / before, (swept / before).powi(pairs as i32));
                if cycled.is_nan() || cycled > swept {
                    sweep(&mut equation, x, y, clock);
                }
            }
        }
        (self.pace, self.kept) = (pace, kept);
        norms.divided_by(gamma)
    }
}

/// A cycle with three pairs of sweeps before the correction; the defects before and after the
/// third, and in the end.
///
/// By the third pair what is rough is gone, so the first two numbers tell the pace of sweeps, and
/// the first and the last that of a cycle.
fn compare<T: Scalar>(
    equation: &mut Equation<'_, T>,
    kind: Cycle,
    x: &mut [T],
    clock: &mut Clock<'_>,
) -> [f64; 3] {
    equation.smooth(x, clock);
    equation.smooth(x, clock);
    let before = Norms::of(equation.defect(x)).l2;
    equation.smooth(x, clock);
    let swept = Norms::of(equation.defect(x)).l2;
    equation.correct(kind, x, clock);
    equation.smooth(x, clock);
    [before, swept, Norms::of(equation.defect(x)).l2]
}

/// The next coarser grid and the problem there, if there is one with positive diagonals.
fn coarser<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    problem: &Hlcp<T, A, B>,
    fine: [usize; 2],
    coarsen: &impl Coarsen<T>,
) -> Result<Option<Level<T>>, Error> {
    let axes = fine.map(Axis::new);
    let coarse = axes.each_ref().map(Axis::coarse);
    let (Some(a), Some(b)) = (problem.a().as_five_point(), problem.b().as_five_point()) else {
        return Ok(None);
    };
    if coarse == fine {
        return Ok(None);
    }
    let [a, b] = coarsen.coarsen([a, b], &Grids { fine, coarse, axes: &axes })?;
    let n = coarse[0] * coarse[1];
    let omega = match problem.omega() {
        Omega::Uniform(omega) => Omega::Uniform(*omega),
        Omega::Each(omega) => {
            let mut nearest = vec![T::zero(); n];
            transfer::inject(&axes, omega, |k, omega| nearest[k] = omega);
            Omega::Each(nearest)
        }
    };
    if a.order() != n {
        return Err(Error::Order { what: "A of a coarser grid", found: a.order(), expected: n });
    }
    let problem = Hlcp::new(a, b, omega)?;
    let what = "an operator of a coarser grid";
    let sound = Pair::new(&problem, coarse).ok_or(Error::NotFivePoint { what })?.positive().is_ok();
    let zeros = vec![T::zero(); n];
    Ok(sound.then(|| Level { axes, problem, x: zeros.clone(), f: zeros }))
}

#[cfg(test)]
mod tests;
