//! Builds the units' libraries and packs each layout into an .fmu.
//!
//! A unit's description comes from the built library (`fmi2_export_describe`), so it always agrees
//! with the code.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use fmi2_package::Archive;

use crate::{
    binaries, bundles, documentation, licences, picture,
    reference::Reference,
    target::{self, Target},
    workspace,
};

/// A unit that can be packed: a library with one set of resources.
pub struct Unit {
    /// File name without `.fmu`; the committed description has the same name.
    pub name: String,
    /// The FMI model identifier, which names the binary.
    pub identifier: &'static str,
    /// The folder of its resources, if it has any.
    pub resources: Option<PathBuf>,
}

/// The packages of the units' libraries.
const UNIT_CRATES: [&str; 4] = ["fmu-controller", "fmu-ems", "fmu-guideway", "fmu-vehicle"];

/// Model identifiers, each with the layout whose unit has no suffix in its name.
const CRATES: [(&str, &str); 4] =
    [("controller", ""), ("ems", ""), ("guideway", "three-spans"), ("vehicle", "two-car")];

/// All units: one for `controller` and for `ems`, one for each resource folder of the others.
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

/// What to pack, and where to.
#[derive(Default)]
pub struct Order {
    /// A stale committed description is an error, else a warning.
    pub check: bool,
    /// Only the units whose name starts so.
    pub only: Option<String>,
    /// The systems; none means the one that this program runs on.
    pub targets: Vec<Target>,
    /// Build the command `maglev` for the targets too, as `maglev-{platform}` beside the units.
    pub maglev: bool,
    /// Packages to build for this system in the same call of cargo: two cores are then busy to the end.
    pub also: &'static [&'static str],
    /// Pack no bundles, only the library that they need.
    pub no_bundles: bool,
    /// Folder of the .fmu files; `target/fmu` unless given.
    pub out: Option<PathBuf>,
}

/// Builds the libraries for every target and packs every unit; returns the .fmu files.
pub fn package(order: &Order) -> Result<Vec<PathBuf>> {
    let host = [Target::host()];
    let targets = if order.targets.is_empty() { &host[..] } else { &order.targets };
    target::distinct(targets)?;
    // descriptions come from libraries that run here
    let others: &[&str] = &[bundles::CRATE, workspace::COMMAND];
    Target::host().build(&[&UNIT_CRATES, others, order.also].concat())?;
    // in one call, so that what they share is compiled once
    let command: &[&str] = if order.maglev { &[workspace::COMMAND] } else { &[] };
    for target in targets.iter().filter(|&target| *target != host[0]) {
        target.build(&[&UNIT_CRATES[..], &[bundles::CRATE], command].concat())?;
    }
    let folder = order.out.clone().unwrap_or_else(workspace::unit_dir);
    fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
    let mut archives = Vec::new();
    let dependencies = licences::dependencies()?;
    let mut licences: BTreeMap<&str, Licences> = BTreeMap::new();
    for unit in units()? {
        if order.only.as_ref().is_some_and(|prefix| !unit.name.starts_with(prefix)) {
            continue;
        }
        let xml = describe(&unit)?;
        compare(&unit, &xml, order.check)?;
        let file = folder.join(format!("{}.fmu", unit.name));
        if !licences.contains_key(unit.identifier) {
            licences.insert(
                unit.identifier,
                licences::files(&format!("fmu-{}", unit.identifier), &dependencies)?,
            );
        }
        archives.push((archive(&unit, &xml, targets, &licences[unit.identifier])?, file));
    }
    // only now, so that an error leaves all units as they were
    let mut packed = Vec::new();
    for (archive, file) in archives {
        archive.write(&file)?;
        packed.push(file);
    }
    bundles::library(targets, &folder)?;
    if !order.no_bundles {
        packed.extend(bundles::package(targets, order.only.as_deref(), &folder)?);
    }
    if order.maglev {
        for target in targets {
            let built = target.maglev();
            let end =
                built.extension().map(|end| format!(".{}", end.display())).unwrap_or_default();
            // one platform may have several processors
            let file = folder.join(format!("maglev-{}-{}{end}", target.platform()?, target.arch()));
            fs::copy(&built, &file).with_context(|| format!("copying {}", built.display()))?;
        }
    }
    eprintln!("packed {} units into {}", packed.len(), folder.display());
    Ok(packed)
}

/// Compares a unit's description with the committed one.
fn compare(unit: &Unit, xml: &str, check: bool) -> Result<()> {
    let committed = description_file(unit);
    if fs::read_to_string(&committed).is_ok_and(|text| text == xml) {
    } else if check {
        bail!("{} is stale: run `cargo xtask codegen` and commit", committed.display());
    } else {
        eprintln!("warning: {} is stale: run `cargo xtask codegen`", committed.display());
    }
    Ok(())
}

/// Builds the unit libraries for this system in release mode.
pub fn build() -> Result<()> {
    Target::host().build(&UNIT_CRATES)
}

/// The committed copy of a unit's description.
pub fn description_file(unit: &Unit) -> PathBuf {
    workspace::root().join("modelDescription").join(format!("{}.xml", unit.name))
}

/// `modelDescription.xml` of `unit`, as its built library prints it.
pub fn describe(unit: &Unit) -> Result<String> {
    fmi2_package::describe(&Target::host().library(unit.identifier), unit.resources.as_deref())
        .with_context(|| format!("describing the unit {}", unit.name))
}

/// Licence texts by file name.
type Licences = BTreeMap<String, Vec<u8>>;

/// The folder of a unit's crate.
pub fn crate_folder(unit: &Unit) -> PathBuf {
    workspace::root().join(format!("fmu-{}", unit.identifier))
}

/// The .fmu's files.
fn archive(unit: &Unit, xml: &str, targets: &[Target], licences: &Licences) -> Result<Archive> {
    let mut archive = Archive::new(xml)?;
    add_binaries(&mut archive, targets, unit.identifier)?;
    let documentation = crate_folder(unit).join("documentation");
    // a layout of one's own may have neither a picture nor reference results
    let picture = documentation.join(format!("{}.svg", unit.name));
    let picture = picture.is_file().then(|| {
        fs::read_to_string(&picture).with_context(|| format!("reading {}", picture.display()))
    });
    let picture = picture.transpose()?;
    if let Some(picture) = &picture {
        archive.file("model.png", picture::png(picture)?)?;
    }
    let reference = Reference::of(unit)?;
    let results = reference.as_ref().map(|it| it.figure(xml)).transpose()?;
    let parts = documentation::Parts {
        name: &unit.name,
        folder: &documentation,
        picture: picture.as_deref().unwrap_or_default(),
        results: results.as_deref(),
    };
    archive.file("documentation/index.html", documentation::page(xml, &parts)?)?;
    for (name, text) in licences {
        archive.file(&format!("documentation/licenses/{name}"), text.as_slice())?;
    }
    for (name, content) in reference.map(|it| it.files()).transpose()?.unwrap_or_default() {
        archive.file(&name, content)?;
    }
    if let Some(folder) = &unit.resources {
        archive.folder("resources", folder)?;
    }
    Ok(archive)
}

/// Adds the libraries of the crate `fmu-{identifier}` for all targets.
pub fn add_binaries(archive: &mut Archive, targets: &[Target], identifier: &str) -> Result<()> {
    let mut libraries: BTreeMap<&str, Vec<PathBuf>> = BTreeMap::new();
    for target in targets {
        libraries.entry(target.platform()?).or_default().push(target.library(identifier));
    }
    for (platform, files) in libraries {
        if let [library] = files.as_slice() {
            archive.binary(platform, library)?;
        } else {
            let folder = workspace::target_dir().join("universal");
            let joined = folder.join(format!("libfmu_{identifier}.dylib"));
            binaries::universal(&files, &joined)?;
            archive.binary(platform, &joined)?;
        }
    }
    Ok(())
}
