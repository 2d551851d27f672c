//! The linearisation that a unit reports.

use std::collections::HashMap;

use serde::Deserialize;

use super::error::LinearError;
use super::rows::{Entry, Rows};
use super::unit::{LinearUnit, Quantity};
use fmi2_import::description::{Causality, ModelDescription, Type, Variable};
use master::system::VariableIndex;

/// ẋ = A x + B u, y = C x + D u from the report `linear`: names of the states, value references of Real
/// inputs and outputs, and the nonzero entries of the matrices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    pub(super) states: Vec<String>,
    pub(super) inputs: Vec<u32>,
    pub(super) outputs: Vec<u32>,
    pub(super) a: Vec<Entry>,
    pub(super) b: Vec<Entry>,
    pub(super) c: Vec<Entry>,
    pub(super) d: Vec<Entry>,
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

impl Report {
    /// Reads a report.
    ///
    /// # Errors
    /// The text is not such a report, or an entry is outside its matrix or not finite.
    pub fn read(instance: &str, text: &str) -> Result<Self, LinearError> {
        let wrong =
            |message: String| LinearError::Report { instance: instance.to_owned(), message };
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
            entries.into_iter().map(entry).collect::<Result<Vec<Entry>, LinearError>>()
        };
        let (a, b) = (matrix("a", a, x, x)?, matrix("b", b, x, u)?);
        let (c, d) = (matrix("c", c, y, x)?, matrix("d", d, y, u)?);
        Ok(Self { states, inputs, outputs, a, b, c, d })
    }

    /// The unit: its connected variables first, then the others of the report. Connected inputs that the
    /// report leaves out have no effect.
    ///
    /// # Errors
    /// The report leaves out a connected output, or lists a value reference that belongs to no Real variable.
    pub fn into_unit(
        self,
        instance: &str,
        description: &ModelDescription,
        inputs: &[VariableIndex],
        outputs: &[VariableIndex],
    ) -> Result<LinearUnit, LinearError> {
        let variables = |list: &[VariableIndex]| -> Vec<&Variable> {
            list.iter().map(|&k| &description.variables[k]).collect()
        };
        let columns = Columns::new(
            instance,
            description,
            &self.inputs,
            &variables(inputs),
            Causality::Input,
        )?;
        let rows = Columns::new(
            instance,
            description,
            &self.outputs,
            &variables(outputs),
            Causality::Output,
        )?;
        if let Some(missing) = rows.order[..outputs.len()].iter().position(Option::is_none) {
            return Err(LinearError::Missing {
                instance: instance.to_owned(),
                output: rows.quantities[missing].name.clone(),
            });
        }
        let (x, y) = (self.states.len(), self.outputs.len());
        let place = |column: usize| columns.place[column];
        Ok(LinearUnit {
            name: instance.to_owned(),
            a: Rows::new(x, &self.a),
            b: Rows::new(x, &self.b).renumbered(place),
            c: Rows::new(y, &self.c).chosen(&rows.order),
            d: Rows::new(y, &self.d).chosen(&rows.order).renumbered(place),
            states: self.states,
            inputs: columns.quantities,
            outputs: rows.quantities,
            connected_inputs: inputs.len(),
            connected_outputs: outputs.len(),
        })
    }
}

/// The order of a unit's inputs or outputs.
struct Columns {
    quantities: Vec<Quantity>,
    /// Position in the report, of each.
    order: Vec<Option<usize>>,
    /// Place of each position in the report.
    place: Vec<Option<usize>>,
}

impl Columns {
    fn new(
        instance: &str,
        description: &ModelDescription,
        reported: &[u32],
        connected: &[&Variable],
        causality: Causality,
    ) -> Result<Self, LinearError> {
        let quantity = |it: &Variable| Quantity { name: it.name.clone(), unit: it.unit.clone() };
        let positions: HashMap<u32, usize> =
            reported.iter().enumerate().map(|(k, &reference)| (reference, k)).collect();
        let mut place = vec![None; reported.len()];
        let (mut quantities, mut order) = (Vec::new(), Vec::new());
        for variable in connected {
            debug_assert_eq!(variable.kind, Type::Real);
            let position = positions.get(&variable.value_reference).copied();
            if let Some(position) = position {
                place[position] = Some(quantities.len());
            }
            quantities.push(quantity(variable));
            order.push(position);
        }
        for (position, &reference) in reported.iter().enumerate() {
            if place[position].is_some() {
                continue;
            }
            let alike = || {
                let all = description.variables.iter();
                all.filter(move |it| it.kind == Type::Real && it.value_reference == reference)
            };
            let found = alike().find(|it| it.causality == causality).or_else(|| alike().next());
            let Some(variable) = found else {
                return Err(LinearError::Report {
                    instance: instance.to_owned(),
                    message: format!("value reference {reference} belongs to no Real variable"),
                });
            };
            place[position] = Some(quantities.len());
            quantities.push(quantity(variable));
            order.push(Some(position));
        }
        Ok(Self { quantities, order, place })
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
            Report::read("beam", &text)
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
