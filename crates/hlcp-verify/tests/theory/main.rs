//! The theorems, the certificates and the classes of matrices.

mod certificate;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod examples;
mod hostile;
mod sizes;
mod theorem_1;
mod theorem_2;
