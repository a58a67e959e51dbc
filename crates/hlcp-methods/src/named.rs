use std::{fmt, str::FromStr, sync::LazyLock};

use hlcp_core::{Aor, Compiled, Error, Hlcp, LinearOperator, Rows, Scalar};

use crate::{
    AdaptiveSor, AmgNewton, Anderson, Auto, Cycle, FullMultigrid, Method, Mms, Multigrid, Newton,
    Pivoting, Renumbered, Ssor, Tmms, TridiagonalPart, cuthill_mckee,
};

/// Any method on a problem with operators `A` and `B`, which may move to another thread.
///
/// ```
/// use hlcp_methods::{BoxedMethod, FivePoint, Hlcp, Identity, Limits, Named, Solver};
///
/// type Stencil = FivePoint<f64>;
/// struct Simulation {
///     solver: Solver<f64, BoxedMethod<'static, f64, Stencil, Identity>>,
/// }
///
/// let problem = Hlcp::lcp(FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?)?;
/// let mut simulation = Simulation { solver: Solver::new("AUTO".parse::<Named>()?.on(problem)?) };
/// let other = std::thread::spawn(move || simulation.solver.solve(&[-1.0; 16], Limits::default()));
/// assert!(other.join().unwrap()?.converged());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type BoxedMethod<'p, T, A, B> = Box<dyn Method<T, A = A, B = B> + Send + 'p>;

/// An operator with rows behind `dyn`, as [`Named::on_dyn`] takes it.
pub type DynRows<'p, T> = &'p (dyn Rows<T> + 'p);

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
/// | `AUTO` | [`Auto`], [`Renumbered`] where unknowns are numbered at random |
/// | `ADAPTIVE` | [`AdaptiveSor`] |
/// | `NEWTON` | [`Newton`] with [`TridiagonalPart`] where both operators are tridiagonal, else [`Ssor`] |
/// | `AMG` | [`AmgNewton`], Newton's method with algebraic multigrid |
/// | `PIVOTING` | [`Pivoting`], Newton's method by elimination |
/// | `ANDERSON` | [`Anderson`] |
/// | `MGV`, `MGW`, `MGF` | [`Multigrid`] by V-cycles, W-cycles and F-cycles |
/// | `FMG` | [`FullMultigrid`] with W-cycles, or with F-cycles for tridiagonal operators |
///
/// ```
/// use hlcp_methods::{Named, Parameters};
///
/// let table = Named::parse("TMGSSOR2", Parameters::default())?;
/// assert_eq!((table.first(), table.second()), (Some([1.0, 1.0]), Some([1.1, 1.1])));
///
/// let typo = Named::parse("TMAR", Parameters::default()).unwrap_err();
/// assert_eq!(typo.to_string(), "there is no method 'TMAR'; the closest name is 'TMAOR'");
///
/// let newton: Named = "newton".parse()?; // without parameters
/// assert_eq!(newton.to_string(), "NEWTON");
/// # Ok::<(), hlcp_methods::NameError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Named {
    name: &'static str,
    kind: Kind,
    /// The method that `NEWTON`, `AMG` and `ANDERSON` are given to stand on.
    base: Option<Relaxed>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Relaxed(Relaxed),
    Anderson { window: usize },
    Newton,
    AmgNewton,
    Pivoting,
    Multigrid(Cycle),
    FullMultigrid,
    Adaptive,
    Auto,
}

/// A method of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Relaxed {
    /// M, AM or TM.
    family: &'static str,
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
    /// It is a family of the paper's, which has many members.
    #[error(
        "{family}MS is a family of methods: take {family}J, {family}GS, {family}SOR or {family}AOR; \
         MMS and TMMS can be made with a splitting of your own, too"
    )]
    Family {
        /// The letters before MS.
        family: String,
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
            BEYOND.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
        ),
    }
}

const ALPHA: &str = "1 is Gauss-Seidel, 1.1 to 1.4 is often faster, and ADAPTIVE finds one";
const BETA: &str = "beta = alpha is SOR, and the paper takes beta = alpha - 0.2";

/// The names beyond the paper's, with their defaults.
const BEYOND: &[(&str, Kind)] = &[
    ("AUTO", Kind::Auto),
    ("ADAPTIVE", Kind::Adaptive),
    ("NEWTON", Kind::Newton),
    ("AMG", Kind::AmgNewton),
    ("PIVOTING", Kind::Pivoting),
    ("ANDERSON", Kind::Anderson { window: 10 }),
    ("MGV", Kind::Multigrid(Cycle::V)),
    ("MGW", Kind::Multigrid(Cycle::W)),
    ("MGF", Kind::Multigrid(Cycle::F)),
    ("FMG", Kind::FullMultigrid),
];

/// The (α, β) of a splitting's name.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Pair {
    Fixed([f64; 2]),
    /// α is open, and β = α.
    Alpha,
    /// Both are open.
    Open,
}

/// A name of the paper; a second step that is `None` is like the first.
struct Entry {
    name: String,
    family: &'static str,
    first: Pair,
    second: Option<[f64; 2]>,
}

/// Every name of the paper, with the parameters of Table 1.
static TABLE: LazyLock<Vec<Entry>> = LazyLock::new(|| {
    let splittings = [
        ("J", Pair::Fixed([1.0, 0.0])),
        ("GS", Pair::Fixed([1.0, 1.0])),
        ("SOR", Pair::Alpha),
        ("AOR", Pair::Open),
        ("SOR1", Pair::Fixed([1.2, 1.2])),
        ("SOR2", Pair::Fixed([1.0, 1.0])),
        ("SOR3", Pair::Fixed([0.8, 0.8])),
        ("AOR1", Pair::Fixed([1.3, 1.1])),
        ("AOR2", Pair::Fixed([1.1, 0.9])),
        ("AOR3", Pair::Fixed([0.9, 0.7])),
        ("RBGS", Pair::Fixed([1.0, 1.0])),
        ("RBSOR", Pair::Alpha),
        ("RBAOR", Pair::Open),
    ];
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
    let paired = ["M", "AM", "TM"].into_iter().flat_map(|family| {
        splittings.map(|(suffix, first)| {
            let name = format!("{family}{suffix}");
            Entry { name, family, first, second: None }
        })
    });
    let mixed = two_splittings.map(|(name, first, second)| {
        let (name, first) = (name.to_owned(), Pair::Fixed(first));
        Entry { name, family: "TM", first, second: Some(second) }
    });
    paired.chain(mixed).collect()
});

impl Entry {
    /// Returns the entry of a name, if there is one.
    fn of(name: &str) -> Option<&'static Self> {
        TABLE.iter().find(|entry| entry.name == name)
    }

    /// Returns the method with the parameters that its name leaves open.
    fn with(&self, given: &Parameters<'_>) -> Result<Relaxed, NameError> {
        let Self { name, family, first, second } = self;
        // No other names have these letters.
        let red_black = name.contains("RB");
        let order = if red_black { "RB" } else { "" };
        let two_steps = *family == "TM";
        let (alpha_is_open, beta_is_open) =
            (!matches!(first, Pair::Fixed(_)), *first == Pair::Open);
        for (parameter, value, is_open, instead) in [
            ("alpha", given.alpha, alpha_is_open, format!("{family}{order}SOR")),
            ("beta", given.beta, beta_is_open, format!("{family}{order}AOR")),
            ("alpha2", given.alpha2, two_steps && alpha_is_open, format!("TM{order}SOR")),
            ("beta2", given.beta2, two_steps && beta_is_open, format!("TM{order}AOR")),
        ] {
            refuse(name, parameter, value.filter(|_| !is_open), instead)?;
        }
        let needed = |value: Option<f64>, parameter, advice| {
            value.ok_or_else(|| NameError::Missing { name: name.clone(), parameter, advice })
        };
        let first = match first {
            Pair::Fixed(first) => *first,
            Pair::Alpha => [needed(given.alpha, "alpha", ALPHA)?; 2],
            Pair::Open => [needed(given.alpha, "alpha", ALPHA)?, needed(given.beta, "beta", BETA)?],
        };
        let alpha2 = given.alpha2.unwrap_or(first[0]);
        let beta2 = if beta_is_open { given.beta2.unwrap_or(first[1]) } else { alpha2 };
        let like_first = if alpha_is_open { [alpha2, beta2] } else { first };
        Ok(Relaxed { family, first, second: second.unwrap_or(like_first), red_black })
    }
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
    fn on<'p, T: Scalar, A: Rows<T> + 'p, B: Rows<T> + 'p>(
        &self,
        problem: Hlcp<T, A, B>,
    ) -> Result<BoxedMethod<'p, T, A, B>, Error> {
        Ok(match self.steps(&problem)?[..] {
            [first, second] => Box::new(Tmms::new(problem, first, second)?),
            [first, ..] => Box::new(Mms::new(problem, first)?),
            [] => unreachable!("an iteration has one step or two"),
        })
    }

    /// The steps of one iteration.
    fn steps<T: Scalar, A: LinearOperator<T>, B: LinearOperator<T>>(
        &self,
        problem: &Hlcp<T, A, B>,
    ) -> Result<Vec<Aor<T>>, Error> {
        let aor = |[alpha, beta]: [f64; 2]| {
            let aor = Aor::new(T::of(alpha), T::of(beta))?;
            if self.red_black { aor.red_black(problem.grid()?[0]) } else { Ok(aor) }
        };
        let first = aor(self.first)?;
        Ok(match self.family {
            "M" => vec![first],
            "AM" => vec![first.accelerated()],
            _ => vec![first, aor(self.second)?.backward()],
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
    /// assert_eq!((names[0].as_str(), names.len()), ("MJ", 57));
    /// assert!(names.contains(&"AUTO".to_owned()));
    /// ```
    pub fn names() -> Vec<String> {
        let beyond = BEYOND.iter().map(|(name, _)| name.to_string());
        TABLE.iter().map(|entry| entry.name.clone()).chain(beyond).collect()
    }

    /// Looks up `name`, in any case, and joins it with the parameters it leaves open.
    ///
    /// # Errors
    ///
    /// [`NameError`], with the name or the parameter that is wrong.
    pub fn parse(name: &str, given: Parameters<'_>) -> Result<Self, NameError> {
        let name = name.to_ascii_uppercase();
        let beyond = BEYOND.iter().find(|(known, _)| *known == name);
        let kind = beyond.map(|(_, kind)| kind);
        if !matches!(kind, Some(Kind::Anderson { .. })) {
            refuse(&name, "window", given.window, "ANDERSON")?;
        }
        if !matches!(kind, Some(Kind::Anderson { .. } | Kind::Newton | Kind::AmgNewton)) {
            refuse(&name, "base", given.base, "ANDERSON, NEWTON or AMG")?;
        }
        let Some(&(name, mut kind)) = beyond else {
            let entry = Entry::of(&name).ok_or_else(|| Self::unknown(name))?;
            let kind = Kind::Relaxed(entry.with(&given)?);
            return Ok(Self { name: &entry.name, kind, base: None });
        };
        if let (Kind::Anderson { window }, Some(given)) = (&mut kind, given.window) {
            *window = given;
        }
        let base = match given.base.map(str::to_ascii_uppercase) {
            Some(base) => {
                let entry = Entry::of(&base).ok_or(NameError::Base { base })?;
                Some(entry.with(&given)?)
            }
            None => {
                refuse(name, "alpha", given.alpha, "MSOR, AMSOR or TMSOR")?;
                refuse(name, "beta", given.beta, "MAOR, AMAOR or TMAOR")?;
                refuse(name, "alpha2", given.alpha2, "TMSOR")?;
                refuse(name, "beta2", given.beta2, "TMAOR")?;
                None
            }
        };
        Ok(Self { name, kind, base })
    }

    /// The error for `name`, with a suggestion if at most a third of its letters differ.
    fn unknown(name: String) -> NameError {
        if let Some(family @ ("M" | "AM" | "TM")) = name.strip_suffix("MS") {
            return NameError::Family { family: family.into() };
        }
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
        let relaxed = self.relaxed().filter(|relaxed| relaxed.family == "TM");
        relaxed.map(|relaxed| relaxed.second)
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
    /// use hlcp_methods::{Aor, FivePoint, Hlcp, Named, Omega, Parameters};
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
        match &self.kind {
            Kind::Relaxed(relaxed) => Some(relaxed),
            _ => None,
        }
    }

    /// The method on `problem`; `AUTO` clones the operators, so give large ones by reference, and
    /// those behind `dyn` by `Arc` or to [`on_dyn`](Self::on_dyn).
    ///
    /// # Errors
    ///
    /// [`Error`] for parameters out of range, [`Error::NotFivePoint`] for a red–black order or
    /// multigrid without a grid, and for what the methods refuse of the problem.
    ///
    /// ```
    /// use hlcp_methods::{FivePoint, Hlcp, Named, Omega, Parameters};
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
        A: Rows<T> + Clone + 'p, // not `Box<dyn Rows<T>>`: take `Arc`, or `on_dyn`
        B: Rows<T> + Clone + 'p,
    {
        let base = |problem| -> Result<BoxedMethod<'p, T, A, B>, Error> {
            match &self.base {
                Some(base) => base.on(problem),
                None => Ok(Box::new(Tmms::mirrored(problem, Aor::gauss_seidel().accelerated())?)),
            }
        };
        Ok(match self.kind {
            Kind::Relaxed(relaxed) => relaxed.on(problem)?,
            Kind::Anderson { window } => Box::new(Anderson::new(base(problem)?, window)?),
            Kind::Newton if TridiagonalPart::is_all(&problem) => {
                Box::new(Newton::new(base(problem)?, TridiagonalPart::new()))
            }
            Kind::Newton => Box::new(Newton::new(base(problem)?, Ssor)),
            Kind::AmgNewton => Box::new(AmgNewton::new(base(problem)?)?),
            Kind::Pivoting => Box::new(Pivoting::new(problem)?),
            Kind::Multigrid(cycle) => Box::new(Multigrid::new(problem, cycle)?),
            Kind::FullMultigrid => {
                let cycle = if TridiagonalPart::is_all(&problem) { Cycle::F } else { Cycle::W };
                Box::new(FullMultigrid::new(Multigrid::new(problem, cycle)?))
            }
            Kind::Adaptive => Box::new(AdaptiveSor::new(problem)?),
            Kind::Auto => {
                // It refuses rows by the numbers that they have here.
                let auto = Auto::new(problem)?;
                match cuthill_mckee(auto.problem()) {
                    Some(order) => {
                        Box::new(Renumbered::new(auto.problem().clone(), order, Auto::new)?)
                    }
                    None => Box::new(auto),
                }
            }
        })
    }

    /// The method on a problem with operators behind `dyn`, as [`on`](Self::on) makes it.
    ///
    /// The code is compiled once, for both precisions: a program that calls this compiles no
    /// method. In return a row of an operator that is neither a grid nor a matrix takes a call
    /// through `dyn`.
    ///
    /// # Errors
    ///
    /// Those of [`on`](Self::on).
    ///
    /// ```
    /// use hlcp_methods::{FivePoint, Hlcp, Named, Rows};
    ///
    /// let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
    /// let a: &dyn Rows<f64> = &a;
    /// let method = "AMGS".parse::<Named>()?.on_dyn(Hlcp::from_pair(a, a)?)?;
    /// assert!(!method.has_memory());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn on_dyn<'p, T: Scalar>(
        &self,
        problem: Hlcp<T, DynRows<'p, T>, DynRows<'p, T>>,
    ) -> Result<BoxedMethod<'p, T, DynRows<'p, T>, DynRows<'p, T>>, Error> {
        ON.of::<On<T>>()(self, problem)
    }
}

type On<T> = for<'p> fn(&Named, Hlcp<T, DynRows<'p, T>, DynRows<'p, T>>) -> Made<'p, T>;
type Made<'p, T> = Result<BoxedMethod<'p, T, DynRows<'p, T>, DynRows<'p, T>>, Error>;

/// Compiled once for all programs: the methods are most of what they would compile.
static ON: Compiled<On<f32>, On<f64>> =
    Compiled(|named, problem| named.on(problem), |named, problem| named.on(problem));

/// The name alone, in capitals.
impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name)
    }
}

impl FromStr for Named {
    type Err = NameError;

    /// Looks up a name that leaves no parameters open.
    fn from_str(name: &str) -> Result<Self, NameError> {
        Self::parse(name, Parameters::default())
    }
}
