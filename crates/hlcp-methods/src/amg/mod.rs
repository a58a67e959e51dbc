//! Algebraic multigrid for J(x), from rows.

mod coarsen;
mod cycle;
mod matrix;
mod nested;
mod newton;
mod order;
mod units;

use hlcp_core::{Error, Hlcp, Norms, Rows, Scalar, assert_lengths, check_row};

pub(crate) use self::matrix::Lu;
#[cfg(feature = "direct")]
pub(crate) use self::matrix::bring_to_one_size;
pub use self::newton::AmgNewton;
use self::{
    cycle::{Cycle, Hierarchy, SPREAD, near_kernel},
    matrix::Matrix,
    order::Flow,
    units::Units,
};
use crate::{
    Clock, Jacobian, Preconditioner,
    krylov::{Inner, add, dot},
};

/// The directions that the outer iteration keeps before it begins anew.
const KEPT: usize = 20;

/// The entries of a vector that stay in the cache while all directions are gone through.
const BLOCK: usize = 1 << 12;

/// The part of an operator's couplings without a counterpart from which on its columns are a void.
const CARRIES: f64 = 0.5;

/// Algebraic multigrid for [`Jacobian`]s, built from rows.
///
/// Where J mixes conduction with jumps (columns of `A`) and transport (columns of `B`) no grid says
/// how to coarsen it. Here rows do:
///
/// 1. *Units.* Where a tenth of the columns of the operator that couples more lose a hundredth of
///    their diagonal and more, rows are weighted, and where a tenth of its rows do, unknowns get
///    other units, so that what leaves an unknown arrives elsewhere and a constant stays. Where the
///    matrix was symmetric, `aᵢⱼ sⱼ = aⱼᵢ sᵢ` tells them. Where that operator is `B`, the unit of
///    `x` is that of `r`, whatever Ω is: a constant `r` stays.
/// 2. *Scales.* Columns of the operator that conducts stay as they are; those of the other, the
///    void of an oil film, are multiplied by the `s` that solves their own rows with `s = 1` on the
///    former, as far as one Gauss–Seidel pass along the flow does: what full neighbours send in
///    flows on. Then a constant nearly solves `J v = 0` also across the edge of the film. An
///    unknown with `s ≈ 0`, through which nothing flows, joins no aggregate; sweeps settle it. The
///    operator that conducts is the one whose couplings have more of a counterpart across the
///    diagonal, `A` if none has. Where half of the other's have one too, it conducts as well: its
///    columns stay as they are.
/// 3. *Aggregates.* Unknowns are paired by the largest coupling `−aᵢⱼ − aⱼᵢ`, at least a quarter
///    of the largest of their row; leftovers join the pair of their strongest neighbour, with a hub
///    all that lean on it; and pairs are paired. On each level, columns are first scaled by what a
///    symmetric Gauss–Seidel pass on `J v = 0` leaves of a constant, and coarse entries are sums
///    over pairs of aggregates, which conserves mass. What a coupling has in common with the one
///    across the diagonal, conduction, is halved at equal sums of rows and columns: aggregates are
///    twice as far apart as unknowns, and constants on them differ too steeply. On a grid the
///    coarse matrix is then that of a grid half as fine, for conduction and transport alike. From a
///    hundred rows down the system is solved by elimination.
/// 4. *Cycles.* One forward sweep before and one after the coarse correction, in an order along the
///    flow. Each level is visited twice, as long as its visits take no more than two of the first.
///
/// # Two cycles
///
/// As a [`Preconditioner`], for any Krylov method, this is a W-cycle, whose coarse equations are
/// solved by two steps of a stationary iteration: for one J a linear map. [`AmgNewton`] takes the
/// K-cycle, whose steps are those of generalised conjugate residuals, one where that gains a factor
/// of four. It converges faster, but is not a linear map, and needs a flexible outer iteration; it
/// has one, GCR, which begins anew after 20 directions.
///
/// # Cost
///
/// The hierarchy is built by [`set_up`](Self::set_up), or the first solve, and again where signs of
/// `x` have changed: about 12 walks over the rows of J. A cycle takes about five, however large the
/// problem.
///
/// # Storage
///
/// J itself is assembled: a row's entries with 32-bit columns, since a walk through [`Rows`] calls
/// a function for each entry, and a cycle takes several walks. With five entries a row and `f64`
/// that is 72 bytes per row; all levels together have [`complexity`](Self::complexity) times as
/// many, about 1.3 to 1.5 on grids. Next to it `n` numbers, `2n` on coarser levels, `3n` as a
/// [`Preconditioner`], and for [`AmgNewton`] `2n` and two vectors for each iteration of its longest
/// linear solve, at most 20 pairs. A set-up allocates, and a linear solve does; a cycle does not
/// after the first.
///
/// # Convergence
///
/// No theorem covers these J, which are neither symmetric nor M-matrices before they are scaled.
/// For symmetric M-matrices with row sums that are not negative, aggregates of some quality bound
/// the condition of two levels, whatever the size (Napov and Notay). The outer iteration of
/// [`AmgNewton`] minimises the residual, so a cycle that is poor makes it slow, not wrong.
///
/// # Source
///
/// Y. Notay, *An aggregation-based algebraic multigrid method*, ETNA 37 (2010), for double pairing
/// and the K-cycle, and *Aggregation-based algebraic multigrid for convection–diffusion equations*,
/// SIAM J. Sci. Comput. 34 (2012), for rows that are not symmetric; A. Napov and Y. Notay, *An
/// algebraic multigrid method with guaranteed convergence rate*, SIAM J. Sci. Comput. 34 (2012).
/// D. Braess, *Towards algebraic multigrid for elliptic problems of second order*, Computing 55
/// (1995), for the factor of two, there on the whole coarse matrix. Its restriction to conduction
/// and the scaling of the void are our own.
///
/// ```
/// use hlcp_methods::{Amg, FivePoint, Hlcp, Jacobian, LinearOperator, Norms, Preconditioner};
///
/// let problem = Hlcp::lcp(FivePoint::new(40, 40, [-1.0, -1.0, 4.0, -1.0, -1.0])?)?;
/// let x: Vec<f64> = (0..1600).map(|k| if k % 40 < 25 { 1.0 } else { -1.0 }).collect();
/// let jacobian = Jacobian::new(&problem, &x);
///
/// let mut amg = Amg::new(&problem)?;
/// amg.set_up(&jacobian);
/// let (rhs, mut y, mut product) = ([1.0; 1600], [0.0; 1600], [0.0; 1600]);
/// amg.solve(&jacobian, &rhs, &mut y);
/// jacobian.apply(&y, &mut product, &mut vec![]);
/// product.iter_mut().for_each(|p| *p -= 1.0);
/// assert!(Norms::of(&product).l2 < 0.5 * 40.0); // the residual, and that of y = 0
/// assert!(amg.set_ups() == 1 && amg.complexity() < Some(1.5));
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Amg<T> {
    n: usize,
    /// The unknown at each place of the order along the flow, and the place of each unknown; empty
    /// where they agree.
    order: Vec<u32>,
    place: Vec<u32>,
    /// True if the columns of B, and of A, carry; nothing before the first set-up.
    carries: Option<[bool; 2]>,
    units: Units<T>,
    /// The columns that are A's in the hierarchy.
    active: Vec<bool>,
    /// The factors of the columns of J, by place.
    scale: Vec<T>,
    hierarchy: Option<Hierarchy<T>>,
    // A right-hand side, a solution and its product with J, by place and in the unit of `scale`; of
    // the first single cycle on.
    rhs: Vec<T>,
    y: Vec<T>,
    product: Vec<T>,
    kept: Vec<[Vec<T>; 2]>,
    walks: f64,
    set_ups: usize,
}

impl<T: Scalar> Amg<T> {
    /// Multigrid for the Jacobians of `problem`, without a hierarchy yet.
    ///
    /// # Cost
    ///
    /// One walk over `A` and one over `B`. The first set-up takes three more, and assembles both
    /// for a while, to find the order along the flow.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for 2³² entries and more, [`Error::NotPositive`] for the first diagonal
    /// entry of `A` or `B` that is zero, negative or not finite, [`Error::NotFinite`] for
    /// the first row of `A` or `B` with an entry that is NaN or infinite.
    pub fn new<A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Result<Self, Error> {
        let n = problem.order();
        let entries = check(["row of A", "diagonal of A"], problem.a())?
            + check(["row of B", "diagonal of B"], problem.b())?;
        if entries > u32::MAX as usize {
            let (name, range) = ("the number of entries of A and B", "less than 2³²");
            return Err(Error::Parameter { name, value: entries as f64, range });
        }
        Ok(Self {
            n,
            order: vec![],
            place: vec![],
            carries: None,
            units: Units::plain(),
            active: vec![],
            scale: vec![],
            hierarchy: None,
            rhs: vec![],
            y: vec![],
            product: vec![],
            kept: vec![],
            walks: 0.0,
            set_ups: 0,
        })
    }

    /// Builds the hierarchy of `jacobian`, unless it has the one of the same columns.
    ///
    /// # Panics
    ///
    /// Unless the problem is of the order of that given to [`new`](Self::new).
    pub fn set_up<A: Rows<T>, B: Rows<T>>(&mut self, jacobian: &Jacobian<'_, T, A, B>) {
        self.set_up_within(jacobian, &mut Clock::endless());
    }

    /// As [`set_up`](Self::set_up), but leaves no hierarchy when the clock is up.
    fn set_up_within<A: Rows<T>, B: Rows<T>>(
        &mut self,
        jacobian: &Jacobian<'_, T, A, B>,
        clock: &mut Clock<'_>,
    ) {
        assert_eq!(jacobian.problem().order(), self.n, "a problem of the same order");
        let active = (0..self.n).map(|i| jacobian.is_active(i));
        if self.hierarchy.is_some() && active.clone().eq(self.active.iter().copied()) {
            return;
        }
        self.active.clear();
        self.active.extend(active);
        // What the last one has cost stays.
        (self.walks, self.hierarchy) = (self.walks(), None);
        let Some(carries) = self.orient(jacobian.problem(), clock) else { return };
        let Some(mut matrix) = self.assemble(jacobian, clock) else { return };
        let void: Vec<bool> =
            (0..self.n).map(|at| carries[usize::from(self.active[self.at(at)])]).collect();
        let (scale, dry) = void_scale(&matrix, &void, clock);
        matrix.scale_columns(&scale);
        let v = near_kernel(&matrix, clock);
        matrix.scale_columns(&v);
        self.scale = scale;
        self.scale.iter_mut().zip(&v).for_each(|(scale, &v)| *scale *= v);
        self.hierarchy = Hierarchy::new(matrix, &dry, clock);
        // Assembled, a pass over the void, scaled twice, a symmetric pass.
        self.walks += 6.0;
        self.set_ups += 1;
    }

    /// Finds the units and the order along the flow, once; whether the columns of `B`, and of `A`,
    /// carry, or nothing when the clock is up.
    pub(super) fn orient<A: Rows<T>, B: Rows<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        clock: &mut Clock<'_>,
    ) -> Option<[bool; 2]> {
        if self.carries.is_none() {
            let (mut a, mut b) = (Matrix::of(problem.a(), clock)?, Matrix::of(problem.b(), clock)?);
            self.units = Units::of(&mut a, &mut b, problem.omega(), clock)?;
            let (a, b) = (Flow::of(&a, clock)?, Flow::of(&b, clock)?);
            let b_carries = a.share <= b.share;
            let flow = if b_carries { &b } else { &a };
            let order = flow.order(problem.order(), clock).unwrap_or_default();
            if clock.is_up() {
                return None;
            }
            self.order = order;
            self.place = vec![0; self.order.len()];
            for (at, &i) in self.order.iter().enumerate() {
                self.place[i as usize] = at as u32;
            }
            let is_void = flow.share >= CARRIES;
            self.carries = Some([is_void && b_carries, is_void && !b_carries]);
        }
        self.carries
    }

    /// How often a hierarchy was built.
    pub fn set_ups(&self) -> usize {
        self.set_ups
    }

    /// The entries of all levels over those of J, of the last hierarchy that was built.
    pub fn complexity(&self) -> Option<f64> {
        self.hierarchy.as_ref().map(Hierarchy::complexity)
    }

    /// The walks over the rows of J that set-ups and cycles were worth.
    pub(crate) fn walks(&self) -> f64 {
        self.walks + self.hierarchy.as_ref().map_or(0.0, Hierarchy::walks)
    }

    /// Forgets the hierarchy, and counts from zero.
    pub(crate) fn forget(&mut self) {
        (self.hierarchy, self.walks, self.set_ups) = (None, 0.0, 0);
    }

    /// The unknown at a place.
    fn at(&self, place: usize) -> usize {
        self.order.get(place).map_or(place, |&i| i as usize)
    }

    /// The rows of J in the order along the flow; nothing when the clock is up.
    fn assemble<A: Rows<T>, B: Rows<T>>(
        &self,
        jacobian: &Jacobian<'_, T, A, B>,
        clock: &mut Clock<'_>,
    ) -> Option<Matrix<T>> {
        Matrix::by_rows([self.n, 4 * self.n], clock, |at, row| {
            let i = self.at(at);
            let weight = self.units.row(i);
            jacobian.visit_row(i, |j, a| {
                let at = self.place.get(j).copied().unwrap_or(j as u32);
                row.push((at, a * weight * self.units.x(j)));
            });
        })
    }

    /// Overwrites `y` with an approximate solution of `J(x) y = rhs`, by flexible GCR with
    /// K-cycles, and returns the norm of its residual in units of that of `rhs`.
    ///
    /// Ends when that is at most `tolerance`, after about `limit` iterations, where rounding lets
    /// nothing be gained, or when the clock is up.
    ///
    /// # Panics
    ///
    /// Unless the problem, `rhs` and `y` are of the order of the problem given to
    /// [`new`](Self::new).
    ///
    /// ```
    /// use hlcp_methods::{Amg, Clock, FivePoint, Hlcp, Jacobian};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(40, 40, [-1.0, -1.0, 4.0, -1.0, -1.0])?)?;
    /// let (x, rhs, mut y) = ([1.0; 1600], [1.0; 1600], [0.0; 1600]);
    /// let jacobian = Jacobian::new(&problem, &x);
    /// let mut amg = Amg::new(&problem)?;
    /// let goal = (1e-12, 50);
    /// let residual = amg.solve_to(&jacobian, &rhs, &mut y, goal, &mut Clock::endless());
    /// assert!(residual <= 1e-12 && y.iter().all(|&y| y > 0.0));
    /// # Ok::<(), hlcp_methods::Error>(())
    /// ```
    pub fn solve_to<A: Rows<T>, B: Rows<T>>(
        &mut self,
        jacobian: &Jacobian<'_, T, A, B>,
        rhs: &[T],
        y: &mut [T],
        (tolerance, limit): (f64, usize),
        clock: &mut Clock<'_>,
    ) -> f64 {
        self.solve_within(jacobian, rhs, y, (tolerance, limit), clock).residual
    }

    /// As [`solve_to`](Self::solve_to), with the iterations.
    pub(crate) fn solve_within<A: Rows<T>, B: Rows<T>>(
        &mut self,
        jacobian: &Jacobian<'_, T, A, B>,
        rhs: &[T],
        y: &mut [T],
        (tolerance, limit): (f64, usize),
        clock: &mut Clock<'_>,
    ) -> Inner {
        assert_lengths(self.n, [("rhs", rhs.len()), ("y", y.len())]);
        self.set_up_within(jacobian, clock);
        y.fill(T::zero());
        if self.hierarchy.is_none() {
            return Inner { iterations: 0, residual: 1.0 };
        }
        // In units of the right-hand side, whose squares might overflow or vanish.
        let order = (0..rhs.len()).map(|at| self.at(at));
        let mut residual: Vec<T> = order.map(|i| rhs[i] * self.units.row(i)).collect();
        let unit = T::of(Norms::of(&residual).l2);
        if unit == T::zero() {
            return Inner { iterations: 0, residual: 0.0 };
        }
        residual.iter_mut().for_each(|r| *r /= unit);
        let mut x = vec![T::zero(); rhs.len()];
        let mut inner = Inner { iterations: 0, residual: 1.0 };
        let begun = self.walks();
        loop {
            let left = limit.saturating_sub(inner.iterations);
            let steps = self.flexible(&mut residual, &mut x, (tolerance, left), clock);
            inner.iterations += steps;
            inner.residual = dot(&residual, &residual).sqrt();
            for (at, x) in x.iter_mut().enumerate() {
                let i = self.at(at);
                y[i] += *x * self.scale[at] * self.units.x(i) * unit;
                *x = T::zero();
            }
            let wanting = inner.residual > tolerance && inner.iterations < limit;
            // What each walk is to take off the logarithm of the residual.
            let least = clock.least * (self.walks() - begun);
            let is_slow = clock.least > 0.0 && -inner.residual.ln() < least;
            if !wanting || is_slow || steps == 0 || clock.is_up() {
                break;
            }
        }
        inner
    }

    /// Moves `x` by at most `limit` steps, until `residual` is at most `goal`; returns the steps.
    fn flexible(
        &mut self,
        residual: &mut [T],
        x: &mut [T],
        (goal, limit): (f64, usize),
        clock: &mut Clock<'_>,
    ) -> usize {
        let Some(hierarchy) = &mut self.hierarchy else { return 0 };
        // The products, orthogonal and of length 1, are those of the directions times the inverse
        // of a triangle.
        let (mut triangle, mut lengths): (Vec<Vec<f64>>, Vec<f64>) = (vec![], vec![]);
        for step in 0..limit.min(KEPT) {
            if dot(residual, residual).sqrt() <= goal || clock.is_up() {
                break;
            }
            if self.kept.len() == step {
                self.kept.push([vec![T::zero(); x.len()], vec![T::zero(); x.len()]]);
            }
            let (before, rest) = self.kept.split_at_mut(step);
            let Some([direction, product]) = rest.first_mut() else { break };
            hierarchy.cycle(Cycle::K, residual, direction, product, clock);
            if clock.is_up() {
                break;
            }
            let blocks = || (0..x.len()).step_by(BLOCK).map(|at| at..x.len().min(at + BLOCK));
            let mut shares = vec![0.0; step];
            for block in blocks() {
                for ([_, older], share) in before.iter().zip(&mut shares) {
                    *share += dot(&product[block.clone()], &older[block.clone()]);
                }
            }
            let (mut square, mut along) = (0.0, 0.0);
            for block in blocks() {
                let product = &mut product[block.clone()];
                for ([_, older], share) in before.iter().zip(&shares) {
                    add(product, -share, &older[block.clone()]);
                }
                square += dot(product, product);
                along += dot(product, &residual[block]);
            }
            let inverse = square.sqrt().recip();
            let length = along * inverse;
            if !(inverse.is_normal() && length.is_finite()) {
                break;
            }
            for (product, residual) in product.iter_mut().zip(&mut *residual) {
                *product *= T::of(inverse);
                *residual -= T::of(length) * *product;
            }
            shares.push(square.sqrt());
            triangle.push(shares);
            lengths.push(length);
        }
        let steps = lengths.len();
        for k in (0..steps).rev() {
            lengths[k] /= triangle[k][k];
            for i in 0..k {
                lengths[i] -= lengths[k] * triangle[k][i];
            }
            add(x, lengths[k], &self.kept[k][0]);
        }
        steps
    }
}

/// The scale of the void and which of it is dry: 1 elsewhere, and in the void what a pass in the
/// order of the flow makes of its rows; anything when the clock is up.
fn void_scale<T: Scalar>(
    matrix: &Matrix<T>,
    void: &[bool],
    clock: &mut Clock<'_>,
) -> (Vec<T>, Vec<bool>) {
    let of_void = || (0..void.len()).filter(|&i| void[i]);
    let mut scale: Vec<T> =
        void.iter().map(|&void| if void { T::zero() } else { T::one() }).collect();
    for (k, i) in of_void().enumerate() {
        if clock.is_up_at(k) {
            break;
        }
        matrix.relax_homogeneous(i, &mut scale);
    }
    let full = (0..void.len()).filter(|&i| !void[i]).map(|i| matrix.diagonal[i]);
    let (sum, count) = full.fold((T::zero(), 0.0), |(sum, count), d| (sum + d, count + 1.0));
    // The mean diagonal entry elsewhere.
    let unit = if count > 0.0 { sum / T::of(count) } else { T::one() };
    // Dry is what is farther from the rest than vectors of two levels may be.
    let least = T::of((SPREAD * SPREAD).recip());
    let mut dry = vec![false; void.len()];
    for i in of_void() {
        let alike = unit / matrix.diagonal[i];
        let wet = scale[i] / alike;
        if !(wet > least && wet < least.recip()) {
            dry[i] = true;
            scale[i] = if alike.is_normal() { alike } else { T::one() };
        }
    }
    (scale, dry)
}

/// Refuses a diagonal entry that is not positive, and rows with an entry that is not finite or in
/// no column; how many entries there are.
fn check<T: Scalar>(
    [name, diagonal]: [&'static str; 2],
    operator: &impl Rows<T>,
) -> Result<usize, Error> {
    let mut entries = 0;
    for index in 0..operator.order() {
        let d = operator.diagonal_entry(index);
        if !(d > T::zero() && d.is_finite()) {
            return Err(Error::NotPositive { what: diagonal, index, value: d.wide() });
        }
        check_row(name, operator, index)?;
        entries += operator.copy_row(index, &mut []);
    }
    Ok(entries)
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Preconditioner<T, A, B> for Amg<T> {
    /// Overwrites `y` with what a W-cycle makes of `rhs`.
    ///
    /// # Panics
    ///
    /// Unless the problem, `rhs` and `y` are of the order of the problem given to
    /// [`new`](Amg::new).
    fn solve(&mut self, jacobian: &Jacobian<'_, T, A, B>, rhs: &[T], y: &mut [T]) {
        self.set_up(jacobian);
        for numbers in [&mut self.rhs, &mut self.y, &mut self.product] {
            numbers.resize(self.n, T::zero());
        }
        for at in 0..rhs.len() {
            let i = self.at(at);
            self.rhs[at] = rhs[i] * self.units.row(i);
        }
        let Some(hierarchy) = &mut self.hierarchy else { return };
        let clock = &mut Clock::endless();
        hierarchy.cycle(Cycle::W, &self.rhs, &mut self.y, &mut self.product, clock);
        for at in 0..rhs.len() {
            let i = self.at(at);
            y[i] = self.y[at] * self.scale[at] * self.units.x(i);
        }
    }
}

#[cfg(test)]
mod tests;
