//! Opening a unit with changed resources.

use std::fs;
use std::path::Path;

use fmi2_import::description::ModelDescription;
use fmi2_import::library::Functions;
use fmi2_import::package::Package;

use crate::resource::{Changed, FOLDER, changed, nearest};
use crate::{DeriveError, Resources, UnitSource};

/// Beginning of the generation tool of the units that can print their description.
const KIT: &str = "fmi2-export ";

/// Opens and unpacks a unit. If its resources are changed, its library is loaded and prints the new description. A folder
/// is a unit that is unpacked already, and is used as it is.
///
/// # Errors
/// The unit cannot be used, a change does not fit, or the unit does not accept the resources.
pub fn open(unit: &UnitSource) -> Result<Package, DeriveError> {
    if unit.resources.is_empty() && unit.fmu.is_dir() {
        return Ok(Package::of_folder(&unit.fmu)?);
    }
    let package = Package::open(&unit.fmu)?;
    if unit.resources.is_empty() {
        return Ok(package);
    }
    let text = change(&package, &unit.resources)?;
    Ok(package.with_description(&text)?)
}

/// The description of a unit with its changed resources.
///
/// # Errors
/// As [`open`].
pub fn describe(unit: &UnitSource) -> Result<ModelDescription, DeriveError> {
    if unit.resources.is_empty() {
        return Ok(Package::describe(&unit.fmu)?);
    }
    Ok(open(unit)?.description().clone())
}

/// Changes the unpacked resources of a unit. Returns the description that its library prints for them.
pub(crate) fn change(package: &Package, resources: &Resources) -> Result<String, DeriveError> {
    let tool = package.description().generation_tool.as_ref();
    // code of a unit that cannot answer is not run
    if !tool.is_some_and(|tool| tool.starts_with(KIT)) {
        return Err(DeriveError::Foreign { unit: package.path().to_owned(), tool: tool.cloned() });
    }
    Functions::load(package)?;
    let known: Vec<String> = package
        .files()
        .iter()
        .filter_map(|file| file.strip_prefix(FOLDER))
        .map(str::to_owned)
        .collect();
    let (mut new, mut patches) = (Vec::new(), Patches::default());
    for (name, changes) in resources {
        let path = package.resources().join(name);
        let original = known.contains(name).then(|| fs::read(&path)).transpose();
        let original = original.map_err(failed(&path))?;
        let Changed { content, patched, added } =
            changed(package.path(), name, original, changes, &known)?;
        patches.any |= patched;
        patches.added.extend(added);
        let Some(content) = content else { continue };
        if !known.contains(name) && name.ends_with(".json") {
            new.push((name, content));
        } else {
            write(&path, &content)?;
        }
    }
    if new.is_empty() {
        return print(package, patches);
    }
    // a layout under a wrong name would be ignored
    let without = print(package, patches.clone());
    for (name, content) in &new {
        write(&package.resources().join(name), content)?;
    }
    let with = print(package, patches)?;
    match new.first() {
        Some((name, _)) if without.is_ok_and(|without| without == with) => {
            Err(DeriveError::Unread {
                unit: package.path().to_owned(),
                name: (*name).clone(),
                suggestion: nearest(name, &known),
            })
        }
        _ => Ok(with),
    }
}

/// What an error must say about patches.
#[derive(Debug, Clone, Default)]
struct Patches {
    /// Whether a resource is the text of a patched file, which the user has not seen.
    any: bool,
    /// Places of items that patches add.
    added: Vec<String>,
}

/// The description that the library prints.
fn print(package: &Package, patches: Patches) -> Result<String, DeriveError> {
    let unit = || package.path().to_owned();
    fmi2_package::describe(&package.binary(), Some(&package.resources())).map_err(|error| {
        match error {
            fmi2_package::Error::Refused { message, .. } => {
                let Patches { any: patched, added } = patches;
                DeriveError::Refused { unit: unit(), message, patched, added }
            }
            source => DeriveError::Describe { unit: unit(), source },
        }
    })
}

fn write(path: &Path, content: &[u8]) -> Result<(), DeriveError> {
    let folder = path.parent().unwrap_or(path);
    fs::create_dir_all(folder).and_then(|()| fs::write(path, content)).map_err(failed(path))
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> DeriveError {
    let path = path.to_owned();
    move |source| DeriveError::Temporary { path, source }
}
