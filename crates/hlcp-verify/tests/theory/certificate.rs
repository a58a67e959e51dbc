//! Exact rational solutions, and what is claimed of none; `enclosure.rs` has the certificates.

use crate::common::{Lists, NotFinite};
use hlcp_core::{FivePoint, Identity};
use hlcp_verify::{Branch, certify, certify_box};
use nalgebra::DMatrix;
use num_rational::BigRational;
use num_traits::Signed;

use crate::exact::{eliminated, exact};

/// The exact solution on a support: `y` with `zᵢ = yᵢ` or `rᵢ = yᵢ`, if it is non-negative.
fn on_support(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &[f64],
    in_z: &[bool],
) -> Option<Vec<BigRational>> {
    let n = q.len();
    let entry = |i: usize, j: usize| exact(if in_z[j] { a[(i, j)] } else { -b[(i, j)] });
    let row = |i| (0..n).map(|j| entry(i, j)).chain([-exact(q[i])]).collect();
    let (y, _) = eliminated((0..n).map(row).collect())?;
    y.iter().all(|y| !y.is_negative()).then_some(y)
}

/// The exact solutions on sides that are proved, with either side where that is open, and where `z`
/// is positive in each.
pub(crate) fn solutions_on(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &[f64],
    sides: &[Branch],
) -> Vec<(Vec<bool>, Vec<BigRational>)> {
    let open: Vec<usize> = (0..q.len()).filter(|&j| sides[j] == Branch::Open).collect();
    let support = |choice: usize| -> Vec<bool> {
        let chosen = |j| open.iter().position(|&k| k == j).is_some_and(|k| choice >> k & 1 == 1);
        (0..q.len()).map(|j| sides[j] == Branch::Z || chosen(j)).collect()
    };
    let all = (0..1_usize << open.len()).map(support);
    all.filter_map(|in_z| on_support(a, b, q, &in_z).map(|y| (in_z, y))).collect()
}

#[test]
fn nothing_is_claimed_of_a_stencil_with_nan() {
    let (sound, q) = (FivePoint::new(4, 1, [0.0, -0.9, 4.0, -1.1, 0.0]).unwrap(), [-1.3; 4]);
    let (z, r, ends) = ([0.4; 4], [0.0; 4], [&[0.1; 4][..], &[9.0; 4]]);
    assert!(certify_box(&sound, &sound, &q, ends, [&z, &r]).unwrap().is_some());
    for spoilt in [
        certify_box(&NotFinite, &sound, &q, ends, [&z, &r]).unwrap(),
        certify_box(&sound, &NotFinite, &q, ends, [&z, &r]).unwrap(),
        certify(&NotFinite, &sound, &q, &z, &r).unwrap().ok(),
        certify(&sound, &NotFinite, &q, &z, &r).unwrap().ok(),
    ] {
        assert_eq!(spoilt, None);
    }
}

/// Springs around a ring, the two neighbours' entries after each diagonal one.
#[test]
fn entries_of_a_row_may_come_in_any_order() {
    let n = 30;
    let row = |i: usize| vec![(i, 2.01), ((i + 1) % n, -1.0), ((i + n - 1) % n, -1.0)];
    let (a, b) = (Lists((0..n).map(row).collect()), Identity { order: n });
    let q: Vec<f64> = (0..n).map(|i| (i as f64).sin() - 0.3).collect();
    let answer = hlcp_methods::solve(&a, &b, &q).unwrap();
    let certificate = certify(&a, &b, &q, &answer.z, &answer.r).unwrap().unwrap();
    assert!(certificate.error() < 1e-8);
}
