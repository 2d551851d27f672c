//! The C interface of FMI 2.0 (Functional Mock-up Interface), as types and constants.
//!
//! `src/bindings.rs` is bindgen's output for the standard's headers, committed so that building
//! needs no libclang. `cargo xtask codegen` generates it anew, `cargo xtask codegen --check`
//! compares. The crate holds no function: an importer looks the functions up in a loaded library,
//! an exporter defines them, and both check them against the same types here, such as
//! [`fmi2DoStepTYPE`] (an `Option` of a function pointer, as C knows null).
//!
//! Status and kinds are newtypes over integers. C may hand over any integer where a header says
//! `enum`, which would be undefined behaviour with a Rust enum; so `match` needs a `_` arm.
#![no_std]

#[expect(
    missing_docs,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    reason = "generated from C; the FMI standard documents the items"
)]
mod bindings;

pub use bindings::*;

/// Names of all functions that the library of an FMU for co-simulation exports.
pub const CO_SIMULATION_FUNCTIONS: [&str; 34] = [
    "fmi2GetTypesPlatform",
    "fmi2GetVersion",
    "fmi2SetDebugLogging",
    "fmi2Instantiate",
    "fmi2FreeInstance",
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2Terminate",
    "fmi2Reset",
    "fmi2GetReal",
    "fmi2GetInteger",
    "fmi2GetBoolean",
    "fmi2GetString",
    "fmi2SetReal",
    "fmi2SetInteger",
    "fmi2SetBoolean",
    "fmi2SetString",
    "fmi2GetFMUstate",
    "fmi2SetFMUstate",
    "fmi2FreeFMUstate",
    "fmi2SerializedFMUstateSize",
    "fmi2SerializeFMUstate",
    "fmi2DeSerializeFMUstate",
    "fmi2GetDirectionalDerivative",
    "fmi2SetRealInputDerivatives",
    "fmi2GetRealOutputDerivatives",
    "fmi2DoStep",
    "fmi2CancelStep",
    "fmi2GetStatus",
    "fmi2GetRealStatus",
    "fmi2GetIntegerStatus",
    "fmi2GetBooleanStatus",
    "fmi2GetStringStatus",
];

impl fmi2Status {
    /// The status's name in the standard, for messages: `fmi2OK` … `fmi2Pending`, or
    /// `an unknown status`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::fmi2OK => "fmi2OK",
            Self::fmi2Warning => "fmi2Warning",
            Self::fmi2Discard => "fmi2Discard",
            Self::fmi2Error => "fmi2Error",
            Self::fmi2Fatal => "fmi2Fatal",
            Self::fmi2Pending => "fmi2Pending",
            _ => "an unknown status",
        }
    }
}

impl core::fmt::Display for fmi2Status {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.name() {
            "an unknown status" => write!(f, "unknown status {}", self.0),
            name => f.write_str(name),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString as _;

    #[test]
    fn issue_status_outside_the_enumeration_is_representable() {
        assert_eq!(fmi2Status::fmi2Discard.to_string(), "fmi2Discard");
        assert_eq!(fmi2Status(77).to_string(), "unknown status 77");
    }

    /// The standard fixes these numbers; a header of another version would differ.
    #[test]
    fn golden_constants_of_the_standard() {
        assert_eq!(fmi2Version.to_str(), Ok("2.0"));
        assert_eq!(fmi2TypesPlatform.to_str(), Ok("default"));
        assert_eq!((fmi2True, fmi2False), (1, 0));
        assert_eq!(fmi2Type::fmi2CoSimulation.0, 1);
        assert_eq!(fmi2Status::fmi2Pending.0, 5);
        assert_eq!(fmi2StatusKind::fmi2Terminated.0, 3);
    }
}
