//! The way through the interior, in units of rows and columns.

use hlcp_core::{Hlcp, Rhs, Rows, Scalar};

use super::{Pivoting, of_column};

/// The part of the way to the edge that a step inside takes at most, and the number of steps, or μ
/// over the square of the size of `z` and `r`, that ends it: which of the two is zero may show only
/// where μ is rounding, as on plates and beams. Chains of thousands of bodies in contact take up to
/// 88 with columns times 10^±3. Where μ is 10⁻¹⁰ and grows tenfold, rounding ends it.
const EDGE: f64 = 0.9999;
const STEPS: usize = 100;
const INSIDE: f64 = 1e-24;
const ROUNDED: f64 = 1e-10;

/// Where one of the first steps goes no further than a tenth of its way, and μ has not fallen to
/// that, `z` and `r` are multiplied by ten: solutions of nearly singular problems are large.
const SHORT: f64 = 0.1;
const FIRST: usize = 12;

/// The rounds that bring rows and columns to one size: without overrelaxation, and all; and its
/// factor. Along a chain of thousands the traces of units from 10⁻³ to 10³ are few then. Sums of
/// rows are right to a tenth in the end, or units have no bounds, as blocks of zeros make them:
/// then those of the geometric means serve.
const ROUNDS: [usize; 2] = [3, 30];
const OVER: f64 = 1.8;
const OFF: f64 = 1.15;

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
    /// Sets out from where both unknowns have, in units of their columns, the mean size of `q` in
    /// those of rows, or twice that of `x` if that is more.
    pub(super) fn enter(&mut self, q: &Rhs<'_, T>, x: &[T]) {
        let problem = &self.problem;
        let (of_rows, units) = units(problem);
        let of_q = q.entries().iter().zip(of_rows).map(|(q, unit)| q.wide().abs() * unit);
        let of_q = problem.gamma().wide() * of_q.sum::<f64>();
        let in_units = |i: usize| (x[i] / units[0][i]).max(-x[i] / units[1][i]).wide();
        let bound = || (0..x.len()).filter(|&i| self.free[i] == T::zero());
        let of_x = 2.0 * bound().map(in_units).sum::<f64>() / bound().count().max(1) as f64;
        let size = of_x.max(of_q / problem.order() as f64);
        let [z, r] = units.each_ref().map(|units| {
            let bound = |(&unit, &free): (&T, &T)| if free > T::zero() { T::zero() } else { unit };
            units.iter().zip(&self.free).map(bound).collect()
        });
        self.interior = Some(Interior { z, r, units, size: T::of(size), left: STEPS });
    }

    /// Takes a step inside, and overwrites `y` with what is closest to it on the edge.
    pub(super) fn step_inside(&mut self, q: &Rhs<'_, T>, inside: Interior<T>, y: &mut [T]) {
        let Interior { mut z, mut r, units, size, left } = inside;
        let Self { problem, weights, f, scratch, factors, free, x: s, .. } = self;
        let n = y.len();
        let (is_bound, two) = (|i: usize| free[i] == T::zero(), T::of(2.0));
        let weight = |v: T, i: usize| (v + v) / (z[i] + r[i]);
        let of =
            |i| if is_bound(i) { [z[i], r[i]].map(|v| weight(v, i)) } else { [two, T::zero()] };
        weights.clear();
        weights.extend((0..n).map(of));
        factors.factorise(problem, weights);
        self.steps += 1;
        // zᵢ Δrᵢ + rᵢ Δzᵢ = cᵢ, the right-hand side of the second equation.
        let mut c: Vec<T> = z.iter().zip(&r).map(|(&z, &r)| -z * r).collect();
        let (mut dz, mut dr) = (vec![T::zero(); n], vec![T::zero(); n]);
        let mut length = 0.0;
        let bound = (0..n).filter(|&i| is_bound(i)).count().max(1) as f64;
        let mean = |z: &[T], r: &[T]| {
            let products = (0..n).map(|i| z[i] / units[0][i] * (r[i] / units[1][i]));
            products.map(T::wide).sum::<f64>() / bound
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
                *f = product - *f - problem.q_factor() / size * q;
            }
            factors.solve(f, s);
            for i in 0..n {
                dz[i] = weights[i][0] * s[i];
                if is_bound(i) {
                    dr[i] = (c[i] - r[i] * dz[i]) / z[i];
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
        self.fewest = usize::MAX;
        let part = T::of(length);
        for i in 0..n {
            z[i] += part * dz[i];
            r[i] += part * dr[i];
        }
        let after = mean(&z, &r);
        // What is free may be of any size, and of either sign.
        let in_units = |i: usize| (z[i] / units[0][i]).max(r[i] / units[1][i]).wide();
        let sum: f64 = (0..n).filter(|&i| is_bound(i)).map(in_units).sum();
        let reached = (sum / bound).powi(2);
        if before <= ROUNDED * reached && after >= 10.0 * before {
            return;
        }
        for i in 0..n {
            let is_above = z[i] * units[1][i] >= r[i] * units[0][i];
            let x = if is_above || !is_bound(i) { of_column(z[i], free[i]) } else { -r[i] };
            y[i] = x * size / two;
        }
        if left > 1 && after > INSIDE * reached && y.iter().all(|y| y.is_finite()) {
            let is_small = length < SHORT && before >= SHORT && left > STEPS - FIRST;
            let size = if is_small { T::of(10.0) * size } else { size };
            self.interior = Some(Interior { z, r, units, size, left: left - 1 });
        }
    }
}

/// Units of rows, and of `z` and `r`, of γ and of Ω as those are, in which the columns of A and B
/// have the sum 1 and the rows 2 (Sinkhorn and Knopp). What rows, `z` and `r` are multiplied
/// by leaves no other trace in the end (`docs/theory.md`, "Units"). Rows and columns take turns,
/// overrelaxed (A. Thibault, L. Chizat, C. Dossal and N. Papadakis, *Overrelaxed Sinkhorn–Knopp
/// algorithm for regularized optimal transport*, Algorithms 14, 2021).
pub(super) fn units<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
) -> (Vec<f64>, [Vec<T>; 2]) {
    let n = problem.order();
    let mut rows = vec![vec![]; n];
    for (i, row) in rows.iter_mut().enumerate() {
        problem.a().visit_row(i, &mut |j, a| row.push((j, a.abs().wide())));
        problem.b().visit_row(i, &mut |j, b| {
            row.push((n + j, b.abs().wide() * problem.omega().entry(j).wide()));
        });
    }
    let [mut of_rows, mut of_columns] = [n, 2 * n].map(|len| vec![1.0_f64; len]);
    let mut off = 0.0_f64;
    for round in 0..ROUNDS[1] {
        let over = if round < ROUNDS[0] { 1.0 } else { OVER };
        let mut sums = vec![0.0; 2 * n];
        off = 0.0;
        for (row, of_row) in rows.iter().zip(&mut of_rows) {
            let sum: f64 = row.iter().map(|&(j, size)| size * of_columns[j]).sum();
            if sum == 0.0 {
                continue;
            }
            let part = sum * *of_row / 2.0;
            off = off.max(part).max(part.recip());
            *of_row *= part.powf(-over);
            row.iter().for_each(|&(j, size)| sums[j] += size * *of_row);
        }
        // Rows and columns of zeros keep their units.
        for (of_column, sum) in of_columns.iter_mut().zip(sums).filter(|(_, sum)| *sum > 0.0) {
            *of_column *= (sum * *of_column).powf(-over);
        }
    }
    if off > OFF {
        [of_rows, of_columns] = means(&rows);
    }
    let units = |of: &[f64]| of.iter().map(|&of| T::of(of)).collect();
    let columns = [units(&of_columns[..n]), units(&of_columns[n..])];
    (of_rows, columns)
}

/// Units of rows and columns in which the entries of each have the geometric mean 1. Such units
/// exist whatever the pattern (A. R. Curtis and J. K. Reid, *On the automatic scaling of matrices
/// for Gaussian elimination*, J. Inst. Maths Applics 10, 1972).
fn means(rows: &[Vec<(usize, f64)>]) -> [Vec<f64>; 2] {
    let mut logs = [vec![0.0; rows.len()], vec![0.0; 2 * rows.len()]];
    for _ in 0..ROUNDS[1] {
        let [of_rows, of_columns] = &mut logs;
        let mut sums = vec![[0.0; 2]; of_columns.len()];
        for (row, of_row) in rows.iter().zip(of_rows) {
            let logs = || row.iter().filter(|of| of.1 > 0.0).map(|&(j, size)| (j, size.ln()));
            let sum: f64 = logs().map(|(j, log)| log + *of_row + of_columns[j]).sum();
            *of_row -= OVER * sum / logs().count().max(1) as f64;
            for (j, log) in logs() {
                sums[j] = [sums[j][0] + log + *of_row + of_columns[j], sums[j][1] + 1.0];
            }
        }
        for (of_column, [sum, count]) in of_columns.iter_mut().zip(sums) {
            *of_column -= OVER * sum / count.max(1.0);
        }
    }
    logs.map(|of| of.into_iter().map(f64::exp).collect())
}
