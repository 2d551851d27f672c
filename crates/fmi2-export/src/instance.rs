//! One instance of a unit: its values, mode and time, initialization and evaluation.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::erased::ErasedModel;
use crate::logger::Logger;
use crate::per_type::VariableType;
use crate::scratch::DerivativeScratch;
use crate::state::InstanceMode;
use crate::table::VariableTable;
use crate::values::Values;
use crate::{Error, Resources};

/// The part of an instance that changes, apart from the values and the model's state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct InstanceProgress {
    pub(crate) mode: InstanceMode,
    /// Current communication point, s.
    pub(crate) time: f64,
    pub(crate) stop: Option<f64>,
    /// A value that the initial state depends on was set after it was computed.
    pub(crate) state_stale: bool,
    /// A tunable parameter was set and the model has not been notified yet.
    pub(crate) parameters_stale: bool,
    /// A value that outputs depend on was set after they were computed.
    pub(crate) outputs_stale: bool,
    /// Some input has derivatives.
    pub(crate) derivatives_set: bool,
    /// The model has ended the simulation.
    pub(crate) ended: bool,
}

impl InstanceProgress {
    pub(crate) const NEW: Self = Self {
        mode: InstanceMode::Instantiated,
        time: 0.0,
        stop: None,
        state_stale: true,
        parameters_stale: false,
        outputs_stale: true,
        derivatives_set: false,
        ended: false,
    };
}

/// One instance.
pub(crate) struct ExportedInstance {
    pub(crate) progress: InstanceProgress,
    pub(crate) values: Values,
    pub(crate) model: Box<dyn ErasedModel>,
    pub(crate) table: Arc<VariableTable>,
    pub(crate) logger: Logger,
    /// Messages on events, sent when the call is over.
    pub(crate) events: Vec<String>,
    resources: Resources,
    pub(crate) scratch: Option<Box<DerivativeScratch>>,
}

impl ExportedInstance {
    pub(crate) fn new(
        model: Box<dyn ErasedModel>,
        table: Arc<VariableTable>,
        resources: Resources,
        logger: Logger,
    ) -> Self {
        let values = table.start.clone();
        let (progress, events, scratch) = (InstanceProgress::NEW, Vec::new(), None);
        Self { progress, values, model, table, logger, events, resources, scratch }
    }

    /// Queues a message about an event if these are enabled.
    pub(crate) fn event(&mut self, text: impl FnOnce(&Self) -> String) {
        if self.logger.wants_events() {
            let text = text(self);
            self.events.push(text);
        }
    }

    pub(crate) fn setup(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Result<(), Error> {
        if !start.is_finite() {
            return Err(Error::invalid(format!("start time {start} is not finite")));
        }
        if let Some(stop) = stop
            && (stop.is_nan() || stop < start)
        {
            return Err(Error::invalid(format!(
                "stop time {stop} s is before the start {start} s"
            )));
        }
        if let Some(tolerance) = tolerance
            && !(tolerance > 0.0 && tolerance.is_finite())
        {
            return Err(Error::invalid(format!("tolerance {tolerance} is not greater than 0")));
        }
        self.model.experiment(start, stop, tolerance);
        self.progress.time = start;
        self.progress.stop = stop;
        self.progress.state_stale = true;
        self.progress.outputs_stale = true;
        Ok(())
    }

    pub(crate) fn enter_initialization(&mut self) {
        self.progress.mode = InstanceMode::Initialization;
        self.event(|this| format!("initialization at t = {} s", this.progress.time));
    }

    pub(crate) fn exit_initialization(&mut self) -> Result<(), Error> {
        self.refresh()?;
        self.model.begins()?;
        self.progress.mode = InstanceMode::Step;
        self.event(|this| format!("initialized at t = {} s", this.progress.time));
        Ok(())
    }

    pub(crate) fn terminate(&mut self) {
        self.progress.mode = InstanceMode::Terminated;
        self.event(|this| format!("terminated at t = {} s", this.progress.time));
    }

    /// Back to the state after instantiation, bit for bit.
    pub(crate) fn reset(&mut self) -> Result<(), Error> {
        if self.progress.mode == InstanceMode::Poisoned {
            let table = self.model.rebuild(&self.resources.again())?;
            if table.guid != self.table.guid {
                let text = "the resources have changed since the instantiation; instantiate again";
                return Err(Error::invalid(text));
            }
            self.table = Arc::new(table);
            self.scratch = None;
        }
        self.model.forget();
        self.values.clone_from(&self.table.start);
        self.progress = InstanceProgress::NEW;
        self.event(|_| "reset".to_owned());
        Ok(())
    }

    /// Recomputes everything that depends on values set since the last evaluation.
    #[inline]
    pub(crate) fn refresh(&mut self) -> Result<(), Error> {
        let progress = &self.progress;
        if progress.state_stale | progress.parameters_stale | progress.outputs_stale {
            return self.evaluate();
        }
        Ok(())
    }

    fn evaluate(&mut self) -> Result<(), Error> {
        let time = self.progress.time;
        match self.progress.mode {
            InstanceMode::Initialization => {
                if self.progress.state_stale {
                    let initialised = self.model.initialise(&mut self.values, time);
                    self.take_messages();
                    initialised?;
                }
            }
            InstanceMode::Step | InstanceMode::StepFailed => self.tell_parameters()?,
            // Nothing is computed any more; the existing values may be read.
            _ => return Ok(()),
        }
        self.model.outputs(&mut self.values, time)?;
        self.check_finite()?;
        self.progress.state_stale = false;
        self.progress.parameters_stale = false;
        self.progress.outputs_stale = false;
        Ok(())
    }

    /// Queues the model's messages if events are enabled.
    #[inline]
    pub(crate) fn take_messages(&mut self) {
        let messages = self.model.messages();
        if self.logger.wants_events() {
            self.events.extend(messages);
        }
    }

    /// Refuses to save or restore states if the unit cannot.
    pub(crate) fn check_saves(&self) -> Result<(), Error> {
        match &self.table.interface.limits.states {
            None => Ok(()),
            Some(why) => Err(Error::invalid(format!("the unit cannot save its state: {why}"))),
        }
    }

    pub(crate) fn tell_parameters(&mut self) -> Result<(), Error> {
        if self.progress.parameters_stale {
            self.model.parameters_changed(&mut self.values)?;
            self.progress.parameters_stale = false;
        }
        Ok(())
    }

    #[inline]
    pub(crate) fn check_finite(&self) -> Result<(), Error> {
        match self.table.not_finite(&self.values) {
            None => Ok(()),
            Some(reference) => Err(self.infinite(reference)),
        }
    }

    #[cold]
    fn infinite(&self, reference: usize) -> Error {
        let name = self.table.name(VariableType::Real, reference);
        let value = self.values.arrays.reals[reference];
        Error::invalid(format!(
            "{name} is {value} at t = {} s: the model has left its valid range; \
             check its inputs and parameters, or try a smaller step",
            self.progress.time
        ))
    }

    /// Marks what becomes stale when a value is set.
    #[inline]
    pub(crate) fn touched(&mut self, tunable: bool) {
        self.progress.outputs_stale = true;
        if self.progress.mode == InstanceMode::Step {
            self.progress.parameters_stale |= tunable;
        } else {
            self.progress.state_stale = true;
        }
    }

    pub(crate) fn report(&mut self, request: &str) -> Result<String, Error> {
        self.refresh()?;
        self.model
            .report(&self.values, request)?
            .filter(|text| !text.is_empty())
            .ok_or_else(|| Error::invalid(format!("the unit offers no report {request:?}")))
    }

    pub(crate) fn guid(&self) -> Uuid {
        self.table.guid
    }
}

#[cold]
pub(crate) fn unknown(kind: VariableType, reference: u32) -> Error {
    Error::invalid(format!("there is no {} variable with value reference {reference}", kind.name()))
}
