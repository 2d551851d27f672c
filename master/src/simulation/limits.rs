//! What limits the coupling: what units do not declare, do not keep, or lack.

use super::needs::Needs;
use crate::coupling::{Blueprint, Unit as _};
use crate::participant::Participant;
use crate::system::System;
use scenario::Scenario;

/// What a unit lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Limit {
    Interpolation,
    /// so many derivatives, and no more
    InputOrder(usize),
    Refused,
    OutputDerivatives,
    WithheldOutputs,
    State,
    Directional,
    VariableStep,
}

impl Limit {
    pub(super) fn sentence(self) -> String {
        let sentence = match self {
            Self::InputOrder(order) => {
                return format!(
                    "takes derivatives of inputs up to order {order} (canInterpolateInputs declares no \
                     more, and more is not tried): the coupling is of order {}; for a unit that is known \
                     to take more, set \"input_derivatives\" of the instance",
                    order + 1
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
                "gives no derivatives of outputs (maxOutputDerivativeOrder): they are taken from \
                 history, which is missing at the start"
            }
            Self::WithheldOutputs => {
                "does not give all derivatives of outputs that it declares (maxOutputDerivativeOrder): \
                 they are taken from history, which is missing at the start"
            }
            Self::State => {
                "cannot save its state (canGetAndSetFMUstate): its steps are made once, with \
                 extrapolated inputs"
            }
            Self::Directional => {
                "gives no directional derivatives (providesDirectionalDerivative): Newton's method \
                 takes differences of steps"
            }
            Self::VariableStep => {
                "needs equal steps (canHandleVariableCommunicationStepSize): the step stays as it is"
            }
        };
        sentence.to_owned()
    }
}

/// What which instances lack.
#[derive(Default)]
pub(super) struct Limits(Vec<(Limit, Vec<usize>)>);

impl Limits {
    /// Notes it once per unit, with the instances in the order of the scenario.
    pub(super) fn add(&mut self, system: &System, instance: usize, limit: Limit) {
        let unit = |k: usize| system.instances[k].package.path();
        let known = self.0.iter_mut().find(|(it, instances)| {
            *it == limit && instances.first().is_some_and(|&first| unit(first) == unit(instance))
        });
        match known {
            Some((_, instances)) => instances.push(instance),
            None => self.0.push((limit, vec![instance])),
        }
    }

    pub(super) fn contains(&self, limit: Limit) -> bool {
        self.0.iter().any(|(it, _)| *it == limit)
    }

    pub(super) fn find(
        &mut self,
        scenario: &Scenario,
        system: &System,
        blueprint: &Blueprint,
        participants: &[Participant],
    ) {
        let settings = &scenario.algorithm;
        let needs = Needs::of(scenario, blueprint);
        for (k, participant) in participants.iter().enumerate() {
            let able = participant.capabilities();
            let unit = &system.instances[k].description().co_simulation;
            let plan = &system.instances[k];
            let taken = if plan.steps > 1 { 3 } else { plan.input_derivative_order() };
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
                (Limit::State, !able.restore && needs.states.contains(&k)),
                (Limit::Directional, !able.directional && needs.directional.contains(&k)),
                (Limit::VariableStep, !able.variable_step && settings.variable.is_some()),
            ];
            for (limit, _) in found.into_iter().filter(|(_, found)| *found) {
                self.add(system, k, limit);
            }
        }
    }

    pub(super) fn sentences(&self, system: &System) -> Vec<String> {
        let name = |k: usize| system.instances[k].name.as_str();
        let sentence = |(limit, instances): &(Limit, Vec<usize>)| {
            let who = match instances[..] {
                [] => String::new(),
                [one] => name(one).to_owned(),
                [first, ..] => format!("{} and {} more like it", name(first), instances.len() - 1),
            };
            format!("{who} {}", limit.sentence())
        };
        self.0.iter().map(sentence).collect()
    }
}
