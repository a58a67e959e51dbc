//! The command `hlcp` and the documents, tested as a user meets them.

mod command;
#[path = "../../../../tests/common/mod.rs"]
mod common;
#[path = "../../../../tests/common/counting.rs"]
mod counting;
mod documents;
mod examples;
mod files;
mod film;
mod film_loads;
mod film_plane;
mod film_refused;
mod folder;
mod fuzz;
mod gallery;
mod options;
mod outputs;
mod paper;
#[cfg(feature = "mpi")]
mod ranks;
mod siconos;
mod solve;
