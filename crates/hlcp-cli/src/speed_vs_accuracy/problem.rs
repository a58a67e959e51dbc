//! The problems of the charts in both precisions, with their solutions.

use std::error::Error;

use hlcp_core::LinearOperator;
use hlcp_methods::{Limits, Options, Parameters};
use hlcp_verify::certify;

use crate::scenes::{self, Scene, distance};

/// A scene with its numbers.
#[derive(Clone)]
pub(crate) struct Posed {
    pub(crate) title: String,
    pub(crate) scene: &'static Scene,
    pub(crate) numbers: Vec<(&'static str, f64)>,
    /// Whether the planted solution is a generic one of the same pattern.
    generic: bool,
}

/// A problem with its solution.
pub(crate) struct Problem {
    pub(crate) posed: Posed,
    pub(crate) wide: scenes::Problem<f64>,
    pub(crate) narrow: scenes::Problem<f32>,
    truth: [Vec<f64>; 2],
    /// A proved bound on the error of `truth`: it is planted, but `q` is rounded.
    pub(crate) doubt: f64,
}

impl Problem {
    /// The largest error of a component of `(z, r)`.
    pub(crate) fn error(&self, z: &[f64], r: &[f64]) -> f64 {
        distance([z, r], &self.truth)
    }

    /// m, or what the scene has in its place.
    pub(crate) fn m(&self) -> f64 {
        self.posed.numbers[0].1
    }
}

impl Posed {
    /// Example 1 or 2, with its solution of zeros and ones or with a generic one.
    pub(crate) fn example(symmetric: bool, m: usize, [mu, nu]: [f64; 2], generic: bool) -> Self {
        let (number, scene) = if symmetric { (1, "example1") } else { (2, "example2") };
        let solution = if generic { "generic" } else { "0/1" };
        let title = format!("Example {number} ({mu}, {nu}), m = {m}, {solution}");
        let numbers = vec![("m", m as f64), ("mu", mu), ("nu", nu)];
        Self { title, scene: Scene::of(scene), numbers, generic }
    }

    /// A scene that is defined by `m` alone.
    pub(crate) fn plain(scene: &str, m: usize) -> Self {
        let letter = if scene == "slider" { "N" } else { "m" };
        let (title, numbers) = (format!("{scene}, {letter} = {m}"), vec![("m", m as f64)]);
        Self { title, scene: Scene::of(scene), numbers, generic: false }
    }

    /// A film of m × m cells, with a dimple for each 32 × 32, but 2 × 2 at least.
    pub(crate) fn film(m: usize) -> Self {
        let (side, k) = (m as f64, (m / 31).max(2));
        let title = format!("film, {m} × {m} cells, {k} × {k} dimples");
        let numbers = vec![("nx", side), ("ny", side), ("dimples", k as f64)];
        Self { title, scene: Scene::of("film"), numbers, generic: false }
    }

    /// The problem in both precisions.
    pub(crate) fn pose(&self) -> Result<Problem, Box<dyn Error>> {
        let numbers = self.scene.numbers(&self.numbers);
        let (mut wide, mut narrow) = ((self.scene.wide)(&numbers)?, (self.scene.narrow)(&numbers)?);
        if let Some(known) = wide.known.as_mut().filter(|_| self.generic) {
            // Thirty bits below 2: q is exact in double precision, and the planted pair solves what
            // is posed there.
            let mut az = vec![0.0; wide.q.len()];
            let size = |k: usize| (1 + k.wrapping_mul(0x9e37_79b9) % (1 << 30)) as f64;
            for (k, v) in known.iter_mut().flat_map(|vector| vector.iter_mut().enumerate()) {
                *v *= size(k) / (1 << 29) as f64;
            }
            wide.a.apply(&known[0], &mut az);
            wide.b.apply(&known[1], &mut wide.q);
            wide.q.iter_mut().zip(az).for_each(|(q, az)| *q -= az);
        }
        narrow.q = wide.q.iter().map(|&q| q as f32).collect();
        let truth = match &wide.known {
            Some(truth) => truth.clone(),
            None => to_the_floor(&wide)?,
        };
        let certificate = certify(&wide.a, &wide.b, &wide.q, &truth[0], &truth[1])?;
        let doubt = certificate.map_err(|refusal| refusal.to_string())?.error();
        Ok(Problem { posed: self.clone(), wide, narrow, truth, doubt })
    }
}

/// The solution of a problem that has none planted: Newton's method until it rests.
fn to_the_floor(problem: &scenes::Problem<f64>) -> Result<[Vec<f64>; 2], Box<dyn Error>> {
    let mut solver = problem.solver("AMG", Parameters::default(), 1.0)?;
    let limits = Limits { iterations: 60, ..Limits::absolute(0.0) };
    let start = problem.start();
    let _ = solver.solve(&problem.q, Options::from_x(&start).limits(limits))?;
    Ok([solver.z().to_vec(), solver.r().to_vec()])
}
