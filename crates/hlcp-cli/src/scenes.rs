//! The table of scenes: a new one is a row here and its file in `hlcp-verify`.

use std::{error::Error, f64::consts::PI};

use clap::{
    Arg, ArgMatches, Command, FromArgMatches,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
    error::ErrorKind,
    parser::ValueSource,
};
use hlcp_core::{
    Csr, Diagonal, FivePoint, FivePointView, Hlcp, LinearOperator, Norms, Omega, Rows, Scalar,
    VaryingFivePoint,
};
use hlcp_methods::{BoxedMethod, Limits, Named, Parameters, Solver, Tolerance, TridiagonalPart};
use hlcp_verify::{
    AmericanPut, Bearing2d, Branch, Certificate, Disc, Example, FilmOperator, JournalBearing,
    Obstacle, Posed, Slider,
};

use crate::films;

/// A kind of problem, defined by a few numbers.
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    about: &'static str,
    /// The options that define it, and their defaults.
    numbers: &'static [(&'static str, f64)],
    /// The tolerance where none is given.
    tolerance: Tolerance,
    pub(crate) wide: Pose<f64>,
    pub(crate) narrow: Pose<f32>,
    /// The chart of the comparison that it is drawn on.
    pub(crate) family: &'static str,
    /// What the comparison solves over a ladder of grids.
    pub(crate) ladders: &'static [Ladder],
}

/// Poses a scene in one precision.
type Pose<T> = fn(&Numbers) -> Result<Problem<T>, hlcp_core::Error>;

/// A scene for every number m of points per side.
pub(crate) struct Ladder {
    pub(crate) title: &'static str,
    /// The numbers that differ from the scene's defaults.
    pub(crate) numbers: fn(f64) -> Vec<(&'static str, f64)>,
    /// What m stands for.
    pub(crate) size: &'static str,
    /// The best known α and τ of AMSOR for m.
    pub(crate) amsor: fn(f64) -> [f64; 2],
}

const ABSOLUTE: Tolerance = Tolerance::Absolute(1e-10);
const RELATIVE: Tolerance = Tolerance::Relative(1e-10);

#[rustfmt::skip] // a table
pub(crate) static SCENES: [Scene; 10] = [
    Scene { name: "example1", family: "examples", tolerance: ABSOLUTE, wide: example1, narrow: example1,
        about: "The paper's Example 1",
        numbers: &[("m", 512.0), ("mu", 4.0), ("nu", 4.0), ("solution", 0.0)],
        ladders: &[
            Ladder { title: "example1 (4, 4)", size: "m × m points",
                numbers: |m| vec![("m", m)], amsor: |_| [1.0, 1.0] },
            Ladder { title: "example1 (0, 0)", size: "m × m points",
                numbers: |m| vec![("m", m), ("mu", 0.0), ("nu", 0.0)], amsor: |_| [1.2, 1.0] },
        ] },
    Scene { name: "example2", family: "examples", tolerance: ABSOLUTE, wide: example2, narrow: example2,
        about: "The paper's Example 2",
        numbers: &[("m", 512.0), ("mu", 4.0), ("nu", 4.0), ("solution", 0.0)],
        ladders: &[
            Ladder { title: "example2 (4, 4)", size: "m × m points",
                numbers: |m| vec![("m", m)], amsor: |_| [1.0, 1.0] },
            Ladder { title: "example2 (0, 0)", size: "m × m points",
                numbers: |m| vec![("m", m), ("mu", 0.0), ("nu", 0.0)], amsor: |_| [1.1, 1.0] },
        ] },
    Scene { name: "disc-lcp", family: "discs", tolerance: ABSOLUTE, wide: disc_lcp, narrow: disc_lcp,
        about: "A contact in a disc, as a linear complementarity problem",
        numbers: &[("m", 512.0)],
        ladders: &[
            Ladder { title: "disc-lcp", size: "m × m points",
                numbers: |m| vec![("m", m)], amsor: |m| [2.0 - 8.0 / m, 1.0] },
        ] },
    Scene { name: "disc-hlcp", family: "discs", tolerance: ABSOLUTE, wide: disc_hlcp, narrow: disc_hlcp,
        about: "A contact in a disc with a second operator on r",
        numbers: &[("m", 512.0)],
        ladders: &[
            Ladder { title: "disc-hlcp", size: "m × m points",
                numbers: |m| vec![("m", m)], amsor: |m| [2.0 - 8.0 / m, 1.0] },
        ] },
    Scene { name: "journal-bearing", family: "applications", tolerance: ABSOLUTE, wide: journal_bearing, narrow: journal_bearing,
        about: "The pressure in a journal bearing, cut off at zero",
        numbers: &[("nx", 50.0), ("ny", 50.0), ("ecc", 0.1), ("b-length", 10.0)],
        ladders: &[
            Ladder { title: "journal-bearing", size: "m × m points, ε = 0.1, b = 10",
                numbers: |m| vec![("nx", m), ("ny", m)], amsor: |m| [2.0 - 11.0 / m, 1.0] },
        ] },
    Scene { name: "obstacle", family: "applications", tolerance: ABSOLUTE, wide: obstacle, narrow: obstacle,
        about: "A membrane over a dome",
        numbers: &[("m", 65.0)],
        ladders: &[
            Ladder { title: "obstacle", size: "m × m inner nodes",
                numbers: |m| vec![("m", m + 2.0)], amsor: |m| [2.0 - 12.0 / m, 1.0] },
        ] },
    Scene { name: "bearing2d", family: "applications", tolerance: ABSOLUTE, wide: bearing2d, narrow: bearing2d,
        about: "A journal bearing with mass-conserving cavitation",
        numbers: &[("nx", 127.0), ("ny", 63.0), ("ecc", 0.6), ("aspect", 1.0), ("groove", 0.0)],
        ladders: &[
            Ladder { title: "bearing2d", size: "m × (m − 1)/2 points, ε = 0.6, L/D = 1, groove at the widest gap",
                numbers: |m| vec![("nx", m), ("ny", ((m - 1.0) / 2.0).floor())], amsor: |_| [1.4, 0.5] },
        ] },
    Scene { name: "film", family: "applications", tolerance: RELATIVE, wide: film, narrow: film,
        about: "A slider with square dimples and mass-conserving cavitation",
        numbers: &[("nx", 127.0), ("ny", 127.0), ("dimples", 4.0), ("depth", 2.0)],
        ladders: &[] },
    Scene { name: "slider", family: "applications", tolerance: RELATIVE, wide: slider, narrow: slider,
        about: "A slider with cavitation in the place of the paper's Example 3",
        numbers: &[("m", 512.0)],
        ladders: &[
            Ladder { title: "slider", size: "m + 1 cells, n = m",
                numbers: |m| vec![("m", m + 1.0)], amsor: |_| [1.4, 0.5] },
        ] },
    Scene { name: "american-put", family: "applications", tolerance: ABSOLUTE, wide: american_put, narrow: american_put,
        about: "An American put, one problem per time step",
        numbers: &[("m", 64.0), ("steps", 64.0), ("rate", 0.06), ("volatility", 0.2), ("maturity", 1.0), ("spot", 0.9)],
        ladders: &[
            Ladder { title: "american-put", size: "m points to a standard deviation, n ≈ 7.8 m, 66 LCPs one after another",
                numbers: |m| vec![("m", m)], amsor: |m| [2.0 - 24.0 / (m + 18.0), 1.0] },
        ] },
];

/// What an option of scenes may be.
enum Kind {
    Real,
    Whole(u16, u16),
    /// One of some words, which stand for 0, 1, …
    Word(&'static [&'static str]),
}

/// The options that define scenes: name, kind and help.
const OPTIONS: [(&str, Kind, &str); 17] = [
    (
        "m",
        Kind::Whole(1, 32768),
        "Grid points per side, the order being m²; the slider's cells, the order being m − 1; the \
         obstacle's nodes per side with the boundary's; the put's points per standard deviation",
    ),
    ("mu", Kind::Real, "The multiple of the identity in A"),
    ("nu", Kind::Real, "The multiple of the identity in B"),
    (
        "solution",
        Kind::Word(&["default", "generic"]),
        "The planted 0, 1, 0, 1, … or generic numbers in the same pattern",
    ),
    ("nx", Kind::Whole(1, 32768), "Inner grid points around the bearing; the film's cells along x"),
    ("ny", Kind::Whole(1, 32768), "Inner grid points along the bearing; the film's cells along y"),
    ("dimples", Kind::Whole(0, 32768), "Dimples along x, and as many for the same length along y"),
    ("depth", Kind::Real, "The depth of the dimples over the least gap"),
    ("ecc", Kind::Real, "The eccentricity"),
    ("b-length", Kind::Real, "Half the length over the radius"),
    ("aspect", Kind::Real, "The length over the diameter"),
    ("groove", Kind::Real, "The place of the feed groove, in degrees from the widest gap"),
    ("rate", Kind::Real, "The interest rate per year"),
    ("volatility", Kind::Real, "The volatility per square root of a year"),
    ("maturity", Kind::Real, "The time to maturity, in years"),
    ("spot", Kind::Real, "The spot price over the strike"),
    ("steps", Kind::Whole(0, u16::MAX), "Time steps"),
];

/// The numbers that define a scene.
#[derive(Debug, Clone)]
pub(crate) struct Numbers(Vec<(&'static str, f64)>);

impl Numbers {
    /// The number of an option that the scene has.
    pub(crate) fn get(&self, name: &str) -> f64 {
        let number = self.0.iter().find(|(known, _)| *known == name);
        number.unwrap_or_else(|| panic!("the scene has no option {name}")).1
    }

    fn size(&self, name: &str) -> usize {
        self.get(name) as usize
    }
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl Scene {
    /// The scene of this name.
    pub(crate) fn of(name: &str) -> &'static Self {
        let scene = SCENES.iter().find(|scene| scene.name == name);
        scene.unwrap_or_else(|| panic!("there is no scene {name}"))
    }

    /// The scene's numbers: its defaults, apart from those given.
    pub(crate) fn numbers(&self, given: &[(&'static str, f64)]) -> Numbers {
        let mut numbers = Numbers(self.numbers.to_vec());
        for &(name, value) in given {
            let number = numbers.0.iter_mut().find(|(known, _)| *known == name);
            number.unwrap_or_else(|| panic!("{} has no option {name}", self.name)).1 = value;
        }
        numbers
    }

    /// The scene in double precision, with numbers that differ from its defaults.
    pub(crate) fn pose(
        &self,
        given: &[(&'static str, f64)],
    ) -> Result<Problem<f64>, hlcp_core::Error> {
        (self.wide)(&self.numbers(given))
    }

    /// Limits with the scene's tolerance.
    pub(crate) fn limits(&self) -> Limits {
        Limits { tolerance: self.tolerance, ..Limits::default() }
    }

    fn takes(&self, option: &str) -> bool {
        self.numbers.iter().any(|(name, _)| *name == option)
    }
}

/// The residual that the tolerance allows for `q`, but for rounding.
pub(crate) fn goal<T: Scalar>(limits: &Limits, q: &[T]) -> f64 {
    match limits.tolerance {
        Tolerance::Absolute(goal) => goal,
        Tolerance::Relative(share) => share * limits.norm.of(Norms::of(q)),
    }
}

/// The largest difference of a component of (z, r) to that of a solution; NaN where there is one.
pub(crate) fn distance<T: Scalar>(found: [&[T]; 2], solution: &[Vec<f64>; 2]) -> f64 {
    let wide = |v: &T| v.to_f64().unwrap_or(f64::NAN);
    let pairs = found.into_iter().zip(solution).flat_map(|(found, known)| found.iter().zip(known));
    let differences = pairs.map(|(found, known)| (wide(found) - known).abs());
    differences.fold(0.0, |most: f64, e| if e > most || e.is_nan() { e } else { most })
}

/// The scene of a command line, with its numbers.
#[derive(Debug, Clone)]
pub(crate) struct Given {
    pub(crate) scene: &'static Scene,
    pub(crate) numbers: Numbers,
}

/// The scenes that take an option.
fn takers(option: &str) -> impl Iterator<Item = &'static Scene> {
    SCENES.iter().filter(move |scene| scene.takes(option))
}

/// The help of an option: what it is, of which scenes, with its defaults.
fn help(option: &'static str, kind: &Kind, what: &str) -> String {
    let names: Vec<_> = takers(option).map(|scene| scene.name).collect();
    let default = |scene: &Scene| {
        let value = scene.numbers(&[]).get(option);
        match kind {
            Kind::Word(words) => words[value as usize].to_owned(),
            _ => value.to_string(),
        }
    };
    let mut defaults = takers(option).map(|scene| (scene.name, default(scene)));
    let usual = defaults.next().unwrap_or_default().1;
    let others = defaults.filter(|(_, value)| *value != usual);
    let others: String = others.map(|(name, value)| format!(", of {name} {value}")).collect();
    format!("{what} [of {}] [default: {usual}{others}]", names.join(", "))
}

impl clap::Args for Given {
    fn augment_args(command: Command) -> Command {
        let names = SCENES.iter().map(|scene| PossibleValue::new(scene.name).help(scene.about));
        let scene = Arg::new("scene")
            .long("scene")
            .help("The problem")
            .value_name("SCENE")
            .help_heading("Scenes")
            .value_parser(PossibleValuesParser::new(names).map(|name| Scene::of(&name)))
            .default_value(SCENES[0].name);
        OPTIONS.iter().fold(command.arg(scene), |command, (name, kind, what)| {
            let arg = Arg::new(*name)
                .long(*name)
                .help(help(name, kind, what))
                .value_name(if matches!(kind, Kind::Word(_)) { "WORD" } else { "NUMBER" })
                .help_heading("Scenes")
                .allow_hyphen_values(true);
            command.arg(match *kind {
                Kind::Real => arg.value_parser(clap::value_parser!(f64)),
                Kind::Whole(least, most) => {
                    let range = i64::from(least)..=i64::from(most);
                    arg.value_parser(clap::value_parser!(u16).range(range).map(f64::from))
                }
                Kind::Word(words) => {
                    let place = |word: String| words.iter().position(|known| *known == word);
                    arg.value_parser(
                        PossibleValuesParser::new(words)
                            .map(move |word| place(word).unwrap_or_default() as f64),
                    )
                }
            })
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let typed = |option| matches.value_source(option) == Some(ValueSource::CommandLine);
        let scene = *matches.get_one::<&'static Scene>("scene").expect("it has a default");
        let mut given = vec![];
        for (option, ..) in OPTIONS.iter().filter(|(option, ..)| typed(option)) {
            if typed("a") || !scene.takes(option) {
                let of: Vec<_> = takers(option).map(|scene| scene.name).collect();
                let not = if typed("a") { "files" } else { scene.name };
                let of = of.join(", ");
                let message = format!("--{option} is an option of {of}, not of {not}\n");
                return Err(clap::Error::raw(ErrorKind::ArgumentConflict, message));
            }
            given.extend(matches.get_one::<f64>(option).map(|value| (*option, *value)));
        }
        Ok(Self { scene, numbers: scene.numbers(&given) })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        Self::from_arg_matches(matches).map(|given| *self = given)
    }
}

/// An operator of any kind.
pub(crate) enum Operator<T> {
    Rows(Box<dyn Rows<T>>),
    /// By rows that are walked in place: a virtual call for each entry takes as long as the rest of
    /// a sweep.
    Tridiagonal(Vec<[T; 3]>),
}

impl<T: Scalar> Operator<T> {
    fn tridiagonal(of: &impl Rows<T>) -> Self {
        let mut rows = vec![[T::zero(); 3]; of.order()];
        for (i, row) in rows.iter_mut().enumerate() {
            of.visit_row(i, &mut |j, entry| row[j + 1 - i] = entry);
        }
        Self::Tridiagonal(rows)
    }
}

impl<T: Scalar> LinearOperator<T> for Operator<T> {
    fn order(&self) -> usize {
        match self {
            Self::Rows(rows) => rows.order(),
            Self::Tridiagonal(rows) => rows.len(),
        }
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        match self {
            Self::Rows(rows) => rows.apply(x, y),
            Self::Tridiagonal(rows) => {
                for (i, [below, on, above]) in rows.iter().enumerate() {
                    y[i] = *on * x[i];
                    if i > 0 {
                        y[i] += *below * x[i - 1];
                    }
                    if i + 1 < rows.len() {
                        y[i] += *above * x[i + 1];
                    }
                }
            }
        }
    }

    fn as_five_point(&self) -> Option<FivePointView<'_, T>> {
        match self {
            Self::Rows(rows) => rows.as_five_point(),
            Self::Tridiagonal(_) => None,
        }
    }

    fn as_csr(&self) -> Option<Csr<'_, T>> {
        match self {
            Self::Rows(rows) => rows.as_csr(),
            Self::Tridiagonal(_) => None,
        }
    }

    fn try_visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) -> bool {
        self.visit_row(i, visit);
        true
    }
}

impl<T: Scalar> Diagonal<T> for Operator<T> {
    fn diagonal_entry(&self, i: usize) -> T {
        match self {
            Self::Rows(rows) => rows.diagonal_entry(i),
            Self::Tridiagonal(rows) => rows[i][1],
        }
    }
}

impl<T: Scalar> Rows<T> for Operator<T> {
    // Only so are the calls of `visit` those of the sweep.
    #[inline(always)]
    fn visit_row(&self, i: usize, visit: &mut dyn FnMut(usize, T)) {
        match self {
            Self::Rows(rows) => rows.visit_row(i, visit),
            Self::Tridiagonal(rows) => {
                for (k, &entry) in rows[i].iter().enumerate() {
                    if entry != T::zero() {
                        visit(i + k - 1, entry);
                    }
                }
            }
        }
    }
    fn is_dynamic(&self) -> bool {
        matches!(self, Self::Rows(_))
    }

    fn copy_row(&self, i: usize, row: &mut [(usize, T)]) -> usize {
        match self {
            Self::Rows(rows) => rows.copy_row(i, row),
            Self::Tridiagonal(_) => {
                let mut count = 0;
                self.visit_row(i, &mut |j, entry| {
                    row.get_mut(count).into_iter().for_each(|place| *place = (j, entry));
                    count += 1;
                });
                count
            }
        }
    }
}

type Figures<T> = dyn Fn(&[T], &[T]) -> Vec<(&'static str, f64)>;
type Proofs = dyn Fn(&Certificate) -> Vec<(&'static str, [f64; 2])>;
type Next<T> = dyn Fn(usize, &[T], &mut [T]);

/// A problem in one precision.
pub(crate) struct Problem<T> {
    pub(crate) a: Operator<T>,
    pub(crate) b: Operator<T>,
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
}

impl<T: Scalar> Problem<T> {
    /// One problem, of which no more is known.
    pub(crate) fn new(a: impl Rows<T> + 'static, b: impl Rows<T> + 'static, q: Vec<T>) -> Self {
        Self::of(Operator::Rows(Box::new(a)), Operator::Rows(Box::new(b)), q)
    }

    fn of(a: Operator<T>, b: Operator<T>, q: Vec<T>) -> Self {
        let (figures, next) =
            (Box::new(|_: &[T], _: &[T]| vec![]), Box::new(|_, _: &[T], _: &mut [T]| ()));
        let proofs = Box::new(|_: &Certificate| vec![]);
        Self { a, b, q, known: None, figures, proofs, meaning: None, march: (1, next) }
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
        Hlcp::new(&self.a, &self.b, Omega::diagonal_ratio(tau, &self.a, &self.b)?)
    }

    /// The method of this name with its parameters and τ.
    pub(crate) fn solver(
        &self,
        name: &str,
        parameters: Parameters<'_>,
        tau: f64,
    ) -> Result<Solver<T, Boxed<'_, T>>, Box<dyn Error>> {
        Ok(self.solved_by(&Named::parse(name, parameters)?, tau)?)
    }

    /// The method with τ.
    pub(crate) fn solved_by(
        &self,
        method: &Named,
        tau: f64,
    ) -> Result<Solver<T, Boxed<'_, T>>, hlcp_core::Error> {
        let problem = self.hlcp(T::from(tau).unwrap_or_else(T::nan))?;
        Ok(Solver::new(method.on(problem)?))
    }

    /// Whether no row reaches further than to its neighbours.
    pub(crate) fn is_tridiagonal(&self) -> bool {
        self.hlcp(T::one()).is_ok_and(|problem| TridiagonalPart::is_all(&problem))
    }

    /// Ones.
    pub(crate) fn start(&self) -> Vec<T> {
        vec![T::one(); self.q.len()]
    }
}

type Posable<'p, T> = Hlcp<T, &'p Operator<T>, &'p Operator<T>>;
pub(crate) type Boxed<'p, T> = BoxedMethod<'p, T, &'p Operator<T>, &'p Operator<T>>;

/// The value, or nothing where a method is refused for want of a grid.
pub(crate) fn where_it_applies<V>(
    result: Result<V, hlcp_core::Error>,
) -> Result<Option<V>, hlcp_core::Error> {
    match result {
        Err(hlcp_core::Error::NotFivePoint { .. }) => Ok(None),
        result => result.map(Some),
    }
}

type Posing<T> = Result<Problem<T>, hlcp_core::Error>;

fn example1<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    example(true, numbers)
}

fn example2<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    example(false, numbers)
}

fn example<T: Scalar>(symmetric: bool, numbers: &Numbers) -> Posing<T> {
    let (mu, nu) = (numbers.get("mu"), numbers.get("nu"));
    let example = Example { symmetric, m: numbers.size("m"), mu, nu };
    let generic = numbers.get("solution") == 1.0;
    Ok(Problem::planted(if generic { example.pose_generic()? } else { example.pose()? }))
}

fn disc_lcp<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    disc(true, numbers)
}

fn disc_hlcp<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    disc(false, numbers)
}

fn disc<T: Scalar>(lcp: bool, numbers: &Numbers) -> Posing<T> {
    let problem = Problem::planted(Disc { lcp, m: numbers.size("m") }.pose()?);
    Ok(problem.with_proofs("contact", |_| vec![]))
}

fn slider<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let slider = Slider { cells: numbers.size("m") };
    let (a, b, q) = slider.pose::<T>()?;
    let problem = Problem::of(Operator::tridiagonal(&a), Operator::tridiagonal(&b), q);
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
            ("rupture_m", [place(first), place(last)]),
        ]
    }))
}

/// Ends of an interval after a few operations that round.
fn widened([lower, upper]: [f64; 2]) -> [f64; 2] {
    let some = |end: f64| 16.0 * f64::EPSILON * end.abs();
    [lower - some(lower), upper + some(upper)]
}

fn journal_bearing<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let bearing = JournalBearing {
        nx: numbers.size("nx"),
        ny: numbers.size("ny"),
        ecc: numbers.get("ecc"),
        b: numbers.get("b-length"),
    };
    let (a, b, q) = bearing.pose::<T>()?;
    let problem = Problem::new(a, b, q);
    Ok(problem.with_figures(move |z, _| vec![("objective", bearing.objective(z))]))
}

fn obstacle<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let obstacle = Obstacle { m: numbers.size("m") };
    let (a, b, q) = obstacle.pose::<T>()?;
    let problem = Problem::new(a, b, q).with_figures(move |z, _| {
        let [mean, largest] = obstacle.errors(z);
        vec![("discretisation_error_mean", mean), ("discretisation_error_linf", largest)]
    });
    Ok(problem.with_proofs("contact", |_| vec![]))
}

fn bearing2d<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let bearing = Bearing2d {
        nx: numbers.size("nx"),
        ny: numbers.size("ny"),
        ecc: numbers.get("ecc"),
        aspect: numbers.get("aspect"),
        groove: numbers.get("groove").to_radians(),
    };
    let (a, b, q) = bearing.pose::<T>()?;
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
    let zeros = vec![0.0; nx * ny];
    // One row of points has cells of height 1 in the place of 2/(ny + 1).
    let (row, height) = (Bearing2d { ny: 1, ..*bearing }, 2.0 / (ny as f64 + 1.0));
    let (mut point, nothing) = (vec![0.0; nx], vec![0.0; nx]);
    let mut loads = [zeros.clone(), zeros.clone()];
    let mut ends = zeros.clone();
    for i in 0..nx {
        point[i] = 1.0;
        let load = row.load(&point);
        for j in 0..ny {
            loads[0][j * nx + i] = load[0] * height;
            loads[1][j * nx + i] = load[1] * height;
        }
        // It is at both ends there.
        let out = row.flows(&point, &nothing)[2] / 2.0 / height;
        ends[i] += out;
        ends[(ny - 1) * nx + i] += out;
        point[i] = 0.0;
    }
    let base = row.flows(&nothing, &nothing);
    let unit = |at: usize| (0..nx).map(|i| f64::from(i == at)).collect::<Vec<f64>>();
    let (first, last) = (unit(0), unit(nx - 1));
    let drawn = row.flows(&first, &nothing)[0] - base[0];
    let by_pressure = row.flows(&last, &nothing)[1] - base[1];
    let by_void = row.flows(&nothing, &last)[1] - base[1];
    let column = |at: usize, weight: f64| -> Vec<f64> {
        (0..nx * ny).map(|k| if k % nx == at { weight * height } else { 0.0 }).collect()
    };
    let sum = |c_z: &[f64], c_r: &[f64], constant: f64| {
        let [lower, upper] = certificate.functional([c_z, c_r]);
        widened([lower + constant, upper + constant])
    };
    let [along, across] = loads.each_ref().map(|load| sum(load, &zeros, 0.0));
    let corners = [0, 1, 2, 3].map(|k| [along[k % 2], across[k / 2]]);
    let far = corners.map(|[x, y]| x.hypot(y)).into_iter().fold(0.0, f64::max);
    let nearest = |[lower, upper]: [f64; 2]| lower.max(-upper).max(0.0);
    let near = nearest(along).hypot(nearest(across));
    let angles = corners.map(|[x, y]| y.atan2(x).to_degrees());
    let attitude = if along[0] > 0.0 {
        let [lowest, highest] = [f64::min as fn(f64, f64) -> f64, f64::max];
        [angles.into_iter().fold(f64::INFINITY, lowest), angles.into_iter().fold(-180.0, highest)]
    } else {
        [-180.0, 180.0]
    };
    let all = ny as f64 * height;
    vec![
        ("sommerfeld", widened([far, near].map(|load| 1.0 / (3.0 * PI * load)))),
        ("attitude_degrees", widened(attitude)),
        ("flow_drawn", sum(&column(0, drawn), &zeros, all * base[0])),
        (
            "flow_returned",
            sum(&column(nx - 1, by_pressure), &column(nx - 1, by_void), all * base[1]),
        ),
        ("flow_ends", sum(&ends, &zeros, 0.0)),
    ]
}

fn film<T: Scalar>(numbers: &Numbers) -> Posing<T> {
    let cells = ["nx", "ny"].map(|name| numbers.size(name));
    let film = films::slider(cells, numbers.size("dimples"), numbers.get("depth"));
    let (a, b, q) = film.pose()?;
    let of = |operator: &FilmOperator| {
        let view = operator.as_five_point().expect("no side is periodic");
        let row = |i, j| view.coefficients().map(|c| T::of(c.at(j * cells[0] + i)));
        VaryingFivePoint::from_fn(cells[0], cells[1], row)
    };
    let problem = Problem::new(of(&a)?, of(&b)?, q.iter().map(|&q| T::of(q)).collect());
    Ok(problem.with_figures(move |z, r| {
        let wide = |v: &[T]| v.iter().map(|v| v.to_f64().unwrap_or(f64::NAN)).collect::<Vec<_>>();
        let figures = film.figures(&wide(z), &wide(r), 0.0);
        vec![("load_n", figures.load), ("broken_share", figures.broken_share)]
    }))
}

fn american_put<T: Scalar>(numbers: &Numbers) -> Posing<T> {
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
    // Of the last problem, whose q is what the one before left.
    Ok(problem.with_proofs("exercise", move |certificate| {
        let mut z = vec![0.0; certificate.sides.len()];
        let (zeros, base) = (z.clone(), put.price(&z, spot));
        let weight = |j: usize| {
            z[j] = 1.0;
            let price = put.price(&z, spot);
            z[j] = 0.0;
            price - base
        };
        let weights: Vec<f64> = (0..zeros.len()).map(weight).collect();
        let [lower, upper] = certificate.functional([&weights, &zeros]);
        vec![("price", widened([base + lower, base + upper]))]
    }))
}
