//! Limits of the coupling: capabilities that units do not declare, or declare without having them.

use super::setup::Setup;
use crate::participant::Participant;
use crate::system::{InstanceIndex, System};
use coupling::Unit as _;

/// A missing capability.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Limit {
    Interpolation,
    /// derivatives of inputs up to this order only
    InputOrder(usize),
    Refused,
    OutputDerivatives,
    WithheldOutputs,
    /// outputs without second derivatives in a coupling of order 6
    Cubic(String),
    State,
    Directional,
    VariableStep,
}

impl Limit {
    pub(super) fn sentence(&self) -> String {
        let sentence = match self {
            Self::InputOrder(3..) => {
                "takes derivatives of some inputs up to order 3 only (as it declares, or by \
                 \"input_derivatives\"): the coupling through them is of order 4"
            }
            Self::InputOrder(order) => {
                return format!(
                    "takes derivatives of inputs up to order {order} (canInterpolateInputs declares only \
                     that, and higher orders are not tried): the coupling is of order {}; for a unit \
                     that is known to take more, set \"input_derivatives\" of the instance",
                    order + 1
                );
            }
            Self::Cubic(outputs) => {
                return format!(
                    "declares no second derivatives of {outputs}, which are interpolated by cubics: the \
                     coupling through them is of order 4"
                );
            }
            Self::Refused => {
                "declares canInterpolateInputs and refused derivatives of inputs: its inputs are held \
                 over a step, so the coupling is of order 1"
            }
            Self::Interpolation => {
                "takes no derivatives of inputs (canInterpolateInputs): its inputs are held over a \
                 step, so the coupling is of order 1"
            }
            Self::OutputDerivatives => {
                "has no derivatives of outputs (maxOutputDerivativeOrder): they are computed from \
                 history, which is missing at the start"
            }
            Self::WithheldOutputs => {
                "does not return all derivatives of outputs that it declares (maxOutputDerivativeOrder): \
                 they are computed from history, which is missing at the start"
            }
            Self::State => {
                "cannot save its state (canGetAndSetFMUstate): its steps are not repeated, and its \
                 inputs are extrapolated"
            }
            Self::Directional => {
                "has no directional derivatives (providesDirectionalDerivative): Newton's method \
                 uses differences of steps"
            }
            Self::VariableStep => {
                "needs equal steps (canHandleVariableCommunicationStepSize): the step is not varied"
            }
        };
        sentence.to_owned()
    }
}

/// The missing capabilities, each with the instances that lack it.
#[derive(Default)]
pub(super) struct Limits(Vec<(Limit, Vec<InstanceIndex>)>);

impl Limits {
    /// Adds a limit. Instances of one unit are listed together, in the order of the scenario.
    fn add(&mut self, system: &System, instance: InstanceIndex, limit: Limit) {
        let unit = |k: InstanceIndex| system.instances[k].package.path();
        let known = self.0.iter_mut().find(|(it, instances)| {
            *it == limit && instances.first().is_some_and(|&first| unit(first) == unit(instance))
        });
        match known {
            Some((_, instances)) => instances.push(instance),
            None => self.0.push((limit, vec![instance])),
        }
    }

    pub(super) fn contains(&self, limit: &Limit) -> bool {
        self.0.iter().any(|(it, _)| it == limit)
    }

    /// Finds the limits of a run.
    pub(super) fn of(setup: &Setup, participants: &[Participant]) -> Self {
        let Setup { scenario, system, coupling, .. } = setup;
        let settings = &scenario.algorithm;
        let (saved, differentiated) = (coupling.saved(scenario), coupling.differentiated());
        let mut limits = Self::default();
        for (participant, (k, instance)) in participants.iter().zip(system.indexed()) {
            let able = participant.capabilities();
            let cubic = &participant.variables().cubic;
            let names = cubic.iter().map(|&it| instance.description().variables[it].name.as_str());
            let cubic_names = abridged(names);
            let unit = &instance.description().co_simulation;
            let taken = if instance.steps > 1 { 5 } else { instance.input_derivative_order() };
            let found = [
                (Limit::Interpolation, participant.takes_reals() && !unit.can_interpolate_inputs),
                (Limit::InputOrder(taken), taken > 0 && taken < participant.wanted_order()),
                (
                    Limit::OutputDerivatives,
                    participant.gives_reals()
                        && settings.derivatives
                        && unit.max_output_derivative_order == 0,
                ),
                (Limit::WithheldOutputs, participant.withholds_outputs()),
                (Limit::Cubic(cubic_names), !cubic.is_empty()),
                (Limit::State, !able.restore && saved.contains(&k)),
                (Limit::Directional, !able.directional && differentiated.contains(&k)),
                (Limit::VariableStep, !able.variable_step && settings.variable.is_some()),
            ];
            for (limit, _) in found.into_iter().filter(|(_, found)| *found) {
                limits.add(system, k, limit);
            }
        }
        limits
    }

    pub(super) fn sentences(&self, system: &System) -> Vec<String> {
        let name = |k: InstanceIndex| system.instances[k].name.as_str();
        let sentence = |(limit, instances): &(Limit, Vec<InstanceIndex>)| {
            let subject = match instances[..] {
                [] => String::new(),
                [one] => name(one).to_owned(),
                [first, ..] => {
                    format!("{} (and {} more like it)", name(first), instances.len() - 1)
                }
            };
            format!("{subject} {}", limit.sentence())
        };
        self.0.iter().map(sentence).collect()
    }
}

/// The first of some names, and how many more.
fn abridged<'a>(mut names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let first = names.next().unwrap_or_default().to_owned();
    if names.len() == 0 { first } else { format!("{first} and {} more outputs", names.len()) }
}
