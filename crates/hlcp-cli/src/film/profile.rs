//! `hlcp film` in one dimension: a profile of the gap.
//!
//! A profile is a text file with two columns, the place x and the gap h, separated by a comma, a
//! semicolon or blanks, in units of your choice; lines that begin with `#` are passed over. Between
//! two points the gap is a straight line, which is cut into pieces, none longer than 1/400 of the
//! film unless `--refine` says how many. A plane moves below it with the given speed in the
//! direction of x, the film is full at the first point, and both ends are at the ambient pressure.
//! Written are a picture, `target/film.svg`, and the numbers, `target/film.csv`; printed are peak,
//! load, friction, flow, and where the film ruptures and forms again.
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
//! bidiagonal, both M-matrices. Newton's method solves it in a few steps, from the solution at
//! every other point.

use std::{
    error::Error,
    fmt::Display,
    fs, io,
    path::Path,
    time::{Duration, Instant},
};

use hlcp::files::{self, FileError, excerpt, printable};
use hlcp_core::{Aor, Hlcp, Omega, Tridiagonal};
use hlcp_methods::{Limits, Newton, Options, Outcome, Solver, Tmms, TridiagonalPart};
use hlcp_verify::Slider;
use serde_json::{Value, json};

use super::{Arguments, PREFIXES, array, doubt};
use crate::{
    chart::{self, Panel},
    memory, print,
};

/// What a piece takes, at least: its places, gaps, coefficients and unknowns.
const BYTES: usize = 200;

/// Solves for the film, writes its picture and its numbers, and prints its figures; whether it
/// converged.
pub(super) fn run(mut arguments: Arguments) -> Result<bool, Box<dyn Error>> {
    let begun = Instant::now();
    let conditions = arguments.of_profile()?.unwrap_or([Slider::SPEED, Slider::VISCOSITY]);
    // Both files are named by `with_extension`, which is to take no part of the name away.
    arguments.out.as_mut_os_string().push(".svg");
    let profile = match &arguments.profile {
        Some(path) => {
            let failed = |e: &dyn Display| format!("{}: {e}", printable(path.display()));
            let bytes = fs::read(path).map_err(|e| failed(&e))?;
            if let Some(what) = files::binary(&bytes) {
                return Err(failed(&what).into());
            }
            let text = String::from_utf8(bytes).map_err(|_| failed(&"not a text file"))?;
            spare(path, &arguments.out)?;
            Profile::parse(path, &text)?
        }
        None => {
            (arguments.x_unit, arguments.h_unit, arguments.p_unit) = (1e-3, 1e-6, 1e6);
            Profile::parse(Path::new("pad.csv"), include_str!("../../data/pad.csv"))?
        }
    };
    let [svg, csv] = &["svg", "csv"].map(|extension| arguments.out.with_extension(extension));
    if let Some(folder) = svg.parent() {
        fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", printable(folder.display())))?;
    }
    files::check_output(svg)?;
    files::check_output(csv)?;
    let profile = profile.refined(arguments.refine)?;
    let film = Film::solve(&profile, conditions, &arguments)?;
    // Before anything is printed, because a reader that goes away ends the program.
    let texts = film.drawn(&profile, &arguments);
    files::write_together(&[(svg, &texts[0]), (csv, &texts[1])], |text, file| {
        file.write_all(text.as_bytes())
    })?;
    if arguments.json {
        print::line(film.json(&arguments, begun.elapsed()))?;
    } else {
        film.report(&profile, &arguments)?;
        let [svg, csv] = [svg, csv].map(|path| printable(path.display()));
        print::line(format_args!("wrote {svg} and {csv}"))?;
    }
    let length = film.x[film.x.len() - 1] - film.x[0];
    doubt(film.thin, &[length], film.p[film.peak()]);
    if arguments.profile.is_none() {
        film.check(&profile, arguments.json)?;
    }
    Ok(film.outcome.converged())
}

/// Refuses to write over the profile.
fn spare(profile: &Path, out: &Path) -> Result<(), Box<dyn Error>> {
    let is_profile = |extension| files::same_file(&out.with_extension(extension), profile);
    if !["svg", "csv"].into_iter().any(is_profile) {
        return Ok(());
    }
    let (out, profile) = (out.with_extension(""), printable(profile.display()));
    let out = printable(out.display());
    Err(format!("--out {out} would overwrite the profile {profile}; give another name").into())
}

/// Points of a gap, in the user's units.
struct Profile {
    x: Vec<f64>,
    h: Vec<f64>,
}

impl Profile {
    /// The two columns of `text`, which was read from `path`.
    fn parse(path: &Path, text: &str) -> Result<Self, FileError> {
        let fault = |line, reason| Err(FileError { path: path.to_owned(), line, reason });
        let (mut x, mut h) = (vec![], vec![]);
        let lines = text.trim_start_matches('\u{feff}').lines();
        for (number, line) in
            (1..).zip(lines).filter(|(_, line)| !line.trim_start().starts_with('#'))
        {
            if line.trim().is_empty() {
                continue;
            }
            let words = match array::cells(line) {
                Ok(words) => words,
                Err(reason) => return fault(Some(number), reason),
            };
            let [place, gap] = words[..] else {
                let found = words.len();
                let hint = if found > 2 && x.is_empty() {
                    "; a map of the gap in two dimensions is given by --map, with --lx and --ly"
                } else {
                    ""
                };
                return fault(
                    Some(number),
                    format!("{found} columns where x and h are wanted{hint}"),
                );
            };
            let mut values = [0.0; 2];
            for (value, word) in values.iter_mut().zip([place, gap]) {
                match word.parse() {
                    Ok(number) if f64::is_finite(number) => *value = number,
                    _ => {
                        let hint = if x.is_empty() { "; begin a heading with #" } else { "" };
                        return fault(
                            Some(number),
                            format!("'{}' is not a finite number{hint}", excerpt(word)),
                        );
                    }
                }
            }
            let [place, gap] = values;
            if let Some(last) = x.last().filter(|&&last| place <= last) {
                let hint = if place == *last {
                    "; for a step, put two points very close together"
                } else {
                    ""
                };
                return fault(
                    Some(number),
                    format!("x = {place} does not exceed the x before it, {last}{hint}"),
                );
            }
            if gap <= 0.0 {
                return fault(Some(number), format!("the gap h = {gap} is not positive"));
            }
            x.push(place);
            h.push(gap);
        }
        if x.len() < 2 {
            return fault(None, format!("a profile has at least 2 points, this one {}", x.len()));
        }
        Ok(Self { x, h })
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
fn pieces(x: &[f64], h: &[f64], ends: f64) -> Result<(Pieces, Outcome), Box<dyn Error>> {
    // Row i is the balance of point i + 1, between the pieces i and i + 1.
    let gap: Vec<f64> = h.windows(2).map(|h| 2.0 * h[0] * h[1] / (h[0] + h[1])).collect();
    let n = gap.len() - 1;
    let c: Vec<f64> = (0..=n).map(|k| gap[k] * h[k] * h[k + 1] / (x[k + 1] - x[k])).collect();
    let a = Tridiagonal::new(n, |i| [-c[i], c[i] + c[i + 1], -c[i + 1]])?;
    let b = Tridiagonal::new(n, |i| [-gap[i], gap[i + 1], 0.0])?;
    let mut q: Vec<f64> = gap.windows(2).map(|gap| gap[1] - gap[0]).collect();
    q[0] -= c[0] * ends;
    q[n - 1] -= c[n] * ends;

    let problem = Hlcp::new(a, b, Omega::diagonal_ratio(1.0, &a, &b)?)?;
    let mut start = vec![1.0; n];
    if n > 60 {
        // A solution at every other point says where about the film is full.
        let coarse = |v: &[f64]| -> Vec<f64> {
            let kept = (0..v.len()).filter(|i| i % 2 == 0 || i + 1 == v.len());
            kept.map(|i| v[i]).collect()
        };
        let (Pieces { z, r, .. }, _) = pieces(&coarse(x), &coarse(h), ends)?;
        let fine = |v: &[f64]| -> Vec<f64> {
            (1..=n).map(|i| (v[i / 2] + v[i.div_ceil(2)]) / 2.0).collect()
        };
        problem.x_from_solution(&fine(&z), &fine(&r), &mut start);
    }
    let base = Tmms::mirrored(problem, Aor::gauss_seidel().accelerated())?;
    let mut solver = Solver::new(Newton::new(base, TridiagonalPart::new()));
    let limits = Limits { rounding: Some(4.0), ..Limits::relative(1e-10) };
    let outcome = solver.solve(&q, Options::from_x(&start).limits(limits))?;

    let z = [&[ends], solver.z(), &[ends]].concat();
    // The film is full at the inlet, and at the outlet if there is pressure.
    let last = if ends > 0.0 { 0.0 } else { solver.r()[n - 1] };
    let r = [&[0.0], solver.r(), &[last]].concat();
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
            pieces(&scaled(&x, length), &scaled(&h, thin), ends)?;
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

    fn json(&self, arguments: &Arguments, elapsed: Duration) -> Value {
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
            "seconds": elapsed.as_secs_f64(),
        })
    }

    fn report(&self, profile: &Profile, arguments: &Arguments) -> io::Result<()> {
        print::line(format_args!("{} unknowns: {}", self.x.len() - 2, self.outcome))?;
        if !self.outcome.converged() {
            print::line("not converged, so these are no figures of the film:")?;
        }
        let [x, p] = [unit(arguments.x_unit, "m"), unit(arguments.p_unit, "Pa")];
        let peak = self.peak();
        print::line(format_args!(
            "peak pressure     {:.6} {p} at x = {:.6} {x}",
            self.p[peak] / arguments.p_unit,
            profile.x[peak]
        ))?;
        let load = self.load(arguments);
        print::line(format_args!("load              {load:.6e} N/m over the ambient pressure"))?;
        print::line(format_args!("friction          {:.6e} N/m on the plane", self.friction))?;
        for (front, rupture) in [("ruptures", true), ("forms again", false)] {
            for i in self.fronts(rupture) {
                let x_front = profile.x[i];
                print::line(format_args!(
                    "the film {front} at x = {x_front:.6} {x}, to within a piece"
                ))?;
            }
        }
        let [flow, imbalance] = self.through();
        print::line(format_args!(
            "flow              {flow:.6e} m²/s, the same everywhere but for {imbalance:.1e}"
        ))
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

    /// Holds the pad's peak and rupture against those of the continuous problem, and prints these
    /// unless `quiet`.
    fn check(&self, profile: &Profile, quiet: bool) -> Result<(), Box<dyn Error>> {
        if !quiet {
            print::line(format_args!(
                "known: peak {:.6} MPa, rupture at x = {:.6} mm",
                Slider::PEAK * 1e-6,
                Slider::RUPTURE * 1e3
            ))?;
        }
        // The straight pieces are off the parabola by h″Δx²/8, some (Δx/L)² of the smallest gap;
        // 1e-3 is room.
        let peak = (self.p[self.peak()] / Slider::PEAK - 1.0).abs() <= 1e-3;
        let near = |i: usize| (self.x[i] - Slider::RUPTURE).abs() <= self.x[i] - self.x[i - 1];
        let rupture = matches!(self.fronts(true)[..], [i] if near(i));
        if peak && rupture {
            Ok(())
        } else {
            let points = self.fronts(true).iter().map(|&i| profile.x[i]).collect::<Vec<_>>();
            Err(format!("the pad's peak is wrong, or it ruptures at {points:?}").into())
        }
    }
}

/// A unit that is `value` of a `base`, as it stands behind a number.
pub(super) fn unit(value: f64, base: &str) -> String {
    match PREFIXES.iter().find(|(prefix, _)| *prefix == value) {
        Some((_, prefix)) => format!("{prefix}{base}"),
        None => format!("× {value:e} {base}"),
    }
}
