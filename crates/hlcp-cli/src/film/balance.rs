//! The position that carries a load, and how the film answers to a small motion.

use std::{error::Error, ops::ControlFlow};

use hlcp_core::{Hlcp, Identity, Rows};
use hlcp_methods::{Amg, Jacobian, Limits, Named, Options, Outcome, Parameters, Progress, Solver};
use hlcp_verify::{Certificate, Film, Forces, Refusal, certify};

use super::{Arguments, Numbers, doubtful, gap::Posed};
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

/// What is asked of a solve.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    /// The method, unless the command line names one.
    pub(super) method: &'static str,
    /// The least content of a cell that is taken for rounding.
    least: f64,
    /// The residual that rounding excuses, in units of the rounding of its terms.
    rounding: f64,
}

impl Asked {
    /// A film by a method, as near as rounding allows.
    pub(super) fn film(method: &'static str) -> Self {
        Self { method, least: LEAST, rounding: ROUNDING }
    }
}

/// Rounding in a residual is some ε of its terms, and these are films of any units.
fn limits(rounding: f64) -> Limits {
    Limits { rounding: Some(rounding), ..Limits::relative(1e-12) }
}

const ROUNDING: f64 = 4.0;

/// In a search, where a film that is done before it begins would carry what the last one did.
const EXACT: f64 = 0.25;

impl Solved {
    /// Solves for the film, from a solution of a similar one if there is one.
    pub(super) fn new(film: Film, start: Option<&Self>, arguments: &Arguments) -> Fallible<Self> {
        Self::to(ROUNDING, film, start, arguments)
    }

    /// As near to the solution as rounding allows.
    fn exact(film: Film, start: &Self, arguments: &Arguments) -> Fallible<Self> {
        let found = Self::to(EXACT, film, Some(start), arguments)?;
        if found.outcome.converged() {
            return Ok(found);
        }
        Self::new(found.film, Some(start), arguments)
    }

    fn to(
        rounding: f64,
        film: Film,
        start: Option<&Self>,
        arguments: &Arguments,
    ) -> Fallible<Self> {
        let (a, b, q) = film.pose()?;
        // A steady film; what a step begins with may be below 0 by rounding.
        let least = if film.step.is_none() { LEAST } else { f64::NEG_INFINITY };
        let asked = Asked { least, rounding, ..Asked::film(METHOD) };
        let begin = match start {
            Some(start) => Some(start.scaled(&film)),
            // Dry: in a ring the content that is left is settled by the loss alone, which is less
            // than what a solve leaves of the residual.
            None => (!film.is_fed()).then(|| [vec![0.0; q.len()], film.dry()]),
        };
        let (z, r, x, outcome) = solve(&Problem::new(a, b, q), begin, asked, arguments)?;
        Ok(Self { film, z, r, x, outcome })
    }

    /// The same gap by the clamp of the tables, `z ≥ 0` without a balance of mass.
    fn clamped(&self, arguments: &Arguments) -> Fallible<Self> {
        let (a, _, q) = self.film.pose()?;
        let problem = Problem::new(a, Identity { order: q.len() }, q);
        // Its r is no void fraction.
        let asked = Asked { least: f64::NEG_INFINITY, ..Asked::film(METHOD) };
        let begin = Some(self.scaled(&self.film));
        let (z, r, x, outcome) = solve(&problem, begin, asked, arguments)?;
        Ok(Self { film: self.film.clone(), z, r, x, outcome })
    }

    /// `z` and `r` in the units of another film.
    fn scaled(&self, film: &Film) -> [Vec<f64>; 2] {
        let by = self.film.pressure_unit() / film.pressure_unit();
        [self.z.iter().map(|z| z * by).collect(), self.r.clone()]
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

/// Solves from `begin`, by the method of the command line or by the usual one, and by another where
/// that does not converge or leaves a content `1 − r` below `least`.
pub(super) fn solve(
    given: &Problem<f64>,
    begin: Option<[Vec<f64>; 2]>,
    Asked { method, least, rounding }: Asked,
    arguments: &Arguments,
) -> Fallible<Answer> {
    let (mut problem, q) = (given.hlcp(1.0)?, &given.q);
    if arguments.threads.is_some_and(|threads| threads > 1) {
        problem = problem.in_parallel();
    }
    let name = arguments.method.as_deref();
    let limits = limits(rounding);
    let attempt = |name: &str| -> Fallible<Answer> {
        let method = Named::parse(name, Parameters::default())?.on(problem.clone())?;
        let mut solver = Solver::new(method);
        let mut way = Way::new(name, goal(&limits, q), &limits);
        let mut show = |progress: &Progress<'_, f64>| {
            way.show(progress);
            ControlFlow::Continue(())
        };
        let options = match &begin {
            Some([z, r]) => Options::from_solution(z, r),
            None => Options::default(),
        };
        let outcome = solver.solve(q, options.limits(limits).observer(&mut show))?;
        Ok((solver.z().to_vec(), solver.r().to_vec(), solver.x().to_vec(), outcome))
    };
    let found = attempt(name.unwrap_or(method))?;
    let is_film =
        |(_, r, _, outcome): &Answer| outcome.converged() && r.iter().all(|r| 1.0 - r >= least);
    if is_film(&found) || name.is_some() || rounding < ROUNDING {
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

/// A search goes no further than to this part of the least gap that it began with.
const NARROWEST: f64 = 1e-4;

/// Where a search begins when the first place has led nowhere: sizes and angles from there, and
/// rises and slopes.
const RINGS: [[f64; 3]; 8] = [
    [0.5, 2.4, 0.0],
    [0.5, -1.6, 0.0],
    [0.05, 0.0, 0.0],
    [0.5, 0.9, 0.0],
    [0.9, 0.0, 0.0],
    [0.9, 2.1, 0.0],
    [0.9, -2.1, 0.0],
    [0.05, 3.1, 0.0],
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

/// What a film is asked to carry, as equations for the coordinates that move.
struct Wanted {
    /// The forces, in N.
    forces: Vec<f64>,
    /// The coordinates that move, and a length or a slope of each that leads to the other wall.
    moving: Vec<usize>,
    units: Vec<f64>,
    /// Of a moment the lever that makes a force of it.
    levers: Vec<f64>,
    is_journal: bool,
    /// Of a journal whose grooves turn with it only the size of the force is asked for.
    is_size: bool,
}

impl Wanted {
    fn new(posed: &Posed, load: &[f64], arguments: &Arguments) -> Fallible<Self> {
        let lengths = posed.film.lengths;
        let place = match *load {
            [_] => None,
            [_, x, y] if posed.journal.is_none() => {
                let at = [x, y].map(|v| v * arguments.x_unit);
                if let Some(axis) = (0..2).find(|&axis| !(0.0..=lengths[axis]).contains(&at[axis]))
                {
                    let (name, place, end) = (["X", "Y"][axis], at[axis], lengths[axis]);
                    return Err(format!("--load: {name} is {place} m, outside the film, which ends at {end} m; X and Y are in units of --x-unit").into());
                }
                Some([0, 1].map(|axis| at[axis] - lengths[axis] / 2.0))
            }
            _ => return Err("--load takes LOAD, or LOAD,X,Y of anything but a journal".into()),
        };
        let load = load[0];
        if load <= 0.0 {
            return Err(format!("--load is {load} N, but it must be positive").into());
        }
        if let Some([clearance, _]) = posed.journal {
            let is_size = arguments.attitude.is_none();
            let (sin, cos) = posed.load_direction(arguments).sin_cos();
            let forces = if is_size { vec![load] } else { vec![load * cos, load * sin] };
            let n = forces.len();
            let (moving, units) = ((0..n).collect(), vec![clearance; n]);
            return Ok(Self {
                forces,
                moving,
                units,
                levers: vec![1.0; n],
                is_size,
                is_journal: true,
            });
        }
        let moves = |&k: &usize| k == 0 || posed.modes[k].iter().any(|&mode| mode != 0.0);
        let moving: Vec<usize> = (0..if place.is_some() { 3 } else { 1 }).filter(moves).collect();
        let thin = posed.here().gap.iter().copied().fold(f64::INFINITY, f64::min);
        let lever = |&k: &usize| if k == 0 { 1.0 } else { lengths[k - 1] / 2.0 };
        let levers: Vec<f64> = moving.iter().map(lever).collect();
        let force = |(&k, lever): (&usize, &f64)| match place {
            Some(place) if k > 0 => load * place[k - 1] / lever,
            _ => load,
        };
        let forces = moving.iter().zip(&levers).map(force).collect();
        let units = levers.iter().map(|lever| thin / lever).collect();
        Ok(Self { forces, moving, units, levers, is_size: false, is_journal: false })
    }

    /// Where to begin, after the position of the command line.
    fn starts(&self, first: Vec<f64>) -> Vec<Vec<f64>> {
        let many = self.moving.len();
        let offsets: &[[f64; 3]] = match (self.is_journal, many) {
            (true, 1) => &[[0.05, 0.0, 0.0], [0.9, 0.0, 0.0], [0.2, 0.0, 0.0], [0.98, 0.0, 0.0]],
            (true, _) => &RINGS,
            (false, _) => &PLANES,
        };
        let place = |by: &[f64; 3]| match (self.is_journal, many) {
            (true, 1) => vec![by[0]],
            (true, _) => {
                let [size, angle, _] = *by;
                let angle = angle + first[1].atan2(first[0]);
                vec![size * angle.cos(), size * angle.sin()]
            }
            (false, _) => first.iter().zip(&self.moving).map(|(at, &k)| at + by[k]).collect(),
        };
        let mut starts: Vec<Vec<f64>> = offsets.iter().map(place).collect();
        starts.insert(0, first);
        starts.dedup();
        starts
    }

    /// How far forces are from those that are asked for, in N.
    fn distance(&self, forces: &[f64]) -> f64 {
        let off = self.forces.iter().zip(forces).map(|(wanted, found)| found - wanted);
        off.fold(0.0, f64::hypot)
    }

    /// The forces that are asked for in a position, from all of them, and their slopes by the
    /// coordinates that move.
    fn forces(&self, forces: &[f64], slopes: &[Vec<f64>]) -> Forces {
        let by = |slope: &dyn Fn(usize) -> f64| -> Vec<f64> {
            self.moving.iter().zip(&self.units).map(|(&l, unit)| unit * slope(l)).collect()
        };
        if self.is_size {
            let size = forces[0].hypot(forces[1]);
            let slope = |l: usize| {
                let [x, y] = [slopes[0][l], slopes[1][l]];
                // From nothing it grows whatever its direction.
                if size > 0.0 { (forces[0] * x + forces[1] * y) / size } else { x.hypot(y) }
            };
            return Forces { values: vec![size], slopes: vec![by(&slope)] };
        }
        let rows = || self.moving.iter().zip(&self.levers);
        Forces {
            values: rows().map(|(&k, lever)| forces[k] / lever).collect(),
            slopes: rows().map(|(&k, lever)| by(&|l| slopes[k][l] / lever)).collect(),
        }
    }
}

/// Moves the wall to where it carries the load of the command line; the solves that it took.
pub(super) fn equilibrium(posed: &mut Posed, arguments: &Arguments) -> Fallible<(Solved, usize)> {
    let wanted = match &arguments.load {
        Some(Numbers(load)) => Some(Wanted::new(posed, load, arguments)?),
        None => None,
    };
    if wanted.as_ref().is_some_and(|wanted| wanted.is_journal && !wanted.is_size) {
        // The least gap is some 50° ahead of the load.
        let size = posed.position[0];
        let ahead = posed.load_direction(arguments) + 0.9 * posed.direction();
        posed.position = vec![-size * ahead.cos(), -size * ahead.sin()];
    }
    let first = Solved::new(posed.here(), None, arguments)?;
    let Some(wanted) = wanted.filter(|_| first.outcome.converged()) else { return Ok((first, 1)) };
    let thin = first.film.gap.iter().copied().fold(f64::INFINITY, f64::min);
    let coordinates = || wanted.moving.iter().zip(&wanted.units);
    let begun = posed.position.clone();
    let starts = wanted.starts(coordinates().map(|(&k, unit)| begun[k] / unit).collect());
    let in_film = |at: &[f64]| {
        let mut position = begun.clone();
        coordinates().zip(at).for_each(|((&k, unit), at)| position[k] = at * unit);
        position
    };
    let (mut solved, mut is_first, mut failed) = (first, true, 0);
    let [mut least, mut largest] = [f64::INFINITY, 0.0_f64];
    let search = hlcp_verify::equilibrium(&wanted.forces, &starts, |at| -> Fallible<_> {
        if !std::mem::take(&mut is_first) {
            let is_open = |film: &Film| film.gap.iter().all(|&gap| gap >= NARROWEST * thin);
            let is_inside = !wanted.is_size || at[0] >= 0.0;
            let Some(film) = posed.at(&in_film(at)).filter(|film| is_inside && is_open(film))
            else {
                return Ok(None);
            };
            let next = Solved::exact(film, &solved, arguments)?;
            if !next.outcome.converged() {
                failed += 1;
                return Ok(None);
            }
            solved = next;
        }
        let forces = posed.forces(&solved.film, &solved.z);
        let carried = if wanted.is_journal { forces[0].hypot(forces[1]) } else { forces[0] };
        (least, largest) = (least.min(carried), largest.max(carried));
        let Ok(slopes) = solved.slopes(posed, &wanted.moving) else {
            failed += 1;
            return Ok(None);
        };
        Ok(Some(wanted.forces(&forces, &slopes)))
    })?;
    let films = search.films + failed;
    if search.found {
        posed.position = in_film(&search.position);
        return Ok((solved, films));
    }
    let asked = &arguments.load.as_ref().map_or(vec![], |Numbers(load)| load.clone());
    let carried = if least > asked[0] {
        format!("carries {least:.6e} N or more, also by the pressures of supplies and sides")
    } else if largest < asked[0] {
        format!("carries {largest:.6e} N or less")
    } else {
        format!("is off it by {:.1e} N or more", wanted.distance(&search.forces))
    };
    let place = match asked[..] {
        [_, x, y] => format!(" at {x}, {y} in units of --x-unit"),
        _ => String::new(),
    };
    let unsolved =
        if failed > 0 { format!(", and {failed} did not converge") } else { String::new() };
    let way_out = doubtful(thin, &solved.film.lengths, 0.0).unwrap_or_else(|| {
        let begin = if wanted.is_journal { "--ecc" } else { "gaps nearer to the right ones" };
        format!("give --load in N, check the units of the film, or begin elsewhere, by {begin}")
    });
    Err(format!(
        "--load: the search for a position that carries {} N{place} failed; each of the {films} \
         films that were tried {carried}{unsolved}, which does not prove that there is none; \
         {way_out}",
        asked[0]
    )
    .into())
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
