//! Uniqueness proved and refuted, against the determinants of all choices of columns.

use std::time::Instant;

use hlcp_core::Identity;
use hlcp_verify::{Disproof, Reason, Uniqueness, Witness, families, uniqueness};
use nalgebra::{DMatrix, DVector, dmatrix};
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use proptest::prelude::*;

use crate::{
    common::asked,
    exact::{eliminated, exact},
    for_all, powers_vanish,
};

/// A positive multiple of the determinant of the columns of `a`, and of `b` where the bit of
/// `choice` is set.
pub(crate) fn determinant([a, b]: [&DMatrix<f64>; 2], choice: u32) -> BigRational {
    let n = a.nrows();
    let entry = |i: usize, j: usize| exact(if choice >> j & 1 == 1 { b } else { a }[(i, j)]);
    let row = |i| (0..n).map(|j| entry(i, j)).chain([BigRational::zero()]).collect();
    eliminated((0..n).map(row).collect()).map_or_else(BigRational::zero, |(_, det)| det)
}

/// Whether all choices of columns have determinants of one sign, so that every `q` has exactly one
/// solution.
pub(crate) fn is_unique(pair: [&DMatrix<f64>; 2]) -> bool {
    let mut signs = (0..1 << pair[0].nrows()).map(|choice| determinant(pair, choice).signum());
    let first = signs.next().expect("the choice of A");
    !first.is_zero() && signs.all(|sign| sign == first)
}

pub(crate) fn is_z(m: &DMatrix<f64>) -> bool {
    (0..m.nrows()).all(|i| (0..m.nrows()).all(|j| i == j || m[(i, j)] <= 0.0))
}

/// Whether a Z-matrix is a nonsingular M-matrix: its leading principal minors are positive.
pub(crate) fn is_m_matrix(n: usize, entry: impl Fn(usize, usize) -> BigRational) -> bool {
    (1..=n).all(|k| {
        let row = |i| (0..k).map(|j| entry(i, j)).chain([BigRational::zero()]).collect();
        eliminated((0..k).map(row).collect()).is_some_and(|(_, minor)| minor.is_positive())
    })
}

fn is_m(m: &DMatrix<f64>) -> bool {
    is_z(m) && is_m_matrix(m.nrows(), |i, j| exact(m[(i, j)]))
}

/// Whether `C d > 0` for all rows of a matrix given by its entries, or its transpose.
fn is_positive(n: usize, c: impl Fn(usize, usize) -> BigRational, d: &[f64]) -> bool {
    d.iter().all(|&d| d > 0.0)
        && (0..n).all(|i| (0..n).map(|j| c(i, j) * exact(d[j])).sum::<BigRational>().is_positive())
}

/// Whether the witness is one, in rational arithmetic.
fn holds(witness: &Witness, [a, b]: [&DMatrix<f64>; 2]) -> bool {
    let n = a.nrows();
    match witness {
        Witness::Left { v } => [a, b].iter().all(|m| {
            let entry = |i: usize, j: usize| exact(m[(i, j)]);
            is_positive(n, |j, i| if i == j { entry(i, j) } else { -entry(i, j).abs() }, v)
        }),
        Witness::Right { omega, d } => {
            let entry = |i: usize, j: usize| {
                let (a, b) = (exact(a[(i, j)]), exact(b[(i, j)]) * exact(omega[j]));
                if i == j { a.min(b) } else { -a.abs().max(b.abs()) }
            };
            is_positive(n, entry, d)
        }
        other => panic!("no rule for {other:?}"),
    }
}

/// The pair of the entries, of order `n`.
fn pair(n: usize, entries: &[f64]) -> [DMatrix<f64>; 2] {
    let (a, b) = entries.split_at(entries.len() / 2);
    [a, b].map(|half| DMatrix::from_row_slice(n, n, &half[..n * n]))
}

/// Pairs up to order 4: of small integers or doubles; with any signs beside the diagonals, or with
/// positive ones in the first column of `B` alone or nowhere; dominant by columns or not; with
/// columns whose sum is zero, exactly or, if the answer says so, up to rounding.
fn pairs() -> impl Strategy<Value = ([DMatrix<f64>; 2], bool)> {
    let real = prop_oneof![-1.0..1.0, -1.0..1.0, Just(0.0)];
    let whole = (-4..5_i32).prop_map(f64::from);
    let entries = prop_oneof![
        prop::collection::vec(real, 32),
        prop::collection::vec(whole.clone(), 32),
        prop::collection::vec(whole, 32),
    ];
    // The diagonals are multiplied: few pairs are unique otherwise.
    let diagonal = prop_oneof![Just(1.0), Just(2.0), Just(8.0)];
    let kinds = (0..3, any::<[bool; 4]>());
    (1..5_usize, entries, kinds, diagonal).prop_map(|(n, mut entries, kinds, weight)| {
        let (signs, [conserving, signed, all, rounded]) = kinds;
        if conserving && !rounded {
            entries.iter_mut().for_each(|entry| *entry = (*entry * 1024.0).round() / 1024.0);
        }
        let mut first = true;
        let pair = pair(n, &entries).map(|mut m| {
            let is_a = std::mem::take(&mut first);
            for j in 0..n {
                for i in 0..n {
                    let entry = m[(i, j)];
                    let z = signs == 0 || signs == 1 && (is_a || j > 0);
                    m[(i, j)] = match (i == j, z) {
                        (true, _) if signed && entry < -0.8 => entry,
                        (true, _) => weight * entry.abs(),
                        (false, true) => -entry.abs(),
                        (false, false) => entry,
                    };
                }
                if conserving && (all || j % 2 == 0) {
                    m[(j, j)] -= m.column(j).sum();
                }
            }
            m
        });
        (pair, conserving && rounded)
    })
}

/// No verdict is false, and a pair of Z-matrices of which one is a nonsingular M-matrix has one.
#[test]
fn no_verdict_is_false() {
    let mut counts = [[0; 3]; 2];
    let asked = for_all(2_000, &pairs(), |([a, b], rounded)| {
        let unique = is_unique([&a, &b]);
        let found = uniqueness(&a, &b).unwrap();
        let are_z = is_z(&a) && is_z(&b);
        let kind = match &found {
            Uniqueness::Proved(witness) => {
                assert!(unique && holds(witness, [&a, &b]), "{found:?} {a} {b}");
                0
            }
            Uniqueness::Refuted(disproof) => {
                assert!(!unique, "{found:?} {a} {b}");
                assert!(disproof.holds(&a, &b));
                1
            }
            Uniqueness::Open(reason) => {
                let decided = are_z && (is_m(&a) || is_m(&b));
                let excused = rounded && *reason == Reason::Rounding;
                assert!(!decided || excused, "{unique} {found:?} {a} {b}");
                2
            }
        };
        counts[usize::from(are_z)][kind] += 1;
    });
    println!("proved, refuted, open: {:?} of any signs, {:?} Z-pairs", counts[0], counts[1]);
    // Refutations of other signs are rare: both choices must be Z-matrices.
    let least = asked / 200;
    let [[of_any_signs, ..], of_z] = counts;
    assert!(of_any_signs > least && of_z.iter().all(|&count| count > least), "{counts:?}");
}

/// The theorem itself: if one choice of columns of a pair of Z-matrices is a nonsingular M-matrix,
/// every `q` has one solution exactly if all choices are.
#[test]
fn one_choice_speaks_for_all() {
    let mut counts = [0; 2];
    let asked = for_all(1_000, &pairs(), |([a, b], _)| {
        let n = a.nrows();
        let choice = |bits: u32| {
            DMatrix::from_fn(n, n, |i, j| if bits >> j & 1 == 1 { b[(i, j)] } else { a[(i, j)] })
        };
        let regular: Vec<bool> = (0..1 << n).map(|bits| is_m(&choice(bits))).collect();
        if is_z(&a) && is_z(&b) && regular.contains(&true) {
            let all = !regular.contains(&false);
            assert_eq!(is_unique([&a, &b]), all, "{a} {b}");
            counts[usize::from(all)] += 1;
        }
    });
    assert!(counts.iter().all(|&count| count > asked / 50), "{counts:?}");
}

/// Without an M-matrix among the choices a `u` proves nothing.
#[test]
fn an_m_matrix_is_needed() {
    let a = dmatrix![1.0, -2.0; -2.0, 1.0];
    assert!(is_unique([&a, &a]));
    assert_eq!(uniqueness(&a, &a).unwrap(), Uniqueness::Open(Reason::NoMMatrix));
    let (none, ones) = (vec![false; 2], vec![1.0; 2]);
    let claim = Disproof { m_matrix: none.clone(), v: ones.clone(), other: none, u: ones };
    assert!(!claim.holds(&a, &a));
}

/// With positive entries beside the diagonal of either choice a disproof would be false.
#[test]
fn both_choices_must_be_z_matrices() {
    for (j, k, v, u) in [
        (dmatrix![1.0, -2.0; 0.0, 1.0], dmatrix![-3.0, -2.0; 2.0, 1.0], [1.0, 3.0], [1.0; 2]),
        (dmatrix![2.0, 3.0; 2.0, -1.0], dmatrix![1.0, 0.0; 0.0, -2.0], [3.0, 2.0], [0.0, 2.0]),
    ] {
        let (m_matrix, other) = (vec![false; 2], vec![true; 2]);
        let claim = Disproof { m_matrix, v: v.to_vec(), other, u: u.to_vec() };
        // All that a disproof asks for, but the signs.
        let sums = |m: &DMatrix<f64>, v: [f64; 2]| m.transpose() * DVector::from(v.to_vec());
        assert!(sums(&j, v).min() > 0.0 && sums(&k, u).max() <= 0.0);
        assert!(is_unique([&j, &k]) && !(is_z(&j) && is_z(&k)));
        assert!(!claim.holds(&j, &k));
        assert!(!matches!(uniqueness(&j, &k).unwrap(), Uniqueness::Refuted(_)));
    }
}

/// A P-matrix and the identity have one solution for every `q`, but no witness: what holds for
/// Z-pairs does not for others.
#[test]
fn other_signs_may_have_no_witness() {
    let a = dmatrix![1.0, 2.0; -2.0, 1.0];
    assert!(is_unique([&a, &DMatrix::identity(2, 2)]));
    let found = uniqueness(&a, &Identity { order: 2 }).unwrap();
    assert_eq!(found, Uniqueness::Open(Reason::Signs));
}

/// Each condition of a disproof, and of its vectors.
#[test]
fn what_is_no_disproof_does_not_hold() {
    let (a, b) = (dmatrix![1.0, -2.0; -2.0, 1.0], DMatrix::identity(2, 2));
    let sound = Disproof {
        m_matrix: vec![true; 2],
        v: vec![1.0; 2],
        other: vec![false; 2],
        u: vec![1.0; 2],
    };
    assert!(sound.holds(&a, &b));
    for spoilt in [
        Disproof { m_matrix: vec![false; 2], ..sound.clone() },
        Disproof { other: vec![true; 2], ..sound.clone() },
        Disproof { v: vec![1.0, 0.0], ..sound.clone() },
        Disproof { v: vec![1.0, f64::NAN], ..sound.clone() },
        Disproof { v: vec![1.0, f64::INFINITY], ..sound.clone() },
        Disproof { u: vec![0.0; 2], ..sound.clone() },
        Disproof { u: vec![-1.0; 2], ..sound.clone() },
        Disproof { u: vec![1.0, 3.0], ..sound.clone() },
        Disproof { u: vec![f64::NAN; 2], ..sound.clone() },
    ] {
        assert!(!spoilt.holds(&a, &b), "{spoilt:?}");
    }
    // Exactly singular, and a unit in the last place beside it.
    let close = |diagonal: f64| dmatrix![diagonal, -0.1; -0.3, 0.1];
    let lean = Disproof { u: vec![1.0; 2], ..sound };
    assert!(lean.holds(&close(0.3), &b) && lean.holds(&close(0.3_f64.next_down()), &b));
    assert!(!lean.holds(&close(0.3_f64.next_up()), &b));
}

/// Verdicts on random families: of all but rings, and of what is dense and of any signs, uniqueness
/// is proved, however coefficients jump.
#[test]
fn verdicts_on_families() {
    let seeds = asked("HLCP_CASES", 1);
    println!("problem, n, verdict, seconds");
    for name in families::NAMES {
        for seed in (700_000..700_000 + seeds).filter(|_| name != "single") {
            let drawn = families::draw(name, seed).unwrap();
            let ([a, b], q) = drawn.pose::<f64>();
            let begin = Instant::now();
            let found = uniqueness(&a, &b).unwrap();
            let seconds = begin.elapsed().as_secs_f64();
            let about = [&drawn.name, &drawn.about];
            let is_among = |family: &str| about.iter().any(|text| text.contains(family));
            let proved = matches!(found, Uniqueness::Proved(_));
            assert!(proved || is_among("rings") || is_among("dense"), "{about:?}: {found:?}");
            let verdict = match found {
                Uniqueness::Proved(Witness::Left { .. }) => "proved from the left".to_owned(),
                Uniqueness::Proved(_) => "proved from the right".to_owned(),
                Uniqueness::Refuted(disproof) => {
                    assert!(disproof.holds(&a, &b));
                    "refuted".to_owned()
                }
                Uniqueness::Open(reason) => reason.to_string(),
            };
            println!("{}, {}, {verdict}, {seconds:.4}", drawn.name, q.len());
        }
    }
}

/// Absolute value equations A x + B|x| = b of order 100, which are HLCP(A + B, A − B, −b).
///
/// One condition for others is that no matrix between A − |B| and A + |B| is singular, for which
/// ρ(|A⁻¹||B|) < 1 suffices. Here A ± B are Z-matrices. Where one of them is a nonsingular
/// M-matrix, uniqueness is decided: proved where the condition holds, and for others too.
#[test]
fn absolute_value_equations() {
    const N: usize = 100;
    let mut counts = [[0; 3]; 2];
    let square = prop::collection::vec(-1.0..1.0_f64, N * N);
    for_all(12, &(square.clone(), square, 0.95..1.25_f64), |(of_a, of_b, weight)| {
        let [of_a, of_b] = [of_a, of_b].map(|entries| DMatrix::from_vec(N, N, entries));
        // B is a tenth of A's entries or less, so that the sum and the difference are Z-matrices.
        let z = DMatrix::from_fn(N, N, |i, j| {
            if i == j { 0.5 * N as f64 * weight } else { -of_a[(i, j)].abs() }
        });
        let b = 0.1 * of_b.component_mul(&z);
        let inverse = z.clone().try_inverse().expect("regular, in all likelihood");
        let is_near = powers_vanish(&(inverse.abs() * b.abs()));
        let kind = match uniqueness(&(&z + &b), &(&z - &b)).unwrap() {
            Uniqueness::Proved(_) => 0,
            Uniqueness::Refuted(_) => 1,
            Uniqueness::Open(reason) => {
                assert_eq!(reason, Reason::NoMMatrix);
                2
            }
        };
        assert!(!is_near || kind != 1);
        counts[usize::from(is_near)][kind] += 1;
        // With full random A and B a tenth of that size nothing is decided.
        let found = uniqueness(&(&of_a + 0.1 * &of_b), &(of_a - 0.1 * of_b)).unwrap();
        assert_eq!(found, Uniqueness::Open(Reason::Signs));
    });
    println!("proved, refuted, open: {:?} with ρ(|A⁻¹||B|) < 1, {:?} others", counts[1], counts[0]);
}
