//! Proofs about horizontal linear complementarity problems, `z, r ≥ 0` with `zᵀ r = 0` and
//! `A z − B r + q = 0`, by machine; and problems with known answers.
//!
//! # Certify an answer
//!
//! [`certify`] proves that a solution exists near an answer and bounds the distance from it,
//! whatever computed the answer. [`uniqueness`] proves that the solution is the only one, or that
//! it is not for every `q`.
//!
//! ```
//! use hlcp_core::{FivePoint, Identity};
//! use hlcp_verify::certify;
//!
//! let (a, b) = (FivePoint::new(3, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?, Identity { order: 3 });
//! let guess = ([0.501, 0.0, 1.5], [0.0, 3.001, 0.0]); // of z = (½, 0, 3/2), r = (0, 3, 0)
//! let certificate = certify(&a, &b, &[-2.0, 5.0, -6.0], &guess.0, &guess.1)?;
//! let error = certificate.expect("a dominant pair has a witness").error();
//! assert!((0.001..0.01).contains(&error));
//! # Ok::<(), hlcp_core::Error>(())
//! ```
//!
//! [`certify_by`] takes the method that found the answer, which costs less.
//!
//! # Prove convergence before a solve
//!
//! * [`convergence`] tries every theorem on the steps of a method and returns the one that proves
//!   convergence, with the factor per iteration.
//! * [`theorem_1`], [`theorem_2`] and [`relaxed_theorem`] answer hypothesis by hypothesis.
//! * [`alpha_bound`] and [`relaxed_alpha_bound`] say how large α may be.
//! * [`classes`] says whether a matrix is Z, M, H or H₊.
//!
//! ```
//! use hlcp_methods::{Aor, FivePoint, Hlcp, Tmms};
//! use hlcp_verify::{Convergence, alpha_bound, convergence};
//!
//! let a = FivePoint::new(32, 32, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
//! let b = FivePoint::new(32, 32, [0.0, -1.0, 8.0, -1.0, 0.0])?;
//! let problem = Hlcp::from_pair(a, b)?;
//! let tmsor = Tmms::mirrored(problem.clone(), Aor::sor(1.2)?)?;
//! let proof = convergence(&problem, &tmsor.steps());
//! let Convergence::Proved(theorem, contraction) = proof else { panic!() };
//! println!("{theorem:?}: the error falls by {} per iteration or faster", contraction.factor);
//! assert!(alpha_bound(&problem).reciprocal()[0] > 1.33);
//! # Ok::<(), hlcp_core::Error>(())
//! ```
//!
//! # Test problems
//!
//! * [`Planted`] builds a problem around a solution. [`oracle`] has the paper's methods, dense and
//!   from its formulas, and finds all solutions of a small problem.
//! * Scenes, each a few numbers, matrix-free: [`Example`], the paper's Examples 1 and 2;
//!   [`Slider`], its Example 3 in kind; [`Disc`], a contact on which splitting methods crawl; and,
//!   with published answers, [`JournalBearing`], [`Obstacle`], [`Membrane`], [`Bearing2d`],
//!   [`Dam`] and [`AmericanPut`];
//!   and [`Film`], any lubricating film over a rectangle.
//!
//! Candidates for witnesses and for corrections come from a sparse LU factorisation or from the
//! multigrid of `hlcp-methods`. No proof rests on these: every claim is checked by products that
//! are rounded outward, or exact.
//!
//! # Not supported
//!
//! * Operators without rows: every proof reads the entries.
//! * Pairs outside the classes of the theorems. Without a witness or a [`Disproof`] nothing is
//!   claimed, which does not mean that the problem has no solution or several.
//! * Proofs of convergence for methods beyond the paper. Their answers can be certified.

mod certificate;
pub mod classes;
mod comparison;
mod decimal;
mod enclosure;
pub mod families;
pub mod oracle;
mod perron;
mod planted;
mod rounding;
mod scenes;
mod sparse;
mod steps;
mod theory;
mod uniqueness;

pub use certificate::{
    Branch, Certificate, certify, certify_box, certify_by, certify_range, certify_within,
};
pub use decimal::{decimal, fixed};
pub use enclosure::Refusal;
pub use perron::Bracket;
pub use planted::Planted;
pub use scenes::{
    AmericanPut, Bearing2d, Columns, Dam, Disc, Example, Film, FilmChange, FilmFigures, FilmSlopes,
    JournalBearing, Membrane, Obstacle, Posed, ProvedFigures, Side, Slider, Supply, TimeStep,
};
pub use steps::Contraction;
pub use theory::{
    Convergence, Proof, Theorem1, Theorem2, alpha_bound, convergence, convergence_within,
    relaxed_alpha_bound, relaxed_theorem, theorem_1, theorem_2,
};

pub use uniqueness::{Disproof, Reason, Uniqueness, Witness, uniqueness, uniqueness_within};

/// The README's program, compiled and run with the documentation's other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// The guide's programs.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide.md")]
struct Guide;
