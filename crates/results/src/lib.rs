//! The results folder of a run: results.csv and its copy in Parquet, events.csv, summary.json, and the list
//! of files that says which run they belong to. docs/results.md describes the formats.
//!
//! Nothing else knows the names of the files or what is in them.

mod curve;
mod events;
mod file;
mod folder;
mod growing;
mod keeper;
pub mod modes;
mod names;
mod parquet;
mod spool;
mod statistics;
pub mod summary;
mod table;

pub use curve::Curve;
pub use events::{Event, EventKind, EventLog, LogState};
pub use file::{Fingerprint, causes, fingerprint, write_whole};
pub use folder::{Folder, FolderError, add_files};
pub use growing::Position;
pub use keeper::write_now;
pub use names::{AS_RUN, CHECKPOINT, EVENTS, FILES, MODES, PARQUET, REPORT, SUMMARY, TABLE};
pub use parquet::{ParquetError, copy_to_parquet};
pub use statistics::{Gatherer, Statistics};
pub use summary::Summary;
pub use table::{Column, Table};
