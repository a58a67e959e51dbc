//! `hlcp solve`: a scene, or a problem from files, by any method.

mod arguments;
mod report;

use std::{borrow::Cow, ops::ControlFlow, path::Path, sync::Arc, time::Instant};

pub(crate) use arguments::Arguments;
use arguments::Precision;
use hlcp::market;
#[cfg(feature = "mpi")]
use hlcp_core::World;
use hlcp_core::{Hlcp, Omega, Ranks, Scalar, Strip};
use hlcp_methods::{Clock, NameError, Named, Progress, Solver};
use hlcp_verify::{certify_by, certify_within};
use report::Answer;

use crate::{
    Fallible, memory, on_threads, print,
    progress::Way,
    say,
    scenes::{Boxed, Given, Posable, Pose, Problem, Watch, distance, goal},
};

/// Solves what was asked for with the other processes that `mpirun` has started, of which the first
/// prints.
#[cfg(feature = "mpi")]
pub(crate) fn run(arguments: &Arguments) -> Fallible<bool> {
    let world = World::join()?;
    let ranks = world.ranks();
    if ranks.size() == 1 {
        return run_on(arguments, None);
    }
    run_on(arguments, Some(&ranks)).or_else(|error| {
        // The others may have had no error, and wait; or have the same, which the first says.
        let wait = if ranks.rank() == 0 { 0 } else { 800 };
        std::thread::sleep(std::time::Duration::from_millis(wait));
        say(format!("error: {error}"));
        world.end_all(1)
    })
}

#[cfg(not(feature = "mpi"))]
pub(crate) fn run(arguments: &Arguments) -> Fallible<bool> {
    run_on(arguments, None)
}

/// Solves what was asked for, on as many threads as were asked for, and prints it; whether all of
/// it converged.
fn run_on(arguments: &Arguments, ranks: Option<&Arc<dyn Ranks>>) -> Fallible<bool> {
    on_threads(arguments.threads, || solve(arguments, ranks))
}

/// The problem that is solved, how often, and what became of it so far.
struct Run<'r> {
    arguments: &'r Arguments,
    name: &'r str,
    methods: Vec<Named>,
    /// True until the table has its head.
    is_headless: bool,
    all_converged: bool,
    strip: Option<Strip>,
}

fn solve(arguments: &Arguments, ranks: Option<&Arc<dyn Ranks>>) -> Fallible<bool> {
    if ranks.is_none_or(|ranks| ranks.rank() == 0) {
        arguments.check()?;
    }
    let parse = |name: &str| Named::parse(name.trim(), arguments.parameters()).map_err(in_options);
    let methods: Vec<_> = match &arguments.method[..] {
        [] => ["MGS", "AMGS", "TMGS"].into_iter().map(parse).collect::<Result<_, _>>()?,
        names => names.iter().map(|name| parse(name)).collect::<Result<_, _>>()?,
    };
    let scene = arguments.given.scene;
    if let (Some([nx, ny]), None, None) =
        ((scene.grid)(&arguments.given.numbers), &arguments.files.a, ranks)
    {
        // About what is measured.
        let bytes = |method: &Named| match &method.to_string()[..] {
            "AMG" => 500,
            "ANDERSON" => 200,
            "NEWTON" => 120,
            _ => 60,
        };
        let each = methods.iter().map(bytes).max().unwrap_or_default();
        let single = arguments.precisions().iter().all(|&precision| precision == Precision::F32);
        let each = if single { each / 2 } else { each };
        memory::check(nx.saturating_mul(ny), each, "take a smaller grid by --m, or --nx and --ny")?;
    }
    let name = if arguments.files.a.is_some() { "file" } else { scene.name };
    let strip = ranks.map(|ranks| strip(arguments, ranks)).transpose()?;
    let mut run = Run { arguments, name, methods, is_headless: true, all_converged: true, strip };
    for precision in arguments.precisions() {
        match precision {
            Precision::F64 => run.solve(precision, &run.problem(scene.wide)?)?,
            Precision::F32 => run.solve(precision, &run.problem(scene.narrow)?)?,
        }
    }
    Ok(run.all_converged)
}

/// The strip of a rank in the scene's grid.
fn strip(arguments: &Arguments, ranks: &Arc<dyn Ranks>) -> Fallible<Strip> {
    let Given { scene, numbers, .. } = &arguments.given;
    let refused = |what: &str| Err(format!("{what} works on one process; leave mpirun out").into());
    match (scene.grid)(numbers) {
        _ if arguments.files.a.is_some() => refused("a problem from files"),
        _ if arguments.certify => refused("--certify"),
        // Its operators are posed for the whole grid.
        _ if scene.name == "film" => refused("film"),
        Some(grid) => Ok(Strip::new(ranks.clone(), grid)?),
        None => refused(scene.name),
    }
}

/// The error in the words of the command line.
fn in_options(error: NameError) -> String {
    match error {
        NameError::Missing { name, parameter, advice } => {
            format!("{name} needs --{parameter}: {advice}")
        }
        NameError::Fixed { name, parameter, value, instead } => {
            format!("{name} takes no --{parameter} (given: {value}); use {instead}")
        }
        other => other.to_string(),
    }
}

impl Run<'_> {
    /// Reads the files, or poses the scene.
    fn problem<T: Scalar>(&self, pose: Pose<T>) -> Fallible<Problem<T>> {
        let Arguments { files, given, .. } = self.arguments;
        files.read_or(|| match &self.strip {
            Some(strip) => strip.agree(pose(&given.numbers.of_columns(strip.columns()))),
            None => pose(&given.numbers),
        })
    }

    /// What is proved of the solver's answer: of the problem in double precision, which may differ
    /// from that in single precision by more than the answer's error, unless later problems of a
    /// sequence depend on answers.
    fn certified<T: Scalar>(
        &self,
        given: &Problem<T>,
        q: &[T],
        solver: &mut Solver<T, Boxed<'_, T>>,
        clock: &mut Clock<'_>,
    ) -> Fallible<report::Proved> {
        let [z, r] = [solver.z().to_vec(), solver.r().to_vec()];
        if given.march.0 > 1 || size_of::<T>() == size_of::<f64>() {
            let found = certify_by(solver.method_mut(), q, &z, &r, clock)?;
            return Ok(report::Proved::new(given, found, clock)?);
        }
        let exact = self.problem(self.arguments.given.scene.wide)?;
        let [z, r] = [z, r].map(|v| v.iter().map(|v| v.wide()).collect::<Vec<f64>>());
        let found = certify_within(&exact.a, &exact.b, &exact.q, &z, &r, clock)?;
        Ok(report::Proved::new(&exact, found, clock)?)
    }

    /// The problem with what the options say of it, and the start.
    fn posed<'p, T: Scalar>(&self, given: &'p Problem<T>) -> Fallible<(Posable<'p, T>, Vec<T>)> {
        let arguments = self.arguments;
        let posed = match arguments.omega {
            Some(omega) => Hlcp::new(&*given.a, &*given.b, Omega::Uniform(T::of(omega))),
            None => given.hlcp(T::of(arguments.tau)),
        };
        let posed = posed.map_err(|error| arguments.files.explained(error))?;
        let mut problem = posed.with_gamma(T::of(arguments.gamma))?;
        if let Some(strip) = &self.strip {
            problem = problem.shared_by(strip)?;
        }
        let mut x0 = match &arguments.x0 {
            Some(path) => self.read_part(path, given)?,
            None => vec![T::one(); given.q.len()],
        };
        if let (Some(z), Some(r)) = (&arguments.z0, &arguments.r0) {
            let [z, r] = [self.read_part(z, given)?, self.read_part(r, given)?];
            problem.x_from_solution(&z, &r, &mut x0);
        }
        if arguments.threads > 1 {
            problem = problem.in_parallel();
        }
        Ok((problem, x0))
    }

    /// Whether this is the only process, or the one that prints.
    fn is_first(&self) -> bool {
        self.strip.as_ref().is_none_or(|strip| strip.rank() == 0)
    }

    fn order<T>(&self, given: &Problem<T>) -> usize {
        self.strip.as_ref().map_or(given.q.len(), |strip| strip.whole().iter().product())
    }

    /// Reads a vector of the whole problem's order, of which this process may keep its part.
    fn read_part<T: Scalar>(&self, path: &Path, given: &Problem<T>) -> Fallible<Vec<T>> {
        let whole = market::read_vector(path, self.order(given))?;
        Ok(match &self.strip {
            Some(strip) => strip.vector(|i, j| whole[j * strip.whole()[0] + i]),
            None => whole,
        })
    }

    /// The z and r that are reported, on the process that reports them: of ranks the whole vectors
    /// where they are written or have figures.
    fn gathered<'s, T: Scalar>(
        &self,
        given: &Problem<T>,
        solver: &'s Solver<T, Boxed<'_, T>>,
    ) -> Option<[Cow<'s, [T]>; 2]> {
        let own = [solver.z(), solver.r()].map(Cow::Borrowed);
        let Some(strip) = &self.strip else { return Some(own) };
        let written = self.arguments.out_z.is_some() || self.arguments.out_r.is_some();
        if !written && given.known.is_some() {
            return self.is_first().then_some(own);
        }
        let [z, r] = own.map(|vector| strip.gather(&vector).map(Cow::Owned));
        Some([z?, r?])
    }

    fn solve<T: Scalar>(&mut self, precision: Precision, given: &Problem<T>) -> Fallible<()> {
        let arguments = self.arguments;
        let limits = arguments.limits()?;
        let (problem, mut x0) = self.posed(given)?;
        let mut alone = arguments.threads > 1 && self.is_first() && !problem.has_shared_sweeps();
        let on = |method: &Named| {
            method.on_dyn(problem.clone()).map_err(|error| arguments.files.explained(error))
        };
        // None is refused after another has taken its time.
        for method in self.methods.iter().skip(1) {
            on(method)?;
        }
        for method in &self.methods {
            if arguments.files.a.is_some() && arguments.x0.is_none() && arguments.z0.is_none() {
                // The paper begins with ones; from 0 a file in other units takes the same steps.
                x0.fill(if method.first().is_some() { T::one() } else { T::zero() });
            }
            let mut solver = Solver::new(on(method)?);
            if std::mem::take(&mut alone) {
                say("note: --threads does not speed up the sweeps of this problem, which are \
                     shared on grids of 16384 points or more");
            }
            let (mut solves, mut q) = (vec![], Cow::Borrowed(&given.q[..]));
            for _ in 0..arguments.repeats {
                let mut way = Way::new(&method.to_string(), goal(&limits, &given.q), &limits);
                let mut show = |progress: &Progress<'_, T>| {
                    way.show(progress);
                    ControlFlow::Continue(())
                };
                let watch = self.is_first().then_some(&mut show as &mut Watch<'_, T>);
                let (outcome, last) = given.march(&mut solver, (&x0, true), &limits, watch)?;
                solves.push(outcome);
                q = last;
            }
            solves.sort_by_key(|outcome| outcome.elapsed);
            let outcome = &solves[solves.len() / 2];
            self.all_converged &= outcome.converged();
            let found = [solver.z(), solver.r()];
            let error = given.known.as_ref().map(|known| distance(found, known));
            let error = error.map(|error| problem.largest([error])[0]);
            // Proofs have what the solve has left of its time.
            let left = limits.time.map(|time| time.saturating_sub(outcome.elapsed));
            let begun = Instant::now();
            let mut is_late = || left.is_some_and(|left| begun.elapsed() >= left);
            let clock = &mut Clock::new(&mut is_late);
            let proved = || self.certified(given, &q, &mut solver, clock);
            let certificate = arguments.certify.then(proved).transpose()?;
            let Some([z, r]) = self.gathered(given, &solver) else { continue };
            let figures = (given.figures)(&z, &r);
            // Before anything is printed, because a reader that goes away ends the program.
            let outputs = [(&arguments.out_z, &z), (&arguments.out_r, &r)];
            let outputs: Vec<_> = outputs
                .iter()
                .filter_map(|(path, vector)| Some((path.as_deref()?, &vector[..])))
                .collect();
            market::write_vectors(&outputs)?;
            let answer = Answer { method, precision, outcome, error, figures, certificate };
            if arguments.json {
                print::line(report::object(self, given, &answer))?;
                continue;
            }
            if std::mem::take(&mut self.is_headless) {
                report::head(self, self.order(given))?;
            }
            let proof = arguments.certify.then(|| report::convergence(method, &problem, clock));
            report::words(given, &answer, proof.transpose()?)?;
        }
        Ok(())
    }
}
