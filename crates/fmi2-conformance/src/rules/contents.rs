//! The raw contents of an archive.

use std::error::Error as _;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use thiserror::Error;
use uuid::Uuid;
use zip::ZipArchive;
use zip::result::ZipError;

use super::directory::{self, ZipDirectory};
use fmi2_import::archive::{self, ArchiveError, FmuArchive, MAX_DESCRIPTION_SIZE, MAX_ENTRY_SIZE};

/// A .fmu file cannot be opened or read.
#[derive(Debug, Error)]
#[error("cannot read {path}")]
pub struct Unreadable {
    /// Path of the .fmu file, as it was given.
    pub path: PathBuf,
    /// What the operating system reported.
    #[source]
    pub source: io::Error,
}

/// The parts of a .fmu file.
#[derive(Default)]
pub(super) struct Contents {
    /// Name of the file.
    pub file_name: String,
    /// Its directory; empty if it is not a zip archive.
    pub directory: ZipDirectory,
    /// Why it is not a zip archive.
    pub damage: Option<String>,
    /// Why the importer refuses it.
    pub refusal: Option<ArchiveError>,
    /// The bytes of modelDescription.xml, if they can be unpacked.
    pub description: Option<Vec<u8>>,
    /// Files in `binaries/` with their bytes, if they can be unpacked.
    pub binaries: Vec<(String, Vec<u8>)>,
    /// The bytes of model.png.
    pub icon: Option<Vec<u8>>,
    /// Names of entries that cannot be unpacked, and why.
    pub damaged: Vec<(String, String)>,
    /// The description as text.
    text: Option<String>,
    /// Names below `resources` with the hashes of their contents, in FMUs whose GUID depends on them.
    pub resources: Vec<(String, Uuid)>,
}

impl Contents {
    /// Reads a file.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn read(path: &Path) -> Result<Self, Unreadable> {
        let unreadable = |source| Unreadable { path: path.to_owned(), source };
        let mut file = File::open(path).map_err(unreadable)?;
        if file.metadata().map_err(unreadable)?.is_dir() {
            return Err(unreadable(io::ErrorKind::IsADirectory.into()));
        }
        let mut contents = Self {
            file_name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            directory: directory::read(&mut file).map_err(unreadable)?,
            refusal: FmuArchive::open(path).and_then(|mut archive| archive.description()).err(),
            ..Self::default()
        };
        match ZipArchive::new(BufReader::new(file)) {
            Ok(mut zip) => {
                contents.unpack(&mut zip);
                let text = contents.description.clone().and_then(|it| archive::text(it).ok());
                contents.text = text.map(|(text, _)| text);
                if contents.text().is_some_and(made_by_kit) {
                    contents.hash_resources(&mut zip);
                }
            }
            Err(error) => contents.damage = Some(error.to_string()),
        }
        Ok(contents)
    }

    fn hash_resources(&mut self, zip: &mut ZipArchive<BufReader<File>>) {
        for index in 0..zip.len() {
            let name = match zip.by_index_raw(index) {
                Ok(entry) if entry.is_file() => {
                    String::from_utf8_lossy(entry.name_raw()).into_owned()
                }
                _ => continue,
            };
            let path = directory::path(&name);
            let Some(inside) = path.strip_prefix("resources/") else { continue };
            let mut content = Vec::new();
            if copy(zip, index, MAX_ENTRY_SIZE, &mut content).is_ok() {
                self.resources.push((inside.to_owned(), hash(&content)));
            }
        }
    }

    /// Unpacks every entry, to keep its content or to verify the checksum.
    fn unpack(&mut self, zip: &mut ZipArchive<BufReader<File>>) {
        // an archive of excessive size is read only where rules need the content
        let safe = !matches!(
            self.refusal,
            Some(ArchiveError::TooLarge { .. } | ArchiveError::TooMany { .. })
        );
        for index in 0..zip.len() {
            let (name, skipped) = match zip.by_index_raw(index) {
                Ok(entry) => (
                    String::from_utf8_lossy(entry.name_raw()).into_owned(),
                    entry.encrypted() || entry.is_dir(),
                ),
                Err(_) => continue,
            };
            if skipped {
                continue;
            }
            let path = directory::path(&name);
            let mut unpacked = Vec::new();
            let read = if path == "modelDescription.xml" {
                copy(zip, index, MAX_DESCRIPTION_SIZE, &mut unpacked)
                    .map(|()| self.description = Some(unpacked))
            } else if path == "model.png" {
                copy(zip, index, MAX_ENTRY_SIZE, &mut unpacked).map(|()| self.icon = Some(unpacked))
            } else if path.starts_with("binaries/") {
                copy(zip, index, MAX_ENTRY_SIZE, &mut unpacked)
                    .map(|()| self.binaries.push((path, unpacked)))
            } else if safe {
                copy(zip, index, MAX_ENTRY_SIZE, &mut io::sink())
            } else {
                Ok(())
            };
            if let Err(why) = read {
                self.damaged.push((name, why));
            }
        }
    }

    /// The description as text, if it is UTF-8.
    #[must_use]
    pub fn text(&self) -> Option<&str> {
        let text = self.text.as_deref()?;
        Some(text.strip_prefix('\u{feff}').unwrap_or(text))
    }

    /// Whether there is a file of that name.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.directory.entries.iter().any(|entry| entry.path() == name)
    }

    /// Whether there is a folder of that name, as an entry or in the path of one.
    #[must_use]
    pub fn has_folder(&self, name: &str) -> bool {
        let inside = format!("{name}/");
        self.directory.entries.iter().any(|entry| entry.path().starts_with(&inside))
    }
}

/// Whether the FMU was made with fmi2-export.
pub(super) fn made_by_kit(text: &str) -> bool {
    text.contains("generationTool=\"fmi2-export ")
}

/// The hash of a resource, as the GUID depends on it.
fn hash(content: &[u8]) -> Uuid {
    Uuid::new_v5(&Uuid::NAMESPACE_OID, content)
}

/// Unpacks one entry up to a limit. The error is why it cannot be unpacked.
fn copy(
    zip: &mut ZipArchive<BufReader<File>>,
    index: usize,
    limit: u64,
    target: &mut impl io::Write,
) -> Result<(), String> {
    let entry = match zip.by_index(index) {
        Ok(entry) => entry,
        // a finding of `archive-compression` or `archive-encrypted`
        Err(ZipError::UnsupportedArchive(_) | ZipError::CompressionMethodNotSupported(_)) => {
            return Ok(());
        }
        Err(error) => return Err(error.to_string()),
    };
    let copied = io::copy(&mut entry.take(limit), target);
    copied.map(|_| ()).map_err(|error| {
        let source = error.source().map(|source| format!(": {source}")).unwrap_or_default();
        format!("{error}{source}")
    })
}
