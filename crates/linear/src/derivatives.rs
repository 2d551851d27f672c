//! The linearisation of a unit that declares its states: FMI 2.0 lets a unit for co-simulation name
//! derivatives too, and give directional derivatives of them (section 2.2.8 of the standard).

use fmi2_import::description::{Causality, ModelDescription, Type, Variable};
use fmi2_import::instance::{FmuError, Instance};

use super::report::Report;
use super::rows::Entry;

/// Variables of the linearisation.
struct Names {
    states: Vec<(String, u32)>,
    derivatives: Vec<u32>,
    inputs: Vec<u32>,
    outputs: Vec<u32>,
}

impl Names {
    fn of(description: &ModelDescription) -> Self {
        let reals = || description.variables.iter().filter(|it| it.kind == Type::Real);
        let references = |causality: Causality| -> Vec<u32> {
            reals().filter(|it| it.causality == causality).map(|it| it.value_reference).collect()
        };
        let mut names = Self {
            states: Vec::new(),
            derivatives: Vec::new(),
            inputs: references(Causality::Input),
            outputs: references(Causality::Output),
        };
        for derivative in reals() {
            let state: Option<&Variable> =
                derivative.derivative_of.and_then(|k| description.variables.get(k));
            if let Some(state) = state.filter(|it| it.kind == Type::Real) {
                names.states.push((state.name.clone(), state.value_reference));
                names.derivatives.push(derivative.value_reference);
            }
        }
        names
    }
}

/// A unit's linearisation from its directional derivatives. None if it declares no states or gives no
/// directional derivatives.
///
/// # Errors
/// A call fails.
pub fn of(instance: &mut Instance) -> Result<Option<Report>, FmuError> {
    let description = instance.package().description();
    if !description.co_simulation.provides_directional_derivative {
        return Ok(None);
    }
    let names = Names::of(description);
    if names.states.is_empty() {
        return Ok(None);
    }
    let Names { states, derivatives, inputs, outputs } = names;
    let unknowns: Vec<u32> = derivatives.iter().chain(&outputs).copied().collect();
    let mut columns = |knowns: &[u32]| -> Result<[Vec<Entry>; 2], FmuError> {
        let (mut of_derivatives, mut of_outputs) = (Vec::new(), Vec::new());
        let mut column = vec![0.0; unknowns.len()];
        for (j, &known) in knowns.iter().enumerate() {
            column.fill(0.0);
            instance.get_directional_derivative(&unknowns, &[known], &[1.0], &mut column)?;
            for (i, &value) in column.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                match i.checked_sub(states.len()) {
                    None => of_derivatives.push((i, j, value)),
                    Some(i) => of_outputs.push((i, j, value)),
                }
            }
        }
        Ok([of_derivatives, of_outputs])
    };
    let references: Vec<u32> = states.iter().map(|it| it.1).collect();
    let [a, c] = columns(&references)?;
    let [b, d] = columns(&inputs)?;
    let states = states.into_iter().map(|it| it.0).collect();
    Ok(Some(Report { states, inputs, outputs, a, b, c, d }))
}
