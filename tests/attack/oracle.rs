//! The oracle: all basic solutions of a small problem, and the residual of an answer, in exact
//! arithmetic.

use num_rational::{BigRational, Ratio};
use num_traits::{Signed, Zero};

use crate::problems::{Case, KINDS, Matrix, Pattern, Random, posed};

pub(crate) type Exact = Ratio<i128>;

/// All basic solutions of A z − B r + q = 0, z, r ≥ 0, zᵀr = 0, as x = z − r: those whose columns
/// are linearly independent.
///
/// Each unknown brings its column of A, or that of −B, or none: 3ⁿ choices, of which one with
/// independent columns has one candidate at most. Where there is a solution there is a basic one:
/// as long as its columns depend on each other it can be moved along the dependence until one of
/// them drops out, and it stays complementary. So an empty list is a proof that there is none,
/// singular matrices or not.
///
/// Entries up to 40 in orders up to 5, with q up to 600, have minors below (40√5)⁴·600√5 < 10¹¹ by
/// Hadamard's inequality, and products of three of them fit in 127 bits.
pub(crate) fn solutions(a: &Matrix, b: &Matrix, q: &[i64]) -> Vec<Vec<Exact>> {
    let n = q.len();
    let mut found = vec![];
    for choice in 0..3_usize.pow(n as u32) {
        let sign = |j| (choice / 3_usize.pow(j) % 3) as i64 - 1;
        let signs: Vec<i64> = (0..n as u32).map(sign).collect();
        let Some(x) = on_columns(a, b, q, &signs) else { continue };
        let fits = |(x, &sign): (&Exact, &i64)| !(*x * integer(sign)).is_negative();
        if x.iter().zip(&signs).all(fits) && !found.contains(&x) {
            found.push(x);
        }
    }
    found
}

pub(crate) fn integer(value: i64) -> Exact {
    Exact::from(i128::from(value))
}

/// The solution x of A z − B r + q = 0 with z = x where `signs` is 1, r = −x where it is −1 and
/// both zero elsewhere, whatever the signs of x, if these columns are independent and span q.
fn on_columns(a: &Matrix, b: &Matrix, q: &[i64], signs: &[i64]) -> Option<Vec<Exact>> {
    let n = q.len();
    let columns: Vec<usize> = (0..n).filter(|&j| signs[j] != 0).collect();
    let row = |i: usize| -> Vec<Exact> {
        let entry = |&j: &usize| integer(if signs[j] > 0 { a[i][j] } else { b[i][j] });
        columns.iter().map(entry).chain([integer(-q[i])]).collect()
    };
    let mut rows: Vec<Vec<Exact>> = (0..n).map(row).collect();
    for k in 0..columns.len() {
        let p = (k..n).find(|&p| !rows[p][k].is_zero())?;
        rows.swap(k, p);
        let pivot = rows[k].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            let share = row[k] / pivot[k];
            if i != k && !share.is_zero() {
                row.iter_mut().zip(&pivot).for_each(|(entry, above)| *entry -= share * above);
            }
        }
    }
    let rest = columns.len();
    if rows[rest..].iter().any(|row| !row[rest].is_zero()) {
        return None;
    }
    let mut x = vec![Exact::zero(); n];
    for (k, &j) in columns.iter().enumerate() {
        x[j] = rows[k][rest] / rows[k][k];
    }
    Some(x)
}

pub(crate) fn exact(value: f64) -> BigRational {
    BigRational::from_float(value).expect("finite")
}

/// ‖A z − B r + q‖², without rounding.
pub(crate) fn residual_squared(case: &Case, q: &[f64], z: &[f64], r: &[f64]) -> BigRational {
    let mut sum = BigRational::zero();
    for (i, &q) in q.iter().enumerate() {
        let mut row = exact(q);
        for j in 0..z.len() {
            // Of the two one is zero, and exact products take their time.
            if z[j] != 0.0 {
                row += exact(case.a[i][j] as f64) * exact(z[j]);
            }
            if r[j] != 0.0 {
                row -= exact(case.b[i][j] as f64) * exact(r[j]);
            }
        }
        sum += &row * &row;
    }
    sum
}

/// Of one unknown all is known: a z = −q with z ≥ 0, or b r = q with r ≥ 0.
#[test]
fn the_oracle_knows_problems_of_order_one() {
    let numbers = || -2..=2_i64;
    for (a, b, q) in
        numbers().flat_map(|a| numbers().flat_map(move |b| numbers().map(move |q| (a, b, q))))
    {
        let mut expected = vec![];
        if q == 0 {
            expected.push(vec![Exact::zero()]);
        }
        if a * q < 0 {
            expected.push(vec![integer(-q) / integer(a)]);
        }
        if b * q > 0 {
            expected.push(vec![-integer(q) / integer(b)]);
        }
        let mut found = solutions(&vec![vec![a]], &vec![vec![b]], &[q]);
        found.sort();
        expected.sort();
        assert_eq!(found, expected, "{a}, {b}, {q}");
    }
}

/// What the oracle lists are solutions, and what was planted is listed or depends on other columns.
#[test]
fn the_oracle_finds_planted_solutions() {
    for seed in 0..2000 {
        let random = &mut Random(seed);
        let n = 1 + random.index(5);
        let kind = random.index(KINDS);
        let (a, b, _) = posed(random, &Pattern { n, grid: None }, kind);
        let [planted, q] = random.plant(&a, &b);
        let all = [q, random.vector(n, -4, 4)].map(|q| (solutions(&a, &b, &q), q));
        let zero = Exact::zero();
        for (found, q) in &all {
            for x in found {
                for i in 0..n {
                    let term = |j: usize| {
                        // z or −r, whichever is not zero
                        let entry = if x[j] > zero { a[i][j] } else { b[i][j] };
                        integer(entry) * x[j]
                    };
                    let sum: Exact = (0..n).map(term).sum();
                    assert_eq!(sum, -integer(q[i]), "{a:?}, {b:?}, {q:?}");
                }
            }
        }
        let [(found, q), _] = all;
        assert!(!found.is_empty(), "{a:?}, {b:?}, {q:?}");
        let signs: Vec<i64> = planted.iter().map(|x| x.signum()).collect();
        if let Some(x) = on_columns(&a, &b, &q, &signs) {
            assert!(x.iter().zip(&planted).all(|(x, &p)| *x == integer(p)));
            assert!(found.contains(&x));
        }
    }
}

/// The exact residual of a computed answer, from numbers whose product no float holds.
#[test]
fn the_exact_residual_is_exact() {
    let case = Case::typed("3 0; -1 1", "1 0; 0 2", "-1 0");
    let third = 1.0 / 3.0; // 3·third − 1 is −2⁻⁵⁴, which floats round to zero
    let residual = residual_squared(&case, &case.q(), &[third, 0.0], &[0.0, -third / 2.0]);
    assert_eq!(residual, exact(2_f64.powi(-108)));
}
