//! How far an answer is from the solution, proved.

use std::fmt;

use hlcp_core::{Error, Rows, Scalar, all_finite};
use hlcp_methods::Clock;

use crate::{
    classes::{Answer, radius_below_one},
    comparison::Transposed,
    decimal::decimal,
    local::{Local, enclose},
    pair::Pair,
    perron::{Comparison, solve},
    rounding::{Doubled, Sum, div_up, down, larger, mul_up, up},
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
/// let witness = first.witness.expect("one solution only");
/// assert_eq!(witness, Witness::Right { omega: vec![4.0; 2], d: vec![1.0; 2] });
/// // It serves any other q without a search; for this one z* = (2, 1) and r* = 0.
/// let second = certify_with(&a, &b, &[-7.0, -2.0], &[2.0, 1.0], &[0.0; 2], witness)?;
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

/// Which argument a [`Certificate`] rests on.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::{Bound, certify};
///
/// // −u″ with u = 0 at both ends: no row is dominant enough for the global bound to be good.
/// let (a, b) = (FivePoint::new(99, 1, [0.0, -1.0, 2.0, -1.0, 0.0])?, Identity { order: 99 });
/// let z: Vec<f64> = (1..100).map(|i| (i * (100 - i)) as f64 + 1e-6).collect();
/// let r = [0.0; 99];
/// let certificate = certify(&a, &b, &[-2.0; 99], &z, &r)?.expect("an M-matrix");
/// assert_eq!(certificate.bound, Bound::Local);
/// assert!((1e-6..1.1e-6).contains(&certificate.error()));
/// assert_eq!(certificate.interval(0)[1], [0.0, 0.0]); // r* = 0 where z* > 0
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// The global bound of [`Witness::Right`], component by component.
    Componentwise,
    /// The global bound of [`Witness::Left`], one sum for all components.
    Sum,
    /// The bound near the answer, where one matrix stands in the place of all mixtures of the
    /// columns of `A` and `B`.
    Local,
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Componentwise => "componentwise",
            Self::Sum => "sum",
            Self::Local => "local",
        })
    }
}

/// What is proved of the side of an unknown.
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

/// A proof that a solution `(z*, r*)` exists, and a bound on every component of the error.
///
/// With a [`witness`](Self::witness) it is the only solution; without, the only one within its
/// [`interval`](Self::interval)s. All of it is a statement about real numbers; rounding is
/// accounted for. Global bounds may be infinite, if something overflows.
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
    /// What proves that the solution is the only one, if that is proved.
    pub witness: Option<Witness>,
    /// What the bounds rest on.
    pub bound: Bound,
    /// Not less than `|zⱼ − z*ⱼ|`.
    pub z: Vec<f64>,
    /// Not less than `|rⱼ − r*ⱼ|`.
    pub r: Vec<f64>,
    /// The side of each unknown, as far as it is proved.
    pub sides: Vec<Branch>,
    enclosure: Enclosure,
}

/// `|z* − z| ≤ radius[0]` and `|r* − r| ≤ radius[1]` for the centre `[z, r]`.
#[derive(Debug, Clone, PartialEq)]
struct Enclosure {
    centre: [Vec<f64>; 2],
    radius: [Vec<f64>; 2],
}

impl Certificate {
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
    /// let certificate = certificate.expect("a witness");
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
    /// let [z, r] = certificate.expect("a witness").interval(0);
    /// assert!(z[0] <= 1.0 && 1.0 <= z[1] && r[0] == 0.0 && r[1] < 0.01);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn interval(&self, j: usize) -> [[f64; 2]; 2] {
        let Enclosure { centre, radius } = &self.enclosure;
        [0, 1].map(|k| {
            let (centre, radius) = (centre[k][j], radius[k][j]);
            // The other unknown of a proved side is 0: no other solution on these sides is within.
            if radius == 0.0 {
                return [centre; 2];
            }
            // Neither is negative.
            [(centre - radius).next_down().max(0.0), (centre + radius).next_up()]
        })
    }

    /// Two numbers that `c_zᵀz* + c_rᵀr*` lies between: a load, a flow or a price with its proof.
    ///
    /// Errors that cancel in the sum cost nothing where the bound is [`Bound::Local`]: its Newton
    /// steps enter with their signs.
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
    /// let certificate = certify(&a, &b, &[-2.0; 99], &z, &[0.0; 99])?.expect("an M-matrix");
    /// let [lower, upper] = certificate.functional([&[1.0; 99], &[0.0; 99]]);
    /// assert!(lower <= 166_650.0 && 166_650.0 <= upper); // Σ i (100 − i)
    /// assert!(upper - lower < 1e-5);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn functional(&self, coefficients: [&[f64]; 2]) -> [f64; 2] {
        let (mut centre, mut radius) = (Doubled::default(), Sum::default());
        for (k, c) in coefficients.into_iter().enumerate() {
            assert_eq!(c.len(), self.sides.len(), "a coefficient for each unknown");
            for (c, (z, w)) in
                c.iter().zip(self.enclosure.centre[k].iter().zip(&self.enclosure.radius[k]))
            {
                // Zero times an infinite bound is nothing.
                if *c != 0.0 {
                    centre.add(*c, *z);
                    radius.add(c.abs(), *w);
                }
            }
        }
        let (centre, radius) = (centre.interval(), radius.interval().upper);
        let [lower, upper] =
            [(centre.lower - radius).next_down(), (centre.upper + radius).next_up()];
        if lower <= upper { [lower, upper] } else { [f64::NEG_INFINITY, f64::INFINITY] }
    }
}

impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (error, bound) = (decimal(self.error(), 2, true), self.bound);
        let unique = match self.witness {
            Some(_) => "solution unique: proved",
            None => "a solution proved, others not excluded",
        };
        write!(f, "{unique}; certified error ≤ {error} ({bound} bound)")
    }
}

/// Why no certificate is given; nothing is claimed then.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::{Refusal, certify};
///
/// let (a, b) = (FivePoint::new(2, 1, [0.0, -1.0, 1.0, -1.0, 0.0])?, Identity { order: 2 });
/// // A is singular, and A z − r = (1, 1) has no solution.
/// let refusal = certify(&a, &b, &[-1.0; 2], &[1.0; 2], &[0.0; 2])?.unwrap_err();
/// assert_eq!(refusal, Refusal::NoWitness);
/// assert!(refusal.to_string().starts_with("no M-matrix"));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// A diagonal entry of `A` or `B` is not positive and finite.
    Diagonal,
    /// No positive vector shows that a comparison matrix is an M-matrix, neither that of all
    /// mixtures of columns nor that of the sides at hand.
    NoWitness,
    /// As [`NoWitness`](Self::NoWitness), because so many unknowns are too near 0 to have a side.
    OpenSigns {
        /// How many.
        open: usize,
    },
    /// A number overflowed, or an entry of `A` or `B` is not finite.
    Overflow,
    /// The clock was up before anything was proved.
    TimeLimit,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diagonal => f.write_str("a diagonal entry of A or B is not positive and finite"),
            Self::NoWitness => f.write_str("no M-matrix was found that bounds A and B from below"),
            Self::OpenSigns { open } => write!(
                f,
                "the side of {open} unknowns is open, and no M-matrix covers both; a smaller \
                 residual may settle them"
            ),
            Self::Overflow => f.write_str("a number overflowed, or an entry is not finite"),
            Self::TimeLimit => f.write_str("the time limit was reached"),
        }
    }
}

/// Bounds the distance of `(z, r)`, which may come from anywhere, from a solution of HLCP(A, B, q).
///
/// The global bound is taken where a witness of ones makes it at most five times what the error is
/// at least; elsewhere the local one, which is seldom more than twice the error, and where
/// that is refused what a search for a global witness brings. `docs/theory.md` has the proofs. The
/// inner [`Refusal`] says why nothing is proved.
///
/// # Cost
///
/// A few walks over the rows where the witness of ones is good. For the local bound `A` and `B` are
/// walked, the columns of the sides at hand are assembled (16 bytes an entry), and an algebraic
/// multigrid solves two or three linear systems to a few digits. A search for a global witness,
/// after a refusal, may take many times that.
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
) -> Result<Result<Certificate, Refusal>, Error> {
    certify_within(a, b, q, z, r, &mut Clock::endless())
}

/// As [`certify`], with what is proved until the clock is up, or [`Refusal::TimeLimit`].
///
/// A few walks over the rows come before the first look at the clock.
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
/// // −u″ with u = 0 at both ends: no row is dominant enough for a bound at first sight.
/// let (a, b) = (FivePoint::new(99, 1, [0.0, -1.0, 2.0, -1.0, 0.0])?, Identity { order: 99 });
/// let z: Vec<f64> = (1..100).map(|i| (i * (100 - i)) as f64 + 1e-6).collect();
/// let mut late = || true;
/// let found = certify_within(&a, &b, &[-2.0; 99], &z, &[0.0; 99], &mut Clock::new(&mut late))?;
/// assert_eq!(found, Err(Refusal::TimeLimit));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn certify_within<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    z: &[T],
    r: &[T],
    clock: &mut Clock<'_>,
) -> Result<Result<Certificate, Refusal>, Error> {
    /// How many times the error a bound may be that is not improved upon.
    const ENOUGH: f64 = 5.0;
    check(a, b, q, [z, r])?;
    let Some(omega) = ratio(a, b) else { return Ok(Err(Refusal::Diagonal)) };
    let near = complementary(z, r, &omega);
    let pair = Pair::new(a, b, &omega);
    let defect = pair.defect(q, [&near[0], &near[1]]);
    let ones = vec![1.0; q.len()];
    let from_ones = by_norm(&pair, &ones, &defect);
    let global = |d: Vec<f64>, scale, clock: &mut Clock<'_>| {
        let bounds = of_both(finest(&pair, &defect, &d, scale, clock), &omega);
        let witness = Witness::Right { omega: omega.clone(), d };
        certificate(Bound::Componentwise, Some(witness), bounds, near.clone(), [z, r])
    };
    if let Some(scale) = &from_ones {
        let found = global(ones.clone(), scale, clock);
        if found.z.iter().all(|bound| *bound <= ENOUGH * scale.least) {
            return Ok(Ok(found));
        }
    }
    let refusal = match enclose(a, b, q, &near, &omega, clock) {
        Ok(found) => {
            let mut found = near_the_answer(found, &omega, [z, r]);
            found.witness = from_ones.map(|_| Witness::Right { omega, d: ones });
            return Ok(Ok(found));
        }
        Err(refusal) => refusal,
    };
    if clock.is_up() && from_ones.is_none() {
        return Ok(Err(Refusal::TimeLimit));
    }
    if let Some((d, scale)) = from_the_right(&pair, &defect, clock) {
        return Ok(Ok(global(d, &scale, clock)));
    }
    let left = from_the_left(a, b, clock);
    let bounds = left.and_then(|(v, columns)| Some((sums(&columns, &v, &defect)?, v)));
    Ok(match bounds {
        Some((bounds, v)) => {
            Ok(certificate(Bound::Sum, Some(Witness::Left { v }), bounds, near, [z, r]))
        }
        None => Err(if clock.is_up() { Refusal::TimeLimit } else { refusal }),
    })
}

/// Searches for a proof that HLCP(A, B, q) has exactly one solution for every `q`.
///
/// `None` where none exists or none was found.
///
/// # Cost
///
/// A few walks over the rows where `A` and `B` are dominant. Otherwise the search stores a
/// comparison matrix and solves up to 55 systems with it by algebraic multigrid.
///
/// # Errors
///
/// As [`certify`].
///
/// ```
/// use hlcp_verify::{Slider, Witness, witness};
///
/// let (a, b, _) = Slider { cells: 20 }.pose::<f64>()?;
/// assert!(matches!(witness(&a, &b)?, Some(Witness::Left { .. })));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn witness<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>) -> Result<Option<Witness>, Error> {
    witness_within(a, b, &mut Clock::endless())
}

/// As [`witness`], with what is found until the clock is up.
///
/// # Errors
///
/// As [`certify`].
///
/// ```
/// use hlcp_methods::Clock;
/// use hlcp_verify::{Slider, witness_within};
///
/// let (a, b, _) = Slider { cells: 20 }.pose::<f64>()?;
/// let mut late = || true;
/// assert_eq!(witness_within(&a, &b, &mut Clock::new(&mut late))?, None);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn witness_within<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    clock: &mut Clock<'_>,
) -> Result<Option<Witness>, Error> {
    check_pair(a, b)?;
    let Some(omega) = ratio(a, b) else { return Ok(None) };
    let pair = Pair::new(a, b, &omega);
    let defect = vec![1.0; a.order()];
    Ok(match from_the_right(&pair, &defect, clock) {
        Some((d, _)) => Some(Witness::Right { omega, d }),
        // Bounds with it prove that it is one.
        None => from_the_left(a, b, clock)
            .filter(|(v, columns)| sums(columns, v, &defect).is_some())
            .map(|(v, _)| Witness::Left { v }),
    })
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
    let (bound, bounds) = match &witness {
        Witness::Right { omega, d } => {
            let scale = by_norm(&pair, d, &defect);
            let clock = &mut Clock::endless();
            let finest = |scale| of_both(finest(&pair, &defect, d, &scale, clock), omega);
            (Bound::Componentwise, scale.map(finest))
        }
        Witness::Left { v } => {
            (Bound::Sum, Transposed::of(a, b).and_then(|columns| sums(&columns, v, &defect)))
        }
    };
    Ok(bounds.map(|bounds| certificate(bound, Some(witness), bounds, near, [z, r])))
}

fn check<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    q: &[T],
    [z, r]: [&[T]; 2],
) -> Result<(), Error> {
    check_pair(a, b)?;
    let expected = a.order();
    for (what, found) in [("q", q.len()), ("z", z.len()), ("r", r.len())] {
        if found != expected {
            return Err(Error::Order { what, found, expected });
        }
    }
    all_finite("q", q)?;
    all_finite("z", z)?;
    all_finite("r", r)
}

fn check_pair<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>) -> Result<(), Error> {
    a.check("A")?;
    b.check("B")?;
    let [found, expected] = [b.order(), a.order()];
    if found == expected { Ok(()) } else { Err(Error::Order { what: "B", found, expected }) }
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

/// Ω = D_A D_B⁻¹, rounded, if both diagonals are positive and so is it.
fn ratio<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>) -> Option<Vec<f64>> {
    let ratio = |i| a.diagonal_entry(i).wide() / b.diagonal_entry(i).wide();
    let omega: Vec<f64> = (0..a.order()).map(ratio).collect();
    (positive_diagonals(a, b) && positive(&omega)).then_some(omega)
}

/// The certificate for the pair that was given, from bounds for the one near it.
fn certificate<T: Scalar>(
    bound: Bound,
    witness: Option<Witness>,
    radius: [Vec<f64>; 2],
    centre: [Vec<f64>; 2],
    given: [&[T]; 2],
) -> Certificate {
    let enclosure = Enclosure { centre, radius };
    let [z, r] = [0, 1].map(|k| {
        let Enclosure { centre, radius } = &enclosure;
        let around = centre[k].iter().zip(&radius[k]).zip(given[k]);
        around.map(|((&centre, &radius), given)| distance(centre, given.wide(), radius)).collect()
    });
    let side = |j| match [0, 1].map(|k| enclosure.centre[k][j] > enclosure.radius[k][j]) {
        [true, false] => Branch::Z,
        [false, true] => Branch::R,
        _ => Branch::Open,
    };
    let sides = (0..given[0].len()).map(side).collect();
    Certificate { witness, bound, z, r, sides, enclosure }
}

/// Not less than the distance of `given` from any number within `radius` of `centre`.
fn distance(centre: f64, given: f64, radius: f64) -> f64 {
    if centre == given {
        radius
    } else if centre == 0.0 {
        (given.abs() + radius).next_up()
    } else {
        ((centre - given).abs().next_up() + radius).next_up()
    }
}

/// The certificate of what is proved near a centre.
fn near_the_answer<T: Scalar>(
    Local { centre, radius, open }: Local,
    omega: &[f64],
    given: [&[T]; 2],
) -> Certificate {
    let n = omega.len();
    let [mut z, mut r, mut of_z, mut of_r] = [(); 4].map(|()| vec![0.0; n]);
    for j in 0..n {
        let (on_r, omega) = (centre.on_r[j], omega[j]);
        // What the sum of the two numbers loses, u|v| at most, the radius takes up.
        let v = centre.near[j] + centre.more[j];
        let exact = centre.near[j] == 0.0 || centre.more[j] == 0.0;
        let lost = if exact { 0.0 } else { mul_up(v.abs(), f64::EPSILON) };
        let radius = if exact { radius[j] } else { (lost + radius[j]).next_up() };
        let other = if !open[j] {
            0.0
        } else if on_r {
            div_up(radius, omega)
        } else {
            mul_up(radius, omega)
        };
        if on_r {
            (r[j], of_r[j], of_z[j]) = (v.abs(), radius, other);
        } else {
            (z[j], of_z[j], of_r[j]) = (v.abs(), radius, other);
        }
    }
    certificate(Bound::Local, None, [of_z, of_r], [z, r], given)
}

/// A non-negative complementary pair near `(z, r)`: some components are set to 0, the others kept.
fn complementary<T: Scalar>(z: &[T], r: &[T], omega: &[f64]) -> [Vec<f64>; 2] {
    let all = || z.iter().zip(r).zip(omega).map(|((&z, &r), omega)| [z.wide(), r.wide(), *omega]);
    let keep = |keep: bool, value: f64| if keep && value > 0.0 { value } else { 0.0 };
    let near_z = all().map(|[z, r, omega]| keep(z * omega >= r, z)).collect();
    [near_z, all().map(|[z, r, omega]| keep(z * omega < r, r)).collect()]
}

/// A vector `d > 0` with `C d > 0`, and how it bounds every δ with `C|δ| ≤ defect`.
fn from_the_right<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    defect: &[f64],
    clock: &mut Clock<'_>,
) -> Option<(Vec<f64>, Scale)> {
    let ones = vec![1.0; defect.len()];
    if let Some(scale) = by_norm(pair, &ones, defect) {
        return Some((ones, scale));
    }
    // An approximate C⁻¹e is the better witness where the vector of ones nearly is one; a Perron
    // vector exists wherever a witness does, but it may span many orders of magnitude.
    let inverse = solve(&pair.coupled, &ones, &ones, clock);
    if let Some(scale) = by_norm(pair, &inverse, defect) {
        return Some((inverse, scale));
    }
    let Answer::Yes(d) = radius_below_one(&pair.coupled, clock) else { return None };
    let scale = by_norm(pair, &d, defect)?;
    Some((d, scale))
}

/// The least bounds on `|δ|` that are found with a witness `d`.
fn finest<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    defect: &[f64],
    d: &[f64],
    Scale { t, poor, .. }: &Scale,
    clock: &mut Clock<'_>,
) -> Vec<f64> {
    let mut w: Vec<f64> = d.iter().map(|d| up(d * t, 1.0)).collect();
    if *poor {
        let finer = componentwise(pair, d, defect, clock);
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
    /// About the least that the largest |δᵢ|/dᵢ can be: no row of |J| d is above `cᵢᵢdᵢ` and the
    /// rest of its row of `−C d`, so its quotient with the defect is not above that.
    least: f64,
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
    let (mut t, mut poor, mut least, mut witness) = (0.0, false, 0.0_f64, positive(d));
    rows(pair, d, |i, pivot, y| {
        let gap = row_of_product(pivot, d[i], y);
        witness &= gap > 0.0;
        poor |= gap < 0.1 * pivot * d[i];
        least = least.max(defect[i] / (pivot * d[i] + y));
        t = larger(t, defect[i] / gap);
    });
    witness.then_some(Scale { t: up(t, 1.0), poor, least })
}

/// A `w ≥ 0` with `C w ≥ defect`: an approximate solution, and as much of `d` as it lacks.
fn componentwise<T: Scalar, A: Rows<T>, B: Rows<T>>(
    pair: &Pair<'_, T, A, B>,
    d: &[f64],
    defect: &[f64],
    clock: &mut Clock<'_>,
) -> Vec<f64> {
    let mut w = solve(&pair.coupled, d, defect, clock);
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

/// A vector `v > 0` with `⟨A⟩ᵀv > 0` and `⟨B⟩ᵀv > 0`, not yet checked.
fn from_the_left<T: Scalar>(
    a: &impl Rows<T>,
    b: &impl Rows<T>,
    clock: &mut Clock<'_>,
) -> Option<(Vec<f64>, Transposed)> {
    if clock.is_up() {
        return None;
    }
    let columns = Transposed::of(a, b)?;
    match radius_below_one(&columns, clock) {
        Answer::Yes(v) => Some((v, columns)),
        _ => None,
    }
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
        let clock = &mut Clock::endless();
        let Answer::Yes(d) = radius_below_one(&pair.coupled, clock) else { panic!("an M-matrix") };
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
            let w = componentwise(&pair, &d, &f, clock);
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
