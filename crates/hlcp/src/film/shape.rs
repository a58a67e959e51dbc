use std::f64::consts::{PI, TAU};

use hlcp_core::Error;
use hlcp_verify::{Film, Side, Supply};

/// A journal in a bearing, in SI units: x runs around it, from its widest gap if that is where the
/// eccentricity points to.
///
/// ```
/// use hlcp::film::{Bearing, Journal};
///
/// let journal = Journal::round(0.1, 0.05, 1e-4);
/// let bearing = Bearing { position: vec![5e-5, 0.0], ..Bearing::journal(journal, [36, 6]) };
/// let film = bearing.here().expect("half of the clearance is left");
/// assert!(film.gap.iter().all(|gap| (5e-5..1.5e-4).contains(gap)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Journal {
    /// The diameter, in m.
    pub diameter: f64,
    /// The length of the bearing, in m.
    pub length: f64,
    /// The radial clearance, in m.
    pub clearance: f64,
    /// How the eccentricity grows along y, along x = 0 and a quarter further.
    pub tilt: [f64; 2],
    /// The arcs of a bush that is not round.
    pub lobes: Option<Lobes>,
}

impl Journal {
    /// Returns a journal of this diameter, length and clearance in a round bush, without a tilt.
    pub fn round(diameter: f64, length: f64, clearance: f64) -> Self {
        Self { diameter, length, clearance, tilt: [0.0; 2], lobes: None }
    }

    /// Returns the extents of the film along x and y, in m.
    pub fn lengths(&self) -> [f64; 2] {
        [PI * self.diameter, self.length]
    }

    /// Returns the least eccentricity at which the walls meet, without a tilt.
    pub(super) fn reach(&self) -> f64 {
        self.clearance * self.lobes.map_or(1.0, |lobes| 1.0 - lobes.preload)
    }

    /// Returns the gap over the clearance at x, with the journal in the middle.
    pub(super) fn bore(&self, x: f64) -> f64 {
        self.lobes.map_or(1.0, |lobes| lobes.gap(x / (self.diameter / 2.0)))
    }

    /// Returns a groove around an angle from x = 0, so wide, both in degrees, and so long, in m, in
    /// the middle of the bearing; without a width it is a line.
    ///
    /// ```
    /// use hlcp::film::Journal;
    ///
    /// let round = Journal::round(0.1, 0.06, 1e-4);
    /// let groove = round.groove(0.0, [20.0, 0.04], 1e5);
    /// assert!((groove.corner[0] - 350.0 / 360.0 * round.lengths()[0]).abs() < 1e-15);
    /// assert!((groove.corner[1] - 0.01).abs() < 1e-15);
    /// ```
    pub fn groove(&self, angle: f64, [width, length]: [f64; 2], pressure: f64) -> Supply {
        let [corner, size] = self.patch([angle - width / 2.0, width], length);
        Supply { corner, size, pressure }
    }

    /// Returns the pocket of a pressure dam from one angle to another, in degrees in the direction
    /// of x, so long, in m, in the middle of the bearing, and so deep.
    pub fn dam(&self, [from, to]: [f64; 2], length: f64, depth: f64) -> Pocket {
        let [corner, size] = self.patch([from, to - from], length);
        Pocket { corner, size, depth, ellipse: false }
    }

    /// The corner and the size of a rectangle from an angle on, in degrees, in the middle.
    fn patch(&self, [from, arc]: [f64; 2], length: f64) -> [[f64; 2]; 2] {
        let [around, along] = self.lengths();
        let corner = [(from / 360.0).rem_euclid(1.0) * around, (along - length) / 2.0];
        [corner, [arc / 360.0 * around, length]]
    }
}

/// Arcs that a bush is made of, each with the radius of the journal and its clearance around a
/// centre of its own, one after the other along x.
///
/// | bearing | count | offset |
/// |---|---|---|
/// | elliptical (lemon bore) | 2 | ½ |
/// | three lobes, four lobes | 3, 4 | ½ |
/// | offset halves | 2 | 1 |
///
/// ```
/// use hlcp::film::Lobes;
///
/// let ellipse = Lobes { count: 2, preload: 0.75, offset: 0.5, middle: 0.0 };
/// assert_eq!(ellipse.gap(0.0), 0.25);
/// assert!((ellipse.gap(std::f64::consts::FRAC_PI_2) - 1.0).abs() < 1e-15);
/// assert!(Lobes { preload: 1.0, ..ellipse }.check().is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobes {
    /// How many there are.
    pub count: usize,
    /// How far their centres are from the middle, over the clearance (preload): around a journal
    /// in the middle the least gap is `1 − preload` clearances.
    pub preload: f64,
    /// Where a lobe is narrowest, from 0 where it begins to 1 where it ends.
    pub offset: f64,
    /// The angle of the middle of one of them from x = 0, in rad.
    pub middle: f64,
}

impl Lobes {
    /// Refuses arcs that are no bush.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for no lobe, a preload of 1 or more, and an offset outside of the lobe.
    pub fn check(&self) -> Result<(), Error> {
        let Self { count, preload, offset, middle } = *self;
        let wrong = |name, value, range| Err(Error::Parameter { name, value, range });
        if count == 0 {
            wrong("the number of lobes", 0.0, "1 or more")
        } else if !(0.0..1.0).contains(&preload) {
            let range = "from 0 to below 1, where lobes meet the journal";
            wrong("the preload of the lobes", preload, range)
        } else if !(0.0..=1.0).contains(&offset) {
            let range = "from 0 to 1; beyond, a lobe would be narrowest in the next one";
            wrong("the offset of the lobes", offset, range)
        } else if !middle.is_finite() {
            wrong("the middle of a lobe", middle, "a finite angle")
        } else {
            Ok(())
        }
    }

    /// Returns the gap over the clearance at an angle from x = 0, in rad, with the journal in the
    /// middle.
    pub fn gap(&self, angle: f64) -> f64 {
        let arc = TAU / self.count as f64;
        let along = (angle - self.middle + arc / 2.0).rem_euclid(arc);
        1.0 - self.preload * (along - self.offset * arc).cos()
    }
}

/// The gap of a pad without texture, in SI units.
///
/// ```
/// use hlcp::film::{Film, Pad};
///
/// let film = Film::new([2, 1], [4.0, 1.0], 2.0, 0.03);
/// assert_eq!(Pad::Plane([4.0, 2.0]).gap(film.clone()).gap, [3.5, 2.5]);
/// let middle = Pad::Parabola { least: 1.0, radius: 2.0, at: None };
/// assert_eq!(middle.gap(film).gap, [1.25; 2]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pad {
    /// The gaps at the ends of `x`.
    Plane([f64; 2]),
    /// A parabola along `x`.
    Parabola {
        /// The least gap.
        least: f64,
        /// The radius of curvature.
        radius: f64,
        /// The place of the least gap; the middle without one.
        at: Option<f64>,
    },
    /// A taper and a land: the gaps at the ends of the taper, and how long it is along `x`.
    Taper([f64; 2], f64),
}

impl Pad {
    /// Returns the film with this gap.
    pub fn gap(self, film: Film) -> Film {
        let lx = film.lengths[0];
        film.with_gap(|x, _| self.height(x, lx))
    }

    /// The gap at `x` of a film of this length.
    fn height(self, x: f64, lx: f64) -> f64 {
        match self {
            Self::Plane([west, east]) => west + (east - west) * x / lx,
            Self::Parabola { least, radius, at } => {
                least + (x - at.unwrap_or(lx / 2.0)).powi(2) / (2.0 * radius)
            }
            Self::Taper([west, land], length) => land + (west - land) * (1.0 - x / length).max(0.0),
        }
    }

    /// The least gap over a film of these lengths, with the wall at a position, and its `x`.
    pub(super) fn nearest(self, [lx, ly]: [f64; 2], position: &[f64]) -> [f64; 2] {
        let [rise, along, across] = [0, 1, 2].map(|k| position.get(k).copied().unwrap_or(0.0));
        // Where the slope changes, or is 0.
        let between = match self {
            Self::Plane(_) => 0.0,
            Self::Parabola { radius, at, .. } => at.unwrap_or(lx / 2.0) - radius * along,
            Self::Taper(_, length) => length,
        };
        let gap = |x: f64| {
            [self.height(x, lx) + rise + along * (x - lx / 2.0) - across.abs() * ly / 2.0, x]
        };
        let places = [0.0, between.clamp(0.0, lx), lx].map(gap);
        places.into_iter().min_by(|one, other| one[0].total_cmp(&other[0])).expect("three places")
    }
}

/// A rectangle, or the ellipse in it, by which a gap is deeper, in SI units.
///
/// ```
/// use hlcp::film::{Film, Pocket};
///
/// let mut film = Film::new([4, 1], [0.04, 0.01], 2.0, 0.03);
/// let half = Pocket { corner: [0.01, 0.0], size: [0.005, 0.01], depth: 4e-6, ellipse: false };
/// assert!(half.dig(&mut film));
/// assert_eq!(film.gap, [1e-5, 1.2e-5, 1e-5, 1e-5]);
/// let places = half.repeated([2, 1], film.lengths).map(|pocket| pocket.corner[0]);
/// assert!(places.zip([0.0075, 0.0275]).all(|(x, wanted)| (x - wanted).abs() < 1e-12));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pocket {
    /// The smallest `x` and `y`, in m.
    pub corner: [f64; 2],
    /// The extents along `x` and `y`, in m.
    pub size: [f64; 2],
    /// What the gap gains, in m.
    pub depth: f64,
    /// Whether it is the ellipse in the rectangle.
    pub ellipse: bool,
}

impl Pocket {
    /// Deepens the cells by their part that the pocket covers; false if it is lost between them.
    ///
    /// Along a periodic `x` a pocket may reach beyond the end.
    pub fn dig(&self, film: &mut Film) -> bool {
        // Points per cell and direction; none lies on the edge of a pocket that ends with a cell.
        const POINTS: usize = 8;
        let Self { corner, size, .. } = *self;
        let (counts, around) = ([film.nx, film.ny], film.sides[0] == Side::Periodic);
        let spacing = [0, 1].map(|axis| film.lengths[axis] / counts[axis] as f64);
        let range = |axis: usize| {
            let first = (corner[axis] / spacing[axis]).floor().max(0.0) as usize;
            let last = ((corner[axis] + size[axis]) / spacing[axis]).ceil() as usize;
            first..if around && axis == 0 { last } else { last.min(counts[axis]) }
        };
        let mut all = 0;
        for j in range(1) {
            for i in range(0) {
                let place = |axis: usize, at: usize, point: usize| {
                    let along = (at as f64 + (point as f64 + 0.5) / POINTS as f64) * spacing[axis];
                    2.0 * (along - corner[axis]) / size[axis] - 1.0
                };
                let mut covered = 0;
                for point in 0..POINTS * POINTS {
                    let [u, v] = [place(0, i, point % POINTS), place(1, j, point / POINTS)];
                    let inside = if self.ellipse { u * u + v * v } else { u.abs().max(v.abs()) };
                    covered += usize::from(inside <= 1.0);
                }
                film.gap[j * film.nx + i % film.nx] +=
                    self.depth * covered as f64 / (POINTS * POINTS) as f64;
                all += covered;
            }
        }
        all > 0
    }

    /// Returns so many of these along `x` and `y`, each in the middle of its part of a film of
    /// these extents.
    pub fn repeated(self, counts: [usize; 2], lengths: [f64; 2]) -> impl Iterator<Item = Self> {
        let place = move |k: usize| {
            let at = [k % counts[0], k / counts[0]];
            let corner = [0, 1].map(|axis| {
                let tile = lengths[axis] / counts[axis] as f64;
                (at[axis] as f64 + 0.5) * tile - self.size[axis] / 2.0
            });
            Self { corner, ..self }
        };
        (0..counts[0] * counts[1]).map(place)
    }
}
