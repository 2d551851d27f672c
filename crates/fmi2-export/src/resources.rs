//! The files in a unit's folder `resources`.

use std::cell::RefCell;
use std::path::{Component, Path, PathBuf};

use uuid::Uuid;

use crate::Error;

/// The unit's folder `resources`. Every file read through it during declaration is part of the
/// unit's GUID, so that a description and a library with different resources are detected.
#[derive(Debug)]
pub struct Resources {
    folder: PathBuf,
    instance: String,
    read: RefCell<Reads>,
}

/// Files that were read, in order.
#[derive(Debug, Default, Clone, PartialEq)]
pub(crate) struct Reads {
    /// Names and hashes of the files read.
    present: Vec<(String, Uuid)>,
    /// Names of files that were looked for and are missing.
    missing: Vec<String>,
}

impl Resources {
    /// Resources in `folder`, which need not exist: resources are optional.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), instance: String::new(), read: RefCell::default() }
    }

    /// The same for the instance of that name.
    #[must_use]
    pub(crate) fn of_instance(mut self, name: &str) -> Self {
        name.clone_into(&mut self.instance);
        self
    }

    /// The same, with nothing read yet.
    #[must_use]
    pub(crate) fn again(&self) -> Self {
        Self::new(self.path()).of_instance(self.instance_name())
    }

    /// Name of the instance, for example to tell random numbers of several instances apart; empty
    /// when the description is printed. Declarations must not depend on it.
    #[must_use]
    pub fn instance_name(&self) -> &str {
        &self.instance
    }

    /// The folder. Files opened by this path instead of [`Resources::read`] are not part of the
    /// GUID.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or the name points outside the folder.
    pub fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let path = self.inside(name)?;
        let content = std::fs::read(&path).map_err(|error| {
            Error::invalid(format!("resource {name}: cannot read {}: {error}", path.display()))
        })?;
        self.read.borrow_mut().present.push((name.to_owned(), hash(&content)));
        Ok(content)
    }

    /// Reads a text file.
    ///
    /// # Errors
    /// As [`Resources::read`], or it is not UTF-8.
    pub fn read_to_string(&self, name: &str) -> Result<String, Error> {
        String::from_utf8(self.read(name)?)
            .map_err(|error| Error::invalid(format!("resource {name} is not UTF-8: {error}")))
    }

    /// Reads a file that may be missing.
    ///
    /// # Errors
    /// It exists but cannot be read, or the name points outside the folder.
    pub fn read_if_present(&self, name: &str) -> Result<Option<Vec<u8>>, Error> {
        if self.inside(name)?.exists() {
            return self.read(name).map(Some);
        }
        self.read.borrow_mut().missing.push(name.to_owned());
        Ok(None)
    }

    fn inside(&self, name: &str) -> Result<PathBuf, Error> {
        let path = Path::new(name);
        let stays = path.components().all(|part| matches!(part, Component::Normal(_)));
        if name.is_empty() || !stays {
            let text = format!("resource {name:?}: the name must be inside the unit's resources");
            return Err(Error::invalid(text));
        }
        Ok(self.folder.join(path))
    }

    /// The files read so far.
    pub(crate) fn reads(&self) -> Reads {
        self.read.borrow().clone()
    }

    /// Whether these files would be read with the same content now.
    pub(crate) fn have(&self, reads: &Reads) -> bool {
        let same = |(name, known): &(String, Uuid)| {
            std::fs::read(self.folder.join(name)).is_ok_and(|content| hash(&content) == *known)
        };
        reads.present.iter().all(same)
            && !reads.missing.iter().any(|name| self.folder.join(name).exists())
    }

    /// Names and hashes of the files read so far, as bytes for the GUID.
    pub(crate) fn fingerprint(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (name, hash) in &self.read.borrow().present {
            bytes.extend_from_slice(name.as_bytes());
            bytes.push(0);
            bytes.extend_from_slice(hash.as_bytes());
        }
        bytes
    }
}

fn hash(content: &[u8]) -> Uuid {
    crate::description::version_5(&Uuid::NAMESPACE_OID, content)
}
