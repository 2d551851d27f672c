//! How to fix faults.

use fmi2_sys::fmi2Status as Status;

use super::{FmuFault, Loss};
use crate::activity::Activity;
use crate::functions::Call;

impl FmuFault {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Refused { .. } => {
                "a unit refuses if its modelDescription.xml and its binary do not belong together \
                 (different GUID) or its resources are missing; package it again"
            }
            Self::NotFinite { .. } => {
                "the model left its range of validity: check parameters and start values, or use a \
                 smaller step"
            }
            Self::NoItem { .. } => {
                "the two enumerations have different items: ask the makers of the units which value \
                 means what"
            }
            Self::Discarded { terminated: true, .. } => "the unit itself ended the simulation",
            Self::Discarded { can_retry: true, .. } => {
                "use a smaller step (--step), or set \"on_discard\": \"retry\" under \"algorithm\" to \
                 divide such steps into parts"
            }
            Self::Discarded { .. } => {
                "use a smaller step (--step); the unit cannot save its state, so the step cannot be \
                 divided into parts"
            }
            Self::Status { status, call, .. } => of_status(*status, *call)
                .unwrap_or("check the unit's parameters and inputs; a smaller step may help"),
            Self::Stalled { .. } => {
                "the unit stopped by itself; its messages in events.csv say why, and results after that \
                 time are not valid"
            }
            Self::Lost { how, call, .. } => return of_loss(how, *call),
            Self::Hanging { .. } => "if the unit is still computing the step, allow more time",
            Self::NoProcess { .. } => {
                "check the limits on processes and memory, or run without --isolate"
            }
            Self::CannotIsolate { .. } => "run without --isolate",
            Self::Lacks { .. } => {
                "the unit's binary is incomplete; `maglev validate` lists the missing functions"
            }
            _ => return None,
        })
    }

    /// How to fix it before the first step, where that is known.
    #[must_use]
    pub fn help_at_start(&self) -> Option<&'static str> {
        match self {
            Self::Status { status, call, .. } if of_status(*status, *call).is_none() => {
                Some("check the unit's parameters, start values and inputs")
            }
            _ => self.help(),
        }
    }
}

/// Where something particular is known.
fn of_status(status: Status, call: Call) -> Option<&'static str> {
    Some(match (status, call) {
        (Status::fmi2Fatal, _) => {
            "the unit cannot continue: check its parameters and inputs, or ask the maker of the unit"
        }
        (_, Call::fmi2SetRealInputDerivatives) => {
            "the unit declares that it accepts derivatives of inputs (canInterpolateInputs) but does \
             not; set \"input_derivatives\": 0 for its instance in the scenario, so that its inputs are \
             constant over a step"
        }
        (_, Call::fmi2GetRealOutputDerivatives) => {
            "the unit declares derivatives of outputs (maxOutputDerivativeOrder) but does not provide \
             them; set \"derivatives\": false under \"algorithm\" to compute them from past values"
        }
        (_, Call::fmi2GetDirectionalDerivative) => {
            "the unit declares directional derivatives (providesDirectionalDerivative) but does not \
             provide them; set \"iteration\": { \"jacobian\": \"steps\" } under \"algorithm\", so that \
             Newton's method uses differences of steps"
        }
        _ => return None,
    })
}

fn of_loss(how: &Loss, call: Activity) -> Option<&'static str> {
    Some(match how {
        Loss::Crashed { signal: 9 } => {
            "if nobody ended the process by hand, it probably used too much memory and the system ended it"
        }
        Loss::Crashed { .. } => {
            "the unit has a bug: report it to the maker of the unit, or run it in a debugger; other \
             parameters, other inputs or a smaller step may avoid the crash"
        }
        Loss::Exited { .. } => {
            "a unit must not end its process; perhaps its license, its resources or a program that it \
             needs is missing"
        }
        Loss::TimedOut { .. } if call == Activity::Call(Call::fmi2DoStep) => {
            "if the step is slow but not an endless loop, allow more time (--step-timeout)"
        }
        Loss::TimedOut { .. } => {
            "if the call is slow but not an endless loop, allow more time (isolation.call_timeout in the \
             scenario)"
        }
        Loss::GivenUp | Loss::Broken { .. } => return None,
    })
}
