use hlcp_core::{Error, FivePoint, Identity, Scalar, assert_lengths};

use super::{check, positive};

/// An American put, one LCP per time step.
///
/// Prices are in units of the strike, `x = ln(spot/strike)`, and time runs back from maturity in
/// units of `2/σ²`, so that the value `u ≥ g`, `g = max(0, 1 − eˣ)`, obeys the Black–Scholes
/// inequality with one number, `k = 2·rate/σ²`:
///
/// ```text
/// u̇ + L u ≥ 0 ,    L u = −u″ − (k − 1)u′ + k u ,
/// with equality where u > g ;    u = g at maturity.
/// ```
///
/// The unknown is the value of waiting, `z = u − g ≥ 0`, and `r ≥ 0` is what waiting loses where it
/// pays to exercise. The grid has `m` points to a standard deviation `s = σ√T` of `x` and one at
/// the strike; it ends below at the perpetual put's exercise price `k/(k + 1)`, where every put is
/// exercised, or `6 + (k + 1)s/2` standard deviations away if that is nearer, and above at that
/// distance: there `z` is below 1e-8.
///
/// # Stepping
///
/// With central differences and Crank–Nicolson steps `Δ`, all LCPs share `A = I + ½ΔL`, three
/// numbers, and `B = I`. The first two steps are taken as two implicit Euler steps each, whose
/// matrix is the same `A` (Rannacher's start, which damps what the kink of `g` excites):
/// [`lcps`](Self::lcps) problems for `steps` steps. [`q`](Self::q) makes the next right-hand side
/// of the last `z`; any method solves it, best from the last modulus variable:
///
/// ```
/// use hlcp_core::{Aor, Hlcp, LinearOperator, Omega};
/// use hlcp_methods::{Limits, Options, Solver, Tmms};
/// use hlcp_verify::AmericanPut;
///
/// let put = AmericanPut { rate: 0.06, volatility: 0.2, maturity: 1.0, m: 32, steps: 32 };
/// let (a, b) = put.pose::<f64>()?;
/// let mut q = vec![0.0; a.order()];
/// let problem = Hlcp::from_pair(a, b)?;
/// let mut solver = Solver::new(Tmms::mirrored(problem, Aor::gauss_seidel())?);
/// for k in 0..put.lcps() {
///     put.q(k, solver.z(), &mut q);
///     assert!(solver.solve(&q, Options::resume())?.converged());
/// }
/// let price = 40.0 * put.price(solver.z(), 36.0 / 40.0);
/// assert!((price - 4.4867).abs() < 2e-3); // QuantLib's reference value is 4.48667344
/// // from k/(k + 1) = 3/4, the perpetual put's
/// assert!((0.75..1.0).contains(&put.exercise(solver.z())));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
///
/// # Theory
///
/// `A` is a strictly dominant M-matrix, and with `B = I` assumption (II) is void: Theorem 2 covers
/// every τ ≥ 1, and Gauss–Seidel converges from any start in a number of iterations that depends on
/// `Δ/h²` alone.
///
/// # Source
///
/// The parabolic inequality: P. Wilmott, J. Dewynne and S. Howison, *Option Pricing* (1993). The
/// start: R. Rannacher, *Finite element solution of diffusion problems with irregular data*, Numer.
/// Math. 43 (1984) 309–327. The reference value 4.48667344 for spot 36, strike 40, rate 6 %,
/// volatility 20 % and one year is that of QuantLib's example of an American option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmericanPut {
    /// The interest rate per year.
    pub rate: f64,
    /// The volatility σ, per square root of a year.
    pub volatility: f64,
    /// The time T to maturity, in years.
    pub maturity: f64,
    /// Grid points per standard deviation σ√T.
    pub m: usize,
    /// Time steps.
    pub steps: usize,
}

/// Implicit Euler steps of half the length that replace the first Crank–Nicolson steps, two each.
const START: usize = 4;

impl AmericanPut {
    /// `A` and `B` of every LCP, in precision `T`.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] unless rate, volatility and maturity are positive and finite, there are
    /// two steps or more, and the grid resolves the drift: `m ≥ |rate − σ²/2| √T/σ`, without which
    /// `A` is no M-matrix.
    pub fn pose<T: Scalar>(&self) -> Result<(FivePoint<T>, Identity), Error> {
        positive("rate", self.rate)?;
        positive("volatility", self.volatility)?;
        positive("maturity", self.maturity)?;
        check("steps", self.steps as f64, self.steps >= 2, "at least 2")?;
        let drift = self.deviation() * (self.k() - 1.0).abs() / 2.0;
        let range = "positive and at least |rate - volatility^2/2| sqrt(maturity)/volatility";
        check("m", self.m as f64, self.m > 0 && self.m as f64 >= drift, range)?;
        let points = self.below() + self.above() - 1.0;
        let range = "less than 2^31";
        check("the number of grid points", points, points < 2f64.powi(31), range)?;
        let [west, centre, east] = self.row();
        let a = [0.0, west, 1.0 + centre, east, 0.0].map(T::of);
        let order = points as usize;
        Ok((FivePoint::new(order, 1, a)?, Identity { order }))
    }

    /// How many LCPs there are.
    pub fn lcps(&self) -> usize {
        self.steps + START / 2
    }

    /// Overwrites `q` with that of LCP number `k`, for the `z` of the one before; 0 at maturity.
    ///
    /// # Panics
    ///
    /// Unless `z` and `q` have the order of `A`.
    pub fn q<T: Scalar>(&self, k: usize, z: &[T], q: &mut [T]) {
        let n = self.order();
        assert_lengths(n, [("z", z.len()), ("q", q.len())]);
        let [west, centre, east] = self.row();
        // A half step of L, by a row's neighbours.
        let half =
            |before: f64, here: f64, after: f64| west * before + centre * here + east * after;
        for i in 0..n {
            let pay = |i: usize| self.payoff(i as f64 - 1.0);
            let gain = half(pay(i), pay(i + 1), pay(i + 2));
            let before = if i > 0 { z[i - 1].wide() } else { 0.0 };
            let (here, after) = (z[i].wide(), z.get(i + 1).map_or(0.0, |&z| z.wide()));
            q[i] = T::of(if k < START {
                gain - here
            } else {
                2.0 * gain - here + half(before, here, after)
            });
        }
    }

    /// The price in units of the strike, for the spot in units of the strike and the last LCP's
    /// `z`; for one before it, the price at an earlier maturity.
    ///
    /// By a parabola through the nearest points. Beyond the grid's ends the payoff.
    ///
    /// # Panics
    ///
    /// Unless `z` has the order of `A`.
    pub fn price<T: Scalar>(&self, z: &[T], spot: f64) -> f64 {
        let n = self.order();
        assert_lengths(n, [("z", z.len())]);
        let place = self.below() - 1.0 + spot.ln() / self.spacing();
        let nearest = place.round();
        if !(0.0..n as f64).contains(&nearest) {
            return (1.0 - spot).max(0.0);
        }
        let value = |i: usize| {
            let z = if (1..=n).contains(&i) { z[i - 1].wide() } else { 0.0 };
            self.payoff(i as f64 - 1.0) + z
        };
        let i = nearest as usize;
        let ([before, here, after], t) = ([i, i + 1, i + 2].map(value), place - nearest);
        here + t * ((after - before) + t * (after - 2.0 * here + before)) / 2.0
    }

    /// The largest grid price, in units of the strike, at and below which the put is exercised.
    ///
    /// # Panics
    ///
    /// Unless `z` has the order of `A`.
    ///
    /// ```
    /// use hlcp_core::LinearOperator;
    /// use hlcp_verify::AmericanPut;
    ///
    /// let put = AmericanPut { rate: 0.06, volatility: 0.2, maturity: 1.0, m: 32, steps: 32 };
    /// let (a, _) = put.pose::<f64>()?;
    /// // At maturity, where z = 0, it is exercised at every price up to the strike.
    /// assert_eq!(put.exercise(&vec![0.0; a.order()]), 1.0);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn exercise<T: Scalar>(&self, z: &[T]) -> f64 {
        assert_lengths(self.order(), [("z", z.len())]);
        let waiting = z.iter().position(|&z| z > T::zero()).unwrap_or(self.below() as usize);
        ((waiting as f64 - self.below()) * self.spacing()).exp()
    }

    fn k(&self) -> f64 {
        2.0 * self.rate / (self.volatility * self.volatility)
    }

    /// The standard deviation `s = σ√T`.
    fn deviation(&self) -> f64 {
        self.volatility * self.maturity.sqrt()
    }

    fn spacing(&self) -> f64 {
        self.deviation() / self.m as f64
    }

    /// The grid's cells above the strike.
    fn above(&self) -> f64 {
        ((6.0 + (self.k() + 1.0) * self.deviation() / 2.0) * self.m as f64).ceil()
    }

    /// The grid's cells below the strike.
    fn below(&self) -> f64 {
        (self.k().recip().ln_1p() / self.spacing()).ceil().min(self.above())
    }

    fn order(&self) -> usize {
        (self.below() + self.above()) as usize - 1
    }

    /// The payoff at point `i`.
    fn payoff(&self, i: f64) -> f64 {
        (-((i + 1.0 - self.below()) * self.spacing()).exp_m1()).max(0.0)
    }

    /// The row of `½ΔL`.
    fn row(&self) -> [f64; 3] {
        let (k, h) = (self.k(), self.spacing());
        let half = self.deviation() * self.deviation() / (4.0 * self.steps as f64);
        let (diffusion, drift) = (half / (h * h), half * (k - 1.0) / (2.0 * h));
        [drift - diffusion, 2.0 * diffusion + half * k, -drift - diffusion]
    }
}
