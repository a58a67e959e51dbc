use hlcp_core::{Aor, Error, Hlcp, Norms, Rhs, Rows, Scalar, Step};

use crate::{Clock, Method};

/// The accelerated modulus-based matrix splitting method, AMMS, with AOR splittings.
///
/// With a first splitting `A = M_A₁ − N_A₁`, `B = M_B₁ − N_B₁` from the AOR family and the second one
/// `M_A₂ = D_A − U_A`, `M_B₂ = D_B − U_B`, one iteration solves
///
/// ```text
/// (M_B₁Ω + M_A₁) x⁺ + (N_B₂Ω − N_A₂)|x⁺| = (N_B₁Ω + N_A₁) x + (M_B₂Ω − M_A₂)|x| − γ q .
/// ```
///
/// Since `N_A₂ = L_A` and `N_B₂ = L_B` are strictly lower triangular, the solve is a substitution; it is
/// [`Aor::accelerated_step`]. With a backward splitting `U` takes the place of `L` throughout.
///
/// # Cost
///
/// As [`Mms`](crate::Mms) with an [`Aor`]: one walk over the rows of `A` and `B`, no storage.
///
/// # Convergence
///
/// The paper states no theorem for AMMS and refers to its source.
///
/// # Source
///
/// Section 4 of H. Zheng and S. Vong, *A two-step modulus-based matrix splitting iteration method for
/// horizontal linear complementarity problems*, Numerical Algorithms, who take it from F. Mezzadri and
/// E. Galligani.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega};
/// use hlcp_methods::{Amms, Limits, Options, Solver};
///
/// let a = FivePoint::new(8, 8, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(8, 8, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let omega = Omega::diagonal_ratio(1.0, &a, &b)?;
/// let mut amgs = Solver::new(Amms::new(Hlcp::new(a, b, omega)?, Aor::gauss_seidel())?);
///
/// let q: Vec<f64> = (0..64).map(|i| (i as f64).sin()).collect();
/// assert!(amgs.solve(&q, Options::from_x(&[1.0; 64]))?.converged());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Amms<T, A, B> {
    problem: Hlcp<T, A, B>,
    aor: Aor<T>,
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Amms<T, A, B> {
    /// The method on `problem` with `aor` as the first splitting.
    ///
    /// # Errors
    ///
    /// What the [`Aor`]'s [`check`](Step::check) refuses.
    pub fn new(problem: Hlcp<T, A, B>, aor: Aor<T>) -> Result<Self, Error> {
        aor.check(&problem)?;
        Ok(Self { problem, aor })
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Method<T> for Amms<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, _: &mut Clock<'_>) -> Norms {
        self.aor.accelerated_step(&self.problem, q, x, y)
    }
}
