//! Problems with known answers, each a few numbers that define it.

use std::ops::Range;

use hlcp_core::{Error, FivePoint, Identity, Scalar, Varying};

mod american_put;
mod bearing2d;
mod dam;
mod disc;
mod example;
mod film;
mod journal_bearing;
mod membrane;
mod obstacle;
mod slider;

pub use american_put::AmericanPut;
pub use bearing2d::Bearing2d;
pub use dam::Dam;
pub use disc::Disc;
pub use example::{Example, Posed};
pub use film::{Film, FilmChange, FilmFigures, FilmSlopes, ProvedFigures, Side, Supply, TimeStep};
pub use journal_bearing::JournalBearing;
pub use membrane::Membrane;
pub use obstacle::Obstacle;
pub use slider::Slider;

/// A and B on a grid, with coefficients that vary, and q.
type Grids<T> = (FivePoint<Varying<T>>, FivePoint<Varying<T>>, Vec<T>);

/// The same of a membrane: A is a stencil.
type Stencil<T> = (FivePoint<T>, Identity, Vec<T>);

/// A scene on a grid, of which each of several ranks poses its own columns.
///
/// ```
/// use hlcp_verify::{Columns, Disc};
///
/// let disc = Disc { lcp: true, m: 7 };
/// let (whole, part) = (disc.pose::<f64>()?, disc.pose_columns::<f64>(2..5)?);
/// assert_eq!(part.q[3..6], whole.q[9..12]); // of the second row
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub trait Columns {
    /// What the scene's `pose` returns.
    type Posed<T: Scalar>;

    /// Poses some columns of the scene; the operators are those of a grid of as many columns.
    ///
    /// # Errors
    ///
    /// Those of `pose`.
    fn pose_columns<T: Scalar>(&self, columns: Range<usize>) -> Result<Self::Posed<T>, Error>;
}

/// Returns some columns of the operator whose row at point `(i, j)` of a grid is `row(i, j)`.
fn operator<T: Scalar>(
    columns: &Range<usize>,
    ny: usize,
    row: impl Fn(usize, usize) -> [f64; 5],
) -> Result<FivePoint<Varying<T>>, Error> {
    FivePoint::from_fn(columns.len(), ny, |i, j| row(columns.start + i, j).map(T::of))
}

/// Returns some columns of the vector whose entry at point `(i, j)` of a grid is `entry(i, j)`.
fn entries<T: Scalar>(
    columns: &Range<usize>,
    ny: usize,
    entry: impl Fn(usize, usize) -> f64,
) -> Vec<T> {
    let points = (0..ny).flat_map(|j| columns.clone().map(move |i| (i, j)));
    points.map(|(i, j)| T::of(entry(i, j))).collect()
}

/// Refuses a parameter outside `range`, which `inside` says in code.
fn check(name: &'static str, value: f64, inside: bool, range: &'static str) -> Result<(), Error> {
    if inside { Ok(()) } else { Err(Error::Parameter { name, value, range }) }
}

/// Refuses a parameter that is not positive and finite.
fn positive(name: &'static str, value: f64) -> Result<(), Error> {
    check(name, value, value > 0.0 && value.is_finite(), "positive and finite")
}
