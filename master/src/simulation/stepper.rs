//! What a run steps with: algorithms, signals, control of the step, and what they report.

use std::sync::Arc;

use super::limits::{Limit, Limits};
use super::loops::FeedLoop;
use super::plan::Layout;
use crate::coupling::{Control, Coupling, Crew, Exchange, ExchangeState, PowerMeter, SignalId};
use crate::participant::Participant;
use crate::system::{Port, System};
use fmi2_import::instance::FmuError;
use fmi2_import::logger;
use results::summary::CouplingSummary;
use scenario::{Estimate, Scenario};

/// Steps all units of a run.
pub(super) struct Stepper {
    coupling: Coupling<Participant>,
    exchange: Exchange,
    control: Option<Control>,
    power: PowerMeter,
    crew: Arc<Crew>,
    /// which capability of which unit limits the coupling
    limits: Vec<String>,
    /// news of all units that have been looked at
    heard: u64,
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
    ) -> Result<Self, FmuError> {
        exchange.start(scenario.experiment.start, participants)?;
        let mut limits = Limits::default();
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
        let heard = logger::arrived();
        Ok(Self { coupling, exchange, control, power, crew, limits, heard })
    }

    /// Adds sentences about what limits the coupling.
    pub(super) fn add_limits(&mut self, limits: Vec<String>) {
        self.limits.extend(limits);
    }

    /// Sends values only to a unit that has refused derivatives of its inputs.
    pub(super) fn hold_inputs(&mut self, k: usize, participant: &mut Participant) {
        participant.hold_inputs();
        if !participant.has_own_steps() {
            let inputs = participant.exchanged_reals().0.len();
            self.exchange.limit(k, vec![0; inputs]);
        }
        self.limits.push(format!(
            "{} {}",
            participant.instance().name(),
            Limit::Refused.sentence()
        ));
    }

    /// Notes which outputs are from before a jump that their units make with the first step.
    pub(super) fn expect_jumps(&mut self, participants: &[Participant], outputs: &[Port]) {
        for &port in outputs {
            if let Some(output) = participants[port.instance].output(port.variable) {
                self.exchange.expect_jump(port.instance, output);
            }
        }
    }

    /// The signals between the units.
    pub(super) fn exchange(&self) -> &Exchange {
        &self.exchange
    }

    /// Steps all units from `time` over `size`.
    pub(super) fn step(
        &mut self,
        participants: &mut [Participant],
        time: f64,
        size: f64,
    ) -> Result<(), FmuError> {
        let Self { coupling, exchange, control, power, .. } = self;
        match control {
            Some(control) => {
                let mut after = |exchange: &Exchange, end, size| power.take(exchange, end, size);
                control.advance(coupling, exchange, participants, (time, size), &mut after)?;
            }
            None => {
                coupling.step(exchange, participants, time, size)?;
                power.take(exchange, time + size, size);
            }
        }
        if logger::arrived() != self.heard {
            self.heed_refusals(participants);
        }
        Ok(())
    }

    #[cold]
    fn heed_refusals(&mut self, participants: &mut [Participant]) {
        self.heard = logger::arrived();
        for (k, participant) in participants.iter_mut().enumerate() {
            if participant.refuses_derivatives() {
                self.hold_inputs(k, participant);
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

    /// Counts of steps, iterations and limits for the summary.
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
