//! Cycles of the full approximation scheme.

use hlcp_core::{FivePoint, Hlcp, Norms, Omega, Rhs, Scalar, Smoother, Strip, Transfer, Varying};

use crate::Clock;

/// How often a cycle visits the coarser grids.
///
/// ```
/// use hlcp_methods::Cycle;
/// assert_eq!(Cycle::default(), Cycle::W);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Cycle {
    /// Each grid once: the cheapest, but its count grows with the grid (table in
    /// `docs/results/beyond.md`).
    V,
    /// From each grid the next coarser one by an F-cycle, then by a V-cycle; W-cycles once one of
    /// these has not halved the defect.
    F,
    /// From each grid the next coarser one twice.
    #[default]
    W,
}

impl Cycle {
    /// The cycles on the next coarser grid; the coarsest grid is visited once.
    fn visits(self, coarsest: bool) -> &'static [Self] {
        match self {
            _ if coarsest => &[Self::V],
            Self::V => &[Self::V],
            Self::F => &[Self::F, Self::V],
            Self::W => &[Self::W, Self::W],
        }
    }

    /// The rows that one cycle walks over, given the numbers of points: four sweeps, a defect and
    /// the coarse equation's own term on each grid, two sweeps and that term on the coarsest.
    pub(super) fn walks(self, points: &[usize]) -> usize {
        match points {
            [] => 0,
            [n] => 3 * n,
            [n, coarser @ ..] => {
                let visits = self.visits(coarser.len() == 1);
                6 * n + visits.iter().map(|visit| visit.walks(coarser)).sum::<usize>()
            }
        }
    }
}

/// The operators of a coarse grid.
pub(super) type Coarse<T> = FivePoint<Varying<T>>;

/// One coarse grid: the problem there, with `f` for `γq`.
///
/// Of a grid that ranks share, all is of this rank's columns, but of a small one the problem, `x`
/// and `f` are of the whole.
#[derive(Debug, Clone)]
pub(super) struct Level<T: Scalar> {
    /// From the next finer grid to this one.
    pub(super) transfer: Transfer<T>,
    /// This rank's part of a grid that every rank has the whole of.
    pub(super) gathered: Option<Strip>,
    /// With the scaling of its operators for Ω.
    pub(super) problem: Hlcp<T, Coarse<T>, Coarse<T>>,
    /// The next finer grid's Ω at the nearest points over this one's.
    pub(super) ratio: Omega<T>,
    pub(super) x: Vec<T>,
    pub(super) f: Vec<T>,
}

impl<T: Scalar> Level<T> {
    /// The whole grid's `[nx, ny]`.
    pub(super) fn grid(&self) -> [usize; 2] {
        self.transfer.strip().map_or(self.transfer.coarse(), Strip::whole)
    }
}

/// Moves this rank's part of a whole vector to its beginning.
fn keep_own<T: Scalar>(gathered: Option<&Strip>, own: usize, whole: &mut [T]) {
    if let Some(strip) = gathered {
        (0..own).for_each(|k| whole[k] = whole[strip.index(k)]);
    }
}

/// The same `(z, r)` for another Ω, which is the old one divided by `ratio`.
pub(super) fn rescaled<T: Scalar>(x: T, ratio: T) -> T {
    if x > T::zero() { x } else { x * ratio }
}

/// One grid's equation `K(x) + f = 0`, the coarser grids below it, and work space.
pub(super) struct Equation<'l, T: Scalar> {
    pub(super) smoother: Smoother<'l, T>,
    /// `f` as a factor and a vector.
    pub(super) f: (T, &'l [T]),
    /// The points of the grid, of which ranks may have a part each.
    pub(super) points: usize,
    pub(super) coarser: &'l mut [Level<T>],
    /// For the iterate between two sweeps, and on coarser grids.
    pub(super) between: &'l mut [T],
    pub(super) parallel: bool,
}

impl<T: Scalar> Equation<'_, T> {
    /// A forward and a backward sweep.
    pub(super) fn smooth(&mut self, x: &mut [T], clock: &mut Clock<'_>) {
        if clock.is_up_before(self.points) {
            return;
        }
        let between = &mut self.between[..x.len()];
        self.smoother.relax(false, self.f, x, between);
        self.smoother.relax(true, self.f, between, x);
    }

    /// A forward sweep from `x` and a backward one to `y`, and the norms at `x`, where `f` is the
    /// problem's own.
    pub(super) fn smooth_measured(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut [T]) -> Norms {
        let between = &mut self.between[..x.len()];
        let norms = self.smoother.relax_measured(false, q, x, between);
        self.smoother.relax(true, self.f, between, y);
        norms
    }

    /// One cycle.
    pub(super) fn cycle(&mut self, kind: Cycle, x: &mut [T], clock: &mut Clock<'_>) {
        self.smooth(x, clock);
        self.cycle_from_smooth(kind, x, clock);
    }

    /// One cycle without its first sweeps.
    pub(super) fn cycle_from_smooth(&mut self, kind: Cycle, x: &mut [T], clock: &mut Clock<'_>) {
        if !self.coarser.is_empty() {
            self.correct(kind, x, clock);
            self.smooth(x, clock);
        }
    }

    /// Adds the correction of the next coarser grid.
    ///
    /// There `K_H(x_H) = K_H(I x) − R F(x)` is solved, for `x_H` near the injected `I x`, and `x`
    /// receives the interpolated `x_H − I x`, unless it is not finite. Between the grids `x_H` has
    /// the scale of `x`.
    pub(super) fn correct(&mut self, kind: Cycle, x: &mut [T], clock: &mut Clock<'_>) {
        if clock.is_up_before(self.points) {
            return;
        }
        let Some((level, coarser)) = self.coarser.split_first_mut() else { return };
        let points = level.grid().iter().product();
        let Level { transfer, gathered, problem, ratio, x: coarse, f } = level;
        let (gathered, own) = (gathered.as_ref(), transfer.coarse().iter().product());
        self.smoother.restrict(self.f, x, transfer, &mut f[..own]);
        transfer.inject(x, |k, fine| coarse[k] = rescaled(fine, ratio.entry(k)));
        if let Some(strip) = gathered {
            strip.complete([f, coarse]);
        }
        let smoother = of_level(problem, self.parallel);
        smoother.subtract(coarse, f);
        let visits = kind.visits(coarser.is_empty());
        let (between, parallel) = (&mut *self.between, self.parallel);
        let mut below = Equation { smoother, f: (T::one(), f), points, coarser, between, parallel };
        for &visit in visits {
            below.cycle(visit, coarse, clock);
        }
        if clock.is_up_before(self.points) {
            return;
        }
        keep_own(gathered, own, coarse);
        let mut finite = true;
        transfer.inject(x, |k, fine| {
            let correction = rescaled(coarse[k], ratio.entry(k).recip()) - fine;
            finite &= correction.is_finite();
            coarse[k] = correction;
        });
        let lost = f64::from(!finite);
        if transfer.strip().map_or([lost], |strip| strip.largest([lost])) == [0.0] {
            transfer.interpolate(&coarse[..own], x, self.parallel);
        }
    }

    /// Overwrites `x` by nested iteration: from the coarsest grid's solution, one cycle on each
    /// finer grid.
    pub(super) fn nested(&mut self, kind: Cycle, x: &mut [T], clock: &mut Clock<'_>) {
        if clock.is_up_before(self.points) {
            return;
        }
        x.fill(T::zero());
        if let Some((level, coarser)) = self.coarser.split_first_mut() {
            let points = level.grid().iter().product();
            let Level { transfer, gathered, problem, ratio, x: coarse, f } = level;
            let (gathered, own) = (gathered.as_ref(), transfer.coarse().iter().product());
            // Of K(0) + f, which is f.
            self.smoother.restrict(self.f, x, transfer, &mut f[..own]);
            if let Some(strip) = gathered {
                strip.complete([f]);
            }
            let smoother = of_level(problem, self.parallel);
            let (between, parallel) = (&mut *self.between, self.parallel);
            Equation { smoother, f: (T::one(), f), points, coarser, between, parallel }
                .nested(kind, coarse, clock);
            if clock.is_up_before(self.points) {
                return;
            }
            keep_own(gathered, own, coarse);
            let coarse = &mut coarse[..own];
            for (k, coarse) in coarse.iter_mut().enumerate() {
                *coarse = rescaled(*coarse, ratio.entry(k).recip());
            }
            transfer.interpolate_smooth(coarse, x, parallel);
        }
        self.cycle(kind, x, clock);
    }
}

fn of_level<T: Scalar>(problem: &Hlcp<T, Coarse<T>, Coarse<T>>, parallel: bool) -> Smoother<'_, T> {
    Smoother::new(problem, None, parallel).expect("coarse operators are five-point ones")
}
