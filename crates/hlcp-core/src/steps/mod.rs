//! The steps of modulus-based methods.

mod aor;
mod colour;
mod splitting;

pub use self::{
    aor::Aor,
    colour::Multicolour,
    splitting::{Jacobi, Splitting, SplittingStep, Step},
};
