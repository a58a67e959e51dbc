//! Proofs that end with the time, by counting.

use crate::common::{Walked, parts, planted_q};
use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega};
use hlcp_verify::{
    Convergence, Reason, Refusal, Uniqueness, certify_within, convergence_within, uniqueness_within,
};

const M: usize = 180;

/// The walks over A between two looks at the clock: at most one of the certificate's loops, of
/// which those before the first look, and the checks of what it takes for linear solves, have
/// several.
const WALKS: usize = 6;

/// Some of the times at which `whole` looks can end.
fn times(whole: usize) -> impl Iterator<Item = usize> {
    (0..4).chain((1..10).map(move |k| whole * k / 10))
}

/// A contact with a solution in whole numbers, exact in A z − r + q = 0, and an answer 1e-6 off. No
/// row is dominant enough for the bound at first sight.
#[test]
fn a_certificate_ends_with_the_time() {
    let a = FivePoint::new(M, M, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap();
    let b = Identity { order: M * M };
    let entry = |k: usize| if k % M < 110 { (1 + 7 * k % 5) as f64 } else { -((1 + k % 3) as f64) };
    let [exact, r] = parts(&(0..M * M).map(entry).collect::<Vec<_>>());
    let q = planted_q(&a, &b, [&exact, &r]);
    let z: Vec<f64> = exact.iter().map(|z| if *z > 0.0 { z + 1e-6 } else { 0.0 }).collect();
    let a = Walked::new(a);
    let certified = |late| a.cut(late, |clock| certify_within(&a, &b, &q, &z, &r, clock).unwrap());
    let (found, whole, most) = certified(usize::MAX);
    assert!(found.is_ok_and(|found| found.error() < 2e-6));
    assert!(whole > 150 && most <= WALKS, "{whole} looks, {most} walks");
    for late in times(whole) {
        let (found, asked, most) = certified(late);
        assert!(asked == late + 1 && most <= WALKS, "{late}: {asked} looks, {most} walks");
        match found {
            Ok(found) => assert!((0..M * M).all(|j| found.z[j] >= (z[j] - exact[j]).abs())),
            Err(refusal) => assert_eq!(refusal, Refusal::TimeLimit),
        }
    }
}

#[test]
fn searches_for_witnesses_end_with_the_time() {
    let a = Walked::new(FivePoint::new(M, M, [-1.0, -1.0, 4.0, -1.0, -1.0]).unwrap());
    let b = Identity { order: M * M };
    let decided = |late| a.cut(late, |clock| uniqueness_within(&a, &b, clock).unwrap());
    let (found, whole, most) = decided(usize::MAX);
    assert!(matches!(found, Uniqueness::Proved(_)));
    assert!(whole > 1 && most <= WALKS, "{whole} looks, {most} walks");
    for late in 0..whole {
        let (found, asked, most) = decided(late);
        assert!(asked == late + 1 && most <= WALKS, "{late}: {asked} looks, {most} walks");
        assert_eq!(found, Uniqueness::Open(Reason::TimeLimit));
    }
    let problem = Hlcp::new(&a, &b, Omega::Uniform(4.0)).unwrap();
    let steps = [Aor::gauss_seidel()];
    let proved = |late| a.cut(late, |clock| convergence_within(&problem, &steps, clock));
    let (found, whole, most) = proved(usize::MAX);
    assert!(matches!(found, Convergence::Proved(..)));
    // The hypotheses are checked after the search.
    assert!(whole > 4 && most <= 2 * WALKS, "{whole} looks, {most} walks");
    for late in times(whole) {
        let (_, asked, most) = proved(late);
        assert!(asked == late + 1 && most <= 2 * WALKS, "{late}: {asked} looks, {most} walks");
    }
}
