//! Why a unit cannot get other resources.

use std::io;
use std::path::PathBuf;

use fmi2_import::archive::ArchiveError;
use fmi2_import::library::LibraryError;
use fmi2_import::package::PackageError;
use thiserror::Error;

/// Why a unit cannot get other resources.
#[derive(Debug, Error)]
pub enum DeriveError {
    /// The unit or its new description cannot be used.
    #[error(transparent)]
    Package(#[from] PackageError),
    /// The unit is not made with `fmi2-export`.
    #[error(
        "{unit} was exported by {}, not by fmi2-export: its library cannot print a description for other resources",
        tool.as_deref().unwrap_or("an unknown tool")
    )]
    Foreign {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// The tool that exported it, if the description names it.
        tool: Option<String>,
    },
    /// Its library cannot be loaded on this system.
    #[error("the library of the unit must print the new description, but it cannot be loaded")]
    Library(#[from] LibraryError),
    /// The library cannot be asked.
    #[error("{unit}: the library of the unit cannot print the new description")]
    Describe {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// What is wrong.
        #[source]
        source: fmi2_package::Error,
    },
    /// The unit does not accept the resources.
    #[error(
        "{unit} does not accept the resources: {message}{}",
        if added.is_empty() { String::new() } else { format!("; the patch adds {}", added.join(", ")) }
    )]
    Refused {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// The message of the unit.
        message: String,
        /// Whether a resource is the text of a patched file.
        patched: bool,
        /// Places of items that patches add.
        added: Vec<String>,
    },
    /// No name of a file in a unit.
    #[error(
        "resource \"{name}\": the name must be a path inside of the unit's resources, in plain ASCII, with forward slashes"
    )]
    Name {
        /// The name as given.
        name: String,
    },
    /// A new resource with a name that some systems confuse with that of another.
    #[error(
        "resource {name} cannot be beside the unit's {other}: {}",
        if name.eq_ignore_ascii_case(other) {
            "the names differ only in case, and are one file on some systems"
        } else {
            "one is a folder in the path of the other"
        }
    )]
    Clash {
        /// The name as given.
        name: String,
        /// The resource of the unit.
        other: String,
    },
    /// A file that should replace a resource cannot be read.
    #[error("resource {name}: cannot read {path}")]
    Read {
        /// The resource.
        name: String,
        /// The file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// A patch in a file cannot be read.
    #[error("{path} is not a patch: {message}")]
    PatchFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The new unit would replace the one that it is made of.
    #[error("{unit} cannot be replaced by a unit that is made of it")]
    Overwrites {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
    },
    /// A patch is for a resource that does not exist.
    #[error(
        "{unit} has no resource {name} that can be patched{}; its resources: {}",
        suggestion.as_ref().map(|it| format!("; did you mean {it}?")).unwrap_or_default(),
        if resources.is_empty() { "none".to_owned() } else { resources.join(", ") }
    )]
    Unknown {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// The resource as given.
        name: String,
        /// The nearest one.
        suggestion: Option<String>,
        /// All of them.
        resources: Vec<String>,
    },
    /// A resource that should be patched is not JSON.
    #[error("resource {name} cannot be patched: it is not JSON: {message}")]
    NotJson {
        /// The resource.
        name: String,
        /// What is wrong.
        message: String,
    },
    /// A patch does not fit its resource.
    #[error("patch of resource {name}: at {place}: {message}")]
    Patch {
        /// The resource.
        name: String,
        /// Path within the patch.
        place: String,
        /// What is wrong.
        message: String,
    },
    /// A new JSON file that the unit does not read.
    #[error(
        "{unit} does not read the new resource {name}{}",
        suggestion.as_ref().map(|it| format!("; did you mean {it}?")).unwrap_or_default()
    )]
    Unread {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// The resource.
        name: String,
        /// The nearest one that it has.
        suggestion: Option<String>,
    },
    /// A changed resource cannot be written into the temporary folder of the unit.
    #[error("cannot write to {path}")]
    Temporary {
        /// The file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// The archive of the unit cannot be read.
    #[error("{unit} cannot be read")]
    Archive {
        /// Path of the .fmu file, as it was given.
        unit: PathBuf,
        /// What is wrong with it.
        #[source]
        source: ArchiveError,
    },
    /// The new archive cannot be made.
    #[error("cannot pack the new unit")]
    Pack(#[source] fmi2_package::Error),
}

impl DeriveError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Package(error) => return error.help(),
            Self::Library(error) => error.help(),
            Self::Archive { source, .. } => return source.help(),
            Self::Foreign { .. } => {
                "change the resources in the tool that exported the unit, and export it again"
            }
            Self::Describe { .. } => "build the unit again with fmi2-export",
            Self::Refused { patched: true, .. } => {
                "correct the patch; lines and items count in the file after the patch"
            }
            Self::Refused { .. } => {
                "correct the resource; the unit's page in the guide describes its keys"
            }
            Self::Read { source, .. } if source.kind() == io::ErrorKind::InvalidInput => {
                "write the resource to a file, and give its path"
            }
            Self::Read { .. } => "check the path",
            Self::PatchFile { .. } => "a patch is a JSON object with the members that change",
            Self::Overwrites { .. } => "choose another file with --out",
            Self::Clash { .. } => {
                "give the name as in the unit to replace it, or choose another name"
            }
            Self::Unknown { .. } | Self::Unread { .. } | Self::Name { .. } => {
                "a resource is named as in the folder resources of the .fmu file"
            }
            Self::NotJson { .. } => "replace the whole file, instead of patching it",
            Self::Patch { .. } => "lists of named items are patched by their names",
            Self::Temporary { .. } => "free space in the folder for temporary files (TMPDIR)",
            Self::Pack(_) => return None,
        })
    }
}
