//! The line of the track in plan and elevation, for a vehicle that follows one.

use serde::Serialize;
use track_line::{Line, LineDescription};

use crate::embed::{ArrayRef, Arrays};
use crate::error::ReportError;
use crate::layout_fmu::LayoutFmu;
use crate::names;

/// Distance between points of the drawn line (m), and their largest number.
const STEP: f64 = 0.5;
const MOST: f64 = 20_000.0;

/// Points of the line at equal distances along it.
#[derive(Debug, Serialize)]
pub(super) struct DrawnLine {
    /// Place along the track of the first point (m), and the distance of two points (m).
    start: f64,
    step: f64,
    /// Of each point, its position (m) and the axes along, left and up: 12 numbers.
    points: ArrayRef,
}

impl DrawnLine {
    /// The stretch `from` to `to` (m) of the line in the vehicle's resources, `None` on a straight track.
    pub(super) fn new(
        vehicle: &LayoutFmu<'_>,
        from: f64,
        to: f64,
        arrays: &mut Arrays,
    ) -> Result<Option<Self>, ReportError> {
        let Some(text) = vehicle.find_resource(names::LINE_FILE)? else { return Ok(None) };
        let line = LineDescription::from_json(&text)
            .and_then(|it| Line::new(&it))
            .map_err(|it| vehicle.unusable(&format!("resources/{}: {it}", names::LINE_FILE)))?;
        let count = ((to - from) / STEP).ceil().clamp(1.0, MOST);
        let step = (to - from) / count;
        let mut points = Vec::new();
        for k in 0..=count as usize {
            let frame = line.frame(from + step * k as f64);
            points.extend(frame.position.iter().chain(frame.axes.iter()));
        }
        Ok(Some(Self { start: from, step, points: arrays.f64(&points) }))
    }
}
