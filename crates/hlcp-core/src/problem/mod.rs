//! The problem, and what is computed of it as a whole.

mod gauss_seidel;
mod rounding;
mod shared;
mod smoother;

use std::{ops::Range, sync::Arc};

use crate::{
    kernel::Sweep,
    numbers::{
        Error, Meter, Norms, Part, Rhs, Scalar, Stretches, Tally, all_finite, assert_lengths,
        check_orders, positive,
    },
    operators::{FivePointView, Identity, LinearOperator, Omega, Rows, RowsOf},
    parallel::{Claims, Shared, Strip, team, totals},
};

/// Unknowns that one thread recovers in one go.
const PORTION: usize = 1024;

/// The problem HLCP(A, B, q) in modulus form.
///
/// The problem is to find `z, r ∈ Tⁿ` with
///
/// ```text
/// A z − B r + q = 0,    z ≥ 0,    r ≥ 0,    zᵀ r = 0.
/// ```
///
/// For a positive diagonal Ω and a positive γ, the modulus variable `x` with `z = (|x| + x)/γ` and
/// `r = Ω(|x| − x)/γ` satisfies the three conditions by construction, and what is left is one
/// equation, (2) of the paper with everything on one side:
///
/// ```text
/// F(x) = (A + BΩ) x + (A − BΩ)|x| + γ q = γ (A z − B r + q) = 0.
/// ```
///
/// `q` is given to each call, so that one value serves many right-hand sides.
///
/// # Scaling
///
/// Multiplying `q` by a positive number multiplies `z`, `r` and `x` by it. Multiplying γ multiplies
/// `x` alone. Multiplying Ω stretches the negative part of `x`; `z` and `r` stay.
///
/// # Panics
///
/// Every method panics unless the vectors it is given have length `n`.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Omega};
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?;
/// let b = FivePoint::new(2, 1, [0.0, 0.0, 2.0, 0.0, 0.0])?;
/// let problem = Hlcp::new(a, b, Omega::Uniform(1.5))?;
///
/// let (mut z, mut r) = ([0.0; 2], [0.0; 2]);
/// problem.solution_from_x(&[1.0, -2.0], &mut z, &mut r);
/// assert_eq!((z, r), ([2.0, 0.0], [0.0, 6.0]));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Hlcp<T, A, B> {
    // Invariant: `a` and `b` share one order n ≥ 1, which `omega` fits; `omega` and `gamma` are
    // positive and finite.
    a: A,
    b: B,
    omega: Omega<T>,
    gamma: T,
    // Whether this is HLCP(B, A, −q) for the problem HLCP(A, B, q) that was posed.
    exchanged: bool,
    // Whether the threads of rayon's current pool share the work.
    parallel: bool,
    // The ranks that share the work, of which this one has a part.
    shared: Option<Arc<Shared<T>>>,
}

impl<T: Scalar, A: Rows<T>> Hlcp<T, A, Identity> {
    /// Poses the linear complementarity problem LCP(A, q), that is B = I, with Ω = |D_A| and γ = 1;
    /// zeros of the diagonal give way to the largest entries of their rows.
    ///
    /// # Errors
    ///
    /// [`Error::Empty`] for order 0; [`Error::NotPositive`] for the first diagonal entry that is
    /// not finite.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Omega};
    ///
    /// let a = FivePoint::new(3, 3, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// let problem = Hlcp::lcp(a)?;
    /// assert_eq!((problem.order(), problem.omega()), (9, &Omega::Uniform(4.0)));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn lcp(a: A) -> Result<Self, Error> {
        let b = Identity { order: a.order() };
        Self::from_pair(a, b)
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Hlcp<T, A, B> {
    /// Poses the problem for all `q`, with γ = 1 and the Ω = D_A D_B⁻¹ of
    /// [`Omega::diagonal_ratio`].
    ///
    /// # Errors
    ///
    /// Those of [`Omega::diagonal_ratio`] and of [`new`](Self::new).
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Identity, Omega, Scaled};
    ///
    /// let a = FivePoint::new(3, 3, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// let problem = Hlcp::from_pair(a, Scaled { by: 0.5, of: Identity { order: 9 } })?;
    /// assert_eq!(problem.omega(), &Omega::Uniform(8.0));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn from_pair(a: A, b: B) -> Result<Self, Error> {
        let omega = Omega::diagonal_ratio(T::one(), &a, &b)?;
        Self::new(a, b, omega)
    }
}

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Hlcp<T, A, B> {
    /// Poses the problem for all `q`, with γ = 1.
    ///
    /// # Errors
    ///
    /// Those of [`LinearOperator::check`]; [`Error::Empty`] for order 0; [`Error::Order`] when
    /// `b` or `omega` does not fit `a`, or an operator shows a grid of another order than its own;
    /// [`Error::Parameter`] or [`Error::NotPositive`] for an ω that is not positive and finite.
    pub fn new(a: A, b: B, omega: Omega<T>) -> Result<Self, Error> {
        a.check("A")?;
        b.check("B")?;
        let n = a.order();
        if n == 0 {
            return Err(Error::Empty { what: "A" });
        }
        check_orders(n, &[("B", b.order())])?;
        for (what, view) in
            [("the grid of A", a.as_five_point()), ("the grid of B", b.as_five_point())]
        {
            if let Some([nx, ny]) = view.and_then(|view| view.grid()) {
                check_orders(n, &[(what, nx.saturating_mul(ny))])?;
            }
        }
        omega.check(n)?;
        Ok(Self { a, b, omega, gamma: T::one(), exchanged: false, parallel: false, shared: None })
    }

    /// Returns the same problem with another γ.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] unless γ is positive, finite and not subnormal.
    ///
    /// ```
    /// use hlcp_core::{Hlcp, Identity, Omega};
    ///
    /// let identity = Identity { order: 2 };
    /// let problem = Hlcp::new(identity, identity, Omega::Uniform(3.0))?.with_gamma(4.0)?;
    /// let (mut z, mut r) = ([0.0; 2], [0.0; 2]);
    /// problem.solution_from_x(&[4.0, -8.0], &mut z, &mut r); // what (1, −2) is with γ = 1
    /// assert_eq!((z, r), ([2.0, 0.0], [0.0, 12.0]));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn with_gamma(self, gamma: T) -> Result<Self, Error> {
        positive("gamma", gamma.wide())?;
        if !gamma.is_normal() {
            let range = "no smaller than the smallest normal number";
            return Err(Error::Parameter { name: "gamma", value: gamma.wide(), range });
        }
        Ok(Self { gamma, ..self })
    }

    /// Returns the same problem with the roles of `z` and `r` exchanged, Remark 3 of the paper.
    ///
    /// `(z, r)` solves HLCP(A, B, q) exactly when `(r, z)` solves HLCP(B, A, −q). Methods then work
    /// on the second, with Ω⁻¹ for Ω, and theorems ask of (B, A) what they ask of (A, B); `q`, `z`
    /// and `r` stay those of the first.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] or [`Error::NotPositive`] when the reciprocal of an ω overflows or
    /// vanishes.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
    ///
    /// let b = FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
    /// let problem = Hlcp::new(Identity { order: 2 }, b, Omega::Uniform(0.25))?.exchanged()?;
    /// assert_eq!(problem.omega(), &Omega::Uniform(4.0));
    ///
    /// let (mut z, mut r) = ([0.0; 2], [0.0; 2]);
    /// problem.solution_from_x(&[1.0, -2.0], &mut z, &mut r);
    /// // a positive x is an r of the problem as posed
    /// assert_eq!((z, r), ([0.0, 16.0], [2.0, 0.0]));
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn exchanged(self) -> Result<Hlcp<T, B, A>, Error> {
        let shared = self.exchanged_shared();
        let Self { a, b, gamma, exchanged, parallel, .. } = self;
        let omega = match self.omega {
            Omega::Uniform(omega) => Omega::Uniform(omega.recip()),
            Omega::Each(omega) => Omega::Each(omega.into_iter().map(T::recip).collect()),
        };
        omega.check(a.order())?;
        Ok(Hlcp { a: b, b: a, omega, gamma, exchanged: !exchanged, parallel, shared })
    }

    /// Returns the same problem, worked on by the threads of rayon's current pool; without this
    /// call, by the caller's alone.
    ///
    /// The current pool is the one whose [`install`](rayon::ThreadPool::install) surrounds the
    /// call, and rayon's global one outside of any. From 16384 unknowns on, threads share
    /// [`solution_from_x`](Self::solution_from_x), [`residual`](Self::residual) on grids, and the
    /// sweeps that [`has_shared_sweeps`](Self::has_shared_sweeps) names, with the same bits for any
    /// number of threads. A sweep allocates two rows of the grid and what rayon allocates to wake
    /// its threads.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
    ///
    /// let a = FivePoint::new(200, 200, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 40_000 }, Omega::Uniform(4.0))?.in_parallel();
    /// let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    /// let (x, mut z, mut r) = (vec![-1.5; 40_000], vec![0.0; 40_000], vec![0.0; 40_000]);
    /// pool.install(|| problem.solution_from_x(&x, &mut z, &mut r));
    /// assert_eq!((z[0], r[39_999]), (0.0, 12.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[cfg(feature = "rayon")]
    pub fn in_parallel(self) -> Self {
        Self { parallel: true, ..self }
    }

    /// Returns whether the sweeps of an [`Aor`](crate::Aor) share their work when threads are asked
    /// for: whether both operators are five-point ones on one grid, of 16384 points or more.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp};
    ///
    /// let a = FivePoint::new(200, 200, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    /// assert!(Hlcp::lcp(a)?.has_shared_sweeps());
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn has_shared_sweeps(&self) -> bool {
        self.order() >= team::WORTH && self.grid().is_ok()
    }

    /// Returns whether threads are to share the work.
    ///
    /// ```
    /// use hlcp_core::{Hlcp, Identity};
    ///
    /// let problem = Hlcp::<f64, _, _>::lcp(Identity { order: 3 })?;
    /// assert!(!problem.is_parallel() && problem.in_parallel().is_parallel());
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn is_parallel(&self) -> bool {
        self.parallel
    }

    /// Returns the order `n`.
    pub fn order(&self) -> usize {
        self.a.order()
    }

    /// Returns the grid of the operators, `[nx, ny]`; of two diagonal ones, which fit any,
    /// `[n, 1]`.
    ///
    /// # Errors
    ///
    /// [`Error::NotFivePoint`] unless both are known as five-point operators, on one grid that
    /// closes in the same directions.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(3, 2, [-1.0, -1.0, 4.0, -1.0, -1.0])?)?;
    /// assert_eq!(problem.grid()?, [3, 2]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn grid(&self) -> Result<[usize; 2], Error> {
        let shape = |view: FivePointView<'_, T>| view.grid().map(|grid| (grid, view.round()));
        match self.views()?.map(shape) {
            [Some(a), Some(b)] if a != b => Err(Error::NotFivePoint { what: "B" }),
            [a, b] => Ok(a.or(b).map_or_else(
                || self.strip().map_or([self.order(), 1], Strip::grid),
                |(grid, _)| grid,
            )),
        }
    }

    /// Returns whether the grid of the operators closes round along `[x, y]`.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp};
    ///
    /// let a = FivePoint::new(5, 3, [-1.0, -1.0, 5.0, -1.0, -1.0])?.periodic([true, false])?;
    /// assert_eq!(Hlcp::lcp(a)?.round(), [true, false]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn round(&self) -> [bool; 2] {
        let views = [self.a.as_five_point(), self.b.as_five_point()];
        let rounds = views.map(|view| view.map_or([false; 2], |view| view.round()));
        [0, 1].map(|axis| rounds.iter().any(|round| round[axis]))
    }

    /// Returns the sweep over both operators, if they are five-point ones on one grid.
    pub(crate) fn sweep(&self) -> Result<Sweep<'_, T>, Error> {
        let views = self.views()?;
        let factors = [self.gamma, self.q_factor()];
        let (grid, round, shared) = (self.grid()?, self.round(), self.shared.as_deref());
        Ok(Sweep::new((grid, round), views, &self.omega, factors, self.parallel, shared))
    }

    /// Returns both operators as five-point ones.
    fn views(&self) -> Result<[FivePointView<'_, T>; 2], Error> {
        let a = self.a.as_five_point().ok_or(Error::NotFivePoint { what: "A" })?;
        let b = self.b.as_five_point().ok_or(Error::NotFivePoint { what: "B" })?;
        Ok([a, b])
    }

    /// Works on the rows of both operators, if these have them assembled or are diagonal.
    pub(crate) fn on_known_rows<R>(&self, work: impl FnOnce([RowsOf<'_, T>; 2]) -> R) -> Option<R> {
        let (a, b) = (self.a.as_csr(), self.b.as_csr());
        Some(work([RowsOf::known(&self.a, a.as_ref())?, RowsOf::known(&self.b, b.as_ref())?]))
    }

    /// Returns the operator `A`, after an exchange the posed problem's `B`.
    pub fn a(&self) -> &A {
        &self.a
    }

    /// Returns the operator `B`, after an exchange the posed problem's `A`.
    pub fn b(&self) -> &B {
        &self.b
    }

    /// Returns the diagonal matrix Ω.
    pub fn omega(&self) -> &Omega<T> {
        &self.omega
    }

    /// Returns the number γ.
    pub fn gamma(&self) -> T {
        self.gamma
    }

    /// Returns the factor of `q` in F: γ, and −γ after an exchange.
    pub fn q_factor(&self) -> T {
        if self.exchanged { -self.gamma } else { self.gamma }
    }

    /// Overwrites `z` and `r` with `(|x| + x)/γ` and `Ω(|x| − x)/γ`.
    ///
    /// Both are non-negative and `zᵢ rᵢ = 0` exactly, for every `x` of which `2|x|` is finite; an
    /// entry that overflows is infinite.
    pub fn solution_from_x(&self, x: &[T], z: &mut [T], r: &mut [T]) {
        self.assert_orders([("x", x.len()), ("z", z.len()), ("r", r.len())]);
        let (z, r) = if self.exchanged { (r, z) } else { (z, r) };
        let portions = x.chunks(PORTION).zip(z.chunks_mut(PORTION)).zip(r.chunks_mut(PORTION));
        let portions = Claims::new(portions.enumerate());
        team::spread(team::threads(self.parallel, x.len()), &|| {
            while let Some((number, ((x, z), r))) = portions.next() {
                for ((&x, z), r) in x.iter().zip(&mut *z).zip(&mut *r) {
                    *z = x.abs() + x;
                    *r = x.abs() - x;
                }
                match &self.omega {
                    Omega::Uniform(omega) => r.iter_mut().for_each(|r| *r = *omega * *r),
                    Omega::Each(omega) => {
                        let omega = &omega[number * PORTION..];
                        r.iter_mut().zip(omega).for_each(|(r, &omega)| *r = omega * *r);
                    }
                }
                if self.gamma != T::one() {
                    z.iter_mut().chain(r).for_each(|v| *v /= self.gamma);
                }
            }
        });
    }

    /// Overwrites `x` with `(γ/2)(z − Ω⁻¹r)`, the modulus variable that `z` and `r` are recovered
    /// from, by which a known solution becomes a start.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Omega};
    ///
    /// let a = FivePoint::new(2, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?;
    /// let problem = Hlcp::new(a, a, Omega::Uniform(1.5))?;
    /// let mut x = [0.0; 2];
    /// problem.x_from_solution(&[2.0, 0.0], &[0.0, 6.0], &mut x);
    /// assert_eq!(x, [1.0, -2.0]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn x_from_solution(&self, z: &[T], r: &[T], x: &mut [T]) {
        self.assert_orders([("z", z.len()), ("r", r.len()), ("x", x.len())]);
        let (z, r) = if self.exchanged { (r, z) } else { (z, r) };
        let half = self.gamma / (T::one() + T::one());
        for (i, x) in x.iter_mut().enumerate() {
            *x = half * (z[i] - r[i] / self.omega.entry(i));
        }
    }

    /// Overwrites `f` with F(x).
    ///
    /// # Cost
    ///
    /// One product with `A`, one with `B`. `scratch` grows to `2n` numbers, of which none matters
    /// between calls.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
    ///
    /// let a = FivePoint::new(2, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(1.5))?.with_gamma(2.0)?;
    /// let (x, mut f) = ([2.0, -4.0], [0.0; 2]); // z = (2, 0), r = (0, 6)
    /// problem.defect(&[-6.0, 8.5], &x, &mut f, &mut vec![]);
    /// assert_eq!(f, [2.0 * (6.0 - 6.0), 2.0 * (-2.0 - 6.0 + 8.5)]); // γ(Az − Br + q)
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn defect(&self, q: &[T], x: &[T], f: &mut [T], scratch: &mut Vec<T>) {
        self.assert_orders([("q", q.len()), ("x", x.len()), ("f", f.len())]);
        let (part, product) = halves(scratch, x.len());
        for (u, &x) in part.iter_mut().zip(x) {
            *u = x.abs() + x;
        }
        self.product(false, part, f);
        for (i, (v, &x)) in part.iter_mut().zip(x).enumerate() {
            *v = self.omega.entry(i) * (x.abs() - x);
        }
        self.product(true, part, product);
        for ((f, &bv), &q) in f.iter_mut().zip(&*product).zip(q) {
            *f = *f - bv + self.q_factor() * q;
        }
    }

    /// Overwrites `y` with the product of `A` with `x`, or of `B` if `of_b`; ranks that share
    /// five-point operators give each other the columns that these need.
    pub(crate) fn product(&self, of_b: bool, x: &[T], y: &mut [T]) {
        let view = if of_b { self.b.as_five_point() } else { self.a.as_five_point() };
        match (self.strip(), view) {
            (Some(strip), Some(view)) => {
                let ([nx, _], beside) = (strip.grid(), strip.beside(1, |k| x[k]));
                for (j, y) in y.chunks_exact_mut(nx).enumerate() {
                    let beside = beside.each_ref().map(|column| column.get(j).copied());
                    view.product(nx, j, 0, x, beside, y);
                }
            }
            // As the ranks do it, with the same rounding.
            (None, Some(view)) => view.apply(view.grid().unwrap_or([x.len(), 1]), x, y),
            (_, None) if of_b => self.b.apply(x, y),
            (_, None) => self.a.apply(x, y),
        }
    }

    /// Returns the norms of `A z − B r + q`, for any `z` and `r`, of the problem as posed.
    ///
    /// Of the other conditions, the signs and `zᵀ r = 0`, they say nothing; what
    /// [`solution_from_x`](Self::solution_from_x) writes meets those.
    ///
    /// # Cost
    ///
    /// One product with `A`, one with `B`, and `scratch` as of [`defect`](Self::defect); for
    /// five-point operators on one grid a single pass without scratch.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Identity, Omega, Rhs};
    ///
    /// let a = FivePoint::new(2, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?;
    /// let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(1.5))?;
    /// let (z, r) = ([2.0, 0.0], [0.0, 6.0]);
    /// let norms = problem.residual(&Rhs::new(&[-3.0, 4.0])?, &z, &r, &mut vec![]);
    /// assert_eq!((norms.l2, norms.linf), (5.0, 4.0)); // of (6 − 0 − 3, −2 − 6 + 4)
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn residual(&self, q: &Rhs<'_, T>, z: &[T], r: &[T], scratch: &mut Vec<T>) -> Norms {
        self.assert_orders([("q", q.entries().len()), ("z", z.len()), ("r", r.len())]);
        self.assert_whole(q);
        if let Ok(sweep) = self.sweep() {
            return q.measured(|meter| sweep.residual(q, z, r, meter));
        }
        let (az, br) = halves(scratch, z.len());
        self.product(self.exchanged, z, az);
        self.product(!self.exchanged, r, br);
        for ((az, &br), &q) in az.iter_mut().zip(&*br).zip(q.entries()) {
            *az = *az - br + q;
        }
        q.measured(|meter| self.measure(meter, az, T::one()))
    }

    /// Checks `q` for this problem, and measures it.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] unless `q` has length `n`, [`Error::NotFinite`] for the first entry that is
    /// NaN or infinite.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
    /// assert_eq!(problem.rhs(&[3.0, -4.0])?.norms().l2, 5.0);
    /// assert!(problem.rhs(&[3.0]).is_err());
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn rhs<'q>(&self, q: &'q [T]) -> Result<Rhs<'q, T>, Error> {
        self.check_vector("q", q)?;
        Ok(Rhs::measured_as(q, self.norms(q), self.whole_order()))
    }

    /// Refuses a vector that has not length `n`, or an entry that is NaN or infinite.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] or [`Error::NotFinite`], with `what`.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
    /// assert_eq!(problem.check_vector("x0", &[3.0, -4.0]), Ok(()));
    /// assert!(problem.check_vector("x0", &[3.0, f64::NAN]).is_err());
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn check_vector(&self, what: &'static str, v: &[T]) -> Result<(), Error> {
        let fits = check_orders(self.order(), &[(what, v.len())]);
        self.agree(fits.and_then(|()| all_finite(what, v)))
    }

    /// Returns the norms of a vector of the problem's order, in one pass that threads share.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
    /// assert_eq!(problem.norms(&[3.0, -4.0]).linf, 4.0);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn norms(&self, v: &[T]) -> Norms {
        Meter::measured(1.0, self.whole_order(), |meter| self.measure(meter, v, T::one()))
    }

    /// Returns the inner product of two vectors of the problem's order, summed in double precision
    /// in one pass that threads share.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
    /// assert_eq!(problem.dot(&[3.0, -4.0], &[2.0, 1.0]), 2.0);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn dot(&self, u: &[T], v: &[T]) -> f64 {
        self.assert_orders([("u", u.len()), ("v", v.len())]);
        self.total(&|tally, at| tally.add_products(&u[at.clone()], &v[at])).sum
    }

    /// Returns the norms of a vector in units of a meter, divided by γ.
    pub(crate) fn measure(&self, meter: Meter, v: &[T], gamma: T) -> Norms {
        self.assert_orders([("v", v.len())]);
        meter.norms_of(self.total(&|tally, at| tally.add(meter, &v[at])), gamma)
    }

    /// Sums over all points: `add` takes the indices of some of one row.
    fn total(&self, add: &(dyn Fn(&mut Tally<T>, Range<usize>) + Sync)) -> Part {
        totals(self.stretches(), self.parallel, add).sum(self.strip())
    }

    /// Returns the stretches of the grid, or of all unknowns as one row where there is none.
    fn stretches(&self) -> Stretches {
        match self.strip() {
            Some(strip) => strip.stretches(),
            None => Stretches::of(self.grid().unwrap_or([self.order(), 1])),
        }
    }

    #[track_caller]
    pub(crate) fn assert_orders<const K: usize>(&self, vectors: [(&str, usize); K]) {
        assert_lengths(self.order(), vectors);
    }
}

/// Returns two slices of length `n` of one vector, which grows once.
fn halves<T: Scalar>(scratch: &mut Vec<T>, n: usize) -> (&mut [T], &mut [T]) {
    if scratch.len() < 2 * n {
        scratch.resize(2 * n, T::zero());
    }
    scratch[..2 * n].split_at_mut(n)
}
