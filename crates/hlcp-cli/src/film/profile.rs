//! `hlcp film` along a line: a profile of the gap.
//!
//! A profile is a file with two columns, the place x and the gap h, in units of your choice. Each
//! of its straight lines is cut into pieces, none longer than 1/400 of the film unless `--refine`
//! says how many.
//!
//! Without arguments it takes the pad of the library's slider.

use std::{path::Path, time::Instant};

use hlcp::{
    files::FileError,
    film::{FilmError, Line, Map, Profile, Settings},
};
use hlcp_verify::Slider;
use serde_json::{Value, json};

use super::{Arguments, Done, NAMED, outputs, report::Lines, unit};
use crate::{
    Fallible,
    chart::{self, Panel},
    memory,
};

/// What a piece takes, at least: its places, gaps, coefficients and unknowns.
const BYTES: usize = 200;

pub(super) fn solve(arguments: &mut Arguments) -> Fallible<Done> {
    let begun = Instant::now();
    let conditions = arguments.of_profile()?.unwrap_or([Slider::SPEED, Slider::VISCOSITY]);
    let (path, array) = match &arguments.profile {
        Some(path) => (path.as_path(), Map::read(path)?),
        None => {
            (arguments.x_unit, arguments.h_unit, arguments.p_unit) = (1e-3, 1e-6, 1e6);
            let path = Path::new("pad.csv");
            (path, Map::parse(path, include_str!("../../data/pad.csv"))?)
        }
    };
    let fault = |reason| FileError { path: path.to_owned(), line: None, reason };
    let [x, h] = points(&array).map_err(fault)?;
    let outputs = outputs(arguments, &[".svg", ".csv"])?;
    let pieces = Profile::pieces(&x, arguments.refine);
    let count = pieces.iter().fold(0, |sum: usize, pieces| sum.saturating_add(*pieces));
    memory::check(count, BYTES, "take a smaller --refine, or fewer points")?;
    let points = [&x, &h].map(|v| Profile::cut(v, &pieces));
    let solved = Solved::new(points, conditions, arguments)?;
    let mut report = solved.report();
    if arguments.profile.is_none() {
        let [peak, rupture] = [Slider::PEAK * 1e-6, Slider::RUPTURE * 1e3];
        report.say(format!("known: peak {peak:.6} MPa, rupture at x = {rupture:.6} mm"));
    }
    let Solved { film, line, .. } = &solved;
    Ok(Done {
        outputs,
        texts: solved.drawn().map(String::into_bytes).into(),
        json: solved.json(begun.elapsed().as_secs_f64()),
        report: report.0,
        warnings: NAMED.of_line(film, line),
        converged: line.outcome.converged(),
    })
}

/// The two columns of an array, x and h in the user's units.
fn points(array: &Map) -> Result<[Vec<f64>; 2], String> {
    let found = array.columns;
    if found != 2 {
        return Err(format!(
            "{found} columns where x and h are wanted; a map of the gap in two dimensions is \
             given by --map, with --lx and --ly"
        ));
    }
    let column = |k: usize| array.values.iter().skip(k).step_by(2).copied().collect::<Vec<_>>();
    let [x, h] = [column(0), column(1)];
    if array.rows < 2 {
        return Err("a profile has at least 2 points, this one 1".into());
    }
    if let Some(at) = x.windows(2).position(|pair| pair[1] <= pair[0]) {
        let (last, place, row) = (x[at], x[at + 1], at + 2);
        let step = "; for a step, put two points very close together";
        let hint = if place == last { step } else { "" };
        return Err(format!(
            "row {row}: x = {place} does not exceed the x before it, {last}{hint}"
        ));
    }
    match h.iter().position(|&h| h <= 0.0) {
        Some(at) => Err(format!("row {}: the gap h = {} is not positive", at + 1, h[at])),
        None => Ok([x, h]),
    }
}

/// A solution, with the points in the user's units and in metres.
struct Solved<'a> {
    arguments: &'a Arguments,
    x: Vec<f64>,
    h: Vec<f64>,
    film: Profile,
    line: Line,
}

impl<'a> Solved<'a> {
    fn new(
        [x, h]: [Vec<f64>; 2],
        [speed, viscosity]: [f64; 2],
        arguments: &'a Arguments,
    ) -> Fallible<Self> {
        if x.len() < 3 {
            return Err(
                "there is no point between the ends to solve for; --refine 2 or more".into()
            );
        }
        let in_si = |v: &[f64], unit: f64| v.iter().map(|v| v * unit).collect();
        let film = Profile {
            x: in_si(&x, arguments.x_unit),
            h: in_si(&h, arguments.h_unit),
            speed,
            viscosity,
            ambient: arguments.ambient * arguments.p_unit,
            cavitation: arguments.cavitation * arguments.p_unit,
        };
        let line = film.solve(&Settings::default()).map_err(|error| match error {
            FilmError::Input(_) => "--ambient is below --cavitation, or not a finite number".into(),
            error => format!("{error}; check the profile, --x-unit and --h-unit"),
        })?;
        Ok(Self { arguments, x, h, film, line })
    }

    fn json(&self, seconds: f64) -> Value {
        let [flow, imbalance] = self.line.through();
        let Line { outcome, load, friction, peak, .. } = self.line;
        let places = |fronts: &[usize]| fronts.iter().map(|&i| self.film.x[i]).collect::<Vec<_>>();
        json!({
            "outcome": outcome.status.to_string().replace(' ', "_"),
            "converged": outcome.converged(),
            "load_n_m": load,
            "friction_n_m": friction,
            "flow_m2_s": flow,
            "mass_imbalance_m2_s": imbalance,
            "peak_pressure_pa": self.line.pressure[peak],
            "peak_x_m": self.film.x[peak],
            "ruptures_x_m": places(&self.line.ruptures),
            "forms_again_x_m": places(&self.line.forms_again),
            "least_gap_m": self.film.h.iter().copied().fold(f64::INFINITY, f64::min),
            "unknowns": self.film.x.len() - 2,
            "seconds": seconds,
        })
    }

    fn report(&self) -> Lines {
        let (mut text, Self { arguments, line, .. }) = (Lines::default(), self);
        let Line { outcome, load, friction, peak, .. } = line;
        text.say(format!("{} unknowns: {outcome}", self.x.len() - 2));
        if !outcome.converged() {
            text.say("not converged, so these are no figures of the film:");
        }
        let [x, p] = [unit(arguments.x_unit, "m"), unit(arguments.p_unit, "Pa")];
        let (pressure, at) = (line.pressure[*peak] / arguments.p_unit, self.x[*peak]);
        text.add("peak pressure", format!("{pressure:.6} {p} at x = {at:.6} {x}"));
        text.add("load", format!("{load:.6e} N/m over the ambient pressure"));
        text.add("friction", format!("{friction:.6e} N/m on the plane"));
        for (front, at) in [("ruptures", &line.ruptures), ("forms again", &line.forms_again)] {
            for &i in at {
                let at = self.x[i];
                text.say(format!("the film {front} at x = {at:.6} {x}, to within a piece"));
            }
        }
        let [flow, imbalance] = self.line.through();
        let even = format!("the same everywhere but for {imbalance:.1e}");
        text.add("flow", format!("{flow:.6e} m²/s, {even}"));
        text
    }

    /// The picture and the numbers, as SVG and CSV.
    fn drawn(&self) -> [String; 2] {
        let Self { arguments, x: places, h: gaps, line: found, .. } = self;
        let pressures: Vec<f64> = found.pressure.iter().map(|p| p / arguments.p_unit).collect();
        let units = [(arguments.x_unit, "m"), (arguments.h_unit, "m"), (arguments.p_unit, "Pa")];
        let [x, h, p] = units.map(|(value, base)| unit(value, base));
        let rows: Vec<String> = (0..places.len())
            .map(|i| format!("{},{},{},{}", places[i], gaps[i], pressures[i], found.void[i]))
            .collect();
        let csv = format!("x ({x}),h ({h}),p ({p}),void fraction\n{}\n", rows.join("\n"));

        // No more points than can be seen.
        let thin = places.len().div_ceil(600);
        let line = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
            let drawn = (0..places.len()).filter(|i| i % thin == 0 || i + 1 == places.len());
            drawn.map(|i| (places[i], value(i))).collect()
        };
        let along = (places[0], places[places.len() - 1]);
        let highest = |values: &[f64]| values.iter().copied().fold(f64::MIN, f64::max);
        let (low, high) = (arguments.cavitation, highest(&pressures));
        let high = if high > low { high + 0.05 * (high - low) } else { low + 1.0 };
        let axes = [format!("x ({x})"), format!("p ({p})"), format!("h ({h})")];
        let curve = line(&|i| pressures[i]);
        let pressure = Panel::new("Pressure", [&axes[0], &axes[1]], [along, (low, high)])
            .outline("pressure", "#0072B2", "", &curve);
        let [gap, filled] = [line(&|i| gaps[i]), line(&|i| (1.0 - found.void[i]) * gaps[i])];
        let ranges = [along, (0.0, 1.05 * highest(gaps))];
        let film = Panel::new("Film", [&axes[0], &axes[2]], ranges)
            .outline("gap h", "#000000", "", &gap)
            .outline("filled, (1 − r) h", "#D55E00", "6 4", &filled);
        let caption = "Reynolds equation with mass-conserving cavitation";
        [chart::svg(2, 300.0, vec![pressure, film], caption), csv]
    }
}
