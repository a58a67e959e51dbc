use std::ops::Range;

use hlcp_core::{Error, FivePoint, Scalar};

use super::{Columns, Posed};

/// A contact in a disc: hard for every splitting method, with a known answer.
///
/// On the `m × m` inner nodes `(jh, ih)`, `h = 1/(m + 1)`, of the unit square, with the disc's
/// `d = 0.16 − (x − ½)² − (y − ½)²`, the operator `A` is the five-point stencil
/// `(4; −1, −1, −1, −1)` and
///
/// ```text
/// z* = 20 max(0, d)² ,   LCP:   B = I ,                      r* = 10 h² max(0, −d) ,
///                        HLCP:  B = I ⊗ tridiag(−1; 4; −1) ,  r* = max(0, −d) .
/// ```
///
/// Unlike in the paper's examples, `z` and `r` are positive on two connected regions: columns of
/// `A` and of `B` do not alternate, and iterations grow like `m²`.
///
/// ```
/// use hlcp_verify::Disc;
///
/// let scene = Disc { lcp: false, m: 7 }.pose::<f64>()?;
/// let centre = 3 * 7 + 3;
/// assert_eq!((scene.z[centre], scene.r[centre]), (20.0 * 0.16 * 0.16, 0.0));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Disc {
    /// True if `B` is the identity.
    pub lcp: bool,
    /// Inner nodes per side; the order is `m²`.
    pub m: usize,
}

impl Columns for Disc {
    type Posed<T: Scalar> = Posed<T, FivePoint<T>, FivePoint<T>>;

    fn pose_columns<T: Scalar>(&self, columns: Range<usize>) -> Result<Self::Posed<T>, Error> {
        let a = [-1.0, -1.0, 4.0, -1.0, -1.0];
        let b = if self.lcp { [0.0, 0.0, 1.0, 0.0, 0.0] } else { [0.0, -1.0, 4.0, -1.0, 0.0] };
        let h = 1.0 / (self.m + 1) as f64;
        let disc = |k: usize| {
            let [x, y] = [k % self.m, k / self.m].map(|i| (i + 1) as f64 * h - 0.5);
            0.16 - x * x - y * y
        };
        let force = if self.lcp { 10.0 * h * h } else { 1.0 };
        let z = |k| T::of(20.0 * disc(k).max(0.0).powi(2));
        let r = |k| T::of(force * (-disc(k)).max(0.0));
        Posed::columns(self.m, columns, [a, b], z, r)
    }
}

impl Disc {
    /// The scene in precision `T`.
    ///
    /// # Errors
    ///
    /// [`Error`] for a grid without nodes.
    pub fn pose<T: Scalar>(&self) -> Result<Posed<T, FivePoint<T>, FivePoint<T>>, Error> {
        self.pose_columns(0..self.m)
    }
}
