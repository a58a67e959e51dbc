//! The search for a position that carries a load.

use nalgebra::{DMatrix, DVector};

/// What the slopes may err by in a step, over what is left to go: in one that is to arrive, and in
/// one along a curve.
const ARRIVING: f64 = 0.5;
const FOLLOWING: f64 = 0.25;

/// The first step, in the unit of positions; those at which walls are said to meet, and to be out
/// of each other's reach; and how often a step is halved.
const STEP: f64 = 0.25;
const MEETS: f64 = 1e-8;
const FAR: f64 = 1e6;
const HALVINGS: usize = 40;

/// How many films a curve may take without halving what is off, and which way it is followed, in
/// turn; and how many all curves may before the last where cells do not resolve the nearest film.
/// Of 10,000 journals with lobes half took 8, a hundredth more than 110, twelve 210 to 1165, and
/// one, whose forces point almost one way all around, was not found in 1520.
const ROUNDS: [(usize, bool); 3] = [(40, true), (200, true), (200, false)];
const FILMS: usize = 300;

/// Forces that grow to so many times what they were, or were to be, do not come back.
const AWAY: f64 = 100.0;

/// Searches for a position at which a film exerts the wanted forces, from each of `starts` until
/// one leads there; returns the point that comes nearest, if the film is at any start, and how
/// many films were tried where the walls do not meet.
///
/// `film` says of a position how far the forces are off, over the size of those that are wanted,
/// and how that changes with it, or nothing of that where they are the wanted ones; or `None` where
/// the walls meet. Positions should have a unit in which that is some 1 away. There
/// are as many forces as coordinates, one to three. `is_resolved` says of a position whether forces
/// change smoothly from there.
///
/// # Method
///
/// Newton's method where its steps do what the slopes predict. Elsewhere it follows the curve on
/// which the forces are off in the same direction as at the start, `F(e) − W = t (F(e₀) − W)`,
/// past folds, on which the slopes are singular, until `t` is zero; first the way on which `t`
/// falls, then the other one. Where forces grow without bound towards the walls, in each direction
/// at one place, all but a few of the curves from near the walls end at an equilibrium.
///
/// That nothing is found proves nothing: a curve may close, or lead along walls that meet. Where
/// the first one leads nowhere, the other way along a line, or else the films of `narrow`, at walls
/// that nearly meet, say what can be carried: if the forces are beyond that by `is_beyond`, no
/// other curve is followed.
///
/// # Cost
///
/// From a start nearby four to eight films with their slopes; 440 for each start, and 200 for each
/// halving of what is off, at most; no curve is begun after 300 in all where the nearest is not
/// resolved, as forces jump about there and every curve goes on. 40 with those of `narrow` for
/// forces beyond them. Of 700 loads drawn at random 431 were found, in 165 at most.
///
/// # Source
///
/// S. Smale, *A convergent process of price adjustment and global Newton methods*, J. Math. Econom.
/// 3 (1976) 107–120; the steps along a curve are those of E. Allgower and K. Georg, *Numerical
/// Continuation Methods*, Springer, 1990.
pub(super) fn equilibrium<E>(
    starts: &[Vec<f64>],
    narrow: impl Fn() -> Vec<Vec<f64>>,
    film: impl FnMut(&[f64]) -> Result<Option<Off>, E>,
    is_beyond: impl Fn() -> bool,
    is_resolved: impl Fn(&[f64]) -> bool,
) -> Result<(Option<Point>, usize), E> {
    let mut search = Search { film, nearest: None, films: 0, ends: 0 };
    // What each curve begins with, and whether another round would lead no further.
    let mut begun: Vec<(Option<Point>, bool)> = vec![];
    for (films, forwards) in ROUNDS {
        for (k, start) in starts.iter().enumerate() {
            let is_new = k == begun.len();
            if is_new {
                begun.push((search.at(DVector::from_column_slice(start))?, false));
            }
            let (Some(first), false) = (begun[k].0.clone(), begun[k].1 && forwards) else {
                continue;
            };
            let before = search.films;
            let is_smooth =
                search.nearest.as_ref().is_some_and(|near| is_resolved(near.at.as_slice()));
            let most = if is_smooth { usize::MAX } else { FILMS };
            let films = films.min(most.saturating_sub(before));
            if search.is_found() || films == 0 || search.follow(first.clone(), films, forwards)? {
                return Ok((search.nearest, search.films));
            }
            begun[k].1 = search.films < before + films;
            if is_new && k == 0 && search.is_hopeless(first, narrow(), &is_beyond)? {
                return Ok((search.nearest, search.films));
            }
        }
    }
    Ok((search.nearest, search.films))
}

/// How far forces are off, and the change of the `k`-th by the coordinate `l` at `(k, l)`, unless
/// they are the wanted ones.
type Off = (DVector<f64>, Option<DMatrix<f64>>);

/// A position, how far off its forces are, and the slopes of that.
#[derive(Clone)]
pub(super) struct Point {
    pub(super) at: DVector<f64>,
    pub(super) off: DVector<f64>,
    slopes: Option<DMatrix<f64>>,
}

impl Point {
    /// Whether the forces are the wanted ones.
    pub(super) fn is_found(&self) -> bool {
        self.slopes.is_none()
    }

    /// The step to where the slopes say that nothing is off.
    fn newton(&self) -> Option<DVector<f64>> {
        let step = self.slopes.clone()?.lu().solve(&-&self.off)?;
        step.iter().all(|by| by.is_finite()).then_some(step)
    }

    /// The step that goes `length` along a direction and leads to a multiple of `ray`, which comes
    /// with it.
    fn along(
        &self,
        ray: &DVector<f64>,
        direction: &DVector<f64>,
        length: f64,
    ) -> Option<(DVector<f64>, f64)> {
        let n = ray.len();
        let mut bordered = self.slopes.clone()?.resize(n + 1, n + 1, 0.0);
        let mut rhs = (-&self.off).resize_vertically(n + 1, length);
        for k in 0..n {
            (bordered[(k, n)], bordered[(n, k)]) = (-ray[k], direction[k]);
        }
        rhs = bordered.lu().solve(&rhs)?;
        let multiple = rhs[n];
        let step = rhs.resize_vertically(n, 0.0);
        (step.iter().all(|by| by.is_finite()) && multiple.is_finite()).then_some((step, multiple))
    }
}

struct Search<F> {
    film: F,
    nearest: Option<Point>,
    films: usize,
    /// How many curves led to walls that meet or are far apart, or to forces that do not come back.
    ends: usize,
}

impl<E, F: FnMut(&[f64]) -> Result<Option<Off>, E>> Search<F> {
    fn is_found(&self) -> bool {
        self.nearest.as_ref().is_some_and(Point::is_found)
    }

    /// The film at a position, which may be the nearest; `None` where the walls meet.
    fn at(&mut self, at: DVector<f64>) -> Result<Option<Point>, E> {
        let Some((off, slopes)) = (self.film)(at.as_slice())? else { return Ok(None) };
        self.films += 1;
        let distance = off.norm();
        if !distance.is_finite() {
            return Ok(None);
        }
        let point = Point { at, off, slopes };
        let is_nearer = |nearest: &Point| point.is_found() || distance < nearest.off.norm();
        if self.nearest.as_ref().is_none_or(is_nearer) {
            self.nearest = Some(point.clone());
        }
        Ok(Some(point))
    }

    /// Whether no other curve is worth following than that from `first`, which has led nowhere.
    fn is_hopeless(
        &mut self,
        first: Point,
        narrow: Vec<Vec<f64>>,
        is_beyond: &impl Fn() -> bool,
    ) -> Result<bool, E> {
        if first.off.len() == 1 {
            // Both ways along a line are all that there is.
            let is_found = self.follow(first, ROUNDS[0].0, false)?;
            return Ok(is_found || self.ends == 2 && is_beyond());
        }
        let mut are_solved = !narrow.is_empty();
        for at in narrow {
            are_solved &= self.at(at.into())?.is_some();
        }
        Ok(self.is_found() || are_solved && is_beyond())
    }

    /// Follows the curve from a point on which forces are off in the same direction, to where they
    /// are not off; whether it leads there.
    fn follow(&mut self, mut here: Point, films: usize, forwards: bool) -> Result<bool, E> {
        let mut ray = here.off.clone();
        let Some(newton) = here.newton() else { return Ok(false) };
        let mut direction = newton.normalize() * if forwards { 1.0 } else { -1.0 };
        let (mut length, mut least, mut last) = (STEP, here.off.norm(), self.films + films);
        while self.films < last {
            if length > FAR {
                self.ends += 1;
                return Ok(false);
            }
            let Some((mut step, multiple)) = here.along(&ray, &direction, length) else {
                return Ok(false);
            };
            let mut wanted = &ray * multiple;
            let mut margin = FOLLOWING;
            if multiple <= 0.0
                && let Some(newton) = here.newton()
            {
                (step, margin) = (newton, ARRIVING);
                wanted.fill(0.0);
            }
            let size = here.off.norm();
            let mut halvings = 0;
            let next = loop {
                if halvings > HALVINGS || self.films >= last {
                    return Ok(false);
                }
                halvings += 1;
                if let Some(next) = self.at(&here.at + &step)? {
                    if self.is_found() {
                        return Ok(true);
                    }
                    let error = (&next.off - &wanted).norm();
                    if error <= margin * size {
                        // The error grows with the square of the step.
                        length = step.norm() * if 4.0 * error <= margin * size { 2.0 } else { 1.0 };
                        break next;
                    }
                } else if step.norm() < MEETS {
                    self.ends += 1;
                    return Ok(false);
                }
                step /= 2.0;
                wanted = (wanted + &here.off) / 2.0;
                margin = FOLLOWING;
            };
            let size = next.off.norm();
            if size > AWAY * ray.norm().max(1.0) {
                self.ends += 1;
                return Ok(false);
            }
            if size <= least / 2.0 {
                (least, last) = (size, self.films + films);
            }
            direction = step.normalize();
            here = next;
            if margin == ARRIVING
                && let Some(newton) = here.newton()
            {
                // Beyond it or beside it, the curve is another one.
                (ray, direction) = (here.off.clone(), newton.normalize());
            }
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_of_a_cube_is_found() {
        let cube = |e: &[f64]| {
            let off = DVector::from_element(1, (e[0].powi(3) - 8.0) / 8.0);
            let slope = DMatrix::from_element(1, 1, 3.0 * e[0] * e[0] / 8.0);
            Ok::<_, ()>(Some((off.clone(), Some(slope).filter(|_| off.norm() > 1e-9))))
        };
        let (nearest, films) =
            equilibrium(&[vec![1.0]], Vec::new, cube, || false, |_| true).unwrap();
        let nearest = nearest.unwrap();
        assert!(nearest.is_found() && (nearest.at[0] - 2.0).abs() <= 1e-9 && films < 12);
    }
}
