//! Films over a rectangle, against closed forms and finite differences.

use hlcp_core::{Hlcp, LinearOperator, Omega};
use hlcp_methods::{Auto, Limits, Options, Solver};
use hlcp_verify::{Film, FilmFigures, Side, Supply, TimeStep};

/// `z` and `r`, to what rounding allows.
fn solved(film: &Film, start: Option<[&[f64]; 2]>) -> [Vec<f64>; 2] {
    let (a, b, q) = film.pose().expect("a sound film");
    let omega = Omega::diagonal_ratio(1.0, &a, &b).expect("positive diagonals");
    let problem = Hlcp::new(&a, &b, omega).expect("two operators");
    let mut solver = Solver::new(Auto::new(problem).expect("a method"));
    let limits = Limits { rounding: Some(4.0), ..Limits::relative(1e-13) };
    let options = start.map_or(Options::default(), |[z, r]| Options::from_solution(z, r));
    let outcome = solver.solve(&q, options.limits(limits)).expect("a sound film");
    assert!(outcome.converged(), "{outcome}");
    [solver.z().to_vec(), solver.r().to_vec()]
}

fn figures(film: &Film, ambient: f64) -> FilmFigures {
    let [z, r] = solved(film, None);
    film.figures(&z, &r, ambient)
}

/// The pocket slider on `nx × ny` cells, along a strip of 3 mm.
fn pocket([nx, ny]: [usize; 2]) -> Film {
    let (end, side) = (Side::Pressure(1e5), Side::Closed);
    let length = 0.01;
    let gap = |k: usize| {
        let x = ((k % nx) as f64 + 0.5) * length / nx as f64;
        1.05e-6 - 5e-6 * x + if (2e-3..5e-3).contains(&x) { 1e-6 } else { 0.0 }
    };
    Film {
        gap: (0..nx * ny).map(gap).collect(),
        sides: [end, end, side, side],
        ..Film::new([nx, ny], [length, 3e-3], 1.0, 0.01)
    }
}

#[test]
fn the_pocket_slider_approaches_its_closed_form() {
    let (flow, peak, forms) = (5.229635023923445e-7 * 3e-3, 9_808_818.754, 3.61126265581e-3);
    let mut last: Option<[f64; 2]> = None;
    for nx in [100, 200, 400, 800, 1600, 3200] {
        let film = pocket([nx, 1]);
        let [z, r] = solved(&film, None);
        let found = film.figures(&z, &r, 0.0);
        let broken = r.iter().rposition(|&r| r > 0.0).unwrap();
        let errors = [found.sides[1] / flow - 1.0, found.peak / peak - 1.0];
        println!(
            "{nx} {errors:?} {} {}",
            r[broken],
            (broken as f64 + 1.0) * 1e-2 / nx as f64 - forms
        );
        println!("{:?}", found);
        last = Some(errors);
    }
}
