use std::ops::Range;

use pulp::Arch;

use super::{Error, Scalar, scalar::vectorised};

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
    /// Returns the norms of a vector that is at hand.
    ///
    /// ```
    /// use hlcp_core::Norms;
    ///
    /// let norms = Norms::of(&[3e200, -4e200]);
    /// assert_eq!(norms.linf, 4e200);
    /// assert!((norms.l2 / 5e200 - 1.0).abs() < 1e-15);
    /// ```
    pub fn of<T: Scalar>(v: &[T]) -> Self {
        Meter::measured(1.0, v.len(), |meter| {
            let mut tallies = Tallies::new(Stretches::of([v.len(), 1]));
            vectorised(
                Arch::new(),
                #[inline(always)]
                || tallies.add(meter, 0, v),
            );
            let mut sum = Part::default();
            tallies.take(0..v.len()).for_each(|(_, part)| sum.add(part));
            meter.norms_of(sum, T::one())
        })
    }

    /// Returns the norms of the vector divided by γ: those of `A z − B r + q` from those of
    /// `F(x) = γ(A z − B r + q)`.
    #[doc(hidden)]
    pub fn divided_by<T: Scalar>(self, gamma: T) -> Self {
        let gamma = gamma.wide();
        Self { l2: self.l2 / gamma, linf: self.linf / gamma }
    }
}

/// Squares numbers in units of a power of two, so that neither 1e±150 nor 1e±300 is lost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meter {
    unit: f64,
    inverse: f64,
    order: usize,
}

impl Meter {
    /// Returns a meter for vectors of `order` entries of at most about this size.
    pub(crate) fn for_size(size: f64, order: usize) -> Self {
        let unit = power_of_two_near(size);
        Self { unit, inverse: unit.recip(), order }
    }

    /// Measures a vector that is expected to be of this size, and once more with a meter of its own
    /// size where its squares would overflow or vanish in the units of the first.
    pub(crate) fn measured(size: f64, order: usize, measure: impl Fn(Self) -> Norms) -> Norms {
        let meter = Self::for_size(size, order);
        let norms = measure(meter);
        let ratio = norms.linf / meter.unit;
        if (1e-140..=1e150).contains(&ratio) || norms.linf == 0.0 || !norms.linf.is_finite() {
            return norms;
        }
        measure(Self::for_size(norms.linf, order))
    }

    /// Returns the square in units of the meter.
    #[inline(always)]
    fn square<T: Scalar>(&self, v: T) -> f64 {
        let v = v.wide() * self.inverse;
        v * v
    }

    /// Returns the norms of what was summed, divided by γ.
    ///
    /// Where squares overflow or vanish, because a vector is 10¹⁵⁰ times as large or as small as
    /// the unit promised, the 2-norm is an upper bound.
    pub(crate) fn norms_of<T: Scalar>(&self, sum: Part, gamma: T) -> Norms {
        let Part { sum: squares, largest } = sum;
        let vanishing = largest > 0.0 && squares < 1e-280;
        let l2 = if squares == f64::INFINITY || vanishing {
            largest * (self.order as f64).sqrt()
        } else {
            squares.sqrt() * self.unit
        };
        Norms { l2, linf: if squares.is_nan() { f64::NAN } else { largest } }.divided_by(gamma)
    }
}

/// Returns the larger one; `max` unless `v` is NaN.
///
/// A NaN is dropped here and kept by the sum of squares.
#[inline(always)]
fn larger<T: Scalar>(max: T, v: T) -> T {
    if v > max { v } else { max }
}

/// A sum, of squares in units of a [`Meter`] or of products, and the largest absolute value.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Part {
    pub(crate) sum: f64,
    pub(crate) largest: f64,
}

impl Part {
    /// Adds one value, in the order of a walk.
    #[inline(always)]
    pub(crate) fn see<T: Scalar>(&mut self, meter: Meter, v: T) {
        self.sum += meter.square(v);
        self.largest = self.largest.max(v.wide().abs());
    }

    pub(crate) fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.largest = larger(self.largest, other.largest);
    }
}

/// Sums side by side while a block is added, and those that are kept; fixed numbers, so that every
/// processor adds in the same order.
const LANES: usize = 32;
const KEPT: usize = 8;

/// The sum over some blocks of a row, or of several rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tally<T> {
    sums: [f64; KEPT],
    largest: [T; KEPT],
}

impl<T: Scalar> Tally<T> {
    pub(crate) fn zero() -> Self {
        Self { sums: [0.0; KEPT], largest: [T::zero(); KEPT] }
    }

    /// Adds the squares of a block, and compares its entries with the largest.
    pub(crate) fn add(&mut self, meter: Meter, block: &[T]) {
        vectorised(
            Arch::new(),
            #[inline(always)]
            || self.add_here(meter, block),
        );
    }

    #[inline(always)]
    fn add_here(&mut self, meter: Meter, block: &[T]) {
        let (mut sums, mut largest) = ([0.0; LANES], [T::zero(); LANES]);
        let (chunks, rest) = block.as_chunks::<LANES>();
        for chunk in chunks {
            for l in 0..LANES {
                sums[l] += meter.square(chunk[l]);
                largest[l] = larger(largest[l], chunk[l].abs());
            }
        }
        for (l, &v) in rest.iter().enumerate() {
            sums[l] += meter.square(v);
            largest[l] = larger(largest[l], v.abs());
        }
        self.fold(&sums);
        for l in 0..KEPT {
            for k in 0..LANES / KEPT {
                self.largest[l] = larger(self.largest[l], largest[l + k * KEPT]);
            }
        }
    }

    /// Adds the products of the entries of two blocks.
    pub(crate) fn add_products(&mut self, u: &[T], v: &[T]) {
        vectorised(
            Arch::new(),
            #[inline(always)]
            || self.add_products_here(u, v),
        );
    }

    #[inline(always)]
    fn add_products_here(&mut self, u: &[T], v: &[T]) {
        let mut sums = [0.0; LANES];
        let ((us, u), (vs, v)) = (u.as_chunks::<LANES>(), v.as_chunks::<LANES>());
        for (u, v) in us.iter().zip(vs) {
            for l in 0..LANES {
                sums[l] += u[l].wide() * v[l].wide();
            }
        }
        for (l, (u, v)) in u.iter().zip(v).enumerate() {
            sums[l] += u.wide() * v.wide();
        }
        self.fold(&sums);
    }

    #[inline(always)]
    fn fold(&mut self, sums: &[f64; LANES]) {
        for l in 0..KEPT {
            let pairs = [0, 1].map(|k| sums[l + 2 * k * KEPT] + sums[l + (2 * k + 1) * KEPT]);
            self.sums[l] += pairs[0] + pairs[1];
        }
    }

    pub(crate) fn part(&self) -> Part {
        Part {
            sum: self.sums.iter().sum(),
            largest: self.largest.iter().copied().fold(T::zero(), larger).wide(),
        }
    }
}

/// The points of a row that are added to a [`Tally`] at one go.
pub(crate) const BLOCK: usize = 256;
/// The most stretches that the columns of a grid fall into.
const STRETCHES: usize = 64;

/// The columns of a grid, as stretches of whole blocks.
///
/// Each stretch is summed on its own, its rows in order, and the stretches are added from west to
/// east. So a sum does not depend on who takes which part of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretches {
    pub(crate) nx: usize,
    pub(crate) ny: usize,
    /// The columns of a stretch.
    pub(crate) width: usize,
}

impl Stretches {
    pub(crate) fn of([nx, ny]: [usize; 2]) -> Self {
        Self { nx, ny, width: BLOCK * nx.div_ceil(BLOCK * STRETCHES).max(1) }
    }

    /// Returns the number of stretches.
    pub(crate) fn count(&self) -> usize {
        self.nx.div_ceil(self.width)
    }
}

/// The sums of one thread over some rows, by stretches.
pub(crate) struct Tallies<T> {
    width: usize,
    tallies: [Tally<T>; STRETCHES],
}

impl<T: Scalar> Tallies<T> {
    pub(crate) fn new(stretches: Stretches) -> Self {
        Self { width: stretches.width, tallies: [Tally::zero(); STRETCHES] }
    }

    /// Adds the squares of values of a row from a column on, which begins a block unless all values
    /// are of one.
    #[inline(always)]
    pub(crate) fn add(&mut self, meter: Meter, column: usize, values: &[T]) {
        for (k, block) in values.chunks(BLOCK).enumerate() {
            self.at(column + k * BLOCK).add_here(meter, block);
        }
    }

    /// Returns the sum over the stretch that a column belongs to.
    #[inline(always)]
    pub(crate) fn at(&mut self, column: usize) -> &mut Tally<T> {
        &mut self.tallies[column / self.width]
    }

    /// Returns the sums over the stretches that a range of columns meets, which begin again at
    /// zero.
    pub(crate) fn take(&mut self, columns: Range<usize>) -> impl Iterator<Item = (usize, Part)> {
        let stretches = columns.start / self.width..columns.end.div_ceil(self.width);
        let tallies = self.tallies[stretches.clone()].iter_mut();
        stretches.zip(tallies.map(|tally| std::mem::replace(tally, Tally::zero()).part()))
    }
}

/// The sums over the stretches of a grid, in their order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Totals([Part; STRETCHES]);

impl Totals {
    pub(crate) fn zero() -> Self {
        Self([Part::default(); STRETCHES])
    }

    pub(crate) fn add(&mut self, stretch: usize, part: Part) {
        self.0[stretch].add(part);
    }

    pub(crate) fn parts(&self) -> impl Iterator<Item = Part> {
        self.0.into_iter()
    }
}

/// Returns a power of two within a factor of two of `v`, kept where it and its reciprocal are
/// normal; 1 for 0.
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
    /// The order of the problem, of which `q` may be a part.
    order: usize,
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
        Ok(Self::measured_as(q, Norms::of(q), q.len()))
    }

    /// Returns a part `q` of a right-hand side of this order and these norms.
    pub(crate) fn measured_as(q: &'q [T], norms: Norms, order: usize) -> Self {
        Self { q, norms, order }
    }

    /// Returns the entries.
    pub fn entries(&self) -> &'q [T] {
        self.q
    }

    /// Returns the order of the whole, of which ranks may have a part each.
    pub(crate) fn order(&self) -> usize {
        self.order
    }

    /// Returns their norms.
    pub fn norms(&self) -> Norms {
        self.norms
    }

    /// Measures a vector that is expected to be of the size of `q`.
    pub(crate) fn measured(&self, measure: impl Fn(Meter) -> Norms) -> Norms {
        Meter::measured(self.norms.linf, self.order, measure)
    }

    /// Returns a meter for vectors of the size of `γ q`.
    pub(crate) fn meter(&self, gamma: T) -> Meter {
        Meter::for_size(self.norms.linf * gamma.wide(), self.order)
    }
}

/// Refuses a vector with a NaN or infinite entry, naming the first.
///
/// # Errors
///
/// [`Error::NotFinite`] with `what`, the index and the value.
#[doc(hidden)]
pub fn all_finite<T: Scalar>(what: &'static str, v: &[T]) -> Result<(), Error> {
    match v.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(Error::NotFinite { what, index, value: v[index].wide() }),
        None => Ok(()),
    }
}
