//! A new .fmu file from a unit with changed resources.

use std::fs;
use std::path::Path;

use fmi2_import::archive::FmuArchive;
use fmi2_import::package::{Package, REFERENCE_RESULTS};
use fmi2_package::{Archive, PageParts};

use crate::open::change;
use crate::resource::FOLDER;
use crate::{DeriveError, UnitSource};

const DESCRIPTION: &str = "modelDescription.xml";
const PAGE: &str = "documentation/index.html";
/// Pictures of the unit, which show the old layout.
const PICTURES: [&str; 2] = ["model.png", "documentation/model.png"];

/// A new unit, ready to be written.
#[derive(Debug)]
pub struct Derived {
    archive: Archive,
    package: Package,
    /// Names of resources that are replaced.
    pub replaced: Vec<String>,
    /// Names of resources that are added.
    pub added: Vec<String>,
    /// Files of the original unit that hold for its own resources only, and are left out.
    pub dropped: Vec<String>,
}

/// Makes a new unit of one with changed resources. `name` is its file name without `.fmu`.
///
/// All binaries, licences and other resources are those of the original. Reference results and pictures are left out. The
/// page in `documentation/` is written again, if `fmi2-package` made it.
///
/// # Errors
/// As [`open`](crate::open), or the archive cannot be read or packed.
pub fn derive(unit: &UnitSource, name: &str) -> Result<Derived, DeriveError> {
    let package = Package::open(&unit.fmu)?;
    let description = change(&package, &unit.resources)?;
    let failed = |source| DeriveError::Archive { unit: unit.fmu.clone(), source };
    let mut original = FmuArchive::open(&unit.fmu).map_err(failed)?;
    let files: Vec<String> = original.files().map(str::to_owned).collect();
    let mut archive = Archive::new(&description).map_err(DeriveError::Pack)?;
    let mut dropped = Vec::new();
    for file in files.iter().filter(|file| *file != DESCRIPTION) {
        if file.starts_with(REFERENCE_RESULTS) || PICTURES.contains(&file.as_str()) {
            dropped.push(file.clone());
            continue;
        }
        let Some(mut content) = original.read(file).map_err(failed)? else { continue };
        if file == PAGE {
            content = page(content, &description, name)?;
        }
        archive.file(file, content).map_err(DeriveError::Pack)?;
    }
    let (mut replaced, mut added) = (Vec::new(), Vec::new());
    for name in unit.resources.keys() {
        let path = package.resources().join(name);
        if !path.is_file() {
            continue;
        }
        let content = fs::read(&path)
            .map_err(|source| DeriveError::Temporary { path: path.clone(), source })?;
        let file = format!("{FOLDER}{name}");
        let list = if files.contains(&file) { &mut replaced } else { &mut added };
        list.push(name.clone());
        archive.file(&file, content).map_err(DeriveError::Pack)?;
    }
    let package = package.with_description(&description)?;
    Ok(Derived { archive, package, replaced, added, dropped })
}

impl Derived {
    /// The unpacked unit.
    #[must_use]
    pub fn package(&self) -> &Package {
        &self.package
    }

    /// Writes the .fmu file: it appears complete or not at all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, file: &Path) -> Result<(), fmi2_package::Error> {
        self.archive.write(file)
    }

    /// The content of the .fmu file.
    ///
    /// # Errors
    /// The archive would become too large for its format.
    pub fn to_bytes(&self) -> Result<Vec<u8>, DeriveError> {
        self.archive.to_bytes().map_err(DeriveError::Pack)
    }
}

/// The page of the new unit: its variables, and the text of the old page. A page of another make is kept.
fn page(old: Vec<u8>, description: &str, name: &str) -> Result<Vec<u8>, DeriveError> {
    let text = String::from_utf8_lossy(&old);
    let Some(text) = fmi2_package::text_of_page(&text) else { return Ok(old) };
    let parts = PageParts { name, text, ..PageParts::default() };
    let page = fmi2_package::page(description, parts).map_err(DeriveError::Pack)?;
    Ok(page.into_bytes())
}
