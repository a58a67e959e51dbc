//! Algebraic multigrid for J(x), from rows.

mod coarsen;
mod cycle;
mod matrix;
mod nested;
mod newton;
mod order;

use hlcp_core::{Diagonal, Error, Hlcp, Rows, Scalar};

use self::{
    cycle::{Cycle, Hierarchy, bounded, near_kernel},
    matrix::Matrix,
};
pub use newton::AmgNewton;
use crate::{
    Jacobian, Preconditioner,
    krylov::{Inner, add, dot, to_scalar},
};

/// Gauss–Seidel passes over the rows of the broken part.
const VOID: usize = 3;

/// A broken unknown whose scale is below this part of a full one's takes no part in coarsening.
const DRY: f64 = 1e-6;

/// The directions that the outer iteration keeps.
const KEPT: usize = 20;

/// The iterations after which a hierarchy is built anew around what it leaves, and how often.
const BOOTSTRAP: usize = 20;
const BOOTSTRAPS: usize = 2;

#[derive(Debug, Clone)]
pub struct Amg<T> {
    /// The numbering along the flow: the unknown at each place, and the place of each unknown; empty where they agree.
    order: Vec<u32>,
    place: Vec<u32>,
    active: Vec<bool>,
    /// The factors of the columns of J.
    scale: Vec<T>,
    hierarchy: Option<Hierarchy<T>>,
    rhs: Vec<T>,
    y: Vec<T>,
    product: Vec<T>,
    kept: Vec<[Vec<T>; 2]>,
    walks: f64,
    set_ups: usize,
}

impl<T: Scalar> Amg<T> {
    /// Without a hierarchy yet.
    pub fn new<A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Result<Self, Error> {
        let n = problem.order();
        if u32::try_from(n).is_err() {
            let range = "below 2³², which a 32-bit column can name";
            return Err(Error::Parameter { name: "the order", value: n as f64, range });
        }
        check("A", "diagonal of A", problem.a())?;
        check("B", "diagonal of B", problem.b())?;
        let order = order::along_flow(problem);
        let mut place = vec![0; order.len()];
        for (at, &i) in order.iter().enumerate() {
            place[i as usize] = at as u32;
        }
        Ok(Self {
            order,
            place,
            active: vec![],
            scale: vec![],
            hierarchy: None,
            rhs: vec![T::zero(); n],
            y: vec![T::zero(); n],
            product: vec![T::zero(); n],
            kept: vec![],
            walks: 0.0,
            set_ups: 0,
        })
    }

    /// The walks over the rows of J that set-ups and cycles were worth so far.
    pub fn walks(&self) -> f64 {
        let hierarchy = self.hierarchy.as_ref();
        self.walks + hierarchy.map_or(0.0, |h| h.walked as f64 / h.matrix().entries() as f64)
    }

    pub fn set_ups(&self) -> usize {
        self.set_ups
    }

    pub fn complexity(&self) -> Option<f64> {
        self.hierarchy.as_ref().map(Hierarchy::complexity)
    }

    pub fn orders(&self) -> Vec<usize> {
        self.hierarchy.iter().flat_map(Hierarchy::orders).collect()
    }

    fn at(&self, place: usize) -> usize {
        self.order.get(place).map_or(place, |&i| i as usize)
    }

    fn place(&self, i: usize) -> usize {
        self.place.get(i).map_or(i, |&at| at as usize)
    }

    /// Builds the hierarchy of `jacobian`, unless it is there already.
    pub fn set_up<A: Rows<T>, B: Rows<T>>(&mut self, jacobian: &Jacobian<'_, T, A, B>) {
        let n = jacobian.problem().order();
        let known = self.hierarchy.is_some()
            && self.active.iter().enumerate().all(|(i, &active)| active == jacobian.is_active(i));
        if known {
            return;
        }
        self.active.clear();
        self.active.extend((0..n).map(|i| jacobian.is_active(i)));
        let matrix = self.assemble(jacobian);
        self.build(matrix, None);
    }

    fn assemble<A: Rows<T>, B: Rows<T>>(&self, jacobian: &Jacobian<'_, T, A, B>) -> Matrix<T> {
        let n = jacobian.problem().order();
        let entries = self.hierarchy.as_ref().map_or(4 * n, |h| h.matrix().entries());
        let mut matrix = Matrix::with_capacity(n, entries);
        let mut row: Vec<(u32, T)> = vec![];
        for at in 0..n {
            row.clear();
            jacobian.visit_row(self.at(at), |j, a| row.push((self.place(j) as u32, a)));
            matrix.push(&row);
        }
        matrix
    }

    /// Scales the columns of J and coarsens it; `start` is what a cycle before could not reduce, in the unknowns of J.
    fn build(&mut self, mut matrix: Matrix<T>, start: Option<Vec<T>>) {
        let n = matrix.order();
        if let Some(h) = self.hierarchy.take() {
            self.walks += h.walked as f64 / h.matrix().entries() as f64;
        }
        let broken: Vec<bool> = (0..n).map(|at| !self.active[self.at(at)]).collect();
        let (mut scale, dry) = match start {
            Some(scale) => (scale, vec![]),
            None => void(&matrix, &broken),
        };
        matrix.scale_columns(&scale);
        let v = near_kernel(&matrix, None);
        for (scale, &v) in scale.iter_mut().zip(&v) {
            *scale *= v;
        }
        matrix.scale_columns(&v);
        self.scale = scale;
        self.walks += 1.0 + VOID as f64 + 12.0;
        self.set_ups += 1;
        self.hierarchy = Some(Hierarchy::new(matrix, |i| dry.get(i) == Some(&true)));
    }

    /// Overwrites `y` with an approximate solution of `J(x) y = rhs`.
    pub(crate) fn solve_to<A: Rows<T>, B: Rows<T>>(
        &mut self,
        jacobian: &Jacobian<'_, T, A, B>,
        rhs: &[T],
        y: &mut [T],
        (tolerance, limit): (f64, usize),
    ) -> Inner {
        self.set_up(jacobian);
        let mut residual: Vec<T> = (0..rhs.len()).map(|at| rhs[self.at(at)]).collect();
        let mut x = vec![T::zero(); rhs.len()];
        let unit = dot(&residual, &residual).sqrt();
        let mut inner = Inner { iterations: 0, residual: 1.0 };
        y.fill(T::zero());
        if unit == 0.0 {
            return Inner { iterations: 0, residual: 0.0 };
        }
        for bootstraps in 0..=BOOTSTRAPS {
            let steps = if bootstraps < BOOTSTRAPS { BOOTSTRAP } else { limit };
            let steps = steps.min(limit.saturating_sub(inner.iterations));
            inner.iterations += self.flexible(&mut residual, &mut x, unit * tolerance, steps);
            inner.residual = dot(&residual, &residual).sqrt() / unit;
            for (at, x) in x.iter_mut().enumerate() {
                y[self.at(at)] += *x * self.scale[at];
                *x = T::zero();
            }
            if !(inner.residual > tolerance) || inner.iterations >= limit {
                break;
            }
            if bootstraps < BOOTSTRAPS {
                self.bootstrap(jacobian);
                inner.iterations += 8;
            }
        }
        inner
    }

    /// Builds the hierarchy around the slowest vector: a rough solution of `J v = e`.
    fn bootstrap<A: Rows<T>, B: Rows<T>>(&mut self, jacobian: &Jacobian<'_, T, A, B>) {
        let n = self.scale.len();
        let mut residual = vec![T::one(); n];
        let mut v = vec![T::zero(); n];
        self.flexible(&mut residual, &mut v, 0.0, 8);
        bounded(&mut v);
        for (v, &scale) in v.iter_mut().zip(&self.scale) {
            *v *= scale;
        }
        let matrix = self.assemble(jacobian);
        self.build(matrix, Some(v));
    }

    /// Flexible GCR from `x` with `residual`, both in the unknowns of the hierarchy.
    fn flexible(&mut self, residual: &mut [T], x: &mut [T], goal: f64, limit: usize) -> usize {
        let Some(hierarchy) = &mut self.hierarchy else { return 0 };
        let n = residual.len();
        let mut size = dot(residual, residual);
        for step in 0..limit {
            if !(size > goal * goal) {
                return step;
            }
            if self.kept.len() <= step % KEPT {
                self.kept.push([vec![T::zero(); n], vec![T::zero(); n]]);
            }
            // The pair that is the oldest gives way.
            let (older, rest) = self.kept.split_at_mut(step % KEPT);
            let ([p, q], newer) = rest.split_first_mut().map(|(a, b)| (a, b)).expect("it was pushed");
            let newer = if step >= KEPT { &*newer } else { &[] };
            hierarchy.cycle(Cycle::K, residual, p, q);
            for [old_p, old_q] in older.iter().chain(newer) {
                let share = dot(q, old_q);
                add(q, -share, old_q);
                add(p, -share, old_p);
            }
            let norm = dot(q, q).sqrt();
            if !norm.is_normal() {
                return step;
            }
            let inverse = to_scalar::<T>(norm.recip());
            q.iter_mut().for_each(|q| *q *= inverse);
            p.iter_mut().for_each(|p| *p *= inverse);
            let length = dot(residual, q);
            if !length.is_finite() {
                return step;
            }
            add(x, length, p);
            add(residual, -length, q);
            size = dot(residual, residual);
        }
        limit
    }
}

/// The scale of the void: full columns as they are, broken ones such that the constant solves their rows; which are dry.
fn void<T: Scalar>(matrix: &Matrix<T>, broken: &[bool]) -> (Vec<T>, Vec<bool>) {
    let mut scale = vec![T::one(); broken.len()];
    for (scale, _) in scale.iter_mut().zip(broken).filter(|(_, broken)| **broken) {
        *scale = T::zero();
    }
    for _ in 0..VOID {
        for i in (0..broken.len()).filter(|&i| broken[i]) {
            matrix.relax_homogeneous(i, &mut scale);
        }
    }
    // What a full unknown is worth in the unit of this one.
    let least = to_scalar::<T>(DRY);
    let mean_full = {
        let (sum, count) = matrix.diagonal.iter().zip(broken).filter(|(_, b)| !**b).fold((T::zero(), 0), |(s, c), (&d, _)| (s + d, c + 1));
        if count == 0 { T::one() } else { sum / to_scalar(count as f64) }
    };
    let mut dry = vec![false; broken.len()];
    for i in (0..broken.len()).filter(|&i| broken[i]) {
        let alike = mean_full / matrix.diagonal[i];
        let wet = scale[i] / alike;
        if !(wet > least && wet < least.recip()) {
            (dry[i], scale[i]) = (true, if alike.is_normal() { alike } else { T::one() });
        }
    }
    (scale, dry)
}

/// Refuses a diagonal entry that is not positive, and an entry that is not finite.
fn check<T: Scalar, O: Rows<T>>(name: &'static str, diagonal: &'static str, operator: &O) -> Result<(), Error> {
    for i in 0..operator.order() {
        let d = operator.diagonal_entry(i);
        if !(d > T::zero() && d.is_finite()) {
            let value = d.to_f64().unwrap_or(f64::NAN);
            return Err(Error::NotPositive { what: diagonal, index: i, value });
        }
        let mut bad = None;
        operator.visit_row(i, &mut |_, a| bad = bad.or((!a.is_finite()).then_some(a)));
        if let Some(a) = bad {
            return Err(Error::NotFinite { what: name, index: i, value: a.to_f64().unwrap_or(f64::NAN) });
        }
    }
    Ok(())
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Preconditioner<T, A, B> for Amg<T> {
    fn solve(&mut self, jacobian: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]) {
        self.set_up(jacobian);
        for at in 0..rhs.len() {
            self.rhs[at] = rhs[self.at(at)];
        }
        if let Some(hierarchy) = &mut self.hierarchy {
            hierarchy.cycle(Cycle::W, &self.rhs, &mut self.y, &mut self.product);
        }
        for at in 0..rhs.len() {
            y[self.at(at)] = self.y[at] * self.scale[at];
        }
    }
}
