//! The checked system: instances with their settings, connections resolved to variables.
//!
//! Everything that can be found wrong before a unit runs is found here: names, causalities, types,
//! units of measurement, inputs driven twice or not at all, values that do not fit.

mod error;
mod links;
mod names;
mod settings;
mod strict;
mod transfer;

use std::collections::HashMap;
use std::sync::Arc;

use indexmap::IndexMap;

pub use error::SystemError;
pub use transfer::Transfer;

use fmi2_import::description::{ModelDescription, Value, Variability, Variable};
use fmi2_import::package::Package;
use scenario::{Scenario, Setting};

/// A variable of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Port {
    /// Index into [`System::instances`].
    pub instance: usize,
    /// Index into the unit's variables.
    pub variable: usize,
}

/// A checked connection. An input of several takes their sum.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Output that the value comes from.
    pub from: Port,
    /// Input that the value goes to.
    pub to: Port,
    /// What happens to the value on its way.
    pub transfer: Transfer,
    /// Degree of the extrapolation, if not that of all.
    pub extrapolation: Option<u8>,
}

/// An instance to be made.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Name of the instance in the scenario, with its number.
    pub name: String,
    /// The FMU that it is an instance of.
    pub package: Arc<Package>,
    /// Whether it runs in a process of its own, if the scenario says so of this instance.
    pub isolate: Option<bool>,
    /// Steps per communication step.
    pub steps: u32,
    /// Communication steps per step.
    pub every: u32,
    /// Relative tolerance that the unit is told, if any.
    pub tolerance: Option<f64>,
    /// Debug messages of these categories; empty: of all categories; `None`: no debug messages.
    pub debug_log: Option<Vec<String>>,
    /// Highest derivative of inputs to send, if the scenario says so of this instance.
    pub input_derivatives: Option<u8>,
    /// Set while instantiated: parameters and exact or approximate start values.
    pub parameters: IndexMap<usize, Value>,
    /// Set in initialization mode: inputs.
    pub inputs: IndexMap<usize, Value>,
}

impl Plan {
    /// Description of its unit.
    #[must_use]
    pub fn description(&self) -> &ModelDescription {
        self.package.description()
    }

    /// Highest derivative of inputs that it takes.
    #[must_use]
    pub fn input_derivative_order(&self) -> usize {
        let description = self.description();
        match self.input_derivatives {
            Some(order) if description.co_simulation.can_interpolate_inputs => usize::from(order),
            _ => description.input_derivative_order(),
        }
    }
}

/// A value that `--set` gives one variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Overridden {
    /// The variable.
    pub port: Port,
    /// The value.
    pub setting: Setting,
    /// The option as it was given, for messages.
    place: String,
}

/// All instances and connections of a scenario, checked.
#[derive(Debug)]
pub struct System {
    /// In the order of the scenario.
    pub instances: Vec<Plan>,
    /// In the order of the scenario.
    pub links: Vec<Link>,
    /// The values that `--set` gives, in its order.
    pub overridden: Vec<Overridden>,
    by_name: HashMap<String, usize>,
    /// What was noticed about connections, and about values for connected inputs.
    notes: Vec<String>,
}

type Result<T> = std::result::Result<T, SystemError>;

impl System {
    /// Opens all units and checks everything.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn new(scenario: &Scenario) -> Result<Self> {
        let mut packages = IndexMap::new();
        for (name, path) in &scenario.units {
            let failed = |source| SystemError::Package { name: name.clone(), source };
            let package = Package::open(path).map_err(failed)?;
            if scenario.strict {
                let defects = fmi2_conformance::refuse_defects(&package);
                defects.map_err(|source| SystemError::Defects { name: name.clone(), source })?;
            }
            packages.insert(name.as_str(), Arc::new(package));
        }
        let mut system = Self {
            instances: Vec::new(),
            links: Vec::new(),
            overridden: Vec::new(),
            by_name: HashMap::new(),
            notes: Vec::new(),
        };
        for (pattern, instance) in &scenario.instances {
            system.add(pattern, instance, &packages, scenario.log_level)?;
        }
        system.set_tolerances(scenario.experiment.tolerance);
        system.override_values(&scenario.overrides)?;
        system.connect(scenario)?;
        system.judge_idle_values()?;
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

    /// Whether the target of a connection changes at communication points only, or at those of a slow
    /// source.
    #[must_use]
    pub fn is_held(&self, link: &Link) -> bool {
        self.instances[link.from.instance].every > 1
            || self.variable(link.from).variability != Variability::Continuous
            || self.variable(link.to).variability != Variability::Continuous
    }

    /// The variable of a port.
    #[must_use]
    pub fn variable(&self, port: Port) -> &Variable {
        &self.instances[port.instance].description().variables[port.variable]
    }
}
