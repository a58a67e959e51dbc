//! A scene on one grid with what judges an answer, and its solves by one method.

use std::{
    error::Error,
    time::{Duration, Instant},
};

use hlcp_methods::{Limits, Named, Options, Parameters, Status};
use hlcp_verify::{Certificate, certify};

use crate::scenes::{Ladder, Problem, Scene, distance, goal, where_it_applies};

/// The paper's methods with Gauss–Seidel, then what goes beyond it.
pub(crate) const METHODS: [&str; 10] =
    ["MGS", "AMGS", "TMGS", "AMSOR", "ANDERSON", "NEWTON", "MGW", "MGF", "FMG", "AUTO"];

/// What became of the solves by one method on one problem.
pub(crate) struct Run {
    pub(crate) status: Status,
    pub(crate) iterations: usize,
    pub(crate) sweeps: usize,
    /// In increasing order.
    pub(crate) seconds: Vec<f64>,
    /// The largest error of a component of (z, r).
    pub(crate) error: f64,
    /// What is proved of it: of the answer, and of what it is compared with.
    pub(crate) bound: Option<f64>,
}

impl Run {
    pub(crate) fn converged(&self) -> bool {
        self.status == Status::Converged
    }

    /// The median.
    pub(crate) fn seconds(&self) -> f64 {
        self.seconds[self.seconds.len() / 2]
    }
}

/// The LCPs or HLCPs of a scene on one grid, solved one after another, with the solution of the
/// last.
pub(crate) struct Reference {
    pub(crate) ladder: &'static Ladder,
    pub(crate) given: Problem<f64>,
    /// Each made from the reference's `z` of the one before: the same for all methods.
    qs: Vec<Vec<f64>>,
    /// z* and r* of the last problem: planted, or solved to the floor of rounding.
    truth: [Vec<f64>; 2],
    /// How near that is to the solution, where there is time to prove it: a planted pair solves a
    /// rounded `q` only nearly.
    certificate: Option<Certificate>,
    limits: Limits,
    /// The best known α and τ of AMSOR.
    amsor: [f64; 2],
}

/// The largest order that answers are certified for.
const CERTIFIED: usize = 70_000;

/// Iterations that take any of the unplanted scenes to its floor.
const TO_THE_FLOOR: usize = 60;

impl Reference {
    /// The scene for the size `m`.
    pub(crate) fn new(
        scene: &Scene,
        ladder: &'static Ladder,
        m: usize,
    ) -> Result<Self, Box<dyn Error>> {
        let given = scene.pose(&(ladder.numbers)(m as f64))?;
        let limits = scene.limits();
        let (qs, truth) = match &given.known {
            Some(known) => (vec![given.q.clone()], known.clone()),
            None => to_the_floor(&given, &limits)?,
        };
        let certificate = if given.q.len() <= CERTIFIED {
            certify(&given.a, &given.b, &qs[qs.len() - 1], &truth[0], &truth[1])?.ok()
        } else {
            None
        };
        let amsor = (ladder.amsor)(m as f64);
        Ok(Self { ladder, given, qs, truth, certificate, limits, amsor })
    }

    /// Solves the problem again and again, at least `repeats` times and, if that is more than once,
    /// for a twentieth of a second, each solve for no longer than `longest`; nothing where the
    /// method does not take such operators.
    pub(crate) fn solve(
        &self,
        method: &str,
        repeats: usize,
        longest: Duration,
    ) -> Result<Option<Run>, Box<dyn Error>> {
        let Self { given, qs, truth, .. } = self;
        let (alpha, tau) = match (method, self.amsor) {
            ("AMSOR", [alpha, tau]) => (Some(alpha), tau),
            _ => (None, 1.0),
        };
        let method = Named::parse(method, Parameters { alpha, ..Parameters::default() })?;
        let mut seconds: Vec<f64> = vec![];
        loop {
            let begin = Instant::now();
            let solver = where_it_applies(given.solved_by(&method, tau))?;
            let Some(mut solver) = solver else { return Ok(None) };
            let mut x = given.start();
            let (mut status, mut iterations, mut sweeps) = (Status::Converged, 0, 0);
            for q in qs {
                let time = Some(longest.saturating_sub(begin.elapsed()));
                let limits = Limits { iterations: usize::MAX, time, ..self.limits };
                let outcome = solver.solve(q, Options::from_x(&x).limits(limits))?;
                status = outcome.status;
                iterations += outcome.iterations;
                sweeps += outcome.sweeps;
                if !outcome.converged() {
                    break;
                }
                x.copy_from_slice(solver.x());
            }
            seconds.push(begin.elapsed().as_secs_f64());
            let converged = status == Status::Converged;
            let short = repeats > 1 && seconds.iter().sum::<f64>() < 0.05;
            if converged && (seconds.len() < repeats || short) {
                continue;
            }
            seconds.sort_by(f64::total_cmp);
            let (z, r) = (solver.z(), solver.r());
            let bound = match &self.certificate {
                Some(known) if converged => {
                    let found = certify(&given.a, &given.b, &qs[qs.len() - 1], z, r)?;
                    Some(found.map_err(|refusal| refusal.to_string())?.error() + known.error())
                }
                _ => None,
            };
            let error = distance([z, r], truth);
            return Ok(Some(Run { status, iterations, sweeps, seconds, error, bound }));
        }
    }
}

/// Every `q`, and `z` and `r` of the last.
type Floor = (Vec<Vec<f64>>, [Vec<f64>; 2]);

/// The solutions of the problems one after another, at the floor of rounding.
fn to_the_floor(given: &Problem<f64>, wanted: &Limits) -> Result<Floor, Box<dyn Error>> {
    let name = if given.is_tridiagonal() { "NEWTON" } else { "MGW" };
    let mut solver = given.solver(name, Parameters::default(), 1.0)?;
    // To a tolerance of 0, which need not be met.
    let limits = Limits { iterations: TO_THE_FLOOR, ..Limits::absolute(0.0) };
    let (lcps, next) = &given.march;
    let (mut x, mut qs) = (given.start(), vec![given.q.clone(); *lcps]);
    for (k, q) in qs.iter_mut().enumerate() {
        if k > 0 {
            next(k, solver.z(), q);
        }
        let outcome = solver.solve(q, Options::from_x(&x).limits(limits))?;
        if outcome.residual.l2 > 0.5 * goal(wanted, q) {
            return Err(format!("no reference: {outcome}").into());
        }
        x.copy_from_slice(solver.x());
    }
    let truth = [solver.z().to_vec(), solver.r().to_vec()];
    Ok((qs, truth))
}
