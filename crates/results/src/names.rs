//! Names of the files in a results folder.

/// The recorded signals, as text.
pub const TABLE: &str = "results.csv";
/// The recorded signals, in columns.
pub const PARQUET: &str = "results.parquet";
/// What happened besides the signals.
pub const EVENTS: &str = "events.csv";
/// What ran, how it ended, and the statistics of the signals.
pub const SUMMARY: &str = "summary.json";
/// The scenario with everything that came from the command line.
pub const AS_RUN: &str = "scenario-as-run.json";
/// The state from which a stopped run can continue.
pub const CHECKPOINT: &str = "checkpoint.bin";
/// The modes of the coupled system.
pub const MODES: &str = "modes.json";
/// The interactive overview.
pub const REPORT: &str = "report.html";
/// Which files belong to the run.
pub const FILES: &str = "run-files.json";
