//! A start from coarser problems, which rows alone define.

use hlcp_core::{Error, Hlcp, Norms, Omega, Rows, Scalar};

use super::{
    coarsen::pairs,
    matrix::{Matrix, NONE},
    newton::Steps,
};
use crate::krylov::to_scalar;

type Coarse<T> = Hlcp<T, Matrix<T>, Matrix<T>>;

/// The order from which on a problem is solved from a constant.
const SMALL: usize = 200;

/// Steps on a coarser problem, and the part of ‖q‖ that is near enough to its solution.
const STEPS: usize = 4;
const NEAR: f64 = 1e-3;

/// Overwrites `x` with a start.
pub(super) fn start<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    q: &[T],
    x: &mut [T],
    steps: &mut Steps<T>,
) -> Result<(), Error> {
    let (a, b) = (Matrix::of(problem.a()), Matrix::of(problem.b()));
    nested(&a, &b, problem.omega(), problem.q_factor(), q, x, steps)
}

fn nested<T: Scalar>(
    a: &Matrix<T>,
    b: &Matrix<T>,
    omega: &Omega<T>,
    factor: T,
    q: &[T],
    x: &mut [T],
    steps: &mut Steps<T>,
) -> Result<(), Error> {
    let (aggregate, a, b) = coarser(a, b);
    let n = a.order();
    if n * 10 > x.len() * 9 {
        return Ok(());
    }
    let mut coarse_q = vec![T::zero(); n];
    let (mut sum, mut count) = (vec![T::zero(); n], vec![T::zero(); n]);
    for (i, (&to, &q)) in aggregate.iter().zip(q).enumerate() {
        let to = to as usize;
        coarse_q[to] += factor * q;
        sum[to] += omega.at(i);
        count[to] += T::one();
    }
    let each = sum.iter().zip(&count).map(|(&sum, &count)| sum / count).collect();
    let coarse_omega = Omega::Each(each);
    let mut coarse_x = vec![T::one(); n];
    let problem: Coarse<T> = Hlcp::new(a, b, coarse_omega)?;
    let mut coarse_steps = Steps::new(&problem)?;
    if n > SMALL {
        nested(problem.a(), problem.b(), problem.omega(), T::one(), &coarse_q, &mut coarse_x, &mut coarse_steps)?;
    }
    let size = Norms::of(&coarse_q).l2;
    for _ in 0..STEPS {
        if !coarse_steps.step(&problem, &coarse_q, &mut coarse_x) {
            break;
        }
        if coarse_steps.measure(&problem, &coarse_q, &coarse_x).l2 <= NEAR * size {
            break;
        }
    }
    let share = n as f64 / x.len() as f64;
    steps.nested += share * (coarse_steps.nested + coarse_steps.sweeps as f64 + coarse_steps.amg.walks());
    if coarse_x.iter().all(|x| x.is_finite()) {
        for (i, x) in x.iter_mut().enumerate() {
            let from = aggregate[i] as usize;
            *x = coarse_x[from];
            if *x < T::zero() {
                *x = *x * problem.omega().at(from) / omega.at(i);
            }
        }
    }
    Ok(())
}

/// The aggregates of two passes of pairing, and A and B on them.
fn coarser<T: Scalar>(a: &Matrix<T>, b: &Matrix<T>) -> (Vec<u32>, Matrix<T>, Matrix<T>) {
    let (mut first, half) = both(a, b);
    let (a, b) = (in_series(a, &first).aggregated(&first, half), in_series(b, &first).aggregated(&first, half));
    let (second, quarter) = both(&a, &b);
    let (a, b) = (in_series(&a, &second).aggregated(&second, quarter), in_series(&b, &second).aggregated(&second, quarter));
    first.iter_mut().for_each(|to| *to = second[*to as usize]);
    (first, a, b)
}

fn both<T: Scalar>(a: &Matrix<T>, b: &Matrix<T>) -> (Vec<u32>, usize) {
    let sum = |m: &Matrix<T>| m.diagonal.iter().fold(T::zero(), |sum, &d| sum + d);
    pairs(&[(a, T::one()), (b, sum(a) / sum(b))], |_| false)
}

/// The matrix with couplings between aggregates weakened, as conductors are by what they are in series with.
///
/// From the middle of an aggregate to that of the next leads half of the coupling within, the one between, and again half of one
/// within. Row sums and column sums stay, and so does what is not symmetric: transport.
fn in_series<T: Scalar>(matrix: &Matrix<T>, aggregate: &[u32]) -> Matrix<T> {
    let n = matrix.order();
    let columns = matrix.transpose();
    // The part of the couplings that is symmetric: conduction.
    let mut back = vec![T::zero(); n];
    let mut conduction = Matrix::with_capacity(n, matrix.entries());
    let mut row: Vec<(u32, T)> = vec![];
    for i in 0..n {
        let column = columns.column(i);
        column.iter().for_each(|&(j, a)| back[j as usize] = -a);
        row.clear();
        for (j, a) in matrix.off(i) {
            let c = back[j].min(-a);
            if c > T::zero() {
                row.push((j as u32, c));
            }
        }
        conduction.push(&row);
        column.iter().for_each(|&(j, _)| back[j as usize] = T::zero());
    }
    // The resistance within the aggregate of i on the way to that of j: through neighbours of i that do not touch the other one.
    let count = aggregate.iter().fold(0, |max, &a| max.max(a + 1)) as usize;
    let members = Members::new(aggregate, count);
    let mut touching = vec![(NONE, 0_u32); count];
    let mut within: Vec<T> = vec![T::zero(); n];
    let mut halves: Vec<Vec<(u32, T)>> = vec![vec![]; n];
    for own in 0..count {
        let group = members.of(own);
        for (bit, &i) in group.iter().enumerate() {
            for (j, _) in conduction.off(i as usize) {
                let to = &mut touching[aggregate[j] as usize];
                if to.0 != own as u32 {
                    *to = (own as u32, 0);
                }
                to.1 |= 1 << (bit % 32);
            }
        }
        for &i in group {
            for (k, c) in conduction.off(i as usize) {
                within[k] = c;
            }
            for (j, _) in conduction.off(i as usize) {
                let mut behind = T::zero();
                if aggregate[j] as usize != own {
                    let touches = touching[aggregate[j] as usize].1;
                    for (bit, &k) in group.iter().enumerate() {
                        if k != i && touches & (1 << (bit % 32)) == 0 {
                            behind += within[k as usize];
                        }
                    }
                }
                let two = T::one() + T::one();
                let half = if behind > T::zero() { (two * behind).recip() } else { T::zero() };
                halves[i as usize].push((j as u32, half));
            }
            for (k, _) in conduction.off(i as usize) {
                within[k] = T::zero();
            }
        }
    }
    let mut half = Matrix::with_capacity(n, conduction.entries());
    halves.iter().for_each(|row| half.push(row));
    let other = half.transpose();
    // What each coupling loses, and the diagonal with it.
    let mut weakened = Matrix::with_capacity(n, matrix.entries());
    let mut loss = vec![T::zero(); n];
    for i in 0..n {
        let mut total = T::zero();
        let sides = half.off(i).zip(other.column(i));
        for ((j, c), ((_, own), &(_, other))) in conduction.off(i).zip(sides) {
            if own + other > T::zero() {
                loss[j] = c - (c.recip() + own + other).recip();
                total += loss[j];
            }
        }
        row.clear();
        row.push((i as u32, matrix.diagonal[i] - total));
        row.extend(matrix.off(i).map(|(j, a)| (j as u32, a + loss[j])));
        weakened.push(&row);
        conduction.off(i).for_each(|(j, _)| loss[j] = T::zero());
    }
    let _ = to_scalar::<T>(0.0);
    weakened
}

/// The members of aggregates.
struct Members {
    starts: Vec<usize>,
    members: Vec<u32>,
}

impl Members {
    fn new(aggregate: &[u32], count: usize) -> Self {
        let mut starts = vec![0; count + 1];
        for &a in aggregate.iter().filter(|&&a| a != NONE) {
            starts[a as usize + 1] += 1;
        }
        for a in 0..count {
            starts[a + 1] += starts[a];
        }
        let mut members = vec![0; starts[count]];
        let mut next = starts.clone();
        for (i, &a) in aggregate.iter().enumerate().filter(|(_, a)| **a != NONE) {
            members[next[a as usize]] = i as u32;
            next[a as usize] += 1;
        }
        Self { starts, members }
    }

    fn of(&self, aggregate: usize) -> &[u32] {
        &self.members[self.starts[aggregate]..self.starts[aggregate + 1]]
    }
}
