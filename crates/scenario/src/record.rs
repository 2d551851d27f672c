//! Recorded signals, result files and pictures.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Recorded signals and the format of the results.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Record {
    /// Interval between rows (s), a multiple of the step. Default: the step. Statistics in the summary use every
    /// communication point.
    pub interval: Option<f64>,
    /// `instance.variable`, patterns and `*` allowed; or an object with a separate interval. If several entries name a
    /// signal, the first one counts.
    pub signals: Vec<Recorded>,
    /// Formats of the results: `csv` writes results.csv, `parquet` writes results.parquet.
    pub format: Vec<ResultFormat>,
}

impl Default for Record {
    fn default() -> Self {
        Self { interval: None, signals: Vec::new(), format: vec![ResultFormat::Csv] }
    }
}

/// Signals to record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"instance.variable\" or {\"signals\": [...], \"interval\": ...}"
)]
pub enum Recorded {
    /// `instance.variable`, at the interval of the record.
    Signal(String),
    /// Signals with a separate interval.
    Group(RecordedGroup),
}

/// Signals that are recorded at a separate interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordedGroup {
    /// `instance.variable`, patterns and `*` allowed.
    pub signals: Vec<String>,
    /// Interval between values (s), a multiple of the step.
    pub interval: f64,
}

/// A format of the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Format")]
pub enum ResultFormat {
    /// results.csv
    Csv,
    /// results.parquet
    Parquet,
}

impl std::str::FromStr for ResultFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "csv" => Ok(Self::Csv),
            "parquet" => Ok(Self::Parquet),
            _ => Err(format!("unknown format \"{text}\"; choose csv or parquet")),
        }
    }
}

/// A picture: panels above each other with a common time axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plot {
    /// File name in the results folder, ending in .svg.
    pub file: String,
    /// Title above the panels.
    #[serde(default)]
    pub title: String,
    /// Panels from top to bottom.
    pub panels: Vec<PlotPanel>,
}

/// A panel of a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Panel")]
pub struct PlotPanel {
    /// Label of the vertical axis. The unit in it is the one after `scale`.
    #[serde(default)]
    pub ylabel: String,
    /// Factor from the signal's unit to the unit of the axis.
    #[serde(default = "one")]
    pub scale: f64,
    /// Signals to draw, patterns and `*` allowed.
    pub signals: Vec<String>,
    /// Legend texts in the order of the signals. Default: the names of the signals.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
}

const fn one() -> f64 {
    1.0
}
