use hlcp_verify::{Film, FilmFigures, TimeStep};
use nalgebra::{DMatrix, DVector};

use super::{Bearing, FilmError, Settings, Solved};

/// The force on the wall over the force of the film on it, and the way there, at which a step of
/// free motion ends; and how many steps of Newton's method that may take.
const BALANCED: f64 = 1e-8;
const STEPS: usize = 30;

/// What moves a wall for a step, in the coordinates of its [`Bearing`].
///
/// ```
/// use hlcp::film::Drive;
///
/// let squeezed = Drive::To(vec![-1e-6, 0.0, 0.0]);
/// assert_ne!(squeezed, Drive::Under { load: vec![900.0], mass: 0.0 });
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// It is moved to a position.
    To(Vec<f64>),
    /// It moves freely under forces in N, with a mass in kg or 0; a pad keeps its slopes.
    Under {
        /// The force against each coordinate that moves.
        load: Vec<f64>,
        /// The mass of the wall.
        mass: f64,
    },
}

/// A film under a wall that moves: implicit steps, each from the last solution.
///
/// ```
/// use hlcp::film::{Bearing, Drive, Film, Motion, Settings};
///
/// // Two plates are squeezed.
/// let plates = Bearing::pad(Film::new([12, 8], [0.03, 0.02], 0.0, 0.04));
/// let (mut motion, settings) = (Motion::new(plates, &Settings::default())?, Settings::default());
/// let full = motion.oil();
/// let figures = motion.step(1e-3, &Drive::To(vec![-1e-6, 0.0, 0.0]), &settings)?;
/// assert!(figures.load > 0.0 && figures.power > 0.0);
/// let out = 1e-3 * figures.sides.iter().sum::<f64>();
/// assert!((full - motion.oil() - out).abs() <= 1e-12 * full);
/// # Ok::<(), hlcp::film::FilmError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Motion {
    /// The film and where its wall is.
    pub bearing: Bearing,
    /// The film after the last step; before the first one that has settled, if any has.
    pub solved: Option<Solved>,
    /// The power that moves the wall against the pressure in the last step, in W.
    pub squeezing: f64,
    velocity: Vec<f64>,
    /// The height of the oil in each cell, in m, and the cells that no supply keeps full.
    heights: Vec<f64>,
    free: Vec<usize>,
}

impl Motion {
    /// Begins where the bearing is: with the film that has settled there, or, if nothing feeds it
    /// or no wall carries it, with a full one.
    ///
    /// # Errors
    ///
    /// As [`Solved::new`], and [`FilmError::Meet`].
    pub fn new(bearing: Bearing, settings: &Settings<'_>) -> Result<Self, FilmError> {
        let first = bearing.here().ok_or(FilmError::Meet)?;
        let (velocity, free) = (vec![0.0; bearing.position.len()], first.free_cells());
        // What a wall carries has settled before; a film that is squeezed alone begins full.
        let settles = first.is_fed() && first.speeds.iter().sum::<f64>() != 0.0;
        let (heights, solved) = if settles {
            let solved = Solved::new(first, None, settings)?;
            let filled = solved.film.gap.iter().zip(&solved.r).map(|(h, r)| h * (1.0 - r));
            (filled.collect(), Some(solved))
        } else {
            (first.gap, None)
        };
        Ok(Self { bearing, solved, squeezing: 0.0, velocity, heights, free })
    }

    /// Returns the oil in the film, in m³.
    pub fn oil(&self) -> f64 {
        self.free.iter().map(|&k| self.heights[k]).sum::<f64>() * self.bearing.film.cell()
    }

    /// Takes a step in time, in s, and returns its figures; their power is also that which moves
    /// the wall.
    ///
    /// # Errors
    ///
    /// As [`Solved::new`]; [`FilmError::Meet`] for walls that meet, and [`FilmError::Unsettled`]
    /// where film, load and inertia are not brought into balance.
    pub fn step(
        &mut self,
        duration: f64,
        drive: &Drive,
        settings: &Settings<'_>,
    ) -> Result<FilmFigures, FilmError> {
        let step = TimeStep { duration, oil: self.heights.clone() };
        let before = self.bearing.position.clone();
        let next = match drive {
            Drive::To(position) => {
                self.bearing.position.clone_from(position);
                let film = self.bearing.here().ok_or(FilmError::Meet)?;
                Solved::new(Film { step: Some(step), ..film }, self.solved.as_ref(), settings)?
            }
            Drive::Under { load, mass } => self.fall(&step, load, *mass, settings)?,
        };
        // What the solve leaves of a balance goes into the next step, so that nothing adds up.
        let (out, area) = (next.film.outflow(&next.z, &next.r), next.film.cell());
        self.heights.iter_mut().zip(out).for_each(|(oil, out)| *oil -= duration / area * out);
        let mut figures = next.film.figures(&next.z, &next.r, self.bearing.ambient);
        let forces = self.bearing.forces(&next.film, &next.z);
        let ways = self.bearing.position.iter().zip(&before).map(|(now, before)| now - before);
        let work: f64 = forces.iter().zip(ways).map(|(force, way)| force * way).sum();
        self.squeezing = -work / duration;
        figures.power += self.squeezing;
        self.solved = Some(next);
        Ok(figures)
    }

    /// Moves the wall to where film and load leave it after a step: `m (v − v₀) = Δt (G(e) − load)`
    /// and `e = e₀ + Δt v`, by Newton's method.
    fn fall(
        &mut self,
        step: &TimeStep,
        load: &[f64],
        mass: f64,
        settings: &Settings<'_>,
    ) -> Result<Solved, FilmError> {
        let (bearing, duration) = (&mut self.bearing, step.duration);
        let moving: Vec<usize> = (0..if bearing.journal.is_some() { 2 } else { 1 }).collect();
        let (n, inertia) = (moving.len(), mass / (duration * duration));
        let from = bearing.position.clone();
        let at = |bearing: &Bearing, position: &[f64]| -> Option<Film> {
            bearing.at(position).map(|film| Film { step: Some(step.clone()), ..film })
        };
        let film = at(bearing, &from).ok_or(FilmError::Meet)?;
        let mut solved = Solved::new(film, self.solved.as_ref(), settings)?;
        let load = DVector::from_column_slice(&load[..n]);
        for _ in 0..STEPS {
            let forces = DVector::from_vec(bearing.forces(&solved.film, &solved.z));
            let forces = forces.rows(0, n);
            let inert = DVector::from_fn(n, |k, _| {
                inertia * (bearing.position[k] - from[k] - duration * self.velocity[k])
            });
            let misses = inert - forces + &load;
            let is_balanced = misses.amax() <= BALANCED * forces.amax().max(load.amax());
            if is_balanced || !solved.outcome.converged() {
                for k in moving {
                    self.velocity[k] = (bearing.position[k] - from[k]) / duration;
                }
                return Ok(solved);
            }
            let [slopes, _] = solved.derivatives(bearing, &moving, false, false)?;
            let inert = DMatrix::from_diagonal_element(n, n, inertia);
            let matrix = inert - DMatrix::from_fn(n, n, |k, l| slopes[k][l]);
            let mut way = matrix.lu().solve(&misses).ok_or(FilmError::Unsettled)?;
            // No step halves a gap.
            let thin = solved.film.gap.iter().copied().fold(f64::INFINITY, f64::min);
            let next = loop {
                let mut next = bearing.position.clone();
                next.iter_mut().zip(way.iter()).for_each(|(at, by)| *at -= by);
                let film = at(bearing, &next);
                let is_open = |film: &Film| film.gap.iter().all(|&gap| gap >= 0.5 * thin);
                if let Some(film) = film.filter(is_open) {
                    bearing.position = next;
                    break film;
                }
                way /= 2.0;
            };
            solved = Solved::new(next, Some(&solved), settings)?;
        }
        Err(FilmError::Unsettled)
    }
}
