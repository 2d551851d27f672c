//! The content of a results folder.

use std::path::{Path, PathBuf};

use criteria::Verdict;
use indexmap::IndexMap;
use serde::Deserialize as _;
use serde_json::Value;

use crate::modes::{CoupledModes, ModesFile};
use crate::read::{damaged, json, text};
use crate::response::ResponseFile;
use crate::scenario_as_run::ScenarioAsRun;
use crate::summary::SignalSummary;
use crate::{AS_RUN, MODES, PARQUET, RESPONSE, ReadError, SUMMARY, TABLE, Table, file, verify};

/// The results of one run, as far as it got.
///
/// Reading accepts files of other versions and those of runs that failed, were killed or have not
/// ended yet.
#[derive(Debug, Clone)]
pub struct RunResults {
    /// Folder that the results were read from.
    pub folder: PathBuf,
    /// Content of summary.json, null for a run that has not ended.
    pub summary: Value,
    /// Recorded signals with their statistics, from summary.json.
    pub signals: IndexMap<String, SignalSummary>,
    /// The scenario with the changes of the command line, from scenario-as-run.json.
    pub scenario: Option<ScenarioAsRun>,
    /// Modes of the coupled system, if `maglev modes` was run for the folder.
    pub modes: Option<CoupledModes>,
    /// Frequency responses and margins, if `maglev response` was run for the folder.
    pub response: Option<ResponseFile>,
    /// Verdicts by the limits of the scenario, from summary.json.
    pub verdicts: Vec<Verdict>,
    /// Recorded signals over time.
    pub table: Table,
}

impl RunResults {
    /// Whether a folder contains results. They may be damaged.
    #[must_use]
    pub fn exist_in(folder: &Path) -> bool {
        let files = [SUMMARY, TABLE, PARQUET].map(|name| folder.join(name));
        files.iter().any(|path| path.exists()) || file::partial(&folder.join(TABLE)).exists()
    }

    /// Reads a folder, which must contain a table or a summary.
    ///
    /// # Errors
    /// The folder contains no results, files of several runs, or a damaged file.
    pub fn read(folder: &Path) -> Result<Self, ReadError> {
        verify::verify(folder)?;
        let path = folder.join(SUMMARY);
        let summary: Option<Value> = json(&path)?;
        let table = Table::read(folder)?;
        if summary.is_none() && table.is_none() {
            return Err(ReadError::NoResults { folder: folder.to_owned() });
        }
        let summary = summary.unwrap_or_default();
        let signals = match summary.get("signals") {
            Some(signals) => IndexMap::deserialize(signals).map_err(|e| damaged(&path, &e))?,
            None => IndexMap::new(),
        };
        let verdicts = match summary.get("metrics") {
            Some(verdicts) => Vec::deserialize(verdicts).map_err(|e| damaged(&path, &e))?,
            None => Vec::new(),
        };
        let path = folder.join(AS_RUN);
        let scenario = text(&path)?.map(ScenarioAsRun::parse).transpose();
        Ok(Self {
            folder: folder.to_owned(),
            summary,
            signals,
            scenario: scenario.map_err(|error| damaged(&path, &error))?,
            verdicts,
            modes: json(&folder.join(MODES))?.map(|file: ModesFile| file.modes),
            response: json(&folder.join(RESPONSE))?,
            table: table.unwrap_or_default(),
        })
    }

    /// Name of the folder, by which several runs are distinguished.
    #[must_use]
    pub fn name(&self) -> String {
        let absolute = std::path::absolute(&self.folder);
        let folder = absolute.as_deref().unwrap_or(&self.folder);
        folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy().into_owned()
    }

    /// The scenario's title, or its name, or the name of the folder.
    #[must_use]
    pub fn title(&self) -> String {
        let texts = ["title", "scenario"].map(|key| self.summary.get(key).and_then(Value::as_str));
        let title = texts.into_iter().flatten().find(|text| !text.is_empty());
        title.map_or_else(|| self.name(), str::to_owned)
    }

    /// The unit of measure of a signal.
    #[must_use]
    pub fn unit_of(&self, signal: &str) -> Option<&str> {
        self.signals.get(signal)?.unit.as_deref()
    }
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
        let error = RunResults::read(empty.path()).unwrap_err();
        assert!(error.to_string().contains("not a results folder"), "{error}");
        assert!(error.help().unwrap().contains("maglev run"));
        assert!(RunResults::read(Path::new("/nonexistent")).is_err());
    }

    #[test]
    fn issue_a_broken_file_is_named() {
        let broken = folder(&[("summary.json", "{"), ("results.csv", "time\n")]);
        let error = RunResults::read(broken.path()).unwrap_err().to_string();
        assert!(error.contains("summary.json") && error.contains("line 1"), "{error}");
        let odd = folder(&[("summary.json", "{\"signals\": 3}"), ("results.csv", "time\n")]);
        let error = RunResults::read(odd.path()).unwrap_err().to_string();
        assert!(error.contains("summary.json") && error.contains("invalid type"), "{error}");
    }

    /// The mean square of a value beyond 1e154 is beyond all numbers.
    #[test]
    fn issue_a_statistic_that_is_no_number_is_read() {
        let text = r#"{"signals": {"a.x": {"points": 2, "min": 1e300, "rms": null}}}"#;
        let folder = folder(&[("summary.json", text), ("results.csv", "time,a.x\n0,1e300\n")]);
        let signals = RunResults::read(folder.path()).unwrap().signals;
        let statistics = signals["a.x"].statistics.unwrap();
        assert!(statistics.min == 1e300 && statistics.rms.is_nan());
    }

    #[test]
    fn issue_runs_without_an_end_and_without_a_table_are_read() {
        let killed = folder(&[("results.csv.partial", "time,a.x\n0,1\n1,")]);
        let run = RunResults::read(killed.path()).unwrap();
        assert_eq!((&run.summary, run.table.time.len()), (&Value::Null, 1));
        assert_eq!(run.title(), run.name());
        let bare = folder(&[("summary.json", "{\"title\": \"t\", \"status\": \"failed\"}")]);
        let run = RunResults::read(bare.path()).unwrap();
        assert_eq!((run.title().as_str(), run.table.names.len()), ("t", 0));
    }
}
