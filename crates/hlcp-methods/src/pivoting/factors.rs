//! The factors of the columns that are chosen, full or sparse.

use std::time::Instant;

use hlcp_core::{Error, Hlcp, Rows, Scalar};

#[cfg(feature = "direct")]
use super::CHEAP;
use super::entries;
#[cfg(feature = "direct")]
use super::full::FEW;
use super::full::Full;
use crate::limits::Cost;
#[cfg(feature = "direct")]
use crate::{cholesky::Cholesky, direct::SparseLu};

/// The order up to which a full matrix is worth a thought: one of 2 MB.
pub(super) const SMALL: usize = 500;

/// The order up to which one is where half of its entries are there: of 2 GB.
const LARGEST: usize = 15_000;

/// The walks over the rows that an elimination of a full matrix takes, but for multiplications, and
/// those that take the time of one entry, times three: by faer, and by our own factors.
const FULL: [[usize; 2]; 2] = [[16, 60], [0, 12]];

/// Where the factors of a symmetric matrix are not to be had, those with pivots are to hold no more
/// than so many times their numbers: they hold four times as many on planes, hundreds of times as
/// many in markets, where columns that are chosen later may leave few.
#[cfg(feature = "direct")]
const OF_PIVOTS: f64 = 16.0;

/// The factors of J(x), and room for the next ones.
#[derive(Debug, Clone)]
pub(super) enum Factors<T> {
    Full(Box<Full<T>>),
    #[cfg(feature = "direct")]
    Sparse(Box<SparseLu>),
    /// And those with pivots, for what has none without, once it was seen if they are to be had.
    #[cfg(feature = "direct")]
    Symmetric(Box<Cholesky>, Option<Option<Box<Self>>>),
}

impl<T: Scalar> Factors<T> {
    /// Room for those of a problem, where they are cheapest, and what they cost.
    #[cfg_attr(
        not(feature = "direct"),
        expect(unused_variables, reason = "of sparse factors alone")
    )]
    pub(super) fn new<A: Rows<T>, B: Rows<T>>(
        problem: &Hlcp<T, A, B>,
        free: &[T],
    ) -> Result<(Self, Cost), Error> {
        #[cfg(feature = "direct")]
        {
            // Equations may not be independent, which full factors do not bear.
            let may_be_full = problem.order() <= FEW && free.iter().all(|&free| free == T::zero());
            let cholesky = if may_be_full { None } else { Cholesky::for_problem(problem, free) };
            if let Some((cholesky, cost)) = cholesky {
                return Ok((Self::Symmetric(Box::new(cholesky), None), cost));
            }
        }
        Self::with_pivots(problem)
    }

    /// As [`new`](Self::new), for any problem.
    fn with_pivots<A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Result<(Self, Cost), Error> {
        let (n, begun) = (problem.order(), Instant::now());
        let full = worth(problem);
        let seconds = begun.elapsed().as_secs_f64() * full as f64;
        #[cfg(feature = "direct")]
        if full == usize::MAX || n <= SMALL && full > CHEAP {
            let sparse = SparseLu::for_problem(problem);
            match sparse {
                Ok((lu, cost)) if cost.worth < full => {
                    return Ok((Self::Sparse(Box::new(lu)), cost));
                }
                Err(error) if full == usize::MAX => return Err(error),
                _ => {}
            }
        }
        if full == usize::MAX {
            return Err(Error::TooLarge {
                what: "LU factors without the feature \"direct\"",
                needed: n as f64,
                most: SMALL as f64,
                unit: "rows",
            });
        }
        // Those of little are over at once.
        let seconds = if n > SMALL { seconds } else { 0.0 };
        let cost = Cost { worth: full, before: 0, seconds, bytes: 8.0 * (n * n) as f64 };
        Ok((Self::Full(Box::new(Full::new())), cost))
    }

    /// Factorises the matrix of the columns of `A` and `BΩ` times their weights, summed.
    pub(super) fn factorise<A: Rows<T>, B: Rows<T>>(
        &mut self,
        problem: &Hlcp<T, A, B>,
        weights: &[[T; 2]],
    ) {
        let row = |i: usize, each: &mut dyn FnMut(usize, T)| {
            let some = |j: usize, weight: T, a: T, each: &mut dyn FnMut(usize, T)| {
                if weight != T::zero() {
                    each(j, weight * a);
                }
            };
            problem.a().visit_row(i, &mut |j, a| some(j, weights[j][0], a, each));
            problem.b().visit_row(i, &mut |j, b| {
                some(j, weights[j][1] * problem.omega().entry(j), b, each);
            });
        };
        match self {
            Self::Full(lu) => lu.factorise(problem.order(), row),
            #[cfg(feature = "direct")]
            Self::Sparse(lu) => lu.factorise(problem.order(), row),
            #[cfg(feature = "direct")]
            Self::Symmetric(cholesky, pivots) => {
                cholesky.factorise(problem, weights);
                if !cholesky.has_factors() {
                    let most = OF_PIVOTS * cholesky.numbers;
                    let others = || Some(Box::new(Self::with_pivots(problem).ok()?.0.within(most)));
                    if let Some(pivots) = pivots.get_or_insert_with(others) {
                        pivots.factorise(problem, weights);
                    }
                }
            }
        }
    }

    /// The same with fewer numbers than that in sparse factors.
    #[cfg(feature = "direct")]
    fn within(mut self, most: f64) -> Self {
        if let Self::Sparse(lu) = &mut self {
            lu.within(most);
        }
        self
    }

    /// Returns whether full factors lack a pivot; solutions by others are not finite then.
    pub(super) fn are_singular(&self) -> bool {
        match self {
            Self::Full(lu) => lu.is_singular(),
            #[cfg(feature = "direct")]
            Self::Symmetric(cholesky, Some(Some(pivots))) if !cholesky.has_factors() => {
                pivots.are_singular()
            }
            #[cfg(feature = "direct")]
            _ => false,
        }
    }

    pub(super) fn solve(&mut self, rhs: &[T], y: &mut [T]) {
        match self {
            Self::Full(lu) => lu.solve(rhs, y),
            #[cfg(feature = "direct")]
            Self::Sparse(lu) => lu.solve(rhs, y),
            #[cfg(feature = "direct")]
            Self::Symmetric(cholesky, pivots) => match pivots {
                Some(Some(pivots)) if !cholesky.has_factors() => pivots.solve(rhs, y),
                _ => cholesky.solve(rhs, y),
            },
        }
    }
}

/// The cost of an elimination of a full matrix, in walks over the rows: n³/3 multiplications side
/// by side. `usize::MAX` for a large one, but where half of all entries of `A` or `B` are there,
/// and blocks are at hand.
pub(super) fn worth<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> usize {
    let n = problem.order();
    let entries = [entries(problem.a()), entries(problem.b())];
    let is_full = 2 * entries[0].max(entries[1]) >= n * n;
    let has_blocks = cfg!(feature = "direct");
    if n > if has_blocks && is_full { LARGEST } else { SMALL } {
        return usize::MAX;
    }
    let [each, per_entry] = FULL[usize::from(!has_blocks)];
    each + (n * n * n / (per_entry * (entries[0] + entries[1]).max(1))).max(1)
}
