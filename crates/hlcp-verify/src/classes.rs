//! The matrix classes of the paper's section 1, each answer with its witness.
//!
//! One walk over the rows decides Z and strict dominance. H and what follows from it is decided by
//! Noda's iteration for the spectral radius of `|D_A|⁻¹|C_A|`: below 1, its vector `d` is the
//! diagonal of a `D` for which ⟨A⟩D is strictly diagonally dominant (Remark 1 of the paper).
//!
//! # Cost
//!
//! A dominant matrix needs one walk and no storage. The search for another `d` stores the matrix;
//! the check of what it finds is one walk again.
//!
//! # Panics
//!
//! [`is_z`], [`is_h`], [`is_h_plus`] and [`is_m`] panic for what the operator's own
//! [`check`](hlcp_core::LinearOperator::check) refuses, as a matrix that is not square.

use std::fmt;

use hlcp_core::{Error, Rows, Scalar};
use hlcp_methods::Clock;

use crate::{
    comparison::{Modulus, check_pair, visit},
    decimal::fixed,
    perron::{Bracket, Comparison, noda},
    rounding::Interval,
};

/// The answer to a question about a problem.
///
/// `Yes` and `No` hold for the real numbers that the operators' entries stand for, rounding
/// included.
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::classes::{Answer, is_m};
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 2.0, -3.0, 0.0])?; // not dominant: |−3| > 2
/// match is_m::<f64>(&a) {
///     // Ad > 0, as for (7, 4)
///     Answer::Yes(d) => assert!(2.0 * d[0] > 3.0 * d[1] && 2.0 * d[1] > d[0]),
///     Answer::No(failure) => panic!("{failure}"),
///     Answer::Undecided => panic!("the budget is used up"),
/// }
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Answer<W = ()> {
    /// It is so, and this proves it.
    Yes(W),
    /// It is not, and this is where it fails.
    No(Failure),
    /// Neither was proved within the budget.
    Undecided,
}

impl<W> Answer<W> {
    /// Returns whether it was proved.
    pub fn is_yes(&self) -> bool {
        matches!(self, Self::Yes(_))
    }

    /// The answer to the next question, if this one is yes.
    pub(crate) fn then<V>(self, next: impl FnOnce() -> Answer<V>) -> Answer<V> {
        match self {
            Self::Yes(_) => next(),
            Self::No(failure) => Answer::No(failure),
            Self::Undecided => Answer::Undecided,
        }
    }
}

/// Why an answer is no.
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::classes::{Answer, is_h};
///
/// let a = FivePoint::new(2, 1, [0.0, -2.0, 1.0, 2.0, 0.0])?;
/// let Answer::No(failure) = is_h::<f64>(&a) else {
///     panic!("|D|⁻¹|C| has the spectral radius 2")
/// };
/// assert_eq!(
///     failure.to_string(),
///     "a spectral radius is at least 1.999999, too large for the parameters"
/// );
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Failure {
    /// The first entry, row by row, that violates the condition; row and column agree where a row
    /// does.
    Entry {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// A spectral radius that would have to be below 1 is at least this.
    Radius(f64),
    /// The determinants of two choices of columns differ in sign.
    Signs,
    /// A parameter lies outside the range.
    Parameter(&'static str),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Entry { row, column } => write!(f, "entry ({row}, {column}) fails"),
            Self::Radius(lower) => {
                let lower = fixed(*lower, 6, false);
                write!(f, "a spectral radius is at least {lower}, too large for the parameters")
            }
            Self::Signs => f.write_str("the determinants of two choices of columns differ in sign"),
            Self::Parameter(range) => write!(f, "the parameters are not {range}"),
        }
    }
}

/// Returns whether all off-diagonal entries are at most 0.
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::classes::{Answer, Failure, is_z};
///
/// let a = FivePoint::new(3, 1, [0.0, -1.0, 4.0, 0.5, 0.0])?;
/// assert_eq!(is_z::<f64>(&a), Answer::No(Failure::Entry { row: 0, column: 1 }));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn is_z<T: Scalar>(a: &(impl Rows<T> + ?Sized)) -> Answer {
    // Of a stencil, all rows are seen in one.
    if let Some([s, w, c, e, n]) = a.as_five_point().and_then(|view| view.constants())
        && [s, w, e, n].iter().all(|&entry| entry <= T::zero() && entry.is_finite())
        && c.is_finite()
    {
        return Answer::Yes(());
    }
    all_entries(&a, |row, column, a| row == column || a <= 0.0)
}

/// Returns whether ⟨A⟩ is a nonsingular M-matrix; yes with a `d > 0` such that `⟨A⟩d > 0`.
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::classes::{Answer, Failure, is_h};
///
/// let a = FivePoint::new(3, 1, [0.0, -1.0, 2.0, 1.0, 0.0])?;
/// let Answer::Yes(d) = is_h::<f64>(&a) else {
///     panic!("an H-matrix that is not strictly dominant")
/// };
/// assert!(2.0 * d[1] > d[0] + d[2]);
///
/// let b = FivePoint::new(3, 1, [0.0, -1.0, 1.0, 1.0, 0.0])?;
/// assert!(matches!(is_h::<f64>(&b), Answer::No(Failure::Radius(lower)) if lower >= 1.0));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn is_h<T: Scalar>(a: &(impl Rows<T> + ?Sized)) -> Answer<Vec<f64>> {
    is_h_within(&a, &mut Clock::endless())
}

fn is_h_within<T: Scalar>(a: &impl Rows<T>, clock: &mut Clock<'_>) -> Answer<Vec<f64>> {
    let finite = all_entries(a, |_, _, _| true);
    let sound = || sound_diagonal(a, f64::abs);
    finite.then(sound).then(|| radius_below_one(&Modulus(a), clock))
}

/// Returns whether `A` is an H-matrix with a positive diagonal; the witness is that of [`is_h`].
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::classes::{Answer, Failure, is_h_plus};
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, -4.0, 1.0, 0.0])?;
/// assert_eq!(is_h_plus::<f64>(&a), Answer::No(Failure::Entry { row: 0, column: 0 }));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn is_h_plus<T: Scalar>(a: &(impl Rows<T> + ?Sized)) -> Answer<Vec<f64>> {
    is_h_plus_within(&a, &mut Clock::endless())
}

/// As [`is_h_plus`], undecided when the clock is up.
pub(crate) fn is_h_plus_within<T: Scalar>(
    a: &impl Rows<T>,
    clock: &mut Clock<'_>,
) -> Answer<Vec<f64>> {
    sound_diagonal(a, |entry| entry).then(|| is_h_within(a, clock))
}

/// Returns whether `A` is a nonsingular M-matrix: an H₊-matrix that is a Z-matrix; the witness is
/// that of [`is_h`].
///
/// ```
/// use hlcp_core::FivePoint;
/// use hlcp_verify::classes::is_m;
///
/// let laplacian = FivePoint::new(9, 9, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// assert!(is_m::<f64>(&laplacian).is_yes());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn is_m<T: Scalar>(a: &(impl Rows<T> + ?Sized)) -> Answer<Vec<f64>> {
    is_z(a).then(|| is_h_plus(a))
}

/// Returns whether `A` and `B` have the W-property: whichever column of the two is chosen in each
/// place, the determinant has one sign and is not 0. That is so exactly if `A z − B r + q = 0` has
/// one solution for every `q` (Sznajder and Gowda, Linear Algebra Appl. 223/224 (1995) 695–715).
///
/// All 2ⁿ choices are tried, which have most of an elimination in common, in interval arithmetic.
/// A determinant of 0 is not told from one near it, and leaves the question undecided unless others
/// answer it. [`uniqueness`](fn@crate::uniqueness) looks for a proof at any order.
///
/// # Errors
///
/// What [`LinearOperator::check`](hlcp_core::LinearOperator::check) of `a` or `b` refuses;
/// [`Error::Order`] when `b` does not fit `a`, [`Error::Parameter`] for an order above 20.
///
/// ```
/// use hlcp_core::RowMajor;
/// use hlcp_verify::classes::{Answer, Failure, has_w_property, is_h_plus};
///
/// // Both are H₊, which the paper takes to suffice.
/// let a = RowMajor::new(2, &[1.0, -2.0, 0.0, 1.0])?;
/// let b = RowMajor::new(2, &[1.0, 0.0, -2.0, 1.0])?;
/// assert!(is_h_plus(&a).is_yes() && is_h_plus(&b).is_yes());
/// assert_eq!(has_w_property(&a, &b)?, Answer::No(Failure::Signs));
/// assert!(has_w_property(&a, &a)?.is_yes());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn has_w_property<T: Scalar>(
    a: &(impl Rows<T> + ?Sized),
    b: &(impl Rows<T> + ?Sized),
) -> Result<Answer, Error> {
    let (a, b) = (&a, &b);
    check_pair(a, b)?;
    let n = a.order();
    if n > 20 {
        let range = "at most 20, for which there are a million choices of columns";
        return Err(Error::Parameter { name: "the order", value: n as f64, range });
    }
    let mut columns = vec![[(); 2].map(|()| vec![Interval::exactly(0.0); n]); n];
    (0..n).for_each(|row| {
        visit(a, row, |column, a| columns[column][0][row] = Interval::exactly(a));
        visit(b, row, |column, b| columns[column][1][row] = Interval::exactly(b));
    });
    let mut found = Signs::default();
    found.add(&columns, true);
    Ok(match found {
        Signs { positive: true, negative: true, .. } => Answer::No(Failure::Signs),
        Signs { open: true, .. } => Answer::Undecided,
        _ => Answer::Yes(()),
    })
}

/// The signs that determinants have; `open` if one was not decided.
#[derive(Default)]
struct Signs {
    positive: bool,
    negative: bool,
    open: bool,
}

impl Signs {
    /// Adds the signs of all choices from pairs of columns, times a sign. Eliminates either column
    /// of the first pair from all others, by its largest entry.
    fn add(&mut self, columns: &[[Vec<Interval>; 2]], is_positive: bool) {
        let Some((pair, rest)) = columns.split_first() else {
            return *(if is_positive { &mut self.positive } else { &mut self.negative }) = true;
        };
        for column in pair {
            let size = |k: usize| column[k].mignitude();
            let pivot = (0..column.len()).max_by(|&j, &k| size(j).total_cmp(&size(k))).unwrap_or(0);
            if size(pivot) == 0.0 || column[pivot].magnitude().is_infinite() {
                self.open = true;
                continue;
            }
            let sign = if column[pivot].lower > 0.0 { 1.0 } else { -1.0 };
            let reciprocal = column[pivot].times(sign).reciprocal().times(sign);
            let others = || (0..column.len()).filter(|&k| k != pivot);
            let factors: Vec<_> = others().map(|k| (k, column[k].product(reciprocal))).collect();
            let eliminated = |other: &Vec<Interval>| {
                let entry =
                    |(k, factor): &(usize, Interval)| other[*k].minus(factor.product(other[pivot]));
                factors.iter().map(entry).collect()
            };
            let rest: Vec<_> = rest.iter().map(|pair| pair.each_ref().map(eliminated)).collect();
            // The sign of its place in the first column, too.
            self.add(&rest, is_positive == ((sign > 0.0) == (pivot % 2 == 0)));
        }
    }
}

/// Returns whether `part` of every diagonal entry is positive and finite.
fn sound_diagonal<T: Scalar>(a: &impl Rows<T>, part: fn(f64) -> f64) -> Answer {
    let entry = |i: usize| part(a.diagonal_entry(i).wide());
    let unsound = (0..a.order()).find(|&i| !(entry(i) > 0.0 && entry(i).is_finite()));
    unsound.map_or(Answer::Yes(()), |row| Answer::No(Failure::Entry { row, column: row }))
}

/// The first stored entry that is not finite, in no column or for which `holds(i, j, aᵢⱼ)` is
/// false.
pub(crate) fn all_entries<T: Scalar>(
    a: &impl Rows<T>,
    holds: impl Fn(usize, usize, f64) -> bool,
) -> Answer {
    if let Err(error) = a.check("the matrix") {
        panic!("{error}");
    }
    let n = a.order();
    for row in 0..n {
        let mut first = None;
        visit(a, row, |column, a| {
            let is_sound = a.is_finite() && column < n;
            if first.is_none() && !(is_sound && holds(row, column, a)) {
                first = Some(Failure::Entry { row, column });
            }
        });
        if let Some(failure) = first {
            return Answer::No(failure);
        }
    }
    Answer::Yes(())
}

/// Decides whether `ρ(D⁻¹G) < 1`: yes with an `x > 0` for which `Gx < Dx`.
pub(crate) fn radius_below_one(z: &impl Comparison, clock: &mut Clock<'_>) -> Answer<Vec<f64>> {
    radius(z, |upper| upper < 1.0, |lower| lower >= 1.0, clock)
}

/// Decides whether `ρ(D⁻¹G)` is below a bound, by what says so of a number not less than it, and
/// the contrary of one not more.
pub(crate) fn radius(
    z: &impl Comparison,
    below: impl Fn(f64) -> bool,
    above: impl Fn(f64) -> bool,
    clock: &mut Clock<'_>,
) -> Answer<Vec<f64>> {
    let Bracket { lower, upper, vector } =
        noda(z, |bracket| below(bracket.upper) || above(bracket.lower), clock);
    if below(upper) {
        Answer::Yes(vector)
    } else if above(lower) {
        Answer::No(Failure::Radius(lower))
    } else {
        Answer::Undecided
    }
}
