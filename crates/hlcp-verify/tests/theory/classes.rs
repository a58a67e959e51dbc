//! The classes of matrices against dense linear algebra, and the lemmas on them.

use crate::common::Matrix;
use crate::{any_pair, comparison};
use hlcp_verify::classes::{Answer, is_h_plus, is_m, is_strictly_dominant, is_z};
use nalgebra::DVector;
use proptest::prelude::*;

proptest! {
    /// Classes against dense linear algebra, and Lemma 1: |A⁻¹| ≤ ⟨A⟩⁻¹.
    #[test]
    fn classes_are_what_their_definitions_say(p in any_pair(4.0), signs in any::<bool>()) {
        let a = if signs { comparison(&p.dense.a) } else { p.dense.a.clone() };
        let n = a.nrows();
        let inverse = comparison(&a).try_inverse();
        prop_assume!(inverse.as_ref().is_none_or(|i| i.amax() < 1e8));
        let h = inverse.as_ref().is_some_and(|i| i.min() >= 0.0);
        let operator = Matrix(a.clone());
        let z = (0..n * n).all(|k| k / n == k % n || a[(k / n, k % n)] <= 0.0);
        prop_assert_eq!(is_z(&operator).is_yes(), z);
        let answer = is_h_plus(&operator);
        prop_assert_eq!(answer.is_yes(), h);
        prop_assert_eq!(is_m(&operator).is_yes(), h && is_z(&operator).is_yes());
        let rows = (comparison(&a) * DVector::from_element(n, 1.0)).min();
        prop_assume!(rows.abs() > 1e-12);
        prop_assert_eq!(is_strictly_dominant(&operator).is_yes(), rows > 0.0);
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
