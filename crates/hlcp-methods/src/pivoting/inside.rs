//! The way through the interior, in units of rows and columns.

use hlcp_core::{Hlcp, Rhs, Rows, Scalar};

use super::{Pivoting, of_column};

/// The part of the way to the edge that a step inside takes at most, and μ over the square of the
/// size of `x`, or the number of steps, that ends it. Chains of thousands of bodies in contact take
/// up to 88 with columns times 10^±3; after half of these, changes of signs do not end.
const EDGE: f64 = 0.9999;
const INSIDE: f64 = 1e-14;
const STEPS: usize = 100;

/// The rounds that bring rows and columns to one size: without overrelaxation, and all; and its
/// factor. Along a chain of thousands the traces of units from 10⁻³ to 10³ are few then.
const ROUNDS: [usize; 2] = [3, 30];
const OVER: f64 = 1.8;

/// A point with `z, r > 0`, both in units of γ, and `r` of Ω, too; free unknowns have any `z` and
/// `r = 0`. The first ones are the units of the columns, so that μ is 1.
#[derive(Debug, Clone)]
pub(super) struct Interior<T> {
    z: Vec<T>,
    r: Vec<T>,
    /// The units of the columns, and the usual size in these.
    units: [Vec<T>; 2],
    size: T,
    /// The steps that are left.
    left: usize,
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Pivoting<T, A, B> {
    /// Sets out from where both unknowns have, in units of their columns, twice the mean size of
    /// `x`, or of what `q` alone makes of them.
    pub(super) fn enter(&mut self, q: &Rhs<'_, T>, x: &[T]) {
        let problem = &self.problem;
        let units = units(problem);
        let mut size = 2.0 * mean_size(|i| x[i], &units);
        if !size.is_normal() {
            let of_q = |i: usize| problem.q_factor() * q.entries()[i];
            size = 2.0 * mean_size(|i| -of_q(i) / problem.a().diagonal_entry(i), &units);
        }
        let [z, r] = units.each_ref().map(|units| {
            let bound = |(&unit, &free): (&T, &T)| if free > T::zero() { T::zero() } else { unit };
            units.iter().zip(&self.free).map(bound).collect()
        });
        self.interior = Some(Interior { z, r, units, size: T::of(size), left: STEPS });
    }

    /// Takes a step inside, and overwrites `y` with what is closest to it on the edge.
    pub(super) fn step_inside(&mut self, q: &Rhs<'_, T>, inside: Interior<T>, y: &mut [T]) {
        let Interior { mut z, mut r, units, size, left } = inside;
        let Self { problem, d, f, scratch, factors, free, x: s, .. } = self;
        let (n, factor) = (y.len(), problem.q_factor() / size);
        let is_bound = |i: usize| free[i] == T::zero();
        for (i, d) in d.iter_mut().enumerate() {
            *d = if is_bound(i) { (z[i] - r[i]) / (z[i] + r[i]) } else { T::one() };
        }
        factors.factorise(problem, d);
        self.steps += 1;
        // zᵢ Δrᵢ + rᵢ Δzᵢ = cᵢ, the right-hand side of the second equation.
        let mut c: Vec<T> = z.iter().zip(&r).map(|(&z, &r)| -z * r).collect();
        let (mut dz, mut dr) = (vec![T::zero(); n], vec![T::zero(); n]);
        let mut length = 0.0;
        let mean = |z: &[T], r: &[T]| {
            let products = (0..n).map(|i| z[i] / units[0][i] * (r[i] / units[1][i]));
            products.map(T::wide).sum::<f64>()
                / (0..n).filter(|&i| is_bound(i)).count().max(1) as f64
        };
        let before = mean(&z, &r);
        for corrects in [false, true] {
            // −(A z − BΩ r + γq) + BΩ (c/z), with one product.
            let (part, product) = scratch.split_at_mut(n);
            for (i, part) in part.iter_mut().enumerate() {
                let of_z = if is_bound(i) { c[i] / z[i] } else { T::zero() };
                *part = problem.omega().entry(i) * (r[i] + of_z);
            }
            problem.b().apply(part, product);
            problem.a().apply(&z, f);
            for ((f, &product), &q) in f.iter_mut().zip(&*product).zip(q.entries()) {
                *f = product - *f - factor * q;
            }
            factors.solve(f, s);
            for i in 0..n {
                if is_bound(i) {
                    // 1 + d without cancellation.
                    dz[i] = s[i] * (z[i] + z[i]) / (z[i] + r[i]);
                    dr[i] = (c[i] - r[i] * dz[i]) / z[i];
                } else {
                    dz[i] = s[i] + s[i];
                }
            }
            let ways = [(&z, &dz), (&r, &dr)].map(|(v, dv)| {
                let falls = (0..n).filter(|&i| is_bound(i) && dv[i] < T::zero());
                falls.fold(f64::INFINITY, |least, i| least.min((-v[i] / dv[i]).wide()))
            });
            length = (EDGE * ways[0].min(ways[1])).min(1.0);
            if !corrects {
                let moved = |v: &[T], dv: &[T]| -> Vec<T> {
                    v.iter().zip(dv).map(|(&v, &dv)| v + T::of(length) * dv).collect()
                };
                let after = mean(&moved(&z, &dz), &moved(&r, &dr));
                let centred = T::of((after / before).powi(3) * before);
                for i in (0..n).filter(|&i| is_bound(i)) {
                    c[i] += centred * units[0][i] * units[1][i] - dz[i] * dr[i];
                }
            }
        }
        let length = T::of(length);
        for i in 0..n {
            // The one of the two that is zero in the end shrinks faster (Tapia).
            let is_active = dz[i] * r[i] >= dr[i] * z[i];
            z[i] += length * dz[i];
            r[i] += length * dr[i];
            let x = if is_active || !is_bound(i) { of_column(z[i], free[i]) } else { -r[i] };
            y[i] = x * size / T::of(2.0);
        }
        self.fewest = usize::MAX;
        // Signs that are wrong may have led to a first x that is larger by many powers of ten.
        let reached = 2.0 * mean_size(|i| y[i], &units) / size.wide();
        let goes_on = left > 1
            && mean(&z, &r) > INSIDE * reached * reached
            && y.iter().all(|y| y.is_finite());
        self.interior = goes_on.then_some(Interior { z, r, units, size, left: left - 1 });
    }
}

/// Returns the mean size of a vector of the modulus, in units of the two columns that each entry
/// may be of.
fn mean_size<T: Scalar>(x: impl Fn(usize) -> T, [of_z, of_r]: &[Vec<T>; 2]) -> f64 {
    let units = of_z.iter().zip(of_r).map(|(z, r)| [z.wide(), r.wide()]);
    let sizes = units.enumerate().map(|(i, [of_z, of_r])| {
        let x = x(i).wide();
        (x / of_z).max(-x / of_r)
    });
    sizes.sum::<f64>() / of_z.len() as f64
}

/// Units of `z` and `r`, of γ and of Ω as those are, in which the columns of A and B have the sum 1
/// and the rows 2, with units of rows (Sinkhorn and Knopp). What rows, `z` and `r` are multiplied
/// by leaves no other trace in the end (`docs/theory.md`, "Units"). Rows and columns take turns,
/// overrelaxed (A. Thibault, L. Chizat, C. Dossal and N. Papadakis, *Overrelaxed Sinkhorn–Knopp
/// algorithm for regularized optimal transport*, Algorithms 14, 2021).
fn units<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> [Vec<T>; 2] {
    let n = problem.order();
    let mut rows = vec![vec![]; n];
    for (i, row) in rows.iter_mut().enumerate() {
        problem.a().visit_row(i, &mut |j, a| row.push((j, a.abs().wide())));
        problem.b().visit_row(i, &mut |j, b| {
            row.push((n + j, b.abs().wide() * problem.omega().entry(j).wide()));
        });
    }
    let [mut of_rows, mut of_columns] = [n, 2 * n].map(|len| vec![1.0_f64; len]);
    for round in 0..ROUNDS[1] {
        let over = if round < ROUNDS[0] { 1.0 } else { OVER };
        let mut sums = vec![0.0; 2 * n];
        for (row, of_row) in rows.iter().zip(&mut of_rows) {
            let sum: f64 = row.iter().map(|&(j, size)| size * of_columns[j]).sum();
            *of_row *= (sum * *of_row / 2.0).powf(-over);
            row.iter().for_each(|&(j, size)| sums[j] += size * *of_row);
        }
        for (of_column, sum) in of_columns.iter_mut().zip(sums) {
            *of_column *= (sum * *of_column).powf(-over);
        }
    }
    let units = |of: &[f64]| of.iter().map(|&of| T::of(of)).collect();
    [units(&of_columns[..n]), units(&of_columns[n..])]
}
