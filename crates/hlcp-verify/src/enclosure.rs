//! Boxes that hold a solution, by two evaluations of F.
//!
//! Write `x` for `z − r`, so that `z = x⁺` and `r = x⁻`, and `φᵢⱼ(xⱼ) = aᵢⱼxⱼ⁺ − bᵢⱼxⱼ⁻`. For `l ≤
//! u` let row `i` of F be not below 0 where `xᵢ = uᵢ` and not above 0 where `xᵢ = lᵢ`, whatever the
//! others are in their intervals. Then a solution lies in `[l, u]` (Poincaré and Miranda).
//! `docs/theory.md` §4 has the proof. Each `φᵢⱼ` is extreme at an end of its interval or at 0;
//! where no entry off the diagonal is positive it is extreme for all rows at once, and the test is
//! `F(l) ≤ 0 ≤ F(u)`.
//!
//! Where `l` and `u` come from does not matter. Here they solve HLCP(A, B, q ∓ g) for a small
//! `g > 0`, by the method at hand.

use hlcp_core::{Aor, Csr, Diagonal, Hlcp, LinearOperator, Omega, Rhs, Rows, Scalar};
use hlcp_methods::{AmgNewton, Clock, Method, Mms};

use crate::{
    classes::is_z,
    comparison::{merge, ratio, visit},
    perron::positive,
    rounding::{Doubled, Interval, mul_up},
    sparse::Sparse,
};

/// Why no certificate is given; nothing is claimed then.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::{Refusal, certify};
///
/// let (a, b) = (FivePoint::new(2, 1, [0.0, -1.0, 1.0, -1.0, 0.0])?, Identity { order: 2 });
/// // A is singular, and A z − r = (1, 1) has no solution.
/// let refusal = certify(&a, &b, &[-1.0; 2], &[1.0; 2], &[0.0; 2])?.unwrap_err();
/// assert_eq!(refusal, Refusal::NoBox);
/// assert!(refusal.to_string().starts_with("no box"));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// A diagonal entry of `A` or `B`, or the ratio of both in a row, is not positive and finite.
    #[error("a diagonal entry of A or B, or the ratio of both, is not positive and finite")]
    Diagonal,
    /// An entry off the diagonal of `A` or `B` may be positive.
    #[error("an entry off the diagonal of A or B may be positive")]
    OffDiagonal,
    /// No box near the answer could be proved to hold a solution.
    #[error(
        "no box near the answer was found that must hold a solution; a smaller residual may show \
         one"
    )]
    NoBox,
    /// A number overflowed, or an entry of `A` or `B` is not finite.
    #[error("a number overflowed, or an entry is not finite")]
    Overflow,
    /// The clock was up before anything was proved.
    #[error("the time limit was reached")]
    TimeLimit,
}

/// The part of its first residual at which an iteration ends: of one towards the answer, and of one
/// towards a side, all rows of which must keep their sign.
const CENTRE: f64 = 0.1;
const SIDE: f64 = 0.45;

/// Boxes that are tried, each narrower than the one before.
const BOXES: usize = 6;

/// The width of a box that is narrow enough, over the distance of the answer from it.
const NARROW: f64 = 0.3;

/// Returns whether no entry of a pair is positive off the diagonals.
pub(crate) fn is_z_pair<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>) -> bool {
    is_z(a).is_yes() && is_z(b).is_yes()
}

/// Overwrites `x` with an iterate whose residual is `part` of that of `x`, or `floor`, or with the
/// last one where the method comes to rest; returns the largest entry of the last residual that was
/// measured.
fn run<T: Scalar, M: Method<T>>(
    method: &mut M,
    q: &[T],
    x: &mut Vec<T>,
    [part, floor]: [f64; 2],
    clock: &mut Clock<'_>,
) -> Option<f64> {
    /// Iterations that may bring nothing, beside a quarter of all: near the rounding, and where
    /// Newton's method first moves a front.
    const IDLE: [usize; 2] = [2, 10];
    /// How far from the floor rounding is not met yet.
    const FAR: f64 = 1e4;
    let q = Rhs::new(q).ok()?;
    let [mut y, mut spare] = [x.clone(), x.clone()];
    let (mut goal, mut best, mut improved) = (f64::NAN, f64::INFINITY, 0);
    let mut ends = |k: usize, residual: f64, gain: f64| {
        if k == 0 {
            goal = (part * residual).max(floor);
        }
        if residual < gain * best {
            (best, improved) = (residual, k);
        }
        residual <= goal || k - improved > IDLE[usize::from(best > FAR * floor)] + k / 4
    };
    method.restart();
    for k in 0.. {
        // A method whose steps are long may know the residual beforehand, and needs no step from
        // the last iterate. They gain much, unless they end in rounding.
        let known = method.residual(&q, x).map(|known| known.linf);
        if let Some(known) = known.filter(|&known| ends(k, known, 0.7)) {
            return Some(known);
        }
        let norms = method.step(&q, x, &mut y, clock);
        if clock.is_up() || !norms.linf.is_finite() {
            return None;
        }
        method.complete(&q, &mut y, &mut spare);
        std::mem::swap(x, &mut y);
        if known.is_none() && ends(k, norms.linf, 0.999) {
            return Some(norms.linf);
        }
    }
    None
}

/// Encloses a solution near `given` for a pair without positive entries off the diagonal, and says
/// whether the box is narrow, or as narrow as rounding lets it be; `None` if no box could be proved
/// to hold a solution before the clock was up.
///
/// The first box is around what the method makes of the answer. It becomes narrower until the
/// answer's distance from it tells the error to a quarter, or until rounding forbids; then the
/// proved ends are sums of two numbers, rounded outward. If an end is wanted for itself, and not an
/// error (`fine` is false), rounding alone ends it, and F has its sign at the very ends.
pub(crate) fn by_method<T: Scalar, M: Method<T, A: Rows<T>, B: Rows<T>>>(
    method: &mut M,
    q: &[T],
    given: &[T],
    fine: bool,
    clock: &mut Clock<'_>,
) -> Option<([Vec<f64>; 2], bool)> {
    let mut centre = given.to_vec();
    let problem = method.problem();
    // In rows that dominate, steps of this shape raise every entry of F.
    let pivot = |i| {
        let (a, b) = (problem.a().diagonal_entry(i), problem.b().diagonal_entry(i));
        a.min(b * problem.omega().entry(i))
    };
    let mut shape: Vec<T> = (0..given.len()).map(|i| problem.gamma() / pivot(i)).collect();
    let (mut finer, mut is_narrow) = (None, false);
    let mut search = Search::new(CENTRE);
    let floor = rounding(problem, q, given);
    for _ in 0..BOXES {
        let rest = run(method, q, &mut centre, [search.part, floor], clock);
        let Some(rest) = rest.map(|rest| rest.max(floor)) else { break };
        let sides = around(method, q, &centre, [rest, floor], &mut shape, clock);
        let Some(sides) = sides else { break };
        let near = if fine { given } else { &centre };
        if !search.see([rest, floor], sides, near) {
            let is_at_floor = rest <= 1.5 * floor;
            if fine && is_at_floor && !search.is_narrow {
                let reach = T::of(4.0 * search.width);
                finer = refined(method, q, (&centre, reach), &shape, clock);
            }
            is_narrow = search.is_narrow || is_at_floor;
            break;
        }
    }
    let problem = method.problem();
    let plain = || search.best.map(|sides| sides.map(|side| difference(problem, &side)));
    finer.or_else(plain).map(|sides| (sides, is_narrow))
}

/// Encloses a solution more closely than doubles around `centre` can: F is moved so that the
/// solution of the moved problem is small where the centre is large, and what the method makes of
/// that is added to the centre as a second number.
///
/// An entry of the centre is cut to `reach`; if the solution is farther from it than that, the
/// check fails.
fn refined<T: Scalar, M: Method<T, A: Rows<T>, B: Rows<T>>>(
    method: &mut M,
    q: &[T],
    (centre, reach): (&[T], T),
    shape: &[T],
    clock: &mut Clock<'_>,
) -> Option<[Vec<f64>; 2]> {
    let problem = method.problem();
    if problem.q_factor() < T::zero() {
        return None;
    }
    let cut: Vec<T> = centre.iter().map(|x| x.max(-reach).min(reach)).collect();
    let [near, small] = [centre, &cut].map(|x| difference(problem, x));
    let minus: Vec<f64> = small.iter().map(|x| -x).collect();
    let at = |(i, &q)| T::of(row_at(problem, (i, q), [&near, &minus], &near, 1.0).value());
    let moved: Vec<T> = q.iter().enumerate().map(at).collect();
    let mut x = cut;
    let floor = rounding(problem, &moved, &x);
    let rest = run(method, &moved, &mut x, [1e-3, floor], clock)?;
    let (problem, level) = (method.problem(), T::of((3.0 * rest).max(1e-290)));
    let side = |way: f64| {
        let at: Vec<T> = x.iter().zip(shape).map(|(&x, &s)| x + T::of(way) * level * s).collect();
        let mut more = difference(problem, &at);
        more.iter_mut().zip(&small).for_each(|(more, small)| *more -= small);
        let x: Vec<f64> = near.iter().zip(&more).map(|(x, y)| x + y).collect();
        let row = |(i, &q)| row_at(problem, (i, q), [&near, &more], &x, way).interval();
        q.iter().enumerate().map(row).all(|row| row.lower > 0.0).then_some((more, x))
    };
    let [(below, lower), (above, upper)] = [side(-1.0)?, side(1.0)?];
    if !below.iter().zip(&above).all(|(l, u)| l <= u) {
        return None;
    }
    let outward = |x: Vec<f64>, next: fn(f64) -> f64| x.into_iter().map(next).collect();
    Some([outward(lower, f64::next_down), outward(upper, f64::next_up)])
}

/// `way` times entry `i` of F at `near + more`, with the columns of the signs of `x`.
fn row_at<T: Scalar>(
    problem: &Hlcp<T, impl Rows<T>, impl Rows<T>>,
    (i, q): (usize, T),
    [near, more]: [&[f64]; 2],
    x: &[f64],
    way: f64,
) -> Doubled {
    let (mut sum, mut row) = (Doubled::default(), vec![]);
    sum.add(q.wide(), way);
    merge((problem.a(), problem.b()), i, &mut row);
    for (j, [a, b]) in row {
        let c = way * if x[j] >= 0.0 { a } else { b };
        sum.add(c, near[j]);
        sum.add(c, more[j]);
    }
    sum
}

/// About what rounding makes of the residual at `x`.
fn rounding<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>, q: &[T], x: &[T]) -> f64 {
    let two_over_gamma = (T::one() + T::one()) / problem.gamma();
    let largest = x.iter().enumerate().fold(0.0, |most: f64, (i, &x)| {
        let term = if x > T::zero() {
            problem.a().diagonal_entry(i) * x
        } else {
            problem.b().diagonal_entry(i) * problem.omega().entry(i) * x
        };
        most.max((two_over_gamma * term).wide().abs()).max(q[i].wide().abs())
    });
    (T::epsilon().wide() * largest).max(1e-290)
}

/// The boxes so far, each around an iterate of a smaller residual.
struct Search<T> {
    /// The part of its first residual at which the next iteration ends.
    part: f64,
    /// The last box that was better than those before.
    best: Option<[Vec<T>; 2]>,
    rest: f64,
    width: f64,
    open: usize,
    /// True if the last box tells the error.
    is_narrow: bool,
}

impl<T: Scalar> Search<T> {
    fn new(part: f64) -> Self {
        let (rest, width) = (f64::INFINITY, f64::INFINITY);
        Self { part, best: None, rest, width, open: usize::MAX, is_narrow: false }
    }

    /// Takes the next box, which comes from a residual of `rest`; whether a narrower one says more:
    /// of the error of `given`, or of sides that are open.
    fn see(&mut self, [rest, floor]: [f64; 2], sides: [Vec<T>; 2], given: &[T]) -> bool {
        /// Of the largest unknown: what rounding may make of it in a few operations.
        const ROUNDING: f64 = 64.0 * f64::EPSILON;
        // Of z and of r.
        let [mut widths, mut ways, mut sizes] = [[0.0_f64; 2]; 3];
        let mut open = 0;
        for ((l, u), x) in sides[0].iter().zip(&sides[1]).zip(given) {
            let [l, u, x] = [l, u, x].map(|v| v.wide());
            let side = usize::from(l + u < 0.0);
            widths[side] = widths[side].max(u - l);
            ways[side] = ways[side].max(l - x).max(x - u);
            sizes[side] = sizes[side].max(l.abs()).max(u.abs());
            open += usize::from(l < 0.0 && u > 0.0);
        }
        let width = widths[0].max(widths[1]);
        let is_better = width < self.width;
        let excess = |k: usize| widths[k] / ways[k].max(ROUNDING * sizes[k]).max(f64::MIN_POSITIVE);
        let excess = excess(0).max(excess(1));
        let settles = open > 0 && open < self.open;
        self.is_narrow = excess <= NARROW;
        let gains = is_better && rest < 0.5 * self.rest && rest > 1.5 * floor;
        let goes_on = gains && (settles || !self.is_narrow);
        self.part = (0.5 * NARROW / excess).clamp(1e-6, if settles { 0.01 } else { CENTRE });
        (self.rest, self.width, self.open) = (rest, width, open);
        if is_better {
            self.best = Some(sides);
        }
        goes_on
    }
}

/// The sides of a box around `centre`, whose residual is about `rest`, with proof.
///
/// They are sought first along `shape`, which raises F by about 1; one that fails there comes from
/// the method, and gives `shape` its own.
fn around<T: Scalar, M: Method<T>>(
    method: &mut M,
    q: &[T],
    centre: &[T],
    [rest, floor]: [f64; 2],
    shape: &mut [T],
    clock: &mut Clock<'_>,
) -> Option<[Vec<T>; 2]> {
    /// How far F is raised over the residual: above 0 with what an iteration towards a side leaves.
    const LEVELS: [f64; 2] = [3.0, 24.0];
    let of_q = Rhs::new(q).ok()?;
    let sign = if method.problem().q_factor() > T::zero() { 1.0 } else { -1.0 };
    for level in LEVELS.map(|level| (level * rest).max(f64::MIN_POSITIVE)) {
        let mut side = |shape: &mut [T], way: f64| {
            let mut x: Vec<T> =
                centre.iter().zip(&*shape).map(|(&x, &s)| x + T::of(way * level) * s).collect();
            if method.problem().has_sign(&of_q, &x, way > 0.0)? {
                return Some(x);
            }
            let shift = T::of(sign * way * level);
            let shifted: Vec<T> = q.iter().map(|&q| q - shift).collect();
            x.copy_from_slice(centre);
            run(method, &shifted, &mut x, [SIDE, floor], clock)?;
            for (s, (&x, &centre)) in shape.iter_mut().zip(x.iter().zip(centre)) {
                *s = (x - centre) / T::of(way * level);
            }
            method.problem().has_sign(&of_q, &x, way > 0.0)?.then_some(x)
        };
        if let Some(upper) = side(shape, 1.0)
            && let Some(lower) = side(shape, -1.0)
            && lower.iter().zip(&upper).all(|(l, u)| l <= u)
        {
            return Some([lower, upper]);
        }
        if clock.is_up() {
            break;
        }
    }
    None
}

/// A pair in double precision, its rows multiplied by powers of two that make the diagonal of `A`
/// about 1 where no number is lost by that.
pub(crate) struct Assembled {
    a: Csr<'static, f64>,
    b: Csr<'static, f64>,
    q: Vec<f64>,
    omega: Vec<f64>,
}

impl Assembled {
    pub(crate) fn new<T: Scalar>(
        a: &dyn Rows<T>,
        b: &dyn Rows<T>,
        q: &[T],
        clock: &mut Clock<'_>,
    ) -> Result<Self, Refusal> {
        let power = |i| (-a.diagonal_entry(i).wide().log2().floor()).clamp(-1000.0, 1000.0).exp2();
        let scale: Vec<f64> = (0..q.len()).map(power).collect();
        match Self::scaled(a, b, q, &scale, clock) {
            Err(Refusal::Overflow) => Self::scaled(a, b, q, &vec![1.0; q.len()], clock),
            assembled => assembled,
        }
    }

    fn scaled<T: Scalar>(
        a: &dyn Rows<T>,
        b: &dyn Rows<T>,
        q: &[T],
        scale: &[f64],
        clock: &mut Clock<'_>,
    ) -> Result<Self, Refusal> {
        let mut is_exact = true;
        let mut times = |value: f64, scale: f64| {
            let product = value * scale;
            is_exact &= product.is_finite() && product / scale == value;
            product
        };
        let mut rows = |rows: &dyn Rows<T>| {
            let mut matrix = Sparse::default();
            for (i, &scale) in scale.iter().enumerate() {
                if clock.is_up_at(i) {
                    return Err(Refusal::TimeLimit);
                }
                let mut row = vec![];
                visit(&rows, i, |j, value| row.push((j, times(value, scale))));
                matrix.push(row);
            }
            matrix.matrix().ok_or(Refusal::Overflow)
        };
        let (a, b) = (rows(a)?, rows(b)?);
        let q: Vec<f64> = q.iter().zip(scale).map(|(q, &scale)| times(q.wide(), scale)).collect();
        let omega = ratio(&a, &b).filter(|_| is_exact).ok_or(Refusal::Overflow)?;
        Ok(Self { a, b, q, omega })
    }

    /// Encloses a solution near the pair `z`, `r` as vectors `z − r`.
    pub(crate) fn enclose(
        &self,
        [z, r]: [&[f64]; 2],
        fine: bool,
        clock: &mut Clock<'_>,
    ) -> Result<[Vec<f64>; 2], Refusal> {
        let Self { a, b, q, omega } = self;
        let problem = Hlcp::new(a, b, Omega::Each(omega.clone())).map_err(|_| Refusal::Overflow)?;
        let mut x = vec![0.0; q.len()];
        problem.x_from_solution(z, r, &mut x);
        let base = Mms::new(problem.clone(), Aor::gauss_seidel().accelerated());
        let method = base.and_then(AmgNewton::new);
        let mut method = method.map_err(|_| Refusal::Overflow)?;
        let found = if is_z_pair(a, b) {
            by_method(&mut method, q, &x, fine, clock).map(|(sides, _)| sides)
        } else {
            self.by_moduli(&mut method, x, clock)
        };
        found.ok_or(if clock.is_up() { Refusal::TimeLimit } else { Refusal::NoBox })
    }

    /// Encloses a solution for entries of any signs: by `x ± e`, where `M e` exceeds the defect.
    ///
    /// M is the comparison matrix of the columns that the box reaches.
    fn by_moduli(
        &self,
        method: &mut impl Method<f64, A: Rows<f64>, B: Rows<f64>>,
        mut x: Vec<f64>,
        clock: &mut Clock<'_>,
    ) -> Option<[Vec<f64>; 2]> {
        let Self { a, b, q, omega } = self;
        let mut search = Search::new(0.01);
        let given = difference(method.problem(), &x);
        let floor = rounding(method.problem(), q, &x);
        for _ in 0..BOXES {
            let rest = run(method, q, &mut x, [search.part, floor], clock);
            let Some(rest) = rest.map(|rest| rest.max(floor)) else { break };
            let centre = difference(method.problem(), &x);
            let mut open = vec![false; q.len()];
            let mut sides = None;
            // One round for the sides that are open at once, and some for those that follow.
            for _ in 0..4 {
                let Some(e) = widths(self, &centre, &open, 3.0 * rest, clock) else { break };
                let all = || centre.iter().zip(&e).zip(omega);
                // Beyond 0 begins the unit of the other unknown.
                let upper = all().map(|((&x, e), omega)| {
                    let u = x + e;
                    if x < 0.0 && u > 0.0 { u / omega } else { u }
                });
                let lower = all().map(|((&x, e), omega)| {
                    let l = x - e;
                    if x >= 0.0 && l < 0.0 { l * omega } else { l }
                });
                let around = [lower.collect::<Vec<_>>(), upper.collect()];
                if holds(a, b, q, &around) {
                    sides = Some(around);
                    break;
                }
                let before = open.clone();
                for (open, (x, e)) in open.iter_mut().zip(centre.iter().zip(&e)) {
                    *open |= x.abs() <= *e;
                }
                if open == before {
                    break;
                }
            }
            let Some(sides) = sides else { break };
            if !search.see([rest, floor], sides, &given) {
                break;
            }
        }
        search.best
    }
}

/// `z − r` of a modulus variable.
pub(crate) fn difference<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
    problem: &Hlcp<T, A, B>,
    x: &[T],
) -> Vec<f64> {
    let [mut z, mut r] = [(); 2].map(|()| vec![T::zero(); x.len()]);
    problem.solution_from_x(x, &mut z, &mut r);
    z.iter().zip(&r).map(|(z, r)| z.wide() - r.wide()).collect()
}

/// About `M⁻¹` times a vector of `level`s, positive; M is the comparison matrix of the sides of
/// `centre`, and of all mixtures of `A` and `B` in columns that are `open`.
fn widths(
    Assembled { a, b, omega, .. }: &Assembled,
    centre: &[f64],
    open: &[bool],
    level: f64,
    clock: &mut Clock<'_>,
) -> Option<Vec<f64>> {
    let (mut matrix, mut row) = (Sparse::default(), vec![]);
    for i in 0..centre.len() {
        merge((a, b), i, &mut row);
        matrix.push(row.iter().map(|&(j, [a, b])| {
            let (on_r, omega) = (centre[j] < 0.0, omega[j]);
            // In the unit of the side.
            let [a, b] = if on_r { [a / omega, b] } else { [a, b * omega] };
            let own = if on_r { b } else { a };
            (
                j,
                match (open[j], i == j) {
                    (false, true) => own,
                    (false, false) => -own.abs(),
                    (true, true) => a.min(b),
                    (true, false) => -a.abs().max(b.abs()),
                },
            )
        }));
    }
    let within = SIDE / (centre.len() as f64).sqrt();
    let e = matrix.solve(level, within, clock);
    positive(&e).then_some(e)
}

/// Returns whether a solution lies between `lower` and `upper`, by the theorem.
pub(crate) fn holds<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    [lower, upper]: &[Vec<f64>; 2],
) -> bool {
    let mut row = vec![];
    let ordered = lower.iter().zip(upper).all(|(l, u)| l <= u && l.is_finite() && u.is_finite());
    ordered
        && (0..q.len()).all(|i| {
            merge((a, b), i, &mut row);
            // Of F where xᵢ = uᵢ and of −F where xᵢ = lᵢ.
            [(upper, 1.0), (lower, -1.0)].into_iter().all(|(own, sign)| {
                let mut sum = Doubled::default();
                sum.add(q[i].wide(), sign);
                for &(j, pair) in &row {
                    let [a, b] = pair.map(|entry| sign * entry);
                    let ends = if i == j { [own[i]; 2] } else { [lower[j], upper[j]] };
                    add_least(&mut sum, [a, b], ends);
                }
                sum.interval().lower >= 0.0
            })
        })
}

/// Adds what is not more than `a x⁺ − b x⁻` for any `x` between `l` and `u`.
fn add_least(sum: &mut Doubled, [a, b]: [f64; 2], [l, u]: [f64; 2]) {
    if a.is_nan() || b.is_nan() {
        sum.add(f64::NAN, 1.0);
    } else if l >= 0.0 {
        sum.add(a, if a >= 0.0 { l } else { u });
    } else if u <= 0.0 {
        sum.add(b, if b >= 0.0 { l } else { u });
    } else {
        match (b > 0.0, a < 0.0) {
            (true, false) => sum.add(b, l),
            (false, true) => sum.add(a, u),
            (false, false) => {}
            // Which product is smaller is unsettled if they are rounded to neighbours.
            (true, true) => {
                let (c, x) = if b * l <= a * u { (b, l) } else { (a, u) };
                sum.add(c, x);
                sum.add(-4.0 * f64::EPSILON, (c * x).abs() + f64::MIN_POSITIVE);
            }
        }
    }
}

/// Returns whether a box holds no second solution: its widths are a witness for the mixtures of `A`
/// and `B` that it reaches.
pub(crate) fn holds_one<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    [lower, upper]: &[Vec<f64>; 2],
) -> bool {
    let mut row = vec![];
    (0..lower.len()).all(|i| {
        merge((a, b), i, &mut row);
        let mut gap = Doubled::default();
        for &(j, [a, b]) in &row {
            let (l, u) = (lower[j], upper[j]);
            let (a, b) = if i == j { (a, b) } else { (-a.abs(), -b.abs()) };
            if l >= 0.0 || u <= 0.0 {
                gap.add(if l >= 0.0 { a } else { b }, (u - l).abs());
            } else {
                // Below the products, which round by half a unit in the last place.
                let [a, b] = [a * u, b * -l];
                gap.add(1.0, a.min(b) - mul_up(a.abs().max(b.abs()), f64::EPSILON));
            }
        }
        let Interval { lower, .. } = gap.interval();
        lower > 0.0
    })
}
