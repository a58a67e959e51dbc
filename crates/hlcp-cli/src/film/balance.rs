//! The position that carries a load, and how the film answers to a small motion.

use std::{error::Error, ops::ControlFlow};

use hlcp_core::{Hlcp, Identity, Rows};
use hlcp_methods::{Amg, Jacobian, Limits, Named, Options, Outcome, Parameters, Progress, Solver};
use hlcp_verify::{Certificate, Film, Refusal, certify};

use super::{Arguments, doubtful, gap::Posed};
use crate::{
    progress::Way,
    scenes::{Problem, goal},
};

type Fallible<T> = Result<T, Box<dyn Error>>;

/// A film with its solution.
pub(super) struct Solved {
    pub(super) film: Film,
    pub(super) z: Vec<f64>,
    pub(super) r: Vec<f64>,
    /// The modulus variable, whose signs tell full cells from broken ones.
    x: Vec<f64>,
    pub(super) outcome: Outcome,
}

/// Newton's method takes some six steps, whatever the texture.
pub(super) const METHOD: &str = "AMG";

/// How exact the derivatives are that lead to a position: each step of the search takes off seven
/// digits at best.
const SEARCH: f64 = 1e-7;

/// It tries methods of all kinds, and leaves those that make no way.
const FALLBACK: &str = "AUTO";

/// The least content of a film, but for rounding.
const LEAST: f64 = -1e-9;

/// Rounding in a residual is some ε of its terms, and these are films of any units.
fn limits() -> Limits {
    Limits { rounding: Some(4.0), ..Limits::relative(1e-12) }
}

impl Solved {
    /// Solves for the film, from a solution of a similar one if there is one.
    pub(super) fn new(film: Film, start: Option<&Self>, arguments: &Arguments) -> Fallible<Self> {
        let (a, b, q) = film.pose()?;
        // A steady film; what a step begins with may be below 0 by rounding.
        let least = if film.step.is_none() { LEAST } else { f64::NEG_INFINITY };
        let (z, r, x, outcome) = solve(&film, &Problem::new(a, b, q), start, least, arguments)?;
        Ok(Self { film, z, r, x, outcome })
    }

    /// The same gap by the clamp of the tables, `z ≥ 0` without a balance of mass.
    fn clamped(&self, arguments: &Arguments) -> Fallible<Self> {
        let (a, _, q) = self.film.pose()?;
        let problem = Problem::new(a, Identity { order: q.len() }, q);
        let least = f64::NEG_INFINITY; // its r is no void fraction
        let (z, r, x, outcome) = solve(&self.film, &problem, Some(self), least, arguments)?;
        Ok(Self { film: self.film.clone(), z, r, x, outcome })
    }

    /// The proof of the solution, with bounds on its errors, or why there is none.
    pub(super) fn certificate(&self) -> Fallible<Result<Certificate, Refusal>> {
        let (a, b, q) = self.film.pose()?;
        Ok(certify(&a, &b, &q, &self.z, &self.r)?)
    }

    /// The derivatives of the forces for a change of the position, and for its speed while it
    /// changes slowly, each a matrix with a column for each coordinate that moves.
    ///
    /// With `δz + δr` what a change brings about, `J (δz, δr) = −∂(A z − B r + q)/∂h`, the film
    /// of a wall that moves with speed `v` lags behind by what it stores, `∂t(θh)`: to first order
    /// in `v` it is the steady one and the answer of `J` to `−v ∂(θh)/∂e`. By the clamp, which
    /// knows no content, only the gap stores.
    pub(super) fn derivatives(
        &self,
        posed: &Posed,
        is_clamped: bool,
    ) -> Fallible<[Vec<Vec<f64>>; 2]> {
        let all: Vec<usize> = (0..posed.modes.len()).collect();
        self.answers(posed, &all, is_clamped, true)
    }

    /// The derivatives of the forces for a change of the position, with zeros for coordinates that
    /// do not move.
    pub(super) fn slopes(&self, posed: &Posed, moving: &[usize]) -> Fallible<Vec<Vec<f64>>> {
        let [of_position, _] = self.answers(posed, moving, false, false)?;
        Ok(of_position)
    }

    fn answers(
        &self,
        posed: &Posed,
        moving: &[usize],
        is_clamped: bool,
        with_speed: bool,
    ) -> Fallible<[Vec<Vec<f64>>; 2]> {
        let (film, count) = (&self.film, posed.modes.len());
        let full = vec![0.0; self.r.len()];
        let r = if is_clamped { &full } else { &self.r };
        let (a, b, q) = film.pose()?;
        let problem = if is_clamped {
            Problem::new(a, Identity { order: r.len() }, q)
        } else {
            Problem::new(a, b, q)
        };
        let problem = problem.hlcp(1.0)?;
        let mut response = Response::new(&problem, &self.x)?;
        let tolerance = if with_speed { 1e-13 } else { SEARCH };
        let unit = film.pressure_unit() * film.cell();
        let force = |z: &[f64], mode: &[f64]| {
            unit * z.iter().zip(mode).map(|(z, mode)| z * mode).sum::<f64>()
        };
        let mut found = [(); 2].map(|()| vec![vec![0.0; count]; count]);
        for &column in moving {
            let mode = &posed.modes[column];
            let [z, mut emptied] = response.to(&film.widening(&self.z, r, mode), tolerance)?;
            let mut answers = vec![z];
            if with_speed {
                if is_clamped {
                    emptied.fill(0.0);
                }
                let [z, _] = response.to(&film.storing(r, mode, &emptied), tolerance)?;
                answers.push(z);
            }
            for (matrix, z) in found.iter_mut().zip(&answers) {
                for (row, mode) in matrix.iter_mut().zip(&posed.modes) {
                    row[column] = force(z, mode);
                }
            }
        }
        Ok(found)
    }
}

/// `z`, `r`, `x` and what became of the solve.
type Answer = (Vec<f64>, Vec<f64>, Vec<f64>, Outcome);

/// Solves by the method of the command line, or by the usual one, and by another where that does
/// not converge or leaves a content `1 − r` below `least`.
fn solve(
    film: &Film,
    given: &Problem<f64>,
    start: Option<&Solved>,
    least: f64,
    arguments: &Arguments,
) -> Fallible<Answer> {
    let (mut problem, q) = (given.hlcp(1.0)?, &given.q);
    if arguments.threads.is_some_and(|threads| threads > 1) {
        problem = problem.in_parallel();
    }
    let scaled = match start {
        Some(start) => {
            let by = start.film.pressure_unit() / film.pressure_unit();
            Some((start.z.iter().map(|z| z * by).collect::<Vec<_>>(), start.r.clone()))
        }
        // Dry: in a ring the content that is left is settled by the loss alone, which is less than
        // what a solve leaves of the residual.
        None => (!film.is_fed()).then(|| (vec![0.0; q.len()], film.dry())),
    };
    let name = arguments.method.as_deref();
    let limits = limits();
    let attempt = |name: &str| -> Fallible<Answer> {
        let method = Named::parse(name, Parameters::default())?.on(problem.clone())?;
        let mut solver = Solver::new(method);
        let mut way = Way::new(name, goal(&limits, q), &limits);
        let mut show = |progress: &Progress<'_, f64>| {
            way.show(progress);
            ControlFlow::Continue(())
        };
        let options = match &scaled {
            Some((z, r)) => Options::from_solution(z, r),
            None => Options::default(),
        };
        let outcome = solver.solve(q, options.limits(limits).observer(&mut show))?;
        Ok((solver.z().to_vec(), solver.r().to_vec(), solver.x().to_vec(), outcome))
    };
    let found = attempt(name.unwrap_or(METHOD))?;
    let is_film =
        |(_, r, _, outcome): &Answer| outcome.converged() && r.iter().all(|r| 1.0 - r >= least);
    if is_film(&found) || name.is_some() {
        return Ok(found);
    }
    let other = attempt(FALLBACK)?;
    Ok(if other.3.converged() || !found.3.converged() { other } else { found })
}

/// The linear system of the derivatives at a solution.
struct Response<'p, A, B> {
    problem: &'p Hlcp<f64, A, B>,
    jacobian: Jacobian<'p, f64, A, B>,
    amg: Amg<f64>,
}

impl<'p, A: Rows<f64>, B: Rows<f64>> Response<'p, A, B> {
    fn new(problem: &'p Hlcp<f64, A, B>, x: &'p [f64]) -> Fallible<Self> {
        let jacobian = Jacobian::new(problem, x);
        Ok(Self { problem, jacobian, amg: Amg::new(problem)? })
    }

    /// The changes of `z` and `r` that a change of `A z − B r + q` brings about, full and broken
    /// cells staying what they are: `[A_F | −B_C] (δz, δr) = −change`.
    fn to(&mut self, change: &[f64], tolerance: f64) -> Fallible<[Vec<f64>; 2]> {
        // J δx = −change, with the columns 2A of J where a cell is full, and 2ΩB elsewhere.
        let Self { problem, jacobian, amg } = self;
        let mut s = vec![0.0; change.len()];
        let reached = amg.solve_to(jacobian, change, &mut s, tolerance, 400);
        // Rounding ends it sooner where the gap jumps.
        let enough = tolerance.max(1e-8);
        if reached > enough || reached.is_nan() {
            let asked = "the linear system of the derivatives was solved to";
            return Err(format!("{asked} {reached:.1e} instead of {enough:.0e}").into());
        }
        let full = |j: usize| jacobian.is_active(j);
        let z = |(j, s): (usize, &f64)| if full(j) { -2.0 * s } else { 0.0 };
        let r =
            |(j, s): (usize, &f64)| if full(j) { 0.0 } else { 2.0 * problem.omega().entry(j) * s };
        Ok([s.iter().enumerate().map(z).collect(), s.iter().enumerate().map(r).collect()])
    }
}

/// Stiffness and damping, and both by the clamp.
pub(super) struct Coefficients {
    pub(super) stiffness: Vec<Vec<f64>>,
    pub(super) damping: Vec<Vec<f64>>,
    pub(super) clamped: [Vec<Vec<f64>>; 2],
}

impl Coefficients {
    /// In the coordinates of the position; of a journal along `frame` and across it.
    pub(super) fn new(
        posed: &Posed,
        solved: &Solved,
        frame: Option<[f64; 2]>,
        arguments: &Arguments,
    ) -> Fallible<Self> {
        let turned = |matrix: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            let minus = |row: Vec<f64>| row.into_iter().map(|v| -v).collect::<Vec<f64>>();
            let matrix: Vec<Vec<f64>> = matrix.into_iter().map(minus).collect();
            let Some([cos, sin]) = frame else { return matrix };
            // Across is a quarter further in the direction of the motion.
            let sign = posed.direction();
            let axes = [[cos, sin], [-sign * sin, sign * cos]];
            let entry = |one: [f64; 2], other: [f64; 2]| {
                (0..2)
                    .flat_map(|k| (0..2).map(move |l| (k, l)))
                    .map(|(k, l)| one[k] * matrix[k][l] * other[l])
                    .sum()
            };
            axes.iter().map(|&one| axes.iter().map(|&other| entry(one, other)).collect()).collect()
        };
        let [stiffness, damping] = solved.derivatives(posed, false)?.map(turned);
        let clamped = solved.clamped(arguments)?;
        if !clamped.outcome.converged() {
            return Err(format!("the film by the clamp was not found: {}", clamped.outcome).into());
        }
        let clamped = clamped.derivatives(posed, true)?.map(turned);
        Ok(Self { stiffness, damping, clamped })
    }
}

/// What the forces of a position are to be.
struct Wanted {
    load: f64,
    /// The coordinates that move.
    moving: Vec<usize>,
    /// Of a journal the direction of the load, if that is given; elsewhere where it is to act, from
    /// the middle.
    direction: Option<f64>,
    place: Option<[f64; 2]>,
}

impl Wanted {
    /// How far forces are off, and the derivatives of that, from those of the forces.
    fn misses(
        &self,
        posed: &Posed,
        forces: &[f64],
        slopes: &[Vec<f64>],
    ) -> (Vec<f64>, Vec<Vec<f64>>) {
        let along = |k: usize| self.moving.iter().map(|&l| slopes[k][l]).collect::<Vec<f64>>();
        let combined = |factors: &[(usize, f64)]| -> Vec<f64> {
            let term = |l: usize| factors.iter().map(|&(k, factor)| factor * slopes[k][l]).sum();
            self.moving.iter().map(|&l| term(l)).collect()
        };
        if posed.journal.is_some() {
            let [x, y] = [forces[0], forces[1]];
            let square = x * x + y * y;
            let mut misses = vec![(square.sqrt() / self.load).ln()];
            let mut rows = vec![combined(&[(0, x / square), (1, y / square)])];
            if let Some(direction) = self.direction {
                let off = y.atan2(x) - direction;
                misses.push(off.sin().atan2(off.cos()));
                rows.push(combined(&[(1, x / square), (0, -y / square)]));
            }
            return (misses, rows);
        }
        let load = forces[0];
        let mut misses = vec![(load / self.load).ln()];
        let mut rows = vec![along(0).iter().map(|slope| slope / load).collect()];
        for &k in self.moving.iter().filter(|&&k| k > 0) {
            let at = forces[k] / load;
            let wanted = self.place.map_or(0.0, |place| place[k - 1]);
            let length = posed.film.lengths[k - 1];
            misses.push((at - wanted) / length);
            rows.push(combined(&[(k, 1.0 / (load * length)), (0, -at / (load * length))]));
        }
        (misses, rows)
    }
}

/// Moves the wall to where it carries the load of the command line; the solves that it took.
pub(super) fn equilibrium(posed: &mut Posed, arguments: &Arguments) -> Fallible<(Solved, usize)> {
    let Some(load) = &arguments.load else {
        return Ok((Solved::new(posed.here(), None, arguments)?, 1));
    };
    let wanted = wanted(posed, &load.0, arguments)?;
    let mut solved = Solved::new(posed.here(), None, arguments)?;
    let first = solved.film.gap.iter().copied().fold(f64::INFINITY, f64::min);
    let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
    for solves in 1..=60 {
        if !solved.outcome.converged() {
            return Ok((solved, solves));
        }
        let forces = posed.forces(&solved.film, &solved.z);
        let carried = if posed.journal.is_some() { forces[0].hypot(forces[1]) } else { forces[0] };
        (least, largest) = (least.min(carried), largest.max(carried));
        let thin = solved.film.gap.iter().copied().fold(f64::INFINITY, f64::min);
        let mut step = vec![0.0; posed.position.len()];
        if carried > 0.0 {
            let slopes = solved.slopes(posed, &wanted.moving)?;
            let (misses, rows) = wanted.misses(posed, &forces, &slopes);
            if misses.iter().all(|miss| miss.abs() <= 1e-9) {
                return Ok((solved, solves));
            }
            let Some(found) = eliminate(rows, misses) else { break };
            wanted.moving.iter().zip(found).for_each(|(&k, by)| step[k] = -by);
        } else {
            // A film that pulls may carry when it is thinner.
            step[0] = if posed.journal.is_some() { 0.1 * thin } else { -0.5 * thin };
        }
        // The logarithm of a load is no straight line: a step halves no gap and quadruples none.
        let film = loop {
            let next: Vec<f64> = posed.position.iter().zip(&step).map(|(at, by)| at + by).collect();
            let near = posed.at(&next).filter(|film| {
                let mut both = film.gap.iter().zip(&solved.film.gap);
                both.all(|(new, old)| (0.5 * thin..).contains(new) && *new <= 4.0 * old.max(thin))
            });
            if let Some(film) = near {
                posed.position = next;
                break film;
            }
            step.iter_mut().for_each(|by| *by /= 2.0);
        };
        let thin = film.gap.iter().copied().fold(f64::INFINITY, f64::min);
        if thin < 1e-3 * first {
            break;
        }
        solved = Solved::new(film, Some(&solved), arguments)?;
    }
    let asked = load.0[0];
    let way_out = doubtful(first, &solved.film.lengths, 0.0)
        .unwrap_or_else(|| "give --load in N, and check the units of the film".into());
    let tried = if let [_, x, y] = load.0[..] {
        let forces = posed.forces(&solved.film, &solved.z);
        let at = |k: usize| posed.film.lengths[k] / 2.0 + forces[k + 1] / forces[0];
        let [at_x, at_y] = [0, 1].map(|k| at(k) / arguments.x_unit);
        let last = if forces[0] > 0.0 {
            format!("carries {:.6e} N at {at_x:.6}, {at_y:.6}", forces[0])
        } else {
            "carries nothing".into()
        };
        format!(
            " at {x}, {y} was found; the last one tried {last}; X and Y are in units of --x-unit"
        )
    } else if least > asked {
        format!(
            " was found; the film carries {least:.6e} N or more, also by the pressures of its \
             supplies and sides; {way_out}"
        )
    } else {
        format!(" was found; the largest load found is {largest:.6e} N; {way_out}")
    };
    Err(format!("--load: no position that carries {asked} N{tried}").into())
}

fn wanted(posed: &Posed, load: &[f64], arguments: &Arguments) -> Fallible<Wanted> {
    let place = match *load {
        [_] => None,
        [_, x, y] if posed.journal.is_none() => {
            let lengths = posed.film.lengths;
            let at = [x, y].map(|v| v * arguments.x_unit);
            if let Some(axis) = (0..2).find(|&axis| !(0.0..=lengths[axis]).contains(&at[axis])) {
                let (name, place, end) = (["X", "Y"][axis], at[axis], lengths[axis]);
                return Err(format!("--load: {name} is {place} m, outside the film, which ends at {end} m; X and Y are in units of --x-unit").into());
            }
            Some([0, 1].map(|axis| at[axis] - lengths[axis] / 2.0))
        }
        _ => return Err("--load takes LOAD, or LOAD,X,Y of anything but a journal".into()),
    };
    if load[0] <= 0.0 {
        return Err(format!("--load is {} N, but it must be positive", load[0]).into());
    }
    let direction = arguments.attitude.filter(|_| posed.journal.is_some());
    let direction = direction.map(|_| posed.load_direction(arguments));
    let moving = match (posed.journal, direction, place) {
        (Some(_), Some(_), _) => vec![0, 1],
        (None, _, Some(_)) => {
            let moves = |&k: &usize| posed.modes[k].iter().any(|&mode| mode != 0.0);
            (0..3).filter(moves).collect()
        }
        _ => vec![0],
    };
    Ok(Wanted { load: load[0], moving, direction, place })
}

impl Posed {
    /// 1 if the walls carry the oil along x, −1 if against.
    pub(super) fn direction(&self) -> f64 {
        if self.film.speeds.iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 }
    }

    /// The direction of a journal's load, as an angle along x, from the attitude of the command
    /// line: an eccentricity in that position points to half a turn.
    pub(super) fn load_direction(&self, arguments: &Arguments) -> f64 {
        let attitude = arguments.attitude.unwrap_or(0.0).to_radians();
        std::f64::consts::PI - self.direction() * attitude
    }
}

/// Solves a few equations; `None` if they have not one solution.
pub(super) fn eliminate(mut rows: Vec<Vec<f64>>, mut rhs: Vec<f64>) -> Option<Vec<f64>> {
    let n = rhs.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| rows[i][k].abs().total_cmp(&rows[j][k].abs()))?;
        rows.swap(k, pivot);
        rhs.swap(k, pivot);
        if rows[k][k] == 0.0 || !rows[k][k].is_finite() {
            return None;
        }
        let (above, below) = rows.split_at_mut(k + 1);
        for (row, i) in below.iter_mut().zip(k + 1..) {
            let factor = row[k] / above[k][k];
            row.iter_mut().zip(&above[k]).for_each(|(entry, pivot)| *entry -= factor * pivot);
            rhs[i] -= factor * rhs[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| rows[k][j] * rhs[j]).sum();
        rhs[k] = (rhs[k] - known) / rows[k][k];
    }
    Some(rhs)
}
