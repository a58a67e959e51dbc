use hlcp_core::{Error, FivePoint, Varying, check_orders};

use super::{Grids, check};
use gates::{Frame, Gate, Passage, Place};

mod derivatives;
mod figures;
mod gates;
mod proved;

pub use derivatives::{FilmChange, FilmSlopes};
pub use figures::FilmFigures;
pub use proved::ProvedFigures;

/// A lubricating film over a rectangle with mass-conserving cavitation, in SI units: an HLCP.
///
/// Where the oil fills the gap `h` it carries the pressure `p`; where it would have to pull, it
/// breaks up, and fills the part `θ = 1 − r` of the gap. Both obey one Reynolds equation,
///
/// ```text
/// ∇·(h³/12μ ∇p) = ū ∂x(θh) + ∂t(θh) ,    z = p − p_cav ≥ 0 ,    r ≥ 0 ,    z r = 0 ,
/// ```
///
/// with `ū` the mean of the two walls' speeds.
///
/// # The operators
///
/// `nx × ny` cells, `x` the fast index, each with a gap and a viscosity of its own. A row of
/// `A z − B r + q = 0` is the balance of a cell: what leaves it through its faces, and what it
/// stores. With `k = h³/12μ`, what flows along `x` from cell 1 to cell 2, by width, is
///
/// ```text
/// ū (1 − r) (h₁k₂ + h₂k₁)/(k₁ + k₂) − 2k₁k₂/(k₁ + k₂) (p₂ − p₁)/Δx ,    r of the cell upstream.
/// ```
///
/// That is exact in a full film, in one dimension, if the gap is constant in either cell and jumps
/// on the face: the conductance is the harmonic mean of the two half cells, and the gap that
/// carries is mostly that of the narrower cell. Where the gap is smooth it is of second order. To a
/// side, a groove or the edge of a supply it is half a cell with the gap of its one cell; but a
/// starved side lets oil in by the gap at its edge, as far as the first cells tell that.
///
/// A cell from which no wall carries oil away cannot break while oil flows into it; its entry of
/// `B`, which would be zero, is one. Where the `x` direction is periodic, a steady film loses the
/// part 10⁻¹⁴ of what each cell passes on: circles that nothing feeds run dry, which without a loss
/// were one of many steady films.
///
/// # Scaling
///
/// `z = 1` is [`pressure_unit`](Self::pressure_unit), and a row is in units of the flow that this
/// pressure drives through a square of the least gap.
///
/// # Theory
///
/// `A` is a symmetric M-matrix, singular unless a side or a supply has a pressure; `B` is an
/// M-matrix whose columns sum to zero or more. [`uniqueness`](crate::uniqueness()) finds the left
/// witness.
///
/// # Source
///
/// The complementarity form of the Jakobsson–Floberg–Olsson conditions is that of M. Giacopini, M.
/// Fowell, D. Dini and A. Strozzi, *A mass-conserving complementarity formulation to study
/// lubricant films in the presence of cavitation*, J. Tribology 132 (2010) 041702. The time step is
/// that of R. Ausas, M. Jai and G. Buscaglia, *A mass-conserving algorithm for dynamical
/// lubrication problems with cavitation*, J. Tribology 131 (2009) 031702.
///
/// ```
/// use hlcp_core::{Aor, Hlcp};
/// use hlcp_methods::{AmgNewton, Limits, Mms, Solver};
/// use hlcp_verify::{Film, Side};
///
/// // Rayleigh's step, 40 µm to 20 µm, under a wall that slides with 2 m/s; nothing leaves
/// // sideways.
/// let (nx, length) = (100, 0.02);
/// let ends = Side::Pressure(1e5);
/// let film = Film {
///     sides: [ends, ends, Side::Closed, Side::Closed],
///     gap: (0..nx).map(|i| if i < 70 { 40e-6 } else { 20e-6 }).collect(),
///     ..Film::new([nx, 1], [length, 0.01], 2.0, 0.04)
/// };
/// let (a, b, q) = film.pose()?;
/// let problem = Hlcp::from_pair(&a, &b)?;
/// let mut solver = Solver::new(AmgNewton::new(Mms::new(problem, Aor::gauss_seidel())?)?);
/// assert!(solver.solve(&q, Limits::default())?.converged());
///
/// let figures = film.figures(solver.z(), solver.r(), 1e5);
/// let rise = 6.0 * 0.04 * 2.0 * 0.014 * 0.006 * 20e-6 / (0.006 * 64e-15 + 0.014 * 8e-15);
/// assert!((figures.peak / (1e5 + rise) - 1.0).abs() < 1e-8);
/// assert!((figures.load / (rise * length * 0.01 / 2.0) - 1.0).abs() < 1e-8);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// The cells along `x`.
    pub nx: usize,
    /// The cells along `y`.
    pub ny: usize,
    /// The extents along `x` and `y`, in m.
    pub lengths: [f64; 2],
    /// The gap in each cell, in m.
    pub gap: Vec<f64>,
    /// The viscosity in each cell, or one for all, in Pa s.
    pub viscosity: Vec<f64>,
    /// The speeds along `x` of the lower and the upper wall, in m/s.
    pub speeds: [f64; 2],
    /// The sides in the west, east, south and north.
    pub sides: [Side; 4],
    /// Grooves and pockets at a pressure.
    pub supplies: Vec<Supply>,
    /// The pressure in a broken film, in Pa.
    pub cavitation: f64,
    /// The time step that ends in this position; `None` for a steady film.
    pub step: Option<TimeStep>,
}

/// What happens at a side of a [`Film`].
///
/// ```
/// use hlcp_verify::{Film, Side};
///
/// let mut ring = Film::new([40, 10], [0.1, 0.05], 2.0, 0.04);
/// ring.sides = [Side::Periodic, Side::Periodic, Side::Pressure(0.0), Side::Closed];
/// assert!(!ring.is_fed()); // it runs dry
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Side {
    /// A reservoir at a pressure in Pa.
    Pressure(f64),
    /// Nothing passes.
    Closed,
    /// The opposite side, which must be periodic as well.
    Periodic,
    /// Oil enters with this film content, between 0 and 1, at the cavitation pressure: it fills
    /// that part of the gap at the edge.
    Starved(f64),
}

/// A rectangle of a [`Film`] that is kept full at a pressure: a supply pocket, or a groove.
///
/// It consists of the cells whose centres it holds. A groove whose size along `x` is zero is the
/// nearest face between two columns. Supplies may overlap if they have one pressure; what flows is
/// then that of the first. No oil leaves by an end at a side of the film. Along a periodic
/// direction a rectangle may reach beyond the end.
///
/// ```
/// use hlcp_verify::Supply;
///
/// let groove = Supply { corner: [0.03, 0.0], size: [0.0, 0.05], pressure: 2e5 };
/// assert_eq!(groove.size[0], 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Supply {
    /// The smallest `x` and `y`, in m.
    pub corner: [f64; 2],
    /// The size along `x` and `y`, in m.
    pub size: [f64; 2],
    /// The pressure, in Pa.
    pub pressure: f64,
}

/// An implicit time step of a [`Film`].
///
/// ```
/// use hlcp_verify::TimeStep;
///
/// let from_full = |gap: &[f64]| TimeStep { duration: 1e-3, oil: gap.to_vec() };
/// assert_eq!(from_full(&[2e-5]).oil, [2e-5]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct TimeStep {
    /// Its length in s.
    pub duration: f64,
    /// The height `θh` of the oil in each cell before it, in m.
    pub oil: Vec<f64>,
}

/// What a cell of a steady ring loses of the oil that it passes on.
///
/// A circle that is broken all around would be solved by any amount of oil that goes round with the
/// wall, and its columns of `B` are singular; with a leak of 45 roundings it runs dry.
const LEAK: f64 = 1e-14;

impl Film {
    /// A film of 10 µm between a lower wall with this speed and an upper one at rest, all sides at
    /// pressure zero, which is that of cavitation.
    pub fn new([nx, ny]: [usize; 2], lengths: [f64; 2], speed: f64, viscosity: f64) -> Self {
        Self {
            nx,
            ny,
            lengths,
            gap: vec![1e-5; nx.saturating_mul(ny)],
            viscosity: vec![viscosity],
            speeds: [speed, 0.0],
            sides: [Side::Pressure(0.0); 4],
            supplies: vec![],
            cavitation: 0.0,
            step: None,
        }
    }

    /// Returns the film with this gap, in m, at the middle of each cell, whose place is in m.
    ///
    /// ```
    /// use hlcp_verify::Film;
    ///
    /// let wedge = Film::new([4, 1], [0.04, 0.01], 3.0, 0.04).with_gap(|x, _| 4e-5 - 5e-4 * x);
    /// assert!((wedge.gap[3] - 2.25e-5).abs() < 1e-20);
    /// ```
    pub fn with_gap(self, gap: impl Fn(f64, f64) -> f64) -> Self {
        let middle =
            |at: usize, count: usize, length: f64| (at as f64 + 0.5) / count as f64 * length;
        let cell = |k: usize| {
            let x = middle(k % self.nx, self.nx, self.lengths[0]);
            gap(x, middle(k / self.nx, self.ny, self.lengths[1]))
        };
        Self { gap: (0..self.gap.len()).map(cell).collect(), ..self }
    }

    /// `A`, `B` and `q`.
    ///
    /// # Errors
    ///
    /// [`Error::Grid`] for a grid without cells; [`Error::Order`] for a list that has not one entry
    /// for each cell; [`Error::NotPositive`] for a gap or a viscosity that is not positive and
    /// finite; [`Error::Parameter`] for an extent or a duration that is not, oil before a time step
    /// that is negative by more than a millionth of the gap, a speed that is not finite, a pressure
    /// below that of cavitation, a film content outside 0 to 1, one periodic side without the
    /// opposite one, two cells along a periodic direction, and a supply that is not in the film, or
    /// holds no cell.
    pub fn pose(&self) -> Result<Grids<f64>, Error> {
        self.pose_between(|_, z| z)
    }

    /// `A`, `B` and `q` between reservoirs whose `z` is another one.
    fn pose_between(&self, reservoir: impl Fn(Place, f64) -> f64) -> Result<Grids<f64>, Error> {
        self.check()?;
        let (n, frame) = (self.gap.len(), self.frame());
        // South, west, centre, east and north.
        let [mut a, mut b] = [(); 2].map(|()| [(); 5].map(|()| vec![0.0; n]));
        let mut q = vec![0.0; n];
        let [a_unit, b_unit] = [frame.pressure / frame.flow, 1.0 / frame.flow];
        self.gates(&frame, |axis, gate| {
            let Passage { conductance, carried } = self.passage(axis, gate);
            let (c, s) = (conductance * a_unit, carried * b_unit);
            let [back, on] = if axis == 0 { [1, 3] } else { [0, 4] };
            match gate {
                Gate::Between([low, high]) => {
                    a[2][low] += c;
                    a[2][high] += c;
                    a[on][low] -= c;
                    a[back][high] -= c;
                    if s >= 0.0 {
                        b[2][low] += s;
                        b[back][high] -= s;
                    } else {
                        b[2][high] -= s;
                        b[on][low] += s;
                    }
                    q[low] += s;
                    q[high] -= s;
                }
                Gate::Out { cell, z, content, place, .. } => {
                    a[2][cell] += c;
                    q[cell] -= c * reservoir(place, z);
                    if s > 0.0 {
                        b[2][cell] += s;
                        q[cell] += s;
                    } else {
                        q[cell] += s * content;
                    }
                }
            }
        });
        if let Some(TimeStep { duration, oil }) = &self.step {
            let rate = self.cell() / duration * b_unit;
            for k in 0..n {
                b[2][k] += rate * self.gap[k];
                q[k] += rate * (self.gap[k] - oil[k]);
            }
        }
        let is_ring = self.is_ring();
        for (k, q) in q.iter_mut().enumerate() {
            if is_ring {
                let leak = LEAK * b[2][k];
                b[2][k] += leak;
                *q += leak;
            }
            if let Some(supply) = frame.supply(&frame.cells, k) {
                (a[2][k], b[2][k]) = (1.0, 1.0);
                let z = self.z_of(&frame, self.supplies[supply].pressure);
                *q = -reservoir(Place::Supply(supply), z);
            } else if b[2][k] == 0.0 {
                b[2][k] = 1.0;
            }
        }
        let around = [0, 1].map(|axis| self.is_periodic(axis) && [self.nx, self.ny][axis] > 1);
        let grid = |lists: [Vec<f64>; 5]| {
            let directions = lists.map(|list| match list.iter().all(|&entry| entry == 0.0) {
                true => Varying::Uniform(0.0),
                false => Varying::Each(list),
            });
            FivePoint::new(self.nx, self.ny, directions)?.periodic(around)
        };
        Ok((grid(a)?, grid(b)?, q))
    }

    /// The pressure that `z = 1` stands for, in Pa: the largest one of sides and supplies above
    /// that of cavitation, or `12μūLx/h²` with the least gap, whichever is more.
    pub fn pressure_unit(&self) -> f64 {
        let sides = self.sides.iter().filter_map(|side| match side {
            Side::Pressure(pressure) => Some(*pressure),
            _ => None,
        });
        let given = sides.chain(self.supplies.iter().map(|supply| supply.pressure));
        let given = given.map(|pressure| pressure - self.cavitation).fold(0.0, f64::max);
        let thin = self.least_gap();
        let drawn =
            12.0 * self.viscosity[0] * self.drift(0).abs() * self.lengths[0] / (thin * thin);
        let unit = given.max(drawn);
        if unit > 0.0 { unit } else { 1.0 }
    }

    /// The area of a cell, in m².
    pub fn cell(&self) -> f64 {
        self.spacing(0) * self.spacing(1)
    }

    /// The pressures of a solution, in Pa.
    ///
    /// ```
    /// use hlcp_verify::{Film, Side};
    ///
    /// let film = Film {
    ///     sides: [Side::Pressure(3e5); 4],
    ///     cavitation: 1e5,
    ///     ..Film::new([2, 1], [1.0, 1.0], 0.0, 0.1)
    /// };
    /// assert_eq!(film.pressures(&[0.0, 1.0]), [1e5, 3e5]);
    /// ```
    pub fn pressures(&self, z: &[f64]) -> Vec<f64> {
        let unit = self.pressure_unit();
        z.iter().map(|z| self.cavitation + unit * z).collect()
    }

    /// Whether anything feeds the film: a pressure above that of cavitation somewhere, a wall that
    /// carries oil in, or oil that is there before a time step.
    ///
    /// A film that nothing feeds runs [`dry`](Self::dry).
    pub fn is_fed(&self) -> bool {
        let mut is_fed = self.step.is_some();
        self.gates(&self.frame(), |axis, gate| {
            if let Gate::Out { z, content, .. } = gate {
                let carried = self.passage(axis, gate).carried;
                is_fed |= z > 0.0 || carried < 0.0 && content > 0.0;
            }
        });
        is_fed
    }

    /// The `r` that is a steady answer with `z = 0` if nothing feeds the film: 1 but for cells from
    /// which no wall carries oil away, where it is 0.
    ///
    /// Before a closed side such cells make it one of many: any puddle that the wall holds against
    /// the side is another.
    ///
    /// ```
    /// use hlcp_verify::{Film, Side};
    ///
    /// let (closed, no_oil) = (Side::Closed, Side::Starved(0.0));
    /// let mut film = Film::new([3, 1], [0.03, 0.01], 2.0, 0.04);
    /// film.sides = [no_oil, no_oil, closed, closed];
    /// assert_eq!((film.is_fed(), film.dry()), (false, vec![1.0; 3]));
    /// film.sides[1] = closed;
    /// assert_eq!(film.dry(), [1.0, 1.0, 0.0]);
    /// ```
    pub fn dry(&self) -> Vec<f64> {
        let mut r = vec![0.0; self.gap.len()];
        self.gates(&self.frame(), |axis, gate| {
            let carried = self.passage(axis, gate).carried;
            match gate {
                Gate::Between([from, _]) if carried > 0.0 => r[from] = 1.0,
                Gate::Between([_, from]) if carried < 0.0 => r[from] = 1.0,
                Gate::Out { cell, .. } if carried > 0.0 => r[cell] = 1.0,
                _ => {}
            }
        });
        r
    }

    /// The cells that are not part of a supply, in order.
    ///
    /// ```
    /// use hlcp_verify::{Film, Supply};
    ///
    /// let mut film = Film::new([4, 1], [0.04, 0.01], 2.0, 0.04);
    /// film.supplies = vec![Supply { corner: [0.01, 0.0], size: [0.01, 0.01], pressure: 1e5 }];
    /// assert_eq!(film.free_cells(), [0, 2, 3]);
    /// ```
    pub fn free_cells(&self) -> Vec<usize> {
        let frame = self.frame();
        (0..self.gap.len()).filter(|&k| frame.supply(&frame.cells, k).is_none()).collect()
    }

    fn spacing(&self, axis: usize) -> f64 {
        self.lengths[axis] / [self.nx, self.ny][axis] as f64
    }

    /// The mean speed of the walls along an axis.
    fn drift(&self, axis: usize) -> f64 {
        if axis == 0 { f64::midpoint(self.speeds[0], self.speeds[1]) } else { 0.0 }
    }

    fn viscosity(&self, cell: usize) -> f64 {
        self.viscosity[cell.min(self.viscosity.len() - 1)]
    }

    fn least_gap(&self) -> f64 {
        self.gap.iter().copied().fold(f64::INFINITY, f64::min)
    }

    fn z_of(&self, frame: &Frame, pressure: f64) -> f64 {
        (pressure - self.cavitation) / frame.pressure
    }

    fn is_periodic(&self, axis: usize) -> bool {
        self.sides[2 * axis] == Side::Periodic
    }

    /// Whether oil may go round for ever.
    fn is_ring(&self) -> bool {
        self.is_periodic(0) && self.step.is_none()
    }

    /// h³/12μ.
    fn mobility(&self, cell: usize) -> f64 {
        self.gap[cell].powi(3) / (12.0 * self.viscosity(cell))
    }

    fn check(&self) -> Result<(), Error> {
        let n = self.nx.checked_mul(self.ny).filter(|&n| n > 0);
        let n = n.ok_or(Error::Grid { nx: self.nx, ny: self.ny })?;
        check_orders(n, &[("the gap", self.gap.len())])?;
        if self.viscosity.len() != 1 {
            check_orders(n, &[("the viscosity", self.viscosity.len())])?;
        }
        for (what, list) in [("gap", &self.gap), ("viscosity", &self.viscosity)] {
            let bad = list.iter().position(|&v| !(v > 0.0 && v.is_finite()));
            if let Some(index) = bad {
                return Err(Error::NotPositive { what, index, value: list[index] });
            }
        }
        for length in self.lengths {
            super::positive("an extent of the film", length)?;
        }
        for speed in self.speeds {
            check("a speed", speed, speed.is_finite(), "finite")?;
        }
        check("the cavitation pressure", self.cavitation, self.cavitation.is_finite(), "finite")?;
        let pressure = |pressure: f64| {
            let inside = pressure >= self.cavitation && pressure.is_finite();
            let range = "finite, and not below the cavitation pressure";
            check("a pressure in Pa", pressure, inside, range)
        };
        for side in self.sides {
            match side {
                Side::Pressure(value) => pressure(value)?,
                Side::Starved(content) => {
                    let inside = (0.0..=1.0).contains(&content);
                    check("the film content of a side", content, inside, "between 0 and 1")?;
                }
                Side::Closed | Side::Periodic => {}
            }
        }
        for pair in self.sides.chunks(2) {
            let count = pair.iter().filter(|side| **side == Side::Periodic).count();
            let name = "the number of periodic sides of a direction";
            check(name, count as f64, count != 1, "0 or 2")?;
        }
        let mut held: [Vec<Option<f64>>; 2] = Default::default();
        for supply in &self.supplies {
            pressure(supply.pressure)?;
            for axis in 0..2 {
                let ([from, size], length) =
                    ([supply.corner[axis], supply.size[axis]], self.lengths[axis]);
                let (slack, ends) = (1e-9 * length, from + size);
                let furthest = if self.is_periodic(axis) { 2.0 * length } else { length };
                let inside = (-slack..=length + slack).contains(&from)
                    && (0.0..=length + slack).contains(&size)
                    && ends <= furthest + slack;
                check("the place of a supply, in m,", from, inside, "such that it is in the film")?;
            }
            let (columns, rows) = self.covered(supply);
            let is_groove = supply.size[0] == 0.0 && !self.is_periodic(0);
            let inside = columns.len() * rows.len() > 0
                && !(is_groove && (columns[0] == 0 || columns[0] >= self.nx));
            let range = "1 or more: those whose middle it covers, or of a groove those beside it; \
                         make it wider, or take more cells";
            check("the number of cells of a supply", 0.0, inside, range)?;
            let held = &mut held[usize::from(supply.size[0] == 0.0)];
            held.resize(n, None);
            for cell in rows.iter().flat_map(|j| columns.iter().map(move |i| j * self.nx + i)) {
                let is_one = *held[cell].get_or_insert(supply.pressure) == supply.pressure;
                let name = "the pressure of a supply that overlaps another one";
                let range = "that of the other one; else move one of them";
                check(name, supply.pressure, is_one, range)?;
            }
        }
        if let Some(step) = &self.step {
            super::positive("the duration of a time step", step.duration)?;
            check_orders(n, &[("the oil", step.oil.len())])?;
            hlcp_core::all_finite("the oil", &step.oil)?;
            // An answer's content may lie below 0, by what its residual leaves.
            let negative = step.oil.iter().zip(&self.gap).find(|(oil, gap)| **oil < -1e-6 * **gap);
            let least = negative.map_or(0.0, |(oil, _)| *oil);
            check("the oil before a time step, in m,", least, least >= 0.0, "at least 0")?;
        }
        Ok(())
    }
}
