//! Ranks that share a problem come to the bits of one process.

mod common;

use std::{
    fmt,
    ops::ControlFlow,
    panic,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    thread,
    time::Duration,
};

use common::{asked, named, noise, over};
use hlcp_core::{
    Aor, Csr, Error, FivePoint, Hlcp, Identity, Jacobi, LinearOperator, Multicolour, Norms, Omega,
    Ranks, Rows, Scalar, Shifted, Step, Strip, Transfer, ranks_as_threads,
};
use hlcp_methods::{
    Anderson, BoxedMethod, Clock, Cycle, Divergence, Limits, Method, Mms, Multigrid, Named, Norm,
    Options, Parameters, Progress, Solver, Status,
};

/// Which problem, on which grid.
#[derive(Debug, Clone, Copy)]
struct Case {
    grid: [usize; 2],
    varying: bool,
    threads: usize,
}

/// The history, status, iterations and residual of a solve, which do not depend on who makes it,
/// and the iterate, which rank 0 has.
type Course<T> = ((Vec<Norms>, Status, usize, Norms), Option<Vec<T>>);

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
    let (a, b, omega): (Arc<dyn Rows<T>>, Arc<dyn Rows<T>>, _) = if case.varying {
        let operator = |sign: f64| {
            let row = |i: usize, j: usize| {
                let n = noise(3 * (i + first) + 11 * j);
                to([-0.9 + 0.1 * n, -0.8, 4.0 + sign * n, -1.1 - 0.2 * n, -0.7])
            };
            Arc::new(FivePoint::from_fn(nx, ny, row).unwrap())
        };
        let omega = vector(strip, case.grid, |i, j| 0.9 + 0.2 * noise(5 * i + 7 * j));
        (operator(0.7), operator(-0.5), Omega::Each(omega))
    } else {
        let a = FivePoint::new(nx, ny, to([-1.1, -0.9, 4.3, -1.3, -0.7])).unwrap();
        let b = FivePoint::new(nx, ny, to([0.0, -0.8, 3.6, -0.6, 0.0])).unwrap();
        let b = Shifted { by: T::of(0.5), of: b };
        (Arc::new(a), Arc::new(b), Omega::Uniform(T::of(1.1)))
    };
    let mut problem = Hlcp::new(a, b, omega).unwrap().with_gamma(T::of(1.7)).unwrap();
    if case.threads > 1 {
        problem = problem.in_parallel();
    }
    if let Some(strip) = strip {
        problem = problem.shared_by(strip).unwrap();
    }
    let method: BoxedMethod<'_, T, _, _> = match name {
        "Anderson on AMGS" => {
            let base = Aor::gauss_seidel().accelerated();
            Box::new(Anderson::new(Mms::new(problem, base).unwrap(), 4).unwrap())
        }
        "by the diagonal" => Box::new(Mms::new(problem, Jacobi).unwrap()),
        "exchanged" => named("TMGS", [1.2, 0.8]).on(problem.exchanged().unwrap()).unwrap(),
        name => named(name, [1.2, 0.8]).on(problem).unwrap(),
    };
    let q = vector(strip, case.grid, |i, j| noise(13 * i + 5 * j + 2));
    let start = vector(strip, case.grid, |i, j| noise(i + 17 * j));
    let mut solver = Solver::new(method).with_history(100);
    // So many that AUTO gives cycles a turn.
    let iterations = if name == "AUTO" { 60 } else { 14 };
    let limits = Limits { iterations, ..Limits::relative(1e-12) };
    let outcome = solver.solve(&q, Options::from_x(&start).limits(limits)).unwrap();
    let x = strip.map_or_else(|| Some(solver.x().to_vec()), |strip| strip.gather(solver.x()));
    let history = solver.history().to_vec();
    ((history, outcome.status, outcome.iterations, outcome.residual), x)
}

const NAMES: [&str; 15] = [
    "MJ", "TMGS", "TMAOR", "AMGS", "AMSOR", "MRBGS", "TMRBSOR", "AMRBGS", "ADAPTIVE", "ANDERSON",
    "MGV", "MGF", "MGW", "FMG", "AUTO",
];

/// What has no name.
const BESIDE: [&str; 3] = ["Anderson on AMGS", "by the diagonal", "exchanged"];

/// Holds that ranks, slow ones if there is a seed of their pauses, come to the bits of one process.
fn agrees<T: Scalar>(case: Case, name: &str, ranks: usize, slow: Option<u64>) {
    let (alone, x) = course::<T>(None, Case { threads: 1, ..case }, name);
    let together = ranks_as_threads(ranks, |ranks| {
        let slow = slow.map(AtomicU64::new);
        let ranks = Arc::new(Watched { slow, ..Watched::new(ranks) });
        let strip = Strip::new(ranks, case.grid).unwrap();
        if case.threads == 1 {
            return course::<T>(Some(&strip), case, name);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(case.threads).build().unwrap();
        pool.install(|| course::<T>(Some(&strip), case, name))
    });
    assert!(alone.0.len() > 1, "{name}, {case:?}: {:?}", alone.0);
    for (rank, (course, gathered)) in together.into_iter().enumerate() {
        assert_eq!(course, alone, "{name}, {case:?}, {rank} of {ranks}");
        assert!(rank > 0 || gathered == x, "{name}, {case:?}, {ranks} ranks");
    }
}

#[test]
fn any_number_of_ranks_comes_to_the_bits_of_one_process() {
    for (k, name) in NAMES.into_iter().chain(BESIDE).enumerate() {
        for ranks in [1, 2, 3, 5] {
            let grid = [[1300, 19], [1025, 9], [1111, 1], [1281, 8]][(k + ranks) % 4];
            // Of one row AUTO makes a tridiagonal problem, which one process solves by elimination.
            let grid = if name == "AUTO" { [grid[0], 7 + ranks] } else { grid };
            let varying = (k + ranks / 2).is_multiple_of(2);
            agrees::<f64>(Case { grid, varying, threads: 1 }, name, ranks, None);
            agrees::<f32>(Case { grid, varying: !varying, threads: 1 }, name, ranks, None);
        }
    }
}

#[test]
fn threads_inside_ranks_change_no_bit() {
    let methods =
        [("TMAOR", 1, true), ("AMRBGS", 2, false), ("ANDERSON", 3, true), ("FMG", 2, true)];
    for (name, ranks, varying) in methods {
        agrees::<f64>(Case { grid: [1300, 70], varying, threads: 2 }, name, ranks, None);
    }
}

type Laplacian = Hlcp<f64, FivePoint<f64>, FivePoint<f64>>;

const GRID: [usize; 2] = [700, 6];

/// A problem that ranks share on a grid, with its right-hand side.
fn on_grid(ranks: Arc<dyn Ranks>, grid: [usize; 2]) -> (Strip, Laplacian, Vec<f64>) {
    let strip = Strip::new(ranks, grid).unwrap();
    let [nx, ny] = strip.grid();
    let a = FivePoint::new(nx, ny, [-1.0, -1.0, 4.3, -1.0, -1.0]).unwrap();
    let problem = Hlcp::new(a, a, Omega::Uniform(1.0)).unwrap().shared_by(&strip).unwrap();
    let q = strip.vector(|i, j| noise(i + grid[0] * j));
    (strip, problem, q)
}

/// All ranks have the same, and this is it.
fn same<V: PartialEq + fmt::Debug>(found: Vec<V>, expected: &V) {
    found.iter().for_each(|found| assert_eq!(found, expected));
}

#[test]
fn a_bad_entry_on_one_rank_is_one_error_on_all() {
    let solved = |[i, j]: [usize; 2], value: f64| {
        ranks_as_threads(2, |ranks| {
            let (strip, problem, mut q) = on_grid(ranks, GRID);
            let mut start = vec![1.0; q.len()];
            let at = (0..q.len()).find(|&k| strip.index(k) == i + GRID[0] * j);
            let vector = if value.is_nan() { &mut q } else { &mut start };
            at.into_iter().for_each(|at| vector[at] = value);
            let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
            solver.solve(&q, Options::from_x(&start)).unwrap_err().to_string()
        })
    };
    same(solved([300, 2], f64::NAN), &"q[1700] is NaN, which is not a finite number".into());
    same(solved([5, 1], f64::INFINITY), &"x0[705] is inf, which is not a finite number".into());

    // A pivot of M that is not positive, and an error that only one rank has.
    let pivots = ranks_as_threads(2, |ranks| {
        let strip = Strip::new(ranks, GRID).unwrap();
        let [nx, ny] = strip.grid();
        let first = strip.columns().start;
        let row = |i, j| [0.0, 0.0, if (i + first, j) == (400, 3) { -1.0 } else { 2.0 }, 0.0, 0.0];
        let a = FivePoint::from_fn(nx, ny, row).unwrap();
        let b = FivePoint::new(nx, ny, [0.0, 0.0, 1.0, 0.0, 0.0]).unwrap();
        let problem = Hlcp::new(a, b, Omega::Uniform(1.0)).unwrap().shared_by(&strip).unwrap();
        Mms::new(problem, Aor::gauss_seidel()).map(drop).unwrap_err()
    });
    same(pivots, &Error::NotPositive { what: "diagonal of M", index: 2500, value: 0.0 });
    let files = ranks_as_threads(3, |ranks| {
        let strip = Strip::new(ranks, [800, 2]).unwrap();
        let own = if strip.rank() == 1 { Err(Error::Empty { what: "A" }) } else { Ok(()) };
        strip.agree(own).unwrap_err().to_string()
    });
    assert!(files.iter().all(|error| error.ends_with(&files[1])), "{files:?}");
    assert!(files[0].starts_with("on rank 1, "), "{files:?}");
}

#[test]
fn ranks_that_are_given_different_limits_are_refused() {
    let errors = ranks_as_threads(2, |ranks| {
        let (strip, problem, q) = on_grid(ranks, GRID);
        let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
        let limits = Limits { iterations: 5 + strip.rank(), ..Limits::default() };
        solver.solve(&q, limits).unwrap_err()
    });
    same(errors, &Error::Differ { what: "the start or the limits" });
}

#[test]
fn a_solve_ends_on_all_ranks_as_it_ends_on_one() {
    let ended = |limits: Limits, stop: Option<usize>| {
        let outcomes = ranks_as_threads(2, |ranks| {
            let (strip, problem, q) = on_grid(ranks, GRID);
            let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
            let stops = |progress: &Progress<'_, f64>| match stop {
                Some(k) if progress.iteration == k => ControlFlow::Break(()),
                _ => ControlFlow::Continue(()),
            };
            let options = Options::default().limits(limits);
            let options = if strip.rank() == 1 { options.observer(stops) } else { options };
            let outcome = solver.solve(&q, options).unwrap();
            (outcome.status, outcome.iterations, outcome.residual)
        });
        assert_eq!(outcomes[0], outcomes[1]);
        (outcomes[0].0, outcomes[0].1)
    };
    assert_eq!(ended(Limits::default(), Some(3)), (Status::Stopped, 3));
    let time = Some(Duration::ZERO);
    assert_eq!(ended(Limits { time, ..Limits::default() }, None), (Status::TimeLimit, 0));
    assert_eq!(ended(Limits { norm: Norm::LInf, ..Limits::default() }, None).0, Status::Converged);
    // Rest, which is found by comparing iterates, at a tolerance that nothing meets.
    assert_eq!(ended(Limits::absolute(0.0), None).0, Status::Stagnated);

    // A splitting of one's own that divides by zero on the second rank.
    let indices = ranks_as_threads(2, |ranks| {
        let (strip, problem, q) = on_grid(ranks, GRID);
        let pivot = move |k: usize| if strip.index(k) == 1400 + 256 { 0.0 } else { 20.0 };
        let splitting = move |rhs: &[f64], y: &mut [f64]| {
            y.iter_mut().zip(rhs).enumerate().for_each(|(k, (y, rhs))| *y = rhs / pivot(k));
        };
        let mut solver = Solver::new(Mms::with_splitting(problem, splitting).unwrap());
        solver.solve(&q, Limits::default()).unwrap().status
    });
    same(indices, &Status::Diverged(Divergence::Entry { index: 1656 }));
}

#[test]
fn a_panic_on_one_rank_ends_all() {
    let ended = panic::catch_unwind(|| {
        ranks_as_threads(3, |ranks| {
            let (strip, problem, q) = on_grid(ranks, [800, 9]);
            let mut solver = Solver::new(Mms::new(problem, Aor::gauss_seidel()).unwrap());
            let mut observer = |progress: &Progress<'_, f64>| {
                assert!(strip.rank() != 1 || progress.iteration < 4, "as it was to");
                ControlFlow::Continue(())
            };
            solver.solve(&q, Options::default().observer(&mut observer)).unwrap()
        })
    });
    assert!(ended.is_err());
}

/// Of those that do not, a name of each kind agrees with one process above.
#[test]
fn methods_that_work_on_one_rank_say_so_on_all() {
    for name in ["NEWTON", "AMG", "PIVOTING"] {
        let errors = ranks_as_threads(2, |ranks| {
            let (_, problem, q) = on_grid(ranks, GRID);
            let method = Named::parse(name, Parameters::default()).unwrap().on(problem);
            method.and_then(|method| Solver::new(method).solve(&q, Limits::default())).unwrap_err()
        });
        for error in errors {
            assert!(matches!(error, Error::OneRank { ranks: 2, .. }), "{name}: {error}");
        }
    }
    let errors = ranks_as_threads(2, |ranks| {
        let (strip, problem, _) = on_grid(ranks, GRID);
        let order = problem.order();
        let multicolour = Multicolour::new(Aor::gauss_seidel(), &problem);
        let assembled = Csr::from_rows(problem.a());
        let identity = Identity { order };
        let rows = Hlcp::new(&assembled, identity, Omega::Uniform(1.0)).unwrap();
        [
            Mms::new(problem.clone(), multicolour).map(drop).unwrap_err(),
            rows.shared_by(&strip).map(drop).unwrap_err(),
        ]
    });
    for [multicolour, rows] in errors {
        assert!(matches!(multicolour, Error::OneRank { .. }));
        assert_eq!(rows, Error::NotFivePoint { what: "A" });
    }
    let many = Strip::new(ranks_as_threads(3, |ranks| ranks).swap_remove(0), [512, 900]);
    assert!(matches!(many, Err(Error::Parameter { .. })));
}

/// −x of the neighbours on a ring, which a rank fetches from its neighbours.
#[derive(Debug)]
struct Ring(Arc<dyn Ranks>, Strip);

impl LinearOperator<f64> for Ring {
    fn order(&self) -> usize {
        self.1.columns().len()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        let (Self(ranks, _), n) = (self, x.len());
        let (size, rank) = (ranks.size(), ranks.rank());
        let (west, east) = ((rank + size - 1) % size, (rank + 1) % size);
        let shift = |to, from, own: f64| {
            let mut theirs = [own];
            match rank {
                _ if size == 1 => {}
                0 => {
                    ranks.send(to, &[own]);
                    ranks.receive(from, &mut theirs);
                }
                _ => {
                    ranks.receive(from, &mut theirs);
                    ranks.send(to, &[own]);
                }
            }
            theirs[0]
        };
        let (before, after) = (shift(east, west, x[n - 1]), shift(west, east, x[0]));
        for i in 0..n {
            let beside = [if i > 0 { x[i - 1] } else { before }, *x.get(i + 1).unwrap_or(&after)];
            y[i] = 2.5 * x[i] - beside[0] - beside[1];
        }
    }
}

#[test]
fn an_operator_of_ones_own_fetches_what_it_needs() {
    let solved = |size| {
        let solutions = ranks_as_threads(size, |ranks| {
            let strip = Strip::new(ranks.clone(), [900, 1]).unwrap();
            let q = strip.vector(|i, _| noise(i));
            let (ring, b) = (Ring(ranks, strip.clone()), Identity { order: q.len() });
            let problem = Hlcp::new(ring, b, Omega::Uniform(2.5)).unwrap();
            let method = Mms::with_splitting(problem.shared_by(&strip).unwrap(), over(5.0));
            let mut solver = Solver::new(Anderson::new(method.unwrap(), 5).unwrap());
            let outcome = solver.solve(&q, Limits::default()).unwrap();
            assert!(outcome.converged(), "{outcome}");
            (outcome.iterations, outcome.residual, strip.gather(solver.z()))
        });
        solutions.into_iter().next()
    };
    let alone = solved(1);
    assert_eq!([solved(2), solved(3)], [alone.clone(), alone]);
}

/// Ranks that count the messages and bytes that they send, and pause without pattern if they are
/// slow.
#[derive(Debug)]
struct Watched {
    of: Arc<dyn Ranks>,
    sent: [AtomicU64; 2],
    /// The pauses so far.
    slow: Option<AtomicU64>,
}

impl Watched {
    fn new(of: Arc<dyn Ranks>) -> Self {
        Self { of, sent: [0, 0].map(AtomicU64::new), slow: None }
    }

    /// Returns the messages and bytes that `work` sends.
    fn during(&self, work: impl FnOnce()) -> [u64; 2] {
        let taken = || self.sent.each_ref().map(|count| count.swap(0, Relaxed));
        taken();
        work();
        taken()
    }

    fn pause(&self) {
        let Some(pauses) = &self.slow else { return };
        let turn = pauses.fetch_add(1, Relaxed) as usize;
        match (noise(turn + 1_000_003 * self.of.rank()) * 50.0) as i64 {
            ..40 => {}
            40..48 => thread::yield_now(),
            tens => thread::sleep(Duration::from_micros(tens as u64)),
        }
    }
}

impl Ranks for Watched {
    fn size(&self) -> usize {
        self.of.size()
    }

    fn rank(&self) -> usize {
        self.of.rank()
    }

    fn send(&self, to: usize, numbers: &[f64]) {
        self.pause();
        self.sent[0].fetch_add(1, Relaxed);
        self.sent[1].fetch_add(8 * numbers.len() as u64, Relaxed);
        self.of.send(to, numbers);
    }

    fn receive(&self, from: usize, numbers: &mut [f64]) {
        self.pause();
        self.of.receive(from, numbers);
    }
}

/// A column to either neighbour, eight values for each band of eight rows to the next rank, and a
/// sum and a largest value of each stretch to rank 0 and back; in red–black order a column of the
/// first colour in the place of the bands.
#[test]
fn a_sweep_sends_what_the_documents_say() {
    const RANKS: usize = 3;
    const NY: usize = 41;
    for red_black in [false, true] {
        let sent = ranks_as_threads(RANKS, |ranks| {
            let watched = Arc::new(Watched::new(ranks));
            let (strip, problem, q) = on_grid(watched.clone(), [1300, NY]);
            let (x, mut y) = (vec![1.0; q.len()], vec![0.0; q.len()]);
            let q = problem.rhs(&q).unwrap();
            let aor = Aor::gauss_seidel();
            let aor = if red_black { aor.red_black(strip.grid()[0]).unwrap() } else { aor };
            watched.during(|| {
                aor.step(&problem, &q, &x, &mut y, &mut vec![]);
            })
        });
        let (column, stretches) = (8 * NY as u64, [2, 2, 2]);
        let whole: u64 = stretches.iter().sum();
        for (rank, sent) in sent.into_iter().enumerate() {
            let neighbours = u64::from(rank > 0) + u64::from(rank + 1 < RANKS);
            let columns = if red_black { 2 * neighbours } else { neighbours };
            let bands = if red_black || rank + 1 == RANKS { 0 } else { NY.div_ceil(8) as u64 };
            let (sums, bytes) = match rank {
                0 => (RANKS as u64 - 1, 16 * whole * (RANKS as u64 - 1)),
                _ => (1, 16 * stretches[rank]),
            };
            let expected = [columns + bands + sums, columns * column + bands * 64 + bytes];
            assert_eq!(sent, expected, "rank {rank}, red–black {red_black}");
        }
    }
}

/// A V-cycle on three grids: ranks share two, and the third, of fewer than 2¹⁴ points, every rank
/// has whole. Every number below is one of the table in the documents.
#[test]
fn a_cycle_sends_what_the_documents_say() {
    const RANKS: usize = 3;
    let sent = ranks_as_threads(RANKS, |ranks| {
        let watched = Arc::new(Watched::new(ranks));
        let (strip, problem, mut q) = on_grid(watched.clone(), [1300, 103]);
        q.fill(-1.0);
        let mut multigrid = Multigrid::new(problem.clone(), Cycle::V).unwrap();
        let shared = Transfer::<f64>::shared_by(&strip);
        let gathered = Transfer::<f64>::shared_by(shared.strip().unwrap());
        assert_eq!(shared.strip().unwrap().whole(), [649, 51]);
        assert_eq!(gathered.strip().unwrap().whole(), [324, 25]);
        let (mut x, mut y) = (vec![1.0; q.len()], vec![0.0; q.len()]);
        let q = problem.rhs(&q).unwrap();
        // The first iteration measures more than a cycle.
        multigrid.step(&q, &x, &mut y, &mut Clock::endless());
        let sent = watched.during(|| {
            multigrid.step(&q, &y, &mut x, &mut Clock::endless());
        });
        assert_eq!(multigrid.coarse_grids_help(), Some(true));
        (sent, gathered.strip().unwrap().grid()[0] as u64)
    });
    for (rank, (sent, own)) in sent.into_iter().enumerate() {
        let neighbours = u64::from(rank > 0) + u64::from(rank + 1 < RANKS);
        let (columns, entries) = (6 + 8 + 1, 7 * 103 + 9 * 51 + 25);
        let bands = 2 * (103_u64.div_ceil(8) + 51_u64.div_ceil(8));
        // A norm, two decisions on a correction, and the third grid's x and f.
        let joined = [[2 * 2, 6 * 2], [1, 3], [1, 3], [2 * 25 * own, 2 * 25 * 324]];
        let (joins, numbers) = match rank {
            0 => (2 * joined.len() as u64, 2 * joined.iter().map(|[_, all]| all).sum::<u64>()),
            _ => (joined.len() as u64, joined.iter().map(|[own, _]| own).sum()),
        };
        let expected = [
            neighbours * (columns + bands) + joins,
            8 * (neighbours * (entries + 8 * bands) + numbers),
        ];
        assert_eq!(sent, expected, "rank {rank}");
    }
}

/// As often as `HLCP_RANKS_RUNS` says, without a deadlock or another course.
#[test]
fn delays_change_nothing() {
    for run in 0..asked("HLCP_RANKS_RUNS", 1) {
        let (name, ranks) = (NAMES[run % NAMES.len()], 2 + run % 4);
        let case = Case { grid: [1100, 10 + run % 30], varying: run % 2 == 1, threads: 1 };
        agrees::<f64>(case, name, ranks, Some(run as u64 * 7919));
    }
}
