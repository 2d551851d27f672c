//! Inputs over time: signals that the scenario describes instead of a unit.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::connection::Targets;
use crate::events::Fault;

/// A signal over time for one or more inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InputSignal {
    /// `instance.input`, patterns allowed, or a list of these. Real inputs without a connection.
    pub to: Targets,
    /// The signal, in the unit of measurement of the inputs. Times are simulated times (s).
    pub signal: SignalOverTime,
}

/// A signal over time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum SignalOverTime {
    /// A jump.
    Step(StepSignal),
    /// A line between two constant values.
    Ramp(RampSignal),
    /// One pulse (1 − cos)/2, such as a gust.
    Pulse(PulseSignal),
    /// A sine.
    Sine(SineSignal),
    /// A sine whose frequency changes linearly.
    Chirp(ChirpSignal),
    /// Points in the scenario.
    Table(TableSignal),
    /// Points in a CSV file.
    Csv(FileSignal),
    /// Points in a Parquet file.
    Parquet(FileSignal),
    /// Normally distributed random values at equal intervals.
    Noise(NoiseSignal),
}

/// `before` until the time, `after` from then on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StepSignal {
    /// Time of the jump (s).
    pub time: f64,
    /// Value before the jump.
    #[serde(default)]
    pub before: f64,
    /// Value from the jump on.
    pub after: f64,
}

/// `from` until `start`, `to` from `end` on, and a line in between.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RampSignal {
    /// Begin of the line (s).
    pub start: f64,
    /// End of the line (s).
    pub end: f64,
    /// Value before the line.
    #[serde(default)]
    pub from: f64,
    /// Value after the line.
    pub to: f64,
}

/// `base` + `height` · (1 − cos(2π (t − `start`)/(`end` − `start`)))/2 between `start` and `end`, otherwise `base`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PulseSignal {
    /// Begin of the pulse (s).
    pub start: f64,
    /// End of the pulse (s).
    pub end: f64,
    /// Height of the pulse above `base`.
    pub height: f64,
    /// Value before and after the pulse.
    #[serde(default)]
    pub base: f64,
}

/// `mean` + `amplitude` · sin(2π `frequency` (t − `start`) + `phase`) from `start` on, `mean` before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SineSignal {
    /// Amplitude.
    pub amplitude: f64,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Phase at `start` (rad).
    #[serde(default)]
    pub phase: f64,
    /// Mean value.
    #[serde(default)]
    pub mean: f64,
    /// Begin of the sine (s). Default: it has no begin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<f64>,
}

/// `mean` + `amplitude` · sin φ between `start` and `end`, where the frequency φ'/2π goes linearly from `from` to `to`;
/// `mean` before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChirpSignal {
    /// Amplitude.
    pub amplitude: f64,
    /// Frequency at `start` (Hz).
    pub from: f64,
    /// Frequency at `end` (Hz).
    pub to: f64,
    /// Begin of the sweep (s).
    pub start: f64,
    /// End of the sweep (s).
    pub end: f64,
    /// Mean value.
    #[serde(default)]
    pub mean: f64,
}

/// Points in the scenario. The first value holds before the first point, the last one after the last point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TableSignal {
    /// Times of the points (s), increasing.
    pub times: Vec<f64>,
    /// Values at these times.
    pub values: Vec<f64>,
    /// What the signal is between two points.
    #[serde(default)]
    pub interpolation: Interpolation,
}

/// Two columns of a CSV file with a header line, or of a Parquet file. The first value holds before the first point, the
/// last one after the last point. Rows in which the column is empty are left out, so that results of a run can be used.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSignal {
    /// Path of the file, relative to the scenario file.
    pub file: PathBuf,
    /// Name of the column with the times (s).
    #[serde(default = "time_column")]
    pub time: String,
    /// Name of the column with the values.
    pub column: String,
    /// What the signal is between two points.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// Multiplies the values.
    #[serde(default = "one")]
    pub factor: f64,
    /// Added to the times of the file (s).
    #[serde(default)]
    pub delay: f64,
}

/// Normally distributed, independent values at the times n · `interval`. The values depend on `seed` and n only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseSignal {
    /// Standard deviation of the values.
    pub rms: f64,
    /// Time between two values (s).
    pub interval: f64,
    /// Selects the values.
    #[serde(default)]
    pub seed: u64,
    /// Mean value.
    #[serde(default)]
    pub mean: f64,
    /// What the signal is between two values: `linear` or `hold`.
    #[serde(default)]
    pub interpolation: Interpolation,
}

/// What a signal is between two points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// A line.
    #[default]
    Linear,
    /// The value of the earlier point.
    Hold,
    /// A cubic polynomial whose slopes at the points are those of the parabolas through three points.
    Cubic,
}

impl InputSignal {
    /// The first setting that is not allowed.
    pub(crate) fn out_of_range(&self) -> Option<Fault> {
        let ordered = |start: f64, end: f64| {
            // also false for NaN
            let ordered = start < end;
            (!ordered).then(|| ("signal.end", end.to_string(), "after \"start\""))
        };
        let frequency = |key, value: f64| {
            (value < 0.0 || value.is_nan())
                .then(|| (key, value.to_string(), "a frequency (Hz) of 0 or more"))
        };
        match &self.signal {
            SignalOverTime::Step(_) | SignalOverTime::Csv(_) | SignalOverTime::Parquet(_) => None,
            SignalOverTime::Ramp(it) => ordered(it.start, it.end),
            SignalOverTime::Pulse(it) => ordered(it.start, it.end),
            SignalOverTime::Sine(it) => frequency("signal.frequency", it.frequency),
            SignalOverTime::Chirp(it) => ordered(it.start, it.end)
                .or_else(|| frequency("signal.from", it.from))
                .or_else(|| frequency("signal.to", it.to)),
            SignalOverTime::Table(it) => it.out_of_range(),
            SignalOverTime::Noise(it) if it.rms < 0.0 || it.rms.is_nan() => {
                Some(("signal.rms", it.rms.to_string(), "0 or more"))
            }
            SignalOverTime::Noise(it) if it.interval <= 0.0 || it.interval.is_nan() => {
                Some(("signal.interval", it.interval.to_string(), "a positive number of seconds"))
            }
            SignalOverTime::Noise(it) if it.interpolation == Interpolation::Cubic => {
                Some(("signal.interpolation", "cubic".to_owned(), "linear or hold for noise"))
            }
            SignalOverTime::Noise(_) => None,
        }
    }
}

impl TableSignal {
    fn out_of_range(&self) -> Option<Fault> {
        let Self { times, values, .. } = self;
        if times.is_empty() {
            return Some(("signal.times", "empty".to_owned(), "a list of at least one time"));
        }
        if times.len() != values.len() {
            let what = format!("{} values for {} times", values.len(), times.len());
            return Some(("signal.values", what, "one value for each time"));
        }
        let later = times.windows(2).find(|pair| pair[0] >= pair[1] || pair[1].is_nan())?;
        let what = format!("{} after {}", later[1], later[0]);
        Some(("signal.times", what, "a list of increasing times"))
    }
}

/// Puts a folder in front of the paths of files with signals.
pub(crate) fn locate(scenario: &mut Value, folder: &Path) {
    let inputs = scenario.get_mut("inputs").and_then(Value::as_array_mut);
    for input in inputs.into_iter().flatten() {
        let file = input.get_mut("signal").and_then(|signal| signal.get_mut("file"));
        if let Some(Value::String(path)) = file {
            *path = folder.join(&*path).to_string_lossy().into_owned();
        }
    }
}

fn time_column() -> String {
    "time".to_owned()
}

const fn one() -> f64 {
    1.0
}
