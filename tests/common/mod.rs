//! What several test programs share.
#![allow(dead_code, reason = "each test program uses its own part")]

use std::{
    str::FromStr,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
};

use hlcp_core::{
    Aor, Coefficients, Diagonal, Error, FivePointView, Hlcp, LinearOperator, Norms, Omega, Rhs,
    Rows, Scalar,
};
use hlcp_methods::{
    Clock, DynRows, Limits, Method, Named, Options, Outcome, Parameters, Solver, Tmms,
};
use hlcp_verify::{
    Planted,
    oracle::{Dense, Iteration},
};
use nalgebra::{DMatrix, DVector};
use proptest::{collection::vec, prelude::*};

/// The number that the environment has under a name, or else `usual`.
pub(crate) fn asked<N: FromStr>(name: &str, usual: N) -> N {
    let Ok(value) = std::env::var(name) else { return usual };
    value.parse().unwrap_or_else(|_| panic!("{name} is {value:?}, which is not a number"))
}

/// The dense problem as the library sees it.
pub(crate) fn posed(dense: &Dense) -> Hlcp<f64, DMatrix<f64>, DMatrix<f64>> {
    let omega = Omega::Each(dense.omega.iter().copied().collect());
    Hlcp::new(dense.a.clone(), dense.b.clone(), omega)
        .and_then(|problem| problem.with_gamma(dense.gamma))
        .expect("generators make valid problems")
}

/// The step as the paper writes it.
pub(crate) fn textbook(dense: &Dense, step: &Aor<f64>) -> Iteration {
    let ([of_a, of_b], backward) = (step.pairs(), step.precedes(1, 0));
    if step.is_accelerated() {
        dense.amms(of_a, of_b, backward)
    } else {
        dense.mms(of_a, of_b, backward)
    }
}

/// The matrix of an operator, from its rows.
pub(crate) fn assembled<T: Scalar>(operator: &impl Rows<T>) -> DMatrix<T> {
    let n = operator.order();
    let mut matrix = DMatrix::zeros(n, n);
    for i in 0..n {
        operator.visit_row(i, &mut |j, a| matrix[(i, j)] = a);
    }
    matrix
}

/// A problem on operators behind `dyn`, for which methods are compiled once.
pub(crate) type Dynamic<'p, T> = Hlcp<T, DynRows<'p, T>, DynRows<'p, T>>;

/// The problem of a pair with Ω = τ D_A D_B⁻¹.
pub(crate) fn problem<T: Scalar, A: Rows<T>, B: Rows<T>>(tau: f64, a: A, b: B) -> Hlcp<T, A, B> {
    let omega = Omega::diagonal_ratio(T::from(tau).unwrap(), &a, &b).unwrap();
    Hlcp::new(a, b, omega).unwrap()
}

/// Every name of the library but those of Table 1, which are others with parameters of their own.
pub(crate) fn names() -> impl Iterator<Item = String> {
    let is_of_table_1 = |name: &String| name.ends_with(|last: char| last.is_ascii_digit());
    Named::names().into_iter().filter(move |name| !is_of_table_1(name))
}

/// The method of a name, with α and β where it leaves them open.
pub(crate) fn named(name: &str, [alpha, beta]: [f64; 2]) -> Named {
    let [sor, aor] = ["SOR", "AOR"].map(|splitting| name.ends_with(splitting));
    let (alpha, beta) = ((sor || aor).then_some(alpha), aor.then_some(beta));
    Named::parse(name, Parameters { alpha, beta, ..Parameters::default() }).expect("a name")
}

/// A solver by the method of a name, on operators behind `dyn` with Ω = D_A D_B⁻¹.
pub(crate) fn by<'p, T: Scalar>(
    name: &str,
    a: DynRows<'p, T>,
    b: DynRows<'p, T>,
) -> Result<Solver<T, impl Method<T>>, Error> {
    named(name, [1.0; 2]).on_dyn(problem(1.0, a, b)).map(Solver::new)
}

/// The two-step method with Gauss–Seidel, forward and backward.
pub(crate) fn tmgs<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: Hlcp<T, A, B>,
) -> Tmms<T, A, B, Aor<T>, Aor<T>> {
    Tmms::mirrored(problem, Aor::gauss_seidel()).unwrap()
}

/// A splitting whose solve divides by a number.
pub(crate) fn over(pivot: f64) -> impl Fn(&[f64], &mut [f64]) + Copy + Send + Sync {
    move |rhs, y| y.iter_mut().zip(rhs).for_each(|(y, rhs)| *y = rhs / pivot)
}

/// The paper's test, a 2-norm of the residual of at most 10⁻¹⁰, from the start `x`.
pub(crate) fn from<T>(x: &[T]) -> Options<'_, T> {
    Options::from_x(x).limits(Limits::absolute(1e-10))
}

/// Solves from x⁰ = e within `limits`.
pub(crate) fn solve_from_ones<T: Scalar>(
    solver: &mut Solver<T, impl Method<T>>,
    q: &[T],
    limits: Limits,
) -> Outcome {
    solver.solve(q, Options::from_x(&vec![T::one(); q.len()]).limits(limits)).unwrap()
}

/// `z` and `r` by TMGS (τ = 1, x⁰ = e), which must converge to the paper's tolerance.
pub(crate) fn by_tmgs<T: Scalar, A: Rows<T>, B: Rows<T>>(a: A, b: B, q: &[T]) -> [Vec<T>; 2] {
    let mut solver = Solver::new(tmgs(problem(1.0, a, b)));
    let limits = Limits { iterations: 200_000, ..Limits::absolute(1e-10) };
    let outcome = solve_from_ones(&mut solver, q, limits);
    assert!(outcome.converged(), "{outcome}");
    [solver.z().to_vec(), solver.r().to_vec()]
}

/// The largest distance of two entries; NaN where one of them is.
pub(crate) fn largest_difference<T: Scalar>(u: &[T], v: &[T]) -> f64 {
    let distances = u.iter().zip(v).map(|(&u, &v)| (u - v).abs().to_f64().unwrap());
    distances
        .fold(0.0, |max, distance| if distance > max || distance.is_nan() { distance } else { max })
}

/// `q = B r − A z`, for which z and r are a solution, row by row in double precision.
pub(crate) fn planted_q<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    [z, r]: [&[T]; 2],
) -> Vec<T> {
    let row = |i| {
        let mut q = 0.0;
        a.visit_row(i, &mut |j, a| q -= a.wide() * z[j].wide());
        b.visit_row(i, &mut |j, b| q += b.wide() * r[j].wide());
        T::of(q)
    };
    (0..z.len()).map(row).collect()
}

/// The positive and the negative parts of numbers: a z and an r that are complementary.
pub(crate) fn parts<T: Scalar>(signed: &[T]) -> [Vec<T>; 2] {
    [T::one(), -T::one()].map(|sign| signed.iter().map(|&s| (sign * s).max(T::zero())).collect())
}

/// Entries in 0..1 without pattern, others for every seed.
pub(crate) fn scattered(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| (f64::sin((i * i) as f64 * seed) * 43758.5453).fract().abs()).collect()
}

/// A number in −1..1 without pattern.
pub(crate) fn noise(seed: usize) -> f64 {
    let mixed = (seed as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Numbers between 0 and 1 that have no pattern.
pub(crate) fn uniform(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// HLCP(B, A, −q) with Ω⁻¹.
pub(crate) fn exchanged(dense: &Dense) -> Dense {
    Dense {
        a: dense.b.clone(),
        b: dense.a.clone(),
        q: -&dense.q,
        omega: dense.omega.map(f64::recip),
        gamma: dense.gamma,
    }
}

/// The points in red–black order on a grid with rows of `nx`.
pub(crate) fn red_black(n: usize, nx: usize) -> Vec<usize> {
    let black = |i: usize| (i / nx + i % nx) % 2 == 1;
    let (mut order, blacks): (Vec<_>, Vec<_>) = (0..n).partition(|&i| !black(i));
    order.extend(blacks);
    order
}

/// The same problem with its unknowns in another order.
pub(crate) fn permuted(dense: &Dense, order: &[usize]) -> Dense {
    Dense {
        a: dense.a.select_rows(order).select_columns(order),
        b: dense.b.select_rows(order).select_columns(order),
        q: dense.q.select_rows(order),
        omega: dense.omega.select_rows(order),
        gamma: dense.gamma,
    }
}

/// What a user might bring: each row a list of columns and entries.
#[derive(Debug, Clone)]
pub(crate) struct Lists<T>(pub(crate) Vec<Vec<(usize, T)>>);

impl<T: Scalar> Lists<T> {
    pub(crate) fn of(operator: &impl Rows<T>) -> Self {
        let row = |i| {
            let mut row = vec![];
            operator.visit_row(i, &mut |j, a| row.push((j, a)));
            row
        };
        Self((0..operator.order()).map(row).collect())
    }
}

/// An order of `n` unknowns by noise.
pub(crate) fn shuffled(n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| noise(i).total_cmp(&noise(j)));
    order
}

/// The rows of an operator, the unknown `order[i]` of which is to be called `i`.
pub(crate) fn renamed(operator: &impl Rows<f64>, order: &[usize]) -> Lists<f64> {
    let Lists(rows) = Lists::of(operator);
    let mut names = vec![0; order.len()];
    order.iter().enumerate().for_each(|(name, &i)| names[i] = name);
    let row = |&i: &usize| {
        let mut row: Vec<_> = rows[i].iter().map(|&(j, a)| (names[j], a)).collect();
        row.sort_by_key(|entry| entry.0);
        row
    };
    Lists(order.iter().map(row).collect())
}

impl<T: Scalar> LinearOperator<T> for Lists<T> {
    fn order(&self) -> usize {
        self.0.len()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        for (y, row) in y.iter_mut().zip(&self.0) {
            *y = row.iter().fold(T::zero(), |sum, &(j, a)| sum + a * x[j]);
        }
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.visit_row(i, visit);
        true
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

/// An operator that shows its rows one by one, and nothing of a grid or of arrays, and counts the
/// products with it; a walk over all rows counts as one.
pub(crate) struct Walked<O> {
    of: O,
    pub(crate) products: AtomicUsize,
}

impl<O> Walked<O> {
    pub(crate) fn new(of: O) -> Self {
        Self { of, products: AtomicUsize::new(0) }
    }

    /// Runs `work` with a clock that is up when it has been asked more than `late` times; returns
    /// what it makes, how often it asked, and the most products before a look or after the last.
    pub(crate) fn cut<R>(
        &self,
        late: usize,
        work: impl FnOnce(&mut Clock<'_>) -> R,
    ) -> (R, usize, usize) {
        let (mut asked, mut most) = (0, 0);
        let mut ask = || {
            asked += 1;
            most = most.max(self.products.swap(0, Relaxed));
            asked > late
        };
        self.products.store(0, Relaxed);
        let made = work(&mut Clock::new(&mut ask));
        (made, asked, most.max(self.products.swap(0, Relaxed)))
    }
}

impl<T: Scalar, O: LinearOperator<T>> LinearOperator<T> for Walked<O> {
    fn order(&self) -> usize {
        self.of.order()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.products.fetch_add(1, Relaxed);
        self.of.apply(x, y);
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.of.try_visit_row(i, visit)
    }
}

impl<T: Scalar, O: Diagonal<T>> Diagonal<T> for Walked<O> {
    fn diagonal_entry(&self, i: usize) -> T {
        self.of.diagonal_entry(i)
    }
}

impl<T: Scalar, O: Rows<T>> Rows<T> for Walked<O> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        if i == 0 {
            self.products.fetch_add(1, Relaxed);
        }
        self.of.visit_row(i, visit);
    }
}

/// A method with its steps altered.
///
/// `alter(k, x, y, norms, clock)` changes what step `k` since the restart has made of `x`, and
/// returns the norms that it is to report.
pub(crate) struct Altered<M, F> {
    of: M,
    alter: F,
    steps: usize,
}

impl<M, F> Altered<M, F>
where
    M: Method<f64>,
    F: FnMut(usize, &[f64], &mut [f64], Norms, &mut Clock<'_>) -> Norms,
{
    pub(crate) fn new(of: M, alter: F) -> Self {
        Self { of, alter, steps: 0 }
    }
}

impl<M, F> Method<f64> for Altered<M, F>
where
    M: Method<f64>,
    F: FnMut(usize, &[f64], &mut [f64], Norms, &mut Clock<'_>) -> Norms,
{
    type A = M::A;
    type B = M::B;

    fn problem(&self) -> &Hlcp<f64, M::A, M::B> {
        self.of.problem()
    }

    fn restart(&mut self) {
        self.steps = 0;
        self.of.restart();
    }

    fn step(
        &mut self,
        q: &Rhs<'_, f64>,
        x: &[f64],
        y: &mut Vec<f64>,
        clock: &mut Clock<'_>,
    ) -> Norms {
        let norms = self.of.step(q, x, y, clock);
        self.steps += 1;
        (self.alter)(self.steps, x, y, norms, clock)
    }

    fn complete(&mut self, q: &Rhs<'_, f64>, y: &mut Vec<f64>, spare: &mut Vec<f64>) {
        self.of.complete(q, y, spare);
    }
}

/// diag(1.5, 2.5, 3.5), until a number of sound products is used up: then NaN.
pub(crate) struct Failing {
    sound: usize,
    products: AtomicUsize,
}

impl Failing {
    pub(crate) fn after(sound: usize) -> Self {
        Self { sound, products: AtomicUsize::new(0) }
    }
}

impl LinearOperator<f64> for Failing {
    fn order(&self) -> usize {
        3
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        y.iter_mut().zip(x).enumerate().for_each(|(i, (y, x))| *y = (1.5 + i as f64) * x);
        if self.products.fetch_add(1, Relaxed) >= self.sound {
            y[1] = f64::NAN;
        }
    }
}

/// An operator that shows another one's stencil as its own.
pub(crate) struct Disguised<'v, O> {
    pub(crate) of: O,
    pub(crate) view: FivePointView<'v, f64>,
}

impl<O: LinearOperator<f64>> LinearOperator<f64> for Disguised<'_, O> {
    fn order(&self) -> usize {
        self.of.order()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.of.apply(x, y);
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, f64>> {
        Some(self.view)
    }
}

impl<O: Diagonal<f64>> Diagonal<f64> for Disguised<'_, O> {
    fn diagonal_entry(&self, i: usize) -> f64 {
        self.of.diagonal_entry(i)
    }
}

impl<O: Rows<f64>> Rows<f64> for Disguised<'_, O> {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
        self.of.visit_row(i, visit);
    }
}

/// A five-point operator on 4 × 1 points that breaks its promise of finite coefficients.
pub(crate) fn not_finite() -> Disguised<'static, Lists<f64>> {
    let row = |i: usize| {
        let row = [(i.wrapping_sub(1), f64::NAN), (i, 4.0), (i + 1, -1.1)];
        row.into_iter().filter(|(j, _)| *j < 4).collect()
    };
    let view = [0.0, f64::NAN, 4.0, -1.1, 0.0].map(Coefficients::Uniform);
    Disguised { of: Lists((0..4).map(row).collect()), view: FivePointView::new(4, 1, view) }
}

/// A full non-symmetric matrix: a diagonal in 1..4, off-diagonal rows that sum to at most `weight`
/// in modulus.
fn matrix(n: usize, weight: f64) -> impl Strategy<Value = DMatrix<f64>> {
    let reach = weight / n as f64;
    (vec(-reach..reach, n * n), vec(1.0..4.0, n)).prop_map(move |(off, diagonal)| {
        DMatrix::from_fn(n, n, |i, j| if i == j { diagonal[i] } else { off[i * n + j] })
    })
}

/// A problem of the given orders with a planted solution, everything varying, nothing symmetric.
pub(crate) fn planted(
    orders: std::ops::Range<usize>,
    weight: f64,
) -> impl Strategy<Value = Planted> {
    (orders, 0.5..4.0).prop_flat_map(move |(n, gamma)| {
        (matrix(n, weight), matrix(n, weight), vec(-8.0..8.0, n), vec(0.4..2.5, n)).prop_map(
            move |(a, b, signed, omega)| {
                Planted::new(a, b, &signed, DVector::from_vec(omega), gamma)
            },
        )
    })
}
