//! From the command line to a film: its gap, sides and supplies, and the position of its wall.

use std::{f64::consts::PI, path::Path};

use hlcp::{
    files::printable,
    film::{Bearing, Film, Journal, Lobes, Map, Pad, Parameter, Pocket, Side, Supply},
    number,
};

use super::{Arguments, Numbers, Viscosity, real};
use crate::{Fallible, memory};

/// What a film takes for each cell, at least: 640 to 720 bytes by the usual method.
const BYTES: usize = 400;

/// A pad without texture, in the user's units.
pub(super) fn pad(text: &str) -> Result<Pad, String> {
    let (name, rest) = text.split_once(',').unwrap_or((text, ""));
    let numbers = rest.parse().map(|Numbers(numbers)| numbers).unwrap_or_default();
    Ok(match (name, &numbers[..]) {
        ("plane", &[west, east]) => Pad::Plane([west, east]),
        ("taper", &[west, land, length]) if length > 0.0 => Pad::Taper([west, land], length),
        ("parabola", &[least, radius]) => Pad::Parabola { least, radius, at: None },
        ("parabola", &[least, radius, at]) => Pad::Parabola { least, radius, at: Some(at) },
        _ => {
            let wanted = "a pad is plane,WEST,EAST or taper,WEST,LAND,LENGTH or parabola,LEAST,RADIUS[,X], in numbers";
            return Err(wanted.into());
        }
    })
}

/// Five numbers, and whether an ellipse is meant.
fn outline(text: &str, wanted: &str) -> Result<([f64; 5], bool), String> {
    let stem = text.strip_suffix(",ellipse");
    let numbers = stem.unwrap_or(text).parse().map_or(vec![], |Numbers(numbers)| numbers);
    let numbers =
        numbers.try_into().map_err(|_| format!("{wanted} in numbers, or with ,ellipse"))?;
    Ok((numbers, stem.is_some()))
}

/// A pocket in the user's units.
pub(super) fn pocket(text: &str) -> Result<Pocket, String> {
    let ([x, y, lx, ly, depth], ellipse) = outline(text, "a pocket is x,y,lx,ly,depth")?;
    if lx <= 0.0 || ly <= 0.0 {
        return Err("the extents of a pocket must be positive".into());
    }
    Ok(Pocket { corner: [x, y], size: [lx, ly], depth, ellipse })
}

/// How many along x and y, and one of them, in the user's units.
pub(super) type Dimples = ([usize; 2], Pocket);

pub(super) fn dimples(text: &str) -> Result<Dimples, String> {
    let ([kx, ky, lx, ly, depth], ellipse) = outline(text, "dimples are kx,ky,lx,ly,depth")?;
    if [kx, ky].iter().any(|k| !(1.0..=1e4).contains(k) || k.fract() != 0.0) {
        return Err("the numbers of dimples must be whole, from 1 to 10000".into());
    }
    if lx <= 0.0 || ly <= 0.0 {
        return Err("the extents of a dimple must be positive".into());
    }
    let one = Pocket { corner: [0.0; 2], size: [lx, ly], depth, ellipse };
    Ok(([kx, ky].map(|k| k as usize), one))
}

/// The place of a side and what it is, with a pressure in the user's units.
pub(super) type Sided = (usize, Side);

pub(super) const SIDES: [&str; 4] = ["west", "east", "south", "north"];

pub(super) fn sided(text: &str) -> Result<Sided, String> {
    let wanted =
        "a side is west, east, south or north = a pressure, closed, periodic or starved,CONTENT";
    let (name, what) = text.split_once('=').ok_or(wanted)?;
    let place = SIDES.iter().position(|side| *side == name).ok_or(wanted)?;
    let side = match (what, what.strip_prefix("starved,")) {
        ("closed", _) => Side::Closed,
        ("periodic", _) => Side::Periodic,
        ("starved", _) => Side::Starved(0.0),
        (_, Some(content)) => match content.parse() {
            Ok(content) if (0.0..=1.0).contains(&content) => Side::Starved(content),
            _ => return Err(format!("the film content '{content}' is not between 0 and 1")),
        },
        (pressure, None) => Side::Pressure(real(|_| true, wanted)(pressure)?),
    };
    Ok((place, side))
}

fn lobed(numbers: &Numbers) -> Result<Lobes, String> {
    let takes = "COUNT,PRELOAD[,OFFSET[,DEGREES]]";
    let [count, preload, offset, degrees] = numbers.filled("lobes", takes, &[0.5, 0.0])?;
    if !(1.0..=1e3).contains(&count) || count.fract() != 0.0 {
        return Err(format!(
            "--lobes takes {takes}, with a whole COUNT from 1 to 1000, not {count}"
        ));
    }
    let lobes = Lobes { count: count as usize, preload, offset, middle: degrees.to_radians() };
    lobes.check().map_err(|error| format!("--lobes: {error}"))?;
    Ok(lobes)
}

fn in_si(pocket: &Pocket, arguments: &Arguments) -> Pocket {
    let [corner, size] =
        [pocket.corner, pocket.size].map(|pair| pair.map(|v| v * arguments.x_unit));
    Pocket { corner, size, depth: pocket.depth * arguments.h_unit, ..*pocket }
}

/// A pocket, and the option that it comes from.
type Asked = (&'static str, Pocket);

/// The pockets, and after them those of pressure dams.
fn pockets(bearing: &Bearing, arguments: &Arguments) -> Result<Vec<Asked>, String> {
    let own = arguments.pocket.iter().map(|pocket| ("pocket", in_si(pocket, arguments)));
    let mut all: Vec<Asked> = own.collect();
    for (dam, journal) in arguments.dam.iter().zip(bearing.journal.iter().cycle()) {
        let [from, to, length, depth] = dam.exactly("dam", "FROM,TO,LENGTH,DEPTH")?;
        if !(from < to && to < from + 360.0 && length > 0.0) {
            return Err(format!(
                "--dam from {from} to {to} degrees with a length of {length}: it ends less than a \
                 turn beyond where it begins, and its length is positive"
            ));
        }
        let [length, depth] = [length * arguments.x_unit, depth * arguments.h_unit];
        all.push(("dam", journal.dam([from, to], length, depth)));
    }
    Ok(all)
}

/// What says how many cells there are: a map that is finer or coarser, or options.
pub(super) fn by_cells(arguments: &Arguments, other: &str) -> String {
    match arguments.map {
        Some(_) => format!("by a {other} --map"),
        None => "by --nx and --ny".into(),
    }
}

fn dig(
    bearing: &mut Bearing,
    (option, pocket): Asked,
    arguments: &Arguments,
) -> Result<(), String> {
    let x_unit = arguments.x_unit;
    is_inside(option, pocket.corner, pocket.size, bearing, x_unit)?;
    let film = &mut bearing.film;
    if pocket.dig(film) {
        return Ok(());
    }
    let cell = [film.lengths[0] / film.nx as f64, film.lengths[1] / film.ny as f64];
    let [[lx, ly], [dx, dy]] = [pocket.size, cell].map(|pair| pair.map(|v| number(v / x_unit)));
    Err(format!(
        "--{option} of {lx} by {ly} is lost in cells of {dx} by {dy}, in units of \
         --x-unit; check its size, or take more cells {}",
        by_cells(arguments, "finer")
    ))
}

pub(super) fn posed(arguments: &Arguments) -> Fallible<Bearing> {
    let [x_unit, h_unit, p_unit] = [arguments.x_unit, arguments.h_unit, arguments.p_unit];
    let map = arguments.map.as_deref().map(Map::read_gap).transpose()?;
    let [nx, ny] = match &map {
        Some(map) => [map.columns, map.rows],
        None => {
            let default = if arguments.journal { 360 } else { 180 };
            [arguments.nx.unwrap_or(default), arguments.ny.unwrap_or(60)].map(|n| n as usize)
        }
    };
    if arguments.journal && nx < 3 {
        return Err(format!("--nx is {nx}, but a journal takes 3 cells or more around it").into());
    }
    let cells = nx.checked_mul(ny).filter(|&cells| cells <= 1 << 28);
    let fewer = format!("take fewer {}", by_cells(arguments, "coarser"));
    let cells =
        cells.ok_or_else(|| format!("the film has more than 268 million cells; {fewer}"))?;
    memory::check(cells, BYTES, &fewer)?;
    let tilt = arguments.tilt.as_ref().map_or(Ok([0.0; 2]), |tilt| tilt.exactly("tilt", "A,B"))?;
    let sizes = (arguments.diameter, arguments.length, arguments.lx, arguments.ly);
    let lobes = arguments.lobes.as_ref().map(lobed).transpose()?;
    let mut bearing = match (sizes, arguments.clearance) {
        ((Some(diameter), Some(length), None, None), Some(clearance)) => {
            let ecc = match (arguments.ecc, &arguments.load, &arguments.motion) {
                (Some(ecc), ..) if (0.0..1.0).contains(&ecc) => ecc,
                (Some(ecc), ..) => {
                    return Err(format!("--ecc is {ecc}, but an eccentricity over the clearance is at least 0 and below 1").into());
                }
                (None, Some(_), _) => {
                    let of_tilt = tilt[0].hypot(tilt[1]) * length * x_unit / 2.0;
                    let preload = lobes.map_or(0.0, |lobes| lobes.preload);
                    0.5 * (1.0 - preload - of_tilt / (clearance * h_unit)).max(0.0)
                }
                (None, None, Some(_)) => 0.0,
                (None, None, None) => {
                    return Err("a journal needs its position: give --ecc, from 0 to below 1, or --load or --motion".into());
                }
            };
            let round = Journal::round(diameter * x_unit, length * x_unit, clearance * h_unit);
            let position = vec![ecc * round.clearance, 0.0];
            let journal = Journal { tilt, lobes, ..round };
            Bearing { position, ..Bearing::journal(journal, [nx, ny]) }
        }
        ((None, None, Some(lx), Some(ly)), None) => {
            let film = Film::new([nx, ny], [lx, ly].map(|length| length * x_unit), 0.0, 1.0);
            let pad = arguments.pad.map(|pad| match pad {
                Pad::Plane(ends) => Pad::Plane(ends.map(|h| h * h_unit)),
                Pad::Taper(ends, length) => Pad::Taper(ends.map(|h| h * h_unit), length * x_unit),
                Pad::Parabola { least, radius, at } => {
                    let (least, radius) = (least * h_unit, radius * x_unit);
                    Pad::Parabola { least, radius, at: at.map(|at| at * x_unit) }
                }
            });
            let read = |map: Map| map.values.iter().map(|h| h * h_unit).collect();
            let film = match (map, pad) {
                (Some(map), _) => Film { gap: read(map), ..film },
                (None, pad) => pad.expect("clap wants a film").gap(film),
            };
            Bearing { position: vec![0.0, tilt[0], tilt[1]], pad, ..Bearing::pad(film) }
        }
        _ => {
            return Err(
                "a journal takes --diameter and --length, anything else --lx and --ly".into()
            );
        }
    };
    let lengths = bearing.film.lengths;
    let rough = arguments.roughness.as_deref().map(|path| same(path, [nx, ny])).transpose()?;
    if let Some(rough) = rough {
        let gaps = bearing.film.gap.iter_mut().zip(&rough.values);
        gaps.for_each(|(h, rough)| *h += rough * h_unit);
    }
    for pocket in pockets(&bearing, arguments)? {
        dig(&mut bearing, pocket, arguments)?;
    }
    for (counts, one) in &arguments.dimples {
        let one = in_si(one, arguments);
        let [lx, ly] = [0, 1].map(|axis| lengths[axis] / counts[axis] as f64);
        if one.size[0] > lx * (1.0 + 1e-9) || one.size[1] > ly * (1.0 + 1e-9) {
            let [lx, ly] = [lx, ly].map(|v| number(v / x_unit));
            return Err(format!("--dimples overlap; the film has {lx} by {ly} for each").into());
        }
        let mut all = one.repeated(*counts, lengths);
        all.try_for_each(|pocket| dig(&mut bearing, ("dimples", pocket), arguments))?;
    }

    let film = &mut bearing.film;
    let ambient = arguments.ambient * p_unit;
    film.cavitation = arguments.cavitation * p_unit;
    film.viscosity = match &arguments.viscosity {
        Some(Viscosity::Map(path)) => same(path, [nx, ny])?.values,
        Some(Viscosity::Uniform(viscosity)) => vec![*viscosity],
        None => unreachable!("clap wants a viscosity"),
    };
    if let Some(at) = film.viscosity.iter().position(|&v| v <= 0.0) {
        let (row, column, value) = (at / nx + 1, at % nx + 1, film.viscosity[at]);
        return Err(
            format!("--viscosity: row {row}, column {column}: {value} is not positive").into()
        );
    }
    film.speeds = match (&arguments.speed, arguments.rpm, arguments.diameter) {
        (Some(Numbers(speeds)), ..) => [speeds[0], speeds.get(1).copied().unwrap_or(0.0)],
        (None, Some(rpm), Some(diameter)) => [PI * diameter * x_unit * rpm / 60.0, 0.0],
        (None, ..) => [0.0; 2],
    };
    film.sides = sides(arguments, ambient)?;
    if ambient < film.cavitation {
        let below = film.cavitation;
        return Err(format!(
            "--ambient is {ambient} Pa, below --cavitation, {below} Pa: oil at that pressure breaks"
        )
        .into());
    }
    for supply in &arguments.supply {
        let [x, y, lx, ly, pressure] = supply.exactly("supply", "x,y,lx,ly,pressure")?;
        let [corner, size] = [[x, y], [lx, ly]].map(|pair| pair.map(|v| v * x_unit));
        is_inside("supply", corner, size, &bearing, x_unit)?;
        bearing.film.supplies.push(Supply { corner, size, pressure: pressure * p_unit });
    }
    for (groove, journal) in arguments.groove.iter().zip(bearing.journal.iter().cycle()) {
        let usual = [arguments.ambient, 0.0, arguments.length.unwrap_or_default()];
        let [degrees, pressure, width, length] =
            groove.filled("groove", "DEGREES[,PRESSURE[,WIDTH[,LENGTH]]]", &usual)?;
        if degrees.abs() > 360.0 {
            return Err(format!(
                "--groove: an angle of {degrees} degrees, but it must be between -360 and 360; it \
                 comes before the pressure"
            )
            .into());
        }
        let (length, whole) = (length * x_unit, journal.length);
        if !(0.0..360.0).contains(&width) || length <= 0.0 || length > whole * (1.0 + 1e-9) {
            return Err(format!(
                "--groove: a width of {width} degrees and a length of {length} m, but the width \
                 must be 0 or more and below 360 degrees, and the length positive and at most that \
                 of the bearing, {whole} m"
            )
            .into());
        }
        let supply = journal.groove(degrees, [width, length], pressure * p_unit);
        bearing.film.supplies.push(supply);
    }
    bearing.ambient = ambient;
    check(&bearing, arguments)?;
    Ok(bearing)
}

/// The numbers that figures have derivatives by, each with its name and its unit.
pub(super) fn parameters(
    bearing: &Bearing,
    arguments: &Arguments,
) -> Vec<(String, &'static str, Parameter)> {
    // Under a load the position is no parameter.
    let mut all = bearing.parameters(arguments.load.is_none());
    let blank = Film { gap: vec![0.0; bearing.film.gap.len()], ..bearing.film.clone() };
    let deeper = |name: String, pockets: &mut dyn Iterator<Item = Pocket>| {
        let mut film = blank.clone();
        for pocket in pockets {
            Pocket { depth: 1.0, ..pocket }.dig(&mut film);
        }
        (name, "m", Parameter::Gap(film.gap))
    };
    for (k, (_, pocket)) in pockets(bearing, arguments).into_iter().flatten().enumerate() {
        all.push(deeper(format!("pockets[{k}]"), &mut [pocket].into_iter()));
    }
    for (k, (counts, one)) in arguments.dimples.iter().enumerate() {
        let mut each = in_si(one, arguments).repeated(*counts, bearing.film.lengths);
        all.push(deeper(format!("dimples[{k}]"), &mut each));
    }
    all
}

/// Refuses a gap that is not open, and supplies that do not fit.
fn check(bearing: &Bearing, arguments: &Arguments) -> Result<(), String> {
    let is_driven = arguments.motion.is_some() && arguments.load.is_none();
    if !is_driven && bearing.here().is_none() {
        let nearest = bearing.nearest(&bearing.position).filter(|[gap, _]| *gap <= 0.0);
        if let Some([gap, place]) = nearest {
            return Err(if bearing.journal.is_some() {
                format!(
                    "the journal meets its bush at an end, {:.1} degrees from x = 0, where the gap \
                     is {gap:e} m; take less of --ecc, --tilt or the preload of --lobes",
                    place.to_degrees()
                )
            } else {
                format!(
                    "the walls meet at x = {place} m, where the gap is {gap:e} m, but it must be \
                     positive everywhere, at the edges as well; see --pad and --tilt"
                )
            });
        }
        let gap = bearing.gap(&bearing.position);
        let at = gap.iter().position(|&gap| !(gap > 0.0 && gap.is_finite()));
        let at = at.unwrap_or_default();
        let (row, column) = (at / bearing.film.nx + 1, at % bearing.film.nx + 1);
        let map = arguments.map.as_ref().map(|path| printable(path.display()));
        let (what, gap) = (map.unwrap_or("the film".into()), gap[at]);
        return Err(format!(
            "{what}: row {row}, column {column}: the gap is {gap:e} m, but it must be positive"
        ));
    }
    let probe = Film { gap: vec![1.0; bearing.film.gap.len()], ..bearing.film.clone() };
    let posed = probe.pose().map(drop);
    posed.map_err(|error| format!("{error}; see --side, --supply and --groove"))
}

/// Refuses a rectangle that is not in the film, in units of `x_unit`.
fn is_inside(
    option: &str,
    corner: [f64; 2],
    size: [f64; 2],
    bearing: &Bearing,
    x_unit: f64,
) -> Result<(), String> {
    let Some(axis) = bearing.outside(corner, size) else { return Ok(()) };
    let (name, length) = (["x", "y"][axis], bearing.film.lengths[axis]);
    let places = [corner[axis], corner[axis] + size[axis], length];
    let [from, to, length] = places.map(|place| number(place / x_unit));
    Err(format!(
        "--{option} from {name} = {from} to {to} is outside the film, which ends at {length}"
    ))
}

/// A map of the same cells.
fn same(path: &Path, [nx, ny]: [usize; 2]) -> Fallible<Map> {
    let map = Map::read(path)?;
    if [map.columns, map.rows] == [nx, ny] {
        return Ok(map);
    }
    let (rows, columns, path) = (map.rows, map.columns, printable(path.display()));
    Err(format!("{path} has {rows} rows and {columns} columns, but the film has {ny} and {nx}")
        .into())
}

fn sides(arguments: &Arguments, ambient: f64) -> Result<[Side; 4], String> {
    let mut sides = [Side::Pressure(ambient); 4];
    if arguments.journal {
        (sides[0], sides[1]) = (Side::Periodic, Side::Periodic);
    }
    for (k, &(place, side)) in arguments.side.iter().enumerate() {
        let name = SIDES[place];
        if arguments.side[..k].iter().any(|(before, _)| *before == place) {
            return Err(format!("--side {name} is given twice"));
        }
        if arguments.journal && place < 2 {
            return Err(format!("--side {name}: around a journal the sides are periodic"));
        }
        sides[place] = match side {
            Side::Pressure(pressure) => Side::Pressure(pressure * arguments.p_unit),
            other => other,
        };
    }
    for k in [0, 2] {
        if (sides[k] == Side::Periodic) != (sides[k + 1] == Side::Periodic) {
            let [one, other] = [SIDES[k], SIDES[k + 1]];
            return Err(format!(
                "--side {one} and --side {other} must both be periodic, or neither"
            ));
        }
    }
    Ok(sides)
}
