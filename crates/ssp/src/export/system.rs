//! What of a system SSP can say: values of instances, and connections with one source each.

use std::collections::HashMap;

use fmi2_import::description::Value;
use master::system::{InstanceIndex, Link, Port, System, VariableIndex};
use scenario::{Connection, Scenario, Setting};

/// A link with the connection of the scenario that it belongs to.
pub(super) struct Wire<'s> {
    pub(super) link: &'s Link,
    pub(super) connection: &'s Connection,
    /// Number of sources that the input has.
    pub(super) sources: usize,
    /// Factor of this source, with that of the connection.
    pub(super) factor: f64,
}

/// All links in their order. An input belongs to one connection only.
pub(super) fn wires<'s>(scenario: &'s Scenario, system: &'s System) -> Vec<Wire<'s>> {
    let mut of_name: HashMap<String, &Connection> = HashMap::new();
    for connection in &scenario.connections {
        for target in connection.to.as_slice() {
            // a name that exists literally is not a pattern
            of_name.insert(target.clone(), connection);
            for name in patterns::expand(target).unwrap_or_default() {
                of_name.insert(name, connection);
            }
        }
    }
    let mut counts: HashMap<Port, usize> = HashMap::new();
    for link in &system.links {
        *counts.entry(link.to).or_default() += 1;
    }
    let mut seen: HashMap<Port, usize> = HashMap::new();
    let wire = |link: &'s Link| {
        let connection = *of_name.get(&system.port_name(link.to))?;
        let term = seen.entry(link.to).or_default();
        let (_, factor) = connection.from.terms().nth(*term)?;
        *term += 1;
        let factor = factor * connection.factor.unwrap_or(1.0);
        Some(Wire { link, connection, sources: counts[&link.to], factor })
    };
    system.links.iter().filter_map(wire).collect()
}

/// The values that the scenario and `--set` give an instance: parameters, and start values of inputs.
pub(super) fn values(
    system: &System,
    index: InstanceIndex,
) -> impl Iterator<Item = (VariableIndex, &Value)> {
    let instance = &system.instances[index];
    // the system completes inputs without a source by their own start values
    let inputs = instance.inputs.iter().filter(move |(variable, value)| {
        instance.description().variables[**variable].start.as_ref() != Some(*value)
    });
    instance.parameters.iter().chain(inputs).map(|(variable, value)| (*variable, value))
}

/// The variables of an instance whose value is the path of a file.
pub(super) fn files<'s>(
    scenario: &'s Scenario,
    system: &System,
    index: InstanceIndex,
) -> Vec<(&'static str, VariableIndex, &'s std::path::Path)> {
    let instance = &system.instances[index];
    let covers = |pattern: &String| {
        *pattern == instance.name
            || patterns::expand(pattern).is_ok_and(|names| names.contains(&instance.name))
    };
    let mut found = Vec::new();
    for (_, settings) in scenario.instances.iter().filter(|(pattern, _)| covers(pattern)) {
        for (list, values) in [("parameters", &settings.parameters), ("start", &settings.start)] {
            for (pattern, setting) in values {
                let Setting::File(file) = setting else { continue };
                let names = patterns::expand(pattern).unwrap_or_default();
                for name in std::iter::once(pattern).chain(&names) {
                    let Some(variable) = instance.find(name) else { continue };
                    let overridden = system
                        .overridden
                        .iter()
                        .any(|it| it.port.instance == index && it.port.variable == variable);
                    if !overridden && !found.iter().any(|(_, it, _)| *it == variable) {
                        found.push((list, variable, file.path.as_path()));
                    }
                }
            }
        }
    }
    found
}
