//! Cycles of the full approximation scheme.

use hlcp_core::{Hlcp, Scalar, VaryingFivePoint};

use super::{
    smoother::{Pair, ROWS, Source},
    transfer::{self, Axis},
};
use crate::Clock;

/// Points of a grid whose sweep takes long enough to look at the clock before.
const LONG: usize = 4096;

/// How often a cycle visits the coarser grids.
///
/// ```
/// use hlcp_methods::Cycle;
/// assert_eq!(Cycle::default(), Cycle::W);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cycle {
    /// Each grid once: the cheapest, but its count grows with the grid (table in
    /// `docs/results/beyond.md`).
    V,
    /// From each grid the next coarser one by an F-cycle, then by a V-cycle; W-cycles once
    /// these stall and sweeps are slow.
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
pub(super) type Coarse<T> = VaryingFivePoint<'static, T>;

/// One coarse grid: the problem there, with `f` for `γq`.
#[derive(Debug, Clone)]
pub(super) struct Level<T: Scalar> {
    /// From the next finer grid to this one.
    pub(super) axes: [Axis<T>; 2],
    pub(super) problem: Hlcp<T, Coarse<T>, Coarse<T>>,
    pub(super) x: Vec<T>,
    pub(super) f: Vec<T>,
}

impl<T: Scalar> Level<T> {
    /// The grid's `[nx, ny]`.
    pub(super) fn grid(&self) -> [usize; 2] {
        self.axes.each_ref().map(Axis::coarse)
    }
}

/// The vectors that all grids share.
#[derive(Debug, Clone)]
pub(super) struct Work<T> {
    /// A defect.
    pub(super) defect: Vec<T>,
    /// As many rows of the grid as a sweep relaxes side by side.
    rows: Vec<T>,
    /// A row of zeros, for what lies beyond the grid.
    zeros: Vec<T>,
}

impl<T: Scalar> Work<T> {
    pub(super) fn new([nx, ny]: [usize; 2]) -> Self {
        let zeros = |n| vec![T::zero(); n];
        Self { defect: zeros(nx * ny), rows: zeros(ROWS * nx), zeros: zeros(nx) }
    }
}

/// One grid's equation `K(x) + f = 0`, the coarser grids below it, and work space.
pub(super) struct Equation<'l, T: Scalar> {
    pub(super) pair: Pair<'l, T>,
    pub(super) f: Source<'l, T>,
    pub(super) coarser: &'l mut [Level<T>],
    pub(super) work: &'l mut Work<T>,
}

impl<T: Scalar> Equation<'_, T> {
    /// A forward and a backward sweep.
    pub(super) fn smooth(&mut self, x: &mut [T], clock: &mut Clock<'_>) {
        if x.len() >= LONG && clock.is_up() {
            return;
        }
        self.pair.relax(false, self.f, x, &mut self.work.rows, &self.work.zeros);
        self.pair.relax(true, self.f, x, &mut self.work.rows, &self.work.zeros);
    }

    /// The defect `K(x) + f`.
    pub(super) fn defect(&mut self, x: &[T]) -> &[T] {
        let defect = &mut self.work.defect[..x.len()];
        self.pair.defect(self.f, x, defect, &self.work.zeros);
        defect
    }

    /// One cycle.
    pub(super) fn cycle(&mut self, kind: Cycle, x: &mut [T], clock: &mut Clock<'_>) {
        self.smooth(x, clock);
        if !self.coarser.is_empty() {
            self.correct(kind, x, clock);
            self.smooth(x, clock);
        }
    }

    /// Adds the correction of the next coarser grid.
    ///
    /// There `K_H(x_H) = K_H(I x) − R F(x)` is solved, for `x_H` near the injected `I x`, and `x`
    /// receives the interpolated `x_H − I x`, unless it is not finite.
    pub(super) fn correct(&mut self, kind: Cycle, x: &mut [T], clock: &mut Clock<'_>) {
        self.defect(x);
        let Some((level, coarser)) = self.coarser.split_first_mut() else { return };
        let (grid, work) = (level.grid(), &mut *self.work);
        let Level { axes, problem, x: coarse, f } = level;
        let pair = Pair::new(problem, grid).expect("coarse operators are five-point ones");
        transfer::restrict(axes, &work.defect[..x.len()], f, &mut work.rows);
        transfer::inject(axes, x, |k, fine| coarse[k] = fine);
        let restricted = Source { factor: -T::one(), entries: f };
        pair.defect(restricted, coarse, &mut work.defect[..coarse.len()], &work.zeros);
        for (f, &d) in f.iter_mut().zip(&work.defect) {
            *f = -d;
        }
        let source = Source { factor: T::one(), entries: f };
        let visits = kind.visits(coarser.is_empty());
        let mut below = Equation { pair, f: source, coarser, work };
        for &visit in visits {
            below.cycle(visit, coarse, clock);
        }
        transfer::inject(axes, x, |k, fine| coarse[k] -= fine);
        if coarse.iter().all(|correction| correction.is_finite()) {
            transfer::interpolate(axes, coarse, x, &mut self.work.rows);
        }
    }

    /// Overwrites `x` by nested iteration: from the coarsest grid's solution, one cycle on each
    /// finer grid.
    pub(super) fn nested(&mut self, kind: Cycle, x: &mut [T], clock: &mut Clock<'_>) {
        x.fill(T::zero());
        if let Some((level, coarser)) = self.coarser.split_first_mut() {
            let (grid, work) = (level.grid(), &mut *self.work);
            let Level { axes, problem, x: coarse, f } = level;
            let pair = Pair::new(problem, grid).expect("coarse operators are five-point ones");
            for (d, &q) in work.defect.iter_mut().zip(self.f.entries) {
                *d = self.f.factor * q;
            }
            transfer::restrict(axes, &work.defect[..x.len()], f, &mut work.rows);
            let source = Source { factor: T::one(), entries: f };
            Equation { pair, f: source, coarser, work }.nested(kind, coarse, clock);
            transfer::interpolate_smooth(axes, coarse, x, &mut self.work.rows);
        }
        self.cycle(kind, x, clock);
    }
}
