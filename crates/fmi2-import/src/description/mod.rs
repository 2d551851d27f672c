//! The contents of modelDescription.xml.
//!
//! [`ModelDescription::parse`] reads an FMI 2.0 co-simulation description. Defects that can be tolerated
//! become [`Finding`]s, so that imperfect FMUs can be used. Only what makes an FMU unusable is an error.

mod finding;
mod parse;
mod units;
mod variable;

use std::collections::HashMap;

use serde::Serialize;

use crate::per_type::CType;

pub use finding::{Finding, Severity};
pub use parse::{DescriptionError, MAX_NODES};
pub use units::{BaseUnit, Conversion, UnitMismatch, UnitOfMeasure};
pub use variable::{Causality, Initial, Type, Value, Variability, Variable};

/// An output or initial unknown with what it depends on.
#[derive(Debug, Clone, Serialize)]
pub struct Unknown {
    /// Index into [`ModelDescription::variables`], counted from 0.
    pub variable: usize,
    /// Indices of the knowns; `None` if the description does not give them, which means all.
    pub dependencies: Option<Vec<usize>>,
}

/// Identity and capabilities for co-simulation.
#[derive(Debug, Clone, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct CoSimulation {
    /// Base name of the binary.
    pub model_identifier: String,
    /// The FMU needs another program that must be installed.
    pub needs_execution_tool: bool,
    /// The step size may vary.
    pub can_handle_variable_communication_step_size: bool,
    /// Derivatives of inputs can be set.
    pub can_interpolate_inputs: bool,
    /// Highest order of derivatives of outputs.
    pub max_output_derivative_order: u32,
    /// Steps may be pending. The spelling is the standard's.
    pub can_run_asynchronuously: bool,
    /// At most one instance in a process.
    pub can_be_instantiated_only_once_per_process: bool,
    /// The FMU ignores the allocation callbacks.
    pub can_not_use_memory_management_functions: bool,
    /// The state can be saved and restored.
    #[serde(rename = "canGetAndSetFMUstate")]
    pub can_get_and_set_fmu_state: bool,
    /// The state can be serialized.
    #[serde(rename = "canSerializeFMUstate")]
    pub can_serialize_fmu_state: bool,
    /// Directional derivatives are available.
    pub provides_directional_derivative: bool,
    /// Files in `sources/` that the binary can be built from.
    pub source_files: Vec<String>,
}

/// Derivatives that an FMU made with fmi2-export accepts and provides. They are declared in a vendor
/// annotation, an extension of the standard.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Derivatives {
    /// Highest order of derivatives of inputs that it accepts, all orders in one call.
    pub inputs: usize,
    /// Highest order of derivatives of each output, by index of the variable. Other outputs have none.
    pub outputs: HashMap<usize, usize>,
    /// The same of outputs that have more for an importer that interpolates.
    pub interpolation: HashMap<usize, usize>,
    /// Highest order of derivatives of each input that accepts more than `inputs`, by index of the variable.
    pub further: HashMap<usize, usize>,
}

/// A declared type whose values have names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Enumeration {
    /// Name of the declared type.
    pub name: String,
    /// Names and values of the items.
    pub items: Vec<(String, i32)>,
}

/// Suggested settings of a run.
#[derive(Debug, Clone, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct DefaultExperiment {
    /// Start time (s).
    pub start_time: Option<f64>,
    /// Stop time (s).
    pub stop_time: Option<f64>,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
    /// Communication step (s).
    pub step_size: Option<f64>,
}

/// Contents of modelDescription.xml.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct ModelDescription {
    /// `2.0`, or `2.0.x` of some exporters.
    pub fmi_version: String,
    /// `modelName`, as the modelling tool shows it.
    pub model_name: String,
    /// GUID, which the binary checks.
    pub guid: String,
    /// What the model represents.
    pub description: Option<String>,
    /// Author of the model.
    pub author: Option<String>,
    /// Version of the model, free text.
    pub version: Option<String>,
    /// Copyright notice, free text.
    pub copyright: Option<String>,
    /// Licence, free text.
    pub license: Option<String>,
    /// Tool that exported it.
    pub generation_tool: Option<String>,
    /// Time of export, as `xs:dateTime`.
    pub generation_date_and_time: Option<String>,
    /// `flat` or `structured`.
    pub variable_naming_convention: String,
    /// Identity and capabilities.
    pub co_simulation: CoSimulation,
    /// Whether there is also a `<ModelExchange>` element.
    #[serde(skip)]
    pub offers_model_exchange: bool,
    /// Vendor annotation about derivatives, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derivatives: Option<Derivatives>,
    /// Units of measure.
    pub units: Vec<UnitOfMeasure>,
    /// Categories that its log messages may have.
    pub log_categories: Vec<String>,
    /// Suggested run.
    pub default_experiment: DefaultExperiment,
    /// Declared types whose values have names.
    pub enumerations: Vec<Enumeration>,
    /// All variables in order.
    pub variables: Vec<Variable>,
    /// Outputs with their dependencies in step mode.
    pub outputs: Vec<Unknown>,
    /// Unknowns of the initialization with their dependencies.
    pub initial_unknowns: Vec<Unknown>,
    /// Defects that were tolerated while reading.
    #[serde(skip)]
    pub findings: Vec<Finding>,
    #[serde(skip)]
    by_name: HashMap<String, usize>,
    #[serde(skip)]
    places: Places,
}

/// Positions in the lists of a [`ModelDescription`]. The lists may be long.
#[derive(Debug, Clone, Default)]
struct Places {
    /// of a unit of measure, by its name
    units: HashMap<String, usize>,
    /// of a variable in the outputs
    outputs: HashMap<usize, usize>,
    /// of a variable in the initial unknowns
    initial_unknowns: HashMap<usize, usize>,
}

impl Places {
    fn new(units: &[UnitOfMeasure], outputs: &[Unknown], initial: &[Unknown]) -> Self {
        // the first of several is inserted last, so it is kept
        let unknowns = |list: &[Unknown]| {
            list.iter().enumerate().rev().map(|(k, it)| (it.variable, k)).collect()
        };
        Self {
            units: units.iter().enumerate().rev().map(|(k, it)| (it.name.clone(), k)).collect(),
            outputs: unknowns(outputs),
            initial_unknowns: unknowns(initial),
        }
    }
}

impl ModelDescription {
    /// Index of the variable with this name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Highest order of derivatives of inputs that the FMU certainly accepts. With the standard's
    /// `canInterpolateInputs` only the first order is certain.
    #[must_use]
    pub fn input_derivative_order(&self) -> usize {
        if !self.co_simulation.can_interpolate_inputs {
            return 0;
        }
        self.derivatives.as_ref().map_or(1, |derivatives| derivatives.inputs.min(3))
    }

    /// Highest declared order of derivatives of an output.
    #[must_use]
    pub fn output_derivative_order(&self, output: usize) -> usize {
        let variable = &self.variables[output];
        if variable.kind != Type::Real || variable.variability != Variability::Continuous {
            return 0;
        }
        let most = self.co_simulation.max_output_derivative_order as usize;
        let own = self.derivatives.as_ref();
        own.map_or(most, |it| it.outputs.get(&output).copied().unwrap_or(0).min(most))
    }

    /// Highest order of derivatives of an input that the FMU certainly accepts, up to 5.
    #[must_use]
    pub fn highest_input_derivative(&self, input: usize) -> usize {
        let own = self.derivatives.as_ref().and_then(|it| it.further.get(&input).copied());
        let least = self.input_derivative_order();
        own.map_or(least, |own| if least == 0 { 0 } else { own.clamp(least, 5) })
    }

    /// Highest order of derivatives of an output that are true for certain, for interpolation: the first without
    /// an annotation, since an FMU may return 0 for an order that an output does not have (FMI 2.0, 4.2.1).
    #[must_use]
    pub fn interpolation_order(&self, output: usize) -> usize {
        let declared = self.output_derivative_order(output);
        let Some(own) = &self.derivatives else { return declared.min(1) };
        let most = self.co_simulation.max_output_derivative_order as usize;
        own.interpolation.get(&output).map_or(declared, |&order| order.min(most).max(declared))
    }

    /// The unit of measure of a variable, if it is defined.
    #[must_use]
    pub fn unit_of(&self, variable: usize) -> Option<&UnitOfMeasure> {
        let name = self.variables[variable].unit.as_deref()?;
        self.places.units.get(name).map(|&k| &self.units[k])
    }

    /// The declared type of an Enumeration, if it is defined.
    #[must_use]
    pub fn enumeration_of(&self, variable: usize) -> Option<&Enumeration> {
        let name = self.variables[variable].declared_type.as_deref()?;
        self.enumerations.iter().find(|it| it.name == name)
    }

    /// Name of the first variable with this C type and value reference.
    #[must_use]
    pub fn name_of(&self, kind: CType, reference: u32) -> Option<&str> {
        self.variables
            .iter()
            .find(|it| it.value_reference == reference && it.kind.c_type() == kind)
            .map(|it| it.name.as_str())
    }

    /// Indices of the variables of one causality.
    pub fn with_causality(&self, causality: Causality) -> impl Iterator<Item = usize> + '_ {
        self.variables
            .iter()
            .enumerate()
            .filter(move |(_, variable)| variable.causality == causality)
            .map(|(index, _)| index)
    }

    /// Inputs that an output depends on directly in step mode.
    #[must_use]
    pub fn step_dependencies(&self, output: usize) -> Vec<usize> {
        self.dependencies(self.places.outputs.get(&output).map(|&k| &self.outputs[k]))
    }

    /// Inputs that a variable depends on in initialization mode.
    #[must_use]
    pub fn initial_dependencies(&self, unknown: usize) -> Vec<usize> {
        let variable = &self.variables[unknown];
        if variable.variability == Variability::Constant
            || variable.causality == Causality::Parameter
            || variable.initial == Some(Initial::Exact)
        {
            return Vec::new();
        }
        let place = self.places.initial_unknowns.get(&unknown);
        self.dependencies(place.map(|&k| &self.initial_unknowns[k]))
    }

    /// The inputs that an unknown depends on; all inputs if the description does not say.
    fn dependencies(&self, unknown: Option<&Unknown>) -> Vec<usize> {
        match unknown.and_then(|unknown| unknown.dependencies.as_ref()) {
            Some(list) => {
                let is_input = |&i: &usize| self.variables[i].causality == Causality::Input;
                list.iter().copied().filter(is_input).collect()
            }
            None => self.with_causality(Causality::Input).collect(),
        }
    }
}
