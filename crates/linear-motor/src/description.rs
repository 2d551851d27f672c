//! The motor file: where the motors are, and their law as data (JSON).

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// The linear induction motors of a vehicle, which are all alike. The law is given by `field` or by `table`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MotorDescription {
    /// Path or URL of the schema, for editors. Default: none.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Short name, for example `aluminium-4-mm`.
    pub name: String,
    /// Description of the motor and source of its data, for its users. Default: empty.
    #[serde(default)]
    pub description: String,
    /// Names of the vehicle's bodies that are motors, in the order of the vehicle file; `*` stands for any
    /// letters. Default: `["*_motor_*"]`.
    #[serde(default = "bodies")]
    pub bodies: Vec<String>,
    /// Middle of the primary's face, where its forces act, from the body's centre of mass (m): forward, to the
    /// left, up. Default: the centre of mass.
    #[serde(default)]
    pub offset: [f64; 3],
    /// Clearance between the primary and the reaction plate in the vehicle's nominal place (m). It opens as the
    /// motor rises.
    pub nominal_gap: f64,
    /// Pole pitch τ of the winding (m).
    pub pole_pitch: f64,
    /// Slip frequency that the traction control keeps (Hz): positive for traction, the opposite for braking.
    pub slip_frequency: f64,
    /// Largest current that the traction control sets (A, r.m.s. of a phase).
    pub max_current: f64,
    /// Resistance of a phase of the primary (Ω), for the electrical power alone. Default: 0.
    #[serde(default)]
    pub phase_resistance: f64,
    /// Data of the field theory. Default: none; then `table` is needed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<FieldDescription>,
    /// Table of forces. Default: none; then `field` is needed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<ForceTable>,
}

fn bodies() -> Vec<String> {
    vec!["*_motor_*".to_owned()]
}

/// Winding and reaction plate, for the field theory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct FieldDescription {
    /// Number of pole pairs p; the winding is 2pτ long.
    pub pole_pairs: u32,
    /// Width of the primary's core across the track (m).
    pub width: f64,
    /// Width by which the sheet is wider than the core, on each side (m).
    pub overhang: f64,
    /// Turns of a phase in series.
    pub turns: f64,
    /// Winding factor of the fundamental wave, above 0 and up to 1.
    pub winding_factor: f64,
    /// Carter's factor for the slots, by which the magnetic gap is longer. Default: 1.
    #[serde(default = "one")]
    pub carter_factor: f64,
    /// Thickness of the conducting sheet (m).
    pub sheet_thickness: f64,
    /// Resistivity of the sheet (Ω·m), for example 3.3e-8 for warm aluminium.
    pub sheet_resistivity: f64,
}

fn one() -> f64 {
    1.0
}

/// Forces of one motor at one current, over slip frequency, speed and gap. They are linear between points and
/// proportional to the square of the current.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ForceTable {
    /// Current of the forces (A, r.m.s. of a phase).
    pub current: f64,
    /// Slip frequencies (Hz), ascending, at least two; negative for braking.
    pub slip_frequency: Vec<f64>,
    /// Speeds (m/s), ascending from 0. Running backwards is the mirror image.
    pub speed: Vec<f64>,
    /// Gaps (m), ascending.
    pub gap: Vec<f64>,
    /// Thrust (N), forward positive: by slip frequency, in it by speed, in it by gap.
    pub thrust: Vec<Vec<Vec<f64>>>,
    /// Normal force (N), attraction positive, in the same way.
    pub normal: Vec<Vec<Vec<f64>>>,
}

impl MotorDescription {
    /// Reads a motor file and checks it.
    ///
    /// # Errors
    /// [`Error::Json`] or [`Error::Invalid`], with the path of the place.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let motor: Self = strict_json::read(text)
            .map_err(|error| Error::Json { path: error.path, message: error.message })?;
        motor.check()?;
        Ok(motor)
    }
}
