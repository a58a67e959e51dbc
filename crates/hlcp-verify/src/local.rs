//! The certificate near an answer: where a sign is settled, only one of two columns can occur.
//!
//! `docs/theory.md` §4 has the proof. In short: let `vⱼ` be `zⱼ` on one side and `−rⱼ` on the
//! other, J have the column of `A` or `B` that belongs to the side, and M be the comparison matrix
//! of J, weakened in columns that are *open*. If `M w ≥ |F(v)|` for a `w > 0` with `M w > 0`, and
//! `|vⱼ| > wⱼ` in all columns that are not open, exactly one solution lies within `w` of `v`.
//!
//! The centre `v` need not be the answer that was given: Newton steps from there, kept in a second
//! number beside the first, make `F(v)` so small that the bound on the error is hardly more than
//! the length of those steps.

use hlcp_core::{Diagonal, Hlcp, LinearOperator, Omega, Rows, Scalar};
use hlcp_methods::Clock;

use crate::{
    certificate::Refusal,
    comparison::{merge, visit},
    rounding::{Doubled, Sum, div_down, div_up, larger, mul_down, mul_up, smaller},
    sparse::{Inverse, Sparse},
};

/// Newton steps in all, and those that may change sides.
const STEPS: usize = 12;
const FREE: usize = 8;

/// What a linear solve leaves of its residual.
const PART: f64 = 1e-3;

/// The radius that is small enough, over the way from the answer to the centre.
const TIGHT: f64 = 0.25;

/// A centre and what is proved of its neighbourhood.
#[derive(Debug)]
pub(crate) struct Local {
    pub(crate) centre: Centre,
    /// The solution lies within this, in the unit of the unknown that `v` is.
    pub(crate) radius: Vec<f64>,
    /// Whether both sides may occur.
    pub(crate) open: Vec<bool>,
}

/// `vⱼ = near + more` is `zⱼ ≥ 0`, or `−rⱼ ≤ 0` where `on_r`.
#[derive(Debug)]
pub(crate) struct Centre {
    pub(crate) near: Vec<f64>,
    pub(crate) more: Vec<f64>,
    pub(crate) on_r: Vec<bool>,
}

/// Finds a centre near the complementary pair `[z, r]`, and proves a solution near it.
///
/// The diagonals of `A` and `B` are positive. Operators come as trait objects, so that this is
/// compiled once.
pub(crate) fn enclose<T: Scalar>(
    a: &dyn Rows<T>,
    b: &dyn Rows<T>,
    q: &[T],
    [z, r]: &[Vec<f64>; 2],
    omega: &[f64],
    clock: &mut Clock<'_>,
) -> Result<Local, Refusal> {
    let n = q.len();
    let on_r: Vec<bool> = r.iter().map(|r| *r > 0.0).collect();
    let near: Vec<f64> = z.iter().zip(r).map(|(z, r)| z - r).collect();
    let wide = Hlcp::new(Wide(a), Wide(b), Omega::Each(omega.to_vec()));
    let wide = wide.map_err(|_| Refusal::Overflow)?;
    let mut inverse = Inverse::new(&wide);
    let mut matrix = jacobian(a, b, &on_r, clock)?;
    let mut centre = Centre { near: near.clone(), more: vec![0.0; n], on_r };
    let mut witness = None;
    let (mut last, mut changes, mut opened) = (f64::INFINITY, n, n);
    for step in 0..STEPS {
        let [value, bound] = defect(&matrix, q, &centre, clock)?;
        let size = bound.iter().copied().fold(0.0, larger);
        if !size.is_finite() {
            return Err(Refusal::Overflow);
        }
        if clock.is_up() {
            return Err(Refusal::TimeLimit);
        }
        let ending = step + 1 == STEPS || changes == 0 && size > 0.5 * last;
        last = size;
        if step > 0 && (changes == 0 || ending) {
            let d = match witness.take() {
                Some(d) => d,
                None => positive(&matrix, &bound, &mut inverse, &centre.on_r, clock),
            };
            let radius = radii(&matrix, &d, &bound)?;
            let open = centre.open(&radius, None);
            let count = open.iter().filter(|open| **open).count();
            if count == 0 && (ending || centre.is_tight(&near, &radius)) {
                return Ok(Local { centre, radius, open });
            }
            if count > 0 && (ending || count >= opened) {
                let now = (&centre, open);
                match weakened(a, b, now, (omega, &bound), &mut inverse, clock) {
                    Ok((radius, open)) => return Ok(Local { centre, radius, open }),
                    Err(refusal) if ending => return Err(refusal),
                    Err(_) => {}
                }
            }
            opened = count;
            witness = Some(d);
        }
        let enough = |rest: &[f64]| rest.iter().map(|r| r * r).sum::<f64>() <= PART * PART;
        let way = inverse.solve(&matrix, &centre.on_r, &value, enough, clock);
        changes = centre.step(&way, omega, step < FREE);
        if changes > 0 {
            matrix = jacobian(a, b, &centre.on_r, clock)?;
            witness = None;
        }
    }
    Err(Refusal::OpenSigns { open: opened })
}

impl Centre {
    /// Goes back along `way`; returns how many unknowns came to the other side. Unless sides are
    /// `free`, those are set to 0.
    fn step(&mut self, way: &[f64], omega: &[f64], free: bool) -> usize {
        let mut changes = 0;
        for (j, way) in way.iter().enumerate() {
            self.more[j] -= way;
            let v = self.near[j] + self.more[j];
            if if self.on_r[j] { v > 0.0 } else { v < 0.0 } {
                self.near[j] = 0.0;
                self.more[j] = 0.0;
                if free {
                    self.more[j] = if self.on_r[j] { v / omega[j] } else { v * omega[j] };
                    self.on_r[j] = !self.on_r[j];
                    changes += 1;
                }
            }
        }
        changes
    }

    /// The columns whose unknown may be 0 within the radius, and those that are open `already`.
    fn open(&self, radius: &[f64], already: Option<&[bool]>) -> Vec<bool> {
        let settled = |j: usize| (self.near[j] + self.more[j]).abs().next_down() > radius[j];
        (0..radius.len()).map(|j| !settled(j) || already.is_some_and(|open| open[j])).collect()
    }

    /// Whether the radius is small beside the way from `near`, for `z` and for `r`.
    fn is_tight(&self, near: &[f64], radius: &[f64]) -> bool {
        let (mut ways, mut radii) = ([0.0_f64; 2], [0.0_f64; 2]);
        for j in 0..near.len() {
            let side = usize::from(self.on_r[j]);
            ways[side] = ways[side].max((self.near[j] - near[j] + self.more[j]).abs());
            radii[side] = radii[side].max(radius[j]);
        }
        (0..2).all(|side| radii[side] <= TIGHT * ways[side])
    }
}

/// Columns of `A`, and of `B` where `on_r`, exactly.
fn jacobian<T: Scalar>(
    a: &dyn Rows<T>,
    b: &dyn Rows<T>,
    on_r: &[bool],
    clock: &mut Clock<'_>,
) -> Result<Sparse, Refusal> {
    let (mut row, mut finite) = (vec![], true);
    let mut matrix = Sparse::with_capacity(on_r.len(), 5 * on_r.len());
    for i in 0..on_r.len() {
        if clock.is_up_at(i) {
            return Err(Refusal::TimeLimit);
        }
        row.clear();
        let mut part = |side: bool, j: usize, value: f64| {
            finite &= value.is_finite();
            if on_r[j] == side {
                row.push((j, value));
            }
        };
        visit(&a, i, |j, value| part(false, j, value));
        visit(&b, i, |j, value| part(true, j, value));
        matrix.push(row.iter().copied());
    }
    // An entry that is no number makes F none, whatever it is multiplied by.
    if finite { Ok(matrix) } else { Err(Refusal::Overflow) }
}

/// The matrix M: the comparison matrix of every mixture of `A` and `B` in open columns, in the unit
/// of the unknown on its side.
fn hull<T: Scalar>(
    a: &dyn Rows<T>,
    b: &dyn Rows<T>,
    on_r: &[bool],
    open: &[bool],
    omega: &[f64],
    clock: &mut Clock<'_>,
) -> Result<Sparse, Refusal> {
    let mut row = vec![];
    let mut matrix = Sparse::with_capacity(on_r.len(), 5 * on_r.len());
    for i in 0..on_r.len() {
        if clock.is_up_at(i) {
            return Err(Refusal::TimeLimit);
        }
        merge((&a, &b), i, &mut row);
        let entry = |&(j, [a, b]): &(usize, [f64; 2])| {
            let (on_r, omega) = (on_r[j], omega[j]);
            let value = match (open[j], i == j) {
                (false, true) => return (j, if on_r { b } else { a }),
                (false, false) => return (j, -if on_r { b } else { a }.abs()),
                (true, true) if on_r => smaller(div_down(a, omega), b),
                (true, true) => smaller(a, mul_down(b, omega)),
                (true, false) if on_r => -larger(div_up(a.abs(), omega), b.abs()),
                (true, false) => -larger(a.abs(), mul_up(b.abs(), omega)),
            };
            (j, value)
        };
        matrix.push(row.iter().map(entry).filter(|&(_, value)| value != 0.0));
    }
    Ok(matrix)
}

/// `F(v) = q + J v`, nearly, and what is not less than its modulus.
fn defect<T: Scalar>(
    matrix: &Sparse,
    q: &[T],
    centre: &Centre,
    clock: &mut Clock<'_>,
) -> Result<[Vec<f64>; 2], Refusal> {
    let [mut value, mut bound] = [(); 2].map(|()| Vec::with_capacity(q.len()));
    for (i, q) in q.iter().enumerate() {
        if clock.is_up_at(i) {
            return Err(Refusal::TimeLimit);
        }
        let mut sum = Doubled::default();
        sum.add(q.wide(), 1.0);
        for (j, entry) in matrix.row(i) {
            sum.add(entry, centre.near[j]);
            if centre.more[j] != 0.0 {
                sum.add(entry, centre.more[j]);
            }
        }
        value.push(sum.value());
        bound.push(sum.interval().magnitude());
    }
    Ok([value, bound])
}

/// A candidate for a `d > 0` with `M d > 0`, where M is the comparison matrix of `matrix`: about
/// M⁻¹ times a vector of the size of `bound`, none of whose entries is far below the mean.
fn positive<A: Rows<f64>, B: Rows<f64>>(
    matrix: &Sparse,
    bound: &[f64],
    inverse: &mut Inverse<'_, A, B>,
    on_r: &[bool],
    clock: &mut Clock<'_>,
) -> Vec<f64> {
    let largest = bound.iter().copied().fold(0.0, f64::max);
    let mut g: Vec<f64> =
        bound.iter().map(|f| if largest > 0.0 { f / largest } else { 1.0 }).collect();
    let square = |g: &[f64]| g.iter().map(|g| g * g).sum::<f64>();
    let mean = (square(&g) / g.len() as f64).sqrt();
    g.iter_mut().for_each(|g| *g += mean);
    let unit = square(&g).sqrt();
    g.iter_mut().for_each(|g| *g /= unit);
    let enough = |rest: &[f64]| rest.iter().zip(&g).all(|(rest, g)| rest.abs() <= 0.5 * g);
    if matrix.is_z() {
        inverse.solve(matrix, on_r, &g, enough, clock)
    } else {
        matrix.comparison().solve(&g, enough, clock)
    }
}

/// `|δ| ≤ t d` for every δ with `M|δ| ≤ bound`, rounded upward, if `d > 0` and `M d > 0`.
fn radii(matrix: &Sparse, d: &[f64], bound: &[f64]) -> Result<Vec<f64>, Refusal> {
    let mut t = 0.0;
    for (i, bound) in bound.iter().enumerate() {
        let mut sum = Sum::default();
        matrix
            .row(i)
            .for_each(|(j, entry)| sum.add(if i == j { entry } else { -entry.abs() }, d[j]));
        let gap = sum.interval().lower;
        if !(gap > 0.0 && d[i] > 0.0 && d[i].is_finite()) {
            return Err(Refusal::NoWitness);
        }
        t = larger(t, div_up(*bound, gap));
    }
    let radius: Vec<f64> = d.iter().map(|d| mul_up(*d, t)).collect();
    if radius.iter().all(|radius| radius.is_finite()) { Ok(radius) } else { Err(Refusal::Overflow) }
}

/// A radius with some columns open, and all that are then.
fn weakened<T: Scalar, A: Rows<f64>, B: Rows<f64>>(
    a: &dyn Rows<T>,
    b: &dyn Rows<T>,
    (centre, mut open): (&Centre, Vec<bool>),
    (omega, bound): (&[f64], &[f64]),
    inverse: &mut Inverse<'_, A, B>,
    clock: &mut Clock<'_>,
) -> Result<(Vec<f64>, Vec<bool>), Refusal> {
    const ROUNDS: usize = 6;
    for _ in 0..ROUNDS {
        let matrix = hull(a, b, &centre.on_r, &open, omega, clock)?;
        let d = positive(&matrix, bound, inverse, &centre.on_r, clock);
        let Ok(radius) = radii(&matrix, &d, bound) else { break };
        let next = centre.open(&radius, Some(&open));
        if next == open {
            return Ok((radius, open));
        }
        open = next;
    }
    Err(Refusal::OpenSigns { open: open.iter().filter(|open| **open).count() })
}

/// An operator in double precision.
struct Wide<'a, T>(&'a dyn Rows<T>);

impl<T: Scalar> LinearOperator<f64> for Wide<'_, T> {
    fn order(&self) -> usize {
        self.0.order()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        for (i, y) in y.iter_mut().enumerate() {
            *y = 0.0;
            self.visit_row(i, &mut |j, a| *y += a * x[j]);
        }
    }
}

impl<T: Scalar> Diagonal<f64> for Wide<'_, T> {
    fn diagonal_entry(&self, i: usize) -> f64 {
        self.0.diagonal_entry(i).wide()
    }
}

impl<T: Scalar> Rows<f64> for Wide<'_, T> {
    fn visit_row(&self, i: usize, each: &mut dyn FnMut(usize, f64)) {
        self.0.visit_row(i, &mut |j, a| each(j, a.wide()));
    }
}
