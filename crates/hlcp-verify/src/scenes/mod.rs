//! Problems with known answers, each a few numbers that define it.

use hlcp_core::{Error, FivePoint, Varying};

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
pub use film::{
    Film, FilmChange, FilmFigures, FilmRange, FilmSlopes, ProvedFigures, Side, Supply, TimeStep,
};
pub use journal_bearing::JournalBearing;
pub use membrane::Membrane;
pub use obstacle::Obstacle;
pub use slider::Slider;

/// A and B on a grid, with coefficients that vary, and q.
type Grids<T> = (FivePoint<Varying<T>>, FivePoint<Varying<T>>, Vec<T>);

/// Refuses a parameter outside `range`, which `inside` says in code.
fn check(name: &'static str, value: f64, inside: bool, range: &'static str) -> Result<(), Error> {
    if inside { Ok(()) } else { Err(Error::Parameter { name, value, range }) }
}

/// Refuses a parameter that is not positive and finite.
fn positive(name: &'static str, value: f64) -> Result<(), Error> {
    check(name, value, value > 0.0 && value.is_finite(), "positive and finite")
}
