//! Capabilities beyond the plain step, tried before the first step.
//!
//! A capability is tried only if the description declares it and the run needs it. See [`Offer`] for the
//! consequences of `fmi2Error`.
//!
//! Derivatives of inputs above the first order are never tried: FMI 2.0 has no flag for them. Units of a
//! widespread exporter answer the second order with `fmi2Error` or with a crash, in the process of all
//! other units. Others answer with `fmi2OK` or `fmi2Warning` and ignore the inputs from then on, which
//! only a comparison of steps would show. Neither a separate instance nor a restored state makes the
//! attempt safe. A separate process would, but the unit would have to be started and initialized twice.
//! So the order is 1, or what the vendor annotation of `fmi2-export` declares, or what the scenario sets
//! for an instance (`input_derivatives`).

use super::Participant;
use coupling::{Capabilities, Unit as _};
use fmi2_import::instance::{FmuError, Instance, Offer};

/// The capabilities that the unit declares.
pub(super) fn capabilities(instance: &Instance) -> Capabilities {
    let unit = &instance.package().description().co_simulation;
    Capabilities {
        restore: instance.offers(Offer::States),
        variable_step: unit.can_handle_variable_communication_step_size,
        directional: instance.offers(Offer::Directional),
    }
}

impl Participant {
    /// Tries to save and restore the state, for an algorithm that needs it.
    ///
    /// # Errors
    /// `fmi2Error` and worse: the instance can no longer be used.
    pub fn probe_states(&mut self) -> Result<(), FmuError> {
        if self.capabilities.restore {
            let warnings = self.instance.warnings().count();
            let saved = self.save(0).and_then(|()| self.restore(0));
            self.capabilities.restore = self.instance.unless_refused(saved)?
                && self.instance.warnings().count() == warnings;
        }
        Ok(())
    }

    /// Tries to read one directional derivative, for an algorithm that needs them.
    ///
    /// # Errors
    /// `fmi2Error` and worse: the instance can no longer be used.
    pub fn probe_directional_derivatives(&mut self) -> Result<(), FmuError> {
        if self.capabilities.directional {
            let inputs = self.variables.inputs.reals.len();
            let Some(input) = (0..inputs).find(|&input| !self.fed_by(input).is_empty()) else {
                return Ok(());
            };
            let warnings = self.instance.warnings().count();
            let mut column = vec![0.0; self.variables.outputs.reals.len()];
            let answer = self.column(input, &mut column);
            let given = self.instance.unless_refused(answer)?;
            self.capabilities.directional = given && self.instance.warnings().count() == warnings;
        }
        Ok(())
    }

    /// Positions of the Real outputs that depend directly on a Real input, by the description.
    fn fed_by(&mut self, input: usize) -> &[usize] {
        let Self { feeds, variables, instance, .. } = self;
        let feeds = feeds.get_or_insert_with(|| {
            let description = instance.package().description();
            let mut feeds = vec![Vec::new(); variables.inputs.reals.len()];
            for (k, &(output, _)) in variables.outputs.reals.iter().enumerate() {
                let inputs = description.step_dependencies(output.0);
                for (list, (variable, _)) in feeds.iter_mut().zip(&variables.inputs.reals) {
                    if inputs.contains(&variable.0) {
                        list.push(k);
                    }
                }
            }
            feeds
        });
        &feeds[input]
    }

    /// Derivatives of the Real outputs with respect to a Real input. The unit is asked only for outputs
    /// that depend on it; the others have 0.
    pub(super) fn column(&mut self, input: usize, column: &mut [f64]) -> Result<(), FmuError> {
        column.fill(0.0);
        let places = self.fed_by(input).to_vec();
        if places.is_empty() {
            return Ok(());
        }
        let known = self.layout.set.reals[input];
        // outputs that feed inputs come first
        let unknowns: Vec<u32> = places.iter().map(|&k| self.layout.get.reals[k]).collect();
        let mut gains = vec![0.0; unknowns.len()];
        self.instance.get_directional_derivative(&unknowns, &[known], &[1.0], &mut gains)?;
        places.into_iter().zip(gains).for_each(|(k, gain)| column[k] = gain);
        Ok(())
    }
}
