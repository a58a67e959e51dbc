//! `hlcp film` in two dimensions: what is solved, written and printed.

use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use hlcp_core::files;
use hlcp_methods::{Named, Parameters, Status};
use hlcp_verify::{Certificate, Film, FilmFigures, Refusal, Side};
use serde_json::{Value, json};

use super::{
    Arguments, Viscosity, array,
    balance::{Coefficients, METHOD, Solved, equilibrium},
    doubt,
    gap::Posed,
    motion, picture,
};
use crate::{print, say};

/// Solves for the film, writes its pictures and numbers, and prints its figures; whether all of it
/// converged.
pub(super) fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    let threads = arguments.threads.unwrap_or(1);
    if threads == 1 {
        return solve(arguments);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build()?;
    Ok(pool.install(|| solve(arguments).map_err(|error| error.to_string()))?)
}

fn solve(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    let begun = Instant::now();
    Named::parse(arguments.method.as_deref().unwrap_or(METHOD), Parameters::default())?;
    let mut posed = Posed::new(arguments)?;
    if arguments.motion.is_none() {
        let first = posed.here();
        refuse_rest(&first, arguments)?;
        if !first.is_fed() {
            return dry(&posed, &first, arguments, begun);
        }
    }
    let outputs = outputs(arguments)?;
    let mut steps = None;
    let (solved, solves, converged, coefficients) = if let Some(path) = &arguments.motion {
        let run = motion::run(path, &mut posed, arguments, |posed, film, found, z| {
            let [load, x, y] = load(posed, film, found, z);
            [load, x, y, moving(film, found), fixed(film, found), found.power]
        })?;
        steps = Some((run.csv, run.imbalance));
        (run.solved, run.steps, run.all_converged, None)
    } else {
        let (solved, solves) = equilibrium(&mut posed, arguments)?;
        let frame = posed.journal.map(|_| {
            let forces = posed.forces(&solved.film, &solved.z);
            let own = forces[1].atan2(forces[0]);
            let angle = arguments.attitude.map_or(own, |_| posed.load_direction(arguments));
            [angle.cos(), angle.sin()]
        });
        let converged = solved.outcome.converged();
        let coefficients = if arguments.coefficients && converged {
            Some(Coefficients::new(&posed, &solved, frame, arguments)?)
        } else {
            None
        };
        (solved, solves, converged, coefficients)
    };
    let certificate = arguments.certify.then(|| solved.certificate()).transpose()?;
    let report = Report {
        posed: &posed,
        figures: solved.film.figures(&solved.z, &solved.r, posed.ambient),
        solved: &solved,
        solves,
        converged,
        coefficients,
        certificate,
        run_imbalance: steps.as_ref().map(|(_, imbalance)| *imbalance),
        seconds: begun.elapsed().as_secs_f64(),
    };

    // Before anything is printed, because a reader that goes away ends the program.
    let (film, nx) = (&solved.film, solved.film.nx);
    let pressures = film.pressures(&solved.z);
    let contents: Vec<f64> = solved.r.iter().map(|r| 1.0 - r).collect();
    let mut texts = vec![
        picture::drawn(&solved, arguments, &report.caption()).into_bytes(),
        array::csv(nx, &pressures),
        array::to_npy(nx, &pressures),
        array::csv(nx, &contents),
        array::to_npy(nx, &contents),
    ];
    texts.extend(steps.map(|(csv, _)| csv.into_bytes()));
    let pairs: Vec<(&Path, Vec<u8>)> = outputs.iter().map(PathBuf::as_path).zip(texts).collect();
    files::write_together(&pairs, |text, file| file.write_all(text))?;

    if arguments.json {
        print::line(report.json())?;
    } else {
        report.print(arguments)?;
        let names: Vec<String> =
            outputs.iter().map(|path| files::printable(path.display())).collect();
        print::line(format_args!("wrote {}", names.join(", ")))?;
    }
    if report.figures.peak <= film.cavitation && arguments.motion.is_none() {
        say("warning: the film carries nothing, because its pressure is that of cavitation \
             everywhere; oil moves along x where --speed is positive, and builds up pressure where \
             the gap narrows that way: turn the gap round, or change the sign of --speed");
    }
    doubt(report.figures.least_gap, &film.lengths, report.figures.peak);
    Ok(converged)
}

/// The files that are written, in folders that exist and other than those that are read.
fn outputs(arguments: &Arguments) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut ends = vec![".svg", "-pressure.csv", "-pressure.npy", "-content.csv", "-content.npy"];
    if arguments.motion.is_some() {
        ends.push("-motion.csv");
    }
    let with = |end: &&str| {
        let mut name = arguments.out.clone();
        name.as_mut_os_string().push(end);
        name
    };
    let outputs: Vec<PathBuf> = ends.iter().map(with).collect();
    let viscosity = match &arguments.viscosity {
        Some(Viscosity::Map(path)) => Some(path),
        _ => None,
    };
    let inputs = [
        ("--map", arguments.map.as_ref()),
        ("--roughness", arguments.roughness.as_ref()),
        ("--viscosity", viscosity),
        ("--motion", arguments.motion.as_ref()),
    ];
    for output in &outputs {
        for (option, input) in inputs {
            if input.is_some_and(|input| files::same_file(output, input)) {
                let output = files::printable(output.display());
                return Err(format!(
                    "--out would overwrite the file of {option}, {output}; give another name"
                )
                .into());
            }
        }
    }
    if let Some(folder) = outputs[0].parent() {
        fs::create_dir_all(folder)
            .map_err(|e| format!("{}: {e}", files::printable(folder.display())))?;
    }
    outputs.iter().try_for_each(|path| files::check_output(path))?;
    Ok(outputs)
}

/// Refuses a film in which nothing happens.
fn refuse_rest(film: &Film, arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let mut pressures = vec![];
    for side in film.sides {
        match side {
            Side::Pressure(pressure) => pressures.push(pressure),
            Side::Starved(_) => pressures.push(film.cavitation),
            Side::Closed | Side::Periodic => {}
        }
    }
    pressures.extend(film.supplies.iter().map(|supply| supply.pressure));
    let rests = film.speeds.iter().sum::<f64>() == 0.0;
    let Some(&first) = pressures.first() else { return Ok(()) };
    if rests && pressures.iter().all(|&pressure| pressure == first) {
        let p = first / arguments.p_unit;
        return Err(format!("nothing drives the film: the walls carry nothing and all pressures are {p}, so that is the pressure everywhere; give --speed or --motion").into());
    }
    Ok(())
}

/// Says that a film runs dry.
fn dry(
    posed: &Posed,
    film: &Film,
    arguments: &Arguments,
    begun: Instant,
) -> Result<bool, Box<dyn Error>> {
    let is_open = film.sides.iter().any(|side| matches!(side, Side::Pressure(_)));
    let mut ways = vec![];
    if posed.journal.is_some() {
        ways.push("--groove 0,2e5");
    }
    ways.push(if is_open { "--ambient 101325" } else { "--side south=101325" });
    let fed = format!(
        "feed it above the pressure of --cavitation, by {} or --supply (pressures in units of \
         --p-unit)",
        ways.join(", ")
    );
    if let Some(load) = &arguments.load {
        let load = files::number(load.0[0]);
        return Err(format!("--load: nothing feeds this film, so it runs dry and carries 0 N instead of {load} N; {fed}").into());
    }
    let n = film.gap.len();
    let figures = film.figures(&vec![0.0; n], &vec![1.0; n], film.cavitation);
    if arguments.json {
        let mut object = figures_json(posed, film, &figures, [0.0, f64::NAN, f64::NAN]);
        object["outcome"] = json!("converged");
        object["seconds"] = json!(begun.elapsed().as_secs_f64());
        print::line(object)?;
    } else {
        print::line(format!(
            "nothing feeds this film, so it runs dry: z = 0 and r = 1 everywhere; {fed}"
        ))?;
    }
    Ok(true)
}

/// The load and where it acts: of a journal its place around the bearing and along it.
fn load(posed: &Posed, film: &Film, figures: &FilmFigures, z: &[f64]) -> [f64; 3] {
    let [lx, ly] = film.lengths;
    let Some([_, radius]) = posed.journal else {
        let at = |moment: f64, length: f64| length / 2.0 + moment / figures.load;
        return [figures.load, at(figures.moments[0], lx), at(figures.moments[1], ly)];
    };
    let forces = posed.forces(film, z);
    let angle = forces[1].atan2(forces[0]);
    let load = forces[0].hypot(forces[1]);
    let (mut moment, p) = (0.0, film.pressures(z));
    for (k, p) in p.iter().enumerate() {
        let along = posed.modes[0][k] * angle.cos() + posed.modes[1][k] * angle.sin();
        let y = ((k / film.nx) as f64 + 0.5) / film.ny as f64 * ly;
        moment += (p - posed.ambient) * along * y * film.cell();
    }
    [load, radius * angle.rem_euclid(std::f64::consts::TAU), moment / load]
}

/// The drag against the motion on the wall that moves the faster, and on the other one.
fn moving(film: &Film, figures: &FilmFigures) -> f64 {
    let [lower, upper] = film.speeds;
    if lower.abs() >= upper.abs() {
        figures.friction[0] * sign(lower)
    } else {
        -figures.friction[1] * sign(upper)
    }
}

fn fixed(film: &Film, figures: &FilmFigures) -> f64 {
    let [lower, upper] = film.speeds;
    if lower.abs() >= upper.abs() {
        figures.friction[1] * sign(lower)
    } else {
        -figures.friction[0] * sign(upper)
    }
}

fn sign(speed: f64) -> f64 {
    if speed < 0.0 { -1.0 } else { 1.0 }
}

/// The figures that every film has, under the names of the command line.
fn figures_json(
    posed: &Posed,
    film: &Film,
    figures: &FilmFigures,
    [load, x, y]: [f64; 3],
) -> Value {
    let side = |k: usize| match film.sides[k] {
        Side::Periodic => Value::Null,
        _ => json!(figures.sides[k]),
    };
    let [ecc, attitude] = eccentricity(posed, x).map_or([None; 2], |pair| pair.map(Some));
    json!({
        "outcome": null,
        "load_n": load,
        "load_x_m": x,
        "load_y_m": y,
        "moments_n_m": figures.moments,
        "friction_moving_n": moving(film, figures),
        "friction_fixed_n": fixed(film, figures),
        "power_w": figures.power,
        "flow_m3_s": {
            "west": side(0),
            "east": side(1),
            "south": side(2),
            "north": side(3),
            "supplies": figures.supplies,
        },
        "mass_imbalance_m3_s": figures.imbalance,
        "peak_pressure_pa": figures.peak,
        "least_gap_m": figures.least_gap,
        "broken_share": figures.broken_share,
        "ecc": ecc,
        "attitude_deg": attitude,
        "position": posed.journal.is_none().then_some(&posed.position),
        "stiffness_n_m": null,
        "damping_n_s_m": null,
        "stiffness_clamp_n_m": null,
        "damping_clamp_n_s_m": null,
        "bounds": null,
        "unknowns": film.gap.len(),
        "seconds": null,
    })
}

/// Of a journal the eccentricity and the attitude, in degrees, for a load that acts at `x`.
fn eccentricity(posed: &Posed, x: f64) -> Option<[f64; 2]> {
    let [clearance, radius] = posed.journal?;
    let [a, b] = [posed.position[0], posed.position[1]];
    let turn = (-b).atan2(-a) - x / radius;
    let attitude = posed.direction() * turn.sin().atan2(turn.cos()).to_degrees();
    Some([a.hypot(b) / clearance, attitude])
}

/// What there is to say about a film.
struct Report<'r> {
    posed: &'r Posed,
    solved: &'r Solved,
    figures: FilmFigures,
    solves: usize,
    converged: bool,
    coefficients: Option<Coefficients>,
    certificate: Option<Result<Certificate, Refusal>>,
    /// Of a motion, over the whole run.
    run_imbalance: Option<f64>,
    seconds: f64,
}

impl Report<'_> {
    fn load(&self) -> [f64; 3] {
        load(self.posed, &self.solved.film, &self.figures, &self.solved.z)
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

    fn caption(&self) -> String {
        let film = &self.solved.film;
        let [load, ..] = self.load();
        format!(
            "{} × {} cells; load {load:.4e} N, peak {:.4e} Pa, least gap {:.4e} m; {:.1} % of the film is broken, within the line",
            film.nx,
            film.ny,
            self.figures.peak,
            self.figures.least_gap,
            100.0 * self.figures.broken_share
        )
    }

    /// Bounds on the errors of the load, the peak and the flow through each side, from those on z
    /// and r.
    fn bounds(&self) -> Option<[f64; 3]> {
        let certificate = self.certificate.as_ref()?.as_ref().ok()?;
        let film = &self.solved.film;
        let unit = film.pressure_unit();
        let load = certificate.z.iter().sum::<f64>() * unit * film.cell();
        let peak = certificate.z.iter().copied().fold(0.0, f64::max) * unit;
        Some([load, peak, film.flow_bound(&certificate.z, &certificate.r)])
    }

    fn json(&self) -> Value {
        let mut object = figures_json(self.posed, &self.solved.film, &self.figures, self.load());
        object["outcome"] = json!(self.status().replace(' ', "_"));
        object["seconds"] = json!(self.seconds);
        object["mass_imbalance_m3_s"] = json!(self.imbalance());
        if let Some(found) = &self.coefficients {
            object["stiffness_n_m"] = json!(found.stiffness);
            object["damping_n_s_m"] = json!(found.damping);
            object["stiffness_clamp_n_m"] = json!(found.clamped[0]);
            object["damping_clamp_n_s_m"] = json!(found.clamped[1]);
        }
        if let Some([load, peak, flow]) = self.bounds() {
            object["bounds"] =
                json!({ "load_n": load, "peak_pressure_pa": peak, "flow_m3_s": flow });
        }
        object
    }

    fn print(&self, arguments: &Arguments) -> Result<(), Box<dyn Error>> {
        let (film, figures, outcome) = (&self.solved.film, &self.figures, &self.solved.outcome);
        let [nx, ny, n] = [film.nx, film.ny, film.gap.len()];
        let (solves, seconds) = (self.solves, self.seconds);
        let many = if solves > 1 {
            let what = if arguments.motion.is_some() { "steps" } else { "solves" };
            format!("{solves} {what} in {seconds:.2} s; the last: ")
        } else {
            String::new()
        };
        print::line(format_args!("{nx} × {ny} cells, {n} unknowns: {many}{outcome}"))?;
        let [load, x, y] = self.load();
        let bounds = self.bounds();
        let within = |k: usize, unit: &str| {
            bounds
                .map_or(String::new(), |bounds| format!(", certified to {:.1e} {unit}", bounds[k]))
        };
        print::line(format_args!("load              {load:.6e} N{}", within(0, "N")))?;
        if y.is_nan() {
            print::line("                  at no point, because it is zero")?;
        } else if self.posed.journal.is_some() {
            print::line(format_args!(
                "                  towards x = {x:.6e} m, its middle at y = {y:.6e} m"
            ))?;
        } else {
            print::line(format_args!("                  acts at x = {x:.6e} m, y = {y:.6e} m"))?;
        }
        if self.posed.journal.is_none() {
            let [mx, my] = figures.moments;
            print::line(format_args!(
                "moments           {mx:.6e} N m along x, {my:.6e} N m along y, around the middle"
            ))?;
        }
        let [one, other] = [moving(film, figures), fixed(film, figures)];
        print::line(format_args!(
            "friction          {one:.6e} N on the moving wall, {other:.6e} N on the other"
        ))?;
        print::line(format_args!("power lost        {:.6e} W", figures.power))?;
        let names = ["west", "east", "south", "north"];
        let open =
            (0..4).filter(|&k| matches!(film.sides[k], Side::Pressure(_) | Side::Starved(_)));
        let flows: Vec<String> =
            open.map(|k| format!("{} {:.6e}", names[k], figures.sides[k])).collect();
        if !flows.is_empty() {
            print::line(format_args!(
                "flow out, m³/s    {}{}",
                flows.join(", "),
                within(2, "m³/s")
            ))?;
        }
        if !figures.supplies.is_empty() {
            let flows: Vec<String> =
                figures.supplies.iter().map(|flow| format!("{flow:.6e}")).collect();
            print::line(format_args!("supplied, m³/s    {}", flows.join(", ")))?;
        }
        print::line(format_args!("mass imbalance    {:.1e} m³/s", self.imbalance()))?;
        print::line(format_args!("peak pressure     {:.6e} Pa{}", figures.peak, within(1, "Pa")))?;
        print::line(format_args!("least gap         {:.6e} m", figures.least_gap))?;
        print::line(format_args!(
            "broken            {:.4} % of the area",
            100.0 * figures.broken_share
        ))?;
        if let Some([ecc, attitude]) = eccentricity(self.posed, x) {
            print::line(format_args!(
                "eccentricity      {ecc:.6} of the clearance, attitude {attitude:.4}°"
            ))?;
        } else if arguments.load.is_some() || arguments.motion.is_some() {
            let [rise, along, across] = [0, 1, 2].map(|k| self.posed.position[k]);
            print::line(format_args!(
                "position          rise {rise:.6e} m, slopes {along:.6e} along x, {across:.6e} along y"
            ))?;
        }
        if let Some(found) = &self.coefficients {
            self.print_coefficients(found)?;
        }
        match &self.certificate {
            Some(Ok(certificate)) => print::line(certificate.to_string())?,
            Some(Err(refusal)) => {
                print::line(format!("certified error: none, because {refusal}"))?;
            }
            None => (),
        }
        Ok(())
    }

    fn print_coefficients(&self, found: &Coefficients) -> Result<(), Box<dyn Error>> {
        let (axes, stiff, damp) = if self.posed.journal.is_some() {
            ("along the load and across it", "N/m", "N s/m")
        } else {
            ("rise in m, slopes along x and y; forces in N and N m", "N/m …", "N s/m …")
        };
        print::line(format_args!("coefficients      {axes}; for slow motions, then by the clamp"))?;
        let row = |row: &Vec<f64>| row.iter().map(|v| format!("{v:>14.6e}")).collect::<String>();
        let pairs = [
            ("stiffness", stiff, &found.stiffness, &found.clamped[0]),
            ("damping", damp, &found.damping, &found.clamped[1]),
        ];
        for (name, unit, own, clamped) in pairs {
            for (k, (own, clamped)) in own.iter().zip(clamped).enumerate() {
                let name = if k == 0 { format!("{name}, {unit}") } else { String::new() };
                print::line(format_args!("{name:<16}{}  |{}", row(own), row(clamped)))?;
            }
        }
        Ok(())
    }
}
