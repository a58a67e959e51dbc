//! The scenes: what they are, their published answers, and what is proved of them.

mod american_put;
mod bearing2d;
mod certificates;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod dam;
mod disc;
mod film;
mod membrane;
mod proved_film;
mod published;
