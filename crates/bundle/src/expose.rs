//! Which variables a bundle exposes, and under which names.
//!
//! By default these are all inputs without a source, all parameters, and the recorded signals. Equal parameters of a row of
//! instances, `ems_[01..64]`, share one variable.

use std::collections::HashSet;
use std::str::FromStr;

use bundle_table::Role;
use fmi2_import::description::{Causality, Type, Value, Variability};
use master::Setup;
use master::system::{InstanceIndex, Port, System, VariableIndex};
use scenario::Setting;

use crate::error::BundleError;
use crate::names::{Names, is_valid, stem};

/// Variables to expose: `PATTERN`, or `PATTERN=NAME` for all of them as one variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Expose {
    /// `instance.variable`, with ranges and stars.
    pub pattern: String,
    /// The name in the bundle.
    pub name: Option<String>,
}

impl FromStr for Expose {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (pattern, name) = match text.split_once('=') {
            Some((pattern, name)) => (pattern.trim(), Some(name.trim().to_owned())),
            None => (text.trim(), None),
        };
        if !pattern.contains('.') {
            return Err(format!("\"{text}\" is not of the form instance.variable[=NAME]"));
        }
        Ok(Self { pattern: pattern.to_owned(), name })
    }
}

/// A variable of the bundle, and what it stands for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Choice {
    pub(crate) name: String,
    pub(crate) role: Role,
    /// Not empty. Those of one choice are alike.
    pub(crate) ports: Vec<Port>,
}

/// Chooses the variables: those of the patterns first, then those exposed by default.
pub(crate) fn choose(
    setup: &Setup,
    patterns: &[Expose],
    defaults: bool,
) -> Result<Vec<Choice>, BundleError> {
    let system = setup.system();
    let mut chooser = Chooser {
        setup,
        system,
        fed: system.links.iter().map(|link| link.to).collect(),
        names: Names::default(),
        taken: HashSet::new(),
        choices: Vec::new(),
    };
    // names that the user gives are not changed by others
    for it in patterns {
        if let Some(name) = &it.name {
            chooser.reserve(it, name)?;
        }
    }
    for it in patterns {
        chooser.add(it)?;
    }
    if defaults {
        chooser.add_inputs();
        chooser.add_parameters();
        chooser.add_recorded();
    }
    if chooser.choices.is_empty() {
        return Err(BundleError::Empty);
    }
    Ok(chooser.choices)
}

struct Chooser<'a> {
    setup: &'a Setup,
    system: &'a System,
    /// inputs with a connection
    fed: HashSet<Port>,
    names: Names,
    taken: HashSet<Port>,
    choices: Vec<Choice>,
}

impl Chooser<'_> {
    fn reserve(&mut self, expose: &Expose, name: &str) -> Result<(), BundleError> {
        let wrong =
            |why| BundleError::Name { pattern: expose.pattern.clone(), name: name.to_owned(), why };
        if !is_valid(name) {
            return Err(wrong("is not a valid name"));
        }
        if !self.names.take(name) {
            return Err(wrong("is used twice"));
        }
        Ok(())
    }

    /// Adds what a pattern matches.
    fn add(&mut self, expose: &Expose) -> Result<(), BundleError> {
        let place = format!("--expose {}", expose.pattern);
        let mut ports =
            self.system.select(&place, &expose.pattern).map_err(BundleError::Pattern)?;
        let loose = expose.pattern.contains('*');
        let refused = |port: Port, why| BundleError::NotExposable {
            pattern: expose.pattern.clone(),
            port: self.system.port_name(port),
            why,
        };
        let mut roles = Vec::new();
        let mut kept = Vec::new();
        for port in ports.drain(..) {
            match self.role(port) {
                _ if self.taken.contains(&port) && loose => {}
                _ if self.taken.contains(&port) => return Err(refused(port, "is exposed twice")),
                Ok(role) => {
                    kept.push(port);
                    roles.push(role);
                }
                Err(_) if loose => {}
                Err(why) => return Err(refused(port, why)),
            }
        }
        let Some(&first) = kept.first() else {
            let port = expose.pattern.clone();
            let pattern = expose.pattern.clone();
            return Err(BundleError::NotExposable { pattern, port, why: "matches nothing else" });
        };
        let Some(name) = &expose.name else {
            for (port, role) in kept.into_iter().zip(roles) {
                self.single(port, role);
            }
            return Ok(());
        };
        if kept.len() > 1 && roles.contains(&Role::Output) {
            return Err(refused(first, "and others are computed, and an output shows only one"));
        }
        for &other in &kept[1..] {
            if let Some(what) = self.difference(first, other) {
                return Err(BundleError::Unlike {
                    pattern: expose.pattern.clone(),
                    name: name.clone(),
                    first: self.system.port_name(first),
                    other: self.system.port_name(other),
                    what,
                });
            }
        }
        let role = if roles.contains(&Role::Parameter) { Role::Parameter } else { roles[0] };
        self.push(name.clone(), role, kept);
        Ok(())
    }

    /// What a variable can be in the bundle.
    fn role(&self, port: Port) -> Result<Role, &'static str> {
        let variable = self.system.variable(port);
        match variable.causality {
            Causality::Independent => Err("is the time"),
            _ if variable.variability == Variability::Constant => Err("is a constant"),
            Causality::Input if self.fed.contains(&port) || self.system.driven.contains(&port) => {
                Ok(Role::Output)
            }
            Causality::Input => Ok(Role::Input),
            Causality::Parameter if start(self.setup, port).is_none() => Err("has no start value"),
            Causality::Parameter if self.is_file(port) => Err("is the path of a file inside"),
            Causality::Parameter if variable.variability == Variability::Tunable => {
                Ok(Role::Tunable)
            }
            Causality::Parameter => Ok(Role::Parameter),
            _ => Ok(Role::Output),
        }
    }

    /// Whether the scenario sets a parameter to the path of a file, which becomes one in the bundle.
    fn is_file(&self, port: Port) -> bool {
        let (instance, variable) =
            (&self.system.instances[port.instance], self.system.variable(port));
        let entries = self.setup.scenario().instances.iter();
        let of_instance = entries.filter(|(pattern, _)| {
            **pattern == instance.name
                || patterns::expand(pattern).is_ok_and(|names| names.contains(&instance.name))
        });
        let mut settings = of_instance.flat_map(|(_, it)| &it.parameters);
        settings.any(|(name, setting)| {
            let named = *name == variable.name
                || patterns::expand(name).is_ok_and(|names| names.contains(&variable.name));
            named && matches!(setting, Setting::File(_))
        })
    }

    /// What keeps two variables from being one.
    fn difference(&self, first: Port, other: Port) -> Option<&'static str> {
        let (a, b) = (self.system.variable(first), self.system.variable(other));
        let measure = |port: Port| {
            let description = self.system.instances[port.instance].description();
            description.unit_of(port.variable.0).cloned()
        };
        [
            (a.causality != b.causality, "roles"),
            (a.kind != b.kind, "types"),
            (a.variability != b.variability && a.causality == Causality::Input, "variabilities"),
            (a.unit != b.unit || measure(first) != measure(other), "units of measure"),
            ((a.min, a.max) != (b.min, b.max), "ranges"),
            (start(self.setup, first) != start(self.setup, other), "start values"),
        ]
        .into_iter()
        .find_map(|(differs, what)| differs.then_some(what))
    }

    /// Adds one variable under its own name.
    fn single(&mut self, port: Port, role: Role) {
        let name = self.names.like(&self.system.port_name(port));
        self.push(name, role, vec![port]);
    }

    fn push(&mut self, name: String, role: Role, ports: Vec<Port>) {
        self.taken.extend(&ports);
        self.choices.push(Choice { name, role, ports });
    }

    /// All variables of one causality.
    fn all(&self, causality: Causality) -> Vec<Port> {
        let of = |(instance, setup): (InstanceIndex, &master::system::InstanceSetup)| {
            let list = setup.description().with_causality(causality).map(VariableIndex);
            list.map(|variable| Port { instance, variable }).collect::<Vec<_>>()
        };
        self.system.indexed().flat_map(of).collect()
    }

    fn add_inputs(&mut self) {
        for port in self.all(Causality::Input) {
            if !self.taken.contains(&port) && self.role(port) == Ok(Role::Input) {
                self.single(port, Role::Input);
            }
        }
    }

    /// Adds the parameters; equal ones of a row of instances as one.
    fn add_parameters(&mut self) {
        let scenario = self.setup.scenario();
        for pattern in scenario.instances.keys() {
            let names = patterns::expand(pattern).unwrap_or_default();
            let members: Vec<InstanceIndex> =
                names.iter().filter_map(|name| self.system.find(name)).collect();
            let Some(&first) = members.first() else { continue };
            let row = pattern.contains('[').then(|| stem(pattern));
            let description = self.system.instances[first].description();
            for variable in description.with_causality(Causality::Parameter).map(VariableIndex) {
                let ports = members.iter().map(|&instance| Port { instance, variable });
                let free = |port: &Port| !self.taken.contains(port);
                let ports: Vec<(Port, Role)> = ports
                    .filter(free)
                    .filter_map(|port| Some((port, self.role(port).ok()?)))
                    .collect();
                let Some(&(one, role)) = ports.first() else { continue };
                let alike = ports.iter().all(|&(other, _)| self.difference(one, other).is_none());
                match &row {
                    Some(stem) if alike => {
                        let text = format!("{stem}.{}", self.system.variable(one).name);
                        let name = self.names.like(&text);
                        self.push(name, role, ports.into_iter().map(|(port, _)| port).collect());
                    }
                    _ => ports.into_iter().for_each(|(port, role)| self.single(port, role)),
                }
            }
        }
    }

    fn add_recorded(&mut self) {
        for port in self.setup.selection().recorded() {
            if !self.taken.contains(&port) && self.role(port) == Ok(Role::Output) {
                self.single(port, Role::Output);
            }
        }
    }
}

/// The value that an input or parameter starts with.
pub(crate) fn start(setup: &Setup, port: Port) -> Option<Value> {
    let instance = &setup.system().instances[port.instance];
    let given = instance.inputs.get(&port.variable).or(instance.parameters.get(&port.variable));
    let variable = setup.system().variable(port);
    // an Enumeration without a start value has none that is certain
    let usable = |value: &&Value| {
        variable.kind != Type::Real || matches!(value, Value::Real(x) if x.is_finite())
    };
    given.or(variable.start.as_ref()).filter(usable).cloned()
}
