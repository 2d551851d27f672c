//! The functions that a co-simulation FMU exports.

use std::ffi::c_char;
use std::fmt;
use std::sync::Arc;

use fmi2_sys as sys;
use serde::{Deserialize, Serialize};

use crate::loaded::Loaded;

macro_rules! functions {
    ($(#[$doc:meta])* $visibility:vis struct $name:ident { $($field:ident: $symbol:ident as $type:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone)]
        $visibility struct $name {
            $(
                #[doc = concat!("`", stringify!($symbol), "`")]
                pub $field: sys::$type,
            )*
            pub(crate) report: Option<ReportFunction>,
            /// keeps the functions in memory
            pub(crate) loaded: Arc<Loaded>,
        }

        impl $name {
            pub(crate) fn find(loaded: Loaded) -> Self {
                let library = loaded.library();
                Self {
                    $($field: {
                        // SAFETY: a function of this name has this type by the FMI 2.0 standard,
                        // which its description claims to follow; null stays `None`
                        unsafe { library.get::<sys::$type>(concat!(stringify!($symbol), "\0").as_bytes()) }
                            .map_or(None, |symbol| *symbol)
                    },)*
                    // SAFETY: only FMUs made with fmi2-export export this name, with this type
                    report: unsafe { library.get::<ReportFunction>(b"fmi2_export_report\0") }
                        .ok()
                        .map(|symbol| *symbol),
                    loaded: Arc::new(loaded),
                }
            }

            /// Name of each function of the standard, and whether the binary exports it.
            pub fn found(&self) -> Vec<(&'static str, bool)> {
                vec![$((stringify!($symbol), self.$field.is_some())),*]
            }
        }

        /// Names of all functions that a co-simulation FMU exports.
        pub const SYMBOLS: &[&str] = &[$(stringify!($symbol)),*];

        /// A function of the C interface. Its number is its position in [`SYMBOLS`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        #[expect(non_camel_case_types, reason = "the standard's names")]
        #[repr(u8)]
        pub enum Call {
            $(#[doc = concat!("`", stringify!($symbol), "`")] $symbol,)*
        }

        impl Call {
            const ALL: &[Self] = &[$(Self::$symbol),*];
        }
    };
}

functions! {
    /// The functions of a loaded binary; `None` where it lacks one.
    pub struct Functions {
        get_types_platform: fmi2GetTypesPlatform as fmi2GetTypesPlatformTYPE,
        get_version: fmi2GetVersion as fmi2GetVersionTYPE,
        set_debug_logging: fmi2SetDebugLogging as fmi2SetDebugLoggingTYPE,
        instantiate: fmi2Instantiate as fmi2InstantiateTYPE,
        free_instance: fmi2FreeInstance as fmi2FreeInstanceTYPE,
        setup_experiment: fmi2SetupExperiment as fmi2SetupExperimentTYPE,
        enter_initialization_mode: fmi2EnterInitializationMode as fmi2EnterInitializationModeTYPE,
        exit_initialization_mode: fmi2ExitInitializationMode as fmi2ExitInitializationModeTYPE,
        terminate: fmi2Terminate as fmi2TerminateTYPE,
        reset: fmi2Reset as fmi2ResetTYPE,
        get_real: fmi2GetReal as fmi2GetRealTYPE,
        get_integer: fmi2GetInteger as fmi2GetIntegerTYPE,
        get_boolean: fmi2GetBoolean as fmi2GetBooleanTYPE,
        get_string: fmi2GetString as fmi2GetStringTYPE,
        set_real: fmi2SetReal as fmi2SetRealTYPE,
        set_integer: fmi2SetInteger as fmi2SetIntegerTYPE,
        set_boolean: fmi2SetBoolean as fmi2SetBooleanTYPE,
        set_string: fmi2SetString as fmi2SetStringTYPE,
        get_fmu_state: fmi2GetFMUstate as fmi2GetFMUstateTYPE,
        set_fmu_state: fmi2SetFMUstate as fmi2SetFMUstateTYPE,
        free_fmu_state: fmi2FreeFMUstate as fmi2FreeFMUstateTYPE,
        serialized_fmu_state_size: fmi2SerializedFMUstateSize as fmi2SerializedFMUstateSizeTYPE,
        serialize_fmu_state: fmi2SerializeFMUstate as fmi2SerializeFMUstateTYPE,
        deserialize_fmu_state: fmi2DeSerializeFMUstate as fmi2DeSerializeFMUstateTYPE,
        get_directional_derivative: fmi2GetDirectionalDerivative as fmi2GetDirectionalDerivativeTYPE,
        set_real_input_derivatives: fmi2SetRealInputDerivatives as fmi2SetRealInputDerivativesTYPE,
        get_real_output_derivatives: fmi2GetRealOutputDerivatives as fmi2GetRealOutputDerivativesTYPE,
        do_step: fmi2DoStep as fmi2DoStepTYPE,
        cancel_step: fmi2CancelStep as fmi2CancelStepTYPE,
        get_status: fmi2GetStatus as fmi2GetStatusTYPE,
        get_real_status: fmi2GetRealStatus as fmi2GetRealStatusTYPE,
        get_integer_status: fmi2GetIntegerStatus as fmi2GetIntegerStatusTYPE,
        get_boolean_status: fmi2GetBooleanStatus as fmi2GetBooleanStatusTYPE,
        get_string_status: fmi2GetStringStatus as fmi2GetStringStatusTYPE,
    }
}

impl Call {
    /// Name of the C function.
    #[must_use]
    pub const fn name(self) -> &'static str {
        SYMBOLS[self as usize]
    }

    /// The function at a position in [`SYMBOLS`].
    pub(crate) fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// `fmi2_export_report`, an extension of the standard: writes the answer to a request into a buffer and
/// returns the length of the answer, 0 if there is none.
pub(crate) type ReportFunction =
    unsafe extern "C" fn(sys::fmi2Component, sys::fmi2String, *mut c_char, usize) -> usize;

/// Functions without which no instance can be stepped. Others are reported when a call needs them.
pub(crate) fn indispensable(functions: &Functions) -> [(bool, Call); 8] {
    [
        (functions.get_version.is_some(), Call::fmi2GetVersion),
        (functions.instantiate.is_some(), Call::fmi2Instantiate),
        (functions.free_instance.is_some(), Call::fmi2FreeInstance),
        (functions.setup_experiment.is_some(), Call::fmi2SetupExperiment),
        (functions.enter_initialization_mode.is_some(), Call::fmi2EnterInitializationMode),
        (functions.exit_initialization_mode.is_some(), Call::fmi2ExitInitializationMode),
        (functions.terminate.is_some(), Call::fmi2Terminate),
        (functions.do_step.is_some(), Call::fmi2DoStep),
    ]
}
