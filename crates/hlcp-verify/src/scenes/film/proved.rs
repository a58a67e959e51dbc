//! What is proved of a film's figures: intervals from outward arithmetic, all the way from the
//! numbers of the film and the certificate of its solution.

use super::{
    Film, Side,
    gates::{Gate, Place},
};
use crate::{
    Branch, Certificate,
    rounding::{Doubled, Interval, larger},
};

/// Intervals that hold the figures of the exact solution of [`Film::pose`], in SI units.
///
/// The figures are those of [`FilmFigures`](super::FilmFigures), as real numbers: their formulas
/// are evaluated outward, from the film's own numbers, [`Film::pressure_unit`] and a certificate.
/// Where nothing is proved an interval is infinite.
///
/// ```
/// use hlcp_verify::{Film, certify};
///
/// let film = Film::new([3, 1], [0.03, 0.01], 2.0, 0.04);
/// let (a, b, q) = film.pose()?;
/// // The gap is even, so the walls carry 10 µm · 10 mm · 1 m/s through a film without pressure.
/// let certificate = certify(&a, &b, &q, &[0.0; 3], &[0.0; 3])?.expect("a witness");
/// let [lower, upper] = film.proved_figures(&certificate, 0.0).sides[1];
/// assert!(lower <= 1e-7 && 1e-7 <= upper && upper - lower < 1e-20);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ProvedFigures {
    /// The integral of the pressure above the ambient one, in N.
    pub load: [f64; 2],
    /// What flows out in the west, east, south and north, in m³/s.
    pub sides: [[f64; 2]; 4],
    /// What each supply delivers, in m³/s.
    pub supplies: Vec<[f64; 2]>,
    /// The largest pressure, in Pa: of the cells, and of the faces between cells that are full or,
    /// above, may be.
    pub peak: [f64; 2],
}

/// A sum of intervals.
#[derive(Clone, Copy, Default)]
struct Total {
    lower: Doubled,
    upper: Doubled,
}

impl Total {
    fn add(&mut self, Interval { lower, upper }: Interval) {
        self.lower.add(1.0, lower);
        self.upper.add(1.0, upper);
    }

    fn ends(&self) -> [f64; 2] {
        ends(Interval { lower: self.lower.interval().lower, upper: self.upper.interval().upper })
    }
}

/// The ends, or infinite ones where something overflowed.
fn ends(Interval { lower, upper }: Interval) -> [f64; 2] {
    if lower <= upper { [lower, upper] } else { [f64::NEG_INFINITY, f64::INFINITY] }
}

impl Film {
    /// Encloses the figures of the solution that `certificate` proves, which is one of the
    /// operators of [`pose`](Self::pose); the load is counted from the pressure `ambient`.
    ///
    /// # Panics
    ///
    /// Unless the certificate has an unknown for each cell of a film that `pose` accepts.
    pub fn proved_figures(&self, certificate: &Certificate, ambient: f64) -> ProvedFigures {
        assert_eq!(certificate.sides.len(), self.gap.len(), "an unknown for each cell");
        let frame = self.frame();
        let mut sides = [Total::default(); 4];
        let mut supplies = vec![Total::default(); self.supplies.len()];
        // In units of z.
        let mut peak = Interval::exactly(0.0);
        for k in 0..self.gap.len() {
            let [[low, high], _] = certificate.interval(k);
            peak = Interval { lower: peak.lower.max(low), upper: larger(peak.upper, high) };
        }
        self.gates(&frame, |axis, gate| match gate {
            Gate::Out { cell, outward, content, place, .. } => {
                let (total, beyond, sign) = match place {
                    Place::Side(side) => {
                        let beyond = match self.sides[side] {
                            Side::Pressure(pressure) => pressure,
                            _ => self.cavitation,
                        };
                        (&mut sides[side], beyond, 1.0)
                    }
                    Place::Supply(supply) => {
                        (&mut supplies[supply], self.supplies[supply].pressure, -1.0)
                    }
                };
                let [[z_low, z_high], [r_low, r_high]] = certificate.interval(cell);
                let above = Interval { lower: z_low, upper: z_high }.times(frame.pressure);
                let fall = above.minus(exact_difference(beyond, self.cavitation));
                let leaves = outward * self.drift(0) > 0.0;
                let content = if leaves {
                    Interval::exactly(1.0).minus(Interval { lower: r_low, upper: r_high })
                } else {
                    Interval::exactly(content)
                };
                let width = self.proved_spacing(1 - axis);
                let conductance = self.proved_mobility(cell).times(2.0).product(width);
                let carried =
                    width.times(outward * self.gap[cell]).product(self.proved_drift(axis));
                let driven = conductance.product(self.proved_spacing(axis).reciprocal());
                total.add(carried.product(content).plus(driven.product(fall)).times(sign));
            }
            Gate::Between(pair) if axis == 0 => {
                let sides = pair.map(|cell| certificate.sides[cell]);
                if sides.iter().all(|&side| side != Branch::R) {
                    let wall = self.proved_wall(certificate, pair, frame.pressure);
                    peak.upper = larger(peak.upper, wall.upper);
                    // r = 0 is proved of both, so that the face counts.
                    if sides == [Branch::Z; 2] {
                        peak.lower = peak.lower.max(wall.lower);
                    }
                }
            }
            Gate::Between(_) => {}
        });
        let peak = peak.times(frame.pressure).plus(Interval::exactly(self.cavitation));
        ProvedFigures {
            load: ends(self.proved_force(certificate, ambient, &vec![1.0; self.gap.len()])),
            sides: sides.map(|total| total.ends()),
            supplies: supplies.iter().map(Total::ends).collect(),
            peak: ends(peak),
        }
    }

    /// Encloses the length of the vector of two forces, `∫ (p − ambient) mode`, in N: the load of a
    /// journal, whose modes are the cosine and the sine around it.
    ///
    /// # Panics
    ///
    /// As [`proved_figures`](Self::proved_figures), and unless both modes have an entry for each
    /// cell.
    ///
    /// ```
    /// use hlcp_verify::{Film, Side, certify};
    ///
    /// let plain = Film::new([1, 1], [2.0; 2], 0.0, 1.0);
    /// let film = Film { sides: [Side::Pressure(3.0); 4], ..plain };
    /// let (a, b, q) = film.pose()?;
    /// let certificate = certify(&a, &b, &q, &[1.0], &[0.0])?.expect("a witness");
    /// let [lower, upper] = film.proved_resultant(&certificate, 0.0, [&[0.6], &[0.8]]);
    /// assert!(lower <= 12.0 && 12.0 <= upper && upper - lower < 1e-12);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn proved_resultant(
        &self,
        certificate: &Certificate,
        ambient: f64,
        modes: [&[f64]; 2],
    ) -> [f64; 2] {
        let forces = modes.map(|mode| self.proved_force(certificate, ambient, mode));
        let squares = forces.map(|force| {
            let [low, high] = [force.mignitude(), force.magnitude()].map(Interval::exactly);
            Interval { lower: low.product(low).lower, upper: high.product(high).upper }
        });
        let Interval { lower, upper } = squares[0].plus(squares[1]);
        // A square root is rounded like any other operation.
        let lower = lower.max(0.0).sqrt().next_down().max(0.0);
        ends(Interval { lower, upper: upper.sqrt().next_up() })
    }

    fn proved_force(&self, certificate: &Certificate, ambient: f64, mode: &[f64]) -> Interval {
        let [lower, upper] = certificate.functional([mode, &vec![0.0; mode.len()]]);
        let mut sum = Doubled::default();
        mode.iter().for_each(|mode| sum.add(1.0, *mode));
        let below = exact_difference(self.cavitation, ambient).product(sum.interval());
        let force = Interval { lower, upper }.times(self.pressure_unit()).plus(below);
        force.product(self.proved_spacing(0)).product(self.proved_spacing(1))
    }

    /// `z` on the face across `x` between two full cells.
    fn proved_wall(&self, certificate: &Certificate, pair: [usize; 2], unit: f64) -> Interval {
        let [k1, k2] = pair.map(|cell| self.proved_mobility(cell));
        let [z1, z2] = pair.map(|cell| {
            let [[lower, upper], _] = certificate.interval(cell);
            Interval { lower, upper }
        });
        let carried = exact_difference(self.gap[pair[0]], self.gap[pair[1]])
            .product(self.proved_spacing(0))
            .product(self.proved_drift(0))
            .product(Interval::exactly(unit).times(2.0).reciprocal());
        let sum = k1.product(z1).plus(k2.product(z2)).plus(carried);
        sum.product(k1.plus(k2).reciprocal())
    }

    fn proved_spacing(&self, axis: usize) -> Interval {
        Interval::ratio(self.lengths[axis], [self.nx, self.ny][axis] as f64)
    }

    fn proved_drift(&self, axis: usize) -> Interval {
        let drift = self.drift(axis);
        if drift == 0.0 {
            return Interval::exactly(0.0);
        }
        Interval { lower: drift.next_down(), upper: drift.next_up() }
    }

    /// h³/12μ.
    fn proved_mobility(&self, cell: usize) -> Interval {
        let gap = self.gap[cell];
        let viscosity = Interval::exactly(self.viscosity(cell)).times(12.0);
        Interval::exactly(gap).times(gap).times(gap).product(viscosity.reciprocal())
    }
}

fn exact_difference(a: f64, b: f64) -> Interval {
    Interval::exactly(a).minus(Interval::exactly(b))
}
