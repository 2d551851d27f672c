//! Connections between components, with all systems and dictionaries in between removed.

use fmi2_import::description::Causality;
use serde_json::{Map, Value, json};

use super::ports::{Course, Edge, Port, Ports};
use super::{outer_connectors, tables};
use crate::SspError;
use crate::annotation::Meaning;
use crate::read::{Kind, Linear};

/// What the connections of a description become.
pub(super) struct Links {
    /// Connections of the scenario.
    pub(super) connections: Vec<Value>,
    /// The signals behind the outputs of the outermost system, if it has any.
    pub(super) outputs: Option<Vec<String>>,
    pub(super) notes: Vec<String>,
}

impl Links {
    pub(super) fn new(ports: &Ports<'_, '_>) -> Result<Self, SspError> {
        let mut links = Self { connections: Vec::new(), outputs: None, notes: Vec::new() };
        let tree = ports.tree;
        let mut inputs: Vec<(&str, Vec<String>)> =
            outer_connectors(tree, Kind::Input).map(|(_, name)| (name, Vec::new())).collect();
        for edge in &ports.edges {
            let Port::Component(component, name) = &edge.to else { continue };
            let edges = ports.trace(&edge.to)?;
            let Some(origin) = edges.last().map(|it| &it.from) else { continue };
            let target = format!("{}.{name}", tree.components[*component].instance);
            match origin {
                Port::Component(source, output) => {
                    let at = edge.at();
                    let description = tree.description(*component);
                    let causality =
                        description.find(name).map(|it| description.variables[it].causality);
                    if causality != Some(Causality::Input) {
                        return Err(at.unsupported(format!(
                            "{target} is a parameter, which can have no source that changes"
                        )));
                    }
                    let source = format!("{}.{output}", tree.components[*source].instance);
                    links.connections.push(connection(ports, &edges, source, target)?);
                }
                Port::System(0, input) => {
                    if let Some((_, fed)) = inputs.iter_mut().find(|(name, _)| name == input) {
                        fed.push(target);
                    }
                }
                Port::System(system, input) => links.notes.push(format!(
                    "{target} is free: nothing is connected to {input} of the system {}",
                    tree.systems[*system].path
                )),
                Port::Signal(_, signal) => links.notes.push(format!(
                    "{target} is free: nothing feeds the signal {signal} of the dictionary"
                )),
            }
        }
        for (input, fed) in inputs.iter().filter(|(_, fed)| !fed.is_empty()) {
            links.notes.push(format!(
                "the input {input} of the system is {} in the scenario, which is free",
                fed.join(" and ")
            ));
        }
        let mut outputs = Vec::new();
        for (port, name) in outer_connectors(tree, Kind::Output) {
            let edges = ports.trace(&port)?;
            if let Some(Port::Component(component, output)) = edges.last().map(|it| &it.from) {
                let signal = format!("{}.{output}", tree.components[*component].instance);
                links
                    .notes
                    .push(format!("the output {name} of the system is recorded as {signal}"));
                if !outputs.contains(&signal) {
                    outputs.push(signal);
                }
            }
        }
        links.outputs = (!outputs.is_empty()).then_some(outputs);
        Ok(links)
    }
}

/// The connection of a scenario for a chain of connections, the last of which comes first.
fn connection(
    ports: &Ports<'_, '_>,
    edges: &[&Edge<'_>],
    from: String,
    to: String,
) -> Result<Value, SspError> {
    let mut connection = Map::new();
    connection.insert("from".to_owned(), from.into());
    connection.insert("to".to_owned(), to.into());
    let (Some(first), Some(last)) = (edges.last(), edges.first()) else {
        return Ok(connection.into());
    };
    // the master converts units of measurement by itself, if the connectors have those of their variables
    let plain = edges.iter().all(|it| it.hop.linear.is_none() && !it.hop.keeps_unit);
    let agree = ports.agrees(&first.from) && ports.agrees(&last.to);
    let (linear, keeps_unit) = match edges {
        [only] if agree => (only.hop.linear, only.hop.keeps_unit),
        _ if agree && plain => (None, false),
        // tables are for values without units of measurement
        _ if edges.iter().any(|it| it.table.is_some()) => (None, false),
        _ => (Some(along(ports, edges)?), true),
    };
    if let Some(table) = tables::along(ports, edges)? {
        connection.insert("map".to_owned(), table.into());
    }
    let linear = linear.unwrap_or(Linear { factor: 1.0, offset: 0.0 });
    for (key, value, default) in [("factor", linear.factor, 1.0), ("offset", linear.offset, 0.0)] {
        if value.to_bits() != f64::to_bits(default) {
            connection.insert(key.to_owned(), value.into());
        }
    }
    if keeps_unit {
        connection.insert("ignore_units".to_owned(), true.into());
    }
    for annotation in last.annotations {
        let Meaning::Ours(text) = &annotation.meaning else { continue };
        let at = last.at();
        let settings: Map<String, Value> = serde_json::from_str(text)
            .map_err(|error| at.invalid(format!("its annotation is not a JSON object: {error}")))?;
        for (key, value) in settings {
            if !["extrapolation", "kinks", "comment"].contains(&key.as_str()) {
                return Err(at.invalid(format!("its annotation has the unknown member \"{key}\"")));
            }
            connection.insert(key, value);
        }
    }
    Ok(json!(connection))
}

/// The linear map along a chain of connections.
fn along(ports: &Ports<'_, '_>, edges: &[&Edge<'_>]) -> Result<Linear, SspError> {
    let identity = Linear { factor: 1.0, offset: 0.0 };
    let first = edges.last().map(|it| &it.from);
    let mut course = Course { linear: identity, unit: first.and_then(|it| ports.unit(it)) };
    for edge in edges.iter().rev() {
        course
            .pass(edge.hop, ports.unit(&edge.to))
            .map_err(|source| SspError::Conversion { place: edge.place.clone(), source })?;
    }
    Ok(course.linear)
}
