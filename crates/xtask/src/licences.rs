//! The licences that a unit must carry: its own, and those of the crates that are linked into it.
//!
//! `cargo-about` does the same and more. It is not used because the first command of a new user packs the
//! units: `cargo-about` brings 150 crates, among them a TLS library and C code, and would double the
//! time of the first build.

use std::{collections::BTreeMap, fmt::Write as _, fs, process::Command};

use anyhow::{Context, Result, bail};
use cargo_metadata::{Metadata, MetadataCommand, Package};

use crate::workspace;

/// The systems that are covered; an .fmu may contain libraries for any of them.
const SYSTEMS: [&str; 3] =
    ["x86_64-unknown-linux-gnu", "x86_64-pc-windows-msvc", "aarch64-apple-darwin"];

/// What every library contains.
const STANDARD_LIBRARY: &str = "The Rust standard library: MIT OR Apache-2.0, Copyright (c) The Rust Project \
                                Contributors; texts as in LICENSE-MIT and LICENSE-APACHE.\n";

/// The files of `documentation/licenses/` for a unit crate, by name.
///
/// `license.txt` lists every crate with its licence and the files with its texts. A text that several
/// crates share is written once.
///
/// # Errors
/// A crate contains no licence text.
pub fn files(unit_crate: &str, systems: &[Metadata]) -> Result<BTreeMap<String, Vec<u8>>> {
    collect(unit_crate, systems, |package| {
        bail!(
            "{} {} contains no licence text; get it from {} and add it to the repository",
            package.name,
            package.version,
            repository(package)
        )
    })
}

/// The same for a crate that is linked into programs. The list says where the text is that a crate does not contain: some
/// crates of the command, for macOS, leave theirs in their repositories.
pub fn files_of_program(name: &str, systems: &[Metadata]) -> Result<BTreeMap<String, Vec<u8>>> {
    collect(name, systems, |package| Ok(format!("the text is in {}", repository(package))))
}

fn repository(package: &Package) -> &str {
    package.repository.as_deref().unwrap_or("its authors' repository")
}

/// Lists the crates with their texts. `missing` says what to write of a crate without one.
fn collect(
    unit_crate: &str,
    systems: &[Metadata],
    missing: impl Fn(&Package) -> Result<String>,
) -> Result<BTreeMap<String, Vec<u8>>> {
    let mut files = BTreeMap::new();
    for name in ["LICENSE-APACHE", "LICENSE-MIT"] {
        files.insert(name.to_owned(), read(workspace::root().join(name).as_path())?);
    }
    let mut list = format!(
        "{unit_crate}: MIT OR Apache-2.0, at your choice; texts in LICENSE-MIT and LICENSE-APACHE.\n\n\
         Its libraries contain code of the crates below, under these licences.\n\n{STANDARD_LIBRARY}"
    );
    for (name, package) in linked(unit_crate, systems)? {
        let licence = package.license.as_deref().unwrap_or("see the text");
        write!(list, "\n{name}: {licence}\n")?;
        if !package.authors.is_empty() {
            writeln!(list, "  by {}", package.authors.join(", "))?;
        }
        let texts = texts(&package)?;
        if texts.is_empty() {
            writeln!(list, "  {}", missing(&package)?)?;
        }
        for (text, content) in texts {
            let known =
                files.iter().find(|(_, known)| **known == content).map(|(file, _)| file.clone());
            let file = known.unwrap_or_else(|| format!("{name}-{text}"));
            writeln!(list, "  {file}")?;
            files.insert(file, content);
        }
    }
    files.insert("license.txt".into(), list.into_bytes());
    Ok(files)
}

/// Cargo's metadata for each system.
pub fn dependencies() -> Result<Vec<Metadata>> {
    let on = |system: &&str| {
        MetadataCommand::new()
            .manifest_path(workspace::root().join("Cargo.toml"))
            .other_options(["--filter-platform".into(), (*system).into()])
            .exec()
            .context("reading the dependencies with cargo metadata")
    };
    SYSTEMS.iter().map(on).collect()
}

/// The crates from a registry that are linked into a unit's library on any of the systems.
///
/// `cargo tree` takes only the features into account that the unit turns on; the metadata contain the
/// crates' folders.
fn linked(unit_crate: &str, systems: &[Metadata]) -> Result<BTreeMap<String, Package>> {
    let mut found = BTreeMap::new();
    for (system, metadata) in SYSTEMS.iter().zip(systems) {
        // macros and build scripts are not linked
        let args = ["tree", "--package", unit_crate, "--edges", "normal,no-proc-macro"];
        let output = Command::new(workspace::cargo())
            .args(args)
            .args(["--target", system, "--prefix", "none", "--format", "{p}"])
            .current_dir(workspace::root())
            .output()
            .context("starting cargo tree")?;
        if !output.status.success() {
            bail!("cargo tree: {}", String::from_utf8_lossy(&output.stderr));
        }
        for line in String::from_utf8(output.stdout)?.lines() {
            let mut words = line.split(' ');
            let (Some(name), Some(version)) = (words.next(), words.next()) else { continue };
            let version = version.trim_start_matches('v');
            let is = |p: &&Package| p.name == name && p.version.to_string() == version;
            let package = metadata.packages.iter().find(is);
            let package =
                package.with_context(|| format!("cargo metadata does not list {line}"))?;
            if package.source.is_some() {
                found.insert(format!("{name}-{version}"), package.clone());
            }
        }
    }
    Ok(found)
}

/// The licence texts in a crate's folder.
fn texts(package: &Package) -> Result<BTreeMap<String, Vec<u8>>> {
    let folder = package.manifest_path.parent().context("a package has no folder")?;
    let mut texts = BTreeMap::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().to_uppercase();
        let begins = ["LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE", "COPYRIGHT"];
        if entry.file_type()?.is_file() && begins.iter().any(|begin| name.starts_with(begin)) {
            texts.insert(entry.file_name().to_string_lossy().into_owned(), read(&entry.path())?);
        }
    }
    Ok(texts)
}

fn read(file: &std::path::Path) -> Result<Vec<u8>> {
    fs::read(file).with_context(|| format!("reading {}", file.display()))
}
