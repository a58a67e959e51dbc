//! Bars on stderr with the time left, drawn only if that is a terminal. One that is dropped is
//! cleared.

use hlcp_methods::{Limits, Progress};
use indicatif::{ProgressBar, ProgressStyle};

/// A bar for so many pieces of work.
pub(crate) fn counting(pieces: usize) -> ProgressBar {
    styled(pieces as u64, "{bar:30} {pos}/{len}, {eta} left, {msg}")
}

fn styled(length: u64, template: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(template).expect("the template is sound");
    ProgressBar::new(length).with_style(style)
}

/// The way of a solve to its tolerance or its limits.
pub(crate) struct Way {
    bar: ProgressBar,
    name: String,
    goal: f64,
    limits: Limits,
    start: f64,
}

const STEPS: f64 = 1000.0;

impl Way {
    /// A bar for the method `name`, which stops at `goal` or at `limits`.
    pub(crate) fn new(name: &str, goal: f64, limits: &Limits) -> Self {
        let bar = styled(STEPS as u64, "{bar:30} {percent}%, {eta} left, {msg}");
        Self { bar, name: name.to_owned(), goal, limits: *limits, start: f64::NAN }
    }

    pub(crate) fn show<T>(&mut self, progress: &Progress<'_, T>) {
        if !progress.iteration.is_multiple_of(64) {
            return;
        }
        let residual = self.limits.norm.of(progress.residual);
        // Within a long step it may not be known yet.
        if residual.is_nan() {
            return;
        }
        if progress.iteration == 0 {
            self.start = residual;
        }
        self.bar.set_position((STEPS * self.share(progress, residual)) as u64);
        let Self { name, goal, .. } = self;
        let iteration = progress.iteration;
        self.bar.set_message(format!(
            "{name}: iteration {iteration}, residual {residual:.1e} of {goal:.1e}"
        ));
    }

    /// The digits gained of those wanted, or the share of the iterations or of the time, whichever
    /// is most.
    fn share<T>(&self, progress: &Progress<'_, T>, residual: f64) -> f64 {
        let digits = (self.start / residual).log10() / (self.start / self.goal).log10();
        let iterations = progress.iteration as f64 / self.limits.iterations as f64;
        let time = self.limits.time.map_or(0.0, |limit| progress.elapsed.div_duration_f64(limit));
        [digits, iterations, time].into_iter().fold(0.0, f64::max).min(1.0)
    }
}
