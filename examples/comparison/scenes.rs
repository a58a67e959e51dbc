//! The scenes over a ladder of grids, each with what judges an answer.

use std::error::Error;

use hlcp_core::{Identity, Rows};
use hlcp_methods::{Limits, Options, Solver};
use hlcp_verify::{
    AmericanPut, Bearing2d, Certificate, Disc, Example, JournalBearing, Obstacle, Posed, Slider,
    certify,
};

use crate::methods::method;

/// A scene whose size is still open.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Scene {
    /// Example 1 or 2 with μ = ν = `shift`.
    Example {
        symmetric: bool,
        shift: f64,
    },
    Slider,
    Disc {
        lcp: bool,
    },
    JournalBearing,
    Obstacle,
    Bearing2d,
    AmericanPut,
}

/// The discs, the paper's examples and the others: a chart each.
pub(crate) const FAMILIES: [(&str, &[Scene]); 3] = [
    ("discs", &[Scene::Disc { lcp: true }, Scene::Disc { lcp: false }]),
    (
        "examples",
        &[
            Scene::Example { symmetric: true, shift: 4.0 },
            Scene::Example { symmetric: true, shift: 0.0 },
            Scene::Example { symmetric: false, shift: 4.0 },
            Scene::Example { symmetric: false, shift: 0.0 },
        ],
    ),
    (
        "applications",
        &[
            Scene::JournalBearing,
            Scene::Obstacle,
            Scene::Bearing2d,
            Scene::Slider,
            Scene::AmericanPut,
        ],
    ),
];

/// The LCPs or HLCPs of a scene on one grid, solved one after another.
pub(crate) struct Problem<A, B> {
    pub(crate) a: A,
    pub(crate) b: B,
    pub(crate) qs: Vec<Vec<f64>>,
    /// z* and r* of the last one: planted, or solved to the floor of rounding.
    pub(crate) truth: [Vec<f64>; 2],
    /// How near that is to the solution, where there is time to prove it: a planted pair solves a rounded `q` only nearly.
    pub(crate) certificate: Option<Certificate>,
    pub(crate) setting: Setting,
}

/// What the methods are told.
#[derive(Clone, Copy)]
pub(crate) struct Setting {
    /// The residual over ‖q‖ that is good enough, beside the absolute 1e-10.
    pub(crate) relative: f64,
    /// Whether both operators are tridiagonal.
    pub(crate) tridiagonal: bool,
    /// The best known α and τ of AMSOR.
    pub(crate) amsor: [f64; 2],
}

/// The largest order that answers are certified for.
const CERTIFIED: usize = 70_000;

/// Iterations that take any of the unplanted scenes to its floor.
const TO_THE_FLOOR: usize = 60;

/// What is done with a problem, whatever its operators.
pub(crate) trait Visit {
    fn visit<A: Rows<f64>, B: Rows<f64>>(
        &mut self,
        scene: Scene,
        m: usize,
        problem: &Problem<A, B>,
    ) -> Result<(), Box<dyn Error>>;
}

impl Scene {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Example { symmetric: true, shift: 0.0 } => "example1 (0, 0)",
            Self::Example { symmetric: true, .. } => "example1 (4, 4)",
            Self::Example { shift: 0.0, .. } => "example2 (0, 0)",
            Self::Example { .. } => "example2 (4, 4)",
            Self::Slider => "slider",
            Self::Disc { lcp: true } => "disc-lcp",
            Self::Disc { .. } => "disc-hlcp",
            Self::JournalBearing => "journal-bearing",
            Self::Obstacle => "obstacle",
            Self::Bearing2d => "bearing2d",
            Self::AmericanPut => "american-put",
        }
    }

    /// What `m` stands for.
    pub(crate) fn size(self) -> &'static str {
        match self {
            Self::Slider => "m + 1 cells, n = m",
            Self::AmericanPut => {
                "m points to a standard deviation, n ≈ 7.8 m, 66 LCPs one after another"
            }
            Self::JournalBearing => "m × m points, ε = 0.1, b = 10",
            Self::Obstacle => "m × m inner nodes",
            Self::Bearing2d => "m × (m − 1)/2 points, ε = 0.6, L/D = 1, groove at the widest gap",
            Self::Example { .. } | Self::Disc { .. } => "m × m points",
        }
    }

    fn setting(self, m: usize) -> Setting {
        let m = m as f64;
        let amsor = match self {
            Self::Example { shift: 4.0, .. } => [1.0, 1.0],
            Self::Example { symmetric: true, .. } => [1.2, 1.0],
            Self::Example { .. } => [1.1, 1.0],
            Self::Slider => [1.4, 0.5],
            Self::Disc { .. } => [2.0 - 8.0 / m, 1.0],
            Self::JournalBearing => [2.0 - 11.0 / m, 1.0],
            Self::Obstacle => [2.0 - 12.0 / m, 1.0],
            Self::Bearing2d => [1.4, 0.5],
            Self::AmericanPut => [2.0 - 24.0 / (m + 18.0), 1.0],
        };
        let tridiagonal = matches!(self, Self::Slider | Self::AmericanPut);
        let relative = if self == Self::Slider { 1e-10 } else { 0.0 };
        Setting { relative, tridiagonal, amsor }
    }

    /// Poses the scene for the size `m` and shows it to `visitor`.
    pub(crate) fn pose(self, m: usize, visitor: &mut impl Visit) -> Result<(), Box<dyn Error>> {
        let setting = self.setting(m);
        match self {
            Self::Example { symmetric, shift } => {
                let posed = Example { symmetric, m, mu: shift, nu: shift }.pose()?;
                visitor.visit(self, m, &Problem::planted(posed, setting)?)
            }
            Self::Disc { lcp } => {
                visitor.visit(self, m, &Problem::planted(Disc { lcp, m }.pose()?, setting)?)
            }
            Self::Slider => {
                let (a, b, q) = Slider { cells: m + 1 }.pose()?;
                visitor.visit(self, m, &Problem::of_one(a, b, &q, setting)?)
            }
            Self::JournalBearing => {
                let (a, b, q) = JournalBearing { nx: m, ny: m, ecc: 0.1, b: 10.0 }.pose()?;
                visitor.visit(self, m, &Problem::of_one(a, b, &q, setting)?)
            }
            Self::Obstacle => {
                let (a, b, q) = Obstacle { m: m + 2 }.pose()?;
                visitor.visit(self, m, &Problem::of_one(a, b, &q, setting)?)
            }
            Self::Bearing2d => {
                let bearing =
                    Bearing2d { nx: m, ny: (m - 1) / 2, ecc: 0.6, aspect: 1.0, groove: 0.0 };
                let (a, b, q) = bearing.pose()?;
                visitor.visit(self, m, &Problem::of_one(a, b, &q, setting)?)
            }
            Self::AmericanPut => {
                let put = AmericanPut { rate: 0.06, volatility: 0.2, maturity: 1.0, m, steps: 64 };
                let (a, b): (_, Identity) = put.pose()?;
                let next = |k, z: &[f64], q: &mut [f64]| put.q(k, z, q);
                visitor.visit(self, m, &Problem::of_many(a, b, put.lcps(), next, setting)?)
            }
        }
    }
}

impl<A: Rows<f64>, B: Rows<f64>> Problem<A, B> {
    fn planted(posed: Posed<f64, A, B>, setting: Setting) -> Result<Self, Box<dyn Error>> {
        let Posed { a, b, q, z, r } = posed;
        Self::judged(a, b, vec![q], [z, r], setting)
    }

    /// One problem, of which no solution is known.
    fn of_one(a: A, b: B, q: &[f64], setting: Setting) -> Result<Self, Box<dyn Error>> {
        Self::of_many(a, b, 1, |_, _, into| into.copy_from_slice(q), setting)
    }

    /// `count` problems, each `q` made by `next` from the reference's `z` of the one before: the same for all methods.
    fn of_many(
        a: A,
        b: B,
        count: usize,
        next: impl Fn(usize, &[f64], &mut [f64]),
        setting: Setting,
    ) -> Result<Self, Box<dyn Error>> {
        let name = if setting.tridiagonal { "NEWTON" } else { "MGW" };
        let mut solver = Solver::new(method(name, (&a, &b), setting)?);
        let limits = Limits { iterations: TO_THE_FLOOR, ..Limits::absolute(0.0) };
        let (mut x, mut qs) = (vec![1.0; a.order()], vec![vec![0.0; a.order()]; count]);
        for (k, q) in qs.iter_mut().enumerate() {
            next(k, solver.z(), q);
            // To a tolerance of 0, which need not be met.
            let outcome = solver.solve(q, Options::from_x(&x).limits(limits))?;
            let goal =
                f64::max(1e-10, setting.relative * q.iter().map(|q| q * q).sum::<f64>().sqrt());
            if outcome.residual.l2 > 0.5 * goal {
                return Err(format!("no reference: {outcome}").into());
            }
            x.copy_from_slice(solver.x());
        }
        let truth = [solver.z().to_vec(), solver.r().to_vec()];
        drop(solver);
        Self::judged(a, b, qs, truth, setting)
    }

    fn judged(
        a: A,
        b: B,
        qs: Vec<Vec<f64>>,
        truth: [Vec<f64>; 2],
        setting: Setting,
    ) -> Result<Self, Box<dyn Error>> {
        let certificate = if a.order() <= CERTIFIED {
            certify(&a, &b, &qs[qs.len() - 1], &truth[0], &truth[1])?
        } else {
            None
        };
        Ok(Self { a, b, qs, truth, certificate, setting })
    }

    /// The largest error of a component of `(z, r)`.
    pub(crate) fn error(&self, z: &[f64], r: &[f64]) -> f64 {
        let errors = |v: &[f64], truth: &[f64]| {
            let differences = v.iter().zip(truth).map(|(v, t)| (v - t).abs());
            differences.fold(0.0, |max: f64, e| if e > max || e.is_nan() { e } else { max })
        };
        f64::max(errors(z, &self.truth[0]), errors(r, &self.truth[1]))
    }
}
