//! Which columns of a file belong to which signals.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use indexmap::IndexMap;
use serde::Deserialize;

use crate::MeasuredError;

/// A file with measured time series, and what its columns are.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordSpec {
    /// Path of the CSV or Parquet file.
    pub file: PathBuf,
    /// Name of the column with the times; with its unit in brackets it need not be in seconds.
    pub time: String,
    /// What is added to the times of the file.
    pub offset: Offset,
    /// The columns. Empty: all whose names are those of recorded signals.
    pub columns: Vec<MappedColumn>,
}

/// What is added to the times of a record, to have the times of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Offset {
    /// So many seconds.
    Given(f64),
    /// Where the signals of record and run agree best.
    Find,
}

/// A column, and the signal that it is a measurement of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MappedColumn {
    /// Name of the column.
    pub column: String,
    /// `instance.variable`.
    pub signal: String,
    /// Its unit of measure. Default: that in brackets at the end of its name, otherwise that of the signal.
    pub unit: Option<String>,
}

/// A column as an option: `COLUMN=INSTANCE.VARIABLE` or `COLUMN=INSTANCE.VARIABLE:UNIT`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapEntry(pub MappedColumn);

impl FromStr for MapEntry {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" is not of the form COLUMN=INSTANCE.VARIABLE, or COLUMN=INSTANCE.VARIABLE:UNIT"
            )
        };
        // names of columns may have an equals sign, those of signals do not
        let (column, signal) = text.rsplit_once('=').ok_or_else(wrong)?;
        let (signal, unit) = match signal.split_once(':') {
            Some((signal, unit)) => (signal, Some(unit.trim().to_owned())),
            None => (signal, None),
        };
        let (column, signal) = (column.trim(), signal.trim());
        let complete = !column.is_empty() && signal.contains('.') && unit.as_deref() != Some("");
        if !complete {
            return Err(wrong());
        }
        Ok(Self(MappedColumn { column: column.to_owned(), signal: signal.to_owned(), unit }))
    }
}

impl FromStr for Offset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "find" => Ok(Self::Find),
            number => match number.parse::<f64>() {
                Ok(seconds) if seconds.is_finite() => Ok(Self::Given(seconds)),
                _ => Err(format!("\"{text}\" is neither a number of seconds nor \"find\"")),
            },
        }
    }
}

/// The file that names columns and signals.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SpecFile {
    file: PathBuf,
    #[serde(default = "time_column")]
    time: String,
    #[serde(default)]
    offset: Option<OffsetText>,
    #[serde(default)]
    signals: IndexMap<String, ColumnText>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected a number of seconds, or \"find\"")]
enum OffsetText {
    Seconds(f64),
    Word(String),
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected the name of a column, or {\"column\", \"unit\"}")]
enum ColumnText {
    Name(String),
    Full(FullColumn),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FullColumn {
    column: String,
    #[serde(default)]
    unit: Option<String>,
}

fn time_column() -> String {
    "time".to_owned()
}

impl RecordSpec {
    /// All columns of a file that have names of signals, at their own times.
    #[must_use]
    pub fn of_file(file: &Path) -> Self {
        Self {
            file: file.to_owned(),
            time: time_column(),
            offset: Offset::Given(0.0),
            columns: Vec::new(),
        }
    }

    /// Reads a JSON file that names file, columns, units and alignment; or takes any other file as the record itself.
    ///
    /// # Errors
    /// The JSON file cannot be read, or is invalid.
    pub fn read(path: &Path) -> Result<Self, MeasuredError> {
        if path.extension().is_none_or(|it| !it.eq_ignore_ascii_case("json")) {
            return Ok(Self::of_file(path));
        }
        let text = std::fs::read_to_string(path)
            .map_err(|source| MeasuredError::Read { path: path.to_owned(), source })?;
        let wrong = |problem: String| MeasuredError::Spec { path: path.to_owned(), problem };
        let file: SpecFile =
            strict_json::read_commented(&text).map_err(|error| wrong(error.to_string()))?;
        let offset = match file.offset {
            None => Offset::Given(0.0),
            Some(OffsetText::Seconds(seconds)) => Offset::Given(seconds),
            Some(OffsetText::Word(word)) => {
                word.parse().map_err(|problem| wrong(format!("at offset: {problem}")))?
            }
        };
        let columns = file.signals.into_iter().map(|(signal, column)| {
            let (column, unit) = match column {
                ColumnText::Name(column) => (column, None),
                ColumnText::Full(it) => (it.column, it.unit),
            };
            MappedColumn { column, signal, unit }
        });
        Ok(Self {
            // relative to the file that names it
            file: path.parent().unwrap_or(Path::new("")).join(file.file),
            time: file.time,
            offset,
            columns: columns.collect(),
        })
    }
}

/// The name and the unit in brackets at its end: `gap (mm)`, `gap [mm]`.
pub(crate) fn name_and_unit(column: &str) -> (&str, Option<&str>) {
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some(head) = column.trim_end().strip_suffix(close)
            && let Some((name, unit)) = head.rsplit_once(open)
        {
            return (name.trim(), Some(unit.trim()));
        }
    }
    (column.trim(), None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_options_and_names() {
        let it: MapEntry = "a=b (mm)=vehicle.gap_01:mm/s".parse().unwrap();
        let (column, signal, unit) = (it.0.column, it.0.signal, it.0.unit);
        assert_eq!((column.as_str(), signal.as_str()), ("a=b (mm)", "vehicle.gap_01"));
        assert_eq!(unit.as_deref(), Some("mm/s"));
        assert_eq!("find".parse(), Ok(Offset::Find));
        assert_eq!("-0.25".parse(), Ok(Offset::Given(-0.25)));
        assert_eq!(name_and_unit("gap at 1 [mm]"), ("gap at 1", Some("mm")));
        assert_eq!(name_and_unit("gap (front) (mm)"), ("gap (front)", Some("mm")));
        assert_eq!(name_and_unit("gap"), ("gap", None));
    }

    #[test]
    fn refusal_incomplete_options() {
        for text in ["gap", "=vehicle.gap", "gap=", "gap=vehicle", "gap=vehicle.gap:"] {
            assert!(
                text.parse::<MapEntry>().unwrap_err().contains("COLUMN=INSTANCE.VARIABLE"),
                "{text}"
            );
        }
        for text in ["", "soon", "NaN", "inf"] {
            assert!(text.parse::<Offset>().unwrap_err().contains("nor \"find\""), "{text}");
        }
    }

    #[test]
    fn refusal_files_that_name_columns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.json");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            RecordSpec::read(&path)
        };
        let spec = read(
            r#"{"file": "a.csv", "offset": "find", "signals": {"v.x": "x", "v.y": {"column": "y", "unit": "mm"}}}"#,
        );
        let spec = spec.unwrap();
        assert_eq!((spec.file, spec.offset), (folder.path().join("a.csv"), Offset::Find));
        assert_eq!(spec.columns[1].unit.as_deref(), Some("mm"));
        for (text, part) in [
            ("{", "EOF"),
            (r#"{"signals": {}}"#, "file"),
            (r#"{"file": "a.csv", "shift": 1}"#, "shift"),
            (r#"{"file": "a.csv", "offset": "soon"}"#, "nor \"find\""),
            (r#"{"file": "a.csv", "signals": {"v.x": 1}}"#, "name of a column"),
            (r#"{"file": "a.csv", "signals": {"v.x": "a", "v.x": "b"}}"#, "v.x"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
