//! Entries from all of the range of doubles, NaN and infinities: every function returns, and claims
//! nothing false.

use crate::{
    exact::exact,
    for_all,
    uniqueness::{is_m_matrix, is_unique, is_z as is_z_exactly},
};
use approx::assert_abs_diff_eq;
use std::{
    panic::catch_unwind,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
};

use hlcp_core::{Aor, Diagonal, Error, Hlcp, Identity, LinearOperator, Omega, Rows};
use hlcp_verify::{
    Convergence, Proof, Uniqueness, Witness, alpha_bound, certify, certify_box,
    classes::{Answer, Failure, is_h, is_h_plus, is_m, is_z},
    convergence,
    oracle::Dense,
    relaxed_alpha_bound, relaxed_theorem, theorem_1, theorem_2, uniqueness,
};
use nalgebra::{DMatrix, dmatrix, dvector};
use num_traits::Signed;
use proptest::{collection::vec, prelude::*, sample::select};

/// For all functions on one pair together, which make some forty searches: a search has at most 40
/// steps with three walks of each of four rows for each of two steps of a method, and one walk for
/// each entry to begin with.
const WALKS: usize = 50_000;

/// A matrix that says of its diagonal what it likes, and panics when its rows are walked too often.
#[derive(Debug)]
struct Counted {
    rows: DMatrix<f64>,
    diagonal: Vec<f64>,
    walks: AtomicUsize,
}

impl Counted {
    fn new(matrix: DMatrix<f64>) -> Self {
        let diagonal = matrix.diagonal().iter().copied().collect();
        Self { rows: matrix, diagonal, walks: AtomicUsize::new(0) }
    }
}

impl LinearOperator<f64> for Counted {
    fn order(&self) -> usize {
        self.diagonal.len()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.rows.apply(x, y);
    }
}

impl Diagonal<f64> for Counted {
    fn diagonal_entry(&self, i: usize) -> f64 {
        self.diagonal[i]
    }
}

impl Rows<f64> for Counted {
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) {
        assert!(self.walks.fetch_add(1, Relaxed) < WALKS, "more than {WALKS} walks");
        self.rows.visit_row(i, visit);
    }
}

/// Whether ⟨A⟩ is a nonsingular M-matrix.
fn is_h_exactly(a: &DMatrix<f64>) -> bool {
    is_m_matrix(a.nrows(), |i, j| exact(if i == j { a[(i, j)].abs() } else { -a[(i, j)].abs() }))
}

/// Whether it is and the diagonal of A is positive.
fn is_h_plus_exactly(a: &DMatrix<f64>) -> bool {
    a.diagonal().min() > 0.0 && is_h_exactly(a)
}

/// Whether the matrix `C` of a pair and an Ω is a nonsingular M-matrix.
fn is_coupled_exactly(a: &DMatrix<f64>, b: &DMatrix<f64>, omega: &[f64]) -> bool {
    is_m_matrix(a.nrows(), |i, j| {
        let [a, b_omega] = [exact(a[(i, j)]), exact(b[(i, j)]) * exact(omega[j])];
        if i == j { a.min(b_omega) } else { -a.abs().max(b_omega.abs()) }
    })
}

/// (II), the signs and sizes off the diagonal.
fn is_ii_exactly(a: &DMatrix<f64>, b: &DMatrix<f64>, omega: &[f64]) -> bool {
    let n = omega.len();
    (0..n * n).map(|k| (k / n, k % n)).filter(|(i, j)| i != j).all(|(i, j)| {
        let [a, b] = [exact(a[(i, j)]), exact(b[(i, j)])];
        !(&a * &b).is_negative() && b.abs() * exact(omega[j]) <= a.abs()
    })
}

#[test]
fn entries_in_no_column_and_matrices_that_are_not_square_are_refused() {
    let (rows, diagonal) = (DMatrix::from_element(3, 4, -1.0), vec![4.0; 3]);
    let beyond = Counted { rows, diagonal, walks: AtomicUsize::new(0) };
    let (one, ones) = (Identity { order: 3 }, [1.0; 3]);
    for (pair, what) in
        [([&beyond as &dyn Rows<f64>, &one], "row of A"), ([&one, &beyond], "row of B")]
    {
        let refused = Error::Outside { what, row: 0, column: 3, order: 3 };
        assert_eq!(uniqueness(pair[0], pair[1]), Err(refused.clone()));
        assert_eq!(certify(pair[0], pair[1], &ones, &ones, &ones).unwrap_err(), refused);
    }
    let fails = Answer::No(Failure::Entry { row: 0, column: 3 });
    assert_eq!(
        (is_z(&beyond), is_h(&beyond)),
        (fails, Answer::No(Failure::Entry { row: 0, column: 3 }))
    );
    for [rows, columns] in [[3, 2], [2, 3]] {
        let oblong = DMatrix::from_element(rows, columns, 1.0);
        assert!(uniqueness(&oblong, &one).is_err());
        assert!(catch_unwind(|| is_h(&oblong)).is_err() && catch_unwind(|| is_z(&oblong)).is_err());
    }
}

#[derive(Debug)]
struct Case {
    a: Counted,
    b: Counted,
    omega: Vec<f64>,
    q: Vec<f64>,
}

/// Matrices of order 1 to 4 whose rows and columns are scaled by anything, in half of the cases
/// both alike: products leave the doubles on both sides. In half some entries are replaced, and in
/// half of those a diagonal that is no number keeps silent about it.
fn cases() -> impl Strategy<Value = Case> {
    const SCALES: [f64; 10] = [5e-324, 1e-300, 1e-165, 1e-160, 1e-4, 1.0, 1e4, 1e160, 1e165, 1e300];
    const SHARES: [f64; 10] = [0.0, -0.0, 0.0, 0.1, -0.1, 0.3, -0.3, 0.5, 0.8, -1.2];
    #[rustfmt::skip] // a list
    const ENTRIES: [f64; 14] = [
        0.0, -0.0, 5e-324, -1e-310, 1e-300, 1e-165, 1.0, -1.0, 1e165, -1e165, 1e300,
        f64::INFINITY, f64::NEG_INFINITY, f64::NAN,
    ];
    let scales = |n| {
        let one = Just(vec![1.0; n]);
        let two = (select(&SCALES), select(&SCALES), vec(any::<bool>(), n));
        let two =
            two.prop_map(|(s, t, which)| which.iter().map(|&w| if w { s } else { t }).collect());
        prop_oneof![one, two, vec(select(&SCALES), n)]
    };
    let matrix = |n, [spoilt, silent]: [bool; 2], [left, right]: [Vec<f64>; 2]| {
        let others = vec((0..8_usize, select(&ENTRIES)), n * n);
        (vec(select(&SHARES), n * n), others).prop_map(move |(shares, others)| {
            let entry = |i: usize, j: usize| {
                left[i] * if i == j { 1.0 } else { shares[i * n + j] } * right[j]
            };
            let mut counted = Counted::new(DMatrix::from_fn(n, n, entry));
            for (k, (chance, other)) in others.into_iter().enumerate() {
                if spoilt && chance == 0 {
                    counted.rows[(k / n, k % n)] = other;
                    if k / n == k % n && (other.is_finite() || !silent) {
                        counted.diagonal[k / n] = other;
                    }
                }
            }
            counted
        })
    };
    (1..5_usize, any::<[bool; 3]>()).prop_flat_map(move |(n, [spoilt, silent, alike])| {
        (scales(n), scales(n), scales(n), scales(n), scales(n)).prop_flat_map(
            move |(left, right, other_left, other_right, q)| {
                let sides = [left, right];
                let other = if alike { sides.clone() } else { [other_left, other_right] };
                let omega = if alike { Just(vec![1.0; n]).boxed() } else { scales(n).boxed() };
                let [a, b] = [sides, other].map(|sides| matrix(n, [spoilt, silent], sides));
                (a, b, omega).prop_map(move |(a, b, omega)| Case { a, b, omega, q: q.clone() })
            },
        )
    })
}

/// Whether the answer says more than that an entry or a parameter is out of range.
fn claims<W>(answer: &Answer<W>) -> bool {
    matches!(answer, Answer::Yes(_) | Answer::No(Failure::Radius(_)))
}

/// How many (matrices, pairs) were decided.
fn check(Case { a, b, omega, q }: &Case) -> Result<[usize; 2], TestCaseError> {
    let n = q.len();
    let matrices = [&a.rows, &b.rows];
    let sound = matrices.map(|m| m.iter().all(|entry| entry.is_finite()));
    let mut decided = [0, 0];
    for (m, sound) in [a, b].into_iter().zip(sound) {
        let answers = [is_h(m), is_h_plus(m), is_m(m)];
        decided[0] += usize::from(claims(&answers[0]));
        if sound {
            let (yes, plus) = (is_h_exactly(&m.rows), is_h_plus_exactly(&m.rows));
            let truths = [yes, plus, plus && is_z_exactly(&m.rows)];
            for (answer, truth) in answers.iter().zip(truths) {
                let holds = if answer.is_yes() { truth } else { !claims(answer) || !yes };
                prop_assert!(holds, "{answer:?}");
            }
        } else {
            prop_assert!(!answers.iter().any(claims), "{answers:?}");
            prop_assert!(!is_z(m).is_yes());
        }
    }

    let (ones, zero) = (vec![1.0; n], vec![0.0; n]);
    let ends = [-1.0, 1.0].map(|way| q.iter().map(|q| way * q.abs()).collect::<Vec<f64>>());
    let certificates = [
        certify(a, b, q, &zero, &ones).unwrap().ok(),
        certify_box(a, b, q, [&ends[0], &ends[1]], [&zero, &ones]).unwrap(),
    ];
    let unique = uniqueness(a, b).unwrap();
    let problem = Hlcp::new(a, b, Omega::Each(omega.clone())).unwrap();
    let gauss_seidel = Aor::gauss_seidel();
    let relaxed = relaxed_theorem(&problem, &[gauss_seidel]);
    let first = theorem_1(&problem, &[gauss_seidel]);
    let [one, two] = [first.applies(), theorem_2(&problem, &[gauss_seidel]).applies()];
    let brackets = [alpha_bound(&problem), relaxed_alpha_bound(&problem)];
    let convergences = [
        vec![gauss_seidel],
        vec![Aor::new(1.2, 0.7).unwrap(), Aor::new(1.2, 0.7).unwrap().backward()],
        vec![Aor::new(0.9, 1.1).unwrap().accelerated()],
    ]
    .map(|steps| convergence(&problem, &steps));
    decided[1] += usize::from(claims(&relaxed));

    if sound == [true; 2] {
        let [a, b] = matrices;
        let both = || is_h_plus_exactly(a) && is_h_plus_exactly(b);
        let coupled = is_coupled_exactly(a, b, omega);
        prop_assert!(!claims(&relaxed) || relaxed.is_yes() == coupled, "{relaxed:?}");
        prop_assert!(!one || both() && is_ii_exactly(a, b, omega));
        prop_assert!(!two || coupled && is_ii_exactly(a, b, omega));
        for found in &convergences {
            let holds = match found {
                Convergence::Proved(Proof::Theorem2 | Proof::Relaxed, _) => coupled,
                // To the only solution, whatever q is.
                Convergence::Proved(..) => is_unique([a, b]),
                Convergence::NotProved(_) => true,
            };
            prop_assert!(holds, "{found:?}");
        }
        // D − G of (16) is ⟨A⟩, and C of the other.
        for (bracket, is_m) in brackets.iter().zip([is_h_plus_exactly(a), coupled]) {
            let holds = if is_m { bracket.lower < 1.0 } else { bracket.upper >= 1.0 };
            prop_assert!(holds, "{bracket:?}");
        }
        // That a solution is near is compared by another test.
        for found in certificates.iter().flatten() {
            let bounds = || found.z.iter().chain(&found.r);
            prop_assert!(bounds().all(|&bound| bound >= 0.0), "{found:?}");
        }
        let holds = match &unique {
            Uniqueness::Proved(Witness::Left { .. }) => both(),
            Uniqueness::Proved(Witness::Right { omega, .. }) => is_coupled_exactly(a, b, omega),
            // Another test holds disproofs against exact arithmetic.
            _ => true,
        };
        prop_assert!(holds);
    } else {
        prop_assert!(certificates.iter().all(Option::is_none), "{certificates:?}");
        prop_assert!(matches!(unique, Uniqueness::Open(_)), "{unique:?}");
        prop_assert!(!claims(&relaxed) && !one && !two, "{relaxed:?}");
        let proved = |c: &Convergence| matches!(c, Convergence::Proved(..));
        prop_assert!(!convergences.iter().any(proved), "{convergences:?}");
        prop_assert!(sound[0] || !first.signs_and_sizes.is_yes());
        let [_, all] = brackets;
        prop_assert_eq!((all.lower, all.upper), (0.0, f64::INFINITY));
    }
    Ok(decided)
}

#[test]
fn every_claim_about_hostile_pairs_is_exactly_true() {
    let mut decided = [0, 0];
    let asked = for_all(2_000, &cases(), |case| {
        let [matrices, pairs] = check(&case).unwrap_or_else(|e| panic!("{e}: {case:?}"));
        decided = [decided[0] + matrices, decided[1] + pairs];
    });
    println!("{asked} pairs: {} matrices and {} pairs decided", decided[0], decided[1]);
    assert!(decided[0] > asked / 2 && decided[1] > asked / 8, "{decided:?}");
}

/// The balancing of rows meets 10¹⁶⁵/10⁻¹⁶⁵ and its inverse; balanced, all moduli are 1.
#[test]
fn ratios_beyond_the_doubles_are_balanced() {
    let (small, large) = (1e-165, 1e165);
    let a = Counted::new(dmatrix![1.0, small, 0.0; large, 1.0, large; 0.0, small, 1.0]);
    let b = Identity { order: 3 };
    assert!(!uniqueness(&a, &b).unwrap().is_proved());
    let problem = Hlcp::new(&a, &b, Omega::Uniform(1.0)).unwrap();
    let proof = convergence(&problem, &[Aor::gauss_seidel()]);
    assert!(matches!(proof, Convergence::NotProved(_)));
    let answer = is_h(&a);
    assert!(matches!(answer, Answer::No(Failure::Radius(r)) if r <= 2_f64.sqrt()), "{answer:?}");
    // (I + |C_A|)/2
    let bracket = alpha_bound(&problem);
    assert!(bracket.lower > 1.207 && bracket.upper < 1.208, "{bracket:?}");
}

/// a₁₂b₁₂ = −10⁻⁴⁰⁰ rounds to zero, which has no sign.
#[test]
fn signs_are_compared_where_products_underflow() {
    let a = dmatrix![1.0, 1e-100; 0.0, 1.0];
    let b = dmatrix![1.0, -1e-300; 0.0, 1.0];
    let problem = Hlcp::new(a, b, Omega::Each(vec![1.0, 1e100])).unwrap();
    let theorem = theorem_1(&problem, &[Aor::gauss_seidel()]);
    assert_eq!(theorem.signs_and_sizes, Answer::No(Failure::Entry { row: 0, column: 1 }));
}

/// a₁₁ + b₁₁ is 3.4·10³⁰⁸, which the largest double is far from.
#[test]
fn no_radius_is_stated_where_a_sum_overflows() {
    let a = dmatrix![1.7e308, 0.3e308; 1.6e308, 0.4e308];
    let b = dmatrix![1.7e308, 0.0; 0.0, 0.4e308];
    assert!(is_coupled_exactly(&a, &b, &[1.0; 2]));
    let problem = Hlcp::new(a, b, Omega::Uniform(1.0)).unwrap();
    let relaxed = relaxed_theorem(&problem, &[Aor::gauss_seidel()]);
    assert!(!matches!(relaxed, Answer::No(_)), "{relaxed:?}");
}

/// A z of 10⁶⁰⁰ is not infinity.
#[test]
fn a_solution_is_finite() {
    let (a, b) = (dmatrix![1e-300], dmatrix![1.0]);
    let (q, omega) = (dvector![-1e300], dvector![1.0]);
    assert!(Dense { a, b, q, omega, gamma: 1.0 }.solutions().is_empty());
}

/// A bound that is NaN bounds nothing.
#[test]
fn the_error_of_a_certificate_keeps_nan() {
    let one = Identity { order: 1 };
    let mut certificate = certify(&one, &one, &[-1.0], &[1.5], &[0.0]).unwrap().unwrap();
    certificate.z = vec![f64::NAN];
    assert!(certificate.error().is_nan());
}

/// Nothing is proved of no steps, and of order 1 what is proved is sharp.
#[test]
fn no_steps_and_one_unknown_are_no_exceptions() {
    let good = dmatrix![4.0, -1.0; 0.5, 3.0];
    let problem = Hlcp::new(good.clone(), good, Omega::Each(vec![1.0, 1.0])).unwrap();
    assert!(matches!(convergence(&problem, &[]), Convergence::NotProved(_)));
    assert!(!theorem_1(&problem, &[]).applies());

    let one = Hlcp::new(dmatrix![2.0], dmatrix![3.0], Omega::Uniform(0.7)).unwrap();
    let proved = convergence(&one, &[Aor::gauss_seidel()]);
    let Convergence::Proved(_, contraction) = proved else { panic!("order 1") };
    // |BΩ − A|/(A + BΩ) = 0.1/4.1
    assert_abs_diff_eq!(contraction.factor, 0.1 / 4.1, epsilon = 1e-14);
    let certificate = certify(one.a(), one.b(), &[-4.0], &[2.5], &[0.0]).unwrap().unwrap();
    assert!(certificate.z[0] >= 0.5 && certificate.z[0] < 0.5 + 1e-14);
}
