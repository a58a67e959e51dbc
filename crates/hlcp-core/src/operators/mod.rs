//! Matrices that are known by what they do to a vector, and Ω.

mod assembled;
mod check;
mod combine;
mod csr;
mod dense;
mod entries;
mod forward;
mod omega;
mod operator;
mod recognise;
#[cfg(feature = "nalgebra-sparse")]
mod sparse;
mod stencil;
mod tridiagonal;
mod view;

#[cfg(test)]
pub(crate) use self::view::places;
pub use self::{
    assembled::Index,
    check::{check_operator, check_row},
    combine::{DiagonalMatrix, Identity, Scaled, Shifted, Sum},
    csr::Csr,
    dense::RowMajor,
    entries::{Coefficients, Entries, Varying},
    omega::Omega,
    operator::{Diagonal, LinearOperator, Rows},
    recognise::recognise_grid,
    stencil::{Direction, FivePoint},
    tridiagonal::Tridiagonal,
    view::FivePointView,
};
pub(crate) use self::{
    assembled::{RowsOf, Source},
    check::outside,
    omega::positive_entry,
};
