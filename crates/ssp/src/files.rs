//! The files of a system: in an archive that is not trusted, or in the folder of an unpacked one.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf, absolute};

use fmi2_import::archive::{FmuArchive, MAX_ENTRY_SIZE, text};
use percent_encoding::percent_decode_str;

use crate::SspError;
use crate::xml::MAX_SIZE;

/// Name of the description in an archive.
pub(crate) const DESCRIPTION: &str = "SystemStructure.ssd";

/// The files of a system.
pub(crate) struct Files {
    path: PathBuf,
    place: Place,
    /// Name of the description.
    description: String,
}

enum Place {
    /// Names are checked: none leaves the archive.
    Archive(Box<FmuArchive<BufReader<File>>>),
    /// The user's own files, as those beside a scenario: paths may leave the folder.
    Folder(PathBuf),
}

impl Files {
    /// Opens an archive (.ssp), or the folder of a description (.ssd).
    ///
    /// # Errors
    /// The archive cannot be read, or one of its entries is dangerous.
    pub(crate) fn open(path: &Path) -> Result<Self, SspError> {
        let unpacked = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("ssd"));
        let (place, description) = if unpacked {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            (Place::Folder(absolute(&folder).unwrap_or(folder)), name)
        } else {
            let archive = FmuArchive::open(path)
                .map_err(|source| SspError::Archive { path: path.to_owned(), source })?;
            (Place::Archive(Box::new(archive)), DESCRIPTION.to_owned())
        };
        Ok(Self { path: path.to_owned(), place, description })
    }

    /// Name of the description.
    pub(crate) fn description(&self) -> &str {
        &self.description
    }

    /// Defects of the archive that are tolerated.
    pub(crate) fn warnings(&self) -> &[String] {
        match &self.place {
            Place::Archive(archive) => archive.warnings(),
            Place::Folder(_) => &[],
        }
    }

    /// The name of the file that a URI refers to, relative to the file `base`.
    ///
    /// # Errors
    /// The URI has a scheme or a fragment, or leaves the archive.
    pub(crate) fn resolve(&self, base: &str, uri: &str, place: &str) -> Result<String, SspError> {
        let refuse = |why| SspError::Uri { place: place.to_owned(), uri: uri.to_owned(), why };
        if uri.contains('#') {
            return Err(refuse("references to another description or system are not supported"));
        }
        let head = uri.split(['/', '?']).next().unwrap_or_default();
        if head.contains(':') || uri.starts_with("//") {
            return Err(refuse("only relative URIs are supported"));
        }
        if uri.starts_with('/') || uri.contains('\\') {
            return Err(refuse("it is not a relative URI"));
        }
        let decoded = percent_decode_str(uri).decode_utf8();
        let decoded = decoded.map_err(|_| refuse("it is not UTF-8"))?;
        if decoded.chars().any(char::is_control) || decoded.contains('\\') {
            return Err(refuse("it contains a control character or a backslash"));
        }
        let folder = base.rsplit_once('/').map_or("", |(folder, _)| folder);
        let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
        for part in decoded.split('/') {
            match part {
                "" | "." => {}
                ".." => match (parts.last(), &self.place) {
                    (Some(&last), _) if last != ".." => {
                        parts.pop();
                    }
                    (_, Place::Folder(_)) => parts.push(".."),
                    (_, Place::Archive(_)) => return Err(refuse("it leaves the archive")),
                },
                _ => parts.push(part),
            }
        }
        if parts.is_empty() { Err(refuse("it names no file")) } else { Ok(parts.join("/")) }
    }

    /// The content of a file.
    ///
    /// # Errors
    /// The file does not exist, is too large, or cannot be read.
    pub(crate) fn read(&mut self, name: &str, place: &str) -> Result<Vec<u8>, SspError> {
        let missing = || SspError::Missing { place: place.to_owned(), name: name.to_owned() };
        match &mut self.place {
            Place::Archive(archive) => archive
                .read(name)
                .map_err(|source| SspError::Archive { path: self.path.clone(), source })?
                .ok_or_else(missing),
            Place::Folder(folder) => {
                let path = folder.join(name);
                let size = path.metadata().map_err(|_| missing())?.len();
                if size > MAX_ENTRY_SIZE {
                    let source = std::io::Error::other("the file is larger than 1 GiB");
                    return Err(SspError::Read { path, source });
                }
                fs::read(&path).map_err(|source| SspError::Read { path, source })
            }
        }
    }

    /// The text of an XML file.
    ///
    /// # Errors
    /// As [`Files::read`], or it is too large or in another encoding than UTF-8 or ISO 8859-1.
    pub(crate) fn text(&mut self, name: &str, place: &str) -> Result<String, SspError> {
        xml_text(self.read(name, place)?, name)
    }

    /// Puts a file into `folder` if it is in an archive. Returns its path: relative to `folder`, or absolute if it stays
    /// where it is.
    ///
    /// # Errors
    /// The file does not exist, or cannot be written.
    pub(crate) fn place(
        &mut self,
        name: &str,
        folder: &Path,
        place: &str,
    ) -> Result<PathBuf, SspError> {
        if let Place::Folder(source) = &self.place {
            let path = source.join(name);
            if !path.is_file() {
                return Err(SspError::Missing { place: place.to_owned(), name: name.to_owned() });
            }
            return Ok(path);
        }
        let content = self.read(name, place)?;
        write(&folder.join(name), &content)?;
        Ok(name.into())
    }
}

/// Writes a file and the folders above it.
///
/// # Errors
/// It cannot be written.
pub(crate) fn write(path: &Path, content: &[u8]) -> Result<(), SspError> {
    let failed = |source| SspError::Write { path: path.to_owned(), source };
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent).map_err(failed)?;
    }
    results::write_whole(path, content).map_err(failed)
}

/// The text of an XML file.
///
/// # Errors
/// It is too large or in another encoding than UTF-8 or ISO 8859-1.
pub(crate) fn xml_text(bytes: Vec<u8>, name: &str) -> Result<String, SspError> {
    let failed = |message: String| SspError::Xml { file: name.to_owned(), message };
    if bytes.len() > MAX_SIZE {
        return Err(failed(format!("it is larger than {MAX_SIZE} bytes")));
    }
    let (text, _) =
        text(bytes).map_err(|_| failed("it is neither UTF-8 nor ISO 8859-1 text".to_owned()))?;
    // roxmltree takes the text as it is, also after a byte order mark
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}
