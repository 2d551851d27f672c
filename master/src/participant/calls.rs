//! The calls of a step: inputs to the unit, a step of its own size, outputs from the unit.

use super::variables::Buffers;
use super::{Participant, Slot};
use coupling::{Taylor, UnitValues};
use fmi2_import::exchange::{Received, Sent};
use fmi2_import::instance::FmuError;
use fmi2_import::per_type::PerType;

impl Participant {
    #[inline]
    pub(super) fn send_inputs(&mut self, inputs: &UnitValues) -> Result<(), FmuError> {
        self.sent.values.integers.copy_from_slice(&inputs.integers);
        self.sent.values.booleans.copy_from_slice(&inputs.booleans);
        match &mut self.rate {
            Some(rate) => rate.take(&inputs.reals),
            None => self.fill(|k, _| inputs.reals[k]),
        }
        if let Some(retry) = &mut self.retry {
            retry.inputs.copy_from_slice(&inputs.reals);
        }
        let begin = self.timing.begin();
        for (&reference, text) in self.string_inputs.iter().zip(&inputs.strings) {
            self.instance.set_string(reference, text)?;
        }
        if self.rate.is_none() {
            self.send_values()?;
        }
        if let Some(begin) = begin {
            self.timing.exchanging += begin.elapsed();
        }
        Ok(())
    }

    #[inline]
    pub(super) fn one_step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        let size = self.own_size(time, size);
        match self.instance.do_step(time, size) {
            Err(error) => self.step_in_parts(time, size, error),
            Ok(()) => Ok(()),
        }
    }

    /// Sets the Real inputs to send next. `polynomial` maps an input's position and the highest
    /// derivative that it takes to its polynomial.
    #[inline]
    pub(super) fn fill(&mut self, polynomial: impl Fn(usize, usize) -> Taylor) {
        for (k, (_, highest)) in self.variables.inputs.reals.iter().enumerate() {
            let p = polynomial(k, *highest);
            self.sent.values.reals[k] = p[0];
            for (place, derivative) in self.places[k].iter().zip(&p.0[1..=*highest]) {
                self.sent.derivatives[*place] = *derivative;
            }
        }
    }

    /// Replaces the values read of inputs by those just set: before a step they cannot be read again.
    pub(super) fn show_inputs(&mut self, inputs: &UnitValues) {
        let Self { variables, slots, received, .. } = self;
        let (lists, values) = (&variables.inputs, &mut received.values);
        for ((variable, _), p) in lists.reals.iter().zip(&inputs.reals) {
            if let Some(&Slot::Real(k)) = slots.get(variable) {
                values.reals[k] = p[0];
            }
        }
        for (variable, value) in lists.integers.iter().zip(&inputs.integers) {
            if let Some(&Slot::Integer(k)) = slots.get(variable) {
                values.integers[k] = *value;
            }
        }
        for (variable, value) in lists.booleans.iter().zip(&inputs.booleans) {
            if let Some(&Slot::Boolean(k)) = slots.get(variable) {
                values.booleans[k] = *value;
            }
        }
        for (variable, value) in lists.strings.iter().zip(&inputs.strings) {
            if let Some(&Slot::String(k)) = slots.get(variable) {
                values.strings[k].clone_from(value);
            }
        }
    }

    fn send_layout(&mut self) -> Result<(), FmuError> {
        self.instance.lay_out(&self.layout)?;
        self.laid_out = true;
        Ok(())
    }

    #[inline]
    pub(super) fn send_values(&mut self) -> Result<(), FmuError> {
        if !self.laid_out {
            self.send_layout()?;
        }
        let Buffers { values, derivatives } = &self.sent;
        let PerType { reals, integers, booleans, .. } = values;
        let values = PerType {
            reals: reals.as_slice(),
            integers: integers.as_slice(),
            booleans: booleans.as_slice(),
            strings: (),
        };
        self.instance.send(&self.layout, &Sent { values, derivatives })
    }

    #[inline]
    pub(super) fn receive_values(&mut self, time: f64) -> Result<(), FmuError> {
        if !self.laid_out {
            self.send_layout()?;
        }
        let Buffers { values, derivatives } = &mut self.received;
        let PerType { reals, integers, booleans, .. } = values;
        let values = PerType {
            reals: reals.as_mut_slice(),
            integers: integers.as_mut_slice(),
            booleans: booleans.as_mut_slice(),
            strings: (),
        };
        self.instance.receive(&self.layout, &mut Received { values, derivatives }, time)
    }

    /// Strings one by one: a unit may reuse the memory of one for the next.
    #[inline]
    pub(super) fn receive_strings(&mut self) -> Result<(), FmuError> {
        for (text, &variable) in self.received.values.strings.iter_mut().zip(&self.read.strings) {
            let variables = &self.instance.package().description().variables;
            *text = self.instance.get_string(variables[variable].value_reference)?;
        }
        Ok(())
    }
}
