//! An attack on every method: small random problems of which many have no solution or several, held
//! against exact arithmetic. No answer may be wrong, whatever the status says.
//!
//! The gate makes some 20,000 runs. A million, with a table of counts:
//!
//! ```text
//! HLCP_ATTACK_RUNS=1000000 cargo test --release --test attack -- every_method --nocapture
//! ```
//!
//! Problem `k` grows from the seed `s + k` alone, where `s` is `HLCP_ATTACK_SEED` or [`SEED`]. A
//! failure names the problem's own seed, so `HLCP_ATTACK_SEED=<seed> HLCP_ATTACK_RUNS=1` runs that
//! problem and no other, and prints the problem as an expression for a test in this file:
//! [`faults`] takes it.

use std::{
    collections::BTreeMap,
    fmt,
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
};

use hlcp_core::{
    Aor, Diagonal, Error, Hlcp, LinearOperator, Omega, Rows, Scalar, VaryingFivePoint,
};
use hlcp_methods::{
    AdaptiveSor, Anderson, Auto, Cycle, FullMultigrid, Limits, Method, Mms, Multigrid, Named,
    Newton, Options, Parameters, Progress, Solver, Ssor, Tmms, TridiagonalPart,
};
use num_rational::{BigRational, Ratio};
use num_traits::{Signed, ToPrimitive, Zero};

/// The seed of the first problem, unless the environment has another.
const SEED: u64 = 20_250_807;

/// The runs of the gate.
const RUNS: usize = 20_000;

/// The largest exact residual of an answer that is said to have converged.
///
/// In double precision the default tolerance. In single precision, whose tolerance depends on
/// rounding, a thousandth of ‖q‖.
fn asked(precision: Precision, q_norm: f64) -> f64 {
    match precision {
        Precision::Double => 1e-10 * q_norm,
        Precision::Single => 1e-3 * q_norm,
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Precision {
    Single,
    Double,
}

// Problems.

type Matrix = Vec<Vec<i64>>;

/// A problem in small integers, which both precisions hold exactly, and how it is to be solved.
#[derive(Debug, Clone, PartialEq)]
struct Case {
    a: Matrix,
    b: Matrix,
    q: Vec<i64>,
    /// The power of two that multiplies q.
    power: i32,
    /// Ω; where there is none, the ratio of the diagonals.
    omega: Option<Vec<i64>>,
    gamma: i64,
    exchanged: bool,
    /// The length of a row of the grid, where the operators are posed as five-point ones.
    grid: Option<usize>,
    starts: Vec<Vec<i64>>,
    iterations: usize,
}

impl Case {
    /// The problem as one types it, rows parted by semicolons, with the defaults of the command
    /// line.
    fn typed(a: &str, b: &str, q: &str) -> Self {
        let row = |text: &str| -> Vec<i64> {
            text.split_whitespace().map(|entry| entry.parse().expect("an integer")).collect()
        };
        let matrix = |text: &str| text.split(';').map(row).collect();
        let (a, b, q): (Matrix, Matrix, _) = (matrix(a), matrix(b), row(q));
        let starts = vec![vec![1; q.len()]];
        let (power, omega, gamma, exchanged, grid, iterations) = (0, None, 1, false, None, 2000);
        Self { a, b, q, power, omega, gamma, exchanged, grid, starts, iterations }
    }

    /// q as it is posed.
    fn q(&self) -> Vec<f64> {
        self.q.iter().map(|&q| q as f64 * 2_f64.powi(self.power)).collect()
    }

    fn is_tridiagonal(&self) -> bool {
        let near = |(i, j, entry): (usize, usize, i64)| i.abs_diff(j) <= 1 || entry == 0;
        entries(&self.a).chain(entries(&self.b)).all(near)
    }

    /// The names of the methods it is for.
    fn methods(&self) -> Vec<&'static str> {
        let mut names = METHODS.split(' ').collect::<Vec<_>>();
        if self.is_tridiagonal() {
            names.extend(ON_LINES.split(' '));
        }
        if self.grid.is_some() {
            names.extend(ON_GRIDS.split(' '));
        }
        names
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = |row: &Vec<i64>| row.iter().map(i64::to_string).collect::<Vec<_>>().join(" ");
        let matrix = |matrix: &Matrix| matrix.iter().map(row).collect::<Vec<_>>().join("; ");
        let Self { power, gamma, exchanged, grid, starts, iterations, .. } = self;
        let omega = match &self.omega {
            None => "None".to_owned(),
            Some(omega) => format!("Some(vec!{omega:?})"),
        };
        let starts = starts.iter().map(|x| format!("vec!{x:?}")).collect::<Vec<_>>().join(", ");
        write!(
            f,
            "Case {{ power: {power}, omega: {omega}, gamma: {gamma}, exchanged: {exchanged}, \
             grid: {grid:?}, starts: vec![{starts}], iterations: {iterations}, \
             ..Case::typed({:?}, {:?}, {:?}) }}",
            matrix(&self.a),
            matrix(&self.b),
            row(&self.q)
        )
    }
}

/// The entries of a matrix with their rows and columns.
fn entries(matrix: &Matrix) -> impl Iterator<Item = (usize, usize, i64)> {
    let n = matrix.len();
    (0..n * n).map(move |k| (k / n, k % n, matrix[k / n][k % n]))
}

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): streams from neighbouring seeds are unrelated.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ bits >> 31
    }

    /// An integer from `low` to `high`, both included.
    fn between(&mut self, low: i64, high: i64) -> i64 {
        let count = (high - low + 1) as u64;
        low + ((self.next() >> 11) % count) as i64
    }

    fn index(&mut self, count: usize) -> usize {
        self.between(0, count as i64 - 1) as usize
    }

    /// True once in `count` times.
    fn once_in(&mut self, count: usize) -> bool {
        self.index(count) == 0
    }

    fn vector(&mut self, n: usize, low: i64, high: i64) -> Vec<i64> {
        (0..n).map(|_| self.between(low, high)).collect()
    }

    /// A matrix whose entries beside the diagonal, where the pattern has any, are zero once in
    /// three times.
    fn matrix(&mut self, pattern: &Pattern, on: [i64; 2], off: [i64; 2]) -> Matrix {
        let entry = |i: usize, j: usize| match (i == j, pattern.has(i, j)) {
            (true, _) => self.between(on[0], on[1]),
            (_, true) if !self.once_in(3) => self.between(off[0], off[1]),
            _ => 0,
        };
        square(pattern.n, entry)
    }

    /// A matrix with each diagonal entry above the other absolute values of its row.
    fn dominant(&mut self, pattern: &Pattern) -> Matrix {
        let mut matrix = self.matrix(pattern, [0, 0], [-2, 2]);
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] = row.iter().map(|entry| entry.abs()).sum::<i64>() + self.between(1, 3);
        }
        matrix
    }

    /// A singular M-matrix: its rows, multiplied by `weights`, sum to zero, and no entry beside the
    /// diagonal is positive.
    fn singular(&mut self, pattern: &Pattern, weights: &[i64]) -> Matrix {
        let mut matrix = self.matrix(pattern, [0, 0], [-2, -1]);
        for j in 0..pattern.n {
            let sum: i64 = (0..pattern.n).map(|i| weights[i] * matrix[i][j]).sum();
            for (i, row) in matrix.iter_mut().enumerate() {
                row[j] = if i == j { -sum } else { weights[j] * row[j] };
            }
            // A column that was empty stays one.
        }
        matrix
    }

    /// Non-negative integers of which one in each place is zero, and the q that they solve.
    fn plant(&mut self, a: &Matrix, b: &Matrix) -> Planted {
        let x = self.vector(a.len(), -3, 3);
        let z: Vec<i64> = x.iter().map(|&x| x.max(0)).collect();
        let r: Vec<i64> = x.iter().map(|&x| (-x).max(0)).collect();
        let q = (0..x.len()).map(|i| dot(&b[i], &r) - dot(&a[i], &z)).collect();
        Planted { z, r, q }
    }
}

struct Planted {
    z: Vec<i64>,
    r: Vec<i64>,
    q: Vec<i64>,
}

fn dot(u: &[i64], v: &[i64]) -> i64 {
    u.iter().zip(v).map(|(u, v)| u * v).sum()
}

fn square(n: usize, mut entry: impl FnMut(usize, usize) -> i64) -> Matrix {
    (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
}

fn identity(n: usize) -> Matrix {
    square(n, |i, j| i64::from(i == j))
}

/// Where a matrix may have entries: everywhere, or at a point's neighbours on a grid.
#[derive(Debug, Clone, Copy)]
struct Pattern {
    n: usize,
    grid: Option<usize>,
}

impl Pattern {
    fn has(&self, i: usize, j: usize) -> bool {
        let beside = |nx: usize| i.abs_diff(j) == 1 && i / nx == j / nx || i.abs_diff(j) == nx;
        i == j || self.grid.is_none_or(beside)
    }
}

/// The problem that grows from a seed.
fn grown(seed: u64) -> Case {
    let random = &mut Random(seed);
    let n = 1 + random.index(5);
    let kind = random.index(KINDS);
    let grid =
        (random.once_in(3) && kind != 7).then(|| if n == 4 { 2 + 2 * random.index(2) } else { n });
    let pattern = &Pattern { n, grid };
    let (a, b, q) = posed(random, pattern, kind);
    let omega = match random.index(4) {
        0 => Some(vec![random.between(1, 4); n]),
        1 => Some(random.vector(n, 1, 4)),
        _ if (0..n).all(|i| a[i][i] > 0 && b[i][i] > 0) => None,
        _ => Some(vec![1; n]),
    };
    let mut starts = vec![vec![1; n]];
    if random.once_in(3) {
        let size = [4, 4, 4, 1 << 20][random.index(4)];
        starts.push(random.vector(n, -size, size));
    }
    Case {
        power: [0, 0, 0, 0, 20, -10][random.index(6)],
        gamma: random.between(1, 2),
        exchanged: random.once_in(6),
        iterations: [300, 300, 300, 300, 300, 2000][random.index(6)],
        a,
        b,
        q,
        omega,
        grid,
        starts,
    }
}

/// The kinds of problems that [`posed`] makes.
const KINDS: usize = 11;

/// The matrices and q of a problem of one kind.
fn posed(random: &mut Random, pattern: &Pattern, kind: usize) -> (Matrix, Matrix, Vec<i64>) {
    let n = pattern.n;
    let weights = random.vector(n, 1, 5);
    let any = [1, 5];
    let (a, mut b) = match kind {
        // With one solution, mostly.
        0 | 1 => (random.dominant(pattern), random.dominant(pattern)),
        // With several, often.
        2 | 3 => (random.matrix(pattern, [1, 2], [-4, 4]), random.matrix(pattern, [1, 2], [-4, 4])),
        // Singular M-matrices: without a solution where the weighted sum of q is negative.
        4..=6 => (random.singular(pattern, &weights), identity(n)),
        // Two equal rows.
        7 => {
            let mut pair =
                [random.matrix(pattern, any, [0, 3]), random.matrix(pattern, any, [-3, 3])];
            let rows = [random.index(n), random.index(n)];
            for matrix in &mut pair {
                matrix[rows[0]] = matrix[rows[1]].clone();
            }
            let [a, b] = pair;
            (a, b)
        }
        // A column of zeros, in one of them or in both.
        8 | 9 => {
            let mut pair = [random.dominant(pattern), random.dominant(pattern)];
            if random.once_in(3) {
                pair[1] = random.matrix(pattern, any, [-4, 4]);
            }
            let [j, k] = [random.index(n), random.index(n)];
            pair[0].iter_mut().for_each(|row| row[j] = 0);
            if k != j && random.once_in(2) {
                pair[1].iter_mut().for_each(|row| row[k] = 0);
            }
            let [a, b] = pair;
            (a, b)
        }
        _ => (random.matrix(pattern, any, [-3, 3]), random.matrix(pattern, any, [-3, 3])),
    };
    if kind == 6 {
        // The weighted rows of both sum to zero.
        b = random.singular(pattern, &weights);
    }
    let planted = match kind {
        1 | 3 => true,
        4 | 5 | 8 => false,
        _ => random.once_in(3),
    };
    let mut q = if planted { random.plant(&a, &b).q } else { random.vector(n, -4, 4) };
    if kind == 4 && dot(&weights, &q) > 0 {
        q.iter_mut().for_each(|q| *q = -*q);
    }
    (a, b, q)
}

// The oracle.

type Exact = Ratio<i128>;

/// All basic solutions of A z − B r + q = 0, z, r ≥ 0, zᵀr = 0, as x = z − r: those whose columns
/// are linearly independent.
///
/// Each unknown brings its column of A, or that of −B, or none: 3ⁿ choices, of which one with
/// independent columns has one candidate at most. Where there is a solution there is a basic one:
/// as long as its columns depend on each other it can be moved along the dependence until one of
/// them drops out, and it stays complementary. So an empty list is a proof that there is none,
/// singular matrices or not.
///
/// Entries up to 40 in orders up to 5, with q up to 600, have minors below (40√5)⁴·600√5 < 10¹¹ by
/// Hadamard's inequality, and products of three of them fit in 127 bits.
fn solutions(a: &Matrix, b: &Matrix, q: &[i64]) -> Vec<Vec<Exact>> {
    let n = q.len();
    let mut found = vec![];
    for choice in 0..3_usize.pow(n as u32) {
        let sign = |j| (choice / 3_usize.pow(j) % 3) as i64 - 1;
        let signs: Vec<i64> = (0..n as u32).map(sign).collect();
        let Some(x) = on_columns(a, b, q, &signs) else { continue };
        let fits = |(x, &sign): (&Exact, &i64)| !(*x * integer(sign)).is_negative();
        if x.iter().zip(&signs).all(fits) && !found.contains(&x) {
            found.push(x);
        }
    }
    found
}

fn integer(value: i64) -> Exact {
    Exact::from(i128::from(value))
}

/// The solution x of A z − B r + q = 0 with z = x where `signs` is 1, r = −x where it is −1 and
/// both zero elsewhere, whatever the signs of x, if these columns are independent and span q.
fn on_columns(a: &Matrix, b: &Matrix, q: &[i64], signs: &[i64]) -> Option<Vec<Exact>> {
    let n = q.len();
    let columns: Vec<usize> = (0..n).filter(|&j| signs[j] != 0).collect();
    let row = |i: usize| -> Vec<Exact> {
        let entry = |&j: &usize| integer(if signs[j] > 0 { a[i][j] } else { b[i][j] });
        columns.iter().map(entry).chain([integer(-q[i])]).collect()
    };
    let mut rows: Vec<Vec<Exact>> = (0..n).map(row).collect();
    for k in 0..columns.len() {
        let p = (k..n).find(|&p| !rows[p][k].is_zero())?;
        rows.swap(k, p);
        let pivot = rows[k].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            let share = row[k] / pivot[k];
            if i != k && !share.is_zero() {
                row.iter_mut().zip(&pivot).for_each(|(entry, above)| *entry -= share * above);
            }
        }
    }
    let rest = columns.len();
    if rows[rest..].iter().any(|row| !row[rest].is_zero()) {
        return None;
    }
    let mut x = vec![Exact::zero(); n];
    for (k, &j) in columns.iter().enumerate() {
        x[j] = rows[k][rest] / rows[k][k];
    }
    Some(x)
}

// Runs.

/// What every problem is given to; names of the paper, with α = 1.2 where one is open, and others
/// with an arm in [`method`].
const METHODS: &str = "MJ MGS MSOR AMJ AMGS AMSOR TMJ TMGS TMSOR ANDERSON NEWTON ADAPTIVE AUTO";

/// What tridiagonal pairs are given to as well.
const ON_LINES: &str = "NEWTON-LINES";

/// What five-point operators are given to as well.
const ON_GRIDS: &str = "MRBGS AMRBGS TMRBGS MGV MGF MGW FMG";

type Boxed<T, O> = Box<dyn Method<T, A = O, B = O>>;

fn method<T, O>(name: &str, problem: Hlcp<T, O, O>) -> Result<Boxed<T, O>, Error>
where
    T: Scalar,
    O: Rows<T> + Clone + 'static,
{
    let tmgs = |problem| Tmms::mirrored(problem, Aor::gauss_seidel());
    let cycles = |problem, cycle| Multigrid::new(problem, cycle);
    Ok(match name {
        "ANDERSON" => Box::new(Anderson::new(tmgs(problem)?, 10)?),
        "NEWTON" => Box::new(Newton::new(tmgs(problem)?, Ssor)),
        "NEWTON-LINES" => Box::new(Newton::new(tmgs(problem)?, TridiagonalPart::new())),
        "ADAPTIVE" => Box::new(AdaptiveSor::new(problem)?),
        "AUTO" => Box::new(Auto::new(problem)?),
        "MGV" => Box::new(cycles(problem, Cycle::V)?),
        "MGF" => Box::new(cycles(problem, Cycle::F)?),
        "MGW" => Box::new(cycles(problem, Cycle::W)?),
        "FMG" => Box::new(FullMultigrid::new(cycles(problem, Cycle::F)?)),
        name => {
            let alpha = name.ends_with("SOR").then_some(1.2);
            let parameters = Parameters { alpha, ..Parameters::default() };
            Named::parse(name, parameters).expect("a name of the paper").on(problem)?
        }
    })
}

/// A matrix as a user's operator: the entries of each row that are not zero.
#[derive(Debug, Clone)]
struct Lists<T>(Vec<Vec<(usize, T)>>);

impl<T: Scalar> LinearOperator<T> for Lists<T> {
    fn order(&self) -> usize {
        self.0.len()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        for (y, row) in y.iter_mut().zip(&self.0) {
            *y = row.iter().fold(T::zero(), |sum, &(j, a)| sum + a * x[j]);
        }
    }
}

impl<T: Scalar> Diagonal<T> for Lists<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.0[i].iter().find(|(j, _)| *j == i).map_or(T::zero(), |(_, a)| *a)
    }
}

impl<T: Scalar> Rows<T> for Lists<T> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        self.0[i].iter().for_each(|&(j, a)| visit(j, a));
    }
}

fn to<T: Scalar>(value: f64) -> T {
    T::from(value).expect("a float")
}

fn lists<T: Scalar>(matrix: &Matrix) -> Lists<T> {
    let mut rows = vec![vec![]; matrix.len()];
    entries(matrix)
        .filter(|(.., entry)| *entry != 0)
        .for_each(|(i, j, entry)| rows[i].push((j, to(entry as f64))));
    Lists(rows)
}

fn five_point<T: Scalar>(matrix: &Matrix, nx: usize) -> VaryingFivePoint<'static, T> {
    let n = matrix.len();
    let row = |i: usize, j: usize| {
        let k = nx * j + i;
        let entry = |inside: bool, at: usize| to(if inside { matrix[k][at] as f64 } else { 0.0 });
        [
            entry(j > 0, k.wrapping_sub(nx)),
            entry(i > 0, k.wrapping_sub(1)),
            entry(true, k),
            entry(i + 1 < nx, k + 1),
            entry(k + nx < n, k + nx),
        ]
    };
    VaryingFivePoint::from_fn(nx, n / nx, row).expect("a finite matrix on its grid")
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    /// Converged, where no solution is.
    FalseConverged,
    /// Converged, with an exact residual above what was asked.
    Inexact,
    /// Not converged, and an iterate before the answer had a smaller residual.
    LostBest,
    /// An entry of z or r that is not finite or negative, or two that are both positive.
    Unsound,
    Panicked,
}

/// One run in numbers.
#[derive(Debug, Clone, Default)]
struct Run {
    converged: bool,
    /// The exact residual over what was asked, of a run that converged.
    over_asked: f64,
    faults: Vec<(Fault, String)>,
}

/// The runs of a method on a case, from all its starts; none where the method refuses the problem.
fn runs<T: Scalar>(case: &Case, precision: Precision, name: &str, solvable: bool) -> Vec<Run> {
    match case.grid {
        Some(nx) => {
            let [a, b] = [&case.a, &case.b].map(|matrix| five_point::<T>(matrix, nx));
            runs_with(case, [a, b], precision, name, solvable)
        }
        None => {
            let [a, b] = [&case.a, &case.b].map(lists::<T>);
            runs_with(case, [a, b], precision, name, solvable)
        }
    }
}

fn runs_with<T, O>(
    case: &Case,
    [a, b]: [O; 2],
    precision: Precision,
    name: &str,
    solvable: bool,
) -> Vec<Run>
where
    T: Scalar,
    O: Rows<T> + Clone + 'static,
{
    let vector = |v: &[i64]| v.iter().map(|&v| to(v as f64)).collect::<Vec<T>>();
    let omega = match &case.omega {
        None => Omega::diagonal_ratio(T::one(), &a, &b).expect("positive diagonals"),
        Some(omega) => Omega::Each(vector(omega)),
    };
    let problem = Hlcp::new(a, b, omega)
        .and_then(|problem| problem.with_gamma(to(case.gamma as f64)))
        .and_then(|problem| if case.exchanged { problem.exchanged() } else { Ok(problem) })
        .expect("a sound pair");
    let Ok(method) = method(name, problem.clone()) else { return vec![] };
    let mut solver = Solver::new(method);
    let mut runs = vec![];
    for start in &case.starts {
        let attempt = || run(case, &problem, &mut solver, &vector(start), precision, solvable);
        match catch_unwind(AssertUnwindSafe(attempt)) {
            Ok(run) => runs.push(run),
            Err(_) => {
                let faults = vec![(Fault::Panicked, "as it says on stderr".to_owned())];
                runs.push(Run { faults, ..Run::default() });
                break; // A solver that panicked is not used again.
            }
        }
    }
    runs
}

/// One run, with its faults.
fn run<T, O>(
    case: &Case,
    problem: &Hlcp<T, O, O>,
    solver: &mut Solver<T, Boxed<T, O>>,
    start: &[T],
    precision: Precision,
    solvable: bool,
) -> Run
where
    T: Scalar,
    O: Rows<T> + Clone + 'static,
{
    let q: Vec<T> = case.q().into_iter().map(to).collect();
    let limits = Limits { iterations: case.iterations, ..Limits::default() };
    let (mut smallest, mut best) = (f64::INFINITY, vec![]);
    let mut note = |progress: &Progress<'_, T>| {
        if progress.residual.l2 < smallest {
            smallest = progress.residual.l2;
            best.clear();
            best.extend_from_slice(progress.x);
        }
        ControlFlow::Continue(())
    };
    let outcome = solver
        .solve(&q, Options::from_x(start).limits(limits).observer(&mut note))
        .expect("finite input");
    let mut run = Run { converged: outcome.converged(), ..Run::default() };
    let mut fault =
        |fault, detail: String| run.faults.push((fault, format!("{outcome}: {detail}")));

    let doubles = |v: &[T]| v.iter().map(|v| v.to_f64().expect("a float")).collect::<Vec<_>>();
    let [z, r] = [solver.z(), solver.r()].map(doubles);
    for i in 0..q.len() {
        let sound = |v: f64| v.is_finite() && v >= 0.0;
        if !sound(z[i]) || !sound(r[i]) || z[i] > 0.0 && r[i] > 0.0 {
            fault(Fault::Unsound, format!("z[{i}] = {:e}, r[{i}] = {:e}", z[i], r[i]));
        }
    }
    if outcome.converged() {
        if !solvable {
            fault(Fault::FalseConverged, format!("z = {z:?}, r = {r:?} solve nothing"));
        }
        if z.iter().chain(&r).all(|v| v.is_finite()) {
            let q = case.q();
            let bound = asked(precision, q.iter().map(|q| q * q).sum::<f64>().sqrt());
            let squares = residual_squared(case, &q, &z, &r);
            let residual = squares.to_f64().expect("a number").sqrt();
            if squares > exact(bound) * exact(bound) {
                let detail = format!("exact residual {residual:.2e}, asked {bound:.2e}");
                fault(Fault::Inexact, detail);
            }
            run.over_asked = if residual == 0.0 { 0.0 } else { residual / bound };
        }
    } else {
        let bound = smallest + rounding(case, problem, &best);
        if outcome.residual.l2.is_nan() || outcome.residual.l2 > bound {
            let detail = format!("residual {:e}, and {smallest:e} was seen", outcome.residual.l2);
            fault(Fault::LostBest, detail);
        }
    }
    run
}

fn exact(value: f64) -> BigRational {
    BigRational::from_float(value).expect("finite")
}

/// ‖A z − B r + q‖², without rounding.
fn residual_squared(case: &Case, q: &[f64], z: &[f64], r: &[f64]) -> BigRational {
    let mut sum = BigRational::zero();
    for (i, &q) in q.iter().enumerate() {
        let mut row = exact(q);
        for j in 0..z.len() {
            // Of the two one is zero, and exact products take their time.
            if z[j] != 0.0 {
                row += exact(case.a[i][j] as f64) * exact(z[j]);
            }
            if r[j] != 0.0 {
                row -= exact(case.b[i][j] as f64) * exact(r[j]);
            }
        }
        sum += &row * &row;
    }
    sum
}

/// How much two computed norms of the residual at `x` may differ.
///
/// A row sums at most 2n + 1 terms, of A, of BΩ and q, be it from z and r or from x and |x|. Each
/// is rounded three times at most before it is summed, and the sum is divided by γ: 2n + 5
/// roundings of ε/2, of terms that add up to Sᵢ = Σⱼ 2(|aᵢⱼ| + |bᵢⱼ|ωⱼ)|xⱼ|/γ + |qᵢ| at most. Both
/// norms are that near the exact one, so they differ by (2n + 5)ε‖S‖ and, where numbers underflow,
/// as many of the smallest. One rounding is to spare for what is of second order in ε.
fn rounding<T: Scalar, O: Rows<T>>(case: &Case, problem: &Hlcp<T, O, O>, x: &[T]) -> f64 {
    let to_f64 = |v: T| v.to_f64().expect("a float");
    let gamma = to_f64(problem.gamma());
    let mut squares = 0.0;
    for (i, q) in case.q().into_iter().enumerate() {
        let mut size = q.abs();
        let size_of = |entry: T, j: usize| 2.0 * to_f64(entry.abs()) * to_f64(x[j].abs()) / gamma;
        problem.a().visit_row(i, &mut |j, a| size += size_of(a, j));
        let omega = |j| to_f64(problem.omega().at(j));
        problem.b().visit_row(i, &mut |j, b| size += omega(j) * size_of(b, j));
        squares += size * size;
    }
    let count = (2 * x.len() + 6) as f64;
    count * (to_f64(T::epsilon()) * squares.sqrt() + to_f64(T::min_positive_value()))
}

// The count.

/// The counts of one method in one precision.
#[derive(Debug, Clone, Default)]
struct Counts {
    runs: usize,
    converged: usize,
    faults: BTreeMap<Fault, usize>,
    worst: f64,
}

/// What an attack has seen.
#[derive(Debug, Clone, Default)]
struct Tally {
    problems: usize,
    unsolvable: usize,
    several: usize,
    by_method: BTreeMap<(&'static str, Precision), Counts>,
    /// The first of each kind, for each method and precision.
    examples: Vec<String>,
}

impl Tally {
    fn runs(&self) -> usize {
        self.by_method.values().map(|counts| counts.runs).sum()
    }

    fn attack(&mut self, seed: u64) {
        let case = grown(seed);
        let found = solutions(&case.a, &case.b, &case.q).len();
        self.problems += 1;
        self.unsolvable += usize::from(found == 0);
        self.several += usize::from(found > 1);
        for name in case.methods() {
            for precision in [Precision::Single, Precision::Double] {
                let runs = match precision {
                    Precision::Single => runs::<f32>(&case, precision, name, found > 0),
                    Precision::Double => runs::<f64>(&case, precision, name, found > 0),
                };
                let counts = self.by_method.entry((name, precision)).or_default();
                for (run, start) in runs.into_iter().zip(&case.starts) {
                    counts.runs += 1;
                    counts.converged += usize::from(run.converged);
                    counts.worst = counts.worst.max(run.over_asked);
                    for (fault, detail) in run.faults {
                        let count = counts.faults.entry(fault).or_default();
                        *count += 1;
                        if *count == 1 {
                            let case = Case { starts: vec![start.clone()], ..case.clone() };
                            self.examples.push(format!(
                                "{fault:?}, {name:?}, {precision:?}, seed {seed}: {detail}\n    {case}"
                            ));
                        }
                    }
                }
            }
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { problems, unsolvable, several, by_method, .. } = self;
        let solvable = problems - unsolvable;
        writeln!(
            f,
            "{problems} problems: {unsolvable} unsolvable, {solvable} solvable ({several} with several basic solutions)"
        )?;
        let header = ["runs", "converged", "false", "inexact", "lost best", "unsound", "panics"];
        write!(f, "{:24}", "method")?;
        header.iter().try_for_each(|name| write!(f, "{name:>11}"))?;
        writeln!(f, "  worst/asked")?;
        let mut line = |name: &str, counts: &Counts| {
            write!(f, "{name:24}{:11}{:11}", counts.runs, counts.converged)?;
            use Fault::{FalseConverged, Inexact, LostBest, Panicked, Unsound};
            for fault in [FalseConverged, Inexact, LostBest, Unsound, Panicked] {
                write!(f, "{:11}", counts.faults.get(&fault).unwrap_or(&0))?;
            }
            writeln!(f, "  {:11.2e}", counts.worst)
        };
        let mut all = Counts::default();
        for ((name, precision), counts) in by_method {
            line(&format!("{name}, {precision:?}"), counts)?;
            all.runs += counts.runs;
            all.converged += counts.converged;
            all.worst = all.worst.max(counts.worst);
            for (&fault, count) in &counts.faults {
                *all.faults.entry(fault).or_default() += count;
            }
        }
        line("all", &all)
    }
}

fn of_environment<N: std::str::FromStr>(name: &str) -> Option<N> {
    let value = std::env::var(name).ok()?;
    Some(value.parse().unwrap_or_else(|_| panic!("{name} is {value:?}, which is not a number")))
}

#[test]
fn every_method_tells_the_truth() {
    let first: u64 = of_environment("HLCP_ATTACK_SEED").unwrap_or(SEED);
    let wanted: usize = of_environment("HLCP_ATTACK_RUNS").unwrap_or(RUNS);
    let mut tally = Tally::default();
    let mut seed = first;
    while tally.runs() < wanted {
        tally.attack(seed);
        seed = seed.wrapping_add(1);
    }
    println!("{tally}");
    assert!(tally.examples.is_empty(), "from seed {first}:\n{}", tally.examples.join("\n"));
    // Of enough problems a third is of the kind that misleads, a third is not, and none is for
    // nothing.
    let Tally { problems, unsolvable, several, by_method, .. } = tally;
    if problems >= 100 {
        assert!(by_method.values().all(|counts| 5 * counts.converged >= counts.runs));
        assert!(3 * (unsolvable + several) >= problems && 3 * (problems - unsolvable) >= problems);
    }
}

/// The faults of one method on one case.
fn faults(case: &Case, name: &str, precision: Precision) -> Vec<(Fault, String)> {
    let solvable = !solutions(&case.a, &case.b, &case.q).is_empty();
    let runs = match precision {
        Precision::Single => runs::<f32>(case, precision, name, solvable),
        Precision::Double => runs::<f64>(case, precision, name, solvable),
    };
    assert_eq!(runs.len(), case.starts.len(), "{name} takes the problem");
    runs.into_iter().flat_map(|run| run.faults).collect()
}

/// Az − r = e has no solution with r ≥ 0, since the rows of A sum to zero: iterates run away along
/// (1, 1), and what rounding excuses grows with them.
#[test]
fn a_run_away_iterate_is_no_solution_in_single_precision() {
    let case = Case::typed("1 -1; -1 1", "1 0; 0 1", "-1 -1");
    assert_eq!(faults(&case, "ANDERSON", Precision::Single), []);
}

/// (2, 3, 5)A = 0 and (2, 3, 5)·q = −4 < 0: where a nearly singular J throws x to 10¹⁵, A z has no
/// digits left.
#[test]
fn a_residual_without_digits_is_no_zero() {
    let case = Case::typed("4 -2 -2; -1 3 -2; -1 -1 2", "1 0 0; 0 1 0; 0 0 1", "-1 1 -1");
    assert_eq!(faults(&case, "NEWTON", Precision::Double), []);
}

/// An iterate that seems to converge and does not, when measured again, is not the best one for
/// that.
#[test]
fn a_check_that_fails_leaves_the_best_iterate_alone() {
    let case = Case {
        iterations: 1400,
        ..Case::typed(
            "1 -3 3 2; -2 4 1 3; 2 -1 4 0; -3 -3 -3 2",
            "3 1 -3 -3; 3 3 0 1; -1 -3 4 3; -3 -3 3 3",
            "-1 0 -3 3",
        )
    };
    assert_eq!(faults(&case, "TMGSSOR1", Precision::Single), []);
}

/// The second column of B is zero, so r₁ shows in no residual, and ω carries it beyond the largest
/// number.
#[test]
fn what_a_zero_column_hides_is_finite() {
    let a = lists(&identity(2));
    let b = lists(&vec![vec![1, 0], vec![1, 0]]);
    let problem = Hlcp::new(a, b, Omega::Uniform(1e300)).unwrap();
    let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
    let outcome = solver.solve(&[1e-11, 1e-11], Options::from_x(&[0.0, -1e10])).unwrap();
    let finite = solver.z().iter().chain(solver.r()).all(|v: &f64| v.is_finite());
    assert!(finite || !outcome.converged(), "{outcome}: r = {:?}", solver.r());
}

/// Of one unknown all is known: a z = −q with z ≥ 0, or b r = q with r ≥ 0.
#[test]
fn the_oracle_knows_problems_of_order_one() {
    let numbers = || -2..=2_i64;
    for (a, b, q) in
        numbers().flat_map(|a| numbers().flat_map(move |b| numbers().map(move |q| (a, b, q))))
    {
        let mut expected = vec![];
        if q == 0 {
            expected.push(vec![Exact::zero()]);
        }
        if a * q < 0 {
            expected.push(vec![integer(-q) / integer(a)]);
        }
        if b * q > 0 {
            expected.push(vec![-integer(q) / integer(b)]);
        }
        let mut found = solutions(&vec![vec![a]], &vec![vec![b]], &[q]);
        found.sort();
        expected.sort();
        assert_eq!(found, expected, "{a}, {b}, {q}");
    }
}

/// What the oracle lists are solutions, and what was planted is listed or depends on other columns.
#[test]
fn the_oracle_finds_planted_solutions() {
    for seed in 0..2000 {
        let random = &mut Random(seed);
        let n = 1 + random.index(5);
        let kind = random.index(KINDS);
        let (a, b, _) = posed(random, &Pattern { n, grid: None }, kind);
        let Planted { z, r, q } = random.plant(&a, &b);
        let found = solutions(&a, &b, &q);
        assert!(!found.is_empty(), "{a:?}, {b:?}, {q:?}");
        let zero = Exact::zero();
        for x in &found {
            for i in 0..n {
                let term = |j: usize| {
                    // z or −r, whichever is not zero
                    let entry = if x[j] > zero { a[i][j] } else { b[i][j] };
                    integer(entry) * x[j]
                };
                let sum: Exact = (0..n).map(term).sum();
                assert_eq!(sum, -integer(q[i]), "{a:?}, {b:?}, {q:?}");
            }
        }
        let planted: Vec<i64> = z.iter().zip(&r).map(|(z, r)| z - r).collect();
        let signs: Vec<i64> = planted.iter().map(|x| x.signum()).collect();
        if let Some(x) = on_columns(&a, &b, &q, &signs) {
            assert!(x.iter().zip(&planted).all(|(x, &p)| *x == integer(p)));
            assert!(found.contains(&x));
        }
    }
}

/// A strictly dominant A with a positive diagonal is a P-matrix, so with B = I there is one
/// solution for every q.
#[test]
fn the_oracle_finds_one_solution_of_a_p_matrix() {
    for seed in 0..1000 {
        let random = &mut Random(seed);
        let n = 1 + random.index(5);
        let a = random.dominant(&Pattern { n, grid: None });
        let q = random.vector(n, -4, 4);
        assert_eq!(solutions(&a, &identity(n), &q).len(), 1, "{a:?}, {q:?}");
    }
}

/// Positive weights w with wᵀA = 0 and wᵀB ≥ 0 leave wᵀ(A z − B r + q) ≤ wᵀq < 0.
#[test]
fn the_oracle_finds_nothing_where_weighted_rows_say_so() {
    let mut count = 0;
    for seed in 0..2000 {
        let random = &mut Random(seed);
        let n = 1 + random.index(5);
        let pattern = Pattern { n, grid: None };
        let weights = random.vector(n, 1, 3);
        let a = random.singular(&pattern, &weights);
        let b = match random.index(3) {
            0 => identity(n),
            1 => random.matrix(&pattern, [0, 2], [0, 3]),
            _ => random.singular(&pattern, &weights),
        };
        let q = random.vector(n, -4, 4);
        assert!((0..n).all(|j| (0..n).map(|i| weights[i] * a[i][j]).sum::<i64>() == 0));
        if dot(&weights, &q) < 0 {
            count += 1;
            assert_eq!(solutions(&a, &b, &q), Vec::<Vec<Exact>>::new(), "{a:?}, {b:?}, {q:?}");
        }
    }
    assert!(count > 500);
}

/// Feasible and without a solution: r = (z₂ − 1, 1) has z₂ = 0 for its second entry, and then −1
/// for its first.
#[test]
fn the_oracle_tells_feasible_from_solvable() {
    let (a, b) = (vec![vec![0, 1], vec![0, 0]], identity(2));
    assert!(solutions(&a, &b, &[-1, 1]).is_empty());
    // With 0 for the last entry of q, z₂ = 1 is a solution.
    let one = integer(1);
    assert_eq!(solutions(&a, &b, &[-1, 0]), [vec![Exact::zero(), one]]);
}

/// The exact residual of a computed answer, from numbers whose product no float holds.
#[test]
fn the_exact_residual_is_exact() {
    let case = Case::typed("3 0; -1 1", "1 0; 0 2", "-1 0");
    let third = 1.0 / 3.0; // 3·third − 1 is −2⁻⁵⁴, which floats round to zero
    let residual = residual_squared(&case, &case.q(), &[third, 0.0], &[0.0, -third / 2.0]);
    assert_eq!(residual, exact(2_f64.powi(-108)));
}

/// What a failure prints is the problem itself.
#[test]
fn a_printed_problem_can_be_typed_in() {
    let case = Case {
        power: -10,
        omega: Some(vec![2, 3]),
        ..Case::typed("1 -1; -1 1", "1 0; 0 1", "-1 2")
    };
    assert_eq!(
        case.to_string(),
        "Case { power: -10, omega: Some(vec![2, 3]), gamma: 1, exchanged: false, grid: None, \
         starts: vec![vec![1, 1]], iterations: 2000, ..Case::typed(\"1 -1; -1 1\", \"1 0; 0 1\", \"-1 2\") }"
    );
}
