use crate::{Error, Scalar};

/// Two norms of one vector, in double precision whatever the vector's own.
///
/// Both are NaN as soon as one entry is. Of a vector that a step measures as it goes, the 2-norm is
/// an upper bound, at most √n too large, where it is below 10⁻¹⁴⁰ ‖q‖ or above 10¹⁵⁰ ‖q‖.
///
/// ```
/// let norms = hlcp_core::Norms::of(&[1e-12, f64::NAN]);
/// // so that no `norms.linf <= tolerance` is true
/// assert!(norms.l2.is_nan() && norms.linf.is_nan());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Norms {
    /// The 2-norm.
    pub l2: f64,
    /// The largest absolute value.
    pub linf: f64,
}

impl Norms {
    /// The norms of a vector that is at hand.
    ///
    /// ```
    /// use hlcp_core::Norms;
    ///
    /// let norms = Norms::of(&[3e200, -4e200]);
    /// assert_eq!(norms.linf, 4e200);
    /// assert!((norms.l2 / 5e200 - 1.0).abs() < 1e-15);
    /// ```
    pub fn of<T: Scalar>(v: &[T]) -> Self {
        let largest = v.iter().fold(T::zero(), |max, &v| max.max(v.abs()));
        let mut meter = Meter::for_size(largest.wide(), v.len());
        v.iter().for_each(|&v| meter.add(v));
        meter.norms()
    }

    /// The norms of the vector divided by γ: those of `A z − B r + q` from those of
    /// `F(x) = γ(A z − B r + q)`.
    ///
    /// ```
    /// use hlcp_core::Norms;
    ///
    /// assert_eq!(Norms::of(&[3.0, -4.0]).divided_by(2.0), Norms { l2: 2.5, linf: 2.0 });
    /// ```
    pub fn divided_by<T: Scalar>(self, gamma: T) -> Self {
        let gamma = gamma.wide();
        Self { l2: self.l2 / gamma, linf: self.linf / gamma }
    }
}

/// Sums squares in units of a power of two, so that neither 1e±150 nor 1e±300 is lost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meter {
    unit: f64,
    inverse: f64,
    order: usize,
    squares: f64,
    largest: f64,
}

impl Meter {
    fn new(unit: f64, order: usize) -> Self {
        Self { unit, inverse: unit.recip(), order, squares: 0.0, largest: 0.0 }
    }

    /// A meter for vectors of `order` entries of at most about this size.
    pub(crate) fn for_size(size: f64, order: usize) -> Self {
        Self::new(power_of_two_near(size), order)
    }

    #[inline(always)]
    pub(crate) fn add<T: Scalar>(&mut self, v: T) {
        self.squares += self.square(v);
        // A NaN is dropped here and kept by the sum.
        self.largest = self.largest.max(v.wide().abs());
    }

    /// Adds the squares of a stretch, and compares its entries with the largest.
    #[inline(always)]
    pub(crate) fn add_to<T: Scalar>(&self, sum: &mut Tally<T>, v: &[T]) {
        let (chunks, rest) = v.as_chunks::<LANES>();
        for chunk in chunks {
            for (l, &v) in chunk.iter().enumerate() {
                sum.squares[l] += self.square(v);
                sum.largest[l] = larger(sum.largest[l], v.abs());
            }
        }
        for (l, &v) in rest.iter().enumerate() {
            sum.squares[l] += self.square(v);
            sum.largest[l] = larger(sum.largest[l], v.abs());
        }
    }

    /// The square in units of the meter.
    #[inline(always)]
    fn square<T: Scalar>(&self, v: T) -> f64 {
        let v = v.wide() * self.inverse;
        v * v
    }

    /// The norms of what was summed, divided by γ.
    pub(crate) fn norms_of<T: Scalar>(&self, sum: &Tally<T>, gamma: T) -> Norms {
        let squares: f64 = sum.squares.iter().sum();
        let largest = sum.largest.iter().copied().fold(T::zero(), larger);
        self.finish(squares, largest.wide()).divided_by(gamma)
    }

    pub(crate) fn norms(&self) -> Norms {
        self.finish(self.squares, self.largest)
    }

    /// The norms, from the sum of squares in units and the largest value.
    ///
    /// Where squares overflow or vanish, because a vector is 10¹⁵⁰ times as large or as small as
    /// the unit promised, the 2-norm is an upper bound.
    fn finish(&self, squares: f64, largest: f64) -> Norms {
        let vanishing = largest > 0.0 && squares < 1e-280;
        let l2 = if squares == f64::INFINITY || vanishing {
            largest * (self.order as f64).sqrt()
        } else {
            squares.sqrt() * self.unit
        };
        Norms { l2, linf: if squares.is_nan() { f64::NAN } else { largest } }
    }
}

/// The larger one; `max` unless `v` is NaN.
///
/// A NaN is dropped here and kept by the sum of squares.
#[inline(always)]
fn larger<T: Scalar>(max: T, v: T) -> T {
    if v > max { v } else { max }
}

/// Sums side by side; a fixed number, so that every processor adds in the same order.
const LANES: usize = 64;

/// Sums of squares in units of a [`Meter`], and the largest absolute values.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tally<T> {
    squares: [f64; LANES],
    largest: [T; LANES],
}

impl<T: Scalar> Tally<T> {
    pub(crate) fn zero() -> Self {
        Self { squares: [0.0; LANES], largest: [T::zero(); LANES] }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        for l in 0..LANES {
            self.squares[l] += other.squares[l];
            self.largest[l] = larger(self.largest[l], other.largest[l]);
        }
    }
}

/// A power of two within a factor of two of `v`, kept where it and its reciprocal are normal; 1
/// for 0.
fn power_of_two_near(v: f64) -> f64 {
    if v == 0.0 || !v.is_finite() { 1.0 } else { v.log2().floor().clamp(-1000.0, 1000.0).exp2() }
}

/// A vector `q` that was checked, with its norms.
///
/// The norms give stopping tests their scale and the sums of squares a unit that neither overflows
/// nor squares to zero.
///
/// ```
/// let q = hlcp_core::Rhs::new(&[3e-200, -4e-200])?;
/// assert_eq!(q.entries()[1], -4e-200);
/// assert!((q.norms().l2 / 5e-200 - 1.0).abs() < 1e-15); // though 9e-400 is no number
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Rhs<'q, T> {
    q: &'q [T],
    norms: Norms,
}

impl<'q, T: Scalar> Rhs<'q, T> {
    /// Checks `q` in one pass.
    ///
    /// # Errors
    ///
    /// [`Error::Empty`] for no entries, [`Error::NotFinite`] for the first entry that is NaN or
    /// infinite.
    ///
    /// ```
    /// let q = hlcp_core::Rhs::new(&[3.0_f32, -4.0])?;
    /// assert_eq!((q.norms().l2, q.norms().linf), (5.0, 4.0));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn new(q: &'q [T]) -> Result<Self, Error> {
        if q.is_empty() {
            return Err(Error::Empty { what: "q" });
        }
        all_finite("q", q)?;
        Ok(Self { q, norms: Norms::of(q) })
    }

    /// The entries.
    pub fn entries(&self) -> &'q [T] {
        self.q
    }

    /// Their norms.
    pub fn norms(&self) -> Norms {
        self.norms
    }

    /// Measures a vector that is expected to be of the size of `q`, and once more with a meter of
    /// its own size where its squares would overflow or vanish in the units of `q`.
    pub(crate) fn measured(&self, measure: impl Fn(Meter) -> Norms) -> Norms {
        let meter = self.meter(T::one());
        let norms = measure(meter);
        let ratio = norms.linf / meter.unit;
        if (1e-140..=1e150).contains(&ratio) || norms.linf == 0.0 || !norms.linf.is_finite() {
            return norms;
        }
        measure(Meter::for_size(norms.linf, self.q.len()))
    }

    /// A meter for vectors of the size of `γ q`.
    pub(crate) fn meter(&self, gamma: T) -> Meter {
        Meter::for_size(self.norms.linf * gamma.wide(), self.q.len())
    }
}

/// Refuses a vector with a NaN or infinite entry, naming the first.
///
/// # Errors
///
/// [`Error::NotFinite`] with `what`, the index and the value.
///
/// ```
/// use hlcp_core::all_finite;
///
/// assert_eq!(all_finite("x0", &[0.0, -1.5]), Ok(()));
/// let error = all_finite("x0", &[0.0, f64::INFINITY]).unwrap_err();
/// assert_eq!(error.to_string(), "x0[1] is inf, which is not a finite number");
/// ```
pub fn all_finite<T: Scalar>(what: &'static str, v: &[T]) -> Result<(), Error> {
    match v.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(Error::NotFinite { what, index, value: v[index].wide() }),
        None => Ok(()),
    }
}
