//! A record beside runs: the options that describe it, and what `maglev report` and `maglev fit` make of it.

use std::path::{Path, PathBuf};

use clap::Args;
use fmi2_import::archive::FmuArchive;
use fmi2_import::description::ModelDescription;
use measured::{Comparison, MapEntry, MeasuredError, Offset, Record, RecordSpec, Units};
use report::ReportError;
use report::section::Section;
use results::{MEASURED, RunResults, write_whole};

/// Options that describe a record.
#[derive(Args)]
pub struct RecordArguments {
    /// A column of the record and its signal [default: columns that have the name of a signal].
    #[arg(long, value_name = "COLUMN=INSTANCE.VARIABLE[:UNIT]")]
    map: Vec<MapEntry>,
    /// Column of the record with the times [default: time]; with a unit as in 't (ms)'.
    #[arg(long, value_name = "COLUMN")]
    time_column: Option<String>,
    /// Seconds to add to the times of the record, or "find": where record and run agree best [default: 0].
    #[arg(long, value_name = "SECONDS|find", allow_hyphen_values = true)]
    offset: Option<Offset>,
}

impl RecordArguments {
    /// Whether any option is given.
    pub fn is_given(&self) -> bool {
        !self.map.is_empty() || self.time_column.is_some() || self.offset.is_some()
    }

    /// The record that a file and the options describe.
    pub fn spec(&self, path: &Path) -> Result<RecordSpec, MeasuredError> {
        let mut spec = RecordSpec::read(path)?;
        if path != spec.file && (!self.map.is_empty() || self.time_column.is_some()) {
            let problem =
                "it names the columns, and so do --map and --time-column; give one of them"
                    .to_owned();
            return Err(MeasuredError::Spec { path: path.to_owned(), problem });
        }
        if !self.map.is_empty() {
            spec.columns = self.map.iter().map(|it| it.0.clone()).collect();
        }
        if let Some(time) = &self.time_column {
            spec.time.clone_from(time);
        }
        spec.offset = self.offset.unwrap_or(spec.offset);
        Ok(spec)
    }
}

/// A record beside runs.
pub struct Beside {
    pub record: Record,
    /// One for each run.
    pub comparisons: Vec<Comparison>,
}

/// Reads a record and compares it with runs. An offset that should be found is that of the first run, and holds for all.
pub fn beside(
    path: &Path,
    arguments: &RecordArguments,
    runs: &[RunResults],
) -> Result<Beside, MeasuredError> {
    let spec = arguments.spec(path)?;
    let Some(first) = runs.first() else {
        return Err(MeasuredError::NothingMapped { path: spec.file, columns: Vec::new() });
    };
    let unit = |name: &String| first.unit_of(name).map(str::to_owned);
    let signals: Vec<_> = first.table.names.iter().map(|name| (name.clone(), unit(name))).collect();
    let record = Record::load(&spec, &signals, &units(runs))?;
    let alignment = measured::align(&record, &first.table, spec.offset)?;
    let compared =
        runs.iter().map(|run| measured::compare(&record, (&run.name(), &run.table), alignment));
    let comparisons = compared.collect::<Result<Vec<_>, _>>()?;
    Ok(Beside { record, comparisons })
}

/// The units of measure that the units of runs define. Units that were removed since define none.
fn units(runs: &[RunResults]) -> Units {
    let instances = runs.iter().filter_map(|run| run.scenario.as_ref()).flat_map(|it| it.entries());
    let mut paths: Vec<PathBuf> = instances.map(|it| it.path).collect();
    paths.sort();
    paths.dedup();
    let description = |path: PathBuf| {
        let text = FmuArchive::open(&path).and_then(|mut it| it.description()).ok()?;
        ModelDescription::parse(&text).ok()
    };
    let descriptions: Vec<ModelDescription> = paths.into_iter().filter_map(description).collect();
    Units::defined_by(&descriptions)
}

impl Beside {
    /// The figures as lines.
    pub fn lines(&self) -> String {
        let several = self.comparisons.len() > 1;
        let mut rows = vec![
            [
                "signal",
                "run",
                "samples",
                "RMS difference",
                "relative",
                "peak difference",
                "at",
                "coherence",
            ]
            .map(str::to_owned)
            .to_vec(),
        ];
        for comparison in &self.comparisons {
            for it in &comparison.signals {
                let unit = it.column.unit.as_deref().unwrap_or("");
                let coherence = it.spectra.as_ref().map(|it| format!("{:.3}", it.mean_coherence));
                let relative = it.relative_rms_error.map(|it| format!("{:.2} %", 100.0 * it));
                rows.push(vec![
                    it.column.signal.clone(),
                    if several { comparison.run.clone() } else { String::new() },
                    it.samples.to_string(),
                    format!("{:.4e} {unit}", it.rms_error),
                    relative.unwrap_or_default(),
                    format!("{:.4e} {unit}", it.peak_error),
                    format!("{:.4} s", it.time_of_peak_error),
                    coherence.unwrap_or_default(),
                ]);
            }
        }
        let mut text = super::table::table(rows, &[2, 3, 4, 5, 6, 7]);
        if let Some(first) = self.comparisons.first() {
            let offset = first.alignment.offset;
            text += &match first.alignment.found {
                None if offset == 0.0 => String::new(),
                None => format!("offset of the record: {offset} s, as given\n"),
                Some(found) => format!(
                    "offset of the record: {offset:.6} s, found by cross-correlation (coefficient {:.4}){}\n",
                    found.correlation,
                    found.ambiguous.map_or(String::new(), |(other, coefficient)| format!(
                        "; AMBIGUOUS: {other:.6} s has {coefficient:.4}"
                    ))
                ),
            };
        }
        text
    }

    /// Writes the report of runs with the record beside them and further sections, and measured.json. Returns what was
    /// written.
    pub fn write(
        &self,
        mut runs: Vec<RunResults>,
        title: Option<&str>,
        mut sections: Vec<Section>,
        path: &Path,
    ) -> Result<Vec<PathBuf>, ReportError> {
        let offset = self.comparisons.first().map_or(0.0, |it| it.alignment.offset);
        let called = runs.first().map(RunResults::title);
        runs.push(measured::as_run(&self.record, offset));
        sections.push(measured::section(&self.comparisons));
        report::write_with(&runs, title.or(called.as_deref()), &sections, path)?;
        let data = path.with_file_name(MEASURED);
        // plain data, which always prints
        let text = serde_json::to_string(&self.comparisons).unwrap_or_default() + "\n";
        write_whole(&data, text.as_bytes())
            .map_err(|source| ReportError::Write { path: data.clone(), source })?;
        Ok(vec![path.to_owned(), data])
    }
}
