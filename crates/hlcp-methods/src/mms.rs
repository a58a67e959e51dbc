use hlcp_core::{Error, Hlcp, LinearOperator, Norms, Rhs, Scalar, Splitting, SplittingStep, Step};

use crate::{Clock, Method, Work};

/// The modulus-based matrix splitting method, MMS.
///
/// With `z = (|x| + x)/γ` and `r = Ω(|x| − x)/γ` the problem reads
/// `(A + BΩ) x = (BΩ − A)|x| − γ q`. For a splitting `A + BΩ = M − N` one iteration is
///
/// ```text
/// M x⁺ = N x + (BΩ − A)|x| − γ q ,    the same as    x⁺ = x − M⁻¹ F(x) ,
/// ```
///
/// and it is the second form that runs: it needs no `N`, and `F(x) = γ(A z − B r + q)` is what the
/// stopping test looks at anyway.
///
/// # Cost
///
/// One step per iteration. With an [`Aor`](hlcp_core::Aor) it is one walk over the rows of `A` and
/// `B` and takes no storage. With a [splitting of your own](Self::with_splitting) it is one
/// product with each and one solve with `M`, and takes `2n` numbers.
///
/// # Convergence
///
/// From any start, for a pair of H₊-matrices with (II) `|bᵢⱼ| ωⱼ ≤ |aᵢⱼ|` and `sign bᵢⱼ = sign aᵢⱼ`
/// where `bᵢⱼ ≠ 0`, for all `i ≠ j`:
///
/// * with H-compatible splittings of `A` and `B`, if `Ωe > D_B⁻¹D_A e − D_B⁻¹D⁻¹⟨A⟩De`, where
///   `⟨A⟩D` is strictly diagonally dominant (Theorem 1 with equal steps);
/// * with AOR splittings, if `Ω ≥ D_A D_B⁻¹` and `0 < β ≤ α < 1/ρ[(D_A + D_BΩ)⁻¹(D_BΩ + |C_A|)]`,
///   where `A = D_A − C_A` (Corollary 1).
///
/// # The accelerated method, AMMS
///
/// With [`Aor::accelerated`](hlcp_core::Aor::accelerated) for the step this is AMMS: |x⁺| takes the
/// place of |x| wherever the sweep has passed. The cost is the same. The paper states no theorem
/// for it and refers to its source; two theorems of `docs/theory.md` cover it, the relaxed one, and
/// for SOR the column theorem, which holds on films.
///
/// # Source
///
/// Method 1 and, for AMMS, section 4 of H. Zheng and S. Vong, *A two-step modulus-based matrix
/// splitting iteration method for horizontal linear complementarity problems*, Numerical
/// Algorithms, who take it from F. Mezzadri and E. Galligani.
///
/// ```
/// use hlcp_methods::{Aor, FivePoint, Hlcp, Mms, Options, Solver};
///
/// let a = FivePoint::new(8, 8, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(8, 8, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let problem = Hlcp::from_pair(a, b)?;
/// let mut msor = Solver::new(Mms::new(problem.clone(), Aor::sor(1.2)?)?);
/// let mut amsor = Solver::new(Mms::new(problem, Aor::sor(1.2)?.accelerated())?);
///
/// let q: Vec<f64> = (0..64).map(|i| (i as f64).sin()).collect();
/// assert!(msor.solve(&q, Options::default())?.converged());
/// assert!(amsor.solve(&q, Options::default())?.converged());
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Mms<T, A, B, S> {
    problem: Hlcp<T, A, B>,
    step: S,
    sweeps: usize,
    scratch: Vec<T>,
}

impl<T: Scalar, A, B, S> Mms<T, A, B, S>
where
    A: LinearOperator<T>,
    B: LinearOperator<T>,
    S: Step<T, A, B>,
{
    /// The method on `problem` with the splitting of `step`.
    ///
    /// # Errors
    ///
    /// Those of [`Step::check`].
    pub fn new(problem: Hlcp<T, A, B>, step: S) -> Result<Self, Error> {
        problem.agree(step.check(&problem))?;
        Ok(Self { problem, step, sweeps: 0, scratch: Vec::new() })
    }
}

impl<T: Scalar, A, B, S> Mms<T, A, B, SplittingStep<S>>
where
    A: LinearOperator<T>,
    B: LinearOperator<T>,
    S: Splitting<T>,
{
    /// The method on `problem` with any splitting of `A + BΩ`, be it a closure.
    ///
    /// # Errors
    ///
    /// Where ranks share the problem, the first one's that was refused.
    ///
    /// ```
    /// use hlcp_methods::{Hlcp, Identity, Limits, Mms, Omega, Solver};
    ///
    /// let one = Identity { order: 1 };
    /// let problem = Hlcp::new(one, one, Omega::Uniform(1.0))?;
    /// let half = |rhs: &[f64], y: &mut [f64]| y[0] = rhs[0] / 2.0;
    /// let mut solver = Solver::new(Mms::with_splitting(problem, half)?);
    /// assert!(solver.solve(&[-3.0], Limits::default())?.converged() && solver.z() == [3.0]);
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn with_splitting(problem: Hlcp<T, A, B>, splitting: S) -> Result<Self, Error> {
        Self::new(problem, SplittingStep(splitting))
    }
}

impl<T: Scalar, A, B, S> Method<T> for Mms<T, A, B, S>
where
    A: LinearOperator<T>,
    B: LinearOperator<T>,
    S: Step<T, A, B>,
{
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, _: &mut Clock<'_>) -> Norms {
        self.sweeps += self.step.sweeps();
        self.step.step(&self.problem, q, x, y, &mut self.scratch)
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
