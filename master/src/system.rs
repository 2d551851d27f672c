//! The checked system: instances with their settings, connections resolved to variables.
//!
//! Everything that can be found wrong before a unit runs is found here: names, causalities, types,
//! units of measurement, inputs driven twice or not at all, values that do not fit.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use indexmap::IndexMap;
use thiserror::Error;

use crate::description::{
    Causality, Conversion, Description, Initial, Type, UnitMismatch, Value, Variability, Variable,
};
use crate::package::{Package, PackageError};
use crate::pattern::{self, PatternError};
use crate::scenario::{Scenario, Setting};

/// A variable of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Port {
    /// Index into [`System::instances`].
    pub instance: usize,
    /// Index into the unit's variables.
    pub variable: usize,
}

/// A checked connection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The output.
    pub from: Port,
    /// The input.
    pub to: Port,
    /// From the output's unit of measurement to the input's.
    pub conversion: Conversion,
}

/// An instance to be made.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub package: Rc<Package>,
    /// Set while instantiated: parameters and exact or approximate start values.
    pub parameters: Vec<(usize, Value)>,
    /// Set in initialization mode: inputs.
    pub inputs: Vec<(usize, Value)>,
}

impl Plan {
    /// Description of its unit.
    #[must_use]
    pub fn description(&self) -> &Description {
        self.package.description()
    }
}

/// All instances and connections of a scenario, checked.
#[derive(Debug)]
pub struct System {
    /// In the order of the scenario.
    pub instances: Vec<Plan>,
    /// In the order of the scenario.
    pub links: Vec<Link>,
    by_name: HashMap<String, usize>,
}

/// A setting from outside of the scenario: `instance.variable=value`, patterns allowed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Override {
    /// `instance.variable`
    pub target: String,
    /// The value as text.
    pub value: String,
}

impl std::fmt::Display for Override {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}={}", self.target, self.value)
    }
}

/// Why the parts of a scenario do not make a system.
#[derive(Debug, Error)]
pub enum SystemError {
    /// A unit cannot be opened.
    #[error("units.{name}: the unit cannot be used")]
    Package {
        /// Key in `units`.
        name: String,
        /// Why.
        #[source]
        source: PackageError,
    },
    /// A pattern cannot be expanded.
    #[error("{place}")]
    Pattern {
        /// JSON path.
        place: String,
        /// Why.
        #[source]
        source: PatternError,
    },
    /// A name that does not exist.
    #[error("{place}: there is no {what} \"{name}\"{}{}",
        within.as_ref().map(|w| format!(" in {w}")).unwrap_or_default(),
        suggestion.as_ref().map(|s| format!("; did you mean \"{s}\"?")).unwrap_or_default())]
    Unknown {
        /// JSON path.
        place: String,
        /// Kind of thing.
        what: &'static str,
        /// The name.
        name: String,
        /// Where it was looked for.
        within: Option<String>,
        /// A similar name.
        suggestion: Option<String>,
    },
    /// A signal not written as `instance.variable`.
    #[error("{place}: \"{name}\" is not of the form instance.variable")]
    Form {
        /// JSON path.
        place: String,
        /// As written.
        name: String,
    },
    /// An instance name that cannot be addressed, or occurs twice.
    #[error("instances: the name \"{name}\" {why}")]
    InstanceName {
        /// The name.
        name: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A connection from something that is no output, or to something that is no input.
    #[error("{place}: {port} is {}, not {wanted}", causality_name(*causality))]
    Causality {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// What it is.
        causality: Causality,
        /// What it should be.
        wanted: &'static str,
    },
    /// Types of a connection differ.
    #[error("{place}: {from} is of type {from_type}, {to} of type {to_type}")]
    Type {
        /// JSON path.
        place: String,
        /// Source.
        from: String,
        /// Its type.
        from_type: Type,
        /// Target.
        to: String,
        /// Its type.
        to_type: Type,
    },
    /// Units of measurement of a connection do not fit.
    #[error("{place}: the units of measurement of {from} and {to} do not fit")]
    Unit {
        /// JSON path.
        place: String,
        /// Source.
        from: String,
        /// Target.
        to: String,
        /// How they differ.
        #[source]
        source: UnitMismatch,
    },
    /// Two sources for one input.
    #[error("{place}: {to} is already fed by {first}")]
    DrivenTwice {
        /// JSON path of the second connection.
        place: String,
        /// The input.
        to: String,
        /// The source of the first connection.
        first: String,
    },
    /// An input with no source and no start value.
    #[error("{input} is not connected and has no start value")]
    Unconnected {
        /// `instance.variable`
        input: String,
    },
    /// A value that does not fit its variable's type.
    #[error("{place}: {value} is no value for {port}, which is of type {kind}")]
    Value {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The value.
        value: String,
        /// The variable's type.
        kind: Type,
    },
    /// A value outside of the range that the unit declares.
    #[error("{place}: {value} is outside of the range of {port}: {min} to {max}")]
    OutOfRange {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The value.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// A variable that cannot be set.
    #[error("{place}: {port} cannot be set: {why}")]
    NotSettable {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// Why not.
        why: String,
    },
    /// A text where only numbers can be recorded.
    #[error("{place}: {port} is a String, which cannot be recorded")]
    NotNumeric {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
    },
    /// A setting that concerns nothing.
    #[error("{place}: \"{pattern}\" matches nothing")]
    NoMatch {
        /// JSON path.
        place: String,
        /// As written.
        pattern: String,
    },
}

fn causality_name(causality: Causality) -> &'static str {
    match causality {
        Causality::Parameter => "a parameter",
        Causality::CalculatedParameter => "a calculated parameter",
        Causality::Input => "an input",
        Causality::Output => "an output",
        Causality::Local => "a local variable",
        Causality::Independent => "the time",
    }
}

type Result<T> = std::result::Result<T, SystemError>;

impl System {
    /// Opens all units and checks everything.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn new(scenario: &Scenario, overrides: &[Override]) -> Result<Self> {
        let mut packages = IndexMap::new();
        for (name, path) in &scenario.units {
            let package = Package::open(path)
                .map_err(|source| SystemError::Package { name: name.clone(), source })?;
            packages.insert(name.as_str(), Rc::new(package));
        }
        let mut system = Self { instances: Vec::new(), links: Vec::new(), by_name: HashMap::new() };
        for (pattern, instance) in &scenario.instances {
            system.add(pattern, instance, &packages)?;
        }
        for entry in overrides {
            system.override_value(entry)?;
        }
        system.connect(scenario)?;
        system.check_inputs()?;
        Ok(system)
    }

    /// Index of the instance of that name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// `instance.variable` of a port.
    #[must_use]
    pub fn port_name(&self, port: Port) -> String {
        format!("{}.{}", self.instances[port.instance].name, self.variable(port).name)
    }

    /// The variable of a port.
    #[must_use]
    pub fn variable(&self, port: Port) -> &Variable {
        &self.instances[port.instance].description().variables[port.variable]
    }

    fn add(
        &mut self,
        pattern: &str,
        instance: &crate::scenario::Instance,
        packages: &IndexMap<&str, Rc<Package>>,
    ) -> Result<()> {
        let place = format!("instances.{pattern}");
        let package = packages.get(instance.unit.as_str()).ok_or_else(|| SystemError::Unknown {
            place: format!("{place}.unit"),
            what: "unit",
            name: instance.unit.clone(),
            within: Some("units".to_owned()),
            suggestion: pattern::suggest(&instance.unit, packages.keys().copied())
                .map(str::to_owned),
        })?;
        let names = pattern::expand(pattern)
            .map_err(|source| SystemError::Pattern { place: "instances".to_owned(), source })?;
        let bad = |name: &str, why| SystemError::InstanceName { name: name.to_owned(), why };
        for name in names {
            if name.is_empty() || name.contains(['.', '*']) || name.chars().any(char::is_control) {
                return Err(bad(
                    &name,
                    "is empty or contains a dot, a star or a control character",
                ));
            }
            let index = self.instances.len();
            if self.by_name.insert(name.clone(), index).is_some() {
                return Err(bad(&name, "occurs twice"));
            }
            let package = Rc::clone(package);
            self.instances.push(Plan { name, package, parameters: Vec::new(), inputs: Vec::new() });
            for (list, settings) in
                [("parameters", &instance.parameters), ("start", &instance.start)]
            {
                for (names, setting) in settings {
                    let place = format!("{place}.{list}");
                    let expanded = pattern::expand(names)
                        .map_err(|source| SystemError::Pattern { place: place.clone(), source })?;
                    for name in expanded {
                        let variable = self.find_variable(&place, index, &name)?;
                        let port = Port { instance: index, variable };
                        let is_parameter = self.variable(port).causality == Causality::Parameter;
                        if is_parameter != (list == "parameters") {
                            return Err(SystemError::NotSettable {
                                place,
                                port: self.port_name(port),
                                why: format!(
                                    "it is {}; it belongs under \"{}\"",
                                    causality_name(self.variable(port).causality),
                                    if is_parameter { "parameters" } else { "start" }
                                ),
                            });
                        }
                        self.set(&format!("{place}.{name}"), port, setting)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn override_value(&mut self, entry: &Override) -> Result<()> {
        let place = format!("--set {}={}", entry.target, entry.value);
        let ports = self.select(&place, &entry.target)?;
        for port in ports {
            let setting = match self.variable(port).kind {
                Type::String => Setting::Text(entry.value.clone()),
                _ => Setting::from_text(&entry.value),
            };
            self.set(&place, port, &setting)?;
        }
        Ok(())
    }

    /// Remembers a value for a variable, replacing an earlier one.
    fn set(&mut self, place: &str, port: Port, setting: &Setting) -> Result<()> {
        let variable = self.variable(port);
        let value = self.value(place, port, setting)?;
        let refuse = |why: &str| {
            Err(SystemError::NotSettable {
                place: place.to_owned(),
                port: self.port_name(port),
                why: why.to_owned(),
            })
        };
        if variable.variability == Variability::Constant {
            return refuse("it is constant");
        }
        let is_input = variable.causality == Causality::Input;
        if !is_input && !matches!(variable.initial, Some(Initial::Exact | Initial::Approx)) {
            return refuse(&format!(
                "it is {} that the unit computes itself",
                causality_name(variable.causality)
            ));
        }
        let plan = &mut self.instances[port.instance];
        let list = if is_input { &mut plan.inputs } else { &mut plan.parameters };
        match list.iter_mut().find(|(variable, _)| *variable == port.variable) {
            Some(entry) => entry.1 = value,
            None => list.push((port.variable, value)),
        }
        Ok(())
    }

    fn value(&self, place: &str, port: Port, setting: &Setting) -> Result<Value> {
        let variable = self.variable(port);
        let misfit = || SystemError::Value {
            place: place.to_owned(),
            port: self.port_name(port),
            value: setting.to_string(),
            kind: variable.kind,
        };
        let value = match (variable.kind, setting) {
            (Type::Real, Setting::Number(x)) => Value::Real(*x),
            (Type::Integer | Type::Enumeration, Setting::Number(x))
                if x.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(x) =>
            {
                #[expect(clippy::cast_possible_truncation, reason = "checked: a whole i32")]
                Value::Integer(*x as i32)
            }
            (Type::Boolean, Setting::Boolean(x)) => Value::Boolean(*x),
            (Type::String, Setting::Text(x)) => Value::String(x.clone()),
            _ => return Err(misfit()),
        };
        if let Setting::Number(x) = *setting {
            let min = variable.min.unwrap_or(f64::NEG_INFINITY);
            let max = variable.max.unwrap_or(f64::INFINITY);
            if x < min || x > max {
                return Err(SystemError::OutOfRange {
                    place: place.to_owned(),
                    port: self.port_name(port),
                    value: x,
                    min,
                    max,
                });
            }
        }
        Ok(value)
    }

    fn connect(&mut self, scenario: &Scenario) -> Result<()> {
        let mut fed: HashMap<Port, Port> = HashMap::new();
        for (k, connection) in scenario.connections.iter().enumerate() {
            let place = format!("connections[{k}]");
            for target in connection.to.as_slice() {
                let pairs = pattern::zip(&connection.from, target)
                    .map_err(|source| SystemError::Pattern { place: place.clone(), source })?;
                for (from, to) in pairs {
                    let from = self.port(&place, &from)?;
                    let to = self.port(&place, &to)?;
                    let link = self.link(&place, from, to)?;
                    if let Some(&first) = fed.get(&to) {
                        let (to, first) = (self.port_name(to), self.port_name(first));
                        return Err(SystemError::DrivenTwice { place, to, first });
                    }
                    fed.insert(to, from);
                    self.links.push(link);
                }
            }
        }
        Ok(())
    }

    fn link(&self, place: &str, from: Port, to: Port) -> Result<Link> {
        let (source, target) = (self.variable(from), self.variable(to));
        let wrong = |port, causality, wanted| SystemError::Causality {
            place: place.to_owned(),
            port: self.port_name(port),
            causality,
            wanted,
        };
        if source.causality != Causality::Output {
            return Err(wrong(from, source.causality, "an output"));
        }
        if target.causality != Causality::Input {
            return Err(wrong(to, target.causality, "an input"));
        }
        if source.kind != target.kind {
            return Err(SystemError::Type {
                place: place.to_owned(),
                from: self.port_name(from),
                from_type: source.kind,
                to: self.port_name(to),
                to_type: target.kind,
            });
        }
        let conversion = match (&source.unit, &target.unit) {
            (Some(a), Some(b)) => {
                let base = |port: Port| {
                    let description = self.instances[port.instance].description();
                    description.unit_of(port.variable).and_then(|unit| unit.base.as_ref())
                };
                Conversion::between((a, base(from)), (b, base(to))).map_err(|source| {
                    SystemError::Unit {
                        place: place.to_owned(),
                        from: self.port_name(from),
                        to: self.port_name(to),
                        source,
                    }
                })?
            }
            // a variable without a unit takes any
            _ => Conversion::IDENTITY,
        };
        Ok(Link { from, to, conversion })
    }

    /// Every input must have a source or a start value, which is sent.
    fn check_inputs(&mut self) -> Result<()> {
        let fed: HashSet<Port> = self.links.iter().map(|link| link.to).collect();
        for instance in 0..self.instances.len() {
            let package = Rc::clone(&self.instances[instance].package);
            let description = package.description();
            for variable in description.with_causality(Causality::Input) {
                let port = Port { instance, variable };
                let plan = &mut self.instances[instance];
                if fed.contains(&port) || plan.inputs.iter().any(|(index, _)| *index == variable) {
                    continue;
                }
                match &description.variables[variable].start {
                    Some(value) => plan.inputs.push((variable, value.clone())),
                    None => {
                        return Err(SystemError::Unconnected { input: self.port_name(port) });
                    }
                }
            }
        }
        Ok(())
    }

    fn port(&self, place: &str, name: &str) -> Result<Port> {
        let Some((instance, variable)) = name.split_once('.') else {
            return Err(SystemError::Form { place: place.to_owned(), name: name.to_owned() });
        };
        let Some(index) = self.find(instance) else {
            return Err(self.unknown_instance(place, instance));
        };
        let variable = self.find_variable(place, index, variable)?;
        Ok(Port { instance: index, variable })
    }

    /// The error for an instance name that does not exist.
    #[must_use]
    pub fn unknown_instance(&self, place: &str, name: &str) -> SystemError {
        let names = self.instances.iter().map(|plan| plan.name.as_str());
        SystemError::Unknown {
            place: place.to_owned(),
            what: "instance",
            name: name.to_owned(),
            within: None,
            suggestion: pattern::suggest(name, names).map(str::to_owned),
        }
    }

    fn find_variable(&self, place: &str, instance: usize, name: &str) -> Result<usize> {
        let plan = &self.instances[instance];
        let description = plan.description();
        description.find(name).ok_or_else(|| SystemError::Unknown {
            place: place.to_owned(),
            what: "variable",
            name: name.to_owned(),
            within: Some(format!("{} (unit {})", plan.name, description.model_name)),
            suggestion: pattern::suggest(
                name,
                description.variables.iter().map(|variable| variable.name.as_str()),
            )
            .map(str::to_owned),
        })
    }

    /// All ports that a name with ranges and stars stands for, in order.
    ///
    /// # Errors
    /// A plain name does not exist, or a pattern matches nothing.
    pub fn select(&self, place: &str, pattern: &str) -> Result<Vec<Port>> {
        let names = pattern::expand(pattern)
            .map_err(|source| SystemError::Pattern { place: place.to_owned(), source })?;
        let mut ports = Vec::new();
        for name in names {
            if !name.contains('*') {
                ports.push(self.port(place, &name)?);
                continue;
            }
            let before = ports.len();
            let Some((instance_glob, variable_glob)) = name.split_once('.') else {
                return Err(SystemError::Form { place: place.to_owned(), name });
            };
            for (instance, plan) in self.instances.iter().enumerate() {
                if !pattern::matches(instance_glob, &plan.name) {
                    continue;
                }
                for (variable, it) in plan.description().variables.iter().enumerate() {
                    if pattern::matches(variable_glob, &it.name) {
                        ports.push(Port { instance, variable });
                    }
                }
            }
            if ports.len() == before {
                return Err(SystemError::NoMatch { place: place.to_owned(), pattern: name });
            }
        }
        Ok(ports)
    }

    /// All instances that a name with ranges and stars stands for, in order.
    ///
    /// # Errors
    /// A name does not exist, or a pattern matches nothing.
    pub fn select_instances(&self, place: &str, pattern: &str) -> Result<Vec<usize>> {
        let names = pattern::expand(pattern)
            .map_err(|source| SystemError::Pattern { place: place.to_owned(), source })?;
        let mut found = Vec::new();
        for name in names {
            if name.contains('*') {
                let before = found.len();
                let all = self.instances.iter().enumerate();
                found.extend(
                    all.filter(|(_, plan)| pattern::matches(&name, &plan.name)).map(|(k, _)| k),
                );
                if found.len() == before {
                    return Err(SystemError::NoMatch { place: place.to_owned(), pattern: name });
                }
            } else {
                let index = self.find(&name);
                found.push(index.ok_or_else(|| self.unknown_instance(place, &name))?);
            }
        }
        Ok(found)
    }
}
