//! The levels of a matrix, and the cycle over them.

use hlcp_core::Scalar;

use super::{
    coarsen::coarsen,
    matrix::{Lu, Matrix, NONE},
};
use crate::krylov::{add, dot, to_scalar};

/// The order from which on a matrix is factorised.
const SMALL: usize = 100;

/// The most levels.
const LEVELS: usize = 40;

/// Symmetric Gauss–Seidel passes that find a near-kernel vector, and what bounds its entries.
const PASSES: usize = 6;
const SPREAD: f64 = 1e3;

/// A coarse step that leaves this part of the residual is enough.
const GAIN: f64 = 0.25;

/// How a coarse level's equation is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cycle {
    /// By two steps of stationary iteration: a linear map.
    W,
    /// By one or two steps of generalised conjugate residuals: not a linear map.
    K,
}

/// A matrix, and how its unknowns are joined on the next level.
#[derive(Debug, Clone)]
struct Level<T> {
    matrix: Matrix<T>,
    /// The factors of the columns, that is of the unknowns on their way to the finer level.
    weight: Vec<T>,
    aggregate: Vec<u32>,
    work: Work<T>,
}

/// What the equation of a coarse level is solved in.
#[derive(Debug, Clone)]
struct Work<T> {
    rhs: Vec<T>,
    /// The solution.
    x: Vec<T>,
    /// Its image, and a second step's pair.
    image: Vec<T>,
    y: Vec<T>,
    product: Vec<T>,
}

impl<T: Scalar> Work<T> {
    fn new(n: usize) -> Self {
        let [rhs, x, image, y, product] = std::array::from_fn(|_| vec![T::zero(); n]);
        Self { rhs, x, image, y, product }
    }
}

/// The levels of a matrix.
#[derive(Debug, Clone)]
pub(super) struct Hierarchy<T> {
    levels: Vec<Level<T>>,
    bottom: Option<Lu<T>>,
    /// Entries that were walked over.
    pub(super) walked: usize,
}

impl<T: Scalar> Hierarchy<T> {
    /// The levels below `matrix`, whose columns are scaled; unknowns of which `apart` is true stay on the first.
    pub(super) fn new(matrix: Matrix<T>, apart: impl Fn(usize) -> bool) -> Self {
        let mut walked = 0;
        let n = matrix.order();
        let mut levels = vec![Level { matrix, weight: vec![], aggregate: vec![], work: Work::new(0) }];
        let mut bottom = None;
        let mut order = n;
        while levels.len() < LEVELS {
            let fine = levels.last_mut().expect("at least one level");
            if order <= SMALL {
                bottom = (levels.len() > 1 || order == n).then(|| Lu::new(&levels[levels.len() - 1].matrix));
                break;
            }
            walked += 4 * fine.matrix.entries();
            let first = levels.len() == 1;
            let fine = levels.last_mut().expect("at least one level");
            let (aggregate, mut coarse) = coarsen(&fine.matrix, |i| first && apart(i));
            let next = coarse.order();
            if next * 10 > order * 9 {
                break;
            }
            let weight = near_kernel(&coarse, None);
            coarse.scale_columns(&weight);
            walked += 2 * PASSES * coarse.entries();
            fine.aggregate = aggregate;
            order = next;
            levels.push(Level { matrix: coarse, weight, aggregate: vec![], work: Work::new(next) });
        }
        Self { levels, bottom, walked }
    }

    pub(super) fn matrix(&self) -> &Matrix<T> {
        &self.levels[0].matrix
    }

    /// The entries of all levels over those of the first.
    pub(super) fn complexity(&self) -> f64 {
        let entries: usize = self.levels.iter().map(|level| level.matrix.entries()).sum();
        entries as f64 / self.matrix().entries() as f64
    }

    pub(super) fn orders(&self) -> impl Iterator<Item = usize> {
        self.levels.iter().map(|level| level.matrix.order())
    }

    /// Overwrites `y` with a cycle for `rhs`, and `product` with the matrix times `y`.
    pub(super) fn cycle(&mut self, cycle: Cycle, rhs: &[T], y: &mut [T], product: &mut [T]) {
        let Some((level, coarser)) = self.levels.split_first_mut() else { return };
        level.cycle(coarser, self.bottom.as_ref(), cycle, rhs, y, product, &mut self.walked);
    }
}

impl<T: Scalar> Level<T> {
    /// A forward sweep, the coarser levels, a forward sweep.
    #[expect(clippy::too_many_arguments, reason = "the parts of a hierarchy, borrowed one by one")]
    fn cycle(
        &mut self,
        coarser: &mut [Self],
        bottom: Option<&Lu<T>>,
        cycle: Cycle,
        rhs: &[T],
        y: &mut [T],
        product: &mut [T],
        walked: &mut usize,
    ) {
        let matrix = &self.matrix;
        *walked += 5 * matrix.entries() / 2;
        let Some((next, coarser)) = coarser.split_first_mut() else {
            match bottom {
                Some(lu) => {
                    lu.solve(rhs, y);
                    matrix.product(y, product);
                }
                None => {
                    matrix.sweep_from_zero(rhs, y, product);
                    (0..4).for_each(|_| matrix.sweep(rhs, y, product));
                }
            }
            return;
        };
        matrix.sweep_from_zero(rhs, y, product);
        let mut work = std::mem::replace(&mut next.work, Work { rhs: vec![], x: vec![], image: vec![], y: vec![], product: vec![] });
        work.rhs.fill(T::zero());
        matrix.residual_above(y, product, |i, residual| {
            if let Some(rhs) = work.rhs.get_mut(self.aggregate[i] as usize) {
                *rhs += residual;
            }
        });
        next.solve(coarser, bottom, cycle, &mut work, walked);
        for (x, &weight) in work.x.iter_mut().zip(&next.weight) {
            *x *= weight;
        }
        for (y, &a) in y.iter_mut().zip(&self.aggregate) {
            if a != NONE {
                *y += work.x[a as usize];
            }
        }
        next.work = work;
        matrix.sweep(rhs, y, product);
    }

    /// Solves this level's equation to some extent; `work.rhs` is overwritten.
    fn solve(
        &mut self,
        coarser: &mut [Self],
        bottom: Option<&Lu<T>>,
        kind: Cycle,
        work: &mut Work<T>,
        walked: &mut usize,
    ) {
        let Work { rhs, x, image, y, product } = work;
        self.cycle(coarser, bottom, kind, rhs, x, image, walked);
        if coarser.is_empty() && bottom.is_some() {
            return;
        }
        if kind == Cycle::W {
            rhs.iter_mut().zip(&*image).for_each(|(r, &q)| *r -= q);
            self.cycle(coarser, bottom, kind, rhs, y, product, walked);
            add(x, 1.0, y);
            return;
        }
        // Two steps of GCR: the residual is made as small as one and two directions allow.
        let (before, qq) = (dot(rhs, rhs), dot(image, image));
        let length = dot(rhs, image) / qq;
        if !length.is_normal() {
            if !(before == 0.0) {
                x.fill(T::zero());
            }
            return;
        }
        add(rhs, -length, image);
        if dot(rhs, rhs) <= GAIN * GAIN * before {
            x.iter_mut().for_each(|x| *x *= to_scalar(length));
            return;
        }
        self.cycle(coarser, bottom, kind, rhs, y, product, walked);
        let share = dot(product, image) / qq;
        add(product, -share, image);
        let second = dot(rhs, product) / dot(product, product);
        let second = if second.is_finite() && share.is_finite() { second } else { 0.0 };
        let first: T = to_scalar(length - second * share);
        let second: T = to_scalar(second);
        for (x, &y) in x.iter_mut().zip(&*y) {
            *x = first * *x + second * y;
        }
    }
}

/// Relaxes `matrix v = 0` from `v = e` or what is given: what is left varies as slowly as a matrix allows.
pub(super) fn near_kernel<T: Scalar>(matrix: &Matrix<T>, start: Option<Vec<T>>) -> Vec<T> {
    let n = matrix.order();
    let mut v = start.unwrap_or_else(|| vec![T::one(); n]);
    for _ in 0..PASSES {
        (0..n).for_each(|i| matrix.relax_homogeneous(i, &mut v));
        (0..n).rev().for_each(|i| matrix.relax_homogeneous(i, &mut v));
    }
    bounded(&mut v);
    v
}

/// Brings the entries between `1/SPREAD` and `SPREAD` of their mean.
pub(super) fn bounded<T: Scalar>(v: &mut [T]) {
    let sum = v.iter().fold(T::zero(), |sum, v| sum + v.abs());
    let mean = sum / to_scalar(v.len() as f64);
    let spread = to_scalar::<T>(SPREAD);
    for v in v {
        let relative = v.abs() / mean;
        // Also of NaN, which neither comparison holds for.
        *v = if relative >= spread {
            spread
        } else if relative > spread.recip() {
            relative
        } else {
            spread.recip()
        };
    }
}
