use hlcp_core::{Aor, Error, Hlcp, Rows, Scalar};

use crate::{Amms, Method, Mms, Tmms};

/// The three families of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Family {
    Mms,
    Amms,
    Tmms,
}

/// A method by its name in the paper, with its parameters.
///
/// Names are a family, `M`, `AM` or `TM`, and a splitting, `J`, `GS`, `SOR` or `AOR`; and those of
/// Table 1, where an index fixes the parameters. In a two-step method the first step runs forward and the
/// second backward, with (α₁, β₁) for the first step and (α₂, β₂) for the second; without a second pair
/// both have the first. `RB` before a splitting, as in `TMRBGS`, sorts the points of the problem's grid in red–black
/// order, [`Aor::red_black`]; the paper has no such names.
///
/// ```
/// use hlcp_methods::{Named, Parameters};
///
/// let table = Named::parse("TMGSSOR2", Parameters::default())?;
/// assert_eq!((table.first(), table.second()), ([1.0, 1.0], Some([1.1, 1.1])));
///
/// let typo = Named::parse("TMAR", Parameters::default()).unwrap_err();
/// assert_eq!(typo.to_string(), "there is no method 'TMAR'; the closest name is 'TMAOR'");
/// # Ok::<(), hlcp_methods::NameError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Named {
    family: Family,
    first: [f64; 2],
    second: [f64; 2],
    red_black: bool,
}

/// The relaxation parameters that accompany a name; those the name fixes are to be left out.
///
/// ```
/// use hlcp_methods::{Named, Parameters};
///
/// let given = Parameters { alpha: Some(1.2), alpha2: Some(0.9), ..Parameters::default() };
/// let tmsor = Named::parse("TMSOR", given)?; // β = α, which SOR fixes
/// assert_eq!((tmsor.first(), tmsor.second()), ([1.2, 1.2], Some([0.9, 0.9])));
/// # Ok::<(), hlcp_methods::NameError>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Parameters {
    /// α, of the first step where there are two.
    pub alpha: Option<f64>,
    /// β, of the first step where there are two.
    pub beta: Option<f64>,
    /// α of the second step.
    pub alpha2: Option<f64>,
    /// β of the second step.
    pub beta2: Option<f64>,
}

/// A name, or parameters for it, that make no method.
///
/// ```
/// use hlcp_methods::{Named, Parameters};
///
/// let alpha = Parameters { alpha: Some(1.2), ..Parameters::default() };
/// let [aor, gs] = ["MAOR", "MGS"].map(|name| Named::parse(name, alpha).unwrap_err().to_string());
/// assert_eq!(aor, "MAOR needs beta");
/// assert_eq!(gs, "MGS takes no alpha (given: 1.2)");
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NameError {
    /// There is no such name.
    #[error("there is no method '{name}'; the closest name is '{closest}'")]
    Unknown {
        /// The name as given.
        name: String,
        /// The name it resembles most.
        closest: String,
    },
    /// A parameter is missing.
    #[error("{name} needs {parameter}")]
    Missing {
        /// The method.
        name: String,
        /// The parameter.
        parameter: &'static str,
    },
    /// A parameter is given that the name fixes, or that the method has no use for.
    #[error("{name} takes no {parameter} (given: {value})")]
    Fixed {
        /// The method.
        name: String,
        /// The parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
}

/// What a splitting's name leaves open.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Open {
    /// Both parameters are fixed.
    Nothing([f64; 2]),
    /// α, with β = α.
    Alpha,
    /// α and β.
    Both,
}

/// What a method's name stands for; a second step that is `None` takes after the first.
type Entry = (String, Family, Open, Option<[f64; 2]>);

/// Every name, with the parameters of Table 1.
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

impl Named {
    /// Looks up `name`, in any case, and joins it with the parameters it leaves open.
    ///
    /// # Errors
    ///
    /// [`NameError`], with the name or the parameter that is wrong.
    pub fn parse(name: &str, given: Parameters) -> Result<Self, NameError> {
        let name = name.to_ascii_uppercase();
        let table = table();
        let Some((_, family, open, fixed_second)) = table.iter().find(|(known, ..)| *known == name)
        else {
            let distance = |(known, ..): &&Entry| strsim::damerau_levenshtein(known, &name);
            let closest = table.iter().min_by_key(distance).map(|(known, ..)| known.clone());
            return Err(NameError::Unknown { name, closest: closest.unwrap_or_default() });
        };
        let missing = |parameter| NameError::Missing { name: name.clone(), parameter };
        let refuse = |parameter, value: Option<f64>| match value {
            Some(value) => Err(NameError::Fixed { name: name.clone(), parameter, value }),
            None => Ok(()),
        };
        let first = match *open {
            Open::Nothing(first) => {
                refuse("alpha", given.alpha)?;
                refuse("beta", given.beta)?;
                first
            }
            Open::Alpha => {
                refuse("beta", given.beta)?;
                [given.alpha.ok_or_else(|| missing("alpha"))?; 2]
            }
            Open::Both => {
                let alpha = given.alpha.ok_or_else(|| missing("alpha"))?;
                [alpha, given.beta.ok_or_else(|| missing("beta"))?]
            }
        };
        let one_step = *family != Family::Tmms;
        if one_step || *open != Open::Alpha && *open != Open::Both {
            refuse("alpha2", given.alpha2)?;
        }
        if one_step || *open != Open::Both {
            refuse("beta2", given.beta2)?;
        }
        let alpha2 = given.alpha2.unwrap_or(first[0]);
        let second = match (*open, *fixed_second) {
            (_, Some(second)) => second,
            (Open::Alpha, None) => [alpha2; 2],
            _ => [alpha2, given.beta2.unwrap_or(first[1])],
        };
        // No other names have these letters.
        Ok(Self { family: *family, first, second, red_black: name.contains("RB") })
    }

    /// (α, β), of the first step where there are two.
    pub fn first(&self) -> [f64; 2] {
        self.first
    }

    /// (α, β) of the second step, where there are two.
    pub fn second(&self) -> Option<[f64; 2]> {
        (self.family == Family::Tmms).then_some(self.second)
    }

    /// Whether the points are in red–black order.
    pub fn is_red_black(&self) -> bool {
        self.red_black
    }

    /// Whether the method is an AMMS.
    pub fn is_accelerated(&self) -> bool {
        self.family == Family::Amms
    }

    /// The method on `problem`.
    ///
    /// # Errors
    ///
    /// [`Error`] for parameters out of range, [`Error::NotFivePoint`] for a red–black order without a grid, and for what the splittings refuse of the problem.
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
    pub fn on<'p, T, A, B>(
        &self,
        problem: Hlcp<T, A, B>,
    ) -> Result<Box<dyn Method<T, A = A, B = B> + 'p>, Error>
    where
        T: Scalar,
        A: Rows<T> + 'p,
        B: Rows<T> + 'p,
    {
        let aor = |[alpha, beta]: [f64; 2]| {
            let to = |v| T::from(v).unwrap_or_else(T::nan);
            let aor = Aor::new(to(alpha), to(beta))?;
            if self.red_black { aor.red_black(problem.grid()?[0]) } else { Ok(aor) }
        };
        let (first, second) = (aor(self.first)?, aor(self.second)?);
        Ok(match self.family {
            Family::Mms => Box::new(Mms::new(problem, first)?),
            Family::Amms => Box::new(Amms::new(problem, first)?),
            Family::Tmms => Box::new(Tmms::new(problem, first, second.backward())?),
        })
    }
}
