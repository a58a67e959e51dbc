//! What is printed about a film in two dimensions.

use std::fmt::{self, Write as _};

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

/// The interval in words.
fn between(interval: Option<[f64; 2]>) -> String {
    let Some(interval) = interval else { return String::new() };
    if interval[0].is_infinite() {
        return ", nothing proved".into();
    }
    let [lower, upper] = print::ends(interval);
    format!(", proved between {lower} and {upper}")
}

/// What there is to say about a film.
pub(super) struct Report<'r> {
    pub(super) bearing: &'r Bearing,
    pub(super) solved: &'r Solved,
    pub(super) figures: FilmFigures,
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
    pub(super) fn load(&self) -> [f64; 3] {
        self.bearing.load(&self.solved.film, &self.figures, &self.solved.z)
    }

    fn status(&self) -> String {
        let status = self.solved.outcome.status;
        if status == Status::Converged && !self.converged {
            return "a step before did not converge".into();
        }
        status.to_string()
    }

    fn imbalance(&self) -> f64 {
        self.run_imbalance.unwrap_or(self.figures.imbalance)
    }

    pub(super) fn caption(&self) -> String {
        let film = &self.solved.film;
        let [load, ..] = self.load();
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
        let [load, x, y] = self.load();
        let sides = |of: &dyn Fn(usize) -> Value, supplies: Value| {
            let side = |k: usize| (film.sides[k] != Side::Periodic).then(|| of(k));
            let [west, east, south, north] = [0, 1, 2, 3].map(side);
            json!({
                "west": west,
                "east": east,
                "south": south,
                "north": north,
                "supplies": supplies,
            })
        };
        let friction = bearing.drag(figures.friction);
        let bounds = self.proved.as_ref().map(|proved| {
            let drag = bearing.proved_drag(proved);
            let supplies = figures.supplies.iter().zip(&proved.supplies);
            let supplies: Vec<f64> = supplies.map(|(flow, ends)| off(*flow, *ends)).collect();
            let flow = |k: usize| json!(off(figures.sides[k], proved.sides[k]));
            let flows = sides(&flow, json!(supplies));
            json!({
                "load_n": off(load, proved.load),
                "friction_moving_n": off(friction[0], drag[0]),
                "friction_fixed_n": off(friction[1], drag[1]),
                "peak_pressure_pa": off(figures.peak, proved.peak),
                "flow_m3_s": flows,
            })
        });
        let range = self.range.as_ref().and_then(|range| range.as_ref().ok()).map(|range| {
            let [moving, fixed] = bearing.proved_drag(range);
            json!({
                "load_n": range.load,
                "friction_moving_n": moving,
                "friction_fixed_n": fixed,
                "peak_pressure_pa": range.peak,
                "flow_m3_s": sides(&|k| json!(range.sides[k]), json!(range.supplies)),
            })
        });
        let [moving, fixed] = friction;
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
        let threshold =
            self.whirl.as_ref().and_then(|whirl| Some((whirl.threshold?, whirl.running)));
        let sensitivities: Option<serde_json::Map<_, _>> =
            self.sensitivities.as_ref().map(|all| all.iter().map(slopes).collect());
        json!({
            "outcome": self.status().replace(' ', "_"),
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
            "critical_mass_kg": threshold.map(|(found, _)| found.mass),
            "whirl_frequency_ratio": threshold.map(|(found, running)| found.omega / running),
            "sensitivities": sensitivities,
            "bounds": bounds,
            "range": range,
            "unknowns": film.gap.len(),
            "seconds": self.seconds,
        })
    }

    pub(super) fn text(&self, arguments: &Arguments) -> Result<String, fmt::Error> {
        let mut text = String::new();
        let (film, figures, outcome) = (&self.solved.film, &self.figures, &self.solved.outcome);
        let [nx, ny, n] = [film.nx, film.ny, film.gap.len()];
        let (solves, seconds) = (self.solves, self.seconds);
        let many = if solves > 1 {
            let what = if arguments.motion.is_some() { "steps" } else { "solves" };
            format!("{solves} {what} in {seconds:.2} s; the last: ")
        } else {
            String::new()
        };
        writeln!(text, "{nx} × {ny} cells, {n} unknowns: {many}{outcome}")?;
        if !self.converged {
            writeln!(text, "not converged, so these are no figures of the film:")?;
        }
        let [load, x, y] = self.load();
        let proved = self.proved.as_ref();
        let within = between(proved.map(|proved| proved.load));
        writeln!(text, "load              {load:.6e} N{within}")?;
        if y.is_nan() {
            writeln!(text, "                  at no point, because it is zero")?;
        } else if self.bearing.journal.is_some() {
            writeln!(text, "                  towards x = {x:.6e} m, its middle at y = {y:.6e} m")?;
        } else {
            writeln!(text, "                  acts at x = {x:.6e} m, y = {y:.6e} m")?;
        }
        if self.bearing.journal.is_none() {
            let [mx, my] = figures.moments;
            writeln!(
                text,
                "moments           {mx:.6e} N m along x, {my:.6e} N m along y, around the middle"
            )?;
        }
        let [one, other] = self.bearing.drag(figures.friction);
        let drag = proved.map(|proved| self.bearing.proved_drag(proved));
        let [of_one, of_other] = [0, 1].map(|wall| between(drag.map(|drag| drag[wall])));
        let next = if drag.is_some() { "\n                  " } else { ", " };
        writeln!(
            text,
            "friction          {one:.6e} N on the moving wall{of_one}{next}{other:.6e} N on the \
             other{of_other}"
        )?;
        if figures.broken_share > 0.0 {
            let [one, other] = self.bearing.drag(figures.full_friction);
            writeln!(
                text,
                "                  {one:.6e} N and {other:.6e} N if all of the gap is sheared, as in \
                 handbooks"
            )?;
        }
        writeln!(text, "power lost        {:.6e} W", figures.power)?;
        let open =
            (0..4).filter(|&k| matches!(film.sides[k], Side::Pressure(_) | Side::Starved(_)));
        let within = |side: usize| between(proved.map(|proved| proved.sides[side]));
        let flows: Vec<String> =
            open.map(|k| format!("{} {:.6e}{}", SIDES[k], figures.sides[k], within(k))).collect();
        // One a line where there is more to say.
        let next = if proved.is_some() { "\n                  " } else { ", " };
        if !flows.is_empty() {
            writeln!(text, "flow out, m³/s    {}", flows.join(next))?;
        }
        if !figures.supplies.is_empty() {
            let within = |k: usize| between(proved.map(|proved| proved.supplies[k]));
            let flows = figures.supplies.iter().enumerate();
            let flows: Vec<String> =
                flows.map(|(k, flow)| format!("{flow:.6e}{}", within(k))).collect();
            writeln!(text, "supplied, m³/s    {}", flows.join(next))?;
        }
        writeln!(text, "mass imbalance    {:.1e} m³/s", self.imbalance())?;
        let within = between(proved.map(|proved| proved.peak));
        writeln!(text, "peak pressure     {:.6e} Pa{within}", figures.peak)?;
        writeln!(text, "least gap         {:.6e} m", figures.least_gap)?;
        writeln!(text, "broken            {:.4} % of the area", 100.0 * figures.broken_share)?;
        if figures.feed.is_finite() {
            let (feed, least) = (figures.feed, figures.least_content);
            writeln!(
                text,
                "feed              {feed:.1e} of the oil that goes round; least content {least:.4}"
            )?;
        }
        self.print_derived(&mut text)?;
        if let Some([ecc, attitude]) = self.bearing.attitude(x) {
            let at =
                if x.is_nan() { "no attitude".into() } else { format!("attitude {attitude:.4}°") };
            writeln!(text, "eccentricity      {ecc:.6} of the clearance, {at}")?;
        } else if arguments.load.is_some() || arguments.motion.is_some() {
            let [rise, along, across] = [0, 1, 2].map(|k| self.bearing.position[k]);
            writeln!(
                text,
                "position          rise {rise:.6e} m, slopes {along:.6e} along x, {across:.6e} along y"
            )?;
        }
        if let Some(found) = &self.coefficients {
            self.print_coefficients(&mut text, found)?;
        }
        if let Some(found) = &self.whirl {
            self.print_whirl(&mut text, found)?;
        }
        if let Some(found) = &self.sensitivities {
            print_sensitivities(&mut text, found, arguments.load.is_some())?;
        }
        match &self.certificate {
            Some(Ok(certificate)) => writeln!(text, "{certificate}")?,
            Some(Err(refusal)) => {
                writeln!(text, "certified error: none, because {refusal}")?;
            }
            None => (),
        }
        match (&self.range, arguments.data_tolerance) {
            (Some(Ok(range)), Some(part)) => self.print_range(&mut text, range, part)?,
            (Some(Err(refusal)), _) => {
                writeln!(text, "nothing is proved within the tolerance, because {refusal}")?;
            }
            _ => (),
        }
        Ok(text)
    }

    fn print_derived(&self, text: &mut String) -> fmt::Result {
        let Derived { specific_load, leakage, temperature_rise, reynolds, laminar, .. } =
            self.derived;
        write!(text, "specific load     {specific_load:.6e} Pa")?;
        if let Some(sommerfeld) = self.derived.sommerfeld {
            write!(text, ", Sommerfeld number {sommerfeld:.6}")?;
        }
        writeln!(text)?;
        if let Some(torque) = self.derived.torque {
            writeln!(text, "torque            {torque:.6e} N m")?;
        }
        if leakage > 0.0 && temperature_rise > 0.0 {
            let Oil { density, heat } = self.oil;
            writeln!(
                text,
                "warmer by         {temperature_rise:.3} K, with {density} kg/m³ and {heat} J/(kg K), \
                 if all power leaves with {leakage:.6e} m³/s"
            )?;
        }
        if reynolds > 0.0 {
            writeln!(text, "Reynolds number   {reynolds:.1}; shear is laminar to {laminar:.0}")?;
        }
        Ok(())
    }

    fn print_range(&self, text: &mut String, range: &ProvedFigures, part: f64) -> fmt::Result {
        let film = &self.solved.film;
        writeln!(
            text,
            "proved for all films whose gap, viscosity, speeds and supplies' pressures, each as a \
             whole, are within {part} of these:"
        )?;
        let to = |[lower, upper]: [f64; 2]| {
            let [lower, upper] =
                [(lower, false), (upper, true)].map(|(end, up)| decimal(end, 6, up));
            format!("{lower} to {upper}")
        };
        let [moving, fixed] = self.bearing.proved_drag(range).map(to);
        writeln!(text, "  load            {} N", to(range.load))?;
        writeln!(text, "  friction        {moving} N on the moving wall")?;
        writeln!(text, "                  {fixed} N on the other")?;
        for (k, name) in SIDES.into_iter().enumerate() {
            if matches!(film.sides[k], Side::Pressure(_) | Side::Starved(_)) {
                writeln!(text, "  flow out, m³/s  {name} {}", to(range.sides[k]))?;
            }
        }
        for supply in &range.supplies {
            writeln!(text, "  supplied, m³/s  {}", to(*supply))?;
        }
        writeln!(text, "  peak pressure   {} Pa", to(range.peak))
    }

    fn print_coefficients(
        &self,
        text: &mut String,
        [own, clamped]: &[Coefficients; 2],
    ) -> fmt::Result {
        let [axes, ..] = self.axes();
        writeln!(text, "coefficients      {axes}; for slow motions, then by the clamp")?;
        if self.figures.broken_share > 0.0 {
            writeln!(
                text,
                "                  the film is broken and takes time to settle; for motions at a \
                 frequency take --whirl"
            )?;
        }
        self.print_matrices(text, &[own, clamped])
    }

    /// Prints the rows of stiffness and damping, one beside the other.
    fn print_matrices(&self, text: &mut String, all: &[&Coefficients]) -> fmt::Result {
        let [_, stiff, damp] = self.axes();
        for (name, unit, is_damping) in [("stiffness", stiff, false), ("damping", damp, true)] {
            let of = |found: &Coefficients, k: usize| {
                row(if is_damping { &found.damping[k] } else { &found.stiffness[k] })
            };
            for k in 0..self.bearing.modes.len() {
                let name = if k == 0 { format!("{name}, {unit}") } else { String::new() };
                let rows: Vec<String> = all.iter().map(|found| of(found, k)).collect();
                writeln!(text, "{name:<16}{}", rows.join("  |"))?;
            }
        }
        Ok(())
    }

    fn print_whirl(&self, text: &mut String, whirl: &Whirl) -> fmt::Result {
        let [axes, ..] = self.axes();
        for (ratio, found) in &whirl.at {
            let omega = ratio * whirl.running;
            writeln!(text, "whirl of {ratio:<9}{axes}; at {omega:.6e} rad/s")?;
            self.print_matrices(text, &[found])?;
        }
        if self.bearing.journal.is_none() {
            return Ok(());
        }
        let told = match whirl.threshold {
            Some(Threshold { mass, omega, .. }) => match (mass > 0.0, omega / whirl.running) {
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
        writeln!(text, "critical mass     {told}")
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

/// The entries of a row of a matrix.
fn row(entries: &[f64]) -> String {
    entries.iter().map(|entry| format!("{entry:>14.6e}")).collect()
}

fn print_sensitivities(text: &mut String, all: &[Slopes], is_carrying: bool) -> fmt::Result {
    let held = if is_carrying { "under this load" } else { "in this position" };
    writeln!(text, "sensitivities     per unit of each, {held}")?;
    // The load that is carried does not change.
    let skip = usize::from(is_carrying);
    let mut heads = vec!["load, N", "friction, N", "power, W", "peak, Pa", "out, m³/s"];
    let is_journal = all.iter().any(|(_, _, found)| found.ecc.is_some());
    heads.extend(if is_journal { &["ecc", "attitude, °"][..] } else { &[] });
    let heads: String = heads.iter().skip(skip).map(|head| format!("{head:>14}")).collect();
    writeln!(text, "{:<18}{heads}", "")?;
    for (name, unit, found) in all {
        let name = if unit.is_empty() { name.clone() } else { format!("{name}, {unit}") };
        let slopes = &found.slopes;
        let out = slopes.sides.iter().sum::<f64>();
        let figures = [slopes.load, slopes.friction[0], slopes.power, slopes.peak, out];
        let angles = found.ecc.into_iter().chain(found.attitude);
        let figures: String =
            figures.into_iter().chain(angles).skip(skip).map(|v| format!("{v:>14.6e}")).collect();
        writeln!(text, "{name:<18}{figures}")?;
    }
    Ok(())
}
