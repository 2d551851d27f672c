//! What an algorithm needs of a unit beyond the plain step, asked for before the first step.
//!
//! What the description does not declare is never asked for, and what is declared only if the run needs
//! it. See [`Offer`] for what follows from `fmi2Error`.
//!
//! Derivatives of inputs above the first order have no word in the standard. They are not tried, on no
//! instance: units of a widespread exporter answer the second order with `fmi2Error`, or with a crash, in
//! the same process in which all other units run; others with `fmi2OK` or `fmi2Warning` and ignore from
//! then on what they are given, which only a comparison of steps would show. An instance that is thrown
//! away does not make that safe, and neither does a state that is restored afterwards. A process of its
//! own would, at the price of starting the unit once more, with its licence, its files and all time that
//! its initialization takes, to learn what few units can do. So the description's word counts: order 1,
//! or what the vendor annotation of the exporter that comes with this master says, or what a scenario
//! says of an instance (`input_derivatives`).

use super::Participant;
use crate::coupling::{Capabilities, Unit as _};
use fmi2_import::instance::{FmuError, Instance, Offer};

/// What the unit offers, as far as is known.
pub(super) fn capabilities(instance: &Instance) -> Capabilities {
    let unit = &instance.package().description().co_simulation;
    Capabilities {
        restore: instance.offers(Offer::States),
        variable_step: unit.can_handle_variable_communication_step_size,
        directional: instance.offers(Offer::Directional),
    }
}

impl Participant {
    /// Saves and restores the state, for an algorithm that needs it.
    ///
    /// # Errors
    /// `fmi2Error` and worse: the instance may not be continued.
    pub fn ask_for_states(&mut self) -> Result<(), FmuError> {
        if self.capabilities.restore {
            let warnings = self.instance.warnings().count();
            let saved = self.save(0).and_then(|()| self.restore(0));
            self.capabilities.restore = self.instance.unless_refused(saved)?
                && self.instance.warnings().count() == warnings;
        }
        Ok(())
    }

    /// Asks for one directional derivative that is needed later, for an algorithm that needs them.
    ///
    /// # Errors
    /// `fmi2Error` and worse: the instance may not be continued.
    pub fn ask_for_directional_derivatives(&mut self) -> Result<(), FmuError> {
        if self.capabilities.directional {
            let inputs = self.traffic.real_inputs.len();
            let Some(input) = (0..inputs).find(|&input| !self.fed_by(input).is_empty()) else {
                return Ok(());
            };
            let warnings = self.instance.warnings().count();
            let mut column = vec![0.0; self.traffic.real_outputs.len()];
            let answer = self.column(input, &mut column);
            let given = self.instance.unless_refused(answer)?;
            self.capabilities.directional = given && self.instance.warnings().count() == warnings;
        }
        Ok(())
    }

    /// Positions of the Real outputs that follow a Real input at once, by the description.
    fn fed_by(&mut self, input: usize) -> &[usize] {
        let Self { feeds, traffic, instance, .. } = self;
        let feeds = feeds.get_or_insert_with(|| {
            let description = instance.package().description();
            let mut feeds = vec![Vec::new(); traffic.real_inputs.len()];
            for (k, &(output, _)) in traffic.real_outputs.iter().enumerate() {
                let inputs = description.step_dependencies(output);
                for (list, (variable, _)) in feeds.iter_mut().zip(&traffic.real_inputs) {
                    if inputs.contains(variable) {
                        list.push(k);
                    }
                }
            }
            feeds
        });
        &feeds[input]
    }

    /// Derivatives of the Real outputs by a Real input: of those that depend on it, the others' are 0.
    /// Never asks for none.
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
