//! What is proved of a film's figures: intervals from outward arithmetic, all the way from the
//! numbers of the film and the certificate of its solution.

use hlcp_core::{Error, assert_lengths};
use hlcp_methods::Clock;

use super::{
    Film, Side, check,
    gates::{Gate, Place},
};
use crate::{
    Branch, Certificate, Refusal, certify_range,
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
/// let [lower, upper] = film.proved_figures(&certificate, 0.0, None).sides[1];
/// assert!(lower <= 1e-7 && 1e-7 <= upper && upper - lower < 1e-20);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ProvedFigures {
    /// The integral of the pressure above the ambient one, in N, or the length of the vector of two
    /// such integrals.
    pub load: [f64; 2],
    /// The drag on the lower wall against `x`, and on the upper wall along `x`, in N.
    pub friction: [[f64; 2]; 2],
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

    fn interval(&self) -> Interval {
        Interval { lower: self.lower.interval().lower, upper: self.upper.interval().upper }
    }
}

/// The ends, or infinite ones where something overflowed.
fn ends(Interval { lower, upper }: Interval) -> [f64; 2] {
    if lower <= upper { [lower, upper] } else { [f64::NEG_INFINITY, f64::INFINITY] }
}

/// How the films of a range differ from the one film that is posed.
///
/// With the gap `a`, the viscosity `m` and the speeds `s` times what they are, a row of a steady
/// film becomes `a³/m A z − s a (B r − c) − a³/m g`, with what the walls carry, `q = c − g`, and
/// what reservoirs press, `g`. With `λ = m s/a²` and `z = λ z′` that is `s a (A z′ − B r + c −
/// g/λ)`: the posed film at other pressures.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Drawing {
    /// λ
    ratio: Interval,
    tolerance: f64,
}

impl Drawing {
    const EXACT: Self = Self { ratio: Interval { lower: 1.0, upper: 1.0 }, tolerance: 0.0 };

    /// All factors within the tolerance of 1.
    fn factor(&self) -> Interval {
        around(1.0, self.tolerance)
    }

    /// The pressures of a reservoir above that of cavitation, over λ.
    fn above(&self, film: &Film, place: Place) -> Interval {
        let above = |pressures: Interval| pressures.minus(Interval::exactly(film.cavitation));
        let pressures = match place {
            Place::Supply(supply) => {
                let pressure = film.supplies[supply].pressure;
                above(around(pressure, self.tolerance * pressure.abs()))
            }
            Place::Side(side) => match film.sides[side] {
                Side::Pressure(pressure) => above(Interval::exactly(pressure)),
                _ => Interval::exactly(0.0),
            },
        };
        if *self == Self::EXACT {
            return pressures;
        }
        let Interval { lower, upper } = pressures.product(self.ratio.reciprocal());
        Interval { lower: lower.max(0.0), upper }
    }
}

/// The numbers within `off` of `value`.
fn around(value: f64, off: f64) -> Interval {
    if off == 0.0 {
        return Interval::exactly(value);
    }
    Interval { lower: (value - off).next_down(), upper: (value + off).next_up() }
}

impl ProvedFigures {
    /// Intervals that hold those of both.
    fn hull(self, other: Self) -> Self {
        let hull = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), larger(a[1], b[1])];
        Self {
            load: hull(self.load, other.load),
            friction: [0, 1].map(|wall| hull(self.friction[wall], other.friction[wall])),
            sides: [0, 1, 2, 3].map(|side| hull(self.sides[side], other.sides[side])),
            supplies: self.supplies.iter().zip(other.supplies).map(|(a, b)| hull(*a, b)).collect(),
            peak: hull(self.peak, other.peak),
        }
    }
}

impl Film {
    /// Encloses the figures of a solution of each of the films that are this one with the whole gap
    /// times one factor within `tolerance` of 1, the viscosity times one, both speeds times one and
    /// each supply's pressure times one. `(z, r)` is about the solution of this film. Where
    /// [`uniqueness`](crate::uniqueness()) is proved of its operators each film has one solution.
    ///
    /// No factor changes the shape of the gap. Lengths, contents, and the pressures of sides and of
    /// cavitation are as they are. Meant is the film as it was posed, with the roundings of that,
    /// scaled exactly. `ambient` and `modes` are those of [`proved_figures`](Self::proved_figures).
    ///
    /// # Cost
    ///
    /// Eight solves; two where no reservoir is above the pressure of cavitation. The intervals of
    /// loads and peaks are then as narrow as they can be. Flows next to reservoirs far above it are
    /// differences of uncertain pressures, and their intervals grow with the number of cells.
    ///
    /// # Errors
    ///
    /// As [`pose`](Self::pose); [`Error::Parameter`] for a tolerance outside 0 to 0.5, for a film
    /// with a time step, and as [`certify`](crate::certify).
    ///
    /// # Panics
    ///
    /// Unless both modes have an entry for each cell.
    ///
    /// ```
    /// use hlcp_methods::Clock;
    /// use hlcp_verify::{Film, Side};
    ///
    /// // A wedge between closed sides, of which all pressures grow with μU/h².
    /// let ends = Side::Pressure(0.0);
    /// let film = Film {
    ///     gap: vec![40e-6, 30e-6, 20e-6],
    ///     sides: [ends, ends, Side::Closed, Side::Closed],
    ///     ..Film::new([3, 1], [0.03, 0.01], 2.0, 0.04)
    /// };
    /// let (a, b, q) = film.pose()?;
    /// let solution = hlcp_methods::solve(&a, &b, &q)?;
    /// let (near, clock) = ([&solution.z[..], &solution.r], &mut Clock::endless());
    /// let range = film.certify_range(1e-2, near, 0.0, None, clock)?;
    /// let [lower, upper] = range.expect("a Z-pair").load;
    /// let load = film.figures(&solution.z, &solution.r, 0.0).load;
    /// let [least, most] = [0.99 / 1.01, 1.01 / 0.99].map(|ratio: f64| load * ratio * ratio);
    /// assert!((lower / least - 1.0).abs() < 1e-9 && (upper / most - 1.0).abs() < 1e-9);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn certify_range(
        &self,
        tolerance: f64,
        [z, r]: [&[f64]; 2],
        ambient: f64,
        modes: Option<[&[f64]; 2]>,
        clock: &mut Clock<'_>,
    ) -> Result<Result<ProvedFigures, Refusal>, Error> {
        /// Parts of the range of λ. A reservoir's pressure does not grow with λ, so that each part
        /// is too wide by the width of its own λ, at either end.
        const PARTS: usize = 4;
        check("the tolerance of data", tolerance, (0.0..=0.5).contains(&tolerance), "0 to 0.5")?;
        let steps = f64::from(u8::from(self.step.is_some()));
        check("the number of time steps of a range", steps, steps == 0.0, "0")?;
        let (a, b, _) = self.pose()?;
        let ends = Drawing { ratio: Interval::exactly(1.0), tolerance }.factor();
        let [low, high] = [Interval::exactly(ends.lower), Interval::exactly(ends.upper)];
        let [up, down] = [[high, low], [low, high]].map(|[one, other]| {
            let ratio = one.product(other.reciprocal());
            ratio.product(ratio)
        });
        let mut is_pressed = false;
        self.gates(&self.frame(), |_, gate| {
            is_pressed |= matches!(gate, Gate::Out { z, .. } if z > 0.0);
        });
        let parts = if is_pressed && tolerance > 0.0 { PARTS } else { 1 };
        let between = |k: usize| {
            let along = k as f64 / parts as f64;
            if k == parts { up.upper } else { down.lower + along * (up.upper - down.lower) }
        };
        let mut found = vec![];
        for k in 0..parts {
            let ratio = Interval { lower: between(k), upper: between(k + 1) };
            let drawing = Drawing { ratio, tolerance };
            let unit = Interval::exactly(self.pressure_unit()).reciprocal();
            let [most, least] = [true, false].map(|is_most| {
                let posed = self.pose_between(|place, _| {
                    let Interval { lower, upper } = drawing.above(self, place).product(unit);
                    if is_most { upper } else { lower.max(0.0) }
                });
                posed.map(|(.., q)| q)
            });
            let (most, least) = (most?, least?);
            match certify_range([&a, &a], [&b, &b], [&most, &least], [z, r], clock)? {
                Ok(certificate) => {
                    found.push(self.proved(&certificate, &drawing, ambient, modes));
                }
                Err(refusal) => return Ok(Err(refusal)),
            }
        }
        Ok(Ok(found.into_iter().reduce(ProvedFigures::hull).expect("a part")))
    }

    /// Encloses the figures of the solution that `certificate` proves, which is one of the
    /// operators of [`pose`](Self::pose); the load is counted from the pressure `ambient`.
    ///
    /// With two modes it is the length of the vector of the forces `∫ (p − ambient) mode`: of a
    /// journal, whose modes are the cosine and the sine around it.
    ///
    /// # Panics
    ///
    /// Unless the certificate has an unknown for each cell of a film that `pose` accepts, and both
    /// modes an entry.
    ///
    /// ```
    /// use hlcp_verify::{Film, Side, certify};
    ///
    /// let plain = Film::new([1, 1], [2.0; 2], 0.0, 1.0);
    /// let film = Film { sides: [Side::Pressure(3.0); 4], ..plain };
    /// let (a, b, q) = film.pose()?;
    /// let certificate = certify(&a, &b, &q, &[1.0], &[0.0])?.expect("a witness");
    /// let modes: [&[f64]; 2] = [&[0.6], &[0.8]];
    /// let [lower, upper] = film.proved_figures(&certificate, 0.0, Some(modes)).load;
    /// assert!(lower <= 12.0 && 12.0 <= upper && upper - lower < 1e-12);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn proved_figures(
        &self,
        certificate: &Certificate,
        ambient: f64,
        modes: Option<[&[f64]; 2]>,
    ) -> ProvedFigures {
        self.proved(certificate, &Drawing::EXACT, ambient, modes)
    }

    /// The figures of all films of a drawing, where `z` of the certificate is z′.
    fn proved(
        &self,
        certificate: &Certificate,
        drawing: &Drawing,
        ambient: f64,
        modes: Option<[&[f64]; 2]>,
    ) -> ProvedFigures {
        assert_lengths(self.gap.len(), [("certificate.sides", certificate.sides.len())]);
        let frame = self.frame();
        let unit = Interval::exactly(frame.pressure).reciprocal();
        let mut sides = [Total::default(); 4];
        let mut supplies = vec![Total::default(); self.supplies.len()];
        // Of ∫ h p′/2 in units of z and of half a width: the coefficients of z, and the rest.
        let mut turning = vec![Interval::exactly(0.0); self.gap.len()];
        let mut turned = Total::default();
        // In units of z.
        let mut peak = Interval::exactly(0.0);
        for k in 0..self.gap.len() {
            let [[low, high], _] = certificate.interval(k);
            peak = Interval { lower: peak.lower.max(low), upper: larger(peak.upper, high) };
        }
        self.gates(&frame, |axis, gate| match gate {
            Gate::Out { cell, outward, content, place, .. } => {
                let (total, sign) = match place {
                    Place::Side(side) => (&mut sides[side], 1.0),
                    Place::Supply(supply) => (&mut supplies[supply], -1.0),
                };
                let beyond = drawing.above(self, place);
                let [z, r] = of(certificate, cell);
                let fall = z.times(frame.pressure).minus(beyond);
                let leaves = outward * self.drift(axis) > 0.0;
                let content = if leaves {
                    Interval::exactly(1.0).minus(r)
                } else {
                    Interval::exactly(content)
                };
                let width = self.proved_spacing(1 - axis);
                let conductance = self.proved_mobility(cell).times(2.0).product(width);
                let [near, next, third] = (self.at_end(axis, cell, outward, place))
                    .map(|(cell, part)| Interval::exactly(self.gap[cell]).times(outward * part));
                let gap = near.plus(next).plus(third);
                let carried = width.product(gap).product(self.proved_drift(axis));
                let driven = conductance.product(self.proved_spacing(axis).reciprocal());
                total.add(carried.product(content).plus(driven.product(fall)).times(sign));
                if axis == 0 {
                    let gap = outward * self.gap[cell];
                    turning[cell] = turning[cell].minus(Interval::exactly(gap));
                    turned.add(beyond.product(unit).times(gap));
                }
            }
            Gate::Between(pair) if axis == 0 => {
                let branches = pair.map(|cell| certificate.sides[cell]);
                let wall = self.proved_wall(certificate, pair, frame.pressure);
                if branches.iter().all(|&branch| branch != Branch::R) {
                    peak.upper = larger(peak.upper, wall.upper);
                    // r = 0 is proved of both, so that the face counts.
                    if branches == [Branch::Z; 2] {
                        peak.lower = peak.lower.max(wall.lower);
                    }
                }
                let [h1, h2] = pair.map(|cell| self.gap[cell]);
                let step = exact_difference(h1, h2);
                turning[pair[0]] = turning[pair[0]].minus(Interval::exactly(h1));
                turning[pair[1]] = turning[pair[1]].plus(Interval::exactly(h2));
                if branches == [Branch::Z; 2] && wall.lower >= 0.0 {
                    // Term by term, because the z of neighbours cancel.
                    let [k1, k2] = pair.map(|cell| self.proved_mobility(cell));
                    let part = step.product(k1.plus(k2).reciprocal());
                    turning[pair[0]] = turning[pair[0]].plus(part.product(k1));
                    turning[pair[1]] = turning[pair[1]].plus(part.product(k2));
                    turned.add(part.product(self.proved_push(certificate, pair, frame.pressure)));
                } else {
                    // 0 between cells of which both may be broken.
                    let is_full = branches.contains(&Branch::Z);
                    let is_broken = branches == [Branch::R; 2];
                    let lower = if is_full { wall.lower.max(0.0) } else { 0.0 };
                    let upper = if is_broken { 0.0 } else { larger(wall.upper, 0.0) };
                    turned.add(step.product(Interval { lower, upper }));
                }
            }
            Gate::Between(_) => {}
        });
        let factor = drawing.factor();
        let flow = |total: &Total| ends(total.interval().product(factor).product(factor));
        let peak = peak.times(frame.pressure).product(drawing.ratio);
        let force = |mode: &[f64]| self.proved_force(certificate, drawing, ambient, mode);
        ProvedFigures {
            load: ends(match modes {
                None => force(&vec![1.0; self.gap.len()]),
                Some(modes) => length(modes.map(force)),
            }),
            friction: self.proved_friction(certificate, drawing, &turning, turned),
            sides: sides.each_ref().map(flow),
            supplies: supplies.iter().map(flow).collect(),
            peak: ends(peak.plus(Interval::exactly(self.cavitation))),
        }
    }

    /// The drag on the walls, from the coefficients of ∫ h p′/2 and the rest of it.
    fn proved_friction(
        &self,
        certificate: &Certificate,
        drawing: &Drawing,
        turning: &[Interval],
        mut turned: Total,
    ) -> [[f64; 2]; 2] {
        let area = self.proved_spacing(0).product(self.proved_spacing(1));
        let slip = exact_difference(self.speeds[0], self.speeds[1]);
        let mut sheared = Total::default();
        for (k, turning) in turning.iter().enumerate() {
            let [z, r] = of(certificate, k);
            turned.add(turning.product(z));
            let content = Interval::exactly(1.0).minus(r);
            sheared.add(Interval::ratio(self.viscosity(k), self.gap[k]).product(content));
        }
        let sheared = sheared.interval().product(slip).product(area);
        let half = self.proved_spacing(1).times(0.5).times(self.pressure_unit());
        let turned = turned.interval().product(half);
        // m s/a, by either of two ways to it.
        let factor = drawing.factor();
        let [one, other] =
            [factor.product(drawing.ratio), factor.product(factor).product(factor.reciprocal())];
        let factor =
            Interval { lower: one.lower.max(other.lower), upper: one.upper.min(other.upper) };
        [sheared.plus(turned), sheared.minus(turned)].map(|drag| ends(drag.product(factor)))
    }

    fn proved_force(
        &self,
        certificate: &Certificate,
        drawing: &Drawing,
        ambient: f64,
        mode: &[f64],
    ) -> Interval {
        let [lower, upper] = certificate.functional([mode, &vec![0.0; mode.len()]]);
        let mut sum = Doubled::default();
        mode.iter().for_each(|mode| sum.add(1.0, *mode));
        let below = exact_difference(self.cavitation, ambient).product(sum.interval());
        let force = Interval { lower, upper }.times(self.pressure_unit()).product(drawing.ratio);
        let force = force.plus(below);
        force.product(self.proved_spacing(0)).product(self.proved_spacing(1))
    }

    /// `z` on the face across `x` between two cells, unless both are broken or it is below 0.
    fn proved_wall(&self, certificate: &Certificate, pair: [usize; 2], unit: f64) -> Interval {
        let [k1, k2] = pair.map(|cell| self.proved_mobility(cell));
        let [z1, z2] = pair.map(|cell| of(certificate, cell)[0]);
        let push = self.proved_push(certificate, pair, unit);
        let sum = k1.product(z1).plus(k2.product(z2)).plus(push);
        sum.product(k1.plus(k2).reciprocal())
    }

    /// What the wall carries to a face less what it carries off, in units of a mobility.
    fn proved_push(&self, certificate: &Certificate, pair: [usize; 2], unit: f64) -> Interval {
        let [r1, r2] = pair.map(|cell| of(certificate, cell)[1]);
        let [h1, h2] = pair.map(|cell| self.gap[cell]);
        let step = exact_difference(h1, h2).minus(r1.times(h1)).plus(r2.times(h2));
        step.product(self.proved_spacing(0))
            .product(self.proved_drift(0))
            .product(Interval::exactly(unit).times(2.0).reciprocal())
    }

    fn proved_spacing(&self, axis: usize) -> Interval {
        Interval::ratio(self.lengths[axis], [self.nx, self.ny][axis] as f64)
    }

    fn proved_drift(&self, axis: usize) -> Interval {
        let drift = self.drift(axis);
        // A mean is rounded.
        if drift == 0.0 { Interval::exactly(0.0) } else { Interval::ratio(drift, 1.0) }
    }

    /// h³/12μ.
    fn proved_mobility(&self, cell: usize) -> Interval {
        let gap = self.gap[cell];
        let viscosity = Interval::exactly(self.viscosity(cell)).times(12.0);
        Interval::exactly(gap).times(gap).times(gap).product(viscosity.reciprocal())
    }
}

/// The intervals of `z` and `r` in a cell.
fn of(certificate: &Certificate, cell: usize) -> [Interval; 2] {
    certificate.interval(cell).map(|[lower, upper]| Interval { lower, upper })
}

fn exact_difference(a: f64, b: f64) -> Interval {
    Interval::exactly(a).minus(Interval::exactly(b))
}

fn length(forces: [Interval; 2]) -> Interval {
    let squares = forces.map(|force| {
        let [low, high] = [force.mignitude(), force.magnitude()].map(Interval::exactly);
        Interval { lower: low.product(low).lower, upper: high.product(high).upper }
    });
    let Interval { lower, upper } = squares[0].plus(squares[1]);
    // A square root is rounded like any other operation.
    let lower = lower.max(0.0).sqrt().next_down().max(0.0);
    Interval { lower, upper: upper.sqrt().next_up() }
}
