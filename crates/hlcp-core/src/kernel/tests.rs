//! The sweep against an obvious loop over the points, bit for bit, whatever the processor offers.

use std::fmt::Debug;

use pulp::Arch;

use super::{
    Sweep,
    coefficients::{Row, part},
    grid::Grid,
    smoother::gauss_seidel,
};
use crate::{
    FivePoint, Hlcp, LinearOperator, Omega, Rhs, Scalar, operators::places, rows::Relaxation,
};

/// A number in −1..1 without pattern.
fn noise<T: Scalar>(seed: usize) -> T {
    let mixed = (seed as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    T::of((mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
}

fn list<T: Scalar>(n: usize, seed: usize) -> Vec<T> {
    (0..n).map(|i| noise(seed + 7 * i)).collect()
}

/// Every instruction set a dispatch can choose here.
fn architectures() -> Vec<Arch> {
    let mut all = vec![Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    {
        all.extend(pulp::x86::V3::try_new().map(Arch::V3));
        all.extend(pulp::x86::V4::try_new().map(Arch::V4));
    }
    all
}

fn value<T: Scalar>(v: &[T], k: Option<usize>) -> T {
    k.map_or(T::zero(), |k| v[k])
}

fn row<T: Scalar, const ACCELERATED: bool>(
    sweep: &Sweep<'_, T>,
    relaxation: [Relaxation<T>; 2],
    k: usize,
) -> Row<T> {
    let a = sweep.a.coefficients().map(|a| a.entry(k));
    let mut b = sweep.b.coefficients().map(|b| b.entry(k));
    for (b, at) in b.iter_mut().zip(places(sweep.grid(), sweep.grid.round, k)) {
        *b *= sweep.omega.entry(at.unwrap_or(k));
    }
    Row::new::<ACCELERATED>(relaxation, a, b)
}

/// The sweep's operations in the order of the points, given `t` before anything is moved across a
/// grid that closes.
fn in_order<T: Scalar, const BACKWARD: bool, const ACCELERATED: bool>(
    sweep: &Sweep<'_, T>,
    relaxation: [Relaxation<T>; 2],
    x: &[T],
    t: impl Fn(&Row<T>, [T; 5], usize) -> T,
) -> Vec<T> {
    let n = x.len();
    let mut y = vec![T::zero(); n];
    for step in 0..n {
        let k = if BACKWARD { n - 1 - step } else { step };
        let row = row::<T, ACCELERATED>(sweep, relaxation, k);
        let around = places(sweep.grid(), sweep.grid.round, k);
        let mut t = t(&row, around.map(|at| value(x, at)), k);
        let [passed, coming] = [[0, 1], [4, 3]];
        let [passed, coming] = if BACKWARD { [coming, passed] } else { [passed, coming] };
        let is_before = |j: usize| if BACKWARD { j > k } else { j < k };
        let share = |pair, at, v: &[T]| part::<T, ACCELERATED>(pair, value(v, at));
        let [of_passed, of_coming] = [row.passed(BACKWARD), row.passed(!BACKWARD)];
        let mut takes = [[None; 2]; 2];
        // Along the row first, then across rows.
        for d in [1, 0] {
            let (before, after) = (around[passed[d]], around[coming[d]]);
            if before.is_some_and(|j| !is_before(j)) {
                t -= share(of_passed[d], before, x);
            }
            if after.is_some_and(is_before) {
                t += share(of_coming[d], after, x);
            }
            takes[d] = [before.filter(|&j| is_before(j)), after.filter(|&j| is_before(j))];
        }
        let [[south, north], [west, east]] = takes;
        if north.is_some() {
            t -= share(of_coming[0], north, &y);
        }
        y[k] = (t - share(of_passed[0], south, &y)) - share(of_passed[1], west, &y);
        if east.is_some() {
            let first = share(of_coming[1], east, &y);
            y[k] -= first;
        }
    }
    y
}

/// The sweep's operations colour by colour.
fn colour_by_colour<T: Scalar, const ACCELERATED: bool>(
    sweep: &Sweep<'_, T>,
    relaxation: [Relaxation<T>; 2],
    q: &[T],
    x: &[T],
) -> Vec<T> {
    let Grid { nx, backward, .. } = sweep.grid;
    let mut y = vec![T::zero(); x.len()];
    for second in [false, true] {
        for k in 0..x.len() {
            let black = (k % nx + k / nx) % 2 == 1;
            if (black != backward) != second {
                continue;
            }
            let around = places(sweep.grid(), sweep.grid.round, k);
            let row = row::<T, ACCELERATED>(sweep, relaxation, k);
            let old = around.map(|at| value(x, at));
            let (_, t, beside) = row.coloured::<ACCELERATED>(old, sweep.q_factor * q[k]);
            let [s, w, _, e, n] = around.map(|at| value(&y, at));
            y[k] = if second { (t + beside) - row.beside::<ACCELERATED>([s, w, e, n]) } else { t };
        }
    }
    y
}

fn agrees<T: Scalar, const BACKWARD: bool, const ACCELERATED: bool>(
    sweep: Sweep<'_, T>,
    q: &[T],
    x: &[T],
) {
    let relaxation = [[0.9, 1.1], [0.8, 0.7]].map(|[diagonal, triangle]| Relaxation {
        diagonal: T::of(diagonal),
        triangle: T::of(triangle),
    });
    let lexicographic = sweep.directed(BACKWARD, false);
    let t =
        |row: &Row<T>, old, k| row.relaxed::<BACKWARD, ACCELERATED>(old, sweep.q_factor * q[k]).1;
    let expected = in_order::<T, BACKWARD, ACCELERATED>(&lexicographic, relaxation, x, t);
    let rhs = Rhs::new(q).expect("finite");
    let run = |sweep: Sweep<'_, T>, arch, y: &mut [T]| {
        sweep.run_on::<ACCELERATED>(arch, relaxation, &rhs, x, y)
    };
    everywhere(lexicographic, &expected, run);
    if sweep.grid.round != [false; 2] {
        return;
    }
    let red_black = sweep.directed(BACKWARD, true);
    let expected = colour_by_colour::<T, ACCELERATED>(&red_black, relaxation, q, x);
    everywhere(red_black, &expected, run);
}

/// The smoother's sweep is the loop over the points too.
fn smooths<T: Scalar, const BACKWARD: bool>(sweep: Sweep<'_, T>, f: &[T], x: &[T]) {
    let sweep = sweep.directed(BACKWARD, false);
    let factor = T::of(0.7);
    let t = |row: &Row<T>, [south, west, _, east, north]: [T; 5], k| {
        let coming = if BACKWARD { [south, west] } else { [north, east] };
        row.solved::<BACKWARD>(coming, factor * f[k])
    };
    let expected = in_order::<T, BACKWARD, true>(&sweep, gauss_seidel(), x, t);
    everywhere(sweep, &expected, |sweep, arch, y| sweep.smooth_on(arch, (factor, f), x, y));
}

/// On every instruction set and any number of threads the sweep comes to `expected`, with the same
/// norms.
fn everywhere<T: Scalar, R: PartialEq + Debug + Copy + Send>(
    sweep: Sweep<'_, T>,
    expected: &[T],
    run: impl Fn(Sweep<'_, T>, Arch, &mut [T]) -> R + Sync,
) {
    let grid = sweep.grid;
    let mut first = None;
    for arch in architectures() {
        let mut y = vec![T::nan(); expected.len()];
        let norms = run(sweep, arch, &mut y);
        assert!(y == expected, "{grid:?} on {arch:?}");
        assert_eq!(*first.get_or_insert(norms), norms, "{grid:?} on {arch:?}");
        #[cfg(feature = "rayon")]
        for pool in pools() {
            let shared = Sweep { parallel: true, ..sweep };
            y.fill(T::nan());
            let threads = pool.current_num_threads();
            let of_threads = pool.install(|| run(shared, arch, &mut y));
            assert!(y == expected, "{grid:?} on {threads} threads");
            assert_eq!(of_threads, norms, "{grid:?} on {threads} threads");
        }
    }
}

/// Pools of 1, 2, 4 and 8 threads, which the tests share.
#[cfg(feature = "rayon")]
fn pools() -> &'static [rayon::ThreadPool] {
    static POOLS: std::sync::LazyLock<Vec<rayon::ThreadPool>> = std::sync::LazyLock::new(|| {
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        [1, 2, 4, 8].into_iter().map(|threads| pool(threads).expect("a pool")).collect()
    });
    &POOLS
}

fn agrees_in_all_ways<T: Scalar>(nx: usize, ny: usize) {
    for round in [[false, false], [true, false], [false, true], [true, true]] {
        if [nx, ny].iter().zip(round).all(|(&side, round)| side >= 3 || !round) {
            agrees_on::<T>(nx, ny, round);
        }
    }
}

fn agrees_on<T: Scalar>(nx: usize, ny: usize, round: [bool; 2]) {
    let n = nx * ny;
    let (q, x) = (&*list::<T>(n, 1), &*list::<T>(n, 2));
    let stencil = |c: [f64; 5]| {
        FivePoint::new(nx, ny, c.map(T::of)).and_then(|grid| grid.periodic(round)).expect("a grid")
    };
    let varying = |centre: f64, seed| {
        let grid = FivePoint::from_fn(nx, ny, |i, j| {
            let around = noise::<T>(seed + 3 * i + 11 * j);
            [around, T::of(0.3), T::of(centre) + around, T::of(-0.7) * around, T::of(-0.2)]
        });
        grid.and_then(|grid| grid.periodic(round)).expect("a grid")
    };
    let (a, b) = (stencil([-1.1, -0.9, 5.0, -0.7, 1.3]), stencil([0.2, -1.2, 4.0, 0.6, -0.4]));
    let (va, vb) = (varying(5.0, 3), varying(4.0, 4));
    let uniform = || Omega::Uniform(T::of(1.3));
    let each = || Omega::Each(list::<T>(n, 5).iter().map(|&w| T::of(1.5) + w).collect());
    let gamma = T::of(1.7);
    four(&a, &b, uniform(), gamma, q, x);
    four(&a, &b, each(), gamma, q, x);
    four(&va, &b, uniform(), gamma, q, x);
    four(&va, &vb, each(), gamma, q, x);
}

/// Both methods in both directions.
fn four<T: Scalar>(
    a: &impl LinearOperator<T>,
    b: &impl LinearOperator<T>,
    omega: Omega<T>,
    gamma: T,
    q: &[T],
    x: &[T],
) {
    let problem = Hlcp::new(a, b, omega).and_then(|p| p.with_gamma(gamma)).expect("a problem");
    let sweep = problem.sweep().expect("five-point operators");
    agrees::<T, false, false>(sweep, q, x);
    agrees::<T, false, true>(sweep, q, x);
    agrees::<T, true, false>(sweep, q, x);
    agrees::<T, true, true>(sweep, q, x);
    smooths::<T, false>(sweep, q, x);
    smooths::<T, true>(sweep, q, x);
}

#[test]
fn sweeps_are_the_loop_over_the_points() {
    let sizes = [1, 2, 7, 8, 9, 15, 71, 129]
        .into_iter()
        .flat_map(|nx| [1, 2, 7, 8, 9, 17, 33, 65].map(|ny| (nx, ny)));
    for (nx, ny) in sizes.chain([(511, 9), (513, 9), (1025, 17), (1, 600), (600, 1)]) {
        agrees_in_all_ways::<f64>(nx, ny);
        agrees_in_all_ways::<f32>(nx, ny);
    }
}
