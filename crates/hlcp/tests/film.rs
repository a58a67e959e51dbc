//! Walls that move freely, against their equation of motion; walls that carry a load, from
//! anywhere; derivatives against differences.

use hlcp::film::{
    Bearing, Coefficients, Drive, Film, FilmError, Journal, Load, Motion, Settings, Side, Solved,
    Supply,
};
use proptest::prelude::*;

/// `HLCP_CASES` cases, or 12.
fn config() -> ProptestConfig {
    let wanted = std::env::var("HLCP_CASES").ok().and_then(|n| n.parse().ok());
    ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(wanted.unwrap_or(12)) }
}

/// Takes six steps and holds each against `m (v − v₀) = Δt (G(e) − load)`.
fn falls(bearing: Bearing, load: Vec<f64>, mass: f64, duration: f64) -> Result<(), TestCaseError> {
    let (settings, moving) = (Settings::default(), load.len());
    let size = load.iter().copied().fold(0.0, f64::hypot);
    let mut motion = Motion::new(bearing, &settings).unwrap();
    let mut before = vec![0.0; moving];
    for _ in 0..6 {
        let from = motion.bearing.position.clone();
        let drive = Drive::Under { load: load.clone(), mass };
        // Where the film carries nothing, Newton's method has no direction.
        match motion.step(duration, &drive, &settings) {
            Err(FilmError::Unsettled) => return Err(TestCaseError::reject("it did not settle")),
            figures => prop_assert!(figures.is_ok(), "{figures:?}"),
        }
        let (now, solved) = (&motion.bearing, motion.solved.as_ref().unwrap());
        prop_assert!(solved.outcome.converged());
        let forces = now.forces(&solved.film, &solved.z);
        for k in 0..moving {
            let velocity = (now.position[k] - from[k]) / duration;
            let off = mass * (velocity - before[k]) / duration - forces[k] + load[k];
            // A step ends at 1e-8 of the largest force.
            let largest = forces[..moving].iter().fold(size, |most, f| most.max(f.abs()));
            prop_assert!(off.abs() <= 1.1e-8 * largest, "{off} of {largest}");
            before[k] = velocity;
        }
        // What does not move stays.
        prop_assert_eq!(&now.position[moving..], &from[moving..]);
    }
    Ok(())
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_free_pad_obeys_its_equation_of_motion(
        (load, mass, ms) in (50.0..2000.0, prop_oneof![Just(0.0), 0.1..10.0_f64], 0.2..2.0),
        (wide, thin, ambient) in (2.5e-5..5e-5, 1e-5..2.4e-5, prop_oneof![Just(0.0), Just(1e5)]),
    ) {
        let film = Film::new([20, 10], [0.05, 0.03], 3.0, 0.04);
        let film = film.with_gap(|x, _| wide + (thin - wide) * x / 0.05);
        let film = Film { sides: [Side::Pressure(ambient); 4], ..film };
        falls(Bearing { ambient, ..Bearing::pad(film) }, vec![load], mass, 1e-3 * ms)?;
    }

    #[test]
    fn a_free_journal_obeys_its_equation_of_motion(
        (along, across, mass) in (500.0..8000.0, -500.0..500.0, prop_oneof![Just(0.0), 0.5..5.0_f64]),
        (ecc, turn, ms) in (0.1..0.8_f64, 0.0..std::f64::consts::TAU, 0.1..1.0),
    ) {
        let journal = Journal { diameter: 0.1, length: 0.05, clearance: 1e-4, tilt: [0.0; 2] };
        let mut bearing = Bearing::journal(journal, [36, 6]);
        bearing.film.speeds = [15.7, 0.0];
        bearing.film.viscosity = vec![0.02];
        let groove = Supply { corner: [0.05, 0.0], size: [0.0, 0.05], pressure: 1e5 };
        bearing.film.supplies = vec![groove];
        bearing.position = vec![ecc * 1e-4 * turn.cos(), ecc * 1e-4 * turn.sin()];
        falls(bearing, vec![along, across], mass, 1e-3 * ms)?;
    }
}

/// A journal of 100 mm by 50 mm, in its middle, fed by a groove of 1 bar.
fn journal(cells: [usize; 2], speed: f64) -> Bearing {
    let journal = Journal { diameter: 0.1, length: 0.05, clearance: 1e-4, tilt: [0.0; 2] };
    let mut bearing = Bearing::journal(journal, cells);
    bearing.film.speeds = [speed, 0.0];
    bearing.film.viscosity = vec![0.02];
    bearing.film.supplies = vec![Supply { corner: [0.0, 0.0], size: [0.0, 0.05], pressure: 1e5 }];
    bearing
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_search_that_begins_at_a_neighbour_ends_where_any_does(
        (load, speed, by) in (500.0..5000.0, 5.0..30.0, 0.8..1.25),
        direction in prop_oneof![Just(None), Just(Some(std::f64::consts::PI))],
    ) {
        let settings = Settings::default();
        let load = Load { direction, ..Load::of(load) };
        let begin = |speed| Bearing { position: vec![5e-5, 0.0], ..journal([36, 6], speed) };
        let mut near = begin(speed);
        let carried = near.carry(&load, None, &settings).unwrap();
        prop_assume!(carried.found);
        near.film.speeds[0] *= by;
        let warm = near.carry(&load, Some(&carried.solved), &settings).unwrap();
        let mut far = begin(speed * by);
        let cold = far.carry(&load, None, &settings).unwrap();
        prop_assert!(warm.found && cold.found);
        // Forces are those of the load to 1e-9, and grow with the eccentricity.
        for (one, other) in near.position.iter().zip(&far.position) {
            prop_assert!((one - other).abs() <= 1e-4 * 1e-6, "{one} {other}");
        }
    }
}

/// Holds the stiffness of a pad against differences of what it carries.
fn derives(film: Film) {
    let (pad, settings) = (Bearing::pad(film), Settings::default());
    let at = |rise: f64| {
        let film = pad.at(&[rise, 0.0, 0.0]).unwrap();
        Solved::new(film, None, &settings).unwrap()
    };
    let solved = at(0.0);
    let found = Coefficients::new(&pad, &solved).unwrap();
    let by = 1e-9;
    let [less, more] = [-by, by].map(|rise| {
        let solved = at(rise);
        pad.forces(&solved.film, &solved.z)
    });
    for k in 0..3 {
        let difference = (less[k] - more[k]) / (2.0 * by);
        let off = (found.stiffness[k][0] - difference).abs();
        let lever = if k == 0 { 1.0 } else { 0.05 };
        assert!(off <= 1e-5 * lever * found.stiffness[0][0], "{k}: {off} of {difference}");
    }
}

#[test]
fn stiffness_is_the_difference_of_loads() {
    for cells in [[60, 20], [20, 60]] {
        let film = Film::new(cells, [0.05, 0.03], 3.0, 0.04);
        let film = film.with_gap(|x, y| 4e-5 - 4e-4 * x + 1e-5 * (200.0 * y).sin());
        derives(Film { sides: [Side::Pressure(1e5); 4], ..film });
    }
}
