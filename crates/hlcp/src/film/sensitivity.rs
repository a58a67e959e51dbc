use hlcp_verify::{FilmChange, FilmSlopes, Side};
use nalgebra::{DMatrix, DVector};

use super::{
    Bearing, FilmError, Load, Solved,
    carry::{Wanted, polar},
    linear::Linear,
    solve::{LINEAR, posed},
    wall::mode,
};

/// A number that a bearing depends on, in SI units.
///
/// ```
/// let deeper = hlcp::film::Parameter::Gap(vec![0.0, 1.0, 0.0]);
/// assert_ne!(deeper, hlcp::film::Parameter::Position(0));
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Parameter {
    /// The speed of the lower wall (0) or the upper one (1).
    Speed(usize),
    /// The viscosity, of all cells alike.
    Viscosity,
    /// The clearance of a journal, its eccentricity over the clearance and its preload kept.
    Clearance,
    /// The eccentricity of a journal over the clearance, its direction kept.
    Eccentricity,
    /// A coordinate of the position.
    Position(usize),
    /// The pressure around the film, from which loads are counted, with that of all sides and
    /// supplies that are at it.
    Ambient,
    /// The pressure in the broken film.
    Cavitation,
    /// The pressure of a side, or the content of the oil that enters there.
    Side(usize),
    /// The pressure of a supply.
    Supply(usize),
    /// A number that changes the gap in each cell by so much, as the depth of a pocket does.
    Gap(Vec<f64>),
}

/// The derivative of what a bearing does by a [`Parameter`], in SI units.
///
/// ```
/// use hlcp::film::{Bearing, Film, Parameter, Settings, Solved};
///
/// let film = Film::new([50, 30], [0.05, 0.03], 3.0, 0.04).with_gap(|x, _| 4e-5 - 4e-4 * x);
/// let pad = Bearing::pad(film);
/// let solved = Solved::new(pad.here().expect("it is open"), None, &Settings::default())?;
/// let load = pad.forces(&solved.film, &solved.z)[0];
/// // A full film carries in proportion to its viscosity, and to the speed.
/// let found = pad.sensitivities(&solved, &[Parameter::Viscosity, Parameter::Speed(0)], None)?;
/// assert!((found[0].slopes.load - load / 0.04).abs() < 1e-9 * load / 0.04);
/// assert!((found[1].slopes.load - load / 3.0).abs() < 1e-9 * load);
/// # Ok::<(), hlcp::film::FilmError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Sensitivity {
    /// Of the forces along the position's coordinates, as [`Bearing::forces`] counts them.
    pub forces: Vec<f64>,
    /// Of the figures, with the load and the drag of a [`Bearing`]: of a journal the resultant, and
    /// the drag on the wall that moves the faster and on the other one.
    pub slopes: FilmSlopes,
    /// Of the position.
    pub position: Vec<f64>,
    /// Of a journal's eccentricity over the clearance.
    pub ecc: Option<f64>,
    /// Of a journal's attitude, in degrees; NaN without a load or an eccentricity.
    pub attitude: Option<f64>,
}

impl Sensitivity {
    /// All its numbers.
    fn numbers(&mut self) -> impl Iterator<Item = &mut f64> {
        let of = &mut self.slopes;
        let lists = [&mut self.forces[..], &mut self.position, &mut of.sides, &mut of.supplies];
        let pairs = [&mut of.moments, &mut of.friction, &mut of.full_friction];
        let others = [&mut of.load, &mut of.power, &mut of.peak].into_iter();
        let others = others.chain(&mut self.ecc).chain(&mut self.attitude);
        lists.into_iter().flatten().chain(pairs.into_iter().flatten()).chain(others)
    }
}

impl Bearing {
    /// Returns the numbers that figures have derivatives by, each with its name and its unit: those
    /// of walls, oil, sides and supplies, and of the position if that is held.
    ///
    /// ```
    /// use hlcp::film::{Bearing, Journal, Parameter};
    ///
    /// let bearing = Bearing::journal(Journal::round(0.1, 0.05, 1e-4), [36, 6]);
    /// let held = bearing.parameters(true);
    /// assert_eq!(held[4], ("ecc".to_owned(), "", Parameter::Eccentricity));
    /// // Under a load the position is none of them.
    /// let names: Vec<_> = bearing.parameters(false).into_iter().map(|(name, ..)| name).collect();
    /// assert_eq!(names[3..], ["clearance", "ambient", "cavitation", "south", "north"]);
    /// ```
    pub fn parameters(&self, is_held: bool) -> Vec<(String, &'static str, Parameter)> {
        let (film, is_journal) = (&self.film, self.journal.is_some());
        let usual = [
            (true, "speed", "m/s", Parameter::Speed(0)),
            (true, "upper_speed", "m/s", Parameter::Speed(1)),
            (true, "viscosity", "Pa s", Parameter::Viscosity),
            (is_journal, "clearance", "m", Parameter::Clearance),
            (is_held && is_journal, "ecc", "", Parameter::Eccentricity),
            (is_held && !is_journal, "rise", "m", Parameter::Position(0)),
            (is_held && !is_journal, "slope_x", "", Parameter::Position(1)),
            (is_held && !is_journal, "slope_y", "", Parameter::Position(2)),
            (true, "ambient", "Pa", Parameter::Ambient),
            (true, "cavitation", "Pa", Parameter::Cavitation),
        ];
        let names = ["west", "east", "south", "north"].into_iter().enumerate();
        let sides = names.zip(film.sides).map(|((k, name), side)| {
            let is_open = matches!(side, Side::Pressure(_) | Side::Starved(_));
            let unit = if matches!(side, Side::Starved(_)) { "" } else { "Pa" };
            (is_open, name, unit, Parameter::Side(k))
        });
        let there = usual.into_iter().chain(sides).filter(|(is_there, ..)| *is_there);
        let there = there.map(|(_, name, unit, of)| (name.to_owned(), unit, of));
        let supply = |k| (format!("supplies[{k}]"), "Pa", Parameter::Supply(k));
        there.chain((0..film.supplies.len()).map(supply)).collect()
    }

    /// Computes the derivatives of what a solved film does by parameters: in its position, or,
    /// with a load that the position carries, where the wall goes to carry it.
    ///
    /// They are exact but for rounding, one linear solve each with the matrix of the last step of
    /// Newton's method, as long as no cell is on the edge between full and broken.
    ///
    /// # Errors
    ///
    /// [`FilmError::Derivatives`] for linear systems that are not solved, also those for the
    /// position that carries the load, and [`FilmError::Unsteady`] for a film in a step of time.
    ///
    /// # Panics
    ///
    /// For a [`Parameter::Gap`] without an entry for each cell, and a wall, side, supply or
    /// coordinate that is not there.
    pub fn sensitivities(
        &self,
        solved: &Solved,
        parameters: &[Parameter],
        load: Option<&Load>,
    ) -> Result<Vec<Sensitivity>, FilmError> {
        solved.check_steady()?;
        let wanted = load.map(|load| Wanted::new(self, load, 1.0));
        let moving: &[usize] = wanted.as_ref().map_or(&[], |wanted| &wanted.moving);
        let (operators, _) = posed(&solved.film)?;
        let mut linear = Linear::of(&solved.film, operators, &solved.r, LINEAR)?;
        let mut answer = |parameter: &Parameter| {
            let (change, position, ambient) = self.change(parameter);
            let film = &solved.film;
            let [dz, dr] = linear.answer(&film.rows_change(&solved.z, &solved.r, &change))?;
            let at = [&solved.z[..], &solved.r];
            let mut slopes = film.slopes(at, [&dz, &dr], &change, ambient);
            slopes.friction = self.drag(slopes.friction);
            slopes.full_friction = self.drag(slopes.full_friction);
            let unit = film.pressure_unit();
            let p = |dz: &f64| (change.cavitation - ambient + unit * dz) * film.cell();
            let along = |mode: &Vec<f64>| dz.iter().zip(mode).map(|(dz, m)| p(dz) * m).sum();
            let forces = self.modes.iter().map(along).collect();
            let mut found = Sensitivity { forces, slopes, position, ecc: None, attitude: None };
            self.turn(solved, parameter, &mut found);
            Ok::<_, FilmError>(found)
        };
        let mut all = parameters.iter().map(&mut answer).collect::<Result<Vec<_>, _>>()?;
        let Some(wanted) = &wanted else { return Ok(all) };
        let of_position = moving.iter().map(|&k| answer(&Parameter::Position(k)));
        let of_position = of_position.collect::<Result<Vec<_>, _>>()?;
        let forces = self.forces(&solved.film, &solved.z);
        // The change of the forces that are asked for, with a change of all of them.
        let rows = |changes: &[f64]| wanted.directed(&forces, changes);
        let slopes: Vec<_> = of_position.iter().map(|found| rows(&found.forces)).collect();
        let matrix = DMatrix::from_fn(moving.len(), moving.len(), |k, l| slopes[l][k]).lu();
        for found in &mut all {
            let off = DVector::from_vec(rows(&found.forces));
            let ways = matrix.solve(&off).ok_or(FilmError::Derivatives(f64::NAN))?;
            for (way, mut other) in ways.iter().zip(of_position.iter().cloned()) {
                found.numbers().zip(other.numbers()).for_each(|(one, other)| *one -= way * *other);
            }
        }
        Ok(all)
    }

    /// The changes of the film, of the position and of the pressure around.
    fn change(&self, parameter: &Parameter) -> (FilmChange, Vec<f64>, f64) {
        let (film, mut change) = (&self.film, FilmChange::default());
        let (mut position, mut ambient) = (vec![0.0; self.modes.len()], 0.0);
        change.supplies = vec![0.0; film.supplies.len()];
        match parameter {
            Parameter::Speed(wall) => change.speeds[*wall] = 1.0,
            Parameter::Viscosity => change.viscosity = vec![1.0],
            Parameter::Clearance => {
                change.gap = mode(film, |x, _| self.journal.map_or(1.0, |journal| journal.bore(x)));
                let clearance = self.journal.map_or(f64::INFINITY, |journal| journal.clearance);
                position = self.position.iter().map(|at| at / clearance).collect();
            }
            Parameter::Eccentricity => {
                let clearance = self.journal.map_or(0.0, |journal| journal.clearance);
                let size = self.position.iter().copied().fold(0.0, f64::hypot);
                position = if size > 0.0 {
                    self.position.iter().map(|at| at / size * clearance).collect()
                } else {
                    vec![clearance, 0.0]
                };
            }
            Parameter::Position(k) => position[*k] = 1.0,
            Parameter::Ambient => {
                ambient = 1.0;
                for (side, change) in film.sides.iter().zip(&mut change.sides) {
                    *change = f64::from(*side == Side::Pressure(self.ambient));
                }
                for (supply, change) in film.supplies.iter().zip(&mut change.supplies) {
                    *change = f64::from(supply.pressure == self.ambient);
                }
            }
            Parameter::Cavitation => change.cavitation = 1.0,
            Parameter::Side(side) => change.sides[*side] = 1.0,
            Parameter::Supply(supply) => change.supplies[*supply] = 1.0,
            Parameter::Gap(gap) => change.gap.clone_from(gap),
        }
        if position.iter().any(|by| *by != 0.0) {
            change.gap.resize(film.gap.len(), 0.0);
            for (by, mode) in position.iter().zip(&self.modes) {
                change.gap.iter_mut().zip(mode).for_each(|(gap, mode)| *gap += by * mode);
            }
        }
        (change, position, ambient)
    }

    /// Of a journal the load is that of both forces, and its position an eccentricity and an
    /// attitude.
    fn turn(&self, solved: &Solved, parameter: &Parameter, found: &mut Sensitivity) {
        let Some(journal) = self.journal else { return };
        let forces = self.forces(&solved.film, &solved.z);
        let [load, load_angle] = polar([forces[0], forces[1]], &found.forces);
        found.slopes.load = load;
        let at = [self.position[0], self.position[1]];
        let [size, angle] = polar(at, &found.position);
        let stretch = f64::from(*parameter == Parameter::Clearance) * at[0].hypot(at[1]);
        found.ecc = Some((size - stretch / journal.clearance) / journal.clearance);
        found.attitude = Some(self.direction() * (angle - load_angle).to_degrees());
    }
}
