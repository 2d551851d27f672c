//! A heat map with the line where its values are zero.

use std::collections::HashMap;
use std::fmt::Write as _;

use crate::{PlotError, axis_label, decimals};

/// Values over a grid.
#[derive(Debug, Clone)]
pub struct HeatMap {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis.
    pub xlabel: String,
    /// Label of the vertical axis.
    pub ylabel: String,
    /// Label of the colours.
    pub legend: String,
    /// Columns, ascending.
    pub x: Vec<f64>,
    /// Rows, ascending.
    pub y: Vec<f64>,
    /// Values row by row. Cells without a finite value are grey.
    pub values: Vec<Vec<f64>>,
    /// Largest size that the colours show.
    pub largest: f64,
    /// Labelled points.
    pub marks: Vec<HeatMark>,
    /// A point that is emphasised.
    pub own: Option<(f64, f64)>,
    /// Where the values are zero between neighbours, if that is known: row and column of the first, whether the other one
    /// is next to it in the row (or else in the column), and the part of the way to it. Elsewhere the line is
    /// interpolated.
    pub crossings: HashMap<(usize, usize, bool), f64>,
}

/// A labelled point.
#[derive(Debug, Clone)]
pub struct HeatMark {
    /// Place on the horizontal axis.
    pub x: f64,
    /// Place on the vertical axis.
    pub y: f64,
    /// Points of one kind have one colour.
    pub kind: String,
    /// Text beside it.
    pub label: String,
}

const WIDTH: f64 = 1100.0;
const HEIGHT: f64 = 760.0;
const LEFT: f64 = 96.0;
const TOP: f64 = 56.0;
const PLOT: (f64, f64) = (800.0, 610.0);
/// Steps of colour on each side of zero.
const STEPS: usize = 10;
/// Colours of the kinds of marks, after Okabe and Ito.
const KINDS: [&str; 4] = ["#000000", "#009e73", "#cc79a7", "#56b4e9"];

/// Draws a heat map: orange below zero, blue above, a black line between.
///
/// # Errors
/// There are no values, or rows of different length.
pub fn draw_heat_map(map: &HeatMap) -> Result<String, PlotError> {
    let (nx, ny) = (map.x.len(), map.y.len());
    if nx == 0 || ny == 0 || map.values.len() != ny || map.values.iter().any(|row| row.len() != nx)
    {
        return Err(PlotError("the heat map's rows and columns do not fit its axes".to_owned()));
    }
    let mut svg = String::new();
    // writing to a String cannot fail
    let _ = write!(
        svg,
        "<svg width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
    );
    text(&mut svg, (LEFT + PLOT.0 / 2.0, 32.0), 20.0, "middle", &map.title);
    let scale = Scale::new(map);
    let frame = Frame { x: edges(&map.x), y: edges(&map.y) };
    svg.push_str("<g shape-rendering=\"crispEdges\">\n");
    cells(&mut svg, map, &frame, &scale);
    svg.push_str("</g>\n");
    boundary(&mut svg, map, &frame, &scale);
    axes(&mut svg, map, &frame);
    scale.draw(&mut svg, &map.legend);
    marks(&mut svg, map, &frame);
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// Where the values of the axes are: a cell reaches half way to its neighbours.
struct Frame {
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Frame {
    fn across(&self, x: f64) -> f64 {
        let (first, last) = ends(&self.x);
        LEFT + (x - first) / (last - first) * PLOT.0
    }

    fn up(&self, y: f64) -> f64 {
        let (first, last) = ends(&self.y);
        TOP + PLOT.1 - (y - first) / (last - first) * PLOT.1
    }
}

fn ends(edges: &[f64]) -> (f64, f64) {
    (edges.first().copied().unwrap_or(0.0), edges.last().copied().unwrap_or(1.0))
}

fn edges(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    if n == 1 {
        let half = 0.5 * values[0].abs().max(1.0);
        return vec![values[0] - half, values[0] + half];
    }
    let middle = |k: usize| 0.5 * (values[k - 1] + values[k]);
    let mut all = vec![1.5 * values[0] - 0.5 * values[1]];
    all.extend((1..n).map(middle));
    all.push(1.5 * values[n - 1] - 0.5 * values[n - 2]);
    all
}

/// Colours by value.
struct Scale {
    below: f64,
    above: f64,
}

impl Scale {
    fn new(map: &HeatMap) -> Self {
        let all = || map.values.iter().flatten().copied().filter(|v| v.is_finite());
        let above = all().fold(0.0, f64::max).clamp(1e-6, map.largest.max(1e-6));
        let below = all().fold(0.0, |low: f64, v| low.max(-v)).min(above.max(0.25 * map.largest));
        Self { below, above }
    }

    /// Steps from zero, negative below it; 0 if there is no value.
    fn step(&self, value: f64) -> i32 {
        if !value.is_finite() {
            return 0;
        }
        let steps =
            |size: f64| ((size * STEPS as f64).floor() as i32).clamp(0, STEPS as i32 - 1) + 1;
        if value >= 0.0 {
            steps(value / self.above)
        } else {
            -steps(-value / self.below.max(1e-12))
        }
    }

    fn colour(step: i32) -> String {
        if step == 0 {
            return "#bdbdbd".to_owned();
        }
        let part = f64::from(step.abs()) / STEPS as f64;
        let (light, dark) = if step > 0 {
            ([222.0, 235.0, 247.0], [8.0, 81.0, 156.0])
        } else {
            ([254.0, 224.0, 182.0], [153.0, 52.0, 4.0])
        };
        let mix = |k: usize| light[k] + (dark[k] - light[k]) * part;
        format!("#{:02x}{:02x}{:02x}", mix(0) as u8, mix(1) as u8, mix(2) as u8)
    }

    fn draw(&self, svg: &mut String, legend: &str) {
        let left = LEFT + PLOT.0 + 28.0;
        let all: Vec<i32> =
            (1..=STEPS as i32).rev().chain((1..=STEPS as i32).map(|k| -k)).collect();
        let all: Vec<i32> = all.into_iter().filter(|k| *k > 0 || self.below > 0.0).collect();
        let height = PLOT.1 / all.len() as f64;
        for (k, step) in all.iter().enumerate() {
            let y = TOP + height * k as f64;
            let colour = Self::colour(*step);
            let _ = writeln!(
                svg,
                "<rect x=\"{left}\" y=\"{y:.2}\" width=\"24\" height=\"{:.2}\" fill=\"{colour}\"/>",
                height + 0.3
            );
            let edge = f64::from(step.abs()) / STEPS as f64;
            let value = if *step > 0 { edge * self.above } else { -edge * self.below };
            // the upper edge of steps above zero, the lower one of those below
            let at = if *step > 0 { y } else { y + height };
            if step.abs() % 2 == 0 {
                text(svg, (left + 30.0, at + 4.0), 13.0, "start", &format!("{value:.3}"));
            }
            if *step == 1 {
                text(svg, (left + 30.0, y + height + 4.0), 13.0, "start", "0");
            }
        }
        let (x, y) = (left + 100.0, TOP + PLOT.1 / 2.0);
        let _ = writeln!(svg, "<g transform=\"rotate(90 {x} {y})\">");
        text(svg, (x, y), 15.0, "middle", legend);
        svg.push_str("</g>\n");
    }
}

/// One rectangle for each run of equal colour in a row.
fn cells(svg: &mut String, map: &HeatMap, frame: &Frame, scale: &Scale) {
    for (row, values) in map.values.iter().enumerate() {
        let (bottom, top) = (frame.up(frame.y[row]), frame.up(frame.y[row + 1]));
        let mut first = 0;
        while first < values.len() {
            let step = scale.step(values[first]);
            let run = values[first..].iter().take_while(|v| scale.step(**v) == step).count();
            let (left, right) = (frame.across(frame.x[first]), frame.across(frame.x[first + run]));
            let _ = writeln!(
                svg,
                "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{}\"/>",
                right - left + 0.4,
                bottom - top + 0.4,
                Scale::colour(step)
            );
            first += run;
        }
    }
}

/// The line of value zero, between the centres of cells (marching squares).
fn boundary(svg: &mut String, map: &HeatMap, frame: &Frame, scale: &Scale) {
    let mut path = String::new();
    for r in 1..map.y.len() {
        for c in 1..map.x.len() {
            let corner = |dr: usize, dc: usize| {
                let (r, c) = (r - 1 + dr, c - 1 + dc);
                // values far beyond the colours would draw the line to their neighbours
                (map.x[c], map.y[r], map.values[r][c].clamp(-scale.below, scale.above))
            };
            let around = [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)];
            let mut crossings = Vec::new();
            for k in 0..4 {
                let (a, b) = (around[k], around[(k + 1) % 4]);
                if (a.2 > 0.0) != (b.2 > 0.0) {
                    // the edge from its lower or left end
                    let edge = [
                        (r - 1, c - 1, true),
                        (r - 1, c, false),
                        (r, c - 1, true),
                        (r - 1, c - 1, false),
                    ];
                    let known = map
                        .crossings
                        .get(&edge[k])
                        .map(|part| if k < 2 { *part } else { 1.0 - part });
                    let part = known.unwrap_or(a.2 / (a.2 - b.2));
                    crossings.push((a.0 + part * (b.0 - a.0), a.1 + part * (b.1 - a.1)));
                }
            }
            for pair in crossings.chunks_exact(2) {
                let [(ax, ay), (bx, by)] =
                    [pair[0], pair[1]].map(|(x, y)| (frame.across(x), frame.up(y)));
                let _ = write!(path, "M{ax:.1} {ay:.1}L{bx:.1} {by:.1}");
            }
        }
    }
    if !path.is_empty() {
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" stroke=\"black\" stroke-width=\"2\" stroke-linecap=\"round\" fill=\"none\"/>"
        );
    }
}

fn axes(svg: &mut String, map: &HeatMap, frame: &Frame) {
    let _ = writeln!(
        svg,
        "<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"black\"/>",
        PLOT.0, PLOT.1
    );
    let bottom = TOP + PLOT.1;
    for x in ticks(ends(&frame.x)) {
        let at = frame.across(x.0);
        let _ = writeln!(svg, "<path d=\"M{at:.1} {bottom}v6\" stroke=\"black\"/>");
        text(svg, (at, bottom + 22.0), 13.0, "middle", &x.1);
    }
    for y in ticks(ends(&frame.y)) {
        let at = frame.up(y.0);
        let _ = writeln!(svg, "<path d=\"M{LEFT} {at:.1}h-6\" stroke=\"black\"/>");
        text(svg, (LEFT - 10.0, at + 4.0), 13.0, "end", &y.1);
    }
    text(svg, (LEFT + PLOT.0 / 2.0, bottom + 50.0), 15.0, "middle", &map.xlabel);
    let (x, y) = (26.0, TOP + PLOT.1 / 2.0);
    let _ = writeln!(svg, "<g transform=\"rotate(-90 {x} {y})\">");
    text(svg, (x, y), 15.0, "middle", &map.ylabel);
    svg.push_str("</g>\n");
}

/// Round values within a range, with labels.
fn ticks((first, last): (f64, f64)) -> Vec<(f64, String)> {
    let rough = (last - first) / 8.0;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|it| it * power).into_iter().find(|it| *it >= rough);
    let step = step.unwrap_or(10.0 * power);
    let digits = decimals(&(0.0..8.0 * step));
    let from = (first / step).ceil() as i64;
    let to = (last / step).floor() as i64;
    (from..=to).map(|k| (k as f64 * step, axis_label(k as f64 * step, digits))).collect()
}

fn marks(svg: &mut String, map: &HeatMap, frame: &Frame) {
    let mut kinds: Vec<&str> = Vec::new();
    for mark in &map.marks {
        if !kinds.contains(&mark.kind.as_str()) {
            kinds.push(&mark.kind);
        }
        let k = kinds.iter().position(|kind| *kind == mark.kind).unwrap_or(0);
        let (x, y) = (frame.across(mark.x), frame.up(mark.y));
        let colour = KINDS[k % KINDS.len()];
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"{colour}\" stroke=\"white\" stroke-width=\"1.5\"/>"
        );
        // labels stay inside the frame
        let (at, anchor) =
            if x > LEFT + 0.8 * PLOT.0 { (x - 9.0, "end") } else { (x + 9.0, "start") };
        halo(svg, (at, y + 4.0), anchor, &mark.label);
    }
    if let Some((x, y)) = map.own {
        let inside = |x: f64, edges: &[f64]| x >= ends(edges).0 && x <= ends(edges).1;
        if inside(x, &frame.x) && inside(y, &frame.y) {
            let (x, y) = (frame.across(x), frame.up(y));
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {y:.1}m-9 0h18m-9 -9v18\" stroke=\"white\" stroke-width=\"6\"/>\
                 <path d=\"M{x:.1} {y:.1}m-9 0h18m-9 -9v18\" stroke=\"black\" stroke-width=\"2.5\"/>"
            );
            halo(svg, (x + 12.0, y - 8.0), "start", "this scenario");
        }
    }
}

fn halo(svg: &mut String, (x, y): (f64, f64), anchor: &str, label: &str) {
    let label = escaped(label);
    for style in [
        "stroke=\"white\" stroke-width=\"3\" stroke-linejoin=\"round\" fill=\"white\"",
        "fill=\"black\"",
    ] {
        let _ = writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"13\" text-anchor=\"{anchor}\" {style}>{label}</text>"
        );
    }
}

fn text(svg: &mut String, (x, y): (f64, f64), size: f64, anchor: &str, text: &str) {
    let text = escaped(text);
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\">{text}</text>"
    );
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(n: usize) -> HeatMap {
        let axis: Vec<f64> = (0..n).map(|k| k as f64 / (n - 1) as f64).collect();
        let value = |x: f64, y: f64| 0.1 * (x * x + y * y - 0.5);
        HeatMap {
            title: "circle".into(),
            xlabel: "x".into(),
            ylabel: "y".into(),
            legend: "d".into(),
            values: axis.iter().map(|y| axis.iter().map(|x| value(*x, *y)).collect()).collect(),
            x: axis.clone(),
            y: axis,
            largest: 0.2,
            marks: vec![HeatMark { x: 0.5, y: 0.5, kind: "a".into(), label: "a < b".into() }],
            own: Some((0.25, 0.75)),
            crossings: HashMap::new(),
        }
    }

    /// Every point of the line is on the circle, but for the interpolation.
    #[test]
    fn analytic_the_line_of_zero_is_where_the_values_are_zero() {
        let svg = draw_heat_map(&map(41)).unwrap();
        let path = svg.lines().find(|line| line.contains("stroke-linecap")).unwrap();
        let path = path.split('"').nth(1).unwrap();
        let numbers =
            path.split(|c: char| "ML ".contains(c)).filter_map(|it| it.parse::<f64>().ok());
        let numbers: Vec<f64> = numbers.collect();
        assert!(numbers.len() > 40);
        let half = 0.5 / 40.0;
        for pair in numbers.chunks_exact(2) {
            let x = (pair[0] - LEFT) / PLOT.0 * (1.0 + 2.0 * half) - half;
            let y = (TOP + PLOT.1 - pair[1]) / PLOT.1 * (1.0 + 2.0 * half) - half;
            assert!((x.hypot(y) - 0.5_f64.sqrt()).abs() < 2e-3, "{x} {y}");
        }
        assert!(svg.contains("a &lt; b") && svg.contains("this scenario"));
    }

    /// On a coarse grid the line is exact where crossings are given.
    #[test]
    fn analytic_given_crossings_replace_the_interpolation() {
        let mut coarse = map(6);
        let axis = coarse.x.clone();
        for r in 0..6 {
            for c in 0..6 {
                let root = |fixed: f64| (0.5 - fixed * fixed).max(0.0).sqrt();
                for (along_x, from, at) in [(true, c, root(axis[r])), (false, r, root(axis[c]))] {
                    if from + 1 < 6 && at > axis[from] && at < axis[from + 1] {
                        let part = (at - axis[from]) / (axis[from + 1] - axis[from]);
                        coarse.crossings.insert((r, c, along_x), part);
                    }
                }
            }
        }
        let svg = draw_heat_map(&coarse).unwrap();
        let path = svg.lines().find(|line| line.contains("stroke-linecap")).unwrap();
        let path = path.split('"').nth(1).unwrap();
        let numbers: Vec<f64> =
            path.split(|c: char| "ML ".contains(c)).filter_map(|it| it.parse().ok()).collect();
        assert!(numbers.len() > 8);
        let half = 0.5 / 5.0;
        for pair in numbers.chunks_exact(2) {
            let x = (pair[0] - LEFT) / PLOT.0 * (1.0 + 2.0 * half) - half;
            let y = (TOP + PLOT.1 - pair[1]) / PLOT.1 * (1.0 + 2.0 * half) - half;
            assert!((x.hypot(y) - 0.5_f64.sqrt()).abs() < 5e-4, "{x} {y}");
        }
    }

    #[test]
    fn invariant_many_cells_stay_below_a_megabyte() {
        assert!(draw_heat_map(&map(400)).unwrap().len() < 1_000_000);
    }

    #[test]
    fn refusal_rows_that_do_not_fit() {
        let mut wrong = map(3);
        wrong.values[1].pop();
        assert!(draw_heat_map(&wrong).is_err());
    }
}
