//! A folder with the results of one run, read.

use std::io;
use std::path::{Path, PathBuf};

use indexmap::IndexMap;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use crate::error::ReportError;
use crate::modes::{self, Modes};
use crate::scenario::Scenario;
use crate::table::Table;

/// A folder with the results of one run.
#[derive(Debug, Clone)]
pub struct Run {
    /// Results folder that the run was read from.
    pub folder: PathBuf,
    /// What summary.json says, as far as the report computes with it.
    pub summary: Summary,
    /// summary.json as it is.
    pub raw_summary: Value,
    /// scenario-as-run.json: what ran, with the changes of the command line in it.
    pub scenario: Option<Scenario>,
    /// modes.json, if `maglev modes` has been asked for it.
    pub modes: Option<Modes>,
    /// The recorded signals.
    pub table: Table,
}

/// What a report needs of summary.json.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Summary {
    /// The scenario's file name without ending.
    pub scenario: String,
    /// `title` of the scenario, empty if it has none.
    pub title: String,
    /// How the run ended; empty for a run without an end.
    pub status: String,
    /// Recorded signals with their statistics.
    pub signals: IndexMap<String, Signal>,
    /// Units by their name in the scenario.
    pub units: IndexMap<String, UnitSummary>,
}

/// What a report needs of a signal's entry.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Signal {
    /// Its unit of measurement.
    pub unit: Option<String>,
    /// Number of communication points; 0 of a run that did not start.
    pub points: u64,
    /// Smallest value.
    #[serde(deserialize_with = "number")]
    pub min: f64,
    /// Time of the smallest value (s).
    #[serde(deserialize_with = "number")]
    pub time_of_min: f64,
    /// Largest value.
    #[serde(deserialize_with = "number")]
    pub max: f64,
    /// Time of the largest value (s).
    #[serde(deserialize_with = "number")]
    pub time_of_max: f64,
    /// Root of the mean square.
    #[serde(deserialize_with = "number")]
    pub rms: f64,
}

/// A number; JSON has none for those that are not finite, and null stands for them.
fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// What a report needs of a unit's entry.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct UnitSummary {
    /// GUID of the description, to recognise another build.
    pub guid: String,
}

impl Run {
    /// Reads a folder. Everything but a table or a summary may be missing, and a run that failed,
    /// was killed or is still going on is read as far as it has got.
    ///
    /// # Errors
    /// There is nothing of a run in the folder, files are of several runs, or one is not as a run
    /// writes it.
    pub fn read(folder: &Path) -> Result<Self, ReportError> {
        crate::files::check(folder)?;
        let raw_summary: Option<Value> = json(&folder.join("summary.json"))?;
        let table = Table::read(folder)?;
        if raw_summary.is_none() && table.is_none() {
            return Err(ReportError::NoResults { folder: folder.to_owned() });
        }
        let raw_summary = raw_summary.unwrap_or(Value::Null);
        let summary = match &raw_summary {
            Value::Null => Summary::default(),
            value => Summary::deserialize(value)
                .map_err(|error| bad(&folder.join("summary.json"), &error))?,
        };
        Ok(Self {
            folder: folder.to_owned(),
            summary,
            raw_summary,
            scenario: scenario(&folder.join("scenario-as-run.json"))?,
            modes: json(&folder.join("modes.json"))?.map(|it: modes::File| it.modes),
            table: table.unwrap_or_default(),
        })
    }

    /// What to call the run: its folder's name.
    #[must_use]
    pub fn name(&self) -> String {
        let absolute = std::path::absolute(&self.folder);
        let folder = absolute.as_deref().unwrap_or(&self.folder);
        folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy().into_owned()
    }

    /// What ran: the scenario's title, or its name.
    #[must_use]
    pub fn title(&self) -> String {
        let Summary { title, scenario, .. } = &self.summary;
        let texts = [title, scenario].into_iter().find(|text| !text.is_empty());
        texts.cloned().unwrap_or_else(|| self.name())
    }

    /// The unit of measurement of a signal.
    #[must_use]
    pub fn unit_of(&self, signal: &str) -> Option<&str> {
        self.summary.signals.get(signal)?.unit.as_deref()
    }
}

/// Reads a text; `None` if it is not there. A byte order mark that an editor has put in is left out.
fn text(path: &Path) -> Result<Option<String>, ReportError> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(Some(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(ReportError::Read { path: path.to_owned(), source }),
    }
}

pub(crate) fn json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, ReportError> {
    let parsed = text(path)?.map(|text| serde_json::from_str(&text)).transpose();
    parsed.map_err(|error| bad(path, &error))
}

fn scenario(path: &Path) -> Result<Option<Scenario>, ReportError> {
    text(path)?.map(Scenario::parse).transpose().map_err(|error| bad(path, &error))
}

fn bad(path: &Path, error: &serde_json::Error) -> ReportError {
    ReportError::Json { path: path.to_owned(), message: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    #[test]
    fn issue_a_folder_without_results_is_named_with_help() {
        let empty = folder(&[("notes.txt", "x")]);
        let error = Run::read(empty.path()).unwrap_err();
        assert!(error.to_string().contains("no folder with results"), "{error}");
        assert!(error.is_bad_input() && error.help().unwrap().contains("maglev run"));
        assert!(Run::read(Path::new("/nonexistent")).is_err());
    }

    #[test]
    fn issue_a_broken_file_is_named() {
        let broken = folder(&[("summary.json", "{"), ("results.csv", "time\n")]);
        let error = Run::read(broken.path()).unwrap_err().to_string();
        assert!(error.contains("summary.json") && error.contains("line 1"), "{error}");
        let odd = folder(&[("summary.json", "{\"signals\": 3}"), ("results.csv", "time\n")]);
        let error = Run::read(odd.path()).unwrap_err().to_string();
        assert!(error.contains("summary.json") && error.contains("invalid type"), "{error}");
    }

    /// The mean square of a value beyond 1e154 is beyond all numbers.
    #[test]
    fn issue_a_statistic_that_is_no_number_is_read() {
        let text = r#"{"signals": {"a.x": {"points": 2, "min": 1e300, "rms": null}}}"#;
        let folder = folder(&[("summary.json", text), ("results.csv", "time,a.x\n0,1e300\n")]);
        let signals = Run::read(folder.path()).unwrap().summary.signals;
        assert!(signals["a.x"].min == 1e300 && signals["a.x"].rms.is_nan());
    }

    #[test]
    fn issue_runs_without_an_end_and_without_a_table_are_read() {
        let killed = folder(&[("results.csv.partial", "time,a.x\n0,1\n1,")]);
        let run = Run::read(killed.path()).unwrap();
        assert_eq!((run.summary.status.as_str(), run.table.time.len()), ("", 1));
        assert_eq!(run.title(), run.name());
        let bare = folder(&[("summary.json", "{\"title\": \"t\", \"status\": \"failed\"}")]);
        let run = Run::read(bare.path()).unwrap();
        assert_eq!((run.title().as_str(), run.table.names.len()), ("t", 0));
    }
}
