//! What a results folder shows of a run, for its verdicts.

use std::cell::OnceCell;

use criteria::{Evidence, Finding, Metric, Place, Quantity, Verdict};
use indexmap::IndexMap;
use results::modes::{CoupledMode, CoupledModes, Eigenvalue};
use results::summary::{DirectionQuality, RideQuality};
use results::{RunResults, ScenarioAsRun, Table};
use serde::Deserialize;
use serde_json::Value;

use crate::girders::Girders;
use crate::layout_fmu::LayoutFmu;
use crate::modes::GuidewayModes;
use crate::names;

/// Modes slower than this (Hz) are rigid motions whose eigenvalue is zero but for rounding.
const RIGID: f64 = 1e-6;

/// The results of a run, as evidence for verdicts.
pub struct RunEvidence<'a> {
    /// The recorded signals.
    pub table: &'a Table,
    /// Units of measure by signal.
    pub units: IndexMap<String, String>,
    /// The scenario of the run.
    pub scenario: Option<&'a ScenarioAsRun>,
    /// Ride quality, if the scenario has points.
    pub ride: Option<RideQuality>,
    /// Modes of the coupled system, if they were computed.
    pub modes: Option<&'a CoupledModes>,
    girders: OnceCell<Result<Girders, String>>,
}

impl<'a> RunEvidence<'a> {
    /// Evidence of a run whose results are not complete yet, without modes.
    #[must_use]
    pub fn new(
        table: &'a Table,
        units: IndexMap<String, String>,
        scenario: Option<&'a ScenarioAsRun>,
        ride: Option<RideQuality>,
    ) -> Self {
        Self { table, units, scenario, ride, modes: None, girders: OnceCell::new() }
    }

    /// Evidence of a run in its folder.
    #[must_use]
    pub fn of(run: &'a RunResults) -> Self {
        let unit = |(name, it): (&String, &results::summary::SignalSummary)| {
            Some((name.clone(), it.unit.clone()?))
        };
        let units = run.signals.iter().filter_map(unit).collect();
        let ride = run.summary.get("ride_quality");
        let ride = ride.and_then(|it| RideQuality::deserialize(it).ok());
        let new = Self::new(&run.table, units, run.scenario.as_ref(), ride);
        Self { modes: run.modes.as_ref(), ..new }
    }

    /// The spans, read when they are needed for the first time.
    pub(crate) fn girders(&self) -> Result<&Girders, String> {
        let read = || match self.scenario {
            Some(scenario) => Girders::of(scenario),
            None => Err(format!("{} is missing", results::AS_RUN)),
        };
        self.girders.get_or_init(read).as_ref().map_err(Clone::clone)
    }

    /// The guideway and the frequencies of its empty girders, if it can be read.
    pub(crate) fn guideway_modes(&self) -> Option<GuidewayModes> {
        let girders = self.girders().ok()?;
        let instance = girders.instance.clone();
        Some(GuidewayModes { instance, frequencies: girders.frequencies() })
    }

    /// The least damped mode among those that are more than a moving girder.
    fn least_damped(
        &self,
        eigenvalue: impl Fn(&CoupledMode) -> Option<Eigenvalue>,
    ) -> Result<Vec<Finding>, String> {
        let modes = self.modes.ok_or("modes.json is missing: run `maglev check --modes`")?;
        let girders = self.guideway_modes();
        let coupled = modes
            .modes
            .iter()
            .filter(|mode| !girders.as_ref().is_some_and(|girders| girders.is_empty_girder(mode)));
        let moving =
            coupled.filter_map(|mode| Some((mode, eigenvalue(mode)?))).filter(|(_, it)| {
                let grows = it.real > 0.0 && it.frequency_hz > RIGID;
                it.imaginary > 0.0 || grows
            });
        let least = moving.min_by(|a, b| a.1.damping_ratio.total_cmp(&b.1.damping_ratio));
        let (mode, it) = least.ok_or("no coupled mode oscillates")?;
        let part = |(name, share): (&String, &f64)| format!("{name} {:.0} %", 100.0 * share);
        let parts: Vec<String> = mode.participation.iter().take(3).map(part).collect();
        let missing: Vec<&str> =
            modes.apart.iter().filter(|it| it.entirely()).map(|it| it.instance.as_str()).collect();
        let detail =
            format!("{}; linearised at t = {} s", parts.join(", "), modes.operating_point.time);
        let place = format!("the mode at {:.4} Hz", it.frequency_hz);
        let caveat = match missing.as_slice() {
            [] => String::new(),
            names => format!(
                "{} is not coupled where modes.json was computed, so this does not cover it; compute the modes where it \
                 is, with `maglev modes --set ... --out DIR`",
                names.join(", ")
            ),
        };
        let mut finding = Finding::new(it.damping_ratio, place, detail);
        finding.caveat = caveat;
        Ok(vec![finding])
    }

    /// The points of ride quality, if all of them could be judged.
    fn ride(&self) -> Result<&RideQuality, String> {
        let ride = self.ride.as_ref().filter(|it| !it.points.is_empty());
        let ride = ride.ok_or("the scenario names no points under \"ride_quality\"")?;
        match ride.points.iter().find_map(|it| Some((it, it.warnings.first()?))) {
            Some((point, warning)) => Err(format!("{}: {warning}", point.name)),
            None => Ok(ride),
        }
    }
}

impl Evidence for RunEvidence<'_> {
    fn signals(&self) -> &[String] {
        &self.table.names
    }

    fn samples(&self, index: usize) -> (Vec<f64>, Vec<f64>) {
        self.table.samples(index)
    }

    fn unit(&self, signal: &str) -> Option<String> {
        self.units.get(signal).cloned()
    }

    fn span(&self, signal: &str) -> Result<Place, String> {
        self.girders()?.place(signal)
    }

    fn speed(&self) -> Result<f64, String> {
        let scenario = self.scenario.ok_or_else(|| format!("{} is missing", results::AS_RUN))?;
        let vehicle = LayoutFmu::find(scenario, names::VEHICLE_FILE)
            .map_err(|error| results::causes(&error).join(": "))?
            .ok_or("no unit of the run is a vehicle; give the speed in m/s as a number")?;
        if let Some(speeds) = self.table.column(&vehicle.variable(names::SPEED)) {
            // NaN in rows at which it is not due
            return Ok(speeds.iter().fold(0.0, |most, speed| speed.abs().max(most)));
        }
        if scenario.mentions(names::SPEED_CHANGE) {
            let (speed, change) = (vehicle.variable(names::SPEED), names::SPEED_CHANGE);
            return Err(format!("{speed} is not recorded, and {change} changes it"));
        }
        vehicle
            .parameter(names::TRAVEL_SPEED)
            .map(f64::abs)
            .ok_or_else(|| format!("{} is not recorded", vehicle.variable(names::SPEED)))
    }

    fn quantity(&self, quantity: Quantity) -> Result<Vec<Finding>, String> {
        match quantity {
            Quantity::FrequencyTimesSpan => {
                let girders = self.girders()?;
                let finding = |(number, girder): (usize, &crate::girders::Girder)| {
                    let (frequency, length) = (girder.frequency, girder.longest());
                    let place = format!("span {number} of {}", girders.instance);
                    let detail = format!("f1 = {frequency:.4} Hz, L = {length} m");
                    Finding::new(frequency * length, place, detail)
                };
                Ok(girders.kinds().into_iter().map(finding).collect())
            }
            Quantity::LeastDampingRatio => self.least_damped(|mode| Some(mode.continuous)),
            Quantity::LeastDampingRatioAsStepped => self.least_damped(|mode| mode.stepped),
            Quantity::VibrationTotal => {
                let points = self.ride()?.points.iter();
                let found = points.filter_map(|it| {
                    let comfort = it.comfort.join(" or ");
                    Some(Finding::new(it.vibration_total?, it.name.clone(), comfort))
                });
                Ok(found.collect())
            }
            Quantity::SperlingIndex => {
                let mut found = Vec::new();
                for point in &self.ride()?.points {
                    let directions = [&point.vertical, &point.lateral, &point.longitudinal];
                    found.extend(directions.into_iter().flatten().map(|it: &DirectionQuality| {
                        let place = format!("{}, {}", point.name, it.signal);
                        Finding::new(it.sperling_index, place, it.sperling_comfort.clone())
                    }));
                }
                Ok(found)
            }
        }
    }
}

/// The figures and limits of the scenario of a run.
///
/// # Errors
/// Their form is not that of this version.
pub fn own_metrics(run: &RunResults) -> serde_json::Result<IndexMap<String, Metric>> {
    let Some(scenario) = &run.scenario else { return Ok(IndexMap::new()) };
    let scenario: Value = serde_json::from_str(scenario.text())?;
    let mut metrics = IndexMap::new();
    for key in ["objectives", "limits"] {
        if let Some(list) = scenario.get(key) {
            metrics.extend(IndexMap::<String, Metric>::deserialize(list)?);
        }
    }
    Ok(metrics)
}

/// Judges a run by metrics.
#[must_use]
pub fn judge(run: &RunResults, metrics: &IndexMap<String, Metric>) -> Vec<Verdict> {
    criteria::judge(metrics, &RunEvidence::of(run))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(files: &[(&str, &str)]) -> (tempfile::TempDir, RunResults) {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let run = RunResults::read(folder.path()).unwrap();
        (folder, run)
    }

    fn one(run: &RunResults, metric: &str) -> Verdict {
        let metric = serde_json::from_str(metric).unwrap();
        judge(run, &IndexMap::from([("m".to_owned(), metric)])).remove(0)
    }

    /// Of a girder alone, a rigid motion, a decaying and a slightly growing mode the last one counts.
    #[test]
    fn analytic_the_least_damped_mode_is_found() {
        let mode = |real: f64, imaginary: f64, who: &str| {
            let size = f64::hypot(real, imaginary);
            let (hz, damping) = (size / std::f64::consts::TAU, -real / size);
            format!(
                r#"{{"continuous": {{"real": {real}, "imaginary": {imaginary}, "frequency_hz": {hz},
                "damping_ratio": {damping}}}, "stepped": null, "relative_error": null,
                "participation": {{"{who}": 1.0}}}}"#
            )
        };
        let list = [
            mode(1e-12, 0.0, "v"),
            mode(-1.0, 50.0, "v"),
            mode(0.5, 40.0, "v"),
            mode(-3.0, 0.0, "v"),
        ];
        let text = format!(
            r#"{{"algorithm": "jacobi", "modes": {{"modes": [{}],
            "apart": [{{"instance": "girder", "of": 1, "states": ["q"]}}]}}}}"#,
            list.join(",")
        );
        let (_folder, run) = run(&[("modes.json", &text), ("results.csv", "time,a.x\n0,1\n")]);
        let verdict = one(&run, r#"{"quantity": "least_damping_ratio", "min": 0, "source": "x"}"#);
        let expected = -0.5 / f64::hypot(0.5, 40.0);
        assert!((verdict.value.unwrap() - expected).abs() < 1e-15, "{verdict:?}");
        assert!(!verdict.passes() && verdict.place.contains("6.3667 Hz"), "{}", verdict.place);
        assert!(verdict.reason.contains("girder is not coupled"), "{}", verdict.reason);
        let stepped = one(&run, r#"{"quantity": "least_damping_ratio_as_stepped", "min": 0}"#);
        assert!(stepped.reason.contains("no coupled mode"), "{}", stepped.reason);
    }

    #[test]
    fn refusal_what_a_run_lacks_is_named() {
        let (_folder, run) = run(&[("results.csv", "time,a.x\n0,1\n")]);
        for (metric, part) in [
            (r#"{"quantity": "least_damping_ratio", "min": 0}"#, "maglev check --modes"),
            (r#"{"quantity": "vibration_total", "max": 1}"#, "\"ride_quality\""),
            (r#"{"quantity": "sperling_index", "max": 1}"#, "\"ride_quality\""),
            (
                r#"{"quantity": "frequency_times_span", "min": 1}"#,
                "scenario-as-run.json is missing",
            ),
            (
                r#"{"signal": "a.x", "figure": "max", "over": "speed", "max": 1}"#,
                "scenario-as-run.json is missing",
            ),
        ] {
            let verdict = one(&run, metric);
            assert!(verdict.reason.contains(part), "{}", verdict.reason);
        }
        assert!(own_metrics(&run).unwrap().is_empty());
    }
}
