//! `hlcp film`, run as an engineer runs it, against closed forms and against what flows in and out.

use approx::assert_abs_diff_eq;
use std::{fs, process::Output};

use crate::{
    command::{self, is_refusal, near, rows, succeeded},
    film_plane::{self, folder},
};
use hlcp_verify::Slider;

/// Runs `hlcp film` in the folder of the test, with the profile in a file.
fn film(profile: Option<&str>, arguments: &str) -> Output {
    let file = if profile.is_some() { "profile.csv" } else { "" };
    profile.iter().for_each(|text| fs::write(folder().join(file), text).unwrap());
    film_plane::film(&format!("{arguments} {file}"))
}

/// A point: x, h, p and void fraction.
type Point = [f64; 4];

/// What a successful run prints, and the points it writes.
fn solved(profile: Option<&str>, arguments: &str) -> (String, Vec<Point>) {
    let printed = succeeded(&film(profile, arguments), arguments);
    let folder = folder().join("target");
    let svg = fs::read_to_string(folder.join("film.svg")).expect("a picture");
    assert!(svg.starts_with("<svg") && !svg.contains("NaN"), "{arguments}");
    let points = rows(&folder.join("film.csv"), 1).into_iter();
    (printed, points.map(|point| point.try_into().expect("four columns")).collect())
}

/// The number after `what` in a printed line.
fn printed(text: &str, what: &str) -> f64 {
    let line = text.lines().find_map(|line| line.strip_prefix(what));
    let word = line.and_then(|rest| rest.split_whitespace().next());
    word.and_then(|word| word.parse().ok()).unwrap_or_else(|| panic!("no {what} in {text}"))
}

const SPEED: f64 = 3.7;
const VISCOSITY: f64 = 0.041;

/// What flows through each piece, from integrals over a straight gap: with I₂ = ∫dx/h² and I₃ =
/// ∫dx/h³ the Reynolds equation `½U(1 − r)h − h³/(12μ) p′ = Φ` gives
/// `Φ = (6μU(1 − r)I₂ − Δp)/(12μI₃)`.
fn flows(points: &[Point]) -> Vec<f64> {
    let flow = |pair: &[Point]| {
        let [[x, h, p, void], [x1, h1, p1, _]] = [pair[0], pair[1]];
        let i2 = (x1 - x) / (h * h1);
        let i3 = (x1 - x) * (1.0 / (h * h1 * h1) + 1.0 / (h * h * h1)) / 2.0;
        (6.0 * VISCOSITY * SPEED * (1.0 - void) * i2 - (p1 - p)) / (12.0 * VISCOSITY * i3)
    };
    points.windows(2).map(flow).collect()
}

#[test]
fn the_pad_has_the_sliders_peak_and_rupture() {
    let (text, points) = solved(None, "");
    let peak = points.iter().map(|point| point[2]).fold(0.0, f64::max);
    assert_abs_diff_eq!(peak * 1e6 / Slider::PEAK, 1.0, epsilon = 1e-3);
    let broken = points.iter().position(|point| point[3] > 0.0).unwrap();
    let piece = points[broken][0] - points[broken - 1][0];
    assert_abs_diff_eq!(points[broken][0] * 1e-3, Slider::RUPTURE, epsilon = piece * 1e-3);
    assert!(text.contains("the film ruptures") && !text.contains("forms again"), "{text}");

    // The sample file is that pad.
    let sample = include_str!("../../data/pad.csv");
    let arguments = "--x-unit mm --h-unit um --p-unit MPa --speed 4.57 --viscosity 0.039";
    assert_eq!(solved(Some(sample), arguments).1, points);
}

/// A bumpy profile, unevenly spaced: x in mm, h in µm.
fn bumpy() -> Vec<[f64; 2]> {
    let place = |i: i32| f64::from(i) + 0.3 * f64::sin(1.7 * f64::from(i));
    let gap = |x: f64| 40.0 + 0.02 * x + 17.0 * f64::sin(0.31 * x + 0.4);
    (0..60).map(|i| [place(i), gap(place(i))]).collect()
}

fn text(points: &[[f64; 2]], [x_unit, h_unit]: [f64; 2]) -> String {
    points.iter().map(|[x, h]| format!("{:e};{:e}\n", x * x_unit, h * h_unit)).collect()
}

#[test]
fn what_flows_in_flows_out() {
    let profile = text(&bumpy(), [1e-3, 1e-6]);
    for ambient in [0.0, 2e5] {
        let flags =
            format!("--speed {SPEED} --viscosity {VISCOSITY} --ambient {ambient} --refine 1");
        let (report, points) = solved(Some(&profile), &flags);
        let flows = flows(&points);
        let flow = flows.iter().sum::<f64>() / flows.len() as f64;
        near(printed(&report, "flow"), flow, 1e-6);
        for one in flows {
            // The residual's 1e-10, summed over the points, and the rounding of the pressures'
            // differences.
            assert_abs_diff_eq!(one, flow, epsilon = 1e-8 * flow);
        }
        assert!((points[0][2] - ambient).abs() <= 1e-12 * ambient && points[59][2] == points[0][2]);
        for [.., p, void] in points {
            let is_film = p >= 0.0 && (0.0..1.0).contains(&void) && p * void == 0.0;
            assert!(is_film, "{ambient}: {p} {void}");
        }
        assert!(report.contains("the film ruptures"), "{report}");
        // A film that has broken forms again where the gap closes, or before an end with pressure.
        assert!(report.contains("the film forms again"), "{report}");
    }
}

#[test]
fn a_plane_wedge_is_exact_at_its_points() {
    // h = h₀(1 + K(1 − s)) with s = x/L, unevenly spaced; Cameron's formulas.
    let (length, thin, k) = (0.05, 2e-5, 1.3);
    let places = [0.0, 0.11, 0.19, 0.42, 0.5, 0.77, 0.93, 1.0];
    let wedge: Vec<[f64; 2]> =
        places.iter().map(|s| [s * length, thin * (1.0 + k * (1.0 - s))]).collect();
    let flags = format!("--speed {SPEED} --viscosity {VISCOSITY} --refine 40");
    let (report, points) = solved(Some(&text(&wedge, [1.0, 1.0])), &flags);
    assert_eq!(points.len(), 7 * 40 + 1);
    let unit = 6.0 * VISCOSITY * SPEED * length / (thin * thin);
    for [x, h, p, void] in points {
        let s = x / length;
        let exact = unit * k * s * (1.0 - s) * (thin / h).powi(2) / (2.0 + k);
        // The balance holds to 1e-10 at each of 279 points, and the pressure sums what is off.
        assert!((p - exact).abs() <= 1e-7 * unit && void == 0.0, "at {s}: {p} for {exact}");
    }
    let load = unit * length * (k.ln_1p() - 2.0 * k / (2.0 + k)) / (k * k);
    let friction = VISCOSITY * SPEED * length / thin * (4.0 * k.ln_1p() / k - 6.0 / (2.0 + k));
    // The sums are of second order in the 280 pieces.
    near(printed(&report, "load"), load, 1e-3);
    near(printed(&report, "friction"), friction, 1e-3);
}

#[test]
fn a_unit_without_a_name_is_a_factor() {
    let flags =
        format!("--speed {SPEED} --viscosity {VISCOSITY} --x-unit 0.0254 --p-unit 6894.757");
    let (report, _) = solved(Some("0 3e-5\n1 2e-5\n"), &flags);
    let line = report.lines().find(|line| line.starts_with("peak pressure")).unwrap();
    assert!(line.contains(" × 6.894757e3 Pa at x = ") && line.ends_with(" × 2.54e-2 m"), "{line}");
    let svg = fs::read_to_string(folder().join("target/film.svg")).unwrap();
    for axis in ["x (× 2.54e-2 m)", "p (× 6.894757e3 Pa)", "h (m)"] {
        assert!(svg.contains(axis), "{axis}");
    }
}

#[test]
fn wrong_input_is_refused_in_one_line() {
    let cases = [
        ("x,h\n0,1\n1,2\n2,3\n", "line 1: column 1: 'x' is not a finite number; begin a heading"),
        ("# x h\n0,1\n\n2,2\n1,3\n", "row 3: x = 1 does not exceed the x before it, 2"),
        ("0,1\n1,0\n2,3\n", "row 2: the gap h = 0 is not positive"),
        ("0,1\n1,-4e-6\n2,3\n", "row 2: the gap h = -0.000004 is not positive"),
        ("0 1\n1 NaN\n2 3\n", "line 2: column 2: 'NaN' is not a finite number"),
        ("0;1\n1;1e999\n2;3\n", "line 2: column 2: '1e999' is not a finite number"),
        ("0,1\n1,2,3\n2,3\n", "line 2: 3 columns where 2 are wanted"),
        ("1,2,3\n1,2,3\n", "; a map of the gap in two dimensions is given by --map, with --lx"),
        (
            "0,1\n1,1\n1,2\n2,2\n",
            "row 3: x = 1 does not exceed the x before it, 1; for a step, put two points very",
        ),
        ("0,1\n# the end\n", "profile.csv: a profile has at least 2 points, this one 1"),
        ("", "profile.csv: there are no numbers"),
    ];
    let flags = format!("--speed {SPEED} --viscosity {VISCOSITY}");
    let refused = |profile: &str, flags: &str, what: &str| {
        is_refusal(&film(Some(profile), flags), &format!("{flags}, {profile:?}"), what);
    };
    for (profile, what) in cases {
        refused(profile, &flags, what);
        refused(profile, &flags, "profile.csv");
    }
    let sound = "0,1\n1,2\n2,3\n";
    for (more, what) in [
        ("--ambient 1 --cavitation 2", "--ambient is below --cavitation"),
        ("--ambient=-1", "--ambient is below --cavitation"),
        ("--ambient NaN", "not a finite number"),
    ] {
        refused(sound, &format!("{flags} {more}"), what);
    }
    refused("0,1\n1,2\n", &format!("{flags} --refine 1"), "--refine 2 or more");
    let arguments = [
        ("--speed 0 --viscosity 1", "'0' for '--speed <SPEED>': not a positive number"),
        ("--speed -5 --viscosity 1", "turn the profile round"),
        ("--speed 7.2km/h --viscosity 1", "in m/s without the unit, e.g. 2 for 7.2 km/h"),
        (
            "--speed 5 --viscosity -1e-2",
            "'-1e-2' for '--viscosity <VISCOSITY>': not a positive number",
        ),
        ("--speed 5 --viscosity 1 --x-unit inch", "nor a positive number; mm, or in metres"),
        ("--speed 5 --viscosity 1 --h-unit -1", "nor a positive number; um, or in metres"),
        ("--speed 5 --viscosity 1 --p-unit inf", "nor a positive number; MPa, or in pascals"),
        ("--speed 5 --viscosity 1 --refine -3", "-3 is not in 1..=65535"),
        ("--speed 5 --viscosity 1 --certify", "'--certify' cannot be used with '[PROFILE]'"),
        ("--speed 5 --viscosity 1 --nx 3", "cannot be used with"),
        ("", "--speed"),
    ];
    for (arguments, what) in arguments {
        refused(sound, arguments, what);
    }
}

#[test]
fn the_figures_of_a_profile_are_one_json_object_in_si_units() {
    // Points in millimetres and micrometres.
    let profile = text(&bumpy(), [1.0, 1.0]);
    let flags = format!(
        "--speed {SPEED} --viscosity {VISCOSITY} --x-unit mm --h-unit um --p-unit MPa --ambient 0.2 --cavitation 0.15"
    );
    let (report, points) = solved(Some(&profile), &flags);
    let found = film_plane::json(&format!("{flags} profile.csv"));
    assert_eq!(found["outcome"], "converged");
    assert_eq!(found["unknowns"], points.len() - 2);
    let number = |key: &str| command::number(&found, key);
    let is_near = |key: &str, wanted: f64| near(number(key), wanted, 1e-6);
    for (key, what) in
        [("load_n_m", "load  "), ("friction_n_m", "friction  "), ("flow_m2_s", "flow  ")]
    {
        is_near(key, printed(&report, what));
    }
    // The pressures, in units, are those of the gap in units, and begin with the ambient one.
    let si: Vec<Point> =
        points.iter().map(|[x, h, p, void]| [x * 1e-3, h * 1e-6, p * 1e6, *void]).collect();
    flows(&si).into_iter().for_each(|flow| near(flow, number("flow_m2_s"), 1e-8));
    let least = points.iter().map(|point| point[2]).fold(f64::INFINITY, f64::min);
    assert_eq!([points[0][2], least], [0.2, 0.15]);
    let peak =
        points.iter().fold(points[0], |peak, point| if point[2] > peak[2] { *point } else { peak });
    is_near("peak_pressure_pa", peak[2] * 1e6);
    is_near("peak_x_m", peak[0] * 1e-3);
    let least = points.iter().map(|point| point[1]).fold(f64::INFINITY, f64::min);
    is_near("least_gap_m", least * 1e-6);
    assert!(number("mass_imbalance_m2_s") <= 1e-9 * number("flow_m2_s"), "{found}");
    let pad = film_plane::json("");
    near(command::number(&pad, "peak_pressure_pa"), Slider::PEAK, 1e-3);
    let fronts = |key: &str| found[key].as_array().map(Vec::len);
    for (key, what) in [("ruptures_x_m", "film ruptures"), ("forms_again_x_m", "forms again")] {
        assert_eq!(fronts(key), Some(report.matches(what).count()), "{found}\n{report}");
    }
}

#[test]
fn sizes_that_were_hardly_meant_are_solved_with_a_warning() {
    let warned = |profile: &str, flags: &str| {
        let flags = format!("--speed {SPEED} --viscosity {flags}");
        let output = film(Some(profile), &flags);
        succeeded(&output, &flags);
        command::text(&output.stderr)
    };
    let wedge = "0 2e-5\n80 1e-5\n";
    assert!(warned(wedge, "0.04").contains("the film 80 m long"));
    assert_eq!(warned(wedge, "0.04 --x-unit mm"), "");
    let stepped = |h: f64| {
        warned(
            &format!("0 3e-5\n10 3e-5\n10.001 {h}\n30 {h}\n30.001 2e-5\n50 2e-5\n"),
            "0.04 --x-unit mm",
        )
    };
    assert_eq!(stepped(1e-3), "");
    assert!(stepped(0.5).contains("too deep for double precision"));
    // The points are in millimetres and micrometres.
    let forgotten = warned(&text(&bumpy(), [1.0, 1.0]), "0.041");
    assert!(forgotten.contains("--h-unit") && forgotten.contains("--x-unit"), "{forgotten}");
    let thick = warned(wedge, "400000 --x-unit mm");
    assert!(thick.contains("more than lubricants bear; --viscosity is in Pa s"), "{thick}");
}

/// What follows a dot is part of the name.
#[test]
fn the_profile_is_not_written_over() {
    let profile = "0 3e-5\n0.01 2e-5\n";
    let flags = format!("--speed {SPEED} --viscosity {VISCOSITY}");
    for out in ["profile.2", "profile.csv"] {
        let flags = format!("{flags} --out {out}");
        let printed = succeeded(&film(Some(profile), &flags), &flags);
        assert!(printed.contains(&format!("wrote {out}.svg, {out}.csv")), "{printed}");
        for extension in ["svg", "csv"] {
            assert!(folder().join(format!("{out}.{extension}")).exists(), "{out}");
        }
        assert_eq!(fs::read_to_string(folder().join("profile.csv")).unwrap(), profile);
    }
    let output = film(Some(profile), &format!("{flags} --out profile"));
    let wanted = "error: --out would overwrite the profile, profile.csv; give another name\n";
    assert_eq!(is_refusal(&output, "--out profile", ""), wanted);
}
