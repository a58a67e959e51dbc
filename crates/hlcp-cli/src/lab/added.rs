//! Measurements on the charts of `hlcp speed-vs-accuracy`, and those of a user's own methods, from
//! CSV files.

use std::{fs, path::PathBuf};

use hlcp::files::{FileError, excerpt};

/// The columns of the data.
pub(super) const COLUMNS: &str =
    "problem,series,tolerance,true error,seconds min,seconds median,seconds max,half-steps,reached";

/// The runs of one series to one tolerance on one problem.
#[derive(Clone)]
pub(super) struct Measured {
    pub(super) name: String,
    pub(super) tolerance: f64,
    pub(super) error: f64,
    /// The fastest, the median and the slowest.
    pub(super) seconds: [f64; 3],
    /// Half-steps, where the series has such a thing.
    pub(super) sweeps: Option<usize>,
    /// Whether the residual reached the tolerance.
    pub(super) reached: bool,
}

/// The rows of the files with their problems, which must be among `titles`.
pub(crate) fn read(
    paths: &[PathBuf],
    titles: &[&str],
) -> Result<Vec<(String, Measured)>, FileError> {
    let mut rows = vec![];
    for path in paths {
        let fault = |line, reason| FileError { path: path.clone(), line, reason };
        let text = fs::read_to_string(path).map_err(|error| fault(None, error.to_string()))?;
        let lines = (1..).zip(text.lines());
        for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty() && *line != COLUMNS)
        {
            rows.push(row(line, titles).map_err(|reason| fault(Some(number), reason))?);
        }
    }
    Ok(rows)
}

fn row(line: &str, titles: &[&str]) -> Result<(String, Measured), String> {
    let cells = cells(line);
    let [problem, name, tolerance, error, low, median, high, sweeps, reached] = &cells[..] else {
        return Err(format!("{} columns where there must be 9: {COLUMNS}", cells.len()));
    };
    if !titles.contains(&problem.as_str()) {
        let problem = excerpt(problem);
        return Err(format!(
            "there is no problem '{problem}' here; they are {}",
            titles.join("; ")
        ));
    }
    let positive = |column: &str, cell: &str| match cell.trim().parse::<f64>() {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("{column} is '{}', not a number of 0 or more", excerpt(cell))),
    };
    let mut seconds = [
        positive("seconds min", low)?,
        positive("seconds median", median)?,
        positive("seconds max", high)?,
    ];
    seconds.sort_by(f64::total_cmp);
    let sweeps = match sweeps.trim() {
        "" => None,
        words => Some(positive("half-steps", words)? as usize),
    };
    let reached = reached.trim().parse();
    let reached = reached.map_err(|_| "reached must be true or false".to_owned())?;
    let tolerance = positive("tolerance", tolerance)?;
    let error = positive("true error", error)?;
    let name = name.clone();
    Ok((problem.clone(), Measured { name, tolerance, error, seconds, sweeps, reached }))
}

/// The cells of a line; a comma between quotes is part of its cell.
fn cells(line: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    for (k, part) in line.split('"').enumerate() {
        let mut pieces =
            if k % 2 == 1 { vec![part] } else { part.split(',').collect() }.into_iter();
        let last = cells.len() - 1;
        cells[last] += pieces.next().unwrap_or_default();
        cells.extend(pieces.map(String::from));
    }
    cells
}
