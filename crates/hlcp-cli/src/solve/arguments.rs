//! The command line, and what it can be refused for before anything is read or solved.

use std::{path::PathBuf, time::Duration};

use clap::{
    Args, ValueEnum,
    builder::{PossibleValuesParser, TypedValueParser},
};
use hlcp::files;
use hlcp_methods::{Limits, Norm, Parameters, Tolerance};

use crate::scenes::{Files, Given};

const EXAMPLES: &str = "\
Examples:
  hlcp solve --scene disc-lcp --m 1023 --method FMG,AMG,AUTO
  hlcp solve --a A.mtx --b B.mtx --q q.mtx --method AUTO --out-z z.mtx --out-r r.mtx

Matrix Market files come from SciPy
  from scipy.io import mmwrite
  mmwrite('A.mtx', A); mmwrite('B.mtx', B); mmwrite('q.mtx', q.reshape(-1, 1))
and from MATLAB or Octave, for a sparse matrix A and a column q,
  [i, j, v] = find(A); f = fopen('A.mtx', 'w');
  fprintf(f, '%%%%MatrixMarket matrix coordinate real general\\n%d %d %d\\n', size(A), nnz(A));
  fprintf(f, '%d %d %.17g\\n', [i, j, v]'); fclose(f);
  f = fopen('q.txt', 'w'); fprintf(f, '%.17g\\n', q); fclose(f);

The exit status is 0 if every solve converged, 2 if one did not, and 1 for bad input.";

/// Solve a scene, or a problem from Matrix Market files, by any method
///
/// Without arguments: Example 1 (μ = ν = 4) on a 512 × 512 grid by MGS, AMGS and TMGS in both
/// precisions. Scenes are matrix-free. Without --b a problem from files is the linear
/// complementarity problem, B = I.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    // First: it looks at `--a` before that is taken. Where an option conflicts with one that is
    // given, clap drops what others require of it: each says its conflicts.
    #[command(flatten)]
    pub(crate) given: Given,
    #[command(flatten)]
    pub(crate) files: Files,
    /// The start x⁰ [default: all ones; of files 0 for what is not in the paper]
    #[arg(long, help_heading = FILES)]
    pub(crate) x0: Option<PathBuf>,
    /// Start from this z and --r0, which an earlier solve has written
    #[arg(long, help_heading = FILES, requires = "r0", conflicts_with = "x0")]
    pub(crate) z0: Option<PathBuf>,
    /// Start from this r and --z0
    #[arg(long, help_heading = FILES, requires = "z0", conflicts_with = "x0")]
    pub(crate) r0: Option<PathBuf>,
    /// MJ MGS MSOR MAOR, AMJ … AMAOR, TMJ … TMAOR, or of the paper's Table 1 MSOR1–3 MAOR1–3, AM…
    /// and TM… alike, TMJSOR1–4 TMGSJ TMGSSOR1–3; MRBGS … TMRBAOR in red–black order; MGV MGW MGF
    /// FMG, multigrid; NEWTON; AMG, Newton with algebraic multigrid; PIVOTING, Newton by
    /// elimination; ANDERSON; ADAPTIVE, SOR that finds α; AUTO, which chooses. Several with commas
    /// between them are compared
    #[arg(long, help_heading = METHOD, value_delimiter = ',')]
    pub(crate) method: Vec<String>,
    /// The method that ANDERSON accelerates, and NEWTON and AMG fall back on [default: AMGS,
    /// forward and then backward]
    #[arg(long, help_heading = METHOD, requires = "method")]
    pub(crate) base: Option<String>,
    /// How many earlier iterates ANDERSON mixes [default: 10]
    #[arg(long, help_heading = METHOD, requires = "method")]
    pub(crate) window: Option<u16>,
    /// Relaxation α, of the first step where there are two
    #[arg(long, help_heading = METHOD, allow_hyphen_values = true)]
    pub(crate) alpha: Option<f64>,
    /// Acceleration β, of the first step where there are two
    #[arg(long, help_heading = METHOD, allow_hyphen_values = true)]
    pub(crate) beta: Option<f64>,
    /// α of the second step
    #[arg(long, help_heading = METHOD, allow_hyphen_values = true)]
    pub(crate) alpha2: Option<f64>,
    /// β of the second step
    #[arg(long, help_heading = METHOD, allow_hyphen_values = true)]
    pub(crate) beta2: Option<f64>,
    /// The factor τ of Ω = τ D_A D_B⁻¹, which scales r in the modulus variable
    #[arg(long, help_heading = METHOD, default_value_t = 1.0, allow_hyphen_values = true)]
    pub(crate) tau: f64,
    /// All entries of Ω, in the place of τ D_A D_B⁻¹; 1 will do for PIVOTING and AUTO where the
    /// diagonal of B is negative
    #[arg(long, help_heading = METHOD, conflicts_with = "tau", allow_hyphen_values = true)]
    pub(crate) omega: Option<f64>,
    /// The scale γ of the modulus variable
    #[arg(long, help_heading = METHOD, default_value_t = 1.0, allow_hyphen_values = true)]
    pub(crate) gamma: f64,
    /// The precision [default: f64 with --method, both without]
    #[arg(long, help_heading = METHOD, value_enum)]
    precision: Option<Precision>,
    /// How many threads share the sweeps
    #[arg(long, help_heading = METHOD, default_value_t = 1, allow_hyphen_values = true)]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: u16,
    /// Absolute tolerance for ‖A z − B r + q‖, in the units of q [default: of scenes 1e-10; of
    /// slider, film and files there is none, see --rtol; in f32 as well what rounding allows]
    #[arg(long, help_heading = STOPPING, allow_hyphen_values = true, conflicts_with = "rtol")]
    pub(crate) tol: Option<f64>,
    /// Tolerance for ‖A z − B r + q‖ relative to ‖q‖ [default: 1e-10 for slider, film and files]
    #[arg(long, help_heading = STOPPING, allow_hyphen_values = true)]
    pub(crate) rtol: Option<f64>,
    /// The norm of the stopping test
    #[arg(long, help_heading = STOPPING, default_value = "l2")]
    #[arg(value_parser = PossibleValuesParser::new(["l2", "linf"]).map(norm))]
    pub(crate) norm: Norm,
    /// The largest number of iterations
    #[arg(long, help_heading = STOPPING, default_value_t = 30_000, allow_hyphen_values = true)]
    pub(crate) max_iterations: usize,
    /// The longest time of one solve with its certificate, in seconds; to read or pose the problem
    /// comes before
    #[arg(long, help_heading = STOPPING, allow_hyphen_values = true)]
    pub(crate) max_seconds: Option<f64>,
    /// Write z to this file, also of a solve that did not converge; needs --method. A regular file
    /// that exists is replaced; refused are a symbolic link, a device and the like, and the files
    /// of --a, --b, --q, --x0, --z0 and --r0
    #[arg(long, help_heading = OUTPUT, requires = "method")]
    pub(crate) out_z: Option<PathBuf>,
    /// Write r to this file, as --out-z does
    #[arg(long, help_heading = OUTPUT, requires = "method")]
    pub(crate) out_r: Option<PathBuf>,
    /// Solve this often and report the median of the times
    #[arg(long, help_heading = OUTPUT, default_value_t = 1, allow_hyphen_values = true)]
    #[arg(value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) repeats: u16,
    /// Print a JSON object for each method instead of a table; needs --method
    #[arg(long, help_heading = OUTPUT, requires = "method")]
    pub(crate) json: bool,
    /// Prove what can be proved: convergence, uniqueness, and a bound on the error
    #[arg(long, help_heading = OUTPUT)]
    pub(crate) certify: bool,
}

const FILES: &str = "Files";
const METHOD: &str = "Method";
const STOPPING: &str = "Stopping";
const OUTPUT: &str = "Output";

fn norm(name: String) -> Norm {
    if name == "linf" { Norm::LInf } else { Norm::L2 }
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Precision {
    F64,
    F32,
}

impl Precision {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
        }
    }
}

impl Arguments {
    /// Refuses what contradicts itself, and outputs that cannot be written.
    pub(crate) fn check(&self) -> Result<(), String> {
        if self.method.len() > 1 && (self.out_z.is_some() || self.out_r.is_some()) {
            return Err(
                "--out-z and --out-r take the answer of one method; name one by --method".into()
            );
        }
        if self.method.is_empty() && self.parameters() != Parameters::default() {
            return Err("--alpha, --beta, --alpha2 and --beta2 need --method".into());
        }
        let is_full = |name: &&String| name.trim().eq_ignore_ascii_case("FMG");
        let start = [("--x0", &self.x0), ("--z0 and --r0", &self.z0)];
        if let (Some(name), Some((option, _))) =
            (self.method.iter().find(is_full), start.iter().find(|(_, given)| given.is_some()))
        {
            return Err(format!(
                "{name} begins on the coarsest grid and takes no {option}; take MGF, or leave the \
                 start out"
            ));
        }
        if let (Some(z), Some(r)) = (&self.out_z, &self.out_r)
            && files::same_file(z, r)
        {
            return Err("--out-z and --out-r name the same file".into());
        }
        let inputs = [
            ("--a", &self.files.a),
            ("--b", &self.files.b),
            ("--q", &self.files.q),
            ("--x0", &self.x0),
            ("--z0", &self.z0),
            ("--r0", &self.r0),
        ];
        for (out, path) in [("--out-z", &self.out_z), ("--out-r", &self.out_r)] {
            let Some(path) = path else { continue };
            let read = |(_, input): &&(_, &Option<PathBuf>)| {
                input.as_ref().is_some_and(|input| files::same_file(path, input))
            };
            if let Some((input, _)) = inputs.iter().find(read) {
                let path = files::printable(path.display());
                return Err(format!(
                    "{out} {path} would overwrite the file of {input}; give another name"
                ));
            }
            files::check_output(path).map_err(|error| error.to_string())?;
        }
        if self.precisions().contains(&Precision::F32) {
            let given = [
                ("tau", Some(self.tau)),
                ("omega", self.omega),
                ("gamma", Some(self.gamma)),
                ("tol", self.tol),
                ("rtol", self.rtol),
            ];
            for (name, value) in given {
                if let Some(value) = value.filter(|v| v.is_finite() && !(*v as f32).is_finite()) {
                    return Err(format!(
                        "--{name} {value:e} does not fit f32; use --precision f64"
                    ));
                }
            }
        }
        Ok(())
    }

    pub(crate) fn parameters(&self) -> Parameters<'_> {
        let Self { alpha, beta, alpha2, beta2, .. } = *self;
        let (base, window) = (self.base.as_deref(), self.window.map(usize::from));
        Parameters { alpha, beta, alpha2, beta2, base, window }
    }

    pub(crate) fn limits(&self) -> Result<Limits, String> {
        let (tolerance, rounding) = match (self.tol, self.rtol) {
            (Some(tolerance), _) => (Tolerance::Absolute(tolerance), Some(0.0)),
            (None, Some(tolerance)) => (Tolerance::Relative(tolerance), Some(0.0)),
            (None, None) if self.files.a.is_some() => (Tolerance::Relative(1e-10), None),
            (None, None) => (self.given.scene.limits().tolerance, None),
        };
        // Thirty years are no limit, and more may be too much for a clock.
        let time = self.max_seconds.filter(|&time| time.is_nan() || time < 1e9);
        let time = time.map(Duration::try_from_secs_f64).transpose();
        let time = time.map_err(|_| "--max-seconds must be a number of seconds, 0 or more")?;
        Ok(Limits { tolerance, rounding, norm: self.norm, iterations: self.max_iterations, time })
    }

    pub(crate) fn precisions(&self) -> Vec<Precision> {
        match (self.precision, self.method.is_empty()) {
            (Some(precision), _) => vec![precision],
            (None, false) => vec![Precision::F64],
            (None, true) => vec![Precision::F64, Precision::F32],
        }
    }
}
