//! Lubricating films as a library, in SI units: from gaps to figures, positions and motions.
//!
//! | you have | take |
//! |---|---|
//! | a gap over a rectangle or a ring | [`Film`], with its [`Side`]s and [`Supply`]s |
//! | a gap along a line | [`Profile`] |
//! | a map in a file; a pad; pockets and dimples | [`Map`]; [`Pad`]; [`Pocket`] |
//! | a journal, or a wall that may rise and tilt | [`Bearing`], [`Journal`]; [`Lobes`] |
//!
//! | you want | take |
//! |---|---|
//! | pressures and film content | [`Solved`] |
//! | load, friction, flows, peak | [`Film::figures`], and [`Film::proved_figures`] with a proof |
//! | Sommerfeld and Reynolds number, torque, how warm the oil gets | [`Bearing::derived`] |
//! | what is doubtful about a film | [`Words::warnings`] |
//! | the position that carries a load | [`Bearing::carry`] |
//! | stiffness and damping, also at a frequency | [`Coefficients`] |
//! | the mass at which a rotor begins to whirl | [`Threshold`] |
//! | derivatives by speed, clearance, viscosity, pressures and depths | [`Bearing::sensitivities`] |
//! | steps in time, the orbit of a free journal | [`Motion`] |
//!
//! ```
//! use hlcp::film::{Bearing, Journal, Load, Settings, Side, Supply};
//!
//! // 100 mm by 100 mm, 0.1 mm wide, 3000 turns a minute, fed by a groove at the widest gap.
//! let mut bearing = Bearing::journal(Journal::round(0.1, 0.1, 1e-4), [180, 30]);
//! bearing.film.speeds = [std::f64::consts::PI * 0.1 * 50.0, 0.0];
//! bearing.film.viscosity = vec![0.02];
//! bearing.film.supplies = vec![Supply { corner: [0.0; 2], size: [0.0, 0.1], pressure: 0.0 }];
//! bearing.position = vec![5e-5, 0.0];
//! let carried = bearing.carry(&Load::of(5000.0), None, &Settings::default())?;
//! assert!(carried.found && (bearing.position[0] / 1e-4 - 0.244362).abs() < 1e-6);
//! # Ok::<(), hlcp::film::FilmError>(())
//! ```
//!
//! The problem that is solved, with its figures and the proofs of these, is `Film`, which belongs
//! to `hlcp-verify`. A wall that moves and what is searched for stand here.

mod carry;
mod derived;
mod doubts;
mod linear;
mod map;
mod motion;
mod profile;
mod search;
mod sensitivity;
mod shape;
mod solve;
mod wall;
mod whirl;

pub use carry::{Carried, Load};
pub use derived::{Derived, Oil};
pub use doubts::Words;
pub use hlcp_verify::{
    Film, FilmChange, FilmFigures, FilmSlopes, ProvedFigures, Side, Supply, TimeStep,
};
pub use map::Map;
pub use motion::{Drive, Motion};
pub use profile::{Line, Profile};
pub use sensitivity::{Parameter, Sensitivity};
pub use shape::{Journal, Lobes, Pad, Pocket};
pub use solve::{Coefficients, FilmError, Settings, Solved, Watch};
pub use wall::{Bearing, Idle};
pub use whirl::Threshold;
