//! A simulation with the setup that it borrows from, what it has recorded, and how it ended.

use std::collections::BTreeMap;

use criteria::Verdict;
use in_memory::Signals;
use in_memory::accuracy::{self, Choice};
use master::{Setup, Simulation, SimulationState};
use results::summary::{AccuracyReport, FmuMessage, RideQuality, Status};
use self_cell::self_cell;

use crate::error::Failure;
use crate::recording::Recording;
use crate::watch::Watch;

self_cell!(
    struct Started {
        owner: Setup,
        #[not_covariant]
        dependent: Simulation,
    }
);

/// Why a simulation does not go on.
pub enum Halt {
    Failed(Failure),
    /// Ctrl-C, or an exception of the callback for progress
    Python(pyo3::PyErr),
}

impl<E: Into<Failure>> From<E> for Halt {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

impl From<Halt> for pyo3::PyErr {
    fn from(halt: Halt) -> Self {
        match halt {
            Halt::Failed(failure) => failure.into(),
            Halt::Python(error) => error,
        }
    }
}

/// Chooses step and algorithm, if the scenario asks for an accuracy.
pub fn choose(scenario: &scenario::Scenario, watch: &Watch) -> Result<Option<Choice>, Halt> {
    let mut stopped = None;
    let choice = accuracy::choose(scenario, &mut |_| (), &mut || {
        stopped = watch.look(f64::NAN).err();
        stopped.is_some()
    });
    match stopped {
        Some(error) => Err(Halt::Python(error)),
        None => Ok(choice?),
    }
}

/// A simulation that is stepped from Python.
pub struct Running {
    started: Started,
    pub recording: Recording,
    /// how step and algorithm were chosen
    pub accuracy: Option<AccuracyReport>,
    /// by number of steps: the start, if all units can save their states, and every state saved since
    kept: BTreeMap<u64, SimulationState>,
    pub events: Vec<(f64, String)>,
    pub notes: Vec<String>,
    pub messages: Vec<FmuMessage>,
    /// figures of a run that ended as a result
    pub verdicts: Vec<Verdict>,
    pub ride: Option<RideQuality>,
    /// messages of all units that have been taken
    heard: u64,
    /// how it ended, and why if before its stop time
    pub end: Option<(Status, Option<String>)>,
    terminated: bool,
}

impl Running {
    /// Chooses step and algorithm if the scenario asks for an accuracy, loads and initializes the units.
    pub fn start(scenario: &scenario::Scenario, watch: &Watch) -> Result<Self, Halt> {
        Ok(match choose(scenario, watch)? {
            None => Self::start_with(scenario, None)?,
            Some(Choice { scenario, report }) => Self::start_with(&scenario, Some(report))?,
        })
    }

    fn start_with(
        scenario: &scenario::Scenario,
        accuracy: Option<AccuracyReport>,
    ) -> Result<Self, Failure> {
        let setup = Setup::new(scenario)?;
        let recording = Recording::new(&setup);
        let mut notes = scenario.notes.clone();
        notes.extend(accuracy.iter().map(|it| format!("accuracy: {}", it.explanation)));
        notes.extend(setup.system().notices(scenario.experiment.step));
        notes.extend(setup.coupling().loops.iter().map(master::simulation::AlgebraicLoop::notice));
        let started = Started::try_new(setup, Setup::start)?;
        let mut running = Self {
            started,
            recording,
            accuracy,
            kept: BTreeMap::new(),
            events: Vec::new(),
            notes,
            messages: Vec::new(),
            verdicts: Vec::new(),
            ride: None,
            heard: 0,
            end: None,
            terminated: false,
        };
        running.begin()?;
        Ok(running)
    }

    fn begin(&mut self) -> Result<(), Failure> {
        let Self { started, recording, kept, notes, .. } = self;
        started.with_dependent_mut(|setup, simulation| {
            notes.extend(simulation.limits().iter().chain(simulation.notes()).cloned());
            recording.take(simulation, false);
            let mut units = setup.system().instances.iter();
            if units.all(|it| it.description().co_simulation.can_serialize_fmu_state) {
                kept.insert(simulation.done(), simulation.state()?);
            }
            Ok::<_, master::Error>(())
        })?;
        self.listen();
        self.judge();
        Ok(())
    }

    pub fn setup(&self) -> &Setup {
        self.started.borrow_owner()
    }

    pub fn with<T>(&mut self, work: impl FnOnce(&Setup, &mut Simulation<'_>) -> T) -> T {
        self.started.with_dependent_mut(|setup, simulation| work(setup, simulation))
    }

    pub fn done(&self) -> u64 {
        self.started.with_dependent(|_, simulation| simulation.done())
    }

    /// Steps until so many steps are done, or until the run ends early.
    pub fn advance(&mut self, done: u64, watch: &Watch) -> Result<(), Halt> {
        self.is_open()?;
        while self.done() < done && self.end.is_none() {
            self.step()?;
            let time = self.setup().time_after(self.done());
            watch.look(time).map_err(Halt::Python)?;
        }
        Ok(())
    }

    /// Whether the units can still be called.
    fn is_open(&self) -> Result<(), Failure> {
        if self.terminated {
            let help = "start the scenario again";
            return Err(Failure::input("the simulation is closed", Some(help)));
        }
        Ok(())
    }

    fn step(&mut self) -> Result<(), Failure> {
        let Self { started, recording, events, .. } = self;
        let stepped = started.with_dependent_mut(|_, simulation| {
            simulation.step()?;
            recording.take(simulation, simulation.stopped().is_some());
            events.extend(simulation.take_news());
            Ok(())
        });
        self.listen();
        match stepped {
            Ok(()) => {
                self.judge();
                Ok(())
            }
            Err(master::Error::Step { source, .. }) if source.asks_to_end() => {
                self.end = Some((Status::Terminated, Some(source.to_string())));
                Ok(())
            }
            Err(error) => {
                self.end = Some((Status::Failed, Some(results::causes(&error).join(": "))));
                Err(error.into())
            }
        }
    }

    /// Notes whether a stop condition or the stop time ends the run here.
    fn judge(&mut self) {
        let (stopped, remaining) =
            self.started.with_dependent(|_, it| (it.stopped().map(str::to_owned), it.remaining()));
        self.end = match stopped {
            Some(text) => Some((Status::Stopped, Some(text))),
            None => (remaining == 0).then_some((Status::Finished, None)),
        };
    }

    /// Takes the messages of the units.
    fn listen(&mut self) {
        let arrived = fmi2_import::logger::arrived();
        if self.heard == arrived {
            return;
        }
        self.heard = arrived;
        let Self { started, messages, .. } = self;
        started.with_dependent_mut(|_, simulation| {
            let time = simulation.time();
            for participant in simulation.participants_mut() {
                let instance = participant.instance_mut();
                let name = instance.name().to_owned();
                messages.extend(instance.take_messages().into_iter().map(|message| FmuMessage {
                    time,
                    instance: name.clone(),
                    status: message.status.name().to_string(),
                    text: message.text,
                }));
            }
        });
    }

    /// The present state, which is also kept for [`Self::rewind`].
    pub fn save(&mut self) -> Result<SimulationState, Failure> {
        self.is_open()?;
        let (done, state) = self.with(|_, it| it.state().map(|state| (it.done(), state)))?;
        self.kept.insert(done, state.clone());
        Ok(state)
    }

    /// Continues from a state of this scenario.
    pub fn restore(&mut self, state: &SimulationState) -> Result<(), Failure> {
        self.is_open()?;
        let restored = self.with(|_, it| it.restore(state));
        restored.map_err(|error| Failure::of_state(&error))?;
        let done = self.done();
        self.recording.rewind(done);
        let now = self.setup().time_after(done);
        self.events.retain(|(time, _)| *time <= now);
        self.messages.retain(|message| message.time <= now);
        // its row, if it is later than what was recorded
        let Self { started, recording, .. } = self;
        started.with_dependent(|_, simulation| recording.take(simulation, false));
        self.judge();
        Ok(())
    }

    /// Goes back to the latest state that is kept before a step.
    pub fn rewind(&mut self, done: u64) -> Result<(), Failure> {
        let Some((_, state)) = self.kept.range(..=done).next_back() else {
            let help = "start the simulation again; it needs units with canSerializeFMUstate";
            let text = "cannot go back: a unit cannot save its state";
            return Err(Failure::input(text, Some(help)));
        };
        let state = state.clone();
        self.restore(&state)
    }

    /// Terminates the units, once. Of a run that reached its end, checks that its loops have stayed within bounds.
    pub fn close(&mut self) -> Result<(), Failure> {
        if std::mem::replace(&mut self.terminated, true) {
            return Ok(());
        }
        let whole = matches!(self.end, Some((Status::Finished | Status::Stopped, _)));
        let checked = if whole { self.with(|_, it| it.check_loops()) } else { Ok(()) };
        let terminated = self.with(|_, it| it.terminate());
        self.listen();
        if let Err(error) = &checked {
            self.end = Some((Status::Failed, Some(results::causes(error).join(": "))));
        }
        checked.and(terminated)?;
        self.compute_figures();
        Ok(())
    }

    /// Objectives, limits and ride quality of a run that ended as a result.
    fn compute_figures(&mut self) {
        if !matches!(self.end, Some((Status::Finished | Status::Stopped | Status::Terminated, _))) {
            return;
        }
        let Self { started, recording, .. } = self;
        let setup = started.borrow_owner();
        (self.ride, self.verdicts) = recording.with_table(|table| {
            let signals = Signals::Table(table);
            let ride = in_memory::ride::judge(setup, signals);
            // a table in memory can always be read
            let verdicts = in_memory::metrics::judge(setup, signals, None, ride.as_ref());
            (ride, verdicts.unwrap_or_default())
        });
    }
}
