//! What is written to the results, and what is drawn of it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is written to the results.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Record {
    /// Interval between rows (s), a multiple of the step; left out: every step. Statistics are
    /// taken at every communication point all the same.
    pub interval: Option<f64>,
    /// `instance.variable`, patterns and `*` allowed, or an object with an interval of its own. A
    /// signal that several entries name is recorded as the first of them says.
    pub signals: Vec<Recorded>,
    /// Files to write: csv for results.csv, parquet for results.parquet.
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
    /// One pattern, at the interval of all.
    Signal(String),
    /// Several, at an interval of their own.
    Group(RecordedGroup),
}

/// Signals recorded at an interval of their own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordedGroup {
    /// `instance.variable`, patterns and `*` allowed.
    pub signals: Vec<String>,
    /// Interval between their values (s), a multiple of the step.
    pub interval: f64,
}

/// A format of results.
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
            _ => Err(format!("there is no format \"{text}\"; there are csv and parquet")),
        }
    }
}

/// One picture: panels above each other over a common time axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plot {
    /// File name in the results folder, ending in .svg.
    pub file: String,
    /// Heading.
    #[serde(default)]
    pub title: String,
    /// From top to bottom.
    pub panels: Vec<PlotPanel>,
}

/// One panel of a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Panel")]
pub struct PlotPanel {
    /// Label of the vertical axis, with the unit after `scale`.
    #[serde(default)]
    pub ylabel: String,
    /// Factor from SI units to what is drawn.
    #[serde(default = "one")]
    pub scale: f64,
    /// Signals to draw, patterns and `*` allowed.
    pub signals: Vec<String>,
    /// Legend texts in the order of the signals; left out: their names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
}

const fn one() -> f64 {
    1.0
}
