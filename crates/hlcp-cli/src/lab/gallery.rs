//! `hlcp gallery`: pictures of the scenes' solutions.
//!
//! Solves each scene on a modest grid by TMGS and writes `gallery-NAME.svg`, with the data drawn in
//! `gallery-NAME.csv` beside it. Ends with an error if a solve does not converge.

use std::{
    f64::consts::TAU,
    path::{Path, PathBuf},
};

use clap::Args;
use hlcp_methods::{Limits, Options};
use hlcp_verify::{AmericanPut, Obstacle, Slider};

use super::{
    run::{Run, solve},
    table::Table,
};
use crate::{
    Fallible,
    chart::{COLOURS, Panel, provenance, write},
    print,
    scenes::Scene,
};

const EXAMPLES: &str = "\
Examples:
  hlcp gallery
  hlcp gallery --out target/charts";

/// Draw the scenes' solutions
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The folder the pictures go to
    #[arg(long, default_value = "docs/charts")]
    out: PathBuf,
}

type Drawn = Fallible<()>;
type Curve = Vec<(f64, f64)>;

const BLUE: &str = COLOURS[0];
const RED: &str = COLOURS[1];
const GREEN: &str = COLOURS[2];
const PINK: &str = COLOURS[3];
const BLACK: &str = COLOURS[4];

pub(crate) fn run(Arguments { out }: &Arguments) -> Drawn {
    slider(&out.join("gallery-slider"))?;
    disc(&out.join("gallery-disc-lcp"), "disc-lcp")?;
    disc(&out.join("gallery-disc-hlcp"), "disc-hlcp")?;
    journal_bearing(&out.join("gallery-journal-bearing"))?;
    obstacle(&out.join("gallery-obstacle"))?;
    membranes(&out.join("gallery-membranes"))?;
    dam(&out.join("gallery-dam"))?;
    bearing2d(&out.join("gallery-bearing2d"), 0.0, "at the widest gap")?;
    bearing2d(&out.join("gallery-bearing2d-groove"), 3.8, "218° after the widest gap")?;
    american_put(&out.join("gallery-american-put"))
}

/// Returns `z` and `r`, to a residual of 1e-8 ‖q‖, which no picture shows.
fn solved(name: &str, numbers: &[(&'static str, f64)]) -> Fallible<[Vec<f64>; 2]> {
    let problem = Scene::of(name).pose(numbers)?;
    let limits = Limits::relative(1e-8);
    let Run { outcome, answer: [z, r], .. } = solve(&problem, &"TMGS".parse()?, 1.0, &limits)?;
    print::line(format_args!("{name}: TMGS {outcome}"))?;
    outcome.ok().map_err(|error| format!("{name}: {error}"))?;
    for (figure, value) in (problem.figures)(&z, &r) {
        print::line(format_args!("{name}: {figure} {value:.4e}"))?;
    }
    Ok([z, r])
}

/// Values on the inner points of a grid over a rectangle, for drawing.
struct Field<'f> {
    nx: usize,
    x: (f64, f64),
    y: (f64, f64),
    values: &'f [f64],
}

/// Columns and rows of a drawn field.
const CELLS: [usize; 2] = [48, 32];

impl Field<'_> {
    /// The value at the inner point nearest to the middle of each drawn cell, with that point's
    /// coordinates.
    fn cells(&self) -> Vec<Vec<[f64; 3]>> {
        let ny = self.values.len() / self.nx;
        let nearest = |k: usize, of: usize, points: usize| {
            let place = (k as f64 + 0.5) / of as f64 * (points + 1) as f64;
            (place.round() as usize).clamp(1, points)
        };
        let at = |i: usize, points: usize, (low, high): (f64, f64)| {
            low + (high - low) * i as f64 / (points + 1) as f64
        };
        let cell = |row: usize, column: usize| {
            let (i, j) = (nearest(column, CELLS[0], self.nx), nearest(row, CELLS[1], ny));
            let value = self.values[(j - 1) * self.nx + i - 1];
            [at(i, self.nx, self.x), at(j, ny, self.y), value]
        };
        (0..CELLS[1]).map(|row| (0..CELLS[0]).map(|column| cell(row, column)).collect()).collect()
    }

    /// The field in colours, zeros in grey.
    fn panel(&self, title: &str, axes: [&str; 2], what: &str) -> Panel {
        let largest = self.values.iter().copied().fold(0.0, f64::max);
        let shade = |[.., v]: &[f64; 3]| if *v > 0.0 { *v } else { f64::NAN };
        let rows: Vec<Vec<f64>> =
            self.cells().iter().map(|row| row.iter().map(shade).collect()).collect();
        Panel::field(title, axes, [self.x, self.y], &rows, (what, 0.0, largest))
    }

    /// Where the positive stretch of each row begins, unless at the first point, and where it ends.
    fn film(&self) -> Vec<Curve> {
        let rows = self.values.len() / self.nx;
        let step = [(self.x, self.nx), (self.y, rows)]
            .map(|((low, high), points)| (high - low) / (points + 1) as f64);
        let edge = |find: &dyn Fn(&[f64]) -> Option<f64>| -> Curve {
            let y = |j: usize| self.y.0 + (j + 1) as f64 * step[1];
            let found = self.values.chunks(self.nx).enumerate();
            found.filter_map(|(j, row)| Some((self.x.0 + find(row)? * step[0], y(j)))).collect()
        };
        let begin = |row: &[f64]| row.iter().position(|&z| z > 0.0).filter(|&i| i > 0);
        let end = |row: &[f64]| row.iter().rposition(|&z| z > 0.0);
        let edges = [
            edge(&|row| begin(row).map(|i| i as f64 + 0.5)),
            edge(&|row| end(row).map(|i| i as f64 + 1.5)),
        ];
        edges.into_iter().filter(|edge| !edge.is_empty()).collect()
    }
}

/// Draws two fields with the same lines on both, `edges` of one name, colour and dash.
///
/// A field has its name in the file of data, whose head is `head`, a title, and what its colours
/// are.
fn fields(
    path: &Path,
    words: &str,
    (head, axes): (&str, [&str; 2]),
    (name, colour, dash, edges): (&str, &str, &str, &[Curve]),
    of: [(&str, &str, &str, Field<'_>); 2],
) -> Drawn {
    let (mut panels, mut table) = (vec![], Table::new(head));
    for (unknown, title, what, field) in of {
        let panel = field.panel(title, axes, what);
        let line = |panel: Panel, edge: &Curve| panel.outline(name, colour, dash, edge);
        panels.push(edges.iter().fold(panel, line));
        for [x, y, v] in field.cells().into_iter().flatten() {
            table.row(&format!("{unknown}|{x:.4}|{y:.4}|{v:.4e}"));
        }
    }
    write(path, 2, 270.0, panels, &caption(words))?;
    table.write_csv(path)
}

const CONTACT: &str = "exact edge of the contact";

fn slider(path: &Path) -> Drawn {
    let [z, r] = solved("slider", &[("m", 128.0)])?;
    let millimetres = |i: usize| (i + 1) as f64 * Slider::LENGTH * 1e3 / 128.0;
    let pressure = |i: usize| z[i] * Slider::PRESSURE_UNIT * 1e-6;
    let line = |value: &dyn Fn(usize) -> f64| -> Curve {
        (0..z.len()).map(|i| (millimetres(i), value(i))).collect()
    };
    let rupture = Slider::RUPTURE * 1e3;
    let along = (0.0, Slider::LENGTH * 1e3);
    let full = Panel::new("Pressure", ["x in mm", "p in MPa"], [along, (0.0, 4.0)])
        .outline("computed", BLUE, "", &line(&pressure))
        .outline("exact rupture", RED, "6 4", &[(rupture, 0.0), (rupture, 4.0)]);
    let broken = Panel::new("Void", ["x in mm", "void fraction r"], [along, (0.0, 0.5)])
        .outline("computed", BLUE, "", &line(&|i| r[i]))
        .outline("exact rupture", RED, "6 4", &[(rupture, 0.0), (rupture, 0.5)]);
    write(path, 2, 270.0, vec![full, broken], &caption("Slider, 128 cells."))?;
    let mut table = Table::new("x in mm | p in MPa | void fraction");
    for (i, r) in r.iter().enumerate() {
        table.row(&format!("{:.4}|{:.5}|{r:.5}", millimetres(i), pressure(i)));
    }
    table.write_csv(path)
}

fn disc(path: &Path, name: &str) -> Drawn {
    let [z, r] = solved(name, &[("m", 63.0)])?;
    let edge = [circle([0.5, 0.5], 0.4)];
    let field = |values| Field { nx: 63, x: (0.0, 1.0), y: (0.0, 1.0), values };
    let [of_z, of_r] = ["z", "r"].map(|unknown| format!("{unknown} of {name}"));
    let of = [
        ("z", &of_z[..], "z, grey where it is 0", field(&z)),
        ("r", &of_r[..], "r, grey where it is 0", field(&r)),
    ];
    let words = format!("Scene {name}, 63 × 63 points.");
    fields(path, &words, ("field|x|y|value", ["x", "y"]), (CONTACT, RED, "6 4", &edge), of)
}

fn circle([x, y]: [f64; 2], radius: f64) -> Curve {
    let place = |k: i32| (f64::from(k) / 60.0 * TAU).sin_cos();
    (0..=60).map(place).map(|(sin, cos)| (x + radius * cos, y + radius * sin)).collect()
}

fn journal_bearing(path: &Path) -> Drawn {
    let numbers = [("nx", 63.0), ("ny", 63.0), ("ecc", 0.9), ("b-length", 3.0)];
    let [z, r] = solved("journal-bearing", &numbers)?;
    let field = |values| Field { nx: 63, x: (0.0, 360.0), y: (0.0, 6.0), values };
    let words = "Journal bearing (LCP), ε = 0.9, b = 3, 63 × 63 points.";
    let head = "field | xi in degrees | length over radius | value";
    let axes = ["angle from the widest gap (°)", "length over radius"];
    let edges = field(&z).film();
    let of = [
        ("z", "Pressure", "dimensionless pressure z, grey where it is 0", field(&z)),
        ("r", "Pull that is cut off", "r, grey where it is 0", field(&r)),
    ];
    fields(path, words, (head, axes), ("edge of the pressure", BLACK, "", &edges), of)
}

fn obstacle(path: &Path) -> Drawn {
    let [z, _] = solved("obstacle", &[("m", 65.0)])?;
    let place = |i: usize| 4.0 * (i + 1) as f64 / 64.0 - 2.0;
    let off = |k: usize| {
        let [x, y] = [k % 63, k / 63].map(place);
        (Obstacle::dome(x, y) + z[k] - Obstacle::exact(x, y)).abs()
    };
    let errors: Vec<f64> = (0..z.len()).map(off).collect();
    let field = |values| Field { nx: 63, x: (-2.0, 2.0), y: (-2.0, 2.0), values };
    let edge = [circle([0.0, 0.0], Obstacle::CONTACT)];
    let of = [
        ("z", "Height above the dome", "z, grey where the membrane rests", field(&z)),
        ("error", "Error of the height", "|u − exact u|, grey where it is 0", field(&errors)),
    ];
    let words = "Obstacle, 65 × 65 nodes.";
    fields(path, words, ("field|x|y|value", ["x", "y"]), (CONTACT, RED, "6 4", &edge), of)
}

fn membranes(path: &Path) -> Drawn {
    let [spiral, bessel] = ["spiral", "bessel"].map(|name| solved(name, &[("m", 127.0)]));
    let ([above, _], [below, _]) = (spiral?, bessel?);
    let field = |low, values| Field { nx: 127, x: (low, 1.0), y: (low, 1.0), values };
    let what = "z, grey where the membrane rests";
    let of = [
        ("spiral", "Height above the spiral", what, field(-1.0, &above)),
        ("bessel", "Depth below Bessel's functions", what, field(0.0, &below)),
    ];
    let words = "Membranes on the obstacles of others, 127 × 127 nodes.";
    fields(path, words, ("field|x|y|value", ["x", "y"]), ("", BLACK, "", &[]), of)
}

fn dam(path: &Path) -> Drawn {
    /// Points of the free boundary by Polubarinova-Kochina's integrals.
    #[rustfmt::skip] // a table
    const BOUNDARY: [(f64, f64); 11] = [
        (0.0, 1.0), (0.125, 0.97), (0.25, 0.9311), (0.375, 0.8865), (0.5, 0.8367), (0.625, 0.7811),
        (0.75, 0.7186), (0.875, 0.6454), (0.9375, 0.601), (0.984375, 0.5583), (1.0, 0.5362),
    ];
    let rows = 64;
    let numbers = [("nx", 63.0), ("ny", rows as f64), ("tail", 0.5), ("length", 1.0)];
    let upwards = |v: Vec<f64>| v.chunks(63).rev().flatten().copied().collect::<Vec<f64>>();
    let [z, r] = solved("dam", &numbers)?.map(upwards);
    // The cells' middles are half a cell from the base.
    let half = 0.5 / rows as f64;
    let field = |values| Field { nx: 63, x: (0.0, 1.0), y: (-half, 1.0 + half), values };
    let exact = [BOUNDARY.to_vec()];
    let of = [
        ("z", "Pressure head", "z, grey where it is 0", field(&z)),
        ("r", "Dry share of the pores", "r, grey where it is 0", field(&r)),
    ];
    let words = "Dam with tailwater of half the depth, 63 × 64 cells.";
    let edges = ("exact free boundary", RED, "6 4", &exact[..]);
    fields(path, words, ("field|x|y|value", ["x", "height"]), edges, of)
}

fn bearing2d(path: &Path, groove: f64, place: &str) -> Drawn {
    let numbers = [("nx", 95.0), ("ny", 31.0), ("groove", groove.to_degrees())];
    let [z, r] = solved("bearing2d", &numbers)?;
    let field = |values| Field { nx: 95, x: (0.0, 360.0), y: (-1.0, 1.0), values };
    let words = format!(
        "Bearing with mass-conserving cavitation, ε = 0.6, L/D = 1, groove {place}, 95 × 31 points."
    );
    let head = "field | angle from the groove in degrees | axial place | value";
    let axes = ["angle from the groove (°)", "2 y / L from the middle"];
    let edges = field(&z).film();
    let of = [
        ("z", "Pressure", "z in 6μΩ(R/c)², grey where it is 0", field(&z)),
        ("r", "Void", "void fraction r, grey where it is 0", field(&r)),
    ];
    fields(path, &words, (head, axes), ("edge of the full film", BLACK, "", &edges), of)
}

fn american_put(path: &Path) -> Drawn {
    let put = AmericanPut { rate: 0.06, volatility: 0.2, maturity: 1.0, m: 48, steps: 96 };
    let problem = Scene::of("american-put").pose(&[("m", 48.0), ("steps", 96.0)])?;
    let mut solver = problem.solver("TMGS")?;
    let mut q = problem.q.clone();
    let spots: Vec<f64> = (70..=130).map(|percent| f64::from(percent) / 100.0).collect();
    let prices =
        |z: &[f64]| -> Curve { spots.iter().map(|&spot| (spot, put.price(z, spot))).collect() };
    let (axes, ranges) = (["spot / strike", "price / strike"], [(0.7, 1.3), (0.0, 0.3)]);
    let mut values = Panel::new("Price of the put", axes, ranges).outline(
        "at maturity",
        BLACK,
        "2 3",
        &prices(solver.z()),
    );
    let (mut edge, mut iterations) = (vec![(0.0, 1.0)], 0);
    let mut table = Table::new("line | spot over strike or years | price or spot over strike");
    for k in 0..put.lcps() {
        put.q(k, solver.z(), &mut q);
        let outcome = solver.solve(&q, Options::resume().limits(Limits::absolute(1e-10)))?;
        outcome.ok().map_err(|error| format!("American put, LCP {k}: {error}"))?;
        iterations += outcome.iterations;
        // The first four take half a step each.
        let years = (if k < 4 { (k + 1) as f64 / 2.0 } else { (k - 1) as f64 }) / 96.0;
        edge.push((years, put.exercise(solver.z())));
        table.row(&format!("exercise|{years:.5}|{:.5}", put.exercise(solver.z())));
        for (before, name, colour, dash) in
            [(0.25, "three months before it", RED, "6 4"), (1.0, "a year before it", BLUE, "")]
        {
            if years == before {
                let line = prices(solver.z());
                for (spot, price) in &line {
                    table.row(&format!("{name}|{spot}|{price:.6}"));
                }
                values = values.outline(name, colour, dash, &line);
            }
        }
    }
    print::line(format_args!(
        "American put: {} LCPs, {iterations} TMGS iterations, price {:.4} for spot 36 and strike 40",
        put.lcps(),
        40.0 * put.price(solver.z(), 0.9)
    ))?;
    let axes = ["time to maturity in years", "spot / strike"];
    let perpetual = 0.06 / (0.06 + 0.5 * 0.2 * 0.2);
    let limit = [(0.0, perpetual), (1.0, perpetual)];
    let exercise = Panel::new("Where it is exercised", axes, [(0.0, 1.0), (0.7, 1.0)])
        .outline("exercised at and below", GREEN, "", &edge)
        .outline("the same, of the perpetual put", PINK, "8 3 2 3", &limit);
    let words =
        "American put: rate 6 %, volatility 20 %, 48 points to a standard deviation, 96 steps.";
    write(path, 2, 270.0, vec![values, exercise], &caption(words))?;
    table.write_csv(path)
}

fn caption(words: &str) -> String {
    format!("{words}\n{}", provenance("hlcp gallery"))
}
