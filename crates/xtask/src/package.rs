//! Builds the units' libraries and packs each layout into an .fmu.
//!
//! A unit's description is asked of the built library itself
//! (`fmi2_export_describe`), so it can never disagree with the code.

use std::{
    ffi::{CString, c_char},
    fs,
    io::{Cursor, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use zip::{ZipWriter, write::SimpleFileOptions};

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
        // Renamed into place, so that a run that starts meanwhile never sees half a unit.
        let partial = folder.join(format!(".{}.fmu.partial", unit.name));
        fs::write(&partial, archive(&unit, &xml)?)
            .and_then(|()| fs::rename(&partial, &file))
            .with_context(|| format!("writing {}", file.display()))?;
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
    type Describe = unsafe extern "C" fn(*const c_char, *mut c_char, usize) -> usize;

    let path = library(unit.identifier);
    let resources = unit.resources.as_deref().unwrap_or(Path::new(""));
    let resources = CString::new(resources.to_string_lossy().as_bytes())?;
    // SAFETY: our own library, built a moment ago; loading it runs no code of its own.
    let library = unsafe { libloading::Library::new(&path) }
        .with_context(|| format!("loading {}", path.display()))?;
    // SAFETY: the export kit defines the symbol with this type.
    let describe = unsafe { library.get::<Describe>(b"fmi2_export_describe\0") }
        .with_context(|| format!("{} has no fmi2_export_describe", path.display()))?;
    let mut buffer = vec![0u8; 1 << 16];
    loop {
        // SAFETY: a NUL-terminated path, and a buffer with its true capacity.
        let length =
            unsafe { describe(resources.as_ptr(), buffer.as_mut_ptr().cast(), buffer.len()) };
        if length == 0 {
            let end = buffer.iter().position(|&b| b == 0).unwrap_or(buffer.len());
            bail!("{}: {}", unit.name, String::from_utf8_lossy(&buffer[..end]));
        }
        if length < buffer.len() {
            buffer.truncate(length);
            return Ok(String::from_utf8(buffer)?);
        }
        buffer.resize(length + 1, 0);
    }
}

/// The .fmu's bytes. Same input gives the same bytes: sorted, without times.
fn archive(unit: &Unit, xml: &str) -> Result<Vec<u8>> {
    let mut files: Vec<(String, Vec<u8>)> =
        vec![("modelDescription.xml".into(), xml.as_bytes().to_vec())];
    let binary = library(unit.identifier);
    let suffix = std::env::consts::DLL_SUFFIX;
    files.push((
        format!("binaries/{}/{}{suffix}", platform()?, unit.identifier),
        fs::read(&binary).with_context(|| format!("reading {}", binary.display()))?,
    ));
    files.push(("documentation/index.html".into(), documentation::page(xml)?.into_bytes()));
    for licence in ["LICENSE-APACHE", "LICENSE-MIT"] {
        let text = fs::read(workspace::root().join(licence))?;
        files.push((format!("documentation/licenses/{licence}"), text));
    }
    if let Some(folder) = &unit.resources {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            files.push((format!("resources/{name}"), fs::read(entry.path())?));
        }
    }
    files.sort();
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().unix_permissions(0o644);
    for (name, content) in files {
        zip.start_file(name, options.last_modified_time(zip::DateTime::default()))?;
        zip.write_all(&content)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// FMI 2.0's name of the platform that we build for.
fn platform() -> Result<&'static str> {
    match (std::env::consts::OS, std::env::consts::ARCH) {
        ("linux", "x86_64") => Ok("linux64"),
        ("windows", "x86_64") => Ok("win64"),
        ("macos", "x86_64") => Ok("darwin64"),
        // FMI 2.0 names no others; FMI 3.0's names are what tools look for then.
        ("linux", "aarch64") => Ok("aarch64-linux"),
        ("macos", "aarch64") => Ok("aarch64-darwin"),
        (os, arch) => bail!("FMI 2.0 has no platform name for {os} on {arch}"),
    }
}
