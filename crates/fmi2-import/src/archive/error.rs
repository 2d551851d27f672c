//! Why an archive cannot be used.

use std::io;
use std::path::PathBuf;

use thiserror::Error;
use zip::result::ZipError;

use super::MAX_ENTRIES;

/// Why an archive cannot be used.
#[derive(Debug, Error)]
pub enum ArchiveError {
    /// The file could not be opened or read.
    #[error(transparent)]
    Open(io::Error),
    /// The file is not a zip archive, or is damaged.
    #[error("this is not a readable zip archive")]
    Zip(#[source] ZipError),
    /// One entry cannot be unpacked.
    #[error("entry \"{name}\" cannot be unpacked")]
    Entry {
        /// Name of the entry as in the archive.
        name: String,
        /// What failed.
        #[source]
        source: io::Error,
    },
    /// An entry's name points outside the folder that it is unpacked to.
    #[error("entry \"{name}\" would be written outside of the archive's folder ({why})")]
    UnsafeName {
        /// Name of the entry as in the archive.
        name: String,
        /// The rule that the name breaks, in words.
        why: &'static str,
    },
    /// An entry is a symbolic link.
    #[error("entry \"{name}\" is a symbolic link, which is not accepted")]
    Link {
        /// Name of the entry as in the archive.
        name: String,
    },
    /// Two entries have the same name.
    #[error("duplicate entry \"{name}\"")]
    Duplicate {
        /// The name of both entries.
        name: String,
    },
    /// There are too many entries.
    #[error("the archive has {count} entries; at most {MAX_ENTRIES} are accepted")]
    TooMany {
        /// Number of entries.
        count: usize,
    },
    /// An entry or the archive is too large, or an entry is compressed suspiciously well.
    #[error("entry \"{name}\" unpacks to more than {limit} bytes")]
    TooLarge {
        /// Name of the entry as in the archive.
        name: String,
        /// The limit that it exceeds.
        limit: u64,
    },
    /// There is no modelDescription.xml at the top level.
    #[error(
        "the archive contains no modelDescription.xml at its top level{}",
        similar.as_ref().map(|name| format!(", but \"{name}\"")).unwrap_or_default()
    )]
    NoDescription {
        /// An entry with this name in a folder.
        similar: Option<String>,
    },
    /// modelDescription.xml is not UTF-8 text.
    #[error("modelDescription.xml is not UTF-8 text")]
    NotText,
    /// A file or folder cannot be written while unpacking.
    #[error("cannot write to {path}")]
    Write {
        /// File or folder that could not be written.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
}

impl ArchiveError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Open(error) if error.kind() == io::ErrorKind::IsADirectory => {
                "give the path of the .fmu file, not of a folder"
            }
            Self::Open(_) => "check the path, or build the unit first",
            Self::Entry { source, .. } if source.kind() == io::ErrorKind::StorageFull => {
                "free space in the folder for temporary files (TMPDIR)"
            }
            Self::Zip(_) | Self::Entry { .. } => {
                "the file is damaged or not an FMU; build or download it again"
            }
            Self::NoDescription { .. } | Self::NotText => {
                "an FMU has a modelDescription.xml at its top level; pack the folder's contents, \
                 not the folder"
            }
            Self::Write { .. } => "free space in the folder for temporary files (TMPDIR)",
            _ => "use it only if you trust its origin; report it to its maker",
        })
    }
}
