//! Films and bearings, as `hlcp/_film.py` and `hlcp/_bearing.py` describe them.

use std::{
    ops::ControlFlow,
    sync::atomic::{AtomicBool, Ordering},
};

use hlcp::film::{
    self, Bearing, Coefficients, Drive, Film, FilmFigures, Idle, Journal, Load, Lobes, Motion, Oil,
    Pad, Parameter, Pocket, Profile, Sensitivity, Side, Solved, Supply, Threshold, TimeStep, Words,
};
use hlcp::{Limits, Outcome, Progress, number};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::{IntoPyObjectExt, prelude::*, types::PyDict};

use crate::{apart, on_threads, released, room, shown, wrong};

/// The arguments that warnings name.
const NAMED: Words = Words {
    lengths: "lengths are in metres",
    viscosity: "viscosity",
    speed: "speed",
    groove: "grooves=[(0, 2e5)]",
    ambient: "ambient=101325 where oil surrounds it",
    side: "south=101325",
    supplies: "supplies",
};

/// A film as `hlcp/_film.py` describes it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Described<'py> {
    /// `(ny, nx)`.
    grid: [usize; 2],
    size: [f64; 2],
    gap: PyReadonlyArray1<'py, f64>,
    viscosity: PyReadonlyArray1<'py, f64>,
    speeds: [f64; 2],
    /// West, east, south and north: what is there, and its number.
    sides: [(String, f64); 4],
    /// Corner, size and pressure.
    supplies: Vec<([f64; 2], [f64; 2], f64)>,
    cavitation: f64,
    /// Duration and oil of a time step.
    step: Option<(f64, PyReadonlyArray1<'py, f64>)>,
}

impl Described<'_> {
    fn film(&self) -> PyResult<Film> {
        let [ny, nx] = self.grid;
        room(nx.checked_mul(ny).and_then(|n| n.checked_mul(16)))?;
        let side = |(what, number): &(String, f64)| match what.as_str() {
            "pressure" => Side::Pressure(*number),
            "starved" => Side::Starved(*number),
            "periodic" => Side::Periodic,
            _ => Side::Closed,
        };
        let supply = |&(corner, size, pressure): &_| Supply { corner, size, pressure };
        let step = |(duration, oil): &(f64, PyReadonlyArray1<'_, f64>)| {
            Ok::<_, PyErr>(TimeStep { duration: *duration, oil: oil.as_slice()?.to_vec() })
        };
        Ok(Film {
            nx,
            ny,
            lengths: self.size,
            gap: self.gap.as_slice()?.to_vec(),
            viscosity: self.viscosity.as_slice()?.to_vec(),
            speeds: self.speeds,
            sides: self.sides.each_ref().map(side),
            supplies: self.supplies.iter().map(supply).collect(),
            cavitation: self.cavitation,
            step: self.step.as_ref().map(step).transpose()?,
        })
    }
}

/// Poses a film: A and B; q; what z = 1 stands for, in Pa; and the r of a film that nothing feeds.
#[pyfunction(name = "film")]
pub(crate) fn posed_film<'py>(
    py: Python<'py>,
    film: Described<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    let film = film.film()?;
    let (a, b, q) = film.pose().map_err(wrong)?;
    let dry = (!film.is_fed()).then(|| PyArray1::from_vec(py, film.dry()));
    let (a, b, q) = (shown(py, &a)?, shown(py, &b)?, PyArray1::from_vec(py, q));
    Ok((a, b, q, film.pressure_unit(), dry).into_pyobject(py)?.into_any())
}

/// Figures by their names.
fn named<'py>(py: Python<'py>, figures: FilmFigures) -> PyResult<Bound<'py, PyDict>> {
    let named = PyDict::new(py);
    named.set_item("doubt", figures.doubt())?;
    named.set_item("load", figures.load)?;
    named.set_item("moments", figures.moments)?;
    named.set_item("friction", figures.friction)?;
    named.set_item("full_friction", figures.full_friction)?;
    named.set_item("power", figures.power)?;
    named.set_item("sides", figures.sides)?;
    named.set_item("supplies", figures.supplies)?;
    named.set_item("stored", figures.stored)?;
    named.set_item("imbalance", figures.imbalance)?;
    named.set_item("peak", figures.peak)?;
    named.set_item("least_gap", figures.least_gap)?;
    named.set_item("broken_share", figures.broken_share)?;
    named.set_item("least_content", figures.least_content)?;
    named.set_item("feed", figures.feed)?;
    Ok(named)
}

/// Returns what a film does, in SI units, and what there is to warn of if the solve converged.
#[pyfunction]
pub(crate) fn film_figures<'py>(
    py: Python<'py>,
    film: Described<'py>,
    z: PyReadonlyArray1<'py, f64>,
    r: PyReadonlyArray1<'py, f64>,
    ambient: f64,
    converged: bool,
) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
    let film = film.film()?;
    let figures = film.figures(z.as_slice()?, r.as_slice()?, ambient);
    let told = NAMED.warnings(&film, &figures, None, converged);
    Ok((named(py, figures)?, told))
}

/// Solves for a film along a line, each stretch of which is cut into pieces: arrays and figures in
/// the order of Python's class.
#[pyfunction]
pub(crate) fn film_line(
    py: Python<'_>,
    x: PyReadonlyArray1<'_, f64>,
    h: PyReadonlyArray1<'_, f64>,
    conditions: [f64; 4],
    refine: Option<u16>,
) -> PyResult<Py<PyAny>> {
    let (x, h, [speed, viscosity, ambient, cavitation]) =
        (x.as_slice()?, h.as_slice()?, conditions);
    let pieces = Profile::pieces(x, refine);
    room(
        pieces.iter().try_fold(0_usize, |n, k| n.checked_add(*k)).and_then(|n| n.checked_mul(25)),
    )?;
    let [x, h] = [x, h].map(|v| Profile::cut(v, &pieces));
    let profile = Profile { x, h, speed, viscosity, ambient, cavitation };
    let (profile, line) = released(py, move || {
        let line = profile.solve(&film::Settings::default()).map_err(wrong)?;
        Ok((profile, line))
    })?;
    let places = |fronts: &[usize]| fronts.iter().map(|&i| profile.x[i]).collect::<Vec<_>>();
    let [ruptures, again] = [places(&line.ruptures), places(&line.forms_again)];
    let [peak, at] = [line.pressure[line.peak], profile.x[line.peak]];
    let told = NAMED.of_line(&profile, &line);
    let (success, message) = (line.outcome.converged(), line.outcome.to_string());
    let figures = (line.load, line.friction, peak, at, ruptures, again, success, message);
    let content = line.void.iter().map(|void| 1.0 - void).collect();
    let arrays = [profile.x, profile.h, line.pressure, content, line.flow];
    let arrays = arrays.map(|values| PyArray1::from_vec(py, values));
    (arrays, figures, told).into_py_any(py)
}

/// The diameter, the length and the clearance of a journal, its tilt, and of lobes how many, their
/// preload, where they are narrowest and the middle of one, in rad.
type OfJournal = (f64, f64, f64, [f64; 2], Option<(usize, f64, f64, f64)>);

fn journal_of((diameter, length, clearance, tilt, lobes): OfJournal) -> Journal {
    let lobes =
        lobes.map(|(count, preload, offset, middle)| Lobes { count, preload, offset, middle });
    Journal { diameter, length, clearance, tilt, lobes }
}

/// The shape of a gap, in SI units: one of four, and what is added to it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Shape<'py> {
    /// `(ny, nx)`.
    grid: [usize; 2],
    size: [f64; 2],
    journal: Option<OfJournal>,
    plane: Option<[f64; 2]>,
    taper: Option<([f64; 2], f64)>,
    parabola: Option<(f64, f64, Option<f64>)>,
    map: Option<PyReadonlyArray1<'py, f64>>,
    roughness: Option<PyReadonlyArray1<'py, f64>>,
    /// Corner, size, depth and whether it is an ellipse.
    pockets: Vec<([f64; 2], [f64; 2], f64, bool)>,
    /// How many along x and y, and one of them.
    dimples: Vec<([usize; 2], [f64; 2], f64, bool)>,
}

fn pad_of(
    plane: Option<[f64; 2]>,
    taper: Option<([f64; 2], f64)>,
    parabola: Option<(f64, f64, Option<f64>)>,
) -> Option<Pad> {
    (plane.map(Pad::Plane))
        .or(taper.map(|(ends, length)| Pad::Taper(ends, length)))
        .or(parabola.map(|(least, radius, at)| Pad::Parabola { least, radius, at }))
}

/// Returns the gap in each cell, with the wall of a journal in the middle.
#[pyfunction]
pub(crate) fn film_gap<'py>(
    py: Python<'py>,
    shape: Shape<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let [ny, nx] = shape.grid;
    room(nx.checked_mul(ny).and_then(|n| n.checked_mul(16)))?;
    let flat = Film::new([nx, ny], shape.size, 0.0, 1.0);
    let pad = pad_of(shape.plane, shape.taper, shape.parabola);
    let mut bearing = match (shape.journal, pad) {
        (Some(journal), _) => {
            let journal = journal_of(journal);
            journal.lobes.map_or(Ok(()), |lobes| lobes.check()).map_err(wrong)?;
            Bearing::journal(journal, [nx, ny])
        }
        (None, Some(pad)) => Bearing::pad(pad.gap(flat)),
        (None, None) => Bearing::pad(flat),
    };
    if let Some(map) = &shape.map {
        bearing.film.gap = map.as_slice()?.to_vec();
    }
    if let Some(rough) = &shape.roughness {
        let gaps = bearing.film.gap.iter_mut().zip(rough.as_slice()?);
        gaps.for_each(|(gap, rough)| *gap += rough);
    }
    for (k, &(corner, size, depth, ellipse)) in shape.pockets.iter().enumerate() {
        dig(&mut bearing, Pocket { corner, size, depth, ellipse }, &format!("pockets[{k}]"))?;
    }
    for (k, &(counts, size, depth, ellipse)) in shape.dimples.iter().enumerate() {
        let what = format!("dimples[{k}]");
        let lengths = bearing.film.lengths;
        let [lx, ly] = [0, 1].map(|axis| lengths[axis] / counts[axis] as f64);
        if size[0] > lx * (1.0 + 1e-9) || size[1] > ly * (1.0 + 1e-9) {
            return Err(wrong(format!("{what} overlap; the film has {lx} m by {ly} m for each")));
        }
        let one = Pocket { corner: [0.0; 2], size, depth, ellipse };
        for pocket in one.repeated(counts, lengths) {
            dig(&mut bearing, pocket, &what)?;
        }
    }
    Ok(PyArray1::from_vec(py, bearing.film.gap))
}

/// Deepens the gap by a pocket.
fn dig(bearing: &mut Bearing, pocket: Pocket, what: &str) -> PyResult<()> {
    is_inside(bearing, pocket.corner, pocket.size, what)?;
    let film = &mut bearing.film;
    if pocket.dig(film) {
        return Ok(());
    }
    let [dx, dy] = [film.lengths[0] / film.nx as f64, film.lengths[1] / film.ny as f64];
    let [lx, ly] = pocket.size;
    Err(wrong(format!(
        "{what} of {lx} m by {ly} m is lost in cells of {dx} m by {dy} m; check its size, or take \
         more cells by nx and ny, or by a finer map"
    )))
}

/// Refuses a rectangle that is not in the film.
fn is_inside(bearing: &Bearing, corner: [f64; 2], size: [f64; 2], what: &str) -> PyResult<()> {
    let Some(axis) = bearing.outside(corner, size) else { return Ok(()) };
    let (from, to) = (corner[axis], corner[axis] + size[axis]);
    let (name, length) = (["x", "y"][axis], bearing.film.lengths[axis]);
    Err(wrong(format!(
        "{what} from {name} = {from} m to {to} m is outside the film, which ends at {length} m"
    )))
}

/// A film under a wall in a position, as `hlcp/_bearing.py` describes it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Walled<'py> {
    film: Described<'py>,
    ambient: f64,
    journal: Option<OfJournal>,
    plane: Option<[f64; 2]>,
    taper: Option<([f64; 2], f64)>,
    parabola: Option<(f64, f64, Option<f64>)>,
    position: Vec<f64>,
    /// Density and specific heat.
    oil: [f64; 2],
}

impl Walled<'_> {
    fn bearing(&self) -> PyResult<Bearing> {
        let film = self.film.film()?;
        let cells = [film.nx, film.ny];
        let blank = match self.journal {
            Some(journal) => Bearing::journal(journal_of(journal), cells),
            None => Bearing::pad(Film::new(cells, film.lengths, 0.0, 1.0)),
        };
        let pad = pad_of(self.plane, self.taper, self.parabola);
        Ok(Bearing { film, position: self.position.clone(), ambient: self.ambient, pad, ..blank })
    }
}

/// How films are solved.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct How {
    method: Option<String>,
    threads: usize,
}

impl How {
    /// Works without the interpreter and with these settings, until `stop` is set.
    fn run<R: Send>(
        &self,
        py: Python<'_>,
        stop: &AtomicBool,
        work: impl FnOnce(&film::Settings<'_>) -> PyResult<R> + Send,
    ) -> PyResult<R> {
        let run = || {
            let watch = |_: &str, _: &Limits, _: f64, _: &Progress<'_, f64>| {
                if stop.load(Ordering::Relaxed) {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            };
            let (method, in_parallel) = (self.method.as_deref(), self.threads > 1);
            work(&film::Settings { method, in_parallel, watch: Some(&watch) })
        };
        released(py, || on_threads(self.threads, run))
    }
}

/// What a bearing is to carry: a force, where it acts, and the place of x = 0 of a journal's load.
type Carries = (f64, Option<[f64; 2]>, Option<f64>);

fn load(bearing: &Bearing, (force, at, attitude): Carries) -> Load {
    Load { force, at, direction: attitude.map(|attitude| bearing.load_direction(attitude)) }
}

/// Refuses walls that meet, and supplies outside of the film.
fn check(bearing: &Bearing) -> PyResult<()> {
    for (k, supply) in bearing.film.supplies.iter().enumerate() {
        is_inside(bearing, supply.corner, supply.size, &format!("supplies[{k}]"))?;
    }
    if bearing.here().is_some() {
        return Ok(());
    }
    if let Some([gap, place]) = bearing.nearest(&bearing.position).filter(|[gap, _]| *gap <= 0.0) {
        return Err(wrong(if bearing.journal.is_some() {
            format!(
                "the journal meets its bush at an end, {:.1} degrees from x = 0, where the gap is \
                 {gap:e} m; take a smaller ecc, tilt or preload",
                place.to_degrees()
            )
        } else {
            format!(
                "the walls meet at x = {place} m, where the gap is {gap:e} m, but it must be \
                 positive everywhere, at the edges as well"
            )
        }));
    }
    let gap = bearing.gap(&bearing.position);
    let at = gap.iter().position(|&gap| !(gap > 0.0 && gap.is_finite())).unwrap_or_default();
    let (row, column, gap) = (at / bearing.film.nx, at % bearing.film.nx, gap[at]);
    Err(wrong(format!("the gap[{row}, {column}] is {gap:e} m, but it must be positive")))
}

/// Refuses frequencies over the running speed of what is at rest.
fn refuse_rest(bearing: &Bearing) -> PyResult<()> {
    if bearing.running_speed() > 0.0 {
        return Ok(());
    }
    Err(wrong(
        "a frequency is over the running speed, but nothing runs; give rpm or speed, or take \
         motion()",
    ))
}

/// Refuses a film in which nothing happens.
fn refuse_idle(film: &Film) -> PyResult<()> {
    let what = match Idle::of(film) {
        None => return Ok(()),
        Some(Idle::Closed) => {
            "nothing enters or leaves, so any even pressure is a solution; give a speed, or a \
             pressure by a side or supplies, or take motion()"
                .into()
        }
        Some(Idle::Even(p)) => format!(
            "all pressures are {p} Pa, so that is the pressure everywhere; give a speed, or take \
             motion()"
        ),
    };
    Err(wrong(format!("nothing drives the film: the walls carry nothing and {what}")))
}

/// Refuses a film that nothing feeds, and says what it does not do for that, and how to feed it.
fn refuse_dry(bearing: &Bearing, film: &Film, what: &str) -> PyResult<()> {
    if film.is_fed() {
        return Ok(());
    }
    Err(wrong(format!("it {what}: {}", NAMED.unfed(film, bearing.journal.is_some(), ""))))
}

/// Moves the wall to where it carries the load, and solves there; how many films that took.
fn carried(
    bearing: &mut Bearing,
    carries: Option<Carries>,
    start: Option<&Solved>,
    settings: &film::Settings<'_>,
) -> PyResult<(Solved, usize)> {
    check(bearing)?;
    let film = bearing.here().ok_or_else(|| wrong("the walls meet"))?;
    refuse_idle(&film)?;
    let Some((force, at, attitude)) = carries else {
        return Ok((Solved::new(film, start, settings).map_err(wrong)?, 1));
    };
    refuse_dry(bearing, &film, &format!("carries nothing instead of {} N", number(force)))?;
    let load = load(bearing, (force, at, attitude));
    let carried = bearing.carry(&load, start, settings).map_err(wrong)?;
    if carried.found || !carried.solved.outcome.converged() {
        return Ok((carried.solved, carried.films[0]));
    }
    let begin =
        if bearing.journal.is_some() { "by ecc or start" } else { "by other gaps or start" };
    Err(wrong(format!(
        "load: the search for a position that carries {} N failed; {}; give the load in N and all \
         lengths in m, take more cells where the film is narrow, or begin elsewhere, {begin}",
        number(force),
        carried.failure(force)
    )))
}

/// The figures of a bearing with its solution, by name; those of a step in time are given.
fn reported<'py>(
    py: Python<'py>,
    bearing: &Bearing,
    solved: Solved,
    (films, last, [density, heat]): (usize, Option<FilmFigures>, [f64; 2]),
) -> PyResult<Bound<'py, PyDict>> {
    let Solved { film, z, r, outcome, .. } = solved;
    let figures = last.unwrap_or_else(|| film.figures(&z, &r, bearing.ambient));
    let [load, x, y] = bearing.load(&film, &figures, &z);
    let [drag, full] = [figures.friction, figures.full_friction].map(|pair| bearing.drag(pair));
    let derived = bearing.derived(&film, &figures, load, &Oil { density, heat });
    let told = NAMED.warnings(&film, &figures, Some(&derived), outcome.converged());
    let found = named(py, figures)?;
    found.set_item("warnings", told)?;
    found.set_item("load", load)?;
    found.set_item("specific_load", derived.specific_load)?;
    found.set_item("sommerfeld", derived.sommerfeld)?;
    found.set_item("torque", derived.torque)?;
    found.set_item("leakage", derived.leakage)?;
    found.set_item("temperature_rise", derived.temperature_rise)?;
    found.set_item("reynolds", derived.reynolds)?;
    found.set_item("laminar", derived.laminar)?;
    found.set_item("at", [x, y])?;
    found.set_item("friction", drag)?;
    found.set_item("full_friction", full)?;
    found.set_item("position", &bearing.position)?;
    let [ecc, attitude] = bearing.attitude(x).map_or([None; 2], |pair| pair.map(Some));
    found.set_item("ecc", ecc)?;
    found.set_item("attitude", attitude)?;
    found.set_item("films", films)?;
    found.set_item("pressure", PyArray1::from_vec(py, film.pressures(&z)))?;
    found.set_item("z", PyArray1::from_vec(py, z))?;
    found.set_item("r", PyArray1::from_vec(py, r))?;
    let Outcome { status, iterations, sweeps, elapsed, residual, relative, .. } = outcome;
    found.set_item("status", status.name())?;
    found.set_item("message", outcome.to_string())?;
    found.set_item("nit", iterations)?;
    found.set_item("sweeps", sweeps)?;
    found.set_item("elapsed", elapsed.as_secs_f64())?;
    found.set_item("residual", residual.l2)?;
    found.set_item("relative", relative.l2)?;
    Ok(found)
}

/// A similar film with its z and r.
type Start<'py> = (Walled<'py>, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);

/// The bearing of a stored solution, and the solution.
fn stored((walled, z, r): &Start<'_>) -> PyResult<(Bearing, Solved)> {
    let bearing = walled.bearing()?;
    let film = bearing.here().ok_or_else(|| wrong("the walls meet"))?;
    let (z, r) = (z.as_slice()?.to_vec(), r.as_slice()?.to_vec());
    Ok((bearing, Solved::known(film, z, r).map_err(wrong)?))
}

/// Solves for the film of a bearing, in its position or where it carries a load.
#[pyfunction]
pub(crate) fn bearing_film(
    py: Python<'_>,
    walled: Py<PyAny>,
    carries: Option<Carries>,
    start: Option<Py<PyAny>>,
    how: Py<PyAny>,
) -> PyResult<Py<PyAny>> {
    apart(py, move |py, stop| {
        let walled: Walled<'_> = walled.bind(py).extract()?;
        let (mut bearing, oil) = (walled.bearing()?, walled.oil);
        let start = start.map(|start| stored(&start.bind(py).extract()?)).transpose()?;
        let how: How = how.bind(py).extract()?;
        let (bearing, solved, films) = how.run(py, &stop, move |settings| {
            let start = start.as_ref().map(|(_, solved)| solved);
            let (solved, films) = carried(&mut bearing, carries, start, settings)?;
            Ok((bearing, solved, films))
        })?;
        Ok(reported(py, &bearing, solved, (films, None, oil))?.into_any().unbind())
    })
}

/// Returns stiffness and damping of a film that is solved, for motions at this frequency over the
/// running speed, or without one for slow motions by the clamp.
#[pyfunction]
pub(crate) fn bearing_coefficients(
    py: Python<'_>,
    stored_film: Py<PyAny>,
    frequency: Option<f64>,
    how: Py<PyAny>,
) -> PyResult<[Vec<Vec<f64>>; 2]> {
    apart(py, move |py, stop| {
        let (bearing, solved) = stored(&stored_film.bind(py).extract()?)?;
        let how: How = how.bind(py).extract()?;
        how.run(py, &stop, move |settings| {
            refuse_dry(&bearing, &solved.film, "answers to no motion")?;
            if frequency.is_some_and(|ratio| ratio > 0.0) {
                refuse_rest(&bearing)?;
            }
            let found = match frequency {
                Some(ratio) => Coefficients::at(&bearing, &solved, ratio * bearing.running_speed()),
                None => Coefficients::clamped(&bearing, &solved, settings),
            };
            let Coefficients { stiffness, damping } = found.map_err(wrong)?;
            Ok([stiffness, damping])
        })
    })
}

/// Returns the mass above which a journal whirls by itself, and the frequency of that over the
/// running speed, if there is such a mass.
#[pyfunction]
pub(crate) fn bearing_threshold(
    py: Python<'_>,
    stored_film: Py<PyAny>,
) -> PyResult<Option<[f64; 2]>> {
    apart(py, move |py, _| {
        let (bearing, solved) = stored(&stored_film.bind(py).extract()?)?;
        refuse_rest(&bearing)?;
        refuse_dry(&bearing, &solved.film, "answers to no motion")?;
        let found = released(py, || Threshold::of(&bearing, &solved).map_err(wrong))?;
        Ok(found.map(|found| [found.mass, found.omega / bearing.running_speed()]))
    })
}

/// Returns the names of the numbers that a bearing depends on and the derivatives of the figures of
/// its film, which is solved, by them: in its position or under a load, and by gaps beside.
#[pyfunction]
pub(crate) fn bearing_sensitivities(
    py: Python<'_>,
    stored_film: Py<PyAny>,
    carries: Option<Carries>,
    gaps: Py<PyAny>,
) -> PyResult<Vec<(String, Py<PyAny>)>> {
    apart(py, move |py, _| {
        let (bearing, solved) = stored(&stored_film.bind(py).extract()?)?;
        let gaps: Vec<(String, PyReadonlyArray1<'_, f64>)> = gaps.bind(py).extract()?;
        let known = bearing.parameters(carries.is_none()).into_iter();
        let (mut names, mut parameters): (Vec<_>, Vec<_>) =
            known.map(|(name, _, parameter)| (name, parameter)).unzip();
        for (name, gap) in gaps {
            names.push(name);
            parameters.push(Parameter::Gap(gap.as_slice()?.to_vec()));
        }
        let found = released(py, || {
            refuse_dry(&bearing, &solved.film, "changes with nothing")?;
            let load = carries.map(|carries| load(&bearing, carries));
            bearing.sensitivities(&solved, &parameters, load.as_ref()).map_err(wrong)
        })?;
        // In the order of Python's class.
        let told = |(name, found): (String, Sensitivity)| {
            let Sensitivity { forces, slopes: of, position, ecc, attitude, .. } = found;
            let (drag, full, sides, supplies) =
                (of.friction, of.full_friction, of.sides, of.supplies);
            let (load, power, peak) = (of.load, of.power, of.peak);
            let slopes =
                (forces, load, drag, full, power, sides, supplies, peak, position, ecc, attitude);
            Ok((name, slopes.into_py_any(py)?))
        };
        names.into_iter().zip(found).map(told).collect()
    })
}

/// What is proved, in the order of Python's class.
type Bounds = ([f64; 2], [[f64; 2]; 2], [[f64; 2]; 4], Vec<[f64; 2]>, [f64; 2]);

/// Proves the figures of a film that is solved, or of all films that differ from it by a part: a
/// sentence, and the intervals unless nothing is proved.
#[pyfunction]
pub(crate) fn bearing_bounds(
    py: Python<'_>,
    stored_film: Py<PyAny>,
    part: Option<f64>,
) -> PyResult<(String, Option<Bounds>)> {
    apart(py, move |py, _| {
        let (bearing, solved) = stored(&stored_film.bind(py).extract()?)?;
        let proved = released(py, || match part {
            Some(part) => {
                let Solved { film, z, r, .. } = &solved;
                let range = bearing.range(part, film, z, r).map_err(wrong)?;
                Ok(range.map(|proved| (format!("proved within {part}"), proved)))
            }
            None => {
                let certificate = solved.certificate().map_err(wrong)?;
                Ok(certificate.map(|certificate| {
                    let proved = bearing.proved(&solved.film, &certificate);
                    (certificate.to_string(), proved)
                }))
            }
        })?;
        Ok(match proved {
            Ok((said, proved)) => {
                let friction = bearing.proved_drag(&proved);
                (said, Some((proved.load, friction, proved.sides, proved.supplies, proved.peak)))
            }
            Err(refusal) => (format!("nothing is proved, because {refusal}"), None),
        })
    })
}

/// What each step of a motion does, as `hlcp/_bearing.py` takes it; the imbalance, and whether all
/// steps converged.
type Steps = (Vec<Vec<f64>>, f64, bool);

/// Takes a step from each time to the next one, perhaps from where a load is carried.
///
/// A row is a position, of a journal along its load and across it, or with a mass the load.
fn moved(
    mut bearing: Bearing,
    times: &[f64],
    rows: &[Vec<f64>],
    (mass, attitude, begins): (Option<f64>, f64, Option<Carries>),
    settings: &film::Settings<'_>,
) -> PyResult<(Motion, Steps, Option<FilmFigures>)> {
    if begins.is_some() {
        carried(&mut bearing, begins, None, settings)?;
    }
    let load = bearing.load_direction(attitude);
    let drives: Vec<_> = rows.iter().map(|row| bearing.drive(load, row, mass)).collect();
    let meets = |drive: &Drive| matches!(drive, Drive::To(at) if bearing.at(at).is_none());
    if let Some(row) = drives.iter().position(meets) {
        return Err(wrong(format!("positions[{row}]: the walls meet; positions are in m")));
    }
    match &drives[0] {
        Drive::To(position) => bearing.position.clone_from(position),
        _ => check(&bearing)?,
    }
    let mut motion = Motion::new(bearing, settings).map_err(wrong)?;
    let (begun, mut entered) = (motion.oil(), 0.0);
    let settled = motion.solved.as_ref().is_none_or(|solved| solved.outcome.converged());
    let (mut steps, mut is_success, mut last) = (vec![], settled, None);
    for (k, pair) in times.windows(2).enumerate() {
        let duration = pair[1] - pair[0];
        let found = motion.step(duration, &drives[k + 1], settings);
        let found = found.map_err(|error| wrong(format!("times[{}]: {error}", k + 1)))?;
        let (bearing, solved) = (&motion.bearing, motion.solved.as_ref());
        let solved = solved.ok_or_else(|| wrong("there is no film after a step"))?;
        is_success &= solved.outcome.converged();
        let supplied = found.supplies.iter().fold(0.0, |sum, flow| sum + flow);
        entered += duration * (supplied - found.sides.iter().sum::<f64>());
        let rest = [supplied, motion.oil(), found.peak, found.least_gap, found.broken_share];
        let carried = bearing.load(&solved.film, &found, &solved.z);
        let (drag, at) = (bearing.drag(found.friction), bearing.told(load));
        steps.push([&carried[..], &drag, &[found.power], &found.sides, &rest, &at].concat());
        last = Some(found);
    }
    let imbalance = (motion.oil() - begun - entered) / (times[times.len() - 1] - times[0]);
    Ok((motion, (steps, imbalance, is_success), last))
}

/// Moves the wall of a bearing: what each step does, and the last film.
#[pyfunction]
pub(crate) fn bearing_motion(
    py: Python<'_>,
    walled: Py<PyAny>,
    times: Vec<f64>,
    rows: Vec<Vec<f64>>,
    driven: (Option<f64>, f64, Option<Carries>),
    how: Py<PyAny>,
) -> PyResult<Py<PyAny>> {
    apart(py, move |py, stop| {
        let walled: Walled<'_> = walled.bind(py).extract()?;
        let (bearing, of_oil) = (walled.bearing()?, walled.oil);
        let how: How = how.bind(py).extract()?;
        let (motion, (steps, imbalance, is_success), figures) =
            how.run(py, &stop, move |settings| moved(bearing, &times, &rows, driven, settings))?;
        let Motion { bearing, solved, .. } = motion;
        let solved = solved.ok_or_else(|| wrong("there are no steps"))?;
        let oil = solved.film.step.as_ref().map(|step| (step.duration, step.oil.clone()));
        let last = reported(py, &bearing, solved, (steps.len(), figures, of_oil))?;
        last.set_item("step", oil.map(|(time, oil)| (time, PyArray1::from_vec(py, oil))))?;
        (steps, imbalance, is_success, last).into_py_any(py)
    })
}
