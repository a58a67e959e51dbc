//! The search for a position that carries a load.

use nalgebra::{DMatrix, DVector};

/// The forces at a position of a wall, a force for each coordinate, and how they change with it:
/// `slopes[k][l]` is the change of force `k` by coordinate `l`, of which nothing is asked where the
/// forces are those that are wanted.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Forces {
    pub(super) values: Vec<f64>,
    pub(super) slopes: Vec<Vec<f64>>,
}

/// What a search for an equilibrium came to.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Equilibrium {
    /// Whether the forces at the position are the wanted ones, to 10⁻⁹ of their size.
    pub(super) found: bool,
    /// The position that comes nearest; empty if the film is at no start.
    pub(super) position: Vec<f64>,
    /// The forces there.
    pub(super) forces: Vec<f64>,
    /// How often forces were asked for where the walls do not meet.
    pub(super) films: usize,
}

/// How near the forces come to the wanted ones, over the size of these.
pub(super) const WITHIN: f64 = 1e-9;

/// What the slopes may err by in a step, over what is left to go: in one that is to arrive, and in
/// one along a curve.
const ARRIVING: f64 = 0.5;
const FOLLOWING: f64 = 0.25;

/// The first step, in the unit of positions, and how often a step is halved before walls are said
/// to meet.
const STEP: f64 = 0.25;
const HALVINGS: usize = 40;

/// How many films a curve may take, and which way it is followed, in turn; and how many all may.
const ROUNDS: [(usize, bool); 3] = [(40, true), (200, true), (200, false)];
const FILMS: usize = 1000;

/// Forces that grow to so many times what they were, or were to be, do not come back.
const AWAY: f64 = 100.0;

/// Searches for a position at which a film exerts the `wanted` forces, to 10⁻⁹ of their size, from
/// each of `starts` until one leads there.
///
/// `forces` is the film in a position, or `None` where the walls meet; positions should have a unit
/// in which that is some 1 away. There are as many forces as coordinates, one to three.
///
/// # Method
///
/// Newton's method where its steps do what the slopes predict. Elsewhere it follows the curve on
/// which the forces are off in the same direction as at the start, `F(e) − W = t (F(e₀) − W)`,
/// past folds, on which the slopes are singular, until `t` is zero; first the way on which `t`
/// falls, then the other one. Where forces grow without bound towards the walls, in each direction
/// at one place, all but a few of the curves from near the walls end at an equilibrium.
///
/// That nothing is found proves nothing: a curve may close, or lead along walls that meet.
///
/// # Cost
///
/// From a start nearby four to eight films with their slopes; at most some 200 from each start.
///
/// # Source
///
/// S. Smale, *A convergent process of price adjustment and global Newton methods*, J. Math. Econom.
/// 3 (1976) 107–120; the steps along a curve are those of E. Allgower and K. Georg, *Numerical
/// Continuation Methods*, Springer, 1990.
pub(super) fn equilibrium<E>(
    wanted: &[f64],
    starts: &[Vec<f64>],
    forces: impl FnMut(&[f64]) -> Result<Option<Forces>, E>,
) -> Result<Equilibrium, E> {
    let size = wanted.iter().copied().fold(0.0, f64::hypot);
    let size = if size > 0.0 { size } else { 1.0 };
    let nearest = Equilibrium { found: false, position: vec![], forces: vec![], films: 0 };
    let mut search = Search { wanted, size, forces, nearest, off: f64::INFINITY };
    let mut begun: Vec<Option<Point>> = vec![];
    for (films, forwards) in ROUNDS {
        for (k, start) in starts.iter().enumerate() {
            if k == begun.len() {
                begun.push(search.at(&DVector::from_column_slice(start))?);
            }
            let Some(first) = begun[k].clone() else { continue };
            if search.nearest.found
                || search.nearest.films >= FILMS
                || search.follow(first, films, forwards)?
            {
                return Ok(search.nearest);
            }
        }
    }
    Ok(search.nearest)
}

/// A position, how far off its forces are, in units of those wanted, and the slopes of that.
#[derive(Clone)]
struct Point {
    at: DVector<f64>,
    off: DVector<f64>,
    slopes: DMatrix<f64>,
}

impl Point {
    /// The step to where the slopes say that nothing is off.
    fn newton(&self) -> Option<DVector<f64>> {
        let step = self.slopes.clone().lu().solve(&-&self.off)?;
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
        let mut bordered = self.slopes.clone().resize(n + 1, n + 1, 0.0);
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

struct Search<'w, F> {
    wanted: &'w [f64],
    size: f64,
    forces: F,
    nearest: Equilibrium,
    /// How far off the nearest is.
    off: f64,
}

impl<E, F: FnMut(&[f64]) -> Result<Option<Forces>, E>> Search<'_, F> {
    fn at(&mut self, at: &DVector<f64>) -> Result<Option<Point>, E> {
        let (n, at) = (self.wanted.len(), at.clone());
        assert_eq!(at.len(), n, "a start with a coordinate for each force");
        let Some(Forces { values, slopes }) = (self.forces)(at.as_slice())? else {
            return Ok(None);
        };
        self.nearest.films += 1;
        assert!(values.len() == n && slopes.len() == n, "a force for each that is wanted");
        let off = DVector::from_fn(n, |k, _| (values[k] - self.wanted[k]) / self.size);
        let slopes = DMatrix::from_fn(n, n, |k, l| slopes[k][l] / self.size);
        let distance = off.norm();
        if !distance.is_finite() {
            return Ok(None);
        }
        if distance < self.off {
            self.off = distance;
            let found = distance <= WITHIN;
            (self.nearest.found, self.nearest.forces) = (found, values);
            self.nearest.position = at.as_slice().to_vec();
        }
        Ok(Some(Point { at, off, slopes }))
    }

    /// Follows the curve from a point on which forces are off in the same direction, to where they
    /// are not off; whether it leads there.
    fn follow(&mut self, mut here: Point, films: usize, forwards: bool) -> Result<bool, E> {
        let mut ray = here.off.clone();
        let Some(newton) = here.newton() else { return Ok(false) };
        let mut direction = newton.normalize() * if forwards { 1.0 } else { -1.0 };
        let (mut length, last) = (STEP, self.nearest.films + films);
        while self.nearest.films < last {
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
                if halvings > HALVINGS || self.nearest.films >= last {
                    return Ok(false);
                }
                halvings += 1;
                if let Some(next) = self.at(&(&here.at + &step))? {
                    if self.nearest.found {
                        return Ok(true);
                    }
                    let error = (&next.off - &wanted).norm();
                    if error <= margin * size {
                        // The error grows with the square of the step.
                        length = step.norm() * if 4.0 * error <= margin * size { 2.0 } else { 1.0 };
                        break next;
                    }
                }
                step /= 2.0;
                wanted = (wanted + &here.off) / 2.0;
                margin = FOLLOWING;
            };
            if next.off.norm() > AWAY * ray.norm().max(1.0) {
                return Ok(false);
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
            let slopes = vec![vec![3.0 * e[0] * e[0]]];
            Ok::<_, ()>(Some(Forces { values: vec![e[0].powi(3)], slopes }))
        };
        let search = equilibrium(&[8.0], &[vec![1.0]], cube).unwrap();
        assert!(search.found && (search.position[0] - 2.0).abs() <= 1e-9 && search.films < 12);
    }

    /// A short bearing without a broken film: the force grows without bound as the walls meet.
    #[test]
    fn a_heavy_load_is_carried_near_the_wall() {
        let bearing = |e: &[f64]| {
            let room = 1.0 - e[0] * e[0] - e[1] * e[1];
            let slope = |k: usize, l: usize| {
                f64::from(u8::from(k == l)) / room + 2.0 * e[k] * e[l] / (room * room)
            };
            let slopes = (0..2).map(|k| (0..2).map(|l| slope(k, l)).collect()).collect();
            let values = vec![e[0] / room, e[1] / room];
            Ok::<_, ()>((room > 0.0).then_some(Forces { values, slopes }))
        };
        let search = equilibrium(&[0.0, 40.0], &[vec![0.5, 0.0]], bearing).unwrap();
        assert!(search.found && search.position[1] > 0.98);
    }
}
