//! Charts: lines on logarithmic axes and fields as colours, as SVG with the data beside it.
//!
//! A figure is 800 pixels wide, and its text has its size at that width. Every series has a colour,
//! a dash and a marker of its own, so that a chart reads in grey too; the light background is part
//! of the chart, so that it reads on a dark page.

use std::{fs, path::Path, process::Command, sync::Arc};

use hlcp::files;
use kuva::{
    backend::svg::SvgBackend,
    plot::{
        ColorMap, Heatmap, LegendEntry, LinePlot, LineStyle, MarkerShape, ScatterPlot,
        legend::LegendShape,
    },
    prelude::{Theme, TickFormat},
    render::{
        layout::{ComputedLayout, Layout},
        plots::Plot,
        render::{Primitive, Scene, TextAnchor, render_legend_at, render_multiple},
        render_utils::wrap_text,
    },
};

use crate::Fallible;

/// Okabe and Ito's colours, apart from yellow.
pub(crate) const COLOURS: [&str; 7] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#56B4E9", "#E69F00"];
pub(crate) const DASHES: [&str; 5] = ["", "7 4", "2 3", "8 3 2 3", "12 5"];
pub(crate) const MARKERS: [MarkerShape; 9] = [
    MarkerShape::Circle,
    MarkerShape::Square,
    MarkerShape::Triangle,
    MarkerShape::Diamond,
    MarkerShape::TriangleDown,
    MarkerShape::Pentagon,
    MarkerShape::Star,
    MarkerShape::Plus,
    MarkerShape::Cross,
];

/// A named line through points, with positive coordinates on logarithmic axes; its colour, dash and
/// marker are each a place in the lists above, of which it goes around.
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) style: [usize; 3],
    pub(crate) points: Vec<(f64, f64)>,
}

/// From where to where along x and along y.
pub(crate) type Ranges = [(f64, f64); 2];

/// A chart in a grid of charts.
pub(crate) struct Panel {
    plots: Vec<Plot>,
    layout: Layout,
    /// Whether the axes are of logarithms.
    has_decades: bool,
    keys: Vec<Key>,
    /// The names that stand at the ends of lines in the place of a legend.
    ends: Vec<End>,
    /// Places along the top, with their names.
    pub(crate) places: Vec<(f64, String)>,
}

/// An entry of the legend: shapes on top of each other, with their colours and dashes.
#[derive(Clone)]
struct Key {
    label: String,
    shapes: Vec<(LegendShape, String, String)>,
}

/// The name at the end of a line, and where that is: nowhere for a line that begins above the
/// panel.
struct End {
    label: String,
    colour: &'static str,
    at: Option<(f64, f64)>,
}

impl Panel {
    /// Lines on logarithmic axes, named with their units; the ranges are those of the points, or
    /// whole decades where two powers of ten would not be in them.
    pub(crate) fn log_log(title: &str, axes: [&str; 2], series: &[Series]) -> Self {
        let points = || series.iter().flat_map(|series| &series.points);
        let range = |coordinate: fn(&(f64, f64)) -> f64| {
            let logs = points().map(|point| coordinate(point).log10());
            let (low, high) =
                logs.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
            let (low, high) = (low - 0.1, high + 0.1);
            if high.floor() > low.ceil() { (low, high) } else { (low.floor(), high.ceil()) }
        };
        let mut panel = Self::new(title, axes, [range(|point| point.0), range(|point| point.1)]);
        panel.layout = panel.layout.with_tick_format(TickFormat::Custom(Arc::new(power_of_ten)));
        panel.has_decades = true;
        for series in series {
            panel.draw(series, f64::log10, false);
        }
        panel
    }

    /// The same panel over other decades along x, with its ticks in other words than powers of ten.
    pub(crate) fn over(mut self, low: f64, high: f64, words: [fn(f64) -> String; 2]) -> Self {
        let [x, y] = words.map(|words| TickFormat::Custom(Arc::new(words)));
        self.layout.x_range = (low, high);
        let layout = self.layout.with_x_axis_min(low).with_x_axis_max(high);
        self.layout = layout.with_x_tick_format(x).with_y_tick_format(y);
        self
    }

    /// Names lines of a [`log_log`](Self::log_log) panel at their ends, each with what `note` says
    /// of it, in the place of the legend.
    pub(crate) fn with_names_at_ends(
        mut self,
        series: &[Series],
        note: impl Fn(&Series) -> String,
    ) -> Self {
        self.keys.retain(|key| series.iter().all(|series| series.name != key.label));
        for series in series {
            let at = series.points.last().map(|(x, y)| (x.log10(), y.log10()));
            self.name(series, series.name.clone() + &note(series), at);
        }
        self
    }

    /// Names a line at its end, or at the top of the names if it begins above the panel.
    pub(crate) fn name(&mut self, series: &Series, label: String, at: Option<(f64, f64)>) {
        let colour = COLOURS[series.style[0] % COLOURS.len()];
        self.ends.push(End { label, colour, at });
    }

    /// Steps from the left on plain axes over the given ranges.
    pub(crate) fn steps(title: &str, axes: [&str; 2], ranges: Ranges, series: &[Series]) -> Self {
        let mut panel = Self::new(title, axes, ranges);
        for series in series {
            panel.draw(series, |v| v, true);
        }
        panel
    }

    /// A field over a rectangle as colours: `rows` from the bottom to the top, each from left to
    /// right.
    ///
    /// Light is `low` and dark is `high`, what lies beyond has the colour of that end, and NaN is
    /// grey; `what`, with its unit, names the colours. A cell is some 90 bytes of the file: thin
    /// out what is finer than the screen.
    pub(crate) fn field(
        title: &str,
        axes: [&str; 2],
        ranges: Ranges,
        rows: &[Vec<f64>],
        (what, low, high): (&str, f64, f64),
    ) -> Self {
        let rows = rows.iter().map(|row| row.iter().map(|v| v.clamp(low, high)).collect());
        let colour = move |v: f64| match v.is_nan() {
            true => "#c8c8c8".to_owned(),
            false => shade((v - low) / (high - low)),
        };
        let mut panel = Self::new(title, axes, ranges);
        panel.layout = panel.layout.with_subtitle(format!("colour: {what}"));
        panel.layout.show_colorbar = true;
        panel.plots.push(cells(ranges, rows.collect(), colour));
        panel
    }

    /// Cells of a rectangle in some colours, each with a name for the legend: the `k`-th where a
    /// row has `k`.
    pub(crate) fn classes(
        title: &str,
        axes: [&str; 2],
        ranges: Ranges,
        rows: Vec<Vec<f64>>,
        classes: &[(String, String)],
    ) -> Self {
        let mut panel = Self::new(title, axes, ranges);
        let colours: Vec<_> = classes.iter().map(|(_, colour)| colour.clone()).collect();
        let colour = move |k: f64| colours[k.round() as usize].clone();
        panel.plots.push(cells(ranges, rows, colour));
        for (label, colour) in classes {
            let shapes = vec![(LegendShape::Rect, colour.clone(), String::new())];
            panel.keys.push(Key { label: label.clone(), shapes });
        }
        panel
    }

    /// Empty axes, for outlines and marks.
    pub(crate) fn new(title: &str, [x, y]: [&str; 2], [x_range, y_range]: Ranges) -> Self {
        let mut layout = Layout::new(x_range, y_range)
            .with_title(title)
            .with_title_size(12)
            .with_label_size(12)
            .with_tick_size(11)
            .with_title_wrap(80) // where it has no lines of its own
            .with_subtitle_size(SIZE)
            .with_x_label(x)
            .with_x_axis_min(x_range.0)
            .with_x_axis_max(x_range.1)
            .with_y_axis_min(y_range.0)
            .with_y_axis_max(y_range.1);
        if !y.is_empty() {
            layout = layout.with_y_label(y);
        }
        let (plots, keys, ends, places) = (vec![], vec![], vec![], vec![]);
        Self { plots, layout, has_decades: false, keys, ends, places }
    }

    fn draw(&mut self, series: &Series, scale: fn(f64) -> f64, steps: bool) {
        let [colour, dash, marker] = series.style;
        let colour = COLOURS[colour % COLOURS.len()];
        let dash = DASHES[dash % DASHES.len()];
        let marker = MARKERS[marker % MARKERS.len()];
        let points: Vec<_> = series.points.iter().map(|&(x, y)| (scale(x), scale(y))).collect();
        let markers = dots(&points, colour, marker, 3.0);
        let line = line(points, colour, dash, 1.5);
        if steps {
            self.plots.push(Plot::Line(line.with_step()));
            return self.key(&series.name, LegendShape::Line, colour, dash);
        }
        self.plots.push(Plot::Line(line));
        self.plots.push(markers);
        self.key(&series.name, LegendShape::Marker(marker), colour, "");
    }

    /// Marks at points in the axes' own coordinates (logarithms on a [`log_log`](Self::log_log)
    /// panel), of a size in pixels, with a name unless that is empty.
    pub(crate) fn marks(
        mut self,
        name: &str,
        (colour, marker, size): (&str, MarkerShape, f64),
        at: &[(f64, f64)],
    ) -> Self {
        self.plots.push(dots(at, colour, marker, size));
        self.key(name, LegendShape::Marker(marker), colour, "");
        self
    }

    /// An open line through points in the axes' own coordinates, with a name unless that is empty.
    pub(crate) fn outline(
        mut self,
        name: &str,
        colour: &str,
        dash: &str,
        through: &[(f64, f64)],
    ) -> Self {
        self.plots.push(Plot::Line(line(through.to_vec(), colour, dash, 2.0)));
        self.key(name, LegendShape::Line, colour, dash);
        self
    }

    /// A line in black on white, which shows on light and on dark, through points in the axes' own
    /// coordinates.
    pub(crate) fn border(self, name: &str, dash: &str, through: &[(f64, f64)]) -> Self {
        self.outline("", "white", "", through).outline(name, "black", dash, through)
    }

    /// A broad line below all others, through points in the axes' own coordinates.
    pub(crate) fn band(mut self, name: &str, colour: &str, through: &[(f64, f64)]) -> Self {
        self.plots.insert(0, Plot::Line(line(through.to_vec(), colour, "", 9.0)));
        self.key(name, LegendShape::Rect, colour, "");
        self
    }

    /// Adds to the legend, on top of the shapes of the same name, unless that is empty.
    fn key(&mut self, label: &str, shape: LegendShape, colour: &str, dash: &str) {
        if label.is_empty() {
            return;
        }
        let shape = (shape, colour.to_owned(), dash.to_owned());
        match self.keys.iter_mut().find(|key| key.label == label) {
            Some(key) => key.shapes.push(shape),
            None => self.keys.push(Key { label: label.to_owned(), shapes: vec![shape] }),
        }
    }

    /// The pixels to the left and to the right of what is drawn.
    fn margins(&self) -> [f64; 2] {
        let computed = ComputedLayout::from_layout(&self.layout);
        // The layout leaves room for a name of the axis where there is none.
        let name = if self.layout.y_label.is_some() { 0.0 } else { 15.0 };
        let widest = self.ends.iter().map(|end| width(&end.label)).fold(0.0, f64::max);
        let right = if self.ends.is_empty() { computed.margin_right } else { 10.0 + widest };
        [computed.margin_left - 8.0 - name, right.max(12.0)]
    }

    /// Draws a panel of some pixels at a place of a scene.
    fn render(self, scene: &mut Scene, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
        let [left, right] = self.margins();
        let mut layout = self.layout.with_width(width).with_height(height);
        let ComputedLayout { margin_top, margin_bottom, .. } = ComputedLayout::from_layout(&layout);
        let margin_top = margin_top + if self.places.is_empty() { 0.0 } else { LINE };
        layout = layout
            .with_force_margins(left, right)
            .with_force_margins_y(margin_top, margin_bottom - 8.0);
        if self.has_decades {
            // As many decades apart as their names need.
            let step = |(low, high): (f64, f64), pixels: f64, name: f64| {
                let least = (high - low) * name / pixels;
                [1.0, 2.0, 4.0, 5.0, 8.0].into_iter().find(|step| *step >= least).unwrap_or(10.0)
            };
            let x = step(layout.x_range, width - left - right, 34.0);
            let y = step(layout.y_range, height - margin_top - margin_bottom, 24.0);
            layout = layout.with_x_tick_step(x).with_y_tick_step(y);
        }
        let computed = ComputedLayout::from_layout(&layout);
        let drawn = render_multiple(self.plots, layout);
        let transform = Some(format!("translate({x:.1},{y:.1})"));
        scene.add(Primitive::GroupStart { transform, title: None, extra_attrs: None });
        scene.defs.extend(drawn.defs);
        drawn.elements.into_iter().for_each(|element| scene.add(element));
        for (at, name) in self.places {
            let (x, y2) = (computed.map_x(at), computed.margin_top);
            rule(scene, [x, y2 - 4.0, x, y2], "black", 1.0, None);
            text(scene, [x, y2 - 6.0], &name, "black", TextAnchor::Middle);
        }
        let end = width - right;
        // Where the names stand: near the ends, and a line apart.
        let mut names = self.ends;
        let wanted = |end: &End| end.at.map_or(computed.margin_top, |(_, y)| computed.map_y(y));
        names.sort_by(|one, other| wanted(one).total_cmp(&wanted(other)));
        let mut places: Vec<f64> = names.iter().map(wanted).collect();
        for k in 1..places.len() {
            places[k] = places[k].max(places[k - 1] + LINE);
        }
        let mut lowest = height - computed.margin_bottom + LINE / 2.0;
        for place in places.iter_mut().rev() {
            *place = place.min(lowest);
            lowest = *place - LINE;
        }
        for (name, place) in names.iter().zip(places) {
            if let Some((x, y)) = name.at {
                let ends = [computed.map_x(x), computed.map_y(y), end + 4.0, place];
                rule(scene, ends, name.colour, 1.0, Some("1 2".to_owned()));
            }
            let (at, colour) = ([end + 6.0, place + 4.0], darker(name.colour));
            text(scene, at, &name.label, &colour, TextAnchor::Start);
        }
        scene.add(Primitive::GroupEnd);
    }
}

/// The width of a figure in pixels.
const WIDTH: f64 = 800.0;

/// The size of small text, and the distance of its lines.
const SIZE: u32 = 11;
const LINE: f64 = 13.0;

/// Returns the pixels that small text takes, or some more.
fn width(text: &str) -> f64 {
    0.65 * f64::from(SIZE) * text.chars().count() as f64
}

fn text(scene: &mut Scene, [x, y]: [f64; 2], text: &str, colour: &str, anchor: TextAnchor) {
    let (content, color, size) = (text.to_owned(), Some(colour.into()), SIZE);
    let (rotate, bold) = (None, false);
    scene.add(Primitive::Text { x, y, content, size, anchor, rotate, bold, color });
}

/// Adds a straight line between two places, solid without a dash.
fn rule(
    scene: &mut Scene,
    [x1, y1, x2, y2]: [f64; 4],
    colour: &str,
    stroke_width: f64,
    stroke_dasharray: Option<String>,
) {
    let stroke = colour.into();
    scene.add(Primitive::Line { x1, y1, x2, y2, stroke, stroke_width, stroke_dasharray });
}

/// Returns a colour that is dark enough for text, of `#` and six hexadecimal digits.
fn darker(colour: &str) -> String {
    let part = |k: usize| u8::from_str_radix(&colour[k..k + 2], 16).unwrap_or(0);
    let [red, green, blue] = [1, 3, 5].map(|k| (0.7 * f64::from(part(k))) as u8);
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Returns a colour from light, for 0, to dark, for 1.
pub(crate) fn shade(share: f64) -> String {
    ColorMap::Cividis.map(1.0 - share)
}

/// Cells of a rectangle in the colours of their values.
fn cells(
    [x, y]: Ranges,
    rows: Vec<Vec<f64>>,
    colour: impl Fn(f64) -> String + Send + Sync + 'static,
) -> Plot {
    // A map of colours is told where a value lies between the least and the largest.
    let finite = || rows.iter().flatten().filter(|v| !v.is_nan());
    let least = finite().fold(f64::MAX, |least, &v| least.min(v));
    let most = finite().fold(f64::MIN, |most, &v| most.max(v));
    let map = move |t: f64| colour(least + t * (most - least));
    let heat = Heatmap::new()
        .with_data(rows)
        .with_color_map(ColorMap::Custom(Arc::new(map)))
        .with_x_range(x.0, x.1)
        .with_y_range(y.0, y.1)
        .with_cell_size(1.0);
    Plot::Heatmap(heat)
}

fn dots(at: &[(f64, f64)], colour: &str, marker: MarkerShape, size: f64) -> Plot {
    let dots = ScatterPlot::new().with_data(at.iter().copied()).with_color(colour);
    Plot::Scatter(dots.with_marker(marker).with_size(size))
}

/// Draws a line, solid for an empty dash.
fn line(through: Vec<(f64, f64)>, colour: &str, dash: &str, width: f64) -> LinePlot {
    let style = if dash.is_empty() { LineStyle::Solid } else { LineStyle::Custom(dash.to_owned()) };
    LinePlot::new()
        .with_data(through)
        .with_color(colour)
        .with_line_style(style)
        .with_stroke_width(width)
}

/// `10^v` with the exponent raised.
pub(crate) fn power_of_ten(v: f64) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32('⁰' as u32 + c as u32 - '0' as u32).unwrap_or(c),
        other => other,
    };
    format!("10{}", format!("{v:.0}").chars().map(raised).collect::<String>())
}

/// Writes the picture of [`svg`] as `path`.svg.
pub(crate) fn write(
    path: &Path,
    columns: usize,
    height: f64,
    panels: Vec<Panel>,
    caption: &str,
) -> Fallible<()> {
    save(&path.with_extension("svg"), &svg(columns, height, panels, caption))
}

/// Writes a text to a file, in a folder that is made where there is none.
pub(crate) fn save(path: &Path, text: &str) -> Fallible<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)
            .map_err(|e| format!("{}: {e}", files::printable(folder.display())))?;
    }
    Ok(files::write_together(&[(path, text)], |text, file| file.write_all(text.as_bytes()))?)
}

/// Draws panels of a height, `columns` to a row, with one legend and a caption below.
pub(crate) fn svg(columns: usize, height: f64, panels: Vec<Panel>, caption: &str) -> String {
    let mut keys: Vec<Key> = vec![];
    for key in panels.iter().flat_map(|panel| &panel.keys) {
        if keys.iter().all(|known| known.label != key.label) {
            keys.push(key.clone());
        }
    }
    let mut scene = Scene::new(WIDTH, 0.0);
    scene.font_family = Some("DejaVu Sans, Verdana, Arial, sans-serif".into());
    let left = panels.first().map_or(12.0, |panel| panel.margins()[0]);
    let mut panels = panels.into_iter().peekable();
    while panels.peek().is_some() {
        let row: Vec<Panel> = panels.by_ref().take(columns).collect();
        // What is drawn is equally wide, whatever stands beside it.
        let margins: f64 = row.iter().flat_map(Panel::margins).sum();
        let share = margins / row.len() as f64 * (columns - row.len()) as f64;
        let drawn = (WIDTH - margins - share) / columns as f64;
        let (mut x, y) = (0.0, scene.height);
        for panel in row {
            let width = drawn + panel.margins().iter().sum::<f64>();
            panel.render(&mut scene, [x, y], [width, height]);
            x += width;
        }
        scene.height += height;
    }
    scene.height += 12.0;
    // Its lines begin 4 pixels to the left.
    let first = left + 4.0;
    let mut x = first;
    for Key { label, shapes } in keys {
        let width = 40.0 + width(&label);
        if x + width > WIDTH {
            (x, scene.height) = (first, scene.height + 18.0);
        }
        for (k, (mut shape, color, dash)) in shapes.into_iter().enumerate() {
            let label = if k == 0 { label.clone() } else { String::new() };
            let dasharray = (!dash.is_empty()).then_some(dash);
            let (y, theme) = (scene.height, Theme::default());
            if let LegendShape::Line = shape {
                // Long enough for a dash of any kind.
                let ends = [x - 4.0, y + 5.0, x + 21.0, y + 5.0];
                rule(&mut scene, ends, &color, 2.0, dasharray.clone());
                shape = LegendShape::CircleSize(0.0);
            }
            let entry = LegendEntry { label, color, shape, dasharray };
            render_legend_at(&[entry], None, None, false, &mut scene, x, y, width, SIZE, &theme);
        }
        x += width;
    }
    scene.height += if x > first { 24.0 } else { 0.0 };
    for line in wrap_text(caption, (WIDTH / width("n")) as usize) {
        scene.height += 15.0;
        let y = scene.height - 10.0;
        text(&mut scene, [12.0, y], &line, "black", TextAnchor::Start);
    }
    SvgBackend::new().render_scene(&scene)
}

/// The command, the machine and the day, for captions.
pub(crate) fn provenance(command: &str) -> String {
    format!("{command} · {}", machine())
}

/// The machine and the day.
pub(crate) fn machine() -> String {
    let cpu = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("unknown");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let day = Command::new("date").args(["-u", "+%Y-%m-%d"]).output();
    let day = day.map_or_else(|_| String::new(), |out| String::from_utf8_lossy(&out.stdout).into());
    let model = model.trim_start_matches([' ', '\t', ':']);
    format!("{model}, {cores} cores · {}", day.trim())
}
