//! Measured time series beside the signals of a run.
//!
//! A [`RecordSpec`] says which columns of a CSV or Parquet file belong to which signals. [`Record::load`] reads them and
//! converts their units, [`align`] finds the offset between the clocks, [`compare`] computes the figures of the error.
//! [`section`] shows them in a report, and [`as_run`] puts the record beside the runs there.

#![forbid(unsafe_code)]
#![expect(clippy::result_large_err, reason = "an error ends the comparison")]
#![doc = include_str!("../README.md")]

mod align;
mod as_run;
mod compare;
mod error;
mod interpolate;
mod pictures;
mod record;
mod section;
mod spec;
mod spectra;
mod units;

pub use align::{Alignment, Found, align};
pub use as_run::as_run;
pub use compare::{Comparison, SignalComparison, compare};
pub use error::MeasuredError;
pub use interpolate::Interpolated;
pub use pictures::{residuals, thinned};
pub use record::{Column, Record};
pub use section::section;
pub use spec::{MapEntry, MappedColumn, Offset, RecordSpec};
pub use spectra::SpectraCompared;
pub use units::Units;
