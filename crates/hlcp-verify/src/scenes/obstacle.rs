use std::ops::Range;

use hlcp_core::{Error, FivePoint, Identity, Norms, Scalar, assert_lengths};

use super::{Columns, Stencil, check, entries};

/// A membrane over a dome, with a radial exact solution: PETSc's obstacle problem.
///
/// On the square `[−2, 2]²` the membrane `u ≥ ψ` is harmonic where it is above the dome
///
/// ```text
/// ψ = √(1 − s) for s ≤ 0.9 ,    √0.19 − (0.9/√0.19)(s − 0.9) beyond ,    s = x² + y² ,
/// ```
///
/// and takes the exact solution's values on the boundary. On `m × m` nodes, the boundary's
/// included, with the unscaled five-point stencil `(4; −1, −1, −1, −1)` at the inner ones,
/// `u = ψ + z` makes it an LCP: `B = I`, `q = Aψ` less the boundary's values. `r` is the force of
/// the dome on the membrane, times the spacing squared.
///
/// `A` is an irreducibly dominant M-matrix: the splitting methods converge from any start for
/// `α ≤ 1` and `τ ≥ 1`, in a number of iterations that grows like `m²`.
///
/// # Source
///
/// `src/snes/tutorials/ex9.c` of PETSc, contributed by E. Bueler; the skirt begins at `s = 0.9`
/// there, where `√s = 0.9` was meant, and so it does here. Its recorded output for 9 × 9 nodes
/// (`output/ex9_1.out`) has the mean error 3.076e-03 and the largest error 1.334e-02; for 17 × 17
/// nodes it prints 2.707e-03 and 1.428e-02.
///
/// ```
/// use hlcp_core::LinearOperator;
/// use hlcp_verify::Obstacle;
///
/// let scene = Obstacle { m: 9 };
/// let (a, b, q) = scene.pose::<f64>()?;
/// assert_eq!((a.order(), b.order, q.len()), (49, 49, 49));
/// assert_eq!(Obstacle::dome(0.6, 0.0), 0.8);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Obstacle {
    /// Nodes a side, the boundary's included; the order is `(m − 2)²`.
    pub m: usize,
}

impl Columns for Obstacle {
    type Posed<T: Scalar> = Stencil<T>;

    fn pose_columns<T: Scalar>(&self, columns: Range<usize>) -> Result<Stencil<T>, Error> {
        check("m", self.m as f64, self.m >= 3, "at least 3 nodes a side")?;
        let inner = self.m - 2;
        let a = FivePoint::new(columns.len(), inner, [-1.0, -1.0, 4.0, -1.0, -1.0].map(T::of))?;
        let q: Vec<T> = entries(&columns, inner, |i, j| {
            let [i, j] = [i + 1, j + 1];
            let around = [[i, j - 1], [i - 1, j], [i + 1, j], [i, j + 1]];
            let known = |[i, j]: [usize; 2]| {
                let [x, y] = self.node(i, j);
                let boundary = [0, self.m - 1];
                if boundary.contains(&i) || boundary.contains(&j) {
                    Self::exact(x, y)
                } else {
                    Self::dome(x, y)
                }
            };
            4.0 * known([i, j]) - around.map(known).iter().sum::<f64>()
        });
        Ok((a, Identity { order: q.len() }, q))
    }
}

impl Obstacle {
    /// The radius of the disc in which the exact solution rests on the dome.
    pub const CONTACT: f64 = 0.697965148223374;

    /// The dome ψ at `(x, y)`.
    pub fn dome(x: f64, y: f64) -> f64 {
        let (s, foot) = (x * x + y * y, f64::sqrt(0.19));
        if s <= 0.9 { (1.0 - s).sqrt() } else { foot - 0.9 / foot * (s - 0.9) }
    }

    /// The exact solution u at `(x, y)`: the dome within [`CONTACT`](Self::CONTACT), `−A ln √s + B`
    /// beyond.
    pub fn exact(x: f64, y: f64) -> f64 {
        let radius = x.hypot(y);
        if radius <= Self::CONTACT {
            Self::dome(x, y)
        } else {
            0.471519893402112 - 0.680259411891719 * radius.ln()
        }
    }

    /// `A`, `B` and `q` in precision `T`.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for fewer than three nodes per side, which leave no inner one.
    pub fn pose<T: Scalar>(&self) -> Result<Stencil<T>, Error> {
        self.pose_columns(0..self.m.saturating_sub(2))
    }

    /// The coordinates of a node.
    fn node(&self, i: usize, j: usize) -> [f64; 2] {
        [i, j].map(|i| 4.0 * i as f64 / (self.m - 1) as f64 - 2.0)
    }

    /// The mean over all `m²` nodes, and the largest, of |u − exact u| for the membrane
    /// `u = ψ + z`.
    ///
    /// # Panics
    ///
    /// Unless `z` has `(m − 2)²` entries.
    ///
    /// ```
    /// let scene = hlcp_verify::Obstacle { m: 9 };
    /// let (a, b, q) = scene.pose::<f64>()?;
    /// let [mean, largest] = scene.errors(&hlcp_methods::solve(&a, &b, &q)?.z);
    /// // PETSc's recorded output
    /// assert!((mean - 3.076e-3).abs() < 5e-7 && (largest - 1.334e-2).abs() < 5e-6);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn errors<T: Scalar>(&self, z: &[T]) -> [f64; 2] {
        let inner = self.m - 2;
        assert_lengths(inner * inner, [("z", z.len())]);
        let error = |(k, &z): (usize, &T)| {
            let [x, y] = self.node(k % inner + 1, k / inner + 1);
            (Self::dome(x, y) + z.wide() - Self::exact(x, y)).abs()
        };
        let errors: Vec<f64> = z.iter().enumerate().map(error).collect();
        [errors.iter().sum::<f64>() / (self.m * self.m) as f64, Norms::of(&errors).linf]
    }
}
