use hlcp_verify::{Film, FilmFigures, TimeStep};
use nalgebra::{DMatrix, DVector};

use super::{Bearing, FilmError, Settings, Solved};

/// The force on the wall over the force of the film on it, and the way there, at which a step of
/// free motion ends; and how many steps of Newton's method that may take.
const BALANCED: f64 = 1e-8;
const STEPS: usize = 30;

/// Slopes of the forces serve as long as a step leaves less than this of what is off: new ones cost
/// as much as a film or two.
const SLOW: f64 = 0.1;

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
/// They are of second order, by the two-step backward formula for steps of any length (BDF2). The
/// first one is of first order, as is one more than twice as long as that before it, and one over
/// which the content would fall below zero.
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
    past: Option<Past>,
    /// Slopes of the forces, exact once and corrected since.
    slopes: Option<DMatrix<f64>>,
    /// The height of the oil in each cell, in m, and the cells that no supply keeps full.
    heights: Vec<f64>,
    free: Vec<usize>,
}

/// What a step began with, how long it took, and what flowed out and was supplied in its mean.
#[derive(Debug, Clone)]
struct Past {
    duration: f64,
    heights: Vec<f64>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    sides: [f64; 4],
    supplies: Vec<f64>,
}

/// A step of second order is one of first order that takes a part of the time and begins where this
/// leads, if it is `ratio` times as long as the one before.
fn lead(now: &[f64], before: &[f64], ratio: f64) -> Vec<f64> {
    let (one, other) = ((1.0 + ratio).powi(2), ratio * ratio);
    let pairs = now.iter().zip(before);
    pairs.map(|(now, before)| (one * now - other * before) / (1.0 + 2.0 * ratio)).collect()
}

/// The longest step over the one before that is of second order; the formula is stable to 1 + √2.
const LONGEST: f64 = 2.0;

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
        Ok(Self {
            bearing,
            solved,
            squeezing: 0.0,
            velocity,
            past: None,
            slopes: None,
            heights,
            free,
        })
    }

    /// Returns the oil in the film, in m³.
    pub fn oil(&self) -> f64 {
        self.free.iter().map(|&k| self.heights[k]).sum::<f64>() * self.bearing.film.cell()
    }

    /// Takes a step in time, in s, and returns the figures at its end; their flows are means over
    /// the step, and their power is also that which moves the wall.
    ///
    /// # Errors
    ///
    /// As [`Solved::new`]; [`FilmError::Meet`] for walls that meet, and [`FilmError::Unsettled`]
    /// where film, load and inertia are not brought into balance. The motion is over then.
    pub fn step(
        &mut self,
        duration: f64,
        drive: &Drive,
        settings: &Settings<'_>,
    ) -> Result<FilmFigures, FilmError> {
        let (position, velocity) = (self.bearing.position.clone(), self.velocity.clone());
        let past = self.past.take();
        let second = past.as_ref().and_then(|past| {
            let ratio = duration / past.duration;
            let oil = lead(&self.heights, &past.heights, ratio);
            let is_oil = self.free.iter().all(|&k| oil[k] >= 0.0);
            (ratio <= LONGEST && is_oil).then_some((past, ratio, oil))
        });
        // Where the step begins as one of first order, and how long it takes as such.
        let (ratio, oil, from) = match second {
            Some((past, ratio, oil)) => {
                let at = lead(&position, &past.position, ratio);
                (ratio, oil, [at, lead(&velocity, &past.velocity, ratio)])
            }
            None => (0.0, self.heights.clone(), [position.clone(), velocity.clone()]),
        };
        let time = duration * (1.0 + ratio) / (1.0 + 2.0 * ratio);
        let step = TimeStep { duration: time, oil };
        let next = match drive {
            Drive::To(position) => {
                self.bearing.position.clone_from(position);
                let film = self.bearing.here().ok_or(FilmError::Meet)?;
                let film = Film { step: Some(step.clone()), ..film };
                Solved::new(film, self.solved.as_ref(), settings)?
            }
            Drive::Under { load, mass } => {
                let ahead = position.iter().zip(&velocity).map(|(at, v)| at + duration * v);
                self.fall(&step, [&from[0], &from[1], &ahead.collect()], load, *mass, settings)?
            }
        };
        // What the solve leaves of a balance goes into the next step, so that nothing adds up.
        let (out, area) = (next.film.outflow(&next.z, &next.r), next.film.cell());
        let left = step.oil.iter().zip(out).map(|(oil, out)| oil - time / area * out).collect();
        let heights = std::mem::replace(&mut self.heights, left);
        let mut figures = next.film.figures(&next.z, &next.r, self.bearing.ambient);
        let forces = self.bearing.forces(&next.film, &next.z);
        let ways = self.bearing.position.iter().zip(&from[0]).map(|(now, from)| now - from);
        let work: f64 = forces.iter().zip(ways).map(|(force, way)| force * way).sum();
        self.squeezing = -work / time;
        figures.power += self.squeezing;
        if let Some(past) = past.filter(|_| ratio > 0.0) {
            let mean = |flow: &mut f64, before: &f64| {
                *flow = ((1.0 + ratio) * *flow + ratio * before) / (1.0 + 2.0 * ratio);
            };
            figures.sides.iter_mut().zip(&past.sides).for_each(|(now, before)| mean(now, before));
            let pairs = figures.supplies.iter_mut().zip(&past.supplies);
            pairs.for_each(|(now, before)| mean(now, before));
        }
        let (sides, supplies) = (figures.sides, figures.supplies.clone());
        self.past = Some(Past { duration, heights, position, velocity, sides, supplies });
        self.solved = Some(next);
        Ok(figures)
    }

    /// Moves the wall to where film and load leave it after a step of first order from `e₀` with
    /// `v₀`: `m (v − v₀) = Δt (G(e) − load)` and `e = e₀ + Δt v`, by Newton's method with slopes
    /// that C. G. Broyden's update corrects (Math. Comp. 19 (1965) 577–593), from where the wall
    /// goes on as it did.
    fn fall(
        &mut self,
        step: &TimeStep,
        [from, begun, ahead]: [&Vec<f64>; 3],
        load: &[f64],
        mass: f64,
        settings: &Settings<'_>,
    ) -> Result<Solved, FilmError> {
        let (bearing, duration) = (&mut self.bearing, step.duration);
        let moving: Vec<usize> = (0..if bearing.journal.is_some() { 2 } else { 1 }).collect();
        let (n, inertia) = (moving.len(), mass / (duration * duration));
        let at = |bearing: &Bearing, position: &[f64]| -> Option<Film> {
            bearing.at(position).map(|film| Film { step: Some(step.clone()), ..film })
        };
        let mut film = at(bearing, &bearing.position).ok_or(FilmError::Meet)?;
        // No step halves a gap.
        let is_near = |now: &Film, next: &Film| {
            let thin = now.gap.iter().copied().fold(f64::INFINITY, f64::min);
            next.gap.iter().all(|&gap| gap >= 0.5 * thin)
        };
        if let Some(next) = at(bearing, ahead).filter(|next| is_near(&film, next)) {
            film = next;
            bearing.position.clone_from(ahead);
        }
        let mut solved = Solved::new(film, self.solved.as_ref(), settings)?;
        // Forces, the way from them and what was off there.
        let mut last: Option<(DVector<f64>, DVector<f64>, f64)> = None;
        let load = DVector::from_column_slice(&load[..n]);
        for _ in 0..STEPS {
            let forces = DVector::from_vec(bearing.forces(&solved.film, &solved.z));
            let forces = forces.rows(0, n);
            let inert = DVector::from_fn(n, |k, _| {
                inertia * (bearing.position[k] - from[k] - duration * begun[k])
            });
            let misses = inert - forces + &load;
            if misses.iter().any(|off| !off.is_finite()) {
                return Err(FilmError::Unsettled);
            }
            let is_balanced = misses.amax() <= BALANCED * forces.amax().max(load.amax());
            if is_balanced || !solved.outcome.converged() {
                for k in moving {
                    self.velocity[k] = (bearing.position[k] - from[k]) / duration;
                }
                return Ok(solved);
            }
            let known = match (self.slopes.take(), &last) {
                (Some(slopes), Some((before, way, off))) if misses.norm() < SLOW * off => {
                    let unforeseen = forces - before + &slopes * way;
                    Some(slopes - unforeseen * way.transpose() / way.norm_squared())
                }
                (slopes, None) => slopes,
                _ => None,
            };
            let slopes = match known {
                Some(slopes) => slopes,
                None => {
                    let [slopes, _] = solved.derivatives(bearing, &moving, false, false)?;
                    DMatrix::from_fn(n, n, |k, l| slopes[k][l])
                }
            };
            let matrix = DMatrix::from_diagonal_element(n, n, inertia) - &slopes;
            self.slopes = Some(slopes);
            let way = matrix.lu().solve(&misses);
            let mut way =
                way.filter(|way| way.iter().all(|w| w.is_finite())).ok_or(FilmError::Unsettled)?;
            let next = loop {
                let mut next = bearing.position.clone();
                next.iter_mut().zip(way.iter()).for_each(|(at, by)| *at -= by);
                if let Some(film) = at(bearing, &next).filter(|next| is_near(&solved.film, next)) {
                    bearing.position = next;
                    break film;
                }
                way /= 2.0;
            };
            last = Some((forces.into_owned(), way, misses.norm()));
            solved = Solved::new(next, Some(&solved), settings)?;
        }
        Err(FilmError::Unsettled)
    }
}
