//! The reference results that a unit carries: in the files of the FMI cross-check, and named by a
//! manifest of the layered standard FMI-LS-REF.
//!
//! `fmu-*/reference/` holds for each unit NAME the files `NAME_in.csv` (inputs), `NAME_ref.opt`
//! (settings) and `NAME_ref.csv` (outputs). `cargo xtask codegen` computes the rows of the last one
//! with the project's own master; its first line chooses the outputs.

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result, bail};
use figure::{Line, Panel};
use fmi2_conformance::reference::{self, Experiment, Table, files::FOLDER};
use fmi2_import::package::Package;
use roxmltree::Document;

use crate::{package, package::Unit, workspace};

/// Curves in the picture of the documentation.
const PANELS: usize = 4;

/// The files of one unit.
pub struct Reference {
    name: String,
    folder: PathBuf,
    options: Options,
}

/// What `NAME_ref.opt` says.
struct Options {
    start: f64,
    stop: f64,
    step: f64,
    tolerance: f64,
    interval: f64,
}

impl Reference {
    /// Reads the settings of a unit's reference.
    pub fn of(unit: &Unit) -> Result<Self> {
        let folder = package::crate_folder(unit).join("reference");
        let file = folder.join(format!("{}_ref.opt", unit.name));
        let text =
            fs::read_to_string(&file).with_context(|| format!("reading {}", file.display()))?;
        let options = Options::read(&text).with_context(|| file.display().to_string())?;
        Ok(Self { name: unit.name.clone(), folder, options })
    }

    fn file(&self, end: &str) -> PathBuf {
        self.folder.join(format!("{}_{end}", self.name))
    }

    /// Name and content of all files, as they lie in the archive.
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

    /// The outputs over time as a picture, one above the other.
    pub fn figure(&self, xml: &str) -> Result<String> {
        // not there yet while they are computed for the first time
        let Ok(table) = Table::read(&self.file("ref.csv")) else { return Ok(String::new()) };
        let document = Document::parse(xml)?;
        let moving =
            |column: &usize| table.rows.iter().any(|row| row[*column] != table.rows[0][*column]);
        let columns = (0..table.names.len()).filter(moving).take(PANELS);
        let panel = |column: usize| {
            let name = &table.names[column];
            let unit = unit_of(&document, name);
            let points =
                table.times.iter().zip(&table.rows).map(|(&time, row)| (time, row[column]));
            let line = Line { label: String::new(), points: points.collect() };
            Panel { ylabel: format!("{name} ({unit})"), lines: vec![line] }
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
                .with_context(|| format!("{key} is no number"))
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

/// Computes every unit's reference results with the packed unit; with `check`, only compares.
///
/// What is committed stays where the results are within a tenth of the stated tolerance: another C
/// library or processor changes last bits.
pub fn codegen(check: bool) -> Result<()> {
    package::package(&package::Order::default())?;
    for unit in package::units()? {
        let reference = Reference::of(&unit)?;
        let package = Package::open(&workspace::unit_dir().join(format!("{}.fmu", unit.name)))?;
        let file = reference.file("ref.csv");
        let (experiment, there) = reference.experiment(&file)?;
        let found = reference::simulate(&Arc::new(package), &experiment)?;
        let tolerance = 0.1 * experiment.tolerance;
        let deviations = reference::compare(&experiment.reference, &found);
        if there && deviations.iter().all(|deviation| deviation.relative <= tolerance) {
            continue;
        }
        if check {
            bail!("{} is stale: run `cargo xtask codegen` and commit", file.display());
        }
        fs::write(&file, found.csv()).with_context(|| format!("writing {}", file.display()))?;
        eprintln!("wrote {}", file.display());
    }
    Ok(())
}

impl Reference {
    /// The experiment with the committed results, and whether these are there for all of its times.
    fn experiment(&self, file: &Path) -> Result<(Experiment, bool)> {
        let Options { start, stop, step, tolerance, interval } = self.options;
        let text =
            fs::read_to_string(file).with_context(|| format!("reading {}", file.display()))?;
        let header = text.lines().next().unwrap_or_default();
        let names = header.split(',').skip(1).map(|name| name.trim_matches('"').to_owned());
        let count = ((stop - start) / interval).round() as usize;
        let times: Vec<f64> = (0..=count).map(|k| start + k as f64 * interval).collect();
        let rows = vec![vec![f64::NAN; header.split(',').count() - 1]; times.len()];
        let empty = Table { names: names.collect(), times, rows };
        let known = Table::read(file).ok().filter(|table| table.times == empty.times);
        let there = known.is_some();
        let experiment = Experiment {
            name: self.name.clone(),
            start,
            stop,
            step,
            tolerance,
            inputs: Table::read(&self.file("in.csv"))?,
            reference: known.unwrap_or(empty),
        };
        Ok((experiment, there))
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

    /// Steps, jumps and rows fall on times that are exact in binary, so every importer steps to the
    /// very same ones, whether it counts or adds up.
    #[test]
    fn invariant_all_times_are_exact_in_binary() {
        for unit in package::units().unwrap() {
            let reference = Reference::of(&unit).unwrap();
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
