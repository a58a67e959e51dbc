//! How the rows and the figures of a film change with its data.

use hlcp_core::assert_lengths;

use super::{
    Film, Side, TimeStep,
    gates::{Frame, Gate, Passage, Place},
};

/// A change of the data of a [`Film`], for derivatives in its direction; an empty list is no
/// change.
///
/// ```
/// use hlcp_verify::{Film, FilmChange};
///
/// // Both walls carry oil; the one that is at rest begins to move.
/// let film = Film::new([2, 1], [0.02, 0.01], 3.0, 0.04);
/// let moving = FilmChange { speeds: [0.0, 1.0], ..FilmChange::default() };
/// let slopes = film.slopes([&[0.0; 2], &[0.0; 2]], [&[0.0; 2], &[0.0; 2]], &moving, 0.0);
/// // Friction falls by μ/h times the area.
/// assert!((slopes.friction[0] + 0.04 / 1e-5 * 2e-4).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FilmChange {
    /// Of the gap in each cell, in m.
    pub gap: Vec<f64>,
    /// Of the viscosity in each cell, or one for all, in Pa s.
    pub viscosity: Vec<f64>,
    /// Of the speeds of both walls, in m/s.
    pub speeds: [f64; 2],
    /// Of the pressure in the west, east, south and north, in Pa, or of the content of the oil that
    /// enters there.
    pub sides: [f64; 4],
    /// Of the pressure of each supply, in Pa.
    pub supplies: Vec<f64>,
    /// Of the pressure in the broken film, in Pa.
    pub cavitation: f64,
}

impl FilmChange {
    fn gap(&self, cell: usize) -> f64 {
        self.gap.get(cell).copied().unwrap_or(0.0)
    }

    fn viscosity(&self, cell: usize) -> f64 {
        let last = self.viscosity.len().saturating_sub(1);
        self.viscosity.get(cell.min(last)).copied().unwrap_or(0.0)
    }

    fn drift(&self, axis: usize) -> f64 {
        if axis == 0 { f64::midpoint(self.speeds[0], self.speeds[1]) } else { 0.0 }
    }
}

/// What the figures of a film gain with a [`FilmChange`]: its derivative in that direction, with
/// the names and the units of [`FilmFigures`](super::FilmFigures).
///
/// ```
/// use hlcp_verify::{Film, FilmChange};
///
/// // The surroundings rise by 1 Pa, and the film, which is full, with them.
/// let film = Film::new([2, 1], [0.02, 0.01], 0.0, 0.04);
/// let rise = FilmChange { sides: [1.0; 4], ..FilmChange::default() };
/// let up = [1.0 / film.pressure_unit(); 2];
/// let slopes = film.slopes([&[0.0; 2], &[0.0; 2]], [&up, &[0.0; 2]], &rise, 0.0);
/// assert!((slopes.load - 2e-4).abs() < 1e-18 && (slopes.peak - 1.0).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct FilmSlopes {
    /// Of the load.
    pub load: f64,
    /// Of its moments.
    pub moments: [f64; 2],
    /// Of the drag on the lower and the upper wall.
    pub friction: [f64; 2],
    /// Of the drag if a broken film were sheared all over.
    pub full_friction: [f64; 2],
    /// Of the power.
    pub power: f64,
    /// Of what flows out in the west, east, south and north.
    pub sides: [f64; 4],
    /// Of what each supply delivers.
    pub supplies: Vec<f64>,
    /// Of the largest pressure.
    pub peak: f64,
}

/// A solution, and how it changes.
#[derive(Clone, Copy)]
struct Moved<'m> {
    z: &'m [f64],
    r: &'m [f64],
    dz: &'m [f64],
    dr: &'m [f64],
    change: &'m FilmChange,
}

impl Film {
    /// Returns the change of `A z − B r + q` at fixed `z` and `r` with the data of the film, the
    /// unit of pressure kept.
    ///
    /// At a solution without a cell on the edge, `z = r = 0`, the changes of `z` in full cells and
    /// of `r` in broken ones solve `[A_F | −B_C] δ = −` this.
    ///
    /// # Panics
    ///
    /// As [`figures`](Self::figures), and for a gap that has not an entry for each cell.
    ///
    /// ```
    /// use hlcp_verify::{Film, FilmChange};
    ///
    /// // Wider in the second cell: the wall carries half of it through the face between the two,
    /// // and all of it out.
    /// let film = Film::new([2, 1], [0.02, 0.01], 3.0, 0.04);
    /// let wider = FilmChange { gap: vec![0.0, 1e-9], ..FilmChange::default() };
    /// let change = film.rows_change(&[0.0; 2], &[0.0; 2], &wider);
    /// assert!(change[0] > 0.0 && (change[1] / change[0] - 1.0).abs() < 1e-12);
    /// ```
    pub fn rows_change(&self, z: &[f64], r: &[f64], change: &FilmChange) -> Vec<f64> {
        let n = z.len();
        let gaps = if change.gap.is_empty() { n } else { change.gap.len() };
        assert_lengths(n, [("change.gap", gaps)]);
        let (mut y, frame, still) = (vec![0.0; n], self.frame(), vec![0.0; n]);
        let moved = Moved { z, r, dz: &still, dr: &still, change };
        self.gates(&frame, |axis, gate| {
            gate.pass(self.flow_change(&frame, axis, gate, moved) / frame.flow, &mut y);
        });
        for (k, y) in y.iter_mut().enumerate() {
            if let Some(supply) = frame.supply(&frame.cells, k) {
                *y = -self.beyond(&frame, Place::Supply(supply), change)[0];
            } else if let Some(TimeStep { duration, .. }) = &self.step {
                *y += self.cell() / (duration * frame.flow) * (1.0 - r[k]) * change.gap(k);
            }
        }
        y
    }

    /// Returns how the figures change with the data of the film, if its solution `[z, r]` changes
    /// by `[δz, δr]`; the load is counted from a pressure that changes by `ambient`.
    ///
    /// # Panics
    ///
    /// As [`rows_change`](Self::rows_change).
    pub fn slopes(
        &self,
        [z, r]: [&[f64]; 2],
        [dz, dr]: [&[f64]; 2],
        change: &FilmChange,
        ambient: f64,
    ) -> FilmSlopes {
        let (frame, area, nx) = (self.frame(), self.cell(), self.nx);
        let (unit, cavitation) = (frame.pressure, change.cavitation);
        let moved = Moved { z, r, dz, dr, change };
        let slip = self.speeds[0] - self.speeds[1];
        let slip_change = change.speeds[0] - change.speeds[1];
        let mut slopes =
            FilmSlopes { supplies: vec![0.0; self.supplies.len()], ..FilmSlopes::default() };
        let (mut peak, mut void) = (f64::NEG_INFINITY, 0.0);
        for k in 0..z.len() {
            let p = (cavitation - ambient + unit * dz[k]) * area;
            slopes.load += p;
            let [i, j] = [k % nx, k / nx].map(|at| at as f64 + 0.5);
            slopes.moments[0] += p * self.spacing(0) * (i - nx as f64 / 2.0);
            slopes.moments[1] += p * self.spacing(1) * (j - self.ny as f64 / 2.0);
            let (viscosity, gap) = (self.viscosity(k), self.gap[k]);
            let shear = viscosity * slip / gap * area;
            let more = (change.viscosity(k) * slip + viscosity * slip_change) / gap * area
                - shear * change.gap(k) / gap;
            let filled = more * (1.0 - r[k]) - shear * dr[k];
            slopes.friction.iter_mut().for_each(|friction| *friction += filled);
            void += more * r[k] + shear * dr[k];
            if z[k] > peak {
                (peak, slopes.peak) = (z[k], cavitation + unit * dz[k]);
            }
        }
        let mut turned = 0.0;
        self.gates(&frame, |axis, gate| {
            let flow = self.flow_change(&frame, axis, gate, moved);
            if let Gate::Out { place, .. } = gate {
                match place {
                    Place::Side(side) => slopes.sides[side] += flow,
                    Place::Supply(supply) => slopes.supplies[supply] -= flow,
                }
            }
            if axis == 1 {
                return;
            }
            let wall = self.wall_pressure(&frame, gate, z, r);
            let wall_change = self.wall_change(&frame, gate, moved);
            let width = self.spacing(1) / 2.0 * unit;
            for (cell, sign) in gate.halves() {
                let pushed =
                    change.gap(cell) * (wall - z[cell]) + self.gap[cell] * (wall_change - dz[cell]);
                turned += sign * width * pushed;
            }
            if let Gate::Between([low, high]) = gate
                && r[low] <= 0.0
                && r[high] <= 0.0
                && wall > peak
            {
                (peak, slopes.peak) = (wall, cavitation + unit * wall_change);
            }
        });
        slopes.friction[0] += turned;
        slopes.friction[1] -= turned;
        slopes.full_friction = slopes.friction.map(|friction| friction + void);
        slopes.power = slopes.friction[0] * self.speeds[0] - slopes.friction[1] * self.speeds[1];
        if change.speeds != [0.0; 2] {
            let [lower, upper] = self.figures(z, r, 0.0).friction;
            slopes.power += lower * change.speeds[0] - upper * change.speeds[1];
        }
        slopes
    }

    /// The changes of `z` and of the film content of what is beyond a side, or of a supply.
    fn beyond(&self, frame: &Frame, place: Place, change: &FilmChange) -> [f64; 2] {
        let z = |pressure: f64| (pressure - change.cavitation) / frame.pressure;
        match place {
            Place::Side(side) if matches!(self.sides[side], Side::Starved(_)) => {
                [0.0, change.sides[side]]
            }
            Place::Side(side) => [z(change.sides[side]), 0.0],
            Place::Supply(supply) => [z(change.supplies.get(supply).copied().unwrap_or(0.0)), 0.0],
        }
    }

    fn flow_change(&self, frame: &Frame, axis: usize, gate: Gate, moved: Moved<'_>) -> f64 {
        let Moved { z, r, dz, dr, change } = moved;
        let passage = self.passage(axis, gate);
        let (content, fall) = match gate {
            Gate::Between([low, high]) => {
                let upstream = if self.drift(0) >= 0.0 { low } else { high };
                (-dr[upstream], dz[low] - dz[high])
            }
            Gate::Out { cell, outward, place, .. } => {
                let leaves = outward * self.drift(0) > 0.0;
                let [beyond, enters] = self.beyond(frame, place, change);
                (if leaves { -dr[cell] } else { enters }, dz[cell] - beyond)
            }
        };
        self.through(gate, self.passage_change(axis, gate, change), frame.pressure, z, r)
            + passage.carried * content
            + passage.conductance * frame.pressure * fall
    }

    /// The change of `z` on a face across `x`.
    fn wall_change(&self, frame: &Frame, gate: Gate, moved: Moved<'_>) -> f64 {
        let Moved { z, r, dz, dr, change } = moved;
        let wall = self.wall_pressure(frame, gate, z, r);
        match gate {
            Gate::Out { place, .. } => self.beyond(frame, place, change)[0],
            Gate::Between(_) if wall <= 0.0 => 0.0,
            Gate::Between(pair) => {
                let unit = self.spacing(0) / (2.0 * frame.pressure);
                let [k1, k2] = pair.map(|cell| self.mobility(cell));
                let [dk1, dk2] = pair.map(|cell| self.mobility_change(cell, change));
                let carried = |cell: usize| {
                    let (content, gap) = (1.0 - r[cell], self.gap[cell]);
                    let more = content * change.gap(cell) - dr[cell] * gap;
                    unit * (self.drift(0) * more + change.drift(0) * content * gap)
                };
                let [(z1, dz1), (z2, dz2)] = pair.map(|cell| (z[cell], dz[cell]));
                let falls = k1 * dz1 + k2 * dz2 + dk1 * (z1 - wall) + dk2 * (z2 - wall);
                (falls + carried(pair[0]) - carried(pair[1])) / (k1 + k2)
            }
        }
    }

    /// The change of h³/12μ.
    fn mobility_change(&self, cell: usize, change: &FilmChange) -> f64 {
        let by = 3.0 * change.gap(cell) / self.gap[cell];
        self.mobility(cell) * (by - change.viscosity(cell) / self.viscosity(cell))
    }

    /// What cells store while the gap and the void fraction change at these rates, `∂t((1 − r) h)`,
    /// in m/s and 1/s: the change of `A z − B r + q`.
    ///
    /// A film that has been followed through small, slow changes differs from the steady one by
    /// `[A_F | −B_C] δ = −` this, with the rate of `r` that [`rows_change`](Self::rows_change)
    /// leads to.
    ///
    /// # Panics
    ///
    /// As [`rows_change`](Self::rows_change).
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
        assert_lengths(r.len(), [("gap_rate", gap_rate.len()), ("r_rate", r_rate.len())]);
        let frame = self.frame();
        let rate = self.cell() / frame.flow;
        let stored = |k: usize| match frame.supply(&frame.cells, k) {
            Some(_) => 0.0,
            None => rate * ((1.0 - r[k]) * gap_rate[k] - self.gap[k] * r_rate[k]),
        };
        (0..r.len()).map(stored).collect()
    }

    fn passage_change(&self, axis: usize, gate: Gate, change: &FilmChange) -> Passage {
        let [mobility, gap, mean] = match gate {
            Gate::Between(pair) => {
                let [[k1, k2], [h1, h2]] = self.beside(pair);
                let [dk1, dk2] = pair.map(|cell| self.mobility_change(cell, change));
                let [dh1, dh2] = pair.map(|cell| change.gap(cell));
                let sum = k1 + k2;
                let mean = (h1 * k2 + h2 * k1) / sum;
                [
                    2.0 * (k2 * k2 * dk1 + k1 * k1 * dk2) / (sum * sum),
                    ((h2 - mean) * dk1 + (h1 - mean) * dk2 + k2 * dh1 + k1 * dh2) / sum,
                    mean,
                ]
            }
            Gate::Out { cell, outward, place, .. } => {
                let at_end = self.at_end(axis, cell, outward, place);
                let of = |gap: &dyn Fn(usize) -> f64| {
                    outward * at_end.iter().map(|&(cell, part)| part * gap(cell)).sum::<f64>()
                };
                let mobility = 2.0 * self.mobility_change(cell, change);
                [mobility, of(&|cell| change.gap(cell)), of(&|cell| self.gap[cell])]
            }
        };
        let passage = self.of_passage(axis, mobility, gap);
        let carried = passage.carried + mean * self.spacing(1 - axis) * change.drift(axis);
        Passage { carried, ..passage }
    }
}
