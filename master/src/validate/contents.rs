//! The raw contents of an archive, read without judging them.

use std::fs::File;
use std::io::{self, BufReader, Read as _};
use std::path::{Path, PathBuf};

use thiserror::Error;
use zip::{CompressionMethod, ZipArchive};

use crate::archive::{Archive, MAX_DESCRIPTION_SIZE, MAX_ENTRY_SIZE};

/// The file cannot be read.
#[derive(Debug, Error)]
#[error("{path} cannot be read")]
pub struct Unreadable {
    /// The file.
    pub path: PathBuf,
    /// Why.
    #[source]
    pub source: io::Error,
}

/// One entry of the archive, as its directory names it.
pub struct Entry {
    /// Name, as it is.
    pub name: String,
    /// It is a symbolic link.
    pub link: bool,
    /// It is a folder.
    pub folder: bool,
    /// It is stored, or packed with Deflate.
    pub common_compression: bool,
}

/// A .fmu file taken apart.
#[derive(Default)]
pub struct Contents {
    /// Its entries; empty when it is no zip archive.
    pub entries: Vec<Entry>,
    /// Why it is no zip archive.
    pub damage: Option<String>,
    /// Why the importer refuses it.
    pub refusal: Option<String>,
    /// Entries that the archive's end says to have.
    pub declared_entries: Option<usize>,
    /// The bytes of modelDescription.xml.
    pub description: Option<Vec<u8>>,
    /// Files in `binaries/` with their bytes.
    pub binaries: Vec<(String, Vec<u8>)>,
}

impl Contents {
    /// Takes a file apart.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn read(path: &Path) -> Result<Self, Unreadable> {
        let unreadable = |source| Unreadable { path: path.to_owned(), source };
        let file = File::open(path).map_err(unreadable)?;
        if file.metadata().map_err(unreadable)?.is_dir() {
            return Err(unreadable(io::ErrorKind::IsADirectory.into()));
        }
        let refusal = Archive::open(path).and_then(|mut archive| archive.description()).err();
        let mut contents =
            Self { refusal: refusal.map(|error| error.to_string()), ..Self::default() };
        let mut zip = match ZipArchive::new(BufReader::new(file)) {
            Ok(zip) => zip,
            Err(error) => {
                contents.damage = Some(error.to_string());
                return Ok(contents);
            }
        };
        contents.declared_entries = declared_entries(path);
        for index in 0..zip.len() {
            let Ok(entry) = zip.by_index_raw(index) else { continue };
            let name = String::from_utf8_lossy(entry.name_raw()).into_owned();
            contents.entries.push(Entry {
                link: entry.is_symlink(),
                folder: entry.is_dir(),
                common_compression: matches!(
                    entry.compression(),
                    CompressionMethod::Stored | CompressionMethod::Deflated
                ),
                name,
            });
        }
        for (index, entry) in contents.entries.iter().enumerate() {
            let name = entry.name.replace('\\', "/");
            let name = name.strip_prefix("./").unwrap_or(&name);
            if name == "modelDescription.xml" {
                contents.description = bytes(&mut zip, index, MAX_DESCRIPTION_SIZE);
            } else if name.starts_with("binaries/") && !entry.folder {
                let content = bytes(&mut zip, index, MAX_ENTRY_SIZE).unwrap_or_default();
                contents.binaries.push((name.to_owned(), content));
            }
        }
        Ok(contents)
    }

    /// Whether a file of that name is there.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.entries.iter().any(|entry| entry.name == name)
    }
}

/// The bytes of one entry, if they can be unpacked within the limit.
fn bytes(zip: &mut ZipArchive<BufReader<File>>, index: usize, limit: u64) -> Option<Vec<u8>> {
    let mut content = Vec::new();
    let read = zip.by_index(index).ok()?.take(limit).read_to_end(&mut content);
    read.is_ok().then_some(content)
}

/// The number of entries in the end record, which counts doubled names too.
fn declared_entries(path: &Path) -> Option<usize> {
    const SIGNATURE: [u8; 4] = [b'P', b'K', 5, 6];
    let bytes = std::fs::read(path).ok()?;
    let at = bytes.windows(4).rposition(|window| window == SIGNATURE)?;
    let count = bytes.get(at + 10..at + 12)?;
    Some(usize::from(u16::from_le_bytes([count[0], count[1]])))
}
