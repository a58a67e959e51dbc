//! Transfers between grids, and the smoother's defects, against matrices from their definitions.

use hlcp_core::{FivePoint, Hlcp, Omega, Smoother, Transfer};
use nalgebra::DMatrix;

use crate::common::noise;

fn list(n: usize, seed: usize) -> Vec<f64> {
    (0..n).map(|k| noise(seed + 7 * k)).collect()
}

fn close(u: &[f64], v: &[f64], tolerance: f64) {
    assert_eq!(u.len(), v.len());
    for (k, (u, v)) in u.iter().zip(v).enumerate() {
        assert!((u - v).abs() <= tolerance, "{k}: {u} {v}");
    }
}

/// How many points per side the next coarser grid has.
fn half(m: usize, round: bool) -> usize {
    match m {
        m if round && m % 2 == 0 && m > 4 => m / 2,
        m if round => m,
        1 | 2 => m,
        m if m % 2 == 1 => (m - 1) / 2,
        m => m / 2 - 1,
    }
}

/// Linear interpolation on the unit interval: hats over the coarse spacing. On a ring of an even
/// number of nodes, a coarse one gives its all to one and half to the two beside it.
fn hats(fine: usize, coarse: usize, round: bool) -> DMatrix<f64> {
    if round {
        let share = |i: usize, j: usize| match (i + 2 * fine - (2 * j + 1)) % fine {
            _ if coarse == fine => f64::from(u8::from(i == j)),
            0 => 1.0,
            1 => 0.5,
            back if back + 1 == fine => 0.5,
            _ => 0.0,
        };
        return DMatrix::from_fn(fine, coarse, share);
    }
    // The distance in coarse spacings is this number over fine + 1.
    let distance = |i: usize, j: usize| ((i + 1) * (coarse + 1)).abs_diff((j + 1) * (fine + 1));
    let hat = |i, j| (1.0 - distance(i, j) as f64 / (fine + 1) as f64).max(0.0);
    DMatrix::from_fn(fine, coarse, hat)
}

/// The Kronecker product of two matrices times a vector on a grid, whose rows are contiguous.
fn times([of_x, of_y]: &[DMatrix<f64>; 2], x: &[f64]) -> Vec<f64> {
    let x = DMatrix::from_column_slice(of_x.ncols(), of_y.ncols(), x);
    (of_x * x * of_y.transpose()).as_slice().to_vec()
}

const GRIDS: [[usize; 2]; 16] = [
    [1, 1],
    [2, 1],
    [3, 1],
    [3, 3],
    [4, 3],
    [5, 6],
    [7, 4],
    [8, 9],
    [10, 2],
    [16, 15],
    [1, 12],
    [13, 20],
    // More than one stretch of columns, and enough points for threads.
    [1023, 70],
    [1030, 67],
    [70, 1025],
    // A last stretch of columns that is full, and two more of the fine grid.
    [514, 3],
];

/// What `work` makes on one thread; on others it must be the same bits.
pub(crate) fn on_any_threads<R: PartialEq + Send>(work: impl Fn(bool) -> R + Sync) -> R {
    let alone = work(false);
    for threads in [1, 2, 3, 4, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(|| work(true)) == alone, "{threads} threads");
    }
    alone
}

#[test]
fn transfers_and_defects_are_those_matrices() {
    for (seed, fine) in GRIDS.into_iter().enumerate() {
        for round in [[false, false], [true, false], [false, true], [true, true]] {
            if fine.iter().zip(round).all(|(&side, round)| side >= 3 || !round) {
                transfers_and_defects_are_as_defined(seed, fine, round);
            }
        }
    }
}

fn transfers_and_defects_are_as_defined(seed: usize, fine: [usize; 2], round: [bool; 2]) {
    let transfer = Transfer::<f64>::new(fine, round);
    let coarse = transfer.coarse();
    assert_eq!(coarse, [0, 1].map(|d| half(fine[d], round[d])));
    let (n, c) = (fine[0] * fine[1], coarse[0] * coarse[1]);
    let (x, xc) = (list(n, seed), list(c, seed + 1));
    let p = [0, 1].map(|d| hats(fine[d], coarse[d], round[d]));

    let interpolated = on_any_threads(|parallel| {
        let mut interpolated = x.clone();
        transfer.interpolate(&xc, &mut interpolated, parallel);
        interpolated
    });
    let expected = times(&p, &xc);
    close(&interpolated, &expected.iter().zip(&x).map(|(p, x)| x + p).collect::<Vec<_>>(), 1e-13);

    let grid = |row| FivePoint::new(fine[0], fine[1], row).unwrap().periodic(round).unwrap();
    let [a, b] = [[-1.1, -0.9, 4.2, -0.8, -1.2], [-0.2, -0.7, 3.1, -0.6, 0.3]].map(grid);
    let problem = Hlcp::new(a, b, Omega::Uniform(1.3)).unwrap();
    let q = list(n, seed + 2);
    let mut defect = vec![f64::NAN; n];
    problem.defect(&q, &x, &mut defect, &mut vec![]);
    let subtracted = on_any_threads(|parallel| {
        let mut f: Vec<f64> = q.iter().map(|q| -q).collect();
        Smoother::new(&problem, None, parallel).unwrap().subtract(&x, &mut f);
        f.iter().map(|f| -f).collect::<Vec<_>>()
    });
    close(&subtracted, &defect, 1e-13);

    let ends = round.map(|round| usize::from(!round));
    let ratios = [0, 1].map(|d| (coarse[d] + ends[d]) as f64 / (fine[d] + ends[d]) as f64);
    let r = [0, 1].map(|d| ratios[d] * p[d].transpose());
    let restricted = on_any_threads(|parallel| {
        let mut restricted = vec![f64::NAN; c];
        let smoother = Smoother::new(&problem, None, parallel).unwrap();
        smoother.restrict((1.0, &q), &x, &transfer, &mut restricted);
        restricted
    });
    close(&restricted, &times(&r, &defect), 1e-13);

    let [columns, rows] = transfer.nearest();
    for (nearest, d) in [(columns, 0), (rows, 1)] {
        // The fine node at the least distance, the earlier one of two.
        for (j, &i) in nearest.iter().enumerate() {
            let along = |i: usize, m: usize| (i + 1) * (m + ends[d]);
            let distance = |i: usize| along(i, coarse[d]).abs_diff(along(j, fine[d]));
            let least = (0..fine[d]).min_by_key(|&i| (distance(i), std::cmp::Reverse(i)));
            assert_eq!(Some(i), least);
        }
    }
    transfer.inject(&x, |k, value| {
        assert_eq!(value, x[rows[k / coarse[0]] * fine[0] + columns[k % coarse[0]]]);
    });
}

/// Through four points a cubic is exact, whatever it is at the boundary.
#[test]
fn nested_interpolation_is_exact_for_cubics() {
    for fine in [[9, 13], [10, 12], [11, 16], [27, 14]] {
        let transfer = Transfer::new(fine, [false; 2]);
        let cubic = |x: f64, y: f64| (1.0 + x - 3.0 * x * x * x) * (0.7 - y * y + 2.0 * y * y * y);
        let on = |[nx, ny]: [usize; 2]| -> Vec<f64> {
            let at = |i: usize, n: usize| (i + 1) as f64 / (n + 1) as f64;
            (0..nx * ny).map(|k| cubic(at(k % nx, nx), at(k / nx, ny))).collect()
        };
        let mut interpolated = vec![f64::NAN; fine[0] * fine[1]];
        transfer.interpolate_smooth(&on(transfer.coarse()), &mut interpolated, false);
        close(&interpolated, &on(fine), 1e-13);
    }
}

/// Half-way between two inner nodes the four around have the weights −1, 9, 9, −1 over 16.
#[test]
fn nested_interpolation_is_centred() {
    let mut unit = vec![0.0; 13];
    unit[4] = 16.0;
    let mut fine = vec![f64::NAN; 27];
    Transfer::new([27, 1], [false; 2]).interpolate_smooth(&unit, &mut fine, false);
    let around: Vec<f64> = (6..13).step_by(2).map(|k| fine[k]).collect();
    close(&around, &[-1.0, 9.0, 9.0, -1.0], 1e-13);
}
