//! Why a system cannot be packed.

use std::io;
use std::path::PathBuf;

use fmi2_derive::DeriveError;
use fmi2_import::archive::ArchiveError;
use in_memory::accuracy::AccuracyError;
use master::system::SystemError;
use thiserror::Error;

/// Why a system cannot be packed into one unit.
#[derive(Debug, Error)]
pub enum BundleError {
    /// The scenario, or a unit in it.
    #[error(transparent)]
    Master(#[from] master::Error),
    /// A pattern of `--expose`.
    #[error(transparent)]
    Pattern(SystemError),
    /// A pattern that matches no variable that can be exposed.
    #[error("--expose {pattern}: {port} {why}")]
    NotExposable {
        /// The pattern as given.
        pattern: String,
        /// The variable.
        port: String,
        /// Why it cannot be exposed.
        why: &'static str,
    },
    /// Variables that differ too much to share a name.
    #[error("--expose {pattern}: {first} and {other} cannot share the name {name}: {what} differ")]
    Unlike {
        /// The pattern as given.
        pattern: String,
        /// The name.
        name: String,
        /// One variable.
        first: String,
        /// Another one.
        other: String,
        /// What differs.
        what: &'static str,
    },
    /// A name that is used twice, or is no name.
    #[error("--expose {pattern}: the name {name} {why}")]
    Name {
        /// The pattern as given.
        pattern: String,
        /// The name.
        name: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// Nothing is exposed.
    #[error("the unit would have no variable")]
    Empty,
    /// The library of bundles is missing.
    #[error("cannot find the library of bundles; looked for {}", list(.looked))]
    NoLibrary {
        /// The places.
        looked: Vec<PathBuf>,
    },
    /// A library for a platform is missing.
    #[error(
        "the units and the library of bundles ({library}) have no platform in common that this system can run"
    )]
    Platform {
        /// The file with the libraries.
        library: PathBuf,
    },
    /// A unit with other resources cannot be made.
    #[error(transparent)]
    Derive(#[from] DeriveError),
    /// A unit's archive cannot be read.
    #[error("cannot read {unit}")]
    Unit {
        /// Path of the .fmu file.
        unit: PathBuf,
        /// What is wrong with it.
        #[source]
        source: ArchiveError,
    },
    /// The archive cannot be made or written.
    #[error("cannot pack the unit")]
    Pack(#[from] fmi2_package::Error),
    /// A file cannot be read or written.
    #[error("cannot access {path}")]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// No step could be chosen for the accuracy that the scenario asks for.
    #[error(transparent)]
    Accuracy(#[from] AccuracyError),
    /// The scenario or the table cannot be written as JSON.
    #[error("cannot write the scenario: {0}")]
    Json(String),
}

fn list(places: &[PathBuf]) -> String {
    places.iter().map(|it| it.display().to_string()).collect::<Vec<_>>().join(", ")
}

impl BundleError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Master(error) => return error.help(),
            Self::Pattern(error) => return error.help(),
            Self::Accuracy(error) => return error.help(),
            Self::Derive(error) => return error.help(),
            Self::NoLibrary { .. } => "run `cargo xtask package`, or give --library FILE",
            Self::Platform { .. } => {
                "pack units and library for this system: `cargo xtask package` builds both"
            }
            Self::NotExposable { .. } => {
                "inputs without a connection, parameters and computed variables can be exposed"
            }
            Self::Unlike { .. } => "give them different names, one --expose for each",
            Self::Name { .. } => {
                "a name is a letter or _ followed by letters, digits and _, at most 55 characters, and unique"
            }
            Self::Empty => "record signals in the scenario, or name variables with --expose",
            _ => return None,
        })
    }
}
