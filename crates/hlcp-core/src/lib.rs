//! Operators, splittings and the problem for matrix-free horizontal linear complementarity.
//!
//! The problem HLCP(A, B, q) is to find `z, r ≥ 0` with `zᵀ r = 0` and `A z − B r + q = 0`. Nothing
//! here forms a matrix: an operator is known by its product with a vector. Take this crate alone to
//! write operators and splittings that others solve with. A program that solves takes `hlcp` or
//! `hlcp-methods`, which have all of it.
//!
//! ```
//! use hlcp_core::{FivePoint, Hlcp, Identity, Omega, Shifted};
//!
//! // [south, west, centre, east, north] on a 100 × 80 grid: seven numbers, whatever the grid.
//! let a = FivePoint::new(100, 80, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
//! let b = Shifted { by: 1.0, of: Identity { order: 8000 } };
//! let problem = Hlcp::from_pair(a, b)?;
//! assert_eq!((problem.order(), problem.omega()), (8000, &Omega::Uniform(2.0)));
//! # Ok::<(), hlcp_core::Error>(())
//! ```
//!
//! # Where to look
//!
//! | for | look at |
//! |---|---|
//! | grids and bands | [`FivePoint`], constant or varying; [`Tridiagonal`], [`DiagonalMatrix`], [`Identity`] |
//! | rows in arrays | [`Csr`], [`RowMajor`]; with the feature `nalgebra-sparse`, on by default, `CsrMatrix`, `CscMatrix` and `nalgebra::DMatrix` |
//! | operators from operators | [`Scaled`], [`Shifted`], [`Sum`] |
//! | an operator of your own | [the table below](#an-operator-of-your-own), and [`check_operator`] |
//! | the problem in modulus form | [`Hlcp`], with its [`Omega`] |
//! | one iteration | [`Step`]: [`Aor`], [`Multicolour`], and a [`Splitting`] by [`SplittingStep`] |
//! | its right-hand side and the residual it measures | [`Rhs`], [`Norms`] |
//! | several processes on one problem | [`Hlcp::shared_by`] of [`Ranks`], with a [`Strip`] each |
//!
//! # An operator of your own
//!
//! Each trait builds on the one before and opens more methods:
//!
//! | trait | you write | it opens |
//! |---|---|---|
//! | [`LinearOperator`] | the order and the product | a [`Splitting`] of your own |
//! | [`Diagonal`] | one diagonal entry | [`Jacobi`], [`Omega::diagonal_ratio`] |
//! | [`Rows`] | one row, entry by entry | [`Aor`] (Jacobi, Gauss–Seidel, SOR, AOR), AMMS, Newton's inner solvers, certificates |
//!
//! An operator that answers [`as_five_point`](LinearOperator::as_five_point) is swept in one
//! vectorised pass over memory, which also yields the norm for the stopping test.
//!
//! # Threads and errors
//!
//! One thread works unless the problem asks for more by `in_parallel` (feature `rayon`, on by
//! default). Ranks and threads come to the same bits; `World` (feature `mpi`) makes ranks of
//! processes. Wrong input is an [`Error`] with its numbers.
//!
//! # Not supported
//!
//! * Scalars other than `f32` and `f64`.
//! * Fused sweeps for operators that are not five-point: their rows are walked. They share threads
//!   only in a [`Multicolour`] order.
//! * Stencils in three dimensions. Write a [`Rows`] operator for these.
//! * Targets without `std`.

#![cfg_attr(docsrs, feature(doc_cfg))]

// The floors, from the lowest: numbers, parallel, operators, rows, kernel, problem, steps. None
// imports from a floor above it.
mod kernel;
mod numbers;
mod operators;
mod parallel;
mod problem;
mod rows;
mod steps;

/// What the other crates of this repository are built of. No promise holds for what is hidden.
#[doc(hidden)]
pub use {
    kernel::{Smoother, Transfer},
    numbers::{Compiled, all_finite, assert_lengths, check_orders, number},
    operators::check_row,
};

pub use numbers::{Error, Norms, Rhs, Scalar};
pub use operators::{
    Coefficients, Csr, Diagonal, DiagonalMatrix, Direction, Entries, FivePoint, FivePointView,
    Identity, Index, LinearOperator, Omega, RowMajor, Rows, Scaled, Shifted, Sum, Tridiagonal,
    Varying, check_operator, recognise_grid,
};
#[cfg(feature = "mpi")]
pub use parallel::{NotJoined, World};
pub use parallel::{Ranks, Strip, ranks_as_threads};
pub use problem::Hlcp;
pub use steps::{Aor, Jacobi, Multicolour, Splitting, SplittingStep, Step};

/// The README's program, compiled and run with the documentation's other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(test)]
mod tests {
    /// What a folder may use is said by its place among the floors.
    #[test]
    fn no_floor_imports_from_one_above() {
        let floors = ["numbers", "parallel", "operators", "rows", "kernel", "problem", "steps"];
        for (k, floor) in floors.iter().enumerate() {
            let folder = format!("{}/src/{floor}", env!("CARGO_MANIFEST_DIR"));
            for file in std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()) {
                let text = std::fs::read_to_string(&file).unwrap();
                let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
                for (line, above) in
                    code.flat_map(|line| floors[k + 1..].iter().map(move |a| (line, a)))
                {
                    assert!(!line.contains(&format!("{above}::")), "{}: {line}", file.display());
                }
            }
        }
    }
}
