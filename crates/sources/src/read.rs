//! Two columns of a CSV file.

use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};
use scenario::CsvSignal;

use crate::SourceError;

/// Most names of columns in a message.
const MOST: usize = 20;

/// Times (s) and values of a signal. Rows without a value are left out.
pub(crate) fn columns(signal: &CsvSignal) -> Result<(Vec<f64>, Vec<f64>), SourceError> {
    let path = &signal.file;
    let failed = |source| SourceError::File { path: path.clone(), source };
    let mut reader =
        ReaderBuilder::new().trim(Trim::All).flexible(true).from_path(path).map_err(failed)?;
    let header = reader.headers().map_err(failed)?.clone();
    let find = |name: &str| find(path, &header, name);
    let (time_column, value_column) = (find(&signal.time)?, find(&signal.column)?);
    let (mut times, mut values): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut record = StringRecord::new();
    while reader.read_record(&mut record).map_err(failed)? {
        let line = record.position().map_or(0, csv::Position::line);
        let text = |column: usize| record.get(column).unwrap_or("");
        if text(value_column).is_empty() {
            continue;
        }
        let number = |column: usize, name: &str| {
            let parsed = text(column).parse::<f64>().ok().filter(|it| it.is_finite());
            parsed.ok_or_else(|| SourceError::Number {
                path: path.clone(),
                line,
                column: name.to_owned(),
                text: text(column).to_owned(),
            })
        };
        let time = number(time_column, &signal.time)? + signal.delay;
        if let Some(&before) = times.last()
            && time <= before
        {
            return Err(SourceError::Order { path: path.clone(), line, time, before });
        }
        times.push(time);
        values.push(signal.factor * number(value_column, &signal.column)?);
    }
    if times.is_empty() {
        return Err(SourceError::Empty { path: path.clone(), column: signal.column.clone() });
    }
    Ok((times, values))
}

/// Position of a column.
fn find(path: &Path, header: &StringRecord, name: &str) -> Result<usize, SourceError> {
    let plain = |text: &str| text.strip_prefix('\u{feff}').unwrap_or(text).to_owned();
    let found = header.iter().position(|it| plain(it) == name);
    found.ok_or_else(|| SourceError::Column {
        path: path.to_owned(),
        column: name.to_owned(),
        known: header.iter().take(MOST).map(plain).collect(),
        suggestion: patterns::suggest(name, header.iter()).map(str::to_owned),
    })
}
