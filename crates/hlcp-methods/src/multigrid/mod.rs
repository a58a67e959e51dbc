//! Multigrid for the modulus equation: `docs/methods.md` has the derivation.

mod cycle;
mod full;
mod hierarchy;
mod pace;
mod scaling;

use hlcp_core::{
    Error, FivePoint, Hlcp, LinearOperator, Norms, Omega, Rhs, Scalar, Smoother, Strip, Transfer,
    assert_lengths,
};

pub(crate) use self::scaling::{Scaling, exact_sweep};
pub use self::{cycle::Cycle, full::FullMultigrid};
use self::{
    cycle::{Coarse, Equation, Level},
    hierarchy::{Grids, rediscretised},
    pace::{Pace, Turn},
};
use crate::{Clock, Method, Work, options::STRETCH};

/// Multigrid by the full approximation scheme, for a pair of five-point operators: the number of
/// iterations does not grow with the grid.
///
/// An iteration is a cycle on `F(x) = (A + BΩ)x + (A − BΩ)|x| + γq = 0`. It smooths by Gauss–Seidel
/// sweeps that solve each scalar equation exactly, one forward and one backward; solves the same
/// kind of equation on a grid of half as many points per side, `K_H(x_H) = K_H(I x) − R F(x)` with
/// `K(x) = F(x) − γq`; adds the interpolated `P(x_H − I x)`; and smooths again. `I` takes the
/// nearest point, `P` is bilinear, `R` is the transpose of `P` up to a factor. On each grid Ω is
/// `D_A D_B⁻¹` of the operators there, whatever the problem's own, since with it the accelerated
/// Gauss–Seidel sweep of [`Smoother`] is exact in each equation; between grids the negative part of
/// `x` is scaled to match. The coarse grid's equation is itself an HLCP's and is solved by cycles
/// in turn.
///
/// # Safeguard
///
/// Coarse grids cannot help where the signs of the solution change from point to point, and a cycle
/// may stall or diverge. The first iteration therefore measures what a cycle gains over sweeps for
/// the same work, and the better goes on: an iteration is a cycle, or as many sweeps as a cycle is
/// worth. Three cycles in a row that do not take a tenth off the defect, and more in a row after
/// each time, hand over to sweeps; sweeps that do not halve it put cycles on trial now and then,
/// and the iterate before a trial that has raised the defect is taken up again. F-cycles give way
/// to W-cycles as soon as one, at work or on trial, does not halve the defect: where coarse grids
/// do not fit into finer ones, as those of an even number of points, a single visit to them may not
/// do. A coarse correction that is not finite is never added.
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
/// Ranks that share the problem ([`Hlcp::shared_by`]) share its finer grids, and have the whole of
/// those of fewer than 2¹⁴ points.
///
/// # Convergence
///
/// No theorem covers the cycle on this equation. The sweeps alone converge from any start for a
/// pair of matrices with the `C` of `docs/theory.md` an M-matrix or with a left witness (*The
/// column theorem*), and for the LCP with a symmetric positive definite `A`, where they are
/// projected Gauss–Seidel. Measured:
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
/// use hlcp_methods::{Cycle, FivePoint, Hlcp, Identity, Limits, Multigrid, Omega, Options, Solver};
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
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Multigrid<T: Scalar, A, B> {
    problem: Hlcp<T, A, B>,
    cycle: Cycle,
    /// True if F-cycles have given way to W-cycles.
    escalated: bool,
    /// The sweeps that a cycle of the given kind is worth, and a W-cycle.
    sweeps: [usize; 2],
    levels: Vec<Level<T>>,
    /// The Ω of cycles, unless it is the problem's own.
    scaling: Scaling<T>,
    between: Vec<T>,
    /// The sweeps since the restart.
    taken: usize,
    pace: Pace,
    kept: Vec<T>,
}

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Multigrid<T, A, B> {
    /// Multigrid on `problem`, with its operators discretised again on coarser grids.
    ///
    /// The coarsest grid is the last that can be coarsened and on which both diagonals are
    /// positive.
    ///
    /// # Errors
    ///
    /// [`Error::NotFivePoint`] as by [`Hlcp::grid`]; [`Error::NotPositive`] for the problem's first
    /// diagonal entry that is not positive, which a sweep divides by; [`Error::NotFinite`] for a
    /// coarse coefficient that is not finite.
    pub fn new(problem: Hlcp<T, A, B>, cycle: Cycle) -> Result<Self, Error> {
        let scaling = Smoother::scaling(&problem)?;
        let levels = levels(&problem, &scaling)?;
        // Some of the ranks that share the problem may have more points of a coarser grid, whole.
        let most = levels.iter().map(|level| level.x.len()).chain([problem.order()]);
        let between = vec![T::zero(); most.max().unwrap_or(0)];
        let scaling = Scaling::new(&problem, scaling);
        let (sweeps, pace, kept) = ([0; 2], Pace::new(), vec![]);
        let (escalated, taken) = (false, 0);
        let mut multigrid =
            Self { problem, cycle, escalated, sweeps, levels, scaling, between, taken, pace, kept };
        let sizes: Vec<usize> = multigrid.grids().map(|grid| grid.iter().product()).collect();
        multigrid.sweeps = [cycle, Cycle::W].map(|kind| kind.walks(&sizes).div_ceil(sizes[0]));
        Ok(multigrid)
    }

    /// The `[nx, ny]` of the grids, from the problem's own to the coarsest; of the whole grids,
    /// where ranks share the problem.
    ///
    /// ```
    /// use hlcp_methods::{Cycle, FivePoint, Hlcp, Identity, Multigrid, Omega};
    ///
    /// let a = FivePoint::new(10, 7, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 70 }, Omega::Uniform(4.0))?;
    /// let multigrid = Multigrid::new(problem, Cycle::W)?;
    /// assert_eq!(multigrid.grids().collect::<Vec<_>>(), [[10, 7], [4, 3], [1, 1]]);
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn grids(&self) -> impl Iterator<Item = [usize; 2]> {
        let own = || self.problem.grid().expect("a grid, as before");
        let finest = self.problem.strip().map_or_else(own, Strip::whole);
        [finest].into_iter().chain(self.levels.iter().map(Level::grid))
    }

    /// Returns whether iterations are cycles, since they gain more than sweeps do; `None` before
    /// the first iteration.
    pub fn coarse_grids_help(&self) -> Option<bool> {
        self.pace.cycles()
    }

    /// Overwrites `x` with a start by nested iteration.
    fn nested(&mut self, q: &Rhs<'_, T>, x: &mut [T], clock: &mut Clock<'_>) {
        assert_lengths(self.problem.order(), [("q", q.entries().len()), ("x", x.len())]);
        // A cycle, four sweeps, and a cycle on grids that halve.
        self.taken += 2 * self.sweeps[0] + 4;
        let cycle = self.cycle;
        let mut equation = self.equation(q);
        equation.nested(cycle, x, clock);
        (0..2).for_each(|_| equation.smooth(x, clock));
        equation.cycle(cycle, x, clock);
        self.scaling.rescale(&self.problem, x, true);
    }

    /// The norms of `A z − B r + q` at `x`.
    fn norms(&self, q: &Rhs<'_, T>, x: &[T]) -> Norms {
        let smoother = Smoother::new(&self.problem, None, self.problem.is_parallel());
        smoother.expect("five-point operators, as before").norms(q, x)
    }

    fn equation<'e>(&'e mut self, q: &Rhs<'e, T>) -> Equation<'e, T> {
        let points = self.grids().next().map_or(0, |grid| grid.iter().product());
        let Self { problem, scaling, levels, between, .. } = self;
        let parallel = problem.is_parallel();
        Equation {
            smoother: scaling.smoother(problem),
            f: (problem.q_factor(), q.entries()),
            points,
            coarser: levels,
            between,
            parallel,
        }
    }
}

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Method<T> for Multigrid<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn work(&self) -> Option<Work> {
        Some(Work::sweeps(self.taken))
    }

    fn restart(&mut self) {
        (self.pace, self.escalated) = (Pace::new(), false);
        self.taken = 0;
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn works_on_ranks(&self) -> bool {
        true
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        let n = self.problem.order();
        assert_lengths(n, [("q", q.entries().len()), ("x", x.len()), ("y", y.len())]);
        // Every kind of iteration begins with a pair of sweeps.
        let norms = if self.scaling.is_own() {
            self.equation(q).smooth_measured(q, x, y)
        } else {
            let norms = self.norms(q, x);
            y.copy_from_slice(x);
            self.scaling.rescale(&self.problem, y, false);
            self.equation(q).smooth(y, clock);
            norms
        };
        let mut pace = self.pace;
        if self.cycle == Cycle::F && !self.escalated && pace.is_slow(norms.l2) {
            self.escalated = true;
            pace.forget();
        }
        let turn = pace.turn(norms.l2);
        let kind = if self.escalated { Cycle::W } else { self.cycle };
        let sweeps = self.sweeps[usize::from(self.escalated)];
        self.taken += sweeps;
        let pairs = sweeps.div_ceil(2);
        if turn == Turn::Keep {
            self.kept.clear();
            self.kept.extend_from_slice(x);
        }
        if turn == Turn::Return {
            y.copy_from_slice(&self.kept);
            self.scaling.rescale(&self.problem, y, false);
        }
        let mut equation = self.equation(q);
        match turn {
            Turn::Sweep => (1..pairs).for_each(|_| equation.smooth(y, clock)),
            Turn::Return => (0..pairs).for_each(|_| equation.smooth(y, clock)),
            Turn::Cycle | Turn::Keep => equation.cycle_from_smooth(kind, y, clock),
            Turn::Compare => {
                let [before, swept, cycled] = compare(&mut equation, kind, q, y, clock);
                pace.compared(cycled / before, (swept / before).powi(pairs as i32));
                if (cycled.is_nan() || cycled > swept) && !clock.is_up() {
                    y.copy_from_slice(x);
                    self.scaling.rescale(&self.problem, y, false);
                    let mut equation = self.equation(q);
                    (0..pairs).for_each(|_| equation.smooth(y, clock));
                }
            }
        }
        self.scaling.rescale(&self.problem, y, true);
        self.pace = pace;
        norms
    }
}

/// A cycle with three pairs of sweeps before the correction; the defects before and after the
/// third, and in the end, NaN when the clock is up.
///
/// By the third pair what is rough is gone, so the first two numbers tell the pace of sweeps, and
/// the first and the last that of a cycle.
fn compare<T: Scalar>(
    equation: &mut Equation<'_, T>,
    kind: Cycle,
    q: &Rhs<'_, T>,
    x: &mut [T],
    clock: &mut Clock<'_>,
) -> [f64; 3] {
    let smoother = equation.smoother;
    let norm = |x: &[T], clock: &mut Clock<'_>| {
        if clock.is_up() { f64::NAN } else { smoother.norms(q, x).l2 }
    };
    equation.smooth(x, clock);
    let before = norm(x, clock);
    equation.smooth(x, clock);
    let swept = norm(x, clock);
    equation.correct(kind, x, clock);
    equation.smooth(x, clock);
    [before, swept, norm(x, clock)]
}

/// The coarser grids, from the next one to the coarsest; `scaling` is that of the problem's own.
fn levels<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    problem: &Hlcp<T, A, B>,
    scaling: &Omega<T>,
) -> Result<Vec<Level<T>>, Error> {
    let mut levels = vec![];
    let mut next = coarser(problem, scaling)?;
    while let Some(level) = next {
        next = coarser(&level.problem, level.problem.omega())?;
        levels.push(level);
    }
    Ok(levels)
}

/// Where ranks share a problem, each has the whole of coarser grids of fewer columns for a rank,
/// and of those of few points: they cost less than messages.
const NARROW: usize = 6;

/// The next coarser grid and the problem there, if there is one with positive diagonals; `scaling`
/// is that of the fine grid.
fn coarser<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    problem: &Hlcp<T, A, B>,
    scaling: &Omega<T>,
) -> Result<Option<Level<T>>, Error> {
    let (fine, round, strip) = (problem.grid()?, problem.round(), problem.strip());
    let transfer = strip.map_or_else(|| Transfer::new(fine, round), Transfer::shared_by);
    let coarse = transfer.coarse();
    let (Some(a), Some(b)) = (problem.a().as_five_point(), problem.b().as_five_point()) else {
        return Ok(None);
    };
    if transfer.ratio() == [T::one(); 2] {
        return Ok(None);
    }
    let grids = Grids { fine, round, transfer: &transfer, strip };
    // Both first, since ranks do them together.
    let [a, b] = [rediscretised(a, &grids), rediscretised(b, &grids)];
    let made = a.and_then(|a| Ok(Some([a, b?])));
    // A rank without a coarse column has none to look at.
    let made = problem.agree(if coarse[0] > 0 { made } else { Ok(None) })?;
    let is_small = |strip: &&Strip| {
        let few = if cfg!(test) { 1 } else { STRETCH };
        strip.whole().iter().product::<usize>() < few || strip.narrowest() < NARROW
    };
    let gathered = transfer.strip().filter(is_small);
    let [a, b] = match (made, gathered) {
        (made, Some(strip)) => {
            let parts = made.as_ref().map_or([None; 2], |made| made.each_ref().map(Some));
            let [a, b] = parts.map(|part| whole(strip, part));
            [a?, b?]
        }
        (Some(made), None) => made,
        (None, None) => return Ok(None),
    };
    let shared = transfer.strip().filter(|_| gathered.is_none());
    let Ok(own) = Smoother::scaling(&posed(&a, &b, Omega::Uniform(T::one()), shared)?) else {
        return Ok(None);
    };
    let ratio = match (scaling, &own) {
        (Omega::Uniform(fine), Omega::Uniform(own)) => Omega::Uniform(*fine / *own),
        _ => {
            let [columns, rows] = transfer.nearest();
            let nearest = rows.iter().flat_map(|j| columns.iter().map(move |i| j * fine[0] + i));
            let place = |i: usize| gathered.map_or(i, |strip| strip.index(i));
            let ratios = nearest.zip(0..).map(|(k, i)| scaling.entry(k) / own.entry(place(i)));
            Omega::Each(ratios.collect())
        }
    };
    let (x, f) = (vec![T::zero(); a.order()], vec![T::zero(); a.order()]);
    let problem = posed(a, b, own, shared)?;
    let gathered = gathered.cloned();
    Ok(Some(Level { transfer, gathered, problem, ratio, x, f }))
}

/// A problem, shared by ranks if there is a strip.
fn posed<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    a: A,
    b: B,
    omega: Omega<T>,
    strip: Option<&Strip>,
) -> Result<Hlcp<T, A, B>, Error> {
    let problem = Hlcp::new(a, b, omega);
    match strip {
        Some(strip) => strip.agree(problem)?.shared_by(strip),
        None => problem,
    }
}

/// The whole of an operator of which this rank may have a part.
fn whole<T: Scalar>(strip: &Strip, part: Option<&Coarse<T>>) -> Result<Coarse<T>, Error> {
    let [nx, ny] = strip.whole();
    let mut lists = [(); 5].map(|()| vec![T::zero(); nx * ny]);
    if let Some(view) = part.and_then(LinearOperator::as_five_point) {
        for (list, values) in lists.iter_mut().zip(view.coefficients()) {
            let own = list[..strip.grid().iter().product()].iter_mut();
            own.enumerate().for_each(|(k, value)| *value = values.entry(k));
        }
    }
    strip.complete(lists.each_mut().map(Vec::as_mut_slice));
    FivePoint::from_fn(nx, ny, |i, j| lists.each_ref().map(|list| list[j * nx + i]))
}

#[cfg(test)]
mod tests;
