//! The ladder's rungs are the solves that they say they are.

#[path = "../../../tests/common/mod.rs"]
mod common;

use common::{Altered, largest_difference, problem};
use hlcp::{
    Aor, Error, Limits, Method, Mms, Options, Solver, Tolerance,
    ladder::{COLUMNS, TOLERANCES, ladder},
};
use hlcp_verify::Disc;

/// Accelerated SOR on the scene.
fn method(alpha: f64) -> impl Method<f64> {
    let scene = SCENE.pose::<f64>().unwrap();
    Mms::new(problem(1.0, scene.a, scene.b), Aor::sor(alpha).unwrap().accelerated()).unwrap()
}

const SCENE: Disc = Disc { lcp: false, m: 12 };

#[test]
fn a_rung_is_a_solve_to_its_tolerance() {
    let scene = SCENE.pose::<f64>().unwrap();
    let (start, truth) = (vec![0.7; 144], [&scene.z[..], &scene.r[..]]);
    let limits = Limits { rounding: Some(0.0), iterations: 150, ..Limits::default() };
    let mut methods = [1.0, 1.4].map(|alpha| (format!("SOR {alpha}"), Solver::new(method(alpha))));
    let rungs = ladder(&mut methods, &scene.q, &start, truth, limits, 2).unwrap();
    for (name, alpha) in [("SOR 1", 1.0), ("SOR 1.4", 1.4)] {
        let of: Vec<_> = rungs.iter().filter(|rung| rung.series == name).collect();
        for (rung, tolerance) in of.iter().zip(TOLERANCES) {
            let limits = Limits { tolerance: Tolerance::Relative(tolerance), ..limits };
            let mut solver = Solver::new(method(alpha));
            let outcome = solver.solve(&scene.q, Options::from_x(&start).limits(limits)).unwrap();
            assert_eq!((rung.tolerance, rung.half_steps), (tolerance, Some(outcome.sweeps)));
            assert_eq!(rung.reached, outcome.converged());
            let pairs = [(solver.z(), &scene.z), (solver.r(), &scene.r)];
            let [of_z, of_r] = pairs.map(|(found, known)| largest_difference(found, known));
            assert_eq!(rung.error, of_z.max(of_r));
            let [least, median, most] = rung.seconds;
            assert!(0.0 <= least && least <= median && median <= most);
            let row = rung.row("disc, m = 12");
            assert_eq!(row.split(',').count(), COLUMNS.len() + 1, "a comma is in quotes: {row}");
        }
        // The first tolerance that is missed is the last of its method.
        let missed = of.iter().position(|rung| !rung.reached);
        assert!(missed.is_none_or(|k| k + 1 == of.len()));
        assert!(missed.is_some() || of.len() == TOLERANCES.len());
    }
    assert!(rungs.iter().any(|rung| !rung.reached), "150 sweeps are too few for one of them");
}

#[test]
fn a_rung_is_of_its_last_repeat() {
    let scene = SCENE.pose::<f64>().unwrap();
    let (start, truth) = (vec![0.7; 144], [&scene.z[..], &scene.r[..]]);
    let limits = Limits { rounding: Some(0.0), iterations: 2000, ..Limits::default() };
    let run = |repeats| {
        let mut solves = 0;
        // It takes its step in every other solve only, beginning with the first.
        let tired = Altered::new(method(1.4), move |k, x, y, norms, _| {
            solves += usize::from(k == 1);
            if solves % 2 == 0 {
                y.copy_from_slice(x);
            }
            norms
        });
        let mut methods = [("tired".to_owned(), Solver::new(tired))];
        ladder(&mut methods, &scene.q, &start, truth, limits, repeats).unwrap()
    };
    // The second solve stays where it begins, at r = 0.
    let largest = scene.z.iter().map(|z| (1.4 - z).abs()).chain(scene.r.iter().copied());
    let rungs = run(2);
    assert_eq!((rungs.len(), rungs[0].reached), (1, false));
    assert_eq!(rungs[0].error, largest.fold(0.0, f64::max));
    // The third is as good as the first.
    assert!(run(3)[0].reached);
}

#[test]
fn a_solution_of_another_order_is_refused() {
    let scene = SCENE.pose::<f64>().unwrap();
    let mut methods = [("SOR".to_owned(), Solver::new(method(1.0)))];
    let mut refused =
        |truth| ladder(&mut methods, &scene.q, &[1.0; 144], truth, Limits::default(), 1);
    let of = |what| Err(Error::Order { what, found: 1, expected: 144 });
    assert_eq!(refused([&[1.0], &scene.r]), of("the solution's z"));
    assert_eq!(refused([&scene.z, &[1.0]]), of("the solution's r"));
}
