use hlcp_core::{Error, Hlcp, Norms, Rhs, Rows, Scalar, check_row};

#[cfg(feature = "direct")]
use crate::cholesky::Cholesky;
use crate::{
    Clock, GROWTH, Method, Status, Work,
    limits::{Cost, FRACTION},
    method::measure,
    monitor::ROUNDING,
    safeguard::ROUGH,
};
use factors::{Factors, worth};
use full::Full;
use inside::Interior;
use paths::{Paths, steps};

mod factors;
mod full;
mod inside;
mod paths;

/// Steps that may change signs while they do not leave three quarters of the fewest wrong
/// ones: before steps inside, and after them or where few are wrong, of so many. A front that has
/// a point or two to go is followed, but from the start's signs it may have far to go.
const PATIENCE: [usize; 2] = [4, 64];
pub(crate) const FEWER: f64 = 0.75;
const FEW: usize = 100;

/// The entries of A and B per row up to which Cholesky factors are looked at beforehand. Trees have
/// four with a diagonal operator, networks of roads and pipes four to five, plane meshes eight.
#[cfg(feature = "direct")]
const FEW_ENTRIES: usize = 5;

/// An elimination that is worth no more sweeps than this is not to be improved on.
pub(crate) const CHEAP: usize = 20;

/// Columns that are all but singular leave no digits: the residual is this many times ‖q‖, or more.
pub(crate) const FAR: f64 = 0.1 * GROWTH;

/// An `x` with a residual of more than this many times ‖q‖ tells nothing of a solution's size.
const NEAR: f64 = 1e3;

/// Principal pivoting in blocks, that is Newton's method by exact elimination: the direct way.
///
/// One iteration solves `J x = −γq` for the columns that some signs select, by exact factors, and
/// changes all signs that come out wrong, as Newton's method does, while every four such steps
/// leave fewer than three quarters of them; where a hundredth is left, every 64, but from the signs
/// of the start.
///
/// Where they do not, it goes through the interior (Mehrotra): with `z, r > 0` it solves
///
/// ```text
/// A Δz − B Δr = −(A z − B r + q) ,   rᵢΔzᵢ + zᵢΔrᵢ = σμuᵢ − zᵢrᵢ − Δz′ᵢΔr′ᵢ ,   μ = Σ zᵢrᵢ/(nuᵢ) ,
/// ```
///
/// first with σ = 0 and without the product, for Δz′ and Δr′, and then with σ = (μ′/μ)³, where μ′
/// is what the first would leave; both by one factorisation. uᵢ is the product of the units of zᵢ
/// and rᵢ in which the columns of (A, B) have about one sum, and so have the rows, and the first z
/// and r have one size in these units, ten times as large after each of the first steps that is
/// short: the steps depend little on what rows, z and r are multiplied by, and not on which of the
/// two is called z. A front that moves by a point with each change of signs is found in some twenty
/// steps. Then signs are changed again.
///
/// An unknown whose columns in `A` and `B` are the same but for a positive factor is free: either
/// column serves, and its sign is never wrong. Equations and unknowns of any sign are such.
///
/// Diagonals may have zeros: quadratic programs, minimise xᵀHx/2 + cᵀx with x ≥ 0 and Gx ≥ h, are
/// such problems with A = (H, −Gᵀ; G, 0), B = I, q = (c, −h) and z = (x, λ), λ the multipliers of
/// Gx ≥ h. That of an equation is free: its column of B is that of A.
///
/// The first columns are those of the start, unless its residual is above a tenth of ‖q‖; then all
/// of that one of `A` and `B` that has more entries, and if these are singular all of the other,
/// before it goes through the interior. From all columns a matrix that conducts sees all wrong
/// signs, while a front that is to grow does so by a point in each step. A step that leads to 10¹⁵
/// times ‖q‖ or more, as columns do that are all but singular, is not taken, and the next way
/// begins.
///
/// Where the interior leaves signs, solutions may not be unique, as of matrices GGᵀ with few
/// columns: each column takes 10⁻⁸ of the other one, and a step solves for the change of `x`, which
/// comes to a solution nearby as the proximal point method does. If rounding is all that is left
/// then, solutions may have no bound, as potentials of nodes between which nothing can flow have
/// none, and the interior leads far out. The columns with shares of 10⁻⁴ find from `x = 0` whether
/// some solution is less than half as large, and changes of signs lead there.
///
/// Where all this rests, Lemke's method is the last way: along a path on which
///
/// ```text
/// A z − B r + q + t g = 0 ,   z, r, t ≥ 0 ,   zᵀr = 0 ,
/// ```
///
/// with a column g that covers what is negative and a large t, one sign changes with each step, and
/// where t is 0 there is a solution. The path begins with all columns of BΩ, but for those that
/// depend on others, so that z is 0 for linear complementarity problems. Where it leaves for ever
/// others begin: with the columns of A, then with about half of each. In turn with them, where no z
/// makes an r smaller, paths begin with the column of one z for g, as those of Lemke and Howson do
/// for games. A step exchanges a column, and full factors serve for fifty steps. This is the way up
/// to an order of 1259 alone, where there is time for n steps.
///
/// The factors are those of a full matrix or, with the feature `direct`, of a sparse one: whichever
/// the pattern of `A` and `B` makes cheaper. Full ones begin with the columns that have one entry,
/// and are taken in units of rows and columns, too, in which pivots show whether rounding has left
/// them; beyond an order of 500 they serve where half of the entries of `A` or `B` are there.
/// Cholesky's serve beyond an order of 64 where one of `A` and `B` is diagonal, but for columns of
/// free unknowns, and the other one symmetric, whatever rows, `z` and `r` are multiplied by: all
/// matrices to be factorised are positive definite then, if solutions are unique for every `q`.
/// Entries across the diagonal may be opposite, as between unknowns and multipliers: LDLᵀ has
/// pivots of two signs then, and exists for steps inside and with shares, whatever the order, and
/// though equations depend on each other. Of what has no such factors they are those of LU with
/// pivots, if these hold few numbers, too. Where a linear or separable program has no inside, as
/// one whose constraints hold only just, rounding may turn pivots of the last steps there, and a
/// large number takes their place.
///
/// # Cost
///
/// An iteration takes one factorisation, two solves with it, or a hundred on a path, and two
/// residuals, of where it sets out and where it leads, and an analysis where the pattern is not
/// that of the one before, as it is inside; one order of elimination serves for all Cholesky
/// factors where multiplications are few.
/// [`work`](Method::work) counts them in sweeps by what their analysis predicts. Sparse LU factors
/// of a plane grid with 90,000 points take 0.35 s and 100 MB, those of a cube with 8000 points
/// 0.15 s, on a core of 2020; a factorisation is not interrupted by a time limit, nor begun where
/// the analysis predicts that it would outlast it: [`Outcome::forgone`](crate::Outcome::forgone)
/// has the numbers.
///
/// # Convergence
///
/// Finitely many steps, up to rounding, where `(A, B)` has the column W-property, which is that
/// solutions are unique for every `q`: `B⁻¹A` is a P-matrix then, its LCP has the same bases, and
/// pivots of P-matrices leave P-matrices, on which Lemke's path ends at a solution wherever it
/// begins; all paths take 20,000 steps at most, and none beyond an order of 1259. That property is
/// that `A D + B E` is regular for all positive diagonals D and E (Sznajder and Gowda), as the
/// steps through the interior need. From all columns of BΩ the path ends at a solution if `B⁻¹A` is
/// strictly semimonotone, as a nonnegative matrix with a positive diagonal is, too, and wherever
/// there is one if it is copositive-plus (Cottle, Pang and Stone, Section 4.4). From the column of
/// any z it ends at an equilibrium of a game with positive costs (`docs/theory.md`). No splitting
/// need converge and no sign need be that of an M-matrix.
///
/// # Source
///
/// J. J. Júdice and F. M. Pires, *A block principal pivoting algorithm for large-scale strictly
/// monotone linear complementarity problems*, Computers and Operations Research 21 (1994); S.
/// Mehrotra, *On the implementation of a primal-dual interior point method*, SIAM J. Optim. 2
/// (1992), here for two matrices; R. Sinkhorn and P. Knopp, *Concerning nonnegative matrices and
/// doubly stochastic matrices*, Pacific J. Math. 21 (1967); R. Sznajder and M. S. Gowda,
/// *Generalizations of P₀- and P-properties*, Linear Algebra Appl. 223/224 (1995); R. J. Vanderbei,
/// *Symmetric quasidefinite matrices*, SIAM J. Optim. 5 (1995); R. T. Rockafellar, *Monotone
/// operators and the proximal point algorithm*, SIAM J. Control Optim. 14 (1976); C. E. Lemke,
/// *Bimatrix equilibrium points and mathematical programming*, Management Science 11 (1965), here
/// for two matrices and any start; C. E. Lemke and J. T. Howson, *Equilibrium points of bimatrix
/// games*, J. SIAM 12 (1964); R. W. Cottle, J.-S. Pang and R. E. Stone, *The linear
/// complementarity problem* (1992).
///
/// ```
/// use hlcp_core::{Hlcp, Identity, Omega, RowMajor};
/// use hlcp_methods::{Limits, Pivoting, Solver};
///
/// // Almost skew: no splitting converges.
/// let a = RowMajor::new(3, vec![0.1, 4.0, -3.0, -4.0, 0.1, 5.0, 3.0, -5.0, 0.1])?;
/// let problem = Hlcp::new(&a, Identity { order: 3 }, Omega::Uniform(0.1))?;
/// let mut solver = Solver::new(Pivoting::new(problem)?);
/// let outcome = solver.solve(&[-1.0, 2.0, -0.5], Limits::default())?;
/// assert!(outcome.converged() && outcome.iterations <= 4, "{outcome}");
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Pivoting<T, A, B> {
    problem: Hlcp<T, A, B>,
    /// The last answer, and d for the columns it was solved with: 1 of A, −1 of BΩ.
    x: Vec<T>,
    d: Vec<T>,
    /// What the columns of A and BΩ are multiplied by.
    weights: Vec<[T; 2]>,
    factors: Factors<T>,
    /// The fewest signs that came out wrong, and the steps left to come to fewer.
    fewest: usize,
    patience: usize,
    way: Way,
    /// d for the columns of the operator that couples more.
    whole: T,
    /// The factor between the columns of A and BΩ of an unknown of which they are the same but for
    /// that, so that it is free; 0 of others.
    free: Vec<T>,
    interior: Option<Interior<T>>,
    paths: Option<Paths<T>>,
    f: Vec<T>,
    scratch: Vec<T>,
    steps: usize,
    cost: Cost,
}

/// The ways, each of which is gone once, in this order.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
enum Way {
    /// From the signs of the start.
    Start,
    /// From the columns of the operator that couples more.
    Whole,
    /// From those of the other one, as these are singular.
    Other,
    /// Through the interior.
    Inside,
    /// From the signs there, each column with a share of the other one.
    Shared,
    /// From `x = 0` with larger shares, as what is left may be far out.
    Nearest,
    /// None of these is left.
    Over,
    /// Lemke's paths, along which `t` covers what is negative.
    Covered,
    /// None is left.
    End,
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Pivoting<T, A, B> {
    /// The method on a problem; `5n` numbers, `3n` of scratch and room for the factors, which the
    /// first iteration takes up.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`] where sparse factors might take more than 4 GB, whichever columns are
    /// chosen and pivots are taken; beyond an order of 500 without the feature `direct`.
    /// [`Error::OneRank`] for a problem that ranks share; [`Error::NotFinite`] for the first row of
    /// `A` or `B` that holds NaN or an infinite number.
    pub fn new(problem: Hlcp<T, A, B>) -> Result<Self, Error> {
        problem.on_one_rank("elimination")?;
        for i in 0..problem.order() {
            check_row("row of A", problem.a(), i)?;
            check_row("row of B", problem.b(), i)?;
        }
        let free = free(&problem);
        let factors = Factors::new(&problem, &free)?;
        Ok(Self::of(problem, free, factors))
    }

    /// The method where Cholesky factors are hardly more than the matrices, as those of trees and
    /// of networks of pipes or roads.
    #[cfg_attr(
        not(feature = "direct"),
        expect(unused_variables, reason = "of sparse factors alone")
    )]
    pub(crate) fn without_fill(problem: &Hlcp<T, A, B>) -> Option<Self>
    where
        A: Clone,
        B: Clone,
    {
        #[cfg(feature = "direct")]
        if entries(problem.a()) + entries(problem.b()) <= FEW_ENTRIES * problem.order() {
            let free = free(problem);
            let (cholesky, cost) = Cholesky::for_problem(problem, &free)?;
            let factors = (Factors::Symmetric(Box::new(cholesky), None), cost);
            return (cost.worth <= CHEAP).then(|| Self::of(problem.clone(), free, factors));
        }
        None
    }

    fn of(problem: Hlcp<T, A, B>, free: Vec<T>, (factors, cost): (Factors<T>, Cost)) -> Self {
        let n = problem.order();
        let zeros = || vec![T::zero(); n];
        Self {
            cost,
            x: zeros(),
            d: zeros(),
            weights: Vec::with_capacity(n),
            factors,
            fewest: usize::MAX,
            patience: 0,
            way: Way::Start,
            whole: side(a_couples_more(&problem)),
            free,
            interior: None,
            paths: None,
            f: zeros(),
            scratch: vec![T::zero(); 2 * n],
            steps: 0,
            problem,
        }
    }

    /// The work of an iteration, in sweeps.
    pub(crate) fn worth(&self) -> usize {
        self.cost.worth
    }

    /// Returns whether the columns of the last step came out with the signs that chose them.
    pub(crate) fn has_right_signs(&self) -> bool {
        self.fewest == 0
    }

    /// Chooses the columns of the next step from `x`; returns whether they are others than before,
    /// or `None` where patience or ways are at their end.
    fn choose(&mut self, x: &[T]) -> Option<bool> {
        if self.way >= Way::Over {
            return None;
        }
        if self.fewest == usize::MAX || x != self.x {
            let whole = match self.way {
                Way::Whole => Some(self.whole),
                Way::Other => Some(-self.whole),
                _ => None,
            };
            for ((d, &x), &free) in self.d.iter_mut().zip(x).zip(&self.free) {
                *d = if free > T::zero() { T::one() } else { whole.unwrap_or(sign(x)) };
            }
            (self.fewest, self.patience) = (x.len() + 1, PATIENCE[0]);
            return Some(true);
        }
        let signs = x.iter().zip(&self.d).zip(&self.free);
        let count = signs.filter(|&((&x, &d), &free)| is_wrong(x, d, free)).count();
        if count as f64 <= FEWER * self.fewest as f64 {
            let is_long = match self.way {
                Way::Start | Way::Other => false,
                Way::Whole => count <= x.len() / FEW,
                _ => true,
            };
            (self.fewest, self.patience) = (count, PATIENCE[usize::from(is_long)]);
        } else {
            if self.patience == 0 {
                return None;
            }
            self.patience -= 1;
        }
        let signs = self.d.iter_mut().zip(x).zip(&self.free);
        let wrong = signs.filter(|((d, x), free)| is_wrong(**x, **d, **free));
        wrong.for_each(|((d, _), _)| *d = -*d);
        Some(count > 0)
    }

    /// Overwrites `y` with what the columns that the signs of `x` select make of it, but where none
    /// are left to try.
    fn pivot(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut [T]) {
        let Some(are_new) = self.choose(x) else { return };
        if are_new {
            self.steps += 1;
            let (two, root) = (T::of(2.0), T::epsilon().sqrt());
            let share = match self.way {
                Way::Shared => root,
                Way::Nearest => root.sqrt(),
                _ => T::zero(),
            };
            let of =
                |&d: &T| if d > T::zero() { [two - share, share] } else { [share, two - share] };
            self.weights.clear();
            self.weights.extend(self.d.iter().map(of));
            self.factors.factorise(&self.problem, &self.weights);
            let is_afresh = self.way == Way::Nearest && self.fewest > x.len();
            if share > T::zero() {
                // What solves the equations may not be unique: the least change is.
                for ((y, &d), &free) in y.iter_mut().zip(&self.d).zip(&self.free) {
                    *y = if is_afresh || is_wrong(*y, d, free) { T::zero() } else { *y };
                }
                let _ = measure(&self.problem, q, y, &mut self.f, &mut self.scratch);
            } else {
                let factor = self.problem.q_factor();
                self.f.iter_mut().zip(q.entries()).for_each(|(f, &q)| *f = factor * q);
                y.fill(T::zero());
            }
        }
        // Where no sign is wrong this takes off what rounding has left.
        self.factors.solve(&self.f, &mut self.x);
        for ((y, &s), &free) in y.iter_mut().zip(&self.x).zip(&self.free) {
            // What is free moves in the unit of A's column.
            let is_below = free > T::zero() && *y < T::zero();
            *y = of_column(if is_below { *y / free } else { *y } - s, free);
        }
        self.x.copy_from_slice(y);
    }
}

/// Returns the d of a column of A, or else of −BΩ.
fn side<T: Scalar>(is_of_a: bool) -> T {
    if is_of_a { T::one() } else { -T::one() }
}

/// Returns the d of the column that `x` is of.
fn sign<T: Scalar>(x: T) -> T {
    side(x >= T::zero())
}

/// Returns whether `x` is of the other column than d chooses, and not free.
fn is_wrong<T: Scalar>(x: T, d: T, free: T) -> bool {
    free == T::zero() && sign(x) != d
}

/// Returns `x` of an unknown that is `w` times the column of A, if it is free.
fn of_column<T: Scalar>(w: T, free: T) -> T {
    if free > T::zero() && w < T::zero() { w * free } else { w }
}

/// Returns the factors between the columns of A and BΩ where there are any, to rounding; 0 of
/// others.
fn free<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Vec<T> {
    let (a, b, omega) = (problem.a(), problem.b(), problem.omega());
    let [mut factors, mut rest] = [(); 2].map(|()| vec![T::zero(); problem.order()]);
    let mut is_empty = vec![true; factors.len()];
    for i in 0..factors.len() {
        a.visit_row(i, &mut |j, a| (rest[j], is_empty[j]) = (a, is_empty[j] && a == T::zero()));
        b.visit_row(i, &mut |j, b| {
            is_empty[j] &= b == T::zero();
            if factors[j] == T::zero() && b != T::zero() {
                factors[j] = (rest[j] / (b * omega.entry(j))).max(T::zero());
            }
        });
        a.visit_row(i, &mut |j, _| rest[j] = T::zero());
    }
    for i in 0..factors.len() {
        let scaled = |j: usize, b: T, factors: &[T]| b * omega.entry(j) * factors[j];
        a.visit_row(i, &mut |j, a| rest[j] += a);
        b.visit_row(i, &mut |j, b| rest[j] -= scaled(j, b, &factors));
        let mut see = |j: usize, of_a: T, of_b: T| {
            let size = of_a.abs() + scaled(j, of_b, &factors).abs();
            let rest = std::mem::replace(&mut rest[j], T::zero()).abs();
            if rest > T::of(4.0) * T::epsilon() * size || rest.is_nan() {
                factors[j] = T::zero();
            }
        };
        a.visit_row(i, &mut |j, a| see(j, a, T::zero()));
        b.visit_row(i, &mut |j, b| see(j, T::zero(), b));
    }
    // Columns of zeros are the same, too.
    factors.iter_mut().zip(is_empty).filter(|of| of.1).for_each(|of| *of.0 = T::one());
    factors
}

/// What an elimination is worth at least, in sweeps, as far as that is known without an analysis;
/// `usize::MAX` where it cannot be had.
pub(crate) fn least_worth<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> usize {
    let least = worth(problem);
    // What is not small is analysed before it is cheap.
    #[cfg(feature = "direct")]
    let least = least.min(crate::direct::ANALYSIS);
    least
}

/// Returns whether `A` has as many entries as `B`, or more.
pub(crate) fn a_couples_more<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> bool {
    entries(problem.a()) >= entries(problem.b())
}

/// The entries of an operator that are not zero.
pub(crate) fn entries<T: Scalar>(operator: &impl Rows<T>) -> usize {
    let mut count = 0;
    for i in 0..operator.order() {
        operator.visit_row(i, &mut |_, a| count += usize::from(a != T::zero()));
    }
    count
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Method<T> for Pivoting<T, A, B> {
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn restart(&mut self) {
        (self.fewest, self.steps) = (usize::MAX, 0);
        (self.interior, self.paths, self.way) = (None, None, Way::Start);
    }

    fn has_memory(&self) -> bool {
        true
    }

    /// Goes the next way, if one has begun: the iterate stays where columns lead nowhere.
    fn turn(&mut self, end: Status) -> bool {
        let has_begun = self.fewest == usize::MAX && self.way < Way::Over;
        let covers = !has_begun && self.interior.is_none();
        let n = self.problem.order();
        let is_over = self.way == Way::End || covers && steps(n) < n;
        if end != Status::Stagnated || is_over {
            return false;
        }
        if covers {
            self.way = Way::Covered;
        }
        true
    }

    fn work(&self) -> Option<Work> {
        let before = if self.steps > 0 { self.cost.before } else { 0 };
        Some(Work::sweeps(before + self.steps * (self.cost.worth + 2)))
    }

    fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        Some(measure(&self.problem, q, x, &mut self.f, &mut self.scratch))
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        let norms = self.residual(q, x).expect("it is measured");
        y.copy_from_slice(x);
        if clock.is_up() || !clock.has_time_for(self.cost) {
            return norms;
        }
        if self.way == Way::Covered {
            let paths = || Paths::new(&self.problem, q, &self.free);
            if !self.paths.get_or_insert_with(paths).follow(y) {
                self.way = Way::End;
            }
            self.steps += 1;
            let led = self.residual(q, y).expect("it is measured").l2;
            if led.is_nan() || led >= norms.l2 {
                y.copy_from_slice(x);
            }
            return norms;
        }
        if let Some(inside) = self.interior.take() {
            self.step_inside(q, inside, y);
        } else {
            if self.steps == 0 && norms.l2 > ROUGH * q.norms().l2 {
                self.way = Way::Whole;
            }
            self.pivot(q, x, y);
        }
        let led = self.residual(q, y).expect("it is measured").l2;
        let most = if self.fewest == 0 { ROUGH } else { FAR };
        // Right signs of columns that do not solve the equations stay as they are; what is less may
        // be rounding, unless the columns are singular and there are others to try, or are those of
        // a start, and it is more.
        let rests = self.fewest == 0 && led > 0.5 * norms.l2;
        let is_stuck = rests
            && (led > FRACTION * q.norms().l2
                || self.way <= Way::Other && self.factors.are_singular()
                || self.way == Way::Start
                    && led
                        > ROUNDING * self.problem.estimated_rounding(q, y, &mut self.scratch).l2);
        let has_digits = led.is_finite() && led <= most * q.norms().l2 && !is_stuck;
        if !has_digits {
            y.copy_from_slice(x);
        }
        match self.way {
            Way::Start if self.patience == 0 || !has_digits => {
                (self.way, self.fewest) = (Way::Whole, usize::MAX);
            }
            Way::Whole if !has_digits => (self.way, self.fewest) = (Way::Other, usize::MAX),
            Way::Whole | Way::Other if self.patience == 0 || !has_digits => {
                self.way = Way::Inside;
                let tells = has_digits && led <= NEAR * q.norms().l2;
                self.enter(q, if tells { y } else { &[] });
            }
            Way::Inside if self.interior.is_none() => self.way = Way::Shared,
            Way::Shared if rests => (self.way, self.fewest) = (Way::Nearest, usize::MAX),
            Way::Nearest if rests && led >= norms.l2 => self.way = Way::Over,
            Way::Shared | Way::Nearest if !has_digits => self.way = Way::Over,
            Way::Nearest if self.fewest > x.len() && Norms::of(y).l2 > 0.5 * Norms::of(x).l2 => {
                // Nothing is nearer.
                y.copy_from_slice(x);
                (self.way, self.fewest) = (Way::Over, 0);
            }
            _ => {}
        }
        norms
    }
}

#[cfg(test)]
mod tests;
