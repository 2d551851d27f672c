//! Figures and limits of a run, from its recorded signals.
//!
//! They are computed from the complete table. So `maglev check` gives the same numbers later, and a resumed run the
//! same as one that was not stopped.

use std::collections::HashSet;

use criteria::{Metric, Over, OverName, Verdict};
use master::Setup;
use report::RunEvidence;
use results::summary::RideQuality;
use results::{ReadError, ScenarioAsRun};

use crate::{Signals, as_run};

/// Judges the scenario's objectives and limits by recorded signals. `as_run` is the text of scenario-as-run.json, if it is
/// at hand.
///
/// # Errors
/// The table cannot be read.
pub fn judge(
    setup: &Setup,
    signals: Signals<'_>,
    as_run: Option<String>,
    ride: Option<&RideQuality>,
) -> Result<Vec<Verdict>, ReadError> {
    let metrics = setup.scenario().metrics();
    if metrics.is_empty() {
        return Ok(Vec::new());
    }
    let columns = setup.selection().columns(setup.system());
    let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
    let mut wanted: HashSet<&str> = HashSet::new();
    for metric in metrics.values() {
        let chosen = criteria::selected(metric.signal.as_deref().unwrap_or_default(), &names);
        wanted.extend(chosen.into_iter().map(|k| names[k].as_str()));
        if metric.over == Some(Over::Named(OverName::Speed)) {
            wanted.extend(names.iter().map(String::as_str).filter(|name| name.ends_with(".speed")));
        }
    }
    let table = signals.table(|name| wanted.contains(name))?.unwrap_or_default();
    // only these look at more than the table
    let looks =
        |metric: &Metric| matches!(metric.over, Some(Over::Named(_))) || metric.quantity.is_some();
    let scenario = metrics.values().any(looks).then(|| {
        let text = as_run.or_else(|| as_run::text(None, setup.scenario(), setup.system()).ok());
        text.and_then(|text| ScenarioAsRun::parse(text).ok())
    });
    let scenario = scenario.flatten();
    let units = columns.into_iter().filter_map(|column| Some((column.name, column.unit?)));
    let evidence = RunEvidence::new(&table, units.collect(), scenario.as_ref(), ride.cloned());
    Ok(criteria::judge(&metrics, &evidence))
}
