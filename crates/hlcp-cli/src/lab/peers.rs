//! Methods of others: an outside anchor, and Newton's methods on assembled matrices with faer's
//! sparse LU.

use std::{collections::BTreeMap, time::Instant};

use faer::{
    Mat,
    linalg::solvers::Solve,
    sparse::{
        SparseColMat, SparseColMatRef, Triplet,
        linalg::solvers::{Lu, SymbolicLu},
    },
};
use hlcp_core::{Norms, Rows};
use hlcp_methods::{DynRows, Limits, Outcome, Status};

use super::{methods::Scene, run::Run};
use crate::{
    Fallible,
    scenes::{Problem, goal},
};

/// Returns the run of a solve that ends with the 2-norm `residual`.
fn ended(
    begin: Instant,
    [iterations, sweeps]: [usize; 2],
    [residual, goal]: [f64; 2],
    answer: [Vec<f64>; 2],
) -> Run {
    let elapsed = begin.elapsed();
    let status = if residual <= goal { Status::Converged } else { Status::IterationLimit };
    let residual = Norms { l2: residual, linf: f64::NAN };
    let mut outcome = Outcome::new(status, iterations, elapsed, residual);
    outcome.sweeps = sweeps;
    Run { outcome, answer, seconds: vec![elapsed.as_secs_f64()], turns: vec![] }
}

/// Projected SOR: Cryer's method for the LCP, of the family that reference 22 of the paper extends,
/// and what users of films have made of it.
///
/// `zᵢ ← max(0, zᵢ − α(A z − B r + q)ᵢ/aᵢᵢ)` with `rᵢ = 0`, over the grid; where that leaves
/// `zᵢ = 0`, `rᵢ` is what solves the row, if that is positive. Until the residual, as measured row
/// by row on the way, is small enough; on `disc-lcp` and on films alone.
///
/// With `B = I`, where `r` follows from `z`, that is projected SOR. With transport in `B` it is the
/// relaxation of R. Ausas, M. Jai and G. Buscaglia (J. Tribology 131, 2009), pressure relaxed and
/// film content not.
pub(crate) fn projected(scene: &Scene, limits: &Limits) -> Fallible<Option<Run>> {
    let alpha = match scene.name {
        "disc-lcp" => 2.0 - 6.4 / scene.m,
        "film" => 1.5,
        _ => return Ok(None),
    };
    let Problem { a, b, q, .. } = &scene.wide.problem;
    let n = q.len();
    let begin = Instant::now();
    let [a, b] = [a, b].map(|of| Assembled::new(n, |i, visit| of.visit_row(i, visit)));
    let (mut z, mut r) = (vec![2.0_f64; n], vec![0.0_f64; n]);
    let goal = goal(limits, q);
    let (mut sweeps, mut residual) = (0, f64::INFINITY);
    while residual > goal && sweeps < limits.iterations {
        let mut squares = 0.0;
        for i in 0..n {
            let off = |of: &Assembled, v: &[f64]| -> f64 {
                of.row(i).filter(|(j, _)| *j != i).map(|(j, entry)| entry * v[j]).sum()
            };
            let t = q[i] + off(&a, &z) - off(&b, &r);
            let left = t + a.diagonal[i] * z[i] - b.diagonal[i] * r[i];
            squares += left * left;
            z[i] = ((1.0 - alpha) * z[i] - alpha * t / a.diagonal[i]).max(0.0);
            r[i] = if z[i] > 0.0 { 0.0 } else { (t / b.diagonal[i]).max(0.0) };
        }
        residual = squares.sqrt();
        sweeps += 1;
    }
    Ok(Some(ended(begin, [sweeps; 2], [residual, goal], [z, r])))
}

pub(super) struct Assembled {
    pub(super) diagonal: Vec<f64>,
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Assembled {
    /// Adds up what `row` visits of each row.
    pub(super) fn new(n: usize, row: impl Fn(usize, &mut dyn FnMut(usize, f64))) -> Self {
        let mut all = Self { diagonal: vec![0.0; n], starts: vec![0], entries: vec![] };
        let mut sums = BTreeMap::new();
        for i in 0..n {
            row(i, &mut |j, entry| *sums.entry(j as u32).or_insert(0.0) += entry);
            all.diagonal[i] = sums.get(&(i as u32)).copied().unwrap_or(0.0);
            all.entries.extend(std::mem::take(&mut sums));
            all.starts.push(all.entries.len());
        }
        all
    }

    /// Returns the entries of a row by their columns, which increase.
    pub(super) fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let row = &self.entries[self.starts[i]..self.starts[i + 1]];
        row.iter().map(|&(j, entry)| (j as usize, entry))
    }
}

/// Newton's method on the modulus equation, without damping.
pub(crate) fn newton(problem: &Problem<f64>, limits: &Limits) -> Fallible<Run> {
    factorised(problem, limits, |columns, problem, z, r| {
        let sides: Vec<[f64; 2]> =
            z.iter().map(|&z| if z > 0.0 { [1.0, 0.0] } else { [0.0, -1.0] }).collect();
        let minus_q: Vec<f64> = problem.q.iter().map(|q| -q).collect();
        for (j, found) in columns.solve(&sides, &minus_q)?.into_iter().enumerate() {
            // Negative ones of either kind change sides.
            let is_z = (sides[j][0] > 0.0) == (found > 0.0);
            (z[j], r[j]) = if is_z { (found.abs(), 0.0) } else { (0.0, found.abs()) };
        }
        Ok(())
    })
}

/// The Fischer–Burmeister–Newton–Schur method of T. Woloszynski, P. Podsiadlo and G. W. Stachowiak
/// (Tribology Letters 58, 2015).
///
/// It looks for roots of `z + r − √(z² + r²)` together with `A z − B r + q`. In each column the
/// unknown that the linearised function gives the better is eliminated; a step is halved until it
/// decreases the sum of squares, ten times at most.
pub(crate) fn fbns(problem: &Problem<f64>, limits: &Limits) -> Fallible<Run> {
    factorised(problem, limits, |columns, problem, z, r| {
        let [dz, dr] = schur(columns, problem, [z, r])?;
        let merit = |z: &[f64], r: &[f64]| {
            let balance = Norms::of(&residual(problem, z, r)).l2;
            let function: f64 = z.iter().zip(r).map(|(z, r)| (z + r - z.hypot(*r)).powi(2)).sum();
            balance * balance + function
        };
        let before = merit(z, r);
        let mut length = 1.0;
        while length > 1e-3
            && merit(&moved(z, &dz, length), &moved(r, &dr, length))
                > (1.0 - 1e-4 * length) * before
        {
            length /= 2.0;
        }
        (*z, *r) = (moved(z, &dz, length), moved(r, &dr, length));
        Ok(())
    })
}

/// Takes steps of `(z, r)` from `z = 2`, `r = 0`, or `x = e`, a hundred at most, until the residual
/// is small enough for the nearest `z`, `r ≥ 0` of which one is zero everywhere.
fn factorised(
    problem: &Problem<f64>,
    limits: &Limits,
    step: impl Fn(&Columns, &Problem<f64>, &mut Vec<f64>, &mut Vec<f64>) -> Fallible<()>,
) -> Fallible<Run> {
    let begin = Instant::now();
    let columns = Columns::new(&problem.a, &problem.b)?;
    let (n, goal) = (problem.q.len(), goal(limits, &problem.q));
    let (mut z, mut r) = (vec![2.0; n], vec![0.0; n]);
    let mut steps = 0;
    loop {
        let side =
            |(&z, &r): (&f64, &f64)| if z > r { (z.max(0.0), 0.0) } else { (0.0, r.max(0.0)) };
        let (full, void): (Vec<f64>, Vec<f64>) = z.iter().zip(&r).map(side).unzip();
        let left = Norms::of(&residual(problem, &full, &void)).l2;
        let is_up = limits.time.is_some_and(|time| begin.elapsed() >= time);
        if left <= goal || steps == 100 || is_up {
            return Ok(ended(begin, [steps, 0], [left, goal], [full, void]));
        }
        step(&columns, problem, &mut z, &mut r)?;
        steps += 1;
    }
}

/// `v + t d`.
fn moved(v: &[f64], d: &[f64], t: f64) -> Vec<f64> {
    v.iter().zip(d).map(|(v, d)| v + t * d).collect()
}

/// `A z − B r + q`.
fn residual(Problem { a, b, q, .. }: &Problem<f64>, z: &[f64], r: &[f64]) -> Vec<f64> {
    let (mut az, mut br) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    a.apply(z, &mut az);
    b.apply(r, &mut br);
    az.iter().zip(&br).zip(q).map(|((az, br), q)| az - br + q).collect()
}

/// The step `[δz, δr]` from `(z, r)`, by the Schur complement.
///
/// With `f = z + r − √(z² + r²)` and its derivatives `f_z` and `f_r`, `δr = −(f + f_z δz)/f_r`
/// where `f_r ≥ f_z`, and the reverse elsewhere.
fn schur(
    columns: &Columns,
    problem: &Problem<f64>,
    [z, r]: [&[f64]; 2],
) -> Fallible<[Vec<f64>; 2]> {
    let n = z.len();
    let (mut dz, mut dr, mut slopes) = (vec![0.0; n], vec![0.0; n], vec![]);
    for j in 0..n {
        let length = z[j].hypot(r[j]);
        let slope = |v: f64| if length > 0.0 { 1.0 - v / length } else { 1.0 - 0.5_f64.sqrt() };
        let (f, of_z, of_r) = (z[j] + r[j] - length, slope(z[j]), slope(r[j]));
        if of_r >= of_z {
            dr[j] = -f / of_r;
            slopes.push([1.0, of_z / of_r]);
        } else {
            dz[j] = -f / of_z;
            slopes.push([-of_r / of_z, -1.0]);
        }
    }
    let mut rhs = residual(problem, &moved(z, &dz, 1.0), &moved(r, &dr, 1.0));
    rhs.iter_mut().for_each(|rhs| *rhs = -*rhs);
    for (j, s) in columns.solve(&slopes, &rhs)?.into_iter().enumerate() {
        let [of_a, of_b] = slopes[j];
        dz[j] += of_a * s;
        dr[j] -= of_b * s;
    }
    Ok([dz, dr])
}

/// A and B by columns, each on the pattern of both, which is analysed once.
struct Columns {
    a: SparseColMat<usize, f64>,
    b: SparseColMat<usize, f64>,
    symbolic: SymbolicLu<usize>,
}

impl Columns {
    fn new(a: DynRows<'_, f64>, b: DynRows<'_, f64>) -> Fallible<Self> {
        let n = a.order();
        let weighted = |of_a: f64, of_b: f64| {
            let mut entries = vec![];
            for i in 0..n {
                a.visit_row(i, &mut |j, a| entries.push(Triplet::new(i, j, of_a * a)));
                b.visit_row(i, &mut |j, b| entries.push(Triplet::new(i, j, of_b * b)));
            }
            SparseColMat::try_new_from_triplets(n, n, &entries)
        };
        let [a, b] = [weighted(1.0, 0.0), weighted(0.0, 1.0)]
            .map(|matrix| matrix.map_err(|error| format!("{error:?}")));
        let (a, b) = (a?, b?);
        let symbolic = SymbolicLu::try_new(a.symbolic()).map_err(|error| format!("{error:?}"))?;
        Ok(Self { a, b, symbolic })
    }

    /// Returns the solution for the matrix of the columns `αⱼAⱼ + βⱼBⱼ`.
    fn solve(&self, factors: &[[f64; 2]], rhs: &[f64]) -> Fallible<Vec<f64>> {
        let (n, pattern) = (factors.len(), self.a.symbolic());
        let mut values = Vec::with_capacity(self.a.val().len());
        for (j, [of_a, of_b]) in factors.iter().enumerate() {
            let [a, b] = [&self.a, &self.b].map(|matrix| &matrix.val()[pattern.col_range(j)]);
            values.extend(a.iter().zip(b).map(|(a, b)| of_a * a + of_b * b));
        }
        let matrix = SparseColMatRef::new(pattern, &values);
        let lu = Lu::try_new_with_symbolic(self.symbolic.clone(), matrix)
            .map_err(|error| format!("{error:?}"))?;
        let mut x = Mat::from_fn(n, 1, |i, _| rhs[i]);
        lu.solve_in_place(x.as_mut());
        Ok((0..n).map(|i| x[(i, 0)]).collect())
    }
}
