use std::fmt;

/// A method that [`Auto`](crate::Auto) can call.
///
/// ```
/// assert_eq!(hlcp_methods::AutoChoice::AmgNewton.to_string(), "Newton with algebraic multigrid");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum AutoChoice {
    /// [`AdaptiveSor`](crate::AdaptiveSor).
    Sor,
    /// [`Multigrid`](crate::Multigrid).
    Multigrid,
    /// [`AmgNewton`](crate::AmgNewton).
    AmgNewton,
    /// [`Newton`](crate::Newton) with [`TridiagonalPart`](crate::TridiagonalPart), where that is
    /// all of the operators.
    Newton,
    /// [`Anderson`](crate::Anderson) with a window of ten, on symmetric Gauss–Seidel sweeps.
    Anderson,
    /// [`Pivoting`](crate::Pivoting).
    Pivoting,
}

impl fmt::Display for AutoChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sor => "adaptive SOR",
            Self::Multigrid => "multigrid",
            Self::AmgNewton => "Newton with algebraic multigrid",
            Self::Newton => "Newton",
            Self::Anderson => "Anderson",
            Self::Pivoting => "pivoting",
        })
    }
}

/// Why [`Auto`](crate::Auto) left a method.
///
/// ```
/// assert_eq!(hlcp_methods::AutoEnd::Slow.to_string(), "another one promised more");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum AutoEnd {
    /// Another one promised more than the progress that was measured, or it had come to rest, or
    /// its elimination would have outlasted the time limit.
    Slow,
    /// The residual had grown to 10⁶ times the larger of ‖q‖ and the first one.
    Growing,
    /// The method could not be set up, for a diagonal entry that is not positive, say.
    Refused,
}

impl fmt::Display for AutoEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Slow => "another one promised more",
            Self::Growing => "the residual had grown",
            Self::Refused => "it could not be set up",
        })
    }
}

/// The turn of one method in a solve by [`Auto`](crate::Auto).
///
/// ```
/// use hlcp_methods::{Auto, AutoChoice, Hlcp, Identity, Limits, Method, Solver};
///
/// let mut solver = Solver::new(Auto::new(Hlcp::lcp(Identity { order: 3 })?)?);
/// solver.solve(&[-3.0; 3], Limits::default())?.ok()?;
/// println!("{}", solver.method().turns()[0]); // which method, how far, and why it ended
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct AutoTurn {
    /// The method.
    pub choice: AutoChoice,
    /// The work of the turn, in sweeps.
    pub sweeps: usize,
    /// The smallest 2-norm of a residual that has been seen in the solve by the end of the turn.
    pub residual: f64,
    /// Why it ended; `None` of the last turn.
    pub end: Option<AutoEnd>,
}

impl fmt::Display for AutoTurn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { choice, sweeps, residual, end } = self;
        write!(f, "{choice}: {sweeps} sweeps, to a residual of {residual:.2e}")?;
        end.map_or(Ok(()), |end| write!(f, "; {end}"))
    }
}
