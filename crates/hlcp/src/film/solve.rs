use std::ops::ControlFlow;

use hlcp_core::{Aor, Error, Hlcp, Identity, LinearOperator, Norms, Omega, Rows};
use hlcp_methods::{
    Limits, Method, Mms, NameError, Named, Options, Outcome, Parameters, Progress, Solver,
};
use hlcp_verify::{Certificate, Film, FilmChange, Refusal, certify};

use super::{Bearing, linear::Linear};

/// What has no answer, and why.
///
/// ```
/// use hlcp::film::{Film, FilmError, Settings, Solved};
///
/// let film = Film::new([2, 1], [-1.0, 0.01], 3.0, 0.04);
/// let refused = Solved::new(film, None, &Settings::default());
/// assert!(matches!(refused, Err(FilmError::Input(_))));
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FilmError {
    /// Numbers that are no film.
    #[error(transparent)]
    Input(#[from] hlcp_core::Error),
    /// A name of no method, or of one that needs parameters.
    #[error("{0}{out}", out = way_out(.0))]
    Method(#[from] NameError),
    /// A line with sizes that are not numbers, or too large or small for numbers.
    #[error(
        "the film is {length:e} m long with a least gap of {thin:e} m, which is not within the range of numbers"
    )]
    Range {
        /// From the first point to the last, in m.
        length: f64,
        /// The least gap, in m.
        thin: f64,
    },
    /// Two walls that meet.
    #[error("the walls meet")]
    Meet,
    /// A linear system for derivatives that was solved to this relative residual only.
    #[error("the linear system of the derivatives was solved to {0:.1e} only")]
    Derivatives(f64),
    /// A film by the clamp that was not found.
    #[error("the film by the clamp was not found: {0}")]
    Clamp(Box<Outcome>),
    /// A film with more cells than complex numbers are eliminated for.
    #[error(
        "coefficients at a frequency take an elimination, for at most {most} cells, but the film has {cells}; take fewer cells, or motions"
    )]
    Large {
        /// How many there are.
        cells: usize,
        /// How many there may be.
        most: usize,
    },
    /// Derivatives of a film in a step of time, which are not those of a bearing.
    #[error(
        "the film is one of a step in time, which stores oil while it lasts; take the steady film of that position"
    )]
    Unsteady,
    /// A step in time after which film, load and inertia are not in balance.
    #[error(
        "the step did not settle; take shorter steps, or a mass where the wall has none and the film carries nothing"
    )]
    Unsettled,
}

/// The rest of the answer to a name that films do not take.
fn way_out(error: &NameError) -> &'static str {
    match error {
        NameError::Missing { .. } => "; films take methods that need no parameters, as AMG or AUTO",
        _ => "",
    }
}

/// Is shown each iterate, with the name of the method, its limits and the norm that ends it, and
/// may stop the solve.
pub type Watch<'w> = dyn Fn(&str, &Limits, f64, &Progress<'_, f64>) -> ControlFlow<()> + 'w;

/// How films are solved.
///
/// ```
/// let usual = hlcp::film::Settings::default();
/// assert!(usual.method.is_none() && !usual.in_parallel);
/// ```
#[derive(Clone, Copy, Default)]
pub struct Settings<'s> {
    /// A name of [`Named`]; without one the usual method, and another where that does not converge.
    pub method: Option<&'s str>,
    /// Whether rayon's threads share the sweeps; without the feature `rayon` they never do.
    pub in_parallel: bool,
    /// Who is shown the iterates.
    pub watch: Option<&'s Watch<'s>>,
}

/// A film with its solution.
///
/// ```
/// use hlcp::film::{Film, Settings, Solved};
///
/// // A wedge, 50 mm by 30 mm.
/// let film = Film::new([50, 30], [0.05, 0.03], 3.0, 0.04).with_gap(|x, _| 4e-5 - 4e-4 * x);
/// let solved = Solved::new(film, None, &Settings::default())?;
/// assert!(solved.outcome.converged());
/// let load = solved.film.figures(&solved.z, &solved.r, 0.0).load;
/// assert!((800.0..900.0).contains(&load));
/// let known = Solved::known(solved.film, solved.z, solved.r)?;
/// assert!(known.outcome.converged());
/// # Ok::<(), hlcp::film::FilmError>(())
/// ```
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Solved {
    /// The film.
    pub film: Film,
    /// The pressures above that of cavitation, in [`Film::pressure_unit`].
    pub z: Vec<f64>,
    /// The part of the gap that no oil fills.
    pub r: Vec<f64>,
    /// What became of the solve.
    pub outcome: Outcome,
}

/// A method and the most steps that it may take.
pub(super) type Attempt<'n> = (&'n str, usize);

/// Newton's method takes some six steps, whatever the texture, and 19 at most on 540 films drawn at
/// random, without rings that nobody feeds; after these the other takes over, which tries methods
/// of all kinds.
const METHOD: Attempt<'_> = ("AMG", 50);
const FALLBACK: &str = "AUTO";

/// How exact derivatives are that are an answer, and those that lead to a position: each step of
/// the search takes off seven digits at best.
pub(super) const LINEAR: f64 = 1e-13;
const SEARCH: f64 = 1e-7;

/// The least content of a film, but for rounding.
pub(super) const LEAST: f64 = -1e-9;

/// The residual that a solve ends at, over ‖q‖.
pub(super) const TOLERANCE: f64 = 1e-12;

/// The rounding that is excused: by a solve that stands alone, and in a search, where a film that
/// is done before it begins would carry what the last one did.
pub(super) const ROUNDING: f64 = 4.0;
const EXACT: f64 = 0.25;

impl Solved {
    /// Solves for the film, from a solution of a similar one if there is one.
    ///
    /// # Errors
    ///
    /// [`FilmError::Input`] as [`Film::pose`]; [`FilmError::Method`] for a name of no method.
    pub fn new(
        film: Film,
        start: Option<&Self>,
        settings: &Settings<'_>,
    ) -> Result<Self, FilmError> {
        Self::to(ROUNDING, film, start, settings)
    }

    /// Returns a solution that is known, as one that was stored, with the residual that it has.
    ///
    /// # Errors
    ///
    /// [`FilmError::Input`] as [`Film::pose`], and for `z` and `r` of another length, or negative.
    pub fn known(film: Film, z: Vec<f64>, r: Vec<f64>) -> Result<Self, FilmError> {
        Self::judged(film, z, r, &Settings::default())
    }

    /// As known, shown to whoever watches.
    pub(super) fn judged(
        film: Film,
        z: Vec<f64>,
        r: Vec<f64>,
        settings: &Settings<'_>,
    ) -> Result<Self, FilmError> {
        let (operators, q) = posed(&film)?;
        let method = Mms::new(problem(&operators)?, Aor::gauss_seidel())?;
        let limits = Limits { iterations: 0, ..limits(ROUNDING) };
        let (.., outcome) = iterate(("MGS", method), &q, Some([&z, &r]), limits, settings)?;
        Ok(Self { film, z, r, outcome })
    }

    /// A guess for a film, from this solution and one before it, if the step there is `ratio` times
    /// as long as that between the two.
    pub(super) fn led(&self, before: &Self, ratio: f64, film: Film) -> Self {
        let ([z, r], [z0, r0]) = (self.scaled(&film), before.scaled(&film));
        let on = |(now, before): (&f64, &f64)| now + ratio * (now - before) - now;
        let [dz, dr] = [(&z, &z0), (&r, &r0)]
            .map(|(now, before)| now.iter().zip(before).map(on).collect::<Vec<_>>());
        let mut guess = Self { film, z, r, outcome: self.outcome };
        guess.go(&dz, &dr);
        guess
    }

    /// Adds changes of `z` in full cells and of `r` in broken ones; how many cells these fill or
    /// break, which is where they stop.
    pub(super) fn go(&mut self, dz: &[f64], dr: &[f64]) -> usize {
        let mut flips = 0;
        for (k, (z, r)) in self.z.iter_mut().zip(&mut self.r).enumerate() {
            let is_full = *r <= 0.0;
            let now = if is_full { *z + dz[k] } else { *r + dr[k] };
            (*z, *r) = match (is_full, now >= 0.0) {
                (true, true) => (now, 0.0),
                (true, false) => (0.0, f64::MIN_POSITIVE),
                (false, _) => (0.0, now.max(0.0)),
            };
            flips += usize::from(is_full != (*r <= 0.0));
        }
        flips
    }

    /// The operators of the film, and `A z − B r + q`.
    pub(super) fn residual(&self) -> Result<(Operators, Vec<f64>), FilmError> {
        let (operators, mut off) = posed(&self.film)?;
        let mut part = vec![0.0; off.len()];
        for (operator, v, sign) in [(&operators[0], &self.z, 1.0), (&operators[1], &self.r, -1.0)] {
            operator.apply(v, &mut part);
            off.iter_mut().zip(&part).for_each(|(off, part)| *off += sign * part);
        }
        Ok((operators, off))
    }

    /// As near to the solution as rounding allows.
    pub(super) fn exact(
        film: Film,
        start: &Self,
        settings: &Settings<'_>,
    ) -> Result<Self, FilmError> {
        let mut found = Self::to(EXACT, film, Some(start), settings)?;
        if !found.outcome.converged() {
            return Self::new(found.film, Some(start), settings);
        } else if found.outcome.iterations > 0 {
            return Ok(found);
        }
        // One step of Newton's method, whatever the residual: where the gap is narrow little flows,
        // and a residual says little of the pressure.
        let (operators, off) = found.residual()?;
        let [dz, dr] = Linear::of(&found.film, operators, &found.r, LINEAR)?.answer(&off)?;
        found.go(&dz, &dr);
        Self::judged(found.film, found.z, found.r, settings)
    }

    fn to(
        rounding: f64,
        film: Film,
        start: Option<&Self>,
        settings: &Settings<'_>,
    ) -> Result<Self, FilmError> {
        let (operators, q) = posed(&film)?;
        // A steady film; what a step begins with may be below 0 by rounding.
        let least = if film.step.is_none() { LEAST } else { f64::NEG_INFINITY };
        let asked = (METHOD, least, rounding);
        let begin = match start {
            Some(start) => Some(start.scaled(&film)),
            // Dry: in a ring the content that is left is settled by the loss alone, which is less
            // than what a solve leaves of the residual.
            None => (!film.is_fed()).then(|| [vec![0.0; q.len()], film.dry()]),
        };
        let (z, r, outcome) = solve(&operators, &q, begin, asked, settings)?;
        Ok(Self { film, z, r, outcome })
    }

    /// The same gap by the clamp of the tables, `z ≥ 0` without a balance of mass.
    fn clamped(&self, settings: &Settings<'_>) -> Result<Self, FilmError> {
        let (mut operators, q) = posed(&self.film)?;
        operators[1] = Box::new(Identity { order: q.len() });
        // Its r is no void fraction.
        let asked = (METHOD, f64::NEG_INFINITY, ROUNDING);
        let begin = Some(self.scaled(&self.film));
        let (z, r, outcome) = solve(&operators, &q, begin, asked, settings)?;
        Ok(Self { film: self.film.clone(), z, r, outcome })
    }

    /// `z` and `r` in the units of another film.
    pub(super) fn scaled(&self, film: &Film) -> [Vec<f64>; 2] {
        let by = self.film.pressure_unit() / film.pressure_unit();
        [self.z.iter().map(|z| z * by).collect(), self.r.clone()]
    }

    /// Proves the solution, with bounds on its errors, or says why it cannot.
    ///
    /// # Errors
    ///
    /// As [`certify`].
    pub fn certificate(&self) -> Result<Result<Certificate, Refusal>, hlcp_core::Error> {
        let (a, b, q) = self.film.pose()?;
        certify(&a, &b, &q, &self.z, &self.r)
    }

    /// Refuses a film in a step of time.
    pub(super) fn check_steady(&self) -> Result<(), FilmError> {
        if self.film.step.is_some() { Err(FilmError::Unsteady) } else { Ok(()) }
    }

    /// How the rows change while the gap grows by a mode, the film having this `r`.
    pub(super) fn widened(&self, mode: &[f64], r: &[f64]) -> Vec<f64> {
        let widening = FilmChange { gap: mode.to_vec(), ..FilmChange::default() };
        self.film.rows_change(&self.z, r, &widening)
    }

    /// The derivatives of the forces for a change of the position, and `with_speed` for its speed
    /// while it changes slowly, each a matrix with zeros in columns of coordinates that do not
    /// move.
    ///
    /// With `δz + δr` what a change brings about, `J (δz, δr) = −∂(A z − B r + q)/∂h`, the film
    /// of a wall that moves with speed `v` lags behind by what it stores, `∂t(θh)`: to first order
    /// in `v` it is the steady one and the answer of `J` to `−v ∂(θh)/∂e`. By the clamp, which
    /// knows no content, only the gap stores.
    pub(super) fn derivatives(
        &self,
        bearing: &Bearing,
        moving: &[usize],
        is_clamped: bool,
        with_speed: bool,
    ) -> Result<[Vec<Vec<f64>>; 2], FilmError> {
        let (film, count) = (&self.film, bearing.modes.len());
        let full = vec![0.0; self.r.len()];
        let r = if is_clamped { &full } else { &self.r };
        let mut found = [(); 2].map(|()| vec![vec![0.0; count]; count]);
        let (mut operators, _) = posed(film)?;
        if is_clamped {
            operators[1] = Box::new(Identity { order: self.r.len() });
        }
        let tolerance = if with_speed { LINEAR } else { SEARCH };
        let mut linear = Linear::of(film, operators, &self.r, tolerance)?;
        for &column in moving {
            let mode = &bearing.modes[column];
            let [z, mut emptied] = linear.answer(&self.widened(mode, r))?;
            let mut answers = vec![z];
            if with_speed {
                if is_clamped {
                    emptied.fill(0.0);
                }
                let [z, _] = linear.answer(&film.storing(r, mode, &emptied))?;
                answers.push(z);
            }
            for (matrix, z) in found.iter_mut().zip(&answers) {
                for (row, mode) in matrix.iter_mut().zip(&bearing.modes) {
                    row[column] = gained(film, z, mode);
                }
            }
        }
        Ok(found)
    }
}

/// The force along a mode that a change of `z` brings about.
pub(super) fn gained(film: &Film, z: &[f64], mode: &[f64]) -> f64 {
    film.pressure_unit() * film.cell() * z.iter().zip(mode).map(|(z, mode)| z * mode).sum::<f64>()
}

/// A and B, of any kind.
pub(super) type Operators = [Box<dyn Rows<f64>>; 2];

pub(super) type Problem<'p> = Hlcp<f64, &'p dyn Rows<f64>, &'p dyn Rows<f64>>;

/// Those of a film, and q.
pub(super) fn posed(film: &Film) -> Result<(Operators, Vec<f64>), Error> {
    let (a, b, q) = film.pose()?;
    Ok(([Box::new(a), Box::new(b)], q))
}

/// Signs of the modulus variable, which is negative where r is positive.
pub(super) fn modulus(r: &[f64]) -> Vec<f64> {
    r.iter().map(|r| if *r > 0.0 { -r } else { 0.0 }).collect()
}

pub(super) fn problem([a, b]: &Operators) -> Result<Problem<'_>, Error> {
    let (a, b) = (&**a, &**b);
    Hlcp::new(a, b, Omega::diagonal_ratio(1.0, a, b)?)
}

/// `z`, `r` and what became of the solve.
type Answer = (Vec<f64>, Vec<f64>, Outcome);

/// Rounding in a residual is some ε of its terms, and these are films of any units.
fn limits(rounding: f64) -> Limits {
    Limits { rounding: Some(rounding), ..Limits::relative(TOLERANCE) }
}

/// Solves from `begin` by a method of a name, and shows iterates to whoever watches.
fn iterate(
    (name, method): (&str, impl Method<f64>),
    q: &[f64],
    begin: Option<[&[f64]; 2]>,
    limits: Limits,
    settings: &Settings<'_>,
) -> Result<Answer, FilmError> {
    let goal = TOLERANCE * Norms::of(q).l2;
    let mut show = |progress: &Progress<'_, f64>| {
        let go_on = ControlFlow::Continue(());
        settings.watch.map_or(go_on, |watch| watch(name, &limits, goal, progress))
    };
    let options = begin.map_or_else(Options::default, |[z, r]| Options::from_solution(z, r));
    let mut solver = Solver::new(method);
    let outcome = solver.solve(q, options.limits(limits).observer(&mut show))?;
    Ok((solver.z().to_vec(), solver.r().to_vec(), outcome))
}

/// Solves from `begin`, by the method of the settings or else the `usual` one, and by another where
/// that does not converge or leaves a content `1 − r` below `least`; `rounding` is what it excuses
/// of the residual, in units of the rounding of its terms.
pub(super) fn solve(
    operators: &Operators,
    q: &[f64],
    begin: Option<[Vec<f64>; 2]>,
    (usual, least, rounding): (Attempt<'_>, f64, f64),
    settings: &Settings<'_>,
) -> Result<Answer, FilmError> {
    let problem = problem(operators)?;
    #[cfg(feature = "rayon")]
    let problem = if settings.in_parallel { problem.in_parallel() } else { problem };
    let limits = limits(rounding);
    let attempt = |(name, steps): Attempt<'_>| {
        let method = Named::parse(name, Parameters::default())?.on_dyn(problem.clone())?;
        let begin = begin.as_ref().map(|[z, r]| [&z[..], r]);
        let limits = Limits { iterations: limits.iterations.min(steps), ..limits };
        iterate((name, method), q, begin, limits, settings)
    };
    let found = attempt(settings.method.map_or(usual, |name| (name, usize::MAX)))?;
    let is_film =
        |(_, r, outcome): &Answer| outcome.converged() && r.iter().all(|r| 1.0 - r >= least);
    if is_film(&found) || settings.method.is_some() || rounding < ROUNDING {
        return Ok(found);
    }
    let other = attempt((FALLBACK, usize::MAX))?;
    Ok(if other.2.converged() || !found.2.converged() { other } else { found })
}

/// Stiffness `−∂F/∂e` and damping `−∂F/∂ė` for slow motions, in SI units, along the coordinates of
/// the position: of a journal along the load and a quarter further in the direction of the motion.
///
/// ```
/// use hlcp::film::{Bearing, Coefficients, Film, Settings, Solved};
///
/// let film = Film::new([50, 30], [0.05, 0.03], 3.0, 0.04).with_gap(|x, _| 4e-5 - 4e-4 * x);
/// let (pad, settings) = (Bearing::pad(film), Settings::default());
/// let solved = Solved::new(pad.here().expect("it is open"), None, &settings)?;
/// let found = Coefficients::new(&pad, &solved)?;
/// // Pressed together it carries more.
/// assert!(found.stiffness[0][0] > 0.0 && found.damping[0][0] > 0.0);
/// # Ok::<(), hlcp::film::FilmError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficients {
    /// The change of force `k` by coordinate `l` in `stiffness[k][l]`.
    pub stiffness: Vec<Vec<f64>>,
    /// The same for the speed of the coordinate.
    pub damping: Vec<Vec<f64>>,
}

impl Coefficients {
    /// Computes those of a solved film.
    ///
    /// # Errors
    ///
    /// [`FilmError::Derivatives`] for linear systems that are not solved, and
    /// [`FilmError::Unsteady`] for a film in a step of time.
    pub fn new(bearing: &Bearing, solved: &Solved) -> Result<Self, FilmError> {
        Self::of(bearing, solved, solved, false)
    }

    /// Computes those by the clamp of published tables, `z ≥ 0` without a balance of mass, along
    /// the load of the solved film and across it.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), and [`FilmError::Clamp`] for a film by the clamp that is not found.
    pub fn clamped(
        bearing: &Bearing,
        solved: &Solved,
        settings: &Settings<'_>,
    ) -> Result<Self, FilmError> {
        let clamped = solved.clamped(settings)?;
        if !clamped.outcome.converged() {
            return Err(FilmError::Clamp(Box::new(clamped.outcome)));
        }
        Self::of(bearing, solved, &clamped, true)
    }

    /// Those of `found`, along the load of `solved` and across it.
    fn of(
        bearing: &Bearing,
        solved: &Solved,
        found: &Solved,
        is_clamped: bool,
    ) -> Result<Self, FilmError> {
        solved.check_steady()?;
        let all: Vec<usize> = (0..bearing.modes.len()).collect();
        let [stiffness, damping] = found
            .derivatives(bearing, &all, is_clamped, true)?
            .map(|matrix| bearing.against_load(solved, matrix));
        Ok(Self { stiffness, damping })
    }
}

impl Bearing {
    /// Returns a matrix of `∂F/∂e` with the other sign: of a journal along the load of a solved
    /// film and across it.
    pub(super) fn against_load(&self, solved: &Solved, matrix: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        if self.journal.is_none() {
            return matrix.iter().map(|row| row.iter().map(|v| -v).collect()).collect();
        }
        let forces = self.forces(&solved.film, &solved.z);
        let (sin, cos) = forces[1].atan2(forces[0]).sin_cos();
        let sign = self.direction();
        let axes = [[cos, sin], [-sign * sin, sign * cos]];
        let entry = |one: [f64; 2], other: [f64; 2]| {
            let terms = [(0, 0), (0, 1), (1, 0), (1, 1)];
            -terms.map(|(k, l)| one[k] * matrix[k][l] * other[l]).iter().sum::<f64>()
        };
        axes.iter().map(|&one| axes.iter().map(|&other| entry(one, other)).collect()).collect()
    }
}
