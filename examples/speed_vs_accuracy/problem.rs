//! The problems of the charts, matrix-free and in both precisions, with their solutions.

use std::error::Error;

use hlcp_core::{Aor, Hlcp, LinearOperator, Omega, Rows, Scalar};
use hlcp_methods::{Limits, Mms, Options, Solver};
use hlcp_verify::{Disc, Example, Slider, certify};

/// What to pose.
#[derive(Clone, Copy)]
pub(crate) enum Scene {
    /// Example 1 or 2, with its solution of zeros and ones, or a generic one of the same alternating pattern.
    Paper { example: Example, generic: bool },
    /// Example 3 in kind.
    Slider(Slider),
    /// A contact in a disc.
    Disc(Disc),
}

/// Operators and `q` in one precision.
pub(crate) struct Posed<T> {
    pub(crate) a: Box<dyn Rows<T>>,
    pub(crate) b: Box<dyn Rows<T>>,
    pub(crate) q: Vec<T>,
}

/// `z` and `r`.
type Solution = [Vec<f64>; 2];

/// A problem with its solution.
pub(crate) struct Problem {
    pub(crate) scene: Scene,
    pub(crate) wide: Posed<f64>,
    pub(crate) narrow: Posed<f32>,
    pub(crate) truth: Solution,
    /// A proved bound on the error of `truth`: it is planted, but `q` is rounded.
    pub(crate) doubt: f64,
}

impl Problem {
    /// The largest error of a component of `(z, r)`.
    pub(crate) fn error<T: Scalar>(&self, z: &[T], r: &[T]) -> f64 {
        let [z_true, r_true] = &self.truth;
        let errors = |v: &[T], truth: &[f64]| {
            let differences = v.iter().zip(truth).map(|(&v, t)| (wide(v) - t).abs());
            differences.fold(0.0, |max: f64, e| if e > max || e.is_nan() { e } else { max })
        };
        errors(z, z_true).max(errors(r, r_true))
    }
}

fn wide<T: Scalar>(v: T) -> f64 {
    v.to_f64().unwrap_or(f64::NAN)
}

impl Scene {
    /// A name with the scene's parameters.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Paper { example: Example { symmetric, m, mu, nu }, generic } => {
                let number = if symmetric { 1 } else { 2 };
                let solution = if generic { "generic" } else { "0/1" };
                format!("Example {number} ({mu}, {nu}), m = {m}, {solution}")
            }
            Self::Slider(Slider { cells }) => format!("slider, N = {cells}"),
            Self::Disc(Disc { lcp, m }) => {
                format!("disc-{}, m = {m}", if lcp { "lcp" } else { "hlcp" })
            }
        }
    }

    /// The problem in both precisions.
    pub(crate) fn pose(self) -> Result<Problem, Box<dyn Error>> {
        let (wide, truth) = self.posed::<f64>()?;
        let (mut narrow, _) = self.posed::<f32>()?;
        narrow.q = wide.q.iter().map(|&q| q as f32).collect();
        let truth = match truth {
            Some(truth) => truth,
            None => to_the_floor(&wide)?,
        };
        let certificate = certify(&wide.a, &wide.b, &wide.q, &truth[0], &truth[1])?;
        let doubt = certificate.ok_or("no certificate of the solution")?.error();
        Ok(Problem { scene: self, wide, narrow, truth, doubt })
    }

    /// The problem in one precision, with its solution where one is planted.
    fn posed<T: Scalar>(self) -> Result<(Posed<T>, Option<Solution>), Box<dyn Error>> {
        let widened = |v: &[T]| v.iter().map(|&v| wide(v)).collect::<Vec<_>>();
        let (mut posed, generic) = match self {
            Self::Paper { example, generic } => (example.pose::<T>()?, generic),
            Self::Disc(disc) => (disc.pose::<T>()?, false),
            Self::Slider(slider) => {
                let (a, b, q) = slider.pose::<T>()?;
                return Ok((Posed { a: Box::new(a), b: Box::new(b), q }, None));
            }
        };
        if generic {
            // Thirty bits below 2: q is exact in double precision, and the planted pair solves what is posed there.
            let mut az = vec![T::zero(); posed.q.len()];
            for k in 0..posed.q.len() {
                let size = (1 + k.wrapping_mul(0x9e37_79b9) % (1 << 30)) as f64 / (1 << 29) as f64;
                let size = T::from(size).unwrap_or_else(T::nan);
                posed.z[k] *= size;
                posed.r[k] *= size;
            }
            posed.a.apply(&posed.z, &mut az);
            posed.b.apply(&posed.r, &mut posed.q);
            posed.q.iter_mut().zip(az).for_each(|(q, az)| *q -= az);
        }
        let truth = [widened(&posed.z), widened(&posed.r)];
        Ok((Posed { a: Box::new(posed.a), b: Box::new(posed.b), q: posed.q }, Some(truth)))
    }
}

/// The solution of a problem that has none planted: MSOR until it rests.
fn to_the_floor(posed: &Posed<f64>) -> Result<Solution, Box<dyn Error>> {
    let Posed { a, b, q } = posed;
    let omega = Omega::diagonal_ratio(1.0, a, b)?;
    let mut solver = Solver::new(Mms::new(Hlcp::new(a, b, omega)?, Aor::sor(1.2)?)?);
    let limits = Limits { iterations: 1_000_000, ..Limits::absolute(0.0) };
    let _ = solver.solve(q, Options::from_x(&vec![1.0; q.len()]).limits(limits))?;
    Ok([solver.z().to_vec(), solver.r().to_vec()])
}
