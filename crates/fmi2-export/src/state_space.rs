//! A unit's linearisation as a report, for masters that want the modes of a whole system.

use serde::Serialize;

use crate::{Error, RealVar, RealVars};

/// ẋ = A x + B u, y = C x + D u: small motions of the unit about its current state, the answer to
/// the report [`StateSpace::REQUEST`].
///
/// As JSON: `states` are names for display, `inputs` and `outputs` value references of Real
/// variables, `a` to `d` the entries that are not zero as `[row, column, value]`, in SI units.
/// Inputs and outputs that are not listed are zero.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct StateSpace {
    states: Vec<String>,
    inputs: Vec<u32>,
    outputs: Vec<u32>,
    a: Vec<(usize, usize, f64)>,
    b: Vec<(usize, usize, f64)>,
    c: Vec<(usize, usize, f64)>,
    d: Vec<(usize, usize, f64)>,
}

impl StateSpace {
    /// The request that it answers.
    pub const REQUEST: &'static str = "linear";

    /// Adds a state and gives its index.
    pub fn state(&mut self, name: impl Into<String>) -> usize {
        self.states.push(name.into());
        self.states.len() - 1
    }

    /// Adds an input and gives its index.
    pub fn input(&mut self, variable: RealVar) -> usize {
        self.inputs.push(variable.value_reference());
        self.inputs.len() - 1
    }

    /// Adds an output and gives its index.
    pub fn output(&mut self, variable: RealVar) -> usize {
        self.outputs.push(variable.value_reference());
        self.outputs.len() - 1
    }

    /// Adds a row of inputs and gives the index of its first.
    pub fn inputs(&mut self, row: RealVars) -> usize {
        let first = self.inputs.len();
        self.inputs.extend((0..row.len()).map(|k| row.get(k).value_reference()));
        first
    }

    /// Adds a row of outputs and gives the index of its first.
    pub fn outputs(&mut self, row: RealVars) -> usize {
        let first = self.outputs.len();
        self.outputs.extend((0..row.len()).map(|k| row.get(k).value_reference()));
        first
    }

    /// Adds to ∂ẋᵢ/∂xⱼ.
    pub fn a(&mut self, i: usize, j: usize, value: f64) {
        enter(&mut self.a, i, j, value);
    }

    /// Adds to ∂ẋᵢ/∂uⱼ.
    pub fn b(&mut self, i: usize, j: usize, value: f64) {
        enter(&mut self.b, i, j, value);
    }

    /// Adds to ∂yᵢ/∂xⱼ.
    pub fn c(&mut self, i: usize, j: usize, value: f64) {
        enter(&mut self.c, i, j, value);
    }

    /// Adds to ∂yᵢ/∂uⱼ.
    pub fn d(&mut self, i: usize, j: usize, value: f64) {
        enter(&mut self.d, i, j, value);
    }

    /// The report's text.
    ///
    /// # Errors
    /// An entry is not finite.
    pub fn to_json(&self) -> Result<String, Error> {
        for (name, entries) in [("a", &self.a), ("b", &self.b), ("c", &self.c), ("d", &self.d)] {
            if let Some((i, j, value)) = entries.iter().find(|entry| !entry.2.is_finite()) {
                return Err(Error::invalid(format!(
                    "{name}[{i}][{j}] of the linearisation is {value}; all entries must be finite"
                )));
            }
        }
        serde_json::to_string(self).map_err(Error::invalid)
    }
}

fn enter(entries: &mut Vec<(usize, usize, f64)>, i: usize, j: usize, value: f64) {
    if value != 0.0 {
        entries.push((i, j, value));
    }
}
