//! What goes to and comes from an instance in every step.

use serde::{Deserialize, Serialize};

use crate::functions::Call;
use crate::per_type::PerNumeric;

/// Derivatives of Reals: one entry for each derivative.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DerivativeList {
    /// Value references of the Reals.
    pub references: Vec<u32>,
    /// Orders of the derivatives.
    pub orders: Vec<i32>,
}

/// The variables that are set and read in every step, by value references.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepLayout {
    /// Variables that are set before the step.
    pub set: PerNumeric<Vec<u32>>,
    /// Derivatives of inputs that are set before the step.
    pub set_derivatives: DerivativeList,
    /// The derivatives go out in several calls. Each call ends before this position in the list.
    pub set_derivative_calls: Vec<usize>,
    /// Variables that are read after the step.
    pub get: PerNumeric<Vec<u32>>,
    /// Derivatives of outputs that are read after the step.
    pub get_derivatives: DerivativeList,
}

impl StepLayout {
    /// The variables that a call in the exchange is about.
    pub(crate) fn references(&self, call: Call) -> &[u32] {
        match call {
            Call::fmi2SetReal => &self.set.reals,
            Call::fmi2SetInteger => &self.set.integers,
            Call::fmi2SetBoolean => &self.set.booleans,
            Call::fmi2SetRealInputDerivatives => &self.set_derivatives.references,
            Call::fmi2GetReal => &self.get.reals,
            Call::fmi2GetInteger => &self.get.integers,
            Call::fmi2GetBoolean => &self.get.booleans,
            Call::fmi2GetRealOutputDerivatives => &self.get_derivatives.references,
            _ => &[],
        }
    }
}

/// Values that are set, in the order of a [`StepLayout`].
#[derive(Debug, Clone, Copy)]
pub struct Sent<'a> {
    /// Values of the variables; Booleans as `fmi2Boolean`.
    pub values: PerNumeric<&'a [f64], &'a [i32], &'a [i32]>,
    /// Derivatives of inputs.
    pub derivatives: &'a [f64],
}

/// Places for the values that are read, in the order of a [`StepLayout`].
#[derive(Debug)]
pub struct Received<'a> {
    /// Values of the variables; Booleans as `fmi2Boolean`.
    pub values: PerNumeric<&'a mut [f64], &'a mut [i32], &'a mut [i32]>,
    /// Derivatives of outputs.
    pub derivatives: &'a mut [f64],
}
