//! Sparse factors LDLᵀ of J(x), by faer, for a diagonal operator and one that is symmetric in some
//! units, which may be of two signs.

use std::{sync::Arc, time::Instant};

use faer::{
    Conj, Mat, Par, Side,
    dyn_stack::{MemBuffer, MemStack, StackReq},
    linalg::cholesky::ldlt::factor::LdltRegularization,
    perm::PermRef,
    sparse::{
        SparseColMatRef,
        linalg::{
            amd,
            cholesky::{
                CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymmetricOrdering,
                factorize_symbolic_cholesky,
                simplicial::{
                    prefactorize_symbolic_cholesky, prefactorize_symbolic_cholesky_scratch,
                },
            },
        },
    },
};
use hlcp_core::{Hlcp, Rows, Scalar};

use crate::{
    direct::{BLOCKS, NUMBERS, Transposed, cost},
    limits::Cost,
};

/// Entries across the diagonal may differ by so many roundings, as those of sums do, and by so many
/// of double precision for each step from one unit to the next.
const ROUNDINGS: f64 = 16.0;

/// The sweeps that come before the first elimination, and that each takes but for multiplications.
/// On trees, networks and grids of 300 to 40,000 points one took 40 to 160 sweeps, and of several
/// each 6 to 26; of full matrices of order 1000 and 2000 three.
const SET_UP: usize = 45;
const EACH: usize = 15;

/// The part of its pivot that a free row without a diagonal has there, so that it has one where
/// equations are not independent: far above rounding, and far below what is to be left of a
/// residual.
const SHARE: f64 = 1e-12;

/// A pivot that stands for one to which rounding has given another sign.
const LOST: f64 = 1e100;

/// The factors of the matrix with the columns of `A` and `BΩ` times weights, summed, where one of
/// `A` and `B` is diagonal, but for columns of what is free, and the other one symmetric once its
/// rows are divided by some numbers: as in linear complementarity problems with a symmetric matrix
/// or, with numbers of both signs, in those of programs with constraints and their multipliers,
/// whatever rows, `z` and `r` are multiplied by.
///
/// With the diagonal `D`, the other operator `C`, the divisors `G`, `M = G⁻¹C` and the factors `c`
/// and `e` of the columns of both, `C c y + D e y = f` is
///
/// ```text
/// (M + G⁻¹D e/c) w = G⁻¹f  where c ≠ 0 and y = w/c;  y = (G⁻¹f − M w)/(G⁻¹D e)  elsewhere .
/// ```
///
/// With divisors of one sign all these matrices are positive definite if M is, that is, as it is
/// symmetric, if it is a P-matrix. With both signs they are quasidefinite where the rows of either
/// sign are definite, and pivots have the signs of their rows, whatever their order
/// (`docs/theory.md`, "Factors without pivoting"). One with a pivot of another sign, or none, has
/// no factors.
///
/// # Source
///
/// R. J. Vanderbei, *Symmetric quasidefinite matrices*, SIAM J. Optim. 5 (1995).
#[derive(Debug, Clone)]
pub(crate) struct Cholesky {
    of_b: bool,
    /// The factor between the columns of A and BΩ of an unknown that is free, 0 of others.
    free: Vec<f64>,
    /// G and G⁻¹D, which is 0 of what is free.
    divisors: Vec<f64>,
    diagonal: Vec<f64>,
    /// M.
    matrix: Transposed,
    /// The factors c, and G⁻¹D e.
    c: Vec<f64>,
    e: Vec<f64>,
    /// All columns, in an order of elimination that serves for any part of them, if it is to: what
    /// is left out leaves no more numbers.
    order: Vec<usize>,
    serves: bool,
    /// The numbers in the factors of all columns.
    pub(crate) numbers: f64,
    /// The columns with c ≠ 0 in this order.
    some: Vec<usize>,
    /// The upper triangle of M + G⁻¹D e/c there, by columns; the analysis of its pattern, if it has
    /// been made, and the factors, if there are any.
    upper: Transposed,
    symbolic: Option<Arc<SymbolicCholesky<usize>>>,
    numeric: Option<Vec<f64>>,
    /// What diagonals without an entry have been given.
    shares: Vec<f64>,
}

impl Cholesky {
    /// Room for the factors of any J(x) of a problem, and what they cost; nothing where they are
    /// not to be had.
    pub(crate) fn for_problem<T: Scalar, A: Rows<T>, B: Rows<T>>(
        problem: &Hlcp<T, A, B>,
        free: &[T],
    ) -> Option<(Self, Cost)> {
        let (begun, n) = (Instant::now(), problem.order());
        let free: Vec<f64> = free.iter().map(|free| free.wide()).collect();
        let of = |mut diagonal: Vec<f64>, of_b: bool| {
            let mut matrix = Transposed::of(n, |i, each| {
                let mut see = |j, a: T| {
                    if a != T::zero() {
                        each(j, a.wide());
                    }
                };
                if of_b {
                    problem.b().visit_row(i, &mut see)
                } else {
                    problem.a().visit_row(i, &mut see)
                }
            });
            // What is symmetric once it is divided by D needs no other numbers; where D has none,
            // the largest entry serves.
            for (i, d) in diagonal.iter_mut().enumerate() {
                let row = &mut matrix.values[matrix.starts[i]..matrix.starts[i + 1]];
                if free[i] > 0.0 {
                    let most = row.iter().fold(0.0_f64, |most, a| a.abs().max(most));
                    *d = if most > 0.0 { most } else { 1.0 };
                }
                row.iter_mut().for_each(|a| *a /= *d);
            }
            let mut divisors = divisors(&matrix, T::epsilon().wide())?;
            for (i, (divisor, d)) in divisors.iter_mut().zip(&mut diagonal).enumerate() {
                let row = matrix.starts[i]..matrix.starts[i + 1];
                matrix.values[row].iter_mut().for_each(|a| *a /= *divisor);
                let of_d = if free[i] > 0.0 { 0.0 } else { divisor.recip() };
                (*divisor, *d) = (*d * *divisor, of_d);
            }
            Some((of_b, divisors, diagonal, matrix))
        };
        let (of_b, divisors, diagonal, matrix) = match diagonal(problem.b(), &free) {
            Some(diagonal) => of(diagonal, false),
            None => of(diagonal(problem.a(), &free)?, true),
        }?;
        let (c, e) = (vec![1.0; n], diagonal.iter().map(|d| d.clamp(-1.0, 1.0)).collect());
        let (some, upper) = ((0..n).collect(), Transposed::default());
        let mut cholesky = Self {
            of_b,
            free,
            divisors,
            diagonal,
            matrix,
            c,
            e,
            order: vec![],
            serves: false,
            numbers: 0.0,
            some,
            upper,
            symbolic: None,
            numeric: None,
            shares: vec![],
        };
        cholesky.fill();
        let ([order, _], [numbers, multiplications]) = order(&cholesky.upper, &cholesky.shares)?;
        let entries = cholesky.matrix.columns.len() + n;
        let cost = cost(begun, [SET_UP, EACH], multiplications, entries, 16.0 * numbers);
        // Where multiplications take most of the time, an order for each part leaves fewer.
        cholesky.numbers = numbers;
        cholesky.serves = cost.worth <= 2 * EACH;
        cholesky.order = if cholesky.serves { order } else { (0..n).collect() };
        (numbers <= NUMBERS).then_some((cholesky, cost))
    }

    /// Returns what the diagonal is given where a free row has none, by the place of columns in the
    /// triangle: a small part of what the others make of it.
    fn shares(&self, place: &[usize]) -> Vec<f64> {
        let own =
            |j: usize| self.matrix.row(j).filter(|&(i, _)| i == j).map(|(_, a)| a).sum::<f64>();
        let pivot = |j: usize| own(j) + self.e[j] / self.c[j];
        let share = |&j: &usize| {
            if self.free[j] == 0.0 || own(j) != 0.0 {
                return 0.0;
            }
            let others = self.matrix.row(j).filter(|&(i, _)| place[i] < self.some.len());
            let parts = others.map(|(i, a)| a * a / pivot(i).abs());
            let sum: f64 = parts.filter(|part| part.is_finite()).sum();
            self.divisors[j].signum() * if sum > 0.0 { SHARE * sum } else { 1.0 }
        };
        self.some.iter().map(share).collect()
    }

    /// Overwrites the upper triangle; returns whether the pattern is that of before.
    fn fill(&mut self) -> bool {
        let mut place = vec![usize::MAX; self.c.len()];
        self.some.iter().enumerate().for_each(|(at, &j)| place[j] = at);
        self.shares = self.shares(&place);
        let Self { some, matrix, c, e, upper, shares, .. } = self;
        let before = std::mem::take(upper);
        *upper = Transposed::of(some.len(), |at, each| {
            let j = some[at];
            // Places that are not in use are beyond it.
            let left = matrix.row(j).filter(|&(i, _)| place[i] <= at);
            left.for_each(|(i, a)| each(place[i], a));
            if e[j] != 0.0 || shares[at] != 0.0 {
                each(at, e[j] / c[j] + shares[at]);
            }
        });
        upper.is_like(&before)
    }

    /// Factorises the matrix of the columns of `A` and `BΩ` times their weights, summed, if that is
    /// possible.
    pub(crate) fn factorise<T: Scalar, A: Rows<T>, B: Rows<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        weights: &[[T; 2]],
    ) {
        for (j, [a, b]) in weights.iter().enumerate() {
            let (a, b, omega, free) =
                (a.wide(), b.wide(), problem.omega().entry(j).wide(), self.free[j]);
            let [c, e] = match self.of_b {
                false if free > 0.0 => [a + b / free, 0.0],
                true if free > 0.0 => [omega * (b + a * free), 0.0],
                false => [a, omega * b],
                true => [omega * b, a],
            };
            (self.c[j], self.e[j]) = (c, self.diagonal[j] * e);
        }
        self.some.clear();
        self.some.extend(self.order.iter().copied().filter(|&j| self.c[j] != 0.0));
        if !self.fill() {
            self.symbolic = None;
        }
        self.numeric = self.factors();
    }

    /// The factors, in the memory of those before, unless memory is missing or a pivot has not the
    /// sign of its row.
    fn factors(&mut self) -> Option<Vec<f64>> {
        let mut values = self.numeric.take().unwrap_or_default();
        // What takes the place of a pivot of another sign than its row has: if that is rounding, a
        // number that leaves its unknown where it is, else one that is not finite, an error.
        let lost = if self.is_quasidefinite() { LOST } else { f64::INFINITY };
        let pattern = self.upper.pattern();
        let symbolic = match &mut self.symbolic {
            Some(symbolic) => symbolic,
            symbolic => {
                let blocks = CholeskySymbolicParams {
                    supernodal_flop_ratio_threshold: BLOCKS,
                    ..Default::default()
                };
                let own =
                    if self.serves { None } else { Some(order(&self.upper, &self.shares)?.0) };
                let order = match &own {
                    Some([order, place]) => {
                        let n = order.len();
                        SymmetricOrdering::Custom(PermRef::new_checked(order, place, n))
                    }
                    None => SymmetricOrdering::Identity,
                };
                let analysis =
                    factorize_symbolic_cholesky(pattern, Side::Upper, order, blocks).ok()?;
                symbolic.insert(Arc::new(analysis))
            }
        };
        // Blocks of columns are padded, but need no numbers of rows beside their own.
        let length = symbolic.len_val();
        if length as f64 > 2.0 * NUMBERS {
            return None;
        }
        let need = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let mut room = MemBuffer::try_new(need).ok()?;
        values.clear();
        values.try_reserve_exact(length).ok()?;
        values.resize(length, 0.0);
        let (matrix, stack) =
            (SparseColMatRef::new(pattern, &self.upper.values), MemStack::new(&mut room));
        let sign = |&j: &usize| if self.divisors[j] > 0.0 { 1 } else { -1 };
        let signs: Vec<i8> = self.some.iter().map(sign).collect();
        let regularization = LdltRegularization {
            dynamic_regularization_signs: Some(&signs),
            dynamic_regularization_delta: lost,
            dynamic_regularization_epsilon: 0.0,
        };
        let (par, settings) = (Par::Seq, Default::default());
        let done = symbolic.factorize_numeric_ldlt(
            &mut values,
            matrix,
            Side::Upper,
            regularization,
            par,
            stack,
            settings,
        );
        done.is_ok().then_some(values)
    }

    /// Returns whether only rounding can give a pivot another sign than its row has: each column
    /// has a part of the other one, and entries couple rows of different sign, or are on the
    /// diagonal and have that of their row.
    fn is_quasidefinite(&self) -> bool {
        self.some.iter().all(|&j| {
            let has_sign = |(i, a): (usize, f64)| {
                let of_signs = self.divisors[i] * self.divisors[j];
                if i == j { a * self.divisors[j] >= 0.0 } else { a == 0.0 || of_signs < 0.0 }
            };
            self.e[j] != 0.0 && self.matrix.row(j).all(has_sign)
        })
    }

    pub(crate) fn has_factors(&self) -> bool {
        self.numeric.is_some()
    }

    /// Overwrites `y` with the solution for `rhs`; with NaN where there are no factors.
    pub(crate) fn solve<T: Scalar>(&self, rhs: &[T], y: &mut [T]) {
        let (Some(symbolic), Some(values)) = (&self.symbolic, &self.numeric) else {
            y.fill(T::nan());
            return;
        };
        let divided = |i: usize| rhs[i].wide() / self.divisors[i];
        let mut rest = Mat::from_fn(self.some.len(), 1, |at, _| divided(self.some[at]));
        let mut room = MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let mut answer = |rest: &Mat<f64>| {
            let (mut x, stack) = (rest.clone(), MemStack::new(&mut room));
            let ldlt = LdltRef::new(symbolic, values);
            ldlt.solve_in_place_with_conj(Conj::No, x.as_mut(), Par::Seq, stack);
            x
        };
        let mut x = answer(&rest);
        if self.some.iter().any(|&j| self.divisors[j] <= 0.0) {
            // Pivots of both signs let rounding grow: what it has left is solved for again.
            for i in 0..self.some.len() {
                for (j, a) in self.upper.row(i) {
                    if j == i {
                        rest[(i, 0)] -= (a - self.shares[i]) * x[(i, 0)];
                    } else {
                        rest[(i, 0)] -= a * x[(j, 0)];
                        rest[(j, 0)] -= a * x[(i, 0)];
                    }
                }
            }
            x += answer(&rest);
        }
        let mut w = vec![0.0; y.len()];
        self.some.iter().enumerate().for_each(|(at, &j)| w[j] = x[(at, 0)]);
        for (i, y) in y.iter_mut().enumerate() {
            let rest = || self.matrix.row(i).fold(divided(i), |rest, (j, a)| rest - a * w[j]);
            *y = T::of(if self.c[i] == 0.0 { rest() / self.e[i] } else { w[i] / self.c[i] });
        }
    }
}

/// Returns an order of elimination and its inverse, and the numbers and multiplications it leaves:
/// the fewest that minimum degree finds.
///
/// Where free rows have no diagonal but `shares`, a pivot comes from neighbours alone: such rows
/// follow all neighbours that have a diagonal. With these definite, and the rows between both
/// independent, the others are pivots of the other sign.
fn order(upper: &Transposed, shares: &[f64]) -> Option<([Vec<usize>; 2], [f64; 2])> {
    let (n, entries) = (upper.starts.len() - 1, upper.columns.len());
    let mut room = MemBuffer::try_new(StackReq::any_of(&[
        amd::order_maybe_unsorted_scratch::<usize>(n, entries),
        prefactorize_symbolic_cholesky_scratch::<usize>(n, entries),
    ]));
    let stack = MemStack::new(room.as_mut().ok()?);
    let [mut order, mut place] = [(); 2].map(|()| vec![0; n]);
    let (pattern, control) = (upper.pattern(), amd::Control::default());
    let counts = amd::order_maybe_unsorted(&mut order, &mut place, pattern, control, stack).ok()?;
    let mut work = [counts.n_div + n as f64, counts.n_mult_subs_ldl];
    let mut after: Vec<_> = place.iter().map(|&at| (at, 0)).collect();
    for i in 0..n {
        for (j, _) in upper.row(i) {
            match [shares[i] == 0.0, shares[j] == 0.0] {
                [false, true] => after[i] = after[i].max((place[j], 1 + place[i])),
                [true, false] => after[j] = after[j].max((place[i], 1 + place[j])),
                _ => {}
            }
        }
    }
    order.sort_by_key(|&i| after[i]);
    if order.iter().enumerate().any(|(at, &i)| place[i] != at) {
        order.iter().enumerate().for_each(|(at, &i)| place[i] = at);
        let mut rows = vec![vec![]; n];
        for i in 0..n {
            for (j, _) in upper.row(i) {
                rows[place[i].max(place[j])].push(place[i].min(place[j]));
            }
        }
        let moved = Transposed::of(n, |i, each| rows[i].iter().for_each(|&j| each(j, 0.0)));
        let (mut tree, mut counts) = (vec![0; n], vec![0; n]);
        prefactorize_symbolic_cholesky(&mut tree, &mut counts, moved.pattern(), stack);
        let each = |of: fn(f64) -> f64| counts.iter().map(|&count| of(count as f64)).sum();
        work = [each(|count| count), each(|count| count * (count - 1.0) / 2.0)];
    }
    Some(([order, place], work))
}

/// The diagonal of an operator that has no other entries, but for columns of what is free.
fn diagonal<T: Scalar>(operator: &impl Rows<T>, free: &[f64]) -> Option<Vec<f64>> {
    let each = |i: usize| {
        let (mut is_alone, mut entry) = (true, T::zero());
        operator.visit_row(i, &mut |j, a| {
            is_alone &= j == i || a == T::zero() || free[j] > 0.0;
            entry += if j == i { a } else { T::zero() };
        });
        (is_alone && (entry != T::zero() || free[i] > 0.0)).then(|| entry.wide())
    };
    (0..operator.order()).map(each).collect()
}

/// Returns what the rows of a matrix are to be divided by for entries across the diagonal to agree,
/// to what is lost in the rounding of sums as large as a definite matrix may have there; ones if
/// they do already, and `None` if nothing does. The divisors lead from neighbour to neighbour, and
/// are refused where they are so far apart that rounding of the one outweighs the other.
fn divisors(matrix: &Transposed, epsilon: f64) -> Option<Vec<f64>> {
    let n = matrix.starts.len() - 1;
    // The entries across the diagonal: row after row, each column comes to its next one.
    let (mut across, mut ends) = (vec![], matrix.starts.clone());
    let mut diagonal = vec![0.0_f64; n];
    for (i, pivot) in diagonal.iter_mut().enumerate() {
        for (j, a) in matrix.row(i) {
            let at = ends[j];
            if at == matrix.starts[j + 1] || matrix.columns[at] != i {
                return None;
            }
            ends[j] += 1;
            across.push(matrix.values[at]);
            if i == j {
                *pivot = a.abs();
            }
        }
    }
    let agree = |[a, b]: [f64; 2], [i, j]: [f64; 2], steps: usize| {
        let unit = epsilon.max(steps as f64 * f64::EPSILON);
        (a - b).abs() <= ROUNDINGS * unit * (i.sqrt() * j.sqrt()).max(a.abs())
    };
    // Neighbours in the order of their distance, so that roundings are few.
    let (mut divisors, mut steps, mut reached) = (vec![0.0; n], vec![0; n], Vec::with_capacity(n));
    for first in 0..n {
        if divisors[first] != 0.0 {
            continue;
        }
        divisors[first] = 1.0;
        let mut next = reached.len();
        reached.push(first);
        while let Some(&i) = reached.get(next) {
            next += 1;
            for ((j, a), &b) in matrix.row(i).zip(&across[matrix.starts[i]..]) {
                if divisors[j] == 0.0 {
                    let agrees = agree([a, b], [diagonal[i], diagonal[j]], 0);
                    divisors[j] = divisors[i] * if agrees { 1.0 } else { b / a };
                    steps[j] = steps[i] + 1;
                    reached.push(j);
                }
                let of = |entry: f64, row: usize| entry / divisors[row];
                let pivots = [of(diagonal[i], i).abs(), of(diagonal[j], j).abs()];
                if !agree([of(a, i), of(b, j)], pivots, steps[i] + steps[j]) {
                    return None;
                }
            }
        }
    }
    let sizes = divisors.iter().map(|divisor: &f64| divisor.abs());
    let [least, most] = [f64::min, f64::max].map(|of| sizes.clone().reduce(of));
    (least? > f64::EPSILON * most?).then_some(divisors)
}

#[cfg(test)]
mod tests;
