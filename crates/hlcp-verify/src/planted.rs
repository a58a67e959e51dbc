use nalgebra::{DMatrix, DVector};

use crate::oracle::Dense;

/// A problem built around a solution, so that the answer exists before any solver runs.
///
/// The planting is by dense products, independent of the operators and of the recovery under test.
///
/// ```
/// use hlcp_verify::Planted;
/// use nalgebra::{dmatrix, dvector};
///
/// let (a, b) = (dmatrix![4.0, -1.0; -2.0, 4.0], dmatrix![3.0, 0.5; -1.0, 5.0]);
/// let planted = Planted::new(a, b, &[2.0, -3.0], dvector![0.7, 1.4], 2.0);
/// assert_eq!((planted.z[0], planted.z[1]), (2.0, 0.0));
/// assert_eq!((planted.r[0], planted.r[1]), (0.0, 3.0));
/// assert_eq!(planted.dense.q, dvector![0.5 * 3.0 - 4.0 * 2.0, 5.0 * 3.0 + 2.0 * 2.0]);
/// ```
#[derive(Debug, Clone)]
pub struct Planted {
    /// The problem, with `q = B r − A z`.
    pub dense: Dense,
    /// The planted `z`.
    pub z: DVector<f64>,
    /// The planted `r`.
    pub r: DVector<f64>,
}

impl Planted {
    /// Plants the solution whose `zᵢ` is the positive part of `signed[i]` and whose `rᵢ` is the
    /// negative one.
    pub fn new(
        a: DMatrix<f64>,
        b: DMatrix<f64>,
        signed: &[f64],
        omega: DVector<f64>,
        gamma: f64,
    ) -> Self {
        let z = DVector::from_iterator(signed.len(), signed.iter().map(|s| s.max(0.0)));
        let r = DVector::from_iterator(signed.len(), signed.iter().map(|s| (-s).max(0.0)));
        let q = &b * &r - &a * &z;
        Self { dense: Dense { a, b, q, omega, gamma }, z, r }
    }

    /// The modulus variable `x = (γ/2)(z − Ω⁻¹ r)` of the planted solution.
    pub fn x(&self) -> DVector<f64> {
        (&self.z - self.r.component_div(&self.dense.omega)) * (self.dense.gamma / 2.0)
    }
}
