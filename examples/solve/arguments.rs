//! The command line, and what it can be refused for before anything is read or solved.

use std::{error::Error, path::PathBuf};

use Scene::{
    AmericanPut, Bearing2d, DiscHlcp, DiscLcp, Example1, Example2, JournalBearing, Obstacle, Slider,
};
use clap::{
    CommandFactory, FromArgMatches, Parser, ValueEnum, error::ErrorKind, parser::ValueSource,
};
use hlcp_core::files;
use hlcp_methods::Parameters;

/// Solve a horizontal linear complementarity problem, A z − B r + q = 0 with z, r ≥ 0 and zᵀr = 0.
#[derive(Debug, Parser)]
#[command(name = "solve")]
pub(crate) struct Arguments {
    /// The problem
    #[arg(long, value_enum, default_value_t = Scene::Example1)]
    pub(crate) scene: Scene,
    /// Grid points per side, the order being m²; the slider's cells, the order being m − 1; the obstacle's nodes per side
    /// with the boundary's; the put's points to a standard deviation [default: 512, of the obstacle 65, of the put 64]
    #[arg(long, allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..=32768))]
    m: Option<u16>,
    /// Examples 1 and 2 with the planted 0, 1, 0, 1, … or with generic numbers in the same pattern
    #[arg(long, value_enum, default_value_t = Solution::Default)]
    pub(crate) solution: Solution,
    /// Inner grid points around a journal bearing [default: 50, of bearing2d 127]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=32768))]
    nx: Option<u16>,
    /// Inner grid points along a journal bearing [default: 50, of bearing2d 63]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=32768))]
    ny: Option<u16>,
    /// The eccentricity of a journal bearing [default: 0.1, of bearing2d 0.6]
    #[arg(long, allow_hyphen_values = true)]
    ecc: Option<f64>,
    /// Half the length of journal-bearing over its radius
    #[arg(long, default_value_t = 10.0, allow_hyphen_values = true)]
    pub(crate) b_length: f64,
    /// The length of bearing2d over its diameter
    #[arg(long, default_value_t = 1.0, allow_hyphen_values = true)]
    pub(crate) aspect: f64,
    /// Where bearing2d's feed groove is, in degrees from the widest gap
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub(crate) groove: f64,
    /// The put's interest rate, a year
    #[arg(long, default_value_t = 0.06, allow_hyphen_values = true)]
    pub(crate) rate: f64,
    /// The put's volatility, a square root of a year
    #[arg(long, default_value_t = 0.2, allow_hyphen_values = true)]
    pub(crate) volatility: f64,
    /// The put's time to maturity, in years
    #[arg(long, default_value_t = 1.0, allow_hyphen_values = true)]
    pub(crate) maturity: f64,
    /// The put's spot price over its strike
    #[arg(long, default_value_t = 0.9, allow_hyphen_values = true)]
    pub(crate) spot: f64,
    /// The put's time steps
    #[arg(long, default_value_t = 64, allow_hyphen_values = true)]
    pub(crate) steps: u16,
    /// The multiple of the identity in A of Examples 1 and 2 [default: 4]
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) mu: Option<f64>,
    /// The multiple of the identity in B of Examples 1 and 2 [default: 4]
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) nu: Option<f64>,
    /// A matrix A from a Matrix Market file, instead of a scene
    #[arg(long, requires = "q", conflicts_with = "scene")]
    pub(crate) a: Option<PathBuf>,
    /// The matrix B [default: the identity, which makes the problem an LCP]
    #[arg(long, requires = "a")]
    pub(crate) b: Option<PathBuf>,
    /// The vector q: a Matrix Market file, or one number a line
    #[arg(long, requires = "a")]
    pub(crate) q: Option<PathBuf>,
    /// The start x⁰ [default: all ones]
    #[arg(long)]
    pub(crate) x0: Option<PathBuf>,
    /// Write z to this file, also of a solve that did not converge; needs --method. A regular file
    /// that exists is replaced; refused are a symbolic link, a device and the like, and the files
    /// of --a, --b, --q and --x0
    #[arg(long, requires = "method")]
    pub(crate) out_z: Option<PathBuf>,
    /// Write r to this file, as --out-z does
    #[arg(long, requires = "method")]
    pub(crate) out_r: Option<PathBuf>,
    /// MJ MGS MSOR MAOR, AMJ … AMAOR, TMJ … TMAOR, or of the paper's Table 1 MSOR1–3 MAOR1–3, AM… and TM… alike,
    /// TMJSOR1–4 TMGSJ TMGSSOR1–3; MRBGS … TMRBAOR in red–black order; MGW MGF FMG, multigrid; NEWTON; ANDERSON;
    /// AUTO, which chooses
    #[arg(long)]
    pub(crate) method: Option<String>,
    /// The method that ANDERSON accelerates and NEWTON falls back on [default: TMGS]
    #[arg(long, requires = "method")]
    pub(crate) base: Option<String>,
    /// How many earlier iterates ANDERSON mixes [default: 10]
    #[arg(long, requires = "method")]
    pub(crate) window: Option<u16>,
    /// Relaxation α, of the first step where there are two
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) alpha: Option<f64>,
    /// Acceleration β, of the first step where there are two
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) beta: Option<f64>,
    /// α of the second step
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) alpha2: Option<f64>,
    /// β of the second step
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) beta2: Option<f64>,
    /// The factor τ of Ω = τ D_A D_B⁻¹, which scales r in the modulus variable
    #[arg(long, default_value_t = 1.0, allow_hyphen_values = true)]
    pub(crate) tau: f64,
    /// The scale γ of the modulus variable
    #[arg(long, default_value_t = 1.0, allow_hyphen_values = true)]
    pub(crate) gamma: f64,
    /// Absolute tolerance for ‖A z − B r + q‖, in the units of q [default: of scenes 1e-10; of the slider
    /// and of files there is none, see --rtol; in f32 as well what rounding allows]
    #[arg(long, allow_hyphen_values = true, conflicts_with = "rtol")]
    pub(crate) tol: Option<f64>,
    /// Tolerance for ‖A z − B r + q‖ relative to ‖q‖ [default: 1e-10 for the slider and for files]
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) rtol: Option<f64>,
    /// The longest time of one solve, in seconds
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) max_seconds: Option<f64>,
    /// The largest number of iterations
    #[arg(long, default_value_t = 30_000, allow_hyphen_values = true)]
    pub(crate) max_iterations: usize,
    /// The norm of the stopping test
    #[arg(long, value_enum, default_value_t = NormName::L2)]
    pub(crate) norm: NormName,
    /// The precision [default: f64 with --method, both without]
    #[arg(long, value_enum)]
    precision: Option<Precision>,
    /// Solve this often and report the median of the times
    #[arg(long, default_value_t = 1, allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) repeats: u16,
    /// How many threads share the sweeps
    #[arg(long, default_value_t = 1, allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: u16,
    /// Print one JSON object instead of a table; needs --method
    #[arg(long, requires = "method")]
    pub(crate) json: bool,
    /// Prove what can be proved: convergence, uniqueness, and a bound on the error
    #[arg(long)]
    pub(crate) certify: bool,
}

/// μ and ν where none are given.
pub(crate) const SHIFT: f64 = 4.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Scene {
    /// The paper's Example 1
    Example1,
    /// The paper's Example 2
    Example2,
    /// A slider with cavitation in the place of the paper's Example 3
    Slider,
    /// A contact in a disc, as a linear complementarity problem
    DiscLcp,
    /// A contact in a disc with a second operator on r
    DiscHlcp,
    /// The pressure in a journal bearing, cut off at zero
    JournalBearing,
    /// A membrane over a dome
    Obstacle,
    /// A journal bearing with mass-conserving cavitation
    Bearing2d,
    /// An American put, one problem a time step
    AmericanPut,
}

impl Scene {
    pub(crate) fn name(self) -> String {
        self.to_possible_value().expect("every scene can be asked for").get_name().to_owned()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Solution {
    Default,
    Generic,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum NormName {
    L2,
    Linf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
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

/// The options that define a scene, and the scenes that they define.
const NUMBERS: [(&[&str], &[Scene]); 6] = [
    (&["m"], &[Example1, Example2, Slider, DiscLcp, DiscHlcp, Obstacle, AmericanPut]),
    (&["mu", "nu", "solution"], &[Example1, Example2]),
    (&["nx", "ny", "ecc"], &[JournalBearing, Bearing2d]),
    (&["b_length"], &[JournalBearing]),
    (&["aspect", "groove"], &[Bearing2d]),
    (&["rate", "volatility", "maturity", "spot", "steps"], &[AmericanPut]),
];

impl Arguments {
    /// The command line, if each option that it gives has a use.
    pub(crate) fn given() -> Result<Self, clap::Error> {
        let matches = Self::command().try_get_matches()?;
        let arguments = Self::from_arg_matches(&matches)?;
        for (options, scenes) in NUMBERS {
            let scene = arguments.a.is_none().then_some(arguments.scene);
            if scene.is_some_and(|scene| scenes.contains(&scene)) {
                continue;
            }
            let given =
                |option: &&&str| matches.value_source(option) == Some(ValueSource::CommandLine);
            if let Some(option) = options.iter().find(given) {
                let of = scenes.iter().map(|scene| scene.name()).collect::<Vec<_>>().join(", ");
                let not = scene.map_or("of files".into(), |scene| format!("of {}", scene.name()));
                let message =
                    format!("--{} is an option of {of}, not {not}", option.replace('_', "-"));
                return Err(Self::command().error(ErrorKind::ArgumentConflict, message));
            }
        }
        Ok(arguments)
    }

    /// Refuses what contradicts itself, and outputs that cannot be written.
    pub(crate) fn check(&self) -> Result<(), Box<dyn Error>> {
        if self.method.is_none() && self.parameters() != Parameters::default() {
            return Err("--alpha, --beta, --alpha2 and --beta2 need --method".into());
        }
        if let (Some(z), Some(r)) = (&self.out_z, &self.out_r)
            && files::same_file(z, r)
        {
            return Err("--out-z and --out-r name the same file".into());
        }
        let inputs = [("--a", &self.a), ("--b", &self.b), ("--q", &self.q), ("--x0", &self.x0)];
        for (out, path) in [("--out-z", &self.out_z), ("--out-r", &self.out_r)] {
            let Some(path) = path else { continue };
            let read = |(_, input): &&(_, &Option<PathBuf>)| {
                input.as_ref().is_some_and(|input| files::same_file(path, input))
            };
            if let Some((input, _)) = inputs.iter().find(read) {
                let path = files::printable(path.display());
                return Err(format!(
                    "{out} {path} would overwrite the file of {input}; give another name"
                )
                .into());
            }
            files::check_output(path)?;
        }
        if self.precisions().contains(&Precision::F32) {
            let given = [
                ("tau", Some(self.tau)),
                ("gamma", Some(self.gamma)),
                ("tol", self.tol),
                ("rtol", self.rtol),
            ];
            for (name, value) in given {
                if let Some(value) = value.filter(|v| v.is_finite() && !(*v as f32).is_finite()) {
                    return Err(format!(
                        "--{name} {value:e} does not fit f32; use --precision f64"
                    )
                    .into());
                }
            }
        }
        Ok(())
    }

    /// The relaxation parameters, as far as they are given.
    pub(crate) fn parameters(&self) -> Parameters {
        let Self { alpha, beta, alpha2, beta2, .. } = *self;
        Parameters { alpha, beta, alpha2, beta2 }
    }

    /// m, or what the scene has in its place.
    pub(crate) fn m(&self) -> usize {
        let default = match self.scene {
            Scene::Obstacle => 65,
            Scene::AmericanPut => 64,
            _ => 512,
        };
        self.m.unwrap_or(default).into()
    }

    /// The points around and along a journal bearing, and its eccentricity.
    pub(crate) fn journal(&self) -> (usize, usize, f64) {
        let (nx, ny, ecc) =
            if self.scene == Scene::Bearing2d { (127, 63, 0.6) } else { (50, 50, 0.1) };
        let points = |given: Option<u16>, default| given.unwrap_or(default).into();
        (points(self.nx, nx), points(self.ny, ny), self.ecc.unwrap_or(ecc))
    }

    pub(crate) fn precisions(&self) -> Vec<Precision> {
        match (self.precision, &self.method) {
            (Some(precision), _) => vec![precision],
            (None, Some(_)) => vec![Precision::F64],
            (None, None) => vec![Precision::F64, Precision::F32],
        }
    }
}
