//! Where recorded signals are, and which of them a run needs.

use std::borrow::Cow;
use std::path::Path;

use criteria::{Over, OverName};
use master::Setup;
use results::{ReadError, Table};
use scenario::{Recorded, RecordedGroup};

/// The recorded signals of a run.
#[derive(Debug, Clone, Copy)]
pub enum Signals<'a> {
    /// In the table of a results folder.
    Folder(&'a Path),
    /// In memory.
    Table(&'a Table),
}

impl<'a> Signals<'a> {
    /// A table with at least the signals that `wanted` accepts. `None` if there is no table.
    pub(crate) fn table(
        self,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Option<Cow<'a, Table>>, ReadError> {
        match self {
            Self::Folder(folder) => Ok(Table::read_signals(folder, wanted)?.map(Cow::Owned)),
            Self::Table(table) => Ok(Some(Cow::Borrowed(table))),
        }
    }
}

/// The entries of `record.signals` that figures, limits and ride quality of a scenario need, and those that `keep`
/// names, each at the interval at which the scenario records it. The figures of a run that records only these are the
/// same.
#[must_use]
pub fn needed(setup: &Setup, keep: &[String]) -> Vec<Recorded> {
    let scenario = setup.scenario();
    let columns = setup.selection().columns(setup.system());
    let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
    let mut wanted = vec![false; names.len()];
    let metrics = scenario.metrics();
    let patterns = metrics.values().filter_map(|metric| metric.signal.as_ref()).chain(keep);
    for pattern in patterns {
        for k in criteria::selected(pattern, &names) {
            wanted[k] = true;
        }
    }
    let speed = metrics.values().any(|it| it.over == Some(Over::Named(OverName::Speed)));
    let felt: Vec<&String> = scenario
        .ride_quality
        .iter()
        .flat_map(|point| [&point.vertical, &point.lateral, &point.longitudinal])
        .flatten()
        .collect();
    let step = scenario.experiment.step;
    let usual = scenario.record.interval.unwrap_or(step);
    let mut entries = Vec::new();
    for (k, column) in columns.iter().enumerate() {
        let by_speed = speed && column.name.ends_with(".speed");
        if !(wanted[k] || by_speed || felt.contains(&&column.name)) {
            continue;
        }
        let interval = column.stride as f64 * step;
        let signal = column.name.clone();
        entries.push(if (interval - usual).abs() < 1e-9 * usual {
            Recorded::Signal(signal)
        } else {
            Recorded::Group(RecordedGroup { signals: vec![signal], interval })
        });
    }
    // what the scenario does not record itself
    let more = keep.iter().filter(|pattern| criteria::selected(pattern, &names).is_empty());
    entries.extend(more.cloned().map(Recorded::Signal));
    entries
}
