//! Figures in a plane: Bode, Nyquist and Nichols diagrams, root loci.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::{COLOURS, PlotError};

const WIDTH: u32 = 1100;
const TITLE: u32 = 44;
const ROW: u32 = 20;
const FONT: u32 = 13;
const MARGIN: u32 = 8;
const LABELS: u32 = 76;
const BELOW: u32 = 46;
const RIGHT: u32 = 24;
/// Length of a line in a legend, and its distance from the text.
const SAMPLE: u32 = 20;
const SPACE: u32 = 6;
/// Labels of an axis at most.
const TICKS: f64 = 9.0;

/// A curve.
#[derive(Debug, Clone, Default)]
pub struct PlaneLine {
    /// Text in the legend; none if it is empty.
    pub label: String,
    /// Points; one that is not finite interrupts the curve.
    pub points: Vec<(f64, f64)>,
    /// Whether it is a thin grey line behind the others.
    pub guide: bool,
}

/// A point with a text.
#[derive(Debug, Clone)]
pub struct PlaneMark {
    /// Its place.
    pub at: (f64, f64),
    /// The text beside it.
    pub text: String,
}

/// A panel with axes of its own.
#[derive(Debug, Clone, Default)]
pub struct PlanePanel {
    /// Labels of the horizontal and the vertical axis.
    pub labels: [String; 2],
    /// Whether the horizontal and the vertical axis are logarithmic.
    pub logarithmic: [bool; 2],
    /// Limits of both axes.
    pub limits: [Option<Range<f64>>; 2],
    /// Whether a unit has the same length on both axes. The vertical limits follow from the horizontal ones.
    pub equal: bool,
    /// The curves.
    pub lines: Vec<PlaneLine>,
    /// Points with texts.
    pub marks: Vec<PlaneMark>,
    /// Height in pixels.
    pub height: u32,
}

/// Draws panels one above the other and returns SVG text.
///
/// # Errors
/// The drawing library fails.
pub fn draw_plane(title: &str, panels: &[PlanePanel]) -> Result<String, PlotError> {
    let mut svg = String::new();
    let height = TITLE + panels.iter().map(|panel| panel.height + legend(panel).1).sum::<u32>();
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        let fail = |error: &dyn std::fmt::Display| PlotError(error.to_string());
        root.fill(&WHITE).map_err(|e| fail(&e))?;
        let (head, mut rest) = root.split_vertically(TITLE);
        head.titled(title, ("sans-serif", 20)).map_err(|e| fail(&e))?;
        for panel in panels {
            let (entries, rows) = legend(panel);
            let (area, below) = rest.split_vertically(panel.height + rows);
            let (top, area) = area.split_vertically(rows);
            rest = below;
            draw_legend(&top, &entries).map_err(|e| fail(&e))?;
            draw_panel(&area, panel).map_err(|e| fail(&e))?;
        }
        root.present().map_err(|e| fail(&e))?;
    }
    Ok(svg)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

/// A text of the legend with its colour and place.
struct Entry<'a> {
    label: &'a str,
    colour: RGBColor,
    at: (u32, u32),
}

/// Colours of the lines that are no guides, in their order.
fn coloured(panel: &PlanePanel) -> impl Iterator<Item = (&PlaneLine, RGBColor)> {
    let lines = panel.lines.iter().filter(|line| !line.guide);
    lines.zip(COLOURS.iter().copied().cycle())
}

/// The legend's entries, and its height.
fn legend(panel: &PlanePanel) -> (Vec<Entry<'_>>, u32) {
    let (mut x, mut y) = (MARGIN + LABELS, 0);
    let mut entries = Vec::new();
    for (line, colour) in coloured(panel).filter(|(line, _)| !line.label.is_empty()) {
        let letters = u32::try_from(line.label.chars().count()).unwrap_or(u32::MAX);
        let width = letters.saturating_mul(FONT * 3 / 5).saturating_add(SAMPLE + 4 * SPACE);
        if x > MARGIN + LABELS && x.saturating_add(width) > WIDTH - RIGHT {
            (x, y) = (MARGIN + LABELS, y + ROW);
        }
        entries.push(Entry { label: &line.label, colour, at: (x, y) });
        x = x.saturating_add(width);
    }
    let rows = if entries.is_empty() { 0 } else { y + ROW };
    (entries, rows)
}

fn draw_legend(area: &Area<'_>, entries: &[Entry<'_>]) -> Drawn {
    let font = ("sans-serif", FONT).into_text_style(area).pos(Pos::new(HPos::Left, VPos::Center));
    for Entry { label, colour, at } in entries {
        let (x, y) = (i32::try_from(at.0)?, i32::try_from(at.1 + ROW / 2)?);
        let (sample, space) = (i32::try_from(SAMPLE)?, i32::try_from(SPACE)?);
        area.draw(&PathElement::new([(x, y), (x + sample, y)], colour.stroke_width(3)))
            .map_err(|e| e.to_string())?;
        area.draw(&Text::new(*label, (x + sample + space, y), &font)).map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// An axis on which places are values or their logarithms.
struct Axis {
    log: bool,
    range: Range<f64>,
    ticks: Vec<f64>,
    digits: usize,
}

impl Axis {
    fn new(log: bool, range: Range<f64>) -> Self {
        let (ticks, digits) = if log { (decades(&range), 0) } else { even(&range) };
        Self { log, range, ticks, digits }
    }

    fn scale(&self) -> Scale {
        Scale { places: self.range.clone().into(), ticks: self.ticks.clone() }
    }

    fn place(log: bool, value: f64) -> f64 {
        match log {
            false => value,
            true if value > 0.0 => value.log10(),
            true => f64::NAN,
        }
    }

    fn label(&self, place: f64) -> String {
        if self.log {
            let value = 10_f64.powf(place);
            if !(-3.1..4.1).contains(&place) {
                return power_of_ten(value, place);
            }
            return format!("{value:.*}", if value < 1.0 { (-place).ceil() as usize } else { 0 });
        }
        let digits = self.digits;
        let text = format!("{place:.digits$}");
        if text.trim_start_matches(['-', '0', '.']).is_empty() {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    }
}

/// A large or small number, such as 2·10⁻⁷.
fn power_of_ten(value: f64, place: f64) -> String {
    let power = (place + 1e-9).floor();
    let raised: String = format!("{power}")
        .chars()
        .map(|letter| match letter {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            _ => letter.to_digit(10).and_then(|it| char::from_u32(0x2070 + it)).unwrap_or(letter),
        })
        .collect();
    let digit = (value / 10_f64.powf(power)).round();
    if digit > 1.0 { format!("{digit}·10{raised}") } else { format!("10{raised}") }
}

/// Even places with chosen ticks.
struct Scale {
    places: RangedCoordf64,
    ticks: Vec<f64>,
}

impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.places.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.places.range()
    }
}

/// Places of 1, 2 and 5 times the powers of ten, or of these alone.
fn decades(range: &Range<f64>) -> Vec<f64> {
    let digits: &[f64] = if range.end - range.start < 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let powers = (range.start.floor() as i32)..=(range.end.ceil() as i32);
    let all = powers.flat_map(|power| digits.iter().map(move |d| d.log10() + f64::from(power)));
    all.filter(|it| range.start - 1e-9 <= *it && *it <= range.end + 1e-9).collect()
}

/// Even places, and the decimals that distinguish them.
fn even(range: &Range<f64>) -> (Vec<f64>, usize) {
    let rough = (range.end - range.start) / TICKS;
    let power = 10_f64.powf(rough.log10().floor());
    // phases in steps of 45° or 90°
    let steps = if rough > 20.0 && rough < 150.0 {
        [45.0, 90.0, 180.0]
    } else {
        [2.0, 5.0, 10.0].map(|it| it * power)
    };
    let step = steps.into_iter().find(|it| *it >= rough).unwrap_or(10.0 * power);
    let first = (range.start / step).ceil() as i64;
    let last = (range.end / step).floor() as i64;
    let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    ((first..=last).map(|k| k as f64 * step).collect(), digits)
}

/// Limits of an axis, as places: given, or of all points with some space around.
fn limits(panel: &PlanePanel, axis: usize, within: Option<&Range<f64>>) -> Range<f64> {
    let log = panel.logarithmic[axis];
    if let Some(given) = &panel.limits[axis] {
        return Axis::place(log, given.start)..Axis::place(log, given.end);
    }
    let points = panel.lines.iter().filter(|line| !line.guide).flat_map(|line| &line.points);
    let shown = points.filter(|point| {
        let x = Axis::place(panel.logarithmic[0], point.0);
        within.is_none_or(|range| range.start <= x && x <= range.end)
    });
    let values = shown.map(|point| Axis::place(log, if axis == 0 { point.0 } else { point.1 }));
    let (low, high) = values
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        return 0.0..1.0;
    }
    let span = if high > low { high - low } else { low.abs().max(1.0) };
    let space = if axis == 0 && log { 0.0 } else { 0.05 * span };
    low - space..high + space
}

fn draw_panel(area: &Area<'_>, panel: &PlanePanel) -> Drawn {
    let across = limits(panel, 0, None);
    let mut up = limits(panel, 1, Some(&across));
    if panel.equal {
        let pixels = |length: u32, axis: u32| f64::from(length.saturating_sub(axis));
        let width = pixels(WIDTH, 2 * MARGIN + LABELS + RIGHT);
        let height = pixels(panel.height, 2 * MARGIN + BELOW);
        let half = 0.5 * (across.end - across.start) * height / width;
        let middle = 0.5 * (up.start + up.end);
        up = middle - half..middle + half;
    }
    let (x, y) = (Axis::new(panel.logarithmic[0], across), Axis::new(panel.logarithmic[1], up));
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN)
        .margin_right(RIGHT)
        .set_label_area_size(LabelAreaPosition::Left, LABELS)
        .set_label_area_size(LabelAreaPosition::Bottom, BELOW)
        .build_cartesian_2d(x.scale(), y.scale())
        .map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .x_labels(x.ticks.len().max(1))
        .y_labels(y.ticks.len().max(1))
        .x_label_formatter(&|place| x.label(*place))
        .y_label_formatter(&|place| y.label(*place))
        .x_desc(panel.labels[0].as_str())
        .y_desc(panel.labels[1].as_str())
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", FONT))
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(220, 220, 220))
        .draw()
        .map_err(|e| e.to_string())?;
    let place = |point: &(f64, f64)| (Axis::place(x.log, point.0), Axis::place(y.log, point.1));
    let guides = panel.lines.iter().filter(|line| line.guide);
    let guides = guides.map(|line| (line, RGBColor(150, 150, 150).stroke_width(1)));
    let curves = coloured(panel).map(|(line, colour)| (line, colour.stroke_width(2)));
    for (line, style) in guides.chain(curves) {
        for piece in line.points.split(|it| !(it.0.is_finite() && it.1.is_finite())) {
            for visible in clipped(piece.iter().map(place), [&x.range, &y.range]) {
                chart.draw_series(LineSeries::new(visible, style)).map_err(|e| e.to_string())?;
            }
        }
    }
    let font = ("sans-serif", FONT).into_text_style(area).pos(Pos::new(HPos::Left, VPos::Bottom));
    for mark in &panel.marks {
        let at = place(&mark.at);
        if !(x.range.contains(&at.0) && y.range.contains(&at.1)) {
            continue;
        }
        let element = EmptyElement::at(at)
            + Circle::new((0, 0), 4, BLACK.filled())
            + Text::new(mark.text.clone(), (7, -4), font.clone());
        chart.draw_series([element]).map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// The pieces of a curve inside a rectangle.
fn clipped(
    points: impl Iterator<Item = (f64, f64)>,
    [across, up]: [&Range<f64>; 2],
) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut before: Option<(f64, f64)> = None;
    for point in points {
        if let Some(before) = before
            && let Some((a, b)) = segment(before, point, across, up)
        {
            match pieces.last_mut().filter(|piece| piece.last() == Some(&a)) {
                Some(piece) => piece.push(b),
                None => pieces.push(vec![a, b]),
            }
        }
        before = Some(point);
    }
    pieces
}

/// A straight line cut to a rectangle (Liang and Barsky 1984).
fn segment(
    a: (f64, f64),
    b: (f64, f64),
    across: &Range<f64>,
    up: &Range<f64>,
) -> Option<((f64, f64), (f64, f64))> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let borders = [
        (-dx, a.0 - across.start),
        (dx, across.end - a.0),
        (-dy, a.1 - up.start),
        (dy, up.end - a.1),
    ];
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for (p, q) in borders {
        if p == 0.0 {
            if q < 0.0 {
                return None;
            }
        } else if p < 0.0 {
            first = first.max(q / p);
        } else {
            last = last.min(q / p);
        }
    }
    let at = |share: f64| match share {
        0.0 => a,
        1.0 => b,
        _ => (a.0 + share * dx, a.1 + share * dy),
    };
    (first < last || (first == last && first == 0.0 && last == 1.0)).then(|| (at(first), at(last)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_lines_are_cut_at_the_border() {
        let inside = [&(0.0..1.0), &(0.0..1.0)];
        let path = [(-1.0, 0.5), (0.5, 0.5), (0.5, 3.0), (0.75, 3.0), (0.75, 0.25)];
        let found = clipped(path.into_iter(), inside);
        assert_eq!(
            found,
            vec![vec![(0.0, 0.5), (0.5, 0.5), (0.5, 1.0)], vec![(0.75, 1.0), (0.75, 0.25)]]
        );
        assert!(clipped([(-1.0, 2.0), (2.0, 2.0)].into_iter(), inside).is_empty());
    }

    #[test]
    fn issue_axes_have_round_labels() {
        let axis = Axis::new(false, -270.0..90.0);
        let labels: Vec<String> = axis.ticks.iter().map(|it| axis.label(*it)).collect();
        assert_eq!(labels, ["-270", "-225", "-180", "-135", "-90", "-45", "0", "45", "90"]);
        let axis = Axis::new(true, -1.0..2.0);
        let labels: Vec<String> = axis.ticks.iter().map(|it| axis.label(*it)).collect();
        assert_eq!(labels, ["0.1", "1", "10", "100"]);
        let axis = Axis::new(true, -8.0..-6.0);
        let labels: Vec<String> = axis.ticks.iter().map(|it| axis.label(*it)).collect();
        assert_eq!(labels[..4], ["10⁻⁸", "2·10⁻⁸", "5·10⁻⁸", "10⁻⁷"]);
        let axis = Axis::new(false, -0.5..0.5);
        assert!(axis.ticks.iter().any(|it| axis.label(*it) == "0.0"));
    }

    #[test]
    fn issue_empty_and_infinite_curves_draw() {
        let points = vec![(1.0, 0.0), (f64::INFINITY, 2.0), (10.0, f64::NAN), (100.0, 1.0)];
        let line = PlaneLine { label: "x".into(), points, guide: false };
        let panel = |lines| PlanePanel {
            logarithmic: [true, false],
            lines,
            height: 300,
            ..PlanePanel::default()
        };
        let svg = draw_plane("t", &[panel(vec![]), panel(vec![line])]).unwrap();
        assert!(svg.trim_end().ends_with("</svg>"));
    }
}
