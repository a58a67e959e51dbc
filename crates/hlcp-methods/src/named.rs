use hlcp_core::{Aor, Error, Hlcp, LinearOperator, Rows, Scalar};

use crate::{
    AdaptiveSor, AmgNewton, Anderson, Auto, Cycle, FullMultigrid, Method, Mms, Multigrid, Newton,
    Ssor, Tmms, TridiagonalPart,
};

/// Any method on a problem with operators `A` and `B`.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Omega};
/// use hlcp_methods::{BoxedMethod, Named, Parameters, Solver};
///
/// type Stencil = FivePoint<f64>;
/// struct Simulation {
///     solver: Solver<f64, BoxedMethod<'static, f64, Stencil, Stencil>>,
/// }
///
/// let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let problem = Hlcp::new(a, a, Omega::Uniform(1.0))?;
/// let method = Named::parse("AUTO", Parameters::default())?.on(problem)?;
/// let mut simulation = Simulation { solver: Solver::new(method) };
/// # let options = hlcp_methods::Options::from_x(&[1.0; 16]);
/// # assert!(simulation.solver.solve(&[-1.0; 16], options)?.converged());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type BoxedMethod<'p, T, A, B> = Box<dyn Method<T, A = A, B = B> + 'p>;

/// The three families of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Family {
    Mms,
    Amms,
    Tmms,
}

/// A method by its name, with its parameters.
///
/// The paper's names are a family, `M`, `AM` or `TM`, and a splitting, `J`, `GS`, `SOR` or `AOR`;
/// and those of Table 1, where an index fixes the parameters. In a two-step method the first step
/// runs forward and the second backward, with (α₁, β₁) for the first step and (α₂, β₂) for the
/// second; without a second pair both have the first. `RB` before a splitting, as in `TMRBGS`,
/// sorts the points of the problem's grid in red–black order, [`Aor::red_black`]; the paper has no
/// such names.
///
/// Beyond the paper there are
///
/// | name | method |
/// |---|---|
/// | `AUTO` | [`Auto`] |
/// | `ADAPTIVE` | [`AdaptiveSor`] |
/// | `NEWTON` | [`Newton`] with [`TridiagonalPart`] where both operators are tridiagonal, else [`Ssor`] |
/// | `AMG` | [`AmgNewton`], Newton's method with algebraic multigrid |
/// | `ANDERSON` | [`Anderson`] |
/// | `MGV`, `MGW`, `MGF` | [`Multigrid`] by V-cycles, W-cycles and F-cycles |
/// | `FMG` | [`FullMultigrid`] with F-cycles |
///
/// ```
/// use hlcp_methods::{Named, Parameters};
///
/// let table = Named::parse("TMGSSOR2", Parameters::default())?;
/// assert_eq!((table.first(), table.second()), (Some([1.0, 1.0]), Some([1.1, 1.1])));
///
/// let typo = Named::parse("TMAR", Parameters::default()).unwrap_err();
/// assert_eq!(typo.to_string(), "there is no method 'TMAR'; the closest name is 'TMAOR'");
/// # Ok::<(), hlcp_methods::NameError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Named(Kind);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Relaxed(Relaxed),
    Anderson { base: Option<Relaxed>, window: usize },
    Newton { base: Option<Relaxed> },
    AmgNewton { base: Option<Relaxed> },
    Multigrid(Cycle),
    FullMultigrid,
    Adaptive,
    Auto,
}

/// A method of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Relaxed {
    family: Family,
    first: [f64; 2],
    second: [f64; 2],
    red_black: bool,
}

/// The parameters that accompany a name; those the name fixes are to be left out.
///
/// The relaxation parameters of `NEWTON`, `AMG` and `ANDERSON` are those of the base that is given.
///
/// ```
/// use hlcp_methods::{Named, Parameters};
///
/// let given = Parameters { alpha: Some(1.2), alpha2: Some(0.9), ..Parameters::default() };
/// let tmsor = Named::parse("TMSOR", given)?; // β = α, which SOR fixes
/// assert_eq!((tmsor.first(), tmsor.second()), (Some([1.2, 1.2]), Some([0.9, 0.9])));
///
/// let given = Parameters { base: Some("AMGS"), window: Some(5), ..Parameters::default() };
/// assert!(Named::parse("ANDERSON", given).is_ok());
/// # Ok::<(), hlcp_methods::NameError>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Parameters<'a> {
    /// α, of the first step where there are two.
    pub alpha: Option<f64>,
    /// β, of the first step where there are two.
    pub beta: Option<f64>,
    /// α of the second step.
    pub alpha2: Option<f64>,
    /// β of the second step.
    pub beta2: Option<f64>,
    /// The method of the paper that `ANDERSON` accelerates, and that `NEWTON` and `AMG` fall back
    /// on; without it `AMGS` forward and then backward.
    pub base: Option<&'a str>,
    /// How many earlier iterates `ANDERSON` mixes; without it 10.
    pub window: Option<usize>,
}

/// A name, or parameters for it, that make no method.
///
/// ```
/// use hlcp_methods::{Named, Parameters};
///
/// let alpha = Parameters { alpha: Some(1.2), ..Parameters::default() };
/// let gs = Named::parse("MGS", alpha).unwrap_err();
/// assert_eq!(gs.to_string(), "MGS takes no alpha (given: 1.2); use MSOR");
///
/// let foo = Named::parse("FOO", alpha).unwrap_err().to_string();
/// assert!(foo.starts_with("there is no method 'FOO'; the names are "));
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NameError {
    /// There is no such name.
    #[error("there is no method '{name}'; {}", way_out(closest.as_deref()))]
    Unknown {
        /// The name as given.
        name: String,
        /// The name it resembles, where one is near.
        closest: Option<String>,
    },
    /// The base is no method of the paper.
    #[error("the base is '{base}', but it must be a method of the paper, as TMGS")]
    Base {
        /// The base as given.
        base: String,
    },
    /// A parameter is missing.
    #[error("{name} needs {parameter}: {advice}")]
    Missing {
        /// The method.
        name: String,
        /// The parameter.
        parameter: &'static str,
        /// The values that are worth a try.
        advice: &'static str,
    },
    /// A parameter is given that the name fixes, or that the method has no use for.
    #[error("{name} takes no {parameter} (given: {value}); use {instead}")]
    Fixed {
        /// The method.
        name: String,
        /// The parameter.
        parameter: &'static str,
        /// Its value.
        value: String,
        /// The names that take it.
        instead: String,
    },
}

/// The second half of the answer to a name that does not exist.
fn way_out(closest: Option<&str>) -> String {
    match closest {
        Some(closest) => format!("the closest name is '{closest}'"),
        None => format!(
            "the names are M, AM or TM before J, GS, SOR, AOR, RBGS, RBSOR or RBAOR, as in TMGS, \
             those of the paper's Table 1, and {}",
            BEYOND.map(|(name, _)| name).join(", ")
        ),
    }
}

const ALPHA: &str = "1 is Gauss-Seidel, 1.1 to 1.4 is often faster, and ADAPTIVE finds one";
const BETA: &str = "beta = alpha is SOR, and the paper takes beta = alpha - 0.2";

/// The names beyond the paper's, with their defaults.
const BEYOND: [(&str, Kind); 9] = [
    ("AUTO", Kind::Auto),
    ("ADAPTIVE", Kind::Adaptive),
    ("NEWTON", Kind::Newton { base: None }),
    ("AMG", Kind::AmgNewton { base: None }),
    ("ANDERSON", Kind::Anderson { base: None, window: 10 }),
    ("MGV", Kind::Multigrid(Cycle::V)),
    ("MGW", Kind::Multigrid(Cycle::W)),
    ("MGF", Kind::Multigrid(Cycle::F)),
    ("FMG", Kind::FullMultigrid),
];

/// The parameters that a splitting's name leaves open.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Open {
    /// Both parameters are fixed.
    Nothing([f64; 2]),
    /// α, with β = α.
    Alpha,
    /// α and β.
    Both,
}

/// The meaning of a method's name; a second step that is `None` is like the first.
type Entry = (String, Family, Open, Option<[f64; 2]>);

/// Every name of the paper, with the parameters of Table 1.
fn table() -> Vec<Entry> {
    let splittings = [
        ("J", Open::Nothing([1.0, 0.0])),
        ("GS", Open::Nothing([1.0, 1.0])),
        ("SOR", Open::Alpha),
        ("AOR", Open::Both),
        ("SOR1", Open::Nothing([1.2, 1.2])),
        ("SOR2", Open::Nothing([1.0, 1.0])),
        ("SOR3", Open::Nothing([0.8, 0.8])),
        ("AOR1", Open::Nothing([1.3, 1.1])),
        ("AOR2", Open::Nothing([1.1, 0.9])),
        ("AOR3", Open::Nothing([0.9, 0.7])),
        ("RBGS", Open::Nothing([1.0, 1.0])),
        ("RBSOR", Open::Alpha),
        ("RBAOR", Open::Both),
    ];
    let families = [("M", Family::Mms), ("AM", Family::Amms), ("TM", Family::Tmms)];
    let two_splittings = [
        ("TMJSOR1", [1.0, 0.0], [0.9, 0.9]),
        ("TMJSOR2", [1.0, 0.0], [1.0, 1.0]),
        ("TMJSOR3", [1.0, 0.0], [1.1, 1.1]),
        ("TMJSOR4", [1.0, 0.0], [1.2, 1.2]),
        ("TMGSJ", [1.0, 1.0], [1.0, 0.0]),
        ("TMGSSOR1", [1.0, 1.0], [0.9, 0.9]),
        ("TMGSSOR2", [1.0, 1.0], [1.1, 1.1]),
        ("TMGSSOR3", [1.0, 1.0], [1.2, 1.2]),
    ];
    let paired = families.into_iter().flat_map(|(prefix, family)| {
        splittings.map(|(suffix, open)| (format!("{prefix}{suffix}"), family, open, None))
    });
    let mixed = two_splittings.map(|(name, first, second)| {
        (name.to_owned(), Family::Tmms, Open::Nothing(first), Some(second))
    });
    paired.chain(mixed).collect()
}

/// Refuses a parameter that is given, and says who takes it.
fn refuse(
    name: &str,
    parameter: &'static str,
    value: Option<impl ToString>,
    instead: impl Into<String>,
) -> Result<(), NameError> {
    let Some(value) = value else { return Ok(()) };
    let (name, value, instead) = (name.to_owned(), value.to_string(), instead.into());
    Err(NameError::Fixed { name, parameter, value, instead })
}

impl Relaxed {
    /// The method `name`, if there is one, with the parameters that it leaves open.
    fn parse(name: &str, given: &Parameters<'_>) -> Option<Result<Self, NameError>> {
        let table = table();
        let (_, family, open, second) = table.iter().find(|(known, ..)| known == name)?;
        Some(Self::of(name, *family, *open, *second, given))
    }

    fn of(
        name: &str,
        family: Family,
        open: Open,
        fixed_second: Option<[f64; 2]>,
        given: &Parameters<'_>,
    ) -> Result<Self, NameError> {
        // No other names have these letters.
        let red_black = name.contains("RB");
        let order = if red_black { "RB" } else { "" };
        let prefix = match family {
            Family::Mms => "M",
            Family::Amms => "AM",
            Family::Tmms => "TM",
        };
        let missing = |parameter, advice| {
            move || NameError::Missing { name: name.to_owned(), parameter, advice }
        };
        let alpha = || given.alpha.ok_or_else(missing("alpha", ALPHA));
        let first = match open {
            Open::Nothing(first) => {
                refuse(name, "alpha", given.alpha, format!("{prefix}{order}SOR"))?;
                refuse(name, "beta", given.beta, format!("{prefix}{order}AOR"))?;
                first
            }
            Open::Alpha => {
                refuse(name, "beta", given.beta, format!("{prefix}{order}AOR"))?;
                [alpha()?; 2]
            }
            Open::Both => [alpha()?, given.beta.ok_or_else(missing("beta", BETA))?],
        };
        let two_steps = family == Family::Tmms;
        if !two_steps || matches!(open, Open::Nothing(_)) {
            refuse(name, "alpha2", given.alpha2, format!("TM{order}SOR"))?;
        }
        if !two_steps || open != Open::Both {
            refuse(name, "beta2", given.beta2, format!("TM{order}AOR"))?;
        }
        let alpha2 = given.alpha2.unwrap_or(first[0]);
        let second = match (open, fixed_second) {
            (_, Some(second)) => second,
            (Open::Alpha, None) => [alpha2; 2],
            _ => [alpha2, given.beta2.unwrap_or(first[1])],
        };
        Ok(Self { family, first, second, red_black })
    }

    fn on<'p, T, A, B>(&self, problem: Hlcp<T, A, B>) -> Result<BoxedMethod<'p, T, A, B>, Error>
    where
        T: Scalar,
        A: Rows<T> + 'p,
        B: Rows<T> + 'p,
    {
        Ok(match self.steps(&problem)?[..] {
            [first, second] => Box::new(Tmms::new(problem, first, second)?),
            [first, ..] => Box::new(Mms::new(problem, first)?),
            [] => unreachable!("an iteration has one step or two"),
        })
    }

    /// The steps of one iteration.
    fn steps<T, A, B>(&self, problem: &Hlcp<T, A, B>) -> Result<Vec<Aor<T>>, Error>
    where
        T: Scalar,
        A: LinearOperator<T>,
        B: LinearOperator<T>,
    {
        let aor = |[alpha, beta]: [f64; 2]| {
            let aor = Aor::new(T::of(alpha), T::of(beta))?;
            if self.red_black { aor.red_black(problem.grid()?[0]) } else { Ok(aor) }
        };
        let first = aor(self.first)?;
        Ok(match self.family {
            Family::Mms => vec![first],
            Family::Amms => vec![first.accelerated()],
            Family::Tmms => vec![first, aor(self.second)?.backward()],
        })
    }
}

impl Named {
    /// Every name, those of the paper first.
    ///
    /// ```
    /// use hlcp_methods::Named;
    ///
    /// let names = Named::names();
    /// assert_eq!((names[0].as_str(), names.len()), ("MJ", 56));
    /// assert!(names.contains(&"AUTO".to_owned()));
    /// ```
    pub fn names() -> Vec<String> {
        let beyond = BEYOND.map(|(name, _)| name.to_owned());
        table().into_iter().map(|(name, ..)| name).chain(beyond).collect()
    }

    /// Looks up `name`, in any case, and joins it with the parameters it leaves open.
    ///
    /// # Errors
    ///
    /// [`NameError`], with the name or the parameter that is wrong.
    pub fn parse(name: &str, given: Parameters<'_>) -> Result<Self, NameError> {
        let name = name.to_ascii_uppercase();
        let kind = BEYOND.iter().find(|(known, _)| *known == name).map(|&(_, kind)| kind);
        if !matches!(kind, Some(Kind::Anderson { .. })) {
            refuse(&name, "window", given.window, "ANDERSON")?;
        }
        let on_base = |kind: &Kind| {
            matches!(kind, Kind::Anderson { .. } | Kind::Newton { .. } | Kind::AmgNewton { .. })
        };
        if !kind.as_ref().is_some_and(on_base) {
            refuse(&name, "base", given.base, "ANDERSON, NEWTON or AMG")?;
        }
        let Some(kind) = kind else {
            let relaxed = Relaxed::parse(&name, &given);
            return relaxed
                .unwrap_or_else(|| Err(Self::unknown(name)))
                .map(Kind::Relaxed)
                .map(Self);
        };
        let base = match given.base.map(str::to_ascii_uppercase) {
            Some(base) => {
                let relaxed = Relaxed::parse(&base, &given);
                Some(relaxed.unwrap_or(Err(NameError::Base { base }))?)
            }
            None => {
                refuse(&name, "alpha", given.alpha, "MSOR, AMSOR or TMSOR")?;
                refuse(&name, "beta", given.beta, "MAOR, AMAOR or TMAOR")?;
                refuse(&name, "alpha2", given.alpha2, "TMSOR")?;
                refuse(&name, "beta2", given.beta2, "TMAOR")?;
                None
            }
        };
        Ok(Self(match kind {
            Kind::Newton { .. } => Kind::Newton { base },
            Kind::AmgNewton { .. } => Kind::AmgNewton { base },
            Kind::Anderson { window, .. } => {
                Kind::Anderson { base, window: given.window.unwrap_or(window) }
            }
            kind => kind,
        }))
    }

    /// The error for `name`, with a suggestion if at most a third of its letters differ.
    fn unknown(name: String) -> NameError {
        let distances = Self::names().into_iter().map(|known| {
            let distance = strsim::damerau_levenshtein(&known, &name);
            (distance, known)
        });
        let (distance, closest) =
            distances.min_by_key(|(distance, _)| *distance).unwrap_or_default();
        let near = 3 * distance <= name.chars().count();
        NameError::Unknown { name, closest: near.then_some(closest) }
    }

    /// (α, β), of the first step where there are two; of a method of the paper.
    pub fn first(&self) -> Option<[f64; 2]> {
        self.relaxed().map(|relaxed| relaxed.first)
    }

    /// (α, β) of the second step, where there are two; of a method of the paper.
    pub fn second(&self) -> Option<[f64; 2]> {
        let relaxed = self.relaxed().filter(|relaxed| relaxed.family == Family::Tmms);
        relaxed.map(|relaxed| relaxed.second)
    }

    /// Returns whether the points are in red–black order.
    pub fn is_red_black(&self) -> bool {
        self.relaxed().is_some_and(|relaxed| relaxed.red_black)
    }

    /// Returns whether the method is an AMMS.
    pub fn is_accelerated(&self) -> bool {
        self.relaxed().is_some_and(|relaxed| relaxed.family == Family::Amms)
    }

    /// Returns the steps of one iteration on `problem`, as the theorems of `hlcp-verify` take them;
    /// `None` for a method that is not the paper's.
    ///
    /// # Errors
    ///
    /// [`Error::Parameter`] for parameters out of range, [`Error::NotFivePoint`] for a red–black
    /// order without a grid.
    ///
    /// ```
    /// use hlcp_core::{Aor, FivePoint, Hlcp, Omega};
    /// use hlcp_methods::{Named, Parameters};
    ///
    /// let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
    /// let problem = Hlcp::new(a, a, Omega::Uniform(1.0))?;
    /// let steps = Named::parse("TMGS", Parameters::default())?.steps(&problem)?;
    /// assert_eq!(steps, Some(vec![Aor::gauss_seidel(), Aor::gauss_seidel().backward()]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn steps<T, A, B>(&self, problem: &Hlcp<T, A, B>) -> Result<Option<Vec<Aor<T>>>, Error>
    where
        T: Scalar,
        A: LinearOperator<T>,
        B: LinearOperator<T>,
    {
        self.relaxed().map(|relaxed| relaxed.steps(problem)).transpose()
    }

    fn relaxed(&self) -> Option<&Relaxed> {
        match &self.0 {
            Kind::Relaxed(relaxed) => Some(relaxed),
            _ => None,
        }
    }

    /// The method on `problem`; `AUTO` clones the operators, so give large ones by reference.
    ///
    /// # Errors
    ///
    /// [`Error`] for parameters out of range, [`Error::NotFivePoint`] for a red–black order or
    /// multigrid without a grid, and for what the methods refuse of the problem.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp, Omega};
    /// use hlcp_methods::{Named, Parameters};
    ///
    /// let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
    /// let problem = Hlcp::new(a, a, Omega::Uniform(1.0))?;
    /// let method = Named::parse("AMGS", Parameters::default())?.on(problem)?;
    /// assert!(!method.has_memory());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn on<'p, T, A, B>(&self, problem: Hlcp<T, A, B>) -> Result<BoxedMethod<'p, T, A, B>, Error>
    where
        T: Scalar,
        A: Rows<T> + Clone + 'p,
        B: Rows<T> + Clone + 'p,
    {
        let on = |base: &Option<Relaxed>, problem| -> Result<BoxedMethod<'p, T, A, B>, Error> {
            match base {
                Some(base) => base.on(problem),
                None => Ok(Box::new(Tmms::mirrored(problem, Aor::gauss_seidel().accelerated())?)),
            }
        };
        Ok(match &self.0 {
            Kind::Relaxed(relaxed) => relaxed.on(problem)?,
            Kind::Anderson { base, window } => {
                Box::new(Anderson::new(on(base, problem)?, *window)?)
            }
            Kind::Newton { base } if TridiagonalPart::is_all(&problem) => {
                Box::new(Newton::new(on(base, problem)?, TridiagonalPart::new()))
            }
            Kind::Newton { base } => Box::new(Newton::new(on(base, problem)?, Ssor)),
            Kind::AmgNewton { base } => Box::new(AmgNewton::new(on(base, problem)?)?),
            Kind::Multigrid(cycle) => Box::new(Multigrid::new(problem, *cycle)?),
            Kind::FullMultigrid => Box::new(FullMultigrid::new(Multigrid::new(problem, Cycle::F)?)),
            Kind::Adaptive => Box::new(AdaptiveSor::new(problem)?),
            Kind::Auto => Box::new(Auto::new(problem)?),
        })
    }
}
