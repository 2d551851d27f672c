//! The files that a unit brings along, and where they lie.

use std::cell::RefCell;
use std::path::{Component, Path, PathBuf};

use uuid::Uuid;

use crate::Error;

/// The unit's folder `resources`. Every file read through it while declaring counts into the
/// unit's GUID, so that a description and a library with other resources are not mixed up.
#[derive(Debug)]
pub struct Resources {
    folder: PathBuf,
    /// Names and hashes of what was read, in order.
    read: RefCell<Vec<(String, Uuid)>>,
}

impl Resources {
    /// Resources in `folder`, which need not exist: a unit may do without.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), read: RefCell::default() }
    }

    /// The folder. Files opened by this path rather than by [`Resources::read`] do not count into
    /// the GUID.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or the name leads out of the folder.
    pub fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let path = self.inside(name)?;
        let content = std::fs::read(&path).map_err(|error| {
            Error::invalid(format!("resource {name}: cannot read {}: {error}", path.display()))
        })?;
        let hash = Uuid::new_v5(&Uuid::NAMESPACE_OID, &content);
        self.read.borrow_mut().push((name.to_owned(), hash));
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
    /// It is there but cannot be read, or the name leads out of the folder.
    pub fn read_if_present(&self, name: &str) -> Result<Option<Vec<u8>>, Error> {
        if self.inside(name)?.exists() { self.read(name).map(Some) } else { Ok(None) }
    }

    fn inside(&self, name: &str) -> Result<PathBuf, Error> {
        let path = Path::new(name);
        let stays = path.components().all(|part| matches!(part, Component::Normal(_)));
        if name.is_empty() || !stays {
            let text = format!("resource {name:?}: a name inside the unit's resources is needed");
            return Err(Error::invalid(text));
        }
        Ok(self.folder.join(path))
    }

    /// What was read so far, as bytes for the GUID.
    pub(crate) fn fingerprint(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (name, hash) in self.read.borrow().iter() {
            bytes.extend_from_slice(name.as_bytes());
            bytes.push(0);
            bytes.extend_from_slice(hash.as_bytes());
        }
        bytes
    }
}
