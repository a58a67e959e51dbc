//! Between a grid and the next coarser one, an axis at a time.

use hlcp_core::Scalar;

/// The inner nodes of one axis on two grids over one interval, whose ends are the grids' nodes 0
/// and `m + 1`.
///
/// Of `m` nodes a coarser grid keeps `(m − 1)/2` for odd `m`, where they coincide with every other
/// fine one, and `m/2 − 1` for even `m`, whose spacing is a little more than twice the fine one.
#[derive(Debug, Clone)]
pub(super) struct Axis<T> {
    coarse: usize,
    /// For each coarse node the fine one nearest to it.
    nearest: Vec<usize>,
    /// For each fine node how many coarse ones lie below it, and its distance from the last of
    /// those (or from the interval's end) in coarse spacings.
    place: Vec<(usize, T)>,
    /// The fine spacing over the coarse one.
    ratio: T,
}

impl<T: Scalar> Axis<T> {
    /// The axis of `fine` nodes and its coarser one; with the same nodes where no coarser one has
    /// any.
    pub(super) fn new(fine: usize) -> Self {
        let coarse = match (fine - 1) / 2 {
            0 => fine,
            half if fine % 2 == 1 => half,
            _ => fine / 2 - 1,
        };
        let (fine_cells, coarse_cells) = (fine + 1, coarse + 1);
        let number = |v: usize| T::of(v as f64);
        // Fine node i is i/(fine + 1) along; in coarse spacings i (coarse + 1)/(fine + 1).
        let place = |i: usize| {
            let (whole, rest) = (i * coarse_cells / fine_cells, i * coarse_cells % fine_cells);
            (whole, number(rest) / number(fine_cells))
        };
        let nearest = |i: usize| (i * fine_cells + coarse_cells / 2) / coarse_cells - 1;
        Self {
            coarse,
            nearest: (1..=coarse).map(nearest).collect(),
            place: (1..=fine).map(place).collect(),
            ratio: number(coarse_cells) / number(fine_cells),
        }
    }

    /// The number of nodes on the coarser grid.
    pub(super) fn coarse(&self) -> usize {
        self.coarse
    }

    /// For each coarse node the fine one nearest to it.
    pub(super) fn nearest(&self) -> &[usize] {
        &self.nearest
    }

    /// How many fine edges lie between coarse node `i` and its two neighbours, without those to the
    /// interval's ends.
    pub(super) fn edges(&self, i: usize) -> [usize; 2] {
        if self.coarse == self.place.len() {
            return [0, 0];
        }
        let (here, last) = (self.nearest[i], self.place.len() - 1);
        let before = if i > 0 { self.nearest[i - 1] } else { 0 };
        [here - before, self.nearest.get(i + 1).unwrap_or(&last) - here]
    }

    /// The fine spacing over the coarse one.
    pub(super) fn ratio(&self) -> T {
        self.ratio
    }

    /// `fine += P coarse`, linear interpolation with zeros at the ends.
    fn interpolate(&self, coarse: &[T], fine: &mut [T]) {
        for (fine, &(below, weight)) in fine.iter_mut().zip(&self.place) {
            let left = if below > 0 { coarse[below - 1] } else { T::zero() };
            let right = if below < self.coarse { coarse[below] } else { T::zero() };
            *fine += left + weight * (right - left);
        }
    }

    /// The weights of the four coarse nodes nearest to fine node `i`, or of all where there are
    /// fewer, in the polynomial through them.
    fn lagrange(&self, i: usize) -> impl Iterator<Item = (usize, T)> {
        let (below, rest) = self.place[i];
        let count = self.coarse.min(4);
        // Of the nodes below − 2 to below + 1, those of the axis.
        let first = below.saturating_sub(2).min(self.coarse - count);
        let number = |v: usize| T::of(v as f64);
        let at = number(below) + rest;
        (first..first + count).map(move |node| {
            let others = (first..first + count).filter(|&other| other != node);
            let place = |node: usize| number(node + 1);
            let weight = others.fold(T::one(), |weight, other| {
                weight * (at - place(other)) / (place(node) - place(other))
            });
            (node, weight)
        })
    }

    /// `coarse += ratio · Pᵀ fine`.
    fn weigh(&self, fine: &[T], coarse: &mut [T]) {
        for (&fine, &(below, weight)) in fine.iter().zip(&self.place) {
            let fine = self.ratio * fine;
            if below > 0 {
                coarse[below - 1] += (T::one() - weight) * fine;
            }
            if below < self.coarse {
                coarse[below] += weight * fine;
            }
        }
    }
}

/// Calls `each` with every coarse point and the value of `fine` at the fine point nearest to it.
pub(super) fn inject<T: Scalar>(
    [x_axis, y_axis]: &[Axis<T>; 2],
    fine: &[T],
    mut each: impl FnMut(usize, T),
) {
    let nx = x_axis.place.len();
    for (row, &j) in y_axis.nearest.iter().enumerate() {
        let fine = &fine[j * nx..(j + 1) * nx];
        for (i, &nearest) in x_axis.nearest.iter().enumerate() {
            each(row * x_axis.coarse + i, fine[nearest]);
        }
    }
}

/// Overwrites `fine` with an interpolation of `coarse` of higher order, that asks for nothing
/// beyond the grid.
pub(super) fn interpolate_smooth<T: Scalar>(
    [x_axis, y_axis]: &[Axis<T>; 2],
    coarse: &[T],
    fine: &mut [T],
    line: &mut [T],
) {
    let (nx, width) = (x_axis.place.len(), x_axis.coarse);
    let line = &mut line[..width];
    for (j, fine) in fine.chunks_exact_mut(nx).enumerate() {
        line.fill(T::zero());
        for (row, weight) in y_axis.lagrange(j) {
            for (v, &coarse) in line.iter_mut().zip(&coarse[row * width..(row + 1) * width]) {
                *v += weight * coarse;
            }
        }
        for (i, fine) in fine.iter_mut().enumerate() {
            let parts = x_axis.lagrange(i).map(|(column, weight)| weight * line[column]);
            *fine = parts.fold(T::zero(), |sum, part| sum + part);
        }
    }
}

/// Overwrites `coarse` with the full weighting of `fine`: the transpose of [`interpolate`] over the
/// ratio of the cells' areas.
pub(super) fn restrict<T: Scalar>(
    [x_axis, y_axis]: &[Axis<T>; 2],
    fine: &[T],
    coarse: &mut [T],
    line: &mut [T],
) {
    let (nx, width) = (x_axis.place.len(), x_axis.coarse);
    let line = &mut line[..width];
    coarse.fill(T::zero());
    for (fine, &(below, weight)) in fine.chunks_exact(nx).zip(&y_axis.place) {
        line.fill(T::zero());
        x_axis.weigh(fine, line);
        let mut add = |row: usize, weight: T| {
            for (coarse, &v) in coarse[row * width..(row + 1) * width].iter_mut().zip(&*line) {
                *coarse += weight * v;
            }
        };
        if below > 0 {
            add(below - 1, y_axis.ratio * (T::one() - weight));
        }
        if below < y_axis.coarse {
            add(below, y_axis.ratio * weight);
        }
    }
}

/// `fine += P coarse`, bilinear interpolation with zeros around the grid.
pub(super) fn interpolate<T: Scalar>(
    [x_axis, y_axis]: &[Axis<T>; 2],
    coarse: &[T],
    fine: &mut [T],
    line: &mut [T],
) {
    let (nx, width) = (x_axis.place.len(), x_axis.coarse);
    let line = &mut line[..width];
    for (fine, &(below, weight)) in fine.chunks_exact_mut(nx).zip(&y_axis.place) {
        line.fill(T::zero());
        let mut add = |row: usize, weight: T| {
            for (v, &coarse) in line.iter_mut().zip(&coarse[row * width..(row + 1) * width]) {
                *v += weight * coarse;
            }
        };
        if below > 0 {
            add(below - 1, T::one() - weight);
        }
        if below < y_axis.coarse && weight > T::zero() {
            add(below, weight);
        }
        x_axis.interpolate(line, fine);
    }
}
