//! The laboratory: commands that measure methods, draw them, and hold scenes against what is known.
//!
//! A command is a file. It takes the methods that it compares from the list in `methods.rs`, solves
//! by [`run::solve`], measures by [`run::measure`], writes tables as a [`table::Table`], and draws
//! by `chart.rs`.

mod added;
mod claims;
pub(crate) mod comparison;
pub(crate) mod families;
pub(crate) mod films;
pub(crate) mod gallery;
mod methods;
mod optimal_alpha;
pub(crate) mod paper;
mod peers;
mod profile;
mod run;
pub(crate) mod scenes;
pub(crate) mod speed_vs_accuracy;
pub(crate) mod stability_map;
mod table;

use std::path::PathBuf;

use clap::Args;

/// The options that commands with charts have in common.
#[derive(Debug, Args)]
struct Charts {
    /// Small problems, measured once
    #[arg(long)]
    quick: bool,
    /// The folder for the charts and their data
    #[arg(long, default_value = "docs/charts", default_value_if("quick", "true", "target/charts"))]
    out: PathBuf,
}
