//! Oracles, planted instances and scenes with known answers for horizontal linear complementarity
//! problems: find `z, r ≥ 0` with `zᵀ r = 0` and `A z − B r + q = 0`.
//!
//! * [`oracle`]: the paper's methods, dense and from its formulas, and all solutions of a small problem.
//! * [`Planted`]: a problem built around a solution.
//! * Scenes, all matrix-free: [`Example`], the paper's Examples 1 and 2; [`Slider`], its Example 3 in kind; [`Disc`], a
//!   contact on which splitting methods crawl; and, with published answers, [`JournalBearing`], [`Obstacle`],
//!   [`Bearing2d`] and [`AmericanPut`].
//! * Does the theory cover a problem and its parameters? [`convergence`] tries every theorem;
//!   [`theorem_1`], [`theorem_2`], [`relaxed_theorem`], [`alpha_bound`] and [`classes`] say which
//!   hypothesis holds and where one fails.
//! * How far is an answer from the solution, and is there only one? [`certify`].
//!
//! Nothing here depends on `hlcp-methods`: what judges is independent of what is judged.

mod certificate;
pub mod classes;
mod comparison;
mod multigrid;
pub mod oracle;
mod pair;
mod perron;
mod planted;
mod rounding;
mod scenes;
mod steps;
mod theory;

pub use certificate::{Certificate, Witness, certify, certify_with};
pub use perron::Bracket;
pub use planted::Planted;
pub use scenes::{AmericanPut, Bearing2d, Disc, Example, JournalBearing, Obstacle, Posed, Slider};
pub use steps::{AorStep, Contraction};
pub use theory::{
    Convergence, Proof, Theorem1, Theorem2, alpha_bound, convergence, relaxed_alpha_bound,
    relaxed_theorem, theorem_1, theorem_2,
};

/// The README's program, compiled and run with the documentation's other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
