use hlcp_core::{Error, Norms, Rows, Scalar, Tridiagonal, assert_lengths};

/// The paper's Example 3 in kind: the convergent–divergent slider of the lubrication literature.
///
/// Between a fixed parabolic pad `h(x) = h_min + (h_max − h_min)(2x/L − 1)²` and a plane moving at
/// speed `U`, an incompressible lubricant of viscosity `μ` carries the pressure `p` where it fills
/// the gap and breaks up, with void fraction `r`, where it would have to pull. The Reynolds
/// equation with mass-conserving cavitation is
///
/// ```text
/// d/dx [ h³/(6μU) dp/dx ] = d/dx [ (1 − r) h ] ,   p, r ≥ 0 ,   p r = 0 ,   p = 0 at both ends.
/// ```
///
/// The paper names its mesh and data only by reference, so this is not claimed to be its problem
/// number by number.
///
/// # Units
///
/// The problem is posed in `X = x/L`, `H = h/h_min` and
/// `z = p/`[`PRESSURE_UNIT`](Self::PRESSURE_UNIT), where it reads `(H³ z')' = ((1 − r) H)'`. On a
/// grid of `N` cells of width `ΔX = 1/N`, with `c = H³/ΔX²` at the half nodes and the flux taken
/// upwind,
///
/// ```text
/// A = tridiag(−cᵢ₋½; cᵢ₋½ + cᵢ₊½; −cᵢ₊½) ,  B = bidiag(−Hᵢ₋₁; Hᵢ)/ΔX ,  qᵢ = (Hᵢ − Hᵢ₋₁)/ΔX .
/// ```
///
/// Both are M-matrices; assumption (II) of the paper's Theorem 1 fails. Constants, and what is read
/// off a solution, are in metres, pascals and seconds.
///
/// # The answer
///
/// Where the film is full the flux is constant, and equal to `H` at the rupture point `X_c`, where
/// `z = z' = 0`. So `H³ z' = H − H(X_c)` with `z(0) = z(X_c) = 0` fixes `X_c`, the peak lies at
/// `1 − X_c`, and both are known to quadrature: [`RUPTURE`](Self::RUPTURE), [`PEAK`](Self::PEAK).
///
/// ```
/// use hlcp_core::{Diagonal, LinearOperator};
/// use hlcp_verify::Slider;
///
/// let (a, b, q) = Slider { cells: 4 }.pose::<f64>()?;
/// assert_eq!((a.order(), b.order(), q.len()), (3, 3, 3));
/// assert_eq!(b.diagonal_entry(1), 4.0); // H = 1 in the middle
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slider {
    /// Cells `N` of the grid; the order is `N − 1`.
    pub cells: usize,
}

impl Slider {
    /// The length L of the pad, in m.
    pub const LENGTH: f64 = 76.2e-3;
    /// The smallest gap, in the middle of the pad, in m.
    pub const H_MIN: f64 = 25.4e-6;
    /// The gap at both ends, in m.
    pub const H_MAX: f64 = 50.8e-6;
    /// The speed U, in m/s.
    pub const SPEED: f64 = 4.57;
    /// The viscosity μ, in Pa·s.
    pub const VISCOSITY: f64 = 0.039;
    /// The pressure of `z = 1`: 6μUL/h_min², in Pa.
    pub const PRESSURE_UNIT: f64 =
        6.0 * Self::VISCOSITY * Self::SPEED * Self::LENGTH / (Self::H_MIN * Self::H_MIN);
    /// The peak pressure of the continuous problem, in Pa.
    pub const PEAK: f64 = 0.0284374736235 * Self::PRESSURE_UNIT;
    /// Where the film of the continuous problem ruptures, in m from the inlet.
    pub const RUPTURE: f64 = 0.678934433068565 * Self::LENGTH;

    /// `A`, `B` and `q` in precision `T`.
    ///
    /// The operators store the number of cells alone and compute their entries, in double
    /// precision, from the profile.
    ///
    /// # Errors
    ///
    /// [`Error::Empty`] for fewer than two cells, which leave no interior node.
    pub fn pose<T: Scalar>(
        &self,
    ) -> Result<(impl Rows<T> + Copy + use<T>, impl Rows<T> + Copy + use<T>, Vec<T>), Error> {
        let slider = *self;
        let order = self.cells.saturating_sub(1);
        let cells = self.cells as f64;
        let a = Tridiagonal::new(order, move |i| {
            let conductance = |node: f64| slider.gap(node).powi(3) * (cells * cells);
            let [west, east] = [i as f64 + 0.5, i as f64 + 1.5].map(conductance);
            [-west, west + east, -east].map(T::of)
        })?;
        let b = Tridiagonal::new(order, move |i| {
            let [before, here] = [i as f64, i as f64 + 1.0].map(|node| slider.gap(node) * cells);
            [-before, here, 0.0].map(T::of)
        })?;
        let wedge = |i| (slider.gap(i as f64 + 1.0) - slider.gap(i as f64)) * cells;
        Ok((a, b, (0..order).map(|i| T::of(wedge(i))).collect()))
    }

    /// `H` at a node, counted from the inlet at 0 to the outlet at `N`.
    fn gap(&self, node: f64) -> f64 {
        let s = 2.0 * node / self.cells as f64 - 1.0;
        1.0 + (Self::H_MAX / Self::H_MIN - 1.0) * (s * s)
    }

    /// The largest pressure of a solution `z` of `N − 1` entries, in Pa; NaN where an entry is.
    ///
    /// # Panics
    ///
    /// When `z` has another length.
    ///
    /// ```
    /// use hlcp_verify::Slider;
    ///
    /// let scene = Slider { cells: 500 };
    /// let (a, b, q) = scene.pose::<f64>()?;
    /// let z = hlcp_methods::solve(&a, &b, &q)?.z;
    /// assert!((scene.peak(&z) / Slider::PEAK - 1.0).abs() < 0.01);
    /// assert!((scene.rupture(&z) / Slider::RUPTURE - 1.0).abs() < 0.01);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn peak<T: Scalar>(&self, z: &[T]) -> f64 {
        // No vector fits no cells.
        assert_lengths(self.cells.wrapping_sub(1), [("z", z.len())]);
        Norms::of(z).linf * Self::PRESSURE_UNIT
    }

    /// Where the film of a solution `z` of `N − 1` entries ruptures, in m from the inlet: the last
    /// node with a pressure, and the inlet without one; NaN where an entry is.
    ///
    /// # Panics
    ///
    /// When `z` has another length.
    ///
    /// ```
    /// use hlcp_verify::Slider;
    ///
    /// // A pressure at the first two of the three inner nodes: full up to the middle.
    /// assert_eq!(Slider { cells: 4 }.rupture(&[0.01, 0.02, 0.0]), 0.5 * Slider::LENGTH);
    /// ```
    pub fn rupture<T: Scalar>(&self, z: &[T]) -> f64 {
        // No vector fits no cells.
        assert_lengths(self.cells.wrapping_sub(1), [("z", z.len())]);
        if z.iter().any(|z| z.is_nan()) {
            return f64::NAN;
        }
        let nodes = z.iter().rposition(|&z| z > T::zero()).map_or(0, |i| i + 1);
        nodes as f64 / self.cells as f64 * Self::LENGTH
    }
}
