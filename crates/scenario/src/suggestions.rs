//! Values that the experiment leaves out, taken from the `DefaultExperiment` of the units.
//!
//! The longest span and the smallest step are taken, so that they suffice for every unit. A note names each value and
//! the file that it comes from.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::{Experiment, Scenario, ScenarioError};
use fmi2_import::description::{DefaultExperiment, ModelDescription};

/// Number of steps if neither the scenario nor the unit gives a step.
const STEPS: f64 = 500.0;

/// Times from the command line, which replace those of the file.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GivenTimes {
    /// Stop time (s).
    pub stop: Option<f64>,
    /// Communication step (s).
    pub step: Option<f64>,
}

/// Which members the experiment leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LeftOut {
    start: bool,
    stop: bool,
    step: bool,
}

impl LeftOut {
    /// Finds the members that the experiment leaves out, and puts zeros there until it is completed.
    pub(crate) fn fill(whole: &mut Value) -> Self {
        let Some(Value::Object(experiment)) = whole.get_mut("experiment") else {
            return Self { start: false, stop: false, step: false };
        };
        let mut lacks = |key: &str| {
            let lacks = !experiment.contains_key(key);
            if lacks {
                experiment.insert(key.to_owned(), Value::from(0.0));
            }
            lacks
        };
        Self { start: lacks("start"), stop: lacks("stop"), step: lacks("step") }
    }

    /// Completes the experiment. The paths of units must be relative to the working directory.
    pub(crate) fn complete(
        mut self,
        scenario: &mut Scenario,
        given: GivenTimes,
    ) -> Result<(), ScenarioError> {
        self.take(&mut scenario.experiment, given);
        if !self.stop && !self.step {
            return Ok(());
        }
        let mut units = Vec::new();
        for (name, unit) in &scenario.units {
            if scenario.instances.values().any(|instance| instance.unit == *name) {
                let described = fmi2_derive::describe(unit).map_err(|source| {
                    ScenarioError::Suggestions { name: name.clone(), source: Box::new(source) }
                })?;
                units.push((unit.fmu.clone(), described));
            }
        }
        let suggested = Suggested { units: &units };
        suggested.complete(self, &mut scenario.experiment, &mut scenario.notes)
    }

    /// Takes the given times; the other members remain left out.
    fn take(&mut self, experiment: &mut Experiment, given: GivenTimes) {
        if let Some(stop) = given.stop {
            experiment.stop = stop;
            self.stop = false;
        }
        if let Some(step) = given.step {
            experiment.step = step;
            self.step = false;
        }
        // a default start goes with a default stop only
        self.start &= self.stop;
    }
}

/// The units whose `DefaultExperiment` completes the experiment.
struct Suggested<'a> {
    units: &'a [(PathBuf, ModelDescription)],
}

/// An attribute of a `DefaultExperiment`.
type Attribute = fn(&DefaultExperiment) -> Option<f64>;

impl Suggested<'_> {
    /// The value that comes first in the order; adds a note with its origin.
    fn choose(
        &self,
        key: &str,
        attribute: Attribute,
        first: fn(f64, f64) -> bool,
        notes: &mut Vec<String>,
    ) -> Option<f64> {
        let values: Vec<(f64, &Path)> = self
            .units
            .iter()
            .filter_map(|(path, unit)| {
                let value = attribute(&unit.default_experiment)?;
                value.is_finite().then_some((value, path.as_path()))
            })
            .collect();
        let (mut value, mut path) = *values.first()?;
        for &(other, its) in &values {
            if first(other, value) {
                (value, path) = (other, its);
            }
        }
        let others = match values.iter().filter(|(other, _)| *other != value).count() {
            0 => "",
            _ => "; other units have other values",
        };
        notes.push(format!(
            "experiment.{key} is left out; using {value} s from the DefaultExperiment of {}{others}",
            path.display()
        ));
        Some(value)
    }

    fn complete(
        &self,
        left: LeftOut,
        experiment: &mut Experiment,
        notes: &mut Vec<String>,
    ) -> Result<(), ScenarioError> {
        let missing = |key, attribute| ScenarioError::NotSuggested { key, attribute };
        let less = |a: f64, b: f64| a < b;
        if left.start {
            experiment.start =
                self.choose("start", |it| it.start_time, less, notes).unwrap_or_default();
        }
        if left.stop {
            experiment.stop = self
                .choose("stop", |it| it.stop_time, |a, b| a > b, notes)
                .ok_or_else(|| missing("stop", "stopTime"))?;
        }
        if left.step {
            let positive: Attribute = |it| it.step_size.filter(|step| *step > 0.0);
            experiment.step = self
                .choose("step", positive, less, notes)
                .ok_or_else(|| missing("step", "stepSize"))?;
        }
        self.fit(left, experiment, notes);
        Ok(())
    }

    /// Makes the span a multiple of the step by changing a value that the user did not give: the step if all units can
    /// vary it, otherwise the stop time.
    fn fit(&self, left: LeftOut, experiment: &mut Experiment, notes: &mut Vec<String>) {
        let Experiment { start, stop, step, .. } = *experiment;
        let count = (stop - start) / step;
        if experiment.steps().is_ok() || !(count.is_finite() && count > 0.0) {
            return;
        }
        let vary = |(_, unit): &(PathBuf, ModelDescription)| {
            unit.co_simulation.can_handle_variable_communication_step_size
        };
        if left.step && (self.units.iter().all(vary) || count < 1.0) {
            experiment.step = (stop - start) / count.ceil();
            let text = "because stop - start must be a multiple of it";
            notes.push(format!("experiment.step is reduced to {} s, {text}", experiment.step));
        } else if left.stop && count >= 1.0 {
            experiment.stop = start + count.floor() * step;
            let text = "because stop - start must be a multiple of the step";
            notes.push(format!("experiment.stop is reduced to {} s, {text}", experiment.stop));
        }
    }
}

/// The experiment of a unit that runs alone: the given times, then those of its `DefaultExperiment`, then 1 s from 0 in
/// 500 steps. Also returns notes for the user.
pub(crate) fn alone(
    path: &Path,
    unit: &ModelDescription,
    given: GivenTimes,
) -> (Experiment, Vec<String>) {
    let (mut notes, mut left) = (Vec::new(), LeftOut { start: true, stop: true, step: true });
    let mut experiment = Experiment { start: 0.0, stop: 0.0, step: 0.0, tolerance: None };
    left.take(&mut experiment, given);
    let default = &unit.default_experiment;
    // the default start is used with a given stop too, if it is before that
    let begin = default.start_time.filter(|it| it.is_finite()).unwrap_or_default();
    if left.stop || begin < experiment.stop {
        experiment.start = begin;
    }
    if left.stop {
        let suggested = default.stop_time.filter(|stop| *stop > begin && stop.is_finite());
        experiment.stop = suggested.unwrap_or(begin + 1.0);
    }
    if left.step {
        let suggested = default.step_size.filter(|step| *step > 0.0 && step.is_finite());
        experiment.step = suggested.unwrap_or((experiment.stop - experiment.start) / STEPS);
    }
    let units = [(path.to_owned(), unit.clone())];
    Suggested { units: &units }.fit(left, &mut experiment, &mut notes);
    let Experiment { start, stop, step, .. } = experiment;
    notes.insert(
        0,
        format!("running this unit alone from {start} s to {stop} s in steps of {step} s"),
    );
    (experiment, notes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit with that DefaultExperiment that can vary its step or not.
    fn unit(attributes: &str, vary: bool) -> ModelDescription {
        ModelDescription::parse(&format!(
            r#"<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">
            <CoSimulation modelIdentifier="m" canHandleVariableCommunicationStepSize="{vary}"/>
            <DefaultExperiment {attributes}/><ModelVariables/><ModelStructure/>
            </fmiModelDescription>"#
        ))
        .unwrap()
    }

    fn span(attributes: &str, vary: bool, given: GivenTimes) -> [f64; 3] {
        let (it, notes) = alone(Path::new("u.fmu"), &unit(attributes, vary), given);
        assert!(!notes.is_empty());
        it.steps().unwrap();
        [it.start, it.stop, it.step]
    }

    #[test]
    fn analytic_a_unit_alone_runs_as_it_suggests() {
        let none = GivenTimes::default();
        let all = "startTime=\"1\" stopTime=\"3\" stepSize=\"0.25\"";
        assert_eq!(span(all, false, none), [1.0, 3.0, 0.25]);
        assert_eq!(span("stopTime=\"10\"", false, none), [0.0, 10.0, 0.02]);
        assert_eq!(span("", false, none), [0.0, 1.0, 0.002]);
        let stop = GivenTimes { stop: Some(2.0), step: None };
        assert_eq!(span(all, false, stop), [1.0, 2.0, 0.25]);
        let early = GivenTimes { stop: Some(0.5), step: None };
        assert_eq!(span(all, false, early), [0.0, 0.5, 0.25]);
    }

    /// A step of 0.3 s and a span of 1 s: 4 steps of 0.25 s for who can vary it, 3 of 0.3 s for others.
    #[test]
    fn analytic_suggestions_that_do_not_divide_are_fitted() {
        let odd = "stopTime=\"1\" stepSize=\"0.3\"";
        assert_eq!(span(odd, true, GivenTimes::default()), [0.0, 1.0, 0.25]);
        assert_eq!(span(odd, false, GivenTimes::default()), [0.0, 0.3 * 3.0, 0.3]);
        let given = GivenTimes { stop: None, step: Some(0.4) };
        assert_eq!(span(odd, true, given), [0.0, 0.8, 0.4]);
        // longer than the span
        assert_eq!(
            span("stopTime=\"1\" stepSize=\"7\"", false, GivenTimes::default()),
            [0.0, 1.0, 1.0]
        );
    }

    #[test]
    fn invariant_what_is_given_is_not_changed() {
        let odd = unit("stopTime=\"1\" stepSize=\"0.3\"", true);
        let given = GivenTimes { stop: Some(1.0), step: Some(0.3) };
        let (it, _) = alone(Path::new("u.fmu"), &odd, given);
        assert_eq!((it.stop, it.step), (1.0, 0.3));
        assert!(it.steps().is_err());
    }
}
