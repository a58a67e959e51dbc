use super::Hlcp;
use crate::{
    kernel::Smoother,
    numbers::{Error, Scalar},
    operators::{Coefficients, LinearOperator, Omega, positive_entry},
};

impl<'a, T: Scalar> Smoother<'a, T> {
    /// Returns the Ω = D_A D_B⁻¹ that belongs to a problem's operators.
    ///
    /// # Errors
    ///
    /// [`Error::NotFivePoint`] as by [`Hlcp::grid`]; [`Error::NotPositive`] for the first diagonal
    /// entry of `A` or `B`, or ratio of both, that is not positive and finite.
    pub fn scaling<A: LinearOperator<T>, B: LinearOperator<T>>(
        problem: &Hlcp<T, A, B>,
    ) -> Result<Omega<T>, Error> {
        let [a, b] = problem.sweep()?.views().map(|view| view.coefficients()[2]);
        let ratio = |k: usize| {
            let a = positive_entry("diagonal of A", k, a.entry(k))?;
            let b = positive_entry("diagonal of B", k, b.entry(k))?;
            positive_entry("1/diagonal of 2A", k, (a + a).recip())?;
            positive_entry("ratio of the diagonals", k, a / b)
        };
        let own = match [a, b] {
            [Coefficients::Uniform(_), Coefficients::Uniform(_)] => ratio(0).map(Omega::Uniform),
            _ => (0..problem.order()).map(ratio).collect::<Result<_, _>>().map(Omega::of_list),
        };
        // The same on all ranks, if it is on each.
        let own = problem.agree(own)?;
        let [most, least] = problem.largest(match own {
            Omega::Uniform(ratio) => [ratio.wide(), -ratio.wide()],
            Omega::Each(_) => [f64::INFINITY; 2],
        });
        Ok(match own {
            Omega::Uniform(ratio) if most != -least => Omega::Each(vec![ratio; problem.order()]),
            own => own,
        })
    }

    /// Returns the equation of a problem's operators, with its [`scaling`](Self::scaling) for Ω, or
    /// `None` where that is the problem's own; on the threads of rayon's current pool if
    /// `parallel`. Refuses what [`Hlcp::grid`] does.
    pub fn new<A: LinearOperator<T>, B: LinearOperator<T>>(
        problem: &'a Hlcp<T, A, B>,
        scaling: Option<&'a Omega<T>>,
        parallel: bool,
    ) -> Result<Self, Error> {
        let sweep = problem.sweep()?;
        let mut sweep = scaling.map_or(sweep, |scaling| sweep.scaled(scaling));
        sweep.parallel = parallel;
        Ok(Self { sweep })
    }
}
