//! The linearisation that a unit reports.

use std::collections::HashMap;

use serde::Deserialize;

use super::error::ModesError;
use crate::system::VariableIndex;
use fmi2_import::description::{ModelDescription, Type};

/// One entry of a sparse matrix: row, column, value.
type Entry = (usize, usize, f64);

/// ẋ = A x + B u, y = C x + D u from the report `linear`: names of the states, value references of Real
/// inputs and outputs, and the nonzero entries of the matrices.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct StateSpace {
    /// Names of the states, for people.
    pub states: Vec<String>,
    inputs: Vec<u32>,
    outputs: Vec<u32>,
    a: Vec<Entry>,
    b: Vec<Entry>,
    c: Vec<Entry>,
    d: Vec<Entry>,
}

/// A sparse matrix by rows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    entries: Vec<Vec<(usize, f64)>>,
}

impl Rows {
    fn new(count: usize, entries: &[Entry]) -> Self {
        let mut rows = vec![Vec::new(); count];
        for &(i, j, value) in entries {
            rows[i].push((j, value));
        }
        Self { entries: rows }
    }

    /// The rows in that order; `None` is a row of zeros.
    fn chosen(&self, order: &[Option<usize>]) -> Self {
        let row = |k: &Option<usize>| k.map(|k| self.entries[k].clone()).unwrap_or_default();
        Self { entries: order.iter().map(row).collect() }
    }

    /// The same with other column numbers; columns without a place are left out.
    fn renumbered(&self, place: impl Fn(usize) -> Option<usize>) -> Self {
        let entries = self
            .entries
            .iter()
            .map(|row| row.iter().filter_map(|&(j, x)| Some((place(j)?, x))).collect())
            .collect();
        Self { entries }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Row times vector.
    pub fn times(&self, row: usize, x: impl Fn(usize) -> f64) -> f64 {
        self.entries[row].iter().map(|&(j, value)| value * x(j)).sum()
    }

    /// Every entry: row, column, value.
    pub fn iter(&self) -> impl Iterator<Item = Entry> + '_ {
        self.entries
            .iter()
            .enumerate()
            .flat_map(|(i, row)| row.iter().map(move |&(j, value)| (i, j, value)))
    }
}

/// A unit's linearisation between the inputs and outputs that are connected, in their order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Linear {
    /// Number of states.
    pub states: usize,
    /// A.
    pub a: Rows,
    /// B.
    pub b: Rows,
    /// C.
    pub c: Rows,
    /// D.
    pub d: Rows,
}

impl StateSpace {
    /// Reads a report.
    ///
    /// # Errors
    /// The text is not such a report.
    pub fn read(instance: &str, text: &str) -> Result<Self, ModesError> {
        let wrong = |message: String| ModesError::Report { instance: instance.to_owned(), message };
        let read: Self = serde_json::from_str(text).map_err(|e| wrong(e.to_string()))?;
        let (x, u, y) = (read.states.len(), read.inputs.len(), read.outputs.len());
        for (name, entries, rows, columns) in
            [("a", &read.a, x, x), ("b", &read.b, x, u), ("c", &read.c, y, x), ("d", &read.d, y, u)]
        {
            if let Some(entry) = entries
                .iter()
                .find(|(i, j, value)| *i >= rows || *j >= columns || !value.is_finite())
            {
                return Err(wrong(format!("{name} has the entry {entry:?}")));
            }
        }
        Ok(read)
    }

    /// Reduced to connected variables. Inputs that the report leaves out have no effect.
    ///
    /// # Errors
    /// The report leaves out a connected output.
    pub fn between(
        &self,
        instance: &str,
        description: &ModelDescription,
        inputs: &[VariableIndex],
        outputs: &[VariableIndex],
    ) -> Result<Linear, ModesError> {
        let reference = |k: VariableIndex| {
            let variable = &description.variables[k];
            debug_assert_eq!(variable.kind, Type::Real);
            variable.value_reference
        };
        let known: HashMap<u32, usize> =
            self.outputs.iter().enumerate().map(|(k, &reference)| (reference, k)).collect();
        let mut order = Vec::with_capacity(outputs.len());
        for &output in outputs {
            let place = known.get(&reference(output)).copied();
            if place.is_none() {
                return Err(ModesError::Missing {
                    instance: instance.to_owned(),
                    output: description.variables[output].name.clone(),
                });
            }
            order.push(place);
        }
        let places: HashMap<u32, usize> =
            inputs.iter().enumerate().map(|(k, &input)| (reference(input), k)).collect();
        let place = |column: usize| places.get(&self.inputs[column]).copied();
        let (x, y) = (self.states.len(), self.outputs.len());
        Ok(Linear {
            states: x,
            a: Rows::new(x, &self.a),
            b: Rows::new(x, &self.b).renumbered(place),
            c: Rows::new(y, &self.c).chosen(&order),
            d: Rows::new(y, &self.d).chosen(&order).renumbered(place),
        })
    }
}
