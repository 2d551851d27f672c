//! The files of a system: in archives that are not trusted, or in the folder of an unpacked one.

use std::collections::HashMap;
use std::fmt;
use std::fs;
use std::io::{Cursor, Read, Seek};
use std::path::{Path, PathBuf, absolute};

use fmi2_import::archive::{FmuArchive, MAX_ENTRY_SIZE, text};
use percent_encoding::percent_decode_str;

use crate::SspError;
use crate::xml::MAX_SIZE;

/// Name of the description in an archive.
pub(crate) const DESCRIPTION: &str = "SystemStructure.ssd";

/// A file in one of the archives.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Name {
    /// The archive.
    container: usize,
    /// Its name there.
    name: String,
    /// For messages: archives that contain each other, and the name.
    label: String,
}

impl Name {
    /// For messages.
    pub(crate) fn label(&self) -> &str {
        &self.label
    }

    /// Its name without folders.
    pub(crate) fn last(&self) -> &str {
        self.name.rsplit('/').next().unwrap_or(&self.name)
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.label)
    }
}

/// Where a URI leads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Reference {
    /// A file, and the part of it after `#`, if there is one.
    File(Name, Option<String>),
    /// The element of the same file that has this identifier.
    Here(String),
}

/// The files of a system: those of its archive, and of archives inside.
pub(crate) struct Files {
    containers: Vec<Container>,
    /// Archives inside others that are open.
    inside: HashMap<Name, usize>,
}

struct Container {
    /// The archive, or the description of an unpacked one.
    path: PathBuf,
    place: Place,
    /// Stands in front of the names of its files: of their labels, and where they are unpacked to.
    prefixes: [String; 2],
}

enum Place {
    /// Names are checked: none leaves the archive.
    Archive(Box<dyn Archive>),
    /// The user's own files, as those beside a scenario: paths may leave the folder.
    Folder(PathBuf),
}

/// An archive in a file or in another archive.
trait Archive {
    fn read(&mut self, name: &str) -> Result<Option<Vec<u8>>, fmi2_import::archive::ArchiveError>;
    fn names(&self) -> Vec<String>;
    fn warnings(&self) -> &[String];
}

impl<R: Read + Seek> Archive for FmuArchive<R> {
    fn read(&mut self, name: &str) -> Result<Option<Vec<u8>>, fmi2_import::archive::ArchiveError> {
        self.read(name)
    }

    fn names(&self) -> Vec<String> {
        self.files().map(str::to_owned).collect()
    }

    fn warnings(&self) -> &[String] {
        self.warnings()
    }
}

impl Files {
    /// Opens an archive (.ssp), or the folder of a description (.ssd). Returns the name of the description.
    ///
    /// # Errors
    /// The archive cannot be read, or one of its entries is dangerous.
    pub(crate) fn open(path: &Path) -> Result<(Self, Name), SspError> {
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
        let outermost = Container { path: path.to_owned(), place, prefixes: Default::default() };
        let files = Self { containers: vec![outermost], inside: HashMap::new() };
        let name = files.name(0, description);
        Ok((files, name))
    }

    fn name(&self, container: usize, name: String) -> Name {
        let label = format!("{}{name}", self.containers[container].prefixes[0]);
        Name { container, name, label }
    }

    /// The file that a name without folders stands for in an archive inside another one.
    ///
    /// # Errors
    /// The archive does not exist or cannot be read.
    pub(crate) fn enter(
        &mut self,
        archive: &Name,
        description: &str,
        place: &str,
    ) -> Result<Name, SspError> {
        if let Some(&container) = self.inside.get(archive) {
            return Ok(self.name(container, description.to_owned()));
        }
        let path = PathBuf::from(&archive.label);
        let bytes = Cursor::new(self.read(archive, place)?);
        let opened = FmuArchive::new(bytes)
            .map_err(|source| SspError::Archive { path: path.clone(), source })?;
        let folder = format!("systems/{}_{}/", archive.last(), self.containers.len());
        let container = Container {
            path,
            place: Place::Archive(Box::new(opened)),
            prefixes: [format!("{}/", archive.label), folder],
        };
        self.containers.push(container);
        self.inside.insert(archive.clone(), self.containers.len() - 1);
        Ok(self.name(self.containers.len() - 1, description.to_owned()))
    }

    /// Defects of the archives that are tolerated.
    pub(crate) fn warnings(&self) -> impl Iterator<Item = &String> {
        self.containers.iter().flat_map(|it| match &it.place {
            Place::Archive(archive) => archive.warnings(),
            Place::Folder(_) => &[],
        })
    }

    /// Further descriptions at the top of the archive: variants.
    pub(crate) fn variants(&self) -> Vec<String> {
        match &self.containers[0].place {
            Place::Archive(archive) => {
                let is_variant = |it: &String| {
                    !it.contains('/')
                        && it.to_ascii_lowercase().ends_with(".ssd")
                        && it != DESCRIPTION
                };
                archive.names().into_iter().filter(is_variant).collect()
            }
            Place::Folder(_) => Vec::new(),
        }
    }

    /// The file beside another one that a URI refers to.
    ///
    /// # Errors
    /// The URI has a scheme or a fragment, or leaves the archive.
    pub(crate) fn resolve(&self, base: &Name, uri: &str, place: &str) -> Result<Name, SspError> {
        match self.follow(base, uri, place)? {
            Reference::File(name, None) => Ok(name),
            _ => Err(SspError::Uri {
                place: place.to_owned(),
                uri: uri.to_owned(),
                why: "only components refer to parts of a file",
            }),
        }
    }

    /// The file inside an archive's unit: the root of the unit is the base.
    ///
    /// # Errors
    /// As [`Files::resolve`].
    pub(crate) fn resolve_inside(&self, uri: &str, place: &str) -> Result<String, SspError> {
        let refuse = |why| SspError::Uri { place: place.to_owned(), uri: uri.to_owned(), why };
        if uri.contains('#') {
            return Err(refuse("only components refer to parts of a file"));
        }
        path(uri, "", false).map_err(refuse)
    }

    /// Where a URI leads from a file.
    ///
    /// # Errors
    /// The URI has a scheme, or leaves the archive.
    pub(crate) fn follow(
        &self,
        base: &Name,
        uri: &str,
        place: &str,
    ) -> Result<Reference, SspError> {
        let refuse = |why| SspError::Uri { place: place.to_owned(), uri: uri.to_owned(), why };
        let (file, fragment) = match uri.split_once('#') {
            Some((file, fragment)) => {
                let decoded = percent_decode_str(fragment).decode_utf8();
                let decoded = decoded.map_err(|_| refuse("it is not UTF-8"))?.into_owned();
                (file, Some(decoded))
            }
            None => (uri, None),
        };
        match (file, fragment) {
            ("", Some(fragment)) => Ok(Reference::Here(fragment)),
            (file, fragment) => {
                let may_leave = matches!(self.containers[base.container].place, Place::Folder(_));
                let name = path(file, &base.name, may_leave).map_err(refuse)?;
                Ok(Reference::File(self.name(base.container, name), fragment))
            }
        }
    }

    /// The content of a file.
    ///
    /// # Errors
    /// The file does not exist, is too large, or cannot be read.
    pub(crate) fn read(&mut self, name: &Name, place: &str) -> Result<Vec<u8>, SspError> {
        let missing = || SspError::Missing { place: place.to_owned(), name: name.to_string() };
        let container = &mut self.containers[name.container];
        match &mut container.place {
            Place::Archive(archive) => archive
                .read(&name.name)
                .map_err(|source| SspError::Archive { path: container.path.clone(), source })?
                .ok_or_else(missing),
            Place::Folder(folder) => {
                let path = folder.join(&name.name);
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
    pub(crate) fn text(&mut self, name: &Name, place: &str) -> Result<String, SspError> {
        xml_text(self.read(name, place)?, name.label())
    }

    /// Puts a file into `folder` if it is in an archive. Returns its path: relative to `folder`, or absolute if it stays
    /// where it is.
    ///
    /// # Errors
    /// The file does not exist, or cannot be written.
    pub(crate) fn place(
        &mut self,
        name: &Name,
        folder: &Path,
        place: &str,
    ) -> Result<PathBuf, SspError> {
        let container = &self.containers[name.container];
        if let Place::Folder(source) = &container.place {
            let path = source.join(&name.name);
            if !path.is_file() {
                return Err(SspError::Missing { place: place.to_owned(), name: name.to_string() });
            }
            return Ok(path);
        }
        let path = PathBuf::from(format!("{}{}", container.prefixes[1], name.name));
        let content = self.read(name, place)?;
        write(&folder.join(&path), &content)?;
        Ok(path)
    }
}

/// The name of the file that a URI without a fragment refers to, relative to the file `base`.
fn path(uri: &str, base: &str, may_leave: bool) -> Result<String, &'static str> {
    let head = uri.split(['/', '?']).next().unwrap_or_default();
    if head.contains(':') || uri.starts_with("//") {
        return Err("only relative URIs are supported");
    }
    if uri.starts_with('/') || uri.contains('\\') {
        return Err("it is not a relative URI");
    }
    let decoded = percent_decode_str(uri).decode_utf8().map_err(|_| "it is not UTF-8")?;
    if decoded.chars().any(char::is_control) || decoded.contains('\\') {
        return Err("it contains a control character or a backslash");
    }
    let folder = base.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in decoded.split('/') {
        match part {
            "" | "." => {}
            ".." => match parts.last() {
                Some(&last) if last != ".." => {
                    parts.pop();
                }
                _ if may_leave => parts.push(".."),
                _ => return Err("it leaves the archive"),
            },
            _ => parts.push(part),
        }
    }
    if parts.is_empty() { Err("it names no file") } else { Ok(parts.join("/")) }
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
