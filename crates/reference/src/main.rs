//! Computes an FMU's reference results anew. `cargo xtask reference` runs this program for each of our
//! FMUs, with the settings of its `NAME_ref.opt`.

// A program that reports its progress on the terminal.
#![allow(clippy::print_stderr)]

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result, bail};
use clap::Parser;
use fmi2_conformance::reference::{self, ReferenceExperiment, ReferenceTable};
use fmi2_import::package::Package;

/// Simulates an FMU alone and writes its outputs where they differ from those in the file
///
/// Results within a tenth of the tolerance count as equal: another C library or processor changes the
/// last bits.
#[derive(Parser)]
#[command(name = "reference")]
struct Arguments {
    /// The FMU
    fmu: PathBuf,
    /// Values of its inputs over time (CSV)
    inputs: PathBuf,
    /// Its outputs over time (CSV); the first line names them
    results: PathBuf,
    /// First time (s)
    #[arg(long)]
    start: f64,
    /// Last time (s)
    #[arg(long)]
    stop: f64,
    /// Communication step (s)
    #[arg(long)]
    step: f64,
    /// Interval between two rows of the results (s)
    #[arg(long)]
    interval: f64,
    /// Allowed deviation, as a fraction of each signal's largest absolute value
    #[arg(long)]
    tolerance: f64,
    /// Write nothing; fail if the results differ
    #[arg(long)]
    check: bool,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let results = &arguments.results;
    let wanted = empty(&arguments)?;
    // Results for other times, or none at all, are replaced.
    let known = ReferenceTable::read(results).ok().filter(|table| table.times == wanted.times);
    let found = reference::simulate(
        &Arc::new(Package::open(&arguments.fmu)?),
        &ReferenceExperiment {
            name: arguments.fmu.display().to_string(),
            start: arguments.start,
            stop: arguments.stop,
            step: arguments.step,
            tolerance: arguments.tolerance,
            inputs: ReferenceTable::read(&arguments.inputs)?,
            reference: known.clone().unwrap_or(wanted),
        },
    )?;
    if known.is_some_and(|known| equal(&known, &found, 0.1 * arguments.tolerance)) {
        return Ok(());
    }
    if arguments.check {
        bail!("{} is stale: run `cargo xtask codegen` and commit", results.display());
    }
    fs::write(results, found.csv()).with_context(|| format!("writing {}", results.display()))?;
    eprintln!("wrote {}", results.display());
    Ok(())
}

fn equal(known: &ReferenceTable, found: &ReferenceTable, tolerance: f64) -> bool {
    // "all at most", so that NaN counts as different
    reference::compare(known, found).iter().all(|deviation| deviation.relative <= tolerance)
}

/// The table of results with its names and times, and without values.
fn empty(arguments: &Arguments) -> Result<ReferenceTable> {
    let names = names(&arguments.results)?;
    let &Arguments { start, stop, interval, .. } = arguments;
    let count = ((stop - start) / interval).round();
    if !(0.0..1e9).contains(&count) {
        bail!("cannot divide {start} to {stop} s into intervals of {interval} s");
    }
    let times: Vec<f64> = (0..=count as u32).map(|k| start + f64::from(k) * interval).collect();
    let rows = vec![vec![f64::NAN; names.len()]; times.len()];
    Ok(ReferenceTable { names, times, rows })
}

/// The outputs that the first line of a file of results names, after the time.
fn names(file: &Path) -> Result<Vec<String>> {
    let text = fs::read_to_string(file).with_context(|| format!("reading {}", file.display()))?;
    let header = text.lines().next().unwrap_or_default();
    Ok(header.split(',').skip(1).map(|name| name.trim_matches('"').to_owned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(results: PathBuf, stop: &str) -> Arguments {
        let numbers = ["--start=0", "--step=0.25", "--interval=0.5", "--tolerance=1e-3"];
        let mut line = vec!["reference".into(), "a.fmu".into(), "a_in.csv".into(), results];
        line.extend(numbers.map(PathBuf::from));
        line.push(format!("--stop={stop}").into());
        Arguments::parse_from(line)
    }

    #[test]
    fn golden_a_file_with_names_only_gets_rows_at_every_interval() {
        let folder = tempfile::tempdir().unwrap();
        let results = folder.path().join("a_ref.csv");
        fs::write(&results, "\"time\",\"a\",\"b\"\n").unwrap();
        let table = empty(&arguments(results.clone(), "1")).unwrap();
        assert_eq!((table.names, table.times), (vec!["a".into(), "b".into()], vec![0.0, 0.5, 1.0]));
        assert!(empty(&arguments(results, "-1")).is_err());
    }

    #[test]
    fn invariant_results_are_equal_up_to_the_tolerance_and_nan_never_is() {
        let table = |value| ReferenceTable {
            names: vec!["a".into()],
            times: vec![0.0, 1.0],
            rows: vec![vec![1.0], vec![value]],
        };
        assert!(equal(&table(0.5), &table(0.5 + 1e-5), 1e-4));
        assert!(!equal(&table(0.5), &table(0.5 + 1e-3), 1e-4));
        assert!(!equal(&table(0.5), &table(f64::NAN), 1e-4));
    }
}
