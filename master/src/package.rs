//! A unit on disk: the .fmu file unpacked into a folder of its own, its description read.

use std::path::{Path, PathBuf};

use percent_encoding::{AsciiSet, CONTROLS, utf8_percent_encode};
use thiserror::Error;

use crate::archive::{Archive, ArchiveError};
use crate::description::{Description, DescriptionError, Finding, Severity};
use crate::scratch::Scratch;
use crate::validate;

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

/// Characters that a path in a URI must not hold as they are (RFC 3986, `pchar` and `/` may).
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

/// Why a .fmu file cannot be used.
#[derive(Debug, Error)]
pub enum PackageError {
    /// The archive is unusable.
    #[error("{path} cannot be opened")]
    Archive {
        /// The .fmu file.
        path: PathBuf,
        /// Why.
        #[source]
        source: ArchiveError,
    },
    /// The description is unusable.
    #[error("{path} cannot be used")]
    Description {
        /// The .fmu file.
        path: PathBuf,
        /// Why.
        #[source]
        source: DescriptionError,
    },
    /// Defects, where none are tolerated.
    #[error(
        "{path} has {} that a strict run does not tolerate: {}",
        if findings.len() == 1 { "a defect".to_owned() } else { format!("{} defects", findings.len()) },
        findings.join("; ")
    )]
    Defects {
        /// The .fmu file.
        path: PathBuf,
        /// What was found.
        findings: Vec<String>,
    },
    /// No temporary folder.
    #[error("cannot make a temporary folder to unpack {path}")]
    Folder {
        /// The .fmu file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
}

/// An unpacked unit. Its folder is removed when this is dropped.
#[derive(Debug)]
pub struct Package {
    path: PathBuf,
    description: Description,
    files: Vec<String>,
    findings: Vec<Finding>,
    folder: Scratch,
}

impl Package {
    /// Opens, checks and unpacks a .fmu file (binaries for this system, resources and
    /// reference results).
    ///
    /// # Errors
    /// The archive or its description is unusable, or the temporary folder cannot be written.
    pub fn open(path: &Path) -> Result<Self, PackageError> {
        let archived = |source| PackageError::Archive { path: path.to_owned(), source };
        let mut archive = Archive::open(path).map_err(archived)?;
        let text = archive.description().map_err(archived)?;
        let description = Description::parse(&text)
            .map_err(|source| PackageError::Description { path: path.to_owned(), source })?;
        let folder = Scratch::new()
            .map_err(|source| PackageError::Folder { path: path.to_owned(), source })?;
        let binaries = format!("binaries/{PLATFORM}/");
        archive
            .unpack(folder.path(), |name| {
                name.starts_with(&binaries)
                    || name.starts_with("resources/")
                    || name.starts_with(crate::reference::files::FOLDER)
            })
            .map_err(archived)?;
        let findings = archive
            .warnings()
            .iter()
            .map(|message| Finding {
                rule: "archive",
                severity: Severity::Warning,
                message: message.clone(),
            })
            .chain(description.findings.iter().cloned())
            .collect();
        let files = archive.files().map(str::to_owned).collect();
        Ok(Self { path: path.to_owned(), description, files, findings, folder })
    }

    /// Reads the description of a .fmu file and leaves the rest packed.
    ///
    /// # Errors
    /// The archive or its description is unusable.
    pub fn describe(path: &Path) -> Result<Description, PackageError> {
        let archived = |source| PackageError::Archive { path: path.to_owned(), source };
        let text = Archive::open(path).and_then(|mut it| it.description()).map_err(archived)?;
        Description::parse(&text)
            .map_err(|source| PackageError::Description { path: path.to_owned(), source })
    }

    /// Refuses a unit in which `maglev validate` finds an error: something that the standard forbids.
    ///
    /// # Errors
    /// All of them.
    pub fn refuse_defects(&self) -> Result<(), PackageError> {
        let findings = match validate::check(&self.path) {
            Ok(found) => found
                .into_iter()
                .filter(|finding| finding.severity == Severity::Error)
                .map(|finding| finding.message)
                .collect(),
            Err(error) => vec![error.to_string()],
        };
        if findings.is_empty() {
            return Ok(());
        }
        Err(PackageError::Defects { path: self.path.clone(), findings })
    }

    /// The .fmu file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder that it is unpacked to.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// What the unit says about itself.
    #[must_use]
    pub fn description(&self) -> &Description {
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

    /// The binary for this system, whether or not it exists.
    #[must_use]
    pub fn binary(&self) -> PathBuf {
        let name =
            format!("{}.{BINARY_EXTENSION}", self.description.co_simulation.model_identifier);
        self.folder.path().join("binaries").join(PLATFORM).join(name)
    }

    /// Names of the systems that the archive has a binary for.
    #[must_use]
    pub fn platforms(&self) -> Vec<&str> {
        let identifier = &self.description.co_simulation.model_identifier;
        let mut platforms: Vec<&str> = self
            .files
            .iter()
            .filter_map(|file| file.strip_prefix("binaries/")?.split_once('/'))
            .filter(|(_, name)| {
                name.rsplit_once('.').is_some_and(|(stem, end)| {
                    stem == identifier && ["so", "dll", "dylib"].contains(&end)
                })
            })
            .map(|(platform, _)| platform)
            .collect();
        platforms.sort_unstable();
        platforms
    }

    /// What there is to load or build, for who looks for a binary in vain.
    #[must_use]
    pub fn offer(&self) -> String {
        let platforms = self.platforms();
        if !platforms.is_empty() {
            return format!("it has binaries for: {}", platforms.join(", "));
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
            return "it comes as source code only (sources/), to be compiled first".to_owned();
        }
        "it has no binaries at all".to_owned()
    }

    /// URI of the unpacked resources, as instances receive it.
    #[must_use]
    pub fn resource_location(&self) -> String {
        file_uri(&self.resources())
    }

    /// The unpacked resources, whether or not there are any.
    #[must_use]
    pub fn resources(&self) -> PathBuf {
        self.folder.path().join("resources")
    }
}

/// A path as a URI with the scheme `file`.
#[must_use]
pub fn file_uri(path: &Path) -> String {
    let text = path.to_string_lossy().replace('\\', "/");
    let slash = if text.starts_with('/') { "" } else { "/" };
    format!("file://{slash}{}", utf8_percent_encode(&text, ESCAPED))
}
