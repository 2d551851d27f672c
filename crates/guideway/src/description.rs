//! The guideway as data: the content of a layout file.

use std::collections::BTreeMap;

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;
pub use crate::girder_description::{
    GirderDescription, PierDescription, SectionDescription, ShapeComponent, SupportDescription,
    TabulatedShape,
};
pub use crate::rails_description::{
    CoherenceDescription, MeasuredProfile, PeriodicDescription, PsdDescription, PsdOf,
    RailIrregularityDescription, RailProfileDescription, RailsDescription, WhichRail,
};
pub use crate::space_description::{LateralDescription, TorsionDescription};

/// A guideway: rigid ground, a row of spans, rigid ground. Lengths in m along the track.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(title = "Maglev guideway", rename = "Guideway"))]
#[serde(deny_unknown_fields)]
pub struct GuidewayDescription {
    /// Path or URL of the schema, for editors. Default: none.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Remarks on the layout and the source of its numbers. Default: empty.
    #[serde(default)]
    pub note: String,
    /// Start of the first span (m). Default 0.
    #[serde(default)]
    pub start: f64,
    /// Kinds of span, by name.
    pub girders: BTreeMap<String, GirderDescription>,
    /// The spans in order, without gaps between them.
    pub spans: Vec<SpanRun>,
    /// Number of magnets (moving loads), 1 to 4096.
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 4096)))]
    pub magnets: usize,
    /// Points of the girders whose motion the unit gives as outputs. Default: none beyond the middle and
    /// the quarter of every span.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointDescription>,
    /// How each magnet's force is spread. Default: 8 forces over 0.65 m.
    #[serde(default)]
    pub pole: PoleDescription,
    /// State of the girders at the start. Default: "quasi-static".
    #[serde(default)]
    pub initial: InitialDeflection,
    /// Vertical irregularity of the track surface. Default: off.
    #[serde(default)]
    pub irregularity: IrregularityDescription,
    /// Chirp of eq. 13. Default: off.
    #[serde(default)]
    pub chirp: ChirpDescription,
    /// Factor on all modal stiffnesses; frequencies change by its root. Default 1.
    #[serde(default = "one")]
    pub stiffness_factor: f64,
    /// Factor on all modal masses; frequencies change by its inverse root. Default 1.
    #[serde(default = "one")]
    pub mass_factor: f64,
    /// The two rails, for girders in three dimensions: with them each magnet meets its own rail, which has a vertical
    /// and a lateral motion, and the unit has lateral forces as inputs. Default: none, the track is a line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rails: Option<RailsDescription>,
    /// Whether the unit gives the kink and the step of the track at every joint as outputs. Default no.
    #[serde(default, skip_serializing_if = "is_false")]
    pub joints: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the form that serde asks for")]
fn is_false(value: &bool) -> bool {
    !*value
}

fn one() -> f64 {
    1.0
}

/// Equal spans in a row.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Spans"))]
#[serde(deny_unknown_fields)]
pub struct SpanRun {
    /// Name, for patches. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Name of the kind of span, a key of `girders`.
    pub girder: String,
    /// Number of these spans. Default 1.
    #[serde(default = "one_span")]
    pub count: usize,
}

/// A named point of a girder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Point"))]
#[serde(deny_unknown_fields)]
pub struct PointDescription {
    /// Name: letters, digits and underscores, a letter first. The outputs are `NAME_displacement`,
    /// `NAME_velocity` and `NAME_acceleration`.
    pub name: String,
    /// Number of the span along the track, from 1.
    #[cfg_attr(feature = "schema", schemars(range(min = 1)))]
    pub span: usize,
    /// Place (m from the start of the span), 0 to its length.
    pub x: f64,
}

fn one_span() -> usize {
    1
}

/// Discrete forces of one magnet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Pole"))]
#[serde(deny_unknown_fields, default)]
pub struct PoleDescription {
    /// Pole length (m). Default 0.65.
    pub length: f64,
    /// Discrete forces over it. Default 8.
    pub forces: usize,
}

impl Default for PoleDescription {
    fn default() -> Self {
        Self { length: 0.65, forces: 8 }
    }
}

/// State of the girders at the start of a simulation, under the loads at that time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum InitialDeflection {
    /// q = 0, q̇ = 0: loads are applied suddenly.
    Undeformed,
    /// q = φᵀF/K, q̇ = 0: the loads have been at rest for a long time.
    Static,
    /// q = φᵀF/K, q̇ = v·φ′ᵀF/K: the loads have been moving slowly. At speed 0 this is the static
    /// state.
    #[default]
    QuasiStatic,
}

/// Vertical irregularity of the track surface, added to the deflection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Irregularity"))]
#[serde(deny_unknown_fields, default)]
pub struct IrregularityDescription {
    /// Whether it is present. Default: no.
    pub on: bool,
    /// A file with two columns x, z (m) that replaces the random profile. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A in S(Ω) = A/Ω², one-sided, S in m²/(rad/m) (so A in m·rad). Default 7e-7: with it
    /// the RMS of the paper's train's gaps is 8.01 mm, as the paper reports.
    pub amplitude: f64,
    /// Seed of the random phases. Default 1.
    pub seed: u64,
    /// Shortest wave (m). Default 0.5.
    pub shortest_wave: f64,
    /// Longest wave (m). Default 50.
    pub longest_wave: f64,
    /// Number of harmonics. Default 2048: the shortest waves are then 2π/217 m apart, close enough
    /// to resemble a continuous spectrum over a track of that length.
    pub lines: usize,
    /// Start of the fade-in (m). Default: start of the first span.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<f64>,
    /// End of the fade-out (m). Default: 100 m beyond the last span.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<f64>,
    /// Length of fade-in and fade-out (m). Default 10.
    pub fade_length: f64,
    /// Whether each magnet feels the mean over its pole. Default yes, as its force and the deflection
    /// are spread over the pole. No: the profile at the magnet's centre, also of waves shorter than
    /// the pole.
    pub averaged: bool,
}

impl Default for IrregularityDescription {
    fn default() -> Self {
        Self {
            on: false,
            file: None,
            amplitude: 7e-7,
            seed: 1,
            shortest_wave: 0.5,
            longest_wave: 50.0,
            lines: 2048,
            start: None,
            end: None,
            fade_length: 10.0,
            averaged: true,
        }
    }
}

/// Excitation force A·sin(π(t−t₀)²) of eq. 13: its frequency in Hz equals t−t₀ in s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Chirp"))]
#[serde(deny_unknown_fields, default)]
pub struct ChirpDescription {
    /// Whether it is present. Default: no.
    pub on: bool,
    /// A (N); positive pushes the guideway down. Default 1000.
    pub amplitude: f64,
    /// Position along the track (m). Default: middle of the middle span.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<f64>,
    /// t₀ (s). Default 0.
    pub start: f64,
    /// Frequency at which it ends (Hz), at the last zero of the sine before. Default 100.
    pub end_frequency: f64,
}

impl Default for ChirpDescription {
    fn default() -> Self {
        Self { on: false, amplitude: 1000.0, position: None, start: 0.0, end_frequency: 100.0 }
    }
}

impl GuidewayDescription {
    /// Reads a layout file's text. Each value is checked later, by [`crate::Guideway::new`].
    ///
    /// # Errors
    /// [`Error::Json`] with the path of the entry at fault, [`Error::Invalid`] if values contradict each other.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let description: Self = strict_json::read(text).map_err(|error| Error::Json {
            path: if error.path.is_empty() { ".".to_owned() } else { error.path },
            message: error.message,
        })?;
        description.check_contradictions()?;
        Ok(description)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIRDERS: &str = r#""girders": {"g": {"length": 25.0, "modes": 1,
        "mass_per_length": 100.0, "frequencies": [5.0], "damping": [0.01]}}"#;

    #[test]
    fn invariant_a_written_description_reads_back_the_same() {
        let text = format!(r#"{{ {GIRDERS}, "spans": [{{"girder": "g"}}], "magnets": 2 }}"#);
        let first = GuidewayDescription::from_json(&text).unwrap();
        let again =
            GuidewayDescription::from_json(&serde_json::to_string(&first).unwrap()).unwrap();
        assert_eq!(first, again);
        assert_eq!(GuidewayDescription::from_json(&format!("\u{feff}{text}")).unwrap(), first);
        assert_eq!((first.pole.forces, first.spans[0].count, first.mass_factor), (8, 1, 1.0));
    }

    #[test]
    fn invariant_errors_name_the_path() {
        let text =
            format!(r#"{{ {GIRDERS}, "spans": [{{"girder": "g", "cuont": 3}}], "magnets": 2 }}"#);
        let message = GuidewayDescription::from_json(&text).unwrap_err().to_string();
        assert!(message.contains("spans[0]") && message.contains("cuont"), "{message}");
        assert!(message.contains("did you mean `count`?"), "{message}");
        for (text, part) in [("{}", "missing field `girders`"), ("{} x", "trailing characters")] {
            let message = GuidewayDescription::from_json(text).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        }
    }
}
