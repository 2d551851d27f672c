//! What a run steps with: algorithms, signals, control of the step, and what they report.

use std::collections::HashSet;
use std::sync::Arc;

use super::loops::FeedLoop;
use super::plan::Layout;
use crate::coupling::{
    Blueprint, Control, Coupling, Crew, Exchange, ExchangeState, PowerMeter, SignalId, Unit as _,
};
use crate::instance::UnitError;
use crate::participant::Participant;
use crate::scenario::{AlgorithmName, Estimate, JacobianSource, Scenario};
use crate::summary::CouplingSummary;
use crate::system::{Port, System};

/// Steps all units of a run.
pub(super) struct Stepper {
    coupling: Coupling<Participant>,
    exchange: Exchange,
    control: Option<Control>,
    power: PowerMeter,
    crew: Arc<Crew>,
    /// which capability of which unit limits the coupling
    limits: Vec<String>,
}

/// What the stepping itself remembers at a communication point, for a checkpoint.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct StepperState {
    exchange: ExchangeState,
    algorithms: Vec<Vec<u8>>,
    control: Option<[f64; 2]>,
}

impl Stepper {
    /// Reads the outputs at the start, finds out what the units can do, and hands the outputs on.
    pub(super) fn start(
        scenario: &Scenario,
        system: &System,
        layout: &Layout,
        mut exchange: Exchange,
        participants: &mut [Participant],
    ) -> Result<Self, UnitError> {
        exchange.start(scenario.experiment.start, participants)?;
        let mut limits = Limits::default();
        for (k, participant) in participants.iter_mut().enumerate() {
            let wanted = participant.input_orders();
            let highest = participant.probe_inputs()?;
            if highest.iter().zip(&wanted).any(|(highest, wanted)| highest < wanted) {
                limits.add(system, k, Limit::InputOrder);
            }
            if !participant.has_own_steps() {
                exchange.limit(k, highest);
            }
            participant.probe_capabilities()?;
            // a unit may have complained about what was only probed
            participant.instance_mut().take_messages();
        }
        exchange.hand_over(participants)?;
        limits.find(scenario, system, &layout.blueprint, participants);
        let settings = &scenario.algorithm;
        let crew = Arc::new(Crew::of(settings.threads));
        let extrapolated = exchange
            .signals_between(|source, target| layout.blueprint.extrapolates(source, target));
        let pairs: Vec<(SignalId, SignalId)> = layout
            .power
            .iter()
            .filter_map(|&(effort, flow)| {
                Some((
                    signal(&exchange, participants, effort)?,
                    signal(&exchange, participants, flow)?,
                ))
            })
            .collect();
        let power = PowerMeter::new(&pairs, &extrapolated);
        let variable = settings.variable.filter(|_| !limits.contains(Limit::VariableStep));
        let degree = settings.degree();
        let control = variable.map(|variable| {
            let doubling = variable.estimate == Estimate::Doubling;
            let mut watched =
                if doubling { exchange.signals_between(|_, _| true) } else { extrapolated };
            // what is held changes by nothing that a smaller step could make more exact
            watched.retain(|&signal| !exchange.signal(signal).is_held());
            Control::new(variable, degree, watched)
        });
        let coupling = Coupling::new(&layout.blueprint, &exchange, &crew);
        let mut limits = limits.sentences(system);
        limits.extend(layout.loops.iter().filter_map(FeedLoop::limit));
        Ok(Self { coupling, exchange, control, power, crew, limits })
    }

    /// The signals between the units.
    #[cfg(feature = "modes")]
    pub(super) fn exchange(&self) -> &Exchange {
        &self.exchange
    }

    /// Steps all units from `time` over `size`.
    pub(super) fn step(
        &mut self,
        participants: &mut [Participant],
        time: f64,
        size: f64,
    ) -> Result<(), UnitError> {
        let Self { coupling, exchange, control, power, .. } = self;
        match control {
            Some(control) => {
                let mut after = |exchange: &Exchange, end, size| power.take(exchange, end, size);
                control.advance(coupling, exchange, participants, (time, size), &mut after)
            }
            None => {
                coupling.step(exchange, participants, time, size)?;
                power.take(exchange, time + size, size);
                Ok(())
            }
        }
    }

    /// Steps that were taken back because their error was too large.
    pub(super) fn rejected(&self) -> u64 {
        self.control.as_ref().map_or(0, |control| control.report().rejected)
    }

    /// Which capability of which unit limits the coupling.
    pub(super) fn limits(&self) -> &[String] {
        &self.limits
    }

    /// How it went.
    pub(super) fn report(&self) -> CouplingSummary {
        CouplingSummary {
            threads: self.crew.threads(),
            limits: self.limits.clone(),
            iterations: self.coupling.iterations().copied().collect(),
            steps: self.control.as_ref().map(|control| *control.report()),
            power: self.power.report(),
        }
    }

    /// What has to be kept to go on from this communication point later.
    pub(super) fn state(&self) -> StepperState {
        StepperState {
            exchange: self.exchange.state(),
            algorithms: self.coupling.state(),
            control: self.control.as_ref().map(Control::state),
        }
    }

    /// Goes back to such a state; false if it is not one of this coupling's.
    pub(super) fn restore(&mut self, state: &StepperState) -> bool {
        if let (Some(control), Some(state)) = (&mut self.control, state.control) {
            control.restore(state);
        }
        state.control.is_some() == self.control.is_some()
            && self.exchange.restore(&state.exchange)
            && self.coupling.restore(&state.algorithms)
    }
}

/// The signal of an output.
fn signal(exchange: &Exchange, participants: &[Participant], port: Port) -> Option<SignalId> {
    let output = participants[port.instance].output(port.variable)?;
    exchange.signals(port.instance).find(|&signal| exchange.origin(signal).1 == output)
}

/// What a unit lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Limit {
    Interpolation,
    InputOrder,
    OutputDerivatives,
    State,
    Directional,
    VariableStep,
}

impl Limit {
    fn sentence(self) -> &'static str {
        match self {
            Self::Interpolation => {
                "takes no derivatives of inputs (canInterpolateInputs): its inputs are held over a \
                 step, so the coupling is of order 1"
            }
            Self::InputOrder => {
                "takes fewer derivatives of inputs than are at hand: the order of the coupling is one \
                 more than it takes"
            }
            Self::OutputDerivatives => {
                "gives no derivatives of outputs (maxOutputDerivativeOrder): they are taken from \
                 history, which is missing at the start"
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
        }
    }
}

/// What which instances lack.
#[derive(Default)]
struct Limits(Vec<(Limit, Vec<usize>)>);

impl Limits {
    /// Notes it once per unit, with the instances in the order of the scenario.
    fn add(&mut self, system: &System, instance: usize, limit: Limit) {
        let unit = |k: usize| system.instances[k].package.path();
        let known = self.0.iter_mut().find(|(it, instances)| {
            *it == limit && instances.first().is_some_and(|&first| unit(first) == unit(instance))
        });
        match known {
            Some((_, instances)) => instances.push(instance),
            None => self.0.push((limit, vec![instance])),
        }
    }

    fn contains(&self, limit: Limit) -> bool {
        self.0.iter().any(|(it, _)| *it == limit)
    }

    fn find(
        &mut self,
        scenario: &Scenario,
        system: &System,
        blueprint: &Blueprint,
        participants: &[Participant],
    ) {
        let settings = &scenario.algorithm;
        let newton: HashSet<usize> = blueprint
            .blocks
            .iter()
            .filter(|block| block.name == AlgorithmName::Newton)
            .filter(|block| block.iteration.jacobian == JacobianSource::Directional)
            .flat_map(|block| block.members.iter().copied())
            .collect();
        let again: HashSet<usize> = blueprint.repeats().collect();
        for (k, participant) in participants.iter().enumerate() {
            let able = participant.capabilities();
            let unit = &system.instances[k].description().co_simulation;
            let takes = participant.takes_reals();
            let found = [
                (Limit::Interpolation, takes && !unit.can_interpolate_inputs),
                (
                    Limit::OutputDerivatives,
                    participant.gives_reals()
                        && settings.derivatives
                        && unit.max_output_derivative_order == 0,
                ),
                (
                    Limit::State,
                    !able.restore && (again.contains(&k) || settings.variable.is_some()),
                ),
                (Limit::Directional, !able.directional && newton.contains(&k)),
                (Limit::VariableStep, !able.variable_step && settings.variable.is_some()),
            ];
            for (limit, _) in found.into_iter().filter(|(_, found)| *found) {
                self.add(system, k, limit);
            }
        }
    }

    fn sentences(&self, system: &System) -> Vec<String> {
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
