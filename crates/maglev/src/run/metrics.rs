//! Figures and limits of a run, from its recorded signals.
//!
//! They are computed from the complete table. So `maglev check` gives the same numbers later, and a resumed run the
//! same as one that was not stopped.

use std::collections::HashSet;
use std::path::Path;

use criteria::{Over, OverName, Verdict};
use master::Setup;
use report::RunEvidence;
use results::summary::RideQuality;
use results::{AS_RUN, ReadError, ScenarioAsRun, Table};

/// Judges the scenario's objectives and limits by the results in the folder.
///
/// # Errors
/// The table cannot be read.
pub(super) fn judge(
    setup: &Setup,
    folder: &Path,
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
    let table = Table::read_signals(folder, |name| wanted.contains(name))?.unwrap_or_default();
    let text = std::fs::read_to_string(folder.join(AS_RUN)).unwrap_or_default();
    let scenario = ScenarioAsRun::parse(text).ok();
    let units = columns.into_iter().filter_map(|column| Some((column.name, column.unit?)));
    let evidence = RunEvidence::new(&table, units.collect(), scenario.as_ref(), ride.cloned());
    Ok(criteria::judge(&metrics, &evidence))
}
