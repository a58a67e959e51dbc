//! A problem from Matrix Market files.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use clap::Args;
use hlcp::{files, market};
use hlcp_core::{FivePoint, Identity, LinearOperator, Rows, Scalar, recognise_grid};

use super::{Posing, Problem};
use crate::Fallible;

const FILES: &str = "Files";

/// The files of a problem, which no scene goes with.
#[derive(Clone, Default, Args)]
pub(crate) struct Files {
    /// A matrix A from a Matrix Market file, instead of a scene
    #[arg(long, help_heading = FILES, requires = "q", conflicts_with = "scene")]
    pub(crate) a: Option<PathBuf>,
    /// The matrix B [default: the identity, which makes the problem an LCP]
    #[arg(long, help_heading = FILES, requires = "a", conflicts_with = "scene")]
    pub(crate) b: Option<PathBuf>,
    /// The vector q: a Matrix Market file, or one number a line
    #[arg(long, help_heading = FILES, requires = "a", conflicts_with = "scene")]
    pub(crate) q: Option<PathBuf>,
    /// The grid of five-point operators A and B, such as 512x512, whose sweeps are faster and which
    /// multigrid needs [default: what the pattern of A and B shows]
    #[arg(long, help_heading = FILES, requires = "a", value_name = "NXxNY", value_parser = grid)]
    #[arg(conflicts_with = "scene")]
    grid: Option<[usize; 2]>,
}

/// The numbers of points in a row of a grid and of rows.
fn grid(text: &str) -> Result<[usize; 2], String> {
    let sides = text.split_once(['x', 'X', '×']).map(|(nx, ny)| (nx.parse(), ny.parse()));
    match sides {
        Some((Ok(nx), Ok(ny))) => Ok([nx, ny]),
        _ => Err("give the points in a row and the rows, such as 512x256".into()),
    }
}

impl Files {
    /// Reads the problem, or poses that of a scene where there are no files.
    pub(crate) fn read_or<T: Scalar>(
        &self,
        pose: impl FnOnce() -> Posing<T>,
    ) -> Fallible<Problem<T>> {
        let (Some(path), Some(q)) = (&self.a, &self.q) else { return Ok(pose()?) };
        let a = market::read_matrix::<T>(path)?;
        let q = market::read_vector(q, a.order())?;
        match &self.b {
            None => self.on_grid([path, path], a, Identity { order: q.len() }, q),
            Some(of_b) => self.on_grid([path, of_b], a, market::read_matrix::<T>(of_b)?, q),
        }
    }

    /// The problem of operators from files, as five-point ones if they are said to be or are found
    /// to be.
    fn on_grid<T: Scalar>(
        &self,
        paths: [&Path; 2],
        a: impl Rows<T> + 'static,
        b: impl Rows<T> + 'static,
        q: Vec<T>,
    ) -> Fallible<Problem<T>> {
        if let Some([nx, ny]) = self.grid {
            let named = |path: &Path| {
                let path = files::printable(path.display());
                move |error| format!("--grid {nx}x{ny} does not fit {path}: {error}")
            };
            let a = FivePoint::from_rows(nx, ny, &a).map_err(named(paths[0]))?;
            let b = FivePoint::from_rows(nx, ny, &b).map_err(named(paths[1]))?;
            return Ok(Problem::new(a, b, q));
        }
        Ok(match recognise_grid(&a, &b) {
            Some([a, b]) => Problem::new(a, b, q),
            None => Problem::new(a, b, q),
        })
    }

    /// The error, of a problem from files with the file or the option that mends it.
    pub(crate) fn explained(&self, error: hlcp_core::Error) -> Box<dyn Error> {
        use hlcp_core::Error::{NotFivePoint, NotPositive};
        let Self { a: Some(of_a), b, .. } = self else { return error.into() };
        match error {
            NotPositive { what: what @ ("diagonal of A" | "diagonal of B"), index, .. } => {
                let of_b = b.as_ref().filter(|_| what.ends_with('B'));
                let path = files::printable(of_b.unwrap_or(of_a).display());
                let row = index + 1;
                format!("{path}, row {row}: {error}").into()
            }
            NotFivePoint { .. } => "the files show no grid, which this method needs; name it by \
                                    --grid NXxNY if A and B are five-point operators, or take \
                                    AUTO or AMG"
                .into(),
            error => error.into(),
        }
    }
}
