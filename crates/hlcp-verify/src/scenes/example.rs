use std::ops::Range;

use hlcp_core::{Error, FivePoint, LinearOperator, Scalar};

use super::Columns;

/// The paper's Examples 1 and 2: a pair of stencils on an `m × m` grid.
///
/// With `S` tridiagonal, Example 1 (symmetric) has
///
/// ```text
/// A = blktridiag(−I, S, −I) + μI,  B = I ⊗ S + νI,  S = tridiag(−1; 4; −1),
/// ```
///
/// and Example 2
///
/// ```text
/// A = blktridiag(−1.5I, S, −0.5I) + μI,  B = I ⊗ S + νI,  S = tridiag(−1.5; 4; −0.5).
/// ```
///
/// The planted solution is `z* = (0, 1, 0, 1, …)`, `r* = (1, 0, 1, 0, …)`, and `q = B r* − A z*`.
/// (The paper prints the opposite sign of `q`, for which the planted pair solves nothing, and does
/// not print `z*`.)
///
/// ```
/// use hlcp_core::LinearOperator;
/// use hlcp_verify::Example;
///
/// let scene = Example { symmetric: true, m: 4, mu: 4.0, nu: 4.0 }.pose::<f64>()?;
/// assert_eq!(scene.a.order(), 16);
/// assert_eq!(scene.q[0], 8.0 + 1.0); // r* = 1 at the corner, z* = 1 at its east neighbour
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Example {
    /// Example 1 if true, Example 2 if not.
    pub symmetric: bool,
    /// Grid points per side; the order is `m²`.
    pub m: usize,
    /// The multiple of the identity in `A`.
    pub mu: f64,
    /// The multiple of the identity in `B`.
    pub nu: f64,
}

/// A scene's operators in one precision, its `q`, and the solution it was built around.
///
/// ```
/// use hlcp_core::{Hlcp, Omega, Rhs};
/// use hlcp_verify::Example;
///
/// let scene = Example { symmetric: false, m: 4, mu: 4.0, nu: 0.0 }.pose::<f32>()?;
/// let problem = Hlcp::new(scene.a, scene.b, Omega::Uniform(2.0))?;
/// let residual = problem.residual(&Rhs::new(&scene.q)?, &scene.z, &scene.r, &mut vec![]);
/// assert_eq!(residual.linf, 0.0); // the numbers are halves, and their sums exact
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Posed<T, A, B> {
    /// The operator `A`.
    pub a: A,
    /// The operator `B`.
    pub b: B,
    /// The vector `q = B r* − A z*`.
    pub q: Vec<T>,
    /// The solution's `z*`.
    pub z: Vec<T>,
    /// The solution's `r*`.
    pub r: Vec<T>,
}

impl<T: Scalar> Posed<T, FivePoint<T>, FivePoint<T>> {
    /// Columns of the problem of constant operators on an `m × m` grid whose solution at point `k`
    /// is `z(k)` and `r(k)`.
    pub(crate) fn columns(
        m: usize,
        columns: Range<usize>,
        [a, b]: [[f64; 5]; 2],
        z: impl Fn(usize) -> T,
        r: impl Fn(usize) -> T,
    ) -> Result<Self, Error> {
        // With the columns beside them, which their products need.
        let wide = columns.start.saturating_sub(1)..m.min(columns.end + 1);
        let stencil = |nx, row: [f64; 5]| FivePoint::new(nx, m, row.map(T::of));
        let at = |k: usize| k / wide.len() * m + wide.start + k % wide.len();
        let points = 0..wide.len() * m;
        let (a_wide, b_wide) = (stencil(wide.len(), a)?, stencil(wide.len(), b)?);
        let z: Vec<T> = points.clone().map(|k| z(at(k))).collect();
        let r: Vec<T> = points.map(|k| r(at(k))).collect();
        let (mut q, mut az) = (vec![T::zero(); z.len()], vec![T::zero(); z.len()]);
        b_wide.apply(&r, &mut q);
        a_wide.apply(&z, &mut az);
        q.iter_mut().zip(az).for_each(|(q, az)| *q -= az);
        if wide == columns {
            return Ok(Self { a: a_wide, b: b_wide, q, z, r });
        }
        let own = |v: Vec<T>| {
            let rows = v.chunks(wide.len());
            let from = columns.start - wide.start;
            rows.flat_map(|row| &row[from..from + columns.len()]).copied().collect()
        };
        let [a, b] = [stencil(columns.len(), a)?, stencil(columns.len(), b)?];
        Ok(Self { a, b, q: own(q), z: own(z), r: own(r) })
    }
}

impl Columns for Example {
    type Posed<T: Scalar> = Posed<T, FivePoint<T>, FivePoint<T>>;

    fn pose_columns<T: Scalar>(&self, columns: Range<usize>) -> Result<Self::Posed<T>, Error> {
        self.planted(columns, |_| 1.0)
    }
}

impl Example {
    /// The example in precision `T`.
    ///
    /// # Errors
    ///
    /// [`Error`] for a grid without points, and for μ or ν that are not finite.
    pub fn pose<T: Scalar>(&self) -> Result<Posed<T, FivePoint<T>, FivePoint<T>>, Error> {
        self.planted(0..self.m, |_| 1.0)
    }

    /// The example with a generic solution of the same pattern: the entry `i` of `z*` or `r*` that
    /// is not zero is `½ + {(i + 1)φ}`, the fraction of a multiple of the golden section
    /// `φ = (√5 − 1)/2`.
    ///
    /// With zeros and ones everything is an integer, and residuals may vanish exactly; here they
    /// have a rounding floor.
    ///
    /// # Errors
    ///
    /// As [`pose`](Self::pose).
    ///
    /// ```
    /// use hlcp_verify::Example;
    ///
    /// let scene = Example { symmetric: true, m: 4, mu: 4.0, nu: 4.0 }.pose_generic::<f64>()?;
    /// assert_eq!((scene.z[0], scene.r[1]), (0.0, 0.0));
    /// assert!((scene.r[0] - 1.1180339887498949).abs() < 1e-15);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn pose_generic<T: Scalar>(&self) -> Result<Posed<T, FivePoint<T>, FivePoint<T>>, Error> {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        self.planted(0..self.m, |i| 0.5 + ((i + 1) as f64 * GOLDEN).fract())
    }

    /// The example whose solution has the entries `value` gives, in `z*` where the index is odd and
    /// in `r*` elsewhere.
    fn planted<T: Scalar>(
        &self,
        columns: Range<usize>,
        value: impl Fn(usize) -> f64,
    ) -> Result<Posed<T, FivePoint<T>, FivePoint<T>>, Error> {
        let [lower, upper] = if self.symmetric { [-1.0, -1.0] } else { [-1.5, -0.5] };
        let a = [lower, lower, 4.0 + self.mu, upper, upper];
        let b = [0.0, lower, 4.0 + self.nu, upper, 0.0];
        let entry = |odd, i| if (i % 2 == 1) == odd { T::of(value(i)) } else { T::zero() };
        Posed::columns(self.m, columns, [a, b], |i| entry(true, i), |i| entry(false, i))
    }
}
