//! The modes of the coupled system, as `maglev modes --out` wrote them beside the run.

use results::modes::{CoupledMode, ModeShape, ModeShapes};
use results::{MODE_SHAPES, RunResults};
use serde::Serialize;

use super::bodies::DrawnBodies;

/// Most modes, the least damped first: the page has room for so many.
const MOST: usize = 40;
/// Directions of a body, in this order.
const DIRECTIONS: [&str; 5] = ["y", "z", "rx", "ry", "rz"];
/// Directions of a section of a girder, in this order.
const SWAYS: [&str; 3] = ["z", "y", "rx"];

/// A mode with the motion of what the view draws. The motion is Re(amplitude · e^(iφ)).
#[derive(Debug, PartialEq, Serialize)]
pub(super) struct DrawnMode {
    /// |λ|/2π (Hz).
    frequency: f64,
    /// −Re λ/|λ|.
    damping: f64,
    /// Instances with the largest participation.
    with: Vec<String>,
    /// Of each group, real and imaginary part of y, z (relative), rx, ry, rz (per metre).
    groups: Vec<[f32; 10]>,
    /// Of each span, fraction of its length, and there real and imaginary part of the deflection, of the lateral
    /// deflection, and of the twist (per metre).
    spans: Vec<Vec<[f32; 7]>>,
}

/// The least damped modes in which a body or a girder moves.
pub(super) fn modes(
    run: &RunResults,
    bodies: &DrawnBodies,
    spans: usize,
    missing: &mut Vec<String>,
) -> Vec<DrawnMode> {
    let Some(modes) = &run.modes else { return Vec::new() };
    let Ok(text) = std::fs::read(run.folder.join(MODE_SHAPES)) else { return Vec::new() };
    let shapes: ModeShapes = match serde_json::from_slice(&text) {
        Ok(shapes) => shapes,
        Err(error) => {
            missing.push(format!("coupled modes: {MODE_SHAPES} is invalid: {error}"));
            return Vec::new();
        }
    };
    let leads: Vec<&str> = (0..bodies.groups.len())
        .map(|g| {
            let lead = bodies.boxes.iter().find(|it| it.lead && it.group == g);
            lead.map_or("", |it| it.name.as_str())
        })
        .collect();
    let drawn = shapes.modes.iter().filter_map(|shape| {
        let mode = modes.modes.get(shape.mode)?;
        drawn(mode, shape, &shapes, &leads, spans)
    });
    let all: Vec<DrawnMode> = drawn.take(MOST + 1).collect();
    if all.len() > MOST {
        missing
            .push(format!("of the coupled modes, only the {MOST} least damped ones can be shown"));
    }
    all.into_iter().take(MOST).collect()
}

fn drawn(
    mode: &CoupledMode,
    shape: &ModeShape,
    shapes: &ModeShapes,
    leads: &[&str],
    spans: usize,
) -> Option<DrawnMode> {
    let mut all = DrawnMode {
        frequency: mode.continuous.frequency_hz,
        damping: mode.continuous.damping_ratio,
        with: mode
            .participation
            .iter()
            .filter(|(_, share)| **share >= 0.1)
            .map(|(name, _)| name.clone())
            .take(2)
            .collect(),
        groups: vec![[0.0; 10]; leads.len()],
        spans: vec![Vec::new(); spans],
    };
    let mut any = false;
    for &(part, re, im) in &shape.moves {
        let part = shapes.parts.get(part)?;
        let (re, im) = (re as f32, im as f32);
        let span = part.part.strip_prefix("span ").and_then(|it| it.parse::<usize>().ok());
        if let (Some(span), Some(at)) = (span, part.at) {
            let direction = SWAYS.iter().position(|it| *it == part.direction);
            let points = span.checked_sub(1).and_then(|k| all.spans.get_mut(k));
            if let (Some(points), Some(direction)) = (points, direction) {
                let n = points.iter().position(|it| it[0] == at as f32).unwrap_or(points.len());
                if n == points.len() {
                    points.push([at as f32, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
                }
                points[n][1 + 2 * direction..3 + 2 * direction].copy_from_slice(&[re, im]);
                any = true;
            }
            continue;
        }
        let direction = DIRECTIONS.iter().position(|it| *it == part.direction);
        let group = leads.iter().position(|it| *it == part.part);
        if let (Some(direction), Some(group)) = (direction, group) {
            all.groups[group][2 * direction..2 * direction + 2].copy_from_slice(&[re, im]);
            any = true;
        }
    }
    // amplitudes below a hundredth are left out of the file: the ends of a span do not move
    for points in all.spans.iter_mut().filter(|points| !points.is_empty()) {
        for end in [0.0, 1.0] {
            if points.iter().all(|point| point[0] != end) {
                points.push([end, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
            }
        }
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    }
    any.then_some(all)
}

#[cfg(test)]
mod tests {
    use results::modes::MovingPart;

    use super::*;

    #[test]
    fn analytic_motions_go_to_their_bodies_and_spans() {
        let part = |part: &str, direction: &str, at: Option<f64>| MovingPart {
            part: part.to_owned(),
            direction: direction.to_owned(),
            at,
            ..MovingPart::default()
        };
        let shapes = ModeShapes {
            parts: vec![
                part("frame", "rx", None),
                part("span 2", "z", Some(0.5)),
                part("span 2", "mode 1", None),
                part("beam", "z", None),
                part("span 2", "rx", Some(0.5)),
            ],
            modes: Vec::new(),
        };
        let moves = |moves: Vec<(usize, f64, f64)>| ModeShape { mode: 0, moves };
        let mode = CoupledMode::default();
        let leads = ["car", "frame"];
        let shape = moves(vec![
            (0, 0.25, -0.5),
            (1, 1.0, 0.125),
            (2, 1.0, 0.0),
            (3, 1.0, 0.0),
            (4, -0.5, 0.25),
        ]);
        let found = drawn(&mode, &shape, &shapes, &leads, 3).unwrap();
        assert_eq!(found.groups[0], [0.0; 10]);
        assert_eq!(found.groups[1][4..6], [0.25, -0.5]);
        let end = |at: f32| [at, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let middle = [0.5, 1.0, 0.125, 0.0, 0.0, -0.5, 0.25];
        assert_eq!(found.spans[1], [end(0.0), middle, end(1.0)]);
        assert!(found.spans[0].is_empty());
        // what the view does not draw is no mode of it
        assert_eq!(drawn(&mode, &moves(vec![(3, 1.0, 0.0)]), &shapes, &leads, 3), None);
    }
}
