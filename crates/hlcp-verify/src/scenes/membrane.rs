use std::{f64::consts::TAU, ops::Range};

use hlcp_core::{Error, FivePoint, Identity, Scalar, assert_lengths};

use super::{Columns, Stencil, check, entries};

/// A membrane on an obstacle of a complicated shape, on which other solvers have published counts.
///
/// Fixed at the height 0 around a square, it lies above or below the obstacle; `z` is the distance,
/// `r` the force of the obstacle times the spacing squared. With the unscaled five-point stencil
/// `(4; −1, −1, −1, −1)` at `m × m` inner nodes it is an LCP: `B = I`, and `A` is an irreducibly
/// dominant M-matrix.
///
/// The spiral, on `(−1, 1)²` without a load: `u = ψ + z` lies above
///
/// ```text
/// ψ = sin(2π/ρ + π/2 − θ) + ρ(ρ + 1)/(ρ − 2) − 3ρ + 3.6 ,    q = Aψ ,
/// ```
///
/// whose coils become ever narrower towards the middle, and so does the contact. At the centre ψ is
/// 3.6, where it has no limit.
///
/// The other, on `(0, 1)²`: `−Δu = 100` presses `u = φ − z` against the obstacle above it,
///
/// ```text
/// φ = (J₀(20x) + 1)(J₀(20y) + 1) ,    q = 100 h² − Aφ ,
/// ```
///
/// where J₀ is Bessel's function, in many places at once.
///
/// # Source
///
/// The spiral is that of section 7.1.1 of C. Gräser and R. Kornhuber, *Multigrid methods for
/// obstacle problems*, J. Comput. Math. 27 (2009) 1–44; E. Bueler and P. Farrell, *A full
/// approximation scheme multilevel method for nonlinear variational inequalities*, SIAM J. Sci.
/// Comput. 46 (2024), solve it too. The other is that of section 7.2 of I. Papadopoulos,
/// *Hierarchical proximal Galerkin*, arXiv:2412.13733.
///
/// ```
/// use hlcp_verify::Membrane;
///
/// let (a, b, q) = Membrane { spiral: true, m: 3 }.pose::<f64>()?;
/// let answer = hlcp_methods::solve(&a, &b, &q)?;
/// assert!(answer.z[4] == 0.0 && answer.r[4] > 0.0); // the centre is the highest node
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Membrane {
    /// The spiral; or else Bessel's function.
    pub spiral: bool,
    /// Inner nodes a side; the order is `m²`.
    pub m: usize,
}

impl Columns for Membrane {
    type Posed<T: Scalar> = Stencil<T>;

    fn pose_columns<T: Scalar>(&self, columns: Range<usize>) -> Result<Stencil<T>, Error> {
        check("m", self.m as f64, self.m >= 1, "at least 1 node a side")?;
        let m = self.m;
        let a = FivePoint::new(columns.len(), m, [-1.0, -1.0, 4.0, -1.0, -1.0].map(T::of))?;
        let h = self.spacing();
        let [sign, load] = if self.spiral { [1.0, 0.0] } else { [-1.0, 100.0 * h * h] };
        let height = self.heights();
        // Around the square the membrane is at 0.
        let inside = |i: usize, j: usize| {
            if (1..=m).contains(&i) && (1..=m).contains(&j) { height(i, j) } else { 0.0 }
        };
        let q: Vec<T> = entries(&columns, m, |i, j| {
            let [i, j] = [i + 1, j + 1];
            let around = inside(i, j - 1) + inside(i - 1, j) + inside(i + 1, j) + inside(i, j + 1);
            load + sign * (4.0 * height(i, j) - around)
        });
        Ok((a, Identity { order: q.len() }, q))
    }
}

impl Membrane {
    /// `A`, `B` and `q` in precision `T`.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for a grid without nodes.
    pub fn pose<T: Scalar>(&self) -> Result<Stencil<T>, Error> {
        self.pose_columns(0..self.m)
    }

    fn spacing(&self) -> f64 {
        (if self.spiral { 2.0 } else { 1.0 }) / (self.m as f64 + 1.0)
    }

    /// Returns the height of the obstacle at a node; those from 1 to `m` are inner ones.
    fn heights(&self) -> impl Fn(usize, usize) -> f64 {
        let (h, spiral) = (self.spacing(), self.spiral);
        let factors: Vec<f64> = if spiral {
            vec![]
        } else {
            (0..self.m + 2).map(|i| libm::j0(20.0 * i as f64 * h) + 1.0).collect()
        };
        move |i, j| {
            if spiral {
                Self::spiral(i as f64 * h - 1.0, j as f64 * h - 1.0)
            } else {
                factors[i] * factors[j]
            }
        }
    }

    /// The height ψ of the spiral at `(x, y)`.
    fn spiral(x: f64, y: f64) -> f64 {
        let (rho, theta) = (x.hypot(y), y.atan2(x));
        if rho < 1e-8 {
            return 3.6;
        }
        let coil = (TAU / rho + TAU / 4.0 - theta).sin();
        coil + rho * (rho + 1.0) / (rho - 2.0) - 3.0 * rho + 3.6
    }

    /// The height of the membrane at the inner nodes for the distance `z`.
    ///
    /// # Panics
    ///
    /// Unless `z` has `m²` entries.
    ///
    /// ```
    /// use hlcp_verify::Membrane;
    ///
    /// let scene = Membrane { spiral: true, m: 1 };
    /// assert_eq!(scene.membrane(&[0.5]), [4.1]);
    /// ```
    pub fn membrane<T: Scalar>(&self, z: &[T]) -> Vec<f64> {
        assert_lengths(self.m * self.m, [("z", z.len())]);
        let (height, sign) = (self.heights(), if self.spiral { 1.0 } else { -1.0 });
        let at = |(k, z): (usize, &T)| height(k % self.m + 1, k / self.m + 1) + sign * z.wide();
        z.iter().enumerate().map(at).collect()
    }
}
