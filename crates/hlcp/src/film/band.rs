use std::ops::Range;

use hlcp_core::Rows;
use hlcp_methods::Jacobian;
use hlcp_verify::{Film, Side};

/// The widest band that is factorised: with twice the cells across, multigrid takes less time for
/// the few right-hand sides of a film, and less memory.
const WIDEST: usize = 128;

/// The factors of the matrix of a film's derivatives, L U without pivoting.
///
/// Its columns are those of M-matrices that are diagonally dominant by columns, and so no pivot
/// vanishes and nothing grows.
pub(super) struct Band {
    /// Of each cell its place in an order in which neighbours are near.
    places: Vec<usize>,
    /// How far neighbours are apart at most.
    half: usize,
    /// `2 half + 1` entries of each row, the diagonal in the middle.
    rows: Vec<f64>,
}

impl Band {
    /// Factorises the matrix, unless its band is too wide.
    pub(super) fn of<A: Rows<f64>, B: Rows<f64>>(
        film: &Film,
        jacobian: &Jacobian<'_, f64, A, B>,
    ) -> Option<Self> {
        let counts = [film.nx, film.ny];
        let round = [film.sides[0], film.sides[2]].map(|side| side == Side::Periodic);
        // Around a ring every other column is one from behind.
        let apart = [0, 1].map(|axis| counts[1 - axis] * if round[axis] { 2 } else { 1 });
        let axis = if apart[0] <= apart[1] { 0 } else { 1 };
        let half = apart[axis].max(if round[1 - axis] { counts[1 - axis] - 1 } else { 1 });
        if half > WIDEST {
            return None;
        }
        let folded = |at: usize| match (round[axis], 2 * at < counts[axis]) {
            (false, _) => at,
            (true, true) => 2 * at,
            (true, false) => 2 * (counts[axis] - 1 - at) + 1,
        };
        let place = |k: usize| {
            let at = [k % film.nx, k / film.nx];
            folded(at[axis]) * counts[1 - axis] + at[1 - axis]
        };
        let n = film.gap.len();
        let places: Vec<usize> = (0..n).map(place).collect();
        let mut band = Self { rows: vec![0.0; n * (2 * half + 1)], half, places };
        for k in 0..n {
            let row = band.places[k];
            jacobian.visit_row(k, |j, entry| {
                let at = band.at(row, band.places[j]);
                band.rows[at] += entry;
            });
        }
        band.factorise();
        Some(band)
    }

    /// Where an entry is.
    fn at(&self, row: usize, column: usize) -> usize {
        row * (2 * self.half + 1) + column + self.half - row
    }

    /// The places after this one that are not further than neighbours.
    fn after(&self, place: usize) -> Range<usize> {
        place + 1..(place + self.half + 1).min(self.places.len())
    }

    fn factorise(&mut self) {
        for k in 0..self.places.len() {
            let (pivot, columns) = (self.rows[self.at(k, k)], self.after(k));
            for i in columns.clone() {
                let lower = self.at(i, k);
                if self.rows[lower] == 0.0 {
                    continue;
                }
                let factor = self.rows[lower] / pivot;
                self.rows[lower] = factor;
                let (above, below) = self.rows.split_at_mut(lower + 1);
                let from = k * (2 * self.half + 1) + self.half + 1;
                let above = &above[from..from + columns.len()];
                below.iter_mut().zip(above).for_each(|(entry, above)| *entry -= factor * above);
            }
        }
    }

    /// Overwrites `y` with the solution for `rhs`.
    pub(super) fn solve(&self, rhs: &[f64], y: &mut [f64]) {
        let mut x = vec![0.0; rhs.len()];
        self.places.iter().zip(rhs).for_each(|(&place, rhs)| x[place] = *rhs);
        for i in 0..x.len() {
            let from = i.saturating_sub(self.half);
            let row = &self.rows[self.at(i, from)..self.at(i, i)];
            x[i] -= row.iter().zip(&x[from..]).map(|(entry, x)| entry * x).sum::<f64>();
        }
        for i in (0..x.len()).rev() {
            let columns = self.after(i);
            let row = &self.rows[self.at(i, i) + 1..];
            let known: f64 = row.iter().zip(&x[columns]).map(|(entry, x)| entry * x).sum();
            x[i] = (x[i] - known) / self.rows[self.at(i, i)];
        }
        y.iter_mut().zip(&self.places).for_each(|(y, &place)| *y = x[place]);
    }
}

#[cfg(test)]
mod tests {
    use hlcp_core::{Hlcp, Omega};

    use super::*;

    /// The residual of a solve over the right-hand side, on a film with these sides.
    fn residual(cells: [usize; 2], round: [bool; 2]) -> f64 {
        let mut film = Film::new(cells, [0.1, 0.05], 3.0, 0.04)
            .with_gap(|x, y| 2e-5 + 1e-5 * (60.0 * x).sin() + 5e-6 * (90.0 * y).cos());
        film.sides = [0, 0, 1, 1].map(|axis: usize| match round[axis] {
            true => Side::Periodic,
            false => Side::Pressure(1e5),
        });
        let groove = hlcp_verify::Supply { corner: [0.05, 0.0], size: [0.0, 0.05], pressure: 1e5 };
        film.supplies = vec![groove];
        let (a, b, q) = film.pose().unwrap();
        let omega = Omega::diagonal_ratio(1.0, &a, &b).unwrap();
        let problem = Hlcp::new(&a, &b, omega).unwrap();
        let x: Vec<f64> = (0..q.len()).map(|k| if k % 7 < 3 { -1.0 } else { 1.0 }).collect();
        let jacobian = Jacobian::new(&problem, &x);
        let band = Band::of(&film, &jacobian).expect("a narrow one");
        let rhs: Vec<f64> = (0..q.len()).map(|k| (k as f64).sin()).collect();
        let [mut s, mut product] = [vec![0.0; q.len()], vec![0.0; q.len()]];
        band.solve(&rhs, &mut s);
        jacobian.apply(&s, &mut product, &mut vec![]);
        let off = product.iter().zip(&rhs).map(|(one, other)| (one - other).abs());
        off.fold(0.0, f64::max)
    }

    #[test]
    fn a_matrix_times_the_solution_is_the_right_hand_side() {
        for cells in [[7, 4], [4, 7], [12, 5], [5, 12]] {
            for round in [[false, false], [true, false], [false, true], [true, true]] {
                let off = residual(cells, round);
                assert!(off <= 1e-10, "{cells:?} {round:?}: {off}");
            }
        }
    }

    #[test]
    fn a_wide_band_is_left_to_multigrid() {
        let film = Film::new([WIDEST + 1, WIDEST + 1], [0.1, 0.1], 3.0, 0.04);
        let (a, b, q) = film.pose().unwrap();
        let omega = Omega::diagonal_ratio(1.0, &a, &b).unwrap();
        let problem = Hlcp::new(&a, &b, omega).unwrap();
        let x = vec![1.0; q.len()];
        assert!(Band::of(&film, &Jacobian::new(&problem, &x)).is_none());
    }
}
