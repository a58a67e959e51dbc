//! What is to be solved: a scene by its numbers, or files.

use std::error::Error;

use hlcp_core::{Identity, LinearOperator, Scalar, market};
use hlcp_methods::Tolerance;
use hlcp_verify::{AmericanPut, Bearing2d, Disc, Example, JournalBearing, Obstacle, Posed, Slider};

use crate::{
    Run,
    arguments::{Precision, SHIFT, Scene, Solution},
};

/// A problem in one precision.
pub(crate) struct Given<'g, T, A, B> {
    pub(crate) name: &'g str,
    pub(crate) a: &'g A,
    pub(crate) b: &'g B,
    pub(crate) q: &'g [T],
    /// z* and r*.
    pub(crate) known: Option<[&'g [T]; 2]>,
    /// The tolerance where none is given.
    pub(crate) tolerance: Tolerance,
    /// What a reader wants to know of (z, r).
    pub(crate) figures: &'g Figures<T>,
    /// How many problems there are, and how to overwrite `q` with that of the `k`-th, for the `z` of the one before.
    pub(crate) march: (usize, &'g March<T>),
}

type Figures<T> = dyn Fn(&[T], &[T]) -> Vec<(&'static str, f64)>;
type March<T> = dyn Fn(usize, &[T], &mut [T]);

impl<'g, T, A, B> Given<'g, T, A, B> {
    /// A problem of which no more is known, to be solved to the paper's tolerance.
    fn new(name: &'g str, a: &'g A, b: &'g B, q: &'g [T]) -> Self {
        let (figures, next): (&Figures<T>, &March<T>) = (&|_, _| Vec::new(), &|_, _, _| {});
        let tolerance = Tolerance::Absolute(1e-10);
        Self { name, a, b, q, known: None, tolerance, figures, march: (1, next) }
    }
}

impl Run<'_> {
    /// Poses the scene, or reads the files, and solves by every method.
    pub(crate) fn load<T: Scalar>(&mut self, precision: Precision) -> Result<(), Box<dyn Error>> {
        let arguments = self.arguments;
        let m = arguments.m();
        if let (Some(a), Some(q)) = (&arguments.a, &arguments.q) {
            let a = &market::read_matrix::<T>(a)?;
            let q = &market::read_vector(q, a.order())?;
            let tolerance = Tolerance::Relative(1e-10);
            return match &arguments.b {
                Some(b) => {
                    let b = &market::read_matrix(b)?;
                    self.solve(precision, &Given { tolerance, ..Given::new("file", a, b, q) })
                }
                None => {
                    let b = &Identity { order: a.order() };
                    self.solve(precision, &Given { tolerance, ..Given::new("file", a, b, q) })
                }
            };
        }
        let name = &arguments.scene.name();
        match arguments.scene {
            Scene::Example1 | Scene::Example2 => {
                let symmetric = arguments.scene == Scene::Example1;
                let [mu, nu] = [arguments.mu, arguments.nu].map(|shift| shift.unwrap_or(SHIFT));
                let example = Example { symmetric, m, mu, nu };
                let Posed { a, b, q, z, r } = &match arguments.solution {
                    Solution::Default => example.pose::<T>()?,
                    Solution::Generic => example.pose_generic()?,
                };
                self.solve(precision, &Given { known: Some([z, r]), ..Given::new(name, a, b, q) })
            }
            Scene::DiscLcp | Scene::DiscHlcp => {
                let lcp = arguments.scene == Scene::DiscLcp;
                let Posed { a, b, q, z, r } = &Disc { lcp, m }.pose::<T>()?;
                self.solve(precision, &Given { known: Some([z, r]), ..Given::new(name, a, b, q) })
            }
            Scene::Slider => {
                let slider = Slider { cells: m };
                let (a, b, q) = &slider.pose::<T>()?;
                let figures = move |z: &[T], _: &[T]| {
                    let (peak, rupture) = (slider.peak(z), slider.rupture(z));
                    vec![
                        ("peak_pa", peak),
                        ("peak_error_pa", peak - Slider::PEAK),
                        ("rupture_m", rupture),
                        ("rupture_error_m", rupture - Slider::RUPTURE),
                    ]
                };
                let given = Given::new(name, a, b, q);
                let tolerance = Tolerance::Relative(1e-10);
                self.solve(precision, &Given { tolerance, figures: &figures, ..given })
            }
            Scene::JournalBearing => {
                let (nx, ny, ecc) = arguments.journal();
                let bearing = JournalBearing { nx, ny, ecc, b: arguments.b_length };
                let (a, b, q) = &bearing.pose::<T>()?;
                let figures = move |z: &[T], _: &[T]| vec![("objective", bearing.objective(z))];
                let given = Given::new(name, a, b, q);
                self.solve(precision, &Given { figures: &figures, ..given })
            }
            Scene::Obstacle => {
                let obstacle = Obstacle { m };
                let (a, b, q) = &obstacle.pose::<T>()?;
                let figures = move |z: &[T], _: &[T]| {
                    let [mean, largest] = obstacle.errors(z);
                    vec![
                        ("discretisation_error_mean", mean),
                        ("discretisation_error_linf", largest),
                    ]
                };
                let given = Given::new(name, a, b, q);
                self.solve(precision, &Given { figures: &figures, ..given })
            }
            Scene::Bearing2d => {
                let (nx, ny, ecc) = arguments.journal();
                let groove = arguments.groove.to_radians();
                let bearing = Bearing2d { nx, ny, ecc, aspect: arguments.aspect, groove };
                let (a, b, q) = &bearing.pose::<T>()?;
                let figures = move |z: &[T], r: &[T]| {
                    let [drawn, returned, ends] = bearing.flows(z, r);
                    vec![
                        ("sommerfeld", bearing.sommerfeld(z)),
                        ("attitude_degrees", bearing.attitude(z)),
                        ("flow_drawn", drawn),
                        ("flow_returned", returned),
                        ("flow_ends", ends),
                    ]
                };
                let given = Given::new(name, a, b, q);
                self.solve(precision, &Given { figures: &figures, ..given })
            }
            Scene::AmericanPut => {
                let put = AmericanPut {
                    rate: arguments.rate,
                    volatility: arguments.volatility,
                    maturity: arguments.maturity,
                    m,
                    steps: arguments.steps.into(),
                };
                let (a, b) = &put.pose::<T>()?;
                let zeros = vec![T::zero(); a.order()];
                let q = &mut zeros.clone();
                put.q(0, &zeros, q);
                let spot = arguments.spot;
                let figures = move |z: &[T], _: &[T]| {
                    vec![("price", put.price(z, spot)), ("exercise", put.exercise(z))]
                };
                let next = move |k, z: &[T], q: &mut [T]| put.q(k, z, q);
                let given = Given::new(name, a, b, q);
                let march: (usize, &March<T>) = (put.lcps(), &next);
                self.solve(precision, &Given { figures: &figures, march, ..given })
            }
        }
    }
}
