//! The picture of a film: its pressure and its content, with the edge of the broken part, the
//! supplies and the load.

use std::collections::HashMap;

use hlcp::film::{Bearing, Solved};
use kuva::plot::MarkerShape;

use super::{Arguments, unit};
use crate::chart::{self, Panel};

/// Cells along a direction of the picture, at most: more are not seen.
const CELLS: usize = 160;

/// The picture as SVG; the load acts at a place in m, or a journal is pressed there.
pub(super) fn drawn(
    bearing: &Bearing,
    solved: &Solved,
    load: [f64; 2],
    arguments: &Arguments,
    caption: &str,
) -> String {
    let film = &solved.film;
    let counts = [film.nx, film.ny];
    let pick = [0, 1].map(|axis| {
        let shown = counts[axis].min(CELLS);
        // The middles of the shown cells.
        let at = move |k: usize| (2 * k + 1) * counts[axis] / (2 * shown);
        (0..shown).map(at).collect::<Vec<usize>>()
    });
    let rows = |value: &dyn Fn(usize) -> f64| -> Vec<Vec<f64>> {
        let row = |&j: &usize| pick[0].iter().map(|&i| value(j * film.nx + i)).collect();
        pick[1].iter().map(row).collect()
    };
    let p: Vec<f64> = film.pressures(&solved.z).iter().map(|p| p / arguments.p_unit).collect();
    let pressures = rows(&|k| p[k]);
    let contents = rows(&|k| 1.0 - solved.r[k]);
    let [lx, ly] = film.lengths.map(|length| length / arguments.x_unit);
    let x = format!("x ({})", unit(arguments.x_unit, "m"));
    let y = format!("y ({})", unit(arguments.x_unit, "m"));
    let (axes, ranges) = ([x.as_str(), y.as_str()], [(0.0, lx), (0.0, ly)]);
    let extreme = |pick: fn(f64, f64) -> f64, from| p.iter().copied().fold(from, pick);
    let (low, high) = (extreme(f64::min, f64::INFINITY), extreme(f64::max, f64::NEG_INFINITY));
    let high = if high > low { high } else { low + 1.0 };
    let colours = format!("p ({})", unit(arguments.p_unit, "Pa"));
    let least = contents.iter().flatten().copied().fold(1.0, f64::min);
    let least = if least < 1.0 { least } else { 0.0 };
    let mut panels = [
        Panel::field("Pressure", axes, ranges, &pressures, (&colours, low, high)),
        Panel::field("Film content", axes, ranges, &contents, ("θ", least, 1.0)),
    ];
    let broken = |i: usize, j: usize| contents[j][i] < 1.0;
    let sizes = [pick[0].len(), pick[1].len()];
    let place =
        |[i, j]: [usize; 2]| (lx * i as f64 / sizes[0] as f64, ly * j as f64 / sizes[1] as f64);
    for line in edges(sizes, broken) {
        let through: Vec<(f64, f64)> = line.into_iter().map(place).collect();
        panels =
            panels.map(|panel| panel.outline("edge of the full film", "#D55E00", "", &through));
    }
    for supply in &film.supplies {
        let [[x, y], [dx, dy]] =
            [supply.corner, supply.size].map(|place| place.map(|v| v / arguments.x_unit));
        // One that reaches beyond a periodic end begins before the other end as well.
        for [x, y] in [[x, y], [x - lx, y], [x, y - ly]] {
            let corners = [(x, y), (x + dx, y), (x + dx, y + dy), (x, y + dy), (x, y)];
            panels = panels.map(|panel| panel.border("groove or supply", "2 3", &corners));
        }
    }
    let [x, y] = load.map(|place| place / arguments.x_unit);
    if y.is_finite() {
        let mark = ("#D55E00", MarkerShape::TriangleDown, 7.0);
        panels = panels.map(|panel| {
            let panel = panel.marks("", ("white", MarkerShape::TriangleDown, 9.0), &[(x, y)]);
            panel.marks("the load presses here", mark, &[(x, y)])
        });
    }
    if bearing.journal.is_some() {
        let place = |k: u32| (lx * f64::from(k) / 360.0, format!("{k}°"));
        let angles = || (0..=360).step_by(60).map(place).collect();
        panels.iter_mut().for_each(|panel| panel.places = angles());
    }
    chart::svg(2, 300.0, panels.into(), caption)
}

/// The lines between cells that are inside and cells that are not, through corners of cells.
fn edges([nx, ny]: [usize; 2], inside: impl Fn(usize, usize) -> bool) -> Vec<Vec<[usize; 2]>> {
    // Each piece leads from a corner to the next with the inside on its left.
    let mut next: HashMap<[usize; 2], Vec<[usize; 2]>> = HashMap::new();
    let mut starts = vec![];
    for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
        let pieces = [
            (i + 1 < nx && !inside(i + 1, j), [i + 1, j], [i + 1, j + 1]),
            (i > 0 && !inside(i - 1, j), [i, j + 1], [i, j]),
            (j + 1 < ny && !inside(i, j + 1), [i + 1, j + 1], [i, j + 1]),
            (j > 0 && !inside(i, j - 1), [i, j], [i + 1, j]),
        ];
        for (_, from, to) in pieces.into_iter().filter(|(is_edge, ..)| *is_edge && inside(i, j)) {
            next.entry(from).or_default().push(to);
            starts.push(from);
        }
    }
    // Open lines first, from the sides of the film.
    let mut lines = vec![];
    let on_side = |[i, j]: &[usize; 2]| *i == 0 || *j == 0 || *i == nx || *j == ny;
    starts.sort_by_key(|start| !on_side(start));
    for start in starts {
        let mut line = vec![start];
        let mut at = start;
        while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
            line.push(to);
            at = to;
        }
        if line.len() > 1 {
            lines.push(line);
        }
    }
    lines
}
