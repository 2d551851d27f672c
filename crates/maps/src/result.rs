//! The result of a map.

use serde::{Deserialize, Serialize};

/// A point of a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapCell {
    /// Damping ratio −Re λ/|λ| of the least damped mode in a loop between units; negative if it grows.
    pub damping: f64,
    /// |λ|/2π (Hz).
    pub frequency_hz: f64,
    /// Re λ (1/s).
    pub real: f64,
    /// Im λ (1/s).
    pub imaginary: f64,
    /// Modes that grow, as far as known: where one grows, there may be more.
    pub growing: usize,
    /// Kind of units with the largest share in the mode.
    pub mode: ModeKind,
    /// How it is known.
    pub evidence: Known,
    /// Value of the parameter of `--over` at which it was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
}

/// Whose mode it is, by the largest share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModeKind {
    /// The units that the controllers act on.
    Plant,
    /// Units of few states beside them.
    Attached,
    /// The controllers.
    Controllers,
    /// Not determined: all eigenvalues were computed, without shares.
    Unknown,
}

/// How a point is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Known {
    /// Modes are followed, and the count shows that there is none with less damping.
    Counted,
    /// No mode is in the region of the count. The mode shown is the least damped of those that are followed.
    Beyond,
    /// A mode grows for certain; not all growing ones were identified.
    Growing,
    /// All eigenvalues of the reduced or of the whole system.
    Eigenvalues,
}

/// A parameter of a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapAxis {
    /// `instance.variable` as given.
    pub target: String,
    /// Unit of measure.
    pub unit: Option<String>,
    /// Values.
    pub values: Vec<f64>,
    /// The scenario's own value.
    pub scenario: Option<f64>,
    /// What the parameter enters.
    pub enters: String,
}

/// Comparison with all eigenvalues at a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Value of the first parameter.
    pub x: f64,
    /// Value of the second one.
    pub y: Option<f64>,
    /// Distance of the cell's λ to the nearest eigenvalue, relative.
    pub distance: f64,
    /// Modes that grow, by all eigenvalues.
    pub growing: usize,
    /// The same in the map.
    pub mapped: usize,
    /// Least damping if the system is started anew with these values, which includes the change of the operating point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restarted: Option<f64>,
}

/// A point of the stability boundary, between two neighbouring points of the grid: a mode with Re λ = 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoundaryPoint {
    /// Row and column of the first of the two.
    pub row: usize,
    /// Column.
    pub column: usize,
    /// Whether the second is the next in the row, or else in the column.
    pub along_x: bool,
    /// Part of the way to the second.
    pub part: f64,
    /// Value of the first parameter.
    pub x: f64,
    /// Value of the second one.
    pub y: Option<f64>,
    /// |λ|/2π (Hz).
    pub frequency_hz: f64,
    /// Distance of 2πi · frequency to the nearest of all eigenvalues of the whole system, relative; at random points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<f64>,
}

/// A whole map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StabilityMap {
    /// The scenario's title.
    pub title: String,
    /// Columns.
    pub x: MapAxis,
    /// Rows.
    pub y: Option<MapAxis>,
    /// Over which the worst is taken.
    pub over: Option<MapAxis>,
    /// How it was computed, what was assumed, and what fell short.
    pub notes: Vec<String>,
    /// Names for the three kinds of units: plant, attached, controllers.
    pub kinds: [String; 3],
    /// Comparisons with all eigenvalues.
    pub checks: Vec<Check>,
    /// The stability boundary, refined between the points of the grid. Empty if that was not possible: then the picture's
    /// line is interpolated.
    #[serde(default)]
    pub boundary: Vec<BoundaryPoint>,
    /// Time of the survey and of everything (s).
    pub seconds: [f64; 2],
    /// Row by row.
    pub cells: Vec<Vec<MapCell>>,
}

impl StabilityMap {
    /// Whether all modes decay everywhere.
    #[must_use]
    pub fn stable(&self) -> bool {
        self.cells.iter().flatten().all(|cell| cell.growing == 0 && cell.damping > 0.0)
    }
}
