//! The linearisation that a unit reports.

use std::collections::HashMap;

use faer::Mat;
use serde::Deserialize;

use super::continuous::balanced;
use super::error::ModesError;
use crate::system::VariableIndex;
use fmi2_import::description::{ModelDescription, Type};

/// One entry of a sparse matrix: row, column, value.
type Entry = (usize, usize, f64);

/// ẋ = A x + B u, y = C x + D u from the report `linear`: names of the states, value references of Real
/// inputs and outputs, and the nonzero entries of the matrices.
#[derive(Debug, Clone, Default, PartialEq)]
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
    /// From the nonzero entries, each inside the matrix.
    pub fn new(count: usize, entries: &[Entry]) -> Self {
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

impl Linear {
    /// Size of the largest eigenvalue of A (1/s).
    ///
    /// # Errors
    /// The eigenvalues cannot be found.
    pub fn rate(&self) -> Result<f64, ModesError> {
        let mut a = Mat::<f64>::zeros(self.states, self.states);
        for (i, j, value) in self.a.iter() {
            a[(i, j)] += value;
        }
        let values = balanced(&a).eigenvalues().map_err(|_| ModesError::Eigenvalues)?;
        Ok(values.iter().map(|value| value.norm()).fold(0.0, f64::max))
    }
}

/// The report as written. JSON has no value that is not finite: units write null instead.
#[derive(Deserialize)]
struct Written {
    states: Vec<String>,
    inputs: Vec<u32>,
    outputs: Vec<u32>,
    a: Vec<(usize, usize, Option<f64>)>,
    b: Vec<(usize, usize, Option<f64>)>,
    c: Vec<(usize, usize, Option<f64>)>,
    d: Vec<(usize, usize, Option<f64>)>,
}

impl StateSpace {
    /// Reads a report.
    ///
    /// # Errors
    /// The text is not such a report, or an entry is outside its matrix or not finite.
    pub fn read(instance: &str, text: &str) -> Result<Self, ModesError> {
        let wrong = |message: String| ModesError::Report { instance: instance.to_owned(), message };
        let Written { states, inputs, outputs, a, b, c, d } =
            serde_json::from_str(text).map_err(|e| wrong(e.to_string()))?;
        let (x, u, y) = (states.len(), inputs.len(), outputs.len());
        let matrix = |name: &str, entries: Vec<(usize, usize, Option<f64>)>, rows, columns| {
            let entry = |(i, j, value): (usize, usize, Option<f64>)| {
                if i >= rows || j >= columns {
                    return Err(wrong(format!(
                        "{name}[{i}][{j}] is outside the matrix of {rows} rows and {columns} columns"
                    )));
                }
                let Some(value) = value.filter(|value| value.is_finite()) else {
                    return Err(wrong(format!("{name}[{i}][{j}] is not a finite number")));
                };
                Ok((i, j, value))
            };
            entries.into_iter().map(entry).collect::<Result<Vec<Entry>, ModesError>>()
        };
        let (a, b) = (matrix("a", a, x, x)?, matrix("b", b, x, u)?);
        let (c, d) = (matrix("c", c, y, x)?, matrix("d", d, y, u)?);
        Ok(Self { states, inputs, outputs, a, b, c, d })
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The entry that is wrong is named, with its unit; units write null for infinity and NaN.
    #[test]
    fn refusal_entries_that_are_not_finite_or_outside_are_named() {
        let read = |b: &str| {
            let text = format!(
                r#"{{"states": ["x", "v"], "inputs": [7], "outputs": [3],
                "a": [[0, 1, 1.0]], "b": [{b}], "c": [[0, 0, 1.0]], "d": []}}"#
            );
            StateSpace::read("beam", &text)
        };
        assert!(read("[1, 0, 2.5]").is_ok());
        for (entry, wanted) in [
            ("[1, 0, null]", "b[1][0] is not a finite number"),
            ("[1, 0, 1e999]", "out of range"),
            ("[1, 1, 2.5]", "b[1][1] is outside the matrix of 2 rows and 1 columns"),
        ] {
            let text = read(entry).unwrap_err().to_string();
            assert!(text.contains("beam") && text.contains(wanted), "{text}");
        }
    }
}
