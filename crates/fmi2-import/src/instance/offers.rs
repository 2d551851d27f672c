//! Optional functions that an FMU declares, without those that it turned out to refuse.
//!
//! The standard does not allow to continue with an instance that has returned `fmi2Error` (FMI 2.0.5,
//! 2.1.3). So an optional function is called only if the description declares it and the run needs it,
//! and first before the first step. If it returns `fmi2Error` nevertheless, the instance is freed and all
//! instances are started again without that [`Offer`].

use fmi2_sys::fmi2Status as Status;

use super::{FmuError, FmuFault, Instance};
use crate::activity::Activity;
use crate::description::ModelDescription;
use crate::fault::Loss;
use crate::functions::Call;
use crate::logger::Message;
use crate::signal::signal_name;

/// An optional function of FMI 2.0.
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
    /// The offer that a function belongs to.
    fn of_call(call: Call) -> Option<Self> {
        Some(match call {
            Call::fmi2GetRealOutputDerivatives => Self::OutputDerivatives,
            Call::fmi2GetFMUstate | Call::fmi2SetFMUstate => Self::States,
            Call::fmi2GetDirectionalDerivative => Self::Directional,
            _ => return None,
        })
    }
}

/// An instance failed in a function that its FMU need not offer but declares.
#[derive(Debug)]
pub struct BrokenPromise {
    /// Name of the instance in the scenario.
    pub instance: String,
    /// What was declared.
    pub offer: Offer,
    /// The C function.
    pub call: Call,
    /// The status, or how the process ended, in words.
    pub how: String,
    /// What the FMU logged, oldest first.
    pub messages: Vec<Message>,
}

impl BrokenPromise {
    /// The broken promise that an error reports, if it does.
    pub fn of(error: &FmuError) -> Option<Self> {
        let (instance, call, how, messages) = match error.fault() {
            FmuFault::Status { instance, call, status: Status::fmi2Error, messages, .. } => {
                (instance, *call, format!("returned {}", Status::fmi2Error), messages)
            }
            FmuFault::Lost {
                instance,
                how: Loss::Crashed { signal },
                call: Activity::Call(call),
                messages,
                ..
            } => (instance, *call, format!("crashed ({})", signal_name(*signal)), messages),
            _ => return None,
        };
        let (instance, messages) = (instance.clone(), messages.clone());
        Some(Self { instance, offer: Offer::of_call(call)?, call, how, messages })
    }
}

/// The offers that are still valid.
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
    /// Whether the FMU declares it and has not refused it.
    #[must_use]
    pub fn offers(&self, offer: Offer) -> bool {
        let mut offers = self.offers;
        *offers.place(offer)
    }

    /// Whether an optional call succeeded. The messages of a refusal are kept for
    /// [`take_earlier_messages`](Self::take_earlier_messages).
    ///
    /// # Errors
    /// The instance cannot be used further.
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

    /// Does not use it from now on.
    pub fn forgo(&mut self, offer: Offer) {
        *self.offers.place(offer) = false;
    }
}
