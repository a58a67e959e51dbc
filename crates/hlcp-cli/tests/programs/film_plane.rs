//! `hlcp film` in two dimensions, against tables, closed forms and itself.

use approx::assert_abs_diff_eq;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
    thread,
};

use hlcp::film::Map;
use serde_json::Value;

use crate::command::{hlcp, is_refusal, near, number, rows, run_in, succeeded, text};

/// A folder for the files of the test that runs, whose thread has its name.
pub(crate) fn folder() -> PathBuf {
    let name = thread::current().name().unwrap_or("film").replace("::", "-");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).expect("a folder under target");
    folder
}

pub(crate) fn film(arguments: &str) -> Output {
    run_in(&folder(), "film", arguments)
}

pub(crate) fn json(arguments: &str) -> Value {
    let printed = film_of(&format!("{arguments} --json"));
    serde_json::from_str(&printed).expect("one JSON object")
}

fn film_of(arguments: &str) -> String {
    succeeded(&film(arguments), arguments)
}

fn matrix(object: &Value, key: &str) -> Vec<Vec<f64>> {
    let row = |row: &Value| row.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    object[key].as_array().unwrap_or_else(|| panic!("no {key}")).iter().map(row).collect()
}

/// A journal of 100 mm in a bearing of this length, 0.1 mm wide, at 3000 turns a minute.
pub(crate) fn journal(length: f64) -> String {
    format!(
        "--journal --diameter 0.1 --length {length} --clearance 1e-4 --rpm 3000 --viscosity 0.02"
    )
}

/// (R/c)² μN L D/W of that journal.
fn sommerfeld(length: f64, load: f64) -> f64 {
    500.0 * 500.0 * 0.02 * 50.0 * length * 0.1 / load
}

#[test]
fn a_bearing_has_raimondi_and_boyds_numbers() {
    let table = [(0.1, 1.33, 79.5, 0.540), (0.6, 0.121, 50.58, 0.415), (0.9, 0.0188, 26.45, 0.247)];
    for (ecc, s, attitude, share) in table {
        let film = json(&format!("{} --ecc {ecc} --groove 0", journal(0.1)));
        let load = number(&film, "load_n");
        let found = sommerfeld(0.1, load);
        assert!((found / s - 1.0).abs() <= 0.01, "{ecc}: S = {found}");
        assert!((number(&film, "attitude_deg") - attitude).abs() <= 0.3, "{film}");
        let mean = load / (0.1 * 0.1);
        assert!((mean / number(&film, "peak_pressure_pa") / share - 1.0).abs() <= 0.01, "{film}");
        assert_eq!(number(&film, "ecc"), ecc);
    }
}

/// Someya (1989), page 53: two lobes, L/D = 1, a preload of ⅔, in units of the least clearance.
#[test]
fn an_elliptical_bearing_is_someyas() {
    let table = [
        (0.192, 0.427, 80.0, [16.8, 5.30, -7.80, 1.71], [24.7, -7.00, -6.98, 5.15]),
        (0.0513, 0.925, 74.0, [8.92, 3.55, -1.61, 1.24], [11.1, -0.490, -0.481, 1.80]),
        (0.0202, 1.15, 64.0, [11.7, 4.80, 0.570, 1.56], [10.3, 0.873, 0.873, 0.995]),
    ];
    let speed = 100.0 * std::f64::consts::PI;
    for (s, ecc, attitude, stiff, damp) in table {
        let load = sommerfeld(0.1, 1.0) / s;
        let film = json(&format!(
            "{} --lobes 2,0.66666666666666667 --groove 90,0,10 --groove 270,0,10 --attitude 0 \
                 --nx 144 --ny 24 --load {load} --coefficients",
            journal(0.1)
        ));
        assert!((3.0 * number(&film, "ecc") / ecc - 1.0).abs() <= 0.04, "{s}: {film}");
        assert!((number(&film, "attitude_deg") - attitude).abs() <= 1.3, "{s}: {film}");
        let tables =
            [("stiffness_clamp_n_m", 1e-4, stiff), ("damping_clamp_n_s_m", 1e-4 * speed, damp)];
        for (key, unit, table) in tables {
            // As his eccentricities, which are uneven from row to row, by 4 %.
            let size = table.iter().fold(0.0_f64, |size, v| size.max(f64::abs(*v)));
            for (found, table) in matrix(&film, key).concat().into_iter().zip(table) {
                let found = found * unit / load;
                assert!((found - table).abs() <= 0.05 * size, "{s} {key}: {found} {table}");
            }
        }
    }
}

/// Oil that enters on one part of a side and leaves on another is leakage, and takes power with it.
#[test]
fn what_leaves_at_a_side_leaks_whatever_enters_there() {
    let film = json(&format!("{} --nx 24 --ny 8 --ecc 0.5 --ambient 1e5", journal(0.05)));
    let (flows, leakage) = (&film["flow_m3_s"], number(&film, "leakage_m3_s"));
    let net = number(flows, "south") + number(flows, "north");
    assert!(net.abs() < 1e-9 * leakage && leakage > 0.0, "{net} {leakage}");
    let warmer = number(&film, "power_w") / (870.0 * 1950.0 * leakage);
    near(number(&film, "temperature_rise_k"), warmer, 1e-9);
}

/// Flows of a motion that is certified are those of the end of its last step, as their bounds are.
#[test]
fn flows_of_a_certified_motion_lie_within_their_bounds() {
    let rows = (0..4).map(|k| {
        let (sin, cos) = (0.3 * f64::from(k)).sin_cos();
        format!("{},{},{}\n", 2e-4 * f64::from(k), 1e-5 * cos, 1e-5 * sin)
    });
    fs::write(folder().join("orbit.csv"), rows.collect::<String>()).unwrap();
    let of = format!("{} --nx 24 --ny 8 --motion orbit.csv --groove 0,1e5", journal(0.05));
    let film = json(&format!("{of} --certify"));
    for side in ["south", "north"] {
        let [flow, bound] =
            [&film["flow_m3_s"], &film["bounds"]["flow_m3_s"]].map(|of| number(of, side));
        assert!(bound <= 1e-9 * flow, "{side}: {flow} {bound}");
    }
}

/// Walls that move against each other carry nothing and shear the film, by Couette's formula.
#[test]
fn walls_that_pass_each_other_shear_the_film() {
    let film = json("--pad plane,4e-5,4e-5 --lx 0.05 --ly 0.03 --viscosity 0.04 --speed 3,-3");
    near(number(&film, "friction_moving_n"), 0.04 * 6.0 * 0.05 * 0.03 / 4e-5, 1e-12);
    near(number(&film, "power_w"), 54.0, 1e-12);
    assert_abs_diff_eq!(number(&film, "load_n"), 0.0, epsilon = 1e-9);
}

/// A pad whose edge cuts into the other wall is refused, though the middles of its cells are clear;
/// the least gap is told at the edges, too.
#[test]
fn walls_may_not_meet_between_the_middles_of_cells() {
    let rest = "--lx 0.05 --ly 0.03 --nx 30 --ny 18 --viscosity 0.04 --speed 3";
    for pad in ["plane,4e-5,-5e-7", "parabola,-1e-9,1", "taper,4e-5,-5e-8,0.0495"] {
        let output = film(&format!("--pad {pad} {rest}"));
        let err = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && err.contains("the walls meet at x = "), "{pad}: {err}");
    }
    let told = json(&format!("--pad plane,4e-5,2e-5 {rest}"));
    near(number(&told, "nearest_gap_m"), 2e-5, 1e-12);
    assert!(number(&told, "least_gap_m") > 2e-5);
}

#[test]
fn derived_figures_are_those_of_the_trade() {
    let bearing = format!("{} --nx 60 --ny 8 --groove 0 --ecc 0.5", journal(0.05));
    let film = json(&format!("{bearing} --oil 900,2000"));
    let load = number(&film, "load_n");
    let leakage = number(&film["flow_m3_s"], "south") + number(&film["flow_m3_s"], "north");
    let wanted = [
        ("specific_load_pa", load / (0.1 * 0.05)),
        ("sommerfeld", sommerfeld(0.05, load)),
        ("torque_n_m", 0.05 * number(&film, "friction_moving_n")),
        ("leakage_m3_s", leakage),
        ("temperature_rise_k", number(&film, "power_w") / (900.0 * 2000.0 * leakage)),
        ("reynolds", 900.0 * 5.0 * std::f64::consts::PI * 1e-4 / 0.02),
        ("reynolds_laminar", 1708.0_f64.sqrt() * 500.0_f64.sqrt()),
    ];
    for (key, wanted) in wanted {
        near(number(&film, key), wanted, 1e-12);
    }
    let water = bearing.replace("0.02", "0.001");
    let err = text(&self::film(&water).stderr);
    assert!(err.contains("the Reynolds number 1367 is above 924"), "{err}");
}

#[test]
fn grooves_and_dams_are_rectangles_in_the_middle() {
    let bearing = "--journal --diameter 100 --length 50 --clearance 100 --x-unit mm --h-unit um \
                   --rpm 3000 --viscosity 0.02 --ecc 0.4 --nx 72 --ny 10";
    let turn = 100.0 * std::f64::consts::PI;
    let at = |degrees: f64| turn * degrees / 360.0;
    let pairs = [
        (
            "--groove 5,1e5,20,30".to_owned(),
            format!("--supply {},10,{},30,1e5", at(355.0), at(20.0)),
        ),
        (
            "--groove 0,1e5 --dam 100,170,40,50".to_owned(),
            format!("--groove 0,1e5 --pocket {},5,{},40,50", at(100.0), at(70.0)),
        ),
    ];
    for (one, other) in pairs {
        let [one, other] = [one, other].map(|shape| json(&format!("{bearing} {shape}")));
        for key in ["load_n", "attitude_deg", "power_w", "peak_pressure_pa"] {
            near(number(&one, key), number(&other, key), 1e-10);
        }
    }
}

/// The figures of a pad under a wall that moves, and the rows of its file of steps.
fn squeezed(motion: &str) -> (Value, Vec<Vec<f64>>) {
    fs::write(folder().join("motion.csv"), motion).unwrap();
    let pad = "--pad plane,2e-5,2e-5 --lx 0.02 --ly 0.02 --nx 24 --ny 16 --viscosity 0.05 \
               --ambient 1e5 --motion motion.csv";
    (json(pad), rows(&folder().join("target/film-motion.csv"), 1))
}

#[test]
fn a_squeeze_takes_power() {
    // A disc-like pad that falls at 1 mm/s: all that is lost is load times speed.
    let (film, rows) = squeezed("0,0\n1e-4,-1e-7\n2e-4,-2e-7\n");
    let wanted = 1e-3 * number(&film, "load_n");
    near(number(&film, "power_w"), wanted, 1e-9);
    near(rows.last().unwrap()[6], wanted, 1e-9);
}

#[test]
fn axes_are_along_the_load_and_drags_are_two() {
    let bearing = format!("{} --nx 60 --ny 8 --groove 0 --ecc 0.5 --coefficients", journal(0.1));
    let own = json(&bearing);
    // They turned with --attitude, which nothing else takes up here.
    assert_eq!(film(&format!("{bearing} --attitude 30")).status.code(), Some(1));
    // In a broken film oil covers a part, and the difference is the same on both walls.
    let drag = |which: &str| number(&own, &format!("{which}_n"));
    let more = drag("full_friction_moving") - drag("friction_moving");
    assert!(more > 0.01 * drag("friction_moving"), "{own}");
    let other = drag("full_friction_fixed") - drag("friction_fixed");
    assert_abs_diff_eq!(more, other, epsilon = 1e-12 * drag("friction_moving"));
    let said = film_of(&bearing);
    assert!(said.contains("for motions at a frequency take --whirl"), "{said}");
    assert!(said.contains("if all of the gap is sheared"), "{said}");
}

/// A rotor of the critical mass whirls for ever: −mω² + K + iωC is singular at that frequency.
#[test]
fn a_critical_mass_whirls() {
    let bearing = format!("{} --nx 60 --ny 8 --groove 0 --ecc 0.4", journal(0.05));
    let found = json(&format!("{bearing} --coefficients --whirl 0,0.3"));
    let entries = |found: &Value| {
        let [k, c] = ["stiffness_n_m", "damping_n_s_m"].map(|name| matrix(found, name).concat());
        [k, c]
    };
    let [slow, slowly] = [entries(&found), entries(&found["whirl"][0])];
    assert_eq!(slow, slowly);
    let [mass, ratio] =
        ["critical_mass_kg", "whirl_frequency_ratio"].map(|key| number(&found, key));
    assert!(mass > 0.0 && (0.4..0.6).contains(&ratio), "{mass} {ratio}");
    let there = json(&format!("{bearing} --whirl {ratio:e}"));
    let ([k, c], omega) = (entries(&there["whirl"][0]), ratio * 100.0 * std::f64::consts::PI);
    let entry = |at: usize| {
        let inert = if at.is_multiple_of(3) { mass * omega * omega } else { 0.0 };
        [k[at] - inert, omega * c[at]]
    };
    let product = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a * c - b * d, a * d + b * c];
    let (one, other) = (product(entry(0), entry(3)), product(entry(1), entry(2)));
    let size = one[0].hypot(one[1]) + other[0].hypot(other[1]);
    // A ratio of 17 digits, found to 1e-9.
    let off = (one[0] - other[0]).hypot(one[1] - other[1]);
    assert!(off <= 1e-8 * size, "{off} of {size}");
    let said = film_of(&format!("{bearing} --whirl 0.5,1"));
    for what in ["whirl of 0.5", "at 3.141593e2 rad/s", "critical mass", "of the running speed"] {
        assert!(said.contains(what), "{said}");
    }
}

/// Each option that is a number, changed by a little, changes the figures as it is said to.
#[test]
fn sensitivities_are_differences_of_the_command() {
    let differs = |shape: &str, options: &[(&str, &str, f64, f64)]| {
        let command = |changed: usize, by: f64| {
            let option = |(k, &(_, option, value, _)): (usize, &(_, &str, f64, _))| {
                format!("{option}{:e}", value + if k == changed { by } else { 0.0 })
            };
            let all: Vec<String> = options.iter().enumerate().map(option).collect();
            format!("{shape} {}", all.join(" "))
        };
        let now = json(&format!("{} --sensitivities", command(0, 0.0)));
        for (k, &(name, .., step)) in options.iter().enumerate() {
            let [less, more] = [-step, step].map(|by| json(&command(k, by)));
            for figure in ["load_n", "friction_moving_n", "power_w", "peak_pressure_pa"] {
                let difference = (number(&more, figure) - number(&less, figure)) / (2.0 * step);
                let exact = number(&now["sensitivities"][name], figure);
                // Steps are a thousandth: second differences and rounding are below this.
                let size = exact.abs().max(1e-6 * number(&now, figure).abs() / step);
                let off = (exact - difference).abs();
                assert!(off <= 1e-4 * size, "{name} {figure}: {exact} {difference}");
            }
        }
    };
    let journal = "--journal --diameter 100 --length 60 --x-unit mm --h-unit 1 --nx 40 --ny 8";
    differs(
        journal,
        &[
            ("speed", "--speed ", 15.0, 1e-2),
            ("viscosity", "--viscosity ", 0.02, 1e-5),
            ("clearance", "--clearance ", 1e-4, 1e-7),
            ("ecc", "--ecc ", 0.6, 1e-4),
            ("ambient", "--ambient ", 1e5, 100.0),
            ("supplies[0]", "--supply 150,10,40,30,", 2e5, 100.0),
            ("pockets[0]", "--pocket 40,10,40,30,", 2e-5, 1e-8),
        ],
    );
    let pad = "--pad plane,40,20 --h-unit um --x-unit mm --lx 50 --ly 30 --nx 40 --ny 24";
    differs(
        pad,
        &[
            ("speed", "--speed ", 3.0, 1e-3),
            ("viscosity", "--viscosity ", 0.04, 1e-5),
            ("west", "--side west=", 3e5, 100.0),
        ],
    );
}

#[test]
fn a_motion_stays_in_the_bush_and_is_in_its_unit() {
    let bearing = format!("{} --groove 0,1e5 --nx 40 --ny 4 --motion motion.csv", journal(0.1));
    let moved = |rows: &str| {
        fs::write(folder().join("motion.csv"), rows).unwrap();
        film(&bearing)
    };
    is_refusal(&moved("0,0,0\n1,1.003e-4,0\n"), &bearing, "row 2: the walls meet");
    let output = moved("0,0,0\n1e-3,2e-11,0\n");
    let err = text(&output.stderr);
    assert!(output.status.success() && err.contains("less than a thousandth"), "{err}");
    let told = &json(&bearing)["warnings"];
    assert_eq!(format!("warning: {}\n", told[0].as_str().expect("a warning")), err);
    assert!(moved("0,0,0\n1e-3,2e-6,0\n").stderr.is_empty());
    let tilted = film(&format!("{} --groove 0 --ecc 0.9 --tilt 2.1e-4,0", journal(0.1)));
    is_refusal(&tilted, "--tilt", "the journal meets its bush at an end, 180.0 degrees");
    // A search begins where such a journal meets nothing.
    let found = json(&format!("{} --groove 0 --load 3000 --tilt 2e-3,1e-3", journal(0.05)));
    assert!(found["converged"] == true && number(&found, "ecc") < 0.44, "{found}");
}

#[test]
fn a_supply_may_begin_where_the_film_ends() {
    let round = std::f64::consts::PI * 0.0752;
    let from = f64::from_bits(round.to_bits() + 1);
    let bearing = "--journal --diameter 0.0752 --length 0.1 --clearance 1e-4 --rpm 3000 \
                   --viscosity 0.02 --ecc 0.5 --nx 36 --ny 4";
    film_of(&format!("{bearing} --supply {from},0,0.02,0.1,1e5"));
}

#[test]
fn copies_are_refused() {
    let pad = "--pad plane,4e-5,2e-5 --lx 0.02 --ly 0.01 --speed 2 --viscosity 0.03";
    for name in ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"] {
        let output = hlcp("film", pad).env(name, "3").current_dir(folder()).output();
        let why = "hlcp film works on one process, but mpirun has started 3";
        is_refusal(&output.unwrap(), name, why);
    }
}

#[test]
fn a_squeezed_film_keeps_its_oil() {
    let gap = |time: f64| 1.5e-5 + 5e-6 * (400.0 * time).cos();
    let rows: Vec<String> = (0..60)
        .map(|k| format!("{},{}", 4e-4 * f64::from(k), gap(4e-4 * f64::from(k)) - 2e-5))
        .collect();
    let (film, rows) = squeezed(&rows.join("\n"));
    assert_abs_diff_eq!(number(&film, "least_gap_m"), gap(4e-4 * 59.0), epsilon = 1e-18);
    assert_eq!(rows.len(), 59);
    assert!(rows.iter().any(|row| row[15] > 0.2), "it breaks as it opens");
    // The oil is that of before and what came in, to rounding.
    for pair in rows.windows(2) {
        let out: f64 = pair[1][7..11].iter().sum::<f64>() * 4e-4;
        assert!((pair[1][12] - pair[0][12] + out).abs() <= 1e-13 * pair[0][12], "{pair:?}");
    }
    assert!(number(&film, "mass_imbalance_m3_s").abs() <= 1e-13 * rows[0][12] / 0.0236, "{film}");
}

#[test]
fn a_free_journal_stays_where_its_load_is_carried() {
    let bearing = format!("{} --nx 60 --ny 8 --groove 0", journal(0.1));
    let loaded = json(&format!("{bearing} --load 12000"));
    let [ecc, attitude] = [number(&loaded, "ecc"), number(&loaded, "attitude_deg")];
    let free = |name: &str, load: f64| {
        let rows: Vec<String> =
            (0..6).map(|k| format!("{},{load},0", 1e-3 * f64::from(k))).collect();
        fs::write(folder().join(name), rows.join("\n")).unwrap();
        let place = format!("--ecc {ecc} --attitude {attitude} --mass 5 --motion {name}");
        json(&format!("{bearing} {place}"))
    };
    let film = free("same.csv", 12000.0);
    // The position carries 12 kN to 1e-9, and a step ends at 1e-8.
    assert_abs_diff_eq!(number(&film, "ecc"), ecc, epsilon = 1e-6);
    assert_abs_diff_eq!(number(&film, "attitude_deg"), attitude, epsilon = 1e-4);
    let place = "--load 12000 --mass 5 --motion same.csv";
    let still = json(&format!("{bearing} {place}"));
    let from = json(&format!("{bearing} --load 12000 --attitude 0"));
    for key in ["ecc", "attitude_deg"] {
        assert_abs_diff_eq!(number(&still, key), number(&from, key), epsilon = 1e-4);
    }
    // Under less it rises, and the film carries what is left within the inertia of 5 kg.
    let film = free("less.csv", 8000.0);
    assert!(number(&film, "ecc") < ecc - 1e-3, "{film}");
    assert!((number(&film, "load_n") - 8000.0).abs() <= 50.0, "{film}");
}

#[test]
fn what_is_written_is_what_is_printed() {
    let gap = |k: i32| 20.0 + f64::from((3 * (k % 9) + 5 * (k / 9)) % 7);
    let map = Map { columns: 9, rows: 7, values: (0..63).map(gap).collect() };
    fs::write(folder().join("gap.csv"), map.csv()).unwrap();
    let units = "--x-unit 1e-3 --h-unit 1e-6 --p-unit 1e5";
    let arguments = format!(
        "--lx 20 --ly 10 {units} --speed 3 --viscosity 0.05 --ambient 1 --side south=closed --side north=2.5"
    );
    let film = json(&format!("--map gap.csv {arguments}"));
    let keys = "outcome load_n load_x_m load_y_m friction_moving_n friction_fixed_n power_w flow_m3_s \
                mass_imbalance_m3_s peak_pressure_pa least_gap_m broken_share ecc attitude_deg \
                stiffness_n_m damping_n_s_m seconds unknowns";
    for key in keys.split_whitespace() {
        assert!(film.get(key).is_some(), "{key}");
    }
    assert_eq!((&film["outcome"], &film["unknowns"]), (&"converged".into(), &63.into()));
    for key in ["ecc", "attitude_deg", "stiffness_n_m", "damping_n_s_m"] {
        assert!(film[key].is_null(), "{key}");
    }
    assert_abs_diff_eq!(number(&film, "least_gap_m"), 2e-5, epsilon = 1e-20);
    let target = folder().join("target");
    let read = |name: &str| fs::read(target.join(name)).unwrap();
    let pressures = rows(&target.join("film-pressure.csv"), 0).concat();
    let load: f64 = pressures.iter().map(|p| (p - 1e5) * 2e-4 / 63.0).sum();
    near(number(&film, "load_n"), load, 1e-12);
    let npy = read("film-pressure.npy");
    assert_eq!((npy.len() - 63 * 8) % 64, 0);
    let stored =
        npy[npy.len() - 63 * 8..].chunks(8).map(|v| f64::from_le_bytes(v.try_into().unwrap()));
    assert!(stored.eq(pressures.iter().copied()));
    let svg = text(&read("film.svg"));
    assert!(svg.contains("Film content") && !svg.contains("NaN"));

    // Its own NPY is a map: film content as a gap, a solution of another film.
    let again = film_of(&format!("--map target/film-pressure.npy --out again {arguments}"));
    assert!(again.contains("9 × 7 cells, 63 unknowns"), "{again}");
}

#[test]
fn a_viscosity_in_centipoise_is_told() {
    for (viscosity, is_told) in [("40", true), ("0.04", false)] {
        let arguments = "--pad plane,4e-5,2e-5 --lx 0.05 --ly 0.03 --nx 20 --ny 12 --speed 3";
        let output = film(&format!("{arguments} --viscosity {viscosity}"));
        succeeded(&output, arguments);
        let told = "warning: a viscosity of 40 Pa s is more than that of lubricating oils";
        assert_eq!(text(&output.stderr).contains(told), is_told, "{}", text(&output.stderr));
    }
}

#[test]
fn films_that_carry_nothing_say_why() {
    let told = |arguments: &str| {
        let film = film(&format!("{arguments} --lx 0.05 --ly 0.03 --nx 20 --ny 12"));
        succeeded(&film, arguments);
        text(&film.stderr)
    };
    let turn = "turn the gap round, or change the sign of --speed";
    let wrong = "--pad plane,2e-5,4e-5 --speed 3 --viscosity 0.04";
    let report = film_of(&format!("{wrong} --lx 0.05 --ly 0.03 --nx 20 --ny 12"));
    assert!(report.contains("broken            100.0000 %"), "{report}");
    let err = told(wrong);
    assert!(err.starts_with("warning: the film carries nothing") && err.contains(turn), "{err}");
    // A supply that leaves no film is fed, and a starved film may be too empty for its gap.
    let right = "--pad plane,4e-5,2e-5 --speed 3 --viscosity 0.04";
    assert_eq!(told(&format!("{right} --supply 0,0,0.05,0.03,1e5")), "");
    let err = told(&format!("{right} --side west=starved,0.3"));
    assert!(err.trim_end().ends_with("or let more oil in at the starved side"), "{err}");
    // Neither would help where the gap is even, or a taper lost in the first cell.
    for pad in ["plane,2e-5,2e-5", "taper,4e-5,2e-5,3e-5"] {
        let err = told(&format!("--pad {pad} --speed 3 --viscosity 0.04"));
        assert!(err.contains("its gap is the same everywhere") && !err.contains(turn), "{err}");
    }
    // Nothing is carried away, so that the film stays full.
    let err = told("--pad plane,4e-5,2e-5 --speed 3,-3 --viscosity 0.04");
    assert!(err.contains("the speeds of the walls cancel") && !err.contains("dry"), "{err}");
}

#[test]
fn a_ring_that_nothing_feeds_runs_dry() {
    let warned = |arguments: &str| {
        let output = film(arguments);
        succeeded(&output, arguments);
        let err = text(&output.stderr);
        assert!(err.starts_with("warning: nothing feeds this film, so it runs dry; feed"), "{err}");
        err
    };
    let bearing = format!("{} --ecc 0.5 --nx 60 --ny 10", journal(0.1));
    let err = warned(&bearing);
    assert!(
        err.contains("by --groove 0,2e5, --ambient 101325 where oil surrounds it or --supply"),
        "{err}"
    );
    for (asked, what) in [
        ("--load 1000", "it runs dry and carries nothing instead of 1000 N; feed it above"),
        ("--coefficients", "it runs dry and answers to no motion; feed it above"),
    ] {
        let output = film(&format!("{bearing} {asked}"));
        assert!(is_refusal(&output, asked, what).starts_with("error: --"));
    }
    let fed = film_of(&format!("{} --ecc 0.5 --ambient 1e5 --nx 60 --ny 10", journal(0.1)));
    assert!(fed.lines().count() > 8 && fed.lines().count() < 25, "{fed}");
    // Each remedy that is named is one.
    let closed = "--pad plane,4e-5,2e-5 --lx 0.02 --ly 0.01 --nx 20 --ny 10 --viscosity 0.03 \
                  --speed 2 --side west=closed --side east=closed --side north=closed";
    let err = warned(&format!("{closed} --side south=closed"));
    assert!(err.contains("by --side south=101325 or --supply"), "{err}");
    assert!(film_of(&format!("{closed} --side south=101325")).lines().count() > 8);
    assert!(film_of(&format!("{bearing} --groove 0,2e5")).lines().count() > 8);
}

/// The load is that of the pressure below the ambient one; options are honoured, files written.
#[test]
fn a_dry_film_is_solved_like_any_other() {
    let pad = "--pad plane,40,20 --lx 0.05 --ly 0.03 --h-unit 1e-6 --viscosity 0.04 --nx 6 --ny 4 \
               --speed 3 --ambient 1e5 --side west=starved,0 --side south=closed \
               --side north=closed";
    let contents = |name: &str| rows(&folder().join(name), 0).concat();
    let dry = json(&format!("{pad} --side east=starved,0 --certify --out starved"));
    // -1e5 Pa on 15 cm², but for the rounding of a sum of 24 and of its cells
    assert!((number(&dry, "load_n") + 150.0).abs() <= 150.0 * 32.0 * f64::EPSILON, "{dry}");
    assert_eq!((&dry["outcome"], &dry["converged"]), (&"converged".into(), &true.into()));
    assert!(number(&dry["bounds"], "load_n") <= 1e-9, "{dry}");
    assert!(contents("starved-content.csv").iter().all(|content| content.abs() <= 1e-15));
    // No wall carries oil away from the last cells, so none has to break.
    let dry = json(&format!("{pad} --side east=closed --out closed"));
    assert!((number(&dry, "load_n") + 150.0).abs() <= 1e-12, "{dry}");
    for (k, content) in contents("closed-content.csv").iter().enumerate() {
        let wanted = if k % 6 == 5 { 1.0 } else { 0.0 };
        assert_abs_diff_eq!(*content, wanted, epsilon = 1e-15);
    }
    let still = "--pad plane,40,20 --lx 0.05 --ly 0.03 --h-unit 1e-6 --viscosity 0.04 \
                 --side west=closed --side east=closed --side south=closed --side north=closed";
    let err = text(&film(still).stderr);
    assert!(err.contains("nothing enters or leaves, so any even pressure is a solution"), "{err}");
}

/// Plane pads whose load an exact evaluation puts at 221.66442387943505 … 547 (80 cells a side).
#[test]
fn bounds_hold_for_what_is_printed() {
    let pad = "--pad plane,20e-6,10e-6 --lx .02 --ly .02 --speed 1 --viscosity .04 --nx 80 --ny 80 \
               --certify";
    let found = json(pad);
    let (load, bound) = (number(&found, "load_n"), number(&found["bounds"], "load_n"));
    for exact in [221.664_423_879_435_05, 221.664_423_879_435_47] {
        assert!((load - exact).abs() <= bound && bound <= 1e-10, "{load} {bound}");
    }
    let report = film_of(pad);
    let mut proved = report.lines().filter_map(|line| line.split_once(", proved between "));
    let (_, ends) = proved.next().expect("a proved load");
    let ends: Vec<f64> = ends.split(" and ").map(|end| end.parse().unwrap()).collect();
    assert!(ends[0] <= 221.664_423_879_435_05 && 221.664_423_879_435_47 <= ends[1], "{report}");
    assert!(ends[1] - ends[0] <= 1e-10, "{report}");
    // both walls, four sides and the peak
    assert_eq!(proved.count(), 7, "{report}");
    // The load of a journal is the length of a vector.
    let found = json(&format!("{} --ecc 0.5 --groove 0,1e5 --certify", journal(0.1)));
    let (load, bound) = (number(&found, "load_n"), number(&found["bounds"], "load_n"));
    assert!(bound > 0.0 && bound <= 1e-9 * load, "{found}");
    assert_eq!(found["bounds"]["flow_m3_s"]["supplies"].as_array().map(Vec::len), Some(1));
}

/// Without a pressure above that of cavitation all pressures go with μU/h², so the range of the
/// load is known; with one the film itself has to be in it.
#[test]
fn films_within_a_tolerance_are_in_the_range() {
    let pad = "--pad plane,2e-5,1e-5 --lx .02 --ly .02 --speed 1 --viscosity 0.04 --nx 20 --ny 20 \
               --data-tolerance 0.01";
    let found = json(pad);
    let ends = |of: &Value| [0, 1].map(|k| of[k].as_f64().expect("an end"));
    let [lower, upper] = ends(&found["range"]["load_n"]);
    let ratio = (1.01_f64 / 0.99).powi(2) * number(&found, "load_n");
    assert!((upper / ratio - 1.0).abs() < 1e-9, "{found}");
    assert!((lower * upper / number(&found, "load_n").powi(2) - 1.0).abs() < 1e-9, "{found}");
    let fed = json(&format!("{pad} --supply 4e-3,4e-3,4e-3,4e-3,1e6"));
    let inside = |found: &Value, range: &Value| {
        let ([lower, upper], found) = (ends(range), found.as_f64().expect("a number"));
        assert!(lower <= found && found <= upper, "{found} not in {lower} to {upper}");
    };
    for name in ["load_n", "friction_moving_n", "friction_fixed_n", "peak_pressure_pa"] {
        inside(&fed[name], &fed["range"][name]);
    }
    let [flows, range] = [&fed, &fed["range"]].map(|of| &of["flow_m3_s"]);
    for side in ["west", "east", "south", "north"] {
        inside(&flows[side], &range[side]);
    }
    inside(&flows["supplies"][0], &range["supplies"][0]);
    let [lower, upper] = ends(&fed["range"]["load_n"]);
    assert!(upper / lower < 1.2, "{fed}");
}
