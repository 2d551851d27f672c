//! Steps of a participant, as coupling algorithms make them.

use super::Participant;
use super::slow::Slow;
use coupling::{Capabilities, InputIndex, Unit, UnitValues};
use fmi2_import::instance::FmuError;

impl Unit for Participant {
    type Error = FmuError;

    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn save(&mut self, place: usize) -> Result<(), FmuError> {
        self.states[place] = Some(self.instance.save_state(self.states[place])?);
        if let Some(slow) = &mut self.slow {
            slow.save(place);
        }
        Ok(())
    }

    fn restore(&mut self, place: usize) -> Result<(), FmuError> {
        if let Some(slow) = &mut self.slow {
            slow.restore(place);
        }
        match self.states[place] {
            Some(state) => self.instance.restore_state(state),
            None => Ok(()),
        }
    }

    fn directional(&mut self, input: InputIndex, column: &mut [f64]) -> Result<(), FmuError> {
        self.column(input.0, column)
    }

    fn preset(&mut self, inputs: &UnitValues) -> Result<(), FmuError> {
        let set = &self.layout.set;
        let reals: Vec<f64> = inputs.reals.iter().map(|p| p[0]).collect();
        self.instance.set_real(&set.reals, &reals)?;
        self.instance.set_integer(&set.integers, &inputs.integers)?;
        self.instance.set_boolean(&set.booleans, &inputs.booleans)?;
        for (&reference, text) in self.string_inputs.iter().zip(&inputs.strings) {
            self.instance.set_string(reference, text)?;
        }
        self.show_inputs(inputs);
        Ok(())
    }

    fn send(&mut self, inputs: &UnitValues) -> Result<(), FmuError> {
        self.timing.begin_step();
        match &mut self.slow {
            Some(slow) => {
                slow.take(inputs);
                Ok(())
            }
            None => self.send_inputs(inputs),
        }
    }

    fn begin_step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        if self.slow.is_some() {
            return self.begin_slow_step(time, size);
        }
        match self.rate {
            // its own steps need new inputs in between
            Some(_) => Ok(()),
            None => self.instance.begin_step(time, self.own_size(time, size)),
        }
    }

    fn step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        let begin = self.timing.begin();
        if self.slow.is_some() {
            self.slow_step(time, size)?;
        } else if self.rate.is_some() {
            self.own_steps(time, size)?;
        } else {
            self.one_step(time, size)?;
        }
        if let Some(begin) = begin {
            self.timing.stepping += begin.elapsed();
        }
        Ok(())
    }

    fn receive(&mut self, time: f64, outputs: &mut UnitValues) -> Result<(), FmuError> {
        let begin = self.timing.begin();
        // between its own points, a slow unit's outputs are held
        if !self.slow.as_ref().is_some_and(Slow::waits) {
            self.receive_values(time)?;
            self.receive_strings()?;
        }
        for (text, received) in outputs.strings.iter_mut().zip(&self.received.values.strings) {
            text.clone_from(received);
        }
        if let Some(begin) = begin {
            self.timing.exchanging += begin.elapsed();
        }
        // 0·x is zero unless x is NaN or infinite: one sum covers all values
        let suspicious: f64 = self.received.values.reals.iter().map(|x| x * 0.0).sum();
        if suspicious != 0.0 {
            self.find_odd_values(time)?;
        }
        if self.instance.warnings().steps() != self.watch.seen() {
            self.look_for_stall(time);
        }
        let mut derivatives = self.received.derivatives.iter();
        for (k, &(variable, highest)) in self.variables.outputs.reals.iter().enumerate() {
            let point = &mut outputs.reals[k];
            point[0] = self.received.values.reals[k];
            for (place, &value) in point.0[1..=highest].iter_mut().zip(&mut derivatives) {
                if !value.is_finite() {
                    return Err(self.instance.not_finite(variable.0, value, time).into());
                }
                *place = value;
            }
        }
        let feeding = outputs.integers.len();
        outputs.integers.copy_from_slice(&self.received.values.integers[..feeding]);
        for check in &self.variables.items {
            let value = outputs.integers[check.output];
            if check.items.binary_search_by_key(&value, |item| item.0).is_err() {
                return Err(self.instance.no_item(check.variable.0, value, &check.target, time));
            }
        }
        let feeding = outputs.booleans.len();
        outputs.booleans.copy_from_slice(&self.received.values.booleans[..feeding]);
        Ok(())
    }
}
