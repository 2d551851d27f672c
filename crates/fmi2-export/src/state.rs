//! The state machine: the modes in which each function is allowed.

use serde::{Deserialize, Serialize};

/// Mode of an instance (FMI 2.0.5, section 4.2.4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum InstanceMode {
    Instantiated,
    Initialization,
    /// Between steps.
    Step,
    /// The last step was discarded.
    StepFailed,
    Terminated,
    /// The model failed: values may be read; then reset, restore or free.
    Error,
    /// The model panicked. Its memory may be inconsistent, so it is not used any more; reset
    /// rebuilds it.
    Poisoned,
}

impl InstanceMode {
    pub(crate) const fn bit(self) -> u8 {
        1 << self as u8
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "before initialization",
            Self::Initialization => "in initialization mode",
            Self::Step => "between steps",
            Self::StepFailed => "after a discarded step",
            Self::Terminated => "after termination",
            Self::Error => "after an error",
            Self::Poisoned => "after a panic of the model",
        }
    }
}

/// A C function of an instance with the modes in which it is allowed.
#[derive(Debug)]
pub(crate) struct FmiCall {
    pub(crate) name: &'static str,
    allowed: u8,
}

impl FmiCall {
    const fn new(name: &'static str, allowed: u8) -> Self {
        Self { name, allowed }
    }

    #[inline]
    pub(crate) fn allows(&self, mode: InstanceMode) -> bool {
        self.allowed & mode.bit() != 0
    }

    /// The message for a call that is not allowed, with a hint.
    #[cold]
    pub(crate) fn refusal(&self, mode: InstanceMode) -> String {
        let hint = match mode {
            InstanceMode::Poisoned => "; only fmi2Reset and fmi2FreeInstance are possible",
            InstanceMode::Error | InstanceMode::StepFailed => {
                "; get values, set a saved state, reset, terminate or free"
            }
            _ => "",
        };
        format!("{} is not allowed {}{hint}", self.name, mode.name())
    }
}

const NEW: u8 = InstanceMode::Instantiated.bit();
const INIT: u8 = InstanceMode::Initialization.bit();
const STEP: u8 = InstanceMode::Step.bit();
const DISCARDED: u8 = InstanceMode::StepFailed.bit();
const ENDED: u8 = InstanceMode::Terminated.bit();
const BROKEN: u8 = InstanceMode::Error.bit();
const POISONED: u8 = InstanceMode::Poisoned.bit();
const SOUND: u8 = NEW | INIT | STEP | DISCARDED | ENDED | BROKEN;
const READABLE: u8 = INIT | STEP | DISCARDED | ENDED | BROKEN;

macro_rules! calls {
    ($($constant:ident $name:ident $allowed:expr;)*) => {
        $(pub(crate) static $constant: FmiCall = FmiCall::new(stringify!($name), $allowed);)*
        /// Every function of an instance.
        #[cfg(test)]
        pub(crate) static ALL: &[&FmiCall] = &[$(&$constant),*];
    };
}

// fmi2Terminate is also accepted early and twice, because importers do so when they clean up.
calls! {
    SET_DEBUG_LOGGING fmi2SetDebugLogging SOUND | POISONED;
    SETUP_EXPERIMENT fmi2SetupExperiment NEW;
    ENTER_INITIALIZATION fmi2EnterInitializationMode NEW;
    EXIT_INITIALIZATION fmi2ExitInitializationMode INIT;
    TERMINATE fmi2Terminate SOUND;
    RESET fmi2Reset SOUND | POISONED;
    GET_REAL fmi2GetReal READABLE;
    GET_INTEGER fmi2GetInteger READABLE;
    GET_BOOLEAN fmi2GetBoolean READABLE;
    GET_STRING fmi2GetString READABLE;
    SET_REAL fmi2SetReal NEW | INIT | STEP;
    SET_INTEGER fmi2SetInteger NEW | INIT | STEP;
    SET_BOOLEAN fmi2SetBoolean NEW | INIT | STEP;
    SET_STRING fmi2SetString NEW | INIT | STEP;
    GET_STATE fmi2GetFMUstate SOUND;
    SET_STATE fmi2SetFMUstate SOUND;
    FREE_STATE fmi2FreeFMUstate SOUND | POISONED;
    STATE_SIZE fmi2SerializedFMUstateSize SOUND;
    SERIALIZE fmi2SerializeFMUstate SOUND;
    DESERIALIZE fmi2DeSerializeFMUstate SOUND;
    DIRECTIONAL fmi2GetDirectionalDerivative INIT | STEP | DISCARDED | ENDED | BROKEN;
    SET_INPUT_DERIVATIVES fmi2SetRealInputDerivatives NEW | INIT | STEP;
    GET_OUTPUT_DERIVATIVES fmi2GetRealOutputDerivatives STEP | DISCARDED | ENDED | BROKEN;
    DO_STEP fmi2DoStep STEP;
    CANCEL_STEP fmi2CancelStep 0;
    GET_STATUS fmi2GetStatus STEP | DISCARDED | ENDED | BROKEN;
    GET_REAL_STATUS fmi2GetRealStatus STEP | DISCARDED | ENDED | BROKEN;
    GET_INTEGER_STATUS fmi2GetIntegerStatus STEP | DISCARDED | ENDED | BROKEN;
    GET_BOOLEAN_STATUS fmi2GetBooleanStatus STEP | DISCARDED | ENDED | BROKEN;
    GET_STRING_STATUS fmi2GetStringStatus STEP | DISCARDED | ENDED | BROKEN;
    REPORT fmi2_export_report READABLE;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The standard's table for co-simulation, by function and mode: instantiated,
    /// initialization, step complete, step failed, terminated, error. Where this kit is more
    /// lenient on purpose the entry says `+`.
    #[test]
    fn golden_allowed_calls_follow_the_standard() {
        let table = [
            ("fmi2SetDebugLogging", "xxxxxx"),
            ("fmi2SetupExperiment", "x....."),
            ("fmi2EnterInitializationMode", "x....."),
            ("fmi2ExitInitializationMode", ".x...."),
            ("fmi2Terminate", "++xx++"),
            ("fmi2Reset", "xxxxxx"),
            ("fmi2GetReal", ".xxxxx"),
            ("fmi2GetInteger", ".xxxxx"),
            ("fmi2GetBoolean", ".xxxxx"),
            ("fmi2GetString", ".xxxxx"),
            ("fmi2SetReal", "xxx..."),
            ("fmi2SetInteger", "xxx..."),
            ("fmi2SetBoolean", "xxx..."),
            ("fmi2SetString", "xxx..."),
            ("fmi2GetFMUstate", "xxxxxx"),
            ("fmi2SetFMUstate", "xxxxxx"),
            ("fmi2FreeFMUstate", "xxxxxx"),
            ("fmi2SerializedFMUstateSize", "xxxxxx"),
            ("fmi2SerializeFMUstate", "xxxxxx"),
            ("fmi2DeSerializeFMUstate", "xxxxxx"),
            ("fmi2GetDirectionalDerivative", ".xxxxx"),
            ("fmi2SetRealInputDerivatives", "xxx..."),
            ("fmi2GetRealOutputDerivatives", "..xxxx"),
            ("fmi2DoStep", "..x..."),
            ("fmi2CancelStep", "......"),
            ("fmi2GetStatus", "..xxx+"),
            ("fmi2GetRealStatus", "..xxx+"),
            ("fmi2GetIntegerStatus", "..xxx+"),
            ("fmi2GetBooleanStatus", "..xxx+"),
            ("fmi2GetStringStatus", "..xxx+"),
            // not of the standard: as the getters
            ("fmi2_export_report", ".xxxxx"),
        ];
        assert_eq!(ALL.len(), table.len());
        let modes = [
            InstanceMode::Instantiated,
            InstanceMode::Initialization,
            InstanceMode::Step,
            InstanceMode::StepFailed,
            InstanceMode::Terminated,
            InstanceMode::Error,
        ];
        for (call, (name, allowed)) in ALL.iter().zip(table) {
            assert_eq!(call.name, name);
            for (mode, mark) in modes.into_iter().zip(allowed.chars()) {
                assert_eq!(call.allows(mode), mark != '.', "{name} {}", mode.name());
            }
        }
    }
}
