//! The position that carries the load of the command line.

use hlcp::film::{Bearing, Load, Settings, Solved};

use super::{Arguments, NAMED, Numbers, gap::by_cells};
use crate::Fallible;

/// The load that is asked for, in SI units.
pub(super) fn load(bearing: &Bearing, arguments: &Arguments) -> Result<Option<Load>, String> {
    let Some(Numbers(numbers)) = &arguments.load else { return Ok(None) };
    let at = match numbers[..] {
        [_] => None,
        [_, x, y] if bearing.journal.is_none() => {
            let (at, ends) = ([x, y].map(|v| v * arguments.x_unit), bearing.film.lengths);
            if let Some(axis) = (0..2).find(|&axis| !(0.0..=ends[axis]).contains(&at[axis])) {
                let (name, place, end) = (["X", "Y"][axis], at[axis], ends[axis]);
                return Err(format!(
                    "--load: {name} is {place} m, outside the film, which ends at {end} m; X and Y are in units of --x-unit"
                ));
            }
            Some(at)
        }
        _ => return Err("--load takes LOAD, or LOAD,X,Y of anything but a journal".into()),
    };
    let force = numbers[0];
    if force <= 0.0 {
        return Err(format!("--load is {force} N, but it must be positive"));
    }
    // A motion has the attitude 0 if not another one.
    let attitude = arguments.attitude.or(arguments.motion.as_ref().map(|_| 0.0));
    let direction = attitude.map(|attitude| bearing.load_direction(attitude));
    Ok(Some(Load { force, at, direction }))
}

/// Moves the wall to where it carries the load of the command line; the solves that it took.
pub(super) fn equilibrium(
    bearing: &mut Bearing,
    arguments: &Arguments,
    settings: &Settings<'_>,
) -> Fallible<(Solved, usize)> {
    let Some(load) = load(bearing, arguments)? else {
        let film = bearing.here().expect("the position has been checked");
        return Ok((Solved::new(film, None, settings)?, 1));
    };
    let gap = bearing.here().map_or(vec![], |film| film.gap);
    let thin = gap.into_iter().fold(f64::INFINITY, f64::min);
    let carried = bearing.carry(&load, None, settings)?;
    if carried.found || !carried.solved.outcome.converged() {
        return Ok((carried.solved, carried.films[0]));
    }
    let place = match load.at.map(|at| at.map(|v| v / arguments.x_unit)) {
        Some([x, y]) => format!(" at {x}, {y} in units of --x-unit"),
        None => String::new(),
    };
    let way_out = NAMED.sizes(thin, &carried.solved.film.lengths, 0.0, 0.0).unwrap_or_else(|| {
        let journal = bearing.journal.is_some();
        let begin = if journal { "--ecc" } else { "gaps nearer to the right ones" };
        let cells = by_cells(arguments, "finer");
        format!(
            "give --load in N, check the units of the film, resolve where it is narrow, {cells}, \
             or begin elsewhere, by {begin}"
        )
    });
    let (force, why) = (load.force, carried.failure(load.force));
    let what = format!("the search for a position that carries {force} N{place} failed");
    Err(format!("--load: {what}; {why}; {way_out}").into())
}
