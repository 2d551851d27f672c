//! Points collected from the rows of a file.

use std::path::Path;

use scenario::FileSignal;

use crate::points::Points;
use crate::{Row, SourceError};

/// Most names of columns in a message.
const MOST: usize = 20;

/// Times and values so far.
pub(crate) struct Rows<'a> {
    signal: &'a FileSignal,
    times: Vec<f64>,
    values: Vec<f64>,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(signal: &'a FileSignal) -> Self {
        Self { signal, times: Vec::new(), values: Vec::new() }
    }

    /// Takes time and value of a row; the texts are for messages.
    pub(crate) fn take(
        &mut self,
        row: Row,
        [time, value]: [Option<f64>; 2],
        texts: impl Fn() -> [String; 2],
    ) -> Result<(), SourceError> {
        let signal = self.signal;
        let number = |field: Option<f64>, k: usize, column: &String| {
            let finite = field.filter(|it| it.is_finite());
            finite.ok_or_else(|| SourceError::Number {
                path: signal.file.clone(),
                row,
                column: column.clone(),
                text: std::mem::take(&mut texts()[k]),
            })
        };
        let time = number(time, 0, &signal.time)? + signal.delay;
        let value = signal.factor * number(value, 1, &signal.column)?;
        if let Some(&before) = self.times.last()
            && time <= before
        {
            return Err(SourceError::Order { path: signal.file.clone(), row, time, before });
        }
        self.times.push(time);
        self.values.push(value);
        Ok(())
    }

    /// The points of all rows.
    pub(crate) fn points(self) -> Result<Points, SourceError> {
        let Self { signal, times, values } = self;
        if times.is_empty() {
            let (path, column) = (signal.file.clone(), signal.column.clone());
            return Err(SourceError::Empty { path, column });
        }
        Ok(Points::new(times, values, signal.interpolation))
    }
}

/// Position of a column.
pub(crate) fn find<'a>(
    path: &Path,
    names: impl Iterator<Item = &'a str> + Clone,
    name: &str,
) -> Result<usize, SourceError> {
    names.clone().position(|it| it == name).ok_or_else(|| SourceError::Column {
        path: path.to_owned(),
        column: name.to_owned(),
        known: names.clone().take(MOST).map(str::to_owned).collect(),
        suggestion: patterns::suggest(name, names).map(str::to_owned),
    })
}
