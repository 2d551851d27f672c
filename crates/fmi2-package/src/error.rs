//! Errors of packing.

use std::path::PathBuf;

/// An error of packing a unit.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The library cannot be loaded.
    #[error("{}: the library cannot be loaded", path.display())]
    Load {
        /// Path of the library.
        path: PathBuf,
        /// Error of the loader.
        source: libloading::Error,
    },
    /// The library is not made with `fmi2-export`.
    #[error(
        "{}: the library has no fmi2_export_describe; is it a cdylib with fmi2_export::export!(Model)?",
        path.display()
    )]
    NotAUnit {
        /// Path of the library.
        path: PathBuf,
    },
    /// The unit's resources or declarations are invalid.
    #[error("{}: {message}", path.display())]
    Refused {
        /// Path of the library.
        path: PathBuf,
        /// The unit's error message.
        message: String,
    },
    /// The description is not that of a co-simulation unit.
    #[error("modelDescription.xml: {0}")]
    Description(String),
    /// A name that archives or the C interface cannot represent.
    #[error("{}: the name must be plain ASCII without control characters, as importers expect in an archive", .0.display())]
    Name(PathBuf),
    /// FMI has no platform name for a system.
    #[error("FMI has no platform name for {os} on {arch}")]
    Platform {
        /// Operating system, as in [`std::env::consts::OS`].
        os: &'static str,
        /// Processor architecture, as in [`std::env::consts::ARCH`].
        arch: &'static str,
    },
    /// The archive cannot be created.
    #[error("cannot create the archive: {0}")]
    Zip(#[from] zip::result::ZipError),
}

impl Error {
    /// Makes an I/O error at `path`, for `map_err`.
    pub(crate) fn at(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}
