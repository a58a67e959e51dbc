//! How far an answer is from the solution, proved.

use std::fmt;

use hlcp_core::{Error, Rows, Scalar, all_finite, assert_lengths, check_orders};
use hlcp_methods::{Clock, Method};

use crate::{
    comparison::{check_pair, merge, ratio},
    decimal::decimal,
    enclosure::{Assembled, Refusal, by_method, holds, holds_one, is_z_pair},
    rounding::{Doubled, larger},
};

/// The proved side of an unknown.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::{Branch, certify};
///
/// let (a, b) = (FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?, Identity { order: 3 });
/// // z* = (1, 0, 0) and r* = (0, 2, 0): the last point is on neither side.
/// let certificate = certify(&a, &b, &[-4.0, 3.0, 0.0], &[1.0, 0.0, 0.0], &[0.0, 2.0, 1e-9])?;
/// assert_eq!(certificate.expect("a witness").sides, [Branch::Z, Branch::R, Branch::Open]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// `z* > 0` and `r* = 0`.
    Z,
    /// `r* > 0` and `z* = 0`.
    R,
    /// Neither is proved.
    Open,
}

/// A proof that a solution `(z*, r*)` exists between known bounds, rounding accounted for.
///
/// Other solutions may exist: [`uniqueness`](crate::uniqueness()) proves that there is one only.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::certify;
///
/// // −u″ with u = 0 at both ends, and u off by 1e-6 everywhere.
/// let (a, b) = (FivePoint::new(99, 1, [0.0, -1.0, 2.0, -1.0, 0.0])?, Identity { order: 99 });
/// let z: Vec<f64> = (1..100).map(|i| (i * (100 - i)) as f64 + 1e-6).collect();
/// let r = [0.0; 99];
/// let certificate = certify(&a, &b, &[-2.0; 99], &z, &r)?.expect("a Z-pair");
/// assert!((1e-6..1.3e-6).contains(&certificate.error()));
/// assert_eq!(certificate.interval(0)[1], [0.0, 0.0]); // r* = 0 where z* > 0
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// Not less than `|zⱼ − z*ⱼ|`.
    pub z: Vec<f64>,
    /// Not less than `|rⱼ − r*ⱼ|`.
    pub r: Vec<f64>,
    /// The side of each unknown, as far as it is proved.
    pub sides: Vec<Branch>,
    /// True if no other solution lies within the [`interval`](Self::interval)s.
    pub is_alone: bool,
    /// Bounds on `z* − r*`.
    bounds: [Vec<f64>; 2],
}

/// The intervals of `z` and `r` for one of `z − r`.
fn intervals([lower, upper]: [f64; 2]) -> [[f64; 2]; 2] {
    // Not −0.
    let part = |x: f64| if x > 0.0 { x } else { 0.0 };
    [[part(lower), part(upper)], [part(-upper), part(-lower)]]
}

impl Certificate {
    fn new<T: Scalar>(bounds: [Vec<f64>; 2], is_alone: bool, given: [&[T]; 2]) -> Self {
        let n = given[0].len();
        let [mut z, mut r] = [(); 2].map(|()| Vec::with_capacity(n));
        let mut sides = Vec::with_capacity(n);
        for j in 0..n {
            let [l, u] = [bounds[0][j], bounds[1][j]];
            let [of_z, of_r] = intervals([l, u]);
            z.push(farthest(given[0][j].wide(), of_z));
            r.push(farthest(given[1][j].wide(), of_r));
            sides.push(match (l > 0.0, u < 0.0) {
                (true, _) => Branch::Z,
                (_, true) => Branch::R,
                _ => Branch::Open,
            });
        }
        Self { z, r, sides, is_alone, bounds }
    }

    /// Not less than the largest error of a component of `z` or `r`.
    pub fn error(&self) -> f64 {
        self.z.iter().chain(&self.r).copied().fold(0.0, larger)
    }

    /// How many unknowns are proved to be on a side, or are [`Branch::Open`].
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Identity};
    /// use hlcp_verify::{Branch, certify};
    ///
    /// let (a, b) = (FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?, Identity { order: 2 });
    /// let certificate = certify(&a, &b, &[-4.0, 3.0], &[1.001, 0.0], &[0.0, 2.0])?;
    /// let certificate = certificate.expect("a Z-pair");
    /// let sides = [Branch::Z, Branch::R, Branch::Open];
    /// assert_eq!(sides.map(|side| certificate.count(side)), [1, 1, 0]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn count(&self, side: Branch) -> usize {
        self.sides.iter().filter(|&&of| of == side).count()
    }

    /// Intervals that hold `z*ⱼ` and `r*ⱼ`.
    ///
    /// # Panics
    ///
    /// Unless `j` is below the order.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Identity};
    /// use hlcp_verify::certify;
    ///
    /// let (a, b) = (FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?, Identity { order: 2 });
    /// let certificate = certify(&a, &b, &[-4.0, 3.0], &[1.001, 0.0], &[0.0, 2.0])?;
    /// let [z, r] = certificate.expect("a Z-pair").interval(0);
    /// assert!(z[0] <= 1.0 && 1.0 <= z[1] && r == [0.0, 0.0]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn interval(&self, j: usize) -> [[f64; 2]; 2] {
        intervals([self.bounds[0][j], self.bounds[1][j]])
    }

    /// Two numbers that `c_zᵀz* + c_rᵀr*` lies between: a load, a flow or a price with its proof.
    ///
    /// # Panics
    ///
    /// Unless both vectors have an entry for each unknown.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Identity};
    /// use hlcp_verify::certify;
    ///
    /// let (a, b) = (FivePoint::new(99, 1, [0.0, -1.0, 2.0, -1.0, 0.0])?, Identity { order: 99 });
    /// let z: Vec<f64> = (1..100).map(|i| (i * (100 - i)) as f64 + 1e-6).collect();
    /// let certificate = certify(&a, &b, &[-2.0; 99], &z, &[0.0; 99])?.expect("a Z-pair");
    /// let [lower, upper] = certificate.functional([&[1.0; 99], &[0.0; 99]]);
    /// assert!(lower <= 166_650.0 && 166_650.0 <= upper); // Σ i (100 − i)
    /// assert!(upper - lower < 1e-5);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn functional(&self, coefficients: [&[f64]; 2]) -> [f64; 2] {
        let mut sums = [Doubled::default(); 2];
        for (k, c) in coefficients.into_iter().enumerate() {
            let name = ["coefficients[0]", "coefficients[1]"][k];
            assert_lengths(self.sides.len(), [(name, c.len())]);
            for (j, &c) in c.iter().enumerate() {
                let [l, u] = self.interval(j)[k];
                let ends = if c >= 0.0 { [l, u] } else { [u, l] };
                sums.iter_mut().zip(ends).for_each(|(sum, end)| sum.add(c, end));
            }
        }
        let [lower, upper] = [sums[0].interval().lower, sums[1].interval().upper];
        if lower <= upper { [lower, upper] } else { [f64::NEG_INFINITY, f64::INFINITY] }
    }
}

impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "certified error ≤ {}", decimal(self.error(), 2, true))
    }
}

/// Not less than the distance of `given` from any number in the interval.
fn farthest(given: f64, [lower, upper]: [f64; 2]) -> f64 {
    let way = larger(upper - given, given - lower);
    // What is exactly 0 is known to be.
    if way == 0.0 { 0.0 } else { way.next_up() }
}

/// Bounds the distance of `(z, r)`, which may come from anywhere, from a solution of HLCP(A, B, q).
///
/// Two vectors below and above the answer, at which the residual is evaluated outward, enclose a
/// solution; `docs/theory.md` §4 has the proof. The bound is seldom more than 1.3 times the error,
/// until the rounding of one double remains. The inner [`Refusal`] says why nothing is proved; it
/// is apart from the errors, which say what is wrong with the input.
///
/// # Cost
///
/// `A` and `B` are assembled (16 bytes an entry), and Newton's method with algebraic multigrid goes
/// on from the answer for a few steps. [`certify_by`] takes the method that found the answer.
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
/// let certificate = certify(&a, &b, &[-4.0, 3.0], &[1.001, 0.0], &[0.0, 1.0])??;
/// assert!((0.001..0.0013).contains(&certificate.error()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn certify<T: Scalar>(
    a: &(impl Rows<T> + ?Sized),
    b: &(impl Rows<T> + ?Sized),
    q: &[T],
    z: &[T],
    r: &[T],
) -> Result<Result<Certificate, Refusal>, Error> {
    certify_within(a, b, q, z, r, &mut Clock::endless())
}

/// As [`certify`], with what is proved until the clock is up, or [`Refusal::TimeLimit`].
///
/// # Errors
///
/// As [`certify`].
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_methods::Clock;
/// use hlcp_verify::{Refusal, certify_within};
///
/// let (a, b) = (FivePoint::new(99, 1, [0.0, -1.0, 2.0, -1.0, 0.0])?, Identity { order: 99 });
/// let z: Vec<f64> = (1..100).map(|i| (i * (100 - i)) as f64 + 1e-6).collect();
/// let mut late = || true;
/// let found = certify_within(&a, &b, &[-2.0; 99], &z, &[0.0; 99], &mut Clock::new(&mut late))?;
/// assert_eq!(found, Err(Refusal::TimeLimit));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn certify_within<T: Scalar>(
    a: &(impl Rows<T> + ?Sized),
    b: &(impl Rows<T> + ?Sized),
    q: &[T],
    z: &[T],
    r: &[T],
    clock: &mut Clock<'_>,
) -> Result<Result<Certificate, Refusal>, Error> {
    let (a, b) = (&a, &b);
    check(a, b, q, [z, r])?;
    Ok(enclose(a, b, q, [z, r], clock))
}

/// As [`certify_within`], by the method that found the answer, or any other one on the problem.
///
/// # Cost
///
/// Where rows are known and no entry off the diagonal is positive, a few iterations of the method
/// and two residuals in twice the digits, less than the solve took. Elsewhere, in single precision,
/// and where the method comes to rest too far from the solution, that of [`certify`].
///
/// # Errors
///
/// As [`certify`].
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp};
/// use hlcp_methods::{Clock, Limits, Solver, Tmms};
/// use hlcp_verify::certify_by;
///
/// let problem = Hlcp::lcp(FivePoint::new(30, 30, [-1.0, -1.0, 4.0, -1.0, -1.0])?)?;
/// let mut solver = Solver::new(Tmms::mirrored(problem, Aor::gauss_seidel())?);
/// let q: Vec<f64> = (0..900).map(|k| if k % 30 < 10 { -0.1 } else { 0.2 }).collect();
/// let outcome = solver.solve(&q, Limits::relative(1e-6))?;
/// assert!(outcome.converged());
/// let [z, r] = [solver.z().to_vec(), solver.r().to_vec()];
/// let found = certify_by(solver.method_mut(), &q, &z, &r, &mut Clock::endless())?;
/// assert!(found.expect("a Z-pair").error() < 1e-4);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn certify_by<T: Scalar, M: Method<T, A: Rows<T>, B: Rows<T>>>(
    method: &mut M,
    q: &[T],
    z: &[T],
    r: &[T],
    clock: &mut Clock<'_>,
) -> Result<Result<Certificate, Refusal>, Error> {
    let problem = method.problem();
    check(problem.a(), problem.b(), q, [z, r])?;
    let is_exchanged = problem.q_factor() < T::zero();
    let mut first = None;
    // Boxes in single precision are too wide to settle the sides of its answers.
    let is_double = T::epsilon().wide() <= f64::EPSILON;
    if is_double && problem.strip().is_none() && is_z_pair(problem.a(), problem.b()) {
        let omega = |j| problem.omega().entry(j).wide();
        let omega: Vec<f64> =
            (0..q.len()).map(|j| if is_exchanged { 1.0 / omega(j) } else { omega(j) }).collect();
        let near =
            complementary(z, r, &omega).map(|v| v.into_iter().map(T::of).collect::<Vec<_>>());
        let mut x = vec![T::zero(); q.len()];
        problem.x_from_solution(&near[0], &near[1], &mut x);
        let sides = match method.at_work() {
            Some(mut method) => by_method(&mut method, q, &x, true, clock),
            None => by_method(method, q, &x, true, clock),
        };
        if let Some((mut sides, is_narrow)) = sides {
            if is_exchanged {
                sides.swap(0, 1);
            }
            let (a, b) = as_posed(method);
            // Strict inequalities on one piece of F make its matrix an M-matrix.
            let is_alone = !sides[0].iter().zip(&sides[1]).any(|(l, u)| *l < 0.0 && *u > 0.0)
                || holds_one(&a, &b, &sides);
            let found = Certificate::new(sides, is_alone, [z, r]);
            if is_narrow || clock.is_up() {
                return Ok(Ok(found));
            }
            first = Some(found);
        }
    }
    let (a, b) = as_posed(method);
    Ok(match (first, enclose(a, b, q, [z, r], clock)) {
        (Some(first), Ok(other)) => Ok(if other.error() < first.error() { other } else { first }),
        (Some(first), Err(_)) => Ok(first),
        (None, other) => other,
    })
}

/// Proves that a solution has `z − r` between `lower` and `upper`, two vectors of any origin, and
/// bounds its distance from `(z, r)`. `None` where the theorem does not apply.
///
/// # Cost
///
/// Three walks over the rows.
///
/// # Errors
///
/// As [`certify`].
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::certify_box;
///
/// let (a, b) = (FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?, Identity { order: 2 });
/// // z* = (1, 0) and r* = (0, 2): within these bounds, but not within narrower ones beside it.
/// let (q, z, r) = ([-4.0, 3.0], [1.0, 0.0], [0.0, 2.0]);
/// let found = certify_box(&a, &b, &q, [&[0.5, -2.6], &[1.5, -1.4]], [&z, &r])?;
/// assert!(found.is_some_and(|found| found.is_alone && found.error() >= 0.5));
/// assert_eq!(certify_box(&a, &b, &q, [&[1.1, -2.6], &[1.5, -1.4]], [&z, &r])?, None);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn certify_box<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    [lower, upper]: [&[f64]; 2],
    [z, r]: [&[T]; 2],
) -> Result<Option<Certificate>, Error> {
    check(a, b, q, [z, r])?;
    check_orders(q.len(), &[("lower", lower.len()), ("upper", upper.len())])?;
    let sides = [lower.to_vec(), upper.to_vec()];
    Ok(holds(a, b, q, &sides).then(|| {
        let is_alone = holds_one(a, b, &sides);
        Certificate::new(sides, is_alone, [z, r])
    }))
}

/// As [`certify_within`], for data that are known within bounds: the solutions of HLCP(A, B, q)
/// for all `A`, `B` and `q` between the first and the second of each pair, where no entry of the
/// first is more than that of the second.
///
/// Each of these problems has a solution within the [`interval`](Certificate::interval)s; nothing
/// is said of others ([`Certificate::is_alone`] is `false`). Where no entry off the diagonal can be
/// positive, one problem is the worst upwards, HLCP(A₁, B₂, q₁), and one downwards, HLCP(A₂, B₁,
/// q₂), so the intervals are as narrow as these two solutions are close.
///
/// # Cost
///
/// That of [`certify`] twice.
///
/// # Errors
///
/// As [`certify`], and [`Error::Operator`] where an entry of the first is more than that of the
/// second; [`Refusal::OffDiagonal`] where one off the diagonal may be positive.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_methods::Clock;
/// use hlcp_verify::certify_range;
///
/// let [low, high] = [3.9, 4.1].map(|d| FivePoint::new(2, 1, [0.0, -1.0, d, -1.0, 0.0]).unwrap());
/// let b = Identity { order: 2 };
/// // z = (4/d, 0) and r = (0, 3 − 4/d).
/// let (q, z, r) = ([-4.0, 3.0], [1.0, 0.0], [0.0, 2.0]);
/// let found =
///     certify_range([&low, &high], [&b, &b], [&q, &q], [&z, &r], &mut Clock::endless())?;
/// let [lower, upper] = found.expect("a Z-pair").interval(0)[0];
/// assert!((lower - 4.0 / 4.1).abs() < 1e-12 && (upper - 4.0 / 3.9).abs() < 1e-12);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn certify_range<T: Scalar>(
    a: [&impl Rows<T>; 2],
    b: [&impl Rows<T>; 2],
    q: [&[T]; 2],
    [z, r]: [&[T]; 2],
    clock: &mut Clock<'_>,
) -> Result<Result<Certificate, Refusal>, Error> {
    for k in 0..2 {
        check(a[k], b[k], q[k], [z, r])?;
    }
    ascends("A", a)?;
    ascends("B", b)?;
    for (i, (&first, &second)) in q[0].iter().zip(q[1]).enumerate() {
        if first > second {
            return Err(descent("q", &i, [first.wide(), second.wide()]));
        }
    }
    if !is_z_pair(a[1], b[1]) {
        return Ok(Err(Refusal::OffDiagonal));
    }
    let mut sides = |a, b, q| bounds(a, b, q, [z, r], false, clock);
    Ok((|| {
        // Only columns of A where z is, and only those of B where r is, add to F: so of all the
        // problems F is least for the one, and largest for the other.
        let [_, upper] = sides(a[0], b[1], q[0])?;
        let [lower, _] = sides(a[1], b[0], q[1])?;
        if lower.iter().zip(&upper).all(|(l, u)| l <= u) {
            Ok(Certificate::new([lower, upper], false, [z, r]))
        } else {
            Err(Refusal::NoBox)
        }
    })())
}

/// Checks that no entry of the first operator is more than that of the second.
fn ascends<T: Scalar>(
    what: &'static str,
    [first, second]: [&impl Rows<T>; 2],
) -> Result<(), Error> {
    let mut row = vec![];
    for i in 0..first.order() {
        merge((first, second), i, &mut row);
        if let Some(&(j, pair)) = row.iter().find(|(_, [first, second])| first > second) {
            return Err(descent(what, &format_args!("{i}, {j}"), pair));
        }
    }
    Ok(())
}

/// Returns the error of an entry of the first that is more than that of the second.
fn descent(what: &'static str, at: &dyn fmt::Display, [first, second]: [f64; 2]) -> Error {
    let why = format!(
        "entry [{at}] is {first} in the first and {second} in the second, but must not be less \
         there: exchange the two"
    );
    Error::Operator { what, why: why.into() }
}

/// The certificate by Newton's method on the assembled pair.
fn enclose<T: Scalar>(
    a: &dyn Rows<T>,
    b: &dyn Rows<T>,
    q: &[T],
    given: [&[T]; 2],
    clock: &mut Clock<'_>,
) -> Result<Certificate, Refusal> {
    let sides = bounds(a, b, q, given, true, clock)?;
    let is_alone = holds_one(&a, &b, &sides);
    Ok(Certificate::new(sides, is_alone, given))
}

fn bounds<T: Scalar>(
    a: &dyn Rows<T>,
    b: &dyn Rows<T>,
    q: &[T],
    given: [&[T]; 2],
    fine: bool,
    clock: &mut Clock<'_>,
) -> Result<[Vec<f64>; 2], Refusal> {
    let omega = ratio(&a, &b).ok_or(Refusal::Diagonal)?;
    let [z, r] = complementary(given[0], given[1], &omega);
    Assembled::new(a, b, q, clock)?.enclose([&z, &r], fine, clock)
}

/// The operators that multiply `z` and `r`, which a problem may have exchanged.
fn as_posed<T: Scalar, M: Method<T, A: Rows<T>, B: Rows<T>>>(
    method: &M,
) -> (&dyn Rows<T>, &dyn Rows<T>) {
    let problem = method.problem();
    if problem.q_factor() < T::zero() {
        (problem.b(), problem.a())
    } else {
        (problem.a(), problem.b())
    }
}

fn check<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    [z, r]: [&[T]; 2],
) -> Result<(), Error> {
    check_pair(a, b)?;
    check_orders(a.order(), &[("q", q.len()), ("z", z.len()), ("r", r.len())])?;
    [("q", q), ("z", z), ("r", r)].into_iter().try_for_each(|(what, v)| all_finite(what, v))
}

/// A non-negative complementary pair near `(z, r)`: some components are set to 0, the others kept.
fn complementary<T: Scalar>(z: &[T], r: &[T], omega: &[f64]) -> [Vec<f64>; 2] {
    let all = || z.iter().zip(r).zip(omega).map(|((&z, &r), omega)| [z.wide(), r.wide(), *omega]);
    let keep = |keep: bool, value: f64| if keep && value > 0.0 { value } else { 0.0 };
    let near_z = all().map(|[z, r, omega]| keep(z * omega >= r, z)).collect();
    [near_z, all().map(|[z, r, omega]| keep(z * omega < r, r)).collect()]
}
