//! Problems whose unknowns are numbered anew.

use crate::common::{
    Dynamic, Lists, by, largest_difference, noise, permuted, planted, posed, renamed, shuffled,
};
use hlcp_core::{Aor, Error, FivePoint, Hlcp, Identity, Omega};
use hlcp_methods::{Limits, Named, Options, Renumbered, Solver, Tmms, cuthill_mckee};
use proptest::prelude::*;

proptest! {
    /// Three iterations from the same start, entry by entry; sums are in another order in one. Also
    /// with z and r exchanged.
    #[test]
    fn a_method_renumbered_is_the_method_on_the_problem_renumbered(p in planted(2..12, 0.4)) {
        let order = shuffled(p.dense.q.len());
        let other = permuted(&p.dense, &order);
        let tmgs = |problem| Tmms::mirrored(problem, Aor::gauss_seidel());
        let limits = Limits { iterations: 3, ..Limits::relative(0.0) };
        let start: Vec<f64> = (0..order.len()).map(noise).collect();
        let same: Vec<f64> = order.iter().map(|&i| start[i]).collect();
        let pair = [posed(&p.dense), posed(&other)];
        for [problem, other_problem] in [pair.clone(), pair.map(|posed| posed.exchanged().unwrap())] {
            let mut renumbered = Solver::new(Renumbered::new(problem, order.clone(), tmgs)?);
            let mut directly = Solver::new(Tmms::mirrored(other_problem, Aor::gauss_seidel())?);
            let _ = renumbered.solve(p.dense.q.as_slice(), Options::from_x(&start).limits(limits))?;
            let _ = directly.solve(other.q.as_slice(), Options::from_x(&same).limits(limits))?;
            let found: Vec<f64> = order.iter().map(|&i| renumbered.x()[i]).collect();
            let size = directly.x().iter().fold(1.0, |size: f64, x| size.max(x.abs()));
            prop_assert!(largest_difference(&found, directly.x()) <= 1e-12 * size);
        }
    }

    /// Strings that were taken apart come back whole, one after the other.
    #[test]
    fn strings_are_found(lengths in prop::collection::vec(1_usize..60, 1..5)) {
        let n = lengths.iter().sum();
        let mut rows = vec![vec![]; n];
        let mut begin = 0;
        for length in lengths {
            for k in begin..begin + length {
                rows[k].push((k, 3.0));
                if k > begin {
                    rows[k - 1].push((k, -1.0));
                    rows[k].push((k - 1, -1.0));
                }
            }
            begin += length;
        }
        let apart = renamed(&Lists(rows), &shuffled(n));
        if let Some(order) = cuthill_mckee(&Hlcp::lcp(&apart)?) {
            let Lists(rows) = renamed(&apart, &order);
            prop_assert!(rows.iter().enumerate().all(|(i, row)| row.iter().all(|e| e.0.abs_diff(i) <= 1)));
        } else {
            // Most are short: they were near each other in any order.
            prop_assert!(n < 100);
        }
    }
}

/// Wind along a grid whose points were named at random blows from the first to the last again.
#[test]
fn wind_blows_forward() {
    for (nx, ny, side) in [(30, 20, 0), (30, 20, 4), (25, 25, 1), (25, 25, 3)] {
        let a = FivePoint::new(nx, ny, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
        let mut wind = [0.0, 0.0, 1.0, 0.0, 0.0];
        wind[side] = -1.0;
        let b = FivePoint::new(nx, ny, wind).unwrap();
        assert!(cuthill_mckee(&Hlcp::from_pair(Lists::of(&a), Lists::of(&b)).unwrap()).is_none());
        let names = shuffled(nx * ny);
        let [a, b] = [renamed(&a, &names), renamed(&b, &names)];
        let order = cuthill_mckee(&Hlcp::from_pair(&a, &b).unwrap()).unwrap();
        let Lists(rows) = renamed(&b, &order);
        assert!(rows.iter().enumerate().all(|(i, row)| row.iter().all(|&(j, _)| j <= i)));

        // Oil that is only carried along is settled by AUTO's first two sweeps.
        let q: Vec<f64> = (0..nx * ny).map(|i| 1.0 + 0.5 * noise(i)).collect();
        let outcome = by("AUTO", &a, &b).unwrap().solve(&q, Limits::default()).unwrap();
        assert!(outcome.converged() && outcome.sweeps <= 4, "{outcome}");
    }
}

/// Where each is coupled with any other, no order is better.
#[test]
fn what_has_no_better_order_keeps_its_own() {
    let n = 300;
    let row = |i: usize| {
        let mut row = vec![(i, 10.0)];
        let others = (1..=4).map(|k| (i + 37 * k * k + 11 * k) % n);
        row.extend(others.filter(|&j| j != i).map(|j| (j, -1.0)));
        row.sort_by_key(|entry| entry.0);
        row
    };
    let scattered = Lists((0..n).map(row).collect());
    assert!(cuthill_mckee(&Hlcp::lcp(&scattered).unwrap()).is_none());
    assert!(cuthill_mckee(&Hlcp::<f64, _, _>::lcp(Identity { order: n }).unwrap()).is_none());
}

/// A row of a string whose masses are numbered at random, by the number that it was given.
#[test]
fn what_is_refused_is_named_by_its_own_number() {
    let n = 1000;
    let row = |k: usize| {
        let near = [k.wrapping_sub(1), k + 1].into_iter().filter(|&near| near < n);
        near.map(|near| (near, -1.0)).chain([(k, 2.0)]).collect()
    };
    let apart = renamed(&Lists((0..n).map(row).collect()), &shuffled(n));
    for (column, value) in [(400, f64::NAN), (n + 1, -1.0)] {
        let Lists(mut rows) = apart.clone();
        rows[123].retain(|entry| entry.0 != column);
        rows[123].push((column, value));
        let (a, b) = (Lists(rows), Identity { order: n });
        let problem = Dynamic::new(&a, &b, Omega::Uniform(1.0)).unwrap();
        let refused = match "AUTO".parse::<Named>().unwrap().on_dyn(problem).err() {
            Some(Error::NotFinite { index, .. }) => index,
            Some(Error::Outside { row, .. }) => row,
            other => panic!("{other:?}"),
        };
        assert_eq!(refused, 123);
    }
}
