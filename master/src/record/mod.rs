//! Results: rows of results.csv, its copy in Parquet, the log of events, statistics over every
//! communication point, curves for pictures. docs/results.md tells the formats.

mod curve;
mod events;
mod file;
mod growing;
mod keeper;
mod parquet;
mod spool;
mod statistics;
mod table;

pub use curve::Curve;
pub use events::{Event, EventLog, Kind, LogState};
pub use file::write_whole;
pub(crate) use file::{partial, reserve};
pub use growing::Position;
pub(crate) use keeper::write_now;
pub use parquet::{ParquetError, copy_to_parquet};
pub use statistics::{Gatherer, Statistics};
pub use table::{Column, Table};
