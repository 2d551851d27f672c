//! A bundle as a model of the export kit: initialization, steps, outputs and states of the system inside.

use std::path::PathBuf;

use bundle_table::{Role, TABLE, Table, Value};
use coupling::Taylor;
use fmi2_export::{Error, Interface, Model, Motions, RealVar, Resources, StateSpace, Step, Values};
use fmi2_import::logger;
use master::Simulation;

use crate::declare::{Handle, declare};
use crate::linear_report;
use crate::running::{Opened, Prepared, Running, refusal, value};
use crate::state::{State, Times};

/// A whole co-simulation as one unit.
pub struct Bundle {
    folder: PathBuf,
    table: Table,
    handles: Vec<Handle>,
    /// continuous inputs: places in the table
    inputs: Vec<usize>,
    /// what may change between steps only: places in the table
    stepwise: Vec<usize>,
    /// places in the table, in the order of the recorded signals
    outputs: Vec<usize>,
    /// per value reference of a Real, its place in the table
    reals: Vec<usize>,
    times: Times,
    opened: Option<Opened>,
    running: Option<Running>,
    /// whether the simulation has values of its present state
    fresh: bool,
    /// whether a tunable parameter may have changed
    changed: bool,
    /// number of messages of all units that have been taken
    heard: u64,
    messages: Vec<String>,
}

fn not_running() -> Error {
    Error::invalid("the system inside is not running: initialise it first")
}

impl Model for Bundle {
    type State = State;

    fn declare(resources: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        let text = resources.read_to_string(TABLE)?;
        let table =
            Table::read(&text).map_err(|why| Error::invalid(format!("resource {TABLE}: {why}")))?;
        let handles = declare(&table, interface)?;
        let places = |wanted: &dyn Fn(Role, bool) -> bool| -> Vec<usize> {
            let all = table.variables.iter().zip(&handles).enumerate();
            let continuous =
                |handle: &Handle, discrete: bool| matches!(handle, Handle::Real(_)) && !discrete;
            all.filter(|(_, (it, handle))| wanted(it.role, continuous(handle, it.discrete)))
                .map(|(place, _)| place)
                .collect()
        };
        let inputs = places(&|role, continuous| role == Role::Input && continuous);
        let stepwise =
            places(&|role, continuous| role == Role::Tunable || role == Role::Input && !continuous);
        let outputs = places(&|role, _| role == Role::Output);
        let is_real = |&place: &usize| matches!(handles[place], Handle::Real(_));
        let reals = (0..handles.len()).filter(is_real).collect();
        let folder = resources.path().to_owned();
        // the units are opened only for an instance, not to print the description
        let opened = match resources.instance_name() {
            "" => None,
            _ => Some(Opened::new(&folder)?),
        };
        Ok(Self {
            folder,
            times: Times { start: table.start, stop: None, tolerance: None },
            table,
            handles,
            inputs,
            stepwise,
            outputs,
            reals,
            opened,
            running: None,
            fresh: false,
            changed: false,
            heard: 0,
            messages: Vec::new(),
        })
    }

    fn experiment(&mut self, start: f64, stop: Option<f64>, tolerance: Option<f64>) {
        self.times = Times { start, stop, tolerance };
    }

    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<State, Error> {
        let times = Times { start: time, ..self.times };
        self.start(values, times)?;
        self.fresh = true;
        self.changed = false;
        let applied = self.applied(values);
        Ok(State { times, applied, time, saved: None })
    }

    fn outputs(&mut self, _: &State, values: &mut Values, _: f64) -> Result<(), Error> {
        let (Some(running), true) = (&mut self.running, self.fresh) else { return Ok(()) };
        let (outputs, handles) = (&self.outputs, &self.handles);
        running.with_dependent(|_, simulation| {
            for (signal, &place) in outputs.iter().enumerate() {
                match handles[place] {
                    Handle::Real(it) => values.set_real(it, simulation.value(signal)),
                    Handle::Integer(it) => values.set_integer(it, whole(simulation.value(signal))),
                    Handle::Boolean(it) => values.set_boolean(it, simulation.value(signal) != 0.0),
                    Handle::String(it) => {
                        let text = simulation.text(signal).unwrap_or_default();
                        values.set_string(it, &text.to_string_lossy());
                    }
                }
            }
        });
        Ok(())
    }

    fn step(&mut self, state: &mut State, values: &mut Values, step: Step) -> Result<(), Error> {
        let end = step.end();
        self.check_step(state.times, end)?;
        let changes = self.take_changes(state, values);
        let Self { running, inputs, handles, .. } = self;
        let running = running.as_mut().ok_or_else(not_running)?;
        if end > running.borrow_owner().horizon {
            return Err(Error::invalid(
                "the scenario has signals over time, which need a stop time in fmi2SetupExperiment",
            ));
        }
        state.saved = None;
        let stepped = running.with_dependent_mut(|owner, simulation| {
            set_inputs(owner, inputs, handles, values, Some(step.time));
            for (place, new) in changes {
                for &port in &owner.ports[place] {
                    simulation.change(port, value(new.clone()));
                }
            }
            simulation.advance_to(end).map_err(|error| refusal(&error))?;
            match simulation.stopped() {
                Some(reason) => {
                    Err(Error::terminated(format!("a stop condition has become true: {reason}")))
                }
                None => Ok(()),
            }
        });
        self.fresh = stepped.is_ok();
        self.listen();
        stepped
    }

    fn parameters_changed(&mut self, _: &mut State, _: &mut Values) -> Result<(), Error> {
        self.changed = true;
        Ok(())
    }

    fn output_derivative(
        &mut self,
        _: &State,
        _: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        let place = self.reals[output.value_reference() as usize];
        let running = self.running.as_mut().ok_or_else(not_running)?;
        running.with_dependent_mut(|owner, simulation| {
            let Some(port) = owner.ports[place].first() else { return Ok(None) };
            let reference = owner.setup.system().variable(*port).value_reference;
            let order = i32::try_from(order).unwrap_or(i32::MAX);
            let mut found = [f64::NAN];
            let instance = simulation.participants_mut()[port.instance.0].instance_mut();
            instance
                .get_real_output_derivatives(&[reference], &[order], &mut found)
                .map_err(|error| Error::caused(&error))?;
            Ok(Some(found[0]))
        })
    }

    fn saving(&mut self, state: &mut State) -> Result<(), Error> {
        if state.saved.is_some() {
            return Ok(());
        }
        let running = self.running.as_mut().ok_or_else(not_running)?;
        running.with_dependent_mut(|_, simulation| {
            state.saved = Some(simulation.state().map_err(|error| refusal(&error))?);
            state.time = simulation.time();
            Ok(())
        })
    }

    fn restored(&mut self, state: &mut State, values: &mut Values) -> Result<(), Error> {
        let saved =
            state.saved.as_ref().ok_or_else(|| Error::invalid("the saved state is incomplete"))?;
        let fits = self.running.as_ref().is_some_and(|it| it.borrow_owner().times == state.times);
        if !fits {
            self.start(values, state.times)?;
        }
        self.times = state.times;
        // the importer has the values of the saved state, and the units are asked after the next step only
        self.fresh = false;
        self.changed = true;
        let running = self.running.as_mut().ok_or_else(not_running)?;
        running.with_dependent_mut(|_, simulation| {
            simulation.restore_at(saved, state.time).map_err(|error| Error::caused(&error))
        })
    }

    fn messages(&mut self) -> Vec<String> {
        std::mem::take(&mut self.messages)
    }

    fn report(&mut self, _: &State, _: &Values, request: &str) -> Result<Option<String>, Error> {
        let Self { running, table, handles, .. } = self;
        let running = running.as_mut().ok_or_else(not_running)?;
        match request {
            StateSpace::REQUEST => running
                .with_dependent_mut(|owner, it| linear_report::states(owner, it, table, handles))
                .map(Some),
            Motions::REQUEST => running.with_dependent_mut(linear_report::motions).map(Some),
            _ => Ok(None),
        }
    }
}

impl Bundle {
    /// Starts the system inside with these values.
    fn start(&mut self, values: &Values, times: Times) -> Result<(), Error> {
        let mut before = self.running.take();
        before.iter_mut().for_each(end);
        let before = before.map(Running::into_owner).filter(|it| it.times == times);
        let opened = match &mut self.opened {
            Some(opened) => opened,
            none => none.insert(Opened::new(&self.folder)?),
        };
        let mut prepared = match before {
            Some(prepared) => prepared,
            None => opened.prepare(times, &self.table, &self.inputs)?,
        };
        for (place, (it, handle)) in self.table.variables.iter().zip(&self.handles).enumerate() {
            let Some(start) = &it.start else { continue };
            let now = handle.value(values);
            if prepared.put[place] || now != *start {
                prepared.put[place] = true;
                for &port in &prepared.ports[place] {
                    prepared.setup.put(port, value(now.clone()));
                }
            }
        }
        set_inputs(&prepared, &self.inputs, &self.handles, values, None);
        self.running = Some(opened.start(prepared)?);
        if let Some(running) = &self.running {
            running.with_dependent(|_, simulation| {
                self.messages.extend(simulation.notes().iter().cloned());
                self.messages.extend(simulation.limits().iter().cloned());
            });
        }
        self.listen();
        Ok(())
    }

    /// Refuses a step that the units inside cannot make.
    fn check_step(&self, times: Times, end: f64) -> Result<(), Error> {
        let Some(why) = &self.table.limits.variable_step else { return Ok(()) };
        let step = self.table.step;
        let count = (end - times.start) / step;
        if (count - count.round()).abs() <= 1e-6 {
            return Ok(());
        }
        Err(Error::discard(format!("steps must be multiples of {step} s: {why}")))
    }

    /// Values of what may change between steps.
    fn applied(&self, values: &Values) -> Vec<Value> {
        self.stepwise.iter().map(|&place| self.handles[place].value(values)).collect()
    }

    /// What the importer has changed since the last step.
    fn take_changes(&mut self, state: &mut State, values: &Values) -> Vec<(usize, Value)> {
        let watches = self.stepwise.iter().any(|&it| self.table.variables[it].role == Role::Input);
        if !std::mem::take(&mut self.changed) && !watches {
            return Vec::new();
        }
        let mut changes = Vec::new();
        for (&place, known) in self.stepwise.iter().zip(&mut state.applied) {
            let now = self.handles[place].value(values);
            if now != *known {
                known.clone_from(&now);
                changes.push((place, now));
            }
        }
        changes
    }

    /// Takes new messages of the units.
    fn listen(&mut self) {
        let arrived = logger::arrived();
        let Some(running) = self.running.as_mut().filter(|_| arrived != self.heard) else { return };
        self.heard = arrived;
        let messages = &mut self.messages;
        running.with_dependent_mut(|_, simulation| {
            for participant in simulation.participants_mut() {
                participant.take_rejections();
                participant.take_odd_values();
                let instance = participant.instance_mut();
                for message in instance.take_messages() {
                    messages.push(format!("{}: {}", instance.name(), message.text));
                }
            }
        });
    }
}

/// Gives the simulation the inputs: at the start only their values, later their polynomials from a time (s) on.
fn set_inputs(
    prepared: &Prepared,
    inputs: &[usize],
    handles: &[Handle],
    values: &Values,
    time: Option<f64>,
) {
    let mut number = 0;
    for &place in inputs {
        let Handle::Real(input) = handles[place] else { continue };
        let p = match time {
            Some(_) => {
                let ([p0, p1, p2, p3], [p4, p5]) = (*values.taylor(input), *values.further(input));
                Taylor([p0, p1, p2, p3, p4, p5])
            }
            None => Taylor::constant(values.real(input)),
        };
        for _ in &prepared.ports[place] {
            prepared.outside.set(number, time.unwrap_or(prepared.times.start), &p);
            number += 1;
        }
    }
}

/// Ends a simulation. Its instances are freed in any case.
fn end(running: &mut Running) {
    running.with_dependent_mut(|_, simulation: &mut Simulation<'_>| drop(simulation.terminate()));
}

impl Drop for Bundle {
    fn drop(&mut self) {
        self.running.iter_mut().for_each(end);
    }
}

/// A number that stands for an Integer.
#[expect(clippy::cast_possible_truncation, reason = "it was made from an i32")]
fn whole(number: f64) -> i32 {
    number as i32
}
