use std::{
    f64::consts::{PI, TAU},
    ops::Range,
};

use hlcp_core::{Error, Scalar, assert_lengths};

use super::{Columns, Grids, check, entries, operator, positive};

/// A journal bearing of finite length with mass-conserving cavitation: an HLCP in two dimensions.
///
/// Where the oil fills the gap it carries the pressure `p`; where it would have to pull, it breaks
/// up into streamers with the void fraction `r`. Both obey one Reynolds equation, in which the
/// turning journal carries `(1 − r) h`:
///
/// ```text
/// ∂ξ(H³ ∂ξz) + (D/L)² ∂η(H³ ∂ηz) = ∂ξ((1 − r) H) ,    H = 1 + ε cos ξ ,    z, r ≥ 0 ,    z r = 0 ,
/// ```
///
/// for `ξ` once around from a feed groove along the bearing, which delivers at the cavitation
/// pressure what is drawn from it (`z = 0`, and `r = 0` upstream of the first cell), and `η` from
/// −1 to 1 between the ends, where `z = 0`.
///
/// # The operators
///
/// Cells around `nx × ny` points, `hx = 2π/(nx + 1)` and `hy = 2/(ny + 1)` apart, `ξ` the fast
/// index. Through the face between points `i` and `i + 1` of a row flows, the void taken upwind,
///
/// ```text
/// hy [ (1 − rᵢ) Hᵢ₊½ − H³ᵢ₊½ (zᵢ₊₁ − zᵢ)/hx ] ,
/// ```
///
/// and the balance of each cell is its row of `A z − B r + q = 0`: `A` is a varying five-point
/// operator, `B` the upwind `bidiag(−Hᵢ₋½; Hᵢ₊½) hy`, `q = (Hᵢ₊½ − Hᵢ₋½) hy`. So what enters
/// leaves, to the residual, cell by cell.
///
/// # Theory
///
/// Both are M-matrices (`A` irreducibly dominant, `B` triangular), hence H₊, and
/// `A z − B r + q = 0` has exactly one solution for every `q`: a `v` that falls along `ξ` as
/// [`Slider`](crate::Slider)'s does has `⟨A⟩ᵀv, ⟨B⟩ᵀv > 0`, which is the sum witness of
/// [`certify`](crate::certify). Assumption (II) of the paper's theorems fails (at τ = 1 the entry
/// `|bᵢ₊₁,ᵢ|ωᵢ` is `aᵢᵢ`, which exceeds `|aᵢ₊₁,ᵢ|`), and so does the relaxed theorem: convergence
/// is observed, not proved.
///
/// # Units
///
/// Lengths across the film in clearances `c`, `z = 1` in `6μΩ(R/c)²` for a journal of radius
/// `R = D/2` turning at `Ω`, and a flow of 1 in `Ω R c L/4`.
///
/// # Source
///
/// The complementarity form of the Jakobsson–Floberg–Olsson conditions is that of M. Giacopini, M.
/// Fowell, D. Dini and A. Strozzi, *A mass-conserving complementarity formulation to study
/// lubricant films in the presence of cavitation*, J. Tribology 132 (2010) 041702. With the groove
/// at the widest gap no film re-forms and the pressure is that of A. Raimondi and J. Boyd, *A
/// solution for the finite journal bearing*, ASLE Trans. 1 (1958) 159–209, whose tables
/// [`sommerfeld`](Self::sommerfeld) can be held against.
///
/// ```
/// use hlcp_core::{Diagonal, LinearOperator};
/// use hlcp_verify::Bearing2d;
///
/// let (a, b, q) = Bearing2d { nx: 3, ny: 2, ecc: 0.5, aspect: 1.0, groove: 0.0 }.pose::<f64>()?;
/// assert_eq!((a.order(), b.order(), q.len()), (6, 6, 6));
/// let gap = |quarters: f64| 1.0 + 0.5 * (quarters * std::f64::consts::FRAC_PI_2).cos();
/// assert!((b.diagonal_entry(4) - gap(2.5) * 2.0 / 3.0).abs() < 1e-15);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bearing2d {
    /// Inner points around the journal.
    pub nx: usize,
    /// Inner points along it; the order is `nx·ny`.
    pub ny: usize,
    /// The eccentricity ε.
    pub ecc: f64,
    /// The length over the diameter, L/D.
    pub aspect: f64,
    /// Where the groove is, in radians in the direction of the journal's motion from the widest
    /// gap.
    pub groove: f64,
}

impl Columns for Bearing2d {
    type Posed<T: Scalar> = Grids<T>;

    fn pose_columns<T: Scalar>(&self, columns: Range<usize>) -> Result<Grids<T>, Error> {
        check("ecc", self.ecc, (0.0..1.0).contains(&self.ecc), "at least 0 and less than 1")?;
        positive("aspect", self.aspect)?;
        check("groove", self.groove, self.groove.is_finite(), "finite")?;
        let (ny, hy) = (self.ny, self.spacing()[1]);
        let a = operator(&columns, ny, |i, _| {
            let [west, east, along] = [self.around(i), self.around(i + 1), self.along(i)];
            [-along, -west, west + east + 2.0 * along, -east, -along]
        })?;
        let b = operator(&columns, ny, |i, _| {
            [0.0, -hy * self.face(i), hy * self.face(i + 1), 0.0, 0.0]
        })?;
        let wedge = |i, _| hy * (self.face(i + 1) - self.face(i));
        Ok((a, b, entries(&columns, ny, wedge)))
    }
}

impl Bearing2d {
    /// `A`, `B` and `q` in precision `T`.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] unless `0 ≤ ε < 1`, the aspect is positive and finite and the groove
    /// finite; [`Error::Grid`] for a grid without points; [`Error::NotFinite`] for an aspect whose
    /// square overflows or vanishes.
    pub fn pose<T: Scalar>(&self) -> Result<Grids<T>, Error> {
        self.pose_columns(0..self.nx)
    }

    fn spacing(&self) -> [f64; 2] {
        [TAU / (self.nx as f64 + 1.0), 2.0 / (self.ny as f64 + 1.0)]
    }

    /// The angle ξ of a place counted in points, the groove being at −1.
    fn angle(&self, i: f64) -> f64 {
        self.groove + (i + 1.0) * self.spacing()[0]
    }

    fn gap(&self, i: f64) -> f64 {
        1.0 + self.ecc * self.angle(i).cos()
    }

    /// The gap between the points `i − 1` and `i`.
    fn face(&self, i: usize) -> f64 {
        self.gap(i as f64 - 0.5)
    }

    /// Returns the conductance between the points `i − 1` and `i` of a row.
    fn around(&self, i: usize) -> f64 {
        let [hx, hy] = self.spacing();
        hy / hx * self.face(i).powi(3)
    }

    /// Returns the conductance between neighbours in column `i`.
    fn along(&self, i: usize) -> f64 {
        let [hx, hy] = self.spacing();
        hx / hy * self.gap(i as f64).powi(3) / (self.aspect * self.aspect)
    }

    /// The film's force on the journal for the pressure `z`, as ∫∫ over ξ and η: towards the widest
    /// gap along the line of centres, and across it in the direction of the motion at the widest
    /// gap.
    ///
    /// Times `6μΩ(R/c)²·RL/2` it is a force.
    ///
    /// # Panics
    ///
    /// Unless `z` has `nx·ny` entries.
    ///
    /// ```
    /// use hlcp_verify::Bearing2d;
    /// use std::f64::consts::FRAC_PI_2;
    ///
    /// // Points at ξ = π/2, π and 3π/2, with cells π/2 by 1. Pressure at the narrowest gap alone,
    /// // then at π/2 alone:
    /// let scene = Bearing2d { nx: 3, ny: 1, ecc: 0.5, aspect: 1.0, groove: 0.0 };
    /// let near = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x - u).hypot(y - v) < 1e-15;
    /// assert!(near(scene.load(&[0.0, 1.0, 0.0]), [FRAC_PI_2, 0.0]));
    /// assert!(near(scene.load(&[1.0, 0.0, 0.0]), [0.0, FRAC_PI_2]));
    /// ```
    pub fn load<T: Scalar>(&self, z: &[T]) -> [f64; 2] {
        assert_lengths(self.nx * self.ny, [("z", z.len())]);
        let [hx, hy] = self.spacing();
        let mut load = [0.0; 2];
        for (k, &z) in z.iter().enumerate() {
            let (sin, cos) = self.angle((k % self.nx) as f64).sin_cos();
            load[0] -= z.wide() * cos * hx * hy;
            load[1] += z.wide() * sin * hx * hy;
        }
        load
    }

    /// The Sommerfeld number `(R/c)² μN/P`, with N in turns a second and P the load over L D;
    /// infinite without a load.
    ///
    /// # Panics
    ///
    /// As [`load`](Self::load).
    ///
    /// ```
    /// use hlcp_verify::Bearing2d;
    ///
    /// let scene = Bearing2d { nx: 47, ny: 11, ecc: 0.6, aspect: 1.0, groove: 0.0 };
    /// let (a, b, q) = scene.pose::<f64>()?;
    /// let found = hlcp_methods::solve(&a, &b, &q)?;
    /// // Raimondi and Boyd's table has 0.121
    /// assert!((scene.sommerfeld(&found.z) / 0.121 - 1.0).abs() < 0.03);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn sommerfeld<T: Scalar>(&self, z: &[T]) -> f64 {
        let [along, across] = self.load(z);
        1.0 / (3.0 * PI * along.hypot(across))
    }

    /// The attitude angle, in degrees: between the load and the line of centres.
    ///
    /// # Panics
    ///
    /// As [`load`](Self::load).
    ///
    /// ```
    /// use hlcp_verify::Bearing2d;
    ///
    /// // The same pressure at π/2 and at the narrowest gap, π.
    /// let scene = Bearing2d { nx: 3, ny: 1, ecc: 0.5, aspect: 1.0, groove: 0.0 };
    /// assert!((scene.attitude(&[1.0, 1.0, 0.0]) - 45.0).abs() < 1e-13);
    /// ```
    pub fn attitude<T: Scalar>(&self, z: &[T]) -> f64 {
        let [along, across] = self.load(z);
        across.atan2(along).to_degrees()
    }

    /// Returns the flows out of the groove, back into it after a turn, and out at the two ends. The
    /// first is the sum of the others.
    ///
    /// Of the cells, which leave out a strip of width `hy/2` at each end: at the widest gap the
    /// groove feeds another `hy(1 + ε)` into those.
    ///
    /// # Panics
    ///
    /// Unless `z` and `r` have `nx·ny` entries.
    ///
    /// ```
    /// use hlcp_verify::Bearing2d;
    ///
    /// let scene = Bearing2d { nx: 15, ny: 5, ecc: 0.5, aspect: 1.0, groove: 0.0 };
    /// let (a, b, q) = scene.pose::<f64>()?;
    /// let found = hlcp_methods::solve(&a, &b, &q)?;
    /// let [drawn, returned, ends] = scene.flows(&found.z, &found.r);
    /// assert!(ends > 0.1 && (drawn - returned - ends).abs() <= 1e-9);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn flows<T: Scalar>(&self, z: &[T], r: &[T]) -> [f64; 3] {
        assert_lengths(self.nx * self.ny, [("z", z.len()), ("r", r.len())]);
        let ([nx, ny], hy) = ([self.nx, self.ny], self.spacing()[1]);
        let [mut drawn, mut returned, mut ends] = [0.0; 3];
        for j in 0..ny {
            let last = (j + 1) * nx - 1;
            drawn += hy * self.face(0) - self.around(0) * z[j * nx].wide();
            returned +=
                hy * (1.0 - r[last].wide()) * self.face(nx) + self.around(nx) * z[last].wide();
        }
        for i in 0..nx {
            ends += self.along(i) * (z[i].wide() + z[(ny - 1) * nx + i].wide());
        }
        [drawn, returned, ends]
    }
}
