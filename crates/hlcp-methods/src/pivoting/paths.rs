//! Lemke's method, the last way, along paths of vertices on which each step exchanges one column.
//!
//! Let `M` have one of the columns of `A` and `−BΩ` for each unknown, `v ≥ 0` be these unknowns,
//! and `g` a column that covers what is negative of them, so that with a large `t`
//!
//! ```text
//! M v + t g + γq = 0 ,   v ≥ 0 ,   t ≥ 0 .
//! ```
//!
//! At a vertex `v_k = 0`, and `g` stands in place of column `k`. The complement of `v_k` grows from
//! zero until another unknown is zero, whose complement is next, or `t` is: that is a solution.
//! Where nothing falls the path goes on for ever, and another one begins.
//!
//! Or `g` is the other column of an unknown that has both (Lemke and Howson), and `t` that one's
//! value: where the first of them is zero `g` comes in its place, and `t` is zero.
//!
//! A step exchanges one column, `M' = M E`, where `E` is the identity but for the column `M⁻¹a` of
//! the one that enters, and takes two solves with the factors of `M` some steps before and what has
//! been exchanged since. That no two unknowns are zero at once is supposed.

use hlcp_core::{Hlcp, Norms, Rhs, Rows, Scalar};

use super::{Full, inside::units, of_column, side};

/// A column of which less than this part is left by others depends on them.
const DEPENDS: f64 = 1e-11;

/// The steps of all paths, and the numbers in the factors that these read: that takes some seconds.
/// Most paths have one to three steps for each unknown, of games up to thirty. Where a path begins
/// all columns are factorised, which takes as long as a sixth of n steps.
const STEPS: usize = 20_000;
const NUMBERS: usize = 2_000_000_000;

/// The columns that are exchanged until all are factorised again.
const EXCHANGES: usize = 50;

/// Returns the steps of all paths of a problem of order `n`.
pub(super) fn steps(n: usize) -> usize {
    STEPS.min(NUMBERS / n.pow(2))
}

/// The paths of a problem, and where the present one is.
#[derive(Debug, Clone)]
pub(super) struct Paths<T> {
    /// The rows of A, each followed by that of −BΩ, and γq.
    rows: Vec<Vec<T>>,
    load: Vec<T>,
    /// The units of z, and then of r, in which the columns have about one sum.
    units: Vec<T>,
    free: Vec<T>,
    /// The paths that have been begun, and the steps that are left for all and that this one, which
    /// may go in a circle by rounding, is to leave for others.
    begun: usize,
    left: usize,
    kept: usize,
    at: Option<Vertex<T>>,
}

/// A vertex of a path.
#[derive(Debug, Clone)]
struct Vertex<T> {
    /// 1 for columns of A, −1 for those of −BΩ.
    d: Vec<T>,
    /// g, and the unknown that it stands for; `n` for none.
    cover: Vec<T>,
    k: usize,
    basis: Basis<T>,
    /// γq, or next to it.
    load: Vec<T>,
}

/// The factors of the columns at a vertex.
#[derive(Debug, Clone)]
struct Basis<T> {
    factors: Full<T>,
    /// The place of the column of each unknown, and that of `g` for the one it stands for.
    places: Vec<usize>,
    /// The places whose columns have been exchanged since, and E's columns.
    exchanged: Vec<(usize, Vec<T>)>,
}

/// How the unknowns at a vertex grow with the next one, and the first that falls to zero.
type Step<T> = (Vec<T>, usize);

impl<T: Scalar> Basis<T> {
    /// Returns −M⁻¹ times a right-hand side; nothing if it is not finite.
    fn solve(&mut self, rhs: &[T]) -> Option<Vec<T>> {
        let mut v = vec![T::zero(); rhs.len()];
        self.factors.solve(rhs, &mut v);
        for (at, column) in &self.exchanged {
            let by = v[*at] / column[*at];
            v.iter_mut().zip(column).for_each(|(v, &e)| *v -= e * by);
            v[*at] = by;
        }
        let v: Vec<T> = self.places.iter().map(|&at| -v[at]).collect();
        v.iter().all(|v| v.is_finite()).then_some(v)
    }

    /// Puts another column, −M times `v`, in the place of unknown `i`.
    fn exchange(&mut self, i: usize, v: &[T]) {
        let mut column = vec![T::zero(); v.len()];
        v.iter().zip(&self.places).for_each(|(&v, &at)| column[at] = -v);
        self.exchanged.push((self.places[i], column));
    }
}

impl<T: Scalar> Paths<T> {
    /// Those of a problem with these free unknowns; `2n²` numbers and some vectors.
    pub(super) fn new<A: Rows<T>, B: Rows<T>>(
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        free: &[T],
    ) -> Self {
        let n = free.len();
        let mut rows = vec![vec![T::zero(); 2 * n]; n];
        for (i, row) in rows.iter_mut().enumerate() {
            problem.a().visit_row(i, &mut |j, a| row[j] += a);
            problem.b().visit_row(i, &mut |j, b| row[n + j] -= b * problem.omega().entry(j));
        }
        let (_, [of_a, of_b]) = units(problem);
        Self {
            rows,
            load: q.entries().iter().map(|&q| problem.q_factor() * q).collect(),
            units: [of_a, of_b].concat(),
            free: free.to_vec(),
            begun: 0,
            left: steps(n),
            kept: 0,
            at: None,
        }
    }

    /// Takes some steps, on the path where it is and on those that begin where this one has none,
    /// and overwrites `y` with the solution at the end of one; returns whether steps are left.
    pub(super) fn follow(&mut self, y: &mut [T]) -> bool {
        let (x, until) = (y.to_vec(), self.left.saturating_sub(EXCHANGES));
        while self.left > until && *y == *x {
            self.left -= 1;
            self.at = match self.at.take().filter(|_| self.left > self.kept) {
                Some(vertex) => self.step(vertex, y),
                None => {
                    self.left = self.left.saturating_sub(y.len() / 6);
                    self.kept = self.left / 2;
                    let k = self.begun / 2;
                    self.begun += 1;
                    if self.begun % 2 == 1 { self.cover(k, y) } else { self.double(k) }
                }
            };
        }
        self.left > 0
    }

    /// Begins where all unknowns but one are positive, with columns that are independent: first
    /// with those of `BΩ`, then of `A`, and then with others. Overwrites `y` with the solution
    /// where `t` is not needed; there is no vertex then, or if the columns are singular.
    fn cover(&self, begun: usize, y: &mut [T]) -> Option<Vertex<T>> {
        let n = y.len();
        let is_up = |i: usize| ((begun * (i + 1)) as f64).sin() > 0.0;
        let of_a = |i: usize| self.is_free(i) || begun == 1 || begun > 1 && is_up(i);
        let begin = |d: Vec<T>| {
            let mut basis = self.basis(&d, &[], n, (0..n).collect());
            let v = basis.solve(&self.load).filter(|_| !basis.factors.is_singular())?;
            Some((d, basis, v))
        };
        let wanted = (0..n).map(|i| side(of_a(i))).collect();
        let (d, mut basis, v) = begin(wanted).or_else(|| begin(self.independent(of_a)?))?;
        // With g = −M u, v grows by u with t. The sines of whole numbers have no relations: before
        // t = 0 no two become zero at once.
        let u = |i: usize| {
            let unit = self.units[of(d[i], i, n)];
            let u = unit * T::of(2.0 + (((begun + 1) * (i + 1)) as f64).sin());
            if self.is_free(i) { T::zero() } else { u }
        };
        let u: Vec<T> = (0..n).map(u).collect();
        let part = |i: usize| (v[i] / u[i]).wide();
        let bound = (0..n).filter(|&i| !self.is_free(i));
        let least = bound.min_by(|&i, &j| part(i).total_cmp(&part(j)));
        let Some(k) = least.filter(|&k| v[k] < T::zero()) else {
            self.recover(&d, &v, y);
            return None;
        };
        let times = |row: &Vec<T>| (0..n).fold(T::zero(), |g, j| g - row[of(d[j], j, n)] * u[j]);
        let cover = self.rows.iter().map(times).collect();
        basis.exchange(k, &u);
        Some(Vertex { d, cover, k, basis, load: self.load.clone() })
    }

    /// Begins from `z = 0` with a z of `double` that makes `r` positive where it depends on that,
    /// and then with the z of which `r` is zero, until none is negative. Of games with positive
    /// costs two suffice; nothing is returned where `r` may become smaller.
    fn double(&self, double: usize) -> Option<Vertex<T>> {
        let n = self.free.len();
        if double >= n {
            return None;
        }
        let mut d: Vec<T> = (0..n).map(|i| side(self.is_free(i))).collect();
        let mut basis = self.basis(&d, &[], n, (0..n).collect());
        // Lest two become zero at once.
        let near = |i: usize| T::epsilon().sqrt() * T::of(((i + 1) as f64).sin());
        let load = self.load.iter().enumerate().map(|(i, &q)| q + q * near(i)).collect::<Vec<T>>();
        let mut r = basis.solve(&load)?;
        let mut k = double;
        while r.iter().any(|&r| r < T::zero()) {
            if d[k] > T::zero() {
                return None;
            }
            let dr = basis.solve(&self.column(k))?;
            if k != double {
                d[k] = T::one();
            }
            let is_kept = |i: usize| i == double || d[i] < T::zero() || dr[i] == T::zero();
            if !(0..n).all(|i| dr[i] >= T::zero() && is_kept(i)) {
                return None;
            }
            let length = |i: usize| -r[i] / dr[i];
            let short = (0..n).filter(|&i| r[i] < T::zero() && dr[i] > T::zero());
            k = short.max_by(|&i, &j| length(i).wide().total_cmp(&length(j).wide()))?;
            let by = length(k);
            r.iter_mut().zip(&dr).for_each(|(r, &dr)| *r += by * dr);
            r[k] = T::zero();
        }
        let cover = self.column(double);
        let basis = self.basis(&d, &cover, k, basis.places);
        Some(Vertex { d, cover, k, basis, load })
    }

    /// Takes a step to the next vertex; nothing is returned at the end, where `t` is 0 and `y` is
    /// overwritten with the solution, and where the path has none.
    fn step(&self, vertex: Vertex<T>, y: &mut [T]) -> Option<Vertex<T>> {
        let Vertex { mut d, cover, k, mut basis, load } = vertex;
        let column = &self.column(of(-d[k], k, d.len()));
        let mut step = self.first(&mut basis, [&load, column], k);
        // What may be rounding is not to decide.
        let clear = T::epsilon().sqrt();
        let is_clear = |(dv, first): &Step<T>| -dv[*first] > clear * T::of(Norms::of(dv).linf);
        let begun = basis.exchanged.len();
        if begun >= EXCHANGES || begun > 0 && !step.as_ref().is_some_and(is_clear) {
            basis = self.basis(&d, &cover, k, basis.places);
            step = self.first(&mut basis, [&load, column], k);
        }
        let (dv, first) = step?;
        d[k] = -d[k];
        if first != k {
            basis.exchange(first, &dv);
            basis.places.swap(k, first);
            return Some(Vertex { d, cover, k: first, basis, load });
        }
        let v = basis.solve(&self.load)?;
        let length = v[k].max(T::zero()) / -dv[k];
        let mut end: Vec<T> = v.iter().zip(&dv).map(|(&v, &dv)| v + length * dv).collect();
        end[k] = length;
        // The columns alone, if they are regular, have what rounding has taken from a large t.
        let mut basis = self.basis(&d, &[], v.len(), basis.places);
        self.recover(&d, &basis.solve(&self.load).unwrap_or(end), y);
        None
    }

    /// Returns how the unknowns grow with that of a column, and the one that is zero first; nothing
    /// if none falls.
    fn first(&self, basis: &mut Basis<T>, [load, column]: [&[T]; 2], k: usize) -> Option<Step<T>> {
        let (v, dv) = (basis.solve(load)?, basis.solve(column)?);
        let falls = |i: &usize| !self.is_free(*i) && dv[*i] < T::zero();
        let length = |i: usize| v[i].max(T::zero()) / -dv[i];
        let first = (0..v.len())
            .filter(falls)
            .min_by(|&i, &j| length(i).wide().total_cmp(&length(j).wide()))?;
        // Of those that are equal but for rounding t, the k-th: others may be zero with it.
        let equal = T::one() + T::epsilon().sqrt();
        let first = if falls(&k) && length(k) <= equal * length(first) { k } else { first };
        Some((dv, first))
    }

    /// Factorises the columns that are chosen, in these places, with `g` for that of unknown `k`.
    fn basis(&self, d: &[T], cover: &[T], k: usize, places: Vec<usize>) -> Basis<T> {
        let n = d.len();
        let row = |i: usize, each: &mut dyn FnMut(usize, T)| {
            for (j, &place) in places.iter().enumerate() {
                each(place, if j == k { cover[i] } else { self.rows[i][of(d[j], j, n)] });
            }
        };
        let mut factors = Full::new();
        factors.factorise(n, row);
        Basis { factors, places, exchanged: vec![] }
    }

    /// Chooses columns that are independent: of `A` for free unknowns, and for the others of `A`
    /// where that is wanted and else of `BΩ`, but the other one where these depend on those before.
    /// Returns 1 for those of `A` and −1 for those of `BΩ`; nothing if that leaves some that depend
    /// on others. Takes about n³ multiplications.
    fn independent(&self, of_a: impl Fn(usize) -> bool) -> Option<Vec<T>> {
        let n = self.free.len();
        let (first, bound): (Vec<usize>, Vec<_>) = (0..n).partition(|&j| self.is_free(j));
        let place = |&j: &usize, is_other: bool| if of_a(j) == is_other { n + j } else { j };
        let order = first
            .into_iter()
            .chain(bound.iter().map(|j| place(j, false)))
            .chain(bound.iter().map(|j| place(j, true)));
        let mut d = vec![T::zero(); n];
        // Gauss's elimination, by columns: a column that is taken has a row, and parts of it that
        // take that row from those to come.
        let mut taken: Vec<(usize, Vec<f64>)> = vec![];
        let mut is_open = vec![true; n];
        for at in order {
            if d[at % n] != T::zero() {
                continue;
            }
            let mut column: Vec<f64> = self.column(at).iter().map(|a| a.wide()).collect();
            let largest = |column: &[f64], of: &dyn Fn(usize) -> bool| {
                (0..n).filter(|&i| of(i)).fold((0, 0.0), |(row, most): (usize, f64), i| {
                    if column[i].abs() > most { (i, column[i].abs()) } else { (row, most) }
                })
            };
            let (_, size) = largest(&column, &|_| true);
            for (row, parts) in &taken {
                let by = column[*row];
                if by != 0.0 {
                    column.iter_mut().zip(parts).for_each(|(a, part)| *a -= by * part);
                }
            }
            let (row, left) = largest(&column, &|i| is_open[i]);
            if left > DEPENDS * size {
                is_open[row] = false;
                let part =
                    |(&a, &is_open): (&f64, &bool)| if is_open { a / column[row] } else { 0.0 };
                taken.push((row, column.iter().zip(&is_open).map(part).collect()));
                d[at % n] = side(at < n);
            }
        }
        d.iter().all(|&d| d != T::zero()).then_some(d)
    }

    /// Overwrites `y` with the `x` of which `v` has the parts.
    fn recover(&self, d: &[T], v: &[T], y: &mut [T]) {
        for (i, y) in y.iter_mut().enumerate() {
            let x = if self.is_free(i) { v[i] } else { d[i] * v[i].max(T::zero()) };
            *y = of_column(x / T::of(2.0), self.free[i]);
        }
    }

    fn column(&self, at: usize) -> Vec<T> {
        self.rows.iter().map(|row| row[at]).collect()
    }

    fn is_free(&self, i: usize) -> bool {
        self.free[i] > T::zero()
    }
}

/// Returns the place of the column that `d` chooses for unknown `i` of `n`.
fn of<T: Scalar>(d: T, i: usize, n: usize) -> usize {
    if d > T::zero() { i } else { n + i }
}

#[cfg(test)]
mod tests {
    use hlcp_core::{Csr, Identity, Omega};
    use nalgebra::{DMatrix, DVector};
    use proptest::{collection::vec, prelude::*};

    use super::*;
    use crate::{Limits, Pivoting, Solver, method::measure, testing::csr};

    /// Goes a path to its end, by default the one from `x = 0` with a cover; returns what is left
    /// of the residual, as a part of ‖q‖, and the vertices.
    fn left(
        a: impl Rows<f64>,
        b: impl Rows<f64>,
        q: &[f64],
        double: Option<usize>,
    ) -> (f64, usize) {
        let n = q.len();
        let pivoting = Pivoting::new(Hlcp::new(a, b, Omega::Uniform(1.0)).unwrap()).unwrap();
        let q = Rhs::new(q).unwrap();
        let (mut x, mut vertices) = (vec![0.0; n], 0);
        let paths = Paths::new(&pivoting.problem, &q, &pivoting.free);
        let mut vertex = match double {
            Some(double) => paths.double(double),
            None => paths.cover(0, &mut x),
        };
        while let Some(at) = vertex {
            vertices += 1;
            assert!(vertices <= STEPS, "goes in a circle");
            vertex = paths.step(at, &mut x);
        }
        let (mut f, mut scratch) = (vec![0.0; n], vec![0.0; 2 * n]);
        let norms = measure(&pivoting.problem, &q, &x, &mut f, &mut scratch);
        (norms.l2 / q.norms().l2, vertices)
    }

    fn sparse(matrix: &DMatrix<f64>) -> Csr<'static, f64> {
        csr(matrix.row_iter().map(|row| row.into_iter().copied().enumerate().collect::<Vec<_>>()))
    }

    /// A matrix of these entries, of which a part is not zero.
    fn matrix(n: usize, entries: &[(f64, f64)], part: f64) -> DMatrix<f64> {
        DMatrix::from_iterator(
            n,
            n,
            (0..n * n).map(|k| {
                let (entry, draw) = entries[k % entries.len()];
                if draw < part { entry } else { 0.0 }
            }),
        )
    }

    fn of_whole(costs: Vec<(u8, u8)>) -> Vec<(f64, f64)> {
        costs.into_iter().map(|(first, second)| (first.into(), second.into())).collect()
    }

    proptest! {
        /// Strictly semimonotone, with B of any kind that is regular: there are solutions for every
        /// q, of which no other way need find one; also of whole numbers, where many are the same.
        #[test]
        fn what_is_nonnegative_is_solved(
            n in 1..24_usize,
            is_whole in any::<bool>(),
            entries in vec((0.0..1.0_f64, 0.0..1.0_f64), 577),
            others in vec((-1.0..1.0_f64, 0.0..1.0_f64), 577),
            diagonal in vec(0.1..1.0_f64, 24),
            q in vec(-1.0..1.0_f64, 24),
            part in 0.1..1.0_f64,
        ) {
            let is = |x: f64| if is_whole { (2.0 * x).round() } else { x };
            let on = DMatrix::from_diagonal(&DVector::from_column_slice(&diagonal[..n]));
            let m = matrix(n, &entries, part).map(is) + on.map(|x| is(x).max(x));
            let b = matrix(n, &others, part).map(is) + DMatrix::identity(n, n) * (2 * n + 1) as f64;
            let mut q = DVector::from_column_slice(&q[..n]).map(is);
            q[0] = -1.0;
            let q = &b * q;
            let (left, vertices) = left(sparse(&(&b * m)), sparse(&b), q.as_slice(), None);
            prop_assert!(left <= 1e-10, "{left} after {vertices} vertices");
        }

        /// The least Σ|Xb − y|, of polynomials b with free coefficients and free multipliers, as
        /// the equations Xb + u − v = y with u, v ≥ 0: columns of B alone depend on each other.
        #[test]
        fn fits_of_the_least_sum_are_found(
            points in 4..16_usize,
            degree in 1..4_usize,
            values in vec(-1.0..1.0_f64, 16),
        ) {
            let place = |i: usize| 2.0 * i as f64 / (points as f64 - 1.0) - 1.0;
            let x = DMatrix::from_fn(points, degree, |i, k| place(i).powi(k as i32));
            let n = degree + 3 * points;
            let [u, v, multipliers] = [0, 1, 2].map(|k| degree + k * points);
            let one = DMatrix::identity(points, points);
            let mut a = DMatrix::zeros(n, n);
            for (at, columns) in [(0, &x), (u, &one), (v, &-&one)] {
                a.view_mut((multipliers, at), columns.shape()).copy_from(columns);
                let rows = -columns.transpose();
                a.view_mut((at, multipliers), rows.shape()).copy_from(&rows);
            }
            let mut b = DMatrix::identity(n, n);
            for free in (0..degree).chain(multipliers..n) {
                b.set_column(free, &a.column(free));
            }
            let mut q = vec![0.0; n];
            q[u..multipliers].fill(1.0);
            (0..points).for_each(|i| q[multipliers + i] = -values[i]);
            let (left, vertices) = left(sparse(&a), sparse(&b), &q, None);
            prop_assert!(left <= 1e-10, "{left} after {vertices} vertices");
        }

        /// Whichever unknown of a game has both columns (Lemke and Howson), also where many costs
        /// are the same. Elimination follows one of these paths, where those that cover leave for
        /// ever.
        #[test]
        fn games_of_two_have_equilibria(
            rows in prop_oneof![3 => 1..6_usize, 1 => 6..30_usize],
            columns in prop_oneof![3 => 1..6_usize, 1 => 6..30_usize],
            costs in prop_oneof![
                vec((1..6_u8, 1..6_u8), 25).prop_map(of_whole),
                vec((1.0..2.0_f64, 1.0..2.0_f64), 900),
            ],
            double in any::<prop::sample::Index>(),
        ) {
            let n = rows + columns;
            let mut a = DMatrix::zeros(n, n);
            for (i, j) in (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
                let (first, second) = costs[(i * columns + j) % costs.len()];
                a[(i, rows + j)] = first;
                a[(rows + j, i)] = second;
            }
            let (double, q) = (double.index(n), vec![-1.0; n]);
            let (left, vertices) = left(sparse(&a), Identity { order: n }, &q, Some(double));
            prop_assert!(left <= 1e-10, "{double}: {left} after {vertices} vertices");
            let pivoting = Pivoting::new(Hlcp::lcp(&a).unwrap()).unwrap();
            let outcome = Solver::new(pivoting).solve(&q, Limits::default()).unwrap();
            prop_assert!(outcome.converged(), "{outcome}");
        }

        /// Some columns of B are sums of others.
        #[test]
        fn columns_that_are_chosen_are_independent(
            n in 2..20_usize,
            entries in vec((-1.0..1.0_f64, 0.0..1.0_f64), 401),
            which in vec(any::<bool>(), 20),
        ) {
            let mut b = matrix(n, &entries, 0.5) + DMatrix::identity(n, n) * n as f64;
            for j in (1..n).filter(|&j| which[j]) {
                let sum = b.column(0) + b.column(j - 1);
                b.set_column(j, &sum);
            }
            let a = DMatrix::identity(n, n);
            let problem = Hlcp::new(sparse(&a), sparse(&b), Omega::Uniform(1.0)).unwrap();
            let q = vec![1.0; n];
            let paths = Paths::new(&problem, &Rhs::new(&q).unwrap(), &vec![0.0; n]);
            let d = paths.independent(|_| false).unwrap();
            let mut chosen = b.clone();
            for j in (0..n).filter(|&j| d[j] > 0.0) {
                chosen.set_column(j, &a.column(j));
            }
            let values = chosen.singular_values();
            prop_assert!(values.min() > 1e-9 * values.max(), "{values}");
            let rank = b.singular_values().iter().filter(|&&value| value > 1e-9).count();
            prop_assert_eq!(d.iter().filter(|&&d| d < 0.0).count(), rank);
        }
    }

    /// No path finds a solution where there is none, or begins from unknowns beyond the last.
    #[test]
    fn all_paths_come_to_an_end_without_a_solution() {
        for (n, sign) in [(1, -1.0), (2, -1.0), (3, -1.0), (2, 1.0)] {
            let a = DMatrix::from_element(n, n, -1.0);
            let problem =
                Hlcp::new(sparse(&a), Identity { order: n }, Omega::Uniform(1.0)).unwrap();
            let (load, free, mut x) = (vec![sign; n], vec![0.0; n], vec![0.0; n]);
            let mut paths = Paths::new(&problem, &Rhs::new(&load).unwrap(), &free);
            while paths.follow(&mut x) {}
            assert_eq!(paths.left, 0);
            assert!(sign > 0.0 || x == vec![0.0; n], "{x:?}");
        }
    }

    /// The least cᵀx in a cube that is squeezed so that paths along its edges are long (Klee and
    /// Minty): x = 5ᵏ eₖ.
    #[test]
    fn squeezed_cubes_have_an_end() {
        for k in 2..12_usize {
            let entry = |i: usize, j: usize| match i.cmp(&j) {
                std::cmp::Ordering::Greater => 2_f64.powi((i - j + 1) as i32),
                std::cmp::Ordering::Equal => 1.0,
                std::cmp::Ordering::Less => 0.0,
            };
            let g = DMatrix::from_fn(k, k, entry);
            let mut a = DMatrix::zeros(2 * k, 2 * k);
            a.view_mut((0, k), (k, k)).copy_from(&g.transpose());
            a.view_mut((k, 0), (k, k)).copy_from(&-g);
            let costs = (0..k).map(|i| -2_f64.powi((k - 1 - i) as i32));
            let q: Vec<f64> = costs.chain((1..=k).map(|i| 5_f64.powi(i as i32))).collect();
            let (left, vertices) = left(sparse(&a), Identity { order: 2 * k }, &q, None);
            assert!(left <= 1e-15, "{k}: {left} after {vertices} vertices");
        }
    }
}
