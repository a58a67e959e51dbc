//! Operators, the sweeps and residuals that are made of them, and the input that is refused.

mod bad_input;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod exchange;
mod kernels;
mod lies;
mod products;
mod rounding;
mod rows;
mod transfers;
