//! An FMU, unpacked into a temporary folder, with its description.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use percent_encoding::{AsciiSet, CONTROLS, utf8_percent_encode};
use thiserror::Error;

use crate::archive::{ArchiveError, FmuArchive};
use crate::cache::Cache;
use crate::description::{DescriptionError, Finding, ModelDescription, Severity};
use crate::scratch::Scratch;

/// Folder under `binaries/` for the system that this program runs on.
pub const PLATFORM: &str = if cfg!(target_os = "windows") {
    if cfg!(target_pointer_width = "64") { "win64" } else { "win32" }
} else if cfg!(target_os = "macos") {
    "darwin64"
} else if cfg!(target_pointer_width = "64") {
    "linux64"
} else {
    "linux32"
};

/// Ending of a binary's name on this system.
pub const BINARY_EXTENSION: &str = if cfg!(target_os = "windows") {
    "dll"
} else if cfg!(target_os = "macos") {
    "dylib"
} else {
    "so"
};

/// Folder of the reference results in an FMU (fmi-ls-ref).
pub const REFERENCE_RESULTS: &str = "extra/org.fmi-standard.fmi-ls-ref";

/// Characters that must be escaped in the path of a URI: all but `pchar` and `/` (RFC 3986).
const ESCAPED: &AsciiSet = &CONTROLS
    .add(b' ')
    .add(b'"')
    .add(b'#')
    .add(b'%')
    .add(b'<')
    .add(b'>')
    .add(b'?')
    .add(b'[')
    .add(b'\\')
    .add(b']')
    .add(b'^')
    .add(b'`')
    .add(b'{')
    .add(b'|')
    .add(b'}');

/// Why an FMU cannot be used.
#[derive(Debug, Error)]
pub enum PackageError {
    /// The archive cannot be used.
    #[error("{path} cannot be opened")]
    Archive {
        /// Path of the .fmu file, as it was given.
        path: PathBuf,
        /// What is wrong with the archive.
        #[source]
        source: ArchiveError,
    },
    /// The description cannot be used.
    #[error("{path} cannot be used")]
    Description {
        /// Path of the .fmu file, as it was given.
        path: PathBuf,
        /// What is wrong with modelDescription.xml.
        #[source]
        source: DescriptionError,
    },
    /// The temporary folder cannot be created.
    #[error("cannot create a temporary folder to unpack {path}")]
    Folder {
        /// Path of the .fmu file, as it was given.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
}

impl PackageError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Archive { source, .. } => return source.help(),
            Self::Description { source, .. } => match source {
                DescriptionError::Version(_) | DescriptionError::NoCoSimulation { .. } => {
                    "export it for co-simulation with FMI 2.0"
                }
                _ => "report it to its maker; `maglev validate` lists all errors",
            },
            Self::Folder { .. } => "set TMPDIR to a folder that is writable",
        })
    }
}

/// An unpacked FMU. Its folder is removed when this and the library in it are no longer used.
#[derive(Debug)]
pub struct Package {
    path: PathBuf,
    description: ModelDescription,
    files: Vec<String>,
    findings: Vec<Finding>,
    /// name of the binary's file for this system, whether or not it exists
    binary: String,
    folder: Folder,
}

/// Where an FMU is unpacked.
#[derive(Debug)]
enum Folder {
    /// In a temporary folder.
    Temporary(Arc<Scratch>),
    /// In a folder that somebody else has unpacked it to, and keeps.
    Given(PathBuf),
}

impl Folder {
    fn path(&self) -> &Path {
        match self {
            Self::Temporary(scratch) => scratch.path(),
            Self::Given(path) => path,
        }
    }
}

impl Package {
    /// Opens, checks and unpacks a .fmu file (binaries for this system, resources and reference results).
    ///
    /// # Errors
    /// The archive or its description cannot be used, or the temporary folder cannot be written.
    pub fn open(path: &Path) -> Result<Self, PackageError> {
        let archived = |source| PackageError::Archive { path: path.to_owned(), source };
        let mut archive = FmuArchive::open(path).map_err(archived)?;
        let text = archive.description().map_err(archived)?;
        let description = ModelDescription::parse(&text)
            .map_err(|source| PackageError::Description { path: path.to_owned(), source })?;
        let folder = Scratch::new()
            .map_err(|source| PackageError::Folder { path: path.to_owned(), source })?;
        let once = description.co_simulation.can_be_instantiated_only_once_per_process;
        unpack(path, &mut archive, folder.path(), !once).map_err(archived)?;
        // an FMU may write to its resources, even if the archive contains none
        let resources = folder.path().join("resources");
        std::fs::create_dir_all(&resources)
            .map_err(|source| archived(ArchiveError::Write { path: resources, source }))?;
        let files: Vec<String> = archive.files().map(str::to_owned).collect();
        let identifier = &description.co_simulation.model_identifier;
        let (binary, odd_name) = own_binary(&files, identifier);
        let folder = Folder::Temporary(Arc::new(folder));
        let findings = archive
            .warnings()
            .iter()
            .map(|message| Finding {
                rule: "archive",
                severity: Severity::Warning,
                message: message.clone(),
            })
            .chain(description.findings.iter().cloned())
            .chain(odd_name)
            .collect();
        Ok(Self { path: path.to_owned(), description, files, findings, binary, folder })
    }

    /// Opens an FMU that is already unpacked to a folder, which must stay as it is. Nothing is written.
    ///
    /// # Errors
    /// The folder cannot be read, or the description cannot be used.
    pub fn of_folder(path: &Path) -> Result<Self, PackageError> {
        let archived = |source| PackageError::Archive { path: path.to_owned(), source };
        let read = |source| archived(ArchiveError::Open(source));
        // an FMU may change the working directory
        let folder = std::path::absolute(path).map_err(read)?;
        let text = std::fs::read_to_string(folder.join("modelDescription.xml")).map_err(read)?;
        let description = ModelDescription::parse(&text)
            .map_err(|source| PackageError::Description { path: path.to_owned(), source })?;
        let mut files = Vec::new();
        list(&folder, "", &mut files).map_err(read)?;
        let identifier = &description.co_simulation.model_identifier;
        let (binary, odd_name) = own_binary(&files, identifier);
        let findings = description.findings.iter().cloned().chain(odd_name).collect();
        let folder = Folder::Given(folder);
        Ok(Self { path: path.to_owned(), description, files, findings, binary, folder })
    }

    /// Reads the description of a .fmu file without unpacking it.
    ///
    /// # Errors
    /// The archive or its description cannot be used.
    pub fn describe(path: &Path) -> Result<ModelDescription, PackageError> {
        let archived = |source| PackageError::Archive { path: path.to_owned(), source };
        let text = FmuArchive::open(path).and_then(|mut it| it.description()).map_err(archived)?;
        ModelDescription::parse(&text)
            .map_err(|source| PackageError::Description { path: path.to_owned(), source })
    }

    /// The unit with another description, which its library printed for changed resources.
    ///
    /// # Errors
    /// The description cannot be used.
    pub fn with_description(mut self, text: &str) -> Result<Self, PackageError> {
        let description = ModelDescription::parse(text)
            .map_err(|source| PackageError::Description { path: self.path.clone(), source })?;
        self.findings.retain(|finding| !self.description.findings.contains(finding));
        self.findings.extend(description.findings.iter().cloned());
        self.description = description;
        Ok(self)
    }

    /// Path of the .fmu file that this package was opened from.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder that it was unpacked to.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The temporary folder, if it was unpacked to one.
    pub(crate) fn scratch(&self) -> Option<Arc<Scratch>> {
        match &self.folder {
            Folder::Temporary(scratch) => Some(Arc::clone(scratch)),
            Folder::Given(_) => None,
        }
    }

    /// Contents of modelDescription.xml.
    #[must_use]
    pub fn description(&self) -> &ModelDescription {
        &self.description
    }

    /// All files in the archive.
    #[must_use]
    pub fn files(&self) -> &[String] {
        &self.files
    }

    /// Defects that were tolerated while opening.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Path of the binary for this system, whether or not it exists: the one with the name of the
    /// modelIdentifier, or the only one.
    #[must_use]
    pub fn binary(&self) -> PathBuf {
        self.folder.path().join("binaries").join(PLATFORM).join(&self.binary)
    }

    /// Names of the systems for which the archive contains a usable binary.
    #[must_use]
    pub fn platforms(&self) -> Vec<&str> {
        let identifier = &self.description.co_simulation.model_identifier;
        let mut platforms: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for (platform, name) in binaries(&self.files) {
            let Some((stem, end)) = name.rsplit_once('.') else { continue };
            if ["so", "dll", "dylib"].contains(&end) {
                platforms.entry(platform).or_default().push(stem);
            }
        }
        platforms.retain(|_, stems| stems.len() == 1 || stems.contains(&identifier.as_str()));
        platforms.into_keys().collect()
    }

    /// What the archive contains instead of a binary for this system, for messages.
    pub(crate) fn offer(&self) -> String {
        let here = libraries(&self.files);
        if here.len() > 1 {
            return format!(
                "binaries/{PLATFORM} contains {}, but none is named after the modelIdentifier",
                here.join(", ")
            );
        }
        let platforms = self.platforms();
        if !platforms.is_empty() {
            return format!("it has binaries for {}", platforms.join(", "));
        }
        let binaries: Vec<&str> = self
            .files
            .iter()
            .map(String::as_str)
            .filter(|file| file.starts_with("binaries/"))
            .take(5)
            .collect();
        if !binaries.is_empty() {
            return format!("it has {}", binaries.join(", "));
        }
        if self.files.iter().any(|file| file.starts_with("sources/")) {
            return "it contains only source code (sources/), which must be compiled first"
                .to_owned();
        }
        "it contains no binaries".to_owned()
    }

    /// URI of the unpacked resources, as instances get it.
    #[must_use]
    pub fn resource_location(&self) -> String {
        file_uri(&self.resources())
    }

    /// Folder of the unpacked resources; it is empty if there are none.
    #[must_use]
    pub fn resources(&self) -> PathBuf {
        self.folder.path().join("resources")
    }
}

/// Unpacks binaries for this system, resources and reference results, or takes them from the cache. Libraries may be
/// `linked` to the cache if it does not matter that two packages then load the same one.
fn unpack(
    path: &Path,
    archive: &mut FmuArchive<BufReader<File>>,
    folder: &Path,
    linked: bool,
) -> Result<(), ArchiveError> {
    let binaries = format!("binaries/{PLATFORM}/");
    let wanted = |name: &str| {
        name.starts_with(&binaries)
            || name.starts_with("resources/")
            || name.starts_with(REFERENCE_RESULTS)
    };
    let cache = Cache::of_user();
    // without a cache, or if it cannot be used, the archive is unpacked
    let slot = cache.map(|cache| cache.slot(path, archive.entries(wanted), linked));
    let slot = slot.and_then(Result::ok).flatten();
    let Some(slot) = slot else { return archive.unpack(folder, wanted) };
    if slot.fill(folder).is_ok() {
        return archive.make_folders(folder, wanted);
    }
    let failed = |source| ArchiveError::Write { path: folder.to_owned(), source };
    for left in std::fs::read_dir(folder).map_err(failed)?.flatten() {
        std::fs::remove_dir_all(left.path()).map_err(failed)?;
    }
    archive.unpack(folder, wanted)?;
    // nothing depends on it
    let _ = slot.keep(folder);
    Ok(())
}

/// The files in a folder, by their paths in the FMU.
fn list(folder: &Path, prefix: &str, files: &mut Vec<String>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            list(&entry.path(), &format!("{name}/"), files)?;
        } else {
            files.push(name);
        }
    }
    files.sort_unstable();
    Ok(())
}

/// System and name of the files directly in a subfolder of `binaries`.
fn binaries(files: &[String]) -> impl Iterator<Item = (&str, &str)> {
    files
        .iter()
        .filter_map(|file| file.strip_prefix("binaries/")?.split_once('/'))
        .filter(|(_, name)| !name.contains('/'))
}

/// Names of all libraries for this system.
fn libraries(files: &[String]) -> Vec<&str> {
    binaries(files)
        .filter(|(platform, _)| *platform == PLATFORM)
        .map(|(_, name)| name)
        .filter(|name| name.rsplit_once('.').is_some_and(|(_, end)| end == BINARY_EXTENSION))
        .collect()
}

/// Name of the binary to load on this system, and a finding if it is not the right name.
fn own_binary(files: &[String], identifier: &str) -> (String, Option<Finding>) {
    let right = format!("{identifier}.{BINARY_EXTENSION}");
    match libraries(files)[..] {
        [only] if only != right => {
            let message = format!(
                "binaries/{PLATFORM}/{only} should be named {right} after the modelIdentifier; it is \
                 loaded because it is the only binary for this system"
            );
            let severity = Severity::Warning;
            (only.to_owned(), Some(Finding { rule: "binary-name", severity, message }))
        }
        _ => (right, None),
    }
}

/// A path as a URI with the scheme `file`.
#[must_use]
pub fn file_uri(path: &Path) -> String {
    let text = path.to_string_lossy().replace('\\', "/");
    let slash = if text.starts_with('/') { "" } else { "/" };
    format!("file://{slash}{}", utf8_percent_encode(&text, ESCAPED))
}
