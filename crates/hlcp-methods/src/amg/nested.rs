//! A start from coarser problems.

use hlcp_core::{Coefficients, FivePointView, Hlcp, Norms, Omega, Rows, Scalar, VaryingFivePoint};

use super::newton::Steps;
use crate::krylov::to_scalar;

type Coarse<T> = Hlcp<T, VaryingFivePoint<'static, T>, VaryingFivePoint<'static, T>>;

const SMALL: usize = 300;
const STEPS: usize = 4;

/// Overwrites `x` with a start.
pub(super) fn start<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    q: &[T],
    x: &mut [T],
    steps: &mut Steps<T>,
) {
    let Some((coarse, fine_to)) = coarser(problem) else { return };
    let n = coarse.order();
    let mut qc = vec![T::zero(); n];
    let factor = problem.q_factor();
    for (k, &q) in q.iter().enumerate() {
        qc[fine_to(k)] += factor * q;
    }
    let Ok(mut on_coarse) = Steps::new(&coarse) else { return };
    let mut xc = vec![T::one(); n];
    for (k, &x) in x.iter().enumerate() {
        xc[fine_to(k)] = x;
    }
    if n > SMALL {
        start(&coarse, &qc, &mut xc, &mut on_coarse);
    }
    let size = Norms::of(&qc).l2;
    for _ in 0..STEPS {
        if !on_coarse.step(&coarse, &qc, &mut xc) {
            break;
        }
        if on_coarse.measure(&coarse, &qc, &xc).l2 <= 1e-3 * size {
            break;
        }
    }
    let share = n as f64 / x.len() as f64;
    steps.sweeps += (share * (on_coarse.sweeps as f64 + on_coarse.amg.walks())) as usize;
    if xc.iter().all(|x| x.is_finite()) {
        for (k, x) in x.iter_mut().enumerate() {
            *x = xc[fine_to(k)];
            if *x < T::zero() {
                *x = *x * coarse.omega().at(fine_to(k)) / problem.omega().at(k);
            }
        }
    }
}

/// The problem on cells of two by two, and which of them a point is in.
fn coarser<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
) -> Option<(Coarse<T>, impl Fn(usize) -> usize + use<T, A, B>)> {
    let fine @ [nx, ny] = problem.grid().ok()?;
    if nx < 8 || ny < 8 {
        return None;
    }
    let [mx, my] = fine.map(|n| n.div_ceil(2));
    let (a, b) = (problem.a().as_five_point()?, problem.b().as_five_point()?);
    let a = conductances(a, fine, [mx, my])?;
    let b = sums(b, fine, [mx, my])?;
    let to = move |k: usize| (k / nx / 2) * mx + k % nx / 2;
    let omega = match problem.omega() {
        Omega::Uniform(omega) => Omega::Uniform(*omega),
        Omega::Each(each) => {
            let (mut sum, mut count) = (vec![T::zero(); mx * my], vec![T::zero(); mx * my]);
            for (k, &omega) in each.iter().enumerate() {
                sum[to(k)] += omega;
                count[to(k)] += T::one();
            }
            Omega::Each(sum.iter().zip(&count).map(|(&s, &c)| s / c).collect())
        }
    };
    Some((Hlcp::new(a, b, omega).ok()?, to))
}

/// South, west, centre, east, north of each coarse cell, summed.
fn sums<T: Scalar>(
    view: FivePointView<'_, T>,
    [nx, ny]: [usize; 2],
    [mx, my]: [usize; 2],
) -> Option<VaryingFivePoint<'static, T>> {
    let [south, west, centre, east, north] = view.coefficients();
    VaryingFivePoint::from_fn(mx, my, |ci, cj| {
        let mut row = [T::zero(); 5];
        for j in 2 * cj..(2 * cj + 2).min(ny) {
            for i in 2 * ci..(2 * ci + 2).min(nx) {
                let k = j * nx + i;
                row[2] += centre.at(k);
                let mut put = |inside: bool, within: bool, direction: usize, c: T| {
                    if inside {
                        row[if within { 2 } else { direction }] += c;
                    }
                };
                put(j > 0, j > 2 * cj, 0, south.at(k));
                put(i > 0, i > 2 * ci, 1, west.at(k));
                put(i + 1 < nx, i == 2 * ci, 3, east.at(k));
                put(j + 1 < ny, j == 2 * cj, 4, north.at(k));
            }
        }
        row
    })
    .ok()
}

/// As [`sums`], but what couples two coarse cells is a chain of couplings: in series along an axis, in parallel across it.
fn conductances<T: Scalar>(
    view: FivePointView<'_, T>,
    [nx, ny]: [usize; 2],
    coarse: [usize; 2],
) -> Option<VaryingFivePoint<'static, T>> {
    let coefficients = view.coefficients();
    let plain = sums(view, [nx, ny], coarse)?;
    let plain = hlcp_core::LinearOperator::as_five_point(&plain)?.coefficients();
    let two = T::one() + T::one();
    // From the cell k in a direction, and the one before it, which is half of the way.
    let series = |direction: usize, k: usize, before: Option<usize>, after: Option<usize>| {
        let c = |k: usize| coefficients[direction].at(k);
        let here = c(k);
        if here == T::zero() {
            return here;
        }
        let mut resistance = here.recip();
        for other in [before, after].into_iter().flatten().map(c) {
            if other * here > T::zero() {
                resistance += (two * other).recip();
            }
        }
        resistance.recip()
    };
    VaryingFivePoint::from_fn(coarse[0], coarse[1], |ci, cj| {
        let mut row = [0, 1, 2, 3, 4].map(|d: usize| Coefficients::at(&plain[d], cj * coarse[0] + ci));
        let excess = row.iter().fold(T::zero(), |sum, &c| sum + c);
        let mut new = [T::zero(); 5];
        for j in 2 * cj..(2 * cj + 2).min(ny) {
            let i = 2 * ci;
            if i > 0 {
                // i → i − 1; before: i + 1 → i; after: i − 1 → i − 2.
                let (k, before) = (j * nx + i, (i + 1 < nx).then_some(j * nx + i + 1));
                new[1] += series(1, k, before, Some(k - 1));
            }
            let i = 2 * ci + 1;
            if i + 1 < nx {
                let k = j * nx + i;
                new[3] += series(3, k, Some(k - 1), (i + 2 < nx).then_some(k + 1));
            }
        }
        for i in 2 * ci..(2 * ci + 2).min(nx) {
            let j = 2 * cj;
            if j > 0 {
                let (k, before) = (j * nx + i, (j + 1 < ny).then_some((j + 1) * nx + i));
                new[0] += series(0, k, before, Some(k - nx));
            }
            let j = 2 * cj + 1;
            if j + 1 < ny {
                let k = j * nx + i;
                new[4] += series(4, k, Some(k - nx), (j + 2 < ny).then_some(k + nx));
            }
        }
        let others = [0, 1, 3, 4].iter().fold(T::zero(), |sum, &d| sum + new[d]);
        row = new;
        row[2] = excess - others;
        row
    })
    .ok()
}
