//! Why a system cannot be read or written.

use std::io;
use std::path::PathBuf;

use fmi2_derive::DeriveError;
use fmi2_import::archive::ArchiveError;
use fmi2_import::description::UnitMismatch;
use fmi2_import::package::PackageError;
use master::system::SystemError;
use thiserror::Error;

/// Why a system cannot be read or written.
#[derive(Debug, Error)]
pub enum SspError {
    /// The archive cannot be used.
    #[error("{path} cannot be opened")]
    Archive {
        /// Path of the .ssp file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        source: ArchiveError,
    },
    /// A file beside the description cannot be read.
    #[error("cannot read {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// A file that the description names does not exist.
    #[error("{place}: there is no file \"{name}\"")]
    Missing {
        /// The element that names it.
        place: String,
        /// Its name in the archive.
        name: String,
    },
    /// A URI that cannot be followed.
    #[error("{place}: source \"{uri}\": {why}")]
    Uri {
        /// The element that has it.
        place: String,
        /// The URI as written.
        uri: String,
        /// Why not, in words.
        why: &'static str,
    },
    /// A text is not XML, or not the XML that is expected.
    #[error("{file}: {message}")]
    Xml {
        /// Name of the file.
        file: String,
        /// What is wrong, with line and column.
        message: String,
    },
    /// An element breaks the standard, so that its meaning is unknown.
    #[error("{file}: {place}: {message}")]
    Invalid {
        /// Name of the file.
        file: String,
        /// The element.
        place: String,
        /// What is wrong.
        message: String,
    },
    /// Something that the standard allows and this program cannot do.
    #[error("{file}: {place}: {what}")]
    Unsupported {
        /// Name of the file.
        file: String,
        /// The element.
        place: String,
        /// What it is.
        what: String,
    },
    /// A unit of the system cannot be used.
    #[error("component \"{component}\": its unit cannot be used")]
    Unit {
        /// The component.
        component: String,
        /// Why.
        #[source]
        source: PackageError,
    },
    /// The units of measurement of a connection or a value cannot be converted.
    #[error("{place}: the units of measurement cannot be converted")]
    Conversion {
        /// The connection or the parameter.
        place: String,
        /// What differs.
        #[source]
        source: UnitMismatch,
    },
    /// The scenario does not make a system.
    #[error("cannot export the scenario")]
    System(#[from] Box<SystemError>),
    /// A unit with changed resources cannot be made.
    #[error("cannot make the unit \"{name}\" with its changed resources")]
    Derive {
        /// Key in `units`.
        name: String,
        /// Why.
        #[source]
        source: Box<DeriveError>,
    },
    /// The export cannot be put into an archive.
    #[error("cannot export {what}: {why}")]
    Export {
        /// What it is, by its place in the scenario.
        what: String,
        /// Why.
        why: String,
    },
    /// A file cannot be written.
    #[error("cannot write {path}")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
}

impl SspError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Archive { source: ArchiveError::Open(_), .. } | Self::Read { .. } => {
                "give the path of an .ssp file, or of the .ssd file of an unpacked one"
            }
            Self::Archive { source: ArchiveError::Zip(_) | ArchiveError::Entry { .. }, .. } => {
                "the file is damaged or not an SSP archive (a zip file with a SystemStructure.ssd)"
            }
            Self::Archive { .. } => "use it only if you trust its origin; report it to its maker",
            Self::Missing { .. } | Self::Xml { .. } | Self::Invalid { .. } => {
                "report it to the maker of the file; docs/ssp.md says what is read"
            }
            Self::Uri { .. } => "put the file into the archive, and refer to it by a relative URI",
            Self::Unsupported { .. } => "docs/ssp.md lists what can be imported",
            Self::Unit { source, .. } => return source.help(),
            Self::Conversion { .. } => {
                "correct the units of measurement, or set suppressUnitConversion=\"true\""
            }
            Self::System(source) => return source.help(),
            Self::Derive { source, .. } => return source.help(),
            Self::Export { .. } | Self::Write { .. } => return None,
        })
    }
}
