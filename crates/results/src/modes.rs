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

impl UncoupledStates {
    /// Whether none of its states is coupled.
    #[must_use]
    pub fn entirely(&self) -> bool {
        self.states.len() == self.of
    }
}
