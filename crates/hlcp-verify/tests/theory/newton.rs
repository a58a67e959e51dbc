//! Newton's method without a safeguard, in exact rational arithmetic.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use proptest::{collection::vec, prelude::*};

use crate::{columns::Exact, exact::eliminated, for_all, rational};

/// The hypothesis that a case breaks, if it does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Without {
    Nothing,
    /// `wᵢⱼ ≥ aᵢⱼ` off the diagonal.
    Sizes,
    /// `wⱼⱼ ≥ aⱼⱼ`.
    Diagonal,
    /// No positive entries off the diagonals.
    Signs,
    /// `A` is a nonsingular M-matrix.
    MMatrix,
}

/// A problem and a start.
#[derive(Debug, Clone)]
struct Case {
    of: Exact,
    x: Vec<BigRational>,
}

fn cases(without: Without) -> impl Strategy<Value = Case> {
    (2..8_usize).prop_flat_map(move |n| {
        let matrices = (vec(0..5_i64, n * n), vec(0..9_i64, n * n), vec(1..4_i64, n));
        let point = (vec(1..4_i64, n), vec(-20..21_i64, n), vec(-9..10_i64, n));
        (matrices, point).prop_map(move |((sizes, shares, slack), (d, q, x))| {
            let mut a = vec![vec![rational(0); n]; n];
            let mut w = a.clone();
            for i in 0..n {
                for j in (0..n).filter(|&j| j != i) {
                    let (size, share) = (rational(sizes[i * n + j]), rational(shares[i * n + j]));
                    let sign =
                        if without == Without::Signs && share > rational(4) { 1 } else { -1 };
                    let most = rational(if without == Without::Sizes { 2 } else { 8 });
                    a[i][j] = rational(sign) * &size;
                    w[i][j] = if without == Without::Diagonal {
                        a[i][j].clone()
                    } else {
                        rational(sign) * size * share / most
                    };
                }
                // A d > 0, with d at random: an M-matrix where the signs are right.
                let sum: BigRational = (0..n).map(|j| a[i][j].abs() * rational(d[j])).sum();
                let (slack, d) = (rational(slack[i]), rational(d[i]));
                let part = rational(if without == Without::MMatrix { 2 } else { 1 });
                a[i][i] = (sum + &slack) / d / part;
                w[i][i] = match without {
                    Without::Diagonal => &a[i][i] / rational(2),
                    _ => &a[i][i] * &slack,
                };
            }
            let [q, x] = [q, x].map(|of| of.into_iter().map(rational).collect());
            Case { of: Exact { a, w, q }, x }
        })
    })
}

impl Case {
    /// The zero of the piece that `x` lies on.
    fn newton(&self, x: &[BigRational]) -> Option<Vec<BigRational>> {
        let (n, Exact { a, w, q }) = (x.len(), &self.of);
        let entry =
            |i: usize, j: usize| rational(2) * &if x[j].is_negative() { w } else { a }[i][j];
        let row = |i| (0..n).map(|j| entry(i, j)).chain([-&q[i]]).collect();
        eliminated((0..n).map(row).collect()).map(|(x, _)| x)
    }

    /// The steps from the start to the solution, at most n + 2, if F ≤ 0 and x increases from the
    /// first step on, so that each iterate is below the solution.
    fn rises(&self) -> Option<usize> {
        let mut x = self.x.clone();
        for step in 0..=x.len() + 2 {
            let f: Vec<_> = (0..x.len()).map(|i| self.of.f(i, &x)).collect();
            if f.iter().all(Zero::is_zero) {
                return Some(step);
            }
            if step > 0 && f.iter().any(Signed::is_positive) {
                return None;
            }
            let next = self.newton(&x)?;
            if step > 0 && next.iter().zip(&x).any(|(next, x)| next < x) {
                return None;
            }
            x = next;
        }
        None
    }
}

/// Full steps increase from the first on and end in at most n + 2, from any start, in
/// `HLCP_CASES` random cases, or 1,500.
#[test]
fn newton_rises_to_the_solution() {
    let mut most = 0;
    let asked = for_all(1_500, &cases(Without::Nothing), |case| {
        most = most.max(case.rises().unwrap_or_else(|| panic!("{case:?}")));
    });
    println!("{asked} cases, at most {most} steps");
}

/// Without any one of the hypotheses some do not.
#[test]
fn newton_may_fall_without_any_one_of_the_hypotheses() {
    for without in [Without::Sizes, Without::Diagonal, Without::Signs, Without::MMatrix] {
        let mut rising = 0;
        let asked =
            for_all(300, &cases(without), |case| rising += usize::from(case.rises().is_some()));
        println!("{without:?}: {rising} of {asked} rise");
        assert!(rising < asked, "{without:?}");
    }
}
