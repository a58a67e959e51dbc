//! The problems of the scenes, in one precision, with what is known of their solutions.

use std::{borrow::Cow, f64::consts::PI, ops::ControlFlow};

use hlcp_core::{Csr, FivePoint, Hlcp, LinearOperator, Omega, Rows, Scalar, Varying};
use hlcp_methods::{
    BoxedMethod, DynRows, Limits, Method, Named, Options, Outcome, Progress, Solver,
};
use hlcp_verify::{
    AmericanPut, Bearing2d, Branch, Certificate, Columns as _, Dam, Disc, Example, Film,
    JournalBearing, Membrane, Obstacle, Posed, Slider,
};

use super::Numbers;
use crate::Fallible;

type Figures<T> = dyn Fn(&[T], &[T]) -> Vec<(&'static str, f64)>;
type Proofs = dyn Fn(&Certificate) -> Vec<(&'static str, [f64; 2])>;
type Next<T> = dyn Fn(usize, &[T], &mut [T]);
pub(crate) type Watch<'w, T> = dyn FnMut(&Progress<'_, T>) -> ControlFlow<()> + 'w;

pub(crate) struct Problem<T> {
    pub(crate) a: Box<dyn Rows<T>>,
    pub(crate) b: Box<dyn Rows<T>>,
    /// The right-hand side, of several problems the first.
    pub(crate) q: Vec<T>,
    /// z* and r*.
    pub(crate) known: Option<[Vec<T>; 2]>,
    /// The figures of (z, r) with their names.
    pub(crate) figures: Box<Figures<T>>,
    /// What figures of the exact solution are proved to lie between.
    pub(crate) proofs: Box<Proofs>,
    /// What r > 0 means.
    pub(crate) meaning: Option<&'static str>,
    /// How many problems there are, and how to overwrite `q` with that of the `k`-th, for the `z`
    /// of the one before.
    pub(crate) march: (usize, Box<Next<T>>),
    /// The entries of the x that measured solves begin with.
    pub(crate) start: T,
}

impl<T: Scalar> Problem<T> {
    /// One problem, of which no more is known.
    pub(crate) fn new(a: impl Rows<T> + 'static, b: impl Rows<T> + 'static, q: Vec<T>) -> Self {
        Self {
            a: Box::new(a),
            b: Box::new(b),
            q,
            known: None,
            figures: Box::new(|_, _| vec![]),
            proofs: Box::new(|_| vec![]),
            meaning: None,
            march: (1, Box::new(|_, _, _| ())),
            start: T::one(),
        }
    }

    fn planted(posed: Posed<T, FivePoint<T>, FivePoint<T>>) -> Self {
        let Posed { a, b, q, z, r } = posed;
        Self { known: Some([z, r]), ..Self::new(a, b, q) }
    }

    fn with_figures(
        self,
        figures: impl Fn(&[T], &[T]) -> Vec<(&'static str, f64)> + 'static,
    ) -> Self {
        Self { figures: Box::new(figures), ..self }
    }

    fn with_proofs(
        self,
        meaning: &'static str,
        proofs: impl Fn(&Certificate) -> Vec<(&'static str, [f64; 2])> + 'static,
    ) -> Self {
        Self { proofs: Box::new(proofs), meaning: Some(meaning), ..self }
    }

    /// The problem with Ω = τ D_A D_B⁻¹ as the methods take it.
    pub(crate) fn hlcp(&self, tau: T) -> Result<Posable<'_, T>, hlcp_core::Error> {
        let (a, b) = (&*self.a, &*self.b);
        Hlcp::new(a, b, Omega::diagonal_ratio(tau, a, b)?)
    }

    /// Returns the method of a name that leaves no parameters open, with τ = 1.
    pub(crate) fn solver(&self, name: &str) -> Fallible<Solver<T, Boxed<'_, T>>> {
        Ok(self.solved_by(&name.parse()?, 1.0)?)
    }

    pub(crate) fn solved_by(
        &self,
        method: &Named,
        tau: f64,
    ) -> Result<Solver<T, Boxed<'_, T>>, hlcp_core::Error> {
        Ok(Solver::new(method.on_dyn(self.hlcp(T::of(tau))?)?))
    }

    /// Returns the x that measured solves begin with.
    pub(crate) fn start(&self) -> Vec<T> {
        vec![self.start; self.q.len()]
    }

    /// Solves the problems one after another until one does not converge: the first from `x0`, the
    /// others from the answer before if `warm`, or else from `x0` too. The limit on time is on all
    /// of them. Returns the outcome of all, with the residual of the last, and the last `q`.
    pub(crate) fn march<M: Method<T>>(
        &self,
        solver: &mut Solver<T, M>,
        (x0, warm): (&[T], bool),
        limits: &Limits,
        mut watch: Option<&mut Watch<'_, T>>,
    ) -> Result<(Outcome, Cow<'_, [T]>), hlcp_core::Error> {
        let mut solve =
            |solver: &mut Solver<T, M>, q: &[T], options: Options<'_, T>| match &mut watch {
                Some(watch) => solver.solve(q, options.observer(watch)),
                None => solver.solve(q, options),
            };
        let ((count, next), mut q) = (&self.march, Cow::Borrowed(&self.q[..]));
        let mut outcome = solve(solver, &q, Options::from_x(x0).limits(*limits))?;
        for k in 1..*count {
            if !outcome.converged() {
                break;
            }
            next(k, solver.z(), q.to_mut());
            let time = limits.time.map(|time| time.saturating_sub(outcome.elapsed));
            let options = if warm { Options::resume() } else { Options::from_x(x0) };
            let options = options.limits(Limits { time, ..*limits });
            outcome = outcome.then(solve(solver, &q, options)?);
        }
        Ok((outcome, q))
    }
}

pub(crate) type Posable<'p, T> = Hlcp<T, DynRows<'p, T>, DynRows<'p, T>>;
pub(crate) type Boxed<'p, T> = BoxedMethod<'p, T, DynRows<'p, T>, DynRows<'p, T>>;

pub(crate) type Posing<T> = Result<Problem<T>, hlcp_core::Error>;

pub(super) fn example<T: Scalar, const SYMMETRIC: bool>(numbers: &Numbers) -> Posing<T> {
    let (mu, nu) = (numbers.get("mu"), numbers.get("nu"));
    let example = Example { symmetric: SYMMETRIC, m: numbers.size("m"), mu, nu };
    let generic = numbers.get("solution") == 1.0;
    Ok(Problem::planted(match (&numbers.columns, generic) {
        (None, true) => example.pose_generic()?,
        (Some(_), true) => {
            let what = "the generic solution of an example";
            return Err(hlcp_core::Error::OneRank { what, ranks: 2 });
        }
        _ => example.pose_columns(numbers.columns(example.m))?,
    }))
}

pub(super) fn disc<T: Scalar, const LCP: bool>(numbers: &Numbers) -> Posing<T> {
    let disc = Disc { lcp: LCP, m: numbers.size("m") };
    let problem = Problem::planted(disc.pose_columns(numbers.columns(disc.m))?);
    Ok(problem.with_proofs("contact", |_| vec![]))
}

pub(super) fn slider<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let slider = Slider { cells: numbers.size("m") };
    let (a, b, q) = slider.pose::<T>()?;
    // Assembled: a virtual call for each entry takes as long as the rest of a sweep.
    let problem = Problem::new(Csr::from_rows(&a), Csr::from_rows(&b), q);
    let problem = problem.with_figures(move |z, _| {
        let (peak, rupture) = (slider.peak(z), slider.rupture(z));
        vec![
            ("peak_pa", peak),
            ("peak_error_pa", peak - Slider::PEAK),
            ("rupture_m", rupture),
            ("rupture_error_m", rupture - Slider::RUPTURE),
        ]
    });
    Ok(problem.with_proofs("rupture", move |certificate| {
        let largest = |end: usize| {
            (0..certificate.sides.len())
                .map(|j| certificate.interval(j)[0][end])
                .fold(0.0, f64::max)
        };
        let place = |nodes: Option<usize>| {
            nodes.map_or(0, |i| i + 1) as f64 / slider.cells as f64 * Slider::LENGTH
        };
        let sides = &certificate.sides;
        let [first, last] = [
            sides.iter().rposition(|side| *side == Branch::Z),
            sides.iter().rposition(|side| *side != Branch::R),
        ];
        vec![
            ("peak_pa", widened([0, 1].map(|end| largest(end) * Slider::PRESSURE_UNIT))),
            ("rupture_m", widened([place(first), place(last)])),
        ]
    }))
}

/// Returns an interval around `c_zᵀz + c_rᵀr + constant` of the exact solution, where the
/// coefficients and the constant are off by so many `roundings` of the largest of them.
fn proved_sum(
    certificate: &Certificate,
    coefficients: [&[f64]; 2],
    constant: f64,
    roundings: f64,
) -> [f64; 2] {
    let [lower, upper] = certificate.functional(coefficients);
    let mut size = constant.abs();
    for (k, c) in coefficients.into_iter().enumerate() {
        let largest = c.iter().fold(0.0_f64, |largest, c| largest.max(c.abs()));
        if largest > 0.0 {
            let ends = (0..c.len()).map(|j| certificate.interval(j)[k][1]);
            size += (largest + constant.abs()) * ends.sum::<f64>();
        }
    }
    let off = roundings * f64::EPSILON * size;
    widened([lower + constant - off, upper + constant + off])
}

/// Ends of an interval after a few operations that round.
fn widened([lower, upper]: [f64; 2]) -> [f64; 2] {
    let some = |end: f64| 16.0 * f64::EPSILON * end.abs();
    [lower - some(lower), upper + some(upper)]
}

pub(super) fn journal_bearing<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let bearing = JournalBearing {
        nx: numbers.size("nx"),
        ny: numbers.size("ny"),
        ecc: numbers.get("ecc"),
        b: numbers.get("b-length"),
    };
    let (a, b, q) = bearing.pose_columns::<T>(numbers.columns(bearing.nx))?;
    let problem = Problem::new(a, b, q);
    Ok(problem.with_figures(move |z, _| vec![("objective", bearing.objective(z))]))
}

pub(super) fn obstacle<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let obstacle = Obstacle { m: numbers.size("m") };
    let (a, b, q) = obstacle.pose_columns::<T>(numbers.columns(obstacle.m.saturating_sub(2)))?;
    let problem = Problem::new(a, b, q).with_figures(move |z, _| {
        let [mean, largest] = obstacle.errors(z);
        vec![("discretisation_error_mean", mean), ("discretisation_error_linf", largest)]
    });
    Ok(problem.with_proofs("contact", |_| vec![]))
}

pub(super) fn membrane<T: Scalar, const SPIRAL: bool>(numbers: &Numbers) -> Posing<T> {
    let membrane = Membrane { spiral: SPIRAL, m: numbers.size("m") };
    let (a, b, q) = membrane.pose_columns::<T>(numbers.columns(membrane.m))?;
    Ok(Problem::new(a, b, q).with_proofs("contact", |_| vec![]))
}

pub(super) fn dam<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let dam = Dam {
        nx: numbers.size("nx"),
        ny: numbers.size("ny"),
        length: numbers.get("length"),
        tail: numbers.get("tail"),
        layer: numbers.get("layer"),
    };
    let (a, b, q) = dam.pose_columns::<T>(numbers.columns(dam.nx))?;
    let problem = Problem::new(a, b, q).with_figures(move |z, r| {
        let (discharge, heights) = (dam.discharge(z), dam.heights(r));
        vec![
            ("discharge", discharge),
            ("discharge_error", discharge - dam.exact_discharge()),
            ("height_in_the_middle", heights[dam.nx / 2]),
            ("height_before_the_face", heights[dam.nx - 1]),
        ]
    });
    Ok(problem.with_proofs("dry", |_| vec![]))
}

pub(super) fn bearing2d<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let bearing = Bearing2d {
        nx: numbers.size("nx"),
        ny: numbers.size("ny"),
        ecc: numbers.get("ecc"),
        aspect: numbers.get("aspect"),
        groove: numbers.get("groove").to_radians(),
    };
    let (a, b, q) = bearing.pose_columns::<T>(numbers.columns(bearing.nx))?;
    let problem = Problem::new(a, b, q).with_figures(move |z, r| {
        let [drawn, returned, ends] = bearing.flows(z, r);
        vec![
            ("sommerfeld", bearing.sommerfeld(z)),
            ("attitude_degrees", bearing.attitude(z)),
            ("flow_drawn", drawn),
            ("flow_returned", returned),
            ("flow_ends", ends),
        ]
    });
    Ok(problem.with_proofs("rupture", move |certificate| bearing2d_proofs(&bearing, certificate)))
}

/// The figures of the exact pressure and void, between the ends that the load and the flows have,
/// which are sums with the weights of their definitions.
fn bearing2d_proofs(
    bearing: &Bearing2d,
    certificate: &Certificate,
) -> Vec<(&'static str, [f64; 2])> {
    let Bearing2d { nx, ny, .. } = *bearing;
    // One row of points has cells of height 1 in the place of 2/(ny + 1).
    let (row, height) = (Bearing2d { ny: 1, ..*bearing }, 2.0 / (ny as f64 + 1.0));
    let figures = |[z, r]: &[Vec<f64>; 2]| {
        let ([along, across], [drawn, returned, ends]) = (row.load(z), row.flows(z, r));
        [along, across, drawn, returned, ends]
    };
    let mut point = [vec![0.0; nx], vec![0.0; nx]];
    let base = figures(&point);
    let mut weights = [(); 5].map(|()| [vec![0.0; nx * ny], vec![0.0; nx * ny]]);
    for (unknown, i) in (0..2 * nx).map(|k| (k / nx, k % nx)) {
        point[unknown][i] = 1.0;
        let found = figures(&point);
        point[unknown][i] = 0.0;
        for (k, weights) in weights.iter_mut().enumerate() {
            let (column, more) = (&mut weights[unknown][i..], found[k] - base[k]);
            if k < 4 {
                column.iter_mut().step_by(nx).for_each(|weight| *weight = more * height);
            } else {
                // It is at both ends there.
                [0, ny - 1].into_iter().for_each(|j| column[j * nx] += more / 2.0 / height);
            }
        }
    }
    let sum = |k: usize| {
        let [c_z, c_r] = &weights[k];
        proved_sum(certificate, [c_z, c_r], ny as f64 * height * base[k], 64.0)
    };
    let [along, across] = [sum(0), sum(1)];
    let corners = [0, 1, 2, 3].map(|k| [along[k % 2], across[k / 2]]);
    let far = corners.map(|[x, y]| x.hypot(y)).into_iter().fold(0.0, f64::max);
    let nearest = |[lower, upper]: [f64; 2]| lower.max(-upper).max(0.0);
    let near = nearest(along).hypot(nearest(across));
    let angles = corners.map(|[x, y]| y.atan2(x).to_degrees());
    let attitude = if along[0] > 0.0 {
        [f64::min, f64::max].map(|pick| angles.into_iter().fold(angles[0], pick))
    } else {
        [-180.0, 180.0]
    };
    vec![
        ("sommerfeld", widened([far, near].map(|load| 1.0 / (3.0 * PI * load)))),
        ("attitude_degrees", widened(attitude)),
        ("flow_drawn", sum(2)),
        ("flow_returned", sum(3)),
        ("flow_ends", sum(4)),
    ]
}

/// A square slider of 10 mm, 11 µm at the inlet and 10 µm at the outlet, with `k` square dimples
/// along `x` and as many for the same length along `y`, of `depth` times the gap at the outlet.
pub(crate) fn textured([nx, ny]: [usize; 2], k: usize, depth: f64) -> Film {
    let rows = (k * ny) as f64 / nx as f64;
    let cell = 1e-2 / nx as f64;
    let mut film = Film::new([nx, ny], [1e-2, cell * ny as f64], 1.0, 0.01);
    let is_inside = |at: f64| (at - at.floor() - 0.5).abs() < 0.25;
    for (at, gap) in film.gap.iter_mut().enumerate() {
        let x = ((at % nx) as f64 + 0.5) / nx as f64;
        let y = ((at / nx) as f64 + 0.5) / ny as f64;
        let is_dimple = is_inside(k as f64 * x) && is_inside(rows * y);
        *gap = 1e-5 * (1.1 - 0.1 * x + if is_dimple { depth } else { 0.0 });
    }
    film
}

pub(super) fn film<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let cells = ["nx", "ny"].map(|name| numbers.size(name));
    let film = textured(cells, numbers.size("dimples"), numbers.get("depth"));
    let (a, b, q) = film.pose()?;
    let of = |operator: &FivePoint<Varying<f64>>| {
        let view = operator.as_five_point().expect("it is one");
        let row = |i, j| view.coefficients().map(|c| T::of(c.entry(j * cells[0] + i)));
        FivePoint::from_fn(cells[0], cells[1], row)
    };
    let problem = Problem::new(of(&a)?, of(&b)?, q.iter().map(|&q| T::of(q)).collect());
    Ok(problem.with_figures(move |z, r| {
        let wide = |v: &[T]| v.iter().map(|v| v.wide()).collect::<Vec<_>>();
        let figures = film.figures(&wide(z), &wide(r), 0.0);
        vec![("load_n", figures.load), ("broken_share", figures.broken_share)]
    }))
}

pub(super) fn american_put<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let put = AmericanPut {
        rate: numbers.get("rate"),
        volatility: numbers.get("volatility"),
        maturity: numbers.get("maturity"),
        m: numbers.size("m"),
        steps: numbers.size("steps"),
    };
    let spot = numbers.get("spot");
    let (a, b) = put.pose::<T>()?;
    let zeros = vec![T::zero(); a.order()];
    let mut q = zeros.clone();
    put.q(0, &zeros, &mut q);
    let next = Box::new(move |k, z: &[T], q: &mut [T]| put.q(k, z, q));
    let problem = Problem { march: (put.lcps(), next), ..Problem::new(a, b, q) };
    let problem = problem.with_figures(move |z, _| {
        vec![("price", put.price(z, spot)), ("exercise", put.exercise(z))]
    });
    // The price is that of all steps, and a certificate only of the last one.
    Ok(problem.with_proofs("exercise", |_| vec![]))
}
