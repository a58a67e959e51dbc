//! Charts: lines on logarithmic axes and fields as colours, as SVG with the data beside it.
//!
//! Every series has a colour, a dash and a marker of its own, so that a chart reads in grey too;
//! the light background is part of the chart, so that it reads on a dark page.

use std::{error::Error, fs, path::Path, process::Command, sync::Arc};

use hlcp::files;
use kuva::{
    backend::svg::SvgBackend,
    plot::{
        ColorMap, Heatmap, LegendEntry, LinePlot, LineStyle, MarkerShape, ScatterPlot,
        legend::LegendShape,
    },
    prelude::TickFormat,
    render::{
        figure::{Figure, FigureLegendPosition},
        layout::Layout,
        plots::Plot,
        render::{Primitive, TextAnchor},
    },
};

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

/// A named line with its colour, dash and marker, each a place in the lists above, of which it goes
/// around.
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) style: [usize; 3],
    pub(crate) points: Vec<Point>,
}

/// A point of a line on logarithmic axes, its coordinates positive.
#[derive(Clone, Copy)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// The smallest and largest `x` measured, drawn as a bar.
    pub(crate) spread: Option<[f64; 2]>,
    /// Whether the point is what it was meant to be; the others are open markers, joined by
    /// nothing.
    pub(crate) reached: bool,
}

impl Point {
    /// A point without a spread.
    pub(crate) fn at(x: f64, y: f64) -> Self {
        Self { x, y, spread: None, reached: true }
    }
}

/// A chart in a grid of charts.
pub(crate) struct Panel {
    plots: Vec<Plot>,
    layout: Layout,
    legend: Vec<LegendEntry>,
}

impl Panel {
    /// Lines on logarithmic axes, named with their units; the ranges grow to whole powers of ten.
    pub(crate) fn log_log(title: &str, axes: [&str; 2], series: &[Series]) -> Self {
        let points = || series.iter().flat_map(|series| &series.points);
        let range = |coordinate: fn(&Point) -> f64| {
            let logs = points().map(|point| coordinate(point).log10());
            let (low, high) =
                logs.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
            (low.floor(), high.ceil().max(low.floor() + 1.0))
        };
        let mut panel = Self::new(title, axes, range(|point| point.x), range(|point| point.y));
        // Decades, thinned where there are many.
        let step = |(low, high): (f64, f64)| ((high - low) / 8.0).ceil();
        panel.layout = panel
            .layout
            .with_x_tick_step(step(range(|point| point.x)))
            .with_y_tick_step(step(range(|point| point.y)))
            .with_tick_format(TickFormat::Custom(Arc::new(power_of_ten)));
        for series in series {
            panel.draw(series, f64::log10, false);
        }
        panel
    }

    /// Steps from the left on plain axes over the given ranges.
    pub(crate) fn steps(
        title: &str,
        axes: [&str; 2],
        ranges: [(f64, f64); 2],
        series: &[Series],
    ) -> Self {
        let mut panel = Self::new(title, axes, ranges[0], ranges[1]);
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
        [x, y]: [(f64, f64); 2],
        rows: &[Vec<f64>],
        (what, low, high): (&str, f64, f64),
    ) -> Self {
        let rows =
            rows.iter().map(|row| row.iter().map(|v| v.clamp(low, high)).collect::<Vec<_>>());
        let rows: Vec<_> = rows.collect();
        // The chart's own scale would follow the values; this one is the same in all panels.
        let finite = || rows.iter().flatten().filter(|v| !v.is_nan());
        let least = finite().fold(high, |least, &v| least.min(v));
        let most = finite().fold(low, |most, &v| most.max(v));
        let colour = move |t: f64| {
            if t.is_nan() {
                return "#c8c8c8".to_owned();
            }
            ColorMap::Cividis.map(1.0 - (least + t * (most - least) - low) / (high - low))
        };
        let heat = Heatmap::new()
            .with_data(rows)
            .with_color_map(ColorMap::Custom(Arc::new(colour)))
            .with_x_range(x.0, x.1)
            .with_y_range(y.0, y.1)
            .with_cell_size(1.0);
        let mut panel = Self::new(title, axes, x, y);
        panel.layout = panel.layout.with_subtitle(format!("colour: {what}"));
        panel.layout.show_colorbar = true;
        panel.plots.push(Plot::Heatmap(heat));
        panel
    }

    /// Empty axes, for outlines and marks.
    pub(crate) fn new(
        title: &str,
        [x, y]: [&str; 2],
        x_range: (f64, f64),
        y_range: (f64, f64),
    ) -> Self {
        let layout = Layout::new(x_range, y_range)
            .with_title(title)
            .with_title_size(15)
            .with_x_label(x)
            .with_y_label(y)
            .with_x_axis_min(x_range.0)
            .with_x_axis_max(x_range.1)
            .with_y_axis_min(y_range.0)
            .with_y_axis_max(y_range.1);
        Self { plots: vec![], layout, legend: vec![] }
    }

    fn draw(&mut self, series: &Series, scale: fn(f64) -> f64, steps: bool) {
        let [colour, dash, marker] = series.style;
        let colour = COLOURS[colour % COLOURS.len()];
        let dash = DASHES[dash % DASHES.len()];
        let marker = MARKERS[marker % MARKERS.len()];
        let at = |point: &Point| (scale(point.x), scale(point.y));
        let [reached, missed] = [true, false].map(|reached| {
            series.points.iter().filter(|point| point.reached == reached).collect::<Vec<_>>()
        });
        let points = reached.iter().map(|point| at(point)).collect();
        let line = line(points, colour, dash, 1.5);
        self.plots.push(Plot::Line(if steps { line.with_step() } else { line }));
        let spreads = reached.iter().map(|point| {
            let [low, high] = point.spread.unwrap_or([point.x; 2]).map(scale);
            (scale(point.x) - low, high - scale(point.x))
        });
        let markers = |points: &[&Point], colour: &str, size: f64| {
            ScatterPlot::new()
                .with_data(points.iter().map(|point| at(point)))
                .with_color(colour)
                .with_marker(marker)
                .with_size(size)
        };
        let closed = markers(&reached, colour, 4.0).with_x_err_asymmetric(spreads);
        self.plots.push(Plot::Scatter(closed));
        // An open marker is one with a smaller white one on top.
        self.plots.push(Plot::Scatter(markers(&missed, colour, 5.0)));
        self.plots.push(Plot::Scatter(markers(&missed, "white", 3.2)));
        self.name(&series.name, colour, LegendShape::Marker(marker), "");
    }

    /// Marks at points in the axes' own coordinates (logarithms on a [`log_log`](Self::log_log)
    /// panel).
    pub(crate) fn marks(
        mut self,
        name: &str,
        colour: &str,
        marker: MarkerShape,
        at: &[(f64, f64)],
    ) -> Self {
        let marks = ScatterPlot::new()
            .with_data(at.iter().copied())
            .with_color(colour)
            .with_marker(marker)
            .with_size(2.5);
        self.plots.push(Plot::Scatter(marks));
        self.name(name, colour, LegendShape::Marker(marker), "");
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
        if !name.is_empty() {
            self.name(name, colour, LegendShape::Line, dash);
        }
        self
    }

    /// Adds an entry of the legend.
    fn name(&mut self, label: &str, colour: &str, shape: LegendShape, dash: &str) {
        let dasharray = (!dash.is_empty()).then(|| dash.to_owned());
        let (label, color) = (label.to_owned(), colour.to_owned());
        self.legend.push(LegendEntry { label, color, shape, dasharray });
    }
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
fn power_of_ten(v: f64) -> String {
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
    panels: Vec<Panel>,
    caption: &str,
) -> Result<(), Box<dyn Error>> {
    save(&path.with_extension("svg"), &svg(columns, panels, caption))
}

/// Writes a text to a file, in a folder that is made where there is none.
pub(crate) fn save(path: &Path, text: &str) -> Result<(), Box<dyn Error>> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)
            .map_err(|e| format!("{}: {e}", files::printable(folder.display())))?;
    }
    Ok(files::write_together(&[(path, text)], |text, file| file.write_all(text.as_bytes()))?)
}

/// Draws `panels`, `columns` to a row, with one legend and a caption of some lines.
pub(crate) fn svg(columns: usize, panels: Vec<Panel>, caption: &str) -> String {
    let mut legend: Vec<LegendEntry> = vec![];
    for entry in panels.iter().flat_map(|panel| &panel.legend) {
        if legend.iter().all(|known| known.label != entry.label) {
            legend.push(entry.clone());
        }
    }
    let rows = panels.len().div_ceil(columns);
    let (mut plots, mut layouts) = (vec![], vec![]);
    for panel in panels {
        plots.push(panel.plots);
        layouts.push(panel.layout);
    }
    let figure = Figure::new(rows, columns)
        .with_cell_size(440.0, 340.0)
        .with_plots(plots)
        .with_layouts(layouts)
        .with_shared_legend_entries(legend)
        .with_shared_legend_position(FigureLegendPosition::RightTop);
    let mut scene = figure.render();
    for line in caption.lines() {
        scene.height += 16.0;
        scene.add(Primitive::Text {
            x: 12.0,
            y: scene.height - 10.0,
            content: line.to_owned(),
            size: 11,
            anchor: TextAnchor::Start,
            rotate: None,
            bold: false,
            color: None,
        });
    }
    SvgBackend::new().render_scene(&scene)
}

/// A heading and rows as a text.
pub(crate) fn csv(header: &str, rows: &[String]) -> String {
    format!("{header}\n{}\n", rows.join("\n"))
}

/// The command, the machine and the day, for captions.
pub(crate) fn provenance(command: &str) -> String {
    let cpu = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("unknown");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let day = Command::new("date").args(["-u", "+%Y-%m-%d"]).output();
    let day = day.map_or_else(|_| String::new(), |out| String::from_utf8_lossy(&out.stdout).into());
    let model = model.trim_start_matches([' ', '\t', ':']);
    format!("{command} · {model}, {cores} cores · {}", day.trim())
}
