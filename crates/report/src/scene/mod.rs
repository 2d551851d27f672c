//! The 3D view's data: the train's parts, the girders, and how both move.
//!
//! The shapes come from the layout files inside of the units, `resources/vehicle.json` and
//! `resources/guideway.json`; the motion comes from the recorded signals. What is not recorded does
//! not move, and [`Scene::missing`] says so. The page draws it (`assets/scene.js`).

mod bodies;
mod motion;
#[cfg(test)]
mod tests;
mod track;

use serde::Serialize;

use crate::embed::{ArrayRef, Arrays};
use crate::error::ReportError;
use crate::layout_fmu::LayoutFmu;
use crate::names;
use bodies::DrawnBodies;
use motion::{RecordedMotion, ViewFrames};
use results::RunResults;
use track::DrawnTrack;

/// What the page needs to draw the train on its girders.
#[derive(Debug, Serialize)]
pub struct Scene {
    /// Name of the vehicle in its layout file.
    name: String,
    /// Air gap (m) of every magnet in equilibrium on a flat track.
    nominal_gap: f64,
    /// Length (m) of a magnet's pole along the track.
    pole_length: f64,
    #[serde(flatten)]
    bodies: DrawnBodies,
    #[serde(flatten)]
    track: DrawnTrack,
    #[serde(flatten)]
    motion: RecordedMotion,
    /// What is drawn less than it could be, and why: a sentence each.
    pub missing: Vec<String>,
}

/// Makes the scene of a run, `None` if no unit of it is a vehicle with magnets.
///
/// # Errors
/// A unit cannot be opened, or its layout file is not as it should be.
pub fn build(run: &RunResults, arrays: &mut Arrays) -> Result<Option<Scene>, ReportError> {
    let Some(scenario) = &run.scenario else { return Ok(None) };
    let Some(vehicle) = LayoutFmu::find(scenario, names::VEHICLE_FILE)? else { return Ok(None) };
    let layout = vehicle.layout(multibody::VehicleDescription::from_json)?;
    let frames = ViewFrames::choose(&run.table.time);
    if layout.magnets.is_empty() || frames.is_empty() {
        return Ok(None);
    }
    let mut missing = Vec::new();
    let bodies = DrawnBodies::new(&layout);
    let guideway = LayoutFmu::find(scenario, names::GUIDEWAY_FILE)?;
    let mut source =
        motion::SignalSource { table: &run.table, frames: &frames, arrays, missing: &mut missing };
    let motion = RecordedMotion::new(&vehicle, &layout, &bodies, &mut source);
    let (track, pole_length) = DrawnTrack::new(guideway.as_ref(), &vehicle, &layout, &mut source)?;
    Ok(Some(Scene {
        name: layout.name,
        nominal_gap: layout.nominal_gap,
        pole_length,
        bodies,
        track,
        motion,
        missing,
    }))
}

/// Reference to an array, or none where nothing is recorded.
type Channel = Option<ArrayRef>;

/// three.js for the page, which needs it only with a scene.
#[derive(Debug, Serialize)]
pub struct ThreeLibrary {
    core: ArrayRef,
    module: ArrayRef,
    orbit: ArrayRef,
}

impl ThreeLibrary {
    /// Puts the library's modules among the arrays.
    pub fn new(arrays: &mut Arrays) -> Self {
        Self {
            core: arrays.u8(include_bytes!("../../assets/vendor/three.core.min.js")),
            module: arrays.u8(include_bytes!("../../assets/vendor/three.module.min.js")),
            orbit: arrays.u8(include_bytes!("../../assets/vendor/three.OrbitControls.js")),
        }
    }
}
