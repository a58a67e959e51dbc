//! A problem of which several ranks have a part each.

use std::sync::Arc;

use super::Hlcp;
use crate::{
    numbers::{Error, Rhs, Scalar, check_orders},
    operators::{FivePointView, LinearOperator, Omega},
    parallel::{Shared, Strip},
};

impl<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>> Hlcp<T, A, B> {
    /// Returns the same problem, of which the ranks of `strip` have a part each: the operators, Ω
    /// and all vectors are those of this rank's columns. All ranks call it.
    ///
    /// Its norms, inner products and sweeps are those of the whole, the same bits on all ranks and
    /// for any number of ranks. Five-point operators of the strip's grid are given the columns
    /// beside it; any other operator maps this rank's part of a vector and fetches what it needs of
    /// others itself. All ranks make the same calls in the same order.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] unless the operators have the strip's order, [`Error::NotFivePoint`] for a
    /// grid that is not the strip's, and for an operator that knows its rows and is no five-point
    /// one, [`Error::OneRank`] for a grid that closes round; on all ranks if on one.
    ///
    /// ```
    /// use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega, Step, Strip, ranks_as_threads};
    ///
    /// let norms = |ranks| {
    ///     ranks_as_threads(ranks, |ranks| {
    ///         let strip = Strip::new(ranks, [600, 40])?;
    ///         let [nx, ny] = strip.grid();
    ///         let a = FivePoint::new(nx, ny, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
    ///         let b = Identity { order: nx * ny };
    ///         let problem = Hlcp::new(a, b, Omega::Uniform(4.0))?.shared_by(&strip)?;
    ///         let q = strip.vector(|i, j| (i as f64).sin() - (j as f64).cos());
    ///         let (x, mut y) = (vec![1.0; q.len()], vec![0.0; q.len()]);
    ///         let (sor, q) = (Aor::sor(1.5)?, problem.rhs(&q)?);
    ///         sor.step(&problem, &q, &x, &mut y, &mut vec![]);
    ///         let mut next = y.clone();
    ///         Ok::<_, hlcp_core::Error>(sor.step(&problem, &q, &y, &mut next, &mut vec![]))
    ///     })
    /// };
    /// let whole = norms(1);
    /// assert!(norms(2).iter().all(|of_two| *of_two == whole[0]));
    /// ```
    pub fn shared_by(self, strip: &Strip) -> Result<Self, Error> {
        let (n, [nx, ny]) = (self.order(), strip.grid());
        let views = [self.a.as_five_point(), self.b.as_five_point()];
        let fits = || {
            check_orders(n, &[("the strip", nx * ny)])?;
            if self.round() != [false; 2] {
                let what = "a sweep over a grid that closes round";
                return Err(Error::OneRank { what, ranks: strip.size() });
            }
            let is_own =
                |operator: &dyn LinearOperator<T>| operator.try_visit_row(0, &mut |_, _| ());
            let own = [is_own(&self.a), is_own(&self.b)];
            for ((what, view), own) in ["A", "B"].into_iter().zip(&views).zip(own) {
                // Rows of its own columns alone cannot be all of the whole operator's.
                let fits =
                    view.map_or(!own, |view| view.grid().is_none_or(|grid| grid == [nx, ny]));
                if !fits {
                    return Err(Error::NotFivePoint { what });
                }
            }
            Ok(())
        };
        strip.agree(fits())?;
        let mut own = [f64::NAN; 11];
        if let Omega::Uniform(omega) = self.omega {
            own[10] = omega.wide();
        }
        if let [Some(a), Some(b)] = views.map(|view| view.and_then(|view| view.constants())) {
            let coefficients = a.into_iter().chain(b);
            own.iter_mut().zip(coefficients).for_each(|(own, number)| *own = number.wide());
        }
        let all = strip.joined(&own, |_| own.len());
        let mut rows = all.chunks(own.len());
        let uniform = rows.clone().all(|row| row[10] == all[10]);
        let constant = rows.all(|row| row[..10] == all[..10]);
        let omega = match self.omega {
            Omega::Uniform(omega) if !uniform => Omega::Each(vec![omega; n]),
            omega => omega,
        };
        let beside = strip.beside(1, |k| omega.entry(k));
        let scaling = scaling_beside(strip, views);
        let shared = Shared { strip: strip.clone(), omega: beside, scaling, constant };
        Ok(Self { omega, shared: Some(Arc::new(shared)), ..self })
    }

    /// Returns the strip of the ranks that share the problem, if any do.
    pub fn strip(&self) -> Option<&Strip> {
        self.shared.as_ref().map(|shared| &shared.strip)
    }

    /// Returns whether something is so on any of the ranks that share the problem. All ranks call
    /// it.
    ///
    /// ```
    /// # use hlcp_core::{Hlcp, Identity};
    /// let problem = Hlcp::<f64, _, _>::lcp(Identity { order: 3 })?;
    /// assert!(problem.any(true) && !problem.any(false)); // one process is all there is
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn any(&self, own: bool) -> bool {
        self.largest([if own { 1.0 } else { 0.0 }])[0] > 0.0
    }

    /// Returns, of each place, the largest number that a rank which shares the problem has there:
    /// [`Strip::largest`]. All ranks call it.
    ///
    /// ```
    /// # use hlcp_core::{Hlcp, Identity};
    /// let problem = Hlcp::<f64, _, _>::lcp(Identity { order: 3 })?;
    /// assert_eq!(problem.largest([3.0, -1.0]), [3.0, -1.0]); // one process is all there is
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn largest<const K: usize>(&self, own: [f64; K]) -> [f64; K] {
        self.strip().map_or(own, |strip| strip.largest(own))
    }

    /// Makes one result of those of all ranks that share the problem: [`Strip::agree`]. All ranks
    /// call it.
    ///
    /// # Errors
    ///
    /// The error, if a rank has one.
    ///
    /// ```
    /// # use hlcp_core::{Error, Hlcp, Identity};
    /// let problem = Hlcp::<f64, _, _>::lcp(Identity { order: 3 })?;
    /// let own: Result<(), _> = Err(Error::Empty { what: "a list" });
    /// assert_eq!(problem.agree(own.clone()), own); // one process is all there is
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn agree<V>(&self, own: Result<V, Error>) -> Result<V, Error> {
        match self.strip() {
            Some(strip) => strip.agree(own),
            None => own,
        }
    }

    /// Refuses a problem that ranks share, for something that works on one.
    #[doc(hidden)]
    pub fn on_one_rank(&self, what: &'static str) -> Result<(), Error> {
        match self.strip() {
            Some(strip) => Err(Error::OneRank { what, ranks: strip.size() }),
            None => Ok(()),
        }
    }

    /// Returns what ranks share of the exchanged problem.
    pub(super) fn exchanged_shared(&self) -> Option<Arc<Shared<T>>> {
        let shared = self.shared.as_ref()?;
        let strip = shared.strip.clone();
        let reciprocals = |column: &Vec<T>| column.iter().map(|omega| omega.recip()).collect();
        let omega = shared.omega.each_ref().map(reciprocals);
        let scaling = scaling_beside(&strip, [self.b.as_five_point(), self.a.as_five_point()]);
        Some(Arc::new(Shared { strip, omega, scaling, constant: shared.constant }))
    }

    /// Returns the order of the whole, of which this rank may have a part.
    pub(crate) fn whole_order(&self) -> usize {
        self.strip().map_or(self.order(), |strip| strip.whole().into_iter().product())
    }

    /// Refuses a right-hand side that was measured as if this rank were all there is.
    pub(crate) fn assert_whole(&self, q: &Rhs<'_, T>) {
        assert_eq!(q.order(), self.whole_order(), "a right-hand side that `Hlcp::rhs` has made");
    }
}

/// Returns the ratios of two operators' diagonals beside this rank's columns; none unless both are
/// five-point operators.
fn scaling_beside<T: Scalar>(
    strip: &Strip,
    views: [Option<FivePointView<'_, T>>; 2],
) -> [Vec<T>; 2] {
    let [Some(a), Some(b)] = views.map(|view| view.map(|view| view.coefficients()[2])) else {
        return [vec![], vec![]];
    };
    strip.beside(1, |k| a.entry(k) / b.entry(k))
}
