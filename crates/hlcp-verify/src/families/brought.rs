//! Families of what other trades bring, of 10³ to 10⁵ unknowns: matrices that no sweep, no
//! aggregate and no grid is meant for, and problems in disguise.

use std::f64::consts::{PI, TAU};

use nalgebra_sparse::CsrMatrix;

use super::{Operator, Plane, Problem, Random, draw, field, noise, rows};

/// The families that a disguise hides one of.
const HIDDEN: [&str; 9] =
    ["dimples", "rings", "jumps", "wind", "islands", "space", "sparse", "meshes", "graphs"];

/// The sides of a plane of 10³ to 10⁵ points, within a factor of two of a square.
fn plane(random: &mut Random) -> [usize; 2] {
    let (points, ratio) = (random.log(1e3, 1e5), random.log(0.5, 2.0));
    [(points * ratio).sqrt() as usize, (points / ratio).sqrt() as usize]
}

/// A smooth load of either sign.
fn load(random: &mut Random, [nx, ny]: [usize; 2], size: f64) -> Vec<f64> {
    let (seed, mean) = (random.next() >> 1, random.real(-0.5, 0.5));
    let at = |k: usize| [(k % nx) as f64 / nx as f64, (k / nx) as f64 / ny as f64];
    let of = |k| {
        let [x, y] = at(k).map(|at| at + 1e-3);
        size * (field(seed, 3, x, y) - mean)
    };
    (0..nx * ny).map(of).collect()
}

/// A positive definite matrix that is all but skew: `s (R − Rᵀ) + D`, four entries to a row of `R`.
pub(super) fn skew(random: &mut Random) -> (Problem, String) {
    let n = random.log(500.0, 5000.0) as usize;
    let (s, d) = (random.log(0.1, 30.0), random.log(0.1, 10.0));
    let mut entries: Vec<_> = (0..n).map(|i| (i, i, d)).collect();
    for i in 0..n {
        for _ in 0..4 {
            let (j, a) = (random.whole(0, n - 1), s * random.real(-1.0, 1.0));
            entries.extend([(i, j, a), (j, i, -a)]);
        }
    }
    let a = Operator::Rows(rows(n, entries));
    let q = (0..n).map(|_| random.real(-1.0, 1.0)).collect();
    ((a, Operator::Identity(n), q), format!("n {n}, skew {s:.2}, diagonal {d:.2}"))
}

/// A plate over an obstacle: the square of the Laplacian, thirteen entries to a row.
pub(super) fn plate(random: &mut Random) -> (Problem, String) {
    let sides @ [nx, ny] = plane(random).map(|side| side.min(200));
    let on = Plane::new(sides, ny as f64 / nx as f64, [0.0; 2], false);
    let scale = 1.0 / nx as f64;
    let laplacian = on.operator(on.conduction(|_, _| 1.0)).rows();
    let a = &laplacian * &laplacian;
    let q = load(random, sides, scale.powi(4));
    ((Operator::Rows(a), Operator::Identity(nx * ny), q), format!("{nx} x {ny} points"))
}

/// Linear elements on triangles with jittered corners, under a random numbering: conductivities
/// jump by up to 10⁵, and angles may be obtuse; an LCP, or with transport along the edges in `B`.
pub(super) fn mesh(random: &mut Random) -> (Problem, String) {
    let [nx, ny] = plane(random);
    let (jump, seed, blocks) = (random.log(1.0, 1e5), random.next() >> 1, random.log(2.0, 20.0));
    let (jitter, carries) = (random.real(0.0, 0.24), random.chance(0.5));
    let corners: Vec<[f64; 2]> = (0..(nx + 2) * (ny + 2))
        .map(|k| [k % (nx + 2), k / (nx + 2)].map(|i| i as f64 + jitter * random.real(-1.0, 1.0)))
        .collect();
    let n = nx * ny;
    let number = shuffled(random, n);
    // Corners on the edge are held.
    let inner = |k: usize| {
        let (i, j) = (k % (nx + 2), k / (nx + 2));
        (i > 0 && j > 0 && i <= nx && j <= ny).then(|| number[(j - 1) * nx + i - 1])
    };
    let (mut a, mut b) = (vec![], vec![]);
    for cell in 0..(nx + 1) * (ny + 1) {
        let (i, j) = (cell % (nx + 1), cell / (nx + 1));
        let corner = j * (nx + 2) + i;
        let [sw, se, nw, ne] = [corner, corner + 1, corner + nx + 2, corner + nx + 3];
        let halves = if random.chance(0.5) {
            [[sw, se, ne], [sw, ne, nw]]
        } else {
            [[sw, se, nw], [se, ne, nw]]
        };
        let block = |i: usize, side: usize| (i as f64 / side as f64 * blocks) as i64;
        let k = if noise(seed, block(i, nx), block(j, ny)) > 0.0 { jump } else { 1.0 };
        for triangle in halves {
            let at = triangle.map(|corner| corners[corner]);
            // The edge opposite each corner, turned by a right angle.
            let edge = |c: usize| {
                let [from, to] = [at[(c + 1) % 3], at[(c + 2) % 3]];
                [from[1] - to[1], to[0] - from[0]]
            };
            let [[x0, y0], [x1, y1]] = [edge(0), edge(1)];
            let doubled = x0 * y1 - x1 * y0;
            for (c, d) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 0), (1, 2), (2, 2), (2, 0), (2, 1)] {
                let (Some(row), Some(column)) = (inner(triangle[c]), inner(triangle[d])) else {
                    continue;
                };
                let [[u, v], [x, y]] = [edge(c), edge(d)];
                a.push((row, column, k * (u * x + v * y) / (2.0 * doubled)));
                if c == d {
                    b.push((row, row, 1.0));
                } else if carries && at[c][0] > at[d][0] {
                    b.push((row, column, -0.5));
                    b.push((column, column, 0.5));
                }
            }
        }
    }
    let q = load(random, [nx, ny], 30.0 / nx as f64);
    let mut numbered = q.clone();
    number.iter().zip(q).for_each(|(&place, q)| numbered[place] = q);
    let about = format!(
        "{nx} x {ny} corners, jump {jump:.1e}, jitter {jitter:.2}{}",
        if carries { ", transport in B" } else { "" }
    );
    ((Operator::Rows(rows(n, a)), Operator::Rows(rows(n, b)), numbered), about)
}

/// The numbers below `n` in a random order.
fn shuffled(random: &mut Random, n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    (1..n).rev().for_each(|k| order.swap(k, random.whole(0, k)));
    order
}

/// The Laplacian of a graph that grew by joining what many had joined before, and a little of the
/// identity.
pub(super) fn graph(random: &mut Random) -> (Problem, String) {
    let n = random.log(1e3, 6e4) as usize;
    let (per, ground) = (random.whole(1, 4), random.log(1e-4, 1.0));
    let (mut ends, mut entries) = (vec![0], vec![(0, 0, ground)]);
    for i in 1..n {
        entries.push((i, i, ground));
        for _ in 0..per {
            let (j, weight) = (ends[random.whole(0, ends.len() - 1)], random.log(0.1, 10.0));
            if i != j {
                entries.extend([(i, j, -weight), (j, i, -weight), (i, i, weight), (j, j, weight)]);
                ends.extend([i, j]);
            }
        }
    }
    let q = (0..n).map(|_| random.real(-1.0, 0.6)).collect();
    let a = Operator::Rows(rows(n, entries));
    ((a, Operator::Identity(n), q), format!("n {n}, {per} joined, ground {ground:.1e}"))
}

/// A contact in a wind that blows in circles, as strong as 10⁴ times diffusion.
pub(super) fn swirl(random: &mut Random) -> (Problem, String) {
    let sides @ [nx, ny] = plane(random);
    let (strength, rounds) = (random.log(1.0, 1e4), random.whole(1, 4));
    let on = Plane::new(sides, 1.0, [0.0; 2], false);
    let k = PI * rounds as f64;
    let stream = |[x, y]: [f64; 2]| (k * x).sin() * (k * y).sin() * strength / k;
    let mut a = on.conduction(|_, _| 1.0);
    // What flows through a face is what the stream function differs by between its ends.
    let carried = on.map(|near, _, [width, height]| {
        let [x, y] = near[2];
        let at = |i: f64, j: f64| stream([x + i * width / 2.0, y + j * height / 2.0]);
        let [sw, se, nw, ne] = [at(-1.0, -1.0), at(1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0)];
        let inwards = [sw - se, nw - sw, 0.0, se - ne, ne - nw];
        let mut row = inwards.map(|inwards: f64| -inwards.max(0.0));
        row[2] = inwards.iter().map(|inwards| (-inwards).max(0.0)).sum();
        row
    });
    a.iter_mut().zip(&carried).for_each(|(a, b)| (0..5).for_each(|k| a[k] += b[k]));
    let q = load(random, sides, 10.0 / (nx * ny) as f64);
    let about = format!("{nx} x {ny} points, {rounds} circles, wind {strength:.1e}");
    ((on.operator(a), Operator::Identity(nx * ny), q), about)
}

/// Layers of ground whose conductivities are 10⁻⁴ to 1, with water that sinks in `B`.
pub(super) fn layers(random: &mut Random) -> (Problem, String) {
    let [nx, ny, nz] = [(); 3].map(|()| random.log(10.0, 40.0) as usize);
    let seed = random.next() >> 1;
    let n = nx * ny * nz;
    let of = |k: usize| {
        let z = (k / nx / ny) as i64;
        10_f64.powf(2.0 * noise(seed, z / 3, 0) - 2.0)
    };
    let (mut a, mut b) = (vec![], vec![]);
    for k in 0..n {
        let places = [(k % nx, 1, nx), (k / nx % ny, nx, ny), (k / nx / ny, nx * ny, nz)];
        for (i, stride, side) in places {
            if i + 1 < side {
                let c = 2.0 / (1.0 / of(k) + 1.0 / of(k + stride));
                let o = k + stride;
                a.extend([(k, k, c), (o, o, c), (k, o, -c), (o, k, -c)]);
            }
        }
        let (z, _, _) = places[2];
        // The ground below is held, the sides are closed.
        a.push((k, k, if z == 0 { 2.0 * of(k) } else { 1e-9 }));
        b.push((k, k, of(k)));
        if z + 1 < nz {
            b.push((k, k + nx * ny, -of(k + nx * ny)));
        }
    }
    let rain = random.log(1e-3, 1.0);
    let drain = random.real(-1.0, 0.0);
    let q = (0..n).map(|k| {
        let [x, y] = [(k % nx) as f64 / nx as f64, (k / nx % ny) as f64 / ny as f64];
        if k / nx / ny + 1 == nz {
            -rain * ((5.0 * x).sin() + (4.0 * y).cos() + drain)
        } else {
            0.0
        }
    });
    let q = q.map(|q| q + 1e-4).collect();
    let about = format!("{nx} x {ny} x {nz} cells, rain {rain:.1e}");
    ((Operator::Rows(rows(n, a)), Operator::Rows(rows(n, b)), q), about)
}

/// Masses on a string of springs whose stiffness varies by up to 10⁸, above a floor.
pub(super) fn string(random: &mut Random) -> (Problem, String) {
    let (n, spread) = (random.log(1e3, 2e4) as usize, random.real(0.0, 4.0));
    let stiffness: Vec<f64> = (0..=n).map(|_| 10_f64.powf(random.real(-spread, spread))).collect();
    let entries = (0..n).flat_map(|i| {
        let [left, right] = [stiffness[i], stiffness[i + 1]];
        let before = (i > 0).then(|| (i, i - 1, -left));
        let after = (i + 1 < n).then(|| (i, i + 1, -right));
        [(i, i, left + right)].into_iter().chain(before).chain(after)
    });
    let a = rows(n, entries);
    let q = (0..n).map(|_| random.real(-1.0, 1.0)).collect();
    let about = format!("{n} masses, stiffness 1e±{spread:.1}");
    ((Operator::Rows(a), Operator::Identity(n), q), about)
}

/// A load whose sign changes every few points, so that no coarse grid sees it.
pub(super) fn stripes(random: &mut Random) -> (Problem, String) {
    let [nx, ny] = plane(random);
    let grid = |stencil: [f64; 5]| (0..nx * ny).map(|_| stencil).collect::<Vec<_>>();
    let on = Plane::new([nx, ny], 1.0, [0.0; 2], false);
    let (turn, lines) = (random.log(2e-3, 2.0), random.chance(0.5));
    let a = on.operator(grid([-1.0, -1.0, 4.0, -1.0, -1.0]));
    let b = if lines {
        on.operator(grid([0.0, -1.0, 4.0, -1.0, 0.0]))
    } else {
        Operator::Identity(nx * ny)
    };
    let q = (0..nx * ny).map(|k| (turn * k as f64).sin()).collect();
    let about =
        format!("{nx} x {ny} points, sin({turn:.4} k){}", if lines { ", HLCP" } else { "" });
    ((a, b, q), about)
}

/// A journal bearing all around whose sides are at the cavitation pressure: what is in it stays.
pub(super) fn unfed(random: &mut Random) -> (Problem, String) {
    let [nx, ny] = plane(random).map(|side| side.min(300));
    let (eccentricity, aspect) = (1.0 - random.log(0.02, 0.9), random.log(0.03, 3.0));
    let plane = Plane::new([nx, ny], aspect, [0.0; 2], true);
    let way = if random.chance(0.5) { 1.0 } else { -1.0 };
    let gap = |x: f64, _: f64| 1.0 + eccentricity * (TAU * x).cos();
    let about =
        format!("{nx} x {ny} cells, eccentricity {eccentricity:.2}, aspect {aspect:.2}, way {way}");
    (plane.film(gap, [way, 0.0], 0.0), about)
}

/// A problem of another family in disguise: rows multiplied by up to 10^±6 and both unknowns by
/// 10^±3 at random, unknowns renumbered, `z` and `r` exchanged; each of it or not.
pub(super) fn disguised(random: &mut Random) -> (Problem, String) {
    let family = HIDDEN[random.whole(0, HIDDEN.len() - 1)];
    let of = draw(family, random.next() % 1000).expect("a family");
    let n = of.q.len();
    let each = |random: &mut Random, size: f64, chance: f64| -> (Vec<f64>, bool) {
        let used = random.chance(chance);
        let scale =
            |random: &mut Random| if used { 10_f64.powf(random.real(-size, size)) } else { 1.0 };
        ((0..n).map(|_| scale(random)).collect(), used)
    };
    let (row, by_rows) = each(random, 6.0, 0.7);
    let (z, by_unknowns) = each(random, 3.0, 0.3);
    let (r, _) = each(random, 3.0, f64::from(by_unknowns));
    let (moved, exchanged) = (random.chance(0.4), random.chance(0.3));
    let place = if moved { shuffled(random, n) } else { (0..n).collect() };
    let disguise = |matrix: &CsrMatrix<f64>, columns: &[f64]| {
        let entries = matrix.triplet_iter();
        rows(n, entries.map(|(i, j, a)| (place[i], place[j], row[i] * a * columns[j])))
    };
    let [mut a, mut b] = [(&of.a, &z), (&of.b, &r)].map(|(of, by)| disguise(&of.rows(), by));
    let mut q = vec![0.0; n];
    (0..n).for_each(|i| q[place[i]] = row[i] * of.q[i]);
    if exchanged {
        // A z − B r + q = 0 is B r − A z − q = 0.
        std::mem::swap(&mut a, &mut b);
        q.iter_mut().for_each(|q| *q = -*q);
    }
    let told = [
        (by_rows, "rows scaled"),
        (by_unknowns, "unknowns scaled"),
        (moved, "renumbered"),
        (exchanged, "exchanged"),
    ];
    let told: Vec<_> = told.iter().filter(|told| told.0).map(|told| told.1).collect();
    ((Operator::Rows(a), Operator::Rows(b), q), format!("{}: {}", of.name, told.join(", ")))
}
