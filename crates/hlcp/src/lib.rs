//! Horizontal linear complementarity problems: find `z, r ≥ 0` with `zᵀ r = 0` and
//! `A z − B r + q = 0`. One name for what programs need: the problem, its methods, proofs about its
//! answers, lubricating films, and files.
//!
//! Take it for contact, obstacles, lubricating films that cavitate, seepage, American options and
//! convex quadratic programs: two operators without negative entries on the diagonals, as matrices
//! or as products alone. It has no nonlinear problems and no bounds on both sides of an unknown.
//!
//! ```
//! use hlcp::{FivePoint, certify, solve};
//!
//! let a = FivePoint::new(60, 60, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
//! let b = FivePoint::new(60, 60, [0.0, -1.0, 4.0, -1.0, 0.0])?;
//! let q: Vec<f64> = (0..3600).map(|k| if k % 60 < 20 { -0.1 } else { 0.2 }).collect();
//! let answer = solve(&a, &b, &q)?.ok()?;
//! let certificate = certify(&a, &b, &q, &answer.z, &answer.r)??;
//! assert!(certificate.error() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Where to look
//!
//! | for | look at | from |
//! |---|---|---|
//! | operators, the problem, steps | [`LinearOperator`], [`FivePoint`], [`Csr`], [`Hlcp`], [`Aor`] | `hlcp-core` |
//! | one call, a solver, the methods | [`solve`](fn@solve), [`Solver`], [`Options`], [`Auto`], [`Named`] | `hlcp-methods` |
//! | proofs about an answer, a method, all `q` | [`certify`], [`convergence`], [`uniqueness`] | `hlcp-verify` |
//! | lubricating films, journals, pads, their loads and motions | [`film`] | here |
//! | time against accuracy of methods of your own | [`ladder`](mod@ladder) | here |
//! | matrices and vectors in Matrix Market files | [`market`] | here |
//! | files that are written whole or not at all | [`files`] | here |
//!
//! Scenes with known answers, dense oracles and planted problems, for tests, stay in `hlcp-verify`.
//!
//! # Features
//!
//! `rayon`, on by default, shares sweeps among threads for problems that ask for it by
//! `in_parallel`; `mpi` shares a problem among processes and needs an installed MPI.

#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod files;
pub mod film;
pub mod ladder;
pub mod market;

pub use hlcp_methods::*;
pub use hlcp_verify::{
    Branch, Certificate, Convergence, Refusal, Uniqueness, certify, certify_box, certify_by,
    certify_range, certify_within, convergence, uniqueness,
};

/// The programs of the READMEs, compiled and run with the documentation's other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
#[doc = include_str!("../../../README.md")]
struct Readme;
