use hlcp_core::Norms;
use hlcp_verify::{Film, FilmFigures, TimeStep};
use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::{
    Bearing, FilmError, Settings, Solved,
    linear::Linear,
    solve::{LINEAR, Operators, TOLERANCE, gained},
};

/// The force on the wall over the force of the film on it, and the way there, at which a step of
/// free motion ends; how many steps of Newton's method for wall and film together are tried before
/// the film is solved for where the wall is, and how many they all may be.
const BALANCED: f64 = 1e-8;
const TOGETHER: usize = 8;
const STEPS: usize = 100;

/// A wall that is moved turns if its speed changes by more than this part of the larger one, and
/// that is not between nothing and so many times what changed over the step before, at equal
/// lengths. A wave of 25 steps or more never does.
const BENDS: f64 = 0.25;
const ABRUPT: f64 = 4.0;

/// Factors serve as long as a step leaves less than this of the residual.
const SLOW: f64 = 0.1;

/// What moves a wall for a step, in the coordinates of its [`Bearing`].
///
/// ```
/// let squeezed = hlcp::film::Drive::To(vec![-1e-6, 0.0, 0.0]);
/// assert_ne!(squeezed, hlcp::film::Drive::Under { load: vec![900.0], mass: 0.0 });
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
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
/// first one is of first order, as is one over which the content would fall below zero, and one in
/// which a wall that is moved turns, by a quarter of its speed or more at once: there the parabola
/// through three positions has another slope than the way, half as much again after a rest.
///
/// # Stability
///
/// Without forces a step of `ρ` times the length of the one before leaves `ρ/(1 + 2ρ) < ½` of an
/// error in the mean speed over that, so that none of these grows, whatever the lengths of steps.
/// Errors of the content itself do where a step is more than 1 + √2 times the last one.
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
    velocity: Vec<f64>,
    past: Option<Past>,
    /// The height of the oil in each cell, in m, and the cells that no supply keeps full.
    heights: Vec<f64>,
    free: Vec<usize>,
}

/// What a step began with, how long it took, and its figures, whose flows are means.
#[derive(Debug, Clone)]
struct Past {
    duration: f64,
    heights: Vec<f64>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    /// What it gained in mean speed, over time, unless it turned or moved freely.
    gained: Option<Vec<f64>>,
    solved: Option<Solved>,
    figures: FilmFigures,
}

/// A step of second order is one of first order that takes a part of the time and begins where this
/// leads, if it is `ratio` times as long as the one before.
fn lead(now: &[f64], before: &[f64], ratio: f64) -> Vec<f64> {
    let (one, other) = ((1.0 + ratio).powi(2), ratio * ratio);
    let pairs = now.iter().zip(before);
    pairs.map(|(now, before)| (one * now - other * before) / (1.0 + 2.0 * ratio)).collect()
}

/// How film and forces answer to the wall, for Newton's method with both.
struct Slopes {
    linear: Linear,
    /// How `z` and `r` change with each coordinate that moves.
    ways: Vec<[Vec<f64>; 2]>,
    /// What is off by the coordinates.
    matrix: LU<f64, Dyn, Dyn>,
}

impl Slopes {
    fn of(
        bearing: &Bearing,
        guess: &Solved,
        operators: Operators,
        (moving, inertia): (usize, f64),
    ) -> Result<Self, FilmError> {
        let mut linear = Linear::of(&guess.film, operators, &guess.r, LINEAR)?;
        let modes = &bearing.modes[..moving];
        let answer = |mode: &Vec<f64>| linear.answer(&guess.widened(mode, &guess.r));
        let ways = modes.iter().map(answer).collect::<Result<Vec<_>, _>>()?;
        let matrix = DMatrix::from_fn(moving, moving, |k, l| {
            let inert = if k == l { inertia } else { 0.0 };
            inert - gained(&guess.film, &ways[l][0], &modes[k])
        });
        Ok(Self { linear, ways, matrix: matrix.lu() })
    }
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
        Ok(Self { bearing, solved, velocity, past: None, heights, free })
    }

    /// Returns the oil in the film, in m³.
    pub fn oil(&self) -> f64 {
        self.free.iter().map(|&k| self.heights[k]).sum::<f64>() * self.bearing.film.cell()
    }

    /// What a step to a position gains in mean speed, over the time from the middle of the last one
    /// to its own; nothing where the wall turns.
    fn gains(&self, duration: f64, to: &[f64]) -> Option<Vec<f64>> {
        let here = &self.bearing.position;
        let mut turns = false;
        let gain = |k: usize| {
            let speed = (to[k] - here[k]) / duration;
            // At first it is at rest.
            let (time, last, before) = self.past.as_ref().map_or((0.0, 0.0, Some(0.0)), |past| {
                let way = here[k] - past.position[k];
                (past.duration, way / past.duration, past.gained.as_ref().map(|by| by[k]))
            });
            let gained = 2.0 * (speed - last) / (duration + time);
            turns |= (speed - last).abs() > BENDS * speed.abs().max(last.abs())
                && before.is_some_and(|before| {
                    gained * before < 0.0 || gained.abs() > ABRUPT * before.abs()
                });
            gained
        };
        let gains = (0..to.len()).map(gain).collect();
        (!turns).then_some(gains)
    }

    /// Takes a step in time, in s, and returns the figures at its end, but for flows, what is
    /// stored and the imbalance of both: these are means over the step, in balance but for
    /// rounding. Their power is also that which moves the wall against the pressure.
    ///
    /// # Errors
    ///
    /// As [`Solved::new`]; [`FilmError::Meet`] for walls that meet, and [`FilmError::Unsettled`]
    /// where film, load and inertia are not brought into balance. The motion is then as it was
    /// before the step, and may go on by a shorter one.
    pub fn step(
        &mut self,
        duration: f64,
        drive: &Drive,
        settings: &Settings<'_>,
    ) -> Result<FilmFigures, FilmError> {
        let (position, velocity) = (&self.bearing.position, &self.velocity);
        // Where the step begins as one of first order, and how long it takes as such.
        let gained = match drive {
            Drive::To(to) => self.gains(duration, to),
            Drive::Under { .. } => None,
        };
        let turns = matches!(drive, Drive::To(_)) && gained.is_none();
        let second = self.past.as_ref().and_then(|past| {
            let ratio = duration / past.duration;
            let oil = lead(&self.heights, &past.heights, ratio);
            let at = lead(position, &past.position, ratio);
            let from = [at, lead(velocity, &past.velocity, ratio)];
            let is_oil = self.free.iter().all(|&k| oil[k] >= 0.0);
            (is_oil && !turns).then_some((Some(past), ratio, oil, from))
        });
        let first = || (None, 0.0, self.heights.clone(), [position.clone(), velocity.clone()]);
        let (past, ratio, oil, from) = second.unwrap_or_else(first);
        let time = duration * (1.0 + ratio) / (1.0 + 2.0 * ratio);
        let step = TimeStep { duration: time, oil };
        let moved = |ahead| self.moved(ahead, &step, &from, drive, settings);
        let (next, position) = match moved(duration) {
            // Farther on, the film may carry nothing, which says nothing of where to go.
            Err(FilmError::Unsettled) => moved(0.0)?,
            found => found?,
        };
        // What the solve leaves of a balance goes into the next step, so that nothing adds up.
        let (out, area) = (next.film.outflow(&next.z, &next.r), next.film.cell());
        let left = step.oil.iter().zip(out).map(|(oil, out)| oil - time / area * out).collect();
        let mut figures = next.film.figures(&next.z, &next.r, self.bearing.ambient);
        let forces = self.bearing.forces(&next.film, &next.z);
        let ways = || position.iter().zip(&from[0]).map(|(now, from)| now - from);
        let work: f64 = forces.iter().zip(ways()).map(|(force, way)| force * way).sum();
        if let Some(past) = past {
            let sides = figures.sides.iter_mut().zip(&past.figures.sides);
            let leaks = figures.leaks.iter_mut().zip(&past.figures.leaks);
            let supplies = figures.supplies.iter_mut().zip(&past.figures.supplies);
            for (flow, before) in sides.chain(leaks).chain(supplies) {
                *flow = ((1.0 + ratio) * *flow + ratio * before) / (1.0 + 2.0 * ratio);
            }
        }
        let held = self.oil();
        self.past = Some(Past {
            duration,
            gained,
            velocity: std::mem::replace(&mut self.velocity, ways().map(|way| way / time).collect()),
            heights: std::mem::replace(&mut self.heights, left),
            position: std::mem::replace(&mut self.bearing.position, position),
            solved: self.solved.replace(next),
            figures: figures.clone(),
        });
        figures.power -= work / time;
        figures.stored = (self.oil() - held) / duration;
        let out = figures.sides.iter().sum::<f64>() - figures.supplies.iter().sum::<f64>();
        figures.imbalance = out + figures.stored;
        Ok(figures)
    }

    /// The film and the position at the end of a step, that of the drive or where film and load
    /// leave the wall after a step of first order from `e₀` with `v₀`: `m (v − v₀) = Δt (G(e) −
    /// load)` and `e = e₀ + Δt v`.
    ///
    /// Newton's method takes wall and film together, from where they are on the way to, and keeps
    /// factors while the same cells are broken. Where that leads nowhere, the film is solved for
    /// where the wall is.
    fn moved(
        &self,
        ahead: f64,
        step: &TimeStep,
        [from, begun]: &[Vec<f64>; 2],
        drive: &Drive,
        settings: &Settings<'_>,
    ) -> Result<(Solved, Vec<f64>), FilmError> {
        let (bearing, duration) = (&self.bearing, step.duration);
        let ratio = self.past.as_ref().map_or(0.0, |past| ahead / past.duration);
        let at = |position: &[f64]| -> Option<Film> {
            bearing.at(position).map(|film| Film { step: Some(step.clone()), ..film })
        };
        // No step halves a gap.
        let is_near = |now: &Film, next: &Film| {
            let thin = now.gap.iter().copied().fold(f64::INFINITY, f64::min);
            next.gap.iter().all(|&gap| gap >= 0.5 * thin)
        };
        let (mut position, load, inertia) = match drive {
            Drive::To(position) => (position.clone(), vec![], 0.0),
            Drive::Under { load, mass } => {
                let n = if bearing.journal.is_some() { 2 } else { 1 };
                (bearing.position.clone(), load[..n].to_vec(), mass / (duration * duration))
            }
        };
        let mut film = at(&position).ok_or(FilmError::Meet)?;
        let before = self.past.as_ref().map_or(&self.velocity, |past| &past.velocity);
        let mut next = position.clone();
        for k in 0..load.len() {
            let gained = 0.5 * ratio * (self.velocity[k] - before[k]);
            next[k] += ahead * (self.velocity[k] + gained);
        }
        if let Some(nearby) = at(&next).filter(|next| is_near(&film, next)) {
            (film, position) = (nearby, next);
        }
        let load = DVector::from_vec(load);
        // Forces that cancel are known as well as the pressures that the step begins with.
        let floor = self.solved.as_ref().map_or(0.0, |now| {
            let sizes = bearing.modes[..load.len()].iter().map(|mode| {
                let sizes: Vec<f64> = mode.iter().map(|by| by.abs()).collect();
                gained(&now.film, &now.z, &sizes)
            });
            TOLERANCE * sizes.fold(0.0, f64::max)
        });
        // Without a film to set out from, or with a method of the user's, each is solved alone.
        let before = self.past.as_ref().and_then(|past| past.solved.as_ref());
        let mut guess = match &self.solved {
            Some(now) => now.led(before.unwrap_or(now), ratio, film),
            None => Solved::new(film, None, settings)?,
        };
        let mut together = if self.solved.is_some() { TOGETHER } else { 0 };
        let (mut slopes, mut flips, mut last): (Option<Slopes>, _, _) = (None, 1, f64::INFINITY);
        for _ in 0..STEPS {
            let is_alone = together == 0 || settings.method.is_some();
            if is_alone {
                guess = Solved::new(guess.film.clone(), Some(&guess), settings)?;
                (together, flips) = (TOGETHER, 0);
            }
            together -= 1;
            let forces = DVector::from_vec(bearing.forces(&guess.film, &guess.z));
            let forces = forces.rows(0, load.len());
            let inert = DVector::from_fn(load.len(), |k, _| {
                inertia * (position[k] - from[k] - duration * begun[k])
            });
            let misses = inert - forces + &load;
            let largest = forces.amax().max(load.amax());
            // Inertia is the difference of positions, each of which is rounded.
            let is_rounding = |(k, off): (usize, &f64)| {
                let sizes = position[k].abs() + from[k].abs() + (duration * begun[k]).abs();
                off.abs() <= BALANCED * largest + floor + 8.0 * f64::EPSILON * inertia * sizes
            };
            let is_carried = misses.iter().enumerate().all(is_rounding);
            let is_balanced = flips == 0 && is_carried;
            if is_balanced && !is_alone {
                guess = Solved::judged(guess.film, guess.z, guess.r, settings)?;
            }
            let is_solved = guess.outcome.converged();
            // A film that does not settle alone is an answer only where nothing depends on it.
            if is_alone && !is_solved && !load.is_empty() {
                return Err(FilmError::Unsettled);
            }
            if is_alone && !is_solved || is_balanced && is_solved {
                return Ok((guess, position));
            }
            let (operators, off) = guess.residual()?;
            let size = Norms::of(&off).l2;
            let is_slow = size > SLOW * std::mem::replace(&mut last, size);
            let serves = |slopes: &Slopes| slopes.linear.is_at(&guess.r) && !is_slow;
            let slopes_here = || Slopes::of(bearing, &guess, operators, (load.len(), inertia));
            let known = slopes.take().filter(serves).map_or_else(slopes_here, Ok);
            let answered = known.and_then(|mut known| Ok((known.linear.answer(&off)?, known)));
            let ([mut dz, mut dr], known) = match answered {
                Ok(answered) => answered,
                Err(error) if is_alone => return Err(error),
                Err(_) => {
                    together = 0;
                    continue;
                }
            };
            let left = DVector::from_fn(load.len(), |k, _| {
                misses[k] - gained(&guess.film, &dz, &bearing.modes[k])
            });
            let way = if load.is_empty() { None } else { known.matrix.solve(&left) };
            let way = way.filter(|way| way.iter().all(|by| by.is_finite()));
            // A film that carries nothing has no slopes, and need not move if it is to carry none.
            let stays = is_carried.then(|| DVector::zeros(load.len()));
            let mut way = way.or(stays).ok_or(FilmError::Unsettled)?;
            let film = loop {
                let mut next = position.clone();
                next.iter_mut().zip(way.iter()).for_each(|(at, by)| *at -= by);
                if let Some(film) = at(&next).filter(|next| is_near(&guess.film, next)) {
                    position = next;
                    break film;
                }
                way /= 2.0;
            };
            for ([of_z, of_r], way) in known.ways.iter().zip(way.iter()) {
                dz.iter_mut().zip(of_z).for_each(|(dz, by)| *dz -= way * by);
                dr.iter_mut().zip(of_r).for_each(|(dr, by)| *dr -= way * by);
            }
            flips = guess.go(&dz, &dr);
            let [z, _] = guess.scaled(&film);
            guess = Solved { z, film, ..guess };
            slopes = Some(known);
        }
        Err(FilmError::Unsettled)
    }
}
