//! The library of bundles, and the bundles that ship: `maglev bundle` packs them of scenarios.

use std::{
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use fmi2_package::Archive;

use crate::{licences, package, target::Target, workspace};

/// The package of the library.
pub const CRATE: &str = "fmu-bundle";
/// Its name in the names of libraries.
const IDENTIFIER: &str = "bundle";
/// An archive needs a description; that of a bundle depends on its scenario.
const DESCRIPTION: &str =
    r#"<fmiModelDescription><CoSimulation modelIdentifier="bundle"/></fmiModelDescription>"#;

/// A bundle that ships.
struct Shipped {
    name: &'static str,
    scenario: &'static str,
    options: &'static [&'static str],
}

const SHIPPED: [Shipped; 2] = [
    Shipped {
        name: "magnet-on-girder",
        scenario: "one-magnet",
        options: &[
            "--expose",
            "guideway.*_displacement_01",
            "--expose",
            "guideway.*_acceleration_01",
        ],
    },
    Shipped { name: "train", scenario: "low-speed", options: &[] },
];

/// Name of the file with the library; `maglev bundle` looks for it.
const LIBRARY: &str = "bundle-library.zip";

/// Writes the library with its binaries for all targets, and its licences.
pub fn library(targets: &[Target], folder: &Path) -> Result<()> {
    let mut archive = Archive::new(DESCRIPTION)?;
    package::add_binaries(&mut archive, targets, IDENTIFIER)?;
    for (name, text) in licences::files_of_program(CRATE, &licences::dependencies()?)? {
        archive.file(&format!("documentation/licenses/{name}"), text)?;
    }
    Ok(archive.write(&folder.join(LIBRARY))?)
}

/// Packs the bundles, if a target is for this system.
pub fn package(targets: &[Target], only: Option<&str>, folder: &Path) -> Result<Vec<PathBuf>> {
    if !targets.iter().any(Target::runs_here) {
        eprintln!("no bundles: they are packed on the system that they are for");
        return Ok(Vec::new());
    }
    pack(only, folder, &|args| workspace::run(workspace::maglev(), args))
}

/// Names of the bundles that ship.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|it| it.name)
}

/// Packs the bundles of the units and the library in a folder with the command `maglev`, which gets these arguments.
pub fn pack(
    only: Option<&str>,
    folder: &Path,
    maglev: &dyn Fn(&[OsString]) -> Result<()>,
) -> Result<Vec<PathBuf>> {
    let mut packed = Vec::new();
    for it in SHIPPED.iter().filter(|it| only.is_none_or(|prefix| it.name.starts_with(prefix))) {
        let file = folder.join(format!("{}.fmu", it.name));
        let scenario = scenario(it.scenario, folder)?;
        let mut args: Vec<OsString> = vec!["bundle".into(), scenario.as_os_str().into()];
        args.extend(["--out".into(), file.clone().into(), "--library".into()]);
        args.push(folder.join(LIBRARY).into());
        args.extend(it.options.iter().map(Into::into));
        let done = maglev(&args);
        if scenario.starts_with(folder) {
            fs::remove_file(&scenario)
                .with_context(|| format!("removing {}", scenario.display()))?;
        }
        done?;
        packed.push(file);
    }
    Ok(packed)
}

/// The scenario with the units of this folder, in a file of its own unless it is the usual folder.
pub fn scenario(name: &str, folder: &Path) -> Result<PathBuf> {
    let path = workspace::root().join("scenarios").join(format!("{name}.json"));
    if folder == workspace::unit_dir() {
        return Ok(path);
    }
    let text = fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
    let copy = folder.join(format!(".{name}.json"));
    let text = text.replace("../target/fmu", &folder.to_string_lossy());
    fs::write(&copy, text).with_context(|| format!("writing {}", copy.display()))?;
    Ok(copy)
}
