//! Builds the units' libraries and packs each layout into an .fmu.
//!
//! A unit's description is asked of the built library itself
//! (`fmi2_export_describe`), so it can never disagree with the code.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use fmi2_package::Archive;

use crate::{documentation, workspace};

/// A unit that can be packed: a library with one set of resources.
pub struct Unit {
    /// File name without `.fmu`, also of the committed description.
    pub name: String,
    /// The FMI model identifier, which names the binary.
    pub identifier: &'static str,
    /// The folder of its resources, if it has any.
    pub resources: Option<PathBuf>,
}

/// The unit crates: model identifier, and the layout that goes by the plain name.
const CRATES: [(&str, &str); 3] =
    [("ems", ""), ("guideway", "three-spans"), ("vehicle", "two-car")];

/// All units: one for `ems`, one for each resource folder of the other two.
pub fn units() -> Result<Vec<Unit>> {
    let mut units = Vec::new();
    for (identifier, default) in CRATES {
        let folder = workspace::root().join(format!("fmu-{identifier}")).join("resources");
        if default.is_empty() {
            units.push(Unit { name: identifier.into(), identifier, resources: None });
            continue;
        }
        for layout in subfolders(&folder)? {
            let name = if layout == default {
                identifier.to_owned()
            } else {
                format!("{identifier}-{layout}")
            };
            units.push(Unit { name, identifier, resources: Some(folder.join(layout)) });
        }
    }
    Ok(units)
}

fn subfolders(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}

/// Builds the three libraries and packs every unit; returns the .fmu files.
///
/// With `check`, a stale committed description is an error, else a warning.
pub fn package(check: bool, only: Option<&str>) -> Result<Vec<PathBuf>> {
    build()?;
    let folder = workspace::unit_dir();
    fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
    let mut packed = Vec::new();
    for unit in units()? {
        if only.is_some_and(|prefix| !unit.name.starts_with(prefix)) {
            continue;
        }
        let xml = describe(&unit)?;
        let committed = description_file(&unit);
        if fs::read_to_string(&committed).is_ok_and(|text| text == xml) {
        } else if check {
            bail!("{} is stale: run `cargo xtask codegen` and commit", committed.display());
        } else {
            eprintln!("warning: {} is stale: run `cargo xtask codegen`", committed.display());
        }
        let file = folder.join(format!("{}.fmu", unit.name));
        archive(&unit, &xml)?.write(&file)?;
        packed.push(file);
    }
    eprintln!("packed {} units into {}", packed.len(), folder.display());
    Ok(packed)
}

/// Builds the unit libraries in release mode.
pub fn build() -> Result<()> {
    let mut args = vec!["build".to_owned(), "--release".into(), "--quiet".into()];
    for (identifier, _) in CRATES {
        args.extend(["--package".into(), format!("fmu-{identifier}")]);
    }
    workspace::run(workspace::cargo(), &args)
}

/// The committed print of a unit's description.
pub fn description_file(unit: &Unit) -> PathBuf {
    workspace::root().join("modelDescription").join(format!("{}.xml", unit.name))
}

fn library(identifier: &str) -> PathBuf {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    let name = format!("{DLL_PREFIX}fmu_{identifier}{DLL_SUFFIX}");
    workspace::target_dir().join("release").join(name)
}

/// `modelDescription.xml` of `unit`, as its built library prints it.
pub fn describe(unit: &Unit) -> Result<String> {
    fmi2_package::describe(&library(unit.identifier), unit.resources.as_deref())
        .with_context(|| format!("describing the unit {}", unit.name))
}

/// The .fmu's files.
fn archive(unit: &Unit, xml: &str) -> Result<Archive> {
    let mut archive = Archive::new(xml)?;
    archive.binary(fmi2_package::host()?, &library(unit.identifier))?;
    archive.file("documentation/index.html", documentation::page(xml)?)?;
    for licence in ["LICENSE-APACHE", "LICENSE-MIT"] {
        let text = fs::read(workspace::root().join(licence))?;
        archive.file(&format!("documentation/licenses/{licence}"), text)?;
    }
    if let Some(folder) = &unit.resources {
        archive.folder("resources", folder)?;
    }
    Ok(archive)
}
