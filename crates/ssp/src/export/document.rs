//! The description of a system (SSD) of a scenario.

use std::collections::{HashMap, HashSet};
use std::io;

use fmi2_import::description::{BaseUnit, Causality, Enumeration, Type, Value};
use indexmap::IndexMap;
use master::system::{InstanceIndex, Link, Port, System, Transfer, VariableIndex};
use scenario::Scenario;
use serde_json::{Map, Value as Json};

use super::SspVersion;
use super::rest::Rest;
use super::system::{Wire, values, wires};
use super::writer::{Printer, double, number, text as attribute};
use crate::SspError;
use crate::annotation::{NAMESPACE, OMSIMULATOR, OMSIMULATOR_NAMESPACE, OSP, OSP_NAMESPACE, TYPE};
use crate::import::unique;
use crate::xml::PREFIXES;

/// Name of all parameter sets: libcosim and ecos select the values of a run by this name.
const VALUES: &str = "initialValues";

/// What a description is made of.
pub(super) struct Parts<'a> {
    pub(super) scenario: &'a Scenario,
    pub(super) system: &'a System,
    /// Files of units by their keys.
    pub(super) units: &'a IndexMap<String, String>,
    pub(super) rest: &'a Rest,
    pub(super) version: SspVersion,
}

/// The text of the description, and the numbers of components and connections in it.
pub(super) fn text(parts: &Parts<'_>, name: &str) -> Result<(String, (usize, usize)), SspError> {
    let wires = wires(parts.scenario, parts.system);
    let wires: Vec<Wire<'_>> = wires.into_iter().filter(|wire| wire.sources == 1).collect();
    let mut writer = Writer { parts, definitions: Definitions::default() };
    let failed = |error: io::Error| SspError::Export {
        what: "the description".to_owned(),
        why: error.to_string(),
    };
    let text = writer.document(name, &wires).map_err(failed)?;
    Ok((text, (parts.system.instances.len(), wires.len())))
}

/// Units of measurement and enumerations of all units.
#[derive(Default)]
struct Definitions {
    units: IndexMap<String, BaseUnit>,
    enumerations: IndexMap<String, Vec<(String, i32)>>,
}

/// The name under which a definition is in a list, which may have another one of that name.
fn defined<T: PartialEq + Clone>(list: &mut IndexMap<String, T>, name: &str, value: &T) -> String {
    if list.get(name) == Some(value) {
        return name.to_owned();
    }
    let same = list.iter().find(|(key, it)| *it == value && key.starts_with(name));
    if let Some((key, _)) = same {
        return key.clone();
    }
    let key = unique(name.to_owned(), |key| list.contains_key(key));
    list.insert(key.clone(), value.clone());
    key
}

struct Writer<'p> {
    parts: &'p Parts<'p>,
    definitions: Definitions,
}

impl Writer<'_> {
    fn document(&mut self, name: &str, wires: &[Wire<'_>]) -> io::Result<String> {
        let Parts { scenario, system, rest, version, .. } = self.parts;
        let mut out = Printer::new()?;
        let title = if scenario.title.is_empty() { name } else { &scenario.title };
        let mut attributes = vec![
            ("version", attribute(version.as_str())),
            ("name", attribute(title)),
            ("generationTool", attribute(concat!("maglev ", env!("CARGO_PKG_VERSION")))),
        ];
        let spaces: Vec<String> =
            PREFIXES.iter().map(|(prefix, _)| format!("xmlns:{prefix}")).collect();
        for (key, (_, space)) in spaces.iter().zip(PREFIXES) {
            attributes.push((key, attribute(space)));
        }
        attributes.push(("xmlns:maglev", attribute(NAMESPACE)));
        attributes.push(("xmlns:oms", attribute(OMSIMULATOR_NAMESPACE)));
        attributes.push(("xmlns:osp", attribute(OSP_NAMESPACE)));
        out.open("ssd:SystemStructureDescription", &attributes)?;
        let description = &scenario.description;
        let description = (!description.is_empty()).then(|| description.clone());
        out.open("ssd:System", &[("name", attribute(name)), ("description", description)])?;
        if !system.instances.is_empty() {
            let used = used(wires);
            out.open("ssd:Elements", &[])?;
            for (index, _) in system.indexed() {
                self.component(&mut out, index, &used)?;
            }
            out.close("ssd:Elements")?;
        }
        if !wires.is_empty() {
            out.open("ssd:Connections", &[])?;
            for wire in wires {
                self.connection(&mut out, wire)?;
            }
            out.close("ssd:Connections")?;
        }
        let step = scenario.experiment.step;
        out.open("ssd:Annotations", &[])?;
        out.open("ssc:Annotation", &[("type", attribute(OMSIMULATOR))])?;
        out.open("oms:Annotations", &[])?;
        out.open("oms:SimulationInformation", &[])?;
        out.empty(
            "oms:FixedStepMaster",
            &[
                ("description", attribute("oms-ma")),
                ("stepSize", number(step)),
                ("relativeTolerance", number(scenario.experiment.tolerance.unwrap_or(1e-4))),
            ],
        )?;
        out.close("oms:SimulationInformation")?;
        out.close("oms:Annotations")?;
        out.close("ssc:Annotation")?;
        out.close("ssd:Annotations")?;
        out.close("ssd:System")?;
        self.definitions(&mut out)?;
        let times = [
            ("startTime", number(scenario.experiment.start)),
            ("stopTime", number(scenario.experiment.stop)),
        ];
        out.open("ssd:DefaultExperiment", &times)?;
        out.open("ssd:Annotations", &[])?;
        out.open("ssc:Annotation", &[("type", attribute(OSP))])?;
        out.open("osp:Algorithm", &[])?;
        out.empty("osp:FixedStepAlgorithm", &[("baseStepSize", number(step))])?;
        out.close("osp:Algorithm")?;
        out.close("ssc:Annotation")?;
        out.close("ssd:Annotations")?;
        out.close("ssd:DefaultExperiment")?;
        out.open("ssd:Annotations", &[])?;
        annotation(&mut out, &rest.text)?;
        out.close("ssd:Annotations")?;
        out.close("ssd:SystemStructureDescription")?;
        out.finish()
    }

    fn component(
        &mut self,
        out: &mut Printer,
        index: InstanceIndex,
        used: &HashMap<InstanceIndex, HashSet<VariableIndex>>,
    ) -> io::Result<()> {
        let Parts { system, units, rest, version, .. } = self.parts;
        let instance = &system.instances[index];
        let source = units.get(&instance.unit).cloned().unwrap_or_default();
        out.open(
            "ssd:Component",
            &[
                ("name", attribute(&*instance.name)),
                ("type", attribute("application/x-fmu-sharedlibrary")),
                ("source", attribute(source)),
                ("implementation", attribute("CoSimulation")),
            ],
        )?;
        let description = instance.description();
        let given: HashSet<VariableIndex> = values(system, index).map(|(it, _)| it).collect();
        let used = used.get(&index);
        let connectors: Vec<VariableIndex> = (0..description.variables.len())
            .map(VariableIndex)
            .filter(|it| {
                let variable = &description.variables[*it];
                let is_open = matches!(variable.causality, Causality::Input | Causality::Output);
                // libcosim does not read connectors of this type
                is_open && variable.kind != Type::Enumeration
                    || given.contains(it)
                    || used.is_some_and(|used| used.contains(it))
            })
            .collect();
        if !connectors.is_empty() {
            out.open("ssd:Connectors", &[])?;
            for variable in connectors {
                self.connector(out, index, variable)?;
            }
            out.close("ssd:Connectors")?;
        }
        let files = rest.files.get(&index);
        let values: Vec<_> = values(system, index)
            .filter(|(it, _)| !files.is_some_and(|files| files.contains(it)))
            .collect();
        if !values.is_empty() {
            let version = attribute(version.as_str());
            out.open("ssd:ParameterBindings", &[])?;
            out.open("ssd:ParameterBinding", &[])?;
            out.open("ssd:ParameterValues", &[])?;
            out.open("ssv:ParameterSet", &[("version", version), ("name", attribute(VALUES))])?;
            out.open("ssv:Parameters", &[])?;
            for (variable, value) in values {
                self.value(out, index, variable, value)?;
            }
            out.close("ssv:Parameters")?;
            out.close("ssv:ParameterSet")?;
            out.close("ssd:ParameterValues")?;
            out.close("ssd:ParameterBinding")?;
            out.close("ssd:ParameterBindings")?;
        }
        out.close("ssd:Component")
    }

    fn connector(
        &mut self,
        out: &mut Printer,
        index: InstanceIndex,
        variable: VariableIndex,
    ) -> io::Result<()> {
        let description = self.parts.system.instances[index].description();
        let it = &description.variables[variable];
        let kind = match it.causality {
            Causality::Input => "input",
            Causality::Output => "output",
            Causality::Parameter => "parameter",
            Causality::CalculatedParameter => "calculatedParameter",
            // 1.0 has no kind for these
            Causality::Local | Causality::Independent => "inout",
        };
        out.open("ssd:Connector", &[("name", attribute(&*it.name)), ("kind", attribute(kind))])?;
        let unit = description.unit_of(variable.0).and_then(|unit| {
            Some(defined(&mut self.definitions.units, &unit.name, unit.base.as_ref()?))
        });
        let enumeration = description
            .enumeration_of(variable.0)
            .map(|it| defined(&mut self.definitions.enumerations, &it.name, &it.items));
        match (it.kind, enumeration) {
            (Type::Real, _) => out.empty(&self.type_name("ssc", "Real"), &[("unit", unit)])?,
            (Type::Boolean, _) => out.empty("ssc:Boolean", &[])?,
            (Type::String, _) => out.empty("ssc:String", &[])?,
            (Type::Enumeration, Some(name)) => {
                out.empty("ssc:Enumeration", &[("name", Some(name))])?;
            }
            (Type::Integer | Type::Enumeration, _) => {
                out.empty(&self.type_name("ssc", "Integer"), &[])?;
            }
        }
        out.close("ssd:Connector")
    }

    /// The name of an element for a type: 2.0 names types by their sizes.
    fn type_name(&self, prefix: &str, name: &str) -> String {
        match (self.parts.version, name) {
            (SspVersion::V2, "Real") => format!("{prefix}:Float64"),
            (SspVersion::V2, "Integer") => format!("{prefix}:Int32"),
            _ => format!("{prefix}:{name}"),
        }
    }

    fn value(
        &self,
        out: &mut Printer,
        index: InstanceIndex,
        variable: VariableIndex,
        value: &Value,
    ) -> io::Result<()> {
        let description = self.parts.system.instances[index].description();
        let it = &description.variables[variable];
        out.open("ssv:Parameter", &[("name", attribute(&*it.name))])?;
        let plain = |name: String, text: String| (name, text);
        let (name, text) = match value {
            Value::Real(x) => plain(self.type_name("ssv", "Real"), double(*x)),
            Value::Boolean(x) => plain("ssv:Boolean".to_owned(), x.to_string()),
            Value::String(x) => plain("ssv:String".to_owned(), x.clone()),
            Value::Integer(x) => {
                let items = description.enumeration_of(variable.0);
                let item = items.and_then(|it| it.items.iter().find(|(_, value)| value == x));
                match item {
                    Some((item, _)) => plain("ssv:Enumeration".to_owned(), item.clone()),
                    None => plain(self.type_name("ssv", "Integer"), x.to_string()),
                }
            }
        };
        out.empty(&name, &[("value", Some(text))])?;
        out.close("ssv:Parameter")
    }

    fn connection(&self, out: &mut Printer, wire: &Wire<'_>) -> io::Result<()> {
        let system = self.parts.system;
        let (from, to) = (wire.link.from, wire.link.to);
        let keeps_unit = wire.connection.ignore_units.then(|| "true".to_owned());
        let attributes = [
            ("startElement", attribute(&*system.instances[from.instance].name)),
            ("startConnector", attribute(&*system.variable(from).name)),
            ("endElement", attribute(&*system.instances[to.instance].name)),
            ("endConnector", attribute(&*system.variable(to).name)),
            ("suppressUnitConversion", keeps_unit),
        ];
        let offset = wire.connection.offset.unwrap_or(0.0);
        let linear = wire.factor.to_bits() != 1.0_f64.to_bits() || offset != 0.0;
        let mut settings = Map::new();
        if let Some(degree) = wire.connection.extrapolation {
            settings.insert("extrapolation".to_owned(), degree.into());
        }
        if wire.connection.kinks {
            settings.insert("kinks".to_owned(), true.into());
        }
        let table = match &wire.link.transfer {
            Transfer::Table(pairs) => Some((pairs, false)),
            Transfer::Items(pairs) => Some((pairs, true)),
            _ => None,
        };
        let table = table.filter(|(pairs, _)| wire.connection.map.is_some() && !pairs.is_empty());
        if !linear && table.is_none() && settings.is_empty() {
            return out.empty("ssd:Connection", &attributes);
        }
        out.open("ssd:Connection", &attributes)?;
        if linear {
            let numbers = [("factor", number(wire.factor)), ("offset", number(offset))];
            out.empty("ssc:LinearTransformation", &numbers)?;
        }
        if let Some((pairs, to_items)) = table {
            self.table(out, wire.link, pairs, to_items)?;
        }
        if !settings.is_empty() {
            out.open("ssd:Annotations", &[])?;
            annotation(out, &Json::from(settings).to_string())?;
            out.close("ssd:Annotations")?;
        }
        out.close("ssd:Connection")
    }

    /// A mapping table: by the names of items if both ends have them.
    fn table(
        &self,
        out: &mut Printer,
        link: &Link,
        pairs: &[(i32, i32)],
        to_items: bool,
    ) -> io::Result<()> {
        let enumeration = |port: Port| {
            let description = self.parts.system.instances[port.instance].description();
            description.enumeration_of(port.variable.0)
        };
        let (from, to) = (enumeration(link.from), enumeration(link.to));
        let (kind, by_name) = match self.parts.system.variable(link.to).kind {
            Type::Boolean => ("Boolean", false),
            _ if to_items && from.is_some() => ("Enumeration", true),
            _ => ("Integer", false),
        };
        let text = |value: i32, items: Option<&Enumeration>| {
            let item = items.and_then(|it| it.items.iter().find(|(_, it)| *it == value));
            attribute(match item {
                Some((name, _)) if by_name => name.clone(),
                _ if kind == "Boolean" => (value != 0).to_string(),
                _ => value.to_string(),
            })
        };
        let element = format!("ssc:{kind}MappingTransformation");
        out.open(&element, &[])?;
        for &(source, target) in pairs {
            let entry = [("source", text(source, from)), ("target", text(target, to))];
            out.empty("ssc:MapEntry", &entry)?;
        }
        out.close(&element)
    }

    fn definitions(&self, out: &mut Printer) -> io::Result<()> {
        let Definitions { units, enumerations } = &self.definitions;
        if !enumerations.is_empty() {
            out.open("ssd:Enumerations", &[])?;
            for (name, items) in enumerations {
                out.open("ssc:Enumeration", &[("name", attribute(&**name))])?;
                for (item, value) in items {
                    let attributes =
                        [("name", attribute(&**item)), ("value", attribute(value.to_string()))];
                    out.empty("ssc:Item", &attributes)?;
                }
                out.close("ssc:Enumeration")?;
            }
            out.close("ssd:Enumerations")?;
        }
        if !units.is_empty() {
            out.open("ssd:Units", &[])?;
            for (name, base) in units {
                out.open("ssc:Unit", &[("name", attribute(&**name))])?;
                let names = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"].into_iter();
                let exponents = names.zip(base.exponents).filter(|(_, exponent)| *exponent != 0);
                let mut attributes: Vec<_> =
                    exponents.map(|(name, it)| (name, attribute(it.to_string()))).collect();
                attributes.push(("factor", (base.factor != 1.0).then(|| double(base.factor))));
                attributes.push(("offset", (base.offset != 0.0).then(|| double(base.offset))));
                out.empty("ssc:BaseUnit", &attributes)?;
                out.close("ssc:Unit")?;
            }
            out.close("ssd:Units")?;
        }
        Ok(())
    }
}

/// Our annotation with this text.
fn annotation(out: &mut Printer, text: &str) -> io::Result<()> {
    out.open("ssc:Annotation", &[("type", attribute(TYPE))])?;
    out.open("maglev:Settings", &[])?;
    out.text(text)?;
    out.close("maglev:Settings")?;
    out.close("ssc:Annotation")
}

/// The variables that connections use.
fn used(wires: &[Wire<'_>]) -> HashMap<InstanceIndex, HashSet<VariableIndex>> {
    let mut used: HashMap<InstanceIndex, HashSet<VariableIndex>> = HashMap::new();
    for wire in wires {
        for port in [wire.link.from, wire.link.to] {
            used.entry(port.instance).or_default().insert(port.variable);
        }
    }
    used
}
