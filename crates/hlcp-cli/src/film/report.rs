//! What is printed about a film in two dimensions.

use std::fmt::Display;

use hlcp::{
    Status,
    film::{
        Bearing, Coefficients, Derived, FilmFigures, Oil, ProvedFigures, Side, Solved, Threshold,
    },
};
use hlcp_verify::{Certificate, Refusal, decimal};
use serde_json::{Value, json};

use super::{
    Arguments,
    gap::SIDES,
    plane::{Slopes, Whirl},
};
use crate::print;

/// How far a printed number may be off one in the interval.
fn off(printed: f64, [lower, upper]: [f64; 2]) -> f64 {
    (upper - printed).max(printed - lower).next_up()
}

fn between(interval: Option<[f64; 2]>) -> String {
    let Some(interval) = interval else { return String::new() };
    if interval[0].is_infinite() {
        return ", nothing proved".into();
    }
    let [lower, upper] = print::ends(interval);
    format!(", proved between {lower} and {upper}")
}

pub(super) struct Report<'r> {
    pub(super) bearing: &'r Bearing,
    pub(super) solved: &'r Solved,
    pub(super) figures: FilmFigures,
    /// The load, and where it acts along x and y.
    pub(super) load: [f64; 3],
    pub(super) derived: Derived,
    pub(super) oil: Oil,
    pub(super) solves: usize,
    pub(super) converged: bool,
    /// Mass-conserving, and by the clamp.
    pub(super) coefficients: Option<[Coefficients; 2]>,
    pub(super) whirl: Option<Whirl>,
    pub(super) sensitivities: Option<Vec<Slopes>>,
    pub(super) certificate: Option<Result<Certificate, Refusal>>,
    pub(super) proved: Option<ProvedFigures>,
    /// Of all films within --data-tolerance.
    pub(super) range: Option<Result<ProvedFigures, Refusal>>,
    /// Of a motion, over the whole run.
    pub(super) run_imbalance: Option<f64>,
    pub(super) seconds: f64,
}

impl Report<'_> {
    /// The least gap between walls of a known shape, texture left out.
    fn nearest(&self) -> Option<f64> {
        self.bearing.nearest(&self.bearing.position).map(|[gap, _]| gap)
    }

    fn imbalance(&self) -> f64 {
        self.run_imbalance.unwrap_or(self.figures.imbalance)
    }

    pub(super) fn caption(&self) -> String {
        let film = &self.solved.film;
        let [load, ..] = self.load;
        format!(
            "{}{} × {} cells; load {load:.4e} N, peak {:.4e} Pa, least gap {:.4e} m; {:.1} % of the film is broken, within the line",
            if self.converged { "" } else { "not converged: " },
            film.nx,
            film.ny,
            self.figures.peak,
            self.figures.least_gap,
            100.0 * self.figures.broken_share
        )
    }

    pub(super) fn json(&self) -> Value {
        let (film, figures, bearing) = (&self.solved.film, &self.figures, self.bearing);
        let [load, x, y] = self.load;
        let sides = |of: &dyn Fn(usize) -> Value, supplies: Value| -> Value {
            let side = |k: usize| if film.sides[k] == Side::Periodic { Value::Null } else { of(k) };
            let sides = SIDES.iter().enumerate().map(|(k, name)| (*name, side(k)));
            sides.chain([("supplies", supplies)]).collect()
        };
        let [moving, fixed] = bearing.drag(figures.friction);
        // What is proved of each figure, as `told`.
        let all = |proved: &ProvedFigures, told: fn(f64, [f64; 2]) -> Value| {
            let drag = bearing.proved_drag(proved);
            let supplies = figures.supplies.iter().zip(&proved.supplies);
            let supplies = supplies.map(|(flow, ends)| told(*flow, *ends)).collect();
            json!({
                "load_n": told(load, proved.load),
                "friction_moving_n": told(moving, drag[0]),
                "friction_fixed_n": told(fixed, drag[1]),
                "peak_pressure_pa": told(figures.peak, proved.peak),
                "flow_m3_s": sides(&|k| told(figures.sides[k], proved.sides[k]), supplies),
            })
        };
        let bounds =
            self.proved.as_ref().map(|proved| all(proved, |found, ends| json!(off(found, ends))));
        let range = self.range.as_ref().and_then(|range| range.as_ref().ok());
        let range = range.map(|range| all(range, |_, ends| json!(ends)));
        let [full_moving, full_fixed] = bearing.drag(figures.full_friction);
        let [ecc, attitude] = bearing.attitude(x).map_or([None; 2], |pair| pair.map(Some));
        let found = self.coefficients.as_ref();
        let slopes = |(name, _, found): &Slopes| {
            let slopes = &found.slopes;
            let flows = sides(&|k| json!(slopes.sides[k]), json!(slopes.supplies));
            let figures = json!({
                "load_n": slopes.load,
                "forces": found.forces,
                "friction_moving_n": slopes.friction[0],
                "friction_fixed_n": slopes.friction[1],
                "full_friction_moving_n": slopes.full_friction[0],
                "full_friction_fixed_n": slopes.full_friction[1],
                "power_w": slopes.power,
                "flow_m3_s": flows,
                "peak_pressure_pa": slopes.peak,
                "position": found.position,
                "ecc": found.ecc,
                "attitude_deg": found.attitude,
            });
            (name.clone(), figures)
        };
        let at = |(ratio, found): &(f64, Coefficients)| {
            json!({
                "ratio": ratio,
                "stiffness_n_m": found.stiffness,
                "damping_n_s_m": found.damping,
            })
        };
        let whirl: Option<Vec<Value>> =
            self.whirl.as_ref().map(|whirl| whirl.at.iter().map(at).collect());
        let threshold = self.whirl.as_ref().and_then(|whirl| whirl.threshold);
        let sensitivities: Option<serde_json::Map<_, _>> =
            self.sensitivities.as_ref().map(|all| all.iter().map(slopes).collect());
        let outcome = match self.solved.outcome.status {
            Status::Converged if !self.converged => "a step before did not converge".into(),
            status => status.to_string(),
        };
        let mut all = json!({
            "outcome": outcome.replace(' ', "_"),
            "converged": self.converged,
            "load_n": load,
            "load_x_m": x,
            "load_y_m": y,
            "moments_n_m": figures.moments,
            "friction_moving_n": moving,
            "friction_fixed_n": fixed,
            "full_friction_moving_n": full_moving,
            "full_friction_fixed_n": full_fixed,
            "power_w": figures.power,
            "specific_load_pa": self.derived.specific_load,
            "sommerfeld": self.derived.sommerfeld,
            "torque_n_m": self.derived.torque,
            "leakage_m3_s": self.derived.leakage,
            "temperature_rise_k": self.derived.temperature_rise,
            "reynolds": self.derived.reynolds,
            "reynolds_laminar": self.derived.laminar,
            "flow_m3_s": sides(&|k| json!(figures.sides[k]), json!(figures.supplies)),
            "mass_imbalance_m3_s": self.imbalance(),
            "peak_pressure_pa": figures.peak,
            "least_gap_m": figures.least_gap,
            "broken_share": figures.broken_share,
            "least_content": figures.least_content,
            "feed": figures.feed,
            "doubt": figures.doubt(),
            "ecc": ecc,
            "attitude_deg": attitude,
            "position": bearing.journal.is_none().then_some(&bearing.position),
            "stiffness_n_m": found.map(|[own, _]| &own.stiffness),
            "damping_n_s_m": found.map(|[own, _]| &own.damping),
            "stiffness_clamp_n_m": found.map(|[_, clamped]| &clamped.stiffness),
            "damping_clamp_n_s_m": found.map(|[_, clamped]| &clamped.damping),
            "whirl": whirl,
            "critical_mass_kg": threshold.map(|found| found.mass),
            "whirl_frequency_ratio": threshold.map(|found| found.omega / bearing.running_speed()),
            "sensitivities": sensitivities,
            "bounds": bounds,
            "range": range,
            "unknowns": film.gap.len(),
            "seconds": self.seconds,
        });
        all["nearest_gap_m"] = json!(self.nearest());
        all
    }

    pub(super) fn text(&self, arguments: &Arguments) -> String {
        let mut text = Lines::default();
        let (film, figures, outcome) = (&self.solved.film, &self.figures, &self.solved.outcome);
        let [nx, ny, n] = [film.nx, film.ny, film.gap.len()];
        let (solves, seconds) = (self.solves, self.seconds);
        let what = if arguments.motion.is_some() { "steps" } else { "solves" };
        let many = format!("{solves} {what} in {seconds:.2} s; the last: ");
        let many = if solves > 1 { many } else { String::new() };
        text.say(format!("{nx} × {ny} cells, {n} unknowns: {many}{outcome}"));
        if !self.converged {
            text.say("not converged, so these are no figures of the film:");
        }
        let ([load, x, y], proved) = (self.load, self.proved.as_ref());
        let is_journal = self.bearing.journal.is_some();
        let within = between(proved.map(|proved| proved.load));
        text.add("load", format!("{load:.6e} N{within}"));
        let place = match (y.is_nan(), is_journal) {
            (true, _) => "at no point, because it is zero".into(),
            (_, true) => format!("towards x = {x:.6e} m, its middle at y = {y:.6e} m"),
            (_, false) => format!("acts at x = {x:.6e} m, y = {y:.6e} m"),
        };
        text.add("", place);
        if !is_journal {
            let [mx, my] = figures.moments;
            let around = format!("{mx:.6e} N m along x, {my:.6e} N m along y, around the middle");
            text.add("moments", around);
        }
        let [one, other] = self.bearing.drag(figures.friction);
        let drag = proved.map(|proved| self.bearing.proved_drag(proved));
        let [of_one, of_other] = [0, 1].map(|wall| between(drag.map(|drag| drag[wall])));
        // One a line where there is more to say.
        let next = if proved.is_some() { "\n                  " } else { ", " };
        let on_moving = format!("{one:.6e} N on the moving wall{of_one}");
        text.add("friction", format!("{on_moving}{next}{other:.6e} N on the other{of_other}"));
        if figures.broken_share > 0.0 {
            let [one, other] = self.bearing.drag(figures.full_friction);
            let full = "if all of the gap is sheared, as in handbooks";
            text.add("", format!("{one:.6e} N and {other:.6e} N {full}"));
        }
        text.add("power lost", format!("{:.6e} W", figures.power));
        let flow = |name: &str, flow: f64, ends: Option<[f64; 2]>| {
            format!("{name}{flow:.6e}{}", between(ends))
        };
        let of_side = |k: usize| {
            let ends = proved.map(|proved| proved.sides[k]);
            flow(&format!("{} ", SIDES[k]), figures.sides[k], ends)
        };
        let flows: Vec<String> = self.open_sides().map(of_side).collect();
        if !flows.is_empty() {
            text.add("flow out, m³/s", flows.join(next));
        }
        if !figures.supplies.is_empty() {
            let of_supply = |k| flow("", figures.supplies[k], proved.map(|of| of.supplies[k]));
            let flows: Vec<String> = (0..figures.supplies.len()).map(of_supply).collect();
            text.add("supplied, m³/s", flows.join(next));
        }
        text.add("mass imbalance", format!("{:.1e} m³/s", self.imbalance()));
        let within = between(proved.map(|proved| proved.peak));
        text.add("peak pressure", format!("{:.6e} Pa{within}", figures.peak));
        let closer = self.nearest().filter(|&gap| gap < figures.least_gap);
        let closer = closer.map_or(String::new(), |gap| {
            format!(" in the middle of a cell, {gap:.6e} m at the edges or between")
        });
        text.add("least gap", format!("{:.6e} m{closer}", figures.least_gap));
        text.add("broken", format!("{:.4} % of the area", 100.0 * figures.broken_share));
        if figures.feed.is_finite() {
            let (feed, least) = (figures.feed, figures.least_content);
            let goes_round = format!("{feed:.1e} of the oil that goes round");
            text.add("feed", format!("{goes_round}; least content {least:.4}"));
        }
        self.add_derived(&mut text);
        if let Some([ecc, attitude]) = self.bearing.attitude(x) {
            let at =
                if x.is_nan() { "no attitude".into() } else { format!("attitude {attitude:.4}°") };
            text.add("eccentricity", format!("{ecc:.6} of the clearance, {at}"));
        } else if arguments.load.is_some() || arguments.motion.is_some() {
            let [rise, along, across] = [0, 1, 2].map(|k| self.bearing.position[k]);
            let slopes = format!("slopes {along:.6e} along x, {across:.6e} along y");
            text.add("position", format!("rise {rise:.6e} m, {slopes}"));
        }
        if let Some([own, clamped]) = &self.coefficients {
            let [axes, ..] = self.axes();
            text.add("coefficients", format!("{axes}; for slow motions, then by the clamp"));
            if self.figures.broken_share > 0.0 {
                let settles = "the film is broken and takes time to settle; for motions at a \
                               frequency take --whirl";
                text.add("", settles);
            }
            self.add_matrices(&mut text, &[own, clamped]);
        }
        if let Some(found) = &self.whirl {
            self.add_whirl(&mut text, found);
        }
        if let Some(found) = &self.sensitivities {
            add_sensitivities(&mut text, found, arguments.load.is_some());
        }
        match &self.certificate {
            Some(Ok(certificate)) => {
                text.say(certificate);
                text.say(format!(
                    "proved of the equations on these {nx} × {ny} cells; finer cells tell what is \
                     left to the film itself"
                ));
            }
            Some(Err(refusal)) => text.say(format!("certified error: none, because {refusal}")),
            None => (),
        }
        match (&self.range, arguments.data_tolerance) {
            (Some(Ok(range)), Some(part)) => self.add_range(&mut text, range, part),
            (Some(Err(refusal)), _) => {
                text.say(format!("nothing is proved within the tolerance, because {refusal}"));
            }
            _ => (),
        }
        text.0
    }

    /// The sides through which something flows that is told.
    fn open_sides(&self) -> impl Iterator<Item = usize> {
        let sides = &self.solved.film.sides;
        (0..4).filter(|&k| matches!(sides[k], Side::Pressure(_) | Side::Starved(_)))
    }

    fn add_derived(&self, text: &mut Lines) {
        let Derived { specific_load, leakage, temperature_rise, reynolds, laminar, .. } =
            self.derived;
        let number = self.derived.sommerfeld;
        let number = number.map_or(String::new(), |s| format!(", Sommerfeld number {s:.6}"));
        text.add("specific load", format!("{specific_load:.6e} Pa{number}"));
        if let Some(torque) = self.derived.torque {
            text.add("torque", format!("{torque:.6e} N m"));
        }
        if leakage > 0.0 && temperature_rise > 0.0 {
            let Oil { density, heat } = self.oil;
            let oil = format!("{density} kg/m³ and {heat} J/(kg K)");
            let leaves = format!("if all power leaves with {leakage:.6e} m³/s");
            text.add("warmer by", format!("{temperature_rise:.3} K, with {oil}, {leaves}"));
        }
        if reynolds > 0.0 {
            text.add("Reynolds number", format!("{reynolds:.1}; shear is laminar to {laminar:.0}"));
        }
    }

    fn add_range(&self, text: &mut Lines, range: &ProvedFigures, part: f64) {
        text.say(format!(
            "proved on these cells for all films whose gap, viscosity, speeds and supplies' \
             pressures, each as a whole, are within {part} of these:"
        ));
        let to = |[lower, upper]: [f64; 2]| {
            format!("{} to {}", decimal(lower, 6, false), decimal(upper, 6, true))
        };
        let [moving, fixed] = self.bearing.proved_drag(range).map(to);
        text.add("  load", format!("{} N", to(range.load)));
        text.add("  friction", format!("{moving} N on the moving wall"));
        text.add("", format!("{fixed} N on the other"));
        for k in self.open_sides() {
            text.add("  flow out, m³/s", format!("{} {}", SIDES[k], to(range.sides[k])));
        }
        range.supplies.iter().for_each(|supply| text.add("  supplied, m³/s", to(*supply)));
        text.add("  peak pressure", format!("{} Pa", to(range.peak)));
    }

    /// Adds the rows of stiffness and damping, one beside the other.
    fn add_matrices(&self, text: &mut Lines, all: &[&Coefficients]) {
        let [_, stiff, damp] = self.axes();
        for (name, unit, is_damping) in [("stiffness", stiff, false), ("damping", damp, true)] {
            let of = |found: &&Coefficients, k: usize| {
                entries(if is_damping { &found.damping[k] } else { &found.stiffness[k] })
            };
            for k in 0..self.bearing.modes.len() {
                let name = if k == 0 { format!("{name}, {unit}") } else { String::new() };
                let rows: Vec<String> = all.iter().map(|found| of(found, k)).collect();
                text.say(format!("{name:<16}{}", rows.join("  |")));
            }
        }
    }

    fn add_whirl(&self, text: &mut Lines, whirl: &Whirl) {
        let ([axes, ..], running) = (self.axes(), self.bearing.running_speed());
        for (ratio, found) in &whirl.at {
            let omega = ratio * running;
            text.add(&format!("whirl of {ratio}"), format!("{axes}; at {omega:.6e} rad/s"));
            self.add_matrices(text, &[found]);
        }
        if self.bearing.journal.is_none() {
            return;
        }
        let told = match whirl.threshold {
            Some(Threshold { mass, omega, .. }) => match (mass > 0.0, omega / running) {
                (true, ratio) => format!(
                    "{mass:.6e} kg on this bearing; a heavier rotor whirls at {ratio:.6} of the \
                     running speed"
                ),
                (false, 0.0) => {
                    "0 kg: the film pushes a rotor of any mass away (static instability)".into()
                }
                (false, ratio) => format!(
                    "0 kg: a rotor of any mass whirls, a light one at about {ratio:.3} of the \
                     running speed"
                ),
            },
            None => "none was found up to twice the running speed".into(),
        };
        text.add("critical mass", told);
    }

    /// The coordinates of coefficients, and the units of stiffness and damping.
    fn axes(&self) -> [&'static str; 3] {
        if self.bearing.journal.is_some() {
            ["along the load and across it", "N/m", "N s/m"]
        } else {
            ["rise in m, slopes along x and y; forces in N and N m", "N/m …", "N s/m …"]
        }
    }
}

/// The lines of a report.
#[derive(Default)]
pub(super) struct Lines(pub(super) String);

impl Lines {
    pub(super) fn say(&mut self, line: impl Display) {
        self.0 += &format!("{line}\n");
    }

    /// Adds what stands in a column of its own behind a name.
    pub(super) fn add(&mut self, name: &str, told: impl Display) {
        self.say(format_args!("{name:<18}{told}"));
    }
}

fn entries<'e>(entries: impl IntoIterator<Item = &'e f64>) -> String {
    entries.into_iter().map(|entry| format!("{entry:>14.6e}")).collect()
}

fn add_sensitivities(text: &mut Lines, all: &[Slopes], is_carrying: bool) {
    let held = if is_carrying { "under this load" } else { "in this position" };
    text.add("sensitivities", format!("per unit of each, {held}"));
    // The load that is carried does not change.
    let skip = usize::from(is_carrying);
    let mut heads = vec!["load, N", "friction, N", "power, W", "peak, Pa", "out, m³/s"];
    let is_journal = all.iter().any(|(_, _, found)| found.ecc.is_some());
    heads.extend(if is_journal { &["ecc", "attitude, °"][..] } else { &[] });
    let heads: String = heads.iter().skip(skip).map(|head| format!("{head:>14}")).collect();
    text.add("", heads);
    for (name, unit, found) in all {
        let name = if unit.is_empty() { name.clone() } else { format!("{name}, {unit}") };
        let slopes = &found.slopes;
        let out = slopes.sides.iter().sum::<f64>();
        let figures = [slopes.load, slopes.friction[0], slopes.power, slopes.peak, out];
        let all = figures.iter().chain(&found.ecc).chain(&found.attitude);
        text.add(&name, entries(all.skip(skip)));
    }
}
