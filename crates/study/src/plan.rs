//! From a point to its scenario.

use std::path::{Path, PathBuf};

use fmi2_derive::Change;
use results::fingerprint;
use scenario::{Override, Scenario, Setting, SignalOverTime};
use serde_json::{Map, Value};

use crate::target::{EventTarget, KeyTarget, LayoutTarget};
use crate::{FactorValue, Point, Study, StudyError, StudyFile, Target};

/// The scenario of a point, with the step of all points if it was chosen.
///
/// # Errors
/// A target does not exist, or cannot have the value.
pub(crate) fn apply(study: &Study, point: &Point) -> Result<Scenario, StudyError> {
    let mut scenario = varied(study, point)?;
    if let Some(chosen) = study.chosen() {
        chosen.give(&mut scenario);
    }
    Ok(scenario)
}

/// The scenario of a point as its factors make it.
///
/// # Errors
/// A target does not exist, or cannot have the value.
pub(crate) fn varied(study: &Study, point: &Point) -> Result<Scenario, StudyError> {
    let mut scenario = study.base()?.clone();
    for ((name, factor), value) in study.file.factors.iter().zip(&point.values) {
        let value = match (factor.scale, value.number()) {
            (Some(scale), Some(number)) => FactorValue::Number(scale * number),
            (Some(_), None) => {
                let problem = format!("{value} is not a number, so \"scale\" cannot apply");
                return Err(wrong(study, name, problem));
            }
            (None, _) => value.clone(),
        };
        for target in factor.target.all() {
            let changed = match target {
                Target::Variable(target) => {
                    let change = Override { target: target.clone(), value: value.to_string() };
                    scenario.overrides.push(change);
                    Ok(())
                }
                Target::Layout(target) => layout(&mut scenario, target, &value),
                Target::Event(target) => event(&mut scenario, target, &value),
                Target::Key(target) => key(&mut scenario, target, &value),
            };
            changed.map_err(|problem| wrong(study, name, problem))?;
        }
    }
    Ok(scenario)
}

fn wrong(study: &Study, factor: &str, problem: String) -> StudyError {
    let at = format!("factors.{factor}.target");
    StudyError::Key { path: study.path.clone(), at, problem }
}

fn layout(
    scenario: &mut Scenario,
    target: &LayoutTarget,
    value: &FactorValue,
) -> Result<(), String> {
    let units: Vec<&str> = scenario.units.keys().map(String::as_str).collect();
    let known = units.join(", ");
    let Some(unit) = scenario.units.get_mut(&target.unit) else {
        return Err(format!("the scenario has no unit \"{}\"; it has {known}", target.unit));
    };
    let mut patch = json(value);
    let mut steps: Vec<&str> = target.key.split('.').collect();
    if steps.iter().any(|step| step.is_empty()) {
        return Err(format!("\"{}\" is not a path of keys with dots", target.key));
    }
    while let Some(step) = steps.pop() {
        patch = Value::Object(Map::from_iter([(step.to_owned(), patch)]));
    }
    if let Value::Object(patch) = patch {
        let changes = unit.resources.entry(target.file.clone()).or_default();
        changes.0.push(Change::Patch(patch));
    }
    Ok(())
}

fn event(scenario: &mut Scenario, target: &EventTarget, value: &FactorValue) -> Result<(), String> {
    let names: Vec<String> = scenario.events.iter().map(|it| it.name.clone()).collect();
    let Some(event) = scenario.events.iter_mut().find(|it| it.name == target.event) else {
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        return Err(format!(
            "the scenario has no event named \"{}\"; its events: {known}",
            target.event
        ));
    };
    match (&target.sets, value.number()) {
        (None, None) => Err(format!("{value} is not a time (s)")),
        (None, Some(_)) if event.when.is_some() => {
            Err(format!("the event \"{}\" has a condition, not a time", target.event))
        }
        (None, Some(time)) => {
            event.at = Some(time);
            Ok(())
        }
        (Some(variable), _) => {
            let known: Vec<&str> = event.set.keys().map(String::as_str).collect();
            let known = known.join(", ");
            let Some(setting) = event.set.get_mut(variable) else {
                return Err(format!(
                    "the event \"{}\" does not set \"{variable}\"; it sets {known}",
                    target.event
                ));
            };
            *setting = match value {
                FactorValue::Boolean(value) => Setting::Boolean(*value),
                FactorValue::Text(text) => Setting::Text(text.clone()),
                number => Setting::Number(number.number().unwrap_or(f64::NAN)),
            };
            Ok(())
        }
    }
}

fn key(scenario: &mut Scenario, target: &KeyTarget, value: &FactorValue) -> Result<(), String> {
    // a scenario is plain JSON, which always prints
    let mut whole = serde_json::to_value(&*scenario).unwrap_or_default();
    let mut place = &mut whole;
    for step in target.key.split('.') {
        place = match place {
            Value::Array(items) => {
                let count = items.len();
                let item = step.parse().ok().and_then(|k: usize| items.get_mut(k));
                item.ok_or_else(|| {
                    format!("\"{step}\" in \"{}\" is not a number below {count}", target.key)
                })?
            }
            Value::Object(map) => map.entry(step).or_insert(Value::Null),
            Value::Null => {
                *place = Value::Object(Map::from_iter([(step.to_owned(), Value::Null)]));
                &mut place[step]
            }
            other => return Err(format!("\"{step}\" in \"{}\" is within {other}", target.key)),
        };
    }
    *place = json(value);
    let (overrides, notes) =
        (std::mem::take(&mut scenario.overrides), std::mem::take(&mut scenario.notes));
    *scenario = serde_json::from_value(whole)
        .map_err(|error| format!("\"{}\" cannot be {value}: {error}", target.key))?;
    (scenario.overrides, scenario.notes) = (overrides, notes);
    Ok(())
}

fn json(value: &FactorValue) -> Value {
    match value {
        FactorValue::Boolean(value) => (*value).into(),
        FactorValue::Integer(value) => (*value).into(),
        FactorValue::Number(value) => (*value).into(),
        FactorValue::Text(value) => value.clone().into(),
    }
}

/// What all points depend on besides their values: the scenario, what is computed of it, the files that it names and
/// the version of this program.
pub(crate) fn identity(file: &StudyFile, base: &Scenario) -> Result<String, StudyError> {
    let mut scenario = base.clone();
    // words, and places of files, do not change results
    scenario.schema = None;
    (scenario.title, scenario.description) = (String::new(), String::new());
    let mut text = env!("CARGO_PKG_VERSION").to_owned();
    let mut add = |path: &Path| {
        let failed = |source| StudyError::Input { path: path.to_owned(), source };
        let print = fingerprint(path).map_err(failed)?;
        text += &format!("\n{} bytes, CRC-32 {:08x}", print.bytes, print.crc32);
        Ok(())
    };
    for unit in scenario.units.values_mut() {
        add(&unit.fmu)?;
        unit.fmu = PathBuf::new();
        for change in unit.resources.values_mut().flat_map(|it| &mut it.0) {
            if let Change::File(path) = change {
                add(path)?;
                *path = PathBuf::new();
            }
        }
    }
    for input in &mut scenario.inputs {
        if let SignalOverTime::Csv(csv) = &mut input.signal {
            add(&csv.file)?;
            csv.file = PathBuf::new();
        }
    }
    for instance in scenario.instances.values() {
        for setting in instance.parameters.values().chain(instance.start.values()) {
            if let Setting::File(it) = setting
                && it.path.is_file()
            {
                add(&it.path)?;
            }
        }
    }
    let overrides: Vec<String> = base.overrides.iter().map(ToString::to_string).collect();
    let shared = (&scenario, overrides, &file.keep.signals);
    // a scenario is plain JSON, which always prints
    text += &format!("\n{}", serde_json::to_string(&shared).unwrap_or_default());
    Ok(text)
}
