//! From the command line to a film: its gap, sides and supplies, and the position of its wall.

use std::{error::Error, f64::consts::PI, path::Path, str::FromStr};

use hlcp::files::printable;
use hlcp_verify::{Film, Side, Supply};

use super::{Arguments, Numbers, Viscosity, array, array::Array};
use crate::memory;

type Fallible<T> = Result<T, Box<dyn Error>>;

/// What a film takes for each cell, at least: 640 to 720 bytes by the usual method.
const BYTES: usize = 400;

/// A pad without texture, in the user's units.
#[derive(Debug, Clone)]
pub(super) enum Pad {
    Plane([f64; 2]),
    Parabola { least: f64, radius: f64, at: Option<f64> },
}

impl FromStr for Pad {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, rest) = text.split_once(',').unwrap_or((text, ""));
        let numbers = rest.parse().map(|Numbers(numbers)| numbers).unwrap_or_default();
        match (name, &numbers[..]) {
            ("plane", &[west, east]) => Ok(Self::Plane([west, east])),
            ("parabola", &[least, radius]) => Ok(Self::Parabola { least, radius, at: None }),
            ("parabola", &[least, radius, at]) => {
                Ok(Self::Parabola { least, radius, at: Some(at) })
            }
            _ => Err("a pad is plane,WEST,EAST or parabola,LEAST,RADIUS[,X], in numbers".into()),
        }
    }
}

/// Five numbers, and whether an ellipse is meant.
fn outline(text: &str, wanted: &str) -> Result<([f64; 5], bool), String> {
    let stem = text.strip_suffix(",ellipse");
    let numbers = stem.unwrap_or(text).parse().map_or(vec![], |Numbers(numbers)| numbers);
    let numbers =
        numbers.try_into().map_err(|_| format!("{wanted} in numbers, or with ,ellipse"))?;
    Ok((numbers, stem.is_some()))
}

#[derive(Debug, Clone)]
pub(super) struct Pocket {
    corner: [f64; 2],
    size: [f64; 2],
    depth: f64,
    ellipse: bool,
}

impl FromStr for Pocket {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let ([x, y, lx, ly, depth], ellipse) = outline(text, "a pocket is x,y,lx,ly,depth")?;
        if lx <= 0.0 || ly <= 0.0 {
            return Err("the extents of a pocket must be positive".into());
        }
        Ok(Self { corner: [x, y], size: [lx, ly], depth, ellipse })
    }
}

#[derive(Debug, Clone)]
pub(super) struct Dimples {
    counts: [f64; 2],
    size: [f64; 2],
    depth: f64,
    ellipse: bool,
}

impl FromStr for Dimples {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let ([kx, ky, lx, ly, depth], ellipse) = outline(text, "dimples are kx,ky,lx,ly,depth")?;
        if [kx, ky].iter().any(|k| !(1.0..=1e4).contains(k) || k.fract() != 0.0) {
            return Err("the numbers of dimples must be whole, from 1 to 10000".into());
        }
        if lx <= 0.0 || ly <= 0.0 {
            return Err("the extents of a dimple must be positive".into());
        }
        Ok(Self { counts: [kx, ky], size: [lx, ly], depth, ellipse })
    }
}

impl Dimples {
    /// The pockets on a film of these extents, in the same unit.
    fn pockets(&self, lengths: [f64; 2]) -> Fallible<impl Iterator<Item = Pocket>> {
        let tile = [0, 1].map(|axis| lengths[axis] / self.counts[axis]);
        if (0..2).any(|axis| self.size[axis] > tile[axis] * (1.0 + 1e-9)) {
            let [lx, ly] = tile;
            return Err(format!("--dimples overlap; the film has {lx} by {ly} for each").into());
        }
        let [kx, ky] = self.counts.map(|count| count as usize);
        let Self { size, depth, ellipse, .. } = *self;
        let place = move |k: usize| {
            let corner = [k % kx, k / kx].map(|at| at as f64 + 0.5);
            let corner = [0, 1].map(|axis| corner[axis] * tile[axis] - size[axis] / 2.0);
            Pocket { corner, size, depth, ellipse }
        };
        Ok((0..kx * ky).map(place))
    }
}

/// A side and what it is.
#[derive(Debug, Clone)]
pub(super) struct Sided {
    place: usize,
    what: What,
}

#[derive(Debug, Clone, Copy)]
enum What {
    Pressure(f64),
    Side(Side),
}

const SIDES: [&str; 4] = ["west", "east", "south", "north"];

impl FromStr for Sided {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = || "a side is west, east, south or north = a pressure, closed, periodic or starved,CONTENT";
        let (name, what) = text.split_once('=').ok_or_else(wanted)?;
        let place = SIDES.iter().position(|side| *side == name).ok_or_else(wanted)?;
        let what = match what {
            "closed" => What::Side(Side::Closed),
            "periodic" => What::Side(Side::Periodic),
            "starved" => What::Side(Side::Starved(0.0)),
            _ => match what.strip_prefix("starved,") {
                Some(content) => match content.parse() {
                    Ok(content) if (0.0..=1.0).contains(&content) => {
                        What::Side(Side::Starved(content))
                    }
                    _ => {
                        return Err(format!("the film content '{content}' is not between 0 and 1"));
                    }
                },
                None => match what.parse() {
                    Ok(pressure) if f64::is_finite(pressure) => What::Pressure(pressure),
                    _ => return Err(wanted().into()),
                },
            },
        };
        Ok(Self { place, what })
    }
}

/// A film whose gap depends on the position of a wall: `base + Σ position · mode`.
pub(super) struct Posed {
    pub(super) film: Film,
    pub(super) base: Vec<f64>,
    /// ∂h/∂position: of a journal its displacement along the eccentricity of the command line and,
    /// a quarter further along x, across it; elsewhere rise, and slopes along x and y around the
    /// middle.
    pub(super) modes: Vec<Vec<f64>>,
    pub(super) position: Vec<f64>,
    /// The pressure from which loads are counted.
    pub(super) ambient: f64,
    /// Of a journal its clearance and radius.
    pub(super) journal: Option<[f64; 2]>,
    /// How the eccentricity of a journal grows along y, along the coordinates of its position.
    turn: [f64; 2],
}

impl Posed {
    /// Moves the wall; `None` if it meets the other one, and a journal its bush, also between the
    /// middles of cells.
    pub(super) fn at(&self, position: &[f64]) -> Option<Film> {
        if self.eccentricity(position).is_some_and(|ecc| ecc >= 1.0) {
            return None;
        }
        let mut gap = self.base.clone();
        for (mode, by) in self.modes.iter().zip(position) {
            gap.iter_mut().zip(mode).for_each(|(gap, mode)| *gap += by * mode);
        }
        let clear = gap.iter().all(|&gap| gap > 0.0 && gap.is_finite());
        clear.then(|| Film { gap, ..self.film.clone() })
    }

    /// Of a journal the largest eccentricity of its two ends over the clearance.
    fn eccentricity(&self, position: &[f64]) -> Option<f64> {
        let [clearance, _] = self.journal?;
        let [along, across] = self.turn.map(|slope| slope * self.film.lengths[1] / 2.0);
        let end = |sign: f64| (position[0] + sign * along).hypot(position[1] + sign * across);
        Some(end(1.0).max(end(-1.0)) / clearance)
    }

    /// The forces of a pressure along the position's coordinates: of a journal those of the film on
    /// it, elsewhere the load and its moments.
    pub(super) fn forces(&self, film: &Film, z: &[f64]) -> Vec<f64> {
        let p = film.pressures(z);
        let along = |mode: &Vec<f64>| {
            let terms = p.iter().zip(mode).map(|(p, mode)| (p - self.ambient) * mode);
            terms.sum::<f64>() * film.cell()
        };
        self.modes.iter().map(along).collect()
    }

    pub(super) fn new(arguments: &Arguments) -> Fallible<Self> {
        let [x_unit, h_unit, p_unit] = [arguments.x_unit, arguments.h_unit, arguments.p_unit];
        let map = arguments.map.as_deref().map(array::read_map).transpose()?;
        let [nx, ny] = match &map {
            Some(map) => [map.columns, map.rows],
            None => {
                let default = if arguments.journal { 360 } else { 180 };
                [arguments.nx.unwrap_or(default), arguments.ny.unwrap_or(60)].map(|n| n as usize)
            }
        };
        let cells = nx.checked_mul(ny).filter(|&cells| cells <= 1 << 28);
        let cells = cells.ok_or("--nx times --ny is more than 268 million cells")?;
        memory::check(cells, BYTES, "take fewer cells by --nx and --ny")?;
        let lengths = match (arguments.diameter, arguments.length, arguments.lx, arguments.ly) {
            (Some(diameter), Some(length), None, None) => [PI * diameter * x_unit, length * x_unit],
            (None, None, Some(lx), Some(ly)) => [lx * x_unit, ly * x_unit],
            _ => {
                return Err(
                    "a journal takes --diameter and --length, anything else --lx and --ly".into()
                );
            }
        };
        let middle = |axis: usize, k: usize| {
            let (at, count) = if axis == 0 { (k % nx, nx) } else { (k / nx, ny) };
            (at as f64 + 0.5) / count as f64 * lengths[axis]
        };
        let mode = |value: &dyn Fn(usize) -> f64| (0..cells).map(value).collect::<Vec<f64>>();
        let tilt =
            arguments.tilt.as_ref().map_or(Ok([0.0; 2]), |tilt| tilt.exactly("tilt", "A,B"))?;

        let (modes, mut base, position, journal) = if let Some(clearance) = arguments.clearance {
            let c = clearance * h_unit;
            let ecc = match arguments.ecc {
                Some(ecc) if (0.0..1.0).contains(&ecc) => ecc,
                Some(ecc) => {
                    return Err(format!("--ecc is {ecc}, but an eccentricity over the clearance is at least 0 and below 1").into());
                }
                None if arguments.load.is_some() => 0.5,
                None if arguments.motion.is_some() => 0.0,
                None => {
                    return Err("a journal needs its position: give --ecc, from 0 to below 1, or --load or --motion".into());
                }
            };
            let radius = lengths[0] / (2.0 * PI);
            let along = mode(&|k| (middle(0, k) / radius).cos());
            let across = mode(&|k| (middle(0, k) / radius).sin());
            let lever = |k: usize| middle(1, k) - lengths[1] / 2.0;
            let base = mode(&|k| c + lever(k) * (tilt[0] * along[k] + tilt[1] * across[k]));
            (vec![along, across], base, vec![ecc * c, 0.0], Some([c, radius]))
        } else {
            let base = match (&map, &arguments.pad) {
                (Some(map), _) => map.values.iter().map(|h| h * h_unit).collect(),
                (None, Some(Pad::Plane(ends))) => mode(&|k| {
                    let [west, east] = ends.map(|h| h * h_unit);
                    west + (east - west) * middle(0, k) / lengths[0]
                }),
                (None, Some(Pad::Parabola { least, radius, at })) => mode(&|k| {
                    let at = at.map_or(lengths[0] / 2.0, |at| at * x_unit);
                    least * h_unit + (middle(0, k) - at).powi(2) / (2.0 * radius * x_unit)
                }),
                (None, None) => {
                    return Err("there is no film: give --map, --pad or --journal".into());
                }
            };
            let slope = |axis: usize| mode(&|k| middle(axis, k) - lengths[axis] / 2.0);
            let modes = vec![vec![1.0; cells], slope(0), slope(1)];
            (modes, base, vec![0.0, tilt[0], tilt[1]], None)
        };

        let rough = arguments.roughness.as_deref().map(|path| same(path, [nx, ny])).transpose()?;
        if let Some(rough) = rough {
            base.iter_mut().zip(&rough.values).for_each(|(h, rough)| *h += rough * h_unit);
        }
        let around = arguments.journal;
        for pocket in &arguments.pocket {
            pocket.dig(&mut base, [nx, ny], lengths, [x_unit, h_unit], around)?;
        }
        for dimples in &arguments.dimples {
            for pocket in dimples.pockets(lengths.map(|length| length / x_unit))? {
                pocket.dig(&mut base, [nx, ny], lengths, [x_unit, h_unit], around)?;
            }
        }

        let ambient = arguments.ambient * p_unit;
        let mut film = Film {
            cavitation: arguments.cavitation * p_unit,
            ..Film::new([nx, ny], lengths, 0.0, 1.0)
        };
        film.viscosity = match &arguments.viscosity {
            Some(Viscosity::Map(path)) => same(path, [nx, ny])?.values,
            Some(Viscosity::Uniform(viscosity)) => vec![*viscosity],
            None => return Err("--viscosity is missing".into()),
        };
        if let Some(at) = film.viscosity.iter().position(|&v| v <= 0.0) {
            let (row, column, value) = (at / nx + 1, at % nx + 1, film.viscosity[at]);
            return Err(format!(
                "--viscosity: row {row}, column {column}: {value} is not positive"
            )
            .into());
        }
        film.speeds = match (&arguments.speed, arguments.rpm, arguments.diameter) {
            (Some(Numbers(speeds)), ..) => [speeds[0], speeds.get(1).copied().unwrap_or(0.0)],
            (None, Some(rpm), Some(diameter)) if rpm.is_finite() => {
                [PI * diameter * x_unit * rpm / 60.0, 0.0]
            }
            (None, Some(_), _) => return Err("--rpm is not a finite number".into()),
            (None, None, _) => [0.0; 2],
        };
        film.sides = sides(arguments, ambient)?;
        if !(ambient >= film.cavitation && ambient.is_finite()) {
            return Err("--ambient is below --cavitation, or not a finite number".into());
        }
        for supply in &arguments.supply {
            let [x, y, lx, ly, pressure] = supply.exactly("supply", "x,y,lx,ly,pressure")?;
            let ends = lengths.map(|length| length / x_unit);
            is_inside("supply", [x, y], [lx, ly], ends, arguments.journal)?;
            let [x, y, lx, ly] = [x, y, lx, ly].map(|v| v * x_unit);
            film.supplies.push(Supply {
                corner: [x, y],
                size: [lx, ly],
                pressure: pressure * p_unit,
            });
        }
        for groove in &arguments.groove {
            let (degrees, pressure) = match groove.0[..] {
                [degrees] => (degrees, ambient),
                [degrees, pressure] => (degrees, pressure * p_unit),
                _ => return Err("--groove takes DEGREES or DEGREES,PRESSURE".into()),
            };
            let x = (degrees / 360.0).rem_euclid(1.0) * lengths[0];
            let size = [0.0, lengths[1]];
            film.supplies.push(Supply { corner: [x, 0.0], size, pressure });
        }
        let turn = if journal.is_some() { tilt } else { [0.0; 2] };
        let posed = Self { film, base, modes, position, ambient, journal, turn };
        posed.check(arguments)?;
        Ok(posed)
    }

    /// The film in the position of the command line.
    pub(super) fn here(&self) -> Film {
        self.at(&self.position).expect("the position has been checked")
    }

    /// Refuses a gap that is not open, and supplies that do not fit.
    fn check(&self, arguments: &Arguments) -> Fallible<()> {
        if arguments.motion.is_none() && self.at(&self.position).is_none() {
            if let Some(ecc) = self.eccentricity(&self.position).filter(|&ecc| ecc >= 1.0) {
                return Err(format!("--tilt: the eccentricity at an end of the journal is {ecc} of the clearance, but it must be below 1").into());
            }
            let gap = |k: usize| {
                let moved = self.modes.iter().zip(&self.position).map(|(mode, by)| by * mode[k]);
                self.base[k] + moved.sum::<f64>()
            };
            let at = (0..self.base.len()).find(|&k| !(gap(k) > 0.0 && gap(k).is_finite()));
            let at = at.unwrap_or_default();
            let (row, column) = (at / self.film.nx + 1, at % self.film.nx + 1);
            let what = match &arguments.map {
                Some(path) => printable(path.display()),
                None => "the film".into(),
            };
            let gap = gap(at);
            return Err(format!(
                "{what}: row {row}, column {column}: the gap is {gap:e} m, but it must be positive"
            )
            .into());
        }
        let probe = Film { gap: vec![1.0; self.base.len()], ..self.film.clone() };
        probe
            .pose()
            .map(drop)
            .map_err(|error| format!("{error}; see --side, --supply and --groove").into())
    }
}

impl Pocket {
    /// Deepens the cells by their part that the pocket covers.
    fn dig(
        &self,
        gap: &mut [f64],
        [nx, ny]: [usize; 2],
        lengths: [f64; 2],
        [x_unit, h_unit]: [f64; 2],
        around: bool,
    ) -> Fallible<()> {
        let [corner, size] = [self.corner, self.size].map(|pair| pair.map(|v| v * x_unit));
        let counts = [nx, ny];
        is_inside("pocket", self.corner, self.size, lengths.map(|length| length / x_unit), around)?;
        // Points per cell and direction; none lies on the edge of a pocket that ends with a cell.
        const POINTS: usize = 8;
        let spacing = [0, 1].map(|axis| lengths[axis] / counts[axis] as f64);
        let range = |axis: usize| {
            let first = (corner[axis] / spacing[axis]).floor().max(0.0) as usize;
            let last = ((corner[axis] + size[axis]) / spacing[axis]).ceil() as usize;
            first..if around && axis == 0 { last } else { last.min(counts[axis]) }
        };
        let mut all = 0;
        for j in range(1) {
            for i in range(0) {
                let place = |axis: usize, at: usize, point: usize| {
                    let along = (at as f64 + (point as f64 + 0.5) / POINTS as f64) * spacing[axis];
                    2.0 * (along - corner[axis]) / size[axis] - 1.0
                };
                let mut covered = 0;
                for point in 0..POINTS * POINTS {
                    let [u, v] = [place(0, i, point % POINTS), place(1, j, point / POINTS)];
                    let inside = if self.ellipse { u * u + v * v } else { u.abs().max(v.abs()) };
                    covered += usize::from(inside <= 1.0);
                }
                gap[j * nx + i % nx] +=
                    self.depth * h_unit * covered as f64 / (POINTS * POINTS) as f64;
                all += covered;
            }
        }
        if all == 0 {
            let [lx, ly] = self.size;
            let [dx, dy] = spacing.map(|length| length / x_unit);
            return Err(format!(
                "a pocket or dimple of {lx} by {ly} is lost in cells of {dx} by {dy}, in units of \
                 --x-unit; check its size, or take more cells by --nx and --ny"
            )
            .into());
        }
        Ok(())
    }
}

/// Refuses a rectangle that is not in the film; around a journal it may reach beyond the end.
fn is_inside(
    option: &str,
    corner: [f64; 2],
    size: [f64; 2],
    lengths: [f64; 2],
    around: bool,
) -> Result<(), String> {
    for axis in 0..2 {
        let (from, to, length) = (corner[axis], corner[axis] + size[axis], lengths[axis]);
        let furthest = if around && axis == 0 { 2.0 * length } else { length };
        let slack = 1e-9 * length;
        if !(from >= -slack && from <= length + slack && to <= furthest + slack) {
            let name = ["x", "y"][axis];
            return Err(format!(
                "--{option} from {name} = {from} to {to} is outside the film, which ends at {length}"
            ));
        }
    }
    Ok(())
}

/// A map of the same cells.
fn same(path: &Path, [nx, ny]: [usize; 2]) -> Fallible<Array> {
    let map = array::read(path)?;
    if [map.columns, map.rows] == [nx, ny] {
        return Ok(map);
    }
    let (rows, columns, path) = (map.rows, map.columns, printable(path.display()));
    Err(format!("{path} has {rows} rows and {columns} columns, but the film has {ny} and {nx}")
        .into())
}

fn sides(arguments: &Arguments, ambient: f64) -> Fallible<[Side; 4]> {
    let mut sides = [Side::Pressure(ambient); 4];
    if arguments.journal {
        (sides[0], sides[1]) = (Side::Periodic, Side::Periodic);
    }
    let mut given = [false; 4];
    for Sided { place, what } in &arguments.side {
        let name = SIDES[*place];
        if std::mem::replace(&mut given[*place], true) {
            return Err(format!("--side {name} is given twice").into());
        }
        if arguments.journal && *place < 2 {
            return Err(format!("--side {name}: around a journal the sides are periodic").into());
        }
        sides[*place] = match what {
            What::Pressure(pressure) => Side::Pressure(pressure * arguments.p_unit),
            What::Side(side) => *side,
        };
    }
    for (pair, names) in sides.chunks(2).zip([["west", "east"], ["south", "north"]]) {
        if (pair[0] == Side::Periodic) != (pair[1] == Side::Periodic) {
            let [one, other] = names;
            return Err(format!(
                "--side {one} and --side {other} must both be periodic, or neither"
            )
            .into());
        }
    }
    Ok(sides)
}
