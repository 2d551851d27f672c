//! Stepping an instance: inputs, the step with everything that can result from it, outputs.

use std::time::{Duration, Instant};

use fmi2_sys::fmi2Status as Status;

use super::{Backend, FmuError, FmuFault, Instance, StateId};
use crate::answer::Answer;
use crate::exchange::{Received, Sent, StepLayout};
use crate::fault::fail;
use crate::functions::Call;
use crate::request::{Data, Request};

impl Instance {
    /// Sets derivatives of inputs for the next step.
    ///
    /// # Errors
    /// The call fails.
    pub fn set_real_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), FmuError> {
        if references.is_empty() {
            return Ok(());
        }
        let request =
            Request::SetRealInputDerivatives(references.to_vec(), orders.to_vec(), values.to_vec());
        self.ask(&request, references).map(|_| ())
    }

    /// Reads derivatives of outputs at the end of the last step.
    ///
    /// # Errors
    /// The call fails.
    pub fn get_real_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Result<(), FmuError> {
        if references.is_empty() {
            return Ok(());
        }
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => {
                component.get_derivatives(references, orders, values)
            }
            Backend::Elsewhere(worker) => {
                let lists = (references.to_vec(), orders.to_vec());
                let reply = worker.perform(&Request::GetRealOutputDerivatives(lists.0, lists.1));
                reply.data.copy_reals(values);
                reply.answer
            }
        };
        self.check(answer, references)
    }

    /// Defines what is sent and received in every step from now on.
    ///
    /// # Errors
    /// The process of the instance has ended.
    pub fn lay_out(&mut self, layout: &StepLayout) -> Result<(), FmuError> {
        match &mut self.backend {
            Backend::Here { .. } => Ok(()),
            Backend::Elsewhere(worker) => {
                let answer = worker.lay_out(layout);
                self.check(answer, &[])
            }
        }
    }

    /// Sets all inputs of the next step.
    ///
    /// # Errors
    /// The call fails. For an isolated instance the step reports it.
    #[inline]
    pub fn send(&mut self, layout: &StepLayout, sent: &Sent) -> Result<(), FmuError> {
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => component.send(layout, sent),
            Backend::Elsewhere(worker) => worker.send(sent),
        };
        self.check(answer, layout.references(answer.call))
    }

    /// Reads all outputs at `time`, the end of the last step.
    ///
    /// # Errors
    /// The call fails.
    #[inline]
    pub fn receive(
        &mut self,
        layout: &StepLayout,
        received: &mut Received,
        time: f64,
    ) -> Result<(), FmuError> {
        self.alive()?;
        self.set_time(time);
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => component.receive(layout, received),
            Backend::Elsewhere(worker) => worker.receive(received),
        };
        self.check(answer, layout.references(answer.call))
    }

    /// Saves the state before every step from now on into this saved state; `None`: does not save it.
    pub fn save_before_steps(&mut self, place: Option<StateId>) {
        self.saved_before = place;
    }

    /// Begins a step in another process; [`do_step`](Self::do_step) waits for its end. Does nothing if the
    /// instance is in this process.
    ///
    /// # Errors
    /// The process has ended.
    #[inline]
    pub fn begin_step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        self.set_time(time);
        match &mut self.backend {
            Backend::Here { .. } => Ok(()),
            Backend::Elsewhere(worker) => {
                let answer = worker.begin_step(time, size, self.saved_before.map(StateId::slot));
                self.check(answer, &[])
            }
        }
    }

    /// Steps from `time` over `size`.
    ///
    /// # Errors
    /// The step was discarded or hangs, or the call fails.
    #[inline]
    pub fn do_step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        self.alive()?;
        self.set_time(time);
        let save = self.saved_before.map(StateId::slot);
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => match save.map(|slot| component.save_state(slot)) {
                Some(failed) if !failed.can_continue() => failed,
                _ => component.do_step(time, size),
            },
            Backend::Elsewhere(worker) => worker.do_step(time, size, save),
        };
        if !answer.is_good() {
            self.end_step(answer, time, size)?;
        }
        self.steps += 1;
        Ok(())
    }

    /// Handles a step that did not return `fmi2OK`.
    #[cold]
    fn end_step(&mut self, mut answer: Answer, time: f64, size: f64) -> Result<(), FmuError> {
        if answer.call == Call::fmi2DoStep {
            if answer.is(Status::fmi2Pending) {
                answer = Answer::new(Call::fmi2DoStep, self.poll(time)?);
            }
            if answer.is(Status::fmi2Discard) {
                return fail(self.discarded(time, size)?);
            }
        }
        self.check(answer, &[])
    }

    /// Waits until a pending step has ended.
    fn poll(&mut self, time: f64) -> Result<Status, FmuError> {
        let begin = Instant::now();
        let mut pause = Duration::from_micros(10);
        loop {
            let Data::Status(status) = self.ask(&Request::GetStepStatus, &[])? else {
                return Ok(Status::fmi2Error);
            };
            if status != Status::fmi2Pending.0 {
                return Ok(Status(status));
            }
            if begin.elapsed() > self.pending_limit {
                // an FMU that is still computing the step must not be freed
                if !self.perform(&Request::CancelStep).answer.is_good() {
                    self.dead.store(true, std::sync::atomic::Ordering::Relaxed);
                }
                self.running = false;
                let instance = self.name.clone();
                return fail(FmuFault::Hanging { instance, time, limit: self.pending_limit });
            }
            std::thread::sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(10));
        }
    }

    /// Asks an FMU that discarded its step which time it reached and whether it wants to end.
    fn discarded(&mut self, time: f64, size: f64) -> Result<FmuFault, FmuError> {
        let number = |reply: Result<Data, FmuError>| match reply {
            Ok(Data::Number(number)) => Some(number),
            _ => None,
        };
        // many FMUs do not answer; it is an error only if the FMU may not be called any more
        let last_successful = number(self.ask(&Request::GetLastSuccessfulTime, &[]));
        self.alive()?;
        let ended = number(self.ask(&Request::GetTerminated, &[]));
        self.alive()?;
        self.running = true;
        Ok(FmuFault::Discarded {
            instance: self.name.clone(),
            time,
            size,
            last_successful: last_successful.filter(|time| time.is_finite()),
            terminated: ended.is_some_and(|ended| ended != 0.0),
            can_retry: self.can_save_state(),
            messages: self.take_messages(),
        })
    }
}
