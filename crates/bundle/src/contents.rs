//! The units in a bundle: unpacked into its resources, so that an importer that unpacks the bundle has unpacked them too.

use std::collections::BTreeMap;
use std::path::Path;

use fmi2_derive::UnitSource;
use fmi2_import::archive::FmuArchive;
use indexmap::IndexMap;

use crate::error::BundleError;
use crate::names::Names;

/// Folder of the units in the bundle's resources.
pub(crate) const UNITS: &str = "units";

/// A unit inside.
pub(crate) struct Inner {
    /// Its folder below [`UNITS`].
    pub(crate) folder: String,
    /// Its files by their names in its archive.
    pub(crate) files: BTreeMap<String, Vec<u8>>,
}

impl Inner {
    /// Names of the platforms that it has binaries for.
    pub(crate) fn platforms(&self) -> Vec<&str> {
        let mut found: Vec<&str> = self
            .files
            .keys()
            .filter_map(|name| Some(name.strip_prefix("binaries/")?.split_once('/')?.0))
            .collect();
        found.dedup();
        found
    }
}

/// The units of a scenario by their keys.
pub(crate) fn units(
    sources: &IndexMap<String, UnitSource>,
) -> Result<IndexMap<String, Inner>, BundleError> {
    let mut folders = Names::default();
    let mut units = IndexMap::new();
    for (key, source) in sources {
        let folder = folders.like(key);
        let files = match source.resources.is_empty() {
            true => files(&source.fmu, &source.fmu)?,
            false => {
                let made = tempfile::tempdir().map_err(failed(Path::new("a temporary folder")))?;
                let file = made.path().join("derived.fmu");
                fmi2_derive::derive(source, &folder)?.write(&file)?;
                files(&file, &source.fmu)?
            }
        };
        units.insert(key.clone(), Inner { folder, files });
    }
    Ok(units)
}

/// The files of an archive, or of a folder, that a bundle needs.
fn files(path: &Path, unit: &Path) -> Result<BTreeMap<String, Vec<u8>>, BundleError> {
    let mut files = BTreeMap::new();
    if path.is_dir() {
        read_folder(path, "", &mut files)?;
    } else {
        let broken = |source| BundleError::Unit { unit: unit.to_owned(), source };
        let mut archive = FmuArchive::open(path).map_err(broken)?;
        let names: Vec<String> = archive.files().map(str::to_owned).collect();
        for name in names {
            if let Some(content) = archive.read(&name).map_err(broken)? {
                files.insert(name, content);
            }
        }
    }
    let needed = ["modelDescription.xml", "binaries/", "resources/", "documentation/"];
    files.retain(|name, _| needed.iter().any(|begin| name.starts_with(begin)));
    Ok(files)
}

/// Adds all files of a folder.
pub(crate) fn read_folder(
    folder: &Path,
    prefix: &str,
    files: &mut BTreeMap<String, Vec<u8>>,
) -> Result<(), BundleError> {
    for entry in std::fs::read_dir(folder).map_err(failed(folder))? {
        let path = entry.map_err(failed(folder))?.path();
        let name = format!("{prefix}{}", path.file_name().unwrap_or_default().to_string_lossy());
        if path.is_dir() {
            read_folder(&path, &format!("{name}/"), files)?;
        } else {
            files.insert(name, std::fs::read(&path).map_err(failed(&path))?);
        }
    }
    Ok(())
}

/// An error of the operating system with its file.
pub(crate) fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> BundleError {
    let path = path.to_owned();
    move |source| BundleError::File { path, source }
}
