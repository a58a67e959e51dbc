//! Decides whether the next iteration is a cycle or sweeps.

use crate::safeguard::PROGRESS;

/// An iteration that multiplies the defect by more than this is slow enough to try the other kind.
const SLOW: f64 = 0.5;
/// How many cycles a trial takes, or pass without progress, beyond the number of slow sweeps that
/// are borne: the first ones after many sweeps may raise the defect while the error falls, and
/// where a front settles some leave it as it is.
const TRIAL: usize = 2;

/// The next action on an iterate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turn {
    /// Measure a cycle against sweeps.
    Compare,
    /// A cycle.
    Cycle,
    /// Keep the iterate, then a cycle.
    Keep,
    /// Sweeps.
    Sweep,
    /// Sweeps from the iterate that was kept.
    Return,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Unknown,
    /// With the defect to come to, and the number of cycles without it that are borne.
    Cycles {
        goal: f64,
        bear: usize,
    },
    /// With the number of slow iterations to bear.
    Sweeps {
        bear: usize,
    },
}

/// The defects of a solve, in a few numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    phase: Phase,
    last: f64,
    /// That of the iterate that was kept.
    kept: Option<f64>,
    patience: usize,
}

impl Pace {
    pub(super) fn new() -> Self {
        Self { phase: Phase::Unknown, last: f64::INFINITY, kept: None, patience: 1 }
    }

    /// Returns whether iterations are cycles; `None` before anything was measured.
    pub(super) fn cycles(&self) -> Option<bool> {
        match self.phase {
            Phase::Unknown => None,
            Phase::Cycles { .. } => Some(true),
            Phase::Sweeps { .. } => Some(false),
        }
    }

    /// Returns whether the last iteration was a cycle that has not halved the defect.
    pub(super) fn is_slow(&self, defect: f64) -> bool {
        self.cycles() == Some(true) && defect > SLOW * self.last
    }

    /// Forgets how well the last iteration did.
    pub(super) fn forget(&mut self) {
        self.last = f64::INFINITY;
    }

    /// Notes what a cycle and what as much work in sweeps multiplied the defect by.
    pub(super) fn compared(&mut self, cycle: f64, sweeps: f64) {
        self.phase = if cycle < sweeps {
            self.cycles_to(f64::INFINITY)
        } else {
            Phase::Sweeps { bear: self.patience }
        };
    }

    /// Notes the defect of the next iterate.
    pub(super) fn turn(&mut self, defect: f64) -> Turn {
        let gain = defect / self.last;
        self.last = defect;
        match &mut self.phase {
            Phase::Unknown => Turn::Compare,
            Phase::Cycles { goal, .. } if defect <= *goal => {
                self.phase = self.cycles_to(PROGRESS * defect);
                Turn::Cycle
            }
            Phase::Cycles { bear, .. } if *bear > 0 && defect.is_finite() => {
                *bear -= 1;
                Turn::Cycle
            }
            Phase::Cycles { .. } => {
                // For longer than the last time, and not from where cycles have led astray.
                self.patience *= 2;
                self.phase = Phase::Sweeps { bear: self.patience };
                let is_astray = self.kept.is_some_and(|kept| defect.is_nan() || defect >= kept);
                if is_astray { Turn::Return } else { Turn::Sweep }
            }
            Phase::Sweeps { .. } if gain <= SLOW => Turn::Sweep,
            Phase::Sweeps { bear: 0 } => {
                // What sweeps would come to by then.
                let cycles = TRIAL + self.patience;
                self.phase = self.cycles_to(defect * gain.min(1.0).powi(cycles as i32));
                self.kept = Some(defect);
                Turn::Keep
            }
            Phase::Sweeps { bear } => {
                *bear -= 1;
                Turn::Sweep
            }
        }
    }

    /// Cycles that are to come to a defect.
    fn cycles_to(&self, goal: f64) -> Phase {
        Phase::Cycles { goal, bear: TRIAL + self.patience - 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turns(pace: &mut Pace, defects: &[f64]) -> Vec<Turn> {
        defects.iter().map(|&defect| pace.turn(defect)).collect()
    }

    #[test]
    fn cycles_go_on_until_three_stall() {
        let mut pace = Pace::new();
        assert_eq!(pace.turn(8.0), Turn::Compare);
        pace.compared(0.2, 0.3);
        assert_eq!(turns(&mut pace, &[1.0, 0.6, 0.55, 0.6, 0.5, 0.48, 0.47]), [Turn::Cycle; 7]);
        assert_eq!(turns(&mut pace, &[0.46]), [Turn::Sweep]);
        assert_eq!(pace.cycles(), Some(false));
    }

    #[test]
    fn sweeps_go_on_while_they_halve_the_defect() {
        let mut pace = Pace::new();
        assert_eq!(pace.turn(8.0), Turn::Compare);
        pace.compared(0.3, 0.2);
        assert_eq!(turns(&mut pace, &[4.0, 2.0, 0.9]), [Turn::Sweep; 3]);
        // Two slow ones, and cycles are on trial.
        assert_eq!(turns(&mut pace, &[0.8, 0.72]), [Turn::Sweep, Turn::Keep]);
        // Sweeps would come to 0.72 · 0.9³ = 0.52 by then.
        assert_eq!(turns(&mut pace, &[2.0, 0.9, 0.5]), [Turn::Cycle; 3]);
        assert_eq!(pace.cycles(), Some(true));
    }

    #[test]
    fn a_failed_trial_returns_and_waits_longer() {
        let mut pace = Pace::new();
        assert_eq!(pace.turn(8.0), Turn::Compare);
        pace.compared(f64::NAN, 0.2);
        assert_eq!(turns(&mut pace, &[7.0, 6.3]), [Turn::Sweep, Turn::Keep]);
        assert_eq!(turns(&mut pace, &[7.0, 6.6, 6.4]), [Turn::Cycle, Turn::Cycle, Turn::Return]);
        assert_eq!(turns(&mut pace, &[6.2, 5.9, 5.5]), [Turn::Sweep, Turn::Sweep, Turn::Keep]);
        assert_eq!(turns(&mut pace, &[f64::NAN]), [Turn::Return]);
        assert_eq!(turns(&mut pace, &[5.4, 5.3, 5.2, 5.1]), [Turn::Sweep; 4]);
        assert_eq!(turns(&mut pace, &[5.0]), [Turn::Keep]);
        // Less is gained than by sweeps, but something is.
        assert_eq!(turns(&mut pace, &[4.99, 4.98, 4.97, 4.96, 4.95]), [Turn::Cycle; 5]);
        assert_eq!(turns(&mut pace, &[4.94]), [Turn::Sweep]);
    }
}
