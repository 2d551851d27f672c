//! A unit's binary: loaded with its full path, its functions looked up once.
//!
//! Libraries stay loaded until the process ends, since unloading crashes some of them.

use std::ffi::{CStr, c_char};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use fmi2_sys as sys;
use libloading::Library;
use object::Object as _;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::package::{PLATFORM, Package};
use crate::witness;

/// Why a binary cannot be used.
#[derive(Debug, Error)]
pub enum LibraryError {
    /// The archive has no binary for this system.
    #[error("unit {unit} has no binary for {PLATFORM}: {file} is missing; {offer}")]
    Missing {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// Name of the file that should be there.
        file: String,
        /// What the archive has instead.
        offer: String,
    },
    /// The system's loader refuses it.
    #[error("unit {unit}: the binary ({binary}) cannot be loaded")]
    Load {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// What kind of file the binary is.
        binary: String,
        /// What the loader says.
        #[source]
        source: libloading::Error,
    },
    /// The folder that it was unpacked to does not allow to run anything.
    #[error(
        "unit {unit}: the binary cannot be loaded from {folder}, because this folder for temporary \
         files is mounted noexec: set TMPDIR to a folder that allows execution"
    )]
    NoExecution {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// Where it was unpacked to.
        folder: PathBuf,
        /// What the loader says.
        #[source]
        source: libloading::Error,
    },
    /// A function is missing.
    #[error("unit {unit}: the binary ({binary}) lacks the function {symbol}")]
    Symbol {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// What kind of file the binary is.
        binary: String,
        /// The C function that the binary does not export.
        symbol: &'static str,
    },
    /// It is made for another version or platform.
    #[error("unit {unit}: {function} says \"{answer}\", expected was \"{expected}\"")]
    Version {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// The function asked.
        function: &'static str,
        /// What it answered.
        answer: String,
        /// The answer that FMI 2.0 requires.
        expected: &'static str,
    },
    /// Copy for another instance failed.
    #[error("unit {unit}: its binary cannot be copied for another instance")]
    Copy {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
}

impl LibraryError {
    /// How to fix it.
    #[must_use]
    pub fn help(&self) -> &'static str {
        match self {
            Self::Missing { .. } => {
                "export or build the unit for this system; its binary is named after the modelIdentifier"
            }
            Self::Load { .. } => {
                "a binary for another processor, or one that needs a newer C library or other \
             libraries, does not load; build it on this system"
            }
            Self::NoExecution { .. } => {
                "set TMPDIR to a folder that allows execution, such as TMPDIR=$HOME/tmp"
            }
            Self::Symbol { .. } => "export it for co-simulation, with all functions visible",
            Self::Version { .. } => "export it for FMI 2.0",
            Self::Copy { .. } => "free space in the folder for temporary files (TMPDIR)",
        }
    }
}

macro_rules! functions {
    ($(#[$doc:meta])* $visibility:vis struct $name:ident { $($field:ident: $symbol:ident as $type:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        $visibility struct $name {
            $(
                #[doc = concat!("`", stringify!($symbol), "`")]
                pub $field: sys::$type,
            )*
            pub(crate) report: Option<Report>,
        }

        impl $name {
            fn find(library: &Library) -> Self {
                Self {
                    $($field: {
                        // SAFETY: a function of this name has this type by the FMI 2.0 standard,
                        // which the description has promised to follow; null stays `None`
                        unsafe { library.get::<sys::$type>(concat!(stringify!($symbol), "\0").as_bytes()) }
                            .map_or(None, |symbol| *symbol)
                    },)*
                    // SAFETY: only units of this kit export this name, with this type
                    report: unsafe { library.get::<Report>(b"fmi2_export_report\0") }
                        .ok()
                        .map(|symbol| *symbol),
                }
            }

            /// Whether each function of the standard is there.
            pub fn found(&self) -> Vec<(&'static str, bool)> {
                vec![$((stringify!($symbol), self.$field.is_some())),*]
            }
        }

        /// Names of all functions that a co-simulation unit exports.
        pub const SYMBOLS: &[&str] = &[$(stringify!($symbol)),*];

        /// A function of the interface, by its position in [`SYMBOLS`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        #[expect(non_camel_case_types, clippy::enum_variant_names, reason = "the standard's names")]
        #[allow(dead_code, reason = "the whole interface is named; not all of it is called")]
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
    /// The functions of a loaded unit; `None` where the binary lacks one.
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
    /// Its name in the standard.
    pub(crate) const fn name(self) -> &'static str {
        SYMBOLS[self as usize]
    }

    /// The function at a position in [`SYMBOLS`].
    pub(crate) fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }
}

/// `fmi2_export_report`, which is not of the standard: writes the answer to a request into a buffer
/// and returns its length, 0 for none.
pub(crate) type Report =
    unsafe extern "C" fn(sys::fmi2Component, sys::fmi2String, *mut c_char, usize) -> usize;

/// Functions without which no instance can be stepped; the others are missed when needed.
fn indispensable(functions: &Functions) -> [(bool, &'static str); 8] {
    [
        (functions.get_version.is_some(), "fmi2GetVersion"),
        (functions.instantiate.is_some(), "fmi2Instantiate"),
        (functions.free_instance.is_some(), "fmi2FreeInstance"),
        (functions.setup_experiment.is_some(), "fmi2SetupExperiment"),
        (functions.enter_initialization_mode.is_some(), "fmi2EnterInitializationMode"),
        (functions.exit_initialization_mode.is_some(), "fmi2ExitInitializationMode"),
        (functions.terminate.is_some(), "fmi2Terminate"),
        (functions.do_step.is_some(), "fmi2DoStep"),
    ]
}

impl Functions {
    /// Loads the unit's binary and finds its functions.
    ///
    /// # Errors
    /// No binary for this system, the loader refuses it, indispensable functions are missing, or
    /// it follows another version of the standard.
    pub fn load(package: &Package) -> Result<Self, LibraryError> {
        Self::check_presence(package)?;
        Self::open_here(package.path(), &package.binary())
    }

    /// Looks whether there is a binary to load.
    pub(crate) fn check_presence(package: &Package) -> Result<(), LibraryError> {
        let binary = package.binary();
        if !binary.is_file() {
            return Err(LibraryError::Missing {
                unit: package.path().to_owned(),
                file: format!(
                    "binaries/{PLATFORM}/{}",
                    binary.file_name().unwrap_or_default().to_string_lossy()
                ),
                offer: package.offer(),
            });
        }
        Ok(())
    }

    /// Loads a copy of the unit's binary, for units that allow one instance per process and
    /// loaded library.
    ///
    /// # Errors
    /// As [`Functions::load`], and the copy may fail.
    pub fn load_copy(package: &Package) -> Result<Self, LibraryError> {
        static COPIES: AtomicU32 = AtomicU32::new(1);
        let binary = package.binary();
        let number = COPIES.fetch_add(1, Ordering::Relaxed);
        let stem = binary.file_stem().unwrap_or_default().to_string_lossy();
        let end = binary.extension().unwrap_or_default().to_string_lossy();
        let copy = binary.with_file_name(format!("{stem}-copy{number}.{end}"));
        std::fs::copy(&binary, &copy)
            .map_err(|source| LibraryError::Copy { unit: package.path().to_owned(), source })?;
        Self::open_here(package.path(), &copy)
    }

    /// Loads a binary into the master's own process, which it must not end.
    fn open_here(unit: &Path, binary: &Path) -> Result<Self, LibraryError> {
        witness::while_loading(&unit.to_string_lossy(), || Self::open(unit, binary))
    }

    /// Loads a binary; `unit` is for messages.
    pub(crate) fn open(unit: &Path, binary: &Path) -> Result<Self, LibraryError> {
        let unit = || unit.to_owned();
        // SAFETY: loading runs the library's initialisers; running the unit's code is what the
        // user asked for
        let library = unsafe { open_library(binary) }.map_err(|source| {
            let folder = binary.parent().unwrap_or(Path::new(""));
            let complaint = complaint(&source);
            if forbids_execution(&complaint, is_noexec(folder)) {
                let folder = std::env::temp_dir();
                return LibraryError::NoExecution { unit: unit(), folder, source };
            }
            LibraryError::Load { unit: unit(), binary: binary_kind(binary), source }
        })?;
        let functions = Self::find(&library);
        // never unloaded: units may have started threads or registered exit handlers
        std::mem::forget(library);
        for (found, symbol) in indispensable(&functions) {
            if !found {
                let binary = binary_kind(binary);
                return Err(LibraryError::Symbol { unit: unit(), binary, symbol });
            }
        }
        let answers = [
            (functions.get_version, "fmi2GetVersion", "2.0"),
            (functions.get_types_platform, "fmi2GetTypesPlatform", "default"),
        ];
        for (function, name, expected) in answers {
            let Some(function) = function else { continue };
            // SAFETY: both functions take nothing and return a static C string
            let pointer = unsafe { function() };
            let answer = if pointer.is_null() {
                String::new()
            } else {
                // SAFETY: not null; the standard says that it is a C string
                unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
            };
            if answer != expected {
                return Err(LibraryError::Version {
                    unit: unit(),
                    function: name,
                    answer,
                    expected,
                });
            }
        }
        Ok(functions)
    }
}

/// Opens a library so that it finds all its symbols now and shows none to others.
///
/// # Safety
/// Runs the library's initialisers.
#[cfg(unix)]
unsafe fn open_library(path: &Path) -> Result<Library, libloading::Error> {
    use libloading::os::unix::{Library as Unix, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: the caller's
    unsafe { Unix::open(Some(path), RTLD_NOW | RTLD_LOCAL) }.map(Into::into)
}

/// Opens a library.
///
/// # Safety
/// Runs the library's initialisers.
#[cfg(not(unix))]
unsafe fn open_library(path: &Path) -> Result<Library, libloading::Error> {
    // SAFETY: the caller's
    unsafe { Library::new(path) }
}

/// All that the loader says.
fn complaint(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// Whether the loader's complaint comes from a folder that allows no execution. `noexec`: whether it is
/// mounted so, where that is known.
fn forbids_execution(complaint: &str, noexec: Option<bool>) -> bool {
    let mapping = complaint.contains("failed to map segment from shared object");
    match noexec {
        Some(noexec) => mapping && noexec,
        // the same complaint comes where memory runs out
        None => mapping && complaint.contains("Operation not permitted"),
    }
}

/// Whether a folder is on a file system that is mounted without execution.
#[cfg(target_os = "linux")]
fn is_noexec(folder: &Path) -> Option<bool> {
    let flags = rustix::fs::statvfs(folder).ok()?.f_flag;
    Some(flags.contains(rustix::fs::StatVfsMountFlags::NOEXEC))
}

/// Whether a folder is on a file system that is mounted without execution: not known on this system.
#[cfg(not(target_os = "linux"))]
fn is_noexec(_: &Path) -> Option<bool> {
    None
}

/// Format and processor of a binary, for messages.
#[must_use]
pub fn binary_kind(path: &Path) -> String {
    let Ok(bytes) = std::fs::read(path) else { return "unreadable".to_owned() };
    match object::File::parse(&*bytes) {
        Ok(file) => format!("{:?}, {:?}", file.format(), file.architecture()),
        Err(_) => "no binary of a known format".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_a_folder_without_execution_is_told_from_other_troubles() {
        let mapping = "/tmp/x/unit.so: failed to map segment from shared object";
        let permission = "/tmp/x/unit.so: failed to map segment from shared object: Operation not \
                          permitted";
        let symbol = "/tmp/x/unit.so: undefined symbol: f";
        for (complaint, noexec, expected) in [
            (mapping, Some(true), true),
            (mapping, Some(false), false),
            (mapping, None, false),
            (permission, Some(true), true),
            (permission, None, true),
            (symbol, Some(true), false),
            (symbol, None, false),
        ] {
            assert_eq!(forbids_execution(complaint, noexec), expected, "{complaint} {noexec:?}");
        }
    }
}
