//! A film under a wall that moves in time: implicit steps, each from the last solution.

use std::{error::Error, path::Path};

use hlcp_core::files::printable;
use hlcp_verify::{Film, FilmFigures, TimeStep};

use super::{Arguments, array, balance::Solved, gap::Posed};
use crate::{chart, progress};

/// What a run comes to.
pub(super) struct Run {
    pub(super) solved: Solved,
    /// The figures at each time as CSV.
    pub(super) csv: String,
    /// What the oil in the film has gained beyond what flowed in, by time, in m³/s.
    pub(super) imbalance: f64,
    pub(super) steps: usize,
    pub(super) all_converged: bool,
}

/// A time and the position of the wall then, in SI units.
type Instant = (f64, Vec<f64>);

/// Reads times and positions.
fn schedule(
    path: &Path,
    posed: &Posed,
    arguments: &Arguments,
) -> Result<Vec<Instant>, Box<dyn Error>> {
    let name = printable(path.display());
    let table = array::read(path)?;
    let is_journal = posed.journal.is_some();
    let wanted = if is_journal { 3..=3 } else { 2..=4 };
    if !wanted.contains(&table.columns) || table.rows < 2 {
        let what = if is_journal {
            "the time and the displacement along the load and across it"
        } else {
            "the time, the rise and, if they change, the slopes along x and y"
        };
        let (rows, columns) = (table.rows, table.columns);
        return Err(format!("{name} has {rows} rows and {columns} columns, but a motion has two rows or more, each with {what}").into());
    }
    let direction = posed.load_direction(arguments);
    let (sin, cos) = direction.sin_cos();
    let across = posed.direction();
    let position = |row: &[f64]| -> Vec<f64> {
        if is_journal {
            let [x, y] = [row[1], row[2]].map(|v| v * arguments.h_unit);
            // The gap widens on the other side.
            return vec![-(x * cos - y * across * sin), -(x * sin + y * across * cos)];
        }
        let mut position = posed.position.clone();
        position[0] += row[1] * arguments.h_unit;
        position.iter_mut().skip(1).zip(&row[2..]).for_each(|(slope, by)| *slope += by);
        position
    };
    let rows: Vec<_> =
        table.values.chunks(table.columns).map(|row| (row[0], position(row))).collect();
    if let Some(at) = rows.windows(2).position(|pair| pair[1].0 <= pair[0].0) {
        let (before, time) = (rows[at].0, rows[at + 1].0);
        return Err(format!(
            "{name}: row {}: the time {time} does not exceed the one before, {before}",
            at + 2
        )
        .into());
    }
    let meets = rows.iter().position(|(_, position)| posed.at(position).is_none());
    match meets {
        Some(at) => Err(format!("{name}: row {}: the walls meet", at + 1).into()),
        None => Ok(rows),
    }
}

const HEAD: &str = "time (s),load (N),load x (m),load y (m),friction moving (N),friction fixed (N),power (W),\
                    out west (m³/s),out east (m³/s),out south (m³/s),out north (m³/s),supplied (m³/s),\
                    oil (m³),peak pressure (Pa),least gap (m),broken share";

/// Takes the steps of the file; `figures` has load and friction as they are reported.
pub(super) fn run(
    path: &Path,
    posed: &mut Posed,
    arguments: &Arguments,
    figures: impl Fn(&Posed, &Film, &FilmFigures, &[f64]) -> [f64; 6],
) -> Result<Run, Box<dyn Error>> {
    let rows = schedule(path, posed, arguments)?;
    let film = |position: &[f64]| posed.at(position).ok_or("the walls meet");
    let first = film(&rows[0].1)?;
    // What a wall carries has settled before; a film that is squeezed alone begins full.
    let settled = first.is_fed() && first.speeds.iter().sum::<f64>() != 0.0;
    let (area, free) = (first.cell(), first.free_cells());
    let (mut oil, mut solved) = if settled {
        let solved = Solved::new(first, None, arguments)?;
        let left: Vec<f64> =
            solved.film.gap.iter().zip(&solved.r).map(|(h, r)| h * (1.0 - r)).collect();
        (left, Some(solved))
    } else {
        (first.gap, None)
    };
    let mut all_converged = solved.as_ref().is_none_or(|solved| solved.outcome.converged());
    let total = |oil: &[f64]| free.iter().map(|&k| oil[k]).sum::<f64>() * area;
    let begun = total(&oil);
    let (mut lines, mut entered) = (vec![], 0.0);
    let bar = progress::counting(rows.len() - 1);
    for pair in rows.windows(2) {
        let duration = pair[1].0 - pair[0].0;
        let moved =
            Film { step: Some(TimeStep { duration, oil: oil.clone() }), ..film(&pair[1].1)? };
        let next = Solved::new(moved, solved.as_ref(), arguments)?;
        all_converged &= next.outcome.converged();
        // What the solve leaves of a balance goes into the next step, so that nothing adds up.
        let out = next.film.outflow(&next.z, &next.r);
        oil.iter_mut().zip(out).for_each(|(oil, out)| *oil -= duration / area * out);
        let found = next.film.figures(&next.z, &next.r, posed.ambient);
        let supplied = found.supplies.iter().fold(0.0, |sum, flow| sum + flow);
        entered += duration * (supplied - found.sides.iter().sum::<f64>());
        let mut line = vec![pair[1].0];
        line.extend(figures(posed, &next.film, &found, &next.z));
        line.extend(found.sides);
        line.extend([supplied, total(&oil), found.peak, found.least_gap, found.broken_share]);
        lines.push(line.iter().map(f64::to_string).collect::<Vec<_>>().join(","));
        solved = Some(next);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let imbalance = (total(&oil) - begun - entered) / (rows[rows.len() - 1].0 - rows[0].0);
    posed.position = rows[rows.len() - 1].1.clone();
    let solved = solved.ok_or("there are no steps")?;
    let (csv, steps) = (chart::csv(HEAD, &lines), lines.len());
    Ok(Run { solved, csv, imbalance, steps, all_converged })
}
