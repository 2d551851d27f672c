//! The folder of a study.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::columns::{Column, ColumnKind, ColumnValues, bound};
use crate::error::StudyReportError;

/// The study as run.
const STUDY: &str = "study.json";
/// The table of all points.
const METRICS: &str = "metrics.csv";
/// Why points failed.
const FAILURES: &str = "failures.csv";
/// Folder of the results of single points.
const RUNS: &str = "runs";
/// Columns that are neither factors nor figures.
const POINT: &str = "point";
const STATUS: &str = "status";
const LIMITS: &str = "limits";
const REACHED: &str = "reached";
const RUN: &str = "run";

/// The results of a study, as far as it got.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyResults {
    /// Folder that the results were read from.
    pub folder: PathBuf,
    /// The study file as run.
    pub study: Value,
    /// Factors and figures.
    pub columns: Vec<Column>,
    /// Numbers of the points.
    pub points: Vec<u64>,
    /// How each point ended.
    pub status: Vec<String>,
    /// Whether each point keeps all limits: `passed`, `failed`, `not-judged`, or empty.
    pub limits: Vec<String>,
    /// Last time of each point (s).
    pub reached: Vec<f64>,
    /// Reports of single points, relative to the folder.
    pub reports: Vec<Option<String>>,
    /// Why points failed, or why figures are missing, by the number of the point.
    pub messages: Vec<(u64, String)>,
}

impl StudyResults {
    /// Reads the folder of a study.
    ///
    /// # Errors
    /// study.json or metrics.csv is missing or damaged.
    pub fn read(folder: &Path) -> Result<Self, StudyReportError> {
        let study = read_study(&folder.join(STUDY))?;
        let path = folder.join(METRICS);
        let damaged = |message: String| StudyReportError::Damaged { path: path.clone(), message };
        let table = Csv::read(&path)?.ok_or_else(|| {
            let source = std::io::ErrorKind::NotFound.into();
            StudyReportError::Read { path: path.clone(), source }
        })?;
        let texts = |name: &str| table.column(name);
        let status = texts(STATUS).ok_or_else(|| damaged(format!("it has no column {STATUS}")))?;
        let points = texts(POINT).ok_or_else(|| damaged(format!("it has no column {POINT}")))?;
        let number = |text: &&str| {
            text.parse().map_err(|_| damaged(format!("{text} in the column {POINT} is no number")))
        };
        let points: Vec<u64> = points.iter().map(number).collect::<Result<_, _>>()?;
        let owned = |name: &str| -> Vec<String> {
            let all = texts(name).unwrap_or_else(|| vec![""; points.len()]);
            all.into_iter().map(str::to_owned).collect()
        };
        let reached = owned(REACHED).iter().map(|it| it.parse().unwrap_or(f64::NAN)).collect();
        let reports = owned(RUN).iter().map(|run| report_of(folder, run)).collect();
        let limits = owned(LIMITS);
        Ok(Self {
            columns: columns(&study, &table),
            status: status.into_iter().map(str::to_owned).collect(),
            messages: messages(&folder.join(FAILURES))?,
            folder: folder.to_owned(),
            study,
            points,
            limits,
            reached,
            reports,
        })
    }

    /// A text of the study file.
    pub(crate) fn text(&self, key: &str) -> &str {
        self.study.get(key).and_then(Value::as_str).unwrap_or_default()
    }

    /// The title of the study, or its name, or that of its folder.
    #[must_use]
    pub fn title(&self) -> String {
        let name = || self.as_run("name").and_then(Value::as_str).unwrap_or_default().to_owned();
        let absolute = std::path::absolute(&self.folder).unwrap_or_else(|_| self.folder.clone());
        let folder = || absolute.file_name().map(|it| it.to_string_lossy().into_owned());
        let candidates = [self.text("title").to_owned(), name(), folder().unwrap_or_default()];
        candidates.into_iter().find(|it| !it.is_empty()).unwrap_or_default()
    }

    /// What `maglev study run` noted about the study.
    pub(crate) fn as_run(&self, key: &str) -> Option<&Value> {
        self.study.get("as_run")?.get(key)
    }

    /// The kind of the design: `grid`, `saltelli`, …
    #[must_use]
    pub fn design(&self) -> &str {
        let kind = self.study.get("design").and_then(|it| it.get("kind")).and_then(Value::as_str);
        kind.unwrap_or("grid")
    }

    /// Whether the run of a point ended at its stop time or by a condition of the scenario.
    #[must_use]
    pub fn ended_well(&self, point: usize) -> bool {
        matches!(self.status[point].as_str(), "finished" | "stopped")
    }
}

fn read_study(path: &Path) -> Result<Value, StudyReportError> {
    let read = std::fs::read_to_string(path);
    let text = read.map_err(|source| StudyReportError::Read { path: path.to_owned(), source })?;
    serde_json::from_str(&text).map_err(|error| StudyReportError::Damaged {
        path: path.to_owned(),
        message: error.to_string(),
    })
}

/// A table of texts.
struct Csv {
    names: csv::StringRecord,
    rows: Vec<csv::StringRecord>,
}

impl Csv {
    /// `None` if the file does not exist.
    fn read(path: &Path) -> Result<Option<Self>, StudyReportError> {
        if !path.exists() {
            return Ok(None);
        }
        let damaged = |error: csv::Error| StudyReportError::Damaged {
            path: path.to_owned(),
            message: error.to_string(),
        };
        let mut reader = csv::Reader::from_path(path).map_err(damaged)?;
        let names = reader.headers().map_err(damaged)?.clone();
        let rows = reader.records().collect::<Result<_, _>>().map_err(damaged)?;
        Ok(Some(Self { names, rows }))
    }

    fn column(&self, name: &str) -> Option<Vec<&str>> {
        let index = self.names.iter().position(|it| it == name)?;
        Some(self.rows.iter().map(|row| row.get(index).unwrap_or_default()).collect())
    }
}

/// Factors and figures in the order of the table. Their kinds are those of study.json; columns that it does not
/// describe are factors before the status and figures behind it.
fn columns(study: &Value, table: &Csv) -> Vec<Column> {
    let described = study.get("as_run").and_then(|it| it.get("columns")).and_then(Value::as_array);
    let mut behind = false;
    let mut columns = Vec::new();
    for name in &table.names {
        if name == STATUS {
            behind = true;
        }
        if [POINT, STATUS, LIMITS, REACHED, RUN].contains(&name) {
            continue;
        }
        let known =
            described.into_iter().flatten().find(|it| it.get("name").is_some_and(|it| it == name));
        let text = |key: &str| {
            known.and_then(|it| it.get(key)).and_then(Value::as_str).unwrap_or_default()
        };
        let seeds = known.and_then(|it| it.get("seeds")).and_then(Value::as_bool) == Some(true);
        let kind = match text("kind") {
            "factor" if seeds => ColumnKind::Seeds,
            "factor" => ColumnKind::Factor,
            "" if !behind => ColumnKind::Factor,
            _ => ColumnKind::Figure,
        };
        let metric = study.get("limits").and_then(|it| it.get(name));
        let limit = |key: &str| metric.and_then(|it| it.get(key)).and_then(bound);
        columns.push(Column {
            title: if text("title").is_empty() {
                name.to_owned()
            } else {
                text("title").to_owned()
            },
            unit: text("unit").to_owned(),
            kind,
            limits: [limit("min"), limit("max")],
            values: ColumnValues::of(&table.column(name).unwrap_or_default()),
            name: name.to_owned(),
        });
    }
    columns
}

/// The report of a point, if its folder was kept.
fn report_of(folder: &Path, run: &str) -> Option<String> {
    // the name becomes part of a path
    let plain = !run.is_empty() && run.bytes().all(|it| it.is_ascii_alphanumeric() || it == b'-');
    let path = format!("{RUNS}/{run}/{}", results::REPORT);
    (plain && folder.join(&path).exists()).then_some(path)
}

fn messages(path: &Path) -> Result<Vec<(u64, String)>, StudyReportError> {
    let Some(table) = Csv::read(path)? else { return Ok(Vec::new()) };
    let (points, texts) = (table.column(POINT), table.column("message"));
    let rows = points.unwrap_or_default().into_iter().zip(texts.unwrap_or_default());
    Ok(rows.filter_map(|(point, text)| Some((point.parse().ok()?, text.to_owned()))).collect())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A study with a table.
    pub(crate) fn study(json: &str, table: &str) -> (tempfile::TempDir, StudyResults) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(STUDY), json).unwrap();
        std::fs::write(folder.path().join(METRICS), table).unwrap();
        let read = StudyResults::read(folder.path()).unwrap();
        (folder, read)
    }

    #[test]
    fn golden_a_folder_is_read() {
        let json = r#"{"title": "T", "limits": {"f": {"max": "1/4"}}, "as_run": {"columns": [
            {"name": "k", "kind": "factor", "unit": "N/m", "title": "stiffness"},
            {"name": "s", "kind": "factor", "seeds": true}, {"name": "f", "kind": "limit", "unit": "m"}]}}"#;
        let table = "point,k,s,status,f,limits,reached,run\n1,5,11,finished,0.2,passed,2,ab12\n2,6,12,failed,,,0.5,../x\n";
        let (folder, it) = study(json, table);
        let kinds: Vec<ColumnKind> = it.columns.iter().map(|it| it.kind).collect();
        assert_eq!(kinds, [ColumnKind::Factor, ColumnKind::Seeds, ColumnKind::Figure]);
        assert_eq!(
            (it.columns[0].title.as_str(), it.columns[2].limits[1]),
            ("stiffness", Some(0.25))
        );
        assert!(it.columns[2].values.number(1).is_nan() && !it.ended_well(1) && it.ended_well(0));
        assert_eq!((it.title().as_str(), it.design()), ("T", "grid"));
        assert_eq!(it.reports, [None, None]);
        std::fs::create_dir_all(folder.path().join("runs/ab12")).unwrap();
        std::fs::write(folder.path().join("runs/ab12/report.html"), "").unwrap();
        let again = StudyResults::read(folder.path()).unwrap();
        assert_eq!(again.reports[0].as_deref(), Some("runs/ab12/report.html"));
    }

    #[test]
    fn refusal_a_folder_without_a_study_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = StudyResults::read(folder.path()).unwrap_err();
        assert!(
            error.to_string().contains("study.json") && error.help().contains("maglev study run")
        );
        std::fs::write(folder.path().join(STUDY), "{").unwrap();
        let error = StudyResults::read(folder.path()).unwrap_err();
        assert!(error.to_string().contains("study.json is damaged"), "{error}");
        std::fs::write(folder.path().join(STUDY), "{}").unwrap();
        assert!(StudyResults::read(folder.path()).unwrap_err().to_string().contains("metrics.csv"));
        std::fs::write(folder.path().join(METRICS), "a,b\n1,2\n").unwrap();
        let error = StudyResults::read(folder.path()).unwrap_err();
        assert!(error.to_string().contains("no column status"), "{error}");
    }
}
