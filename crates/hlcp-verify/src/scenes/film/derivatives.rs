//! How the rows of a film change with its gap.

use super::{
    Film, TimeStep,
    gates::{Gate, Passage},
};

impl Film {
    /// The change of `A z − B r + q` at fixed `z` and `r` for a change of the gap, with the unit of
    /// pressure kept.
    ///
    /// At a solution without a cell on the edge, `z = r = 0`, the changes of `z` in full cells and
    /// of `r` in broken ones solve `[A_F | −B_C] δ = −` this.
    ///
    /// # Panics
    ///
    /// As [`figures`](Self::figures), and unless `change`, in m, has an entry for each cell.
    ///
    /// ```
    /// use hlcp_verify::Film;
    ///
    /// // Wider in the second cell: the wall carries half of it through the face between the two,
    /// // and all of it out.
    /// let film = Film::new([2, 1], [0.02, 0.01], 3.0, 0.04);
    /// let change = film.widening(&[0.0; 2], &[0.0; 2], &[0.0, 1e-9]);
    /// assert!(change[0] > 0.0 && (change[1] / change[0] - 1.0).abs() < 1e-12);
    /// ```
    pub fn widening(&self, z: &[f64], r: &[f64], change: &[f64]) -> Vec<f64> {
        assert_eq!(change.len(), z.len(), "an entry for each cell");
        let (mut y, frame) = (vec![0.0; z.len()], self.frame());
        let unit = frame.flow;
        self.gates(&frame, |axis, gate| {
            let d = self.passage_change(axis, gate, change);
            let flow = self.through(gate, d, frame.pressure, z, r) / unit;
            match gate {
                Gate::Between([low, high]) => {
                    y[low] += flow;
                    y[high] -= flow;
                }
                Gate::Out { cell, .. } => y[cell] += flow,
            }
        });
        if let Some(TimeStep { duration, .. }) = &self.step {
            let rate = self.cell() / (duration * unit);
            for k in (0..z.len()).filter(|&k| frame.supply(&frame.cells, k).is_none()) {
                y[k] += rate * (1.0 - r[k]) * change[k];
            }
        }
        y
    }

    /// What cells store while the gap and the void fraction change at these rates, `∂t((1 − r) h)`,
    /// in m/s and 1/s: the change of `A z − B r + q`.
    ///
    /// A film that has been followed through small, slow changes differs from the steady one by
    /// `[A_F | −B_C] δ = −` this, with the rate of `r` that [`widening`](Self::widening) leads to.
    ///
    /// # Panics
    ///
    /// As [`widening`](Self::widening).
    ///
    /// ```
    /// use hlcp_verify::Film;
    ///
    /// let film = Film::new([2, 1], [0.02, 0.01], 3.0, 0.04);
    /// let push = film.storing(&[0.0, 0.25], &[-1e-3; 2], &[0.0; 2]);
    /// assert!(push[0] < 0.0 && (push[1] / push[0] - 0.75).abs() < 1e-15);
    /// // the second cell, 10 µm high, empties as fast as the first one is squeezed
    /// let both = film.storing(&[0.0, 0.25], &[-1e-3, 0.0], &[0.0, 100.0]);
    /// assert!((both[1] / both[0] - 1.0).abs() < 1e-15);
    /// ```
    pub fn storing(&self, r: &[f64], gap_rate: &[f64], r_rate: &[f64]) -> Vec<f64> {
        assert_eq!([gap_rate.len(), r_rate.len()], [r.len(); 2], "an entry for each cell");
        let frame = self.frame();
        let rate = self.cell() / frame.flow;
        let stored = |k: usize| match frame.supply(&frame.cells, k) {
            Some(_) => 0.0,
            None => rate * ((1.0 - r[k]) * gap_rate[k] - self.gap[k] * r_rate[k]),
        };
        (0..r.len()).map(stored).collect()
    }

    /// The change of [`passage`](Self::passage) with the gap.
    fn passage_change(&self, axis: usize, gate: Gate, change: &[f64]) -> Passage {
        let mobility_change =
            |cell: usize| 3.0 * self.mobility(cell) / self.gap[cell] * change[cell];
        let [mobility, gap] = match gate {
            Gate::Between(pair) => {
                let [[k1, k2], [h1, h2]] = self.beside(pair);
                let ([dk1, dk2], [dh1, dh2]) = (pair.map(mobility_change), pair.map(|c| change[c]));
                let sum = k1 + k2;
                let mean = (h1 * k2 + h2 * k1) / sum;
                [
                    2.0 * (k2 * k2 * dk1 + k1 * k1 * dk2) / (sum * sum),
                    ((h2 - mean) * dk1 + (h1 - mean) * dk2 + k2 * dh1 + k1 * dh2) / sum,
                ]
            }
            Gate::Out { cell, outward, .. } => {
                [2.0 * mobility_change(cell), outward * change[cell]]
            }
        };
        self.of_passage(axis, mobility, gap)
    }
}
