//! The methods, one module for each family, and how solves end.

mod adaptive;
mod anderson;
mod answers;
mod auto;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod failures;
mod multigrid;
mod newton;
mod outcomes;
mod planted;
mod renumbered;
