use std::ops::Range;

use hlcp_core::{Error, Scalar, assert_lengths};

use super::{Columns, Grids, check, entries, operator, positive};

/// Seepage through a rectangular dam of earth on an impervious base: an HLCP outside lubrication.
///
/// The dam stands between two reservoirs. Below the free boundary its pores are full of water, and
/// above it they are dry; neither is known where. With the pressure head `z` and the dry share `r`
/// of the pores, one balance holds in the whole dam: by Darcy's law water flows by
/// `−K (∇z + (1 − r) e)`, `e` upwards, and
///
/// ```text
/// −div(K ∇z) + ∂(K r)/∂y = ∂K/∂y ,    z, r ≥ 0 ,    z r = 0 .
/// ```
///
/// The upstream face has the pressure of the water before it, and so has the downstream face up to
/// the tailwater. Above that it has the pressure 0, and water seeps out where the dam behind it is
/// wet. Through the base and the crest nothing flows. The lower half may be another soil.
///
/// # The operators
///
/// `nx` columns of points, `hx = L/(nx + 1)` apart between the faces, and `ny` rows of cells of the
/// height `hy = 1/ny`, numbered from the crest down, as the water falls; along a row is the fast
/// index. The row of a cell is its balance. `A` has the conductances `K hy/hx` to the sides, and
/// `hx/hy` times the harmonic mean of `K` up and down. Gravity carries `K (1 − r) hx` out of a cell
/// through its floor, with the same mean, so that water at rest is at rest on the grid, and `B` is
/// `bidiag(−K hx of the ceiling; K hx of the floor)`.
///
/// Nothing passes the base. Its row of `B` has a diagonal entry all the same, and `q` none: there
/// `z > 0`, hence `r = 0`, so that no solution sees it. For if `z` were 0 in a cell of the base,
/// the cell's balance would be a sum of inflows that are not negative, all of them 0: `z` would be
/// 0 in the cells beside it too, and so on to the face, where water stands.
///
/// # Theory
///
/// Both are M-matrices, `A` symmetric and irreducibly dominant, `B` triangular.
///
/// The flows through the faces of a column add up to one number for all columns, the discharge. So
/// for two soils in layers the columns between the faces drop out of the sum of `z`, and
///
/// ```text
/// L · discharge = ∫₀¹ K (1 − y) dy − ∫₀ᵗ K (t − y) dy ,    t the tailwater,
/// ```
///
/// holds in the dam, and on every grid on whose faces `t` and the layers' boundary lie: the
/// discharge is then exact to the residual. For one soil it is Dupuit's `K (1 − t²)/2L`.
///
/// # Units
///
/// Lengths are in the depth of the water upstream, which is the dam's height, and conductivities in
/// that of the upper half; a discharge of 1 is their product, per width of the dam.
///
/// # Source
///
/// H. Brezis, D. Kinderlehrer and G. Stampacchia, *Sur une nouvelle formulation du problème de
/// l'écoulement à travers une digue*, C. R. Acad. Sci. Paris 287 (1978) 711–714, have the two
/// unknowns. The free boundary of a dam of one soil in quadratures is that of P.
/// Polubarinova-Kochina, *Theory of Ground Water Movement*, Princeton 1962, as evaluated by U.
/// Hornung and T. Krueger, Water Resources Research 21 (1985) 395–398.
///
/// ```
/// use hlcp_core::LinearOperator;
/// use hlcp_verify::Dam;
///
/// let dam = Dam { nx: 7, ny: 8, length: 1.0, tail: 0.5, layer: 1.0 };
/// let (a, b, q) = dam.pose::<f64>()?;
/// assert_eq!((a.order(), b.order(), q.len()), (56, 56, 56));
/// assert_eq!(dam.exact_discharge(), (1.0 - 0.25) / 2.0);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dam {
    /// Columns of points between the faces.
    pub nx: usize,
    /// Rows of cells from the crest to the base; the order is `nx·ny`.
    pub ny: usize,
    /// The length L of the base over the depth of the water upstream.
    pub length: f64,
    /// The depth of the tailwater over that of the water upstream.
    pub tail: f64,
    /// The conductivity of the lower half of the dam over that of the upper half.
    pub layer: f64,
}

impl Columns for Dam {
    type Posed<T: Scalar> = Grids<T>;

    fn pose_columns<T: Scalar>(&self, columns: Range<usize>) -> Result<Grids<T>, Error> {
        positive("length", self.length)?;
        positive("layer", self.layer)?;
        check("tail", self.tail, (0.0..=1.0).contains(&self.tail), "from 0 to 1")?;
        let (ny, [hx, hy]) = (self.ny, self.spacing());
        let a = operator(&columns, ny, |_, j| {
            let [up, side, down] = [self.through(j), self.side(j), self.through(j + 1)];
            [-up, -side, up + down + 2.0 * side, -side, -down]
        })?;
        // What a full cell and the one above it lose through their floors.
        let falls = |j: usize| match j + 1 == ny {
            true => hx * self.soil(j),
            false => hy * self.through(j + 1),
        };
        let from_above = |j: usize| if j == 0 { 0.0 } else { falls(j - 1) };
        let b = operator(&columns, ny, |_, j| [-from_above(j), 0.0, falls(j), 0.0, 0.0])?;
        let q = entries(&columns, ny, |i, j| {
            let out = if j + 1 == ny { 0.0 } else { falls(j) };
            let [upstream, downstream] = self.heads(j);
            let held = f64::from(i == 0) * upstream + f64::from(i + 1 == self.nx) * downstream;
            out - from_above(j) - self.side(j) * held
        });
        Ok((a, b, q))
    }
}

impl Dam {
    /// `A`, `B` and `q` in precision `T`.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] unless `length` and `layer` are positive and finite and
    /// `0 ≤ tail ≤ 1`; [`Error::Grid`] for a grid without points.
    pub fn pose<T: Scalar>(&self) -> Result<Grids<T>, Error> {
        self.pose_columns(0..self.nx)
    }

    fn spacing(&self) -> [f64; 2] {
        [self.length / (self.nx as f64 + 1.0), 1.0 / self.ny as f64]
    }

    /// The depth below the crest of the middle of row `j`.
    fn depth(&self, j: usize) -> f64 {
        (j as f64 + 0.5) * self.spacing()[1]
    }

    /// The conductivity of row `j`.
    fn soil(&self, j: usize) -> f64 {
        if self.depth(j) > 0.5 { self.layer } else { 1.0 }
    }

    /// The conductance to the sides in row `j`.
    fn side(&self, j: usize) -> f64 {
        let [hx, hy] = self.spacing();
        self.soil(j) * hy / hx
    }

    /// The conductance between the rows `j − 1` and `j`; nothing passes the crest and the base.
    fn through(&self, j: usize) -> f64 {
        if j == 0 || j == self.ny {
            return 0.0;
        }
        let [hx, hy] = self.spacing();
        hx / hy * 2.0 / (1.0 / self.soil(j - 1) + 1.0 / self.soil(j))
    }

    /// The pressure heads at the upstream and the downstream face in row `j`.
    fn heads(&self, j: usize) -> [f64; 2] {
        let depth = self.depth(j);
        [depth, (depth - (1.0 - self.tail)).max(0.0)]
    }

    /// The discharge: what enters through the upstream face for the pressure `z`.
    ///
    /// # Panics
    ///
    /// Unless `z` has `nx·ny` entries.
    ///
    /// ```
    /// use hlcp_verify::Dam;
    ///
    /// let dam = Dam { nx: 15, ny: 16, length: 1.0, tail: 0.25, layer: 4.0 };
    /// let (a, b, q) = dam.pose::<f64>()?;
    /// let answer = hlcp_methods::solve(&a, &b, &q)?;
    /// assert!((dam.discharge(&answer.z) - dam.exact_discharge()).abs() < 1e-8);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn discharge<T: Scalar>(&self, z: &[T]) -> f64 {
        assert_lengths(self.nx * self.ny, [("z", z.len())]);
        let first = z.iter().step_by(self.nx).enumerate();
        first.map(|(j, z)| self.side(j) * (self.heads(j)[0] - z.wide())).sum()
    }

    /// The discharge in closed form.
    pub fn exact_discharge(&self) -> f64 {
        // ∫₀ʰ K (h − y) dy, with what of it is in the upper half.
        let held = |h: f64| {
            let upper = (h - 0.5).max(0.0).powi(2) / 2.0;
            self.layer * (h * h / 2.0 - upper) + upper
        };
        (held(1.0) - held(self.tail)) / self.length
    }

    /// The height of the free boundary above the base in each column, for the dry share `r`: that
    /// of the water in it, with the moisture above. In the last column it is near where the free
    /// boundary meets the downstream face.
    ///
    /// # Panics
    ///
    /// Unless `r` has `nx·ny` entries.
    ///
    /// ```
    /// use hlcp_verify::Dam;
    ///
    /// let dam = Dam { nx: 2, ny: 4, length: 1.0, tail: 0.5, layer: 1.0 };
    /// assert_eq!(dam.heights(&[1.0, 1.0, 0.5, 1.0, 0.0, 0.0, 0.0, 0.0]), [0.625, 0.5]);
    /// ```
    pub fn heights<T: Scalar>(&self, r: &[T]) -> Vec<f64> {
        assert_lengths(self.nx * self.ny, [("r", r.len())]);
        let wet = |i: usize| r[i..].iter().step_by(self.nx).map(|r| 1.0 - r.wide()).sum::<f64>();
        (0..self.nx).map(|i| wet(i) * self.spacing()[1]).collect()
    }
}
