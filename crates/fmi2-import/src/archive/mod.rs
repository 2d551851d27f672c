//! Reading an FMU's archive (.fmu, a zip file) without trusting it.
//!
//! Every entry's name is checked before anything is written: no `..`, no absolute names, no drive letters,
//! no links, no duplicate names. Number and sizes of the entries are limited, and sizes are counted while
//! reading, since headers may be wrong. Common mistakes of exporters are tolerated: `./` in front, `\`
//! instead of `/`, missing directory entries.

mod error;
mod name;
mod text;

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::Path;

use zip::ZipArchive;

pub use self::error::ArchiveError;
use self::name::safe_name;
pub use self::text::text;

/// Largest number of entries in an archive.
pub(crate) const MAX_ENTRIES: usize = 20_000;
/// Largest unpacked size of one entry, in bytes.
pub const MAX_ENTRY_SIZE: u64 = 1 << 30;
/// Largest unpacked size of all entries together, in bytes.
const MAX_TOTAL_SIZE: u64 = 4 << 30;
/// Largest ratio of unpacked to packed size of an entry above [`RATIO_FREE_SIZE`].
/// Deflate cannot exceed 1032. Ordinary data stay below 100, and long runs of zeros reach the limit.
const MAX_RATIO: u64 = 500;
/// Entries up to this unpacked size may have any ratio, in bytes.
const RATIO_FREE_SIZE: u64 = 16 << 20;
/// Largest modelDescription.xml, in bytes.
pub const MAX_DESCRIPTION_SIZE: u64 = 64 << 20;

/// A file in an archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Entry {
    /// Checked name, with forward slashes.
    pub name: String,
    /// Unpacked size in bytes.
    pub size: u64,
    /// CRC-32 of the unpacked content.
    pub crc: u32,
}

/// An opened archive whose entry names have all been checked.
pub struct FmuArchive<R> {
    zip: ZipArchive<R>,
    /// checked name of each entry in zip order; `None` for folders
    names: Vec<Option<String>>,
    /// unpacked size and CRC-32 of each entry, as its header says
    checks: Vec<(u64, u32)>,
    /// checked names of the folders that have an entry of their own
    folders: Vec<String>,
    /// tolerated defects
    warnings: Vec<String>,
}

impl FmuArchive<BufReader<File>> {
    /// Opens the archive at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is no zip archive, or an entry is unacceptable.
    pub fn open(path: &Path) -> Result<Self, ArchiveError> {
        let file = File::open(path).map_err(ArchiveError::Open)?;
        // a folder can be opened like a file and would be reported as a damaged archive
        if file.metadata().is_ok_and(|it| it.is_dir()) {
            return Err(ArchiveError::Open(io::ErrorKind::IsADirectory.into()));
        }
        Self::new(BufReader::new(file))
    }
}

impl<R: Read + Seek> FmuArchive<R> {
    /// Reads the directory of the archive and checks every entry.
    ///
    /// # Errors
    /// No zip archive, or an unacceptable entry.
    pub fn new(reader: R) -> Result<Self, ArchiveError> {
        let mut zip = ZipArchive::new(reader).map_err(ArchiveError::Zip)?;
        if zip.len() > MAX_ENTRIES {
            return Err(ArchiveError::TooMany { count: zip.len() });
        }
        let mut names = Vec::with_capacity(zip.len());
        let mut checks = Vec::with_capacity(zip.len());
        let mut seen = HashSet::with_capacity(zip.len());
        let (mut folders, mut warnings) = (Vec::new(), Vec::new());
        let mut total = 0_u64;
        for index in 0..zip.len() {
            let entry = zip.by_index_raw(index).map_err(ArchiveError::Zip)?;
            let raw = entry.name().map_err(ArchiveError::Zip)?.into_owned();
            if entry.is_symlink() {
                return Err(ArchiveError::Link { name: raw });
            }
            let name = safe_name(&raw, &mut warnings)?;
            let size = entry.size();
            checks.push((size, entry.crc32()));
            let ratio_limit = entry.compressed_size().saturating_mul(MAX_RATIO);
            let limit = MAX_ENTRY_SIZE.min(ratio_limit.max(RATIO_FREE_SIZE));
            if size > limit {
                return Err(ArchiveError::TooLarge { name: raw, limit });
            }
            total = total.saturating_add(size);
            if total > MAX_TOTAL_SIZE {
                return Err(ArchiveError::TooLarge { name: raw, limit: MAX_TOTAL_SIZE });
            }
            if let Some(name) = &name
                && !entry.is_dir()
                && !seen.insert(name.clone())
            {
                return Err(ArchiveError::Duplicate { name: raw });
            }
            if entry.is_dir() {
                folders.extend(name);
                names.push(None);
            } else {
                names.push(name);
            }
        }
        Ok(Self { zip, names, checks, folders, warnings })
    }

    /// Names of all files, checked and with forward slashes.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.names.iter().flatten().map(String::as_str)
    }

    /// The files whose name `wanted` accepts.
    pub(crate) fn entries(&self, wanted: impl Fn(&str) -> bool) -> Vec<Entry> {
        let entries = self.names.iter().zip(&self.checks);
        entries
            .filter_map(|(name, &(size, crc))| {
                let name = name.clone().filter(|name| wanted(name))?;
                Some(Entry { name, size, crc })
            })
            .collect()
    }

    /// Tolerated defects.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The text of modelDescription.xml. It should be UTF-8; ISO 8859-1, which some exporters write, is
    /// tolerated.
    ///
    /// # Errors
    /// It is missing, too large, damaged, or in another encoding.
    pub fn description(&mut self) -> Result<String, ArchiveError> {
        let name = "modelDescription.xml";
        let index = self.index(name).ok_or_else(|| {
            let similar = self.files().find(|file| {
                file.rsplit('/').next().is_some_and(|last| last.eq_ignore_ascii_case(name))
            });
            ArchiveError::NoDescription { similar: similar.map(str::to_owned) }
        })?;
        let mut bytes = Vec::new();
        self.copy(index, name, MAX_DESCRIPTION_SIZE, &mut bytes)?;
        let (text, latin) = text(bytes)?;
        if latin {
            self.warnings
                .push("modelDescription.xml is written in ISO 8859-1, not UTF-8".to_owned());
        }
        Ok(text)
    }

    /// The bytes of one file, if the archive has it.
    ///
    /// # Errors
    /// The entry is damaged or larger than its header says.
    pub fn read(&mut self, name: &str) -> Result<Option<Vec<u8>>, ArchiveError> {
        let Some(index) = self.index(name) else { return Ok(None) };
        let mut bytes = Vec::new();
        self.copy(index, name, MAX_ENTRY_SIZE, &mut bytes)?;
        Ok(Some(bytes))
    }

    /// Unpacks the files whose name `wanted` accepts, and creates the folders whose name with a slash at
    /// its end `wanted` accepts, even if they are empty.
    ///
    /// # Errors
    /// An entry is damaged, or the folder cannot be written.
    pub fn unpack(
        &mut self,
        folder: &Path,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<(), ArchiveError> {
        for index in 0..self.names.len() {
            let Some(name) = self.names[index].clone().filter(|name| wanted(name)) else {
                continue;
            };
            let path = folder.join(&name);
            let failed = |source| ArchiveError::Write { path: path.clone(), source };
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent).map_err(failed)?;
            }
            // create_new: a name that differs only in case must not overwrite another file
            let mut file = File::create_new(&path).map_err(failed)?;
            self.copy(index, &name, MAX_ENTRY_SIZE, &mut file)?;
        }
        self.make_folders(folder, wanted)
    }

    /// Creates the folders whose name with a slash at its end `wanted` accepts.
    pub(crate) fn make_folders(
        &self,
        folder: &Path,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<(), ArchiveError> {
        for name in self.folders.iter().filter(|name| wanted(&format!("{name}/"))) {
            let path = folder.join(name);
            fs::create_dir_all(&path).map_err(|source| ArchiveError::Write { path, source })?;
        }
        Ok(())
    }

    fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|entry| entry.as_deref() == Some(name))
    }

    fn copy(
        &mut self,
        index: usize,
        name: &str,
        limit: u64,
        target: &mut impl Write,
    ) -> Result<(), ArchiveError> {
        let entry = self.zip.by_index(index).map_err(|error| ArchiveError::Entry {
            name: name.to_owned(),
            source: io::Error::other(error),
        })?;
        // the size in the header has been checked; the contents must not exceed it
        let limit = limit.min(entry.size());
        let mut reader = entry.take(limit + 1);
        let copied = io::copy(&mut reader, target)
            .map_err(|source| ArchiveError::Entry { name: name.to_owned(), source })?;
        if copied > limit {
            return Err(ArchiveError::TooLarge { name: name.to_owned(), limit });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Cursor;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    fn packed(entries: &[(&str, &[u8])]) -> Vec<u8> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in entries {
            writer.start_file(*name, SimpleFileOptions::default()).unwrap();
            writer.write_all(bytes).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn open(entries: &[(&str, &[u8])]) -> Result<FmuArchive<Cursor<Vec<u8>>>, ArchiveError> {
        FmuArchive::new(Cursor::new(packed(entries)))
    }

    #[test]
    fn invariant_unpacks_what_was_packed() {
        let mut archive = open(&[
            ("modelDescription.xml", b"<x/>"),
            ("resources/a b.json", b"{}"),
            ("documentation/index.html", b"no"),
        ])
        .unwrap();
        assert_eq!(archive.description().unwrap(), "<x/>");
        let folder = tempfile::tempdir().unwrap();
        archive.unpack(folder.path(), |name| name.starts_with("resources/")).unwrap();
        assert_eq!(fs::read(folder.path().join("resources/a b.json")).unwrap(), b"{}");
        assert!(!folder.path().join("documentation").exists());
    }

    #[test]
    fn issue_empty_folders_are_made() {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for name in ["resources/", "resources/cache/deep/", "documentation/"] {
            writer.add_directory(name, SimpleFileOptions::default()).unwrap();
        }
        let bytes = writer.finish().unwrap().into_inner();
        let mut archive = FmuArchive::new(Cursor::new(bytes)).unwrap();
        assert_eq!(archive.files().count(), 0);
        let folder = tempfile::tempdir().unwrap();
        archive.unpack(folder.path(), |name| name.starts_with("resources/")).unwrap();
        assert!(folder.path().join("resources/cache/deep").is_dir());
        assert!(!folder.path().join("documentation").exists());
    }

    #[test]
    fn issue_names_that_leave_the_folder_are_refused() {
        for name in ["../x", "a/../../x", "/etc/passwd", "C:/x", "a\\..\\..\\x", "\\x"] {
            let error = open(&[(name, b"1")]).err().unwrap();
            assert!(matches!(error, ArchiveError::UnsafeName { .. }), "{name}: {error}");
        }
    }

    #[test]
    fn issue_dots_and_backslashes_are_tolerated_with_a_warning() {
        let mut archive =
            open(&[("./modelDescription.xml", b"<x/>"), ("resources\\y", b"2")]).unwrap();
        assert_eq!(archive.description().unwrap(), "<x/>");
        assert_eq!(archive.read("resources/y").unwrap().unwrap(), b"2");
        assert_eq!(archive.warnings().len(), 2);
    }

    #[test]
    fn issue_links_are_refused() {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        writer.add_symlink("resources/link", "/etc/passwd", SimpleFileOptions::default()).unwrap();
        let bytes = writer.finish().unwrap().into_inner();
        assert!(matches!(FmuArchive::new(Cursor::new(bytes)), Err(ArchiveError::Link { .. })));
    }

    #[test]
    fn issue_duplicate_names_are_refused() {
        let result = open(&[("a/b", b"1"), ("a\\b", b"2")]);
        assert!(matches!(result, Err(ArchiveError::Duplicate { .. })));
    }

    #[test]
    fn issue_a_bomb_is_refused() {
        let zeros = vec![0_u8; 64 << 20];
        let result = open(&[("resources/zeros", &zeros)]);
        assert!(matches!(result, Err(ArchiveError::TooLarge { .. })));
    }

    #[test]
    fn issue_a_missing_description_is_reported_with_a_similar_name() {
        let error =
            open(&[("x/modelDescription.xml", b"<x/>")]).unwrap().description().unwrap_err();
        assert!(error.to_string().ends_with("but \"x/modelDescription.xml\""), "{error}");
    }

    #[test]
    fn issue_latin_1_is_read_with_a_warning() {
        let text = |head: &str| [head.as_bytes(), b"<x a=\"\xfc\"/>"].concat();
        let latin = text("<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>");
        let mut archive = open(&[("modelDescription.xml", &latin)]).unwrap();
        assert!(archive.description().unwrap().ends_with("<x a=\"ü\"/>"));
        assert_eq!(archive.warnings().len(), 1);
        let result = open(&[("modelDescription.xml", &text(""))]).unwrap().description();
        assert!(matches!(result, Err(ArchiveError::NotText)));
    }

    #[test]
    fn issue_too_many_entries_are_refused() {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for k in 0..=MAX_ENTRIES {
            writer.start_file(k.to_string(), SimpleFileOptions::default()).unwrap();
        }
        let bytes = writer.finish().unwrap().into_inner();
        assert!(matches!(FmuArchive::new(Cursor::new(bytes)), Err(ArchiveError::TooMany { .. })));
    }

    fn read_all(bytes: Vec<u8>) {
        if let Ok(mut archive) = FmuArchive::new(Cursor::new(bytes)) {
            let names: Vec<String> = archive.files().map(str::to_owned).collect();
            let _ = archive.description();
            for name in names {
                let _ = archive.read(&name);
            }
        }
    }

    proptest! {
        #[test]
        fn invariant_random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            read_all(bytes);
        }

        #[test]
        fn invariant_damaged_archives_never_panic(
            at in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)
        ) {
            let mut bytes =
                packed(&[("modelDescription.xml", b"<x>hello hello</x>"), ("resources/r", b"123")]);
            for (index, value) in at {
                let index = index.index(bytes.len());
                bytes[index] = value;
            }
            read_all(bytes);
        }
    }
}
