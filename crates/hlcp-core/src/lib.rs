//! Operators, splittings and the problem for matrix-free horizontal linear complementarity.
//!
//! The problem HLCP(A, B, q) is to find `z, r ≥ 0` with `zᵀ r = 0` and `A z − B r + q = 0`. Nothing
//! here forms a matrix: an operator is known by its product with a vector. The methods that solve
//! the problem are in `hlcp-methods`.
//!
//! # Ready-made operators
//!
//! * [`FivePoint`] on a grid, constant or varying, [`Tridiagonal`], [`Identity`] and
//!   [`DiagonalMatrix`];
//! * [`Csr`] and [`RowMajor`] for rows in arrays; with the feature `nalgebra-sparse`, on by
//!   default, also `CsrMatrix`, `CscMatrix` and `nalgebra::DMatrix`;
//! * [`Scaled`], [`Shifted`] and [`Sum`] of any of them.
//!
//! Two operators and an [`Omega`] make an [`Hlcp`], the problem in modulus form.
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
//! # Five-point operators
//!
//! An operator that answers [`as_five_point`](LinearOperator::as_five_point) is swept in one
//! vectorised pass over memory, which also yields the norm for the stopping test. The iterates are
//! those of the walk over its rows, up to rounding.
//!
//! ```
//! use hlcp_core::{
//!     Diagonal, Entries::Uniform, FivePointView, LinearOperator, Rows, check_operator,
//! };
//!
//! /// A string of n beads on springs: (2 + k)xᵢ − xᵢ₋₁ − xᵢ₊₁.
//! struct Beads {
//!     n: usize,
//!     k: f64,
//! }
//!
//! impl LinearOperator<f64> for Beads {
//!     fn order(&self) -> usize {
//!         self.n
//!     }
//!     fn apply(&self, x: &[f64], y: &mut [f64]) {
//!         for i in 0..self.n {
//!             let at = |j: usize| x.get(j).copied().unwrap_or(0.0);
//!             y[i] = (2.0 + self.k) * x[i] - at(i.wrapping_sub(1)) - at(i + 1);
//!         }
//!     }
//!     fn as_five_point(&self) -> Option<FivePointView<'_, f64>> {
//!         let row = [0.0, -1.0, 2.0 + self.k, -1.0, 0.0];
//!         Some(FivePointView::new(self.n, 1, row.map(Uniform)))
//!     }
//! }
//!
//! impl Diagonal<f64> for Beads {
//!     fn diagonal_entry(&self, _: usize) -> f64 {
//!         2.0 + self.k
//!     }
//! }
//!
//! impl Rows<f64> for Beads {
//!     fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
//!         for j in i.saturating_sub(1)..self.n.min(i + 2) {
//!             visit(j, if j == i { 2.0 + self.k } else { -1.0 });
//!         }
//!     }
//! }
//!
//! // The view says what the product and the rows say.
//! check_operator(&Beads { n: 50, k: 0.1 })?;
//! # Ok::<(), hlcp_core::Error>(())
//! ```
//!
//! # Steps, threads and errors
//!
//! * A [`Step`] is one iteration's update, [`Rhs`] a checked right-hand side, and [`Norms`] the
//!   residual that a step measures.
//! * One thread works unless the problem asks for more by `in_parallel` (feature `rayon`, on by
//!   default).
//! * Several processes share a problem by [`Hlcp::shared_by`], each on its [`Strip`] of the grid,
//!   and come to the bits of one (`World`, feature `mpi`).
//! * Wrong input is an [`Error`] with its numbers.
//!
//! # Not supported
//!
//! * Scalars other than `f32` and `f64`.
//! * Fused sweeps for operators that are not five-point: their rows are walked. They share threads
//!   only in a [`Multicolour`] order.
//! * Stencils in three dimensions. Write a [`Rows`] operator for these.
//! * Targets without `std`.

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
    numbers::{all_finite, number},
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
