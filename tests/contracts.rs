//! One table of contracts that every method keeps: on stencils, assembled matrices, a user's
//! operator and the same behind `dyn`, in both precisions. Each name of the library is a row.

mod common;
#[path = "common/counting.rs"]
#[allow(dead_code, reason = "calls alone are counted here")]
mod counting;

use std::{
    fmt,
    panic::{self, AssertUnwindSafe},
    sync::Arc,
};

use common::{
    Disguised, Lists, assembled, from, largest_difference, named, names, parts, planted_q,
};

use hlcp_core::{
    Aor, Coefficients, Csr, Error, FivePoint, FivePointView, Hlcp, Identity, Jacobi, Omega, Rhs,
    RowMajor, Rows, Scalar, Scaled, Splitting, SplittingStep, Step,
};
use hlcp_methods::{
    AdaptiveSor, Anderson, BoxedMethod, Clock, Limits, Method, Mms, Newton, Norm, Options, Outcome,
    Renumbered, Solver, Ssor, Tmms, Tolerance, TridiagonalPart, Work,
};
use nalgebra_sparse::CsrMatrix;

/// The rows beside the library's names, each with an arm in [`method`]: parameters and mixtures
/// that no name has. A row whose method checks no pivots, since it knows no rows, has "closure" in
/// its name.
const BESIDE: [&str; 13] = [
    "MJ by the diagonal",
    "TMJ by the diagonal",
    "M by a closure",
    "TM by a closure and GS",
    "M backward with own parameters",
    "M red-black",
    "AM red-black",
    "TM red-black",
    "Anderson on MJ",
    "Newton with lines on AMGS",
    "Newton on adaptive SOR",
    "Anderson on adaptive SOR",
    "TMGS in another order",
];

/// The names of the library, and all beside.
fn rows() -> Vec<String> {
    names().chain(BESIDE.map(str::to_owned)).collect()
}

/// Whether a name is for five-point operators on a grid.
fn is_on_grids(row: &str) -> bool {
    row.contains("RB") || ["MGV", "MGW", "MGF", "FMG"].contains(&row)
}

/// Their set-ups allocate in each solve, as much as in the first.
const ALGEBRAIC: [&str; 2] = ["AMG", "PIVOTING"];

fn method<T: Scalar, A: Rows<T> + Clone + 'static, B: Rows<T> + Clone + 'static>(
    row: &str,
    problem: Hlcp<T, A, B>,
) -> Result<BoxedMethod<'static, T, A, B>, Error> {
    // Twice the largest pivot of the table's problem.
    let closure = || {
        SplittingStep(move |rhs: &[T], y: &mut [T]| {
            y.iter_mut().zip(rhs).for_each(|(y, &rhs)| *y = rhs / T::of(26.0));
        })
    };
    let pairs = Aor::with_pairs([T::of(1.1), T::of(0.9)], [T::of(0.8), T::of(1.05)]);
    Ok(match row {
        "MJ by the diagonal" => Box::new(Mms::new(problem, Jacobi)?),
        "TMJ by the diagonal" => Box::new(Tmms::new(problem, Jacobi, Jacobi)?),
        "M by a closure" => Box::new(Mms::new(problem, closure())?),
        "TM by a closure and GS" => {
            Box::new(Tmms::new(problem, closure(), Aor::gauss_seidel().backward())?)
        }
        "M backward with own parameters" => Box::new(Mms::new(problem, pairs?.backward())?),
        "M red-black" => Box::new(Mms::new(problem, pairs?.red_black(NX)?)?),
        "AM red-black" => Box::new(Mms::new(problem, pairs?.red_black(NX)?.accelerated())?),
        "TM red-black" => Box::new(Tmms::mirrored(problem, pairs?.red_black(NX)?)?),
        "Anderson on MJ" => Box::new(Anderson::new(method("MJ", problem)?, 5)?),
        "Newton with lines on AMGS" => Box::new(Newton::new(
            Mms::new(problem, Aor::gauss_seidel().accelerated())?,
            TridiagonalPart::new(),
        )),
        "Newton on adaptive SOR" => Box::new(Newton::new(AdaptiveSor::new(problem)?, Ssor)),
        "TMGS in another order" => {
            let order = (0..problem.order()).rev().collect();
            Box::new(Renumbered::new(problem, order, |problem| {
                Tmms::mirrored(problem, Aor::gauss_seidel())
            })?)
        }
        "Anderson on adaptive SOR" => Box::new(Anderson::new(AdaptiveSor::new(problem)?, 3)?),
        name => named(name, [1.1, 0.8]).on(problem)?,
    })
}

const NX: usize = 6;
const N: usize = NX * 4;
const A: [f64; 5] = [-1.1, -0.9, 6.3, -1.3, -0.7];
const B: [f64; 5] = [-0.3, -0.8, 4.1, -0.6, -0.2];

fn stencil<T: Scalar>(coefficients: [f64; 5]) -> FivePoint<T> {
    FivePoint::new(NX, N / NX, coefficients.map(|c| T::of(c))).unwrap()
}

fn omega<T: Scalar>() -> Omega<T> {
    Omega::Each((0..N).map(|i| T::of(1.3 + 0.2 * f64::cos(i as f64))).collect())
}

/// A planted solution of mixed signs, neither 0 nor 1 nor equal.
fn solution<T: Scalar>() -> [Vec<T>; 2] {
    let signed = |i| T::of(1.5 * f64::sin(2.1 * i as f64 + 0.4));
    parts(&(0..N).map(signed).collect::<Vec<T>>())
}

/// A method on the planted problem with one kind of operators.
struct Case<T, A, B> {
    row: String,
    /// The kind of operators.
    kind: &'static str,
    a: A,
    b: B,
    q: Vec<T>,
    start: Vec<T>,
    limits: Limits,
}

impl<T, A, B> fmt::Display for Case<T, A, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} on {}", self.row, self.kind)
    }
}

impl<T, A, B> Case<T, A, B>
where
    T: Scalar,
    A: Rows<T> + Clone + 'static,
    B: Rows<T> + Clone + 'static,
{
    fn new(row: &str, kind: &'static str, a: A, b: B) -> Self {
        let [z, r] = solution();
        let (q, start) = (planted_q(&a, &b, [&z, &r]), vec![T::of(0.6); N]);
        let limits = Limits { norm: Norm::LInf, ..Limits::absolute(1e-10) };
        Self { row: row.to_owned(), kind, a, b, q, start, limits }
    }

    fn solver(&self) -> Solver<T, BoxedMethod<'static, T, A, B>> {
        let problem = Hlcp::new(self.a.clone(), self.b.clone(), omega())
            .and_then(|problem| problem.with_gamma(T::of(1.7)))
            .expect("a sound pair");
        Solver::new(method(&self.row, problem).expect("a sound problem"))
    }

    /// Solves the planted problem from the start.
    fn solve(&self, solver: &mut Solver<T, BoxedMethod<'static, T, A, B>>) -> Outcome {
        solver.solve(&self.q, Options::from_x(&self.start).limits(self.limits)).unwrap()
    }

    /// Holds the case to every contract.
    fn keeps_all(&self) {
        self.a_later_solve_repeats_the_first_and_allocates_nothing();
        self.a_solve_goes_on_where_a_limit_ended_another();
        self.a_solved_start_takes_no_iterations();
        self.a_zero_q_is_solved_by_zero();
        self.bad_input_is_refused_and_nothing_is_lost_by_it();
        self.a_bad_pivot_is_refused_or_never_converges();
        self.it_reaches_the_planted_solution();
    }

    /// min(aᵢᵢ, ωᵢbᵢᵢ) ≥ 1.1·4.1 exceeds the row sums of max(|aᵢⱼ|, ωⱼ|bᵢⱼ|), at most
    /// 1.1 + 1.5·0.8 + 1.3 + 0.7, by 0.2 or more: so z is off by at most the residual over 0.2, and
    /// r by 1.5 times that. Rounding q, of size 12, and measuring the residual add some ten
    /// roundings of that size.
    fn it_reaches_the_planted_solution(&self) {
        let mut solver = self.solver();
        let outcome = self.solve(&mut solver);
        assert!(outcome.converged(), "{self}: {outcome}");
        let epsilon = T::epsilon().wide();
        // Four roundings of q and of the terms of A z and B r are excused in single precision.
        let excused = if epsilon > 1e-12 { 4.0 * epsilon * (12.0 + 11.5 * 1.5) } else { 0.0 };
        assert!(outcome.residual.linf <= excused.max(1e-10), "{self}: {outcome}");
        let off = 1.5 / 0.2 * (outcome.residual.linf + 60.0 * epsilon);
        let [z, r] = [solver.z(), solver.r()];
        for (found, planted) in [z, r].into_iter().zip(solution()) {
            assert!(largest_difference(found, &planted) <= off, "{self}");
            assert!(found.iter().all(|&entry| entry >= T::zero()), "{self}");
        }
        assert!(z.iter().zip(r).all(|(&z, &r)| z * r == T::zero()), "{self}");
    }

    /// To the bit, and whatever was solved between.
    fn a_later_solve_repeats_the_first_and_allocates_nothing(&self) {
        let mut solver = self.solver();
        let calls = counting::CALLS.get();
        let first = self.solve(&mut solver);
        let first_calls = counting::CALLS.get() - calls;
        let x = solver.x().to_vec();
        let other: Vec<T> = self.q.iter().map(|&q| -q).collect();
        let _ = solver.solve(&other, Options::from_x(&x).limits(self.limits)).unwrap();
        let calls = counting::CALLS.get();
        let again = self.solve(&mut solver);
        let calls = counting::CALLS.get() - calls;
        let allowed = if ALGEBRAIC.contains(&self.row.as_str()) { first_calls } else { 0 };
        assert!(calls <= allowed, "{self}: {calls}");
        let counts = |outcome: &Outcome| (outcome.iterations, outcome.residual);
        assert_eq!(counts(&again), counts(&first), "{self}");
        assert_eq!(solver.x(), x, "{self}");
    }

    /// As from the iterate there.
    fn a_solve_goes_on_where_a_limit_ended_another(&self) {
        let mut solver = self.solver();
        let two = Limits { iterations: 2, ..self.limits };
        let _ = solver.solve(&self.q, Options::from_x(&self.start).limits(two)).unwrap();
        let x_two = solver.x().to_vec();
        let rest = solver.solve(&self.q, Options::resume().limits(self.limits)).unwrap();
        let mut fresh = self.solver();
        let expected = fresh.solve(&self.q, Options::from_x(&x_two).limits(self.limits)).unwrap();
        assert!(rest.converged(), "{self}: {rest}");
        let counts = |outcome: &Outcome| (outcome.iterations, outcome.residual);
        assert_eq!(counts(&rest), counts(&expected), "{self}");
        assert_eq!(solver.x(), fresh.x(), "{self}");
    }

    fn a_solved_start_takes_no_iterations(&self) {
        let mut solver = self.solver();
        let _ = self.solve(&mut solver);
        let x = solver.x().to_vec();
        let again = solver.solve(&self.q, Options::from_x(&x).limits(self.limits)).unwrap();
        assert!(again.converged(), "{self}: {again}");
        let spent = (again.iterations, again.sweeps, again.linear_iterations.unwrap_or(0));
        assert_eq!(spent, (0, 0, 0), "{self}");
        assert_eq!(solver.x(), x, "{self}");
    }

    /// Whatever the start.
    fn a_zero_q_is_solved_by_zero(&self) {
        let mut solver = self.solver();
        let options = Options::from_x(&self.start).limits(self.limits);
        let zero = solver.solve(&[T::zero(); N], options).unwrap();
        assert!(zero.converged() && zero.residual.l2 == 0.0, "{self}: {zero}");
        assert_eq!(zero.iterations, 0, "{self}");
        let both = [solver.z(), solver.r()].concat();
        assert!(both.iter().all(|v| *v == T::zero()), "{self}");
    }

    fn bad_input_is_refused_and_nothing_is_lost_by_it(&self) {
        let mut solver = self.solver();
        let first = self.solve(&mut solver);
        let mut refusal = |q: &[T], x: &[T], limits| {
            solver.solve(q, Options::from_x(x).limits(limits)).expect_err("bad input")
        };
        for bad in [T::nan(), T::infinity(), T::neg_infinity()] {
            let mut spoilt = self.q.clone();
            spoilt[5] = bad;
            for (what, found) in [
                ("q", refusal(&spoilt, &self.start, self.limits)),
                ("x0", refusal(&self.q, &spoilt, self.limits)),
            ] {
                let refused =
                    matches!(found, Error::NotFinite { what: w, index: 5, .. } if w == what);
                assert!(refused, "{self}: {found}");
            }
        }
        let (found, expected) = (N - 1, N);
        let short_q = refusal(&self.q[1..], &self.start, self.limits);
        assert_eq!(short_q, Error::Order { what: "q", found, expected }, "{self}");
        let short_x = refusal(&self.q, &self.start[1..], self.limits);
        assert_eq!(short_x, Error::Order { what: "x0", found, expected }, "{self}");
        let bad = [-1.0, f64::NAN, f64::INFINITY];
        let relative = bad.into_iter().chain([1.0]).map(Tolerance::Relative);
        for tolerance in bad.map(Tolerance::Absolute).into_iter().chain(relative) {
            let limits = Limits { tolerance, ..self.limits };
            let of_limits = refusal(&self.q, &self.start, limits);
            assert!(matches!(of_limits, Error::Parameter { .. }), "{self}");
        }
        assert_eq!(self.solve(&mut solver).residual, first.residual, "{self}");
    }

    /// Zero, negative, or NaN; elimination needs pivots of no sign.
    fn a_bad_pivot_is_refused_or_never_converges(&self) {
        let eliminates = ["AUTO", "PIVOTING"].contains(&self.row.as_str());
        for factor in [T::zero(), -T::one(), T::nan()] {
            let a = Scaled { by: factor, of: self.a.clone() };
            let b = Scaled { by: factor, of: self.b.clone() };
            match method(&self.row, Hlcp::new(a, b, omega()).unwrap()) {
                Err(Error::NotPositive { index: 0, .. } | Error::NotFinite { index: 0, .. }) => {}
                Err(other) => panic!("{self}: {other}"),
                Ok(method) => {
                    assert!(self.row.contains("closure") || eliminates, "{self}");
                    let options = Options::from_x(&self.start).limits(self.limits);
                    let outcome = Solver::new(method).solve(&self.q, options).unwrap();
                    let may_solve = eliminates && factor < T::zero();
                    assert!(may_solve || !outcome.converged(), "{self}: {outcome}");
                }
            }
        }
    }
}

fn table<T: Scalar>() {
    let (a, b) = (stencil::<T>(A), stencil::<T>(B));
    let shared = |operator: FivePoint<T>| -> Arc<dyn Rows<T>> { Arc::new(operator) };
    let arrays =
        |operator: &dyn Rows<T>| -> Arc<dyn Rows<T>> { Arc::new(Csr::from_rows(operator)) };
    let sparse = |operator: FivePoint<T>| CsrMatrix::from(&assembled(&operator));
    let dense = |operator: &dyn Rows<T>| -> Arc<dyn Rows<T>> {
        Arc::new(RowMajor::new(N, assembled(&operator).transpose().as_slice().to_vec()).unwrap())
    };
    // The same solution is planted; the rows reach across the grid's edge.
    let [cylinder, torus] = [a.periodic([true, false]), b.periodic([true, true])];
    let (cylinder, torus) = (cylinder.unwrap(), torus.unwrap());
    let on_torus = a.periodic([true, true]).unwrap();
    for row in &rows() {
        Case::new(row, "stencils", a, b).keeps_all();
        Case::new(row, "closed grids", on_torus, torus).keeps_all();
        if is_on_grids(row) {
            Case::new(row, "shared operators", shared(a), shared(b)).keeps_all();
            let problem = Hlcp::new(Lists::of(&a), Lists::of(&b), omega()).unwrap();
            let refusal = method(row, problem).err();
            assert_eq!(refusal, Some(Error::NotFivePoint { what: "A" }), "{row} needs a grid");
            continue;
        }
        let lists: Arc<dyn Rows<T>> = Arc::new(Lists::of(&a));
        Case::new(row, "assembled matrices", sparse(a), sparse(b)).keeps_all();
        Case::new(row, "a user's operators", Lists::of(&a), Lists::of(&b)).keeps_all();
        Case::new(row, "shared operators", lists, shared(b)).keeps_all();
        Case::new(row, "rows in arrays", arrays(&a), arrays(&b)).keeps_all();
        Case::new(row, "rows in arrays and dense ones", arrays(&a), dense(&b)).keeps_all();
        Case::new(row, "a cylinder and a torus", shared(cylinder), shared(torus)).keeps_all();
    }
}

#[test]
fn every_contract_is_kept_in_double_precision() {
    table::<f64>();
}

#[test]
fn every_contract_is_kept_in_single_precision() {
    table::<f32>();
}

/// Order 1, where every splitting is the whole matrix or a multiple of it.
#[test]
fn every_method_solves_a_problem_of_order_one() {
    for row in &rows() {
        for (q, z, r) in [(-6.3, 1.5, 0.0), (4.1, 0.0, 2.0)] {
            let a = FivePoint::new(1, 1, [-1.1, -0.9, 4.2, -1.3, -0.7]).unwrap();
            let b = FivePoint::new(1, 1, [-0.3, -0.8, 2.05, -0.6, -0.2]).unwrap();
            let problem = Hlcp::new(a, b, Omega::Uniform(1.9)).unwrap().with_gamma(0.6).unwrap();
            let mut solver = Solver::new(method(row, problem).unwrap());
            assert!(solver.solve(&[q], from(&[0.3])).unwrap().converged(), "{row}");
            assert!(
                f64::abs(solver.z()[0] - z) <= 1e-10 && f64::abs(solver.r()[0] - r) <= 1e-10,
                "{row}"
            );
        }
    }
}

/// The bits of a solve: its history, and x, z and r.
fn bits<T: Scalar>(
    method: BoxedMethod<'static, T, impl Rows<T>, impl Rows<T>>,
    q: &[T],
) -> (Vec<[u64; 2]>, Vec<T>) {
    let mut solver = Solver::new(method).with_history(8);
    let limits = Limits { iterations: 6, ..Limits::absolute(1e-10) };
    let outcome =
        solver.solve(q, Options::from_x(&vec![T::one(); q.len()]).limits(limits)).unwrap();
    let norms = solver.history().iter().chain([&outcome.residual]);
    let norms = norms.map(|norms| [norms.l2.to_bits(), norms.linf.to_bits()]).collect();
    (norms, [solver.x(), solver.z(), solver.r()].concat())
}

/// The number of threads changes no bit of an iterate or of a norm.
fn keeps_on_threads<T: Scalar>() {
    // Enough points to be shared, and a multiple of no block.
    let (nx, ny) = (157, 131);
    let wave = |rate: f64| move |i: usize| f64::sin(rate * i as f64);
    let q: Vec<T> = (0..nx * ny).map(wave(1.3)).map(T::of).collect();
    let varying = |centre: f64| {
        let row = |i, j| {
            let v = 0.2 * wave(0.7)(nx * j + i);
            [v - 1.1, v - 0.9, centre - v, v - 1.3, v - 0.7].map(T::of)
        };
        FivePoint::from_fn(nx, ny, row).unwrap()
    };
    let constant = |row: [f64; 5]| FivePoint::new(nx, ny, row.map(T::of)).unwrap();
    let each = Omega::Each((0..nx * ny).map(wave(0.9)).map(|w| T::of(1.4 + 0.3 * w)).collect());
    let of_constants = Hlcp::new(constant(A), constant(B), Omega::Uniform(T::of(1.4))).unwrap();
    let of_arrays = Hlcp::new(varying(6.3), varying(5.9), each).unwrap();
    // On this grid red-black is a name.
    for row in rows() {
        let row = &row.replace(" red-black", "RBGS");
        let constants = bits(method(row, of_constants.clone()).unwrap(), &q);
        let arrays = bits(method(row, of_arrays.clone()).unwrap(), &q);
        for threads in [1, 2, 4, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let shared = of_constants.clone().in_parallel();
                assert!(bits(method(row, shared).unwrap(), &q) == constants, "{row}, {threads}");
                let shared = of_arrays.clone().in_parallel();
                assert!(bits(method(row, shared).unwrap(), &q) == arrays, "{row}, {threads}");
            });
        }
    }
}

#[test]
fn threads_change_no_bit_in_double_precision() {
    keeps_on_threads::<f64>();
}

#[test]
fn threads_change_no_bit_in_single_precision() {
    keeps_on_threads::<f32>();
}

/// A broken promise is a panic on several threads too, and nobody waits for the one that it hits:
/// backward it is the first.
#[test]
fn a_panic_on_one_thread_ends_the_others() {
    let m = 200;
    let a = FivePoint::new(m, m, [-1.1, -0.9, 4.6, -1.2, -0.8]).unwrap();
    let entries = vec![1.0; m * m - 1];
    let view = FivePointView::diagonal(Coefficients::Each(&entries));
    let short = Disguised { of: Identity { order: m * m }, view };
    let problem = Hlcp::new(a, short, Omega::Uniform(4.0)).unwrap().in_parallel();
    let mut backward = Mms::new(problem, Aor::gauss_seidel().backward()).unwrap();
    let (q, x, mut y) = (vec![-1.3; m * m], vec![0.7; m * m], vec![0.0; m * m]);
    let q = Rhs::new(&q).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
    // Of the panics of all threads any may be the one that comes through.
    let ended = panic::catch_unwind(AssertUnwindSafe(|| {
        pool.install(|| backward.step(&q, &x, &mut y, &mut Clock::endless()))
    }));
    assert!(ended.is_err());
}

/// Solves that share their work while their pool has other such solves to do, and within another
/// pool's.
#[test]
fn solves_within_parallel_loops_change_no_bit() {
    use rayon::prelude::*;
    let m = 131;
    let a = FivePoint::new(m, m, A).unwrap();
    let alone = Hlcp::new(a, FivePoint::new(m, m, B).unwrap(), Omega::Uniform(1.4)).unwrap();
    let q: Vec<f64> = (0..m * m).map(|i| f64::sin(1.3 * i as f64)).collect();
    let expected = bits(method("TMGS", alone.clone()).unwrap(), &q);
    let shared = || bits(method("TMGS", alone.clone().in_parallel()).unwrap(), &q);
    // On rayon's own pool, from outside of any.
    assert!(shared() == expected);
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let inner = pool(2);
    for threads in [1, 3] {
        let all = || (0..6).into_par_iter().for_each(|_| assert!(shared() == expected));
        let within = || (0..4).into_par_iter().for_each(|_| inner.install(all));
        pool(threads).install(all);
        pool(threads).install(within);
    }
}

/// A splitting whose solve is worth three sweeps; it may dereference to its pivot and still be one.
struct Thrice(f64);

impl std::ops::Deref for Thrice {
    type Target = f64;

    fn deref(&self) -> &f64 {
        &self.0
    }
}

impl Splitting<f64> for Thrice {
    fn solve(&self, rhs: &[f64], y: &mut [f64]) {
        y.iter_mut().zip(rhs).for_each(|(y, rhs)| *y = rhs / **self);
    }

    fn sweeps(&self) -> usize {
        3
    }
}

#[test]
fn sweeps_are_counted_as_the_splittings_say() {
    let (a, b) = (stencil::<f64>(A), stencil::<f64>(B));
    let problem = || Hlcp::new(a, b, omega()).unwrap();
    // Behind a pointer a step is worth what it is worth.
    let lent: &dyn Splitting<f64> = &Thrice(26.0);
    let mut mms = Mms::with_splitting(problem(), lent).unwrap();
    let boxed: Box<dyn Splitting<f64>> = Box::new(Thrice(26.0));
    let step: Box<dyn Step<f64, FivePoint<f64>, FivePoint<f64>>> = Box::new(SplittingStep(boxed));
    let mut tmms = Tmms::new(problem(), step, Aor::gauss_seidel()).unwrap();
    let [z, r] = solution();
    let q = planted_q(&a, &b, [&z, &r]);
    let seven = |method: &mut dyn Method<f64, A = FivePoint<f64>, B = FivePoint<f64>>| {
        let [mut x, mut y, mut spare] = [[0.6; N], [0.0; N], [0.0; N]].map(Vec::from);
        for _ in 0..7 {
            let _ = method.step(&Rhs::new(&q).unwrap(), &x, &mut y, &mut Clock::endless());
            method.complete(&Rhs::new(&q).unwrap(), &mut y, &mut spare);
            std::mem::swap(&mut x, &mut y);
        }
        method.work()
    };
    assert_eq!(seven(&mut mms), Some(Work::sweeps(3 * 7)));
    assert_eq!(seven(&mut tmms), Some(Work::sweeps(4 * 7)));
    // A solve counts its own alone.
    let limits = Limits { iterations: 5, ..Limits::absolute(1e-10) };
    let outcome = Solver::new(mms).solve(&q, Options::from_x(&[0.6; N]).limits(limits)).unwrap();
    assert_eq!((outcome.iterations, outcome.sweeps), (5, 15));
}
