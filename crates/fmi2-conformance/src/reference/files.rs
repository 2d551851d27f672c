//! The files of reference results: CSV tables, and experiments of the layered standard FMI-LS-REF.
//!
//! The tables follow the rules of the FMI cross-check: names in the first line, time in the first column, times that
//! never decrease. Of two rows at the same time the later one counts from there on. The manifest of FMI-LS-REF
//! (1.0.0-alpha.1) refers to files of experiments, and these refer to the tables.

use std::path::{Path, PathBuf};

use roxmltree::{Document, Node};

use super::error::ReferenceError;
use fmi2_import::package::Package;

pub use fmi2_import::package::REFERENCE_RESULTS as FOLDER;

/// A table of numbers over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReferenceTable {
    /// Names of the columns after the time.
    pub names: Vec<String>,
    /// Time of each row (s).
    pub times: Vec<f64>,
    /// The rows, without the time.
    pub rows: Vec<Vec<f64>>,
}

/// Inputs, and the outputs that the FMU must reproduce.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceExperiment {
    /// Name of the experiment in FMI-LS-REF.
    pub name: String,
    /// First time (s).
    pub start: f64,
    /// Last time (s).
    pub stop: f64,
    /// Communication step (s).
    pub step: f64,
    /// Allowed deviation, as a fraction of each signal's largest absolute value.
    pub tolerance: f64,
    /// Values of the inputs.
    pub inputs: ReferenceTable,
    /// Expected values of the outputs.
    pub reference: ReferenceTable,
}

impl ReferenceExperiment {
    /// Time of a communication point (s), counted from the start; never after the stop time.
    #[must_use]
    pub fn time(&self, point: u64) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "below 2^32")]
        let count = point as f64;
        (self.start + count * self.step).min(self.stop)
    }
}

impl ReferenceTable {
    /// Reads a CSV file.
    ///
    /// # Errors
    /// It cannot be read, or violates a rule; with the row.
    pub fn read(file: &Path) -> Result<Self, ReferenceError> {
        let fail = fail(file);
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_path(file)
            .map_err(|error| fail(error.to_string()))?;
        let header = reader.headers().map_err(|error| fail(error.to_string()))?;
        let mut table =
            Self { names: header.iter().skip(1).map(str::to_owned).collect(), ..Self::default() };
        for (number, record) in reader.records().enumerate() {
            let at = |message: String| fail(format!("row {}: {message}", number + 1));
            let record = record.map_err(|error| at(error.to_string()))?;
            let number = |text: &str| match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(at(format!("\"{text}\" is not a finite number"))),
            };
            let values: Vec<f64> = record.iter().map(number).collect::<Result<_, _>>()?;
            let (&time, row) = values.split_first().ok_or_else(|| at("is empty".into()))?;
            if table.times.last().is_some_and(|&last| last > time) {
                return Err(at(format!("the time {time} is before the time of the row above")));
            }
            table.times.push(time);
            table.rows.push(row.to_vec());
        }
        if table.times.is_empty() {
            return Err(fail("the table has no rows".into()));
        }
        Ok(table)
    }

    /// The table as CSV text, by the rules of the cross-check.
    #[must_use]
    pub fn csv(&self) -> String {
        let names = std::iter::once("time").chain(self.names.iter().map(String::as_str));
        let mut lines = vec![names.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(",")];
        let mut buffer = ryu::Buffer::new();
        let mut number = |value: f64| buffer.format_finite(value).to_owned();
        for (time, row) in self.times.iter().zip(&self.rows) {
            let mut cells = vec![number(*time)];
            cells.extend(row.iter().map(|&value| number(value)));
            lines.push(cells.join(","));
        }
        lines.push(String::new());
        lines.join("\n")
    }

    /// Values at a time: linear between rows, constant before the first and after the last.
    pub fn at(&self, time: f64, values: &mut [f64]) {
        let after = self.times.partition_point(|&row| row <= time);
        let below = after.saturating_sub(1);
        let above = after.min(self.times.len().saturating_sub(1));
        let (Some(&from), Some(&to)) = (self.times.get(below), self.times.get(above)) else {
            return;
        };
        let share = if to > from { ((time - from) / (to - from)).max(0.0) } else { 0.0 };
        for ((value, a), b) in values.iter_mut().zip(&self.rows[below]).zip(&self.rows[above]) {
            *value = a + share * (b - a);
        }
    }
}

/// All experiments in an FMU.
///
/// # Errors
/// There are none, or a file is missing or damaged.
pub fn experiments(package: &Package) -> Result<Vec<ReferenceExperiment>, ReferenceError> {
    let folder = package.folder().join(FOLDER);
    let manifest = folder.join("fmi-ls-manifest.xml");
    let mut found = Vec::new();
    if manifest.is_file() {
        let text = text(&manifest)?;
        let document = document(&manifest, &text)?;
        for related in document.descendants().filter(|node| node.has_tag_name("Related")) {
            if related.attribute("role").is_some_and(|role| role.starts_with("experiment")) {
                let source = beside(&manifest, related.attribute("source"))?;
                found.extend(read_experiments(&source)?);
            }
        }
    }
    if found.is_empty() {
        return Err(ReferenceError::None { unit: package.path().display().to_string() });
    }
    Ok(found)
}

/// Reads an experiments file (MA-HS-Experiments, `.exp`).
fn read_experiments(file: &Path) -> Result<Vec<ReferenceExperiment>, ReferenceError> {
    let text = text(file)?;
    let document = document(file, &text)?;
    let nodes = document.descendants().filter(|node| node.has_tag_name("Experiment"));
    nodes.map(|node| read_experiment(file, &node)).collect()
}

fn read_experiment(
    file: &Path,
    node: &Node<'_, '_>,
) -> Result<ReferenceExperiment, ReferenceError> {
    let fail = fail(file);
    let child = |name: &str| node.children().find(|child| child.has_tag_name(name));
    if child("Parameters").is_some() {
        return Err(fail("experiments with parameter sets are not supported".into()));
    }
    // earlier drafts have the times on the experiment itself
    let settings = child("TransientSimulation").unwrap_or(*node);
    let number = |node: &Node<'_, '_>, name: &str| match node.attribute(name).map(str::parse) {
        Some(Ok(value)) => Ok(Some(value)),
        None => Ok(None),
        Some(Err(_)) => Err(fail(format!("{name} is not a number"))),
    };
    let table = |name: &str| match child(name) {
        Some(found) => ReferenceTable::read(&beside(file, found.attribute("source"))?),
        None => Ok(ReferenceTable::default()),
    };
    let reference = table("References")?;
    let (Some(&first), Some(&last)) = (reference.times.first(), reference.times.last()) else {
        return Err(fail("an experiment has no References".into()));
    };
    let need = |value: Option<f64>, name| value.ok_or_else(|| fail(format!("{name} is missing")));
    Ok(ReferenceExperiment {
        name: node.attribute("name").unwrap_or_default().to_owned(),
        start: number(&settings, "startTime")?.unwrap_or(first),
        stop: number(&settings, "stopTime")?.unwrap_or(last),
        step: need(number(&settings, "stepSize")?, "stepSize")?,
        tolerance: need(number(node, "tolerance")?, "tolerance")?,
        inputs: table("Stimuli")?,
        reference,
    })
}

/// Path of a file to which another one refers, relative to it.
fn beside(file: &Path, source: Option<&str>) -> Result<PathBuf, ReferenceError> {
    let source = source.ok_or_else(|| fail(file)("an entry has no attribute source".into()))?;
    let decoded = percent_encoding::percent_decode_str(source).decode_utf8_lossy();
    if Path::new(decoded.as_ref()).is_absolute() || decoded.contains("..") {
        return Err(fail(file)(format!(
            "the source {source} is outside the folder of the experiments"
        )));
    }
    Ok(file.with_file_name(decoded.as_ref()))
}

fn text(file: &Path) -> Result<String, ReferenceError> {
    std::fs::read_to_string(file).map_err(|error| fail(file)(error.to_string()))
}

fn document<'a>(file: &Path, text: &'a str) -> Result<Document<'a>, ReferenceError> {
    Document::parse(text).map_err(|error| fail(file)(error.to_string()))
}

fn fail(file: &Path) -> impl Fn(String) -> ReferenceError + '_ {
    let name = || file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    move |message| ReferenceError::File { file: name(), message }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(text: &str) -> Result<ReferenceTable, ReferenceError> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("in.csv");
        std::fs::write(&file, text).unwrap();
        ReferenceTable::read(&file)
    }

    #[test]
    fn analytic_inputs_are_linear_between_rows_and_jump_where_two_rows_share_a_time() {
        let table = written("\"time\",\"a\",\"b\"\n0,1,5\n1,3,5\n1,10,5\n2,10,5\n").unwrap();
        assert_eq!(table.names, ["a", "b"]);
        for (time, expected) in [(-1.0, 1.0), (0.0, 1.0), (0.5, 2.0), (1.0, 10.0), (9.0, 10.0)] {
            let mut values = [0.0; 2];
            table.at(time, &mut values);
            assert_eq!(values, [expected, 5.0], "at {time} s");
        }
    }

    #[test]
    fn invariant_a_table_reads_back_as_written() {
        let table = ReferenceTable {
            names: vec!["x[1]".into(), "y".into()],
            times: vec![0.0, 0.1],
            rows: vec![vec![1.0 / 3.0, -1e-300], vec![f64::MAX, 0.0]],
        };
        assert_eq!(written(&table.csv()).unwrap(), table);
        assert!(table.csv().starts_with("\"time\",\"x[1]\",\"y\"\n0.0,"));
    }

    #[test]
    fn issue_tables_that_violate_a_rule_are_refused_with_the_row() {
        for (text, said) in [
            ("time,a\n1,2\n0,2\n", "row 2"),
            ("time,a\n0,NaN\n", "NaN"),
            ("time,a\n0,x\n", "\"x\""),
            ("time,a\n0\n", "row 1"),
            ("time,a\n", "no rows"),
        ] {
            let message = written(text).unwrap_err().to_string();
            assert!(message.contains(said), "{text:?}: {message}");
        }
    }

    #[test]
    fn issue_sources_outside_of_the_folder_are_refused() {
        let manifest = Path::new("/unit/extra/fmi-ls-manifest.xml");
        assert_eq!(beside(manifest, Some("a%20b.exp")).unwrap(), Path::new("/unit/extra/a b.exp"));
        for source in [None, Some("../../a.exp"), Some("/etc/passwd"), Some("%2e%2e/a")] {
            assert!(beside(manifest, source).is_err(), "{source:?}");
        }
    }
}
