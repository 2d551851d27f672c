//! The archive: collects a unit's files and writes them as a zip.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Cursor, Read as _, Write as _};
use std::path::Path;

use zip::{ZipArchive, ZipWriter, write::SimpleFileOptions};

use crate::Error;

/// The files of one unit.
#[derive(Debug, Clone)]
pub struct Archive {
    identifier: String,
    files: BTreeMap<String, Vec<u8>>,
}

impl Archive {
    /// An archive that holds only `modelDescription.xml`.
    ///
    /// # Errors
    /// The text is not the description of a co-simulation unit.
    pub fn new(description: &str) -> Result<Self, Error> {
        let document = roxmltree::Document::parse(description)
            .map_err(|error| Error::Description(error.to_string()))?;
        let identifier = document
            .descendants()
            .find(|node| node.has_tag_name("CoSimulation"))
            .and_then(|node| node.attribute("modelIdentifier"))
            .ok_or_else(|| Error::Description("CoSimulation has no modelIdentifier".into()))?
            .to_owned();
        let description = ("modelDescription.xml".to_owned(), description.as_bytes().to_vec());
        Ok(Self { identifier, files: BTreeMap::from([description]) })
    }

    /// Reads an existing .fmu.
    ///
    /// # Errors
    /// The file cannot be read, or is not an FMU.
    pub fn open(file: &Path) -> Result<Self, Error> {
        let mut zip = ZipArchive::new(Cursor::new(fs::read(file).map_err(Error::at(file))?))?;
        let mut files = BTreeMap::new();
        for index in 0..zip.len() {
            let mut entry = zip.by_index(index)?;
            let name = entry.name()?.into_owned();
            if name.ends_with('/') {
                continue;
            }
            let mut content = Vec::new();
            entry.read_to_end(&mut content).map_err(Error::at(&name))?;
            files.insert(name, content);
        }
        let description = files.get("modelDescription.xml").map(Vec::as_slice).unwrap_or_default();
        let mut archive = Self::new(&String::from_utf8_lossy(description))?;
        for (name, content) in files {
            archive.file(&name, content)?;
        }
        Ok(archive)
    }

    /// The files, sorted by name.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.files.iter().map(|(name, content)| (name.as_str(), content.as_slice()))
    }

    /// The model identifier, which names the binaries.
    #[must_use]
    pub fn identifier(&self) -> &str {
        &self.identifier
    }

    /// Adds the library for a platform ([`platform`](crate::platform)), under the name that FMI
    /// prescribes.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn binary(&mut self, platform: &str, library: &Path) -> Result<&mut Self, Error> {
        let content = fs::read(library).map_err(Error::at(library))?;
        let extension = match platform.split_once(|c: char| !c.is_alphabetic()) {
            Some(("win", _)) => "dll",
            Some(("darwin", _)) => "dylib",
            _ if platform.ends_with("-darwin") => "dylib",
            _ if platform.ends_with("-windows") => "dll",
            _ => "so",
        };
        let name = format!("binaries/{platform}/{}.{extension}", self.identifier);
        self.file(&name, content)
    }

    /// Adds a folder with all its files as the folder `under`.
    ///
    /// # Errors
    /// A file cannot be read, or its name is not portable in archives.
    pub fn folder(&mut self, under: &str, folder: &Path) -> Result<&mut Self, Error> {
        for entry in fs::read_dir(folder).map_err(Error::at(folder))? {
            let path = entry.map_err(Error::at(folder))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let name = format!("{under}/{name}");
            if path.is_dir() {
                self.folder(&name, &path)?;
            } else {
                self.file(&name, fs::read(&path).map_err(Error::at(&path))?)?;
            }
        }
        Ok(self)
    }

    /// Adds one file, or replaces it.
    ///
    /// # Errors
    /// The name is not portable in archives.
    pub fn file(&mut self, name: &str, content: impl Into<Vec<u8>>) -> Result<&mut Self, Error> {
        if name.is_empty() || name.contains('\\') || name.chars().any(|c| !(' '..='~').contains(&c))
        {
            return Err(Error::Name(name.into()));
        }
        self.files.insert(name.to_owned(), content.into());
        Ok(self)
    }

    /// The archive's bytes. Files are sorted and have no times, so the same files give the same
    /// bytes.
    ///
    /// # Errors
    /// The archive would become too large for its format.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        let options = SimpleFileOptions::default()
            .unix_permissions(0o644)
            .last_modified_time(zip::DateTime::default());
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, content) in &self.files {
            zip.start_file(name.as_str(), options)?;
            zip.write_all(content).map_err(Error::at(name))?;
        }
        Ok(zip.finish()?.into_inner())
    }

    /// Writes the archive: the file appears complete or not at all. It replaces a regular file only.
    ///
    /// # Errors
    /// The file cannot be written, or is a device or a folder.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        if fs::metadata(file).is_ok_and(|found| !found.is_file()) {
            let text = "it exists and is not a regular file";
            return Err(Error::at(file)(io::Error::new(io::ErrorKind::InvalidInput, text)));
        }
        let bytes = self.to_bytes()?;
        // Renamed at the end, so that a run that starts in between never reads an incomplete unit.
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let partial = file.with_file_name(format!(".{name}.partial"));
        let written = fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, file));
        if written.is_err() {
            // half a file is of no use; if it cannot be removed, there is nothing else to do
            let _ = fs::remove_file(&partial);
        }
        written.map_err(Error::at(file))
    }
}
