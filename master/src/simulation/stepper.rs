//! Steps the units of a run: algorithms, signals, and control of the step size.

use std::sync::Arc;

use super::limits::{Limit, Limits};
use super::loops::AlgebraicLoop;
use super::setup::Setup;
use crate::participant::Participant;
use crate::system::Port;
use coupling::{
    Control, Coupling, Exchange, ExchangeState, Mark, PowerMeter, SignalIndex, UnitIndex, Workers,
};
use fmi2_import::instance::FmuError;
use fmi2_import::logger;
use results::summary::CouplingSummary;
use scenario::Estimate;

/// Steps all units of a run.
pub(super) struct Stepper {
    coupling: Coupling<Participant>,
    exchange: Exchange,
    control: Option<Control>,
    power: PowerMeter,
    mark: Mark,
    workers: Arc<Workers>,
    /// sentences about missing capabilities of units
    limits: Vec<String>,
    /// number of arrivals that have been handled
    handled: u64,
}

/// State of the stepping itself at a communication point, for a checkpoint.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct StepperState {
    exchange: ExchangeState,
    algorithms: Vec<Vec<u8>>,
    control: Option<[f64; 3]>,
}

impl Stepper {
    /// Reads the outputs at the start, passes them to the inputs, and creates the algorithms.
    pub(super) fn start(
        setup: &Setup,
        mut exchange: Exchange,
        participants: &mut [Participant],
    ) -> Result<Self, FmuError> {
        let Setup { scenario, system, coupling: layout, .. } = setup;
        exchange.start(scenario.experiment.start, participants)?;
        exchange.fill_given(scenario.experiment.start, 0.0);
        exchange.preset_inputs(participants)?;
        let limits = Limits::of(setup, participants);
        let settings = &scenario.algorithm;
        let workers = Arc::new(Workers::new(settings.threads));
        let extrapolated =
            exchange.signals_between(|source, target| layout.schedule.extrapolates(source, target));
        let signal = |port| signal(&exchange, participants, port);
        let pairs = layout.power.iter();
        let pairs: Vec<(SignalIndex, SignalIndex)> =
            pairs.filter_map(|&(effort, flow)| Some((signal(effort)?, signal(flow)?))).collect();
        let power = PowerMeter::new(&pairs, &extrapolated);
        let variable = settings.variable.filter(|_| !limits.contains(&Limit::VariableStep));
        let degree = settings.degree();
        let control = variable.map(|variable| {
            let doubling = variable.estimate == Estimate::Doubling;
            let mut watched =
                if doubling { exchange.signals_between(|_, _| true) } else { extrapolated };
            // a smaller step does not make held signals more exact
            watched.retain(|&signal| !exchange.signal(signal).is_held());
            Control::new(variable, degree, watched)
        });
        let coupling = Coupling::new(&layout.schedule, &exchange, &workers);
        let mut limits = limits.sentences(system);
        limits.extend(layout.loops.iter().filter_map(AlgebraicLoop::limit));
        let (handled, mark) = (logger::arrived(), Mark::default());
        Ok(Self { coupling, exchange, control, power, mark, workers, limits, handled })
    }

    /// Adds sentences about what limits the coupling.
    pub(super) fn add_limits(&mut self, limits: Vec<String>) {
        self.limits.extend(limits);
    }

    /// From now on sends values only to a unit that has refused derivatives of its inputs.
    pub(super) fn hold_inputs(&mut self, k: UnitIndex, participant: &mut Participant) {
        participant.hold_inputs();
        if !participant.has_own_steps() {
            self.exchange.hold_inputs(k);
        }
        self.limits.push(format!(
            "{} {}",
            participant.instance().name(),
            Limit::Refused.sentence()
        ));
    }

    /// Marks outputs that jump with the first step of their units.
    pub(super) fn expect_jumps(&mut self, participants: &[Participant], outputs: &[Port]) {
        for &port in outputs {
            if let Some(output) = participants[port.instance].output(port.variable) {
                self.exchange.expect_jump(port.instance.into(), output);
            }
        }
    }

    /// The signals between the units.
    pub(super) fn exchange(&self) -> &Exchange {
        &self.exchange
    }

    /// Steps all units from `time` by `size`.
    pub(super) fn step(
        &mut self,
        participants: &mut [Participant],
        time: f64,
        size: f64,
    ) -> Result<(), FmuError> {
        let Self { coupling, exchange, control, power, .. } = self;
        match control {
            Some(control) => {
                let mut after = |exchange: &Exchange, end, size| power.add(exchange, end, size);
                control.advance(coupling, exchange, participants, (time, size), &mut after)?;
            }
            None => {
                coupling.step(exchange, participants, time, size)?;
                power.add(exchange, time + size, size);
            }
        }
        if logger::arrived() != self.handled {
            self.handle_refusals(participants);
        }
        Ok(())
    }

    /// Steps all units by a size that is not controlled.
    pub(super) fn short_step(
        &mut self,
        participants: &mut [Participant],
        time: f64,
        size: f64,
    ) -> Result<(), FmuError> {
        let Self { coupling, exchange, power, .. } = self;
        coupling.step(exchange, participants, time, size)?;
        power.add(exchange, time + size, size);
        Ok(())
    }

    /// Marks this communication point, for [`go_back`](Self::go_back).
    pub(super) fn mark(&mut self, participants: &mut [Participant]) -> Result<(), FmuError> {
        let Self { exchange, control, power, mark, .. } = self;
        mark.set(exchange, control.as_ref(), power, participants)
    }

    /// Returns to the communication point that was last marked.
    pub(super) fn go_back(&mut self, participants: &mut [Participant]) -> Result<(), FmuError> {
        let Self { exchange, control, power, mark, .. } = self;
        mark.restore(exchange, control.as_mut(), power, participants)
    }

    /// Discards the history of all signals: values have jumped.
    pub(super) fn begin_anew(&mut self) {
        self.exchange.begin_anew();
    }

    #[cold]
    fn handle_refusals(&mut self, participants: &mut [Participant]) {
        self.handled = logger::arrived();
        for (k, participant) in participants.iter_mut().enumerate() {
            if participant.refuses_derivatives() {
                self.hold_inputs(UnitIndex(k), participant);
            }
        }
    }

    /// Number of steps that were rejected because their error was too large.
    pub(super) fn rejected(&self) -> u64 {
        self.control.as_ref().map_or(0, |control| control.report().rejected)
    }

    /// Sentences about missing capabilities of units.
    pub(super) fn limits(&self) -> &[String] {
        &self.limits
    }

    /// Counts of steps, iterations and limits for the summary.
    pub(super) fn report(&self) -> CouplingSummary {
        CouplingSummary {
            threads: self.workers.threads(),
            limits: self.limits.clone(),
            iterations: self.coupling.iterations().copied().collect(),
            steps: self.control.as_ref().map(|control| *control.report()),
            power: self.power.report(),
        }
    }

    /// The state at this communication point.
    pub(super) fn state(&self) -> StepperState {
        StepperState {
            exchange: self.exchange.state().clone(),
            algorithms: self.coupling.state(),
            control: self.control.as_ref().map(Control::state),
        }
    }

    /// Restores such a state; false if it does not fit this coupling.
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
fn signal(exchange: &Exchange, participants: &[Participant], port: Port) -> Option<SignalIndex> {
    let output = participants[port.instance].output(port.variable)?;
    exchange.signals(port.instance.into()).find(|&signal| exchange.origin(signal).1 == output)
}
