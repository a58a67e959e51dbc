//! The paper's methods as dense textbook iterations, and all solutions of a small problem.
//!
//! Slow and obvious: every matrix of the formulas is formed and every linear system is factorised.

use nalgebra::{DMatrix, DVector};

/// The AOR splitting `M = (D − β L)/α`, `N = M − A` of `A = D − L − U`, equation (4); with `U` for
/// `L` when `backward`.
fn aor_splitting(
    matrix: &DMatrix<f64>,
    [alpha, beta]: [f64; 2],
    backward: bool,
) -> [DMatrix<f64>; 2] {
    let d = DMatrix::from_diagonal(&matrix.diagonal());
    let l = &d - if backward { matrix.upper_triangle() } else { matrix.lower_triangle() };
    let m = (d - l * beta) / alpha;
    [m.clone(), m - matrix]
}

/// A dense HLCP in modulus form: matrices of order `n` and vectors of length `n`, which is not
/// checked.
///
/// ```
/// use hlcp_verify::oracle::Dense;
/// use nalgebra::{dmatrix, dvector};
///
/// let (a, b) = (dmatrix![4.0, -1.0; -1.0, 4.0], dmatrix![1.0, 0.0; 0.0, 1.0]);
/// let (q, omega) = (dvector![-4.0, 3.0], dvector![4.0, 4.0]);
/// let solutions = Dense { a, b, q, omega, gamma: 1.0 }.solutions();
/// assert_eq!(solutions, [(dvector![1.0, 0.0], dvector![0.0, 2.0])]);
/// ```
#[derive(Debug, Clone)]
pub struct Dense {
    /// The matrix `A`.
    pub a: DMatrix<f64>,
    /// The matrix `B`.
    pub b: DMatrix<f64>,
    /// The vector `q`.
    pub q: DVector<f64>,
    /// The diagonal of Ω.
    pub omega: DVector<f64>,
    /// The number γ.
    pub gamma: f64,
}

/// One iteration with its matrices spelled out,
///
/// ```text
/// linear·x⁺ + modulus·|x⁺| = from_x·x + from_modulus·|x| − constant .
/// ```
#[derive(Debug, Clone)]
pub struct Iteration {
    /// The factor of `x⁺`.
    pub linear: DMatrix<f64>,
    /// The factor of `|x⁺|`: zero, or strictly triangular on the side where `linear` is
    /// triangular.
    pub modulus: DMatrix<f64>,
    /// The factor of `x`.
    pub from_x: DMatrix<f64>,
    /// The factor of `|x|`.
    pub from_modulus: DMatrix<f64>,
    /// The vector `γ q`.
    pub constant: DVector<f64>,
}

impl Iteration {
    /// The next iterate: by factorisation where `modulus` is zero, else by substitution.
    ///
    /// # Panics
    ///
    /// When `linear` is singular.
    pub fn step(&self, x: &DVector<f64>) -> DVector<f64> {
        let rhs = &self.from_x * x + &self.from_modulus * x.abs() - &self.constant;
        let n = x.len();
        if self.modulus.amax() == 0.0 {
            return self.linear.clone().lu().solve(&rhs).expect("M is regular");
        }
        let lower = self.modulus.upper_triangle().amax() == 0.0;
        let mut next = DVector::zeros(n);
        for k in 0..n {
            let i = if lower { k } else { n - 1 - k };
            // What is not known yet is still zero.
            let known = self.linear.row(i) * &next + self.modulus.row(i) * next.abs();
            next[i] = (rhs[i] - known[0]) / self.linear[(i, i)];
        }
        next
    }

    /// The matrix `P = (⟨linear⟩ − |modulus|)⁻¹ (|from_x| + |from_modulus|)`.
    ///
    /// Where that inverse is non-negative, as it is for triangular matrices,
    /// `|x⁺ − y⁺| ≤ P |x − y|` for any two iterates; it is the paper's 𝒫 of (14).
    ///
    /// # Panics
    ///
    /// When the comparison matrix is singular.
    pub fn contraction(&self) -> DMatrix<f64> {
        let mut comparison = -self.linear.abs();
        comparison.set_diagonal(&self.linear.diagonal().abs());
        comparison -= self.modulus.abs();
        let right = self.from_x.abs() + self.from_modulus.abs();
        comparison.lu().solve(&right).expect("the comparison matrix is regular")
    }
}

impl Dense {
    /// Method 1 with AOR splittings `A = M_A − N_A` and `B = M_B − N_B` of parameters `[α, β]`,
    ///
    /// ```text
    /// (M_BΩ + M_A) x⁺ = (N_BΩ + N_A) x + (BΩ − A)|x| − γ q .
    /// ```
    ///
    /// Method 2 is two of these that take turns.
    ///
    /// ```
    /// use hlcp_verify::oracle::Dense;
    /// use nalgebra::{dmatrix, dvector};
    ///
    /// let (a, b) = (dmatrix![4.0, -1.0; -2.0, 8.0], dmatrix![1.0, 0.0; 0.0, 1.0]);
    /// let (q, omega) = (dvector![-12.0, 25.0], dvector![4.0, 8.0]);
    /// let maor = Dense { a, b, q, omega, gamma: 1.0 }.mms([2.0, 0.5], [1.0, 1.0], false);
    /// assert_eq!(maor.linear, dmatrix![2.0 + 4.0, 0.0; -0.5, 4.0 + 8.0]);
    /// assert_eq!(maor.from_x, dmatrix![-2.0, 1.0; 1.5, -4.0]);
    /// assert_eq!(maor.step(&dvector![0.0, 0.0]), dvector![2.0, -2.0]);
    /// ```
    pub fn mms(&self, of_a: [f64; 2], of_b: [f64; 2], backward: bool) -> Iteration {
        let omega = DMatrix::from_diagonal(&self.omega);
        let [m_a, n_a] = aor_splitting(&self.a, of_a, backward);
        let [m_b, n_b] = aor_splitting(&self.b, of_b, backward);
        Iteration {
            linear: m_b * &omega + m_a,
            modulus: DMatrix::zeros(self.q.len(), self.q.len()),
            from_x: n_b * &omega + n_a,
            from_modulus: &self.b * &omega - &self.a,
            constant: self.gamma * &self.q,
        }
    }

    /// AMMS,
    ///
    /// ```text
    /// (M_B₁Ω + M_A₁) x⁺ + (N_B₂Ω − N_A₂)|x⁺| = (N_B₁Ω + N_A₁) x + (M_B₂Ω − M_A₂)|x| − γ q ,
    /// ```
    ///
    /// with the splittings of [`mms`](Self::mms) first, and `M_A₂ = D_A − U_A`, `M_B₂ = D_B − U_B`
    /// second (`L` for `U` when `backward`).
    ///
    /// ```
    /// use hlcp_verify::oracle::Dense;
    /// use nalgebra::{dmatrix, dvector};
    ///
    /// let (a, b) = (dmatrix![4.0, 0.0; -1.0, 4.0], dmatrix![1.0, 0.0; 0.0, 1.0]);
    /// let (q, omega) = (dvector![-8.0, 2.0], dvector![4.0, 4.0]);
    /// // The second row meets |x₁⁺| = 1 where Method 1 would still meet |x₁| = 0.
    /// let amgs = Dense { a, b, q, omega, gamma: 1.0 }.amms([1.0; 2], [1.0; 2], false);
    /// assert_eq!(amgs.step(&dvector![0.0, 0.0]), dvector![1.0, 0.0]);
    /// ```
    pub fn amms(&self, of_a: [f64; 2], of_b: [f64; 2], backward: bool) -> Iteration {
        let omega = DMatrix::from_diagonal(&self.omega);
        let second = |matrix| aor_splitting(matrix, [1.0; 2], !backward);
        let [[m_a, n_a], [m_b, n_b]] = [second(&self.a), second(&self.b)];
        Iteration {
            modulus: n_b * &omega - n_a,
            from_modulus: m_b * &omega - m_a,
            ..self.mms(of_a, of_b, backward)
        }
    }

    /// All solutions `(z, r)`, found by trying every choice of `zᵢ = 0` or `rᵢ = 0`, in no order.
    ///
    /// A choice whose linear system is singular or overflows is passed over, so of a continuum only
    /// isolated ones are sure to be found; a solution with `zᵢ = rᵢ = 0` comes once for each
    /// choice.
    ///
    /// # Panics
    ///
    /// For orders above 12.
    ///
    /// ```
    /// use hlcp_verify::oracle::Dense;
    /// use nalgebra::{dmatrix, dvector};
    ///
    /// // Both matrices are H₊, and yet there are three solutions.
    /// let (a, b) = (dmatrix![1.0, -2.0; 0.0, 1.0], dmatrix![1.0, 0.0; -2.0, 1.0]);
    /// let (q, omega) = (dvector![1.0, -1.0], dvector![1.0, 1.0]);
    /// assert_eq!(Dense { a, b, q, omega, gamma: 1.0 }.solutions().len(), 3);
    /// ```
    pub fn solutions(&self) -> Vec<(DVector<f64>, DVector<f64>)> {
        let n = self.q.len();
        assert!(n <= 12, "2^{n} supports are too many");
        let scale = self.q.amax();
        let mut solutions = Vec::new();
        for support in 0_u32..1 << n {
            let in_z = |i: usize| support >> i & 1 == 1;
            let entry = |i, j| if in_z(j) { self.a[(i, j)] } else { -self.b[(i, j)] };
            let system = DMatrix::from_fn(n, n, entry);
            let Some(y) = system.full_piv_lu().solve(&-&self.q) else { continue };
            if y.iter().all(|&y| y.is_finite() && y >= -1e-12 * scale) {
                let part = |z: bool| {
                    DVector::from_fn(n, |i, _| if in_z(i) == z { y[i].max(0.0) } else { 0.0 })
                };
                solutions.push((part(true), part(false)));
            }
        }
        solutions
    }
}
