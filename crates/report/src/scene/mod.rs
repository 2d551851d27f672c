//! The data of the 3D view: the parts of the train, the girders, and their motion.
//!
//! Shapes come from the layout files in the FMUs, `resources/vehicle.json` and `resources/guideway.json`.
//! Motion comes from the recorded signals. Parts without recorded signals do not move, and
//! [`Scene::missing`] lists them. The scripts in `assets/scene` draw the view.

mod bodies;
mod coupled;
mod course;
mod motion;
mod surface;
#[cfg(test)]
mod tests;
mod track;

use serde::Serialize;

use crate::embed::{ArrayRef, Arrays};
use crate::error::ReportError;
use crate::layout_fmu::LayoutFmu;
use crate::names;
use bodies::DrawnBodies;
use coupled::DrawnMode;
use course::DrawnLine;
use motion::{RecordedMotion, ViewFrames};
use results::RunResults;
use track::DrawnTrack;

/// The train on its girders, in the page.
#[derive(Debug, Serialize)]
pub struct Scene {
    /// Name of the vehicle in its layout file.
    name: String,
    /// Air gap (m) of the magnets in equilibrium on a flat track.
    nominal_gap: f64,
    /// Length (m) of a magnet's pole along the track.
    pole_length: f64,
    #[serde(flatten)]
    bodies: DrawnBodies,
    #[serde(flatten)]
    track: DrawnTrack,
    /// The line that the track follows; none if it is straight.
    line: Option<DrawnLine>,
    #[serde(flatten)]
    motion: RecordedMotion,
    /// Modes of the coupled system, if `maglev modes` wrote their shapes beside the run.
    coupled: Vec<DrawnMode>,
    /// Sentences about what is missing in the view, and why.
    pub missing: Vec<String>,
}

/// Builds the scene of a run with at most so many frames. `None` if no FMU is a vehicle with magnets.
///
/// # Errors
/// An FMU cannot be opened, or its layout file is invalid.
pub fn build(
    run: &RunResults,
    frames: usize,
    arrays: &mut Arrays,
) -> Result<Option<Scene>, ReportError> {
    let Some(scenario) = &run.scenario else { return Ok(None) };
    let Some(vehicle) = LayoutFmu::find(scenario, names::VEHICLE_FILE)? else { return Ok(None) };
    let layout = vehicle.layout(multibody::VehicleDescription::from_json)?;
    let frames = ViewFrames::choose(&run.table.time, frames);
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
    let (from, to) = track.stretch(&motion, &bodies);
    let line = DrawnLine::new(&vehicle, from, to, source.arrays)?;
    let coupled = coupled::modes(run, &bodies, track.spans(), &mut missing);
    Ok(Some(Scene {
        name: layout.name,
        nominal_gap: layout.nominal_gap,
        pole_length,
        bodies,
        track,
        line,
        motion,
        coupled,
        missing,
    }))
}

/// Reference to the values of a signal; none if it is not recorded.
type Channel = Option<ArrayRef>;

/// The modules of three.js, which a page with a scene needs.
#[derive(Debug, Serialize)]
pub struct ThreeLibrary {
    core: ArrayRef,
    module: ArrayRef,
    orbit: ArrayRef,
}

impl ThreeLibrary {
    /// Embeds the modules.
    pub fn new(arrays: &mut Arrays) -> Self {
        Self {
            core: arrays.u8(include_bytes!("../../assets/vendor/three.core.min.js")),
            module: arrays.u8(include_bytes!("../../assets/vendor/three.module.min.js")),
            orbit: arrays.u8(include_bytes!("../../assets/vendor/three.OrbitControls.js")),
        }
    }
}
