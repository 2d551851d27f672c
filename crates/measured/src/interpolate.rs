//! A signal of a run between its recorded values.

use scenario::{Interpolation, SignalOverTime, TableSignal};
use sources::{Source, SourceError};

/// Recorded values with a cubic Hermite polynomial between two of them.
#[derive(Debug, Clone)]
pub struct Interpolated {
    source: Source,
    /// First recorded time (s).
    pub start: f64,
    /// Last recorded time (s).
    pub stop: f64,
}

impl Interpolated {
    /// Values at increasing times.
    ///
    /// # Errors
    /// None for a table; the type is that of all sources.
    pub fn new(times: Vec<f64>, values: Vec<f64>) -> Result<Self, SourceError> {
        let ends = (times.first().copied(), times.last().copied());
        let (start, stop) = (ends.0.unwrap_or(f64::NAN), ends.1.unwrap_or(f64::NAN));
        let table = TableSignal { times, values, interpolation: Interpolation::Cubic };
        Ok(Self { source: Source::new(&SignalOverTime::Table(table))?, start, stop })
    }

    /// The value at a time (s); before and after the record that of its ends.
    #[must_use]
    pub fn at(&self, time: f64) -> f64 {
        self.source.at(time)[0]
    }

    /// Whether it is recorded at a time.
    #[must_use]
    pub fn covers(&self, time: f64) -> bool {
        // times of a record are rounded when they are printed
        let slack = 1e-9 * self.start.abs().max(self.stop.abs());
        (self.start - slack..=self.stop + slack).contains(&time)
    }
}
