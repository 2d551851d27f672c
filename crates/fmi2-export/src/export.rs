//! The macro that defines the C functions of a unit crate.

/// Defines the 34 C functions of an FMI 2.0 co-simulation unit for one [`Model`](crate::Model),
/// `fmi2_export_describe`, which prints `modelDescription.xml`, and `fmi2_export_report`, which
/// returns the answer of [`Model::report`](crate::Model::report). Use it once per library.
///
/// Each function is checked against the C header's type when it is compiled.
#[macro_export]
macro_rules! export {
    ($model:ty) => {
        #[cfg(panic = "abort")]
        compile_error!("a unit needs panic = \"unwind\": a panic must not take the importer down");

        #[allow(
            missing_docs,
            non_snake_case,
            unsafe_code,
            clippy::missing_safety_doc,
            clippy::too_many_arguments,
            clippy::undocumented_unsafe_blocks,
            unused_unsafe
        )]
        const _: () = {
            use $crate::sys::*;
            $crate::__functions! {
                fmi2GetTypesPlatform: fmi2GetTypesPlatformTYPE = [get_types_platform]
                    () -> *const ::core::ffi::c_char;
                fmi2GetVersion: fmi2GetVersionTYPE = [get_version] () -> *const ::core::ffi::c_char;
                fmi2SetDebugLogging: fmi2SetDebugLoggingTYPE = [set_debug_logging]
                    (a: fmi2Component, b: fmi2Boolean, c: usize,
                     d: *const fmi2String) -> fmi2Status;
                fmi2Instantiate: fmi2InstantiateTYPE = [instantiate::<$model>]
                    (a: fmi2String, b: fmi2Type, c: fmi2String, d: fmi2String,
                     e: *const fmi2CallbackFunctions, f: fmi2Boolean, g: fmi2Boolean) -> fmi2Component;
                fmi2FreeInstance: fmi2FreeInstanceTYPE = [free_instance] (a: fmi2Component) -> ();
                fmi2SetupExperiment: fmi2SetupExperimentTYPE = [setup_experiment]
                    (a: fmi2Component, b: fmi2Boolean, c: fmi2Real, d: fmi2Real, e: fmi2Boolean,
                     f: fmi2Real) -> fmi2Status;
                fmi2EnterInitializationMode: fmi2EnterInitializationModeTYPE = [enter_initialization_mode]
                    (a: fmi2Component) -> fmi2Status;
                fmi2ExitInitializationMode: fmi2ExitInitializationModeTYPE = [exit_initialization_mode]
                    (a: fmi2Component) -> fmi2Status;
                fmi2Terminate: fmi2TerminateTYPE = [terminate] (a: fmi2Component) -> fmi2Status;
                fmi2Reset: fmi2ResetTYPE = [reset] (a: fmi2Component) -> fmi2Status;
                fmi2GetReal: fmi2GetRealTYPE = [get_real]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *mut fmi2Real) -> fmi2Status;
                fmi2GetInteger: fmi2GetIntegerTYPE = [get_integer]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *mut fmi2Integer) -> fmi2Status;
                fmi2GetBoolean: fmi2GetBooleanTYPE = [get_boolean]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *mut fmi2Boolean) -> fmi2Status;
                fmi2GetString: fmi2GetStringTYPE = [get_string]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *mut fmi2String) -> fmi2Status;
                fmi2SetReal: fmi2SetRealTYPE = [set_real]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *const fmi2Real) -> fmi2Status;
                fmi2SetInteger: fmi2SetIntegerTYPE = [set_integer]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *const fmi2Integer) -> fmi2Status;
                fmi2SetBoolean: fmi2SetBooleanTYPE = [set_boolean]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *const fmi2Boolean) -> fmi2Status;
                fmi2SetString: fmi2SetStringTYPE = [set_string]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *const fmi2String) -> fmi2Status;
                fmi2GetFMUstate: fmi2GetFMUstateTYPE = [get_fmu_state]
                    (a: fmi2Component, b: *mut fmi2FMUstate) -> fmi2Status;
                fmi2SetFMUstate: fmi2SetFMUstateTYPE = [set_fmu_state]
                    (a: fmi2Component, b: fmi2FMUstate) -> fmi2Status;
                fmi2FreeFMUstate: fmi2FreeFMUstateTYPE = [free_fmu_state]
                    (a: fmi2Component, b: *mut fmi2FMUstate) -> fmi2Status;
                fmi2SerializedFMUstateSize: fmi2SerializedFMUstateSizeTYPE = [serialized_fmu_state_size]
                    (a: fmi2Component, b: fmi2FMUstate, c: *mut usize) -> fmi2Status;
                fmi2SerializeFMUstate: fmi2SerializeFMUstateTYPE = [serialize_fmu_state]
                    (a: fmi2Component, b: fmi2FMUstate, c: *mut fmi2Byte, d: usize) -> fmi2Status;
                fmi2DeSerializeFMUstate: fmi2DeSerializeFMUstateTYPE = [deserialize_fmu_state]
                    (a: fmi2Component, b: *const fmi2Byte, c: usize,
                     d: *mut fmi2FMUstate) -> fmi2Status;
                fmi2GetDirectionalDerivative: fmi2GetDirectionalDerivativeTYPE = [get_directional_derivative]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *const fmi2ValueReference, e: usize, f: *const fmi2Real, g: *mut fmi2Real) -> fmi2Status;
                fmi2SetRealInputDerivatives: fmi2SetRealInputDerivativesTYPE = [set_real_input_derivatives]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *const fmi2Integer, e: *const fmi2Real) -> fmi2Status;
                fmi2GetRealOutputDerivatives: fmi2GetRealOutputDerivativesTYPE = [get_real_output_derivatives]
                    (a: fmi2Component, b: *const fmi2ValueReference, c: usize,
                     d: *const fmi2Integer, e: *mut fmi2Real) -> fmi2Status;
                fmi2DoStep: fmi2DoStepTYPE = [do_step]
                    (a: fmi2Component, b: fmi2Real, c: fmi2Real, d: fmi2Boolean) -> fmi2Status;
                fmi2CancelStep: fmi2CancelStepTYPE = [cancel_step] (a: fmi2Component) -> fmi2Status;
                fmi2GetStatus: fmi2GetStatusTYPE = [get_status]
                    (a: fmi2Component, b: fmi2StatusKind, c: *mut fmi2Status) -> fmi2Status;
                fmi2GetRealStatus: fmi2GetRealStatusTYPE = [get_real_status]
                    (a: fmi2Component, b: fmi2StatusKind, c: *mut fmi2Real) -> fmi2Status;
                fmi2GetIntegerStatus: fmi2GetIntegerStatusTYPE = [get_integer_status]
                    (a: fmi2Component, b: fmi2StatusKind, c: *mut fmi2Integer) -> fmi2Status;
                fmi2GetBooleanStatus: fmi2GetBooleanStatusTYPE = [get_boolean_status]
                    (a: fmi2Component, b: fmi2StatusKind, c: *mut fmi2Boolean) -> fmi2Status;
                fmi2GetStringStatus: fmi2GetStringStatusTYPE = [get_string_status]
                    (a: fmi2Component, b: fmi2StatusKind, c: *mut fmi2String) -> fmi2Status;
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2_export_describe(
                resource_dir: *const ::core::ffi::c_char,
                buffer: *mut ::core::ffi::c_char,
                capacity: usize,
            ) -> usize {
                unsafe { $crate::ffi::describe::<$model>(resource_dir, buffer, capacity) }
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2_export_report(
                component: fmi2Component,
                request: fmi2String,
                buffer: *mut ::core::ffi::c_char,
                capacity: usize,
            ) -> usize {
                unsafe { $crate::ffi::report(component, request, buffer, capacity) }
            }
        };
    };
}

/// Defines C functions that call [`ffi`](crate::ffi), and checks their types.
#[doc(hidden)]
#[macro_export]
macro_rules! __functions {
    ($($name:ident: $type:ident = [$($inner:tt)*] ($($arg:ident: $of:ty),*) -> $returns:ty;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arg: $of),*) -> $returns {
            unsafe { $crate::ffi::$($inner)*($($arg),*) }
        }
        const _: $type = Some($name);
    )*};
}
