//! Names of the files in a results folder.

/// The recorded signals, as text.
pub const TABLE: &str = "results.csv";
/// The recorded signals, in columns.
pub const PARQUET: &str = "results.parquet";
/// The events of the run.
pub const EVENTS: &str = "events.csv";
/// Which scenario ran, how the run ended, and the statistics of the signals.
pub const SUMMARY: &str = "summary.json";
/// Named figures of the run, flat.
pub const METRICS: &str = "metrics.json";
/// The scenario with the changes of the command line.
pub const AS_RUN: &str = "scenario-as-run.json";
/// The state from which a stopped run can be resumed.
pub const CHECKPOINT: &str = "checkpoint.bin";
/// The modes of the coupled system.
pub const MODES: &str = "modes.json";
/// The shapes of these modes.
pub const MODE_SHAPES: &str = "mode-shapes.json";
/// Frequency responses and margins.
pub const RESPONSE: &str = "response.json";
/// A record beside the run.
pub const MEASURED: &str = "measured.json";
/// The interactive report.
pub const REPORT: &str = "report.html";
/// The list of files that belong to the run.
pub const FILES: &str = "run-files.json";
