//! Operators, splittings and the problem: the vocabulary of matrix-free horizontal linear
//! complementarity.
//!
//! The problem HLCP(A, B, q) is to find `z, r ≥ 0` with `zᵀ r = 0` and `A z − B r + q = 0`. Nothing here
//! forms a matrix: an operator is known by what it does.
//!
//! * What an operator can do, one trait a rung: [`LinearOperator`] (products), [`Diagonal`], [`Rows`].
//!   On all three stand [`FivePoint`], [`VaryingFivePoint`] and [`Tridiagonal`], [`Identity`] and
//!   [`DiagonalMatrix`], and [`Scaled`], [`Shifted`] and [`Sum`] of what stands there; with the feature
//!   `nalgebra-sparse`, on by default, also `nalgebra_sparse::CsrMatrix`, and `market` reads and writes Matrix
//!   Market files. A [`FivePointView`] is how an operator tells fast sweeps what it is.
//! * The problem in modulus form: [`Hlcp`], with its [`Omega`] and a checked right-hand side [`Rhs`]. One thread works on
//!   it unless it is asked to be worked on `in_parallel`, with the feature `rayon`, on by default.
//! * One step of a method: [`Step`], by [`Aor`] (Jacobi, Gauss–Seidel, SOR, AOR), by [`Jacobi`] where only
//!   the diagonal is known, or by a [`Correction`] with any [`Splitting`] of your own.
//! * What is wrong with the input: [`Error`].
//!
//! The methods themselves are in `hlcp-methods`.

mod aor;
mod combine;
#[cfg(feature = "nalgebra-sparse")]
mod csr;
mod error;
mod forward;
mod kernel;
#[cfg(feature = "nalgebra-sparse")]
pub mod market;
mod norms;
mod omega;
mod operator;
mod problem;
mod scalar;
mod splitting;
mod stencil;
mod team;
mod tridiagonal;
mod varying;
mod view;

pub use aor::Aor;
pub use combine::{DiagonalMatrix, Identity, Scaled, Shifted, Sum};
pub use error::Error;
pub use norms::{Norms, Rhs, all_finite};
pub use omega::Omega;
pub use operator::{Diagonal, LinearOperator, Rows};
pub use problem::Hlcp;
pub use scalar::Scalar;
pub use splitting::{Correction, FromFn, Jacobi, Splitting, Step};
pub use stencil::FivePoint;
pub use tridiagonal::Tridiagonal;
pub use varying::VaryingFivePoint;
pub use view::{Coefficients, FivePointView};

/// The README's program, compiled and run with the documentation's other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
