//! The checked system: instances with their settings, and connections between their variables.
//!
//! Everything that can be found wrong before a unit runs is found here: names, causalities, types,
//! units of measurement, inputs without a source or with two, values that do not fit.

mod error;
mod index;
mod instance;
mod links;
mod names;
mod notices;
mod settings;
mod signals;
mod transfer;

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use indexmap::IndexMap;

pub use error::SystemError;
pub use index::{InstanceIndex, Port, VariableIndex};
pub use instance::InstanceSetup;
pub use signals::SignalGraph;
pub use transfer::Transfer;

use fmi2_derive::{DeriveError, UnitSource};
use fmi2_import::description::{Variability, Variable};
use fmi2_import::package::Package;
use scenario::{Scenario, Setting};

/// A checked connection. An input with several connections takes their sum.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Output that the value comes from.
    pub from: Port,
    /// Input that the value goes to.
    pub to: Port,
    /// Conversion of the value.
    pub transfer: Transfer,
    /// Degree of the extrapolation, if it differs from the general one.
    pub extrapolation: Option<u8>,
    /// Whether the slope jumps at communication points.
    pub kinks: bool,
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
    pub instances: Vec<InstanceSetup>,
    /// In the order of the scenario.
    pub links: Vec<Link>,
    /// The values that `--set` gives, in its order.
    pub overridden: Vec<Overridden>,
    /// Inputs that follow signals over time.
    pub driven: HashSet<Port>,
    by_name: HashMap<String, InstanceIndex>,
    /// remarks about connections, and about values for connected inputs
    notes: Vec<String>,
}

type Result<T> = std::result::Result<T, SystemError>;

impl System {
    /// Opens all units and checks everything.
    ///
    /// # Errors
    /// The first error found.
    pub fn new(scenario: &Scenario) -> Result<Self> {
        Self::of_units(scenario, &mut |name, unit| open(name, unit, scenario.strict).map(Arc::new))
    }

    /// Checks everything with units that `open` opens.
    ///
    /// # Errors
    /// The first error found.
    pub(crate) fn of_units(
        scenario: &Scenario,
        open: &mut dyn FnMut(&str, &UnitSource) -> Result<Arc<Package>>,
    ) -> Result<Self> {
        let mut packages = IndexMap::new();
        for (name, unit) in &scenario.units {
            packages.insert(name.as_str(), open(name, unit)?);
        }
        let mut system = Self {
            instances: Vec::new(),
            links: Vec::new(),
            overridden: Vec::new(),
            driven: HashSet::new(),
            by_name: HashMap::new(),
            notes: Vec::new(),
        };
        for (pattern, instance) in &scenario.instances {
            system.add(pattern, instance, &packages, scenario.log_level)?;
        }
        system.set_tolerances(scenario.experiment.tolerance);
        system.override_values(&scenario.overrides)?;
        system.connect(scenario)?;
        system.check_unused_values()?;
        system.check_inputs()?;
        Ok(system)
    }

    /// All instances with their indices.
    pub fn indexed(&self) -> impl Iterator<Item = (InstanceIndex, &InstanceSetup)> {
        self.instances.iter().enumerate().map(|(k, instance)| (InstanceIndex(k), instance))
    }

    /// The instance of that name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<InstanceIndex> {
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

    /// Magnitude of a variable: its nominal value, 1 by default.
    #[must_use]
    pub fn nominal(&self, port: Port) -> f64 {
        self.variable(port).nominal.map_or(1.0, f64::abs)
    }
}

/// Opens a unit. A strict run does not tolerate errors in it.
pub(crate) fn open(name: &str, unit: &UnitSource, strict: bool) -> Result<Package> {
    let failed = |source| SystemError::Package { name: name.to_owned(), source };
    let package = fmi2_derive::open(unit).map_err(failed)?;
    if strict {
        let mut file = unit.fmu.clone();
        if !unit.resources.is_empty() {
            // the rules read an archive
            file = package.folder().join("derived.fmu");
            let derived = fmi2_derive::derive(unit, name).map_err(failed)?;
            derived.write(&file).map_err(DeriveError::Pack).map_err(failed)?;
        }
        fmi2_conformance::refuse_defects(&unit.fmu, &file)
            .map_err(|source| SystemError::Defects { name: name.to_owned(), source })?;
    }
    Ok(package)
}
