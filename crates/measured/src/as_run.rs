//! A record in the form of a run's results, so that a report draws it beside the runs.

use indexmap::IndexMap;
use results::summary::SignalSummary;
use results::{Gatherer, RunResults, Table};
use serde_json::json;

use crate::Record;

/// The record at the times of the run, as results that were measured.
#[must_use]
pub fn as_run(record: &Record, offset: f64) -> RunResults {
    let mut time: Vec<f64> =
        record.columns.iter().flat_map(|it| it.times.iter().map(|time| time + offset)).collect();
    time.sort_by(f64::total_cmp);
    time.dedup();
    let mut table = Table { time, ..Table::default() };
    let mut signals = IndexMap::new();
    for column in &record.columns {
        let mut values = vec![results::NOT_DUE; table.time.len()];
        let mut gatherer = Gatherer::default();
        for (own, value) in column.times.iter().zip(&column.values) {
            let at = table.time.partition_point(|time| *time < own + offset);
            if let Some(place) = values.get_mut(at) {
                *place = *value;
            }
            gatherer.take(own + offset, *value);
        }
        table.names.push(column.signal.clone());
        table.columns.push(values);
        let summary = SignalSummary {
            unit: column.unit.clone(),
            final_text: None,
            statistics: gatherer.statistics(),
            not_finite: 0,
        };
        signals.insert(column.signal.clone(), summary);
    }
    let name = record.file.file_name().map(|it| it.to_string_lossy().into_owned());
    let signal_values = serde_json::to_value(&signals).unwrap_or_default();
    RunResults {
        folder: record.file.clone(),
        summary: json!({
            "status": "measured",
            "title": name.unwrap_or_default(),
            "signals": signal_values,
        }),
        signals,
        scenario: None,
        modes: None,
        response: None,
        verdicts: Vec::new(),
        table,
    }
}
