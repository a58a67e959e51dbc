//! The method that was asked for.

use std::error::Error;

use hlcp_core::{Aor, Hlcp, LinearOperator, Rows, Scalar};
use hlcp_methods::{
    Anderson, Auto, Cycle, FullMultigrid, Method, Multigrid, Named, Newton, Parameters, Ssor,
    TridiagonalPart,
};

use crate::arguments::Arguments;

/// A method under the name it was asked for by.
pub(crate) struct Choice {
    pub(crate) name: String,
    kind: Kind,
}

enum Kind {
    Paper(Named),
    Anderson { base: Named, window: usize },
    Newton { base: Named },
    Multigrid(Cycle),
    FullMultigrid,
    Auto,
}

/// Any method on a problem with operators `A` and `B`.
pub(crate) type Boxed<'p, T, A, B> = Box<dyn Method<T, A = A, B = B> + 'p>;

impl Choice {
    pub(crate) fn parse(name: &str, arguments: &Arguments) -> Result<Self, Box<dyn Error>> {
        let name = name.to_ascii_uppercase();
        let Arguments { base, window, .. } = arguments;
        let parse = |name: &str, parameters| Named::parse(name, parameters);
        let parameters = arguments.parameters();
        let of_base = || parse(base.as_deref().unwrap_or("TMGS"), parameters);
        let kind = match name.as_str() {
            "ANDERSON" => Kind::Anderson { base: of_base()?, window: window.unwrap_or(10).into() },
            _ if window.is_some() => return Err("--window is ANDERSON's".into()),
            "NEWTON" => Kind::Newton { base: of_base()? },
            _ if base.is_some() => return Err("--base is ANDERSON's and NEWTON's".into()),
            "MGW" => Kind::Multigrid(Cycle::W),
            "MGF" => Kind::Multigrid(Cycle::F),
            "FMG" => Kind::FullMultigrid,
            "AUTO" => Kind::Auto,
            _ => Kind::Paper(parse(&name, parameters)?),
        };
        let relaxed = matches!(kind, Kind::Paper(_) | Kind::Anderson { .. } | Kind::Newton { .. });
        if !relaxed && parameters != Parameters::default() {
            return Err(format!("{name} takes no alpha and no beta").into());
        }
        Ok(Self { name, kind })
    }

    /// The method on `problem`.
    pub(crate) fn on<'p, T, A, B>(
        &self,
        problem: Hlcp<T, A, B>,
    ) -> Result<Boxed<'p, T, A, B>, Box<dyn Error>>
    where
        T: Scalar,
        A: Rows<T> + Clone + 'p,
        B: Rows<T> + Clone + 'p,
    {
        Ok(match &self.kind {
            Kind::Paper(named) => named.on(problem)?,
            Kind::Anderson { base, window } => Box::new(Anderson::new(base.on(problem)?, *window)?),
            Kind::Newton { base } => {
                if TridiagonalPart::is_all(&problem) {
                    Box::new(Newton::new(base.on(problem)?, TridiagonalPart::new()))
                } else {
                    Box::new(Newton::new(base.on(problem)?, Ssor))
                }
            }
            Kind::Multigrid(cycle) => Box::new(Multigrid::new(problem, *cycle)?),
            Kind::FullMultigrid => Box::new(FullMultigrid::new(Multigrid::new(problem, Cycle::F)?)),
            Kind::Auto => Box::new(Auto::new(problem)?),
        })
    }

    /// α and β of the (first) step, of a method that has them.
    pub(crate) fn relaxation(&self) -> [Option<f64>; 2] {
        match &self.kind {
            Kind::Paper(named) => named.first().map(Some),
            _ => [None; 2],
        }
    }

    /// The steps of one iteration, as the theorems take them, of a method that has such steps.
    pub(crate) fn steps<T, A, B>(
        &self,
        problem: &Hlcp<T, A, B>,
    ) -> Result<Option<Vec<Aor<T>>>, hlcp_core::Error>
    where
        T: Scalar,
        A: LinearOperator<T>,
        B: LinearOperator<T>,
    {
        let Kind::Paper(named) = &self.kind else { return Ok(None) };
        named.steps(problem).map(Some)
    }
}
