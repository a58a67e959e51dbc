//! A film under a wall that moves in time: implicit steps, each from the last solution.

use std::{error::Error, path::Path};

use hlcp::files::printable;
use hlcp_verify::{Film, FilmFigures, TimeStep};

use super::{
    Arguments, array,
    balance::{Solved, eliminate},
    gap::Posed,
};
use crate::{chart, progress, say};

/// What a run comes to.
pub(super) struct Run {
    pub(super) solved: Solved,
    /// The figures at each time as CSV.
    pub(super) csv: String,
    /// What the oil in the film has gained beyond what flowed in, by time, in m³/s.
    pub(super) imbalance: f64,
    /// The power that moves the wall against the pressure in the last step, in W.
    pub(super) squeezing: f64,
    pub(super) steps: usize,
    pub(super) all_converged: bool,
}

/// A time and the position of the wall then, or the forces on it, in SI units.
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
    let wanted = if arguments.mass.is_some() && !is_journal { 2..=2 } else { wanted };
    if !wanted.contains(&table.columns) || table.rows < 2 {
        let what = match (is_journal, arguments.mass) {
            (true, None) => "the time and the displacement along the load and across it",
            (true, Some(_)) => "the time and the load in its direction and across it",
            (false, None) => "the time, the rise and, if they change, the slopes along x and y",
            (false, Some(_)) => "the time and the load",
        };
        let (rows, columns) = (table.rows, table.columns);
        return Err(format!("{name} has {rows} rows and {columns} columns, but a motion has two rows or more, each with {what}").into());
    }
    let position = |row: &[f64]| -> Vec<f64> {
        let by = if arguments.mass.is_some() { 1.0 } else { arguments.h_unit };
        if is_journal {
            let turned = posed.turned(arguments, [row[1] * by, row[2] * by]);
            // The gap widens on the other side.
            return turned.map(|v| if arguments.mass.is_some() { v } else { -v }).to_vec();
        }
        if arguments.mass.is_some() {
            return vec![row[1], 0.0, 0.0];
        }
        let mut position = posed.position.clone();
        position[0] += row[1] * by;
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
    if arguments.mass.is_some() {
        return Ok(rows);
    }
    doubt_unit(&rows, posed, &name);
    let meets = rows.iter().position(|(_, position)| posed.at(position).is_none());
    match meets {
        Some(at) => Err(format!(
            "{name}: row {}: the walls meet; positions are in units of --h-unit, and loads take \
             --mass",
            at + 1
        )
        .into()),
        None => Ok(rows),
    }
}

/// Warns of positions that were hardly meant to be so small: of a journal its displacement, of
/// anything else what the gap changes by.
fn doubt_unit(rows: &[Instant], posed: &Posed, name: &str) {
    let from = if posed.journal.is_some() { &[0.0; 2][..] } else { &posed.position };
    let moved = |(_, position): &Instant| {
        let by = position.iter().zip(from).zip(&posed.modes).map(|((at, from), mode)| {
            (at - from).abs() * mode.iter().fold(0.0_f64, |most, mode| most.max(mode.abs()))
        });
        by.sum::<f64>()
    };
    let most = rows.iter().map(moved).fold(0.0, f64::max);
    let (room, what) = match posed.journal {
        Some([clearance, _]) => (clearance, "clearance"),
        None => (posed.base.iter().copied().fold(f64::INFINITY, f64::min), "least gap"),
    };
    if most > 0.0 && most < 1e-3 * room {
        say(format!(
            "warning: {name}: the largest displacement is {most:e} m, less than a thousandth of \
             the {what}; positions are in units of --h-unit"
        ));
    }
}

const HEAD: &str = "time (s),load (N),load x (m),load y (m),friction moving (N),friction fixed (N),power (W),\
                    out west (m³/s),out east (m³/s),out south (m³/s),out north (m³/s),supplied (m³/s),\
                    oil (m³),peak pressure (Pa),least gap (m),broken share";

/// The force on the wall over the force of the film on it, and the way there, at which a step of
/// free motion ends.
const BALANCED: f64 = 1e-8;

impl Posed {
    /// What points along the load and across it, as a vector along x = 0 and a quarter further.
    fn turned(&self, arguments: &Arguments, [along, across]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.load_direction(arguments).sin_cos();
        let across = self.direction() * across;
        [along * cos - across * sin, along * sin + across * cos]
    }

    /// The position as it is given on the command line and in files.
    fn told(&self, arguments: &Arguments) -> Vec<f64> {
        if self.journal.is_none() {
            return self.position.clone();
        }
        let [a, b] = [-self.position[0], -self.position[1]];
        let (sin, cos) = self.load_direction(arguments).sin_cos();
        vec![a * cos + b * sin, self.direction() * (b * cos - a * sin)]
    }

    /// Moves the wall, which has a mass and a velocity, to where film and load leave it after a
    /// step: `m (v − v₀) = Δt (G(e) − load)`, `e = e₀ + Δt v`, by Newton's method.
    fn fall(
        &mut self,
        step: &TimeStep,
        (mass, velocity): (f64, &mut [f64]),
        load: &[f64],
        before: Option<&Solved>,
        arguments: &Arguments,
    ) -> Result<Solved, Box<dyn Error>> {
        let duration = step.duration;
        let from = self.position.clone();
        // A pad keeps its slopes.
        let moving = if self.journal.is_some() { 2 } else { 1 };
        let all: Vec<usize> = (0..moving).collect();
        let at = |posed: &Self, position: &[f64]| -> Option<Film> {
            posed.at(position).map(|film| Film { step: Some(step.clone()), ..film })
        };
        let film = at(self, &self.position).ok_or("the walls meet")?;
        let mut solved = Solved::new(film, before, arguments)?;
        for _ in 0..30 {
            let forces = self.forces(&solved.film, &solved.z);
            let slopes = solved.slopes(self, &all)?;
            let inertia = mass / (duration * duration);
            let miss = |k: usize| {
                let way = self.position[k] - from[k] - duration * velocity[k];
                inertia * way - forces[k] + load[k]
            };
            let misses: Vec<f64> = (0..moving).map(miss).collect();
            let size = |v: &[f64]| v.iter().take(moving).fold(0.0_f64, |size, v| size.max(v.abs()));
            if size(&misses) <= BALANCED * size(&forces).max(size(load))
                || !solved.outcome.converged()
            {
                for (k, velocity) in velocity.iter_mut().enumerate().take(moving) {
                    *velocity = (self.position[k] - from[k]) / duration;
                }
                return Ok(solved);
            }
            let row = |k: usize| {
                let entry = |l: usize| if k == l { inertia - slopes[k][l] } else { -slopes[k][l] };
                (0..moving).map(entry).collect()
            };
            let found = eliminate((0..moving).map(row).collect(), misses);
            let mut way = found.ok_or("the wall's motion has no derivative")?;
            // No step halves a gap.
            let thin = solved.film.gap.iter().copied().fold(f64::INFINITY, f64::min);
            let next = loop {
                let mut next = self.position.clone();
                next.iter_mut().zip(&way).for_each(|(at, by)| *at -= by);
                let film = at(self, &next);
                if let Some(film) =
                    film.filter(|film| film.gap.iter().all(|&gap| gap >= 0.5 * thin))
                {
                    self.position = next;
                    break film;
                }
                way.iter_mut().for_each(|by| *by /= 2.0);
            };
            solved = Solved::new(next, Some(&solved), arguments)?;
        }
        Err("the step did not settle; take shorter steps".into())
    }
}

/// Takes the steps of the file; `figures` has load and friction as they are reported.
pub(super) fn run(
    path: &Path,
    posed: &mut Posed,
    arguments: &Arguments,
    figures: impl Fn(&Posed, &Film, &FilmFigures, &[f64]) -> [f64; 6],
) -> Result<Run, Box<dyn Error>> {
    let rows = schedule(path, posed, arguments)?;
    let mass = arguments.mass;
    let mut velocity = vec![0.0; posed.position.len()];
    if mass.is_none() {
        posed.position = rows[0].1.clone();
    }
    let first = posed.at(&posed.position).ok_or("the walls meet")?;
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
    let (mut lines, mut entered, mut squeezing) = (vec![], 0.0, 0.0);
    let bar = progress::counting(rows.len() - 1);
    for (pair, row) in rows.windows(2).zip(2..) {
        let duration = pair[1].0 - pair[0].0;
        let step = TimeStep { duration, oil: oil.clone() };
        let before = posed.position.clone();
        let next = if let Some(mass) = mass {
            let body = (mass, velocity.as_mut_slice());
            let fallen = posed.fall(&step, body, &pair[1].1, solved.as_ref(), arguments);
            fallen.map_err(|error| format!("{}: row {row}: {error}", printable(path.display())))?
        } else {
            posed.position = pair[1].1.clone();
            let moved = posed.at(&posed.position).ok_or("the walls meet")?;
            Solved::new(Film { step: Some(step), ..moved }, solved.as_ref(), arguments)?
        };
        all_converged &= next.outcome.converged();
        // What the solve leaves of a balance goes into the next step, so that nothing adds up.
        let out = next.film.outflow(&next.z, &next.r);
        oil.iter_mut().zip(out).for_each(|(oil, out)| *oil -= duration / area * out);
        let mut found = next.film.figures(&next.z, &next.r, posed.ambient);
        let forces = posed.forces(&next.film, &next.z);
        let ways = posed.position.iter().zip(&before).map(|(now, before)| now - before);
        squeezing =
            -forces.iter().zip(ways).map(|(force, way)| force * way).sum::<f64>() / duration;
        found.power += squeezing;
        let supplied = found.supplies.iter().fold(0.0, |sum, flow| sum + flow);
        entered += duration * (supplied - found.sides.iter().sum::<f64>());
        let mut line = vec![pair[1].0];
        line.extend(figures(posed, &next.film, &found, &next.z));
        line.extend(found.sides);
        line.extend([supplied, total(&oil), found.peak, found.least_gap, found.broken_share]);
        line.extend(posed.told(arguments));
        lines.push(line.iter().map(f64::to_string).collect::<Vec<_>>().join(","));
        solved = Some(next);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let imbalance = (total(&oil) - begun - entered) / (rows[rows.len() - 1].0 - rows[0].0);
    let solved = solved.ok_or("there are no steps")?;
    let place = match posed.journal {
        Some(_) => "displacement along the load (m),displacement across it (m)",
        None => "rise (m),slope along x,slope along y",
    };
    let (csv, steps) = (chart::csv(&format!("{HEAD},{place}"), &lines), lines.len());
    Ok(Run { solved, csv, imbalance, squeezing, steps, all_converged })
}
