//! Modulus-based matrix splitting methods for horizontal linear complementarity problems: find
//! `z, r ≥ 0` with `zᵀ r = 0` and `A z − B r + q = 0`.
//!
//! * [`Mms`], [`Amms`] and [`Tmms`] are the methods of Zheng and Vong's paper, each on any operators that
//!   its splittings can work with; [`Named`] finds them by the paper's names.
//! * [`Anderson`] accelerates any of them, and [`Newton`] solves the linear piece an iterate lies on, with a
//!   [`Preconditioner`] and one of them to fall back on.
//! * A [`Method`] is a few public steps; [`Solver`] iterates one within [`Limits`] and reports an
//!   [`Outcome`].
//!
//! No matrix is formed anywhere.

mod adaptive;
mod amms;
mod anderson;
mod auto;
mod krylov;
mod limits;
mod method;
mod mixed;
mod mms;
mod multigrid;
mod named;
mod newton;
mod outcome;
mod solver;
mod tmms;
mod watch;

pub use adaptive::AdaptiveSor;
pub use amms::Amms;
pub use anderson::Anderson;
pub use auto::Auto;
pub use krylov::{Preconditioner, Ssor, TridiagonalPart};
pub use limits::{Limits, Norm};
pub use method::Method;
pub use mixed::solve_mixed;
pub use mms::Mms;
pub use multigrid::{Coarsen, Cycle, FullMultigrid, Grids, Multigrid, Rediscretise};
pub use named::{NameError, Named, Parameters};
pub use newton::{Jacobian, Newton};
pub use outcome::{Divergence, Outcome, Status};
pub use solver::{Progress, Solver};
pub use tmms::Tmms;
pub use watch::{GROWTH, PATIENCE};

/// The programs of the READMEs, compiled and run with the documentation's other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
#[doc = include_str!("../../../README.md")]
struct Readme;
