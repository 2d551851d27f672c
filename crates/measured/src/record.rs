//! The columns of a record, in the units of the signals.

use std::path::PathBuf;

use fmi2_import::description::Conversion;
use serde::Serialize;
use sources::{column_names, read_column};

use crate::spec::name_and_unit;
use crate::{MappedColumn, MeasuredError, RecordSpec, Units};

/// Measured time series.
#[derive(Debug, Clone)]
pub struct Record {
    /// The file that they are from.
    pub file: PathBuf,
    /// One for each signal.
    pub columns: Vec<Column>,
}

/// One measured signal.
#[derive(Debug, Clone, Serialize)]
pub struct Column {
    /// The signal of the run, `instance.variable`.
    pub signal: String,
    /// Name of the column in the file.
    pub column: String,
    /// Unit of the signal and of `values`.
    pub unit: Option<String>,
    /// Unit in the file; `None` if nothing names it. Values are then taken as those in the signal's unit.
    pub file_unit: Option<String>,
    /// From the file's unit to that of the signal.
    pub conversion: Conversion,
    /// Times of the record (s), without any offset.
    #[serde(skip)]
    pub times: Vec<f64>,
    /// Values in the unit of the signal.
    #[serde(skip)]
    pub values: Vec<f64>,
}

impl Record {
    /// Reads the columns of a record for the signals of a run. `signals` are their names and units.
    ///
    /// # Errors
    /// The file cannot be read, a column or signal is missing, or units do not fit.
    pub fn load(
        spec: &RecordSpec,
        signals: &[(String, Option<String>)],
        units: &Units,
    ) -> Result<Self, MeasuredError> {
        let columns =
            if spec.columns.is_empty() { by_name(spec, signals)? } else { spec.columns.clone() };
        let scale = match name_and_unit(&spec.time).1 {
            None => 1.0,
            Some(unit) => {
                let converted = units.conversion(unit, "s");
                let column = spec.time.clone();
                let wrong = |source| MeasuredError::Unit {
                    path: spec.file.clone(),
                    column,
                    signal: "the time".to_owned(),
                    source,
                };
                converted.map_err(wrong)?.factor
            }
        };
        let mut found: Vec<Column> = Vec::new();
        for mapped in &columns {
            let MappedColumn { column, signal, .. } = mapped;
            let Some((_, unit)) = signals.iter().find(|(name, _)| name == signal) else {
                let names = signals.iter().map(|(name, _)| name.as_str());
                let suggestion = patterns::suggest(signal, names).map(str::to_owned);
                let (signal, column) = (signal.clone(), column.clone());
                return Err(MeasuredError::Signal { signal, column, suggestion });
            };
            if found.iter().any(|it| it.signal == *signal) {
                return Err(MeasuredError::Twice { signal: signal.clone() });
            }
            let suffix = name_and_unit(column).1.filter(|it| units.find(it).is_some());
            let file_unit = mapped.unit.clone().or_else(|| suffix.map(str::to_owned));
            let conversion =
                match &file_unit {
                    None => Conversion::IDENTITY,
                    Some(from) => units.conversion(from, unit.as_deref().unwrap_or("1")).map_err(
                        |source| MeasuredError::Unit {
                            path: spec.file.clone(),
                            column: column.clone(),
                            signal: signal.clone(),
                            source,
                        },
                    )?,
                };
            let (mut times, mut values) = read_column(&spec.file, &spec.time, column)?;
            times.iter_mut().for_each(|time| *time *= scale);
            for value in &mut values {
                *value = conversion.factor * *value + conversion.offset;
            }
            found.push(Column {
                signal: signal.clone(),
                column: column.clone(),
                unit: unit.clone(),
                file_unit,
                conversion,
                times,
                values,
            });
        }
        Ok(Self { file: spec.file.clone(), columns: found })
    }

    /// First and last time of all columns (s), without any offset.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        let firsts = self.columns.iter().filter_map(|it| it.times.first());
        let lasts = self.columns.iter().filter_map(|it| it.times.last());
        (
            firsts.copied().fold(f64::INFINITY, f64::min),
            lasts.copied().fold(f64::NEG_INFINITY, f64::max),
        )
    }
}

/// The columns whose names, without the unit in brackets, are those of signals.
fn by_name(
    spec: &RecordSpec,
    signals: &[(String, Option<String>)],
) -> Result<Vec<MappedColumn>, MeasuredError> {
    let names = column_names(&spec.file)?;
    let mapped = |column: &String| {
        let (name, _) = name_and_unit(column);
        let signal =
            signals.iter().map(|(signal, _)| signal).find(|it| *it == column || *it == name)?;
        Some(MappedColumn { column: column.clone(), signal: signal.clone(), unit: None })
    };
    let columns: Vec<MappedColumn> = names.iter().filter_map(mapped).collect();
    if columns.is_empty() {
        let path = spec.file.clone();
        return Err(MeasuredError::NothingMapped {
            path,
            columns: names.into_iter().take(20).collect(),
        });
    }
    Ok(columns)
}
