//! Decides whether there is one solution for every `q`: proved, refuted, or open with a reason.
//!
//! `docs/theory.md`, "Uniqueness is decided", has the proofs. In short: take for every unknown its
//! column of `A` or that of `B`; all these *choices* of columns shall be nonsingular M-matrices.
//! One solve `Jᵀv = w` with `w > 0` tells whether a choice `J` is one: then `v > 0`, and otherwise
//! the negative part of `v` proves the contrary. Howard's policy iteration leads from choice to
//! choice, by the columns that are worst for the latest `v`, to a `v` that serves all or to a
//! choice that is no M-matrix.

use std::{collections::HashSet, fmt};

use hlcp_core::{Error, Rows, Scalar, assert_lengths};
use hlcp_methods::Clock;

use crate::{
    classes::{Answer, radius_below_one},
    comparison::{Against, Coupled, Transposed, check_pair, ratio},
    perron::{Comparison, positive, scaled},
    rounding::{Doubled, sign},
};

/// The verdict on whether HLCP(A, B, q) has exactly one solution for every `q`.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::{Uniqueness, uniqueness};
///
/// let b = Identity { order: 2 };
/// let of = |diagonal| FivePoint::new(2, 1, [0.0, -2.0, diagonal, -2.0, 0.0]);
/// assert!(uniqueness(&of(2.5)?, &b)?.is_proved());
/// // z = (1, 1), r = 0 and z = 0, r = 0 both solve the problem for q = 0.
/// assert!(matches!(uniqueness(&of(2.0)?, &b)?, Uniqueness::Refuted(_)));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Uniqueness {
    /// It has, and this proves it.
    Proved(Witness),
    /// For some `q` it has none or several, and this proves it.
    Refuted(Disproof),
    /// Neither is proved.
    Open(Reason),
}

/// A proof that HLCP(A, B, q) has exactly one solution for every `q`.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::{Uniqueness, Witness, uniqueness};
///
/// let (a, b) = (FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?, Identity { order: 2 });
/// // The columns of A sum to 3, those of B to 1.
/// let found = uniqueness(&a, &b)?;
/// assert_eq!(found, Uniqueness::Proved(Witness::Left { v: vec![1.0; 2] }));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
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

impl Uniqueness {
    /// Returns whether it is proved that every `q` has exactly one solution.
    pub fn is_proved(&self) -> bool {
        matches!(self, Self::Proved(_))
    }
}

impl fmt::Display for Uniqueness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Proved(_) => f.write_str("proved"),
            Self::Refuted(_) => f.write_str("refuted: for some q there is none, or several"),
            Self::Open(reason) => write!(f, "not decided, because {reason}"),
        }
    }
}

/// Why neither uniqueness nor its contrary is proved.
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::{Reason, Uniqueness, uniqueness};
///
/// // Unique it is: the determinants are −3, all of one sign. But the theorem asks for an M-matrix.
/// let a = FivePoint::new(2, 1, [0.0, -2.0, 1.0, -2.0, 0.0])?;
/// assert_eq!(uniqueness(&a, &a)?, Uniqueness::Open(Reason::NoMMatrix));
/// assert_eq!(Reason::NoMMatrix.to_string(), "neither A nor B is a nonsingular M-matrix");
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// Entries beside the diagonals are positive, and there is neither of the witnesses, as far as
    /// was found.
    Signs,
    /// Neither `A` nor `B` is a nonsingular M-matrix, so that the theorem says nothing.
    NoMMatrix,
    /// A choice of columns is singular as far as double precision can tell, or something
    /// overflowed.
    Rounding,
    /// The clock was up.
    TimeLimit,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Signs => "no witness was found, and entries beside the diagonals are positive",
            Self::NoMMatrix => "neither A nor B is a nonsingular M-matrix",
            Self::Rounding => {
                "a choice of columns of A and B is singular within rounding, or a number overflowed"
            }
            Self::TimeLimit => "the time limit was reached",
        })
    }
}

/// A proof that HLCP(A, B, q) has no solution or several for some `q`.
///
/// Two choices of columns of `A` and `B`, both without a positive entry beside the diagonal. One,
/// `J`, is a nonsingular M-matrix, because `v > 0` and `Jᵀv > 0`. The other, `K`, is none, because
/// `Kᵀu ≤ 0` for a `u ≥ 0` that is not 0. A mixture of both is singular on the way from one to the
/// other, so that not all choices have determinants of one sign.
///
/// ```
/// use hlcp_core::{FivePoint, Identity};
/// use hlcp_verify::{Disproof, Uniqueness, uniqueness};
///
/// let (a, b) = (FivePoint::new(2, 1, [0.0, -2.0, 1.0, -2.0, 0.0])?, Identity { order: 2 });
/// let Uniqueness::Refuted(disproof) = uniqueness(&a, &b)? else { panic!("det A < 0 < det B") };
/// let by_hand = Disproof {
///     m_matrix: vec![true, true], // the columns of B
///     v: vec![1.0, 1.0],
///     other: vec![false, false], // those of A, whose sums are −1
///     u: vec![1.0, 1.0],
/// };
/// assert_eq!(disproof, by_hand);
/// assert!(by_hand.holds::<f64>(&a, &b) && !by_hand.holds::<f64>(&b, &b));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Disproof {
    /// For each column of `J` whether it is that of `B`.
    pub m_matrix: Vec<bool>,
    /// The vector `v`.
    pub v: Vec<f64>,
    /// For each column of `K` whether it is that of `B`.
    pub other: Vec<bool>,
    /// The vector `u`.
    pub u: Vec<f64>,
}

impl Disproof {
    /// Returns whether it proves what it says of this `A` and `B`, in real numbers: sums are
    /// rounded outward, and where rounding would decide they are exact.
    ///
    /// # Panics
    ///
    /// Unless all orders agree.
    pub fn holds<T: Scalar>(&self, a: &impl Rows<T>, b: &impl Rows<T>) -> bool {
        assert_eq!(a.order(), b.order(), "A and B of one order");
        assert_lengths(a.order(), [("m_matrix", self.m_matrix.len()), ("v", self.v.len())]);
        assert_lengths(a.order(), [("other", self.other.len()), ("u", self.u.len())]);
        self.proves(&Transposed::new(a, b))
    }

    fn proves(&self, columns: &Transposed) -> bool {
        let Self { m_matrix, v, other, u } = self;
        let are_z = |choice: &[bool]| (0..v.len()).all(|j| columns.is_z(choice[j].into(), j));
        let mut g = vec![];
        // Nothing is said of a pair with an entry that is no number, in whatever column.
        columns.is_finite()
            && are_z(m_matrix)
            && are_z(other)
            && is_regular(columns, m_matrix, v)
            && u.iter().all(|&u| u >= 0.0)
            && u.iter().any(|&u| u > 0.0)
            && (0..u.len()).all(|j| is_nonpositive(columns, other[j].into(), j, u, &mut g))
    }
}

/// Decides whether HLCP(A, B, q) has exactly one solution for every `q`.
///
/// Where no entry of `A` and `B` beside their diagonals is positive and one of them is a
/// nonsingular M-matrix, the question is decided, rounding apart. For other signs uniqueness is
/// proved where the comparison matrices or Ω = D_A D_B⁻¹ allow it. `docs/theory.md` has the proofs.
///
/// # Cost
///
/// `A` and `B` are stored by columns. Where column sums of the comparison matrices are not all
/// positive, a few systems are solved, seldom more than a dozen: by a sparse LU factorisation up to
/// 100,000 unknowns, by algebraic multigrid beyond.
///
/// # Errors
///
/// What [`LinearOperator::check`](hlcp_core::LinearOperator::check) of `a` or `b` refuses;
/// [`Error::Order`] when `b` does not fit `a`.
///
/// ```
/// use hlcp_verify::{Slider, Uniqueness, Witness, uniqueness};
///
/// let (a, b, _) = Slider { cells: 20 }.pose::<f64>()?;
/// assert!(matches!(uniqueness(&a, &b)?, Uniqueness::Proved(Witness::Left { .. })));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn uniqueness<T: Scalar>(
    a: &(impl Rows<T> + ?Sized),
    b: &(impl Rows<T> + ?Sized),
) -> Result<Uniqueness, Error> {
    uniqueness_within(a, b, &mut Clock::endless())
}

/// As [`uniqueness`], or [`Reason::TimeLimit`] when the clock is up first.
///
/// A factorisation does not look at the clock.
///
/// # Errors
///
/// As [`uniqueness`].
///
/// ```
/// use hlcp_methods::Clock;
/// use hlcp_verify::{Reason, Slider, Uniqueness, uniqueness_within};
///
/// let (a, b, _) = Slider { cells: 20 }.pose::<f64>()?;
/// let mut late = || true;
/// let found = uniqueness_within(&a, &b, &mut Clock::new(&mut late))?;
/// assert_eq!(found, Uniqueness::Open(Reason::TimeLimit));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn uniqueness_within<T: Scalar>(
    a: &(impl Rows<T> + ?Sized),
    b: &(impl Rows<T> + ?Sized),
    clock: &mut Clock<'_>,
) -> Result<Uniqueness, Error> {
    let (a, b) = (&a, &b);
    check_pair(a, b)?;
    let columns = Transposed::new(a, b);
    let is_z = (0..a.order()).all(|j| columns.is_z(0, j) && columns.is_z(1, j));
    let reason = match search(&columns, clock) {
        Found::Common(v) => return Ok(Uniqueness::Proved(Witness::Left { v })),
        Found::Differ(disproof) if disproof.proves(&columns) => {
            return Ok(Uniqueness::Refuted(disproof));
        }
        _ if !is_z => Reason::Signs,
        Found::Neither => Reason::NoMMatrix,
        _ => Reason::Rounding,
    };
    // Of a pair without positive entries beside the diagonals it would be a witness from the left.
    if !is_z && let Some(omega) = ratio(a, b) {
        let coupled = Coupled { a, b, omega, against: Against::Pair };
        if let Answer::Yes(d) = radius_below_one(&coupled, clock) {
            return Ok(Uniqueness::Proved(Witness::Right { omega: coupled.omega, d }));
        }
    }
    Ok(Uniqueness::Open(if clock.is_up() { Reason::TimeLimit } else { reason }))
}

/// The result of a search for a `v > 0` with `Zᵀv > 0` for two Z-matrices, whose columns come as
/// rows.
pub(crate) enum Found {
    /// Such a vector.
    Common(Vec<f64>),
    /// A choice of columns that is a nonsingular M-matrix, and one that is none.
    Differ(Disproof),
    /// Neither of the two is a nonsingular M-matrix.
    Neither,
    /// Rounding or the clock ended the search.
    Open,
}

/// The proved kind of a choice of columns.
enum Kind {
    /// A nonsingular M-matrix, by a `v > 0` with `Jᵀv > 0`.
    Regular(Vec<f64>),
    /// None, by a `u ≥ 0`, not 0, with `Jᵀu ≤ 0`.
    Other(Vec<f64>),
}

/// Howard's policy iteration over the choices of columns.
///
/// In exact arithmetic no choice comes twice: `v` grows. So one that does ends the search.
pub(crate) fn search(z: &impl Comparison, clock: &mut Clock<'_>) -> Found {
    let mut right = vec![1.0; z.order()];
    let mut choice = vec![false; z.order()];
    if worst_columns(z, &right).is_none() {
        return Found::Common(right);
    }
    let (mut met, mut regular, mut other) = (HashSet::new(), None, None);
    while !clock.is_up() && met.insert(choice.clone()) {
        match kind(z, &choice, &mut right, clock) {
            Some(Kind::Regular(v)) => {
                if let Some((other, u)) = other {
                    return Found::Differ(Disproof { m_matrix: choice, v, other, u });
                }
                let Some(next) = worst_columns(z, &v) else { return Found::Common(v) };
                regular = Some((std::mem::replace(&mut choice, next), v));
            }
            Some(Kind::Other(u)) => {
                if let Some((m_matrix, v)) = regular {
                    return Found::Differ(Disproof { m_matrix, v, other: choice, u });
                }
                if other.is_some() {
                    return Found::Neither;
                }
                let second = vec![true; choice.len()];
                other = Some((std::mem::replace(&mut choice, second), u));
            }
            None => return Found::Open,
        }
    }
    Found::Open
}

/// For each unknown whether the column of `B` is worse for `v > 0`, unless `v` proves that all
/// choices are nonsingular M-matrices.
fn worst_columns(z: &impl Comparison, v: &[f64]) -> Option<Vec<bool>> {
    let (mut g, mut serves) = (vec![], true);
    let mut is_worse = |j: usize| {
        let [a, b] = [0, 1].map(|k| margin(z, k, j, v, &mut g));
        serves &= a > 0.0 && b > 0.0;
        b < a
    };
    let choice = (0..v.len()).map(&mut is_worse).collect();
    (!serves).then_some(choice)
}

/// Decides whether a choice is a nonsingular M-matrix, from `w = D·right`; `None` if rounding
/// forbids it or the clock is up.
///
/// `right` is replaced where it does not serve.
fn kind(
    z: &impl Comparison,
    choice: &[bool],
    right: &mut Vec<f64>,
    clock: &mut Clock<'_>,
) -> Option<Kind> {
    /// A shift of the diagonal, in its units, of a matrix that may be singular.
    const SHIFT: f64 = 1e-8;
    let none = |u| supported(z, choice, u).map(Kind::Other);
    // The sums of columns that conserve something are exactly zero: no solve would show that.
    if let found @ Some(_) = none(vec![1.0; choice.len()]) {
        return found;
    }
    for last in [false, true] {
        let v = solve(z, choice, right, 0.0, clock)?;
        if is_regular(z, choice, &v) {
            return Some(Kind::Regular(v));
        }
        let negative: Vec<f64> = v.iter().map(|v| (-v).max(0.0)).collect();
        if let found @ Some(_) = none(negative) {
            return found;
        }
        if last {
            break;
        }
        // Nearly the left Perron vector: the null vector if the choice is singular.
        for _ in 0..2 {
            let v = solve(z, choice, right, SHIFT, clock)?;
            let largest = v.iter().copied().fold(0.0, f64::max);
            *right = v.iter().map(|v| v / largest).collect();
            if !positive(right) {
                return None;
            }
        }
        let whole = (1..1000)
            .map(f64::from)
            .find(|k| right.iter().all(|x| (x * k - (x * k).round()).abs() < 1e-6));
        if let Some(found) =
            whole.and_then(|k| none(right.iter().map(|x| (x * k).round()).collect()))
        {
            return Some(found);
        }
    }
    None
}

/// The solution of `(J + shift·D)ᵀv = D·right`, where D is the diagonal of J; NaN where that is
/// impossible, and `None` when the clock is up.
fn solve(
    z: &impl Comparison,
    choice: &[bool],
    right: &[f64],
    shift: f64,
    clock: &mut Clock<'_>,
) -> Option<Vec<f64>> {
    let matrix = scaled(z, |j| choice[j].into(), right, 1.0 + shift, clock)?;
    // No row of the residual, in units of the norm of e, shall be half of that of e.
    let half = 0.5 / (right.len() as f64).sqrt();
    let factor = matrix.solve(1.0, half, clock);
    Some(right.iter().zip(factor).map(|(x, y)| x * y).collect())
}

/// Entry `j` of `Z_kᵀv` in units of the diagonal, rounded downward; it has the sign of what is
/// proved.
fn margin(z: &impl Comparison, k: usize, j: usize, v: &[f64], g: &mut Vec<(usize, f64)>) -> f64 {
    let (mut sum, diagonal) = (Doubled::default(), z.row(k, j, g));
    sum.add(diagonal, v[j]);
    g.iter().for_each(|&(i, g)| sum.add(-g, v[i]));
    if diagonal > 0.0 { sum.interval().lower / diagonal } else { f64::NEG_INFINITY }
}

/// Returns whether `v > 0` and `Jᵀv > 0`.
fn is_regular(z: &impl Comparison, choice: &[bool], v: &[f64]) -> bool {
    let mut g = vec![];
    positive(v) && (0..v.len()).all(|j| margin(z, choice[j].into(), j, v, &mut g) > 0.0)
}

/// Returns whether entry `j` of `Z_kᵀu` is at most 0, for `u ≥ 0`.
fn is_nonpositive(
    z: &impl Comparison,
    k: usize,
    j: usize,
    u: &[f64],
    g: &mut Vec<(usize, f64)>,
) -> bool {
    let diagonal = z.row(k, j, g);
    let terms = [(diagonal, u[j])].into_iter().chain(g.iter().map(|&(i, g)| (-g, u[i])));
    sign(terms).is_some_and(|sign| sign.is_le())
}

/// A part of `u ≥ 0` with `Jᵀu ≤ 0` that is not 0, if there is one.
///
/// Entries whose columns contradict are set to 0, until none is left that does. In the column of
/// a zero nothing contradicts: entries beside the diagonal are not positive.
fn supported(z: &impl Comparison, choice: &[bool], mut u: Vec<f64>) -> Option<Vec<f64>> {
    let (mut g, mut stable) = (vec![], false);
    let mut places: Vec<usize> = (0..u.len()).filter(|&j| u[j] > 0.0).collect();
    while !stable {
        let before = places.len();
        places.retain(|&j| {
            let stays = is_nonpositive(z, choice[j].into(), j, &u, &mut g);
            if !stays {
                u[j] = 0.0;
            }
            stays
        });
        stable = places.len() == before;
        // What is given up spreads along the rows, forward in one pass and backward in the next.
        places.reverse();
    }
    (!places.is_empty()).then_some(u)
}
