//! Sweeps and cycles against dense matrices written down from their definitions.

use hlcp_core::{
    FivePoint, FivePointView, Hlcp, Identity, LinearOperator, Norms, Omega, Rhs, Scalar, Smoother,
    Strip, Transfer, Varying, ranks_as_threads,
};
use nalgebra::{DMatrix, DVector};

use crate::{Clock, Method, Work, testing::dense};

use super::{
    Cycle, FullMultigrid, Grids, Multigrid, Scaling, cycle::Equation, exact_sweep, levels,
    pace::Turn, rediscretised,
};

fn noise(seed: usize) -> f64 {
    let mixed = (seed as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn list(n: usize, seed: usize) -> Vec<f64> {
    (0..n).map(|k| noise(seed + 7 * k)).collect()
}

fn close(u: &[f64], v: &[f64], tolerance: f64) {
    assert_eq!(u.len(), v.len());
    for (k, (u, v)) in u.iter().zip(v).enumerate() {
        assert!((u - v).abs() <= tolerance, "{k}: {u} {v}");
    }
}

/// Bilinear interpolation on the unit square: hats over the coarse spacings.
fn hats([nx, ny]: [usize; 2], [cx, cy]: [usize; 2]) -> DMatrix<f64> {
    let hat = |i: usize, fine: usize, j: usize, coarse: usize| {
        let x = (i + 1) as f64 / (fine + 1) as f64 - (j + 1) as f64 / (coarse + 1) as f64;
        (1.0 - x.abs() * (coarse + 1) as f64).max(0.0)
    };
    DMatrix::from_fn(nx * ny, cx * cy, |k, l| {
        hat(k % nx, nx, l % cx, cx) * hat(k / nx, ny, l / cx, cy)
    })
}

/// The fine point at the least distance, the earlier one of two.
fn nearest([nx, ny]: [usize; 2], [cx, cy]: [usize; 2]) -> Vec<usize> {
    let axis = |fine: usize, coarse: usize, j: usize| {
        let distance = |i: usize| ((i + 1) * (coarse + 1)).abs_diff((j + 1) * (fine + 1));
        (0..fine).min_by_key(|&i| (distance(i), std::cmp::Reverse(i))).unwrap()
    };
    (0..cx * cy).map(|l| axis(ny, cy, l / cx) * nx + axis(nx, cx, l % cx)).collect()
}

/// The problem on a grid, dense, with what its cycles need.
struct Oracle {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    omega: DVector<f64>,
}

impl Oracle {
    fn k(&self, x: &DVector<f64>) -> DVector<f64> {
        let negative = x.map(|x| x.min(0.0)).component_mul(&self.omega);
        2.0 * (&self.a * x.map(|x| x.max(0.0)) + &self.b * negative)
    }

    /// Scalar equation by scalar equation; each is solved by trying both signs.
    fn smooth(&self, f: &DVector<f64>, x: &mut DVector<f64>) {
        for i in (0..f.len()).chain((0..f.len()).rev()) {
            x[i] = 0.0;
            let rest = -(self.k(x)[i] + f[i]);
            let up = rest / (2.0 * self.a[(i, i)]);
            let down = rest / (2.0 * self.b[(i, i)] * self.omega[i]);
            x[i] = if up > 0.0 { up } else { down };
        }
    }
}

/// One cycle from the definitions, on a hierarchy of dense problems with their grids.
fn cycle(grids: &[([usize; 2], Oracle)], visits: usize, f: &DVector<f64>, x: &mut DVector<f64>) {
    let [(fine, problem), rest @ ..] = grids else { return };
    problem.smooth(f, x);
    let Some((coarse, below)) = rest.first() else { return };
    let p = hats(*fine, *coarse);
    let cells = [0, 1].map(|d| (coarse[d] + 1) as f64 / (fine[d] + 1) as f64);
    let restricted = cells[0] * cells[1] * p.transpose() * (problem.k(x) + f);
    // In the scale of the coarse grid's Ω, and back.
    let rescaled = |x: f64, ratio: f64| if x > 0.0 { x } else { x * ratio };
    let nearest = nearest(*fine, *coarse);
    let ratios = problem.omega.select_rows(&nearest).component_div(&below.omega);
    let nearest = x.select_rows(&nearest);
    let injected = nearest.zip_map(&ratios, rescaled);
    let f_coarse = restricted - below.k(&injected);
    let mut x_coarse = injected;
    for _ in 0..if rest.len() == 1 { 1 } else { visits } {
        cycle(rest, visits, &f_coarse, &mut x_coarse);
    }
    let back = x_coarse.zip_map(&ratios, |new, ratio| rescaled(new, ratio.recip()));
    *x += p * (back - nearest);
    problem.smooth(f, x);
}

fn varying(nx: usize, ny: usize, centre: f64, seed: usize) -> FivePoint<Varying<f64>> {
    FivePoint::from_fn(nx, ny, |i, j| {
        let off = |d: usize| 0.5 * noise(seed + 5 * (j * nx + i) + d) - 0.6;
        [off(0), off(1), centre, off(2), off(3)]
    })
    .unwrap()
}

/// Sweeps, V- and W-cycles, forward and backward, on all shapes of grids that blocks of rows and
/// columns can meet.
#[test]
fn cycles_are_those_of_the_definitions() {
    for (seed, [nx, ny]) in
        [[1, 1], [2, 3], [5, 3], [6, 6], [4, 9], [12, 7], [19, 5], [13, 14]].into_iter().enumerate()
    {
        let n = nx * ny;
        let a = FivePoint::new(nx, ny, [-1.1, -0.9, 4.4, -0.8, -1.2]).unwrap();
        let b = FivePoint::new(nx, ny, [-0.2, -0.9, 3.3, -0.7, 0.1]).unwrap();
        let each = || Omega::Each((0..n).map(|k| 1.2 + 0.3 * noise(k + seed)).collect());
        against_the_oracle(&Hlcp::new(a, b, Omega::Uniform(1.3)).unwrap(), [nx, ny], seed);
        against_the_oracle(&Hlcp::new(a, b, each()).unwrap(), [nx, ny], seed);
        let (a, b) = (varying(nx, ny, 4.7, seed), varying(nx, ny, 3.9, seed + 3));
        against_the_oracle(&Hlcp::new(a, b, each()).unwrap(), [nx, ny], seed);
    }
}

fn against_the_oracle<A: LinearOperator<f64>, B: LinearOperator<f64>>(
    problem: &Hlcp<f64, A, B>,
    grid: [usize; 2],
    seed: usize,
) {
    let n = grid[0] * grid[1];
    let scaling = Smoother::scaling(problem).unwrap();
    let mut levels = levels(problem, &scaling).unwrap();
    let each = |omega: &Omega<f64>, n: usize| DVector::from_fn(n, |k, _| omega.entry(k));
    let (a, b) = (dense(problem.a()), dense(problem.b()));
    let mut grids = vec![(grid, Oracle { a, b, omega: each(&scaling, n) })];
    for level in &levels {
        let (p, omega) = (&level.problem, each(level.problem.omega(), level.x.len()));
        grids.push((level.transfer.coarse(), Oracle { a: dense(p.a()), b: dense(p.b()), omega }));
    }
    let (q, start) = (list(n, seed + 5), list(n, seed + 6));
    let f = 0.7 * DVector::from_column_slice(&q);
    let mut between = vec![f64::NAN; n];
    for (kind, visits) in [(Cycle::V, 1), (Cycle::W, 2)] {
        let (mut x, mut expected) = (start.clone(), DVector::from_column_slice(&start));
        let smoother = Smoother::new(problem, Some(&scaling), false).unwrap();
        let (coarser, between) = (&mut levels[..], &mut between[..]);
        let (of_q, points, parallel) = ((0.7, &q[..]), n, false);
        let mut equation = Equation { smoother, f: of_q, points, coarser, between, parallel };
        for _ in 0..2 {
            equation.cycle(kind, &mut x, &mut Clock::endless());
            cycle(&grids, visits, &f, &mut expected);
            close(&x, expected.as_slice(), 1e-12);
        }
    }
}

/// Of constant coefficients: differences scale, the rest stays.
#[test]
fn constants_are_discretised_again() {
    let (fine, round, strip) = ([15, 10], [false; 2], None);
    let grids = Grids { fine, round, transfer: &Transfer::new(fine, round), strip };
    let row = |[south, west, centre, east, north]: [f64; 5]| {
        let a = FivePoint::new(15, 10, [south, west, centre, east, north]).unwrap();
        let view: FivePointView<'_, f64> = a.as_five_point().unwrap();
        let coarse = rediscretised(view, &grids).unwrap();
        let coefficients = coarse.as_five_point().unwrap().coefficients();
        coefficients.map(|c| match c {
            hlcp_core::Coefficients::Uniform(c) => c,
            hlcp_core::Coefficients::Each(_) => panic!("constants stay constant"),
        })
    };
    let (x, y) = (0.25, (5.0_f64 / 11.0).powi(2));
    close(
        &row([-3.0, -2.0, 10.7, -2.0, -3.0]),
        &[-3.0 * y, -2.0 * x, 4.0 * x + 6.0 * y + 0.7, -2.0 * x, -3.0 * y],
        1e-14,
    );
    // B of the disc and the identity.
    close(&row([0.0, -1.0, 4.0, -1.0, 0.0]), &[0.0, -x, 2.0 + 2.0 * x, -x, 0.0], 1e-15);
    close(&row([0.0, 0.0, 1.0, 0.0, 0.0]), &[0.0, 0.0, 1.0, 0.0, 0.0], 0.0);
    // Upwind convection scales with the spacing alone, and central convection becomes upwind.
    close(&row([0.0, -2.0, 2.0, 0.0, 0.0]), &[0.0, -1.0, 1.0, 0.0, 0.0], 1e-15);
    close(&row([0.0, -1.5, 2.0, -0.5, 0.0]), &[0.0, -0.5, 0.5, 0.0, 0.0], 1e-15);
}

/// Fused sweeps and those by rows solve the same equations, whatever Ω is, also round a ring and on
/// a torus.
#[test]
fn exact_sweeps_are_those_by_rows() {
    let (nx, ny) = (13, 10);
    for (seed, round) in [[false; 2], [true, false], [true; 2]].into_iter().enumerate() {
        let [a, b] = [1, 2].map(|k| varying(nx, ny, 9.0, 10 * seed + k).periodic(round).unwrap());
        let q = list(nx * ny, 100 + seed);
        for omega in [Omega::diagonal_ratio(1.0, &a, &b).unwrap(), Omega::Uniform(0.7)] {
            let problem = Hlcp::new(&a, &b, omega).unwrap();
            let scaling = Scaling::of(&problem).unwrap();
            for backward in [false, true] {
                let (x, spare) = (list(nx * ny, 200 + seed), &mut vec![f64::NAN; nx * ny]);
                let (mut fused, mut rows) = (x.clone(), x);
                exact_sweep(&problem, Some(&scaling), &q, &mut fused, spare, backward);
                exact_sweep(&problem, None, &q, &mut rows, spare, backward);
                // Sums of eleven terms below 20 over a pivot of 12, and what that does to the next.
                close(&fused, &rows, 1e-13);
            }
        }
    }
}

/// Six walks on a grid, three on the coarsest, and in units of walks on the finest, rounded up.
#[test]
fn cycles_are_counted_in_sweeps() {
    for (kind, walks) in [(Cycle::V, 1701), (Cycle::F, 2109), (Cycle::W, 2166)] {
        assert_eq!(kind.walks(&[225, 49, 9, 1]), walks, "{kind:?}");
        let sweeps = walks.div_ceil(225);
        let a = FivePoint::new(15, 15, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
        let problem = Hlcp::new(a, Identity { order: 225 }, Omega::Uniform(4.0)).unwrap();
        let mut multigrid = Multigrid::new(problem, kind).unwrap();
        // The nested iteration counts as one cycle and four sweeps.
        let mut full = FullMultigrid::new(multigrid.clone());
        let (q, x, mut y) = (vec![1.0; 225], vec![1.0; 225], vec![0.0; 225]);
        for method in [&mut multigrid as &mut dyn Method<f64, A = _, B = _>, &mut full] {
            let q = Rhs::new(&q).unwrap();
            assert_eq!(method.work(), Some(Work::sweeps(0)));
            for _ in 0..3 {
                let _ = method.step(&q, &x, &mut y, &mut Clock::endless());
            }
        }
        assert_eq!(multigrid.work(), Some(Work::sweeps(3 * sweeps)));
        assert_eq!(full.work(), Some(Work::sweeps(4 * sweeps + 4)));
    }
}

/// Where signs change from point to point a trial of cycles fails, and the sweeps go on from before
/// it.
#[test]
fn a_failed_trial_leaves_no_trace() {
    let n = 31 * 31;
    let a = FivePoint::new(31, 31, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    let b = FivePoint::new(31, 31, [0.0, -1.0, 4.0, -1.0, 0.0]).unwrap();
    let problem = Hlcp::new(a, b, Omega::Uniform(1.0)).unwrap();
    let mut multigrid = Multigrid::new(problem, Cycle::W).unwrap();
    let q = list(n, 3);
    let q = Rhs::new(&q).unwrap();
    let (mut x, mut y, mut kept) = (vec![1.0; n], vec![0.0; n], vec![]);
    let mut returns = 0;
    for _ in 0..60 {
        let mut pace = multigrid.pace;
        let norms = multigrid.step(&q, &x, &mut y, &mut Clock::endless());
        match pace.turn(norms.l2) {
            Turn::Keep => kept.clone_from(&x),
            Turn::Return => {
                let pairs = multigrid.sweeps[0].div_ceil(2);
                let mut equation = multigrid.equation(&q);
                (0..pairs).for_each(|_| equation.smooth(&mut kept, &mut Clock::endless()));
                assert_eq!(y, kept);
                returns += 1;
            }
            _ => {}
        }
        std::mem::swap(&mut x, &mut y);
    }
    assert!(returns > 0);
}

/// A start by nested iteration and two steps, on the strip or on the whole grid.
fn nested_and_two_steps<T: Scalar>(
    strip: Option<&Strip>,
    [nx, ny]: [usize; 2],
    varying: bool,
    cycle: Cycle,
) -> (Option<Vec<T>>, [Norms; 2]) {
    let ([width, _], first) = strip.map_or(([nx, ny], 0), |s| (s.grid(), s.columns().start));
    let vector = |seed: usize| -> Vec<T> {
        let of = |i: usize, j: usize| T::of(noise(seed + 7 * i + 1013 * j));
        (0..width * ny).map(|k| of(first + k % width, k / width)).collect()
    };
    let row = |seed: usize, centre: f64| {
        FivePoint::from_fn(width, ny, move |i, j| {
            let off = |d: usize| match varying {
                true => 0.5 * noise(seed + 5 * (i + first) + 911 * j + d) - 0.6,
                false => -0.7 - 0.1 * d as f64,
            };
            [off(0), off(1), centre, off(2), off(3)].map(T::of)
        })
    };
    let (a, b) = (row(1, 4.7).unwrap(), row(3, 3.9).unwrap());
    let omega = match varying {
        true => Omega::Each(vector(5).into_iter().map(|v| T::of(1.2 + 0.3 * v.wide())).collect()),
        false => Omega::Uniform(T::of(4.7) / T::of(3.9)),
    };
    let problem = Hlcp::new(a, b, omega).unwrap();
    let problem = match strip {
        Some(strip) => problem.shared_by(strip).unwrap(),
        None => problem,
    };
    let q = vector(11);
    let mut multigrid = Multigrid::new(problem.clone(), cycle).unwrap();
    let q = problem.rhs(&q).unwrap();
    let (mut x, mut y) = (vec![T::zero(); width * ny], vec![T::zero(); width * ny]);
    multigrid.nested(&q, &mut x, &mut Clock::endless());
    let first = multigrid.step(&q, &x, &mut y, &mut Clock::endless());
    let second = multigrid.step(&q, &y, &mut x, &mut Clock::endless());
    (strip.map_or(Some(x.clone()), |strip| strip.gather(&x)), [first, second])
}

fn ranks_agree<T: Scalar>(ranks: usize, grid: [usize; 2], varying: bool, cycle: Cycle) {
    let alone = nested_and_two_steps::<T>(None, grid, varying, cycle);
    let together = ranks_as_threads(ranks, |ranks| {
        let strip = Strip::new(ranks, grid).unwrap();
        nested_and_two_steps::<T>(Some(&strip), grid, varying, cycle)
    });
    for (rank, (x, norms)) in together.into_iter().enumerate() {
        assert_eq!(norms, alone.1, "{grid:?}, {varying}, {cycle:?}, {rank} of {ranks}");
        assert!(rank > 0 || x == alone.0, "{grid:?}, {varying}, {cycle:?}, {ranks} ranks");
    }
}

/// Grids whose sides halve and that do not, down to 16 columns a rank, and the last rank of five
/// with one, two and three columns, the first of them without a coarse one.
#[test]
fn ranks_share_every_grid_with_the_bits_of_one_process() {
    let grids = [[1025, 19], [1026, 6], [1027, 1], [1279, 12], [1300, 33], [1283, 2]];
    for (k, (grid, ranks)) in grids.into_iter().zip([5, 5, 5, 2, 3, 4]).enumerate() {
        let kinds = [Cycle::V, Cycle::F, Cycle::W];
        ranks_agree::<f64>(ranks, grid, k % 2 == 0, kinds[k % 3]);
        ranks_agree::<f32>(ranks, grid, k % 2 == 1, kinds[(k + 1) % 3]);
    }
}
