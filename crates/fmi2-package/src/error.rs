//! What can go wrong while packing.

use std::path::PathBuf;

/// Why a unit cannot be packed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The system's loader refuses the library.
    #[error("{}: the library cannot be loaded", path.display())]
    Load {
        /// The library.
        path: PathBuf,
        /// What the loader says.
        source: libloading::Error,
    },
    /// The library is not made with `fmi2-export`.
    #[error(
        "{}: the library has no fmi2_export_describe; is it a cdylib with fmi2_export::export!(Model)?",
        path.display()
    )]
    NotAUnit {
        /// The library.
        path: PathBuf,
    },
    /// The unit refuses its resources or declarations.
    #[error("{}: {message}", path.display())]
    Refused {
        /// The library.
        path: PathBuf,
        /// What the unit says.
        message: String,
    },
    /// The description is not one.
    #[error("modelDescription.xml: {0}")]
    Description(String),
    /// A path that an archive or the C interface cannot carry.
    #[error("{}: the name must be plain ASCII without control characters, as importers expect in an archive", .0.display())]
    Name(PathBuf),
    /// There is no name for a system.
    #[error("FMI has no platform name for {os} on {arch}")]
    Platform {
        /// The operating system.
        os: &'static str,
        /// The processor.
        arch: &'static str,
    },
    /// The archive cannot be made.
    #[error("the archive cannot be made: {0}")]
    Zip(#[from] zip::result::ZipError),
}

impl Error {
    /// For `map_err`: an input/output error at `path`.
    pub(crate) fn at(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}
