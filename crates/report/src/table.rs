//! The table of recorded signals: results.csv, what there is of it, or results.parquet.

use std::path::Path;

use rayon::prelude::*;

use crate::error::ReportError;

/// Text that one thread reads at a time (bytes).
const PART: usize = 1 << 20;

/// Recorded signals over time, without those that are texts; NaN where a signal was not due, or is NaN.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Names of the signals, `instance.variable`.
    pub names: Vec<String>,
    /// Times of the rows (s).
    pub time: Vec<f64>,
    /// Values of each signal, as many as rows.
    pub columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads results.csv of a folder; without it results.parquet; without that, what a running or
    /// killed run has written so far. `None` if there is nothing.
    ///
    /// # Errors
    /// The file cannot be read or is not as a run writes it.
    pub fn read(folder: &Path) -> Result<Option<Self>, ReportError> {
        let csv = folder.join("results.csv");
        let parquet = folder.join("results.parquet");
        let partial = folder.join("results.csv.partial");
        if csv.exists() {
            read_csv(&csv, false).map(Some)
        } else if parquet.exists() {
            crate::columns::read_parquet(&parquet).map(Some)
        } else if partial.exists() {
            read_csv(&partial, true).map(Some)
        } else {
            Ok(None)
        }
    }

    /// The values of a signal.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let index = self.names.iter().position(|it| it == name)?;
        Some(&self.columns[index])
    }

    /// Times and values of a signal where it was due and has a finite value.
    #[must_use]
    pub fn points(&self, index: usize) -> (Vec<f64>, Vec<f64>) {
        let due = self.time.iter().zip(&self.columns[index]).filter(|(_, value)| value.is_finite());
        due.map(|(time, value)| (*time, *value)).unzip()
    }
}

/// Reads a table as text. The last line of one that is being written may lack its end, and is left
/// out.
fn read_csv(path: &Path, growing: bool) -> Result<Table, ReportError> {
    let read = |source| ReportError::Read { path: path.to_owned(), source };
    let mut text = std::fs::read(path).map_err(read)?;
    if growing {
        let whole = text.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        text.truncate(whole);
    }
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_slice());
    let mut header = csv::StringRecord::new();
    let bad = |row, column: &str, message: String| ReportError::Table {
        path: path.to_owned(),
        row,
        column: column.to_owned(),
        message,
    };
    reader.read_record(&mut header).map_err(|e| bad(1, "", e.to_string()))?;
    if header.get(0) != Some("time") {
        return Err(bad(1, "1", "the first column is not \"time\"".to_owned()));
    }
    let begin = usize::try_from(reader.position().byte()).unwrap_or(usize::MAX);
    let body = text.get(begin..).unwrap_or_default();
    let texts = quoted(body, header.len());
    let parts: Vec<Result<Vec<f64>, Misfit>> =
        split(body).par_iter().map(|part| numbers(part, &header, &texts)).collect();
    let mut columns = vec![Vec::new(); header.len()];
    for part in parts {
        let row = 2 + columns[0].len();
        let values = part.map_err(|it| bad(row + it.row, &it.column, it.message))?;
        for (k, column) in columns.iter_mut().enumerate() {
            column.extend(values.iter().skip(k).step_by(header.len()));
        }
    }
    let mut columns = columns.into_iter();
    let time = columns.next().unwrap_or_default();
    let names = header.iter().skip(1).map(str::to_owned);
    let numeric = names.zip(columns).zip(texts.iter().skip(1)).filter(|(_, is_text)| !**is_text);
    let (names, columns) = numeric.map(|(column, _)| column).unzip();
    Ok(Table { names, time, columns })
}

/// Which fields of a table's first row are quoted. Those are texts: a run quotes all of them, and no
/// number; and in the first row every signal is due.
fn quoted(body: &[u8], fields: usize) -> Vec<bool> {
    let mut quoted = vec![false; fields];
    let (mut field, mut begins, mut inside) = (0, true, false);
    for &byte in body {
        match byte {
            b'\n' if !inside => break,
            b',' if !inside => {
                field += 1;
                begins = true;
                continue;
            }
            b'"' => {
                if let Some(it) = quoted.get_mut(field).filter(|_| begins) {
                    *it = true;
                }
                inside = !inside;
            }
            _ => {}
        }
        begins = false;
    }
    quoted
}

/// What is wrong in a part of a table.
struct Misfit {
    /// from 0, counted from the part's first
    row: usize,
    column: String,
    message: String,
}

/// Cuts a table of numbers at line ends into parts that threads can read at once.
fn split(mut body: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::new();
    while body.len() > PART {
        let end = body[PART..].iter().position(|&byte| byte == b'\n');
        let (part, rest) = body.split_at(end.map_or(body.len(), |at| PART + at + 1));
        parts.push(part);
        body = rest;
    }
    parts.push(body);
    parts
}

/// All numbers of a part, row after row; NaN for an empty field and for a text.
fn numbers(part: &[u8], header: &csv::StringRecord, texts: &[bool]) -> Result<Vec<f64>, Misfit> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(part);
    let mut record = csv::ByteRecord::new();
    let mut values = Vec::with_capacity(part.len() / 12);
    let mut row = 0;
    let name = |k: usize| header.get(k).unwrap_or_default().to_owned();
    loop {
        let more = reader.read_byte_record(&mut record);
        match more {
            Ok(true) => {}
            Ok(false) => return Ok(values),
            Err(error) => {
                return Err(Misfit { row, column: String::new(), message: error.to_string() });
            }
        }
        if record.len() != header.len() {
            let message = format!("{} fields where the header has {}", record.len(), header.len());
            return Err(Misfit { row, column: name(record.len()), message });
        }
        for (k, field) in record.iter().enumerate() {
            if texts[k] {
                values.push(f64::NAN);
                continue;
            }
            let number = std::str::from_utf8(field).ok().and_then(|text| text.parse().ok());
            match number {
                Some(number) => values.push(number),
                None if field.is_empty() && k > 0 => values.push(f64::NAN),
                None => {
                    let text = String::from_utf8_lossy(field);
                    let message = format!("\"{text}\" is no number");
                    return Err(Misfit { row, column: name(k), message });
                }
            }
        }
        row += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, name: &str) -> Result<Table, ReportError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(name), text).unwrap();
        Table::read(folder.path()).map(Option::unwrap)
    }

    #[test]
    fn invariant_numbers_names_and_gaps_are_read() {
        let table = read("time,a.x,\"b,y\"\n0,1e-3,2\n0.5,3,\n", "results.csv").unwrap();
        assert_eq!(table.names, ["a.x", "b,y"]);
        assert_eq!(table.time, [0.0, 0.5]);
        assert_eq!(table.column("a.x").unwrap(), [1e-3, 3.0]);
        assert_eq!(table.points(1), (vec![0.0], vec![2.0]));
        let table = read("time,a.x\n0,NaN\n1,2.0\n2,-inf\n3,inf\n", "results.csv").unwrap();
        assert_eq!(table.points(0), (vec![1.0], vec![2.0]));
    }

    /// Many parts: every row is there once and in order, whatever the borders.
    #[test]
    fn invariant_parts_join_without_loss() {
        use std::fmt::Write as _;
        let rows: u32 = 200_000;
        let mut text = "time,a.x\n".to_owned();
        for n in 0..rows {
            writeln!(text, "{n},{}.25", 3 * n).unwrap();
        }
        assert!(text.len() > 3 * PART);
        let table = read(&text, "results.csv").unwrap();
        assert_eq!(table.time, (0..rows).map(f64::from).collect::<Vec<_>>());
        let expected: Vec<f64> = (0..rows).map(|n| f64::from(3 * n) + 0.25).collect();
        assert_eq!(table.columns, [expected]);
        text.push_str("7,x\n");
        let error = read(&text, "results.csv").unwrap_err().to_string();
        assert!(error.contains("row 200002, column a.x: \"x\" is no number"), "{error}");
    }

    #[test]
    fn issue_a_table_that_is_being_written_ends_with_its_last_whole_line() {
        let table = read("time,a.x\n0,1\n1,2\n2,3.7", "results.csv.partial").unwrap();
        assert_eq!(table.time, [0.0, 1.0]);
        let empty = read("time,a.x\n", "results.csv.partial").unwrap();
        assert!(empty.time.is_empty() && empty.columns == [[0.0; 0]]);
    }

    #[test]
    fn issue_texts_are_passed_over() {
        let text = "time,a.s,a.x,\"a,t\"\n0,\"x, \"\"1\"\"\",1,\"\"\n1,,2,\"7\"\n";
        let table = read(text, "results.csv").unwrap();
        assert_eq!((table.names, table.columns), (vec!["a.x".to_owned()], vec![vec![1.0, 2.0]]));
        // a number that is not one is an error all the same
        let error = read("time,a.s,a.x\n0,\"x\",y\n", "results.csv").unwrap_err().to_string();
        assert!(error.contains("row 2, column a.x: \"y\" is no number"), "{error}");
    }

    #[test]
    fn issue_what_is_no_table_is_named() {
        for (text, expected) in [
            ("t,a.x\n0,1\n", "not \"time\""),
            ("", "not \"time\""),
            ("time,a.x\n0,1\n0.1\n", "row 3, column a.x: 1 fields"),
            ("time,a.x\n,1\n", "row 2, column time: \"\" is no number"),
        ] {
            let error = read(text, "results.csv").unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
