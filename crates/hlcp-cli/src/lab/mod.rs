//! The laboratory: commands that measure methods, draw them, and hold scenes against what is known.
//!
//! A command is a file. It takes the methods that it compares from the list in `methods.rs`, solves
//! by [`run::solve`], measures by [`run::measure`], writes tables as a [`table::Table`], and draws
//! by `chart.rs`.

mod added;
pub(crate) mod charts;
mod claims;
pub(crate) mod comparison;
pub(crate) mod families;
pub(crate) mod films;
pub(crate) mod gallery;
mod methods;
pub(crate) mod modulus;
mod optimal_alpha;
mod own;
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

use self::table::Table;
use crate::{Fallible, chart::provenance};

/// The options that commands with charts have in common.
#[derive(Args)]
struct Charts {
    /// Small problems, measured once
    #[arg(long)]
    quick: bool,
    /// Draw the charts anew from the data in their folder, without measuring
    #[arg(long)]
    draw: bool,
    /// The folder for the charts and their data
    #[arg(long, default_value = "docs/charts", default_value_if("quick", "true", "target/charts"))]
    out: PathBuf,
}

/// The columns of `measured.csv`, which says what has measured the data beside it.
const MEASURED: &str = "data of|command, machine and day";

impl Charts {
    /// Measures the data of a command, unless only to draw them is asked for; returns what the
    /// captions say of command, machine and day, which `measured.csv` keeps.
    fn measured(&self, name: &str, measure: impl FnOnce() -> Fallible<()>) -> Fallible<String> {
        let path = self.out.join("measured.csv");
        let mut known = Table::kept(&path, MEASURED)?;
        if self.draw {
            return Ok(known.remove(name).ok_or_else(|| {
                let path = hlcp::files::printable(path.display());
                format!("{path} has no data of {name} to draw; measure them first, without --draw")
            })?);
        }
        measure()?;
        let flag = if self.quick { " --quick" } else { "" };
        let words = provenance(&format!("hlcp {name}{flag}"));
        Table::keep(&path, MEASURED, name, words.clone())?;
        Ok(words)
    }
}
