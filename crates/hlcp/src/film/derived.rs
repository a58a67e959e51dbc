use std::f64::consts::TAU;

use hlcp_verify::{Film, FilmFigures};

use super::Bearing;

/// What the oil is, apart from its viscosity: by default a mineral one.
///
/// ```
/// use hlcp::film::Oil;
///
/// let oil = Oil { density: 950.0, ..Oil::default() };
/// assert_eq!((oil.density, oil.heat), (950.0, 1950.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oil {
    /// The density, in kg/m³.
    pub density: f64,
    /// The specific heat, in J/(kg K).
    pub heat: f64,
}

impl Default for Oil {
    fn default() -> Self {
        Self { density: 870.0, heat: 1950.0 }
    }
}

/// Figures that follow from those of a film, in SI units.
///
/// ```
/// use hlcp::film::{Bearing, Film, Oil, Settings, Solved};
///
/// let film = Film::new([50, 30], [0.05, 0.03], 3.0, 0.04).with_gap(|x, _| 4e-5 - 4e-4 * x);
/// let pad = Bearing::pad(film);
/// let Solved { film, z, r, .. } = Solved::new(pad.film.clone(), None, &Settings::default())?;
/// let figures = film.figures(&z, &r, 0.0);
/// let found = pad.derived(&film, &figures, figures.load, &Oil::default());
/// assert!((found.specific_load - figures.load / (0.05 * 0.03)).abs() < 1e-6);
/// assert!((found.reynolds - 870.0 * 3.0 * 3e-5 / 0.04).abs() < 1e-9 && found.is_laminar());
/// # Ok::<(), hlcp::film::FilmError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Derived {
    /// The load over the area of the film, of a journal over its diameter times its length.
    pub specific_load: f64,
    /// Of a journal the Sommerfeld number `(R/c)² μN/P` with the mean viscosity; infinite without a
    /// load.
    pub sommerfeld: Option<f64>,
    /// Of a journal the moment of the drag on the wall that moves the faster.
    pub torque: Option<f64>,
    /// What leaves the film, in m³/s: what flows out at sides (side leakage), whatever flows in
    /// elsewhere on the same side, and what supplies draw.
    pub leakage: f64,
    /// How much warmer the oil leaves if it takes all of the power with it, in K; infinite if none
    /// leaves. What supplies pump warms it further, by their pressure over ρc.
    pub temperature_rise: f64,
    /// The Reynolds number of shear, with the clearance of a journal and the mean gap of anything
    /// else.
    pub reynolds: f64,
    /// The Reynolds number up to which shear is laminar.
    ///
    /// That of plane walls is 1440 (N. Tillmark and P. H. Alfredsson, J. Fluid Mech. 235 (1992)
    /// 89–102, where it is 360 for half of the gap and half of the speed). Around a journal
    /// vortices begin where its square is 1708 R/c (G. I. Taylor, Phil. Trans. R. Soc. A 223 (1923)
    /// 289–343).
    pub laminar: f64,
}

impl Derived {
    /// Returns whether shear is laminar, which Reynolds' equation supposes.
    pub fn is_laminar(&self) -> bool {
        self.reynolds <= self.laminar
    }
}

impl Bearing {
    /// Returns what follows from the figures of a film and the load that it carries.
    pub fn derived(&self, film: &Film, figures: &FilmFigures, load: f64, oil: &Oil) -> Derived {
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        let ([lx, ly], viscosity) = (film.lengths, mean(&film.viscosity));
        let area = self.journal.map_or(lx * ly, |journal| journal.diameter * journal.length);
        let drawn = figures.supplies.iter().map(|flow| (-flow).max(0.0));
        let leakage = figures.leaks.iter().copied().chain(drawn).sum();
        let gap = self.journal.map_or_else(|| mean(&film.gap), |journal| journal.clearance);
        let slope = self.journal.map(|journal| journal.diameter / 2.0 / journal.clearance);
        let turns = self.running_speed() / TAU;
        let specific_load = load / area;
        Derived {
            specific_load,
            sommerfeld: slope.map(|slope| slope * slope * viscosity * turns / specific_load),
            torque: self.journal.map(|of| self.drag(figures.friction)[0] * of.diameter / 2.0),
            leakage,
            temperature_rise: figures.power / (oil.density * oil.heat * leakage),
            reynolds: oil.density * (film.speeds[0] - film.speeds[1]).abs() * gap / viscosity,
            laminar: slope.map_or(f64::INFINITY, |slope| (1708.0 * slope).sqrt()).min(1440.0),
        }
    }
}
