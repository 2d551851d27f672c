//! Two columns of a CSV file.

use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};
use scenario::FileSignal;

use crate::points::Points;
use crate::rows::{Rows, find};
use crate::{Row, SourceError};

/// Names of the columns.
pub(crate) fn names(path: &Path) -> Result<Vec<String>, SourceError> {
    let failed = |source| SourceError::Csv { path: path.to_owned(), source };
    let mut reader = ReaderBuilder::new().trim(Trim::All).from_path(path).map_err(failed)?;
    let header = reader.headers().map_err(failed)?;
    let names = header.iter().map(|text| text.strip_prefix('\u{feff}').unwrap_or(text));
    Ok(names.map(str::to_owned).collect())
}

/// The points of a signal. Rows without a value are left out.
pub(crate) fn points(signal: &FileSignal) -> Result<Points, SourceError> {
    let path = &signal.file;
    let failed = |source| SourceError::Csv { path: path.clone(), source };
    let mut reader =
        ReaderBuilder::new().trim(Trim::All).flexible(true).from_path(path).map_err(failed)?;
    let header = reader.headers().map_err(failed)?.clone();
    let names = header.iter().map(|text| text.strip_prefix('\u{feff}').unwrap_or(text));
    let columns = [find(path, names.clone(), &signal.time)?, find(path, names, &signal.column)?];
    let mut rows = Rows::new(signal);
    let mut record = StringRecord::new();
    while reader.read_record(&mut record).map_err(failed)? {
        let line = Row::Line(record.position().map_or(0, csv::Position::line));
        // a decimal comma makes two fields of a number
        if record.iter().skip(header.len()).any(|text| !text.is_empty()) {
            let (path, [fields, columns]) = (path.clone(), [record.len(), header.len()]);
            return Err(SourceError::Fields { path, row: line, fields, columns });
        }
        let texts = columns.map(|column| record.get(column).unwrap_or(""));
        if texts[1].is_empty() {
            continue;
        }
        rows.take(line, texts.map(|it| it.parse().ok()), || texts.map(str::to_owned))?;
    }
    rows.points()
}
