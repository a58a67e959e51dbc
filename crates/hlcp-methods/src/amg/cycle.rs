//! The levels of a matrix, and the cycle over them.

use hlcp_core::{LinearOperator, Scalar};

use super::{
    coarsen::coarsen,
    matrix::{Lu, Matrix, NONE},
};
use crate::{
    Clock,
    krylov::{add, dot},
};

/// The order up to which a matrix is factorised, and half of that up to which a problem is solved
/// from 0.
pub(super) const SMALL: usize = 100;

/// Bounds the entries of a near-kernel vector.
pub(super) const SPREAD: f64 = 1e3;

/// A coarse step that leaves this part of the residual is enough.
const GAIN: f64 = 0.25;

/// How a coarse level's equation is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cycle {
    /// By two steps of stationary iteration: the cycle is a linear map.
    W,
    /// By one or two steps of generalised conjugate residuals, whose lengths depend on what they
    /// are taken for: it is not a linear map.
    K,
}

/// A matrix, and how its unknowns are joined on the next level.
#[derive(Debug, Clone)]
struct Level<T> {
    matrix: Matrix<T>,
    /// The factors of the columns, that is of the unknowns on their way to the finer level.
    weight: Vec<T>,
    /// Where each unknown goes; nothing on the last level.
    aggregate: Vec<u32>,
    /// Whether each visit to the finer level visits it twice.
    twice: bool,
    work: Work<T>,
}

impl<T: Scalar> Level<T> {
    fn new(matrix: Matrix<T>, weight: Vec<T>, twice: bool) -> Self {
        let work = Work::new(weight.len());
        Self { matrix, weight, aggregate: vec![], twice, work }
    }
}

/// The equation of a coarse level: two pairs of a vector and its product with the matrix, the first
/// of which becomes the solution.
#[derive(Debug, Clone)]
struct Work<T> {
    rhs: Vec<T>,
    x: [Vec<T>; 2],
    product: [Vec<T>; 2],
}

impl<T: Scalar> Work<T> {
    fn new(n: usize) -> Self {
        let zeros = || vec![T::zero(); n];
        Self { rhs: zeros(), x: [zeros(), zeros()], product: [zeros(), zeros()] }
    }
}

/// The levels of a matrix.
#[derive(Debug, Clone)]
pub(super) struct Hierarchy<T> {
    levels: Vec<Level<T>>,
    bottom: Option<Lu<T>>,
    /// Entries that set-up and cycles have walked over.
    walked: usize,
}

impl<T: Scalar> Hierarchy<T> {
    /// The levels below `matrix`, whose columns are scaled; unknowns of which `apart` is true stay
    /// on the first. None when the clock is up.
    pub(super) fn new(matrix: Matrix<T>, apart: &[bool], clock: &mut Clock<'_>) -> Option<Self> {
        let entries = matrix.entries();
        let (mut levels, mut walked) = (vec![Level::new(matrix, vec![], false)], 0);
        let (mut bottom, mut visits) = (None, 1);
        loop {
            if clock.is_up() {
                return None;
            }
            let first = levels.len() == 1;
            let fine = levels.last_mut().expect("there is one from the start");
            let order = fine.matrix.order();
            if order <= SMALL {
                bottom = Some(Lu::of(&fine.matrix));
                break;
            }
            let (aggregate, mut coarse) = coarsen(&fine.matrix, |i| first && apart[i], clock)?;
            // Two transposes, and two sums of which the second is half as long; then conduction.
            walked += 4 * fine.matrix.entries() + coarse.entries();
            // Every level is shorter by a tenth at least, so the loop ends.
            if 10 * coarse.order() > 9 * order {
                break;
            }
            let weight = near_kernel(&coarse, clock);
            coarse.scale_columns(&weight);
            walked += 2 * coarse.entries();
            fine.aggregate = aggregate;
            // Levels with hardly fewer entries, as of points that hang together by chance, would be
            // visited 2, 4, 8, … times.
            let twice = visits * coarse.entries() <= entries;
            visits *= 1 + usize::from(twice);
            levels.push(Level::new(coarse, weight, twice));
        }
        Some(Self { levels, bottom, walked })
    }

    /// The entries of all levels over those of the first.
    pub(super) fn complexity(&self) -> f64 {
        let entries: usize = self.levels.iter().map(|level| level.matrix.entries()).sum();
        entries as f64 / self.entries() as f64
    }

    /// The orders of all levels.
    #[cfg(test)]
    pub(super) fn orders(&self) -> impl Iterator<Item = usize> {
        self.levels.iter().map(|level| level.matrix.order())
    }

    /// The entries of the first level.
    pub(super) fn entries(&self) -> usize {
        self.levels[0].matrix.entries()
    }

    /// Returns the work of set-up and cycles, in walks over the first level.
    pub(super) fn walks(&self) -> f64 {
        self.walked as f64 / self.entries().max(1) as f64
    }

    /// Overwrites `y` with a cycle for `rhs`, and `product` with the matrix times `y`;
    /// both with anything when the clock is up.
    pub(super) fn cycle(
        &mut self,
        cycle: Cycle,
        rhs: &[T],
        y: &mut [T],
        product: &mut [T],
        clock: &mut Clock<'_>,
    ) {
        let Self { levels, bottom, walked } = self;
        let mut descent = Descent { cycle, bottom: bottom.as_ref(), walked, clock };
        descent.visit(levels, rhs, y, product);
    }
}

/// One visit to all levels.
struct Descent<'h, 'c, T> {
    cycle: Cycle,
    bottom: Option<&'h Lu<T>>,
    walked: &'h mut usize,
    clock: &'h mut Clock<'c>,
}

impl<T: Scalar> Descent<'_, '_, T> {
    /// A forward sweep, the coarser levels, a forward sweep, on the first of `levels`.
    fn visit(&mut self, levels: &mut [Level<T>], rhs: &[T], y: &mut [T], product: &mut [T]) {
        let Some((Level { matrix, aggregate, .. }, coarser)) = levels.split_first_mut() else {
            return;
        };
        if self.clock.is_up_before(rhs.len()) {
            return;
        }
        // Half a walk, half of one for the residual, one, and half of one for the product.
        *self.walked += 5 * matrix.entries() / 2;
        if coarser.is_empty() {
            if let Some(lu) = self.bottom {
                lu.solve(rhs, y);
                matrix.apply(y, product);
            } else {
                matrix.sweep_from_zero(rhs, y, |_, _| ());
                matrix.sweep(rhs, y, product, |_| T::zero());
            }
            return;
        }
        let mut work = std::mem::replace(&mut coarser[0].work, Work::new(0));
        work.rhs.fill(T::zero());
        matrix.sweep_from_zero(rhs, y, |i, residual| {
            if aggregate[i] != NONE {
                work.rhs[aggregate[i] as usize] += residual;
            }
        });
        self.solve(coarser, &mut work);
        if !self.clock.is_up_before(rhs.len()) {
            let (x, weight) = (&work.x[0], &coarser[0].weight);
            matrix.sweep(rhs, y, product, |j| match aggregate[j] {
                NONE => T::zero(),
                a => weight[a as usize] * x[a as usize],
            });
        }
        coarser[0].work = work;
    }

    /// Overwrites the first `x` with an approximate solution on the first of `levels`.
    fn solve(&mut self, levels: &mut [Level<T>], work: &mut Work<T>) {
        let Work { rhs, x: [x, y], product: [image, product] } = work;
        self.visit(levels, rhs, x, image);
        let (is_exact, twice) = (levels.len() == 1 && self.bottom.is_some(), levels[0].twice);
        if is_exact || self.cycle == Cycle::W && !twice {
            return;
        }
        if self.cycle == Cycle::W {
            rhs.iter_mut().zip(&*image).for_each(|(rhs, &image)| *rhs -= image);
            self.visit(levels, rhs, y, product);
            add(x, 1.0, y);
            return;
        }
        // The residual is made as small as one direction allows, or two; squares are summed in
        // double precision.
        let (before, square) = (dot(rhs, rhs), dot(image, image));
        let first = dot(rhs, image) / square;
        if !first.is_finite() {
            x.fill(T::zero());
            return;
        }
        add(rhs, -first, image);
        if !twice || dot(rhs, rhs) <= GAIN * GAIN * before {
            x.iter_mut().for_each(|x| *x *= T::of(first));
            return;
        }
        self.visit(levels, rhs, y, product);
        let share = dot(product, image) / square;
        add(product, -share, image);
        let second = dot(rhs, product) / dot(product, product);
        // A second direction that adds nothing to the first is left out.
        let second = if (second * share).is_finite() { second } else { 0.0 };
        let [first, second] = [first - second * share, second].map(T::of);
        for (x, &y) in x.iter_mut().zip(&*y) {
            *x = first * *x + second * y;
        }
    }
}

/// Relaxes `matrix v = 0` from `v = e` once there and back: what is left is what sweeps reduce
/// least, as far as it varies slowly. Its moduli are divided by their mean and brought between
/// `1/SPREAD` and `SPREAD`.
pub(super) fn near_kernel<T: Scalar>(matrix: &Matrix<T>, clock: &mut Clock<'_>) -> Vec<T> {
    let mut v = vec![T::one(); matrix.order()];
    for (k, i) in (0..v.len()).chain((0..v.len()).rev()).enumerate() {
        if clock.is_up_at(k) {
            break;
        }
        matrix.relax_homogeneous(i, &mut v);
    }
    let mean = v.iter().fold(T::zero(), |sum, v| sum + v.abs()) / T::of(v.len() as f64);
    let spread = T::of(SPREAD);
    // `max` passes over NaN.
    v.iter_mut().for_each(|v| *v = (v.abs() / mean).max(spread.recip()).min(spread));
    v
}
