use hlcp_core::assert_lengths;

use super::{
    Film, TimeStep,
    gates::{Frame, Gate, Passage, Place},
};

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
/// // All but one cell is full, but for rounding.
/// assert_eq!(film.figures(&[0.0; 2], &[0.7, 1e-12], 0.0).broken_share, 0.5);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FilmFigures {
    /// The integral of the pressure above the ambient one, in N.
    pub load: f64,
    /// Its moments `∫ p (x − Lx/2)` and `∫ p (y − Ly/2)`, in N m.
    pub moments: [f64; 2],
    /// The drag on the lower wall against `x`, and on the upper wall along `x`, if the lower one is
    /// the faster, in N: of shear stress, in a broken film on the part `θ` that oil covers.
    pub friction: [f64; 2],
    /// The drag if a broken film were sheared all over, as most handbooks count it.
    pub full_friction: [f64; 2],
    /// The power that slides the walls, in W; what moves them apart or together is not in it.
    pub power: f64,
    /// What flows out in the west, east, south and north, in m³/s, less what flows in there.
    pub sides: [f64; 4],
    /// The same without what flows in elsewhere on that side.
    pub leaks: [f64; 4],
    /// What each supply delivers, in m³/s.
    pub supplies: Vec<f64>,
    /// What a time step adds to the oil in the film, in m³/s.
    pub stored: f64,
    /// The sum of what flows out and what is stored less what is supplied, in m³/s.
    pub imbalance: f64,
    /// The largest pressure, in Pa: of the cells, and of the faces between full cells.
    pub peak: f64,
    /// The least gap in the middle of a cell, in m.
    pub least_gap: f64,
    /// The part of the area in which the film is broken: lacks more of its oil than rounding takes.
    pub broken_share: f64,
    /// The least film content, which is below 0 in an answer that is no film.
    pub least_content: f64,
    /// Of a steady film that is periodic along `x`, what enters through sides and from supplies
    /// over what goes round in circles that are broken somewhere; infinite without any.
    ///
    /// What enters and leaves settles the content of a broken circle. A solve to 10⁻¹² of what
    /// flows leaves some 10⁻¹² over this ratio of it open.
    pub feed: f64,
    /// The imbalance over what the peak, or 10⁻⁴ of [`pressure_unit`](Film::pressure_unit) if that
    /// is more, drives through a square of the least gap.
    pub off_balance: f64,
}

/// The feed below which a [`doubt`](FilmFigures::doubt) is raised, where some 10⁻⁴ of the content
/// are unsettled; the content below 0 that is more than rounding; and the part off balance below
/// which the pressures of 630 films, drawn with parts up to 3·10⁵ times as deep as the least gap,
/// are off by 5·10⁻⁵ at most.
const FED: f64 = 2e-8;
const NO_CONTENT: f64 = -1e-9;
const OFF_BALANCE: f64 = 3e-4;

/// A cell that lacks no more of its oil is full but for rounding.
const WHOLE: f64 = 1e-9;

impl FilmFigures {
    /// Returns what makes the figures uncertain although the solve converged: circles that are
    /// hardly fed, a film content below 0, or parts so deep that rounding in what flows there is as
    /// much as what flows elsewhere.
    ///
    /// ```
    /// use hlcp_verify::Film;
    ///
    /// let film = Film::new([2, 1], [0.02, 0.01], 3.0, 0.04);
    /// assert_eq!(film.figures(&[0.0; 2], &[0.0; 2], 0.0).doubt(), None);
    /// let doubt = film.figures(&[0.0; 2], &[0.5, 1.25], 0.0).doubt();
    /// assert!(doubt.expect("a content of −0.25").contains("-2.5e-1"));
    /// ```
    pub fn doubt(&self) -> Option<String> {
        let (feed, least, off) = (self.feed, self.least_content, self.off_balance);
        let why = if least < NO_CONTENT {
            format!("the film content falls to {least:.1e}, below 0")
        } else if feed < FED {
            format!("only {feed:.0e} of the oil that goes round enters the film")
        } else {
            return (off > OFF_BALANCE).then(|| {
                format!(
                    "what flows in and out differs by {off:.0e} of what the peak drives through the \
                     least gap, because the film has parts too deep for double precision; load, \
                     moments, friction, power, flows and peak are uncertain; make no part deeper \
                     than some hundred times the least gap, which changes pressures little"
                )
            });
        };
        Some(format!(
            "{why}, so rounding settles the film content; load, moments, friction, power, flows \
             and peak are uncertain, only the gap is not, and what is certified holds for the \
             coefficients as they were rounded; feed the film more, by a supply, a groove or the \
             pressure around it"
        ))
    }
}

impl Film {
    /// What a solution amounts to; the load is counted from the pressure `ambient`.
    ///
    /// # Panics
    ///
    /// Unless `z` and `r` have an entry for each cell of a film that [`pose`](Self::pose) accepts.
    pub fn figures(&self, z: &[f64], r: &[f64], ambient: f64) -> FilmFigures {
        assert_lengths(self.gap.len(), [("z", z.len()), ("r", r.len())]);
        let frame = self.frame();
        let (nx, area, unit) = (self.nx, self.cell(), frame.pressure);
        let [mut load, mut power] = [0.0; 2];
        let (mut moments, mut friction, mut void) = ([0.0; 2], [0.0; 2], 0.0);
        let slip = self.speeds[0] - self.speeds[1];
        let mut peak = z.iter().fold(0.0, |peak: f64, z| peak.max(unit * z));
        // Of each circle the most that goes round.
        let mut circles = vec![0.0_f64; self.ny];
        let (mut enters, mut full) = (0.0, 0.0_f64);
        for k in 0..z.len() {
            let p = (self.cavitation - ambient + unit * z[k]) * area;
            load += p;
            moments[0] += p * self.spacing(0) * ((k % nx) as f64 + 0.5 - nx as f64 / 2.0);
            moments[1] += p * self.spacing(1) * ((k / nx) as f64 + 0.5 - self.ny as f64 / 2.0);
            let shear = self.viscosity(k) * slip / self.gap[k] * area;
            friction.iter_mut().for_each(|friction| *friction += shear * (1.0 - r[k]));
            void += shear * r[k];
        }
        let ([mut sides, mut leaks], mut supplies) =
            ([[0.0; 4]; 2], vec![0.0; self.supplies.len()]);
        self.gates(&frame, |axis, gate| {
            let passage = self.passage(axis, gate);
            let flow = self.through(gate, passage, frame.pressure, z, r);
            match gate {
                Gate::Out { place, .. } => {
                    enters += (-flow).max(0.0);
                    match place {
                        Place::Side(side) => {
                            sides[side] += flow;
                            leaks[side] += flow.max(0.0);
                        }
                        Place::Supply(supply) => supplies[supply] -= flow,
                    }
                }
                Gate::Between([low, _]) if axis == 0 => {
                    circles[low / nx] = circles[low / nx].max(flow.abs());
                    full = full.max(passage.carried.abs());
                }
                Gate::Between(_) => {}
            }
            if axis == 0 {
                // Both halves of ∫ h p′/2, over the half cells that meet at the face.
                let wall = self.wall_pressure(&frame, gate, z, r);
                let width = self.spacing(1) / 2.0;
                let mut turned = 0.0;
                for (cell, sign) in gate.halves() {
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
        let broken = r.chunks(nx).map(|circle| circle.iter().any(|&r| r > 0.0));
        let round: f64 = circles.iter().zip(broken).filter(|of| of.1).map(|of| of.0).sum();
        power += friction[0] * self.speeds[0] - friction[1] * self.speeds[1];
        let stored = self.step.as_ref().map_or(0.0, |TimeStep { duration, oil }| {
            let gained = |k: usize| (1.0 - r[k]) * self.gap[k] - oil[k];
            let cells = (0..z.len()).filter(|&k| frame.supply(&frame.cells, k).is_none());
            cells.map(gained).sum::<f64>() * area / duration
        });
        let imbalance = sides.iter().sum::<f64>() + stored - supplies.iter().sum::<f64>();
        FilmFigures {
            load,
            moments,
            friction,
            full_friction: friction.map(|friction| friction + void),
            power,
            imbalance,
            off_balance: imbalance.abs() / (frame.flow * (peak / unit).max(1e-4)),
            sides,
            leaks,
            supplies,
            stored,
            peak: self.cavitation + peak,
            least_gap: self.least_gap(),
            broken_share: r.iter().filter(|&&r| r > WHOLE).count() as f64 / z.len() as f64,
            least_content: r.iter().fold(f64::INFINITY, |least, r| least.min(1.0 - r)),
            // Of a dry film rounding goes round.
            feed: if self.is_ring() && round > 1e-9 * full {
                enters / round
            } else {
                f64::INFINITY
            },
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
            let passage = self.passage(axis, gate);
            gate.pass(self.through(gate, passage, frame.pressure, z, r), &mut out);
        });
        out
    }

    /// What flows along the axis through a gate with this passage, in m³/s.
    pub(super) fn through(
        &self,
        gate: Gate,
        passage: Passage,
        unit: f64,
        z: &[f64],
        r: &[f64],
    ) -> f64 {
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
    pub(super) fn wall_pressure(&self, frame: &Frame, gate: Gate, z: &[f64], r: &[f64]) -> f64 {
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
}
