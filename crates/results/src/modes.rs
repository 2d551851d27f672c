//! modes.json: the modes of a coupled system, as `maglev modes` finds them.
//!
//! Missing members are read as empty or zero, so that files of other versions can be read.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// The content of modes.json.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct ModesFile {
    /// Name of the coupling algorithm.
    pub algorithm: String,
    /// Degree of the extrapolation of inputs.
    pub extrapolation: usize,
    /// The modes.
    pub modes: CoupledModes,
}

/// The modes of a system, least damped first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct CoupledModes {
    /// Number of states of all units.
    pub states: usize,
    /// Communication step (s).
    pub step: f64,
    /// One of each conjugate pair.
    pub modes: Vec<CoupledMode>,
    /// Magnitude of the largest multiplier that the coupling itself adds. It decays if below one.
    pub coupling_multiplier: f64,
    /// Point of linearisation. The results hold there only.
    pub operating_point: OperatingPoint,
    /// Units with states that share no mode with another unit at this point.
    pub apart: Vec<UncoupledStates>,
    /// Units whose states belong to named parts, such as the spans of a guideway, and which of these are
    /// coupled.
    pub parts: Vec<CoupledParts>,
    /// Whether all modes of the continuous system decay.
    pub stable: bool,
    /// Whether all modes of the stepped system decay.
    pub stepped_stable: bool,
}

/// One mode of the coupled system.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct CoupledMode {
    /// Eigenvalue of the continuous system.
    pub continuous: Eigenvalue,
    /// Eigenvalue as stepped; none if no multiplier belongs to the mode.
    pub stepped: Option<Eigenvalue>,
    /// |difference of the two| over |λ|.
    pub relative_error: Option<f64>,
    /// Participation of each instance, the largest first.
    pub participation: IndexMap<String, f64>,
}

/// An eigenvalue with its frequency and damping.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Eigenvalue {
    /// Re λ (1/s).
    pub real: f64,
    /// Im λ (rad/s), not negative; 0 for a motion that does not oscillate.
    pub imaginary: f64,
    /// |λ|/2π (Hz).
    pub frequency_hz: f64,
    /// −Re λ/|λ|.
    pub damping_ratio: f64,
}

/// The point of linearisation.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct OperatingPoint {
    /// Time (s): the start of the scenario.
    pub time: f64,
    /// The connected Real inputs of each instance.
    pub inputs: IndexMap<String, Vec<InputFamily>>,
}

/// Inputs whose names differ only in a number, such as `position_01` to `position_64`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct InputFamily {
    /// Common name, with `#` for the number.
    pub name: String,
    /// Number of inputs in this family.
    pub count: usize,
    /// Smallest value of them.
    pub min: f64,
    /// Largest value of them.
    pub max: f64,
    /// Unit of measure, if it has one.
    pub unit: Option<String>,
}

/// A unit with states that share no mode with another unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct UncoupledStates {
    /// The instance, by its name in the scenario.
    pub instance: String,
    /// Number of its states.
    pub of: usize,
    /// Names of the states that share no mode with another unit.
    pub states: Vec<String>,
}

/// The parts of a unit: what its states name before a comma, such as `span 2` in `span 2, mode 1`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct CoupledParts {
    /// The instance, by its name in the scenario.
    pub instance: String,
    /// Parts of which a state is coupled with another unit.
    pub coupled: Vec<String>,
    /// The other parts.
    pub apart: Vec<String>,
}

impl UncoupledStates {
    /// Whether none of its states is coupled.
    #[must_use]
    pub fn entirely(&self) -> bool {
        self.states.len() == self.of
    }
}

/// The content of mode-shapes.json: how the parts of the units move in each mode.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct ModeShapes {
    /// What can move.
    pub parts: Vec<MovingPart>,
    /// The shapes, in the order of [`CoupledModes::modes`]. Modes in which no part moves are left out.
    pub modes: Vec<ModeShape>,
}

/// One motion of one part of a unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct MovingPart {
    /// The instance, by its name in the scenario.
    pub instance: String,
    /// A body, or a span of a girder.
    pub part: String,
    /// `x`, `y`, `z` of the centre of mass in world axes; `rx`, `ry`, `rz` in the body's axes; or the name of
    /// a coordinate, such as `mode 1`.
    pub direction: String,
    /// Where on the part, as a fraction of its length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// `m`, `rad`, or nothing for a modal coordinate.
    pub unit: String,
}

/// The shape of one mode.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct ModeShape {
    /// Position of the mode in [`CoupledModes::modes`].
    pub mode: usize,
    /// Position of the part, and real and imaginary part of its amplitude. The largest displacement is 1;
    /// amplitudes below a hundredth are left out.
    pub moves: Vec<(usize, f64, f64)>,
}
