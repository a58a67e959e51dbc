use crate::{
    numbers::{Error, Norms, Rhs, Scalar},
    operators::{Diagonal, LinearOperator, positive_entry},
    problem::Hlcp,
};

/// A splitting `A + BΩ = M − N`, known by one solve with `M`.
///
/// `N` never appears: since `N = M − A − BΩ`, one step of a modulus-based method is the correction
/// `x⁺ = x − M⁻¹ F(x)`. `Mms::with_splitting` and `Tmms::with_splittings` take anything that solves
/// with an easy part of `A + BΩ`, and `Newton` in a [`SplittingStep`] as a preconditioner.
/// `&dyn Splitting` and `Box<dyn Splitting>` are splittings, and so is a closure
/// `|rhs: &[f64], y: &mut [f64]|`.
///
/// ```
/// use hlcp_core::Splitting;
///
/// /// M = diag(m), the simplest splitting.
/// struct Scaling(Vec<f64>);
///
/// impl Splitting<f64> for Scaling {
///     fn solve(&self, rhs: &[f64], y: &mut [f64]) {
///         for ((y, rhs), m) in y.iter_mut().zip(rhs).zip(&self.0) {
///             *y = rhs / m;
///         }
///     }
/// }
///
/// let mut y = [f64::NAN; 2];
/// Scaling(vec![2.0, 4.0]).solve(&[6.0, 6.0], &mut y);
/// assert_eq!(y, [3.0, 1.5]);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a splitting",
    note = "implement `Splitting`, or give a closure `|rhs: &[{T}], y: &mut [{T}]|`, which must be \
            `Fn`, `Send` and `Sync`",
    note = "steps such as `Aor` go to `Mms::new` and `Tmms::new`, with `?` after `Aor::sor(..)`"
)]
pub trait Splitting<T: Scalar>: Send + Sync {
    /// Overwrites `y` with the solution of `M y = rhs`; what `y` held before is never read.
    ///
    /// # Panics
    ///
    /// May panic unless both slices have the problem's order.
    fn solve(&self, rhs: &[T], y: &mut [T]);

    /// Returns how many sweeps over the unknowns one [`solve`](Self::solve) is worth: 2 for
    /// symmetric Gauss–Seidel.
    fn sweeps(&self) -> usize {
        1
    }
}

/// One step `x ↦ y` of a modulus-based method, together with what the stopping test reads.
///
/// A step is MMS's whole iteration and half of one of TMMS. It is told the problem and holds no
/// operators of its own.
///
/// ```
/// use hlcp_core::{Aor, Hlcp, Identity, Omega, Rhs, Step};
///
/// // One unknown: z − r − 3 = 0, so z = 3 and F(x) = 2x − 3.
/// let problem = Hlcp::new(Identity { order: 1 }, Identity { order: 1 }, Omega::Uniform(1.0))?;
/// let (step, q, scratch) = (Aor::gauss_seidel(), Rhs::new(&[-3.0])?, &mut vec![]);
/// step.check(&problem)?;
///
/// let (mut x, mut y) = ([0.0], [0.0]);
/// assert_eq!(step.step(&problem, &q, &x, &mut y, scratch).linf, 3.0); // at the start,
/// assert_eq!(y, [1.5]);
/// assert_eq!(step.step(&problem, &q, &y, &mut x, scratch).linf, 0.0); // and at what it led to
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a step of a method",
    note = "a splitting or a closure goes to `Mms::with_splitting` or `Tmms::with_splittings`",
    note = "`Aor::sor(..)` and its like return a `Result`: add `?`"
)]
pub trait Step<T: Scalar, A, B>: Send + Sync {
    /// Refuses a problem the step cannot divide its way through.
    ///
    /// # Errors
    ///
    /// The first row with an entry that is not finite or a pivot that is not positive, with its
    /// index. A [`SplittingStep`] knows no rows and refuses nothing.
    fn check(&self, problem: &Hlcp<T, A, B>) -> Result<(), Error>;

    /// Returns how many sweeps over the unknowns the step is worth.
    fn sweeps(&self) -> usize {
        1
    }

    /// Overwrites `y` with the next iterate and returns the norms of `F(x)/γ = A z − B r + q` at
    /// `x`, the step's *input*.
    ///
    /// `scratch` may be grown and keeps nothing that matters between calls.
    ///
    /// # Panics
    ///
    /// Unless `q`, `x` and `y` have the problem's order.
    fn step(
        &self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms;
}

/// A closure `(rhs, y)` is a splitting, worth one sweep.
#[diagnostic::do_not_recommend]
impl<T: Scalar, F: Fn(&[T], &mut [T]) + Send + Sync> Splitting<T> for F {
    fn solve(&self, rhs: &[T], y: &mut [T]) {
        self(rhs, y);
    }
}

// Of pointers to any type these two alone, because a closure behind a pointer is a closure.
macro_rules! forward_splitting {
    ($($pointer:ty),*) => {$(
        impl<T: Scalar> Splitting<T> for $pointer {
            fn solve(&self, rhs: &[T], y: &mut [T]) {
                (**self).solve(rhs, y);
            }

            fn sweeps(&self) -> usize {
                (**self).sweeps()
            }
        }
    )*};
}

forward_splitting!(&(dyn Splitting<T> + '_), Box<dyn Splitting<T> + '_>);

macro_rules! forward_step {
    ($($pointer:ty),*) => {$(
        impl<T: Scalar, A, B, P: Step<T, A, B> + ?Sized> Step<T, A, B> for $pointer {
            fn check(&self, problem: &Hlcp<T, A, B>) -> Result<(), Error> {
                (**self).check(problem)
            }

            fn sweeps(&self) -> usize {
                (**self).sweeps()
            }

            fn step(
                &self,
                problem: &Hlcp<T, A, B>,
                q: &Rhs<'_, T>,
                x: &[T],
                y: &mut [T],
                scratch: &mut Vec<T>,
            ) -> Norms {
                (**self).step(problem, q, x, y, scratch)
            }
        }
    )*};
}

forward_step!(&P, Box<P>);

/// The step `y = x − M⁻¹ F(x)` of any [`Splitting`]; it needs no more of `A` and `B` than products.
///
/// # Cost
///
/// One product with `A`, one with `B`, one solve with `M`; `2n` numbers of scratch.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Rhs, SplittingStep, Step};
///
/// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
/// let eighth = |rhs: &[f64], y: &mut [f64]| (y[0], y[1]) = (rhs[0] / 8.0, rhs[1] / 8.0);
/// let (step, q, mut y) = (SplittingStep(eighth), Rhs::new(&[-3.0, -3.0])?, [0.0; 2]);
/// let norms = step.step(&problem, &q, &[0.5, 0.5], &mut y, &mut vec![]);
/// assert_eq!((y, norms.linf), ([0.5, 0.5], 0.0)); // z = (1, 1), r = 0 is the solution
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct SplittingStep<S>(pub S);

impl<T, A, B, S> Step<T, A, B> for SplittingStep<S>
where
    T: Scalar,
    A: LinearOperator<T>,
    B: LinearOperator<T>,
    S: Splitting<T>,
{
    fn check(&self, _: &Hlcp<T, A, B>) -> Result<(), Error> {
        Ok(())
    }

    fn sweeps(&self) -> usize {
        self.0.sweeps()
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
        problem.assert_whole(q);
        problem.defect(q.entries(), x, y, scratch);
        let f = &mut scratch[..x.len()];
        f.copy_from_slice(y);
        let norms = problem.measure(q.meter(problem.gamma()), f, problem.gamma());
        self.0.solve(f, y);
        for (y, &x) in y.iter_mut().zip(x) {
            *y = x - *y;
        }
        norms
    }
}

/// The Jacobi splitting `M = D_A + D_B Ω` for operators that know only their products and diagonal.
///
/// Where rows can be walked, [`Aor::jacobi`](crate::Aor::jacobi) is the same splitting in one pass.
///
/// # Cost
///
/// One product with `A`, one with `B`; `2n` numbers of scratch, none for the diagonal.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Jacobi, Rhs, Step};
///
/// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?)?;
/// let (q, mut y) = ([-6.0, 3.0], [0.0; 2]);
/// Jacobi.step(&problem, &Rhs::new(&q)?, &[0.0, 0.0], &mut y, &mut vec![]);
/// assert_eq!(y, [1.0, -0.5]);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Jacobi;

impl<T: Scalar, A: Diagonal<T>, B: Diagonal<T>> Step<T, A, B> for Jacobi {
    fn check(&self, problem: &Hlcp<T, A, B>) -> Result<(), Error> {
        (0..problem.order()).try_for_each(|i| positive_pivot(problem, i, T::one(), T::one()))
    }

    fn step(
        &self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        let divided = |f: &[T], y: &mut [T]| {
            for (i, (y, &f)) in y.iter_mut().zip(f).enumerate() {
                *y = f / pivot(problem, i, T::one(), T::one());
            }
        };
        SplittingStep(divided).step(problem, q, x, y, scratch)
    }
}

/// Returns the diagonal entry `aᵢᵢ/α_A + bᵢᵢ ωᵢ/α_B` of `M`, from the reciprocals of the two α.
#[inline]
pub(crate) fn pivot<T: Scalar, A: Diagonal<T>, B: Diagonal<T>>(
    problem: &Hlcp<T, A, B>,
    i: usize,
    over_a: T,
    over_b: T,
) -> T {
    problem.a().diagonal_entry(i) * over_a
        + problem.b().diagonal_entry(i) * problem.omega().entry(i) * over_b
}

/// Refuses diagonal entries that are not finite and pivots that are not positive.
pub(crate) fn positive_pivot<T: Scalar, A: Diagonal<T>, B: Diagonal<T>>(
    problem: &Hlcp<T, A, B>,
    i: usize,
    over_a: T,
    over_b: T,
) -> Result<(), Error> {
    let entries = [
        ("diagonal of A", problem.a().diagonal_entry(i)),
        ("diagonal of B", problem.b().diagonal_entry(i)),
    ];
    for (what, value) in entries {
        if !value.is_finite() {
            return Err(Error::NotFinite { what, index: i, value: value.wide() });
        }
    }
    let pivot = positive_entry("diagonal of M", i, pivot(problem, i, over_a, over_b))?;
    positive_entry("1/diagonal of M", i, pivot.recip()).map(drop)
}
