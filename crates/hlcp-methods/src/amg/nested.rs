//! A start from coarser problems, which rows alone define.

use hlcp_core::{Error, Hlcp, LinearOperator, Norms, Omega, Rows, Scalar};

use super::{
    coarsen::pairs,
    cycle::SMALL,
    matrix::{Matrix, Members, NONE},
    newton::Steps,
    units::Units,
};
use crate::{
    Clock,
    safeguard::{PATIENCE, ROUGH},
};

/// The most members of an aggregate that leftovers join; [`in_series`] has eight bits for them.
const MEMBERS: u32 = 4;

/// Overwrites `x` with what a coarser problem's solution says, if there is a coarser problem with
/// positive diagonals, in these units. Returns the work in walks over the rows.
pub(super) fn start<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    q: &[T],
    units: &Units<T>,
    x: &mut [T],
    clock: &mut Clock<'_>,
) -> Result<f64, Error> {
    let n = x.len();
    if clock.is_up() {
        return Ok(0.0);
    }
    let Some((aggregate, a, b)) = coarser(problem, units, clock) else { return Ok(0.0) };
    let count = a.order();
    if 10 * count > 9 * n || clock.is_up() {
        return Ok(0.0);
    }
    // Ω in units of x and r.
    let own = |i: usize| match &units.unknowns {
        Some([of_x, _, of_r]) => problem.omega().entry(i) * of_x[i] / of_r[i],
        None => problem.omega().entry(i),
    };
    let (mut coarse_q, mut omega) = (vec![T::zero(); count], vec![T::zero(); count]);
    let mut members = vec![T::zero(); count];
    for (i, (&to, &q)) in aggregate.iter().zip(q).enumerate() {
        let to = to as usize;
        coarse_q[to] += units.row(i) * problem.q_factor() * q;
        omega[to] += own(i);
        members[to] += T::one();
    }
    omega.iter_mut().zip(&members).for_each(|(omega, &members)| *omega /= members);
    let coarse = Hlcp::new(a, b, Omega::Each(omega))?;
    let (mut coarse_x, mut steps) = (vec![T::zero(); count], Steps::new(&coarse)?);
    let mut walks = 0.0;
    if count > 2 * SMALL {
        walks += start(&coarse, &coarse_q, &Units::plain(), &mut coarse_x, clock)?;
    }
    // γ is 1, and F the residual.
    let near = ROUGH * Norms::of(&coarse_q).l2;
    let goal = std::mem::replace(&mut clock.goal, near);
    for _ in 0..PATIENCE {
        let solved = steps.step(&coarse, &coarse_q, &mut coarse_x, clock);
        if !solved || steps.measure(&coarse, &coarse_q, &coarse_x).l2 <= near {
            break;
        }
    }
    clock.goal = goal;
    walks += steps.walks();
    if coarse_x.iter().all(|x| x.is_finite()) {
        for (i, (x, &from)) in x.iter_mut().zip(&aggregate).enumerate() {
            // r is the same on both, so −x is divided by Ω's own entry.
            *x = coarse_x[from as usize] * units.x(i);
            if *x < T::zero() {
                *x *= coarse.omega().entry(from as usize) / own(i);
            }
        }
    }
    Ok(walks * count as f64 / n as f64)
}

/// Aggregates, and A and B on them.
type Coarser<T> = (Vec<u32>, Matrix<T>, Matrix<T>);

/// The aggregates of two passes of pairing, unless the clock is up before.
fn coarser<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    units: &Units<T>,
    clock: &mut Clock<'_>,
) -> Option<Coarser<T>> {
    let (mut a, mut b) = (Matrix::of(problem.a(), clock)?, Matrix::of(problem.b(), clock)?);
    for matrix in [&mut a, &mut b] {
        units.rows.iter().for_each(|rows| matrix.scale_rows(rows));
    }
    if let Some([_, of_z, of_r]) = &units.unknowns {
        a.scale_columns(of_z);
        b.scale_columns(of_r);
    }
    let (mut aggregate, a, b) = halved(a, b, clock)?;
    let (second, a, b) = halved(a, b, clock)?;
    aggregate.iter_mut().for_each(|to| *to = second[*to as usize]);
    Some((aggregate, a, b))
}

fn halved<T: Scalar>(a: Matrix<T>, b: Matrix<T>, clock: &mut Clock<'_>) -> Option<Coarser<T>> {
    let trace = |m: &Matrix<T>| m.diagonal.iter().fold(T::zero(), |sum, &d| sum + d);
    // In one unit: of equal traces.
    let both = [(&a, T::one()), (&b, trace(&a) / trace(&b))];
    let (aggregate, bonds) = pairs(&both, &[], MEMBERS, |_| false, clock)?;
    let count = bonds.len();
    let mut sum = |m| in_series(m, &aggregate, count, clock)?.aggregated(&aggregate, count, clock);
    let (a, b) = (sum(a)?, sum(b)?);
    Some((aggregate, a, b))
}

/// The matrix with couplings between aggregates weakened, as conductors are by others in series
/// with them; none when the clock is up.
///
/// From the middle of an aggregate to the middle of the next lead half of the coupling within the
/// one, the coupling between them, and half of that within the other; what leads there side by side
/// adds up. On cells of two by two of a grid that is the usual rule for conductances. Only what is
/// symmetric conducts: transport stays as it is, and so do the sums of rows and of columns, that is
/// the balances.
fn in_series<T: Scalar>(
    mut matrix: Matrix<T>,
    aggregate: &[u32],
    count: usize,
    clock: &mut Clock<'_>,
) -> Option<Matrix<T>> {
    let (zero, two) = (T::zero(), T::one() + T::one());
    // The symmetric part of the negative couplings.
    let back = matrix.across(&matrix.values, clock)?;
    let pairs = matrix.values.iter().zip(&back);
    let conduction: Vec<T> = pairs.map(|(&a, &back)| (-a).min(-back).max(zero)).collect();
    if conduction.iter().all(|&c| c == zero) {
        return Some(matrix);
    }
    let conducts = |i: usize| matrix.places(i).filter(|&(at, _)| conduction[at] > zero);
    let members = Members::new(aggregate, count);
    // Which members of the aggregate at hand, a bit each, touch another one.
    let mut touching = vec![(NONE, 0_u8); count];
    let mut within = vec![zero; matrix.order()];
    let mut half = back;
    half.fill(zero);
    for own in 0..count {
        if clock.is_up_at(own) {
            return None;
        }
        let group = members.of(own);
        for (bit, &i) in group.iter().enumerate() {
            for (_, j) in conducts(i as usize) {
                // Another aggregate's bits are forgotten.
                let touching = &mut touching[aggregate[j] as usize];
                if touching.0 != own as u32 {
                    *touching = (own as u32, 0);
                }
                touching.1 |= 1 << bit;
            }
        }
        for i in group.iter().map(|&i| i as usize) {
            conducts(i).for_each(|(at, k)| within[k] = conduction[at]);
            for (at, j) in conducts(i).filter(|&(_, j)| aggregate[j] as usize != own) {
                // Members that do not touch the other aggregate lie behind i.
                let touches = touching[aggregate[j] as usize].1;
                let behind = group.iter().enumerate().filter(|(bit, _)| touches & (1 << bit) == 0);
                let behind = behind.fold(zero, |sum, (_, &k)| sum + within[k as usize]);
                if behind > zero {
                    half[at] = (two * behind).recip();
                }
            }
            conducts(i).for_each(|(_, k)| within[k] = zero);
        }
    }
    let other = matrix.across(&half, clock)?;
    for i in 0..matrix.order() {
        let mut total = zero;
        for at in matrix.row(i) {
            if half[at] + other[at] > zero {
                let c = conduction[at];
                let loss = c - (c.recip() + half[at] + other[at]).recip();
                matrix.values[at] += loss;
                total += loss;
            }
        }
        matrix.diagonal[i] -= total; // no pivot here
    }
    Some(matrix)
}

#[cfg(test)]
mod tests {
    use hlcp_core::FivePoint;

    use approx::assert_abs_diff_eq;

    use super::*;

    /// Two by two cells of a grid with conductances that jump: in series along an axis, in parallel
    /// across.
    #[test]
    fn cells_of_two_by_two_conduct_as_resistors_do() {
        let c = |i: usize, j: usize| 1.0 + ((7 * i + 3 * j) % 5) as f64;
        let d = |i: usize, j: usize| 2.0 + ((2 * i + 5 * j) % 3) as f64;
        let a = FivePoint::from_fn(4, 4, |i, j| {
            let [s, w, e, n] = [d(i, j), c(i, j), c(i + 1, j), d(i, j + 1)];
            [-s, -w, s + w + e + n, -e, -n]
        });
        let clock = &mut Clock::endless();
        let fine = Matrix::<f64>::of(&a.unwrap(), clock).unwrap();
        let aggregate: Vec<u32> = (0..16).map(|k| k / 8 * 2 + k % 4 / 2).collect();
        let weakened = in_series(fine, &aggregate, 4, clock).unwrap();
        let coarse = weakened.aggregated(&aggregate, 4, clock).unwrap();
        let row = |j: usize| 1.0 / (0.5 / c(1, j) + 1.0 / c(2, j) + 0.5 / c(3, j));
        let line = |i: usize| 1.0 / (0.5 / d(i, 1) + 1.0 / d(i, 2) + 0.5 / d(i, 3));
        let off: Vec<_> = coarse.off(0).collect();
        let expected = [(1, -row(0) - row(1)), (2, -line(0) - line(1))];
        assert_eq!(off.len(), 2);
        for ((to, a), (expected_to, expected)) in off.into_iter().zip(expected) {
            assert!(to == expected_to && (a - expected).abs() < 1e-14, "{to} {a} {expected}");
        }
        // What leads out stays.
        let out = c(0, 0) + c(0, 1) + d(0, 0) + d(1, 0);
        let sum = coarse.off(0).fold(coarse.diagonal[0], |sum, (_, a)| sum + a);
        assert_abs_diff_eq!(sum, out, epsilon = 1e-13);
    }

    #[test]
    fn transport_is_summed_as_it_is() {
        let b = FivePoint::from_fn(6, 1, |i, _| [0.0, -1.0 - i as f64, 2.0 + i as f64, 0.0, 0.0]);
        let clock = &mut Clock::endless();
        let fine = Matrix::<f64>::of(&b.unwrap(), clock).unwrap();
        let aggregate = [0, 0, 1, 1, 2, 2];
        let weakened = in_series(fine, &aggregate, 3, clock).unwrap();
        let coarse = weakened.aggregated(&aggregate, 3, clock).unwrap();
        assert_eq!(coarse.diagonal, [3.0, 5.0, 7.0]);
        assert_eq!(coarse.off(2).collect::<Vec<_>>(), [(1, -5.0)]);
    }
}
