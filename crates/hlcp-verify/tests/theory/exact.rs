//! Linear systems and certificates in exact arithmetic.

use hlcp_verify::Certificate;
use nalgebra::DMatrix;
use num_rational::BigRational;
use num_traits::{One, Zero};

/// The value as a rational number.
pub(crate) fn exact(value: f64) -> BigRational {
    BigRational::from_float(value).expect("finite")
}

/// Solves `M x = b` of the rows `[M | b]`: `x`, and a positive multiple of
/// `det M`; `None` where that is zero.
///
/// It is Jordan's elimination without fractions, of E. Bareiss.
pub(crate) fn eliminated(rows: Vec<Vec<BigRational>>) -> Option<(Vec<BigRational>, BigRational)> {
    let whole = |row: Vec<BigRational>| {
        // By the least common multiple of its denominators.
        let one = BigRational::one().to_integer();
        let multiple = row.iter().fold(one, |so_far, v| (v * &so_far).denom() * so_far);
        row.into_iter().map(|v| (v * &multiple).to_integer()).collect::<Vec<_>>()
    };
    let mut rows: Vec<Vec<_>> = rows.into_iter().map(whole).collect();
    let (n, mut last) = (rows.len(), BigRational::one().to_integer());
    for k in 0..n {
        let pivot = (k..n).find(|&i| !rows[i][k].is_zero())?;
        if pivot != k {
            // Keeps the sign of the determinant.
            rows.swap(k, pivot);
            rows[k].iter_mut().for_each(|entry| *entry = -&*entry);
        }
        let top = rows[k].clone();
        for row in rows.iter_mut().enumerate().filter(|(i, _)| *i != k).map(|(_, row)| row) {
            let factor = row[k].clone();
            for (entry, above) in row.iter_mut().zip(&top) {
                *entry = (&top[k] * &*entry - &factor * above) / &last;
            }
        }
        last = top[k].clone();
    }
    let x = rows.into_iter().map(|row| BigRational::new(row[n].clone(), last.clone())).collect();
    Some((x, last.into()))
}

/// Whether `x`, a solution as `z − r`, lies within the intervals of a certificate.
pub(crate) fn is_within(certificate: &Certificate, x: &[BigRational]) -> bool {
    x.iter().enumerate().all(|(j, x)| {
        let parts = [x, &-x].map(|part| part.max(&BigRational::zero()).clone());
        certificate.interval(j).iter().zip(parts).all(|([lower, upper], part)| {
            exact(*lower) <= part && (upper.is_infinite() || part <= exact(*upper))
        })
    })
}

/// The `y` that solves HLCP(A, B, q) with `zᵢ = yᵢ` where `in_z` and `rᵢ = yᵢ` elsewhere, whatever
/// its signs.
pub(crate) fn on_columns(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &[f64],
    in_z: &[bool],
) -> Option<Vec<BigRational>> {
    let n = q.len();
    let entry = |i: usize, j: usize| exact(if in_z[j] { a[(i, j)] } else { -b[(i, j)] });
    let row = |i| (0..n).map(|j| entry(i, j)).chain([-exact(q[i])]).collect();
    eliminated((0..n).map(row).collect()).map(|(y, _)| y)
}
