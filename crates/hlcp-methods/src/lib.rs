//! Methods for horizontal linear complementarity problems: find `z, r ≥ 0` with `zᵀ r = 0` and
//! `A z − B r + q = 0`. They work on operators; only [`Amg`], [`Pivoting`] and
//! [`Renumbered`] assemble rows.
//!
//! # One call
//!
//! ```
//! use hlcp_methods::{FivePoint, solve};
//!
//! let a = FivePoint::new(60, 60, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
//! let b = FivePoint::new(60, 60, [0.0, -1.0, 4.0, -1.0, 0.0])?;
//! let q: Vec<f64> = (0..3600).map(|k| if k % 60 < 20 { -0.1 } else { 0.2 }).collect();
//! let answer = solve(&a, &b, &q)?.ok()?; // or an error, if it has not converged
//! assert!(answer.z[0] > 0.0 && answer.r[59] > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`solve`] poses the problem and lets [`Auto`] choose the method; [`solve_with`] takes limits, a
//! start and an observer too. This crate re-exports all of `hlcp-core`; with its feature
//! `nalgebra-sparse` nalgebra's matrices are operators.
//!
//! # The methods
//!
//! | method | when | it needs |
//! |---|---|---|
//! | [`Mms`] (AMMS too), [`Tmms`] | `z` and `r` alternate from point to point, or a theorem is wanted; by name: [`Named`] | products with a splitting of your own, rows otherwise |
//! | [`AdaptiveSor`] | no α is known: it finds one during the solve | rows |
//! | [`Multigrid`], [`FullMultigrid`] | `z` and `r` are positive on regions of a grid: the work per unknown does not grow | five-point operators |
//! | [`Newton`] | `A` and `B` are tridiagonal, with [`TridiagonalPart`]; elsewhere with [`Ssor`], [`Amg`] or a [`Preconditioner`] of your own | rows, or the preconditioner's needs |
//! | [`Pivoting`] | nothing else converges: matrices that are almost skew, plates, small full ones | rows; beyond an order of 500 the feature `direct` and memory for LU factors |
//! | [`AmgNewton`] | coefficients jump, oil is transported, or rows have no grid: textured films, rings, boxes | rows with positive diagonals |
//! | [`Anderson`] | around any other, if its iterations are slow and nothing else applies | what the other needs, and vectors |
//! | [`Auto`] | you do not want to choose | rows |
//!
//! # Step by step
//!
//! ```
//! use hlcp_methods::{Auto, FivePoint, Hlcp, Limits, Options, Solver};
//!
//! let a = FivePoint::new(60, 60, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
//! let b = FivePoint::new(60, 60, [0.0, -1.0, 4.0, -1.0, 0.0])?;
//! let problem = Hlcp::from_pair(a, b)?;
//! let q: Vec<f64> = (0..3600).map(|k| if k % 60 < 20 { -0.1 } else { 0.2 }).collect();
//!
//! let mut solver = Solver::new(Auto::new(problem)?);
//! solver.solve(&q, Options::from_x(&vec![1.0; 3600]))?.ok()?; // its outcome has the residual
//! assert!(solver.z()[0] > 0.0 && solver.r()[59] > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Wrong input is an `Err` with its numbers. An iteration that ends is an [`Outcome`]. Whatever its
//! [`Status`], its residual was measured on the `z` and `r` that the [`Solver`] holds.
//!
//! # Speed
//!
//! * Operators that answer `as_five_point` are swept in one vectorised pass over memory.
//! * A [`Solver`] owns its vectors: keep it, and a second solve allocates nothing. In a loop over
//!   time start it from the last answer.
//! * `Hlcp::in_parallel` shares the sweeps among rayon's threads, with the same bits (feature
//!   `rayon` of this crate).
//! * `f32` is the same code; [`solve_mixed`] takes the first digits in single precision.
//!
//! ```
//! use hlcp_methods::{Aor, FivePoint, Hlcp, Mms, Options, Solver};
//!
//! let problem = Hlcp::lcp(FivePoint::new(32, 32, [-1.0, -1.0, 4.5, -1.0, -1.0_f32])?)?;
//! let mut solver = Solver::new(Mms::new(problem, Aor::sor(1.3)?.accelerated())?);
//! let mut iterations = vec![];
//! for day in 0..4 {
//!     let load = |k: usize| ((k % 32) as f32 / 10.0).cos() + 0.01 * day as f32;
//!     let q: Vec<f32> = (0..1024).map(load).collect();
//!     let outcome = solver.solve(&q, Options::resume())?; // from the x of the day before
//!     assert!(outcome.converged());
//!     iterations.push(outcome.iterations);
//! }
//! assert!(iterations[1..].iter().all(|&k| k < iterations[0]));
//! # Ok::<(), hlcp_methods::Error>(())
//! ```
//!
//! # Options and extensions
//!
//! * [`Limits`] says when to stop and in which [`Norm`].
//! * An [`Options::observer`] sees every iterate as [`Progress`] and may stop the solve.
//!   [`Solver::with_history`] keeps the residuals.
//! * A [`Method`] of your own is two functions and gets all of this.
//! * Implement [`Preconditioner`] to solve with a [`Jacobian`].
//!
//! # Not supported
//!
//! * Nonlinear problems, and bounds on both sides of an unknown.
//! * Finding all solutions, or proving that there is none: such a solve ends without convergence.
//! * Multigrid on three-dimensional grids. Take [`AmgNewton`] there.
//! * Diagonals that are not positive, in some methods. Relaxations need positive pivots, diagonal
//!   entries of `A + BΩ`; multigrid and [`AmgNewton`] need positive diagonals of `A` and of `B`.
//!   [`Pivoting`], and so [`solve`] and [`Auto`], take zeros in both, as of quadratic programs, and
//!   with an Ω of yours negative entries.
//! * Graphics processors.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod adaptive;
mod amg;
mod anderson;
mod auto;
#[cfg(feature = "direct")]
mod cholesky;
#[cfg(feature = "direct")]
mod direct;
mod jacobian;
mod krylov;
mod limits;
mod method;
mod mixed;
mod mms;
mod monitor;
mod multigrid;
mod named;
mod newton;
mod options;
mod outcome;
mod pivoting;
mod renumbered;
mod safeguard;
mod solve;
mod solver;
#[cfg(test)]
mod testing;
mod tmms;
mod tolerance;

/// All of `hlcp-core`: a program that solves names one crate.
pub use hlcp_core::*;

pub use adaptive::AdaptiveSor;
pub use amg::{Amg, AmgNewton};
pub use anderson::Anderson;
pub use auto::{Auto, AutoChoice, AutoEnd, AutoTurn};
#[cfg(feature = "direct")]
pub use direct::SparseLu;
pub use jacobian::Jacobian;
pub use krylov::{Preconditioner, Ssor, TridiagonalPart};
pub use limits::{Forecast, Limits, Norm, Tolerance};
pub use method::Method;
pub use mixed::solve_mixed;
pub use mms::Mms;
#[doc(hidden)] // for tests: no promise holds for them
pub use monitor::{GROWTH, PATIENCE};
pub use multigrid::{Cycle, FullMultigrid, Multigrid};
pub use named::{BoxedMethod, DynRows, NameError, Named, Parameters};
pub use newton::Newton;
pub use options::{Clock, Options, Progress};
pub use outcome::{Divergence, NotConverged, Outcome, Status, Work};
pub use pivoting::Pivoting;
pub use renumbered::{Renumbered, cuthill_mckee};
pub use solve::{Solution, solve, solve_with};
pub use solver::Solver;
pub use tmms::Tmms;

/// The README's program, compiled and run with the documentation's other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
