use std::{f64::consts::TAU, ops::Range};

use hlcp_core::{Error, FivePoint, Identity, Scalar, Varying, assert_lengths};

use super::{Columns, check, entries, operator, positive};

/// A, B and q.
type Film<T> = (FivePoint<Varying<T>>, Identity, Vec<T>);

/// The pressure in a journal bearing that cannot pull: the LCP of the optimisers' test sets.
///
/// With the gap `1 + ε cos ξ` and `w = (1 + ε cos ξ)³`, the pressure `z` on `(0, 2π) × (0, 2b)`,
/// zero on the boundary, minimises
///
/// ```text
/// ∫∫ ½ w |∇z|² − ε sin ξ · z    over z ≥ 0 .
/// ```
///
/// Linear elements on `nx × ny` inner points, `hx = 2π/(nx + 1)` and `hy = 2b/(ny + 1)` apart, give
/// `B = I`, `q = −ε hx hy sin ξ`, and a five-point `A` with the couplings
///
/// ```text
/// west, east    −(hy/hx)(wᵢ + wᵢ±₁)/2 ,       south, north    −(hx/hy)(wᵢ₋₁ + 4wᵢ + wᵢ₊₁)/6 ,
/// ```
///
/// whose sum the diagonal takes. `A` is an M-matrix, so the splitting methods converge from any
/// start for `α ≤ 1` and `τ ≥ 1`, in a number of iterations that grows like that of the points. `ξ`
/// is the fast index.
///
/// Without mass conservation: where the pressure would be negative it is cut off.
/// [`Bearing2d`](crate::Bearing2d) keeps the balance.
///
/// # Source
///
/// DPJB of B. Averick, R. Carter, J. Moré and G. Xue, *The MINPACK-2 Test Problem Collection*, as
/// PETSc's `src/tao/bound/tutorials/jbearing2.c` discretises it; for 8 × 12 points, ε = 0.1 and b =
/// 10 its recorded output (`output/jbearing2_1.out`) has the objective −0.183437.
///
/// ```
/// use hlcp_core::LinearOperator;
/// use hlcp_verify::JournalBearing;
///
/// let scene = JournalBearing { nx: 8, ny: 12, ecc: 0.1, b: 10.0 };
/// let (a, b, q) = scene.pose::<f64>()?;
/// assert_eq!((a.order(), b.order, q.len()), (96, 96, 96));
/// assert_eq!(scene.objective(&[0.0; 96]), 0.0);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JournalBearing {
    /// Inner points around the journal.
    pub nx: usize,
    /// Inner points along it; the order is `nx·ny`.
    pub ny: usize,
    /// The eccentricity ε.
    pub ecc: f64,
    /// Half the length `2b` of the bearing over its radius.
    pub b: f64,
}

impl Columns for JournalBearing {
    type Posed<T: Scalar> = Film<T>;

    fn pose_columns<T: Scalar>(&self, columns: Range<usize>) -> Result<Film<T>, Error> {
        check("ecc", self.ecc, (0.0..1.0).contains(&self.ecc), "at least 0 and less than 1")?;
        positive("b", self.b)?;
        let a = operator(&columns, self.ny, |i, _| {
            let [west, east, along] = [self.around(i), self.around(i + 1), self.along(i)];
            [-along, -west, west + east + 2.0 * along, -east, -along]
        })?;
        let q: Vec<T> = entries(&columns, self.ny, |i, _| -self.push(i));
        Ok((a, Identity { order: q.len() }, q))
    }
}

impl JournalBearing {
    /// `A`, `B` and `q` in precision `T`.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] unless `0 ≤ ε < 1` and `b` is positive and finite; [`Error::Grid`] for
    /// a grid without points.
    pub fn pose<T: Scalar>(&self) -> Result<Film<T>, Error> {
        self.pose_columns(0..self.nx)
    }

    fn spacing(&self) -> [f64; 2] {
        [TAU / (self.nx as f64 + 1.0), 2.0 * self.b / (self.ny as f64 + 1.0)]
    }

    /// `w` at the inner point `i − 1`; 0 stands for the boundary.
    fn w(&self, i: usize) -> f64 {
        (1.0 + self.ecc * (i as f64 * self.spacing()[0]).cos()).powi(3)
    }

    /// The coupling of the points `i − 1` and `i` of a row.
    fn around(&self, i: usize) -> f64 {
        let [hx, hy] = self.spacing();
        hy / hx * (self.w(i) + self.w(i + 1)) / 2.0
    }

    /// The coupling of neighbours in column `i`.
    fn along(&self, i: usize) -> f64 {
        let [hx, hy] = self.spacing();
        hx / hy * (self.w(i) + 4.0 * self.w(i + 1) + self.w(i + 2)) / 6.0
    }

    /// Returns the source in column `i`: ε hx hy sin ξ.
    fn push(&self, i: usize) -> f64 {
        let [hx, hy] = self.spacing();
        self.ecc * hx * hy * ((i + 1) as f64 * hx).sin()
    }

    /// `½ zᵀAz + qᵀz` in double precision, as a sum over the grid's edges: what the solution
    /// minimises.
    ///
    /// # Panics
    ///
    /// Unless `z` has `nx·ny` entries.
    ///
    /// ```
    /// use hlcp_verify::JournalBearing;
    ///
    /// let scene = JournalBearing { nx: 8, ny: 12, ecc: 0.1, b: 10.0 };
    /// let (a, b, q) = scene.pose::<f64>()?;
    /// let z = hlcp_methods::solve(&a, &b, &q)?.z;
    /// assert!((scene.objective(&z) + 0.183437).abs() < 1e-6); // PETSc's recorded output
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn objective<T: Scalar>(&self, z: &[T]) -> f64 {
        let [nx, ny] = [self.nx, self.ny];
        assert_lengths(nx * ny, [("z", z.len())]);
        // Zero on the boundary, which is where an index of 0 leads.
        let at = |i: usize, j: usize| {
            let inside = (1..=nx).contains(&i) && (1..=ny).contains(&j);
            if inside { z[(j - 1) * nx + i - 1].wide() } else { 0.0 }
        };
        let mut sum = 0.0;
        for j in 0..=ny {
            for i in 0..=nx {
                sum += 0.5 * self.around(i) * (at(i + 1, j) - at(i, j)).powi(2);
                if i > 0 {
                    sum += 0.5 * self.along(i - 1) * (at(i, j + 1) - at(i, j)).powi(2);
                    sum -= self.push(i - 1) * at(i, j);
                }
            }
        }
        sum
    }
}
