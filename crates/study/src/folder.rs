//! The results folder of a study.
//!
//! | file | content |
//! |---|---|
//! | `study.json` | the study as run |
//! | `metrics.csv` | a row per point: factors, status, figures |
//! | `dataset/chunk=N/points.parquet` | the same, 4096 points a file |
//! | `failures.csv` | why points failed, ended early or lack figures; not part of what is equal from run to run |
//! | `signals/run=NAME/signals.parquet` | kept signals of a point |
//! | `runs/NAME/` | results folder of a point |
//! | `journal/` | all rows as they were computed |

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use results::Table;
use serde_json::{Value, json};

use crate::journal::Rows;
use crate::parquet_file::{self, Values};
use crate::{Column, Design, FactorValue, Row, Study};

/// Points in a file of the dataset.
const CHUNK: u64 = 4096;
/// The study as run.
pub(crate) const STUDY: &str = "study.json";
/// Rows of a table of points.
const TABLE: &str = "table.csv";
/// Figures of all points.
pub const METRICS: &str = "metrics.csv";
/// Why points failed.
pub const FAILURES: &str = "failures.csv";
const DATASET: &str = "dataset";

/// The folder with the journals.
pub(crate) fn journals(folder: &Path) -> PathBuf {
    folder.join("journal")
}

/// The results folder of a point.
pub(crate) fn run_folder(folder: &Path, name: &str) -> PathBuf {
    folder.join("runs").join(name)
}

/// Writes the kept signals of a point.
pub(crate) fn write_signals(folder: &Path, name: &str, table: Table) -> io::Result<()> {
    let place = folder.join("signals").join(format!("run={name}"));
    fs::create_dir_all(&place)?;
    // NaN marks what is not due
    let some = |values: Vec<f64>| {
        Values::Numbers(values.into_iter().map(|it| Some(it).filter(|it| !it.is_nan())).collect())
    };
    let mut columns = vec![("time".to_owned(), some(table.time))];
    columns.extend(table.names.into_iter().zip(table.columns.into_iter().map(some)));
    parquet_file::write(&place.join("signals.parquet"), &columns)
}

/// What the dataset has of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Number of points of the study.
    pub points: u64,
    /// Number of points with a row.
    pub done: u64,
    /// Of these, the ones that did not end regularly.
    pub failed: u64,
    /// Of these, the ones that exceed a limit.
    pub beyond: u64,
}

/// Writes study.json, metrics.csv, failures.csv and the dataset from the journals.
pub(crate) fn write(
    study: &Study,
    units: &[Option<String>],
    folder: &Path,
    rows: &mut Rows,
) -> io::Result<Counts> {
    let mut counts = Counts { points: study.count(), ..Counts::default() };
    let partial = folder.join("dataset.partial");
    if partial.exists() {
        fs::remove_dir_all(&partial)?;
    }
    fs::create_dir_all(&partial)?;
    let columns = study.columns();
    results::replace(&folder.join(METRICS), |metrics| {
        results::replace(&folder.join(FAILURES), |failures| {
            let mut metrics = csv_writer(metrics);
            let mut failures = csv_writer(failures);
            metrics.write_record(header(study, columns))?;
            failures.write_record(["point", "run", "status", "message"])?;
            let mut chunk = Vec::new();
            for number in 1..=counts.points {
                let point = study.point(number).map_err(io::Error::other)?;
                if let Some(row) = rows.row(&point.name)? {
                    counts.done += 1;
                    counts.failed += u64::from(!row.status.is_regular());
                    counts.beyond += u64::from(row.limits == Some(crate::Limits::Failed));
                    metrics.write_record(fields(number, &point.values, &row, columns.len()))?;
                    if !row.message.is_empty() {
                        let number = number.to_string();
                        failures.write_record([
                            &number,
                            &row.run,
                            row.status.name(),
                            &row.message,
                        ])?;
                    }
                    chunk.push((number, point.values, row));
                }
                if (number.is_multiple_of(CHUNK) || number == counts.points) && !chunk.is_empty() {
                    let place = partial.join(format!("chunk={}", (number - 1) / CHUNK));
                    fs::create_dir_all(&place)?;
                    let table = table(study, columns, &std::mem::take(&mut chunk));
                    parquet_file::write(&place.join("points.parquet"), &table)?;
                }
            }
            metrics.flush()?;
            failures.flush()
        })
    })?;
    let whole = folder.join(DATASET);
    if whole.exists() {
        fs::remove_dir_all(&whole)?;
    }
    fs::rename(&partial, &whole)?;
    write_study(study, units, folder, counts)?;
    Ok(counts)
}

fn csv_writer(file: &fs::File) -> csv::Writer<io::BufWriter<&fs::File>> {
    csv::Writer::from_writer(io::BufWriter::new(file))
}

fn header(study: &Study, columns: &[Column]) -> Vec<String> {
    let figures = columns.iter().map(|column| column.name.clone());
    let mut header = vec!["point".to_owned()];
    header.extend(study.file().factors.keys().cloned());
    header.push("status".to_owned());
    header.extend(figures);
    header.extend(["limits", "reached", "run"].map(str::to_owned));
    header
}

fn fields(number: u64, values: &[FactorValue], row: &Row, figures: usize) -> Vec<String> {
    let shown = |value: Option<f64>| {
        value.map(|it| ryu::Buffer::new().format(it).to_owned()).unwrap_or_default()
    };
    let mut fields = vec![number.to_string()];
    fields.extend(values.iter().map(ToString::to_string));
    fields.push(row.status.name().to_owned());
    fields.extend((0..figures).map(|k| shown(row.metrics.get(k).copied().flatten())));
    fields.push(row.limits.map(|it| it.name().to_owned()).unwrap_or_default());
    fields.push(shown(row.reached));
    fields.push(row.run.clone());
    fields
}

/// The columns of a part of the dataset. A factor is a column of numbers if all its values are numbers.
fn table(
    study: &Study,
    columns: &[Column],
    rows: &[(u64, Vec<FactorValue>, Row)],
) -> Vec<(String, Values)> {
    let texts = |text: &dyn Fn(&Row) -> Option<String>| {
        Values::Texts(rows.iter().map(|(_, _, row)| text(row)).collect())
    };
    let numbers = rows.iter().map(|(number, ..)| i64::try_from(*number).ok()).collect();
    let mut table = vec![("point".to_owned(), Values::Integers(numbers))];
    for (k, (name, kind)) in study.kinds().iter().enumerate() {
        let values = || rows.iter().map(|(_, values, _)| &values[k]);
        let column = match kind {
            Kind::Integer => Values::Integers(
                values()
                    .map(|it| if let FactorValue::Integer(it) = it { Some(*it) } else { None })
                    .collect(),
            ),
            Kind::Number => Values::Numbers(values().map(FactorValue::number).collect()),
            Kind::Text => Values::Texts(values().map(|it| Some(it.to_string())).collect()),
        };
        table.push(((*name).clone(), column));
    }
    table.push(("status".to_owned(), texts(&|row| Some(row.status.name().to_owned()))));
    for (k, column) in columns.iter().enumerate() {
        let values = rows.iter().map(|(_, _, row)| row.metrics.get(k).copied().flatten());
        table.push((column.name.clone(), Values::Numbers(values.collect())));
    }
    table.push(("limits".to_owned(), texts(&|row| Some(row.limits?.name().to_owned()))));
    let reached = rows.iter().map(|(_, _, row)| row.reached).collect();
    table.push(("reached".to_owned(), Values::Numbers(reached)));
    table.push(("run".to_owned(), texts(&|row| Some(row.run.clone()))));
    table
}

/// The kind of the values of a factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Integer,
    Number,
    Text,
}

/// Writes study.json, so that the folder can be merged. One that is there stays.
pub(crate) fn write_study_alone(
    study: &Study,
    units: &[Option<String>],
    folder: &Path,
) -> io::Result<()> {
    if folder.join(STUDY).exists() {
        return Ok(());
    }
    let counts = Counts { points: study.count(), ..Counts::default() };
    let written = write_study(study, units, folder, counts);
    // tasks of an array start together: another one has written the same
    if folder.join(STUDY).exists() { Ok(()) } else { written }
}

/// Writes the study as run: a study file with absolute paths, and what readers of the results need to know.
fn write_study(
    study: &Study,
    units: &[Option<String>],
    folder: &Path,
    counts: Counts,
) -> io::Result<()> {
    let mut file = study.file().clone();
    file.schema = None;
    file.scenario = std::path::absolute(&file.scenario)?;
    if let Design::Table { file: path } = &mut file.design {
        write_table(study, folder)?;
        *path = TABLE.into();
    }
    let factors = file.factors.iter().map(|(name, factor)| {
        let title = if factor.title.is_empty() { name } else { &factor.title };
        json!({
            "name": name, "kind": "factor", "unit": factor.unit, "title": title,
            "seeds": factor.seeds.is_some(),
        })
    });
    let columns = study.columns();
    let figures = columns.iter().zip(units).map(|(column, unit)| {
        let title = &column.metric.title;
        json!({
            "name": column.name, "kind": if column.is_limit { "limit" } else { "objective" },
            "unit": unit.as_deref().unwrap_or(""),
            "title": if title.is_empty() { &column.name } else { title },
        })
    });
    let columns_json: Vec<Value> = factors.chain(figures).collect();
    (file.objectives, file.limits) = Default::default();
    for Column { name, metric, is_limit } in columns.iter().cloned() {
        let list = if is_limit { &mut file.limits } else { &mut file.objectives };
        list.insert(name, metric);
    }
    let mut as_run = json!({
        "name": study.name(), "version": env!("CARGO_PKG_VERSION"), "identity": study.identity(),
        "points": counts.points, "finished": counts.done, "columns": columns_json,
    });
    if let Some(chosen) = study.chosen() {
        as_run["chosen"] = serde_json::to_value(chosen)?;
    }
    file.as_run = Some(as_run);
    let text = serde_json::to_string_pretty(&file)? + "\n";
    results::write_whole(&folder.join(STUDY), text.as_bytes())
}

/// The table of points, beside the study that names it.
fn write_table(study: &Study, folder: &Path) -> io::Result<()> {
    results::replace(&folder.join(TABLE), |file| {
        let mut writer = csv_writer(file);
        let (names, rows) = study.table();
        writer.write_record(names)?;
        for row in rows {
            writer.write_record(row.iter().map(ToString::to_string))?;
        }
        writer.flush()
    })
}
