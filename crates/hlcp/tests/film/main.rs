//! Films as a library: walls that carry a load, in `carry.rs`; walls that move, in `motion.rs`;
//! derivatives against differences; published bearings.

mod carry;
mod motion;

use std::{
    cell::Cell,
    f64::consts::{PI, TAU},
    ops::ControlFlow,
};

use hlcp::film::{
    Bearing, Coefficients, Drive, Film, FilmError, Journal, Load, Lobes, Motion, Pad, Parameter,
    Pocket, Sensitivity, Settings, Side, Solved, Supply, Threshold,
};
use hlcp_methods::{Limits, Progress};
use proptest::prelude::*;

/// `HLCP_CASES` cases, or so many.
fn config(usual: u32) -> ProptestConfig {
    let wanted = std::env::var("HLCP_CASES").ok().and_then(|n| n.parse().ok());
    ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(wanted.unwrap_or(usual))
    }
}

#[test]
fn a_step_has_no_derivatives_of_a_bearing() {
    let settings = Settings::default();
    let mut motion = Motion::new(journal([24, 4], 10.0), &settings).unwrap();
    motion.step(1e-3, &Drive::To(vec![1e-6, 0.0]), &settings).unwrap();
    let (bearing, solved) = (&motion.bearing, motion.solved.as_ref().unwrap());
    let refused = [
        Coefficients::new(bearing, solved).err(),
        Coefficients::at(bearing, solved, 50.0).err(),
        bearing.sensitivities(solved, &[], None).err(),
    ];
    assert!(refused.iter().all(|error| matches!(error, Some(FilmError::Unsteady))), "{refused:?}");
}

/// A slider from h₁ down to h₂ that is starved to θ: its film forms again where q = Uθh₁/2 fills
/// the gap, at 1/hᵣ = 2/(θh₁) − 1/h₂, and p′ = 12μ(Uh/2 − q)/h³ from there on.
#[test]
fn a_starved_slider_carries_what_its_closed_form_says() {
    let ([h1, h2], [u, mu, length]) = ([44e-6, 20e-6], [5.0, 0.03, 0.06]);
    for content in [0.5, 0.55, 0.6] {
        let errors = [180, 720].map(|nx| {
            let film = Film::new([nx, 1], [length, 1.0], u, mu);
            let mut film = film.with_gap(|x, _| h1 + (h2 - h1) * x / length);
            film.sides = [Side::Starved(content), Side::Pressure(0.0), Side::Closed, Side::Closed];
            let solved = Solved::new(film, None, &Settings::default()).unwrap();
            let figures = solved.film.figures(&solved.z, &solved.r, 0.0);
            let (q, slope) = (u * content * h1 / 2.0, (h2 - h1) / length);
            let begins = (u / q - 1.0 / h2).recip();
            let rest = q / (2.0 * begins * begins) - u / (2.0 * begins);
            let inside = |h: f64| -u / 2.0 * h.ln() - q / (2.0 * h) - rest * h;
            let load = 12.0 * mu / (slope * slope) * (inside(h2) - inside(begins));
            assert!((figures.sides[0] / -q - 1.0).abs() <= 1e-9, "{:?} {q}", figures.sides);
            (figures.load / load - 1.0).abs()
        });
        // Of second order, but that the front keeps to faces.
        assert!(errors[0] <= 4e-3 && errors[1] <= errors[0] / 8.0, "{content}: {errors:?}");
    }
}

/// Rings between a flooded and a starved side, on which algebraic multigrid alone goes on for
/// hundreds of steps and more, each with a linear system that it does not solve.
#[test]
fn another_method_soon_takes_over_where_multigrid_is_lost() {
    for (amplitude, across) in [(0.4, 0.8), (0.6, 1.0)] {
        let film = Film::new([23, 46], [0.0659, 0.0122], 10.0, 0.03);
        let wave = |x: f64, y: f64| TAU * (x / 0.0659 + across * y / 0.0122);
        let film = film.with_gap(|x, y| 1e-5 * (1.0 + amplitude * wave(x, y).cos()));
        let [round, south, north] = [Side::Periodic, Side::Pressure(2.33), Side::Starved(0.166)];
        let film = Film { sides: [round, round, south, north], ..film };
        let seen = [(); 2].map(|()| Cell::new(0));
        let watch = |name: &str, _: &Limits, _: f64, progress: &Progress<'_, f64>| {
            seen[usize::from(name == "AUTO")].set(progress.iteration);
            ControlFlow::Continue(())
        };
        let settings = Settings { watch: Some(&watch), ..Settings::default() };
        let solved = Solved::new(film, None, &settings).unwrap();
        assert!(solved.outcome.converged(), "{}", solved.outcome);
        assert!(seen[0].get() <= 50 && seen[1].get() > 0, "{seen:?}");
    }
}

proptest! {
    #![proptest_config(config(64))]

    /// The least gap is that of so many places around both ends.
    #[test]
    fn a_journal_meets_its_bush_between_the_middles_of_cells(
        (count, preload, offset, middle) in (1..6_usize, 0.0..0.9, 0.0..1.0, 0.0..6.0),
        (x, y, a, b) in (-8e-5..8e-5, -8e-5..8e-5, -1e-3..1e-3, -1e-3..1e-3),
    ) {
        let (clearance, lobes) = (1e-4, Lobes { count, preload, offset, middle });
        let round = Journal::round(0.1, 0.05, clearance);
        let bearing =
            Bearing::journal(Journal { tilt: [a, b], lobes: Some(lobes), ..round }, [3, 1]);
        let place = |k: i32| {
            let (angle, end) = (PI * f64::from(k) / 2000.0, if k % 2 == 0 { 0.025 } else { -0.025 });
            let (sin, cos) = angle.sin_cos();
            clearance * lobes.gap(angle) + (x + end * a) * cos + (y + end * b) * sin
        };
        let least = (0..4000).map(place).fold(f64::INFINITY, f64::min);
        let [gap, angle] = bearing.nearest(&[x, y]).unwrap();
        // Between two places it falls by their distance times its slope at most, where it jumps.
        let slope = 2.0 * clearance + (x.hypot(y) + 0.025 * a.hypot(b));
        prop_assert!(gap <= least + 1e-18 && gap >= least - PI / 1000.0 * slope, "{gap} {least}");
        prop_assert!(gap > 0.0 || bearing.at(&[x, y]).is_none());
        prop_assert!((0.0..TAU).contains(&angle));
    }
}

/// A journal of 100 mm by 50 mm, in its middle, fed by a groove of 1 bar.
fn journal(cells: [usize; 2], speed: f64) -> Bearing {
    let mut bearing = Bearing::journal(Journal::round(0.1, 0.05, 1e-4), cells);
    bearing.film.speeds = [speed, 0.0];
    bearing.film.viscosity = vec![0.02];
    bearing.film.supplies = vec![Supply { corner: [0.0, 0.0], size: [0.0, 0.05], pressure: 1e5 }];
    bearing
}

/// Stiffness is what the forces lose by each coordinate, in a full film and in one that breaks.
#[test]
fn stiffness_is_a_sensitivity() {
    for (cells, cavitation) in [([60, 20], 0.0), ([20, 60], 9e4)] {
        let film = Film::new(cells, [0.05, 0.03], 3.0, 0.04);
        let film = film.with_gap(|x, y| 4e-5 - 4e-4 * x + 1e-5 * (200.0 * y).sin());
        let pad = Bearing::pad(Film { sides: [Side::Pressure(1e5); 4], cavitation, ..film });
        let solved = Solved::new(pad.here().unwrap(), None, &Settings::default()).unwrap();
        let found = Coefficients::new(&pad, &solved).unwrap().stiffness;
        let position = [0, 1, 2].map(Parameter::Position);
        let gained = pad.sensitivities(&solved, &position, None).unwrap();
        for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
            let off = (found[row][column] + gained[column].forces[row]).abs();
            let size = (found[row][row] * found[column][column]).sqrt();
            assert!(off <= 1e-9 * size, "{row} {column}: {off}");
        }
    }
}

/// In the middle of lobes that are alike the journal is pushed alike in all directions.
#[test]
fn three_and_four_lobes_have_no_direction() {
    for (count, offset) in [(3, 0.5), (4, 0.5), (3, 0.9)] {
        let lobes = Some(Lobes { count, preload: 0.4, offset, middle: 0.7 });
        let of = Journal { lobes, ..Journal::round(0.1, 0.05, 1e-4) };
        let mut bearing = Bearing::journal(of, [72, 8]);
        bearing.film.speeds = [15.0, 0.0];
        bearing.film.viscosity = vec![0.02];
        bearing.film.supplies = (0..count)
            .map(|k| of.groove(10.0 + 360.0 * (k as f64 + 0.5) / count as f64, [0.0, 0.05], 1e5))
            .collect();
        let solved = Solved::new(bearing.here().unwrap(), None, &Settings::default()).unwrap();
        let found = Coefficients::new(&bearing, &solved).unwrap();
        for matrix in [found.stiffness, found.damping] {
            let [along, across] = [&matrix[0], &matrix[1]];
            let size = along[0].abs().max(along[1].abs());
            assert!((along[0] - across[1]).abs() <= 1e-7 * size, "{matrix:?}");
            assert!((along[1] + across[0]).abs() <= 1e-7 * size, "{matrix:?}");
        }
        // The narrowest cell is within half a cell of where each lobe is, so far into it.
        let gap = &bearing.film.gap[..72];
        let at = (0..72).min_by(|&k, &l| gap[k].total_cmp(&gap[l])).unwrap();
        let (turn, arc) = (std::f64::consts::TAU, std::f64::consts::TAU / count as f64);
        let into = ((at as f64 + 0.5) * turn / 72.0 - 0.7 + 0.5 * arc).rem_euclid(arc);
        assert!((into - offset * arc).abs() <= 0.51 * turn / 72.0, "{into}");
        assert!((6e-5..=6.01e-5).contains(&gap[at]), "{}", gap[at]);
    }
}

/// Nothing leaves sideways: the flow is U times half of the gap where the pressure has its peak.
#[test]
fn a_taper_and_its_land_have_their_closed_form() {
    let (west, land, taper, whole): (f64, f64, f64, f64) = (4e-5, 2e-5, 0.04, 0.05);
    let slope = (west - land) / taper;
    let rest = whole - taper;
    let square = (land.recip() - west.recip()) / slope + rest / land.powi(2);
    let cube = (land.powi(-2) - west.powi(-2)) / (2.0 * slope) + rest / land.powi(3);
    let (peak_gap, drive) = (square / cube, 6.0 * 0.04 * 3.0);
    // ∫ (h − h*)/h³ from the west to where h = h*.
    let peak = drive
        * ((peak_gap.recip() - west.recip()) / slope
            - peak_gap * (peak_gap.powi(-2) - west.powi(-2)) / (2.0 * slope));
    let film = Film::new([500, 1], [whole, 0.01], 3.0, 0.04);
    let mut film = Pad::Taper([west, land], taper).gap(film);
    (film.sides[2], film.sides[3]) = (Side::Closed, Side::Closed);
    let solved = Solved::new(film, None, &Settings::default()).unwrap();
    let figures = solved.film.figures(&solved.z, &solved.r, 0.0);
    // Of second order: (cells⁻¹ (west − land)/land)² and less.
    assert!((figures.sides[1] / (0.01 * 1.5 * peak_gap) - 1.0).abs() <= 4e-6);
    assert!((figures.peak / peak - 1.0).abs() <= 4e-5, "{} {peak}", figures.peak);
}

/// A bearing from the numbers that it depends on, with the parameter of each; the rest is drawn.
type Built = (Bearing, Vec<Parameter>);

/// A journal by speeds, viscosity, clearance, eccentricity, ambient pressure, cavitation pressure,
/// those of the north side, of a groove and of a pocket that is kept full, and a pocket's depth.
fn any_journal(v: &[f64], [turn, around]: [f64; 2]) -> Built {
    let lobes = Some(Lobes { count: 3, preload: 0.1, offset: 0.8, middle: 0.4 });
    let tilt = [2e-5, -3e-5];
    let journal = Journal { tilt, lobes, ..Journal::round(0.1, 0.06, v[3]) };
    let mut bearing = Bearing::journal(journal, [36, 6]);
    let length = bearing.film.lengths[0];
    bearing.film.speeds = [v[0], v[1]];
    bearing.film.viscosity = (0..216).map(|k| v[2] + 1e-3 * f64::from(k % 7)).collect();
    (bearing.film.cavitation, bearing.ambient) = (v[6], v[5]);
    (bearing.film.sides[2], bearing.film.sides[3]) = (Side::Pressure(v[5]), Side::Pressure(v[7]));
    bearing.film.supplies = vec![
        Supply { corner: [around * length, 0.0], size: [0.0, 0.06], pressure: v[8] },
        Supply { corner: [0.3 * length, 0.02], size: [0.1 * length, 0.02], pressure: v[9] },
        Supply { corner: [0.8 * length, 0.0], size: [0.0, 0.02], pressure: v[5] },
    ];
    let dig = |film: &mut Film, depth: f64| {
        let corner = [0.55 * length, 0.01];
        assert!(Pocket { corner, size: [0.02, 0.03], depth, ellipse: true }.dig(film));
    };
    let mut zero = Film { gap: vec![0.0; 216], ..bearing.film.clone() };
    dig(&mut zero, 1.0);
    dig(&mut bearing.film, v[10]);
    bearing.position = vec![v[4] * v[3] * turn.cos(), v[4] * v[3] * turn.sin()];
    let parameters = [
        Parameter::Speed(0),
        Parameter::Speed(1),
        Parameter::Viscosity,
        Parameter::Clearance,
        Parameter::Eccentricity,
        Parameter::Ambient,
        Parameter::Cavitation,
        Parameter::Side(3),
        Parameter::Supply(0),
        Parameter::Supply(1),
        Parameter::Gap(zero.gap),
    ];
    (bearing, parameters.into())
}

/// A pad by speed, viscosity, rise, slopes, ambient pressure, content of the oil that enters, and
/// a groove's pressure.
fn any_pad(v: &[f64]) -> Built {
    let mut film = Film::new([30, 8], [0.05, 0.03], v[0], v[1]);
    film = film.with_gap(|x, y| 3e-5 - 2e-4 * x + 6e-6 * (300.0 * x).sin() * (150.0 * y).cos());
    film.sides = [Side::Starved(v[6]), Side::Pressure(v[5]), Side::Closed, Side::Pressure(v[5])];
    film.supplies = vec![Supply { corner: [0.035, 0.0], size: [0.0, 0.012], pressure: v[7] }];
    let bearing = Bearing { position: v[2..5].to_vec(), ambient: v[5], ..Bearing::pad(film) };
    let parameters = [
        Parameter::Speed(0),
        Parameter::Viscosity,
        Parameter::Position(0),
        Parameter::Position(1),
        Parameter::Position(2),
        Parameter::Ambient,
        Parameter::Side(0),
        Parameter::Supply(0),
    ];
    (bearing, parameters.into())
}

/// The figures that have derivatives, those together whose rounding is of one size.
fn all_figures(bearing: &Bearing, solved: &Solved) -> Vec<Vec<f64>> {
    let Solved { film, z, r, .. } = solved;
    let figures = film.figures(z, r, bearing.ambient);
    let [load, x, _] = bearing.load(film, &figures, z);
    let drags = [figures.friction, figures.full_friction].map(|pair| bearing.drag(pair));
    let angles = bearing.attitude(x).map_or(vec![], Vec::from);
    vec![
        [bearing.forces(film, z), vec![load]].concat(),
        vec![figures.power],
        vec![figures.peak],
        drags.concat(),
        [figures.sides.to_vec(), figures.supplies].concat(),
        bearing.position.clone(),
        angles,
    ]
}

fn all_slopes(found: &Sensitivity) -> Vec<Vec<f64>> {
    let slopes = &found.slopes;
    vec![
        [found.forces.clone(), vec![slopes.load]].concat(),
        vec![slopes.power],
        vec![slopes.peak],
        [slopes.friction, slopes.full_friction].concat(),
        [slopes.sides.to_vec(), slopes.supplies.clone()].concat(),
        found.position.clone(),
        found.ecc.into_iter().chain(found.attitude).collect(),
    ]
}

/// Holds the sensitivities of a bearing against differences to seven digits, or, under the load
/// that it carries, to what a search leaves; `steps` are the largest changes.
fn differ(
    build: impl Fn(&[f64]) -> Built,
    v: &[f64],
    steps: &[f64],
    load: Option<fn(&[f64]) -> Load>,
) -> Result<(), TestCaseError> {
    let (settings, (mut bearing, _)) = (Settings::default(), build(v));
    let film = bearing.here();
    prop_assume!(film.is_some());
    let mut solved = Solved::new(film.unwrap(), None, &settings).unwrap();
    prop_assume!(solved.outcome.converged());
    let load = load.map(|load| load(&bearing.forces(&solved.film, &solved.z)));
    let solve = |v: &[f64], known: &Bearing, start: &Solved| {
        let (mut bearing, _) = build(v);
        let Some(load) = &load else {
            let solved = Solved::new(bearing.here()?, Some(start), &settings).unwrap();
            return Some((bearing, solved));
        };
        bearing.position.clone_from(&known.position);
        let carried = bearing.carry(load, Some(start), &settings).unwrap();
        carried.found.then_some((bearing, carried.solved))
    };
    let begun = solve(v, &bearing, &solved);
    prop_assume!(begun.is_some());
    (bearing, solved) = begun.unwrap();
    let (_, parameters) = build(v);
    let found = bearing.sensitivities(&solved, &parameters, load.as_ref());
    prop_assert!(found.is_ok(), "{found:?}");
    let found = found.unwrap();
    let broken = |solved: &Solved| solved.r.iter().map(|r| *r > 0.0).collect::<Vec<_>>();
    let (here, now, mut held) = (broken(&solved), all_figures(&bearing, &solved), 0);
    for (k, found) in found.iter().enumerate() {
        // A film is as smooth as the set of broken cells lasts.
        let mut tried = [1.0, 0.3, 0.1, 0.03].into_iter().map(|part| {
            let step = part * steps[k];
            let at = |by: f64| {
                let mut v = v.to_vec();
                v[k] += by * step;
                let (bearing, solved) = solve(&v, &bearing, &solved)?;
                (broken(&solved) == here).then(|| all_figures(&bearing, &solved))
            };
            let slope = |by: f64| {
                let (less, more) = (at(-by)?, at(by)?);
                let pairs = more.concat().into_iter().zip(less.concat()).zip(now.concat());
                let differences = |((more, less), now)| {
                    let bend = (more - 2.0 * now + less) / (by * by * step);
                    [(more - less) / (2.0 * by * step), bend]
                };
                Some(pairs.map(differences).collect::<Vec<_>>())
            };
            Some((step, [slope(1.0)?, slope(0.5)?, slope(0.25)?]))
        });
        let Some((step, [wide, half, near])) = tried.find_map(|tried| tried) else { continue };
        let sizes = now.iter().flat_map(|group| {
            vec![group.iter().fold(0.0_f64, |size, v| size.max(v.abs())); group.len()]
        });
        for (i, (exact, size)) in all_slopes(found).concat().into_iter().zip(sizes).enumerate() {
            let [one, other] = [(&wide, &half), (&half, &near)]
                .map(|(wide, near)| (4.0 * near[i][0] - wide[i][0]) / 3.0);
            let bends = (wide[i][1] - half[i][1]).abs();
            // What a solve leaves of the differences.
            let rounding = if load.is_some() { 1e-9 } else { 1e-11 } * size / step;
            // Drags have kinks of their own, and the peak jumps from cell to cell.
            let is_smooth = bends <= 1e-7 * exact.abs() + 10.0 * rounding;
            if is_smooth && (one - other).abs() <= 1e-8 * exact.abs() + rounding {
                let off = (exact - other).abs();
                let most = 1e-7 * exact.abs() + 10.0 * rounding;
                prop_assert!(off <= most, "{k} {i}: {exact} {other}");
                held += 1;
            }
        }
    }
    prop_assume!(held > 30);
    Ok(())
}

proptest! {
    #![proptest_config(config(2))]

    #[test]
    fn a_journals_sensitivities_are_differences_of_its_figures(
        (speed, other, viscosity, clearance) in (5.0..20.0, -2.0..2.0, 0.01..0.04, 8e-5..1.5e-4),
        (ecc, turn) in (0.1..0.85, 0.0..std::f64::consts::TAU),
        // Not on the face of the other groove, of 36, which has another pressure.
        around in prop_oneof![0.0..0.79, 0.82..1.0],
        pressures in [5e4..1e5, 0.0..4e4, 6e4..3e5, 6e4..3e5, 6e4..3e5],
        depth in 1e-5..1e-4,
    ) {
        let [ambient, cavitation, north, groove, pocket] = pressures;
        let v = [speed, other, viscosity, clearance, ecc, ambient, cavitation, north, groove,
            pocket, depth];
        let steps = [0.02, 0.02, 2e-5, 1e-7, 1e-3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e-7];
        differ(|v| any_journal(v, [turn, around]), &v, &steps, None)?;
        // Wider, so that what a search leaves does not count.
        let steps = steps.map(|step| 3.0 * step);
        differ(|v| any_journal(v, [0.0, around]), &v, &steps, Some(|f| Load::of(f[0].hypot(f[1]))))?;
        let against = |f: &[f64]| {
            Load { direction: Some(f[1].atan2(f[0])), ..Load::of(f[0].hypot(f[1])) }
        };
        differ(|v| any_journal(v, [turn, around]), &v, &steps, Some(against))?;
    }

    #[test]
    fn a_pads_sensitivities_are_differences_of_its_figures(
        (speed, viscosity, content) in (1.0..5.0, 0.01..0.04, 0.5..0.95),
        (rise, along, across) in (-2e-6..1e-5, -1e-4..1e-4, -1e-4..1e-4),
        pressures in [2e3..1e5, 1e4..3e5],
    ) {
        let v = [speed, viscosity, rise, along, across, pressures[0], content, pressures[1]];
        let steps = [3e-3, 2e-5, 1e-8, 1e-6, 1e-6, 500.0, 1e-3, 500.0];
        differ(any_pad, &v, &steps, None)?;
        let at = |forces: &[f64]| {
            let [x, y] = [0.025 + forces[1] / forces[0], 0.015 + forces[2] / forces[0]];
            Load { at: Some([x, y]), ..Load::of(forces[0]) }
        };
        // Wider, so that what a search leaves does not count.
        let steps = steps.map(|step| 3.0 * step);
        differ(any_pad, &v, &steps, Some(at))?;
    }
}

#[test]
fn slow_coefficients_are_those_at_no_frequency() {
    let bearing = Bearing { position: vec![5e-5, 2e-5], ..journal([48, 8], 15.0) };
    let solved = Solved::new(bearing.here().unwrap(), None, &Settings::default()).unwrap();
    let slow = Coefficients::new(&bearing, &solved).unwrap();
    assert_eq!(Coefficients::at(&bearing, &solved, 0.0).unwrap(), slow);
    // The next term is of second order in the frequency.
    let found = Coefficients::at(&bearing, &solved, 1e-4 * bearing.running_speed()).unwrap();
    for (one, other) in [(&slow.stiffness, &found.stiffness), (&slow.damping, &found.damping)] {
        let size = one.concat().into_iter().map(f64::abs).fold(0.0, f64::max);
        for (one, other) in one.concat().iter().zip(other.concat()) {
            assert!((one - other).abs() <= 1e-5 * size, "{one} {other}");
        }
    }
}

/// A rotor of half the critical mass comes to rest after a push, one of twice that does not.
#[test]
fn a_rotor_above_the_critical_mass_whirls() {
    let mut bearing = journal([36, 6], 15.0);
    bearing.position = vec![5e-5, 0.0];
    let settings = Settings::default();
    let load = Load { direction: Some(bearing.load_direction(0.0)), ..Load::of(1000.0) };
    let solved = bearing.carry(&load, None, &settings).unwrap().solved;
    let Threshold { mass, omega, .. } = Threshold::of(&bearing, &solved).unwrap().unwrap();
    let carried = bearing.forces(&solved.film, &solved.z);
    let sway = |mass: f64| {
        let mut motion = Motion::new(bearing.clone(), &settings).unwrap();
        let mut most = [0.0_f64; 5];
        for k in 0..5 * 48 {
            let push = if k < 12 { 1.01 } else { 1.0 };
            let load = carried.iter().map(|force| push * force).collect();
            let step = TAU / omega / 48.0;
            motion.step(step, &Drive::Under { load, mass }, &settings).unwrap();
            let off = motion.bearing.position.iter().zip(&bearing.position);
            most[k / 48] = off.map(|(now, at)| (now - at).abs()).fold(most[k / 48], f64::max);
        }
        most[4] / most[2]
    };
    let [light, heavy] = [0.5, 2.0].map(|by| sway(by * mass));
    assert!(light < 0.5 && heavy > 1.5, "{light} {heavy}");
}

/// Oil that flows along a gap which widens on the way pushes the journal aside.
#[test]
fn a_gap_that_widens_along_the_flow_holds_no_rotor() {
    for (widens, speed, mass) in [(1.5e-3, 1.0, 0.0), (-1.5e-3, 1.0, 1.0)] {
        let mut bearing = journal([24, 8], speed);
        bearing.film.supplies.clear();
        bearing.film.sides[2..].copy_from_slice(&[Side::Pressure(5e6), Side::Pressure(1e6)]);
        for (k, gap) in bearing.film.gap.iter_mut().enumerate() {
            *gap += widens * (((k / 24) as f64 + 0.5) / 8.0 - 0.5) * 0.05;
        }
        let solved = Solved::new(bearing.here().unwrap(), None, &Settings::default()).unwrap();
        let found = Threshold::of(&bearing, &solved).unwrap();
        assert_eq!(found.is_none_or(|found| found.mass > 0.0), mass > 0.0, "{found:?}");
    }
}

/// A journal of 100 mm by 100 mm and 50 turns a second, by the clamp of the published bearings:
/// grooves of 20° at both sides of the load, at the pressure around them, and the Sommerfeld number
/// `S = μ N L D (R/c)²/W`. Returns eccentricity and attitude, what the coefficients and the load
/// over the clearance are.
fn published(bearing: &mut Bearing, sommerfeld: f64) -> (f64, f64, Coefficients, f64) {
    let (settings, journal) = (Settings::default(), bearing.journal.unwrap());
    bearing.film.speeds = [5.0 * PI, 0.0];
    bearing.film.viscosity = vec![0.02];
    bearing.film.supplies =
        [90.0, 270.0].map(|at| journal.groove(at, [20.0, journal.length], 0.0)).to_vec();
    let room = 0.5 * journal.lobes.map_or(1.0, |lobes| 1.0 - lobes.preload);
    bearing.position[0] = room * journal.clearance;
    let load = 0.02 * 50.0 * 0.01 * (0.05 / journal.clearance).powi(2) / sommerfeld;
    let wanted = Load { direction: Some(bearing.load_direction(0.0)), ..Load::of(load) };
    let carried = bearing.carry(&wanted, None, &settings).unwrap();
    assert!(carried.found);
    let solved = carried.solved;
    let figures = solved.film.figures(&solved.z, &solved.r, 0.0);
    let [_, x, _] = bearing.load(&solved.film, &figures, &solved.z);
    let [ecc, attitude] = bearing.attitude(x).unwrap();
    let found = Coefficients::clamped(bearing, &solved, &settings).unwrap();
    (ecc, attitude, found, load / journal.clearance)
}

/// J. W. Lund and K. K. Thomsen, *A calculation method and data for the dynamic coefficients of
/// oil-lubricated journal bearings*, ASME, 1978: two lobes, a preload of ½, L/D = 1; S, ε, the
/// attitude, Kxx, Kxy, Kyx and Kyy in W/c, Bxx, Bxy and Byy in W/(cω).
#[test]
fn elliptical_bearings_are_those_of_lund_and_thomsen() {
    let lobes = Some(Lobes { count: 2, preload: 0.5, offset: 0.5, middle: 0.0 });
    let table = [
        [0.211, 0.260, 87.79, 6.65, 4.36, -3.21, 0.86, 13.09, -2.23, 3.70],
        [0.161, 0.304, 83.29, 5.63, 3.84, -2.32, 1.01, 10.75, -1.02, 3.07],
        [0.120, 0.350, 81.80, 4.99, 3.54, -1.52, 1.14, 9.04, -0.01, 2.49],
        [0.097, 0.381, 78.65, 4.82, 3.46, -1.01, 1.21, 8.26, 0.56, 2.10],
    ];
    for [sommerfeld, of_ecc, of_attitude, wanted @ ..] in table {
        let journal = Journal { lobes, ..Journal::round(0.1, 0.1, 2e-4) };
        let mut bearing = Bearing::journal(journal, [144, 24]);
        let (ecc, attitude, found, unit) = published(&mut bearing, sommerfeld);
        let stiffness = found.stiffness.concat().into_iter().map(|k| k / unit);
        let damping =
            [(0, 0), (0, 1), (1, 1)].map(|(k, l)| found.damping[k][l] * 100.0 * PI / unit);
        let all: Vec<f64> = stiffness.chain(damping).collect();
        println!("{sommerfeld}: {ecc:.3} {attitude:.2} {all:.2?}");
        // The table's second attitude is off the line through the others by 2°.
        let misprint = if sommerfeld == 0.161 { 2.0 } else { 0.0 };
        assert!((ecc - of_ecc).abs() <= 1.5e-3, "{ecc} {of_ecc}");
        assert!((attitude - of_attitude).abs() <= 0.1 + misprint, "{attitude} {of_attitude}");
        let off = all.iter().zip(wanted).map(|(found, wanted)| (found - wanted).abs());
        // A percent of the largest, which is Bxx.
        assert!(off.fold(0.0, f64::max) <= 0.01 * wanted[4], "{all:?} {wanted:?}");
    }
}

/// J. C. Nicholas, L. E. Barrett and M. E. Leader, *Experimental-theoretical comparison of
/// instability onset speeds for a three mass rotor supported by step journal bearings*, J. Mech.
/// Design 102 (1980) 344–351, table 6: L/D = 1; clearance and depth in mils, the angle of the step
/// from the groove before it and the part of the length that the dam has; S, ε and the stability
/// parameter ω √(c/g) at the threshold.
#[test]
fn pressure_dams_are_those_of_nicholas_barrett_and_leader() {
    let table = [
        [2.2, 2.4, 145.0, 0.75, 3.5, 0.29, 7.5],
        [2.5, 3.5, 145.0, 0.75, 2.7, 0.29, 7.0],
        [2.4, 13.4, 150.0, 0.75, 3.0, 0.21, 4.6],
        [2.4, 5.5, 90.0, 0.75, 3.0, 0.22, 4.6],
        [2.1, 22.5, 140.0, 0.50, 3.8, 0.09, 3.0],
    ];
    for [narrow, deep, step, part, sommerfeld, of_ecc, of_ratio] in table {
        let journal = Journal::round(0.1, 0.1, 2e-4);
        let mut bearing = Bearing::journal(journal, [144, 24]);
        let [length, depth] = [part * journal.length, deep / narrow * journal.clearance];
        assert!(journal.dam([-80.0, step - 90.0], length, depth).dig(&mut bearing.film));
        let (ecc, _, found, unit) = published(&mut bearing, sommerfeld);
        // With W = m g it is ω √(m c/W) of the critical mass.
        let ratio = 100.0 * PI * (found.threshold().unwrap().mass / unit).sqrt();
        println!("{sommerfeld}: {ecc:.3} {ratio:.2}");
        // The table has two digits, also of S.
        assert!((ecc - of_ecc).abs() <= 0.02, "{ecc} {of_ecc}");
        assert!((ratio / of_ratio - 1.0).abs() <= 0.08, "{ratio} {of_ratio}");
    }
}
