use hlcp_core::{Aor, Error, Hlcp, Norms, Rhs, Rows, Scalar, Step};

use crate::{Clock, Method};

/// A method that chooses its own parameters: SOR by AMMS or by MMS, with the α that shrinks the
/// residual fastest.
///
/// It starts as AMSOR with α = 1.1. While a sweep takes off less than two fifths of the residual,
/// it tries its neighbours for some sweeps each (MMS in the place of AMMS or the reverse, a smaller
/// and a larger `2 − α`), and moves where the residual falls faster. All sweeps, those that try
/// something too, work on the same iterate, so none is lost. Where nothing is better it looks
/// longer the next time, and a choice under which the residual grows threefold is left at once and
/// not tried again.
///
/// Ω is the problem's: [`Omega::diagonal_ratio`](hlcp_core::Omega::diagonal_ratio) with τ = 1 does
/// well.
///
/// # Cost
///
/// One walk over the rows of `A` and `B` a sweep, as [`Mms`](crate::Mms); no storage.
///
/// # Convergence
///
/// None is proved: the relaxed theorem of `docs/theory.md` covers a sequence of such steps up to an
/// α that is often below the ones that do well.
///
/// # Source
///
/// None; that α may be chosen by watching the residual is common for SOR on linear systems (D. M.
/// Young, *Iterative Solution of Large Linear Systems*, 1971, chapter 6).
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
/// use hlcp_methods::{AdaptiveSor, Limits, Options, Solver};
///
/// let a = FivePoint::new(32, 32, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, Identity { order: 32 * 32 }, Omega::Uniform(4.0))?;
/// let q: Vec<f64> = (0..32 * 32).map(|k| if k % 32 < 20 { -0.01 } else { 0.02 }).collect();
///
/// let mut solver = Solver::new(AdaptiveSor::new(problem)?);
/// let outcome = solver.solve(&q, Options::from_x(&vec![1.0; 32 * 32]))?;
/// assert!(outcome.converged() && solver.method().alpha() > 1.5);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct AdaptiveSor<T, A, B> {
    problem: Hlcp<T, A, B>,
    search: Search,
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> AdaptiveSor<T, A, B> {
    /// The method on `problem`.
    ///
    /// # Errors
    ///
    /// Those of the [`check`](Step::check) of [`Aor`].
    pub fn new(problem: Hlcp<T, A, B>) -> Result<Self, Error> {
        problem.agree(Aor::gauss_seidel().check(&problem))?;
        Ok(Self { problem, search: Search::default() })
    }

    /// The α in use.
    pub fn alpha(&self) -> f64 {
        2.0 - self.search.choice.gap
    }

    /// Whether AMMS is in use, rather than MMS.
    pub fn is_accelerated(&self) -> bool {
        self.search.choice.accelerated
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Method<T> for AdaptiveSor<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn restart(&mut self) {
        self.search = Search::default();
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn works_on_ranks(&self) -> bool {
        true
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, _: &mut Clock<'_>) -> Norms {
        let sor = Aor::sor(T::of(self.alpha())).unwrap_or(Aor::gauss_seidel());
        let step = if self.is_accelerated() { sor.accelerated() } else { sor };
        let norms = step.step(&self.problem, q, x, y, &mut Vec::new());
        self.search.see(norms.l2);
        norms
    }
}

/// The choice in use: AMMS or MMS, and `2 − α`, to which the best rate of SOR is proportional.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Choice {
    accelerated: bool,
    gap: f64,
}

/// A neighbour to try.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Trial {
    Other,
    Larger,
    Halfway,
    Smaller,
}

/// The search for the fastest choice, driven by the residuals alone.
#[derive(Debug, Clone)]
struct Search {
    choice: Choice,
    /// The best choice, and how much a sweep took off the logarithm of the residual when it was
    /// last seen.
    best: (Choice, f64),
    trial: Option<Trial>,
    /// The choice in use before the trials.
    home: Choice,
    /// The gaps at which MMS and AMMS were given up.
    barriers: [f64; 2],
    /// How long to judge, and how many windows to wait for the next trials.
    patience: usize,
    pause: usize,
    /// Sweeps into the window, and the residuals at its beginning and its middle.
    at: usize,
    begin: f64,
    middle: f64,
}

/// A sweep that takes off two fifths of the residual needs no improvement: log(1/0.6).
const FAST: f64 = 0.51;
/// The factor on the gap for half a trial.
const RATIO: f64 = 0.84;
/// Growth of the residual within a window at which a choice is given up.
const GIVE_UP: f64 = 3.0;

impl Default for Search {
    fn default() -> Self {
        let choice = Choice { accelerated: true, gap: 0.9 };
        Self {
            choice,
            best: (choice, 0.0),
            trial: None,
            home: choice,
            barriers: [0.0; 2],
            patience: 1,
            pause: 0,
            at: 0,
            begin: f64::NAN,
            middle: f64::NAN,
        }
    }
}

impl Search {
    /// Sweeps to judge a choice by: errors of SOR live for some 1/(2 − α) sweeps.
    fn window(&self) -> usize {
        2 * self.patience * (3.0 / self.choice.gap).ceil() as usize
    }

    /// Takes in the residual of the next iterate.
    fn see(&mut self, residual: f64) {
        if self.at == 0 {
            self.begin = residual;
        }
        if self.at == self.window() / 2 {
            self.middle = residual;
        }
        let lost = residual.is_nan() || residual > GIVE_UP * self.begin;
        if lost || self.at == self.window() {
            let rate = (self.middle / residual).ln() / (self.window() - self.window() / 2) as f64;
            if lost {
                self.barriers[usize::from(self.choice.accelerated)] = self.choice.gap;
            }
            self.judge(if lost { f64::NEG_INFINITY } else { rate });
            (self.at, self.begin) = (0, residual);
        }
        self.at += 1;
    }

    /// Decides what to use next, given the rate of the choice in use.
    fn judge(&mut self, rate: f64) {
        let Some(trial) = self.trial else {
            self.best = (self.choice, rate);
            if rate == f64::NEG_INFINITY {
                self.choice.gap = (self.choice.gap / RATIO).min(1.9);
                self.pause = 1;
            } else if rate < FAST && self.pause == 0 {
                self.home = self.choice;
                self.attempt(Trial::Other);
            } else {
                self.pause = self.pause.saturating_sub(1);
            }
            return;
        };
        let better = rate > 1.02 * self.best.1;
        if better {
            self.best = (self.choice, rate);
        }
        match trial {
            Trial::Larger if better => self.attempt(Trial::Larger),
            Trial::Smaller if better => self.attempt(Trial::Smaller),
            Trial::Other => self.attempt(Trial::Larger),
            Trial::Larger => self.attempt(Trial::Halfway),
            Trial::Halfway if better => self.finish(),
            Trial::Halfway => self.attempt(Trial::Smaller),
            Trial::Smaller => self.finish(),
        }
    }

    fn finish(&mut self) {
        self.choice = self.best.0;
        self.trial = None;
        self.pause = 2;
        if self.choice == self.home {
            self.patience *= 2;
        }
    }

    fn attempt(&mut self, trial: Trial) {
        let best = self.best.0;
        let choice = match trial {
            Trial::Other => Choice { accelerated: !best.accelerated, ..best },
            Trial::Larger => Choice { gap: best.gap * RATIO * RATIO, ..best },
            Trial::Halfway => Choice { gap: best.gap * RATIO, ..best },
            Trial::Smaller => Choice { gap: (best.gap / RATIO).min(1.9), ..best },
        };
        self.trial = Some(trial);
        if choice.gap <= self.barriers[usize::from(choice.accelerated)] {
            self.judge(f64::NEG_INFINITY);
        } else {
            self.choice = choice;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A search whose residual a sweep multiplies by `exp(−rate)`, the rate being that of the
    /// choice in use and of the sweeps since it came into use; after `sweeps` of them, with the
    /// choices in the order of their use.
    fn search(sweeps: usize, rate: impl Fn(Choice, usize) -> f64) -> (Search, Vec<Choice>) {
        let (mut search, mut used, mut residual) = (Search::default(), vec![], 1.0);
        let mut age = 0;
        for _ in 0..sweeps {
            age = if used.last() == Some(&search.choice) { age + 1 } else { 0 };
            used.push(search.choice);
            search.see(residual);
            residual *= f64::exp(-rate(*used.last().expect("a choice"), age));
        }
        (search, used)
    }

    /// Wherever the best `2 − α` is, of AMMS or of MMS, the search ends within half a step of it.
    #[test]
    fn the_best_choice_is_found() {
        for accelerated in [true, false] {
            for best in [0.03, 0.11, 0.4, 0.76, 0.9, 1.06, 1.5] {
                let (search, _) = search(20_000, |choice, _| {
                    let off = f64::ln(choice.gap / best).abs();
                    let family = if choice.accelerated == accelerated { 1.0 } else { 0.8 };
                    0.4 * family * best.min(1.0) * f64::exp(-off)
                });
                let found = if search.trial.is_some() { search.best.0 } else { search.choice };
                assert_eq!(found.accelerated, accelerated, "{best}");
                let off = f64::ln(found.gap / best).abs();
                // A step is a factor of 0.84, and less than 2 % are not worth another one.
                assert!(off <= 0.5 * -RATIO.ln() + 0.02, "{best}: {found:?}");
            }
        }
    }

    /// A hundredth more is none, and what falls when the choice changes is none of the new one's
    /// doing.
    #[test]
    fn noise_is_no_improvement() {
        let start = Search::default().choice;
        for first in [0.0, 3.0] {
            let (search, _) = search(2000, |choice, age| {
                let change = if age == 0 && choice != start { first } else { 0.0 };
                change + if choice == start { 0.3 } else { 0.303 }
            });
            assert_eq!(search.home, start);
            // Each round of trials for nothing doubles the patience.
            assert!(search.patience >= 16, "{}", search.patience);
        }
    }

    /// Growth is seen before it is tenfold, and a larger gap is tried; what grew is not tried
    /// again.
    #[test]
    fn growth_is_left_at_once() {
        let (search, used) = search(3000, |choice, _| if choice.gap < 1.2 { -0.3 } else { 0.2 });
        // exp(1.2) > 3: the fourth sweep of such a choice is its last.
        let bad: Vec<_> = used.iter().filter(|choice| choice.gap < 1.2).collect();
        assert!(bad.len() <= 3 * 5, "{bad:?}");
        assert!(search.best.0.gap >= 1.2);
    }
}
