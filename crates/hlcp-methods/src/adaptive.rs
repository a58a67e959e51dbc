use hlcp_core::{Aor, Error, Hlcp, Norms, Rhs, Rows, Scalar, Step};

use crate::{Clock, Method};

/// A method that chooses its own parameter: SOR by AMMS, with an α that grows to the best one.
///
/// With τ = 1 it is nonlinear SOR, and near an answer SOR on the matrix J(x\*). Where that is
/// consistently ordered, as five-point matrices are, the rate λ at an α below the best one tells
/// the spectral radius μ of Jacobi's iteration, and with it the best α,
///
/// ```text
/// μ² = (λ + α − 1)²/(α² λ) ,    α* = 2/(1 + √(1 − μ²)) .
/// ```
///
/// The method starts with α = 1 and measures λ by the residuals of the second half of a window of
/// sweeps. While λ is larger than it would be at the best α, the method takes the α that λ tells,
/// but at most halves `2 − α` and doubles `α − 1`, from 0.1 on. Where the residual has not fallen
/// for four windows, or has grown to ten times the smallest one, the method keeps a quarter of
/// `α − 1`, from α = 1.2 to 1 nothing of it and from there 0.7 α, and waits for 2, 4, 8, … windows.
/// After growth, half of `α − 1` is the bound from then on.
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
/// None is proved from afar; near an answer `docs/theory.md` ("The optimal α") has the rates.
///
/// # Source
///
/// D. M. Young, *Iterative Solution of Large Linear Systems*, 1971, chapter 6, for the theory; L.
/// A. Hageman and D. M. Young, *Applied Iterative Methods*, 1981, chapter 9, for α during a solve.
///
/// ```
/// use hlcp_methods::{AdaptiveSor, FivePoint, Hlcp, Identity, Limits, Omega, Options, Solver};
///
/// let a = FivePoint::new(32, 32, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, Identity { order: 32 * 32 }, Omega::Uniform(4.0))?;
/// let q: Vec<f64> = (0..32 * 32).map(|k| if k % 32 < 20 { -0.01 } else { 0.02 }).collect();
///
/// let mut solver = Solver::new(AdaptiveSor::new(problem)?);
/// let outcome = solver.solve(&q, Options::from_x(&vec![1.0; 32 * 32]))?;
/// assert!(outcome.converged() && solver.method().alpha() > 1.5);
/// # Ok::<(), hlcp_methods::Error>(())
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
        Ok(Self { problem, search: Search::new() })
    }

    /// Takes a smaller α, as after growth.
    pub(crate) fn take_back(&mut self) {
        self.search.take_back(true);
    }

    /// The α in use.
    pub fn alpha(&self) -> f64 {
        self.search.alpha
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Method<T> for AdaptiveSor<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn restart(&mut self) {
        self.search = Search::new();
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn works_on_ranks(&self) -> bool {
        true
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, _: &mut Clock<'_>) -> Norms {
        let sor = Aor::sor(T::of(self.alpha())).unwrap_or(Aor::gauss_seidel());
        let norms = sor.accelerated().step(&self.problem, q, x, y, &mut Vec::new());
        self.search.see(norms.l2);
        norms
    }
}

/// The search for the best α, driven by the residuals alone.
#[derive(Debug, Clone)]
struct Search {
    alpha: f64,
    /// The largest α that may still be used.
    bound: f64,
    /// The sweeps of a window, and those of it so far.
    window: usize,
    at: usize,
    /// The residual in the middle of the window.
    middle: f64,
    /// The smallest residual since α was last taken back, and the sweeps since then.
    least: f64,
    since: usize,
    /// How often α was taken back, and the windows to wait before it is raised again.
    failures: u32,
    rest: usize,
}

/// The first `α − 1` above 0; from there it at most doubles. A sweep along a flow multiplies an
/// error by α at each point that it passes: 0.1 costs seven digits on 170 points, 0.5 thirty.
const FIRST: f64 = 0.1;

/// Growth of the residual over the smallest one that bounds α; on random problems 6 does as well,
/// and 4 takes up to 16 times the sweeps.
const GROWN: f64 = 10.0;

/// The windows without fall that take α back: while signs change, residuals rise for some sweeps.
const IDLE: usize = 4;

/// The factor by which an α of at most 1 is taken back.
const SMALLER: f64 = 0.7;

impl Search {
    fn new() -> Self {
        Self {
            alpha: 1.0,
            bound: 2.0,
            window: window(1.0),
            at: 0,
            middle: f64::NAN,
            least: f64::INFINITY,
            since: 0,
            failures: 0,
            rest: 0,
        }
    }

    /// Takes in the residual of the next iterate.
    fn see(&mut self, residual: f64) {
        if self.at == self.window / 2 {
            self.middle = residual;
        }
        self.since += 1;
        if residual < self.least {
            (self.least, self.since) = (residual, 0);
        }
        let grown = residual.is_nan() || residual > GROWN * self.least;
        if grown || self.since >= IDLE * self.window {
            self.take_back(grown);
            return;
        }
        if self.at == self.window {
            let sweeps = self.window - self.window / 2;
            self.raise((residual / self.middle).powf((sweeps as f64).recip()));
            self.at = 0;
        }
        self.at += 1;
    }

    /// Takes the α that a rate tells, if it is larger.
    fn raise(&mut self, rate: f64) {
        let excess = self.alpha - 1.0;
        let falls = self.since < self.window;
        if self.rest > 0 {
            self.rest -= 1;
        } else if falls && rate > excess && rate < 1.0 {
            let double =
                if excess < 0.0 { self.alpha / SMALLER } else { 1.0 + FIRST.max(2.0 * excess) };
            let alpha = best(rate, self.alpha).min(0.5 * (self.alpha + 2.0)).min(double);
            self.alpha = alpha.min(self.bound);
            self.window = window(self.alpha);
        }
    }

    /// Returns to a smaller α for some time; after growth the present one is not used again.
    fn take_back(&mut self, grown: bool) {
        let excess = self.alpha - 1.0;
        let alpha = match excess {
            _ if excess >= 2.0 * FIRST => 1.0 + 0.25 * excess,
            _ if excess > 0.0 => 1.0,
            _ => SMALLER * self.alpha,
        };
        let bound = if grown { 1.0 + 0.5 * excess.max(0.0) } else { self.bound };
        let failures = (self.failures + 1).min(30);
        let (window, rest) = (window(alpha), 1 << failures);
        *self = Self { alpha, bound, window, failures, rest, ..Self::new() };
    }
}

/// The best α for a consistently ordered matrix on which SOR with this α has the rate λ ≥ α − 1.
fn best(rate: f64, alpha: f64) -> f64 {
    let square = (rate + alpha - 1.0).powi(2) / (alpha * alpha * rate);
    2.0 / (1.0 + (1.0 - square).max(0.0).sqrt())
}

/// The least p ≥ 6 with p |α − 1|ᵖ⁻¹ ≤ ½, or a large one: p sweeps forget the errors of earlier
/// ones.
fn window(alpha: f64) -> usize {
    let is_long = |p: usize| p as f64 * (alpha - 1.0).abs().powf((p - 1) as f64) <= 0.5;
    // What is long enough stays so: the left side only rises before it falls.
    let (mut short, mut long) = (5, 6);
    while !is_long(long) && long < usize::MAX / 16 {
        (short, long) = (long, 2 * long);
    }
    while long - short > 1 {
        let middle = (short + long) / 2;
        if is_long(middle) { long = middle } else { short = middle }
    }
    long
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use proptest::{collection::vec, prelude::*};

    /// The rates of Jacobi and of SOR with this α: the largest moduli of eigenvalues.
    fn rates(matrix: &DMatrix<f64>, alpha: f64) -> [f64; 2] {
        let diagonal = DMatrix::from_diagonal(&matrix.diagonal());
        let sor = matrix.lower_triangle() + &diagonal * (1.0 / alpha - 1.0);
        [diagonal, sor].map(|m| {
            let iteration = m.clone().try_inverse().unwrap() * (m - matrix);
            iteration.complex_eigenvalues().iter().fold(0.0, |max, value| value.norm().max(max))
        })
    }

    /// Young's best α.
    fn young(mu: f64) -> f64 {
        2.0 / (1.0 + (1.0 - mu * mu).sqrt())
    }

    proptest! {
        /// On random five-point matrices the rate tells the best α while α is below it; from there
        /// on the rate is α − 1. Near the double root eigenvalues keep half their digits.
        #[test]
        fn the_rate_tells_the_best_alpha(
            (nx, ny) in (2..5_usize, 2..5_usize), weights in vec(0.1..1.0_f64, 32),
            slack in 0.01..0.5_f64, part in 0.05..0.95_f64,
        ) {
            let mut matrix = DMatrix::from_fn(nx * ny, nx * ny, |i, j| {
                let (k, next) = (i.min(j), i.max(j));
                let row = next == k + 1 && next % nx > 0;
                if row || next == k + nx { -weights[2 * k + usize::from(row)] } else { 0.0 }
            });
            matrix.set_diagonal(&matrix.column_sum().map(|sum| slack - sum));
            let found = young(rates(&matrix, 1.0)[0]);
            let below = 0.3 + part * (found - 0.3);
            prop_assert!((best(rates(&matrix, below)[1], below) - found).abs() < 1e-6);
            let beyond = found + part * (2.0 - found);
            prop_assert!((rates(&matrix, beyond)[1] - (beyond - 1.0)).abs() < 1e-6);
        }

        /// Where the rates are Young's, the search ends near the best.
        #[test]
        fn the_best_alpha_is_found(slowness in 1e-4..0.5_f64) {
            let mu = 1.0 - slowness;
            let (found, mut search, mut residual) = (young(mu), Search::new(), 1.0);
            for _ in 0..(100.0 / (2.0 - found)) as usize {
                search.see(residual);
                let (twice, product) = (search.alpha * mu, search.alpha - 1.0);
                let root = 0.5 * (twice + (twice * twice - 4.0 * product).max(0.0).sqrt());
                residual *= root.powi(2).max(product);
            }
            let ratio = (2.0 - search.alpha) / (2.0 - found);
            prop_assert!((1.0 - 1e-6..1.04).contains(&ratio) && search.failures == 0, "{ratio}");
        }
    }

    /// An odd ring is not consistently ordered, and its rate does not tell the best α.
    #[test]
    fn without_a_consistent_order_the_rate_does_not_tell() {
        let entry = |i: usize, j: usize| [3.0, -1.0, 0.0, 0.0, -1.0][(i + 5 - j) % 5];
        let [mu, rate] = rates(&DMatrix::from_fn(5, 5, entry), 1.0);
        assert!((best(rate, 1.0) - young(mu)).abs() > 5e-3);
    }

    /// Of 10⁴ sweeps those beyond α = 1.15, which multiply the residual by `factor`, not by 0.99.
    fn beyond(factor: f64) -> (usize, Search) {
        let (mut search, mut residual, mut count) = (Search::new(), 1.0, 0);
        for _ in 0..10_000 {
            search.see(residual);
            let beyond = search.alpha > 1.15;
            count += usize::from(beyond);
            residual *= if beyond { factor } else { 0.99 };
        }
        (count, search)
    }

    /// However small α has become, the search goes on.
    #[test]
    fn windows_of_any_alpha_are_found_at_once() {
        for alpha in (0..2000).map(|k| 0.99_f64.powi(k)).chain([1.0, 1.5, 1.9, 0.0]) {
            let p = window(alpha);
            let left = |p: usize| p as f64 * (alpha - 1.0).abs().powf((p - 1) as f64);
            assert!(p >= 6 && (left(p) <= 0.5 || alpha < 1e-15), "{alpha} {p}");
            assert!(p == 6 || left(p - 1) > 0.5, "{alpha} {p}");
        }
    }

    /// Growth happens once; a residual that stays is met four windows long in log₂(10⁴/6) turns.
    #[test]
    fn an_alpha_that_fails_is_left() {
        let (count, search) = beyond(4.0);
        assert!(count <= 3 && search.failures == 1 && search.alpha <= 1.15, "{count} {search:?}");
        let (count, search) = beyond(1.0);
        assert!(search.failures <= 11 && count <= 11 * 5 * 6, "{count} {search:?}");
    }
}
