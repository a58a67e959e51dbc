//! `hlcp film`: the pressure in a lubricating film of your own, and where it cavitates.

mod balance;
mod gap;
mod motion;
mod picture;
mod plane;
mod profile;
mod report;

use std::{
    fs,
    path::{Path, PathBuf},
    str::FromStr,
};

use clap::{Arg, ArgGroup, Args};
use hlcp::{
    files::{self, printable},
    film::{Oil, Pad, Pocket, Words},
};
use serde_json::{Value, json};

use crate::{Fallible, on_threads, print, say};

const EXAMPLES: &str = "\
Examples:
  hlcp film pad.csv --x-unit mm --h-unit um --p-unit MPa --speed 4.57 --viscosity 0.039
  hlcp film --journal --diameter 0.1 --length 0.1 --clearance 1e-4 --rpm 3000 --viscosity 0.02 --groove 0 --load 5000

A profile along x needs a speed and a viscosity. A film in two dimensions is a map of the gap, a pad
or a journal bearing, over cells: x along the motion, y across it, both from 0 at the south-western
corner. Where it is broken (cavitated) its content (liquid fraction) is below 1, and what flows out at
the ends of a journal is its side leakage. Walls are rigid, shear is laminar, and the oil is
incompressible and keeps the viscosity that is given, however warm it gets. The exit status is 0 if every solve converged, 2 if one did not, and 1 for bad input.";
const FILM: &str = "Film in two dimensions";
const SHAPE: &str = "Texture and supply, in two dimensions";
const UNITS: &str = "Units";
const CONDITIONS: &str = "Conditions";
const ASKED: &str = "Questions, in two dimensions";
const OUTPUT: &str = "Output and method";

/// Compute pressure and cavitation in a lubricating film from its gap
#[derive(Args)]
#[command(after_help = EXAMPLES)]
#[command(mut_args = negatable)]
#[command(group = ArgGroup::new("film").args(["profile", "map", "journal", "pad"]))]
#[command(group = ArgGroup::new("plane").args(["map", "journal", "pad"]).conflicts_with("profile"))]
#[command(group = ArgGroup::new("in_plane").multiple(true).requires("plane").conflicts_with("profile"))]
pub(crate) struct Arguments {
    /// A text file with two columns, x and h [default: a parabolic pad with a known answer]
    #[arg(requires_all = ["speed", "viscosity"])]
    profile: Option<PathBuf>,
    /// The gap in each cell from a CSV or NPY file, rows along y, the first one at y = 0
    #[arg(long, help_heading = FILM, value_name = "FILE", requires_all = ["lx", "ly", "viscosity"])]
    map: Option<PathBuf>,
    /// A journal bearing: x is around it, from the widest gap of --ecc
    #[arg(long, help_heading = FILM)]
    #[arg(requires_all = ["diameter", "length", "clearance", "viscosity"])]
    journal: bool,
    /// A pad: plane,WEST,EAST with the gaps at both sides; taper,WEST,LAND,LENGTH that long from
    /// the west, with a land after it; or parabola,LEAST,RADIUS with the least gap and the radius
    /// of curvature along x, and with ,X the place of the least gap
    #[arg(long, help_heading = FILM, requires_all = ["lx", "ly", "viscosity"])]
    #[arg(value_parser = gap::pad)]
    pad: Option<Pad>,
    /// The extent along x
    #[arg(long, help_heading = FILM, group = "in_plane", value_parser = real(|v| v > 0.0, OF_X))]
    lx: Option<f64>,
    /// The extent along y
    #[arg(long, help_heading = FILM, group = "in_plane", value_parser = real(|v| v > 0.0, OF_X))]
    ly: Option<f64>,
    /// The journal's diameter, in units of --x-unit
    #[arg(long, help_heading = FILM, requires = "journal", value_parser = real(|v| v > 0.0, OF_X))]
    diameter: Option<f64>,
    /// The bearing's length, in units of --x-unit
    #[arg(long, help_heading = FILM, requires = "journal", value_parser = real(|v| v > 0.0, OF_X))]
    length: Option<f64>,
    /// The radial clearance, in units of --h-unit
    #[arg(long, help_heading = FILM, requires = "journal", value_parser = real(|v| v > 0.0, OF_H))]
    clearance: Option<f64>,
    /// A bush of lobes, elliptical (lemon bore), of three or four, or offset halves: COUNT arcs
    /// with the radius of --clearance; PRELOAD, how far their centres are from the middle, over the
    /// clearance; where each is narrowest, from 0 where it begins to 1 where it ends [default:
    /// 0.5]; and the middle of one of them, in degrees from x = 0 [default: 0]
    #[arg(long, help_heading = FILM, value_name = "COUNT,PRELOAD[,OFFSET[,DEGREES]]")]
    #[arg(requires = "journal")]
    lobes: Option<Numbers>,
    /// The eccentricity over the clearance, with --load where the search begins [default there:
    /// 0.5, with lobes or --tilt of what these leave]
    #[arg(long, help_heading = FILM, requires = "journal", value_parser = real(|_| true, ANY))]
    ecc: Option<f64>,
    /// The place of x = 0, from where grooves are counted: so many degrees from the place opposite
    /// the load, in the direction of the motion, so that grooves keep their places under --load;
    /// without it x = 0 is the widest gap, and grooves turn with that
    #[arg(long, help_heading = FILM, requires = "journal", value_parser = real(|_| true, ANY))]
    attitude: Option<f64>,
    /// Slopes: of a pad what the gap gains along x and along y; of a journal how its eccentricity
    /// grows along y, along x = 0 and a quarter further (misalignment)
    #[arg(long, help_heading = FILM, value_name = "A,B", group = "in_plane")]
    tilt: Option<Numbers>,
    /// Cells along x [default: 180; of a journal 360]
    #[arg(long, help_heading = FILM, group = "in_plane", conflicts_with = "map")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..))]
    nx: Option<u32>,
    /// Cells along y [default: 60]
    #[arg(long, help_heading = FILM, group = "in_plane", conflicts_with = "map")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..))]
    ny: Option<u32>,
    /// A pocket x,y,lx,ly,depth from its south-western corner; with ,ellipse the ellipse in there
    #[arg(long, help_heading = SHAPE, value_name = "POCKET", group = "in_plane")]
    #[arg(value_parser = gap::pocket)]
    pocket: Vec<Pocket>,
    /// An even array of so many dimples along x and y, kx,ky,lx,ly,depth; with ,ellipse ellipses
    #[arg(long, help_heading = SHAPE, value_name = "ARRAY", group = "in_plane")]
    #[arg(value_parser = gap::dimples)]
    dimples: Vec<gap::Dimples>,
    /// A CSV or NPY file that is added to the gap
    #[arg(long, help_heading = SHAPE, value_name = "FILE", group = "in_plane")]
    roughness: Option<PathBuf>,
    /// A pocket that is kept full, x,y,lx,ly,pressure: the cells whose middles lie in it
    #[arg(long, help_heading = SHAPE, value_name = "SUPPLY", group = "in_plane")]
    supply: Vec<Numbers>,
    /// An axial groove, in degrees from x = 0, with its pressure [default: that of --ambient], its
    /// width in degrees [default: none] and its length, in units of --x-unit [default: that of the
    /// bearing, closed at its ends]: the cells whose middles lie in it, or without a width the
    /// nearest face between two columns
    #[arg(long, help_heading = SHAPE, value_name = "DEGREES[,PRESSURE[,WIDTH[,LENGTH]]]")]
    #[arg(requires = "journal")]
    groove: Vec<Numbers>,
    /// A pressure dam: a pocket FROM,TO,LENGTH,DEPTH in the middle of the bearing, from one angle
    /// to another in degrees in the direction of x, which ends in a step
    #[arg(long, help_heading = SHAPE, value_name = "DAM", requires = "journal")]
    dam: Vec<Numbers>,
    /// A side: west, east, south or north = a pressure, closed, periodic, or starved with ,CONTENT
    /// between 0 and 1, as in west=starved,0.4 (starvation) [default: --ambient; around a journal
    /// periodic]
    #[arg(long, help_heading = CONDITIONS, value_name = "SIDE=WHAT", group = "in_plane")]
    #[arg(value_parser = gap::sided)]
    side: Vec<gap::Sided>,
    /// The unit of x, y and their extents: nm, um, mm, m or km, or so many metres, as 0.0254
    #[arg(long, help_heading = UNITS, default_value = "m", requires = "film")]
    #[arg(value_parser = named_unit("m", "mm, or in metres, e.g. 0.0254"))]
    x_unit: f64,
    /// The unit of gaps, depths and heights: as for x, or so many metres, as 1e-6
    #[arg(long, help_heading = UNITS, default_value = "m", requires = "film")]
    #[arg(value_parser = named_unit("m", "um, or in metres, e.g. 1e-6"))]
    h_unit: f64,
    /// The unit of pressures: Pa, kPa, MPa or GPa, or so many pascals, as 1e5
    #[arg(long, help_heading = UNITS, default_value = "Pa", requires = "film")]
    #[arg(value_parser = named_unit("Pa", "MPa, or in pascals, e.g. 1e5"))]
    p_unit: f64,
    /// The speed of the lower wall along x in m/s; in two dimensions also LOWER,UPPER, under which
    /// the gap stays as it is given
    #[arg(long, help_heading = CONDITIONS, requires = "film", value_parser = speeds)]
    speed: Option<Numbers>,
    /// The journal's speed in turns per minute
    #[arg(long, help_heading = CONDITIONS, requires = "film", conflicts_with = "speed")]
    #[arg(value_parser = real(|_| true, ANY))]
    rpm: Option<f64>,
    /// The viscosity in Pa s; in two dimensions also a CSV or NPY file with one for each cell
    #[arg(long, help_heading = CONDITIONS, requires = "film", value_parser = viscosity)]
    viscosity: Option<Viscosity>,
    /// The pressure around the film, in units of --p-unit
    #[arg(long, help_heading = CONDITIONS, default_value_t = 0.0, requires = "film")]
    #[arg(value_parser = real(|_| true, ANY))]
    ambient: f64,
    /// The pressure at which the film cavitates, in units of --p-unit
    #[arg(long, help_heading = CONDITIONS, default_value_t = 0.0, requires = "film")]
    #[arg(value_parser = real(|_| true, ANY))]
    cavitation: f64,
    /// The density of the oil in kg/m³ and its specific heat in J/(kg K), for the Reynolds number
    /// and for how warm it gets [default: 870,1950]
    #[arg(long, help_heading = CONDITIONS, value_name = "DENSITY,HEAT", group = "in_plane")]
    #[arg(value_parser = oil)]
    oil: Option<Oil>,
    /// Find the position that carries this load in N: the eccentricity and attitude of a journal,
    /// the height of anything else, and with LOAD,X,Y also its slopes, so that the load acts at
    /// this place, in units of --x-unit; with --motion and --mass the motion begins there
    #[arg(long, help_heading = ASKED, value_name = "LOAD[,X,Y]", group = "in_plane")]
    load: Option<Numbers>,
    /// Stiffness and damping for slow motions, mass-conserving and by the clamp of the tables: of a
    /// journal along the load and across it, of anything else for the height and the slopes along x
    /// and y
    #[arg(long, help_heading = ASKED, group = "in_plane")]
    coefficients: bool,
    /// Stiffness and damping, mass-conserving, for motions at these frequencies over the running
    /// speed; and of a journal the mass on this bearing above which it whirls by itself (critical
    /// mass), and how fast over the running speed (whirl frequency ratio)
    #[arg(long, help_heading = ASKED, value_name = "RATIO[,RATIO...]", group = "in_plane")]
    whirl: Option<Numbers>,
    /// Derivatives of load, friction, power, peak and flows by speed, viscosity, clearance,
    /// pressures and depths, in SI units: in this position, or with --load under this load, which
    /// the position then follows
    #[arg(long, help_heading = ASKED, group = "in_plane")]
    sensitivities: bool,
    /// Steps in time from a CSV file: the time in s and the position in units of --h-unit, of a
    /// journal its displacement along the load and across it, of anything else its rise, and its
    /// slopes along x and y, which have no unit
    #[arg(long, help_heading = ASKED, value_name = "FILE", group = "in_plane")]
    #[arg(conflicts_with_all = ["coefficients", "whirl", "sensitivities"])]
    motion: Option<PathBuf>,
    /// Let the wall move freely, with this mass in kg, or 0: --motion then has the time and the
    /// load in N, of a journal in its direction and across it; slopes stay
    #[arg(long, help_heading = ASKED, group = "in_plane")]
    #[arg(value_parser = real(|v| v >= 0.0, OF_MASS))]
    mass: Option<f64>,
    /// How many pieces each stretch between two points is cut into [default: none longer than 1/400
    /// of the film]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..), conflicts_with = "plane")]
    refine: Option<u16>,
    /// Any method of `hlcp solve` that needs no parameters [default: AMG]
    #[arg(long, help_heading = OUTPUT, group = "in_plane")]
    method: Option<String>,
    /// How many threads share the sweeps
    #[arg(long, help_heading = OUTPUT, group = "in_plane")]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Prove bounds on the load, the peak and the flows of the equations on these cells, and that
    /// there is no other solution where that can be proved
    #[arg(long, help_heading = OUTPUT, group = "in_plane")]
    certify: bool,
    /// Prove the range of load, friction, flows and peak, on these cells, over all films whose gap,
    /// viscosity, speeds and supplies' pressures are these, each as a whole times a factor that is
    /// so far from 1 at most, e.g. 1e-3
    #[arg(long, help_heading = OUTPUT, value_name = "PART", group = "in_plane")]
    #[arg(conflicts_with = "motion", value_parser = real(|v| (0.0..=0.5).contains(&v), OF_PART))]
    data_tolerance: Option<f64>,
    /// Print one JSON object, in SI units, with a list `warnings`
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
    /// Where the picture and the numbers go: this name with .svg and .csv, in your units; in two
    /// dimensions with .svg, and with -pressure, in Pa, and -content before .csv and .npy, one row
    /// for each row of cells. Regular files that exist are replaced; refused are symbolic links,
    /// devices and the like, and the files that are read
    #[arg(long, help_heading = OUTPUT, default_value = "target/film")]
    out: PathBuf,
}

/// What a film comes to.
struct Done {
    /// The files that are written, and their texts.
    outputs: Vec<PathBuf>,
    texts: Vec<Vec<u8>>,
    json: Value,
    report: String,
    warnings: Vec<String>,
    converged: bool,
}

/// Solves for the film that was given, writes its files and prints its figures; whether all of it
/// converged.
pub(crate) fn run(mut arguments: Arguments) -> Fallible<bool> {
    if arguments.rpm.is_some() && !arguments.journal {
        return Err("--rpm is of a --journal; anything else takes --speed, in m/s".into());
    }
    if arguments.mass.is_some() && arguments.motion.is_none() {
        return Err("--mass lets the wall move under the loads of --motion, which is missing; --load finds where it rests".into());
    }
    if arguments.load.is_some() && arguments.motion.is_some() && arguments.mass.is_none() {
        return Err("--load is where a free motion begins, but --motion says where the wall is at every time; leave --load out, or let the wall move freely by --mass".into());
    }
    if arguments.ecc.is_some() && arguments.motion.is_some() && arguments.mass.is_none() {
        return Err("--ecc is where a journal is, but --motion says that at every time; leave --ecc out, or let the journal move freely by --mass".into());
    }
    let asks = arguments.load.is_some() || arguments.motion.is_some();
    if arguments.attitude.is_some() && !asks {
        return Err(
            "--attitude turns x = 0 with the load of --load or --motion; without them leave it out"
                .into(),
        );
    }
    let is_plane = arguments.map.is_some() || arguments.journal || arguments.pad.is_some();
    let mut done = if is_plane {
        on_threads(arguments.threads.unwrap_or(1), || plane::solve(&arguments))?
    } else {
        profile::solve(&mut arguments)?
    };
    // Before anything is printed, because a reader that goes away ends the program.
    let paths = done.outputs.iter().map(PathBuf::as_path);
    let pairs: Vec<(&Path, Vec<u8>)> = paths.zip(done.texts).collect();
    files::write_together(&pairs, |text, file| file.write_all(text))?;
    if arguments.json {
        done.json["warnings"] = json!(done.warnings);
        print::line(done.json)?;
    } else {
        let names: Vec<String> =
            done.outputs.iter().map(|path| printable(path.display())).collect();
        print::line(format_args!("{}wrote {}", done.report, names.join(", ")))?;
    }
    done.warnings.iter().for_each(|text| say(format!("warning: {text}")));
    Ok(done.converged)
}

/// The files that are written, in folders that exist and other than those that are read.
fn outputs(arguments: &Arguments, ends: &[&str]) -> Fallible<Vec<PathBuf>> {
    let with = |end: &&str| {
        let mut name = arguments.out.clone();
        name.as_mut_os_string().push(end);
        name
    };
    let outputs: Vec<PathBuf> = ends.iter().map(with).collect();
    let viscosity = match &arguments.viscosity {
        Some(Viscosity::Map(path)) => Some(path),
        _ => None,
    };
    let inputs = [
        ("the profile", arguments.profile.as_ref()),
        ("the file of --map", arguments.map.as_ref()),
        ("the file of --roughness", arguments.roughness.as_ref()),
        ("the file of --viscosity", viscosity),
        ("the file of --motion", arguments.motion.as_ref()),
    ];
    for (what, input) in inputs {
        let is_input = |output: &&PathBuf| input.is_some_and(|file| files::same_file(output, file));
        if let Some(output) = outputs.iter().find(is_input) {
            let output = printable(output.display());
            return Err(format!("--out would overwrite {what}, {output}; give another name").into());
        }
    }
    if let Some(folder) = outputs[0].parent() {
        fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", printable(folder.display())))?;
    }
    outputs.iter().try_for_each(|path| files::check_output(path))?;
    Ok(outputs)
}

/// The options that warnings name.
const NAMED: Words = Words {
    lengths: "--h-unit and --x-unit name the units of lengths, e.g. --h-unit um --x-unit mm",
    viscosity: "--viscosity",
    speed: "--speed",
    groove: "--groove 0,2e5",
    ambient: "--ambient 101325 where oil surrounds it",
    side: "--side south=101325",
    supplies: "--supply (pressures in units of --p-unit)",
};

/// Numbers with commas between them.
#[derive(Clone)]
struct Numbers(Vec<f64>);

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |word: &str| match word.trim().parse() {
            Ok(number) if f64::is_finite(number) => Ok(number),
            _ => Err(format!(
                "'{word}' is not a number; units are given by their own options, e.g. --h-unit"
            )),
        };
        text.split(',').map(number).collect::<Result<_, _>>().map(Self)
    }
}

impl Numbers {
    /// So many numbers, or an error that names the option and what it takes.
    fn exactly<const N: usize>(&self, option: &str, wanted: &str) -> Result<[f64; N], String> {
        self.filled(option, wanted, &[])
    }

    /// The same, of which the last ones may be missing, and are the usual ones then.
    fn filled<const N: usize>(
        &self,
        option: &str,
        wanted: &str,
        usual: &[f64],
    ) -> Result<[f64; N], String> {
        let found = self.0.len();
        let rest = (found + usual.len()).checked_sub(N).and_then(|from| usual.get(from..));
        let all = [&self.0[..], rest.unwrap_or_default()].concat();
        all.try_into().map_err(|_| format!("--{option} has {found} numbers, but it takes {wanted}"))
    }
}

const SPEED: &str = "in m/s without the unit, e.g. 2 for 7.2 km/h";

fn speeds(text: &str) -> Result<Numbers, String> {
    let numbers: Numbers = text.parse().map_err(|_| format!("not a number; {SPEED}"))?;
    if numbers.0.len() <= 2 { Ok(numbers) } else { Err("there are two walls".into()) }
}

/// One for all cells, or a file.
#[derive(Clone)]
enum Viscosity {
    Uniform(f64),
    Map(PathBuf),
}

const OF_X: &str = "not a positive number; in units of --x-unit";
const OF_H: &str = "not a positive number; in units of --h-unit";
const OF_MASS: &str = "not a number of kilogrammes, 0 or more";
const OF_PART: &str = "not a part between 0 and 0.5; 1e-3 is a thousandth";
const ANY: &str = "not a finite number";

/// A parser of finite numbers that answers what is not sound with what is wanted.
fn real(
    is_sound: fn(f64) -> bool,
    wanted: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync {
    let is_sound = move |v: &f64| v.is_finite() && is_sound(*v);
    move |text| text.parse().ok().filter(is_sound).ok_or_else(|| wanted.into())
}

/// The options whose values do not begin with a hyphen.
const WORDS: &str = "profile map pad nx ny roughness side motion method threads out";

/// Lets the values of all other options be negative.
fn negatable(arg: Arg) -> Arg {
    let is_word = WORDS.split(' ').any(|word| arg.get_id() == word);
    let is_number = arg.get_action().takes_values() && !is_word;
    arg.allow_hyphen_values(is_number)
}

fn oil(text: &str) -> Result<Oil, String> {
    match text.parse().map(|Numbers(numbers)| numbers).as_deref() {
        Ok(&[density, heat]) if density > 0.0 && heat > 0.0 => Ok(Oil { density, heat }),
        _ => Err("not two positive numbers, in kg/m³ and J/(kg K), e.g. 870,1950".into()),
    }
}

fn viscosity(text: &str) -> Result<Viscosity, String> {
    match text.parse() {
        Ok(value) if value > 0.0 && f64::is_finite(value) => Ok(Viscosity::Uniform(value)),
        Ok(_) => Err("not a positive number; in Pa s, e.g. 0.039".into()),
        Err(_) if text.parse().is_ok_and(|Numbers(parts)| parts.len() == 2) => {
            let point = "two numbers with a comma between them; write decimals with a point";
            Err(format!("{point}, in Pa s, e.g. 0.039"))
        }
        Err(_) => Ok(Viscosity::Map(text.into())),
    }
}

impl Arguments {
    fn of_profile(&self) -> Result<Option<[f64; 2]>, String> {
        let (Some(Numbers(speeds)), Some(viscosity)) = (&self.speed, &self.viscosity) else {
            return Ok(None);
        };
        match (&speeds[..], viscosity) {
            (&[speed], &Viscosity::Uniform(viscosity)) if speed > 0.0 => {
                Ok(Some([speed, viscosity]))
            }
            (&[speed], Viscosity::Map(path)) if speed > 0.0 => Err(format!(
                "invalid value '{}' for '--viscosity <VISCOSITY>': not a positive number; in Pa s, \
                 e.g. 0.039",
                path.display()
            )),
            _ => {
                let text = speeds.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
                Err(format!(
                    "invalid value '{text}' for '--speed <SPEED>': not a positive number; {SPEED}; if the plane moves against x, turn the profile round"
                ))
            }
        }
    }
}

/// The prefixes of units that have a name; µ may be typed as u.
const PREFIXES: [(f64, &str); 8] = [
    (1.0, ""),
    (1e-3, "m"),
    // The micro sign, and the Greek letter.
    (1e-6, "\u{b5}"),
    (1e-6, "\u{3bc}"),
    (1e-9, "n"),
    (1e3, "k"),
    (1e6, "M"),
    (1e9, "G"),
];

/// A parser of units: a prefix with the name of the base, or a positive number.
fn named_unit(
    base: &'static str,
    wanted: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync {
    move |text| {
        let prefix = text.strip_suffix(base).map(|prefix| if prefix == "u" { "µ" } else { prefix });
        let named = PREFIXES.iter().find(|(_, known)| Some(*known) == prefix);
        let number = || text.parse().ok().filter(|&value: &f64| value > 0.0 && value.is_finite());
        let value = named.map(|(value, _)| *value).or_else(number);
        value.ok_or_else(|| format!("neither a unit nor a positive number; {wanted}"))
    }
}

/// A unit that is `value` of a `base`, as it stands behind a number.
fn unit(value: f64, base: &str) -> String {
    match PREFIXES.iter().find(|(prefix, _)| *prefix == value) {
        Some((_, prefix)) => format!("{prefix}{base}"),
        None => format!("× {value:e} {base}"),
    }
}
