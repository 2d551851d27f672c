//! Parameter bindings: which value each variable gets.

use fmi2_import::archive::FmuArchive;
use fmi2_import::description::{Causality, Type};
use indexmap::IndexMap;
use serde_json::Value;

use super::ports::{Course, Hop, Port, Ports};
use super::tables;
use super::tree::Child;
use crate::SspError;
use crate::files::{Files, xml_text};
use crate::read::{
    Base, Binding, Contents, Element, Linear, Number, ParameterMapping, ParameterSet,
    ParameterValue, Transformation,
};
use crate::xml::{At, SSM, SSV, document};

/// A value by the name of its variable.
pub(super) type Values = IndexMap<String, Value>;

/// The values of all components.
pub(super) struct Assigned<'p, 't, 'd> {
    ports: &'p Ports<'t, 'd>,
    files: &'p mut Files,
    /// Values of each component.
    pub(super) values: Vec<Values>,
    /// Remarks on values that set nothing.
    pub(super) notes: Vec<String>,
}

/// A value on its way to its variables.
#[derive(Clone)]
struct Given<'d> {
    /// File with the binding, for messages.
    file: &'d str,
    value: ParameterValue,
    /// What happens to it at its target.
    hop: Hop,
    /// Number of connections that it has passed.
    passed: usize,
}

impl<'p, 't, 'd> Assigned<'p, 't, 'd> {
    /// Applies all bindings. Those of an outer system replace those inside, and later ones replace earlier ones.
    pub(super) fn new(ports: &'p Ports<'t, 'd>, files: &'p mut Files) -> Result<Self, SspError> {
        let tree = ports.tree;
        let values = vec![Values::new(); tree.components.len()];
        let mut assigned = Self { ports, files, values, notes: Vec::new() };
        for (component, node) in tree.components.iter().enumerate() {
            for (k, binding) in node.element.bindings.iter().enumerate() {
                let place = format!("ParameterBinding {} of Component \"{}\"", k + 1, node.path);
                assigned.bind(Child::Component(component), binding, &place)?;
            }
        }
        for (system, node) in tree.systems.iter().enumerate().rev() {
            for (k, binding) in node.element.bindings.iter().enumerate() {
                let of = if node.path.is_empty() { &node.element.name } else { &node.path };
                let place = format!("ParameterBinding {} of System \"{of}\"", k + 1);
                assigned.bind(Child::System(system), binding, &place)?;
            }
        }
        Ok(assigned)
    }

    fn bind(&mut self, target: Child, binding: &Binding, place: &str) -> Result<(), SspError> {
        let tree = self.ports.tree;
        let own = tree.file(binding.origin);
        let definitions = &tree.origins[binding.origin].definitions;
        let set = match &binding.values {
            Contents::Inline(set) => set.clone(),
            Contents::File { uri, base } => {
                let (text, file) = self.text(target, binding.origin, uri, *base, place)?;
                document(&text, &file, (SSV, "ParameterSet"), |it| {
                    ParameterSet::read(it, &file, definitions)
                })?
            }
        };
        let mapping = match &binding.mapping {
            None => None,
            Some(Contents::Inline(mapping)) => Some(mapping.clone()),
            Some(Contents::File { uri, base }) => {
                let (text, file) = self.text(target, binding.origin, uri, *base, place)?;
                Some(document(&text, &file, (SSM, "ParameterMapping"), |it| {
                    ParameterMapping::read(it, &file)
                })?)
            }
        };
        let mut unmatched = Vec::new();
        for parameter in set.parameters {
            let name = format!("{}{}", binding.prefix, parameter.name);
            let Some(mapping) = &mapping else {
                let hop = Hop { linear: None, keeps_unit: false };
                let given = Given { file: own, value: parameter.value, hop, passed: 0 };
                if !self.set(target, &name, &given, place)? {
                    unmatched.push(name);
                }
                continue;
            };
            let entries = mapping.entries.iter().filter(|entry| entry.source == name);
            for entry in entries {
                let place = format!("{place}, MappingEntry to {}", entry.target);
                let at = At { file: own, place: &place };
                let (value, hop) = transformed(&parameter.value, &entry.transformation, at)?;
                let hop = Hop { keeps_unit: entry.keeps_unit, ..hop };
                let given = Given { file: own, value, hop, passed: 0 };
                if !self.set(target, &entry.target, &given, &place)? {
                    unmatched.push(entry.target.clone());
                }
            }
        }
        if let Some(first) = unmatched.first() {
            let more = match unmatched.len() - 1 {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            self.notes
                .push(format!("{place}: \"{first}\"{more} sets nothing, as nothing has that name"));
        }
        Ok(())
    }

    /// The text of the file that a binding names, and its name.
    fn text(
        &mut self,
        target: Child,
        origin: usize,
        uri: &str,
        base: Base,
        place: &str,
    ) -> Result<(String, String), SspError> {
        let tree = self.ports.tree;
        if base != Base::Component {
            let beside = if let Base::Inside(origin) = base { origin } else { origin };
            let file = self.files.resolve(&tree.origins[beside].file, uri, place)?;
            return Ok((self.files.text(&file, place)?, file.to_string()));
        }
        let Child::Component(component) = target else {
            let at = At { file: tree.file(origin), place };
            return Err(at.invalid("sourceBase=\"component\" has no meaning at a system"));
        };
        let unit = &tree.units[tree.components[component].unit];
        // inside the archive of the unit, whose root is the base
        let name = self.files.resolve_inside(uri, place)?;
        let file = format!("{}/{name}", unit.name);
        let failed = |source| SspError::Archive { path: unit.file.clone(), source };
        let mut archive = FmuArchive::open(&unit.file).map_err(failed)?;
        let bytes = archive
            .read(&name)
            .map_err(failed)?
            .ok_or_else(|| SspError::Missing { place: place.to_owned(), name: file.clone() })?;
        Ok((xml_text(bytes, &file)?, file))
    }

    /// Sets what a name stands for in a system or component. False if there is nothing of that name.
    fn set(
        &mut self,
        target: Child,
        name: &str,
        given: &Given<'d>,
        place: &str,
    ) -> Result<bool, SspError> {
        let tree = self.ports.tree;
        match target {
            Child::Component(component) => {
                if tree.description(component).find(name).is_none() {
                    return Ok(false);
                }
                self.reach(&Port::Component(component, name.to_owned()), given, place)
            }
            Child::System(system) => {
                // names need not be unique: a value is for all that have its name
                let node = &tree.systems[system];
                let mut reached = false;
                if node.element.connectors.iter().any(|it| it.name == name) {
                    reached = self.reach(&Port::System(system, name.to_owned()), given, place)?;
                }
                for child in node.element.elements.iter().map(Element::name) {
                    let rest = name.strip_prefix(child).and_then(|rest| rest.strip_prefix('.'));
                    if let (Some(rest), Some(&it)) = (rest, node.children.get(child)) {
                        reached |= self.set(it, rest, given, place)?;
                    }
                }
                Ok(reached)
            }
            Child::Dictionary(_) => Ok(false),
        }
    }

    /// Sets a connector and all that it is connected to. False if that reaches no variable.
    fn reach(&mut self, port: &Port, given: &Given<'d>, place: &str) -> Result<bool, SspError> {
        let unit = self.ports.unit(port);
        let mut given = given.clone();
        if let ParameterValue::Real(number) = &mut given.value {
            let linear = Linear { factor: 0.0, offset: number.value };
            let known = |(name, base)| (name, Some(base));
            let mut course = Course { linear, unit: number.unit.take().map(known) };
            course
                .pass(given.hop, unit)
                .map_err(|source| SspError::Conversion { place: place.to_owned(), source })?;
            number.value = course.linear.offset;
            number.unit = course.unit.and_then(|(name, base)| Some((name, base?)));
        }
        if let Port::Component(component, name) = port {
            let at = At { file: given.file, place };
            let value = self.setting(*component, name, &given.value, at)?;
            // the last value counts
            self.values[*component].shift_remove(name);
            self.values[*component].insert(name.clone(), value);
            return Ok(true);
        }
        let ports = self.ports;
        let mut reached = false;
        for edge in ports.onward(port) {
            let at = edge.at();
            if edge.hop.linear.is_some() && !matches!(given.value, ParameterValue::Real(_)) {
                return Err(at.invalid("LinearTransformation is for Reals only"));
            }
            if given.passed > ports.edges.len() {
                return Err(edge.cycle());
            }
            let value = match edge.table {
                None => given.value.clone(),
                Some(table) => tables::value(table, &given.value).ok_or_else(|| misfit(at))?,
            };
            let onward = Given { value, hop: edge.hop, passed: given.passed + 1, ..given };
            reached |= self.reach(&edge.to, &onward, place)?;
        }
        Ok(reached)
    }

    /// The value as a scenario has it, if it fits the type of the variable.
    fn setting(
        &self,
        component: usize,
        name: &str,
        value: &ParameterValue,
        at: At<'_>,
    ) -> Result<Value, SspError> {
        let description = self.ports.tree.description(component);
        let Some(index) = description.find(name) else { return Ok(Value::Null) };
        let kind = description.variables[index].kind;
        let wrong = |shown: &dyn std::fmt::Display| {
            at.invalid(format!("{shown} is not valid for {name}, which is of type {kind}"))
        };
        Ok(match (kind, value) {
            (Type::Real, ParameterValue::Real(it)) if it.value.is_finite() => it.value.into(),
            #[expect(clippy::cast_precision_loss, reason = "the variable is Real")]
            (Type::Real, ParameterValue::Integer(it)) => (*it as f64).into(),
            (Type::Integer | Type::Enumeration, ParameterValue::Integer(it)) => (*it).into(),
            (Type::Boolean, ParameterValue::Boolean(it)) => (*it).into(),
            (Type::String, ParameterValue::String(it)) => it.clone().into(),
            (Type::Enumeration, ParameterValue::Item(item, number)) => {
                let of_unit = description.enumeration_of(index);
                match (of_unit.is_some_and(|it| it.items.iter().any(|(i, _)| i == item)), number) {
                    (false, Some(number)) => (*number).into(),
                    _ => item.clone().into(),
                }
            }
            // an item of an enumeration that is an Integer in the unit
            (Type::Integer, ParameterValue::Item(_, Some(number))) => (*number).into(),
            (_, ParameterValue::Real(it)) => return Err(wrong(&it.value)),
            (_, ParameterValue::Integer(it)) => return Err(wrong(it)),
            (_, ParameterValue::Boolean(it)) => return Err(wrong(it)),
            (_, ParameterValue::String(it) | ParameterValue::Item(it, _)) => return Err(wrong(it)),
        })
    }

    /// The value that a component's variable has got, and whether it is a parameter.
    pub(super) fn is_parameter(&self, component: usize, name: &str) -> bool {
        let description = self.ports.tree.description(component);
        description
            .find(name)
            .is_some_and(|it| description.variables[it].causality == Causality::Parameter)
    }
}

/// A value after the transformation of a mapping entry. A linear one waits until the unit of measurement of the target is
/// known.
fn transformed(
    value: &ParameterValue,
    transformation: &Option<Transformation>,
    at: At<'_>,
) -> Result<(ParameterValue, Hop), SspError> {
    let mut hop = Hop { linear: None, keeps_unit: false };
    let value = match (transformation, value) {
        (None, value) => value.clone(),
        (Some(Transformation::Linear(linear)), ParameterValue::Real(_)) => {
            hop.linear = Some(*linear);
            value.clone()
        }
        #[expect(clippy::cast_precision_loss, reason = "a transformed integer is a Real")]
        (Some(Transformation::Linear(linear)), ParameterValue::Integer(it)) => {
            hop.linear = Some(*linear);
            ParameterValue::Real(Number { value: *it as f64, unit: None })
        }
        (Some(table), value) => tables::value(table, value).ok_or_else(|| misfit(at))?,
    };
    Ok((value, hop))
}

fn misfit(at: At<'_>) -> SspError {
    at.invalid("the transformation does not fit the type of the value")
}
