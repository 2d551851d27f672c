//! Connectors and the connections between them, through all systems.

use std::collections::HashMap;

use fmi2_import::description::{BaseUnit, Causality, Conversion, UnitMismatch};

use super::tree::{Child, Tree};
use crate::SspError;
use crate::annotation::Annotation;
use crate::read::{Connection, Connector, End, Items, Kind, Linear, SignalType, Transformation};
use crate::xml::At;

/// A connector.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Port {
    /// A variable of a component's unit.
    Component(usize, String),
    System(usize, String),
    /// A signal of a dictionary.
    Signal(usize, String),
}

/// A connection, in the direction in which values pass.
pub(super) struct Edge<'d> {
    pub(super) from: Port,
    pub(super) to: Port,
    pub(super) hop: Hop,
    /// A mapping table.
    pub(super) table: Option<&'d Transformation>,
    /// For messages: file and element.
    pub(super) file: &'d str,
    pub(super) place: String,
    pub(super) annotations: &'d [Annotation],
}

impl Edge<'_> {
    /// Where it is, for messages.
    pub(super) fn at(&self) -> At<'_> {
        At { file: self.file, place: &self.place }
    }

    /// The connection is one of a cycle without a component, in which values have no origin.
    pub(super) fn cycle(&self) -> SspError {
        self.at().invalid("connections form a cycle without a component")
    }
}

/// What a connection does to values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hop {
    pub(super) linear: Option<Linear>,
    pub(super) keeps_unit: bool,
}

/// A unit of measurement: its name and definition.
pub(super) type UnitName = (String, Option<BaseUnit>);

/// All connections.
pub(super) struct Ports<'t, 'd> {
    pub(super) tree: &'t Tree<'d>,
    pub(super) edges: Vec<Edge<'d>>,
    /// The connection that ends at a port.
    into: HashMap<Port, usize>,
    /// The connections that begin at a port.
    from: HashMap<Port, Vec<usize>>,
}

/// Which way values pass at a connector, seen from the system that contains the connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Source,
    Sink,
    Either,
}

impl<'t, 'd> Ports<'t, 'd> {
    pub(super) fn new(tree: &'t Tree<'d>) -> Result<Self, SspError> {
        let mut ports =
            Self { tree, edges: Vec::new(), into: HashMap::new(), from: HashMap::new() };
        for (system, node) in tree.systems.iter().enumerate() {
            let file = tree.file(node.element.origin);
            for connection in &node.element.connections {
                let within = match node.path.as_str() {
                    "" => String::new(),
                    path => format!(" in {path}"),
                };
                let place =
                    format!("Connection from {} to {}{within}", connection.start, connection.end);
                ports.add(system, connection, place, file)?;
            }
        }
        Ok(ports)
    }

    fn add(
        &mut self,
        system: usize,
        connection: &'d Connection,
        place: String,
        file: &'d str,
    ) -> Result<(), SspError> {
        let at = At { file, place: &place };
        let (start, start_role) = self.end(system, &connection.start, at)?;
        let (end, end_role) = self.end(system, &connection.end, at)?;
        let backwards = start_role == Role::Sink && end_role != Role::Sink
            || end_role == Role::Source && start_role != Role::Source;
        if start_role == end_role && start_role != Role::Either {
            let both = if start_role == Role::Source { "sources" } else { "targets" };
            return Err(at.invalid(format!("both ends are {both} of values")));
        }
        let linear = match connection.transformation {
            Some(Transformation::Linear(linear)) => Some(linear),
            _ => None,
        };
        let table = connection.transformation.as_ref().filter(|_| linear.is_none());
        if backwards && connection.transformation.is_some() {
            return Err(at.invalid(
                "it begins at the target of values, so the direction of its transformation is unknown",
            ));
        }
        let (from, to) = if backwards { (end, start) } else { (start, end) };
        let index = self.edges.len();
        if let Some(first) = self.into.insert(to.clone(), index) {
            let first = &self.edges[first].place;
            return Err(at.invalid(format!("its target already has a source: {first}")));
        }
        self.from.entry(from.clone()).or_default().push(index);
        let hop = Hop { linear, keeps_unit: connection.keeps_unit };
        let annotations = &connection.annotations;
        self.edges.push(Edge { from, to, hop, table, file, place, annotations });
        Ok(())
    }

    /// The port at one end of a connection.
    fn end(&self, system: usize, end: &End, at: At<'_>) -> Result<(Port, Role), SspError> {
        let name = end.connector.clone();
        let node = &self.tree.systems[system];
        let Some(element) = &end.element else {
            // an input of the system is a source inside of it
            let role = match kind_of(&node.element.connectors, &name, at)? {
                Some(Kind::Input | Kind::Parameter) => Role::Source,
                Some(Kind::Output | Kind::Internal) => Role::Sink,
                Some(Kind::Other) => Role::Either,
                None => {
                    return Err(at.invalid(format!("this system has no connector \"{name}\"")));
                }
            };
            return Ok((Port::System(system, name), role));
        };
        let Some(child) = node.children.get(element.as_str()) else {
            return Err(at.invalid(format!("there is no element \"{element}\" in this system")));
        };
        match *child {
            Child::System(inner) => {
                let connectors = &self.tree.systems[inner].element.connectors;
                let role = match kind_of(connectors, &name, at)? {
                    Some(Kind::Input | Kind::Parameter) => Role::Sink,
                    Some(Kind::Output | Kind::Internal) => Role::Source,
                    Some(Kind::Other) => Role::Either,
                    None => {
                        return Err(at.invalid(format!(
                            "the system \"{element}\" has no connector \"{name}\""
                        )));
                    }
                };
                Ok((Port::System(inner, name), role))
            }
            Child::Dictionary(dictionary) => {
                match self.tree.dictionaries[dictionary].entries.get(&name) {
                    Some(Some(SignalType { refused: Some(why), .. })) => {
                        return Err(at.unsupported(format!("entry \"{name}\": {why}")));
                    }
                    Some(_) => {}
                    None => {
                        return Err(at.invalid(format!(
                            "the dictionary behind \"{element}\" has no entry \"{name}\""
                        )));
                    }
                }
                Ok((Port::Signal(dictionary, name), Role::Either))
            }
            Child::Component(component) => {
                kind_of(&self.tree.components[component].element.connectors, &name, at)?;
                let description = self.tree.description(component);
                let Some(variable) = description.find(&name) else {
                    return Err(
                        at.invalid(format!("the unit of \"{element}\" has no variable \"{name}\""))
                    );
                };
                let role = match description.variables[variable].causality {
                    Causality::Input | Causality::Parameter => Role::Sink,
                    _ => Role::Source,
                };
                Ok((Port::Component(component, name), role))
            }
        }
    }

    /// The connections from a port back to where its values come from, last one first.
    pub(super) fn trace(&self, port: &Port) -> Result<Vec<&Edge<'d>>, SspError> {
        let mut edges: Vec<&Edge<'d>> = Vec::new();
        let mut place = port;
        while let Some(&index) = self.into.get(place) {
            let edge = &self.edges[index];
            if edges.len() > self.edges.len() {
                return Err(edge.cycle());
            }
            edges.push(edge);
            place = &edge.from;
            if matches!(place, Port::Component(..)) {
                break;
            }
        }
        Ok(edges)
    }

    /// The connections that begin at a port.
    pub(super) fn onward(&self, port: &Port) -> impl Iterator<Item = &Edge<'d>> {
        self.from.get(port).into_iter().flatten().map(|&index| &self.edges[index])
    }

    /// The unit of measurement of a port, if it has one: that of its connector, otherwise that of the variable.
    pub(super) fn unit(&self, port: &Port) -> Option<UnitName> {
        let declared = |connectors: &[Connector], name: &str| {
            let found = connectors.iter().find(|it| it.name == name)?;
            found.signal.as_ref()?.unit.clone()
        };
        let known = |(name, base): (String, BaseUnit)| (name, Some(base));
        match port {
            Port::Component(component, name) => {
                let node = &self.tree.components[*component];
                declared(&node.element.connectors, name)
                    .map(known)
                    .or_else(|| self.own_unit(*component, name))
            }
            Port::System(system, name) => {
                declared(&self.tree.systems[*system].element.connectors, name).map(known)
            }
            Port::Signal(dictionary, name) => {
                let entry = self.tree.dictionaries[*dictionary].entries.get(name)?;
                entry.as_ref()?.unit.clone().map(known)
            }
        }
    }

    /// The items that the type of a component's connector has in the description.
    pub(super) fn items(&self, component: usize, name: &str) -> Option<&'d Items> {
        let connectors = &self.tree.components[component].element.connectors;
        connectors.iter().find(|it| it.name == name)?.signal.as_ref()?.items.as_ref()
    }

    /// The unit of measurement of a variable as its unit defines it.
    pub(super) fn own_unit(&self, component: usize, name: &str) -> Option<UnitName> {
        let description = self.tree.description(component);
        let index = description.find(name)?;
        let unit = description.variables[index].unit.clone()?;
        let base = description.unit_of(index).and_then(|it| it.base.clone());
        Some((unit, base))
    }

    /// Whether the unit of measurement of a component's connector means what the unit says itself.
    pub(super) fn agrees(&self, port: &Port) -> bool {
        let Port::Component(component, name) = port else { return false };
        match (self.unit(port), self.own_unit(*component, name)) {
            (Some((_, Some(a))), Some((_, Some(b)))) => a == b,
            (Some((a, _)), Some((b, _))) => a == b,
            (None, None) => true,
            _ => false,
        }
    }
}

/// The kind of a connector, if there is one and its type is supported.
fn kind_of(connectors: &[Connector], name: &str, at: At<'_>) -> Result<Option<Kind>, SspError> {
    let Some(it) = connectors.iter().find(|it| it.name == name) else { return Ok(None) };
    match it.signal.as_ref().and_then(|it| it.refused.as_deref()) {
        Some(why) => Err(at.unsupported(format!("connector \"{name}\": {why}"))),
        None => Ok(Some(it.kind)),
    }
}

/// A linear map on its way along connections, with the unit of measurement that its values have. A constant is a map
/// with the factor 0.
#[derive(Debug, Clone)]
pub(super) struct Course {
    pub(super) linear: Linear,
    pub(super) unit: Option<UnitName>,
}

impl Course {
    /// Passes a connection or a binding into a target with this unit of measurement: first the units are converted, then
    /// the values are transformed.
    pub(super) fn pass(&mut self, hop: Hop, target: Option<UnitName>) -> Result<(), UnitMismatch> {
        let Linear { factor, offset } = &mut self.linear;
        let mut apply = |a: f64, b: f64| {
            if (a, b) != (1.0, 0.0) {
                *factor *= a;
                *offset = a * *offset + b;
            }
        };
        if !hop.keeps_unit
            && let (Some((from, from_base)), Some((to, to_base))) = (&self.unit, &target)
        {
            let Conversion { factor, offset } =
                Conversion::between((from, from_base.as_ref()), (to, to_base.as_ref()))?;
            apply(factor, offset);
        }
        if let Some(it) = hop.linear {
            apply(it.factor, it.offset);
        }
        if target.is_some() {
            self.unit = target;
        } else if hop.keeps_unit {
            self.unit = None;
        }
        Ok(())
    }
}
