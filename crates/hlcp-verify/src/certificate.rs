//! How far an answer is from the solution, proved.

use std::fmt;

use hlcp_core::{Error, Rows, Scalar, all_finite};

use crate::{
    classes::{Answer, radius_below_one},
    comparison::Transposed,
    pair::Pair,
    perron::{Comparison, solve},
    rounding::{Sum, div_up, down, larger, mul_up, up},
};

/// What proves that HLCP(A, B, q) has exactly one solution for every `q`.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::{Witness, certify, certify_with};
///
/// let (a, b) = (FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?, Identity { order: 2 });
/// let first = certify(&a, &b, &[-4.0, 3.0], &[1.0, 0.0], &[0.0, 2.0])?.expect("a dominant pair");
/// // C is A: 4 − 1 > 0
/// assert_eq!(first.witness, Witness::Right { omega: vec![4.0; 2], d: vec![1.0; 2] });
/// // It serves any other q without a search; for this one z* = (2, 1) and r* = 0.
/// let second = certify_with(&a, &b, &[-7.0, -2.0], &[2.0, 1.0], &[0.0; 2], first.witness)?;
/// assert!(second.expect("the same witness").error() < 1e-13);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Witness {
    /// Positive Ω and `d` with `C d > 0`, where `C` has the diagonal `min(aᵢᵢ, ωᵢbᵢᵢ)` and the
    /// off-diagonal entries `−max(|aᵢⱼ|, ωⱼ|bᵢⱼ|)`.
    Right {
        /// The diagonal of Ω.
        omega: Vec<f64>,
        /// The vector `d`.
        d: Vec<f64>,
    },
    /// A positive `v` with `⟨A⟩ᵀv > 0` and `⟨B⟩ᵀv > 0`, the diagonals of `A` and `B` being
    /// positive.
    Left {
        /// The vector `v`.
        v: Vec<f64>,
    },
}

/// A proof that the solution `(z*, r*)` exists and is unique, and a bound on every component of the
/// error.
///
/// All of it is a statement about real numbers; rounding is accounted for. The bounds may be
/// infinite, if something overflows.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::certify;
///
/// let (a, b) = (FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?, Identity { order: 2 });
/// // z* = (1, 0), r* = (0, 2); with an error of 0.001 in z₁ the defect is (0.004, −0.001), and C =
/// // A.
/// let certificate =
///     certify(&a, &b, &[-4.0, 3.0], &[1.001, 0.0], &[0.0, 2.0])?.expect("a witness");
/// assert!((0.001..0.0014).contains(&certificate.z[0])); // 0.004/(4 − 1) at most
/// // ω = 4 times as much for r
/// assert_eq!(certificate.error(), certificate.r[0].max(certificate.r[1]));
/// assert!(certificate.to_string().starts_with("solution unique: proved; certified error ≤ "));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// What proves existence and uniqueness.
    pub witness: Witness,
    /// Not less than `|zⱼ − z*ⱼ|`.
    pub z: Vec<f64>,
    /// Not less than `|rⱼ − r*ⱼ|`.
    pub r: Vec<f64>,
}

impl Certificate {
    /// Not less than the largest error of a component of `z` or `r`.
    pub fn error(&self) -> f64 {
        self.z.iter().chain(&self.r).copied().fold(0.0, larger)
    }
}

impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.witness {
            Witness::Right { .. } => "componentwise",
            Witness::Left { .. } => "sum",
        };
        write!(f, "solution unique: proved; certified error ≤ {:.2e} ({kind} bound)", self.error())
    }
}

/// Bounds the distance of `(z, r)`, which may come from anywhere, from the solution of HLCP(A, B,
/// q).
///
/// `None` where no witness exists or none was found: nothing is claimed then. `docs/theory.md` has
/// the proofs.
///
/// # Cost
///
/// A few walks over the rows where `A` and `B` are dominant enough for a witness of ones. Otherwise
/// the search stores a comparison matrix and runs a multigrid on it.
///
/// # Errors
///
/// What [`LinearOperator::check`](hlcp_core::LinearOperator::check) of `a` or `b` refuses;
/// [`Error::Order`] when something does not fit `a`, [`Error::NotFinite`] for an entry of `q`, `z`
/// or `r`.
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::certify;
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let b = FivePoint::new(2, 1, [0.0, 0.0, 2.0, 0.0, 0.0])?;
/// // z* = (1, 0), r* = (0, 1).
/// let certificate =
///     certify(&a, &b, &[-4.0, 3.0], &[1.001, 0.0], &[0.0, 1.0])?.expect("a witness");
/// assert!(certificate.z[0] >= 0.001 && certificate.error() < 0.005);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn certify<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    z: &[T],
    r: &[T],
) -> Result<Option<Certificate>, Error> {
    check(a, b, q, [z, r])?;
    let omega: Vec<f64> =
        (0..a.order()).map(|i| a.diagonal_entry(i).wide() / b.diagonal_entry(i).wide()).collect();
    if !positive_diagonals(a, b) || !positive(&omega) {
        return Ok(None);
    }
    let near = complementary(z, r, &omega);
    let pair = Pair::new(a, b, &omega);
    let defect = pair.defect(q, [&near[0], &near[1]]);
    let (witness, bounds) = if let Some((d, w)) = from_the_right(&pair, &defect) {
        let bounds = of_both(w, &omega);
        (Witness::Right { omega, d }, bounds)
    } else if let Some((v, bounds)) = from_the_left(a, b, &defect) {
        (Witness::Left { v }, bounds)
    } else {
        return Ok(None);
    };
    Ok(Some(certificate(witness, bounds, near, [z, r])))
}

/// The bounds that a given witness yields: one that an earlier certificate for the same `A` and `B`
/// came with, or one that is known in closed form. It is checked, not trusted.
///
/// `None` where it is no witness: nothing is claimed then.
///
/// # Cost
///
/// That of [`certify`] without the search.
///
/// # Errors
///
/// As [`certify`], and [`Error::Order`] when the witness does not fit `a`.
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::{Witness, certify_with};
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let b = FivePoint::new(2, 1, [0.0, 0.0, 2.0, 0.0, 0.0])?;
/// let (q, z, r) = ([-4.0, 3.0], [1.001, 0.0], [0.0, 1.0]);
/// // the column sums of ⟨A⟩ and ⟨B⟩ are positive
/// let witness = Witness::Left { v: vec![1.0, 1.0] };
/// let certificate = certify_with(&a, &b, &q, &z, &r, witness)?.expect("a witness");
/// assert!(certificate.z[0] >= 0.001 && certificate.error() < 0.005);
///
/// let none = Witness::Left { v: vec![1.0, 5.0] };
/// assert_eq!(certify_with(&a, &b, &q, &z, &r, none)?, None);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn certify_with<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    z: &[T],
    r: &[T],
    witness: Witness,
) -> Result<Option<Certificate>, Error> {
    check(a, b, q, [z, r])?;
    let n = a.order();
    let fits = |what, found| {
        if found == n { Ok(()) } else { Err(Error::Order { what, found, expected: n }) }
    };
    match &witness {
        Witness::Right { omega, d } => fits("omega", omega.len()).and(fits("d", d.len()))?,
        Witness::Left { v } => fits("v", v.len())?,
    }
    if !positive_diagonals(a, b) {
        return Ok(None);
    }
    let ones = vec![1.0; n];
    let omega = if let Witness::Right { omega, .. } = &witness { omega } else { &ones };
    if !positive(omega) {
        return Ok(None);
    }
    let near = complementary(z, r, omega);
    let pair = Pair::new(a, b, omega);
    let defect = pair.defect(q, [&near[0], &near[1]]);
    let bounds = match &witness {
        Witness::Right { omega, d } => {
            by_norm(&pair, d, &defect).map(|scale| of_both(finest(&pair, &defect, d, scale), omega))
        }
        Witness::Left { v } => Transposed::of(a, b).and_then(|columns| sums(&columns, v, &defect)),
    };
    Ok(bounds.map(|bounds| certificate(witness, bounds, near, [z, r])))
}

fn check<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    [z, r]: [&[T]; 2],
) -> Result<(), Error> {
    a.check("A")?;
    b.check("B")?;
    let expected = a.order();
    for (what, found) in [("B", b.order()), ("q", q.len()), ("z", z.len()), ("r", r.len())] {
        if found != expected {
            return Err(Error::Order { what, found, expected });
        }
    }
    all_finite("q", q)?;
    all_finite("z", z)?;
    all_finite("r", r)
}

fn positive(v: &[f64]) -> bool {
    v.iter().all(|&v| v > 0.0 && v.is_finite())
}

fn positive_diagonals<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>) -> bool {
    let sound = |entry: T| entry > T::zero() && entry.is_finite();
    (0..a.order()).all(|i| sound(a.diagonal_entry(i)) && sound(b.diagonal_entry(i)))
}

/// The bounds on `z` and `r` that one on `|δ|` is.
fn of_both(w: Vec<f64>, omega: &[f64]) -> [Vec<f64>; 2] {
    let of_r = w.iter().zip(omega).map(|(w, omega)| up(w * omega, 1.0)).collect();
    [w, of_r]
}

/// The bounds for the pair that was given, from those for the one near it.
fn certificate<T: Scalar>(
    witness: Witness,
    [mut of_z, mut of_r]: [Vec<f64>; 2],
    [near_z, near_r]: [Vec<f64>; 2],
    [z, r]: [&[T]; 2],
) -> Certificate {
    for (bounds, near, given) in [(&mut of_z, near_z, z), (&mut of_r, near_r, r)] {
        for ((bound, near), &given) in bounds.iter_mut().zip(near).zip(given) {
            // What was moved was set to 0: moved exactly by its modulus.
            if near != given.wide() {
                *bound = (*bound + given.wide().abs()).next_up();
            }
        }
    }
    Certificate { witness, z: of_z, r: of_r }
}

/// A non-negative complementary pair near `(z, r)`: some components are set to 0, the others kept.
fn complementary<T: Scalar>(z: &[T], r: &[T], omega: &[f64]) -> [Vec<f64>; 2] {
    let all = || z.iter().zip(r).zip(omega).map(|((&z, &r), omega)| [z.wide(), r.wide(), *omega]);
    let keep = |keep: bool, value: f64| if keep && value > 0.0 { value } else { 0.0 };
    let near_z = all().map(|[z, r, omega]| keep(z * omega >= r, z)).collect();
    [near_z, all().map(|[z, r, omega]| keep(z * omega < r, r)).collect()]
}

/// A vector `d > 0` with `C d > 0` and a `w` with `|δ| ≤ w` whenever `C|δ| ≤ defect`.
fn from_the_right<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    defect: &[f64],
) -> Option<(Vec<f64>, Vec<f64>)> {
    let ones = vec![1.0; defect.len()];
    let (d, scale) = match by_norm(pair, &ones, defect) {
        Some(scale) => (ones, scale),
        None => {
            // An approximate C⁻¹e is the better witness where the vector of ones nearly is one; a
            // Perron vector exists wherever a witness does, but it may span many orders of
            // magnitude.
            let inverse = solve(&pair.coupled, &ones, &ones);
            match by_norm(pair, &inverse, defect) {
                Some(scale) => (inverse, scale),
                None => {
                    let Answer::Yes(d) = radius_below_one(&pair.coupled) else { return None };
                    let scale = by_norm(pair, &d, defect)?;
                    (d, scale)
                }
            }
        }
    };
    let w = finest(pair, defect, &d, scale);
    Some((d, w))
}

/// The least bounds on `|δ|` that are found with a witness `d`.
fn finest<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    defect: &[f64],
    d: &[f64],
    Scale { t, poor }: Scale,
) -> Vec<f64> {
    let mut w: Vec<f64> = d.iter().map(|d| up(d * t, 1.0)).collect();
    if poor {
        let finer = componentwise(pair, d, defect);
        w.iter_mut().zip(finer).for_each(|(w, finer)| *w = w.min(finer));
    }
    (0..2).for_each(|_| sharpen(pair, defect, &mut w));
    w
}

/// Calls `row(i, p, y)` for every row `i` of `C`, with its diagonal entry `p` from below and its
/// off-diagonal part of `−C x` from above, stretch by stretch.
fn rows<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    x: &[f64],
    mut row: impl FnMut(usize, f64, f64),
) {
    let (mut pivots, mut y, mut g) = (vec![0.0; pair.stretch()], vec![0.0; pair.stretch()], vec![]);
    for from in (0..x.len()).step_by(pair.stretch()) {
        pair.couplings(from, x, [&mut pivots, &mut y], &mut g);
        for (k, (&pivot, &y)) in pivots.iter().zip(&y).enumerate() {
            row(from + k, pivot, y);
        }
    }
}

/// What the max-norm bound comes to.
struct Scale {
    /// Not less than the largest `defectᵢ/(C d)ᵢ`.
    t: f64,
    /// Whether some `(C d)ᵢ` is small beside `cᵢᵢdᵢ`, so that another bound may be much better.
    poor: bool,
}

/// Row `i` of `C x` from below, from its diagonal entry and the rest from above.
fn row_of_product(pivot: f64, x: f64, y: f64) -> f64 {
    down(down(pivot * x, 1.0) - y, 1.0)
}

/// `|δ| ≤ t d`, if `d > 0` and `C d > 0`.
fn by_norm<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    d: &[f64],
    defect: &[f64],
) -> Option<Scale> {
    let (mut t, mut poor, mut witness) = (0.0, false, positive(d));
    rows(pair, d, |i, pivot, y| {
        let gap = row_of_product(pivot, d[i], y);
        witness &= gap > 0.0;
        poor |= gap < 0.1 * pivot * d[i];
        t = larger(t, defect[i] / gap);
    });
    witness.then_some(Scale { t: up(t, 1.0), poor })
}

/// A `w ≥ 0` with `C w ≥ defect`: an approximate solution, and as much of `d` as it lacks.
fn componentwise<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    d: &[f64],
    defect: &[f64],
) -> Vec<f64> {
    let mut w = solve(&pair.coupled, d, defect);
    w.iter_mut().for_each(|w| *w = w.max(0.0));
    let mut missing = Vec::with_capacity(w.len());
    rows(pair, &w, |i, pivot, y| {
        missing.push((up(defect[i] + y, 1.0) - down(pivot * w[i], 1.0)).next_up());
    });
    let mut lack = 0.0;
    rows(pair, d, |i, pivot, y| {
        if missing[i] > 0.0 || missing[i].is_nan() {
            lack = larger(lack, div_up(missing[i], row_of_product(pivot, d[i], y)));
        }
    });
    w.iter().zip(d).map(|(&w, &d)| (w + mul_up(d, lack)).next_up()).collect()
}

/// Replaces each bound by what the row of `C|δ| ≤ defect` says, the other bounds given, if that is
/// less.
fn sharpen<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    defect: &[f64],
    w: &mut [f64],
) {
    let (mut pivots, mut y, mut g) = (vec![0.0; pair.stretch()], vec![0.0; pair.stretch()], vec![]);
    for from in (0..w.len()).step_by(pair.stretch()) {
        pair.couplings(from, w, [&mut pivots, &mut y], &mut g);
        for ((w, defect), (pivot, y)) in
            w[from..].iter_mut().zip(&defect[from..]).zip(pivots.iter().zip(&y))
        {
            // `C d > 0` makes the pivot positive; a quotient that is NaN changes nothing.
            *w = w.min(up((defect + y) / pivot, 2.0));
        }
    }
}

/// A vector `v > 0` with `⟨A⟩ᵀv > 0` and `⟨B⟩ᵀv > 0`, and its bounds.
fn from_the_left<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    defect: &[f64],
) -> Option<(Vec<f64>, [Vec<f64>; 2])> {
    let columns = Transposed::of(a, b)?;
    let Answer::Yes(v) = radius_below_one(&columns) else { return None };
    let bounds = sums(&columns, &v, defect)?;
    Some((v, bounds))
}

/// `vᵀ·defect` over `⟨A⟩ᵀv` and over `⟨B⟩ᵀv`, if both of these and `v` are positive.
fn sums(columns: &Transposed, v: &[f64], defect: &[f64]) -> Option<[Vec<f64>; 2]> {
    if !positive(v) {
        return None;
    }
    let mut total = Sum::default();
    v.iter().zip(defect).for_each(|(&v, &defect)| total.add(v, defect));
    let (total, mut g) = (total.interval().upper, vec![]);
    let mut bound = |k: usize, j: usize| {
        let mut sum = Sum::default();
        sum.add(columns.row(k, j, &mut g), v[j]);
        g.iter().for_each(|&(i, g)| sum.add(-g, v[i]));
        let gap = sum.interval().lower;
        (gap > 0.0).then(|| div_up(total, gap))
    };
    let mut bounds = |k| (0..defect.len()).map(|j| bound(k, j)).collect::<Option<Vec<f64>>>();
    Some([bounds(0)?, bounds(1)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Example;

    /// At μ = ν = 0 the componentwise bound is well ahead of the max-norm one, whatever the error
    /// looks like.
    #[test]
    fn the_componentwise_bound_is_ahead() {
        let scene = Example { symmetric: true, m: 40, mu: 0.0, nu: 0.0 }.pose::<f64>().unwrap();
        let omega = vec![1.0; 1600];
        let pair = Pair::new(&scene.a, &scene.b, &omega);
        let Answer::Yes(d) = radius_below_one(&pair.coupled) else { panic!("an M-matrix") };
        let largest = |w: &[f64]| w.iter().copied().fold(0.0, larger);
        let shapes: [fn(usize) -> f64; 3] = [
            |k| if k == 815 { 1.0 } else { 0.0 },
            |k| (k as f64 * 12.9898).sin() * (k as f64 * 78.233).cos(),
            |k| (k as f64 / 1600.0 * 3.1).sin(),
        ];
        for (shape, least) in shapes.into_iter().zip([20.0, 2.0, 1.0]) {
            // An error of z where z* > 0 alone, so that the pair stays complementary.
            let error = |k: usize| if scene.z[k] > 0.0 { 0.5 * shape(k) } else { 0.0 };
            let z: Vec<f64> = (0..1600).map(|k| scene.z[k] + error(k)).collect();
            let f = pair.defect(&scene.q, [&z, &scene.r]);
            let by_norm = largest(&d) * by_norm(&pair, &d, &f).unwrap().t;
            let w = componentwise(&pair, &d, &f);
            // C w ≥ f, up to the rounding of this check.
            rows(&pair, &w, |i, pivot, y| {
                assert!(pivot * w[i] - y >= f[i] - 1e-13 * (pivot * w[i]));
            });
            let by_components = largest(&w);
            let true_error = (0..1600).map(|k| error(k).abs()).fold(0.0, f64::max);
            println!("{:.1} {:.1}", by_components / true_error, by_norm / true_error);
            assert!(true_error <= by_components && by_components * least < by_norm);
        }
    }
}
