use hlcp_core::{Coefficients, Diagonal, Error, FivePointView, LinearOperator, Rows};

use super::check;

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
/// side, a groove or the edge of a supply it is half a cell with the gap of its one cell.
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
/// M-matrix whose columns sum to zero or more. [`certify`](crate::certify) finds the sum witness.
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
/// use hlcp_core::{Aor, Hlcp, Omega};
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
/// let problem = Hlcp::new(&a, &b, Omega::diagonal_ratio(1.0, &a, &b)?)?;
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
    /// Oil enters with this film content, between 0 and 1, at the cavitation pressure.
    Starved(f64),
}

/// A rectangle of a [`Film`] that is kept full at a pressure: a supply pocket, or a groove.
///
/// It consists of the cells whose centres it holds. A groove whose size along `x` is zero is the
/// nearest face between two columns. Of supplies that overlap the first one counts. Along a
/// periodic direction a rectangle may reach beyond the end.
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

/// What a [`Film`] does, in SI units.
///
/// ```
/// use hlcp_verify::Film;
///
/// let film = Film::new([2, 1], [0.02, 0.01], 3.0, 0.04);
/// let figures = film.figures(&[0.0; 2], &[0.0; 2], 0.0);
/// // μU/h on both walls
/// assert!((figures.friction[0] - 0.04 * 3.0 / 1e-5 * 2e-4).abs() < 1e-12);
/// assert_eq!((figures.load, figures.friction[1]), (0.0, figures.friction[0]));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFigures {
    /// The integral of the pressure above the ambient one, in N.
    pub load: f64,
    /// Its moments `∫ p (x − Lx/2)` and `∫ p (y − Ly/2)`, in N m.
    pub moments: [f64; 2],
    /// The drag on the lower wall against `x`, and on the upper wall along `x`, if the lower one is
    /// the faster, in N: of shear stress, in a broken film on the part `θ` that oil covers.
    pub friction: [f64; 2],
    /// The power that moves the walls, in W.
    pub power: f64,
    /// What flows out in the west, east, south and north, in m³/s.
    pub sides: [f64; 4],
    /// What each supply delivers, in m³/s.
    pub supplies: Vec<f64>,
    /// What a time step adds to the oil in the film, in m³/s.
    pub stored: f64,
    /// The sum of what flows out and what is stored less what is supplied, in m³/s.
    pub imbalance: f64,
    /// The largest pressure, in Pa: of the cells, and of the faces between full cells.
    pub peak: f64,
    /// The least gap, in m.
    pub least_gap: f64,
    /// The part of the area in which the film is broken.
    pub broken_share: f64,
}

/// What a cell of a steady ring loses of the oil that it passes on.
///
/// A circle that is broken all around would be solved by any amount of oil that goes round with the
/// wall, and its columns of `B` are singular; with a leak of 45 roundings it runs dry.
const LEAK: f64 = 1e-14;

/// Where oil passes between cells, or out of one.
#[derive(Debug, Clone, Copy)]
enum Gate {
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

#[derive(Debug, Clone, Copy)]
enum Place {
    Side(usize),
    Supply(usize),
}

/// The conductance and the carried flow of a gate, or their derivatives.
#[derive(Debug, Clone, Copy)]
struct Passage {
    conductance: f64,
    carried: f64,
}

/// What is found once for all gates.
struct Frame {
    /// The supply at each cell and at the west face of each cell, counted from 1; empty without
    /// any.
    cells: Vec<u32>,
    faces: Vec<u32>,
    /// The units of `z`, in Pa, and of a row, in m³/s.
    pressure: f64,
    flow: f64,
}

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

    /// `A`, `B` and `q`.
    ///
    /// # Errors
    ///
    /// [`Error::Grid`] for a grid without cells; [`Error::Order`] for a list that has not one entry
    /// for each cell; [`Error::NotPositive`] for a gap or a viscosity that is not positive and
    /// finite; [`Error::Parameter`] for an extent or a duration that is not, a speed that is not
    /// finite, a pressure below that of cavitation, a film content outside 0 to 1, one periodic
    /// side without the opposite one, and a supply that is not in the film, or holds no cell.
    pub fn pose(&self) -> Result<(FilmOperator, FilmOperator, Vec<f64>), Error> {
        self.check()?;
        let (n, frame) = (self.gap.len(), self.frame());
        let mut a = FilmOperator::zeros(self);
        let mut b = FilmOperator::zeros(self);
        let mut q = vec![0.0; n];
        let [a_unit, b_unit] = [frame.pressure / frame.flow, 1.0 / frame.flow];
        self.gates(&frame, |axis, gate| {
            let Passage { conductance, carried } = self.passage(axis, gate);
            let (c, s) = (conductance * a_unit, carried * b_unit);
            let [back, on] = if axis == 0 { [1, 3] } else { [0, 4] };
            match gate {
                Gate::Between([low, high]) => {
                    a.each[2][low] += c;
                    a.each[2][high] += c;
                    a.each[on][low] -= c;
                    a.each[back][high] -= c;
                    if s >= 0.0 {
                        b.each[2][low] += s;
                        b.each[back][high] -= s;
                    } else {
                        b.each[2][high] -= s;
                        b.each[on][low] += s;
                    }
                    q[low] += s;
                    q[high] -= s;
                }
                Gate::Out { cell, z, content, .. } => {
                    a.each[2][cell] += c;
                    q[cell] -= c * z;
                    if s > 0.0 {
                        b.each[2][cell] += s;
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
                b.each[2][k] += rate * self.gap[k];
                q[k] += rate * (self.gap[k] - oil[k]);
            }
        }
        let is_ring = self.is_periodic(0) && self.step.is_none();
        for (k, q) in q.iter_mut().enumerate() {
            if is_ring {
                let leak = LEAK * b.each[2][k];
                b.each[2][k] += leak;
                *q += leak;
            }
            if let Some(supply) = frame.supply(&frame.cells, k) {
                (a.each[2][k], b.each[2][k]) = (1.0, 1.0);
                *q = -self.z_of(&frame, self.supplies[supply].pressure);
            } else if b.each[2][k] == 0.0 {
                b.each[2][k] = 1.0;
            }
        }
        Ok((a, b, q))
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
    /// A film that nothing feeds runs dry: `z = 0`, `r = 1` is its steady answer.
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

    /// What a solution amounts to; the load is counted from the pressure `ambient`.
    ///
    /// # Panics
    ///
    /// Unless `z` and `r` have an entry for each cell of a film that [`pose`](Self::pose) accepts.
    pub fn figures(&self, z: &[f64], r: &[f64], ambient: f64) -> FilmFigures {
        assert_eq!([z.len(), r.len()], [self.gap.len(); 2], "an entry for each cell");
        let frame = self.frame();
        let (nx, area, unit) = (self.nx, self.cell(), frame.pressure);
        let [mut load, mut power, mut broken] = [0.0; 3];
        let (mut moments, mut friction) = ([0.0; 2], [0.0; 2]);
        let slip = self.speeds[0] - self.speeds[1];
        let mut peak = 0.0_f64;
        for k in 0..z.len() {
            let p = (self.cavitation - ambient + unit * z[k]) * area;
            load += p;
            moments[0] += p * self.spacing(0) * ((k % nx) as f64 + 0.5 - nx as f64 / 2.0);
            moments[1] += p * self.spacing(1) * ((k / nx) as f64 + 0.5 - self.ny as f64 / 2.0);
            let shear = self.viscosity(k) * slip * (1.0 - r[k]) / self.gap[k] * area;
            friction.iter_mut().for_each(|friction| *friction += shear);
            peak = peak.max(unit * z[k]);
            if r[k] > 0.0 {
                broken += 1.0 / z.len() as f64;
            }
        }
        let (mut sides, mut supplies) = ([0.0; 4], vec![0.0; self.supplies.len()]);
        self.gates(&frame, |axis, gate| {
            let flow = self.flow(&frame, axis, gate, z, r);
            match gate {
                Gate::Out { place: Place::Side(side), .. } => sides[side] += flow,
                Gate::Out { place: Place::Supply(supply), .. } => supplies[supply] -= flow,
                Gate::Between(_) => {}
            }
            if axis == 0 {
                // Both halves of ∫ h p′/2, over the half cells that meet at the face.
                let wall = self.wall_pressure(&frame, gate, z, r);
                let width = self.spacing(1) / 2.0;
                let ends: &[(usize, f64)] = &match gate {
                    Gate::Between([low, high]) => [(low, 1.0), (high, -1.0)],
                    Gate::Out { cell, outward, .. } => [(cell, outward), (cell, 0.0)],
                };
                let mut turned = 0.0;
                for &(cell, sign) in ends {
                    turned += sign * width * self.gap[cell] * (wall - z[cell]) * unit;
                }
                friction[0] += turned;
                friction[1] -= turned;
                if let Gate::Between([low, high]) = gate
                    && r[low] <= 0.0
                    && r[high] <= 0.0
                {
                    peak = peak.max(unit * wall);
                }
            }
        });
        power += friction[0] * self.speeds[0] - friction[1] * self.speeds[1];
        let stored = self.step.as_ref().map_or(0.0, |TimeStep { duration, oil }| {
            let gained = |k: usize| (1.0 - r[k]) * self.gap[k] - oil[k];
            let cells = (0..z.len()).filter(|&k| frame.supply(&frame.cells, k).is_none());
            cells.map(gained).sum::<f64>() * area / duration
        });
        FilmFigures {
            load,
            moments,
            friction,
            power,
            imbalance: sides.iter().sum::<f64>() + stored - supplies.iter().sum::<f64>(),
            sides,
            supplies,
            stored,
            peak: self.cavitation + peak,
            least_gap: self.least_gap(),
            broken_share: broken,
        }
    }

    /// What leaves each cell through its faces, in m³/s.
    ///
    /// A time step that takes it from the oil, `θh ← θh − Δt/area · outflow`, and leaves the
    /// residual of its solve to the next one, keeps the oil in balance to rounding over any number
    /// of steps.
    ///
    /// # Panics
    ///
    /// As [`figures`](Self::figures).
    ///
    /// ```
    /// use hlcp_verify::Film;
    ///
    /// // Nothing but the wall carries: what enters each cell leaves it.
    /// let film = Film::new([3, 1], [0.03, 0.01], 2.0, 0.04);
    /// assert!(film.outflow(&[0.0; 3], &[0.0; 3]).iter().all(|flow| flow.abs() < 1e-20));
    /// ```
    pub fn outflow(&self, z: &[f64], r: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; z.len()];
        let frame = self.frame();
        self.gates(&frame, |axis, gate| {
            let flow = self.flow(&frame, axis, gate, z, r);
            match gate {
                Gate::Between([low, high]) => {
                    out[low] += flow;
                    out[high] -= flow;
                }
                Gate::Out { cell, .. } => out[cell] += flow,
            }
        });
        out
    }

    /// Bounds the error of the flow through each side and supply, in m³/s, by errors of `z` and
    /// `r`.
    ///
    /// # Panics
    ///
    /// As [`figures`](Self::figures).
    ///
    /// ```
    /// use hlcp_verify::Film;
    ///
    /// let film = Film::new([3, 1], [0.03, 0.01], 2.0, 0.04);
    /// // the wall carries 10 µm · 10 mm · 1 m/s
    /// assert!((film.flow_bound(&[0.0; 3], &[1e-3; 3]) - 1e-10).abs() < 1e-20);
    /// ```
    pub fn flow_bound(&self, z: &[f64], r: &[f64]) -> f64 {
        let frame = self.frame();
        let mut bounds = vec![0.0; 4 + self.supplies.len()];
        self.gates(&frame, |axis, gate| {
            if let Gate::Out { cell, place, .. } = gate {
                let Passage { conductance, carried } = self.passage(axis, gate);
                let place = match place {
                    Place::Side(side) => side,
                    Place::Supply(supply) => 4 + supply,
                };
                let error = carried.max(0.0) * r[cell] + conductance * frame.pressure * z[cell];
                bounds[place] += error;
            }
        });
        bounds.into_iter().fold(0.0, f64::max)
    }

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

    /// The change of `A z − B r + q` for a gap that changes with this speed, in m/s, while the film
    /// content stays: what the wall pushes out.
    ///
    /// # Panics
    ///
    /// As [`widening`](Self::widening).
    ///
    /// ```
    /// use hlcp_verify::Film;
    ///
    /// let film = Film::new([2, 1], [0.02, 0.01], 3.0, 0.04);
    /// let push = film.squeeze(&[0.0, 0.25], &[-1e-3; 2]);
    /// assert!(push[0] < 0.0 && (push[1] / push[0] - 0.75).abs() < 1e-15);
    /// ```
    pub fn squeeze(&self, r: &[f64], speed: &[f64]) -> Vec<f64> {
        assert_eq!(speed.len(), r.len(), "an entry for each cell");
        let frame = self.frame();
        let rate = self.cell() / frame.flow;
        let push = |k: usize| match frame.supply(&frame.cells, k) {
            Some(_) => 0.0,
            None => rate * (1.0 - r[k]) * speed[k],
        };
        (0..r.len()).map(push).collect()
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

    /// h³/12μ.
    fn mobility(&self, cell: usize) -> f64 {
        self.gap[cell].powi(3) / (12.0 * self.viscosity(cell))
    }

    /// Calls `visit` with the axis of each gate and the gate.
    fn gates(&self, frame: &Frame, mut visit: impl FnMut(usize, Gate)) {
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
        let out = |cell: usize, outward: f64, supply: usize| {
            let z = self.z_of(frame, self.supplies[supply].pressure);
            Gate::Out { cell, outward, z, content: 1.0, place: Place::Supply(supply) }
        };
        let [low, high] = pair.map(|cell| frame.supply(&frame.cells, cell));
        let groove = if axis == 0 { frame.supply(&frame.faces, pair[1]) } else { None };
        if let (Some(_), Some(_)) = (low, high) {
            return;
        }
        match (low.or(groove), high.or(groove)) {
            (None, None) => visit(axis, Gate::Between(pair)),
            (beyond_high, beyond_low) => {
                if let (Some(supply), None) = (beyond_low, low) {
                    visit(axis, out(pair[0], 1.0, supply));
                }
                if let (Some(supply), None) = (beyond_high, high) {
                    visit(axis, out(pair[1], -1.0, supply));
                }
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
    fn passage(&self, axis: usize, gate: Gate) -> Passage {
        let [conductance, carried] = self.of_passage(
            axis,
            match gate {
                Gate::Between(pair) => {
                    let ([k1, k2], [h1, h2]) =
                        (pair.map(|c| self.mobility(c)), pair.map(|c| self.gap[c]));
                    [2.0 * k1 * k2 / (k1 + k2), (h1 * k2 + h2 * k1) / (k1 + k2)]
                }
                Gate::Out { cell, outward, .. } => {
                    [2.0 * self.mobility(cell), outward * self.gap[cell]]
                }
            },
        );
        Passage { conductance, carried }
    }

    /// The change of [`passage`](Self::passage) with the gap.
    fn passage_change(&self, axis: usize, gate: Gate, change: &[f64]) -> Passage {
        let mobility_change =
            |cell: usize| 3.0 * self.mobility(cell) / self.gap[cell] * change[cell];
        let [conductance, carried] = self.of_passage(
            axis,
            match gate {
                Gate::Between(pair) => {
                    let ([k1, k2], [h1, h2]) =
                        (pair.map(|c| self.mobility(c)), pair.map(|c| self.gap[c]));
                    let ([dk1, dk2], [dh1, dh2]) =
                        (pair.map(mobility_change), pair.map(|c| change[c]));
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
            },
        );
        Passage { conductance, carried }
    }

    /// Mobility and gap of a gate, times the width of its face, over the distance of two cells and
    /// times the drift.
    fn of_passage(&self, axis: usize, [mobility, gap]: [f64; 2]) -> [f64; 2] {
        let width = self.spacing(1 - axis);
        [mobility * width / self.spacing(axis), gap * width * self.drift(axis)]
    }

    /// What flows along the axis between two cells, or out of one, in m³/s.
    fn flow(&self, frame: &Frame, axis: usize, gate: Gate, z: &[f64], r: &[f64]) -> f64 {
        self.through(gate, self.passage(axis, gate), frame.pressure, z, r)
    }

    /// What flows through a gate with this passage.
    fn through(&self, gate: Gate, passage: Passage, unit: f64, z: &[f64], r: &[f64]) -> f64 {
        let (content, fall) = match gate {
            Gate::Between([low, high]) => {
                let upstream = if self.drift(0) >= 0.0 { low } else { high };
                (1.0 - r[upstream], z[low] - z[high])
            }
            Gate::Out { cell, outward, z: beyond, content, .. } => {
                let leaves = outward * self.drift(0) > 0.0;
                (if leaves { 1.0 - r[cell] } else { content }, z[cell] - beyond)
            }
        };
        passage.carried * content + passage.conductance * unit * fall
    }

    /// `z` on a face across `x`.
    fn wall_pressure(&self, frame: &Frame, gate: Gate, z: &[f64], r: &[f64]) -> f64 {
        match gate {
            Gate::Out { z, .. } => z,
            Gate::Between([low, high]) if z[low] <= 0.0 && z[high] <= 0.0 => 0.0,
            Gate::Between(pair) => {
                // What leaves the one half cell enters the other.
                let unit = self.spacing(0) * self.drift(0) / (2.0 * frame.pressure);
                let [k1, k2] = pair.map(|cell| self.mobility(cell));
                let [s1, s2] = pair.map(|cell| (1.0 - r[cell]) * self.gap[cell] * unit);
                ((k1 * z[pair[0]] + k2 * z[pair[1]] + s1 - s2) / (k1 + k2)).max(0.0)
            }
        }
    }

    fn frame(&self) -> Frame {
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

    /// The columns and rows of a supply.
    fn covered(&self, supply: &Supply) -> (Vec<usize>, Vec<usize>) {
        let inside = |axis: usize| -> Vec<usize> {
            let (count, length) = ([self.nx, self.ny][axis], self.lengths[axis]);
            let is_inside = |at: &usize| {
                let middle = (*at as f64 + 0.5) * self.spacing(axis);
                let turns: &[f64] = if self.is_periodic(axis) { &[-1.0, 0.0, 1.0] } else { &[0.0] };
                turns.iter().any(|turn| {
                    let along = middle + turn * length - supply.corner[axis];
                    (0.0..=supply.size[axis]).contains(&along)
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

    fn check(&self) -> Result<(), Error> {
        let n = self.nx.checked_mul(self.ny).filter(|&n| n > 0);
        let expected = n.ok_or(Error::Grid { nx: self.nx, ny: self.ny })?;
        let order = |what, found: usize| {
            if found == expected { Ok(()) } else { Err(Error::Order { what, found, expected }) }
        };
        order("the gap", self.gap.len())?;
        if self.viscosity.len() != 1 {
            order("the viscosity", self.viscosity.len())?;
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
            check("a pressure", pressure, inside, "finite, and not below the cavitation pressure")
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
        for axis in 0..2 {
            let periodic = self.sides[2 * axis..][..2].iter().filter(|s| **s == Side::Periodic);
            let count = periodic.count();
            let name = "the number of periodic sides of a direction";
            check(name, count as f64, count != 1, "0 or 2")?;
        }
        for supply in &self.supplies {
            pressure(supply.pressure)?;
            for axis in 0..2 {
                let ([from, size], length) =
                    ([supply.corner[axis], supply.size[axis]], self.lengths[axis]);
                let (slack, ends) = (1e-9 * length, from + size);
                let furthest = if self.is_periodic(axis) { 2.0 * length } else { length };
                let starts =
                    from >= -slack && from <= length && size >= 0.0 && size <= length + slack;
                let inside = starts && ends <= furthest + slack;
                check("the place of a supply, in m,", from, inside, "such that it is in the film")?;
            }
            let (columns, rows) = self.covered(supply);
            let is_groove = supply.size[0] == 0.0 && !self.is_periodic(0);
            let held = columns.len() * rows.len();
            let inside = held > 0 && !(is_groove && (columns[0] == 0 || columns[0] >= self.nx));
            let range =
                "more: a groove lies between two cells, another supply holds a cell's middle";
            check("the number of cells of a supply", 0.0, inside, range)?;
        }
        if let Some(step) = &self.step {
            super::positive("the duration of a time step", step.duration)?;
            order("the oil", step.oil.len())?;
            hlcp_core::all_finite("the oil", &step.oil)?;
        }
        Ok(())
    }
}

impl Frame {
    /// The supply that a list has at a cell.
    fn supply(&self, list: &[u32], cell: usize) -> Option<usize> {
        list.get(cell).and_then(|&number| (number as usize).checked_sub(1))
    }
}

/// An operator of a [`Film`]: of five points, the directions joined where sides are periodic.
///
/// ```
/// use hlcp_core::{LinearOperator, Rows};
/// use hlcp_verify::{Film, Side};
///
/// let mut ring = Film::new([4, 1], [0.04, 0.01], 2.0, 0.05);
/// ring.sides[0] = Side::Periodic;
/// ring.sides[1] = Side::Periodic;
/// let (_, b, _) = ring.pose()?;
/// let mut row = vec![];
/// b.visit_row(0, &mut |j, _| row.push(j));
/// assert_eq!(row, [0, 3]);
/// assert!(b.as_five_point().is_none());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FilmOperator {
    nx: usize,
    ny: usize,
    periodic: [bool; 2],
    /// South, west, centre, east and north; zero where they lead outside the grid.
    each: [Vec<f64>; 5],
}

impl FilmOperator {
    fn zeros(film: &Film) -> Self {
        let (nx, ny) = (film.nx, film.ny);
        let periodic = [0, 1].map(|axis| film.is_periodic(axis));
        Self { nx, ny, periodic, each: [(); 5].map(|()| vec![0.0; nx * ny]) }
    }

    /// Visits the entries of row `k` by increasing column.
    #[inline(always)]
    fn visit(&self, k: usize, mut visit: impl FnMut(usize, f64)) {
        if self.periodic == [false; 2] {
            // They are in order, and zero where they lead outside.
            let columns = [k.wrapping_sub(self.nx), k.wrapping_sub(1), k, k + 1, k + self.nx];
            for (column, each) in columns.into_iter().zip(&self.each) {
                let entry = each[k];
                if entry != 0.0 {
                    visit(column, entry);
                }
            }
        } else {
            let (row, count) = self.row(k);
            row[..count].iter().for_each(|&(j, a)| visit(j, a));
        }
    }

    /// The entries of row `k` by increasing column, and how many there are.
    fn row(&self, k: usize) -> ([(usize, f64); 5], usize) {
        let (nx, n) = (self.nx, self.each[2].len());
        let i = k % nx;
        let last = n - nx;
        let columns = [
            if k >= nx { k - nx } else { k + last },
            if i > 0 { k - 1 } else { k + nx - 1 },
            k,
            if i + 1 < nx { k + 1 } else { k + 1 - nx },
            if k < last { k + nx } else { k - last },
        ];
        let (mut row, mut count) = ([(0, 0.0); 5], 0);
        for (column, each) in columns.into_iter().zip(&self.each) {
            let entry = each[k];
            if entry == 0.0 {
                continue;
            }
            // Sorted in, and added to what is there: a ring of two cells meets itself twice.
            let at = row[..count].iter().position(|&(j, _)| j >= column).unwrap_or(count);
            if at < count && row[at].0 == column {
                row[at].1 += entry;
            } else {
                row.copy_within(at..count, at + 1);
                row[at] = (column, entry);
                count += 1;
            }
        }
        (row, count)
    }
}

impl LinearOperator<f64> for FilmOperator {
    fn order(&self) -> usize {
        self.each[2].len()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        let n = self.each[2].len();
        assert_eq!([x.len(), y.len()], [n; 2], "vectors of the operator's order");
        for (k, y) in y.iter_mut().enumerate() {
            let mut sum = 0.0;
            self.visit(k, |j, a| sum += a * x[j]);
            *y = sum;
        }
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, f64>> {
        if self.periodic != [false; 2] {
            return None;
        }
        let each = self.each.each_ref().map(|each| Coefficients::Each(each));
        Some(FivePointView::new(self.nx, self.ny, each))
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, f64)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl Diagonal<f64> for FilmOperator {
    fn diagonal_entry(&self, i: usize) -> f64 {
        self.each[2][i]
    }
}

impl Rows<f64> for FilmOperator {
    fn visit_row(&self, k: usize, visit: &mut dyn FnMut(usize, f64)) {
        self.visit(k, visit);
    }
}
