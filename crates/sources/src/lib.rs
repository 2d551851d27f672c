//! Signals over time: value, derivatives, and the times at which a signal is not smooth.
//!
//! A signal consists of smooth pieces. [`Source::course`] gives the value and the first three derivatives at the
//! beginning of a step, exact within a piece. [`Source::breaks`] lists the times at which steps should end: jumps, and
//! the kinks of signals that have few. Points with linear or cubic interpolation are too many for that: over a step with
//! points inside, the course is the line (linear) or the cubic Hermite polynomial (cubic) through both ends.

mod columns;
mod noise;
mod points;
mod read_csv;
mod read_parquet;
mod rows;
mod waves;

use std::fmt;
use std::path::PathBuf;

use scenario::{Interpolation, SignalOverTime};
use thiserror::Error;

pub use columns::{column_names, read_column};
use noise::Noise;
use points::Points;
use waves::Wave;

/// Most breaks of a signal within a run.
pub const MAX_BREAKS: usize = 1_000_000;

/// Why a signal cannot be used.
#[derive(Debug, Error)]
pub enum SourceError {
    /// The file cannot be read, or is not CSV.
    #[error("cannot read {path}")]
    Csv {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: csv::Error,
    },
    /// The file cannot be opened.
    #[error("cannot read {path}")]
    Open {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// The file is not Parquet, or damaged, or compressed in a way that is not supported.
    #[error("cannot read {path} as Parquet")]
    Parquet {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: parquet::errors::ParquetError,
    },
    /// A column is missing.
    #[error("{path} has no column \"{column}\"; its columns: {}{}", known.join(", "),
        suggestion.as_ref().map(|it| format!("; did you mean \"{it}\"?")).unwrap_or_default())]
    Column {
        /// Path of the file.
        path: PathBuf,
        /// The name that was looked for.
        column: String,
        /// The columns of the file, at most twenty.
        known: Vec<String>,
        /// A similar name.
        suggestion: Option<String>,
    },
    /// A row has more fields than the header.
    #[error("{path}, {row}: {fields} fields under a header of {columns}")]
    Fields {
        /// Path of the file.
        path: PathBuf,
        /// Where in the file.
        row: Row,
        /// Number of its fields.
        fields: usize,
        /// Number of columns in the header.
        columns: usize,
    },
    /// A field is not a finite number.
    #[error("{path}, {row}, column \"{column}\": \"{text}\" is not a finite number")]
    Number {
        /// Path of the file.
        path: PathBuf,
        /// Where in the file.
        row: Row,
        /// Name of the column.
        column: String,
        /// The field.
        text: String,
    },
    /// A time is not after the one before.
    #[error("{path}, {row}: the time {time} s is not after the one before, {before} s")]
    Order {
        /// Path of the file.
        path: PathBuf,
        /// Where in the file.
        row: Row,
        /// The time (s).
        time: f64,
        /// The time before (s).
        before: f64,
    },
    /// The file has no values.
    #[error("{path} has no values in the column \"{column}\"")]
    Empty {
        /// Path of the file.
        path: PathBuf,
        /// Name of the column.
        column: String,
    },
    /// The signal jumps too often.
    #[error("the signal jumps more than {MAX_BREAKS} times during the run")]
    TooMany,
}

/// A row of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Row {
    /// Line of a text file, from 1.
    Line(u64),
    /// Row of a table, from 1.
    Number(u64),
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Number(row) => write!(f, "row {row}"),
        }
    }
}

impl SourceError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Csv { .. } | Self::Open { .. } => {
                "give the path of a CSV file with a header line, or of a Parquet file, relative to the scenario \
                 file"
            }
            Self::Parquet { .. } => {
                "write the file without compression, or with Snappy (pandas: \
                 to_parquet(FILE, compression=\"snappy\")); for CSV use \"type\": \"csv\""
            }
            Self::Column { .. } => {
                "name the columns with \"time\" and \"column\"; fields of a CSV file are separated by commas"
            }
            Self::Order { .. } => "sort the rows by time, and remove duplicate times",
            Self::TooMany => "use a larger interval, or linear interpolation",
            Self::Fields { .. } => {
                "separate fields by commas, and write decimal points; or put quotation marks around a field with a \
                 comma"
            }
            Self::Number { .. } | Self::Empty { .. } => return None,
        })
    }
}

/// A time at which a signal is not smooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Break {
    /// The time (s).
    pub time: f64,
    /// Whether the value jumps. Otherwise a derivative does.
    pub jump: bool,
}

/// A signal over time.
#[derive(Debug, Clone)]
pub enum Source {
    #[doc(hidden)]
    Points(Points),
    #[doc(hidden)]
    Wave(Wave),
    #[doc(hidden)]
    Noise(Noise),
}

impl Source {
    /// Prepares a signal. Reads its file, if it has one.
    ///
    /// # Errors
    /// The file cannot be used.
    pub fn new(signal: &SignalOverTime) -> Result<Self, SourceError> {
        Ok(match signal {
            SignalOverTime::Step(it) => {
                // the value before the first point is that of the first point
                let times = vec![it.time.next_down(), it.time];
                Self::Points(Points::new(times, vec![it.before, it.after], Interpolation::Hold))
            }
            SignalOverTime::Ramp(it) => Self::Wave(Wave::Ramp(it.clone())),
            SignalOverTime::Pulse(it) => Self::Wave(Wave::Pulse(it.clone())),
            SignalOverTime::Sine(it) => Self::Wave(Wave::Sine(it.clone())),
            SignalOverTime::Chirp(it) => Self::Wave(Wave::Chirp(it.clone())),
            SignalOverTime::Table(it) => {
                Self::Points(Points::new(it.times.clone(), it.values.clone(), it.interpolation))
            }
            SignalOverTime::Csv(it) => Self::Points(read_csv::points(it)?),
            SignalOverTime::Parquet(it) => Self::Points(read_parquet::points(it)?),
            SignalOverTime::Noise(it) => Self::Noise(Noise::new(it.clone())),
        })
    }

    /// Value and first three derivatives at the time, just after a jump there.
    #[must_use]
    pub fn at(&self, time: f64) -> [f64; 4] {
        self.piece(self.index(time), time)
    }

    /// Value and first three derivatives at the beginning of a step, of the polynomial that represents the signal over
    /// the step. A break less than `slack` from an end of the step counts as one there.
    #[must_use]
    pub fn course(&self, time: f64, size: f64, slack: f64) -> [f64; 4] {
        let first = time + slack;
        let (begin, end) = (self.index(first), self.index((time + size - slack).max(first)));
        let p = self.piece(begin, time);
        if begin == end {
            return p;
        }
        let q = self.piece(end, time + size);
        let slope = (q[0] - p[0]) / size;
        match self.interpolation() {
            // a jump within a step takes effect at its end
            Interpolation::Hold => p,
            Interpolation::Linear => [p[0], slope, 0.0, 0.0],
            Interpolation::Cubic => [
                p[0],
                p[1],
                (6.0 * slope - 4.0 * p[1] - 2.0 * q[1]) / size,
                (6.0 * (p[1] + q[1]) - 12.0 * slope) / (size * size),
            ],
        }
    }

    /// The times from `start` to before `stop` (s) at which steps should end, increasing.
    ///
    /// # Errors
    /// There are more than [`MAX_BREAKS`].
    pub fn breaks(&self, start: f64, stop: f64) -> Result<Vec<Break>, SourceError> {
        match self {
            Self::Points(it) => it.breaks(start, stop),
            Self::Wave(it) => Ok(it.breaks(start, stop)),
            Self::Noise(it) => it.breaks(start, stop),
        }
    }

    /// A checksum of everything that determines the signal.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        match self {
            Self::Points(it) => it.checksum(),
            // the scenario describes these completely
            Self::Wave(_) | Self::Noise(_) => 0,
        }
    }

    fn interpolation(&self) -> Interpolation {
        match self {
            Self::Points(it) => it.interpolation,
            Self::Wave(_) => Interpolation::Linear,
            Self::Noise(it) => it.interpolation(),
        }
    }

    /// The piece that contains a time.
    fn index(&self, time: f64) -> i64 {
        match self {
            Self::Points(it) => it.index(time),
            Self::Wave(it) => it.index(time),
            Self::Noise(it) => it.index(time),
        }
    }

    /// Value and derivatives of a piece, also a little outside of it.
    fn piece(&self, index: i64, time: f64) -> [f64; 4] {
        match self {
            Self::Points(it) => it.piece(index, time),
            Self::Wave(it) => it.piece(index, time),
            Self::Noise(it) => it.piece(index, time),
        }
    }
}

#[cfg(test)]
mod tests;
