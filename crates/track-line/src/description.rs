//! The line file: plan, elevation and cant as data (JSON).

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// The line of a track. Plan, elevation and cant are lists of pieces, each from the line's start on. Where a
/// list ends, the line continues as it is there: straight on, at the same slope and cant.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct LineDescription {
    /// Path or URL of the schema, for editors. Default: none.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Short name, for example `curve-200`.
    pub name: String,
    /// Description of the line, for its users. Default: empty.
    #[serde(default)]
    pub description: String,
    /// Position along the track at which the line starts (m); before it the track is straight. Default: 0.
    #[serde(default)]
    pub start: f64,
    /// The line seen from above, from piece to piece; curves to the left are positive. The curvature is
    /// continuous: between a straight and a circle there is a clothoid. The last piece ends straight.
    pub plan: Vec<Piece>,
    /// The slope, from piece to piece, in the same way: a sag (upward curve) is positive, a crest negative.
    /// A straight piece keeps the slope. Default: level.
    #[serde(default)]
    pub elevation: Vec<Piece>,
    /// The cant, from ramp to ramp. Default: none.
    #[serde(default)]
    pub cant: Vec<CantPiece>,
}

/// Kinds of pieces in plan and elevation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// No curvature.
    Straight,
    /// Constant curvature, `1/radius`.
    Circle,
    /// Curvature that changes linearly from that of the piece before to `1/to_radius`.
    Clothoid,
}

/// A piece of plan or elevation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Piece {
    /// Kind of the piece.
    pub kind: Kind,
    /// Length along the line (m).
    pub length: f64,
    /// Radius of a circle (m): positive to the left, or upwards. Only for a circle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Radius at the end of a clothoid (m), positive to the left, or upwards. Default: it ends straight.
    /// Only for a clothoid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_radius: Option<f64>,
}

/// Shapes of a cant ramp.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum CantShape {
    /// 3u² − 2u³ of the ramp's length: no jump of the rate of roll.
    #[default]
    Smooth,
    /// Linear, with jumps of the rate of roll at both ends.
    Linear,
}

/// A piece of the cant, which begins with the cant at the end of the piece before, the first one with 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CantPiece {
    /// Length along the line (m).
    pub length: f64,
    /// Cant at the end of the piece (rad): the roll of the plane of the rails, left side up positive. A
    /// curve to the left needs a negative cant. Default: that at its beginning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
    /// Shape of the ramp. Default: `smooth`.
    #[serde(default)]
    pub shape: CantShape,
}

impl LineDescription {
    /// Reads a line file and checks it.
    ///
    /// # Errors
    /// [`Error::Json`] or [`Error::Invalid`], with the path of the place.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let line: Self = strict_json::read(text)
            .map_err(|error| Error::Json { path: error.path, message: error.message })?;
        line.check()?;
        Ok(line)
    }
}
