//! Where oil passes between the cells of a film, and out of them.

use super::{Film, Side, Supply};

/// Where oil passes between cells, or out of one.
#[derive(Debug, Clone, Copy)]
pub(super) enum Gate {
    Between([usize; 2]),
    /// From a cell in the direction of its axis (1) or against it (−1), to a reservoir at `z` whose
    /// oil enters with this film content.
    Out {
        cell: usize,
        outward: f64,
        z: f64,
        content: f64,
        place: Place,
    },
}

impl Gate {
    /// Adds a flow through it to what leaves the cells.
    pub(super) fn pass(self, flow: f64, leaves: &mut [f64]) {
        match self {
            Self::Between([low, high]) => {
                leaves[low] += flow;
                leaves[high] -= flow;
            }
            Self::Out { cell, .. } => leaves[cell] += flow,
        }
    }

    /// The cells whose halves meet at the face, and the signs of what is outward there; twice the
    /// one cell, and 0, beside a reservoir.
    pub(super) fn halves(self) -> [(usize, f64); 2] {
        match self {
            Self::Between([low, high]) => [(low, 1.0), (high, -1.0)],
            Self::Out { cell, outward, .. } => [(cell, outward), (cell, 0.0)],
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Place {
    Side(usize),
    Supply(usize),
}

/// The conductance and the carried flow of a gate, or their derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Passage {
    pub(super) conductance: f64,
    pub(super) carried: f64,
}

/// How far, in cells, rounding may put the middle of one from the edge that it is on.
const ON_EDGE: f64 = 1e-6;

/// What is found once for all gates.
pub(super) struct Frame {
    /// The supply at each cell and at the west face of each cell, counted from 1; empty without
    /// any.
    pub(super) cells: Vec<u32>,
    pub(super) faces: Vec<u32>,
    /// The units of `z`, in Pa, and of a row, in m³/s.
    pub(super) pressure: f64,
    pub(super) flow: f64,
}

impl Frame {
    /// The supply that a list has at a cell.
    pub(super) fn supply(&self, list: &[u32], cell: usize) -> Option<usize> {
        list.get(cell).and_then(|&number| (number as usize).checked_sub(1))
    }
}

impl Film {
    pub(super) fn frame(&self) -> Frame {
        let pressure = self.pressure_unit();
        let flow = pressure * self.least_gap().powi(3) / (12.0 * self.viscosity[0]);
        let mut frame = Frame { cells: vec![], faces: vec![], pressure, flow };
        for (supply, number) in self.supplies.iter().zip(1_u32..) {
            let list = if supply.size[0] == 0.0 { &mut frame.faces } else { &mut frame.cells };
            list.resize(self.gap.len(), 0);
            let (columns, rows) = self.covered(supply);
            for j in rows {
                for &i in &columns {
                    let entry = &mut list[j * self.nx + i];
                    if *entry == 0 {
                        *entry = number;
                    }
                }
            }
        }
        frame
    }

    /// The columns and rows of a supply, those of which it holds the middle. One on the edge is in
    /// at the lower end and out at the upper one, so that the size is right wherever it begins.
    pub(super) fn covered(&self, supply: &Supply) -> (Vec<usize>, Vec<usize>) {
        let inside = |axis: usize| -> Vec<usize> {
            let (count, length) = ([self.nx, self.ny][axis], self.lengths[axis]);
            let is_inside = |at: &usize| {
                let spacing = self.spacing(axis);
                let middle = (*at as f64 + 0.5 + ON_EDGE) * spacing;
                let turns: &[f64] = if self.is_periodic(axis) { &[-1.0, 0.0, 1.0] } else { &[0.0] };
                turns.iter().any(|turn| {
                    let along = middle + turn * length - supply.corner[axis];
                    (0.0..supply.size[axis]).contains(&along)
                })
            };
            (0..count).filter(is_inside).collect()
        };
        let columns = if supply.size[0] == 0.0 {
            let face = (supply.corner[0] / self.spacing(0)).round() as usize;
            vec![if self.is_periodic(0) { face % self.nx } else { face }]
        } else {
            inside(0)
        };
        (columns, inside(1))
    }

    /// Calls `visit` with the axis of each gate and the gate.
    pub(super) fn gates(&self, frame: &Frame, mut visit: impl FnMut(usize, Gate)) {
        let counts = [self.nx, self.ny];
        for k in 0..self.gap.len() {
            for (axis, at, stride) in [(0, k % self.nx, 1), (1, k / self.nx, self.nx)] {
                let (count, periodic) = (counts[axis], self.is_periodic(axis));
                if at > 0 || periodic && count > 1 {
                    let before = if at > 0 { k - stride } else { k + (count - 1) * stride };
                    self.pair(frame, [before, k], axis, &mut visit);
                } else if !periodic {
                    self.edge(frame, k, 2 * axis, &mut visit);
                }
                if at + 1 == count && !periodic {
                    self.edge(frame, k, 2 * axis + 1, &mut visit);
                }
            }
        }
    }

    /// The gate between two cells, or from one of them to a supply.
    fn pair(
        &self,
        frame: &Frame,
        pair: [usize; 2],
        axis: usize,
        visit: &mut impl FnMut(usize, Gate),
    ) {
        let [low, high] = pair.map(|cell| frame.supply(&frame.cells, cell));
        let groove = if axis == 0 { frame.supply(&frame.faces, pair[1]) } else { None };
        if low.or(high).or(groove).is_none() {
            return visit(axis, Gate::Between(pair));
        }
        let [one, other] = [(low, high.or(groove), 1.0), (high, low.or(groove), -1.0)];
        for (cell, (own, beyond, outward)) in pair.into_iter().zip([one, other]) {
            if let (None, Some(supply)) = (own, beyond) {
                let z = self.z_of(frame, self.supplies[supply].pressure);
                let place = Place::Supply(supply);
                visit(axis, Gate::Out { cell, outward, z, content: 1.0, place });
            }
        }
    }

    /// The gate from a cell to a side, if there is one.
    fn edge(&self, frame: &Frame, cell: usize, side: usize, visit: &mut impl FnMut(usize, Gate)) {
        if frame.supply(&frame.cells, cell).is_some() {
            return;
        }
        let (z, content) = match self.sides[side] {
            Side::Pressure(pressure) => (self.z_of(frame, pressure), 1.0),
            Side::Starved(content) => (0.0, content),
            Side::Closed | Side::Periodic => return,
        };
        let outward = if side.is_multiple_of(2) { -1.0 } else { 1.0 };
        visit(side / 2, Gate::Out { cell, outward, z, content, place: Place::Side(side) });
    }

    /// What a pressure difference drives through a gate, and what the walls carry, in SI units.
    pub(super) fn passage(&self, axis: usize, gate: Gate) -> Passage {
        let [mobility, gap] = match gate {
            Gate::Between(pair) => {
                let [[k1, k2], [h1, h2]] = self.beside(pair);
                [2.0 * k1 * k2 / (k1 + k2), (h1 * k2 + h2 * k1) / (k1 + k2)]
            }
            Gate::Out { cell, outward, place, .. } => {
                let at_end = self.at_end(axis, cell, outward, place);
                let gap: f64 = at_end.iter().map(|&(cell, part)| part * self.gap[cell]).sum();
                [2.0 * self.mobility(cell), outward * gap]
            }
        };
        self.of_passage(axis, mobility, gap)
    }

    /// The cells that the gap at a reservoir is made of, and their parts in it.
    ///
    /// What enters at a starved side flows on as it is, so the gap at the very edge counts: half
    /// the slope of the first two cells further, or the slope of the next two where the first is
    /// more than twice that, as at a step, and none where they differ in sign; at least half the
    /// gap of the first cell. So the edge is of second order, and changes with gaps without a jump.
    pub(super) fn at_end(
        &self,
        axis: usize,
        cell: usize,
        outward: f64,
        place: Place,
    ) -> [(usize, f64); 3] {
        let of = |cells: [usize; 3], parts: [f64; 3]| [0, 1, 2].map(|k| (cells[k], parts[k]));
        let is_starved = |side: usize| matches!(self.sides[side], Side::Starved(_));
        let (count, stride) = ([self.nx, self.ny][axis], [1, self.nx][axis]);
        if count < 3 || !matches!(place, Place::Side(side) if is_starved(side)) {
            return of([cell; 3], [1.0, 0.0, 0.0]);
        }
        let cells =
            [0, 1, 2].map(|k| if outward > 0.0 { cell - k * stride } else { cell + k * stride });
        let [here, next, third] = cells.map(|k| self.gap[k]);
        let [first, second] = [here - next, next - third];
        let (parts, edge) = if first.signum() != second.signum() {
            ([1.0, 0.0, 0.0], here)
        } else if first.abs() <= 2.0 * second.abs() {
            ([1.5, -0.5, 0.0], here + 0.5 * first)
        } else {
            ([1.0, 1.0, -1.0], here + second)
        };
        of(cells, if edge < 0.5 * here { [0.5, 0.0, 0.0] } else { parts })
    }

    /// The mobilities and the gaps of two cells.
    pub(super) fn beside(&self, pair: [usize; 2]) -> [[f64; 2]; 2] {
        [pair.map(|cell| self.mobility(cell)), pair.map(|cell| self.gap[cell])]
    }

    /// Mobility and gap of a gate, times the width of its face, over the distance of two cells and
    /// times the drift.
    pub(super) fn of_passage(&self, axis: usize, mobility: f64, gap: f64) -> Passage {
        let width = self.spacing(1 - axis);
        Passage {
            conductance: mobility * width / self.spacing(axis),
            carried: gap * width * self.drift(axis),
        }
    }
}
