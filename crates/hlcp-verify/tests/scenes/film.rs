//! Films over a rectangle, against closed forms, balances and differences.

use std::{f64::consts::TAU, ops::Range};

use hlcp_core::{Aor, Hlcp};
use hlcp_methods::{AmgNewton, Limits, Mms, Options, Solver};
use hlcp_verify::{Film, Side, Supply, TimeStep};

/// `z` and `r`, to what rounding allows.
fn solved(film: &Film, start: Option<&[Vec<f64>; 2]>) -> [Vec<f64>; 2] {
    let (a, b, q) = film.pose().expect("a sound film");
    let base = Mms::new(Hlcp::from_pair(&a, &b).expect("a pair"), Aor::gauss_seidel());
    let method = AmgNewton::new(base.expect("a splitting")).expect("positive diagonals");
    let mut solver = Solver::new(method);
    let limits = Limits { rounding: Some(4.0), ..Limits::relative(1e-13) };
    let options = start.map_or(Options::default(), |[z, r]| Options::from_solution(z, r));
    let outcome = solver.solve(&q, options.limits(limits)).expect("a sound film");
    assert!(outcome.converged(), "{outcome}");
    [solver.z().to_vec(), solver.r().to_vec()]
}

/// Holds that both errors of a grid are those of the grid before it divided by one of `ratios`.
fn shrink(errors: &[[f64; 2]], ratios: Range<f64>) {
    for pair in errors.windows(2) {
        let both = [0, 1].map(|k| pair[0][k] / pair[1][k]);
        assert!(both.iter().all(|ratio| ratios.contains(ratio)), "{both:?} of {errors:?}");
    }
}

/// Fowell's pocket slider on `nx × ny` cells, a strip of 3 mm along y.
fn pocket([nx, ny]: [usize; 2]) -> Film {
    let (end, side) = (Side::Pressure(1e5), Side::Closed);
    let film = Film::new([nx, ny], [0.01, 3e-3], 1.0, 0.01)
        .with_gap(|x, _| 1.05e-6 - 5e-6 * x + if (2e-3..5e-3).contains(&x) { 1e-6 } else { 0.0 });
    Film { sides: [end, end, side, side], ..film }
}

#[test]
fn the_pocket_slider_approaches_its_closed_form() {
    let (flow, peak, forms) = (5.229635023923445e-7 * 3e-3, 9_808_818.754, 3.61126265581e-3);
    let errors = [100, 200, 400, 800, 1600].map(|nx| {
        let (film, cell) = (pocket([nx, 1]), 0.01 / nx as f64);
        let [z, r] = solved(&film, None);
        let found = film.figures(&z, &r, 0.0);
        let broken = |k: &usize| r[*k] > 0.0;
        let (first, last) = ((0..nx).find(broken).unwrap(), (0..nx).rfind(broken).unwrap());
        // It breaks on the last face before the pocket or half a cell earlier, and re-forms within
        // the cell after the last broken one.
        assert!(nx / 5 - first <= 1, "{nx}: {first}");
        let edge = (last as f64 + 1.0) * cell;
        assert!((edge - forms).abs() <= 1.2 * cell, "{nx}: {edge}");
        assert!((found.sides[0] + found.sides[1]).abs() <= 1e-10 * found.sides[1]);
        [found.sides[1] / flow - 1.0, found.peak / peak - 1.0]
    });
    // The front within a cell, and the rupture on a face that is seen from half cells: first order,
    // each error half of the one on cells of twice the size.
    shrink(&errors, 1.9..2.1);
    // 1.4e-4 and 4.4e-3 at 100 cells
    let [flow, peak] = errors[4];
    assert!(flow < 1e-5 && peak < 3e-4, "{flow} {peak}");
}

#[test]
fn a_full_wedge_is_of_second_order() {
    // Cameron's plane wedge, h = h₀(1 + K(1 − s)), along a narrow strip.
    let (length, width, thin, k, speed, viscosity) = (0.05, 0.01, 2e-5, 1.3, 3.7, 0.041);
    let unit = 6.0 * viscosity * speed * length / (thin * thin);
    let load = unit * length * width * (f64::ln_1p(k) - 2.0 * k / (2.0 + k)) / (k * k);
    let drag =
        viscosity * speed * length * width / thin * (4.0 * f64::ln_1p(k) / k - 6.0 / (2.0 + k));
    let errors = [20, 40, 80, 160].map(|nx| {
        let end = Side::Pressure(0.0);
        let film = Film::new([nx, 1], [length, width], speed, viscosity);
        let film = film.with_gap(|x, _| thin * (1.0 + k * (1.0 - x / length)));
        let film = Film { sides: [end, end, Side::Closed, Side::Closed], ..film };
        let [z, r] = solved(&film, None);
        let found = film.figures(&z, &r, 0.0);
        [found.load / load - 1.0, found.friction[0] / drag - 1.0]
    });
    shrink(&errors, 3.8..4.2);
}

#[test]
fn a_squeezed_film_breaks_turns_and_closes_when_it_should() {
    // Optasanu and Bonneau: ∂x(h³ ∂x p) = 2 ∂t(θh), which is a viscosity of 1/6.
    let (cells, duration, ambient) = (450, 6.6e-4, 0.025);
    let gap = |time: f64| 0.125 * (2.0 * TAU * time).cos() + 0.375;
    let ends = Side::Pressure(ambient);
    let mut film = Film {
        sides: [ends, ends, Side::Closed, Side::Closed],
        ..Film::new([cells, 1], [1.0, 1.0], 0.0, 1.0 / 6.0)
    };
    let mut oil = vec![gap(0.0); cells];
    let (mut state, mut entered) = (None::<[Vec<f64>; 2]>, 0.0);
    let (mut broke, mut closed, mut turned, mut least) = (0.0, 0.0, 0.0, cells);
    for step in 1..=1130 {
        let time = f64::from(step) * duration;
        let unit = film.pressure_unit();
        film.gap = vec![gap(time); cells];
        film.step = Some(TimeStep { duration, oil: oil.clone() });
        assert_eq!(unit, film.pressure_unit());
        let [z, r] = solved(&film, state.as_ref());
        let out = film.outflow(&z, &r);
        // A cell is 1/450 of the area.
        oil.iter_mut().zip(&out).for_each(|(oil, out)| *oil -= duration * out * cells as f64);
        entered -= duration * film.figures(&z, &r, ambient).sides.iter().sum::<f64>();
        let full = (0..cells).filter(|&k| r[k] <= 0.0).count();
        if full < cells && broke == 0.0 {
            broke = time;
        }
        if full < least {
            (least, turned) = (full, time);
        }
        if broke > 0.0 && closed == 0.0 && full == cells {
            closed = time;
        }
        state = Some([z, r]);
    }
    // An implicit step sees what happens by its end, and a front that creeps as it turns is on a
    // cell for s″Δt²/2 ~ Δx, that is some tens of steps.
    assert!((0.0..=2.0 * duration).contains(&(broke - 0.2500791572)), "{broke}");
    assert!((closed - 0.732386).abs() <= 2.0 * duration, "{closed}");
    assert!((turned - 0.3148258613).abs() <= 40.0 * duration, "{turned}");
    let front = least as f64 / (2 * cells) as f64;
    assert!((front - 0.0230077051).abs() <= 1.0 / cells as f64, "{front}");
    let held = oil.iter().sum::<f64>() / cells as f64;
    assert!((held - gap(0.0) - entered).abs() <= 1e-13, "{held} {entered}");
}

#[test]
fn unsound_films_are_refused_with_their_numbers() {
    let film = || Film::new([4, 3], [0.02, 0.01], 2.0, 0.03);
    let with_supply = |x: f64, lx: f64| {
        let supply = Supply { corner: [x, 0.0], size: [lx, 0.01], pressure: 0.0 };
        Film { supplies: vec![supply], ..film() }
    };
    let overlap = |sizes: [f64; 2], second: f64| {
        let of = |(lx, pressure)| Supply { corner: [0.005, 0.0], size: [lx, 0.01], pressure };
        Film { supplies: [(sizes[0], 1e5), (sizes[1], second)].map(of).into(), ..film() }
    };
    assert!(overlap([0.01, 0.005], 1e5).pose().is_ok());
    let with_step = |duration: f64, content: f64| {
        let oil = film().gap.iter().map(|h| content * h).collect();
        Film { step: Some(TimeStep { duration, oil }), ..film() }
    };
    let mut bad = film();
    bad.gap[5] = -1e-6;
    let (around, closed, short) = (Side::Periodic, Side::Closed, vec![1e-5; 11]);
    let pair = Film::new([2, 3], [0.02, 0.01], 2.0, 0.03);
    let ring = Film { sides: [around, around, closed, closed], ..pair };
    let cases = [
        (bad, "gap[5] is -1e-6"),
        (Film { gap: short, ..film() }, "the gap has order 11, but the problem has order 12"),
        (Film { viscosity: vec![0.03; 3], ..film() }, "the viscosity has order 3"),
        (Film { viscosity: vec![-0.03], ..film() }, "viscosity[0] is -0.03"),
        (Film { lengths: [0.0, 1.0], ..film() }, "an extent of the film is 0"),
        (Film { speeds: [f64::NAN, 1.0], ..film() }, "a speed is NaN"),
        (Film { cavitation: 1.0, ..film() }, "a pressure in Pa is 0"),
        (Film { sides: [Side::Starved(1.5); 4], ..film() }, "the film content of a side is 1.5"),
        (
            Film { sides: [around, closed, closed, closed], ..film() },
            "the number of periodic sides of a direction is 1",
        ),
        (ring, "the number of points in a row that closes is 2"),
        (with_supply(0.019, 0.01), "the place of a supply, in m, is 0.019"),
        (with_supply(0.0, 0.0), "the number of cells of a supply is 0"),
        (with_supply(0.0, 0.002), "the number of cells of a supply is 0"),
        (overlap([0.01, 0.005], 2e5), "the pressure of a supply that overlaps another one is 2"),
        (overlap([0.0, 0.0], 2e5), "the pressure of a supply that overlaps another one is 2"),
        (with_step(0.0, 1.0), "the duration of a time step is 0"),
        (with_step(1e-3, -1.0), "the oil before a time step, in m, is -"),
        (Film::new([0, 3], [1.0, 1.0], 1.0, 1.0), "the grid has 0 x 3 points"),
    ];
    for (film, what) in cases {
        let error = film.pose().unwrap_err().to_string();
        assert!(error.starts_with(what), "{error}; expected {what}");
    }
}

/// Edges of grooves lie on the middles of cells here, where rounding must not decide.
#[test]
fn a_groove_has_as_many_columns_wherever_it_is() {
    let around = |degrees: f64| degrees / 360.0 * TAU * 0.05;
    for (nx, degrees, columns) in [(180, 10.0, 5), (360, 15.0, 15), (72, 5.0, 1), (90, 12.0, 3)] {
        for place in (0..360).step_by(3 * 360 / nx) {
            let begins = (f64::from(place) - degrees / 2.0).rem_euclid(360.0);
            let (corner, size) = ([around(begins), 0.0], [around(degrees), 0.1]);
            let mut ring = Film::new([nx, 2], [around(360.0), 0.1], 3.0, 0.02);
            ring.sides[..2].fill(Side::Periodic);
            ring.supplies = vec![Supply { corner, size, pressure: 1e5 }];
            assert_eq!(ring.free_cells().len(), 2 * (nx - columns), "{nx} {degrees} {place}");
        }
    }
}
