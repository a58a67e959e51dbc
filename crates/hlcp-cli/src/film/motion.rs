//! A film under a wall that moves in time: implicit steps, each from the last solution.

use std::path::Path;

use hlcp::{
    files::printable,
    film::{Bearing, Drive, FilmFigures, Map, Motion, Settings, Solved},
};

use super::Arguments;
use crate::{Fallible, progress};

pub(super) struct Run {
    pub(super) bearing: Bearing,
    pub(super) solved: Solved,
    /// The figures at each time as CSV.
    pub(super) csv: String,
    /// What the oil in the film has gained beyond what flowed in, by time, in m³/s.
    pub(super) imbalance: f64,
    /// The figures of the last step.
    pub(super) figures: FilmFigures,
    pub(super) steps: usize,
    /// What is doubtful about the positions.
    pub(super) doubt: Option<String>,
    pub(super) all_converged: bool,
}

/// A time and what drives the wall to there, in SI units.
type Instant = (f64, Drive);

/// Reads times and positions or loads.
fn schedule(
    path: &Path,
    bearing: &Bearing,
    arguments: &Arguments,
) -> Result<(Vec<Instant>, Option<String>), String> {
    let name = printable(path.display());
    let table = Map::read(path).map_err(|error| error.to_string())?;
    let is_journal = bearing.journal.is_some();
    let (wanted, what) = match (is_journal, arguments.mass) {
        (true, None) => (3..=3, "the time and the displacement along the load and across it"),
        (true, Some(_)) => (3..=3, "the time and the load in its direction and across it"),
        (false, None) => {
            (2..=4, "the time, the rise and, if they change, the slopes along x and y")
        }
        (false, Some(_)) => (2..=2, "the time and the load"),
    };
    if !wanted.contains(&table.columns) || table.rows < 2 {
        let (rows, columns) = (table.rows, table.columns);
        return Err(format!(
            "{name} has {rows} rows and {columns} columns, but a motion has two rows or more, each with {what}"
        ));
    }
    let load = bearing.load_direction(arguments.attitude.unwrap_or(0.0));
    let by = if arguments.mass.is_some() { 1.0 } else { arguments.h_unit };
    let drive = |row: &[f64]| {
        let scaled = |(k, v): (usize, &f64)| if is_journal || k == 0 { v * by } else { *v };
        let numbers: Vec<f64> = row[1..].iter().enumerate().map(scaled).collect();
        bearing.drive(load, &numbers, arguments.mass)
    };
    let rows: Vec<_> = table.values.chunks(table.columns).map(|row| (row[0], drive(row))).collect();
    if let Some(at) = rows.windows(2).position(|pair| pair[1].0 <= pair[0].0) {
        let (before, time, row) = (rows[at].0, rows[at + 1].0, at + 2);
        return Err(format!(
            "{name}: row {row}: the time {time} does not exceed the one before, {before}"
        ));
    }
    let position = |(_, drive): &Instant| match drive {
        Drive::To(position) => Some(position.clone()),
        _ => None,
    };
    let positions: Vec<_> = rows.iter().filter_map(position).collect();
    match positions.iter().position(|position| bearing.at(position).is_none()) {
        Some(at) => Err(format!(
            "{name}: row {}: the walls meet; positions are in units of --h-unit, and loads take \
             --mass",
            at + 1
        )),
        None => Ok((rows, doubt_unit(&positions, bearing, &name))),
    }
}

/// Tells of positions that were hardly meant to be so small: of a journal its displacement, of
/// anything else what the gap changes by.
fn doubt_unit(positions: &[Vec<f64>], bearing: &Bearing, name: &str) -> Option<String> {
    let from = if bearing.journal.is_some() { &[0.0; 2][..] } else { &bearing.position };
    let moved = |position: &Vec<f64>| {
        let by = position.iter().zip(from).zip(&bearing.modes).map(|((at, from), mode)| {
            (at - from).abs() * mode.iter().fold(0.0_f64, |most, mode| most.max(mode.abs()))
        });
        by.sum::<f64>()
    };
    let most = positions.iter().map(moved).fold(0.0, f64::max);
    let (room, what) = match bearing.journal {
        Some(journal) => (journal.clearance, "clearance"),
        None => (bearing.film.gap.iter().copied().fold(f64::INFINITY, f64::min), "least gap"),
    };
    (most > 0.0 && most < 1e-3 * room).then(|| {
        format!(
            "{name}: the largest displacement is {most:e} m, less than a thousandth of \
             the {what}; positions are in units of --h-unit"
        )
    })
}

const HEAD: &str = "time (s),load (N),load x (m),load y (m),friction moving (N),friction fixed (N),power (W),\
                    out west (m³/s),out east (m³/s),out south (m³/s),out north (m³/s),supplied (m³/s),\
                    oil (m³),peak pressure (Pa),least gap (m),broken share";

pub(super) fn run(
    path: &Path,
    mut bearing: Bearing,
    arguments: &Arguments,
    settings: &Settings<'_>,
) -> Fallible<Run> {
    let (rows, doubt) = schedule(path, &bearing, arguments)?;
    if let Drive::To(position) = &rows[0].1 {
        bearing.position.clone_from(position);
    }
    let load = bearing.load_direction(arguments.attitude.unwrap_or(0.0));
    let mut motion = Motion::new(bearing, settings)?;
    let begun = motion.oil();
    let settled = motion.solved.as_ref();
    let mut all_converged = settled.is_none_or(|solved| solved.outcome.converged());
    let (mut lines, mut entered, mut figures) = (vec![], 0.0, None);
    let bar = progress::counting(rows.len() - 1);
    for (pair, row) in rows.windows(2).zip(2..) {
        let [(before, _), (time, drive)] = pair else { continue };
        let duration = time - before;
        let found = motion
            .step(duration, drive, settings)
            .map_err(|error| format!("{}: row {row}: {error}", printable(path.display())))?;
        let (bearing, solved) = (&motion.bearing, motion.solved.as_ref().expect("after a step"));
        all_converged &= solved.outcome.converged();
        let supplied = found.supplies.iter().fold(0.0, |sum, flow| sum + flow);
        entered += duration * (supplied - found.sides.iter().sum::<f64>());
        let rest = [supplied, motion.oil(), found.peak, found.least_gap, found.broken_share];
        let carried = bearing.load(&solved.film, &found, &solved.z);
        let (drag, at) = (bearing.drag(found.friction), bearing.told(load));
        let line =
            [&[*time], &carried[..], &drag, &[found.power], &found.sides, &rest, &at].concat();
        lines.push(line.iter().map(f64::to_string).collect::<Vec<_>>().join(","));
        figures = Some(found);
        bar.inc(1);
    }
    let imbalance = (motion.oil() - begun - entered) / (rows[rows.len() - 1].0 - rows[0].0);
    let Motion { bearing, solved, .. } = motion;
    let (solved, figures) = solved.zip(figures).ok_or("there are no steps")?;
    let place = match bearing.journal {
        Some(_) => "displacement along the load (m),displacement across it (m)",
        None => "rise (m),slope along x,slope along y",
    };
    let (csv, steps) = (format!("{HEAD},{place}\n{}\n", lines.join("\n")), lines.len());
    Ok(Run { bearing, solved, figures, csv, imbalance, steps, doubt, all_converged })
}
