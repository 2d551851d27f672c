//! What a unit says about itself: the contents of its modelDescription.xml.
//!
//! [`ModelDescription::parse`] reads everything of an FMI 2.0 co-simulation description. Tolerable
//! defects become [`Finding`]s, so that imperfect units still run; only what makes a unit
//! unusable is an error.

mod parse;
mod units;

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::per_type::CType;

pub use parse::DescriptionError;
pub use parse::MAX_NODES;
pub use units::{BaseUnit, Conversion, UnitDefinition, UnitMismatch};

/// How grave a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Against the standard, but tolerated.
    Warning,
    /// Against the standard such that other tools may refuse the unit.
    Error,
}

impl std::fmt::Display for Severity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// One observation about a unit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Name of the rule that made it.
    pub rule: &'static str,
    /// How much a violation matters to importers.
    pub severity: Severity,
    /// What was found, and where.
    pub message: String,
}

/// The four data types of FMI 2.0's get and set calls; an Enumeration travels as an Integer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Type {
    /// `fmi2Real`
    Real,
    /// `fmi2Integer`
    Integer,
    /// `fmi2Boolean`
    Boolean,
    /// `fmi2String`
    String,
    /// Travels as `fmi2Integer`
    Enumeration,
}

impl Type {
    /// The type in the C interface.
    #[must_use]
    pub const fn c_type(self) -> CType {
        match self {
            Self::Real => CType::Real,
            Self::Integer | Self::Enumeration => CType::Integer,
            Self::Boolean => CType::Boolean,
            Self::String => CType::String,
        }
    }
}

impl std::fmt::Display for Type {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Debug::fmt(self, f)
    }
}

/// A value of any type.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// Real
    Real(f64),
    /// Integer or Enumeration
    Integer(i32),
    /// Boolean
    Boolean(bool),
    /// String
    String(String),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Real(x) if *x != 0.0 && !(1e-4..1e7).contains(&x.abs()) => write!(f, "{x:e}"),
            Self::Real(x) => write!(f, "{x}"),
            Self::Integer(x) => write!(f, "{x}"),
            Self::Boolean(x) => write!(f, "{x}"),
            Self::String(x) => write!(f, "{x:?}"),
        }
    }
}

/// What a variable is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "camelCase")]
pub enum Causality {
    /// Set before the start.
    Parameter,
    /// Computed from parameters.
    CalculatedParameter,
    /// Fed by other units.
    Input,
    /// Offered to other units.
    Output,
    /// Internal.
    Local,
    /// Time itself.
    Independent,
}

/// When a variable may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Variability {
    /// Never.
    Constant,
    /// Not after initialization.
    Fixed,
    /// Between steps, by the user.
    Tunable,
    /// At events.
    Discrete,
    /// At any time.
    Continuous,
}

/// How a variable gets its initial value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Initial {
    /// Its start value is its initial value.
    Exact,
    /// Its start value is a guess.
    Approx,
    /// It is computed.
    Calculated,
}

/// One scalar variable.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Variable {
    /// Unique name within the unit.
    pub name: String,
    /// Handle within its type.
    pub value_reference: u32,
    /// Data type.
    #[serde(rename = "type")]
    pub kind: Type,
    /// What it is for.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// How it gets its initial value; `None` for inputs and the independent variable.
    pub initial: Option<Initial>,
    /// Start value.
    pub start: Option<Value>,
    /// Unit of measure, by its name in `UnitDefinitions`.
    pub unit: Option<String>,
    /// Name of the unit that people like to see.
    pub display_unit: Option<String>,
    /// Smallest sensible value.
    pub min: Option<f64>,
    /// Largest sensible value.
    pub max: Option<f64>,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// Meaning.
    pub description: Option<String>,
    /// Whether it is a difference: an offset of its unit does not count.
    pub relative_quantity: bool,
    /// Declared type, by its name in `TypeDefinitions`.
    pub declared_type: Option<String>,
    /// Index of the variable whose derivative it is, counted from 0.
    pub derivative_of: Option<usize>,
    /// Whether the description gives `initial` itself.
    #[serde(skip)]
    pub initial_given: bool,
}

/// An output or initial unknown with what it depends on.
#[derive(Debug, Clone, Serialize)]
pub struct Unknown {
    /// Index into [`ModelDescription::variables`], counted from 0.
    pub variable: usize,
    /// Indices of the knowns; `None` where the description leaves it open (that is: all).
    pub dependencies: Option<Vec<usize>>,
}

/// Identity and capabilities for co-simulation.
#[derive(Debug, Clone, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct CoSimulation {
    /// Base name of the binary.
    pub model_identifier: String,
    /// The unit only talks to another program that must be installed.
    pub needs_execution_tool: bool,
    /// The step may change from call to call.
    pub can_handle_variable_communication_step_size: bool,
    /// Inputs may be given with derivatives.
    pub can_interpolate_inputs: bool,
    /// Highest derivative of outputs on offer.
    pub max_output_derivative_order: u32,
    /// The spelling is the standard's.
    pub can_run_asynchronuously: bool,
    /// One instance per process only.
    pub can_be_instantiated_only_once_per_process: bool,
    /// The unit ignores the allocation callbacks.
    pub can_not_use_memory_management_functions: bool,
    /// State can be saved and restored.
    #[serde(rename = "canGetAndSetFMUstate")]
    pub can_get_and_set_fmu_state: bool,
    /// State can be written as bytes.
    #[serde(rename = "canSerializeFMUstate")]
    pub can_serialize_fmu_state: bool,
    /// Directional derivatives are on offer.
    pub provides_directional_derivative: bool,
    /// Files in `sources/` that it can be built from.
    pub source_files: Vec<String>,
}

/// What a unit of the exporter that comes with this master says of derivatives, beyond the standard:
/// its vendor annotation.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Derivatives {
    /// Highest order of derivatives of inputs that it takes, all orders in one call.
    pub inputs: usize,
    /// Outputs by their index, with the highest order of derivatives that each offers; those left out
    /// offer none.
    pub outputs: HashMap<usize, usize>,
}

/// A type whose values have names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Enumeration {
    /// Name of the declared type.
    pub name: String,
    /// Name and value of its items.
    pub items: Vec<(String, i32)>,
}

/// Suggestion for a run.
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

/// Everything that modelDescription.xml says.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct ModelDescription {
    /// `2.0`
    pub fmi_version: String,
    /// `modelName`, as the modelling tool shows it.
    pub model_name: String,
    /// Fingerprint that the binary must confirm.
    pub guid: String,
    /// What it models.
    pub description: Option<String>,
    /// Who made it.
    pub author: Option<String>,
    /// Version of the model, free text.
    pub version: Option<String>,
    /// Copyright notice, free text.
    pub copyright: Option<String>,
    /// Licence, free text.
    pub license: Option<String>,
    /// What exported it.
    pub generation_tool: Option<String>,
    /// Time of export, as `xs:dateTime`.
    pub generation_date_and_time: Option<String>,
    /// `flat` or `structured`.
    pub variable_naming_convention: String,
    /// Identity and capabilities.
    pub co_simulation: CoSimulation,
    /// Whether there is a `<ModelExchange>` too.
    #[serde(skip)]
    pub offers_model_exchange: bool,
    /// What it says of derivatives beyond the standard, if it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derivatives: Option<Derivatives>,
    /// Units of measurement.
    pub units: Vec<UnitDefinition>,
    /// Categories that its log messages may have.
    pub log_categories: Vec<String>,
    /// Suggested run.
    pub default_experiment: DefaultExperiment,
    /// Types whose values have names.
    pub enumerations: Vec<Enumeration>,
    /// All variables in order.
    pub variables: Vec<Variable>,
    /// Outputs with their dependencies in step mode.
    pub outputs: Vec<Unknown>,
    /// Unknowns of the initialization with their dependencies.
    pub initial_unknowns: Vec<Unknown>,
    /// Tolerated defects met while reading.
    #[serde(skip)]
    pub findings: Vec<Finding>,
    #[serde(skip)]
    by_name: HashMap<String, usize>,
    #[serde(skip)]
    places: Places,
}

/// Positions in the lists of a [`ModelDescription`], which may be long.
#[derive(Debug, Clone, Default)]
struct Places {
    /// of a unit of measurement, by its name
    units: HashMap<String, usize>,
    /// of a variable in the outputs
    outputs: HashMap<usize, usize>,
    /// of a variable in the initial unknowns
    initial_unknowns: HashMap<usize, usize>,
}

impl Places {
    fn new(units: &[UnitDefinition], outputs: &[Unknown], initial: &[Unknown]) -> Self {
        // of several, the first: it is entered last
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
    /// Index of the variable of that name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Highest order of derivatives of inputs that the unit is sure to take. The standard has a word
    /// for the first order only (`canInterpolateInputs`).
    #[must_use]
    pub fn input_derivative_order(&self) -> usize {
        if !self.co_simulation.can_interpolate_inputs {
            return 0;
        }
        self.derivatives.as_ref().map_or(1, |derivatives| derivatives.inputs.min(3))
    }

    /// Highest order of derivatives that an output is declared to offer.
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

    /// The unit of measurement of a variable, where it has one that is defined.
    #[must_use]
    pub fn unit_of(&self, variable: usize) -> Option<&UnitDefinition> {
        let name = self.variables[variable].unit.as_deref()?;
        self.places.units.get(name).map(|&k| &self.units[k])
    }

    /// The names of an Enumeration's values, where they are defined.
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

    /// The inputs that it depends on; all of them, where the description leaves it open.
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
