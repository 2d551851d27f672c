//! Loading an FMU's binary.
//!
//! Libraries are loaded by their full path. Except on Windows they stay loaded until the process ends, since some
//! crash when they are unloaded.

use std::ffi::CStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use libloading::Library;
use object::Object as _;
use thiserror::Error;

use crate::fault::causes;
use crate::functions::{Call, indispensable};
pub use crate::functions::{Functions, SYMBOLS};
use crate::loaded::Loaded;
use crate::package::{PLATFORM, Package};
use crate::scratch::Scratch;
use crate::witness;

/// Why a binary cannot be used.
#[derive(Debug, Error)]
pub enum LibraryError {
    /// The archive contains no binary for this system.
    #[error("unit {unit} has no binary for {PLATFORM}: {file} is missing; {offer}")]
    Missing {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// Name of the file that should be there.
        file: String,
        /// What the archive contains instead.
        offer: String,
    },
    /// The system cannot load it.
    #[error("unit {unit}: the binary ({binary}) cannot be loaded")]
    Load {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// Format and processor of the binary.
        binary: String,
        /// What the system reported.
        #[source]
        source: libloading::Error,
    },
    /// Files in the folder for temporary files cannot be executed.
    #[error(
        "unit {unit}: the binary cannot be loaded from {folder}, because this folder for temporary \
         files is mounted noexec: set TMPDIR to a folder that allows execution"
    )]
    NoExecution {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// The folder for temporary files.
        folder: PathBuf,
        /// What the system reported.
        #[source]
        source: libloading::Error,
    },
    /// A function is missing.
    #[error("unit {unit}: the binary ({binary}) does not export {symbol}")]
    Symbol {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// Format and processor of the binary.
        binary: String,
        /// The C function.
        symbol: Call,
    },
    /// It is made for another version or platform.
    #[error("unit {unit}: {function} returned \"{answer}\" instead of \"{expected}\"")]
    Version {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// The C function.
        function: Call,
        /// What it returned.
        answer: String,
        /// What FMI 2.0 requires.
        expected: &'static str,
    },
    /// The binary cannot be copied for another instance.
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
                "export or build the unit for this system; its binary must be named after the modelIdentifier"
            }
            Self::Load { .. } => {
                "the binary is for another processor, or needs a newer C library or libraries that are \
                 missing; build it on this system"
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

impl Functions {
    /// Loads the binary and looks up its functions.
    ///
    /// # Errors
    /// There is no binary for this system, it cannot be loaded, indispensable functions are missing, or
    /// it follows another version of the standard.
    pub fn load(package: &Package) -> Result<Self, LibraryError> {
        Self::check_presence(package)?;
        Self::open_here(package, &package.binary())
    }

    /// Checks that there is a binary to load.
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

    /// Loads a copy of the binary, for FMUs that allow only one instance in a process.
    ///
    /// # Errors
    /// As [`Functions::load`], or the binary cannot be copied.
    pub fn load_copy(package: &Package) -> Result<Self, LibraryError> {
        static COPIES: AtomicU32 = AtomicU32::new(1);
        let binary = package.binary();
        let number = COPIES.fetch_add(1, Ordering::Relaxed);
        let stem = binary.file_stem().unwrap_or_default().to_string_lossy();
        let end = binary.extension().unwrap_or_default().to_string_lossy();
        let copy = binary.with_file_name(format!("{stem}-copy{number}.{end}"));
        std::fs::copy(&binary, &copy)
            .map_err(|source| LibraryError::Copy { unit: package.path().to_owned(), source })?;
        Self::open_here(package, &copy)
    }

    /// Loads a binary into the process of the master, which it must not end.
    fn open_here(package: &Package, binary: &Path) -> Result<Self, LibraryError> {
        let (unit, folder) = (package.path(), package.scratch());
        witness::while_loading(&unit.to_string_lossy(), || Self::open(unit, binary, folder))
    }

    /// Loads a binary from a temporary folder, if it is in one. `unit` is for messages.
    pub(crate) fn open(
        unit: &Path,
        binary: &Path,
        folder: Option<Arc<Scratch>>,
    ) -> Result<Self, LibraryError> {
        let unit = || unit.to_owned();
        // SAFETY: loading runs the initialisers of the library; the user wants to run its code
        let library = unsafe { open_library(binary) }.map_err(|source| {
            let folder = binary.parent().unwrap_or(Path::new(""));
            let messages = causes(&source).join(": ");
            if forbids_execution(&messages, is_noexec(folder)) {
                let folder = std::env::temp_dir();
                return LibraryError::NoExecution { unit: unit(), folder, source };
            }
            LibraryError::Load { unit: unit(), binary: binary_kind(binary), source }
        })?;
        let functions = Self::find(Loaded::new(library, folder));
        for (found, symbol) in indispensable(&functions) {
            if !found {
                let binary = binary_kind(binary);
                return Err(LibraryError::Symbol { unit: unit(), binary, symbol });
            }
        }
        let answers = [
            (functions.get_version, Call::fmi2GetVersion, "2.0"),
            (functions.get_types_platform, Call::fmi2GetTypesPlatform, "default"),
        ];
        for (function, call, expected) in answers {
            let Some(function) = function else { continue };
            // SAFETY: both functions take nothing and return a static C string
            let pointer = unsafe { function() };
            let answer = if pointer.is_null() {
                String::new()
            } else {
                // SAFETY: not null; by the standard it is a C string
                unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
            };
            if answer != expected {
                return Err(LibraryError::Version {
                    unit: unit(),
                    function: call,
                    answer,
                    expected,
                });
            }
        }
        Ok(functions)
    }
}

/// Opens a library: resolves all its symbols now, and hides them from other libraries.
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

/// Whether loading failed because files in the folder cannot be executed. `noexec`: whether its file
/// system is mounted so, if that is known.
fn forbids_execution(messages: &str, noexec: Option<bool>) -> bool {
    let mapping = messages.contains("failed to map segment from shared object");
    match noexec {
        Some(noexec) => mapping && noexec,
        // the same message appears if memory runs out
        None => mapping && messages.contains("Operation not permitted"),
    }
}

/// Whether the file system of a folder is mounted noexec.
#[cfg(target_os = "linux")]
fn is_noexec(folder: &Path) -> Option<bool> {
    let flags = rustix::fs::statvfs(folder).ok()?.f_flag;
    Some(flags.contains(rustix::fs::StatVfsMountFlags::NOEXEC))
}

/// Whether the file system of a folder is mounted noexec: not known on this system.
#[cfg(not(target_os = "linux"))]
fn is_noexec(_: &Path) -> Option<bool> {
    None
}

/// Format and processor of a binary, for messages.
fn binary_kind(path: &Path) -> String {
    let Ok(bytes) = std::fs::read(path) else { return "unreadable".to_owned() };
    match object::File::parse(&*bytes) {
        Ok(file) => format!("{:?}, {:?}", file.format(), file.architecture()),
        Err(_) => "not a binary of a known format".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_a_folder_without_execution_is_distinguished_from_other_failures() {
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
