//! `hlcp film` along a line: a profile of the gap.
//!
//! A profile is a file with two columns, the place x and the gap h, in units of your choice. Each
//! of its straight lines is cut into pieces, none longer than 1/400 of the film unless `--refine`
//! says how many.
//!
//! Without arguments it takes the pad of the library's slider, and ends with an error if peak or
//! rupture are not the known ones.

use std::{error::Error, fmt::Write as _, path::Path, time::Instant};

use hlcp::{
    files::FileError,
    film::{self, FilmError, Line, Map, Settings},
};
use hlcp_verify::Slider;
use serde_json::{Value, json};

use super::{Arguments, Done, doubtful, outputs, unit};
use crate::{
    chart::{self, Panel},
    memory,
};

/// What a piece takes, at least: its places, gaps, coefficients and unknowns.
const BYTES: usize = 200;

/// Solves for the film of a profile.
pub(super) fn solve(arguments: &mut Arguments) -> Result<Done, Box<dyn Error>> {
    let begun = Instant::now();
    let conditions = arguments.of_profile()?.unwrap_or([Slider::SPEED, Slider::VISCOSITY]);
    let points = match &arguments.profile {
        Some(path) => Points::of(path, &Map::read(path)?)?,
        None => {
            (arguments.x_unit, arguments.h_unit, arguments.p_unit) = (1e-3, 1e-6, 1e6);
            let path = Path::new("pad.csv");
            Points::of(path, &Map::parse(path, include_str!("../../data/pad.csv"))?)?
        }
    };
    let outputs = outputs(arguments, &[".svg", ".csv"])?;
    let solved = Solved::new(points.refined(arguments.refine)?, conditions, arguments)?;
    let mut report = solved.report()?;
    if arguments.profile.is_none() {
        solved.check()?;
        let [peak, rupture] = [Slider::PEAK * 1e-6, Slider::RUPTURE * 1e3];
        writeln!(report, "known: peak {peak:.6} MPa, rupture at x = {rupture:.6} mm")?;
    }
    let Solved { film, line, .. } = &solved;
    let length = film.x[film.x.len() - 1] - film.x[0];
    Ok(Done {
        outputs,
        texts: solved.drawn().map(String::into_bytes).into(),
        json: solved.json(begun.elapsed().as_secs_f64()),
        report,
        warnings: Vec::from_iter(doubtful(solved.thin(), &[length], line.pressure[line.peak])),
        converged: line.outcome.converged(),
    })
}

/// Points of a gap, in the user's units.
struct Points {
    x: Vec<f64>,
    h: Vec<f64>,
}

impl Points {
    /// The two columns of an array, which was read from `path`.
    fn of(path: &Path, array: &Map) -> Result<Self, FileError> {
        let fault = |reason| Err(FileError { path: path.to_owned(), line: None, reason });
        let found = array.columns;
        if found != 2 {
            return fault(format!(
                "{found} columns where x and h are wanted; a map of the gap in two dimensions is \
                 given by --map, with --lx and --ly"
            ));
        }
        let [x, h] = [0, 1]
            .map(|column| array.values.iter().skip(column).step_by(2).copied().collect::<Vec<_>>());
        if array.rows < 2 {
            return fault("a profile has at least 2 points, this one 1".into());
        }
        if let Some(at) = x.windows(2).position(|pair| pair[1] <= pair[0]) {
            let (last, place) = (x[at], x[at + 1]);
            let step = "; for a step, put two points very close together";
            let hint = if place == last { step } else { "" };
            return fault(format!(
                "row {}: x = {place} does not exceed the x before it, {last}{hint}",
                at + 2
            ));
        }
        match h.iter().position(|&h| h <= 0.0) {
            Some(at) => fault(format!("row {}: the gap h = {} is not positive", at + 1, h[at])),
            None => Ok(Self { x, h }),
        }
    }

    /// The same straight lines, each cut into `refine` pieces, or into pieces of at most 1/400 of
    /// the film.
    fn refined(self, refine: Option<u16>) -> Result<Self, String> {
        let pieces = film::Profile::pieces(&self.x, refine);
        let count = pieces.iter().fold(0, |sum: usize, pieces| sum.saturating_add(*pieces));
        memory::check(count, BYTES, "take a smaller --refine, or fewer points")?;
        let [x, h] = [&self.x, &self.h].map(|v| film::Profile::cut(v, &pieces));
        Ok(Self { x, h })
    }
}

/// A solution, with the points in the user's units and in metres.
struct Solved<'a> {
    arguments: &'a Arguments,
    points: Points,
    film: film::Profile,
    line: Line,
}

impl<'a> Solved<'a> {
    fn new(
        points: Points,
        [speed, viscosity]: [f64; 2],
        arguments: &'a Arguments,
    ) -> Result<Self, Box<dyn Error>> {
        if points.x.len() < 3 {
            return Err(
                "there is no point between the ends to solve for; --refine 2 or more".into()
            );
        }
        let [ambient, cavitation] =
            [arguments.ambient, arguments.cavitation].map(|p| p * arguments.p_unit);
        let film = film::Profile {
            x: points.x.iter().map(|x| x * arguments.x_unit).collect(),
            h: points.h.iter().map(|h| h * arguments.h_unit).collect(),
            speed,
            viscosity,
            ambient,
            cavitation,
        };
        let line = film.solve(&Settings::default()).map_err(|error| match error {
            FilmError::Input(_) => "--ambient is below --cavitation, or not a finite number".into(),
            error => format!("{error}; check the profile, --x-unit and --h-unit"),
        })?;
        Ok(Self { arguments, points, film, line })
    }

    fn thin(&self) -> f64 {
        self.film.h.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The largest flow, and by how much the smallest is off it.
    fn through(&self) -> [f64; 2] {
        let [least, most] = [f64::min, f64::max]
            .map(|pick| self.line.flow.iter().copied().reduce(pick).unwrap_or(f64::NAN));
        [most, most - least]
    }

    fn json(&self, seconds: f64) -> Value {
        let [flow, imbalance] = self.through();
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
            "least_gap_m": self.thin(),
            "unknowns": self.film.x.len() - 2,
            "seconds": seconds,
        })
    }

    fn report(&self) -> Result<String, std::fmt::Error> {
        let (mut text, Self { arguments, points, line, .. }) = (String::new(), self);
        let Line { outcome, load, friction, peak, .. } = line;
        writeln!(text, "{} unknowns: {outcome}", points.x.len() - 2)?;
        if !outcome.converged() {
            writeln!(text, "not converged, so these are no figures of the film:")?;
        }
        let [x, p] = [unit(arguments.x_unit, "m"), unit(arguments.p_unit, "Pa")];
        writeln!(
            text,
            "peak pressure     {:.6} {p} at x = {:.6} {x}",
            line.pressure[*peak] / arguments.p_unit,
            points.x[*peak]
        )?;
        writeln!(text, "load              {load:.6e} N/m over the ambient pressure")?;
        writeln!(text, "friction          {friction:.6e} N/m on the plane")?;
        for (front, at) in [("ruptures", &line.ruptures), ("forms again", &line.forms_again)] {
            for &i in at {
                let x_front = points.x[i];
                writeln!(text, "the film {front} at x = {x_front:.6} {x}, to within a piece")?;
            }
        }
        let [flow, imbalance] = self.through();
        writeln!(
            text,
            "flow              {flow:.6e} m²/s, the same everywhere but for {imbalance:.1e}"
        )?;
        Ok(text)
    }

    /// The picture and the numbers, as SVG and CSV.
    fn drawn(&self) -> [String; 2] {
        let Self { arguments, points, line: found, .. } = self;
        let pressures: Vec<f64> = found.pressure.iter().map(|p| p / arguments.p_unit).collect();
        let units = [(arguments.x_unit, "m"), (arguments.h_unit, "m"), (arguments.p_unit, "Pa")];
        let [x, h, p] = units.map(|(value, base)| unit(value, base));
        let rows: Vec<String> = (0..points.x.len())
            .map(|i| format!("{},{},{},{}", points.x[i], points.h[i], pressures[i], found.void[i]))
            .collect();
        let csv = chart::csv(&format!("x ({x}),h ({h}),p ({p}),void fraction"), &rows);

        // No more points than can be seen.
        let thin = points.x.len().div_ceil(600);
        let line = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
            let drawn = (0..points.x.len()).filter(|i| i % thin == 0 || i + 1 == points.x.len());
            drawn.map(|i| (points.x[i], value(i))).collect()
        };
        let along = (points.x[0], points.x[points.x.len() - 1]);
        let highest = |values: &[f64]| values.iter().copied().fold(f64::MIN, f64::max);
        let (low, high) = (arguments.cavitation, highest(&pressures));
        let high = if high > low { high + 0.05 * (high - low) } else { low + 1.0 };
        let axes = [format!("x ({x})"), format!("p ({p})"), format!("h ({h})")];
        let curve = line(&|i| pressures[i]);
        let pressure = Panel::new("Pressure", [&axes[0], &axes[1]], [along, (low, high)])
            .outline("pressure", "#0072B2", "", &curve);
        let [gap, filled] =
            [line(&|i| points.h[i]), line(&|i| (1.0 - found.void[i]) * points.h[i])];
        let ranges = [along, (0.0, 1.05 * highest(&points.h))];
        let gaps = Panel::new("Film", [&axes[0], &axes[2]], ranges)
            .outline("gap h", "#000000", "", &gap)
            .outline("filled, (1 − r) h", "#D55E00", "6 4", &filled);
        let caption = "Reynolds equation with mass-conserving cavitation";
        [chart::svg(2, 300.0, vec![pressure, gaps], caption), csv]
    }

    /// Holds the pad's peak and rupture against those of the continuous problem.
    fn check(&self) -> Result<(), String> {
        let Self { points, film, line, .. } = self;
        // The straight pieces are off the parabola by h″Δx²/8, some (Δx/L)² of the smallest gap;
        // 1e-3 is room.
        let peak = (line.pressure[line.peak] / Slider::PEAK - 1.0).abs() <= 1e-3;
        let near = |i: usize| (film.x[i] - Slider::RUPTURE).abs() <= film.x[i] - film.x[i - 1];
        if peak && matches!(line.ruptures[..], [i] if near(i)) {
            return Ok(());
        }
        let at = line.ruptures.iter().map(|&i| points.x[i]).collect::<Vec<_>>();
        Err(format!("the pad's peak is wrong, or it ruptures at {at:?}"))
    }
}
