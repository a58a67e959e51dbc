//! The table of scenes: a new one is a row here and its file in `hlcp-verify`.

mod files;
mod problem;

use std::ops::Range;

use clap::{
    Arg, ArgMatches, Command, FromArgMatches,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
    error::ErrorKind,
    parser::ValueSource,
};
use hlcp_core::{Norms, Scalar};
use hlcp_methods::{Limits, Tolerance};

use self::problem::{
    american_put, bearing2d, dam, disc, example, film, journal_bearing, membrane, obstacle, slider,
};
pub(crate) use self::{
    files::Files,
    problem::{Boxed, Posable, Posing, Problem, Watch, textured},
};

/// A kind of problem, defined by a few numbers.
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    about: &'static str,
    /// The grid of a scene whose columns can be posed apart.
    pub(crate) grid: fn(&Numbers) -> Option<[usize; 2]>,
    /// The options that define it, and their defaults.
    numbers: &'static [(&'static str, f64)],
    /// The tolerance where none is given.
    tolerance: Tolerance,
    pub(crate) wide: Pose<f64>,
    pub(crate) narrow: Pose<f32>,
    /// What the comparison solves over a ladder of grids.
    pub(crate) ladders: &'static [Ladder],
}

pub(crate) type Pose<T> = fn(&Numbers) -> Posing<T>;

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

/// A scene that is posed in one piece.
fn line(_: &Numbers) -> Option<[usize; 2]> {
    None
}

fn square(numbers: &Numbers) -> Option<[usize; 2]> {
    Some([numbers.size("m"); 2])
}

/// A square whose nodes are counted with those of the boundary.
fn inner(numbers: &Numbers) -> Option<[usize; 2]> {
    Some([numbers.size("m").saturating_sub(2); 2])
}

fn oblong(numbers: &Numbers) -> Option<[usize; 2]> {
    Some(["nx", "ny"].map(|side| numbers.size(side)))
}

const ABSOLUTE: Tolerance = Tolerance::Absolute(1e-10);
const RELATIVE: Tolerance = Tolerance::Relative(1e-10);

#[rustfmt::skip] // a table
pub(crate) static SCENES: &[Scene] = &[
    Scene { name: "example1", tolerance: ABSOLUTE, grid: square, wide: example::<_, true>, narrow: example::<_, true>,
        about: "The paper's Example 1",
        numbers: &[("m", 512.0), ("mu", 4.0), ("nu", 4.0), ("solution", 0.0)],
        ladders: &[
            Ladder { title: "example1 (4, 4)", size: "m × m points",
                numbers: |m| vec![("m", m)], amsor: |_| [1.0, 1.0] },
            Ladder { title: "example1 (0, 0)", size: "m × m points",
                numbers: |m| vec![("m", m), ("mu", 0.0), ("nu", 0.0)], amsor: |_| [1.2, 1.0] },
        ] },
    Scene { name: "example2", tolerance: ABSOLUTE, grid: square, wide: example::<_, false>, narrow: example::<_, false>,
        about: "The paper's Example 2",
        numbers: &[("m", 512.0), ("mu", 4.0), ("nu", 4.0), ("solution", 0.0)],
        ladders: &[
            Ladder { title: "example2 (4, 4)", size: "m × m points",
                numbers: |m| vec![("m", m)], amsor: |_| [1.0, 1.0] },
            Ladder { title: "example2 (0, 0)", size: "m × m points",
                numbers: |m| vec![("m", m), ("mu", 0.0), ("nu", 0.0)], amsor: |_| [1.1, 1.0] },
        ] },
    Scene { name: "disc-lcp", tolerance: ABSOLUTE, grid: square, wide: disc::<_, true>, narrow: disc::<_, true>,
        about: "A contact in a disc, as a linear complementarity problem",
        numbers: &[("m", 512.0)],
        ladders: &[Ladder { title: "disc-lcp", size: "m × m points",
            numbers: |m| vec![("m", m)], amsor: |m| [2.0 - 8.0 / m, 1.0] }] },
    Scene { name: "disc-hlcp", tolerance: ABSOLUTE, grid: square, wide: disc::<_, false>, narrow: disc::<_, false>,
        about: "A contact in a disc with a second operator on r",
        numbers: &[("m", 512.0)],
        ladders: &[Ladder { title: "disc-hlcp", size: "m × m points",
            numbers: |m| vec![("m", m)], amsor: |m| [2.0 - 8.0 / m, 1.0] }] },
    Scene { name: "journal-bearing", tolerance: ABSOLUTE, grid: oblong, wide: journal_bearing, narrow: journal_bearing,
        about: "The pressure in a journal bearing, cut off at zero",
        numbers: &[("nx", 50.0), ("ny", 50.0), ("ecc", 0.1), ("b-length", 10.0)],
        ladders: &[Ladder { title: "journal-bearing", size: "m × m points, ε = 0.1, b = 10",
            numbers: |m| vec![("nx", m), ("ny", m)], amsor: |m| [2.0 - 11.0 / m, 1.0] }] },
    Scene { name: "obstacle", tolerance: ABSOLUTE, grid: inner, wide: obstacle, narrow: obstacle,
        about: "A membrane over a dome",
        numbers: &[("m", 65.0)],
        ladders: &[Ladder { title: "obstacle", size: "m × m inner nodes",
            numbers: |m| vec![("m", m + 2.0)], amsor: |m| [2.0 - 12.0 / m, 1.0] }] },
    Scene { name: "spiral", tolerance: ABSOLUTE, grid: square, wide: membrane::<_, true>, narrow: membrane::<_, true>,
        about: "A membrane on a spiral",
        numbers: &[("m", 255.0)],
        ladders: &[Ladder { title: "spiral", size: "m × m inner nodes",
            numbers: |m| vec![("m", m)], amsor: |m| [2.0 - 12.0 / (m + 2.0), 1.0] }] },
    Scene { name: "bessel", tolerance: ABSOLUTE, grid: square, wide: membrane::<_, false>, narrow: membrane::<_, false>,
        about: "A membrane pressed against a product of Bessel's functions",
        numbers: &[("m", 255.0)],
        ladders: &[Ladder { title: "bessel", size: "m × m inner nodes",
            numbers: |m| vec![("m", m)], amsor: |m| [2.0 - 18.0 / (m + 10.0), 1.0] }] },
    Scene { name: "bearing2d", tolerance: ABSOLUTE, grid: oblong, wide: bearing2d, narrow: bearing2d,
        about: "A journal bearing with mass-conserving cavitation",
        numbers: &[("nx", 127.0), ("ny", 63.0), ("ecc", 0.6), ("aspect", 1.0), ("groove", 0.0)],
        ladders: &[Ladder { title: "bearing2d", size: "m × (m − 1)/2 points, ε = 0.6, L/D = 1, groove at the widest gap",
            numbers: |m| vec![("nx", m), ("ny", ((m - 1.0) / 2.0).floor())], amsor: |_| [1.4, 0.5] }] },
    Scene { name: "film", tolerance: RELATIVE, grid: oblong, wide: film, narrow: film,
        about: "A slider with square dimples and mass-conserving cavitation",
        numbers: &[("nx", 127.0), ("ny", 127.0), ("dimples", 4.0), ("depth", 2.0)],
        ladders: &[] },
    Scene { name: "dam", tolerance: RELATIVE, grid: oblong, wide: dam, narrow: dam,
        about: "Seepage through a dam of earth",
        numbers: &[("nx", 63.0), ("ny", 64.0), ("length", 1.0), ("tail", 0.5), ("layer", 1.0)],
        ladders: &[Ladder { title: "dam", size: "m × (m + 1) cells, L = 1, tailwater ½",
            numbers: |m| vec![("nx", m), ("ny", m + 1.0)], amsor: |_| [1.4, 0.5] }] },
    Scene { name: "slider", tolerance: RELATIVE, grid: line, wide: slider, narrow: slider,
        about: "A slider with cavitation in the place of the paper's Example 3",
        numbers: &[("m", 512.0)],
        ladders: &[Ladder { title: "slider", size: "m + 1 cells, n = m",
            numbers: |m| vec![("m", m + 1.0)], amsor: |_| [1.4, 0.5] }] },
    Scene { name: "american-put", tolerance: ABSOLUTE, grid: line, wide: american_put, narrow: american_put,
        about: "An American put, one problem per time step",
        numbers: &[("m", 64.0), ("steps", 64.0), ("rate", 0.06), ("volatility", 0.2), ("maturity", 1.0), ("spot", 0.9)],
        ladders: &[Ladder { title: "american-put", size: "m points to a standard deviation, n ≈ 7.8 m, 66 LCPs one after another",
            numbers: |m| vec![("m", m)], amsor: |m| [2.0 - 24.0 / (m + 18.0), 1.0] }] },
];

/// What an option of scenes may be.
enum Kind {
    Real,
    Whole(u16, u16),
    /// One of some words, which stand for 0, 1, …
    Word(&'static [&'static str]),
}

/// The options that define scenes: name, kind and help.
#[rustfmt::skip] // a table
const OPTIONS: &[(&str, Kind, &str)] = &[
    ("m", Kind::Whole(1, 32768),
        "Grid points per side, the order being m²; the slider's cells, the order being m − 1; the \
         obstacle's nodes per side with the boundary's; the put's points per standard deviation"),
    ("mu", Kind::Real, "The multiple of the identity in A"),
    ("nu", Kind::Real, "The multiple of the identity in B"),
    ("solution", Kind::Word(&["default", "generic"]),
        "The planted 0, 1, 0, 1, … or generic numbers in the same pattern"),
    ("nx", Kind::Whole(1, 32768),
        "Inner grid points around the bearing; the film's cells along x; the dam's columns"),
    ("ny", Kind::Whole(1, 32768),
        "Inner grid points along the bearing; the film's cells along y; the dam's rows"),
    ("dimples", Kind::Whole(0, 32768), "Dimples along x, and as many for the same length along y"),
    ("depth", Kind::Real, "The depth of the dimples over the least gap"),
    ("ecc", Kind::Real, "The eccentricity"),
    ("b-length", Kind::Real, "Half the length over the radius"),
    ("aspect", Kind::Real, "The length over the diameter"),
    ("groove", Kind::Real, "The place of the feed groove, in degrees from the widest gap"),
    ("length", Kind::Real, "The length of the base over the depth of the water upstream"),
    ("tail", Kind::Real, "The depth of the tailwater over that of the water upstream"),
    ("layer", Kind::Real, "The conductivity of the lower half over that of the upper half"),
    ("rate", Kind::Real, "The interest rate per year"),
    ("volatility", Kind::Real, "The volatility per square root of a year"),
    ("maturity", Kind::Real, "The time to maturity, in years"),
    ("spot", Kind::Real, "The spot price over the strike"),
    ("steps", Kind::Whole(0, u16::MAX), "Time steps"),
];

#[derive(Clone)]
pub(crate) struct Numbers {
    given: Vec<(&'static str, f64)>,
    /// The columns of the grid that are posed, where ranks have some each.
    columns: Option<Range<usize>>,
}

impl Numbers {
    /// The number of an option that the scene has.
    pub(crate) fn get(&self, name: &str) -> f64 {
        let number = self.given.iter().find(|(known, _)| *known == name);
        number.unwrap_or_else(|| panic!("the scene has no option {name}")).1
    }

    /// The first of them, which says how large the scene is.
    pub(crate) fn first(&self) -> f64 {
        self.given[0].1
    }

    /// All of them, as they are typed.
    pub(crate) fn typed(&self) -> Vec<(&'static str, String)> {
        let word = |&(name, value): &(&'static str, f64)| {
            let kind = OPTIONS.iter().find(|(known, ..)| *known == name).map(|(_, kind, _)| kind);
            let typed = match kind {
                Some(Kind::Word(words)) => words[value as usize].to_owned(),
                _ => value.to_string(),
            };
            (name, typed)
        };
        self.given.iter().map(word).collect()
    }

    fn size(&self, name: &str) -> usize {
        self.get(name) as usize
    }

    /// The same scene, of which these columns are posed.
    pub(crate) fn of_columns(&self, columns: Range<usize>) -> Self {
        Self { columns: Some(columns), ..self.clone() }
    }

    /// The columns that are posed, of `nx`.
    fn columns(&self, nx: usize) -> Range<usize> {
        self.columns.clone().unwrap_or(0..nx)
    }
}

impl Scene {
    pub(crate) fn of(name: &str) -> &'static Self {
        let scene = SCENES.iter().find(|scene| scene.name == name);
        scene.unwrap_or_else(|| panic!("there is no scene {name}"))
    }

    /// The scene's numbers: its defaults, apart from those given.
    pub(crate) fn numbers(&self, given: &[(&'static str, f64)]) -> Numbers {
        let mut numbers = Numbers { given: self.numbers.to_vec(), columns: None };
        for &(name, value) in given {
            let number = numbers.given.iter_mut().find(|(known, _)| *known == name);
            number.unwrap_or_else(|| panic!("{} has no option {name}", self.name)).1 = value;
        }
        numbers
    }

    /// The scene in double precision, with numbers that differ from its defaults.
    pub(crate) fn pose(&self, given: &[(&'static str, f64)]) -> Posing<f64> {
        (self.wide)(&self.numbers(given))
    }

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
pub(crate) fn distance<T: Scalar>(found: [&[T]; 2], solution: &[Vec<T>; 2]) -> f64 {
    let pairs = found.into_iter().zip(solution).flat_map(|(found, known)| found.iter().zip(known));
    let differences: Vec<T> = pairs.map(|(&found, &known)| found - known).collect();
    Norms::of(&differences).linf
}

/// The value, or nothing where a method is refused for want of a grid.
pub(crate) fn where_it_applies<V>(
    result: Result<V, hlcp_core::Error>,
) -> Result<Option<V>, hlcp_core::Error> {
    match result {
        Err(hlcp_core::Error::NotFivePoint { .. }) => Ok(None),
        result => result.map(Some),
    }
}

/// The scene of a command line, with its numbers.
#[derive(Clone)]
pub(crate) struct Given {
    pub(crate) scene: &'static Scene,
    pub(crate) numbers: Numbers,
    /// Whether the scene or one of its numbers was typed.
    pub(crate) is_asked: bool,
}

fn takers(option: &str) -> impl Iterator<Item = &'static Scene> {
    SCENES.iter().filter(move |scene| scene.takes(option))
}

/// The help of an option: what it is, of which scenes, with its defaults.
fn help(option: &'static str, what: &str) -> String {
    let names: Vec<_> = takers(option).map(|scene| scene.name).collect();
    let default = |scene: &Scene| {
        let typed = scene.numbers(&[]).typed();
        typed.into_iter().find(|(name, _)| *name == option).unwrap_or_default().1
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
                .help(help(name, what))
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
        // Not every command has files.
        let typed = |option: &str| {
            matches.ids().any(|id| id == option)
                && matches.value_source(option) == Some(ValueSource::CommandLine)
        };
        let scene = *matches.get_one::<&'static Scene>("scene").expect("it has a default");
        let mut given = vec![];
        for (option, ..) in OPTIONS.iter().filter(|(option, ..)| typed(option)) {
            if typed("a") || !scene.takes(option) {
                let of: Vec<_> = takers(option).map(|scene| scene.name).collect();
                let of = of.join(", ");
                let not = if typed("a") {
                    "files".to_owned()
                } else {
                    let own = scene.numbers.iter().map(|(own, _)| format!(" --{own}"));
                    let own: String = own.collect();
                    format!("{}, which takes{own}", scene.name)
                };
                let message = format!("--{option} is an option of {of}, not of {not}\n");
                return Err(clap::Error::raw(ErrorKind::ArgumentConflict, message));
            }
            given.extend(matches.get_one::<f64>(option).map(|value| (*option, *value)));
        }
        let is_asked = typed("scene") || !given.is_empty();
        Ok(Self { scene, numbers: scene.numbers(&given), is_asked })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        Self::from_arg_matches(matches).map(|given| *self = given)
    }
}
