//! Units that make several steps of their own per communication step.
//!
//! A communication step of size h is divided into n steps of h/n. The inputs are the same functions of
//! time as for one step: each step begins with p(τ), p'(τ), p''(τ), p'''(τ) at its beginning τ. For a
//! unit that takes all derivatives, the only difference is the smaller step. For a unit that takes
//! derivatives up to an order below 3, the polynomial over each of its steps is
//! [reduced](Taylor::reduced) to that degree.
//!
//! Other units do not see what happens between communication points. With n > 1, a unit in a process of
//! its own does not step at the same time as the others.

use super::Participant;
use coupling::Taylor;
use fmi2_import::instance::FmuError;
use fmi2_import::span::parts;

/// Own steps, and the inputs for them.
#[derive(Debug)]
pub(super) struct Rate {
    /// number per communication step
    steps: u32,
    /// over the communication step
    inputs: Vec<Taylor>,
}

impl Rate {
    #[inline]
    pub(super) fn take(&mut self, inputs: &[Taylor]) {
        self.inputs.copy_from_slice(inputs);
    }
}

impl Participant {
    /// Sets the number of steps that the unit makes per communication step.
    pub fn set_steps(&mut self, steps: u32) {
        let inputs = vec![Taylor::ZERO; self.variables.inputs.reals.len()];
        self.rate = (steps > 1).then_some(Rate { steps, inputs });
    }

    /// Whether the unit's steps differ from the communication steps. It then gets all derivatives of its
    /// inputs from the coupling, even if the unit itself takes fewer.
    #[must_use]
    pub fn has_own_steps(&self) -> bool {
        self.rate.is_some() || self.slow.is_some()
    }

    /// Makes the unit's own steps over a communication step.
    pub(super) fn own_steps(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        let Some(rate) = self.rate.take() else { return Ok(()) };
        let result = self.all_steps(&rate, time, size);
        self.rate = Some(rate);
        result
    }

    fn all_steps(&mut self, rate: &Rate, time: f64, size: f64) -> Result<(), FmuError> {
        for (begin, part) in parts(time, size, rate.steps) {
            let tau = begin - time;
            self.fill(|k, degree| rate.inputs[k].shifted(tau).reduced(degree, part));
            if let Some(retry) = &mut self.retry {
                for (kept, p) in retry.inputs.iter_mut().zip(&rate.inputs) {
                    *kept = p.shifted(tau);
                }
            }
            self.send_values()?;
            self.one_step(begin, part)?;
        }
        Ok(())
    }
}
