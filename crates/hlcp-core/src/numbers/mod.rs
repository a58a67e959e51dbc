//! Scalars, errors, and norms of vectors that are at hand.

mod error;
mod norms;
mod scalar;

pub(crate) use self::{
    error::positive,
    norms::{BLOCK, Meter, Part, Stretches, Tallies, Tally, Totals},
    scalar::vectorised,
};
pub use self::{
    error::{Error, assert_lengths, check_orders, number},
    norms::{Norms, Rhs, all_finite},
    scalar::{Compiled, Scalar},
};
