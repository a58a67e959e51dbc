//! The sweeps against the machine's limit: prints the tables of `docs/results/sweeps.md`.
//!
//! ```text
//! cargo bench --bench sweeps
//! ```
//!
//! Rivals run in turns, and each figure is the median of the ratios of the turns. One thread unless
//! said. The cost per point goes to `docs/charts/cost-per-point.csv`, which `hlcp charts --draw`
//! draws.

mod common;
#[path = "../tests/common/counting.rs"]
mod counting;

use std::{cell::RefCell, error::Error, fs, hint::black_box, path::Path, time::Instant};

use common::{TURNS, against, done, machine, median, seconds, solved_on};
use hlcp_core::{
    Aor, Csr, Diagonal, FivePoint, Hlcp, LinearOperator, Omega, Rhs, Rows, Scalar, Scaled, Step,
    Sum,
};
use hlcp_methods::{Limits, Method, Options, Solver, Tmms};
use hlcp_verify::{Example, Posed};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Five-point rows as a user would write them, on an operator that does not tell of its grid.
struct Walked<T> {
    m: usize,
    row: [T; 5],
}

impl<T: Scalar> LinearOperator<T> for Walked<T> {
    fn order(&self) -> usize {
        self.m * self.m
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        for (i, y) in y.iter_mut().enumerate() {
            *y = T::zero();
            self.visit_row(i, &mut |j, a| *y += a * x[j]);
        }
    }
}

impl<T: Scalar> Diagonal<T> for Walked<T> {
    fn diagonal_entry(&self, _: usize) -> T {
        self.row[2]
    }
}

impl<T: Scalar> Rows<T> for Walked<T> {
    #[inline]
    fn visit_row(&self, k: usize, visit: &mut dyn FnMut(usize, T)) {
        let (m, [south, west, centre, east, north]) = (self.m, self.row);
        let (i, j) = (k % m, k / m);
        if j > 0 && south != T::zero() {
            visit(k - m, south);
        }
        if i > 0 && west != T::zero() {
            visit(k - 1, west);
        }
        visit(k, centre);
        if i + 1 < m && east != T::zero() {
            visit(k + 1, east);
        }
        if j + 1 < m && north != T::zero() {
            visit(k + m, north);
        }
    }
}

/// Example 1 with μ = ν = 4 and Ω = 1.1 I, and vectors to sweep over.
struct Scene<T> {
    m: usize,
    a: FivePoint<T>,
    b: FivePoint<T>,
    q: Vec<T>,
    x: Vec<T>,
    y: Vec<T>,
    parallel: bool,
}

impl<T: Scalar> Scene<T> {
    fn new(m: usize) -> Result<Self, Box<dyn Error>> {
        let stencil = |c: [f64; 5]| FivePoint::new(m, m, c.map(T::of));
        let wave =
            |rate: f64| (0..m * m).map(|i| T::of((i as f64 * rate).sin())).collect::<Vec<T>>();
        Ok(Self {
            m,
            a: stencil([-1.0, -1.0, 8.0, -1.0, -1.0])?,
            b: stencil([0.0, -1.0, 8.0, -1.0, 0.0])?,
            q: wave(1.0),
            x: wave(1.7),
            y: vec![T::zero(); m * m],
            parallel: false,
        })
    }

    fn sweep(&mut self, what: Sweep) -> f64 {
        let Self { m, a, b, q, x, y, parallel } = self;
        let omega = Omega::Uniform(T::of(1.1));
        let aor = Aor::new(T::of(1.1), T::of(0.9)).expect("parameters");
        let rhs = Rhs::new(q).expect("finite");
        let problem = Hlcp::new(*a, *b, omega.clone()).expect("a problem");
        let problem = if *parallel { problem.in_parallel() } else { problem };
        let walked = |of: &FivePoint<T>| {
            let row = of.as_five_point().and_then(|view| view.constants()).expect("five numbers");
            Walked { m: *m, row }
        };
        let boxed = |of: &FivePoint<T>| Box::new(walked(of)) as Box<dyn Rows<T>>;
        let dynamic = Hlcp::new(boxed(a), boxed(b), omega.clone()).expect("a problem");
        let walked = Hlcp::new(walked(a), walked(b), omega).expect("a problem");
        let scratch = &mut Vec::new();
        seconds(*m, || match what {
            Sweep::Triad => triad(x, q, y),
            Sweep::Mms => done(aor.step(&problem, &rhs, x, y, scratch)),
            Sweep::Backward => done(aor.backward().step(&problem, &rhs, x, y, scratch)),
            Sweep::RedBlack => {
                let red_black = aor.red_black(*m).expect("a grid");
                done(red_black.step(&problem, &rhs, x, y, scratch));
            }
            Sweep::Amms => done(aor.accelerated().step(&problem, &rhs, x, y, &mut vec![])),
            Sweep::Residual => done(problem.residual(&rhs, x, y, scratch)),
            Sweep::Obvious => done(obvious(*m, q, x, y)),
            Sweep::Walked => done(aor.step(&walked, &rhs, x, y, scratch)),
            Sweep::Dynamic => done(aor.step(&dynamic, &rhs, x, y, scratch)),
        })
    }
}

#[derive(Clone, Copy)]
enum Sweep {
    Triad,
    Mms,
    Backward,
    RedBlack,
    Amms,
    Residual,
    Obvious,
    Walked,
    Dynamic,
}

fn triad<T: Scalar>(x: &[T], q: &[T], y: &mut [T]) {
    let factor = T::of(0.3);
    for ((y, &x), &q) in y.iter_mut().zip(x).zip(q) {
        *y = factor * x + q;
    }
    black_box(y);
}

/// The half-step as one would write it first: everything fused, point by point, with the sum of
/// squares.
fn obvious<T: Scalar>(m: usize, q: &[T], x: &[T], y: &mut [T]) -> T {
    let (one, omega) = (T::one(), T::of(1.1));
    let (over_alpha, triangle) = (T::of(1.1).recip(), T::of(0.9) / T::of(1.1));
    let (a, b) = (-one, -one * omega);
    let (a_centre, b_centre) = (T::of(8.0), T::of(8.0) * omega);
    let over_pivot = ((a_centre + b_centre) * over_alpha).recip();
    let mut squares = T::zero();
    for j in 0..m {
        for i in 0..m {
            let k = j * m + i;
            let at = |inside: bool, k: usize| if inside { x[k] } else { T::zero() };
            let [s, w] = [at(j > 0, k.wrapping_sub(m)), at(i > 0, k.wrapping_sub(1))];
            let [e, n] = [at(i + 1 < m, k + 1), at(j + 1 < m, k + m)];
            let (c, z) = (x[k], |v: T| v.abs() + v);
            let r = |v: T| v.abs() - v;
            let f = q[k] + a_centre * z(c) + a * (z(s) + z(w) + z(e) + z(n))
                - b_centre * r(c)
                - b * (r(w) + r(e));
            let new = |inside: bool, k: usize| if inside { y[k] } else { T::zero() };
            let moved = triangle * (a + b) * (new(i > 0, k.wrapping_sub(1)) - w)
                + triangle * a * (new(j > 0, k.wrapping_sub(m)) - s);
            y[k] = c - (f + moved) * over_pivot;
            squares += f * f;
        }
    }
    squares
}

fn compare<T: Scalar>(m: usize, ours: Sweep, theirs: Sweep) -> Result<(f64, f64), Box<dyn Error>> {
    let scene = RefCell::new(Scene::<T>::new(m)?);
    Ok(against(|| scene.borrow_mut().sweep(ours), || scene.borrow_mut().sweep(theirs)))
}

/// What a step costs at the least that takes F in double precision and corrects by a sweep in
/// single precision, against a step in double precision: one pass for the one and one for the
/// other, without the conversions and the update.
fn corrected_in_single(m: usize) -> Result<(f64, f64), Box<dyn Error>> {
    let (wide, mut narrow) = (RefCell::new(Scene::<f64>::new(m)?), Scene::<f32>::new(m)?);
    Ok(against(
        || wide.borrow_mut().sweep(Sweep::Residual) + narrow.sweep(Sweep::Mms),
        || wide.borrow_mut().sweep(Sweep::Mms),
    ))
}

/// The time on one thread over the time on those of `pool`, and that time.
fn shared<T: Scalar>(
    m: usize,
    what: Sweep,
    pool: &ThreadPool,
) -> Result<(f64, f64), Box<dyn Error>> {
    let mut scenes = [Scene::<T>::new(m)?, Scene::<T>::new(m)?];
    scenes[1].parallel = true;
    let [alone, together] = &mut scenes;
    let (ratio, alone) = against(|| alone.sweep(what), || pool.install(|| together.sweep(what)));
    Ok((ratio, alone / ratio))
}

/// A half-step with every coefficient and Ω in arrays, against a pass that reads as many arrays;
/// and its time on one thread over that on those of `pool`.
fn varying(m: usize, pool: &ThreadPool) -> Result<[(f64, f64); 2], Box<dyn Error>> {
    let n = m * m;
    let wave = |seed: f64, size: f64| move |k: usize| size * (seed + k as f64).sin();
    let omega: Vec<f64> = (0..n).map(wave(3.0, 0.2)).map(|w| w + 1.0).collect();
    let problem =
        Hlcp::new(common::varying(m, 1.0)?, common::varying(m, 2.0)?, Omega::Each(omega))?;
    let (q, x): (Vec<f64>, Vec<f64>) =
        (0..n).map(|k| (wave(4.0, 1.0)(k), wave(5.0, 1.0)(k))).unzip();
    let (rhs, aor) = (Rhs::new(&q)?, Aor::new(1.1, 0.9)?);
    let read: Vec<Vec<f64>> = (0..13).map(|_| q.clone()).collect();
    let (y, mut z) = (RefCell::new(vec![0.0; n]), vec![0.0; n]);
    let together = problem.clone().in_parallel();
    let mut alone =
        || seconds(m, || done(aor.step(&problem, &rhs, &x, &mut y.borrow_mut(), &mut vec![])));
    let mut in_pool =
        || pool.install(|| seconds(m, || done(aor.step(&together, &rhs, &x, &mut z, &mut vec![]))));
    let (ratio, time) = against(&mut alone, &mut in_pool);
    let of_threads = (ratio, time / ratio);
    let of_passes = against(&mut alone, || {
        seconds(m, || {
            let y = &mut *y.borrow_mut();
            let lists: [&[f64]; 13] = std::array::from_fn(|i| &read[i][..n]);
            for k in 0..n {
                let mut sum = 0.0;
                for list in &lists {
                    sum += list[k];
                }
                y[k] = 0.3 * sum;
            }
            black_box(y);
        })
    });
    Ok([of_passes, of_threads])
}

/// `A + B` and `A − B` assembled on one pattern, by rows: what F reads for Ω = I.
struct Assembled {
    starts: Vec<usize>,
    columns: Vec<u32>,
    sums: Vec<f64>,
    differences: Vec<f64>,
}

impl Assembled {
    fn new(a: &FivePoint<f64>, b: &FivePoint<f64>) -> Self {
        let [sums, differences] =
            [1.0, -1.0].map(|by| Csr::from_rows(&Sum(a, Scaled { by, of: b })));
        let ((starts, columns, sums), (.., differences)) = (sums.arrays(), differences.arrays());
        let columns = columns.into_iter().map(|j| j as u32).collect();
        Self { starts, columns, sums: sums.to_vec(), differences: differences.to_vec() }
    }

    /// A Gauss–Seidel half-step from `x` to `y` in one pass, and ‖F(x)‖².
    fn sweep(&self, q: &[f64], x: &[f64], y: &mut [f64], backward: bool) -> f64 {
        let n = x.len();
        let mut squares = 0.0;
        for step in 0..n {
            let i = if backward { n - 1 - step } else { step };
            let entries = self.starts[i]..self.starts[i + 1];
            let (mut f, mut moved, mut pivot) = (q[i], 0.0, 1.0);
            let values = self.sums[entries.clone()].iter().zip(&self.differences[entries.clone()]);
            for (&j, (&sum, &difference)) in self.columns[entries].iter().zip(values) {
                let j = j as usize;
                f += sum * x[j] + difference * x[j].abs();
                if j == i {
                    pivot = sum;
                } else if (j < i) != backward {
                    moved += sum * (y[j] - x[j]);
                }
            }
            y[i] = x[i] - (f + moved) / pivot;
            squares += f * f;
        }
        squares
    }
}

/// TMGS on Example 1, with its right-hand side.
type Tmgs = (Solver<f64, Tmms<f64, FivePoint<f64>, FivePoint<f64>, Aor<f64>, Aor<f64>>>, Vec<f64>);

fn tmgs(m: usize, parallel: bool) -> Result<Tmgs, Box<dyn Error>> {
    let Posed { a, b, q, .. } = Example { symmetric: true, m, mu: 4.0, nu: 4.0 }.pose::<f64>()?;
    let problem = Hlcp::new(a, b, Omega::Uniform(1.0))?;
    let problem = if parallel { problem.in_parallel() } else { problem };
    Ok((Solver::new(Tmms::mirrored(problem, Aor::gauss_seidel())?), q))
}

/// TMGS on Example 1: our solve against the same iteration on assembled matrices; the ratio theirs
/// / ours.
fn solve(m: usize) -> Result<(f64, f64), Box<dyn Error>> {
    let (mut solver, q) = tmgs(m, false)?;
    let (start, limits) = (vec![1.0; m * m], Limits::absolute(1e-10));
    let matrices = Assembled::new(solver.method().problem().a(), solver.method().problem().b());
    let (mut x, mut y) = (start.clone(), start.clone());
    let (ratio, theirs) = against(
        || {
            let clock = Instant::now();
            x.copy_from_slice(&start);
            while matrices.sweep(&q, &x, &mut y, false).sqrt() > 1e-10 {
                matrices.sweep(&q, &y, &mut x, true);
            }
            clock.elapsed().as_secs_f64()
        },
        || {
            let options = Options::from_x(&start).limits(limits);
            let outcome = solver.solve(&q, options).expect("valid input");
            assert!(outcome.converged());
            outcome.elapsed.as_secs_f64()
        },
    );
    Ok((ratio, theirs / ratio))
}

/// TMGS on Example 1, the whole solve: the time on one thread over that on those of `pool`, and
/// that time.
fn shared_solve(m: usize, pool: &ThreadPool) -> Result<(f64, f64), Box<dyn Error>> {
    let ((alone, q), (together, _)) = (tmgs(m, false)?, tmgs(m, true)?);
    let (ratio, time) = solved_on(pool, [alone, together], &q);
    Ok((ratio, time / ratio))
}

/// The most memory that is held during a solve, in vectors of length n.
fn vectors(m: usize) -> Result<f64, Box<dyn Error>> {
    let before = counting::LIVE.get();
    counting::PEAK.set(before);
    let ((mut solver, q), start) = (tmgs(m, false)?, vec![1.0; m * m]);
    // Posing the scene took more: the solution it was planted with.
    counting::PEAK.set(counting::LIVE.get());
    assert!(solver.solve(&q, Options::from_x(&start).limits(Limits::absolute(1e-10)))?.converged());
    Ok((counting::PEAK.get() - before) as f64 / (8 * m * m) as f64)
}

/// The cost per point from m = 64 to 8192, kind by kind, as a table and as data.
fn cost_per_point(pool: &ThreadPool) -> Result<(), Box<dyn Error>> {
    let kinds = [
        ("MMS", Sweep::Mms, false),
        ("MMS backward", Sweep::Backward, false),
        ("AMMS", Sweep::Amms, false),
        ("red–black", Sweep::RedBlack, false),
        ("MMS, 2 threads", Sweep::Mms, true),
        ("triad", Sweep::Triad, false),
    ];
    let lines = || kinds.iter().map(|(name, ..)| format!(" {name} |")).collect::<String>();
    println!("\nns per point\n\n| m |{}\n|---{}|", lines(), "|---".repeat(kinds.len()));
    let (mut rows, machine) = (String::from("m,kind,ns per point,machine and day\n"), machine());
    for m in [64, 128, 256, 512, 1024, 2048, 4096, 8192] {
        let mut scene = Scene::<f64>::new(m)?;
        let mut times = vec![vec![]; kinds.len()];
        for _ in 0..TURNS {
            for ((_, what, parallel), times) in kinds.iter().zip(&mut times) {
                scene.parallel = *parallel;
                let mut run = || scene.sweep(*what);
                times.push(if *parallel { pool.install(run) } else { run() });
            }
        }
        print!("| {m} |");
        for ((kind, ..), times) in kinds.iter().zip(times) {
            let y = median(times) / (m * m) as f64 * 1e9;
            print!(" {y:.3} |");
            rows += &format!("{m},\"{kind}\",{y:.4},\"{machine}\"\n");
        }
        println!();
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/charts/cost-per-point.csv");
    Ok(fs::write(path, rows)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let pool = ThreadPoolBuilder::new().num_threads(2).build()?;
    println!("{}\n", machine());
    println!("| what | against | ratio | target | ns per point |\n|---|---|---|---|---|");
    let row = |what: &str, rival: &str, m: usize, target: &str, figures| {
        common::row(what, rival, target, m * m, figures);
    };
    use Sweep::{Amms, Backward, Dynamic, Mms, Obvious, RedBlack, Triad, Walked};
    let compared = |rows: &[(&str, &str, usize, &str, Sweep, Sweep)]| {
        for &(what, rival, m, target, ours, theirs) in rows {
            let figures = compare::<f64>(m, ours, theirs)?;
            row(&format!("{what}, m = {m}"), rival, m, target, figures);
        }
        Ok::<_, Box<dyn Error>>(())
    };
    compared(&[
        ("half-step with norm", "triad", 512, "≤ 4.0", Mms, Triad),
        ("half-step with norm", "triad", 4096, "≤ 2.0", Mms, Triad),
        ("backward", "triad", 512, "≤ 4.0", Backward, Triad),
        ("backward", "triad", 4096, "≤ 2.0", Backward, Triad),
        ("red–black", "triad", 512, "≤ 4.0", RedBlack, Triad),
        ("red–black", "triad", 4096, "≤ 2.0", RedBlack, Triad),
        ("obvious loop", "half-step", 512, "≥ 3.5", Obvious, Mms),
        ("AMMS half-step", "MMS half-step", 512, "≤ 1.3", Amms, Mms),
        ("AMMS half-step", "MMS half-step", 4096, "≤ 1.3", Amms, Mms),
    ])?;
    let [of_passes, of_threads] = varying(4096, &pool)?;
    row("varying coefficients and Ω, m = 4096", "pass over 13 arrays", 4096, "≤ 2.5", of_passes);
    for m in [512, 4096] {
        let mut narrow = Scene::<f32>::new(m)?;
        let mut wide = Scene::<f64>::new(m)?;
        let figures = against(|| narrow.sweep(Mms), || wide.sweep(Mms));
        row(&format!("f32 half-step, m = {m}"), "f64 half-step", m, "≤ 0.6", figures);
    }
    for m in [512, 4096] {
        let what = format!("F in f64 and a sweep in f32, m = {m}");
        row(&what, "half-step in f64", m, "", corrected_in_single(m)?);
    }
    row("assembled TMGS, whole solve, m = 512", "ours", 512, "≥ 6", solve(512)?);
    compared(&[
        ("walk over a user's rows", "obvious loop", 512, "≤ 2.5", Walked, Obvious),
        ("the same behind dyn", "obvious loop", 512, "", Dynamic, Obvious),
    ])?;
    for m in [1024, 4096] {
        for (name, what) in
            [("half-step", Mms), ("backward", Backward), ("AMMS", Amms), ("red–black", RedBlack)]
        {
            let figures = shared::<f64>(m, what, &pool)?;
            row(&format!("one thread, {name}, m = {m}"), "2 threads", m, "≥ 1.7", figures);
        }
        let figures = shared::<f32>(m, Mms, &pool)?;
        row(&format!("one thread, f32, m = {m}"), "2 threads", m, "≥ 1.7", figures);
        let figures = shared_solve(m, &pool)?;
        row(&format!("one thread, whole solve, m = {m}"), "2 threads", m, "≥ 1.7", figures);
    }
    row("one thread, varying, m = 4096", "2 threads", 4096, "≥ 1.7", of_threads);
    println!("| peak memory of a solve, m = 4096 | a vector | {:.2} | ≤ 5 | |", vectors(4096)?);
    cost_per_point(&pool)
}
