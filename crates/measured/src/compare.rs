//! Figures of the difference between a record and a run.

use results::Table;
use serde::Serialize;

use crate::align::signal;
use crate::spectra::SpectraCompared;
use crate::{Alignment, Column, Interpolated, MeasuredError, Record};

/// Fewest common samples for a comparison.
const FEWEST: usize = 8;

/// A record beside a run.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// What the run is called.
    pub run: String,
    /// Path of the record.
    pub file: String,
    /// What was added to the record's times.
    pub alignment: Alignment,
    /// One for each signal.
    pub signals: Vec<SignalComparison>,
}

/// A measured signal beside that of the run. The difference is run minus record, at the times of the record.
#[derive(Debug, Clone, Serialize)]
pub struct SignalComparison {
    /// Where it is from.
    #[serde(flatten)]
    pub column: Column,
    /// Samples of the record within the run.
    pub samples: usize,
    /// Samples before or after the run, which are not compared.
    pub outside: usize,
    /// First compared time (s), in the run's time.
    pub from: f64,
    /// Last compared time (s).
    pub to: f64,
    /// Mean of the difference.
    pub mean_error: f64,
    /// Root mean square of the difference.
    pub rms_error: f64,
    /// `rms_error` over the standard deviation of the record. None if the record is constant.
    pub relative_rms_error: Option<f64>,
    /// The difference of the largest magnitude.
    pub peak_error: f64,
    /// Its time (s).
    pub time_of_peak_error: f64,
    /// Correlation coefficient of record and run. None if one of them is constant.
    pub correlation: Option<f64>,
    /// Largest distance of the record from its mean.
    pub peak_measured: f64,
    /// Largest distance of the run from its mean, at the same times.
    pub peak_run: f64,
    /// Over frequency.
    pub spectra: Option<SpectraCompared>,
    /// Why there are no spectra.
    pub spectra_error: Option<String>,
    /// Compared times (s), in the run's time.
    #[serde(skip)]
    pub times: Vec<f64>,
    /// The record there.
    #[serde(skip)]
    pub measured: Vec<f64>,
    /// The run there.
    #[serde(skip)]
    pub run: Vec<f64>,
}

/// Compares a record with a run, whose table has all its signals.
///
/// # Errors
/// A signal has fewer than 8 common samples.
pub fn compare(
    record: &Record,
    (name, run): (&str, &Table),
    alignment: Alignment,
) -> Result<Comparison, MeasuredError> {
    let signals = record.columns.iter().map(|column| one(record, column, run, alignment.offset));
    Ok(Comparison {
        run: name.to_owned(),
        file: record.file.display().to_string(),
        alignment,
        signals: signals.collect::<Result<_, _>>()?,
    })
}

fn one(
    record: &Record,
    column: &Column,
    run: &Table,
    offset: f64,
) -> Result<SignalComparison, MeasuredError> {
    let (times, values) = signal(run, &column.signal);
    let run = Interpolated::new(times, values)?;
    let all = column.times.iter().map(|time| time + offset).zip(column.values.iter().copied());
    let (times, measured): (Vec<f64>, Vec<f64>) = all.filter(|(time, _)| run.covers(*time)).unzip();
    let samples = times.len();
    if samples < FEWEST {
        let end = |time: Option<&f64>| time.map_or(f64::NAN, |it| it + offset);
        return Err(MeasuredError::NoOverlap {
            path: record.file.clone(),
            column: column.column.clone(),
            inside: samples,
            offset,
            from: end(column.times.first()),
            to: end(column.times.last()),
            start: run.start,
            stop: run.stop,
        });
    }
    let values: Vec<f64> = times.iter().map(|time| run.at(*time)).collect();
    let error: Vec<f64> = values.iter().zip(&measured).map(|(run, own)| run - own).collect();
    let count = samples as f64;
    let mean = |it: &[f64]| it.iter().sum::<f64>() / count;
    let (of_record, of_run) = (mean(&measured), mean(&values));
    let about =
        |it: &[f64], mean: f64| it.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / count;
    let (power, run_power) = (about(&measured, of_record), about(&values, of_run));
    let products = measured.iter().zip(&values).map(|(a, b)| (a - of_record) * (b - of_run));
    let covariance = products.sum::<f64>() / count;
    let farthest =
        |it: &[f64], mean: f64| it.iter().fold(0.0, |most: f64, it| most.max((it - mean).abs()));
    let worst =
        (0..samples).max_by(|&a, &b| error[a].abs().total_cmp(&error[b].abs())).unwrap_or(0);
    let rms_error = (error.iter().map(|it| it * it).sum::<f64>() / count).sqrt();
    let (spectra, spectra_error) = match SpectraCompared::new(&times, &measured, &values) {
        Ok(spectra) => (Some(spectra), None),
        Err(error) => (None, Some(error.to_string())),
    };
    Ok(SignalComparison {
        samples,
        outside: column.times.len() - samples,
        from: times[0],
        to: times[samples - 1],
        mean_error: of_run - of_record,
        rms_error,
        relative_rms_error: (power > 0.0).then(|| rms_error / power.sqrt()),
        peak_error: error[worst],
        time_of_peak_error: times[worst],
        correlation: (power * run_power > 0.0).then(|| covariance / (power * run_power).sqrt()),
        peak_measured: farthest(&measured, of_record),
        peak_run: farthest(&values, of_run),
        spectra,
        spectra_error,
        column: column.clone(),
        times,
        measured,
        run: values,
    })
}
