//! Reads the recorded signals: results.csv, as much as there is of it, or results.parquet.

use std::fs::File;
use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use rayon::prelude::*;

use crate::file::partial;
use crate::{PARQUET, ReadError, TABLE};

/// Text in memory at a time (bytes).
const BLOCK: usize = 16 << 20;
/// Text that one thread reads at a time (bytes).
const PART: usize = 1 << 20;
/// The value of a signal in a row at which it was not due: a NaN that reading a number never gives.
pub const NOT_DUE: f64 = f64::from_bits(0x7ff8_0000_0000_0dee);

/// Recorded signals over time, without String signals.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Names of the signals, `instance.variable`.
    pub names: Vec<String>,
    /// Times of the rows (s).
    pub time: Vec<f64>,
    /// Values of each signal, one per row; NaN in rows at which it was not due.
    pub columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads results.csv of a folder. If there is none, reads results.parquet, and otherwise what a
    /// running or killed run has written so far. `None` if there is nothing.
    ///
    /// # Errors
    /// The file cannot be read, or a run did not write it.
    pub fn read(folder: &Path) -> Result<Option<Self>, ReadError> {
        Self::read_signals(folder, |_| true)
    }

    /// Reads only the signals whose names `wanted` accepts.
    ///
    /// # Errors
    /// As [`Table::read`]. Other columns are not checked.
    pub fn read_signals(
        folder: &Path,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Option<Self>, ReadError> {
        let (csv, parquet) = (folder.join(TABLE), folder.join(PARQUET));
        let unfinished = partial(&csv);
        if csv.exists() {
            read_csv(&csv, false, wanted).map(Some)
        } else if parquet.exists() {
            crate::columns::read_parquet(&parquet, wanted).map(Some)
        } else if has_header(&unfinished)? {
            read_csv(&unfinished, true, wanted).map(Some)
        } else {
            Ok(None)
        }
    }

    /// Reads a Parquet file of signals over time, such as those that a study keeps.
    ///
    /// # Errors
    /// The file cannot be read, or is not such a table.
    pub fn read_parquet(path: &Path) -> Result<Self, ReadError> {
        crate::columns::read_parquet(path, |_| true)
    }

    /// The values of a signal.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let index = self.names.iter().position(|it| it == name)?;
        Some(&self.columns[index])
    }

    /// Times and values of a signal in the rows at which it was due, NaN and infinite ones included.
    #[must_use]
    pub fn samples(&self, index: usize) -> (Vec<f64>, Vec<f64>) {
        self.rows(index, |value| value.to_bits() != NOT_DUE.to_bits())
    }

    /// Times and values of a signal in the rows at which it has a finite value.
    #[must_use]
    pub fn points(&self, index: usize) -> (Vec<f64>, Vec<f64>) {
        self.rows(index, f64::is_finite)
    }

    fn rows(&self, index: usize, keep: impl Fn(f64) -> bool) -> (Vec<f64>, Vec<f64>) {
        let rows = self.time.iter().zip(&self.columns[index]);
        rows.filter(|(_, value)| keep(**value)).map(|(time, value)| (*time, *value)).unzip()
    }
}

/// The columns of a table as text.
struct TextColumns {
    header: csv::StringRecord,
    /// per column, whether it is read: the time and the wanted signals that are numbers
    read: Vec<bool>,
}

impl TextColumns {
    fn leave_out_texts(&mut self, body: &[u8]) {
        let texts = quoted(body, self.read.len());
        for (read, is_text) in self.read.iter_mut().zip(texts).skip(1) {
            *read &= !is_text;
        }
    }
}

/// What is wrong in a part of a table.
struct BadField {
    /// counted from the first row of the part, from 0
    row: usize,
    column: usize,
    message: String,
}

/// Whether a table that is still being written exists and has its whole first line. A run that was
/// killed early leaves it empty.
fn has_header(path: &Path) -> Result<bool, ReadError> {
    let mut line = Vec::new();
    let read = File::open(path).and_then(|file| BufReader::new(file).read_until(b'\n', &mut line));
    match read {
        Ok(_) => Ok(line.ends_with(b"\n")),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(source) => Err(ReadError::File { path: path.to_owned(), source }),
    }
}

/// Reads a table as text. The last line of a table that is still being written may be incomplete; it
/// is left out.
fn read_csv(path: &Path, growing: bool, wanted: impl Fn(&str) -> bool) -> Result<Table, ReadError> {
    let failed = |source| ReadError::File { path: path.to_owned(), source };
    let bad = |row, column: &str, message: String| ReadError::Table {
        path: path.to_owned(),
        row,
        column: column.to_owned(),
        message,
    };
    let mut file = File::open(path).map_err(failed)?;
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(&file);
    let mut header = csv::StringRecord::new();
    reader.read_record(&mut header).map_err(|e| bad(1, "", e.to_string()))?;
    if header.get(0) != Some("time") {
        return Err(bad(1, "1", "the first column is not \"time\"".to_owned()));
    }
    let begin = reader.position().byte();
    file.seek(SeekFrom::Start(begin)).map_err(failed)?;
    let read = (0..).zip(&header).map(|(k, name)| k == 0 || wanted(name)).collect();
    let mut columns = TextColumns { header, read };
    let mut values: Vec<Vec<f64>> = Vec::new();
    let mut text = Vec::new();
    loop {
        let limit = BLOCK as u64;
        let more = file.by_ref().take(limit).read_to_end(&mut text).map_err(failed)?;
        let lines = match text.iter().rposition(|&byte| byte == b'\n') {
            _ if more == 0 && !growing => text.len(),
            Some(last) => last + 1,
            None => 0,
        };
        if lines == 0 && more > 0 {
            continue;
        }
        if values.is_empty() {
            columns.leave_out_texts(&text);
            values.resize(columns.read.iter().filter(|read| **read).count(), Vec::new());
        }
        let parts: Vec<Result<Vec<f64>, BadField>> =
            split(&text[..lines]).par_iter().map(|part| numbers(part, &columns)).collect();
        for part in parts {
            let row = 2 + values[0].len();
            let name = |k| columns.header.get(k).unwrap_or_default();
            let part = part.map_err(|it| bad(row + it.row, name(it.column), it.message))?;
            let count = values.len();
            for (k, column) in values.iter_mut().enumerate() {
                column.extend(part.iter().skip(k).step_by(count));
            }
        }
        text.drain(..lines);
        if more == 0 {
            break;
        }
    }
    let mut values = values.into_iter();
    let time = values.next().unwrap_or_default();
    let names = columns.header.iter().zip(&columns.read).skip(1).filter(|(_, read)| **read);
    let names = names.map(|(name, _)| name.to_owned()).collect();
    Ok(Table { names, time, columns: values.collect() })
}

/// Which fields of the first row are quoted. These columns are texts: a run quotes every text and no
/// number, and every signal is due in the first row.
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

/// Cuts lines into parts that threads can read at the same time.
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

/// The numbers of the columns that are read, row after row.
fn numbers(part: &[u8], columns: &TextColumns) -> Result<Vec<f64>, BadField> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(part);
    let mut record = csv::ByteRecord::new();
    let mut values = Vec::with_capacity(part.len() / 12);
    let fields = columns.header.len();
    for row in 0.. {
        let bad = |column, message: String| Err(BadField { row, column, message });
        match reader.read_byte_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => return bad(fields, error.to_string()),
        }
        if record.len() != fields {
            let message = format!("{} fields instead of {fields}, as the header has", record.len());
            return bad(record.len(), message);
        }
        for (k, field) in record.iter().enumerate().filter(|(k, _)| columns.read[*k]) {
            match std::str::from_utf8(field).ok().and_then(|text| text.parse().ok()) {
                Some(number) => values.push(number),
                None if field.is_empty() && k > 0 => values.push(NOT_DUE),
                None => {
                    let text = String::from_utf8_lossy(field);
                    return bad(k, format!("\"{text}\" is not a number"));
                }
            }
        }
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, name: &str) -> Result<Table, ReadError> {
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
        assert_eq!(table.samples(0).0, [0.0, 1.0, 2.0, 3.0]);
    }

    /// A run that was killed before its first flush leaves nothing, or a part of the first line.
    #[test]
    fn issue_a_table_without_its_whole_first_line_is_nothing() {
        let folder = tempfile::tempdir().unwrap();
        for text in ["", "ti", "time,a.x,b"] {
            std::fs::write(folder.path().join("results.csv.partial"), text).unwrap();
            assert_eq!(Table::read(folder.path()).unwrap(), None, "{text:?}");
        }
        let table = read("time,a.x\n0,1", "results.csv.partial").unwrap();
        assert_eq!((table.names, table.time), (vec!["a.x".to_owned()], vec![]));
    }

    #[test]
    fn invariant_wanted_signals_are_those_of_the_whole_table() {
        let text = "time,a.x,b.y,c.z\n0,1,x,\n1,2,,NaN\n2,3,,4\n";
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("results.csv"), text).unwrap();
        let table = Table::read_signals(folder.path(), |name| name != "b.y").unwrap().unwrap();
        assert_eq!(table.names, ["a.x", "c.z"]);
        assert_eq!((table.time.len(), table.columns[0].as_slice()), (3, &[1.0, 2.0, 3.0][..]));
        assert_eq!(table.samples(1).0, [1.0, 2.0]);
        assert_eq!(table.points(1), (vec![2.0], vec![4.0]));
    }

    /// Several parts: every row is there once and in order.
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
        assert!(error.contains("row 200002, column a.x: \"x\" is not a number"), "{error}");
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
        assert!(error.contains("row 2, column a.x: \"y\" is not a number"), "{error}");
    }

    #[test]
    fn issue_what_is_no_table_is_named() {
        for (text, expected) in [
            ("t,a.x\n0,1\n", "not \"time\""),
            ("", "not \"time\""),
            ("time,a.x\n0,1\n0.1\n", "row 3, column a.x: 1 fields"),
            ("time,a.x\n,1\n", "row 2, column time: \"\" is not a number"),
        ] {
            let error = read(text, "results.csv").unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
