use crate::numbers::Scalar;

/// The entries of a diagonal, or the coefficients of one direction: a number for all points, or
/// one for each in a list `L`.
///
/// ```
/// use hlcp_core::{Coefficients, Omega};
///
/// let conductances = [1.0, 2.0, 4.0];
/// let varying = Coefficients::Each(&conductances);
/// assert_eq!((varying.entry(2), Omega::Uniform(-1.0).entry(2)), (4.0, -1.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Entries<T, L> {
    /// The same at every point.
    Uniform(T),
    /// One for each point, by the point's index.
    Each(L),
}

/// Entries whose list is borrowed.
pub type Coefficients<'a, T> = Entries<T, &'a [T]>;

/// Entries that own their list.
///
/// ```
/// use hlcp_core::{Diagonal, FivePoint, Varying};
///
/// let grid = |by: f64| {
///     FivePoint::from_fn(2, 2, move |i, _| [-1.0, -1.0, 4.0 + by * i as f64, -1.0, -1.0])
/// };
/// let grids: [FivePoint<Varying<f64>>; 2] = [grid(0.0)?, grid(1.0)?];
/// assert_eq!([0, 1].map(|k| grids[k].diagonal_entry(3)), [4.0, 5.0]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub type Varying<T> = Entries<T, Vec<T>>;

impl<T: Scalar> Varying<T> {
    /// Returns the entries of a list that is not empty, one where all are the same.
    pub(crate) fn of_list(list: Vec<T>) -> Self {
        let same = list.iter().all(|&value| value == list[0]);
        if same { Self::Uniform(list[0]) } else { Self::Each(list) }
    }
}

impl<T: Scalar, L: AsRef<[T]>> Entries<T, L> {
    /// Returns the entry at point `k`.
    ///
    /// # Panics
    ///
    /// When `k` is not below the length of an [`Each`](Self::Each).
    #[inline]
    pub fn entry(&self, k: usize) -> T {
        match self {
            Self::Uniform(value) => *value,
            Self::Each(values) => values.as_ref()[k],
        }
    }
}
