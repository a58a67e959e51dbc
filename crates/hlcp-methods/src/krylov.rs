//! Linear systems with J(x): the inner solver of Newton's method, and what may precondition it.

use hlcp_core::{Hlcp, LinearOperator, Rows, Scalar, Splitting, SplittingStep};

use crate::{Clock, Jacobian};

/// An approximate inverse of [`Jacobian`]s: what [`Newton`](crate::Newton) preconditions its inner
/// solver with.
///
/// [`Ssor`] and [`TridiagonalPart`] walk rows; [`Amg`](crate::Amg) is a multigrid cycle built from
/// rows; and a [`SplittingStep`] brings any [`Splitting`] of `A + BΩ`, that is an `M` that ignores
/// which columns are active.
///
/// ```
/// use hlcp_methods::{Diagonal, Jacobian, Preconditioner, Scalar};
///
/// /// The diagonal of J(x).
/// struct OfDiagonal;
///
/// impl<T: Scalar, A: Diagonal<T>, B: Diagonal<T>> Preconditioner<T, A, B> for OfDiagonal {
///     fn solve(&mut self, jacobian: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]) {
///         let (problem, two) = (jacobian.problem(), T::one() + T::one());
///         for (i, (y, &rhs)) in y.iter_mut().zip(rhs).enumerate() {
///             let active = jacobian.is_active(i); // column i is one of A
///             let d = if active {
///                 problem.a().diagonal_entry(i)
///             } else {
///                 problem.b().diagonal_entry(i) * problem.omega().entry(i)
///             };
///             *y = rhs / (two * d);
///         }
///     }
/// }
/// ```
pub trait Preconditioner<T: Scalar, A, B>: Send + Sync {
    /// Overwrites `y` with an approximate solution of `J(x) y = rhs`; what `y` held before is never
    /// read.
    ///
    /// For one and the same J the map from `rhs` to `y` must be linear. What is not finite ends the
    /// inner solve.
    ///
    /// # Panics
    ///
    /// May panic unless both slices have the problem's order.
    fn solve(&mut self, jacobian: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]);
}

impl<T: Scalar, A, B, P: Preconditioner<T, A, B> + ?Sized> Preconditioner<T, A, B> for Box<P> {
    fn solve(&mut self, jacobian: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]) {
        (**self).solve(jacobian, rhs, y);
    }
}

impl<T: Scalar, A, B, P: Preconditioner<T, A, B> + ?Sized> Preconditioner<T, A, B> for &mut P {
    fn solve(&mut self, jacobian: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]) {
        (**self).solve(jacobian, rhs, y);
    }
}

impl<T: Scalar, A, B, S: Splitting<T>> Preconditioner<T, A, B> for SplittingStep<S> {
    fn solve(&mut self, _: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]) {
        self.0.solve(rhs, y);
    }
}

/// Symmetric Gauss–Seidel on J(x): `(D − L) D⁻¹ (D − U)` in the place of `J = D − L − U`.
///
/// # Cost
///
/// Two walks over the rows of `A` and of `B`; no storage.
///
/// ```
/// use hlcp_methods::{FivePoint, Hlcp, Jacobian, Preconditioner, Ssor};
///
/// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
/// let mut y = [0.0; 2];
/// Ssor.solve(&Jacobian::new(&problem, &[1.0, 1.0]), &[4.0, 15.0], &mut y);
/// assert_eq!(y, [1.0, 2.0]); // 2A(1, 2) = (4, 14), to whose second LD⁻¹U adds 2·2·2/8
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Ssor;

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Preconditioner<T, A, B> for Ssor {
    fn solve(&mut self, jacobian: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]) {
        // (D − L) y = rhs, then (D − U) y = D y.
        for i in 0..rhs.len() {
            let (mut known, mut pivot) = (rhs[i], T::zero());
            jacobian.visit_row(i, |j, entry| match j {
                _ if j < i => known -= entry * y[j],
                _ if j == i => pivot = entry,
                _ => {}
            });
            y[i] = known / pivot;
        }
        for i in (0..rhs.len()).rev() {
            let (mut known, mut pivot) = (T::zero(), T::zero());
            jacobian.visit_row(i, |j, entry| match j {
                _ if j > i => known += entry * y[j],
                _ if j == i => pivot = entry,
                _ => {}
            });
            y[i] -= known / pivot;
        }
    }
}

/// Elimination without pivoting in the tridiagonal part of J(x): all of J where `A` and `B` are
/// tridiagonal, the lines of a grid otherwise.
///
/// Stable where J is diagonally dominant by rows or by columns, as on a slider bearing.
///
/// # Cost
///
/// One walk over the rows of `A` and of `B`; `n` numbers, allocated by the first solve.
///
/// ```
/// use hlcp_methods::{Hlcp, Jacobian, Omega, Preconditioner, Tridiagonal, TridiagonalPart};
///
/// let a = Tridiagonal::new(3, |_| [-1.0, 4.0, -2.0])?;
/// let problem = Hlcp::new(a, a, Omega::Uniform(1.0))?;
/// let (x, mut y) = ([1.0, -1.0, 1.0], [0.0; 3]);
/// TridiagonalPart::new().solve(&Jacobian::new(&problem, &x), &[0.0, 2.0, 20.0], &mut y);
/// assert_eq!(y, [1.0, 2.0, 3.0]); // 2A(1, 2, 3) = (0, 2, 20)
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct TridiagonalPart<T> {
    above: Vec<T>,
}

impl<T> TridiagonalPart<T> {
    /// Without its storage yet.
    pub fn new() -> Self {
        Self { above: Vec::new() }
    }
}

impl<T: Scalar> TridiagonalPart<T> {
    /// Returns whether this part is all of J, for every `x`: no row of `A` or `B` has an entry
    /// outside of the three middle diagonals.
    ///
    /// # Cost
    ///
    /// A walk over rows, up to the first that has one.
    ///
    /// ```
    /// use hlcp_methods::{FivePoint, Hlcp, TridiagonalPart};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0])?)?;
    /// assert!(!TridiagonalPart::is_all(&problem));
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn is_all<A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> bool {
        (0..problem.order()).all(|i| {
            let mut near = true;
            let mut see = |j: usize, _| near &= j.abs_diff(i) <= 1;
            problem.a().visit_row(i, &mut see);
            problem.b().visit_row(i, &mut see);
            near
        })
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Preconditioner<T, A, B> for TridiagonalPart<T> {
    fn solve(&mut self, jacobian: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]) {
        self.above.resize(rhs.len(), T::zero());
        let (mut above, mut value) = (T::zero(), T::zero());
        for i in 0..rhs.len() {
            let [mut west, mut here, mut east] = [T::zero(); 3];
            jacobian.visit_row(i, |j, entry| match j {
                _ if j + 1 == i => west = entry,
                _ if j == i => here = entry,
                _ if j == i + 1 => east = entry,
                _ => {}
            });
            let pivot = here - west * above;
            (above, value) = (east / pivot, (rhs[i] - west * value) / pivot);
            (self.above[i], y[i]) = (above, value);
        }
        for i in (1..rhs.len()).rev() {
            let after = y[i];
            y[i - 1] -= self.above[i - 1] * after;
        }
    }
}

/// How an inner solve ended.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inner {
    /// The iterations that ran.
    pub(crate) iterations: usize,
    /// The norm of the residual over that of the right-hand side, as the recurrence has it.
    pub(crate) residual: f64,
}

/// The vectors of BiCGStab with a preconditioner on the right (H. A. van der Vorst, *Bi-CGSTAB: a
/// fast and smoothly converging variant of Bi-CG for the solution of nonsymmetric linear systems*,
/// SIAM J. Sci. Stat. Comput. 13, 1992).
#[derive(Debug, Clone)]
pub(crate) struct BiCgStab<T> {
    residual: Vec<T>,
    shadow: Vec<T>,
    p: Vec<T>,
    v: Vec<T>,
    t: Vec<T>,
    hat: Vec<T>,
    /// For products with J, of length 2n.
    pub(crate) scratch: Vec<T>,
}

impl<T: Scalar> BiCgStab<T> {
    pub(crate) fn new(n: usize) -> Self {
        let [residual, shadow, p, v, t, hat] = std::array::from_fn(|_| vec![T::zero(); n]);
        Self { residual, shadow, p, v, t, hat, scratch: vec![T::zero(); 2 * n] }
    }

    /// Overwrites `s` with an approximate solution of `J s = rhs`.
    ///
    /// Ends when the residual is at most `tolerance` times the right-hand side, after `limit`
    /// iterations, when the clock is up, or where the recurrence breaks down. One iteration is two
    /// products and two calls of the preconditioner.
    pub(crate) fn solve<A: LinearOperator<T>, B: LinearOperator<T>>(
        &mut self,
        jacobian: &Jacobian<'_, T, A, B>,
        preconditioner: &mut impl Preconditioner<T, A, B>,
        rhs: &[T],
        s: &mut [T],
        (tolerance, limit): (f64, usize),
        clock: &mut Clock<'_>,
    ) -> Inner {
        let Self { residual, shadow, p, v, t, hat, scratch } = self;
        let problem = jacobian.problem();
        // In units of the right-hand side, whose squares might overflow or vanish.
        let unit = T::of(problem.norms(rhs).l2);
        if unit == T::zero() {
            s.fill(T::zero());
            return Inner { iterations: 0, residual: 0.0 };
        }
        for (residual, &rhs) in residual.iter_mut().zip(rhs) {
            *residual = rhs / unit;
        }
        shadow.copy_from_slice(residual);
        for zero in [&mut *s, p, v] {
            zero.fill(T::zero());
        }
        let (mut rho, mut alpha, mut omega) = (1.0, 1.0, 1.0);
        let mut inner = Inner { iterations: 0, residual: 1.0 };
        while inner.iterations < limit && inner.residual > tolerance && !clock.is_up() {
            let next = problem.dot(shadow, residual);
            let beta = T::of(next / rho * (alpha / omega));
            let old = T::of(omega);
            for ((p, &residual), &v) in p.iter_mut().zip(&*residual).zip(&*v) {
                *p = residual + beta * (*p - old * v);
            }
            preconditioner.solve(jacobian, p, hat);
            if clock.is_up() {
                break;
            }
            jacobian.apply(hat, v, scratch);
            (rho, alpha) = (next, next / problem.dot(shadow, v));
            if !alpha.is_normal() {
                break;
            }
            inner.iterations += 1;
            add(s, alpha, hat);
            add(residual, -alpha, v);
            inner.residual = problem.dot(residual, residual).sqrt();
            if inner.residual <= tolerance || clock.is_up() {
                break;
            }
            preconditioner.solve(jacobian, residual, hat);
            if clock.is_up() {
                break;
            }
            jacobian.apply(hat, t, scratch);
            omega = problem.dot(t, residual) / problem.dot(t, t);
            if !omega.is_normal() {
                break;
            }
            add(s, omega, hat);
            add(residual, -omega, t);
            inner.residual = problem.dot(residual, residual).sqrt();
        }
        s.iter_mut().for_each(|s| *s *= unit);
        inner
    }
}

/// `uᵀv` in double precision, in lanes that a processor sums side by side.
pub(crate) fn dot<T: Scalar>(u: &[T], v: &[T]) -> f64 {
    let mut lanes = [0.0; 8];
    let [(us, u_rest), (vs, v_rest)] = [u.as_chunks::<8>(), v.as_chunks()];
    let mut add = |u: &[T], v: &[T]| {
        for (lane, (&u, &v)) in lanes.iter_mut().zip(u.iter().zip(v)) {
            *lane += u.wide() * v.wide();
        }
    };
    us.iter().zip(vs).for_each(|(u, v)| add(u, v));
    add(u_rest, v_rest);
    lanes.iter().sum()
}

/// `y += c u`.
pub(crate) fn add<T: Scalar>(y: &mut [T], c: f64, u: &[T]) {
    let c = T::of(c);
    for (y, &u) in y.iter_mut().zip(u) {
        *y += c * u;
    }
}

#[cfg(test)]
mod tests {
    use hlcp_core::{FivePoint, Hlcp, Omega};
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::testing;

    /// BiCGStab with each preconditioner against the dense LU factorisation of its own J, built
    /// from the columns of A, B and Ω.
    #[test]
    fn bicgstab_solves_what_lu_solves() {
        let a = FivePoint::new(5, 4, [-1.1, -0.9, 4.3, -1.3, -0.7]).unwrap();
        let b = FivePoint::new(5, 4, [-0.2, -0.8, 3.1, -0.6, -0.3]).unwrap();
        let omega: Vec<f64> = (0..20).map(|i| 1.2 + 0.3 * f64::sin(i as f64)).collect();
        let problem = Hlcp::new(a, b, Omega::Each(omega.clone())).unwrap();
        let x: Vec<f64> = (0..20).map(|i| f64::cos(2.3 * i as f64)).collect();
        let [of_a, of_b] = [testing::dense(&a), testing::dense(&b)];
        let dense = DMatrix::from_fn(20, 20, |i, j| match x[j] >= 0.0 {
            true => 2.0 * of_a[(i, j)],
            false => 2.0 * omega[j] * of_b[(i, j)],
        });
        let rhs: Vec<f64> = (0..20).map(|i| f64::sin(1.7 * i as f64) + 0.1).collect();
        let values = dense.singular_values();
        let condition = values.max() / values.min();
        let expected = dense.lu().solve(&DVector::from_column_slice(&rhs)).unwrap();
        let identity = |rhs: &[f64], y: &mut [f64]| y.copy_from_slice(rhs);
        let preconditioners: [Box<dyn Preconditioner<f64, _, _>>; 3] =
            [Box::new(Ssor), Box::new(TridiagonalPart::new()), Box::new(SplittingStep(identity))];
        for mut preconditioner in preconditioners {
            for tolerance in [1e-2, 1e-6, 1e-12] {
                let mut s = vec![f64::NAN; 20];
                let jacobian = Jacobian::new(&problem, &x);
                let (goal, clock, of) =
                    ((tolerance, 100), &mut Clock::endless(), &mut preconditioner);
                let inner = BiCgStab::new(20).solve(&jacobian, of, &rhs, &mut s, goal, clock);
                assert!(inner.residual <= tolerance && inner.iterations <= 40, "{inner:?}");
                let off = (DVector::from_vec(s) - &expected).norm() / expected.norm();
                assert!(off <= condition * (tolerance + 1e-14), "{off}");
            }
        }
    }
}
