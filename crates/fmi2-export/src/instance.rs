//! One instance of a unit: its values, its mode and time, and what the calls do.

use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::derivative::Scratch;
use crate::description::INPUT_DERIVATIVES;
use crate::interface::{Role, Type};
use crate::logger::Logger;
use crate::model::Step;
use crate::state::Mode;
use crate::table::Table;
use crate::unit::Unit;
use crate::values::{CText, Real, Values, Var};
use crate::{Error, Kind, Resources};

/// Everything of an instance that changes, apart from values and the model's state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Progress {
    pub(crate) mode: Mode,
    /// Current communication point, s.
    pub(crate) time: f64,
    pub(crate) stop: Option<f64>,
    /// Something that the initial state follows from was set since it was computed.
    pub(crate) state_stale: bool,
    /// A tunable parameter was set since the model was told.
    parameters_stale: bool,
    /// Something that outputs follow from was set since they were computed.
    outputs_stale: bool,
    /// Some input has derivatives.
    derivatives_set: bool,
}

impl Progress {
    pub(crate) const NEW: Self = Self {
        mode: Mode::Instantiated,
        time: 0.0,
        stop: None,
        state_stale: true,
        parameters_stale: false,
        outputs_stale: true,
        derivatives_set: false,
    };
}

/// One instance.
pub(crate) struct Instance {
    pub(crate) progress: Progress,
    pub(crate) values: Values,
    pub(crate) unit: Box<dyn Unit>,
    pub(crate) table: Table,
    pub(crate) logger: Logger,
    /// Messages on events, sent when the call is over.
    pub(crate) events: Vec<String>,
    resources: Resources,
    pub(crate) scratch: Option<Box<Scratch>>,
}

/// How far a communication point may be off from where the last step ended: rounding of an
/// importer that adds steps up, and nothing that matters beside a step.
fn slack(time: f64, size: f64) -> f64 {
    (1e-6 * size).max(8.0 * f64::EPSILON * time.abs())
}

impl Instance {
    pub(crate) fn new(
        unit: Box<dyn Unit>,
        table: Table,
        resources: Resources,
        logger: Logger,
    ) -> Self {
        let values = table.start.clone();
        let (progress, events, scratch) = (Progress::NEW, Vec::new(), None);
        Self { progress, values, unit, table, logger, events, resources, scratch }
    }

    /// Notes a message on an event, when such are wanted.
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
        self.progress.time = start;
        self.progress.stop = stop;
        self.progress.state_stale = true;
        self.progress.outputs_stale = true;
        Ok(())
    }

    pub(crate) fn enter_initialization(&mut self) {
        self.progress.mode = Mode::Initialization;
        self.event(|this| format!("initialization at t = {} s", this.progress.time));
    }

    pub(crate) fn exit_initialization(&mut self) -> Result<(), Error> {
        self.refresh()?;
        self.progress.mode = Mode::Step;
        self.event(|this| format!("initialized at t = {} s", this.progress.time));
        Ok(())
    }

    pub(crate) fn terminate(&mut self) {
        self.progress.mode = Mode::Terminated;
        self.event(|this| format!("terminated at t = {} s", this.progress.time));
    }

    /// As freshly instantiated, bit for bit.
    pub(crate) fn reset(&mut self) -> Result<(), Error> {
        if self.progress.mode == Mode::Poisoned {
            let table = self.unit.rebuild(&Resources::new(self.resources.path()))?;
            if table.guid != self.table.guid {
                let text = "the resources changed since the instance was made; make a new one";
                return Err(Error::invalid(text));
            }
            self.table = table;
            self.scratch = None;
        }
        self.unit.forget();
        self.values.clone_from(&self.table.start);
        self.progress = Progress::NEW;
        self.event(|_| "reset".to_owned());
        Ok(())
    }

    /// Brings everything that can be read up to date with everything that was set.
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
            Mode::Initialization => {
                if self.progress.state_stale {
                    self.unit.initialise(&mut self.values, time)?;
                }
            }
            Mode::Step | Mode::StepFailed => self.tell_parameters()?,
            // Nothing is computed any more; what is there may be looked at.
            _ => return Ok(()),
        }
        self.unit.outputs(&mut self.values, time)?;
        self.check_finite()?;
        self.progress.state_stale = false;
        self.progress.parameters_stale = false;
        self.progress.outputs_stale = false;
        Ok(())
    }

    fn tell_parameters(&mut self) -> Result<(), Error> {
        if self.progress.parameters_stale {
            self.unit.parameters_changed(&mut self.values)?;
            self.progress.parameters_stale = false;
        }
        Ok(())
    }

    #[inline]
    fn check_finite(&self) -> Result<(), Error> {
        match self.table.not_finite(&self.values) {
            None => Ok(()),
            Some(reference) => Err(self.infinite(reference)),
        }
    }

    #[cold]
    fn infinite(&self, reference: usize) -> Error {
        let name = self.table.name(Type::Real, reference);
        let value = self.values.reals[reference];
        Error::invalid(format!(
            "{name} is {value} at t = {} s: the model has left the range in which it computes; \
             check its inputs and parameters, or try a smaller step",
            self.progress.time
        ))
    }

    pub(crate) fn do_step(&mut self, time: f64, size: f64) -> Result<(), Error> {
        let slack = slack(time, size);
        let end = time + size;
        let past_stop = self.progress.stop.is_some_and(|stop| end > stop + slack);
        let expected = (time - self.progress.time).abs() <= slack;
        // NaN fails each of these comparisons.
        let sound = size > 0.0 && end > time && end.is_finite() && expected;
        if !sound || past_stop {
            return Err(self.wrong_step(time, size));
        }
        self.advance(Step { time, size }).map_err(|error| {
            if error.kind() != Kind::Discard {
                self.progress.mode = Mode::Error;
                return error;
            }
            if self.progress.time == end {
                // The step is done, only its outputs are not: there is no way back.
                self.progress.mode = Mode::Error;
                return Error::invalid(error);
            }
            self.progress.mode = Mode::StepFailed;
            error
        })
    }

    fn advance(&mut self, step: Step) -> Result<(), Error> {
        self.tell_parameters()?;
        self.unit.step(&mut self.values, step)?;
        self.progress.time = step.end();
        if self.progress.derivatives_set {
            self.extrapolate_inputs(step.size);
        }
        self.unit.outputs(&mut self.values, step.end())?;
        self.check_finite()?;
        self.progress.outputs_stale = false;
        Ok(())
    }

    /// Sets each input to the end of its polynomial and forgets the derivatives.
    fn extrapolate_inputs(&mut self, h: f64) {
        let inputs = self.table.real_inputs.iter();
        for (&reference, taylor) in inputs.zip(&mut self.values.taylor) {
            let [u, first, second, third] = *taylor;
            let end = u + h * (first + h / 2.0 * (second + h / 3.0 * third));
            self.values.reals[reference as usize] = end;
            *taylor = [end, 0.0, 0.0, 0.0];
        }
        self.progress.derivatives_set = false;
    }

    #[cold]
    fn wrong_step(&self, time: f64, size: f64) -> Error {
        let now = self.progress.time;
        let expected = (time - now).abs() <= slack(time, size);
        let moves = time + size > time;
        let text = if size <= 0.0 || !size.is_finite() {
            format!("communication step size {size} s is not greater than 0")
        } else if !expected {
            format!(
                "communication point {time} s is not where the instance stands, t = {now} s; \
                 steps must follow each other, or a saved state be set first"
            )
        } else if !moves {
            format!("communication step size {size} s vanishes beside t = {time} s in rounding")
        } else {
            let stop = self.progress.stop.unwrap_or(f64::INFINITY);
            format!("the step from {time} s by {size} s ends after the stop time {stop} s")
        };
        Error::invalid(text)
    }

    /// What setting something makes stale.
    #[inline]
    fn touched(&mut self, tunable: bool) {
        self.progress.outputs_stale = true;
        if self.progress.mode == Mode::Step {
            self.progress.parameters_stale |= tunable;
        } else {
            self.progress.state_stale = true;
        }
    }

    /// Copies real values out. `out` is C's memory, which need not be initialised.
    pub(crate) fn get_reals(
        &mut self,
        references: &[u32],
        out: &mut [std::mem::MaybeUninit<f64>],
    ) -> Result<(), Error> {
        self.refresh()?;
        for (&reference, out) in references.iter().zip(out) {
            let Some(&value) = self.values.reals.get(reference as usize) else {
                return Err(unknown(Type::Real, reference));
            };
            out.write(value);
        }
        Ok(())
    }

    /// Sets real values, all or none.
    pub(crate) fn set_reals(&mut self, references: &[u32], new: &[f64]) -> Result<(), Error> {
        let mode = self.progress.mode.bit();
        for (&reference, &value) in references.iter().zip(new) {
            let allowed = self.table.reals.get(reference as usize).is_some_and(|rule| {
                rule.settable & mode != 0 && value >= rule.low && value <= rule.high
            });
            if !allowed {
                return Err(self.refuse_real(reference, value));
            }
        }
        let mut tunable = false;
        for (&reference, &value) in references.iter().zip(new) {
            let rule = &self.table.reals[reference as usize];
            tunable |= rule.tunable;
            self.values.put_real(reference as usize, rule.slot, value);
        }
        if !references.is_empty() {
            self.touched(tunable);
        }
        Ok(())
    }

    #[cold]
    fn refuse_real(&self, reference: u32, value: f64) -> Error {
        let Some(rule) = self.table.reals.get(reference as usize) else {
            return unknown(Type::Real, reference);
        };
        let name = self.table.name(Type::Real, reference as usize);
        if rule.settable & self.progress.mode.bit() == 0 {
            return self.not_settable(Type::Real, reference);
        }
        if !value.is_finite() {
            return Error::invalid(format!("{name} cannot be set to {value}: it is not finite"));
        }
        let (low, high) = (rule.low, rule.high);
        Error::invalid(format!("{name} cannot be set to {value}: {}", range(low, high)))
    }

    #[cold]
    fn not_settable(&self, kind: Type, reference: u32) -> Error {
        let name = self.table.name(kind, reference as usize);
        let why = match self.table.role(kind, reference as usize) {
            Some(Role::Parameter) => "is fixed once initialization is over",
            Some(Role::Constant) => "is a constant",
            Some(Role::Output) => "is an output",
            _ => "is calculated by the model",
        };
        Error::invalid(format!("{name} cannot be set: it {why}"))
    }

    /// Checks that a non-real variable may be set now, and to this number.
    fn check(&self, kind: Type, reference: u32, value: Option<i32>) -> Result<(), Error> {
        let rules = &self.table.others[kind as usize - 1];
        let rule = rules.get(reference as usize).ok_or_else(|| unknown(kind, reference))?;
        if rule.settable & self.progress.mode.bit() == 0 {
            return Err(self.not_settable(kind, reference));
        }
        if let Some(value) = value
            && !(rule.low..=rule.high).contains(&value)
        {
            let name = self.table.name(kind, reference as usize);
            let range = range(rule.low, rule.high);
            return Err(Error::invalid(format!("{name} cannot be set to {value}: {range}")));
        }
        Ok(())
    }

    fn touched_others(&mut self, kind: Type, references: &[u32]) {
        let rules = &self.table.others[kind as usize - 1];
        let tunable = references.iter().any(|&reference| rules[reference as usize].tunable);
        if !references.is_empty() {
            self.touched(tunable);
        }
    }

    pub(crate) fn set_integers(&mut self, references: &[u32], new: &[i32]) -> Result<(), Error> {
        for (&reference, &value) in references.iter().zip(new) {
            self.check(Type::Integer, reference, Some(value))?;
        }
        for (&reference, &value) in references.iter().zip(new) {
            self.values.integers[reference as usize] = value;
        }
        self.touched_others(Type::Integer, references);
        Ok(())
    }

    /// Any number but 0 counts as true, as in C.
    pub(crate) fn set_booleans(&mut self, references: &[u32], new: &[i32]) -> Result<(), Error> {
        for &reference in references {
            self.check(Type::Boolean, reference, None)?;
        }
        for (&reference, &value) in references.iter().zip(new) {
            self.values.booleans[reference as usize] = value != 0;
        }
        self.touched_others(Type::Boolean, references);
        Ok(())
    }

    /// `new` may point into this instance's own strings, so the caller has copied them.
    pub(crate) fn set_strings(&mut self, references: &[u32], new: Vec<CText>) -> Result<(), Error> {
        for &reference in references {
            self.check(Type::Text, reference, None)?;
        }
        for (&reference, value) in references.iter().zip(new) {
            self.values.strings[reference as usize] = value;
        }
        self.touched_others(Type::Text, references);
        Ok(())
    }

    pub(crate) fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        new: &[f64],
    ) -> Result<(), Error> {
        for ((&reference, &order), &value) in references.iter().zip(orders).zip(new) {
            let rule = self.table.reals.get(reference as usize);
            let rule = rule.ok_or_else(|| unknown(Type::Real, reference))?;
            let name = self.table.name(Type::Real, reference as usize);
            if !rule.continuous {
                let text = format!("{name} is no continuous input and so has no derivative");
                return Err(Error::invalid(text));
            }
            if !(1..=INPUT_DERIVATIVES).contains(&order) {
                let text = format!(
                    "{name}: derivatives of order 1 to {INPUT_DERIVATIVES} are used, not {order}"
                );
                return Err(Error::invalid(text));
            }
            if !value.is_finite() {
                let text = format!("derivative {order} of {name} cannot be {value}");
                return Err(Error::invalid(text));
            }
        }
        for ((&reference, &order), &value) in references.iter().zip(orders).zip(new) {
            let slot = self.table.reals[reference as usize].slot;
            self.values.taylor[slot as usize][order as usize] = value;
            self.progress.derivatives_set = true;
        }
        Ok(())
    }

    pub(crate) fn output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        out: &mut [std::mem::MaybeUninit<f64>],
    ) -> Result<(), Error> {
        self.refresh()?;
        for (&reference, &order) in references.iter().zip(orders) {
            let rule = self.table.reals.get(reference as usize);
            let rule = rule.ok_or_else(|| unknown(Type::Real, reference))?;
            if !rule.output {
                let name = self.table.name(Type::Real, reference as usize);
                return Err(Error::invalid(format!("{name} is not an output")));
            }
            let highest = self.table.derivatives[reference as usize];
            if !u32::try_from(order).is_ok_and(|order| (1..=highest).contains(&order)) {
                return Err(self.refuse_derivative(reference, order, highest));
            }
        }
        if references.is_empty() {
            return Ok(());
        }
        self.unit.prepare_derivatives(&self.values)?;
        for ((&reference, &order), out) in references.iter().zip(orders).zip(out) {
            let output = Var { index: reference, slot: crate::values::NO_SLOT, of: Real };
            let value = self.unit.output_derivative(&self.values, output, order.unsigned_abs())?;
            out.write(self.check_derivative_value(reference, order, value)?);
        }
        Ok(())
    }

    /// Of an order that other outputs have, or of none: the instance goes on either way.
    #[cold]
    fn refuse_derivative(&self, reference: u32, order: i32, highest: u32) -> Error {
        let name = self.table.name(Type::Real, reference as usize);
        let most = self.table.interface.max_output_derivative_order();
        if u32::try_from(order).is_ok_and(|order| (1..=most).contains(&order)) {
            return Error::discard(format!(
                "derivative {order} of {name} is not offered, only up to order {highest}"
            ));
        }
        Error::invalid(format!("{name}: derivatives of order 1 to {most} are offered"))
    }

    #[inline]
    fn check_derivative_value(
        &self,
        reference: u32,
        order: i32,
        value: Option<f64>,
    ) -> Result<f64, Error> {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            return Ok(value);
        }
        let name = self.table.name(Type::Real, reference as usize);
        Err(match value {
            None => Error::discard(format!("derivative {order} of {name} is not offered")),
            Some(value) => {
                let time = self.progress.time;
                Error::invalid(format!("derivative {order} of {name} is {value} at t = {time} s"))
            }
        })
    }

    pub(crate) fn report(&mut self, request: &str) -> Result<String, Error> {
        self.refresh()?;
        self.unit
            .report(&self.values, request)?
            .filter(|text| !text.is_empty())
            .ok_or_else(|| Error::invalid(format!("the unit offers no report {request:?}")))
    }

    pub(crate) fn guid(&self) -> Uuid {
        self.table.guid
    }
}

#[cold]
pub(crate) fn unknown(kind: Type, reference: u32) -> Error {
    Error::invalid(format!("there is no {} variable with value reference {reference}", kind.name()))
}

fn range(low: impl std::fmt::Debug, high: impl std::fmt::Debug) -> String {
    format!("its range is {low:?} to {high:?}")
}
