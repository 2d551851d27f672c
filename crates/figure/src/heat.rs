//! Maps of a value over two parameters, as coloured cells.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::PlotError;

const SIZE: (u32, u32) = (900, 640);
/// Width of the colour scale with its labels.
const SCALE: u32 = 130;
const TITLE: u32 = 44;
/// Steps of the colour scale.
const SHADES: i32 = 60;

/// A map. Values below zero are shades of blue, above zero of red, and the boundary between them is a line.
#[derive(Debug, Clone)]
pub struct HeatMap {
    /// Title of the picture.
    pub title: String,
    /// Label of the horizontal axis.
    pub xlabel: String,
    /// Label of the vertical axis.
    pub ylabel: String,
    /// Label of the values.
    pub label: String,
    /// Columns, increasing.
    pub x: Vec<f64>,
    /// Rows, increasing.
    pub y: Vec<f64>,
    /// Values, row by row. Cells without a value stay grey.
    pub values: Vec<Vec<Option<f64>>>,
}

/// Blue for the lowest, white for zero, red for the highest.
fn colour(value: f64, low: f64, high: f64) -> RGBColor {
    let part = if value > 0.0 { value / high.max(1e-300) } else { value / low.min(-1e-300) };
    let strength = part.clamp(0.0, 1.0).sqrt();
    let (r, g, b) = if value > 0.0 { (178.0, 24.0, 43.0) } else { (33.0, 102.0, 172.0) };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … 255")]
    let mix = |c: f64| (255.0 + (c - 255.0) * strength).round() as u8;
    RGBColor(mix(r), mix(g), mix(b))
}

/// Borders of cells around increasing values.
fn borders(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    if n == 1 {
        let half = if values[0] == 0.0 { 0.5 } else { 0.05 * values[0].abs() };
        return vec![values[0] - half, values[0] + half];
    }
    let mut all = vec![values[0] - 0.5 * (values[1] - values[0])];
    all.extend(values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
    all.push(values[n - 1] + 0.5 * (values[n - 1] - values[n - 2]));
    all
}

/// Draws a map and returns it as SVG text.
///
/// # Errors
/// The drawing library fails, or the map is empty.
pub fn draw_map(map: &HeatMap) -> Result<String, PlotError> {
    let fail = |error: &dyn std::fmt::Display| PlotError(error.to_string());
    if map.x.is_empty() || map.y.is_empty() {
        return Err(PlotError("the map has no cells".to_owned()));
    }
    let values = || map.values.iter().flatten().flatten().copied().filter(|it| it.is_finite());
    let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE).map_err(|e| fail(&e))?;
        let (head, rest) = root.split_vertically(TITLE);
        head.titled(&map.title, ("sans-serif", 20)).map_err(|e| fail(&e))?;
        let (body, scale) = rest.split_horizontally(SIZE.0 - SCALE);
        let (x, y) = (borders(&map.x), borders(&map.y));
        let (xs, ys) = (x[0]..x[x.len() - 1], y[0]..y[y.len() - 1]);
        let (dx, dy) = (crate::decimals(&xs), crate::decimals(&ys));
        let mut chart = ChartBuilder::on(&body)
            .margin(8)
            .set_label_area_size(LabelAreaPosition::Left, 78)
            .set_label_area_size(LabelAreaPosition::Bottom, 46)
            .build_cartesian_2d(xs, ys)
            .map_err(|e| fail(&e))?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_labels(10)
            .y_labels(10)
            .x_label_formatter(&|v: &f64| crate::axis_label(*v, dx))
            .y_label_formatter(&|v: &f64| crate::axis_label(*v, dy))
            .x_desc(map.xlabel.as_str())
            .y_desc(map.ylabel.as_str())
            .axis_desc_style(("sans-serif", 15))
            .label_style(("sans-serif", 13))
            .draw()
            .map_err(|e| fail(&e))?;
        let cell =
            |i: usize, j: usize| map.values.get(j).and_then(|row| row.get(i)).copied().flatten();
        for j in 0..map.y.len() {
            for i in 0..map.x.len() {
                let fill = match cell(i, j) {
                    Some(value) => colour(value, low, high),
                    None => RGBColor(200, 200, 200),
                };
                let corners = [(x[i], y[j]), (x[i + 1], y[j + 1])];
                chart
                    .draw_series([Rectangle::new(corners, fill.filled())])
                    .map_err(|e| fail(&e))?;
            }
        }
        // the boundary: borders between cells of different sign
        let grows = |i: usize, j: usize| cell(i, j).map(|value| value > 0.0);
        let differ =
            |a: Option<bool>, b: Option<bool>| matches!((a, b), (Some(a), Some(b)) if a != b);
        for j in 0..map.y.len() {
            for i in 0..map.x.len() {
                let mut edges = Vec::new();
                if i + 1 < map.x.len() && differ(grows(i, j), grows(i + 1, j)) {
                    edges.push([(x[i + 1], y[j]), (x[i + 1], y[j + 1])]);
                }
                if j + 1 < map.y.len() && differ(grows(i, j), grows(i, j + 1)) {
                    edges.push([(x[i], y[j + 1]), (x[i + 1], y[j + 1])]);
                }
                let lines = edges.into_iter().map(|it| PathElement::new(it, BLACK.stroke_width(2)));
                chart.draw_series(lines).map_err(|e| fail(&e))?;
            }
        }
        // colour scale
        let bar_height = i32::try_from(SIZE.1 - TITLE).unwrap_or(0) - 110;
        let font = ("sans-serif", 13).into_text_style(&scale);
        let font = font.pos(Pos::new(HPos::Left, VPos::Center));
        let span = (high - low).max(1e-300);
        let digits = crate::decimals(&(low..low + span));
        for k in 0..SHADES {
            let value = high - span * (f64::from(k) + 0.5) / f64::from(SHADES);
            let top = 50 + bar_height * k / SHADES;
            let bottom = 50 + bar_height * (k + 1) / SHADES;
            let fill = colour(value, low, high).filled();
            scale.draw(&Rectangle::new([(14, top), (34, bottom)], fill)).map_err(|e| fail(&e))?;
        }
        for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let value = high - span * part;
            #[expect(clippy::cast_possible_truncation, reason = "pixels")]
            let at = 50 + (f64::from(bar_height) * part) as i32;
            let text = crate::axis_label(value, digits.max(1));
            scale.draw(&Text::new(text, (40, at), &font)).map_err(|e| fail(&e))?;
        }
        scale.draw(&Text::new(map.label.clone(), (8, 24), &font)).map_err(|e| fail(&e))?;
        root.present().map_err(|e| fail(&e))?;
    }
    Ok(svg)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(values: Vec<Vec<Option<f64>>>) -> HeatMap {
        HeatMap {
            title: "t".into(),
            xlabel: "speed (m/s)".into(),
            ylabel: "f (Hz)".into(),
            label: "growth (1/s)".into(),
            x: vec![1.0, 2.0, 3.0],
            y: vec![5.0, 6.0],
            values,
        }
    }

    /// Each cell is a rectangle of its colour; the sign is the colour's.
    #[test]
    fn analytic_cells_have_the_colour_of_their_sign() {
        let some = |row: [f64; 3]| row.map(Some).to_vec();
        let svg = draw_map(&map(vec![some([-1.0, -0.5, 0.2]), some([-1.0, 0.1, 1.0])])).unwrap();
        assert!(svg.contains("#2166AC") && svg.contains("#B2182B"), "{svg}");
        assert!(svg.contains("speed (m/s)") && svg.contains("growth (1/s)"));
        assert_eq!(borders(&[1.0, 2.0, 3.0]), [0.5, 1.5, 2.5, 3.5]);
    }

    #[test]
    fn issue_single_missing_and_no_cells() {
        let svg = draw_map(&map(vec![vec![None, Some(0.0), Some(f64::NAN)], vec![]])).unwrap();
        assert!(svg.contains("#C8C8C8"));
        let empty = HeatMap { x: vec![], ..map(vec![]) };
        assert!(draw_map(&empty).is_err());
        let one = HeatMap { x: vec![1.0], y: vec![0.0], ..map(vec![vec![Some(-1.0)]]) };
        assert!(draw_map(&one).is_ok());
    }
}
