//! Ranks that share a problem come to the bits of one process.

use std::{
    fmt,
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    thread,
    time::Duration,
};

use hlcp_core::{
    Error, FivePoint, Hlcp, LinearOperator, Norms, Omega, Ranks, Rows, Scalar, Shifted, Strip,
    VaryingFivePoint, ranks_as_threads,
};
use hlcp_methods::{
    Anderson, Limits, Method, Mms, Named, Newton, Norm, Options, Parameters, Progress, Solver,
    Ssor, Status,
};

/// A number in −1..1 without pattern.
fn noise(seed: usize) -> f64 {
    let mixed = (seed as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((mixed ^ mixed >> 31).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / (1_u64 << 52) as f64
        - 1.0
}

/// Which problem, on which grid.
#[derive(Debug, Clone, Copy)]
struct Case {
    grid: [usize; 2],
    varying: bool,
    threads: usize,
}

/// The part of a solve that does not depend on who makes it.
#[derive(Debug, PartialEq)]
struct Course<T> {
    history: Vec<Norms>,
    status: Status,
    iterations: usize,
    residual: Norms,
    x: Option<Vec<T>>,
}

/// The strip, or the whole grid.
fn vector<T: Scalar>(
    strip: Option<&Strip>,
    [nx, ny]: [usize; 2],
    entry: impl Fn(usize, usize) -> f64,
) -> Vec<T> {
    match strip {
        Some(strip) => strip.vector(|i, j| T::of(entry(i, j))),
        None => (0..nx * ny).map(|k| T::of(entry(k % nx, k / nx))).collect(),
    }
}

fn course<T: Scalar>(strip: Option<&Strip>, case: Case, name: &str) -> Course<T> {
    let to = |row: [f64; 5]| row.map(T::of);
    let ([nx, ny], first) = strip.map_or((case.grid, 0), |s| (s.grid(), s.columns().start));
    let omega = |i, j| 0.9 + 0.2 * noise(5 * i + 7 * j);
    if case.varying {
        let row = |sign: f64| {
            move |i: usize, j: usize| {
                let n = noise(3 * (i + first) + 11 * j);
                to([-0.9 + 0.1 * n, -0.8, 4.0 + sign * n, -1.1 - 0.2 * n, -0.7])
            }
        };
        let a = VaryingFivePoint::from_fn(nx, ny, row(0.7)).unwrap();
        let b = VaryingFivePoint::from_fn(nx, ny, row(-0.5)).unwrap();
        let omega = Omega::Each(vector(strip, case.grid, omega));
        solved(strip, case, name, a, b, omega)
    } else {
        let a = FivePoint::new(nx, ny, to([-1.1, -0.9, 4.3, -1.3, -0.7])).unwrap();
        let b = Shifted {
            by: T::of(0.5),
            of: FivePoint::new(nx, ny, to([0.0, -0.8, 3.6, -0.6, 0.0])).unwrap(),
        };
        solved(strip, case, name, a, b, Omega::Uniform(T::of(1.1)))
    }
}

fn solved<T, A, B>(
    strip: Option<&Strip>,
    case: Case,
    name: &str,
    a: A,
    b: B,
    omega: Omega<T>,
) -> Course<T>
where
    T: Scalar,
    A: Rows<T> + Clone + Send + Sync + 'static,
    B: Rows<T> + Clone + Send + Sync + 'static,
{
    let mut problem = Hlcp::new(a, b, omega).unwrap().with_gamma(T::of(1.7)).unwrap();
    if name.contains("exchanged") {
        return followed(strip, case, "TMGS", shared(strip, problem).exchanged().unwrap());
    }
    if case.threads > 1 {
        problem = problem.in_parallel();
    }
    followed(strip, case, name, shared(strip, problem))
}

fn shared<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    strip: Option<&Strip>,
    problem: Hlcp<T, A, B>,
) -> Hlcp<T, A, B> {
    match strip {
        Some(strip) => problem.shared_by(strip).unwrap(),
        None => problem,
    }
}

fn followed<T, A, B>(
    strip: Option<&Strip>,
    case: Case,
    name: &str,
    problem: Hlcp<T, A, B>,
) -> Course<T>
where
    T: Scalar,
    A: Rows<T> + Clone + 'static,
    B: Rows<T> + Clone + 'static,
{
    let open = name.ends_with("SOR") || name.ends_with("AOR");
    let parameters = Parameters {
        alpha: open.then_some(1.2),
        beta: name.ends_with("AOR").then_some(0.8),
        ..Parameters::default()
    };
    let method: Box<dyn Method<T, A = A, B = B>> = match name {
        "Anderson on AMGS" => {
            let base = hlcp_core::Aor::gauss_seidel().accelerated();
            Box::new(Anderson::new(Mms::new(problem, base).unwrap(), 4).unwrap())
        }
        "by the diagonal" => Box::new(Mms::new(problem, hlcp_core::Jacobi).unwrap()),
        name => Named::parse(name, parameters).unwrap().on(problem).unwrap(),
    };
    let q = vector(strip, case.grid, |i, j| noise(13 * i + 5 * j + 2));
    let start = vector(strip, case.grid, |i, j| noise(i + 17 * j));
    let mut solver = Solver::new(method).with_history(100);
    let limits = Limits { iterations: 14, ..Limits::relative(1e-6) };
    let outcome = solver.solve(&q, Options::from_x(&start).limits(limits)).unwrap();
    let x = match strip {
        Some(strip) => strip.gather(solver.x()),
        None => Some(solver.x().to_vec()),
    };
    let history = solver.history().to_vec();
    let (status, iterations, residual) = (outcome.status, outcome.iterations, outcome.residual);
    Course { history, status, iterations, residual, x }
}

const NAMES: [&str; 12] = [
    "MJ",
    "TMGS",
    "TMAOR",
    "AMGS",
    "AMSOR",
    "MRBGS",
    "TMRBSOR",
    "AMRBGS",
    "ADAPTIVE",
    "ANDERSON",
    "Anderson on AMGS",
    "by the diagonal",
];

fn agrees<T: Scalar>(case: Case, name: &str, ranks: usize) {
    let alone = course::<T>(None, Case { threads: 1, ..case }, name);
    let together = ranks_as_threads(ranks, |ranks| {
        let strip = Strip::new(ranks, case.grid).unwrap();
        if case.threads == 1 {
            return course::<T>(Some(&strip), case, name);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(case.threads).build().unwrap();
        pool.install(|| course::<T>(Some(&strip), case, name))
    });
    assert!(alone.history.len() > 5, "{name}: {alone:?}");
    for (rank, course) in together.into_iter().enumerate() {
        assert_eq!(course.history, alone.history, "{name}, {case:?}, {rank} of {ranks}");
        let expected = [alone.status == course.status, alone.iterations == course.iterations];
        assert_eq!(expected, [true; 2], "{name}, {case:?}, {rank} of {ranks}");
        assert_eq!(course.residual, alone.residual, "{name}, {case:?}, {rank} of {ranks}");
        assert!(rank > 0 || course.x == alone.x, "{name}, {case:?}, {ranks} ranks");
    }
}

#[test]
fn any_number_of_ranks_comes_to_the_bits_of_one_process() {
    for (k, name) in NAMES.into_iter().chain(["exchanged"]).enumerate() {
        for ranks in [1, 2, 3, 5] {
            let grid = [[1300, 19], [1025, 9], [1111, 1], [1281, 8]][(k + ranks) % 4];
            for varying in [false, true] {
                let case = Case { grid, varying, threads: 1 };
                agrees::<f64>(case, name, ranks);
                agrees::<f32>(case, name, ranks);
            }
        }
    }
}

#[test]
fn threads_inside_ranks_change_no_bit() {
    for name in ["TMAOR", "AMRBGS", "ANDERSON"] {
        for (ranks, varying) in [(1, true), (2, false), (3, true)] {
            agrees::<f64>(Case { grid: [1300, 70], varying, threads: 2 }, name, ranks);
        }
    }
}
