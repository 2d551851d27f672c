//! The results folder of a run: results.csv and its copy in Parquet, events.csv, summary.json, modes.json,
//! and the list of files that belong to the run. docs/results.md describes the formats.
//!
//! No other crate knows the names of the files or their content. [`Folder`], [`TableWriter`], [`EventLog`]
//! and [`Summary`] write during a run; [`RunResults`] and [`Table`] read.

mod columns;
mod curve;
mod events;
mod file;
mod file_list;
mod folder;
mod growing;
mod journal;
mod keeper;
mod metrics;
pub mod modes;
mod names;
mod parquet;
mod read;
mod read_error;
mod recorder;
pub mod response;
mod run_results;
mod scenario_as_run;
mod spool;
mod statistics;
pub mod summary;
mod table;
mod table_writer;
mod verify;

pub use curve::Curve;
pub use events::{Event, EventKind, EventLog, LogState};
pub use file::{Fingerprint, causes, fingerprint, replace, write_whole};
pub use folder::{Folder, FolderError, add_files};
pub use growing::Position;
pub use journal::{Journal, JournalError};
pub use keeper::write_now;
pub use metrics::write_metrics;
pub use names::{
    AS_RUN, CHECKPOINT, EVENTS, FILES, MEASURED, METRICS, MODE_SHAPES, MODES, PARQUET, REPORT,
    RESPONSE, SUMMARY, TABLE,
};
pub use parquet::{ParquetError, copy_to_parquet};
pub use read_error::ReadError;
pub use recorder::TableRecorder;
pub use run_results::RunResults;
pub use scenario_as_run::{InstanceAsRun, PanelAsRun, PlotAsRun, ScenarioAsRun};
pub use statistics::{Gatherer, Statistics};
pub use summary::Summary;
pub use table::{NOT_DUE, Table};
pub use table_writer::{RecordedColumn, TableWriter};
