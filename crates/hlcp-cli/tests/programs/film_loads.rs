//! `hlcp film --load`: the position of a wall that carries it.

use approx::assert_abs_diff_eq;

use crate::{
    command::{is_refusal, near, number},
    common::{asked, uniform},
    film_plane::{film, journal, json},
};

#[test]
fn the_position_for_a_load_carries_it() {
    let bearing = format!("{} --nx 120 --ny 20", journal(0.1));
    // A load in a direction of its own, with grooves that stay: at 90° from the widest gap of
    // attitude 0, on both sides of the load.
    let fixed = json(&format!("{bearing} --groove 90 --groove 270 --attitude 0 --load 12000"));
    near(number(&fixed, "load_n"), 12000.0, 1e-8);
    let middle = std::f64::consts::PI * 0.1 / 2.0;
    assert_abs_diff_eq!(number(&fixed, "load_x_m"), middle, epsilon = 1e-8);
    assert!((30.0..70.0).contains(&number(&fixed, "attitude_deg")), "{fixed}");

    let pad =
        "--pad plane,4e-5,2e-5 --lx 0.05 --ly 0.03 --nx 50 --ny 20 --speed 3 --viscosity 0.04";
    let pivoted = json(&format!("{pad} --load 900,0.029,0.016"));
    for (key, wanted) in [("load_n", 900.0), ("load_x_m", 0.029), ("load_y_m", 0.016)] {
        near(number(&pivoted, key), wanted, 1e-8);
    }
}

/// Holds that the load of a position is found again, wherever that is.
fn finds(arguments: &str, load: f64) {
    // The search ends at 1e-9 of the load; of a load at a place, of the load and its arms.
    near(number(&json(arguments), "load_n"), load, 1e-9);
}

/// `HLCP_ATTACK_RUNS=1000 cargo test --release -p hlcp-cli --test programs loads_of_known` takes
/// some minutes.
#[test]
fn loads_of_known_pads_are_found() {
    for seed in 0_u64..asked("HLCP_ATTACK_RUNS", 12) {
        let mut next = uniform((!seed).wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(1));
        let [lx, ly] = [0.05, 0.05 * 0.25 * 8.0_f64.powf(next())];
        let height = 5e-6 * 20.0_f64.powf(next());
        let along = -0.95 * next();
        let across = (1.8 * next() - 0.9) * (1.0 + along);
        let slopes = [along * height / (lx / 2.0), across * height / (ly / 2.0)];
        let ambient = if next() < 0.5 { 0.0 } else { 1e5 };
        let mut pad = format!(
            "--lx {lx} --ly {ly} --nx 30 --ny 20 --speed 2 --viscosity 0.04 --ambient {ambient}"
        );
        if next() < 0.3 {
            pad += &format!(" --pocket 0.01,{},0.01,{},1e-5", ly / 4.0, ly / 2.0);
        }
        if next() < 0.3 {
            let pressure = 1e5 + 9e5 * next();
            pad += &format!(" --supply 0.02,{},0.01,{},{pressure}", ly / 4.0, ly / 2.0);
        }
        let [sx, sy] = slopes;
        let tilted =
            |height: f64| format!("{pad} --pad plane,{height:e},{height:e} --tilt={sx:e},{sy:e}");
        let known = json(&tilted(height));
        let [load, x, y] = ["load_n", "load_x_m", "load_y_m"].map(|key| number(&known, key));
        if load <= 0.0 || !(0.0..=lx).contains(&x) || !(0.0..=ly).contains(&y) {
            continue;
        }
        let other = height * (1.0 + 9.0 * next());
        finds(&format!("{} --load {load:e}", tilted(other)), load);
        let elsewhere = [height * (0.3 + next()), height * (1.0 + 3.0 * next())];
        let start = if next() < 0.5 { [4e-5, 2e-5] } else { [elsewhere[1], elsewhere[0]] };
        let start = format!("--pad plane,{:e},{:e}", start[0], start[1]);
        finds(&format!("{pad} {start} --load {load:e},{x:e},{y:e}"), load);
    }
}

#[test]
fn light_loads_and_grooves_off_the_load_are_balanced() {
    let bearing = "--journal --diameter 0.08 --length 0.06 --clearance 6e-5 --rpm 3000 \
                   --viscosity 0.02 --nx 120 --ny 20";
    for (grooves, attitude, load) in [
        ("--groove 0", 30, 300.0),
        ("--groove 270,5e4", 0, 50.0),
        ("--groove 90", 0, 50.0),
        ("--groove 180", 30, 50000.0),
        ("--groove 0,5e4", 30, 50.0),
        ("--groove 270,5e4 --groove 300,1e5", 0, 300.0),
        ("--groove 30,2e5", 30, 300.0),
    ] {
        finds(&format!("{bearing} {grooves} --attitude {attitude} --load {load}"), load);
    }
    // Its groove carries more at every eccentricity; a search once ended below none.
    let output = film(&format!("{bearing} --groove 0,1e5 --load 50"));
    let err = is_refusal(&output, "--load 50", "does not prove that there is none");
    assert!(err.contains("carries 1.4") && err.contains(" N or more"), "{err}");
    // A tenth of a micrometre is left, and rounding counts.
    let thin = format!("{} --groove 0,1e5 --nx 360 --ny 4", journal(0.1));
    for load in [8e6, 1e7, 1.1e7] {
        finds(&format!("{thin} --load {load}"), load);
    }
    let pad = "--lx 0.05 --ly 0.03 --nx 50 --ny 20 --speed 3 --viscosity 0.04 --h-unit um";
    for ends in ["40,20", "22,20", "100,20"] {
        finds(&format!("{pad} --pad plane,{ends} --load 900,0.026,0.015"), 900.0);
    }
}
