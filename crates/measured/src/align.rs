//! The offset between the clock of a record and that of a run.

use analysis::compare::best_lag;
use results::Table;
use serde::Serialize;

use crate::{Interpolated, MeasuredError, Offset, Record};

/// Most samples of a signal for the search.
const MOST: f64 = 1_048_576.0;
/// The lowest correlation coefficient that counts as an alignment.
const LOWEST: f64 = 0.3;
/// Another maximum of the correlation that is this close to the best one makes the offset ambiguous.
const CLOSE: f64 = 0.05;

/// What is added to the times of a record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Alignment {
    /// Offset (s).
    pub offset: f64,
    /// How it was found; `None` if it was given.
    pub found: Option<Found>,
}

/// How an offset was found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Found {
    /// Correlation coefficient of record and run at the offset; the mean over all signals.
    pub correlation: f64,
    /// Another offset (s) at which they agree nearly as well, with its coefficient.
    pub ambiguous: Option<(f64, f64)>,
    /// Interval of the samples of the search (s).
    pub interval: f64,
}

/// The alignment of a record with a run, whose table has all its signals.
///
/// # Errors
/// The offset should be found, but the signals do not vary, are too short or do not agree anywhere.
pub fn align(record: &Record, run: &Table, offset: Offset) -> Result<Alignment, MeasuredError> {
    let Offset::Given(offset) = offset else { return find(record, run) };
    Ok(Alignment { offset, found: None })
}

fn find(record: &Record, run: &Table) -> Result<Alignment, MeasuredError> {
    let mut pairs = Vec::new();
    let (mut run_span, mut span) =
        ((f64::NEG_INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::INFINITY));
    let mut interval: f64 = 0.0;
    let within = |all: &mut (f64, f64), it: &Interpolated| {
        *all = (all.0.max(it.start), all.1.min(it.stop));
    };
    for column in &record.columns {
        let (times, values) = signal(run, &column.signal);
        interval = interval.max(spacing(&times)).max(spacing(&column.times));
        let pair = (
            Interpolated::new(times, values)?,
            Interpolated::new(column.times.clone(), column.values.clone())?,
        );
        within(&mut run_span, &pair.0);
        within(&mut span, &pair.1);
        pairs.push(pair);
    }
    let longest = (run_span.1 - run_span.0).max(span.1 - span.0);
    let interval = interval.max(longest / MOST);
    let sampled = |it: &Interpolated, (from, to): (f64, f64)| -> Vec<f64> {
        let count = (((to - from) / interval + 1e-9).floor().max(-1.0) + 1.0) as usize;
        (0..count).map(|k| it.at(from + k as f64 * interval)).collect()
    };
    let sampled: Vec<(Vec<f64>, Vec<f64>)> =
        pairs.iter().map(|(run, own)| (sampled(run, run_span), sampled(own, span))).collect();
    let slices: Vec<(&[f64], &[f64])> =
        sampled.iter().map(|(x, y)| (x.as_slice(), y.as_slice())).collect();
    let least = slices.first().map_or(0, |(x, y)| x.len().min(y.len()) / 2);
    let path = || record.file.clone();
    let lag = best_lag(&slices, least)
        .map_err(|source| MeasuredError::Offset { path: path(), source })?;
    let seconds = |samples: f64| run_span.0 + samples * interval - span.0;
    let (offset, correlation) = (seconds(lag.samples), lag.correlation);
    if correlation < LOWEST {
        return Err(MeasuredError::Unrelated { path: path(), correlation, offset });
    }
    let close = lag.runner_up.filter(|it| it.1 > correlation - CLOSE);
    let ambiguous = close.map(|(samples, coefficient)| (seconds(samples), coefficient));
    Ok(Alignment { offset, found: Some(Found { correlation, ambiguous, interval }) })
}

/// Times and values of a signal; of one that the table lacks, none.
pub(crate) fn signal(run: &Table, name: &str) -> (Vec<f64>, Vec<f64>) {
    run.names.iter().position(|it| it == name).map(|k| run.points(k)).unwrap_or_default()
}

/// The median distance of times.
pub(crate) fn spacing(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}
