//! `hlcp film` along a line: a profile of the gap, one row of points.
//!
//! A profile is a file with two columns, the place x and the gap h, in units of your choice. Between
//! two points the gap is a straight line, which is cut into pieces, none longer than 1/400 of the
//! film unless `--refine` says how many. A plane moves below it with the given speed in the
//! direction of x, the film is full at the first point, and both ends are at the ambient pressure.
//!
//! Without arguments it takes the pad of the library's slider, and ends with an error if peak or
//! rupture are not the known ones.
//!
//! # What is solved
//!
//! The Reynolds equation with mass-conserving cavitation: with the pressure `p` above the
//! cavitation pressure and the void fraction `r`, what flows is `Φ = ½U(1 − r)h − h³/(12μ) dp/dx`,
//! the same everywhere, and `p, r ≥ 0`, `p r = 0`. Between two points `h` is a straight line, for
//! which a full film's flux is known exactly: with the harmonic mean `H = 2h₁h₂/(h₁ + h₂)`,
//!
//! ```text
//! Φ = ½U (1 − r) H − (p₂ − p₁) H h₁h₂/(12μ Δx) ,    r of the point before.
//! ```
//!
//! That what enters a point leaves it is its row of `A z − B r + q = 0`: `A` tridiagonal, `B`
//! bidiagonal, both M-matrices. Newton's method solves it in a few steps.

use std::{error::Error, fmt::Write as _, path::Path, time::Instant};

use hlcp::files::FileError;
use hlcp_core::Tridiagonal;
use hlcp_methods::Outcome;
use hlcp_verify::Slider;
use serde_json::{Value, json};

use super::{
    Arguments, Done, array,
    balance::{self, Asked},
    doubtful, outputs, unit,
};
use crate::{
    chart::{self, Panel},
    memory,
    scenes::Problem,
};

/// What a piece takes, at least: its places, gaps, coefficients and unknowns.
const BYTES: usize = 200;

/// Solves for the film of a profile.
pub(super) fn solve(arguments: &mut Arguments) -> Result<Done, Box<dyn Error>> {
    let begun = Instant::now();
    let conditions = arguments.of_profile()?.unwrap_or([Slider::SPEED, Slider::VISCOSITY]);
    let profile = match &arguments.profile {
        Some(path) => Profile::of(path, &array::read(path)?)?,
        None => {
            (arguments.x_unit, arguments.h_unit, arguments.p_unit) = (1e-3, 1e-6, 1e6);
            let path = Path::new("pad.csv");
            Profile::of(path, &array::parse(path, include_str!("../../data/pad.csv"))?)?
        }
    };
    let outputs = outputs(arguments, &[".svg", ".csv"])?;
    let profile = profile.refined(arguments.refine)?;
    let film = Film::solve(&profile, conditions, arguments)?;
    let mut report = film.report(&profile, arguments)?;
    if arguments.profile.is_none() {
        film.check(&profile)?;
        let [peak, rupture] = [Slider::PEAK * 1e-6, Slider::RUPTURE * 1e3];
        writeln!(report, "known: peak {peak:.6} MPa, rupture at x = {rupture:.6} mm")?;
    }
    let length = film.x[film.x.len() - 1] - film.x[0];
    Ok(Done {
        outputs,
        texts: film.drawn(&profile, arguments).map(String::into_bytes).into(),
        json: film.json(arguments, begun.elapsed().as_secs_f64()),
        report,
        warnings: doubtful(film.thin, &[length], film.p[film.peak()]).into_iter().collect(),
        converged: film.outcome.converged(),
    })
}

/// Points of a gap, in the user's units.
struct Profile {
    x: Vec<f64>,
    h: Vec<f64>,
}

impl Profile {
    /// The two columns of an array, which was read from `path`.
    fn of(path: &Path, array: &array::Array) -> Result<Self, FileError> {
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
    ///
    /// Load and peak take the pressures at the points alone. With 400 pieces the load of a plane
    /// wedge is 7e-6 off if the gap narrows to 2/3, 5e-5 for a tenth and 2e-3 for a hundredth, and
    /// a rupture is known to 1/400 of the film.
    fn refined(self, refine: Option<u16>) -> Result<Self, String> {
        let length = self.x[self.x.len() - 1] - self.x[0];
        let by_length = |x: &[f64]| ((x[1] - x[0]) / length * 400.0).ceil().max(1.0) as usize;
        let pieces: Vec<usize> =
            self.x.windows(2).map(|x| refine.map_or_else(|| by_length(x), usize::from)).collect();
        let count = pieces.iter().fold(0, |sum: usize, pieces| sum.saturating_add(*pieces));
        memory::check(count, BYTES, "take a smaller --refine, or fewer points")?;
        let cut = |v: &[f64]| -> Vec<f64> {
            let inner = v.windows(2).zip(&pieces).flat_map(|(ends, &pieces)| {
                (0..pieces).map(move |k| ends[0] + (ends[1] - ends[0]) * k as f64 / pieces as f64)
            });
            inner.chain(v.last().copied()).collect()
        };
        Ok(Self { x: cut(&self.x), h: cut(&self.h) })
    }
}

/// A solution without units: pressure and void at the points, and what flows through the pieces.
struct Pieces {
    z: Vec<f64>,
    r: Vec<f64>,
    flow: Vec<f64>,
}

/// Solves for gaps in the smallest one, places in the film's length and the pressure `ends` at both
/// ends.
fn pieces(
    x: &[f64],
    h: &[f64],
    ends: f64,
    arguments: &Arguments,
) -> Result<(Pieces, Outcome), Box<dyn Error>> {
    // Row i is the balance of point i + 1, between the pieces i and i + 1.
    let gap: Vec<f64> = h.windows(2).map(|h| 2.0 * h[0] * h[1] / (h[0] + h[1])).collect();
    let n = gap.len() - 1;
    let c: Vec<f64> = (0..=n).map(|k| gap[k] * h[k] * h[k + 1] / (x[k + 1] - x[k])).collect();
    let mut q: Vec<f64> = gap.windows(2).map(|gap| gap[1] - gap[0]).collect();
    q[0] -= c[0] * ends;
    q[n - 1] -= c[n] * ends;
    let (of_c, of_gap) = (c.clone(), gap.clone());
    let a = Tridiagonal::new(n, move |i| [-of_c[i], of_c[i] + of_c[i + 1], -of_c[i + 1]])?;
    let b = Tridiagonal::new(n, move |i| [-of_gap[i], of_gap[i + 1], 0.0])?;
    // A solution at every other point says where about the film is full: without it Newton's method
    // takes thousands of steps where fronts are many.
    let begin = if n > 60 {
        let coarse = |v: &[f64]| -> Vec<f64> {
            let kept = (0..v.len()).filter(|i| i % 2 == 0 || i + 1 == v.len());
            kept.map(|i| v[i]).collect()
        };
        let (Pieces { z, r, .. }, _) = pieces(&coarse(x), &coarse(h), ends, arguments)?;
        let fine = |v: &[f64]| (1..=n).map(|i| (v[i / 2] + v[i.div_ceil(2)]) / 2.0).collect();
        Some([fine(&z), fine(&r)])
    } else {
        None
    };
    let asked = Asked::film("NEWTON");
    let (z, r, _, outcome) = balance::solve(&Problem::new(a, b, q), begin, asked, arguments)?;

    let z = [&[ends][..], &z, &[ends]].concat();
    // The film is full at the inlet, and at the outlet if there is pressure.
    let last = if ends > 0.0 { 0.0 } else { r[n - 1] };
    let r = [&[0.0][..], &r, &[last]].concat();
    let flow = (0..=n).map(|k| (1.0 - r[k]) * gap[k] - c[k] * (z[k + 1] - z[k])).collect();
    Ok((Pieces { z, r, flow }, outcome))
}

/// A solution at the points of a profile, in metres, pascals and seconds.
struct Film {
    outcome: Outcome,
    /// The smallest gap.
    thin: f64,
    x: Vec<f64>,
    p: Vec<f64>,
    /// The void fraction of the piece that begins at a point.
    void: Vec<f64>,
    /// The flow through each piece, by width.
    flow: Vec<f64>,
    friction: f64,
}

impl Film {
    fn solve(
        profile: &Profile,
        [speed, viscosity]: [f64; 2],
        arguments: &Arguments,
    ) -> Result<Self, Box<dyn Error>> {
        if profile.x.len() < 3 {
            return Err(
                "there is no point between the ends to solve for; --refine 2 or more".into()
            );
        }
        let x: Vec<f64> = profile.x.iter().map(|x| x * arguments.x_unit).collect();
        let h: Vec<f64> = profile.h.iter().map(|h| h * arguments.h_unit).collect();
        // Lengths in those of the film, gaps in the smallest, pressures in 6μUL/h².
        let length = x[x.len() - 1] - x[0];
        let thin = h.iter().copied().fold(f64::INFINITY, f64::min);
        let unit = 6.0 * viscosity * speed * length / (thin * thin);
        let rises = x.windows(2).all(|x| x[1] > x[0]) && length.is_finite();
        let is_sound = rises && thin > 0.0 && h.iter().all(|h| h.is_finite());
        if !(is_sound && unit > 0.0 && unit.is_finite()) {
            return Err(format!(
                "the film is {length:e} m long with a least gap of {thin:e} m, which is not within \
                 the range of numbers; check the profile, --x-unit and --h-unit"
            )
            .into());
        }
        let cavitation = arguments.cavitation * arguments.p_unit;
        let ends = (arguments.ambient * arguments.p_unit - cavitation) / unit;
        if !(ends >= 0.0 && ends.is_finite()) {
            return Err("--ambient is below --cavitation, or not a finite number".into());
        }
        let scaled = |v: &[f64], by: f64| -> Vec<f64> { v.iter().map(|v| v / by).collect() };
        let (Pieces { z, r: void, flow }, outcome) =
            pieces(&scaled(&x, length), &scaled(&h, thin), ends, arguments)?;
        let flow = flow.iter().map(|flow| flow * speed * thin / 2.0).collect();
        let p: Vec<f64> = z.iter().map(|z| z * unit + cavitation).collect();
        // On the plane, with the middle gap of each piece.
        let shear = |k: usize| {
            let middle = (h[k] + h[k + 1]) / 2.0;
            (1.0 - void[k]) * viscosity * speed / middle * (x[k + 1] - x[k])
                + middle / 2.0 * (p[k + 1] - p[k])
        };
        let friction = (0..x.len() - 1).map(shear).sum();
        Ok(Self { outcome, thin, x, p, void, flow, friction })
    }

    /// The point of the largest pressure.
    fn peak(&self) -> usize {
        (0..self.p.len()).fold(0, |peak, i| if self.p[i] > self.p[peak] { i } else { peak })
    }

    /// The points where a full film has ruptured, or a broken one has formed again; the front
    /// itself is at most a piece away.
    fn fronts(&self, rupture: bool) -> Vec<usize> {
        let full = |i: usize| self.void[i] == 0.0;
        (1..self.x.len()).filter(|&i| full(i) != full(i - 1) && full(i) != rupture).collect()
    }

    /// The load by width, over the ambient pressure.
    fn load(&self, arguments: &Arguments) -> f64 {
        let ambient = arguments.ambient * arguments.p_unit;
        let over = |k: usize| (self.p[k] + self.p[k + 1]) / 2.0 - ambient;
        (0..self.flow.len()).map(|k| over(k) * (self.x[k + 1] - self.x[k])).sum()
    }

    /// The largest flow, and by how much the smallest is off it.
    fn through(&self) -> [f64; 2] {
        let [least, most] = [f64::min, f64::max]
            .map(|pick| self.flow.iter().copied().reduce(pick).unwrap_or(f64::NAN));
        [most, most - least]
    }

    fn json(&self, arguments: &Arguments, seconds: f64) -> Value {
        let [flow, imbalance] = self.through();
        let peak = self.peak();
        let places =
            |rupture| self.fronts(rupture).into_iter().map(|i| self.x[i]).collect::<Vec<_>>();
        json!({
            "outcome": self.outcome.status.to_string().replace(' ', "_"),
            "converged": self.outcome.converged(),
            "load_n_m": self.load(arguments),
            "friction_n_m": self.friction,
            "flow_m2_s": flow,
            "mass_imbalance_m2_s": imbalance,
            "peak_pressure_pa": self.p[peak],
            "peak_x_m": self.x[peak],
            "ruptures_x_m": places(true),
            "forms_again_x_m": places(false),
            "least_gap_m": self.thin,
            "unknowns": self.x.len() - 2,
            "seconds": seconds,
        })
    }

    fn report(&self, profile: &Profile, arguments: &Arguments) -> Result<String, std::fmt::Error> {
        let mut text = String::new();
        writeln!(text, "{} unknowns: {}", self.x.len() - 2, self.outcome)?;
        if !self.outcome.converged() {
            writeln!(text, "not converged, so these are no figures of the film:")?;
        }
        let [x, p] = [unit(arguments.x_unit, "m"), unit(arguments.p_unit, "Pa")];
        let peak = self.peak();
        writeln!(
            text,
            "peak pressure     {:.6} {p} at x = {:.6} {x}",
            self.p[peak] / arguments.p_unit,
            profile.x[peak]
        )?;
        let load = self.load(arguments);
        writeln!(text, "load              {load:.6e} N/m over the ambient pressure")?;
        writeln!(text, "friction          {:.6e} N/m on the plane", self.friction)?;
        for (front, rupture) in [("ruptures", true), ("forms again", false)] {
            for i in self.fronts(rupture) {
                let x_front = profile.x[i];
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
    fn drawn(&self, profile: &Profile, arguments: &Arguments) -> [String; 2] {
        let pressures: Vec<f64> = self.p.iter().map(|p| p / arguments.p_unit).collect();
        let units = [(arguments.x_unit, "m"), (arguments.h_unit, "m"), (arguments.p_unit, "Pa")];
        let [x, h, p] = units.map(|(value, base)| unit(value, base));
        let rows: Vec<String> = (0..self.x.len())
            .map(|i| format!("{},{},{},{}", profile.x[i], profile.h[i], pressures[i], self.void[i]))
            .collect();
        let csv = chart::csv(&format!("x ({x}),h ({h}),p ({p}),void fraction"), &rows);

        // No more points than can be seen.
        let thin = self.x.len().div_ceil(600);
        let line = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
            let drawn = (0..self.x.len()).filter(|i| i % thin == 0 || i + 1 == self.x.len());
            drawn.map(|i| (profile.x[i], value(i))).collect()
        };
        let along = (profile.x[0], profile.x[self.x.len() - 1]);
        let highest = |values: &[f64]| values.iter().copied().fold(f64::MIN, f64::max);
        let (low, high) = (arguments.cavitation, highest(&pressures));
        let high = if high > low { high + 0.05 * (high - low) } else { low + 1.0 };
        let axes = [format!("x ({x})"), format!("p ({p})"), format!("h ({h})")];
        let pressure = Panel::new("Pressure", [&axes[0], &axes[1]], along, (low, high)).outline(
            "pressure",
            "#0072B2",
            "",
            &line(&|i| pressures[i]),
        );
        let gaps =
            Panel::new("Film", [&axes[0], &axes[2]], along, (0.0, 1.05 * highest(&profile.h)))
                .outline("gap h", "#000000", "", &line(&|i| profile.h[i]))
                .outline(
                    "filled, (1 − r) h",
                    "#D55E00",
                    "6 4",
                    &line(&|i| (1.0 - self.void[i]) * profile.h[i]),
                );
        let caption = "Reynolds equation with mass-conserving cavitation";
        [chart::svg(2, vec![pressure, gaps], caption), csv]
    }

    /// Holds the pad's peak and rupture against those of the continuous problem.
    fn check(&self, profile: &Profile) -> Result<(), String> {
        // The straight pieces are off the parabola by h″Δx²/8, some (Δx/L)² of the smallest gap;
        // 1e-3 is room.
        let peak = (self.p[self.peak()] / Slider::PEAK - 1.0).abs() <= 1e-3;
        let near = |i: usize| (self.x[i] - Slider::RUPTURE).abs() <= self.x[i] - self.x[i - 1];
        if peak && matches!(self.fronts(true)[..], [i] if near(i)) {
            return Ok(());
        }
        let points = self.fronts(true).iter().map(|&i| profile.x[i]).collect::<Vec<_>>();
        Err(format!("the pad's peak is wrong, or it ruptures at {points:?}"))
    }
}
