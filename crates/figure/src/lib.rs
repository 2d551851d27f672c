//! Figures as SVG: panels one above the other over a common axis, usually time, each below its legend.

mod axis;
mod clip;
mod heat;
mod plane;
mod style;

use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use thiserror::Error;

use axis::Axis;
pub use heat::{HeatMap, HeatMark, draw_heat_map};
pub use plane::{PlaneLine, PlaneMark, PlanePanel, draw_plane};
pub use style::FigureStyle;
use style::Layout;

/// Most points of a figure, so that its file stays well below 1 MB.
pub const MAX_POINTS: u64 = 40_000;
/// Finest reduction of one curve: about one slice per pixel.
pub const MAX_SLICES: u64 = 1_000;

/// Palette of Okabe and Ito, which colour-blind readers can distinguish, with further dark colours.
const COLOURS: [RGBColor; 12] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(160, 140, 0),
    RGBColor(0, 0, 0),
    RGBColor(136, 34, 85),
    RGBColor(128, 128, 128),
    RGBColor(17, 80, 40),
    RGBColor(150, 80, 20),
];
const PANEL_HEIGHT: u32 = 320;
/// Height of a row of a legend.
const LEGEND_HEIGHT: u32 = 20;
/// Length of a line in a legend, and its distance from the text.
const SAMPLE: u32 = 20;
const SPACE: u32 = 6;
/// Least height and width of a panel with its axes.
const LEAST_HEIGHT: u32 = 60;

/// A figure could not be drawn.
#[derive(Debug, Error)]
#[error("cannot draw the figure: {0}")]
pub struct PlotError(String);

/// A curve of a panel.
#[derive(Debug, Clone)]
pub struct FigureLine {
    /// Text in the legend.
    pub label: String,
    /// Time, or position along the horizontal axis, and value, both scaled.
    pub points: Vec<(f64, f64)>,
}

/// A panel of a figure.
#[derive(Debug, Clone)]
pub struct FigurePanel {
    /// Label of the vertical axis.
    pub ylabel: String,
    /// Curves in the order of the colours.
    pub lines: Vec<FigureLine>,
}

/// Slices per curve for a figure with a number of curves.
#[must_use]
pub fn slices(curves: usize) -> u64 {
    let share = MAX_POINTS / 2 / u64::try_from(curves.max(1)).unwrap_or(u64::MAX);
    share.clamp(100, MAX_SLICES)
}

/// Draws a figure over time and returns it as SVG text.
///
/// # Errors
/// The drawing library fails.
pub fn draw(title: &str, panels: &[FigurePanel]) -> Result<String, PlotError> {
    draw_over(title, "time (s)", panels)
}

/// Draws a figure over another axis with the label `xlabel`.
///
/// # Errors
/// The drawing library fails.
pub fn draw_over(title: &str, xlabel: &str, panels: &[FigurePanel]) -> Result<String, PlotError> {
    draw_styled(title, xlabel, panels, &FigureStyle::default())
}

/// Draws a figure with a size, limits and axes of one's own. Without a title it has no line for one.
///
/// # Errors
/// The drawing library fails, or the size has no room for the panels.
pub fn draw_styled(
    title: &str,
    xlabel: &str,
    panels: &[FigurePanel],
    style: &FigureStyle,
) -> Result<String, PlotError> {
    let layout = style.layout();
    let legends: Vec<Vec<Vec<usize>>> = panels.iter().map(|it| legend(it, &layout)).collect();
    let legend_height = |k: usize| LEGEND_HEIGHT * u32::try_from(legends[k].len()).unwrap_or(0);
    let all_legends = (0..panels.len()).map(legend_height).sum::<u32>();
    let title_height = if title.is_empty() && style.size.is_some() { 0 } else { layout.title };
    let count = u32::try_from(panels.len().max(1)).unwrap_or(u32::MAX);
    let plot = match layout.height {
        None => PANEL_HEIGHT,
        Some(height) => height.saturating_sub(title_height + all_legends) / count,
    };
    if plot < LEAST_HEIGHT || layout.width < layout.labels + LEAST_HEIGHT {
        return Err(PlotError(format!(
            "its size has no room for {count} panels with their legends; make it larger"
        )));
    }
    let height = layout.height.unwrap_or(title_height + all_legends + PANEL_HEIGHT * count);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (layout.width, height)).into_drawing_area();
        let fail = |error: &dyn std::fmt::Display| PlotError(error.to_string());
        root.fill(&WHITE).map_err(|e| fail(&e))?;
        let (head, mut rest) = root.split_vertically(title_height);
        if title_height > 0 {
            head.titled(title, ("sans-serif", layout.title_font)).map_err(|e| fail(&e))?;
        }
        let everything = range(panels.iter().flat_map(times), 0.0);
        let across = Axis::new(style.across.clone(), everything, style.log_across, || {
            smallest(panels.iter().flat_map(times))
        });
        for (k, panel) in panels.iter().enumerate() {
            let (area, below) = rest.split_vertically(plot + legend_height(k));
            let (top, area) = area.split_vertically(legend_height(k));
            rest = below;
            draw_legend(&top, panel, &legends[k], &layout).map_err(|e| fail(&e))?;
            let visible = panel.lines.iter().flat_map(|line| &line.points);
            let values = || visible.clone().filter(|it| across.shows(it.0)).map(|it| it.1);
            let up = style.limits(&panel.ylabel);
            let up = Axis::new(up, range(values(), 0.05), style.log_up, || smallest(values()));
            let last = k + 1 == panels.len();
            let drawn =
                DrawnPanel { panel, layout: &layout, xlabel: if last { xlabel } else { "" } };
            drawn.draw(&area, &across, &up).map_err(|e| fail(&e))?;
        }
        root.present().map_err(|e| fail(&e))?;
    }
    Ok(svg)
}

type DrawArea<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawResult = Result<(), Box<dyn std::error::Error>>;

/// Width of a legend's entry, estimated from the mean width of letters.
fn entry_width(label: &str, font: u32) -> u32 {
    let letters = u32::try_from(label.chars().count()).unwrap_or(u32::MAX);
    letters.saturating_mul(font * 3 / 5).saturating_add(SAMPLE + 4 * SPACE)
}

/// The curves in each row of a panel's legend. No rows without labels, or with more curves than colours.
fn legend(panel: &FigurePanel, layout: &Layout) -> Vec<Vec<usize>> {
    let lines = &panel.lines;
    let mut rows: Vec<Vec<usize>> = Vec::new();
    if lines.len() > COLOURS.len() || lines.iter().all(|line| line.label.is_empty()) {
        return rows;
    }
    let width = layout.width.saturating_sub(layout.margin + layout.labels + layout.right_margin);
    let mut used = width;
    for (k, line) in lines.iter().enumerate() {
        let entry = entry_width(&line.label, layout.font);
        match rows.last_mut().filter(|_| used.saturating_add(entry) <= width) {
            Some(row) => row.push(k),
            None => {
                rows.push(vec![k]);
                used = 0;
            }
        }
        used = used.saturating_add(entry);
    }
    rows
}

fn draw_legend(
    area: &DrawArea<'_>,
    panel: &FigurePanel,
    rows: &[Vec<usize>],
    layout: &Layout,
) -> DrawResult {
    let font = ("sans-serif", layout.font).into_text_style(area);
    let font = font.pos(Pos::new(HPos::Left, VPos::Center));
    let mut y = i32::try_from(LEGEND_HEIGHT / 2 + 2)?;
    for row in rows {
        let mut x = layout.margin + layout.labels;
        for &k in row {
            let label = panel.lines[k].label.as_str();
            let (begin, end) = (i32::try_from(x)?, i32::try_from(x + SAMPLE)?);
            let style = COLOURS[k].stroke_width(3);
            area.draw(&PathElement::new([(begin, y), (end, y)], style))
                .map_err(|e| e.to_string())?;
            let text = (i32::try_from(x + SAMPLE + SPACE)?, y);
            area.draw(&Text::new(label, text, &font)).map_err(|e| e.to_string())?;
            x = x.saturating_add(entry_width(label, layout.font));
        }
        y += i32::try_from(LEGEND_HEIGHT)?;
    }
    Ok(())
}

/// A panel with what it shares with the others.
struct DrawnPanel<'a> {
    panel: &'a FigurePanel,
    layout: &'a Layout,
    /// Label of the horizontal axis, empty but for the last panel.
    xlabel: &'a str,
}

impl DrawnPanel<'_> {
    fn draw(&self, area: &DrawArea<'_>, across: &Axis, up: &Axis) -> DrawResult {
        let Self { panel, layout, xlabel } = self;
        let below = layout.below[usize::from(xlabel.is_empty())];
        let mut chart = ChartBuilder::on(area)
            .margin(layout.margin)
            .margin_right(layout.right_margin)
            .set_label_area_size(LabelAreaPosition::Left, layout.labels)
            .set_label_area_size(LabelAreaPosition::Bottom, below)
            .build_cartesian_2d(across.scale(), up.scale())
            .map_err(|e| e.to_string())?;
        let format_value = |y: &f64| up.label(*y);
        let format_place = |x: &f64| across.label(*x);
        let (width, height) = area.dim_in_pixel();
        chart
            .configure_mesh()
            .x_labels(usize::try_from(width / 90)?.clamp(3, 12))
            .y_labels(usize::try_from(height / 42)?.clamp(3, 7))
            .x_label_formatter(&format_place)
            .y_label_formatter(&format_value)
            .x_desc(*xlabel)
            .y_desc(panel.ylabel.as_str())
            .axis_desc_style(("sans-serif", layout.axis_font))
            .label_style(("sans-serif", layout.font))
            .light_line_style(RGBColor(242, 242, 242))
            .bold_line_style(RGBColor(220, 220, 220))
            .draw()
            .map_err(|e| e.to_string())?;
        let (shown_across, shown_up) = (across.range(), up.range());
        for (k, line) in panel.lines.iter().enumerate() {
            let style = COLOURS[k % COLOURS.len()].stroke_width(1);
            let points = line.points.iter().map(|it| (across.place(it.0), up.place(it.1)));
            let points: Vec<(f64, f64)> = points.collect();
            for part in clip::clip(&points, &shown_across, &shown_up) {
                chart.draw_series(LineSeries::new(part, style)).map_err(|e| e.to_string())?;
            }
        }
        Ok(())
    }
}

fn times(panel: &FigurePanel) -> impl Iterator<Item = f64> {
    panel.lines.iter().flat_map(|line| line.points.iter().map(|point| point.0))
}

/// Smallest to largest value, widened by a fraction of the span; never empty.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> Range<f64> {
    let (low, high) = values
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        return 0.0..1.0;
    }
    // the axis of a constant is as wide as 1 % of its value
    let span = if high - low > 1e-9 * low.abs().max(high.abs()) {
        (high - low) * margin
    } else if low == 0.0 {
        1.0
    } else {
        0.01 * low.abs()
    };
    low - span..high + span
}

/// The smallest positive value, for a logarithmic axis.
fn smallest(values: impl Iterator<Item = f64>) -> f64 {
    values.filter(|it| *it > 0.0).fold(f64::INFINITY, f64::min)
}

/// A number as an axis label. Zero has no sign.
fn axis_label(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(size) if size.chars().all(|c| matches!(c, '0' | '.')) => size.to_owned(),
        _ => text,
    }
}

/// Decimals that distinguish neighbouring axis labels.
fn decimals(range: &Range<f64>) -> usize {
    let tick = (range.end - range.start) / 10.0;
    let magnitude = -tick.log10().floor();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..9")]
    if magnitude.is_finite() { magnitude.clamp(0.0, 9.0) as usize } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_many_curves_stay_below_a_megabyte() {
        let n = slices(64);
        let line = |k: usize| FigureLine {
            label: format!("gap {k}"),
            points: (0..2 * n)
                .map(|i| (i as f64 * 0.0375, (i as f64 * 0.1).sin() + k as f64 * 0.01))
                .collect(),
        };
        let panel = FigurePanel { ylabel: "gap (mm)".into(), lines: (0..64).map(line).collect() };
        let svg = draw("all gaps", &[panel]).unwrap();
        assert!(svg.len() < 1_000_000, "{}", svg.len());
        assert!(svg.contains("gap (mm)") && svg.contains("time (s)"));
    }

    /// Every label occurs once, rows wrap, and the panel below keeps its height.
    #[test]
    fn issue_the_legend_stands_above_the_panel_and_covers_nothing() {
        let line = |k: usize| FigureLine {
            label: format!("vehicle.gap_{k:02} of the bogie"),
            points: vec![(0.0, 0.0), (1.0, k as f64)],
        };
        let height = |svg: &str| -> u32 {
            let at = svg.find("height=\"").unwrap() + 8;
            svg[at..].split('"').next().unwrap().parse().unwrap()
        };
        for (curves, rows) in [(1, 1), (4, 1), (5, 2), (12, 3), (13, 0)] {
            let panel = FigurePanel { ylabel: "y".into(), lines: (1..=curves).map(line).collect() };
            let layout = FigureStyle::default().layout();
            assert_eq!(legend(&panel, &layout).len(), rows, "{curves}");
            let svg = draw("t", &[panel]).unwrap();
            let labels = (1..=curves).filter(|k| svg.contains(&line(*k).label)).count();
            assert_eq!(labels, if rows > 0 { curves } else { 0 });
            let expected = layout.title + PANEL_HEIGHT + 20 * u32::try_from(rows).unwrap();
            assert_eq!(height(&svg), expected);
        }
    }

    /// A column of a paper: 90 mm x 60 mm, logarithmic, within limits, without title.
    #[test]
    fn issue_a_figure_has_the_size_axes_and_limits_asked_for() {
        let points: Vec<(f64, f64)> =
            (1..=4000).map(|k| (f64::from(k) * 0.1, 1e-3 / f64::from(k))).collect();
        let panel = FigurePanel {
            ylabel: "y".into(),
            lines: vec![FigureLine { label: "a".into(), points }],
        };
        let style = FigureStyle {
            size: Some((90.0, 60.0)),
            across: Some(1.0..100.0),
            up: vec![(Some("other".into()), 5.0..6.0), (None, 1e-6..1e-3)],
            log_across: true,
            log_up: true,
        };
        let svg = draw_styled("", "f", std::slice::from_ref(&panel), &style).unwrap();
        assert!(svg.contains("width=\"340\" height=\"227\""), "{}", &svg[..300]);
        for label in [">\n1\n<", ">\n10\n<", ">\n100\n<", "10⁻⁵", ">\n0.001\n<"] {
            assert!(svg.contains(label), "{label}");
        }
        // the curve falls by a decade per decade: equal slopes of a straight line within the frame
        let line = svg.split("<polyline").filter(|it| it.contains("#0072B2")).last().unwrap();
        let line = line.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
        let places: Vec<(f64, f64)> = line
            .split_whitespace()
            .map(|it| it.split_once(',').unwrap())
            .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
            .collect();
        let (first, last) = (places[0], places[places.len() - 1]);
        for (x, y) in &places {
            let part = (x - first.0) / (last.0 - first.0);
            assert!((first.1 + part * (last.1 - first.1) - y).abs() <= 1.5, "{x} {y}");
        }
        let small = FigureStyle { size: Some((10.0, 10.0)), ..style };
        assert!(
            draw_styled("", "f", &[panel], &small).unwrap_err().to_string().contains("no room")
        );
    }

    #[test]
    fn issue_zero_on_an_axis_has_no_sign() {
        assert_eq!(axis_label(-2e-17, 2), "0.00");
        assert_eq!(axis_label(-0.0, 0), "0");
        assert_eq!(axis_label(-0.4, 1), "-0.4");
        assert_eq!(axis_label(10.0, 1), "10.0");
    }

    #[test]
    fn issue_constant_empty_and_zero_curves_draw() {
        let lines = |points: Vec<(f64, f64)>| vec![FigureLine { label: "x".into(), points }];
        for points in [vec![], vec![(0.0, 0.0)], vec![(0.0, 8.0), (1.0, 8.0)]] {
            let svg =
                draw("t", &[FigurePanel { ylabel: "y".into(), lines: lines(points) }]).unwrap();
            assert!(svg.trim_end().ends_with("</svg>"));
        }
        draw("nothing", &[]).unwrap();
    }
}
