use hlcp_core::{
    Aor, Error, Hlcp, LinearOperator, Norms, Rhs, Rows, Scalar, Splitting, SplittingStep, Step,
};

use crate::{Clock, Method, Work};

/// The two-step modulus-based matrix splitting method, TMMS.
///
/// Two splittings `A + BΩ = M₁ − N₁ = M₂ − N₂` take turns; one iteration is
///
/// ```text
/// M₁ xᵏ⁺½ = N₁ xᵏ   + (BΩ − A)|xᵏ|   − γ q ,    the same as    xᵏ⁺½ = xᵏ   − M₁⁻¹ F(xᵏ) ,
/// M₂ xᵏ⁺¹ = N₂ xᵏ⁺½ + (BΩ − A)|xᵏ⁺½| − γ q ,                   xᵏ⁺¹ = xᵏ⁺½ − M₂⁻¹ F(xᵏ⁺½) .
/// ```
///
/// With an AOR splitting and its mirror image this is TMAOR (4), with Gauss–Seidel TMGS; two equal
/// splittings make two iterations of [`Mms`](crate::Mms).
///
/// # Cost
///
/// Two steps per iteration: with [`Aor`]s two walks over the rows of `A` and `B` and no storage.
///
/// # Convergence
///
/// From any start, for a pair of H₊-matrices with (II) `|bᵢⱼ| ωⱼ ≤ |aᵢⱼ|` and `sign bᵢⱼ = sign aᵢⱼ`
/// where `bᵢⱼ ≠ 0`, for all `i ≠ j`:
///
/// * with H-compatible splittings of `A` and `B` in both steps, if
///   `Ωe > D_B⁻¹D_A e − D_B⁻¹D⁻¹⟨A⟩De`, where `⟨A⟩D` is strictly diagonally dominant (Theorem 1);
/// * with AOR splittings, if `Ω ≥ D_A D_B⁻¹` and `0 < β ≤ α < 1/ρ[(D_A + D_BΩ)⁻¹(D_BΩ + |C_A|)]`,
///   where `A = D_A − C_A` (Theorem 2).
///
/// # Source
///
/// Method 2 of H. Zheng and S. Vong, *A two-step modulus-based matrix splitting iteration method
/// for horizontal linear complementarity problems*, Numerical Algorithms.
///
/// ```
/// use hlcp_methods::{Aor, FivePoint, Hlcp, Limits, Options, Solver, Tmms};
///
/// let a = FivePoint::new(8, 8, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(8, 8, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let mut tmaor = Solver::new(Tmms::mirrored(Hlcp::from_pair(a, b)?, Aor::new(1.1, 0.9)?)?);
///
/// let q: Vec<f64> = (0..64).map(|i| (i as f64).sin()).collect();
/// assert!(tmaor.solve(&q, Options::from_x(&[1.0; 64]))?.converged());
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Tmms<T, A, B, S1, S2> {
    problem: Hlcp<T, A, B>,
    first: S1,
    second: S2,
    sweeps: usize,
    scratch: Vec<T>,
}

impl<T: Scalar, A, B, S1, S2> Tmms<T, A, B, S1, S2>
where
    A: LinearOperator<T>,
    B: LinearOperator<T>,
    S1: Step<T, A, B>,
    S2: Step<T, A, B>,
{
    /// The method on `problem` with any two steps.
    ///
    /// # Errors
    ///
    /// Those of [`Step::check`] of either step.
    pub fn new(problem: Hlcp<T, A, B>, first: S1, second: S2) -> Result<Self, Error> {
        problem.agree(first.check(&problem).and_then(|()| second.check(&problem)))?;
        Ok(Self { problem, first, second, sweeps: 0, scratch: Vec::new() })
    }
}

impl<T: Scalar, A, B, S1, S2> Tmms<T, A, B, SplittingStep<S1>, SplittingStep<S2>>
where
    A: LinearOperator<T>,
    B: LinearOperator<T>,
    S1: Splitting<T>,
    S2: Splitting<T>,
{
    /// The method on `problem` with any two splittings of `A + BΩ`, as
    /// [`Mms::with_splitting`](crate::Mms::with_splitting) has one.
    ///
    /// # Errors
    ///
    /// Those of [`Mms::with_splitting`](crate::Mms::with_splitting).
    ///
    /// ```
    /// use hlcp_methods::{Hlcp, Identity, Limits, Omega, Solver, Tmms};
    ///
    /// let one = Identity { order: 1 };
    /// let problem = Hlcp::new(one, one, Omega::Uniform(1.0))?;
    /// let by = |pivot: f64| move |rhs: &[f64], y: &mut [f64]| y[0] = rhs[0] / pivot;
    /// let mut solver = Solver::new(Tmms::with_splittings(problem, by(3.0), by(2.0))?);
    /// assert_eq!(solver.solve(&[-3.0], Limits::default())?.iterations, 1);
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn with_splittings(problem: Hlcp<T, A, B>, first: S1, second: S2) -> Result<Self, Error> {
        Self::new(problem, SplittingStep(first), SplittingStep(second))
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Tmms<T, A, B, Aor<T>, Aor<T>> {
    /// The method with `aor` forward and then backward, equation (4), whatever `aor`'s own
    /// direction.
    ///
    /// # Errors
    ///
    /// Those of [`Step::check`].
    pub fn mirrored(problem: Hlcp<T, A, B>, aor: Aor<T>) -> Result<Self, Error> {
        // Either direction has the same pivots and rows.
        problem.agree(aor.check(&problem))?;
        let (first, second) = (aor.forward(), aor.backward());
        Ok(Self { problem, first, second, sweeps: 0, scratch: Vec::new() })
    }
}

impl<T, A, B, S: Copy> Tmms<T, A, B, S, S> {
    /// Returns the two steps, as the theorems of `hlcp-verify` take those of AOR.
    ///
    /// ```
    /// use hlcp_methods::{Aor, Hlcp, Identity, Tmms};
    ///
    /// let problem = Hlcp::<f64, _, _>::lcp(Identity { order: 3 })?;
    /// let [first, second] = Tmms::mirrored(problem, Aor::sor(1.2)?)?.steps();
    /// assert_eq!(second, first.backward());
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn steps(&self) -> [S; 2] {
        [self.first, self.second]
    }
}

impl<T: Scalar, A, B, S1, S2> Method<T> for Tmms<T, A, B, S1, S2>
where
    A: LinearOperator<T>,
    B: LinearOperator<T>,
    S1: Step<T, A, B>,
    S2: Step<T, A, B>,
{
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, _: &mut Clock<'_>) -> Norms {
        self.sweeps += self.first.sweeps();
        self.first.step(&self.problem, q, x, y, &mut self.scratch)
    }

    fn complete(&mut self, q: &Rhs<'_, T>, y: &mut Vec<T>, spare: &mut Vec<T>) {
        self.sweeps += self.second.sweeps();
        let _ = self.second.step(&self.problem, q, y, spare, &mut self.scratch);
        std::mem::swap(y, spare);
    }

    fn restart(&mut self) {
        self.sweeps = 0;
    }

    fn works_on_ranks(&self) -> bool {
        true
    }

    fn work(&self) -> Option<Work> {
        Some(Work::sweeps(self.sweeps))
    }
}
