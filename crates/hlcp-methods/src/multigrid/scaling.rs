//! The scaling of x under which a fused sweep solves each scalar equation.

use hlcp_core::{Hlcp, LinearOperator, Omega, Rows, Scalar, Smoother};

use super::cycle::rescaled;

/// The Ω = D_A D_B⁻¹ of [`Smoother::scaling`] where it is not the problem's own.
#[derive(Debug, Clone)]
pub(crate) struct Scaling<T>(Option<Omega<T>>);

impl<T: Scalar> Scaling<T> {
    /// That of a problem on five-point operators with positive diagonals.
    pub(crate) fn of<A: LinearOperator<T>, B: LinearOperator<T>>(
        problem: &Hlcp<T, A, B>,
    ) -> Option<Self> {
        Smoother::scaling(problem).ok().map(|scaling| Self::new(problem, scaling))
    }

    /// The one of a problem whose `scaling` this is; the same on all ranks.
    pub(crate) fn new<A: LinearOperator<T>, B: LinearOperator<T>>(
        problem: &Hlcp<T, A, B>,
        scaling: Omega<T>,
    ) -> Self {
        Self(problem.any(scaling != *problem.omega()).then_some(scaling))
    }

    /// Returns whether Ω is the problem's own.
    pub(crate) fn is_own(&self) -> bool {
        self.0.is_none()
    }

    pub(crate) fn smoother<'s, A: LinearOperator<T>, B: LinearOperator<T>>(
        &'s self,
        problem: &'s Hlcp<T, A, B>,
    ) -> Smoother<'s, T> {
        let smoother = Smoother::new(problem, self.0.as_ref(), problem.is_parallel());
        smoother.expect("five-point operators, as those of the scaling")
    }

    /// Takes `x` from the problem's Ω to this one, or back.
    pub(crate) fn rescale<A: LinearOperator<T>, B: LinearOperator<T>>(
        &self,
        problem: &Hlcp<T, A, B>,
        x: &mut [T],
        back: bool,
    ) {
        let Some(scaling) = &self.0 else { return };
        for (k, x) in x.iter_mut().enumerate() {
            let (own, other) = (problem.omega().entry(k), scaling.entry(k));
            *x = rescaled(*x, if back { other / own } else { own / other });
        }
    }
}

/// Overwrites `x` with a sweep that solves each scalar equation, with room for another vector:
/// fused where there is a scaling, and otherwise by rows.
pub(crate) fn exact_sweep<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    scaling: Option<&Scaling<T>>,
    q: &[T],
    x: &mut [T],
    spare: &mut [T],
    backward: bool,
) {
    let Some(scaling) = scaling else { return problem.solve_rows(q, x, backward) };
    scaling.rescale(problem, x, false);
    spare.copy_from_slice(x);
    scaling.smoother(problem).relax(backward, (problem.q_factor(), q), spare, x);
    scaling.rescale(problem, x, true);
}
