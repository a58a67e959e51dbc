//! How far an answer is from the solution, proved.

use std::fmt;

use hlcp_core::{Error, Rows, Scalar, all_finite};

use crate::{
    classes::{Answer, radius_below_one},
    comparison::{Against, Coupled, Transposed, Weights, visit, wide},
    perron::{Comparison, solve},
    rounding::{Sum, div_up, mul_up},
};

/// What proves that HLCP(A, B, q) has exactly one solution for every `q`.
#[derive(Debug, Clone, PartialEq)]
pub enum Witness {
    /// Positive Ω and `d` with `C d > 0`, where `C` has the diagonal `min(aᵢᵢ, ωᵢbᵢᵢ)` and the off-diagonal
    /// entries `−max(|aᵢⱼ|, ωⱼ|bᵢⱼ|)`.
    Right {
        /// The diagonal of Ω.
        omega: Vec<f64>,
        /// The vector `d`.
        d: Vec<f64>,
    },
    /// A positive `v` with `⟨A⟩ᵀv > 0` and `⟨B⟩ᵀv > 0`, the diagonals of `A` and `B` being positive.
    Left {
        /// The vector `v`.
        v: Vec<f64>,
    },
}

/// A proof that the solution `(z*, r*)` exists and is unique, and a bound on every component of the error.
///
/// All of it is a statement about real numbers; rounding is accounted for. The bounds may be infinite, if
/// something overflows.
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
        self.z.iter().chain(&self.r).copied().fold(0.0, f64::max)
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

/// Bounds the distance of `(z, r)`, which may come from anywhere, from the solution of HLCP(A, B, q).
///
/// `None` where no witness exists or none was found: nothing is claimed then. `docs/theory.md` has the proofs.
///
/// # Cost
///
/// A few walks over the rows where `A` and `B` are dominant enough for a witness of ones. Otherwise the
/// search stores a comparison matrix and runs a multigrid on it.
///
/// # Errors
///
/// [`Error::Order`] when something does not fit `a`, [`Error::NotFinite`] for an entry of `q`, `z` or `r`.
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::certify;
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let b = FivePoint::new(2, 1, [0.0, 0.0, 2.0, 0.0, 0.0])?;
/// // z* = (1, 0), r* = (0, 1).
/// let certificate = certify(&a, &b, &[-4.0, 3.0], &[1.001, 0.0], &[0.0, 1.0])?.expect("a witness");
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
    let n = a.order();
    for (what, found) in [("B", b.order()), ("q", q.len()), ("z", z.len()), ("r", r.len())] {
        if found != n {
            return Err(Error::Order { what, found, expected: n });
        }
    }
    all_finite("q", q)?;
    all_finite("z", z)?;
    all_finite("r", r)?;
    let omega: Vec<f64> =
        (0..n).map(|i| wide(a.diagonal_entry(i)) / wide(b.diagonal_entry(i))).collect();
    let positive =
        |i: usize| wide(a.diagonal_entry(i)) > 0.0 && omega[i] > 0.0 && omega[i].is_finite();
    if !(0..n).all(positive) {
        return Ok(None);
    }
    let (pair, moved) = complementary(z, r, &omega);
    let defect = defect(a, b, q, &pair);
    let weights = Weights::Chosen(&omega);
    let coupled = Coupled::<T, _, _> { a, b, omega: weights, against: Against::Pair };
    let (witness, mut bounds) = if let Some((d, w)) = from_the_right(&coupled, &defect) {
        let of_r = w.iter().zip(&omega).map(|(&w, &omega)| mul_up(w, omega)).collect();
        (Witness::Right { omega, d }, [w, of_r])
    } else if let Some((v, bounds)) = from_the_left(a, b, &defect) {
        (Witness::Left { v }, bounds)
    } else {
        return Ok(None);
    };
    for (bounds, moved) in bounds.iter_mut().zip(&moved) {
        for (bound, &moved) in bounds.iter_mut().zip(moved) {
            if moved > 0.0 {
                *bound = (*bound + moved).next_up();
            }
        }
    }
    let [z, r] = bounds;
    Ok(Some(Certificate { witness, z, r }))
}

/// A non-negative complementary pair near `(z, r)`, and how far each component was moved, both exactly.
fn complementary<T: Scalar>(z: &[T], r: &[T], omega: &[f64]) -> ([Vec<f64>; 2], [Vec<f64>; 2]) {
    let (mut pair, mut moved) = ([vec![], vec![]], [vec![], vec![]]);
    for ((&z, &r), omega) in z.iter().zip(r).zip(omega) {
        let (z, r) = (wide(z), wide(r));
        let keep_z = z * omega >= r;
        let kept = [if keep_z { z.max(0.0) } else { 0.0 }, if keep_z { 0.0 } else { r.max(0.0) }];
        for (k, value) in [z, r].into_iter().enumerate() {
            pair[k].push(kept[k]);
            moved[k].push(if kept[k] == value { 0.0 } else { value.abs() });
        }
    }
    (pair, moved)
}

/// Not less than `|A z − B r + q|`, entry by entry.
fn defect<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    [z, r]: &[Vec<f64>; 2],
) -> Vec<f64> {
    let row = |(i, &q): (usize, &T)| {
        let mut sum = Sum::default();
        sum.add(wide(q), 1.0);
        visit(a, i, |j, a| sum.add(a, z[j]));
        visit(b, i, |j, b| sum.add(-b, r[j]));
        sum.interval().magnitude()
    };
    q.iter().enumerate().map(row).collect()
}

/// A vector `d > 0` with `C d > 0` and a `w` with `|δ| ≤ w` whenever `C|δ| ≤ defect`.
fn from_the_right<T: Scalar, A: Rows<T>, B: Rows<T>>(
    c: &Coupled<'_, T, A, B>,
    defect: &[f64],
) -> Option<(Vec<f64>, Vec<f64>)> {
    let ones = vec![1.0; defect.len()];
    let (d, gaps, searched) = match gaps(c, &ones) {
        Some(gaps) => (ones, gaps, false),
        None => {
            // An approximate C⁻¹e is the better witness where the vector of ones nearly is one; a Perron
            // vector exists wherever a witness does, but it may span many orders of magnitude.
            let inverse = solve(c, &ones, &ones);
            let positive = inverse.iter().all(|&d| d > 0.0 && d.is_finite());
            match gaps(c, &inverse).filter(|_| positive) {
                Some(gaps) => (inverse, gaps, true),
                None => {
                    let Answer::Yes(d) = radius_below_one(c) else { return None };
                    let gaps = gaps(c, &d)?;
                    (d, gaps, true)
                }
            }
        }
    };
    let ratio = |(&defect, &gap): (&f64, &f64)| div_up(defect, gap);
    let t = defect.iter().zip(&gaps).map(ratio).fold(0.0, larger);
    let mut w: Vec<f64> = d.iter().map(|&d| mul_up(d, t)).collect();
    let poor = |(i, &gap): (usize, &f64)| gap < 0.1 * wide(c.a.diagonal_entry(i)) * d[i];
    if searched || gaps.iter().enumerate().any(poor) {
        let finer = componentwise(c, &d, &gaps, defect);
        w.iter_mut().zip(finer).for_each(|(w, finer)| *w = w.min(finer));
    }
    (0..2).for_each(|_| sharpen(c, defect, &mut w));
    Some((d, w))
}

/// The larger, and NaN if either is.
fn larger(x: f64, y: f64) -> f64 {
    if x.is_nan() || x > y { x } else { y }
}

/// Row `i` of `C x`, from below.
fn product<T: Scalar, A: Rows<T>, B: Rows<T>>(
    c: &Coupled<'_, T, A, B>,
    i: usize,
    x: &[f64],
    g: &mut Vec<(usize, f64)>,
) -> f64 {
    let mut sum = Sum::default();
    sum.add(c.coupled_row(i, g), x[i]);
    g.iter().for_each(|&(j, g)| sum.add(-g, x[j]));
    sum.interval().lower
}

/// `C d` from below, if it is positive.
fn gaps<T: Scalar, A: Rows<T>, B: Rows<T>>(
    c: &Coupled<'_, T, A, B>,
    d: &[f64],
) -> Option<Vec<f64>> {
    let mut g = vec![];
    (0..d.len()).map(|i| Some(product(c, i, d, &mut g)).filter(|&gap| gap > 0.0)).collect()
}

/// A `w ≥ 0` with `C w ≥ defect`: an approximate solution, and as much of `d` as it lacks.
fn componentwise<T: Scalar, A: Rows<T>, B: Rows<T>>(
    c: &Coupled<'_, T, A, B>,
    d: &[f64],
    gaps: &[f64],
    defect: &[f64],
) -> Vec<f64> {
    let mut w = solve(c, d, defect);
    w.iter_mut().for_each(|w| *w = w.max(0.0));
    let (mut g, mut lack) = (vec![], 0.0);
    for i in 0..d.len() {
        let missing = (defect[i] - product(c, i, &w, &mut g)).next_up();
        if missing > 0.0 || missing.is_nan() {
            lack = larger(lack, div_up(missing, gaps[i]));
        }
    }
    w.iter().zip(d).map(|(&w, &d)| (w + mul_up(d, lack)).next_up()).collect()
}

/// Replaces each bound by what the row of `C|δ| ≤ defect` says, the other bounds given, if that is less.
fn sharpen<T: Scalar, A: Rows<T>, B: Rows<T>>(
    c: &Coupled<'_, T, A, B>,
    defect: &[f64],
    w: &mut [f64],
) {
    let mut g = vec![];
    for i in 0..w.len() {
        let pivot = c.coupled_row(i, &mut g);
        let mut sum = Sum::default();
        sum.add(defect[i], 1.0);
        g.iter().for_each(|&(j, g)| sum.add(g, w[j]));
        let bound = div_up(sum.interval().upper, pivot);
        if pivot > 0.0 && bound < w[i] {
            w[i] = bound;
        }
    }
}

/// A vector `v > 0` with `⟨A⟩ᵀv > 0` and `⟨B⟩ᵀv > 0`, and the bounds `vᵀ·defect` over each of the two.
fn from_the_left<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    defect: &[f64],
) -> Option<(Vec<f64>, [Vec<f64>; 2])> {
    let transposed = Transposed::of(a, b)?;
    let Answer::Yes(v) = radius_below_one(&transposed) else { return None };
    let mut total = Sum::default();
    v.iter().zip(defect).for_each(|(&v, &defect)| total.add(v, defect));
    let (total, mut g) = (total.interval().upper, vec![]);
    let mut bound = |k: usize, j: usize| {
        let mut sum = Sum::default();
        sum.add(transposed.row(k, j, &mut g), v[j]);
        g.iter().for_each(|&(i, g)| sum.add(-g, v[i]));
        let gap = sum.interval().lower;
        (gap > 0.0).then(|| div_up(total, gap))
    };
    let mut bounds = |k| (0..defect.len()).map(|j| bound(k, j)).collect::<Option<Vec<f64>>>();
    let bounds = [bounds(0)?, bounds(1)?];
    Some((v, bounds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Example;

    /// At μ = ν = 0 the componentwise bound is well ahead of the max-norm one, whatever the error looks like.
    #[test]
    fn the_componentwise_bound_is_ahead() {
        let scene = Example { symmetric: true, m: 40, mu: 0.0, nu: 0.0 }.pose::<f64>().unwrap();
        let omega = vec![1.0; 1600];
        let c = Coupled::<f64, _, _> {
            a: &scene.a,
            b: &scene.b,
            omega: Weights::Chosen(&omega),
            against: Against::Pair,
        };
        let Answer::Yes(d) = radius_below_one(&c) else { panic!("an M-matrix") };
        let gaps = gaps(&c, &d).unwrap();
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
            let f = defect(&scene.a, &scene.b, &scene.q, &[z, scene.r.clone()]);
            let t = f.iter().zip(&gaps).map(|(&f, &gap)| div_up(f, gap)).fold(0.0, f64::max);
            let by_norm = largest(&d) * t;
            let by_components = largest(&componentwise(&c, &d, &gaps, &f));
            let true_error = (0..1600).map(|k| error(k).abs()).fold(0.0, f64::max);
            println!("{:.1} {:.1}", by_components / true_error, by_norm / true_error);
            assert!(true_error <= by_components && by_components * least < by_norm);
        }
    }
}
