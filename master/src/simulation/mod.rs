//! Units that are loaded, connected and initialized, stepped one communication step at a time.
//!
//! ARCHITECTURE.md walks through the modules in the order in which they are used.

mod attempts;
mod limits;
mod loops;
mod needs;
mod plan;
mod selection;
mod setup;
mod stepper;
mod wiring;

use std::time::Instant;

use serde::{Deserialize, Serialize};

use self::attempts::Attempts;
pub use self::loops::FeedLoop;
pub use self::plan::Layout;
pub use self::selection::{Selection, base_unit, to_base};
pub use self::setup::Setup;
use self::stepper::{Stepper, StepperState};
use crate::coupling::{Blueprint, Exchange};
use crate::error::Error;
use crate::initialize::{initialize, late};
use crate::participant::{Between, Participant, Slot};
use crate::system::Port;
use crate::{Misfit, StateError};
use fmi2_import::instance::FmuError;
use fmi2_import::trace::Trace;
use results::summary::{CouplingSummary, SolvedLoop};
use scenario::Setting;

/// A running co-simulation: [`Setup::start`] makes it, [`step`](Self::step) advances it.
pub struct Simulation<'a> {
    setup: &'a Setup,
    stepper: Stepper,
    participants: Vec<Participant>,
    /// where the signals of interest are
    slots: Vec<(usize, Slot)>,
    loops: Vec<SolvedLoop>,
    /// what is worth telling of the start
    notes: Vec<String>,
    done: u64,
}

/// Everything of a [`Simulation`] that changes from step to step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimulationState {
    done: u64,
    units: Vec<UnitState>,
    stepper: StepperState,
}

/// The serialized FMU state of one instance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct UnitState {
    instance: String,
    /// whether it has refused derivatives of inputs
    held: bool,
    bytes: Vec<u8>,
    between: Option<Between>,
}

impl<'a> Simulation<'a> {
    pub(super) fn start(setup: &'a Setup) -> Result<Self, Error> {
        let mut attempts = Attempts::default();
        let trace = plan::trace(&setup.scenario)?;
        loop {
            let begin = Instant::now();
            match Self::attempt(setup, trace.as_ref(), &attempts) {
                Ok(mut started) => {
                    started.stepper.add_limits(attempts.limits());
                    return Ok(started);
                }
                Err(error) => attempts.learn(&setup.system, error, begin.elapsed())?,
            }
        }
    }

    fn attempt(setup: &'a Setup, trace: Option<&Trace>, earlier: &Attempts) -> Result<Self, Error> {
        let Setup { scenario, system, selection, layout, .. } = setup;
        let mut instances = plan::instantiate(scenario, system, trace, earlier.any())?;
        earlier.tell(&mut instances);
        let initialized =
            initialize(system, &mut instances, scenario.experiment, scenario.initialization)?;
        let time = scenario.experiment.start;
        let failed = |source| Error::Step { time, source };
        let (mut participants, exchange) =
            plan::plan(scenario, system, selection, instances, layout).map_err(failed)?;
        let mut stepper = Stepper::start(scenario, system, layout, exchange, &mut participants)
            .map_err(failed)?;
        let now = |port: Port| {
            let participant = participants.get(port.instance)?;
            Some(participant.value(participant.slot(port.variable)?))
        };
        let tolerance = scenario.initialization.tolerance;
        let late = late::find(system, &initialized.outputs, tolerance, now);
        stepper.expect_jumps(&participants, &late.stale);
        let slots = selection.slots(&participants);
        let loops = initialized.loops;
        Ok(Self { setup, stepper, participants, slots, loops, notes: late.notes, done: 0 })
    }

    /// The units, the signals between them, and which algorithm steps which.
    pub(crate) fn parts(&mut self) -> (&mut [Participant], &Exchange, &Blueprint) {
        (&mut self.participants, self.stepper.exchange(), &self.setup.layout.blueprint)
    }

    /// Advances by one communication step.
    ///
    /// # Errors
    /// A unit fails; nothing can be stepped after that.
    #[inline]
    pub fn step(&mut self) -> Result<(), Error> {
        let time = self.time();
        let size = self.setup.scenario.experiment.size(self.done);
        self.stepper
            .step(&mut self.participants, time, size)
            .map_err(|source| self.failed(time, source))?;
        self.done += 1;
        Ok(())
    }

    #[cold]
    fn failed(&self, time: f64, source: FmuError) -> Error {
        match self.blown_up().filter(|_| source.fault().may_be_numeric()) {
            Some(loops) => Error::Diverged { time, loops, source: Some(source) },
            None => Error::Step { time, source },
        }
    }

    /// Whether the loops of direct feed-through that the algorithm cuts have stayed within bounds.
    ///
    /// # Errors
    /// They have not: what they computed is of no use.
    pub fn check_loops(&self) -> Result<(), Error> {
        match self.blown_up() {
            Some(loops) => Err(Error::Diverged { time: self.time(), loops, source: None }),
            None => Ok(()),
        }
    }

    /// The loops that have not, by the names of their outputs.
    fn blown_up(&self) -> Option<String> {
        let Setup { system, layout, .. } = self.setup;
        let value = |port: Port| self.participants[port.instance].real_output(port.variable);
        let blown = layout.loops.iter().filter(|it| it.has_blown_up(system, value));
        let names: Vec<&str> = blown.map(|it| it.names.as_str()).collect();
        (!names.is_empty()).then(|| names.join("; "))
    }

    /// Number of finished steps.
    #[must_use]
    pub fn done(&self) -> u64 {
        self.done
    }

    /// Number of steps until the stop time.
    #[must_use]
    pub fn remaining(&self) -> u64 {
        self.setup.steps.saturating_sub(self.done)
    }

    /// The time that has been reached (s).
    #[must_use]
    pub fn time(&self) -> f64 {
        self.setup.time_after(self.done)
    }

    /// The text that a recorded String has now, by its position among [`Setup::signals`].
    #[must_use]
    pub fn text(&self, signal: usize) -> Option<&std::ffi::CStr> {
        let (participant, slot) = self.slots[signal];
        self.participants[participant].text(slot)
    }

    /// The value that a recorded signal has now, by its position among [`Setup::signals`]; true
    /// counts as 1, and a text is not a number. Real values are in the variable's own unit of measurement.
    #[inline]
    #[must_use]
    pub fn value(&self, signal: usize) -> f64 {
        let (participant, slot) = self.slots[signal];
        self.participants[participant].value(slot)
    }

    /// Values of all signals of interest: those recorded, then those only drawn.
    #[inline]
    pub fn values(&self) -> impl Iterator<Item = f64> {
        self.slots.iter().map(|&(participant, slot)| self.participants[participant].value(slot))
    }

    /// Sets a tunable parameter, or an input that nothing feeds, from the next step on; a name with
    /// ranges and stars sets several. Not for use in every step of many units: names are looked up.
    ///
    /// # Errors
    /// No such variable, a value that does not fit, a variable that cannot change now, or the
    /// unit's refusal.
    pub fn set(&mut self, name: &str, value: &Setting) -> Result<(), Error> {
        let time = self.time();
        let system = &self.setup.system;
        for (port, value) in system.changes(name, value)? {
            let instance = self.participants[port.instance].instance_mut();
            let set = instance.set(port.variable, &value);
            set.map_err(|source| Error::Step { time, source })?;
        }
        Ok(())
    }

    /// Loops that were solved before the start.
    #[must_use]
    pub fn loops(&self) -> &[SolvedLoop] {
        &self.loops
    }

    /// What is worth telling of the start: outputs that changed on leaving initialization mode too late
    /// for some of the units.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Steps of variable size that were taken back so far because their error was too large.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.stepper.rejected()
    }

    /// Which capability of which unit limits the coupling.
    #[must_use]
    pub fn limits(&self) -> &[String] {
        self.stepper.limits()
    }

    /// How the coupling went.
    #[must_use]
    pub fn coupling(&self) -> CouplingSummary {
        self.stepper.report()
    }

    /// The instances.
    #[must_use]
    pub fn participants(&self) -> &[Participant] {
        &self.participants
    }

    /// The instances, to take what they have to say.
    pub fn participants_mut(&mut self) -> &mut [Participant] {
        &mut self.participants
    }

    /// Ends the run for all units that can still be called.
    ///
    /// # Errors
    /// The first unit's that fails.
    pub fn terminate(&mut self) -> Result<(), Error> {
        let time = self.time();
        let mut result = Ok(());
        for participant in &mut self.participants {
            result = result.and(participant.instance_mut().terminate());
        }
        result.map_err(|source| Error::Step { time, source })
    }

    /// All that is needed to go on from here in another process.
    ///
    /// # Errors
    /// A unit cannot serialize its state.
    pub fn state(&mut self) -> Result<SimulationState, Error> {
        let time = self.time();
        let mut units = Vec::with_capacity(self.participants.len());
        for participant in &mut self.participants {
            let bytes = serialized(participant).map_err(|source| Error::Step { time, source })?;
            let instance = participant.instance().name().to_owned();
            let (held, between) = (participant.holds_inputs(), participant.between());
            units.push(UnitState { instance, held, bytes, between });
        }
        Ok(SimulationState { done: self.done, units, stepper: self.stepper.state() })
    }

    /// Goes back, or forward, to a state of the same scenario.
    ///
    /// # Errors
    /// The state is not one of this scenario with these units.
    pub fn restore(&mut self, state: &SimulationState) -> Result<(), StateError> {
        let names = |it: &Participant| it.instance().name().to_owned();
        let alike =
            self.participants.iter().map(names).eq(state.units.iter().map(|u| u.instance.clone()));
        if !alike || state.done > self.setup.steps {
            return Err(StateError::Misfit { what: Misfit::Instances });
        }
        for (k, unit) in state.units.iter().enumerate() {
            let participant = &mut self.participants[k];
            if unit.held {
                self.stepper.hold_inputs(k, participant);
            }
            let fits = restore(participant, &unit.bytes)
                .and_then(|()| participant.return_between(unit.between.as_ref()))
                .map_err(|source| StateError::Refused { source })?;
            if !fits {
                return Err(StateError::Misfit { what: Misfit::OwnSteps });
            }
        }
        if !self.stepper.restore(&state.stepper) {
            return Err(StateError::Misfit { what: Misfit::Signals });
        }
        self.done = state.done;
        Ok(())
    }
}

fn serialized(participant: &mut Participant) -> Result<Vec<u8>, FmuError> {
    let instance = participant.instance_mut();
    let saved = instance.save_state(None)?;
    let bytes = instance.serialize_state(saved)?;
    instance.free_state(saved)?;
    Ok(bytes)
}

fn restore(participant: &mut Participant, bytes: &[u8]) -> Result<(), FmuError> {
    let instance = participant.instance_mut();
    let saved = instance.deserialize_state(bytes)?;
    instance.restore_state(saved)?;
    instance.free_state(saved)
}
