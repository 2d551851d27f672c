//! What SSP cannot say, for our annotation.

use std::collections::HashMap;

use master::system::{InstanceIndex, System, VariableIndex};
use scenario::{InstanceSettings, Scenario, Setting, SignalOverTime};
use serde_json::{Map, Value, json};

use super::Files;
use super::system::{Wire, files, wires};
use crate::SspError;

/// Members of a scenario that the description has, that do not matter, or that name files elsewhere.
const ELSEWHERE: [&str; 7] =
    ["$schema", "title", "description", "units", "instances", "connections", "trace"];

/// The part of a scenario that goes into the annotation.
pub(super) struct Rest {
    /// The text of the annotation.
    pub(super) text: String,
    /// Variables whose value is the path of a file.
    pub(super) files: HashMap<InstanceIndex, Vec<VariableIndex>>,
    pub(super) notes: Vec<String>,
}

impl Rest {
    pub(super) fn new(
        scenario: &Scenario,
        system: &System,
        archive: &mut Files,
    ) -> Result<Self, SspError> {
        let mut scenario = scenario.clone();
        let mut notes = Vec::new();
        for (k, input) in scenario.inputs.iter_mut().enumerate() {
            if let SignalOverTime::Csv(it) | SignalOverTime::Parquet(it) = &mut input.signal {
                it.file = archive.add_file(&it.file, &format!("inputs[{k}]"))?.into();
            }
        }
        for event in &scenario.events {
            if event.set.values().any(|it| matches!(it, Setting::File(_))) {
                let why =
                    "an event sets a variable to the path of a file, which an archive cannot keep";
                let what = format!("the event \"{}\"", event.name);
                return Err(SspError::Export { what, why: why.to_owned() });
            }
        }
        let (mut whole, default) = (members(&scenario), bare());
        for key in ELSEWHERE {
            whole.shift_remove(key);
        }
        let experiment = whole.get_mut("experiment").and_then(Value::as_object_mut);
        if let Some(experiment) = experiment {
            experiment.shift_remove("start");
            experiment.shift_remove("stop");
        }
        whole.retain(|key, value| key == "experiment" || default.get(key) != Some(value));
        if scenario.trace.is_some() {
            notes.push("the file for the trace is left out".to_owned());
        }

        let mut variables = HashMap::new();
        let instances = instances(&scenario, system, archive, &mut variables)?;
        if !instances.is_empty() {
            whole.insert("instances".to_owned(), instances.into());
        }
        let sums = sums(&wires(&scenario, system), system, &mut notes);
        if !sums.is_empty() {
            whole.insert("sums".to_owned(), sums.into());
        }
        let keys: Vec<&str> = whole.keys().map(String::as_str).collect();
        notes.insert(
            0,
            format!(
                "other tools do not see: {} (in the annotation {})",
                keys.join(", "),
                crate::ANNOTATION
            ),
        );
        let text = serde_json::to_string_pretty(&whole).unwrap_or_default();
        Ok(Self { text, files: variables, notes })
    }
}

/// The members of a scenario with nothing in it.
fn bare() -> Map<String, Value> {
    let experiment = json!({ "start": 0.0, "stop": 1.0, "step": 1.0 });
    let text = json!({ "units": {}, "instances": {}, "experiment": experiment });
    let scenario: Result<Scenario, _> = serde_json::from_value(text);
    scenario.map(|it| members(&it)).unwrap_or_default()
}

fn members(value: &impl serde::Serialize) -> Map<String, Value> {
    match serde_json::to_value(value) {
        Ok(Value::Object(members)) => members,
        _ => Map::new(),
    }
}

/// Settings of instances that are no values of variables, and values that are files.
fn instances(
    scenario: &Scenario,
    system: &System,
    archive: &mut Files,
    variables: &mut HashMap<InstanceIndex, Vec<VariableIndex>>,
) -> Result<Map<String, Value>, SspError> {
    let mut found = Map::new();
    for (pattern, settings) in &scenario.instances {
        let mut own = members(&InstanceSettings {
            parameters: indexmap::IndexMap::new(),
            start: indexmap::IndexMap::new(),
            ..settings.clone()
        });
        own.shift_remove("unit");
        for name in patterns::expand(pattern).unwrap_or_default() {
            let Some(index) = system.find(&name) else { continue };
            let mut own = own.clone();
            for (list, variable, path) in files(scenario, system, index) {
                let description = system.instances[index].description();
                let variable_name = &description.variables[variable].name;
                let place = format!("instances.{name}.{list}.{variable_name}");
                let file = archive.add_file(path, &place)?;
                let values = own.entry(list).or_insert_with(|| json!({}));
                values[variable_name.as_str()] = json!({ "path": file });
                variables.entry(index).or_default().push(variable);
            }
            if !own.is_empty() {
                found.insert(name, own.into());
            }
        }
    }
    Ok(found)
}

/// The connections with several sources, with the number of others before each.
fn sums(wires: &[Wire<'_>], system: &System, notes: &mut Vec<String>) -> Vec<Value> {
    let mut sums: Vec<Value> = Vec::new();
    let mut inputs: Vec<String> = Vec::new();
    let mut before = 0_usize;
    for wire in wires {
        if wire.sources == 1 {
            before += 1;
            continue;
        }
        let to = system.port_name(wire.link.to);
        if inputs.contains(&to) {
            continue;
        }
        let terms = wires.iter().filter(|it| it.link.to == wire.link.to);
        let terms: Vec<Value> = terms
            .zip(wire.connection.from.terms())
            .map(|(it, (_, factor))| {
                let signal = system.port_name(it.link.from);
                json!({ "signal": signal, "factor": factor })
            })
            .collect();
        let mut connection = members(wire.connection);
        connection.insert("from".to_owned(), terms.into());
        connection.insert("to".to_owned(), to.clone().into());
        sums.push(json!({ "after": before, "connection": connection }));
        inputs.push(to);
    }
    if let Some(first) = inputs.first() {
        let more = match inputs.len() - 1 {
            0 => String::new(),
            more => format!(" and {more} more inputs"),
        };
        notes.push(format!(
            "SSP has no sums: in other tools {first}{more} have no source, as each is the sum of several outputs"
        ));
    }
    sums
}
