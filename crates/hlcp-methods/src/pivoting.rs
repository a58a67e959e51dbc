//! Principal pivoting in blocks, by elimination: for problems small enough for a full matrix.

use hlcp_core::{Hlcp, Norms, Rhs, Rows, Scalar};

use crate::{Clock, Jacobian, Method, Work, amg::Lu};

/// The order up to which it is worth a thought: a full matrix of 2 MB.
pub(crate) const SMALL: usize = 500;

/// Steps that may change many signs while they do not leave fewer wrong ones, and after which of
/// them Lemke's method is asked.
const PATIENCE: usize = 10;
const LEMKE: usize = 1;

/// The most exchanges of Lemke's method for an unknown.
const EXCHANGES: usize = 20;

/// Solves `J x = −γq` for the columns that some signs select, by elimination, and changes signs
/// that come out wrong: all of them, as Newton's method does, while every ten such steps leave
/// fewer of them. Where they do not, Lemke's method finds the signs, by the tableau; and if
/// rounding has spoilt those, the last wrong sign alone is changed from then on, until there are
/// fewer.
///
/// It ends after finitely many steps where `(A, B)` has the column W-property, which is that
/// solutions are unique for every `q`: `B⁻¹A` is a P-matrix then, and its LCP has the same bases.
/// Lemke's method ends there unless it meets a degenerate basis (C. E. Lemke, *Bimatrix equilibrium
/// points and mathematical programming*, Management Science 11 (1965)). So does changing the last
/// sign alone (K. G. Murty, *Note on a Bard-type scheme for solving the complementarity problem*,
/// Opsearch 11 (1974)), so that the number of wrong signs falls again, and it can do so at most n
/// times (J. J. Júdice and F. M. Pires, *A block principal pivoting algorithm for large-scale
/// strictly monotone linear complementarity problems*, Computers and Operations Research 21
/// (1994)).
#[derive(Debug, Clone)]
pub(crate) struct Pivoting<T, A, B> {
    problem: Hlcp<T, A, B>,
    /// The last answer, and 1 or −1 for the columns it was solved with.
    x: Vec<T>,
    signs: Vec<T>,
    lu: Lu<T>,
    /// The fewest signs that came out wrong, and the steps left to come to fewer.
    fewest: usize,
    patience: usize,
    f: Vec<T>,
    scratch: Vec<T>,
    steps: usize,
    /// A step in sweeps.
    worth: usize,
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Pivoting<T, A, B> {
    pub(crate) fn new(problem: Hlcp<T, A, B>) -> Self {
        let n = problem.order();
        let zeros = || vec![T::zero(); n];
        Self {
            worth: worth(&problem),
            x: zeros(),
            signs: zeros(),
            lu: Lu::zeros(n),
            fewest: usize::MAX,
            patience: PATIENCE,
            f: zeros(),
            scratch: vec![T::zero(); 2 * n],
            steps: 0,
            problem,
        }
    }

    /// Chooses the columns of the next step from `x`; whether they are others than before.
    fn choose(&mut self, x: &[T]) -> bool {
        let sign = |x: T| if x >= T::zero() { T::one() } else { -T::one() };
        if self.fewest == usize::MAX || x != self.x {
            self.signs.iter_mut().zip(x).for_each(|(signed, &x)| *signed = sign(x));
            (self.fewest, self.patience) = (x.len() + 1, PATIENCE);
            return true;
        }
        let count = x.iter().zip(&self.signs).filter(|&(&x, &signed)| sign(x) != signed).count();
        if count < self.fewest {
            (self.fewest, self.patience) = (count, PATIENCE);
        } else {
            self.patience = self.patience.saturating_sub(1);
        }
        let several = if self.patience > 0 { count } else { 1 };
        let wrong = self.signs.iter_mut().zip(x).rev().filter(|(signed, x)| sign(**x) != **signed);
        wrong.take(several).for_each(|(signed, _)| *signed = -*signed);
        count > 0
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Pivoting<T, A, B> {
    /// Overwrites the signs with those that Lemke's method ends with, if it ends in time.
    ///
    /// The tableau has a row for each basic variable, as an affine function of those that are not:
    /// to begin with `w = M z + e z₀ + B⁻¹q` with `M = B⁻¹A`, both columns in units of γ and Ω.
    fn lemke(&mut self, q: &[T], clock: &mut Clock<'_>) {
        let (n, width) = (q.len(), q.len() + 2);
        let column = |sign: T| vec![sign; n];
        // The columns of J for z alone, and for r alone, of which the inverse is wanted.
        let (all_z, all_r) = (column(T::one()), column(-T::one()));
        let jacobian = Jacobian::new(&self.problem, &all_r);
        self.lu.factorise(|i, each| jacobian.visit_row(i, each));
        let jacobian = Jacobian::new(&self.problem, &all_z);
        let mut tableau = vec![T::zero(); n * width];
        for (i, (line, &q)) in tableau.chunks_exact_mut(width).zip(q).enumerate() {
            jacobian.visit_row(i, |j, a| line[j] = a);
            line[n + 1] = self.problem.q_factor() * q;
        }
        let (mut rhs, mut solution) = (column(T::zero()), column(T::zero()));
        for j in (0..n).chain([n + 1]) {
            (0..n).for_each(|i| rhs[i] = tableau[i * width + j]);
            self.lu.solve(&rhs, &mut solution);
            (0..n).for_each(|i| tableau[i * width + j] = solution[i]);
        }
        (0..n).for_each(|i| tableau[i * width + n] = T::one());
        // Variables: zᵢ is i, z₀ is n, wᵢ is n + 1 + i.
        let mut basic: Vec<usize> = (n + 1..2 * n + 1).collect();
        let mut others: Vec<usize> = (0..=n).collect();
        let constant = |tableau: &[T], i: usize| tableau[i * width + n + 1];
        let smallest = |i: usize, j: usize| {
            if constant(&tableau, j) < constant(&tableau, i) { j } else { i }
        };
        let (mut row, mut at) = ((0..n).fold(0, smallest), n);
        for count in 0..EXCHANGES * n {
            if count.is_multiple_of(16) && clock.is_up() {
                return;
            }
            exchange(&mut tableau, width, [row, at]);
            std::mem::swap(&mut basic[row], &mut others[at]);
            let left = others[at];
            if left == n {
                for (i, sign) in self.signs.iter_mut().enumerate() {
                    *sign = if basic.contains(&i) { T::one() } else { -T::one() };
                }
                return;
            }
            // The counterpart of what has left enters, as far as no other turns negative.
            let enters = if left < n { left + n + 1 } else { left - n - 1 };
            at = others.iter().position(|&other| other == enters).unwrap_or(at);
            let mut bound = T::infinity();
            for (i, &own) in basic.iter().enumerate() {
                let slope = -tableau[i * width + at];
                let ratio = constant(&tableau, i) / slope;
                if slope > T::zero() && (ratio < bound || ratio == bound && own == n) {
                    (row, bound) = (i, ratio);
                }
            }
            if bound == T::infinity() {
                return;
            }
        }
    }
}

/// Lets the basic variable of a row and another one of a column change places.
fn exchange<T: Scalar>(tableau: &mut [T], width: usize, [row, at]: [usize; 2]) {
    let pivot = tableau[row * width + at].recip();
    let mut own = tableau[row * width..(row + 1) * width].to_vec();
    own.iter_mut().for_each(|a| *a *= -pivot);
    own[at] = pivot;
    for (i, line) in tableau.chunks_exact_mut(width).enumerate() {
        let factor = std::mem::replace(&mut line[at], T::zero());
        if i == row {
            line.copy_from_slice(&own);
        } else if factor != T::zero() {
            line.iter_mut().zip(&own).for_each(|(a, &own)| *a += factor * own);
        }
    }
}

/// The cost of an elimination, in walks over the rows: n³/3 multiplications side by side, of
/// which four take the time of one entry of a row.
pub(crate) fn worth<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> usize {
    let (n, mut entries) = (problem.order(), 0);
    for i in 0..n {
        problem.a().visit_row(i, &mut |_, _| entries += 1);
        problem.b().visit_row(i, &mut |_, _| entries += 1);
    }
    (n * n * n / (12 * entries.max(1))).max(1)
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Method<T> for Pivoting<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn restart(&mut self) {
        (self.fewest, self.steps) = (usize::MAX, 0);
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn work(&self) -> Option<Work> {
        Some(Work::sweeps(self.steps * (self.worth + 1)))
    }

    fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        self.problem.defect(q.entries(), x, &mut self.f, &mut self.scratch);
        Some(self.problem.norms(&self.f).divided_by(self.problem.gamma()))
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        self.problem.defect(q.entries(), x, &mut self.f, &mut self.scratch);
        let norms = self.problem.norms(&self.f).divided_by(self.problem.gamma());
        y.copy_from_slice(x);
        if clock.is_up() {
            return norms;
        }
        if self.choose(x) {
            if self.patience == LEMKE {
                self.lemke(q.entries(), clock);
            }
            let jacobian = Jacobian::new(&self.problem, &self.signs);
            self.lu.factorise(|i, each| jacobian.visit_row(i, each));
            self.steps += 1;
            let factor = self.problem.q_factor();
            self.f.iter_mut().zip(q.entries()).for_each(|(f, &q)| *f = factor * q);
            y.fill(T::zero());
        }
        // Where no sign is wrong this takes off what rounding has left.
        self.lu.solve(&self.f, &mut self.x);
        y.iter_mut().zip(&self.x).for_each(|(y, &s)| *y -= s);
        self.x.copy_from_slice(y);
        norms
    }
}

#[cfg(test)]
mod tests {
    use hlcp_core::{Identity, Omega, RowMajor, Tridiagonal};

    use super::*;
    use crate::Solver;

    /// Newton's method visits the active sets {1}, {2}, {3}, {1}, … of this P-matrix for ever.
    #[test]
    fn a_circle_of_active_sets_is_left() {
        let circle =
            RowMajor::new(3, vec![1.0_f64, 0.0, 1.5, 1.5, 1.0, 0.0, 0.0, 1.5, 1.0]).unwrap();
        let problem = Hlcp::new(&circle, Identity { order: 3 }, Omega::Uniform(1.0)).unwrap();
        let mut solver = Solver::new(Pivoting::new(problem));
        let outcome = solver.solve(&[-1.0; 3], crate::Options::from_x(&[1.0, -1.0, -1.0])).unwrap();
        assert!(outcome.converged(), "{outcome}");
        // z = 0.4 for all.
        assert!(solver.z().iter().all(|z| (z - 0.4).abs() < 1e-15), "{:?}", solver.z());
    }

    /// Skew parts that outweigh the rest send Newton's method round, of an order that Lemke's
    /// method settles.
    #[test]
    fn a_matrix_that_is_almost_skew_is_solved() {
        let n = 40;
        let entry = |i: usize, j: usize| match i.cmp(&j) {
            std::cmp::Ordering::Equal => 0.1,
            std::cmp::Ordering::Less => ((7 * i + 3 * j) as f64).sin(),
            std::cmp::Ordering::Greater => -((7 * j + 3 * i) as f64).sin(),
        };
        let entries: Vec<f64> = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        let a = RowMajor::new(n, entries).unwrap();
        let q: Vec<f64> = (0..n).map(|i| (2.0 * i as f64 + 1.0).cos() - 0.3).collect();
        let problem = Hlcp::new(&a, Identity { order: n }, Omega::Uniform(0.1)).unwrap();
        let mut solver = Solver::new(Pivoting::new(problem));
        let outcome = solver.solve(&q, crate::Limits::default()).unwrap();
        assert!(outcome.converged() && outcome.iterations <= 200, "{outcome}");
    }

    /// The signs of a strip under load are right after a few eliminations, from any start.
    #[test]
    fn a_strip_takes_a_few_eliminations() {
        let a = Tridiagonal::new(60, |_| [-1.0, 2.5, -1.0]).unwrap();
        let b = Tridiagonal::new(60, |_| [-1.0, 1.5, 0.0]).unwrap();
        let q: Vec<f64> = (0..60).map(|i| (0.2 * i as f64).sin()).collect();
        let problem = Hlcp::new(&a, &b, Omega::Uniform(2.0)).unwrap();
        let mut solver = Solver::new(Pivoting::new(problem));
        for start in [1.0, -1.0] {
            let from = [start; 60];
            let outcome = solver.solve(&q, crate::Options::from_x(&from)).unwrap();
            assert!(outcome.converged() && outcome.iterations <= 8, "{outcome}");
        }
    }
}
