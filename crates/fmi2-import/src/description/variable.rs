//! Variables with their types and roles.

use serde::Serialize;

use crate::per_type::CType;

/// Type of a variable.
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
    /// `fmi2Integer` in the C interface
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

/// Role of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "camelCase")]
pub enum Causality {
    /// Set before the run.
    Parameter,
    /// Computed from parameters.
    CalculatedParameter,
    /// Set from outputs of other FMUs.
    Input,
    /// Available to other FMUs.
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
    /// Until initialization.
    Fixed,
    /// Between steps.
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
    /// Name, unique in the FMU.
    pub name: String,
    /// Value reference, unique for a type except for aliases.
    pub value_reference: u32,
    /// Type of its values.
    #[serde(rename = "type")]
    pub kind: Type,
    /// Its role.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// How it gets its initial value; `None` for inputs and the independent variable.
    pub initial: Option<Initial>,
    /// Start value.
    pub start: Option<Value>,
    /// Unit of measure, by its name in `UnitDefinitions`.
    pub unit: Option<String>,
    /// Name of the unit of measure for display.
    pub display_unit: Option<String>,
    /// Smallest valid value.
    pub min: Option<f64>,
    /// Largest valid value.
    pub max: Option<f64>,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// What it means.
    pub description: Option<String>,
    /// Whether it is a difference, so that the offset of its unit of measure does not apply.
    pub relative_quantity: bool,
    /// Declared type, by its name in `TypeDefinitions`.
    pub declared_type: Option<String>,
    /// Index of the variable whose derivative it is, counted from 0.
    pub derivative_of: Option<usize>,
    /// Whether `initial` is in the description and not the default of the standard.
    #[serde(skip)]
    pub initial_given: bool,
}
