//! The compiled half of the Python package `hlcp`: operators on NumPy's arrays, one solve, one
//! certificate, the scenes. What a user calls, and how it is documented, is in `hlcp/`.

mod film;

use std::{
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

use hlcp::{
    Anderson, BoxedMethod, Branch, Clock, Coefficients, Csr, Error, FivePoint, Hlcp, Identity,
    Index, Limits, LinearOperator, Method, Mms, Named, Norm, Norms, Omega, Options, Outcome,
    Parameters, Progress, Rows, Scalar, Solver, Splitting, SplittingStep, Tmms, Tolerance,
    Uniqueness, certify_within,
};
use hlcp_verify::{
    AmericanPut, Bearing2d, Dam, Disc, Example, JournalBearing, Membrane, Obstacle, Posed, Slider,
    uniqueness_within,
};
use numpy::{Element, PyArray1, PyReadonlyArray1};
use pyo3::{
    conversion::FromPyObjectOwned,
    exceptions::{PyMemoryError, PyRuntimeError, PyValueError},
    prelude::*,
};
use rayon::ThreadPoolBuilder;

/// How often a solve looks for signals, as that of Ctrl-C.
const BEAT: Duration = Duration::from_millis(20);

/// A precision that both sides have.
trait Real: Scalar + Element + for<'py> FromPyObjectOwned<'py> {}

impl Real for f32 {}
impl Real for f64 {}

/// The first exception that Python code has raised in the course of a solve, which ends it; and
/// whether it is to end.
#[derive(Default)]
struct Failure {
    first: OnceLock<PyErr>,
    stop: Arc<AtomicBool>,
}

impl Failure {
    fn note(&self, error: PyErr) {
        self.stop.store(true, Ordering::Relaxed);
        self.first.get_or_init(|| error);
    }

    fn ends(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn raised(self) -> PyResult<()> {
        self.first.into_inner().map_or(Ok(()), Err)
    }
}

/// Wrong input is `ValueError`, with the crate's sentence.
fn wrong(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Refuses to begin what needs `numbers` numbers, where Rust's own answer would be to abort.
fn room(numbers: Option<usize>) -> PyResult<()> {
    let fits = |n: usize| n.checked_mul(8).is_some_and(|n| Vec::<u8>::new().try_reserve(n).is_ok());
    if numbers.is_some_and(fits) {
        Ok(())
    } else {
        Err(PyMemoryError::new_err("there is no memory for so many unknowns"))
    }
}

// Operators.

type Array<'py, T> = PyReadonlyArray1<'py, T>;

/// An operator as `hlcp/_operators.py` describes it.
#[derive(FromPyObject)]
enum Given<'py, T: Element> {
    /// The order of an identity.
    #[pyo3(transparent)]
    Identity(usize),
    /// Columns, index pointers, indices and entries of a canonical CSR matrix.
    Csr(usize, Array<'py, i32>, Array<'py, i32>, Array<'py, T>),
    LongCsr(usize, Array<'py, i64>, Array<'py, i64>, Array<'py, T>),
    /// `(ny, nx)`; south, west, centre, east, north; and whether the grid closes along y and x.
    FivePoint([usize; 2], [Numbers<'py, T>; 5], [bool; 2]),
    /// Rows, columns and a function that multiplies.
    Products(usize, usize, Py<PyAny>),
}

/// One number, or one for each point.
#[derive(FromPyObject)]
enum Numbers<'py, T: Element> {
    #[pyo3(transparent)]
    Each(Array<'py, T>),
    #[pyo3(transparent)]
    Constant(f64),
}

/// An operator on borrowed arrays, with rows or with products alone.
enum Operator<'a, T> {
    Rows(Box<dyn Rows<T> + 'a>),
    Products(Products<'a>),
}

impl<T: Real> Given<'_, T> {
    fn operator<'a>(
        &'a self,
        what: &'static str,
        failure: &'a Failure,
    ) -> PyResult<Operator<'a, T>> {
        Ok(Operator::Rows(match self {
            Self::Identity(order) => Box::new(Identity { order: *order }),
            Self::Csr(columns, pointers, indices, entries) => {
                Box::new(csr(what, *columns, [pointers, indices], entries)?)
            }
            Self::LongCsr(columns, pointers, indices, entries) => {
                Box::new(csr(what, *columns, [pointers, indices], entries)?)
            }
            Self::FivePoint([ny, nx], coefficients, [along_y, along_x]) => {
                let mut views = [Coefficients::Uniform(T::zero()); 5];
                for (view, coefficient) in views.iter_mut().zip(coefficients) {
                    *view = match coefficient {
                        Numbers::Each(each) => Coefficients::Each(each.as_slice()?),
                        Numbers::Constant(value) => Coefficients::Uniform(T::of(*value)),
                    };
                }
                let open = FivePoint::new(*nx, *ny, views);
                let closed = open.and_then(|open| open.periodic([*along_x, *along_y]));
                Box::new(closed.map_err(|error| wrong(format!("{what}: {error}")))?)
            }
            Self::Products(rows, columns, call) => {
                let shape = [*rows, *columns];
                return Ok(Operator::Products(Products { shape, call, failure }));
            }
        }))
    }
}

fn csr<'a, T: Real, I: Index + Element>(
    what: &'static str,
    columns: usize,
    [pointers, indices]: [&'a Array<'_, I>; 2],
    entries: &'a Array<'_, T>,
) -> PyResult<Csr<'a, T>> {
    let rows = pointers.as_array().len().saturating_sub(1);
    if rows != columns {
        return Err(wrong(Error::NotSquare { what, rows, columns }));
    }
    let matrix = Csr::new(pointers.as_slice()?, indices.as_slice()?, entries.as_slice()?);
    matrix.map_err(|error| wrong(format!("{what}: {error}")))
}

impl<T: Real> Operator<'_, T> {
    fn rows(&self, what: &str) -> PyResult<&dyn Rows<T>> {
        match self {
            Self::Rows(rows) => Ok(&**rows),
            Self::Products(_) => Err(wrong(format!(
                "{what} is known by its products alone, but this needs its rows; give a sparse \
                 matrix or a FivePoint, or to solve a splitting and omega"
            ))),
        }
    }

    fn products(&self) -> &dyn LinearOperator<T> {
        match self {
            Self::Rows(rows) => &**rows,
            Self::Products(products) => products,
        }
    }
}

/// A function of Python's that maps a vector to a vector: a product, or the solve of a splitting.
struct Products<'a> {
    shape: [usize; 2],
    call: &'a Py<PyAny>,
    failure: &'a Failure,
}

impl Products<'_> {
    /// Overwrites `y` with what Python makes of `x`, and with NaN if that raises, or something has
    /// before: NaN ends the iteration.
    fn call<T: Real>(&self, x: &[T], y: &mut [T]) {
        let called = !self.failure.ends()
            && Python::attach(|py| {
                let answer = self.call.bind(py).call1((PyArray1::from_slice(py, x),))?;
                let answer: Array<'_, T> = answer.extract()?;
                y.copy_from_slice(answer.as_slice()?);
                Ok(())
            })
            .map_err(|error| self.failure.note(error))
            .is_ok();
        if !called {
            y.fill(T::nan());
        }
    }
}

impl<T: Real> LinearOperator<T> for Products<'_> {
    fn order(&self) -> usize {
        self.shape[0]
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.call(x, y);
    }

    fn check(&self, what: &'static str) -> Result<(), Error> {
        let [rows, columns] = self.shape;
        if rows == columns { Ok(()) } else { Err(Error::NotSquare { what, rows, columns }) }
    }
}

impl<T: Real> Splitting<T> for Products<'_> {
    fn solve(&self, rhs: &[T], y: &mut [T]) {
        self.call(rhs, y);
    }
}

// Solving.

/// What `hlcp.solve` was told, apart from the problem.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Settings {
    method: String,
    alpha: Option<f64>,
    beta: Option<f64>,
    alpha2: Option<f64>,
    beta2: Option<f64>,
    base: Option<String>,
    window: Option<usize>,
    /// One for MMS, two for TMMS.
    splittings: Vec<Py<PyAny>>,
    tau: f64,
    rtol: Option<f64>,
    atol: Option<f64>,
    linf: bool,
    maxiter: usize,
    maxtime: Option<f64>,
    rounding: Option<f64>,
    threads: usize,
    callback: Option<Py<PyAny>>,
}

impl Settings {
    fn limits(&self) -> PyResult<Limits> {
        let tolerance = match (self.rtol, self.atol) {
            (Some(rtol), None) => Tolerance::Relative(rtol),
            (None, Some(atol)) => Tolerance::Absolute(atol),
            (None, None) => Limits::default().tolerance,
            _ => return Err(wrong("give rtol or atol, not both")),
        };
        Ok(Limits {
            tolerance,
            norm: if self.linf { Norm::LInf } else { Norm::L2 },
            iterations: self.maxiter,
            rounding: self.rounding,
            time: duration(self.maxtime)?,
        })
    }

    fn named(&self) -> PyResult<Named> {
        let Self { alpha, beta, alpha2, beta2, window, .. } = *self;
        let base = self.base.as_deref();
        Named::parse(&self.method, Parameters { alpha, beta, alpha2, beta2, base, window })
            .map_err(wrong)
    }
}

/// The time that `maxtime` allows.
fn duration(maxtime: Option<f64>) -> PyResult<Option<Duration>> {
    let seconds = |value| {
        Duration::try_from_secs_f64(value)
            .map_err(|_| wrong(format!("maxtime is {value}, but it must be seconds, not negative")))
    };
    maxtime.map(seconds).transpose()
}

/// One solve, on borrowed arrays.
struct Job<'j, T> {
    a: Operator<'j, T>,
    b: Operator<'j, T>,
    q: &'j [T],
    /// x, z and r, as far as they are given.
    start: [Option<&'j [T]>; 3],
    omega: Option<Omega<T>>,
    settings: &'j Settings,
    limits: Limits,
    failure: &'j Failure,
}

/// What a solve hands back: z, r and x, and what became of it.
type Answer<T> = ([Vec<T>; 3], Outcome);

impl<T: Real> Job<'_, T> {
    /// Makes the method, and iterates it.
    fn choose(&self) -> PyResult<Answer<T>> {
        let Settings { splittings, window, .. } = self.settings;
        if splittings.is_empty() {
            let problem = self.pose(self.a.rows("A")?, self.b.rows("B")?)?;
            return self.iterate(self.settings.named()?.on_dyn(problem).map_err(wrong)?);
        }
        let (a, b) = (self.a.products(), self.b.products());
        let problem = self.pose(a, b)?;
        let shape = [a.order(); 2];
        let step = |call| SplittingStep(Products { shape, call, failure: self.failure });
        let plain: BoxedMethod<'_, T, _, _> = match &splittings[..] {
            [first, second] => {
                Box::new(Tmms::new(problem, step(first), step(second)).map_err(wrong)?)
            }
            [first, ..] => Box::new(Mms::new(problem, step(first)).map_err(wrong)?),
            [] => return Err(wrong("a splitting is one function or two")),
        };
        match self.settings.method.to_ascii_uppercase().as_str() {
            "AUTO" | "ANDERSON" => {
                self.iterate(Anderson::new(plain, window.unwrap_or(10)).map_err(wrong)?)
            }
            "MMS" if splittings.len() == 1 => self.iterate(plain),
            "TMMS" if splittings.len() == 2 => self.iterate(plain),
            name => Err(wrong(format!(
                "method is '{name}', but with a splitting of your own it must be ANDERSON, or MMS \
                 for one splitting and TMMS for two"
            ))),
        }
    }

    fn pose<A, B>(&self, a: A, b: B) -> PyResult<Hlcp<T, A, B>>
    where
        A: LinearOperator<T>,
        B: LinearOperator<T>,
    {
        let omega = match &self.omega {
            Some(omega) => omega.clone(),
            None => {
                let (Operator::Rows(a), Operator::Rows(b)) = (&self.a, &self.b) else {
                    return Err(wrong(
                        "give omega, for the diagonal of a LinearOperator is unknown",
                    ));
                };
                Omega::diagonal_ratio(T::of(self.settings.tau), &**a, &**b).map_err(wrong)?
            }
        };
        let problem = Hlcp::new(a, b, omega).map_err(wrong)?;
        let (expected, found) = (problem.order(), self.q.len());
        if found != expected {
            return Err(wrong(Error::Order { what: "q", found, expected }));
        }
        // The solver's vectors, scratch and the answer.
        room(expected.checked_mul(9))?;
        Ok(if self.settings.threads == 1 { problem } else { problem.in_parallel() })
    }

    fn iterate<M: Method<T>>(&self, method: M) -> PyResult<Answer<T>> {
        let mut solver = Solver::new(method);
        let nothing = vec![T::zero(); if self.start[0].is_some() { 0 } else { self.q.len() }];
        let options = match self.start {
            [Some(x), _, _] => Options::from_x(x),
            [None, None, None] => Options::default(),
            [None, z, r] => Options::from_solution(z.unwrap_or(&nothing), r.unwrap_or(&nothing)),
        };
        let mut looked = Instant::now();
        let mut observer = |progress: &Progress<'_, T>| {
            if let Some(callback) = &self.settings.callback {
                match tell(callback, progress) {
                    Ok(true) => return ControlFlow::Break(()),
                    Ok(false) => {}
                    Err(error) => self.failure.note(error),
                }
            }
            // Only the interpreter's main thread hears of them; elsewhere this does nothing.
            if looked.elapsed() >= BEAT {
                looked = Instant::now();
                if let Err(error) = Python::attach(|py| py.check_signals()) {
                    self.failure.note(error);
                }
            }
            if self.failure.ends() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let options = options.limits(self.limits).observer(&mut observer);
        let outcome = solver.solve(self.q, options).map_err(wrong)?;
        Ok(([solver.z(), solver.r(), solver.x()].map(<[T]>::to_vec), outcome))
    }
}

/// Shows an iterate to the user's function; returns whether it says stop.
fn tell<T: Real>(callback: &Py<PyAny>, progress: &Progress<'_, T>) -> PyResult<bool> {
    Python::attach(|py| {
        let Progress { iteration, residual: Norms { l2, linf }, elapsed, x, .. } = *progress;
        let x = PyArray1::from_slice(py, x);
        callback.bind(py).call1((iteration, x, l2, linf, elapsed.as_secs_f64()))?.extract()
    })
}

/// Works on so many threads.
fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> PyResult<R> + Send) -> PyResult<R> {
    if threads == 1 {
        return work();
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| PyRuntimeError::new_err(error.to_string()))?.install(work)
}

/// Runs without the interpreter; a panic becomes an exception.
fn released<R: Send>(py: Python<'_>, work: impl FnOnce() -> PyResult<R> + Send) -> PyResult<R> {
    py.detach(|| {
        catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
            let said = panic.downcast_ref::<String>().map(String::as_str);
            let said = said.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("?");
            Err(PyRuntimeError::new_err(format!(
                "{said} (an array was changed during the call, or this is a fault of hlcp's)"
            )))
        })
    })
}

/// Runs `work` on a thread of its own, and looks for signals meanwhile: Ctrl-C ends the call at
/// once and sets the flag of `work`, which may take to the end of a sweep or a set-up. It holds the
/// arrays that it reads until then.
fn apart<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(Python<'_>, Arc<AtomicBool>) -> PyResult<R> + Send + 'static,
) -> PyResult<R> {
    let (sender, receiver) = mpsc::channel();
    let stop = Arc::new(AtomicBool::new(false));
    let told = stop.clone();
    thread::Builder::new().spawn(move || {
        // No interpreter: it is about to exit. No receiver: the call was interrupted.
        let _ = Python::try_attach(|py| work(py, told)).map(|answer| sender.send(answer));
    })?;
    py.detach(move || {
        loop {
            match receiver.recv_timeout(BEAT) {
                Ok(answer) => return answer,
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())
                    .inspect_err(|_| stop.store(true, Ordering::Relaxed))?,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err("the thread of the call has ended"));
                }
            }
        }
    })
}

fn solve_in<'py, T: Real>(
    py: Python<'py>,
    stop: Arc<AtomicBool>,
    [a, b, q]: [&Bound<'py, PyAny>; 3],
    start: &Bound<'py, PyAny>,
    omega: &Bound<'py, PyAny>,
    settings: &Settings,
) -> PyResult<Bound<'py, PyAny>> {
    let (a, b): (Given<'_, T>, Given<'_, T>) = (a.extract()?, b.extract()?);
    let (q, start): (Array<'_, T>, [Option<Array<'_, T>>; 3]) = (q.extract()?, start.extract()?);
    let omega: Option<Numbers<'_, T>> = omega.extract()?;
    let mut starts = [None; 3];
    for (slice, array) in starts.iter_mut().zip(&start) {
        *slice = array.as_ref().map(|array| array.as_slice()).transpose()?;
    }
    let failure = Failure { stop, ..Failure::default() };
    let job = Job {
        a: a.operator("A", &failure)?,
        b: b.operator("B", &failure)?,
        q: q.as_slice()?,
        start: starts,
        omega: match &omega {
            Some(Numbers::Each(each)) => Some(Omega::Each(each.as_slice()?.to_vec())),
            Some(Numbers::Constant(value)) => Some(Omega::Uniform(T::of(*value))),
            None => None,
        },
        settings,
        limits: settings.limits()?,
        failure: &failure,
    };
    let answer = released(py, || on_threads(settings.threads, || job.choose()));
    drop(job);
    failure.raised()?;
    let (vectors, outcome) = answer?;
    let [z, r, x] = vectors.map(|v| PyArray1::from_vec(py, v));
    let norms = |norms: Norms| (norms.l2, norms.linf);
    let ended = (outcome.status.to_string(), outcome.to_string());
    let counts = (outcome.iterations, outcome.sweeps, outcome.elapsed.as_secs_f64());
    let residuals = (norms(outcome.residual), norms(outcome.relative));
    Ok((z, r, x, ended, counts, residuals).into_pyobject(py)?.into_any())
}

/// Bounds on the errors of z and r, the side of each unknown, whether the solution is proved to be
/// the only one, bounds on the functionals, and a sentence; or the sentence that says why there is
/// none.
#[derive(IntoPyObject)]
enum Proof<'py> {
    Given([Bound<'py, PyArray1<f64>>; 2], Bound<'py, PyArray1<i8>>, bool, Vec<[f64; 2]>, String),
    #[pyo3(transparent)]
    Refused(String),
}

fn certify_in<'py>(
    py: Python<'py>,
    clock: &mut (dyn FnMut() -> bool + Send),
    [a, b]: [&Bound<'py, PyAny>; 2],
    vectors: [&Bound<'py, PyAny>; 3],
    functionals: &Bound<'py, PyAny>,
) -> PyResult<Proof<'py>> {
    let (a, b): (Given<'_, f64>, Given<'_, f64>) = (a.extract()?, b.extract()?);
    let [q, z, r] = vectors.map(|vector| vector.extract::<Array<'_, f64>>());
    let (q, z, r) = (q?, z?, r?);
    let (q, z, r) = (q.as_slice()?, z.as_slice()?, r.as_slice()?);
    let failure = Failure::default();
    let (a, b) = (a.operator("A", &failure)?, b.operator("B", &failure)?);
    let (a, b) = (a.rows("A")?, b.rows("B")?);
    room(q.len().checked_mul(20))?;
    /// The largest order for which it is searched for a proof that the solution is the only one.
    const SEARCHED: usize = 100_000;
    let (certificate, uniqueness) = released(py, || {
        let mut ask = || clock();
        let clock = &mut Clock::new(&mut ask);
        let certificate = certify_within(&a, &b, q, z, r, clock).map_err(wrong)?;
        let searches = certificate.is_ok() && q.len() <= SEARCHED;
        let found =
            searches.then(|| uniqueness_within(&a, &b, clock).map_err(wrong)).transpose()?;
        PyResult::Ok((certificate, found))
    })?;
    let certificate = match certificate {
        Ok(certificate) => certificate,
        Err(refusal) => return Ok(Proof::Refused(refusal.to_string())),
    };
    let is_unique = uniqueness.as_ref().is_some_and(Uniqueness::is_proved);
    let unique = uniqueness.map_or("not looked at".into(), |found| found.to_string());
    let said = format!("solution unique: {unique}; {certificate}");
    let sides = certificate.sides.iter().map(|side| match side {
        Branch::Z => 1,
        Branch::R => -1,
        Branch::Open => 0,
    });
    let sides = PyArray1::from_iter(py, sides);
    let functionals: Vec<[Array<'_, f64>; 2]> = functionals.extract()?;
    let bounded = |[of_z, of_r]: &[Array<'_, f64>; 2]| {
        PyResult::Ok(certificate.functional([of_z.as_slice()?, of_r.as_slice()?]))
    };
    let bounded = functionals.iter().map(bounded).collect::<PyResult<_>>()?;
    let bounds = [certificate.z, certificate.r].map(|v| PyArray1::from_vec(py, v));
    Ok(Proof::Given(bounds, sides, is_unique, bounded, said))
}

// Scenes.

/// An operator as `hlcp/_operators.py` takes it: `(ny, nx)`, five numbers or arrays, and whether
/// the grid closes along y and x.
type Shown<'py> = ([usize; 2], Vec<Bound<'py, PyAny>>, [bool; 2]);

/// Shows a five-point operator, or a tridiagonal one as one on a line.
fn shown<'py>(py: Python<'py>, operator: &dyn Rows<f64>) -> PyResult<Shown<'py>> {
    let n = operator.order();
    if let Some(view) = operator.as_five_point() {
        let [nx, ny] = view.grid().unwrap_or([n, 1]);
        let coefficient = |coefficient: Coefficients<'_, f64>| match coefficient {
            Coefficients::Uniform(value) => value.into_pyobject(py).map(Bound::into_any),
            Coefficients::Each(values) => Ok(PyArray1::from_slice(py, values).into_any()),
        };
        let all = view.coefficients().into_iter().map(coefficient).collect::<Result<_, _>>()?;
        let [along_x, along_y] = view.round();
        return Ok(([ny, nx], all, [along_y, along_x]));
    }
    let mut bands = [(); 3].map(|()| vec![0.0; n]);
    for i in 0..n {
        operator.visit_row(i, &mut |j, entry| bands[j + 1 - i][i] = entry);
    }
    let [west, centre, east] = bands.map(|band| PyArray1::from_vec(py, band).into_any());
    let zero = || 0.0.into_pyobject(py).map(Bound::into_any);
    Ok(([1, n], vec![zero()?, west, centre, east, zero()?], [false; 2]))
}

/// A, B unless it is the identity, q, and z and r where they are known.
type Scene<'py> =
    (Shown<'py>, Option<Shown<'py>>, Bound<'py, PyAny>, Option<[Bound<'py, PyAny>; 2]>);

/// Rate, volatility, maturity, points and steps.
type Put = (f64, f64, f64, usize, usize);

fn american((rate, volatility, maturity, m, steps): Put) -> AmericanPut {
    AmericanPut { rate, volatility, maturity, m, steps }
}

/// A pair of operators, q, and z and r where they are known.
type Problem = (Box<dyn Rows<f64>>, Box<dyn Rows<f64>>, Vec<f64>, Option<[Vec<f64>; 2]>);

fn plain<A: Rows<f64> + 'static, B: Rows<f64> + 'static>((a, b, q): (A, B, Vec<f64>)) -> Problem {
    (Box::new(a), Box::new(b), q, None)
}

fn planted(posed: Posed<f64, FivePoint<f64>, FivePoint<f64>>) -> Problem {
    let Posed { a, b, q, z, r } = posed;
    (Box::new(a), Box::new(b), q, Some([z, r]))
}

#[pymodule(gil_used = false)]
mod _hlcp {
    use super::*;

    #[pymodule_export]
    use crate::film::{
        bearing_bounds, bearing_coefficients, bearing_film, bearing_motion, bearing_sensitivities,
        bearing_threshold, film_figures, film_gap, film_line, posed_film,
    };

    /// Solves HLCP(A, B, q) in double precision or in single, on a thread of its own if `is_apart`.
    #[pyfunction]
    fn solve(
        py: Python<'_>,
        double: bool,
        is_apart: bool,
        problem: [Py<PyAny>; 3],
        start: Py<PyAny>,
        omega: Py<PyAny>,
        settings: Settings,
    ) -> PyResult<Py<PyAny>> {
        let work = move |py: Python<'_>, stop| {
            let problem = problem.each_ref().map(|part| part.bind(py));
            let solve = if double { solve_in::<f64> } else { solve_in::<f32> };
            solve(py, stop, problem, start.bind(py), omega.bind(py), &settings).map(Bound::unbind)
        };
        if is_apart { apart(py, work) } else { work(py, Arc::default()) }
    }

    /// Bounds the error of z and r, on a thread of its own.
    #[pyfunction]
    fn certify(
        py: Python<'_>,
        operators: [Py<PyAny>; 2],
        vectors: [Py<PyAny>; 3],
        functionals: Py<PyAny>,
        maxtime: Option<f64>,
    ) -> PyResult<Py<PyAny>> {
        let (time, begun) = (duration(maxtime)?, Instant::now());
        apart(py, move |py, stop| {
            let mut is_up =
                || stop.load(Ordering::Relaxed) || time.is_some_and(|time| begun.elapsed() >= time);
            let operators = operators.each_ref().map(|operator| operator.bind(py));
            let vectors = vectors.each_ref().map(|vector| vector.bind(py));
            let proof = certify_in(py, &mut is_up, operators, vectors, functionals.bind(py));
            Ok(proof?.into_pyobject(py)?.into_any().unbind())
        })
    }

    /// Returns the names of all methods.
    #[pyfunction]
    fn names() -> Vec<String> {
        Named::names()
    }

    /// Poses a scene by its name, with its points along x and along y and its other numbers.
    #[pyfunction]
    fn scene<'py>(
        py: Python<'py>,
        name: &str,
        points: [usize; 2],
        numbers: Vec<f64>,
    ) -> PyResult<Scene<'py>> {
        let ([nx, ny], m) = (points, points[0]);
        let each = if ["journal_bearing", "dam", "bearing2d"].contains(&name) { 16 } else { 8 };
        room(nx.checked_mul(ny).and_then(|n| n.checked_mul(each)))?;
        let posed = match (name, &numbers[..]) {
            ("example1", &[mu, nu]) => Example { symmetric: true, m, mu, nu }.pose().map(planted),
            ("example2", &[mu, nu]) => Example { symmetric: false, m, mu, nu }.pose().map(planted),
            ("disc_lcp", []) => Disc { lcp: true, m }.pose().map(planted),
            ("disc_hlcp", []) => Disc { lcp: false, m }.pose().map(planted),
            ("slider", []) => Slider { cells: nx }.pose().map(plain),
            ("journal_bearing", &[ecc, b]) => JournalBearing { nx, ny, ecc, b }.pose().map(plain),
            ("obstacle", []) => Obstacle { m }.pose().map(plain),
            ("spiral", []) => Membrane { spiral: true, m }.pose().map(plain),
            ("bessel", []) => Membrane { spiral: false, m }.pose().map(plain),
            ("dam", &[length, tail, layer]) => {
                Dam { nx, ny, length, tail, layer }.pose().map(plain)
            }
            ("bearing2d", &[ecc, aspect, groove]) => {
                Bearing2d { nx, ny, ecc, aspect, groove }.pose().map(plain)
            }
            _ => return Err(wrong(format!("there is no scene {name} of {numbers:?}"))),
        };
        let (a, b, q, solution) = posed.map_err(wrong)?;
        let is_lcp =
            ["disc_lcp", "journal_bearing", "obstacle", "spiral", "bessel"].contains(&name);
        let b = if is_lcp { None } else { Some(shown(py, &*b)?) };
        let vector = |v| PyArray1::from_vec(py, v).into_any();
        Ok((shown(py, &*a)?, b, vector(q), solution.map(|both| both.map(vector))))
    }

    /// Returns A of all LCPs of a put, and how many there are.
    #[pyfunction]
    fn put(py: Python<'_>, put: Put) -> PyResult<(Shown<'_>, usize)> {
        let put = american(put);
        let (a, _) = put.pose::<f64>().map_err(wrong)?;
        room(a.order().checked_mul(8))?;
        Ok((shown(py, &a)?, put.lcps()))
    }

    /// Returns q of LCP number k of a put, for the z of the one before.
    #[pyfunction]
    fn put_q<'py>(
        py: Python<'py>,
        put: Put,
        k: usize,
        z: Array<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut q = vec![0.0; z.as_slice()?.len()];
        american(put).q(k, z.as_slice()?, &mut q);
        Ok(PyArray1::from_vec(py, q))
    }

    /// Returns the price of a put for a spot, in strikes, and up to where it is exercised.
    #[pyfunction]
    fn put_price(put: Put, z: Array<'_, f64>, spot: f64) -> PyResult<[f64; 2]> {
        let put = american(put);
        Ok([put.price(z.as_slice()?, spot), put.exercise(z.as_slice()?)])
    }
}
