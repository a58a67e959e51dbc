use std::f64::consts::{PI, TAU};

use hlcp_methods::Clock;
use hlcp_verify::{Certificate, Film, FilmFigures, ProvedFigures, Refusal, Side};

use super::{Drive, Journal, Lobes, Pad};

/// Why nothing happens in a steady film.
///
/// ```
/// use hlcp::film::{Film, Idle};
///
/// let mut film = Film::new([2, 1], [0.04, 0.01], 0.0, 0.03);
/// assert_eq!(Idle::of(&film), Some(Idle::Even(0.0)));
/// film.speeds[0] = 2.0;
/// assert_eq!(Idle::of(&film), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Idle {
    /// The walls carry nothing and nothing enters or leaves: any even pressure is a solution.
    Closed,
    /// The walls are at rest and all pressures are this one, in Pa.
    Even(f64),
}

impl Idle {
    /// Returns the reason, if there is one.
    pub fn of(film: &Film) -> Option<Self> {
        if film.speeds.iter().sum::<f64>() != 0.0 {
            return None;
        }
        let of_side = |side: &Side| match side {
            Side::Pressure(pressure) => Some(*pressure),
            Side::Starved(_) => Some(film.cavitation),
            Side::Closed | Side::Periodic => None,
        };
        let supplies = film.supplies.iter().map(|supply| supply.pressure);
        let mut pressures = film.sides.iter().filter_map(of_side).chain(supplies);
        let Some(first) = pressures.next() else { return Some(Self::Closed) };
        let is_even = film.speeds == [0.0; 2] && pressures.all(|pressure| pressure == first);
        is_even.then_some(Self::Even(first))
    }
}

/// A film whose gap depends on the position of a wall: `gap + Σ position · mode`, in SI units.
///
/// ```
/// use hlcp::film::{Bearing, Film};
///
/// let pad = Bearing::pad(Film::new([20, 10], [0.02, 0.01], 3.0, 0.04));
/// let film = pad.at(&[1e-6, -2e-4, 0.0]).expect("the walls are apart");
/// assert!((film.gap[0] - (11e-6 + 0.0095 * 2e-4)).abs() < 1e-18);
/// assert!(pad.at(&[-1e-5, 0.0, 0.0]).is_none());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Bearing {
    /// The film at the position zero.
    pub film: Film,
    /// ∂h/∂position: of a journal its displacement along x = 0 and a quarter further; elsewhere
    /// rise, and slopes along x and y around the middle.
    pub modes: Vec<Vec<f64>>,
    /// Where the wall is, or where a search for its position begins.
    pub position: Vec<f64>,
    /// The pressure from which loads are counted, in Pa.
    pub ambient: f64,
    /// The journal, of a film around one.
    pub journal: Option<Journal>,
    /// The shape of a pad, where it is one of these.
    pub pad: Option<Pad>,
}

impl Bearing {
    /// Returns a journal in the middle of its bearing, in cells along `x` and `y`, at rest in a
    /// fluid of 1 Pa s.
    pub fn journal(journal: Journal, cells: [usize; 2]) -> Self {
        let lengths = journal.lengths();
        let mut film = Film::new(cells, lengths, 0.0, 1.0);
        (film.sides[0], film.sides[1]) = (Side::Periodic, Side::Periodic);
        let angle = |x: f64| x / (lengths[0] / TAU);
        let modes = vec![mode(&film, |x, _| angle(x).cos()), mode(&film, |x, _| angle(x).sin())];
        let [a, b] = journal.tilt;
        let film = film.with_gap(|x, y| {
            let (along, across) = (angle(x).cos(), angle(x).sin());
            journal.clearance * journal.bore(x) + (y - lengths[1] / 2.0) * (a * along + b * across)
        });
        Self {
            film,
            modes,
            position: vec![0.0; 2],
            ambient: 0.0,
            journal: Some(journal),
            pad: None,
        }
    }

    /// Returns a film whose upper wall may rise and turn around its middle.
    pub fn pad(film: Film) -> Self {
        let [lx, ly] = film.lengths;
        let slopes = [mode(&film, |x, _| x - lx / 2.0), mode(&film, |_, y| y - ly / 2.0)];
        let modes = [vec![1.0; film.gap.len()]].into_iter().chain(slopes).collect();
        Self { film, modes, position: vec![0.0; 3], ambient: 0.0, journal: None, pad: None }
    }

    /// Returns the film with the wall at a position; `None` if it meets the other one, where the
    /// shape is known also between the middles of cells.
    pub fn at(&self, position: &[f64]) -> Option<Film> {
        let is_clear = self.nearest(position).is_none_or(|[gap, _]| gap > 0.0);
        let gap = is_clear.then(|| self.gap(position))?;
        let is_open = gap.iter().all(|&gap| gap > 0.0 && gap.is_finite());
        is_open.then(|| Film { gap, ..self.film.clone() })
    }

    /// Returns the gap with the wall at a position, which is not positive where it meets the other
    /// one.
    pub fn gap(&self, position: &[f64]) -> Vec<f64> {
        let mut gap = self.film.gap.clone();
        for (mode, by) in self.modes.iter().zip(position) {
            gap.iter_mut().zip(mode).for_each(|(gap, mode)| *gap += by * mode);
        }
        gap
    }

    /// Returns the film with the wall where it is.
    pub fn here(&self) -> Option<Film> {
        self.at(&self.position)
    }

    /// Returns the least gap between walls of a known shape, in m, also between the middles of
    /// cells: of a journal between its bush and either of its ends, with the angle from x = 0 at
    /// which that is, and of a pad with the place along x. What pockets and roughness add is not in
    /// it.
    ///
    /// ```
    /// use hlcp::film::{Bearing, Journal, Lobes};
    ///
    /// // An elliptical bush, and a journal on its way to the middle of a lobe.
    /// let lobes = Some(Lobes { count: 2, preload: 0.5, offset: 0.5, middle: 0.0 });
    /// let journal = Journal { lobes, ..Journal::round(0.1, 0.05, 1e-4) };
    /// let bearing = Bearing::journal(journal, [9, 6]);
    /// let [gap, angle] = bearing.nearest(&[4e-5, 0.0]).expect("it is a journal");
    /// assert!((gap - 1e-5).abs() < 1e-18 && (angle - std::f64::consts::PI).abs() < 1e-12);
    /// ```
    pub fn nearest(&self, position: &[f64]) -> Option<[f64; 2]> {
        if let Some(pad) = self.pad {
            return Some(pad.nearest(self.film.lengths, position));
        }
        let Journal { clearance, tilt, lobes, .. } = self.journal?;
        let round = Lobes { count: 1, preload: 0.0, offset: 0.5, middle: 0.0 };
        let Lobes { count, preload, offset, middle } = lobes.unwrap_or(round);
        let arc = TAU / count as f64;
        let place = |k: usize| {
            let sign = if k.is_multiple_of(2) { 0.5 } else { -0.5 } * self.film.lengths[1];
            let start = middle + arc * ((k / 2) as f64 - 0.5);
            let (sin, cos) = (start + offset * arc).sin_cos();
            // The gap in a lobe is the clearance less this along the angle.
            let x = preload * clearance * cos - position[0] - sign * tilt[0];
            let y = preload * clearance * sin - position[1] - sign * tilt[1];
            let beyond = (y.atan2(x) - start).rem_euclid(TAU);
            let ends = if beyond <= arc { [beyond; 2] } else { [0.0, arc] };
            let gap = |at: f64| clearance - x * (start + at).cos() - y * (start + at).sin();
            let at = if gap(ends[1]) < gap(ends[0]) { ends[1] } else { ends[0] };
            [gap(at), (start + at).rem_euclid(TAU)]
        };
        (0..2 * count).map(place).min_by(|one, other| one[0].total_cmp(&other[0]))
    }

    /// Returns the forces of a pressure along the position's coordinates: of a journal those of the
    /// film on it, elsewhere the load and its moments.
    pub fn forces(&self, film: &Film, z: &[f64]) -> Vec<f64> {
        let p = film.pressures(z);
        let along = |mode: &Vec<f64>| {
            let terms = p.iter().zip(mode).map(|(p, mode)| (p - self.ambient) * mode);
            terms.sum::<f64>() * film.cell()
        };
        self.modes.iter().map(along).collect()
    }

    /// Returns the load and where it acts, along x and along y, of a film with these figures: of a
    /// journal the place that it is pressed to; NaN for the places of no load.
    pub fn load(&self, film: &Film, figures: &FilmFigures, z: &[f64]) -> [f64; 3] {
        let [lx, ly] = film.lengths;
        if self.journal.is_none() {
            let FilmFigures { load, moments: [along, across], .. } = *figures;
            return [load, lx / 2.0 + along / load, ly / 2.0 + across / load];
        }
        let forces = self.forces(film, z);
        let [one, other] = [forces[0], forces[1]];
        let (load, angle) = (one.hypot(other), other.atan2(one));
        if load == 0.0 {
            return [load, f64::NAN, f64::NAN];
        }
        let mut moment = 0.0;
        for (k, p) in film.pressures(z).iter().enumerate() {
            let along = self.modes[0][k] * angle.cos() + self.modes[1][k] * angle.sin();
            let y = ((k / film.nx) as f64 + 0.5) / film.ny as f64 * ly;
            moment += (p - self.ambient) * along * y * film.cell();
        }
        [load, lx / TAU * angle.rem_euclid(TAU), moment / load]
    }

    /// Returns of a journal the eccentricity over the clearance, and the attitude, in degrees, for
    /// a load that acts at `x`.
    pub fn attitude(&self, x: f64) -> Option<[f64; 2]> {
        let clearance = self.journal?.clearance;
        let [a, b] = [self.position[0], self.position[1]];
        let turn = (-b).atan2(-a) - x / (self.film.lengths[0] / TAU);
        let attitude = self.direction() * turn.sin().atan2(turn.cos()).to_degrees();
        Some([a.hypot(b) / clearance, attitude])
    }

    /// Returns 1 if the walls carry the oil along x, −1 if against.
    pub fn direction(&self) -> f64 {
        if self.film.speeds.iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 }
    }

    /// Returns the angular speed of a journal, in rad/s, that of its bearing added; of anything
    /// else what the walls' speeds are around its length.
    pub fn running_speed(&self) -> f64 {
        self.film.speeds.iter().sum::<f64>().abs() / (self.film.lengths[0] / TAU)
    }

    /// Returns the angle along x from which a journal's load comes, if x = 0 is so many degrees
    /// from the place opposite the load, in the direction of the motion.
    pub fn load_direction(&self, attitude: f64) -> f64 {
        PI - self.direction() * attitude.to_radians()
    }

    /// Returns what drives the wall by these numbers: to a position, or with a mass by a load.
    ///
    /// Of a journal they are along a load that comes from the angle `load`, and across it, a
    /// quarter further in the direction of the motion; of anything else what the position gains,
    /// or a force.
    ///
    /// ```
    /// use hlcp::film::{Bearing, Drive, Journal};
    ///
    /// let mut bearing = Bearing::journal(Journal::round(0.1, 0.05, 1e-4), [36, 6]);
    /// let load = bearing.load_direction(0.0);
    /// let Drive::To(position) = bearing.drive(load, &[3e-5, 2e-5], None) else { unreachable!() };
    /// assert!((position[0] - 3e-5).abs() < 1e-20 && (position[1] - 2e-5).abs() < 1e-20);
    /// bearing.position = position;
    /// let told = bearing.told(load);
    /// assert!((told[0] - 3e-5).abs() < 1e-20 && (told[1] - 2e-5).abs() < 1e-20);
    /// ```
    pub fn drive(&self, load: f64, numbers: &[f64], mass: Option<f64>) -> Drive {
        let turned = self.journal.map(|_| {
            let ((sin, cos), across) = (load.sin_cos(), self.direction() * numbers[1]);
            [numbers[0] * cos - across * sin, numbers[0] * sin + across * cos]
        });
        match (turned, mass) {
            (Some(load), Some(mass)) => Drive::Under { load: load.to_vec(), mass },
            // The gap widens on the other side.
            (Some(position), None) => Drive::To(position.map(|v| -v).to_vec()),
            (None, Some(mass)) => Drive::Under { load: numbers.to_vec(), mass },
            (None, None) => {
                let by = numbers.iter().copied().chain([0.0; 2]);
                Drive::To(self.position.iter().zip(by).map(|(at, by)| at + by).collect())
            }
        }
    }

    /// Returns the position: of a journal as [`drive`](Self::drive) takes it.
    pub fn told(&self, load: f64) -> Vec<f64> {
        if self.journal.is_none() {
            return self.position.clone();
        }
        let ((sin, cos), [a, b]) = (load.sin_cos(), [-self.position[0], -self.position[1]]);
        vec![a * cos + b * sin, self.direction() * (b * cos - a * sin)]
    }

    /// Returns the drag against the motion on the wall that moves the faster, and on the other one,
    /// from that on the lower wall against x and on the upper one along x.
    pub fn drag(&self, [lower, upper]: [f64; 2]) -> [f64; 2] {
        let [one, other] = self.film.speeds;
        let sign = |speed: f64| if speed < 0.0 { -1.0 } else { 1.0 };
        if one.abs() >= other.abs() {
            [lower, upper].map(|drag| drag * sign(one))
        } else {
            [upper, lower].map(|drag| -drag * sign(other))
        }
    }

    /// Returns the intervals of [`drag`](Self::drag), from those of the figures.
    pub fn proved_drag(&self, proved: &ProvedFigures) -> [[f64; 2]; 2] {
        let [one, other] = [0, 1].map(|end| self.drag(proved.friction.map(|drag| drag[end])));
        [0, 1].map(|wall| [one[wall].min(other[wall]), one[wall].max(other[wall])])
    }

    /// Returns the figures that a certificate of its film proves; of a journal the load is that of
    /// both directions.
    pub fn proved(&self, film: &Film, certificate: &Certificate) -> ProvedFigures {
        film.proved_figures(certificate, self.ambient, self.both_directions())
    }

    /// The modes of a journal's load.
    fn both_directions(&self) -> Option<[&[f64]; 2]> {
        match (self.journal, &self.modes[..]) {
            (Some(_), [one, other, ..]) => Some([one, other]),
            _ => None,
        }
    }

    /// Proves the figures of all films in this position whose gap, viscosity, speeds and supplies'
    /// pressures are, each as a whole, within `part` of those of its film, or says why it cannot.
    ///
    /// # Errors
    ///
    /// As [`Film::certify_range`].
    pub fn range(
        &self,
        part: f64,
        film: &Film,
        z: &[f64],
        r: &[f64],
    ) -> Result<Result<ProvedFigures, Refusal>, hlcp_core::Error> {
        let modes = self.both_directions();
        film.certify_range(part, [z, r], self.ambient, modes, &mut Clock::endless())
    }

    /// Returns the direction in which a rectangle is not in the film, if there is one; around a
    /// journal it may reach beyond the end.
    pub fn outside(&self, corner: [f64; 2], size: [f64; 2]) -> Option<usize> {
        (0..2).find(|&axis| {
            let (from, length) = (corner[axis], self.film.lengths[axis]);
            let turns = if axis == 0 && self.journal.is_some() { 2.0 } else { 1.0 };
            let (to, slack) = (from + size[axis], 1e-9 * length);
            !((-slack..=length + slack).contains(&from) && to <= turns * length + slack)
        })
    }
}

/// A value for each cell.
pub(super) fn mode(film: &Film, value: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    film.clone().with_gap(value).gap
}
