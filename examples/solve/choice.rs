//! The method that was asked for.

use std::error::Error;

use hlcp_core::{Hlcp, Rows, Scalar};
use hlcp_methods::{Method, Named, Parameters};
use hlcp_verify::AorStep;

/// A method under the name it was asked for by.
pub(crate) struct Choice {
    pub(crate) name: String,
    pub(crate) named: Named,
}

/// Any method on a problem with operators `A` and `B`.
pub(crate) type Boxed<'p, T, A, B> = Box<dyn Method<T, A = A, B = B> + 'p>;

impl Choice {
    pub(crate) fn parse(name: &str, parameters: Parameters) -> Result<Self, Box<dyn Error>> {
        Ok(Self { name: name.to_ascii_uppercase(), named: Named::parse(name, parameters)? })
    }

    /// The method on `problem`.
    pub(crate) fn on<'p, T, A, B>(
        &self,
        problem: Hlcp<T, A, B>,
    ) -> Result<Boxed<'p, T, A, B>, Box<dyn Error>>
    where
        T: Scalar,
        A: Rows<T> + 'p,
        B: Rows<T> + 'p,
    {
        Ok(self.named.on(problem)?)
    }

    /// The steps of one iteration, as the theorems take them.
    pub(crate) fn steps(&self) -> Vec<AorStep> {
        let [alpha, beta] = self.named.first();
        let first = AorStep::new(alpha, beta);
        if self.named.is_accelerated() {
            return vec![first.accelerated()];
        }
        let second = self.named.second().map(|[alpha, beta]| AorStep::new(alpha, beta).backward());
        std::iter::once(first).chain(second).collect()
    }
}
