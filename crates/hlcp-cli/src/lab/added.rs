//! Measurements on the charts of `hlcp speed-vs-accuracy`, and those of a user's own methods, from
//! CSV files.

use std::path::Path;

use hlcp::{
    files::{FileError, excerpt},
    ladder::{COLUMNS, Rung},
};

use super::table::Table;

/// Returns the rows of a file with their problems, which must be among `titles`.
pub(crate) fn read(path: &Path, titles: &[String]) -> Result<Vec<(String, Rung)>, FileError> {
    let rows = Table::rows_of(path, &COLUMNS.join("|"))?.into_iter();
    let rung = |(line, cells)| {
        row(cells, titles).map_err(|reason| FileError {
            path: path.to_owned(),
            line: Some(line),
            reason,
        })
    };
    rows.map(rung).collect()
}

fn row(cells: [String; 9], titles: &[String]) -> Result<(String, Rung), String> {
    let [problem, series, tolerance, error, low, median, high, half_steps, reached] = cells;
    if !titles.contains(&problem) {
        let problem = excerpt(&problem);
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
        positive("seconds min", &low)?,
        positive("seconds median", &median)?,
        positive("seconds max", &high)?,
    ];
    seconds.sort_by(f64::total_cmp);
    let half_steps = match half_steps.trim() {
        "" => None,
        words => Some(positive("half-steps", words)? as usize),
    };
    let reached = reached.trim().parse();
    let reached = reached.map_err(|_| "reached must be true or false".to_owned())?;
    let tolerance = positive("tolerance", &tolerance)?;
    let error = positive("true error", &error)?;
    Ok((problem, Rung { series, tolerance, error, seconds, half_steps, reached }))
}
