//! The reference results that a unit carries: in the files of the FMI cross-check, and named by a
//! manifest of the layered standard FMI-LS-REF.
//!
//! `fmu-*/reference/` holds for each unit NAME the files `NAME_in.csv` (inputs), `NAME_ref.opt`
//! (settings) and `NAME_ref.csv` (outputs). The first line of the last one names the outputs;
//! `cargo xtask codegen` lets the program of `crates/reference` compute the other lines.

use std::{
    ffi::OsString,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use figure::{FigureLine, FigurePanel};
use roxmltree::Document;

use crate::{
    package::{self, Order, Unit},
    workspace,
};

/// Where an .fmu keeps its reference results.
const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-ref";

/// Curves in the picture of the documentation.
const PANELS: usize = 4;

/// The files of one unit.
pub struct Reference {
    name: String,
    folder: PathBuf,
    options: Options,
}

/// The settings in `NAME_ref.opt`.
struct Options {
    start: f64,
    stop: f64,
    step: f64,
    tolerance: f64,
    interval: f64,
}

impl Reference {
    /// Reads the settings of a unit's reference; `None` if the unit has none.
    pub fn of(unit: &Unit) -> Result<Option<Self>> {
        let folder = package::crate_folder(unit).join("reference");
        let file = folder.join(format!("{}_ref.opt", unit.name));
        if !file.is_file() {
            return Ok(None);
        }
        let text =
            fs::read_to_string(&file).with_context(|| format!("reading {}", file.display()))?;
        let options = Options::read(&text).with_context(|| file.display().to_string())?;
        Ok(Some(Self { name: unit.name.clone(), folder, options }))
    }

    fn file(&self, end: &str) -> PathBuf {
        self.folder.join(format!("{}_{end}", self.name))
    }

    /// Path in the .fmu and content of every file.
    pub fn files(&self) -> Result<Vec<(String, Vec<u8>)>> {
        let mut files = Vec::new();
        for end in ["in.csv", "ref.csv", "ref.opt"] {
            let file = self.file(end);
            let content = fs::read(&file).with_context(|| format!("reading {}", file.display()))?;
            files.push((format!("{FOLDER}/{}_{end}", self.name), content));
        }
        files.push((format!("{FOLDER}/{}.exp", self.name), self.experiments().into_bytes()));
        files.push((format!("{FOLDER}/fmi-ls-manifest.xml"), self.manifest().into_bytes()));
        Ok(files)
    }

    /// The experiment (MA-HS-Experiments).
    fn experiments(&self) -> String {
        let Options { start, stop, step, tolerance, .. } = self.options;
        let name = &self.name;
        format!(
            r#"<?xml version="1.0" encoding="UTF-8"?>
<Experiments name="{name}" description="Reference results of the unit {name}">
  <Experiment name="{name}" description="Inputs that jump at communication points, and the outputs they lead to" tolerance="{tolerance:?}">
    <TransientSimulation startTime="{start:?}" stopTime="{stop:?}" stepSize="{step:?}"/>
    <Stimuli source="{name}_in.csv"/>
    <References source="{name}_ref.csv"/>
  </Experiment>
</Experiments>
"#
        )
    }

    /// The manifest (FMI-LS-REF).
    fn manifest(&self) -> String {
        let name = &self.name;
        let mut related = String::new();
        for (mime, file, role, what) in [
            (
                "application/x-ma-hs-experiments",
                format!("{name}.exp"),
                "experiment",
                "Reference experiment",
            ),
            (
                "text/csv",
                format!("{name}_in.csv"),
                "testcase",
                "Inputs of the reference experiment, as in the FMI cross-check",
            ),
            (
                "text/csv",
                format!("{name}_ref.csv"),
                "result",
                "Outputs of the reference experiment, as in the FMI cross-check",
            ),
            (
                "text/plain",
                format!("{name}_ref.opt"),
                "configuration",
                "Settings of the reference experiment, as in the FMI cross-check",
            ),
        ] {
            // writing to a String cannot fail
            let _ = writeln!(
                related,
                r#"  <Related type="{mime}" source="{file}" role="{role}" description="{what}"/>"#
            );
        }
        format!(
            r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest" fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-ref" fmi-ls:fmi-ls-version="1.0.0-alpha.1" fmi-ls:fmi-ls-description="Layered Standard providing information on related files included in an FMU.">
{related}</fmiReferences>
"#
        )
    }

    /// Curves of the outputs over time, one above the other.
    pub fn figure(&self, xml: &str) -> Result<String> {
        let table = Table::read(&self.file("ref.csv"))?;
        // the results are yet to be computed
        if table.rows.is_empty() {
            return Ok(String::new());
        }
        let document = Document::parse(xml)?;
        let moving =
            |column: &usize| table.rows.iter().any(|row| row[*column] != table.rows[0][*column]);
        let columns = (0..table.names.len()).filter(moving).take(PANELS);
        let panel = |column: usize| {
            let name = &table.names[column];
            let unit = unit_of(&document, name);
            let points =
                table.times.iter().zip(&table.rows).map(|(&time, row)| (time, row[column]));
            let line = FigureLine { label: String::new(), points: points.collect() };
            FigurePanel { ylabel: format!("{name} ({unit})"), lines: vec![line] }
        };
        Ok(figure::draw("", &columns.map(panel).collect::<Vec<_>>())?)
    }
}

fn unit_of<'a>(document: &'a Document<'_>, variable: &str) -> &'a str {
    let node = document
        .descendants()
        .find(|n| n.has_tag_name("ScalarVariable") && n.attribute("name") == Some(variable));
    let kind = node.and_then(|node| node.first_element_child());
    kind.and_then(|kind| kind.attribute("unit")).unwrap_or("1")
}

impl Options {
    fn read(text: &str) -> Result<Self> {
        let number = |key: &str| -> Result<f64> {
            let line =
                text.lines().find_map(|line| line.strip_prefix(key)?.trim().strip_prefix(','));
            line.with_context(|| format!("{key} is missing"))?
                .trim()
                .parse()
                .with_context(|| format!("{key} is not a number"))
        };
        Ok(Self {
            start: number("StartTime")?,
            stop: number("StopTime")?,
            step: number("StepSize")?,
            tolerance: number("RelTol")?,
            interval: number("OutputIntervalLength")?,
        })
    }
}

/// Computes every unit's reference results with the packed unit and writes those that differ; with
/// `check`, a difference is an error.
pub fn codegen(check: bool) -> Result<()> {
    package::package(&Order::default())?;
    let program = workspace::build_program("reference")?;
    for unit in package::units()? {
        let Some(reference) = Reference::of(&unit)? else { continue };
        let Options { start, stop, step, tolerance, interval } = reference.options;
        let mut args: Vec<OsString> = vec![
            workspace::unit_dir().join(format!("{}.fmu", unit.name)).into(),
            reference.file("in.csv").into(),
            reference.file("ref.csv").into(),
        ];
        for (option, value) in [
            ("start", start),
            ("stop", stop),
            ("step", step),
            ("tolerance", tolerance),
            ("interval", interval),
        ] {
            args.push(format!("--{option}={value:?}").into());
        }
        args.extend(check.then(|| "--check".into()));
        workspace::run(&program, &args)?;
    }
    Ok(())
}

/// Numbers over time, as in the files of the FMI cross-check.
struct Table {
    names: Vec<String>,
    times: Vec<f64>,
    /// Without the time.
    rows: Vec<Vec<f64>>,
}

impl Table {
    fn read(file: &Path) -> Result<Self> {
        let what = || format!("reading {}", file.display());
        let mut reader = csv::ReaderBuilder::new().from_path(file).with_context(what)?;
        let names = reader.headers().with_context(what)?.iter().skip(1).map(str::to_owned);
        let mut table = Self { names: names.collect(), times: Vec::new(), rows: Vec::new() };
        for record in reader.deserialize() {
            let mut row: Vec<f64> = record.with_context(what)?;
            table.times.push(row.remove(0));
            table.rows.push(row);
        }
        Ok(table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_settings_are_read_as_the_cross_check_writes_them() {
        let text =
            "StartTime, 0\nStopTime, 20\nStepSize, 0.01\nRelTol, 1e-5\nOutputIntervalLength,0.1\n";
        let options = Options::read(text).unwrap();
        assert_eq!((options.start, options.stop, options.step), (0.0, 20.0, 0.01));
        assert_eq!((options.tolerance, options.interval), (1e-5, 0.1));
        let error = Options::read(&text.replace("RelTol", "Other")).err().unwrap();
        assert!(error.to_string().contains("RelTol"), "{error}");
    }

    #[test]
    fn issue_15_a_layout_needs_no_reference() {
        let unit = Unit { name: "guideway-mine".into(), identifier: "guideway", resources: None };
        assert!(Reference::of(&unit).unwrap().is_none());
    }

    /// Steps, jumps and rows fall on times that are exact in binary, so every importer steps to the
    /// very same ones, whether it counts or adds up.
    #[test]
    fn invariant_all_times_are_exact_in_binary() {
        for unit in package::units().unwrap() {
            let reference = Reference::of(&unit).unwrap().unwrap();
            let inputs = Table::read(&reference.file("in.csv")).unwrap();
            let results = Table::read(&reference.file("ref.csv")).unwrap();
            let step = reference.options.step;
            assert_eq!(step.log2().fract(), 0.0, "{}: the step {step}", unit.name);
            for time in inputs.times.iter().chain(&results.times) {
                assert_eq!((time / step).fract(), 0.0, "{}: {time} s", unit.name);
            }
            assert!(results.names.len() <= 10, "{}: the rules ask for ten at most", unit.name);
        }
    }
}
