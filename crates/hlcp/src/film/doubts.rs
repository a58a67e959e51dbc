use hlcp_verify::{Film, FilmFigures, Side};

use super::{Derived, Line, Profile};

/// How an interface calls what its warnings name.
///
/// ```
/// use hlcp::film::Words;
///
/// let words = Words {
///     lengths: "lengths are in metres",
///     viscosity: "viscosity",
///     speed: "speed",
///     groove: "a groove",
///     ambient: "the ambient pressure",
///     side: "a side",
///     supplies: "supplies",
/// };
/// assert_eq!(words.sizes(2e-5, &[0.1], 1e6, 0.04), None);
/// let doubt = words.sizes(2e-5, &[0.1], 1e6, 40.0).expect("a doubt");
/// assert!(doubt.contains("viscosity is in Pa s"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Words {
    /// A sentence about the units of lengths.
    pub lengths: &'static str,
    /// The name of the viscosity.
    pub viscosity: &'static str,
    /// The name of the speed.
    pub speed: &'static str,
    /// What feeds a journal.
    pub groove: &'static str,
    /// What feeds a film with an open side.
    pub ambient: &'static str,
    /// What feeds one without.
    pub side: &'static str,
    /// What feeds any film.
    pub supplies: &'static str,
}

impl Words {
    /// Returns what makes a film doubtful, or is hardly meant, and the ways out.
    pub fn warnings(
        &self,
        film: &Film,
        figures: &FilmFigures,
        derived: Option<&Derived>,
        converged: bool,
    ) -> Vec<String> {
        let mut told = vec![];
        if figures.peak <= film.cavitation {
            let is_journal = derived.is_some_and(|derived| derived.torque.is_some());
            if !film.is_fed() {
                told.push(self.unfed(film, is_journal, ""));
            } else if film.step.is_none() && converged {
                told.push(self.empty(film));
            }
        }
        told.extend(figures.doubt().filter(|_| converged));
        if let Some(Derived { reynolds, laminar, .. }) = derived.filter(|of| !of.is_laminar()) {
            told.push(format!(
                "the Reynolds number {reynolds:.0} is above {laminar:.0}, up to which shear is \
                 laminar; friction and load are above these, which suppose that it is"
            ));
        }
        let thickest = film.viscosity.iter().copied().fold(0.0, f64::max);
        told.extend(self.sizes(figures.least_gap, &film.lengths, figures.peak, thickest));
        told
    }

    /// Returns the same of a film along a line.
    pub fn of_line(&self, film: &Profile, line: &Line) -> Vec<String> {
        let ([length, thin, _], peak) = (film.units(), line.pressure[line.peak]);
        let doubt = film.doubt(line).filter(|_| line.outcome.converged());
        doubt.into_iter().chain(self.sizes(thin, &[length], peak, film.viscosity)).collect()
    }

    /// Returns what is hardly meant about a least gap, extents, a peak and a viscosity.
    pub fn sizes(&self, thin: f64, lengths: &[f64], peak: f64, viscosity: f64) -> Option<String> {
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        let pascals = format!("{} is in Pa s (1 cP is 0.001 Pa s)", self.viscosity);
        if thin > 1e-3 || thin < 1e-6 * longest {
            let film = lengths.iter().map(|length| format!("{length} m")).collect::<Vec<_>>();
            let film = film.join(" by ");
            Some(format!("the least gap is {thin} m and the film {film} long; {}", self.lengths))
        } else if peak > 1e10 {
            Some(format!(
                "the peak pressure is {peak:e} Pa, more than lubricants bear; {pascals}, and {}",
                self.lengths
            ))
        } else {
            let what = "Pa s is more than that of lubricating oils";
            (viscosity >= 5.0).then(|| format!("a viscosity of {viscosity} {what}; {pascals}"))
        }
    }

    /// Returns what a steady film is that nothing feeds, what `more` there is to say of that, and
    /// how to feed it.
    pub fn unfed(&self, film: &Film, is_journal: bool, more: &str) -> String {
        let what = if film.speeds.iter().sum::<f64>() == 0.0 {
            "the speeds of the walls cancel and nothing feeds this film, so it has the pressure of \
             cavitation everywhere"
        } else {
            "nothing feeds this film, so it runs dry"
        };
        let groove = if is_journal { format!("{}, ", self.groove) } else { String::new() };
        let is_open = film.sides.iter().any(|side| matches!(side, Side::Pressure(_)));
        let around = if is_open { self.ambient } else { self.side };
        format!(
            "{what}{more}; feed it above the pressure of cavitation, by {groove}{around} or {}",
            self.supplies
        )
    }

    /// What is told of a film that is fed and carries nothing.
    fn empty(&self, film: &Film) -> String {
        // But for rounding.
        if film.gap.iter().all(|h| (h - film.gap[0]).abs() <= 1e-12 * film.gap[0]) {
            return "the film carries nothing, because its gap is the same everywhere; pressure \
                    builds up where the gap narrows along the motion and oil fills it: check the \
                    shape and its units, or feed the film above the pressure of cavitation"
                .into();
        }
        let is_starved = film.sides.iter().any(|side| matches!(side, Side::Starved(_)));
        let more = if is_starved { ", or let more oil in at the starved side" } else { "" };
        let speed = self.speed;
        format!(
            "the film carries nothing, because its pressure is that of cavitation everywhere; oil \
             moves along x where {speed} is positive, and builds up pressure where the gap narrows \
             that way and oil fills it: turn the gap round, or change the sign of {speed}{more}"
        )
    }
}
