//! Problems drawn by seed, in families of what people bring: nobody chose them.
//!
//! Films carry oil along in a gap that is textured, rough, tapered or closed to a ring: `A`
//! conducts the gap's cube between cells, by the harmonic mean, and `B` carries the gap upwind.
//! Contacts have diffusion in `A` and, as a rule, the identity in `B`. In the dense family `A` is a
//! P-matrix and `B` the identity, so that every `q` has one solution and no more. In the others of
//! [`NAMES`] the columns of `A` and `B` dominate, if weakly, and
//! [`uniqueness`](crate::uniqueness) proves the same of all but rings. What flows around a ring
//! adds up to nothing: up to rounding its columns of `B` are dependent, so that some `q` have no
//! solution or several. Nothing is known of the `q` that is drawn, nor of the large families
//! beyond what each says.

use std::f64::consts::{PI, TAU};

mod brought;

use hlcp_core::{Diagonal, FivePoint, Identity, LinearOperator, Rows, Scalar};
use nalgebra_sparse::{CooMatrix, CsrMatrix};

/// The families, in the order of a report. A seed stands for another problem of a family once that
/// has another place, so new ones are the last.
///
/// ```
/// use hlcp_verify::families;
///
/// assert!(families::NAMES.iter().all(|name| families::draw(name, 1).is_some()));
/// assert!(families::draw("sudoku", 1).is_none());
/// ```
pub const NAMES: [&str; 15] = [
    "squares", "dimples", "grooves", "rough", "rings", "oblong", "jumps", "wind", "islands",
    "space", "sparse", "graded", "dense", "units", "single",
];

/// Families of 10³ to 10⁵ unknowns, after those of [`NAMES`]: matrices that no sweep, no aggregate
/// and no grid is meant for, and problems in disguise.
///
/// ```
/// use hlcp_core::LinearOperator;
/// use hlcp_verify::families;
///
/// let plate = families::draw("plates", 3).expect("there is such a family");
/// let ([a, _], _) = plate.pose::<f64>();
/// assert!(families::LARGE.contains(&"plates") && a.order() >= 1000);
/// ```
#[rustfmt::skip] // a list
pub const LARGE: [&str; 10] = [
    "skew", "plates", "meshes", "graphs", "swirls", "layers", "strings", "stripes", "unfed",
    "disguised",
];

/// A problem of a family.
///
/// ```
/// use hlcp_core::Hlcp;
/// use hlcp_verify::families;
///
/// let drawn = families::draw("rings", 7).expect("there is such a family");
/// assert_eq!(drawn.name, "rings-7");
/// let ([a, b], q) = drawn.pose::<f64>();
/// let problem = Hlcp::from_pair(&a, &b)?;
/// assert!(problem.order() == q.len() && problem.grid().is_err()); // it closes: not five-point
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The family and the seed.
    pub name: String,
    /// The numbers that were drawn.
    pub about: String,
    /// True if the problem is to be solved in single precision.
    pub single: bool,
    a: Operator,
    b: Operator,
    q: Vec<f64>,
    /// The factors of `A`, `B` and `q`: units of pressure, of the film and of mass.
    units: [f64; 3],
}

#[derive(Debug, Clone)]
enum Operator {
    /// The sides of a grid, and the stencil of each point.
    Grid([usize; 2], Stencils),
    Rows(CsrMatrix<f64>),
    Identity(usize),
}

impl Operator {
    fn times<T: Scalar>(&self, factor: f64) -> Box<dyn Rows<T>> {
        match self {
            Self::Grid([nx, ny], stencils) => {
                let row = |i: usize, j: usize| stencils[j * nx + i].map(|a| T::of(factor * a));
                Box::new(FivePoint::from_fn(*nx, *ny, row).expect("finite numbers"))
            }
            Self::Rows(rows) => {
                let values = rows.values().iter().map(|a| T::of(factor * a)).collect();
                let scaled = CsrMatrix::try_from_pattern_and_values(rows.pattern().clone(), values);
                Box::new(scaled.expect("a value for each entry"))
            }
            &Self::Identity(order) => Box::new(Identity { order }),
        }
    }

    fn rows(&self) -> CsrMatrix<f64> {
        if let Self::Rows(matrix) = self {
            return matrix.clone();
        }
        let (of, mut entries) = (self.times::<f64>(1.0), vec![]);
        (0..of.order()).for_each(|i| of.visit_row(i, &mut |j, a| entries.push((i, j, a))));
        rows(of.order(), entries)
    }
}

impl Drawn {
    /// `A`, `B` and `q` in precision `T`.
    pub fn pose<T: Scalar>(&self) -> ([Box<dyn Rows<T>>; 2], Vec<T>) {
        let [a, b, q] = self.units;
        ([self.a.times(a), self.b.times(b)], self.q.iter().map(|&v| T::of(q * v)).collect())
    }
}

/// Draws the problem of a family that `seed` stands for; `None` if there is no such family.
pub fn draw(family: &str, seed: u64) -> Option<Drawn> {
    let place = |names: &[&str]| names.iter().position(|&name| name == family);
    // What a seed stands for in one list does not depend on the length of the other.
    let place = place(&NAMES).or_else(|| place(&LARGE).map(|place| 15 + place))?;
    let mut random = Random(seed.wrapping_mul(64).wrapping_add(place as u64));
    let random = &mut random;
    let ((a, b, q), about) = match family {
        "squares" | "dimples" | "grooves" | "rough" => textured(random, family),
        "rings" => ring(random),
        "oblong" => oblong(random),
        "jumps" | "wind" | "islands" | "graded" => contact(random, family),
        "space" => space(random),
        "sparse" => sparse(random),
        "dense" => dense(random),
        "units" | "single" => {
            // A film in SI units; and anything else in single precision.
            let units = family == "units";
            let of = if units { random.whole(0, 5) } else { random.whole(0, 11) };
            let mut drawn = draw(NAMES[of], random.next() % 1000)?;
            drawn.about = format!("{}, {}", drawn.name, drawn.about);
            drawn.name = format!("{family}-{seed}");
            if units {
                drawn.units = [1e-20, 1e-12, 1e-18].map(|least| random.log(least, 1.0));
                let [a, b, q] = drawn.units;
                drawn.about += &format!(", in units {a:.0e}, {b:.0e}, {q:.0e}");
            }
            drawn.single = !units;
            return Some(drawn);
        }
        "skew" => brought::skew(random),
        "plates" => brought::plate(random),
        "meshes" => brought::mesh(random),
        "graphs" => brought::graph(random),
        "swirls" => brought::swirl(random),
        "layers" => brought::layers(random),
        "strings" => brought::string(random),
        "stripes" => brought::stripes(random),
        "unfed" => brought::unfed(random),
        "disguised" => brought::disguised(random),
        _ => unreachable!("a name of either list"),
    };
    let name = format!("{family}-{seed}");
    Some(Drawn { name, about, single: false, a, b, q, units: [1.0; 3] })
}

type Problem = (Operator, Operator, Vec<f64>);

/// Numbers without a pattern: the generator `SplitMix64` of Steele, Lea and Flood (OOPSLA 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn real(&mut self, least: f64, most: f64) -> f64 {
        least + (self.next() >> 11) as f64 / (1_u64 << 53) as f64 * (most - least)
    }

    /// Between `least` and `most`, with each power of ten as likely as any other.
    fn log(&mut self, least: f64, most: f64) -> f64 {
        self.real(least.ln(), most.ln()).exp()
    }

    /// From `least` to `most`, both included.
    fn whole(&mut self, least: usize, most: usize) -> usize {
        least + (self.next() % (most - least + 1) as u64) as usize
    }

    fn sides(&mut self) -> [usize; 2] {
        [self.log(12.0, 160.0), self.log(12.0, 160.0)].map(|side| side as usize)
    }

    fn chance(&mut self, share: f64) -> bool {
        self.real(0.0, 1.0) < share
    }
}

/// A number between −1 and 1 for a point of a lattice.
fn noise(seed: u64, i: i64, j: i64) -> f64 {
    let mut random =
        Random(seed ^ (i as u64).wrapping_mul(0x517c_c1b7_2722_0a95) ^ ((j as u64) << 40));
    random.next();
    random.real(-1.0, 1.0)
}

/// A random field: noise on lattices of ever finer cells, each half as high as that before.
fn field(seed: u64, octaves: u32, x: f64, y: f64) -> f64 {
    (0..octaves).fold(0.0, |sum, octave| {
        let cells = f64::from(4 << octave);
        let [(i, u), (j, v)] = [x * cells, y * cells].map(|at| (at.floor(), at - at.floor()));
        let at =
            |di: f64, dj: f64| noise(seed + u64::from(octave), (i + di) as i64, (j + dj) as i64);
        let line = |dj: f64| at(0.0, dj) * (1.0 - u) + at(1.0, dj) * u;
        sum + (line(0.0) * (1.0 - v) + line(1.0) * v) / f64::from(1 << octave)
    })
}

/// A plane of points with their places along both axes, from beyond one edge to beyond the other.
struct Plane {
    places: [Vec<f64>; 2],
    /// True if the last point of a line is a neighbour of the first.
    closed: bool,
}

/// `[south, west, centre, east, north]` of each point.
type Stencils = Vec<[f64; 5]>;

impl Plane {
    /// A rectangle of lengths 1 and `aspect`, whose spacings grow by `e^grading` along each axis.
    fn new([nx, ny]: [usize; 2], aspect: f64, grading: [f64; 2], closed: bool) -> Self {
        let axis = |n: usize, length: f64, grading: f64, closed: bool| -> Vec<f64> {
            let cells = if closed { n } else { n + 1 } as f64;
            let share = |i: f64| match (closed, grading.abs() < 1e-6) {
                (true, _) => (i - 1.0) / cells,
                (false, true) => i / cells,
                _ => ((grading * i / cells).exp() - 1.0) / (grading.exp() - 1.0),
            };
            (0..n + 2).map(|i| length * share(i as f64)).collect()
        };
        let places = [axis(nx, 1.0, grading[0], closed), axis(ny, aspect, grading[1], false)];
        Self { places, closed }
    }

    fn cells(&self) -> [usize; 2] {
        self.places.each_ref().map(|places| places.len() - 2)
    }

    /// Calls `each` with `[x, y]` of a point's neighbours and itself, in the order of a stencil,
    /// with the distances to the former, and with the sides of the point's cell.
    fn map(&self, each: impl Fn([[f64; 2]; 5], [f64; 4], [f64; 2]) -> [f64; 5]) -> Stencils {
        let ([nx, ny], [xs, ys]) = (self.cells(), &self.places);
        let point = |k: usize| {
            let (i, j) = (k % nx + 1, k / nx + 1);
            let at = |i: usize, j: usize| [xs[i], ys[j]];
            let near = [at(i, j - 1), at(i - 1, j), at(i, j), at(i + 1, j), at(i, j + 1)];
            let [s, n] = [ys[j] - ys[j - 1], ys[j + 1] - ys[j]];
            let [w, e] = [xs[i] - xs[i - 1], xs[i + 1] - xs[i]];
            each(near, [s, w, e, n], [(w + e) / 2.0, (s + n) / 2.0])
        };
        (0..nx * ny).map(point).collect()
    }

    /// Diffusion with a conductivity, between points by its harmonic mean.
    fn conduction(&self, conductivity: impl Fn(f64, f64) -> f64) -> Stencils {
        self.map(|near, [s, w, e, n], [width, height]| {
            let k = near.map(|[x, y]| conductivity(x, y));
            let bond =
                |at: usize, way: f64, face: f64| 2.0 / (1.0 / k[2] + 1.0 / k[at]) * face / way;
            let [s, w] = [bond(0, s, width), bond(1, w, height)];
            let [e, n] = [bond(3, e, height), bond(4, n, width)];
            [-s, -w, s + w + e + n, -e, -n]
        })
    }

    /// Transport of what is `density` thick by a wind, upwind.
    fn transport(&self, [u, v]: [f64; 2], density: impl Fn(f64, f64) -> f64) -> Stencils {
        self.map(|near, _, [width, height]| {
            let h = near.map(|[x, y]| density(x, y));
            let [u, v] = [u * height, v * width];
            let from = |wind: f64, at: usize| -wind.max(0.0) * h[at];
            [from(v, 0), from(u, 1), (u.abs() + v.abs()) * h[2], from(-u, 3), from(-v, 4)]
        })
    }

    fn operator(&self, stencils: Stencils) -> Operator {
        let [nx, ny] = self.cells();
        if !self.closed {
            return Operator::Grid([nx, ny], stencils);
        }
        let entries =
            stencils.iter().enumerate().flat_map(|(k, &[south, west, centre, east, north])| {
                let (i, row) = (k % nx, k - k % nx);
                let south = (row > 0).then(|| (k - nx, south));
                let north = (k + nx < nx * ny).then(|| (k + nx, north));
                let line =
                    [(row + (i + nx - 1) % nx, west), (k, centre), (row + (i + 1) % nx, east)];
                line.into_iter().chain(south).chain(north).map(move |(j, a)| (k, j, a))
            });
        Operator::Rows(rows(nx * ny, entries))
    }

    /// The film of a gap: what is full everywhere gains `q`, and beyond the edges the pressure is
    /// ambient.
    fn film(&self, gap: impl Fn(f64, f64) -> f64, wind: [f64; 2], ambient: f64) -> Problem {
        let a = self.conduction(|x, y| gap(x, y).powi(3));
        let b = self.transport(wind, gap);
        let [nx, ny] = self.cells();
        let q = a.iter().zip(&b).enumerate().map(|(k, (a, b))| {
            let (i, j) = (k % nx, k / nx);
            let edges =
                [j == 0, !self.closed && i == 0, false, !self.closed && i + 1 == nx, j + 1 == ny];
            let outside = edges.iter().zip(a).filter(|edge| *edge.0).map(|edge| edge.1);
            b.iter().sum::<f64>() + ambient * outside.sum::<f64>()
        });
        let q = q.collect();
        (self.operator(a), self.operator(b), q)
    }
}

/// A sparse matrix of the sums of what comes for each entry.
fn rows(n: usize, entries: impl IntoIterator<Item = (usize, usize, f64)>) -> CsrMatrix<f64> {
    let mut matrix = CooMatrix::new(n, n);
    entries.into_iter().for_each(|(i, j, a)| matrix.push(i, j, a));
    CsrMatrix::from(&matrix)
}

/// A slider whose lower side has dimples, grooves or asperities.
fn textured(random: &mut Random, texture: &str) -> (Problem, String) {
    let cells @ [nx, ny] = random.sides();
    let k = random.log(2.0, 64.0_f64.min(nx.min(ny) as f64 / 3.0)).round();
    let (depth, aspect) = (random.log(0.2, 10.0), random.log(0.1, 10.0));
    let inclination = if random.chance(0.3) { 0.0 } else { random.real(0.0, 2.0) };
    let ambient = if random.chance(0.5) { 0.0 } else { random.log(1e-4, 0.1) };
    let (seed, turn) = (random.next() >> 1, random.real(-1.2, 1.2));
    let least = random.log(0.01, 0.5);
    let gap = |x: f64, y: f64| {
        let inside = x > 0.0 && x < 1.0 && y > 0.0 && y < aspect;
        let [u, v] = [k * x, k * y / aspect].map(|at| at - at.floor() - 0.5);
        let texture = match texture {
            _ if !inside => 0.0,
            "squares" => f64::from(u.abs() < 0.25 && v.abs() < 0.25),
            "dimples" => (1.0 - 9.0 * (u * u + v * v)).max(0.0),
            "grooves" => f64::from((k * (x + turn * (y / aspect - 0.5).abs()) * TAU).sin() > 0.0),
            _ => (1.0 + field(seed, 6, x, y / aspect)).max(least / depth),
        };
        1.0 + inclination * (1.0 - x) + depth * texture
    };
    let problem = Plane::new(cells, aspect, [0.0; 2], false).film(gap, [1.0, 0.0], ambient);
    let about = format!(
        "{nx} x {ny} cells, K {k}, depth {depth:.2}, inclination {inclination:.2}, \
         aspect {aspect:.2}, ambient {ambient:.1e}"
    );
    (problem, about)
}

/// A journal bearing all around, with or without a pocket that is fed.
fn ring(random: &mut Random) -> (Problem, String) {
    let cells @ [nx, ny] = random.sides();
    let (eccentricity, aspect) = (1.0 - random.log(0.02, 0.9), random.log(0.03, 3.0));
    let (ambient, supply) = (random.log(1e-4, 0.3), random.chance(0.5));
    let way = if random.chance(0.5) { 1.0 } else { -1.0 };
    let gap = |x: f64, _: f64| 1.0 + eccentricity * (TAU * x).cos();
    let plane = Plane::new(cells, aspect, [0.0; 2], true);
    let (mut a, b, mut q) = plane.film(gap, [way, 0.0], ambient);
    if let (true, Operator::Rows(a)) = (supply, &mut a) {
        let fixed = a.diagonal_entry(0) * 1e3;
        let pocket: Vec<usize> = (ny / 3..2 * ny / 3).map(|j| j * nx).collect();
        pocket.iter().for_each(|&k| q[k] -= 2.0 * fixed);
        *a = &*a + rows(nx * ny, pocket.iter().map(|&k| (k, k, fixed)));
    }
    let about = format!(
        "{nx} x {ny} cells, eccentricity {eccentricity:.2}, aspect {aspect:.2}, \
         ambient {ambient:.1e}, way {way}{}",
        if supply { ", fed" } else { "" }
    );
    ((a, b, q), about)
}

/// A bearing of long cells, cut open at the widest gap and tapered along its axis.
fn oblong(random: &mut Random) -> (Problem, String) {
    let cells @ [nx, ny] = [random.log(4.0, 200.0) as usize, random.log(4.0, 200.0) as usize];
    let aspect = random.log(0.02, 50.0);
    let (eccentricity, taper) = (1.0 - random.log(0.02, 0.9), random.real(0.0, 0.9));
    let gap = |x: f64, y: f64| {
        (1.0 + eccentricity * (TAU * x).cos()) * (1.0 - taper * (y / aspect).clamp(0.0, 1.0))
    };
    let problem = Plane::new(cells, aspect, [0.0; 2], false).film(gap, [1.0, 0.0], 0.0);
    let about = format!(
        "{nx} x {ny} cells, aspect {aspect:.2}, eccentricity {eccentricity:.2}, taper {taper:.2}"
    );
    (problem, about)
}

/// Diffusion under a load that pushes here and pulls there: with coefficients that jump, with a
/// wind in `A` or for `B`, on a graded mesh.
fn contact(random: &mut Random, family: &str) -> (Problem, String) {
    let cells @ [nx, ny] = random.sides();
    let number = |random: &mut Random, range: [f64; 2], of: &str| {
        if family == of { random.log(range[0], range[1]) } else { 1.0 }
    };
    let jump = number(random, [10.0, 1e6], "jumps");
    let strength = number(random, [1e-2, 1e4], "wind");
    let growth = [(); 2].map(|()| number(random, [1.0, 1e3], "graded").ln());
    let (seed, blocks, islands) = (random.next() >> 1, random.whole(1, 24), random.whole(1, 9));
    let (load, turn, winds) = (random.real(-0.9, 0.9), random.real(0.0, TAU), random.whole(0, 2));
    let plane = Plane::new(cells, 1.0, growth, false);
    let block = |x: f64| (x * blocks as f64).floor() as i64;
    let conductivity = |x: f64, y: f64| {
        if noise(seed, block(x), block(y)) > 0.0 { jump } else { 1.0 }
    };
    let mut a = plane.conduction(conductivity);
    let wind = [strength * turn.cos(), strength * turn.sin()];
    let carried = plane.transport(wind, |_, _| 1.0);
    let pushes = |x: f64, y: f64| {
        let k = PI * islands as f64;
        (k * x).sin() * (k * y).cos() + 0.3 * field(seed + 99, 3, x, y) - load
    };
    let q =
        plane.map(|near, _, [width, height]| [pushes(near[2][0], near[2][1]) * width * height; 5]);
    let q = q.iter().map(|q| 10.0 * q[0]).collect();
    let (kind, b) = match (family, winds) {
        ("wind" | "jumps", 0) => {
            a.iter_mut().zip(&carried).for_each(|(a, b)| (0..5).for_each(|k| a[k] += b[k]));
            ("wind in A", Operator::Identity(nx * ny))
        }
        ("wind" | "jumps", 1) => ("wind in B", plane.operator(carried)),
        _ => ("no wind", Operator::Identity(nx * ny)),
    };
    let about = format!(
        "{nx} x {ny} points, {kind} of {strength:.1e} to {turn:.2}, jump {jump:.1e}, {blocks} blocks, \
         gradings {:.1e}, {:.1e}, {islands} islands, load {load:.2}",
        growth[0].exp(),
        growth[1].exp()
    );
    ((plane.operator(a), b, q), about)
}

/// A contact in space, seven-point: an LCP, or with transport in `B`; with and without jumps.
fn space(random: &mut Random) -> (Problem, String) {
    let [nx, ny, nz] = [(); 3].map(|()| random.log(5.0, 26.0) as usize);
    let (seed, load) = (random.next() >> 1, random.real(-0.8, 0.8));
    let jump = if random.chance(0.5) { 1.0 } else { random.log(10.0, 1e6) };
    let wind =
        if random.chance(0.5) { None } else { Some([(); 3].map(|()| random.real(0.0, 1.0))) };
    let n = nx * ny * nz;
    let place = |k: usize| [k % nx, k / nx % ny, k / nx / ny];
    let conductivity = |k: usize| {
        let [x, y, z] = place(k).map(|i| (i / 4) as i64);
        if noise(seed + z as u64, x, y) > 0.0 { jump } else { 1.0 }
    };
    let ways = [(0, 1, nx), (1, nx, ny), (2, nx * ny, nz)];
    let bonds = (0..n).flat_map(|k| {
        ways.into_iter().flat_map(move |(axis, stride, length)| {
            let i = place(k)[axis];
            let own = conductivity(k);
            let ends = [(i > 0, k.wrapping_sub(stride)), (i + 1 < length, k + stride)];
            ends.into_iter().flat_map(move |(is_inside, other)| {
                // Beyond the edge, half a cell away, is the foundation.
                let c = if is_inside { 2.0 / (1.0 / own + 1.0 / conductivity(other)) } else { own };
                [(k, k, c)].into_iter().chain(is_inside.then_some((k, other, -c)))
            })
        })
    });
    let a = Operator::Rows(rows(n, bonds));
    let b = wind.map_or(Operator::Identity(n), |wind| {
        let flows = (0..n).flat_map(|k| {
            ways.into_iter().flat_map(move |(axis, stride, _)| {
                let inflow = (place(k)[axis] > 0).then(|| (k, k - stride, -wind[axis]));
                [(k, k, wind[axis])].into_iter().chain(inflow)
            })
        });
        Operator::Rows(rows(n, flows))
    });
    let q = (0..n).map(|k| {
        let [x, y, z] = place(k).map(|i| i as f64 / 25.0);
        ((9.0 * x).sin() * (7.0 * y).cos() + (5.0 * z + 1.0).sin() - load) / 60.0
    });
    let kind = if wind.is_some() { "HLCP" } else { "LCP" };
    let about = format!("{nx} x {ny} x {nz} points, {kind}, jump {jump:.1e}, load {load:.2}");
    ((a, b, q.collect()), about)
}

/// A pair of matrices with a few entries a column, anywhere or near by, whose diagonal exceeds the
/// sum of the others by a slack; a solution is planted.
fn sparse(random: &mut Random) -> (Problem, String) {
    let n = random.log(8.0, 8000.0) as usize;
    let (slack, per, kind) = (random.log(1e-4, 1.0), random.whole(1, 5), random.whole(0, 3));
    let mut matrix = |per: usize| {
        let (mut entries, mut sums) = (vec![], vec![0.0; n]);
        for (j, sum) in sums.iter_mut().enumerate() {
            for _ in 0..per {
                let i =
                    if kind == 2 { (j + random.whole(1, 30)) % n } else { random.whole(0, n - 1) };
                let size = random.real(0.05, 1.05);
                let sign = if kind == 1 && random.chance(0.3) { 1.0 } else { -1.0 };
                if i != j {
                    entries.push((i, j, sign * size));
                    *sum += size;
                }
            }
        }
        let diagonal = |(j, &sum): (usize, &f64)| (j, j, sum * (1.0 + slack) + 1e-3);
        let diagonal: Vec<_> = sums.iter().enumerate().map(diagonal).collect();
        rows(n, entries.into_iter().chain(diagonal))
    };
    let (a, b) = (matrix(per), matrix(if kind == 3 { 1 } else { per }));
    let kinds = ["anywhere", "of both signs", "near by", "B lean"];
    let about = format!("n {n}, {per} a column, {}, slack {slack:.1e}", kinds[kind]);
    let q = planted(random, &a, &b);
    ((Operator::Rows(a), Operator::Rows(b), q), about)
}

/// `q` of a random solution.
fn planted(random: &mut Random, a: &CsrMatrix<f64>, b: &CsrMatrix<f64>) -> Vec<f64> {
    let x: Vec<f64> = (0..a.nrows()).map(|_| random.real(-0.5, 0.5)).collect();
    let (mut az, mut q) = (x.clone(), x.clone());
    a.apply(&x.iter().map(|x| x.max(0.0)).collect::<Vec<_>>(), &mut az);
    b.apply(&x.iter().map(|x| (-x).max(0.0)).collect::<Vec<_>>(), &mut q);
    q.iter_mut().zip(&az).for_each(|(q, az)| *q -= az);
    q
}

/// A small LCP with a full P-matrix: positive definite and not symmetric, with and without the
/// identity added to it, or triangular with twos below ones (Murty's, on which pivoting may take 2ⁿ
/// steps).
fn dense(random: &mut Random) -> (Problem, String) {
    let n = random.log(2.0, 120.0) as usize;
    let (kind, skew) = (random.whole(0, 2), random.log(1e-2, 10.0));
    let numbers = if kind == 1 { 0 } else { n * n };
    let g: Vec<f64> = (0..numbers).map(|_| random.real(-1.0, 1.0)).collect();
    let definite = |i: usize, j: usize| {
        let product = (0..n).map(|l| g[i * n + l] * g[j * n + l]).sum::<f64>() / n as f64;
        product + (skew * (g[i * n + j] - g[j * n + i]) + if i == j { 0.05 } else { 0.0 })
    };
    let entry = |i: usize, j: usize| match kind {
        1 if i > j => 2.0,
        1 => f64::from(i == j),
        2 if i == j => definite(i, j) + 1.0,
        _ => definite(i, j),
    };
    let entries = (0..n * n).map(|k| (k / n, k % n, entry(k / n, k % n)));
    let a = rows(n, entries.filter(|entry| entry.2 != 0.0));
    let q = (0..n).map(|_| random.real(-1.0, 0.5)).collect();
    let kinds = ["positive definite", "triangular", "well-conditioned"];
    let about = format!("n {n}, {}, skew {skew:.2}", kinds[kind]);
    ((Operator::Rows(a), Operator::Identity(n), q), about)
}
