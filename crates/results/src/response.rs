//! response.json: frequency responses, margins and root loci, as `maglev response` finds them.
//!
//! Missing members are read as empty or zero, so that files of other versions can be read.

use serde::{Deserialize, Serialize};

use crate::modes::OperatingPoint;

/// The content of response.json.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct ResponseFile {
    /// Point of linearisation. The results hold there only.
    pub operating_point: OperatingPoint,
    /// Whether all modes of the closed system decay. Responses of one that is not stable exist only in
    /// mathematics: a run does not show them.
    pub stable: bool,
    /// Eigenvalues of the closed system that grow, as (Re λ in 1/s, frequency in Hz).
    pub growing: Vec<(f64, f64)>,
    /// Frequency responses from inputs to outputs.
    pub responses: Vec<ResponseCurve>,
    /// Margins of loops.
    pub loops: Option<LoopsResult>,
    /// Eigenvalues over a parameter.
    pub root_locus: Option<RootLocus>,
}

/// A complex function of frequency.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Curve {
    /// Frequencies (Hz).
    pub frequency_hz: Vec<f64>,
    /// Real parts.
    pub real: Vec<f64>,
    /// Imaginary parts.
    pub imaginary: Vec<f64>,
}

/// The response of an output to an input: amplitude over amplitude.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct ResponseCurve {
    /// The input, `instance.variable`.
    pub from: String,
    /// The output, `instance.variable`.
    pub to: String,
    /// Unit of measure of the output over that of the input.
    pub unit: String,
    /// The largest amplitude, and its frequency (Hz).
    pub peak: (f64, f64),
    /// The response.
    pub curve: Curve,
}

/// Loops that are broken, one by one and together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct LoopsResult {
    /// Signals at which the loops are broken, `instance.variable`.
    pub at: Vec<String>,
    /// Sample time (s) and samples of delay, of loops whose signals are held.
    pub sampled: Option<(f64, usize)>,
    /// Whether the closed loops are stable. Only then there are margins.
    pub stable: bool,
    /// Poles of the closed loops that grow.
    pub closed_growing: usize,
    /// Poles of the system with all loops broken that grow.
    pub open_growing: usize,
    /// Clockwise turns of det(I + L) around 0, as the curve shows them. They should be `closed_growing`
    /// less `open_growing`. None if poles on the border of stability make them indefinite.
    pub encirclements: Option<f64>,
    /// Each loop broken alone, the others closed.
    pub single: Vec<SingleLoop>,
    /// All loops broken at once, if there are several.
    pub together: Option<Together>,
}

/// One loop that is broken while the others are closed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct SingleLoop {
    /// Where it is broken.
    pub at: String,
    /// Margins, if the closed system is stable.
    pub margins: Option<LoopMargins>,
    /// Frequencies (Hz) and gain factors at which L would be −1.
    pub critical: Vec<(f64, f64)>,
    /// The loop transfer function, of the loops that are drawn.
    pub curve: Option<Curve>,
}

/// Changes of a loop that it tolerates.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct LoopMargins {
    /// The gain may rise by less than this factor.
    pub gain_up: Option<GainMargin>,
    /// The gain may fall by less than this factor.
    pub gain_down: Option<GainMargin>,
    /// Change of phase.
    pub phase: Option<PhaseMargin>,
    /// Additional delay.
    pub delay: Option<DelayMargin>,
    /// Distance of the curve to −1.
    pub modulus: ModulusMargin,
}

/// A factor on the gain.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct GainMargin {
    /// Factor.
    pub factor: f64,
    /// Frequency of the oscillation at the margin (Hz).
    pub frequency_hz: f64,
}

/// The sense of a change of phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Later.
    #[default]
    Lag,
    /// Earlier.
    Lead,
}

/// A change of phase.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct PhaseMargin {
    /// Degrees.
    pub degrees: f64,
    /// Whether more lag or more lead makes the loop unstable.
    pub direction: Direction,
    /// Frequency of the oscillation at the margin (Hz).
    pub frequency_hz: f64,
}

/// A delay.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct DelayMargin {
    /// Seconds.
    pub seconds: f64,
    /// Frequency of the oscillation at the margin (Hz).
    pub frequency_hz: f64,
}

/// The least |1 + L|. Its inverse is the largest sensitivity |S|.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct ModulusMargin {
    /// |1 + L|; for several loops the least singular value of I + L.
    pub value: f64,
    /// Where (Hz); none if it is the value 1 for ω → ∞.
    pub frequency_hz: Option<f64>,
}

/// All loops broken at once.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Together {
    /// Margins for the same change in all loops: those of the characteristic loci, the eigenvalues of L.
    pub equal: Option<LoopMargins>,
    /// For changes that differ between the loops: the least singular value of I + L.
    pub independent: Option<ModulusMargin>,
    /// Frequencies (Hz) and common gain factors at which I + L would be singular.
    pub critical: Vec<(f64, f64)>,
    /// Characteristic loci, each followed by continuity; those that come nearest to −1.
    pub loci: Vec<Curve>,
    /// Frequencies (Hz) and least singular values of I + L.
    pub least_singular: Vec<(f64, f64)>,
}

impl ModulusMargin {
    /// Factors on the gains between which stability is certain: 1/(1 + m) and 1/(1 − m).
    #[must_use]
    pub fn gains(&self) -> (f64, f64) {
        (1.0 / (1.0 + self.value), 1.0 / (1.0 - self.value).max(0.0))
    }

    /// Change of phase (degrees) below which stability is certain: 2 asin(m/2).
    #[must_use]
    pub fn phase(&self) -> f64 {
        2.0 * (0.5 * self.value.min(2.0)).asin().to_degrees()
    }
}

/// Eigenvalues over a parameter.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct RootLocus {
    /// What changes.
    pub parameter: String,
    /// Its values.
    pub values: Vec<f64>,
    /// Each eigenvalue over the values, followed by continuity: (Re λ in 1/s, Im λ in rad/s) with Im λ not
    /// negative.
    pub branches: Vec<Vec<(f64, f64)>>,
    /// Values between which an eigenvalue crosses the imaginary axis, and its frequency there (Hz).
    pub crossings: Vec<(f64, f64)>,
}
