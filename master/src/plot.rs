//! Pictures as SVG: panels above each other over a common time axis.

use plotters::coord::Shift;
use plotters::prelude::*;
use thiserror::Error;

/// Points that one picture may have, so that its file stays well below 1 MB.
pub const MAX_POINTS: u64 = 40_000;
/// Finest reduction of one curve: about one slice per pixel.
pub const MAX_SLICES: u64 = 1_000;

/// Okabe and Ito's colours, which colour-blind readers can tell apart; black comes last.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(160, 140, 0),
    RGBColor(0, 0, 0),
];
const WIDTH: u32 = 1100;
const PANEL_HEIGHT: u32 = 320;
const TITLE_HEIGHT: u32 = 44;
/// With more curves than this a legend would hide the panel.
const MAX_LEGEND: usize = 8;

/// A picture could not be drawn.
#[derive(Debug, Error)]
#[error("the picture cannot be drawn: {0}")]
pub struct PlotError(String);

/// One curve.
#[derive(Debug, Clone)]
pub struct Line {
    /// Text in the legend.
    pub label: String,
    /// Time and value, already scaled.
    pub points: Vec<(f64, f64)>,
}

/// One panel.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Label of the vertical axis.
    pub ylabel: String,
    /// Its curves.
    pub lines: Vec<Line>,
}

/// Slices per curve for a picture with that many curves.
#[must_use]
pub fn slices(curves: usize) -> u64 {
    let share = MAX_POINTS / 2 / u64::try_from(curves.max(1)).unwrap_or(u64::MAX);
    share.clamp(100, MAX_SLICES)
}

/// Draws a picture and returns it as SVG text.
///
/// # Errors
/// The drawing library fails.
pub fn draw(title: &str, panels: &[Panel]) -> Result<String, PlotError> {
    let mut svg = String::new();
    let rows = u32::try_from(panels.len().max(1)).unwrap_or(1);
    let height = TITLE_HEIGHT + rows.saturating_mul(PANEL_HEIGHT);
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        let fail = |error: &dyn std::fmt::Display| PlotError(error.to_string());
        root.fill(&WHITE).map_err(|e| fail(&e))?;
        let (head, body) = root.split_vertically(TITLE_HEIGHT);
        head.titled(title, ("sans-serif", 20)).map_err(|e| fail(&e))?;
        let time = range(panels.iter().flat_map(times), 0.0);
        let areas = body.split_evenly((panels.len().max(1), 1));
        for (k, (area, panel)) in areas.iter().zip(panels).enumerate() {
            let last = k + 1 == panels.len();
            draw_panel(area, panel, time.clone(), last).map_err(|e| fail(&e))?;
        }
        root.present().map_err(|e| fail(&e))?;
    }
    Ok(svg)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawResult = Result<(), Box<dyn std::error::Error>>;

fn draw_panel(
    area: &Area<'_>,
    panel: &Panel,
    time: std::ops::Range<f64>,
    last: bool,
) -> DrawResult {
    let values = range(panel.lines.iter().flat_map(|line| line.points.iter().map(|p| p.1)), 0.05);
    let digits = decimals(&values);
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(24)
        .set_label_area_size(LabelAreaPosition::Left, 84)
        .set_label_area_size(LabelAreaPosition::Bottom, if last { 46 } else { 26 })
        .build_cartesian_2d(time.clone(), values)
        .map_err(|e| e.to_string())?;
    let format_value = |y: &f64| format!("{:.digits$}", if *y == 0.0 { 0.0 } else { *y });
    let time_digits = decimals(&time);
    let format_time = |t: &f64| format!("{t:.time_digits$}");
    chart
        .configure_mesh()
        .x_labels(12)
        .y_labels(7)
        .x_label_formatter(&format_time)
        .y_label_formatter(&format_value)
        .x_desc(if last { "time (s)" } else { "" })
        .y_desc(panel.ylabel.as_str())
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", 13))
        .light_line_style(RGBColor(242, 242, 242))
        .bold_line_style(RGBColor(220, 220, 220))
        .draw()
        .map_err(|e| e.to_string())?;
    let legend = panel.lines.len() <= MAX_LEGEND && panel.lines.iter().any(|l| !l.label.is_empty());
    for (k, line) in panel.lines.iter().enumerate() {
        let style = COLOURS[k % COLOURS.len()].stroke_width(1);
        let drawn = chart
            .draw_series(LineSeries::new(line.points.iter().copied(), style))
            .map_err(|e| e.to_string())?;
        if legend {
            let thick = COLOURS[k % COLOURS.len()].stroke_width(3);
            drawn
                .label(line.label.as_str())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], thick));
        }
    }
    if legend {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(RGBColor(200, 200, 200))
            .label_font(("sans-serif", 13))
            .draw()
            .map_err(|e| e.to_string())?;
    }
    Ok(())
}

fn times(panel: &Panel) -> impl Iterator<Item = f64> {
    panel.lines.iter().flat_map(|line| line.points.iter().map(|point| point.0))
}

/// Smallest to largest value, widened by a share of the span; never empty.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> std::ops::Range<f64> {
    let (low, high) = values
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        return 0.0..1.0;
    }
    // a constant still needs an axis: as wide as its value is large
    let span = if high - low > 1e-9 * low.abs().max(high.abs()) {
        (high - low) * margin
    } else if low == 0.0 {
        1.0
    } else {
        0.01 * low.abs()
    };
    low - span..high + span
}

/// Decimals that tell neighbouring axis labels apart.
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
        let line = |k: usize| Line {
            label: format!("gap {k}"),
            points: (0..2 * n)
                .map(|i| (i as f64 * 0.0375, (i as f64 * 0.1).sin() + k as f64 * 0.01))
                .collect(),
        };
        let panel = Panel { ylabel: "gap (mm)".into(), lines: (0..64).map(line).collect() };
        let svg = draw("all gaps", &[panel]).unwrap();
        assert!(svg.len() < 1_000_000, "{}", svg.len());
        assert!(svg.contains("gap (mm)") && svg.contains("time (s)"));
    }

    #[test]
    fn issue_constant_empty_and_zero_curves_draw() {
        let lines = |points: Vec<(f64, f64)>| vec![Line { label: "x".into(), points }];
        for points in [vec![], vec![(0.0, 0.0)], vec![(0.0, 8.0), (1.0, 8.0)]] {
            let svg = draw("t", &[Panel { ylabel: "y".into(), lines: lines(points) }]).unwrap();
            assert!(svg.trim_end().ends_with("</svg>"));
        }
        draw("nothing", &[]).unwrap();
    }
}
