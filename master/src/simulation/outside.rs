//! Simulations that another program embeds: its inputs, its times, and changes of parameters that it makes.
//!
//! The program gives inputs as polynomials about its own communication points ([`Outside`]). Its steps need not be those of
//! the scenario: [`Simulation::advance_to`] makes as many communication steps as fit, and a shorter one up to a time
//! between two communication points. The next step then ends at the next communication point again.

use std::sync::Arc;

use super::happenings::SNAP;
use super::story::{DrivenInput, Driver};
use super::{Setup, Simulation, SimulationState};
use crate::error::{Error, StateError};
use crate::system::Port;
use coupling::{Outside, Taylor};
use fmi2_import::description::{Causality, Value};
use fmi2_import::span::between;

impl Setup {
    /// Lets a program set these Real inputs while the simulation runs. They must be free, continuous inputs, and each
    /// starts with the value that [`Setup::put`] gives it. To be called once.
    pub fn open_inputs(&mut self, ports: &[Port]) -> Arc<Outside> {
        let outside = Arc::new(Outside::new(ports.len()));
        for (k, &port) in ports.iter().enumerate() {
            if let Some(Value::Real(start)) =
                self.system.instances[port.instance].inputs.get(&port.variable)
            {
                outside.set(k, self.scenario.experiment.start, &Taylor::constant(*start));
            }
            let driver = Driver::Outside(Arc::clone(&outside), k);
            self.story.inputs.push(DrivenInput { port, driver });
            self.system.driven.insert(port);
        }
        outside
    }

    /// Replaces the value of a parameter or free input for the next start. The value must be of its type and range.
    pub fn put(&mut self, port: Port, value: Value) {
        let causality = self.system.variable(port).causality;
        let instance = &mut self.system.instances[port.instance];
        let is_input = causality == Causality::Input;
        let list = if is_input { &mut instance.inputs } else { &mut instance.parameters };
        list.insert(port.variable, value);
    }

    /// Removes the stop time: the simulation can be stepped as long as wanted, and units get no stop time. Signals over
    /// time keep the jumps that they have until the stop time of the scenario.
    pub fn remove_stop(&mut self) {
        self.scenario.experiment.stop = f64::INFINITY;
        self.steps = u64::MAX;
    }
}

impl Simulation<'_> {
    /// Advances to a time (s), which need not be a communication point. Points closer together than 1e-5 steps are one.
    /// The simulation stays before it if a stop condition becomes true.
    ///
    /// # Errors
    /// A unit fails. The simulation cannot be stepped after that.
    pub fn advance_to(&mut self, end: f64) -> Result<(), Error> {
        let snap = SNAP * self.setup.scenario.experiment.step;
        while self.stopped().is_none() && end - self.time() > snap {
            let now = self.time();
            let next = self.setup.time_after(self.done + 1);
            let whole = next <= end + snap;
            if whole && self.apart.is_none() {
                self.step()?;
                continue;
            }
            let to = if whole { next } else { end };
            self.step_by(now, between(now, to))?;
            self.apart = (!whole).then_some(to);
            self.done += u64::from(whole);
            self.happenings.observe(self.time(), &self.participants);
        }
        Ok(())
    }

    /// Whether it is at a communication point of the scenario.
    #[must_use]
    pub fn is_at_point(&self) -> bool {
        self.apart.is_none()
    }

    /// Changes a tunable parameter or a free input that is not open at the beginning of the next step, as an event of the
    /// scenario does.
    pub fn change(&mut self, port: Port, value: Value) {
        self.changes.push((port, value));
    }

    /// Makes the changes. Returns whether there were any.
    pub(super) fn make_changes(&mut self, time: f64) -> Result<bool, Error> {
        let any = !self.changes.is_empty();
        for (port, value) in self.changes.drain(..) {
            let instance = self.participants[port.instance].instance_mut();
            let set = instance.set(port.variable.0, &value);
            set.map_err(|source| Error::Step { time, source })?;
        }
        Ok(any)
    }

    /// Restores a state as [`Simulation::restore`] does, at a time (s) that [`Simulation::time`] returned with it.
    ///
    /// # Errors
    /// As [`Simulation::restore`].
    pub fn restore_at(&mut self, state: &SimulationState, time: f64) -> Result<(), StateError> {
        self.restore(state)?;
        self.changes.clear();
        self.apart = (time != self.setup.time_after(self.done)).then_some(time);
        Ok(())
    }
}
