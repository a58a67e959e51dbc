//! The theorems, the certificates and the classes of matrices.

mod classes;
mod columns;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod convergence;
mod enclosure;
mod exact;
mod examples;
mod hostile;
mod newton;
mod sizes;
mod theorems;
mod tight;
mod time;
mod uniqueness;

use common::{asked, textbook};
use hlcp_core::Aor;
use hlcp_verify::{Planted, oracle::Iteration};
use nalgebra::{DMatrix, DVector};
use proptest::{prelude::*, strategy::ValueTree, test_runner::TestRunner};

use num_rational::BigRational;

fn rational(whole: i64) -> BigRational {
    BigRational::from_integer(whole.into())
}

/// Calls `each` with as many random cases as the environment asks for, or `usual`; returns how
/// many.
fn for_all<V>(usual: usize, strategy: &impl Strategy<Value = V>, mut each: impl FnMut(V)) -> usize {
    let (asked, mut runner) = (asked("HLCP_CASES", usual), TestRunner::default());
    (0..asked).for_each(|_| each(strategy.new_tree(&mut runner).unwrap().current()));
    asked
}

fn comparison(a: &DMatrix<f64>) -> DMatrix<f64> {
    let mut comparison = -a.abs();
    comparison.set_diagonal(&a.diagonal().abs());
    comparison
}

/// Returns whether ρ < 1 for a non-negative matrix: some power of it sums up to less than 1 then,
/// of a radius of 1 − 10⁻⁹ the 2³⁶th, and else none does.
fn powers_vanish(p: &DMatrix<f64>) -> bool {
    let mut power = p.clone();
    (0..40).any(|_| {
        power = &power * &power;
        power.sum() < 1.0
    })
}

/// Any pair with positive diagonals, dominant or not.
fn any_pair(weight: f64) -> impl Strategy<Value = Planted> {
    common::planted(2..9, weight)
}

/// Runs the textbook steps from afar: (15), the factor in ‖·‖_d, and ‖P₂P₁‖_d ≤ factor, so that
/// ρ(P₂P₁) is no larger.
fn contracts(p: &Planted, steps: &[Aor<f64>], d: &[f64], factor: f64) -> Result<(), TestCaseError> {
    let star = p.dense.gamma / 2.0 * (&p.z - p.r.component_div(&p.dense.omega));
    let all: Vec<Iteration> = steps.iter().map(|step| textbook(&p.dense, step)).collect();
    let n = star.len();
    let product = all.iter().fold(DMatrix::identity(n, n), |product, t| t.contraction() * product);
    let image = product * DVector::from_column_slice(d);
    prop_assert!(image.iter().zip(d).all(|(p, d)| *p <= factor * d * (1.0 + 1e-9)));
    let norm = |x: &DVector<f64>| x.iter().zip(d).map(|(x, d)| x.abs() / d).fold(0.0, f64::max);
    let mut x = star.map(|x| 7.0 * x.cos() - 40.0 * x.sin());
    let size = x.amax() + star.amax();
    let floor = 1e-9 * size * (d.iter().fold(0.0_f64, |m, d| m.max(1.0 / d)));
    for _ in 0..12 {
        let before = &x - &star;
        for t in &all {
            let old = &x - &star;
            x = t.step(&x);
            let excess = (&x - &star).abs() - t.contraction() * old.abs();
            prop_assert!(excess.max() <= 1e-9 * size);
        }
        prop_assert!(norm(&(&x - &star)) <= factor * norm(&before) + floor);
    }
    Ok(())
}

/// The distance from the solution of `p` that 200 iterations of the textbook steps leave, having
/// started 0.3 from it.
fn distance_left(p: &Planted, steps: &[Aor<f64>]) -> f64 {
    let mut x = p.x().map(|x| x + 0.3);
    for _ in 0..200 {
        steps.iter().for_each(|step| x = textbook(&p.dense, step).step(&x));
    }
    (x - p.x()).amax()
}
