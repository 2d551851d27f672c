//! Units that are loaded, connected and initialized, stepped one communication step at a time.
//!
//! ARCHITECTURE.md lists the modules in the order in which they are used.

mod attempts;
mod coupling_setup;
mod happenings;
mod instantiate;
mod limits;
mod locate;
mod loops;
mod outside;
mod pool;
mod selection;
mod setup;
mod stepper;
mod story;
mod wiring;

use std::time::Instant;

use serde::{Deserialize, Serialize};

use self::attempts::Attempts;
pub use self::coupling_setup::CouplingSetup;
use self::happenings::{Happenings, HappeningsState};
pub use self::loops::AlgebraicLoop;
pub use self::pool::Pool;
pub use self::selection::{Selection, base_unit, to_base};
pub use self::setup::Setup;
use self::stepper::{Stepper, StepperState};
use crate::error::{Error, Misfit, StateError};
use crate::initialize::{initialize, late};
use crate::participant::{Between, Participant, Slot};
use crate::system::{InstanceIndex, Port};
use coupling::{Exchange, UnitIndex};
use fmi2_import::description::Value;
use fmi2_import::instance::FmuError;
use fmi2_import::trace::Trace;
use results::summary::{CouplingSummary, SolvedLoop};
use scenario::Setting;

/// A running co-simulation: [`Setup::start`] makes it, [`step`](Self::step) advances it.
pub struct Simulation<'a> {
    setup: &'a Setup,
    stepper: Stepper,
    happenings: Happenings<'a>,
    participants: Vec<Participant>,
    /// places of the selected signals
    slots: Vec<(InstanceIndex, Slot)>,
    loops: Vec<SolvedLoop>,
    /// remarks about the start
    notes: Vec<String>,
    done: u64,
    /// time of a stop condition within the last step (s)
    ended: Option<f64>,
    /// time between two communication points to which the program has advanced (s)
    apart: Option<f64>,
    /// what the program changes at the beginning of the next step
    changes: Vec<(Port, Value)>,
}

/// Everything of a [`Simulation`] that changes from step to step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimulationState {
    done: u64,
    units: Vec<UnitState>,
    stepper: StepperState,
    happenings: HappeningsState,
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

impl Setup {
    /// Loads, instantiates, connects and initializes the units.
    ///
    /// # Errors
    /// A unit cannot be loaded, refuses or fails, or a loop cannot be solved.
    pub fn start(&self) -> Result<Simulation<'_>, Error> {
        Simulation::start(self, &mut Pool::default())
    }

    /// Starts as [`Setup::start`] does, with libraries and instances of the pool where it has them.
    ///
    /// # Errors
    /// As [`Setup::start`].
    pub fn start_from(&self, pool: &mut Pool) -> Result<Simulation<'_>, Error> {
        Simulation::start(self, pool)
    }
}

impl<'a> Simulation<'a> {
    fn start(setup: &'a Setup, pool: &mut Pool) -> Result<Self, Error> {
        let mut attempts = Attempts::default();
        let trace = instantiate::trace(&setup.scenario)?;
        loop {
            let begin = Instant::now();
            match Self::attempt(setup, trace.as_ref(), &attempts, pool) {
                Ok(mut started) => {
                    started.stepper.add_limits(attempts.limits());
                    return Ok(started);
                }
                Err(error) => attempts.add(&setup.system, error, begin.elapsed())?,
            }
            pool.forget();
        }
    }

    fn attempt(
        setup: &'a Setup,
        trace: Option<&Trace>,
        earlier: &Attempts,
        pool: &mut Pool,
    ) -> Result<Self, Error> {
        let Setup { scenario, system, selection, coupling, .. } = setup;
        let mut instances = instantiate::instantiate(scenario, system, trace, earlier.any(), pool)?;
        earlier.apply_to(&mut instances);
        let initialized =
            initialize(system, &mut instances, scenario.experiment, scenario.initialization)?;
        let time = scenario.experiment.start;
        let failed = |source| Error::Step { time, source };
        let (mut participants, exchange) =
            instantiate::connect(setup, instances).map_err(failed)?;
        let mut stepper = Stepper::start(setup, exchange, &mut participants).map_err(failed)?;
        let now = |port: Port| {
            let participant = participants.get(port.instance.0)?;
            Some(participant.value(participant.slot(port.variable)?))
        };
        let tolerance = scenario.initialization.tolerance;
        let late = late::find(system, &coupling.signals, &initialized.outputs, tolerance, now);
        stepper.expect_jumps(&participants, &late.stale);
        let step = scenario.experiment.step;
        let mut happenings = Happenings::new(&setup.story, system, &participants, step);
        happenings.observe(time, &participants);
        stepper.add_limits(happenings.limits(time));
        let slots = selection.slots(&participants);
        let (loops, notes) = (initialized.loops, late.notes);
        Ok(Self {
            setup,
            stepper,
            happenings,
            participants,
            slots,
            loops,
            notes,
            done: 0,
            ended: None,
            apart: None,
            changes: Vec::new(),
        })
    }

    /// The signals between the units.
    #[must_use]
    pub fn exchange(&self) -> &Exchange {
        self.stepper.exchange()
    }

    /// Advances by one communication step.
    ///
    /// # Errors
    /// A unit fails. The simulation cannot be stepped after that.
    #[inline]
    pub fn step(&mut self) -> Result<(), Error> {
        let time = self.time();
        let size = self.setup.scenario.experiment.size(self.done);
        self.step_by(time, size)?;
        self.done += 1;
        self.happenings.observe(self.time(), &self.participants);
        Ok(())
    }

    #[inline]
    fn step_by(&mut self, time: f64, size: f64) -> Result<(), Error> {
        if self.changes.is_empty() && self.happenings.is_quiet(time, time + size) {
            let stepped = self.stepper.step(&mut self.participants, time, size);
            stepped.map_err(|source| self.failed(time, source))
        } else {
            self.eventful_step(time, size)
        }
    }

    #[cold]
    fn failed(&self, time: f64, source: FmuError) -> Error {
        match self.diverged_loops().filter(|_| source.fault().may_be_numeric()) {
            Some(loops) => Error::Diverged { time, loops, source: Some(source) },
            None => Error::Step { time, source },
        }
    }

    /// Checks that the algebraic loops that the algorithm cuts have stayed within bounds.
    ///
    /// # Errors
    /// They have not, and their values are useless.
    pub fn check_loops(&self) -> Result<(), Error> {
        match self.diverged_loops() {
            Some(loops) => Err(Error::Diverged { time: self.time(), loops, source: None }),
            None => Ok(()),
        }
    }

    /// The loops that have not stayed within bounds, by the names of their outputs.
    fn diverged_loops(&self) -> Option<String> {
        let Setup { system, coupling, .. } = self.setup;
        let value = |port: Port| self.participants[port.instance].real_output(port.variable);
        let diverged = coupling.loops.iter().filter(|it| it.has_diverged(system, value));
        let names: Vec<&str> = diverged.map(|it| it.names.as_str()).collect();
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

    /// The time that has been reached (s). That of a stop condition may be within the last step.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.ended.or(self.apart).unwrap_or_else(|| self.setup.time_after(self.done))
    }

    /// The present value of a recorded String, by its position among [`Setup::signals`].
    #[must_use]
    pub fn text(&self, signal: usize) -> Option<&std::ffi::CStr> {
        let (participant, slot) = self.slots[signal];
        self.participants[participant].text(slot)
    }

    /// The present value of a recorded signal, by its position among [`Setup::signals`]. True is 1, and a
    /// String is NaN. Real values are in the variable's own unit of measurement.
    #[inline]
    #[must_use]
    pub fn value(&self, signal: usize) -> f64 {
        let (participant, slot) = self.slots[signal];
        self.participants[participant].value(slot)
    }

    /// Values of all selected signals: the recorded ones, then those that are only plotted.
    #[inline]
    pub fn values(&self) -> impl Iterator<Item = f64> {
        self.slots.iter().map(|&(participant, slot)| self.participants[participant].value(slot))
    }

    /// Sets a tunable parameter or an unconnected input, from the next step on. A name with ranges and
    /// stars sets several. Names are looked up in each call, which is slow for many units.
    ///
    /// # Errors
    /// The variable does not exist or cannot change now, the value does not fit, or the unit refuses it.
    pub fn set(&mut self, name: &str, value: &Setting) -> Result<(), Error> {
        let time = self.time();
        let system = &self.setup.system;
        for (port, value) in system.changes(&format!("set {name}"), name, value)? {
            let instance = self.participants[port.instance].instance_mut();
            let set = instance.set(port.variable.0, &value);
            set.map_err(|source| Error::Step { time, source })?;
        }
        Ok(())
    }

    /// Loops that were solved before the start.
    #[must_use]
    pub fn loops(&self) -> &[SolvedLoop] {
        &self.loops
    }

    /// Remarks about the start: outputs that changed on leaving initialization mode, too late for some of
    /// the units.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Number of steps of variable size that were rejected so far because their error was too large.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.stepper.rejected()
    }

    /// Sentences about missing capabilities of units that limit the coupling.
    #[must_use]
    pub fn limits(&self) -> &[String] {
        self.stepper.limits()
    }

    /// Counts of steps and iterations, and limits of the coupling.
    #[must_use]
    pub fn coupling(&self) -> CouplingSummary {
        self.stepper.report()
    }

    /// The instances.
    #[must_use]
    pub fn participants(&self) -> &[Participant] {
        &self.participants
    }

    /// The instances, to take their messages.
    pub fn participants_mut(&mut self) -> &mut [Participant] {
        &mut self.participants
    }

    /// Terminates all units that can still be called.
    ///
    /// # Errors
    /// The first failure in instance order.
    pub fn terminate(&mut self) -> Result<(), Error> {
        let time = self.time();
        let mut result = Ok(());
        for participant in &mut self.participants {
            result = result.and(participant.instance_mut().terminate());
        }
        result.map_err(|source| Error::Step { time, source })
    }

    /// Everything that is needed to continue from here in another process.
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
        let (stepper, happenings) = (self.stepper.state(), self.happenings.state());
        Ok(SimulationState { done: self.done, units, stepper, happenings })
    }

    /// Restores an earlier or later state of the same scenario.
    ///
    /// # Errors
    /// The state does not belong to this scenario with these units.
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
                self.stepper.hold_inputs(UnitIndex(k), participant);
            }
            let fits = restore(participant, &unit.bytes)
                .and_then(|()| participant.restore_between(unit.between.as_ref()))
                .map_err(|source| StateError::Refused { source })?;
            if !fits {
                return Err(StateError::Misfit { what: Misfit::OwnSteps });
            }
        }
        if !self.happenings.restore(&state.happenings) {
            return Err(StateError::Misfit { what: Misfit::Story });
        }
        if !self.stepper.restore(&state.stepper) {
            return Err(StateError::Misfit { what: Misfit::Signals });
        }
        (self.done, self.ended, self.apart) = (state.done, None, None);
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
