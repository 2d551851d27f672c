//! Ride quality of a run, from its recorded accelerations.
//!
//! It is computed from the complete table. A resumed run therefore gives the same numbers as one that was
//! not stopped, and anybody can compute them again from the recorded signals.

use std::collections::{HashMap, HashSet};

use analysis::ride::sperling::{self, Direction};
use analysis::ride::{Exposure, Weighting, comfort, iso2631};
use analysis::series;
use indexmap::IndexMap;
use results::summary::{DirectionQuality, PointQuality, RideQuality};
use thiserror::Error;

use master::Setup;
use master::system::Port;
use results::{ReadError, Table};

use crate::Signals;
use scenario::{RidePoint, VerticalWeighting};

/// The shortest time that is judged (s): frequencies of 0.5 Hz need a mean over several periods.
const SHORTEST: f64 = 5.0;

/// Exponents of kg, m, s, … in the unit of an acceleration.
const ACCELERATION: [i32; 8] = [0, 1, -2, 0, 0, 0, 0, 0];

/// Why ride quality in a direction cannot be computed.
#[derive(Debug, Error)]
enum RideError {
    #[error("{0} is not recorded: add it to record.signals")]
    NotRecorded(String),
    #[error("{0} is not an acceleration: its unit is {1}")]
    Unit(String, String),
    #[error("signals are recorded every {0} s: set record.interval to 0.0055 s or less")]
    Coarse(f64),
    #[error("only {0:.3} s are in its time span, and {SHORTEST} s are needed")]
    Short(f64),
    #[error("{0} is {1} at {2} s")]
    NotFinite(String, f64, f64),
    #[error("{0}: {1}")]
    Analysis(String, #[source] analysis::Error),
    #[error("{0} is a String, not an acceleration")]
    Text(String),
    #[error(transparent)]
    Table(#[from] ReadError),
    #[error("the results contain no table")]
    NoTable,
}

/// A recorded signal.
#[derive(Default)]
struct RideSignal {
    times: Vec<f64>,
    values: Vec<f64>,
}

/// Judges the scenario's points by recorded signals. `None` if the scenario has no points.
#[must_use]
pub fn judge(setup: &Setup, signals: Signals<'_>) -> Option<RideQuality> {
    let points = &setup.scenario().ride_quality;
    if points.is_empty() {
        return None;
    }
    let recorded = RecordedSignals::read(setup, signals);
    let units = [
        ("weighted_rms", "m/s2"),
        ("maximum_transient", "m/s2"),
        ("vibration_dose", "m/s1.75"),
        ("weighted_peak", "m/s2"),
        ("crest_factor", "1"),
        ("sperling_index", "1"),
        ("vibration_total", "m/s2"),
    ];
    Some(RideQuality {
        units: units.map(|(name, unit)| (name.to_owned(), unit.to_owned())).into_iter().collect(),
        points: points.iter().map(|point| recorded.judge(point)).collect(),
    })
}

/// Why points are not judged, one line per reason.
#[must_use]
pub fn notes(quality: &RideQuality) -> Vec<String> {
    let mut reasons: IndexMap<&str, Vec<&str>> = IndexMap::new();
    for point in &quality.points {
        for warning in &point.warnings {
            reasons.entry(warning).or_default().push(&point.name);
        }
    }
    let note = |(reason, points): (&str, Vec<&str>)| match points.as_slice() {
        [point] => format!("ride quality is not judged at {point}: {reason}"),
        _ => format!("ride quality is not judged at {} points: {reason}", points.len()),
    };
    reasons.into_iter().map(note).collect()
}

/// The signals that the points name.
struct RecordedSignals {
    /// recorded accelerations by name
    series: HashMap<String, RideSignal>,
    /// by name, why a signal cannot be judged
    missing: HashMap<String, String>,
}

impl RecordedSignals {
    fn read(setup: &Setup, recorded_signals: Signals<'_>) -> Self {
        let mut recorded = Self { series: HashMap::new(), missing: HashMap::new() };
        let columns = setup.selection().columns(setup.system());
        let mut wanted = HashSet::new();
        for signal in setup.scenario().ride_quality.iter().flat_map(signals).flatten() {
            let place = columns.iter().position(|column| column.name == *signal);
            let unit = place.and_then(|k| other_unit(setup, setup.selection().ports[k]));
            let error = match (place, unit) {
                (Some(k), _) if columns[k].is_text => RideError::Text(signal.clone()),
                (Some(_), Some(unit)) => RideError::Unit(signal.clone(), unit),
                (None, _) => RideError::NotRecorded(signal.clone()),
                (Some(_), None) => {
                    wanted.insert(signal.as_str());
                    continue;
                }
            };
            recorded.missing.insert(signal.clone(), error.to_string());
        }
        let table = recorded_signals.table(|name| wanted.contains(name));
        match table.map_err(RideError::from).and_then(|it| it.ok_or(RideError::NoTable)) {
            Ok(table) => recorded.take(&table, |name| wanted.contains(name)),
            Err(error) => {
                let text = results::causes(&error).join(": ");
                let missing = wanted.into_iter().map(|name| (name.to_owned(), text.clone()));
                recorded.missing.extend(missing);
            }
        }
        recorded
    }

    fn take(&mut self, table: &Table, wanted: impl Fn(&str) -> bool) {
        for (k, name) in table.names.iter().enumerate().filter(|(_, name)| wanted(name)) {
            let (times, values) = table.samples(k);
            let (times, values) = series::without_early_end(&times, &values);
            let (times, values) = (times.to_vec(), values.to_vec());
            self.series.insert(name.clone(), RideSignal { times, values });
        }
    }

    fn judge(&self, point: &RidePoint) -> PointQuality {
        let vertical = match point.vertical_weighting {
            VerticalWeighting::Wk => Weighting::Wk,
            VerticalWeighting::Wb => Weighting::Wb,
        };
        let ways = [
            (vertical, Direction::Vertical),
            (Weighting::Wd, Direction::Horizontal),
            (Weighting::Wd, Direction::Horizontal),
        ];
        let mut warnings = Vec::new();
        let mut judged = signals(point).into_iter().zip(ways).map(|(signal, way)| {
            let signal = signal.as_ref()?;
            let result = match self.series.get(signal) {
                Some(series) => series.judge(signal, way, point).map_err(|e| e.to_string()),
                None => Err(self.missing.get(signal).cloned().unwrap_or_default()),
            };
            result.map_err(|text| warnings.push(text)).ok()
        });
        let [vertical, lateral, longitudinal] = [(); 3].map(|()| judged.next().flatten());
        let rms =
            [&vertical, &lateral, &longitudinal].map(|it| it.as_ref().map(|q| q.weighted_rms));
        warnings.dedup();
        let total = warnings.is_empty().then(|| iso2631::total(rms.into_iter().flatten()));
        PointQuality {
            name: point.name.clone(),
            vertical,
            lateral,
            longitudinal,
            vibration_total: total,
            comfort: total
                .map(comfort)
                .unwrap_or_default()
                .into_iter()
                .map(str::to_owned)
                .collect(),
            warnings,
        }
    }
}

/// The signals of a point: vertical, lateral, longitudinal.
fn signals(point: &RidePoint) -> [&Option<String>; 3] {
    [&point.vertical, &point.lateral, &point.longitudinal]
}

/// The unit of a signal, if it is defined and not one of acceleration.
fn other_unit(setup: &Setup, port: Port) -> Option<String> {
    let description = setup.system().instances[port.instance].description();
    let unit = description.unit_of(port.variable.0)?;
    let base = unit.base.as_ref()?;
    (base.exponents != ACCELERATION).then(|| unit.name.clone())
}

impl RideSignal {
    fn judge(
        &self,
        signal: &str,
        (weighting, direction): (Weighting, Direction),
        point: &RidePoint,
    ) -> Result<DirectionQuality, RideError> {
        let failed = |error| RideError::Analysis(signal.to_owned(), error);
        if let Some(k) = self.values.iter().position(|value| !value.is_finite()) {
            return Err(RideError::NotFinite(signal.to_owned(), self.values[k], self.times[k]));
        }
        let rate = series::rate(&self.times).map_err(failed)?;
        let weighted = weighting.apply(&self.values, rate).map_err(|error| match error {
            analysis::Error::Setting { .. } => RideError::Coarse(1.0 / rate),
            _ => failed(error),
        })?;
        let felt = direction.apply(&self.values, rate).map_err(failed)?;
        // a hundredth of an interval, for times that were rounded when printed
        let slack = 0.01 / rate;
        let from = point.from.map_or(0, |t| self.times.partition_point(|at| *at < t - slack));
        let to = point
            .to
            .map_or(self.times.len(), |t| self.times.partition_point(|at| *at <= t + slack));
        let seconds = to.saturating_sub(from) as f64 / rate;
        if seconds < SHORTEST {
            return Err(RideError::Short(seconds));
        }
        let exposure = Exposure::of(&weighted[from..to], rate).map_err(failed)?;
        let index = sperling::index(&felt[from..to]);
        Ok(DirectionQuality {
            signal: signal.to_owned(),
            weighting: weighting.name().to_owned(),
            from: self.times[from],
            to: self.times[to - 1],
            weighted_rms: exposure.rms,
            maximum_transient: exposure.transient,
            vibration_dose: exposure.dose,
            weighted_peak: exposure.peak,
            crest_factor: exposure.crest_factor(),
            sperling_index: index,
            sperling_comfort: sperling::comfort(index).to_owned(),
        })
    }
}
