use hlcp_core::{Error, Hlcp, Norms, Rhs, Scalar};

use crate::{Clock, Method, Work, krylov::add, method::iterate};

/// A residual that grows by more than this factor in one iteration ends the window.
///
/// The differences then belong to another linear piece of F.
const GROWN: f64 = 2.0;

/// A mixture is kept only while its residual is at most this many times the start's, over the
/// number of iterations.
const SLACK: f64 = 100.0;

/// Anderson acceleration of any method, safeguarded.
///
/// Let `G(x)` be one iteration of the base method, all its steps, and `f(x) = G(x) − x`. With the
/// differences of the last `m` iterates, `ΔGⱼ = G(xʲ⁺¹) − G(xʲ)` and `Δfⱼ` likewise, one iteration
/// is
///
/// ```text
/// c = argmin ‖f(x) − Σ cⱼ Δfⱼ‖₂ ,    x⁺ = G(x) − Σ cⱼ ΔGⱼ .
/// ```
///
/// On a linear problem that is in essence GMRES on the base's splitting (Walker and Ni); where F is
/// linear near the solution, as it is here wherever no `zᵢ = rᵢ = 0`, it becomes so at last.
///
/// # Safeguard
///
/// All of it reads residuals that the base yields for nothing.
///
/// * When the residual more than doubles in one iteration the window starts anew.
/// * A difference that depends on newer ones, to half the digits of double precision in the
///   products, is left out with all older ones.
/// * A mixture whose residual exceeds `100/k` times that of the start, `k` counting iterations, is
///   given up for the plain iterate `G(x)` it was made of.
///
/// # Cost
///
/// One iteration of the base, `2m` inner products and `m` additions of vectors: for `m = 10` some
/// 20 vectors are read, which takes longer than a fused sweep. `(2m + 3)n` numbers, all allocated
/// by [`new`](Self::new). Where squares of the data overflow or vanish in double precision, beyond
/// 10^±150, the iteration is the plain one.
///
/// # Convergence
///
/// Where the base converges for every `q` by a theorem of `docs/theory.md`, from any start:
/// mixtures that are kept have residuals that tend to zero, so their errors do, and what lies
/// between them contracts. A mixture that is given up is at most a constant times as far off as
/// what it was made of, where the base contracts in a norm; where that is known of the sum of the
/// column theorem alone, nothing is claimed of such a mixture. (The idea is that of Zhang,
/// O'Donoghue and Boyd.)
///
/// # Source
///
/// D. G. Anderson, *Iterative procedures for nonlinear integral equations*, J. ACM 12 (1965); H. F.
/// Walker and P. Ni, *Anderson acceleration for fixed-point iterations*, SIAM J. Numer. Anal. 49
/// (2011); J. Zhang, B. O'Donoghue and S. Boyd, *Globally convergent type-I Anderson acceleration
/// for nonsmooth fixed-point iterations*, SIAM J. Optim. 30 (2020).
///
/// ```
/// use hlcp_methods::{
///     Anderson, Aor, FivePoint, Hlcp, Identity, Limits, Omega, Options, Solver, Tmms,
/// };
///
/// let a = FivePoint::new(16, 16, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, Identity { order: 256 }, Omega::Uniform(4.0))?;
/// let base = Tmms::mirrored(problem, Aor::gauss_seidel().accelerated())?;
/// let q: Vec<f64> = (0..256).map(|i| (0.05 * i as f64).sin() - 0.2).collect();
///
/// let plain = Solver::new(base.clone()).solve(&q, Options::from_x(&[1.0; 256]))?;
/// let fast = Solver::new(Anderson::new(base, 10)?).solve(&q, Options::from_x(&[1.0; 256]))?;
/// assert!(fast.converged() && 5 * fast.iterations < plain.iterations);
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Anderson<T, M> {
    base: M,
    window: usize,
    // G and f at the last iterate, and their differences: slot j of `dg` and `df` is n numbers from
    // j n on.
    g: Vec<T>,
    f: Vec<T>,
    dg: Vec<T>,
    df: Vec<T>,
    between: Vec<T>,
    mixing: Mixing,
    history: History,
}

/// The numbers that an iteration remembers, apart from vectors.
#[derive(Debug, Clone, Copy, Default)]
struct History {
    /// Iterations since the restart.
    iterations: usize,
    /// Differences since the window began.
    differences: usize,
    /// True if `g` and `f` are those of the last iterate.
    follows: bool,
    /// True if the next iterate is a mixture.
    mixed: bool,
    /// The residual at the start, and at the last iterate.
    first: f64,
    last: f64,
}

impl<T: Scalar, M: Method<T>> Anderson<T, M> {
    /// The method `base`, accelerated with the last `window` differences.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for a window of 0, or one whose vectors no memory can hold.
    pub fn new(base: M, window: usize) -> Result<Self, Error> {
        let n = base.problem().order();
        // The largest array is `window` vectors, or as many products as pairs of them.
        let largest = window.saturating_mul(n.max(window));
        if window == 0 || Vec::<f64>::new().try_reserve_exact(largest).is_err() {
            let range = "at least 1, and small enough to store";
            return Err(Error::Parameter { name: "window", value: window as f64, range });
        }
        let zeros = |count: usize| vec![T::zero(); count * n];
        Ok(Self {
            base,
            window,
            g: zeros(1),
            f: zeros(1),
            dg: zeros(window),
            df: zeros(window),
            between: zeros(1),
            mixing: Mixing::new(window),
            history: History::default(),
        })
    }

    /// Takes the differences to `G(x)`, which is in `y`, and returns how many are in the window.
    fn difference(&mut self, x: &[T], y: &[T]) -> usize {
        let n = x.len();
        let moved = || x.iter().zip(y).zip(&self.f).any(|((&x, &y), &f)| y - x != f);
        // A step that is taken again tells nothing new.
        if self.history.follows && self.base.problem().any(moved()) {
            let slot = self.history.differences % self.window;
            let (dg, df) = (&mut self.dg[slot * n..][..n], &mut self.df[slot * n..][..n]);
            for i in 0..n {
                (dg[i], df[i]) = (y[i] - self.g[i], y[i] - x[i] - self.f[i]);
            }
            self.history.differences += 1;
            for j in 0..self.history.differences.min(self.window) {
                let product =
                    self.base.problem().dot(&self.df[j * n..][..n], &self.df[slot * n..][..n]);
                self.mixing.set_product(slot, j, product);
            }
        }
        for i in 0..n {
            (self.g[i], self.f[i]) = (y[i], y[i] - x[i]);
        }
        self.history.follows = true;
        self.history.differences.min(self.window)
    }
}

impl<T: Scalar, M: Method<T>> Method<T> for Anderson<T, M> {
    type A = M::A;
    type B = M::B;

    fn problem(&self) -> &Hlcp<T, M::A, M::B> {
        self.base.problem()
    }

    fn work(&self) -> Option<Work> {
        self.base.work()
    }

    fn restart(&mut self) {
        self.base.restart();
        self.history = History::default();
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn works_on_ranks(&self) -> bool {
        self.base.works_on_ranks()
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        let norms = iterate(&mut self.base, q, x, y, &mut self.between, clock);
        if clock.is_up() {
            return norms;
        }
        let (n, residual, history) = (x.len(), norms.l2, &mut self.history);
        if history.iterations == 0 {
            history.first = residual;
        }
        history.iterations += 1;
        if history.mixed && residual > SLACK * history.first / history.iterations as f64 {
            (history.follows, history.mixed, history.differences) = (false, false, 0);
            y.copy_from_slice(&self.g);
            return norms;
        }
        if residual > GROWN * history.last {
            (history.follows, history.differences) = (false, 0);
        }
        history.last = residual;
        let count = self.difference(x, y);
        let newest = self.history.differences + self.window - 1;
        let slots = (0..count).map(|age| (newest - age) % self.window);
        let (problem, df, f) = (self.base.problem(), &self.df, &self.f);
        let mixture = self.mixing.solve(slots, |j| problem.dot(&df[j * n..][..n], f));
        self.history.mixed = !mixture.is_empty();
        for &(j, c) in mixture {
            add(y, -c, &self.dg[j * n..][..n]);
        }
        norms
    }
}

/// The small least-squares problem `min ‖f − Σ cⱼ Δfⱼ‖₂`, by the products of its columns.
#[derive(Debug, Clone)]
struct Mixing {
    window: usize,
    /// `ΔfᵢᵀΔfⱼ` by slots.
    products: Vec<f64>,
    /// The Cholesky factor of the products, by ages.
    factor: Vec<f64>,
    /// The slots that take part, and their coefficients.
    mixture: Vec<(usize, f64)>,
}

impl Mixing {
    fn new(window: usize) -> Self {
        Self {
            window,
            products: vec![0.0; window * window],
            factor: vec![0.0; window * window],
            mixture: Vec::with_capacity(window),
        }
    }

    fn set_product(&mut self, i: usize, j: usize, product: f64) {
        self.products[i * self.window + j] = product;
        self.products[j * self.window + i] = product;
    }

    /// The coefficients by slot, for columns in `slots`, newest first, with `Δfⱼᵀf` = `rhs(j)`.
    fn solve(
        &mut self,
        slots: impl Iterator<Item = usize>,
        rhs: impl Fn(usize) -> f64,
    ) -> &[(usize, f64)] {
        let (m, l) = (self.window, &mut self.factor);
        self.mixture.clear();
        for slot in slots {
            let row = self.mixture.len();
            let mut value = rhs(slot);
            let whole = self.products[slot * m + slot];
            let mut pivot = whole;
            for (j, &(other, u)) in self.mixture.iter().enumerate() {
                let inner: f64 = (0..j).map(|k| l[row * m + k] * l[j * m + k]).sum();
                let entry = (self.products[slot * m + other] - inner) / l[j * m + j];
                l[row * m + j] = entry;
                value -= entry * u;
                pivot -= entry * entry;
            }
            let dependent = pivot.is_nan() || pivot <= f64::EPSILON.sqrt() * whole;
            if dependent || !value.is_finite() {
                break;
            }
            l[row * m + row] = pivot.sqrt();
            self.mixture.push((slot, value / pivot.sqrt()));
        }
        for i in (0..self.mixture.len()).rev() {
            self.mixture[i].1 /= l[i * m + i];
            let c = self.mixture[i].1;
            for j in 0..i {
                self.mixture[j].1 -= l[i * m + j] * c;
            }
        }
        &self.mixture
    }
}
