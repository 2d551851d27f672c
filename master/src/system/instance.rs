//! The settings of one instance.

use std::sync::Arc;

use indexmap::IndexMap;

use super::VariableIndex;
use fmi2_import::description::{ModelDescription, Value};
use fmi2_import::package::Package;

/// Settings of an instance, from which it is created.
#[derive(Debug, Clone)]
pub struct InstanceSetup {
    /// Its name in the scenario, with its number.
    pub name: String,
    /// Key of its unit in the scenario's `units`.
    pub unit: String,
    /// The FMU that it is an instance of.
    pub package: Arc<Package>,
    /// Whether it runs in a process of its own, if the scenario sets this for the instance.
    pub isolate: Option<bool>,
    /// Steps per communication step.
    pub steps: u32,
    /// Communication steps per step.
    pub every: u32,
    /// Relative tolerance that is passed to the unit, if any.
    pub tolerance: Option<f64>,
    /// Categories of its debug messages. Empty: all categories. `None`: no debug messages.
    pub debug_log: Option<Vec<String>>,
    /// Highest derivative of inputs to send, if the scenario sets this for the instance.
    pub input_derivatives: Option<u8>,
    /// Set after instantiation: parameters, and exact or approximate start values.
    pub parameters: IndexMap<VariableIndex, Value>,
    /// Set in initialization mode: inputs.
    pub inputs: IndexMap<VariableIndex, Value>,
}

impl InstanceSetup {
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

    /// Highest derivative of one input that it takes, for a coupling of order `six` or less.
    #[must_use]
    pub fn input_derivatives_of(&self, input: VariableIndex, six: bool) -> usize {
        match self.input_derivatives {
            None if six => self.description().highest_input_derivative(input.0),
            _ => self.input_derivative_order(),
        }
    }

    /// The position of a variable by its name.
    #[must_use]
    pub fn find(&self, variable: &str) -> Option<VariableIndex> {
        self.description().find(variable).map(VariableIndex)
    }
}
