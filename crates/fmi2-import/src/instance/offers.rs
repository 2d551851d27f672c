//! What a unit declares to offer beyond the plain step, less what it turned out to refuse.
//!
//! By the standard an instance that has returned `fmi2Error` may not be continued (FMI 2.0.5, 2.1.3). So
//! nothing is tried on an instance that the description does not declare, and what is declared is asked
//! for only if the run needs it, before the first step. If the unit answers `fmi2Error` all the same, the
//! instance is freed and all units are started again, without that [`Offer`].

use super::fault::signal_name;
use super::{FmuError, FmuFault, Instance};
use crate::description::ModelDescription;
use crate::logger::Message;

/// Something that a description declares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Offer {
    /// `fmi2GetRealOutputDerivatives` (maxOutputDerivativeOrder).
    OutputDerivatives,
    /// `fmi2GetFMUstate` and `fmi2SetFMUstate` (canGetAndSetFMUstate).
    States,
    /// `fmi2GetDirectionalDerivative` (providesDirectionalDerivative).
    Directional,
}

impl Offer {
    /// What a C function belongs to.
    #[must_use]
    pub fn of_call(call: &str) -> Option<Self> {
        Some(match call {
            "fmi2GetRealOutputDerivatives" => Self::OutputDerivatives,
            "fmi2GetFMUstate" | "fmi2SetFMUstate" => Self::States,
            "fmi2GetDirectionalDerivative" => Self::Directional,
            _ => return None,
        })
    }
}

/// An instance is lost because its unit does not keep what it declares.
#[derive(Debug)]
pub struct BrokenPromise {
    /// The instance, by its name in the scenario.
    pub instance: String,
    /// What was declared.
    pub offer: Offer,
    /// The C function.
    pub call: &'static str,
    /// The status, or what ended the process, in words.
    pub how: String,
    /// Messages that the FMU logged in this call, oldest first.
    pub messages: Vec<Message>,
}

impl BrokenPromise {
    /// Whether it is this that an error is about.
    pub fn of(error: &FmuError) -> Option<Self> {
        let (instance, call, how, messages) = match error.fault() {
            FmuFault::Status { instance, call, status, messages, .. } if status == "fmi2Error" => {
                (instance, *call, format!("returned {status}"), messages)
            }
            FmuFault::Crashed { instance, call, signal, messages, .. } => {
                (instance, *call, format!("crashed ({})", signal_name(*signal)), messages)
            }
            _ => return None,
        };
        let (instance, messages) = (instance.clone(), messages.clone());
        Some(Self { instance, offer: Offer::of_call(call)?, call, how, messages })
    }
}

/// Which offers stand.
#[derive(Debug, Clone, Copy)]
pub(super) struct Offers {
    output_derivatives: bool,
    states: bool,
    directional: bool,
}

impl Offers {
    pub(super) fn of(description: &ModelDescription) -> Self {
        let unit = &description.co_simulation;
        Self {
            output_derivatives: unit.max_output_derivative_order > 0,
            states: unit.can_get_and_set_fmu_state,
            directional: unit.provides_directional_derivative,
        }
    }

    fn place(&mut self, offer: Offer) -> &mut bool {
        match offer {
            Offer::OutputDerivatives => &mut self.output_derivatives,
            Offer::States => &mut self.states,
            Offer::Directional => &mut self.directional,
        }
    }
}

impl Instance {
    /// Whether the unit declares it and has not refused it.
    #[must_use]
    pub fn offers(&self, offer: Offer) -> bool {
        let mut offers = self.offers;
        *offers.place(offer)
    }

    /// Whether a call was made that the unit need not answer. What it says with a refusal is kept for
    /// those who take its messages.
    ///
    /// # Errors
    /// The instance may not be continued.
    pub fn unless_refused(&mut self, answer: Result<(), FmuError>) -> Result<bool, FmuError> {
        match answer {
            Ok(()) => Ok(true),
            Err(error) if error.is_refusal() => {
                if let FmuFault::Status { messages, .. } = error.fault() {
                    self.inherit(messages.clone());
                }
                Ok(false)
            }
            Err(error) => Err(error),
        }
    }

    /// Never asks the unit for it.
    pub fn forgo(&mut self, offer: Offer) {
        *self.offers.place(offer) = false;
    }
}
