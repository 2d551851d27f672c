//! Writes results.csv.

use std::ffi::CStr;
use std::io;
use std::path::{Path, PathBuf};

use crate::TABLE;
use crate::growing::{Growing, Position};

/// A recorded signal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordedColumn {
    /// `instance.variable`
    pub name: String,
    /// Unit of measurement of its values.
    pub unit: Option<String>,
    /// Communication points per recorded value, counted from the start.
    pub stride: u64,
    /// Whether it is a String.
    pub is_text: bool,
}

/// Writes results.csv: a row at every communication point at which any signal is due, with empty fields for
/// the others. Numbers are the shortest decimals that read back to the same floats. Texts are quoted, with
/// spaces instead of line breaks.
pub struct TableWriter {
    file: Growing,
    number: ryu::Buffer,
    strides: Vec<u64>,
    /// per signal, whether it is a String
    texts: Vec<bool>,
    /// the strides without duplicates
    distinct: Vec<u64>,
}

impl TableWriter {
    /// Starts the table in the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(folder: &Path, columns: &[RecordedColumn]) -> io::Result<Self> {
        let names = columns.iter().map(|column| column.name.as_str());
        let header = crate::events::line(std::iter::once("time").chain(names))?;
        Ok(Self::new(Growing::create(Self::path(folder), &header)?, columns))
    }

    /// Continues a table from an earlier position and removes later rows.
    ///
    /// # Errors
    /// The file cannot be written, or does not belong to the position.
    pub fn resume(
        folder: &Path,
        columns: &[RecordedColumn],
        position: Position,
    ) -> io::Result<Self> {
        Ok(Self::new(Growing::resume(Self::path(folder), position)?, columns))
    }

    /// Path of the complete table in a folder.
    #[must_use]
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(TABLE)
    }

    fn new(file: Growing, columns: &[RecordedColumn]) -> Self {
        let strides: Vec<u64> = columns.iter().map(|column| column.stride).collect();
        let mut distinct = strides.clone();
        distinct.sort_unstable();
        distinct.dedup();
        if distinct.is_empty() {
            distinct.push(1);
        }
        let texts = columns.iter().map(|column| column.is_text).collect();
        Self { file, number: ryu::Buffer::new(), strides, texts, distinct }
    }

    /// Takes the values at communication point `n` and writes those that are due. `text` returns the value of
    /// a String signal by its index.
    ///
    /// # Errors
    /// The file cannot be written, for instance because the disk is full. It ends with a complete row.
    #[inline]
    pub fn take<'a>(
        &mut self,
        n: u64,
        time: f64,
        values: &[f64],
        text: impl Fn(usize) -> Option<&'a CStr>,
    ) -> io::Result<()> {
        if !self.distinct.iter().any(|&stride| n.is_multiple_of(stride)) {
            return Ok(());
        }
        let all = self.distinct.len() == 1;
        let Self { file, number, strides, texts, .. } = self;
        file.record(|row| {
            row.extend_from_slice(number.format(time).as_bytes());
            for (k, ((&value, &stride), &is_text)) in
                values.iter().zip(strides.iter()).zip(texts.iter()).enumerate()
            {
                row.push(b',');
                if !all && !n.is_multiple_of(stride) {
                    continue;
                }
                if is_text {
                    quote(text(k).unwrap_or_default(), row);
                } else {
                    row.extend_from_slice(number.format(value).as_bytes());
                }
            }
            row.push(b'\n');
        })
    }

    /// Number of complete rows.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.file.records()
    }

    /// Waits until all rows are on the disk, and returns the position.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn position(&mut self) -> io::Result<Position> {
        self.file.position()
    }

    /// Completes the table and gives the file its final name.
    ///
    /// # Errors
    /// The file cannot be written or renamed.
    pub fn finish(self) -> io::Result<PathBuf> {
        self.file.finish()
    }
}

/// Appends a text as a field. It is always quoted, to differ from a number and from an empty field.
fn quote(text: &CStr, row: &mut Vec<u8>) {
    row.push(b'"');
    for c in text.to_string_lossy().chars() {
        match c {
            '"' => row.extend_from_slice(b"\"\""),
            // a row is one line
            '\n' | '\r' => row.push(b' '),
            _ => row.extend_from_slice(c.encode_utf8(&mut [0; 4]).as_bytes()),
        }
    }
    row.push(b'"');
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn columns(list: &[(&str, u64)]) -> Vec<RecordedColumn> {
        let column = |&(name, stride): &(&str, u64)| RecordedColumn {
            name: name.into(),
            unit: None,
            stride,
            is_text: false,
        };
        list.iter().map(column).collect()
    }

    #[test]
    fn invariant_rows_read_back_to_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let mut table =
            TableWriter::create(folder.path(), &columns(&[("a.x", 1), ("b,y", 1)])).unwrap();
        let values = [0.1 + 0.2, 1e-300, -0.0, 8e-3, f64::MAX];
        for (n, x) in (0..).zip(values) {
            table.take(n, x, &[x, -x], |_| None).unwrap();
        }
        assert!(!folder.path().join("results.csv").exists());
        let path = table.finish().unwrap();
        let text = fs::read_to_string(path).unwrap();
        assert!(text.starts_with("time,a.x,\"b,y\"\n0.30000000000000004,"), "{text}");
        for (line, x) in text.lines().skip(1).zip(values) {
            let read: f64 = line.split(',').next().unwrap().parse().unwrap();
            assert_eq!(read.to_bits(), x.to_bits());
        }
        assert!(!folder.path().join("results.csv.partial").exists());
    }

    #[test]
    fn analytic_signals_are_written_where_they_are_due() {
        let folder = tempfile::tempdir().unwrap();
        let mut table =
            TableWriter::create(folder.path(), &columns(&[("a", 2), ("b", 3)])).unwrap();
        for n in 0..=6 {
            table.take(n, n as f64, &[1.0, 2.0], |_| None).unwrap();
        }
        assert_eq!(table.rows(), 5);
        let text = fs::read_to_string(table.finish().unwrap()).unwrap();
        assert_eq!(text, "time,a,b\n0.0,1.0,2.0\n2.0,1.0,\n3.0,,2.0\n4.0,1.0,\n6.0,1.0,2.0\n");
    }

    /// Units may return quotes, line breaks, commas, empty texts, and text that is not UTF-8.
    #[test]
    fn invariant_texts_are_one_field_of_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let columns = [
            RecordedColumn { name: "a.s".into(), unit: None, stride: 1, is_text: true },
            RecordedColumn { name: "a.x".into(), unit: None, stride: 1, is_text: false },
        ];
        let mut table = TableWriter::create(folder.path(), &columns).unwrap();
        let texts = [c"plain", c"", c"a \"b\", c", c"one\r\ntwo", c"gr\xc3\xb6\xc3\x9fe", c"\xff"];
        for (n, text) in (0..).zip(texts) {
            let text = |signal| (signal == 0).then_some(text);
            table.take(n, n as f64, &[f64::NAN, 1.5], text).unwrap();
        }
        let path = table.finish().unwrap();
        let lines = fs::read_to_string(&path).unwrap();
        assert_eq!(lines.lines().count(), 7);
        assert!(lines.starts_with("time,a.s,a.x\n0.0,\"plain\",1.5\n1.0,\"\",1.5\n"), "{lines}");
        let mut reader = csv::Reader::from_path(path).unwrap();
        let read: Vec<String> = reader.records().map(|row| row.unwrap()[1].to_owned()).collect();
        assert_eq!(read, ["plain", "", "a \"b\", c", "one  two", "größe", "\u{fffd}"]);
    }
}
