//! Runs the studies of the readings and measures their runs.

use std::{collections::BTreeMap, ops::Range, path::PathBuf};

use anyhow::{Context, Result, bail, ensure};
use results::Table;

use super::{
    case::{Case, Study, table},
    catalogue::cases,
    dataset::{Dataset, Row},
};
use crate::{
    claims::weakest_of,
    measure::six,
    numbers::ON_THE_SPANS,
    runs::{maglev, modes_with},
};

/// Where a study's results are.
fn folder(study: Study) -> PathBuf {
    crate::target_dir().join("paper").join(study.name())
}

fn file(study: Study, ending: &str) -> PathBuf {
    crate::root().join("examples/studies").join(study.name()).with_extension(ending)
}

/// Writes the tables of points. They follow from the readings.
pub fn write_tables() -> Result<()> {
    let all = cases();
    for study in Study::ALL {
        crate::write(&file(study, "csv"), points(&all, study))?;
    }
    Ok(())
}

/// The table of points of a study.
pub fn points(all: &[Case], study: Study) -> String {
    table(&of(all, study))
}

fn of(all: &[Case], study: Study) -> Vec<&Case> {
    all.iter().filter(|it| it.study == study).collect()
}

/// Runs what is missing, and measures all of it.
pub fn run_all() -> Result<Dataset> {
    write_tables()?;
    let all = cases();
    let mut rows = Vec::new();
    let mut modes = BTreeMap::new();
    for study in Study::ALL {
        let mut command = maglev();
        command.args(["study", "run"]).arg(file(study, "json")).arg("--out").arg(folder(study));
        let status = command.status().context("starting maglev study")?;
        if !status.success() {
            bail!("the study {} ended with {status}", study.name());
        }
        let metrics = folder(study).join("metrics.csv");
        let mut reader = csv::Reader::from_path(&metrics)
            .with_context(|| format!("reading {}", metrics.display()))?;
        let points: Vec<BTreeMap<String, String>> =
            reader.deserialize().collect::<Result<_, _>>()?;
        let cases = of(&all, study);
        ensure!(points.len() == cases.len(), "{}: {} rows", metrics.display(), points.len());
        for (case, point) in cases.into_iter().zip(points) {
            let mut row = measured(case, &point)?;
            (row.mode_frequency, row.mode_damping) = coupled_mode(case, &mut modes)?;
            rows.push(row);
        }
        eprintln!("{}: measured", study.name());
    }
    Ok(Dataset { rows })
}

fn measured(case: &Case, point: &BTreeMap<String, String>) -> Result<Row> {
    let value = |key: &str| point.get(key).with_context(|| format!("metrics.csv has no {key}"));
    let mut row = Row {
        study: case.study.name().to_owned(),
        case: case.name.clone(),
        status: value("status")?.clone(),
        reached: value("reached")?.parse().unwrap_or(0.0),
        ..Row::default()
    };
    row.reached = six(row.reached);
    let run = value("run")?;
    let place = folder(case.study).join("signals").join(format!("run={run}"));
    let signals = place.join("signals.parquet");
    if !signals.exists() {
        // a run that could not start has none
        return Ok(row);
    }
    let table = Table::read_parquet(&signals)?;
    row.measure(&table, spectra_of(case))?;
    Ok(row)
}

/// The span of time whose spectra count, of a crossing. The chirp passes the girder's first frequency at 7 s, when the
/// train has come upon the first span.
fn spectra_of(case: &Case) -> Option<Range<f64>> {
    let crossing = case.name.contains("crossing");
    let start = if case.name.contains("chirp") { 0.0 } else { ON_THE_SPANS.start };
    crossing.then_some(start..ON_THE_SPANS.end)
}

/// The least damped coupled mode with much of the girder, of standstills under the chirp up to 30 s.
fn coupled_mode(
    case: &Case,
    known: &mut BTreeMap<String, (Option<f64>, Option<f64>)>,
) -> Result<(Option<f64>, Option<f64>)> {
    if !case.name.contains("standstill | force at 37.5 m | train at 37.5 m") {
        return Ok((None, None));
    }
    let scenario = match case.study {
        Study::Rigid | Study::Joints => "low-speed",
        Study::OneBearing => "low-speed-one-bearing",
        Study::TwoBearings => "low-speed-two-bearings",
    };
    let options = case.options();
    let key = format!("{scenario} {}", options.join(" "));
    if let Some(found) = known.get(&key) {
        return Ok(*found);
    }
    let modes = modes_with(scenario, &options)?;
    let mode = weakest_of(&modes);
    let found = (mode.map(|it| six(it.frequency)), mode.map(|it| six(it.damping)));
    known.insert(key, found);
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The committed tables of points, and the runs of the dataset, are those of the readings.
    #[test]
    fn golden_points_and_dataset_are_those_of_the_readings() {
        let all = cases();
        for study in Study::ALL {
            let kept = std::fs::read_to_string(file(study, "csv")).unwrap().replace("\r\n", "\n");
            assert!(kept == points(&all, study), "stale; run: cargo xtask readings");
        }
        let dataset = Dataset::committed().unwrap();
        let names = |it: &Case| (it.study.name().to_owned(), it.name.clone());
        let expected: Vec<_> =
            Study::ALL.iter().flat_map(|study| of(&all, *study)).map(names).collect();
        let rows = dataset.rows.iter().map(|it| (it.study.clone(), it.case.clone()));
        assert_eq!(rows.collect::<Vec<_>>(), expected);
        let text = std::fs::read_to_string(Dataset::file()).unwrap().replace("\r\n", "\n");
        assert_eq!(dataset.text().unwrap(), text);
        // a name belongs to one run
        let mut keys: Vec<_> = all.iter().map(names).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), all.len());
    }
}
