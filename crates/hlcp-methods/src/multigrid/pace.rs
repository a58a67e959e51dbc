//! Decides whether the next iteration is a cycle or sweeps.

use crate::safeguard::PROGRESS;

/// An iteration that multiplies the defect by more than this is slow enough to try the other kind.
const SLOW: f64 = 0.5;
/// How many cycles a trial takes beyond the number of slow sweeps that are borne: the first ones
/// after many sweeps may raise the defect while the error falls.
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
    Cycles,
    /// With the number of slow iterations to bear.
    Sweeps {
        bear: usize,
    },
    /// Cycles on trial after sweeps, with the number still to come and the defect to be below at
    /// the end.
    Trial {
        left: usize,
        goal: f64,
    },
}

/// The defects of a solve, in a few numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    phase: Phase,
    last: f64,
    patience: usize,
}

impl Pace {
    pub(super) fn new() -> Self {
        Self { phase: Phase::Unknown, last: f64::INFINITY, patience: 1 }
    }

    /// Returns whether iterations are cycles; `None` before anything was measured.
    pub(super) fn cycles(&self) -> Option<bool> {
        match self.phase {
            Phase::Unknown => None,
            Phase::Cycles | Phase::Trial { .. } => Some(true),
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
        self.phase =
            if cycle < sweeps { Phase::Cycles } else { Phase::Sweeps { bear: self.patience } };
    }

    /// Notes the defect of the next iterate.
    pub(super) fn turn(&mut self, defect: f64) -> Turn {
        let gain = defect / self.last;
        self.last = defect;
        match self.phase {
            Phase::Unknown => Turn::Compare,
            Phase::Cycles if gain <= PROGRESS => Turn::Cycle,
            Phase::Cycles => self.sweep(Turn::Sweep),
            Phase::Sweeps { .. } if gain <= SLOW => Turn::Sweep,
            Phase::Sweeps { bear: 0 } => {
                let cycles = TRIAL + self.patience;
                let goal = defect * gain.min(1.0).powi(cycles as i32);
                self.phase = Phase::Trial { left: cycles - 1, goal };
                Turn::Keep
            }
            Phase::Sweeps { bear } => {
                self.phase = Phase::Sweeps { bear: bear - 1 };
                Turn::Sweep
            }
            Phase::Trial { left: 0, goal } if defect < goal => {
                self.phase = Phase::Cycles;
                Turn::Cycle
            }
            Phase::Trial { left: 0, .. } => self.sweep(Turn::Return),
            Phase::Trial { .. } if !defect.is_finite() => self.sweep(Turn::Return),
            Phase::Trial { left, goal } => {
                self.phase = Phase::Trial { left: left - 1, goal };
                Turn::Cycle
            }
        }
    }

    /// Back to sweeps, and for longer than the last time.
    fn sweep(&mut self, turn: Turn) -> Turn {
        self.phase = Phase::Sweeps { bear: self.patience };
        self.patience *= 2;
        turn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turns(pace: &mut Pace, defects: &[f64]) -> Vec<Turn> {
        defects.iter().map(|&defect| pace.turn(defect)).collect()
    }

    #[test]
    fn cycles_go_on_until_one_stalls() {
        let mut pace = Pace::new();
        assert_eq!(pace.turn(8.0), Turn::Compare);
        pace.compared(0.2, 0.3);
        assert_eq!(turns(&mut pace, &[1.0, 0.6, 0.55]), [Turn::Cycle, Turn::Cycle, Turn::Sweep]);
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
        assert_eq!(turns(&mut pace, &[7.0, 6.0, 5.0]), [Turn::Cycle, Turn::Cycle, Turn::Return]);
        assert_eq!(turns(&mut pace, &[4.9, 4.4]), [Turn::Sweep, Turn::Keep]);
        assert_eq!(turns(&mut pace, &[f64::NAN]), [Turn::Return]);
        let longer = [Turn::Sweep, Turn::Sweep, Turn::Keep];
        assert_eq!(turns(&mut pace, &[4.3, 4.2, 4.1]), longer);
    }
}
