use super::{Aor, Step};
use crate::{
    numbers::{Error, Norms, Rhs, Scalar, check_orders},
    operators::Rows,
    problem::Hlcp,
    rows::Colours,
};

/// An [`Aor`] splitting in a multicolour order: a splitting of its own, whose sweeps over any rows
/// run in parallel.
///
/// Each row has the least colour that no earlier row has which it is coupled to, in `A` or in `B`,
/// in either direction. With the permutation `P` that sorts by colour, and by index within a
/// colour, `M = Pᵀ M′P`, where `M′` is the AOR splitting of `P A Pᵀ` and `P B Pᵀ`: the iterates are
/// others than in the order of the rows, but theorems for every pair of a class hold. Threads relax
/// the rows of one colour together, with the same bits for any number of threads.
///
/// On a five-point grid there are two colours, and [`Aor::red_black`] is faster.
///
/// # Cost
///
/// The colours take a walk over the rows and, at set-up alone, 16 bytes an entry; they keep 12 to
/// 16 bytes a row. A step is one walk over the rows of `A` and of `B`, `n` numbers of scratch, and
/// a copy of the new values, which is not shared; one thread is slower than in the rows' order.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Multicolour, Rhs, Step};
///
/// let problem = Hlcp::lcp(FivePoint::new(3, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?)?;
/// let coloured = Multicolour::new(Aor::gauss_seidel(), &problem);
/// assert_eq!(coloured.colours(), 2);
/// let (q, mut y) = ([-6.0, 0.0, -12.0], [0.0; 3]);
/// coloured.step(&problem, &Rhs::new(&q)?, &[0.0; 3], &mut y, &mut vec![]);
/// assert_eq!(y, [1.0, 0.5, 2.0]); // the first and the last row, then the one between
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Multicolour<T> {
    aor: Aor<T>,
    colours: Colours,
}

impl<T: Scalar> Multicolour<T> {
    /// Returns the splitting with the parameters and the direction of `aor` in the colours of the
    /// problem's rows; a red–black order of `aor` is dropped.
    pub fn new<A: Rows<T>, B: Rows<T>>(aor: Aor<T>, problem: &Hlcp<T, A, B>) -> Self {
        Self { aor, colours: Colours::new(problem.order(), problem.a(), problem.b()) }
    }

    /// Returns the number of colours: how often threads wait for one another in a sweep.
    pub fn colours(&self) -> usize {
        self.colours.count()
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Step<T, A, B> for Multicolour<T> {
    /// Refuses, as [`Aor`] does, and [`Error::Order`] a problem of another order than the one whose
    /// rows have their colours here. Rows of one colour that are coupled in another problem are
    /// relaxed as Jacobi relaxes them.
    fn check(&self, problem: &Hlcp<T, A, B>) -> Result<(), Error> {
        check_orders(problem.order(), &[("the multicolour order", self.colours.order())])?;
        problem.on_one_rank("a sweep in multicolour order")?;
        self.aor.check(problem)
    }

    fn step(
        &self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        problem.assert_orders([("q", q.entries().len()), ("x", x.len()), ("y", y.len())]);
        problem.assert_orders([("colours", self.colours.order())]);
        self.aor.walk(problem, Some(&self.colours), q, x, y, scratch)
    }
}
