//! Newton's methods of others, on assembled matrices with a sparse LU factorisation: faer's.

use std::time::{Duration, Instant};

use faer::{
    Mat,
    linalg::solvers::Solve,
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::solvers::{Lu, SymbolicLu},
    },
};
use hlcp_core::{Norms, Rows};

type Fallible<T> = Result<T, String>;

/// Which function's roots the method looks for.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Form {
    /// The modulus equation, without damping.
    Modulus,
    /// `z + r − √(z² + r²)` beside `A z − B r + q`: the Fischer–Burmeister–Newton–Schur method of
    /// T. Woloszynski, P. Podsiadlo and G. W. Stachowiak (Tribology Letters 58, 2015). In each
    /// column the unknown that the linearised function gives the better is eliminated; a step is
    /// halved until it decreases the sum of squares, ten times at most.
    FischerBurmeister,
}

/// What became of a solve.
pub(crate) struct Run {
    pub(crate) iterations: usize,
    pub(crate) reached: bool,
    /// `‖A z − B r + q‖₂`.
    pub(crate) residual: f64,
    pub(crate) z: Vec<f64>,
    pub(crate) r: Vec<f64>,
}

/// The most iterations.
const ITERATIONS: usize = 100;

/// Solves from `z = 2`, `r = 0`, or `x = e`, until `‖A z − B r + q‖₂ ≤ goal` for `z`, `r ≥ 0` of
/// which one is zero everywhere, or the time is up.
pub(crate) fn solve(
    form: Form,
    [a, b]: [&dyn Rows<f64>; 2],
    q: &[f64],
    goal: f64,
    longest: Duration,
) -> Fallible<Run> {
    let begin = Instant::now();
    let columns = Columns::new(a, b)?;
    let n = q.len();
    let (mut z, mut r) = (vec![2.0; n], vec![0.0; n]);
    for iterations in 0.. {
        let (full, void) = complementary(&z, &r);
        let left = Norms::of(&residual([a, b], q, &full, &void)).l2;
        let reached = left <= goal;
        if reached || iterations == ITERATIONS || begin.elapsed() >= longest {
            return Ok(Run { iterations, reached, residual: left, z: full, r: void });
        }
        match form {
            Form::Modulus => {
                let sides: Vec<[f64; 2]> =
                    z.iter().map(|&z| if z > 0.0 { [1.0, 0.0] } else { [0.0, -1.0] }).collect();
                let minus_q: Vec<f64> = q.iter().map(|q| -q).collect();
                let found = columns.solve(&sides, &minus_q)?;
                for (j, found) in found.into_iter().enumerate() {
                    // Negative ones of either kind change sides.
                    let is_z = (sides[j][0] > 0.0) == (found > 0.0);
                    (z[j], r[j]) = if is_z { (found.abs(), 0.0) } else { (0.0, found.abs()) };
                }
            }
            Form::FischerBurmeister => {
                let [dz, dr] = newton([a, b], &columns, q, [&z, &r])?;
                let merit = |z: &[f64], r: &[f64]| {
                    let balance = Norms::of(&residual([a, b], q, z, r)).l2;
                    let function: f64 =
                        z.iter().zip(r).map(|(z, r)| (z + r - z.hypot(*r)).powi(2)).sum();
                    balance * balance + function
                };
                let before = merit(&z, &r);
                let moved = |v: &[f64], d: &[f64], t: f64| -> Vec<f64> {
                    v.iter().zip(d).map(|(v, d)| v + t * d).collect()
                };
                let mut length = 1.0;
                while length > 1e-3
                    && merit(&moved(&z, &dz, length), &moved(&r, &dr, length))
                        > (1.0 - 1e-4 * length) * before
                {
                    length /= 2.0;
                }
                (z, r) = (moved(&z, &dz, length), moved(&r, &dr, length));
            }
        }
    }
    unreachable!("the limit ends the loop")
}

/// The nearest pair of vectors that are not negative and of which one is zero everywhere.
fn complementary(z: &[f64], r: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let side = |(&z, &r): (&f64, &f64)| if z > r { (z.max(0.0), 0.0) } else { (0.0, r.max(0.0)) };
    z.iter().zip(r).map(side).unzip()
}

/// `A z − B r + q`.
fn residual([a, b]: [&dyn Rows<f64>; 2], q: &[f64], z: &[f64], r: &[f64]) -> Vec<f64> {
    let (mut az, mut br) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    a.apply(z, &mut az);
    b.apply(r, &mut br);
    az.iter().zip(&br).zip(q).map(|((az, br), q)| az - br + q).collect()
}

/// The step `[δz, δr]` from `(z, r)`, by the Schur complement.
///
/// With `f = z + r − √(z² + r²)` and its derivatives `f_z` and `f_r`, `δr = −(f + f_z δz)/f_r`
/// where `f_r ≥ f_z`, and the reverse elsewhere.
fn newton(
    [a, b]: [&dyn Rows<f64>; 2],
    columns: &Columns,
    q: &[f64],
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
    let moved =
        |v: &[f64], d: &[f64]| -> Vec<f64> { v.iter().zip(d).map(|(v, d)| v + d).collect() };
    let mut rhs = residual([a, b], q, &moved(z, &dz), &moved(r, &dr));
    rhs.iter_mut().for_each(|rhs| *rhs = -*rhs);
    let found = columns.solve(&slopes, &rhs)?;
    for (j, s) in found.into_iter().enumerate() {
        let [of_a, of_b] = slopes[j];
        dz[j] += of_a * s;
        dr[j] -= of_b * s;
    }
    Ok([dz, dr])
}

/// The columns of A and B on the pattern of both, which is analysed once.
struct Columns {
    starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<[f64; 2]>,
    symbolic: SymbolicLu<usize>,
}

impl Columns {
    fn new(a: &dyn Rows<f64>, b: &dyn Rows<f64>) -> Fallible<Self> {
        let n = a.order();
        let mut entries: Vec<(usize, usize, [f64; 2])> = vec![];
        for i in 0..n {
            a.visit_row(i, &mut |j, a| entries.push((j, i, [a, 0.0])));
            b.visit_row(i, &mut |j, b| entries.push((j, i, [0.0, b])));
        }
        entries.sort_unstable_by_key(|&(j, i, _)| (j, i));
        entries.dedup_by(|next, kept| {
            let is_same = (next.0, next.1) == (kept.0, kept.1);
            if is_same {
                kept.2 = [kept.2[0] + next.2[0], kept.2[1] + next.2[1]];
            }
            is_same
        });
        let mut starts = vec![0; n + 1];
        entries.iter().for_each(|entry| starts[entry.0 + 1] += 1);
        (0..n).for_each(|j| starts[j + 1] += starts[j]);
        let rows: Vec<usize> = entries.iter().map(|entry| entry.1).collect();
        let values = entries.iter().map(|entry| entry.2).collect();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows);
        let symbolic = SymbolicLu::try_new(pattern).map_err(|error| format!("{error:?}"))?;
        Ok(Self { starts, rows, values, symbolic })
    }

    /// The solution for the matrix of the columns `αⱼAⱼ + βⱼBⱼ`.
    fn solve(&self, factors: &[[f64; 2]], rhs: &[f64]) -> Fallible<Vec<f64>> {
        let n = factors.len();
        let mut values = Vec::with_capacity(self.values.len());
        for (j, [of_a, of_b]) in factors.iter().enumerate() {
            let column = &self.values[self.starts[j]..self.starts[j + 1]];
            values.extend(column.iter().map(|[a, b]| of_a * a + of_b * b));
        }
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows);
        let matrix = SparseColMatRef::new(pattern, &values);
        let lu = Lu::try_new_with_symbolic(self.symbolic.clone(), matrix)
            .map_err(|error| format!("{error:?}"))?;
        let mut x = Mat::from_fn(n, 1, |i, _| rhs[i]);
        lu.solve_in_place(x.as_mut());
        Ok((0..n).map(|i| x[(i, 0)]).collect())
    }
}
