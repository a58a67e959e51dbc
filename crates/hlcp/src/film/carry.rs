use std::{cell::Cell, f64::consts::PI};

use hlcp_verify::Film;
use nalgebra::{DMatrix, DVector};

use super::{
    Bearing, FilmError, Settings, Solved,
    search::{Point, equilibrium},
};

/// What a wall is to carry, in SI units.
///
/// ```
/// use hlcp::film::Load;
///
/// let load = Load { at: Some([0.029, 0.016]), ..Load::of(900.0) };
/// assert_eq!((load.force, load.direction), (900.0, None));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The force, in N.
    pub force: f64,
    /// Where it acts, of anything but a journal, whose slopes are then found with its height.
    pub at: Option<[f64; 2]>,
    /// The angle along x from which the load on a journal comes; without one only its size is asked
    /// for, and the journal moves along x = 0: grooves, lobes and pockets turn with the widest gap.
    pub direction: Option<f64>,
}

impl Load {
    /// Returns a load of so many N anywhere.
    pub fn of(force: f64) -> Self {
        Self { force, at: None, direction: None }
    }
}

/// What a search for the position that carries a load came to.
///
/// ```
/// use hlcp::film::{Bearing, Film, Load, Settings};
///
/// let film = Film::new([40, 20], [0.05, 0.03], 3.0, 0.04).with_gap(|x, _| 4e-5 - 4e-4 * x);
/// let mut pad = Bearing::pad(film);
/// let carried = pad.carry(&Load::of(1200.0), None, &Settings::default())?;
/// // It comes down.
/// assert!(carried.found && pad.position[0] < 0.0);
/// assert!((pad.forces(&carried.solved.film, &carried.solved.z)[0] - 1200.0).abs() <= 1e-6);
/// # Ok::<(), hlcp::film::FilmError>(())
/// ```
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Carried {
    /// Whether the film carries the load, to 10⁻⁹ of it or 10⁻¹¹ of the force with which all
    /// pressures together, above that of cavitation, press on a wall.
    pub found: bool,
    /// The film there, or else the last one that was solved.
    pub solved: Solved,
    /// How many films were tried, and how many of these did not converge.
    pub films: [usize; 2],
    /// The least and the largest force that one of them carries, in N.
    pub forces: [f64; 2],
    /// The position at which it carries the largest.
    pub largest_at: Vec<f64>,
    /// How far the nearest of them is off, in N.
    pub off: f64,
    /// The position of that one.
    pub nearest_at: Vec<f64>,
    /// Of a journal, in m.
    clearance: f64,
}

impl Carried {
    /// Returns what a search for so many N that failed has found.
    pub fn failure(&self, force: f64) -> String {
        let ([films, failed], [least, largest], off) = (self.films, self.forces, self.off);
        let place = |at: &[f64]| match at {
            [x, y] => {
                let ecc = x.hypot(*y) / self.clearance;
                format!("an eccentricity of {ecc:.6} of the clearance")
            }
            [rise, x, y] => format!("a rise of {rise:.6e} m and slopes of {x:.3e} and {y:.3e}"),
            _ => "the start".into(),
        };
        let carried = if least > force {
            format!("carries {least:.6e} N or more, also by the pressures of supplies and sides")
        } else if largest < force && films - failed > 1 && largest - least <= ALIKE * largest {
            let way_out = if largest == 0.0 {
                "pressure builds up where the gap narrows along the motion and oil fills it"
            } else {
                "other pressures of supplies and sides change that, other heights do not"
            };
            format!("carries the same {largest:.6e} N ({way_out})")
        } else if largest < force {
            format!("carries {largest:.6e} N or less, most at {}", place(&self.largest_at))
        } else {
            format!("is off it by {off:.1e} N or more, least at {}", place(&self.nearest_at))
        };
        let unsolved =
            if failed > 0 { format!(", and {failed} did not converge") } else { String::new() };
        format!(
            "each of the {films} films that were tried {carried}{unsolved}, which does not prove \
             that there is none"
        )
    }
}

/// A search goes no further than to this part of the least gap that it began with.
const NARROWEST: f64 = 1e-4;

/// How far the forces of films may be apart that carry the same, over these.
const ALIKE: f64 = 1e-6;

/// How near forces come to those that are asked for, over the size of these, and what rounding may
/// leave, over what all pressures together press with.
const WITHIN: f64 = 1e-9;
const ROUNDED: f64 = 1e-11;

/// A load of so many times what films carry whose walls nearly meet is beyond them.
const BEYOND: f64 = 1.25;

/// Gaps of cells side by side that are so many times apart where the film is narrowest do not
/// resolve it.
const STEEP: f64 = 1.5;

/// Where a search begins when the first place has led nowhere: sizes, sizes and angles from there,
/// and rises and slopes.
const SIZES: [f64; 4] = [0.05, 0.9, 0.2, 0.98];
const RINGS: [[f64; 2]; 8] = [
    [0.5, 2.4],
    [0.5, -1.6],
    [0.05, 0.0],
    [0.5, 0.9],
    [0.9, 0.0],
    [0.9, 2.1],
    [0.9, -2.1],
    [0.05, 3.1],
];
const PLANES: [[f64; 3]; 9] = [
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [-0.5, 0.0, 0.0],
    [3.0, 0.0, 0.0],
    [3.0, -3.0, 0.0],
    [10.0, -10.0, 0.0],
    [-0.9, 0.0, 0.0],
];

/// The changes of a vector's length and angle, which has none without a length, with its own.
pub(super) fn polar([x, y]: [f64; 2], by: &[f64]) -> [f64; 2] {
    let size = x.hypot(y);
    if size == 0.0 {
        // From nothing it grows whatever its direction.
        return [by[0].hypot(by[1]), f64::NAN];
    }
    [(x * by[0] + y * by[1]) / size, (x * by[1] - y * by[0]) / (size * size)]
}

/// What a film is asked to carry, as equations for the coordinates that move.
pub(super) struct Wanted {
    /// The forces, in N.
    forces: Vec<f64>,
    /// The coordinates that move, and a length or a slope of each that leads to the other wall.
    pub(super) moving: Vec<usize>,
    units: Vec<f64>,
    /// Of a moment the lever that makes a force of it.
    levers: Vec<f64>,
    is_journal: bool,
    /// Of a journal whose grooves turn with it only the size of the force is asked for.
    is_size: bool,
}

impl Wanted {
    pub(super) fn new(bearing: &Bearing, load: &Load, thin: f64) -> Self {
        let (lengths, force) = (bearing.film.lengths, load.force);
        if let Some(journal) = bearing.journal {
            let forces = match load.direction {
                Some(angle) => vec![force * angle.cos(), force * angle.sin()],
                None => vec![force],
            };
            let n = forces.len();
            let (moving, units, levers) =
                ((0..n).collect(), vec![journal.reach(); n], vec![1.0; n]);
            return Self { forces, moving, units, levers, is_size: n == 1, is_journal: true };
        }
        let moves = |&k: &usize| k == 0 || bearing.modes[k].iter().any(|&mode| mode != 0.0);
        let moving: Vec<usize> = (0..if load.at.is_some() { 3 } else { 1 }).filter(moves).collect();
        let lever = |&k: &usize| if k == 0 { 1.0 } else { lengths[k - 1] / 2.0 };
        let levers: Vec<f64> = moving.iter().map(lever).collect();
        let force = |(&k, lever): (&usize, &f64)| match load.at {
            Some(at) if k > 0 => force * (at[k - 1] - lengths[k - 1] / 2.0) / lever,
            _ => force,
        };
        let forces = moving.iter().zip(&levers).map(force).collect();
        let units = levers.iter().map(|lever| thin / lever).collect();
        Self { forces, moving, units, levers, is_size: false, is_journal: false }
    }

    /// Where to begin, after the bearing's position.
    fn starts(&self, first: Vec<f64>) -> Vec<Vec<f64>> {
        let on_ring = |[size, angle]: [f64; 2]| {
            let angle = angle + first[1].atan2(first[0]);
            vec![size * angle.cos(), size * angle.sin()]
        };
        let moved =
            |by: [f64; 3]| first.iter().zip(&self.moving).map(|(at, &k)| at + by[k]).collect();
        let mut starts: Vec<Vec<f64>> = match (self.is_journal, self.is_size) {
            (true, true) => SIZES.map(|size| vec![size]).into(),
            (true, false) => RINGS.map(on_ring).into(),
            (false, _) => PLANES.map(moved).into(),
        };
        starts.insert(0, first);
        starts.dedup();
        starts
    }

    /// Where the walls nearly meet, as `is_open` tells, around a journal under a load from a
    /// direction. A wall with slopes, which is nearly even there, carries almost anything.
    fn narrow(&self, is_open: impl Fn(&[f64]) -> bool) -> Vec<Vec<f64>> {
        let ways = if self.is_journal && !self.is_size { 8 } else { 0 };
        let last = |way: i32| {
            let (sin, cos) = (f64::from(way) * PI / 4.0).sin_cos();
            let is_open = |size: f64| is_open(&[size * cos, size * sin]);
            let [mut open, mut closed] = [0.0, 1.0];
            while is_open(closed) {
                closed *= 2.0;
            }
            for _ in 0..40 {
                let middle = 0.5 * (open + closed);
                let end = if is_open(middle) { &mut open } else { &mut closed };
                *end = middle;
            }
            vec![open * cos, open * sin]
        };
        (0..ways).map(last).collect()
    }

    /// The size of the forces, in N, or 1 N of none.
    fn size(&self) -> f64 {
        let size = self.forces.iter().copied().fold(0.0, f64::hypot);
        if size > 0.0 { size } else { 1.0 }
    }

    /// The changes of the forces that are asked for, from those of all of them.
    pub(super) fn directed(&self, forces: &[f64], changes: &[f64]) -> Vec<f64> {
        if self.is_size {
            return vec![polar([forces[0], forces[1]], changes)[0]];
        }
        self.moving.iter().zip(&self.levers).map(|(&k, lever)| changes[k] / lever).collect()
    }

    /// How far all forces are from those that are asked for, over the size of these.
    fn off(&self, forces: &[f64]) -> DVector<f64> {
        let found = match self.is_size {
            true => vec![forces[0].hypot(forces[1])],
            false => self.directed(forces, forces),
        };
        let size = self.size();
        DVector::from_fn(found.len(), |k, _| (found[k] - self.forces[k]) / size)
    }

    /// The slopes of that by the coordinates that move, from those of all forces.
    fn slopes(&self, forces: &[f64], slopes: &[Vec<f64>]) -> DMatrix<f64> {
        let column = |&l: &usize| {
            let changes: Vec<f64> = slopes.iter().map(|row| row[l]).collect();
            self.directed(forces, &changes)
        };
        let (columns, size): (Vec<_>, _) = (self.moving.iter().map(column).collect(), self.size());
        let n = columns.len();
        DMatrix::from_fn(n, n, |k, l| self.units[l] * columns[l][k] / size)
    }
}

impl Bearing {
    /// Moves the wall to where it carries a load, and leaves it where it is if that is not found,
    /// which proves nothing.
    ///
    /// With the solution of a similar film the search begins where the wall is. Without one it
    /// begins, under a load from a direction, with the eccentricity `position[0]` ahead of that.
    ///
    /// # Errors
    ///
    /// As [`Solved::new`], and [`FilmError::Meet`] for walls that meet where the search begins.
    pub fn carry(
        &mut self,
        load: &Load,
        start: Option<&Solved>,
        settings: &Settings<'_>,
    ) -> Result<Carried, FilmError> {
        if let (Some(angle), Some(_), None) = (load.direction, self.journal, start) {
            // The least gap is some 50° ahead of the load.
            let (size, ahead) = (self.position[0], angle + 0.9 * self.direction());
            self.position = vec![-size * ahead.cos(), -size * ahead.sin()];
        }
        let first = self.here().ok_or(FilmError::Meet)?;
        let mut solved = match start {
            Some(start) => Solved::exact(first, start, settings)?,
            None => Solved::new(first, None, settings)?,
        };
        let clearance = self.journal.map_or(f64::NAN, |journal| journal.clearance);
        if !solved.outcome.converged() {
            return Ok(Carried {
                found: false,
                solved,
                films: [1, 1],
                forces: [f64::INFINITY, 0.0],
                largest_at: vec![],
                off: f64::NAN,
                nearest_at: vec![],
                clearance,
            });
        }
        let thin = solved.film.gap.iter().copied().fold(f64::INFINITY, f64::min);
        let wanted = Wanted::new(self, load, thin);
        let coordinates = || wanted.moving.iter().zip(&wanted.units);
        let begun = self.position.clone();
        let starts = wanted.starts(coordinates().map(|(&k, unit)| begun[k] / unit).collect());
        let in_film = |at: &[f64]| {
            let mut position = begun.clone();
            coordinates().zip(at).for_each(|((&k, unit), at)| position[k] = at * unit);
            position
        };
        let open = |at: &[f64]| {
            let is_open = |film: &Film| film.gap.iter().all(|&gap| gap >= NARROWEST * thin);
            self.at(&in_film(at)).filter(is_open)
        };
        let narrow = || wanted.narrow(|at| open(at).is_some());
        let (mut least, largest, mut largest_at) = (f64::INFINITY, Cell::new(0.0_f64), vec![]);
        let is_beyond = || load.force > BEYOND * largest.get();
        let is_resolved = |at: &[f64]| open(at).is_some_and(|film| is_resolved(&film));
        let (mut is_first, mut failed) = (true, 0);
        let film = |at: &[f64]| -> Result<_, FilmError> {
            if !std::mem::take(&mut is_first) {
                let is_inside = !wanted.is_size || at[0] >= 0.0;
                let Some(film) = open(at).filter(|_| is_inside) else { return Ok(None) };
                let next = Solved::exact(film, &solved, settings)?;
                if !next.outcome.converged() {
                    failed += 1;
                    return Ok(None);
                }
                solved = next;
            }
            let forces = self.forces(&solved.film, &solved.z);
            let carried = if wanted.is_journal { forces[0].hypot(forces[1]) } else { forces[0] };
            least = least.min(carried);
            if carried > largest.get() {
                largest.set(carried);
                largest_at = in_film(at);
            }
            let off = wanted.off(&forces);
            let Solved { film, z, .. } = &solved;
            let pressed = film.pressure_unit() * film.cell() * z.iter().sum::<f64>();
            if off.norm() <= WITHIN.max(ROUNDED * pressed / wanted.size()) {
                return Ok(Some((off, None)));
            }
            let derivatives = solved.derivatives(self, &wanted.moving, false, false);
            let Ok([slopes, _]) = derivatives else {
                failed += 1;
                return Ok(None);
            };
            Ok(Some((off, Some(wanted.slopes(&forces, &slopes)))))
        };
        let (nearest, tried) = equilibrium(&starts, narrow, film, is_beyond, is_resolved)?;
        let found = nearest.as_ref().is_some_and(Point::is_found);
        let off = nearest.as_ref().map_or(0.0, |nearest| nearest.off.norm() * wanted.size());
        let nearest_at =
            nearest.map_or_else(|| begun.clone(), |nearest| in_film(nearest.at.as_slice()));
        if found {
            self.position.clone_from(&nearest_at);
        }
        let (films, forces) = ([tried + failed, failed], [least, largest.get()]);
        Ok(Carried { found, solved, films, forces, largest_at, off, nearest_at, clearance })
    }
}

/// Returns whether gaps along x change little from cell to cell where the film is narrowest.
fn is_resolved(film: &Film) -> bool {
    let least = film.gap.iter().copied().fold(f64::INFINITY, f64::min);
    let is_steep = |pair: &[f64]| pair.contains(&least) && pair[0].max(pair[1]) > STEEP * least;
    !film.gap.chunks(film.nx).any(|row| row.windows(2).any(is_steep))
}
