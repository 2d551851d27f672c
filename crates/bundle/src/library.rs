//! The library of bundles: an archive with its binaries for one or more platforms, and its licences.

use std::path::{Path, PathBuf};

use fmi2_package::Archive;

use crate::error::BundleError;

/// Name of the file that `cargo xtask package` writes beside the units.
const NAME: &str = "bundle-library.zip";

/// The binaries and licences of the library.
#[derive(Debug)]
pub struct Library {
    pub(crate) path: PathBuf,
    pub(crate) archive: Archive,
}

impl Library {
    /// Opens the library: the file that is given, or the one that belongs to this program.
    ///
    /// # Errors
    /// There is none, or it cannot be read.
    pub fn find(given: Option<&Path>) -> Result<Self, BundleError> {
        let places = given.map_or_else(places, |path| vec![path.to_owned()]);
        let Some(path) = places.iter().find(|path| path.is_file()) else {
            return Err(BundleError::NoLibrary { looked: places });
        };
        Ok(Self { path: path.clone(), archive: Archive::open(path)? })
    }

    /// The binaries: platform, ending and content.
    pub(crate) fn binaries(&self) -> impl Iterator<Item = (&str, &str, &[u8])> {
        self.archive.files().filter_map(|(name, content)| {
            let (platform, file) = name.strip_prefix("binaries/")?.split_once('/')?;
            Some((platform, file.rsplit_once('.')?.1, content))
        })
    }
}

/// Beside the program, where `cargo xtask package` puts it, in the Python package, and where an installation has it.
fn places() -> Vec<PathBuf> {
    let program = std::env::current_exe().and_then(|path| path.canonicalize()).unwrap_or_default();
    let folder = program.parent().unwrap_or(Path::new("."));
    ["", "../fmu", "../units", "../share/maglev"].map(|place| folder.join(place).join(NAME)).into()
}
