//! What accuracy costs by methods of your own: the measurements that `hlcp speed-vs-accuracy --add`
//! draws beside those of the library.

use hlcp_methods::{Error, Limits, Method, Options, Scalar, Solver, Tolerance};

/// The tolerances of `hlcp speed-vs-accuracy`, relative to ‖q‖.
pub const TOLERANCES: [f64; 9] = [1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14];

/// The columns of a file of measurements.
#[rustfmt::skip] // a list
pub const COLUMNS: [&str; 9] = [
    "problem", "series", "tolerance", "true error", "seconds min", "seconds median", "seconds max",
    "half-steps", "reached",
];

/// The solves of a problem by a method to one tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// The name of the method.
    pub series: String,
    /// The tolerance, relative to ‖q‖.
    pub tolerance: f64,
    /// The largest error of a component of (z, r).
    pub error: f64,
    /// The seconds of the fastest solve, of the median and of the slowest.
    pub seconds: [f64; 3],
    /// The half-steps of a solve, of a method that has some.
    pub half_steps: Option<usize>,
    /// Whether the residual reached the tolerance.
    pub reached: bool,
}

impl Rung {
    /// Returns the row of a file with [`COLUMNS`] for a problem, which must have no quotes in its
    /// name.
    pub fn row(&self, problem: &str) -> String {
        let Self { series, tolerance, error, seconds: [least, median, most], .. } = self;
        let half_steps = self.half_steps.map_or(String::new(), |half_steps| half_steps.to_string());
        let reached = self.reached;
        format!(
            "\"{problem}\",\"{series}\",{tolerance:e},{error:e},{least:.6},{median:.6},{most:.6},\
             {half_steps},{reached}"
        )
    }
}

/// Solves a problem by each of some methods down [`TOLERANCES`], until it misses one, and compares
/// with the solution `[z, r]`.
///
/// To each tolerance the methods take turns, `repeats` times, from the modulus variable `start`. A
/// solve ends by `limits` too, but for their tolerance; the set-up of a method is not measured. The
/// error, the half-steps and whether the tolerance was reached are those of the last repeat. A
/// solve that diverges beyond all numbers has no rung.
///
/// # Errors
///
/// What [`Solver::solve`] refuses; [`Error::Order`] unless `z` and `r` have the order of `q`.
///
/// ```
/// use hlcp::ladder::{COLUMNS, ladder};
/// use hlcp::{Aor, Hlcp, Limits, Mms, Omega, Solver};
/// use hlcp_verify::Disc;
///
/// let scene = Disc { lcp: false, m: 24 }.pose::<f64>()?;
/// let omega = Omega::diagonal_ratio(1.0, &scene.a, &scene.b)?;
/// let mut methods = vec![];
/// for alpha in [1.0, 1.4] {
///     let problem = Hlcp::new(&scene.a, &scene.b, omega.clone())?;
///     let mine = Mms::new(problem, Aor::sor(alpha)?.accelerated())?;
///     methods.push((format!("mine, {alpha}"), Solver::new(mine)));
/// }
/// let start = vec![1.0; scene.q.len()];
/// let truth = [&scene.z[..], &scene.r[..]];
/// let rungs = ladder(&mut methods, &scene.q, &start, truth, Limits::default(), 3)?;
/// assert!(rungs.iter().any(|rung| rung.reached && rung.error < 1e-6));
/// let mut file = COLUMNS.join(",");
/// rungs.iter().for_each(|rung| file += &format!("\n{}", rung.row("disc-hlcp, m = 24")));
/// // hlcp speed-vs-accuracy --quick --add file.csv
/// # Ok::<(), hlcp::Error>(())
/// ```
pub fn ladder<T: Scalar, M: Method<T>>(
    methods: &mut [(String, Solver<T, M>)],
    q: &[T],
    start: &[T],
    truth: [&[T]; 2],
    limits: Limits,
    repeats: usize,
) -> Result<Vec<Rung>, Error> {
    for (what, v) in ["the solution's z", "the solution's r"].into_iter().zip(truth) {
        if v.len() != q.len() {
            return Err(Error::Order { what, found: v.len(), expected: q.len() });
        }
    }
    let (mut rungs, mut is_left) = (vec![], vec![true; methods.len()]);
    for tolerance in TOLERANCES {
        let limits = Limits { tolerance: Tolerance::Relative(tolerance), ..limits };
        let mut outcomes: Vec<Vec<_>> = methods.iter().map(|_| vec![]).collect();
        for _ in 0..repeats.max(1) {
            for (k, (_, solver)) in methods.iter_mut().enumerate().filter(|(k, _)| is_left[*k]) {
                outcomes[k].push(solver.solve(q, Options::from_x(start).limits(limits))?);
            }
        }
        for (k, outcomes) in outcomes.iter().enumerate() {
            // The solver holds the answer of the last.
            let Some(last) = outcomes.last() else { continue };
            let (series, solver) = &methods[k];
            let pairs = [solver.z(), solver.r()].into_iter().zip(truth);
            let differences = pairs.flat_map(|(found, known)| found.iter().zip(known));
            let errors = differences.map(|(found, known)| (found.wide() - known.wide()).abs());
            // The largest, or NaN where there is one.
            let error = errors.fold(0.0, |most, e| if e > most || e.is_nan() { e } else { most });
            let mut seconds: Vec<_> =
                outcomes.iter().map(|outcome| outcome.elapsed.as_secs_f64()).collect();
            seconds.sort_by(f64::total_cmp);
            is_left[k] = last.converged();
            if !error.is_finite() {
                continue;
            }
            rungs.push(Rung {
                series: series.clone(),
                tolerance,
                error,
                seconds: [0, 1, 2].map(|k| seconds[k * (seconds.len() - 1) / 2]),
                half_steps: Some(last.sweeps),
                reached: is_left[k],
            });
        }
    }
    Ok(rungs)
}
