//! The classes of matrices against dense linear algebra, and the lemmas on them.

use crate::{any_pair, comparison, uniqueness::determinant};
use hlcp_core::{Error, Identity};
use hlcp_verify::{
    Slider,
    classes::{Answer, Failure, has_w_property, is_h_plus, is_m, is_z},
    uniqueness,
};
use nalgebra::{DMatrix, DVector};
use num_traits::{Signed, Zero};
use proptest::prelude::*;

proptest! {
    /// The W-property against the determinants of all choices of columns.
    #[test]
    fn the_w_property_is_that_of_all_determinants(
        n in 1..5_usize,
        entries in proptest::collection::vec(-3..4_i8, 32),
        diagonal in 0..9_i8,
    ) {
        let of = |part: usize| {
            let entry = |i: usize, j: usize| {
                f64::from(entries[part * 16 + i * 4 + j] + if i == j { diagonal } else { 0 })
            };
            DMatrix::from_fn(n, n, entry)
        };
        let (a, b) = (of(0), of(1));
        let all: Vec<_> = (0..1 << n).map(|choice| determinant([&a, &b], choice)).collect();
        let found = has_w_property(&a, &b).unwrap();
        if all.iter().any(Signed::is_positive) && all.iter().any(Signed::is_negative) {
            prop_assert_eq!(found, Answer::No(Failure::Signs));
        } else if all.iter().any(Zero::is_zero) {
            prop_assert_eq!(found, Answer::Undecided);
        } else {
            prop_assert_eq!(found, Answer::Yes(()));
        }
    }

    /// Classes against dense linear algebra, and Lemma 1: |A⁻¹| ≤ ⟨A⟩⁻¹.
    #[test]
    fn classes_are_what_their_definitions_say(p in any_pair(4.0), signs in any::<bool>()) {
        let a = if signs { comparison(&p.dense.a) } else { p.dense.a.clone() };
        let n = a.nrows();
        let inverse = comparison(&a).try_inverse();
        prop_assume!(inverse.as_ref().is_none_or(|i| i.amax() < 1e8));
        let h = inverse.as_ref().is_some_and(|i| i.min() >= 0.0);
        let z = (0..n * n).all(|k| k / n == k % n || a[(k / n, k % n)] <= 0.0);
        prop_assert_eq!(is_z(&a).is_yes(), z);
        let answer = is_h_plus(&a);
        prop_assert_eq!(answer.is_yes(), h);
        prop_assert_eq!(is_m(&a).is_yes(), h && z);
        if let (Answer::Yes(d), Some(inverse)) = (answer, inverse) {
            prop_assert!((comparison(&a) * DVector::from_vec(d)).min() > 0.0);
            let slack = 1e-9 * inverse.amax();
            prop_assert!((inverse - a.try_inverse().unwrap().abs()).min() >= -slack);
        }
    }

    /// Lemma 2: ‖B⁻¹C‖∞ ≤ max (|C|e)ᵢ/(⟨B⟩e)ᵢ for strictly dominant B.
    #[test]
    fn lemma_2_bounds_the_norm_of_a_quotient(p in any_pair(0.9)) {
        let e = DVector::from_element(p.z.len(), 1.0);
        let quotient = (p.dense.b.abs() * &e).component_div(&(comparison(&p.dense.a) * &e)).max();
        let product = p.dense.a.clone().try_inverse().unwrap() * &p.dense.b;
        prop_assert!((product.abs() * e).amax() <= quotient * (1.0 + 1e-10));
    }
}

#[test]
fn the_w_property_is_one_solution_for_every_q() {
    let (a, b, _) = Slider { cells: 14 }.pose::<f64>().unwrap();
    assert!(uniqueness(&a, &b).unwrap().is_proved());
    assert_eq!(has_w_property(&a, &b).unwrap(), Answer::Yes(()));
    let fewer = has_w_property(&a, &Identity { order: 12 });
    assert!(matches!(fewer, Err(Error::Order { what: "B", found: 12, expected: 13 })));
    let large = Identity { order: 21 };
    let found = has_w_property::<f64>(&large, &large);
    assert!(matches!(found, Err(Error::Parameter { name: "the order", .. })));
}
