//! The two rails of a guideway, and their irregularity, as data.

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Two rails beside and above the shear centre of the girders.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Rails"))]
#[serde(deny_unknown_fields)]
pub struct RailsDescription {
    /// Distance of each rail from the middle of the track (m). Default 0.95, that of the paper's train.
    #[serde(default = "half_gauge")]
    pub half_gauge: f64,
    /// Height of the faces of the rails over the shear centre of the girder (m). Default 0.
    #[serde(default)]
    pub height: f64,
    /// Which rail each magnet meets, "left" or "right": a pattern that is repeated until every magnet has a rail. Default:
    /// four left, then four right, as of a bogie of the paper's train.
    #[serde(default = "sides")]
    pub sides: Vec<WhichRail>,
    /// Irregularity of each rail, vertical and lateral, in addition to that of the track. Default: off.
    #[serde(default, skip_serializing_if = "RailIrregularityDescription::is_default")]
    pub irregularity: RailIrregularityDescription,
}

fn half_gauge() -> f64 {
    0.95
}

fn sides() -> Vec<WhichRail> {
    let side = |k| if k < 4 { WhichRail::Left } else { WhichRail::Right };
    (0..8).map(side).collect()
}

impl Default for RailsDescription {
    fn default() -> Self {
        let irregularity = RailIrregularityDescription::default();
        Self { half_gauge: half_gauge(), height: 0.0, sides: sides(), irregularity }
    }
}

/// A rail, or both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum WhichRail {
    /// The left rail, looking forward.
    Left,
    /// The right rail.
    Right,
    /// Both rails alike; not for a magnet.
    #[default]
    Both,
}

/// Irregularity of two rails.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "RailIrregularity"))]
#[serde(deny_unknown_fields, default)]
pub struct RailIrregularityDescription {
    /// Whether it is present. Default: no.
    pub on: bool,
    /// Seed of the random phases. Default 1.
    pub seed: u64,
    /// Height of the rails (m), up positive: level and cross level. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertical: Option<RailProfileDescription>,
    /// Lateral place of the rails (m), left positive: alignment and gauge. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lateral: Option<RailProfileDescription>,
    /// Start of the fade-in (m). Default: start of the first span.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<f64>,
    /// End of the fade-out (m). Default: 100 m beyond the last span.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<f64>,
    /// Length of fade-in and fade-out (m). Default 10.
    pub fade_length: f64,
    /// Whether each magnet feels the mean over its pole. Default yes.
    pub averaged: bool,
}

impl Default for RailIrregularityDescription {
    fn default() -> Self {
        Self {
            on: false,
            seed: 1,
            vertical: None,
            lateral: None,
            start: None,
            end: None,
            fade_length: 10.0,
            averaged: true,
        }
    }
}

impl RailIrregularityDescription {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Irregularity of both rails in one direction: the sum of a random part, periodic parts and measured
/// profiles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "RailProfile"))]
#[serde(deny_unknown_fields, default)]
pub struct RailProfileDescription {
    /// Power spectral density of the random part. Default: no random part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub psd: Option<PsdDescription>,
    /// Whether `psd` is that of each rail, or that of the mean of both. Default "rail".
    pub psd_of: PsdOf,
    /// How alike the two rails are, wave by wave. Default: the same.
    pub coherence: CoherenceDescription,
    /// Shortest wave of the random part (m). Default 0.5.
    pub shortest_wave: f64,
    /// Longest wave of the random part (m). Default 50.
    pub longest_wave: f64,
    /// Number of harmonics of the random part. Default 2048.
    pub lines: usize,
    /// Factor on the random part of the left rail. Default 1.
    pub left_factor: f64,
    /// Factor on the random part of the right rail. Default 1.
    pub right_factor: f64,
    /// Periodic parts: of the pole pitch, of joints, of the span. Default: none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub periodic: Vec<PeriodicDescription>,
    /// Measured profile of the left rail. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left: Option<MeasuredProfile>,
    /// Measured profile of the right rail. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub right: Option<MeasuredProfile>,
}

impl Default for RailProfileDescription {
    fn default() -> Self {
        Self {
            psd: None,
            psd_of: PsdOf::Rail,
            coherence: CoherenceDescription::default(),
            shortest_wave: 0.5,
            longest_wave: 50.0,
            lines: 2048,
            left_factor: 1.0,
            right_factor: 1.0,
            periodic: Vec::new(),
            left: None,
            right: None,
        }
    }
}

/// What a spectrum describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum PsdOf {
    /// Each rail.
    #[default]
    Rail,
    /// The mean of both rails, as measuring cars and the railways' standard spectra have it.
    Mean,
}

/// A one-sided power spectral density S (m²/(rad/m)) over the wavenumber Ω (rad/m).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Psd"))]
#[serde(tag = "form", rename_all = "kebab-case", deny_unknown_fields)]
pub enum PsdDescription {
    /// S = A/Ω².
    InverseSquare {
        /// A (m·rad).
        amplitude: f64,
    },
    /// S = A·∏(Ω² + zᵢ²)/∏(Ω² + pᵢ²), corners z and p in rad/m.
    Rational {
        /// A, in the unit that makes S m²/(rad/m).
        amplitude: f64,
        /// Corners pᵢ of the denominator (rad/m).
        poles: Vec<f64>,
        /// Corners zᵢ of the numerator (rad/m). Default: none.
        #[serde(default)]
        zeros: Vec<f64>,
    },
    /// Track of low irregularity of the German railways and of ERRI B 176, as the mean of both rails:
    /// S = A·Ω_c²/((Ω² + Ω_r²)(Ω² + Ω_c²)), Ω_c = 0.8246 and Ω_r = 0.0206 rad/m, A = 4.032e-7 m·rad vertical, 2.119e-7
    /// lateral.
    GermanLow {},
    /// The same of high irregularity: A = 1.080e-6 m·rad vertical, 6.125e-7 lateral.
    GermanHigh {},
    /// S(n) = A·(n² + B·n + C)/(n⁴ + D·n³ + E·n² + F·n + G) in m²/(1/m) over the spatial frequency n = Ω/2π (1/m), the form
    /// to which measurements of tracks, also of maglev guideways, are fitted. Literature that gives A for mm²/(1/m): times
    /// 1e-6.
    SevenParameter {
        /// A (m).
        a: f64,
        /// B (1/m).
        b: f64,
        /// C (1/m²).
        c: f64,
        /// D (1/m).
        d: f64,
        /// E (1/m²).
        e: f64,
        /// F (1/m³).
        f: f64,
        /// G (1/m⁴).
        g: f64,
    },
}

/// The coherency of the two rails, γ(Ω) = γ₀/(1 + (Ω/Ω_k)²): cross-spectrum over spectrum, so that its square is
/// the coherence. The cross level z_left − z_right then has the spectrum 2·(1 − γ)·S.
///
/// The railways' cross level Ω²/(Ω² + Ω_s²) times the spectrum of the mean is γ₀ = 1, Ω_k = Ω_s/√2.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Coherence"))]
#[serde(deny_unknown_fields, default)]
pub struct CoherenceDescription {
    /// γ₀ (1), −1 to 1: of the longest waves. Default 1.
    pub long_waves: f64,
    /// Ω_k (rad/m), beyond which the rails lose their likeness. Default: none, γ = γ₀ for all waves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corner: Option<f64>,
}

impl Default for CoherenceDescription {
    fn default() -> Self {
        Self { long_waves: 1.0, corner: None }
    }
}

/// A periodic part: Σ aₖ·sin(2πk(x − x₀)/λ + ϕₖ), x₀ the start of the first span.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Periodic"))]
#[serde(deny_unknown_fields)]
pub struct PeriodicDescription {
    /// Remarks. Default: empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// λ (m): the pole pitch, the distance of joints, the span.
    pub wavelength: f64,
    /// aₖ (m), first harmonic first.
    pub amplitudes: Vec<f64>,
    /// ϕₖ (rad), first harmonic first. Default: 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub phases: Vec<f64>,
    /// Which rail has it. Default "both".
    #[serde(default)]
    pub rail: WhichRail,
}

/// A measured profile: a file, or its points.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Measured"))]
#[serde(deny_unknown_fields, default)]
pub struct MeasuredProfile {
    /// A CSV file beside the layout file, with two columns x and value (m), as that of `irregularity`. Default: none, give
    /// the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Places along the track (m), increasing. Default: those of the file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub x: Vec<f64>,
    /// Heights, or lateral places (m). Default: those of the file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub value: Vec<f64>,
}
