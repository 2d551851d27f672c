//! From a scenario to SSP.

mod document;
mod rest;
mod system;
mod writer;

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Cursor, Write as _};
use std::path::{Path, PathBuf};

use fmi2_derive::UnitSource;
use indexmap::IndexMap;
use master::system::System;
use scenario::Scenario;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::SspError;
use crate::files::{DESCRIPTION, write};
use crate::import::unique;
use rest::Rest;

/// A version of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SspVersion {
    /// 1.0, which most tools read.
    #[default]
    V1,
    /// 2.0: Reals are called Float64, Integers Int32.
    V2,
}

impl SspVersion {
    /// As the standard writes it.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::V1 => "1.0",
            Self::V2 => "2.0",
        }
    }
}

/// What an export wrote.
#[derive(Debug, Clone)]
pub struct Exported {
    /// Number of components.
    pub components: usize,
    /// Number of connections.
    pub connections: usize,
    /// What SSP cannot say, and where it is instead.
    pub notes: Vec<String>,
}

/// Writes a scenario as an archive (.ssp): the description of the system, its units, and the files that it needs.
///
/// Values of `--set` are included. What SSP cannot say is in an annotation of the type [`ANNOTATION`](crate::ANNOTATION),
/// from which [`import`](crate::import()) takes it again. The archive appears complete or not at all.
///
/// # Errors
/// The scenario is invalid, one of its files cannot be read or has no place in an archive, or the archive cannot be
/// written.
pub fn export(
    scenario: &Scenario,
    version: SspVersion,
    archive: &Path,
) -> Result<Exported, SspError> {
    let system = System::new(scenario).map_err(Box::new)?;
    let mut files = Files::default();
    let units = units(scenario, &system, &mut files)?;
    let name = archive.file_stem().unwrap_or_default().to_string_lossy();
    let rest = Rest::new(scenario, &system, &mut files)?;
    let parts = document::Parts { scenario, system: &system, units: &units, rest: &rest, version };
    let (text, counts) = document::text(&parts, &name)?;
    let content = packed(&text, &files).map_err(|error| SspError::Write {
        path: archive.to_owned(),
        source: io::Error::other(error),
    })?;
    write(archive, &content)?;
    let (components, connections) = counts;
    Ok(Exported { components, connections, notes: rest.notes })
}

/// Files of the archive besides the description, by their names.
#[derive(Default)]
struct Files(IndexMap<String, Content>);

/// The content of a file.
enum Content {
    File(PathBuf),
    Bytes(Vec<u8>),
}

impl Files {
    /// Adds a file under a name that no other has, similar to `wanted`. Returns the name.
    fn add(&mut self, wanted: &str, content: Content) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let wanted: String = wanted.chars().map(plain).collect();
        let (stem, end) = wanted.rsplit_once('.').unwrap_or((&wanted, ""));
        // names that differ in case only are one file in some file systems
        let taken: BTreeSet<String> = self.0.keys().map(|it| it.to_lowercase()).collect();
        let full = |stem: &str| match end {
            "" => format!("resources/{stem}"),
            _ => format!("resources/{stem}.{end}"),
        };
        let stem = unique(stem.to_owned(), |stem| taken.contains(&full(stem).to_lowercase()));
        let name = full(&stem);
        self.0.insert(name.clone(), content);
        name
    }

    /// Adds a file of the user. `place` is its place in the scenario.
    fn add_file(&mut self, path: &Path, place: &str) -> Result<String, SspError> {
        if !path.is_file() {
            let why = format!("{} is not a file", path.display());
            return Err(SspError::Export { what: place.to_owned(), why });
        }
        let same = |it: &Content| matches!(it, Content::File(other) if other == path);
        if let Some((name, _)) = self.0.iter().find(|(_, it)| same(it)) {
            return Ok(name.clone());
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        Ok(self.add(&name, Content::File(path.to_owned())))
    }
}

/// The files of the units that have instances, by their keys in `units`.
fn units(
    scenario: &Scenario,
    system: &System,
    files: &mut Files,
) -> Result<IndexMap<String, String>, SspError> {
    let mut names = IndexMap::new();
    for instance in &system.instances {
        if names.contains_key(&instance.unit) {
            continue;
        }
        let Some(unit) = scenario.units.get(&instance.unit) else { continue };
        let content = unit_file(&instance.unit, unit)?;
        let name = files.add(&format!("{}.fmu", instance.unit), content);
        names.insert(instance.unit.clone(), name);
    }
    Ok(names)
}

fn unit_file(key: &str, unit: &UnitSource) -> Result<Content, SspError> {
    if unit.resources.is_empty() {
        return Ok(Content::File(unit.fmu.clone()));
    }
    let failed = |source| SspError::Derive { name: key.to_owned(), source: Box::new(source) };
    let derived = fmi2_derive::derive(unit, key).map_err(failed)?;
    Ok(Content::Bytes(derived.to_bytes().map_err(failed)?))
}

/// The content of the archive.
fn packed(
    description: &str,
    files: &Files,
) -> Result<Vec<u8>, Box<dyn std::error::Error + Send + Sync>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file(DESCRIPTION, SimpleFileOptions::default())?;
    zip.write_all(description.as_bytes())?;
    for (name, content) in &files.0 {
        let is_packed = name.ends_with(".fmu") || name.ends_with(".parquet");
        let method =
            if is_packed { CompressionMethod::Stored } else { CompressionMethod::Deflated };
        zip.start_file(name.as_str(), SimpleFileOptions::default().compression_method(method))?;
        match content {
            Content::Bytes(bytes) => zip.write_all(bytes)?,
            Content::File(path) => {
                let bytes = fs::read(path).map_err(|error| {
                    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
                })?;
                zip.write_all(&bytes)?;
            }
        }
    }
    Ok(zip.finish()?.into_inner())
}
