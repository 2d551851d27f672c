//! A library in memory.

use std::mem::ManuallyDrop;
use std::sync::Arc;

use libloading::Library;

use crate::scratch::Scratch;

/// A library in memory, and the folder that its file is in.
///
/// On Windows the library is unloaded once nothing uses it: the system does not remove the file of a loaded library,
/// so the folder of an unpacked FMU would remain, and importers there unload libraries too. On other systems it stays
/// loaded until the process ends, since some libraries crash when they are unloaded: they have started threads or
/// registered exit handlers.
pub(crate) struct Loaded {
    library: ManuallyDrop<Library>,
    /// removed after the library is unloaded
    _folder: Option<Arc<Scratch>>,
}

impl Loaded {
    /// A library, and the temporary folder that its file is in.
    pub(crate) fn new(library: Library, folder: Option<Arc<Scratch>>) -> Self {
        Self { library: ManuallyDrop::new(library), _folder: folder }
    }

    pub(crate) fn library(&self) -> &Library {
        &self.library
    }
}

impl Drop for Loaded {
    fn drop(&mut self) {
        if cfg!(windows) {
            // SAFETY: the library is not used after this; all that call its functions have a share of this
            unsafe { ManuallyDrop::drop(&mut self.library) }
        }
    }
}
