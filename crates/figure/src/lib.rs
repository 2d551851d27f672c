//! Figures as SVG: panels one above the other over a common axis, usually time, each below its legend.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use thiserror::Error;

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
const WIDTH: u32 = 1100;
const PANEL_HEIGHT: u32 = 320;
const TITLE_HEIGHT: u32 = 44;
const MARGIN: u32 = 8;
const RIGHT_MARGIN: u32 = 24;
/// Width of the labels of the vertical axis.
const LABELS: u32 = 84;
/// Height of a row of a legend.
const LEGEND_HEIGHT: u32 = 20;
const LEGEND_FONT: u32 = 13;
/// Length of a line in a legend, and its distance from the text.
const SAMPLE: u32 = 20;
const SPACE: u32 = 6;

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
    let mut svg = String::new();
    let legends: Vec<Vec<Vec<usize>>> = panels.iter().map(legend).collect();
    let legend_height = |k: usize| LEGEND_HEIGHT * u32::try_from(legends[k].len()).unwrap_or(0);
    let panel_height = |k: usize| PANEL_HEIGHT + legend_height(k);
    let height = TITLE_HEIGHT + (0..panels.len()).map(panel_height).sum::<u32>().max(PANEL_HEIGHT);
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        let fail = |error: &dyn std::fmt::Display| PlotError(error.to_string());
        root.fill(&WHITE).map_err(|e| fail(&e))?;
        let (head, mut rest) = root.split_vertically(TITLE_HEIGHT);
        head.titled(title, ("sans-serif", 20)).map_err(|e| fail(&e))?;
        let time = range(panels.iter().flat_map(times), 0.0);
        for (k, panel) in panels.iter().enumerate() {
            let (area, below) = rest.split_vertically(panel_height(k));
            let (top, area) = area.split_vertically(legend_height(k));
            rest = below;
            draw_legend(&top, panel, &legends[k]).map_err(|e| fail(&e))?;
            let last = k + 1 == panels.len();
            draw_panel(&area, panel, time.clone(), if last { xlabel } else { "" })
                .map_err(|e| fail(&e))?;
        }
        root.present().map_err(|e| fail(&e))?;
    }
    Ok(svg)
}

type DrawArea<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawResult = Result<(), Box<dyn std::error::Error>>;

/// Width of a legend's entry, estimated from the mean width of letters.
fn entry_width(label: &str) -> u32 {
    let letters = u32::try_from(label.chars().count()).unwrap_or(u32::MAX);
    letters.saturating_mul(LEGEND_FONT * 3 / 5).saturating_add(SAMPLE + 4 * SPACE)
}

/// The curves in each row of a panel's legend. No rows without labels, or with more curves than colours.
fn legend(panel: &FigurePanel) -> Vec<Vec<usize>> {
    let lines = &panel.lines;
    let mut rows: Vec<Vec<usize>> = Vec::new();
    if lines.len() > COLOURS.len() || lines.iter().all(|line| line.label.is_empty()) {
        return rows;
    }
    let width = WIDTH - MARGIN - LABELS - RIGHT_MARGIN;
    let mut used = width;
    for (k, line) in lines.iter().enumerate() {
        let entry = entry_width(&line.label);
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

fn draw_legend(area: &DrawArea<'_>, panel: &FigurePanel, rows: &[Vec<usize>]) -> DrawResult {
    let font = ("sans-serif", LEGEND_FONT).into_text_style(area);
    let font = font.pos(Pos::new(HPos::Left, VPos::Center));
    let mut y = i32::try_from(LEGEND_HEIGHT / 2 + 2)?;
    for row in rows {
        let mut x = MARGIN + LABELS;
        for &k in row {
            let label = panel.lines[k].label.as_str();
            let (begin, end) = (i32::try_from(x)?, i32::try_from(x + SAMPLE)?);
            let style = COLOURS[k].stroke_width(3);
            area.draw(&PathElement::new([(begin, y), (end, y)], style))
                .map_err(|e| e.to_string())?;
            let text = (i32::try_from(x + SAMPLE + SPACE)?, y);
            area.draw(&Text::new(label, text, &font)).map_err(|e| e.to_string())?;
            x = x.saturating_add(entry_width(label));
        }
        y += i32::try_from(LEGEND_HEIGHT)?;
    }
    Ok(())
}

fn draw_panel(
    area: &DrawArea<'_>,
    panel: &FigurePanel,
    time: std::ops::Range<f64>,
    xlabel: &str,
) -> DrawResult {
    let values = range(panel.lines.iter().flat_map(|line| line.points.iter().map(|p| p.1)), 0.05);
    let digits = decimals(&values);
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN)
        .margin_right(RIGHT_MARGIN)
        .set_label_area_size(LabelAreaPosition::Left, LABELS)
        .set_label_area_size(LabelAreaPosition::Bottom, if xlabel.is_empty() { 26 } else { 46 })
        .build_cartesian_2d(time.clone(), values)
        .map_err(|e| e.to_string())?;
    let format_value = |y: &f64| axis_label(*y, digits);
    let time_digits = decimals(&time);
    let format_time = |t: &f64| format!("{t:.time_digits$}");
    chart
        .configure_mesh()
        .x_labels(12)
        .y_labels(7)
        .x_label_formatter(&format_time)
        .y_label_formatter(&format_value)
        .x_desc(xlabel)
        .y_desc(panel.ylabel.as_str())
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", 13))
        .light_line_style(RGBColor(242, 242, 242))
        .bold_line_style(RGBColor(220, 220, 220))
        .draw()
        .map_err(|e| e.to_string())?;
    for (k, line) in panel.lines.iter().enumerate() {
        let style = COLOURS[k % COLOURS.len()].stroke_width(1);
        chart
            .draw_series(LineSeries::new(line.points.iter().copied(), style))
            .map_err(|e| e.to_string())?;
    }
    Ok(())
}

fn times(panel: &FigurePanel) -> impl Iterator<Item = f64> {
    panel.lines.iter().flat_map(|line| line.points.iter().map(|point| point.0))
}

/// Smallest to largest value, widened by a fraction of the span; never empty.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> std::ops::Range<f64> {
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

/// A number as an axis label. Zero has no sign.
fn axis_label(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(size) if size.chars().all(|c| matches!(c, '0' | '.')) => size.to_owned(),
        _ => text,
    }
}

/// Decimals that distinguish neighbouring axis labels.
fn decimals(range: &std::ops::Range<f64>) -> usize {
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
            assert_eq!(legend(&panel).len(), rows, "{curves}");
            let svg = draw("t", &[panel]).unwrap();
            let labels = (1..=curves).filter(|k| svg.contains(&line(*k).label)).count();
            assert_eq!(labels, if rows > 0 { curves } else { 0 });
            let expected = TITLE_HEIGHT + PANEL_HEIGHT + 20 * u32::try_from(rows).unwrap();
            assert_eq!(height(&svg), expected);
        }
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
